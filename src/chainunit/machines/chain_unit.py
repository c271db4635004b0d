"""The chain unit: crank + dyad (coupler, rocker) + dyad (left organ) + dyad (right organ).

Symbols are those of papers 000 and 001: ``r, l, h`` crank, coupler and rocker arm; ``c, hy`` crank
bearing O1 = (-c, -hy) from the rocker pivot C, which is the origin; ``e`` rocker arm to the web hinge
A2; ``l1`` wall A1-B, ``l2`` web B-A2; ``z`` half width, A1 = (-z, 0) and A1' = (+z, 0). ``phi`` is the
crank angle from the upward vertical, clockwise; ``psi`` the rocker angle from the downward vertical,
positive towards +x. x points right, y up. A force is the force on the machine part from its support
or neighbour. The dyad of `chainunit.groups.dyad` gives eqs. (24)-(34), (41)-(45) of paper 000, with the
corrections of docs/physics.md.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Iterator, Mapping
from typing import Any, Literal, NamedTuple, TypeAlias

from ..core.model import FmuData, Requirement
from ..core.planar import ZERO, Link, Vec2
from ..core.ports import PortValues
from ..core.quantities import Quantity, Value, Variable, declaration, group, quantity
from ..groups.body import Bar, Mass
from ..groups.driver import Crank
from ..groups.dyad import Dyad
from ..groups.loads import Block, PinLosses, Resistance, Weight
from ..mechanism.linkage import Linkage
from ..mechanism.machine import MachineState, Mechanism
from ..mechanism.models import CrankMotion, InverseMachine
from .across import extended, place
from .crank_rocker import TURNS, half_width_range, longest_crank, pressure_angle, rocker_extremes
from .differing import laws_of
from .parts import Force, Pin, Processing, Rod, Stop, force

SideName = Literal["left", "right"]
SIDES: tuple[SideName, ...] = ("left", "right")
RodName = Literal["web", "wall"]
RODS: tuple[RodName, ...] = ("web", "wall")
Pulls: TypeAlias = dict[SideName, dict[RodName, dict[str, Any]]]
"""Axial pulls in the rods of the organs [N] by side, rod and pin, see `organ_pulls`."""


def other(side: SideName) -> SideName:
    """The opposite side."""
    return "right" if side == "left" else "left"


@declaration
class SideMasses:
    """Masses of one working organ, over all webs that share the rocker."""

    wall_mass: Value = quantity("kg", "mass of the wall (rod l1)", default=54.0, min=0.0, tunable=True)
    web_mass: Value = quantity("kg", "mass of the web (rod l2)", default=21.6, min=0.0, tunable=True)


@declaration
class Parameters:
    """Parameters of the chain unit. The start values describe the packaged machine: plausible assumptions of this
    package, as the papers print no masses and no absolute lengths."""

    r: Value = quantity("m", "crank O1-A", default=0.15, above=0.0, max=1e4)
    l: Value = quantity("m", "coupler A-Bd", default=1.5, above=0.0, max=1e4)
    h: Value = quantity("m", "rocker arm C-Bd", default=1.0, above=0.0, max=1e4)
    c: Value = quantity(
        "m",
        "crank bearing O1 lies this far left of the pivot C",
        default=math.sqrt(1.5**2 - 0.15**2),
        min=-1e4,
        max=1e4,
    )
    hy: Value = quantity(
        "m", "crank bearing O1 lies this far below the pivot C", default=1.0, min=-1e4, max=1e4
    )
    e: Value = quantity("m", "rocker arm C-A2 to the web hinge", default=0.81, above=0.0, max=1e4)
    l1: Value = quantity("m", "wall A1-B", default=1.35, above=0.0, max=1e4)
    l2: Value = quantity("m", "web B-A2", default=0.54, above=0.0, max=1e4)
    z: Value = quantity(
        "m",
        "half width: the wall hinges A1 lie this far left and right of C",
        default=0.853815,
        above=0.0,
        max=1e4,
    )
    g: Value = quantity("m/s2", "gravity", default=9.81, min=0.0, tunable=True)
    ratio: Value = quantity(
        "1", "gear ratio, motor turns per crank turn", default=1.0, above=0.0, max=1e6, usual=(1.0, 500.0)
    )
    crank: Rod = group(Rod, "crank O1-A", default=Rod(m=40.0, s=0.05, I=0.6))
    coupler: Rod = group(Rod, "coupler A-Bd", default=Rod(m=25.0, s=0.7, I=5.0))
    rocker: Rod = group(Rod, "rocker C-Bd", default=Rod(m=60.0, s=0.5, I=8.0))
    left: SideMasses = group(SideMasses, "left organ", default=SideMasses())
    right: SideMasses = group(SideMasses, "right organ", default=SideMasses())
    web_share: Value = quantity(
        "1",
        "share of the material that lies on the web; the rest lies on the wall",
        default=1.0,
        min=0.0,
        max=1.0,
        tunable=True,
    )
    rod_inertia: Value = quantity(
        "1",
        "factor on m l^2/12 of rods and material: 1 uniform rods, 0 point masses at the middle",
        default=1.0,
        min=0.0,
        max=100.0,
    )
    pin: Pin = group(Pin, "pins", default=Pin())
    joint_damping: Value = quantity(
        "N.m.s/rad", "viscous damping of each of the ten pins", default=0.0, min=0.0, tunable=True
    )
    processing: Processing = group(Processing, "processing force", default=Processing())


@declaration
class SideLoads:
    """The material on one organ."""

    material_mass: Value = quantity("kg", "material that lies on the organ", default=30.0, min=0.0)
    processing_force: Value = quantity(
        "N", "force on the web at B, against the motion of B", default=0.0, min=0.0, nominal=100.0
    )


@declaration
class PlacedLoads(SideLoads):
    """The material on one organ, and its place across the width."""

    across: Value = place("material")
    force_across: Value = place("processing force")


@declaration
class Feed:
    """The material on both organs in normal running."""

    left: SideLoads = group(SideLoads, "left organ", default=SideLoads())
    right: SideLoads = group(SideLoads, "right organ", default=SideLoads())


@declaration
class Inputs(Feed, CrankMotion):
    """Motion of the motor shaft, loads of the organs, and the stop."""

    stop: Stop = group(Stop, "stop that blocks the rocker", default=Stop())


@declaration
class RodMotion:
    """How a rod turns."""

    angle: Value = quantity("rad", "angle from the downward vertical, positive towards +x")
    w: Value = quantity("rad/s", "angular speed")
    a: Value = quantity("rad/s2", "angular acceleration")


@declaration
class Side:
    """Loads and motion of one organ."""

    tangential_load: Value = quantity(
        "N", "R_t, load across the rocker arm at A2; sign mirrored on the right", nominal=100.0
    )
    normal_load: Value = quantity("N", "R_n, load along the rocker arm at A2", nominal=100.0)
    support: Force = group(Force, "on the wall at A1, from the support")
    hinge: Force = group(Force, "on the wall at B, from the web")
    rocker_joint: Force = group(Force, "on the web at A2, from the rocker")
    web_pull: Value = quantity(
        "N", "least axial pull in the web; negative where a chain would have to push", nominal=100.0
    )
    wall_pull: Value = quantity(
        "N", "least axial pull in the wall; negative where the wall would have to push", nominal=100.0
    )
    wall: RodMotion = group(RodMotion, "wall, the line from A1 to B")
    web: RodMotion = group(RodMotion, "web, the line from A2 to B")
    spread_angle: Value = quantity("rad", "spread angle A1-B-A2 between wall and web")


@declaration
class RockerLoad:
    """The loads of both organs on the rocker."""

    tau: Value = quantity(
        "N.m", "torque along psi that the drive must apply to the rocker to carry both organs", nominal=100.0
    )
    tangential_load: Value = quantity("N", "R_t left minus R_t right", nominal=100.0)
    normal_load: Value = quantity("N", "R_n left plus R_n right", nominal=100.0)


@declaration
class Rocker(RockerLoad):
    """Motion and load of the rocker."""

    psi: Value = quantity("rad", "angle from the downward vertical, positive towards +x")
    w: Value = quantity("rad/s", "angular speed")
    a: Value = quantity("rad/s2", "angular acceleration")
    coupler_tangential: Value = quantity(
        "N", "force of the coupler on the rocker at Bd, across the rocker, positive along +psi", nominal=100.0
    )
    coupler_normal: Value = quantity(
        "N", "force of the coupler on the rocker at Bd, along the rocker, positive away from C", nominal=100.0
    )


@declaration
class Chamber:
    """Loads of both organs and of the rocker that carries them."""

    rocker: RockerLoad = group(RockerLoad, "rocker")
    left: Side = group(Side, "left organ")
    right: Side = group(Side, "right organ")


@declaration
class Frame(Force):
    """A force in the frame and its moment about C."""

    moment: Value = quantity(
        "N.m",
        "moment about C, counter-clockwise, with the reaction of the crank torque without friction",
        nominal=1000.0,
    )


@declaration
class Outputs(PortValues):
    """Torque, load port, motion of the rocker, and the forces on every part of the machine."""

    rocker: Rocker = group(Rocker, "rocker")
    left: Side = group(Side, "left organ")
    right: Side = group(Side, "right organ")
    pivot: Force = group(Force, "on the rocker at C, from the frame")
    crank_bearing: Force = group(Force, "on the crank at O1, from the frame")
    crank_pin: Force = group(Force, "on the coupler at A, from the crank")
    coupler_pin: Force = group(Force, "on the coupler at Bd, from the rocker")
    pressure_angle: Value = quantity("rad", "pressure angle at Bd, signed")
    frame: Frame = group(Frame, "from the machine on its frame")
    power: Value = quantity("W", "power that the motor shaft takes, tau w", nominal=100.0)
    kinetic_energy: Value = quantity("J", "kinetic energy")
    potential_energy: Value = quantity(
        "J", "potential energy, of weights zero at the level of C, and of the stop", nominal=1000.0
    )
    dissipated_power: Value = quantity(
        "W", "power that friction, damping, processing and the stop's damper take", nominal=100.0
    )
    margin: Value = quantity("1", "least |sin| of the three transmission angles; 0 is a dead position")
    tau: Value = quantity("N.m", "torque needed at the motor shaft, J a + tau_bias", nominal=100.0)


def supports(p: Any) -> dict[str, Vec2]:
    """The wall hinge A1 of the left and of the right organ."""
    return {"A1 left": Vec2(-p.z, 0.0), "A1 right": Vec2(p.z, 0.0)}


class OrganNames(NamedTuple):
    """The names of an organ's parts in the linkage (pins, links, load), and its `hand`: +1 left, -1 right."""

    a1: str
    b: str
    wall: str
    web: str
    processing: str
    hand: float


