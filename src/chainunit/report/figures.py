"""The section of plots: torque and speed of each run, a turn at constant speed, the forces in the pins."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from ..core.descriptions import of_driver
from ..core.engines import numpy_
from ..reading.text import forms
from ..reading.text import number as number_words
from ..study.arrays import Dataset
from ..study.bearings import hardest_run
from ..study.cycle import Cycle
from ..study.drive import Drive
from ..study.readings import crank_motion, crank_speed, crank_torque, shaft_power
from ..study.record import StudyRecord, StudyRuns, StudySetup
from ..study.result import assumed_ranges
from ..study.window import mean
from . import figure as fig
from . import machine_picture, run_names
from .analyses import angle_axis, last_turn
from .cited import cited, number
from .given_numbers import asked_speed
from .lines import Line, capital, filled, join, line
from .pictures import Pictures
from .shaft import TORQUE, shaft_torque
from .study_motion import machine_state

PICTURES = Pictures()
_MOTION = ("phi", "w", "a")
_CURRENT = fig.Axis("motor current", "A")
_LOAD_CLASSES = 40
"""Classes of the histogram of the load."""


@PICTURES.declare(
    lambda study: run_names.motor_runs(study.runs) and study.setup.drive.foreign is None, "torque_speed.png"
)
def _torque_speed(study: StudyRecord) -> fig.Figure:
    """Torque over speed in a panel for the start and one for the overloads of each side, at scales of their own."""
    names = run_names.motor_runs(study.runs)
    # an event that is a start of its own would squeeze the loops of the others
    starts = [name for name in names if run_names.event_time(study.runs, name) is None]
    overloads = run_names.groups(study.runs, [name for name in names if name not in starts])
    return fig.Figure(
        "torque-speed",
        "Torque-speed plane: the start, and the overloads from their event on",
        "Air-gap torque of the motor over its speed, a line for each run, with the largest torque that the drive "
        "gives in steady running.",
        (tuple(_torque_speed_panel(study, group, names) for group in (starts, *overloads)),),
        "Steady running is a closed loop. Grey: the largest torque that the drive gives in steady running.",
        heights=(1.6,),
    )


def _torque_speed_panel(study: StudyRecord, group: list[str], names: list[str]) -> fig.Panel:
    """The panel of a group of runs; a run has the look of its place among all `names`."""
    # an overload is drawn from its event on: before, it is the steady running of the first panel
    runs = {name: run_names.from_event(study.runs, name) for name in group}
    curves = [
        fig.Curve(
            run_names.title(study.runs, name),
            run["motor.w"].values,
            run["motor.air_gap_tau"].values,
            names.index(name),
        )
        for name, run in runs.items()
    ]
    speeds = np.concatenate([curve.x for curve in curves])
    slowest, fastest = float(np.min(speeds)), float(np.max(speeds))
    room = 0.15 * (fastest - slowest)
    low = slowest - room if slowest < 0.0 else max(0.0, slowest - room)
    w = np.linspace(low, fastest + room, 301)
    most = np.broadcast_to(study.setup.drive.motor.limit(numpy_(), study.setup.drive.parameters, w), w.shape)
    # beyond the synchronous speed the limit falls far below the torques of all runs
    most = np.where(most < min(float(np.min(curve.y)) for curve in curves), np.nan, most)
    x = fig.Axis("motor speed", "rad/s", "speed", low=low, high=fastest + room)
    limit = fig.Curve("largest steady torque of the drive", w, most, "limit")
    items = (*curves, limit, *_duty(study))
    return fig.Panel(x, fig.Axis("air-gap torque", "N.m"), items, _group_title(study.runs, group))


def _duty(study: StudyRecord) -> Iterator[fig.Item]:
    """The speed of normal running and, where the motor has a nameplate, its rated point and the rated torque, which
    it may give without a limit of time (S1)."""
    if "steady" in study.runs.answers:
        speed = study.runs.answers["steady"].speed_mean * study.setup.drive.ratio
        yield fig.Mark(speed, "steady running, mean", look="mark")
    if study.setup.plate is not None:
        speed, torque = study.setup.plate.nameplate.speed, study.setup.plate.nameplate.torque
        yield fig.Mark(torque, "rated torque (S1)", axis="y", look="reference")
        yield fig.Curve("rated point", [speed], [torque], marker="o", has_line=False)


def _group_title(runs: StudyRuns, names: list[str]) -> str:
    """The title of a panel with these runs."""
    if run_names.event_time(runs, names[0]) is None:
        return f"Start{'s' * (len(names) > 1)} and steady running"
    sides = [runs.events[run].loaded_side for run in names if run in runs.events]
    return f"Overloads of the {sides[0]} side" if sides[0] else "Overloads"


@PICTURES.declare(lambda study: study.setup.statics.cycles, "torque_angle.png")
def _turn(study: StudyRecord) -> fig.Figure:
    """Torques and inertia over a turn at constant speed, by load case."""
    setup, driver, cycles = study.setup, study.setup.driver_noun, study.setup.statics.cycles
    torques: dict[str, Callable[[Cycle], Any]] = {driver: lambda c: c.crank_torque}
    organs = bool(setup.drive.machine.model.sides)
    if organs:
        torques["rocker"] = lambda c: c.outputs.rocker.tau
    items: dict[fig.Axis, list[fig.Item]] = {}
    for part, torque in torques.items():
        curves = items[fig.Axis(f"{part} torque", "N.m")] = []
        for look, (name, c) in enumerate(cycles.items()):
            y = np.broadcast_to(torque(c), c.angle.shape)
            curves.append(fig.Curve(name, np.append(c.angle, 2.0 * math.pi), np.append(y, y[0]), look))
    return fig.Figure(
        "turn",
        of_driver("Torque over {a driver} turn at constant speed", driver),
        f"{' and '.join(torques).capitalize()} torque over the {driver} angle: {', '.join(cycles)}.",
        fig.stacked(angle_axis(setup), items.items()),
        line(
            f"Inverse dynamics{' of two bars' * organs} at ",
            asked_speed(setup),
            f" of the {driver}, without a motor.",
        ),
    )


@PICTURES.declare(lambda study: run_names.has_steady_turns(study.runs), "power_turn.png")
def _power(study: StudyRecord) -> fig.Figure:
    """The power at crank and motor over the last turn of steady running."""
    drive, steady, driver = study.setup.drive, study.runs.steady, study.setup.driver_noun
    phi, speed = crank_motion(drive, steady)
    powers = {driver: crank_torque(drive, steady) * speed, "shaft of the motor": shaft_power(drive, steady)}
    if "motor.supply_power" in steady:
        powers["supply of the motor"] = steady["motor.supply_power"].values
    curves = [
        fig.Curve(name, *last_turn(phi, power), look) for look, (name, power) in enumerate(powers.items())
    ]
    axes = angle_axis(study.setup), fig.Axis("power", "W")
    panel = fig.Panel(*axes, (*curves, fig.Mark(0.0, axis="y", look="thin")))
    return fig.Figure(
        "power-turn",
        "Power over a turn in steady running",
        f"The power at {', '.join(powers)} over the {driver} angle in the last turn of steady running.",
        ((panel,),),
        "Below zero the machine gives power back.",
    )


@PICTURES.declare(lambda study: run_names.has_steady_turns(study.runs), "load_histogram.png")
def _load_histogram(study: StudyRecord) -> fig.Figure:
    """The share of the time in which the torque lies in each class: at the crank and, where it is known, in the air
    gap of the motor, which the inertia of its rotor and a flywheel make smoother."""
    steady, driver = study.runs.steady, study.setup.driver_noun
    torques = {f"{driver} torque": crank_torque(study.setup.drive, steady)}
    if "motor.air_gap_tau" in steady:
        torques["air-gap torque of the motor"] = steady["motor.air_gap_tau"].values
    panels = []
    for name, torque in torques.items():
        edges, shares = histogram(steady["time"].values, torque)
        average = fig.Mark(mean(steady, torque), "mean", look="mark")
        rms = fig.Mark(math.sqrt(mean(steady, torque**2)), "RMS", look="reference")
        bars = fig.Between(
            "", np.repeat(edges, 2)[1:-1], np.zeros(2 * len(shares)), np.repeat(shares, 2), "band"
        )
        y = fig.Axis("share of the time", "1", "percent", low=0.0, high=1.08 * float(np.max(shares)))
        panels.append(fig.Panel(fig.Axis(name, "N.m"), y, (bars, average, rms)))
    return fig.Figure(
        "load-histogram",
        "Histogram of the load in steady running",
        f"The share of the time in which the {' and the '.join(torques)} lies in each class.",
        (tuple(panels),),
        f"Classes of equal width, over whole turns of the {driver}. Between the {driver} and the air gap, rotor and "
        "flywheel store energy.",
    )


def histogram(time: np.ndarray, torque: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The edges of the classes [N m], shape (classes + 1,), and the share of the time in each; between two instants
    the torque counts as their mean."""
    middle, spans = 0.5 * (torque[1:] + torque[:-1]), np.diff(time)
    low, high = float(np.min(middle)), float(np.max(middle))
    wide = max(high - low, 1e-9 * max(abs(low), abs(high)), 1e-12)
    counts, edges = np.histogram(middle, _LOAD_CLASSES, (low, low + wide), weights=spans)
    return edges, counts / np.sum(counts)


