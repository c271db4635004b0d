"""Native FMUs give the numbers of Python and exact derivatives, and never crash a host."""

from __future__ import annotations

import ctypes
import math
import re
import shutil
import subprocess
import sys
import zipfile
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from string import Formatter

import casadi
import fmpy
import fmpy.util
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Model
from fmpy.fmi3 import FMU3Model
from fmpy.validation import validate_fmu
from lxml import etree
from scipy.integrate import solve_ivp
from test_fmu import Running
from test_reference import POINTS, deviation

from chainunit import ChainUnitMachine, GeometryError, InputError, RunError
from chainunit.core import integrators, messages
from chainunit.core.engines import MATH
from chainunit.core.native.cache import OFF, VARIABLE
from chainunit.core.native.compilers import compile_code, compiler
from chainunit.core.quantities import TYPES
from chainunit.fmu.description import Interface
from chainunit.fmu.export import export as export_python
from chainunit.fmu.native.export import export
from chainunit.fmu.native.generate import rules
from chainunit.fmu.native.platforms import HEADERS, KERNELS
from chainunit.fmu.recipe import Experiment
from chainunit.fmu.reference import INPUTS, READ, REFERENCE, SMOKE_TEST, STANDARD, STEPPED, excitation
from chainunit.fmu.reference import reference_results as reference_results_of
from chainunit.machines.chain_unit import ChamberForces
from chainunit.models import MODELS
from chainunit.system.instance import Fmu, Instance

HERE = Path(__file__).parent
LARGE = ("KnifeDrive", "ChainUnitFlexible")  # whose kernels take a compiler ten seconds
pytestmark = pytest.mark.skipif(compiler() is None, reason="no C compiler")


def host_arguments(folder, library):
    """The arguments of host.c: library, identifier, value references."""
    description = fmpy.read_model_description(str(folder))
    reference = {v.name: v.valueReference for v in description.modelVariables}
    identifier = description.guid or description.instantiationToken
    return [str(library), identifier, *(str(reference[n]) for n in ("phi", "w", "tau"))]


def host_torque():
    """The torque that host.c prints at the end of each of its steps of 0.1 s, by the Python kernels, at the FMU's
    start values."""
    loads = {f"{side}.material_mass": 30.0 for side in ("left", "right")}
    return ChainUnitMachine().evaluate({"phi": 0.5 * np.arange(10) + 0.6, "w": 6.0} | loads)["tau"]


@pytest.fixture
def native(native_fmus):
    return native_fmus


@contextmanager
def running(native, name, start=None):
    """An initialised FMI 2.0 instance, closed and its files removed at the end."""
    fmu = Fmu(native[name, 2][0])
    try:
        with Running(fmu, start) as instance:
            yield instance
    finally:
        fmu.close()


@pytest.mark.parametrize("kind", ["CoSimulation", "ModelExchange"])
@pytest.mark.parametrize("fmi", [2, 3])
def test_reference_points(native, fmi, kind):
    file, folder = native["ChamberForces", fmi]
    inputs = dict.fromkeys(ChamberForces.input_layout.names, 0.0)
    worst = 0.0
    for point in POINTS:
        row = fmpy.simulate_fmu(
            folder,
            fmi_type=kind,
            stop_time=1e-3,
            output_interval=1e-3,
            start_values=point["parameters"] | inputs | point["inputs"],
            output=list(point["outputs"]),
        )[0]
        worst = max(
            worst, *(deviation(float(row[n]), reference) for n, reference in point["outputs"].items())
        )
    assert worst < 1e-9
    assert validate_fmu(str(file)) == []


def test_native_and_pythonfmu_agree(native, fmus):
    rng = np.random.default_rng(4)
    for name in MODELS:
        python = Fmu(fmus[name])
        names = [n for n, v in python.variables.items() if v.causality == "output"]
        inputs = [n for n, v in python.variables.items() if v.causality == "input"]
        with running(native, name) as one:
            two = Instance(python, "unit")
            two.initialize({}, 0.0)
            two.finish_initialization()
            for k in range(20):
                # the plain values of a load port, masses and speeds: none negative
                most = [min(3.0, v.quantity.high) for v in MODELS[name].input_layout.variables]
                values = rng.uniform(0.01, most)
                for unit in (one, two):
                    unit.set(inputs, values)
                    unit.step(1e-3 * k, 1e-3)
                np.testing.assert_allclose(one.get(names), two.get(names), rtol=1e-12, atol=1e-12)
            two.close()
        python.close()


@pytest.mark.parametrize("name", list(MODELS))
def test_inputs_of_the_initialization_mode_start_both_alike(native, fmus, name):
    """Set once, read, and set anew: the states at the start follow the inputs."""
    rng = np.random.default_rng(12)
    low, high = np.array(
        [(max(0.01, v.quantity.low), min(3.0, v.quantity.high)) for v in MODELS[name].input_layout.variables]
    ).T
    given = rng.uniform(low, high, (2, len(low)))
    found = []
    for file in (native[name, 2][0], fmus[name]):
        fmu = Fmu(file)
        inputs = [n for n, v in fmu.variables.items() if v.causality == "input"]
        unit, rows = Instance(fmu, "unit"), []
        unit.initialize({}, 0.0)
        for values in given:
            unit.set(inputs, values)
            rows.append(unit.get(fmu.outputs()))
        unit.finish_initialization()
        rows.append(unit.get(fmu.outputs()))
        unit.step(0.0, 1e-4)
        rows.append(unit.get(fmu.outputs()))
        assert rows[1] == rows[2] != rows[0]
        unit.close()
        fmu.close()
        found.append(rows)
    np.testing.assert_allclose(*found, rtol=1e-9, atol=1e-9)


