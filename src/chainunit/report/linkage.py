"""What a linkage gives to its picture: links through pins, places, and reactions as arrows."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from ..mechanism.linkage import Linkage
from ..mechanism.machine import Mechanism
from .motion import Arrow, DrawnLink


def links(linkage: Linkage, looks: Mapping[str, str]) -> Iterator[DrawnLink]:
    """The links as they are drawn, the crank first; a link with more than two pins is an area. `looks` are those of
    links that are not to look like a rod."""
    for name, pins in linkage.topology.links.items():
        usual = "crank" if name == linkage.crank.bar.name else "rod"
        yield DrawnLink(name, pins, looks.get(name, usual), closed=len(pins) > 2)


def places(mechanism: Mechanism) -> dict[str, tuple[Any, Any]]:
    """Where its pins and points are [m]."""
    return {name: (pin.p.x, pin.p.y) for name, pin in mechanism.pins.items()}


def arrows(
    titles: Mapping[str, str],
    joints: Mapping[str, str],
    force: Callable[[str], tuple[Any, Any]],
    groups: Mapping[str, str] | None = None,
) -> Iterator[Arrow]:
    """The reactions of outputs by their titles, each at its joint, if it has one, in its group; `force` gives their
    components [N]."""
    for title, output in titles.items():
        if output in joints:
            yield Arrow(title, joints[output], *force(output), group=(groups or {}).get(output, ""))
