"""A system of models as one model."""

from __future__ import annotations

import pickle
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from systems import component, pair, whole_systems

from chainunit import InputError
from chainunit.core.engines import MATH, casadi_, numpy_
from chainunit.core.errors import GeometryError
from chainunit.core.model import Model, Part
from chainunit.core.ports import LoadPort
from chainunit.core.quantities import Layout, Value, declaration, quantity
from chainunit.core.system_description import SOLVER
from chainunit.core.system_model import system_model
from chainunit.drives.gear import Gear
from chainunit.machines.linkages.file import read_linkage
from chainunit.models import MODELS
from chainunit.system import ModelComponent, System, compiled, shaft_joints

GALLERY = Path(__file__).parents[1] / "examples" / "linkages"
CHAINS, SYSTEMS = whole_systems()


@pytest.fixture(params=SYSTEMS)
def system(request):
    return SYSTEMS[request.param]


def ready(part, values=None):
    """Checked parameters, inputs and states at the start."""
    p = part.model.check(part.parameters)
    u = part.model.input_layout.from_names(values or {})
    return p, u, part.model.begin(p, u)


def test_names_are_the_full_names_of_the_system(system):
    model = compiled(system).model
    slopes = {target for _, target in system.connections} - {
        target for _, target in replace(system, slopes=False).connections
    }
    assert slopes
    every = [(name, c.model) for name, c in system.components.items()]
    connected = {target for _, target in system.connections}
    assert (
        set(model.input_layout.names)
        == {f"{name}.{v}" for name, m in every for v in m.input_layout.names} - connected
    )
    assert set(model.state_layout.names) == {
        f"{name}.{v}" for name, m in every if m.state_layout for v in m.state_layout.names
    }
    assert set(model.parts[0].layout.names) == {
        f"{name}.{v}" for name, m in every for v in m.parts[0].layout.names
    }
    assert len(model.parts) == 1
    assert [t.name for t in model.terminals] == ["motor.measured"] * ("motor" in system.components)
    parameters = {f"{name}.{v}" for name, m in every for v in m.parameter_layout.names}
    own = {name for name in parameters if ".solver." not in name}
    assert set(model.parameter_layout.names) == own | {"solver.max_steps", "solver.tolerance"}
    assert "motor.w to " in model.text and "machine is of the model " in model.text
    described = {v.name: v for v in model.parameter_layout.variables}
    assert described["machine.r"].description.startswith("machine: ")
    assert compiled(system).parameters.machine.r == system.values["machine.r"]


def test_each_load_is_that_of_the_present_motion():
    """The derivatives of motor and machine by hand: the load of the machine at the motor's angle and speed."""
    part = compiled(SYSTEMS["motor"])
    p, u, x = ready(part, {"motor.w_ref": 120.0, "machine.left.material_mass": 12.0})
    x = part.model.state_layout.from_names({"motor.phi": 3.0, "motor.w": 90.0, "motor.armature.i": 4.0}, x)
    machine, motor = MODELS["ChamberForces"], MODELS["DcMotor"]
    feed = machine.input_layout.from_names({"left.material_mass": 12.0, "phi": 3.0, "w": 90.0})
    load, _ = machine.evaluate(MATH, p.machine, feed)
    port = LoadPort(
        tau_bias=load.tau_bias, J=load.J, dJ_dphi=0.0, phi0=3.0, w0=90.0, tau_bias_dphi=0.0, tau_bias_dw=0.0
    )
    inputs = replace(motor.input_layout.from_names({"w_ref": 120.0}), load=port)
    whole = SYSTEMS["motor"].components["motor"].parameters
    assert part.model.derivatives(MATH, p, u, x) == motor.derivatives(MATH, whole, inputs, x.motor)
    (outputs,) = part.model.evaluate(MATH, p, u, x)
    (own,) = motor.evaluate(MATH, whole, inputs, x.motor)
    assert outputs.motor == own
    turning, _ = machine.evaluate(MATH, p.machine, replace(feed, a=own.a))
    assert outputs.machine == turning and turning.tau == pytest.approx(own.tau, rel=1e-12)


