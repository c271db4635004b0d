"""The left organ as a chain of rods in an independent engine, exudyn: rods as rigid bodies in absolute
coordinates, the last pinned to the end of an arm about C whose angle is prescribed as the rocker's.

Compared with `Chain` integrated by DOP853: the angles of the rods, the forces at all pins, and the moment
that drives the rocker, each component relative to the lesser of its peak and its range. The arm has neither
mass nor weight, so that the moment is the chain's: the force at A2 and the damping of that pin. exudyn takes
the start from the model; motion and multipliers are its own, by the trapezoidal rule on constraints of speed
(index 2).

Smooth, from rest: from crank angle pi/2 over a smooth start of two turns' time and one turn after it.
Measured, the largest of all components and points of time:

=======================  =======  ======================  =======  ======================
..                       4 rods, 3 rad/s, 1 N m s         8 rods, 10 rad/s, 10 N m s
-----------------------  -------------------------------  -------------------------------
..                       angles   forces and the moment   angles   forces and the moment
=======================  =======  ======================  =======  ======================
3000 steps               1.3e-5   1.4e-5                  4.1e-6   6.8e-6
6000 steps               3.2e-6   3.5e-6                  1.0e-6   1.7e-6
extrapolated to no step  2.4e-9   4.7e-9                  5.2e-11  1.0e-8
=======================  =======  ======================  =======  ======================

The damping of one pin wrong by a thousandth shows as 4e-6 to 8e-5 with 4 rods, 6e-5 to 5e-4 with 8.

Slack and snatching: 8 rods at 10 rad/s over two turns, from a state in motion that is prescribed to both. The
damping is 1 N m s at A1 and A2 and, between two rods, 0.24 N m2 s over their mean length; and a fifth of
that. The least pull is at the middle of a rod, 110 N at rest:

=======================  =======  ======================  =======  ======================
..                       damping as said                  a fifth of it
-----------------------  -------------------------------  -------------------------------
least pull               -49 N, a rod slack 10 % of time  -668 N, 43 % of time
peak at A2               3.2 times that at rest           9.0 times that at rest
-----------------------  -------------------------------  -------------------------------
..                       angles   forces and the moment   angles   forces and the moment
=======================  =======  ======================  =======  ======================
3000 steps               5.6e-6   2.2e-5                  8.8e-5   2.3e-4
6000 steps               1.4e-6   5.4e-6                  2.2e-5   5.8e-5
extrapolated to no step  4.2e-10  2.6e-8                  3.4e-9   4.1e-8
=======================  =======  ======================  =======  ======================

The damping of one pin wrong by a thousandth shows as 3e-5 to 7e-4 and, with a fifth, 7e-5 to 3e-3; the mass
of one rod wrong by a hundredth as 3e-3 to 1.1e-2 and 4e-3 to 5.5e-2.
"""

from __future__ import annotations

import copy
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from test_chain import G, M, acceleration, organ, reach, rocker

from chainunit.core.engines import MATH
from chainunit.core.planar import Motion, Vec2
from chainunit.groups.chain import Chain, Rods, close, end_motion
from chainunit.machines import hanging

pytestmark = pytest.mark.slow

exudyn = pytest.importorskip("exudyn")
item = pytest.importorskip("exudyn.itemInterface")

STEPS = 3000


class Case:
    """N rods, speed of the crank after the ramp [rad/s], damping of the pins [N m s/rad]; from rest, till one
    turn after the ramp."""

    def __init__(self, number, speed, damping):
        self.number, self.speed = number, speed
        self.turn = 2.0 * math.pi / speed
        self.ramp = 2.0 * self.turn
        self.begin, self.end = 0.0, self.ramp + self.turn
        lengths, masses = organ(number)
        self.rods = Rods(lengths, masses, damping)
        self.rest = hanging.rods(lengths, masses * G, reach(self.rocker(0.0)[0]))
        self.theta, self.omega = self.rest.theta, np.zeros(number)

    def later(self, turns):
        """Two turns from the state which ours has after the time of so many; for both a prescribed one."""
        case, N = copy.copy(self), self.number
        case.begin, case.end = turns * self.turn, (turns + 2) * self.turn
        state = list(solution(self, np.array([0.0, case.begin]))[:, -1])
        psi, speed, _ = self.rocker(case.begin)
        end = Motion(Vec2(*reach(psi)), Vec2(math.cos(psi), math.sin(psi)) * (M["e"] * speed))
        case.theta, case.omega, _ = close(MATH, self.rods, state[:N], state[N:], end)
        return case

    def times(self, steps):
        return np.linspace(self.begin, self.end, steps + 1)

    def rocker(self, t):
        """Angle, speed and acceleration."""
        x = min(t / self.ramp, 1.0)
        w = self.speed * x**3 * (10.0 - 15.0 * x + 6.0 * x * x)
        a = self.speed / self.ramp * 30.0 * (x - x * x) ** 2
        turned = self.speed * (self.ramp * x**4 * (2.5 - 3.0 * x + x * x) + max(t - self.ramp, 0.0))
        psi, first, second = rocker(0.5 * math.pi + turned, 1.0)
        return psi, first * w, second * w * w + first * a


