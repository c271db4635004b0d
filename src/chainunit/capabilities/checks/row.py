"""Checks as data: the rule of each, and its row, the value beside its limit with the numbers behind both."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from ...reading.results import OWN, InUnit, derived, part, parts, result


@result
class CheckRow:
    """A value of the result beside its limit."""

    of: str = part("the checked part: a pin, a shaft section, the gear")
    title: str = part("the checked quantity")
    clause: str = part("standard and clause, or other source")
    formula: str = part("the formula in symbols")
    value: float | None = part("its value; none: never", unit=OWN)
    limit: float = part("its limit", unit=OWN)
    number: str = part("place of the value in this result")
    numbers: Mapping[str, str] = part("by symbol of the formula, the place of its number in this result")
    unit: str = "1"
    kind: str = ""
    at_least: bool = part(
        "whether the value must reach the limit, in place of staying below it", default=False
    )
    letters: Mapping[str, tuple[InUnit, str]] = field(default_factory=dict)
    """by symbol of the formula, its number and the whole place of it"""

    @property
    def size(self) -> InUnit:
        """The value with its unit."""
        return InUnit(self.value, self.unit, self.kind)

    @derived("1", "used")
    def utilisation(self) -> float:
        """value/limit, or limit/value where the value must reach the limit."""
        value = math.inf if self.value is None else self.value
        above, below = (self.limit, value) if self.at_least else (value, self.limit)
        if below > 0.0:
            return above / below
        return math.inf if above > 0.0 else 0.0

    @derived()
    def holds(self) -> bool:
        """Whether the value keeps the limit."""
        return self.utilisation <= 1.0


@result
class NotChecked:
    """Something that was not checked, and the data that would let it be checked."""

    what: str = part("the check")
    why: str = part("the reason, and the remedy")
    table: str = ""
    """the table that the file does not have, where that is the reason"""


@dataclass(frozen=True)
class CheckRule:
    """A check as data; its texts may have slots such as {run}. `value` is the place of its number in the result of a
    part; `letters` have by symbol of the `formula` the place of its number there: "F = largest_force; d = diameter",
    or in the whole result: "f = /motor_shaft.tension_factor". Those of numbers that the part does not have are left
    out."""

    title: str
    value: str
    clause: str
    formula: str
    letters: str = ""
    at_least: bool = False

    def row(
        self, part: str, path: str, numbers: Any, limit: float, tables: Mapping[str, Any], **slots: str
    ) -> CheckRow:
        """The row of a part: its `numbers` are a result that stands at `path` of the findings; `tables` are tables of
        the study file, and `slots` the texts for the slots of the rule. Each letter of the formula gets its number
        and the place of it in result.json."""
        size, letters = _size(numbers, self.value, slots), dict[str, tuple[InUnit, str]]()
        for pair in filter(None, self.letters.split("; ")):
            letter, place = pair.split(" = ")
            if place.startswith("/"):
                letters[letter] = _size(tables, place[1:], slots), f"given.{place[1:]}"
            elif (number := _size(numbers, place, slots)).value is not None:
                letters[letter] = number, f"findings.{path}.{place.format(**slots)}"
        return CheckRow(
            of=part,
            title=self.title.format(**slots),
            clause=self.clause.format(**slots),
            formula=self.formula.format(**slots),
            value=size.value,
            limit=limit,
            number=f"{path}.{self.value.format(**slots)}",
            numbers={letter: place.partition(".")[2] for letter, (_, place) in letters.items()},
            unit=size.unit,
            kind=size.kind,
            at_least=self.at_least,
            letters=letters,
        )


def _size(numbers: Any, place: str, slots: Mapping[str, str]) -> InUnit:
    """The number at that `place` of the result `numbers`."""
    *steps, name = place.split(".")
    for step in steps:
        key = step.format(**slots)
        numbers = numbers[key] if isinstance(numbers, Mapping) else getattr(numbers, key)
    kind: Any = type(numbers)
    declared = next(member for member in parts(kind) if member.name == name)
    return InUnit(getattr(numbers, name), declared.unit, declared.kind)


@dataclass(frozen=True)
class Checks:
    """The checks of a study so far, and what was not checked."""

    rows: list[CheckRow] = field(default_factory=list)
    missing: list[NotChecked] = field(default_factory=list)
    tables: Mapping[str, Any] = field(default_factory=dict)
    """the tables of the study file, of which some rules have numbers"""

    def lack(self, what: str, why: str, table: str = "") -> None:
        """Add something that is not checked."""
        self.missing.append(NotChecked(what, why, table))

    def check(
        self,
        rule: CheckRule,
        part: str,
        path: str,
        numbers: Any,
        limit: float | None,
        why: str = "",
        **slots: str,
    ) -> None:
        """Add the row of a part, see `CheckRule.row`; without a value or a limit, the reason `why` it has none."""
        if why and not limit:
            self.lack(f"{part}, {rule.title.format(**slots)}", why)
        else:
            self.rows.append(rule.row(part, path, numbers, limit or 0.0, self.tables, **slots))