@PICTURES.declare(
    lambda study: run_names.has_steady_turns(study.runs) and not study.setup.drive.foreign_machine,
    "force_over_stroke.png",
)
def _stroke(study: StudyRecord) -> Iterator[fig.Figure]:
    """The forces over the stroke in steady running and in each overload."""
    runs, drive = study.runs, study.setup.drive
    names = [name for name in run_names.motor_runs(runs) if run_names.event_time(runs, name) is not None]
    parts = {"steady": runs.steady} | {name: run_names.from_event(runs, name) for name in names}
    states = ((run_names.title(runs, name), machine_state(drive, part)) for name, part in parts.items())
    return machine_picture.force_over_stroke(states)


@PICTURES.declare(lambda study: study.setup.statics.loops, "speed_loop.png")
def _speed_loop(study: StudyRecord) -> fig.Figure:
    """Gain, phase and disturbance step of the speed loops, with crossover and phase margin of the narrowest one."""
    loops = study.setup.statics.loops
    narrowest = min(loops.values(), key=lambda loop: loop.phase_margin)

    def curves(abscissa: str, ordinate: str) -> Iterator[fig.Curve]:
        for look, (name, loop) in enumerate(loops.items()):
            yield fig.Curve(name, getattr(loop, abscissa), getattr(loop, ordinate), look)

    crossover = fig.Mark(narrowest.crossover, "crossover", look="mark")
    margin = f"margin {number_words(narrowest.phase_margin, 'deg')}"
    margin_label = fig.Label(narrowest.crossover, -180.0 + narrowest.phase_margin, margin, "left")
    gain_items: tuple[fig.Item, ...] = (
        *curves("frequency", "gain"),
        fig.Mark(1.0, axis="y", look="thin"),
        crossover,
    )
    limit = fig.Mark(-180.0, axis="y", look="thin")
    phase_items: tuple[fig.Item, ...] = *curves("frequency", "phase"), limit, crossover, margin_label
    ends = [loop.frequency[k] for loop in loops.values() for k in (0, -1)]
    frequency = fig.Axis("frequency", "rad/s", low=float(min(ends)), high=float(max(ends)), log=True)
    phase = fig.Axis("phase", "deg", low=-270.0, high=0.0, step=45.0)
    longest = 1.5 * max(loop.settling for loop in loops.values())
    time = fig.Axis("time after a step of the load torque", "s", low=0.0, high=longest)
    deviation = fig.Axis("speed deviation", "rad/(N.m.s)")
    panels = (
        fig.Panel(frequency, fig.Axis("gain of the open loop", log=True), gain_items, "Gain"),
        fig.Panel(frequency, phase, phase_items, "Phase"),
        fig.Panel(time, deviation, tuple(curves("time", "deviation")), "Disturbance step"),
    )

    return fig.Figure(
        "speed-loop",
        "The speed loop, linearised",
        "Gain and phase of the open speed loop over the frequency, and the deviation of the motor speed after a step "
        "of the load torque.",
        (panels,),
        heights=(1.4,),
    )


