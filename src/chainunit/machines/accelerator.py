"""The accelerator of a crusher: a rotor that throws the material, as a crank without groups.

x points right, y up, the origin is the axis O. The angle of the rotor counts from the upward vertical, clockwise. A
force is the force on the rotor from its bearing.
"""

from __future__ import annotations

from typing import Any

from ..core.planar import ZERO
from ..core.ports import PortValues
from ..core.quantities import Value, declaration, group, quantity
from ..groups.body import Bar
from ..groups.driver import Crank
from ..groups.loads import Brake, PinLosses, Weight
from ..mechanism.linkage import Linkage
from ..mechanism.machine import MachineState
from ..mechanism.models import CrankMotion, InverseMachine
from .parts import Force, Pin, Rod, force


@declaration
class BrakeLaw:
    """The law of a torque against the rotation."""

    w_smooth: Value = quantity(
        "rad/s", "speed below which the torque is smoothed", default=0.02, min=1e-9, tunable=True
    )


@declaration
class Parameters:
    """Parameters of the accelerator. The start values are assumptions of this package: paper 002 prints no dimensions
    and no inertias."""

    radius: Value = quantity("m", "axis O to the rim", default=0.45, above=0.0, max=1e4)
    g: Value = quantity("m/s2", "gravity", default=9.81, min=0.0, tunable=True)
    ratio: Value = quantity(
        "1", "gear ratio, motor turns per turn of the rotor", default=1.0, above=0.0, max=1e6
    )
    rotor: Rod = group(
        Rod, "rotor on the axis O, with the material in it", default=Rod(m=400.0, s=0.0, I=60.0)
    )
    pin: Pin = group(Pin, "bearing", default=Pin(friction=0.0, diameter=0.12))
    joint_damping: Value = quantity(
        "N.m.s/rad", "viscous friction of the bearing", default=0.0, min=0.0, tunable=True
    )
    brake: BrakeLaw = group(BrakeLaw, "torque of the material", default=BrakeLaw())


@declaration
class Inputs(CrankMotion):
    """Motion of the motor shaft and torque of the material."""

    load: Value = quantity(
        "N.m",
        "torque of the material on the rotor, against its motion",
        default=375.0,
        min=0.0,
        nominal=100.0,
    )


@declaration
class Outputs(PortValues):
    """Torque, load port, rim and bearing."""

    rim_speed: Value = quantity("m/s", "speed of the rim, positive clockwise", nominal=10.0)
    bearing: Force = group(Force, "on the rotor at O, from the frame")
    power: Value = quantity("W", "power that the motor shaft takes, tau w", nominal=100.0)
    kinetic_energy: Value = quantity("J", "kinetic energy", nominal=1e5)
    potential_energy: Value = quantity("J", "potential energy of the weight, zero with the centroid at O")
    dissipated_power: Value = quantity("W", "power that friction and material take", nominal=1e4)
    margin: Value = quantity("1", "1: a rotor has no dead position")
    tau: Value = quantity("N.m", "torque needed at the motor shaft, J a + tau_bias", nominal=100.0)


def _linkage(xp: Any, p: Any, u: Any) -> Linkage:
    """A crank alone."""
    return Linkage(
        ground={"O": ZERO},
        driver=Crank(Bar("rotor", "O", p.radius, p.rotor), "rim"),
        groups=(),
        loads={
            "weight": Weight(p.g),
            "material": Brake("rotor", u.load, p.brake),
            "pins": PinLosses(p.pin, p.joint_damping),
        },
    )


def _probes(xp: Any, p: Any, u: Any, s: MachineState, a: Any) -> dict[str, Any]:
    """Rim and bearing."""
    return {"rim_speed": p.radius * s.w, "bearing": force(s.reactions(a)["O", "rotor"])}


Accelerator = InverseMachine(
    name="Accelerator",
    text="The accelerator of a crusher: motion of the motor shaft in, torque and reaction of the bearing out.",
    noun="accelerator",
    driver_noun="accelerator",
    description=(
        "Accelerator of a crusher: a rotor that the material brakes; from motor angle and speed to torque, load port "
        "and reaction of the bearing"
    ),
    Parameters=Parameters,
    Inputs=Inputs,
    Outputs=Outputs,
    joints={"bearing": ("O", "rotor")},
    pins={"O rotor bearing": "bearing"},
    usual_speed=(10.0, 1000.0),
    linkage=_linkage,
    probes=_probes,
)
