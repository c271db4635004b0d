"""The tables of a linkage file from a linkage that another program drew.

The drawn places are the start; there the frames of all links are parallel to the ground. A pin in a slot is a block
and a guide. Links that share two pins cannot move against each other, and are one link.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from decimal import Decimal
from fractions import Fraction
from typing import Any

from ....mechanism.assur import GROUND
from .foreign import ForeignDriver, ForeignLinkage, Place, free_name

_MOST_TEETH = 1000
Body = tuple[float, float, Place]
"""Mass [kg], inertia about the centroid [kg m2], and the place of the centroid."""


def tables_of(linkage: ForeignLinkage, scale: float, density: float) -> dict[str, Any]:
    """The tables of a linkage file; remarks on what differs from the drawing are added to it.

    Parameters
    ----------
    scale : length of one unit of the drawing [m]
    density : mass per length of links without a mass [kg/m]

    Raises
    ------
    InputError
        with a line for each fault of the source, and for each thing that cannot be carried over.
    """
    linkage.refuse()
    tables = _Tables(linkage, scale, density).tables()
    linkage.refuse()
    return {name: table for name, table in tables.items() if table != {}}


class _Tables:
    """The tables of one linkage; `body` has the name of the link that each of its links becomes."""

    def __init__(self, linkage: ForeignLinkage, scale: float, density: float) -> None:
        self.linkage, self.places, self.scale, self.density = linkage, linkage.places, scale, density
        self.links: dict[str, dict[str, Any]] = {}
        self.joints: dict[str, dict[str, Any]] = {}
        self.poses: dict[str, list[float]] = {}
        self.body = {name: name for name in linkage.links}
        stiff = {slot.pin for slot in linkage.slots if slot.stiff}
        pairs = [*linkage.fastened, *self.pairs(1, stiff), *self.pairs(2, {*self.places})]
        while pairs:
            for pair in pairs:
                ends = {self.body[name] for name in pair}
                first = next(name for name in self.body if name in ends)
                self.body = {name: first if body in ends else body for name, body in self.body.items()}
            pairs = [*self.pairs(2, {*self.places})]
        self.pins = self.pins_by_body()
        sliding = {slot.pin for slot in linkage.slots}
        wheels = {self.body[name] for gear in linkage.gears for name in gear.links}
        for body, pins in [*self.pins.items()][1:]:
            # a link with one pin alone moves nothing; in a slot it is the block
            if len(pins) < 2 and not stiff & {*pins} and body not in wheels:
                del self.pins[body]
                if not sliding & {*pins}:
                    linkage.remarks.append(f"the link {body} has fewer than two pins, and is left out")

    def pins_by_body(self) -> dict[str, list[str]]:
        """The pins of each body, the ground first."""
        pins: dict[str, dict[str, None]] = {}
        for name, link in self.linkage.links.items():
            pins.setdefault(self.body[name], {}).update(dict.fromkeys(link.pins))
        return {body: [*names] for body, names in pins.items()}

    def pairs(self, least: int, pins: set[str]) -> Iterator[tuple[str, str]]:
        """Bodies that share so many of these pins, or more, in different places."""
        for (a, first), (b, second) in itertools.combinations(self.pins_by_body().items(), 2):
            if len({self.places[pin] for pin in pins & {*first} & {*second}}) >= least:
                yield a, b

    def tables(self) -> dict[str, Any]:
        """The tables of a linkage file by name, of which some may be empty. Links of the drawing that do not move
        against each other are one link; a remark says so, as it says which links have no mass."""
        ground = {pin: self.vector(self.places[pin]) for pin in self.pins[GROUND]}
        for body in [*self.pins][1:]:
            members = [
                name for name in self.body if self.body[name] == body and self.linkage.links[name].pins
            ]
            self.add(body, self.pins[body], [self.mass(name) for name in members])
            if len(members) > 1:
                self.linkage.remarks.append(
                    f"the links {', '.join(members)} do not move against each other: link {body}"
                )
        if massless := [name for name, link in self.links.items() if "mass" not in link]:
            noun = "there is a link" if len(massless) == 1 else "there are links"
            self.linkage.remarks.append(
                f"{noun} {', '.join(massless)} without mass; --density gives links a mass"
            )
        # for a source that names no input
        moving, slots = self.moving(), {slot.pin for slot in self.linkage.slots}
        cranks = [pin for pin in self.pins[GROUND] if len(moving[pin]) == 1 and pin not in slots]
        named = self.linkage.drivers or [ForeignDriver(self.linkage.program, (*cranks, "")[:1])]
        # of motors the slowest one stands first, so that the others turn a whole number of times in a turn; of
        # cylinders one on the ground
        fixed = {*self.pins[GROUND]}
        first, *others = sorted(
            named, key=lambda x: (len(x.pins), bool(x.span), fixed.isdisjoint(x.pins), abs(x.speed))
        )
        self.guides()
        self.gears()
        driver, phi = self.driver(first)
        drivers = dict(self.further(first, other) for other in others)
        loads = {
            point: {**load, "on": f"{self.body[link]}.{point}"}
            for point, (link, load) in self.linkage.loads.items()
        }
        return ({"gravity": 0.0} if self.linkage.weightless else {}) | {
            "ground": ground, "driver": driver, "drivers": drivers, "links": self.links, "joints": self.joints,
            "loads": loads, "start": {"phi": phi, "poses": self.poses},
        }  # fmt: skip

    def vector(self, place: Place, origin: Place = (0.0, 0.0)) -> list[float]:
        """A place of the drawing from an origin [m], rounded but once."""
        gaps = (Decimal(repr(x)) - Decimal(repr(x0)) for x, x0 in zip(place, origin, strict=True))
        return [float(gap * Decimal(repr(self.scale))) for gap in gaps]

    def add(self, name: str, pins: Sequence[str], masses: Sequence[Body] = ()) -> None:
        """Add a link with these pins, of which the first one is the origin."""
        origin = self.places[pins[0]]
        self.links[name] = {"points": {pin: self.vector(self.places[pin], origin) for pin in pins}}
        self.poses[name] = [*self.vector(origin), 0.0]
        if mass := sum(m for m, _, _ in masses):
            x, y = (sum(m * place[axis] for m, _, place in masses) / mass for axis in (0, 1))
            inertia = sum(J + m * (self.scale * math.dist(place, (x, y))) ** 2 for m, J, place in masses)
            centroid = self.vector((x, y), origin)
            self.links[name] |= {"mass": mass, "inertia": inertia, "centroid": centroid}

    def mass(self, name: str) -> Body:
        """The mass of a link; without one, that of a bar between those of its pins that lie farthest apart."""
        link = self.linkage.links[name]
        places = [self.places[pin] for pin in link.pins]
        ends = max(itertools.product(places, places), key=lambda pair: math.dist(*pair))
        return (link.mass, link.inertia, link.centroid) if link.mass else self.bar(*ends)

    def bar(self, start: Place, end: Place) -> Body:
        """A uniform bar."""
        length = self.scale * math.dist(start, end)
        mass = self.density * length
        return mass, mass * length**2 / 12.0, (0.5 * (start[0] + end[0]), 0.5 * (start[1] + end[1]))

    def moving(self) -> dict[str, list[str]]:
        """The links of each pin that move."""
        return {pin: [body for body in [*self.pins][1:] if pin in self.pins[body]] for pin in self.places}

    def further(self, first: ForeignDriver, driver: ForeignDriver) -> tuple[str, dict[str, Any]]:
        """The name and the table of a driver besides the first one: a motor that turns round is in step with it,
        another driver is an input of its own."""
        name = free_name(f"motor_{driver.pins[0]}", self.links)
        table, start = self.driver(driver if driver.span else driver._replace(clockwise=first.clockwise))
        if driver.span:
            return table.get("joint", name), {**table, "start": start}
        if not first.speed or not driver.speed:
            self.linkage.fault(driver.title, "is an input that stands; give it a speed, or take it out")
            return driver.title, table
        ratio = driver.speed / first.speed
        self.linkage.remarks.append(
            f"{driver.title} turns {ratio:g} times as fast as {first.title}, with a motor of its own, as "
            f"[drivers.{name}] says"
        )
        return name, {**table, "phi": f"{ratio!r} * phi", "by": "motor"}

    def driver(self, driver: ForeignDriver) -> tuple[dict[str, Any], float]:
        """The table of a driver, and its value at the start."""
        moving = self.moving()
        if len(driver.pins) == 2:
            return self.cylinder(driver, *driver.pins)
        turned = moving.get(driver.pins[0], [])
        if len(turned) != 1 or driver.pins[0] not in self.pins[GROUND]:
            links = ", ".join(turned) or "no link"
            self.linkage.fault(
                driver.title, f"the input turns {links}; it must turn one link, about a fixed pin"
            )
            return {}, 0.0
        if not self.linkage.drivers:
            self.linkage.remarks.append(f"the source names no input: {turned[0]} is the driver")
        table = {"link": turned[0], **({"positive": "clockwise"} if driver.clockwise else {})}
        return {**table, **({"range": [*driver.span]} if driver.span else {})}, 0.0

    def cylinder(self, driver: ForeignDriver, start: str, end: str) -> tuple[dict[str, Any], float]:
        """Add barrel and rod of a cylinder; its table, and its length at the start. One that stands on the ground and
        pushes a block along its slot drives the guide instead."""
        (x, y), (u, v) = self.places[start], self.places[end]
        length, middle = math.dist((x, y), (u, v)), (0.5 * (x + u), 0.5 * (y + v))
        ends = [self.scale * (length + way) for way in driver.span]
        for guide, joint in self.joints.items():
            (_, block), (track, base) = (joint[key].split(".") for key in ("on", "by"))
            foot = {start: end, end: start}.get(block, "")
            if track == GROUND and foot in self.pins[GROUND]:
                a, b, p, q = (complex(*self.places[x]) for x in (base, joint["toward"], block, foot))
                place, reach = ((p - x) * abs(b - a) / (b - a) for x in (a, q))
                if abs(place.imag) + abs(reach.imag) < 1e-6 * abs(reach):
                    self.linkage.remarks.append(f"{driver.title} drives {guide}, and has no mass")
                    sense, start_place = self.scale * reach.real / abs(reach), self.scale * place.real
                    limits = sorted(start_place + sense * way for way in driver.span)
                    return {"joint": guide, "range": limits}, start_place
        if ends[0] <= 0.0:
            self.linkage.fault(driver.title, f"is {length:g} long; it must be longer than it shrinks")
        axis = self.linkage.pin(f"{end}_axis", (u, v))
        barrel, rod = (free_name(part, self.links) for part in ("barrel", "rod"))
        self.add(barrel, [start, axis], [self.bar((x, y), middle)])
        self.add(rod, [end], [self.bar(middle, (u, v))])
        name = free_name("cylinder", {*self.places, *self.joints})
        self.linkage.remarks.append(f"{driver.title} is the {name} of {barrel} and {rod}")
        self.joints[name] = {"on": f"{rod}.{end}", "by": f"{barrel}.{start}", "toward": axis}
        return {"joint": name, "range": ends}, self.scale * length

    def gears(self) -> None:
        """Add the joint of two wheels, each about the one pin of its link."""
        for title, links, sizes, is_chain, has_radii in self.linkage.gears:
            pins = [self.linkage.links[name].pins for name in links]
            if any(len(names) != 1 for names in pins):
                self.linkage.fault(
                    title, "are wheels of which one has not one pin, its centre; fasten the others"
                )
                continue
            on, by = (f"{self.body[name]}.{pin}" for name, (pin,) in zip(links, pins, strict=True))
            joint: dict[str, Any] = {"type": "gear", "on": on, "by": by}
            if is_chain:
                gap = math.dist(*(self.places[pin] for (pin,) in pins))
                # sizes alone do not tell the diameters: the sprockets then reach over half the gap
                unit = 2.0 if has_radii else gap / sum(sizes)
                joint |= {"type": "belt", "diameters": [self.scale * unit * size for size in sizes]}
            else:
                ratio = Fraction(sizes[0] / sizes[1]).limit_denominator(_MOST_TEETH)
                joint["teeth"] = [ratio.numerator, ratio.denominator]
            self.joints[free_name("chain" if is_chain else "mesh", {*self.joints, *self.places})] = joint

    def guides(self) -> None:
        """Add the guide of each slot, and a block if the links on its pin turn in it."""
        for title, pin, track, line, stiff in self.linkage.slots:
            riders = [body for body, pins in self.pins.items() if pin in pins]
            if self.body[track] in riders or self.places[line[0]] == self.places[line[1]]:
                self.linkage.fault(
                    title, "slides on its own link, or in a slot without a length; take it out"
                )
                continue
            rider = riders[0] if stiff else free_name(f"{pin}_block", self.links)
            if not stiff:
                self.add(rider, [pin])
            joint = {"on": f"{rider}.{pin}", "by": f"{self.body[track]}.{line[0]}", "toward": line[1]}
            self.joints[free_name(f"{pin}_guide", {*self.joints, *self.places})] = joint
