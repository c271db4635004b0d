"""The dyads with two sliding joints (class II Assur groups): PRP and RPP, each in closed form. See
`chainunit.groups.sliding` for the symbols."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..core.planar import Link, Motion, Vec2, coriolis, coriolis_third
from .body import Bar, Load
from .group import Group, GuideForce, PlacedLinkage, Rail, Slide, Solution, SolvedGroup, Third


@dataclass
class PRP(Group):
    """Cross slide: two sliders, `first` and `second`, on a rail each, with the `inner` pin between them.

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
    def bars(self) -> tuple[Bar, ...]:
        return self.first, self.second

    @property
    def pins(self) -> dict[str, str]:
        """The pins that the group adds, with the links on which further groups hang."""
        return {self.inner: self.second.name}

    @property
    def joints(self) -> tuple[tuple[str, str], ...]:
        first, second = self.first.name, self.second.name
        return (self.guides_at[0], first), (self.inner, first), (self.guides_at[1], second)

    @property
    def guides(self) -> Mapping[tuple[str, str], str | None]:
        first, _, second = self.joints
        return {first: self.first_rail.of, second: self.second_rail.of}

    @property
    def rails(self) -> tuple[Rail, ...]:
        return self.first_rail, self.second_rail

    def solve(self, xp: Any, q: Any, at: PlacedLinkage, derived: Sequence[Any]) -> SolvedPRP:
        return SolvedPRP.between(
            self.first_rail.at_position(at.links), self.second_rail.at_position(at.links)
        )


class SolvedPRP(SolvedGroup):
    """A solved PRP dyad; its margin is the sine of the angle between the rails."""

    __slots__ = ("_rails",)

    def __init__(self, rails: tuple[Link, Link, Any], *common: *Solution) -> None:
        super().__init__(*common)
        self._rails = rails

    @classmethod
    def between(cls, a: Link, b: Link) -> SolvedPRP:
        """
        Parameters
        ----------
        a, b : the rails of the first and of the second slider
        """
        per = 1.0 / a.u.cross(b.u)

        def displacements(gap: Vec2) -> tuple[Any, Any]:
            """Ways along both rails that close a gap: a.u x - b.u y = gap."""
            return gap.cross(b.u) * per, gap.cross(a.u) * per

        x, y = displacements(b.pin.p - a.pin.p)
        on_a, on_b = a.carried(a.u * x), b.carried(b.u * y)
        x1, y1 = displacements(on_b.p1 - on_a.p1)
        most_a, most_b = coriolis(a, on_a, a.u * x1), coriolis(b, on_b, b.u * y1)
        x2, y2 = displacements(most_b - most_a)
        inner = Motion(on_a.p, on_a.p1 + a.u * x1, most_a + a.u * x2)
        links = Link(inner, a.u, a.t1, a.t2), Link(inner, b.u, b.t1, b.t2)
        slides = Slide(a.u, x, x1, x2), Slide(b.u, y, y1, y2)
        return cls((a, b, per), links, (inner,), a.u.cross(b.u), slides)

    def third_derivatives(
        self, outer: Sequence[Vec2], rails: Sequence[Third] = ()
    ) -> tuple[Sequence[Third], Sequence[Vec2]]:
        (a, b, per), (one, other), (inner,) = self._rails, self.slides, self.pins
        most = []
        for rail, slide, (base, t3) in ((a, one, rails[0]), (b, other, rails[1])):
            carried = rail.third_derivative(inner.p - rail.pin.p, base, t3)
            most.append(coriolis_third(rail, carried, slide.d * slide.s1, slide.d * slide.s2))
        x3 = (most[1] - most[0]).cross(b.u) * per
        end = most[0] + a.u * x3
        return [(end, rails[0][1]), (end, rails[1][1])], [end]

    def reactions(self, loads: Sequence[Load]) -> tuple[Vec2, ...]:
        """Forces on the first slider from its rail and at the inner pin, and on the second slider from its rail [N],
        from the loads on each slider, about the inner pin."""
        (f1, m1), (f2, m2) = loads
        a, b, per = self._rails
        # along the rails: (f1 + X) . a = 0, (f2 - X) . b = 0; with X = -turned(a) x .. solved for its parts
        along_a, along_b = -f1.dot(a.u), f2.dot(b.u)
        inner = (a.u * along_b - b.u * along_a).turned() * per
        na, nb = a.u.turned(), b.u.turned()
        return (
            GuideForce.along(na, -(f1 + inner).dot(na), -m1),
            inner,
            GuideForce.along(nb, (inner - f2).dot(nb), -m2),
        )


