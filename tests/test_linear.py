"""The linear model of a model at a point, against differences and the speed loop of a study."""

from __future__ import annotations

import doctest
import itertools
import json
import math
import re
from pathlib import Path

import control
import numpy as np
import pytest
from records import record_of

from chainunit import InputError, LinearModel, RunError, Study, linearize
from chainunit.batch import transients
from chainunit.core.engines import MATH
from chainunit.core.model import Model, Part
from chainunit.core.quantities import base_units, declaration, quantity
from chainunit.drives.motor import T_RATED
from chainunit.models import MODELS
from chainunit.reading.results import as_data
from chainunit.study import config, linear
from chainunit.study.choice import choose
from chainunit.study.linear import linear_point
from chainunit.study.package import drive_to_export
from chainunit.study.rig import Rig
from chainunit.system import monolithic
from chainunit.system.linear import labels
from chainunit.system.linear import linearize as linearize_model
from chainunit.system.poles import poles_of

EXAMPLES = Path(__file__).parents[1] / "examples"
GALLERY = (
    *("watt_six_bar", "stephenson_six_bar", "dwell_six_bar", "knife_drive", "slider_crank_press"),
    *("scotch_yoke_pump", "pump_jack", "cylinder_lift", "level_luffing_crane", "tipper"),
)


def moved(model, seed=1):
    """Inputs and states by name near the start of a model, where it moves and where all is smooth."""
    rng = np.random.default_rng(seed)
    p = model.check(model.Parameters())

    def near(variables, values):
        return {
            v.name: x + 0.2 * max(v.quantity.nominal or 1.0, abs(x)) * rng.uniform(0.3, 1.0)
            for v, x in zip(variables, values, strict=True)
        }

    inputs = near(model.input_layout.variables, [v.quantity.start for v in model.input_layout.variables])
    states = {}
    if model.state_layout:
        x = model.begin(p, model.Inputs())
        states = near(model.state_layout.variables, model.state_layout.values(x))
    return inputs, states


def rows(model, p, inputs, states):
    """Derivatives of the states, states and outputs, by the equations with floats."""
    u = model.input_layout.from_names(inputs)
    x, rates = None, []
    if model.state_layout:
        x = model.state_layout.from_names(states)
        rates = [*model.derivatives(MATH, p, u, x), *model.state_layout.values(x)]
    parts = zip(model.parts, model.evaluate(MATH, p, u, x), strict=True)
    outputs = [
        y
        for part, out in parts
        for v, y in zip(part.layout.variables, part.layout.values(out), strict=True)
        if v.type == "Real"
    ]
    return np.array([*rates, *outputs], float)


def check_slopes(model, p, inputs, states, tolerance=1e-7):
    """Compare A, B, C, D with central differences, extrapolated to distance zero by Richardson's rule."""
    found = linearize_model(model, p, inputs, states)
    inputs = {s.name: s.value for s in found.inputs}
    states = {s.name: s.value for s in found.states}
    own = np.block([[found.A, found.B], [found.C, found.D]])
    values = rows(model, p, inputs, states)
    told = [s.rate.value for s in found.states] + [s.value for s in found.outputs]
    np.testing.assert_allclose(told, values, rtol=1e-9, atol=1e-9 * np.max(np.abs(values), initial=1.0))
    variables = {
        v.name: v for layout in (model.state_layout, model.input_layout) if layout for v in layout.variables
    }
    names = [*states, *inputs]
    sizes = np.array([max(variables[k].quantity.nominal or 1.0, abs({**states, **inputs}[k])) for k in names])
    scale = np.max(np.abs(own) * sizes, axis=1, initial=0.0) + np.abs(values) + 1e-6
    for column, (name, size) in enumerate(zip(names, sizes, strict=True)):
        table = []
        for h in (4e-4 * size / 2**k for k in range(3)):
            ends = []
            for sign in (1.0, -1.0):
                either = [
                    {k: x + sign * h * (k == name and of is group) for k, x in of.items()}
                    for of in (inputs, states)
                    for group in [states if column < len(states) else inputs]
                ]
                ends.append(rows(model, p, *either))
            table.append((ends[0] - ends[1]) / (2.0 * h))
        first = [(4.0 * b - a) / 3.0 for a, b in itertools.pairwise(table)]
        difference = (16.0 * first[1] - first[0]) / 15.0
        off = np.abs(own[:, column] - difference) * size / scale
        assert np.max(off) < tolerance, (model.name, name, int(np.argmax(off)), np.max(off))
    return found