NAMES: dict[SideName, OrganNames] = {
    side: OrganNames(f"A1 {side}", f"B {side}", f"{side} wall", f"{side} web", f"{side} processing", hand)
    for side, hand in zip(SIDES, (1.0, -1.0), strict=True)
}


def organ_masses(p: Any, side: str, loads: Any) -> tuple[Any, Any]:
    """The masses of wall and web of an organ with the material of these loads on them [kg]."""
    masses, on_web = getattr(p, side), p.web_share * loads.material_mass
    return masses.wall_mass + (loads.material_mass - on_web), masses.web_mass + on_web


def organ(p: Any, u: Any, side: SideName) -> Dyad:
    """A working organ as two bars: wall (A1-B) and web (A2-B) with the material on it."""
    names, (on_wall, on_web) = NAMES[side], organ_masses(p, side, getattr(u, side))
    wall = Bar(names.wall, names.a1, p.l1, _rod(p, on_wall, p.l1))
    web = Bar(names.web, "A2", p.l2, _rod(p, on_web, p.l2))
    return Dyad(names.b, wall, web, -names.hand)


def _rod(p: Any, mass: Any, length: Any) -> Mass:
    return Mass(mass, 0.5 * length, p.rod_inertia * mass * (length * length) * (1.0 / 12.0))


