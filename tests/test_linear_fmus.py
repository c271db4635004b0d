"""The linear model of a model against its FMUs: whole linearisations by fmpy, and differences of a Python FMU."""

from __future__ import annotations

import contextlib
import ctypes
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest
from fmpy.fmi2 import FMU2Model
from fmpy.fmi3 import FMU3Model
from test_linear import moved

from chainunit.core.native.compilers import compiler
from chainunit.fmu.backends import export
from chainunit.fmu.native.export import export as export_native
from chainunit.models import MODELS
from chainunit.study.linear import linear_point
from chainunit.system.instance import Fmu, Instance
from chainunit.system.linear import linearize as linearize_model

pytestmark = pytest.mark.second
native = pytest.mark.skipif(compiler() is None, reason="no C compiler")
both = pytest.mark.parametrize("fmi", [2, 3])
EXAMPLES = Path(__file__).parents[1] / "examples"
LINKAGES = ("watt_six_bar", "cylinder_lift", "scotch_yoke_pump")


@contextlib.contextmanager
def continuous(folder, fmi):
    """An initialized Model Exchange instance of the FMU in this folder, and its description."""
    told = fmpy.read_model_description(folder)
    unit = {2: FMU2Model, 3: FMU3Model}[fmi](
        guid=told.guid or told.instantiationToken, unzipDirectory=folder, instanceName="unit",
        modelIdentifier=told.modelExchange.modelIdentifier,
    )  # fmt: skip
    unit.instantiate()
    try:
        if fmi == 2:
            unit.setupExperiment()
        unit.enterInitializationMode()
        unit.exitInitializationMode()
        unit.enterContinuousTimeMode()
        yield unit, told
    finally:
        unit.freeInstance()


def linearized(folder, fmi, found):
    """A, B, C, D of the FMU at the point of the linear model `found`, as one matrix: fmpy's call for each state and
    each input. Also the values of the derivatives and the outputs there."""
    with continuous(folder, fmi) as (unit, told):
        # fmpy does not read the flag of FMI 3.0
        own = ElementTree.parse(Path(folder) / "modelDescription.xml").find("ModelExchange")
        assert own.get(f"providesDirectionalDerivative{'s' if fmi == 3 else ''}") == "true"
        reference = {v.name: v.valueReference for v in told.modelVariables}
        put, get = (unit.setReal, unit.getReal) if fmi == 2 else (unit.setFloat64, unit.getFloat64)
        put([reference[s.name] for s in found.inputs], [s.value for s in found.inputs])
        if n := len(found.states):
            unit.setContinuousStates((ctypes.c_double * n)(*(s.value for s in found.states)), n)
        unknown = [v.variable.valueReference for v in told.derivatives]
        unknown += [reference[s.name] for s in found.outputs]
        columns = [
            unit.getDirectionalDerivative(unknown, [reference[s.name]], [1.0])
            for s in (*found.states, *found.inputs)
        ]
        return np.array(columns).T, np.array(get(unknown))


def check(folder, fmi, found, apart=()):
    """Compare all entries, except rows of the outputs in `apart`, of whose derivatives an FMU has differences."""
    theirs, values = linearized(folder, fmi, found)
    own = np.block([[found.A, found.B], [found.C, found.D]])
    assert theirs.shape == own.shape
    kept = [True] * len(found.states) + [s.name not in apart for s in found.outputs]
    size = np.max(np.abs(own), axis=1, initial=0.0, keepdims=True) + 1e-3
    np.testing.assert_allclose((own / size)[kept], (theirs / size)[kept], atol=1e-9)
    told = np.array([*(s.rate.value for s in found.states), *(s.value for s in found.outputs)])
    np.testing.assert_allclose(told, values, rtol=1e-9, atol=1e-9 * np.max(np.abs(values)))


@pytest.mark.stages(second=3)
@native
@both
@pytest.mark.parametrize("name", MODELS)
def test_slopes_of_packaged_models_are_those_of_their_fmus(native_fmus, name, fmi):
    model = MODELS[name]
    found = linearize_model(model, None, *moved(model))
    apart = set().union(*(part.by_differences for part in model.parts))
    check(native_fmus[name, fmi][1], fmi, found, apart)


@pytest.mark.stages(second=4)
@native
@both
@pytest.mark.parametrize("inverse", [False, True], ids=["direct", "inverse"])
@pytest.mark.parametrize("name", LINKAGES)
def test_slopes_of_linkages_are_those_of_their_fmus(name, inverse, fmi, tmp_path):
    point = linear_point(str(EXAMPLES / "linkages" / f"{name}.toml"), inverse=inverse)
    export_native(point.model, tmp_path / "a.fmu", fmi=fmi)
    folder = fmpy.extract(str(tmp_path / "a.fmu"), unzipdir=str(tmp_path / "a"))
    apart = set().union(*(part.by_differences for part in point.model.parts))
    check(folder, fmi, point.linear(), apart)


@native
@both
def test_slopes_of_a_compiled_drive_are_those_of_its_fmu(fmi, tmp_path):
    """Motor, driveline and machine as one FMU, in the start-up."""
    point = linear_point(str(EXAMPLES / "jam_with_driveline.toml"), "start_up:0.4 s")
    model = point.model
    start = model.parameter_layout.by_name(point.parameters)
    export_native(model, tmp_path / "a.fmu", start, fmi=fmi)
    folder = fmpy.extract(str(tmp_path / "a.fmu"), unzipdir=str(tmp_path / "a"))
    apart = set().union(*(part.by_differences for part in model.parts))
    found = point.linear()
    assert len(found.states) > 6
    check(folder, fmi, found, apart)


@pytest.mark.parametrize("name", ["ChamberForces", "slider_crank_press"])
def test_a_python_fmu_has_these_slopes_by_differences(name, tmp_path):
    """pythonfmu has no call for derivatives, and the FMU says so; its outputs move as the linear model says."""
    path = name if name in MODELS else str(EXAMPLES / "linkages" / f"{name}.toml")
    at = {"phi": 0.7, "w": 3.0, "a": 2.0}
    if name in MODELS:
        at |= {f"{side}.processing_force": 200.0 for side in ("left", "right")}
    point = linear_point(path, at, inverse=name not in MODELS)
    found = point.linear()
    file = tmp_path / "python.fmu"
    export(point.model, file, backend="python")
    told = fmpy.read_model_description(str(file))
    assert told.modelExchange is None and not told.coSimulation.providesDirectionalDerivative
    names = [s.name for s in found.outputs]
    with contextlib.closing(Fmu(file)) as fmu, contextlib.closing(Instance(fmu, "unit")) as unit:
        unit.initialize({s.name: s.value for s in found.inputs}, 0.0)
        unit.finish_initialization()
        size = np.max(np.abs(found.D), axis=1) + 1e-3 * np.max(np.abs(found.D))
        for column, signal in enumerate(found.inputs):
            if signal.name not in at:
                continue
            h = 1e-4 * max(1.0, abs(signal.value))
            ends = []
            for sign in (-2, -1, 1, 2):
                unit.set([signal.name], [signal.value + sign * h])
                ends.append(np.array(unit.get(names)))
            unit.set([signal.name], [signal.value])
            a, b, c, d = ends
            difference = (a - 8.0 * b + 8.0 * c - d) / (12.0 * h)
            rounding = 1e-14 * (np.abs(a) + np.abs(d)) / h
            off = np.abs(found.D[:, column] - difference) / (1e-6 * size + rounding)
            assert np.max(off) < 1.0, (signal.name, names[int(np.argmax(off))])
