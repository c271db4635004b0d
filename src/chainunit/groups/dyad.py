"""The dyad (class II Assur group, three revolute joints): two links P-B and Q-B.

P and Q move in a known way, B is where the circles about them meet. A circle intersection
gives the position, one 2x2 system (solved twice) the motion, one 2x2 system the forces.

r1 = B - P, r2 = B - Q, and ``det = r1 x r2``; ``det/(a b)`` is the sine of the transmission
angle and vanishes in a dead position.
"""

from __future__ import annotations

from typing import Any

from ..planar import Link, Motion, Vec2


class Dyad:
    """A solved dyad: its links `first` (from P) and `second` (from Q), the inner pin `b`,
    the arms `r1`, `r2`, their product `det` and the sine `transmission` of the angle between."""

    __slots__ = ("b", "det", "first", "r1", "r2", "second", "transmission")

    def __init__(self, xp: Any, p: Motion, q: Motion, a: Any, b: Any, side: float) -> None:
        """
        Parameters
        ----------
        xp : engine (see `chainunit.engines`)
        p, q : motion of the outer pins
        a, b : lengths P-B and Q-B [m]
        side : +1 where B lies to the left of the ray from P to Q, -1 where to the right
        """
        d = q.p - p.p
        d2 = d.squared()
        along = 0.5 * (1.0 + (a * a - b * b) / d2)
        across = side * xp.sqrt(a * a / d2 - along * along)
        r1 = d * along + d.turned() * across
        r2 = r1 - d
        det = r1.cross(r2)

        g = q.p1 - p.p1
        s1 = g.dot(r2) / det
        s2 = g.dot(r1) / det
        h = q.p2 - p.p2 + r1 * (s1 * s1) - r2 * (s2 * s2)
        self.r1 = r1
        self.r2 = r2
        self.det = det
        self.transmission = det / (a * b)
        self.first = Link(p, r1 * (1.0 / a), s1, h.dot(r2) / det)
        self.second = Link(q, r2 * (1.0 / b), s2, h.dot(r1) / det)
        self.b = self.first.at(a)

    def reactions(self, first: tuple[Vec2, Any], second: tuple[Vec2, Any]) -> tuple[Vec2, Vec2, Vec2]:
        """Forces at P (on the first link), at B (on the first link, from the second) and at Q
        (on the second link) [N], from the loads on each link: force and moment about P and Q."""
        f1, m1 = first
        f2, m2 = second
        at_b = (self.r1 * m2 + self.r2 * m1) * (-1.0 / self.det)
        return -(f1 + at_b), at_b, at_b - f2
