"""The legs of a triad: a rod between two pins, a block on a rail, and a block in a slot of the ternary link.

Each leg takes one degree of freedom from the ternary link, and so gives one row of the triad's matrix: the wrench
(force, moment about the origin of the ternary link) that the leg can exert on the ternary link. A rod pulls along its
line, a block pushes across its line. `LegAt` is a leg at one pose of the ternary link, which has its origin at
`origin` and its x axis along `u`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar, NamedTuple

from ..core.planar import ZERO, Link, Motion, Vec2, coriolis, coriolis_third, rod_rates
from .body import Bar, Load
from .group import GuideForce, Joint, PlacedLinkage, Rail, Slide, Third


class SolvedLeg(NamedTuple):
    """A leg as a link, its inner pin, and the motion in its sliding joint, where it has one."""

    link: Link
    pin: Motion | None
    slide: Slide | None


@dataclass
class Leg:
    """A leg as data: its bar."""

    bar: Bar

    @property
    def inner(self) -> str:
        """The pin that it has on the ternary link, if any."""
        return ""

    @property
    def joints(self) -> tuple[Joint, Joint]:
        """Pin and link of its outer and of its inner reaction."""
        raise NotImplementedError

    @property
    def rail(self) -> Rail | None:
        """The line of an earlier link on which it slides, if any."""
        return None

    def at_position(self, at: PlacedLinkage) -> PlacedLeg:
        """The leg, with the linkage `at` before it, for any pose of the ternary link."""
        raise NotImplementedError


class LegAt:
    """A leg at one pose: its `row`, the `gap` by which it misses, in the unit of the row, the `size` of the row's
    force, and a `spot` of the ternary link through which it goes, from the origin. `on_rail` says whether it depends
    on a rail; else it starts from a pin."""

    __slots__ = ("gap", "row", "size", "spot")
    on_rail: ClassVar[bool] = False

    row: tuple[Any, Any, Any]
    gap: Any
    size: Any
    spot: Vec2

    def misfit(self, xp: Any) -> Any:
        """The gap of the leg in size, in parts of its length, or of the unit for a block."""
        raise NotImplementedError

    def first(self) -> Any:
        """Right side for the first derivatives of the pose."""
        raise NotImplementedError

    def second(self, origin1: Vec2, t1: Any) -> Any:
        """Right side for the second derivatives of the pose, from the first ones."""
        raise NotImplementedError

    def third_right_side(self, ternary: Link, outer: Third) -> Any:
        """Right side for the third derivatives of the pose, from the outer pin or the rail."""
        raise NotImplementedError

    def link_third(self, ternary: Link, ternary_third: Third, outer: Third) -> tuple[Third, Vec2 | None]:
        """Third derivatives of the leg, and of its inner pin, from the ternary link's (`ternary_third`)."""
        raise NotImplementedError

    def solution(self, ternary: Link) -> SolvedLeg:
        """The leg as a link, its inner pin, and the motion in its sliding joint."""
        raise NotImplementedError

    def known_part(self, load: Load) -> tuple[Vec2, Any]:
        """The part of the leg's action on the ternary link, reversed, that follows from its own load alone: force,
        and moment about the origin."""
        raise NotImplementedError

    def reactions(self, load: Load, known: Vec2, pull: Any) -> tuple[Vec2, Vec2]:
        """Its outer and its inner reaction, from the known part of the inner one and the factor of its row."""
        raise NotImplementedError


PlacedLeg = Callable[[Vec2, Vec2], LegAt]


@dataclass
class RodLeg(Leg):
    """A rod from a pin of known motion to a `pin` of the ternary link, at `arm` in its frame [m]."""

    pin: str
    arm: Vec2

    @property
    def inner(self) -> str:
        """The pin on the ternary link."""
        return self.pin

    @property
    def joints(self) -> tuple[Joint, Joint]:
        return (self.bar.pin, self.bar.name), (self.pin, self.bar.name)

    def at_position(self, at: PlacedLinkage) -> PlacedLeg:
        return partial(RodAt, at.pins[self.bar.pin], self.bar.length, self.arm)


def _turned_arm(arm: Vec2, u: Vec2) -> Vec2:
    return Vec2(u.x * arm.x - u.y * arm.y, u.y * arm.x + u.x * arm.y)


