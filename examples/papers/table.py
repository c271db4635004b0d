"""The table of a paper: its printed numbers beside the computed ones, read from the file of the paper."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from chainunit.reading.results import GIVEN, derived, part, result

HERE = Path(__file__).parent
PICK: dict[str, Callable[[Any], Any]] = {"least": np.min, "largest": np.max, "mean": np.mean}
"""By the word in the table, the function that takes one number of many."""


@result
class PaperNumber:
    """A number of a paper.

    `printed` is the paper's text, with its digits, or the value of its formula as printed (None: the paper does not
    state it). `rebuilt` is the value by the paper's own scheme with its slips, where these explain the printed
    number. `digits` are decimals; -1 shows only the order of magnitude.
    """

    paper: str = part("number of the paper")
    item: str = part("number of the finding in the list of errata")
    where: str = part("place in the paper")
    quantity: str = part("the quantity")
    printed: str | None = part("the number of the paper")
    computed: float = part("the computed number", unit=GIVEN)
    unit: str = part("their unit")
    digits: int
    rebuilt: float | None
    verdict: str = part("agrees, corrected, or not stated")
    reason: str = part("the reason of the verdict")

    @derived(name="shown")
    def text(self) -> str:
        """The computed value with `digits` decimals."""
        return _text(self.computed, self.digits)

    @derived(name="rebuilt")
    def rebuilt_text(self) -> str | None:
        """The rebuilt value with the same decimals."""
        return None if self.rebuilt is None else _text(self.rebuilt, self.digits)


def rows(paper: str, functions: ModuleType) -> list[PaperNumber]:
    """The rows of a paper, in the order of its items.

    The table has an ``[[item]]`` for each finding: its `number` in the list of errata, the place in the paper
    (`where`), the reason of the verdict (`why`), and its `rows`. A row has

    ``quantity``, ``unit`` (by default ``"1"``) and ``digits``;
    ``computed``  name of a function of the paper's module, and its arguments;
    ``printed``   the paper's text; or a function, for the value of a printed formula;
    ``rebuilt``   a function for the value by the paper's own scheme;
    ``below``, ``above``  the bound that a printed word such as "very small" stands for;
    ``agrees``    the verdict, where neither rounding nor a bound decides;
    ``why``       a reason in place of the item's.
    """
    return [
        _row(paper, item, entry, functions)
        for item in tomllib.loads((HERE / f"{paper}.toml").read_text("utf-8"))["item"]
        for entry in item["rows"]
    ]


def _row(paper: str, item: Mapping[str, Any], entry: Mapping[str, Any], functions: ModuleType) -> PaperNumber:
    def value(call: list[Any]) -> float:
        function, *arguments = call
        return float(getattr(functions, function)(*arguments))

    computed, printed, digits = value(entry["computed"]), entry.get("printed"), entry["digits"]
    if isinstance(printed, list):
        printed = _text(value(printed), digits)
    return PaperNumber(
        paper=paper,
        item=item["number"],
        where=item["where"],
        quantity=entry["quantity"],
        printed=printed,
        computed=computed,
        unit=entry.get("unit", "1"),
        digits=digits,
        rebuilt=value(entry["rebuilt"]) if "rebuilt" in entry else None,
        verdict=_verdict(entry, printed, computed),
        reason=entry.get("why", item["why"]),
    )


def _verdict(entry: Mapping[str, Any], printed: str | None, computed: float) -> str:
    if printed is None:
        return "not stated"
    if "agrees" in entry:
        agrees = entry["agrees"]
    elif "below" in entry or "above" in entry:
        agrees = entry.get("above", computed) <= computed <= entry.get("below", computed)
    else:
        agrees = _rounds_to(computed, printed)
    return "agrees" if agrees else "corrected"


def _rounds_to(computed: float, printed: str) -> bool:
    """Whether the computed value rounds to the printed number; no value rounds to a text."""
    decimals = len(printed.partition(".")[2])
    try:
        return f"{computed:.{decimals}f}" == f"{float(printed):.{decimals}f}"
    except ValueError:
        return False


def _text(x: float, digits: int) -> str:
    return f"{x:.{digits}f}" if digits >= 0 else f"{x:.1e}"
