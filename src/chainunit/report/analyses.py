"""The sections of a report on the analyses of a study: a turn at constant speed, starts from several angles, and
the analyses of the capabilities."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

import numpy as np

from ..core.descriptions import of_driver
from ..reading.text import number as number_words
from ..study.record import StudyRecord, StudySetup
from ..study.starts import StartFindings, transient_words
from ..study.torques import running_words
from ..study.turn import TurnFindings
from . import blocks as b
from . import figure as fig
from .capability import Contents, capabilities
from .cited import cited, number, quantity_rows, table
from .given_numbers import asked_speed
from .lines import filled

_TURN_PICTURE = "turn.png"


def angle_axis(setup: StudySetup) -> fig.Axis:
    """The axis of the crank angle over a turn."""
    counts = setup.drive.machine.model.angle_counts
    return fig.Axis(f"{setup.driver_noun} angle {counts}", "rad", low=0.0, high=2.0 * math.pi, step=45.0)


def last_turn(angle: Any, y: Any) -> tuple[Any, Any]:
    """The last turn of a run with these crank angles [rad]: the angles from 0 to 2 pi, and `y` over them."""
    turn = 2.0 * math.pi
    in_last_turn = angle > angle[-1] - turn
    place = angle[in_last_turn] % turn
    order = np.argsort(place)
    return place[order], y[in_last_turn][order]


def _turn(study: StudyRecord) -> Iterator[b.Block]:
    """The tables and the figure of a turn at constant speed."""
    setup, turn = study.setup, TurnFindings.of_study(study.findings)
    bars = f", of {substitute}" if (substitute := setup.drive.machine.in_place) else ""
    lead = filled(
        f"Inverse dynamics at {{}} of the {setup.driver_noun}, without a motor{bars}.", asked_speed(setup)
    )
    yield b.Text(lead, "lead", "long")
    x = cited(turn, "findings.constant_speed")
    rows = quantity_rows(x.numbers, setup.driver_noun, none="none")
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
    yield _turn_figure(turn, angle_axis(setup), bars, setup.driver_noun)


def _turn_figure(turn: TurnFindings, angle: fig.Axis, bars: str, driver: str) -> fig.Figure:
    """The inertia over a turn at constant speed, and the largest reactions."""
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
        file=_TURN_PICTURE,
        heights=(1.0, 0.17 * len(turn.pins))[: len(panels)],
    )


def _reactions(turn: TurnFindings) -> fig.Panel:
    """Bars of the largest reaction of each pin, with feed and without it."""
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


def _starts(study: StudyRecord) -> Iterator[b.Block]:
    """The worst start in a sentence, and a table of all starts."""
    setup, findings = study.setup, StartFindings.found_in(study.findings)
    if findings is None:
        return
    place = "output of the gear" if setup.drive.is_geared else setup.driver_noun
    x = cited(findings, "findings.starts")
    worst = of_driver(
        f"Start: load and acceleration load the {place} with up to {{}}, from {{a driver}} angle of {{}}: {{}} times "
        "{}, {}.",
        setup.driver_noun,
    )
    running = running_words(study.runs, findings.running_in), number(x.running)
    sizes = number(x.worst.quasi_static), number(x.worst.angle), number(x.over_running)
    text = filled(worst, *sizes, *running)
    if not setup.drive.follows:
        text += filled(" The {}: {}.", transient_words(setup), number(x.transient))
    yield b.Text(text)
    at_gear = "torque at the gear" if setup.drive.is_geared else f"torque at the {setup.driver_noun}"
    in_star = ("speed at the change to delta", lambda start: number(start.star_speed))
    yield from table(
        x.starts,
        (f"{setup.driver_noun} angle", lambda start: number(start.angle)),
        (at_gear, lambda start: number(start.quasi_static, none="not reached")),
        ("with the transient", lambda start: number(start.gear_torque, none="not reached")),
        ("torque on a coupling", lambda start: number(start.coupling_torque, none="not reached")),
        ("start-up time", lambda start: number(start.start_time, none="not reached")),
        ("motor current, peak", lambda start: number(start.current)),
        *([in_star] if setup.drive.star else []),
        title=f"Starts from rest, from several {setup.driver_noun} angles",
        form="long",
    )


@cache
def analysis_sections() -> Mapping[str, Contents]:
    """All of them, in the order in which a report has them."""
    others = {name: contents for part in capabilities() for name, contents in part.contents().items()}
    return {
        **{name: contents for name, contents in others.items() if contents.before == "constant_speed"},
        "constant_speed": Contents("A turn at constant speed", _turn, (_TURN_PICTURE,)),
        **others,
        "starts": Contents("Starts", _starts),
    }