def resistances(p: Any, u: Any) -> dict[str, Resistance]:
    """The processing force of each side."""
    law = p.processing
    return {
        names.processing: Resistance(names.b, getattr(u, side).processing_force, law)
        for side, names in NAMES.items()
    }


def _on_sides(xp: Any, p: Any, s: MachineState, a: Any, reactions: Mapping[Any, Vec2]) -> Chamber:
    """Loads and motion of the organs, and loads of the rocker, at the acceleration `a` of the coordinate."""
    sides = []
    rocker = s.m.links["rocker"]
    pulls = _pulls(s, reactions)
    for side, (a1, b, wall, web, _, hand) in NAMES.items():
        forces = reactions[a1, wall], reactions[b, wall], reactions["A2", web]
        rods = tuple(
            (link.u, link.t1 * s.w, link.t1 * a + link.t2 * (s.w * s.w))
            for link in (s.m.links[wall], s.m.links[web])
        )
        sides.append(
            Side(
                **on_side(rocker, hand, forces),
                **rod_motions(xp, hand, *rods),
                web_pull=xp.minimum(*pulls[side]["web"].values()),
                wall_pull=xp.minimum(*pulls[side]["wall"].values()),
            )
        )
    left, right = sides
    return Chamber(rocker=RockerLoad(**rocker_load(p, left, right)), left=left, right=right)


