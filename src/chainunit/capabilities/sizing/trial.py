"""A motor on trial: the share of each limit that its runs with the machine use."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ...core.engines import MATH
from ...drives.catalogue import CatalogueMotor
from ...drives.induction_steady import volts_per_hertz
from ...drives.motor import T_RATED
from ...machines.chain_unit import SideName
from ...study.arrays import Dataset, peak
from ...study.drive import Drive
from ...study.events import one_sided_event
from ...study.inverter import need_of
from ...study.limits import Check, heating, keeping_speed, starting
from ...study.measures import time_to_start
from ...study.permitted_starts import permitted_starts, starting_data
from ...study.proposal import DutyPeak
from ...study.readings import crank_angle, load_inertia, motor_run_up, turns_made
from ...study.relay import start_seconds
from ...study.rig import Rig, join
from ...study.start_runs import (
    BACKWARDS,
    OVERLOADED,
    StartNumbers,
    exceeded_for,
    longest_of,
    longest_start,
    speed_backwards,
    starts_from_all,
)
from ...study.start_up import speeds_up, until_settled
from ...study.torques import all_feed_on, at_gear, duty_peak, quasi_static_peak
from ...study.transients import follow
from ...study.verdict import CREEPS, SETTLING, STEADY
from ...study.window import BURNT
from .candidate import TrialResult
from .duty import Duty, rms
from .gear_rows import gear_checks
from .table import Sizing
from .task import SizingTask

_GAP = "motor.air_gap_tau"
_LATE = 1.5
"""Time after which the start of a trial is not awaited any more, in parts of the permitted one."""
_STANDS = 0.25
"""Turns that a crank which stands, and swings against its load, makes in a run at most."""


@dataclass(frozen=True)
class Trial:
    """Runs of a motor from the catalogue in a `drive`: a start, steady running, and steady running with all
    feed on each side. The runs `shifts` are between these, each with its name: in them the feed comes or moves and
    the motor settles."""

    task: SizingTask
    motor: CatalogueMotor
    drive: Drive
    heavier: SideName | None
    start: Dataset
    steady: Dataset
    shifts: tuple[tuple[str, Dataset], ...]
    one_sided: Mapping[SideName, Dataset]
    starts: Sequence[StartNumbers] = ()
    """starts from all crank angles; none where the start from the angle 0 stands for them"""

    @cached_property
    def start_time(self) -> float | None:
        """Longest time to start [s]; None where the motor does not bring the machine up to speed."""
        if self._first is None or not self.starts:
            return self._first
        others = longest_of(self.starts)
        return None if others is None else max(self._first, others)

    @cached_property
    def _from_rest(self) -> Dataset:
        """The run from rest to the end of steady running: a start may end while the motor settles."""
        settling = [run for name, run in self.shifts if name == SETTLING]
        return join([self.start, *settling, self.steady])

    @cached_property
    def _first(self) -> float | None:
        """Time of the start from the angle 0 [s]; None where it fails."""
        requested = self.task.operation.crank_speed * self.drive.ratio
        if self.speed_behind <= CREEPS * requested or speeds_up(
            Rig(self.task.operation, self.drive, None), self.steady
        ):
            return None
        time, speed = self._from_rest["time"].values, self._speed_behind(self._from_rest)
        return time_to_start(time, speed, self.speed_behind, requested)

    @cached_property
    def stall_angle(self) -> float | None:
        """Crank angle at which the load stalls the motor [rad]; None for a motor that starts, or that only turns too
        slowly."""
        if self.start_time is not None or turns_made(self.drive, self.steady) > _STANDS:
            return None
        return float(np.max(crank_angle(self.drive, self.steady))) % (2.0 * math.pi)

    @property
    def failed_angle(self) -> float | None:
        """Crank angle from which the motor does not bring the machine up to speed [rad], though it does from the
        angle 0; else None."""
        if self._first is None:
            return None
        return next((start.angle for start in self.starts if start.start_time is None), None)

    @cached_property
    def relay_seconds(self) -> float | None:
        """The hardest start as time at 7.2 times the rated current [s], see `chainunit.study.relay.start_seconds`;
        None for an inverter, or without a start."""
        if self._first is None or self.start_time is None or self.drive.follows:
            return None
        rise = self._from_rest.sel(time=slice(None, max(self._first, self.drive.star.end)))
        time, current = (rise[name].values for name in ("time", f"motor.{self.drive.motor.current}"))
        current = self.drive.star.winding_current(time, current)
        first = start_seconds(time, current, self.motor.nameplate.rated_current)
        return max(first, *(start.relay_seconds for start in self.starts), 0.0)

    @cached_property
    def backwards(self) -> float:
        """Largest speed backwards in a start by an inverter, over the synchronous one; 0 on the line."""
        if not self.drive.follows:
            return 0.0
        return max(speed_backwards(self.drive, self.start), *(start.backwards for start in self.starts), 0.0)

    @cached_property
    def start_current(self) -> float | None:
        """Largest current in a start [A]; None without a start."""
        if self.start_time is None:
            return None
        return max([peak(self._start_currents[1]), *(start.current for start in self.starts)])

    @property
    def _start_currents(self) -> tuple[np.ndarray, np.ndarray]:
        """Times [s] and currents [A] of the start from the angle 0."""
        current = self.start[f"motor.{self.drive.motor.current}"].values
        return self.start["time"].values, np.abs(current)

    @cached_property
    def inverter_current(self) -> float | None:
        """Least rated current of an inverter [A] by `need_of`; None on the line, or without a start."""
        if not self.drive.follows or self.start_current is None:
            return None
        name = f"motor.{self.drive.motor.current}"
        peaks = {"start": self.start_current, "running": max(peak(run[name].values) for run in self._running)}
        lasting = [exceeded_for(*self._start_currents, OVERLOADED), *(s.long_current for s in self.starts)]
        rated, overload = float(self.motor.nameplate.rated_current), self.task.tables.starter.overload
        return need_of(rated, self._rms(name), lasting, peaks, overload).current

    @cached_property
    def speed(self) -> float:
        """Mean speed of the motor [rad/s]."""
        return float(np.mean(self.steady["motor.w"]))

    @cached_property
    def speed_behind(self) -> float:
        """Mean speed of the machine, at the motor [rad/s]: less than that of the motor by the slip of the line."""
        return float(np.mean(self._speed_behind(self.steady)))

    def _speed_behind(self, run: Dataset) -> Any:
        name, ratio = self.drive.crank_output("w")
        return run[name].values * (self.drive.ratio / ratio)

    @cached_property
    def fluctuation(self) -> float:
        """(Largest - least)/mean of the machine's speed, by the later half of steady running, which is settled
        best."""
        w, mean = self._speed_behind(self.steady), self.speed_behind
        later_half = w[len(w) // 2 :]
        return float(np.ptp(later_half)) / mean if mean > 0.0 else math.inf

    @cached_property
    def duty(self) -> DutyPeak:
        """The largest torque at the crank in steady running, and while the feed comes, moves to either side and stays
        there."""
        sides = [(all_feed_on(side), run) for side, run in self.one_sided.items()]
        return duty_peak(self.drive, [(STEADY, self.steady), *self.shifts, *sides], at_gear)

    @cached_property
    def inertia_factor(self) -> float:
        """Mean inertia of the machine over that of the motor with its flywheel, both at the motor's shaft."""
        return float(np.mean(load_inertia(self.drive, self.steady)) / self.drive.fmu_parameters.rotor.J)

    @cached_property
    def frequency(self) -> float:
        """Frequency of the supply in steady running [Hz]; the rated one for a motor that does not start."""
        plate = self.motor.nameplate
        if not self.drive.follows or self._first is None:
            return plate.frequency
        return max(float(np.mean(self.steady["motor.supply.frequency"])), 1.0)

    @cached_property
    def breakdown_torque(self) -> float:
        """Pull-out torque of the motor [N m] at its permitted temperature and at the frequency at which it
        runs: above the corner frequency the voltage of an inverter does not rise any more."""
        p = self.drive.fmu_parameters
        voltage = float(volts_per_hertz(MATH, p, self.frequency)) if self.drive.follows else 1.0
        T = self._demands.temperature
        return float(self.drive.motor.largest_torque(p, T, voltage * p.supply.V, self.frequency))

    @cached_property
    def temperature(self) -> float:
        """Final temperature of the winding if the duty with its starts goes on for ever [K]; `BURNT` where
        there is none."""
        steady, extra = self._heat
        mean = steady + self._demands.starts_per_hour * extra / 3600.0
        p, motor = self.drive.fmu_parameters, self.drive.motor
        return min(BURNT, motor.settled_temperature(p, mean, self._ran_at, self.speed))

    @cached_property
    def permitted_starts(self) -> float:
        """Starts per hour that the winding permits; for a motor on the line at most the number by the rule of its
        maker, see `chainunit.study.permitted_starts`."""
        p, plate = self.drive.fmu_parameters, self.motor.nameplate
        warm, cold = (1.0 + p.stator.alpha * (T - T_RATED) for T in (self._demands.temperature, self._ran_at))
        # the runs are short and their winding is as cold as the surroundings; a warm winding has larger
        # losses
        running, start = (warm / cold * heat for heat in self._heat)
        starts = starts_by_heat(p, running, start, self._cooling, self._demands.temperature)
        if not plate.starts or self.drive.follows or self._first is None:
            return starts
        rise = self._from_rest.sel(time=slice(None, self._first))
        data = starting_data(
            self.drive,
            plate,
            rise,
            self.steady,
            per_hour=self._demands.starts_per_hour,
            bare=plate.starts,
            current=self._rms(f"motor.{self.drive.motor.current}"),
        )
        return permitted_starts(data, starts).permitted

    @property
    def _cooling(self) -> float:
        return float(self.drive.motor.cooling(MATH, self.drive.fmu_parameters, self.speed))

    @cached_property
    def _ran_at(self) -> float:
        """Temperature of the winding in the runs [K]."""
        return float(np.mean(self.steady[f"motor.{self.drive.motor.temperature}"]))

    @cached_property
    def _heat(self) -> tuple[float, float]:
        """Heat of the duty [W], and the additional heat of the worst start [J] beyond that of the running which
        follows it: of the duty or, for a machine that starts empty, of a turn without feed."""
        steady = after = sum(share * float(np.mean(run["motor.heat"])) for share, run in self._cases)
        end = float(self.start["time"][-1])
        if self.task.operation.empty_start:
            empty = self.start.sel(time=slice(end - self.task.operation.turn, None))
            after = float(np.mean(empty["motor.heat"]))
        rise = self._from_rest.sel(time=slice(None, max(end, self._first or 0.0)))
        extra = [float(np.trapezoid(rise["motor.heat"].values - after, rise["time"].values))]
        extra += [start.heat - after * start.followed for start in self.starts]
        return steady, max(0.0, *extra)

    def _rms(self, name: str) -> float:
        """RMS of a variable over the duty."""
        return rms(*((share, run[name].values) for share, run in self._cases))

    @property
    def _demands(self) -> Sizing:
        return self.task.plan.demands

    @property
    def _running(self) -> tuple[Dataset, ...]:
        """The runs of running: steady, with all feed on each side, and those in which the feed comes or moves."""
        return (self.steady, *(run for _, run in self.shifts), *self.one_sided.values())

    @property
    def _cases(self) -> list[tuple[float, Dataset]]:
        """The runs of the duty, each with its share of the time."""
        if self.heavier is None:
            return [(1.0, self.steady)]
        share = float(self._demands.one_sided_share)
        return [(1.0 - share, self.steady), (share, self.one_sided[self.heavier])]

    @property
    def torque_mean(self) -> float:
        """Mean air-gap torque of the duty [N m]."""
        return sum(share * float(np.mean(run[_GAP])) for share, run in self._cases)

    def result(self) -> TrialResult:
        """Its results."""
        names = {entry.name for entry in dataclasses.fields(TrialResult)}
        # of a motor that does not start, the speed and the frequency mean nothing
        shown = names if self.start_time is not None else names - {"speed", "frequency"}
        return TrialResult(**{name: getattr(self, name) for name in shown})

    @property
    def checks(self) -> dict[str, Check]:
        """Each value beside its limit, by name; the value is None where the machine does not get up to speed."""
        demands, plate, p = self._demands, self.motor.nameplate, self.drive.fmu_parameters

        run_up = motor_run_up(self.drive, self._from_rest, self.start_time)
        start = start_check(self.task, self.motor, self.drive, run_up)
        weaker = min(1.0, plate.frequency / self.frequency)
        # a motor that does not start has the limits that it has at its speed
        cooling = (
            1.0 if self.start_time is None else self._cooling / self.drive.motor.cooling(MATH, p, plate.speed)
        )
        breakdown = self.breakdown_torque / demands.breakdown_margin
        requested_speed = self.drive.ratio * self.task.operation.crank_speed
        peak_torque = max(peak(run[_GAP]) for run in self._running)
        too_hot = "no start is permitted, as running alone is too hot"
        checks = {
            "start": start,
            "rms_torque": Check(
                "RMS torque", self._rms(_GAP), plate.torque * weaker * math.sqrt(min(1.0, cooling)), "N.m"
            ),
            "peak_torque": Check("peak torque", peak_torque, breakdown, "N.m"),
            "temperature": dataclasses.replace(
                heating(self.temperature, p.ambient.T, demands.temperature),
                title="rise of temperature with starts",
            ),
            "starts": Check(
                "starts per hour", demands.starts_per_hour, self.permitted_starts, "1", forbidden=too_hot
            ),
            "crank_speed": keeping_speed(self.speed_behind, requested_speed, self.drive.driver_noun),
        }
        if math.isfinite(demands.fluctuation):
            checks["speed"] = Check(
                "speed fluctuation", self.fluctuation, demands.fluctuation, "1", "percent"
            )
        if self.backwards > BACKWARDS:
            checks["backwards"] = Check(
                "speed backwards in the start", self.backwards, BACKWARDS, "1", "percent"
            )
        if self.start_time is None:
            checks = {name: dataclasses.replace(check, value=None) for name, check in checks.items()}
        if math.isfinite(demands.inertia_ratio):
            inertia = float(np.max(load_inertia(self.drive, self.steady)))
            ratio = (inertia + p.rotor.J - plate.J) / plate.J
            checks["inertia"] = Check("inertia ratio", ratio, demands.inertia_ratio, "1")
        return checks | self._gear_checks() if "gear.torque_limit" in self.task.tables.given else checks

    def _gear_checks(self) -> dict[str, Check]:
        """The checks of a gear whose permitted torque is known; a gear of a catalogue also has a service factor."""
        gear, rating = self.task.tables.gear, self.drive.gear.rating
        checks = {"gear": Check("torque of the gear", self.duty.torque, gear.torque_limit, "N.m")}
        starts = [quasi_static_peak(self.drive, self.start), *(s.quasi_static for s in self.starts)]
        hardest, title = max(starts), "torque of the gear in a start"
        # the rating of a gear of the file counts as its maker's, with the service factor in it
        factor = 1.0 if rating is None else self.task.plan.gear_factor(self.inertia_factor)
        times = "" if rating is None else ", times the service factor"
        checks["gear_start"] = Check(f"{title}{times}", factor * hardest, gear.start_limit, "N.m")
        title = f"rated torque of the motor at the gear{times}"
        rated = self.motor.nameplate.torque * self.drive.ratio / (1.0 + self.drive.gear.loss)
        checks["gear_service"] = Check(title, factor * rated, gear.torque_limit, "N.m")
        if rating is None:
            return checks
        return checks | gear_checks(rating, self.drive, self._running, self._cases)


