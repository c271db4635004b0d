"""The section on the driveline: the torque in its shafts in each run, and the cycles of this torque."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from ..core.quantities import Layout
from ..study.analysis import is_examined
from ..study.line.rigid_line import HOLDS_FROM, RigidLine
from ..study.line.shaft import CLASSES, RIGID, ShaftAnswers
from ..study.line.shaft_runs import shaft_findings
from ..study.record import StudyRecord, StudySetup
from ..study.verdict import START, STEADY
from . import blocks as b
from . import figure as fig
from .cited import cited, number, quantity_rows
from .lines import filled
from .pictures import Pictures
from .runs import by_side, over_runs

PICTURES = Pictures()
TORQUE = fig.Axis("torque in shaft 2", "N.m")
_BESIDE = 3
"""Number of runs beside each other in the figure; with more of them the labels are illegible on the page."""


def blocks(study: StudyRecord) -> Iterator[b.Block]:
    """The tables and the figure of the driveline."""
    if not shaft_findings(study.findings).answers:
        return
    yield _shaft(study)
    if not is_examined("driveline", study.findings.by_analysis):
        modes = quantity_rows(cited(study.setup.statics.modes, "findings.driveline"), study.setup.driver_noun)
        yield b.Table(modes, title="The driveline's torsion")
    if study.setup.statics.rigid_line is not None:
        yield _rigid(study.setup, study.setup.statics.rigid_line)
    yield from PICTURES.figures(study)


def _rigid(setup: StudySetup, rigid: RigidLine) -> b.Judgement:
    """The verdict on a rigid model of the drive, with its two numbers."""
    x = cited(rigid, "findings.rigid_line")
    verdict = (
        f"In steady running a rigid model of the drive {'holds' if rigid.holds else 'does not hold'} (VDI 2149: from "
        f"{HOLDS_FROM:g} times on): the lowest natural frequency of the line, {{}}, is {{}} times the frequency of "
        f"the {setup.driver_noun}'s turns, {{}}."
    )
    sizes = map(number, (x.natural_frequency, x.ratio, x.driver_frequency))
    return b.Judgement("good" if rigid.holds else "partly", filled(verdict, *sizes))


def _shaft(study: StudyRecord) -> b.Table:
    """The table of the demands of each run on the driveline."""
    answers = cited(shaft_findings(study.findings), "findings.shaft").answers
    names = by_side(study.runs, answers)
    rows = (
        b.TableRow((v.description, *(number(getattr(answers[run], v.name)) for run in names)))
        for v in Layout(ShaftAnswers).variables
    )
    return over_runs(study.runs, names, rows, "Torque in the driveline")


@PICTURES.declare(lambda study: shaft_findings(study.findings).answers, "driveline.png")
def _driveline(study: StudyRecord) -> fig.Figure:
    """The torque in the driveline beside that in a rigid one, and its rainflow cycles."""
    runs, shaft = study.runs, shaft_findings(study.findings)
    largest = max(answers.range_largest for answers in shaft.answers.values())
    above, below = [], []
    for name in shaft.answers:
        since = 0.0 if name == START else runs.steady_begin if name == STEADY else runs.event_times[name]
        until = runs.steady_begin if name == START else None
        run = runs.series[START if name == STEADY else name].sel(time=slice(since, until))
        time = run["time"].values - since
        x = fig.Axis("time", "s", low=0.0, high=float(time[-1]))
        title = runs.title_of(name)
        above.append(fig.Panel(x, TORQUE, tuple(shaft_torque(run, time)), title))
        classes = shaft.cycles[name].classes(largest)
        middle = [0.5 * (row.low + row.high) for row in classes]
        wide = 0.9 * largest / CLASSES
        bars = fig.Bars("cycles", middle, [row.count for row in classes], wide, 1)
        cycles = fig.Axis("cycles counted (rainflow)", low=0.0), fig.Axis("range of torque", "N.m", low=0.0)
        below.append(fig.Panel(*cycles, (bars,)))
    rows: list[tuple[fig.Panel | None, ...]] = []
    for k in range(0, len(above), _BESIDE):
        # below a full row, a row has empty places at its end
        empty = [None] * (k + _BESIDE - len(above) if k else 0)
        rows += [(*above[k : k + _BESIDE], *empty), (*below[k : k + _BESIDE], *empty)]
    return fig.Figure(
        "driveline",
        "The torque in the driveline, and its cycles",
        "Torque in shaft 2 over time, with this driveline and with a rigid shaft, and below the cycles that are "
        "counted in each class of torque range.",
        tuple(rows),
        heights=(1.3, 0.9) * (len(rows) // 2),
        level=True,
    )


def shaft_torque(run: Any, time: Any) -> list[fig.Item]:
    """The torque in the driveline and, where the run has it, the torque with a rigid shaft."""
    rigid = [fig.Curve("with a rigid shaft", time, run[RIGID].values, 1)] if RIGID in run else []
    return [fig.Curve("with this driveline", time, run["driveline.tau2"].values), *rigid]
