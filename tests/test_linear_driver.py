"""A driver that slides: against closed forms, in Python and as FMUs with their units."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import fmpy
import numpy as np
import pytest
from by_itself import moved_by_itself
from command import chainunit
from fmpy.validation import validate_fmu

from chainunit.core.engines import MATH, numpy_
from chainunit.core.errors import InputError
from chainunit.core.native.compilers import compiler
from chainunit.fmu.native.export import export
from chainunit.machines.linkages.file import description_of, read_linkage
from chainunit.machines.linkages.model import machine_of
from chainunit.machines.machine import Machine
from chainunit.mechanism.end_stops import EndStops, stop_action
from chainunit.study import config

LIFT = Path(__file__).parents[1] / "examples" / "linkages" / "cylinder_lift.toml"
TRAMMEL = {
    "ground": {"O": [0, 0], "X": [1, 0], "Y": [0, 1]},
    "driver": {"joint": "cylinder", "range": [0.1, 0.4]},
    "links": {
        "ram": {"points": {"P": [0, 0]}, "mass": 3.0},
        "rod": {
            "points": {"P": [0, 0], "C": [0.5, 0]}, "mass": 2.0, "inertia": 0.25 / 6.0, "centroid": [0.25, 0]
        },
        "top": {"points": {"C": [0, 0]}, "mass": 1.0},
    },
    "joints": {
        "cylinder": {"on": "ram.P", "by": "ground.O", "toward": "X"},
        "guide": {"on": "top.C", "by": "ground.O", "toward": "Y"},
    },
    "start": {"phi": 0.3, "points": {"C": [0, 0.4]}},
}  # fmt: skip
"""A rod between two rails at a right angle: an elliptic trammel."""


def trammel():
    return machine_of(description_of(TRAMMEL, "trammel"))


def test_trammel_in_closed_form():
    machine = Machine(trammel())
    for q in (0.1, 0.25, 0.4):
        w, a, height = 0.7, 1.3, math.sqrt(0.25 - q * q)
        out = machine.outputs(q, w, a)
        spin = 1.0 / height
        J = 3.0 + (2.0 * 0.0625 + 0.25 / 6.0) * spin**2 + (q / height) ** 2
        # kinetic energy by the way, and the weights of half the rod and the block above
        dJ = 2.0 * q / height**4 * (2.0 * 0.0625 + 0.25 / 6.0) + 2.0 * q / height**2 + 2.0 * q**3 / height**4
        tau = J * a + 0.5 * dJ * w * w - 2.0 * 9.81 * q / height
        assert float(out.J) == pytest.approx(J, rel=1e-12)
        assert float(out.dJ_dphi) == pytest.approx(dJ, rel=1e-12)
        assert float(out.tau) == pytest.approx(tau, rel=1e-12)
        assert float(out.cylinder.s) == pytest.approx(q, rel=1e-14)
        assert (float(out.cylinder.v), float(out.cylinder.a)) == pytest.approx((w, a), rel=1e-13)


@pytest.mark.parametrize("on_ground", [False, True])
def test_the_joint_may_be_described_from_either_side(on_ground):
    """The line in the ground, or in the link that is driven: the same machine."""
    data = {**TRAMMEL, "joints": dict(TRAMMEL["joints"]), "links": dict(TRAMMEL["links"])}
    if on_ground:
        data["links"]["ram"] = {"points": {"P": [0, 0], "back": [-1, 0]}, "mass": 3.0}
        data["joints"]["cylinder"] = {"on": "ground.O", "by": "ram.P", "toward": "back"}
        data["start"] = {"phi": 0.3, "points": {"C": [0, 0.4], "P": [0.3, 0]}}
    machine = Machine(machine_of(description_of(data, "trammel_again")))
    plain = Machine(trammel())
    for q in (0.12, 0.33):
        one, other = (m.outputs(q, 0.7, 1.3) for m in (machine, plain))
        assert float(one.tau) == pytest.approx(float(other.tau), rel=1e-12)
        assert float(one.rod.angle) == pytest.approx(float(other.rod.angle), rel=1e-12)
        assert float(one.cylinder.s) == pytest.approx(q, rel=1e-13)
        sign = -1.0 if on_ground else 1.0
        assert float(one.cylinder.fy) == pytest.approx(sign * float(other.cylinder.fy), rel=1e-12)


@pytest.mark.skipif(compiler() is None, reason="no C compiler")
def test_fmus_have_the_units_of_a_way(tmp_path):
    model = trammel()
    file = export(model, tmp_path / "trammel.fmu")
    assert not validate_fmu(str(file))
    units = {v.name: v.unit for v in fmpy.read_model_description(str(file)).modelVariables}
    wanted = {
        "phi": "m",
        "w": "m/s",
        "a": "m/s2",
        "tau": "N",
        "J": "kg",
        "dJ_dphi": "kg/m",
        "tau_bias_dw": "N.s/m",
    }
    assert {name: units[name] for name in wanted} == wanted
    values = fmpy.simulate_fmu(
        str(file), stop_time=0.01, step_size=0.01, output=["tau", "tau_bias_dphi"], fmi_type="CoSimulation",
        start_values={"phi": 0.25, "w": 0.7, "a": 1.3},
    )[0]  # fmt: skip
    assert values["tau"] == pytest.approx(float(Machine(model).outputs(0.25, 0.7, 1.3).tau), rel=1e-12)
    # by differences
    h = 1e-6
    near = [float(Machine(model).outputs(0.25 + k * h, 0.7, 0.0).tau) for k in (-1, 1)]
    assert values["tau_bias_dphi"] == pytest.approx((near[1] - near[0]) / (2.0 * h), rel=1e-7)


@pytest.mark.skipif(compiler() is None, reason="no C compiler")
def test_the_direct_model_keeps_its_energy(tmp_path):
    """A constant force: the work that it does is the energy that the machine gains."""
    file = export(trammel().direct(), tmp_path / "direct.fmu")
    rows = fmpy.simulate_fmu(
        str(file), stop_time=0.1, output_interval=0.01, fmi_type="CoSimulation",
        start_values={"phi_start": 0.2, "tau": -5.0}, output=["phi", "kinetic_energy", "potential_energy"],
    )  # fmt: skip
    energy = rows["kinetic_energy"] + rows["potential_energy"]
    work = -5.0 * (rows["phi"] - rows["phi"][0])
    assert np.max(np.abs(energy - energy[0] - work)) < 1e-6 * np.max(np.abs(work))


def test_a_way_outside_the_range_is_refused():
    with pytest.raises(InputError, match=r"phi = 0\.6 m: must be >= 0\.1 m and <= 0\.4 m"):
        Machine(trammel()).outputs(0.6)


def test_a_lever_that_a_cylinder_lifts(tmp_path):
    """The example: the force by the weights alone, from the geometry of two circles."""
    machine = Machine(read_linkage(LIFT))
    q = np.linspace(0.35, 0.75, 9)
    out = machine.outputs(q, 0.0, 0.0, machine.model.Feed(payload=6000.0))
    height = lambda q: machine.outputs(q).lever.W.y * 6000.0 + 9.81 * (  # noqa: E731
        18.0 * machine.outputs(q).rod.P.y + 60.0 * machine.outputs(q).lever.centroid.y
        + 12e-4 * 7850.0 * 0.5 * machine.outputs(q).link.centroid.y
    )  # fmt: skip
    h = 1e-6
    wanted = (height(q[1:-1] + h) - height(q[1:-1] - h)) / (2.0 * h)
    assert np.asarray(out.tau)[1:-1] == pytest.approx(wanted, rel=1e-7)
    done = chainunit("linkage", str(LIFT), "-o", "lift", cwd=tmp_path)
    assert done.returncode == 0 and "rod + RRR dyad (link, lever)" in done.stdout and "m/s" in done.stdout


def test_a_study_needs_a_driver_that_turns(tmp_path):
    with pytest.raises(InputError, match="has a driver that slides, and a motor turns"):
        config.parse(f'[machine]\nlinkage = "{LIFT.as_posix()}"', str(tmp_path / "mine.toml"))


JIB = {
    "ground": {"P": [0.0, 0.0], "Q": [0.8, 0.15]},
    "driver": {"joint": "cylinder", "range": [0.45, 0.75]},
    "links": {
        "barrel": {
            "points": {"P": [0, 0], "S": [0.1, 0.02], "S2": [0.5, 0.02]},
            "mass": 25.0, "inertia": 0.6, "centroid": [0.2, 0.01],
        },
        "rod": {
            "points": {"C": [0.35, -0.03], "E": [0.0, 0.0]}, "mass": 11.0, "inertia": 0.3, "centroid": [0.15, 0.0]
        },
        "jib": {
            "points": {"Q": [0, 0], "C": [0.3, 0.45], "W": [-0.2, 1.7]},
            "mass": 80.0, "inertia": 20.0, "centroid": [0.05, 0.7],
        },
        "stay": {"points": {"W": [0, 0], "V": [0.9, 0]}, "mass": 5.0, "inertia": 0.4, "centroid": [0.45, 0.0]},
        "mast": {"points": {"M": [0, 0], "V": [0.8, 0]}, "mass": 7.0, "inertia": 0.5, "centroid": [0.4, 0.0]},
    },
    "joints": {"cylinder": {"on": "rod.E", "by": "barrel.S", "toward": "S2", "angle": 0.1}},
    "loads": {"payload": {"on": "jib.W", "force": [300.0, -5000.0]}},
    "guides": {"friction": 0.1, "damping": 20.0},
    "pins": {"friction": 0.1, "diameter": 0.05, "damping": 1.0},
}  # fmt: skip
JIB["ground"]["M"] = [-0.9, 1.5]
JIB["start"] = {
    "phi": 0.6,
    "points": {"C": [0.75, 0.7], "V": [-0.1, 1.3]},
    "angles": {"barrel": 0.75, "jib": -0.1},
}
"""A cylinder that is pinned at both ends swings a jib; a dyad hangs on the jib. No line goes through a pin."""


def jib(reverse=False):
    data = JIB
    if reverse:
        # the same joint, described from the other side
        links = {name: dict(each) for name, each in JIB["links"].items()}
        c, s = math.cos(-0.1), math.sin(-0.1)
        links["rod"]["points"] = {**links["rod"]["points"], "back": [-c, -s]}
        joint = {"on": "barrel.S", "by": "rod.E", "toward": "back", "angle": -0.1}
        data = {**JIB, "links": links, "joints": {"cylinder": joint}}
    return Machine(machine_of(description_of(data, f"jib_{reverse}")))


def test_a_cylinder_that_is_pinned_at_both_ends():
    """Both routes to the force, slopes by dual numbers, and the balance of energy."""
    machine = jib()
    assert [group.kind for group in machine.model.described_by.structure.groups] == ["cylinder", "RRR"]
    for q, w, a in ((0.5, 0.4, -0.8), (0.62, -0.7, 2.0), (0.7, 0.2, 0.0)):
        u = machine.inputs({"phi": q, "w": w, "a": a})
        state = machine.state(u)
        losses = sum(state.effects[name].dissipative for name in ("pins", "guides"))
        assert state.torque_by_reactions(a) + losses == pytest.approx(state.torque(a), rel=1e-12)
        out = machine.outputs(q, w, a)
        assert float(out.cylinder.s) == pytest.approx(q, rel=1e-12)
        assert (float(out.cylinder.v), float(out.cylinder.a)) == pytest.approx((w, a), rel=1e-12)
        # C lies on rod and jib, whatever the offsets
        assert (float(out.rod.C.x), float(out.rod.C.y)) == pytest.approx(
            (float(out.jib.C.x), float(out.jib.C.y))
        )
        assert (float(out.rod.C.ax), float(out.rod.C.ay)) == pytest.approx(
            (float(out.jib.C.ax), float(out.jib.C.ay))
        )
        assert float(out.rod.angle - out.barrel.angle) == pytest.approx(0.1, abs=1e-12)
        h = 1e-5

        def bias(q, w):
            return float(machine.outputs(q, w, 0.0).tau)

        slopes = machine.evaluate({"phi": q, "w": w})
        by_q = (bias(q - 2 * h, w) - 8 * bias(q - h, w) + 8 * bias(q + h, w) - bias(q + 2 * h, w)) / (12 * h)
        by_w = (bias(q, w - 2 * h) - 8 * bias(q, w - h) + 8 * bias(q, w + h) - bias(q, w + 2 * h)) / (12 * h)
        assert float(slopes["tau_bias_dphi"]) == pytest.approx(by_q, rel=1e-7)
        assert float(slopes["tau_bias_dw"]) == pytest.approx(by_w, rel=1e-6, abs=1e-4)


def test_each_link_of_a_cylinder_is_in_balance():
    """Newton's and Euler's equations of barrel, rod and jib, from the outputs alone, moments about the centroids."""
    frictionless = {**JIB, "guides": {}, "pins": {}}
    machine = Machine(machine_of(description_of(frictionless, "jib_smooth")))
    q, w, a = 0.62, -0.7, 2.0
    o = machine.evaluate({"phi": q, "w": w, "a": a})
    value = lambda name: float(o[name])  # noqa: E731

    def vector(name):
        return np.array([value(f"{name}.fx"), value(f"{name}.fy")])

    def at(point):
        return np.array([value(f"{point}.x"), value(f"{point}.y")])

    line = at("barrel.S2") - at("barrel.S")
    force = float(o["tau"]) * line / np.hypot(*line)
    guide, moment = vector("cylinder"), value("cylinder.moment")
    on = {
        "barrel": [(vector("P"), at("barrel.P")), (-guide, at("rod.E")), (-force, at("rod.E"))],
        "rod": [(guide, at("rod.E")), (force, at("rod.E")), (-vector("C"), at("rod.C"))],
        "jib": [(vector("C"), at("rod.C")), (vector("Q"), at("jib.Q")), (-vector("W"), at("jib.W")),
                (np.array([300.0, -5000.0]), at("jib.W"))],
    }  # fmt: skip
    assert machine.model.described_by.structure.joints["C"].on[0] == "jib"
    for name, acting in on.items():
        body = JIB["links"][name]
        acceleration = np.array([value(f"{name}.centroid.ax"), value(f"{name}.centroid.ay") + 9.81])
        total = sum(f for f, _ in acting)
        assert total == pytest.approx(body["mass"] * acceleration, rel=1e-9, abs=1e-6), name
        couple = {"barrel": -moment, "rod": moment, "jib": 0.0}[name]
        for f, place in acting:
            arm = place - at(f"{name}.centroid")
            couple += arm[0] * f[1] - arm[1] * f[0]
        assert couple == pytest.approx(body["inertia"] * value(f"{name}.a"), rel=1e-9, abs=1e-6), name


def test_a_cylinder_described_from_the_other_side_is_the_same():
    one, other = jib(), jib(reverse=True)
    for q in (0.5, 0.7):
        a, b = (m.outputs(q, 0.4, -0.8) for m in (one, other))
        assert float(a.tau) == pytest.approx(float(b.tau), rel=1e-11)
        assert float(b.cylinder.s) == pytest.approx(q, rel=1e-12)
        assert float(a.jib.angle) == pytest.approx(float(b.jib.angle), rel=1e-12)
        assert (float(a.Q.fx), float(a.Q.fy)) == pytest.approx((float(b.Q.fx), float(b.Q.fy)), rel=1e-9)


def test_what_is_no_cylinder_is_refused():
    links = {name: dict(each) for name, each in JIB["links"].items()}
    links["rod"]["points"] = {"E": [0.0, 0.0]}
    links["barrel"]["points"] = {**links["barrel"]["points"], "C": [0.9, 0.0]}
    with pytest.raises(InputError, match="must be a cylinder: one of them on a pin of the ground"):
        machine_of(description_of({**JIB, "links": links}, "loose"))


@pytest.mark.parametrize("ratio", [1.0, 1.25])
def test_a_driver_that_moves_by_itself_stays_in_its_range(ratio):
    """Without a force it falls from the middle of its range onto its lower end stop, and rests there; with a large
    one it goes to the upper one. No energy is lost but in the pins and the stops."""
    model = read_linkage(LIFT.with_name("tipper.toml")).direct()
    low, high = (ratio * end for end in model.inverse.span)
    p = model.check(replace(model.Parameters(), ratio=ratio))
    for tau, end, sign in ((0.0, low, -1.0), (1.5e5 / ratio, high, 1.0)):
        states, way, after, gained = moved_by_itself(model, p, model.Inputs(tau=tau), 1.2, 24, 1e-6, 1e3)
        assert low - 0.01 < min(way) and max(way) < high + 0.01
        assert states[0] == pytest.approx(end, abs=3e-4) and abs(states[1]) < 1e-3
        assert gained == pytest.approx(states[2], rel=1e-4)
        # at rest the stop carries the difference
        assert after.end_stop_force == pytest.approx(ratio * (tau - after.tau_bias), rel=1e-2)
        assert sign * after.end_stop_force > 0.0


def test_end_stops_push_and_never_pull():
    law, span = EndStops(stiffness=1e6, damping=1e4), (0.2, 1.2)
    for w in (-50.0, -1.0, 0.0, 1.0, 50.0):
        assert all(stop_action(MATH, law, span, q, w) == (0.0, 0.0, 0.0) for q in (0.2, 0.7, 1.2))
        for q, sign in ((1.21, 1.0), (1.20012, 1.0), (0.19, -1.0)):
            action = stop_action(MATH, law, span, q, w)
            assert sign * action.force >= 0.0 and action.lost * w >= 0.0
    upper, lower = (stop_action(MATH, law, span, q, 0.0) for q in (1.21, 0.19))
    assert upper.force == pytest.approx(1e4, rel=0.02) and lower.force == pytest.approx(-1e4, rel=0.02)
    assert stop_action(MATH, law, span, 1.21, 0.2).lost == pytest.approx(2e3, rel=0.02)


@pytest.mark.parametrize("end", [0.19, 1.21])
def test_the_energy_of_an_end_stop_is_the_work_of_its_spring(end):
    """A second route: the integral of the force at rest over the way, and the slope of the energy."""
    law, span = EndStops(stiffness=1e6, damping=1e4), (0.2, 1.2)
    q = np.linspace(0.7, end, 200001)
    actions = stop_action(numpy_(), law, span, q, 0.0 * q)
    np.testing.assert_allclose(np.trapezoid(actions.force, q), actions.energy[-1], rtol=1e-6)
    assert np.all(actions.lost == 0.0) and actions.energy[-1] == pytest.approx(50.0, rel=0.02)


@pytest.mark.second
@pytest.mark.skipif(compiler() is None, reason="no C compiler")
@pytest.mark.parametrize("name", ["tipper", "cylinder_lift"])
def test_the_fmu_of_a_cylinder_stays_in_its_range_in_its_default_experiment(name, tmp_path):
    model = read_linkage(LIFT.with_name(f"{name}.toml")).direct()
    low, high = model.inverse.span
    file = export(model, tmp_path / "direct.fmu")
    run = fmpy.simulate_fmu(str(file), output=["phi", "end_stop_force", "tau_bias"], output_interval=0.05)
    assert run["time"][-1] == pytest.approx(10.0)
    assert np.all(run["phi"] > low - 0.01 * (high - low)) and np.all(run["phi"] < high)
    assert run["phi"][-1] == pytest.approx(low, abs=3e-4 * (high - low))
    assert run["end_stop_force"][-1] == pytest.approx(-run["tau_bias"][-1], rel=1e-3)
