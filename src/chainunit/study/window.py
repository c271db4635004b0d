"""The part of a run that is evaluated: the start-up, the steady turns, or an overload from its event on."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, auto
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr

from .arrays import peak
from .drive import Drive

BURNT = 2000.0
"""Temperature that stands for a winding without a thermal steady state [K]."""
CLOSED = 0.01
"""Gap between the ends of the steady turns up to which they count as closed."""
DRIFT = 0.1
"""Change of the speed over the steady turns, in parts of its ripple, up to which it counts as steady."""
_EVEN = 1e-4
"""Change of the speed over the steady turns, in parts of itself, that is none."""


class Phase(Enum):
    """Which part of a study a run is."""

    START_UP = auto()
    SETTLING = auto()
    """of a machine that starts empty: from the coming of its feed to steady running"""
    STEADY = auto()
    EVENT = auto()
    LOADED_START = auto()


@dataclass(frozen=True)
class Trip:
    """A safety coupling that opened: when [s], the energy that passed it until no torque did [J], and the run of the
    machine behind it, where it could be followed."""

    time: float
    passed: float
    coasting: xr.Dataset | None


@dataclass(frozen=True)
class Window:
    """The rows of a run that measures are read from, with the drive and the crank speed `asked` for [rad/s]; of an
    overload when it began [s], the steady running before it, and what opened the coupling."""

    phase: Phase
    run: xr.Dataset
    drive: Drive
    sides: tuple[str, ...]
    """sides whose organs have weight"""
    asked: float
    begin: float = 0.0
    steady: Window | None = None
    trip: Trip | None = None

    def value(self, name: str) -> Any:
        """A variable of the run, shape (time,)."""
        return self.drive.series(self.run, name)

    @cached_property
    def turns(self) -> xr.Dataset:
        """Whole turns of the run; all of it where the crank does not make one."""
        return whole_turns(self.drive, self.run)

    @cached_property
    def crank_torque(self) -> Any:
        """[N m], shape (time,)."""
        return self.drive.crank_torque(self.run)

    @cached_property
    def speed(self) -> Any:
        """Of the crank [rad/s], shape (time,)."""
        return self.drive.crank_motion(self.run)[1]

    @cached_property
    def speed_mean(self) -> float:
        """Of the crank over whole turns [rad/s]."""
        return self.mean(lambda run: self.drive.crank_motion(run)[1])

    @property
    def coasting(self) -> xr.Dataset | None:
        """The run of the machine behind the coupling that opened, if there is one."""
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
    def kept(self) -> float:
        """Crank speed that the drive keeps where nothing happens [rad/s]: the one that is asked for, or the one that
        a motor on the line takes."""
        if self.drive.follows or self.steady is None:
            return self.asked
        return self.steady.speed_mean

    @cached_property
    def settled_temperature(self) -> float:
        """At which the winding comes to rest if the turns go on for ever [K]; infinite where it does not."""
        drive = self.drive
        drive.needs_own("the temperature of the winding")
        names = ("heat", drive.motor.temperature, "w")
        heat, temperature, w = (self.mean(f"motor.{name}") for name in names)
        return drive.motor.settled_temperature(drive.fmu_parameters, heat, temperature, w)

    @property
    def warm(self) -> float:
        """Temperature of the winding in steady running [K]; see `BURNT`."""
        return min(BURNT, (self.steady or self).settled_temperature)

    def mean(self, of: str | Callable[[xr.Dataset], Any]) -> float:
        """Mean over the time of whole turns, of a variable or of a value read from them."""
        return mean(self.turns, of(self.turns) if callable(of) else self.drive.series(self.turns, of))

    def rms(self, of: str | Callable[[xr.Dataset], Any]) -> float:
        """RMS over the time of whole turns."""
        return math.sqrt(
            self.mean(lambda run: (of(run) if callable(of) else self.drive.series(run, of)) ** 2)
        )

    def largest(self, name: str) -> float:
        """Largest size of a variable."""
        return peak(self.value(name))

    def swing(self, *names: str) -> float:
        """Largest deviation of a vector from its mean over whole turns."""
        parts = [(self.value(name), self.mean(name)) for name in names]
        return float(np.max(np.sqrt(sum((x - middle) ** 2 for x, middle in parts))))

    def least_pull(self, rod: str) -> float:
        """Of a kind of rod on either side [N]; infinite where no organ has weight."""
        assert self.drive.chain_unit
        pulls = (float(np.min(self.value(f"machine.{side}.{rod}_pull"))) for side in self.sides)
        return min(pulls, default=math.inf)


def mean(run: xr.Dataset, x: Any) -> float:
    """Mean over the time of a run, by the trapezoidal rule."""
    time = run["time"].values
    return float(np.trapezoid(x, time) / (time[-1] - time[0]))


def whole_turns(drive: Drive, run: xr.Dataset, most: float = math.inf) -> xr.Dataset:
    """Whole turns of a run, see `Drive.whole_turns`; all of it where the crank does not make one."""
    turns = drive.whole_turns(run, most)
    return run if turns is None else turns


def end_gap(drive: Drive, turns: xr.Dataset) -> float:
    """Difference between the ends of `turns`, of crank speed or torque, over the largest value."""
    _, speed = drive.crank_motion(turns)
    sizes = ((x[-1] - x[0]) / max(np.max(np.abs(x)), 1e-9) for x in (speed, drive.crank_torque(turns)))
    return max(abs(float(size)) for size in sizes)


def drift(drive: Drive, turns: xr.Dataset) -> float:
    """Change of the crank speed from one end of `turns` to the other in parts of its ripple, 1 where it only rises or
    falls; positive where it rises, 0 where it hardly changes."""
    _, speed = drive.crank_motion(turns)
    change = float(speed[-1] - speed[0])
    return change / float(np.ptp(speed)) if abs(change) > _EVEN * float(np.max(np.abs(speed))) else 0.0


def closes(gap: float, drifts: float) -> bool:
    """Whether turns close, by their `end_gap` and `drift`. A heavy flywheel that still speeds up hardly changes its
    speed in a turn, but may take more power for that than the machine: the change has to be small beside the ripple,
    too."""
    return gap <= CLOSED and abs(drifts) <= DRIFT


def settled(drive: Drive, turns: xr.Dataset) -> bool:
    """Whether `turns` close."""
    return closes(end_gap(drive, turns), drift(drive, turns))
