"""The section on random overloads: quantiles, and how the runs were made."""

from __future__ import annotations

from collections.abc import Iterator

from ...core.descriptions import of_driver
from ...core.quantities import Layout
from ...report import blocks as b
from ...report.cited import cited, estimate, exact
from ...report.lines import Line, filled, join, line
from ...study.record import StudyRecord
from .runs import ENDS, OUTCOMES, MonteCarloResult, Sample

PATH = "findings.monte_carlo"
"""Place of the runs in the result of a study."""
_LARGEST = "crank_torque_peak"
"""The quantity of random overloads that the answer states."""


def summary(study: StudyRecord) -> Line:
    """The sentence on random overloads: the largest quantile of the crank torque, and how often a run ends badly."""
    x = cited(MonteCarloResult.of_study(study.findings), PATH)
    quantiles = x.quantiles
    ends = OUTCOMES if study.setup.config.coupling else {"stalls": OUTCOMES["stalls"]}
    parts = [
        filled("{} in {}", of_driver(outcome, study.setup.driver_noun), estimate(quantiles[name]["share"]))
        for name, outcome in ends.items()
        if name in quantiles
    ]
    if sizes := list(quantiles.get(_LARGEST, {}).items()):
        name, largest = sizes[-1]
        stay = f"{name[1:]} % stay below a {study.setup.driver_noun} torque of {{}}"
        parts.insert(0, filled(stay, estimate(largest)))
    return filled("Of {} overloads at random: {}.", exact(x.runs), join(parts, "; "))


_METHODS: dict[str, str] = {
    "compiled": "on the compiled system",
    "cs": "by co-simulation of the FMUs",
    "me": "by Model Exchange of the FMUs",
}
"""The ways in which random overloads are run, see `.runs.RandomTask.method`."""


def blocks(study: StudyRecord) -> Iterator[b.Block]:
    """The table of the quantiles of random overloads, and how they were run."""
    findings = MonteCarloResult.of_study(study.findings)
    x = cited(findings, PATH)
    quantiles = {name: sizes for name, sizes in x.quantiles.items() if sizes}
    descriptions = {v.name: v.template for v in Layout(Sample).variables} | ENDS
    columns = list(dict.fromkeys(name for sizes in quantiles.values() for name in sizes))
    rows = []
    for name, sizes in quantiles.items():
        cells = (estimate(sizes[column]) if column in sizes else "" for column in columns)
        rows.append(b.TableRow((of_driver(descriptions[name], study.setup.driver_noun), *cells)))
    heads = (
        f"{column[1:]} % of runs below" if column.startswith("q") else "share of runs" for column in columns
    )
    sides = join(filled("{} {}", exact(count), side) for side, count in x.sides.items())
    title = "Random overloads, {} runs{}; in brackets: the interval of {} confidence"
    counts = exact(x.runs), line(" (", sides, ")") if sides else (), exact(x.confidence)
    if rows:
        yield b.Table(tuple(rows), b.heads("", *heads), title=filled(title, *counts))
    yield b.Text(f"The random overloads were run {_METHODS[findings.method]}.", "fine")