def _pulls(s: MachineState, reactions: Mapping[Any, Vec2]) -> Pulls:
    """Axial pull in the rods just inside their pins [N], from the reactions [N]."""
    pulls: Pulls = {}
    for side, (a1, b, wall, web, processing, _) in NAMES.items():
        of_wall, of_web = s.m.links[wall].u, s.m.links[web].u
        at_b = reactions[b, wall]
        pulls[side] = {
            "web": {
                "A2": -of_web.dot(reactions["A2", web]),
                "B": -of_web.dot(at_b - s.effects[processing].wrenches[0].force),
            },
            "wall": {"A1": -of_wall.dot(reactions[a1, wall]), "B": of_wall.dot(at_b)},
        }
    return pulls


def on_side(rocker: Link, hand: float, forces: tuple[Vec2, Vec2, Vec2]) -> dict[str, Any]:
    """The fields of `Side` except the pulls, from the forces at A1 and B on the wall and at A2 on the web; `hand` is
    +1 on the left and -1 on the right."""
    at_a1, at_b, at_a2 = forces
    return {
        # the force across the arm (X cos s + Y sin s with s = +-psi) and along it
        "tangential_load": rocker.u.turned().dot(at_a2) * hand,
        "normal_load": -rocker.u.dot(at_a2),
        "support": force(at_a1),
        "hinge": force(at_b),
        "rocker_joint": force(at_a2),
    }


def rod_motions(
    xp: Any, hand: float, wall: tuple[Vec2, Any, Any], web: tuple[Vec2, Any, Any]
) -> dict[str, Any]:
    """The fields of `Side` on the motion of wall and web, from a vector along each, towards B, its speed [rad/s] and
    acceleration [rad/s2]; `hand` is +1 on the left and -1 on the right. The spread angle is eta = alpha1' + alpha2' -
    psi of paper 000, before eq. (44); on the left, alpha1' is the angle of the wall, alpha2' - psi minus that of the
    web."""
    (along, *of_wall), (along_web, *of_web) = wall, web
    angle = xp.atan2(along.x, -along.y)
    # no jump at pi, which a chain passes where B goes through the line A1-A2
    spread = math.pi - xp.atan2(along_web.cross(along) * hand, -along_web.dot(along))
    return {
        "wall": RodMotion(angle=angle, w=of_wall[0], a=of_wall[1]),
        "web": RodMotion(angle=angle - spread * hand, w=of_web[0], a=of_web[1]),
        "spread_angle": spread,
    }


def rocker_load(p: Any, left: Side, right: Side, at_a2: Any = 0.0) -> dict[str, Any]:
    """The fields of `RockerLoad`; `at_a2` is the moment of the rocker on both organs in A2 [N m]."""
    tangential = left.tangential_load - right.tangential_load
    return {
        "tau": p.e * tangential + at_a2,
        "tangential_load": tangential,
        "normal_load": left.normal_load + right.normal_load,
    }


def chamber(xp: Any, p: Any, u: Any, psi: Any, psi_w: Any, psi_a: Any) -> Chamber:
    """Both organs on a rocker at angle `psi` with speed `psi_w` and acceleration `psi_a`, independent of the drive.
    The rocker is the crank of this linkage; its crank angle, from the upward vertical, falls as psi rises."""
    s = _organs_on_rocker(xp, p, u, psi, psi_w)
    return _on_sides(xp, p, s, -psi_a, s.reactions(-psi_a))


def organ_pulls(xp: Any, p: Any, u: Any, psi: Any, psi_w: Any, psi_a: Any) -> Pulls:
    """Axial pull in each rod just inside its pins [N], with the arguments of `chamber`: by side, rod ("web", "wall")
    and pin. Web: A2 and B; wall: A1 and B. Negative if the rod is pushed. The mean of both ends is the mean pull
    of the rod: below zero a chain is slack."""
    s = _organs_on_rocker(xp, p, u, psi, psi_w)
    return _pulls(s, s.reactions(-psi_a))


def _organs_on_rocker(xp: Any, p: Any, u: Any, psi: Any, psi_w: Any) -> MachineState:
    """The organs alone on the rocker, as a machine that the rocker drives: at its angle `psi` from the downward
    vertical and its speed `psi_w` [rad, rad/s]."""
    linkage = Linkage(
        {"C": ZERO, **supports(p)},
        Crank(Bar("rocker", "C", p.e), "A2"),
        tuple(organ(p, u, side) for side in SIDES),
        {"weight": Weight(p.g), **resistances(p, u)},
    )
    return MachineState(xp, Mechanism(xp, linkage, math.pi - psi), -psi_w)


