"""The sheet of a study that an engineer signs: answer, question, drawing, checks, energy, assumptions, basis, and
what was not checked; the rest of the report is its annex."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from .. import __version__
from ..study.record import StudyRecord, StudySetup
from . import blocks as b
from .analyses import analysis_sections
from .capability import capabilities
from .figure import Figure
from .given_numbers import asked_speed
from .lines import Line, Number, capital, filled, line
from .pdf import Sheet
from .study import basis, software

_FIRST = ("answer", "question")
_BEYOND = (
    "fatigue of links, welds and frame; wear of pins; bearings of the motor",
    "play in pins and gear; bending of links; vibration of frame and foundation",
    "noise, dust, temperature of the surroundings beyond that of the study; safety of persons",
)
"""Questions that the program does not answer."""
_OF_START = {"soft_start": "soft", "inverter": "inverter", "overload": "inverter", "star_delta": "star-delta"}
"""The values and groups of values that one way of starting has, by that way."""
_LABELS = ("project", "author", "date", "revision")


def sheet(study: StudyRecord, report: b.Report) -> Sheet:
    """The sheet of a study with this report."""
    setup = study.setup
    report_sections = {section.name: section for section in report.sections}
    contents = analysis_sections()
    checked = [name for name in contents if contents[name].on_sheet and name in report_sections]
    sections = (
        *(report_sections[name] for name in _FIRST),
        *(_on_sheet(report_sections[name]) for name in checked),
        b.Section(
            "assumptions", "Assumptions: values that no file gives", tuple(_assumed(report_sections, setup))
        ),
        _basis(study),
        b.Section("unchecked", "What was not checked", tuple(_unchecked(study))),
    )
    # what was not checked, and what is assumed, stand on the sheet
    shown = {*_FIRST, *checked, "basis", "live", "motion", "not_checked", "plots", "given"}
    annex = (
        *(_without_figures(section) for section in report.sections if section.name not in shown),
        b.Section("plots", "Plots", tuple(report.figures)),
        b.Section("given", "Other given values", tuple(_not_assumed(report_sections, setup))),
        b.Section("software", "Models and software", (software(study.runs),)),
    )
    title = report.title or capital(report.kind)
    return Sheet(title, _title_block(setup, report), sections, annex, report.units)


def _on_sheet(section: b.Section) -> b.Section:
    """A section for the sheet: without its figures, which repeat numbers of its tables, and with its blocks of the
    form ``sheet``, if it has some, in place of its long ones."""
    texts = _without_figures(section).blocks
    if any(block.form == "sheet" for block in texts):
        texts = tuple(b.of_form(texts, "sheet"))
    return replace(section, blocks=texts)


def _without_figures(section: b.Section) -> b.Section:
    """A section without its figures, which stand together."""
    return replace(section, blocks=tuple(block for block in section.blocks if not isinstance(block, Figure)))


def _basis(study: StudyRecord) -> b.Section:
    """Basis and validity, with the speed up to which the numbers hold at its head."""
    head = [block for part in capabilities() for block in part.answer(study).validity]
    return b.Section("basis", "Basis and validity", (*_speed(study), *head, *basis(study)))


def _speed(study: StudyRecord) -> Iterator[b.Block]:
    """The speed of the runs, and the reach of rigid links."""
    if not study.runs.answers:
        return
    text = f"The runs ask for a speed of the {study.setup.driver_noun} of {{}}."
    if study.setup.drive.foreign_machine or not study.setup.drive.machine.model.sides:
        text += " No highest speed was computed up to which the numbers hold"
        text += (
            "."
            if study.setup.drive.foreign_machine
            else ": rigid links set none. Another speed asks for another study."
        )
    yield b.Text(filled(text, asked_speed(study.setup)), "note", "long")


def _title_block(setup: StudySetup, report: b.Report) -> dict[str, str]:
    """The entries of the title block: labels of the file, machine, study file, status."""
    labels: dict[str, Any] = {name: setup.config.file.labels.get(name, "") for name in _LABELS}
    machine = f"{capital(setup.noun)}, {setup.drive.machine.model.name}"
    return {
        **{capital(name): str(value) for name, value in labels.items()},
        "Machine": machine,
        "Study file": Path(setup.config.file.source).name,
        "Computed by": f"chainunit {__version__}",
        "Status": report.status if not report.failure else "stopped early",
    }


def _assumed(report_sections: dict[str, b.Section], setup: StudySetup) -> Iterator[b.Block]:
    """The values that the files leave out, without chosen ones, which are the answer, and without the values of
    a motor of a catalogue beside its surroundings."""
    yield _given(report_sections, lambda value: _is_used(value, setup) and _is_assumed(value, setup))
    if setup.plate is not None:
        text = 'Values of the motor and chosen values: section "Other given values" of the annex.'
        yield b.Text(text, "note", "long")


def _not_assumed(report_sections: dict[str, b.Section], setup: StudySetup) -> Iterator[b.Block]:
    """The other given values; a value of an event that no file gives stands at the first of the events that have
    it."""
    listed: set[tuple[str, Any]] = set()

    def is_shown(value: b.GivenValue) -> bool:
        """Whether a value is used and not assumed; equal default values of events are shown once."""
        if not _is_used(value, setup) or _is_assumed(value, setup):
            return False
        if not value.name.startswith("event.") or value.origin != "declared":
            return True
        key = value.description, value.value.value if isinstance(value.value, Number) else value.value
        is_first = key not in listed
        listed.add(key)
        return is_first

    yield _given(report_sections, is_shown)


def _given(report_sections: dict[str, b.Section], is_shown: Callable[[b.GivenValue], bool]) -> b.Given:
    """The given values of the report that are shown."""
    (block,) = (block for block in report_sections["given"].blocks if isinstance(block, b.Given))
    sections = ((title, tuple(filter(is_shown, values))) for title, values in block.sections)
    return b.Given(tuple(section for section in sections if section[1]))


def _is_assumed(value: b.GivenValue, setup: StudySetup) -> bool:
    """Whether the files leave out a number that is neither chosen nor of an event, nor of a motor of a catalogue."""
    chosen = "" if setup.proposal is None else setup.proposal.name
    if value.origin in ("", "file", "linkage", chosen) or not isinstance(value.value, Number):
        return False
    table, _, name = value.name.partition(".")
    if table == "event" or setup.plate is None:
        return table != "event"
    return table != "motor" or name.startswith("ambient.")


def _is_used(value: b.GivenValue, setup: StudySetup) -> bool:
    """Whether a value is of the files, or not of a starter that the motor of a catalogue does without."""
    table, _, name = value.name.partition(".")
    if value.origin == "file" or setup.plate is None or table not in ("motor", "starter"):
        return True
    start = setup.config.drive.start
    return _OF_START.get(name.partition(".")[0], start) == start


def _unchecked(study: StudyRecord) -> Iterator[b.Block]:
    """All that the study did not compute."""
    lines: list[Line] = [sentence for part in capabilities() for sentence in part.unchecked(study)]
    yield b.Text(
        "The following was not computed, and the numbers above say nothing about it:", "lead", "long"
    )
    for sentence in (*lines, *_BEYOND):
        yield b.Text(line("– ", sentence), "note", "long")
