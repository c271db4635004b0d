"""The file of a linkage: TOML in, the description of a machine out (`chainunit.machines.linkages.model`).

Each entry that is a quantity is a number in SI units, a text with a unit ("80 mm"), or an expression of parameters
("2 * r + 10 mm" has no unit inside: write ``2 * r + 0.01``). All faults of a file come at once, each with its key.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from ...core.engines import MATH
from ...core.errors import InputError, RemarkWarning, each_refusal, meant, near_name, printable, shown
from ...core.inputs import TOML, file_text
from ...mechanism.assur import FURTHER_DRIVERS, GROUND, GROUPS, PRISMATIC, REVOLUTE, FixedLinksError
from ...mechanism.curves import TableCurve
from ...mechanism.expressions import LawCourse, splines, value_of
from ...mechanism.models import InverseMachine
from ...reading import toml_lines
from ...reading.tables import UnusualValue, in_file, slips_of, toml
from .cam import CamKind
from .checks import (
    POINT_NAMES,
    freedom_faults,
    guide_faults,
    length_faults,
    quantity_names,
    spring_faults,
    study_fault,
)
from .entries import is_among, is_given, sized, usual_distance, usual_inertia
from .further import BACK
from .joint_kind import JointEntry
from .joint_kinds import KEYS, KINDS, SINGLES, kind_of
from .load_entries import LoadReader
from .model import machine_of
from .names import model_name, name_fault
from .shared_pins import shared_pins
from .start import StartPose, check_start
from .way import WHOLE

TABLES = (
    "title", "name", "about", "gravity", "ratio", "parameters", "inputs", "tables", "ground", "driver", "drivers",
    "links", "joints", "loads", "pins", "guides", "cams", "start", "groups",
)  # fmt: skip
_LINK_KEYS = ("points", "mass", "inertia", "centroid", "masses", "bar", "stiffness")
_LAW_PLACES = 96
"""Places of the first driver at which a law is checked."""
_LARGEST_START = 1e4
"""Largest place of the driver at the start [rad, m]."""
_DRIVER_KEYS = ("link", "joint", "zero", "positive", "range")
_FURTHER_KEYS = (*_DRIVER_KEYS, "phi", "by", "start")
_GEAR, _MOTOR = "gear", "motor"
_RANGES = '["-20 deg", "75 deg"]', "[0.2, 0.6]"
"""Examples of the range of a driver that turns and of one that slides."""


def read_linkage(file: Path) -> InverseMachine:
    """The model of the machine in a linkage file.

    Raises
    ------
    InputError
        with a line for each fault, which names file, line and key.

    Warns
    -----
    RemarkWarning
        for a value that looks like a slip of its unit.
    """
    machine, unusual = linkage_in(file)
    _warn(unusual)
    return machine


def linkage_in(file: Path) -> tuple[InverseMachine, tuple[UnusualValue, ...]]:
    """The model of the machine in a linkage file, and the values of the file that are of an unusual size.

    Raises
    ------
    InputError
        as `read_linkage`.
    """
    with _tables_of(file) as tables:
        return linkage_from(tables, file.stem, file.parent)


def linkage_unless_study(file: Path) -> InverseMachine | None:
    """The model of the machine in a linkage file; None for a study file, which has none of its tables.

    Raises
    ------
    InputError, RemarkWarning
        as `read_linkage`.
    """
    with _tables_of(file) as tables:
        if not {"links", "ground", "driver", "joints"} & tables.keys():
            return None
        machine, unusual = linkage_from(tables, file.stem, file.parent)
    _warn(unusual)
    return machine


@contextmanager
def _tables_of(file: Path) -> Iterator[dict[str, Any]]:
    """The tables of a file; a refusal in the block names the file and the line of its key."""
    text = file_text(file, TOML)
    with in_file(str(file), lambda: toml_lines.lines_of(text)):
        yield toml(text)


def _warn(unusual: Iterable[UnusualValue]) -> None:
    """Warn of the values that look like a slip of their unit."""
    for value in slips_of(unusual):
        warnings.warn(value.sentence, RemarkWarning, stacklevel=3)


def linkage_from(
    data: Mapping[str, Any], name: str, folder: Path = Path()
) -> tuple[InverseMachine, tuple[UnusualValue, ...]]:
    """The model of the machine in the tables of a file in a `folder`, and the values that are of an unusual size;
    `name` is the name of a machine to which the file gives none.

    Raises
    ------
    InputError
        with a line for each fault, which names the key.
    """
    reader = _LinkageReader(data, name, folder)
    try:
        description = reader.description()
        # the fault of a group belongs to its first link
        with each_refusal(lambda fault: InputError(f"{fault.key or 'links'}: {fault}", fault.key or "links")):
            machine = machine_of(description)
            check_start(machine.described_by)  # type: ignore[attr-defined]
        return machine, tuple(reader.unusual)
    except InputError as error:
        # if lengths do not fit together, one may be a slip of the unit
        slips = [InputError(str(value), value.name) for value in reader.unusual if value.meant]
        raise InputError.joined([*error.faults, *slips]) from error


def description_of(data: Mapping[str, Any], name: str, folder: Path = Path()) -> dict[str, Any]:
    """The description of a machine from the tables of a file in a `folder`; `name` is that of the machine if the
    file has none.

    Raises
    ------
    InputError
        with a line for each fault, which names the key.
    """
    return _LinkageReader(data, name, folder).description()


class _LinkageReader(LoadReader):
    """The reader of one file."""

    def description(self) -> dict[str, Any]:
        """The description of the machine, as `LinkageDescription` takes it."""
        study_fault(self.data)
        self.fault_drivers()
        data = self.data
        self.keys("", data, TABLES)
        name, title = self.text("name", model_name(self.name)), printable(self.text("title", ""))
        if "name" in data and (wrong := name_fault(name)):
            self.fault("name", f"is {shown(name)}; {wrong}")
        parameters = self.quantities("parameters")
        inputs = self.quantities("inputs")
        tables = self.curves()
        ground = self.points[GROUND] = self.points_in("ground", self.table("ground"))
        links = [self.link(name) for name in self.link_names()]
        joints = self.joints()
        driver, span = self.driver("driver", self.table("driver"), joints)
        drivers: list[dict[str, Any]] = []
        for entries in self.tables("drivers", _FURTHER_KEYS):
            drivers.append(self.further_driver(*entries, [driver, *drivers], joints))
        loads = [self.load(name) for name in self.table("loads")]
        common, groups, about = self.common(), self.groups(), self.about()
        losses = self.differing(joints, common)
        self.fault_unused(parameters, inputs, tables)
        names = {
            "parameters": [*(entry["name"] for entry in parameters), *self.derived],
            "inputs": [entry["name"] for entry in inputs],
            "tables": [*self.table("tables")],
            "drivers": [*self.table("drivers")],
        }
        self.all(quantity_names(names, links))
        self.all([*spring_faults(loads, joints), *guide_faults(data, joints)])
        self.refuse()
        fixed = None
        try:
            self.all(freedom_faults(self.points, links, joints, loads, [driver, *drivers]))
        except FixedLinksError as fault:
            fixed = fault
        owned = [
            {"name": f"{quantity}_of_{link['name']}", "value": x}
            for link in links
            for quantity, x in link["own"].items()
        ]
        values = self.start_values([*parameters, *inputs, *owned])
        for link in links:
            if isinstance(text := link.get("stiffness"), str) and value_of(MATH, text, values) <= 0.0:
                self.fault(
                    f"links.{link['name']}.stiffness", f"is {shown(text)}, which is not > 0 at the start"
                )
        self.refuse()
        try:
            start = self.start(values, links, joints, driver, span, drivers, tables)
            self.refuse()
        except InputError:
            self.fixed_fault(fixed)
            self.refuse()
        for joint in joints:
            for carrier, points in joint.pop("points", {}).items():
                self.points[carrier] |= points
        described = {
            "name": name,
            "title": title,
            "about": about,
            "common": common,
            "parameters": parameters,
            "inputs": inputs,
            "tables": tables,
            "ground": ground,
            "links": links,
            "joints": joints,
            "driver": driver,
            "range": span,
            "loads": loads,
            "groups": groups,
            "start": start,
        }
        more = {"derived": [*self.derived.items()], "losses": losses, "drivers": drivers}
        self.fixed_fault(fixed, described)
        self.refuse()
        return described | {key: entries for key, entries in more.items() if entries}

    def fixed_fault(self, fault: FixedLinksError | None, described: Mapping[str, Any] | None = None) -> None:
        """Fault links that are fixed more than once, with a joint or one of them without which the linkage as
        `described` closes over the way, clear of dead positions, as tried."""
        if fault is None:
            return
        parts = {name: f"the joint {name}" for name in self.table("joints")}
        parts |= {link: f"the link {link}" for link in fault.links}
        hint = "as tried, the linkage does not work without any one of its links or joints alone"
        for name, what in parts.items() if described else ():
            rest = dict(described or {}, loads=[], groups=[])
            rest["links"] = [link for link in rest["links"] if link["name"] != name]
            rest["joints"] = [j for j in rest["joints"] if name not in (j["name"], j["on"][0], j["by"][0])]
            # a gear may need what is left out
            with suppress(InputError, KeyError):
                check_start(machine_of(rest).described_by)  # type: ignore[attr-defined]
                hint = f"without {what} the linkage closes all the way, clear of dead positions"
                break
        self.fault(f"links.{fault.key}", f"{fault}; {hint}" if described else str(fault))

    def fault_drivers(self) -> None:
        """Fault a list of drivers; the reader goes on with the first one."""
        drivers = self.data.get("driver")
        if isinstance(drivers, list) and drivers and isinstance(drivers[0], Mapping):
            several = f"stands there {len(drivers)} times; {FURTHER_DRIVERS}:"
            self.fault("driver", f"{several if len(drivers) > 1 else 'is a list;'} write [driver]")
            self.data = {**self.data, "driver": drivers[0]}

    def groups(self) -> list[Any]:
        """The groups that the file lists, each with its kind, if it is given, and its links."""
        tables, groups = self.data.get("groups", []), []
        if not isinstance(tables, list) or not all(isinstance(table, Mapping) for table in tables):
            self.fault("groups", f"is {shown(tables)}; must be tables [[groups]] with kind and links")
            return []
        kinds = (*GROUPS, *SINGLES)
        for k, table in enumerate(tables, 1):
            key, kind, links = f"groups.{k}", table.get("kind", ""), table.get("links")
            self.keys(key, table, ("kind", "links"))
            if kind not in ("", *kinds):
                self.fault(f"{key}.kind", f"is {shown(kind)}; must be one of {', '.join(kinds)}")
            if not isinstance(links, list) or not links or not all(isinstance(link, str) for link in links):
                self.fault(f"{key}.links", f"{is_given(links)}; must be a list of links")
                continue
            for link in sorted({*links} - {*self.points}):
                self.fault(f"{key}.links", f"{link} is no link{near_name(link, self.points)}")
            groups.append([kind, links])
        return groups

    def link_names(self) -> Iterable[str]:
        """The names of the links."""
        links = self.table("links")
        self.fault_reserved_names("links", links)
        if not links:
            self.fault(
                "links", "there is none; give at least the link that the driver turns, as [links.crank]"
            )
        if GROUND in links:
            self.fault("links.ground", "is no link; points of the ground stand in [ground]")
        self.points |= {name: {} for name in links}
        return links

    def link(self, name: str) -> dict[str, Any]:
        """A link; a mass or an inertia that is a plain number becomes a parameter of its own."""
        key = f"links.{name}"
        entry = self.data["links"][name]
        table = self.table(key, self.table("links"))
        self.keys(key, table, _LINK_KEYS)
        points = self.points[name] = self.points_in(f"{key}.points", self.table(f"{key}.points", table))
        for point in points:
            if point in POINT_NAMES:
                self.fault(f"{key}.points.{point}", "is a variable of every link; choose another name")
        is_misspelled = any(near_name(k, ("points",)) for k in table if k not in _LINK_KEYS)
        has_table = isinstance(entry, Mapping) and isinstance(entry.get("points", {}), Mapping)
        if not points and has_table and not is_misspelled:
            self.fault(key, "has no points; give points = { A = [0, 0], ... } in the frame of the link")
        link: dict[str, Any] = {"name": name, "points": points, "own": {}}
        if "bar" in table:
            link |= self.bar(key, table, points)
        else:
            for quantity, unit in (("mass", "kg"), ("inertia", "kg.m2")):
                if quantity in table:
                    value = link[quantity] = self.positive(
                        f"{key}.{quantity}", table[quantity], unit, inputs=True
                    )
                    if not isinstance(value, str):
                        link["own"][quantity], link[quantity] = value, f"{quantity}_of_{name}"
            if "centroid" in table:
                link["centroid"] = self.vector(f"{key}.centroid", table["centroid"], "m")
        if "stiffness" in table:
            link["stiffness"] = self.positive(f"{key}.stiffness", table["stiffness"], "N/m", ">")
        masses = self.table(f"{key}.masses", table)
        for point in masses:
            if point not in points:
                self.fault(f"{key}.masses.{point}", f"is no point of {name}{near_name(point, points)}")
        link["masses"] = {
            point: self.positive(f"{key}.masses.{point}", mass, "kg", inputs=True)
            for point, mass in masses.items()
        }
        return link

    def bar(self, key: str, table: Mapping[str, Any], points: Mapping[str, Any]) -> dict[str, Any]:
        """A uniform bar between two points: its mass and inertia by section and density."""
        bar = self.table(f"{key}.bar", table)
        self.keys(f"{key}.bar", bar, ("from", "to", "area", "density"))
        for quantity in ("mass", "inertia", "centroid"):
            if quantity in table:
                self.fault(f"{key}.{quantity}", "follows from bar; take one of both out")
        start, end = (bar.get(name) for name in ("from", "to"))
        if not is_among(start, points) or not is_among(end, points):
            self.fault(f"{key}.bar", f"from and to must be two points of the link: {', '.join(points)}")
            return {}
        if start == end:
            self.fault(f"{key}.bar", f"goes from {start} to {start}; from and to must be two points")
        (ax, ay), (bx, by) = points[str(start)], points[str(end)]
        sizes = {
            quantity: self.positive(f"{key}.bar.{quantity}", bar.get(quantity), unit, ">")
            for quantity, unit in (("area", "m2"), ("density", "kg/m3"))
        }
        square = f"((({bx}) - ({ax}))**2 + (({by}) - ({ay}))**2)"
        mass = f"({sizes['area']}) * ({sizes['density']}) * sqrt({square})"
        middle = [f"0.5 * (({a}) + ({b}))" for a, b in ((ax, bx), (ay, by))]
        return {"mass": mass, "inertia": f"{mass} * {square} / 12.0", "centroid": middle}

    def joints(self) -> list[dict[str, Any]]:
        """The joints: the named ones, and a revolute one for each further link in a point of the same name."""
        named = [self.joint(name, key, table) for name, key, table in self.tables("joints")]
        joints = [joint for joint in named if joint is not None]
        for joint in joints:
            KINDS[joint["type"]].complete(self, joint, joints)
            for link, points in joint.get("points", {}).items():
                if not {*points}.isdisjoint((*self.points[link], *POINT_NAMES)):
                    self.fault(
                        f"joints.{joint['name']}", f"gives {link} a point of its name, too; rename the joint"
                    )
        further = [table for table in self.table("drivers").values() if isinstance(table, Mapping)]
        drivers = [self.table("driver"), *further]
        more, clashes = shared_pins(self.points, joints, drivers)
        self.all((f"joints.{name}", message) for name, message in clashes)
        return joints + more

    def joint(self, name: str, key: str, table: Mapping[str, Any]) -> dict[str, Any] | None:
        """A joint that the file names; None, with a fault, without its kind and its ends."""
        kind_name = kind_of(table)
        kind = KINDS.get(str(kind_name))
        if kind is None:
            possible = " or ".join(f'"{possible_name}"' for possible_name in KINDS)
            self.fault(f"{key}.type", f"is {shown(kind_name)}; must be {possible}")
            return None
        loss_table, loss_keys = kind.losses
        for loss in {*loss_keys} & {*table}:
            self.fault(
                f"{key}.{loss}",
                f"stands in [{loss_table}.{name}], or for all in [{loss_table}]",
            )
        self.keys(key, {entry_key: x for entry_key, x in table.items() if entry_key not in loss_keys}, KEYS)
        ends = []
        for end in ("on", "by"):
            with self.at(f"{key}.{end}"):
                ends.append(self.end(table.get(end)))
        if len(ends) < 2:
            return None
        (on, _), (by, _) = ends
        if on == by:
            self.fault(key, f"joins the link {on} with itself")
            return None
        joint: dict[str, Any] = {"name": name, "type": kind.name, "on": ends[0], "by": ends[1]}
        kind.read(self, key, table, joint)
        for other in KINDS.values():
            for other_key in other.keys:
                if other_key in table and other_key not in kind.keys:
                    use = other.use.format(by=by)
                    message = f"belongs to a {other.name} joint, and this one is a {kind.noun}: {use}"
                    self.fault(f"{key}.{other_key}", message)
        return joint

    def further_driver(
        self,
        name: str,
        key: str,
        table: Mapping[str, Any],
        before: Sequence[Mapping[str, Any]],
        joints: list[dict[str, Any]],
    ) -> dict[str, Any]:
        """A driver besides the first one, after those `before` it: it follows the first one by a law, or is an input
        of its own."""
        entry, span = self.driver(key, table, joints)
        entry |= {"name": name}
        if not entry.get("link"):
            return entry
        first, named = before[0], "joint" if "joint" in table else "link"
        grounded = [j["name"] for j in joints if GROUND in (j["on"][0], j["by"][0])]

        def motion(driver: Mapping[str, Any]) -> tuple[Any, Any]:
            """What it moves: a link in the ground, or by a joint of two links that move."""
            joint = driver.get("joint")
            return driver.get("link"), GROUND if joint in grounded else joint

        same = next((driver for driver in before if motion(driver) == motion(entry)), None)
        if same is not None:
            whose = f"drivers.{same['name']}" if "name" in same else "driver"
            self.fault(
                f"{key}.{named}",
                f"is {shown(table[named])}, and [{whose}] moves {entry['link']} already; name another {named}, or "
                f"take [{key}] out",
            )
        unit, law, by = "m" if entry["linear"] else "rad", table.get("phi"), table.get("by", _GEAR)
        if law is None:
            if span is None:
                self.fault(
                    f"{key}.range",
                    "is missing; a driver that is an input of its own needs one, such as "
                    f"{_RANGES[entry['linear']]}; one that follows the "
                    'first driver has a law, such as phi = "2 * phi + 30 deg"',
                )
            if "by" in table:
                self.fault(f"{key}.by", "belongs to a driver with a law in phi, and this one is an input")
            low, high = span or (0.0, 0.0)
            with self.at(f"{key}.start"):
                start = self.number(f"{key}.start", table.get("start", 0.5 * (low + high)), unit)
                if low < high and not low <= start <= high:
                    raise InputError(
                        f"is {shown(table['start'])}; must be within {key}.range, {shown(table['range'])}"
                    )
                entry |= {"start": start}
            return entry | {"span": [low, high]}
        for other in ("range", "start"):
            if other in table:
                self.fault(f"{key}.{other}", "follows from the law in phi; take one of both out")
        if by not in (_GEAR, _MOTOR):
            self.fault(
                f"{key}.by",
                f'is {shown(by)}; must be "{_GEAR}", if the first driver drives it, or "{_MOTOR}", if it has one of '
                "its own",
            )
        # the unit of a faulty one is not known
        unit_of_phi = ("m" if first["linear"] else "rad") if first else None
        entry["law"] = self.law_entry(f"{key}.phi", law, unit, unit_of_phi)
        return entry | {"geared": by == _GEAR}

    def driver(
        self, key: str, table: Mapping[str, Any], joints: list[dict[str, Any]]
    ) -> tuple[dict[str, Any], list[float] | None]:
        """The driver in a table, and its range; None for one that turns all the way round."""
        if key == "driver":
            further = [name for name, entry in table.items() if isinstance(entry, Mapping)]
            for name in further:
                self.fault(f"{key}.{name}", f"is a table; a driver besides the first one is [drivers.{name}]")
            table = {name: entry for name, entry in table.items() if name not in further}
            self.keys(key, table, _DRIVER_KEYS)
        if "joint" in table:
            between = [j for j in joints if j["type"] == REVOLUTE and GROUND not in (j["on"][0], j["by"][0])]
            motors = {joint["name"]: joint["on"][0] for joint in between}
            if not is_among(table["joint"], motors):
                return self.slide(key, table, joints, motors)
            if "link" in table:
                self.fault(f"{key}.link", "follows from the joint; take one of both out")
            pivot, link = table["joint"], motors[table["joint"]]
        else:
            link, links = table.get("link"), [name for name in self.points if name != GROUND]
            if not is_among(link, links):
                if links and isinstance(self.data.get("driver", {}), Mapping):
                    self.fault(
                        f"{key}.link" if table else key,
                        f"{is_given(link)}; must be the link that the motor turns{meant(str(link), links)} links: "
                        f"{', '.join(links)}",
                    )
                return {}, None
            ends = {GROUND, link}
            pivots = [j["name"] for j in joints if {j["on"][0], j["by"][0]} == ends and j["type"] == REVOLUTE]
            if len(pivots) != 1:
                self.fault(
                    f"{key}.link",
                    f"{link} must have one revolute joint with the ground; it has {len(pivots)}: give it a point "
                    "with the name of a point in [ground]; a motor between two moving links has "
                    'joint = "NAME", their pin, in place of link',
                )
                return {}, None
            pivot = pivots[0]
        positive = table.get("positive", "counter-clockwise")
        if positive not in ("clockwise", "counter-clockwise"):
            self.fault(f"{key}.positive", f'is {shown(positive)}; must be "clockwise" or "counter-clockwise"')
        zero = self.entry(f"{key}.zero", table.get("zero", 0.0), "rad")
        sense = -1.0 if positive == "clockwise" else 1.0
        driver = {"joint": pivot, "link": link, "linear": False, "zero": zero, "sense": sense}
        if "range" not in table:
            return driver, None
        span = self.span(key, table["range"], "angle", "rad", _RANGES[0])
        return driver | {"swings": True}, span

    def slide(
        self, key: str, table: Mapping[str, Any], joints: list[dict[str, Any]], motors: Iterable[str]
    ) -> tuple[dict[str, Any], list[float] | None]:
        """The driver that slides in the prismatic joint that its table names, with the link that moves, and its range
        [m]; nothing and None, with a fault, for another joint."""
        kinds = {joint["name"]: joint["type"] for joint in joints}
        sliding = {joint["name"]: joint for joint in joints if joint["type"] == PRISMATIC}
        name = table["joint"]
        if not is_among(name, sliding):
            pin = ", which is a pin of the ground: for that give `link`" * is_among(name, kinds)
            self.fault(
                f"{key}.joint",
                f"is {shown(name)}{pin}; must be a prismatic joint, a table [joints.NAME] with `toward`, or a pin of "
                f"two links that move: {', '.join((*sliding, *motors)) or 'there is none'}",
            )
            return {}, None
        for other in ("link", "zero", "positive"):
            if other in table:
                self.fault(f"{key}.{other}", f"belongs to a driver that turns, and this one slides in {name}")
        (on, _), (by, _) = sliding[name]["on"], sliding[name]["by"]
        span = None
        if key == "driver" or "range" in table:
            span = self.span(key, table.get("range"), "way", "m", _RANGES[1])
        return {"joint": name, "link": by if on == GROUND else on, "linear": True}, span

    def span(self, key: str, limits: Any, place: str, unit: str, example: str) -> list[float]:
        """The range of the driver, between two values of its `place`."""
        with self.at(f"{key}.range"):
            must = f"the least and the most {place} of the driver, such as {example}"
            low, high = self.numbers(f"{key}.range", limits, (unit, unit), must)
            if not low < high:
                raise InputError(f"is {shown(limits)}; must rise, from the least to the most {place}")
            if unit == "rad" and high - low > WHOLE * (1.0 + 1e-12):
                plain = any(isinstance(limit, int | float) for limit in limits)
                raise InputError(
                    f"is {shown(limits)}, more than a turn; for a driver that turns all the way round leave it out"
                    + '; a number without a unit is in radians, write degrees as "10 deg"' * plain
                )
            return [low, high]
        return [0.0, 0.0]

    # the start pose

    def start(
        self,
        values: Mapping[str, float],
        links: list[dict[str, Any]],
        joints: list[dict[str, Any]],
        driver: dict[str, Any],
        span: Sequence[float] | None,
        drivers: list[dict[str, Any]],
        tables: Mapping[str, Any],
    ) -> dict[str, Any]:
        """The value of the driver at the start, and the poses of all links there; `values` are the values
        of the parameters."""
        table = self.table("start")
        self.keys("start", table, ("phi", "points", "angles", "poses"))

        def number(entry: Any) -> float:
            return float(value_of(MATH, entry, values))

        points = {
            link: {name: (number(x), number(y)) for name, (x, y) in places.items()}
            for link, places in self.points.items()
        }
        self.all(length_faults(points, joints, [entry["link"] for entry in (driver, *drivers)]))
        self.doubt_bodies(links, points, joints, number)
        entries = {j["name"]: (JointEntry.from_table(j), number(j.get("angle", 0.0))) for j in joints}
        in_frames = {
            link: {name: complex(*place) for name, place in places.items()} for link, places in points.items()
        }
        held = [*entries.values()]
        pose = StartPose(in_frames, held)
        value, linear = 0.0, driver["linear"]
        with self.at("start.phi"):
            value = self.number("start.phi", table.get("phi", 0.0), "m" if linear else "rad")
            if abs(value) > _LARGEST_START:
                raise InputError(f"is {shown(table['phi'])}; must be <= {_LARGEST_START:g} in size")
            if span and not span[0] <= value <= span[1]:
                phi_text = f"is {shown(table['phi'])}" if "phi" in table else "is 0 if it is not given"
                low, high = (f"{end:g} m" if linear else f"{math.degrees(end):g} deg" for end in span)
                raise InputError(
                    f"{phi_text}; must be {'a way' if linear else 'an angle'} in driver.range, from {low} to {high}"
                )
        self.given_pose(table, pose)
        curves = splines(tables, span is None)
        for joint in joints:
            if isinstance(kind := KINDS[joint["type"]], CamKind):
                self.all(kind.profile_faults(joint, values, curves))
        for entry in drivers:
            if "law" in entry:
                self.law(entry, value, values, curves, span)
        self.refuse()
        for entry, place in ((driver, value), *((entry, entry["start"]) for entry in drivers)):
            if entry["linear"]:
                pose.slides.append((entries[entry["joint"]][0], place))
            else:
                hinge, turn = entries[entry["joint"]][0], number(entry["zero"]) + entry["sense"] * place
                if GROUND in hinge.links:
                    pose.angles[entry["link"]] = turn
                else:  # as a guide keeps the angle of its links
                    held.append((hinge._replace(kind=PRISMATIC), turn))
        self.refuse()
        with self.at("start"):
            return {"value": value, "poses": pose.complete()}
        return {}

    def law(
        self,
        entry: dict[str, Any],
        start: float,
        values: Mapping[str, float],
        tables: Mapping[str, TableCurve],
        span: Sequence[float] | None,
    ) -> None:
        """Add its place at the `start` of the first driver, and its rate, to a driver that follows; refuse a law that
        has no value on the way, or that does not come back after a turn."""
        course = LawCourse(entry["law"], values, tables)
        low, high = span or (start, start + WHOLE)
        with self.at(f"drivers.{entry['name']}.phi"):
            try:
                course_places = [
                    course(MATH, low + (high - low) * k / _LAW_PLACES) for k in range(_LAW_PLACES + 1)
                ]
                entry["start"] = float(course(MATH, start).place)
            except (ArithmeticError, ValueError):
                raise InputError("has no value at a place of the driver") from None
            whole = course_places[-1].place - course_places[0].place
            turns = whole / WHOLE
            if span is None and not abs(whole if entry["linear"] else math.sin(0.5 * whole)) < BACK:
                moved = f"{whole:.6g} m" if entry["linear"] else f"{turns:.6g} turns"
                speeds = [float(point.rates[0]) for point in course_places]
                is_even = not entry["linear"] and max(speeds) - min(speeds) < BACK * max(map(abs, speeds))
                remedy = "give a law with the same place at 0 and 360 deg"
                if is_even:
                    slower = "take the slower of both for [driver]" if abs(turns) < 1.0 else ""
                    remedy = slower or "turn the faster one a whole number of times as fast"
                raise InputError(
                    f"moves by {moved} in a turn of the first driver, and must come back after it: {remedy}, or "
                    "let [driver] swing by a range"
                )
            rates = [[float(rate) for rate in point.rates[:2]] for point in course_places]
            for quantity, course_rates in zip(
                ("speed", "acceleration"), zip(*rates, strict=True), strict=True
            ):
                first, last, largest = course_rates[0], course_rates[-1], max(map(abs, course_rates))
                if span is None and abs(last - first) > 1e-6 * largest:
                    raise InputError(
                        f"its {quantity} jumps after a turn of the first driver, from {last:.4g} to {first:.4g} "
                        "times that of the first one; must be the same at 0 and 360 deg, as of sin(phi) or 2 * phi"
                    )
            if not entry["linear"]:
                entry["rate"] = max(1.0, *(abs(float(point.rates[0])) for point in course_places))

    def doubt_bodies(
        self,
        links: list[dict[str, Any]],
        points: Mapping[str, Mapping[str, tuple[float, float]]],
        joints: list[dict[str, Any]],
        number: Callable[[Any], float],
    ) -> None:
        """Note centroids and points that lie far outside the linkage, and inertias that do not go with their masses,
        at the start values of the parameters."""
        ends = {tuple(joint[end]) for joint in joints for end in ("on", "by")}
        usual = {link: usual_distance(link, points, ends) for link in points}
        for link in links:
            name, table = link["name"], self.table(f"links.{link['name']}", self.table("links"))
            places = [
                (f"points.{point}", table["points"][point], place) for point, place in points[name].items()
            ]
            if "centroid" in table:
                x, y = map(number, link["centroid"])
                places.append(("centroid", table["centroid"], (x, y)))
            noted = {value.name for value in self.unusual}
            for key, written, place in places:
                variable = sized(f"links.{name}.{key}", "m", (0.0, usual[name]))
                for text, x in zip(written, place, strict=True):
                    if usual[name] and variable.name not in noted:
                        self.doubt(variable, text, x)
            mass = number(link.get("mass", 0.0))
            if "inertia" in table and mass > 0.0:
                description = f"inertia of {mass:g} kg about the centroid"
                limits = usual_inertia(mass, points[name].values())
                variable = sized(f"links.{name}.inertia", "kg.m2", limits, description)
                self.doubt(variable, table["inertia"], number(link["inertia"]))

    def given_pose(self, table: Mapping[str, Any], pose: StartPose) -> None:
        """Take what the table of the start gives into the `pose`: places of points, angles of links, and whole poses.
        A point by its name alone is that point of every link that has it."""
        links = {name: points for name, points in self.points.items() if name != GROUND}
        for name, entry in self.table("start.points", table).items():
            key = f"start.points.{name}"
            # the point of that name of each link, or the points of the link of that name
            places = {(link, name): entry for link, points in links.items() if name in points}
            if isinstance(entry, Mapping):
                places = {(name, point): place for point, place in entry.items()}
            elif not places:
                self.fault(key, f"{name} is no point of a link")
            for (link, point), place in places.items():
                with self.at(key):
                    if point not in self.points.get(link, {}):
                        raise InputError(f"{point} is no point of {link}")
                    must = "a list of two, along x and y"
                    pose.places[link, point] = complex(*self.numbers(key, place, ("m", "m"), must))
        for kind in ("angles", "poses"):
            for link, entry in self.table(f"start.{kind}", table).items():
                key = f"start.{kind}.{link}"
                with self.at(key):
                    if link not in links:
                        raise InputError(f"{link} is no link{near_name(link, self.points)}")
                    if kind == "angles":
                        pose.angles[link] = self.number(key, entry, "rad")
                    else:
                        must = "a list of three: x, y and angle of the frame of the link"
                        x, y, angle = self.numbers(key, entry, ("m", "m", "rad"), must)
                        pose.poses[link] = complex(x, y), angle
