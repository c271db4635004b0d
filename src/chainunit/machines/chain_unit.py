"""The chain unit: crank + dyad (coupler, rocker) + dyad (left organ) + dyad (right organ).

Symbols are those of papers 000 and 001: ``r, l, h`` crank, coupler and rocker arm; ``c, hy`` crank
bearing O1 = (-c, -hy) from the rocker pivot C, which is the origin; ``e`` rocker arm to the web hinge
A2; ``l1`` wall A1-B, ``l2`` web B-A2; ``z`` half width, A1 = (-z, 0) and A1' = (+z, 0). ``phi`` is the
crank angle from the upward vertical, clockwise; ``psi`` the rocker angle from the downward vertical,
positive towards +x. x right, y up. A force is the one on the machine part from its support
or neighbour. Paper 000's eqs. (24)-(34), (41)-(45), with the corrections of docs/physics.md, follow from
the dyad of `chainunit.groups.dyad`.

Below, q is the crank angle, `w` and `a` its derivatives; only at the port are `phi w a tau J` the
motor's, with the gear `ratio` between.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from typing import Any, Literal

from ..groups.body import Body, point_load, reflected, total
from ..groups.driver import crank, driving_torque
from ..groups.dyad import Dyad
from ..groups.friction import pin_losses
from ..model import Model, Part, Requirement
from ..planar import ZERO, Link, Motion, Vec2
from ..ports import PortSlopes, PortValues, Start, flanges, load_terminal
from ..quantities import Value, declaration, group, quantity
from .crank_rocker import TURNS, angle_at_pivot, longest_crank, pressure_angle
from .driven import DrivenState, slopes
from .parts import Force, Pin, Rod, force

SideName = Literal["left", "right"]
SIDES: tuple[SideName, ...] = ("left", "right")


def other(side: SideName) -> SideName:
    """The side across."""
    return "right" if side == "left" else "left"


@declaration
class SideMasses:
    """Masses of one working organ, over all webs that share the rocker."""

    wall_mass: Value = quantity("kg", "mass of the wall (rod l1)", default=54.0, min=0.0, tunable=True)
    web_mass: Value = quantity("kg", "mass of the web (rod l2)", default=21.6, min=0.0, tunable=True)


@declaration
class Processing:
    """The law of the processing force."""

    v_smooth: Value = quantity(
        "m/s", "speed of B below which the force is smoothed", default=0.02, min=1e-9, tunable=True
    )


@declaration
class Parameters:
    """Parameters of the chain unit. The start values are the packaged machine: plausible, but ours; the
    papers print no masses and no absolute lengths."""

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
    crank: Rod = group(Rod, "crank", default=Rod(m=40.0, s=0.05, I=0.6))
    coupler: Rod = group(Rod, "coupler", default=Rod(m=25.0, s=0.7, I=5.0))
    rocker: Rod = group(Rod, "rocker", default=Rod(m=60.0, s=0.5, I=8.0))
    left: SideMasses = group(SideMasses, "left organ", default=SideMasses())
    right: SideMasses = group(SideMasses, "right organ", default=SideMasses())
    web_share: Value = quantity(
        "1",
        "part of the material that lies on the web, the rest on the wall",
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
    """What the material does to one organ."""

    material_mass: Value = quantity("kg", "material that lies on the organ", default=30.0, min=0.0)
    processing_force: Value = quantity(
        "N", "force on the web at B, against the motion of B", default=0.0, min=0.0, nominal=100.0
    )


@declaration
class Stop:
    """A spring and damper between rocker and frame, which hold a blocked rocker; off where both are zero. The
    smoothed friction and processing force hold nothing at rest."""

    stiffness: Value = quantity("N.m/rad", "stiffness", default=0.0, min=0.0, nominal=1e6)
    damping: Value = quantity("N.m.s/rad", "damping", default=0.0, min=0.0, nominal=1e4)
    psi: Value = quantity("rad", "rocker angle at which the spring is free", default=0.0)


@declaration
class Inputs:
    """Motion of the motor shaft and loads of the organs."""

    phi: Value = quantity(
        "rad", "motor angle; crank angle is phi/ratio, from the upward vertical, clockwise", default=0.0
    )
    w: Value = quantity("rad/s", "motor speed", default=0.0)
    a: Value = quantity("rad/s2", "motor acceleration", default=0.0)
    left: SideLoads = group(SideLoads, "left organ", default=SideLoads())
    right: SideLoads = group(SideLoads, "right organ", default=SideLoads())
    stop: Stop = group(Stop, "stop that blocks the rocker", default=Stop())


@declaration
class Side:
    """Loads of one organ."""

    tangential_load: Value = quantity(
        "N", "R_t, load across the rocker arm at A2; both sides mirrored alike", nominal=100.0
    )
    normal_load: Value = quantity("N", "R_n, load along the rocker arm at A2", nominal=100.0)
    support: Force = group(Force, "on the wall at A1, from the support")
    hinge: Force = group(Force, "on the wall at B, from the web")
    rocker_joint: Force = group(Force, "on the web at A2, from the rocker")
    web_pull: Value = quantity(
        "N", "least axial pull in the web; below zero the chain would have to push", nominal=100.0
    )
    wall_pull: Value = quantity(
        "N", "least axial pull in the wall; below zero the wall would have to push", nominal=100.0
    )


@declaration
class RockerLoad:
    """What both organs ask of the rocker."""

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
class Loads:
    """Motion of the rocker, and what every part of the machine carries."""

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


@declaration
class Outputs(Loads, PortValues):
    """Torque, load port, motion and every reaction."""

    tau: Value = quantity("N.m", "torque needed at the motor shaft, J a + tau_bias", nominal=100.0)


@declaration
class DirectParameters(Start, Parameters):
    """Parameters of the machine that turns by itself."""

    J_added: Value = quantity(
        "kg.m2", "inertia on the motor shaft beside the machine's", default=0.0, min=0.0, tunable=True
    )


@declaration
class DirectInputs:
    """Torque of the motor and loads of the organs."""

    tau: Value = quantity("N.m", "torque of the motor on the shaft", default=0.0, nominal=100.0)
    left: SideLoads = group(SideLoads, "left organ", default=SideLoads())
    right: SideLoads = group(SideLoads, "right organ", default=SideLoads())
    stop: Stop = group(Stop, "stop that blocks the rocker", default=Stop())


@declaration
class DirectStates:
    """States of the machine; each is an output, too."""

    phi: Value = quantity("rad", "motor angle; crank angle is phi/ratio, from the upward vertical, clockwise")
    w: Value = quantity("rad/s", "motor speed")


@declaration
class DirectOutputs(Loads):
    """Acceleration and everything the machine carries."""

    a: Value = quantity("rad/s2", "motor acceleration", nominal=100.0)
    tau_bias: Value = quantity("N.m", "torque needed at constant speed of the shaft", nominal=100.0)
    J: Value = quantity("kg.m2", "inertia reflected to the shaft")


def processing_by_speed(xp: Any, p: Any, loads: Any, v2: Any) -> Any:
    """The processing force by the speed of B, where that is `v2` squared [N s/m]."""
    return loads.processing_force / xp.sqrt(v2 + p.processing.v_smooth * p.processing.v_smooth)


class Organ:
    """A working organ: the dyad wall (A1-B) and web (A2-B) with the material on it."""

    __slots__ = ("dyad", "wall", "web")

    def __init__(self, xp: Any, p: Any, a1: Vec2, a2: Motion, masses: Any, loads: Any, side: float) -> None:
        self.dyad = Dyad(xp, Motion(a1), a2, p.l1, p.l2, side)
        on_web = p.web_share * loads.material_mass
        self.wall = self._rod(self.dyad.first, masses.wall_mass + (loads.material_mass - on_web), p.l1, p)
        self.web = self._rod(self.dyad.second, masses.web_mass + on_web, p.l2, p)

    @staticmethod
    def _rod(link: Link, mass: Any, length: Any, p: Any) -> Body:
        return Body(link, mass, 0.5 * length, p.rod_inertia * mass * (length * length) * (1.0 / 12.0))

    def resistance(self, xp: Any, p: Any, loads: Any, w: Any) -> tuple[Vec2, Any]:
        """The processing force on the web at B, and the torque that overcomes it (its power over w)."""
        v1 = self.dyad.b.p1
        v = processing_by_speed(xp, p, loads, v1.squared() * (w * w)) * w
        return v1 * (-v), v1.squared() * v

    def reactions(self, w2: Any, a: Any, g: Any, processing: Vec2) -> tuple[Vec2, Vec2, Vec2]:
        """Forces at A1 and B on the wall and at A2 on the web."""
        wall = self.wall.applied(w2, a, g)
        web = total(self.web.applied(w2, a, g), point_load(self.dyad.b, self.dyad.second.pin, processing))
        return self.dyad.reactions(wall, web)

    def loads(
        self, xp: Any, psi_hand: float, rocker: Link, forces: tuple[Vec2, Vec2, Vec2], processing: Vec2
    ) -> Side:
        """What the organ carries; `psi_hand` is +1 on the left and -1 on the right."""
        at_a1, at_b, at_a2 = forces
        wall_axis, web_axis = self.dyad.first.u, self.dyad.second.u
        return Side(
            **side(rocker, psi_hand, forces),
            web_pull=xp.minimum(-web_axis.dot(at_a2), -web_axis.dot(at_b - processing)),
            wall_pull=xp.minimum(-wall_axis.dot(at_a1), wall_axis.dot(at_b)),
        )


def side(rocker: Link, psi_hand: float, forces: tuple[Vec2, Vec2, Vec2]) -> dict[str, Any]:
    """The fields of `Side` but the pulls, from the forces at A1, B and A2; see `Organ.loads`."""
    at_a1, at_b, at_a2 = forces
    return {
        # X cos s + Y sin s with s = +-psi: the force across the arm, along the arm
        "tangential_load": rocker.u.turned().dot(at_a2) * psi_hand,
        "normal_load": -rocker.u.dot(at_a2),
        "support": force(at_a1),
        "hinge": force(at_b),
        "rocker_joint": force(at_a2),
    }


class CrankRocker:
    """The drive at crank angle q: crank and dyad (coupler, rocker) as links and bodies."""

    __slots__ = ("a", "bodies", "coupler_body", "crank", "crank_body", "drive", "rocker", "rocker_body")

    def __init__(self, xp: Any, p: Any, q: Any) -> None:
        self.crank = crank(xp, Vec2(-p.c, -p.hy), q)
        self.a = self.crank.at(p.r)
        self.drive = Dyad(xp, self.a, Motion(ZERO), p.l, p.h, -1.0)
        self.rocker = self.drive.second
        self.crank_body = Body(self.crank, p.crank.m, p.crank.s, p.crank.I)
        self.coupler_body = Body(self.drive.first, p.coupler.m, p.coupler.s, p.coupler.I)
        self.rocker_body = Body(self.rocker, p.rocker.m, p.rocker.s, p.rocker.I)
        self.bodies: tuple[Body, ...] = (self.crank_body, self.coupler_body, self.rocker_body)

    def psi(self, xp: Any) -> Any:
        """Angle of the rocker [rad], which never reaches the horizontal."""
        return xp.asin(self.rocker.u.x)

    def pin_rates(self) -> tuple[Any, ...]:
        """Relative rotation per crank rotation in the pins O1, A, Bd, C."""
        k0, k1, k2 = self.crank.t1, self.drive.first.t1, self.rocker.t1
        return k0, k1 - k0, k1 - k2, k2

    def inertia(self) -> tuple[Any, Any]:
        """Reflected inertia at the crank J [kg m2] and dJ/dq."""
        return reflected(self.bodies)

    def potential(self, g: Any) -> Any:
        """Potential energy [J], zero at the level of C."""
        return sum(body.potential(g) for body in self.bodies)


class Mechanism(CrankRocker):
    """The moving machine at crank angle q: the drive, and both organs as dyads."""

    __slots__ = ("left", "right")

    def __init__(self, xp: Any, p: Any, u: Any, q: Any) -> None:
        super().__init__(xp, p, q)
        self.left, self.right = organs(xp, p, u, self.rocker)
        self.bodies += (self.left.wall, self.left.web, self.right.wall, self.right.web)

    def pin_rates(self) -> tuple[Any, ...]:
        """Those of the drive, then of A2, B, A1 of each side."""
        k2, rates = self.rocker.t1, list(super().pin_rates())
        for organ in (self.left, self.right):
            wall, web = organ.dyad.first.t1, organ.dyad.second.t1
            rates += [web - k2, web - wall, wall]
        return tuple(rates)


def supports(p: Any) -> tuple[Vec2, Vec2]:
    """A1 of the left and of the right organ."""
    return Vec2(-p.z, 0.0), Vec2(p.z, 0.0)


def organs(xp: Any, p: Any, u: Any, rocker: Link) -> tuple[Organ, Organ]:
    """Both working organs on a rocker that moves in a known way."""
    a2, (left, right) = rocker.at(p.e), supports(p)
    return (
        Organ(xp, p, left, a2, p.left, u.left, -1.0),
        Organ(xp, p, right, a2, p.right, u.right, 1.0),
    )


class DriveReactions:
    """The force pass of the drive, last group first, at crank speed w (squared: `w2`) and acceleration `a`, with the
    forces of both organs and a moment on the rocker.

    Friction is left out of it: it is small, and with it the torque would no longer be linear in `a`.
    """

    __slots__ = ("at_a", "at_bd", "at_c", "at_o1", "left", "right", "torque")

    def __init__(
        self,
        m: CrankRocker,
        p: Any,
        w2: Any,
        a: Any,
        left: tuple[Vec2, Vec2, Vec2],
        right: tuple[Vec2, Vec2, Vec2],
        moment: Any,
    ) -> None:
        """`left`, `right` are the forces at A1 and B on the wall and at A2 on the web."""
        g = p.g
        self.left, self.right = left, right
        rocker = total(
            m.rocker_body.applied(w2, a, g),
            point_load(m.rocker.at(p.e), m.rocker.pin, -(left[2] + right[2])),
            (ZERO, moment),
        )
        self.at_a, self.at_bd, self.at_c = m.drive.reactions(m.coupler_body.applied(w2, a, g), rocker)
        self.torque, self.at_o1 = driving_torque(m.crank, m.a, m.crank_body.applied(w2, a, g), -self.at_a)

    def pins(self, m: CrankRocker) -> tuple[tuple[Vec2, Any], ...]:
        """Reaction and relative rotation per crank rotation of the pins, as in `CrankRocker.pin_rates`."""
        return tuple(zip((self.at_o1, self.at_a, self.at_bd, self.at_c), m.pin_rates(), strict=True))


class Reactions(DriveReactions):
    """The force pass of the whole machine, with the `processing` force of each side and the stop's moment."""

    __slots__ = ()

    def __init__(
        self, m: Mechanism, p: Any, w2: Any, a: Any, processing: tuple[Vec2, Vec2], stop_moment: Any
    ) -> None:
        left, right = (
            organ.reactions(w2, a, p.g, f) for organ, f in zip((m.left, m.right), processing, strict=True)
        )
        super().__init__(m, p, w2, a, left, right, stop_moment)

    def pins(self, m: CrankRocker) -> tuple[tuple[Vec2, Any], ...]:
        """Reaction and relative rotation per crank rotation of the ten pins, as in `Mechanism.pin_rates`."""
        forces = (self.at_o1, self.at_a, self.at_bd, self.at_c, *self.left[::-1], *self.right[::-1])
        return tuple(zip(forces, m.pin_rates(), strict=True))


