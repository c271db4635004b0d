"""The section on a turn at constant speed: torque, inertia and energy, and the largest reactions of the pins."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from ..reading.text import number as number_words
from ..study.record import StudyRecord
from ..study.turn import TurnFindings
from . import blocks as b
from . import figure as fig
from .cited import cited, number, quantity_rows, table
from .given_numbers import asked_speed
from .lines import filled

PICTURE = "turn.png"


def angle_axis(study: StudyRecord) -> fig.Axis:
    """The axis of the crank angle over a turn."""
    counts = study.drive.machine.model.angle_counts
    return fig.Axis(f"{study.driver_noun} angle {counts}", "rad", low=0.0, high=2.0 * math.pi, step=45.0)


def last_turn(angle: Any, y: Any) -> tuple[Any, Any]:
    """The last turn of a run with these crank angles [rad]: the angles from 0 to 2 pi, and `y` over them."""
    turn = 2.0 * math.pi
    last = angle > angle[-1] - turn
    place = angle[last] % turn
    order = np.argsort(place)
    return place[order], y[last][order]


def blocks(s: b.Source, study: StudyRecord) -> Iterator[b.Block]:
    """The tables and the figure of a turn at constant speed."""
    turn = TurnFindings.of_study(study)
    bars = f", of {substitute}" if (substitute := study.drive.machine.in_place) else ""
    lead = filled(
        f"Inverse dynamics at {{}} of the {study.driver_noun}, without a motor{bars}.", asked_speed(study)
    )
    yield b.Text(lead, "lead", "long")
    x = cited(turn, "findings.constant_speed")
    rows = quantity_rows(x.numbers, study.driver_noun, none="none")
    yield b.Table(rows, title=f"A turn at constant speed{bars}", form="long")
    if turn.pins:
        yield from table(
            x.pins.items(),
            ("pin", lambda row: row[0]),
            ("peak, with feed", lambda row: number(row[1].peak)),
            ("at", lambda row: number(row[1].angle)),
            ("peak, without feed", lambda row: number(row[1].peak_free)),
            ("at", lambda row: number(row[1].angle_free)),
            title=f"Largest forces in the pins over a turn at constant speed{bars}",
            form="long",
        )
    yield _figure(turn, angle_axis(study), bars, study.driver_noun)


def _figure(turn: TurnFindings, angle: fig.Axis, bars: str, driver: str) -> fig.Figure:
    inertia = fig.Curve("inertia", turn.loaded.angle, turn.inertia, in_legend=False)
    panels = [fig.Panel(angle, fig.Axis("reflected inertia", "kg.m2", low=0.0), (inertia,))]
    if turn.pins:
        panels.append(_reactions(turn))
    return fig.Figure(
        "turn-at-constant-speed",
        f"Inertia and largest reactions over a turn at constant speed{bars}",
        f"The inertia reflected to the {driver} over the {driver} angle; bars of the largest reaction of every pin, "
        f"with feed and without it, with the {driver} angle at which it comes.",
        tuple((panel,) for panel in panels),
        file=PICTURE,
        heights=(1.0, 0.17 * len(turn.pins))[: len(panels)],
    )


def _reactions(turn: TurnFindings) -> fig.Panel:
    pins, items = turn.pins, []
    for look, shift, title, size, angle in (
        (1, -0.2, "with feed", "peak", "angle"),
        (2, 0.2, "without feed", "peak_free", "angle_free"),
    ):
        peaks = [(getattr(r, size), getattr(r, angle)) for r in pins.values()]
        places = tuple(
            f"{number_words(peak, 'N')} at {number_words(peak_angle, 'rad')}" for peak, peak_angle in peaks
        )
        positions = np.arange(len(pins)) + shift
        items.append(fig.Bars(title, positions, [peak for peak, _ in peaks], 0.38, look, words=places))
    # 30 % of room for the words beside the bars
    largest = max(max(r.peak, r.peak_free) for r in pins.values())
    x = fig.Axis("largest reaction", "N", low=0.0, high=1.3 * largest or None)
    return fig.Panel(x, fig.Axis("pin", names=tuple(pins)), tuple(items))