class RodAt(LegAt):
    """A rod at one pose: with r from its outer pin P to its inner pin and A from the origin of the ternary link to
    the inner pin, its row is (r, A x r)."""

    __slots__ = ("_outer", "_per_square", "_r")

    def __init__(self, outer: Motion, length: Any, arm: Vec2, origin: Vec2, u: Vec2) -> None:
        self._outer, self.size = outer, length
        a = self.spot = _turned_arm(arm, u)
        r = self._r = origin + a - outer.p
        self.row = r.x, r.y, a.cross(r)
        square = length * length
        self.gap = 0.5 * (square - r.squared())
        self._per_square = 1.0 / square

    def misfit(self, xp: Any) -> Any:
        return xp.abs(xp.sqrt(self._r.squared()) / self.size - 1.0)

    def first(self) -> Any:
        return self._r.dot(self._outer.p1)

    def second(self, origin1: Vec2, t1: Any) -> Any:
        a, p = self.spot, self._outer
        return self._r.dot(p.p2 + a * (t1 * t1)) - (origin1 + a.turned() * t1 - p.p1).squared()

    def third_right_side(self, ternary: Link, outer: Third) -> Any:
        a, p, t1 = self.spot, self._outer, ternary.t1
        k = ternary.carried(a)
        centripetal = 3.0 * (k.p1 - p.p1).dot(k.p2 - p.p2)
        return (
            self._r.dot(outer[0] + a.turned() * (t1 * t1 * t1) + a * (3.0 * (t1 * ternary.t2))) - centripetal
        )

    def link_third(self, ternary: Link, ternary_third: Third, outer: Third) -> tuple[Third, Vec2 | None]:
        end = ternary.third_derivative(self.spot, *ternary_third)
        p, k = self._outer, ternary.carried(self.spot)
        t1 = self._r.cross(k.p1 - p.p1) * self._per_square
        return (outer[0], self._r.cross(end - outer[0]) * self._per_square + t1 * t1 * t1), end

    def solution(self, ternary: Link) -> SolvedLeg:
        p, k, r = self._outer, ternary.carried(self.spot), self._r
        k = Motion(p.p + r, k.p1, k.p2)
        rates = rod_rates(r, k.p1 - p.p1, k.p2 - p.p2, self._per_square)
        return SolvedLeg(Link(p, r * (1.0 / self.size), *rates), k, None)

    def known_part(self, load: Load) -> tuple[Vec2, Any]:
        """See `LegAt`: the force across the rod, which the moment about its outer pin needs."""
        across = self._r.turned() * (-load[1] * self._per_square)
        return across, self.spot.cross(across)

    def reactions(self, load: Load, known: Vec2, pull: Any) -> tuple[Vec2, Vec2]:
        inner = known + self._r * pull
        return -(load[0] + inner), inner


def rods_at(outer: Sequence[Motion], lengths: Sequence[Any], arms: Sequence[Vec2]) -> list[PlacedLeg]:
    """Rods from pins of this motion, with these lengths and arms [m]."""
    return [partial(RodAt, *each) for each in zip(outer, lengths, arms, strict=True)]


@dataclass
class BlockLeg(Leg):
    """A block on a rail of known motion, with a `pin` of the ternary link, at `arm` in its frame [m]. Its own frame
    starts at this pin and has the direction of the rail; the rail goes through the pin. `guide` is the pin at which
    the force of the rail acts on the block."""

    pin: str
    arm: Vec2
    on: Rail
    guide: str

    @property
    def inner(self) -> str:
        """The pin on the ternary link."""
        return self.pin

    @property
    def joints(self) -> tuple[Joint, Joint]:
        return (self.guide, self.bar.name), (self.pin, self.bar.name)

    @property
    def rail(self) -> Rail | None:
        """The line of an earlier link on which the leg slides."""
        return self.on

    def at_position(self, at: PlacedLinkage) -> PlacedLeg:
        return partial(BlockAt, self.on.at_position(at.links), self.arm)


