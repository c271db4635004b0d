"""One turn of the knife drive in an independent engine, exudyn: seven rigid bodies in absolute coordinates.

Compared with `KnifeDrive`, relative to the lesser of a quantity's peak and its range over the turn: place, speed and
tilt of the blade, the torque, and both components of all ten reactions; without and with a force on the blade. From
the model exudyn takes pose and speeds at the start; the motion afterwards and the multipliers are its own, by the
trapezoidal rule on constraints of speed (index 2). The poses too err by the square of the step, as nothing but the
integral of the speeds holds them.

Measured, the largest of all quantities and points of time:

=======================  =======  ====================
..                       motion   torque and reactions
=======================  =======  ====================
2000 steps               8.9e-7   4.4e-6
4000 steps               2.2e-7   1.1e-6
extrapolated to no step  2e-12    2.1e-8
=======================  =======  ====================

What is left of the forces does not depend on the step: exudyn finds the accelerations at the start by numerical
differentiation, and the rule carries what they miss on undamped, with alternating sign.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from chainunit.core.engines import MATH, numpy_
from chainunit.machines.knife_drive import KnifeDrive
from chainunit.mechanism.machine import Mechanism

pytestmark = pytest.mark.slow

exudyn = pytest.importorskip("exudyn")
item = pytest.importorskip("exudyn.itemInterface")

W = 4.0
TURN = 2.0 * math.pi / W
STEPS = 2000
P = KnifeDrive.parameter_layout.from_names({})
BODIES = "crank coupler rocker leg_b leg_3 leg_4 knife".split()
NAMES = [name for part in KnifeDrive.parts for name in part.layout.names]


def along(body, s=0.0):
    return body, s, 0.0


def place(body, point):
    return body, point.x, point.y


# reaction: the part that it acts on and the part that it comes from, each with the pin in its own frame
PINS = {
    "crank_bearing": (along("crank"), place("frame", P.o1)),
    "crank_pin": (along("coupler"), along("crank", P.r)),
    "coupler_pin": (along("coupler", P.ab), along("rocker", P.bo2)),
    "leg_pin": (along("leg_b"), along("rocker", P.bo2)),
    "rocker_bearing": (along("rocker"), place("frame", P.o2)),
    "c_pin": (along("leg_b", P.bc), place("knife", P.knife.c)),
    "d_pin": (along("leg_3", P.o3d), place("knife", P.knife.d)),
    "e_pin": (along("leg_4", P.o4e), place("knife", P.knife.e)),
    "o3_bearing": (along("leg_3"), place("frame", P.o3)),
    "o4_bearing": (along("leg_4"), place("frame", P.o4)),
}
MOTION = "blade.x blade.y blade.vx blade.vy blade.tilt".split()
COMPARED = ["tau", *MOTION, *(f"{pin}.f{axis}" for pin in PINS for axis in "xy")]


def centroid(name):
    """In the body's own frame, which starts at its first pin; a rod's lies on its axis."""
    if name == "knife":
        return P.knife.centroid.x, P.knife.centroid.y
    return getattr(P, name).s, 0.0


def turned_by_exudyn(steps, fx, fy):
    """Every compared output over one turn from crank angle 0, at the start and after each step."""
    mbs = exudyn.SystemContainer().AddSystem()
    found = {"frame": mbs.AddObject(item.ObjectGround())}
    linkage = KnifeDrive.linkage(MATH, P, KnifeDrive.Inputs())
    start = Mechanism(MATH, linkage, 0.0, KnifeDrive.derive(MATH, P))
    assert set(start.bodies) == set(BODIES)
    for name, body in start.bodies.items():
        c, link, own = body.c, body.link, getattr(P, name)
        node = mbs.AddNode(
            item.NodeRigidBody2D(
                initialCoordinates=[c.p.x, c.p.y, math.atan2(link.u.y, link.u.x)],
                initialVelocities=[c.p1.x * W, c.p1.y * W, link.t1 * W],
            )
        )
        found[name] = mbs.AddObject(item.ObjectRigidBody2D(mass=own.m, inertia=own.I, nodeNumber=node))
        if name == "crank":
            angle = mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=node, coordinate=2))
        weighed = mbs.AddMarker(item.MarkerBodyMass(bodyNumber=found[name]))
        mbs.AddLoad(item.LoadMassProportional(markerNumber=weighed, loadVector=[0.0, -P.g, 0.0]))

    def local(name, x, y):
        cx, cy = (0.0, 0.0) if name == "frame" else centroid(name)
        return {"bodyNumber": found[name], "localPosition": [x - cx, y - cy, 0.0]}

    def marker(at):
        return mbs.AddMarker(item.MarkerBodyPosition(**local(*at)))

    def sensor(kind, what, **of):
        what = getattr(exudyn.OutputVariableType, what)
        return mbs.AddSensor(kind(outputVariableType=what, storeInternal=True, writeToFile=False, **of))

    # exudyn's Force of a constraint is the one on the part of its first marker
    sensors = {}
    for name, pin in PINS.items():
        joint = mbs.AddObject(item.ObjectJointRevolute2D(markerNumbers=[marker(at) for at in pin]))
        sensors[name] = sensor(item.SensorObject, "Force", objectNumber=joint)
        sensors["gap", name] = sensor(item.SensorObject, "Displacement", objectNumber=joint)
    fixed = mbs.AddNode(item.NodePointGround())
    zero = mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=fixed, coordinate=0))
    # rate of the second less that of the first is the offset: the crank turns clockwise
    drive = item.ObjectConnectorCoordinate(markerNumbers=[zero, angle], velocityLevel=True, offset=-W)
    sensors["tau"] = sensor(item.SensorObject, "Force", objectNumber=mbs.AddObject(drive))
    blade = place("knife", P.knife.blade)
    mbs.AddLoad(item.LoadForceVector(markerNumber=marker(blade), loadVector=[fx, fy, 0.0]))
    for what in ("Position", "Velocity", "Rotation"):
        sensors[what] = sensor(item.SensorBody, what, **local(*blade))
    mbs.Assemble()

    settings = exudyn.SimulationSettings()
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = 0.0
    time = settings.timeIntegration
    time.numberOfSteps, time.endTime, time.adaptiveStep = steps, TURN, False
    time.newton.relativeTolerance, time.newton.absoluteTolerance = 1e-10, 1e-12
    # at the default of 1e-7 the accelerations at the start miss ten times more
    time.newton.numericalDifferentiation.relativeEpsilon = 1e-8
    mbs.SolveDynamic(settings, solverType=exudyn.DynamicSolverType.TrapezoidalIndex2)

    rows = {name: mbs.GetSensorStoredData(number) for name, number in sensors.items()}
    assert all(len(r) == steps + 1 for r in rows.values())
    # constraints of speed hold the pins as they are at the start
    assert max(np.max(np.abs(rows["gap", pin][0, 1:])) for pin in PINS) < 1e-14
    got = {"tau": rows["tau"][:, 1], "blade.tilt": rows["Rotation"][:, -1]}
    for axis, column in (("x", 1), ("y", 2)):
        got |= {f"{pin}.f{axis}": rows[pin][:, column] for pin in PINS}
        got |= {f"blade.{axis}": rows["Position"][:, column], f"blade.v{axis}": rows["Velocity"][:, column]}
    return got


def turned_by_us(steps, fx, fy):
    u = {"phi": np.linspace(0.0, 2.0 * math.pi, steps + 1), "w": W, "a": 0.0, "blade.fx": fx, "blade.fy": fy}
    parts = KnifeDrive.evaluate(
        numpy_(), KnifeDrive.with_derived(MATH, P), KnifeDrive.input_layout.from_names(u)
    )
    values = [v for part, out in zip(KnifeDrive.parts, parts, strict=True) for v in part.layout.values(out)]
    found = dict(zip(NAMES, values, strict=True))
    return {name: found[name] for name in COMPARED}


@pytest.mark.parametrize("force", [(0.0, 0.0), (1500.0, -6000.0)], ids=["free", "pressed"])
def test_one_turn(force, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(exudyn.config, "printToConsole", False)
    wanted = turned_by_us(2 * STEPS, *force)
    coarse, fine = (turned_by_exudyn(n, *force) for n in (STEPS, 2 * STEPS))
    for name, ours in wanted.items():
        size = min(np.max(np.abs(ours)), np.ptp(ours))
        one, two = (coarse[name] - ours[::2]) / size, (fine[name] - ours) / size
        motion = name in MOTION
        assert np.max(np.abs(two)) < (5e-7 if motion else 2e-6), name
        # the multipliers alternate about their course: every second one of either run
        one, two = one[::2], two[::4]
        assert 3.8 < np.max(np.abs(one)) / np.max(np.abs(two)) < 4.2, name
        assert np.max(np.abs(4.0 * two - one)) / 3.0 < (1e-11 if motion else 1e-7), name