_ON_DRIVE = (
    ("O1 crank bearing", "crank_bearing", "O1", "crank"),
    ("A crank pin", "crank_pin", "A", "coupler"),
    ("Bd coupler pin", "coupler_pin", "Bd", "coupler"),
    ("C rocker pivot", "pivot", "C", "rocker"),
)
_ON_SIDE = tuple(
    row
    for side, (a1, b, wall, web, *_) in NAMES.items()
    for row in (
        (f"A2 {side} web at rocker", f"{side}.rocker_joint", "A2", web),
        (f"B {side} hinge", f"{side}.hinge", b, wall),
        (f"A1 {side} support", f"{side}.support", a1, wall),
    )
)
"""Title, output, pin and link of each bearing."""
ON_DRIVE, ON_SIDE = ({output: (pin, link) for _, output, pin, link in rows} for rows in (_ON_DRIVE, _ON_SIDE))
JOINTS = {**ON_DRIVE, **ON_SIDE}
"""The joint of each reaction, by output."""
PINS = {title: output for title, output, _, _ in (*_ON_DRIVE, *_ON_SIDE)}
"""The output of each bearing, by title."""
PIN_NAMES = {
    (f"{pin} {link}" if pin == "A2" else pin).replace(" ", "_"): (pin, link) for pin, link in JOINTS.values()
}
"""The joint of each pin, by its name in a file."""


def on_drive(
    xp: Any, p: Any, s: Any, a: Any, reactions: Mapping[Any, Vec2], at_a1: Any = 0.0
) -> dict[str, Any]:
    """The fields of `Outputs` that do not depend on the kind of organ, at crank acceleration `a`; `at_a1` is the
    moment of the frame on both organs in A1 [N m]."""
    at_frame, moment = ZERO, at_a1
    for (pin, _), f in reactions.items():
        if pin in s.m.linkage.ground:
            at_frame = at_frame + f
            moment = moment + s.m.pins[pin].p.cross(f)
    (stop,) = s.effects["stop"].wrenches
    friction = s.effects["pins"].dissipative
    a_to_c = s.m.pins["A"].p
    return {
        **{name: force(reactions[joint]) for name, joint in ON_DRIVE.items()},
        "pressure_angle": pressure_angle(xp, p.l, p.h, a_to_c.squared()),
        "frame": Frame(fx=-at_frame.x, fy=-at_frame.y, moment=s.torque(a) - friction - moment - stop.moment),
    }


def rocker_motion(xp: Any, s: Any, a: Any) -> dict[str, Any]:
    """The motion of the rocker at crank acceleration `a`: fields of `Rocker`. The rocker never reaches the
    horizontal."""
    link = s.m.links["rocker"]
    return {"psi": xp.asin(link.u.x), "w": link.t1 * s.w, "a": link.t1 * a + link.t2 * (s.w * s.w)}


def coupler_force(s: Any, reactions: Mapping[Any, Vec2]) -> dict[str, Any]:
    """The parts of the force of the coupler on the rocker, R^t and R^n of eqs. (7)-(9) of paper 001: fields of
    `Rocker`."""
    along, on_coupler = s.m.links["rocker"].u, reactions[ON_DRIVE["coupler_pin"]]
    return {
        "coupler_tangential": -along.turned().dot(on_coupler),
        "coupler_normal": -along.dot(on_coupler),
    }


def drive(p: Any, u: Any, organs: tuple[Any, ...], processing: Mapping[str, Any]) -> Linkage:
    """The crank-rocker with its stop, and the organs on it."""
    rocker = Bar("rocker", "C", p.h, p.rocker, {"A2": (p.e, 0.0)})
    return Linkage(
        {"O1": Vec2(-p.c, -p.hy), "C": ZERO, **supports(p)},
        Crank(Bar("crank", "O1", p.r, p.crank), "A"),
        (Dyad("Bd", Bar("coupler", "A", p.l, p.coupler), rocker, -1.0), *organs),
        {
            "weight": Weight(p.g),
            **processing,
            "stop": Block("rocker", u.stop),
            "pins": PinLosses(p.pin, p.joint_damping, laws_of(getattr(p, "pins", None), PIN_NAMES)),
        },
    )