@pytest.mark.parametrize("name", [n for n in MODELS if n not in ("ChainUnitFlexible", "LoadObserver")])
def test_slopes_of_packaged_models_are_those_of_differences(name):
    model = MODELS[name]
    found = check_slopes(model, model.check(model.Parameters()), *moved(model))
    assert np.abs(found.D).max() > 0.0 and bool(found.states) == (model.States is not None)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ChainUnitFlexible", "LoadObserver"])
def test_slopes_of_large_models_are_those_of_differences(name):
    model = MODELS[name]
    check_slopes(model, model.check(model.Parameters()), *moved(model))


@pytest.mark.stages(first=5)
@pytest.mark.parametrize("inverse", [False, True])
@pytest.mark.parametrize("name", GALLERY)
def test_slopes_of_linkages_are_those_of_differences(name, inverse):
    point = linear_point(str(EXAMPLES / "linkages" / f"{name}.toml"), inverse=inverse)
    found = check_slopes(point.model, point.parameters, point.inputs, point.states)
    assert len(found.states) == (0 if inverse else 2) and not found.bends


@pytest.fixture(scope="module")
def drive():
    return linear_point(str(EXAMPLES / "jam_with_driveline.toml"), "start_up:0.4 s")


def test_the_point_of_a_run_needs_no_compiler(monkeypatch):
    """Without one Python makes the run."""
    file, at = str(EXAMPLES / "jam_with_driveline.toml"), "start_up:0.02 s"
    wanted = linear_point(file, at).states
    monkeypatch.setattr(transients, "compiler", lambda: None)
    assert linear_point(file, at).states == pytest.approx(wanted, rel=1e-5, abs=1e-9)


def test_slopes_of_the_compiled_drive_are_those_of_differences(drive):
    found = check_slopes(drive.model, drive.parameters, drive.inputs, drive.states)
    assert {"motor.w", "driveline.driven.w"} <= {s.name for s in found.states}
    assert drive.words == "start_up, t = 0.4 s"
    state = {s.name: s for s in found.states}
    assert state["motor.phi"].rate.value == state["motor.w"].value and state["motor.w"].rate.unit == "rad/s2"


# -- the speed loop of a study


def _speed_loop(p, inertia):
    """The open loop by python-control, and the response of the speed to the load."""
    s = control.tf("s")
    current = p.current_control.kp + p.current_control.ki / s
    current = control.feedback(control.minreal(current / (p.armature.L * s + p.armature.R), verbose=False), 1)
    torque = control.minreal(
        (p.speed_control.kp + p.speed_control.ki / s) * current * p.armature.k, verbose=False
    )
    by_load = control.minreal(control.feedback(-1.0 / (inertia * s), -torque), verbose=False)
    return control.minreal(torque / (inertia * s), verbose=False), by_load


@pytest.mark.parametrize("factor", [1.0, 0.4, 3.0])
def test_the_speed_loop_is_that_of_python_control(factor):
    """Also with gains whose zero does not cancel the pole of the armature."""
    motor = MODELS["DcMotor"]
    usual = motor.parameter_layout.from_names({})
    gains = {
        "speed_control.ki": factor * usual.speed_control.ki,
        "current_control.ki": usual.current_control.ki / factor,
        "current_control.kp": usual.current_control.kp * factor,
    }
    p = motor.parameter_layout.from_names(gains)
    loop = motor.speed_loop(p, 0.9)
    open_loop, by_load = _speed_loop(p, 0.9)
    _, phase, _, crossover = control.margin(open_loop)
    np.testing.assert_allclose([loop.phase_margin, loop.crossover], [phase, crossover], rtol=1e-9)
    answer = open_loop(1j * loop.frequency)
    np.testing.assert_allclose(loop.gain * np.exp(1j * np.radians(loop.phase)), answer, rtol=1e-9)
    np.testing.assert_allclose(
        control.step_response(by_load, loop.time).outputs, loop.deviation, atol=1e-9 * loop.largest_deviation
    )


