"""The answer: the verdicts, the largest numbers of the drive, the warnings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain

from ..core.descriptions import of_driver
from ..core.quantities import Layout, finite
from ..study.judgement import motor_verdict
from ..study.measures import MEASURES, Answers
from ..study.record import StudyRecord, StudyRuns
from ..study.remark import Remark
from ..study.result import Verdicts
from . import blocks as b
from . import run_names
from .capability import capabilities
from .cited import cited
from .given_numbers import asked_speed
from .lines import Line, Number, Strong, capital, filled, join, line
from .runs import number

_HOLDS: dict[str, b.Severity] = {"true": "good", "in part": "partly", "false": "bad"}


def blocks(study: StudyRecord) -> Iterator[b.Block]:
    """The drive where it was chosen, first in a sentence; the verdicts, the cards and the warnings."""
    if study.setup.proposal is not None:
        yield b.Text(cited(study.setup.proposal.sentence(study), "sentence"), central=True)
    parts = [part.answer(study) for part in capabilities()]
    yield from chain.from_iterable(part.head for part in parts)
    verdicts = cited(Verdicts(study.findings.verdict, motor_verdict(study)), "verdict")
    for verdict in (verdicts.model, verdicts.motor):
        if verdict is not None:
            yield b.Judgement(_HOLDS[verdict.holds], verdict.text)
    if slips := cited(study.setup.config.file.slips, "slips"):
        items = tuple(slip.said for slip in slips)
        yield b.Judgement("remark", Strong("Is this what was meant?"), items=items)
    yield from chain.from_iterable(part.judgements for part in parts)
    if study.runs.answers:
        reference = "steady" if "steady" in study.runs.answers else next(iter(study.runs.answers))
        worst = " Then the overload with the largest value." if study.runs.overloads else ""
        speed = _speed(study, reference)
        lead = line(
            f"First the values of {run_names.title(study.runs, reference)}, the {study.setup.driver_noun} at ",
            speed,
            f".{worst}",
        )
        yield b.Text(lead, "lead", "long")
        yield b.Cards(tuple(_cards(study.runs, reference)))
    else:
        yield b.Text("The study ended before any run could be evaluated.", "lead", "long")
    yield from chain.from_iterable(part.end for part in parts)
    warnings: list[b.Block] = [
        b.Judgement("warning", warning.text) for warning in cited(study.findings.warnings, "warnings")
    ]
    warnings += chain.from_iterable(part.warnings for part in parts)
    yield from warnings
    yield from remark_tables(study.findings.warnings, "warnings")
    if study.runs.answers and not warnings:
        yield b.Text("No run gives cause for a warning.", "fine", "long")


def remark_tables(remarks: Sequence[Remark], path: str) -> Iterator[b.Table]:
    """A table for each remark with more numbers than its sentences have."""
    for k, remark in enumerate(remarks):
        rows = tuple(
            b.TableRow(
                (size.title, Number(size.value, size.unit, size.kind, f"{path}.{k}.quantities.{name}"))
            )
            for name, size in remark.quantities.items()
            if size.title
        )
        if rows:
            yield b.Table(rows, title=capital(remark.code.replace("-", " ")))


def _speed(study: StudyRecord, run: str) -> Line:
    """The mean speed of the crank in a run, marked where the motor misses the speed asked for."""
    mean_speed = number(study.runs, run, "speed_mean")
    if run != "steady" or study.runs.reaches:
        return mean_speed
    return filled("{}, not the {} asked for", Strong(line("▲ ", mean_speed)), asked_speed(study.setup))


def _cards(runs: StudyRuns, run: str) -> Iterator[b.Card]:
    """A card for each family of answers: its first two numbers in the run `run`, and the worst overload."""
    families: dict[str, list[str]] = {}
    for name in Layout(Answers).names:
        families.setdefault(MEASURES[name].of, []).append(name)
    for family, names in families.items():
        if MEASURES[names[0]].card:
            numbers = [(MEASURES[name].words, number(runs, run, name)) for name in names]
            lines = [join(line(f"{title} ", size) for title, size in numbers[2:])] if numbers[2:] else []
            cards = tuple((size, title) for title, size in numbers[:2])
            yield b.Card(of_driver(family, runs.drive.driver_noun), cards, (*lines, *_worst(runs, names[0])))


def _worst(runs: StudyRuns, name: str) -> Iterator[Line]:
    """The answer `name` in the overload in which it is largest; nothing where there is no overload."""
    sizes = {run: finite(getattr(runs.answers[run], name)) for run in runs.overloads}
    magnitudes = {run: abs(size) for run, size in sizes.items() if size is not None}
    if magnitudes:
        run = max(magnitudes, key=lambda run: magnitudes[run])
        peak = Strong(number(runs, run, name))
        yield line(f"overload: {MEASURES[name].words} ", peak, f", {run_names.title(runs, run)}")
