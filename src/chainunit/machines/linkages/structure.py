"""A linkage without numbers: its links and joints as entries, and the groups that follow from them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from ...core.errors import InputError
from ...mechanism.assur import DRIVES, GROUND, ON_LEGS, PRISMATIC, REVOLUTE, AssurGroup, decompose
from .joint_kind import BELT, CAM, Entry, JointEntry
from .joint_kinds import KINDS, SINGLES, in_decomposition
from .names import LinkPoint, connected, owners_of

FOLLOWED = (*ON_LEGS, KINDS[CAM].alone)
"""Kinds of groups that are followed over a turn of the driver."""


@dataclass(frozen=True)
class LinkEntry:
    """A link as described: its points [m], mass [kg], inertia about the centroid [kg m2], centroid [m], further
    masses at points [kg], and the stiffness [N/m] by which it shares a force, 0 if it has none."""

    name: str
    points: Mapping[str, Sequence[Entry]]
    mass: Entry = 0.0
    inertia: Entry = 0.0
    centroid: Sequence[Entry] = field(default_factory=lambda: [0.0, 0.0])
    masses: Mapping[str, Entry] = field(default_factory=dict)
    stiffness: Entry = 0.0

    @property
    def heavy(self) -> bool:
        """Whether it may have mass."""
        return bool(self.mass != 0.0 or self.inertia != 0.0 or self.masses)


@dataclass(frozen=True)
class DriverEntry:
    """A driver as described. A rotation: the link turns about its ground joint, at the place 0 its x axis has the
    angle `zero` [rad], and the place counts counter-clockwise if `sense` is +1; if it `swings`, it has a range. Of a
    joint of two moving links that is the angle of the `link`, the one `on`, less that of the other one. A slide: the
    joint is prismatic, and the place is the way in it.

    A driver besides the first one has a `name`. Its place follows the place of the first one by a `law`, an
    expression of ``phi``, and it is `geared` if the first one drives it; without a law it is an input, which goes
    through its `span`. `start` is its place at the start, and `rate` how often it turns at most while the first one
    turns once."""

    joint: str
    link: str
    linear: bool
    zero: Entry = 0.0
    sense: float = 1.0
    swings: bool = False
    name: str = ""
    law: Entry | None = None
    geared: bool = True
    span: Sequence[float] = (0.0, 0.0)
    start: float = 0.0
    rate: float = 1.0

    @property
    def is_free(self) -> bool:
        """Whether it is an input of its own beside the first driver."""
        return bool(self.name) and self.law is None


def groups_of(
    links: Sequence[str], joints: Sequence[JointEntry], drivers: Sequence[DriverEntry]
) -> list[AssurGroup]:
    """The groups of a linkage with these drivers: cylinders and further drivers are among them.

    Raises
    ------
    InputError
        if the linkage is not determined, or has a group that is not covered; its key is the name of a link.
    """
    groups = decompose(
        links, [in_decomposition(joint) for joint in joints], {entry.joint: entry.link for entry in drivers}
    )
    followed = next((group for group in groups if group.kind in FOLLOWED), None)
    if followed is not None and any(entry.is_free for entry in drivers):
        kind, many, link = f"a {followed.kind}", len(followed.links) > 1, followed.links[0]
        who = f"the link{'s' * many} {', '.join(followed.links)} form{'s' * (not many)} {kind}"
        law = 'give the other one a law, phi = "..."'
        raise InputError(f"{who}, and two drivers are inputs: {kind} needs one; {law}", key=link)
    return groups


@dataclass(frozen=True)
class Structure:
    """A linkage without numbers: entries by name, the groups in order, the names of pins, and the assembly.

    `driver` is the first one, and `further` are the others. `marked` are the points, by link and name, that joints or
    loads need on this very link; `poses` are rough poses (x, y, angle) of all links at the driver's value `start`;
    `span` is its range, if it has one."""

    ground: Mapping[str, Sequence[Entry]]
    links: Mapping[str, LinkEntry]
    joints: Mapping[str, JointEntry]
    driver: DriverEntry
    further: tuple[DriverEntry, ...]
    groups: tuple[AssurGroup, ...]
    pins: Mapping[LinkPoint, str]
    marked: frozenset[LinkPoint]
    start: float
    poses: Mapping[str, tuple[float, float, float]]
    span: Sequence[float]

    @property
    def drivers(self) -> tuple[DriverEntry, ...]:
        """All drivers."""
        return self.driver, *self.further

    @property
    def belts(self) -> Mapping[str, JointEntry]:
        """The belts by name."""
        return {name: joint for name, joint in self.joints.items() if joint.kind == BELT}

    @property
    def rate(self) -> float:
        """How often a link turns in a turn of the driver, at most, as single links turn faster than those before
        them."""
        singles = [group for group in self.groups if group.kind in SINGLES]
        rates = (SINGLES[g.kind].rate(self.joints[g.joints[1].name], g.links[0]) for g in singles)
        laws = max((driver.rate for driver in self.further), default=1.0)
        return math.prod((max(1.0, rate) for rate in rates), start=laws)

    @classmethod
    def of(cls, data: Mapping[str, Any]) -> Structure:
        """The structure of a description.

        Raises
        ------
        InputError
            if the linkage is not determined, or has a group that is not covered.
        """
        links = {
            link["name"]: LinkEntry(**{key: entry for key, entry in link.items() if key != "own"})
            for link in data["links"]
        }
        joints = {joint["name"]: JointEntry.from_table(joint) for joint in data["joints"]}
        driver, ground, start = DriverEntry(**data["driver"]), data["ground"], data["start"]
        others = [DriverEntry(**entry) for entry in data.get("drivers", ())]
        groups = groups_of([*links], [*joints.values()], [driver, *others])
        driven = [group.joints[-1].name for group in groups if group.kind in DRIVES]
        # in the order of their groups
        further = sorted(others, key=lambda entry: driven.index(entry.joint))
        # points by link that stay apart from others in the same pin: of loads, and of joints between groups
        loaded = (load[key] for load in data["loads"] for key in ("on", "by") if key in load)
        marked = {tuple(end) for end in loaded if len(end) == 2}
        for group in groups:
            for joint in (joints[inner.name] for inner in group.joints):
                outside = {end for end in (joint.on, joint.by) if end[0] not in group.links}
                marked |= {PRISMATIC: {joint.on, joint.by}, REVOLUTE: outside}.get(joint.kind, set())
        for entry in (driver, *further):
            if entry.linear:
                marked |= {joints[entry.joint].on, joints[entry.joint].by}
        pins = pin_names(ground, links, joints.values())
        poses = {name: tuple(pose) for name, pose in start["poses"].items()}
        return cls(
            ground,
            links,
            joints,
            driver,
            tuple(further),
            tuple(groups),
            pins,
            frozenset(marked),
            start["value"],
            poses,
            data.get("range") or (),
        )


def pin_names(
    ground: Iterable[str], links: Mapping[str, LinkEntry], joints: Iterable[JointEntry]
) -> dict[LinkPoint, str]:
    """The name of each point by link and point: its name in the link if all points of that name meet in revolute
    joints, else with that of the link before it."""
    pins = [{j.on, j.by} for j in joints if j.kind == REVOLUTE and j.on[1] == j.by[1]]
    names = {}
    for point, owners in owners_of({GROUND: ground, **{n: link.points for n, link in links.items()}}).items():
        all_meet = len(connected((owners[0], point), pins)) == len(owners)
        for link in owners:
            names[link, point] = point if all_meet else f"{link}.{point}"
    return names


def check_groups(structure: Structure, listed: Sequence[Any]) -> None:
    """Refuse groups that a file lists, each as kind and links, and that the linkage does not have.

    Raises
    ------
    InputError
        in one line, with the groups that it has.
    """
    kinds = {frozenset(group.links): group.kind for group in structure.groups}
    there = ", ".join(f"{group.kind} ({', '.join(group.links)})" for group in structure.groups)
    for k, (kind, links) in enumerate(listed, 1):
        actual, names = kinds.get(frozenset(links)), ", ".join(links)
        if actual is None:
            raise InputError(f"{names} is no group; the groups are {there}", f"groups.{k}.links")
        if kind not in ("", actual):
            raise InputError(f"the links {names} form the group {actual}, not {kind}", f"groups.{k}.kind")
