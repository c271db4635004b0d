"""A cam and its follower: a link that turns about a pin or slides on a line, and lies with a roller or with a flat
face on a profile that is fixed to a link before it.

The profile is a closed curve about its centre: a radius over the angle. The centre of a roller runs on its pitch
curve, at the distance of the radius of the roller. At the contact neither link moves into the other one: this row
has the normal of the profile and its lever about the start of the follower, and its multiplier is the force of the
contact. Up to the third derivatives the profile counts by its curvature and the change of that.

The angle of the profile at which the follower lies on it has no closed form. It is followed once around, as the pose
of a triad, and Newton's method makes it exact from the series. All else follows from it in closed form.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from ..core.jets import Jet
from ..core.planar import ZERO, Link, Vec2, mirrored, rotated
from .block import Row
from .body import Bar, Load
from .driver import Course
from .group import Group, Outline, SolvedGroup
from .joints import (
    Guide,
    GuideData,
    GuideForce,
    Hinge,
    HingeData,
    JointData,
    LinkageInMotion,
    Placed,
    Rail,
    Rates,
    Slide,
    Third,
)
from .series import series_of, values_of

SAMPLES, HARMONICS = 48, 16
"""Number of places of the driver at which a follower is followed once around, and order of the series."""
_STEPS = (3, 2)
"""Steps of Newton's method with the profile about the first angle, and about the one that they give."""
_FIRST = (4, 4, 4)
_MISFIT = 1e-9
"""Misfit of the contact, in parts of its size, at which the margin is 0: Newton's method has failed."""
_LINES = 144


class ProfilePoint(NamedTuple):
    """A point of a profile, which is run through counter-clockwise: its `place` from the centre [m], its `normal` to
    the outside, a unit vector, its `speed` by the angle [m/rad], its `curvature`, positive where it bulges [1/m], and
    the `change` of that by the length [1/m2]."""

    place: Vec2
    normal: Vec2
    speed: Any
    curvature: Any
    change: Any

    @classmethod
    def of(cls, xp: Any, rates: Sequence[Any], angle: Any) -> ProfilePoint:
        """The point at an angle, from the radius there and its derivatives up to the third."""
        r, r1, r2, r3 = rates
        u, square = Vec2(xp.cos(angle), xp.sin(angle)), r * r + r1 * r1
        speed = xp.sqrt(square)
        tangent, bulge = (u * r1 + u.turned() * r) * (1.0 / speed), square + r1 * r1 - r * r2
        change = (2.0 * r * r1 + 3.0 * r1 * r2 - r * r3) * square - 3.0 * bulge * (r + r2) * r1
        cube = square * speed
        return cls(u * r, -tangent.turned(), speed, bulge / cube, change / (cube * cube))

    def beside(self, gap: Any) -> ProfilePoint:
        """The point of the curve at a distance outward, at the same angle."""
        growth = 1.0 + gap * self.curvature
        per = 1.0 / growth
        place, change = self.place.plus(self.normal, gap), self.change * per * per * per
        return ProfilePoint(place, self.normal, self.speed * growth, self.curvature * per, change)

    def turned(self, u: Vec2) -> ProfilePoint:
        """The point of the profile that is turned by the angle of a unit vector."""
        return self._replace(place=rotated(self.place, u), normal=rotated(self.normal, u))


