"""The report on a linear model: its poles, its point, Bode plots of the chosen pairs."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ...report import blocks as b
from ...report import figure as fig
from ...report.lines import Name, join, line
from ...report.task import Task, Writer
from .result import NPZ, FrequencyResponse, LinearQuestion, LinearResult, data, find, write_npz

PICTURES = "bode_*.png"
_MOST_ROWS = 6


def linear_report(found: LinearResult) -> b.Report:
    """The report on a linear model."""
    result = data(found)
    s = b.Source(result)
    sections = [b.Section("point", "The point", tuple(_point(s)))]
    if found.responses:
        sections.insert(0, b.Section("bode", "Frequency responses", tuple(_responses(found))))
    return b.Report(
        f"Linear model: {result['title']}",
        "Linear model",
        result,
        tuple(_opening(s, found)),
        tuple(sections),
        source=s.line("{source} · chainunit {chainunit}"),
        opening_title="Poles",
    )


def _opening(s: b.Source, found: LinearResult) -> Iterator[b.Block]:
    linear = found.linear
    sizes = ((linear.states, "state"), (linear.inputs, "input"), (linear.outputs, "output"))
    counts = join([f"{len(of)} {name}{'' if len(of) == 1 else 's'}" for of, name in sizes])
    yield b.Text(line(s.words("description"), "."), form="long")
    yield b.Text(line("At ", s.words("at"), ": ", counts, "."))
    if not linear.states:
        yield b.Text("The model has no states: its outputs follow the inputs at once, by D alone.")
    elif not linear.poles:
        yield b.Judgement(
            "warning", "A slope of the states is not defined at this point: there are no poles."
        )
    else:
        yield _poles(s)
    yield from _bends(s, found)


def _poles(s: b.Source) -> b.Table:
    columns = {
        "real": b.Column("real part"),
        "imaginary": b.Column("imaginary part, +-", form="long"),
        "natural_frequency": b.Column("natural frequency", "frequency"),
        "damping_ratio": b.Column("damping ratio", "damping"),
        "time_constant": b.Column("time constant"),
    }
    rows = (
        b.TableRow((Name(pole["state"]), *(s.number(f"poles.{k}.{key}", digits=4) for key in columns)))
        for k, pole in enumerate(s.result["poles"])
    )
    heads = (b.Column("largest part in it"), *columns.values())
    return b.Table(tuple(rows), heads, title="Poles, the slowest first")


def _bends(s: b.Source, found: LinearResult) -> Iterator[b.Block]:
    for k, bend in enumerate(found.linear.bends):
        names, more = bend.rows[:_MOST_ROWS], len(bend.rows) - _MOST_ROWS
        rows = line(join(map(Name, names)), f" and {more} more" if more > 0 else "")
        said = (
            line("the slopes by it jump at this point; the matrices have those of one side: ")
            if bend.kink
            else line("the slopes by it bend within ", s.number(f"bends.{k}.within"), " of this point: ")
        )
        yield b.Judgement("warning", line(Name(bend.by), ": ", said, rows, "."))


def _point(s: b.Source) -> Iterator[b.Block]:
    count = len(s.result["states"])
    for kind, title in (("states", "States"), ("inputs", "Inputs"), ("outputs", "Outputs beside the states")):
        # the states are the first outputs
        own = list(enumerate(s.result[kind]))[count if kind == "outputs" else 0 :]
        columns = ("value", "rate") if kind == "states" else ("value",)
        rows = (
            b.TableRow(
                (
                    Name(each["name"]),
                    s.words(f"{kind}.{k}.description"),
                    *(s.number(f"{kind}.{k}.{column}", digits=6) for column in columns),
                )
            )
            for k, each in own
        )
        description = b.Column("description", of_text=True)
        rate = b.heads("time derivative") if kind == "states" else ()
        heads = (*b.heads("name"), description, *b.heads("value"), *rate)
        if own:
            yield b.Table(tuple(rows), heads, title=f"{title}, at the point", form="long")


def _responses(found: LinearResult) -> Iterator[b.Block]:
    for k, response in enumerate(found.responses):
        if np.any(response.gain > 0.0):
            yield _bode(k, response)
        else:
            yield b.Text(
                line(Name(response.of), " does not depend on ", Name(response.to), " at this point.")
            )


def _bode(k: int, response: FrequencyResponse) -> fig.Figure:
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


def _writers(found: LinearResult, report: b.Report, folder: Path, of_report: list[Writer]) -> list[Writer]:
    return [lambda: write_npz(found, folder), *of_report]


TASK: Task[LinearQuestion, LinearResult] = Task(
    "linearize",
    lambda question, folder, progress: find(question, progress),
    linear_report,
    files=(NPZ, PICTURES),
    writers=_writers,
)
