"""Remarks that a reader needs beside the numbers, each declared once: its code, its severity, its sentences, its
remedy and its numbers."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import Literal, NamedTuple, TypeAlias

from ..core.descriptions import USUAL_DRIVER, of_driver
from ..reading.results import InUnit, part, result
from ..reading.text import number

Severity = Literal["fault", "warning", "note"]
SEVERITIES: Mapping[Severity, str] = {
    "fault": "a number is wrong or not known, or the machine does not do what it has to do",
    "warning": "a limit is passed, or a demand is not met",
    "note": "an assumption behind the numbers, or advice",
}
"""The severities with their meanings, the gravest first."""
Amount: TypeAlias = tuple[float | None, str] | tuple[float | None, str, str]
"""A number and its unit; optionally the kind by which it is shown."""
Value: TypeAlias = float | str | Amount | None
"""A number in its declared unit or with a unit of its own, or words."""
_SLOT = re.compile(r"\{(\w+)\}")
_SENTENCE_END = re.compile(r"(?<=\.) (?=[A-Z0-9{])")


class Size(NamedTuple):
    """A number of a remark: its unit and kind, its digits in a sentence, and its title in a table."""

    unit: str
    kind: str = ""
    digits: int = 3
    title: str = ""


@result
class Remark:
    """A remark on a study."""

    code: str = part("the code of the remark, see the reference")
    severity: Severity = part("fault, warning or note")
    text: str = part("the remark, in sentences")
    remedy: str = part("the last of them, on what helps; empty if the remark has no remedy", default="")
    runs: tuple[str, ...] = part("the runs that it is about", default=())
    quantities: Mapping[str, InUnit] = part(
        "the numbers of the remark; a number of one run among several is named ``run.quantity``",
        default_factory=dict,
    )

    @property
    def rank(self) -> int:
        """Its place in the order of severity."""
        return list(SEVERITIES).index(self.severity)

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True)
class RemarkCode:
    """A declared remark. Its `sentences` and its `remedy` have slots with the names of numbers and words, and slots
    for the driver, see `of_driver`. A sentence is left out if a value in it is None. Numbers with a title stand in a
    table below the remark."""

    code: str
    severity: Severity
    sentences: tuple[str, ...]
    remedy: str
    sizes: Mapping[str, Size]

    def remark(self, *runs: str, driver: str = USUAL_DRIVER, **values: Value) -> Remark:
        """The remark on these runs with these `values`, on a machine with that noun for its driver. A number of one
        run among several has the name ``run.quantity``."""
        quantities: dict[str, InUnit] = {}
        texts: dict[str, str | None] = {}
        for name, value in values.items():
            if value is None or isinstance(value, str):
                texts[name] = value
            else:
                x, size = self._sized(name, value)
                quantities[name] = InUnit(x, size.unit, size.kind, of_driver(size.title, driver))
                texts[name] = None if x is None else number(x, size.unit, size.kind, size.digits)
        *sentences, remedy = (_said(of_driver(x, driver), texts) for x in (*self.sentences, self.remedy))
        text = " ".join(filter(None, (*sentences, remedy)))
        return Remark(self.code, self.severity, text, remedy, runs, quantities)

    def _sized(self, name: str, value: float | Amount) -> tuple[float | None, Size]:
        """The number in a value, and its size: the one that comes with it, or else the declared one of its name."""
        if isinstance(value, tuple):
            return value[0], Size(*value[1:])
        # neither the name of a run nor that of a quantity has dots
        quantity_name = name.rpartition(".")[2]
        assert quantity_name in self.sizes, f"{self.code}: {name} has no unit"
        return value, self.sizes[quantity_name]


def _said(sentence: str, texts: Mapping[str, str | None]) -> str:
    """The sentence with its values; empty if one of them is None."""
    if any(texts[slot] is None for slot in _SLOT.findall(sentence)):
        return ""
    text = _SLOT.sub(lambda slot: str(texts[slot[1]]), sentence)
    return text[:1].upper() + text[1:]


DECLARED: dict[str, RemarkCode] = {}
"""By code, the declared remarks of the modules that were imported."""


def _declare(
    severity: Severity,
    code: str,
    /,
    *texts: str,
    remedy: str = "",
    sizes: Mapping[str | tuple[str | int, ...], str] = MappingProxyType({}),
) -> RemarkCode:
    """Declare a remark; `sizes` has the names of its numbers, with blanks between them, by their unit or by the
    values of a `Size`."""
    by_name = {
        name: Size(*((size,) if isinstance(size, str) else size))  # type: ignore[arg-type]
        for size, names in sizes.items()
        for name in names.split()
    }
    sentences = tuple(sentence for text in texts for sentence in _SENTENCE_END.split(text))
    declared = RemarkCode(code, severity, sentences, remedy, by_name)
    assert DECLARED.setdefault(code, declared) == declared, code
    return declared


fault: Callable[..., RemarkCode] = partial(_declare, "fault")
warning: Callable[..., RemarkCode] = partial(_declare, "warning")
note: Callable[..., RemarkCode] = partial(_declare, "note")
