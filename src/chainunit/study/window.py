"""The part of a run that is evaluated: the start-up, the steady turns, or an overload from its event on."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, auto
from functools import cached_property
from typing import Any

import numpy as np

from .arrays import Dataset, peak
from .drive import Drive
from .readings import (
    crank_motion,
    crank_speed,
    crank_torque,
    energy_behind,
    energy_gap,
    energy_held,
    has_turn,
    only_whole_turns,
    series,
)
from .relay import LIGHT
from .verdict import CREEPS

BURNT = 2000.0
"""Temperature that stands for a winding without a thermal steady state [K]."""
CLOSED = 0.01
"""Gap between the ends of the steady turns up to which the turns count as closed."""
DRIFT = 0.1
"""Change of the speed over the steady turns, relative to its ripple, up to which the speed counts as steady."""
STORED = 0.002
"""Energy that the moving masses take up over the steady turns, relative to the energy that passes the motor's shaft,
up to which the turns count as steady."""
LASTING = 0.05
"""The same, up to which means of the turns stand for running that lasts, once what is taken up is left out."""
_EVEN = 1e-4
"""Relative change of the speed over the steady turns that counts as none."""

Reading = Callable[[Drive, Dataset], Any]
"""A value that is read from a run of a drive, shape (time,)."""


class Phase(Enum):
    """The part of a study to which a run belongs."""

    START_UP = auto()
    SETTLING = auto()
    """the run of a machine that starts empty, from the coming of its feed to steady running"""
    STEADY = auto()
    EVENT = auto()
    LOADED_START = auto()


@dataclass(frozen=True)
class Trip:
    """A torque limiter that opened: the time [s], the energy that passed it before its torque was zero [J],
    and the run of the machine behind it, where that could be followed."""

    time: float
    energy: float
    coasting: Dataset | None


@dataclass(frozen=True)
class Window:
    """The rows of a run from which measures are read, with the drive and the `requested_speed` of the crank [rad/s].
    For an overload it has the begin [s], the steady running before it, and the opening of the coupling, if it
    opened."""

    phase: Phase
    run: Dataset
    drive: Drive
    sides: tuple[str, ...]
    """sides whose organs have a weight"""
    requested_speed: float
    begin: float = 0.0
    steady: Window | None = None
    trip: Trip | None = None
    relay_class: int = LIGHT
    """trip class of the thermal relay"""
    passes: bool = False
    """whether the overload passes, so that the machine runs on as before"""

    def value(self, name: str) -> Any:
        """A variable of the run, shape (time,)."""
        return series(self.run, name)

    @cached_property
    def turns(self) -> Dataset:
        """The rows over which means and RMS are taken: whole turns of steady running, or all of it where the crank
        does not make one; of another run all that is followed, as its turns differ."""
        return whole_turns(self.drive, self.run) if self.phase is Phase.STEADY else self.run

    @cached_property
    def crank_torque(self) -> Any:
        """Torque at the crank [N m], shape (time,)."""
        return crank_torque(self.drive, self.run)

    @cached_property
    def speed(self) -> Any:
        """Speed of the crank [rad/s], shape (time,)."""
        return crank_speed(self.drive, self.run)

    @cached_property
    def speed_mean(self) -> float:
        """Mean speed of the crank over the `turns` [rad/s]."""
        return self.mean(crank_speed)

    @property
    def coasting(self) -> Dataset | None:
        """The run of the machine behind a coupling that opened; else None."""
        return self.trip.coasting if self.trip else None

    @property
    def since(self) -> Any:
        """Time since the begin of an overload [s], shape (time,)."""
        return self.value("time") - self.begin

    @property
    def current(self) -> str:
        """Name of the motor's current."""
        self.drive.needs_own("the current")
        return f"motor.{self.drive.motor.current}"

    @property
    def normal_speed(self) -> float:
        """Crank speed that the drive keeps without an event [rad/s]: the requested speed, or the speed that a
        motor on the line, or with a droop, takes."""
        steady = self if self.phase is Phase.STEADY else self.steady
        if (self.drive.follows and not self.drive.droop_speed) or steady is None:
            return self.requested_speed
        mean = steady.speed_mean
        return mean if steady is not self or mean > CREEPS * self.requested_speed else self.requested_speed

    @cached_property
    def settled_temperature(self) -> float:
        """Final temperature of the winding if the turns go on for ever [K]; infinite where there is none."""
        drive = self.drive
        drive.needs_own("the temperature of the winding")
        names = ("heat", drive.motor.temperature, "w")
        heat, temperature, w = (self.mean(f"motor.{name}") for name in names)
        return drive.motor.settled_temperature(drive.fmu_parameters, heat, temperature, w)

    @property
    def warm(self) -> float:
        """Temperature of the winding in steady running [K], at most `BURNT`."""
        return min(BURNT, (self.steady or self).settled_temperature)

    def mean(self, reading: str | Reading) -> float:
        """Mean over the time of the `turns`, of a variable or of a value read from them."""
        return mean(self.turns, self._read(reading))

    @cached_property
    def lasts(self) -> bool:
        """Whether means of steady running stand for running that lasts: where the moving masses take up at most
        `LASTING` of the energy over the turns, or the crank stands. A crank that makes a part of a turn is on its
        way. Of a machine that never repeats a turn, and of other phases, no more is asked."""
        if self.phase is not Phase.STEADY or self.drive.simulated_machine.model.never_repeats:
            return True
        if not has_turn(self.drive, self.run):
            return bool(abs(self.speed_mean) < CREEPS * self.requested_speed)
        return abs(energy_gap(self.drive, self.turns)) <= LASTING

    @cached_property
    def taken_up(self) -> tuple[float, float]:
        """Mean power [W] that the moving masses take up over the steady turns: the masses of the machine, and all
        masses with the motor's shaft. 0 for a run that does not repeat its turns, and where the crank makes none."""
        if self.phase is not Phase.STEADY or not has_turn(self.drive, self.run):
            return 0.0, 0.0
        time = self.turns["time"].values
        held = energy_behind(self.drive, self.turns), energy_held(self.drive, self.turns)
        machine, whole = (float(x[-1] - x[0]) / float(time[-1] - time[0]) for x in held)
        return machine, whole

    def rms(self, reading: str | Reading) -> float:
        """RMS over the time of the `turns`."""
        return math.sqrt(mean(self.turns, self._read(reading) ** 2))

    def _read(self, reading: str | Reading) -> Any:
        return reading(self.drive, self.turns) if callable(reading) else series(self.turns, reading)

    def largest(self, name: str) -> float:
        """Largest size of a variable."""
        return peak(self.value(name))

    def swing(self, *names: str) -> float:
        """Largest deviation of a vector from its mean over the `turns`."""
        parts = [(self.value(name), self.mean(name)) for name in names]
        return float(np.max(np.sqrt(sum((x - middle) ** 2 for x, middle in parts))))

    def least_pull(self, rod: str) -> float:
        """Least pull in a kind of rod ("web" or "wall") on either side [N]; infinite where no organ has a weight."""
        assert self.drive.chain_unit
        pulls = (float(np.min(self.value(f"machine.{side}.{rod}_pull"))) for side in self.sides)
        return min(pulls, default=math.inf)


