"""One FMU of a whole system: against the monolithic solution, the co-simulation of its parts, and Python."""

from __future__ import annotations

import contextlib
import ctypes
import re
import zipfile
from dataclasses import replace

import fmpy
import numpy as np
import pytest
from command import chainunit
from fmpy.validation import validate_fmu
from systems import initialized, whole_systems
from test_fmi_rules import reinitialized

from chainunit import RunError
from chainunit.core.native.compilers import compiler
from chainunit.fmu.description import Interface, model_description, terminals
from chainunit.fmu.native.export import export
from chainunit.machines.load_observer import LoadObserver
from chainunit.study import config
from chainunit.study.choice import choose
from chainunit.study.package import drive_to_export, left_out, study_system, whole_system
from chainunit.system import (
    CoSimulation,
    Jump,
    ModelComponent,
    ModelExchange,
    System,
    compiled,
    export_compiled,
    monolithic,
)
from chainunit.system.instance import Fmu, Instance

pytestmark = pytest.mark.skipif(compiler() is None, reason="no C compiler")

_, SYSTEMS = whole_systems()
STEP, STOP = 0.004, 0.4
# from rest to full speed, over the limits of the control; then a load that jumps
SIGNALS = {
    "motor": {"motor.w_ref": 100.0, "machine.left.material_mass": Jump(0.2, 0.0, 30.0)},
    "line": {"machine.left.processing_force": Jump(0.2, 0.0, 300.0)},
    "feed-forward": {
        "motor.w_ref": 150.0,
        "model.a": 0.0,
        "machine.left.material_mass": Jump(0.2, 30.0, 20.0),
        "machine.right.material_mass": 30.0,
        "model.left.material_mass": 30.0,
        "model.right.material_mass": 30.0,
    },
    "chains": {"motor.w_ref": 100.0, "machine.left.material_mass": Jump(0.2, 0.0, 30.0)},
}
ERRORS = ("drift", "energy_residual")
"""Outputs that are errors of the chains themselves: rounding, in a good run."""


def alone(part, file):
    """The FMU of a compiled system as a system of one component."""
    return System({"whole": replace(part, file=file)})


def off(run, exact, names=None):
    """The largest difference of any variable in parts of its peak, and the variable."""
    worst = (0.0, "")
    for name in names or map(str, exact.data_vars):
        difference = np.max(np.abs(run[f"whole.{name}"].values - exact[name].values))
        peak = np.max(np.abs(exact[name].values))
        if name.rpartition(".")[2] in ERRORS:
            assert difference < 1e-8
        else:
            worst = max(worst, (difference / max(peak, 1e-9), name))
    return worst


LATER = [pytest.param(name, marks=pytest.mark.second) for name in SYSTEMS if name != "motor"]


@pytest.fixture(scope="module", params=["motor", *LATER])
def whole(request, tmp_path_factory):
    """System, its one model with parameters, signals, native FMU, and the monolithic solution."""
    system, signals = SYSTEMS[request.param], SIGNALS[request.param]
    file = tmp_path_factory.mktemp("whole") / "whole.fmu"
    export_compiled(system, file, backend="native")
    exact = monolithic(system, signals, np.arange(101) * STEP, rtol=1e-12)
    return system, compiled(system), signals, file, exact


def of_whole(signals):
    return {f"whole.{name}": signal for name, signal in signals.items()}


def test_the_states_that_an_event_changes_are_those_of_the_chains(whole):
    _, part, _, file, _ = whole
    states = part.model.state_layout.names
    rods = {name for name in states if name.startswith("machine.")}
    with zipfile.ZipFile(file) as archive:
        found = reinitialized(archive.read("modelDescription.xml"))
    assert found == rods and rods < set(states)


