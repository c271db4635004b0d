"""The parts of the picture of a linkage: links through pins, paths, supports, guides with their blocks."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ..core.planar import rotated
from ..mechanism.linkage import Linkage
from ..mechanism.machine import Mechanism
from ..mechanism.sketch import directions
from ..mechanism.sketch import places as places
from ..mechanism.sketch import shown_pins as shown_pins
from ..mechanism.sketch import supports as supports
from .motion import DrawnLink


def links(linkage: Linkage) -> Iterator[DrawnLink]:
    """The links as they are drawn, the crank first. Links with a pin in the ground are heavier than the others; a
    link with more than two pins is an area."""
    shown = shown_pins(linkage)
    for name, carried in linkage.topology.links.items():
        # a contact has its pin at a point of its follower
        pins = tuple(pin for pin in carried if pin in shown and pin.partition(".")[0] not in linkage.outlines)
        crank, grounded = name == linkage.driver.bar.name, any(pin in linkage.ground for pin in pins)
        look = "crank" if crank else "heavy" if grounded else "light"
        yield DrawnLink(name, pins, look, closed=len(pins) > 2)


def rails(turn: Mechanism) -> dict[str, tuple[tuple[float, float], tuple[float, float]]]:
    """The ends of a rail for each block that slides in the ground, by its pin [m]: its way and a quarter more at each
    end. `turn` is the mechanism over a whole turn."""
    rail_ends = {}
    for connections in turn.topology.groups:
        for joint, carrier, _ in connections.joints:
            slide = turn.slides.get(joint)
            if slide is None or slide.s is None or carrier is not None:
                continue
            pin, s = joint[0], np.atleast_1d(slide.s)
            x, y = (np.broadcast_to(v, s.shape) for v in (turn.pins[pin].p.x, turn.pins[pin].p.y))
            low, high = int(np.argmin(s)), int(np.argmax(s))
            # a block that stands still has a rail, too
            margin = 0.25 * float(np.ptp(s)) + 1e-9
            dx, dy = (float(np.atleast_1d(v)[0]) * margin for v in (slide.d.x, slide.d.y))
            begin, end = (float(x[low]) - dx, float(y[low]) - dy), (float(x[high]) + dx, float(y[high]) + dy)
            rail_ends[pin] = begin, end
    return rail_ends


def paths(turn: Mechanism, further: str = "") -> dict[str, tuple[Any, Any]]:
    """The paths of all points that are not pins, and of one `further` point [m]; `turn` is the mechanism over the
    whole way of its driver."""
    topology, positions = turn.topology, places(turn)
    pins = {pin for pin, _ in topology.joints}
    return {
        f"path of {point}": positions[point]
        for points in topology.points.values()
        for point in points
        if point in positions and (point not in pins or point == further)
    }


def hanging(turn: Mechanism) -> tuple[str, ...]:
    """The ground pins from which links hang, so that their supports are drawn above; `turn` is the mechanism over a
    whole turn."""
    low: dict[str, list[float]] = {}
    positions = places(turn)
    for pins in turn.topology.links.values():
        for pin in pins:
            if pin in turn.linkage.ground:
                ends = (end for end in pins if end != pin and end in positions)
                low.setdefault(pin, []).extend(float(np.mean(positions[end][1])) for end in ends)
    span = max(float(np.ptp([np.mean(y) for _, y in positions.values()])), 1e-9)
    return tuple(pin for pin, ends in low.items() if ends and np.mean(ends) < positions[pin][1] - 0.1 * span)


def blocks(mechanism: Mechanism) -> dict[str, Any]:
    """The angle of the line of each sliding block [rad], by its pin, and of each outline, by its name."""
    return {name: np.arctan2(d.y, d.x) for name, d in directions(mechanism).items()}


def outlines(mechanism: Mechanism) -> Iterator[list[tuple[float, float]]]:
    """The points of each outline at one position [m]."""
    for name, outline in mechanism.linkage.outlines.items():
        place = mechanism.pins[outline.pin].p + rotated(outline.points(), directions(mechanism)[name])
        yield list(zip(place.x.tolist(), place.y.tolist(), strict=True))


def labels(linkage: Linkage) -> dict[str, str]:
    """The labels of pins that differ from their names: a further point of a link at a pin of its name has none."""
    shown = shown_pins(linkage)
    return {pin: "" for pin in shown if "." in pin and pin.rpartition(".")[2] in shown}
