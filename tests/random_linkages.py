"""Random linkages as tables of a file: a short crank, and dyads and triads hung on earlier links.

A group is placed at the start pose first, clear of its dead positions; lengths, points and angles follow from the
pose. The crank is short against the rest, so that most of them close all the way round. `groups` tells by which
groups a linkage was built.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

DYADS = ("RRR", "RRP", "RPR", "PRP", "RPP")


def unit(angle):
    return np.array([math.cos(angle), math.sin(angle)])


def angle_of(v):
    return math.atan2(v[1], v[0])


@dataclass
class RandomLinkage:
    """A linkage that grows by groups."""

    rng: np.random.Generator
    poses: dict = field(default_factory=lambda: {"ground": (0.0, 0.0, 0.0)})
    points: dict = field(default_factory=lambda: {"ground": {}})
    joints: dict = field(default_factory=dict)
    groups: list = field(default_factory=list)
    count: int = 0

    # places

    def near(self, size):
        """A random step of at most `size`."""
        return unit(self.rng.uniform(0.0, 2.0 * math.pi)) * self.rng.uniform(0.2, 1.0) * size

    def either(self, low, high):
        """A random angle of either sign [deg]."""
        return math.radians(self.rng.uniform(low, high)) * self.rng.choice([-1.0, 1.0])

    def name(self, letter):
        self.count += 1
        return f"{letter}{self.count}"

    def link(self, start):
        """A new link; its frame lies anywhere."""
        name = self.name("link")
        origin = start + self.near(0.3)
        self.poses[name], self.points[name] = (*origin, self.rng.uniform(-math.pi, math.pi)), {}
        return name

    def world(self, link, local):
        x, y, angle = self.poses[link]
        c, s = math.cos(angle), math.sin(angle)
        return np.array([x + c * local[0] - s * local[1], y + s * local[0] + c * local[1]])

    def put(self, link, at, name=""):
        """A point of a link at a place of the frame."""
        x, y, angle = self.poses[link]
        c, s = math.cos(angle), math.sin(angle)
        dx, dy = at[0] - x, at[1] - y
        name = name or self.name("P")
        self.points[link][name] = [c * dx + s * dy, c * dy - s * dx]
        return name

    @property
    def moving(self):
        return [name for name in self.poses if name != "ground"]

    def anchor(self, but=""):
        """A moving link, and a place on it: a point of it, or one beside."""
        links = [name for name in self.moving if name != but]
        link = links[self.rng.integers(len(links))]
        point = self.rng.choice([*self.points[link]])
        at = self.world(link, self.points[link][point])
        if self.rng.random() < 0.5:
            return link, at, str(point)
        return link, at + self.near(0.12), ""

    def host(self, at, but=""):
        """A link that may carry a point at a place: the ground, or a moving one with a point not far from there."""
        near = [
            link
            for link in self.moving
            if link != but
            and any(np.hypot(*(self.world(link, p) - at)) < 0.35 for p in self.points[link].values())
        ]
        return near[self.rng.integers(len(near))] if near and self.rng.random() < 0.6 else "ground"

    # joints

    def pin(self, link, of, at, point=""):
        """A revolute joint of a new link with another one, by one name or by two; `point` is one that is there."""
        if point and point in self.points[link]:
            point = ""
        if not point or self.rng.random() < 0.5:
            own = point or self.name("P")
            if not point:
                self.put(of, at, own)
            if self.rng.random() < 0.5:
                self.put(link, at, own)
                return
            point, own = own, self.put(link, at)
        else:
            own = self.put(link, at)
        ends = [f"{link}.{own}", f"{of}.{point}"]
        if self.rng.random() < 0.5:
            ends.reverse()
        self.joints[self.name("J")] = {"on": ends[0], "by": ends[1]}

    def slide(self, one, other, at, along):
        """A sliding joint of two links along a line through a place."""
        on, by = (one, other) if self.rng.random() < 0.5 else (other, one)
        if self.rng.random() < 0.5:
            along = -along
        start = at + along * self.rng.uniform(-0.2, 0.2)
        angle = self.poses[on][2] - self.poses[by][2]
        joint = {
            "type": "prismatic",
            "on": f"{on}.{self.put(on, at + along * self.rng.uniform(-0.2, 0.2))}",
            "by": f"{by}.{self.put(by, start)}",
            "toward": self.put(by, start + along * self.rng.uniform(0.05, 0.5)),
            "angle": math.remainder(angle, 2.0 * math.pi),
        }
        self.joints[self.name("G")] = joint

    # groups

    def built(self, kind, *links):
        self.groups.append((kind, frozenset(links)))

    def crank(self):
        phi, zero = self.rng.uniform(-3.0, 3.0), self.rng.uniform(-3.0, 3.0)
        sense = self.rng.choice([-1.0, 1.0])
        self.phi, self.zero, self.sense = phi, zero, sense
        at = self.near(0.3)
        start = at + self.near(0.1)
        self.poses["crank"], self.points["crank"] = (*start, zero + sense * phi), {}
        self.put("ground", at, "O1")
        if self.rng.random() < 0.5:
            self.put("crank", at, "O1")
        else:
            ends = ["ground.O1", f"crank.{self.put('crank', at)}"]
            if self.rng.random() < 0.5:
                ends.reverse()
            self.joints["bearing"] = {"on": ends[0], "by": ends[1]}
        for _ in range(2):
            self.put("crank", at + unit(self.rng.uniform(0, 2 * math.pi)) * self.rng.uniform(0.03, 0.07))

    def rrr(self):
        i, p, point = self.anchor()
        b = p + unit(self.rng.uniform(0, 2 * math.pi)) * self.rng.uniform(0.4, 0.8)
        back = angle_of(p - b) + self.either(50, 130)
        q = b + unit(back) * self.rng.uniform(0.4, 0.8)
        j = self.host(q, i)
        first, second = self.link(p), self.link(q)
        self.pin(first, i, p, point)
        self.pin(second, j, q)
        self.pin(first, second, b)
        self.built("RRR", first, second)

    def rrp(self):
        i, p, point = self.anchor()
        way = self.rng.uniform(0, 2 * math.pi)
        c = p + unit(way) * self.rng.uniform(0.4, 0.8)
        j = self.host(c, i)
        first, block = self.link(p), self.link(c)
        self.pin(first, i, p, point)
        self.pin(first, block, c)
        self.slide(block, j, c + self.near(0.1), unit(way + self.either(0, 50)))
        self.built("RRP", first, block)

    def rpr(self):
        i, p, point = self.anchor()
        way = self.rng.uniform(0, 2 * math.pi)
        q = p + unit(way) * self.rng.uniform(0.4, 0.8)
        j = self.host(q, i)
        first, second = self.link(p), self.link(q)
        self.pin(first, i, p, point)
        self.pin(second, j, q)
        self.slide(first, second, 0.5 * (p + q) + self.near(0.2), unit(way + self.either(0, 35)))
        self.built("RPR", first, second)

    def prp(self):
        i, p, _ = self.anchor()
        c = p + self.near(0.3)
        j = self.host(c, i)
        first, second = self.link(c), self.link(c)
        way = self.rng.uniform(0, 2 * math.pi)
        self.slide(first, i, c + self.near(0.1), unit(way))
        self.slide(second, j, c + self.near(0.1), unit(way + self.either(50, 90)))
        self.pin(first, second, c)
        self.built("PRP", first, second)

    def rpp(self):
        i, p, point = self.anchor()
        j = self.host(p, i)
        block, yoke = self.link(p), self.link(p)
        way = self.rng.uniform(0, 2 * math.pi)
        self.pin(block, i, p, point)
        self.slide(block, yoke, p + self.near(0.1), unit(way))
        self.slide(yoke, j, p + self.near(0.2), unit(way + self.either(50, 90)))
        self.built("RPP", block, yoke)

    def triad(self):
        i, p, point = self.anchor()
        kinds = self.rng.choice(["rod", "block", "slot"], 3, p=[0.6, 0.2, 0.2])
        if kinds[0] == "block":
            point = ""
        first = self.rng.uniform(0, 2 * math.pi)
        hand = self.rng.choice([-1.0, 1.0])
        spokes = [first + 2.0 * math.pi * k / 3 + self.rng.uniform(-0.4, 0.4) for k in range(3)]
        sizes = [self.rng.uniform(0.2, 0.35) for _ in range(3)]
        lines = [unit(s + hand * math.radians(self.rng.uniform(60, 120))) for s in spokes]
        lengths = [self.rng.uniform(0.5, 0.8) for _ in range(3)]
        reach = [
            unit(s) * size + (line * length if kind == "rod" else 0.0)
            for s, size, line, length, kind in zip(spokes, sizes, lines, lengths, kinds, strict=True)
        ]
        center = p - reach[0]
        hosts = [i, self.host(center + reach[1]), self.host(center + reach[2])]
        ternary, legs = self.link(center), []
        for k, kind in enumerate(kinds):
            outer, inner = center + reach[k], center + unit(spokes[k]) * sizes[k]
            leg, of = self.link(outer), hosts[k]
            legs.append(leg)
            across = np.array([-lines[k][1], lines[k][0]])
            if kind == "rod":
                self.pin(leg, of, outer, point if k == 0 else "")
                self.pin(leg, ternary, inner)
            elif kind == "block":
                self.slide(leg, of, inner + self.near(0.05), across)
                self.pin(leg, ternary, inner)
            else:
                self.pin(leg, of, outer, point if k == 0 else "")
                self.slide(leg, ternary, inner + self.near(0.05), across)
        self.built("triad", ternary, *legs)

    # the tables

    def tables(self):
        rng, links = self.rng, {}
        for name in self.moving:
            points = self.points[name]
            link = links[name] = {"points": points}
            if rng.random() < 0.85:
                link |= {"mass": rng.uniform(1, 10), "inertia": rng.uniform(0.01, 0.3)}
                link["centroid"] = [*rng.uniform(-0.3, 0.3, 2)]
            if rng.random() < 0.4:
                link["masses"] = {str(rng.choice([*points])): rng.uniform(0.5, 3.0)}
        start = {"phi": self.phi, "poses": {}}
        for name in self.moving:
            x, y, angle = self.poses[name]
            dx, dy, turn = rng.normal(0.0, 0.003, 3)
            start["poses"][name] = [x + dx, y + dy, angle + turn]
        return {
            "parameters": {"f": "2 N", "c": "30 N s/m", "k": "0.4 N m s/rad"},
            "ground": self.points["ground"],
            "driver": {
                "link": "crank",
                "zero": self.zero,
                "positive": "clockwise" if self.sense < 0.0 else "counter-clockwise",
            },
            "links": links,
            "joints": self.joints,
            "loads": self.loads(),
            "start": start,
        }

    def loads(self):
        """A load of each kind."""
        rng, moving = self.rng, self.moving

        def point():
            link = str(rng.choice(moving))
            return f"{link}.{rng.choice([*self.points[link]])}"

        one, other = point(), point()
        ends = [each.split(".") for each in (one, other)]
        loads = {
            "steady": {"on": point(), "force": [*rng.uniform(-200, 200, 2)]},
            "law": {"on": point(), "force": ["90 * f * sin(phi) - c * vx", "f * cos(2 * phi) - 2 * c * vy"]},
            "own": {"type": "follower", "on": point(), "force": [50.0, "60 * f * sin(phi)"]},
            "brake": {"type": "torque", "on": str(rng.choice(moving)), "torque": "5 - 3 * k * angle_rate"},
        }
        apart = np.hypot(*np.subtract(*(self.world(x, self.points[x][y]) for x, y in ends)))
        if ends[0][0] != ends[1][0] and apart > 0.1:
            loads["spring"] = {
                "type": "spring", "on": one, "by": other, "stiffness": 900.0, "length": 0.3, "damping": 20.0
            }  # fmt: skip
        at = self.near(1.5)
        loads["to_ground"] = {
            "type": "spring", "on": point(), "by": f"ground.{self.put('ground', at)}", "stiffness": 500.0,
            "length": 0.2, "damping": 8.0,
        }  # fmt: skip
        return loads


def random_linkage(seed):
    """Tables of a linkage of 4 to 10 bars, the ground counted, and the groups by which it was built."""
    rng = np.random.default_rng(seed)
    new = RandomLinkage(rng)
    new.crank()
    left = int(rng.integers(1, 5))
    while left:
        if left >= 2 and rng.random() < 0.3:
            new.triad()
            left -= 2
        else:
            getattr(new, str(rng.choice(DYADS)).lower())()
            left -= 1
    return new.tables(), new.groups
