"""The report on a study: the answer, the question, the results, their basis, the given values."""

from __future__ import annotations

import platform
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from functools import cache
from importlib import metadata
from typing import Any

from ..reading.text import shown_in
from ..study.event_table import random_runs
from ..study.given import GivenSection, description, given_sections
from ..study.record import StudyRecord
from ..study.transients import DIFFERENCE
from . import answer, figures, run_names, runs, shaft
from . import blocks as b
from .analyses import analysis_sections
from .capability import Contents, capabilities
from .drawing import drawing
from .lines import Line, capital, join, line, spoken
from .live.runs import stand_in, whole_of
from .live.study import of_study
from .live_block import Live
from .study_motion import motion

DRAWING, QUESTION = "machine.svg", "question"
_DRAWING_CAPTION = (
    "Pins and links, and dimensions by their names in a study file. φ is the {driver} angle, {counts}."
)
_VERSIONS = ("numpy", "casadi", "fmpy", "plotly")


def report(study: StudyRecord, result: Mapping[str, Any]) -> b.Report:
    """The report on a study; `result` has its numbers, as `chainunit.study.result.as_dict` gives them."""
    s = b.Source(result, study.driver_noun)
    with shown_in(study.config.units):
        sections = [
            b.Section(name, contents.heading, tuple(contents.blocks(s, study)), beside=name == QUESTION)
            for name, contents in _sections().items()
            if name not in analysis_sections() or (contents.analysis or name) in study.findings
        ]
        # an analysis may have nothing to show
        sections = [
            section for section in sections if section.blocks or section.name not in analysis_sections()
        ]
        return b.Report(
            study.config.title,
            study.kind,
            s.result,
            (),
            tuple(sections),
            source=s.source_line(),
            failure=s.words("failure") if study.failure is not None else (),
            units=study.config.units,
        )


def summary(study: StudyRecord, result: Mapping[str, Any]) -> b.Report:
    """A short report: the verdicts and the main answers of every run. Arguments as of `report`."""
    s = b.Source(result, study.driver_noun)
    blocks: list[b.Block] = list(answer.sentence(s))
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
            (b.Section("summary", "Summary", tuple(blocks)),),
            failure=s.words("failure") if study.failure is not None else (),
            units=study.config.units,
        )


def _motion(study: StudyRecord) -> list[b.Block]:
    # the links of a foreign FMU are unknown
    return [motion(study)] if study.runs and not study.drive.foreign_machine else []


# -- the question


_GIVEN_DRIVE = (
    "What does the motor of {noun} have to give? It turns the {driver} through a gear of ratio {=machine.ratio}, in "
    "normal running at {=run.crank_speed:4}."
)


def _question(s: b.Source, study: StudyRecord) -> Iterator[b.Block]:
    # a linkage has its title in place of a noun
    noun = f"this {study.noun}" if study.noun[:1].islower() else f'the machine "{study.noun}"'
    question = s.line(_GIVEN_DRIVE if study.proposal is None else study.proposal.question, noun=noun)
    if study.answers:
        question += s.line(
            " The machine starts from rest{ramp} and is evaluated over {=run.turns} {turns} when steady.",
            ramp=s.line(" in {=run.ramp}") if study.drive.follows else "",
            turns="turn" if study.config.run.turns == 1.0 else "turns",
        )
    if names := study.overloads:
        titles = "; ".join(run_names.title(study, name) for name in names)
        question += line(f" Then come overloads, each by itself: {titles}.")
    for plan in random_runs(study.config.plans):
        if plan.table in study.findings:
            sentence = f" Then come {{={plan.table}.runs}} overloads at random, each by itself: {{event}}."
            question += s.line(sentence, event=plan.event.title)
    yield b.Text(question, form="long")
    is_chosen, feed = study.proposal is not None, study.config.feed
    parts = {"machine": study.drive.machine.p, "run": study.config.run}
    given_names = [("run", "crank_speed"), *([] if is_chosen else [("machine", "ratio")])]
    rows = [
        *([] if is_chosen else [b.TableRow(("motor", s.words("motor.title")))]),
        *(
            row
            for table, name in given_names
            for row in s.rows(type(parts[table]), table, only=name, as_given=True)
        ),
        *s.rows(type(feed), "feed", as_given=True),
    ]
    yield b.Table(tuple(rows), title="In short", form="long")
    if not study.drive.foreign_machine:
        alt, model = f"{capital(noun)}: its pins, links and dimensions", study.drive.machine.model
        yield b.Drawing(
            drawing(study.drive.machine), alt, DRAWING, s.line(_DRAWING_CAPTION, counts=model.angle_counts)
        )


def _given(s: b.Source, study: StudyRecord) -> Iterator[b.Block]:
    """All given values of the study, by section."""
    # a motor on the line follows no reference
    unused_names = [] if study.drive.follows else ["run.ramp"]
    unused_names += [
        name
        for part in capabilities()
        for name in part.unused_values(study.config.machine, study.config.plans[part.name])
    ]
    yield b.Given(
        tuple((section.title, tuple(_values(s, section, unused_names))) for section in given_sections(study))
    )


