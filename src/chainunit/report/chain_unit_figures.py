"""The figures of the report on a chain unit."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from ..engines import numpy_
from ..machines.chain_unit import SIDES
from ..study.chain import HIGH
from ..study.cycle import Cycle
from ..study.shaft import RIGID
from ..study.study import Study
from ..text import forms
from . import accessors as read
from . import blocks as b
from . import figure as fig
from .style import WIDE

PICTURES = (
    *("torque_angle.png", "sides_over_speed.png", "speed_loop.png", "overload_time.png", "torque_speed.png"),
    *("reactions.png", "start_up.png", "driveline.png", "chain_sweep.png"),
)
_MOTION = ("phi", "w", "a")
_ANGLE = fig.Axis("crank angle from the upward vertical", "rad", low=0.0, high=2.0 * math.pi, step=45.0)
_SERIES = {
    "torque": fig.Axis("crank torque", "N.m"),
    "speed": fig.Axis("crank speed", "rad/s"),
    "current": fig.Axis("motor current", "A"),
    "shaft": fig.Axis("torque in shaft 2", "N.m"),
}


def figures(s: b.Source, study: Study) -> Iterator[fig.Figure]:
    """Every figure that the study has data for."""
    driven = read.driven(study)
    if driven and study.drive.foreign is None:
        yield _torque_speed(study, driven)
    if study.statics.cycles:
        yield _turn(s, study)
    if study.statics.organs is not None:
        yield _sides(s, study)
    if study.statics.loops:
        yield _speed_loop(study)
    if study.chain is not None and len(study.chain.sweep) > 1:
        yield _chains(study)
    transients = {name: _transient(s, study, name) for name in driven}
    yield from transients.values()
    if groups := read.groups(study, [name for name in study.overloads if name in transients]):
        yield _overloads([[transients[name] for name in group] for group in groups])
    if study.shaft:
        yield _driveline(study)
    if study.pins:
        yield _reactions(study)


def _stacked(
    x: fig.Axis, panels: Iterable[tuple[fig.Axis, Iterable[fig.Item]]]
) -> tuple[tuple[fig.Panel], ...]:
    """Panels below each other, over the same x."""
    return tuple((fig.Panel(x, y, tuple(items)),) for y, items in panels)


def _torque_speed(study: Study, names: list[str]) -> fig.Figure:
    """The start, and beside it the overloads of each side, at a scale of their own."""
    panels = []
    for group in [[name for name in names if not read.is_event(study, name)], *read.groups(study, names)]:
        # an overload from its event on; before it is the steady running of the first panel
        runs = {name: study.runs[name].sel(time=slice(read.event_time(study, name), None)) for name in group}
        curves = [
            fig.Curve(
                read.title(study, name),
                run["motor.w"].values,
                run["motor.air_gap_tau"].values,
                names.index(name),
            )
            for name, run in runs.items()
        ]
        slowest, fastest = (float(of([of(curve.x) for curve in curves])) for of in (np.min, np.max))
        room = 0.15 * (fastest - slowest)
        low = slowest - room if slowest < 0.0 else max(0.0, slowest - room)
        w = np.linspace(low, fastest + room, 301)
        most = np.broadcast_to(study.drive.motor.limit(numpy_(), study.drive.parameters, w), w.shape)
        # beyond the synchronous speed it falls out of all that is run
        most = np.where(most < min(float(np.min(curve.y)) for curve in curves), np.nan, most)
        x = fig.Axis("motor speed", "rad/s", "speed", low=low, high=fastest + room)
        limit = fig.Curve("most that the drive gives, steady", w, most, "limit")
        panels.append(fig.Panel(x, fig.Axis("air-gap torque", "N.m"), (*curves, limit)))
    return fig.Figure(
        "torque-speed",
        "Torque-speed plane: the start, and the overloads from their event on",
        "Air-gap torque of the motor over its speed, a line for each run, with the most that the drive gives in "
        "steady running.",
        (tuple(panels),),
        "Steady running is a closed loop. Grey: the most that the drive gives in steady running.",
        "torque_speed.png",
        heights=(1.6,),
    )


def _turn(s: b.Source, study: Study) -> fig.Figure:
    torques: dict[str, Callable[[Cycle], Any]] = {"crank": lambda c: c.crank_torque}
    if study.statics.organs is not None:
        torques["rocker"] = lambda c: c.outputs.rocker.tau
    items: dict[fig.Axis, list[fig.Item]] = {}
    for of, torque in torques.items():
        curves = items[fig.Axis(f"{of} torque", "N.m")] = []
        for look, (name, c) in enumerate(study.statics.cycles.items()):
            y = np.broadcast_to(torque(c), c.angle.shape)
            curves.append(fig.Curve(name, np.append(c.angle, 2.0 * math.pi), np.append(y, y[0]), look))
    return fig.Figure(
        "turn",
        "Torque over a crank turn at constant speed",
        "Crank torque and, below, the torque that both organs ask of the rocker, over the crank angle: both sides "
        "loaded, one side empty, all feed on one side.",
        _stacked(_ANGLE, items.items()),
        s.line("Inverse dynamics of two bars at {=run.crank_speed} of the crank, without a motor."),
        "torque_angle.png",
    )


def _sides(s: b.Source, study: Study) -> fig.Figure:
    assert study.statics.organs is not None
    sides = study.statics.organs.sides
    words = {"both": "both sides"} | {str(side): f"{side} side alone" for side in SIDES}

    def items(of: str) -> Iterator[fig.Item]:
        for look, (which, name) in enumerate(words.items()):
            yield fig.Curve(name, sides.speed, getattr(sides, f"{of}_{which}"), look)
        yield from (fig.Mark(at, look="thin") for speeds in sides.crossings()[of].values() for at in speeds)
        yield fig.Mark(study.config.run.crank_speed, words="normal running" if of == "crank" else "")

    x = fig.Axis("crank speed", "rad/s", "speed", low=0.0, high=float(sides.speed[-1]))
    axes = {of: fig.Axis(f"{of} torque, peak", "N.m", low=0.0) for of in ("crank", "rocker")}
    caption = (
        "Largest torques of a turn by inverse dynamics of two bars. Where lines cross, one side alone asks as much "
        "as both"
    )
    return fig.Figure(
        "sides",
        "One side alone against both, over the speed",
        "Largest crank torque and rocker torque in a turn over the crank speed, with both sides and with each side "
        "alone; the speed of normal running is marked.",
        _stacked(x, ((axis, items(of)) for of, axis in axes.items())),
        s.line(f"{caption}{_crossings(s)}."),
        "sides_over_speed.png",
    )


def _crossings(s: b.Source) -> str:
    """Where one side alone asks as much as both, as a template; empty where nothing crosses."""
    text = ""
    for torque, sides in s.result["sides_over_speed"]["crossings"].items():
        path = f"sides_over_speed.crossings.{torque}"
        places = [
            f"{side} alone at " + " and ".join(f"{{{path}.{side}.{k}}}" for k in range(len(speeds)))
            for side, speeds in sides.items()
            if speeds
        ]
        text += f"; {torque} torque: {', '.join(places)}" if places else ""
    return text


def _speed_loop(study: Study) -> fig.Figure:
    loops = list(enumerate(study.statics.loops.items()))
    frequency = fig.Axis("frequency", "rad/s", log=True)
    longest = 1.5 * max(loop.settling for loop in study.statics.loops.values())
    time = fig.Axis("time after a step of the load torque", "s", low=0.0, high=longest)
    panels = (
        (frequency, fig.Axis("gain of the open loop", log=True), "frequency", "gain", "Gain"),
        (frequency, fig.Axis("phase", "deg", low=-270.0, high=0.0, step=45.0), "frequency", "phase", "Phase"),
        (
            time,
            fig.Axis("deviation of the motor speed", "rad/(N.m.s)"),
            "time",
            "deviation",
            "Disturbance step",
        ),
    )

    def items(over: str, of: str) -> Iterator[fig.Item]:
        yield from (
            fig.Curve(name, getattr(loop, over), getattr(loop, of), look) for look, (name, loop) in loops
        )
        if of == "gain":
            yield fig.Mark(1.0, axis="y", look="thin")

    return fig.Figure(
        "speed-loop",
        "The speed loop, linearised",
        "Gain and phase of the open speed loop over the frequency, and the deviation of the motor speed after a step "
        "of the load torque.",
        (tuple(fig.Panel(x, y, tuple(items(over, of)), title) for x, y, over, of, title in panels),),
        file="speed_loop.png",
        heights=(1.4,),
    )


def _chains(study: Study) -> fig.Figure:
    result = study.chain
    assert result is not None
    rows = result.sweep
    speed = np.array([n.speed for n in rows])
    x = fig.Axis("crank speed", "rad/s", "speed", low=float(speed[0]), high=float(speed[-1]))
    # on a narrow screen, too, no label covers another
    words: list[fig.Item] = [
        fig.Mark(
            at, words=f"mode {mode}" + (f", order {order}" if order > 1 else ""), look="thin", upright=True
        )
        for mode, order, at in result.within_sweep(0.05)
    ]
    marks: list[fig.Item] = [
        *(fig.Shade(band.low, band.high, "to avoid") for band in result.avoid),
        *(fig.Mark(at, look="thin") for _, _, at in result.within_sweep()),
        fig.Mark(result.own.speed, "the study's speed", look=2),
    ]

    def compared(median: Any, two: Any) -> list[fig.Item]:
        return [
            fig.Curve("chains, median", speed, median, 0, "o"),
            fig.Curve("two bars", speed, two, 1, "s"),
            *marks,
        ]

    panels: list[tuple[fig.Axis, list[fig.Item]]] = []
    for of in ("rocker", "crank"):
        names = (f"{of}_torque_median", f"{of}_torque_high", f"two_bar_{of}_torque")
        median, high, two = (np.array([getattr(n, name) for n in rows]) for name in names)
        sizes = np.concatenate([median, high, two])
        wide = float(np.nanmax(sizes)) > WIDE * max(float(np.nanmin(sizes)), 1e-9)
        quantile = fig.Between(f"chains, up to the {100 * HIGH:g} % quantile", speed, median, high)
        y = fig.Axis(f"{of} torque, peak", "N.m", low=None if wide else 0.0, log=wide)
        panels.append((y, [quantile, *compared(median, two), *([] if panels else words)]))
    slack = compared([n.slack_time for n in rows], [n.two_bar_slack_time for n in rows])
    panels.append((fig.Axis("time slack", "1", "percent", low=-0.04, high=1.04), slack))
    return fig.Figure(
        "chains",
        f"Chains and two bars over the crank speed: {result.starts} starts of {result.turns} turns",
        "Peaks of rocker torque and crank torque in a turn over the crank speed, chains and two bars, and below the "
        "share of the time in which a rod is slack; speeds to avoid are shaded, critical speeds are lines.",
        _stacked(x, panels),
        "The crank held at constant speed. Shaded: speeds to avoid; dash-dotted: the speed of normal running; thin: "
        "critical speeds. Two bars do not go slack: of them, the time in which one pushes.",
        "chain_sweep.png",
        heights=(1.1, 1.1, 0.65),
    )


# -- over time


def _transient(s: b.Source, study: Study, name: str) -> fig.Figure:
    """Torque, speed and current of a run over time."""
    run, drive, event = study.runs[name], study.drive, read.event_time(study, name)
    series = read.series(study, name)
    time = series["time"]
    items: dict[str, list[fig.Item]] = {
        of: [fig.Curve(_SERIES[of].label, time, series[of], listed=False)]
        for of in ("torque", "speed", "current")
        if of in series
    }
    if drive.line is not None:
        items["shaft"] = _shaft_torque(run, time)
    if event is None and drive.follows:
        items["speed"].append(fig.Curve("speed asked for", time, run["motor.w_ref"].values / drive.ratio, 1))
    limit = drive.motor.current_limit(drive.parameters)
    if limit is not None and np.max(np.abs(series["current"])) > 0.5 * limit:
        items["current"].append(fig.Mark(limit, "current limit", axis="y", look="limit"))
    low, high = float(time[0]), float(time[-1])
    behind = study.runs.get(name + read.COASTING)
    if behind is not None:
        after = behind["time"].values - (event or 0.0)
        items["speed"].append(
            fig.Curve("crank behind the open coupling", after, drive.crank_motion(behind)[1], 1)
        )
        high = float(after[-1])
    if event is not None:
        # the last quarter turn before the event says enough of steady running
        low = max(low, -0.5 * math.pi / study.config.run.crank_speed)
    marks, words = _marks(study, name, event), read.title(study, name)
    return fig.Figure(
        f"time-{name.replace('_', '-')}",
        words,
        f"Crank torque, crank speed and motor current over time: {words}."
        + ("" if event is None else " The event is marked by a dashed line; the loads change in the shade."),
        _stacked(
            fig.Axis("time" if event is None else "time after the event", "s", low=low, high=high),
            ((_SERIES[of], (*curves, *marks(of == "torque"))) for of, curves in items.items()),
        ),
        s.line(_after(s, study, name)) if event is not None else (),
        "start_up.png" if name == "start_up" else "",
        half=True,
    )


def _shaft_torque(run: Any, time: Any) -> list[fig.Item]:
    """Torque in the driveline, and what it were with a rigid shaft, where that is known."""
    rigid = [fig.Curve("with a rigid shaft", time, run[RIGID].values, 1)] if RIGID in run else []
    return [fig.Curve("with this driveline", time, run["driveline.tau2"].values), *rigid]


def _marks(study: Study, name: str, event: float | None) -> Callable[[bool], list[fig.Item]]:
    """What is marked in each panel of a run; words only where they are asked for."""
    run = study.runs[name]

    def marks(words: bool) -> list[fig.Item]:
        if event is not None:
            loads = (name for name in study.drive.machine.model.input_layout.names if name not in _MOTION)
            changing = _changing(run, [*(f"machine.{load}" for load in loads), "motor.voltage"])
            shade = [] if changing is None else [fig.Shade(changing[0] - event, changing[1] - event)]
            return [*shade, fig.Mark(0.0, words="event" if words else "")]
        if name == "start_up" and study.answers:
            return [fig.Mark(study.settled, words="steady from here" if words else "")]
        return []

    return marks


def _changing(run: Any, loads: Iterable[str]) -> tuple[float, float] | None:
    """From when to when the loads differ from one sample to the next [s]."""
    changes = np.zeros(len(run["time"]) - 1, bool)
    for name in loads:
        if name in run:
            changes |= np.diff(run[name].values) != 0.0
    places = np.flatnonzero(changes)
    if not places.size:
        return None
    time = run["time"].values
    return float(time[places[0]]), float(time[places[-1] + 1])


def _after(s: b.Source, study: Study, run: str) -> str:
    """What the speed does after the event, as a template."""
    caption = "Upright, dashed: the event. Shaded: the loads change."
    if run not in s.result["answers"]:
        return caption
    least, dip, back = (f"answers.{run}.{name}" for name in ("speed_least", "speed_dip", "recovery_time"))
    share, recovery = s.value(dip), s.value(back)
    if share is None or share <= 0.0:
        caption += f" The least speed is {{{least}}}"
    elif not forms(share, "1", "dip")[0][1]:
        # words stand in the number's place
        caption += f" The crank {{{dip}}}"
    else:
        caption += f" The speed dips by {{{dip}}}"
    if not study.returns:
        caption += "; the motor does not reach the speed asked for, so that there is no band to return to."
    elif recovery is None:
        caption += "; it does not return to its steady band within the time followed."
    elif recovery == 0.0:
        caption += "; it does not leave its steady band."
    else:
        caption += f"; it is back in its steady band after {{{back}}}."
    if run in s.result["block_peaks"]:
        path, ends = f"block_peaks.{run}", s.result["block_peaks"][run]
        names = [name.removesuffix("_low") for name in ends if name.endswith("_low")]
        ranges = {name: f"{{{path}.{name}_low}} to {{{path}.{name}_high}}" for name in names}
        assumed = (f"{name} {ranges[name]}" for name in names if ends[f"{name}_low"].get("kind") == "assumed")
        caption += f" Assumed: {', '.join(assumed)}; the crank torque peaks at {ranges['crank_torque']}."
    return caption


def _overloads(groups: list[list[fig.Figure]]) -> fig.Figure:
    """The overloads beside each other in print: a band of rows for each side, the scales alike in all."""
    widest = max(map(len, groups))
    rows: list[tuple[fig.Panel | None, ...]] = []
    for group in groups:
        for k in range(min(3, *(len(each.panels) for each in group))):
            row = [
                replace(panel, title="" if k else each.title)
                for each in group
                if (panel := each.panels[k][0]) is not None
            ]
            rows.append((*row, *[None] * (widest - len(row))))
    return fig.Figure(
        "overloads",
        "Overloads",
        "Crank torque, crank speed and motor current of every overload.",
        tuple(rows),
        file="overload_time.png",
        level=True,
        on_page=False,
    )


def _driveline(study: Study) -> fig.Figure:
    """Torque in the driveline beside that of a rigid one, and its rainflow cycles."""
    largest = max(answers.range_largest for answers in study.shaft.values())
    above, below = [], []
    for name in study.shaft:
        since = study.settled if name == "steady" else study.event[name]
        run = study.runs["start_up" if name == "steady" else name].sel(time=slice(since, None))
        time = run["time"].values - since
        x = fig.Axis("time", "s", low=0.0, high=float(time[-1]))
        title = read.title(study, name)
        above.append(fig.Panel(x, _SERIES["shaft"], tuple(_shaft_torque(run, time)), title))
        rows = study.cycles_of[name].classes(largest)
        middle, wide = (
            [0.5 * (row["from"] + row["to"]) for row in rows],
            0.9 * (rows[0]["to"] - rows[0]["from"]),
        )
        bars = fig.Bars("cycles", middle, [row["count"] for row in rows], wide, 1)
        cycles = fig.Axis("cycles counted (rainflow)", low=0.0), fig.Axis("range of torque", "N.m", low=0.0)
        below.append(fig.Panel(*cycles, (bars,)))
    return fig.Figure(
        "driveline",
        "The torque in the driveline, and its cycles",
        "Torque in shaft 2 over time, with this driveline and with a rigid shaft, and below the cycles that are "
        "counted in each class of torque range.",
        (tuple(above), tuple(below)),
        file="driveline.png",
        heights=(1.3, 0.9),
        level=True,
    )


def _reactions(study: Study) -> fig.Figure:
    runs, pins = list(study.pins), list(next(iter(study.pins.values())))
    height = 0.84 / len(runs)
    items = []
    for look, name in enumerate(runs):
        places = np.arange(len(pins)) - 0.42 + (look + 0.5) * height
        peak = f"{study.called(name)}: peak"
        for words, size, wide in ((peak, "peak", 0.92), ("dark inner bar: RMS", "rms", 0.34)):
            sizes = [study.pins[name][pin][size] for pin in pins]
            items.append(fig.Bars(words, places, sizes, wide * height, look, slim=size == "rms"))
    return fig.Figure(
        "reactions",
        "What the pins carry",
        "Bars of the reaction of every pin in every run: the wide bar is the peak, the dark one inside the RMS.",
        ((fig.Panel(fig.Axis("reaction", "N", low=0.0), fig.Axis("pin", names=tuple(pins)), tuple(items)),),),
        "Peak and RMS of the force in each pin, frame x right, y up; means over whole crank turns.",
        "reactions.png",
        heights=(max(11, 20 - len(runs)) * len(runs) * len(pins) / 250.0,),
    )
