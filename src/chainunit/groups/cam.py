"""A cam and its follower: a link on a pin or on a rail, with a roller or a flat face on a profile of a link before it.

The profile is a radius over the angle about its centre; the centre of a roller runs on its pitch curve. The row of the
contact has the normal of the profile and its lever about the start of the follower. The angle at which the follower
lies on the profile is followed once around, as the pose of a triad; the rest is closed form. Up to third derivatives
a profile counts by its curvature and the change of that.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from ..core.engines import numpy_
from ..core.jets import Jet
from ..core.planar import ZERO, Link, Vec2, mirrored, rotated
from .block import Row
from .body import Bar, Load
from .driver import Course
from .group import Group, Outline, SolvedGroup
from .joints import Guide, GuideData, GuideForce, Hinge, HingeData, JointData, LinkageInMotion, Placed, Rail
from .joints import Rates, Slide, Third
from .series import series_of, values_of

SAMPLES, HARMONICS = 48, 16
"""Places of the driver at which a follower is followed once around, and the order of the series."""
_FIRST, _FURTHER, _LAST = (4, 4, 4), (3,), (3, 2)
"""Steps of Newton's method at the first place, at a further one, and from the series: by the number of times that the
profile is taken anew about the angle."""
_MISFIT = 1e-9
"""Misfit of a contact, in parts of its size, at which the margin is 0: the follower is lost."""


class ProfilePoint(NamedTuple):
    """A point of a profile that is run through counter-clockwise: its `place` from the centre [m], its unit `normal` to
    the outside, its `speed` by the angle [m/rad], its `curvature`, above 0 where it bulges [1/m], and the `change` of
    that by the length [1/m2]."""

    place: Vec2
    normal: Vec2
    speed: Any
    curvature: Any
    change: Any

    @classmethod
    def at(cls, xp: Any, rates: Sequence[Any], angle: Any) -> ProfilePoint:
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


class ContactData(GuideData):
    """The contact of the follower `link` as data: the centre of its roller, or a point of its face, is `pin`; `by` has
    the centre of the profile and the direction of its angle 0."""

    def turning(self, m: LinkageInMotion, carrier: str | None, reaction: Vec2) -> Iterator[tuple[str, Load]]:
        """See `JointData`: the normal turns, and its lever changes."""
        link, contact = m.links[self.link], m.slides[self.pin, self.link]
        more, moment = reaction.turned() * contact.turn, -reaction.dot(contact.d.turned()) * contact.growth
        yield self.link, (more, moment)
        if carrier is not None:
            other = m.links[carrier]
            arm, arm1 = link.pin.p - other.pin.p, link.pin.p1 - other.pin.p1
            yield carrier, (-more, -(moment + arm1.cross(reaction) + arm.cross(more)))


class Contact(Placed):
    """The contact at one position: the frame `cam` of the profile, the start `base` of the follower, and from there the
    `arm` to the centre of its roller of the radius `roller`, or to a point of its face, where this is None; `at` is the
    point of the pitch curve, or of the profile, turned with the cam."""

    __slots__ = ("_arm", "_at", "_base", "_cam", "_lever", "_reach", "_roller")

    def __init__(self, cam: Link, base: Vec2, arm: Vec2, at: ProfilePoint, roller: Any) -> None:
        self._cam, self._base, self._arm, self._at, self._roller = cam, base, arm, at, roller
        # along the face, from its point to the contact
        face = at.normal.turned().dot(at.place - (base + arm - cam.pin.p))
        self._reach = face if roller is None else 0.0
        self._lever = arm.cross(at.normal) - self._reach

    def rows(self) -> list[Row]:
        """Its row: of the point at the contact along the normal."""
        return [{0: self._at.normal.x, 1: self._at.normal.y, 2: self._lever}]

    def right(self, rates: Rates, before: Third | None) -> list[Any]:
        """See `Placed`: what the gap loses while the next derivatives of the follower are 0."""
        (seen, turn), at = self._seen(rates, len(rates) + 1, before), self._at
        n, t, k = at.normal, at.normal.turned(), at.curvature
        if self._roller is not None:
            along = Jet(0.0, *seen.dot(t).parts[1:])
            gap = seen.dot(n) + along * along * (0.5 * k + along * (at.change / 6.0))
        else:
            # less the distance of a tangent of the profile from its centre, over the angle
            foot, bend = at.place.dot(t), 1.0 / k - at.place.dot(n)
            cubic = -(at.change / (k * k * k) + foot) / 6.0
            gap = seen.dot(rotated(_direction(turn), n)) - turn * (turn * (turn * cubic + 0.5 * bend) + foot)
        return [-gap.parts[-1]]

    def _seen(self, rates: Rates, order: int, before: Third | None = None) -> tuple[Vec2, Jet]:
        """The point of the follower from the centre, as the cam sees it, and the angle of the follower less that of the
        cam, up to an `order` of derivatives; those of the follower beyond `rates` are 0."""
        centre, known = self._cam.pin, [(self._cam.t1, self._cam.pin.p1), (self._cam.t2, self._cam.pin.p2)]
        if before is not None:
            known.append((before[1], before[0]))
        start, rest = self._base - centre.p, [0.0] * (order - len(rates))
        x, y, angle = (Jet(0.0, *(z[k] for z in rates), *rest) for k in range(3))
        cam = Jet(0.0, *(t for t, _ in known[:order]))
        moved = Vec2(*(Jet(0.0, *(getattr(p, axis) for _, p in known[:order])) for axis in "xy"))
        point = rotated(_direction(angle), self._arm) + Vec2(x + start.x, y + start.y) - moved
        return rotated(point, _direction(-cam)), angle - cam

    def force(self, multipliers: Iterator[Any]) -> tuple[Vec2 | None, Any]:
        """The force of the contact, above 0 where it presses."""
        force = next(multipliers)
        return GuideForce.along(self._at.normal, force, force * self._lever), None

    def slide(self, rates: Rates) -> Slide:
        """The motion of the follower past the cam at the contact."""
        seen, turn = self._seen(rates, 2)
        n, follower, k = self._at.normal, rates[0][2], self._at.curvature
        (_, s1, s2), (_, turn1, turn2) = seen.dot(n.turned()).parts, turn.parts
        if self._roller is None:
            return Slide(n.turned(), None, s1, s2 - turn1 * turn1 * self._reach, follower, s1 - turn1 / k)
        turned = self._cam.t1 + k * s1
        growth = (turned - follower) * self._arm.dot(n)
        return Slide(n.turned(), None, s1 - self._roller * turn1, s2 - self._roller * turn2, turned, growth)


def _direction(turn: Jet) -> Vec2:
    """Cosine and sine of an angle that is 0 at first, up to the third derivatives."""
    square = turn * turn
    return Vec2(1.0 - square * 0.5, turn - square * turn * (1.0 / 6.0))


class _Sight(NamedTuple):
    """What the cam sees before the follower: its own frame, that of the start of the follower, in its frame the pin of
    the follower, or a point of its rail, and the direction of that rail."""

    cam: Link
    base: Link
    point: Vec2
    along: Vec2 | None


@dataclass
class CamFollower(Group):
    """A follower on a pin or on a `rail` that moves in a known way. The centre of its roller or a point of its face is
    `pin`, at `arm` in the frame of its bar; the frame of one on a pin has the direction of this arm, or of the normal of
    its face, that of one on a rail starts at `pin`. `cam` is the centre of the profile, the pin `centre`, with the
    direction of its angle 0; `curve` the radius over the angle; `roller` the radius of the roller, with which the
    profile `grows` to the pitch curve; `face` the normal of a face, away from the cam. `guide` is the pin at which the
    force of the rail acts. The angle of the contact counts from the pin of the follower, or from its rail; it is `near`
    to its value at the place `start` of the driver.

    The margin is the cosine of the pressure angle, below 0 where the profile is undercut."""

    bar: Bar
    pin: str
    arm: Vec2
    cam: Rail
    centre: str
    curve: Callable[[Any, Any], Course]
    roller: Any
    grows: bool
    face: Vec2 | None
    rail: Rail | None
    guide: str
    near: float
    start: float

    derived_count: ClassVar[int] = 2 * HARMONICS + 1
    """The number of values that `derive` gives: the series of the angle of the contact."""

    @property
    def joints(self) -> tuple[JointData, ...]:
        """Its pin or its guide, and the contact."""
        link = self.bar.name
        first = HingeData(self.bar.pin, link) if self.rail is None else GuideData(self.guide, link, self.rail)
        return first, ContactData(self.pin, link, self.cam)

    @property
    def outlines(self) -> Mapping[str, Outline]:
        """The profile, and the roller."""
        angles, name = np.linspace(0.0, 2.0 * math.pi, 181), self.pin.partition(".")[0]

        def profile() -> Vec2:
            radius, rates = self.curve(numpy_(), angles)
            at = self._at(numpy_(), (radius, *rates), angles, 0.0)
            return at.place.plus(at.normal, -(self.roller or 0.0))

        curves = {name: Outline(self.centre, self.cam, profile)}
        if self.face is None:
            circle = Vec2(np.cos(angles), np.sin(angles))
            curves[f"{name}.roller"] = Outline(self.pin, self.cam, lambda: circle * self.roller)
        return curves

    def _at(self, xp: Any, rates: Sequence[Any], angle: Any, more: Any) -> ProfilePoint:
        """The point of the pitch curve, or of the profile under a face, by `more` beyond an angle."""
        r, r1, r2, r3 = rates
        r, r1 = r + more * (r1 + more * (0.5 * r2 + more * (r3 / 6.0))), r1 + more * (r2 + more * (0.5 * r3))
        at = ProfilePoint.at(xp, (r, r1, r2 + more * r3, r3), angle + more)
        return at.beside(self.roller) if self.roller is not None and self.grows else at

    def _sight(self, linkage: LinkageInMotion) -> _Sight:
        cam, pin = self.cam.at_position(linkage.links), linkage.pins.get(self.bar.pin)
        base = Link(pin, cam.u, 0.0, 0.0) if self.rail is None else self.rail.at_position(linkage.links)
        point, along = (rotated(v, mirrored(cam.u)) for v in (base.pin.p - cam.pin.p, base.u))
        return _Sight(cam, base, point, None if self.rail is None else along)

    def _gap(self, xp: Any, sight: _Sight, at: ProfilePoint) -> tuple[Any, Any, Any, Any]:
        """What the follower misses on the profile at a point of it, the slope of that by the angle, its size, and the
        margin."""
        n, v, along = at.normal, at.place - sight.point, sight.along
        lever, bend, l = n.turned().dot(v), at.speed * at.curvature, self.arm.x
        if along is None and self.face is None:
            return 0.5 * (v.squared() - l * l), at.speed * lever, l * l, lever / l
        if along is None:
            return n.dot(v) - l, bend * lever, at.speed, lever / xp.sqrt(v.squared())
        if self.face is None:
            return along.cross(v), at.speed * along.dot(n), at.speed, along.dot(n)
        m = rotated(self.face, along)
        return n.turned().dot(m), -bend * n.dot(m), 1.0, self.face.x

    def _found(self, xp: Any, sight: _Sight, near: Any, steps: Sequence[int]) -> tuple[Any, ProfilePoint]:
        """The angle of the contact by Newton's method from a near one, and the point there."""
        zero = sight.point if sight.along is None else sight.along
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
        angles = [self.start + 2.0 * math.pi * k / SAMPLES for k in range(SAMPLES)]
        course = [self._found(xp, self._sight(before(self.start)), self.near, _FIRST)[0]]
        for q in angles[1:]:
            near = 2.0 * course[-1] - course[max(len(course) - 2, 0)]
            course.append(self._found(xp, self._sight(before(q)), near, _FURTHER)[0])
        return series_of(course, angles, HARMONICS)

    def solve(self, xp: Any, q: Any, linkage: LinkageInMotion, derived: Sequence[Any]) -> SolvedGroup:
        """The follower on the profile, near the angle that the series `derived` gives."""
        sight, (near,) = self._sight(linkage), values_of([derived], xp.cos(q), xp.sin(q))
        _, at = self._found(xp, sight, near, _LAST)
        gap, _, size, margin = self._gap(xp, sight, at)
        miss, room = gap / (size * _MISFIT), at.curvature
        if self.face is None:
            room = 1.0 - self.roller * at.curvature
        margin = margin * (1.0 - miss * miss) * room / (xp.abs(room) + 1e-9)
        cam, base, u = sight.cam, sight.base, sight.base.u
        start, world = (
            base.pin.p,
            at._replace(normal=rotated(at.normal, cam.u), place=rotated(at.place, cam.u)),
        )
        first: Placed = Hinge(0, base=base.pin)
        if self.rail is not None:
            n = u if self.face is None else rotated(self.face, u)
            s = n.dot(cam.pin.p + world.place - start) / n.dot(u)
            start, first = start + u * s, Guide(0, u, s, u * s, base)
        elif self.face is None:
            u = rotated((at.place - sight.point) * (1.0 / self.arm.x), cam.u)
        else:
            u = world.normal
        arm = self.arm if self.arm is ZERO else rotated(self.arm, u)
        pose = (base.pin if self.rail is None else start), u
        return SolvedGroup([pose], (first, Contact(cam, start, arm, world, self.roller)), margin)
