"""The protection of a drive by a torque limiter."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum

from ...core.quantities import Value, declaration, percentage, quantity, variables
from ...study.coupling import LESS_TORQUE

MARGIN = 1.25
"""Ratio of the setting of a torque limiter to the largest torque of normal duty."""
MARKED_START = 1.1
"""Ratio of the torque of a start to that of running from which on the start decides the setting."""


class Obstacle(StrEnum):
    """Why no setting of a torque limiter protects a drive."""

    START = "the start"
    """a start puts more on it than the gear may carry, or than any overload does"""
    MOTOR = "the motor"
    """the motor cannot give the torque of the setting"""
    GEAR = "the gear"
    """the gear may not carry the torque of the setting"""
    OVERLOADS = "the overloads"
    """no overload reaches the torque of the setting"""
    RELEASE = "the release"
    """until no torque passes the opening coupling, the gear carries as much as without it in every overload"""
    ENERGY = "the energy balance"
    """the energy balance is not kept in the runs from which the setting follows"""


MARKED = 0.2
"""Share of the torque at the output of the gear that a coupling spares it in an overload if it opens in good time."""
_SPARED = 0.05
"""Share of the torque at the output of the gear that a coupling has to spare it in an overload."""


@dataclass(frozen=True)
class CouplingEffect:
    """The effect of a torque limiter in an overload: the largest torque at the output of the gear [N m] without it,
    and with it until no torque passes it any more; the `release` time [s] up to which the gear carries no more than
    `goal` [N m], 0 where it carries more before the trip; and the largest `current` of the motor until no torque
    passes the coupling [A]."""

    without: float
    with_coupling: float
    goal: float = math.inf
    release: float = math.inf
    current: float = math.nan


def goal(without: float, gear: float) -> float:
    """The torque to which a coupling should bring down that `without` it at the output of the gear [N m]: the limit
    of the `gear` where it is above that, else a marked part of itself."""
    return gear if without > gear else (1.0 - MARKED) * without


def spares(effects: Mapping[str, CouplingEffect], gear: float = math.inf) -> bool:
    """Whether a coupling spares the gear a part of its torque in one of the overloads, or brings one below the limit
    of the `gear` [N m]."""
    return any(
        effect.with_coupling < (1.0 - _SPARED) * effect.without
        or effect.with_coupling <= gear < effect.without
        for effect in effects.values()
    )


@dataclass(frozen=True)
class Setting:
    """A torque limiter between motor and gear, judged by the torques in a study; all at the crank [N m].

    A coupling has to carry `running` and every `start` by load and acceleration: the setting is `MARGIN` times the
    larger of the two. It has
    to be below the limit of the `gear`, and below the peak of at least one of the `overloads` (peaks by name), the
    shocks that a coupling is for. Otherwise `obstacle` says why there is no setting. The largest torque of the
    `motor` in steady running may be less than the setting, as rotor and flywheel also give torque in a shock; then a
    load that rises slowly stalls the motor. `disturbances` are the peaks, by name, in which the coupling should stay
    shut, such as a dip of the voltage.
    """

    running: float
    start: float
    motor: float
    gear: float
    overloads: Mapping[str, float]
    disturbances: Mapping[str, float] = field(default_factory=dict)
    line: float = math.inf
    """largest torque that a part which slips takes: a coupling that is set higher never opens"""
    effects: Mapping[str, CouplingEffect] = field(default_factory=dict)
    """the effect of the least setting in each overload that opens it; empty until it was tried"""
    wrong: Sequence[str] = ()
    """runs that were left out, as their energy balance is not kept; without steady running there are no overloads"""

    @property
    def normal(self) -> float:
        """The largest torque of normal duty, starts included."""
        return max(self.running, self.start)

    @property
    def is_of_start(self) -> bool:
        """Whether a start puts more on the coupling than running does."""
        return self.start > self.running

    @property
    def least(self) -> float:
        """The least torque at which a coupling may open."""
        return MARGIN * self.normal

    @property
    def least_in_running(self) -> float:
        """The least torque at which a coupling may open if starts put no more on it than running does."""
        return MARGIN * self.running

    @property
    def start_decides(self) -> bool:
        """Whether a start puts markedly more on the coupling than running does."""
        return self.start > MARKED_START * self.running

    def opened_by(self, setting: float) -> dict[str, float]:
        """The overloads in which a coupling of that setting opens, with their peaks."""
        return {name: peak for name, peak in self.overloads.items() if peak > setting}

    def _protects(self, setting: float) -> bool:
        return setting < min(self.gear, self.line) and bool(self.opened_by(setting))

    @property
    def obstacle(self) -> Obstacle | None:
        """The reason why there is no setting; None where there is one."""
        if self.wrong and not self.overloads:
            return Obstacle.ENERGY
        if self._protects(self.least):
            return None if self.spares else Obstacle.RELEASE
        if self.start_decides and self._protects(self.least_in_running):
            return Obstacle.START
        if self.least >= self.gear:
            return Obstacle.GEAR
        weak = self.overloads and self.least_in_running >= self.motor
        return Obstacle.MOTOR if weak else Obstacle.OVERLOADS

    @property
    def passed(self) -> dict[str, CouplingEffect]:
        """The overloads in which the gear carries more than it may, though the coupling opens."""
        return {name: effect for name, effect in self.effects.items() if effect.with_coupling > self.gear}

    @property
    def spares(self) -> bool:
        """Whether a coupling of the least setting spares the gear something; True until it was tried."""
        return not self.effects or spares(self.effects, self.gear)

    @property
    def torque(self) -> float | None:
        """The setting [N m]; None where there is none."""
        return self.least if self.obstacle is None else None

    @property
    def opens(self) -> dict[str, float]:
        """The overloads in which a coupling of the least setting opens, with their peaks."""
        return self.opened_by(self.least)

    @property
    def stalls(self) -> bool:
        """Whether the motor may stall before the coupling opens, if the load rises slowly."""
        return self.least >= (1.0 - LESS_TORQUE) * self.motor

    @property
    def nuisances(self) -> dict[str, float]:
        """The disturbances in which the coupling opens, too, with their peaks; it protects nothing there."""
        return {name: peak for name, peak in self.disturbances.items() if peak > self.least}


class Way(StrEnum):
    """A way to a torque limiter that stays shut in a start which puts more on it than running does, or that saves
    what one with the declared release time does not."""

    RELEASE = "shorter release time"
    GEAR = "stronger gear"
    SOFT_STARTER = "soft starter"
    INVERTER = "inverter"
    SLIP_CLUTCH = "slip clutch"
    HIGHER = "higher setting"
    BEFORE_FLYWHEEL = "between motor and flywheel"


@declaration
class WayNumbers:
    """The numbers of a way, each from the runs of its own simulation; None where a number has no meaning for it;
    all but `running` are None for a way with which the machine does not start. Torques are those at the crank."""

    setting: Value = quantity("N.m", "trip torque")
    running: Value = quantity("N.m", "largest torque of running on the coupling")
    start: Value = quantity("N.m", "largest torque of a start on the coupling")
    start_time: Value = quantity("s", "longest start-up")
    voltage: Value = percentage("share of the voltage at the start")
    ramp: Value = quantity("s", "ramp of the voltage or of the speed")
    boost: Value = percentage("boost of the inverter: share of the voltage at frequency zero")
    slip_time: Value = quantity("s", "time for which the clutch slips in a start")
    slip_energy: Value = quantity("J", "heat of the slip in a start")
    slip_power: Value = quantity("W", "heat of the slip while the machine is blocked and the motor runs on")
    release_time: Value = quantity("s", "time from the trip until no torque passes the coupling")
    gear: Value = quantity("N.m", "torque that the gear has to carry")
    rocker: Value = quantity("N.m", "largest rocker torque in the overloads until the coupling opens")

    @classmethod
    def of(cls, **numbers: float | None) -> WayNumbers:
        """These numbers; all others are None."""
        return cls(**{v.name: numbers.get(v.name) for v in variables(cls)})


@dataclass(frozen=True)
class Alternative:
    """A way with its numbers, the peaks of the overloads in which its coupling opens or slips, by name, and its
    effects in the overloads that open it."""

    way: Way
    numbers: WayNumbers
    opens: Mapping[str, float]
    effects: Mapping[str, CouplingEffect] = field(default_factory=dict)
