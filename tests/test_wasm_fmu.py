"""FMUs for WebAssembly by the draft FMI-LS-WASM, in wasmtime, against the native library of the same FMU."""

from __future__ import annotations

import importlib.util
import re
import zipfile
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest
from fmpy.fmi3 import FMU3Model, FMU3Slave
from typer.testing import CliRunner

from chainunit import InputError
from chainunit.app.cli import app
from chainunit.core.native.compilers import compiler
from chainunit.drives.dc_motor import DcMotor
from chainunit.fmu.backends import export
from chainunit.fmu.native import wasm
from chainunit.fmu.native.export import export as export_native
from chainunit.models import MODELS
from chainunit.study.config import parse
from chainunit.study.package import drive_to_export, whole_system

MISSING = [name for name in ("wasmtime", "ziglang") if importlib.util.find_spec(name) is None]
NEEDS = f"needs a C compiler, zig and wasmtime; missing: {MISSING}"
pytestmark = [pytest.mark.second, pytest.mark.skipif(bool(MISSING) or compiler() is None, reason=NEEDS)]

MANIFEST = "{http://fmi-standard.org/fmi-ls-manifest}fmi-ls-"


@pytest.fixture(scope="module")
def motor(tmp_path_factory):
    return export_native(DcMotor, tmp_path_factory.mktemp("wasm") / "motor.fmu", fmi=3, wasm=True)


def opened(file, **more):
    from component_host import Fmu

    return Fmu(file, **more)


class Native:
    """The native library of an FMU, behind the names of `component_host.Made`."""

    def __init__(self, file, kind=FMU3Slave):
        description = fmpy.read_model_description(str(file))
        self.references = {v.name: v.valueReference for v in description.modelVariables}
        self.api = kind(
            guid=description.instantiationToken, unzipDirectory=fmpy.extract(str(file)),
            modelIdentifier=description.coSimulation.modelIdentifier, instanceName="native",
        )  # fmt: skip
        self.api.instantiate()
        self.enter_initialization_mode = lambda tolerance, start, stop: self.api.enterInitializationMode(
            tolerance=tolerance, startTime=start, stopTime=stop
        )
        self.exit_initialization_mode = self.api.exitInitializationMode

    def set(self, **values):
        self.api.setFloat64([self.references[name] for name in values], list(values.values()))

    def get(self, *names):
        return self.api.getFloat64([self.references[name] for name in names])

    def do_step(self, time, size, no_set):
        self.api.doStep(time, size, no_set)


def begin(unit, time=0.0, stop=None, **values):
    unit.set(**values)
    unit.enter_initialization_mode(None, time, stop)
    unit.exit_initialization_mode()
    return unit


def run(unit, steps, size, events, names):
    """Outputs at the end of each step; `events` are changes of inputs by the number of the step."""
    rows = []
    for k in range(steps):
        unit.set(**events.get(k, {}))
        unit.do_step(k * size, size, True)
        rows.append(unit.get(*names))
    return np.array(rows)


def test_a_jam_of_the_whole_drive_equals_the_native_library(tmp_path):
    """The packaged drive with its motor as one FMU: from speed into a lump and out again."""
    config = parse("")
    drive = drive_to_export(config)
    model, start = whole_system(drive, config.operation, config.title, config.file.labels)
    file = export_native(model, tmp_path / "drive.fmu", start, fmi=3, wasm=True)
    force = "machine.left.processing_force"
    events = {0: {"motor.w_ref": 3.0 * drive.ratio}, 200: {force: 1500.0}, 400: {force: 10.0}}
    names = ["motor.tau", "machine.rocker.tau", "motor.w", "motor.armature.i", "machine.margin"]
    of_wasm, of_native = (
        run(begin(unit), 600, 1e-3, events, names)
        for unit in (opened(file).made("co-simulation", False, False, []), Native(file))
    )
    assert np.ptp(of_native[:, 1]) > 10.0  # the lump is felt
    assert np.max(np.abs(of_wasm - of_native) / np.max(np.abs(of_native), axis=0)) < 1e-12


