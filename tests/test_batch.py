"""Batches: every engine gives the numbers of the machine, of the references and of their derivatives."""

from __future__ import annotations

import ctypes
import warnings

import numpy as np
import pytest
import xarray as xr
from linkage_files import MACHINES, expected
from linkage_files import model as linkage
from machines import random_machine
from test_reference import POINTS, deviation

from chainunit import ChainUnitMachine, InputError, SideLoads, batch
from chainunit.batch import native
from chainunit.batch.equations import arguments_of
from chainunit.batch.reductions import REDUCTIONS
from chainunit.core.engines import MATH
from chainunit.core.native.compilers import Compiler, compiler
from chainunit.core.printing.vector_code import header
from chainunit.core.quantities import quotient
from chainunit.core.symbolic_trace import outputs_of
from chainunit.machines.chain_unit import ChamberForces
from chainunit.machines.machine import Machine
from chainunit.models import MODELS

NEEDS_COMPILER = pytest.mark.skipif(compiler() is None, reason="no C compiler")
ENGINES = [pytest.param("native", marks=NEEDS_COMPILER), "numpy"]


EMPTY = dict.fromkeys(
    [f"{side}.{load}" for side in ("left", "right") for load in ("material_mass", "processing_force")], 0.0
)
"""No feed; the start values of the inputs are 30 kg a side."""


def column(*values):
    return xr.DataArray(np.array(values, float), dims="state")


@pytest.mark.parametrize("engine", ENGINES)
def test_reference_points(engine):
    """All points in one batch, each with its own parameters and inputs."""
    names = [name for kind in ("parameters", "inputs") for name in POINTS[0][kind]]
    start = ChainUnitMachine().by_name | dict.fromkeys(ChamberForces.input_layout.names, 0.0)
    names = sorted({n for point in POINTS for kind in ("parameters", "inputs") for n in point[kind]})
    values = {
        name: column(*({**start, **point["parameters"], **point["inputs"]}[name] for point in POINTS))
        for name in names
    }
    out = batch.evaluate(ChamberForces, values, engine=engine)
    assert not out.reason.any()
    for k, point in enumerate(POINTS):
        worst = {n: deviation(float(out[n][k]), wanted) for n, wanted in point["outputs"].items()}
        assert max(worst.values()) < 1e-9, (point["name"], max(worst.items(), key=lambda pair: pair[1]))


@pytest.mark.parametrize("name", [name for name, each in MACHINES.items() if each["states"]])
@NEEDS_COMPILER
@pytest.mark.second
def test_reference_linkages(name):
    states = MACHINES[name]["states"]
    values = {key: column(*(state[key] for state in states)) for key in ("phi", "w", "a")}
    out = batch.evaluate(linkage(name), values)
    for k, state in enumerate(states):
        worst = {key: deviation(float(out[key][k]), value) for key, value in expected(state)}
        assert len(worst) > 60 and max(worst.values()) < 1e-9, max(worst.items(), key=lambda pair: pair[1])


def random_values(model, rng, n):
    """Random values of all inputs and states near their start, and the parameters of the model."""
    values = {}
    for v in arguments_of(model)[len(model.parameter_layout.names) :]:
        size = v.quantity.nominal or 1.0
        spread = (v.quantity.start or 0.0) + size * rng.uniform(-1.0, 1.0, n)
        values[v.name] = column(*np.clip(spread, max(v.quantity.low, -1e9), v.quantity.high))
    return values


@pytest.mark.stages(second=4)
@pytest.mark.parametrize(
    "name", ["ChamberForces", "DcMotor", "InductionMotor", "CardanDriveline", "KnifeDrive"]
)
@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.second
def test_every_model_agrees_with_its_own_equations(name, engine):
    """To 1e-12 of the largest value of each output, although the batch may round differently."""
    model, rng, n = MODELS[name], np.random.default_rng(3), 37
    values = random_values(model, rng, n)
    out = batch.evaluate(model, values, engine=engine)
    p = model.check(model.Parameters())
    for k in range(n):
        u, x = (
            of.instance([float(values[v][k]) for v in of.names]) if of else None
            for of in (model.input_layout, model.state_layout)
        )
        parts = model.evaluate(MATH, p, u, x)
        strict = [y for part, own in zip(model.parts, parts, strict=True) for y in part.layout.values(own)]
        for v, y in zip(outputs_of(model), strict, strict=True):
            size = max(1.0, float(abs(out[v.name]).max()))
            assert abs(float(out[v.name][k]) - y) < 1e-12 * size, v.name


