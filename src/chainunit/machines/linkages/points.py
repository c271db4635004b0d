"""Points of links by name: which links have a point of one name, and which points meet."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from typing import TypeVar

Node = TypeVar("Node")
LinkPoint = tuple[str, str]
"""A point by its link and its name."""


def owners_of(points: Mapping[str, Iterable[str]]) -> dict[str, list[str]]:
    """The links that have a point of each name; `points` are the names of the points of each link, the ground too."""
    owners: dict[str, list[str]] = {}
    for link, names in points.items():
        for point in names:
            owners.setdefault(point, []).append(link)
    return owners


def connected(start: Node, sets: Sequence[AbstractSet[Node]]) -> set[Node]:
    """All that the `sets` connect with the `start`, and itself."""
    met, grown = set[Node](), {start}
    while met != grown:
        met = grown
        grown = met.union(*(nodes for nodes in sets if nodes & met))
    return met