def test_co_simulation_is_the_monolithic_solution(whole):
    _, part, signals, file, exact = whole
    with CoSimulation(alone(part, file), of_whole(signals)) as simulation:
        run = simulation.run(STOP, STEP)
    assert np.ptp(exact["motor.w"].values) > 50.0 and np.ptp(exact["machine.tau"].values) > 1.0
    error, name = off(run, exact)
    assert error < 1e-7, name


def test_model_exchange_is_the_monolithic_solution(whole):
    _, part, signals, file, exact = whole
    with ModelExchange(alone(part, file), of_whole(signals), rtol=1e-12) as simulation:
        run = simulation.run(STOP, STEP)
    error, name = off(run, exact)
    assert error < 1e-7, name


@pytest.mark.parametrize("whole", ["motor", "line"], indirect=True)
def test_the_co_simulation_of_the_parts_converges_to_it(whole, tmp_path):
    """The separate FMUs share no composition with the whole."""
    system, part, signals, file, _ = whole
    smooth = {name: x if isinstance(x, float) else 20.0 for name, x in signals.items()}
    start = {"motor.w_start": 90.0}
    if "line" in system.components:
        start = {"line.w_start": 150.0, "motor.w_start": 150.0}
    system = system.with_values(start)
    part = compiled(system)
    with CoSimulation(alone(part, file), of_whole(smooth)) as simulation:
        exact = simulation.run(0.1, 0.01)
    # without start values the files are those of other tests, compiled already
    files = {name: export(c.model, tmp_path / f"{name}.fmu") for name, c in system.components.items()}
    parts = replace(
        system, components={name: replace(c, file=files[name]) for name, c in system.components.items()}
    )
    errors = []
    for step in (1e-3, 5e-4, 2.5e-4):
        with CoSimulation(parts, smooth) as simulation:
            run = simulation.run(0.1, step)
        rows = run.isel(time=slice(None, None, round(0.01 / step)))
        errors.append(
            [
                np.max(np.abs(rows[name].values - exact[f"whole.{name}"].values))
                / np.max(np.abs(rows[name].values))
                for name in ("motor.w", "machine.tau", "machine.rocker.tau")
            ]
        )
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(orders > 1.7) and np.max(errors[-1]) < 1e-4, (errors, orders)


def test_python_fmu_agrees_to_rounding(whole, tmp_path):
    system, part, signals, file, _ = whole
    export_compiled(system, tmp_path / "python.fmu", backend="python")
    runs = []
    for each in (file, tmp_path / "python.fmu"):
        with CoSimulation(alone(part, each), of_whole(signals)) as simulation:
            runs.append(simulation.run(0.003, 0.001))
    for name in runs[0].data_vars:
        one, two = (run[name].values for run in runs)
        np.testing.assert_allclose(
            one, two, rtol=1e-9, atol=1e-11 * max(1.0, np.max(np.abs(one))), err_msg=name
        )


def test_the_fmu_is_valid_and_its_derivatives_exact(whole):
    """Of all outputs and derivatives, along a random direction, against differences of the FMU itself."""
    _, part, _, file, _ = whole
    assert not validate_fmu(str(file))
    rng = np.random.default_rng(3)
    with initialized(file) as (unit, told):
        by_name = {v.name: v.valueReference for v in told.modelVariables}
        model = part.model
        inputs, states = (list(layout.names) for layout in (model.input_layout, model.state_layout))
        outputs = [*model.parts[0].layout.names, *(f"der({name})" for name in states)]
        apart = model.parts[0].by_differences
        known, unknown = ([by_name[n] for n in names] for names in ([*inputs, *states], outputs))
        x = np.array(unit.getReal(known))
        x = x + np.concatenate([rng.uniform(0.1, 1.0, len(inputs)), np.full(len(states), 1e-3)])
        # a closed contactor has no room above
        x[: len(inputs)] = np.minimum(
            x[: len(inputs)], [v.quantity.high - 0.05 for v in model.input_layout.variables]
        )

        def at(values):
            unit.setReal(known[: len(inputs)], list(values[: len(inputs)]))
            unit.setContinuousStates((ctypes.c_double * len(states))(*values[len(inputs) :]), len(states))
            return np.array(unit.getReal(unknown))

        direction, h = rng.uniform(-1.0, 1.0, len(x)), 1e-6
        a, b, c, d = (at(x + k * h * direction) for k in (-2, -1, 1, 2))
        wanted = (a - 8.0 * b + 8.0 * c - d) / (12.0 * h)
        at(x)
        got = np.array(unit.getDirectionalDerivative(unknown, known, list(direction)))
        rounding = 1e-15 * (np.abs(a) + np.abs(d)) / h
        worst = np.abs(got - wanted) / (1e-5 * np.abs(wanted) + 1e-5 + 20.0 * rounding)
        plain = np.array([name not in apart for name in outputs])
        assert np.max(worst[plain]) < 1.0, outputs[int(np.argmax(np.where(plain, worst, 0.0)))]


