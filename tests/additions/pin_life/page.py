"""The section on the life of a pin."""

from __future__ import annotations

from collections.abc import Iterator

from chainunit.report import blocks as b
from chainunit.study.record import StudyRecord

from .analysis import LifeNumbers


def blocks(s: b.Source, study: StudyRecord) -> Iterator[b.Block]:
    """The table of the life."""
    title = s.line("Rating life of a bearing at the pin {pin_life.pin}; wanted are {=pin_life.wanted}")
    yield b.Table(s.rows(LifeNumbers, "pin_life"), title=title)