class StopLoad:
    """The stop on the rocker at crank speed `w`: moment on the rocker [N m], torque at the crank that overcomes it,
    energy that it holds [J]."""

    __slots__ = ("damping", "moment", "potential", "torque")

    def __init__(self, xp: Any, u: Any, m: CrankRocker, w: Any) -> None:
        k, turned = m.rocker.t1, m.psi(xp) - u.stop.psi
        held = u.stop.stiffness * turned
        self.potential = 0.5 * held * turned
        self.damping = u.stop.damping * (k * k) * w
        self.moment = -(held + u.stop.damping * k * w)
        self.torque = held * k


class Bias:
    """The torque at constant crank speed, by virtual work, and its parts [N m at the crank].

    Each loss is its power over w, written so that w = 0 is regular.
    """

    __slots__ = (
        "conservative", "friction", "processing", "processing_forces", "reactions", "stop", "total"
    )  # fmt: skip

    def __init__(self, xp: Any, p: Any, u: Any, m: Mechanism, dJ: Any, w: Any) -> None:
        w2 = w * w
        force_l, torque_l = m.left.resistance(xp, p, u.left, w)
        force_r, torque_r = m.right.resistance(xp, p, u.right, w)
        self.processing_forces = (force_l, force_r)
        self.processing = torque_l + torque_r
        self.stop = StopLoad(xp, u, m, w)
        self.reactions = Reactions(m, p, w2, 0.0, self.processing_forces, self.stop.moment)

        self.friction = pin_losses(xp, p.pin, p.joint_damping, w, self.reactions.pins(m))
        weight = sum(body.weight_slope(p.g) for body in m.bodies)
        self.conservative = 0.5 * dJ * w2 + weight + self.stop.torque
        self.total = self.conservative + self.processing + self.friction + self.stop.damping


