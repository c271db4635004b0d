"""The section on the life of a pin."""

from __future__ import annotations

from collections.abc import Iterator

from chainunit.report import blocks as b
from chainunit.report.cited import cited, exact, quantity_rows
from chainunit.report.lines import filled
from chainunit.study.record import StudyRecord

from .analysis import PinLife


def blocks(study: StudyRecord) -> Iterator[b.Block]:
    """The table of the life."""
    yield life_table(PinLife.of_study(study.findings), "findings.pin_life")


def life_table(findings: PinLife, path: str) -> b.Table:
    """The life of a pin, which stands at `path` of the result."""
    x = cited(findings, path)
    title = filled("Rating life of a bearing at the pin {}; wanted are {}", x.pin, exact(x.wanted))
    return b.Table(quantity_rows(x.numbers), title=title)
