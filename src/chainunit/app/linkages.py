"""`linkage`: a linkage file from Python, as ``chainunit linkage`` shows it."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..core.declared_numbers import as_text
from ..core.errors import RemarkWarning, check_kind
from ..core.inputs import TOML, file_text
from ..machines.linkages.file import linkage_in
from ..machines.machine import Machine
from ..reading.tables import slips_of
from ..report.linkage_report import TASK, LinkageOutcome, LinkageQuestion
from ..report.reported_result import ReportedResult
from ..study.linkage_turn import LinkageFindings, speed_of_driver
from ..work.progress import TaskProgress


class LinkageResult(ReportedResult[LinkageQuestion, LinkageOutcome]):
    """A linkage over the way of its driver. Its `repr` shows its groups, its motion and its torque."""

    _task = TASK

    @property
    def machine(self) -> Machine:
        """The machine of the file, with its parameters."""
        return self._question.machine

    @property
    def record(self) -> LinkageFindings:
        """All that was found, as the report reads it."""
        return self._outcome[0]

    def _answer_rows(self) -> Mapping[str, Mapping[str, Any]]:
        """Effort, margins, joints, strokes and swings, by their places in linkage.json."""
        shown = ("turn", "groups", "joints", "strokes", "swings")
        return {name: entry for name, entry in super()._answer_rows().items() if name.split(".")[0] in shown}


def linkage(
    file: str | Path,
    speed: Any = None,
    folder: str | Path | None = None,
    progress: TaskProgress | None = None,
) -> LinkageResult:
    """Motion, torque and reactions of a linkage file over the way of its driver.

    Parameters
    ----------
    file : a linkage file (TOML)
    speed : of the driver, a text with a unit or a quantity of pint; 60 rev/min by default, 0.1 m/s of a driver that
        slides
    folder : the folder to which the files of ``chainunit linkage -o`` are written
    progress : as of `chainunit.Study.run`

    Raises
    ------
    InputError
        with a line for each fault of the file, and for a speed of another kind.
    WriteError
        for a file that cannot be written; the others are written.

    Warns
    -----
    UserWarning
        for a value that looks like a slip of its unit.
    """
    check_kind("file", file, str | Path, "the path of a linkage file")
    speed = as_text(speed)
    check_kind("speed", speed, str | None, 'a text with a unit, such as "60 rpm"')
    model, unusual = linkage_in(Path(file))
    for value in slips_of(unusual):
        warnings.warn(value.sentence, RemarkWarning, stacklevel=2)
    machine = Machine(model)
    speed, text = speed_of_driver(machine, speed, "speed"), file_text(Path(file), TOML)
    question = LinkageQuestion(machine, speed, str(file), unusual, text=text)
    return LinkageResult.made(question, folder, progress)
