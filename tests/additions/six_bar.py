"""A Stephenson six-bar: crank, dyad, and a second dyad on a point of the coupler, whose pin pushes."""

from __future__ import annotations

from types import MappingProxyType
from typing import Any

from ..core.planar import Vec2
from ..core.ports import PortValues
from ..core.quantities import Value, declaration, group, quantity
from ..groups.body import Bar, Mass
from ..groups.driver import Crank
from ..groups.dyad import Dyad
from ..groups.loads import PinLosses, Resistance, Weight
from ..mechanism.linkage import Linkage
from ..mechanism.machine import MachineState
from ..mechanism.models import InverseMachine, ShaftMotion
from .parts import Force, Pin, Processing, Rod, force


@declaration
class Parameters:
    """Parameters of the six-bar."""

    crank_length: Value = quantity("m", "crank O1-A", default=0.1, above=0.0)
    coupler_length: Value = quantity("m", "coupler A-B", default=0.38, above=0.0)
    rocker_length: Value = quantity("m", "rocker O2-B", default=0.3, above=0.0)
    link_length: Value = quantity("m", "link P-Q", default=0.35, above=0.0)
    output_length: Value = quantity("m", "output link O3-Q", default=0.33, above=0.0)
    crank: Rod = group(Rod, "crank", default=Rod(m=5.0, s=0.03, I=0.014))
    coupler: Rod = group(Rod, "coupler", default=Rod(m=8.0, s=0.21, I=0.15))
    rocker: Rod = group(Rod, "rocker", default=Rod(m=4.5, s=0.14, I=0.05))
    link: Rod = group(Rod, "link", default=Rod(m=3.8, s=0.17, I=0.045))
    output: Rod = group(Rod, "output link", default=Rod(m=9.0, s=0.15, I=0.16))
    g: Value = quantity("m/s2", "gravity", default=9.81, min=0.0, tunable=True)
    ratio: Value = quantity("1", "gear ratio, motor turns per crank turn", default=1.0, above=0.0)
    pin: Pin = group(Pin, "pins", default=Pin(friction=0.05, diameter=0.03))
    joint_damping: Value = quantity("N.m.s/rad", "damping of each pin", default=0.0, min=0.0)
    processing: Processing = group(Processing, "resistance", default=Processing())


@declaration
class Inputs(ShaftMotion):
    """Motion of the motor shaft and resistance to the pusher."""

    resistance: Value = quantity(
        "N", "resistance to the pusher Q, against its motion", default=200.0, min=0.0
    )


@declaration
class Outputs(PortValues):
    """Torque, load port and reactions."""

    angle: Value = quantity("rad", "angle of the output link, counter-clockwise from the x axis")
    crank_bearing: Force = group(Force, "on the crank at O1, from the frame")
    crank_pin: Force = group(Force, "on the coupler at A, from the crank")
    output_bearing: Force = group(Force, "on the output link at O3, from the frame")
    power: Value = quantity("W", "power that the motor shaft takes, tau w", nominal=100.0)
    kinetic_energy: Value = quantity("J", "kinetic energy")
    potential_energy: Value = quantity("J", "potential energy")
    dissipated_power: Value = quantity("W", "power that friction and the pusher take", nominal=100.0)
    margin: Value = quantity("1", "least margin of both dyads; 0 is a dead position")
    tau: Value = quantity("N.m", "torque needed at the motor shaft, J a + tau_bias", nominal=100.0)


def _mass(rod: Rod) -> Mass:
    return Mass(rod.m, rod.s, rod.I)


def _linkage(xp: Any, p: Any, u: Any) -> Linkage:
    """Crank, dyad, dyad."""
    coupler = Bar("coupler", "A", p.coupler_length, _mass(p.coupler), {"P": (0.25, 0.2)})
    return Linkage(
        {"O1": Vec2(0.0, 0.0), "O2": Vec2(0.4, -0.05), "O3": Vec2(-0.3, 0.2)},
        Crank(Bar("crank", "O1", p.crank_length, _mass(p.crank)), "A"),
        (
            Dyad("B", coupler, Bar("rocker", "O2", p.rocker_length, _mass(p.rocker)), 1.0),
            Dyad(
                "Q",
                Bar("link", "P", p.link_length, _mass(p.link)),
                Bar("output", "O3", p.output_length, _mass(p.output)),
                -1.0,
            ),
        ),
        {
            "weight": Weight(p.g),
            "pusher": Resistance("Q", u.resistance, p.processing),
            "pins": PinLosses(p.pin, p.joint_damping),
        },
    )


def _probes(xp: Any, p: Any, u: Any, s: MachineState, a: Any) -> dict[str, Any]:
    """Angle of the output link, and the reactions."""
    reactions, output = s.reactions(a), s.m.links["output"].u
    return {
        "angle": xp.atan2(output.y, output.x),
        **{name: force(reactions[joint]) for name, joint in SixBar.joints.items()},
    }


SixBar = InverseMachine(
    name="SixBar",
    text="A Stephenson six-bar: motion of the motor shaft in, torque and reactions out.",
    description="Stephenson six-bar: crank, dyad, dyad; from motor angle and speed to torque and reactions",
    Parameters=Parameters,
    Inputs=Inputs,
    Outputs=Outputs,
    joints=MappingProxyType(
        {"crank_bearing": ("O1", "crank"), "crank_pin": ("A", "coupler"), "output_bearing": ("O3", "output")}
    ),
    linkage=_linkage,
    probes=_probes,
)
