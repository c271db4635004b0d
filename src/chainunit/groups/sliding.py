"""The dyads with one sliding joint (class II Assur groups): RRP and RPR, each in closed form. Those with two are in
`chainunit.groups.yokes`.

A sliding joint keeps two links at a fixed angle to each other and a point of one on a line of the other. `d` is the
direction of that line, `n` the direction that is turned from it by +90 degrees. The joint carries a force N n and a
moment, the couple of its guide.

A line that belongs to a link that moves in a known way is a `Rail`. Where it is placed, it is a `Link` of its own: it
starts from a point of the line, and its unit vector is `d`. The base points are chosen so that the group's pin itself
lies on the rail: a constant offset between the block and the pin turns with the rail, as the block does.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..core.planar import Link, Motion, Vec2, coriolis, coriolis_third, rod_rates
from .body import Bar, Load
from .group import Group, GuideForce, PlacedLinkage, Rail, Slide, Solution, SolvedGroup, Third


@dataclass
class RRP(Group):
    """Coupler and slider: the rod `first` from a pin that moves in a known way to the `inner` pin, which the `slider`
    carries along a `rail`.

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
    def bars(self) -> tuple[Bar, ...]:
        return self.first, self.slider

    @property
    def pins(self) -> dict[str, str]:
        """The pins that the group adds, with the links on which further groups hang."""
        return {self.inner: self.slider.name}

    @property
    def joints(self) -> tuple[tuple[str, str], ...]:
        first, slider = self.first.name, self.slider.name
        return (self.first.pin, first), (self.inner, first), (self.guide, slider)

    @property
    def guides(self) -> Mapping[tuple[str, str], str | None]:
        return {(self.guide, self.slider.name): self.rail.of}

    @property
    def rails(self) -> tuple[Rail, ...]:
        return (self.rail,)

    def solve(self, xp: Any, q: Any, at: PlacedLinkage, derived: Sequence[Any]) -> SolvedRRP:
        return SolvedRRP.between(
            xp, at.pins[self.first.pin], self.rail.at_position(at.links), self.first.length, self.side
        )


class SolvedRRP(SolvedGroup):
    """A solved RRP dyad; its margin is the cosine of the angle between rod and rail."""

    __slots__ = ("_per_along", "_per_square", "_rail")

    def __init__(self, rail: Link, per: tuple[Any, Any], *common: *Solution) -> None:
        super().__init__(*common)
        self._rail, (self._per_along, self._per_square) = rail, per

    @classmethod
    def between(cls, xp: Any, p: Motion, rail: Link, a: Any, side: float) -> SolvedRRP:
        """
        Parameters
        ----------
        p : motion of the outer pin of the rod
        rail : line of the inner pin
        a : length of the rod [m]
        side : see `RRP`
        """
        d = rail.u
        w = rail.pin.p - p.p
        across = w.cross(d)
        along = side * xp.sqrt(a * a - across * across)  # r . d
        s = along - w.dot(d)
        r = w + d * s
        carried = rail.carried(d * s)
        minus_per_along = -1.0 / along
        s1 = r.dot(carried.p1 - p.p1) * minus_per_along
        slid = d * s1
        r1 = carried.p1 + slid - p.p1
        most = coriolis(rail, carried, slid)
        s2 = (r.dot(most - p.p2) + r1.squared()) * minus_per_along
        r2 = most + d * s2 - p.p2
        per_square = 1.0 / (a * a)
        inner = Motion(carried.p, carried.p1 + slid, most + d * s2)
        rod = Link(p, r * (1.0 / a), *rod_rates(r, r1, r2, per_square))
        slider = Link(inner, d, rail.t1, rail.t2)
        per = minus_per_along, per_square
        return cls(rail, per, (rod, slider), (inner,), along / a, (Slide(d, s, s1, s2),))

    def third_derivatives(
        self, outer: Sequence[Vec2], rails: Sequence[Third] = ()
    ) -> tuple[Sequence[Third], Sequence[Vec2]]:
        (p,), ((base, t3),), (rod, slider), rail = outer, rails, self.links, self._rail
        (slide,), inner = self.slides, slider.pin
        r, r1, r2 = inner.p - rod.pin.p, inner.p1 - rod.pin.p1, inner.p2 - rod.pin.p2
        carried = rail.third_derivative(inner.p - rail.pin.p, base, t3)
        most = coriolis_third(rail, carried, slide.d * slide.s1, slide.d * slide.s2)
        s3 = (r.dot(most - p) + 3.0 * r1.dot(r2)) * self._per_along
        end = most + rail.u * s3
        turn = r.cross(end - p) * self._per_square + rod.t1 * rod.t1 * rod.t1
        return [(p, turn), (end, t3)], [end]

    def reactions(self, loads: Sequence[Load]) -> tuple[Vec2, ...]:
        """Forces on the rod at its outer pin and at the inner pin, and on the slider from the rail [N], from the
        loads on the rod, about its outer pin, and on the slider, about the inner pin."""
        (f1, m1), (f2, m2) = loads
        rod, slider = self.links
        d, r = slider.u, slider.pin.p - rod.pin.p
        n = d.turned()
        along = f2.dot(d)
        # moment about the outer pin: m1 + r x (d along + n across) = 0, with r x n = r . d
        across = (m1 + r.cross(d) * along) * self._per_along
        inner = d * along + n * across
        return -(f1 + inner), inner, GuideForce.along(n, across - f2.dot(n), -m2)