def test_poles_of_the_speed_loop_are_those_of_the_study():
    motor = MODELS["DcMotor"]
    lossless = {n: 0.0 for n in ("rotor.d", "rotor.friction") if n in motor.parameter_layout.names}
    p = motor.parameter_layout.from_names(lossless)
    load = 0.7
    inertia = p.rotor.J + load
    found = linearize_model(motor, p, {"load.J": load, "w_ref": 50.0}, {"w": 50.0, "phi": 1.0})
    loop = motor.speed_loop(p, inertia)
    open_loop, by_load = _speed_loop(p, inertia)
    closed = control.feedback(open_loop, 1)
    own = [
        complex(pole.real, sign * pole.imaginary)
        for pole in found.poles
        for sign in (1, -1)[: 1 + bool(pole.imaginary)]
    ]
    for pole in closed.poles():
        assert min(abs(each - pole) for each in own) < 1e-6 * abs(pole), (pole, own)
    # the deviation after a step of the load, as the study draws it
    response = found.response("load.tau_bias", "w", loop.crossover * np.array([0.1, 1.0, 10.0]))
    np.testing.assert_allclose(response, by_load(1j * loop.crossover * np.array([0.1, 1.0, 10.0])), rtol=1e-6)
    step = control.step_response(found.state_space()["w", "load_tau_bias"], loop.time)
    np.testing.assert_allclose(step.outputs, loop.deviation, atol=1e-6 * loop.largest_deviation)


@pytest.mark.parametrize(
    "of", ["", (EXAMPLES / "jam_with_driveline.toml").read_text()], ids=["packaged", "line"]
)
def test_poles_of_the_loop_that_a_study_shows(of):
    """By the numbers and curves of its result alone: margin and crossover; the drawn open loop, which closed gives
    the response of the linear model; and the drawn deviation, which is a sum of the exponentials of its poles."""
    loaded = config.parse(of)
    drive = choose(loaded, Path(), lambda *_: None).drive
    study = record_of(loaded, drive)
    lossless = {n: 0.0 for n in ("rotor.d", "rotor.friction") if n in drive.motor.parameter_layout.names}
    p = drive.motor.parameter_layout.from_names(lossless, drive.fmu_parameters)
    assert set(study.setup.statics.loops) == {"mean inertia", "least inertia", "largest inertia"}
    for loop in study.setup.statics.loops.values():
        shown = as_data(loop)
        inputs = {"load.J": loop.inertia - p.rotor.J, "w_ref": 50.0}
        found = linearize_model(drive.motor, p, inputs, {"w": 50.0, "armature.T": T_RATED})
        closed = found.response("w_ref", "w", loop.frequency)
        drawn = loop.gain * np.exp(1j * np.radians(loop.phase))
        np.testing.assert_allclose(closed, drawn / (1.0 + drawn), rtol=1e-6)
        (at,) = found.response("w_ref", "w", [shown["crossover"]["value"]])
        at = at / (1.0 - at)
        assert abs(at) == pytest.approx(1.0, rel=1e-6)
        assert 180.0 + math.degrees(np.angle(at)) == pytest.approx(shown["phase_margin"]["value"], rel=1e-6)
        # the poles of states on which the speed depends
        poles = [pole for pole in found.poles if pole.real < -0.01 and pole.state != "armature.T"]
        of_poles = [complex(q.real, s * q.imaginary) for q in poles for s in (1, -1)[: 1 + bool(q.imaginary)]]
        assert len(of_poles) == 4 and max(map(abs, of_poles)) > loop.crossover > min(map(abs, of_poles))

        def left(factor, loop=loop, of_poles=of_poles):
            basis = np.exp(np.outer(loop.time, np.array(of_poles) * factor))
            rest = loop.deviation - basis @ np.linalg.lstsq(basis, loop.deviation, rcond=None)[0]
            return np.max(np.abs(rest)) / loop.largest_deviation

        assert left(1.0) < 1e-7 < 1e-5 < min(left(0.98), left(1.02))


def test_signs_and_units_of_a_motor():
    found = linearize("DcMotor")
    at = {s.name: k for k, s in enumerate(found.states)}
    p = MODELS["DcMotor"].Parameters()
    A = found.A
    assert A[at["phi"], at["w"]] == 1.0 and found.unit_of("A", at["phi"], at["w"]) == "1"
    assert A[at["w"], at["armature.i"]] == pytest.approx(p.armature.k / p.rotor.J)
    assert found.unit_of("A", at["w"], at["armature.i"]) == "rad/(s2.A)"
    k = [s.name for s in found.inputs].index("load.tau_bias")
    assert found.B[at["w"], k] == pytest.approx(-1.0 / p.rotor.J)
    assert base_units(found.unit_of("B", at["w"], k)) == base_units("rad/(s2.N.m)")
    assert found.unit_of("D", 0, k) == "J/(N.m)" and found.unit_of("C", 1, at["w"]) == "s"


