"""The drivers, which move in a given way: a crank on a fixed bearing, and a ram on a fixed rail.

Each has the coordinate q of the linkage. In the packaged machines q is the crank angle, which counts from the upward
vertical, positive clockwise, so that the derivative of the crank's counter-clockwise angle by q is -1.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from ..core.planar import ZERO, Link, Motion, Vec2
from .body import Bar, Load, Mass
from .group import Group, GuideForce, PlacedLinkage, Rail, Slide, SolvedGroup, Third

UPWARD = Vec2(0.0, 1.0)


class Driver(Group):
    """The link that is driven, as data: its bar, and the pin that shows its motion."""

    bar: Bar
    end: str

    @property
    def bars(self) -> tuple[Bar, ...]:
        """Its link."""
        return (self.bar,)

    @property
    def inertia(self) -> Any:
        """The least inertia that it reflects by itself: of a crank about its bearing [kg m2], of a ram its mass
        [kg]."""
        raise NotImplementedError


@dataclass
class Crank(Driver):
    """A crank as data: its bar, which starts from a ground pin; the pin at the bar's `end`, or one of its points if
    the bar has no length; the direction of the bar at q = 0, a unit vector; and `sense`: +1 where q counts
    counter-clockwise, -1 where clockwise."""

    bar: Bar
    end: str
    start: Vec2 = UPWARD
    sense: float = -1.0

    @property
    def pins(self) -> dict[str, str]:
        """The pin at its end."""
        return {self.end: self.bar.name} if self._ends else {}

    @property
    def _ends(self) -> bool:
        return self.bar.length is not None

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

    def solve(self, xp: Any, q: Any, at: PlacedLinkage, derived: Sequence[Any]) -> SolvedDriver:
        """The crank at the angle `q` [rad]."""
        link = crank(xp, at.pins[self.bar.pin].p, q, self.start, self.sense)
        return TurnedCrank((link,), (link.at(self.bar.length),) if self._ends else ())


@dataclass
class Ram(Driver):
    """A ram as data, such as the rod of a hydraulic cylinder: its bar, without a pin, moves along a `rail` of the
    ground. Its frame starts at the point of the rail that q [m] counts from and has the direction of the rail.
    `guide` is the pin at which the reaction of the rail acts on it."""

    bar: Bar
    rail: Rail
    guide: str
    end: str = ""

    @property
    def pins(self) -> dict[str, str]:
        """None: what hangs on it hangs on its points."""
        return {}

    @property
    def joints(self) -> tuple[tuple[str, str], ...]:
        """Its rail."""
        return ((self.guide, self.bar.name),)

    @property
    def guides(self) -> dict[tuple[str, str], str | None]:
        """Its rail."""
        return {(self.guide, self.bar.name): None}

    @property
    def inertia(self) -> Any:
        """Its mass [kg]."""
        return 0.0 if self.bar.mass is None else self.bar.mass.m

    def solve(self, xp: Any, q: Any, at: PlacedLinkage, derived: Sequence[Any]) -> SolvedDriver:
        """The ram at the way `q` [m]."""
        rail = self.rail.at_position(at.links)
        start = Motion(rail.pin.p + rail.u * q, rail.u)
        return PushedRam((Link(start, rail.u, 0.0, 0.0),), (), 1.0, (Slide(rail.u, q, 1.0, 0.0),))


class SolvedDriver(SolvedGroup):
    """A driver at one place: its link, and the pin at its end."""

    __slots__ = ()

    def third_derivatives(
        self, outer: Sequence[Vec2], rails: Sequence[Third] = ()
    ) -> tuple[Sequence[Third], Sequence[Vec2]]:
        (link,) = self.links
        return [(ZERO, 0.0)], [link.third_derivative(end.p - link.pin.p, ZERO, 0.0) for end in self.pins]

    def effort(self, loads: Sequence[Load]) -> Any:
        """The torque, or of a ram the force, along the coordinate that holds against the loads of the links [N m,
        N]."""
        raise NotImplementedError

    def force_turn(self, effort: Any) -> Iterator[tuple[int, Vec2]]:
        """The derivative of the driver's own forces on its links, by their places, as their lines turn with q."""
        return iter(())


class TurnedCrank(SolvedDriver):
    """The crank at one angle."""

    __slots__ = ()

    def effort(self, loads: Sequence[Load]) -> Any:
        """The torque [N m], or of a ram the force [N], that holds against the loads of the links."""
        return loads[0][1] * -self.links[0].t1

    def reactions(self, loads: Sequence[Load]) -> tuple[Vec2, ...]:
        """The force on the crank at its bearing [N]."""
        return (-loads[0][0],)


class PushedRam(SolvedDriver):
    """The ram at one place."""

    __slots__ = ()

    def effort(self, loads: Sequence[Load]) -> Any:
        """The torque [N m], or of a ram the force [N], that holds against the loads of the links."""
        return -loads[0][0].dot(self.links[0].u)

    def reactions(self, loads: Sequence[Load]) -> tuple[Vec2, ...]:
        """The force and the moment of the rail on the ram."""
        ((force, moment),) = loads
        n = self.links[0].u.turned()
        return (GuideForce.along(n, -force.dot(n), -moment),)


def crank(xp: Any, bearing: Vec2, angle: Any, start: Vec2 = UPWARD, sense: float = -1.0) -> Link:
    """The crank as a link from its bearing at `angle` [rad], see `Crank`."""
    c, s = xp.cos(angle), xp.sin(angle) * sense
    return Link(Motion(bearing), Vec2(start.x * c - start.y * s, start.y * c + start.x * s), sense, 0.0)
