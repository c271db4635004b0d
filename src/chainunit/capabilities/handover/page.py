"""The report on a handover: what sizing.json says, and what it leaves open."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import NamedTuple

from ...core.files import write_file
from ...core.inputs import file_bytes
from ...reading.results import as_data
from ...report import blocks as b
from ...report.cited import cited, number
from ...report.lines import Name, filled, line
from ...report.task import Task, Writer
from ...study.record import LOAD_CYCLE
from .sizing import CYCLE, RUN, STUDY, HandedDrive, by_name, sizing_of
from .studied import read_study
from .tables import CANDIDATES, CHECKS, candidates_csv, checks_csv, cycle_csv


class Handover(NamedTuple):
    """The files for other programs, ready to be written: the content of sizing.json, and those beside it by name."""

    sizing: HandedDrive
    files: Mapping[str, bytes]


def hand_over(results: Path) -> Handover:
    """The files for other programs of the study in the folder `results`; no run is made.

    Raises
    ------
    InputError
        see `chainunit.capabilities.handover.studied.read_study`.
    """
    study = read_study(results)
    files = {
        STUDY: file_bytes(study.result.file),
        LOAD_CYCLE: file_bytes(study.result.file.parent / LOAD_CYCLE),
    }
    texts = {CYCLE: cycle_csv(study.steady), RUN: cycle_csv(study.run)}
    for name, path, table in (
        (CANDIDATES, "sizing/candidates", candidates_csv),
        (CHECKS, "checks/rows", checks_csv),
    ):
        if rows := study.rows(path):
            texts[name] = table(rows)
    return Handover(sizing_of(study), files | {name: text.encode() for name, text in texts.items()})


def handover_report(handover: Handover) -> b.Report:
    """The report on a handover."""
    x = cited(handover.sizing)
    return b.Report(
        "Files for other programs",
        "Handover",
        as_data(handover.sizing),
        tuple(_opening(x)),
        (b.Section("left-open", "What the files leave open", tuple(_left_open(handover.sizing))),),
        source=filled("{} · chainunit {}", x.source, x.chainunit),
        opening_title="What the files say",
    )


def _opening(x: HandedDrive) -> Iterator[b.Block]:
    """The known values of the drive in a table, and their number."""
    rows = tuple(
        b.TableRow((Name(name), value if isinstance(value, str) else number(value, 5)))
        for name, value in by_name(x.parts)
        if name not in x.open
    )
    title = line(x.title, ": ") if x.title else ()
    yield b.Text(line(title, f"{len(rows)} values of the drive are in sizing.json."))
    yield b.Table(rows, b.heads("name", "value"), numeric=False, title="Values of the drive", form="long")


def _left_open(sizing: HandedDrive) -> Iterator[b.Block]:
    """The names of the values that the study does not know."""
    if not sizing.open:
        yield b.Text("Every value of sizing.json is known.")
        return
    yield b.Text("The study does not know these values of sizing.json; fill them in:")
    rows = tuple(b.TableRow((Name(name),)) for name in sizing.open)
    yield b.Table(rows, b.heads("name"), numeric=False, title="Names without a value")


def _writers(handover: Handover, report: b.Report, folder: Path, of_report: list[Writer]) -> list[Writer]:
    files = handover.files.items()
    return [*(partial(write_file, folder / name, content) for name, content in files), *of_report]


TASK: Task[Path, Handover] = Task(
    "handover",
    lambda results, folder, progress: hand_over(results),
    handover_report,
    files=(CYCLE, RUN, LOAD_CYCLE, STUDY, CANDIDATES, CHECKS),
    writers=_writers,
    sources=lambda results: (results / "result.json",),
)
