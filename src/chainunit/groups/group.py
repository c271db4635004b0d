"""The common interface of all groups: an Assur group as data, and the same group solved at one position."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, NamedTuple, Protocol, Self, TypeAlias

from ..core.planar import ZERO, Link, Motion, Vec2
from .body import Bar, Load

Third = tuple[Vec2, Any]
"""Third derivatives of a link by q: of its pin and of its angle."""
Joint = tuple[str, str]
"""A joint of a linkage by the names of its pin and of the link on which its reaction acts."""


class PlacedLinkage(Protocol):
    """The linkage before a group at one position: its `pins` with points, and its `links`, by name."""

    @property
    def pins(self) -> Mapping[str, Motion]:
        """Motion of each pin and point."""

    @property
    def links(self) -> Mapping[str, Link]:
        """Links by name."""


class Rail(NamedTuple):
    """A straight line in a link, as data: the name of the link, None for the ground; a point `at` of the line [m] and
    its direction `along`, a unit vector, both in the frame of the link."""

    of: str | None
    at: Vec2
    along: Vec2

    def at_position(self, links: Mapping[str, Link]) -> Link:
        """The line at the position of its link, as a link of its own: it starts from the point."""
        if self.of is None:
            return Link(Motion(self.at), self.along, 0.0, 0.0)
        link, along = links[self.of], self.along
        u = link.u * along.x + link.u.turned() * along.y
        return Link(link.beside(self.at.x, self.at.y), u, link.t1, link.t2)


class Slide(NamedTuple):
    """The motion in a sliding joint: the direction `d` of its line, the way `s` of the link that its reaction acts on
    along it, and the derivatives of that by q [m, m/rad, m/rad2]."""

    d: Vec2
    s: Any
    s1: Any
    s2: Any


Solution: TypeAlias = tuple[tuple[Link, ...], tuple[Motion, ...], Any, tuple[Slide, ...]]
"""Links, pins, margin and slides of a `SolvedGroup`."""


class GuideForce(Vec2):
    """The reaction of a sliding joint on a link: force [N], and its whole `moment` about the start of the link's
    frame [N m]."""

    __slots__ = ("moment",)

    def __init__(self, x: Any, y: Any, moment: Any) -> None:
        super().__init__(x, y)
        self.moment = moment

    def plus(self, other: Vec2, factor: Any) -> GuideForce:
        """The sum with `other`, a reaction of the same joint, times a factor."""
        assert isinstance(other, GuideForce)
        return GuideForce(
            self.x + other.x * factor, self.y + other.y * factor, self.moment + other.moment * factor
        )

    @classmethod
    def along(cls, n: Vec2, force: Any, moment: Any) -> Self:
        """The reaction with a `force` in the direction `n`."""
        return cls(n.x * force, n.y * force, moment)


class SolvedGroup:
    """A group at one position: its `links` in the order of the group's bars, the `pins` that it adds, the `margin`,
    which is 0 in a dead position, and the `slides` in its sliding joints, in the order of the group's `guides`."""

    __slots__ = ("links", "margin", "pins", "slides")

    def __init__(
        self,
        links: tuple[Link, ...],
        pins: tuple[Motion, ...],
        margin: Any = 1.0,
        slides: tuple[Slide, ...] = (),
    ) -> None:
        self.links, self.pins, self.margin, self.slides = links, pins, margin, slides

    def third_derivatives(
        self, outer: Sequence[Vec2], rails: Sequence[Third] = ()
    ) -> tuple[Sequence[Third], Sequence[Vec2]]:
        """Third derivatives by q of each link and of each pin that the group adds, from the third derivatives of the
        pins that its bars start from and of its rails (of the start of the rail, and of its angle)."""
        raise NotImplementedError

    def reactions(self, loads: Sequence[Load]) -> Sequence[Vec2]:
        """Forces in the group's joints, in their order [N], from the load of each link; that of a sliding joint is a
        `GuideForce`."""
        raise NotImplementedError


class Group:
    """A group as data."""

    derived_count: ClassVar[int] = 0
    """The number of values that `derive` computes from the lengths, once before a run."""

    @property
    def bars(self) -> tuple[Bar, ...]:
        """Its links. A bar with a `pin` starts from this pin of the linkage before the group."""
        raise NotImplementedError

    @property
    def pins(self) -> Mapping[str, str]:
        """The pins that the group adds, each with the link on which further groups at this pin hang."""
        raise NotImplementedError

    @property
    def joints(self) -> tuple[Joint, ...]:
        """Pin and link of each reaction, in the order of `SolvedGroup.reactions`."""
        raise NotImplementedError

    @property
    def guides(self) -> Mapping[Joint, str | None]:
        """Its sliding joints, each with the link on which the opposite reaction acts, None for the ground."""
        return {}

    @property
    def rails(self) -> tuple[Rail, ...]:
        """The lines of earlier links on which its own links slide."""
        return ()

    def derive(self, xp: Any, before: Callable[[float], PlacedLinkage]) -> list[Any]:
        """Numbers that follow from its lengths; `before` gives the linkage before the group at a crank angle
        [rad]."""
        return []

    def solve(self, xp: Any, q: Any, at: PlacedLinkage, derived: Sequence[Any]) -> SolvedGroup:
        """The group at the coordinate `q` of the driver [rad, m]; `at` is the linkage before the group there."""
        raise NotImplementedError


def rail_third(rail: Rail, placed: Link, links: Mapping[str, Link], thirds: Mapping[str, Third]) -> Third:
    """The third derivatives of a rail, where it is `placed`, from the third derivatives of the links."""
    if rail.of is None:
        return ZERO, 0.0
    link, third = links[rail.of], thirds[rail.of]
    return link.third_derivative(placed.pin.p - link.pin.p, *third), third[1]
