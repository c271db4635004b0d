"""Machines with a leg more than needed, as texts of linkage files; and where each leg yields, for `multibody`."""

from __future__ import annotations

CRANKS = """
[ground]
O1 = [0, 0]
O2 = [0.4, 0.3]
O3 = [0.8, -0.1]
[driver]
link = "crank"
[links.crank]
points = { O1 = [0, 0], A = [0.15, 0] }
mass = 4
inertia = 0.02
[links.plate]
points = { A = [0, 0], B = [0.4, 0.3], C = [0.8, -0.1], T = [0.4, 0.1] }
mass = 20
inertia = 1.2
centroid = [0.4, 0.08]
masses = { T = 3 }
[links.second]
points = { O2 = [0, 0], B = [0.15, 0] }
mass = 4
inertia = 0.02
centroid = [0.07, 0.01]
stiffness = "40 kN/mm"
[links.third]
points = { O3 = [0, 0], C = [0.15, 0] }
mass = 5
inertia = 0.03
stiffness = "k3"
[parameters]
k3 = "65 kN/mm"
[inputs]
drag = "30 N s/m"
[loads.push]
on = "plate.T"
force = ["-30 - drag * vx", "-200"]
[loads.side]
type = "follower"
on = "second.B"
force = [0, 70]
[start]
angles = { plate = 0, second = 0, third = 0 }
"""
"""A parallelogram with three cranks, whose bearings are not in line."""
LOCOMOTIVE = CRANKS.replace("0.4, 0.3]", "0.4, 0]").replace("0.8, -0.1]", "0.8, 0]")
"""Its bearings in line: all cranks have a dead position."""
GUIDED = LOCOMOTIVE.replace('link = "crank"', 'link = "crank"\nrange = ["30 deg", "150 deg"]').replace(
    "[start]", '[start]\nphi = "90 deg"'
)
GUIDED = GUIDED.replace("second = 0, third = 0", 'second = "90 deg", third = "90 deg"')
"""A platform on parallel rods, driven by a lever that swings away from its dead positions."""
SCOTT_RUSSELL = """
[ground]
O1 = [0, 0]
O2 = [1, 0]
G = [2, 0]
[driver]
link = "crank"
range = ["20 deg", "70 deg"]
[links.crank]
points = { O1 = [0, 0], A = [0.3, 0] }
[links.arm]
points = { C = [0, 0], A = [0.3, 0], B = [0.6, 0] }
mass = 5
inertia = 0.2
centroid = [0.3, 0]
[links.slide]
points = { C = [0, 0], D = [1, 0] }
mass = 3
[joints.guide]
on = "slide.C"
by = "ground.O1"
toward = "G"
[links.arm2]
points = { D = [0, 0], A2 = [0.3, 0], B2 = [0.6, 0] }
mass = 5
inertia = 0.2
centroid = [0.3, 0.02]
[links.crank2]
points = { O2 = [0, 0], A2 = [0.3, 0] }
mass = 2
inertia = 0.03
stiffness = 3e7
[links.platform]
points = { B = [0, 0], B2 = [1, 0], T = [0.4, 0.1] }
mass = 40
inertia = 3
centroid = [0.5, 0.05]
stiffness = 2e7
[loads.push]
on = "platform.T"
force = [-300, -2000]
[start]
phi = "45 deg"
angles = { arm = "135 deg", arm2 = "135 deg", crank2 = "45 deg", platform = 0 }
poses = { slide = [0.42, 0, 0] }
"""
"""A lift of two Scott-Russell linkages side by side."""
TRAMMEL = """
[ground]
M = [0, 0]
X = [1, 0]
Y = [0, 1]
[driver]
link = "crank"
[links.crank]
points = { M = [0, 0], A = [0.2, 0] }
mass = 2
[links.bar]
points = { A = [0, 0], C = [0.2, 0], B = [-0.2, 0], T = [0.5, 0.1] }
mass = 6
inertia = 0.3
centroid = [0.1, 0.05]
[links.along]
points = { C = [0, 0] }
mass = 1.5
stiffness = 5e7
[links.up]
points = { B = [0, 0] }
mass = 1
stiffness = 2e7
[joints.rail]
on = "along.C"
by = "ground.M"
toward = "X"
[joints.pole]
on = "up.B"
by = "ground.M"
toward = "Y"
[inputs]
drag = "30 N s/m"
[loads.tool]
on = "bar.T"
force = ["-drag * vx", "-80 - drag * vy"]
[start]
phi = "50 deg"
angles = { bar = "-50 deg" }
"""
"""An ellipsograph with a crank: two blocks on crossed rails carry the bar, and either one would do."""
SIEVE = """
[ground]
O = [1.5, 0.5]
P = [0, 0]
Q = [0.7, -0.1]
R = [1.0, 0.1]
S = [0.3, 0.2]
[driver]
link = "crank"
[links.crank]
points = { O = [0, 0], K = [0.06, 0] }
[links.sieve]
points = { P1 = [0, 0.4], Q1 = [0.7, 0.3], R1 = [1.0, 0.5], S1 = [0.3, 0.6], K1 = [1.1, 0.4], T = [0.4, 0.5] }
mass = 60
inertia = 5
centroid = [0.5, 0.45]
[links.rod]
points = { K = [0, 0], K1 = [-0.45, 0] }
mass = 3
inertia = 0.1
centroid = [-0.2, 0]
stiffness = 8e7
[links.one]
points = { P = [0, 0], P1 = [0, 0.4] }
stiffness = 2e7
[links.two]
points = { Q = [0, 0], Q1 = [0, 0.4] }
mass = 2
inertia = 0.03
centroid = [0, 0.2]
stiffness = 3e7
[links.three]
points = { R = [0, 0], R1 = [0, 0.4] }
stiffness = 2.5e7
[links.four]
points = { S = [0, 0], S1 = [0, 0.4] }
stiffness = 1.5e7
[inputs]
drag = "30 N s/m"
[loads.ore]
on = "sieve.T"
force = ["-drag * vx", -700]
[start]
poses = { sieve = [0, 0, 0], rod = [1.56, 0.5, 0] }
angles = { one = 0, two = 0, three = 0, four = 0 }
"""
"""A sieve on four parallel rods, moved by a connecting rod: a plate on five legs."""
PRESS = """
[ground]
O = [-0.3, 0]
P = [0.3, 0]
G = [0, -1]
H = [0, -2]
[driver]
link = "left"
zero = "180 deg"
[drivers.right]
link = "right"
by = "gear"
phi = "-phi"
[links.left]
points = { O = [0, 0], A = [0.1, 0] }
mass = 3
[links.right]
points = { P = [0, 0], B = [0.1, 0] }
mass = 3
[links.rod]
points = { A = [0, 0], C = [0.9, 0] }
mass = 4
inertia = 0.3
centroid = [0.4, 0]
stiffness = 6e7
[links.twin]
points = { B = [0, 0], D = [0.9, 0] }
mass = 4
inertia = 0.3
centroid = [0.4, 0.01]
stiffness = 4e7
[links.ram]
points = { M = [0, 0], C = [-0.2, 0], D = [0.2, 0], T = [0.1, -0.2] }
mass = 30
[joints.guide]
on = "ram.M"
by = "ground.G"
toward = "H"
[inputs]
drag = "30 N s/m"
[loads.work]
on = "ram.T"
force = [40, "800 - drag * vy"]
[start]
angles = { rod = "-70 deg", twin = "-110 deg" }
poses = { ram = [0, -0.9, 0] }
"""
"""A ram in a guide on two rods of two cranks that a gear turns against each other."""
SLOTS = """
[ground]
M = [0, 0]
P = [-0.3, 0]
Q = [0.3, 0]
[driver]
link = "crank"
range = ["40 deg", "150 deg"]
[links.crank]
points = { M = [0, 0], A = [0.3, 0] }
mass = 2
[links.cross]
points = { A = [0, 0], E = [1, 0], F = [0, 1], T = [0.3, 0.4] }
mass = 7
inertia = 0.4
centroid = [0.1, 0.2]
[links.near]
points = { P = [0, 0] }
mass = 1
inertia = 0.01
stiffness = 3e7
[links.far]
points = { Q = [0, 0] }
stiffness = 7e7
[joints.slot]
on = "near.P"
by = "cross.A"
toward = "E"
[joints.groove]
on = "far.Q"
by = "cross.A"
toward = "F"
[loads.push]
on = "cross.T"
force = [60, -90]
[start]
phi = "90 deg"
angles = { cross = "-135 deg" }
"""
"""A cross of two slots on two fixed blocks and a crank."""

