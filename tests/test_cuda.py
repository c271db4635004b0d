"""Batches on a GPU, whose kernels a C++ compiler takes: states, reductions and reasons are those of numpy."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import sys

import cuda_device
import numpy as np
import pytest
import xarray as xr
from test_javascript import OFTEN, QUICK, REST, Points, compare

from chainunit import ChainUnitMachine, InputError, RunError, batch
from chainunit.batch import Beyond, Histogram
from chainunit.batch.cuda import on_device
from chainunit.batch.reductions import REDUCTIONS
from chainunit.core.printing.vector_code import header
from chainunit.core.symbolic_trace import outputs_of
from chainunit.models import MODELS

pytestmark = [
    pytest.mark.second,
    pytest.mark.skipif(cuda_device.COMPILER is None, reason="no C++ compiler"),
]
CLOSE = 1e-13
"""Largest deviation in parts of the peak of an output."""
TURN = {"phi": np.linspace(0.0, 6.0, 400), "r": [0.1, 0.14, 0.16, 3.0, 0.2], "w": 4.0}
REQUESTS = [*REDUCTIONS, Beyond(20.0), Beyond(0.0), Histogram(-30.0, 30.0, 37)]


@pytest.fixture(autouse=True)
def device(monkeypatch):
    module = cuda_device.cupy()
    monkeypatch.setitem(sys.modules, "cupy", module)
    return module


def deviation(x, wanted):
    """The largest deviation in parts of the peak; where one is NaN the other one is, too."""
    np.testing.assert_array_equal(np.isnan(x), np.isnan(wanted))
    peak = np.nanmax(np.abs(wanted), initial=0.0) or 1.0
    return float(np.nanmax(np.abs(x - wanted), initial=0.0) / peak)


@pytest.mark.stages(second=4)
@pytest.mark.parametrize(
    "name",
    [
        *QUICK,
        *(n if n in OFTEN or n in MODELS else pytest.param(n, marks=pytest.mark.slow) for n in REST),
    ],
)
def test_every_model_has_the_results_of_numpy(name):
    """Within 1e-13 of the peak, and twice what the last bits of the arguments change."""
    points = Points(name, 1000)
    outputs = outputs_of(points.model)
    device, wanted = (evaluated(points, engine) for engine in ("cuda", "numpy"))
    np.testing.assert_array_equal(np.isnan(device), np.isnan(wanted))
    names, units = [v.name for v in outputs], [v.unit for v in outputs]
    # a stop that is stiff moves some outputs by more than 1e-13 for the last bit of an angle
    bits = [np.abs(evaluated(points, "numpy", toward) - wanted) for toward in (-np.inf, np.inf)]
    allowed = np.nanmax(bits, axis=(0, 2), initial=0.0, where=np.isfinite(bits))[:, None]
    off = np.nan_to_num(device - wanted)
    rest = np.sign(off) * np.maximum(np.abs(off) - 2.0 * allowed, 0.0)
    compare(np.nan_to_num(wanted) + rest, np.nan_to_num(wanted), names, units, CLOSE)


def evaluated(points, engine, toward=None):
    """All outputs at random states, in rows, with arguments as they are, or each by a bit `toward` a number."""
    layouts = [points.model.input_layout, points.model.state_layout]
    names = [name for layout in layouts if layout for name in layout.names]
    rows = np.array([*points.u, *points.x])
    rows = rows if toward is None else np.nextafter(rows, toward)
    values = {name: xr.DataArray(row, dims="state") for name, row in zip(names, rows, strict=True)}
    results = batch.evaluate(points.model, values, parameters=points.p, engine=engine, on_host=True)
    return np.array([results[v.name].values for v in outputs_of(points.model)])


def test_reductions_are_those_of_numpy():
    """Of rows in one piece and in several, and where the machine of a row cannot be assembled."""
    machine = ChainUnitMachine()
    requests = dict.fromkeys(("tau", "rocker.tau"), REQUESTS)
    long = {"phi": np.linspace(0.0, 6.0, 5000), "r": [0.15], "w": 4.0}
    for values in (TURN, long):
        device, native, wanted = (
            machine.batch(values, over="phi", reduce=requests, engine=engine, on_host=True)
            for engine in ("cuda", "native", "numpy")
        )
        assert set(device) == set(wanted) and len(device) == 2 * len(REQUESTS) + 1
        for name in wanted.data_vars:
            for other in (device, native):
                assert other[name].dims == wanted[name].dims and other[name].attrs == wanted[name].attrs
                assert deviation(other[name].values, wanted[name].values) < CLOSE, name
        tau = machine.batch({**values, "r": 0.15}, ["tau"], engine="numpy").tau.values
        one = machine.batch({**values, "r": [0.15]}, over="phi", reduce=requests, engine="cuda", on_host=True)
        assert int(one["beyond(tau, 20)"][0]) == np.count_nonzero(np.abs(tau) > 20.0)
        edges = np.linspace(-30.0, 30.0, 38)
        counts, _ = np.histogram(np.clip(tau, -29.9, 29.9), edges)
        np.testing.assert_array_equal(one["histogram(tau)"].isel(r=0), counts)
        np.testing.assert_allclose(one["bin(tau)"], 0.5 * (edges[1:] + edges[:-1]), atol=1e-12)
        assert one["bin(tau)"].attrs["units"] == "N.m" and counts.sum() == len(tau)


def test_results_stay_on_the_device_and_arguments_may_lie_there(device):
    machine, phi = ChainUnitMachine(), np.linspace(0.0, 6.0, 400)
    on_gpu = {"phi": xr.DataArray(device.asarray(phi), dims="phi"), "w": device.asarray(np.array([3.0, 4.0]))}
    stays = machine.batch(on_gpu | {"r": 0.15}, ["tau", "margin"], engine="cuda")
    assert all(on_device(x.data) for x in stays.data_vars.values()) and stays.tau.dims == ("w", "phi")
    wanted = machine.batch({"phi": phi, "w": [3.0, 4.0]}, ["tau", "margin"], engine="numpy")
    copied = machine.batch({"phi": phi, "w": [3.0, 4.0]}, ["tau", "margin"], engine="cuda", on_host=True)
    for name in ("tau", "margin", "reason"):
        assert isinstance(copied[name].data, np.ndarray) and stays[name].attrs == wanted[name].attrs
        assert deviation(copied[name].values, wanted[name].values) < CLOSE
        np.testing.assert_array_equal(stays[name].data.get(), copied[name].values)
    with pytest.raises(InputError, match=r"phi: is on the GPU; take engine 'cuda'"):
        machine.batch(on_gpu, ["tau"], engine="numpy")


@pytest.mark.parametrize("more", [{}, {"by": ["r"]}, {"over": "phi", "reduce": {"tau": REQUESTS}}])
def test_an_earlier_result_gives_its_memory(more):
    machine, outputs = ChainUnitMachine(), None if "over" in more else ["tau", "rocker.tau"]
    first = machine.batch(TURN | {"w": 2.0}, outputs, engine="cuda", **more)
    fresh = machine.batch(TURN, outputs, engine="cuda", **more)
    again = machine.batch(TURN, outputs, engine="cuda", **more, out=first)
    for name in first.data_vars:
        np.testing.assert_array_equal(again[name].data.get(), fresh[name].data.get())
        assert np.shares_memory(again[name].data.on_device, first[name].data.on_device)
    native = machine.batch(TURN, outputs, engine="numpy", **more)
    with pytest.raises(InputError, match="is no array that can be filled"):
        machine.batch(TURN, outputs, engine="cuda", **more, out=native)


def test_reasons_are_those_of_numpy():
    """Bounds, on the host and on the device, requirements and dead positions."""
    machine, loads = ChainUnitMachine(), np.array([3.0, 3.0, 3.0, np.nan, -1.0])
    values = {
        "r": xr.DataArray([0.15, 3.0, -1.0, 0.15, 0.15], dims="state"),
        "left.material_mass": xr.DataArray(loads, dims="state"),
        "phi": np.linspace(0.0, 6.0, 80),
        "w": 3.0,
    }
    for more in ({"outputs": ["tau", "J"]}, {"over": "phi", "reduce": {"tau": ["peak", Beyond(1.0)]}}):
        wanted = machine.batch(values, engine="numpy", **more)
        assert len(set(wanted.reason.values.ravel().tolist())) == 4
        asarray = sys.modules["cupy"].asarray
        lying = values | {"left.material_mass": xr.DataArray(asarray(loads), dims="state")}
        for arguments in (values, lying):
            device = machine.batch(arguments, engine="cuda", on_host=True, **more)
            assert device.reason.attrs == wanted.reason.attrs
            np.testing.assert_array_equal(device.reason, wanted.reason)
            for name in wanted.data_vars:
                assert deviation(device[name].values, wanted[name].values) < CLOSE


def test_values_of_parameters_are_no_part_of_the_code(device):
    device.RawModule.sources.clear()
    for r, limit in ((0.15, 10.0), (0.16, 20.0)):
        ChainUnitMachine(r=r).batch(
            {"phi": np.linspace(0.0, 6.0, 90), "hy": 1.0},
            over="phi",
            reduce={"tau": [Beyond(limit), Histogram(0.0, limit, 9)]},
            engine="cuda",
        )
    assert len(device.RawModule.sources) == 1


def test_quotients_and_roots_from_approximations(tmp_path):
    """To a unit in the last place, with all that IEEE 754 says of 0 and of infinite numbers."""
    text = f"""