class State(DrivenState):
    """The machine at one point: mechanism, inertia, and torque at constant speed."""

    __slots__ = ()

    mechanism_of, bias_of = Mechanism, Bias
    m: Mechanism
    bias: Bias


def _rocker_load(p: Any, left: Side, right: Side, at_a2: Any = 0.0) -> dict[str, Any]:
    """The fields of `RockerLoad`, which `Rocker` has, too."""
    tangential = left.tangential_load - right.tangential_load
    return {
        "tau": p.e * tangential + at_a2,
        "tangential_load": tangential,
        "normal_load": left.normal_load + right.normal_load,
    }


def chamber(xp: Any, p: Any, u: Any, psi: Any, psi_w: Any, psi_a: Any) -> Chamber:
    """Both organs on a rocker at angle `psi` with speed `psi_w` and acceleration `psi_a`, whatever drives it."""
    rocker = Link(Motion(ZERO), Vec2(xp.sin(psi), -xp.cos(psi)), 1.0, 0.0)
    left, right = organs(xp, p, u, rocker)
    w2 = psi_w * psi_w
    processing = (left.resistance(xp, p, u.left, psi_w)[0], right.resistance(xp, p, u.right, psi_w)[0])
    forces = (
        left.reactions(w2, psi_a, p.g, processing[0]),
        right.reactions(w2, psi_a, p.g, processing[1]),
    )
    on_left = left.loads(xp, 1.0, rocker, forces[0], processing[0])
    on_right = right.loads(xp, -1.0, rocker, forces[1], processing[1])
    load = RockerLoad(**_rocker_load(p, on_left, on_right))
    return Chamber(rocker=load, left=on_left, right=on_right)


