"""Whether a rigid model of the drive holds (VDI 2149), as a check."""

from __future__ import annotations

from collections.abc import Iterator

from ...study.line.rigid_line import HOLDS_FROM
from ...study.record import StudyRecord
from .row import CheckRow, NotChecked


def checks(study: StudyRecord) -> Iterator[CheckRow | NotChecked]:
    """The lowest natural frequency of the line over the turns of the driver."""
    line = study.statics.rigid_line
    if line is None:
        yield NotChecked(
            "rigid model of the drive", "the file gives no elastic line; add [driveline]", "driveline"
        )
        return
    yield CheckRow(
        "shaft line", "lowest natural frequency over that of the turns", "VDI 2149 Part 1",
        f"f1/f >= {HOLDS_FROM:g}: the rigid model holds", line.ratio, HOLDS_FROM, "rigid_line.ratio",
        {"f1": "rigid_line.natural_frequency", "f": "rigid_line.driver_frequency"}, at_least=True,
    )  # fmt: skip
