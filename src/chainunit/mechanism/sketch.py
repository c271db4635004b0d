"""The pins and links of a mechanism that a picture shows, and the sketch of a machine."""

from __future__ import annotations

from typing import Any

from ..core.model import Sketch
from ..core.planar import Vec2
from .linkage import Linkage
from .machine import Mechanism


def shown_pins(linkage: Linkage) -> set[str]:
    """The pins and points that are drawn, without points of the ground that only say where a rail lies, and without
    further points of a link that meet a pin."""
    topology = linkage.topology
    joined = {pin for pin, _ in topology.joints}
    return {pin for pin in (*joined, *topology.carries) if "." not in pin or pin in joined}


def supports(linkage: Linkage) -> tuple[str, ...]:
    """The drawn pins of the ground on which links stand."""
    held = shown_pins(linkage) & {pin for pins in linkage.topology.links.values() for pin in pins}
    return tuple(pin for pin in linkage.ground if pin in held)


def places(mechanism: Mechanism) -> dict[str, tuple[Any, Any]]:
    """The places x, y of the pins and points of a mechanism that are drawn [m]."""
    shown = shown_pins(mechanism.linkage)
    return {name: (pin.p.x, pin.p.y) for name, pin in mechanism.pins.items() if name in shown}


def directions(mechanism: Mechanism) -> dict[str, Vec2]:
    """The directions of the line of each sliding block, by its pin, and of each outline, by its name."""
    lines = {pin: slide.d for (pin, _), slide in mechanism.slides.items() if slide.s is not None}
    outlines = mechanism.linkage.outlines
    return lines | {name: outlines[name].frame.at_position(mechanism.links).u for name in outlines}


def sketch_of(mechanism: Mechanism) -> Sketch:
    """The sketch of a machine, from its mechanism at one place of the driver."""
    linkage, positions = mechanism.linkage, places(mechanism)
    links = {
        name: [pin for pin in carried if pin in positions] for name, carried in linkage.topology.links.items()
    }
    return Sketch(
        {name: (float(x), float(y)) for name, (x, y) in positions.items()},
        links,
        linkage.driver.bar.name,
        frozenset(supports(linkage)),
    )