def drive_loads(
    xp: Any,
    p: Any,
    s: Any,
    a: Any,
    f: DriveReactions,
    left: Side,
    right: Side,
    at_a2: Any = 0.0,
    at_a1: Any = 0.0,
) -> dict[str, Any]:
    """The fields of `Loads` but energies and margin, at crank acceleration `a`.

    Parameters
    ----------
    s : state with crank speed `w`, drive `m`, `bias` and `torque`
    f, left, right : the force pass at `a`, and what the organs carry in it
    at_a2, at_a1 : moments on both organs in these pins, from the rocker and from the frame [N m]
    """
    m, w = s.m, s.w
    torque, rocker = s.torque(a), m.rocker
    at_frame = f.at_o1 + f.at_c + f.left[0] + f.right[0]
    moment = m.crank.pin.p.cross(f.at_o1) + at_a1
    for a1, forces in zip(supports(p), (f.left, f.right), strict=True):
        moment = moment + a1.cross(forces[0])
    return {
        "rocker": Rocker(
            psi=m.psi(xp),
            w=rocker.t1 * w,
            a=rocker.t1 * a + rocker.t2 * (w * w),
            **_rocker_load(p, left, right, at_a2),
        ),
        "left": left,
        "right": right,
        "pivot": force(f.at_c),
        "crank_bearing": force(f.at_o1),
        "crank_pin": force(f.at_a),
        "coupler_pin": force(f.at_bd),
        "pressure_angle": pressure_angle(xp, p.l, p.h, (m.drive.r1 - m.drive.r2).squared()),
        "frame": Frame(
            fx=-at_frame.x, fy=-at_frame.y, moment=torque - s.bias.friction - moment - s.bias.stop.moment
        ),
        "power": torque * w,
    }