# -- points of runs


def test_the_point_of_a_run_is_that_of_the_monolithic_solution(drive):
    """The states at 0.4 s, by an independent solver."""
    loaded = config.load(EXAMPLES / "jam_with_driveline.toml")
    own = drive_to_export(loaded)
    rig = Rig(loaded.operation, own, None)
    rows = monolithic(rig.graph, rig.signals(ramp=True), [0.0, 0.4], rtol=1e-9)
    for name, value in drive.states.items():
        nominal = max(abs(float(rows[name][-1])), 1.0)
        assert value == pytest.approx(float(rows[name][-1]), abs=2e-6 * nominal), name
    assert drive.inputs["motor.w_ref"] == pytest.approx(float(rig.signals(ramp=True)["motor.w_ref"](0.4)))


@pytest.mark.second
def test_points_of_steady_running_and_of_an_event():
    study = Study.from_file(EXAMPLES / "jam_trips_coupling.toml")
    steady = linearize(study)
    force = next(s.value for s in steady.inputs if s.name == "machine.left.processing_force")
    speed = next(s for s in steady.states if s.name == "motor.w")
    reference = next(s.value for s in steady.inputs if s.name == "motor.w_ref")
    assert steady.at.startswith("steady running") and speed.value == pytest.approx(reference, rel=0.1)
    with pytest.raises(InputError, match="the event begins at") as refused:
        linearize(study, "jam_left:0.1 s")
    begin = float(re.search(r"begins at ([\d.]+) s", str(refused.value))[1])
    before, later = (linearize(study, f"jam_left:{begin + by:.4f} s") for by in (-0.05, 0.01))
    forces = [
        next(s.value for s in each.inputs if s.name == "machine.left.processing_force")
        for each in (before, later)
    ]
    assert forces[0] == force < forces[1]
    with pytest.raises(RunError, match="the torque limiter opens at t = "):
        linearize(study, f"jam_left:{begin + 3.0:.4f} s")


# -- places that are not smooth


@declaration
class KinksParameters:
    stiffness: float = quantity("N/m", "of the stop", default=100.0)


@declaration
class KinksInputs:
    force: float = quantity("N", "on the mass", default=0.0)


@declaration
class KinksStates:
    x: float = quantity("m", "place")
    v: float = quantity("m/s", "speed")


@declaration
class KinksOutputs:
    stop: float = quantity("N", "force of the stop")
    root: float = quantity("1", "a root")


def derivatives_of_kinks(xp, p, u, x):
    friction = x.v / xp.sqrt(x.v * x.v + 1e-10)
    return [x.v, u.force - p.stiffness * xp.maximum(x.x, 0.0) - friction]


def outputs_of_kinks(xp, p, u, x, shared):
    return KinksOutputs(stop=p.stiffness * xp.maximum(x.x, 0.0), root=xp.sqrt(xp.maximum(x.x, 0.0)))


Kinks = Model(
    name="Kinks",
    description="a mass on a stop",
    Parameters=KinksParameters,
    Inputs=KinksInputs,
    States=KinksStates,
    derivatives=derivatives_of_kinks,
    parts=(Part(KinksOutputs, outputs_of_kinks),),
)


def test_kinks_and_bends_are_told():
    found = linearize_model(Kinks, None, {}, {"x": 0.0, "v": 0.0})
    by = {bend.by: bend for bend in found.bends}
    assert set(by) == {"x", "v"}
    assert by["x"].kink and {"der(v)", "stop", "root"} == set(by["x"].rows)
    assert not by["v"].kink and by["v"].rows == ("der(v)",) and by["v"].within.unit == "m/s"
    # away from both all is smooth
    assert not linearize_model(Kinks, None, {}, {"x": 0.5, "v": 1.0}).bends
    # a square has a slope of 0 at its least place, and no kink
    assert not linearize("Accelerator").bends


@declaration
class MeshingParameters:
    stiffness: float = quantity("N.m", "stiffness", default=1.0)


@declaration
class MeshingInputs:
    torque: float = quantity("N.m", "torque", default=0.0)


@declaration
class MeshingStates:
    phi: float = quantity("rad", "angle")