MACHINES = {
    "three cranks": CRANKS,
    "guided platform": GUIDED,
    "double Scott-Russell": SCOTT_RUSSELL,
    "ellipsograph": TRAMMEL,
    "sieve": SIEVE,
    "twin press": PRESS,
    "cross": SLOTS,
}
_ROD = ("second", "O2", "B"), ("third", "O3", "C")
SPRINGS = {
    "three cranks": {"B": (4e7, _ROD[0]), "C": (6.5e7, _ROD[1])},
    "guided platform": {"B": (4e7, _ROD[0]), "C": (6.5e7, _ROD[1])},
    "double Scott-Russell": {"A2": (3e7, ("crank2", "O2", "A2")), "B2": (2e7, ("platform", "B", "B2"))},
    "ellipsograph": {"rail": (5e7, None), "pole": (2e7, None)},
    "sieve": {
        "K1": (8e7, ("rod", "K", "K1")),
        "P1": (2e7, ("one", "P", "P1")),
        "Q1": (3e7, ("two", "Q", "Q1")),
        "R1": (2.5e7, ("three", "R", "R1")),
        "S1": (1.5e7, ("four", "S", "S1")),
    },
    "twin press": {"C": (6e7, ("rod", "A", "C")), "D": (4e7, ("twin", "B", "D"))},
    "cross": {"slot": (3e7, None), "groove": (7e7, None)},
}
"""By machine, the joint in which each leg yields, its stiffness [N/m], and the points of a rod."""