def mean(run: Dataset, x: Any) -> float:
    """Mean over the time of a run, by the trapezoidal rule."""
    time = run["time"].values
    return float(np.trapezoid(x, time) / (time[-1] - time[0]))


def whole_turns(drive: Drive, run: Dataset, most: float = math.inf) -> Dataset:
    """Whole turns of a run, see `only_whole_turns`; all of it where the crank does not make one."""
    turns = only_whole_turns(drive, run, most)
    return run if turns is None else turns


def time_at(drive: Drive, run: Dataset, angle: float) -> float | None:
    """Time [s] at which the crank passes the `angle` [rad] in a run, by a cubic between two rows; None where it does
    not get there."""
    from scipy.interpolate import CubicHermiteSpline

    angles, speeds = crank_motion(drive, run)
    row = int(np.argmax(angles >= angle))
    if row == 0:
        return None
    around = slice(row - 1, row + 1)
    angles, speeds, times = angles[around], speeds[around], run["time"].values[around]
    if np.min(speeds) <= 0.0:
        return float(np.interp(angle, angles, times))
    return float(CubicHermiteSpline(angles, times, 1.0 / speeds)(angle))


def end_gap(drive: Drive, turns: Dataset) -> float:
    """Difference between the ends of `turns` over the largest value: the larger one of crank speed and torque."""
    _, speed = crank_motion(drive, turns)
    sizes = ((x[-1] - x[0]) / max(np.max(np.abs(x)), 1e-9) for x in (speed, crank_torque(drive, turns)))
    return max(abs(float(size)) for size in sizes)


def drift(drive: Drive, turns: Dataset) -> float:
    """Change of the crank speed between the ends of `turns`, relative to its ripple: 0 where it hardly
    changes, positive where it rises, 1 or -1 where it only rises or falls."""
    _, speed = crank_motion(drive, turns)
    change = float(speed[-1] - speed[0])
    return change / float(np.ptp(speed)) if abs(change) > _EVEN * float(np.max(np.abs(speed))) else 0.0


def closes(gap: float, drifts: float, energy: float) -> bool:
    """Whether turns close, by their `end_gap`, `drift` and `energy_gap`. A heavy drive that still speeds up hardly
    changes its speed in a turn, but may take more power for that than the machine. So the change has to be
    small beside the ripple, and the energy that it takes small beside the energy that passes the shaft."""
    return gap <= CLOSED and abs(drifts) <= DRIFT and abs(energy) <= STORED


def is_settled(drive: Drive, turns: Dataset) -> bool:
    """Whether `turns` close, or are of a machine that never repeats a turn."""
    if drive.simulated_machine.model.never_repeats:
        return True
    return closes(end_gap(drive, turns), drift(drive, turns), energy_gap(drive, turns))
