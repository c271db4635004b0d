"""A linkage as other programs store it: pins by their drawn places, links that have pins, slots, and an input."""

from __future__ import annotations

import keyword
import math
import re
from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from ....core.errors import Faults, InputError, shown
from ....mechanism.assur import GROUND
from ..checks import POINT_NAMES

Place = tuple[float, float]
MOST_LINKS, MOST_PINS = 60, 300
"""Most links and pins of a linkage that is imported."""
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,3})?")


@dataclass
class ForeignLink:
    """A link: its `title` in the source, its pins, its mass [kg], its inertia about the centroid [kg m2], and the
    place of the centroid."""

    title: str
    pins: list[str] = field(default_factory=list)
    mass: float = 0.0
    inertia: float = 0.0
    centroid: Place = (0.0, 0.0)


class ForeignSlot(NamedTuple):
    """A `pin` that slides on the link `track`, along the line through two of its points. The links of the pin turn in
    the slot, or, if it is `stiff`, keep their angle to it."""

    title: str
    pin: str
    track: str
    line: tuple[str, str]
    stiff: bool = False


class ForeignDriver(NamedTuple):
    """A pin of the ground about which a motor turns its link; or two pins and a cylinder between them, which grows by
    `throw` from its drawn length, or shrinks if that is below 0."""

    title: str
    pins: tuple[str, ...]
    clockwise: bool = False
    throw: float = 0.0


class ForeignLinkage(Faults):
    """A linkage of the program `program`, in which lengths have the unit `unit`. A reader fills it, and collects the
    faults of the source, each with its place; `remarks` are sentences for the result."""

    def __init__(self, program: str, unit: str) -> None:
        super().__init__()
        self.program, self.unit, self.weightless = program, unit, False
        self.places: dict[str, Place] = {}
        self.links = {GROUND: ForeignLink("the ground")}
        self.fastened: list[tuple[str, str]] = []
        self.slots: list[ForeignSlot] = []
        self.drivers: list[ForeignDriver] = []
        self.loads: dict[str, tuple[str, dict[str, Any]]] = {}
        """by name, which is that of its point, too: the link, and the entries of the load"""
        self.remarks: list[str] = []

    def fault(self, title: str, message: str) -> None:
        """Collect the fault of a place in the source."""
        self.add([InputError(f"{title}: {message}")])

    def number(self, title: str, name: str, text: str, most: float = 1e9) -> float:
        """The number in a text; one that is wrong is a fault, and counts as 0."""
        value = float(text) if _NUMBER.fullmatch(text.strip()) else math.nan
        if not abs(value) <= most:
            self.fault(title, f"{name} is {shown(text)}; must be a number, <= {most:g} in size")
            return 0.0
        return value

    def pin(self, text: str, place: Place) -> str:
        """Add a pin; returns its name in the linkage file."""
        name = free_name(text, self.places)
        self.places[name] = place
        if len(self.places) == MOST_PINS + 1:
            self.fault(self.program, f"has more than {MOST_PINS} pins, the most that are read")
        return name

    def link(self, text: str, title: str) -> str:
        """Add a link; returns its name in the linkage file."""
        name = free_name(text, self.links)
        self.links[name] = ForeignLink(title)
        if len(self.links) == MOST_LINKS + 2:
            self.fault(self.program, f"has more than {MOST_LINKS} links, the most that are read")
        return name

    def slot(self, title: str, pin: str, track: str, angle: float, stiff: bool) -> None:
        """Add a slot through the drawn place of a pin, at an `angle` [rad] of the drawing."""
        x, y = self.places[pin]
        reach = 0.25 * max(math.dist(place, (x, y)) for place in self.places.values()) or 1.0
        end = x + reach * math.cos(angle), y + reach * math.sin(angle)
        line = self.pin(f"{pin}_slot", (x, y)), self.pin(f"{pin}_end", end)
        self.links[track].pins += line
        self.slots.append(ForeignSlot(title, pin, track, line, stiff))


def free_name(text: str, taken: Collection[str]) -> str:
    """A name for a linkage file that is like the text, and that is not `taken`."""
    first = re.sub(r"[^A-Za-z0-9_]", "_", text)[:40]
    first = first if first[:1].isalpha() else f"N{first}"
    names = (f"{first}_{k}" if k else first for k in range(len(taken) + 2))
    return next(
        name for name in names if not (name in taken or keyword.iskeyword(name) or name in POINT_NAMES)
    )
