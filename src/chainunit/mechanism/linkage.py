"""A linkage as data: ground pins, a crank, Assur groups in order, bodies and points on links, loads by name.

Pins and links have names; each group hangs on pins that are there before it. A joint is named by its pin and the link
on which its reaction acts, as several links may meet in one pin. Reactions, points to draw and the ways of forces
follow from the description.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from ..groups.driver import Crank
from ..groups.group import Group
from ..groups.loads import Joint
from ..planar import Vec2


class Connections(NamedTuple):
    """How a group hangs in its linkage: names of its links, of the pins that it adds, of the pins that its bars start
    from, and its joints: each with the link on which the opposite reaction acts, None for the ground, and again that
    link where it stands before the group."""

    links: tuple[str, ...]
    pins: tuple[str, ...]
    outer: tuple[str, ...]
    joints: tuple[tuple[Joint, str | None, str | None], ...]


class Topology(NamedTuple):
    """The names of a linkage: the link that `carries` each pin or point that is not in the ground, the crank and the
    groups with their connections, and the `points` on each link."""

    carries: dict[str, str]
    groups: tuple[Connections, ...]
    points: dict[str, tuple[str, ...]]

    @property
    def joints(self) -> tuple[Joint, ...]:
        """Pin and link of each reaction."""
        return tuple(joint for group in self.groups for joint, *_ in group.joints)

    @property
    def links(self) -> dict[str, tuple[str, ...]]:
        """The pins and points on each link, as it is drawn; those that it starts from first."""
        pins: dict[str, dict[str, None]] = {link: {} for group in self.groups for link in group.links}
        for pin, link in (*self.joints, *self.carries.items()):
            pins[link][pin] = None
        return {link: tuple(each) for link, each in pins.items()}


@dataclass
class Linkage:
    """A mechanism with one crank. Places in the frame [m], others in the frame of their link; loads as
    `chainunit.groups.loads.Acting` describes them."""

    ground: Mapping[str, Vec2]
    crank: Crank
    groups: tuple[Group, ...]
    loads: Mapping[str, Any]

    @property
    def topology(self) -> Topology:
        """Its names; they depend on no value."""
        carries: dict[str, str] = {}
        groups, points = [], {}
        for group in (self.crank, *self.groups):
            inner, bars = group.pins, group.bars
            carries |= inner
            joints = []
            for pin, link in group.joints:
                carrier = carries.get(pin)
                joints.append(((pin, link), carrier, None if pin in inner else carrier))
            for bar in bars:
                carries |= dict.fromkeys(bar.points, bar.name)
                points[bar.name] = tuple(bar.points)
            outer = tuple(bar.pin for bar in bars if bar.pin)
            groups.append(Connections(tuple(bar.name for bar in bars), tuple(inner), outer, tuple(joints)))
        return Topology(carries, tuple(groups), points)

    @property
    def derived(self) -> int:
        """How many numbers follow from the lengths once, before a run."""
        return sum(group.derived for group in self.groups)

    def before(self, group: int) -> Linkage:
        """The linkage without that group and those behind it."""
        return replace(self, groups=self.groups[:group], loads={})
