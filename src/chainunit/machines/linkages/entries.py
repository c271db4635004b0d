"""The entries of a linkage file: numbers with units, expressions, points, parameters, inputs and tables, each read by
its key, with all faults collected."""

from __future__ import annotations

import contextlib
import math
import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import fields, replace
from graphlib import CycleError, TopologicalSorter
from typing import Any

from ...core import units
from ...core.errors import InputError, near_name, printable, shown
from ...core.model import About
from ...core.quantities import USUAL, Layout, Quantity, Variable, base_units
from ...mechanism.expressions import CONSTANTS, WORDS, Expression, as_float, expression
from ...reading.lists import Entry
from ...reading.tables import UnusualValue
from .checks import name_fault, words_in
from .declarations import CommonParameters
from .dimensions import Dimensions, checked_dimension, dimension_of_unit
from .loads import MOTION, OF_POINT
from .way import WHOLE

UNITS = (
    "1", "m", "rad", "kg", "kg.m2", "N", "N.m", "N/m", "N.s/m", "N.m/rad", "N.m.s/rad", "m2", "m3", "kg/m", "kg/m3",
    "N/m2", "m/s", "m/s2", "rad/s", "s", "W", "J",
)  # fmt: skip
"""Units of parameters and inputs, in the order in which they are tried on a text."""


_USUAL = USUAL | {"m": (0.0, USUAL["m"][1]), "m2": (1e-8, 10.0), "kg/m3": (10.0, 3e4)}
"""Usual sizes by unit; a length may be a coordinate, of any small size."""

LARGEST = 1e30
"""Largest size of a value in SI units."""
Known = Mapping[str, str | None]


