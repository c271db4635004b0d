"""The report on a study: the answer, the question, the results, their basis, the given values."""

from __future__ import annotations

import platform
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from functools import cache
from importlib import metadata
from typing import Any

from .. import __version__
from ..core.descriptions import of_driver
from ..core.quantities import finite, variables
from ..reading.results import InUnit
from ..reading.text import shown_in
from ..study.event_table import random_runs
from ..study.given import GivenSection, description, given_sections, origin_of, place_of
from ..study.provenance import Heading
from ..study.record import StudyRecord, StudyRuns, StudySetup
from ..study.result import speed_control
from ..study.transients import DIFFERENCE
from . import answer, figures, run_names, runs, shaft, slip
from . import blocks as b
from .analyses import analysis_sections
from .capability import Contents, capabilities
from .cited import cited, exact, numbers, quantity_rows, source_line
from .drawing import drawing
from .given_numbers import asked_speed, motor_title, ratio, run_settings
from .lines import Line, Number, capital, filled, join, line, spoken
from .live.runs import stand_in, whole_of
from .live.study import of_study
from .runs import matrix
from .study_motion import motion

DRAWING, QUESTION = "machine.svg", "question"
_DRAWING_CAPTION = (
    "Pins and links, and dimensions by their names in a study file. φ is the {driver} angle, {}."
)
_VERSIONS = ("numpy", "casadi", "fmpy", "plotly")


def report(study: StudyRecord, result: Mapping[str, Any]) -> b.Report:
    """The report on a study; `result` has its numbers, as `chainunit.study.result.as_dict` gives them."""
    with shown_in(study.setup.config.units):
        sections = [
            b.Section(name, contents.heading, tuple(contents.blocks(study)), beside=name == QUESTION)
            for name, contents in _sections().items()
            if name not in analysis_sections() or (contents.analysis or name) in study.findings.by_analysis
        ]
        # an analysis may have nothing to show
        sections = [
            section for section in sections if section.blocks or section.name not in analysis_sections()
        ]
        given = b.Section("given", "Given values", tuple(_given(b.Source(result), study)))
        source = source_line(cited(Heading.of(study.setup.config.title, study.setup.config.file)))
        return _report(study, result, [*sections, given], source)


def summary(study: StudyRecord, result: Mapping[str, Any]) -> b.Report:
    """A short report: the verdicts and the main answers of every run. Arguments as of `report`."""
    blocks: list[b.Block] = []
    with shown_in(study.setup.config.units):
        for block in answer.blocks(study):
            if isinstance(block, b.Text) and block.central:
                blocks.append(block)
            elif isinstance(block, b.Judgement) and block.severity in b.VERDICTS:
                blocks.append(replace(block, form="both"))
        if study.runs.answers:
            blocks.append(runs.table_of_runs(study).of_form("short"))
        return _report(study, result, [b.Section("summary", "Summary", tuple(blocks))])


def _report(
    study: StudyRecord, result: Mapping[str, Any], sections: Iterable[b.Section], source: Line = ()
) -> b.Report:
    """The report of a study with these sections."""
    config, error = study.setup.config, study.findings.failure
    failure = () if error is None else cited(str(error), "failure")
    kind = f"{capital(study.setup.noun)}: forces, torque and overload"
    return b.Report(config.title, kind, result, (), tuple(sections), source, failure, units=config.units)


def _motion(study: StudyRecord) -> list[b.Block]:
    # the links of a foreign FMU are unknown
    return [motion(study)] if study.runs.series and not study.setup.drive.foreign_machine else []


# -- the question


_GIVEN_DRIVE = (
    "What does the motor of {} have to give? It turns the {driver} through a {} of ratio {}, in normal running "
    "at {}."
)


