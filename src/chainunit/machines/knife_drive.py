"""The knife drive of the paper cutter BR-125 (paper 003): crank + dyad + triad.

Crank O1-A; dyad: coupler AB and rocker BO2; triad: the ternary link CDE, which carries the knife, on the legs BC,
O3D and O4E. BC hangs on the pin B, where three links meet. x right, y up; a force is the one on the first-named
part. The crank angle q is counted from the upward vertical, clockwise; B lies to the left of the ray from A to O2.

The triad has no closed form. Its pose over the turn is a smooth periodic function of the crank angle: it is followed
once around, from the mode that `assembly` leads to at q = 0, and kept as a Fourier series (`derive`). At any angle
the series gives a pose that is nearly right, and Newton's method makes it exact. So the outputs depend on the crank
angle alone, whatever the step or the history; the branch cannot jump, and parameters with which it ends within the
turn are refused.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from typing import Any

from ..groups.body import Body, point_load, reflected, total
from ..groups.driver import crank, driving_torque
from ..groups.dyad import Dyad
from ..groups.friction import pin_losses
from ..groups.triad import Pose, Triad, assembly_modes, corrected
from ..model import Model, Part, Requirement
from ..planar import Motion, Vec2
from ..ports import PortSlopes, PortValues, flanges, load_terminal
from ..quantities import Value, declaration, group, quantity
from .crank_rocker import TURNS, longest_crank
from .driven import DrivenState, slopes
from .parts import Force, Pin, Rod, force

SAMPLES = 20
"""Angles of the crank at which the triad is followed once around."""
HARMONICS = 8
"""Of the series of its pose."""
_STEPS = 3
"""Of Newton's method from the series: an error of 1e-3, as of a pose that moves sharply, is gone after three."""


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
    """The pose of the knife from which Newton's method leads to the mode of assembly at crank angle 0; `modes` lists
    them all."""

    x: Value = quantity("m", "origin of its frame, x", default=1.0460696, min=-1e4, max=1e4)
    y: Value = quantity("m", "origin of its frame, y", default=0.0172492, min=-1e4, max=1e4)
    theta: Value = quantity(
        "rad", "angle of its x axis, counter-clockwise", default=-0.0116588, min=-7.0, max=7.0
    )


