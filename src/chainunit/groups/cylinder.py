"""A cylinder that is pinned at both ends, with the lever that it swings: a driver of three links.

The barrel P-.. on a ground pin and the rod ..-C slide along each other; the lever Q-C stands on another ground pin.
The coordinate q is the way in the sliding joint, and the force of the cylinder acts along it, on the rod and
reversed on the barrel. With e = C - P = L d + offset n, where d is the direction of the cylinder and L = q + shift,
barrel and rod together are one side of a triangle whose length |e| is known.

r = C - Q, and ``det = r x e``; ``det/(|e| |r|)`` is the sine of the transmission angle and vanishes in a dead
position.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..core.planar import ZERO, Link, Motion, Vec2
from .body import Bar, Load
from .driver import Driver, SolvedDriver
from .group import GuideForce, Joint, PlacedLinkage, Slide, Solution, Third


@dataclass
class Cylinder(Driver):
    """A cylinder with its lever, as data.

    The frames of barrel (`bar`) and `rod` start at their pins and have the direction of the cylinder. `end` is the
    pin between rod and lever, which the lever carries. `shift` and `offset` place this pin from that of the barrel,
    along and across, at q = 0 [m]; `rod_offset` is how far the line of the force lies to the left of the rod's pin
    [m]. `side` is +1 where the pin lies to the left of the ray from the barrel's pin to that of the lever, -1 where
    to the right. `guide` is the pin at which the reaction of the sliding joint acts on the rod.
    """

    bar: Bar
    end: str
    rod: Bar
    lever: Bar
    shift: Any
    offset: Any
    rod_offset: Any
    guide: str
    side: float

    @property
    def bars(self) -> tuple[Bar, ...]:
        """Its links."""
        return self.bar, self.rod, self.lever

    @property
    def pins(self) -> dict[str, str]:
        """The pin between rod and lever."""
        return {self.end: self.lever.name}

    @property
    def joints(self) -> tuple[Joint, ...]:
        barrel, rod, lever = (bar.name for bar in self.bars)
        return (self.bar.pin, barrel), (self.guide, rod), (self.end, rod), (self.lever.pin, lever)

    @property
    def guides(self) -> Mapping[Joint, str | None]:
        return {(self.guide, self.rod.name): self.bar.name}

    @property
    def inertia(self) -> Any:
        """The mass of the rod [kg], which moves at the speed of the way at least."""
        return 0.0 if self.rod.mass is None else self.rod.mass.m

    def solve(self, xp: Any, q: Any, at: PlacedLinkage, derived: Sequence[Any]) -> SolvedCylinder:
        """The cylinder at the way `q` [m]."""
        return SolvedCylinder.at(xp, q, at.pins[self.bar.pin].p, at.pins[self.lever.pin].p, self)


class SolvedCylinder(SolvedDriver):
    """A cylinder and its lever at one way; its margin is the sine of the angle between them."""

    __slots__ = ("_data", "_e", "_per_det", "_r", "_way")

    def __init__(self, data: Cylinder, arms: tuple[Vec2, Vec2], way: Any, *common: *Solution) -> None:
        super().__init__(*common)
        self._data, (self._e, self._r), self._way = data, arms, way
        self._per_det = 1.0 / self._r.cross(self._e)

    @classmethod
    def at(cls, xp: Any, q: Any, p: Vec2, o: Vec2, data: Cylinder) -> SolvedCylinder:
        """
        Parameters
        ----------
        q : way in the sliding joint [m]
        p, o : places of the pins of barrel and lever [m]
        """
        way, h, b = q + data.shift, data.offset, data.lever.length
        square = way * way + h * h
        gap = o - p
        minus_per = -1.0 / gap.squared()
        along = 0.5 * (1.0 + (b * b - square) * minus_per)
        across = data.side * xp.sqrt(-(square * minus_per) - along * along)
        e = gap * along + gap.turned() * across
        r = e - gap
        d = (e * way - e.turned() * h) * (1.0 / square)
        n = d.turned()
        # C' = t1 turned(e) + d = T1 turned(r)
        per = 1.0 / r.cross(e)
        t1, turn1 = d.dot(r) * per, way * per
        # C'' = t2 turned(e) - t1^2 e + 2 t1 n = T2 turned(r) - T1^2 r
        rest = r * (turn1 * turn1) - e * (t1 * t1) + n * (2.0 * t1)
        t2, turn2 = rest.dot(r) * per, rest.dot(e) * per
        lever = Link(Motion(o), r * (1.0 / b), turn1, turn2)
        end = lever.carried(r)
        links = Link(Motion(p), d, t1, t2), Link(end, d, t1, t2), lever
        margin = r.cross(e) / (b * xp.sqrt(square))
        return cls(data, (e, r), way, links, (end,), margin, (Slide(d, q, 1.0, 0.0),))

    def third_derivatives(
        self, outer: Sequence[Vec2], rails: Sequence[Third] = ()
    ) -> tuple[Sequence[Third], Sequence[Vec2]]:
        barrel, _, lever = self.links
        e, r, d = self._e, self._r, barrel.u
        t1, t2, turn1, turn2 = barrel.t1, barrel.t2, lever.t1, lever.t2
        # C''' = (t3 - t1^3) turned(e) - 3 t1 t2 e + 3 t2 n - 3 t1^2 d = (T3 - T1^3) turned(r) - 3 T1 T2 r
        rest = r * (3.0 * (turn1 * turn2)) - e * (3.0 * (t1 * t2))
        rest = rest + d.turned() * (3.0 * t2) - d * (3.0 * (t1 * t1))
        t3 = rest.dot(r) * self._per_det + t1 * t1 * t1
        turn3 = rest.dot(e) * self._per_det + turn1 * turn1 * turn1
        end = lever.third_derivative(r, ZERO, turn3)
        return [(ZERO, t3), (end, t3), (ZERO, turn3)], [end]

    def _forces(self, loads: Sequence[Load]) -> tuple[Any, Any]:
        """The force of the cylinder on the rod along d, and that of the guide along n [N]."""
        (_, m0), (f1, m1), (_, m2) = loads
        d, r = self.links[0].u, self._r
        # of barrel and rod about P: -offset F + L N = m0 + m1; of the lever about Q: r x (F d + N n) = -m2 - r x f1
        both, lever = m0 + m1, -(m2 + r.cross(f1))
        per = -self._per_det
        force = (both * r.cross(d.turned()) - self._way * lever) * per
        normal = -(self._data.offset * lever + both * r.cross(d)) * per
        return force, normal

    def effort(self, loads: Sequence[Load]) -> Any:
        """See `SolvedDriver`: the force of the cylinder [N]."""
        return self._forces(loads)[0]

    def force_turn(self, effort: Any) -> Iterator[tuple[int, Vec2]]:
        """See `SolvedDriver`: the line of the force turns with the cylinder."""
        barrel = self.links[0]
        more = barrel.u.turned() * (effort * barrel.t1)
        yield 1, more
        yield 0, -more

    def reactions(self, loads: Sequence[Load]) -> tuple[Vec2, ...]:
        """Forces on the barrel at its pin, on the rod from the guide and at the pin of the lever, and on the lever at
        its pin [N]."""
        (f0, _), (f1, m1), (f2, _) = loads
        force, normal = self._forces(loads)
        d = self.links[0].u
        guide = GuideForce.along(d.turned(), normal, self._data.rod_offset * force - m1)
        push = d * force + guide
        inner = -(f1 + push)
        return push - f0, guide, inner, inner - f2
