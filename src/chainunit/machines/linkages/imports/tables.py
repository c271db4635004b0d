"""The tables of a linkage file from a linkage that another program drew.

The drawn places are the start, and the frames of all links are parallel to the ground there. A pin in a slot is a block
and a guide; two pins of a link in one slot are a guide of the link. Links that cannot move against each other, as they
share two pins or form a triangle, are one link.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from decimal import Decimal
from typing import Any

from ....mechanism.assur import GROUND, ONE_DRIVER
from .foreign import ForeignDriver, ForeignLinkage, ForeignSlot, Place, free_name

_CLOSE = 1e-6
"""Distance from a line, by its length, at which a drawn point is on it."""
Body = tuple[float, float, Place]
"""Mass [kg], inertia about the centroid [kg m2], and the place of the centroid."""


def tables_of(linkage: ForeignLinkage, scale: float, density: float | None) -> dict[str, Any]:
    """The tables of a linkage file.

    Parameters
    ----------
    scale : length of one unit of the drawing [m]
    density : mass per length of links without a mass [kg/m]

    Raises
    ------
    InputError
        with a line for each fault of the source, and for each thing that cannot be carried over.
    """
    if len(linkage.drivers) > 1:
        titles = ", ".join(driver.title for driver in linkage.drivers)
        linkage.fault(titles, f"{len(linkage.drivers)} inputs: {ONE_DRIVER}")
    linkage.refuse()
    tables = _Tables(linkage, scale, density)
    linkage.refuse()
    loads = {
        name: load | {"on": f"{tables.body[link]}.{name}"} for name, (link, load) in linkage.loads.items()
    }
    whole = {
        "ground": tables.ground, "driver": tables.driver, "links": tables.links, "joints": tables.joints,
        "loads": loads, "start": {"phi": tables.start, "poses": tables.poses},
    }  # fmt: skip
    return ({"gravity": 0.0} if linkage.weightless else {}) | {
        key: table for key, table in whole.items() if table
    }


class _Tables:
    """The tables of one linkage; `body` has the name of the link that each of its links becomes."""

    def __init__(self, linkage: ForeignLinkage, scale: float, density: float | None) -> None:
        self.linkage, self.places, self.scale, self.density = linkage, linkage.places, scale, density
        self.links: dict[str, dict[str, Any]] = {}
        self.joints: dict[str, dict[str, Any]] = {}
        self.poses: dict[str, list[float]] = {}
        self.body = {name: name for name in linkage.links}
        self.join()
        self.pins = self.pins_by_body()
        self.leave_out()
        self.ground = {pin: self.vector(self.places[pin]) for pin in self.pins[GROUND]}
        bodies = [name for name in self.pins if name != GROUND]
        if massless := [name for name in bodies if not self.add(name, self.pins[name], self.mass(name))]:
            linkage.remarks.append(
                f"{', '.join(massless)}: without mass; --density gives links a mass per metre"
            )
        self.driver, self.start = self.driver_and_start()
        slots = [slot for slot in linkage.slots if self.is_slot(slot)]
        while slots:
            slots = self.guide(slots[0], slots[1:])

    def vector(self, place: Place, origin: Place = (0.0, 0.0)) -> list[float]:
        """A place of the drawing from an origin [m], exact but for its last digit."""
        scale = Decimal(repr(self.scale))
        gaps = (Decimal(repr(x)) - Decimal(repr(x0)) for x, x0 in zip(place, origin, strict=True))
        return [float(gap * scale) for gap in gaps]

    def add(self, name: str, pins: Sequence[str], mass: Sequence[Body]) -> bool:
        """Add a link with these pins, of which the first one is the origin; whether it has a mass."""
        origin = self.places[pins[0]]
        self.links[name] = {"points": {pin: self.vector(self.places[pin], origin) for pin in pins}}
        self.poses[name] = [*self.vector(origin), 0.0]
        if total := sum(m for m, _, _ in mass):
            centre = tuple(sum(m * place[axis] for m, _, place in mass) / total for axis in (0, 1))
            inertia = sum(J + m * (self.scale * math.dist(place, centre)) ** 2 for m, J, place in mass)
            self.links[name] |= {
                "mass": total,
                "inertia": inertia,
                "centroid": self.vector((centre[0], centre[1]), origin),
            }
        return bool(total)

    def mass(self, body: str) -> list[Body]:
        """The masses of the links of a body."""
        links = [link for name, link in self.linkage.links.items() if self.body[name] == body]
        bars = [link for link in links if not link.mass and link.pins]
        self.bars += [link.title for link in bars]
        bodies = [(link.mass, link.inertia, link.centroid) for link in links if link.mass]
        return bodies + [self.bar([self.places[pin] for pin in link.pins]) for link in bars]

    def bar(self, places: Sequence[Place]) -> Body:
        """A bar between those of some places that lie farthest apart."""
        (x, y), (u, v) = max(itertools.product(places, places), key=lambda ends: math.dist(*ends))
        length = self.scale * math.dist((x, y), (u, v))
        mass = (self.density or 0.0) * length
        return mass, mass * length**2 / 12.0, (0.5 * (x + u), 0.5 * (y + v))

    # links that are one

    def join(self) -> None:
        """Give links that cannot move against each other one body, the first of them."""
        order, links = [*self.linkage.links], self.linkage.links
        stiff = [
            [name for name in links if slot.pin in links[name].pins]
            for slot in self.linkage.slots
            if slot.stiff
        ]
        pairs = [*self.linkage.fastened, *(pair for names in stiff for pair in itertools.pairwise(names))]
        pairs += self.rigid_pairs()
        while pairs:
            for pair in pairs:
                first, second = sorted((self.body[name] for name in pair), key=order.index)
                self.body = {name: first if body == second else body for name, body in self.body.items()}
            pairs = [*self.rigid_pairs()]
        for body in {*self.body.values()} - {GROUND}:
            titles = [links[name].title for name in links if self.body[name] == body]
            if len(titles) > 1:
                self.linkage.remarks.append(
                    f"{', '.join(titles)} cannot move against each other: one link, {body}"
                )

    def pins_by_body(self) -> dict[str, list[str]]:
        """The pins of each body, the ground first."""
        pins: dict[str, dict[str, None]] = {GROUND: {}}
        for name, link in self.linkage.links.items():
            pins.setdefault(self.body[name], {}).update(dict.fromkeys(link.pins))
        return {body: [*names] for body, names in pins.items()}

    def rigid_pairs(self) -> Iterator[tuple[str, str]]:
        """Bodies that share two pins in different places, or form a triangle with a third one."""
        pins, corners = self.pins_by_body(), {}
        for pair in itertools.combinations(pins, 2):
            common = [*{self.places[pin] for pin in pins[pair[0]] if pin in pins[pair[1]]}]
            if len(common) > 1:
                yield pair
            elif common:
                corners[pair] = common[0]
        for a, b, c in itertools.combinations(pins, 3):
            if {(a, b), (b, c), (a, c)} <= corners.keys():
                (x, y), (u, v), (s, t) = corners[a, b], corners[b, c], corners[a, c]
                area = abs((u - x) * (t - y) - (v - y) * (s - x))
                if area > _CLOSE * max(math.dist((x, y), (u, v)), math.dist((x, y), (s, t))) ** 2:
                    yield from ((a, b), (b, c))

    def leave_out(self) -> None:
        """Leave out links that have one pin alone, and so move nothing."""
        stiff = {slot.pin for slot in self.linkage.slots if slot.stiff}
        lone = [
            name
            for name, pins in self.pins.items()
            if len(pins) < 2 and not stiff & {*pins} and name != GROUND
        ]
        self.pins = {name: pins for name, pins in self.pins.items() if name not in lone}
        if lone:
            titles = ", ".join(self.linkage.links[name].title for name in lone)
            self.linkage.remarks.append(f"{titles}: left out, with one pin alone")

    # driver and guides

    def driver_and_start(self) -> tuple[dict[str, Any], float]:
        """The table of the driver, and its value at the start."""
        drivers = self.linkage.drivers or [*itertools.islice(self.first_crank(), 1)]
        if not drivers:
            self.linkage.fault(
                self.linkage.program, "no link is on a pin of the ground, and none is the input"
            )
            return {}, 0.0
        title, pins, clockwise, throw = drivers[0]
        if len(pins) == 2:
            return self.cylinder(title, (pins[0], pins[1]), throw)
        turned = [body for body, names in self.pins.items() if pins[0] in names and body != GROUND]
        if pins[0] not in self.pins[GROUND] or len(turned) != 1:
            place = (
                "no pin of the ground"
                if pins[0] not in self.pins[GROUND]
                else f"a pin of {len(turned)} moving links"
            )
            self.linkage.fault(
                title, f"the input is {place}; it must be the pin of one moving link in the ground"
            )
            return {}, 0.0
        return {"link": turned[0], **({"positive": "clockwise"} if clockwise else {})}, 0.0

    def first_crank(self) -> Iterator[ForeignDriver]:
        """The links on a pin of the ground, for a source that names no input."""
        sliding = {slot.pin for slot in self.linkage.slots}
        for pin in self.pins[GROUND]:
            links = [body for body, names in self.pins.items() if pin in names and body != GROUND]
            if len(links) == 1 and pin not in sliding:
                self.linkage.remarks.append(
                    f"the source names no input: the link {links[0]} on {pin} is the driver"
                )
                yield ForeignDriver(pin, (pin,))

    def cylinder(self, title: str, ends: tuple[str, str], throw: float) -> tuple[dict[str, Any], float]:
        """Add barrel and rod of a cylinder; its driver."""
        (x, y), (u, v) = (self.places[end] for end in ends)
        middle, length = (0.5 * (x + u), 0.5 * (y + v)), math.dist((x, y), (u, v))
        if length + min(throw, 0.0) <= 0.0:
            self.linkage.fault(title, f"is {length:g} long, and must be longer than it shrinks")
        name = free_name("cylinder", {*self.links, *self.places})
        axis = self.linkage.pin(f"{name}_axis", (u, v))
        barrel, rod = (free_name(part, self.links) for part in ("barrel", "rod"))
        self.add(barrel, [ends[0], axis], [self.bar([(x, y), middle])])
        self.add(rod, [ends[1]], [self.bar([middle, (u, v)])])
        self.joints[name] = {"on": f"{rod}.{ends[1]}", "by": f"{barrel}.{ends[0]}", "toward": axis}
        limits = sorted(self.scale * way for way in (length, length + throw))
        return {"joint": name, "range": limits}, self.scale * length

    def riders(self, slot: ForeignSlot) -> list[str]:
        """The bodies on the pin of a slot."""
        return [body for body, pins in self.pins.items() if slot.pin in pins]

    def is_slot(self, slot: ForeignSlot) -> bool:
        """Whether a slot has a direction, and its pin is on another link; else it is faulted."""
        start, end = (self.places[pin] for pin in slot.line)
        wrong = "has a slot without a length" if start == end else "slides on its own link"
        is_right = start != end and self.body[slot.track] not in self.riders(slot)
        if not is_right:
            self.linkage.fault(slot.title, f"{wrong}; take it out")
        return is_right

    def guide(self, slot: ForeignSlot, others: list[ForeignSlot]) -> list[ForeignSlot]:
        """Add the guide of a slot, and a block if its links turn in it; the `others` that are left."""
        riders = self.riders(slot)
        mates = [
            other for other in others if self.is_along(other, slot) and {*riders} & {*self.riders(other)}
        ]
        if slot.stiff or mates:
            rider = next(body for body in riders if slot.stiff or body in self.riders(mates[0]))
            mates = [other for other in mates if rider in self.riders(other)]
        else:
            rider = free_name(f"{slot.pin}_block", self.links)
            self.add(rider, [slot.pin], [])
        by = f"{self.body[slot.track]}.{slot.line[0]}"
        name = free_name(f"{slot.pin}_guide", {*self.joints, *self.places})
        self.joints[name] = {"on": f"{rider}.{slot.pin}", "by": by, "toward": slot.line[1]}
        return [other for other in others if other not in mates]

    def is_along(self, other: ForeignSlot, slot: ForeignSlot) -> bool:
        """Whether a slot of the same link lies on the line of another one."""
        (x, y), (u, v) = (self.places[pin] for pin in slot.line)
        places = [self.places[pin] for pin in (slot.pin, other.pin, *other.line)]
        reach = max(math.dist((x, y), place) for place in (*places, (u, v)))
        gaps = [abs((u - x) * (t - y) - (v - y) * (s - x)) / math.dist((x, y), (u, v)) for s, t in places]
        return self.body[other.track] == self.body[slot.track] and max(gaps) <= _CLOSE * reach