@pytest.mark.parametrize("name", ["ChainUnit", "InductionMotor", "CardanDriveline", "KnifeDrive"])
def test_other_models_equal_the_native_library(name, tmp_path):
    file = export_native(MODELS[name], tmp_path / "model.fmu", fmi=3, wasm=True)
    fmu = opened(file)
    outputs = [
        v.get("name") for v in fmu.description.find("ModelVariables") if v.get("causality") == "output"
    ]
    outputs = [name for name in outputs if fmu_type(fmu, name) == "Float64"]
    of_wasm, of_native = (
        run(begin(unit), 40, 1e-3, {}, outputs)
        for unit in (fmu.made("co-simulation", False, False, []), Native(file))
    )
    scale = np.maximum(np.max(np.abs(of_native), axis=0), 1.0)
    assert np.all(np.isfinite(of_wasm)) and np.max(np.abs(of_wasm - of_native) / scale) < 1e-12


def fmu_type(fmu, name):
    return next(v.tag for v in fmu.description.find("ModelVariables") if v.get("name") == name)


def test_counts_and_switches_have_their_types(tmp_path):
    """Pole pairs and the switch of the inverter: set, read, and felt by the motor."""
    from component_host import FailedError

    fmu = opened(export_native(MODELS["InductionMotor"], tmp_path / "motor.fmu", fmi=3, wasm=True))
    pairs, inverter = (fmu.references[name] for name in ("pole_pairs", "inverter.on"))
    speeds = []
    for count in (1, 2):
        unit = fmu.made("co-simulation", False, False, [])
        unit.set_int32([pairs], [count])
        assert unit.get_boolean([inverter]) == [False]
        unit.set_boolean([inverter], [True])
        assert unit.get_boolean([inverter, inverter]) == [True, True] and unit.get_int32([pairs]) == [count]
        unit.set_boolean([inverter], [False])
        with pytest.raises(FailedError):
            unit.set_float64([pairs], [2.0])
        run(begin(unit), 100, 1e-3, {}, ["w"])
        speeds += unit.get("w")
    assert speeds[0] != speeds[1] and all(np.isfinite(speeds))


def test_model_exchange_equals_the_native_library(motor):
    fmu = opened(motor)
    unit, native = fmu.made("model-exchange"), Native(motor, FMU3Model)
    for each in (unit, native):
        begin(each, w_ref=40.0)
    assert unit.get_number_of_event_indicators() == 0
    n = unit.get_number_of_continuous_states()
    assert n == len(unit.get_nominals_of_continuous_states()) > 0
    info = unit.update_discrete_states()
    assert not any(vars(info)[key] for key in ("new-discrete-states-needed", "next-event-time-defined"))
    unit.enter_continuous_time_mode()
    native.api.enterContinuousTimeMode()
    x = [0.3 * value + 0.1 for value in unit.get_nominals_of_continuous_states()]
    unit.set_time(0.1)
    native.api.setTime(0.1)
    unit.set_continuous_states(x)
    native.api.setContinuousStates((fmpy.fmi3.fmi3Float64 * n)(*x), n)
    assert unit.get_continuous_states() == x
    dx = (fmpy.fmi3.fmi3Float64 * n)()
    native.api.getContinuousStateDerivatives(dx, n)
    np.testing.assert_allclose(unit.get_continuous_state_derivatives(), list(dx), rtol=1e-13)
    assert unit.get_event_indicators() == []
    done = unit.completed_integrator_step(True)
    assert vars(done) == {"enter-event-mode": False, "terminate-simulation": False}
    unit.enter_event_mode()
    unit.terminate()
    unit.drop()


