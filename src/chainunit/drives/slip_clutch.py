"""A friction clutch between a motor and its load that slips at its setting and passes this torque on while it slips.

The torque of dry friction, setting * sign(slip), is smoothed:

    tau = setting * s/sqrt(s^2 + w_smooth^2),    s = w_motor - w_driven

Below the setting the clutch therefore creeps by about w_smooth tau/setting, where a real one sticks.
"""

from __future__ import annotations

from typing import Any

from ..core.quantities import Value, declaration, quantity
from .slipping import Slipping, slipping


@declaration
class Parameters(Slipping):
    """Parameters of the clutch."""

    setting: Value = quantity("N.m", "torque at which it slips", default=10.0, above=0.0)
    w_smooth: Value = quantity(
        "rad/s", "slip below which the smoothed torque falls well below the setting", default=0.2, above=0.0
    )
    J_motor: Value = quantity("kg.m2", "inertia on the motor's side", default=0.0, min=0.0)
    J_driven: Value = quantity("kg.m2", "inertia on the driven side", default=0.0, min=0.0)


def torque(xp: Any, p: Any, w: Any, driven: Any) -> tuple[Any, Any]:
    """Torque on both shafts [N m] at their speeds [rad/s]."""
    slip = w - driven
    tau = p.setting * slip / xp.sqrt(slip * slip + p.w_smooth * p.w_smooth)
    return tau, tau


def _internal_step(xp: Any, p: Any) -> Any:
    """A tenth of a millisecond: the inertia behind the clutch, which decides, is not known here."""
    return 1e-4


SlipClutch = slipping(
    torque,
    lambda p: 1.0,
    Parameters,
    name="SlipClutch",
    text="A friction clutch between a motor and its load.",
    description=(
        "Friction clutch that slips at its setting: takes a load port and shows one, owns the driven shaft"
    ),
    internal_step=_internal_step,
)
