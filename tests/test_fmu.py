"""The FMUs through fmpy, and the traps of pythonfmu."""

from __future__ import annotations

import binascii
import contextlib
import json
import math
import re
import subprocess
import sys
import textwrap
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu
from test_reference import POINTS, deviation

from chainunit import ChainUnitMachine, GeometryError, InputError, RunError
from chainunit.core.engines import MATH
from chainunit.core.native.compilers import compiler
from chainunit.fmu.description import Interface
from chainunit.fmu.export import export
from chainunit.machines.chain_unit import ChamberForces
from chainunit.models import MODELS
from chainunit.system.instance import Fmu, Instance


class Running:
    """An initialised instance, closed at the end of a with-block."""

    def __init__(self, fmu: Fmu, start=None):
        self.instance = Instance(fmu, "unit")
        self.instance.initialize(start or {}, 0.0)
        self.instance.finish_initialization()

    def __enter__(self):
        return self.instance

    def __exit__(self, *_):
        self.instance.close()


@pytest.fixture(scope="module")
def chamber(fmus):
    fmu = Fmu(fmus["ChamberForces"])
    yield fmu
    fmu.close()


@pytest.fixture(scope="module")
def motor(fmus):
    fmu = Fmu(fmus["DcMotor"])
    yield fmu
    fmu.close()


@pytest.fixture(scope="module")
def unpacked(fmus):
    """``unpacked(name)``: the FMU of that model."""
    there = {}

    def get(name):
        if name not in there:
            there[name] = Fmu(fmus[name])
        return there[name]

    yield get
    for fmu in there.values():
        fmu.close()


@pytest.mark.parametrize("point", POINTS, ids=lambda p: p["name"])
def test_reference_points(chamber, point):
    inputs = {name: 0.0 for name, v in chamber.variables.items() if v.causality == "input"}
    with Running(chamber, point["parameters"]) as unit:
        unit.set([*(inputs | point["inputs"])], [*(inputs | point["inputs"]).values()])
        got = dict(zip(point["outputs"], unit.get(list(point["outputs"])), strict=True))
    assert {n for n, v in chamber.variables.items() if v.causality == "output"} == set(point["outputs"])
    worst = {name: deviation(got[name], wanted) for name, wanted in point["outputs"].items()}
    assert max(worst.values()) < 1e-9, max(worst.items(), key=lambda kv: kv[1])


def outputs_of(name, inputs):
    """The outputs of a model without states at its start values, by the equations."""
    model = MODELS[name]
    p = model.check(model.Parameters())
    parts = model.evaluate(MATH, p, model.input_layout.from_names(inputs))
    return {
        n: v
        for part, out in zip(model.parts, parts, strict=True)
        for n, v in part.layout.by_name(out).items()
    }


NATIVE = pytest.mark.skipif(compiler() is None, reason="no C compiler")
BY_EACH = pytest.mark.parametrize(
    "make", ["python", pytest.param(2, marks=NATIVE), pytest.param(3, marks=NATIVE)]
)


@pytest.fixture
def made(request, make):
    """``made(name)``: the FMU of that model, by pythonfmu or native by a version of FMI."""
    if make == "python":
        return request.getfixturevalue("fmus").__getitem__
    files = request.getfixturevalue("native_fmus")
    return lambda name: files[name, make][0]


@pytest.mark.second
@BY_EACH
@pytest.mark.parametrize("step", [0.004, 0.05])
def test_outputs_in_fmpy_are_those_of_the_end_of_a_step(made, step):
    """README's snippet over a turn of the crank: every output at every communication point."""
    feed = {"left.material_mass": 30.0, "right.material_mass": 10.0}
    feed |= {"left.processing_force": 0.0, "right.processing_force": 20.0}
    motion = np.array(
        [(0.0, 0.0, 150.0), (2.1, 315.0, 150.0)], [("time", float), ("phi", float), ("w", float)]
    )
    rows = fmpy.simulate_fmu(
        str(made("ChamberForces")), fmi_type="CoSimulation", stop_time=2.1, output_interval=step,
        start_values={"ratio": 50.0, **feed}, input=motion,
    )  # fmt: skip
    time = rows["time"]
    assert len(time) == round(2.1 / step) + 1
    wanted = ChainUnitMachine(ratio=50.0).evaluate(
        {**feed, "phi": 150.0 * time, "w": np.full_like(time, 150.0)}
    )
    for name, exact in wanted.items():
        size = np.max(np.abs(exact))
        np.testing.assert_allclose(rows[name], exact, rtol=0.0, atol=1e-12 * size + 1e-14, err_msg=name)
    assert np.ptp(rows["rocker.psi"]) > 0.2 and np.ptp(rows["tau"]) > 0.5


