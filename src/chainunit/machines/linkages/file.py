"""The file of a linkage: TOML in, the description of a machine out (`chainunit.machines.linkages.model`).

Each entry that is a quantity is a number in SI units, a text with a unit ("80 mm"), or an expression of parameters
("2 * r + 10 mm" has no unit inside: write ``2 * r + 0.01``). All faults of a file come at once, each with its key.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from ...core.engines import MATH
from ...core.errors import InputError, RemarkWarning, each_refusal, meant, near_name, printable, shown
from ...core.inputs import TOML, file_text
from ...mechanism.assur import DYADS, GROUND, ONE_DRIVER, PRISMATIC, REVOLUTE
from ...mechanism.expressions import value_of
from ...mechanism.models import InverseMachine
from ...reading import toml_lines
from ...reading.tables import UnusualValue, in_file, slips_of, toml
from .checks import (
    POINT_NAMES,
    alike_points,
    freedom_faults,
    guide_faults,
    length_faults,
    model_name,
    name_fault,
    quantity_names,
    spring_faults,
    study_fault,
    usual_distance,
    usual_inertia,
    words_in,
)
from .declarations import RESERVED
from .entries import is_among, is_given, sized
from .joint_kind import JointEntry
from .joint_kinds import KEYS, KINDS, SINGLES, kind_of
from .load_entries import LoadReader
from .model import machine_of
from .shared_pins import shared_pins
from .start import StartPose
from .start_branches import check_start
from .structure import CYLINDER
from .way import WHOLE

TABLES = (
    "title", "name", "about", "gravity", "ratio", "parameters", "inputs", "tables", "ground", "driver", "links",
    "joints", "loads", "pins", "guides", "start", "groups",
)  # fmt: skip
_LINK_KEYS = ("points", "mass", "inertia", "centroid", "masses", "bar")
_LARGEST_START = 1e4
"""Largest place of the driver at the start [rad, m]."""
_DRIVES = ("belt", "chain", "cam", "rack", "rolling")
"""Kinds of joints of other programs."""
_DRIVER_KEYS = ("link", "joint", "zero", "positive", "range")


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
    for value in slips_of(unusual):
        warnings.warn(value.sentence, RemarkWarning, stacklevel=2)
    return machine


def linkage_in(file: Path) -> tuple[InverseMachine, tuple[UnusualValue, ...]]:
    """The model of the machine in a linkage file, and the values of the file that are of an unusual size.

    Raises
    ------
    InputError
        as `read_linkage`.
    """
    text = file_text(file, TOML)
    with in_file(str(file), lambda: toml_lines.lines_of(text)):
        return linkage_from(toml(text), file.stem, file.parent)


def linkage_from(
    data: Mapping[str, Any], name: str, folder: Path = Path()
) -> tuple[InverseMachine, tuple[UnusualValue, ...]]:
    """The model of the machine in the tables of a file in a `folder`, and the values that are of an unusual size;
    `name` is that of the machine where the file has none.

    Raises
    ------
    InputError
        with a line for each fault, which names the key.
    """
    reader = _LinkageReader(data, name, folder)
    try:
        description = reader.description()
        # what is wrong of a group is told at its first link
        with each_refusal(lambda fault: InputError(f"{fault.key or 'links'}: {fault}", fault.key or "links")):
            machine = machine_of(description)
            check_start(machine.described_by)  # type: ignore[attr-defined]
        return machine, tuple(reader.unusual)
    except InputError as error:
        # where lengths do not fit together, one may be a slip of the unit
        slips = [InputError(str(value), value.name) for value in reader.unusual if value.meant]
        raise InputError.joined([*error.faults, *slips]) from error


def description_of(data: Mapping[str, Any], name: str, folder: Path = Path()) -> dict[str, Any]:
    """The description of a machine from the tables of a file in a `folder`; `name` is that of the machine where the
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
        """The description."""
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
        ground = self.points_in("ground", self.table("ground"))
        self.points[GROUND] = ground
        links = [self.link(name, table) for name, table in self.links().items()]
        joints = self.joints()
        driver, span = self.driver(joints)
        loads = [self.load(name, entry) for name, entry in self.table("loads").items()]
        common, groups, about = self.common(), self.groups(), self.about()
        self.fault_unused(parameters, inputs, tables)
        derived = [{"name": name} for name in self.derived]
        self.all(quantity_names([*parameters, *derived], inputs, self.table("tables"), RESERVED, links))
        self.all([*spring_faults(loads, joints), *guide_faults(data, joints)])
        self.refuse()
        alike = alike_points(self.points, self.named_points(links, loads))
        self.all(freedom_faults(links, joints, driver, alike))
        owned = [
            {"name": f"{name}_of_{link['name']}", "value": x}
            for link in links
            for name, x in link["own"].items()
        ]
        values = self.start_values([*parameters, *inputs, *owned])
        self.refuse()
        start = self.start(values, links, joints, driver, span)
        self.refuse()
        for joint in joints:
            for carrier, points in joint.pop("points", {}).items():
                if carrier == GROUND:
                    ground = {**ground, **points}
                links = [
                    link | {"points": {**link["points"], **points}} if link["name"] == carrier else link
                    for link in links
                ]
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
        if self.derived:
            described["derived"] = [*self.derived.items()]
        return described

    def fault_drivers(self) -> None:
        """Fault a list of drivers; the reader goes on with the first one."""
        drivers = self.data.get("driver")
        if isinstance(drivers, list) and drivers and isinstance(drivers[0], Mapping):
            several = f"stands there {len(drivers)} times: {ONE_DRIVER}; take all but one out, and"
            self.fault("driver", f"{several if len(drivers) > 1 else 'is a list;'} write [driver]")
            self.data = {**self.data, "driver": drivers[0]}

    def named_points(self, links: list[dict[str, Any]], loads: list[dict[str, Any]]) -> set[tuple[str, ...]]:
        """The points that joints of the file, loads and masses name, by link."""
        joints = [joint for joint in self.table("joints").values() if isinstance(joint, Mapping)]
        ends = [joint.get(key) for joint in joints for key in ("on", "by")]
        named = {tuple(end.split(".")) for end in ends if isinstance(end, str)}
        named |= {tuple(load[key]) for load in loads for key in ("on", "by") if key in load}
        named |= {(link["name"], point) for link in links for point in link["masses"]}
        lines = [str(joint["toward"]).rpartition(".")[2] for joint in joints if "toward" in joint]
        return named | {(link, line) for link in self.points for line in lines}

    def groups(self) -> list[Any]:
        """The groups that the file lists, each with its kind, if it is given, and its links."""
        tables, groups = self.data.get("groups", []), []
        if not isinstance(tables, list) or not all(isinstance(table, Mapping) for table in tables):
            self.fault("groups", f"is {shown(tables)}; must be tables [[groups]] with kind and links")
            return []
        kinds = (*DYADS, "triad", CYLINDER, *SINGLES)
        for k, table in enumerate(tables, 1):
            key = f"groups.{k}"
            self.keys(key, table, ("kind", "links"))
            kind, links = table.get("kind", ""), table.get("links")
            if kind not in ("", *kinds):
                self.fault(f"{key}.kind", f"is {shown(kind)}; must be one of {', '.join(kinds)}")
            if not isinstance(links, list) or not links or not all(isinstance(link, str) for link in links):
                self.fault(f"{key}.links", f"{is_given(links)}; must be a list of links")
                continue
            for link in sorted({*links} - {*self.points}):
                self.fault(f"{key}.links", f"{link} is no link{near_name(link, self.points)}")
            groups.append([kind, links])
        return groups

    def fault_unused(
        self, parameters: list[dict[str, Any]], inputs: list[dict[str, Any]], tables: Mapping[str, Any]
    ) -> None:
        """Fault parameters, inputs and tables that nothing uses; a name in a faulty entry may be meant to be used."""
        texts = words_in([self.data[key] for key in self.data if key not in ("parameters", "inputs")])
        names = (*self.derived, *tables, *(entry["name"] for entry in (*parameters, *inputs)))
        mentioned = {name for name in names if self.errors and (name in texts or near_name(name, texts))}
        for kind, entries in (("parameters", parameters), ("inputs", inputs)):
            for entry in entries:
                name = entry["name"]
                if name not in self.used | self.refused | mentioned:
                    self.fault(f"{kind}.{name}", "nothing uses it; use it, or take it out")
                entry["unit"] = entry["unit"] or self.units[name] or "1"
                with self.at(f"{kind}.{name}"):
                    self.in_its_unit(f"{kind}.{name}", self.table(kind)[name], entry)
        for name in self.derived:
            if name not in self.used | mentioned:
                self.fault(f"parameters.{name}", "nothing uses it; use it, or take it out")
        for name in tables:
            if name not in self.used | self.refused | mentioned:
                self.fault(f"tables.{name}", "no load uses it; use it, or take it out")

    def in_its_unit(self, key: str, written: Any, entry: Mapping[str, Any]) -> None:
        """Look at the size of a parameter or an input, whose unit its first use may tell."""
        whole = written if isinstance(written, Mapping) else {"value": written}
        value = f"{whole['value']} {whole['unit']}" if "unit" in whole else whole["value"]
        self.number(key, value, entry["unit"], entry["description"])

    def links(self) -> Mapping[str, Any]:
        """The tables of the links."""
        links = self.table("links")
        self.fault_reserved_names("links", links)
        if not links:
            self.fault(
                "links", "there is none; give at least the link that the driver turns, as [links.crank]"
            )
        if GROUND in links:
            self.fault("links.ground", "is no link; points of the ground stand in [ground]")
        for name in links:
            self.points[name] = {}
        return links

    def link(self, name: str, entry: Any) -> dict[str, Any]:
        """A link."""
        key = f"links.{name}"
        table = self.table(key, self.table("links"))
        self.keys(key, table, _LINK_KEYS)
        points = self.points_in(f"{key}.points", self.table(f"{key}.points", table))
        for point in points:
            if point in POINT_NAMES:
                self.fault(f"{key}.points.{point}", "is a variable of every link; choose another name")
        is_misspelled = any(
            near_name(entry_key, ("points",)) for entry_key in table if entry_key not in _LINK_KEYS
        )
        has_table = isinstance(entry, Mapping) and isinstance(entry.get("points", {}), Mapping)
        if not points and has_table and not is_misspelled:
            self.fault(key, "has no points; give points = { A = [0, 0], ... } in the frame of the link")
        self.points[name] = points
        link: dict[str, Any] = {"name": name, "points": points, "own": {}}
        if "bar" in table:
            link |= self.bar(key, table, points)
        else:
            for quantity_name, unit in (("mass", "kg"), ("inertia", "kg.m2")):
                if quantity_name in table:
                    value = self.positive(f"{key}.{quantity_name}", table[quantity_name], unit)
                    link[quantity_name] = self.own(link, quantity_name, value)
            if "centroid" in table:
                link["centroid"] = self.vector(f"{key}.centroid", table["centroid"], "m")
        masses = self.table(f"{key}.masses", table)
        for point in masses:
            if point not in points:
                self.fault(f"{key}.masses.{point}", f"is no point of {name}{near_name(point, points)}")
        link["masses"] = {
            point: self.positive(f"{key}.masses.{point}", mass, "kg") for point, mass in masses.items()
        }
        return link

    def own(self, link: dict[str, Any], name: str, value: Any) -> Any:
        """A plain number becomes a parameter of the link."""
        if isinstance(value, str):
            return value
        link["own"][name] = value
        return f"{name}_of_{link['name']}"

    def bar(self, key: str, table: Mapping[str, Any], points: Mapping[str, Any]) -> dict[str, Any]:
        """A uniform bar between two points: its mass and inertia by section and density."""
        bar = self.table(f"{key}.bar", table)
        self.keys(f"{key}.bar", bar, ("from", "to", "area", "density"))
        for quantity in ("mass", "inertia", "centroid"):
            if quantity in table:
                self.fault(f"{key}.{quantity}", "follows from bar; take one of both out")
        ends = [bar.get(end) for end in ("from", "to")]
        for end in ends:
            if not is_among(end, points):
                self.fault(f"{key}.bar", f"from and to must be two points of the link: {', '.join(points)}")
                return {}
        if ends[0] == ends[1]:
            self.fault(f"{key}.bar", f"goes from {ends[0]} to {ends[0]}; from and to must be two points")
        (ax, ay), (bx, by) = (points[str(end)] for end in ends)
        area = self.entry(f"{key}.bar.area", bar.get("area"), "m2")
        density = self.entry(f"{key}.bar.density", bar.get("density"), "kg/m3")
        for quantity, value in (("area", area), ("density", density)):
            if not isinstance(value, str) and value <= 0.0 and quantity in bar:
                self.fault(f"{key}.bar.{quantity}", f"is {shown(bar[quantity])}; must be > 0")
        square = f"((({bx}) - ({ax}))**2 + (({by}) - ({ay}))**2)"
        mass = f"({area}) * ({density}) * sqrt({square})"
        middle = [f"0.5 * (({a}) + ({b}))" for a, b in ((ax, bx), (ay, by))]
        return {"mass": mass, "inertia": f"{mass} * {square} / 12.0", "centroid": middle}

    def joints(self) -> list[dict[str, Any]]:
        """The joints: the named ones, and a revolute one for each further link in a point of the same name."""
        joints = []
        for name, key, table in self.tables("joints"):
            kind = KINDS.get(str(kind_name := kind_of(table)))
            if kind is None:
                drive = "; a belt or a cam between links is not possible yet" * (kind_name in _DRIVES)
                possible = " or ".join(f'"{possible_name}"' for possible_name in KINDS)
                self.fault(f"{key}.type", f"is {shown(kind_name)}; must be {possible}{drive}")
                continue
            loss_table, loss_keys = kind.losses
            for entry_key in {*loss_keys} & {*table}:
                self.fault(
                    f"{key}.{entry_key}",
                    f"is not possible for one joint yet; give it in [{loss_table}], for all of them",
                )
            self.keys(
                key, {entry_key: x for entry_key, x in table.items() if entry_key not in loss_keys}, KEYS
            )
            ends = []
            for end in ("on", "by"):
                with self.at(f"{key}.{end}"):
                    ends.append(self.end(table.get(end)))
            if len(ends) < 2:
                continue
            if ends[0][0] == ends[1][0]:
                self.fault(key, f"joins the link {ends[0][0]} with itself")
                continue
            joint: dict[str, Any] = {"name": name, "type": kind.name, "on": ends[0], "by": ends[1]}
            kind.read(self, key, table, joint)
            for other in KINDS.values():
                for entry_key in other.keys:
                    if entry_key in table and entry_key not in kind.keys:
                        use = other.use.format(by=ends[1][0])
                        self.fault(
                            f"{key}.{entry_key}",
                            f"belongs to a {other.name} joint, and this one is a {kind.noun}: {use}",
                        )
            joints.append(joint)
        for joint in joints:
            KINDS[joint["type"]].complete(self, joint, joints)
            for link, points in joint.get("points", {}).items():
                if not {*points}.isdisjoint((*self.points[link], *POINT_NAMES)):
                    self.fault(
                        f"joints.{joint['name']}", f"gives {link} a point of its name, too; rename the joint"
                    )
        more, clashes = shared_pins(self.points, joints, self.table("driver"))
        for name, message in clashes:
            self.fault(f"joints.{name}", message)
        return joints + more

    def driver(self, joints: list[dict[str, Any]]) -> tuple[dict[str, Any], list[float] | None]:
        """The driver, and its range; None for one that turns all the way round."""
        table = self.table("driver")
        self.keys("driver", table, _DRIVER_KEYS)
        if "joint" in table:
            return self.slide(table, joints)
        link = table.get("link")
        links = [name for name in self.points if name != GROUND]
        if not is_among(link, links):
            if links and isinstance(self.data.get("driver", {}), Mapping):
                self.fault(
                    "driver.link" if table else "driver",
                    f"{is_given(link)}; must be the link that the motor turns{meant(str(link), links)} links: "
                    f"{', '.join(links)}",
                )
            return {}, None
        pivots = [j for j in joints if {j["on"][0], j["by"][0]} == {GROUND, link} and j["type"] == REVOLUTE]
        if len(pivots) != 1:
            self.fault(
                "driver.link",
                f"{link} must have one revolute joint with the ground; it has {len(pivots)}: give it a point with "
                "the name of a point in [ground]",
            )
            return {}, None
        positive = table.get("positive", "counter-clockwise")
        if positive not in ("clockwise", "counter-clockwise"):
            self.fault("driver.positive", f'is {shown(positive)}; must be "clockwise" or "counter-clockwise"')
        zero = self.entry("driver.zero", table.get("zero", 0.0), "rad")
        sense = -1.0 if positive == "clockwise" else 1.0
        driver = {"joint": pivots[0]["name"], "link": link, "linear": False, "zero": zero, "sense": sense}
        if "range" not in table:
            return driver, None
        return driver | {"swings": True}, self.span(table, "angle", "rad", '["-20 deg", "75 deg"]')

    def span(self, table: Mapping[str, Any], place: str, unit: str, example: str) -> list[float]:
        """The range of the driver, between two values of its `place`."""
        span = [0.0, 0.0]
        with self.at("driver.range"):
            limits = table.get("range")
            if not isinstance(limits, list) or len(limits) != 2:
                raise InputError(f"must be the least and the most {place} of the driver, such as {example}")
            span = [self.number("driver.range", limit, unit) for limit in limits]
            if not span[0] < span[1]:
                raise InputError(f"is {shown(limits)}; must rise, from the least to the most {place}")
            if unit == "rad" and span[1] - span[0] > WHOLE * (1.0 + 1e-12):
                plain = any(isinstance(limit, int | float) for limit in limits)
                raise InputError(
                    f"is {shown(limits)}, more than a turn; for a driver that turns all the way round leave it out"
                    + '; a number without a unit is in radians, write degrees as "10 deg"' * plain
                )
        return span

    def slide(
        self, table: Mapping[str, Any], joints: list[dict[str, Any]]
    ) -> tuple[dict[str, Any], list[float] | None]:
        """A driver that slides."""
        for name in ("link", "zero", "positive"):
            if name in table:
                self.fault(
                    f"driver.{name}", "belongs to a driver that turns; a driver with a joint slides in it"
                )
        sliding = {j["name"]: j for j in joints if j["type"] == PRISMATIC}
        joint = sliding.get(table["joint"]) if isinstance(table["joint"], str) else None
        if joint is None:
            pin = any(j["name"] == table["joint"] for j in joints)
            self.fault(
                "driver.joint",
                f"is {shown(table['joint'])}{', which is a pin' * pin}; must be a prismatic joint, a table "
                f"[joints.NAME] with `toward`: {', '.join(sliding) or 'there is none'}",
            )
            return {}, None
        link = joint["by"][0] if joint["on"][0] == GROUND else joint["on"][0]
        span = self.span(table, "way", "m", "[0.2, 0.6]")
        return {"joint": joint["name"], "link": link, "linear": True}, span

    # the start pose

    def start(
        self,
        values: Mapping[str, float],
        links: list[dict[str, Any]],
        joints: list[dict[str, Any]],
        driver: dict[str, Any],
        span: Sequence[float] | None,
    ) -> dict[str, Any]:
        """The value of the driver at the start, and the poses of all links there; `values` are those of the
        parameters."""
        table = self.table("start")
        self.keys("start", table, ("phi", "points", "angles", "poses"))

        def number(entry: Any) -> float:
            return float(value_of(MATH, entry, values))

        points = {
            link: {name: (number(x), number(y)) for name, (x, y) in those.items()}
            for link, those in self.points.items()
        }
        self.all(length_faults(points, joints, driver["link"]))
        self.doubt_bodies(links, points, joints, number)
        entries = [
            (
                JointEntry.from_table(j),
                number(j.get("angle", 0.0)),
            )
            for j in joints
        ]
        pose = StartPose(points, entries)
        value = 0.0
        with self.at("start.phi"):
            value = self.number("start.phi", table.get("phi", 0.0), "m" if driver["linear"] else "rad")
            if abs(value) > _LARGEST_START:
                raise InputError(f"is {shown(table['phi'])}; must be <= {_LARGEST_START:g} in size")
            if span and not driver["linear"] and not span[0] <= value <= span[1]:
                phi_text = f"is {shown(table['phi'])}" if "phi" in table else "is 0 where it is not given"
                low, high = (f"{math.degrees(end):g} deg" for end in span)
                raise InputError(f"{phi_text}; must be an angle in driver.range, from {low} to {high}")
        self.given_pose(table, pose)
        if driver["linear"]:
            pose.slide = next(joint for joint, _ in entries if joint.name == driver["joint"]), value
        else:
            pose.angles[driver["link"]] = number(driver["zero"]) + driver["sense"] * value
        self.refuse()
        with self.at("start"):
            return {"value": value, "poses": pose.complete()}
        return {}

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
        """Points, angles and poses that the file gives."""
        for name, entry in self.table("start.points", table).items():
            key = f"start.points.{name}"
            owners = [link for link, points in self.points.items() if name in points and link != GROUND]
            for where in self.tables_of_point(key, name, entry, owners):
                pose.places[where[0], where[1]] = where[2]
        for link, angle in self.table("start.angles", table).items():
            with self.at(f"start.angles.{link}"):
                self.known_link(link)
                pose.angles[link] = self.number(f"start.angles.{link}", angle, "rad")
        for link, entry in self.table("start.poses", table).items():
            with self.at(f"start.poses.{link}"):
                self.known_link(link)
                if not isinstance(entry, list) or len(entry) != 3:
                    raise InputError("must be a list of three: x, y and angle of the frame of the link")
                x, y, angle = (
                    self.number(f"start.poses.{link}", v, unit)
                    for v, unit in zip(entry, ("m", "m", "rad"), strict=True)
                )
                pose.poses[link] = x, y, angle

    def known_link(self, link: str) -> None:
        """Refuse the name of no link."""
        if link not in self.points or link == GROUND:
            raise InputError(f"{link} is no link{near_name(link, self.points)}")

    def tables_of_point(
        self, key: str, name: str, entry: Any, owners: list[str]
    ) -> Iterator[tuple[str, str, tuple[float, float]]]:
        """The places of a point; `entry` is a place, or a table of points of the link `name`."""
        entries = [(name, link, entry) for link in owners]
        if isinstance(entry, Mapping):
            entries = [(point, name, place) for point, place in entry.items()]
        elif not owners:
            self.fault(key, f"{name} is no point of a link")
        elif not isinstance(entry, list) or len(entry) != 2:
            self.fault(key, f"is {shown(entry)}; must be a list of two, along x and y")
            return
        for point, link, place in entries:
            with self.at(key):
                if point not in self.points.get(link, {}):
                    raise InputError(f"{point} is no point of {link}")
                if not isinstance(place, list) or len(place) != 2:
                    raise InputError(f"is {shown(place)}; must be a list of two, along x and y")
                x, y = (self.number(key, coordinate, "m") for coordinate in place)
                yield link, point, (x, y)
