"""A linkage as data: ground pins, a crank, Assur groups in order, bodies and points on links, loads by name.

Pins and links have names; each group hangs on pins that are there before it. A joint is named by its pin and the link
on which its reaction acts, as several links may meet in one pin. Reactions, points to draw and the ways of forces
follow from the description.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

from ..groups.body import Bar, Load
from ..groups.driver import Crank
from ..groups.loads import Acting, Joint
from ..planar import Link, Motion, Vec2


class Solved(Protocol):
    """A group at one position."""

    @property
    def links(self) -> Sequence[Link]:
        """Its links, in the order of the group's bars."""

    @property
    def pins(self) -> Sequence[Motion]:
        """The pins that it adds."""

    def lifted(self, outer: tuple[Motion, ...]) -> Solved:
        """The same with its derivatives by q as dual parts; the outer pins have them."""

    def reactions(self, loads: tuple[Load, ...]) -> Sequence[Vec2]:
        """Forces in the group's joints, in their order [N], from what acts on each link."""


class Group(Protocol):
    """A group as data."""

    @property
    def bars(self) -> tuple[Bar, ...]:
        """Its links; each with a pin that is there before hangs on it."""

    @property
    def pins(self) -> Mapping[str, str]:
        """Pins that it adds, each with the link that carries what else hangs on it."""

    @property
    def joints(self) -> tuple[Joint, ...]:
        """Pin and link of each reaction."""

    @property
    def derived(self) -> int:
        """How many numbers follow from its lengths once, before a run (`derive`)."""

    def derive(self, xp: Any, pins: Callable[[float], Mapping[str, Motion]]) -> list[Any]:
        """Those numbers; `pins` gives the pins before it at a crank angle [rad]."""

    def solve(self, xp: Any, q: Any, pins: Mapping[str, Motion], derived: Any) -> Solved:
        """The group where the `pins` are."""


@dataclass(frozen=True)
class Linkage:
    """A mechanism with one crank. Places in the frame [m], others in the frame of their link."""

    ground: Mapping[str, Vec2]
    crank: Crank
    groups: tuple[Group, ...]
    loads: Mapping[str, Acting]

    @property
    def bars(self) -> Iterator[Bar]:
        """All links, the crank first."""
        yield from self.crank.bars
        for group in self.groups:
            yield from group.bars

    @property
    def pins(self) -> dict[str, str]:
        """The link that carries each pin or point that is not in the ground."""
        carriers = dict(self.crank.pins)
        for group in self.groups:
            carriers |= group.pins
        return carriers | {point: bar.name for bar in self.bars for point in bar.points}

    @property
    def links(self) -> dict[str, tuple[str, ...]]:
        """The pins on each link, the one that it starts from first, as it is drawn."""
        pins = {bar.name: [bar.pin] if bar.pin else [] for bar in self.bars}
        for pin, link in self.joints:
            pins[link].append(pin)
        for pin, link in self.pins.items():
            pins[link].append(pin)
        return {link: tuple(dict.fromkeys(each)) for link, each in pins.items()}

    @property
    def joints(self) -> tuple[Joint, ...]:
        """Pin and link of each reaction."""
        return (*self.crank.joints, *(joint for group in self.groups for joint in group.joints))

    @property
    def derived(self) -> int:
        """How many numbers follow from the lengths once, before a run."""
        return sum(group.derived for group in self.groups)

    def before(self, group: int) -> Linkage:
        """The linkage without that group and those behind it."""
        return replace(self, groups=self.groups[:group], loads={})
