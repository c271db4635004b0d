"""A check as a declared result: its clause and formula, the value beside its limit, and the numbers behind both."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

from ...reading.results import OWN, derived, part, result


@result
class CheckRow:
    """A value of the result beside its limit."""

    of: str = part("the checked part: a pin, a shaft section, the gear")
    title: str = part("the checked quantity")
    clause: str = part("standard and clause, or other source")
    formula: str = part("the formula in symbols")
    value: float | None = part("its value; none where the part carries no load", unit=OWN)
    limit: float = part("its limit", unit=OWN)
    number: str = part("place of the value in this result")
    numbers: Mapping[str, str] = part("by symbol of the formula, the place of its number in this result")
    unit: str = "1"
    kind: str = ""
    at_least: bool = part(
        "whether the value must reach the limit, in place of staying below it", default=False
    )

    @derived("1", "used")
    def utilisation(self) -> float | None:
        """value/limit, or limit/value where the value must reach the limit."""
        if self.value is None:
            # a bearing without load or motion lasts for ever
            return 0.0 if self.at_least else None
        above, below = (self.limit, self.value) if self.at_least else (self.value, self.limit)
        if below > 0.0:
            return above / below
        return math.inf if above > 0.0 else 0.0

    @derived()
    def holds(self) -> bool:
        """Whether the value keeps the limit."""
        return self.utilisation is None or self.utilisation <= 1.0


@result
class NotChecked:
    """Something that was not checked, and the data that would let it be checked."""

    what: str = part("the check")
    why: str = part("the reason, and the remedy")
    table: str = ""
    """the table that the file does not have, where that is the reason"""


@dataclasses.dataclass(frozen=True)
class CheckRule:
    """A check as data. `value` is the name of its number among those of a part; `letters` have by symbol of the
    `formula` the place of its number, from the place of the part on: "F = largest_force; d = diameter". Those of
    numbers that the part does not have are left out."""

    value: str
    title: str
    clause: str
    formula: str
    letters: str = ""
    at_least: bool = False

    def row(self, part: str, path: str, numbers: Any, limit: float, run: str = "") -> CheckRow:
        """The row of a part: its `numbers` declare the value with its unit, and stand at `path` of the result; `run`
        is the title of the run in the rule's title."""
        letters = dict(pair.split(" = ") for pair in self.letters.split("; ") if pair)
        quantity = type(numbers).__dataclass_fields__[self.value].metadata["quantity"]
        return CheckRow(
            part, self.title.format(run=run), self.clause, self.formula,
            getattr(numbers, self.value), limit, f"{path}.{self.value}",
            {x: f"{path}.{name}" for x, name in letters.items() if getattr(numbers, name, self) is not None},
            quantity.unit, quantity.kind, self.at_least,
        )  # fmt: skip
