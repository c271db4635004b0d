"""The answer: the verdicts, the largest numbers of the drive, the warnings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain

from ..core.descriptions import of_driver
from ..core.quantities import finite
from ..study.measures import MEASURES
from ..study.record import StudyRecord
from ..study.remark import Remark
from . import blocks as b
from . import run_names
from .capability import capabilities
from .lines import Line, Number, Strong, capital, join, line
from .runs import number

_HOLDS: dict[str, b.Severity] = {"true": "good", "in part": "partly", "false": "bad"}


def blocks(s: b.Source, study: StudyRecord) -> Iterator[b.Block]:
    """The drive where it was chosen, first in a sentence; the verdicts, the cards and the warnings."""
    yield from sentence(s)
    parts = [part.answer(s, study) for part in capabilities()]
    yield from chain.from_iterable(part.head for part in parts)
    for subject in ("model", "motor"):
        verdict = s.result["verdict"][subject]
        if verdict is not None:
            yield b.Judgement(_HOLDS[verdict["holds"]], s.words(f"verdict.{subject}.text"))
    if slips := s.result["slips"]:
        items = tuple(s.words(f"slips.{i}.said") for i in range(len(slips)))
        yield b.Judgement("remark", Strong("Is this what was meant?"), items=items)
    yield from chain.from_iterable(part.judgements for part in parts)
    answers = s.result["answers"]
    if answers:
        reference = "steady" if "steady" in answers else next(iter(answers))
        worst = " Then the overload with the largest value." if study.overloads else ""
        speed = _speed(s, study, reference)
        lead = line(
            f"First the values of {run_names.title(study, reference)}, the {study.driver_noun} at ",
            speed,
            f".{worst}",
        )
        yield b.Text(lead, "lead", "long")
        yield b.Cards(tuple(_cards(s, study, reference)))
    else:
        yield b.Text("The study ended before any run could be evaluated.", "lead", "long")
    yield from chain.from_iterable(part.end for part in parts)
    warnings: list[b.Block] = [b.Judgement("warning", warning) for warning in s.lines("warnings")]
    warnings += chain.from_iterable(part.warnings for part in parts)
    yield from warnings
    yield from remark_tables(study.warnings, "warnings")
    if answers and not warnings:
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


def sentence(s: b.Source) -> Iterator[b.Block]:
    """The sentence on the drive where it was chosen."""
    if "sentence" in s.result:
        yield b.Text(s.words("sentence"), central=True)


def _speed(s: b.Source, study: StudyRecord, run: str) -> Line:
    """The mean speed of the crank in a run, marked where the motor misses the speed asked for."""
    mean_speed = s.line(f"{{answers.{run}.speed_mean}}")
    if run != "steady" or study.reaches:
        return mean_speed
    return line(Strong(line("▲ ", mean_speed)), s.line(", not the {=run.crank_speed:4} asked for"))


def _cards(s: b.Source, study: StudyRecord, run: str) -> Iterator[b.Card]:
    """A card for each family of answers: its first two numbers in the run `run`, and the worst overload."""
    families: dict[str, list[str]] = {}
    for name in s.result["answers"][run]:
        families.setdefault(MEASURES[name].of, []).append(name)
    for family, names in families.items():
        if MEASURES[names[0]].card:
            numbers = [(MEASURES[name].words, number(s, study, run, name)) for name in names]
            lines = [join(line(f"{title} ", size) for title, size in numbers[2:])] if numbers[2:] else []
            cards = tuple((size, title) for title, size in numbers[:2])
            yield b.Card(of_driver(family, study.driver_noun), cards, (*lines, *_worst(s, study, names[0])))


def _worst(s: b.Source, study: StudyRecord, name: str) -> Iterator[Line]:
    """The answer `name` in the overload in which it is largest; nothing where there is no overload."""
    sizes = {run: finite(getattr(study.answers[run], name)) for run in study.overloads}
    magnitudes = {run: abs(size) for run, size in sizes.items() if size is not None}
    if magnitudes:
        run = max(magnitudes, key=lambda run: magnitudes[run])
        peak = Strong(number(s, study, run, name))
        yield line(f"overload: {MEASURES[name].words} ", peak, f", {run_names.title(study, run)}")
