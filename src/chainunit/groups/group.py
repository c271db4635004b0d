"""The common interface of all groups: an Assur group as data, and the same group solved at one position."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar

from ..planar import Link, Motion, Vec2
from .body import Bar, Load

Third = tuple[Vec2, Any]
"""Third derivatives of a link by q: of its pin and of its angle."""


class SolvedGroup:
    """A group at one position: its `links` in the order of the group's bars, the `pins` that it adds, and the
    `margin`, which is 0 in a dead position."""

    __slots__ = ("links", "margin", "pins")

    def __init__(self, links: tuple[Link, ...], pins: tuple[Motion, ...], margin: Any = 1.0) -> None:
        self.links, self.pins, self.margin = links, pins, margin

    def third(self, outer: Sequence[Vec2]) -> tuple[Sequence[Third], Sequence[Vec2]]:
        """Third derivatives by q of each link and of each pin that the group adds, from the third derivatives of the
        pins that its bars start from."""
        raise NotImplementedError

    def reactions(self, loads: Sequence[Load]) -> Sequence[Vec2]:
        """Forces in the group's joints, in their order [N], from the load of each link."""
        raise NotImplementedError


class Group:
    """A group as data."""

    derived: ClassVar[int] = 0
    """The number of values that `derive` computes from the lengths, once before a run."""

    @property
    def bars(self) -> tuple[Bar, ...]:
        """Its links. A bar with a `pin` starts from this pin of the linkage before the group."""
        raise NotImplementedError

    @property
    def pins(self) -> dict[str, str]:
        """The pins that the group adds, each with the link on which further groups at this pin hang."""
        raise NotImplementedError

    @property
    def joints(self) -> tuple[tuple[str, str], ...]:
        """Pin and link of each reaction, in the order of `SolvedGroup.reactions`."""
        raise NotImplementedError

    def derive(self, xp: Any, pins: Callable[[float], Mapping[str, Motion]]) -> list[Any]:
        """Numbers that follow from its lengths; `pins` gives the pins before the group at a crank angle [rad]."""
        return []

    def solve(self, xp: Any, q: Any, pins: Mapping[str, Motion], derived: Sequence[Any]) -> SolvedGroup:
        """The group at the crank angle `q` [rad] and the position of the `pins`."""
        raise NotImplementedError
