"""The section on the blade of a knife drive: its path, its tilt, the work of a cut."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ...machines.machine import Machine
from ...reading.text import number
from ...report import blocks as b
from ...report import figure as fig
from ...report import linkage
from ...report.analyses import angle_axis
from ...report.cited import cited, quantity_rows
from ...report.motion import DrawnLink
from ...study.arrays import stretches
from ...study.record import StudyRecord, StudySetup
from .analysis import BladeFindings
from .motion import ENDS, edge

PICTURE = "blade_path.png"
_EDGE = DrawnLink("edge", ENDS, "heavy")


def blocks(study: StudyRecord) -> Iterator[b.Block]:
    """The table and the figure of the blade."""
    findings = BladeFindings.of_study(study.findings)
    rows = quantity_rows(cited(findings, "findings.blade").numbers, study.setup.driver_noun, digits=4)
    yield b.Table(rows, title="The blade over a turn at constant speed")
    yield _figure(study.setup, findings)


def _polyline(links: tuple[DrawnLink, ...], places: Mapping[str, tuple[Any, Any]]) -> tuple[Any, Any]:
    """Places x, y of all links as one line with gaps, shape (points,) each [m]."""
    gap, points = (math.nan, math.nan), []
    for link in links:
        points += [places[pin] for pin in (*link.joints, *link.joints[: int(link.closed)])] + [gap]
    x, y = np.array(points, float).T
    return x, y


def _spans(findings: BladeFindings) -> list[fig.Shade]:
    """The ranges of the crank angle in which the blade goes down inside the stack."""
    y, stack = findings.blade.y, findings.stack
    inside = (np.roll(y, -1) < y) & (y < stack.top) & (y > stack.table)
    angle = np.append(findings.turn.angle, 2.0 * math.pi)
    return [fig.Shade(float(angle[a]), float(angle[b]), "in the stack") for a, b in stretches(inside)]


def _figure(setup: StudySetup, findings: BladeFindings) -> fig.Figure:
    """The linkage while its blade falls, the path of the blade, and its tilt over the turn."""
    angle = findings.turn.angle
    fall = (float(angle[np.argmin(findings.blade.y)]) - findings.top) % (2.0 * math.pi)
    metre, small = ((fig.Axis("x", "m", kind), fig.Axis("y", "m", kind)) for kind in ("", "millimetres"))
    tilt: tuple[fig.Item, ...] = (
        fig.Curve("tilt", angle, findings.blade.tilt, in_legend=False),
        *_spans(findings),
    )
    panels = (
        fig.Panel(
            *metre,
            tuple(_positions(setup.drive.machine, findings, fall)),
            "The linkage in three positions",
            equal=True,
        ),
        fig.Panel(
            *small,
            tuple(_path(findings, fall)),
            "Path of the edge's middle; crank angles on its way down",
            equal=True,
        ),
        fig.Panel(angle_axis(setup), fig.Axis("tilt of the blade", "rad"), tilt, "Tilt of the blade"),
    )
    return fig.Figure(
        "blade-path",
        "The linkage in three positions, the path of its blade and its tilt",
        "The linkage with its blade at the top, half-way and at the bottom; the path of the edge's middle; the tilt "
        "of the blade over the crank angle.",
        tuple((panel,) for panel in panels),
        file=PICTURE,
        heights=(2.2, 1.5, 1.0),
    )


def _positions(machine: Machine, findings: BladeFindings, fall: float) -> Iterator[fig.Item]:
    """The linkage with its blade at the top, half-way and at the bottom, and the stack."""
    places: dict[str, tuple[Any, Any]] = {}
    for look, (name, q) in (
        (2, ("blade at its top", findings.top)),
        (1, ("half-way", findings.top + 0.5 * fall)),
        (0, ("at its bottom", findings.top + fall)),
    ):
        m = machine.drive(q * machine.ratio)
        places = linkage.places(m) | edge(machine.p, m.links)
        title = f"{name}, crank at {number(q % (2.0 * math.pi), 'rad')}"
        yield fig.Curve(title, *_polyline((*linkage.links(m.linkage), _EDGE), places), look, "o")
    ends = sorted(float(places[name][0]) for name in ENDS)
    low, high = ([height, height] for height in (findings.stack.table, findings.stack.top))
    yield fig.Between("stack", ends, low, high, "hatched")
    yield fig.Curve("path of the edge's middle", findings.blade.x, findings.blade.y, "path")
    yield from (fig.Label(float(x), float(y), name) for name, (x, y) in places.items() if len(name) < 3)


def _path(findings: BladeFindings, fall: float) -> Iterator[fig.Item]:
    """The path of the edge's middle. Crank angles are marked only on the way down, as the way up may run along the
    same line."""
    x, y = (np.append(coordinate, coordinate[0]) for coordinate in (findings.blade.x, findings.blade.y))
    yield fig.Shade(findings.stack.table, findings.stack.top, "stack", "y", "hatched")
    yield fig.Curve("path of the edge's middle", x, y, in_legend=False)
    angle = findings.turn.angle
    for k in range(7):
        i = round((findings.top + fall * k / 6.0) / (2.0 * math.pi) * len(angle)) % len(angle)
        place = float(findings.blade.x[i]), float(findings.blade.y[i])
        yield fig.Curve("", [place[0]], [place[1]], marker="o", has_line=False, in_legend=False)
        yield fig.Label(place[0], place[1], number(float(angle[i]), "rad"), "left" if k == 6 else "right")
