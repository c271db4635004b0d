"""The dyad (class II Assur group, three revolute joints): two links P-B and Q-B.

The motion of P and Q is known; B is an intersection of the circles about them. This intersection
gives the position, one 2x2 system (solved twice) the motion, one 2x2 system the forces.

r1 = B - P, r2 = B - Q, and ``det = r1 x r2``; ``det/(a b)`` is the sine of the transmission
angle and vanishes in a dead position.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ..core.planar import Link, Motion, Vec2
from .body import Bar, Load
from .group import Group, PlacedLinkage, SolvedGroup, Third


@dataclass
class Dyad(Group):
    """A dyad as data: two bars, which start from pins of known motion, and the inner pin at the ends of both. `side`
    is +1 where the inner pin lies to the left of the ray from the first bar's pin to the second bar's pin, -1 where
    it lies to the right. Further groups on the inner pin hang on the second link."""

    inner: str
    first: Bar
    second: Bar
    side: float

    @property
    def bars(self) -> tuple[Bar, ...]:
        """Its links."""
        return self.first, self.second

    @property
    def pins(self) -> dict[str, str]:
        """The pins that the dyad adds, each with the link that carries it."""
        return {self.inner: self.second.name}

    @property
    def joints(self) -> tuple[tuple[str, str], ...]:
        """Pin and link of each reaction, in the order of `SolvedDyad.reactions`."""
        first, second = self.first, self.second
        return (first.pin, first.name), (self.inner, first.name), (second.pin, second.name)

    def solve(self, xp: Any, q: Any, at: PlacedLinkage, derived: Sequence[Any]) -> SolvedDyad:
        """The dyad where its outer pins are."""
        first, second, pins = self.first, self.second, at.pins
        return SolvedDyad.between(
            xp, pins[first.pin], pins[second.pin], first.length, second.length, self.side
        )


class SolvedDyad(SolvedGroup):
    """A solved dyad: its links from P and from Q, the inner pin B, and the arms `r1`, `r2`. Its margin is the sine of
    the angle between the arms."""

    __slots__ = ("_minus_per_det", "r1", "r2")

    def __init__(
        self,
        arms: tuple[Vec2, Vec2],
        minus_per_det: Any,
        links: tuple[Link, Link],
        pin: Motion,
        margin: Any = 1.0,
    ) -> None:
        super().__init__(links, (pin,), margin)
        self.r1, self.r2 = arms
        self._minus_per_det = minus_per_det

    @classmethod
    def between(cls, xp: Any, p: Motion, q: Motion, a: Any, b: Any, side: float) -> SolvedDyad:
        """
        Parameters
        ----------
        xp : engine (see `chainunit.core.engines`)
        p, q : motion of the outer pins
        a, b : lengths P-B and Q-B [m]
        side : +1 where B lies to the left of the ray from P to Q, -1 where to the right
        """
        # in components, as in `Body`; casadi turns each use of 1/x into a division by x, but keeps -1/x
        dx, dy = q.p.x - p.p.x, q.p.y - p.p.y
        minus_per_d2 = -1.0 / (dx * dx + dy * dy)
        along = 0.5 * (1.0 + (b * b - a * a) * minus_per_d2)
        across = side * xp.sqrt(-(a * a * minus_per_d2) - along * along)
        x1, y1 = dx * along - dy * across, dy * along + dx * across
        x2, y2 = x1 - dx, y1 - dy
        det = x1 * y2 - y1 * x2
        minus_per_det = -1.0 / det
        gx, gy = p.p1.x - q.p1.x, p.p1.y - q.p1.y
        s1, s2 = (gx * x2 + gy * y2) * minus_per_det, (gx * x1 + gy * y1) * minus_per_det
        k1, k2 = s1 * s1, s2 * s2
        hx = p.p2.x - q.p2.x - x1 * k1 + x2 * k2
        hy = p.p2.y - q.p2.y - y1 * k1 + y2 * k2
        minus_per_a, minus_per_b = -1.0 / a, -1.0 / b
        r1, u1 = Vec2(x1, y1), Vec2(-(x1 * minus_per_a), -(y1 * minus_per_a))
        r2, u2 = Vec2(x2, y2), Vec2(-(x2 * minus_per_b), -(y2 * minus_per_b))
        first = Link(p, u1, s1, (hx * x2 + hy * y2) * minus_per_det)
        second = Link(q, u2, s2, (hx * x1 + hy * y1) * minus_per_det)
        return cls((r1, r2), minus_per_det, (first, second), first.carried(r1), det / (a * b))

    def third_derivatives(
        self, outer: Sequence[Vec2], rails: Sequence[Third] = ()
    ) -> tuple[Sequence[Third], Sequence[Vec2]]:
        (p, q), (first, second) = outer, self.links
        (r1, s1, x), (r2, s2, y) = (self.r1, first.t1, first.t2), (self.r2, second.t1, second.t2)
        h = p - q - r1.turned() * (s1 * s1 * s1) + r2.turned() * (s2 * s2 * s2)
        h = h - r1 * (3.0 * (s1 * x)) + r2 * (3.0 * (s2 * y))
        thirds = (p, h.dot(r2) * self._minus_per_det), (q, h.dot(r1) * self._minus_per_det)
        return thirds, (first.third_derivative(r1, *thirds[0]),)

    def reactions(self, loads: Sequence[Load]) -> tuple[Vec2, Vec2, Vec2]:
        """Forces at P (on the first link), at B (on the first link, from the second) and at Q
        (on the second link) [N], from the loads on each link: force and moment about P and Q."""
        (f1, m1), (f2, m2) = loads
        r1, r2, k = self.r1, self.r2, self._minus_per_det
        x, y = (r1.x * m2 + r2.x * m1) * k, (r1.y * m2 + r2.y * m1) * k
        return Vec2(-(f1.x + x), -(f1.y + y)), Vec2(x, y), Vec2(x - f2.x, y - f2.y)