def start_check(
    task: SizingTask, motor: CatalogueMotor, drive: Drive, start_time: float | None = None
) -> Check:
    """The time of a start [s] beside the permitted one."""
    check = starting(start_time, motor.nameplate, drive.star.time)
    return dataclasses.replace(check, limit=1.0 + 1.2 * task.operation.run.ramp) if drive.follows else check


def try_motor(
    task: SizingTask,
    motor: CatalogueMotor,
    drive: Drive,
    duty: Duty,
    files: Mapping[str, Path] | None,
    *,
    worst_start: bool = False,
) -> Trial:
    """Simulate a motor in its drive, by the FMU `files`, or without them on the compiled system. With `worst_start`
    it starts from all crank angles, too, if its organs are no chains.

    Raises
    ------
    RunError
        where an FMU fails.
    """
    plate, operation, turn = motor.nameplate, task.operation, task.operation.turn
    ramp = operation.run.ramp if drive.follows else 0.0
    # three times as long as the rated torque takes to bring all inertia up to speed, and at least the ramp of
    # the start
    inertia = drive.rotor_inertia + duty.numbers.inertia_mean / drive.ratio**2
    rise = ramp if drive.star else task.tables.starter_time or ramp
    late = drive.star.end + max(1.0, _LATE * start_check(task, motor, drive).limit, 1.5 * rise)
    window = drive.star.end + max(1.0, 3.0 * inertia * plate.speed / plate.torque, 1.5 * rise)
    window = min(window, late)
    if operation.empty_start:
        # the run ends with a turn without feed
        window += turn
    rig = Rig(operation, drive, files)
    shifts, one_sided = [], {}
    # the start, steady running, and from there all feed on each side in turn
    with rig.from_rest() as simulation:
        start = simulation.run(window, rig.step)
        if operation.empty_start:
            rig = dataclasses.replace(rig, fed_from=simulation.time)
            simulation.signals = rig.signals(ramp=True)
            window += max(1.0, operation.run.settle_turns) * turn
            shifts.append((SETTLING, simulation.run(window, rig.step)))
            late = max(late, window)
        *settling, steady = until_settled(rig, simulation, window + 2.0 * turn, 2.0, late=late)
        shifts += [(SETTLING, run) for run in settling]
        event = simulation.save()
        for side in duty.one_sided:
            feed = one_sided_event(task.events, side)
            shift = follow(rig, simulation, feed, event, event + feed.p.shift + turn).run
            shifts.append((all_feed_on(side), shift))
            one_sided[side] = simulation.run(simulation.time + turn, rig.step)
    trial = Trial(task, motor, drive, duty.heavier, start, steady, tuple(shifts), one_sided)
    if not worst_start or drive.simulated_machine.model.never_repeats or trial.start_time is None:
        return trial
    return dataclasses.replace(
        trial, starts=starts_from_all(rig, longest_start(operation.ramp_end, trial.start_time))
    )


def starts_by_heat(
    p: Any, running_heat: float, start_heat: float, cooling: float, temperature: float
) -> float:
    """Starts per hour that bring the winding of a motor with the parameters `p` to its permitted `temperature` [K],
    with the `running_heat` [W] and the `start_heat` [J] of each start; `cooling` is the share at the present
    speed. 0 where running alone is too hot, a million where a start makes no heat."""
    dissipated = (temperature - p.ambient.T) * cooling / p.stator.R_th
    spare = dissipated - running_heat
    if spare <= 0.0:
        return 0.0
    return 3600.0 * spare / start_heat if start_heat > 0.0 else 1e6