class EntryReader(Entry):
    """The reader of the entries of one file."""

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

    def table(
        self, key: str, parent: Mapping[str, Any] | None = None, default: Any = None
    ) -> Mapping[str, Any]:
        """A table; faults where it is none."""
        name = key.rpartition(".")[2]
        entry = (self.data if parent is None else parent).get(name, {} if default is None else default)
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

    def positive(self, key: str, entry: Any, unit: str) -> Any:
        """An entry that may name inputs; a number must be >= 0."""
        value = self.entry(key, entry, unit, inputs=True)
        if not isinstance(value, str) and value < 0.0:
            self.fault(key, f"is {shown(entry)}; must be >= 0")
        return value

    def tables(self, kind: str, keys: tuple[str, ...] = ()) -> Iterator[tuple[str, str, Mapping[str, Any]]]:
        """The tables in a table, each behind its name and its full key; their keys are `keys`, if any are given."""
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
        """Note the `value` of a key, which the file has as `entry`, where it is of no usual size."""
        doubt = UnusualValue.of_entry(variable, entry, value)
        if doubt is not None and doubt not in self.unusual:
            self.unusual.append(doubt)

    def number(self, key: str, entry: Any, unit: str, description: str = "") -> float:
        """A number, or a text with a unit; the variable has this `description`. One of an unusual size is noted."""
        if isinstance(entry, bool) or not isinstance(entry, int | float | str):
            raise InputError(
                f"{is_given(entry)}; must be a number or a text with a unit, such as {_like(unit)}"
            )
        if isinstance(entry, str):
            parts = units.split(entry)
            if parts is None:
                raise InputError(
                    f"is {shown(entry)}; must be a number or a text with a unit, such as {_like(unit)}"
                    f"{units.spelling(entry, unit)}"
                )
            try:
                value = units.convert(*parts, unit) if parts[1] else parts[0]
            except ValueError:
                hint = units.spelling(entry, unit)
                raise InputError(
                    f"is {shown(entry)}{hint or f'; the unit does not fit, write it as {_like(unit)}'}"
                ) from None
        else:
            value = as_float(entry)
        within(value, entry)
        if unit == "rad" and abs(value) > WHOLE * (1.0 + 1e-12) and not units.has_unit(entry):
            raise InputError(
                f'is {shown(entry)}, more than a turn; {units.IN_RADIANS}, write degrees as "{value:g} deg"'
            )
        if unit != "rad" and key:
            self.doubt(sized(key, unit, _USUAL.get(unit), description), entry, value)
        return value

    def limit(self, end: str, whole: Mapping[str, Any], unit: str) -> float:
        """The `end` (min or max) of a parameter; where its unit does not fit that of the value, either may be the
        wrong one, so that both are named."""
        bound = whole[end]
        parts = units.split(bound) if isinstance(bound, str) else None
        if "unit" not in whole and parts is not None and parts[1] and not units.converts(parts[1], unit):
            raise InputError(
                f"has value = {shown(whole['value'])} and {end} = {shown(bound)}, which are of different kinds; "
                "correct the unit of one of them"
            )
        return self.number("", bound, unit)

    def entry(
        self, key: str, entry: Any, unit: str, motion: Known | None = None, inputs: bool = False
    ) -> Any:
        """A number in SI units, or the text of an expression, with its unit checked; NaN where it is wrong. `motion`
        are the units of the names that a load knows beside parameters and inputs."""
        with self.at(key):
            if not isinstance(entry, str) or _is_quantity(entry):
                return self.number(key, entry, unit)
            if self.refused & words_in(entry):  # the name itself is faulted where it is given
                return math.nan
            names = {**self.units, **(motion or {})}
            parsed = expression(entry)
            names |= self.further_units(parsed, motion is not None)
            for name in parsed.names:
                if name not in names and name not in self.derived:
                    raise InputError(f"is {shown(entry)}; {name} is no parameter{self.note(name, names)}")
                if name in self.inputs and not inputs:
                    raise InputError(
                        f"is {shown(entry)}; {name} is an input, and lengths cannot change in a run; use a parameter"
                    )
            self.used |= {*parsed.names}
            if parsed.names == (entry.strip(),) and self.units.get(entry.strip(), "") is None:
                self.units[entry.strip()] = names[entry.strip()] = unit
                self.derived_dimensions = None
            checked_dimension(parsed.text, self.dimensions(names), unit)
            for width in parsed.widths:
                if moving := {*width.of.names} & ({*self.inputs} | {*(motion or {})}) or {*width.of.tables}:
                    raise InputError(
                        f"is {shown(entry)}; the width of {width.call} changes with {', '.join(sorted(moving))}; "
                        "must be a number or an expression of parameters; a ramp that begins at such a value a is "
                        "ramp(x - a, 0, width)"
                    )
            if motion is None:
                self.expressed[key, entry] = None
            return entry
        return math.nan

    def dimensions(self, units: Known) -> Dimensions:
        """The dimensions of names with these `units`, and of the parameters that are expressions of others."""

        def of_units(units: Known) -> Dimensions:
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

    def start_values(self, parameters: Iterable[Mapping[str, Any]]) -> dict[str, float]:
        """The start values of parameters by name, also of those that are expressions of others. Entries that have no
        finite value with them are faulted."""
        values = {parameter["name"]: float(parameter["value"]) for parameter in parameters}

        def number(key: str, text: str) -> float:
            x = expression(text).number(values)
            if not math.isfinite(x):
                names = ", ".join(f"{name} = {values[name]:.6g}" for name in expression(text).names)
                self.fault(key, f"is {shown(text)}, which has no value, or an infinite one, with {names}")
            return x

        for name, text in self.derived.items():
            values[name] = number(f"parameters.{name}", text)
        for key, text in self.expressed:
            if all(math.isfinite(values.get(name, 0.0)) for name in expression(text).names):
                number(key, text)
        return values

    def further_units(self, parsed: Expression, in_load: bool) -> dict[str, str | None]:
        """The units of extremes and tables of an expression, by name.

        Raises
        ------
        InputError
            in one line, where the entry cannot have them.
        """
        if parsed.extremes or parsed.tables:
            raise InputError(
                f"is {shown(parsed.text)}; extremes and tables over x belong into the force or torque of a load"
            )
        return {}

    def note(self, name: str, names: Iterable[str]) -> str:
        """A hint on a name that is not known in an expression."""
        if name in MOTION:
            return f"; {name} is known in a {'force' if name in OF_POINT else 'load'} alone"
        return near_name(name, names)

    def vector(
        self, key: str, entry: Any, unit: str, motion: Known | None = None, inputs: bool = False
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

    def common(self) -> dict[str, float]:
        """Start values of the parameters that every linkage has."""
        common = {}
        keys = {"gravity": "g", "ratio": "ratio"}
        tables = {
            "pins": ("friction", "diameter", "w_smooth", "damping"),
            "guides": ("friction", "v_smooth", "damping"),
        }
        declared = {v.name: v for v in Layout(CommonParameters).variables}
        entries = [(key, name, self.data.get(key)) for key, name in keys.items()]
        for table, names in tables.items():
            entries_of_table = self.table(table)
            self.keys(table, entries_of_table, names)
            entries += [(f"{table}.{key}", f"{table}.{key}", entries_of_table.get(key)) for key in names]
        for key, name, value in entries:
            if value is not None:
                with self.at(key):
                    quantity = declared[name].quantity
                    x = self.number("", value, quantity.unit)
                    if not quantity.admits(x):
                        raise InputError(f"is {shown(value)}; must be {quantity.allowed_range}")
                    self.doubt(replace(declared[name], name=key), value, x)
                    common[name] = quantity.within_bounds(x)
        return common

    def about(self) -> dict[str, str]:
        """Who made the machine, as its FMUs say it."""
        table = self.table("about")
        names = tuple(field.name for field in fields(About))
        self.keys("about", table, names)
        return {key: printable(self.text(f"about.{key}", "", table), 1000) for key in table if key in names}

    def check_parameter(self, key: str, entry: Any, text: str) -> None:
        """Fault a parameter that is a wrong expression of other parameters.

        Raises
        ------
        InputError
            in one line.
        """
        if isinstance(entry, Mapping):
            self.keys(key, entry, ("value", "description"))
        parsed = expression(text)
        self.further_units(parsed, False)
        for name in parsed.names:
            if (name not in self.units and name not in self.derived) or name in self.inputs:
                raise InputError(f"is {shown(text)}; {name} is no parameter{near_name(name, self.units)}")
        self.used |= {*parsed.names}

    def expressions(self, table: Mapping[str, Any]) -> None:
        """Take up the parameters that are expressions of others, in any order, and check each."""
        texts = {
            name: str(entry["value"] if isinstance(entry, Mapping) else entry)
            for name, entry in table.items()
            if is_expression(entry)
        }
        order = TopologicalSorter({name: words_in(text) & {*texts} for name, text in texts.items()})
        with contextlib.suppress(CycleError):
            order.prepare()
        while ready := order.get_ready():
            for name in ready:
                key, is_right = f"parameters.{name}", False
                if not self.refused & words_in(texts[name]):
                    with self.at(key):
                        self.check_parameter(key, table[name], texts[name])
                        is_right = True
                self.derived[name] = texts[name] if is_right else "0"
                self.refused |= set() if is_right else {name}
            order.done(*ready)
        waiting = [name for name in texts if name not in self.derived]
        for name in waiting:
            words_on_loop = f"refers to itself by way of {', '.join(waiting)}; give one of them a number"
            self.fault(f"parameters.{name}", words_on_loop)
            self.derived[name] = "0"
        self.dimensions({})

    def quantities(self, kind: str) -> list[dict[str, Any]]:
        """Parameters or inputs; parameters that are expressions of others are taken up apart."""
        entries = []
        table = self.table(kind)
        self.fault_reserved_names(kind, table)
        for name, entry in table.items():
            if kind == "parameters" and is_expression(entry):
                continue
            key = f"{kind}.{name}"
            if name in (*WORDS, *CONSTANTS, *MOTION):
                self.refused.add(name)
            whole = entry if isinstance(entry, Mapping) else {"value": entry}
            self.keys(key, whole, ("value", "unit", "min", "max", "description", "tunable"))
            with self.at(key):
                value, unit = self.with_unit(whole.get("value"), whole.get("unit"))
                limits = {end: self.limit(end, whole, unit or "1") for end in ("min", "max") if end in whole}
                if not limits.get("min", -math.inf) <= value <= limits.get("max", math.inf):
                    ends = [f"{end} = {shown(whole[end])}" for end in limits]
                    raise InputError(f"is {shown(whole['value'])}; must be within {' and '.join(ends)}")
                self.units[name] = unit
                entries.append(
                    {
                        "name": name,
                        "value": value,
                        "unit": unit,
                        "description": str(whole.get("description", "")),
                        "tunable": bool(whole.get("tunable", False)),
                        **limits,
                    }
                )
            self.units.setdefault(name, None)
        if kind == "parameters":
            self.expressions(table)
        return entries

    def with_unit(self, entry: Any, unit: Any) -> tuple[float, str | None]:
        """A value in SI units, and its unit; None where it is told by the first use."""
        if unit is not None:
            fits = [si_unit for si_unit in UNITS if _same_unit(str(unit), si_unit)]
            if not fits:
                raise InputError(
                    f"unit = {shown(unit)}: no unit that a linkage knows; known: {', '.join(UNITS)}"
                )
            return self.number("", entry, fits[0]), fits[0]
        if isinstance(entry, str) and words_in(entry) & {*self.units, *self.table("parameters")}:
            raise InputError(
                f"is {shown(entry)}; must be a number with a unit; a parameter may be an expression"
            )
        if isinstance(entry, str) and (parts := units.split(entry)) and parts[1]:
            for si_unit in UNITS:
                if units.converts(parts[1], si_unit):
                    return within(units.convert(*parts, si_unit), entry), si_unit
            hints = [units.spelling(entry, si_unit) for si_unit in UNITS]
            unknown = f"; the unit is not known; write it as in {_like('m')}"
            raise InputError(f"is {shown(entry)}{next((hint for hint in hints if 'meant' in hint), unknown)}")
        return self.number("", entry, "1"), None


def sized(key: str, unit: str, usual: tuple[float, float] | None, description: str = "") -> Variable:
    """The value of a key as a variable of these `usual` sizes, with this `description`."""
    description = description or units.kind_of(unit)
    return Variable(key, description, Quantity(unit, description, usual=usual))


def is_expression(entry: Any) -> bool:
    """Whether the entry of a parameter is an expression of others, and no number with a unit."""
    value = entry.get("value") if isinstance(entry, Mapping) else entry
    parts = units.split(value) if isinstance(value, str) else (0.0, "")
    if not isinstance(value, str) or (parts is not None and parts[1][:1] not in ("+", "-", "*", "/")):
        return False
    try:
        return bool(expression(value).names)
    except InputError:
        return False


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
    if re.search(r"[+*()]|\s[-/]\s", parts[1]) and not _is_unit(parts[1]):
        raise InputError(
            f"is {shown(text)}; an expression has no units inside: write its numbers in SI units, such as "
            "2 * r + 0.01"
        )
    return True


def _is_unit(text: str) -> bool:
    """Whether a text is a unit of a linkage, such as kg*m2 or N/(m s)."""
    return any(units.converts(text, unit) for unit in UNITS)


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
    try:
        return units.convert(1.0, text, unit) == 1.0 if text != "1" else unit == "1"
    except ValueError:
        return text.replace(" ", ".") == unit and bool(base_units(unit) or unit == "1")