@pytest.mark.stages(first=1)
def test_engines_agree(system):
    """`math`, arrays and symbols give the same values."""
    import casadi

    part = compiled(system)
    model = part.model
    p, u, x = ready(part, {"motor.w_ref": 120.0})
    flat = [np.array([v, v + 0.01]) for v in model.state_layout.values(x)]
    of_arrays = model.derivatives(numpy_(), p, u, model.state_layout.instance(flat))
    symbol = casadi.SX.sym("x", len(flat))
    rates = model.derivatives(casadi_(), p, u, model.state_layout.instance(casadi.vertsplit(symbol)))
    outputs = model.evaluate(casadi_(), p, u, model.state_layout.instance(casadi.vertsplit(symbol)))
    rows = [*rates, *model.parts[0].layout.values(outputs[0])]
    of_symbols = casadi.Function("rows", [symbol], [casadi.vertcat(*rows)])
    for k in range(2):
        point = [v[k] for v in flat]
        states = model.state_layout.instance(point)
        dx = model.derivatives(MATH, p, u, states)
        y = model.parts[0].layout.values(model.evaluate(MATH, p, u, states)[0])
        np.testing.assert_allclose([np.broadcast_to(v, 2)[k] for v in of_arrays], dx, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(of_symbols(point).full().ravel(), [*dx, *y], rtol=1e-9, atol=1e-9)


def test_the_order_of_the_components_does_not_matter(system):
    turned = replace(
        system,
        components=dict(reversed(system.components.items())),
        joints=[joint[::-1] for joint in reversed(system.joints)],
    )
    values = []
    for each in (system, turned):
        part = compiled(each)
        p, u, x = ready(part, {"motor.w_ref": 120.0, "machine.left.material_mass": 12.0})
        rates = dict(zip(part.model.state_layout.names, part.model.derivatives(MATH, p, u, x), strict=True))
        (outputs,) = part.model.evaluate(MATH, p, u, x)
        values.append(
            (rates, part.model.parts[0].layout.by_name(outputs), part.model.state_layout.by_name(x))
        )
    assert values[0] == values[1]


def test_a_state_at_the_start_may_depend_on_another_model():
    """The chains hang, at the motor's start angle, as they do in the machine alone at this angle."""
    system = SYSTEMS["chains"]
    part = compiled(system)
    _, _, x = ready(part)
    p = CHAINS.check(system.components["machine"].parameters)
    alone = CHAINS.begin(p, CHAINS.input_layout.from_names({"phi": 5.0, "w": 10.0}))
    np.testing.assert_allclose(
        Layout(CHAINS.States).values(x.machine), Layout(CHAINS.States).values(alone), rtol=1e-12, atol=1e-12
    )
    assert part.model.controlled and part.model.start_problem.unknowns == CHAINS.start_problem.unknowns
    for tolerance, least in ((1e-12, 1e-12), (1e-3, 1e-10)):
        tuned = compiled(system.with_values({"machine.tolerance": tolerance}))
        assert tuned.model.tolerance(MATH, tuned.parameters) == least
    folded = compiled(system.with_values({"machine.organ.fold_limit": 0.1}))
    with pytest.raises(
        GeometryError, match=r"^machine: largest angle between rods of the left organ .* machine\.z = "
    ):
        ready(folded)


def test_refusals_name_the_full_parameter(system):
    def refused(values, kind, words):
        part = compiled(system.with_values(values))
        with pytest.raises(kind, match=words):
            part.model.check(part.parameters)

    refused({"machine.crank.m": -1.0}, InputError, r"^machine\.crank\.m = -1 kg: must be >= 0 kg")
    refused({"machine.r": 3.0}, GeometryError, r"^machine\.c = 1\.49\d* m: the crank circle must stay left")
    refused({"motor.rotor.J": 0.0}, InputError, r"^motor\.rotor\.J = 0 kg m2: must be > 0")
    refused({"machine.l1": 0.2}, GeometryError, r"^machine\.z = .* with machine\.l1 = 0\.2, machine\.l2 = ")


def test_a_linkage_file_says_where_it_does_not_close():
    machine = read_linkage(GALLERY / "blake_jaw_crusher.toml")
    system = pair(machine, "DcMotor")
    part = compiled(system.with_values({"machine.l_back": 9.0}))
    with pytest.raises(InputError, match=r"^machine: the group of .* (cannot close|dead position) .* deg of"):
        part.model.check(part.parameters)


@pytest.mark.stages(first=1)
def test_another_process_gets_the_same_model(system):
    part = compiled(system)
    assert pickle.loads(pickle.dumps(part.model)) is part.model is system_model(*part.model.made[1])
    p, u, x = ready(part)
    assert pickle.loads(pickle.dumps((p, u, x))) == (p, u, x)
    script = (
        "import pickle, sys; model, p, u, x = pickle.load(sys.stdin.buffer)\n"
        "from chainunit.core.engines import MATH; print(*model.derivatives(MATH, p, u, x))"
    )
    run = subprocess.run(
        [sys.executable, "-c", script],
        input=pickle.dumps((part.model, p, u, x)),
        capture_output=True,
        check=True,
    )
    rates = part.model.derivatives(MATH, p, u, x)
    assert [float(v) for v in run.stdout.split()] == rates


def test_free_terminals_remain():
    """A line that drives a machine, without motor, is a load with port and slopes like any machine."""
    whole = SYSTEMS["line"]
    rest = System({name: whole.components[name] for name in ("machine", "line")}, whole.joints[:2])
    part = compiled(rest, "Line")
    names = [t.name for t in part.model.terminals]
    assert names == ["line.flange", "line.flange_a", "line.load"]
    assert {"line.phi", "line.w", "line.a"} <= set(part.model.input_layout.names)
    assert dict(part.model.input_rates) == {"line.phi": "line.w", "line.w": "line.a"}
    assert part.model.parts[1].layout.names == ("line.tau_bias_dphi", "line.tau_bias_dw")
    motor = whole.components["motor"]
    again = compiled(
        System(
            {"plant": part, "motor": motor},
            [("motor.flange", "plant.line.flange"), ("motor.load", "plant.line.load")],
        )
    )
    direct = compiled(whole)
    start = {"machine.left.material_mass": 9.0}
    p, u, x = ready(direct, start)
    p2, u2, x2 = ready(again, {f"plant.{name}": v for name, v in start.items()})
    rates = dict(zip(direct.model.state_layout.names, direct.model.derivatives(MATH, p, u, x), strict=True))
    nested = dict(zip(again.model.state_layout.names, again.model.derivatives(MATH, p2, u2, x2), strict=True))
    assert {name.removeprefix("plant."): v for name, v in nested.items()} == rates
    assert "plant.machine.r" in again.model.parameter_layout.names
    assert [n for n in again.model.parameter_layout.names if "solver" in n] == [*SOLVER]


def test_a_gear_passes_slopes_on_where_they_are_asked_for():
    """The load port of gear and machine is that of a machine with this ratio; between motor and machine, nobody
    needs slopes."""
    machine = MODELS["ChamberForces"]
    geared = ModelComponent(Gear, Gear.Parameters(ratio=5.0))
    joints = shaft_joints("gear", "machine", flange="driven", load="machine")
    plant = System({"machine": component(machine), "gear": geared}, joints)
    part = compiled(plant)
    p = part.model.check(part.parameters)
    moving = {"phi": 3.0, "w": 20.0, "a": 2.0}
    u = part.model.input_layout.from_names(
        {f"gear.{name}": v for name, v in moving.items()} | {"machine.left.material_mass": 7.0}
    )
    gear = part.model.evaluate(MATH, p, u)[0].gear
    whole = machine.check(machine.parameter_layout.from_names({"ratio": 5.0}))
    load, slopes = machine.evaluate(
        MATH, whole, machine.input_layout.from_names(moving | {"left.material_mass": 7.0})
    )
    assert slopes.tau_bias_dphi != 0.0 != slopes.tau_bias_dw
    for name in Layout(LoadPort).names:
        wanted = getattr(slopes if hasattr(slopes, name) else load, name)
        assert getattr(gear, name) == pytest.approx(wanted, rel=1e-12), name
    driven = System(
        plant.components | {"motor": component("DcMotor")}, [*joints, *shaft_joints("motor", "gear")]
    )
    model = compiled(driven).model
    assert len(model.parts) == 1
    assert not {n for n in model.parts[0].layout.names if n.endswith(("tau_bias_dphi", "tau_bias_dw"))}
    assert "gear.dJ_dphi" in model.parts[0].layout.names


@declaration
class Nothing:
    pass


@declaration
class Signal:
    value: Value = quantity("1", "signal", default=0.0)


Through = Model(
    name="Through",
    text="Gives its input.",
    description="Through",
    Parameters=Nothing,
    Inputs=Signal,
    parts=(
        Part(
            declaration(type("Out", (), {"__annotations__": {"y": Value}, "y": quantity("1", "y")})),
            lambda xp, p, u, x, s: Through.parts[0].layout.instance([u.value]),
        ),
    ),
)


def test_loops_and_names_are_refused(system):
    loop = System(
        {"a": component(Through), "b": component(Through)}, wires=[("a.y", "b.value"), ("b.y", "a.value")]
    )
    with pytest.raises(InputError, match=r"algebraic loop: a\.y -> b\.y -> a\.y"):
        compiled(loop)
    with pytest.raises(InputError, match=r'"my system": the name of a model must be of letters'):
        compiled(system, "my system")
    for name in ("solver", "derived", "_x", "class"):
        with pytest.raises(InputError, match=rf'"{name}": a component .* cannot have this name'):
            compiled(System({name: component("DcMotor")}))
