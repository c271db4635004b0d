"""Wrong linkage files, as people write them: what is changed in a right one, and what the reader tells."""

from chainunit.mechanism.assur import FURTHER_DRIVERS

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

RADIANS = "more than a turn; a number without a unit is in radians"
SPRING = '[loads.s]\ntype = "spring"\non = "ram.C"'
GUIDE = '[joints.guide]\non = "ram.C"\nby = "ground.G"\ntoward = "G2"\n'
ROUGH = 'points = { C = ["25 mm", "-356 mm"] }'
R = 'r = { value = "80 mm", min = "10 mm", max = "200 mm" }'


def crank(x):
    """Another place of the point A of the crank."""
    return [('["r", 0]', f'[{x}, "0 * r"]')]


def added(text):
    """More tables before [start]."""
    return [("[start]", f"{text}\n[start]")]


def called(name):
    """The parameter l by another name."""
    return [('l = "360 mm"', f'{name} = "360 mm"'), ('["l"', f'["{name}"')]


def point(name):
    """The point T of the ram by another name."""
    return [("T = [0", f"{name} = [0"), ("T = ", f"{name} = "), ("ram.T", f"ram.{name}")]


# what is changed, and for each fault its line, its key and words of the remedy
CHANGES = [
    # unknown keys
    ([('mass = "14 kg"', 'maas = "14 kg"')], [(19, "links.crank.maas", 'was "mass" meant?')]),
    ([("[loads.pressing]", "[load.pressing]")], [(32, "load", 'was "loads" meant?')]),
    ([("toward =", "towards =")], [(31, "joints.guide.towards", 'was "toward" meant?')]),
    ([("zero =", "zeros =")], [(16, "driver.zeros", 'was "zero" meant?')]),
    ([("80 mm\", min", "80 mm\", mini")], [(3, "parameters.r.mini", 'was "min" meant?')]),
    ([("value = [0", "values = [0")],
     [(7, "tables.share", "two lists"), (9, "tables.share.values", "value")]),
    (added("[pins]\nfrict = 0.1"), [(36, "pins.frict", 'was "friction" meant?')]),
    ([(ROUGH, 'point = { C = [0, 0] }')], [(37, "start.point", 'was "points" meant?')]),
    # units
    ([('"14 kg"', '"14 mm"')], [(19, "links.crank.mass", 'write it as "2 kg"')]),
    ([('"0.09 kg m2"', '"0.09 kg"')], [(20, "links.crank.inertia", 'write it as "2 kg m2"')]),
    (crank('"50,5 mm"'),
     [(18, "links.crank.points.A", 'numbers have a decimal point; was "50.5 mm" meant?')]),
    ([('"360 mm"', '"36,5 cm"')], [(4, "parameters.l", 'numbers have a decimal point; was "36.5 cm" meant?')]),
    ([('"360 mm"', '"14\\""')], [(4, "parameters.l", 'was "14 in" meant?')]),
    ([(ROUGH, 'points = { C = ["1\'", 0] }')], [(37, "start.points.C", 'was "1 ft" meant?')]),
    ([("[0, 1, 0.5]", '[0, 1, "0,5"]')], [(7, "tables.share", 'numbers have a decimal point; was "0.5" meant?')]),
    (crank('"0,5 * r"'), [(18, "links.crank.points.A", "numbers have a decimal point")]),
    (crank('"r * 0,5"'), [(18, "links.crank.points.A", "numbers have a decimal point")]),
    (crank('"r * step(r, 0,5)"'), [(18, "links.crank.points.A", "numbers have a decimal point")]),
    (crank('"press_force * 3"'), [(18, "links.crank.points.A", "lengths cannot change in a run")]),
    ([('mass = "14 kg"', 'mass = "press_force / 9.81"')], [(19, "links.crank.mass", "in N; must be in kg")]),
    ([('zero = "0 deg"', 'zero = "5 mm"')], [(16, "driver.zero", 'write it as "2 deg"')]),
    ([('"360 mm"', '"360 furlong"')], [(4, "parameters.l", "the unit is not known")]),
    ([('"80 mm", min', '"80 mm", unit = "furlong", min')], [(3, "parameters.r", "known: 1, m, rad")]),
    ([('"80 mm", min', '"80 mm", unit = "kg", min')], [(3, "parameters.r", 'write it as "2 kg"')]),
    (added('[pins]\nfriction = "2 m"'), [(36, "pins.friction", 'write it as "0.2"')]),
    ([('"240 deg"', '"4 mm"')], [(7, "tables.share", 'write it as "2 deg"')]),
    # expressions
    (crank('"radius"'), [(18, "links.crank.points.A", "radius is no parameter")]),
    (crank('"2 * R"'), [(18, "links.crank.points.A", 'was "r" meant?')]),
    (crank('"sinus(0.2) * r"'), [(18, "links.crank.points.A", 'was "sin" meant? known here: sin, cos')]),
    (crank('"erf(1) * r"'), [(18, "links.crank.points.A", "no function erf; known here: sin, cos")]),
    (crank('"r + "'), [(18, "links.crank.points.A", "no expression, such as 2 * r + 0.01")]),
    (crank('"r ** 0.5"'), [(18, "links.crank.points.A", "in m0.5; must be in m")]),
    (crank('"r ** 13"'), [(18, "links.crank.points.A", "whole ones up to 12")]),
    (crank('"r ** l"'), [(18, "links.crank.points.A", "cannot be computed")]),
    (crank('"r * exp(l)"'), [(18, "links.crank.points.A", "exp takes an angle or a ratio, not m")]),
    (crank('"r if r else l"'), [(18, "links.crank.points.A", "there is no if: a value is switched smoothly")]),
    (crank('"if(r > 0.1, r, l)"'), [(18, "links.crank.points.A", "where(vx > 0, 500, 0, 0.01) is 500")]),
    (crank('"r > 0.1"'), [(18, "links.crank.points.A", "where(vx > 0, 500, 0, 0.01) is 500")]),
    (crank('"max(ram.C.y)"'), [(18, "links.crank.points.A", "belong into the force or torque of a load")]),
    (crank('"min(r)"'), [(18, "links.crank.points.A", "belong into the force or torque of a load")]),
    (crank('"positive(r)"'), [(18, "links.crank.points.A", "is written positive(x, width)")]),
    (crank('"where(r, r, l, 0.1)"'), [(18, "links.crank.points.A", "one comparison, such as vx > 0")]),
    (crank('"where(r > 1, r, 2)"'), [(18, "links.crank.points.A", "where(x > limit, then, else, width)")]),
    (crank('"table(r, 0, 1)"'), [(18, "links.crank.points.A", "two or more pairs of numbers")]),
    (crank('"table(r, 0, 1, 0, 2)"'), [(18, "links.crank.points.A", "must rise")]),
    (crank('"where(r > 1, r, l, 0.1) * step(r, 2) * 3 * l"'), [(18, "links.crank.points.A", "in m2; must be in m")]),
    # extremes and tables of loads
    *[([("press_force * share", f"press_force * share * {factor}")], [(34, "loads.pressing.force", words)])
      for factor, words in (
          ("step(min(rams.C.y) - y, 0.01)", 'in min(rams.C.y) rams is no link; was "ram" meant?'),
          ("step(min(ram.U.y) - y, 0.01)", "in min(ram.U.y) U is no point of ram; its points: C, T"),
          ("step(min(ram.T.z) - y, 0.01)", "z must be x or y of a point"),
          ("step(min(r) - y, 0.01)", "r is no place of the motion"),
          ("step(min(2 * r) - y, 0.01)", "min has two arguments, or is an extreme"),
          ("step(ram.T.y - y, 0.01)", "ram.T.y is known as an extreme alone"),
          ("step(min(y) - y, press_force)", "the one is in m, the other in N"),
          ("stroke(y, 2)", "stroke is written stroke(LINK.POINT.y)"),
          ("table(y, shore)", 'shore is no table; was "share" meant?'),
          ("table(y, share)", "the one is in m, the other in no unit"),
      )],
    ([("phi = [", "x = ["), ('"0 deg", "120 deg", "240 deg"', '0, 1, "2 mm"')],
     [(7, "tables.share", "x must rise")]),
    ([("phi = [", "x = ["), ('"0 deg", "120 deg", "240 deg"', '0, 1, 2')],
     [(34, "loads.pressing.force", "it is a table over x: write table(x, share)")]),
    ([("phi = [", "file = \"none.csv\"\nx = [")], [(7, "tables.share", "take one of both out")]),
    (crank('"r / 0"'), [(18, "links.crank.points.A", "divides by zero")]),
    (crank('"10 mm + r"'), [(18, "links.crank.points.A", "write its numbers in SI units")]),
    (crank('"press_force"'), [(18, "links.crank.points.A", "lengths cannot change in a run")]),
    (crank('"r + phi"'), [(18, "links.crank.points.A", "phi is known in a load alone")]),
    ([("press_force * share", "press_force * shore")],
     [(34, "loads.pressing.force", 'was "share" meant?')]),
    # what follows from the first fault of an expression is not told
    ([("press_force * share", "pres_force * shore")],
     [(34, "loads.pressing.force", 'was "press_force" meant?')]),
    ([('"ram.T"', '"ram.S"'), ("press_force * share", "press_force * share * step(max(y) - y, 0.01)")],
     [(33, "loads.pressing.on", "S is no point of ram")]),
    ([('mass = "9.5 kg"', 'bar = { from = "A", to = "C", area = "2 * q", density = "7850 kg/m3" }')],
     [(23, "links.rod.bar.area", "q is no parameter")]),
    ([('points = { A = [0, 0], C = ["l"', 'ponts = { A = [0, 0], C = ["l"')],
     [(22, "links.rod.ponts", 'was "points" meant?')]),
    ([('"360 mm"', '"2 * l"')], [(4, "parameters.l", "refers to itself")]),
    ([('"360 mm"', '"2 * q"')], [(4, "parameters.l", "q is no parameter")]),
    ([('"360 mm"', '"r + 2 * kilo"'), ("[parameters]", '[parameters]\nkilo = "2 kg"')],
     [(5, "parameters.l", "the one is in m, the other in kg")]),
    # dimensions
    (crank('"r * l"'), [(18, "links.crank.points.A", "in m2; must be in m")]),
    (crank('"0.04 * cos(r / l)"'), [(18, "links.crank.points.A", "multiply by a parameter that has it")]),
    (crank('"r + l * l"'), [(18, "links.crank.points.A", "the one is in m, the other in m2")]),
    (crank('"sin(r)"'), [(18, "links.crank.points.A", "takes an angle or a ratio, not m")]),
    ([("press_force * share", "press_force * r")],
     [(7, "tables.share", "no load uses it"), (34, "loads.pressing.force", "must be in N")]),
    ([('mass = "32 kg"', 'mass = "2 * r"')], [(26, "links.ram.mass", "must be in kg")]),
    # values
    ([('mass = "32 kg"', 'mass = "-32 kg"')], [(26, "links.ram.mass", "must be >= 0")]),
    ([('T = "2 kg"', 'T = "-2 kg"')], [(27, "links.ram.masses.T", "must be >= 0")]),
    ([('T = "2 kg"', 'U = "2 kg"')], [(27, "links.ram.masses.U", "is no point of ram")]),
    ([("value = \"80 mm\", min = \"10", "value = \"80 mm\", min = \"100")],
     [(3, "parameters.r", "must be within min = \"100 mm\" and max = \"200 mm\"")]),
    ([("value = \"80 mm\", min = \"10 mm", "value = \"80 kg\", min = \"10 mm")],
     [(3, "parameters.r", 'has value = "80 kg" and min = "10 mm", which are of different kinds')]),
    ([('value = "80 mm", ', "")], [(3, "parameters.r", "is missing; must be a number")]),
    ([('l = "360 mm"', "l = nan")], [(4, "parameters.l", "must be finite")]),
    (crank("inf"), [(18, "links.crank.points.A", "must be finite")]),
    (crank('"nan"'), [(18, "links.crank.points.A", "nan is no parameter")]),
    (crank("true"), [(18, "links.crank.points.A", "must be a number or a text with a unit")]),
    ([('["r", 0]', '["r"]')], [(18, "links.crank.points.A", "a list of two, along x and y")]),
    ([('"press"', '"press"\ngravity = "-3 m/s2"')], [(2, "gravity", "must be >= 0")]),
    ([('"press"', "3")], [(1, "title", "must be a text")]),
    ([('"press"', '"press"\nname = "a b"')], [(2, "name", "letters, digits and _")]),
    ([("[0, 1, 0.5]", "[0, 1]")], [(7, "tables.share", "two lists of one length, of 3 or more")]),
    ([('"240 deg"', '"100 deg"')], [(7, "tables.share", "phi must rise")]),
    ([('"240 deg"', '"400 deg"')], [(7, "tables.share", "less than one turn")]),
    ([('l = "360 mm"', 'l = "0 m"')], [(22, "links.rod.points", "place them apart")]),
    ([('G2 = ["25 mm", "-1 m"]', 'G2 = ["25 mm", 0]')], [(31, "joints.guide.toward", "no direction")]),
    # what is not used, or not there
    ([('l = "360 mm"', 'l = "360 mm"\nq = 3')], [(5, "parameters.q", "use it, or take it out")]),
    ([('force = [0, "press_force * share"]', "force = [0, 9]")],
     [(6, "inputs.press_force", "take it out"), (7, "tables.share", "no load uses it")]),
    ([('"ram.T"', '"ram.S"')], [(33, "loads.pressing.on", "S is no point of ram; its points: C, T")]),
    ([('"ram.T"', '"rim.C"')], [(33, "loads.pressing.on", "rim is no link")]),
    ([('"ram.T"', '"T"')], [(33, "loads.pressing.on", 'such as "rod.A"')]),
    ([('"ram.T"', '"ground.G"')], [(33, "loads.pressing.on", "give a point of a link")]),
    ([('on = "ram.T"\n', "")], [(32, "loads.pressing.on", "is missing; must be a link and its point")]),
    ([('on = "ram.C"', 'on = "ram.c"')], [(29, "joints.guide.on", 'was "C" meant? its points')]),
    ([('on = "ram.C"\n', "")], [(28, "joints.guide.on", "is missing")]),
    ([('by = "ground.G"', 'by = "ram.T"')], [(28, "joints.guide", "with itself")]),
    ([('toward = "G2"', 'toward = "G3"')], [(31, "joints.guide.toward", "another point of ground")]),
    ([('toward = "G2"', 'type = "prismatic"')], [(28, "joints.guide.toward", "is missing; must be")]),
    ([('toward = "G2"', 'type = "slider"')], [(31, "joints.guide.type", '"revolute" or "prismatic"')]),
    ([("[loads.pressing]", '[loads.pressing]\ntype = "forc"')],
     [(33, "loads.pressing.type", 'was "force" meant?')]),
    # the driver
    ([('[driver]\nlink = "crank"\nzero = "0 deg"\n', "")],
     [(0, "driver", "the link that the motor turns")]),
    ([('link = "crank"', 'link = "cronk"')], [(15, "driver.link", 'was "crank" meant?')]),
    ([('link = "crank"', 'link = "rod"')], [(15, "driver.link", "one revolute joint with the ground")]),
    ([('zero = "0 deg"', 'positive = "left"')], [(16, "driver.positive", '"counter-clockwise"')]),
    ([('zero = "0 deg"', "range = 1")], [(16, "driver.range", "is 1; must be the least and the most angle of")]),
    ([('zero = "0 deg"', "range = [1, 0]")], [(16, "driver.range", "is [1, 0]; must rise")]),
    ([('zero = "0 deg"', "range = [10, 80]")], [(16, "driver.range", "a number without a unit is in radians")]),
    ([('zero = "0 deg"', 'range = ["0 deg", "400 deg"]')],
     [(16, "driver.range", "more than a turn; for a driver that turns all the way round leave it out")]),
    ([('zero = "0 deg"', 'range = ["30 deg", "90 deg"]')],
     [(36, "start.phi", 'is "20 deg"; must be an angle in driver.range, from 30 deg to 90 deg')]),
    ([('zero = "0 deg"', 'range = ["30 deg", "90 deg"]'), ('phi = "20 deg"\n', "")],
     [(35, "start.phi", "is 0 if it is not given; must be an angle in driver.range")]),
    # drivers of other programs
    ([("[driver]", "[[driver]]"), ("[links.crank]", '[[driver]]\nlink = "rod"\n[links.crank]')],
     [(14, "driver", f"stands there 2 times; {FURTHER_DRIVERS}: write [driver]")]),
    ([("[driver]", "[[driver]]")], [(14, "driver", "is a list; write [driver]")]),
    ([("[driver]\nlink = \"crank\"\nzero = \"0 deg\"", "[driver]"), ("[driver]", "")],
     [(0, "driver", "the link that the motor turns")]),
    (added('[joints.mesh]\ntype = "gear"\non = "ram.C"\nby = "crank.A"\nratio = 3'),
     [(35, "joints.mesh.teeth", "is missing; must be two whole numbers > 0, the teeth of ram and of crank"),
      (39, "joints.mesh.ratio", "unknown key; known here")]),
    (added('[joints.mesh]\ntype = "belt"\non = "ram.C"\nby = "crank.A"'),
     [(35, "joints.mesh.diameters", "is missing; must be two lengths > 0, the pitch diameters of ram and of crank")]),
    (added('[joints.A]\non = "rod.A"\nby = "crank.A"\nfriction = 0.2\ndiameter = "30 mm"'),
     [(38, "joints.A.friction", "stands in [pins.A], or for all in [pins]"),
      (39, "joints.A.diameter", "stands in [pins.A], or for all in [pins]")]),
    ([('toward = "G2"', 'toward = "G2"\nfriction = 0.2')],
     [(32, "joints.guide.friction", "stands in [guides.guide], or for all in [guides]")]),
    # degrees of freedom and assembly
    ([("A = [0, 0], C", "Q = [0, 0], C")], [(21, "links.rod", "rod has one joint; add a joint")]),
    ([(GUIDE, "")], [(24, "links.ram", "too many degrees of freedom: 3")]),
    ([("[links.ram]", "[links.extra]\npoints = { C = [0, 0] }\n[links.ram]")],
     [(24, "links.extra", "has one joint")]),
    ([("[links.ram]", "[links.extra]\npoints = { Z = [0, 0] }\n[links.ram]")],
     [(24, "links.extra", "no joint")]),
    ([("[links.ram]", "[links.extra]\n[links.ram]")],
     [(24, "links.extra", "has no points; give points = {")]),
    (added('[joints.more]\non = "ram.T"\nby = "ground.G"'),
     [(24, "links.ram", "without the joint more the linkage closes all the way")]),
    ([('"80 mm", min', '"500 mm", min'), ('"200 mm"', '"2 m"')],
     [(21, "links.rod", "cannot close at 20 deg of crank")]),
    ([('"80 mm", min', '"360 mm", min'), ('"200 mm"', '"2 m"'), ('["25 mm"', "[0"), ('["25 mm"', "[0")],
     [(21, "links.rod", "comes to a dead position at")]),
    ([('"80 mm", min', '"360.5 mm", min'), ('"200 mm"', '"2 m"'), ('["25 mm"', "[0"), ('["25 mm"', "[0")],
     [(21, "links.rod", "cannot close at")]),
    ([(ROUGH, "")], [(35, "start", "does not place the links rod, ram: give the angle of rod")]),
    ([(ROUGH, "points = { Z = [0, 0] }")], [(37, "start.points.Z", "is no point of a link")]),
    ([(ROUGH, "points = { C = [0] }")], [(37, "start.points.C", "a list of two")]),
    ([(ROUGH, 'points = { A = ["q", 0], C = [0, "-356 mm"] }')], [(37, "start.points.A", "must be a number")]),
    ([(ROUGH, 'angles = { rode = "3 deg" }')], [(37, "start.angles.rode", 'was "rod" meant?')]),
    ([(ROUGH, "poses = { rod = [0, 0] }")], [(37, "start.poses.rod", "is [0, 0]; must be a list of three")]),
    # springs
    (added(f'{SPRING}\nby = "rod.C"\nstiffness = 3\nlength = 0'),
     [(35, "loads.s", "give points that move apart")]),
    (added(f'{SPRING}\nby = "ram.T"\ndamping = 3'),
     [(35, "loads.s", "give points of two links")]),
    (added(f'{SPRING}\nby = "ground.G"\nlength = 0\nstiffness = -3'),
     [(40, "loads.s.stiffness", "must be >= 0")]),
    (added(f'{SPRING}\nby = "ground.G"\nstiffness = 3'),
     [(35, "loads.s.length", "the length at which the spring has no force")]),
    (added(f'{SPRING}\nby = "ground.G"\nlength = 3'), [(35, "loads.s", "has neither stiffness nor damping")]),
    # angles that are meant in degrees
    ([('zero = "0 deg"', "zero = 90")], [(16, "driver.zero", f'{RADIANS}, write degrees as "90 deg"')]),
    ([('zero = "0 deg"', 'zero = "-90"')], [(16, "driver.zero", f'{RADIANS}, write degrees as "-90 deg"')]),
    ([('zero = "0 deg"', 'zero = "tilt"'), ("[parameters]", "[parameters]\ntilt = 30")],
     [(3, "parameters.tilt", f'{RADIANS}, write degrees as "30 deg"')]),
    ([('zero = "0 deg"', "range = [95, 100]")], [(16, "driver.range", f'{RADIANS}, write degrees as "95 deg"')]),
    ([('"0 deg", "120 deg", "240 deg"', "0, 120, 240")],
     [(7, "tables.share", f'{RADIANS}, write degrees as "120 deg"')]),
    ([('toward = "G2"', 'toward = "G2"\nangle = 90')],
     [(32, "joints.guide.angle", f'{RADIANS}, write degrees as "90 deg"')]),
    ([('phi = "20 deg"', "phi = 20")], [(36, "start.phi", f'{RADIANS}, write degrees as "20 deg"')]),
    ([(ROUGH, "angles = { rod = 22 }")], [(37, "start.angles.rod", f'{RADIANS}, write degrees as "22 deg"')]),
    ([(ROUGH, "poses = { rod = [0, 0, -22] }")],
     [(37, "start.poses.rod", f'{RADIANS}, write degrees as "-22 deg"')]),
    # names
    (called("lambda"), [(4, "parameters.lambda", "choose another name, such as lambda_1")]),
    (called("sin"), [(4, "parameters.sin", "has a meaning in expressions")]),
    (called("x"), [(4, "parameters.x", "has a meaning in expressions")]),
    (called("rod"), [(4, "parameters.rod", "is the name of a link, too")]),
    (called("tau"), [(4, "parameters.tau", "is a variable of every linkage")]),
    (called("mass_of_rod"), [(4, "parameters.mass_of_rod", "is a variable of every linkage")]),
    (called("share"), [(7, "tables.share", "is a name in [parameters], too")]),
    ([("[links.rod]", "[links.class]")], [(21, "links.class", "such as class_1")]),
    ([("[links.rod]", '[links."rod 2"]')], [(21, "links.rod 2", "letters, digits and _")]),
    ([("[joints.guide]", "[joints.if]")], [(28, "joints.if", "such as if_1")]),
    ([("[joints.guide]", "[joints.A]")], [(28, "joints.A", "rename the point or the joint")]),
    (point("angle"), [(25, "links.ram.points.angle", "is a variable of every link")]),
    (point("centroid"), [(25, "links.ram.points.centroid", "is a variable of every link")]),
    (point("is"), [(25, "links.ram.points.is", "such as is_1")]),
    # several at once
    ([*crank('"2 * R"'), ('"32 kg"', '"32 mm"'), ("toward =", "towards ="), ('l = "360 mm"', 'l = "360 mm"\nq = 3')],
     [(5, "parameters.q", ""), (19, "links.crank.points.A", ""),
      (27, "links.ram.mass", ""), (32, "joints.guide.towards", "")]),
]  # fmt: skip