def test_an_observer_starts_from_the_speed_of_the_initialization_mode(native, fmus):
    for file in (native["LoadObserver", 2][0], fmus["LoadObserver"]):
        fmu = Fmu(file)
        unit = Instance(fmu, "unit")
        unit.initialize({}, 0.0)
        unit.set(["w"], [0.7])
        unit.finish_initialization()
        assert unit.get(["speed"]) == [0.7]
        unit.close()
        fmu.close()


def jacobian(model, values):
    """Outputs, and derivatives of the states, by inputs and states, by CasADi from the same kernels."""
    interface = Interface(model, {})
    t = interface.trace
    symbols, x, outputs, derivatives = t.symbols, t.x, t.outputs, t.derivatives
    _, us, xs, _ = symbols
    states = model.state_layout.values(x) if model.state_layout else []
    rows = casadi.vertcat(*states, *outputs, *derivatives)
    f = casadi.Function("j", symbols, [casadi.jacobian(rows, casadi.vertcat(us, xs))])
    n_p, n_u = len(interface.parameters), len(interface.inputs)
    p, u, x0 = values[:n_p], values[n_p : n_p + n_u], values[n_p + n_u : n_p + n_u + len(interface.states)]
    return np.array(f(p, u, x0, model.derive(MATH, model.parameter_layout.instance(p))))


def numbers(unit, variables):
    """The values of FMI 2.0 variables, each by the function of its type."""
    return [float(getattr(unit, f"get{v.type}")([v.valueReference])[0]) for v in variables]


@pytest.mark.stages(first=2)
@pytest.mark.parametrize("name", list(MODELS))
def test_directional_derivatives_are_exact(native, name):
    model = MODELS[name]
    fmu = Fmu(native[name, 2][0])
    unit = FMU2Model(
        guid=fmu.description.guid, unzipDirectory=fmu.folder, modelIdentifier=name, instanceName="unit"
    )
    unit.instantiate()
    unit.setupExperiment()
    unit.enterInitializationMode()
    unit.exitInitializationMode()
    interface = Interface(model, {})
    first, n_u, n_x = len(interface.parameters), len(interface.inputs), len(interface.states)
    last = first + n_u + 2 * n_x + len(interface.others)
    rng = np.random.default_rng(8)
    drawn = zip(rng.uniform(0.5, 2.0, n_u), model.input_layout.variables, strict=True)
    within = [min(value, v.quantity.high) for value, v in drawn]
    unit.setReal(list(range(first, first + n_u)), within)
    if n_x:
        x = (ctypes.c_double * n_x)(*rng.uniform(0.5, 2.0, n_x))
        unit.setContinuousStates(x, n_x)
    known = list(range(first, first + n_u + n_x))
    exact = jacobian(model, numbers(unit, fmu.description.modelVariables[: first + n_u + n_x]))
    # a count has no derivative
    variables = fmu.description.modelVariables[first + n_u : last]
    smooth = [v.type == "Real" for v in variables]
    unknown, exact = [v.valueReference for v in variables if v.type == "Real"], exact[smooth]
    # those that the model says are taken by differences; others to rounding of the largest
    apart = {name for part in model.parts for name in part.by_differences}
    names = [s.name for s in interface.signals_of("output") if s.variable.type == "Real"] + ["der"] * n_x
    plain = np.array([name not in apart for name in names])
    tiny, largest = 1e-16 * max(1e4, np.abs(exact[plain]).max()), np.abs(exact).max()
    for k, column in enumerate(known):
        got = np.array(unit.getDirectionalDerivative(unknown, [column], [1.0]))
        np.testing.assert_allclose(got[plain], exact[plain, k], rtol=1e-12, atol=tiny)
        np.testing.assert_allclose(got[~plain], exact[~plain, k], rtol=1e-6, atol=1e-6 * largest)
    # all at once, along a random direction
    seed = rng.uniform(-1.0, 1.0, len(known))
    got = np.array(unit.getDirectionalDerivative(unknown, known, list(seed)))
    np.testing.assert_allclose(got[plain], (exact @ seed)[plain], rtol=1e-10, atol=100.0 * tiny)
    # and against central differences of the FMU itself, in one input
    at = unit.getReal([first])[0]
    h = 1e-5
    both = []
    for sign in (1.0, -1.0):
        unit.setReal([first], [at + sign * h])
        both.append(np.array(unit.getReal(unknown)))
    size = np.maximum(1.0, np.abs(exact[:, 0]))
    np.testing.assert_allclose((both[0] - both[1]) / (2 * h) / size, exact[:, 0] / size, atol=1e-6)
    unit.terminate()
    unit.freeInstance()
    fmu.close()