def test_initialisation_refuses_by_full_name(whole):
    _, _, _, file, _ = whole
    with contextlib.closing(Fmu(file)) as fmu:
        for values, words in (
            ({"machine.crank.m": -1.0}, r"machine\.crank\.m = -1 kg: must be >= 0 kg"),
            ({"machine.r": 3.0}, r"machine\.c = 1\.49\d* m: the crank circle must stay left"),
            ({"motor.rotor.J": 0.0}, r"motor\.rotor\.J = 0 kg m2: must be > 0"),
            ({"solver.max_steps": 0.0}, r"solver\.max_steps = 0: must be a whole number >= 1"),
        ):
            journal = []
            with contextlib.closing(Instance(fmu, "unit", journal)) as unit:
                with pytest.raises(RunError):
                    unit.initialize(values, 0.0)
            assert any(re.search(words, line) for line in journal), journal


@pytest.mark.parametrize("whole", ["motor"], indirect=True)
def test_both_versions_of_fmi_are_the_same(whole, tmp_path):
    system, part, _, file, _ = whole
    export_compiled(system, tmp_path / "three.fmu", fmi=3, backend="native")
    assert not validate_fmu(str(tmp_path / "three.fmu"))
    names = [*part.model.state_layout.names, *part.model.parts[0].layout.names]
    runs = [
        fmpy.simulate_fmu(
            str(each), fmi_type="CoSimulation", stop_time=0.1, step_size=0.01, output_interval=0.01,
            start_values={"motor.w_ref": 100.0}, output=names,
        )
        for each in (file, tmp_path / "three.fmu")
    ]  # fmt: skip
    assert runs[0]["motor.w"][-1] > 30.0
    assert all(runs[0][name].tolist() == runs[1][name].tolist() for name in names)


# -- of a study

STUDY = """
[machine]
ratio = 50
left.wall_mass = 20
[run]
crank_speed = "12 rpm"
[feed]
left.material_mass = 25
"""


def exported(text, *more, cwd):
    (cwd / "mine.toml").write_text(text)
    return chainunit("export", "mine.toml", "--backend", "python", *more, cwd=cwd)


def test_a_study_becomes_one_fmu(tmp_path):
    """Its values are the start values; run as it is, it does what the study's own equations do."""
    done = exported(STUDY, cwd=tmp_path)
    assert done.returncode == 0 and done.stdout.startswith(
        "ChamberForcesSystem.fmu: ChamberForcesSystem, FMI 2.0"
    )
    file = tmp_path / "ChamberForcesSystem.fmu"
    start = {v.name: float(v.start) for v in fmpy.read_model_description(str(file)).modelVariables if v.start}
    study = config.load(tmp_path / "mine.toml")
    assert start["motor.w_ref"] == pytest.approx(study.run.crank_speed * 50.0)
    assert start["machine.left.material_mass"] == 25.0 and start["machine.left.wall_mass"] == 20.0
    run = fmpy.simulate_fmu(
        str(file), stop_time=0.01, step_size=0.002, output_interval=0.002, output=["motor.w", "machine.tau"]
    )
    drive = choose(study, tmp_path / "scratch", lambda *progress: None).drive
    # the gains are the tuned ones
    assert start["motor.speed_control.kp"] == drive.fmu_parameters.speed_control.kp
    exact = monolithic(study_system(drive, study.operation), {}, run["time"], rtol=1e-12)
    for name in ("motor.w", "machine.tau"):
        np.testing.assert_allclose(run[name], exact[name].values, rtol=1e-7, atol=1e-9)