def _loads(xp: Any, p: Any, s: State, a: Any) -> dict[str, Any]:
    """The fields of `Loads` at crank acceleration `a`."""
    m, w, bias = s.m, s.w, s.bias
    f = Reactions(m, p, w * w, a, bias.processing_forces, bias.stop.moment)
    force_l, force_r = bias.processing_forces
    on_left = m.left.loads(xp, 1.0, m.rocker, f.left, force_l)
    on_right = m.right.loads(xp, -1.0, m.rocker, f.right, force_r)
    return {
        **drive_loads(xp, p, s, a, f, on_left, on_right),
        "kinetic_energy": 0.5 * s.J * (w * w),
        "potential_energy": m.potential(p.g) + bias.stop.potential,
        "dissipated_power": (bias.friction + bias.processing + bias.stop.damping) * w,
        "margin": xp.minimum(
            xp.abs(m.drive.transmission),
            xp.minimum(xp.abs(m.left.dyad.transmission), xp.abs(m.right.dyad.transmission)),
        ),
    }


def _outputs(xp: Any, p: Any, u: Any, x: Any, s: State) -> Outputs:
    a = u.a / p.ratio
    return Outputs(
        tau=s.torque(a) / p.ratio,
        **s.port(p, u),
        **_loads(xp, p, s, a),
    )