class ContactData(GuideData):
    """The contact of a follower as data: the centre of its roller, or a point of its face, as `pin`; the follower as
    `link`; and in `by` the centre of the profile, and the direction of its angle 0, in the link of the cam."""

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
    """The contact at one position: the frame `cam` of the profile; `base` is the start of the follower, and `arm` goes
    from there to the centre of its roller of the radius `roller`, or to a point of its face, where this is None; `at`
    is the point of the pitch curve, or of the profile, from its centre."""

    __slots__ = ("_arm", "_at", "_base", "_cam", "_reach", "_roller")

    def __init__(self, cam: Link, base: Vec2, arm: Vec2, at: ProfilePoint, roller: Any) -> None:
        self._cam, self._base, self._arm, self._at, self._roller = cam, base, arm, at, roller
        # from the point of the face to the contact, along the face
        seen = base + arm - cam.pin.p
        self._reach = 0.0 if roller is not None else at.normal.turned().dot(at.place - seen)

    @property
    def _lever(self) -> Any:
        return self._arm.cross(self._at.normal) - self._reach

    def rows(self) -> list[Row]:
        """Its row: of the point at the contact along the normal."""
        n = self._at.normal
        return [{0: n.x, 1: n.y, 2: self._lever}]

    def right(self, rates: Rates, before: Third | None) -> list[Any]:
        """See `Joint`: the derivative of the gap while the next derivatives of the follower are 0."""
        seen, turn = self._seen(rates, len(rates) + 1, before)
        n, at = self._at.normal, self._at
        if self._roller is not None:
            along = seen.dot(n.turned())
            along = Jet(0.0, *along.parts[1:])
            square = along * along
            gap = seen.dot(n) + square * (0.5 * at.curvature) + square * along * (at.change / 6.0)
        else:
            # the distance of a tangent from the centre over its angle
            height, foot, radius = at.place.dot(n), at.place.dot(n.turned()), 1.0 / at.curvature
            cubic = -(at.change * radius * radius * radius + foot) / 6.0
            square = turn * turn
            tangent = turn * foot + square * (0.5 * (radius - height)) + square * turn * cubic
            gap = seen.dot(rotated(_direction(turn), n)) - tangent
        return [-gap.parts[-1]]

    def _seen(self, rates: Rates, order: int, before: Third | None = None) -> tuple[Vec2, Jet]:
        """The point of the follower from the centre, as the cam sees it, and the angle of the follower less that of
        the cam, up to an `order` of derivatives; those of the follower beyond `rates` are 0."""
        centre, cam = self._cam.pin, [self._cam.t1, self._cam.t2]
        places = [centre.p1, centre.p2]
        if before is not None:
            places.append(before[0])
            cam.append(before[1])
        rest = [0.0] * (order - len(rates))
        x, y, angle = (Jet(*([z[k] for z in rates] + rest)) for k in range(3))
        arm = rotated(_direction(Jet(0.0, *angle.parts)), self._arm)
        turn = Jet(0.0, *cam[:order])
        start = self._base - centre.p
        from_centre = Vec2(
            Jet(start.x, *x.parts) - Jet(0.0, *(p.x for p in places[:order])) + arm.x,
            Jet(start.y, *y.parts) - Jet(0.0, *(p.y for p in places[:order])) + arm.y,
        )
        return rotated(from_centre, _direction(-turn)), Jet(0.0, *angle.parts) - turn

    def force(self, multipliers: Iterator[Any]) -> tuple[Vec2 | None, Any]:
        """The force of the contact, above 0 where it presses."""
        force = next(multipliers)
        return GuideForce.along(self._at.normal, force, force * self._lever), None

    def slide(self, rates: Rates) -> Slide:
        """The motion of the follower along the profile, where both touch; the way along it has no meaning."""
        seen, turn = self._seen(rates, 2)
        n, follower = self._at.normal, rates[0][2]
        t = n.turned()
        _, along1, along2 = seen.dot(t).parts
        _, turn1, turn2 = turn.parts
        if self._roller is not None:
            normal_turn = self._cam.t1 + self._at.curvature * along1
            growth = (normal_turn - follower) * self._arm.dot(n)
            return Slide(
                t, None, along1 - self._roller * turn1, along2 - self._roller * turn2, normal_turn, growth
            )
        growth = along1 - turn1 / self._at.curvature
        return Slide(t, None, along1, along2 - turn1 * turn1 * self._reach, follower, growth)