def test_slopes_and_derivatives_of_outputs(motor):
    fmu = opened(motor)
    unit, native = (
        begin(fmu.made("co-simulation", False, False, []), w_ref=40.0),
        begin(Native(motor), w_ref=40.0),
    )
    for each in (unit, native):
        run(each, 3, 1e-3, {}, ["w"])
    of, by = (
        [fmu.references[name] for name in names] for names in (["a", "tau", "armature.i"], ["load.tau_bias"])
    )
    slopes = native.api.getDirectionalDerivative(of, by, [2.0])
    np.testing.assert_allclose(unit.get_directional_derivative(of, by, [2.0]), slopes, rtol=1e-13)
    assert any(slopes)
    rates = native.api.getOutputDerivatives(of, [1] * len(of))
    np.testing.assert_allclose(unit.get_output_derivatives([(vr, 1) for vr in of]), rates, rtol=1e-13)
    assert any(rates)


def test_a_saved_state_goes_on_with_the_same_bits(motor):
    fmu = opened(motor)
    one = begin(fmu.made("co-simulation", False, False, []), w_ref=40.0)
    run(one, 20, 1e-3, {}, ["w"])
    state = one.get_fmu_state()
    ways = []
    for _ in range(2):
        one.set_fmu_state(state)
        one.do_step(0.02, 1e-3, False)
        ways.append(one.get("w", "tau", "armature.i"))
    # in another instance of the same component, while the first one is alive
    other = begin(fmu.made("co-simulation", False, False, [], name="other"), w_ref=10.0)
    other.set_fmu_state(state)
    other.do_step(0.02, 1e-3, False)
    assert ways[0] == ways[1] == other.get("w", "tau", "armature.i")
    from component_host import FailedError

    with pytest.raises(FailedError):
        other.set_fmu_state(state[:-1])
    assert fmu.messages[-1][0] == "other" and "its size is not this model's" in fmu.messages[-1][3]


def test_refusals_reach_the_host_in_words(motor):
    from component_host import FailedError

    fmu = opened(motor)
    assert fmu.made("co-simulation", False, False, [], token="{no}") is None
    assert fmu.messages[-1][:3] == ("one", "error", "logStatusError") and "{no}" in fmu.messages[-1][3]
    assert fmu.made("co-simulation", True, False, []) is None
    assert "there is no event mode" in fmu.messages[-1][3]
    # a message that is cut inside a character is text all the same
    for more in range(4):
        assert fmu.made("co-simulation", False, False, [], token="a" * more + "\u2192" * 400) is None
        assert fmu.messages[-1][3].endswith("\u2192")
    unit = fmu.made("co-simulation", False, False, [], name="Antrieb \u03c9")
    vr = fmu.references["w_ref"]
    for call, arguments, words in (
        ("do_step", (0.0, 1e-3, False), "before initialization"),
        ("set_float64", ([vr], [1.0, 2.0]), "as many values as references"),
        ("get_float64", ([99999],), "99999"),
        ("set_int32", ([vr], [1]), "Int32"),
        ("get_string", ([vr],), "String"),
        ("set_string", ([vr], ["x"]), "String"),
        ("get_clock", ([vr],), "there are no clocks"),
        ("set_clock", ([vr], [True]), "there are no clocks"),
        ("get_binary", ([vr],), "there are no binary variables"),
        ("set_binary", ([vr], [b"x"]), "there are no binary variables"),
        ("get_interval_decimal", ([vr],), "there are no clocks"),
        ("set_shift_decimal", ([vr], [0.0]), "there are no clocks"),
        ("get_variable_dependencies", (vr,), "model description"),
        ("get_number_of_variable_dependencies", (vr,), "model description"),
        ("get_adjoint_derivative", ([vr], [vr], [1.0]), "adjoint"),
        ("enter_configuration_mode", (), "structural"),
        ("set_input_derivatives", ([(vr, 1)], [1.0]), "no derivatives of inputs"),
        ("update_discrete_states", (), "before initialization"),
        ("get_output_derivatives", ([(vr, 1)],), "before initialization"),
    ):
        with pytest.raises(FailedError):
            getattr(unit, call)(*arguments)
        assert words in fmu.messages[-1][3] and fmu.messages[-1][0] == "Antrieb \u03c9", call
    for call in (
        "get_string",
        "get_clock",
        "get_binary",
        "get_interval_fraction",
        "get_shift_fraction",
        "get_int8",
    ):
        assert getattr(unit, call)([]) == []
    unit.set_debug_logging(True, ["logStatusError", "other"])
    exchange = fmu.made("model-exchange")
    with pytest.raises(FailedError):
        exchange.completed_integrator_step(True)