@BY_EACH
@pytest.mark.parametrize("name", ["KnifeDrive", "Accelerator"])
def test_outputs_of_other_machines_are_those_of_the_end_of_a_step(made, name):
    """Angle and speed follow speed and acceleration from step to step, until they are set again."""
    rows = fmpy.simulate_fmu(
        str(made(name)), fmi_type="CoSimulation", stop_time=0.3, output_interval=0.1,
        start_values={"phi": 1.0, "w": 4.0, "a": -3.0},
    )  # fmt: skip
    for row in rows:
        t = float(row["time"])
        wanted = outputs_of(name, {"phi": 1.0 + 4.0 * t - 1.5 * t * t, "w": 4.0 - 3.0 * t, "a": -3.0})
        for output, exact in wanted.items():
            assert row[output] == pytest.approx(exact, rel=1e-12, abs=1e-11), (output, t)
    assert len(rows) == 4 and rows["phi0"][-1] > 2.0


@pytest.mark.second
def test_fmpy_validate_is_silent(fmus):
    """All by the command of fmpy, in one process: it says nothing but that there is nothing."""
    script = textwrap.dedent(
        """
        import sys
        from fmpy.cli import main

        for file in sys.argv[1:]:
            sys.argv[1:] = ["validate", file]
            try:
                main()
            except SystemExit as end:
                assert not end.code
        """
    )
    files = [str(file) for file in fmus.values()]
    assert [validate_fmu(file) for file in files] == [[] for _ in files]
    done = subprocess.run([sys.executable, "-c", script, *files], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.splitlines() == ["No problems found."] * len(files)


def test_variables_are_those_of_the_design(fmus):
    description = fmpy.read_model_description(str(fmus["ChamberForces"]))
    names = {v.name for v in description.modelVariables if v.causality == "parameter"}
    assert names == {
        *("r", "l", "h", "c", "hy", "e", "l1", "l2", "z", "g", "ratio", "web_share", "rod_inertia"),
        *(f"{rod}.{x}" for rod in ("crank", "coupler", "rocker") for x in ("m", "s", "I")),
        *(f"{side}.{x}" for side in ("left", "right") for x in ("wall_mass", "web_mass")),
        *("pin.friction", "pin.diameter", "pin.w_smooth", "joint_damping", "processing.v_smooth"),
    }
    fixed = {v.name for v in description.modelVariables if v.variability == "fixed"}
    assert fixed == {"r", "l", "h", "c", "hy", "e", "l1", "l2", "z", "ratio", "rod_inertia"}
    for v in description.modelVariables:
        assert v.unit and v.description, v.name


def test_start_values_of_a_motion_agree(fmus):
    """An input that nobody connects keeps its start value: a machine stands, phi = 0 with w = 0, and says so."""
    for name in ("ChamberForces", "ChainUnitFlexible", "KnifeDrive", "CardanDriveline"):
        variables = {v.name: v for v in fmpy.read_model_description(str(fmus[name])).modelVariables}
        assert [float(variables[n].start) for n in ("phi", "w", "a")] == [0.0, 0.0, 0.0]
        text = zipfile.ZipFile(fmus[name]).read("documentation/index.html").decode()
        assert "An input that is not connected keeps its start value" in text
        result = fmpy.simulate_fmu(str(fmus[name]), stop_time=0.1, output=["phi0", "w0", "power"])
        assert not any(result[n].any() for n in ("phi0", "w0", "power"))


def test_dependencies_are_true(fmus):
    """A dependency that is missing would be a wrong loop analysis; one too many, a loop that is none."""
    rng = np.random.default_rng(1)
    interface = Interface(ChamberForces, {})
    names = [s.name for s in interface.signals_of("input")]
    offset = len(interface.parameters)
    machine = ChainUnitMachine({"joint_damping": 1.0, "ratio": 3.0, "web_share": 0.4})
    declared = {
        s.name: {names[i - offset] for i in known if i - offset < len(names)}
        for s, (known, _) in zip(interface.signals_of("output"), interface.dependencies, strict=True)
    }
    seen = {name: set() for name in declared}
    for _ in range(5):
        base = dict(zip(names, rng.uniform(0.5, 20.0, len(names)), strict=True))
        before = machine.evaluate(base)
        for name in names:
            after = machine.evaluate(base | {name: base[name] * 1.01})
            for output, value in after.items():
                # a change, not the rounding of a sum taken in another way
                if abs(value - before[output]) > 1e-11 * (1.0 + abs(before[output])):
                    seen[output].add(name)
    # what the stop adds to the supports cancels in their sum: so says mechanics, which no sparsity can know
    stop = {name for name in names if name.startswith("stop.")}
    for output in ("frame.fx", "frame.fy", "frame.moment"):
        assert declared[output] >= stop
        declared[output] -= stop
    assert seen == declared


@pytest.mark.slow
def test_same_model_same_file(fmus, tmp_path):
    for name, model in MODELS.items():
        again = export(model, tmp_path / "again.fmu")
        assert again.read_bytes() == fmus[name].read_bytes()
    other = export(ChamberForces, tmp_path / "other.fmu", {"r": 0.14})
    guids = {fmpy.read_model_description(str(f)).guid for f in (other, fmus["ChamberForces"])}
    assert len(guids) == 2


def test_two_versions_in_one_process_do_not_share_code(fmus, tmp_path, monkeypatch):
    """Trap: helper modules of the same name silently share the first FMU's code. Here the second FMU carries
    other mechanics: every torque doubled."""
    from chainunit.fmu import export as module

    printed = module.printed_model

    twice = 'OUTPUTS = [f"2.0*{y}" for y in OUTPUTS]'
    monkeypatch.setattr(module, "printed_model", lambda interface: f"{printed(interface)}\n{twice}\n")
    other = Fmu(export(ChamberForces, tmp_path / "other.fmu"))
    monkeypatch.undo()
    one = Fmu(fmus["ChamberForces"])
    with Running(one) as a, Running(other) as b, Running(one) as again:
        taus = []
        for unit in (a, b, again):
            unit.set(["phi", "w", "a"], [1.0, 2.0, 3.0])
            unit.step(0.0, 0.1)
            taus += unit.get(["tau"])
    assert taus[1] == pytest.approx(2.0 * taus[0], rel=1e-12) and taus[2] == taus[0]
    one.close()
    other.close()


@pytest.mark.second
def test_runs_twice_and_side_by_side(fmus):
    for _ in range(3):
        for file in fmus.values():
            result = fmpy.simulate_fmu(str(file), stop_time=0.01, output_interval=0.001)
            assert all(math.isfinite(x) for x in result[-1])


def test_two_instances_do_not_disturb_each_other(chamber):
    with Running(chamber) as a, Running(chamber) as b:
        a.set(["phi"], [0.5])
        b.set(["phi"], [2.5])
        a.step(0.0, 0.1)
        b.step(0.0, 0.1)
        first = a.get(["tau", "rocker.psi"])
        assert first != b.get(["tau", "rocker.psi"])
        b.set(["phi"], [0.5])
        assert b.get(["tau", "rocker.psi"]) == first


def test_many_instances_in_one_process(chamber):
    """pythonfmu 0.7 gives up a reference of the module at each instantiation: the third one used to crash."""
    for k in range(60):
        with Running(chamber) as unit:
            unit.set(["phi"], [0.1 * k])
            assert math.isfinite(unit.get(["tau"])[0])


@pytest.mark.slow
def test_process_ends_cleanly(fmus):
    """pythonfmu 0.7 releases its interpreter handle twice at exit; now and then that aborted the host."""
    script = textwrap.dedent(
        """
        import sys, fmpy
        for _ in range(3):
            for file in sys.argv[1:]:
                fmpy.simulate_fmu(file, stop_time=0.01, output_interval=0.001)
        junk = [[bytearray(120) for _ in range(50)] for _ in range(50)]
        print("done")
        """
    )
    for _ in range(3):
        files = [str(f) for f in fmus.values()]
        done = subprocess.run([sys.executable, "-c", script, *files], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        assert done.stdout.strip() == "done"


@pytest.mark.second
def test_needs_only_the_standard_library(fmus, tmp_path):
    """The slave in a Python without site-packages, as pythonfmu calls it."""
    for name, file in fmus.items():
        with zipfile.ZipFile(file) as archive:
            archive.extractall(tmp_path / name)
        resources = tmp_path / name / "resources"
        module = (resources / "slavemodule.txt").read_text()
        types = {}
        for v in fmpy.read_model_description(str(file)).modelVariables:
            types.setdefault(v.type.lower(), []).append(v.valueReference)
        script = f"""
import sys, json
sys.path.insert(0, {str(resources)!r})
module = __import__({module!r})
unit = getattr(module, {name!r})(instance_name="unit", resources={str(resources)!r})
unit.enter_initialization_mode(); unit.exit_initialization_mode()
ok = unit.do_step(0.0, 0.01)
values = [v for name, own in {types}.items() for v in getattr(unit, "get_" + name)(own)]
foreign = [m for m in sys.modules if m.split(".")[0] in ("numpy", "casadi", "fmpy", "pydantic")]
print(json.dumps([ok, all(v == v for v in values), foreign]))
"""
        done = subprocess.run([sys.executable, "-I", "-S", "-c", script], capture_output=True, text=True)
        assert json.loads(done.stdout) == [True, True, []], done.stderr


def test_geometry_that_cannot_turn_gives_nan_and_a_reason(chamber):
    with Running(chamber, {"r": 0.9}) as unit:
        assert all(math.isnan(v) for v in unit.get(["tau", "J", "tau_bias_dphi"]))
        with pytest.raises(RunError, match=r"r = 0\.9 m: the crank cannot turn .* must be > 0 and < 0\.703"):
            unit.step(0.0, 0.1)


def test_bad_input_gives_nan_not_stale_numbers(chamber):
    with Running(chamber) as unit:
        unit.set(["phi", "w"], [0.5, 3.0])
        good = unit.get(["tau"])
        unit.set(["w"], [math.nan])
        assert math.isnan(unit.get(["tau"])[0])
        with pytest.raises(RunError, match=r"input w = nan rad/s: must be a finite number"):
            unit.step(0.0, 0.1)
        unit.set(["w"], [3.0])
        assert unit.get(["tau"]) == good
        unit.step(0.0, 0.1)
        assert len(unit.messages) == 1


@pytest.mark.parametrize("name", ["rotor.J", "armature.R", "limit.i"])
def test_a_motor_out_of_bounds_is_refused(motor, name, tmp_path):
    with Running(motor, {name: -1.0}) as unit:
        assert all(math.isnan(v) for v in unit.get(["phi", "w", "a"]))
        with pytest.raises(RunError, match=rf"{name} = -1 .*must be > 0"):
            unit.step(0.0, 0.01)
    with pytest.raises(InputError, match=rf"{name} = -1 "):
        export(MODELS["DcMotor"], tmp_path / "x.fmu", {name: -1.0})


def test_a_number_that_is_none_before_the_initialization_is_forgotten(unpacked):
    """The observer starts from the measured speed."""
    fmu = unpacked("LoadObserver")
    with Running(fmu, {"w": math.nan}) as unit:
        assert math.isnan(unit.get(["speed"])[0])
        unit.set(["w"], [0.7])
        assert unit.get(["speed"]) == [0.7]


def test_a_geometry_set_too_late_for_initialisation_is_seen(chamber):
    instance = Instance(chamber, "unit")
    instance.set(["r"], [0.9])
    assert all(math.isnan(v) for v in instance.get(["tau"]))
    instance.set(["r"], [0.15])
    instance.initialize({}, 0.0)
    instance.set(["r"], [0.9])
    assert math.isnan(instance.get(["tau"])[0])
    instance.set(["r"], [0.14])
    assert math.isfinite(instance.get(["tau"])[0])
    instance.finish_initialization()
    instance.close()


def test_start_values_show_before_initialisation(motor):
    instance = Instance(motor, "unit")
    instance.set(["w_start"], [5.0])
    assert instance.get(["w"]) == [5.0]
    instance.set(["w_start"], [6.0])
    assert instance.get(["w", "a"])[0] == 6.0
    instance.close()


@pytest.mark.parametrize("step", [-0.01, math.nan, math.inf, 1e9])
def test_a_step_that_is_none_is_discarded(motor, step):
    with Running(motor, {"w_ref": 50.0}) as unit:
        before = unit.get(["phi", "w"])
        with pytest.raises(RunError, match="status 2"):
            unit.step(0.0, step)
        assert unit.get(["phi", "w"]) == before
        unit.step(0.0, 0.0)
        assert unit.get(["phi", "w"]) == before


def test_a_step_without_end_is_discarded(motor):
    """Its end is no number, although its beginning and its length are."""
    unit = Instance(motor, "unit")
    unit.initialize({}, 1.7e308)
    unit.finish_initialization()
    with pytest.raises(RunError, match=r"step of 1e\+308 s .*must be finite"):
        unit.step(1.7e308, 1e308)
    unit.close()


@pytest.mark.parametrize(("name", "value"), [("w", 1e308), ("a", 1e308), ("left.material_mass", -50.0)])
def test_inputs_beyond_any_machine_give_nan_and_a_reason(chamber, name, value):
    with Running(chamber) as unit:
        unit.set([name], [value])
        assert math.isnan(unit.get(["tau"])[0])
        assert len(unit.messages) == 1


@pytest.mark.parametrize("order", ["in the run", "before initialisation", "tuned", "saved"])
@pytest.mark.parametrize("name", ["ChamberForces", "ChainUnit", "ChainUnitFlexible"])
def test_an_input_out_of_its_bounds_is_refused_until_it_is_good(unpacked, name, order):
    """Set before the initialization, it used to be computed with; and the flexible unit stayed refused for good."""
    fmu = unpacked(name)
    bad = {"left.material_mass": -50.0}
    output = "left.normal_load"
    with Running(fmu, bad if order == "before initialisation" else {}) as unit:
        unit.set([*bad], [*bad.values()])
        if order == "tuned":
            unit.set(["crank.m"], [20.0])
        elif order == "saved":
            unit.restore(unit.state())
        assert math.isnan(unit.get([output])[0])
        with pytest.raises(RunError, match=r"left\.material_mass = -50 kg: must be >= 0 kg"):
            unit.step(0.0, 0.001)
        unit.set(["left.material_mass"], [-1e-12])  # zero but for rounding
        if order == "before initialisation":
            with Running(fmu, {"left.material_mass": 0.0}) as other:
                assert unit.get(fmu.outputs()) == other.get(fmu.outputs())
        unit.step(0.0, 0.001)
        assert unit.get(["left.material_mass"]) == [0.0]
        assert math.isfinite(unit.get([output])[0])


@pytest.mark.parametrize("saved", [False, True])
@pytest.mark.parametrize(
    ("name", "parameter", "good"),
    [
        ("ChainUnit", "crank.m", 30.0),
        ("ChainUnitFlexible", "crank.m", 30.0),
        ("DcMotor", "armature.R", 0.5),
        ("InductionMotor", "stator.R", 0.5),
    ],
)
def test_a_refused_parameter_that_is_tuned_later_starts_the_states(unpacked, name, parameter, good, saved):
    """The states were never started, and reading them was fatal for the host."""
    fmu = unpacked(name)
    read = [n for n, v in fmu.variables.items() if v.causality in ("local", "output")]
    with Running(fmu, {parameter: good}) as unit:
        want = unit.get(read)
    with Running(fmu, {parameter: -1.0}) as unit:
        assert all(map(math.isnan, unit.get(read)))
        with pytest.raises(RunError, match=rf"{re.escape(parameter)} = -1 "):
            unit.step(0.0, 0.001)
        if saved:
            state = unit._fmi.serializeFMUstate(unit.state())
            unit._fmi.reset()
            unit.restore(unit._fmi.deSerializeFMUstate(state))
        unit.set([parameter], [good])
        assert unit.get(read) == want and all(map(math.isfinite, want))
        unit.step(0.0, 0.001)


def test_a_fixed_parameter_that_is_refused_needs_a_reset(unpacked):
    fmu = unpacked("CardanDriveline")
    with Running(fmu, {"solver.max_steps": -1.0}) as unit:
        unit.set(["solver.max_steps"], [100.0])
        assert all(map(math.isnan, unit.get(fmu.outputs())))
        unit._fmi.reset()
        unit.initialize({}, 0.0)
        unit.finish_initialization()
        assert all(map(math.isfinite, unit.get(fmu.outputs())))


def test_fixed_parameters_that_come_with_a_refused_one_count(unpacked):
    """What is derived from the fixed ones, is not kept from before."""
    fmu = unpacked("KnifeDrive")
    read, given = ["J", "blade.vy"], {"r": 0.9 * float(fmu.variables["r"].start)}
    with Running(fmu, given) as unit:
        want = unit.get(read)
    instance = Instance(fmu, "unit")
    assert instance.get(read) != want
    instance.initialize(given | {"crank.m": -1.0}, 0.0)
    instance.finish_initialization()
    assert all(map(math.isnan, instance.get(read)))
    instance.set(["crank.m"], [float(fmu.variables["crank.m"].start)])
    assert instance.get(read) == want
    instance.close()


@pytest.mark.parametrize(
    ("start", "stop", "message"),
    [
        (2.0, 1.0, r"stop time = 1 s: must be >= 2 s, the start time"),
        (1e9, 1e9 - 0.01, r"stop time = 1e\+09 s: must be >= 1e\+09 s, the start time"),
        (math.nan, 1.0, r"start time = nan s: must be a finite number"),
        (math.inf, None, r"start time = inf s: must be a finite number"),
        (0.0, math.nan, r"stop time = nan s: must be >= 0 s, the start time"),
    ],
)
def test_times_that_make_no_experiment_end_in_a_refused_initialisation(motor, start, stop, message):
    unit = Instance(motor, "unit")

    def initialise(start, stop):
        unit._fmi.setupExperiment(None, start, stop)
        unit._fmi.enterInitializationMode()
        unit._fmi.exitInitializationMode()

    initialise(start, stop)
    for t in (start, 0.0):
        with pytest.raises(RunError, match=message):
            unit.step(t, 0.001)
    assert all(map(math.isnan, unit.get(motor.outputs())))
    unit._fmi.reset()
    initialise(0.0, 0.0)
    assert all(map(math.isfinite, unit.get(motor.outputs())))
    unit.close()


def test_what_a_time_may_be_off_does_not_grow_with_it(motor):
    start = 1e6
    unit = Instance(motor, "unit")
    unit._fmi.setupExperiment(None, start, start + 1.0)
    unit._fmi.enterInitializationMode()
    unit._fmi.exitInitializationMode()
    with pytest.raises(RunError, match="the FMU is at"):
        unit.step(start + 5e-4, 1e-3)
    h = 1.0 / 30.0
    for k in range(29):
        unit.step(start + k * h, h)
    t = start + 29 * h
    with pytest.raises(RunError, match="the stop time, or before"):
        unit.step(t, h + 5e-4)
    unit.step(t, h)
    unit.close()


def test_a_step_from_a_wrong_time_changes_nothing(unpacked):
    with Running(unpacked("ChainUnitFlexible")) as unit:
        unit.step(0.0, 0.001)
        before = unit._fmi.serializeFMUstate(unit.state())
        assert b'"closed": true' in before
        with pytest.raises(RunError, match="the FMU is at"):
            unit.step(0.5, 0.001)
        assert unit._fmi.serializeFMUstate(unit.state()) == before


def test_the_communication_point_and_the_stop_time_are_honoured(motor):
    unit = Instance(motor, "unit")
    unit._fmi.setupExperiment(None, 2.0, 3.0)
    unit._fmi.enterInitializationMode()
    unit._fmi.exitInitializationMode()
    with pytest.raises(RunError, match=r"step from t = 0 s: the FMU is at t = 2 s"):
        unit.step(0.0, 0.1)
    t = 2.0
    for _ in range(10):
        unit.step(t, 0.1)
        t += 0.1
    assert t != 3.0, "the sum is off by rounding"
    with pytest.raises(
        RunError, match=r"step of 0\.1 s from t = 3 s: must end at 3 s, the stop time, or before"
    ):
        unit.step(t, 0.1)
    unit.close()


def test_a_step_that_takes_too_long_is_discarded(motor):
    with Running(motor, {"solver.max_steps": 100.0, "w_ref": 50.0}) as unit:
        before = unit.get(["phi", "w"])
        with pytest.raises(RunError, match=r"takes more than solver\.max_steps = 100 steps of its own"):
            unit.step(0.0, 0.1)
        assert unit.get(["phi", "w"]) == before
        unit.step(0.0, 0.01)
        assert unit.get(["phi", "w"]) != before


def sealed(text):
    """A serialized state with the checksum that belongs to it."""
    return binascii.crc32(text).to_bytes(4, "big") + text


def test_a_damaged_state_is_refused(motor):
    """It leaves the instance without a state: neither numbers from before, nor a step."""
    with Running(motor, {"w_ref": 50.0}) as unit:

        def refused(raw):
            unit.restore(unit._fmi.deSerializeFMUstate(raw))
            return all(map(math.isnan, unit.get(["w", "phi", "tau"])))

        unit.step(0.0, 0.01)
        raw = unit._fmi.serializeFMUstate(unit.state())
        kept = unit.get(["w", "phi", "tau"])
        unit.step(0.01, 0.01)
        for bit in range(0, 8 * len(raw), 7):
            flipped = bytearray(raw)
            flipped[bit // 8] ^= 1 << bit % 8
            assert refused(bytes(flipped))
        # a CRC is linear: two flipped bits pass together only if each alone changes it alike
        text = bytearray(raw[4:])
        changes = [1 << bit for bit in range(32)]  # those of the checksum itself
        for bit in range(8 * len(text)):
            text[bit // 8] ^= 1 << bit % 8
            changes.append(binascii.crc32(text) ^ binascii.crc32(raw[4:]))
            text[bit // 8] ^= 1 << bit % 8
        assert sealed(raw[4:]) == raw and 0 not in changes and len(set(changes)) == len(changes)
        with pytest.raises(RunError, match="saved state: it is damaged; not restored"):
            unit.step(0.02, 0.01)
        assert refused(unit._fmi.serializeFMUstate(unit.state()))
        for old, new, message in (
            (b" 9.5,", b" -9.5,", "armature.R = -"),
            (b'"x": [', b'"x": [], "y": [', "not a saved state of this model"),
        ):
            text = raw[4:].replace(old, new)
            assert refused(sealed(text))
            assert message in unit.messages[-1]
        unit.restore(unit._fmi.deSerializeFMUstate(raw))
        assert unit.get(["w", "phi", "tau"]) == kept
        unit.step(0.01, 0.01)
        assert refused(b"")
        unit._fmi.reset()
        unit.initialize({}, 0.0)
        unit.finish_initialization()
        assert all(map(math.isfinite, unit.get(["w", "phi", "tau"])))


def test_calls_of_other_types_and_unknown_references_are_not_fatal(motor):
    with Running(motor) as unit:
        api = unit._fmi
        assert math.isnan(api.getReal([12345])[0])
        api.setReal([12345], [1.0])
        assert api.getInteger([0]) == [0]
        assert not api.getBoolean([0])[0]
        assert api.getString([0])[0] in ("", b"")
        api.setInteger([0], [1])
        state = unit.state()
        before = unit.get(["w"])
        for no_state in (b"no state at all", b'{"set": [1], "x": "y"}'):
            unit.restore(api.deSerializeFMUstate(no_state))
            assert unit.messages[-1] == "saved state: it is damaged; not restored"
        for text in (b"no state at all", b"[]", b'{"of": "chainunit", "set": [1], "x": "y"}'):
            unit.restore(api.deSerializeFMUstate(sealed(text)))
            assert unit.messages[-1].startswith("saved state: it ")
        unit.restore(state)
        assert unit.get(["w"]) == before


def test_counts_and_switches_are_integers_and_booleans(unpacked):
    """In pythonfmu's FMU: read and set by their own functions alone, and refused by others without a number."""
    fmu = unpacked("InductionMotor")
    names = ("cage.R", "pole_pairs", "inverter.on")
    real, count, switch = (fmu.variables[name].valueReference for name in names)
    start = {"pole_pairs": 3, "inverter.on": True, "w_ref": 100.0, "load.J": 0.01}
    with Running(fmu, start) as unit:
        api = unit._fmi
        assert unit.get(["pole_pairs", "cage.R", "inverter.on"]) == [3.0, 2.1, 1.0]
        assert api.getInteger([count]) == [3] and api.getBoolean([switch]) == [True]
        for get, vr, nothing, kind in (
            (api.getReal, count, math.nan, "Real"),
            (api.getReal, switch, math.nan, "Real"),
            (api.getInteger, switch, 0, "Integer"),
            (api.getBoolean, real, 0, "Boolean"),
        ):
            assert get([vr]) == pytest.approx([nothing], nan_ok=True)
            assert unit.messages[-1] == f"value reference {vr} is no variable of the type {kind}"
        api.setReal([count], [4.0])
        assert api.getInteger([count]) == [3]
        unit.step(0.0, 0.01)
    runs = [
        fmpy.simulate_fmu(
            str(fmu.file), start_values=given, output=["w", *names[1:]], stop_time=0.1, output_interval=0.01
        )
        for given in (start, start | {"inverter.on": False}, start | {"pole_pairs": 1})
    ]
    assert [(int(run["pole_pairs"][-1]), bool(run["inverter.on"][-1])) for run in runs] == [
        (3, True),
        (3, False),
        (1, True),
    ]
    assert len({float(run["w"][-1]) for run in runs}) == 3
    with (
        Running(fmu, {"pole_pairs": 25}) as unit,
        pytest.raises(RunError, match="pole_pairs = 25: must be a whole number >= 1 and <= 24"),
    ):
        unit.step(0.0, 0.01)
    with (
        contextlib.closing(Instance(fmu, "unit")) as unit,
        pytest.raises(InputError, match=r"pole_pairs = 2\.5: must be a whole number"),
    ):
        unit.initialize({"pole_pairs": 2.5}, 0.0)


def test_fixed_and_tunable_parameters(chamber):
    with Running(chamber) as unit:
        unit.set(["phi", "a"], [0.5, 1.0])
        before = unit.get(["tau", "r", "crank.m"])
        unit.set(["r"], [0.12])
        assert unit.get(["tau", "r", "crank.m"]) == before
        assert "r is fixed" in unit.messages[-1]
        unit.set(["crank.m"], [0.0])
        after = unit.get(["tau", "r", "crank.m"])
        assert after[0] != before[0] and after[2] == 0.0
        unit.set(["crank.m"], [-1.0])
        assert unit.get(["crank.m"]) == [0.0] and "crank.m = -1 kg" in unit.messages[-1]


def test_reset(chamber):
    with Running(chamber) as unit:
        unit.set(["phi"], [0.5])
        unit._fmi.reset()
        unit.initialize({"r": 0.14}, 0.0)
        unit.finish_initialization()
        loads = {f"{side}.material_mass": 30.0 for side in ("left", "right")}
        want = ChainUnitMachine(r=0.14).evaluate(loads)["tau"]
        assert unit.get(["r", "tau"]) == pytest.approx([0.14, float(want)], rel=1e-12)


@pytest.fixture
def in_process(fmus, tmp_path, monkeypatch):
    """``in_process(name)``: makes slaves of that Python FMU, without a host, at a state in motion."""

    def of_model(name):
        with zipfile.ZipFile(fmus[name]) as archive:
            archive.extractall(tmp_path / name)
        resources = tmp_path / name / "resources"
        monkeypatch.syspath_prepend(str(resources))
        module = __import__((resources / "slavemodule.txt").read_text())
        inputs = Interface(MODELS[name], {}).signals_of("input")
        references = [s.reference for s in inputs if s.variable.type == "Real"]

        def slave():
            unit = getattr(module, name)(instance_name="unit", resources=str(resources))
            unit.enter_initialization_mode()
            unit.exit_initialization_mode()
            unit.set_real(references, [0.3 + 0.1 * k for k in range(len(references))])
            return unit

        return slave

    return of_model


REFERENCES = {s.name: s.reference for s in Interface(ChamberForces, {}).signals}


def test_a_step_evaluates_once_what_was_read(in_process, monkeypatch):
    """Also if a host reads one output a call, after its first step. Many such reads make it all outputs."""
    unit = in_process("ChamberForces")()
    module = sys.modules[type(unit._instance).__module__]
    evaluation, calls = module._evaluation, []

    def counted(model, known):
        known, outputs, function = evaluation(model, known)
        return known, outputs, lambda *state: (calls.append(len(outputs)), function(*state))[1]

    monkeypatch.setattr(module, "_evaluation", counted)

    def evaluated(*names, time=0.0):
        calls.clear()
        assert unit.do_step(time, 0.0)
        for name in names:
            assert math.isfinite(unit.get_real([REFERENCES[name]])[0])
        return calls.copy()

    assert evaluated("phi", "r") == []
    assert evaluated("tau", "rocker.tau", "tau") == [1, 2]
    for names in (("tau", "rocker.tau"), ("rocker.tau",), ("r", "tau", "tau")):
        unit.set_real([REFERENCES["phi"]], [len(names)])
        assert evaluated(*names) == [2]
    outputs = len(unit.model.OUTPUTS)
    assert evaluated("pivot.fx", "pivot.fy", "tau", "J", "power") == [3, outputs]
    unit.set_real([REFERENCES["phi"]], [0.5])
    assert evaluated("power") == [outputs]


@pytest.mark.parametrize("name", ["ChamberForces", "ChainUnit", "DcMotor"])
def test_an_output_has_the_same_bits_whatever_is_read_with_it(in_process, name):
    slave = in_process(name)
    whole = slave()._instance
    outputs = range(whole.first_output, whole.first_output + len(whole.model.OUTPUTS))
    bits = [float(value).hex() for value in whole.values(outputs)]
    assert len(set(bits)) > 1 and "nan" not in bits
    growing = slave()._instance
    for k in (1, 2, len(outputs) // 2, len(outputs)):
        assert [float(value).hex() for value in growing.values(outputs[:k])] == bits[:k]
    assert [float(slave()._instance.values([i])[0]).hex() for i in outputs] == bits


def test_an_output_that_is_not_finite_spoils_none_that_is_read_without_it(in_process):
    unit, lines = in_process("ChamberForces")(), []
    unit._instance._log = lines.append
    both = [REFERENCES["rocker.tau"], REFERENCES["tau"]]
    assert all(map(math.isfinite, unit.get_real(both)))
    unit.set_real([REFERENCES["w"]], [1e120])
    assert math.isfinite(unit.get_real(both[:1])[0]) and not lines
    for references in (both[1:], both):
        assert all(map(math.isnan, unit.get_real(references)))
    assert len(lines) == 1 and lines[0].startswith("an output of ChamberForces is not a finite number")
    unit.set_real([REFERENCES["w"]], [3.0])
    assert all(map(math.isfinite, unit.get_real(both)))


def test_state_is_saved_and_serialised(motor):
    names = [n for n, v in motor.variables.items() if v.causality == "output"]
    with Running(motor, {"w_ref": 50.0}) as unit:
        unit.step(0.0, 0.01)
        state = unit.state()
        kept = unit.get(names)
        unit.step(0.01, 0.05)
        later = unit.get(names)
        assert later != kept
        unit.restore(state)
        assert unit.get(names) == kept
        raw = unit._fmi.serializeFMUstate(state)
        unit.step(0.01, 0.05)
        assert unit.get(names) == later
        unit.restore(unit._fmi.deSerializeFMUstate(raw))
        assert unit.get(names) == kept
        unit.forget(state)


def test_variable_communication_step(motor):
    """Equal end, whatever the steps: the internal integrator's error is far below."""
    ends = []
    for steps in ([0.1], [0.01] * 10, [0.03, 0.0001, 0.0499, 0.02]):
        with Running(motor, {"w_ref": 40.0}) as unit:
            t = 0.0
            for h in steps:
                unit.step(t, h)
                t += h
            ends.append(unit.get(["phi", "w", "armature.i"]))
    assert ends[1] == pytest.approx(ends[0], rel=1e-7)
    assert ends[2] == pytest.approx(ends[0], rel=1e-7)


def test_export_refuses_bad_start_values(tmp_path):
    file = tmp_path / "x.fmu"
    with pytest.raises(GeometryError, match="the crank cannot turn"):
        export(ChamberForces, file, {"r": 0.9})
    with pytest.raises(InputError, match=r"crank\.m = -1 kg: must be >= 0 kg"):
        export(ChamberForces, file, {"crank.m": -1.0})
    with pytest.raises(InputError, match=r"left.material_mass = nan kg"):
        export(ChamberForces, file, {"left.material_mass": math.nan})
    with pytest.raises(KeyError, match="no parameter or input 'q'"):
        export(ChamberForces, file, {"q": 1.0})
    assert list(tmp_path.iterdir()) == []


def test_export_leaves_the_process_as_it_was(tmp_path):
    path, modules = list(sys.path), set(sys.modules)
    export(ChamberForces, tmp_path / "x.fmu")
    assert sys.path == path
    assert not [m for m in set(sys.modules) - modules if m.startswith(("chainunit_", "ChamberForces_"))]


def test_no_scaffold_in_the_file(fmus):
    names = zipfile.ZipFile(fmus["ChamberForces"]).namelist()
    assert "modelDescription.xml" in names and "resources/modelDescription.xml" not in names
    assert not [n for n in names if "__pycache__" in n or "\\" in n]
    assert all(
        Path(n).suffix in (".py", ".txt", ".xml", ".so", ".dll", ".html", ".png", ".csv", ".exp")
        for n in names
    )


def test_documentation_names_every_variable(fmus):
    for file in fmus.values():
        text = zipfile.ZipFile(file).read("documentation/index.html").decode()
        for v in fmpy.read_model_description(str(file)).modelVariables:
            assert f"<code>{v.name}</code>" in text
