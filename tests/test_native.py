"""Native FMUs: the same numbers as Python, exact derivatives, and no way to bring a host down."""

from __future__ import annotations

import math
import shutil
import subprocess
import zipfile
from contextlib import contextmanager
from pathlib import Path
from xml.etree import ElementTree

import casadi
import fmpy
import numpy as np
import pytest
from fmpy.fmi2 import FMU2Model
from fmpy.validation import validate_fmu
from test_fmu import Running
from test_reference import POINTS, deviation

from chainunit import ChainUnit, GeometryError, InputError, RunError
from chainunit.cosim.instance import Fmu, Instance
from chainunit.fmu.backends import export as export_any
from chainunit.fmu.description import Interface
from chainunit.fmu.native.export import export
from chainunit.fmu.native.platforms import compiler
from chainunit.machines.chain_unit import ChamberForces
from chainunit.models import MODELS

pytestmark = pytest.mark.skipif(compiler() is None, reason="no C compiler")


@pytest.fixture(scope="module")
def native(tmp_path_factory):
    """FMI 2 and 3 of both models, unpacked: {(name, fmi): (file, folder)}."""
    folder = tmp_path_factory.mktemp("native fmus")
    made = {}
    for name, model in MODELS.items():
        for fmi in (2, 3):
            file = export(model, folder / f"{name}{fmi}.fmu", fmi=fmi)
            made[name, fmi] = file, fmpy.extract(str(file), unzipdir=str(folder / f"{name}{fmi}"))
    return made


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
        worst = max(worst, *(deviation(float(row[n]), wanted) for n, wanted in point["outputs"].items()))
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
                values = rng.uniform(0.01, 3.0, len(inputs))
                for unit in (one, two):
                    unit.set(inputs, values)
                    unit.step(1e-3 * k, 1e-3)
                np.testing.assert_allclose(one.get(names), two.get(names), rtol=1e-12, atol=1e-12)
            two.close()
        python.close()


def jacobian(model, values):
    """Outputs, and derivatives of the states, by inputs and states, by CasADi from the same kernels."""
    interface = Interface(model, {})
    (ps, us, xs), _, _, x, outputs, derivatives = interface.traced
    states = model.state_layout.values(x) if model.state_layout else []
    rows = casadi.vertcat(*states, *outputs, *derivatives)
    f = casadi.Function("j", [ps, us, xs], [casadi.jacobian(rows, casadi.vertcat(us, xs))])
    n_p, n_u = len(interface.parameters), len(interface.inputs)
    p, u, x0 = values[:n_p], values[n_p : n_p + n_u], values[n_p + n_u : n_p + n_u + len(interface.states)]
    return np.array(f(p, u, x0))


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
    unit.setReal(list(range(first, first + n_u)), list(rng.uniform(0.5, 2.0, n_u)))
    if n_x:
        import ctypes

        x = (ctypes.c_double * n_x)(*rng.uniform(0.5, 2.0, n_x))
        unit.setContinuousStates(x, n_x)
    known, unknown = list(range(first, first + n_u + n_x)), list(range(first + n_u, last))
    exact = jacobian(model, unit.getReal(list(range(first + n_u + n_x))))
    for k, column in enumerate(known):
        got = unit.getDirectionalDerivative(unknown, [column], [1.0])
        np.testing.assert_allclose(got, exact[:, k], rtol=1e-12, atol=1e-12)
    # all at once, along a random direction
    seed = rng.uniform(-1.0, 1.0, len(known))
    np.testing.assert_allclose(
        unit.getDirectionalDerivative(unknown, known, list(seed)), exact @ seed, rtol=1e-10, atol=1e-10
    )
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
    with pytest.raises(GeometryError) as refused:
        ChainUnit(r=0.9)
    with pytest.raises(RunError) as failed:
        with running(native, "ChamberForces", {"r": 0.9}):
            pass
    assert str(refused.value) in str(failed.value)
    with pytest.raises(GeometryError) as refused:
        ChainUnit(z=0.1)
    with pytest.raises(RunError) as failed:
        with running(native, "ChamberForces", {"z": 0.1}):
            pass
    assert str(refused.value) in str(failed.value)
    with pytest.raises(RunError, match=r"rotor\.J = -1 kg\.m2: must be > 0 kg\.m2"):
        with running(native, "DcMotor", {"rotor.J": -1.0}):
            pass


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
        said = len(unit.messages)
        with pytest.raises(RunError, match=rf"{name}|value reference"):
            unit.set([name], [value])
        assert len(unit.messages) == said + 1
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


def test_same_model_same_file(native, tmp_path):
    for (name, fmi), (file, _) in native.items():
        again = export(MODELS[name], tmp_path / "again.fmu", fmi=fmi)
        assert again.read_bytes() == file.read_bytes()
    other = export(ChamberForces, tmp_path / "other.fmu", {"r": 0.14})
    assert fmpy.read_model_description(str(other)).guid != Fmu(native["ChamberForces", 2][0]).description.guid