class Exchange:
    """An FMI 2.0 Model Exchange instance in initialization mode, by variable name; `known` and `unknown` are what a
    linearisation differentiates by, and what it differentiates."""

    def __init__(self, native, name):
        fmu = self.fmu = Fmu(native[name, 2][0])
        self.interface = interface = Interface(MODELS[name], {})
        self.unit = FMU2Model(
            guid=fmu.description.guid, unzipDirectory=fmu.folder, modelIdentifier=name, instanceName="unit"
        )
        self.unit.instantiate()
        self.unit.setupExperiment()
        self.unit.enterInitializationMode()
        self.references = {n: v.valueReference for n, v in fmu.variables.items()}
        self.inputs = [s.reference for s in interface.signals_of("input")]
        self.n = len(interface.states)
        last = len(interface.signals)
        outputs = [s.reference for s in interface.signals_of("output") if s.variable.type == "Real"]
        self.states = outputs[: self.n]
        self.derivatives = list(range(last, last + self.n))
        self.unknown = [*self.states, *self.derivatives, *outputs[self.n :]]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.unit.freeInstance()
        self.fmu.close()

    def excited(self, t):
        """Inputs at the time `t`, as in the reference results."""
        return self.interface.model.input_layout.from_names(excitation(self.interface)(t))

    def run(self):
        self.unit.exitInitializationMode()
        self.unit.enterContinuousTimeMode()

    def x(self):
        x = (ctypes.c_double * self.n)()
        self.unit.getContinuousStates(x, self.n)
        return np.array(x)

    def move_to(self, x):
        if self.n:
            self.unit.setContinuousStates((ctypes.c_double * self.n)(*x), self.n)

    def jacobian(self, known):
        """By directional derivatives, one of `known` a column."""
        get = self.unit.getDirectionalDerivative
        return np.array([get(self.unknown, [k], [1.0]) for k in known]).T

    def quotients(self, known):
        """Difference quotients to the right and to the left; of an input at its least value to the right twice, the
        second with half the step."""
        low = {s.reference: s.variable.quantity.low for s in self.interface.signals_of("input")}
        here, x, middle = self.unit.getReal(self.inputs), self.x(), np.array(self.unit.getReal(self.unknown))
        right, left = np.empty((2, len(self.unknown), len(known)))
        for column, k in enumerate(known):
            at = here[self.inputs.index(k)] if k in self.inputs else x[self.states.index(k)]
            h = 2e-6 * max(1.0, abs(at))
            for side, step in ((right, h), (left, -h if at - h >= low.get(k, -math.inf) else 0.5 * h)):
                if k in self.inputs:
                    self.unit.setReal([k], [at + step])
                else:
                    moved = x.copy()
                    moved[self.states.index(k)] += step
                    self.move_to(moved)
                side[:, column] = (np.array(self.unit.getReal(self.unknown)) - middle) / step
                if k in self.inputs:
                    self.unit.setReal([k], [at])
                else:
                    self.move_to(x)
        return right, left


def assert_a_derivative(found, right, left):
    """Finite, and where both quotients agree theirs, at a kink between them."""
    assert np.isfinite(found).all()
    size = np.maximum(1.0, np.maximum(np.abs(right), np.abs(left)))
    # rounding of outputs up to 1e4 over steps of 2e-6
    slack = 1e-5 * size + 1e-5 * np.maximum(1.0, np.abs(found)).max(axis=1, keepdims=True)
    assert (found > np.minimum(right, left) - slack).all()
    assert (found < np.maximum(right, left) + slack).all()


@pytest.mark.stages(first=1)
@pytest.mark.parametrize("name", list(MODELS))
def test_linearisation_at_the_start_and_in_a_run(native, name):
    """A, B, C and D as PyFMI takes them, one directional derivative a column; in initialization mode the states
    follow the inputs."""
    model = MODELS[name]
    with Exchange(native, name) as unit:
        assert_a_derivative(unit.jacobian(unit.inputs), *unit.quotients(unit.inputs))
        unit.run()
        known = [*unit.states, *unit.inputs]
        assert_a_derivative(unit.jacobian(known), *unit.quotients(known))
        t, h = 0.0, 1e-4
        while t < 0.05:
            unit.unit.setTime(t)
            unit.unit.setReal(unit.inputs, model.input_layout.values(unit.excited(t)))
            if unit.n:
                dx = (ctypes.c_double * unit.n)()
                unit.unit.getDerivatives(dx, unit.n)
                unit.move_to(unit.x() + h * np.array(dx))
            t += h
        assert_a_derivative(unit.jacobian(known), *unit.quotients(known))


@pytest.mark.parametrize("name", list(MODELS))
def test_derivatives_are_finite_wherever_a_model_may_be(native, name):
    """Nothing on, nothing loaded, each alone at zero, and random states between."""
    rng = np.random.default_rng(21)
    with Exchange(native, name) as unit:
        unit.run()
        inputs = [s.variable.quantity for s in unit.interface.signals_of("input")]
        given, x = np.array([q.start for q in inputs]), unit.x()
        # a chain at rest along one line is no state that it may be in
        still = x if name == "ChainUnitFlexible" else 0.0 * x
        zero = np.zeros(len(given))
        trials = [(given, x), (zero, x), (given, still), (zero, still)]
        trials += [(np.where(np.arange(len(given)) == k, 0.0, given), x) for k in range(len(given))]
        trials += [(given, np.where(np.arange(unit.n) == k, still, x)) for k in range(unit.n)]
        for _ in range(20):
            values = [rng.uniform(max(q.low, -3.0), min(q.high, 3.0)) for q in inputs]
            kept, off = rng.random((2, 1)) < 0.5
            trials.append((np.where(kept, values, zero), x + off * rng.uniform(-0.1, 0.1, unit.n)))
        known = [*unit.states, *unit.inputs]
        for u, at in trials:
            unit.unit.setReal(unit.inputs, list(u))
            unit.move_to(at)
            assert np.isfinite(unit.jacobian(known)).all()


def test_output_derivatives_and_input_interpolation(native):
    """An input that runs along its derivative inside the step; d/dt of an output against a difference."""
    h = 1e-3
    with running(native, "DcMotor", {"w_ref": 0.0}) as unit:
        api = unit._fmi
        w_ref, a = (unit.fmu.variables[n].valueReference for n in ("w_ref", "a"))
        api.setRealInputDerivatives([w_ref], [1], [500.0])
        unit.step(0.0, 0.05)
        ramp = unit.get(["w", "w_ref"])
        assert ramp[1] == pytest.approx(25.0)
        rate = api.getRealOutputDerivatives([a], [1])[0]
        before = unit.get(["a"])[0]
        api.setRealInputDerivatives([w_ref], [1], [500.0])
        unit.step(0.05, h)
        assert (unit.get(["a"])[0] - before) / h == pytest.approx(rate, rel=0.2)
    with running(native, "DcMotor") as unit:
        for k in range(5000):
            unit.set(["w_ref"], [500.0 * (k + 0.5) * 1e-5])
            unit.step(k * 1e-5, 1e-5)
        assert unit.get(["w"])[0] == pytest.approx(ramp[0], rel=1e-4)


