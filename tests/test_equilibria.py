"""Equilibria, holding torque and natural frequencies of machines at rest.

Random linkages are solved a second time in the Cartesian coordinates of all links (`multibody`, which shares no line
with the package): stationary points of the potential of weights and springs under the equations of the joints, told
apart by the Hessian of the Lagrangian along the motion. Natural frequencies are those of a small swing of the direct
model over time."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import numpy as np
import pytest
from multibody import Multibody
from random_rest import resting
from reports import packed_in, plain
from scipy.integrate import solve_ivp

from chainunit.core.engines import MATH
from chainunit.core.errors import InputError
from chainunit.machines.equilibria import INDIFFERENT, SADDLE, STABLE, STOP, UNSTABLE
from chainunit.machines.linkages.file import description_of, read_linkage
from chainunit.machines.linkages.model import machine_of
from chainunit.machines.machine import Machine
from chainunit.mechanism.zeros import sampled, zeros
from chainunit.models import MODELS
from chainunit.report.figure import Figure
from chainunit.report.html import render
from chainunit.report.linkage_report import linkage_report
from chainunit.study.linear import linear_point
from chainunit.study.linkage_turn import linkage_findings

LINKAGES = Path(__file__).parents[1] / "examples" / "linkages"
TURN = 2.0 * math.pi


# -- a second route


class Cartesian(Multibody):
    """The potential of a linkage with weights and springs alone, by the places of all links."""

    def gradient(self, x):
        """The potential [J], and its derivatives by the unknowns."""
        energy, by_x = 0.0, np.zeros(x.size, x.dtype)
        for link, local, mass, _ in self.bodies:
            p, by = self.place(x, link, local)
            energy, by_x = energy + mass * self.values["g"] * p[1], by_x + mass * self.values["g"] * by[1]
        for load in self.data["loads"]:
            (p, p_by), (r, r_by) = (
                self.place(x, link, self.points[link][name]) for link, name in (load["on"], load["by"])
            )
            length = np.sqrt((r - p) @ (r - p))
            stiffness, free = self.number(load["stiffness"]), self.number(load["length"])
            energy = energy + 0.5 * stiffness * (length - free) ** 2
            by_x = by_x + stiffness * (length - free) / length * ((r - p) @ (r_by - p_by))
        return energy, by_x

    def along(self, x):
        """The derivatives of the unknowns by the driver's place."""
        driver, by_q = self.data["driver"], np.zeros(x.size)
        by_q[-1] = 1.0 if driver["linear"] else driver["sense"]
        return np.linalg.solve(self.equations(x, 0.0)[1], by_q)

    def driver_at(self, x):
        """The driver's place."""
        gap, driver = self.equations(x, 0.0)[0][-1], self.data["driver"]
        return gap if driver["linear"] else driver["sense"] * gap

    def poses(self, places):
        """The poses at places on either side of the start, followed from there."""
        found = {}
        for way in (places[places >= self.start], places[places < self.start][::-1]):
            x, q = self.closed(self.start, self.rough), self.start
            for place in way:
                while q != place:
                    q = place if abs(place - q) < 0.1 else q + math.copysign(0.1, place - q)
                    x = self.closed(q, x, 12)
                found[place] = x
        return [found[place] for place in places]

    def stationary(self, x):
        """The stationary point of the potential near a pose: the driver's place, curvature and inertia along the
        motion per square of the driver's rate."""
        factors = np.linalg.lstsq(self.equations(x, 0.0)[1][:-1].T, -self.gradient(x)[1], rcond=None)[0]
        for _ in range(40):
            gaps, rows = (part[:-1] for part in self.equations(x, 0.0))
            for k in self.angular - {len(gaps)}:
                gaps[k] = math.remainder(gaps[k], TURN)
            moved = x.astype(complex)[:, None] + 1e-30j * np.eye(x.size)
            hessian = np.column_stack([self.forces(each, factors).imag / 1e-30 for each in moved.T])
            matrix = np.block([[hessian, rows.T], [rows, np.zeros((len(rows), len(rows)))]])
            step = np.linalg.solve(matrix, -np.concatenate([self.forces(x, factors), gaps]))
            x, factors = x + step[: x.size], factors + step[x.size :]
            if np.max(np.abs(step[: x.size])) < 1e-13:
                break
        t = self.along(x)
        inertia = 0.0
        for link, local, mass, own in self.bodies:
            by = self.place(x, link, local)[1] @ t
            inertia += mass * by @ by + own * (self.angle(x, link)[1] @ t) ** 2
        return self.driver_at(x), t @ hessian @ t, inertia

    def forces(self, x, factors):
        """The derivatives of the Lagrangian by the unknowns."""
        return self.gradient(x)[1] + self.equations(x, 0.0)[1][:-1].T @ factors


