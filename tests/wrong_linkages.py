"""Wrong linkage files, as people write them: what is changed in a right one, and what the reader tells."""

PRESS = """\
title = "press"
[parameters]
r = { value = "80 mm", min = "10 mm", max = "200 mm" }
l = "360 mm"
[inputs]
press_force = "2.5 kN"
[tables.share]
phi = ["0 deg", "120 deg", "240 deg"]
value = [0, 1, 0.5]
[ground]
O1 = [0, 0]
G = ["25 mm", 0]
G2 = ["25 mm", "-1 m"]
[driver]
link = "crank"
zero = "0 deg"
[links.crank]
points = { O1 = [0, 0], A = ["r", 0] }
mass = "14 kg"
inertia = "0.09 kg m2"
[links.rod]
points = { A = [0, 0], C = ["l", 0] }
mass = "9.5 kg"
[links.ram]
points = { C = [0, 0], T = [0, "-120 mm"] }
mass = "32 kg"
masses = { T = "2 kg" }
[joints.guide]
on = "ram.C"
by = "ground.G"
toward = "G2"
[loads.pressing]
on = "ram.T"
force = [0, "press_force * share"]
[start]
phi = "20 deg"
points = { C = ["25 mm", "-356 mm"] }
"""