def test_small_enough(native):
    for file, _ in native.values():
        assert file.stat().st_size < 300_000


def test_a_plain_c_host(native, tmp_path):
    file, folder = native["ChamberForces", 2]
    host = tmp_path / "host"
    sources = [
        shutil.which("cc"),
        "-Wall",
        "-o",
        str(host),
        "tests/host.c",
        "-I",
        f"{folder}/sources",
        "-ldl",
    ]
    subprocess.run(sources, check=True, cwd=Path(__file__).parents[1])
    description = fmpy.read_model_description(str(file))
    reference = {v.name: v.valueReference for v in description.modelVariables}
    library = f"{folder}/binaries/linux64/ChamberForces.so"
    arguments = [library, description.guid, *(str(reference[n]) for n in ("phi", "w", "tau"))]
    done = subprocess.run([host, *arguments], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    loads = {f"{side}.material_mass": 30.0 for side in ("left", "right")}
    want = ChainUnit().evaluate({"phi": 0.5 * np.arange(10), "w": 6.0} | loads)["tau"]
    np.testing.assert_allclose([float(x) for x in done.stdout.split()], want, rtol=1e-12)
    needs = subprocess.run(["ldd", library], capture_output=True, text=True).stdout
    assert {line.split()[0].split(".")[0] for line in needs.splitlines()} <= {
        "linux-vdso", "libm", "libc", "/lib64/ld-linux-x86-64",
    }  # fmt: skip


@pytest.mark.parametrize("name", list(MODELS))
def test_a_million_random_calls_under_sanitizers(native, name, tmp_path):
    sources = Path(native[name, 2][1]) / "sources"
    fuzz = tmp_path / "fuzz"
    command = [
        shutil.which("cc"), "-std=c99", "-O1", "-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all",
        "-Wall", "-Wextra", "-Werror", "-Wno-unused-parameter",
        "-o", str(fuzz), str(Path(__file__).parent / "fuzz.c"),
        *(str(sources / n) for n in ("model.c", "runtime.c", "fmi2.c")), "-I", str(sources), "-lm",
    ]  # fmt: skip
    # what CasADi wrote is compiled apart: its warnings are not ours
    kernels = tmp_path / "kernels.o"
    subprocess.run(
        [shutil.which("cc"), "-O1", "-c", str(sources / "kernels.c"), "-o", str(kernels)], check=True
    )
    subprocess.run([*command, str(kernels)], check=True)
    done = subprocess.run([fuzz, "1000000"], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr[-3000:]


def test_the_sources_build_again(native, tmp_path):
    """As a host would from the sources alone: with the files that the description lists."""
    file, folder = native["DcMotor", 2]
    root = ElementTree.fromstring(zipfile.ZipFile(file).read("modelDescription.xml"))
    listed = [node.attrib["name"] for node in root.findall("CoSimulation/SourceFiles/File")]
    assert len(listed) == 4
    library = tmp_path / "again.so"
    subprocess.run(
        [shutil.which("cc"), "-shared", "-fPIC", "-O2", "-o", str(library), *listed, "-lm"],
        check=True,
        cwd=f"{folder}/sources",
    )
    assert library.stat().st_size > 10_000
    names = zipfile.ZipFile(native["DcMotor", 3][0]).namelist()
    assert "sources/buildDescription.xml" in names


def test_backends_say_what_they_took(tmp_path, monkeypatch):
    from chainunit.fmu.native import export as module

    said = export_any(MODELS["DcMotor"], tmp_path / "a.fmu")
    assert "native code by" in said and "found here" in said
    assert "pythonfmu" in export_any(MODELS["DcMotor"], tmp_path / "b.fmu", backend="python")
    monkeypatch.setattr(module, "compiler", lambda: None)
    assert "no C compiler for 64-bit Linux found" in export_any(MODELS["DcMotor"], tmp_path / "c.fmu")
    with pytest.raises(InputError, match="--fmi 3 needs the native backend"):
        export_any(MODELS["DcMotor"], tmp_path / "d.fmu", fmi=3)
    with pytest.raises(InputError, match="for 64-bit Linux found: install one there"):
        export_any(MODELS["DcMotor"], tmp_path / "d.fmu", backend="native")
    with pytest.raises(InputError, match="must be 2 or 3"):
        export_any(MODELS["DcMotor"], tmp_path / "d.fmu", fmi=1)
    # one that is there but does not work
    monkeypatch.setattr(module, "compiler", lambda: shutil.which("false"))
    assert "false failed" in export_any(MODELS["DcMotor"], tmp_path / "e.fmu")
    with pytest.raises(RunError, match=r"the C compiler .*false failed"):
        export_any(MODELS["DcMotor"], tmp_path / "d.fmu", backend="native")
    assert {p.name for p in tmp_path.iterdir()} == {"a.fmu", "b.fmu", "c.fmu", "e.fmu"}