def stationary_points(text, span, turns):
    """All stationary points of the potential over the way of the driver, from a change of the sign of its slope
    between two of 181 places; and the slopes at both ends."""
    body = Cartesian(text)
    places = np.linspace(*span, 181)
    poses = body.poses(places)
    slopes = [body.gradient(x)[1] @ body.along(x) for x in poses]
    found = []
    for k, (one, other) in enumerate(itertools.pairwise(slopes)):
        if one * other < 0.0:
            near = poses[k] if abs(one) < abs(other) else poses[k + 1]
            found.append(body.stationary(near))
            assert turns or places[k] <= found[-1][0] <= places[k + 1]
    return found, slopes[0], slopes[-1]


def check_equilibria(seed, driver, text, model):
    """All equilibria of a random linkage against the stationary points of its potential."""
    turns = driver == "turns"
    found = Machine(model).equilibria()
    wanted, first, last = stationary_points(text, model.span, turns)
    own = [each for each in found.places if each.kind != STOP]
    assert len(own) == len(wanted), (seed, own, wanted)
    for q, curvature, inertia in wanted:
        near = min(
            own, key=lambda each: abs(math.remainder(each.place - q, TURN) if turns else each.place - q)
        )
        off = math.remainder(near.place - q, TURN) if turns else near.place - q
        assert abs(off) < 1e-9, (seed, near, q)
        assert near.kind == (STABLE if curvature > 0.0 else UNSTABLE), (seed, near)
        assert near.stiffness == pytest.approx(curvature, rel=1e-7, abs=1e-7 * abs(found.summary.peak))
        assert near.inertia == pytest.approx(inertia, rel=1e-9)
        if near.stable:
            assert near.natural_frequency == pytest.approx(math.sqrt(curvature / inertia), rel=1e-7)
    ends = [] if turns else [(model.span[0], first, 1.0), (model.span[1], last, -1.0)]
    stops = [each.place for each in found.places if each.kind == STOP]
    assert stops == [place for place, slope, sense in ends if sense * slope > 0.0], seed
    return found


def swing(model, equilibrium, amplitude=1e-4):
    """The natural frequency [Hz] by a small swing of the direct model over time, clear of the stops: from rest beside
    the equilibrium to the same side again."""
    direct = model.direct()
    if not model.turns:
        amplitude = min(amplitude, 0.4 * min(abs(equilibrium.place - end) for end in model.span))
    p, u = direct.check(direct.Parameters()), direct.Inputs()
    states = direct.state_layout

    def rate(t, x):
        return direct.derivatives(MATH, p, u, states.instance(list(map(float, x))))

    def back(t, x):
        return x[1]

    back.direction = -1.0
    period = 1.0 / equilibrium.frequency
    run = solve_ivp(
        rate, (0.0, 1.2 * period), [equilibrium.place + amplitude, 0.0], "DOP853",
        events=back, rtol=1e-9, atol=[1e-11 * amplitude, 1e-11 * amplitude / period], first_step=1e-3 * period,
    )  # fmt: skip
    return 1.0 / run.t_events[0][-1]


def check_random(count):
    kinds, swings = {}, 0
    for seed, driver, _, text, model in resting(count):
        found = check_equilibria(seed, driver, text, model)
        for each in found.places:
            kinds[driver, each.kind] = kinds.get((driver, each.kind), 0) + 1
        for each in found.stable:
            assert swing(model, each) == pytest.approx(each.frequency, rel=1e-4), (seed, each)
            swings += 1
    return kinds, swings


@pytest.mark.slow
def test_equilibria_of_a_few_random_linkages():
    kinds, swings = check_random(9)
    assert swings >= 3 and len({driver for driver, _ in kinds}) == 3


