"""A linkage as data: ground pins, a crank, Assur groups in order, bodies and points on links, loads by name.

Pins and links have names; each group hangs on pins that are there before it. A joint is named by its pin and the link
on which its reaction acts, as several links may meet in one pin. Reactions, points to draw and the ways of forces
follow from the description.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from ..groups.body import Bar
from ..groups.driver import Crank
from ..groups.group import Group
from ..groups.loads import Joint
from ..planar import Vec2


@dataclass(frozen=True)
class Linkage:
    """A mechanism with one crank. Places in the frame [m], others in the frame of their link."""

    ground: Mapping[str, Vec2]
    crank: Crank
    groups: tuple[Group, ...]
    loads: Mapping[str, Any]
    """See `chainunit.groups.loads.Acting`."""

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
