"""Pins by name: points of one name in several links are a revolute joint that the file need not name."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from ...mechanism.assur import GROUND, REVOLUTE, in_order_of_motion
from .joint_kind import JointEntry
from .joint_kinds import in_decomposition


def shared_pins(
    points: Mapping[str, Iterable[str]], named: Sequence[Mapping[str, Any]], driver: Mapping[str, Any]
) -> tuple[list[dict[str, Any]], list[tuple[str, str]]]:
    """A revolute joint for each further link in a point of the same name, where none is named; and clashes: names
    that a joint has already, each with what is wrong.

    Parameters
    ----------
    points : by link, the ground too
    named : the joints that the file names
    driver : the table of the driver
    """
    owners: dict[str, list[str]] = {}
    for link, names in points.items():
        for point in names:
            owners.setdefault(point, []).append(link)
    joined = {frozenset((tuple(j["on"]), tuple(j["by"]))) for j in named if j["type"] == REVOLUTE}
    taken = {joint["name"] for joint in named}
    joints: list[dict[str, Any]] = []
    clashes = []
    for point, those in _ordered(points, owners, joined, named, driver).items():
        for link in those[1:]:
            if any(frozenset(((a, point), (link, point))) in joined for a in those if a != link):
                continue
            name = point if len(those) == 2 else f"{point}_{link}"
            if name in taken:
                message = (
                    f"does not join the points {point} of {', '.join(those)}; rename the point or the joint"
                )
                clashes.append((name, message))
                continue
            joints.append({"name": name, "type": REVOLUTE, "on": [link, point], "by": [those[0], point]})
    return joints, clashes


def _ordered(
    points: Mapping[str, Iterable[str]],
    owners: Mapping[str, list[str]],
    joined: set[frozenset[tuple[str, ...]]],
    named: Sequence[Mapping[str, Any]],
    driver: Mapping[str, Any],
) -> dict[str, list[str]]:
    """The links of each point; of three or more that one first on which the others hang."""
    apart = {point for pair in joined for _, point in pair if len({name for _, name in pair}) == 1}
    shared = {point: those for point, those in owners.items() if len(those) > 1 and point not in apart}
    seen = [
        in_decomposition(JointEntry.from_table(joint))
        for joint in named
        if joint["name"] != driver.get("joint")
    ]
    links = [link for link in points if link != GROUND]
    ordered = in_order_of_motion(shared, links, seen, str(driver.get("link")))
    return {
        point: ordered[point] if len(those) > 2 and point in ordered else those
        for point, those in owners.items()
    }
