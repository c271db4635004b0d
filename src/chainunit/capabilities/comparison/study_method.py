"""`Study.compare`, and its result."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...core.errors import check_kind
from ...reading.results import as_data
from ...report.capability import AnyStudy
from ...report.reported_result import ReportedResult
from ...study.stored_result import StoredResult, read_result, stored_result
from ...work.progress import TaskProgress
from .comparison import StudyComparison
from .page import TASK


class ComparisonResult(ReportedResult[tuple[StoredResult, StoredResult], StudyComparison]):
    """Two results side by side, A and B. Its `repr` shows the verdicts of both and the given values that differ."""

    _task = TASK

    def _answer_rows(self) -> Mapping[str, Mapping[str, Any]]:
        """Each measure of each run that both have: the values of both, the difference, and its share."""
        rows = {}
        for run, compared in self._outcome.runs.items():
            for name, measure in compared.measures.items():
                row = as_data(measure)
                del row["title"]
                rows[f"{run.removeprefix('answers.')}.{name}"] = row
        return rows


def compare(
    study: AnyStudy,
    other: AnyStudy | ReportedResult[Any, Any] | str | Path,
    folder: str | Path | None = None,
    progress: TaskProgress | None = None,
) -> ComparisonResult:
    """Run the study and compare its result with another one: the given values that differ, and every measure of each
    run of both.

    Parameters
    ----------
    other : a study, which is run, too; the result of one; or the folder of a result
    folder : the folder to which the files of ``chainunit compare -o`` are written
    progress : as of `chainunit.Study.run`

    Raises
    ------
    InputError, RunError
        of the runs, and for a folder without a result.
    WriteError
        for a file that cannot be written; the others are written.
    """
    is_study = hasattr(other, "of_tables")
    if not is_study:
        kinds = "a study, the result of one, or the folder of a result"
        check_kind("other", other, ReportedResult | str | Path, kinds)
    # the folder is read before the run
    second = read_result(Path(other)) if isinstance(other, str | Path) else None
    first = _stored(study.run(progress=progress))
    if second is None:
        second = _stored(other.run(progress=progress) if is_study else other)  # type: ignore[union-attr]
    return ComparisonResult.made((first, second), folder, progress)


def _stored(result: Any) -> StoredResult:
    data = json.loads(result.to_json())
    return stored_result(Path(data["source"]), data)


METHOD, RESULT = compare, ComparisonResult