@pytest.mark.slow
def test_equilibria_of_random_linkages():
    """Four-bars, six-bars, slider-cranks and others, whose drivers turn, swing and slide."""
    kinds, swings = check_random(100)
    for driver in ("swings", "slides"):
        assert kinds[driver, STABLE] >= 8 and kinds[driver, UNSTABLE] >= 3 and kinds[driver, STOP] >= 10
    assert kinds["turns", STABLE] == kinds["turns", UNSTABLE] > 34 and swings > 55


# -- limit cases


def four_bar(**more):
    """Without a load its crank has no torque; all weights but that of the crank are 0."""
    links = {
        "crank": {
            "points": {"O1": [0, 0], "A": [0.1, 0], "Z": [-0.1, 0]},
            "mass": 3.0, "inertia": 0.02, "centroid": [0.08, 0.0],
        },
        "coupler": {"points": {"A": [0, 0], "B": [0.5, 0]}},
        "rocker": {"points": {"O2": [0, 0], "B": [0.4, 0]}},
    }  # fmt: skip
    data = {
        "ground": {"O1": [0, 0], "O2": [0.6, 0.1], "W": [0.3, 0.7]},
        "driver": {"link": "crank"},
        "links": links,
        "start": {"phi": 0.5, "points": {"B": [0.5, 0.35]}},
    }
    return Machine(machine_of(description_of({**data, **more}, "four_bar")))


def kinds(found):
    return [each.kind for each in found.places]


M, S, INERTIA, G = 3.0, 0.08, 0.02 + 3.0 * 0.08**2, 9.81
TORQUE = {"type": "torque", "on": "crank"}


def test_a_crank_alone_with_weight_is_a_pendulum():
    found = four_bar().equilibria()
    below, above = (next(e for e in found.places if e.kind == kind) for kind in (STABLE, UNSTABLE))
    assert (below.place, above.place) == pytest.approx((1.5 * math.pi, 0.5 * math.pi), abs=1e-13)
    assert below.stiffness == pytest.approx(M * G * S, rel=1e-12) == -above.stiffness
    assert below.natural_frequency == pytest.approx(math.sqrt(M * G * S / INERTIA), rel=1e-12)
    assert below.frequency == below.natural_frequency / TURN and above.frequency is None
    assert above.potential == pytest.approx(2.0 * M * G * S, rel=1e-12) and below.potential == 0.0
    # the largest torque lies between two places
    assert abs(found.summary.peak) == pytest.approx(M * G * S, rel=1e-12) and found.summary.work == 0.0
    assert found.summary.peak_at % math.pi == pytest.approx(0.0, abs=1e-5) or math.pi - (
        found.summary.peak_at % math.pi
    ) == pytest.approx(0.0, abs=1e-5)
    assert found.driven == () and found.repeats and found.summary.friction == 0.0
    np.testing.assert_allclose(found.rest.holding, M * G * S * np.cos(found.rest.q), atol=1e-12)
    assert found.rest.q[0] == 0.5 and np.all(np.diff(found.rest.q) > 0.0)
    assert found.rest.q[-1] == pytest.approx(0.5 + TURN, abs=1e-12)


def test_the_gear_does_not_matter():
    """All counts at the driver."""
    one, geared = four_bar().equilibria(), four_bar(ratio=7.0).equilibria()
    for a, b in zip(one.places, geared.places, strict=True):
        assert (a.place, a.stiffness, a.inertia) == pytest.approx(
            (b.place, b.stiffness, b.inertia), rel=1e-12
        )


@pytest.mark.parametrize("gravity", [0.0, 9.81])
def test_a_machine_in_balance_is_indifferent(gravity):
    """Without weight, and with one in the bearing."""
    machine = four_bar(gravity=gravity).replace({"crank.mass": M if gravity == 0.0 else 0.0})
    found = machine.equilibria()
    assert found.indifferent and kinds(found) == [INDIFFERENT] and found.summary.peak == 0.0
    assert found.places[0].end - found.places[0].place == pytest.approx(TURN)


