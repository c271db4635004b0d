"""The dyad (class II Assur group, three revolute joints): two links P-B and Q-B.

P and Q move in a known way, B is where the circles about them meet. A circle intersection
gives the position, one 2x2 system (solved twice) the motion, one 2x2 system the forces.

r1 = B - P, r2 = B - Q, and ``det = r1 x r2``; ``det/(a b)`` is the sine of the transmission
angle and vanishes in a dead position.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..engines import Dual, slope
from ..planar import Link, Motion, Vec2, lifted
from .body import Bar, Load
from .group import Group, SolvedGroup


@dataclass
class Dyad(Group):
    """A dyad as data: two bars whose pins move in a known way, and the inner pin at the ends of both. `side` is +1
    where the inner pin lies to the left of the ray from the first bar's pin to the second one's, -1 where to the
    right. Of two links in the inner pin the second one carries what else hangs on it."""

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
        """Pins that it adds, each with the link that carries it."""
        return {self.inner: self.second.name}

    @property
    def joints(self) -> tuple[tuple[str, str], ...]:
        """Pin and link of each reaction, as `SolvedDyad.reactions` gives them."""
        first, second = self.first, self.second
        return (first.pin, first.name), (self.inner, first.name), (second.pin, second.name)

    def solve(self, xp: Any, q: Any, pins: Mapping[str, Motion], derived: Sequence[Any]) -> SolvedDyad:
        """The dyad where its outer `pins` are."""
        first, second = self.first, self.second
        return SolvedDyad.between(
            xp, pins[first.pin], pins[second.pin], first.length, second.length, self.side
        )


class SolvedDyad(SolvedGroup):
    """A solved dyad: its links from P and from Q, the inner pin B, the arms `r1`, `r2`; its margin is the sine of the
    angle between them."""

    __slots__ = ("_minus_per_det", "_rates", "r1", "r2")

    def __init__(
        self,
        arms: tuple[Vec2, Vec2],
        minus_per_det: Any,
        rates: tuple[Any, Any],
        links: tuple[Link, Link],
        pin: Motion,
        margin: Any = 1.0,
    ) -> None:
        super().__init__(links, (pin,), margin)
        self.r1, self.r2 = arms
        self._minus_per_det, self._rates = minus_per_det, rates

    @classmethod
    def between(cls, xp: Any, p: Motion, q: Motion, a: Any, b: Any, side: float) -> SolvedDyad:
        """
        Parameters
        ----------
        xp : engine (see `chainunit.engines`)
        p, q : motion of the outer pins
        a, b : lengths P-B and Q-B [m]
        side : +1 where B lies to the left of the ray from P to Q, -1 where to the right
        """
        d = q.p - p.p
        # a factor 1/x would come back from casadi as a division by x wherever it is used; -1/x stays one
        minus_per_d2 = -1.0 / d.squared()
        along = 0.5 * (1.0 + (b * b - a * a) * minus_per_d2)
        across = side * xp.sqrt(-(a * a * minus_per_d2) - along * along)
        r1 = d * along + d.turned() * across
        r2 = r1 - d
        det = r1.cross(r2)
        minus_per_det = -1.0 / det
        g = p.p1 - q.p1
        rates = g.dot(r2) * minus_per_det, g.dot(r1) * minus_per_det
        x, y = _second(p, q, r1, r2, rates, minus_per_det)
        first, second = Link(p, r1 * (1.0 / a), rates[0], x), Link(q, r2 * (1.0 / b), rates[1], y)
        return cls((r1, r2), minus_per_det, rates, (first, second), first.carried(r1), det / (a * b))

    def lifted(self, outer: tuple[Motion, ...]) -> SolvedDyad:
        """See `SolvedGroup`."""
        (p, q), (first, second) = outer, self.links
        r1, r2 = (lifted(r, r.turned() * s) for r, s in zip((self.r1, self.r2), self._rates, strict=True))
        rates = Dual(first.t1, first.t2), Dual(second.t1, second.t2)
        per = self._minus_per_det
        minus_per_det = Dual(per, per * per * slope(r1.cross(r2)))
        x, y = _second(p, q, r1, r2, rates, minus_per_det)
        # the values are known; derivatives alone are new
        links = (
            first.lifted(p, Dual(first.t2, slope(x))),
            second.lifted(q, Dual(second.t2, slope(y))),
        )
        return SolvedDyad((r1, r2), minus_per_det, rates, links, links[0].lifted_point(self.pins[0]))

    def reactions(self, loads: tuple[Load, ...]) -> tuple[Vec2, Vec2, Vec2]:
        """Forces at P (on the first link), at B (on the first link, from the second) and at Q
        (on the second link) [N], from the loads on each link: force and moment about P and Q."""
        (f1, m1), (f2, m2) = loads
        at_b = (self.r1 * m2 + self.r2 * m1) * self._minus_per_det
        return -(f1 + at_b), at_b, at_b - f2


def _second(
    p: Motion, q: Motion, r1: Vec2, r2: Vec2, rates: tuple[Any, Any], minus_per_det: Any
) -> tuple[Any, Any]:
    """Second derivatives of both links' angles by q."""
    s1, s2 = rates
    h = p.p2 - q.p2 - r1 * (s1 * s1) + r2 * (s2 * s2)
    return h.dot(r2) * minus_per_det, h.dot(r1) * minus_per_det
