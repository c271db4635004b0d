"""Pins by name: points of one name in several links are a revolute joint that the file need not name."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from ...mechanism.assur import GROUND, REVOLUTE, in_order_of_motion
from .joint_kind import JointEntry
from .joint_kinds import in_decomposition
from .names import owners_of


def shared_pins(
    points: Mapping[str, Iterable[str]],
    named: Sequence[Mapping[str, Any]],
    drivers: Sequence[Mapping[str, Any]],
) -> tuple[list[dict[str, Any]], list[tuple[str, str]]]:
    """A revolute joint for each further link in a point of the same name, if none is named; and clashes: names that a
    joint has already, each with what is wrong.

    Parameters
    ----------
    points : by link, the ground too
    named : the joints that the file names
    drivers : the tables of the drivers
    """
    owners = owners_of(points)
    joined = {frozenset((tuple(j["on"]), tuple(j["by"]))) for j in named if j["type"] == REVOLUTE}
    apart = {point for pair in joined for _, point in pair if len({name for _, name in pair}) == 1}
    ordered = in_order_of_motion(
        {point: links for point, links in owners.items() if len(links) > 1 and point not in apart},
        [link for link in points if link != GROUND],
        [
            in_decomposition(JointEntry.from_table(j))
            for j in named
            if all(j["name"] != driver.get("joint") for driver in drivers)
        ],
        [str(driver.get("link")) for driver in drivers],
    )
    # of three or more links, the one on which the others hang stands first
    owners |= {point: links for point, links in ordered.items() if len(links) > 2}
    taken = {joint["name"] for joint in named}
    joints: list[dict[str, Any]] = []
    clashes = []
    for point, (first, *others) in owners.items():
        for link in others:
            if any(frozenset(((a, point), (link, point))) in joined for a in (first, *others) if a != link):
                continue
            name = point if len(others) == 1 else f"{point}_{link}"
            if name in taken:
                meeting = ", ".join((first, *others))
                message = f"does not join the points {point} of {meeting}; rename the point or the joint"
                clashes.append((name, message))
                continue
            joints.append({"name": name, "type": REVOLUTE, "on": [link, point], "by": [first, point]})
    return joints, clashes
