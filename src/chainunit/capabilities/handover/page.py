"""The report on a handover: what sizing.json says, and what it leaves open."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from ...core.files import write_file
from ...report import blocks as b
from ...report.lines import Name
from ...report.task import Task, Writer
from ...study.record import LOAD_CYCLE
from ...work.progress import TaskProgress
from .candidates import CANDIDATES, candidates_csv
from .checks import CHECKS, checks_csv
from .cycle import as_csv
from .sizing import CYCLE, RUN, STUDY, sizing_of, values_of
from .studied import read_study


@dataclass(frozen=True)
class Handover:
    """The files for other programs, ready to be written."""

    sizing: Mapping[str, Any]
    """the content of sizing.json"""
    files: Mapping[str, bytes]
    """the files beside it, by name"""


def hand_over(results: Path) -> Handover:
    """The files for other programs of the study in the folder `results`; no run is made.

    Raises
    ------
    InputError
        see `chainunit.capabilities.handover.studied.read_study`.
    """
    study = read_study(results)
    texts = {CYCLE: as_csv(study.steady), RUN: as_csv(study.run)}
    if study.candidates:
        texts[CANDIDATES] = candidates_csv(study.candidates)
    if study.checks:
        texts[CHECKS] = checks_csv(study.checks)
    files = {STUDY: study.files[study.result.file.name], LOAD_CYCLE: study.files[LOAD_CYCLE]}
    return Handover(sizing_of(study), files | {name: text.encode() for name, text in texts.items()})


def handover_report(handover: Handover) -> b.Report:
    """The report on a handover."""
    s = b.Source(handover.sizing)
    return b.Report(
        "Files for other programs",
        "Handover",
        handover.sizing,
        tuple(_opening(s)),
        (b.Section("left-open", "What the files leave open", tuple(_left_open(s))),),
        source=s.line("{source} · chainunit {chainunit}"),
        opening_title="What the files say",
    )


def _opening(s: b.Source) -> Iterator[b.Block]:
    unknown, rows = s.result["open"], []
    for name, value in values_of(s.result):
        if name not in unknown:
            shown = s.words(name) if isinstance(value, str) else s.number(name, digits=5)
            rows.append(b.TableRow((Name(name), shown)))
    title = s.line("{title}: ") if s.result["title"] else ()
    yield b.Text((*title, f"{len(rows)} values of the drive are in sizing.json."))
    yield b.Table(
        tuple(rows), b.heads("name", "value"), numeric=False, title="Values of the drive", form="long"
    )


def _left_open(s: b.Source) -> Iterator[b.Block]:
    unknown = s.result["open"]
    if not unknown:
        yield b.Text("Every value of sizing.json is known.")
        return
    yield b.Text("The study does not know these values of sizing.json; fill them in:")
    rows = tuple(b.TableRow((Name(name),)) for name in unknown)
    yield b.Table(rows, b.heads("name"), numeric=False, title="Names without a value")


def _writers(handover: Handover, report: b.Report, folder: Path, of_report: list[Writer]) -> list[Writer]:
    files = handover.files.items()
    return [*(partial(write_file, folder / name, content) for name, content in files), *of_report]


def _compute(results: Path, folder: Path | None, progress: TaskProgress) -> Handover:
    progress("reading the study", 0.0, 1.0)
    return hand_over(results)


TASK: Task[Path, Handover] = Task(
    "handover",
    _compute,
    handover_report,
    files=(CYCLE, RUN, LOAD_CYCLE, STUDY, CANDIDATES, CHECKS),
    writers=_writers,
)