def test_model_exchange_and_co_simulation_meet(native):
    """The internal integrator against an error-controlled solver, in FMI 2 and 3."""
    ends = []
    for fmi in (2, 3):
        for kind in ("CoSimulation", "ModelExchange"):
            row = fmpy.simulate_fmu(
                native["DcMotor", fmi][1],
                fmi_type=kind,
                stop_time=0.2,
                output_interval=0.01,
                relative_tolerance=1e-9,
                start_values={"w_ref": 30.0, "load.tau_bias": 0.3},
                output=["phi", "w", "armature.i"],
            )[-1]
            ends.append(list(row)[1:])
    for end in ends[1:]:
        np.testing.assert_allclose(end, ends[0], rtol=1e-4)


def test_states_are_saved_and_serialised(native):
    with running(native, "DcMotor", {"w_ref": 50.0}) as unit:
        names = unit.fmu.outputs()
        unit.step(0.0, 0.01)
        state, kept = unit.state(), unit.get(names)
        unit.step(0.01, 0.05)
        later = unit.get(names)
        assert later != kept
        unit.restore(state)
        assert unit.get(names) == kept
        raw = unit._fmi.serializeFMUstate(state)
        unit.step(0.01, 0.05)
        assert unit.get(names) == later
        again = unit._fmi.deSerializeFMUstate(raw)
        unit.restore(again)
        assert unit.get(names) == kept
        unit.forget(again)
        unit.forget(state)


def test_a_geometry_that_cannot_turn_fails_the_initialisation_in_the_same_words(native):
    with pytest.raises(GeometryError) as refusal:
        ChainUnitMachine(r=0.9)
    with pytest.raises(RunError) as failed:
        with running(native, "ChamberForces", {"r": 0.9}):
            pass
    assert str(refusal.value) in str(failed.value)
    with pytest.raises(GeometryError) as refusal:
        ChainUnitMachine(z=0.1)
    with pytest.raises(RunError) as failed:
        with running(native, "ChamberForces", {"z": 0.1}):
            pass
    assert str(refusal.value) in str(failed.value)
    with pytest.raises(RunError, match=r"rotor\.J = -1 kg m2: must be > 0 kg m2"):
        with running(native, "DcMotor", {"rotor.J": -1.0}):
            pass


def test_python_and_native_code_refuse_in_the_same_words(native, fmus):
    """A Python FMU adds its call and the description of the variable."""
    lines = []
    for file in (native["DcMotor", 2][0], fmus["DcMotor"]):
        fmu, messages = Fmu(file), []
        with Running(fmu, {"solver.max_steps": 20.0}) as unit:
            for call, *arguments in (
                (unit.step, 0.5, 0.1),
                (unit.step, 0.0, -0.1),
                (unit.step, 0.0, 10.0),
                (unit.set, ["armature.L"], [1.0]),
                (unit.set, ["armature.R"], [-1.0]),
                (unit.set, ["w"], [1.0]),
            ):
                with suppress(RunError):
                    call(*arguments)
                messages.append(unit.messages[-1])
        fmu.close()
        lines.append(messages)
    assert len(set(lines[0])) == 6
    for of_native, of_python in zip(*lines, strict=True):
        assert of_native in of_python
    parameters = {"r": 1.0}
    with pytest.raises(GeometryError) as refusal:
        ChainUnitMachine(parameters)
    with pytest.raises(RunError) as failed, running(native, "ChamberForces", parameters):
        pass
    assert str(refusal.value) in str(failed.value)


def test_every_word_of_python_is_in_native_code():
    text = rules()
    for name, value in vars(messages).items():
        if name.isupper():
            pieces = [piece for piece, *_ in Formatter().parse(value) if piece]
            (line,) = (x for x in text.splitlines() if x.startswith(f"#define {name} "))
            assert pieces and all(piece in line for piece in pieces), name
    assert "%" not in re.sub(r"%[sgu]", "", text)
    numbers = re.findall(r"STAGES\[7\]\[6\] = {(.*?)};", text, re.DOTALL)[0]
    rows = [[float(x) for x in re.findall(r"[-\d.e]+", row)] for row in numbers.strip().splitlines()]
    assert [row or [0.0] for row in map(list, integrators.STAGES)] == rows


def test_bad_calls_end_in_an_error_and_one_line(native):
    fmu = Fmu(native["ChamberForces", 2][0])
    unit = Instance(fmu, "unit")
    with pytest.raises(RunError, match="outputs cannot be read before initialization"):
        unit.get(["tau"])
    unit.set(["phi", "w"], [0.5, 6.0])  # inputs may be set before initialisation
    with pytest.raises(RunError, match="fmi2DoStep is not allowed now"):
        unit.step(0.0, 0.1)
    unit.initialize({}, 0.0)
    unit.finish_initialization()
    good = unit.get(["tau"])
    for name, value in (("w", math.nan), ("phi", math.inf), ("tau", 1.0), ("r", 0.1), ("crank.m", -1.0)):
        message = len(unit.messages)
        with pytest.raises(RunError, match=rf"{name}|value reference"):
            unit.set([name], [value])
        assert len(unit.messages) == message + 1
        assert unit.get(["tau"]) == good  # the last good state stays readable
    unit.set(["w"], [1e200])
    with pytest.raises(RunError, match="not a finite number"):
        unit.get(["tau"])
    unit.set(["w"], [6.0])
    assert unit.get(["tau"]) == good
    for step in (-0.1, math.nan):
        with pytest.raises(RunError, match="must be finite and not negative"):
            unit.step(0.0, step)
    unit.close()
    fmu.close()