def test_calls_leave_nothing_in_memory(motor):
    """There are 3 MiB at first: 1000 calls with lists of 8 kB, and 1000 instances with names of 5 kB, need no 4."""
    fmu = opened(motor, most=4 << 20)
    unit = fmu.made("co-simulation", False, False, [])
    unit.enter_initialization_mode(None, 0.0, None)
    many = [fmu.references["w_ref"]] * 700
    for _ in range(1000):
        unit.set_float64(many, [1.0] * 700)
        assert len(unit.get_float64(many)) == 700
    for _ in range(1000):
        other = fmu.made("co-simulation", False, False, [], name="n" * 5000)
        other.drop()


def test_layout_interfaces_and_manifest(motor, tmp_path):
    with zipfile.ZipFile(motor) as archive:
        names = archive.namelist()
        manifests = [
            archive.read(f"extra/org.modelica.fmi-ls-wasm/{name}manifest.xml") for name in ("", "fmi-ls-")
        ]
    assert "binaries/wasm32-wasip2/DcMotor.wasm" in names and "binaries/x86_64-linux/DcMotor.so" in names
    root = ElementTree.fromstring(manifests[0])
    assert manifests[0] == manifests[1]
    assert root.get(f"{MANIFEST}name") == "org.modelica.fmi-ls-wasm"
    assert re.fullmatch(r"\d+\.\d+\.\d+", root.get(f"{MANIFEST}version"))
    fmu = opened(motor)
    of_package = "fmi:fmi3/{}@3.0.0".format
    assert set(fmu.imports) == {of_package(name) for name in ("types", "callbacks")}
    assert set(fmu.exports) == {of_package(name) for name in ("common", "co-simulation", "model-exchange")}
    assert fmu.function("common", "get-version")() == "3.0"
    assert fmpy.validation.validate_fmu(str(motor)) == []
    again = export_native(DcMotor, tmp_path / "again.fmu", fmi=3, wasm=True)
    assert again.read_bytes() == motor.read_bytes()


def test_the_command_and_its_refusals(tmp_path, monkeypatch):
    def told(*arguments):
        result = CliRunner().invoke(app, ["export", "DcMotor", "-o", str(tmp_path / "a.fmu"), *arguments])
        assert result.exception is None or isinstance(result.exception, (InputError, SystemExit))
        return result

    result = told("--fmi", "3", "--wasm")
    assert result.exit_code == 0 and "and for WebAssembly (run in wasmtime)" in " ".join(
        result.stdout.split()
    )
    with pytest.raises(InputError, match=r"--wasm: .* of FMI 3\.0; export with --fmi 3"):
        export(DcMotor, tmp_path / "b.fmu", wasm=True)
    with pytest.raises(InputError, match="--wasm needs the native backend"):
        export(DcMotor, tmp_path / "b.fmu", fmi=3, wasm=True, backend="python")
    monkeypatch.setattr(wasm, "zig_compiler", lambda: None)
    with pytest.raises(InputError, match=r"--wasm: needs zig.*pip install 'chainunit\[cross\]'"):
        export(DcMotor, tmp_path / "b.fmu", fmi=3, wasm=True)
    assert not (tmp_path / "b.fmu").exists()
