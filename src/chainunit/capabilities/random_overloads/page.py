"""The section on random overloads: quantiles, and how the runs were made."""

from __future__ import annotations

from collections.abc import Iterator

from ...core.descriptions import of_driver
from ...core.quantities import Layout
from ...report import blocks as b
from ...report.lines import Line, join, line
from ...study.record import StudyRecord
from .runs import ENDS, OUTCOMES, Sample

_LARGEST = "crank_torque_peak"
"""The quantity of random overloads that the answer states."""


def summary(s: b.Source, study: StudyRecord) -> Line:
    """The sentence on random overloads: the largest quantile of the crank torque, and how often a run ends badly."""
    quantiles = s.result["monte_carlo"]["quantiles"]
    ends = OUTCOMES if study.config.coupling else {"stalls": OUTCOMES["stalls"]}
    parts: list[Line] = [
        line(
            f"{of_driver(outcome, s.driver)} in ",
            s.estimate(f"monte_carlo.quantiles.{name}.share", ".low", ".high"),
        )
        for name, outcome in ends.items()
        if name in quantiles
    ]
    if quantile_names := list(quantiles.get(_LARGEST, ())):
        peak = s.estimate(f"monte_carlo.quantiles.{_LARGEST}.{quantile_names[-1]}", ".low", ".high")
        parts.insert(0, line(f"{quantile_names[-1][1:]} % stay below a {s.driver} torque of ", peak))
    return s.line("Of {=monte_carlo.runs} overloads at random: {parts}.", parts=join(parts, "; "))


_METHODS: dict[str, str] = {
    "compiled": "on the compiled system",
    "cs": "by co-simulation of the FMUs",
    "me": "by Model Exchange of the FMUs",
}
"""The ways in which random overloads are run, see `.runs.RandomTask.method`."""


def blocks(s: b.Source, study: StudyRecord) -> Iterator[b.Block]:
    """The table of the quantiles of random overloads, and how they were run."""
    quantiles = {name: sizes for name, sizes in s.result["monte_carlo"]["quantiles"].items() if sizes}
    descriptions = {v.name: v.template for v in Layout(Sample).variables} | ENDS
    columns = list(dict.fromkeys(k for sizes in quantiles.values() for k in sizes))

    def cell(name: str, k: str) -> Line:
        return (
            s.estimate(f"monte_carlo.quantiles.{name}.{k}", ".low", ".high") if k in quantiles[name] else ""
        )

    rows = tuple(
        b.TableRow((of_driver(descriptions[name], s.driver), *(cell(name, k) for k in columns)))
        for name in quantiles
    )
    heads = (f"{k[1:]} % of runs below" if k.startswith("q") else "share of runs" for k in columns)
    sides = join(s.line(f"{{=monte_carlo.sides.{side}}} {side}") for side in s.result["monte_carlo"]["sides"])
    of_sides = line(" (", sides, ")") if sides else ()
    title = s.line(
        "Random overloads, {=monte_carlo.runs} runs{sides}; in brackets: the interval of {=monte_carlo.confidence} "
        "confidence",
        sides=of_sides,
    )
    if rows:
        yield b.Table(rows, b.heads("", *heads), title=title)
    yield b.Text(
        line(f"The random overloads were run {_METHODS[s.result['monte_carlo']['method']]}."), "fine"
    )
