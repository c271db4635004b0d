"""An independent solution of a described linkage: Newton's method on the equations of all joints, and Lagrange
multipliers, with numpy alone. It shares no line with the package: neither groups nor expressions nor loads.

The unknowns are x, y and angle of the frame of each link. A revolute joint closes two points; a sliding one holds the
point of `on` on the line of `by`, and the angle between both links; two wheels in mesh move alike along their common
tangent at the pitch point; a cam has the angle of its profile at the contact as a further unknown, and two equations:
that the centre of the roller lies on the pitch curve, or that the profile meets the face and has its direction there;
each driver has an equation after all these. A multiplier is the force (of a sliding joint
the force across its line and the moment about the point) on `on` from `by`.
"""

from __future__ import annotations

import math

import numpy as np

FUNCTIONS = {name: getattr(math, name) for name in "sin cos tan sqrt asin acos atan2".split()}
FUNCTIONS |= {"abs": abs, "min": min, "max": max, "pi": math.pi, "deg": math.pi / 180.0}


def turned(v):
    return np.array([-v[1], v[0]])


def rotation(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


class Multibody:
    """A linkage from its description; `inputs` have values by name. `wheels` has the wheel of each gear that
    has its rough angle at the start. `profiles` has for each cam the rough angle of its profile at the contact at the
    start, and the radius over that angle with two derivatives, a function that takes complex numbers. `springs` has
    for joints that yield the stiffness [N/m], and the two points of a link between which a pin yields, or None for a
    guide, which yields across its line: the joints may then be more than needed."""

    def __init__(self, data, inputs=None, wheels=None, profiles=None, springs=None):
        self.data, self.profiles, self.springs = data, profiles or {}, springs or {}
        self.values = {each["name"]: each["value"] for each in (*data["parameters"], *data["inputs"])}
        self.values |= {"g": data["common"].get("g", 9.81), "ratio": 1.0}
        for link in data["links"]:
            self.values |= {f"{name}_of_{link['name']}": value for name, value in link["own"].items()}
        self.values |= inputs or {}
        self.names = [link["name"] for link in data["links"]]
        self.points = {"ground": {name: self.vector(at) for name, at in data["ground"].items()}}
        self.bodies = []
        for link in data["links"]:
            points = self.points[link["name"]] = {
                name: self.vector(at) for name, at in link["points"].items()
            }
            self.bodies.append(
                (
                    link["name"],
                    self.vector(link.get("centroid", (0, 0))),
                    self.number(link.get("mass", 0)),
                    self.number(link.get("inertia", 0)),
                )
            )
            for point, mass in link["masses"].items():
                self.bodies.append((link["name"], points[point], self.number(mass), 0.0))
        self.drivers = [data["driver"], *data.get("drivers", ())]
        driven = [driver["joint"] for driver in self.drivers]
        self.joints = sorted(data["joints"], key=lambda joint: joint["name"] in driven)
        self.start = data["start"]["value"]
        self.rough = np.array([data["start"]["poses"][name] for name in self.names], float).ravel()
        self.rough = np.append(self.rough, [angle for angle, _ in self.profiles.values()])
        self.wheels, self.phases = wheels or {}, {}
        if self.wheels:
            x = self.closed(self.start, self.rough)
            phases = {joint["name"]: self.lag(x, joint) for joint in self.joints if joint["type"] == "gear"}
            phases |= {
                joint["name"]: self.belt(x, joint)[0] for joint in self.joints if joint["type"] == "belt"
            }
            for joint in self.joints:
                if joint["type"] == "rack":
                    d, radius = self.pitch_line(x, joint)
                    (p, _), (c, _) = (self.place(x, *self.end(joint, end)) for end in ("on", "by"))
                    phases[joint["name"]] = d @ (p - c) + radius * self.angle(x, joint["by"][0])[0]
            self.phases = phases

    def number(self, entry, **more):
        """The value of an entry."""
        if isinstance(entry, str):
            return eval(entry, {"__builtins__": {}}, FUNCTIONS | self.values | more)
        return float(entry)

    def vector(self, entries):
        """The value of a point."""
        return np.array([self.number(each) for each in entries])

    def columns(self, link):
        """Where the unknowns of a link stand."""
        k = 3 * self.names.index(link)
        return slice(k, k + 3)

    def place(self, x, link, local):
        """A point in the frame, and its matrix of derivatives by the unknowns."""
        by = np.zeros((2, x.size), x.dtype)
        if link == "ground":
            return local.astype(x.dtype), by
        at = x[self.columns(link)]
        arm = rotation(at[2]) @ local
        by[:, self.columns(link)] = np.column_stack([np.eye(2), turned(arm)])
        return at[:2] + arm, by

    def angle(self, x, link):
        """The angle of a link, and its derivatives."""
        by = np.zeros(x.size, x.dtype)
        if link == "ground":
            return 0.0, by
        by[self.columns(link).start + 2] = 1.0
        return x[self.columns(link)][2], by

    def line(self, x, joint):
        """The direction of a sliding joint in the frame."""
        link, start = joint["by"]
        way = self.points[link][joint["toward"]] - self.points[link][start]
        return rotation(self.angle(x, link)[0]) @ (way / np.hypot(*way))

    def mesh(self, x, joint):
        """Of two wheels: the pitch point, the unit tangent of the pitch circles, and the radius of `on`; it is below
        0 where the pitch point lies beyond its centre, as seen from that of `by`."""
        teeth, inner = joint["teeth"], joint["internal"]
        (c, _), (e, _) = (self.place(x, *self.end(joint, end)) for end in ("on", "by"))
        distance = np.sqrt((e - c) @ (e - c))
        radius = distance * teeth[0] / (teeth[0] + (-1 if inner else 1) * teeth[1])
        return c + (e - c) / distance * radius, turned(e - c) / distance, radius

    def pitch_line(self, x, joint):
        """Of a rack in the ground: its direction, and how far to the left of the centre of its pinion it lies."""
        guide = next(each for each in self.joints if each["name"] == joint["guide"])
        d = self.line(x, guide)
        (p, _), (c, _) = (self.place(x, *self.end(joint, end)) for end in ("on", "by"))
        return d, turned(d) @ (p - c)

    def belt(self, x, joint):
        """How far a belt has run off the pulley `on` and not onto that of `by`, and its derivatives by the unknowns:
        the pulleys wind it, and so does the line of their centres as it turns around both."""
        r, s = (0.5 * diameter for diameter in joint["diameters"])
        s = -s if joint["crossed"] else s
        (c, c_by), (e, e_by) = (self.place(x, *self.end(joint, end)) for end in ("on", "by"))
        (on, on_by), (by, by_by) = (self.angle(x, joint[end][0]) for end in ("on", "by"))
        turn_by = turned(e - c) @ (e_by - c_by) / ((e - c) @ (e - c))
        arm = self.angle(x, joint["third"])[0]
        return r * on - s * by + (s - r) * arm, r * on_by - s * by_by + (s - r) * turn_by

    def at_the_start(self, x, joint):
        """The gap of the wheel of a gear at the start, or of the rack, which has its rough place."""
        wheel = self.wheels[joint["name"]]
        if wheel == joint["by"][0]:
            angle, row = self.angle(x, wheel)
            return angle - self.rough[self.columns(wheel)][2], row
        p, by = self.place(x, *self.end(joint, "on"))
        d, _ = self.pitch_line(x, joint)
        return d @ (p - self.place(self.rough, *self.end(joint, "on"))[0]), d @ by

    def contact(self, x, joint):
        """The gaps of a cam and its follower, and their derivatives by the unknowns."""
        k = x.size - len(self.profiles) + [*self.profiles].index(joint["name"])
        s, radius = x[k], self.profiles[joint["name"]][1]
        r, r1, r2 = radius(s)
        u = np.array([np.cos(s), np.sin(s)])
        t = turned(u)
        point, slope, bend = r * u, r1 * u + r * t, (r2 - r) * u + 2.0 * r1 * t
        cam, (on, _) = joint["by"][0], joint["on"]
        turn = rotation(self.angle(x, cam)[0])
        f, f_by = self.place(x, *self.end(joint, "on"))
        if joint["face"]:
            h, h_by = self.place(x, on, self.points[on][joint["face"]])
            m, m_by = turned(h - f), np.array([-(h_by - f_by)[1], (h_by - f_by)[0]])
            q, q_by = self.place(x, cam, self.points[cam][joint["by"][1]] + point)
            d, d_by = turn @ slope, np.outer(turned(turn @ slope), self.angle(x, cam)[1])
            q_by[:, k], d_by[:, k] = turn @ slope, turn @ bend
            return [m @ (f - q), m @ d], [-m @ (q_by - f_by) - (q - f) @ m_by, m @ d_by + d @ m_by]
        roller = 0.0 if joint["pitch"] else self.number(joint["roller"])
        size = np.sqrt(slope @ slope)
        n, n1 = -turned(slope) / size, -turned(bend) / size + turned(slope) * (slope @ bend) / size**3
        q, q_by = self.place(x, cam, self.points[cam][joint["by"][1]] + point + roller * n)
        q_by[:, k] = turn @ (slope + roller * n1)
        return [*(f - q)], [*(f_by - q_by)]

    def end(self, joint, end):
        """The link and the place of an end of a joint."""
        link, name = joint[end]
        return link, self.points[link][name]

    def lag(self, x, joint):
        """The angle of the wheel `on` less the one that the teeth alone would give it."""
        on, by, arm = (self.angle(x, link)[0] for link in (joint["on"][0], joint["by"][0], joint["third"]))
        ratio = joint["teeth"][1] / joint["teeth"][0] * (1 if joint["internal"] else -1)
        return on - arm - ratio * (by - arm)

    def equations(self, x, q):
        """Misfits of all joints and of the drivers at their places `q`, and their derivatives by the unknowns."""
        gaps, rows = [], []
        for joint in self.joints:
            if joint["type"] == "gear":
                point, tangent, radius = self.mesh(x, joint)
                row = np.zeros(x.size, x.dtype)
                for end, sign in (("on", 1.0), ("by", -1.0)):
                    if joint[end][0] != "ground":
                        columns = self.columns(joint[end][0])
                        arm = point - x[columns][:2]
                        row[columns] += sign * np.array([*tangent, arm[0] * tangent[1] - arm[1] * tangent[0]])
                wheel = self.wheels[joint["name"]]
                if joint["name"] in self.phases:
                    gaps.append(radius * (self.lag(x, joint) - self.phases[joint["name"]]))
                else:
                    angle, row = self.angle(x, wheel)
                    gaps.append(angle - self.rough[self.columns(wheel)][2])
                rows.append(row)
                continue
            if joint["type"] == "belt":
                gap, row = self.belt(x, joint)
                gap -= self.phases.get(joint["name"], 0.0)
                if joint["name"] not in self.phases:
                    gap, row = self.angle(x, self.wheels[joint["name"]])
                    gap -= self.rough[self.columns(self.wheels[joint["name"]])][2]
                gaps, rows = [*gaps, gap], [*rows, row]
                continue
            if joint["type"] == "rack":
                d, radius = self.pitch_line(x, joint)
                (p, p_by), (c, c_by) = (self.place(x, *self.end(joint, end)) for end in ("on", "by"))
                angle, by = self.angle(x, joint["by"][0])
                rows.append(d @ (p_by - c_by) + radius * by)
                gaps.append(d @ (p - c) + radius * angle - self.phases.get(joint["name"], 0.0))
                if joint["name"] not in self.phases:
                    gaps[-1], rows[-1] = self.at_the_start(x, joint)
                continue
            if joint["type"] == "cam":
                gap, row = self.contact(x, joint)
                gaps, rows = [*gaps, *gap], [*rows, *row]
                continue
            (p, p_by), (r, r_by) = (self.place(x, *self.end(joint, end)) for end in ("on", "by"))
            if joint["type"] == "revolute":
                gaps += [*(p - r)]
                rows += [*(p_by - r_by)]
                continue
            d = self.line(x, joint)
            n = turned(d)
            (one, one_by), (other, other_by) = (self.angle(x, joint[end][0]) for end in ("on", "by"))
            gaps += [(p - r) @ n, one - other - self.number(joint["angle"])]
            rows += [n @ (p_by - r_by) - (p - r) @ d * other_by, one_by - other_by]
        for driver, place in zip(self.drivers, np.atleast_1d(q), strict=True):
            if driver["linear"]:
                joint = next(joint for joint in self.joints if joint["name"] == driver["joint"])
                (p, p_by), (r, r_by) = (self.place(x, *self.end(joint, end)) for end in ("on", "by"))
                d = self.line(x, joint)
                other_by = self.angle(x, joint["by"][0])[1]
                gaps.append((p - r) @ d - place)
                rows.append(d @ (p_by - r_by) + (p - r) @ turned(d) * other_by)
            else:
                angle, by = self.angle(x, driver["link"])
                # a motor between two links turns them against each other
                ends = next([j["on"][0], j["by"][0]] for j in self.joints if j["name"] == driver["joint"])
                (other,) = {*ends} - {driver["link"]}
                angle, by = angle - self.angle(x, other)[0], by - self.angle(x, other)[1]
                gaps.append(angle - self.number(driver["zero"]) - driver["sense"] * place)
                rows.append(by)
        return np.array(gaps), np.array(rows)

    def closed(self, q, near, steps=30):
        """The pose at the driver's place `q`, by Newton's method from a pose that is nearly right; None where it does
        not lead to one."""
        x = np.array(near, float)
        for _ in range(steps):
            gaps, rows = self.equations(x, q)
            # angles hold but for whole turns
            for k in self.angular:
                gaps[k] = math.remainder(gaps[k], 2.0 * math.pi)
            step = self.solved(rows, gaps)
            x = x - step
            if np.max(np.abs(step)) < 1e-13:
                return x
        return x if np.max(np.abs(step)) < 1e-11 else None

    def solved(self, rows, right):
        """The unknowns of rows, of which some may be redundant."""
        if not self.springs:
            return np.linalg.solve(rows, right)
        x, _, rank, _ = np.linalg.lstsq(rows, right, rcond=1e-13)
        assert rank == rows.shape[1]
        return x

    def factors(self, rows, right, x):
        """The multipliers of all rows, which carry the `right` sides. With springs the unknowns move by z, so that
        rows z is the compliance times the multipliers."""
        if not self.springs:
            return np.linalg.solve(rows.T, right)
        count, size = rows.shape
        compliance, k = np.zeros((count, count)), 0
        for joint in self.joints:
            if joint["name"] in self.springs:
                stiffness, ends = self.springs[joint["name"]]
                d = np.array([1.0, 0.0])  # of a guide the first row is across its line
                if ends is not None:
                    link, *names = ends
                    a, b = (self.place(x, link, self.points[link][name])[0] for name in names)
                    d = (b - a) / np.hypot(*(b - a))
                compliance[k : k + 2, k : k + 2] = np.outer(d, d) / stiffness
            k += 2
        unit = min((stiffness for stiffness, _ in self.springs.values()))
        whole = np.block([[-compliance * unit, rows], [rows.T, np.zeros((size, size))]])
        return np.linalg.solve(whole, np.append(np.zeros(count), right))[:count]

    @property
    def angular(self):
        """The numbers of the equations of angles."""
        found, k = set(), 0
        for joint in self.joints:
            k += 1 if joint["type"] in ("gear", "belt", "rack") else 2
            if joint["type"] == "prismatic":
                found.add(k - 1)
        return found | {k + n for n, driver in enumerate(self.drivers) if not driver["linear"]}

    def followed(self, q, most=0.1):
        """The pose at `q`, followed from the start in small steps."""
        start = np.array([self.start, *(driver["start"] for driver in self.drivers[1:])])
        q = np.atleast_1d(q)
        x = self.closed(start, self.rough)
        count = max(1, math.ceil(np.max(np.abs(q - start)) / most))
        for k in range(1, count + 1):
            assert x is not None
            x = self.closed(start + (q - start) * k / count, x, 12)
        return x

    def solution(self, x, q, w, a):
        """Torque, reactions and motion at the pose `x`: outputs by the names of the package; `q`, `w` and `a` are of
        the driver, or of all drivers, whose efforts are ``tau`` and the name of each with ``.tau``."""
        size = x.size
        _, rows = self.equations(x, q)
        q, w, a = (np.atleast_1d(each).astype(float) for each in (q, w, a))
        signs = np.array([1.0 if driver["linear"] else driver["sense"] for driver in self.drivers])
        by_q = np.zeros((len(rows), signs.size))
        by_q[-signs.size :] = np.diag(signs)
        v = self.solved(rows, by_q @ w)
        # rows(x) v = by_q w, so that rows x'' = by_q a - (rows along v) v
        along = self.equations(x.astype(complex) + 1e-30j * v, q)[1].imag / 1e-30
        accel = self.solved(rows, by_q @ a - along @ v)
        q, w = q[0], w[0]

        def motion(link, local):
            p, by = self.place(x, link, local)
            turn = self.place(x.astype(complex) + 1e-30j * v, link, local)[1].imag / 1e-30
            return p, by, by @ v, by @ accel + turn @ v

        needed, applied, load_power = np.zeros(size), np.zeros(size), 0.0
        g = self.values["g"]
        kinetic = potential = 0.0
        for link, local, mass, inertia in self.bodies:
            p, by, speed, growth = motion(link, local)
            turn = self.angle(x, link)[1]
            needed += by.T @ (mass * (growth + np.array([0.0, g]))) + turn * inertia * (turn @ accel)
            kinetic += 0.5 * mass * speed @ speed + 0.5 * inertia * (turn @ v) ** 2
            potential += mass * g * p[1]
        for load in self.data["loads"]:
            if load["type"] == "spring":
                (p, p_by, pv, _), (r, r_by, rv, _) = (
                    motion(link, self.points[link][name]) for link, name in (load["on"], load["by"])
                )
                length = np.hypot(*(r - p))
                d = (r - p) / length
                stiffness, free, damping = (self.number(load[k]) for k in ("stiffness", "length", "damping"))
                pull = stiffness * (length - free) + damping * d @ (rv - pv)
                applied += (p_by - r_by).T @ (d * pull)
                potential += 0.5 * stiffness * (length - free) ** 2
                continue
            link = load["on"][0]
            angle, turn = self.angle(x, link)
            known = {"phi": q, "w": w, "angle_rate": turn @ v}
            if load["type"] == "torque":
                torque = self.number(load["torque"], **known)
                applied += turn * torque
                load_power += torque * (turn @ v)
                continue
            p, by, speed, _ = motion(link, self.points[link][load["on"][1]])
            known |= {"x": p[0], "y": p[1], "vx": speed[0], "vy": speed[1]}
            force = np.array([self.number(each, **known) for each in load["force"]])
            if load["type"] == "follower":
                force = rotation(angle) @ force
            applied += by.T @ force
            load_power += force @ speed
        factors = self.factors(rows, needed - applied, x)
        found = {"kinetic_energy": kinetic, "potential_energy": potential, "load_power": load_power}
        names = ("tau", *(f"{driver['name']}.tau" for driver in self.drivers[1:]))
        found |= dict(zip(names, factors[-signs.size :] * signs, strict=True))
        left = iter(factors)
        for joint in self.joints:
            one, name = next(left), joint["name"]
            if joint["type"] == "belt":
                (c, _), (e, _) = (self.place(x, *self.end(joint, end)) for end in ("on", "by"))
                force = (e - c) / np.hypot(*(e - c)) * one
                found |= {f"{name}.fx": force[0], f"{name}.fy": force[1]}
                continue
            if joint["type"] in ("gear", "rack"):
                force = (
                    self.mesh(x, joint)[1] if joint["type"] == "gear" else self.pitch_line(x, joint)[0]
                ) * one
                found |= {f"{name}.fx": force[0], f"{name}.fy": force[1]}
                continue
            two = next(left)
            if joint["type"] == "cam":
                force = np.array([one, two])
                if joint["face"]:
                    (f, *_), (h, *_) = (self.place(x, joint["on"][0], self.points[joint["on"][0]][name_of])
                                        for name_of in (joint["on"][1], joint["face"]))  # fmt: skip
                    force = turned(h - f) * one
                found |= {f"{name}.fx": force[0], f"{name}.fy": force[1]}
                continue
            if joint["type"] == "revolute":
                found |= {f"{name}.fx": one, f"{name}.fy": two}
                continue
            force = turned(self.line(x, joint)) * one
            found |= {f"{name}.fx": force[0], f"{name}.fy": force[1], f"{name}.normal": one}
            found[f"{name}.moment"] = two
            d = self.line(x, joint)
            (p, _, pv, _), (r, _, rv, _) = (
                motion(link, self.points[link][point]) for link, point in (joint["on"], joint["by"])
            )
            spin = self.angle(x, joint["by"][0])[1] @ v
            found[f"{name}.s"] = (p - r) @ d
            found[f"{name}.v"] = (pv - rv) @ d + (p - r) @ turned(d) * spin
        for link in self.names:
            _, turn = self.angle(x, link)
            found |= {f"{link}.w": turn @ v, f"{link}.a": turn @ accel}
            found[f"{link}.angle"] = self.angle(x, link)[0]
            for point, local in self.points[link].items():
                p, _, speed, growth = motion(link, local)
                names = (f"{link}.{point}.{key}" for key in "x y vx vy ax ay".split())
                found |= dict(zip(names, (*p, *speed, *growth), strict=True))
        return found