def test_a_wrong_guid_is_refused(native):
    fmu = Fmu(native["ChamberForces", 2][0])
    unit = FMU2Model(
        guid="{no}", unzipDirectory=fmu.folder, modelIdentifier="ChamberForces", instanceName="unit"
    )
    with pytest.raises(Exception, match="instantiate"):
        unit.instantiate()
    fmu.close()


@pytest.mark.stages(second=1)
@pytest.mark.second
@pytest.mark.parametrize(
    "name", [n if n not in LARGE else pytest.param(n, marks=pytest.mark.slow) for n in MODELS]
)
def test_same_model_same_file(native, name, tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, OFF)
    for fmi in (2, 3):
        again = export(MODELS[name], tmp_path / "again.fmu", fmi=fmi)
        assert again.read_bytes() == native[name, fmi][0].read_bytes()


def test_other_start_values_are_another_fmu(native, tmp_path):
    other = export(ChamberForces, tmp_path / "other.fmu", {"r": 0.14})
    assert fmpy.read_model_description(str(other)).guid != Fmu(native["ChamberForces", 2][0]).description.guid


def test_small_enough(native):
    for (name, _), (file, _) in native.items():
        # the knife's pose is followed around the crank at 20 angles, unrolled; of 16 rods each has its own lines
        larger = {"KnifeDrive": 550_000, "ChainUnitFlexible": 900_000}
        assert file.stat().st_size < larger.get(name, 300_000)


@pytest.mark.parametrize("fmi", [2, 3])
def test_a_plain_c_host(native, fmi, tmp_path):
    _, folder = native["ChamberForces", fmi]
    host = tmp_path / "host"
    command = [shutil.which("cc"), "-Wall", f"-DFMI={fmi}", "-o", str(host), str(HERE / "host.c")]
    subprocess.run([*command, "-I", f"{folder}/sources", "-ldl"], check=True)
    (library,) = Path(folder, "binaries").glob("*/*.so")
    process = subprocess.run([host, *host_arguments(folder, library)], capture_output=True, text=True)
    assert process.returncode == 0, process.stderr
    np.testing.assert_allclose([float(x) for x in process.stdout.split()], host_torque(), rtol=1e-12)
    needs = subprocess.run(["ldd", library], capture_output=True, text=True).stdout
    assert {line.split()[0].split(".")[0] for line in needs.splitlines()} <= {
        "linux-vdso", "libm", "libc", "/lib64/ld-linux-x86-64",
    }  # fmt: skip


def random_calls(folder, fmi, calls, tmp_path):
    """As many random calls of the unpacked FMU in `folder`, compiled with sanitizers."""
    sources = folder / "sources"
    # the equations are compiled apart, once for both versions of FMI: its warnings are not ours
    files = {name: (sources / name).read_bytes() for name in (KERNELS, *HEADERS)}
    kernels = compile_code(compiler(), ("-O1", "-c", KERNELS, "-o", "kernels.o"), files, "kernels.o")
    files = {file.name: file.read_bytes() for file in sources.iterdir() if file.is_file()}
    files |= {name: (HERE / name).read_bytes() for name in (f"fuzz{fmi}.c", "fuzz.h")}
    arguments = (
        "-std=c99", "-O1", "-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all",
        "-Wall", "-Wextra", "-Werror", "-Wno-unused-parameter", "-I", ".", "-o", "fuzz",
        f"fuzz{fmi}.c", "model.c", f"fmi{fmi}.c", "-Wl,--wrap=malloc,--wrap=calloc", "-lm", "kernels.o",
    )  # fmt: skip
    fuzz = tmp_path / "fuzz"
    fuzz.write_bytes(compile_code(compiler(), arguments, files | {"kernels.o": kernels}, "fuzz"))
    fuzz.chmod(0o700)
    process = subprocess.run([fuzz, str(calls)], capture_output=True, text=True)
    assert process.returncode == 0, process.stdout + process.stderr[-3000:]


@pytest.mark.stages(second=4)
@pytest.mark.second
@pytest.mark.parametrize("share", [0.03, pytest.param(1.0, marks=pytest.mark.slow)])
@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("name", list(MODELS))
def test_random_calls_under_sanitizers(native, name, fmi, share, tmp_path):
    """A million by .ci/full, a share of them each time."""
    # whose steps take steps of their own
    calls = 200_000 if name == "ChainUnitFlexible" else 1_000_000
    random_calls(Path(native[name, fmi][1]), fmi, int(share * calls), tmp_path)


def test_threads_do_not_see_each_other(native):
    """Many instances at once, one a thread: fmpy lets other threads run inside a call."""
    fmu = Fmu(native["ChainUnit", 2][0])

    def run(unit):
        for k in range(300):
            unit.step(1e-3 * k, 1e-3)
        return unit.get(["phi", "w", "tau_bias"])

    # fmpy changes the working directory while it loads: one after the other
    first, second = ([Instance(fmu, "unit") for _ in range(16)] for _ in range(2))
    for group in (first, second):
        for k, unit in enumerate(group):
            unit.initialize({"phi_start": 0.1 * k}, 0.0)
            unit.finish_initialization()
    alone = [run(unit) for unit in first]
    assert len({tuple(x) for x in alone}) == len(first)
    with ThreadPoolExecutor(8) as pool:
        assert list(pool.map(run, second)) == alone
    for unit in (*first, *second):
        unit.close()
    fmu.close()


