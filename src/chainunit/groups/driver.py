"""The drivers, which move in a given way: a crank on a fixed bearing, a ram on a fixed rail, and a cylinder that is
pinned at both ends, with the lever that it swings.

The first one of a linkage has its coordinate q; a further one has a `course` over q. In the packaged machines q is
the crank angle, which counts from the upward vertical, positive clockwise, so that the derivative of the crank's
counter-clockwise angle by q is -1. The rows of a driver have one more, which says how its place moves it; its
multiplier is the torque, or the force, along its place.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from ..core.planar import ZERO, Vec2, rotated
from .body import Bar, Mass
from .dyad import meeting
from .group import Group, SolvedGroup
from .joints import STEADY, DrivenHinge, Guide, GuideData, Hinge, HingeData, JointData, LinkageInMotion, Rail

UPWARD = Vec2(0.0, 1.0)


class Course(NamedTuple):
    """The `place` of a driver [rad, m], and its derivatives by the coordinate q up to the third."""

    place: Any
    rates: Sequence[Any] = STEADY


class Driver(Group):
    """The link that is driven, as data: its bar, the pin that shows its motion, and its `course` by engine and q;
    without one q is its place."""

    bar: Bar
    end: str
    course: Callable[[Any, Any], Course] | None

    def course_at(self, xp: Any, q: Any) -> Course:
        """Its place and the derivatives of it at the coordinate `q`."""
        return Course(q) if self.course is None else self.course(xp, q)

    @property
    def inertia(self) -> Any:
        """The least inertia that it reflects by itself: of a crank about its bearing [kg m2], of a ram or of the rod
        of a cylinder, which moves at the speed of the way at least, its mass [kg]."""
        raise NotImplementedError


def _inertia_about_start(mass: Any) -> Any:
    """Inertia of a body about the pin from which its link starts [kg m2]."""
    if mass is None:
        return 0.0
    beside = mass.t if isinstance(mass, Mass) else None
    arm2 = mass.s * mass.s if beside is None else mass.s * mass.s + beside * beside
    return mass.I + mass.m * arm2


@dataclass
class Crank(Driver):
    """A crank as data: its bar, which starts from a ground pin; the pin at the bar's `end`, or one of its points if
    the bar has no length; the direction of the bar at q = 0, a unit vector; and `sense`: +1 where q counts
    counter-clockwise, -1 where clockwise. One `on` a link before it starts from a pin of that, and its direction and
    its angle count from it."""

    bar: Bar
    end: str
    start: Vec2 = UPWARD
    sense: float = -1.0
    course: Callable[[Any, Any], Course] | None = None
    on: str | None = None

    @property
    def pins(self) -> dict[str, str]:
        return {} if self.bar.length is None else {self.end: self.bar.name}

    @property
    def joints(self) -> tuple[JointData, ...]:
        return (HingeData(self.bar.pin, self.bar.name, None, self.on),)

    @property
    def circles(self) -> tuple[tuple[str, str], ...]:
        return ((self.bar.pin, self.bar.pin),) if self.on else ()

    @property
    def inertia(self) -> Any:
        """Inertia of the crank alone about its bearing [kg m2]."""
        return _inertia_about_start(self.bar.mass)

    def solve(self, xp: Any, q: Any, linkage: LinkageInMotion, derived: Sequence[Any]) -> SolvedGroup:
        """The crank at the coordinate `q`."""
        bearing, start = linkage.pins[self.bar.pin], self.start
        angle, rates = self.course_at(xp, q)
        c, s = xp.cos(angle), xp.sin(angle) * self.sense
        u = Vec2(start.x * c - start.y * s, start.y * c + start.x * s)
        carrier = linkage.links[self.on] if self.on else None
        u = u if carrier is None else rotated(u, carrier.u)
        joint = DrivenHinge(0, int(self.sense), rates, carrier, None, ZERO, bearing)
        ends = [] if self.bar.length is None else [(0, u * self.bar.length)]
        return SolvedGroup([(bearing, u)], [joint], ends=ends, course=rates)


@dataclass
class Ram(Driver):
    """A ram as data, such as the rod of a hydraulic cylinder: its bar, without a pin, moves along a `rail` of the
    ground. Its frame starts at the point of the rail that q [m] counts from and has the direction of the rail.
    `guide` is the pin at which the reaction of the rail acts on it."""

    bar: Bar
    rail: Rail
    guide: str
    end: str = ""
    course: Callable[[Any, Any], Course] | None = None

    @property
    def joints(self) -> tuple[JointData, ...]:
        return (GuideData(self.guide, self.bar.name, self.rail),)

    @property
    def inertia(self) -> Any:
        """Its mass [kg]."""
        return 0.0 if self.bar.mass is None else self.bar.mass.m

    def solve(self, xp: Any, q: Any, linkage: LinkageInMotion, derived: Sequence[Any]) -> SolvedGroup:
        """The ram at the coordinate `q`."""
        rail = self.rail.at_position(linkage.links)
        place, rates = self.course_at(xp, q)
        way = rail.u * place
        guide = Guide(0, rail.u, place, way, rail, line=0.0, course=rates)
        return SolvedGroup([(rail.pin.p + way, rail.u)], [guide], course=rates)


@dataclass
class Cylinder(Driver):
    """A cylinder with its lever, as data.

    The barrel P-.. and the rod ..-C slide along each other; the lever Q-C swings. P and Q are pins of the ground or,
    of a further driver, of links before it. The place is the way in the sliding joint. With e = C - P = L d + offset
    n, where d is the direction of the cylinder and L = way + shift, barrel and rod together are one side of a
    triangle whose length |e| is known. The margin is the sine of the angle between cylinder and lever.

    The frames of barrel (`bar`) and `rod` start at their pins and have the direction of the cylinder. `end` is the
    pin between rod and lever, which the lever carries. `shift` and `offset` place this pin from that of the barrel,
    along and across, at a way of 0 [m]; `rod_offset` is how far the line of the force lies to the left of the rod's
    pin [m]. `side` is +1 where the pin lies to the left of the ray from the barrel's pin to that of the lever, -1
    where to the right. `guide` is the pin at which the reaction of the sliding joint acts on the rod.
    """

    bar: Bar
    end: str
    rod: Bar
    lever: Bar
    shift: Any
    offset: Any
    rod_offset: Any
    guide: str
    side: float
    course: Callable[[Any, Any], Course] | None = None

    @property
    def joints(self) -> tuple[JointData, ...]:
        barrel, rod, lever = self.bar, self.rod.name, self.lever
        return (
            HingeData(barrel.pin, barrel.name),
            GuideData(self.guide, rod, barrel.name),
            HingeData(self.end, rod, lever.name),
            HingeData(lever.pin, lever.name),
        )

    @property
    def inertia(self) -> Any:
        """The mass of the rod [kg]."""
        return 0.0 if self.rod.mass is None else self.rod.mass.m

    def solve(self, xp: Any, q: Any, linkage: LinkageInMotion, derived: Sequence[Any]) -> SolvedGroup:
        """The cylinder at the way `q` of its rod [m]: its three pins make a triangle, of which q gives the length of
        one side; the inner pin stands on one of two sides of the line between the other pins."""
        p, o = linkage.pins[self.bar.pin], linkage.pins[self.lever.pin]
        place, rates = self.course_at(xp, q)
        way, h, b = place + self.shift, self.offset, self.lever.length
        square = way * way + h * h
        e, r = meeting(xp, p.p, o.p, square, b * b, self.side)
        d = (e * way - e.turned() * h) * (1.0 / square)
        poses = (p, d), (o.p + r, d), (o, r * (1.0 / b))
        joints = (
            Hinge(0, base=p),
            Guide(1, d, place, e, 0, line=self.rod_offset, course=rates),
            Hinge(1, ZERO, 2, r),
            Hinge(2, base=o),
        )
        return SolvedGroup(poses, joints, size=b * xp.sqrt(square), course=rates)


@dataclass
class Elbow(Driver):
    """Two arms with a motor in the pin between them, and a lever, as data: the arm P-M (`bar`), the arm M-C and the
    lever Q-C swing as barrel, rod and lever of a `Cylinder` do. The frames of the arms start at P and at M.

    `start` is the direction of the second arm in the frame of the first one at the place 0, a unit vector; `sense` is
    as of a `Crank`. `side` and the margin are as of a `Cylinder`, by the line P-C.
    """

    bar: Bar
    joint: str
    arm: Bar
    end: str
    lever: Bar
    start: Vec2
    sense: float
    side: float
    course: Callable[[Any, Any], Course] | None = None

    @property
    def joints(self) -> tuple[JointData, ...]:
        """Its pins: of the arms with the link before, with each other and with the lever, then the lever's own."""
        bar, arm, lever = self.bar, self.arm.name, self.lever
        return (
            HingeData(bar.pin, bar.name),
            HingeData(self.joint, arm, bar.name),
            HingeData(self.end, arm, lever.name),
            HingeData(lever.pin, lever.name),
        )

    @property
    def circles(self) -> tuple[tuple[str, str], ...]:
        return ((self.joint, self.joint),)

    @property
    def inertia(self) -> Any:
        """That of both arms in series: of the first one about P, of the second one about its centroid [kg m2]."""
        one, other = _inertia_about_start(self.bar.mass), 0.0 if self.arm.mass is None else self.arm.mass.I
        return one * other / (one + other + 1e-300)

    def reach(self, xp: Any, angle: Any) -> tuple[Vec2, Vec2]:
        """The direction of the second arm, and P-C [m], in the frame of the first one at this `angle` [rad]."""
        turned = rotated(self.start, Vec2(xp.cos(angle), xp.sin(angle) * self.sense))
        return turned, Vec2(self.bar.length, 0.0) + turned * self.arm.length

    def solve(self, xp: Any, q: Any, linkage: LinkageInMotion, derived: Sequence[Any]) -> SolvedGroup:
        """The arms at the place `q` of the motor, which gives the length of the side P-C of a triangle."""
        p, o = linkage.pins[self.bar.pin], linkage.pins[self.lever.pin]
        (angle, rates), b = self.course_at(xp, q), self.lever.length
        turned, reach = self.reach(xp, angle)
        square = reach.squared()
        e, r = meeting(xp, p.p, o.p, square, b * b, self.side)
        d = rotated(e, Vec2(reach.x, -reach.y)) * (1.0 / square)
        to_motor, u = d * self.bar.length, rotated(turned, d)
        joints = (
            Hinge(0, base=p),
            DrivenHinge(1, int(self.sense), rates, None, 0, to_motor),
            Hinge(1, u * self.arm.length, 2, r),
            Hinge(2, base=o),
        )
        poses = (p, d), (p.p + to_motor, u), (o, r * (1.0 / b))
        return SolvedGroup(poses, joints, e.cross(r) / (b * xp.sqrt(square)), course=rates)
