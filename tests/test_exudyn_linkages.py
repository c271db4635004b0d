"""One turn of three linkages from files in an independent engine, exudyn: a quick return (RPR and RRP), a Blake
crusher and a Stephenson six-bar, as rigid bodies in absolute coordinates.

Compared relative to the peak of a quantity over the turn: place and speed of every centroid, the torque, and all
reactions, force and moment of the guides included. From the model exudyn takes pose and speeds at the start; see
`test_exudyn` for the method, and for what its multipliers miss.

Measured, the largest of all quantities and points of time: 5.1e-6 with 2000 steps, of the reaction at C of the quick
return; extrapolated to no step 2e-11 of the motion, and 3.2e-8 of torque and reactions.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from linkage_files import MACHINES, model

from chainunit.machines.machine import Machine

pytestmark = pytest.mark.slow

exudyn = pytest.importorskip("exudyn")
item = pytest.importorskip("exudyn.itemInterface")

W = 4.0
TURN = 2.0 * math.pi / W
STEPS = 1000
NAMES = ["crank_shaper", "blake_crusher", "stephenson_iii"]


class Bodies:
    """The bodies of a described machine, a mass at a point as part of its body: mass, centroid, inertia about it."""

    def __init__(self, d):
        self.points = {b["name"]: {n: np.array(at) for n, at in b["points"].items()} for b in d["bodies"]}
        self.points["ground"] = {n: np.array(at) for n, at in d["ground"].items()}
        self.of = {}
        for b in d["bodies"]:
            name = b["name"]
            parts = [(b["mass"], np.array(b["centroid"]))]
            parts += [(m["mass"], self.points[name][m["point"]]) for m in d["masses"] if m["body"] == name]
            mass = sum(m for m, _ in parts)
            center = sum(m * at for m, at in parts) / mass
            inertia = b["inertia"] + sum(m * np.sum((at - center) ** 2) for m, at in parts)
            self.of[name] = mass, center, inertia
        self.of["ground"] = 0.0, np.zeros(2), 0.0

    def local(self, link, point):
        """A point from the centroid."""
        return self.points[link][point] - self.of[link][1]


def rotation(angle):
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s], [s, c]])


def frame_along(d):
    """The rotation of a joint's frame in space, whose x axis has the direction `d`."""
    return [[d[0], -d[1], 0.0], [d[1], d[0], 0.0], [0.0, 0.0, 1.0]]


def turned_by_exudyn(d, start, steps):
    """Every compared output over one turn, at the start and after each step; `start` are the outputs there."""
    bodies, mbs, found = Bodies(d), exudyn.SystemContainer().AddSystem(), {}
    found["ground"] = mbs.AddObject(item.ObjectGround())
    nodes = {}
    for name, (mass, center, inertia) in bodies.of.items():
        if name == "ground":
            continue
        first = next(iter(bodies.points[name]))
        angle, spin = start[f"{name}.angle"], start[f"{name}.w"]
        arm = rotation(angle) @ (center - bodies.points[name][first])
        at = [start[f"{name}.{first}.{k}"] + x for k, x in zip("xy", arm, strict=True)]
        turn = spin * np.array([-arm[1], arm[0]])
        speed = [start[f"{name}.{first}.{k}"] + x for k, x in zip(("vx", "vy"), turn, strict=True)]
        nodes[name] = mbs.AddNode(
            item.NodeRigidBody2D(initialCoordinates=[*at, angle], initialVelocities=[*speed, spin])
        )
        body = item.ObjectRigidBody2D(mass=mass, inertia=inertia, nodeNumber=nodes[name])
        found[name] = mbs.AddObject(body)
        weighed = mbs.AddMarker(item.MarkerBodyMass(bodyNumber=found[name]))
        mbs.AddLoad(item.LoadMassProportional(markerNumber=weighed, loadVector=[*d["gravity"], 0.0]))

    def marker(end, kind=item.MarkerBodyPosition):
        return mbs.AddMarker(kind(bodyNumber=found[end[0]], localPosition=[*bodies.local(*end), 0.0]))

    def framed(end, rotated):
        at = exudyn.HT(rotation=rotated, translation=[*bodies.local(*end), 0.0])
        return mbs.AddMarker(item.MarkerBodyRigid(bodyNumber=found[end[0]], localHT=at))

    def sensor(kind, what, **of):
        what = getattr(exudyn.OutputVariableType, what)
        return mbs.AddSensor(kind(outputVariableType=what, storeInternal=True, writeToFile=False, **of))

    sensors = {}
    for joint in d["joints"]:
        name, on, by = joint["name"], joint["on"], joint["by"]
        if joint["type"] == "revolute":
            number = mbs.AddObject(item.ObjectJointRevolute2D(markerNumbers=[marker(on), marker(by)]))
            sensors[name] = sensor(item.SensorObject, "Force", objectNumber=number)
            continue
        way = bodies.points[by[0]][joint["toward"]] - bodies.points[by[0]][by[1]]
        along = way / np.hypot(*way)
        turn = joint.get("angle", 0.0)
        frames = frame_along(along), frame_along(rotation(-turn) @ along)
        ends = [framed(end, frame) for end, frame in zip((by, on), frames, strict=True)]
        number = mbs.AddObject(
            item.ObjectJointGeneric(markerNumbers=ends, constrainedAxes=[0, 1, 0, 0, 0, 1])
        )
        for what in ("ForceLocal", "TorqueLocal"):
            sensors[f"{name} {what}"] = sensor(item.SensorObject, what, objectNumber=number)
    fixed = mbs.AddNode(item.NodePointGround())
    zero = mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=fixed, coordinate=0))
    driven = mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=nodes[d["driver"]["body"]], coordinate=2))
    drive = item.ObjectConnectorCoordinate(markerNumbers=[zero, driven], velocityLevel=True, offset=W)
    sensors["tau"] = sensor(item.SensorObject, "Force", objectNumber=mbs.AddObject(drive))
    for load in d["loads"]:
        force, own = [*load["force"], 0.0], load["type"] == "follower"
        at = marker(load["on"], item.MarkerBodyRigid if own else item.MarkerBodyPosition)
        mbs.AddLoad(item.LoadForceVector(markerNumber=at, loadVector=force, bodyFixed=own))
    for name in nodes:
        for what in ("Position", "Velocity"):
            sensors[f"{name} {what}"] = sensor(item.SensorNode, what, nodeNumber=nodes[name])
    mbs.Assemble()

    settings = exudyn.SimulationSettings()
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = 0.0
    time = settings.timeIntegration
    time.numberOfSteps, time.endTime, time.adaptiveStep = steps, TURN, False
    time.newton.relativeTolerance, time.newton.absoluteTolerance = 1e-10, 1e-12
    time.newton.numericalDifferentiation.relativeEpsilon = 1e-8
    mbs.SolveDynamic(settings, solverType=exudyn.DynamicSolverType.TrapezoidalIndex2)
    return {name: mbs.GetSensorStoredData(number) for name, number in sensors.items()}


