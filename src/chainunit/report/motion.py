"""A linkage in motion as data, and as the JSON that the page plays. The numbers of the JSON are rounded; a constant
series has one number."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, ClassVar

import numpy as np

from ..reading.text import Units, scales, unit_text
from .lines import Line


@dataclass(frozen=True)
class DrawnLink:
    """A body of a linkage: a polyline through joints, closed or open; `look` is the name of its style."""

    name: str
    joints: tuple[str, ...]
    look: str = "link"
    closed: bool = False


@dataclass(frozen=True)
class Arrow:
    """A force at a joint over time [N]; `short` is its name in the picture, by default that of the joint."""

    title: str
    joint: str
    x: Any
    y: Any
    short: str = ""
    group: str = ""
    load: bool = False
    """whether the force is a load, not a reaction"""


@dataclass(frozen=True)
class Reading:
    """A value over time that stands beside the picture."""

    title: str
    values: Any
    unit: str
    kind: str = ""


@dataclass(frozen=True)
class Clip:
    """One run of a linkage; arrays have the shape (pictures,), or (1,) where nothing changes."""

    name: str
    title: str
    time: Any
    """[s], from the event on"""
    joints: Mapping[str, tuple[Any, Any]]
    """places x and y [m]"""
    readings: tuple[Reading, ...] = ()
    arrows: tuple[Arrow, ...] = ()
    loads: Mapping[str, Any] = field(default_factory=dict)
    """the load on each link, shown as the width of a band along the link"""
    blocks: Mapping[str, Any] = field(default_factory=dict)
    """the angle of the line of each sliding block [rad], by its joint"""
    event: bool = False
    still: float = 0.0
    """time of the picture that the page shows before it plays [s]"""


@dataclass(frozen=True)
class Animation:
    """A linkage in motion. `grounds` are the fixed joints; those in `hanging` have their support above. `groups` are
    the names of groups of arrows and loads, each of a colour of its own; `turn` is the time of a turn [s]."""

    links: tuple[DrawnLink, ...]
    grounds: tuple[str, ...]
    runs: tuple[Clip, ...] = ()
    turn: float = 1.0
    caption: Line = ()
    hanging: tuple[str, ...] = ()
    circles: tuple[tuple[str, str], ...] = ()
    """circles, each by the joints at its centre and on its rim; one with the same joint twice is a motor"""
    outlines: Mapping[str, Any] = field(default_factory=dict)
    """closed curves by name, each with its joint and its points from there [m]; `blocks` of a run have its angle"""
    groups: tuple[str, ...] = ()
    names: Mapping[str, str] = field(default_factory=dict)
    """the labels of joints whose label differs from their name"""
    paths: Mapping[str, tuple[Any, Any]] = field(default_factory=dict)
    """the paths of points of the linkage [m]"""
    rails: Mapping[str, tuple[tuple[float, float], tuple[float, float]]] = field(default_factory=dict)
    """the ends of the way of each block that slides in the ground, by its joint [m]"""
    form: ClassVar[str] = "long"


def pictures(animation: Animation, units: Units) -> dict[str, Any]:
    """The animation, ready for JSON. Joints are exact to 1e-5 of the size of the linkage, forces to 1e-4 of the
    largest force of their run."""
    lows, highs = [], []
    for coordinate in (v for run in animation.runs for xy in run.joints.values() for v in xy):
        lows.append(float(np.min(coordinate)))
        highs.append(float(np.max(coordinate)))
    reach = max((high - low for low, high in zip(lows, highs, strict=True)), default=1.0)
    reach = max(reach, *map(abs, (*lows, *highs)))
    return {
        "links": [asdict(link) for link in animation.links],
        "grounds": animation.grounds,
        "hanging": animation.hanging,
        "circles": animation.circles,
        "outlines": animation.outlines,
        "groups": animation.groups,
        "names": dict(animation.names),
        "paths": [
            {"title": title, "x": _list(x, reach, 5), "y": _list(y, reach, 5)}
            for title, (x, y) in animation.paths.items()
        ],
        "rails": [
            [_list(x, reach, 5)[0] for place in ends for x in place] for ends in animation.rails.values()
        ],
        "turn": animation.turn,
        "runs": [_run(run, reach, units) for run in animation.runs],
    }


def _run(run: Clip, reach: float, units: Units) -> dict[str, Any]:
    """The data of a clip for the page: lists of numbers, rounded relative to the `reach` of the machine."""
    time = np.asarray(run.time, float)
    largest = max((float(np.max(np.hypot(a.x, a.y))) for a in run.arrows), default=0.0)
    return {
        "name": run.name,
        "title": run.title,
        "event": run.event,
        "still": int(np.searchsorted(time, run.still)),
        "time": _list(time, max(float(time[-1] - time[0]), 1e-9), 5),
        "joints": {
            name: {"x": _list(x, reach, 5), "y": _list(y, reach, 5)} for name, (x, y) in run.joints.items()
        },
        "readings": [_reading(reading, units) for reading in run.readings],
        "blocks": {name: _list(np.degrees(angle), 360.0, 5) for name, angle in run.blocks.items()},
        "loads": {name: _list(load, None, 3) for name, load in run.loads.items()},
        "largest": _list(largest, None, 4)[0],
        "forces": [
            {
                "title": arrow.title,
                "at": arrow.joint,
                "short": arrow.short,
                "group": arrow.group,
                "kind": "load" if arrow.load else "reaction",
                "x": _list(arrow.x, largest, 4),
                "y": _list(arrow.y, largest, 4),
            }
            for arrow in run.arrows
        ],
    }


def _reading(reading: Reading, units: Units) -> dict[str, Any]:
    """A reading in the unit that is shown, as data of the page."""
    unit, factor, offset = scales(reading.unit, reading.kind, units)[0]
    values = factor * np.asarray(reading.values, float) + offset
    return {"title": reading.title, "unit": unit_text(unit), "values": _list(values, None, 4)}


def _list(x: Any, size: float | None, digits: int) -> list[float]:
    """The numbers of `x`, rounded to `digits` digits of `size`, or of the largest of them where `size` is None; one
    number where all are equal."""
    x = np.nan_to_num(np.atleast_1d(np.asarray(x, float)))
    scale = size if size is not None else float(np.max(np.abs(x)))
    places = digits - 1 - math.floor(math.log10(scale)) if scale > 0.0 else 0
    # adding 0 makes -0 a 0
    numbers = np.round(x, places) + 0.0
    values = numbers.tolist() if places > 0 else [int(n) for n in numbers]
    return values[:1] if len(set(values)) == 1 else values
