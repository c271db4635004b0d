"""The dyads (class II Assur groups): two links with three joints, hinges (R) or guides (P), each kind in closed form.

The outer joints lie on pins and lines that move in a known way. A guide keeps two links at a fixed angle to each
other and a point of one on a line of the other. `d` is the direction of that line, `n` the direction that is turned
from it by +90 degrees. A line that belongs to a link before the group is a `Rail`. Where it is placed, it is a `Link`
of its own: it starts from a point of the line, and its unit vector is `d`. The base points are chosen so that the
group's pin itself lies on the rail: a constant offset between the block and the pin turns with the rail, as the block
does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ..core.planar import ZERO, Vec2
from .body import Bar
from .group import Group, SolvedGroup
from .joints import Guide, GuideData, Hinge, HingeData, JointData, LinkageInMotion, Rail


@dataclass
class Dyad(Group):
    """A dyad with three hinges: two bars, which start from pins of known motion, and the inner pin at the ends of
    both. `side` is +1 where the inner pin lies to the left of the ray from the first bar's pin to the second bar's
    pin, -1 where it lies to the right. Further groups on the inner pin hang on the second link. Its margin is the
    sine of the angle between the bars."""

    inner: str
    first: Bar
    second: Bar
    side: float

    @property
    def joints(self) -> tuple[JointData, ...]:
        first, second = self.first, self.second
        return (
            HingeData(first.pin, first.name),
            HingeData(self.inner, first.name, second.name),
            HingeData(second.pin, second.name),
        )

    def solve(self, xp: Any, q: Any, linkage: LinkageInMotion, derived: Sequence[Any]) -> SolvedGroup:
        """The dyad where its outer pins are."""
        a, b = self.first.length, self.second.length
        start, end = linkage.pins[self.first.pin], linkage.pins[self.second.pin]
        r1, r2 = meeting(xp, start.p, end.p, a * a, b * b, self.side)
        # casadi turns each use of 1/x into a division by x, but keeps -1/x
        per_a, per_b = -1.0 / a, -1.0 / b
        poses = (start, Vec2(-(r1.x * per_a), -(r1.y * per_a))), (end, Vec2(-(r2.x * per_b), -(r2.y * per_b)))
        return SolvedGroup(poses, (Hinge(0, base=start), Hinge(0, r1, 1, r2), Hinge(1, base=end)), size=a * b)


def meeting(xp: Any, p: Vec2, q: Vec2, a2: Any, b2: Any, side: float) -> tuple[Vec2, Vec2]:
    """The vectors from two points to the point at the squared distances `a2` and `b2` from them, on the left of the
    ray from p to q if `side` is +1, on its right if -1."""
    # in components, as in `Body`
    dx, dy = q.x - p.x, q.y - p.y
    minus_per = -1.0 / (dx * dx + dy * dy)
    along = 0.5 * (1.0 + (b2 - a2) * minus_per)
    across = side * xp.sqrt(-(a2 * minus_per) - along * along)
    x, y = dx * along - dy * across, dy * along + dx * across
    return Vec2(x, y), Vec2(x - dx, y - dy)


@dataclass
class RRP(Group):
    """Coupler and slider: the rod `first` from a pin that moves in a known way to the `inner` pin, which the `slider`
    carries along a `rail`. Its margin is the cosine of the angle between rod and rail.

    The slider's frame starts at the inner pin and has the direction of the rail. `side` is +1 where the inner pin
    lies beyond the foot of the perpendicular from the outer pin to the rail, in the rail's direction, -1 where
    before it. `guide` is the pin at which the force of the sliding joint acts on the slider.
    """

    inner: str
    first: Bar
    slider: Bar
    rail: Rail
    guide: str
    side: float

    @property
    def joints(self) -> tuple[JointData, ...]:
        first, slider = self.first, self.slider.name
        return (
            HingeData(first.pin, first.name),
            HingeData(self.inner, first.name, slider),
            GuideData(self.guide, slider, self.rail),
        )

    def solve(self, xp: Any, q: Any, linkage: LinkageInMotion, derived: Sequence[Any]) -> SolvedGroup:
        """The slider stands where the line meets the circle of the first bar about its pin, on one of two sides."""
        start, rail, a = linkage.pins[self.first.pin], self.rail.at_position(linkage.links), self.first.length
        d, w = rail.u, rail.pin.p - start.p
        across = w.cross(d)
        along = self.side * xp.sqrt(a * a - across * across)
        s = along - w.dot(d)
        r = w + d * s
        way = d * s
        return SolvedGroup(
            ((start, r * (1.0 / a)), (rail.pin.p + way, d)),
            (Hinge(0, base=start), Hinge(0, r, 1), Guide(1, d, s, way, rail)),
            along / a,
        )


@dataclass
class RPR(Group):
    """Oscillating slide: the links `first` and `second` on pins that move in a known way, with a sliding joint
    between them. Its margin is the sine of the angle between the line of the pins and the normal of the slide: 0
    where the first pin lies beside the second one.

    The frames of both links start at these pins and have the direction of the line. The first pin lies on the line,
    or `offset` [m] to the left of the parallel to it through the second pin. `side` is +1 where the first pin lies
    beyond the second one, in the direction of the line, -1 where before it. `guide` is the pin at which the force of
    the sliding joint acts on the first link, from the second.
    """

    first: Bar
    second: Bar
    offset: Any
    guide: str
    side: float

    @property
    def joints(self) -> tuple[JointData, ...]:
        first, second = self.first, self.second
        return (
            HingeData(first.pin, first.name),
            GuideData(self.guide, first.name, second.name),
            HingeData(second.pin, second.name),
        )

    def solve(self, xp: Any, q: Any, linkage: LinkageInMotion, derived: Sequence[Any]) -> SolvedGroup:
        """The line of the second bar goes past the pin of the first one at the `offset`; it has one of two
        directions."""
        start, end, h = linkage.pins[self.first.pin], linkage.pins[self.second.pin], self.offset
        v = start.p - end.p  # way d + offset n
        square = v.squared()
        way = self.side * xp.sqrt(square - h * h)
        d = (v * way - v.turned() * h) * (1.0 / square)
        joints = Hinge(0, base=start), Guide(0, d, way, v, 1), Hinge(1, base=end)
        return SolvedGroup(((start, d), (end, d)), joints, way / xp.sqrt(square))


@dataclass
class PRP(Group):
    """Cross slide: two sliders, `first` and `second`, on a rail each, with the `inner` pin between them. Its margin
    is the sine of the angle between the rails.

    The frame of each slider starts at the inner pin and has the direction of its rail. `guides_at` are the pins at
    which the forces of the sliding joints act on the sliders.
    """

    inner: str
    first: Bar
    second: Bar
    first_rail: Rail
    second_rail: Rail
    guides_at: tuple[str, str]

    @property
    def joints(self) -> tuple[JointData, ...]:
        first, second = self.first.name, self.second.name
        return (
            GuideData(self.guides_at[0], first, self.first_rail),
            HingeData(self.inner, first, second),
            GuideData(self.guides_at[1], second, self.second_rail),
        )

    def solve(self, xp: Any, q: Any, linkage: LinkageInMotion, derived: Sequence[Any]) -> SolvedGroup:
        """The pin stands where the two lines meet."""
        a, b = self.first_rail.at_position(linkage.links), self.second_rail.at_position(linkage.links)
        per, gap = 1.0 / a.u.cross(b.u), b.pin.p - a.pin.p
        # a.u x - b.u y = gap
        x, y = gap.cross(b.u) * per, gap.cross(a.u) * per
        on_a, on_b = a.u * x, b.u * y
        pin = a.pin.p + on_a
        joints = Guide(0, a.u, x, on_a, a), Hinge(0, ZERO, 1), Guide(1, b.u, y, on_b, b)
        return SolvedGroup(((pin, a.u), (pin, b.u)), joints, a.u.cross(b.u))


@dataclass
class RPP(Group):
    """Yoke: the `block` on a pin that moves in a known way, in a slot of the `yoke`, which slides on a `rail`. Its
    margin is the sine of the angle between rail and slot.

    The frame of the block starts at its pin, that of the yoke at the point of its slot that moves along the rail;
    both have the direction of the rail. `slot` is the direction of the slot in that frame, a unit vector.
    `guides_at` are the pins at which the forces of the sliding joints act: on the block from the yoke, and on the
    yoke from the rail.
    """

    block: Bar
    yoke: Bar
    rail: Rail
    slot: Vec2
    guides_at: tuple[str, str]

    @property
    def joints(self) -> tuple[JointData, ...]:
        block, yoke = self.block, self.yoke.name
        return (
            HingeData(block.pin, block.name),
            GuideData(self.guides_at[0], block.name, yoke),
            GuideData(self.guides_at[1], yoke, self.rail),
        )

    def solve(self, xp: Any, q: Any, linkage: LinkageInMotion, derived: Sequence[Any]) -> SolvedGroup:
        """The yoke stands where the slot, whose direction is fixed to the line, goes through the pin of the block."""
        start, rail, slot = linkage.pins[self.block.pin], self.rail.at_position(linkage.links), self.slot
        d = rail.u
        e = d * slot.x + d.turned() * slot.y
        per, w = 1.0 / slot.y, start.p - rail.pin.p  # w = d x + e y, and d x e = slot.y
        x, y = w.cross(e) * per, d.cross(w) * per
        way = d * x
        joints = Hinge(0, base=start), Guide(0, e, y, e * y, 1), Guide(1, d, x, way, rail)
        return SolvedGroup(((start, d), (rail.pin.p + way, d)), joints, slot.y)