def reference_results(folder, name):
    """What an FMU carries: inputs, outputs at the end of each step, outputs at its beginning, by the manifest."""
    root = etree.parse(Path(folder) / REFERENCE / "fmi-ls-manifest.xml").getroot()
    assert root.tag == "fmiReferences"
    space = "{http://fmi-standard.org/fmi-ls-manifest}fmi-ls-"
    assert root.get(f"{space}name") == STANDARD == REFERENCE.split("/")[1]
    assert root.get(f"{space}version") == "1.0.0-beta.1"
    files = {x.get("source"): x.get("role") for x in root.iter("Related")}
    assert files == {
        f"{name}_{INPUTS}.csv": "testcase",
        f"{name}_{STEPPED}.csv": "result",
        f"{name}_{READ}.csv": "result",
        f"{name}_{SMOKE_TEST}": "experiment/smoke-test",
    }
    (test,) = etree.parse(Path(folder) / REFERENCE / f"{name}_{SMOKE_TEST}").getroot()
    assert [x.get("source") for x in test] == [f"{name}_{INPUTS}.csv", f"{name}_{STEPPED}.csv"]
    tables = tuple(fmpy.util.read_csv(Path(folder) / REFERENCE / file) for file in [*files][:3])
    start, stop, step = (float(test.get(key)) for key in ("startTime", "stopTime", "stepSize"))
    np.testing.assert_allclose(tables[0]["time"], np.arange(start, stop + 0.5 * step, step), atol=1e-12)
    return tables


def assert_met(name, got, wanted):
    nominal = {s.name: s.variable.quantity.nominal or 1.0 for s in Interface(MODELS[name], {}).signals}
    tolerance = 1e-5 if MODELS[name].state_layout else 1e-12
    for n in wanted.dtype.names[1:]:
        # what is zero is not so to the last digit
        size = max(np.abs(wanted[n]).max(), 1e-3 * nominal[n])
        np.testing.assert_allclose(got[n], wanted[n], rtol=0.0, atol=tolerance * size + 1e-12, err_msg=n)


@pytest.mark.stages(second=2)
@pytest.mark.second
@pytest.mark.parametrize("name", list(MODELS))
def test_a_master_meets_both_reference_results(native, fmus, tmp_path, name):
    """Set, read, step, read: by native code and by pythonfmu; every input moves."""
    for file in (native[name, 2][0], fmus[name]):
        fmu = Fmu(file)
        given, stepped, read = reference_results(fmu.folder, name)
        assert [n for n in given.dtype.names[1:] if np.ptp(given[n]) == 0.0] == []
        inputs, outputs = list(given.dtype.names[1:]), list(read.dtype.names[1:])
        rows = []
        with Running(fmu, dict(zip(inputs, list(given[0])[1:], strict=True))) as unit:
            for k, row in enumerate(given):
                rows.append([unit.get(outputs)])
                unit.set(inputs, list(row)[1:])
                rows[-1].append(unit.get(outputs))
                if k + 1 < len(given):
                    unit.step(row["time"], given["time"][k + 1] - row["time"])
        for at, reference in enumerate((stepped, read)):
            got = np.rec.fromarrays(np.array([row[at] for row in rows]).T, names=outputs)
            assert_met(name, got, reference)
        fmu.close()


@pytest.mark.second
@pytest.mark.parametrize(
    ("name", "fmi", "kind"),
    [
        (name, fmi, kind)
        for name, model in MODELS.items()
        for fmi in (2, 3)
        for kind in ("CoSimulation", "ModelExchange")
        # fmpy holds its inputs in Model Exchange, which do not run there by themselves
        if kind == "CoSimulation" or not (model.input_rates and model.state_layout)
    ],
)
def test_fmpy_meets_the_reference_results(native, name, fmi, kind):
    """Its Co-Simulation reads at the end of each step, its Model Exchange once the inputs are set: these jump at each
    time, which is an event."""
    folder = native[name, fmi][1]
    given, stepped, read = reference_results(folder, name)
    reference = stepped
    if kind == "ModelExchange":
        times, given = given["time"], np.repeat(given, 2)[:-1]
        given["time"][1::2] = times[1:]
        reference = read
    got = fmpy.simulate_fmu(
        str(folder),
        fmi_type=kind,
        input=given,
        stop_time=reference["time"][-1],
        output_interval=reference["time"][1],
        relative_tolerance=1e-10,
        output=list(reference.dtype.names[1:]),
        record_events=False,
    )
    assert len(got) == len(reference)
    assert_met(name, got, reference)