def course(rows, joints):
    """The rows of exudyn by the names of our outputs.

    Exudyn's force of a pin is the one on the part of its first marker, that of a slide the one on the part with the
    line. The condition on the angles is one on two axes, which falls where the angle of the block grows.
    """
    got = {"tau": -rows["tau"][:, 1]}
    for joint in joints:
        name = joint["name"]
        if joint["type"] == "revolute":
            found = {"fx": rows[name][:, 1], "fy": rows[name][:, 2]}
        else:
            found = {"normal": -rows[f"{name} ForceLocal"][:, 2], "moment": rows[f"{name} TorqueLocal"][:, 3]}
        # our output J is the reflected inertia
        got |= {f"{name}_joint.{k}" if name == "J" else f"{name}.{k}": v for k, v in found.items()}
    for name, values in rows.items():
        link, _, what = name.partition(" ")
        if what in ("Position", "Velocity"):
            keys = "xy" if what == "Position" else ("vx", "vy")
            got |= {f"{link}.centroid.{k}": values[:, n] for n, k in enumerate(keys, 1)}
    return got


@pytest.mark.parametrize("name", NAMES)
def test_one_turn(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(exudyn.config, "printToConsole", False)
    d = MACHINES[name]["description"]
    machine = Machine(model(name))
    found = machine.evaluate({"phi": np.linspace(0.0, 2.0 * math.pi, 2 * STEPS + 1), "w": W, "a": 0.0})
    ours = {key: np.broadcast_to(value, 2 * STEPS + 1) for key, value in found.items()}
    start = {key: float(value[0]) for key, value in ours.items()}
    coarse, fine = (course(turned_by_exudyn(d, start, n), d["joints"]) for n in (STEPS, 2 * STEPS))
    assert len(fine) == 1 + sum(2 for _ in d["joints"]) + 4 * len(d["bodies"])
    for key in fine:
        size = np.max(np.abs(ours[key]))
        if size == 0.0:  # the speed of a ram across its guide
            assert np.max(np.abs(fine[key])) < 1e-12, key
            continue
        # the multipliers alternate about their course: every second one of either run
        one, two = (coarse[key] - ours[key][::2])[::2] / size, (fine[key] - ours[key])[::4] / size
        # the error of the steps falls with their square; what is left does not depend on them
        assert np.max(np.abs(two)) < 6e-6, key
        if np.max(np.abs(two)) > 1e-8:
            assert 3.8 < np.max(np.abs(one)) / np.max(np.abs(two)) < 4.2, key
        assert np.max(np.abs(4.0 * two - one)) / 3.0 < (1e-10 if ".centroid." in key else 1e-7), key