# -- over time


@PICTURES.declare(lambda study: "start_up" in study.runs.series, "start_up.png")
def _start_up(study: StudyRecord) -> fig.Figure:
    return _transient(study, "start_up")


@PICTURES.declare(lambda study: run_names.motor_runs(study.runs))
def _others(study: StudyRecord) -> Iterator[fig.Figure]:
    return (_transient(study, name) for name in run_names.motor_runs(study.runs) if name != "start_up")


@PICTURES.declare(lambda study: run_names.groups(study.runs, study.runs.overloads), "overload_time.png")
def _overloads(study: StudyRecord) -> fig.Figure:
    """The overloads beside each other, for print: a band of rows for each side, and the same scales in all panels."""
    setup, runs = study.setup, study.runs
    groups = [[_transient(study, name) for name in group] for group in run_names.groups(runs, runs.overloads)]
    rows: list[list[fig.Panel | None]] = []
    for group in groups:
        for k in range(min(3, *(len(figure.panels) for figure in group))):
            panels = ((figure, figure.panels[k][0]) for figure in group)
            rows.append(
                [panel and replace(panel, title="" if k else figure.title) for figure, panel in panels]
            )
    widest = max(map(len, rows))
    return fig.Figure(
        "overloads",
        "Overloads",
        f"{capital(setup.driver_noun)} torque, {setup.driver_noun} speed and motor current of every overload.",
        tuple((*row, *[None] * (widest - len(row))) for row in rows),
        level=True,
        on_page=False,
    )