class Equations:
    """The right-hand side of a Model Exchange FMU in FMI 2.0 or 3.0, whose inputs are set at each evaluation, as a
    solver sets them that knows them inside its steps."""

    def __init__(self, native, name, fmi, given):
        file, folder = native[name, fmi]
        description = fmpy.read_model_description(str(file))
        references = {v.name: v.valueReference for v in description.modelVariables}
        interface = Interface(MODELS[name], {})
        self.inputs = [references[s.name] for s in interface.signals_of("input")]
        self.outputs = [s.name for s in interface.signals_of("output")]
        self._read, self._n, self._fmi = [references[n] for n in self.outputs], len(interface.states), fmi
        self.nominal = np.array([s.quantity.nominal or 1.0 for s in interface.states])
        kind = FMU2Model if fmi == 2 else FMU3Model
        token = description.guid or description.instantiationToken
        self._unit = kind(guid=token, unzipDirectory=folder, modelIdentifier=name, instanceName="unit")
        self._unit.instantiate()
        if fmi == 2:
            self._unit.setupExperiment()
        self._unit.enterInitializationMode()
        self.set(given)
        self._unit.exitInitializationMode()
        self._to_continuous_time()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._unit.freeInstance()

    def _to_continuous_time(self):
        update = self._unit.newDiscreteStates if self._fmi == 2 else self._unit.updateDiscreteStates
        while update()[0]:
            pass
        self._unit.enterContinuousTimeMode()

    def set(self, given):
        (self._unit.setReal if self._fmi == 2 else self._unit.setFloat64)(self.inputs, list(given))

    def get(self):
        return list((self._unit.getReal if self._fmi == 2 else self._unit.getFloat64)(self._read))

    def jump(self, t, given, x):
        """Inputs jump, which is an event; the states behind it."""
        self.move_to(t, x)
        self._unit.enterEventMode()
        self.set(given)
        self._to_continuous_time()
        return self.x()

    def x(self):
        x = (ctypes.c_double * self._n)()
        self._unit.getContinuousStates(x, self._n)
        return np.array(x)

    def move_to(self, t, x):
        self._unit.setTime(t)
        self._unit.setContinuousStates((ctypes.c_double * self._n)(*x), self._n)

    def rates(self, t, given, x):
        self.move_to(t, x)
        self.set(given)
        dx = (ctypes.c_double * self._n)()
        (self._unit.getDerivatives if self._fmi == 2 else self._unit.getContinuousStateDerivatives)(
            dx, self._n
        )
        return np.array(dx)


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize(
    "name", [name for name, model in MODELS.items() if model.input_rates and model.state_layout]
)
def test_inputs_that_run_meet_the_reference_results_in_model_exchange(native, name, fmi):
    """Set at each evaluation: fmpy's own solver holds them over its steps. Outputs are read before the event, which
    brings a chain back to where a jump of the inputs took its end."""
    model = MODELS[name]
    given, _, reference = reference_results(native[name, fmi][1], name)
    rows = [list(row)[1:] for row in given]
    with Equations(native, name, fmi, rows[0]) as unit:
        x, got = unit.x(), []
        for k, (t, held) in enumerate(zip(given["time"], rows, strict=True)):
            unit.move_to(t, x)
            unit.set(held)
            got.append(unit.get())
            x = unit.jump(t, held, x)
            if k + 1 == len(rows):
                break

            def rates(time, states, since=t, held=held):
                u = np.array(held)
                for place, rate, half in model.extrapolations(held):
                    u[place] += (time - since) * (rate + (time - since) * half)
                return unit.rates(time, u, states)

            span = (t, given["time"][k + 1])
            solution = solve_ivp(rates, span, x, method="LSODA", rtol=1e-10, atol=1e-10 * unit.nominal)
            assert solution.success, solution.message
            x = solution.y[:, -1]
        assert_met(name, np.rec.fromarrays(np.array(got).T, names=unit.outputs), reference)