@declaration
class Stack:
    """The stack of paper, and how it resists."""

    top: Value = quantity("m", "height y of its top", default=-0.185, min=-1e4, max=1e4, tunable=True)
    table: Value = quantity(
        "m", "height y of the table below it", default=-0.234, min=-1e4, max=1e4, tunable=True
    )
    edge: Value = quantity(
        "m", "way over which the resistance rises and falls", default=0.002, min=1e-6, tunable=True
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
    """Parameters of the knife drive. The start values are ours: paper 003 prints no dimensions and no masses."""

    o1: Point = group(Point, "crank bearing O1", default=Point(y=-0.1))
    o2: Point = group(Point, "rocker bearing O2", default=Point(x=0.33, y=-0.4))
    o3: Point = group(Point, "bearing O3", default=Point(x=0.86, y=0.36))
    o4: Point = group(Point, "bearing O4", default=Point(x=1.62, y=0.35))
    crank: Rod = group(Rod, "crank", default=Rod(m=12.0, s=0.02, I=0.05))
    coupler: Rod = group(Rod, "coupler AB, from A", default=Rod(m=9.0, s=0.185, I=0.11))
    rocker: Rod = group(Rod, "rocker BO2, from O2", default=Rod(m=8.0, s=0.15, I=0.07))
    leg_b: Rod = group(Rod, "leg BC, from B", default=Rod(m=11.0, s=0.31, I=0.36))
    leg_3: Rod = group(Rod, "leg O3D, from O3", default=Rod(m=7.0, s=0.195, I=0.09))
    leg_4: Rod = group(Rod, "leg O4E, from O4", default=Rod(m=7.5, s=0.205, I=0.1))
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
class Inputs:
    """Motion of the motor shaft and forces on the blade."""

    phi: Value = quantity(
        "rad", "motor angle; crank angle is phi/ratio, from the upward vertical, clockwise", default=0.0
    )
    w: Value = quantity("rad/s", "motor speed", default=0.0)
    a: Value = quantity("rad/s2", "motor acceleration", default=0.0)
    cut_force: Value = quantity(
        "N", "resistance of the stack to the blade on its way down", default=0.0, min=0.0, nominal=1e4
    )
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


def _arms(p: Any) -> tuple[Vec2, Vec2, Vec2]:
    return _vector(p.knife.c), _vector(p.knife.d), _vector(p.knife.e)


def _lengths(p: Any) -> tuple[Any, Any, Any]:
    return p.bc, p.o3d, p.o4e


class Drive:
    """Crank and dyad at crank angle q."""

    __slots__ = ("crank", "dyad", "pin")

    def __init__(self, xp: Any, p: Any, q: Any) -> None:
        self.crank = crank(xp, _vector(p.o1), q)
        self.pin = self.crank.at(p.r)
        self.dyad = Dyad(xp, self.pin, Motion(_vector(p.o2)), p.ab, p.bo2, 1.0)

    def pins(self, p: Any) -> tuple[Motion, Motion, Motion]:
        """Outer pins of the triad."""
        return self.dyad.b, Motion(_vector(p.o3)), Motion(_vector(p.o4))


def _pose(xp: Any, p: Any, pins: tuple[Motion, ...], near: Pose, steps: int) -> Pose:
    return corrected(xp, tuple(pin.p for pin in pins), _lengths(p), _arms(p), near, steps)


def _near(series: Any, cos: Any, sin: Any) -> Pose:
    """The pose that the series gives, from cosine and sine of the crank angle."""
    size = 2 * HARMONICS + 1
    sums = [series[k * size] for k in range(3)]
    c, s = cos, sin
    for n in range(1, HARMONICS + 1):
        for k in range(3):
            sums[k] = sums[k] + series[k * size + 2 * n - 1] * c + series[k * size + 2 * n] * s
        c, s = c * cos - s * sin, s * cos + c * sin
    return Pose(*sums)


class Mechanism:
    """The moving machine at crank angle q: links, bodies, dyad and triad."""

    __slots__ = ("blade", "bodies", "drive", "triad")

    def __init__(self, xp: Any, p: Any, u: Any, q: Any) -> None:
        self.drive = drive = Drive(xp, p, q)
        pins = drive.pins(p)
        pose = _pose(xp, p, pins, _near(p.derived, xp.cos(q), xp.sin(q)), _STEPS)
        self.triad = triad = Triad(xp, pins, _lengths(p), _arms(p), pose)
        self.blade = triad.link.beside(p.knife.blade.x, p.knife.blade.y)
        links = (drive.crank, drive.dyad.first, drive.dyad.second, *triad.legs)
        rods = (p.crank, p.coupler, p.rocker, p.leg_b, p.leg_3, p.leg_4)
        knife, centroid = p.knife, p.knife.centroid
        self.bodies = (
            *(Body(link, rod.m, rod.s, rod.I) for link, rod in zip(links, rods, strict=True)),
            Body(triad.link, knife.m, centroid.x, knife.I, centroid.y),
        )

    def pin_rates(self) -> tuple[Any, ...]:
        """Relative rotation per crank rotation in the pins O1, A, B of AB, B of BC, O2, C, D, E, O3, O4."""
        k0, k1, k2 = self.drive.crank.t1, self.drive.dyad.first.t1, self.drive.dyad.second.t1
        (b, d, e), k = (leg.t1 for leg in self.triad.legs), self.triad.link.t1
        return k0, k1 - k0, k1 - k2, b - k2, k2, b - k, d - k, e - k, d, e

    def inertia(self) -> tuple[Any, Any]:
        """Reflected inertia at the crank J [kg m2] and dJ/dq."""
        return reflected(self.bodies)


class Reactions:
    """The force pass, last group first, at crank speed w (squared: `w2`) and acceleration `a`, without friction."""

    __slots__ = ("at_a", "at_b", "at_o1", "at_o2", "inner", "outer", "torque")

    def __init__(self, m: Mechanism, p: Any, w2: Any, a: Any, on_blade: Vec2) -> None:
        crank_, coupler, rocker, *legs, knife = (body.applied(w2, a, p.g) for body in m.bodies)
        blade = point_load(m.blade, m.triad.link.pin, on_blade)
        self.outer, self.inner = m.triad.reactions(tuple(legs), total(knife, blade))
        drive = m.drive
        # the leg BC pulls the rocker at B with what the rocker does not give it
        hung = point_load(drive.dyad.b, drive.dyad.second.pin, -self.outer[0])
        self.at_a, self.at_b, self.at_o2 = drive.dyad.reactions(coupler, total(rocker, hung))
        self.torque, self.at_o1 = driving_torque(drive.crank, drive.pin, crank_, -self.at_a)

    def pins(self, m: Mechanism) -> Iterator[tuple[Vec2, Any]]:
        """Reaction and relative rotation per crank rotation of the ten pins, as in `Mechanism.pin_rates`."""
        forces = (self.at_o1, self.at_a, self.at_b, self.outer[0], self.at_o2, *self.inner, *self.outer[1:])
        return zip(forces, m.pin_rates(), strict=True)


def _engaged(xp: Any, x: Any) -> Any:
    """A step from 0 to 1 about x = 0, over about two units."""
    return 0.5 * (1.0 + x / xp.sqrt(1.0 + x * x))


class Bias:
    """The torque at constant crank speed, by virtual work, and its parts [N m at the crank]."""

    __slots__ = ("cut", "cutting", "further", "losses", "on_blade", "total")

    def __init__(self, xp: Any, p: Any, u: Any, m: Mechanism, dJ: Any, w: Any) -> None:
        k, stack, w2 = m.blade, p.stack, w * w
        small2 = stack.v_smooth * stack.v_smooth
        inside = _engaged(xp, (stack.top - k.p.y) / stack.edge) * _engaged(
            xp, (k.p.y - stack.table) / stack.edge
        )
        down = k.p1.y * w
        falling = 0.5 * (1.0 - down / xp.sqrt(down * down + small2))
        per_speed = u.cut_force * inside * falling / xp.sqrt(k.p1.squared() * w2 + small2)
        self.cut = k.p1 * (-per_speed * w)
        self.cutting = k.p1.squared() * per_speed * w
        force = Vec2(u.blade.fx, u.blade.fy)
        self.further = -force.dot(k.p1)
        self.on_blade = self.cut + force
        reactions = Reactions(m, p, w2, 0.0, self.on_blade)
        self.losses = pin_losses(xp, p.pin, p.joint_damping, w, reactions.pins(m))
        weights = sum(body.weight_slope(p.g) for body in m.bodies)
        self.total = 0.5 * dJ * w2 + weights + self.cutting + self.further + self.losses


class State(DrivenState):
    """The machine at one point: mechanism, inertia, and torque at constant speed."""

    __slots__ = ()

    mechanism_of, bias_of = Mechanism, Bias
    m: Mechanism
    bias: Bias


def _outputs(xp: Any, p: Any, u: Any, x: Any, s: State) -> Outputs:
    a, w, m = u.a / p.ratio, s.w, s.m
    f = Reactions(m, p, w * w, a, s.bias.on_blade)
    torque, link, k = s.torque(a), m.triad.link, m.blade
    dyad, triad = m.drive.dyad, m.triad
    return Outputs(
        tau=torque / p.ratio,
        **s.port(p, u),
        blade=Blade(
            x=k.p.x,
            y=k.p.y,
            vx=k.p1.x * w,
            vy=k.p1.y * w,
            tilt=xp.atan2(link.u.y, link.u.x),
            cut_fx=s.bias.cut.x,
            cut_fy=s.bias.cut.y,
        ),
        crank_bearing=force(f.at_o1),
        crank_pin=force(f.at_a),
        coupler_pin=force(f.at_b),
        leg_pin=force(f.outer[0]),
        rocker_bearing=force(f.at_o2),
        c_pin=force(f.inner[0]),
        d_pin=force(f.inner[1]),
        e_pin=force(f.inner[2]),
        o3_bearing=force(f.outer[1]),
        o4_bearing=force(f.outer[2]),
        power=torque * w,
        kinetic_energy=0.5 * s.J * w * w,
        potential_energy=sum(body.potential(p.g) for body in m.bodies),
        dissipated_power=(s.bias.losses + s.bias.cutting + s.bias.further) * w,
        margin=xp.minimum(xp.abs(dyad.transmission), xp.abs(triad.margin)),
    )


class KnifeDrive(Model):
    """The knife drive of a paper cutter: motion of the motor shaft in, torque and every reaction out."""

    name = "KnifeDrive"
    description = (
        "Knife drive of a paper cutter: crank, dyad and triad; from motor angle and speed to torque, load port, "
        "blade and every reaction"
    )
    Parameters = Parameters
    Inputs = Inputs
    terminals = (*flanges("inflow"), load_terminal())
    derived = 3 * (2 * HARMONICS + 1) + 2

    required = (
        dataclasses.replace(
            TURNS,
            given=("ab", "bo2", "o1.x", "o1.y", "o2.x", "o2.y"),
            remedy="|O1 O2| must be > |ab - bo2| and < ab + bo2 for any crank",
        ),
        Requirement(
            "largest misfit of a leg over the turn of the crank, in parts of its length",
            "1",
            "the triad does not close all the way round in the mode that `assembly` leads to, or moves too sharply "
            "to be followed",
            ("bc", "o3d", "o4e", "assembly.x", "assembly.y", "assembly.theta"),
        ),
        Requirement(
            "least margin of the triad over the turn of the crank",
            "1",
            "the triad comes to a dead position, where the lines of its legs meet in one point",
            ("bc", "o3d", "o4e"),
        ),
    )

    @staticmethod
    def derive(xp: Any, p: Any) -> list[Any]:
        """The series of the knife's pose over the crank angle, the largest misfit and the least margin around."""
        angles = [2.0 * math.pi * k / SAMPLES for k in range(SAMPLES)]

        def pins(q: float) -> tuple[Motion, Motion, Motion]:
            return Drive(xp, p, q).pins(p)

        poses = [_pose(xp, p, pins(0.0), Pose(p.assembly.x, p.assembly.y, p.assembly.theta), 8)]
        for q in angles[1:]:
            near = poses[-1]
            if len(poses) > 1:
                near = Pose(*(2.0 * now - before for now, before in zip(near, poses[-2], strict=True)))
            poses.append(_pose(xp, p, pins(q), near, _STEPS))
        series = []
        for values in zip(*poses, strict=True):
            series.append(sum(values) / SAMPLES)
            for n in range(1, HARMONICS + 1):
                for wave in (math.cos, math.sin):
                    series.append(
                        sum(v * (2.0 / SAMPLES * wave(n * q)) for v, q in zip(values, angles, strict=True))
                    )
        # what the run will do, halfway between the angles
        misfit, first, least = 0.0, None, None
        for q in angles:
            middle = q + math.pi / SAMPLES
            outer = pins(middle)
            near = _near(series, math.cos(middle), math.sin(middle))
            triad = Triad(xp, outer, _lengths(p), _arms(p), _pose(xp, p, outer, near, _STEPS))
            for pin, o, l in zip(triad.pins, outer, _lengths(p), strict=True):
                off = xp.abs(xp.sqrt((pin.p - o.p).squared()) / l - 1.0)
                misfit = xp.maximum(misfit, xp.minimum(off, 1.0))
            # the sign of the first: a margin that changes sign has passed a dead position
            first = triad.margin if first is None else first
            margin = triad.margin * first / xp.abs(first)
            least = margin if least is None else xp.minimum(least, margin)
        return [*series, misfit, least]

    @staticmethod
    def requirements(xp: Any, p: Any) -> Iterator[tuple[Any, Any, Any]]:
        """The crank turns, and the triad closes all the way round, clear of its dead positions."""
        between = _vector(p.o1) - _vector(p.o2)
        yield p.r, 0.0, longest_crank(xp, p.ab, p.bo2, xp.sqrt(between.squared()))
        *_, misfit, least = p.derived
        yield misfit, -math.inf, 1e-10
        yield least, 1e-3, math.inf

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


def modes(p: Any, q: float = 0.0) -> list[Pose]:
    """All poses in which the triad can be assembled at crank angle `q` [rad]; one of them, at 0, is `assembly`."""
    from ..engines import MATH

    pins = Drive(MATH, p, q).pins(p)
    return assembly_modes(tuple(pin.p for pin in pins), _lengths(p), _arms(p))