def _acceleration(p: Any, u: Any, s: State) -> Any:
    """Motor acceleration: (J_added + J) a = tau - tau_bias, all at the motor shaft."""
    return (u.tau - s.bias.total / p.ratio) / (p.J_added + s.J / (p.ratio * p.ratio))


def _direct_outputs(xp: Any, p: Any, u: Any, x: Any, s: State) -> DirectOutputs:
    a = _acceleration(p, u, s)
    return DirectOutputs(
        a=a,
        tau_bias=s.bias.total / p.ratio,
        J=s.J / (p.ratio * p.ratio),
        **_loads(xp, p, s, a / p.ratio),
    )


def rocker_extremes(xp: Any, p: Any) -> tuple[Any, Any]:
    """Largest and smallest rocker angle psi [rad], where crank and coupler lie on one line.

    Eqs. (14), (15) of paper 001, for any frame.
    """
    b, to_bearing = xp.sqrt(p.c * p.c + p.hy * p.hy), xp.atan2(p.c, p.hy)
    right, left = (angle_at_pivot(xp, p.h, b, reach) - to_bearing for reach in (p.l + p.r, p.l - p.r))
    return right, left


_FAR = 1e300  # more than any length; times a length of either sign it picks one of two limits


def half_width_range(xp: Any, e: Any, l1: Any, l2: Any, swing: Any, z: Any = math.inf) -> tuple[Any, Any]:
    """Least and largest half width [m] at which both organs close wherever the rocker stands within +-`swing` [rad];
    both ends are singular, but for 0. Empty where the least is not below the largest.

    The distance of A2 from A1 must stay above |l1 - l2| and below l1 + l2; over the swing its square is within
    (z -+ e sin(swing))^2 + (e cos(swing))^2. Above e cos(swing), |l1 - l2| leaves out half widths about e sin(swing):
    then it is the range on the side of these on which `z` lies. With l2 = l1 - e the range begins at 2 e sin(swing).
    """
    reach = e * xp.sin(swing)
    drop2 = e * e - reach * reach
    short2 = (l1 - l2) * (l1 - l2) - drop2
    left_out = xp.sqrt(xp.maximum(short2, 0.0))
    whole = _FAR * xp.maximum(-short2, 0.0)
    low = reach + left_out - whole - _FAR * xp.maximum(reach - z, 0.0)
    high = reach - left_out + whole + _FAR * xp.maximum(z - reach, 0.0)
    longest = xp.sqrt(xp.maximum((l1 + l2) * (l1 + l2) - drop2, 0.0)) - reach
    return xp.maximum(low, 0.0), xp.minimum(high, longest)