@pytest.mark.stages(first=1)
@pytest.mark.parametrize("name", [name for name, model in MODELS.items() if model.state_layout])
def test_euler_keeps_near_at_the_declared_step(native, name):
    """In a second of the reference inputs it errs by less than a fifth of a state's size; at 100 times the step by
    more than half of one: the models need a step, and the declared one is short enough."""
    model, reference = MODELS[name], Experiment(**MODELS[name].fmu_data.experiment)
    for fmi in (2, 3):
        default = fmpy.read_model_description(str(native[name, fmi][0])).defaultExperiment
        given = (default.stepSize, default.stopTime, default.tolerance)
        assert [float(x) for x in given] == [reference.step, reference.stop, reference.tolerance]
    moving = excitation(Interface(model, {}))
    marks = np.linspace(0.0, 1.0, 11)

    def inputs(t):
        return model.input_layout.values(model.input_layout.from_names(moving(t)))

    with Equations(native, name, 2, inputs(0.0)) as unit:
        begin = unit.x()

        def rates(t, x):
            return unit.rates(t, inputs(t), x)

        exact = solve_ivp(rates, (0.0, 1.0), begin, "LSODA", marks, rtol=1e-8, atol=1e-8 * unit.nominal)
        assert exact.success, exact.message
        size = np.maximum(np.abs(exact.y).max(axis=1), 0.1 * unit.nominal)

        def error(step):
            """The largest, in parts of the state's size; without end where Euler's method blows up."""
            x, most, every = begin, 0.0, round(marks[1] / step)
            for k in range(round(1.0 / step)):
                try:
                    x = x + step * rates(k * step, x)
                except FMICallException:
                    return math.inf
                if (k + 1) % every == 0:
                    most = max(most, np.abs((x - exact.y[:, (k + 1) // every]) / size).max())
            return most

        assert error(reference.step) < 0.2
        assert error(100.0 * reference.step) > 0.5


def test_descriptions_say_who_and_when(native, fmus, tmp_path, monkeypatch):
    """The same day for the same version, and that of SOURCE_DATE_EPOCH where it is set."""
    cited = re.search(r"date-released: (\S+)", (HERE.parent / "CITATION.cff").read_text())[1]

    def of(file):
        return etree.fromstring(zipfile.ZipFile(file).read("modelDescription.xml"))

    for file in (native["DcMotor", 2][0], native["DcMotor", 3][0], fmus["DcMotor"]):
        root = of(file)
        assert root.get("author") == "The chainunit makers"
        assert root.get("copyright").startswith("Copyright (c) 20")
        assert root.get("generationDateAndTime") == f"{cited}T00:00:00Z"
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    other = of(export_python(MODELS["DcMotor"], tmp_path / "other.fmu"))
    assert other.get("generationDateAndTime") == "2023-11-14T22:13:20Z"
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "yesterday")
    with pytest.raises(
        InputError, match=r"SOURCE_DATE_EPOCH = 'yesterday': must be a whole number of seconds"
    ):
        export_python(MODELS["DcMotor"], tmp_path / "other.fmu")


@pytest.mark.parametrize("name", ["DcMotor", "InductionMotor"])
def test_a_stiff_motor_is_exported_and_runs(tmp_path, name):
    """A brake of 10 kN m s/rad on a small rotor: it stands within a microsecond."""
    stiff = {"rotor.J": 0.0035, "rotor.d": 1e4}
    fmu = Fmu(export(MODELS[name], tmp_path / "stiff.fmu", stiff))
    given, stepped, _ = reference_results(fmu.folder, name)
    inputs, outputs = list(given.dtype.names[1:]), list(stepped.dtype.names[1:])
    with Running(fmu, dict(zip(inputs, list(given[0])[1:], strict=True))) as unit:
        rows = [unit.get(outputs)]
        for k in range(4):
            unit.set(inputs, list(given[k])[1:])
            unit.step(given["time"][k], given["time"][k + 1] - given["time"][k])
            rows.append(unit.get(outputs))
    got = np.rec.fromarrays(np.array(rows).T, names=outputs)
    assert_met(name, got, stepped[:5])
    fmu.close()


def test_an_export_does_not_follow_states_without_end(tmp_path, caplog, monkeypatch):
    """Shafts that nothing made is as stiff as: the FMU comes without reference results, and the log says why."""
    monkeypatch.setattr("chainunit.fmu.reference._MOST_STEPS", 300)
    file = export_python(MODELS["CardanDriveline"], tmp_path / "x.fmu", {"c2": 1e12, "c3": 1e12})
    assert not [n for n in zipfile.ZipFile(file).namelist() if n.startswith("extra/")]
    assert "CardanDriveline: no reference results inside: the states are too fast" in caplog.text


@pytest.mark.parametrize("ratio", [1.0, 40.0])
def test_a_machine_that_turns_by_itself_has_reference_results(ratio):
    """Behind a gear its shaft is light: the torque of the reference results is of its size."""
    interface = Interface(MODELS["KnifeDrive"].direct(), {"ratio": ratio})
    files = reference_results_of(interface)
    assert len(files) == 5, files
    stepped = next(text for name, text in files.items() if name.endswith(f"_{STEPPED}.csv"))
    head, *rows = stepped.decode().splitlines()
    w = [float(row.split(",")[head.split(",").index("w")]) for row in rows]
    assert len(rows) == 26 and 0.1 < max(map(abs, w)) < 1e4


def test_the_command_says_where_an_fmu_comes_without_reference_results(tmp_path):
    """With a budget that no model meets, as a model with very many states would take minutes."""
    small = "import chainunit.fmu.reference as a, chainunit.app.cli as c; a._MOST_STEPS = 1; c.main()"
    command = [sys.executable, "-c", small, "export", "DcMotor", "--backend", "python"]
    process = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert process.returncode == 0, process.stderr
    (line,) = process.stderr.splitlines()
    assert line.startswith(
        "The FMU DcMotor: no reference results inside: the states are too fast to be followed from t = 0 s"
    )
    assert "no run of this package needs them" in line
    names = zipfile.ZipFile(tmp_path / "DcMotor.fmu").namelist()
    assert not [n for n in names if n.startswith("extra/")]


def test_what_an_fmu_carries(native, fmus):
    schema = etree.XMLSchema(
        etree.parse(Path(fmpy.__file__).parent / "schema" / "fmi3" / "fmi3TerminalsAndIcons.xsd")
    )
    for name, model in MODELS.items():
        names = set(zipfile.ZipFile(native[name, 2][0]).namelist())
        common = {"documentation/index.html", "documentation/licenses/license.txt"}
        common |= {f"{REFERENCE}/{name}_{end}.csv" for end in (INPUTS, STEPPED, READ)}
        common |= {f"{REFERENCE}/fmi-ls-manifest.xml", f"{REFERENCE}/{name}_{SMOKE_TEST}"}
        of_2 = {*common, "model.png", "terminalsAndIcons/terminalsAndIcons.xml"}
        assert of_2 <= names
        assert of_2 <= set(zipfile.ZipFile(fmus[name]).namelist())
        with zipfile.ZipFile(native[name, 3][0]) as archive:
            assert {*common, "terminalsAndIcons/icon.png", "terminalsAndIcons/icon.svg"} <= set(
                archive.namelist()
            )
            root = etree.fromstring(archive.read("terminalsAndIcons/terminalsAndIcons.xml"))
            assert "MIT License" in archive.read("documentation/licenses/license.txt").decode()
        schema.assertValid(root)
        description = fmpy.read_model_description(str(native[name, 3][0]))
        known = {v.name for v in description.modelVariables}
        members = {
            t.get("name"): {m.get("memberName"): m.get("variableName") for m in t}
            for t in root.iter("Terminal")
        }
        if name == "LoadObserver":
            # an observer has no shaft
            assert {*members} == {"measured"} and {*members["measured"].values()} <= known
        else:
            assert set(members["flange"]) == {"phi", "w", "a", "tau"}
            assert members["flange_a"] == {"phi": "phi", "tau": "tau"}
            kinds = {t.get("name"): t.get("terminalKind") for t in root.iter("Terminal")}
            outside = {kinds.pop(end) for end in ("flange_a", "flange_b") if end in kinds}
            assert outside == {"Modelica.Mechanics.Rotational.Interfaces.Flange_a"}
            assert all(kind.startswith("org.chainunit.") for kind in kinds.values())
            assert all(set(result.values()) <= known for result in members.values())
            if model.name != "ChainUnit":
                assert len(members["load"]) == 7
        for fmi in (2, 3):
            variables = fmpy.read_model_description(str(native[name, fmi][0])).modelVariables
            for v in variables:
                assert v.declaredType is not None or v.unit not in TYPES, v.name
                if v.declaredType is not None:
                    assert v.declaredType.name == TYPES[v.unit] and v.declaredType.unit == v.unit


def test_every_declared_unit_has_a_type():
    for model in MODELS.values():
        interface = Interface(model, {})
        assert {s.variable.unit for s in interface.signals} <= set(TYPES)
