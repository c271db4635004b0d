"""The knife drive of the paper cutter BR-125 (paper 003): crank + dyad + triad.

The crank is O1-A. The dyad has the coupler AB and the rocker BO2. The triad has the ternary link CDE, which carries
the knife, and the legs BC, O3D and O4E. BC hangs on the pin B, where three links meet. x points right, y up. A force
is the force on the part that its description names first. The crank angle q counts from the upward vertical,
clockwise; B lies to the left of the ray from A to O2.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Any

from ..core.engines import MATH
from ..core.planar import Vec2
from ..core.ports import PortValues
from ..core.quantities import Value, declaration, group, quantity
from ..groups import triad
from ..groups.body import Bar, Mass
from ..groups.driver import Crank
from ..groups.dyad import Dyad
from ..groups.legs import RodLeg
from ..groups.loads import Cut, PinLosses, Push, Weight
from ..groups.triad import Pose, Triad
from ..mechanism.linkage import Linkage
from ..mechanism.machine import MachineState, Mechanism
from ..mechanism.models import CrankMotion, InverseMachine
from .crank_rocker import TURNS, longest_crank
from .differing import laws_of, with_pins
from .parts import Force, Pin, Rod, force


@declaration
class Point:
    """A point of the frame, or of a link in its own frame."""

    x: Value = quantity("m", "x", default=0.0, min=-1e4, max=1e4)
    y: Value = quantity("m", "y", default=0.0, min=-1e4, max=1e4)


@declaration
class Lengths:
    """The binary links."""

    r: Value = quantity("m", "crank O1-A", default=0.06, above=0.0, max=1e4)
    ab: Value = quantity("m", "coupler A-B", default=0.37, above=0.0, max=1e4)
    bo2: Value = quantity("m", "rocker B-O2", default=0.30, above=0.0, max=1e4)
    bc: Value = quantity("m", "leg B-C", default=0.62, above=0.0, max=1e4)
    o3d: Value = quantity("m", "leg O3-D", default=0.39, above=0.0, max=1e4)
    o4e: Value = quantity("m", "leg O4-E", default=0.41, above=0.0, max=1e4)


@declaration
class Knife:
    """The ternary link, in its own frame."""

    m: Value = quantity("kg", "mass", default=85.0, min=0.0, tunable=True)
    I: Value = quantity("kg.m2", "moment of inertia about the centroid", default=7.5, min=0.0, tunable=True)
    centroid: Point = group(Point, "centroid", default=Point(x=0.41, y=-0.09))
    c: Point = group(Point, "pin C", default=Point(x=-0.06, y=-0.14))
    d: Point = group(Point, "pin D", default=Point())
    e: Point = group(Point, "pin E", default=Point(x=0.80))
    blade: Point = group(Point, "middle of the cutting edge", default=Point(x=0.40, y=-0.22))


@declaration
class Assembly:
    """The pose of the knife from which Newton's method leads to the assembly mode at crank angle 0; the function
    `modes` lists all assembly modes."""

    x: Value = quantity("m", "origin of its frame, x", default=1.0460696, min=-1e4, max=1e4)
    y: Value = quantity("m", "origin of its frame, y", default=0.0172492, min=-1e4, max=1e4)
    theta: Value = quantity(
        "rad", "angle of its x axis, counter-clockwise", default=-0.0116588, min=-7.0, max=7.0
    )


@declaration
class Stack:
    """The stack of paper and its resistance."""

    top: Value = quantity("m", "height y of its top", default=-0.185, min=-1e4, max=1e4, tunable=True)
    table: Value = quantity(
        "m", "height y of the table below it", default=-0.234, min=-1e4, max=1e4, tunable=True
    )
    edge: Value = quantity(
        "m", "distance over which the resistance rises and falls", default=0.002, min=1e-6, tunable=True
    )
    v_smooth: Value = quantity(
        "m/s",
        "speed of the blade below which the resistance is smoothed",
        default=0.005,
        min=1e-9,
        tunable=True,
    )


@declaration
class Parameters(Lengths):
    """Parameters of the knife drive. The start values are assumptions of this package: paper 003 prints no dimensions
    and no masses."""

    o1: Point = group(Point, "crank bearing O1", default=Point(y=-0.1))
    o2: Point = group(Point, "rocker bearing O2", default=Point(x=0.33, y=-0.4))
    o3: Point = group(Point, "bearing O3", default=Point(x=0.86, y=0.36))
    o4: Point = group(Point, "bearing O4", default=Point(x=1.62, y=0.35))
    crank: Rod = group(Rod, "crank O1-A", default=Rod(m=12.0, s=0.02, I=0.05))
    coupler: Rod = group(Rod, "coupler A-B", default=Rod(m=9.0, s=0.185, I=0.11))
    rocker: Rod = group(Rod, "rocker O2-B", default=Rod(m=8.0, s=0.15, I=0.07))
    leg_b: Rod = group(Rod, "leg B-C", default=Rod(m=11.0, s=0.31, I=0.36))
    leg_3: Rod = group(Rod, "leg O3-D", default=Rod(m=7.0, s=0.195, I=0.09))
    leg_4: Rod = group(Rod, "leg O4-E", default=Rod(m=7.5, s=0.205, I=0.1))
    knife: Knife = group(Knife, "knife CDE", default=Knife())
    assembly: Assembly = group(Assembly, "assembly", default=Assembly())
    stack: Stack = group(Stack, "stack", default=Stack())
    g: Value = quantity("m/s2", "gravity", default=9.81, min=0.0, tunable=True)
    ratio: Value = quantity("1", "gear ratio, motor turns per crank turn", default=1.0, above=0.0, max=1e6)
    pin: Pin = group(Pin, "pins", default=Pin(friction=0.0, diameter=0.04))
    joint_damping: Value = quantity(
        "N.m.s/rad", "viscous damping of each of the ten pins", default=0.0, min=0.0, tunable=True
    )


@declaration
class CutForce:
    """The cut in normal running."""

    cut_force: Value = quantity(
        "N", "resistance of the stack to the blade on its way down", default=0.0, min=0.0, nominal=1e4
    )


@declaration
class Inputs(CutForce, CrankMotion):
    """Motion of the motor shaft and forces on the blade."""

    blade: Force = group(Force, "further force on the blade", default=Force(fx=0.0, fy=0.0))


@declaration
class Blade:
    """The cutting edge."""

    x: Value = quantity("m", "position x of its middle")
    y: Value = quantity("m", "position y of its middle")
    vx: Value = quantity("m/s", "speed along x")
    vy: Value = quantity("m/s", "speed along y")
    tilt: Value = quantity("rad", "angle against the horizontal, counter-clockwise")
    cut_fx: Value = quantity("N", "resistance of the stack, force along x on the blade", nominal=1e4)
    cut_fy: Value = quantity("N", "resistance of the stack, force along y on the blade", nominal=1e4)


@declaration
class Outputs(PortValues):
    """Torque, load port, blade and every reaction."""

    tau: Value = quantity("N.m", "torque needed at the motor shaft, J a + tau_bias", nominal=100.0)
    blade: Blade = group(Blade, "blade")
    crank_bearing: Force = group(Force, "on the crank at O1, from the frame")
    crank_pin: Force = group(Force, "on the coupler at A, from the crank")
    coupler_pin: Force = group(Force, "on the coupler at B, from the rocker")
    leg_pin: Force = group(Force, "on the leg BC at B, from the rocker")
    rocker_bearing: Force = group(Force, "on the rocker at O2, from the frame")
    c_pin: Force = group(Force, "on the leg BC at C, from the knife")
    d_pin: Force = group(Force, "on the leg O3D at D, from the knife")
    e_pin: Force = group(Force, "on the leg O4E at E, from the knife")
    o3_bearing: Force = group(Force, "on the leg O3D at O3, from the frame")
    o4_bearing: Force = group(Force, "on the leg O4E at O4, from the frame")
    power: Value = quantity("W", "power that the motor shaft takes, tau w", nominal=100.0)
    kinetic_energy: Value = quantity("J", "kinetic energy")
    potential_energy: Value = quantity("J", "potential energy of the weights, zero at y = 0", nominal=1000.0)
    dissipated_power: Value = quantity(
        "W", "power that friction, damping, cutting and the further force on the blade take", nominal=100.0
    )
    margin: Value = quantity("1", "the lesser margin of dyad and triad; 0 is a dead position")


def _vector(point: Any) -> Vec2:
    return Vec2(point.x, point.y)


_BEARINGS = (
    ("O1 crank bearing", "crank_bearing", "O1", "crank"),
    ("A crank pin", "crank_pin", "A", "coupler"),
    ("B coupler AB", "coupler_pin", "B", "coupler"),
    ("B leg BC", "leg_pin", "B", "leg_b"),
    ("O2 rocker bearing", "rocker_bearing", "O2", "rocker"),
    ("C", "c_pin", "C", "leg_b"),
    ("D", "d_pin", "D", "leg_3"),
    ("E", "e_pin", "E", "leg_4"),
    ("O3 bearing", "o3_bearing", "O3", "leg_3"),
    ("O4 bearing", "o4_bearing", "O4", "leg_4"),
)
"""Title, output, pin and link of each bearing."""
JOINTS = {output: (pin, link) for _, output, pin, link in _BEARINGS}
"""The joint of each reaction, by output."""
PINS = {title: output for title, output, _, _ in _BEARINGS}
"""The output of each bearing, by title."""
PIN_NAMES = {output if joint[0] == "B" else joint[0]: joint for output, joint in JOINTS.items()}
"""The joint of each pin, by its name in a file; two pins lie in B."""


def _probes(xp: Any, p: Any, u: Any, s: MachineState, a: Any) -> dict[str, Any]:
    """The own outputs of the machine: motion and cut of the blade, and the forces in the joints."""
    edge, knife, reactions = s.m.pins["blade"], s.m.links["knife"], s.reactions(a)
    (cut,) = s.effects["cut"].wrenches
    return {
        "blade": Blade(
            x=edge.p.x,
            y=edge.p.y,
            vx=edge.p1.x * s.w,
            vy=edge.p1.y * s.w,
            tilt=xp.atan2(knife.u.y, knife.u.x),
            cut_fx=cut.force.x,
            cut_fy=cut.force.y,
        ),
        **{name: force(reactions[joint]) for name, joint in JOINTS.items()},
    }


def _linkage(xp: Any, p: Any, u: Any) -> Linkage:
    """Crank, dyad and triad, with the weight, the cut, the further force on the blade and the pin losses."""
    knife = p.knife
    return Linkage(
        ground={"O1": _vector(p.o1), "O2": _vector(p.o2), "O3": _vector(p.o3), "O4": _vector(p.o4)},
        driver=Crank(Bar("crank", "O1", p.r, p.crank), "A"),
        groups=(
            Dyad("B", Bar("coupler", "A", p.ab, p.coupler), Bar("rocker", "O2", p.bo2, p.rocker), 1.0),
            Triad(
                "knife",
                Mass(knife.m, knife.centroid.x, knife.I, knife.centroid.y),
                (
                    RodLeg(Bar("leg_b", "B", p.bc, p.leg_b), "C", _vector(knife.c)),
                    RodLeg(Bar("leg_3", "O3", p.o3d, p.leg_3), "D", _vector(knife.d)),
                    RodLeg(Bar("leg_4", "O4", p.o4e, p.leg_4), "E", _vector(knife.e)),
                ),
                {"blade": (knife.blade.x, knife.blade.y)},
                Pose(p.assembly.x, p.assembly.y, p.assembly.theta),
            ),
        ),
        loads={
            "weight": Weight(p.g),
            "cut": Cut("blade", u.cut_force, p.stack),
            "push": Push("blade", Vec2(u.blade.fx, u.blade.fy)),
            "pins": PinLosses(p.pin, p.joint_damping, laws_of(getattr(p, "pins", None), PIN_NAMES)),
        },
    )


def _limits(xp: Any, p: Any) -> Iterator[tuple[Any, Any, Any]]:
    """Limits with which the crank turns, and the triad closes over the whole turn, clear of its dead
    positions."""
    between = _vector(p.o1) - _vector(p.o2)
    yield p.r, 0.0, longest_crank(xp, p.ab, p.bo2, xp.sqrt(between.squared()))
    yield from triad.limits(p.derived)


KnifeDrive = InverseMachine(
    name="KnifeDrive",
    text="The knife drive of a paper cutter: motion of the motor shaft in, torque and every reaction out.",
    noun="knife drive",
    cuts=True,
    description=(
        "Knife drive of a paper cutter: crank, dyad and triad; from motor angle and speed to torque, load port, "
        "blade and every reaction"
    ),
    Parameters=Parameters,
    Inputs=Inputs,
    Outputs=Outputs,
    Feed=CutForce,
    joints=JOINTS,
    pins=PINS,
    pin_names=PIN_NAMES,
    extend=with_pins,
    linkage=_linkage,
    probes=_probes,
    required=(
        dataclasses.replace(
            TURNS,
            context=("ab", "bo2", "o1.x", "o1.y", "o2.x", "o2.y"),
            remedy="|O1 O2| must be > |ab - bo2| and < ab + bo2 for any crank",
        ),
        *triad.requirements(("bc", "o3d", "o4e"), ("assembly.x", "assembly.y", "assembly.theta")),
    ),
    requirements=_limits,
)


def modes(p: Any, q: float = 0.0) -> list[Pose]:
    """All poses in which the triad can be assembled at crank angle `q` [rad]; one of them, at 0, is `assembly`."""
    linkage = KnifeDrive.linkage(MATH, p, Inputs())
    _, group = linkage.groups
    assert isinstance(group, Triad)
    return group.modes(Mechanism(MATH, linkage.before(1), q).pins)
