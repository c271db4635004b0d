"""The report on a linear model: its poles, its point, Bode plots of the chosen pairs."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ... import __version__
from ...report import blocks as b
from ...report import figure as fig
from ...report.cited import as_name, cited, number, table
from ...report.lines import Name, filled, join, line
from ...report.task import Task, Writer
from ...system.linear import LinearModel
from .result import NPZ, FrequencyResponse, LinearQuestion, LinearResult, data, find, write_npz

PICTURES = "bode_*.png"
_MOST_ROWS = 6


def linear_report(findings: LinearResult) -> b.Report:
    """The report on a linear model."""
    result = data(findings)
    x = cited(findings)
    sections = [b.Section("point", "The point", tuple(_point(x.linear)))]
    if findings.responses:
        sections.insert(0, b.Section("bode", "Frequency responses", tuple(_responses(findings))))
    return b.Report(
        f"Linear model: {result['title']}",
        "Linear model",
        result,
        tuple(_opening(findings, x.linear)),
        tuple(sections),
        source=filled("{} · chainunit {}", x.source, cited(__version__, "chainunit")),
        opening_title="Poles",
    )


def _opening(findings: LinearResult, x: LinearModel) -> Iterator[b.Block]:
    """The model, the point, the numbers of states, inputs and outputs, and whether the point is stable."""
    linear = findings.linear
    sizes = ((linear.states, "state"), (linear.inputs, "input"), (linear.outputs, "output"))
    counts = join([f"{len(signals)} {name}{'' if len(signals) == 1 else 's'}" for signals, name in sizes])
    yield b.Text(line(x.description, "."), form="long")
    yield b.Text(filled("At {}: {}.", x.at, counts))
    if not linear.states:
        yield b.Text("The model has no states: its outputs follow the inputs at once, by D alone.")
    elif not linear.poles:
        yield b.Judgement(
            "warning", "A slope of the states is not defined at this point: there are no poles."
        )
    else:
        yield from _poles(x)
    yield from _bends(linear, x)


def _poles(x: LinearModel) -> Iterator[b.Table]:
    """A row for each pole."""
    return table(
        x.poles,
        ("largest part in it", lambda pole: as_name(pole.state)),
        ("real part", lambda pole: number(pole.real, 4)),
        (b.Column("imaginary part, +-", form="long"), lambda pole: number(pole.imaginary, 4)),
        (b.Column("natural frequency", "frequency"), lambda pole: number(pole.natural_frequency, 4)),
        (b.Column("damping ratio", "damping"), lambda pole: number(pole.damping_ratio, 4)),
        ("time constant", lambda pole: number(pole.time_constant, 4)),
        title="Poles, the slowest first",
    )


def _bends(linear: LinearModel, x: LinearModel) -> Iterator[b.Block]:
    """A warning of each input or state by which the slopes change near the point."""
    for bend, shown in zip(linear.bends, x.bends, strict=True):
        names, more = bend.rows[:_MOST_ROWS], len(bend.rows) - _MOST_ROWS
        rows = line(join(map(Name, names)), f" and {more} more" if more > 0 else "")
        slopes = line("the slopes by it bend within ", number(shown.within), " of this point: ")
        if bend.kink:
            slopes = line("the slopes by it jump at this point; the matrices have those of one side: ")
        yield b.Judgement("warning", line(Name(bend.by), ": ", slopes, rows, "."))


def _point(x: LinearModel) -> Iterator[b.Block]:
    """The values of states, inputs and outputs at the point."""
    value = ("value", lambda signal: number(signal.value, 6))
    head: tuple[Any, ...] = (
        ("name", lambda signal: as_name(signal.name)),
        (b.Column("description", of_text=True), lambda signal: signal.description),
        value,
    )
    rate = ("time derivative", lambda state: number(state.rate, 6))
    yield from table(x.states, *head, rate, title="States, at the point", form="long")
    yield from table(x.inputs, *head, title="Inputs, at the point", form="long")
    # the states are the first outputs
    outputs = x.outputs[len(x.states) :]
    yield from table(outputs, *head, title="Outputs beside the states, at the point", form="long")


def _responses(findings: LinearResult) -> Iterator[b.Block]:
    """A Bode plot for each pair, or a sentence where nothing passes."""
    for k, response in enumerate(findings.responses):
        if np.any(response.gain > 0.0):
            yield _bode(k, response)
        else:
            yield b.Text(
                line(Name(response.of), " does not depend on ", Name(response.to), " at this point.")
            )


def _bode(k: int, response: FrequencyResponse) -> fig.Figure:
    """Gain and phase of a frequency response; `k` is its number."""
    low, high = float(response.frequency[0]), float(response.frequency[-1])
    frequency = fig.Axis("frequency", "rad/s", low=low, high=high, log=True)
    pair = f"{response.of} by {response.to}"
    positive = np.where(response.gain > 0.0, response.gain, np.nan)
    panels = (
        (fig.Axis("gain", response.unit, log=True), positive),
        (fig.Axis("phase", "deg"), np.degrees(response.phase)),
    )
    return fig.Figure(
        f"bode-{k + 1}",
        f"Frequency response of {pair}",
        f"Gain and phase of {pair} over the frequency.",
        fig.stacked(
            frequency,
            ((axis, (fig.Curve(pair, response.frequency, y, in_legend=False),)) for axis, y in panels),
        ),
        file=f"bode_{k + 1}.png",
    )


def _writers(findings: LinearResult, report: b.Report, folder: Path, of_report: list[Writer]) -> list[Writer]:
    return [lambda: write_npz(findings, folder), *of_report]


TASK: Task[LinearQuestion, LinearResult] = Task(
    "linearize",
    lambda question, folder, progress: find(question, progress),
    linear_report,
    files=(NPZ, PICTURES),
    writers=_writers,
    sources=lambda question: [Path(question.name), *filter(None, [question.config])],
)
