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
from .checks import name_fault, words
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
        given = (self.data if parent is None else parent).get(name, {} if default is None else default)
        if not isinstance(given, Mapping):
            self.fault(key, f"is {shown(given)}; must be a table")
            return {}
        return given

    def all(self, faults: Iterable[tuple[str, str]]) -> None:
        """Collect faults, each by key and message."""
        for key, message in faults:
            self.fault(key, message)

    def text(self, key: str, default: str, table: Mapping[str, Any] | None = None) -> str:
        """A text of the file, or of one of its tables by the last name of its `key`."""
        given = (self.data if table is None else table).get(key.rpartition(".")[2], default)
        if not isinstance(given, str):
            self.fault(key, f"is {shown(given)}; must be a text")
            return default
        return given

    def positive(self, key: str, given: Any, unit: str) -> Any:
        """An entry that may name inputs; a number must be >= 0."""
        value = self.entry(key, given, unit, inputs=True)
        if not isinstance(value, str) and value < 0.0:
            self.fault(key, f"is {shown(given)}; must be >= 0")
        return value

    def tables(self, kind: str, known: tuple[str, ...] = ()) -> Iterator[tuple[str, str, Mapping[str, Any]]]:
        """The tables in a table, each behind its name and its full key; their keys are `known`, if any are given."""
        given = self.table(kind)
        self.fault_reserved_names(kind, given)
        for name in given:
            key = f"{kind}.{name}"
            table = self.table(key, given)
            if known:
                self.keys(key, table, known)
            yield name, key, table

    def fault_reserved_names(self, key: str, names: Mapping[str, Any]) -> None:
        """Fault names that no variable can have."""
        for each in names:
            if wrong := name_fault(each):
                self.fault(f"{key}.{each}", wrong)
                self.refused.add(each)

    def doubt(self, variable: Variable, given: Any, value: float) -> None:
        """Note the `value` of a key, which the file has as `given`, where it is of no usual size."""
        doubt = UnusualValue.of(variable, given, value)
        if doubt is not None and doubt not in self.unusual:
            self.unusual.append(doubt)

    def number(self, key: str, given: Any, unit: str, words: str = "") -> float:
        """A number, or a text with a unit; `words` are its description. One of an unusual size is noted."""
        if isinstance(given, bool) or not isinstance(given, int | float | str):
            raise InputError(
                f"{is_given(given)}; must be a number or a text with a unit, such as {_like(unit)}"
            )
        if isinstance(given, str):
            parts = units.split(given)
            if parts is None:
                raise InputError(
                    f"is {shown(given)}; must be a number or a text with a unit, such as {_like(unit)}"
                    f"{units.spelling(given, unit)}"
                )
            try:
                value = units.convert(*parts, unit) if parts[1] else parts[0]
            except ValueError:
                hint = units.spelling(given, unit)
                raise InputError(
                    f"is {shown(given)}{hint or f'; the unit does not fit, write it as {_like(unit)}'}"
                ) from None
        else:
            value = as_float(given)
        within(value, given)
        if unit == "rad" and abs(value) > WHOLE * (1.0 + 1e-12) and not units.has_unit(given):
            raise InputError(
                f'is {shown(given)}, more than a turn; {units.IN_RADIANS}, write degrees as "{value:g} deg"'
            )
        if unit != "rad" and key:
            self.doubt(sized(key, unit, _USUAL.get(unit), words), given, value)
        return value

    def limit(self, end: str, whole: Mapping[str, Any], unit: str) -> float:
        """The `end` (min or max) of a parameter; where its unit does not fit that of the value, either may be the
        wrong one, so that both are named."""
        given = whole[end]
        parts = units.split(given) if isinstance(given, str) else None
        if "unit" not in whole and parts is not None and parts[1] and not units.converts(parts[1], unit):
            raise InputError(
                f"has value = {shown(whole['value'])} and {end} = {shown(given)}, which are of different kinds; "
                "correct the unit of one of them"
            )
        return self.number("", given, unit)

    def entry(
        self, key: str, given: Any, unit: str, motion: Known | None = None, inputs: bool = False
    ) -> Any:
        """A number in SI units, or the text of an expression, with its unit checked; NaN where it is wrong. `motion`
        are the units of the names that a load knows beside parameters and inputs."""
        with self.at(key):
            if not isinstance(given, str) or _is_quantity(given):
                return self.number(key, given, unit)
            if self.refused & words(given):  # the name itself is faulted where it is given
                return math.nan
            known = {**self.units, **(motion or {})}
            each = expression(given)
            known |= self.further_units(each, motion is not None)
            for name in each.names:
                if name not in known and name not in self.derived:
                    raise InputError(f"is {shown(given)}; {name} is no parameter{self.note(name, known)}")
                if name in self.inputs and not inputs:
                    raise InputError(
                        f"is {shown(given)}; {name} is an input, and lengths cannot change in a run; use a parameter"
                    )
            self.used |= {*each.names}
            if each.names == (given.strip(),) and self.units.get(given.strip(), "") is None:
                self.units[given.strip()] = known[given.strip()] = unit
                self.derived_dimensions = None
            checked_dimension(each.text, self.dimensions(known), unit)
            for width in each.widths:
                if moving := {*width.of.names} & ({*self.inputs} | {*(motion or {})}) or {*width.of.tables}:
                    raise InputError(
                        f"is {shown(given)}; the width of {width.call} changes with {', '.join(sorted(moving))}; "
                        "must be a number or an expression of parameters; a ramp that begins at such a value a is "
                        "ramp(x - a, 0, width)"
                    )
            if motion is None:
                self.expressed[key, given] = None
            return given
        return math.nan

    def dimensions(self, units: Known) -> Dimensions:
        """The dimensions of names with these `units`, and of the parameters that are expressions of others."""

        def of_units(units: Known) -> Dimensions:
            return {name: None if each is None else dimension_of_unit(each) for name, each in units.items()}

        if self.derived_dimensions is None:
            known = dict(of_units(self.units))
            self.derived_dimensions = {}
            for name, text in self.derived.items():
                known[name] = None
                if name not in self.refused:
                    with self.at(f"parameters.{name}"):
                        known[name] = checked_dimension(text, known, None)
                self.derived_dimensions[name] = known[name]
        return {**self.derived_dimensions, **of_units(units)}

    def start_values(self, parameters: Iterable[Mapping[str, Any]]) -> dict[str, float]:
        """The start values of parameters by name, also of those that are expressions of others. Entries that have no
        finite value with them are faulted."""
        values = {each["name"]: float(each["value"]) for each in parameters}

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

    def further_units(self, given: Expression, in_load: bool) -> dict[str, str | None]:
        """The units of extremes and tables of an expression, by name.

        Raises
        ------
        InputError
            in one line, where the entry cannot have them.
        """
        if given.extremes or given.tables:
            raise InputError(
                f"is {shown(given.text)}; extremes and tables over x belong into the force or torque of a load"
            )
        return {}

    def note(self, name: str, known: Iterable[str]) -> str:
        """A hint on a name that is not known in an expression."""
        if name in MOTION:
            return f"; {name} is known in a {'force' if name in OF_POINT else 'load'} alone"
        return near_name(name, known)

    def vector(
        self, key: str, given: Any, unit: str, motion: Known | None = None, inputs: bool = False
    ) -> list[Any]:
        """Two entries."""
        if not isinstance(given, list) or len(given) != 2:
            self.fault(key, f"{is_given(given)}; must be a list of two, along x and y")
            return [0.0, 0.0]
        return [self.entry(key, each, unit, motion, inputs) for each in given]

    def points_in(self, key: str, given: Mapping[str, Any]) -> dict[str, list[Any]]:
        """Points by name."""
        self.fault_reserved_names(key, given)
        return {name: self.vector(f"{key}.{name}", at, "m") for name, at in given.items()}

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
            given = self.table(table)
            self.keys(table, given, names)
            entries += [(f"{table}.{key}", f"{table}.{key}", given.get(key)) for key in names]
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

    def check_parameter(self, key: str, given: Any, text: str) -> None:
        """Fault a parameter that is a wrong expression of other parameters.

        Raises
        ------
        InputError
            in one line.
        """
        if isinstance(given, Mapping):
            self.keys(key, given, ("value", "description"))
        of = expression(text)
        self.further_units(of, False)
        for each in of.names:
            if (each not in self.units and each not in self.derived) or each in self.inputs:
                raise InputError(f"is {shown(text)}; {each} is no parameter{near_name(each, self.units)}")
        self.used |= {*of.names}

    def expressions(self, table: Mapping[str, Any]) -> None:
        """Take up the parameters that are expressions of others, in any order, and check each."""
        texts = {
            name: str(given["value"] if isinstance(given, Mapping) else given)
            for name, given in table.items()
            if is_expression(given)
        }
        order = TopologicalSorter({name: words(text) & {*texts} for name, text in texts.items()})
        with contextlib.suppress(CycleError):
            order.prepare()
        while ready := order.get_ready():
            for name in ready:
                key, is_right = f"parameters.{name}", False
                if not self.refused & words(texts[name]):
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
        for name, given in table.items():
            if kind == "parameters" and is_expression(given):
                continue
            key = f"{kind}.{name}"
            if name in (*WORDS, *CONSTANTS, *MOTION):
                self.refused.add(name)
            whole = given if isinstance(given, Mapping) else {"value": given}
            self.keys(key, whole, ("value", "unit", "min", "max", "description", "tunable"))
            with self.at(key):
                value, unit = self.with_unit(whole.get("value"), whole.get("unit"))
                limits = {
                    each: self.limit(each, whole, unit or "1") for each in ("min", "max") if each in whole
                }
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

    def with_unit(self, given: Any, unit: Any) -> tuple[float, str | None]:
        """A value in SI units, and its unit; None where it is told by the first use."""
        if unit is not None:
            fits = [each for each in UNITS if _same_unit(str(unit), each)]
            if not fits:
                raise InputError(
                    f"unit = {shown(unit)}: no unit that a linkage knows; known: {', '.join(UNITS)}"
                )
            return self.number("", given, fits[0]), fits[0]
        if isinstance(given, str) and words(given) & {*self.units, *self.table("parameters")}:
            raise InputError(
                f"is {shown(given)}; must be a number with a unit; a parameter may be an expression"
            )
        if isinstance(given, str) and (parts := units.split(given)) and parts[1]:
            for each in UNITS:
                if units.converts(parts[1], each):
                    return within(units.convert(*parts, each), given), each
            hints = [units.spelling(given, each) for each in UNITS]
            unknown = f"; the unit is not known; write it as in {_like('m')}"
            raise InputError(f"is {shown(given)}{next((hint for hint in hints if 'meant' in hint), unknown)}")
        return self.number("", given, "1"), None


def sized(key: str, unit: str, usual: tuple[float, float] | None, words: str = "") -> Variable:
    """The value of a key as a variable of these `usual` sizes; `words` are its description."""
    words = words or units.kind_of(unit)
    return Variable(key, words, Quantity(unit, words, usual=usual))


def is_expression(given: Any) -> bool:
    """Whether the entry of a parameter is an expression of others, and no number with a unit."""
    value = given.get("value") if isinstance(given, Mapping) else given
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
    return any(units.converts(text, each) for each in UNITS)


def within(value: float, given: Any) -> float:
    """A value in SI units, by the text or number that is `given`.

    Raises
    ------
    InputError
        for one that is not finite, or so large that products of such values are not.
    """
    if not abs(value) <= LARGEST:
        raise InputError(f"is {shown(given)}; must be finite, and <= {LARGEST:g} in size")
    return value


def is_among(given: Any, names: Collection[str]) -> bool:
    """Whether an entry is one of some names; it may be a list or a table."""
    return isinstance(given, str) and given in names


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