def many(n=4099):
    """States of a machine with all inputs that move, and the same for `Machine.evaluate`."""
    rng = np.random.default_rng(8)
    machine = random_machine(rng)
    values = EMPTY | {
        "phi": rng.uniform(-30.0, 30.0, n) * machine.ratio,
        "w": rng.uniform(-6.0, 6.0, n) * machine.ratio,
        "a": rng.uniform(-9.0, 9.0, n),
        "left.material_mass": rng.uniform(0.0, 50.0, n),
        "right.processing_force": rng.uniform(0.0, 900.0, n),
    }
    return machine, values


def columns(values):
    return {k: column(*x) if np.ndim(x) else x for k, x in values.items()}


@pytest.mark.parametrize("engine", ENGINES)
def test_many_states_agree_with_the_machine(engine):
    machine, values = many()
    out = machine.batch(columns(values), engine=engine)
    strict = machine.evaluate(values)
    for name in strict:
        size = float(np.max(np.abs(strict[name]))) or 1.0
        assert float(np.max(np.abs(out[name].values - strict[name]))) < 1e-12 * size, name
    assert out.tau.units == "N.m" and out.tau.long_name


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("more", [{}, {"by": ["r"]}, {"over": "phi", "reduce": {"tau": ["peak", "min"]}}])
def test_an_earlier_result_gives_its_memory(engine, more):
    machine = ChainUnitMachine()
    outputs = None if "over" in more else ["tau", "rocker.tau"]
    values = {"phi": np.linspace(0.0, 6.0, 70), "r": [0.14, 0.15, 2.0], "w": 3.0}
    others = values | {"phi": np.linspace(1.0, 4.0, 70), "r": [0.14, 2.0, 0.16]}
    first = machine.batch(values, outputs, engine=engine, **more)
    fresh = machine.batch(others, outputs, engine=engine, **more)
    again = machine.batch(others, outputs, engine=engine, **more, out=first)
    xr.testing.assert_identical(again, fresh)
    assert all(np.shares_memory(again[name].values, first[name].values) for name in first.data_vars)


def test_memory_that_does_not_fit_is_refused():
    machine, values = ChainUnitMachine(), {"phi": np.linspace(0.0, 6.0, 5), "w": 3.0}
    first = machine.batch(values, ["tau"], engine="numpy")
    with pytest.raises(InputError, match="out: has no tau over \\(phi: 4\\)"):
        machine.batch(values | {"phi": values["phi"][:4]}, ["tau"], engine="numpy", out=first)
    with pytest.raises(InputError, match="out: has no margin over"):
        machine.batch(values, ["tau", "margin"], engine="numpy", out=first)
    with pytest.raises(InputError, match="tau is no array that can be filled"):
        machine.batch(values, ["tau"], engine="numpy", out=first.assign(tau=first.tau.astype("float32")))