FOUR_BARS = """\
[ground]
O1 = [0, 0]
O2 = [1, 0]
O3 = [1, 1]
O4 = [0, 1]
[driver]
link = "crank"
[links]
crank = { points = { O1 = [0, 0], A = [0.1, 0] } }
one = { points = { X = [0, 0], B = [0.2, 0], C = [0.1, 0.2] } }
two = { points = { X = [0, 0], D = [0.2, 0], E = [0.1, 0.2] } }
leg_b = { points = { A = [0, 0], B = [0.4, 0] } }
leg_c = { points = { O2 = [0, 0], C = [0.4, 0] } }
leg_d = { points = { O3 = [0, 0], D = [0.4, 0] } }
leg_e = { points = { O4 = [0, 0], E = [0.4, 0] } }
"""
SLIDES = """\
[ground]
O1 = [0, 0]
G = [1, 0]
G2 = [1, 1]
[driver]
link = "crank"
[links]
crank = { points = { O1 = [0, 0], S = [0, 0], S2 = [1, 0] } }
block = { points = { B = [0, 0], T = [0, 0], T2 = [0, 1] } }
ram = { points = { C = [0, 0] } }
[joints]
one = { on = "block.B", by = "crank.S", toward = "S2" }
two = { on = "ram.C", by = "block.T", toward = "T2" }
three = { on = "ram.C", by = "ground.G", toward = "G2" }
"""
TRIAD = """\
[ground]
O1 = [0, 0]
O2 = [1, 0]
G = [1, 1]
G2 = [2, 1]
[driver]
link = "crank"
[links]
crank = { points = { O1 = [0, 0], A = [0.1, 0] } }
plate = { points = { B = [0, 0], C = [0.3, 0], S = [0, 0.3], S2 = [1, 0.3] } }
leg_b = { points = { A = [0, 0], B = [0.5, 0] } }
leg_c = { points = { O2 = [0, 0], C = [0.5, 0] } }
leg_s = { points = { P = [0, 0], Q = [0.1, 0] } }
[joints]
rail = { on = "leg_s.P", by = "ground.G", toward = "G2" }
slot = { on = "leg_s.Q", by = "plate.S", toward = "S2", angle = "30 deg" }
"""
FIVE_BAR = """\
[ground]
A = [0, 0]
E = [12, 0]
[driver]
link = "left"
[links]
left = { points = { A = [0, 0], B = [4, 0] } }
lower = { points = { B = [0, 0], C = [10, 0] } }
right = { points = { E = [0, 0], D = [4, 0] } }
upper = { points = { D = [0, 0], C = [10, 0] } }
"""
EXCAVATOR = """\
[ground]
O = [0, 0]
F = [0.2, -0.3]
[driver]
joint = "boom_cylinder"
range = ["1.2 m", "1.9 m"]
[links]
boom = { points = { O = [0, 0], G = [1.6, 0.4], S = [3.2, 0], H = [1.8, 0.6] } }
stick = { points = { S = [0, 0], K = [-0.5, 0.2], B = [1.6, 0] } }
barrel1 = { points = { F = [0, 0], X = [1, 0] } }
rod1 = { points = { G = [0, 0] } }
barrel2 = { points = { H = [0, 0], Y = [1, 0] } }
rod2 = { points = { K = [0, 0] } }
[joints]
boom_cylinder = { on = "rod1.G", by = "barrel1.F", toward = "X" }
stick_cylinder = { on = "rod2.K", by = "barrel2.H", toward = "Y" }
[start]
phi = "1.5 m"
"""
BRANCHES = """\
[ground]
O1 = [0, 0]
O2 = ["600 mm", "400 mm"]
[driver]
link = "crank"
[links]
crank = { points = { O1 = [0, 0], A = ["50 mm", 0] } }
coupler = { points = { A = [0, 0], B = ["600 mm", 0] } }
rocker = { points = { O2 = [0, 0], B = ["400 mm", 0] } }
[start]
points = { B = ["300 mm", "200 mm"] }
"""
SLOT = """\
[ground]
O1 = [0, "300 mm"]
O2 = [0, 0]
[driver]
link = "crank"
[links]
crank = { points = { O1 = [0, 0], A = ["100 mm", 0] } }
block = { points = { A = [0, 0] } }
arm = { points = { O2 = [0, 0], E = ["600 mm", 0] } }
[joints.slot]
on = "block.A"
by = "arm.O2"
toward = "E"
[start]
angles = { arm = "-10 deg" }
"""
STUDY = '[machine]\nr = "150 mm"\n[run]\nturns = 3\n'

