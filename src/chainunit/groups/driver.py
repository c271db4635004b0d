"""The driver: a crank on a fixed bearing.

The crank angle counts from the upward vertical, positive clockwise. It is the coordinate q itself, so that the
derivative of the crank's counter-clockwise angle by q is -1.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..planar import ZERO, Link, Motion, Vec2
from .body import Bar, Load, Mass
from .group import Group, SolvedGroup, Third


@dataclass
class Crank(Group):
    """A crank as data: its bar, which starts from a ground pin, and the name of the pin at the bar's end."""

    bar: Bar
    end: str

    @property
    def bars(self) -> tuple[Bar, ...]:
        """Its link."""
        return (self.bar,)

    @property
    def pins(self) -> dict[str, str]:
        """The pin at its end."""
        return {self.end: self.bar.name}

    @property
    def joints(self) -> tuple[tuple[str, str], ...]:
        """Its bearing."""
        return ((self.bar.pin, self.bar.name),)

    @property
    def inertia(self) -> Any:
        """Inertia of the crank alone about its bearing [kg m2]."""
        mass = self.bar.mass
        if mass is None:
            return 0.0
        beside = mass.t if isinstance(mass, Mass) else None
        arm2 = mass.s * mass.s if beside is None else mass.s * mass.s + beside * beside
        return mass.I + mass.m * arm2

    def solve(self, xp: Any, q: Any, pins: Mapping[str, Motion], derived: Sequence[Any]) -> TurnedCrank:
        """The crank at the angle `q` [rad]."""
        link = crank(xp, pins[self.bar.pin].p, q)
        return TurnedCrank((link,), (link.at(self.bar.length),))


class TurnedCrank(SolvedGroup):
    """The crank at one angle: its link, and the pin at its end."""

    __slots__ = ()

    def third(self, outer: Sequence[Vec2]) -> tuple[Sequence[Third], Sequence[Vec2]]:
        """See `SolvedGroup`."""
        (link,), (end,) = self.links, self.pins
        return [(ZERO, 0.0)], [link.third(end.p - link.pin.p, ZERO, 0.0)]

    def reactions(self, loads: Sequence[Load]) -> tuple[Vec2, ...]:
        """The force on the crank at its bearing [N]."""
        return (-loads[0][0],)


def crank(xp: Any, bearing: Vec2, angle: Any) -> Link:
    """The crank as a link from its bearing at `angle` [rad]."""
    return Link(Motion(bearing), Vec2(xp.sin(angle), xp.cos(angle)), -1.0, 0.0)