@NEEDS_COMPILER
def test_divisions_and_roots_of_vectors():
    """They are products on some processors: to a unit in the last place, with all that IEEE 754 says of 0 and of
    infinite numbers that a machine can meet."""
    own = compiler()
    code = (
        header()
        + """
void compute(const double *x, const double *z, double *out, long n) {
  for (long i = 0; i < n; i += W) {
    STORE(out + i, div_v(LOAD(x + i), LOAD(z + i)));
    STORE(out + n + i, inv_v(LOAD(z + i)));
    STORE(out + 2 * n + i, sqrt_v(LOAD(x + i)));
  }
}
"""
    )
    rng, n = np.random.default_rng(2), 2**16
    x, z = (rng.uniform(-1.0, 1.0, n) * 10.0 ** rng.uniform(-140.0, 140.0, n) for _ in range(2))
    x[:16], z[:8], z[8:16] = [0.0, 1.0, -2.0, 3.0] * 4, 0.0, [np.inf, -np.inf, np.nan, -0.0] * 2
    out = np.empty((3, n))
    pointers = [ctypes.c_void_p(each.ctypes.data) for each in (x, z, out)]
    native.load(code, own).compute(*pointers, ctypes.c_long(n))
    with np.errstate(all="ignore"):
        for got, wanted in zip(out, (x / z, 1.0 / z, np.sqrt(x)), strict=True):
            special = ~np.isfinite(wanted) | (wanted == 0.0)
            np.testing.assert_array_equal(got[special], wanted[special])
            usual = ~special
            assert np.max(np.abs(got[usual] / wanted[usual] - 1.0)) < 2.3e-16


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.second
def test_derivatives_are_exact(engine):
    """Against central differences of the machine, whose error falls with the square of the step."""
    machine = ChainUnitMachine()
    values = EMPTY | {"phi": np.linspace(0.1, 6.2, 70), "w": 3.0, "a": 0.4, "left.material_mass": 30.0}
    by = ["r", "coupler.m", "phi", "left.material_mass", "w"]
    out = machine.batch(values, ["tau", "crank_bearing.fy", "tau_bias_dphi"], by=by, engine=engine)

    def at(name, change, output):
        start = values.get(name, machine.by_name.get(name))
        own = machine.replace({name: start + change}) if name in machine.by_name else machine
        inputs = {**values, **({name: start + change} if name in values else {})}
        return own.evaluate(inputs)[output]

    for output in ("tau", "crank_bearing.fy", "tau_bias_dphi"):
        for name in by:
            slope = out[f"d({output})/d({name})"].values
            h = 1e-5 * max(1.0, abs(np.max(values.get(name, 1.0))))
            coarse, fine = (
                (at(name, step, output) - at(name, -step, output)) / (2.0 * step) for step in (2.0 * h, h)
            )
            np.testing.assert_allclose(
                slope, (4.0 * fine - coarse) / 3.0, rtol=2e-7, atol=2e-6 * max(1.0, np.max(np.abs(slope)))
            )
    assert out["d(tau)/d(r)"].units == "N" and out["d(tau)/d(w)"].units == "N.m.s/rad"
    assert out["d(crank_bearing.fy)/d(coupler.m)"].units == "N/kg"


def test_units_of_derivatives():
    assert quotient("N.m", "m") == "N" and quotient("1", "m") == "1/m" and quotient("m", "m") == "1"
    assert quotient("N.m", "kg.m2") == "N/(m.kg)" and quotient("kg.m2/rad", "rad/s") == "kg.m2.s/rad2"


@pytest.mark.parametrize("engine", ENGINES)
def test_dimensions_combine_and_units_are_converted(engine):
    """Each output has all dimensions, whatever their order and length; deg and mm are read."""
    machine = ChainUnitMachine()
    phi = xr.DataArray(np.linspace(0.0, 360.0, 101), dims="phi", attrs={"units": "deg"})
    r = xr.DataArray([140.0, 150.0], dims="r", attrs={"units": "mm"})
    feed = xr.DataArray([[0.0, 10.0, 20.0], [5.0, 15.0, 25.0]], dims=("r", "feed"))
    values = EMPTY | {"phi": phi, "r": r, "left.material_mass": feed, "w": 2.0}
    out = machine.batch(values, ["tau", "margin"], engine=engine)
    assert set(out.tau.dims) == {"r", "feed", "phi"}
    for i in range(2):
        for k in range(3):
            own = machine.replace(r=[0.14, 0.15][i]).forces(
                np.radians(phi.values),
                2.0,
                left=SideLoads(material_mass=float(feed[i, k]), processing_force=0.0),
            )
            np.testing.assert_allclose(out.tau.isel(r=i, feed=k), own.tau, rtol=1e-12, atol=1e-11)
    one = machine.batch(EMPTY | {"phi": 0.5, "w": 2.0}, ["tau"], engine=engine)
    assert one.tau.dims == () and float(one.tau) == pytest.approx(
        float(machine.forces(0.5, 2.0).tau), rel=1e-12
    )
    assert machine.batch({"phi": np.zeros(0)}, ["tau"], engine=engine).tau.size == 0


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("points", [7, 720])
def test_cycle_quantities_are_those_of_the_stored_states(engine, points):
    machine = ChainUnitMachine()
    names = ["tau", "rocker.tau", "left.web_pull"]
    values = {"phi": np.linspace(0.0, 6.0, points), "r": np.linspace(0.1, 0.2, 5), "w": 4.0}
    states = machine.batch(values, names, over="phi", engine=engine)
    cycle = machine.batch(values, over="phi", reduce={n: list(REDUCTIONS) for n in names}, engine=engine)
    means = {"min": np.min, "max": np.max, "mean": np.mean}
    for name in names:
        x = states[name].values
        wanted = {k: f(x, axis=-1) for k, f in means.items()}
        wanted |= {"peak": np.max(np.abs(x), axis=-1), "rms": np.sqrt(np.mean(x**2, axis=-1))}
        for k, y in wanted.items():
            np.testing.assert_allclose(cycle[f"{k}({name})"], y, rtol=1e-12, err_msg=k)
            assert cycle[f"{k}({name})"].dims == ("r",) and cycle[f"{k}({name})"].units == states[name].units