def test_two_springs_in_balance_are_indifferent():
    """Springs of no length at opposite points of the crank: their sum is rounding, which makes no equilibria."""
    spring = {"type": "spring", "by": "ground.W", "stiffness": 800.0, "length": 0.0}
    machine = four_bar(
        gravity=0.0, loads={"one": {**spring, "on": "crank.A"}, "other": {**spring, "on": "crank.Z"}}
    )
    found = machine.equilibria()
    assert found.indifferent and found.places[0].place == 0.5
    # no last bit decides on the place of the largest torque, and none is a potential
    assert (found.summary.peak, found.summary.peak_at, found.places[0].potential) == (0.0, 0.5, 0.0)
    assert not machine.replace({"crank.mass": 2.0, "g": 9.81}).equilibria().indifferent


def test_a_torque_that_touches_zero_has_a_saddle():
    found = four_bar(gravity=0.0, loads={"own": {**TORQUE, "torque": "-(1 + sin(phi)) * t"}},
                     parameters={"t": "5 N m"}).equilibria()  # fmt: skip
    assert kinds(found) == [SADDLE] and found.places[0].place == pytest.approx(1.5 * math.pi, abs=1e-7)
    assert found.driven == ("loads.own",) and found.summary.work == pytest.approx(TURN * 5.0, rel=1e-9)
    # a turn takes work: no potential belongs to a place
    assert found.places[0].potential is None and found.rest.potential is None
    nearly = four_bar(gravity=0.0, loads={"own": {**TORQUE, "torque": "-(0.9999999 + sin(phi)) * t"}},
                      parameters={"t": "5 N m"}).equilibria()  # fmt: skip
    low, high = (each.place for each in nearly.places)
    assert kinds(nearly) == [UNSTABLE, STABLE]
    assert high - low == pytest.approx(2.0 * math.acos(0.9999999), rel=1e-6)


@pytest.mark.parametrize(("start", "ends"), [(0.0, (0.5, 0.0)), (0.0, (0.0, 0.5)), (0.5, (0.5, 0.0))])
def test_a_torque_that_jumps_over_zero_has_no_stiffness(start, ends):
    """The ends of a compressed spring meet, also at a round angle: its force turns round there, and that it depends
    on the last bits of the place does not let the loads of a turn differ from those of the next."""
    arm = {"points": {"O": [0, 0], "T": [0.5, 0]}, "mass": 3.0, "inertia": 0.2, "centroid": [0.4, 0]}
    spring = {"type": "spring", "on": "arm.T", "by": "ground.P", "stiffness": 1000.0, "length": 0.1}
    data = {"ground": {"O": [0, 0], "P": list(ends)}, "driver": {"link": "arm"}, "links": {"arm": arm},
            "loads": {"spring": spring}, "start": {"phi": start}}  # fmt: skip
    found = Machine(machine_of(description_of(data, "meeting"))).equilibria()
    assert found.repeats and kinds(found).count(UNSTABLE) == kinds(found).count(STABLE) == 2
    met = min(found.places, key=lambda each: abs(each.place - math.atan2(ends[1], ends[0])))
    assert met.kind == UNSTABLE and (met.stiffness is None or met.stiffness < 0.0)
    assert all(0.0 <= each.place < TURN for each in found.places)


def test_a_flat_minimum_has_no_frequency():
    found = four_bar(gravity=0.0, loads={"own": {**TORQUE, "torque": "-sin(phi)**3 * t"}},
                     parameters={"t": "5 N m"}).equilibria()  # fmt: skip
    assert kinds(found) == [STABLE, UNSTABLE]
    assert found.places[0].stiffness == 0.0 and found.places[0].frequency is None
    assert found.places[1].potential == pytest.approx(5.0 * 4.0 / 3.0, rel=1e-9)


def test_play_between_two_buffers_is_indifferent():
    """Without weight nothing acts on the crank from 1 rad to 2 rad, and the stops lie behind the buffers."""
    law = "t * (positive(1 - angle, 0.001) - positive(angle - 2, 0.001))"
    found = four_bar(gravity=0.0, driver={"link": "crank", "range": [0.4, 2.5]}, parameters={"t": "5 N m"},
                     loads={"own": {**TORQUE, "torque": law}}).equilibria()  # fmt: skip
    (own,) = found.places
    assert own.kind == INDIFFERENT and not found.indifferent
    assert (own.place, own.end) == pytest.approx((1.0 + 5e-4, 2.0 - 5e-4), abs=2e-5)