def _values(s: b.Source, section: GivenSection, unused_names: Iterable[str]) -> Iterator[b.GivenValue]:
    """The quantities and choices of a section as given values, except those with a name in `unused_names`."""
    if section.values is not None:
        for value in s.given_values(section.values, section.name, section.place):
            if value.name not in unused_names:
                yield value
    for key, choice in section.choices.items():
        name, place = (".".join(filter(None, (prefix, key))) for prefix in (section.name, section.place))
        if isinstance(choice, str):
            content: b.Content = s.words(place)
        elif isinstance(choice, bool):
            content = "yes" if choice else "no"
        elif isinstance(choice, float):
            content = s.number(place, as_given=True)
        else:
            content = ", ".join(x if isinstance(x, str) else f"{x:g}" for x in choice)
        yield b.GivenValue(name, description(name), content, s.origin(name), s.place(name))


def _live(s: b.Source, study: StudyRecord) -> Iterator[b.Block]:
    """The live machine of the study; none of a machine whose equations are not known."""
    if study.drive.foreign_machine:
        return
    config = study.config
    yield Live(
        lambda: of_study(config, study.drive, config.drive, study.proposal, study.verdict),
        whole_of(stand_in(study.drive)),
    )


# -- the basis of the results


def _basis(s: b.Source, study: StudyRecord) -> Iterator[b.Block]:
    yield from basis(s, study)
    yield software(s)
    hint = (
        "Every number in the text of this page comes from result.json, which the page contains whole. Point at a "
        "number to see its place in result.json and more digits."
    )
    yield b.Text(hint, "hint", "long")


def basis(s: b.Source, study: StudyRecord) -> Iterator[b.Block]:
    """The notes on a study, and its energy certificate."""
    yield from (b.Text(note, "note") for note in s.lines("notes"))
    yield from answer.remark_tables(study.notes, "notes")
    if s.result["certificate"]:
        yield from _certificate(s, study, s.result["certificate"])


def software(s: b.Source) -> b.Table:
    """The FMUs, the control of the speed, and the versions of a study."""
    gains = s.result["control"]
    control: Line = (
        join(s.line(f"{spoken(name)} {{control.{name}}}") for name in gains)
        if isinstance(gains, Mapping)
        else s.words("control")
    )
    versions = {"Python": platform.python_version()} | {name: _version(name) for name in _VERSIONS}
    libraries = "".join(f", {name} {version}" for name, version in versions.items())
    rows = (
        *(b.TableRow((f"{name} FMU", s.words(f"fmus.{name}"))) for name in s.result["fmus"]),
        b.TableRow(("speed control", control)),
        b.TableRow(("versions", s.line("chainunit {chainunit}{libraries}", libraries=libraries))),
    )
    return b.Table(rows, title="Models and software", numeric=False, form="long")


def _certificate(
    s: b.Source, study: StudyRecord, certificate: Mapping[str, Mapping[str, Any]]
) -> Iterator[b.Block]:
    method = (
        "The energy that the motor gave to the shaft, computed in the motor, is compared with the energy that the "
        "machine stored and dissipated, computed in the machine. The table shows the missing share of the energy "
        "moved."
    )
    yield b.Text(method, "note", "long")
    titles = {run: study.title_of(run) for run in certificate}
    yield runs.matrix(s, "certificate", titles, "Energy certificate", "run", form="long")
    for name in dict.fromkeys(name for shares in certificate.values() for name in shares):
        compared_runs = [run for run, shares in certificate.items() if name in shares]
        run = max(compared_runs, key=lambda run: study.certificate[run][name])
        most = f"{{certificate.{run}.{name}}}"
        text = f"{spoken(name.removesuffix('_share')).capitalize()}: at most {most} of the energy moved."
        if name.endswith(DIFFERENCE):
            text = (
                f"Difference of {name.removesuffix(DIFFERENCE)} to the monolithic solution, in parts of its "
                f"peak: at most {most} ({{title}}); runs compared: {len(compared_runs)}."
            )
        yield b.Text(s.line(text, title=titles[run]), form="short")


@cache
def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "not installed"


@cache
def _sections() -> Mapping[str, Contents]:
    """By name, all sections that a report may have."""
    return {
        "answer": Contents("The answer", answer.blocks),
        QUESTION: Contents("The question", _question),
        "live": Contents("Try it", _live),
        **{name: contents for name, contents in analysis_sections().items() if contents.before == "runs"},
        "runs": Contents("Every run in numbers", runs.blocks),
        "shaft": Contents("The driveline", shaft.blocks, shaft.PICTURES.files),
        **analysis_sections(),
        "plots": Contents("Plots", figures.PICTURES.figures, figures.PICTURES.files),
        "motion": Contents("The machine in motion", lambda s, study: iter(_motion(study))),
        "basis": Contents("Basis of the results", _basis),
        "given": Contents("Given values", _given),
    }


def pictures() -> tuple[str, ...]:
    """The files of all figures that a report may have."""
    return (DRAWING, *(picture for contents in _sections().values() for picture in contents.pictures))
