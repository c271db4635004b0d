"""Joints of a linkage file and their kinds, pins and guides: their names, their keys, and their equations."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, ClassVar, NamedTuple, Protocol

from ...core.planar import Vec2
from ...groups.body import Bar
from ...groups.group import Group
from ...groups.joints import Rail
from ...mechanism.assur import PRISMATIC, REVOLUTE, AssurGroup
from .entries import EntryReader, is_given

BELT = "belt"
CAM = "cam"
Entry = float | str
"""A number, or the text of an expression."""
JointTable = dict[str, Any]
"""A joint of a description."""


class JointEntry(NamedTuple):
    """A joint as described: `on` and `by` are a link and a point of it; of a prismatic one the point of `on` slides
    along the line from the point of `by` to its point `toward`, and `angle` is that of `on` less that of `by`.
    `third` is a further link that its equations contain; `table` has all its entries."""

    name: str
    kind: str
    on: tuple[str, str]
    by: tuple[str, str]
    toward: str
    angle: Entry
    third: str
    table: Mapping[str, Any]

    @classmethod
    def from_table(cls, table: Mapping[str, Any]) -> JointEntry:
        """The joint of a description."""
        on, by = (tuple(table[end]) for end in ("on", "by"))
        toward, angle, third = table.get("toward", ""), table.get("angle", 0.0), table.get("third", "")
        return cls(table["name"], table["type"], on, by, toward, angle, third, table)

    @property
    def links(self) -> set[str]:
        """Its two links, of which one may be the ground."""
        return {self.on[0], self.by[0]}

    def at(self, link: str) -> str:
        """Its point on one of its links."""
        return self.on[1] if self.on[0] == link else self.by[1]

    def other_link(self, link: str) -> str:
        """The link on its other side."""
        return self.by[0] if self.on[0] == link else self.on[0]


class JointParts(Protocol):
    """What a kind of joint needs of the parts of a linkage: the links with numbers, the frames of links in their
    groups, and what the start tells of groups, by link."""

    geometry: Any
    frames: Any
    sides: Any

    @property
    def ground(self) -> dict[str, Vec2]:
        """Places of the ground pins [m]."""

    @property
    def groups(self) -> Sequence[Group]:
        """The groups so far."""

    @property
    def structure(self) -> Any:
        """The linkage without numbers."""

    def slider(self, link: str, rail: JointEntry, start: str) -> tuple[Bar, Rail, str]:
        """The bar of a block that starts from its point `start` on its rail, the rail, and the pin of its force."""

    def pin(self, link: str, point: str) -> str:
        """The name of a point in the linkage."""

    def hung(self, link: str, joint: JointEntry, along: Vec2 = ...) -> Bar:
        """The bar of a link that starts from the pin of a joint, in the direction `along`, by default its x axis."""

    def receive(self, joint: JointEntry, pin: str, link: str) -> None:
        """The reaction of a joint acts in the groups at that pin on that link."""


class JointKind:
    """A kind of joint: its `name` in `type`, its `noun` in reports, the `keys` that it has besides `type`, `on` and
    `by`, of which the first one tells the kind if `type` is missing, with words on their `use`. `losses` are the
    table of the losses of all such joints, and its keys; `limits` say what is not in their reactions; `equations` is
    their number. `alone` is the kind of the group that a single link forms by such a joint and one of the kinds
    `seats`, if there is one."""

    name: ClassVar[str]
    noun: ClassVar[str]
    keys: ClassVar[tuple[str, ...]] = ()
    use: ClassVar[str] = ""
    losses: ClassVar[tuple[str, tuple[str, ...]]] = ("", ())
    limits: ClassVar[str] = ""
    equations: ClassVar[int] = 2
    alone: ClassVar[str] = ""
    seats: ClassVar[tuple[str, ...]] = (REVOLUTE,)

    def read(self, reader: EntryReader, key: str, table: Mapping[str, Any], joint: JointTable) -> None:
        """Add its own keys from its `table` to the `joint`, which has its ends."""

    def complete(self, reader: EntryReader, joint: JointTable, joints: Sequence[JointTable]) -> None:
        """Add what follows from all `joints` of the file; `points` by link are added to the links."""

    def start_faults(
        self, joint: Mapping[str, Any], points: Mapping[str, Mapping[str, tuple[float, float]]]
    ) -> Iterator[tuple[str, str]]:
        """Faults by key at the start values of the parameters, from the `points` of each link in its frame [m]."""
        return iter(())


class PinKind(JointKind):
    """A pin, about which its links turn."""

    name, noun = REVOLUTE, "pin"
    losses = ("pins", ("friction", "diameter", "damping"))


class GuideKind(JointKind):
    """A guide: a point of `on` slides along a line of `by`."""

    name, noun = PRISMATIC, "guide"
    keys = ("toward", "angle", "length")
    use = "for a cylinder or a guide give it `toward` with a further point of {by}, on the line of the way"
    losses = ("guides", ("friction", "damping"))

    def read(self, reader: EntryReader, key: str, table: Mapping[str, Any], joint: JointTable) -> None:
        """Add the line, the angle and the length of the block."""
        by, start = joint["by"]
        toward = table.get("toward")
        if isinstance(toward, str):
            toward = toward.rpartition(".")[2]
        others = [name for name in reader.points[by] if name != start]
        if toward not in others:
            reader.fault(
                f"{key}.toward",
                f"{is_given(toward)}; must be another point of {by}, to which the line goes: "
                f"{', '.join(others) or 'add one'}",
            )
        joint["toward"] = toward
        joint["angle"] = reader.entry(f"{key}.angle", table.get("angle", 0.0), "rad")
        if "length" in table:
            joint["length"] = reader.entry(f"{key}.length", table["length"], "m")

    def start_faults(
        self, joint: Mapping[str, Any], points: Mapping[str, Mapping[str, tuple[float, float]]]
    ) -> Iterator[tuple[str, str]]:
        """The fault of a line without a direction."""
        (link, start), toward = joint["by"], joint["toward"]
        if math.dist(points[link][start], points[link][toward]) == 0.0:
            key = f"joints.{joint['name']}.toward"
            yield key, f"{start} and {toward} are in one place, so that the line has no direction"


class SingleLinkKind(JointKind):
    """A kind of joint by which, and a pin or a guide, a single link forms a group of the kind `alone`."""

    def start(self, first: JointEntry, joint: JointEntry, geometry: Any) -> dict[str, float]:
        """What the start tells of the group, by names, from the `geometry` of the links with its rough places.

        Raises
        ------
        InputError
            if the group has no length that it needs.
        """
        return {}

    def group(self, parts: JointParts, link: str, first: JointEntry, joint: JointEntry) -> Group:
        """The group of the link, with the pin or the guide `first`."""
        raise NotImplementedError

    def rate(self, joint: JointEntry, link: str) -> float:
        """How often the link turns, at most, while the links before it turn once."""
        return 1.0

    def dead(self, group: AssurGroup, where: str) -> str:
        """The sentence on the group in its dead position."""
        raise NotImplementedError
