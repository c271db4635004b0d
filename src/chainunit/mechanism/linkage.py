"""A linkage as data: ground pins, a driver, Assur groups in order, bodies and points on links, loads by name.

Pins and links have names; each group hangs on pins of the ground and of earlier groups. Several links may meet in one
pin, so that a joint has two names: its pin, and the link on which its reaction acts. The reactions, the points to
draw and the paths of the forces follow from these data.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

from ..core.brief import briefly_shown
from ..core.planar import Vec2
from ..groups.driver import Course, Driver
from ..groups.group import Group, Outline
from ..groups.joints import TURNS, Joint
from .extremes import MotionExtreme


class ConnectedJoint(NamedTuple):
    """A joint with its `carrier`, the link on which the opposite reaction acts, None for the ground. `before` is the
    carrier if an earlier group has it, else None."""

    joint: Joint
    carrier: str | None
    before: str | None


class Connections(NamedTuple):
    """How a group hangs in its linkage: the names of its `links`, the `pins` that it adds, and its `joints`, of which
    the `guides` slide and the `hinges` turn."""

    links: tuple[str, ...]
    pins: tuple[str, ...]
    joints: tuple[ConnectedJoint, ...]
    guides: tuple[Joint, ...]
    hinges: tuple[ConnectedJoint, ...]


class Topology(NamedTuple):
    """The names of a linkage: the link that `carries` each pin or point that is not in the ground, the driver and the
    groups with their connections, and the `points` on each link."""

    carries: dict[str, str]
    groups: tuple[Connections, ...]
    points: dict[str, tuple[str, ...]]

    @property
    def joints(self) -> tuple[Joint, ...]:
        """Pin and link of each reaction."""
        return tuple(connected.joint for group in self.groups for connected in group.joints)

    @property
    def links(self) -> dict[str, tuple[str, ...]]:
        """The pins and points on each link, to draw it; the pin that the link starts from stands first."""
        pins: dict[str, dict[str, None]] = {link: {} for group in self.groups for link in group.links}
        held = {*(joint for group in self.groups for joint in group.guides)}
        held |= {connected.joint for group in self.groups for connected in group.hinges}
        for pin, link in (*(joint for joint in self.joints if joint in held), *self.carries.items()):
            pins[link][pin] = None
        return {link: tuple(names) for link, names in pins.items()}


@briefly_shown
@dataclass
class Linkage:
    """A mechanism with its first driver; further ones are among the groups. Places in the frame [m], others in the
    frame of their link; loads as `chainunit.groups.loads.Acting` describes them; `extremes` of its motion that a load
    refers to."""

    ground: Mapping[str, Vec2]
    driver: Driver
    groups: tuple[Group, ...]
    loads: Mapping[str, Any]
    extremes: tuple[MotionExtreme, ...] = field(default=(), kw_only=True)

    @property
    def topology(self) -> Topology:
        """The names of the linkage; they depend on no value."""
        carries: dict[str, str] = {}
        groups, points = [], {}
        for group in (self.driver, *self.groups):
            links = tuple(bar.name for bar in group.bars)
            carries |= group.pins
            joints, hinges = [], []
            for joint in group.joints:
                carrier = joint.carrier(carries)
                before = None if carrier in links else carrier
                joints.append(ConnectedJoint((joint.pin, joint.link), carrier, before))
                if joint.form == TURNS:
                    hinges.append(joints[-1])
            for bar in group.bars:
                carries |= dict.fromkeys(bar.points, bar.name)
                points[bar.name] = tuple(bar.points)
            pins, guides = tuple(group.pins), tuple(group.guides)
            groups.append(Connections(links, pins, tuple(joints), guides, tuple(hinges)))
        return Topology(carries, tuple(groups), points)

    @property
    def circles(self) -> tuple[tuple[str, str], ...]:
        """The circles that a picture shows, see `Group.circles`."""
        return tuple(circle for group in (self.driver, *self.groups) for circle in group.circles)

    @property
    def outlines(self) -> dict[str, Outline]:
        """The closed curves that a picture shows, by name."""
        return {name: outline for group in self.groups for name, outline in group.outlines.items()}

    @property
    def derived_count(self) -> int:
        """The number of values that follow from the lengths, once before a run: of the groups, and of the
        extremes."""
        return sum(group.derived_count for group in self.groups) + len(self.extremes)

    @property
    def drivers(self) -> tuple[Driver, ...]:
        """All drivers, the first one first."""
        return self.driver, *(group for group in self.groups if isinstance(group, Driver))

    def moved(self, courses: Sequence[Course]) -> Linkage:
        """The linkage whose drivers have these courses, whatever the coordinate is."""
        present: tuple[Any, ...] = self.drivers
        drivers = (
            replace(driver, course=lambda xp, q, course=course: course)
            for driver, course in zip(present, courses, strict=True)
        )
        first = next(drivers)
        groups = tuple(next(drivers) if isinstance(group, Driver) else group for group in self.groups)
        return replace(self, driver=first, groups=groups)

    def before(self, group: int) -> Linkage:
        """The linkage without the group of this index and all later ones, without loads and extremes."""
        return replace(self, groups=self.groups[:group], loads={}, extremes=())