#include "{cuda_device.THREADS}"
{header("cuda")}
extern "C" void compute(const double *x, const double *z, double *out, long n) {{
  for (long i = 0; i < n; ++i) {{
    out[i] = div_v(x[i], z[i]);
    out[n + i] = inv_v(z[i]);
    out[2 * n + i] = sqrt_v(x[i]);
  }}
}}
"""
    (tmp_path / "roots.cpp").write_text(text)
    command = [cuda_device.COMPILER, "-std=c++17", "-O1", "-fPIC", "-shared", "roots.cpp", "-o", "roots.so"]
    subprocess.run(command, cwd=tmp_path, check=True)
    rng, n = np.random.default_rng(2), 2**16
    x, z = (rng.uniform(-1.0, 1.0, n) * 10.0 ** rng.uniform(-140.0, 140.0, n) for _ in range(2))
    x[:16], z[:8], z[8:16] = [0.0, 1.0, -2.0, 3.0] * 4, 0.0, [np.inf, -np.inf, np.nan, -0.0] * 2
    out = np.empty((3, n))
    pointers = [ctypes.c_void_p(array.ctypes.data) for array in (x, z, out)]
    ctypes.CDLL(str(tmp_path / "roots.so")).compute(*pointers, ctypes.c_long(n))
    with np.errstate(all="ignore"):
        for results, wanted in zip(out, (x / z, 1.0 / z, np.sqrt(x)), strict=True):
            special = ~np.isfinite(wanted) | (wanted == 0.0)
            np.testing.assert_array_equal(results[special], wanted[special])
            assert np.max(np.abs(results[~special] / wanted[~special] - 1.0)) < 2.3e-16


def test_without_cupy_or_a_gpu_the_engine_is_refused(monkeypatch):
    monkeypatch.setitem(sys.modules, "cupy", cuda_device.cupy(devices=0))
    with pytest.raises(InputError, match=r"engine 'cuda': CuPy finds no GPU .*; take engine 'native'"):
        ChainUnitMachine().batch({"phi": 0.0}, ["tau"], engine="cuda")
    monkeypatch.setitem(sys.modules, "cupy", None)
    with pytest.raises(InputError, match=r"engine 'cuda': needs CuPy: pip install 'chainunit\[cuda\]'"):
        ChainUnitMachine().batch({"phi": 0.0}, ["tau"], engine="cuda")


def test_wrong_reductions_and_too_many_results_are_refused(device, monkeypatch):
    machine = ChainUnitMachine()
    for words, request in {
        "Beyond: limit = -1.0: must be a finite number >= 0": lambda: Beyond(-1.0),
        "Histogram: low = 2.0, high = 1.0: must be finite, low < high": lambda: Histogram(2.0, 1.0, 4),
        "Histogram: bins = 1: must be a whole number from 2 to 1024": lambda: Histogram(1.0, 2.0, 1),
        "tau: has 2 histograms; give one": lambda: machine.batch(
            TURN, over="phi", reduce={"tau": [Histogram(0.0, 1.0, 4), Histogram(0.0, 2.0, 4)]}
        ),
        "reduce: 6144 results, bins of histograms included: the engine 'cuda' has room for 6000": lambda: (
            machine.batch(
                TURN,
                over="phi",
                reduce={name: [Histogram(0.0, 1.0, 1024)] for name in SIX},
                engine="cuda",
            )
        ),
    }.items():
        with pytest.raises(InputError, match=words.replace("(", r"\(")):
            request()

    def full(shape, dtype=float):
        raise MemoryError("out of memory")

    monkeypatch.setattr(device, "empty", full)
    with pytest.raises(RunError, match="GB of results: more than there is memory; evaluate fewer states"):
        machine.batch(TURN, ["tau"], engine="cuda")


SIX = ["tau", "rocker.tau", "rocker.psi", "power", "margin", "J"]


@pytest.mark.skipif(shutil.which("nvcc") is None, reason="no compiler of CUDA")
@pytest.mark.parametrize("more", [{}, {"over": "phi", "reduce": {"tau": REQUESTS}}])
def test_the_compiler_of_cuda_takes_the_kernels(device, tmp_path, more):
    device.RawModule.sources.clear()
    values = {"phi": np.linspace(0.0, 6.0, 333), "l": [1.5, 1.6]}
    ChainUnitMachine().batch(values, None if more else ["tau"], engine="cuda", **more)
    (text,) = device.RawModule.sources
    (tmp_path / "kernels.cu").write_text(text)
    command = ["nvcc", "-arch=sm_90", "-std=c++17", "-cubin", "kernels.cu", "-o", "kernels.cubin"]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