def test_what_an_exported_study_leaves_out():
    events = "[coupling]\n[[event]]\ntype = 'jam'\nside = 'left'\n"
    bare, full = config.parse(STUDY), config.parse(STUDY + events)
    assert left_out(bare.operation, bare.given_events) == ""
    words = "Not in it: the torque limiter; the events jam_left. Its loads are those of normal running."
    assert left_out(full.operation, full.given_events) == words


@pytest.mark.parametrize(
    "arguments, words",
    [
        (("--config", "mine.toml"), r"--config mine\.toml: is not of a study file"),
        (("--direct",), r"--direct: is not of a study file"),
        (("--rods", "4"), r"--rods 4: is of ChainUnitFlexible"),
        (("-o", "x.zip"), r"-o x\.zip: must be a file name that ends in \.fmu or \.ssp"),
    ],
)
def test_what_is_not_of_a_study_is_refused(arguments, words, tmp_path):
    done = exported(STUDY, *arguments, cwd=tmp_path)
    assert done.returncode == 2 and re.search(words, done.stderr), done.stderr
    assert {each.name for each in tmp_path.iterdir()} == {"mine.toml"}


def test_a_wrong_study_is_refused(tmp_path):
    done = exported(STUDY.replace("ratio", "ratoi"), cwd=tmp_path)
    assert done.returncode == 2 and "mine.toml:3: machine.ratoi" in done.stderr


def test_a_drive_and_the_observer_are_joined_by_what_is_measured():
    """The FMU of a whole drive gives the measured signals of its motor, and the observer takes them."""
    drive = compiled(SYSTEMS["motor"], "Drive")
    (given,) = drive.model.terminals
    (taken,) = LoadObserver.terminals
    assert given.kind == taken.kind and given.rule == taken.rule == "bus"
    parts = {"drive": drive, "observer": ModelComponent(LoadObserver, LoadObserver.Parameters())}
    both = System(parts, [(f"drive.{given.name}", f"observer.{taken.name}")])
    assert {*both.connections} == {
        ("drive.motor.phi", "observer.phi"),
        ("drive.motor.w", "observer.w"),
        ("drive.motor.armature.i", "observer.current"),
        ("drive.motor.supply_power", "observer.power"),
    }
    root = terminals(Interface(drive.model, {}))
    assert [t.get("matchingRule") for t in root.iter("Terminal")] == ["bus"]


def test_the_default_experiment_is_that_of_the_study(tmp_path):
    """The motors' own of 1 s at 20 us is none for a drive that starts up in seconds."""
    text = "[driveline]\n[run]\nstep = 0.5e-3\n[report]\nauthor = 'A. Bauer'\nrevision = 'C'\n"
    loaded = config.parse(text)
    model, start = whole_system(drive_to_export(loaded), loaded.operation, loaded.title, loaded.file.labels)
    root = model_description(Interface(model, start), "", {}, "9.9")
    experiment = {k: float(x) for k, x in root.find("DefaultExperiment").items()}
    assert experiment["stepSize"] == 0.5e-3
    assert experiment["stopTime"] == pytest.approx(
        loaded.operation.steady_begin + loaded.run.turns * loaded.operation.turn, rel=1e-5
    )
    assert root.get("author") == "A. Bauer" and root.get("version") == "C" and root.get("license") is None