@dataclass
class RPR(Group):
    """Oscillating slide: the links `first` and `second` on pins that move in a known way, with a sliding joint
    between them.

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
    def bars(self) -> tuple[Bar, ...]:
        return self.first, self.second

    @property
    def pins(self) -> dict[str, str]:
        """See `Group`: none."""
        return {}

    @property
    def joints(self) -> tuple[tuple[str, str], ...]:
        first, second = self.first, self.second
        return (first.pin, first.name), (self.guide, first.name), (second.pin, second.name)

    @property
    def guides(self) -> Mapping[tuple[str, str], str | None]:
        return {(self.guide, self.first.name): self.second.name}

    def solve(self, xp: Any, q: Any, at: PlacedLinkage, derived: Sequence[Any]) -> SolvedRPR:
        return SolvedRPR.between(
            xp, at.pins[self.first.pin], at.pins[self.second.pin], self.offset, self.side
        )


class SolvedRPR(SolvedGroup):
    """A solved RPR dyad; its margin is the sine of the angle between the line of the pins and the normal of the
    slide: 0 where the first pin lies beside the second one."""

    __slots__ = ("_offset", "_per_way")

    def __init__(self, offset: Any, per_way: Any, *common: *Solution) -> None:
        super().__init__(*common)
        self._offset, self._per_way = offset, per_way

    @classmethod
    def between(cls, xp: Any, p: Motion, q: Motion, offset: Any, side: float) -> SolvedRPR:
        """
        Parameters
        ----------
        p, q : motion of the pins of the first and of the second link
        offset, side : see `RPR`
        """
        # v = P - Q = L d + offset n
        v, v1, v2 = p.p - q.p, p.p1 - q.p1, p.p2 - q.p2
        square = v.squared()
        way = side * xp.sqrt(square - offset * offset)
        per = 1.0 / square
        d = (v * way - v.turned() * offset) * per
        n = d.turned()
        per_way = 1.0 / way
        t1 = v1.dot(n) * per_way
        s1 = v1.dot(d) + t1 * offset
        # v'' = t2 (L n - offset d) - t1^2 v + 2 t1 L' n + L'' d
        t2 = (v2.dot(n) + t1 * t1 * offset - 2.0 * t1 * s1) * per_way
        s2 = v2.dot(d) + t2 * offset + t1 * t1 * way
        links = Link(p, d, t1, t2), Link(q, d, t1, t2)
        return cls(offset, per_way, links, (), way / xp.sqrt(square), (Slide(d, way, s1, s2),))

    def third_derivatives(
        self, outer: Sequence[Vec2], rails: Sequence[Third] = ()
    ) -> tuple[Sequence[Third], Sequence[Vec2]]:
        (p, q), (slide,), (link, _) = outer, self.slides, self.links
        n, t1, t2 = slide.d.turned(), link.t1, link.t2
        # the part along n of v''' = (t3 - t1^3) (L n - offset d) - 3 t1 t2 v + 3 t2 L' n - 3 t1^2 L' d
        #   + 3 t1 L'' n + L''' d
        rest = (p - q).dot(n) + 3.0 * t1 * t2 * self._offset - 3.0 * (t2 * slide.s1 + t1 * slide.s2)
        t3 = rest * self._per_way + t1 * t1 * t1
        return [(p, t3), (q, t3)], []

    def reactions(self, loads: Sequence[Load]) -> tuple[Vec2, ...]:
        """Forces on the first link at its pin and from the slide, and on the second at its pin [N], from the loads on
        each link, about its pin."""
        (f1, m1), (f2, m2) = loads
        first, _ = self.links
        n = first.u.turned()
        # on the second link, about its pin: m2 + m1 - (P - Q) x N n = 0
        force = (m1 + m2) * self._per_way
        guide = GuideForce.along(n, force, -m1)
        return -(f1 + guide), guide, guide - f2
