"""A linkage as other programs store it: pins by their drawn places, links that have pins, slots, and an input."""

from __future__ import annotations

import keyword
import math
import re
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from ....core.errors import Faults, InputError, shown
from ....mechanism.assur import GROUND
from ..checks import POINT_NAMES

Place = tuple[float, float]
_MOST = 100
"""Most pins, and most links, of a linkage that is imported."""
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,3})?")


@dataclass
class ForeignLink:
    """A link: its pins, its mass [kg], its inertia about the centroid [kg m2], and the place of the centroid."""

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


class ForeignGear(NamedTuple):
    """Two links that turn together as wheels of these sizes: with teeth, or as sprockets of a chain, whose sizes may
    be radii in the unit of the drawing."""

    title: str
    links: Sequence[str]
    sizes: Sequence[float]
    is_chain: bool
    has_radii: bool


class ForeignDriver(NamedTuple):
    """A pin of the ground about which a motor turns its link, at a `speed` [rev/min]; or two pins and a cylinder
    between them. It moves by a `span` about its drawn place, an angle [rad] in its direction or a length; a motor
    without one turns round."""

    title: str
    pins: tuple[str, ...]
    clockwise: bool = False
    span: tuple[float, ...] = ()
    speed: float = 1.0


class ForeignLinkage(Faults):
    """A linkage of the program `program`, in which lengths have the unit `unit`. A reader fills it, and collects the
    faults of the source, each with its place; `remarks` are sentences for the result. A load has its link and its
    entries by its name, which is that of its point, too."""

    def __init__(self, program: str, unit: str) -> None:
        super().__init__()
        self.program, self.unit, self.weightless = program, unit, False
        self.places: dict[str, Place] = {}
        self.links = {GROUND: ForeignLink()}
        self.fastened: list[tuple[str, str]] = []
        self.slots: list[ForeignSlot] = []
        self.gears: list[ForeignGear] = []
        self.drivers: list[ForeignDriver] = []
        self.loads: dict[str, tuple[str, dict[str, Any]]] = {}
        self.remarks: list[str] = []

    def fault(self, title: str, message: str) -> None:
        """Collect the fault of a place in the source."""
        self.add([InputError(f"{title}: {message}")])

    def numbers(self, title: str, texts: Iterable[str]) -> list[float]:
        """The numbers in texts; one that is wrong is a fault, and counts as 0."""
        values = [float(text) if _NUMBER.fullmatch(text) else math.inf for text in texts]
        for text in (text for text, value in zip(texts, values, strict=True) if abs(value) > 1e12):
            self.fault(title, f"has {shown(text)} in place of a number, <= 1e12 in size")
        return [value if abs(value) <= 1e12 else 0.0 for value in values]

    def pin(self, text: str, place: Iterable[float], *links: str) -> str:
        """Add a pin of some links; returns its name in the linkage file."""
        name = free_name(text, self.places)
        x, y = place
        self.places[name] = x, y
        for link in links:
            self.links[link].pins.append(name)
        return name

    def link(self, text: str) -> str:
        """Add a link; returns its name in the linkage file."""
        name = free_name(text, self.links)
        self.links[name] = ForeignLink()
        return name

    def motor(self, title: str, pin: str, clockwise: bool, speed: float, *span: float) -> None:
        """Add a motor about a pin, and what the drawing says of its speed."""
        self.drivers.append(ForeignDriver(title, (pin,), clockwise, span, speed))
        way = "clockwise" if clockwise else "counter-clockwise"
        self.remarks.append(f"the drawing turns {pin} {way} at {abs(speed):g} rev/min; give --speed for it")

    def slot(self, title: str, pin: str, track: str, angle: float, stiff: bool) -> None:
        """Add a slot through the drawn place of a pin, at an `angle` [rad] of the drawing."""
        x, y = self.places[pin]
        reach = 0.25 * max(math.dist(place, (x, y)) for place in self.places.values()) or 1.0
        end = x + reach * math.cos(angle), y + reach * math.sin(angle)
        line = self.pin(f"{pin}_slot", (x, y), track), self.pin(f"{pin}_end", end, track)
        self.slots.append(ForeignSlot(title, pin, track, line, stiff))


def free_name(text: str, taken: Collection[str]) -> str:
    """A name for a linkage file that is like the text, and that is not `taken`.

    Raises
    ------
    InputError
        if too many are taken.
    """
    if len(taken) > _MOST:
        raise InputError(f"the drawing has more than {_MOST} pins or links, the most that are read")
    first = re.sub(r"[^A-Za-z0-9_]", "_", text)[:40]
    first = first if first[:1].isalpha() else f"N{first}"
    names = (f"{first}_{k}" if k else first for k in range(len(taken) + 2))
    return next(x for x in names if x not in taken and not keyword.iskeyword(x) and x not in POINT_NAMES)
