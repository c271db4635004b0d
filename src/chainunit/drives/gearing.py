"""The transmission between the motor and the machine: a gear, a belt, or a plain coupling."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from ..core.ports import LoadPort, load_inertia, load_torque
from ..core.quantities import Value, declaration, quantity

W_REST = 1.0
"""Speed of the motor [rad/s] below which friction in the transmission fades out: at rest it has no direction."""
_REST_OF_ROTOR = 0.1
"""Least inertia that a rotor feels that a self-locking gear brakes, over its own."""

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
    def loss(self) -> float:
        """Loss by load, as a share of the torque that it passes on."""
        return float(1.0 / self.efficiency - 1.0)

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
    return (torque + lost_torque(xp, t.loss, torque, w)) / t.ratio + t.d * w


def lost_torque(xp: Any, loss: Any, torque: Any, w: Any) -> Any:
    """Torque that the teeth or the belt lose [N m], of the `torque` that they pass on [N m] at the speed `w` of the
    motor [rad/s]; the `loss` is `Transmission.loss`."""
    return loss * xp.abs(torque) * _direction(xp, w)


def felt_share(xp: Any, loss: Any, torque: Any, w: Any) -> Any:
    """Torque that the rotor feels, the one that the gear passes on with its `lost_torque`, over this `torque` [N m]:
    1 + `loss` while the rotor drives, 1 - `loss` while the load drives. It is constant between changes of sign, and 1
    at a torque of 0."""
    return 1.0 + loss * _direction(xp, w) * _sense(xp, torque, 1e-12)


def _sense(xp: Any, x: Any, least: float) -> Any:
    """The sign of a number beyond `least`, in proportion to it below."""
    return x / xp.maximum(xp.abs(x), least)


def _direction(xp: Any, w: Any) -> Any:
    return _sense(xp, w, W_REST)


def geared_motion(xp: Any, load: LoadPort, phi: Any, w: Any, J: Any, tau: Any, loss: Any) -> tuple[Any, Any]:
    """Acceleration [rad/s2] of a rotor that turns a load port through a gear, see `geared_acceleration`; and the
    torque [N m] that the gear passes on."""
    torque, inertia = load_torque(load, phi, w), load_inertia(load, phi)
    a = geared_acceleration(xp, torque, inertia, w, J, tau, loss)
    return a, inertia * a + torque


def geared_acceleration(xp: Any, load: Any, inertia: Any, w: Any, J: Any, tau: Any, loss: Any) -> Any:
    """Acceleration [rad/s2] of a rotor with the inertia `J` [kg m2] at the speed `w` [rad/s], which the torque `tau`
    [N m] drives through a gear with that `loss` against the `load` [N m] of a machine with that `inertia` [kg m2]:

        J a = tau - torque - loss |torque| sign(w), torque = inertia a + load

    Both signs of the torque give an acceleration. The right one is the lower one of a rotor that turns forward, the
    higher one of a rotor that turns backward.
    """
    part = loss * _direction(xp, w)
    driving = (tau - (1.0 + part) * load) / felt_inertia(xp, J, (1.0 + part) * inertia)
    driven = (tau - (1.0 - part) * load) / felt_inertia(xp, J, (1.0 - part) * inertia)
    return 0.5 * (driving + driven - _sense(xp, w, 1e-9) * xp.abs(driving - driven))


def felt_inertia(xp: Any, J: Any, inertia: Any) -> Any:
    """Inertia of a rotor, `J`, and of its load as the rotor feels it, `inertia` (see `felt_share`), in one unit; the
    load of a self-locking gear counts against the inertia of the rotor, in part."""
    return xp.maximum(J + inertia, _REST_OF_ROTOR * J)
