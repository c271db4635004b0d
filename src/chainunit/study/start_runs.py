"""Runs of starts from several crank angles: the load of a machine depends on its angle, and so do the torque and the
time of a start."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace

import numpy as np

from ..core.quantities import Value, declaration, percentage, quantity
from ..system import run_together
from ..system.certificate import torque_names
from .arrays import Dataset, peak
from .drive import Drive
from .event import Event
from .measures import STARTED, time_to_start
from .relay import class_holding, start_seconds
from .rig import Rig, join
from .torques import CURVE, PeakOf, at_gear, on_coupling, quasi_static_peak

START_ANGLES = 8
"""Number of crank angles, evenly over the turn, from which the machine is started."""
_STEP = 1e-3
"""Longest step of a start [s]: the first swings have the frequency of the supply, and a coarser one misses peaks."""
OVERLOADED = 60.0
"""Time for which an inverter carries more than its rated current [s]."""
BACKWARDS = 0.02
"""Speed backwards in a start by an inverter after a speed forwards, over the synchronous one, from which on the motor
hunts: it does not follow the frequency."""
_AFTER = 0.25
"""Time for which a start is followed once the crank has its speed [s]: the motor overshoots and settles."""


@declaration
class StartNumbers:
    """A start from rest."""

    angle: Value = quantity("rad", "{driver} angle from which it starts")
    quasi_static: Value = quantity("N.m", "largest torque at the output of the gear by load and acceleration")
    gear_torque: Value = quantity(
        "N.m", "the same with the electromagnetic transient of the motor, for some milliseconds"
    )
    coupling_torque: Value = quantity(
        "N.m", "largest torque on a coupling on the motor's shaft by load and acceleration, at the {driver}"
    )
    coupling_transient: Value = quantity(
        "N.m", "the same with the electromagnetic transient, at the {driver}"
    )
    start_time: Value = quantity("s", "start-up time")
    start_class: Value = quantity(
        "1", "trip class of the overload relay that holds; 40: none up to class 30; none for an inverter"
    )
    relay_seconds: Value = quantity(
        "s", "the start as time at 7.2 times the rated current of the motor; none for an inverter"
    )
    current: Value = quantity("A", "largest current of the motor")
    long_current: Value = quantity("A", "current that is exceeded for 60 s in all; 0 in a shorter start")
    time_above: Value = quantity("s", "time above the rated current of the motor, as long as it is followed")
    heat: Value = quantity("J", "heat of the winding until shortly after the start")
    followed: Value = quantity("s", "time of that heat")
    star_speed: Value = percentage(
        "speed of the motor at the end of its time in star, over the synchronous one; none for another start"
    )
    backwards: Value = percentage(
        "largest speed of the motor backwards once it has turned forwards, over the synchronous one",
        default=0.0,
    )


def from_angle(rig: Rig, angle: float) -> Rig:
    """The rig whose crank stands at that angle [rad] at the start, without an observer."""
    drive, turned = rig.drive, angle * rig.drive.ratio
    parameters = replace(drive.parameters, phi_start=drive.parameters.phi_start + turned)
    drive = replace(drive, parameters=parameters, line=drive.line.turned(turned), observer=None, observed={})
    return replace(rig, drive=drive, fed_from=None)


def start_from(
    rig: Rig,
    angle: float,
    longest: float,
    event: Event | None = None,
    peak_of: PeakOf = on_coupling,
    before: float = 0.0,
) -> StartNumbers:
    """A start from the crank angle [rad], with the `event` of a start, if one is given.

    It is followed until the crank has its speed and a little longer, at most to the time `longest` [s]; `start_time`
    is None where the crank comes to no lasting speed by then, by the rule of `time_to_start`. `peak_of` gives the
    torque on the coupling, which accelerates the inertia `before` the machine, too, see `quasi_static_torque`."""
    return _starts_from([from_angle(rig, angle)], [angle], longest, event, peak_of, before)[0]


def _starts_from(
    rigs: Sequence[Rig],
    angles: Sequence[float],
    longest: float,
    event: Event | None,
    peak_of: PeakOf,
    before: float,
) -> list[StartNumbers]:
    """The starts of rigs that differ in the angle [rad] alone; see `start_from`."""
    drive, operation, step = rigs[0].drive, rigs[0].operation, min(rigs[0].step, _STEP)
    name, ratio = drive.crank_output("w")
    goal = STARTED * operation.crank_speed * ratio
    with ExitStack() as stack:
        simulations = [stack.enter_context(rig.from_rest(event)) for rig in rigs]
        names = _read(rigs[0])
        runs = run_together(simulations, [longest] * len(rigs), step, names=names, guards={name: goal})
        reached = [
            float(simulation.time) if float(run[name][-1]) >= (1.0 - 1e-9) * goal else None
            for simulation, run in zip(simulations, runs, strict=True)
        ]
        # the change from star to delta is a part of the start
        ends = {k: max(t, drive.star.end) + _AFTER for k, t in enumerate(reached) if t is not None}
        later = run_together([simulations[k] for k in ends], list(ends.values()), step, names=names)
    for k, run in zip(ends, later, strict=True):
        runs[k] = join([runs[k], run])
    for k, run in enumerate(runs):
        if k not in ends:
            # it may have settled at another speed: then it has started, as in the start-up of a study
            time, speed = run["time"].values, run[name].values / ratio
            final = float(np.mean(speed[time >= time[-1] - operation.turn]))
            reached[k] = time_to_start(time, speed, final, operation.crank_speed)
    starts = [
        _numbers(rigs[k].drive, angles[k], runs[k], reached[k], peak_of, before) for k in range(len(rigs))
    ]
    # a load that blocks a start may throw the motor back
    return starts if event is None else [replace(start, backwards=0.0) for start in starts]


def _read(rig: Rig) -> list[str]:
    """The outputs that the numbers of a start and the peak of any torque of `PeakOf` follow from."""
    drive = rig.drive
    motor = [f"motor.{name}" for name in ("tau", "w", "a", "heat", drive.motor.current)]
    # a flywheel between gear and machine has the torque of the gear
    wheel = ["flywheel.tau"] if drive.geared_line.part("flywheel") else []
    torques = *torque_names(drive.machine_bond), *wheel
    names = dict.fromkeys([drive.crank_output("w")[0], *motor, *CURVE, *torques])
    return [full for full in names if rig.gives(full)]


def _numbers(
    drive: Drive, angle: float, run: Dataset, reached: float | None, peak_of: PeakOf, before: float
) -> StartNumbers:
    """The numbers of a start that has `reached` its speed at that time [s]."""
    time, current = run["time"].values, np.abs(run[f"motor.{drive.motor.current}"].values)
    relay, seconds, rated = None, None, drive.rated_current
    if reached is not None and rated is not None and not drive.follows:
        starting = time <= max(reached, drive.star.end)
        seconds = start_seconds(time[starting], drive.star.winding_current(time, current)[starting], rated)
        relay = class_holding(seconds)
    return StartNumbers(
        angle=angle,
        quasi_static=quasi_static_peak(drive, run),
        gear_torque=at_gear(drive, run),
        coupling_torque=quasi_static_peak(drive, run, peak_of, before),
        coupling_transient=peak_of(drive, run),
        start_time=reached,
        start_class=relay,
        relay_seconds=seconds,
        current=peak(current),
        long_current=exceeded_for(time, current, OVERLOADED),
        time_above=0.0 if rated is None else time_above(time, current, rated),
        heat=float(np.trapezoid(run["motor.heat"].values, time)),
        followed=float(time[-1]),
        star_speed=speed_in_star(drive, run),
        backwards=speed_backwards(drive, run),
    )


def speed_backwards(drive: Drive, run: Dataset) -> float:
    """The largest speed of an induction motor backwards in a run, over the synchronous one, once it has turned
    forwards; 0 if it never turns back. A load that turns a motor back at first does not count."""
    share = run["motor.w"].values / _synchronous(drive)
    forwards = np.flatnonzero(share > BACKWARDS)
    return max(0.0, -float(np.min(share[forwards[0] :]))) if forwards.size else 0.0


def _synchronous(drive: Drive) -> float:
    """The synchronous speed at the frequency of the supply [rad/s]."""
    p = drive.fmu_parameters
    return float(2.0 * math.pi * p.supply.f / p.pole_pairs)


def speed_in_star(drive: Drive, run: Dataset) -> float | None:
    """The speed of the motor at the end of its time in star in a run from rest, over the synchronous one; None for
    another start."""
    if not drive.star:
        return None
    return float(np.interp(drive.star.time, run["time"].values, run["motor.w"].values)) / _synchronous(drive)


def exceeded_for(time: np.ndarray, current: np.ndarray, longest: float) -> float:
    """The least current [A] that is exceeded for no longer than `longest` [s] in all; 0 for a shorter record.

    Parameters
    ----------
    time, current : times [s] and sizes of the current [A] there, shape (rows,)
    """
    means, spans = 0.5 * (current[1:] + current[:-1]), np.diff(time)
    order = np.argsort(means)[::-1]
    above = np.cumsum(spans[order])
    first = int(np.searchsorted(above, longest, side="right"))
    return float(means[order[first]]) if first < len(order) else 0.0


def time_above(time: np.ndarray, current: np.ndarray, level: float) -> float:
    """The time [s] for which the current is above the `level` [A]; arguments as of `exceeded_for`."""
    return float(np.sum(np.diff(time)[0.5 * (current[1:] + current[:-1]) > level]))


def longest_start(ramp_end: float, start_time: float) -> float:
    """Time after which a start counts as failed [s], where the ramp ends at `ramp_end` [s] and the start from the
    first angle takes `start_time` [s]."""
    return float(max(ramp_end, 3.0 * start_time) + 1.0)


def starts_from_all(
    rig: Rig,
    longest: float,
    events: Sequence[Event] = (),
    peak_of: PeakOf = on_coupling,
    before: float = 0.0,
) -> list[StartNumbers]:
    """Starts from `START_ANGLES` angles over the turn; each of the `events`, which are starts, from the angle 0. For
    `peak_of` and `before` see `start_from`."""
    angles = [2.0 * math.pi * k / START_ANGLES for k in range(START_ANGLES)]
    starts = _starts_from(
        [from_angle(rig, angle) for angle in angles], angles, longest, None, peak_of, before
    )
    return starts + [start_from(rig, 0.0, longest, event, peak_of, before) for event in events]


def longest_of(starts: Sequence[StartNumbers]) -> float | None:
    """The longest start-up [s]; None where one of the starts does not come to its speed."""
    times = [start.start_time for start in starts]
    return None if None in times else max(times)


def hardest(starts: Sequence[StartNumbers]) -> float:
    """The largest torque on the coupling by load and acceleration, at the crank [N m]."""
    return max(start.coupling_torque for start in starts)