@dataclass
class RPP(Group):
    """Yoke: the `block` on a pin that moves in a known way, in a slot of the `yoke`, which slides on a `rail`.

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
    def bars(self) -> tuple[Bar, ...]:
        return self.block, self.yoke

    @property
    def pins(self) -> dict[str, str]:
        """See `Group`: none."""
        return {}

    @property
    def joints(self) -> tuple[tuple[str, str], ...]:
        block, yoke = self.block, self.yoke
        return (block.pin, block.name), (self.guides_at[0], block.name), (self.guides_at[1], yoke.name)

    @property
    def guides(self) -> Mapping[tuple[str, str], str | None]:
        _, slot, rail = self.joints
        return {slot: self.yoke.name, rail: self.rail.of}

    @property
    def rails(self) -> tuple[Rail, ...]:
        return (self.rail,)

    def solve(self, xp: Any, q: Any, at: PlacedLinkage, derived: Sequence[Any]) -> SolvedRPP:
        return SolvedRPP.between(at.pins[self.block.pin], self.rail.at_position(at.links), self.slot)


class SolvedRPP(SolvedGroup):
    """A solved RPP dyad; its margin is the sine of the angle between rail and slot."""

    __slots__ = ("_per", "_rail")

    def __init__(self, rail: Link, per: Any, *common: *Solution) -> None:
        super().__init__(*common)
        self._rail, self._per = rail, per

    @classmethod
    def between(cls, p: Motion, rail: Link, slot: Vec2) -> SolvedRPP:
        """
        Parameters
        ----------
        p : motion of the pin of the block
        rail : the rail of the yoke
        slot : see `RPP`
        """
        d = rail.u
        e = d * slot.x + d.turned() * slot.y
        per = 1.0 / slot.y  # d x e

        def displacements(gap: Vec2) -> tuple[Any, Any]:
            """Ways along rail and slot: d x + e y = gap."""
            return gap.cross(e) * per, d.cross(gap) * per

        w = p.p - rail.pin.p
        x, y = displacements(w)
        carried = rail.carried(w)
        x1, y1 = displacements(p.p1 - carried.p1)
        slid = d * x1 + e * y1
        x2, y2 = displacements(p.p2 - coriolis(rail, carried, slid))
        on_rail = rail.carried(d * x)
        start = Motion(on_rail.p, on_rail.p1 + d * x1, coriolis(rail, on_rail, d * x1) + d * x2)
        links = Link(p, d, rail.t1, rail.t2), Link(start, d, rail.t1, rail.t2)
        return cls(rail, per, links, (), slot.y, (Slide(e, y, y1, y2), Slide(d, x, x1, x2)))

    def third_derivatives(
        self, outer: Sequence[Vec2], rails: Sequence[Third] = ()
    ) -> tuple[Sequence[Third], Sequence[Vec2]]:
        (p,), ((base, t3),), rail, (slot, way) = outer, rails, self._rail, self.slides
        block, yoke = self.links
        d, e = way.d, slot.d
        slid, slid2 = d * way.s1 + e * slot.s1, d * way.s2 + e * slot.s2
        carried = rail.third_derivative(block.pin.p - rail.pin.p, base, t3)
        x3 = (p - coriolis_third(rail, carried, slid, slid2)).cross(e) * self._per
        on_rail = rail.third_derivative(yoke.pin.p - rail.pin.p, base, t3)
        start = coriolis_third(rail, on_rail, d * way.s1, d * way.s2) + d * x3
        return [(p, t3), (start, t3)], []

    def reactions(self, loads: Sequence[Load]) -> tuple[Vec2, ...]:
        """Forces on the block at its pin and from the slot, and on the yoke from the rail [N], from the loads on the
        block, about its pin, and on the yoke, about the start of its frame."""
        (f1, m1), (f2, m2) = loads
        block, yoke = self.links
        slot, way = self.slides
        across, n = slot.d.turned(), way.d.turned()
        # along the rail, on the yoke: f2 - across N = 0, and across . d = -d x e
        force = -f2.dot(way.d) * self._per
        in_slot = GuideForce.along(across, force, -m1)
        # on the yoke acts the opposite at the pin of the block
        moment = m2 + m1 - (block.pin.p - yoke.pin.p).cross(in_slot)
        return -(f1 + in_slot), in_slot, GuideForce.along(n, (in_slot - f2).dot(n), -moment)