def _question(study: StudyRecord) -> Iterator[b.Block]:
    """What the study is about: the question in words, the given values in short, and the drawing of the machine."""
    # a linkage has its title in place of a noun
    setup = study.setup
    noun = f"this {setup.noun}" if setup.noun[:1].islower() else f'the machine "{setup.noun}"'
    yield b.Text(_question_text(study, noun), form="long")
    is_chosen, driver = setup.proposal is not None, setup.driver_noun
    rows: list[b.TableRow] = [] if is_chosen else [b.TableRow(("motor", motor_title(setup)))]
    rows += quantity_rows(run_settings(setup), driver, only="crank_speed", as_given=True)
    machine = cited(setup.drive.machine.p, "given.machine")
    rows += () if is_chosen else quantity_rows(machine, driver, only="ratio", as_given=True)
    rows += quantity_rows(cited(setup.config.feed, "given.feed"), driver, as_given=True)
    yield b.Table(tuple(rows), title="In short", form="long")
    if not setup.drive.foreign_machine:
        alt, model = f"{capital(noun)}: its pins, links and dimensions", setup.drive.machine.model
        caption = filled(of_driver(_DRAWING_CAPTION, driver), model.angle_counts)
        yield b.Drawing(drawing(setup.drive.machine), alt, DRAWING, caption)


def _question_text(study: StudyRecord, noun: str) -> Line:
    """The question in words, with the runs by which it is answered; `noun` stands for the machine."""
    setup, runs = study.setup, study.runs
    if setup.proposal is None:
        question = filled(
            of_driver(_GIVEN_DRIVE, setup.driver_noun),
            noun,
            setup.drive.ratio_noun,
            exact(ratio(setup)),
            asked_speed(setup),
        )
    else:
        question = filled(of_driver(setup.proposal.question, setup.driver_noun), noun, asked_speed(setup))
    run = run_settings(setup)
    if runs.answers:
        question += filled(
            " The machine starts from rest{} and is evaluated over {} {} when steady.",
            line(" in ", exact(run.ramp)) if setup.drive.follows else "",
            exact(run.turns),
            "turn" if setup.config.run.turns == 1.0 else "turns",
        )
    if names := runs.overloads:
        titles = "; ".join(run_names.title(runs, name) for name in names)
        question += line(f" Then come overloads, each by itself: {titles}.")
    for plan in random_runs(setup.config.plans):
        if plan.table in study.findings.by_analysis:
            sentence = " Then come {} overloads at random, each by itself: {}."
            counted = exact(cited(InUnit(plan.runs, "1"), f"findings.{plan.table}.runs"))
            question += filled(sentence, counted, plan.event.title)
    return question


def _given(s: b.Source, study: StudyRecord) -> Iterator[b.Block]:
    """All given values of the study, by section."""
    # a motor on the line follows no reference
    unused_names = [] if study.setup.drive.follows else ["run.ramp"]
    unused_names += [
        name
        for part in capabilities()
        for name in part.unused_values(study.setup.config.machine, study.setup.config.plans[part.name])
    ]
    sections = given_sections(study)
    yield b.Given(tuple((x.title, tuple(_values(s, study.setup, x, unused_names))) for x in sections))


def _values(
    s: b.Source, setup: StudySetup, section: GivenSection, unused_names: Iterable[str]
) -> Iterator[b.GivenValue]:
    """The quantities and choices of a section as given values, except those with a name in `unused_names`. A range
    gives two values, its ends."""
    for name, text, content in _contents(s, setup, section):
        full = f"{section.name}.{name}".removeprefix(".")
        if full not in unused_names:
            yield b.GivenValue(full, text, content, origin_of(setup, full), place_of(setup, full))


def _contents(s: b.Source, setup: StudySetup, section: GivenSection) -> Iterator[tuple[str, str, b.Content]]:
    """Name, description and content of each value of a section. A finding of the same place is what the study uses
    in place of the value."""
    for v in () if section.values is None else variables(type(section.values)):
        place, text = f"{section.place}.{v.name}", v.described(setup.driver_noun)
        if v.name in section.ranges:
            for k, end in enumerate(("least", "most")):
                yield v.name, f"{text}, {end}", s.number(place, k, as_given=True)
        elif v.name not in section.unused_names:
            yield v.name, text, s.number(place, as_given=True, none="none")
    for key, choice in section.choices.items():
        place = f"{section.place}.{key}".removeprefix(".")
        if isinstance(choice, str):
            content: b.Content = s.words(place)
        elif isinstance(choice, bool):
            content = "yes" if choice else "no"
        elif isinstance(choice, float):
            content = s.number(place, as_given=True)
        else:
            content = ", ".join(x if isinstance(x, str) else f"{x:g}" for x in choice)
        yield key, description(f"{section.name}.{key}".removeprefix(".")), content


