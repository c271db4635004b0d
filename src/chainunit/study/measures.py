"""The measures of a run: each is declared once, with the function that reads it from a `Window`."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..core.quantities import Layout, Value, Variable, declaration, quantity
from .arrays import Dataset, peak
from .drive import AbsentError, Drive
from .limits import reaches
from .readings import (
    crank_speed,
    crank_torque,
    energy_gap,
    energy_held,
    largest_torque,
    shaft_power,
    stored_shares,
)
from .relay import lasting_current, relay_trip
from .verdict import CREEPS
from .window import Phase, Window, drift, end_gap

STARTED = 0.95
"""Share of the speed at which a start ends, see `time_to_start`."""

Reader = Callable[[Window], float | None]
_ALL = frozenset(Phase)
_RUNNING = _ALL - {Phase.START_UP, Phase.SETTLING}
_STEADY = frozenset({Phase.STEADY})
_EVENTS = frozenset({Phase.EVENT, Phase.LOADED_START})
# a start begins at rest, and for a moment its motor gives more torque than it ever does in running
_AT_SPEED = frozenset({Phase.STEADY, Phase.EVENT})


def stall(time: Any, speed: Any, requested: float) -> float | None:
    """Time [s] from which the speed stays below a tenth of the `requested` speed until the end of the run; None where
    it does not, or only in the last tenth of the run."""
    below = np.abs(np.asarray(speed)) < 0.1 * requested
    if not below[-1]:
        return None
    moving = np.flatnonzero(~below)
    first = int(moving[-1]) + 1 if moving.size else 0
    return float(time[first]) if first < 0.9 * len(below) else None


def torque_reserve(limit: Any, torque: Any) -> float:
    """Least reserve of torque in a run: the minimum over time of (limit - |torque|)/limit. Both arguments are
    of the motor [N m], shape (time,).

    The reserve is 0 where the motor gives all the torque that it can, and negative where a transient exceeds
    that. Its lower bound is -1, for a torque of twice the limit or more, or a limit of 0.
    """
    limit, torque = np.asarray(limit), np.abs(torque)
    free = limit - torque
    whole = np.maximum(np.maximum(limit, -free), 1e-12)
    return float(np.min(free / whole))


def _reserve(w: Window) -> float:
    """The least reserve of torque in a window, see `torque_reserve`."""
    # in a dip the remaining field brakes for a moment, which is no lack of torque
    driving = np.maximum(w.value("motor.air_gap_tau") * np.sign(w.value("motor.w")), 0.0)
    if w.drive.follows and (w.steady or w).speed_mean < 0.99 * w.requested_speed:
        # a controlled motor that falls behind gives all the torque that it can
        return 0.0
    limit = largest_torque(w.drive, w.run, w.warm)
    if "motor.contactor" in w.run:
        # a motor that is cut off is asked for no torque
        closed = w.value("motor.contactor") == 1.0
        limit, driving = limit[closed], driving[closed]
    return torque_reserve(limit, driving)


def _recovery(w: Window) -> float | None:
    """Time after the event from which the speed stays in the band of steady running, widened by 0.5 %; None
    if it does not return before the end of the run, or only at the very end."""
    assert w.steady is not None
    if w.drive.follows and not reaches(w.steady.speed_mean, w.requested_speed):
        return None
    steady, since, widening = w.steady.speed, w.since, 0.005 * w.normal_speed
    outside = (w.speed < np.min(steady) - widening) | (w.speed > np.max(steady) + widening)
    if not outside.any():
        return 0.0
    last = int(np.flatnonzero(outside)[-1])
    return float(since[last]) if last < len(since) - len(since) // 10 else None


def _relay(w: Window) -> float | None:
    """Time after the event [s] at which the slowest thermal relay of the class of the study trips, set to the rated
    current of the motor; None where it does not, or no rated current is known. None, too, after the coupling opened,
    as no load is left that could trip the relay."""
    setting = w.drive.rated_current
    if setting is None or w.trip is not None:
        return None
    assert w.steady is not None
    current = w.value(w.current)
    if w.phase is Phase.LOADED_START:
        current = w.drive.star.winding_current(w.since, current)
    steady_current = w.steady.rms(w.current)
    # an event that passes, and does not stall the motor, leads back to steady running
    afterwards = lasting_current(current, steady_current if w.passes and _stall(w) is None else None)
    return relay_trip(w.since, current, setting, steady_current, afterwards, w.relay_class)


def _stall(w: Window) -> float | None:
    """Time after an overload from which the crank stands [s], or None."""
    return stall(w.since, w.speed, w.normal_speed)


def _slack_time(w: Window) -> float | None:
    """Share of the time in which at least one rod of a chain is slack."""
    if "machine.left.slack_share" not in w.run:
        return None

    def some_slack(drive: Drive, run: Dataset) -> Any:
        shares = [run[f"machine.{side}.slack_share"].values for side in w.sides]
        return (np.max(shares, axis=0) > 0.0).astype(float) if shares else np.zeros(run.sizes["time"])

    return w.mean(some_slack)


def _fold(w: Window) -> float | None:
    """Largest angle between two rods of a chain [rad]; None without chains."""
    if "machine.left.fold_largest" not in w.run:
        return None
    return max((float(np.max(w.value(f"machine.{side}.fold_largest"))) for side in w.sides), default=0.0)


def _of_width(*outputs: str) -> Reader:
    """The reader of the largest size of outputs that only a machine with a width has."""
    names = [f"machine.{name}" for name in outputs]
    return lambda w: peak(np.linalg.norm([w.value(x) for x in names], axis=0)) if names[0] in w.run else None


def time_to_start(time: Any, speed: Any, final: float, requested: float) -> float | None:
    """Time at which a shaft first turns at the share `STARTED` of the `requested` speed or, if it settles at
    another speed, of that one; None where it never does. A shaft that stands or creeps at the end may have
    started before: then it stalled under its load.

    Parameters
    ----------
    time, speed : time [s] and speed [rad/s] in the run, shape (time,)
    final : mean speed of steady running [rad/s]
    requested : requested speed [rad/s]
    """
    misses = CREEPS * requested < final and not reaches(final, requested)
    at_speed = np.flatnonzero(np.asarray(speed) >= STARTED * (final if misses else requested))
    return float(time[at_speed[0]]) if at_speed.size else None


def _start_time(w: Window) -> float | None:
    final = w.requested_speed if w.steady is None else w.steady.speed_mean
    return time_to_start(w.since, w.speed, final, w.requested_speed)


def _lent(w: Window) -> tuple[float | None, float | None]:
    """See `stored_shares`; None of a machine that does not cut."""
    if "machine.blade.cut_fx" not in w.run:
        return None, None
    return stored_shares(w.turns, energy_held(w.drive, w.turns))


def _standstill(w: Window) -> float | None:
    """Time after the event at which the machine behind an open coupling stands still."""
    run = w.coasting
    if run is None:
        return None
    still = np.flatnonzero(np.abs(crank_speed(w.drive, run)) < 0.01 * w.requested_speed)
    return float(run["time"][still[0]]) - w.begin if still.size else None


@dataclass(frozen=True)
class Measure:
    """How a measure is read, in which runs it has a meaning, and how it is shown. The measures with the same
    subject `of` are a family. A family whose first measure is on a `card` is shown large. A `minor` measure
    is left out where there is little room."""

    reader: Reader
    during: frozenset[Phase]
    words: str
    of: str = ""
    card: bool = False
    minor: bool = False


def measure(
    unit: str,
    phrase: str,
    reader: Reader,
    *,
    of: str = "",
    kind: str = "",
    during: frozenset[Phase] = _RUNNING,
    card: bool = False,
    minor: bool = False,
) -> Any:
    """A field that declares a `Measure`, as `quantity` does; its description is the subject `of` and the `phrase`."""
    own_field = quantity(unit, f"{of}, {phrase}" if of else phrase, kind=kind)
    declared = Measure(reader, during, phrase, of or phrase, card, minor)
    return dataclasses.field(metadata={**own_field.metadata, "measure": declared})


@declaration
class Answers:
    """The demands of a run on the drive. Torques and speeds are the crank's unless they are called the motor's. Means
    and RMS of steady running are over the time of whole turns of the crank, the turns in `load_cycle.csv`; those of
    an event are over all the time that it is followed, as its peaks are. Times count from the event.

    - ripple: (largest - least)/mean of the speed
    - `power_peak`: the largest power that the motor gives, 0 where it only brakes
    - `shaft_share`: the peak torque on the machine's shaft over that of the motor (the rest is the rotor's inertia)
    - `start_time`: see `time_to_start`
    - `shaking_*`: the largest deviation of the frame's load from its mean, the moment about C
    - `torque_reserve`: the least remaining share of the driving torque that the warm motor can give at an instant, at
      its speed, voltage and frequency: 0 at the limit, negative where a transient exceeds it, None in a start
    - `winding_temperature`: the final temperature of the winding if the steady turns go on for ever
    - `power_mean`, `supply_power_mean` of steady running: without the power that the moving masses take up, where the
      turns have not settled; None where the turns are so far from steady that no mean stands for running that lasts,
      see `Window.lasts`, and so the `winding_temperature`
    - `energy_gap`: the energy that the moving masses take up over the steady turns, over the energy that passes the
      motor's shaft to and fro
    - `cycle_gap`: the difference between the ends of the steady turns, of speed or torque, over the largest value
    - `speed_drift`: the change of the speed between these ends over its ripple, 0 where it hardly changes
    - `energy_after_trip`: the energy that passes the torque limiter while it opens
    - `energy_behind`: the energy that stays in the machine behind the coupling
    """

    crank_torque_peak: Value = measure(
        "N.m", "peak", lambda w: peak(w.crank_torque), during=_ALL, of="{driver} torque", card=True
    )
    crank_torque_rms: Value = measure("N.m", "RMS", lambda w: w.rms(crank_torque), of="{driver} torque")
    crank_torque_mean: Value = measure(
        "N.m", "mean", lambda w: w.mean(crank_torque), of="{driver} torque", minor=True
    )
    motor_torque_peak: Value = measure(
        "N.m",
        "peak",
        lambda w: w.largest("motor.air_gap_tau"),
        during=_ALL,
        of="motor air-gap torque",
        card=True,
    )
    motor_torque_rms: Value = measure(
        "N.m", "RMS", lambda w: w.rms("motor.air_gap_tau"), of="motor air-gap torque"
    )
    power_peak: Value = measure(
        "W",
        "peak",
        lambda w: max(0.0, float(np.max(shaft_power(w.drive, w.run)))),
        of="shaft power",
        card=True,
    )
    power_mean: Value = measure(
        "W",
        "mean",
        lambda w: w.mean(shaft_power) - w.taken_up[0] if w.lasts else None,
        of="shaft power",
        minor=True,
    )
    supply_power_mean: Value = measure(
        "W",
        "mean",
        lambda w: w.mean("motor.supply_power") - w.taken_up[1] if w.lasts else None,
        of="electric power",
        minor=True,
    )
    current_peak: Value = measure(
        "A", "peak", lambda w: w.largest(w.current), during=_ALL, of="motor current", card=True
    )
    current_rms: Value = measure("A", "RMS", lambda w: w.rms(w.current), of="motor current")
    current_share: Value = measure(
        "1",
        "RMS current over rated current",
        lambda w: None if w.drive.rated_current is None else w.rms(w.current) / w.drive.rated_current,
        kind="percent",
        during=_STEADY,
    )
    winding_temperature: Value = measure(
        "K",
        "thermal steady state",
        lambda w: w.settled_temperature if w.lasts else None,
        during=_STEADY,
        of="winding temperature",
        card=True,
        minor=True,
    )
    rocker_torque_peak: Value = measure(
        "N.m", "peak", lambda w: w.largest("machine.rocker.tau"), during=_ALL, of="rocker torque"
    )
    speed_mean: Value = measure(
        "rad/s", "mean", lambda w: w.speed_mean, kind="speed", of="{driver} speed", minor=True
    )
    speed_least: Value = measure(
        "rad/s", "least", lambda w: float(np.min(w.speed)), kind="speed", of="{driver} speed", minor=True
    )
    start_time: Value = measure(
        "s", "start-up time", _start_time, during=frozenset({Phase.START_UP, Phase.LOADED_START})
    )
    speed_ripple: Value = measure(
        "1",
        "speed ripple",
        lambda w: float(np.ptp(w.speed)) / max(abs(w.speed_mean), 1e-9),
        kind="percent",
        during=_STEADY,
    )
    cycle_gap: Value = measure(
        "1",
        "gap between the ends of the steady turns",
        lambda w: end_gap(w.drive, w.turns),
        kind="percent",
        during=_STEADY,
        minor=True,
    )
    speed_drift: Value = measure(
        "1",
        "speed drift, share of the ripple",
        lambda w: drift(w.drive, w.turns),
        kind="percent",
        during=_STEADY,
        minor=True,
    )
    energy_gap: Value = measure(
        "1",
        "energy that the masses take up, share of the energy that passes",
        lambda w: energy_gap(w.drive, w.turns),
        kind="percent",
        during=_STEADY,
        minor=True,
    )
    speed_dip: Value = measure(
        "1",
        "speed dip",
        lambda w: float((w.normal_speed - np.min(w.speed)) / w.normal_speed),
        kind="dip",
        during=_AT_SPEED,
    )
    recovery_time: Value = measure("s", "recovery", _recovery, during=_EVENTS)
    web_pull_least: Value = measure("N", "web end pull, least", lambda w: w.least_pull("web"), during=_ALL)
    wall_pull_least: Value = measure("N", "wall end pull, least", lambda w: w.least_pull("wall"), during=_ALL)
    slack_time: Value = measure(
        "1", "share of the time with a slack rod", _slack_time, kind="percent", during=_ALL
    )
    fold_largest: Value = measure("rad", "largest angle between two rods", _fold, during=_ALL)
    front_pivot_peak: Value = measure(
        "N", "front, peak", _of_width("front.pivot.fx", "front.pivot.fy"), during=_ALL, of="rocker pivot"
    )
    back_pivot_peak: Value = measure(
        "N", "back, peak", _of_width("back.pivot.fx", "back.pivot.fy"), during=_ALL, of="rocker pivot"
    )
    bar_stress_peak: Value = measure(
        "N/m2", "stress in the bar, peak", _of_width("bar.stress"), during=_ALL, kind="stress"
    )
    shaft_share: Value = measure(
        "1",
        "shaft/motor peak torque",
        lambda w: w.largest("motor.tau") / w.largest("motor.air_gap_tau"),
        kind="percent",
    )
    stored_share: Value = measure(
        "1",
        "share of a cut's work from flywheel and moving masses, over the cut",
        lambda w: _lent(w)[0],
        kind="percent",
        during=_STEADY,
    )
    stored_share_most: Value = measure(
        "1",
        "the same, from the beginning of the cut to their least energy",
        lambda w: _lent(w)[1],
        kind="percent",
        during=_STEADY,
    )
    shaking_force: Value = measure(
        "N", "shaking force", lambda w: w.swing("machine.frame.fx", "machine.frame.fy")
    )
    shaking_moment: Value = measure("N.m", "shaking moment", lambda w: w.swing("machine.frame.moment"))
    torque_reserve: Value = measure("1", "reserve of torque", _reserve, kind="percent", during=_AT_SPEED)
    stall_time: Value = measure("s", "{driver} stands after", _stall, during=_EVENTS)
    thermal_trip_time: Value = measure(
        "s", "thermal relay trips after, at the latest", _relay, during=_EVENTS
    )
    coupling_trip_time: Value = measure(
        "s", "torque limiter trips after", lambda w: w.trip.time - w.begin if w.trip else None, during=_EVENTS
    )
    energy_after_trip: Value = measure(
        "J", "energy after the trip", lambda w: w.trip.energy if w.trip else None, during=_EVENTS
    )
    energy_behind: Value = measure(
        "J",
        "energy behind it",
        lambda w: None if w.coasting is None else float(w.coasting["machine.kinetic_energy"][0]),
        during=_EVENTS,
    )
    standstill_time: Value = measure("s", "machine stands after", _standstill, during=_EVENTS)


MEASURES: Mapping[str, Measure] = {
    entry.name: entry.metadata["measure"] for entry in dataclasses.fields(Answers)
}
"""The measures by the names of their fields."""


def same_measure(name: str) -> Any:
    """A field that declares the measure of that name in another declaration."""
    (own_field,) = (entry for entry in dataclasses.fields(Answers) if entry.name == name)
    return dataclasses.field(metadata=own_field.metadata)


def read_answers(window: Window) -> Answers:
    """All measures of a window; a measure is None where it has no meaning in this run or no value."""
    return Answers(
        **{
            name: read_measure(name, window) if window.phase in entry.during else None
            for name, entry in MEASURES.items()
        }
    )


def not_known(window: Window) -> dict[str, str]:
    """The measures of a window that cannot be read, by name, each with the part (motor or machine) that lacks
    a variable."""
    parts = {}
    for name, entry in MEASURES.items():
        if window.phase in entry.during:
            try:
                entry.reader(window)
            except AbsentError as absent:
                parts[name] = absent.part
    return parts


def read_measure(name: str, window: Window) -> Any:
    """One measure of a window; None where it has no value."""
    try:
        return MEASURES[name].reader(window)
    except AbsentError:
        return None


def measures_of(phase: Phase) -> tuple[Variable, ...]:
    """The measures that have a meaning in a run of that phase."""
    return tuple(v for v in Layout(Answers).variables if phase in MEASURES[v.name].during)