def test_a_driver_rests_on_its_stops():
    """A pendulum above its bearing falls to either side."""
    found = four_bar(driver={"link": "crank", "range": [0.4, 2.5]}).equilibria()
    assert kinds(found) == [STOP, UNSTABLE, STOP]
    low, _, high = found.places
    assert (low.place, high.place) == (0.4, 2.5) and low.stiffness is None and low.frequency is None
    assert low.holding == pytest.approx(M * G * S * math.cos(0.4)) and high.holding < 0.0
    assert found.summary.work == pytest.approx(M * G * S * (math.sin(2.5) - math.sin(0.4)))


def test_a_spring_that_winds_up_does_not_repeat_itself():
    """Half a turn to either side of the start; the weight alone makes no second pair of equilibria."""
    found = four_bar(parameters={"k": "2 N m"}, loads={"own": {**TORQUE, "torque": "-k * phi"}}).equilibria()
    assert not found.repeats
    assert (found.rest.q[0], found.rest.q[-1]) == pytest.approx((0.5 - math.pi, 0.5 + math.pi))
    assert kinds(found) == [STABLE]
    place = found.places[0].place
    assert 2.0 * place == pytest.approx(-M * G * S * math.cos(place), rel=1e-9)
    assert found.places[0].stiffness == pytest.approx(2.0 - M * G * S * math.sin(place), rel=1e-9)


def test_a_load_by_the_speed_counts_at_rest():
    """Half of a step, whatever the direction; a damper does nothing."""
    at_rest = four_bar(loads={"own": {**TORQUE, "torque": "-t * step(angle_rate, 0.1) - c * angle_rate"}},
                       parameters={"t": "2 N m", "c": "0.3 N m s/rad"}).equilibria()  # fmt: skip
    half = four_bar(loads={"own": {**TORQUE, "torque": -1.0}}).equilibria()
    assert [e.place for e in at_rest.places] == pytest.approx([e.place for e in half.places], abs=1e-12)
    assert at_rest.summary.work == pytest.approx(TURN, rel=1e-9)


def test_friction_of_the_bearing_holds_its_moment():
    """The coupler carries nothing: friction by the weight in O1 alone."""
    found = four_bar(pins={"friction": 0.2, "diameter": 0.05}).equilibria()
    np.testing.assert_allclose(found.rest.friction, 0.2 * 0.025 * M * G, rtol=1e-9)
    assert found.places[0].friction == pytest.approx(0.2 * 0.025 * M * G, rel=1e-9)


def test_friction_is_that_of_a_slow_motion():
    """In all pins and guides of a shaper: the loss in a motion that is slow, but faster than the smoothing."""
    smooth = {"pins.w_smooth": 1e-9, "guides.v_smooth": 1e-9, "pins.damping": 0.0, "guides.damping": 0.0}
    machine = Machine(read_linkage(LINKAGES / "crank_shaper.toml")).replace(smooth)
    found = machine.equilibria()
    moving = machine.state(machine.inputs({"phi": found.rest.q[::40], "w": 1e-6}))
    friction = moving.effects["pins"].dissipative + moving.effects["guides"].dissipative
    np.testing.assert_allclose(found.rest.friction[::40], friction, rtol=1e-3)
    assert np.max(friction) > 10.0


@pytest.mark.parametrize("name", ["ChamberForces", "KnifeDrive"])
def test_packaged_machines_have_equilibria(name):
    """The organs hang with the least energy; the holding torque is the torque at rest."""
    machine = Machine(MODELS[name])
    found = machine.equilibria()
    energy = machine.outputs(found.rest.q, 0.0).potential_energy
    lowest = found.rest.q[np.argmin(energy)]
    (stable,) = found.stable
    assert abs(math.remainder(stable.place - lowest, TURN)) < 1e-6
    np.testing.assert_allclose(found.rest.holding, machine.outputs(found.rest.q, 0.0).tau, atol=1e-9)


# -- the linear model


