"""A fluid coupling with constant filling: a pump wheel on the motor's shaft and a turbine wheel on the driven one.

The torque is a parabola of the speed of the faster wheel, and rises with the slip s towards its peak in a stall:

    T = T_rated (w/w_rated)^2 filling k(s),    s = (w - w_driven)/w
    k = peak_factor (1 + b) s/(s + b),         b = slip (peak_factor - 1)/(1 - peak_factor slip)

so that k is 1 at the rated slip and `peak_factor` in a stall, where s = 1. This is T = lambda(s) rho w^2 D^5 with the
four numbers of a data sheet in place of lambda and D. Where the machine overtakes the motor, the turbine is the
faster wheel, and the torque brakes. With less oil the torque at each slip falls in proportion, which is assumed.
"""

from __future__ import annotations

from typing import Any

from ..core.model import FmuData
from ..core.quantities import Value, declaration, quantity
from .slipping import Slipping, slipping

_AT_REST = 1e-9
"""Speed [rad/s] in place of none, so that the torque at rest is regular."""


@declaration
class FluidCouplingData:
    """A fluid coupling by its data sheet. The start values are assumptions of this package."""

    rated_power: Value = quantity("W", "rated power at the motor's shaft", default=15e3, above=0.0)
    rated_speed: Value = quantity(
        "rad/s", "rated speed of the motor's shaft", default=152.0, above=0.0, kind="speed"
    )
    rated_slip: Value = quantity(
        "1", "rated slip: at the rated power and speed", default=0.03, min=0.002, max=0.15, kind="percent"
    )
    peak_factor: Value = quantity(
        "1", "torque in a stall at the rated speed, over the rated torque", default=2.0, min=1.1, max=5.0
    )
    filling: Value = quantity(
        "1",
        "oil over that of the rated data; the torque is in proportion, which is assumed",
        default=1.0,
        min=0.1,
        max=1.5,
        kind="percent",
    )
    J_motor: Value = quantity("kg.m2", "inertia of pump wheel and housing", default=0.08, min=0.0)
    J_driven: Value = quantity("kg.m2", "inertia of the turbine wheel", default=0.04, above=0.0)

    @property
    def stall_torque(self) -> float:
        """Torque in a stall with the motor at the rated speed [N m]."""
        return float(self.filling * self.peak_factor * self.rated_power / self.rated_speed)


@declaration
class Parameters(Slipping, FluidCouplingData):
    """Parameters of the coupling, which starts without slip."""


def softness(p: Any) -> Any:
    """The number b of the torque's rise with the slip."""
    return p.rated_slip * (p.peak_factor - 1.0) / (1.0 - p.peak_factor * p.rated_slip)


def torque(xp: Any, p: Any, w: Any, driven: Any) -> tuple[Any, Any]:
    """Torque on both shafts [N m] at their speeds [rad/s]: a coupling has no other support."""
    b = softness(p)
    parabola = (
        p.filling
        * p.peak_factor
        * (1.0 + b)
        * p.rated_power
        / (p.rated_speed * p.rated_speed * p.rated_speed)
    )
    faster, lag = xp.maximum(xp.abs(w), xp.abs(driven)), w - driven
    tau = parabola * faster * faster * lag / (xp.abs(lag) + b * faster + _AT_REST)
    return tau, tau


def _internal_step(xp: Any, p: Any) -> Any:
    """At most 0.25 ms, and half of the time in which the turbine wheel alone follows the pump at rated speed."""
    b = softness(p)
    steepest = p.filling * p.peak_factor * (1.0 + b) / b * p.rated_power / (p.rated_speed * p.rated_speed)
    return xp.minimum(2.5e-4, 0.5 * p.J_driven / steepest)


FluidCoupling = slipping(
    torque,
    lambda p: 1.0,
    Parameters,
    name="FluidCoupling",
    text="""\
    A fluid coupling with constant filling between a motor and a machine. A motor that starts feels little load at
    first, as the torque grows with the square of its speed, and a machine that is stuck puts no more on it than the
    stall torque. Rated power, speed, slip and peak factor stand in the data sheet.
    """,
    description=(
        "Fluid coupling between motor and machine: torque by the square of the speed, rising with the slip; takes a "
        "load port and shows one"
    ),
    internal_step=_internal_step,
    fmu_data=FmuData(sizes={"w": 60.0}),  # near the rated speed
)