def chain(case, t, y):
    N = case.number
    psi, speed, rate = case.rocker(t)
    return Chain(MATH, case.rods, list(y[:N]), list(y[N:]), G, speed, acceleration(psi, speed, rate))


def solution(case, times):
    """Angles and speeds at the times, a column each."""

    def rates(t, y):
        return [*y[case.number :], *chain(case, t, y).rates]

    over, start = (case.begin, times[-1]), [*case.theta, *case.omega]
    solved = solve_ivp(rates, over, start, method="DOP853", rtol=1e-10, atol=1e-10, t_eval=times).y
    assert solved.shape == (2 * case.number, len(times))
    return solved


def by_us(case, times):
    N = case.number
    solved = solution(case, times)
    # without projection: 3e-11 m measured
    last = end_motion(case.rods, list(solved[:N, -1]), list(solved[N:, -1]), MATH).p
    assert [last.x, last.y] == pytest.approx(reach(case.rocker(case.end)[0]), rel=0.0, abs=1e-9)
    results = {f"theta.{k}": solved[k] for k in range(N)}
    at = [chain(case, t, y) for t, y in zip(times, solved.T, strict=True)]
    for k in range(N + 1):
        results |= {f"pin.{k}.{x}": np.array([getattr(c.forces[k], x) for c in at]) for x in "xy"}
    psi = np.array([case.rocker(t)[0] for t in times])
    along = results[f"pin.{N}.x"] * np.cos(psi) + results[f"pin.{N}.y"] * np.sin(psi)
    results["drive"] = M["e"] * along + np.array([c.moment_at_end for c in at])
    return results


def by_exudyn(case, steps, newton=(1e-12, 1e-14)):
    mbs = exudyn.SystemContainer().AddSystem()
    ground = mbs.AddObject(item.ObjectGround())
    fixed = mbs.AddMarker(
        item.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(item.NodePointGround()), coordinate=0)
    )

    def body(place, velocity, mass, inertia):
        node = mbs.AddNode(item.NodeRigidBody2D(initialCoordinates=place, initialVelocities=velocity))
        number = mbs.AddObject(item.ObjectRigidBody2D(mass=mass, inertia=inertia, nodeNumber=node))
        return number, mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=node, coordinate=2))

    def pinned(*ends):
        places = [{"bodyNumber": number, "localPosition": [x, y, 0.0]} for number, x, y in ends]
        markers = [mbs.AddMarker(item.MarkerBodyPosition(**place)) for place in places]
        return mbs.AddObject(item.ObjectJointRevolute2D(markerNumbers=markers))

    def damper(c, *angles):
        mbs.AddObject(item.ObjectConnectorCoordinateSpringDamper(markerNumbers=list(angles), damping=c))

    def sensor(kind, what, **of):
        what = getattr(exudyn.OutputVariableType, what)
        return mbs.AddSensor(kind(outputVariableType=what, storeInternal=True, writeToFile=False, **of))

    def force(number):
        return sensor(item.SensorObject, "Force", objectNumber=number)

    # exudyn's Force of a constraint is the one on what its first marker is on; at angle 0 a body hangs
    sensors, pin, moved = {}, np.zeros(2), np.zeros(2)
    before, angle_before = (ground, 0.0, 0.0), fixed
    rods = zip(case.rods.lengths, case.rods.masses, case.theta, case.omega, strict=True)
    for k, (l, m, angle, w) in enumerate(rods):
        along = l * np.array([math.sin(angle), -math.cos(angle)])
        across = l * w * np.array([math.cos(angle), math.sin(angle)])
        rod, turned = body([*(pin + 0.5 * along), angle], [*(moved + 0.5 * across), w], m, m * l * l / 12.0)
        pin, moved = pin + along, moved + across
        weighed = mbs.AddMarker(item.MarkerBodyMass(bodyNumber=rod))
        mbs.AddLoad(item.LoadMassProportional(markerNumber=weighed, loadVector=[0.0, -G, 0.0]))
        sensors[f"pin.{k}"] = force(pinned(before, (rod, 0.0, 0.5 * l)))
        damper(case.rods.damping[k], angle_before, turned)
        sensors[f"theta.{k}"] = sensor(item.SensorBody, "Rotation", bodyNumber=rod)
        before, angle_before = (rod, 0.0, -0.5 * l), turned
    psi, speed, _ = case.rocker(case.begin)
    arm, turned = body([M["z"], 0.0, psi], [0.0, 0.0, speed], 0.0, 0.0)
    pinned((arm, 0.0, 0.0), (ground, M["z"], 0.0))
    sensors[f"pin.{case.number}"] = force(pinned(before, (arm, 0.0, -M["e"])))
    damper(case.rods.damping[-1], angle_before, turned)
    drive = item.ObjectConnectorCoordinate(
        markerNumbers=[fixed, turned],
        offsetUserFunction=lambda _mbs, t, _number, _offset: case.rocker(t)[0],
        offsetUserFunction_t=lambda _mbs, t, _number, _offset: case.rocker(t)[1],
    )
    sensors["drive"] = force(mbs.AddObject(drive))
    mbs.Assemble()

    settings = exudyn.SimulationSettings()
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = 0.0
    time = settings.timeIntegration
    time.startTime, time.adaptiveStep = case.begin, False
    time.newton.relativeTolerance, time.newton.absoluteTolerance = newton

    def solve(end, steps):
        time.endTime, time.numberOfSteps = end, steps
        mbs.SolveDynamic(settings, solverType=exudyn.DynamicSolverType.TrapezoidalIndex2)
        return mbs.systemData.GetODE2Coordinates_t()

    # The first accelerations, from the speeds after exudyn's own first steps: as computed by it they lack
    # what constraints have of speeds and of user functions, and the trapezoidal rule keeps their error in the
    # multipliers, its sign changing with each step. Weights of no sum: the speeds have one error in common.
    start, short = exudyn.ConfigurationType.Initial, 1e-5
    for _ in range(2):
        one, two, three = (solve(case.begin + n * short, n) for n in (1, 2, 3))
        mbs.systemData.SetODE2Coordinates_tt((4.0 * two - 2.5 * one - 1.5 * three) / short, start)
        time.generalizedAlpha.computeInitialAccelerations = False
    solve(case.end, steps)

    rows = {name: mbs.GetSensorStoredData(number) for name, number in sensors.items()}
    assert all(len(r) == steps + 1 for r in rows.values())
    results = {"drive": -rows.pop("drive")[:, 1]}
    for name, r in rows.items():
        results |= {name: r[:, 1]} if "theta" in name else {f"{name}.x": r[:, 1], f"{name}.y": r[:, 2]}
    return results


