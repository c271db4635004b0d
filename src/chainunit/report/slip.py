"""The section on the parts of the line that slip: the fluid coupling and the belt, by run and over the load."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..core.engines import numpy_
from ..core.quantities import Layout
from ..drives.fluid_coupling import torque
from ..study.line.belt import BeltAnalysis, BeltAnswers, BeltFindings
from ..study.line.fluid_coupling import CouplingAnalysis, CouplingAnswers, CouplingFindings
from ..study.line.placed import PlacedPart
from ..study.line.slipping import parts_of_runs
from ..study.record import StudyRecord, StudyRuns, StudySetup
from ..study.verdict import START, STEADY
from . import blocks as b
from . import figure as fig
from .cited import cited, number, quantity_rows, table
from .pictures import Pictures
from .runs import by_side, over_runs

PICTURES = Pictures()
_BESIDE = 3
"""Number of runs beside each other in the figure."""
_KINDS = (
    (CouplingFindings, CouplingAnswers, CouplingAnalysis.name, "fluid coupling"),
    (BeltFindings, BeltAnswers, BeltAnalysis.name, "V-belt"),
)
"""The findings and the answers of each part, the name of its analysis, and its noun."""


def blocks(study: StudyRecord) -> Iterator[b.Block]:
    """The tables and the figures of both parts."""
    for kind, declared, name, noun in _KINDS:
        findings = kind.found_in(study.findings)
        if findings is None:
            continue
        x = cited(findings, f"findings.{name}")
        yield b.Table(quantity_rows(x), title=f"The {noun}")
        if isinstance(findings, BeltFindings):
            yield from table(
                cited(findings, f"findings.{name}").loads,
                ("load over the rated torque", lambda row: number(row.load)),
                ("slip", lambda row: number(row.slip)),
                ("efficiency", lambda row: number(row.efficiency)),
                title="The V-belt over its load, at the rated speed",
                form="long",
            )
        names = by_side(study.runs, findings.answers)
        rows = (
            b.TableRow((v.description, *(number(getattr(x.answers[run], v.name)) for run in names)))
            for v in Layout(declared).variables
        )
        yield over_runs(study.runs, names, rows, f"Load of the {noun}")
    yield from PICTURES.figures(study)


@PICTURES.declare(lambda study: CouplingFindings.found_in(study.findings), "coupling_torque.png")
def _characteristic(study: StudyRecord) -> fig.Figure:
    """The torque of the fluid coupling over its slip, at three speeds of the motor."""
    findings, placed = CouplingFindings.of_study(study.findings), _part(study.setup, "fluid_coupling")
    slip, speed = np.linspace(0.0, 1.0, 201), placed.table.rated_speed
    curves = tuple(
        fig.Curve(
            f"motor at {share:.0%} of its rated speed",
            slip,
            torque(numpy_(), placed.parameters, share * speed, share * speed * (1.0 - slip))[0],
            look,
        )
        for look, share in enumerate((1.0, 0.75, 0.5))
    )
    marks = (
        fig.Mark(findings.answers[STEADY].slip_mean, "mean slip of steady running", look="reference"),
        fig.Mark(findings.rated_torque, "rated torque", axis="y"),
    )
    axes = fig.Axis("slip", "1", "percent", low=0.0, high=1.0), fig.Axis("torque", "N.m", low=0.0)
    return fig.Figure(
        "coupling-torque",
        "The torque of the fluid coupling",
        "Torque of the fluid coupling over its slip, with the motor at its rated speed and below.",
        ((fig.Panel(*axes, (*curves, *marks)),),),
        half=True,
    )


@PICTURES.declare(lambda study: any(kind.found_in(study.findings) for kind, *_ in _KINDS))
def _speeds(study: StudyRecord) -> Iterator[fig.Figure]:
    """The speed before and behind each part, over time."""
    for part in study.setup.drive.line:
        if part.slips:
            yield _speeds_of(study.runs, part)


def _speeds_of(runs: StudyRuns, part: PlacedPart) -> fig.Figure:
    """The speeds on either side of a part that slips, a panel for the start and each event."""
    noun = {"fluid_coupling": "fluid coupling"}.get(part.name, part.name)
    panels = []
    for name, run in parts_of_runs(runs, part):
        if name != STEADY:
            time = run.time - (0.0 if name == START else runs.event_times[name])
            curves = (
                fig.Curve(f"before the {noun}", time, run.speed),
                fig.Curve(f"behind the {noun}, at the shaft before it", time, run.driven, 1),
            )
            x = fig.Axis("time", "s", low=float(time[0]), high=float(time[-1]))
            panels.append(fig.Panel(x, fig.Axis("speed", "rad/s", "speed"), curves, runs.title_of(name)))
    rows = tuple(
        (*panels[k : k + _BESIDE], *(None for _ in range(k + _BESIDE - len(panels) if k else 0)))
        for k in range(0, len(panels), _BESIDE)
    )
    return fig.Figure(
        f"{part.name.replace('_', '-')}-speeds",
        f"The slip of the {noun}",
        f"Speed of the shafts before and behind the {noun} over time, in the start and in each event.",
        rows,
        level=True,
    )


def _part(setup: StudySetup, name: str) -> PlacedPart:
    part = setup.drive.line.part(name)
    assert part is not None
    return part