def _live(study: StudyRecord) -> Iterator[b.Block]:
    """The live machine of the study; none of a machine whose equations are not known."""
    setup, config = study.setup, study.setup.config
    if setup.drive.foreign_machine:
        return
    yield b.Live(
        lambda: of_study(config, setup.drive, config.drive, setup.proposal, study.findings.verdict),
        whole_of(stand_in(setup.drive)),
    )


# -- the basis of the results


def _basis(study: StudyRecord) -> Iterator[b.Block]:
    """The basis of the numbers: models, software, and how to read the page."""
    yield from basis(study)
    yield software(study.runs)
    hint = (
        "Every number in the text of this page comes from result.json, which the page contains whole. Point at a "
        "number to see its place in result.json and more digits."
    )
    yield b.Text(hint, "hint", "long")


def basis(study: StudyRecord) -> Iterator[b.Block]:
    """The notes on a study, and its energy certificate."""
    yield from (b.Text(note.text, "note") for note in cited(study.findings.notes, "notes"))
    yield from answer.remark_tables(study.findings.notes, "notes")
    if study.runs.certificate:
        yield from _certificate(study.runs)


def software(runs: StudyRuns) -> b.Table:
    """The FMUs, the control of the speed, and the versions of a study."""
    gains = cited(speed_control(runs.drive), "findings.control")
    control: Line = (
        gains
        if isinstance(gains, str)
        else join(filled("{} {}", spoken(name), gain) for name, gain in numbers(gains).items())
    )
    versions = {"Python": platform.python_version()} | {name: _version(name) for name in _VERSIONS}
    libraries = (f", {name} {version}" for name, version in versions.items())
    rows = (
        *(
            b.TableRow((f"{name} FMU", origin))
            for name, origin in cited({name: str(x) for name, x in runs.fmus.items()}, "runs.fmus").items()
        ),
        b.TableRow(("speed control", control)),
        b.TableRow(("versions", line("chainunit ", cited(__version__, "chainunit"), *libraries))),
    )
    return b.Table(rows, title="Models and software", numeric=False, form="long")


def _certificate(runs: StudyRuns) -> Iterator[b.Block]:
    """The energy certificate: a table by run, and for each of its shares the largest one."""
    shares = {
        run: {
            name: Number(finite(share), "1", path=f"runs.certificate.{run}.{name}")
            for name, share in entries.items()
        }
        for run, entries in runs.certificate.items()
    }
    method = (
        "The energy that the motor gave to the shaft, computed in the motor, is compared with the energy that the "
        "machine stored and dissipated, computed in the machine. The table shows the missing share of the energy "
        "moved."
    )
    yield b.Text(method, "note", "long")
    rows = {runs.title_of(run): sizes for run, sizes in shares.items()}
    yield matrix(rows, "Energy certificate", "run", form="long")
    for name in dict.fromkeys(name for sizes in shares.values() for name in sizes):
        compared_runs = [run for run, sizes in shares.items() if name in sizes]
        run = max(compared_runs, key=lambda run: runs.certificate[run][name])
        text = f"{spoken(name.removesuffix('_share')).capitalize()}: at most {{}} of the energy moved."
        parts: tuple[Line, ...] = (shares[run][name],)
        if name.endswith(DIFFERENCE):
            text = (
                f"Difference of {name.removesuffix(DIFFERENCE)} to the monolithic solution, in parts of its "
                f"peak: at most {{}} ({{}}); runs compared: {len(compared_runs)}."
            )
            parts += (runs.title_of(run),)
        yield b.Text(filled(text, *parts), form="short")


@cache
def _version(name: str) -> str:
    """The version of an installed package."""
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
        "slip": Contents("The parts of the line that slip", slip.blocks, slip.PICTURES.files),
        **analysis_sections(),
        "plots": Contents("Plots", lambda study: figures.PICTURES.figures(study), figures.PICTURES.files),
        "motion": Contents("The machine in motion", lambda study: iter(_motion(study))),
        "basis": Contents("Basis of the results", _basis),
    }


def pictures() -> tuple[str, ...]:
    """The files of all figures that a report may have."""
    return (DRAWING, *(picture for contents in _sections().values() for picture in contents.pictures))
