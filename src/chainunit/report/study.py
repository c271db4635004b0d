"""The report on a study: what was asked, its sections, what it rests on, what was given."""

from __future__ import annotations

import platform
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from importlib import metadata
from typing import Any

from ..study.given import GivenSection, description, given
from ..study.record import StudyRecord
from ..study.result import as_dict
from ..study.rig import DIFFERENCE
from ..text import shown_in
from . import answer, chains, figures, runs, shaft, sizing, wording
from . import blocks as b
from . import run_names as read
from .analyses import ANALYSES, Contents
from .drawing import drawing
from .lines import Line, capital, joined, line, spoken
from .study_motion import motion

DRAWING = "machine.svg"
_DRAWN = (
    "Pins and links, and dimensions by their names in a study file. φ is the crank angle, clockwise from the upward "
    "vertical."
)
_VERSIONS = ("numpy", "casadi", "fmpy", "plotly")


def report(study: StudyRecord, result: Mapping[str, Any] | None = None) -> b.Report:
    """The report; `result` are its numbers, by default those of `as_dict`."""
    s = b.Source(as_dict(study) if result is None else result)
    with shown_in(study.config.units):
        sections = [
            b.Section(name, each.heading, tuple(each.blocks(s, study)))
            for name, each in _SECTIONS.items()
            if name in study.findings or name not in ANALYSES
        ]
        return b.Report(
            study.config.title,
            study.kind,
            s.result,
            wording.of_machine(tuple(_opening(s, study)), study.turning),
            wording.of_machine(tuple(sections), study.turning),
            source=_head(s),
            failure=s.words("failure") if study.failure is not None else (),
            units=study.config.units,
        )


def summary(study: StudyRecord, result: Mapping[str, Any] | None = None) -> b.Report:
    """The verdicts and the main answers of every run alone; arguments as of `report`."""
    s = b.Source(as_dict(study) if result is None else result)
    blocks: list[b.Block] = []
    with shown_in(study.config.units):
        for block in answer.blocks(s, study):
            if isinstance(block, b.Judgement) and block.severity in ("good", "partly", "bad", "alarm"):
                blocks.append(replace(block, form="both"))
        if s.result["answers"]:
            table = runs.table_of_runs(s, study)
            blocks.append(replace(table, rows=tuple(row for row in table.rows if row.form != "long")))
        return b.Report(
            study.config.title,
            study.kind,
            s.result,
            (),
            wording.of_machine((b.Section("summary", "Summary", tuple(blocks)),), study.turning),
            failure=s.words("failure") if study.failure is not None else (),
            units=study.config.units,
        )


def _head(s: b.Source) -> Line:
    """Project, author, date and revision, where they are given; the study file, and the version."""
    named = [s.line(f"{capital(name)}: {{report.{name}}} · ") for name in s.result.get("report", ())]
    return line(*named, s.line("Study file: {source} · chainunit {chainunit}"))


def _motion(study: StudyRecord) -> list[b.Block]:
    # of an FMU of somebody else no links are known
    return [motion(study)] if study.runs and not study.drive.outsider else []


# -- what was asked


def _opening(s: b.Source, study: StudyRecord) -> Iterator[b.Block]:
    noun = study.noun
    question = s.line(
        f"Which motor, gear and flywheel does this {noun} need? Its crank turns at {{=run.crank_speed}}."
        if "sizing" in s.result
        else f"What does the motor of this {noun} have to give? It turns the crank through a gear of ratio "
        "{=machine.ratio}, in normal running at {=run.crank_speed}."
    )
    if study.answers:
        question += s.line(
            " The machine starts from rest{ramp} and is evaluated over {=run.turns} {turns} when steady.",
            ramp=s.line(" in {=run.ramp}") if study.drive.follows else "",
            turns="turn" if study.config.run.turns == 1.0 else "turns",
        )
    if names := study.overloads:
        words = "; ".join(read.title(study, name) for name in names)
        question += line(f" Then come overloads, each by itself: {words}.")
    if study.monte_carlo is not None:
        question += s.line(
            " Then come {=monte_carlo.runs} overloads at random, each by itself: {event}.",
            event=study.config.random.title,
        )
    yield b.Text(question, form="long")
    sized, feed = "sizing" in s.result, study.config.feed
    parts = {"machine": study.drive.machine.p, "run": study.config.run}
    wanted = [("run", "crank_speed"), *([] if sized else [("machine", "ratio")])]
    rows = [
        *([] if sized else [b.TableRow(("motor", s.words("motor.title")))]),
        *(row for of, name in wanted for row in s.rows(type(parts[of]), of, only=name, given=True)),
        *s.rows(type(feed), "feed", given=True),
    ]
    yield b.Table(tuple(rows), title="In short", form="long")
    if not study.drive.outsider:
        alt = f"The {noun}: its pins, links and dimensions"
        yield b.Drawing(drawing(study.drive.machine), alt, DRAWING, _DRAWN)