HANGING = """
[ground]
O1 = [0, 0]
O2 = [0.6, 0.1]
[driver]
link = "crank"
[links.crank]
points = { O1 = [0, 0], A = [0.1, 0] }
mass = 3
inertia = 0.02
[links.coupler]
points = { A = [0, 0], B = [0.5, 0], P = [0.3, -0.2] }
masses = { P = 4 }
[links.rocker]
points = { O2 = [0, 0], B = [0.4, 0] }
mass = 2
inertia = 0.04
centroid = [0.2, 0.0]
[start]
points = { B = [0.5, 0.35] }
"""


@pytest.mark.stages(first=1)
@pytest.mark.parametrize(
    ("name", "at", "number"),
    [
        ("watt_six_bar", "equilibrium", 3),
        ("watt_six_bar", " equilibrium : 4 ", 4),
        ("", "equilibrium", 2),
        ("", "equilibrium:1", 1),
    ],
)
def test_poles_at_an_equilibrium_have_its_natural_frequency(name, at, number, tmp_path):
    """The product of both poles is its square, whatever damps; without friction and loads by the speed they are a
    pair without damping, or about an unstable one of opposite signs."""
    file = LINKAGES / f"{name}.toml" if name else tmp_path / "hanging.toml"
    if not name:
        file.write_text(HANGING, "utf-8")
    own = Machine(read_linkage(file)).equilibria().places[number - 1]
    point = linear_point(str(file), at)
    assert point.words == f"equilibrium {number} ({own.kind}, {own.place:.6g} rad)"
    assert (
        point.states == {"phi": pytest.approx(own.place, rel=1e-12), "w": 0.0} and point.inputs["tau"] == 0.0
    )
    linear = point.linear()
    assert linear.title == linear_point(str(file)).title == read_linkage(file).noun
    assert abs(linear.states[1].rate.value) < 1e-9
    poles = np.sort_complex(np.linalg.eigvals(linear.A))
    assert np.prod(poles).real == pytest.approx(own.stiffness / own.inertia, rel=1e-9)
    if not name:
        root = np.sqrt(complex(-own.stiffness / own.inertia))
        np.testing.assert_allclose(poles, np.sort_complex([-root, root]), atol=1e-9 * abs(root))
        assert linear.poles[0].natural_frequency == pytest.approx(
            own.natural_frequency or abs(root), rel=1e-9
        )


def test_the_linear_model_of_a_machine_at_its_equilibrium():
    """By the name of the model, at the motor behind a gear; and of the inverse model."""
    point = linear_point("ChainUnit", "equilibrium")
    assert point.states["phi"] == pytest.approx(math.pi, abs=1e-9)
    inverse = linear_point(str(LINKAGES / "pump_jack.toml"), "equilibrium:2", inverse=True)
    own = Machine(read_linkage(LINKAGES / "pump_jack.toml")).equilibria().places[1]
    assert inverse.inputs["phi"] == pytest.approx(own.place) and inverse.inputs["w"] == 0.0
    D = inverse.linear()
    assert D.D[[y.name for y in D.outputs].index("tau"), 0] == pytest.approx(own.stiffness, rel=1e-9)


@pytest.mark.parametrize(
    ("name", "at", "words"),
    [
        ("tipper.toml", "equilibrium", r"no stable equilibrium; its equilibria are 1 \(on its stop, 0.2 m\)"),
        ("tipper.toml", "equilibrium:1", "the equilibrium 1 is on an end stop"),
        ("pump_jack.toml", "equilibrium:5", "must be equilibrium:N with N from 1 to 4; its equilibria are 1"),
        ("pump_jack.toml", "equilibrium:two", "must be equilibrium:N with N from 1 to 4"),
        ("DcMotor", "equilibrium", "DcMotor has no equilibria that are known"),
        ("ChainUnitFlexible", "equilibrium", "ChainUnitFlexible has no equilibria that are known"),
        ("jam_with_driveline.toml", "equilibrium", "is of a linkage file, or of a machine by its name"),
    ],
)
def test_an_equilibrium_that_is_not_there_is_refused(name, at, words):
    folder = LINKAGES.parent if name.startswith("jam") else LINKAGES
    with pytest.raises(InputError, match=words):
        linear_point(str(folder / name) if name.endswith(".toml") else name, at)


# -- the report


