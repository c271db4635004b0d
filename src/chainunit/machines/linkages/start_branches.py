"""Whether the start pose of a linkage tells in which of its two ways each dyad is assembled."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from ...core.engines import MATH
from ...core.errors import InputError
from ...mechanism.assur import AssurGroup
from ...mechanism.machine import Mechanism
from .geometry import TWO_WAYS
from .model import LinkageDescription

_AS_FAR = 0.8
"""Share of its distance from the other way that a start may be away from the way that is taken."""
_SAME = 1e-6
"""Angle [rad] by which a link has the same angle in both ways."""


def check_start(described: LinkageDescription) -> None:
    """Refuse a start that lies nearly as far from one way of assembling a dyad as from the other, measured by the
    angles of its links.

    Raises
    ------
    InputError
        in one line, with both places of the pin, or both angles of the link, that the start may give.
    """
    structure = described.structure
    here = described.followed.at(structure.start)
    for group in structure.groups:
        if group.kind in TWO_WAYS:
            _check(described, group, [here, _other_way(described, group)])


def _other_way(described: LinkageDescription, group: AssurGroup) -> Mechanism:
    """The linkage at its start, up to a dyad, or a cylinder, that is assembled in the other way."""
    structure, linkage = described.structure, described.at_start
    # a cylinder that is the first driver is no group of the linkage
    count = structure.groups.index(group) + 1 - (len(structure.groups) - len(linkage.groups))
    part = linkage.before(count)
    if count == 0:
        part = replace(part, driver=_turned(part.driver))
    else:
        part = replace(part, groups=(*part.groups[:-1], _turned(part.groups[-1])))
    return Mechanism(MATH, part, structure.start, described.start_derived)


def _turned(dyad: Any) -> Any:
    """A dyad, or a cylinder, that is assembled in the other way."""
    return replace(dyad, side=-dyad.side)


def _check(described: LinkageDescription, group: AssurGroup, assembled: Sequence[Mechanism]) -> None:
    """Refuse a start that does not tell in which of both ways a dyad is assembled."""
    structure, linkage = described.structure, described.at_start
    joint = structure.joints[group.joints[1].name]
    angles = [[linkage.angle(link, m) for link in group.links] for m in assembled]
    pins = [m.pins.get(linkage.parts.pin(*joint.by)) for m in assembled]
    rough = [structure.poses[link][2] for link in group.links]
    near, far = (
        sum(
            abs(math.remainder(angle - start, 2.0 * math.pi))
            for angle, other, start in zip(pose, angles[k - 1], rough, strict=True)
            if abs(math.remainder(angle - other, 2.0 * math.pi)) > _SAME
        )
        for k, pose in enumerate(angles)
    )
    if near <= _AS_FAR * far:
        return
    number = group.links.index(joint.by[0]) if joint.by[0] in group.links else 0
    key = f"start.angles.{group.links[number]}"
    ways = [f'"{math.degrees(pose[number]):.4g} deg"' for pose in angles]
    if group.kind != "RPR" and None not in pins:
        key = f"start.points.{joint.by[1]}"
        ways = [f'["{1e3 * pin.p.x:.4g} mm", "{1e3 * pin.p.y:.4g} mm"]' for pin in pins if pin is not None]
    raise InputError(
        f"the start does not tell in which of two ways {' and '.join(group.links)} are assembled, as it lies nearly "
        f"as far from the one as from the other; give a value near to one of both: {' or '.join(ways)}",
        key,
    )
