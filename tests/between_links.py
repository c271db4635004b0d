"""Machines with groups of class IV, and with drivers between two links that move, as texts of linkage files."""

from __future__ import annotations

import numpy as np

STEPHENSON = """
[ground]
O = [0.9, 0.1]
P = [0, 0]
[driver]
link = "crank"
[links.crank]
points = { O = [0, 0], A = [0.1, 0] }
mass = 3
inertia = 0.02
centroid = [0.03, 0.01]
[links.one]
points = { P = [0, 0], B = [-0.1, 0.4], D = [0.3, 0.2], tool = [0.2, 0.6] }
mass = 5
inertia = 0.3
centroid = [0.1, 0.2]
[links.two]
points = { A = [0, 0], C = [-0.2, 0.5], E = [-0.1, -0.4] }
mass = 4
inertia = 0.2
centroid = [-0.1, 0.1]
masses = { E = 1.5 }
[links.upper]
points = { B = [0, 0], C = [0.92, 0] }
mass = 2
inertia = 0.1
centroid = [0.4, 0.03]
[links.lower]
points = { D = [0, 0], E = [0.78, 0] }
mass = 1.5
inertia = 0.08
centroid = [0.4, 0.0]
[inputs]
drag = "30 N s/m"
[loads.tool]
on = "one.tool"
force = ["-20 - drag * vx", "-100"]
[loads.spring]
type = "spring"
on = "two.C"
by = "ground.P"
stiffness = "800 N/m"
length = "0.6 m"
damping = "20 N s/m"
[start]
points = { B = [-0.1, 0.4], D = [0.3, 0.2], C = [0.8, 0.6], E = [0.9, -0.3] }
"""
SLOTS = """
[ground]
O = [0.05, 0.1]
A = [1.0, 0.1]
A9 = [1.5, -0.5]
[driver]
link = "crank"
[links.crank]
points = { O = [0, 0], P = [-0.05, -0.1] }
mass = 3
inertia = 0.02
centroid = [0.03, 0.01]
[links.one]
points = { P = [0, 0], B = [-0.1, 0.4], T = [0.8, 0.6], D = [0.3, 0.2] }
mass = 5
inertia = 0.3
centroid = [0.1, 0.2]
[links.two]
points = { A1 = [0, 0], C = [-0.2, 0.5], S = [-0.1, -0.4], S9 = [-0.7, 0.1] }
mass = 4
inertia = 0.2
centroid = [-0.1, 0.1]
[links.block]
points = { C = [0, 0] }
mass = 0.7
inertia = 0.01
centroid = [0.02, 0.01]
[links.rod]
points = { D = [0, 0] }
mass = 0.6
inertia = 0.02
centroid = [0.03, 0.0]
[joints.rail]
on = "two.A1"
by = "ground.A"
toward = "A9"
[joints.upper]
on = "block.C"
by = "one.B"
toward = "T"
[joints.lower]
on = "rod.D"
by = "two.S"
toward = "S9"
[loads.push]
on = "two.C"
force = [40, "-60"]
[start]
poses = { one = [0, 0, 0], two = [1.0, 0.1, 0] }
"""
TURNING = """
[ground]
O = [0, 0]
Q = [0.04, 0]
[driver]
link = "crank"
positive = "clockwise"
zero = "90 deg"
[links.crank]
points = { O = [0, 0], A = [0.30, 0.05] }
mass = 3
inertia = 0.05
centroid = [0.1, 0.02]
[links.one]
points = { A = [0, 0], B = [-0.3, 0.45], D = [0.25, 0.5] }
mass = 4
inertia = 0.12
centroid = [0.0, 0.3]
[links.two]
points = { Q = [0, 0], C = [0.26, 0.1], E = [0.51, 0.35], W = [0.1, -0.2] }
mass = 5
inertia = 0.2
centroid = [0.05, 0.1]
[links.upper]
points = { B = [0, 0], C = [0.9192, 0] }
mass = 1
inertia = 0.04
centroid = [0.3, 0]
[links.lower]
points = { D = [0, 0], E = [0.57, 0] }
mass = 1
inertia = 0.04
centroid = [0.3, 0]
[loads.brake]
type = "torque"
on = "two"
torque = "12"
[start]
points = { B = [-0.35, 0.75], C = [0.3, 0.1], D = [0.2, 0.8], E = [0.55, 0.35] }
"""
ROBOT = """
[ground]
O = [0, 0]
[driver]
link = "boom"
range = ["10 deg", "100 deg"]
[drivers.elbow]
joint = "B"
{law}
[links.boom]
points = {{ O = [0, 0], B = [0.8, 0.1] }}
mass = 12
inertia = 0.6
centroid = [0.4, 0.02]
[links.fore]
points = {{ B = [0, 0], tool = [0.6, 0.05] }}
mass = 6
inertia = 0.2
centroid = [0.25, 0.01]
masses = {{ tool = 5 }}
[loads.push]
on = "fore.tool"
force = ["-30", "20"]
[start]
phi = "40 deg"
"""
EXCITER = """
[ground]
O = [0, 0]
Q = [1.0, 0.2]
[driver]
link = "crank"
[drivers.exciter]
joint = "M"
phi = "3 * phi + 30 deg"
by = "motor"
positive = "clockwise"
[links.crank]
points = { O = [0, 0], A = [0.2, 0] }
mass = 3
inertia = 0.05
centroid = [0.1, 0.02]
[links.coupler]
points = { A = [0, 0], B = [0.9, 0], M = [0.5, 0.2] }
mass = 6
inertia = 0.4
centroid = [0.45, 0.05]
[links.rocker]
points = { Q = [0, 0], B = [0.7, 0] }
mass = 4
inertia = 0.2
centroid = [0.3, 0.0]
[links.unbalance]
points = { M = [0, 0], W = [0.05, 0] }
mass = 2
inertia = 0.004
centroid = [0.04, 0]
[start]
points = { B = [1.0, 0.9] }
"""
FOUR_BAR = """
[ground]
O = [0, 0]
Q = [1.0, 0.2]
[driver]
joint = "A"
zero = "-40 deg"
[links.crank]
points = { O = [0, 0], A = [0.2, 0.03] }
mass = 3
inertia = 0.05
centroid = [0.1, 0.02]
[links.coupler]
points = { A = [0.1, 0.0], B = [0.9, 0.2] }
mass = 6
inertia = 0.4
centroid = [0.45, 0.05]
[links.rocker]
points = { Q = [0, 0], B = [0.7, 0] }
mass = 4
inertia = 0.2
centroid = [0.3, 0.0]
[loads.push]
on = "rocker.B"
force = [-30, "20"]
[start]
points = { B = [1.0, 0.9] , A = [0.2, 0.0]}
"""
FIVE_BAR = """
[ground]
A = [0, 0]
E = [1.2, 0]
[driver]
link = "left"
[drivers.other]
joint = "C"
{law}
[links.left]
points = {{ A = [0, 0], B = [0.2, 0] }}
mass = 3
inertia = 0.1
centroid = [0.15, 0.02]
[links.lower]
points = {{ B = [0, 0], C = [0.8, 0], tool = [1.2, 0.1] }}
mass = 2
inertia = 0.2
centroid = [0.5, 0.0]
[links.right]
points = {{ E = [0, 0], D = [0.6, 0] }}
mass = 2.5
inertia = 0.08
centroid = [0.2, 0.01]
[links.upper]
points = {{ D = [0, 0], C = [0.7, 0] }}
mass = 1
inertia = 0.15
centroid = [0.5, 0.1]
[loads.tool]
on = "lower.tool"
force = [-20, "-100"]
[start]
points = {{ C = [0.8, 0.6], D = [1.3, 0.5] }}
"""
_BODY = {"mass": 2.0, "inertia": 0.05, "centroid": [0.1, 0.03]}
_PLACES = {"P": [0, 0], "B": [-0.1, 0.4], "D": [0.3, 0.2], "A": [1.0, 0.1], "C": [0.8, 0.6], "E": [0.9, -0.3]}