def _given(s: b.Source, study: StudyRecord) -> Iterator[b.Block]:
    """All values of the study, by section."""
    # a motor on the line follows no reference, and a machine without sides has no feed on one
    unused = [] if study.drive.follows else ["run.ramp"]
    unused += [] if study.config.machine.model.sides else ["sizing.one_sided_share"]
    yield b.Given(tuple((section.title, tuple(_values(s, section, unused))) for section in given(study)))


def _values(s: b.Source, section: GivenSection, unused: Iterable[str]) -> Iterator[b.GivenValue]:
    """Quantities and choices of a section."""
    if section.values is not None:
        for value in s.given(section.values, section.name, section.place):
            if value.name not in unused:
                yield value
    for key, choice in section.choices.items():
        name, place = (".".join(filter(None, (of, key))) for of in (section.name, section.place))
        if isinstance(choice, str):
            shown: b.Shown = s.words(place)
        elif isinstance(choice, bool):
            shown = "yes" if choice else "no"
        elif isinstance(choice, float):
            shown = s.number(place, given=True)
        else:
            shown = ", ".join(f"{x:g}" for x in choice)
        yield b.GivenValue(name, description(name), shown, s.origin(name))


# -- what it rests on


def _basis(s: b.Source, study: StudyRecord) -> Iterator[b.Block]:
    yield from (b.Text(each, "note") for each in s.lines("notes"))
    if s.result["certificate"]:
        yield from _certificate(s, study, s.result["certificate"])
    tuned = s.result["control"]
    control: Line = (
        joined(s.line(f"{spoken(name)} {{control.{name}}}") for name in tuned)
        if isinstance(tuned, Mapping)
        else s.words("control")
    )
    versions = {"Python": platform.python_version()} | {name: _version(name) for name in _VERSIONS}
    libraries = "".join(f", {name} {version}" for name, version in versions.items())
    rows = (
        *(b.TableRow((f"{name} FMU", s.words(f"fmus.{name}"))) for name in s.result["fmus"]),
        b.TableRow(("speed control", control)),
        b.TableRow(("versions", s.line("chainunit {chainunit}{libraries}", libraries=libraries))),
    )
    yield b.Table(rows, title="How it was made", numeric=False, form="long")
    traced = (
        "Every number in the text of this page is taken from result.json, which is embedded here whole; point at a "
        "number to see where it stands there, and with more digits."
    )
    yield b.Text(traced, "note", "long")


def _certificate(
    s: b.Source, study: StudyRecord, certificate: Mapping[str, Mapping[str, Any]]
) -> Iterator[b.Block]:
    words = (
        "What the motor gave to the shaft, computed in the motor, against what the machine stored and dissipated, "
        "computed in the machine: the share of the energy moved that is missing."
    )
    yield b.Text(words, form="long")
    titles = {run: study.called(run) for run in certificate}
    yield runs.matrix(s, "certificate", titles, "Energy certificate", "run", form="long")
    for name in dict.fromkeys(name for shares in certificate.values() for name in shares):
        have = [run for run, shares in certificate.items() if name in shares]
        run = max(have, key=lambda run: s.value(f"certificate.{run}.{name}") or 0.0)
        most = f"{{certificate.{run}.{name}}}"
        text = f"{spoken(name.removesuffix('_share')).capitalize()}: at most {most} of the energy moved."
        if name.endswith(DIFFERENCE):
            text = (
                f"Difference of {name.removesuffix(DIFFERENCE)} to the monolithic solution, in parts of its "
                f"peak: at most {most} ({titles[run]}), {len(have)} runs compared."
            )
        yield b.Text(s.line(text), form="short")


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "not installed"


_SECTIONS: Mapping[str, Contents] = {
    "answer": Contents("The answer", answer.blocks),
    "sizing": Contents("The drive", sizing.blocks),
    "runs": Contents("Every run in numbers", runs.blocks),
    "shaft": Contents("The driveline", shaft.blocks, shaft.PICTURES.files),
    "chains": Contents("Chains and two bars", chains.blocks, chains.PICTURES.files),
    **ANALYSES,
    "plots": Contents("Plots", figures.PICTURES.figures, figures.PICTURES.files),
    "motion": Contents("The machine in motion", lambda s, study: iter(_motion(study))),
    "basis": Contents("What this rests on", _basis),
    "given": Contents("All that was given", _given),
}
PICTURES = (DRAWING, *(picture for each in _SECTIONS.values() for picture in each.pictures))
"""Files of all figures that a report may have."""
