"""The entries of a linkage file: numbers with units, expressions and points, each read by its key, with all faults
collected."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import Any

from ...core import units
from ...core.errors import InputError, meant, near_name, shown
from ...core.quantities import USUAL, Quantity, Variable, base_units
from ...mechanism.assur import GROUND
from ...mechanism.expressions import Expression, as_float, expression
from ...reading.lists import Entry
from ...reading.tables import UnusualValue
from .dimensions import Dimensions, checked_dimension, dimension_of_unit
from .loads import MOTION, OF_POINT, parts_of_extreme
from .names import name_fault, words_in
from .way import WHOLE

UNITS = (
    "1", "m", "rad", "kg", "kg.m2", "N", "N.m", "N/m", "N.s/m", "N.m/rad", "N.m.s/rad", "m2", "m3", "kg/m", "kg/m3",
    "N/m2", "m/s", "m/s2", "rad/s", "s", "W", "J",
)  # fmt: skip
"""Units of parameters and inputs, in the order in which they are tried on a text."""


_USUAL = USUAL | {"m": (0.0, USUAL["m"][1]), "m2": (1e-8, 10.0), "kg/m3": (10.0, 3e4)}
"""Usual sizes by unit; a length may be a coordinate, of any small size."""

MOST_POINTS = 200
"""Largest number of points of a table, and of all tables of a file, each counted as often as a load takes it: each
point costs an export about 10 ms, and each step of an FMU about 6 ns."""
FEWER = f"must have at most {MOST_POINTS}: keep those between which the curve is nearly straight"
_DEGREES = re.compile(r"(\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+)\s*(?:deg\b|°)")
"""An angle in degrees inside an expression."""
_AXES = {"x": "m", "y": "m", "angle": "rad"}

LARGEST = 1e30
"""Largest size of a value in SI units."""
NameUnits = Mapping[str, str | None]
"""The units of quantities by name, None for one that its first use tells."""


class EntryReader(Entry):
    """The reader of the entries of one file. Its methods collect the fault of a wrong entry, or raise an InputError
    in one line, which a block `with self.at(key)` collects."""

    def __init__(self, data: Mapping[str, Any], name: str) -> None:
        super().__init__("", data)
        self.data, self.name = data, name
        self.inputs = self.table("inputs")
        self.units: dict[str, str | None] = {}
        self.derived: dict[str, str] = {}
        """parameters that are expressions of others, each after those in it"""
        self.derived_dimensions: Dimensions | None = None
        self.expressed: dict[tuple[str, str], None] = {}
        """keys and texts of all expressions that do not depend on the motion"""
        self.used: set[str] = set()
        self.refused: set[str] = set()
        self.points: dict[str, dict[str, list[Any]]] = {}
        self.unusual: list[UnusualValue] = []
        self.table_units: dict[str, str | None] = {}
        """units of the values of the tables over phi"""
        self.curve_units: dict[str, tuple[str | None, str | None]] = {}
        """units of the places and of the values of all tables"""
        self.sizes: dict[str, int] = {}
        """numbers of points of the tables"""
        self.looked_up = 0
        """points of the tables that loads and parameters look up"""

    def table(self, key: str, parent: Mapping[str, Any] | None = None) -> Mapping[str, Any]:
        """A table of the file, or of a `parent` table by the last name of its `key`; empty, with a fault, if it is
        none."""
        entry = (self.data if parent is None else parent).get(key.rpartition(".")[2], {})
        if not isinstance(entry, Mapping):
            self.fault(key, f"is {shown(entry)}; must be a table")
            return {}
        return entry

    def all(self, faults: Iterable[tuple[str, str]]) -> None:
        """Collect faults, each by key and message."""
        for key, message in faults:
            self.fault(key, message)

    def text(self, key: str, default: str, table: Mapping[str, Any] | None = None) -> str:
        """A text of the file, or of one of its tables by the last name of its `key`."""
        entry = (self.data if table is None else table).get(key.rpartition(".")[2], default)
        if not isinstance(entry, str):
            self.fault(key, f"is {shown(entry)}; must be a text")
            return default
        return entry

    def positive(self, key: str, entry: Any, unit: str, sign: str = ">=", inputs: bool = False) -> Any:
        """An entry, see `entry`; a number must be >= 0, or > 0 by the `sign`."""
        value = self.entry(key, entry, unit, inputs=inputs)
        if not isinstance(value, str) and (value < 0.0 or (value == 0.0 and sign == ">")):
            self.fault(key, f"is {shown(entry)}; must be {sign} 0")
        return value

    def flag(self, key: str, table: Mapping[str, Any]) -> Any:
        """A choice of a table by the last name of its `key`, false if it is not there."""
        value = table.get(key.rpartition(".")[2], False)
        if not isinstance(value, bool):
            self.fault(key, f"is {shown(value)}; must be true or false")
        return value

    def tables(self, kind: str, keys: tuple[str, ...] = ()) -> Iterator[tuple[str, str, Mapping[str, Any]]]:
        """The name, the full key and the table of each of the tables in a table; `keys` are the keys that they may
        have, if they are checked here."""
        entries = self.table(kind)
        self.fault_reserved_names(kind, entries)
        for name in entries:
            key = f"{kind}.{name}"
            table = self.table(key, entries)
            if keys:
                self.keys(key, table, keys)
            yield name, key, table

    def fault_reserved_names(self, key: str, names: Mapping[str, Any]) -> None:
        """Fault names that no variable can have."""
        for name in names:
            if wrong := name_fault(name):
                self.fault(f"{key}.{name}", wrong)
                self.refused.add(name)

    def doubt(self, variable: Variable, entry: Any, value: float) -> None:
        """Note the `value` of a key, which the file has as `entry`, if it is of no usual size."""
        doubt = UnusualValue.of_entry(variable, entry, value)
        if doubt is not None and doubt not in self.unusual:
            self.unusual.append(doubt)

    def number(self, key: str, entry: Any, unit: str, description: str = "") -> float:
        """A number, or a text with a unit, in the SI `unit`; one of an unusual size is noted by its key and this
        `description`, if the key is not empty."""
        parts = units.split(entry) if isinstance(entry, str) else None
        if isinstance(entry, bool) or (not isinstance(entry, int | float) and parts is None):
            hint = units.spelling(entry, unit) if isinstance(entry, str) else ""
            raise InputError(
                f"{is_given(entry)}; must be a number or a text with a unit, such as {_like(unit)}{hint}"
            )
        if parts is None:
            value = as_float(entry)
        elif not parts[1]:
            value = parts[0]
        elif units.converts(parts[1], unit):
            value = units.convert(*parts, unit)
        else:
            hint = units.spelling(entry, unit) or f"; the unit does not fit, write it as {_like(unit)}"
            raise InputError(f"is {shown(entry)}{hint}")
        within(value, entry)
        if unit == "rad" and abs(value) > WHOLE * (1.0 + 1e-12) and not units.has_unit(entry):
            raise InputError(
                f'is {shown(entry)}, more than a turn; {units.IN_RADIANS}, write degrees as "{value:g} deg"'
            )
        if unit != "rad" and key:
            self.doubt(sized(key, unit, _USUAL.get(unit), description), entry, value)
        return value

    def numbers(self, key: str, entry: Any, listed: Sequence[str], must: str) -> tuple[float, ...]:
        """A list of numbers in the `listed` units; `must` are the words on what it must be."""
        if not isinstance(entry, list) or len(entry) != len(listed):
            raise InputError(f"{is_given(entry)}; must be {must}")
        return tuple(self.number(key, x, unit) for x, unit in zip(entry, listed, strict=True))

    def entry(
        self, key: str, entry: Any, unit: str, motion: NameUnits | None = None, inputs: bool = False
    ) -> Any:
        """The value of a key: a number in the SI `unit`, or the text of an expression whose names and unit are right;
        NaN, with a fault, if it is wrong.

        Parameters
        ----------
        motion : of the entry of a load, the units of the names that it knows beside parameters and inputs
        inputs : whether an expression may name inputs
        """
        with self.at(key):
            if not isinstance(entry, str) or _is_quantity(entry):
                return self.number(key, entry, unit)
            if self.refused & words_in(entry):  # the name itself is faulted at its own key
                return math.nan
            self.check_expression(expression(entry), unit, motion, inputs)
            if motion is None:
                self.expressed[key, entry] = None
            return entry
        return math.nan

    def law_entry(self, key: str, law: Any, unit: str, unit_of_phi: str | None) -> Any:
        """The value of a key that may be an expression of ``phi``, with tables over it and with angles in degrees."""
        named = isinstance(law, str) and words_in(_DEGREES.sub("", law))
        text = _DEGREES.sub(r"(\1 * deg)", law) if named else law
        entry = self.entry(key, text, unit, {"phi": unit_of_phi, **self.table_units})
        if isinstance(entry, str):
            parsed = expression(entry)
            if parsed.extremes:
                self.fault(key, f"has {parsed.extremes[0]}, which depends on it; give a number")
            with self.at(key):
                self.count(parsed)
        return entry

    def check_expression(self, parsed: Expression, unit: str, motion: NameUnits | None, inputs: bool) -> None:
        """Refuse an expression with a wrong name, of another unit, or with a width that changes in a run; the
        arguments are as of `entry`. The parameters and inputs in it are used, and one that has no unit yet, and
        stands alone in it, has this one."""
        names = {**self.units, **(motion or {}), **self.further_units(parsed, motion is not None)}
        self.check_names(parsed, names, inputs)
        self.used |= {*parsed.names}
        name = parsed.text.strip()
        if parsed.names == (name,) and self.units.get(name, "") is None:
            self.units[name] = names[name] = unit
            self.derived_dimensions = None
        if names.get("phi", "") is not None:  # else the first driver is faulty, and its unit is not known
            checked_dimension(parsed.text, self.dimensions(names), unit)
        for width in parsed.widths:
            moving = {*width.of.names} & {*self.inputs, *(motion or {})} or {*width.of.tables}
            if moving:
                raise InputError(
                    f"is {shown(parsed.text)}; the width of {width.call} changes with {', '.join(sorted(moving))}; "
                    "must be a number or an expression of parameters; a ramp that begins at such a value a is "
                    "ramp(x - a, 0, width)"
                )

    def check_names(self, parsed: Expression, names: NameUnits, inputs: bool) -> None:
        """Refuse an expression with a name that is not among the `names`, or of an input without leave."""
        for name in parsed.names:
            if name not in names and name not in self.derived:
                raise InputError(f"is {shown(parsed.text)}; {name} is no parameter{self.note(name, names)}")
            if name in self.inputs and not inputs:
                raise InputError(
                    f"is {shown(parsed.text)}; {name} is an input, and lengths cannot change in a run; use a "
                    "parameter"
                )

    def dimensions(self, units: NameUnits) -> Dimensions:
        """The dimensions of names with these `units`, and of the parameters that are expressions of others."""

        def of_units(units: NameUnits) -> Dimensions:
            return {name: None if unit is None else dimension_of_unit(unit) for name, unit in units.items()}

        if self.derived_dimensions is None:
            dimensions = dict(of_units(self.units))
            self.derived_dimensions = {}
            for name, text in self.derived.items():
                dimensions[name] = None
                if name not in self.refused:
                    with self.at(f"parameters.{name}"):
                        dimensions[name] = checked_dimension(text, dimensions, None)
                self.derived_dimensions[name] = dimensions[name]
        return {**self.derived_dimensions, **of_units(units)}

    # extremes of the motion and tables in expressions

    def further_units(self, parsed: Expression, in_load: bool) -> dict[str, str | None]:
        """The units of the extremes and tables of an expression, by name; a load may have them."""
        if not in_load:
            self.count(parsed)
            if parsed.extremes or parsed.tables:
                raise InputError(
                    f"is {shown(parsed.text)}; extremes and tables over x belong into the force or torque of a load"
                )
            return {}
        units_by_name: dict[str, str | None] = {
            extreme: self.extreme(extreme, parsed.text) for extreme in parsed.extremes
        }
        for name in parsed.tables:
            if name not in self.curve_units:
                if name in self.refused:
                    continue
                hint = near_name(name, self.curve_units)
                raise InputError(f"is {shown(parsed.text)}; {name} is no table{hint}")
            units_by_name[f"x of {name}"], units_by_name[f"table {name}"] = self.curve_units[name]
            self.used.add(name)
        return units_by_name

    def count(self, *expressions: Expression) -> None:
        """Add the points of the tables in the expressions of a load or of a parameter to the number of the file: a
        table over phi counts once in all of them, a table over x as often as it is looked up.

        Raises
        ------
        InputError
            in one line, for the expressions with which the file first has more than `MOST_POINTS`.
        """
        before = self.looked_up
        over_phi = {name for parsed in expressions for name in parsed.names} & {*self.table_units}
        for parsed in expressions:
            self.looked_up += sum(parsed.points) + sum(self.sizes.get(name, 0) for name in parsed.lookups)
        self.looked_up += sum(self.sizes[name] for name in over_phi)
        if before <= MOST_POINTS < self.looked_up:
            raise InputError(
                f"brings the points of tables to {self.looked_up}, those of a table as often as a load takes it; "
                f"{FEWER}"
            )

    def note(self, name: str, names: Iterable[str]) -> str:
        """A hint on a name that is not known in an expression."""
        if name in self.curve_units:
            return f"; it is a table over x: write table(x, {name})"
        if name in MOTION:
            return f"; {name} is known in a {'force' if name in OF_POINT else 'load'} alone"
        return near_name(name, names)

    def extreme(self, name: str, text: str) -> str:
        """The unit of an extreme.

        Raises
        ------
        InputError
            in one line, if the linkage has no such place.
        """
        begin = f"is {shown(text)}; in {name} "
        if "." not in name:
            argument = name.partition("(")[2].removesuffix(")")
            raise InputError(
                f"{begin}{argument} is no place of the motion; write a point of a link and its axis, such as "
                "min(ram.C.y); of two numbers the lesser is min(a, b)"
            )
        _, link, point, axis = parts_of_extreme(name)
        if link not in self.points or link == GROUND:
            links = [candidate for candidate in self.points if candidate != GROUND]
            raise InputError(f"{begin}{link} is no link{meant(link, links)} links: {', '.join(links)}")
        if point and point not in self.points[link]:
            raise InputError(
                f"{begin}{point} is no point of {link}{meant(point, self.points[link])} its points: "
                f"{', '.join(self.points[link])}"
            )
        if axis not in _AXES or (point and axis == "angle"):
            raise InputError(f"{begin}{axis} must be x or y of a point, or x, y or angle of a link")
        return _AXES[axis]

    # points

    def vector(
        self, key: str, entry: Any, unit: str, motion: NameUnits | None = None, inputs: bool = False
    ) -> list[Any]:
        """Two entries."""
        if not isinstance(entry, list) or len(entry) != 2:
            self.fault(key, f"{is_given(entry)}; must be a list of two, along x and y")
            return [0.0, 0.0]
        return [self.entry(key, component, unit, motion, inputs) for component in entry]

    def points_in(self, key: str, points: Mapping[str, Any]) -> dict[str, list[Any]]:
        """Points by name."""
        self.fault_reserved_names(key, points)
        return {name: self.vector(f"{key}.{name}", place, "m") for name, place in points.items()}

    def with_unit(self, entry: Any, unit: Any) -> tuple[float, str | None]:
        """A value in SI units, and its unit; None if its first use tells it."""
        if unit is not None:
            fits = [si_unit for si_unit in UNITS if _same_unit(str(unit), si_unit)]
            if not fits:
                raise InputError(
                    f"unit = {shown(unit)}: no unit that a linkage knows; known: {', '.join(UNITS)}"
                )
            return self.number("", entry, fits[0]), fits[0]
        parts = units.split(entry) if isinstance(entry, str) else None
        # what begins with a sign after the number is an expression
        if parts is not None and parts[1][:1] not in ("", "+", "-", "*", "/"):
            for si_unit in UNITS:
                if units.converts(parts[1], si_unit):
                    return within(units.convert(*parts, si_unit), entry), si_unit
        if isinstance(entry, str) and words_in(entry) & {*self.units, *self.table("parameters")}:
            raise InputError(
                f"is {shown(entry)}; must be a number with a unit; a parameter may be an expression"
            )
        if parts is None or not parts[1]:
            return self.number("", entry, "1"), None
        hints = [units.spelling(entry, si_unit) for si_unit in UNITS]
        unknown = f"; the unit is not known; write it as in {_like('m')}"
        raise InputError(f"is {shown(entry)}{next((hint for hint in hints if 'meant' in hint), unknown)}")


def sized(key: str, unit: str, usual: tuple[float, float] | None, description: str = "") -> Variable:
    """The value of a key as a variable of these `usual` sizes, with this `description`."""
    description = description or units.kind_of(unit)
    return Variable(key, description, Quantity(unit, description, usual=usual))


Places = Mapping[str, Mapping[str, tuple[float, float]]]
"""By link, its points at the start values of the parameters [m]."""


def usual_distance(link: str, points: Places, ends: set[tuple[str, ...]]) -> float:
    """The largest distance from the origin of a link [m] at which its points and its centroid are expected: the
    distance of its farthest joint, and ten times the size of the linkage. `ends` are the names (link, point) of the
    points at joints. The size is the largest distance of two joints on one link; without a size, the result is 0."""
    joints = {
        name: [place for point, place in places.items() if (name, point) in ends]
        for name, places in points.items()
    }
    size = max((math.dist(a, b) for places in joints.values() for a in places for b in places), default=0.0)
    farthest = max((math.hypot(*place) for place in joints[link]), default=0.0)
    return farthest + 10.0 * size if size else 0.0


_DENSITY = 8000.0
"""[kg/m3], of steel: no usual part is denser."""


def usual_inertia(mass: float, points: Iterable[tuple[float, float]]) -> tuple[float, float]:
    """The least and the largest inertia [kg m2] that is expected of a `mass` [kg] with these points [m].

    The radius of gyration is compared with the radius of gyration of a steel ball of the mass, and with the size of
    the link: a slip of mm2 or cm2 for m2 is a factor of 1000 or 100 in it. A disc on a short crank, and a drive that
    is reckoned to it, have a large one.
    """
    ball = math.sqrt(0.4) * (0.75 * mass / (math.pi * _DENSITY)) ** (1.0 / 3.0)
    places = list(points)
    size = max((math.dist(a, b) for a in places for b in places), default=0.0)
    return mass * max(ball / 30.0, size / 200.0) ** 2, mass * (100.0 * max(ball, size)) ** 2


def _is_quantity(text: str) -> bool:
    """Whether a text is a number with a unit, and no expression that begins with a number, such as ``0.5 * l``.

    Raises
    ------
    InputError
        for an expression that has a unit inside.
    """
    parts = units.split(text)
    if parts is None or parts[1][:1] in ("+", "-", "*", "/"):
        return False
    if parts[1].startswith(",") and re.search(r"[+*/()]", parts[1]):
        raise InputError(f"is {shown(text)}; {units.COMMA}")
    is_unit = any(units.converts(parts[1], unit) for unit in UNITS)  # such as kg*m2 or N/(m s)
    if re.search(r"[+*()]|\s[-/]\s", parts[1]) and not is_unit:
        raise InputError(
            f"is {shown(text)}; an expression has no units inside: write its numbers in SI units, such as "
            "2 * r + 0.01"
        )
    return True


def within(value: float, entry: Any) -> float:
    """A value in SI units, by the text or number that is `entry`.

    Raises
    ------
    InputError
        for one that is not finite, or so large that products of such values are not.
    """
    if not abs(value) <= LARGEST:
        raise InputError(f"is {shown(entry)}; must be finite, and <= {LARGEST:g} in size")
    return value


def is_among(entry: Any, names: Collection[str]) -> bool:
    """Whether an entry is one of some names; it may be a list or a table."""
    return isinstance(entry, str) and entry in names


def is_given(value: Any) -> str:
    """Words on a value that is wrong or missing."""
    return "is missing" if value is None else f"is {shown(value)}"


def _like(unit: str) -> str:
    """An example of a quantity of a unit."""
    usual = units.fitting(unit)
    return f'"2 {usual[0]}"' if usual else '"0.2"'


def _same_unit(text: str, unit: str) -> bool:
    """Whether a text is the name of the SI `unit`, as FMI or as an engineer writes it."""
    try:
        return units.convert(1.0, text, unit) == 1.0 if text != "1" else unit == "1"
    except ValueError:
        return text.replace(" ", ".") == unit and bool(base_units(unit) or unit == "1")