def tetrad_of(kinds, rng):
    """The tables of a tetrad on a rocker of a four-bar and on the ground, with its outer joints and the joints of
    both legs by their letters, such as R, P, RR, PR; near and far end of a leg."""
    outer, other, *legs = kinds
    places = {name: np.array(place) + rng.uniform(-0.15, 0.15, 2) for name, place in _PLACES.items()}
    z, y = places["P"] + [0.2, -0.5], places["P"] + [0.15, -0.1]
    x, r = y + np.array([0.5, -0.2]), 0.03
    links, ground, joints = {}, {"Z": z, "O": x - [r, 0.0], "A": places["A"]}, {}

    def link(name, **points):
        links[name] = {"points": points, **_BODY}

    def slide(name, on, by, toward):
        joints[name] = {"on": on, "by": by, "toward": toward, "angle": 0.0}

    p, a = places["P"], places["A"]
    link("crank", O=[0, 0], X=[r, 0])
    link("coupler", X=[0, 0], Y=y - x)
    link("rocker", Z=[0, 0], Y=y - z, P=p - z, P9=p - z + np.array([0.3, 1.0]))
    link("one", **{"P" if outer == "R" else "P1": p - p}, B=places["B"] - p, D=places["D"] - p)
    link("two", **{"A" if other == "R" else "A1": a - a}, C=places["C"] - a, E=places["E"] - a)
    if outer == "P":
        slide("rail", "one.P1", "rocker.P", "P9")
    if other == "P":
        ground["A9"] = a + np.array([0.5, -0.6])
        slide("guide", "two.A1", "ground.A", "A9")
    poses = {"rocker": [*z, 0], "coupler": [*x, 0], "one": [*p, 0], "two": [*a, 0]}
    for name, ends, (near, far) in zip(("upper", "lower"), legs, ("BC", "DE"), strict=True):
        begin, end = places[near], places[far]
        length, angle = np.hypot(*(end - begin)), np.arctan2(*(end - begin)[::-1])
        poses[name] = [*(end if ends == "PR" else begin), angle if ends == "RR" else 0.0]
        if ends == "RR":
            link(name, **{near: [0, 0], far: [length, 0]})
        elif ends == "PR":
            link(name, **{far: [0, 0]})
            links["one"]["points"] |= {f"{far}_from": begin - p, f"{far}_to": end - p}
            slide(f"slot_{name}", f"{name}.{far}", f"one.{far}_from", f"{far}_to")
        else:
            link(name, **{near: [0, 0]})
            links["two"]["points"] |= {f"{near}_from": end - a, f"{near}_to": begin - a}
            slide(f"slot_{name}", f"{name}.{near}", f"two.{near}_from", f"{near}_to")

    def plain(value):
        if isinstance(value, dict):
            return {key: plain(x) for key, x in value.items()}
        return [float(x) for x in value] if isinstance(value, list | np.ndarray) else value

    return plain({"ground": ground, "driver": {"link": "crank"}, "links": links, "joints": joints,
                  "start": {"poses": poses}})  # fmt: skip
