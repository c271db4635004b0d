"""The transmission between the motor and the machine: a gear, a belt, or a plain coupling."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from ..core.quantities import Value, declaration, quantity

W_REST = 1e-3
"""Speed of the motor [rad/s] below which friction in the transmission fades out: at rest it has no direction."""

START_FACTOR = 2.0
"""Permitted torque of a gear in a start, over its rated torque, where nobody gives it: catalogues of gears commonly
permit about twice the rated torque in starts and momentary peaks."""


@declaration
class Transmission:
    """A transmission of constant ratio between the motor's shaft and the output."""

    ratio: Value = quantity("1", "motor turns per turn of the output", default=1.0, above=0.0, max=1e4)
    efficiency: Value = quantity(
        "1",
        "efficiency while the motor drives, without the loss by the drag d",
        default=1.0,
        min=0.05,
        max=1.0,
    )
    d: Value = quantity("N.m.s/rad", "drag that grows with speed, at the motor's shaft", default=0.0, min=0.0)
    J: Value = quantity("kg.m2", "inertia at the motor's shaft", default=0.0, min=0.0)
    torque_limit: Value = quantity("N.m", "permitted torque of the output", default=1e6, above=0.0)
    start_factor: Value = quantity(
        "1",
        "permitted torque of the output in a start, over torque_limit; catalogues of gears commonly permit about "
        "twice the rated torque in starts and momentary peaks",
        default=START_FACTOR,
        min=1.0,
        max=10.0,
    )

    @property
    def start_limit(self) -> float:
        """Permitted torque of the output in a start [N m]."""
        return float(self.torque_limit * self.start_factor)


KINDS: Mapping[str, Transmission] = MappingProxyType(
    {
        "direct": Transmission(),
        "gear": Transmission(ratio=10.0, efficiency=0.96),
        "belt": Transmission(ratio=3.0, efficiency=0.95),
        "worm": Transmission(ratio=50.0, efficiency=0.7),
    }
)
"""Typical start values by kind: a coupling, a two-stage helical gear, a V-belt, a worm gear."""


def ordered_torque(least: float) -> float:
    """Rated output torque [N m] with which a gear is ordered that needs at `least` such a one [N m]: rounded up to
    three digits, so that a gear with the printed torque holds."""
    step = 10.0 ** (math.floor(math.log10(least)) - 2) if least > 0.0 else 1.0
    return float(f"{math.ceil(least / step * (1.0 - 1e-9)) * step:.6g}")


def motor_side(xp: Any, t: Transmission, torque: Any, w: Any) -> Any:
    """Torque at the motor's shaft [N m] for the `torque` that the machine takes at the output [N m], at the speed `w`
    of the motor [rad/s], without the torque that accelerates `t.J`.

    The teeth or the belt lose a share of the torque, in either direction of the power:

        tau = (torque + (1/efficiency - 1) |torque| sign(w))/ratio + d w

    Where the motor drives (torque w > 0), the first part is torque/(ratio efficiency). Where the machine drives, it
    is torque (2 - 1/efficiency)/ratio: the same loss relieves the motor. Below an efficiency of 1/2 this part changes
    its sign, and the transmission is self-locking: the motor must help to turn it. At rest there is no loss.
    """
    direction = w / xp.maximum(xp.abs(w), W_REST)
    loss = (1.0 / t.efficiency - 1.0) * xp.abs(torque) * direction
    return (torque + loss) / t.ratio + t.d * w
