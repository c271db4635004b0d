"""Random linkages with weight and springs alone: four-bars, six-bars and slider-cranks, whose drivers turn, swing or
slide. `resting` gives those that close over their way, each with the tables of its file."""

from __future__ import annotations

import itertools
import math

import numpy as np
from random_linkages import RandomLinkage, unit

from chainunit.core.errors import InputError
from chainunit.machines.linkages.file import description_of
from chainunit.machines.linkages.model import machine_of

DRIVERS = ("turns", "swings", "slides")
REFUSED = "cannot close", "dead position", "points that move apart", "does not close"
SHAPES = (("rrr",), ("rrr", "rrr"), ("rrp",), ("rrp", "rrr"))


class RestingLinkage(RandomLinkage):
    """A linkage whose driver turns, swings or slides."""

    def arm(self):
        """A driver that swings: a crank of the size of the other links."""
        self.crank()
        at = self.world("crank", self.points["crank"][[*self.points["crank"]][-1]])
        self.put("crank", at + unit(self.rng.uniform(0, 2 * math.pi)) * self.rng.uniform(0.2, 0.5), "A")

    def anchor(self, but=""):
        """The end of an arm comes first."""
        if self.count < 8 and "A" in self.points.get("crank", {}):
            return "crank", self.world("crank", self.points["crank"]["A"]), "A"
        return super().anchor(but)

    def ram(self):
        """A driver that slides along a line of the ground."""
        at, way = self.near(0.3), self.rng.uniform(0, 2 * math.pi)
        self.poses["ram"], self.points["ram"] = (*at, self.rng.uniform(-math.pi, math.pi)), {}
        self.put("ground", at, "O1")
        self.put("ground", at + unit(way), "X")
        self.put("ram", at, "P")
        self.put("ram", at + self.near(0.2), "R")
        angle = self.poses["ram"][2]
        self.joints["cylinder"] = {"on": "ram.P", "by": "ground.O1", "toward": "X", "angle": angle}
        self.phi, self.zero, self.sense = 0.0, 0.0, 1.0

    def end(self, text):
        """The link and the place on it of an end of a spring."""
        link, point = text.split(".")
        return link, self.points[link][point]

    def loads(self):
        """Springs, most of them to the ground."""
        rng, loads = self.rng, {}

        def point(link):
            return f"{link}.{rng.choice([*self.points[link]])}"

        for k in range(int(rng.integers(2, 5))):
            one = str(rng.choice(self.moving))
            other = "ground" if rng.random() < 0.7 else str(rng.choice(self.moving))
            if other == "ground":
                by = f"ground.{self.put('ground', self.near(1.2))}"
            else:
                by = point(other)
            if one != other:
                spring = {"type": "spring", "on": point(one), "by": by}
                ends = [self.world(*self.end(spring[key])) for key in ("on", "by")]
                length = float(np.hypot(*(ends[1] - ends[0])) * rng.uniform(0.3, 1.2))
                stiffness = float(np.exp(rng.uniform(*np.log([300.0, 3e4]))))
                loads[f"spring{k}"] = spring | {"stiffness": stiffness, "length": length, "damping": 0.0}
        return loads

    def resting(self, driver):
        """The tables of the file, with the range of its driver."""
        tables = self.tables()
        del tables["parameters"]
        for link in tables["links"].values():  # every one has its weight
            link.setdefault("mass", 2.0)
            link.setdefault("inertia", 0.02)
        low, high = self.phi - self.rng.uniform(0.2, 1.2), self.phi + self.rng.uniform(0.2, 1.2)
        if driver == "swings":
            tables["driver"]["range"] = [low, high]
        elif driver == "slides":
            tables["driver"] = {"joint": "cylinder", "range": [0.25 * low, 0.25 * high]}
        return tables


def random_rest(seed):
    """A linkage by its seed, and its kind of driver."""
    rng = np.random.default_rng(seed)
    driver, new = DRIVERS[seed % 3], RestingLinkage(rng)
    {"turns": new.crank, "swings": new.arm, "slides": new.ram}[driver]()
    for group in SHAPES[seed // 3 % len(SHAPES)]:
        getattr(new, group)()
    return driver, new.resting(driver)


def resting(count):
    """So many linkages that close over their way, in a fixed order of seeds: seed, kind of driver, tables, text and
    model. Each kind of driver has its share."""
    left = dict.fromkeys(DRIVERS, -(-count // 3))
    for seed in itertools.count():
        driver = DRIVERS[seed % 3]
        if not left[driver]:
            if not any(left.values()):
                return
            continue
        driver, tables = random_rest(seed)
        try:
            text = description_of(tables, f"rest_{seed}")
            model = machine_of(text)
        except InputError as error:
            assert any(words in str(error) for words in REFUSED), (seed, str(error))
            continue
        left[driver] -= 1
        yield seed, driver, tables, text, model
