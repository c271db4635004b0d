"""A rigid gear between a driver and a machine with a slow shaft of its own, without states and loss."""

from __future__ import annotations

from typing import Any

from ..core.model import Model, Part
from ..core.ports import (
    LoadPort,
    PortSlopes,
    PortValues,
    ShaftInput,
    ShaftMotion,
    line_terminals,
    load_inertia,
    load_torque,
)
from ..core.quantities import Value, declaration, group, quantity


@declaration
class GearParameters:
    """Parameters of the gear."""

    ratio: Value = quantity(
        "1", "gear ratio, motor turns per turn of the machine", default=1.0, above=0.0, max=1e6
    )


@declaration
class SlowShaft:
    """The shaft of the machine."""

    phi: Value = quantity("rad", "angle")
    w: Value = quantity("rad/s", "speed")
    a: Value = quantity("rad/s2", "acceleration", nominal=100.0)
    tau: Value = quantity("N.m", "torque given to the machine", nominal=100.0)


@declaration
class GearOutputs(PortSlopes, PortValues):
    """The port at the motor, and the shaft of the machine."""

    tau: Value = quantity("N.m", "torque that the motor has to give", nominal=100.0)
    power: Value = quantity("W", "power that the motor gives", nominal=100.0)
    driven: SlowShaft = group(SlowShaft, "driven shaft")


def geared(ratio: Any, load: LoadPort, u: ShaftMotion) -> GearOutputs:
    """The `load` port of the machine as the motor with the motion `u` sees it: the motor's angle and speed are
    `ratio` times larger, its torque so much smaller; a derivative by its angle, speed or acceleration divides by the
    ratio once more."""
    phi, w, a = u.phi / ratio, u.w / ratio, u.a / ratio
    tau = load_inertia(load, phi) * a + load_torque(load, phi, w)
    return GearOutputs(
        tau_bias=load.tau_bias / ratio,
        J=load.J / (ratio * ratio),
        dJ_dphi=load.dJ_dphi / (ratio * ratio * ratio),
        phi0=load.phi0 * ratio,
        w0=load.w0 * ratio,
        tau_bias_dphi=load.tau_bias_dphi / (ratio * ratio),
        tau_bias_dw=load.tau_bias_dw / (ratio * ratio),
        tau=tau / ratio,
        power=tau * w,
        driven=SlowShaft(phi=phi, w=w, a=a, tau=tau),
    )


def _outputs(xp: Any, p: Any, u: Any, x: Any, s: None) -> GearOutputs:
    return geared(p.ratio, u.load, u)


Gear = Model(
    name="Gear",
    text="""A rigid gear without mass and loss: it divides angle and speed, and gives the load of the machine to the
    motor.""",
    description=(
        "Rigid gear without mass and loss between motor and machine: takes a load port and shows one"
    ),
    Parameters=GearParameters,
    Inputs=ShaftInput,
    terminals=line_terminals(),
    parts=(Part(GearOutputs, _outputs),),
)
