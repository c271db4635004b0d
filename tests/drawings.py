"""Drawings of linkages in the formats of other programs, and what they mean: a description for the independent
solution of `multibody`, made without the package. Lengths are in the unit of the drawing; all angles are 0 in it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from urllib.parse import quote

import numpy as np

DENSITY = 20.0
"""[kg/m]"""


@dataclass
class Drawing:
    """Pins by place, the pins of each link, the pins in the ground, and the pin and the link of the crank, which is
    the first link. A slot is a pin, the link with the slot, two pins of it on the line, and its angle."""

    places: dict = field(default_factory=dict)
    links: dict = field(default_factory=dict)
    fixed: list = field(default_factory=list)
    slots: list = field(default_factory=list)
    masses: dict = field(default_factory=dict)
    force: tuple = ()

    @property
    def crank(self):
        name = next(iter(self.links))
        return self.links[name][0], name

    def pin(self, name, place):
        self.places[name] = tuple(round(float(x), 3) for x in place)
        return name

    # formats: the text, its scale, and the names of pins and links in the linkage file

    def linkage2(self):
        ids = {name: k for k, name in enumerate(self.places)}
        lines = ["<linkage2>", '\t<program zoom="1" units="Millimeters"/>']
        for name, (x, y) in self.places.items():
            more = ' anchor="true"' * (name in self.fixed)
            more += ' input="true" rpm="-30"' * (name == self.crank[0])
            limits = [slot[2] for slot in self.slots if slot[0] == name]
            inside = "".join(f'<slidelimit id="{ids[end]}"/>' for ends in limits for end in ends)
            more += ' slider="true"' * bool(limits)
            lines.append(
                f'\t<connector id="{ids[name]}" layer="16" x="{x!r}" y="{y!r}"{more}>{inside}</connector>'
            )
        tracks = [list(ends) for _, track, ends, _ in self.slots if track == "ground"]
        for k, pins in enumerate([*self.links.values(), *tracks]):
            inside = "".join(f'<connector id="{ids[pin]}"/>' for pin in pins)
            lines.append(f'\t<Link id="{k}" layer="16">{inside}</Link>')
        text = "\n".join([*lines, "</linkage2>", ""])
        return (
            text,
            1e-3,
            {name: f"C{k}" for name, k in ids.items()},
            {x: f"L{k}" for k, x in enumerate(self.links)},
        )

    def pyslvs(self):
        order = sorted(self.places, key=lambda name: name != self.crank[0])
        joints = []
        for name in order:
            links = ["ground"] * (name in self.fixed) + [
                link for link, pins in self.links.items() if name in pins
            ]
            angle = [(track, angle) for pin, track, _, angle in self.slots if pin == name]
            kind = f"RP, A[{math.degrees(angle[0][1])!r}], " if angle else "R, "
            links = [angle[0][0], *links] if angle else links
            x, y = self.places[name]
            joints.append(f"    J[{kind}color[Green], P[{x!r}, {y!r}], L[{', '.join(links)}]],")
        text = "\n".join(["# a linkage", "M[", *joints, "]", ""])
        return text, 1e-3, {x: f"P{k}" for k, x in enumerate(order)}, {x: x for x in self.links}

    def pmks(self):
        rows = []
        for name, (x, y) in self.places.items():
            links = "|".join(link for link, pins in self.links.items() if name in pins)
            angle = [angle for pin, _, _, angle in self.slots if pin == name]
            kind, ground = ("P", "t") if angle else ("R", "t" if name in self.fixed else "f")
            drives = "t" if name == self.crank[0] else "f"
            if links:
                rows.append(
                    f"{name},{x!r},{y!r},{links},{kind},{ground},{angle[0] if angle else 0.0!r},0.1,{drives},"
                )
        links = []
        for name, pins in self.links.items():
            mass, inertia, (x, y) = self.masses[name]
            mark = "F1" if self.force and self.force[0] == name else ""
            links.append(f"{name},{mass!r},{inertia!r},{x!r},{y!r},{'|'.join(pins)},{mark},l,0,0,1,0,1,1,0,1")
        forces = []
        if self.force:
            link, (x, y), (dx, dy), size = self.force
            forces.append(f"F1,{link},{x!r},{y!r},{x + dx!r},{y + dy!r},t,true,{size!r}")
        text = "j={}&l={}&f={}&pp=&tp=&s=10,false,true,cm".format(
            *("\n".join([*section, ""]) for section in (rows, links, forces))
        )
        names = {name: name for name in self.places}
        return "https://pmks.example/?" + quote(text, safe="=&,?"), 1e-2, names, {x: x for x in self.links}

    # the meaning

    def description(self, scale, in_drawing, from_masses):
        """The description of `multibody`; a slot goes through its two pins if they are `in_drawing`, else through its
        drawn place at its angle. Masses are `from_masses` [g, kg cm2], or by the density."""

        def metres(place):
            return [scale * x for x in place]

        points = {name: {pin: metres(self.places[pin]) for pin in pins} for name, pins in self.links.items()}
        ground = {pin: metres(self.places[pin]) for pin in self.fixed}
        joints, blocks = [], {}
        for pin, track, ends, angle in self.slots:
            x, y = metres(self.places[pin])
            line = [metres(self.places[end]) for end in ends] if in_drawing else [
                [x, y], [x + math.cos(angle), y + math.sin(angle)]
            ]  # fmt: skip
            owner = ground if track == "ground" else points[track]
            owner |= {f"{pin}_from": line[0], f"{pin}_to": line[1]}
            blocks[f"block_{pin}"] = {pin: [x, y]}
            joints.append(
                {"name": f"guide_{pin}", "type": "prismatic", "on": [f"block_{pin}", pin],
                 "by": [track, f"{pin}_from"], "toward": f"{pin}_to", "angle": 0.0}
            )  # fmt: skip
        for pin in self.places:
            bodies = ["ground"] * (pin in ground)
            bodies += [name for name in (*points, *blocks) if pin in {**points, **blocks}[name]]
            for k, name in enumerate(bodies[1:]):
                joints.append(
                    {
                        "name": f"{pin}_{k}" if k else pin,
                        "type": "revolute",
                        "on": [name, pin],
                        "by": [bodies[0], pin],
                    }
                )
        loads = []
        if self.force:
            link, place, (dx, dy), size = self.force
            points[link]["F1"] = metres(place)
            force = [size * dx / math.hypot(dx, dy), size * dy / math.hypot(dx, dy)]
            loads.append({"name": "F1", "type": "force", "on": [link, "F1"], "force": force})
        links = []
        for name, there in {**points, **blocks}.items():
            link = {"name": name, "points": there, "masses": {}, "own": {}}
            if name in self.links:
                link |= self.mass(name, scale, from_masses)
            links.append(link)
        return {
            "parameters": [], "inputs": [], "common": {}, "ground": ground, "links": links, "joints": joints,
            "driver": {"joint": self.crank[0], "link": self.crank[1], "linear": False, "zero": 0.0, "sense": 1.0},
            "loads": loads, "start": {"value": 0.0, "poses": {link["name"]: [0.0, 0.0, 0.0] for link in links}},
        }  # fmt: skip

    def mass(self, name, scale, from_masses):
        if from_masses:
            mass, inertia, centroid = self.masses[name]
            return {"mass": 1e-3 * mass, "inertia": 1e-4 * inertia, "centroid": [scale * x for x in centroid]}
        places = [scale * np.array(self.places[pin]) for pin in self.links[name]]
        a, b = max(((a, b) for a in places for b in places), key=lambda ends: np.hypot(*(ends[0] - ends[1])))
        mass = DENSITY * float(np.hypot(*(a - b)))
        return {"mass": mass, "inertia": mass * float((a - b) @ (a - b)) / 12, "centroid": list((a + b) / 2)}


def unit(angle):
    return np.array([math.cos(angle), math.sin(angle)])


def meeting(a, b, near, far, side):
    """The point at these distances from two places, to the left of the way from the first one, or to its right."""
    way = b - a
    distance = float(np.hypot(*way))
    along = (near**2 - far**2 + distance**2) / (2 * distance)
    across = math.sqrt(near**2 - along**2)
    return a + way / distance * along + side * across * np.array([-way[1], way[0]]) / distance


def four_bar(rng):
    """A crank and a rocker, with a point on the coupler."""
    new, side, angle = Drawing(), rng.choice([-1.0, 1.0]), rng.uniform(-3, 3)
    o, turn = rng.uniform(-200, 200, 2), rng.uniform(-3, 3)
    o2 = o + 120 * unit(angle)
    a = o + rng.uniform(15, 25) * unit(turn)
    b = meeting(a, o2, rng.uniform(95, 115), rng.uniform(75, 95), side)
    places = (o, a, b, o2, 0.5 * (a + b) + rng.uniform(-60, 60, 2))
    for name, place in zip("OABQC", places, strict=True):
        new.pin(name, place)
    new.links = {"crank": ["O", "A"], "coupler": ["A", "B", "C"], "rocker": ["B", "Q"]}
    new.fixed = ["O", "Q"]
    return new


def six_bar(rng):
    """A four-bar, and a dyad on its coupler or on its rocker."""
    new = four_bar(rng)
    if rng.random() < 0.5:
        new.links["rocker"].append("C")
        new.links["coupler"].remove("C")
    c = np.array(new.places["C"])
    g = c + rng.uniform(170, 190) * unit(rng.uniform(-3, 3))
    new.pin("G", g)
    new.pin("F", meeting(c, np.array(new.places["G"]), 150, 140, rng.choice([-1.0, 1.0])))
    new.links |= {"rod": ["C", "F"], "output": ["F", "G"]}
    new.fixed.append("G")
    return new


def slider_crank(rng):
    """A crank, a rod, and its pin in a slot of the ground."""
    new, way = Drawing(), rng.uniform(-3, 3)
    o = rng.uniform(-200, 200, 2)
    a = o + rng.uniform(20, 40) * unit(rng.uniform(-3, 3))
    across = np.array([-unit(way)[1], unit(way)[0]])
    base = o + rng.uniform(-15, 15) * across
    rod, height = rng.uniform(100, 150), (a - base) @ across
    c = base + unit(way) * ((a - base) @ unit(way) + math.sqrt(rod**2 - height**2))
    for name, place in zip("OACST", (o, a, c, c - 90 * unit(way), c + 90 * unit(way)), strict=True):
        new.pin(name, place)
    new.links = {"crank": ["O", "A"], "rod": ["A", "C"]}
    new.fixed = ["O", "S", "T"]
    new.slots = [("C", "ground", ("S", "T"), way)]
    return new


def lever(rng):
    """The pin of a crank in the slot of a lever."""
    new, o = Drawing(), rng.uniform(-200, 200, 2)
    a = o + rng.uniform(20, 40) * unit(rng.uniform(-3, 3))
    g = o + rng.uniform(80, 120) * unit(rng.uniform(-3, 3))
    way = math.atan2(*(a - g)[::-1])
    for name, place in zip("OAGT", (o, a, g, g + 250 * unit(way)), strict=True):
        new.pin(name, place)
    new.links = {"crank": ["O", "A"], "lever": ["G", "T"]}
    new.fixed = ["O", "G"]
    new.slots = [("A", "lever", ("G", "T"), way)]
    return new


KINDS = {"linkage2": (four_bar, slider_crank, six_bar, lever), "pyslvs": (lever, six_bar, slider_crank, four_bar),
         "pmks": (six_bar, four_bar, slider_crank)}  # fmt: skip


def random_drawing(number):
    """The drawing of a number, and the name of its format; each third one has the same format."""
    rng, form = np.random.default_rng(number), [*KINDS][number % 3]
    kinds = KINDS[form]
    new = kinds[number // 3 % len(kinds)](rng)
    for name, pins in new.links.items():
        middle = np.mean([new.places[pin] for pin in pins], axis=0)
        new.masses[name] = (*rng.uniform(100, 900, 2), tuple(map(float, middle + rng.uniform(-20, 20, 2))))
        new.masses[name] = tuple(float(x) for x in new.masses[name][:2]) + new.masses[name][2:]
    if form == "pmks":
        link = str(rng.choice([*new.links]))
        place = tuple(map(float, np.add(new.places[new.links[link][0]], rng.uniform(-20, 20, 2))))
        new.force = (link, place, tuple(map(float, rng.uniform(-9, 9, 2))), float(rng.uniform(50, 500)))
    return new, form