# whole files
FILES = [
    (FOUR_BARS,
     [(10, "links.one", "the links one, two, leg_b, leg_c, leg_d, leg_e form one group with 6 links")]),
    (SLIDES, [(9, "links.block", "three sliding joints, one, two and three")]),
    (TRIAD, [(13, "links.leg_s", "slides in both of its joints, rail and slot")]),
    (FIVE_BAR, [(8, "links.lower", f"motors or cylinders move the machine, {FURTHER_DRIVERS}; else add a joint")]),
    (EXCAVATOR, [(9, "links.stick", f"motors or cylinders move the machine, {FURTHER_DRIVERS}; else add")]),
    (BRANCHES, [(11, "start.points.B", '["237.8 mm", "569.8 mm"] or ["650 mm", "3.136 mm"]')]),
    (SLOT, [(15, "start.angles.arm", '"71.57 deg" or "-108.4 deg"')]),
    ("", [(0, "links", "give at least the link that the driver turns")]),
    (STUDY, [(1, "machine", "run a study file with chainunit study")]),
    ("hello world", [(1, "no valid TOML", "has no tables and keys")]),
    (PRESS.replace('"press"', '"pre\\u0001ss"'), [(1, "title", "has U+0001, which is no sign")]),
    (PRESS + '[about]\nauthor = "a\\uFFFFb"\n', [(39, "about.author", "U+FFFF")]),
    ('{"a": 1}', [(1, "no valid TOML", "it is JSON")]),
    (PRESS + "[links.rod]\nmass = 3\n", [(38, "no valid TOML", "first in line 21")]),
]  # fmt: skip
