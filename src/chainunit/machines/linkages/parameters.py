"""The parameters and inputs of a linkage file: the ones of the user, also as expressions of others, and the
ones of every linkage."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields, replace
from graphlib import CycleError, TopologicalSorter
from typing import Any

from ...core import units
from ...core.errors import InputError, near_name, printable, shown
from ...core.model import About
from ...core.quantities import Layout, Variable
from ...mechanism.expressions import CONSTANTS, WORDS, expression
from ..differing import friction_of
from .declarations import LOSSES, CommonParameters
from .entries import EntryReader
from .loads import MOTION
from .names import words_in


class ParameterReader(EntryReader):
    """The reader of parameters and inputs."""

    def common(self) -> dict[str, float]:
        """Start values of the parameters that every linkage has."""
        common = {}
        variables = Layout(CommonParameters).variables
        for table in LOSSES:
            names = [v.name.removeprefix(f"{table}.") for v in variables if v.name.startswith(f"{table}.")]
            shared = {key: x for key, x in self.table(table).items() if not isinstance(x, Mapping)}
            self.keys(table, shared, names)
        for variable in variables:
            key = "gravity" if variable.name == "g" else variable.name
            table, _, name = key.rpartition(".")
            value = (self.table(table) if table else self.data).get(name)
            if value is not None and not isinstance(value, Mapping):
                with self.at(key):
                    common[variable.name] = self.admitted(replace(variable, name=key), value)
        return common

    def admitted(self, variable: Variable, value: Any) -> float:
        """The number of a value of the file for a declared quantity, within its bounds.

        Raises
        ------
        InputError
            for a value that is no number of its unit, or out of its bounds.
        """
        quantity = variable.quantity
        x = self.number("", value, quantity.unit)
        if not quantity.admits(x):
            raise InputError(f"is {shown(value)}; must be {quantity.allowed_range}")
        self.doubt(variable, value, x)
        return float(quantity.within_bounds(x))

    def differing(
        self, joints: Sequence[Mapping[str, Any]], common: Mapping[str, float]
    ) -> dict[str, dict[str, dict[str, float]]]:
        """By table of losses and joint, the start values of the losses of joints that differ from the
        others, which have the `common` ones."""
        laws: dict[str, dict[str, dict[str, float]]] = {}
        for table, (kind, declared) in LOSSES.items():
            usual = Layout(declared).by_name(getattr(CommonParameters(), table))
            shared = {name: common.get(f"{table}.{name}", value) for name, value in usual.items()}
            named = [joint["name"] for joint in joints if joint["type"] == kind]
            for name, entry in self.table(table).items():
                if not isinstance(entry, Mapping):
                    continue
                key = f"{table}.{name}"
                if name not in named:
                    possible = f"its {table} are {', '.join(named)}" if named else f"it has no {table}"
                    self.fault(key, f"is no {table.removesuffix('s')} of this linkage; {possible}")
                    continue
                if name in shared:
                    self.fault(key, f"has the name of a key of [{table}]; give the joint another name")
                    continue
                self.keys(key, entry, (*shared, "kind") if table == "pins" else (*shared,))
                values = dict(shared)
                with self.at(f"{key}.kind"):
                    values |= friction_of(entry)
                for variable in Layout(declared).variables:
                    if (value := entry.get(variable.name)) is not None:
                        with self.at(f"{key}.{variable.name}"):
                            full = replace(variable, name=f"{key}.{variable.name}")
                            values[variable.name] = self.admitted(full, value)
                laws.setdefault(table, {})[name] = values
        return laws

    def about(self) -> dict[str, str]:
        """Who made the machine, as its FMUs say it."""
        table = self.table("about")
        names = tuple(field.name for field in fields(About))
        self.keys("about", table, names)
        return {key: printable(self.text(f"about.{key}", "", table), 1000) for key in table if key in names}

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
                self.derived[name] = "0"
                self.refused.add(name)
                if not self.refused & words_in(texts[name]):
                    with self.at(f"parameters.{name}"):
                        self.check_parameter(name, table[name], texts[name])
                        self.derived[name] = texts[name]
                        self.refused.discard(name)
            order.done(*ready)
        waiting = [name for name in texts if name not in self.derived]
        for name in waiting:
            loop = ", ".join(waiting)
            self.fault(f"parameters.{name}", f"refers to itself by way of {loop}; give one of them a number")
            self.derived[name] = "0"
        self.dimensions({})

    def check_parameter(self, name: str, entry: Any, text: str) -> None:
        """Refuse a parameter that is a wrong expression of other parameters."""
        if isinstance(entry, Mapping):
            self.keys(f"parameters.{name}", entry, ("value", "description"))
        parsed = expression(text)
        self.further_units(parsed, False)
        for used in parsed.names:
            if (used not in self.units and used not in self.derived) or used in self.inputs:
                raise InputError(f"is {shown(text)}; {used} is no parameter{near_name(used, self.units)}")
        self.used |= {*parsed.names}

    def quantities(self, kind: str) -> list[dict[str, Any]]:
        """The entries of the parameters or the inputs, each with name, value [SI], unit, description, limits and
        whether it is tunable. The unit is None if the first use of the name tells it. Parameters that are expressions
        of others are no entries: `expressions` takes them up."""
        entries = []
        table = self.table(kind)
        self.fault_reserved_names(kind, table)
        for name, entry in table.items():
            if kind == "parameters" and is_expression(entry):
                continue
            if name in (*WORDS, *CONSTANTS, *MOTION):
                self.refused.add(name)
            whole = entry if isinstance(entry, Mapping) else {"value": entry}
            self.keys(
                f"{kind}.{name}", whole.keys(), ("value", "unit", "min", "max", "description", "tunable")
            )
            with self.at(f"{kind}.{name}"):
                value, unit = self.with_unit(whole.get("value"), whole.get("unit"))
                limits = {end: self.limit(end, whole, unit or "1") for end in ("min", "max") if end in whole}
                if not limits.get("min", -math.inf) <= value <= limits.get("max", math.inf):
                    ends = [f"{end} = {shown(whole[end])}" for end in limits]
                    raise InputError(f"is {shown(whole['value'])}; must be within {' and '.join(ends)}")
                self.units[name] = unit
                described = {"name": name, "value": value, "unit": unit}
                described["description"] = str(whole.get("description", ""))
                described["tunable"] = bool(whole.get("tunable", False))
                entries.append(described | limits)
            self.units.setdefault(name, None)
        if kind == "parameters":
            self.expressions(table)
        return entries

    def limit(self, end: str, whole: Mapping[str, Any], unit: str) -> float:
        """The `end` (min or max) of a parameter, in its `unit`; if its own unit does not fit, either may be the wrong
        one, so that both are named."""
        bound = whole[end]
        parts = units.split(bound) if isinstance(bound, str) else None
        if "unit" not in whole and parts is not None and parts[1] and not units.converts(parts[1], unit):
            raise InputError(
                f"has value = {shown(whole['value'])} and {end} = {shown(bound)}, which are of different kinds; "
                "correct the unit of one of them"
            )
        return self.number("", bound, unit)

    def start_values(self, parameters: Iterable[Mapping[str, Any]]) -> dict[str, float]:
        """The start values of parameters by name, also of expressions of others. Entries that have no
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

    def fault_unused(
        self, parameters: list[dict[str, Any]], inputs: list[dict[str, Any]], tables: Mapping[str, Any]
    ) -> None:
        """Fault parameters, inputs and tables that nothing uses, and complete the units of the others. A name in a
        faulty entry may be meant to be used."""
        entries = {f"parameters.{entry['name']}": entry for entry in parameters}
        entries |= {f"inputs.{entry['name']}": entry for entry in inputs}
        texts = words_in([self.data[key] for key in self.data if key not in ("parameters", "inputs")])
        keys = [
            *entries,
            *(f"parameters.{name}" for name in self.derived),
            *(f"tables.{name}" for name in tables),
        ]
        is_faulty = bool(self.errors)
        for key in keys:
            table, _, name = key.partition(".")
            is_meant = is_faulty and (name in texts or near_name(name, texts))
            if name not in self.used | self.refused and not is_meant:
                user = "no load" if table == "tables" else "nothing"
                self.fault(key, f"{user} uses it; use it, or take it out")
        for key, entry in entries.items():
            table, _, name = key.partition(".")
            entry["unit"] = entry["unit"] or self.units[name] or "1"
            written = self.data[table][name]
            whole = written if isinstance(written, Mapping) else {"value": written}
            value = f"{whole['value']} {whole['unit']}" if "unit" in whole else whole["value"]
            with self.at(key):  # its size is judged here, as its first use may tell its unit
                self.number(key, value, entry["unit"], entry["description"])


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
