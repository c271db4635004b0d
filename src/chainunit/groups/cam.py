"""A cam and its follower: a link on a pin or a rail, with a roller or a flat face on a profile of a link before it.

The profile is a radius over the angle about its centre; the centre of a roller runs on its pitch curve. The angle at
which the follower lies on it is followed once around, as the pose of a triad, or over the range of the driver; the
rest is closed form.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from ..core.engines import numpy_
from ..core.planar import ZERO, Link, Vec2, mirrored, rotated
from .body import Bar
from .group import Group, Outline, SolvedGroup
from .joints import Contact, Guide, GuideData, Hinge, HingeData, JointData, LinkageInMotion, Placed, Rail
from .series import Revolution, series_of

SAMPLES, HARMONICS = 48, 16
"""Places of the driver at which a follower is followed once around, and the order of the series."""
_FIRST, _FURTHER, _LAST = (4, 4, 4), (3,), (3, 2)
"""Steps of Newton's method at the first place, at a further one, and from the series: by the number of times that the
profile is taken anew about the angle."""
_MISFIT = 1e-9
"""Misfit of a contact, in parts of its size, at which the margin is 0: the follower is lost."""


class ProfilePoint(NamedTuple):
    """A point of a profile: its `place` from the centre [m], its `normal` to the outside, a unit vector, its `speed`
    by the angle [m/rad], its `curvature`, above 0 where it bulges [1/m], and its `change` by the way [1/m2]."""

    place: Vec2
    normal: Vec2
    speed: Any
    curvature: Any
    change: Any

    @classmethod
    def placed(cls, xp: Any, rates: Any, angle: Any) -> ProfilePoint:
        """The point at an angle [rad], from the radius there and its derivatives up to the third."""
        r, r1, r2, r3 = rates
        u, square = Vec2(xp.cos(angle), xp.sin(angle)), r * r + r1 * r1
        speed, bulge = xp.sqrt(square), square + r1 * r1 - r * r2
        normal, cube = (u * r - u.turned() * r1) * (1.0 / speed), square * speed
        change = (2.0 * r * r1 + 3.0 * r1 * r2 - r * r3) * square - 3.0 * bulge * (r + r2) * r1
        return cls(u * r, normal, speed, bulge / cube, change / (cube * cube))

    def beside(self, gap: Any) -> ProfilePoint:
        """The point of the curve at a distance outward [m], at the same angle."""
        growth = 1.0 + gap * self.curvature
        k, change = self.curvature / growth, self.change / (growth * growth * growth)
        return ProfilePoint(self.place.plus(self.normal, gap), self.normal, self.speed * growth, k, change)


@dataclass
class CamFollower(Group):
    """A follower on a pin or on a `rail` that moves in a known way. The centre of its roller or a point of its face
    is `pin`, at `arm` in the frame of its bar; that of one on a pin has the direction of this arm, or of the normal
    of its face, that of one on a rail starts at `pin`. `cam` is the centre of the profile, the pin `centre`, with its
    angle 0; `curve` the radius over the angle; `roller` that of the roller, with which the profile `grows` to the
    pitch curve; `face` the normal of a face, away from the cam. `guide` is the pin of the force of the rail. The
    angle of the contact, from the pin of the follower or its rail, is `near` at the place `start` of the driver,
    which turns all the way round, or goes to and fro within its `span`. The margin is the cosine of the pressure
    angle, below 0 of an undercut profile."""

    bar: Bar
    pin: str
    arm: Vec2
    cam: Rail
    centre: str
    curve: Any
    roller: Any
    grows: bool
    face: Vec2 | None
    rail: Rail | None
    guide: str
    near: float
    start: float
    span: Sequence[float] = ()

    derived_count: ClassVar[int] = 2 * HARMONICS + 1
    """The number of values that `derive` gives: the series of the angle of the contact."""

    @property
    def joints(self) -> tuple[JointData, ...]:
        """Its pin or its guide, and the contact."""
        link = self.bar.name
        first = HingeData(self.bar.pin, link) if self.rail is None else GuideData(self.guide, link, self.rail)
        return first, GuideData(self.pin, link, self.cam)

    @property
    def outlines(self) -> Mapping[str, Outline]:
        """The profile, and the roller."""
        angles, name = np.linspace(0.0, 2.0 * math.pi, 181), self.pin.partition(".")[0]

        def profile() -> Vec2:
            radius, rates = self.curve(numpy_(), angles)
            spot = self._at(numpy_(), (radius, *rates), angles, 0.0)
            return spot.place.plus(spot.normal, -(self.roller or 0.0))

        curves = {name: Outline(self.centre, self.cam, profile)}
        if self.face is None:
            circle = Vec2(np.cos(angles), np.sin(angles))
            curves[f"{name}.roller"] = Outline(self.pin, self.cam, lambda: circle * self.roller)
        return curves

    def _at(self, xp: Any, rates: Sequence[Any], angle: Any, more: Any) -> ProfilePoint:
        """The point of the pitch curve, or of the profile under a face, by `more` beyond an angle."""
        r, r1, r2, r3 = rates
        r, r1 = r + more * (r1 + more * (0.5 * r2 + more * (r3 / 6.0))), r1 + more * (r2 + more * (0.5 * r3))
        spot = ProfilePoint.placed(xp, (r, r1, r2 + more * r3, r3), angle + more)
        return spot.beside(self.roller) if self.roller is not None and self.grows else spot

    def _sight(self, linkage: LinkageInMotion) -> tuple[Link, Link, Vec2, Vec2 | None]:
        """The frame of the cam, that of the start of the follower, and what the cam sees of this one: its pin, or a
        point of its rail, and the direction of the rail."""
        cam = self.cam.at_position(linkage.links)
        if self.rail is None:
            base = Link(linkage.pins[self.bar.pin], cam.u, 0.0, 0.0)
        else:
            base = self.rail.at_position(linkage.links)
        point, along = (rotated(v, mirrored(cam.u)) for v in (base.pin.p - cam.pin.p, base.u))
        return cam, base, point, None if self.rail is None else along

    def _gap(self, xp: Any, sight: Any, spot: ProfilePoint) -> tuple[Any, Any, Any, Any]:
        """What the follower misses on the profile at a point of it, the slope of that by the angle, its size, and the
        margin."""
        n, v, along = spot.normal, spot.place - sight[2], sight[3]
        lever, bend, l = n.turned().dot(v), spot.speed * spot.curvature, self.arm.x
        if along is None and self.face is None:
            return 0.5 * (v.squared() - l * l), spot.speed * lever, l * l, lever / l
        if along is None:
            return n.dot(v) - l, bend * lever, spot.speed, lever / xp.sqrt(v.squared())
        if self.face is None:
            return along.cross(v), spot.speed * along.dot(n), spot.speed, along.dot(n)
        m = rotated(self.face, along)
        return n.turned().dot(m), -bend * n.dot(m), 1.0, self.face.x

    def _found(self, xp: Any, sight: Any, near: Any, steps: Sequence[int]) -> tuple[Any, ProfilePoint]:
        """The angle of the contact by Newton's method from a near one, and the point there."""
        zero = sight[2] if sight[3] is None else sight[3]
        zero_angle = xp.atan2(zero.y, zero.x)
        for count in steps:
            angle = zero_angle + near
            # a profile is given within a turn
            angle, more = xp.atan2(-xp.sin(angle), -xp.cos(angle)) + math.pi, 0.0
            radius, rates = self.curve(xp, angle)
            for _ in range(count):
                gap, slope, *_ = self._gap(xp, sight, self._at(xp, (radius, *rates), angle, more))
                more = more - gap / slope
            near = near + more
        return near, self._at(xp, (radius, *rates), angle, more)

    def derive(self, xp: Any, before: Callable[[float], LinkageInMotion]) -> list[Any]:
        """See `derived_count`."""
        way = Revolution(self.start, self.span)
        angles = way.angles(SAMPLES, SAMPLES)
        places = [way.place(angle) for angle in angles]
        course = [self._found(xp, self._sight(before(places[0])), self.near, _FIRST)[0]]
        for q in places[1:]:
            near = 2.0 * course[-1] - course[max(len(course) - 2, 0)]
            course.append(self._found(xp, self._sight(before(q)), near, _FURTHER)[0])
        return series_of(course, angles, HARMONICS)

    def solve(self, xp: Any, q: Any, linkage: LinkageInMotion, derived: Sequence[Any]) -> SolvedGroup:
        """The follower on the profile, near the angle that the series `derived` gives."""
        sight = self._sight(linkage)
        (near,) = Revolution(self.start, self.span).values(xp, derived, 1, self.derived_count, q)
        _, spot = self._found(xp, sight, near, _LAST)
        gap, _, size, margin = self._gap(xp, sight, spot)
        miss, room = gap / (size * _MISFIT), spot.curvature
        if self.face is None:
            room = 1.0 - self.roller * spot.curvature
        margin = margin * (1.0 - miss * miss) * room / (xp.abs(room) + 1e-9)
        (cam, base, point, _), u = sight, sight[1].u
        start = base.pin.p
        world = spot._replace(normal=rotated(spot.normal, cam.u), place=rotated(spot.place, cam.u))
        first: Placed = Hinge(0, base=base.pin)
        if self.rail is not None:
            n = u if self.face is None else rotated(self.face, u)
            s = n.dot(cam.pin.p + world.place - start) / n.dot(u)
            start, first = start + u * s, Guide(0, u, s, u * s, base)
        elif self.face is None:
            u = rotated((spot.place - point) * (1.0 / self.arm.x), cam.u)
        else:
            u = world.normal
        arm = self.arm if self.arm is ZERO else rotated(self.arm, u)
        pose = (base.pin if self.rail is None else start), u
        return SolvedGroup([pose], (first, Contact(cam, start, arm, world, self.roller)), margin)