@declaration
class MeshingOutputs:
    stop: float = quantity("N.m", "torque of the stop")


def derivatives_of_meshing(xp, p, u, x):
    return [u.torque]


def outputs_of_meshing(xp, p, u, x, shared):
    return MeshingOutputs(stop=p.stiffness * xp.maximum(xp.sin(x.phi), 0.0))


Meshing = Model(
    name="Meshing",
    description="a stop in each turn",
    Parameters=MeshingParameters,
    Inputs=MeshingInputs,
    States=MeshingStates,
    derivatives=derivatives_of_meshing,
    parts=(Part(MeshingOutputs, outputs_of_meshing),),
)


def test_an_angle_of_many_turns_has_no_bend_of_another_turn():
    """A thousandth of 1e4 turns would be ten turns."""
    turns = 2.0 * math.pi * 1e4
    assert not linearize_model(Meshing, None, {}, {"phi": turns + 1.0}).bends
    (bend,) = linearize_model(Meshing, None, {}, {"phi": turns + 3e-4}).bends
    assert bend.by == "phi" and bend.within.value == pytest.approx(2e-3 * math.pi)


def test_a_slope_that_is_not_defined_is_told():
    found = linearize_model(Kinks, None, {}, {"x": 0.0, "v": 1.0})
    assert not np.isfinite(found.C[3, 0])
    data = as_data(found)
    json.dumps(data, allow_nan=False)
    assert data["matrices"]["C"][3][0] is None
    with pytest.raises(InputError, match="the derivative of root by x is not defined at this point"):
        found.state_space()
    with pytest.raises(InputError, match="not defined"):
        found.response("force", "x", [1.0])


# -- poles, labels, refusals


def test_poles_of_known_matrices():
    spring = np.array([[0.0, 1.0], [-25.0, -2.0]])
    (pole,) = poles_of(spring, ["x", "v"])
    assert (pole.real, pole.imaginary) == pytest.approx((-1.0, math.sqrt(24.0)))
    assert pole.natural_frequency == pytest.approx(5.0) and pole.damping_ratio == pytest.approx(0.2)
    assert pole.time_constant == pytest.approx(1.0)
    # an energy that counts and a first-order lag beside it
    A = np.zeros((4, 4))
    A[:2, :2], A[2, 0], A[3, 3] = spring, 1e9, -0.25
    zero, slow, fast = poles_of(A, ["x", "v", "energy", "T"])
    assert (zero.real, zero.imaginary, zero.state) == (0.0, 0.0, "energy")
    assert zero.damping_ratio is None and zero.time_constant is None
    assert slow.state == "T" and slow.time_constant == pytest.approx(4.0) and slow.damping_ratio == 1.0
    assert fast.real == pytest.approx(-1.0)
    assert poles_of(np.zeros((0, 0)), []) == ()
    for square in np.random.default_rng(3).uniform(0.1, 50.0, 40):
        grows, decays = poles_of([[0.0, 1.0], [square, 0.0]], ["x", "v"])
        assert grows.real == pytest.approx(-decays.real) and grows.real > 0.0
        (swings,) = poles_of([[0.0, 1.0], [-square, 0.0]], ["x", "v"])
        # both states have equal parts in each
        assert grows.state == decays.state == swings.state == "x"
    (unstable,) = poles_of([[2.0]], ["x"])
    assert unstable.damping_ratio == -1.0 and unstable.time_constant == -0.5


def test_the_state_space_is_the_linear_model_with_names(drive):
    found = drive.linear()
    system = found.state_space()
    assert isinstance(system, control.StateSpace) and system.name == found.model
    for name in "ABCD":
        np.testing.assert_array_equal(getattr(system, name), getattr(found, name))
    assert system.input_labels == labels([s.name for s in found.inputs])
    assert "motor_w_ref" in system.input_labels and "driveline_driven_w" in system.output_labels
    w = [0.3, 30.0]
    own = found.response("motor.w_ref", "motor.w", w)
    np.testing.assert_allclose(system["motor_w", "motor_w_ref"](1j * np.array(w)), own, rtol=1e-8)
    poles = sorted(np.abs(system.poles()))
    listed = sorted(p.natural_frequency for p in found.poles for _ in range(1 + bool(p.imaginary)))
    np.testing.assert_allclose(poles, listed, rtol=1e-6, atol=1e-7)