def report_of(machine, speed=1.0):
    found = linkage_findings(machine, speed)
    report = linkage_report(found, "file.toml")
    assert len(figure_of(report).panels) == (1 if found.rest.rest.potential is None else 2)
    return report.result["rest"], plain(report), render(report)


def figure_of(report):
    (section,) = (each for each in report.sections if each.name == "rest")
    (figure,) = (each for each in section.blocks if isinstance(each, Figure))
    return figure


@pytest.mark.second
def test_equilibria_are_told():
    """In the data, in words, and on the page; those of a slider have its units."""
    data, words, page = report_of(Machine(read_linkage(LINKAGES / "pump_jack.toml")))
    own = Machine(read_linkage(LINKAGES / "pump_jack.toml")).equilibria()
    for entry, each in zip(data["equilibria"], own.places, strict=True):
        assert entry["kind"] == each.kind and entry["place"] == {"value": each.place, "unit": "rad"}
        assert entry["stiffness"] == {"value": each.stiffness, "unit": "N.m/rad"}
        assert entry["frequency"] == {"value": each.frequency, "unit": "Hz"}
        assert entry["natural_frequency"]["value"] == each.natural_frequency
    assert data["summary"]["peak"] == {"value": own.summary.peak, "unit": "N.m"}
    assert data["by_speed"] == data["without_potential"] == ["fluid"]
    assert data["over_the_way"]["potential"]["value"] == own.rest.potential.tolist()
    assert "2: stable" in words and "1.26 rad/s (0.201 Hz)" in words and "fluid depends on the speed" in words
    assert 'id="rest"' in page and "held by friction" in packed_in(page, "figures")

    data, words, _ = report_of(Machine(read_linkage(LINKAGES / "tipper.toml")), 0.1)
    (entry,) = data["equilibria"]
    assert entry["holding"]["unit"] == data["over_the_way"]["holding"]["unit"] == "N"
    assert entry["place"] == {"value": 0.2, "unit": "m"} and entry["inertia"]["unit"] == "kg"
    assert entry["stiffness"] == {"value": None, "unit": "N/m"}
    assert "On its stop at 0.200 m the driver rests with 56.4 kN on it" in words


@pytest.mark.second
def test_a_machine_without_a_potential_or_a_torque_is_told():
    lifting = four_bar(loads={"own": {**TORQUE, "torque": -1.0}})
    data, words, _ = report_of(lifting)
    assert "A turn takes 6.28 J from the driver, without friction: no potential belongs to a place" in words
    assert data["equilibria"][0]["potential"] == {"value": None, "unit": "J"}
    assert "potential" not in data["over_the_way"] and data["without_potential"] == ["own"]
    winding = four_bar(parameters={"k": "2 N m"}, loads={"own": {**TORQUE, "torque": "-k * phi"}})
    _, words, _ = report_of(winding)
    assert (
        "The loads are not the same after a turn: the way is half a turn to either side of the start" in words
    )
    found = linkage_report(linkage_findings(four_bar(gravity=0.0), 1.0), "file.toml")
    assert "No load has a torque at the driver: at rest the machine stays wherever it is." in plain(found)
    assert found.result["rest"]["indifferent"] is True


# -- zeros


@pytest.mark.parametrize("width", [0.1, 3e-3, 1e-3, 3e-4])
def test_a_narrow_dip_is_not_missed(width):
    """A dip below zero between two places of a way that is 2 long, and one that ends just above zero."""

    def dip(depth):
        def at(x):
            z = (x - 1.23456) / width
            bell = np.exp(-np.minimum(z * z, 600.0))
            return 1.0 - depth * bell, 2.0 * depth * z / width * bell

        return zeros(at, sampled(at, 0.0, 2.0), 1e-12, None)

    one, other = dip(2.0)
    reach = width * math.sqrt(math.log(2.0))
    assert (one.begin, other.begin) == pytest.approx((1.23456 - reach, 1.23456 + reach), rel=1e-12)
    assert (one.before, one.behind, other.before, other.behind) == (1.0, -1.0, -1.0, 1.0)
    assert dip(0.9999) == []
    (touched,) = dip(1.0)
    assert (
        touched.begin == pytest.approx(1.23456, abs=1e-6 * width) and touched.before == touched.behind == 1.0
    )