class ChamberForces(Model):
    """The inverse model: motion of the motor shaft in, torque and every reaction out."""

    name = "ChamberForces"
    description = (
        "Forces in a chain unit: crank, coupler, rocker and two working organs; "
        "from motor angle and speed to torque, load port and every support reaction"
    )
    Parameters = Parameters
    Inputs = Inputs
    terminals = (*flanges("inflow"), load_terminal())

    required = (
        Requirement("c", "m", "the crank circle must stay left of the pivot C", depends=("r",)),
        dataclasses.replace(TURNS, given=("l", "h", "c", "hy")),
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
    )

    @staticmethod
    def requirements(xp: Any, p: Any) -> Iterator[tuple[Any, Any, Any]]:
        """The crank turns, and both organs close at both extremes of the rocker."""
        yield p.c, p.r, math.inf
        yield p.r, 0.0, longest_crank(xp, p.l, p.h, xp.sqrt(p.c * p.c + p.hy * p.hy))
        right, left = rocker_extremes(xp, p)
        swing = xp.maximum(xp.abs(right), xp.abs(left))
        yield swing, -math.inf, 0.5 * math.pi
        low, high = half_width_range(xp, p.e, p.l1, p.l2, swing, p.z)
        yield p.z, low, high

    @staticmethod
    def shared(xp: Any, p: Any, u: Any, x: Any) -> State:
        """The machine at the crank angle and speed that belong to the motor's."""
        return State(xp, p, u, u.phi / p.ratio, u.w / p.ratio)

    parts = (
        Part(
            Outputs,
            _outputs,
        ),
        Part(
            PortSlopes,
            slopes,
            derivatives={"tau_bias_dphi": ("tau_bias", "phi"), "tau_bias_dw": ("tau_bias", "w")},
        ),
    )


class DirectChainUnit(Model):
    """The direct model: motor torque in, motion out. As an FMU it is called ChainUnit."""

    name = "ChainUnit"
    description = (
        "A chain unit that turns by itself: crank, coupler, rocker and two working organs; "
        "from motor torque to angle, speed, acceleration and every support reaction"
    )
    Parameters = DirectParameters
    Inputs = DirectInputs
    States = DirectStates
    terminals = flanges("inflow")
    required = (
        *ChamberForces.required,
        Requirement(
            "inertia of the crank and on its shaft",
            "kg.m2",
            "at the dead points of the rocker nothing else carries the torque; give crank.I, crank.m or J_added",
        ),
    )

    @staticmethod
    def requirements(xp: Any, p: Any) -> Iterator[tuple[Any, Any, Any]]:
        """Those of the inverse model, and an inertia that never vanishes."""
        yield from ChamberForces.requirements(xp, p)
        yield p.J_added * p.ratio * p.ratio + p.crank.I + p.crank.m * p.crank.s * p.crank.s, 0.0, math.inf

    @staticmethod
    def initial_states(xp: Any, p: Any) -> Any:
        """The start angle and speed."""
        return DirectStates(phi=p.phi_start, w=p.w_start)

    @staticmethod
    def internal_step(xp: Any, p: Any) -> Any:
        """A quarter of a millisecond: the motion is slow, and smoothed friction near rest, its fastest part, takes
        some milliseconds with the declared `pin.w_smooth`; a much smaller one wants Model Exchange."""
        return 2.5e-4

    @staticmethod
    def shared(xp: Any, p: Any, u: Any, x: Any) -> State:
        """The machine at the crank angle and speed that belong to the motor's."""
        return State(xp, p, u, x.phi / p.ratio, x.w / p.ratio)

    @staticmethod
    def derivatives(xp: Any, p: Any, u: Any, x: Any) -> list[Any]:
        """Time derivatives of the states, in declared order."""
        return [x.w, _acceleration(p, u, DirectChainUnit.shared(xp, p, u, x))]

    parts = (Part(DirectOutputs, _direct_outputs),)