@pytest.mark.parametrize("engine", ENGINES)
def test_states_without_result_have_a_reason(engine):
    """Bounds, requirements and dead positions; the valid neighbours keep their numbers."""
    machine = ChainUnitMachine()
    values = {
        "r": column(0.15, 3.0, -1.0, 0.15, 0.15),
        "left.material_mass": column(3.0, 3.0, 3.0, np.nan, 3.0),
        "phi": np.linspace(0.0, 6.0, 80),
        "w": 3.0,
    }
    out = machine.batch(values, ["tau", "J"], engine=engine)
    good = machine.batch({**values, "r": 0.15, "left.material_mass": 3.0}, ["tau", "J"], engine=engine)
    reasons = out.reason.attrs["reasons"]
    codes = [set(out.reason.isel(state=k).values.tolist()) for k in range(5)]
    texts = [{reasons[code] for code in each} for each in codes]
    assert texts[0] == texts[4] == {"valid"} and {len(each) for each in texts} == {1}
    assert texts[1] == {"c: the crank circle must stay left of the pivot C"}
    assert "r: must be > 0 m" in str(texts[2])
    assert "left.material_mass: must be >= 0 kg" in str(texts[3])
    subjects = [out.reason.attrs["subjects"][next(iter(each))] for each in codes]
    assert subjects == ["", "c", "r", "left.material_mass", ""]
    for name in ("tau", "J"):
        assert np.isnan(out[name].isel(state=[1, 2, 3])).all()
        for k in (0, 4):
            np.testing.assert_array_equal(out[name].isel(state=k), good[name])
    cycle = machine.batch(values, over="phi", reduce={"tau": ["peak"]}, engine=engine)
    assert cycle.reason.values.tolist() == [next(iter(each)) for each in codes]
    assert np.isnan(cycle["peak(tau)"][1:4]).all() and np.isfinite(cycle["peak(tau)"][[0, 4]]).all()


def test_wrong_requests_are_refused():
    machine = ChainUnitMachine()
    refusals = {
        "rr: no such parameter, input or state": ({"rr": 1.0}, ["tau"], {}),
        'rocker.tua: no such output of the model; was "rocker.tau" meant': ({"phi": 0.0}, ["rocker.tua"], {}),
        "phi in kg": ({"phi": xr.DataArray(0.0, attrs={"units": "kg"})}, ["tau"], {}),
        "has 2 values over state, another one has 3": (
            {"phi": column(1.0, 2.0, 3.0), "w": column(1.0, 2.0)}, ["tau"], {},
        ),
        "no such dimension; there are phi": ({"phi": [0.0, 1.0]}, ["tau"], {"over": "psi"}),
        "needs the dimension": ({"phi": [0.0, 1.0]}, None, {"reduce": {"tau": ["peak"]}}),
        'no reduction "peek"': ({"phi": [0.0, 1.0]}, None, {"over": "phi", "reduce": {"tau": ["peek"]}}),
        "has 2 dimensions": ({"phi": np.zeros((2, 2))}, ["tau"], {}),
        "must be one of native, numpy, cuda": ({"phi": 0.0}, ["tau"], {"engine": "jax"}),
    }  # fmt: skip
    for text, (values, outputs, options) in refusals.items():
        with pytest.raises(InputError, match=text.replace("(", r"\(")):
            machine.batch(values, outputs, **options)
    with pytest.raises(InputError, match=r"armature.i: has no value; a state has no start value"):
        batch.evaluate(MODELS["DcMotor"], {"w": 1.0}, ["air_gap_tau"])