class BlockAt(LegAt):
    """A block on a rail at one pose: with n normal to the rail, its row is (n, A x n)."""

    __slots__ = ("_n", "_rail", "_way")
    on_rail = True

    def __init__(self, rail: Link, arm: Vec2, origin: Vec2, u: Vec2) -> None:
        self._rail, self.size = rail, 1.0
        a = self.spot = _turned_arm(arm, u)
        n = self._n = rail.u.turned()
        self._way = origin + a - rail.pin.p
        self.row = n.x, n.y, a.cross(n)
        self.gap = -self._way.dot(n)

    def misfit(self, xp: Any) -> Any:
        return xp.abs(self.gap)

    def first(self) -> Any:
        return self._rail.carried(self._way).p1.dot(self._n)

    def second(self, origin1: Vec2, t1: Any) -> Any:
        a, rail, carried = self.spot, self._rail, self._rail.carried(self._way)
        rate = (origin1 + a.turned() * t1 - carried.p1).dot(rail.u)
        return (coriolis(rail, carried, rail.u * rate) + a * (t1 * t1)).dot(self._n)

    def _slide(self, ternary: Link) -> Slide:
        rail = self._rail
        carried, k = rail.carried(self._way), ternary.carried(self.spot)
        s1 = (k.p1 - carried.p1).dot(rail.u)
        s2 = (k.p2 - coriolis(rail, carried, rail.u * s1)).dot(rail.u)
        return Slide(rail.u, self._way.dot(rail.u), s1, s2)

    def third_right_side(self, ternary: Link, outer: Third) -> Any:
        a, t1, slide, rail = self.spot, ternary.t1, self._slide(ternary), self._rail
        carried = rail.third_derivative(self._way, *outer)
        moved = coriolis_third(rail, carried, slide.d * slide.s1, slide.d * slide.s2)
        return (moved + a.turned() * (t1 * t1 * t1) + a * (3.0 * (t1 * ternary.t2))).dot(self._n)

    def link_third(self, ternary: Link, ternary_third: Third, outer: Third) -> tuple[Third, Vec2 | None]:
        end = ternary.third_derivative(self.spot, *ternary_third)
        return (end, outer[1]), end

    def solution(self, ternary: Link) -> SolvedLeg:
        k, rail = ternary.carried(self.spot), self._rail
        return SolvedLeg(Link(k, rail.u, rail.t1, rail.t2), k, self._slide(ternary))

    def known_part(self, load: Load) -> tuple[Vec2, Any]:
        """See `LegAt`: the force along the rail."""
        along = self._rail.u * -load[0].dot(self._rail.u)
        return along, self.spot.cross(along)

    def reactions(self, load: Load, known: Vec2, pull: Any) -> tuple[Vec2, Vec2]:
        (force, moment), n = load, self._n
        inner = known + n * pull
        return GuideForce.along(n, -(force + inner).dot(n), -moment), inner


@dataclass
class SlotLeg(Leg):
    """A block on a pin of known motion, in a slot of the ternary link: the line through `at` [m] in the direction
    `along`, a unit vector, both in the frame of the ternary link. The frame of the block starts at its pin and has
    the direction of the slot; the slot goes through the pin. `guide` is the pin at which the force of the slot acts
    on the block."""

    at: Vec2
    along: Vec2
    guide: str

    @property
    def joints(self) -> tuple[Joint, Joint]:
        return (self.bar.pin, self.bar.name), (self.guide, self.bar.name)

    def at_position(self, at: PlacedLinkage) -> PlacedLeg:
        return partial(SlotAt, at.pins[self.bar.pin], self.at, self.along)


class SlotAt(LegAt):
    """A block in a slot at one pose: with n normal to the slot and y from the origin of the ternary link to the pin
    of the block, its row is (n, y x n)."""

    __slots__ = ("_d", "_n", "_outer", "_y")

    def __init__(self, outer: Motion, at: Vec2, along: Vec2, origin: Vec2, u: Vec2) -> None:
        self._outer, self.size = outer, 1.0
        d = self._d = _turned_arm(along, u)
        n = self._n = d.turned()
        self.spot = _turned_arm(at, u)
        y = self._y = outer.p - origin
        self.row = n.x, n.y, y.cross(n)
        self.gap = (y - self.spot).dot(n)

    def misfit(self, xp: Any) -> Any:
        return xp.abs(self.gap)

    def first(self) -> Any:
        return self._outer.p1.dot(self._n)

    def second(self, origin1: Vec2, t1: Any) -> Any:
        y1 = self._outer.p1 - origin1
        return self._outer.p2.dot(self._n) - 2.0 * (t1 * y1.dot(self._d)) - t1 * t1 * self._y.dot(self._n)

    def third_right_side(self, ternary: Link, outer: Third) -> Any:
        d, n, y, t1, t2 = self._d, self._n, self._y, ternary.t1, ternary.t2
        y1, y2 = self._outer.p1 - ternary.pin.p1, self._outer.p2 - ternary.pin.p2
        rest = t1 * y2.dot(d) + t2 * y1.dot(d) + t1 * t1 * y1.dot(n) + t1 * t2 * y.dot(n)
        return outer[0].dot(n) - 3.0 * rest + t1 * t1 * t1 * y.dot(d)

    def link_third(self, ternary: Link, ternary_third: Third, outer: Third) -> tuple[Third, Vec2 | None]:
        return (outer[0], ternary_third[1]), None

    def solution(self, ternary: Link) -> SolvedLeg:
        p, d = self._outer, self._d
        carried = ternary.carried(self._y)
        s1 = (p.p1 - carried.p1).dot(d)
        s2 = (p.p2 - coriolis(ternary, carried, d * s1)).dot(d)
        slide = Slide(d, (self._y - self.spot).dot(d), s1, s2)
        return SolvedLeg(Link(p, d, ternary.t1, ternary.t2), None, slide)

    def known_part(self, load: Load) -> tuple[Vec2, Any]:
        """See `LegAt`: the moment of the block."""
        return ZERO, -load[1]

    def reactions(self, load: Load, known: Vec2, pull: Any) -> tuple[Vec2, Vec2]:
        force, moment = load
        inner = GuideForce.along(self._n, pull, -moment)
        return -(force + inner), inner