def test_labels_stay_apart():
    assert labels(["a.b", "a_b", "c"]) == ["a_b", "a_b_", "c"]


def test_a_model_without_states_has_d_alone():
    found = linearize("ChamberForces", "phi=30 deg, w=2")
    assert isinstance(found, LinearModel) and found.A.shape == (0, 0) and found.poles == ()
    names = [s.name for s in found.inputs], [s.name for s in found.outputs]
    row, column = names[1].index("tau"), names[0].index("a")
    inertia = next(s.value for s in found.outputs if s.name == "J")
    assert found.D[row, column] == pytest.approx(inertia, rel=1e-12)
    assert found.unit_of("D", row, column) == "N.m.s2/rad"
    slope = next(s.value for s in found.outputs if s.name == "tau_bias_dw")
    assert found.D[row, names[0].index("w")] == pytest.approx(slope, rel=1e-9)
    assert found.state_space().ninputs == len(found.inputs)


def test_a_direct_model_has_the_torque_that_holds_its_speed():
    found = linearize("ChainUnit", "phi=30 deg, w=60 rpm")
    assert found.at == "phi = 0.523599 rad, w = 6.28319 rad/s"
    assert {s.name: s.rate.value for s in found.states} == {
        "phi": pytest.approx(2.0 * math.pi), "w": pytest.approx(0.0, abs=1e-9)
    }  # fmt: skip
    found = linearize(EXAMPLES / "linkages" / "slider_crank_press.toml", {"tau": 0.0})
    assert abs({s.name: s.rate.value for s in found.states}["w"]) > 1e-3


@pytest.mark.parametrize(
    ("of", "more", "words"),
    [
        ("DcMotor", {"at": "steady"}, "must be NAME=VALUE"),
        ("DcMotor", {"at": "speed=3"}, '"speed": no such state or input'),
        ("DcMotor", {"at": "w=3 kg"}, "at: w"),
        ("DcMotor", {"at": {"w": math.inf}}, "at: w"),
        ("DcMotors", {}, "DcMotors: no such model"),
        ("DcMotor", {"inverse": True}, "inverse: is of linkage files"),
        (
            EXAMPLES / "linkages" / "cylinder_lift.toml",
            {"at": "equilibrium"},
            'give a place, "phi=.., w=0"',
        ),
        (
            EXAMPLES / "linkages" / "toggle_clamp.toml",
            {"at": "equilibrium:3"},
            'give the number of one, as in "equilibrium:1", or a place, "phi=.., w=0"',
        ),
        (EXAMPLES / "jam_with_driveline.toml", {"at": "jam:2 s"}, "there is no run"),
        (EXAMPLES / "jam_with_driveline.toml", {"at": "start_up:2 kg"}, 'at = "2 kg"'),
        (EXAMPLES / "jam_with_driveline.toml", {"at": "start_up"}, 'at = "start_up": must be RUN:TIME'),
        (EXAMPLES / "jam_with_driveline.toml", {"at": "steady:1 s"}, "steady running begins at "),
        (EXAMPLES / "jam_with_driveline.toml", {"at": "jam_left:1 s"}, "the run of jam_left goes from"),
        (
            EXAMPLES / "jam_with_driveline.toml",
            {"config": "x.toml"},
            "config = x.toml: is not of a study file",
        ),
    ],
)
def test_a_wrong_point_is_refused(of, more, words):
    with pytest.raises(InputError) as refused:
        linearize(of, **more)
    assert words in str(refused.value)


def test_a_point_has_units_and_tells_a_place_beyond_the_range():
    clamp = EXAMPLES / "linkages" / "toggle_clamp.toml"
    beyond = linearize(clamp, "phi=95 deg, w=0").at
    assert beyond == "phi = 1.65806 rad, w = 0 rad/s, beyond the range of the driver, on its upper end stop"
    assert linearize(clamp, "phi=-0.01").at.endswith("on its lower end stop")
    assert linearize(clamp, "equilibrium").title == linearize(clamp).title == "Toggle clamp with a hand lever"
    assert linearize(clamp, "phi=10 deg").at == "phi = 0.174533 rad"
    assert linearize(clamp.with_name("watt_six_bar.toml"), "phi=-10 deg").at == "phi = -0.174533 rad"


def test_the_examples_of_docstrings():
    assert doctest.testmod(linear).attempted > 0 == doctest.testmod(linear).failed
