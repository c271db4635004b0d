"""The rating life of a pin (ISO 281): L10 = (C/P)^p million turns, at the equivalent load P and the turning of the
pin in steady running. A pin that swings makes the turns that its way to and fro amounts to."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from chainunit.core.quantities import Value, declaration, quantity
from chainunit.reading.results import part, result
from chainunit.study.analysis import Analysis, Findings, Work
from chainunit.study.bearings import mean_load
from chainunit.study.drive import Drive
from chainunit.study.readings import machine_series
from chainunit.study.record import StudyRecord
from chainunit.study.remark import warning
from chainunit.study.verdict import STEADY
from chainunit.study.window import whole_turns

from .table import LifePlan

_MILLION_TURNS = 2e6 * math.pi


@declaration
class LifeNumbers:
    """The bearing in steady running."""

    load: Value = quantity("N", "equivalent load")
    speed: Value = quantity("rad/s", "speed of the pin in its bearing, mean", kind="speed")
    life: Value = quantity("s", "rating life L10h", kind="hours")
    needed: Value = quantity("N", "load rating for the wanted life")


@result
class PinLife(Findings):
    """The life of a pin in steady running; None where the pin carries nothing or does not turn."""

    pin: str = part("the pin, by its title")
    numbers: LifeNumbers = part(inline=True)
    wanted: float = quantity("s", "rating life that is wanted", kind="hours")

    @property
    def is_short(self) -> bool:
        """Whether the life is shorter than the wanted one."""
        return self.numbers.life is not None and self.numbers.life < self.wanted

    def remark(self, study: StudyRecord) -> None:
        """Warn of a life that is too short."""
        if self.is_short:
            study.findings.say(
                TOO_SHORT,
                STEADY,
                pin=self.pin,
                life=self.numbers.life,
                wanted=self.wanted,
                needed=self.numbers.needed,
            )


TOO_SHORT = warning(
    "pin-life",
    "A bearing at the pin {pin} has a rating life of {life}, and {wanted} are wanted.",
    remedy="Take one with a load rating of {needed}.",
    sizes={("s", "hours"): "life wanted", "N": "needed"},
)


class PinLifeAnalysis(Analysis):
    """The life of the pin that the table names."""

    name = "pin_life"
    needs_runs = True

    @staticmethod
    def applies(drive: Drive, plans: Mapping[str, Any]) -> bool:
        """Whether the study names a pin."""
        return plans["pin_life"] is not None

    @staticmethod
    def find(study: StudyRecord, work: Work) -> PinLife:
        """The life at the load and speed of steady running."""
        plan: LifePlan = study.setup.config.plans["pin_life"]
        turns = whole_turns(study.setup.drive, study.runs.steady)
        machine = study.setup.drive.simulated_machine
        name = machine.model.pins[plan.pin]
        force = np.hypot(*(turns[f"machine.{name}.{axis}"].values for axis in ("fx", "fy")))
        angle = machine.pin_turns(machine_series(turns))[name]
        return PinLife(
            plan.pin, _numbers(plan, force, angle, np.ptp(turns["time"].values)), plan.table.wanted
        )


def _numbers(plan: LifePlan, force: Any, angle: Any, time: float) -> LifeNumbers:
    """The life under a force [N] at the angles of the pin [rad], both of shape (n,), over that time [s]."""
    C, p = plan.table.C, plan.table.p
    load, speed = mean_load(force, angle, p), float(np.sum(np.abs(np.diff(angle)))) / time
    if not load * speed > 0.0:
        return LifeNumbers(load=load, speed=speed, life=None, needed=None)
    return LifeNumbers(
        load=load,
        speed=speed,
        life=_MILLION_TURNS * (C / load) ** p / speed,
        needed=load * (plan.table.wanted * speed / _MILLION_TURNS) ** (1.0 / p),
    )