def test_without_a_compiler_numpy_computes_with_one_warning(monkeypatch):
    values = EMPTY | {
        "phi": np.linspace(0.0, 6.0, 9),
        "z": 0.8538,
    }  # another set of columns than in other tests
    monkeypatch.setattr(native, "compiler", lambda: None)
    native.native_kernel.cache_clear()
    with pytest.warns(UserWarning, match="no C compiler") as notices:
        out = ChainUnitMachine().batch(values, ["tau"])
    assert len(notices) == 1
    np.testing.assert_allclose(
        out.tau, ChainUnitMachine(z=0.8538).forces(values["phi"]).tau, rtol=1e-12, atol=1e-12
    )
    monkeypatch.setattr(native, "compiler", lambda: Compiler(("/bin/false",), zig=False))
    native.native_kernel.cache_clear()
    with pytest.warns(UserWarning, match="numpy computes: the C compiler"):
        ChainUnitMachine().batch(values, ["tau"])
    native.native_kernel.cache_clear()


@NEEDS_COMPILER
def test_code_is_compiled_once_for_other_numbers(monkeypatch):
    """The values of parameters are no part of the code; a second batch of the same form compiles nothing."""
    sources = []
    real = native.load
    monkeypatch.setattr(native, "load", lambda source, own: sources.append(source) or real(source, own))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for r in (0.15, 0.16):
            ChainUnitMachine(r=r).batch({"phi": np.linspace(0.0, 6.0, 90), "hy": 1.0}, ["tau", "margin"])
    assert len(sources) == 1


@NEEDS_COMPILER
@pytest.mark.parametrize("workers", [1, 2, 3])
def test_threads_give_the_same_bits(workers):
    machine, values = many(1003)
    one = machine.batch(columns(values), ["tau", "J"], workers=1)
    xr.testing.assert_identical(machine.batch(columns(values), ["tau", "J"], workers=workers), one)
    grid = {"phi": np.linspace(0.0, 6.0, 100), "r": np.linspace(0.1, 0.2, 11)}
    reduce = {"over": "phi", "reduce": {"tau": ["rms"]}}
    xr.testing.assert_identical(
        machine.batch(grid, workers=workers, **reduce), machine.batch(grid, workers=1, **reduce)
    )


def test_another_model_of_states():
    """A model with states takes each from the values: the derivative of the air-gap torque by the current is k."""
    motor = MODELS["DcMotor"]
    values = dict.fromkeys(motor.state_layout.names, 0.0) | {"armature.i": [1.0, 2.0], "armature.T": 300.0}
    out = batch.evaluate(motor, values, ["air_gap_tau"], by=["armature.i", "armature.k"], engine="numpy")
    k = motor.Parameters().armature.k
    np.testing.assert_allclose(out.air_gap_tau, [k, 2.0 * k])
    np.testing.assert_allclose(out["d(air_gap_tau)/d(armature.i)"], k)
    np.testing.assert_allclose(out["d(air_gap_tau)/d(armature.k)"], [1.0, 2.0])
    assert isinstance(Machine(ChamberForces).batch({"phi": 0.0}, ["tau"], engine="numpy"), xr.Dataset)


def test_values_with_units_and_coordinates():
    """Texts have units; an array over its own dimension is its coordinate, in the declared unit."""
    machine = ChainUnitMachine()
    angles = np.linspace(0.0, 90.0, 4)
    phi = xr.DataArray(angles, dims="phi", attrs={"units": "deg"})
    for x in (phi, phi.assign_coords(phi=angles), "90 deg", np.pi / 2):
        out = machine.batch({"phi": x, "w": "30 rpm", "r": "150 mm"}, ["tau"], engine="numpy")
        one = machine.batch({"phi": np.pi / 2, "w": np.pi, "r": 0.15}, ["tau"], engine="numpy")
        assert float(out.tau.values.flat[-1]) == pytest.approx(float(one.tau), rel=1e-12)
        if out.tau.dims:
            np.testing.assert_allclose(out.phi, np.radians(angles))
            assert out.phi.attrs["units"] == "rad"
    for wrong in ("150 kg", "long", None, {"a": 1}, [1.0, "x"]):
        with pytest.raises(
            InputError, match=r"^r = .*: must be a number in m, or a text such as \"2 mm\""
        ) as refusal:
            machine.batch({"phi": 0.0, "r": wrong}, ["tau"], engine="numpy")
        assert "\n" not in str(refusal.value)
