"""The answer: the verdicts, the largest numbers of the drive, the warnings."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from ..quantities import Layout, Variable
from ..study.measures import Answers
from ..study.study import Study
from . import blocks as b
from . import run_names as read
from .lines import Line, Strong, joined, line
from .runs import number

_KEY = ("crank_torque_peak", "motor_torque_peak", "power_peak", "current_peak", "winding_temperature")
"""The families of answers that are shown large, each by its first field."""
_HOLDS: dict[str, b.Severity] = {"true": "good", "in part": "partly", "false": "bad"}


def blocks(s: b.Source, study: Study) -> Iterator[b.Block]:
    """Verdicts, cards and warnings."""
    for of in ("model", "motor"):
        verdict = s.result["verdict"][of]
        if verdict is not None:
            yield b.Judgement(_HOLDS[verdict["holds"]], s.words(f"verdict.{of}.text"))
    if slips := s.result["slips"]:
        items = tuple(s.words(f"slips.{i}.said") for i in range(len(slips)))
        yield b.Judgement("remark", Strong("Is this what was meant?"), items=items)
    nearest = s.result["sizing"].get("nearest") if "sizing" in s.result else None
    if nearest is not None:
        best = f"sizing.candidates.{nearest}"
        rest = f" All runs are with {{{best}.motor}}, which is insufficient: {{{best}.reason}}."
        yield b.Judgement("alarm", line(Strong("No motor of the catalogue fits."), s.line(rest)), form="long")
    answers = s.result["answers"]
    if answers:
        reference = "steady" if "steady" in answers else next(iter(answers))
        worst = " Below: the overload that asks most." if study.overloads else ""
        speed = _speed(s, study, reference)
        lead = line(f"Large: {read.title(study, reference)}, the crank at ", speed, f".{worst}")
        yield b.Text(lead, "lead", "long")
        families = _families(answers[reference]).items()
        yield b.Cards(
            tuple(
                _card(s, study, family, members, reference)
                for family, members in families
                if members[0][1].name in _KEY
            )
        )
    else:
        yield b.Text("The study ended before any run could be evaluated.", "lead", "long")
    yield from (b.Judgement("warning", each) for each in s.lines("warnings"))
    if answers and not s.result["warnings"]:
        yield b.Text("No run gives cause for a warning.", "fine", "long")


def _speed(s: b.Source, study: Study, run: str) -> Line:
    """The crank speed that a run has: the one asked for, or the one reached and marked where it is another."""
    if run != "steady" or study.reaches:
        return s.line("{=run.crank_speed}")
    reached = Strong(s.line(f"▲ {{answers.{run}.speed_mean}}"))
    return line(reached, s.line(", not the {=run.crank_speed} asked for"))


def _families(names: Iterable[str]) -> dict[str, list[tuple[str, Variable]]]:
    """Answers by what they are of: {"crank torque": [("peak", ..), ("RMS", ..)]}, as their descriptions say."""
    families: dict[str, list[tuple[str, Variable]]] = {}
    have = set(names)
    for v in Layout(Answers).variables:
        if v.name in have:
            family, _, kind = v.description.partition(", ")
            families.setdefault(family, []).append((kind, v))
    return families


def _card(s: b.Source, study: Study, family: str, members: list[tuple[str, Variable]], run: str) -> b.Card:
    """An answer, large: its first two numbers in the run `run`, and the worst overload."""
    large, small = members[:2], members[2:]
    lines = [joined(line(f"{kind} ", number(s, study, run, v)) for kind, v in small)] if small else []
    kind, v = large[0]
    sizes = {name: s.value(f"answers.{name}.{v.name}") for name in study.overloads}
    magnitudes = {name: abs(size) for name, size in sizes.items() if size is not None}
    if magnitudes:
        worst = max(magnitudes, key=lambda name: magnitudes[name])
        peak = Strong(number(s, study, worst, v))
        lines.append(line(f"overload: {kind} ", peak, f", {read.title(study, worst)}"))
    numbers = ((number(s, study, run, v), kind or read.title(study, run)) for kind, v in large)
    return b.Card(family, tuple(numbers), tuple(lines))