def compared(case, instants, steps):
    """Ours, and by name the largest differences: with so many steps from instant to instant, with twice as
    many, and extrapolated to no step; without the first instant, at which exudyn has no multipliers."""
    ours = by_us(case, case.times(instants))
    coarse, fine = by_exudyn(case, steps * instants), by_exudyn(case, 2 * steps * instants)
    assert set(ours) == set(coarse)
    results = {}
    for name, reference in ours.items():
        size = min(np.max(np.abs(reference)), np.ptp(reference))
        one, two = (coarse[name][::steps] - reference) / size, (fine[name][:: 2 * steps] - reference) / size
        results[name] = [float(np.max(np.abs(x[1:]))) for x in (one, two, (4.0 * two - one) / 3.0)]
    return ours, results


@pytest.mark.parametrize("case", [(4, 3.0, [1.0] * 5), (8, 10.0, [10.0] * 9)], ids=["smooth-4", "fast-8"])
def test_start_and_one_turn(case, tmp_path, monkeypatch):
    """The reference's "smooth" and "above slack speed, strong damping"."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(exudyn.config, "printToConsole", False)
    _, result = compared(Case(*case), STEPS, 1)
    for name, (one, two, none) in result.items():
        assert two < 5e-6, name
        assert 3.9 < one / two < 4.1, name
        assert none < (1e-8 if "theta" in name else 1e-7), name
    assert not list(tmp_path.iterdir())


def least_pull(case, found):
    """At the middle of a rod, least of all rods, at each instant."""
    pulls = []
    for k in range(case.number):
        x, y = (0.5 * (found[f"pin.{k}.{axis}"] + found[f"pin.{k + 1}.{axis}"]) for axis in "xy")
        pulls.append(x * np.sin(found[f"theta.{k}"]) - y * np.cos(found[f"theta.{k}"]))
    return np.min(pulls, axis=0)


@pytest.mark.parametrize(
    ("part", "turns", "push", "times"),
    [(1.0, 2, 45.0, 3.0), (0.2, 6, 600.0, 8.0)],
    ids=["snatch", "snatch-hard"],
)
def test_two_turns_of_a_snatching_chain(part, turns, push, times, tmp_path, monkeypatch):
    """1e-2 of the peak is demanded; one mass wrong by a hundredth could pass that, not what is asserted."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(exudyn.config, "printToConsole", False)
    lengths, _ = organ(8)
    damping = part * np.array([1.0, *0.24 / (0.5 * (lengths[:-1] + lengths[1:])), 1.0])
    case = Case(8, 10.0, damping).later(turns)
    ours, result = compared(case, STEPS // 2, 2)
    pull, peak = least_pull(case, ours), np.max(np.hypot(ours["pin.8.x"], ours["pin.8.y"]))
    assert np.min(case.rest.pull) > 100.0 and np.min(pull) < -push
    assert np.mean(pull < 0.0) > 0.05 and peak > times * np.hypot(*case.rest.last)
    for name, (one, two, none) in result.items():
        assert two < 1e-4, name
        assert 3.9 < one / two < 4.1, name
        assert none < (1e-8 if "theta" in name else 1e-7), name
    assert not list(tmp_path.iterdir())