def _transient(study: StudyRecord, name: str) -> fig.Figure:
    """Torque, speed and current of a run over time."""
    run, drive, event = study.runs.series[name], study.setup.drive, run_names.event_time(study.runs, name)
    time = run["time"].values - (event or 0.0)
    low, high = float(time[0]), float(time[-1])
    driver = drive.driver_noun
    of_torque, of_speed = fig.Axis(f"{driver} torque", "N.m"), fig.Axis(f"{driver} speed", "rad/s")
    speed: list[fig.Item] = [fig.Curve(of_speed.label, time, crank_speed(drive, run), in_legend=False)]
    items: dict[fig.Axis, list[fig.Item]] = {
        of_torque: [fig.Curve(of_torque.label, time, crank_torque(drive, run), in_legend=False)],
        of_speed: speed,
        **_current(drive, run, time),
    }
    if drive.line.part("driveline") is not None:
        items[TORQUE] = shaft_torque(run, time)
    if event is None and drive.follows:
        asked = study.setup.config.run.crank_speed
        reference = run["motor.w_ref"].values * (asked / drive.reference_speed(asked))
        speed.append(fig.Curve("speed asked for", time, reference, 1))
    coasting = study.runs.series.get(name + run_names.COASTING)
    if coasting is not None:
        behind, stands = _coasting(study.setup, coasting, event or 0.0)
        speed.append(behind)
        high = min(float(behind.x[-1]), 1.3 * max(high, high if stands is None else stands))
    if event is not None:
        # a quarter turn before the event shows enough of steady running
        before = 0.5 * math.pi / study.setup.config.run.crank_speed
        low = max(low, -before if coasting is None else -min(before, 0.5 * high))
    title = run_names.title(study.runs, name)
    return fig.Figure(
        f"time-{name.replace('_', '-')}",
        title,
        f"{capital(driver)} torque, {driver} speed and motor current over time: {title}."
        + ("" if event is None else " The event is marked by a dashed line; the loads change in the shade."),
        fig.stacked(
            fig.Axis("time" if event is None else "time after the event", "s", low=low, high=high),
            (
                (axis, (*curves, *_marks(study.runs, name, axis is of_torque)))
                for axis, curves in items.items()
            ),
        ),
        _after(study.runs, name) if event is not None else (),
        half=True,
    )


def _coasting(setup: StudySetup, run: Dataset, event: float) -> tuple[fig.Curve, float | None]:
    """The speed of the machine behind the open coupling, and the time from which on it stands [s]; None if it never
    turns."""
    time, speed = run["time"].values - event, crank_speed(setup.drive, run)
    turning = np.flatnonzero(np.abs(speed) > 0.02 * setup.config.run.crank_speed)
    curve = fig.Curve(f"{setup.driver_noun} behind the open coupling", time, speed, 1)
    return curve, float(time[turning[-1]]) if turning.size else None


def _current(drive: Drive, run: Any, time: Any) -> dict[fig.Axis, list[fig.Item]]:
    """The motor current, where the motor is not a foreign FMU, with its limit where the current passes half of it."""
    if drive.foreign is not None:
        return {}
    current, limit = run[f"motor.{drive.motor.current}"].values, drive.motor.current_limit(drive.parameters)
    items: list[fig.Item] = [fig.Curve(_CURRENT.label, time, current, in_legend=False)]
    if limit is not None and np.max(np.abs(current)) > 0.5 * limit:
        items.append(fig.Mark(limit, "current limit", axis="y", look="limit"))
    return {_CURRENT: items}


def _marks(runs: StudyRuns, name: str, labelled: bool) -> list[fig.Item]:
    """The marks in a panel of a run, with words if `labelled`: its event, with a shade while loads or supply change,
    or the begin of steady running in the start-up."""
    event = run_names.event_time(runs, name)
    if event is not None:
        changing = _load_change(runs.drive, runs.series[name])
        shade = [] if changing is None else [fig.Shade(changing[0] - event, changing[1] - event)]
        return [*shade, fig.Mark(0.0, words="event" if labelled else "")]
    if name == "start_up" and runs.answers:
        return [fig.Mark(runs.steady_begin, words="steady from here" if labelled else "")]
    return []