def _probes(xp: Any, p: Any, u: Any, s: MachineState, a: Any) -> dict[str, Any]:
    """The own outputs of the machine: motion of the rocker, loads of the organs by side, and forces of the drive."""
    reactions = s.reactions(a)
    organs = _on_sides(xp, p, s, a, reactions)
    return {
        "rocker": Rocker(**rocker_motion(xp, s, a), **coupler_force(s, reactions), **vars(organs.rocker)),
        "left": organs.left,
        "right": organs.right,
        **on_drive(xp, p, s, a, reactions),
    }


def _limits(xp: Any, p: Any) -> Iterator[tuple[Any, Any, Any]]:
    """Limits with which the crank turns, and both organs close over the whole swing of the rocker."""
    yield p.c, p.r, math.inf
    yield p.r, 0.0, longest_crank(xp, p.l, p.h, xp.sqrt(p.c * p.c + p.hy * p.hy))
    right, left = rocker_extremes(xp, p)
    swing = xp.maximum(xp.abs(right), xp.abs(left))
    yield swing, -math.inf, 0.5 * math.pi
    low, high = half_width_range(xp, p.e, p.l1, p.l2, swing, p.z)
    yield p.z, low, high


def _linkage(xp: Any, p: Any, u: Any) -> Linkage:
    """Crank, dyad, and an organ on each side."""
    return drive(p, u, tuple(organ(p, u, side) for side in SIDES), resistances(p, u))


def _further_quantities(
    xp: Any, p: Any, u: Any, x: Any, outputs: Mapping[str, Any]
) -> list[tuple[Variable, Any]]:
    """Those of every machine, and the mean pull in each rod of two bars, ``mean_pull(left.web)``: below zero a chain
    is slack."""
    columns = ChamberForces.usual_quantities(xp, p, u, x, outputs)
    pulls = organ_pulls(xp, p, u, *(outputs[f"rocker.{name}"] for name in ("psi", "w", "a")))
    for side in SIDES:
        for rod in RODS:
            description = f"mean pull of the {rod} of the {side} organ"
            variable = Variable(f"mean_pull({side}.{rod})", description, Quantity("N", description))
            columns.append((variable, 0.5 * sum(pulls[side][rod].values())))
    return columns


ChamberForces = InverseMachine(
    name="ChamberForces",
    text="The inverse model: motion of the motor shaft in, torque and every reaction out.",
    noun="chain unit",
    sides=SIDES,
    fmu_data=FmuData(
        notes="\n\nThe start values describe the packaged study, with three exceptions: the shaft stands, "
        "ratio is 1 (there 50), and the processing forces are 0 (there 10 N a side), which makes the rocker torque "
        "some percent less.",
        sizes={"stop.stiffness": 100.0, "stop.damping": 5.0},  # a stop that blocks nothing
    ),
    description=(
        "Forces in a chain unit: crank, coupler, rocker and two working organs; "
        "from motor angle and speed to torque, load port and every support reaction"
    ),
    direct_name="ChainUnit",
    direct_description=(
        "A chain unit that turns by itself: crank, coupler, rocker and two working organs; "
        "from motor torque to angle, speed, acceleration and every support reaction"
    ),
    Parameters=Parameters,
    Inputs=Inputs,
    Outputs=Outputs,
    Feed=Feed,
    joints=JOINTS,
    pins=PINS,
    angles={"ψ": "rocker"},
    within={"e": "h", "coupler.s": "l", "rocker.s": "h"},
    pin_names=PIN_NAMES,
    further=("width", "bar.diameter"),
    extend=functools.partial(extended, PlacedLoads),
    linkage=_linkage,
    probes=_probes,
    further_quantities=_further_quantities,
    required=(
        Requirement("c", "m", "the crank circle must stay left of the pivot C", depends=("r",)),
        dataclasses.replace(TURNS, context=("l", "h", "c", "hy")),
        Requirement(
            "largest rocker angle",
            "rad",
            "the rocker swings beyond the horizontal",
            ("r", "l", "h", "c", "hy"),
        ),
        Requirement(
            "z",
            "m",
            "the organs cannot follow the rocker over its swing",
            ("l1", "l2", "e"),
            "lengthen l1 + l2, or lessen the swing by a shorter r or a longer h",
            ("r", "l", "h", "c", "hy"),
        ),
    ),
    requirements=_limits,
)

ChainUnit = ChamberForces.direct()
"""The machine that turns by itself: motor torque in, motion out."""
