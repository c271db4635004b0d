"""Flywheels of a drive whose load comes and goes: their runs, and the least one that keeps the speed even enough."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence

import xarray as xr

from ..quantities import Value, declaration, quantity

CLOSE = 0.03
"""Relative width below the permitted fluctuation in which that of the least flywheel lies."""


@declaration
class WheelAnswers:
    """The answers of the co-simulation of a flywheel; None where the motor does not start, or stalls under the cut.
    Torque and current of the motor are those of cutting, over whole turns."""

    flywheel: Value = quantity("kg.m2", "flywheel, on the motor shaft")
    inertia: Value = quantity("kg.m2", "rotor, flywheel and mean of the machine, on the motor shaft")
    start_time: Value = quantity("s", "start without cut, to 95 % of the rated speed")
    speed_mean: Value = quantity("rad/s", "crank speed, mean; cuts per minute", kind="speed")
    speed_least: Value = quantity("rad/s", "crank speed, least", kind="speed")
    fluctuation: Value = quantity("1", "fluctuation of the speed", kind="percent")
    fluctuation_by_hand: Value = quantity("1", "fluctuation by hand, dE/(J w2)", kind="percent")
    motor_torque_peak: Value = quantity("N.m", "motor torque (air gap), peak")
    motor_torque_rms: Value = quantity("N.m", "motor torque (air gap), RMS")
    current_peak: Value = quantity("A", "motor current, peak")
    current_rms: Value = quantity("A", "motor current, RMS")
    current_share: Value = quantity("1", "RMS current over rated current", kind="percent")
    supply_power_mean: Value = quantity("W", "electric power, mean")
    stored_share: Value = quantity(
        "1", "share of a cut's work from flywheel and moving masses, over the cut", kind="percent"
    )
    stored_share_most: Value = quantity(
        "1", "the same, from the beginning of the cut to their least energy", kind="percent"
    )
    drift: Value = quantity(
        "1", "change of speed over the measured turns, as a share of the fluctuation", kind="percent"
    )
    residual: Value = quantity("1", "energy residual, the larger of start and cutting", kind="percent")


@dataclasses.dataclass
class Wheel:
    """A flywheel with its runs. `turns` are those of the measurement; where it stalled, all of the run."""

    answers: WheelAnswers
    start: xr.Dataset | None = None
    turns: xr.Dataset | None = None
    stalled: bool = False
    """under the cut"""

    @property
    def flywheel(self) -> float:
        """[kg m2]"""
        return float(self.answers.flywheel)

    def keeps(self, fluctuation: float) -> bool:
        """Whether it cuts and keeps the fluctuation."""
        return self.answers.fluctuation is not None and self.answers.fluctuation <= fluctuation


def least_flywheel(
    wheels: Sequence[Wheel],
    permitted: float,
    bare: float,
    by_hand: float,
    running: Callable[[float], Wheel],
    simulated: Callable[[float], Wheel],
) -> Wheel | None:
    """The least flywheel that keeps the `permitted` fluctuation, to `CLOSE` of the fluctuation.

    None where none of the `wheels` does, in order of their inertia, nor that of the hand formula, nor one a fifth
    heavier than the heaviest. It need not start. The fluctuation falls with the inertia, and between two flywheels
    nearly as a power of it.

    Parameters
    ----------
    bare : inertia on the motor shaft without a flywheel [kg m2]
    by_hand : flywheel by the hand formula [kg m2]
    running, simulated : a run with a flywheel [kg m2], without and with its start
    """
    above = next((wheel for wheel in wheels if wheel.keeps(permitted)), None)
    # a flywheel with which the motor does not start is not too light
    starting = [wheel for wheel in wheels if wheel.answers.start_time is not None]
    below = next((w for w in reversed(starting) if above is None or w.flywheel < above.flywheel), None)
    if below is None:
        below = running(0.0)
        if above is not None and above.flywheel == 0.0:
            return above
        if below.keeps(permitted):
            return simulated(0.0)
    if above is None:
        above = running(max(by_hand, 1.2 * below.flywheel))
        if not above.keeps(permitted):
            return None
    above = _between(below, above, permitted, bare, running)
    if above.start is not None:
        return above
    # the start warms the windings, and the motor slips a little more
    wheel = simulated(above.flywheel)
    for _ in range(4):
        if wheel.answers.fluctuation is None or wheel.keeps(permitted):
            break
        heavier = wheel.answers.inertia * wheel.answers.fluctuation / permitted * (1.0 + CLOSE)
        wheel = simulated(heavier - bare)
    return wheel


def _between(
    below: Wheel, above: Wheel, permitted: float, bare: float, running: Callable[[float], Wheel]
) -> Wheel:
    """The lightest of a few flywheels that keep the fluctuation, as `above` does and `below` does not."""
    for _ in range(8):
        if above.answers.fluctuation >= (1.0 - CLOSE) * permitted:
            break
        x = [math.log(wheel.answers.inertia) for wheel in (below, above)]
        share = 0.5
        if below.answers.fluctuation is not None:
            y = [math.log(wheel.answers.fluctuation) for wheel in (below, above)]
            # a little below the permitted one, so that the next flywheel is likely to keep it
            goal = math.log((1.0 - 0.5 * CLOSE) * permitted)
            share = min(max((y[0] - goal) / (y[0] - y[1]), 0.05), 0.95)
        middle = running(math.exp(x[0] + share * (x[1] - x[0])) - bare)
        if middle.keeps(permitted):
            above = middle
        else:
            below = middle
    return above