def _load_change(drive: Drive, run: Dataset) -> tuple[float, float] | None:
    """The first and the last instant at which a load of the machine or the supply of the motor changes [s]; None if
    neither does."""
    loads = (name for name in drive.machine.model.input_layout.names if name not in _MOTION)
    changes = np.zeros(len(run["time"]) - 1, bool)
    for name in (*(f"machine.{load}" for load in loads), "motor.voltage", "motor.contactor"):
        if name in run:
            changes |= np.diff(run[name].values) != 0.0
    places = np.flatnonzero(changes)
    if not places.size:
        return None
    time = run["time"].values
    return float(time[places[0]]), float(time[places[-1] + 1])


def _after(runs: StudyRuns, run: str) -> Line:
    """The sentence on the speed after the event."""
    caption: Line = "Upright, dashed: the event. Shaded: the loads change."
    if run not in runs.answers:
        return caption
    answers = cited(runs.answers[run], f"runs.answers.{run}")
    least, dip, recovery = map(number, (answers.speed_least, answers.speed_dip, answers.recovery_time))
    if dip.value is None or dip.value <= 0.0:
        caption = filled("{} The least speed is {}", caption, least)
    elif not forms(dip.value, "1", "dip")[0][1]:
        # a dip so large is shown as words in place of a number
        caption = filled(f"{{}} The {runs.drive.driver_noun} {{}}", caption, dip)
    else:
        caption = filled("{} The speed dips by {}", caption, dip)
    if not runs.returns:
        back: Line = "; the motor does not reach the speed asked for, so that there is no band to return to."
    elif recovery.value is None:
        back = "; it does not return to its steady band within the time followed."
    elif recovery.value == 0.0:
        back = "; it does not leave its steady band."
    else:
        back = filled("; it is back in its steady band after {}.", recovery)
    return line(caption, back, _assumed(runs, run) if run in runs.spreads else ())


def _assumed(runs: StudyRuns, run: str) -> Line:
    """The ranges that an event assumes, and the torque of the driver over them."""
    sizes = cited(assumed_ranges(runs, run), f"runs.block_peaks.{run}")
    ranges = {
        name: filled("{} to {}", *(number(sizes[f"{name}_{end}"]) for end in ("low", "high")))
        for name in (*runs.spreads[run].ranges, *runs.spreads[run].peaks)
    }
    assumptions = join(filled("{} {}", name, ranges[name]) for name in runs.spreads[run].ranges)
    peaks = f" Assumed: {{}}; the {runs.drive.driver_noun} torque peaks at {{}}."
    return filled(peaks, assumptions, ranges["crank_torque"])


@PICTURES.declare(lambda study: study.runs.pins, "reactions.png")
def _reactions(study: StudyRecord) -> fig.Figure:
    """Bars of the forces in each bearing: peak and RMS in one run, and the largest peak of all runs."""
    reference = "steady" if "steady" in study.runs.pins else next(iter(study.runs.pins))
    steady, pins = study.runs.pins[reference], list(study.runs.pins[reference])
    largest = {pin: hardest_run(study.runs.pins, pin) for pin in pins}
    of_run, driver = run_names.title(study.runs, reference), study.setup.driver_noun
    places = np.arange(len(pins), dtype=float)
    peaks, rms = ([steady[pin][size] for pin in pins] for size in ("peak", "rms"))
    bars = [
        fig.Bars(f"{of_run}: peak", places - 0.2, peaks, 0.38, 0),
        fig.Bars(f"{of_run}: RMS", places - 0.2, rms, 0.14, 0, slim=True),
    ]
    if len(study.runs.pins) > 1:
        titles = tuple(study.runs.title_of(largest[pin]) for pin in pins)
        peaks = [study.runs.pins[largest[pin]][pin]["peak"] for pin in pins]
        bars.append(fig.Bars("largest peak of all runs", places + 0.2, peaks, 0.38, 1, words=titles))
    most = max(size or 0.0 for sizes in (peaks, rms) for size in sizes)
    # beside the bars there is room for the names of runs
    x = fig.Axis("reaction", "N", low=0.0, high=(1.6 if len(study.runs.pins) > 1 else 1.05) * most or None)
    return fig.Figure(
        "reactions",
        "Forces in the pins",
        "Bars of the reaction of every pin: peak and RMS in steady running, and the largest peak of all runs.",
        ((fig.Panel(x, fig.Axis("pin", names=tuple(pins)), tuple(bars)),),),
        f"RMS is taken over whole {driver} turns of {of_run}. Beside a bar: the run of the largest peak.",
        heights=(max(0.6, 38.0 * len(pins) / 250.0),),
    )
