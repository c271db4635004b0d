"""A linkage without numbers: its links and joints as entries, and the groups that follow from them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from ...core.errors import InputError
from ...mechanism.assur import GROUND, PRISMATIC, REVOLUTE, AssurGroup, JointOf, decompose
from .joint_kind import Entry, JointEntry
from .joint_kinds import SINGLES, in_decomposition


@dataclass(frozen=True)
class LinkEntry:
    """A link as described: its points [m], mass [kg], inertia about the centroid [kg m2], centroid [m], and further
    masses at points [kg]."""

    name: str
    points: Mapping[str, tuple[Entry, Entry]]
    mass: Entry = 0.0
    inertia: Entry = 0.0
    centroid: tuple[Entry, Entry] = (0.0, 0.0)
    masses: Mapping[str, Entry] = field(default_factory=dict)

    @property
    def heavy(self) -> bool:
        """Whether it may have mass."""
        return bool(self.mass != 0.0 or self.inertia != 0.0 or self.masses)


@dataclass(frozen=True)
class DriverEntry:
    """The driver as described. A rotation: the link turns about its ground joint, at q = 0 its x axis has the angle
    `zero` [rad], and q counts counter-clockwise where `sense` is +1; where it `swings`, it has a range. A slide: the
    joint is prismatic, and q is the way in it."""

    joint: str
    link: str
    linear: bool
    zero: Entry = 0.0
    sense: float = 1.0
    swings: bool = False

    def angle_counts(self, zero: float) -> str:
        """How its angle counts, in words, where `zero` has this value [rad]."""
        named = {0.0: "from the x axis", 90.0: "from the upward vertical"}
        degrees = round(math.degrees(zero), 6)
        way = "counter-clockwise" if self.sense > 0.0 else "clockwise"
        return f"{named.get(degrees, f'from {degrees:g} deg to the x axis')}, {way}"


def groups_of(links: Sequence[str], joints: Sequence[JointEntry], driver: DriverEntry) -> list[AssurGroup]:
    """The groups of a linkage.

    Raises
    ------
    InputError
        where the linkage is not determined, or has a group that is not covered; its key is the name of a link.
    """
    seen = [in_decomposition(joint) for joint in joints if joint.name != driver.joint]
    slide = next(joint for joint in joints if joint.name == driver.joint)
    if GROUND in (slide.on[0], slide.by[0]):
        groups = decompose(links, seen, driver.link)
    else:
        groups = _with_cylinder(links, seen, slide)
    for group in groups:
        if (driver.linear or driver.swings) and group.kind == "triad":
            moves, remedy = (
                ("swings", "turns all the way round; leave driver.range out, or")
                if driver.swings
                else ("slides", "turns;")
            )
            raise InputError(
                f"the links {', '.join(group.links)} form a triad, and the driver {moves}: a triad needs a driver "
                f"that {remedy} drive another link",
                key=group.links[0],
            )
    return groups


@dataclass(frozen=True)
class Structure:
    """A linkage without numbers: entries by name, the groups in order, the names of pins, and the assembly.

    `marked` are the points, by link and name, that joints or loads need on this very link; `poses` are rough poses
    (x, y, angle) of all links at the driver's value `start`.
    """

    ground: Mapping[str, tuple[Entry, Entry]]
    links: Mapping[str, LinkEntry]
    joints: Mapping[str, JointEntry]
    driver: DriverEntry
    groups: tuple[AssurGroup, ...]
    pins: Mapping[tuple[str, str], str]
    marked: frozenset[tuple[str, str]]
    start: float
    poses: Mapping[str, tuple[float, float, float]]

    @property
    def rate(self) -> float:
        """How often a link turns in a turn of the driver, at most, as single links turn faster than those before
        them."""
        singles = [group for group in self.groups if group.kind in SINGLES]
        rates = (SINGLES[g.kind].rate(self.joints[g.joints[1].name], g.links[0]) for g in singles)
        return math.prod(max(1.0, rate) for rate in rates)

    @classmethod
    def of(
        cls,
        ground: Mapping[str, tuple[Entry, Entry]],
        links: Sequence[LinkEntry],
        joints: Sequence[JointEntry],
        driver: DriverEntry,
        start: float,
        poses: Mapping[str, tuple[float, float, float]],
        loaded: Iterable[tuple[str, str]],
    ) -> Structure:
        """
        Parameters
        ----------
        loaded : points on which loads act, by link and name

        Raises
        ------
        InputError
            where the linkage is not determined, or has a group that is not covered.
        """
        named = {joint.name: joint for joint in joints}
        groups = groups_of([link.name for link in links], joints, driver)
        marked = {
            end
            for group in groups
            for joint in (named[j.name] for j in group.joints)
            for end in (joint.on, joint.by)
            if joint.kind == PRISMATIC or (joint.kind == REVOLUTE and end[0] not in group.links)
        }
        if driver.linear:
            marked |= {named[driver.joint].on, named[driver.joint].by}
        return cls(
            ground,
            {link.name: link for link in links},
            named,
            driver,
            tuple(groups),
            pin_names(ground, links, joints),
            frozenset((*loaded, *marked)),
            start,
            poses,
        )


CYLINDER = "cylinder"
"""Kind of the group of a cylinder that is pinned at both ends, with the lever that it swings: barrel, rod, lever."""


def _with_cylinder(links: Sequence[str], joints: Sequence[JointOf], slide: JointEntry) -> list[AssurGroup]:
    """The groups of a linkage that a cylinder between two links drives, its own first.

    At a given way barrel and rod are one link. With its lever it has to be a dyad on the ground.

    Raises
    ------
    InputError
        where it is not.
    """
    rod, barrel = slide.on[0], slide.by[0]
    joint_by_name = {joint.name: joint for joint in joints}
    renamed = {rod: barrel}
    merged = [
        joint._replace(on=on, by=by, third=third)
        for joint in joints
        for on, by, third in [[renamed.get(link, link) for link in (joint.on, joint.by, joint.third)]]
    ]
    groups = decompose([link for link in links if link != rod], merged, "")
    dyad = next(group for group in groups if barrel in group.links)
    others = [link for link in dyad.links if link != barrel]
    if dyad.kind != "RRR":
        raise _no_cylinder(barrel, rod, slide)
    p, c, q = dyad.joints if dyad.links[0] == barrel else dyad.joints[::-1]
    near, far = (joint_by_name[p.name].on, joint_by_name[c.name].on)
    near = near if near != GROUND else joint_by_name[p.name].by
    far = far if far not in others else joint_by_name[c.name].by
    grounded = all(GROUND in (joint.on, joint.by) for joint in (p, q))
    if not grounded or {near, far} != {rod, barrel}:
        raise _no_cylinder(barrel, rod, slide)
    cylinder = AssurGroup(
        CYLINDER, (near, far, *others), (joint_by_name[p.name], joint_by_name[c.name], joint_by_name[q.name])
    )
    return [cylinder, *(group for group in groups if group is not dyad)]


def _no_cylinder(barrel: str, rod: str, slide: JointEntry) -> InputError:
    return InputError(
        f"the links {barrel} and {rod}, which the driver {slide.name} moves along each other, must be a cylinder: "
        "one of them on a pin of the ground, the other one on a pin of a lever, and the lever on a pin of the "
        "ground",
        key=barrel,
    )


def pin_names(
    ground: Mapping[str, Any], links: Sequence[LinkEntry], joints: Sequence[JointEntry]
) -> dict[tuple[str, str], str]:
    """The name of each point by link and point: the point's own where all points of that name meet in revolute
    joints, else with that of the link before it."""
    owners: dict[str, list[str]] = {}
    for link, points in ((GROUND, ground), *((entry.name, entry.points) for entry in links)):
        for point in points:
            owners.setdefault(point, []).append(link)
    joined = {frozenset((j.on, j.by)) for j in joints if j.kind == REVOLUTE}
    names = {}
    for point, those in owners.items():
        met, grows = {those[0]}, True
        while grows:
            more = {
                b
                for a in met
                for b in those
                if b not in met and frozenset(((a, point), (b, point))) in joined
            }
            met, grows = met | more, bool(more)
        for link in those:
            names[link, point] = point if len(met) == len(those) else f"{link}.{point}"
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


def structure_of(data: Mapping[str, Any]) -> Structure:
    """The structure of a description; see `Structure.of`."""
    links = [
        LinkEntry(
            link["name"],
            {name: (x, y) for name, (x, y) in link["points"].items()},
            link.get("mass", 0.0),
            link.get("inertia", 0.0),
            tuple(link.get("centroid", (0.0, 0.0))),
            link.get("masses", {}),
        )
        for link in data["links"]
    ]
    joints = [JointEntry.from_table(joint) for joint in data["joints"]]
    driver = DriverEntry(**data["driver"])
    start = data["start"]
    ends = [tuple(load[key]) for load in data["loads"] for key in ("on", "by") if key in load]
    return Structure.of(
        {name: (x, y) for name, (x, y) in data["ground"].items()},
        links,
        joints,
        driver,
        start["value"],
        {name: tuple(pose) for name, pose in start["poses"].items()},
        [end for end in ends if len(end) == 2],
    )