def _direction(turn: Jet) -> Vec2:
    """Cosine and sine of an angle that is 0 at first, up to its third derivative."""
    square = turn * turn
    return Vec2(1.0 - square * 0.5, turn - square * turn * (1.0 / 6.0))


class _Sight(NamedTuple):
    """What the cam sees before the follower: its own frame, the start of the follower, or its line, as a link, and in
    its frame the pin of the follower, or a point of its line, the direction of that line, and the direction from which
    the angle of the contact counts."""

    cam: Link
    base: Link
    point: Vec2
    along: Vec2 | None
    zero: Vec2


@dataclass
class CamFollower(Group):
    """A follower on a pin or on a `rail` that moves in a known way: its bar, whose `pin` is the centre of its roller or
    a point of its face, at `arm` in its frame; the centre and the angle 0 of the profile, `cam`, in a link before it,
    and its radius over the angle, `curve`; the radius of the `roller`, with which the profile `grows` to the pitch
    curve; `face` is the normal of a flat face, away from the cam, in the frame of the bar. `guide` is the pin at which
    the force of the rail acts.

    The frame of a follower on a pin starts there, towards the centre of its roller or along the normal of its face; the
    frame of one on a rail starts at `pin`. The angle of the contact counts from the pin of the follower, or from the
    direction of its rail; `near` is a rough one at the place `start` of the driver. The margin is the sine of the angle
    between the force and its lever, or the cosine of the pressure angle; below 0 an undercut profile."""

    bar: Bar
    pin: str
    arm: Vec2
    cam: Rail
    curve: Callable[[Any, Any], Course]
    roller: Any
    grows: bool
    face: Vec2 | None
    rail: Rail | None
    guide: str
    name: str
    centre: str
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
        import numpy as np

        from ..core.engines import numpy_

        xp, angles = numpy_(), np.linspace(0.0, 2.0 * math.pi, _LINES + 1)
        at = self._at(xp, self._rates(xp, angles), angles)
        place = at.place if self.roller is None else at.place.plus(at.normal, -self.roller)
        outlines = {self.name: Outline(self.centre, self.cam, (place.x, place.y))}
        if self.roller:
            x, y = (self.roller * wave(angles) for wave in (np.cos, np.sin))
            outlines[f"{self.name} roller"] = Outline(self.pin, self.cam, (x, y))
        return outlines

    def clear(self, xp: Any, at: ProfilePoint) -> Any:
        """1 at a point of the pitch curve that is clear, and -1 at one that is undercut, as the radius of the roller
        exceeds its radius of curvature; under a flat face, as the profile does not bulge."""
        room = at.curvature if self.roller is None else 1.0 - self.roller * at.curvature
        return room / (xp.abs(room) + 1e-9)

    def _rates(self, xp: Any, angle: Any) -> tuple[Any, ...]:
        """The radius and its derivatives at an angle, within a turn."""
        radius, rates = self.curve(xp, angle)
        return radius, *rates

    def _at(self, xp: Any, rates: Sequence[Any], angle: Any, more: Any = None) -> ProfilePoint:
        """The point of the pitch curve, or of the profile under a face, at an angle, or `more` beyond it."""
        if more is not None:
            r, r1, r2, r3 = rates
            rates = (
                r + more * (r1 + more * (0.5 * r2 + more * (r3 / 6.0))), r1 + more * (r2 + more * (0.5 * r3)),
                r2 + more * r3, r3,
            )  # fmt: skip
            angle = angle + more
        at = ProfilePoint.of(xp, rates, angle)
        return at.beside(self.roller) if self.roller is not None and self.grows else at

    def _sight(self, linkage: LinkageInMotion) -> _Sight:
        cam = self.cam.at_position(linkage.links)
        back = mirrored(cam.u)
        if self.rail is None:
            pin = linkage.pins[self.bar.pin]
            point = rotated(pin.p - cam.pin.p, back)
            return _Sight(cam, Link(pin, cam.u, 0.0, 0.0), point, None, point)
        rail = self.rail.at_position(linkage.links)
        along = rotated(rail.u, back)
        return _Sight(cam, rail, rotated(rail.pin.p - cam.pin.p, back), along, along)

    def _gap(self, xp: Any, sight: _Sight, at: ProfilePoint) -> tuple[Any, Any, Any, Any]:
        """What the follower misses on the profile at a point of it, the slope of that by the angle, the size of it,
        and the margin."""
        n, v, along = at.normal, at.place - sight.point, sight.along
        lever = n.turned().dot(v)
        if self.face is None:
            if along is None:
                l = self.arm.x
                return 0.5 * (v.squared() - l * l), at.speed * lever, l * l, lever / l
            cosine = along.dot(n)
            return along.cross(v), at.speed * cosine, at.speed, cosine
        spin = at.speed * at.curvature
        if along is None:
            return n.dot(v) - self.arm.x, spin * lever, at.speed, lever / xp.sqrt(v.squared())
        m = rotated(self.face, along)
        return n.turned().dot(m), -spin * n.dot(m), 1.0, self.face.x

    def _found(
        self, xp: Any, sight: _Sight, near: Any, steps: Sequence[int]
    ) -> tuple[Any, ProfilePoint, Any, Any]:
        """The angle of the contact by Newton's method from a near one, the point there, what it misses, and the
        margin."""
        zero = xp.atan2(sight.zero.y, sight.zero.x)
        for count in steps:
            turned = zero + near
            angle = xp.atan2(-xp.sin(turned), -xp.cos(turned)) + math.pi
            rates, more = self._rates(xp, angle), 0.0
            for _ in range(count):
                gap, slope, *_ = self._gap(xp, sight, self._at(xp, rates, angle, more))
                more = more - gap / slope
            near = near + more
        at = self._at(xp, rates, angle, more)
        gap, _, size, margin = self._gap(xp, sight, at)
        return near, at, gap / size, margin

    def derive(self, xp: Any, before: Callable[[float], LinkageInMotion]) -> list[Any]:
        """See `derived_count`."""
        angles = [self.start + 2.0 * math.pi * k / SAMPLES for k in range(SAMPLES)]
        found: list[Any] = []
        for q in angles:
            near = self.near if not found else found[-1] if len(found) < 2 else 2.0 * found[-1] - found[-2]
            found.append(self._found(xp, self._sight(before(q)), near, (3,) if found else _FIRST)[0])
        return series_of(found, angles, HARMONICS)

    def solve(self, xp: Any, q: Any, linkage: LinkageInMotion, derived: Sequence[Any]) -> SolvedGroup:
        """The follower on the profile, near the angle that the series `derived` gives."""
        sight, (near,) = self._sight(linkage), values_of([derived], xp.cos(q), xp.sin(q))
        _, at, gap, margin = self._found(xp, sight, near, _STEPS)
        cam, base, miss = sight.cam, sight.base, gap * (1.0 / _MISFIT)
        margin = margin * self.clear(xp, at) * (1.0 - miss * miss)
        world, first, start = at.turned(cam.u), Hinge(0, base=base.pin), base.pin.p
        if self.rail is None:
            reach = at.place - sight.point
            u = world.normal if self.face is not None else rotated(reach * (1.0 / self.arm.x), cam.u)
            pose: Any = base.pin, u
        else:
            u, place = base.u, cam.pin.p + world.place - start
            n = None if self.face is None else rotated(self.face, u)
            s = u.dot(place) if n is None else n.dot(place) / n.dot(u)
            way = u * s
            start, first = start + way, Guide(0, u, s, way, base)
            pose = start, u
        arm = self.arm if self.arm is ZERO else rotated(self.arm, u)
        contact = Contact(cam, start, arm, world, self.roller if self.face is None else None)
        return SolvedGroup([pose], (first, contact), margin)
