"""The sheet of a study that an engineer signs: question, drawing, answer, demands, assumptions, basis, and what was
not checked; the whole report is its annex."""

from __future__ import annotations

from collections.abc import Iterator, Set
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..study.record import StudyRecord
from . import blocks as b
from .capability import capabilities
from .lines import Line, Number, capital, line
from .pdf import Sheet
from .runs import table_of_runs

_FIRST = ("question", "answer")
_BEYOND = (
    "fatigue of links, welds and frame; wear of pins; bearings of the motor",
    "play in pins and gear; bending of links; vibration of frame and foundation",
    "noise, dust, temperature of the surroundings beyond that of the study; safety of persons",
)
"""Questions that the program does not answer."""
_OF_START = {"soft_start": "soft", "inverter": "inverter", "star_delta": "star-delta"}
"""The groups of values that one way of starting has, by that way."""
_LABELS = ("project", "author", "date", "revision")


def sheet(study: StudyRecord, report: b.Report) -> Sheet:
    """The sheet of a study with this report."""
    s = b.Source(report.result, study.driver_noun)
    given = {section.name: section for section in report.sections}
    sheets = [name for part in capabilities() for name in part.on_sheet() if name in given]
    sections = [
        *(given[name] for name in _FIRST if name in given),
        *(given[name] for name in sheets),
        b.Section("demands", "Demands on the drive", tuple(_demands(s, study))),
        b.Section(
            "assumptions",
            "Assumptions: values that the study file does not give",
            tuple(_assumed(given, _unused(study))),
        ),
        *([replace(given["basis"], heading="Basis and validity")] if "basis" in given else []),
        b.Section("unchecked", "What was not checked", tuple(_unchecked(study))),
    ]
    shown = {*_FIRST, *sheets, "basis", "live", "motion"}
    annex = tuple(each for each in report.sections if each.name not in shown)
    return Sheet(
        report.title or capital(report.kind),
        _title_block(study, report),
        tuple(sections),
        annex,
        report.units,
    )


def _title_block(study: StudyRecord, report: b.Report) -> dict[str, str]:
    labels: dict[str, Any] = {name: study.config.file.labels.get(name, "") for name in _LABELS}
    machine = f"{capital(study.noun)}, {study.drive.machine.model.name}"
    return {
        **{capital(name): str(value) for name, value in labels.items()},
        "Machine": machine,
        "Study file": Path(str(report.result.get("source", ""))).name,
        "Computed by": f"chainunit {report.result['chainunit']}",
        "Status": report.status if not report.failure else "stopped early",
    }


def _demands(s: b.Source, study: StudyRecord) -> Iterator[b.Block]:
    if s.result["answers"]:
        table = table_of_runs(s, study)
        yield replace(table, rows=tuple(row for row in table.rows if row.form != "long"), form="long")


def _unused(study: StudyRecord) -> set[str]:
    """The groups of values that a motor of a catalogue has for other ways of starting than that of the study."""
    if study.plate is None:
        return set()
    start = study.config.drive.start
    return {group for group, way in _OF_START.items() if way != start} | {"solver"}


def _assumed(given: dict[str, b.Section], unused: Set[str]) -> Iterator[b.Block]:
    """The values that the file leaves out, of all sections of given values but those of `unused` groups."""
    for block in given["given"].blocks if "given" in given else ():
        if isinstance(block, b.Given):
            kept = (
                (title, tuple(x for x in values if _is_assumed(x) and not unused & set(x.name.split("."))))
                for title, values in block.sections
            )
            yield b.Given(tuple((title, values) for title, values in kept if values))


def _is_assumed(value: b.GivenValue) -> bool:
    """Whether the file leaves out a number, beside those of the events."""
    of_event = value.name.startswith("event.")
    return value.origin not in ("", "file") and isinstance(value.value, Number) and not of_event


def _unchecked(study: StudyRecord) -> Iterator[b.Block]:
    lines: list[Line] = [each for part in capabilities() for each in part.unchecked(study)]
    yield b.Text(
        "The following was not computed, and the numbers above say nothing about it:", "lead", "long"
    )
    for each in (*lines, *_BEYOND):
        yield b.Text(line("– ", each), "plain", "long")
