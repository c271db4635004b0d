"""Models as WebAssembly: outputs, derivatives and slopes at random states against Python, the same bits in every
engine, and runs against the package's integrators."""

from __future__ import annotations

import hashlib
import json
import math
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import casadi
import numpy as np
import pytest
from browser import CHROMIUM
from wasm_hosts import ENGINES, HAS_WASMTIME, NODE, numbers, run_steps

from chainunit import InputError
from chainunit.core import integrators
from chainunit.core.engines import MATH, numpy_
from chainunit.core.model import Model, Part
from chainunit.core.native import elementary
from chainunit.core.quantities import Value, declaration, quantity
from chainunit.core.symbolic_trace import trace
from chainunit.core.wasm.encoding import Module
from chainunit.core.wasm.expressions import OwnFunctions
from chainunit.core.wasm.module import wasm_module
from chainunit.machines.flexible import flexible
from chainunit.machines.linkages.file import read_linkage
from chainunit.models import MODELS
from chainunit.study.config import parse
from chainunit.study.drive import Drive
from chainunit.system import compiled, monolithic
from chainunit.system.signals import Profile

GALLERY = Path(__file__).parents[1] / "examples" / "linkages"
LINKAGES = sorted(file.stem for file in GALLERY.glob("*.toml"))
QUICK = ["ChamberForces", "ChainUnit", "DcMotor", "InductionMotor", "slider_crank_press", "tipper.direct"]
REST = [name for name in (*MODELS, *LINKAGES, *(f"{name}.direct" for name in LINKAGES)) if name not in QUICK]
OFTEN = {
    "andrews_squeezer.direct",
    "blake_jaw_crusher",
    "crank_shaper.direct",
    "level_luffing_crane",
    "scissor_lift.direct",
}
"""Machines of the gallery that the second stage looks at; the slow tests look at all."""
node = pytest.mark.skipif(NODE is None, reason="no node, which runs the modules as a browser does")
wasmtime = pytest.mark.skipif(not HAS_WASMTIME, reason="no wasmtime, which is in the extra clients")
engines = pytest.mark.parametrize(
    "engine",
    [
        pytest.param("node", marks=node),
        pytest.param("wasmtime", marks=[pytest.mark.second, wasmtime]),
    ],
)


@cache
def model_of(name):
    if name in MODELS:
        return MODELS[name]
    machine = read_linkage(GALLERY / f"{name.removesuffix('.direct')}.toml")
    return machine.direct() if name.endswith(".direct") else machine


class Points:
    """Random points of a model: parameters, with inputs and states in columns, shape (variables, points)."""

    def __init__(self, name, count):
        self.model, self.count = model_of(name), count
        self.rng = np.random.default_rng(3)
        self.p = self._parameters()
        self.u = self._columns(self.model.input_layout, [v.quantity.start or 0.0 for v in self._of_inputs()])
        self.x = np.empty((0, count))
        if layout := self.model.state_layout:
            ready = self.model.with_derived(MATH, self.p)
            inputs = self.model.input_layout.instance(self.u[:, 0].tolist())
            self.x = self._columns(layout, layout.values(self.model.start(MATH, ready, inputs)))

    def _of_inputs(self):
        return self.model.input_layout.variables

    def _parameters(self):
        """The start values with lengths, masses and the like a little off, where the machine still works."""
        layout = self.model.parameter_layout
        start = [v.quantity.start for v in layout.variables]
        for share in (1e-2, 1e-3, 1e-4):
            off = [
                x * (1.0 + share * self.rng.uniform(-1.0, 1.0)) if v.type == "Real" else x
                for v, x in zip(layout.variables, start, strict=True)
            ]
            try:
                self.model.check(layout.instance(off))
            except InputError:
                continue
            return layout.instance(off)
        return layout.instance(start)

    def _columns(self, layout, around):
        rows = []
        for v, middle in zip(layout.variables, around, strict=True):
            q = v.quantity
            size = max(abs(middle), q.nominal or 1.0)
            row = middle + size * self.rng.normal(size=self.count)
            if v.name.split(".")[-1] == "phi":
                row = self.rng.uniform(*self._way(), self.count)
            rows.append(np.clip(row, q.low, q.high) if v.type == "Real" else np.full(self.count, middle))
        return np.array(rows).reshape(-1, self.count)

    def _way(self):
        """The places of the driver: turns, or its range without the ends."""
        machine = getattr(self.model, "inverse", self.model)
        if getattr(machine, "turns", True):
            return -4.0 * math.pi, 4.0 * math.pi
        low, high = machine.span
        return low + 0.01 * (high - low), high - 0.01 * (high - low)

    def by_numpy(self):
        """Outputs and derivatives by Python's equations, in rows."""
        xp, model = numpy_(), self.model
        p = model.with_derived(MATH, self.p)
        u = model.input_layout.instance(list(self.u))
        x = model.state_layout.instance(list(self.x)) if model.state_layout else None
        outputs = [
            v
            for part, out in zip(model.parts, model.evaluate(xp, p, u, x), strict=True)
            for v in part.layout.values(out)
        ]
        rates = model.derivatives(xp, p, u, x) if model.state_layout else []
        return [
            np.array([np.broadcast_to(v, self.count) for v in rows]).reshape(-1, self.count)
            for rows in (outputs, rates)
        ]

    def slopes(self, du, dx):
        """The change of outputs and derivatives along the changes, by CasADi's own evaluation."""
        t = trace(self.model)
        ps, us, xs, ks = t.symbols
        rows = casadi.vertcat(*map(casadi.SX, (*t.outputs, *t.derivatives)))
        us_, xs_ = casadi.SX.sym("du", us.shape[0]), casadi.SX.sym("dx", xs.shape[0])
        along = casadi.jtimes(rows, casadi.vertcat(us, xs), casadi.vertcat(us_, xs_))
        f = casadi.Function("f", [ps, us, xs, ks, us_, xs_], [along])
        p = self.model.parameter_layout.values(self.p)
        derived = self.model.derive(MATH, self.p) if self.model.derived_count else []
        return f(p, self.u, self.x, derived, du, dx).full()


def job(points, directions):
    """The module of a model, and the steps for all points: the results are outputs, derivatives and slopes by
    turns."""
    content, d = wasm_module(points.model).content, wasm_module(points.model).description
    at, every = d["addresses"], (1 << len(d["groups"])) - 1
    parameters = points.model.parameter_layout.values(points.p)
    steps = [("write", d["parameters"]["address"], numbers(parameters))]
    if "derive" in d["functions"]:
        steps.append(("call", "derive", []))
    counts = [len(d["outputs"]["names"]), len(d["states"]["names"])]
    for k in range(points.count):
        for address, column in (
            (d["inputs"]["address"], points.u[:, k]),
            (d["states"]["address"], points.x[:, k]),
            (at["input_changes"], directions[0][:, k]),
            (at["state_changes"], directions[1][:, k]),
        ):
            steps.append(("write", address, numbers(column)))
        steps += [("call", "values", [every]), ("call", "forward", [2 * every + 1])]
        if counts[1]:
            steps.append(("call", "derivatives", []))
        for address, count in (
            (d["outputs"]["address"], counts[0]),
            (at["derivatives"], counts[1]),
            (at["output_slopes"], counts[0]),
            (at["derivative_slopes"], counts[1]),
        ):
            steps.append(("read", address, count))
    return content, steps


def read(results, count):
    """The arrays that were read, in columns."""
    arrays = [each for each in results if isinstance(each, np.ndarray)]
    return [np.array(arrays[k::4]).T.reshape(-1, count) for k in range(4)]


SHORT_LINE = r"(left|right)[.](web|wall)[.](angle|w|a)"
"""Outputs of a chain that divide by the length of a line, which is nearly 0 in a few random states. There slopes
change ten times as much by the last bit of the angles as by the rounding of the formula (against 50 digits)."""


def compare(got, want, names, units, most=1e-12, short=1e-11):
    """Each row within so much of its largest number; one that is 0 but for rounding, of the largest of its unit. Of a
    row that divides by a short line one point in a hundred may be off, by at most `short`."""
    size = np.max(np.abs(want), axis=1, initial=0.0)
    of_unit = {unit: max(x for x, own in zip(size, units, strict=True) if own == unit) for unit in units}
    for k, unit in enumerate(units):
        if size[k] < 1e-12 * of_unit[unit]:
            size[k] = of_unit[unit]
    off = np.abs(got - want) / np.where(size > 0.0, size, 1.0)[:, np.newaxis]
    for k, name in enumerate(names):
        if re.fullmatch(SHORT_LINE, name):
            assert np.max(off[k]) <= short, (name, np.max(off[k]))
            off[k] = np.quantile(off[k], 0.99)
    worst = {
        name: x for name, x in zip(names, np.max(off, axis=1, initial=0.0), strict=True) if not x <= most
    }
    assert not worst, worst


def check_points(name, count, engine):
    points = Points(name, count)
    du, dx = (points.rng.normal(size=array.shape) for array in (points.u, points.x))
    d = wasm_module(points.model).description
    outputs, rates, slopes, rate_slopes = read(ENGINES[engine](*job(points, (du, dx))), count)
    want = points.by_numpy()
    names, states = ((d[kind]["names"], d[kind]["units"]) for kind in ("outputs", "states"))
    assert np.isfinite(want[0]).all()
    compare(outputs, want[0], *names)
    compare(rates, want[1], *states)
    want = points.slopes(du, dx)
    without = [k for g in d["without_slopes"] for k in d["groups"][g]]
    assert not np.any(slopes[without])
    want[without] = 0.0
    compare(slopes, want[: len(slopes)], *names, short=1e-7)
    compare(rate_slopes, want[len(slopes) :], *states)


@engines
@pytest.mark.parametrize("name", QUICK)
def test_random_states_are_those_of_python(name, engine):
    check_points(name, 200, engine)


@node
@pytest.mark.second
@pytest.mark.parametrize(
    "name",
    [
        *QUICK,
        *(n if n in OFTEN or n in MODELS else pytest.param(n, marks=pytest.mark.slow) for n in REST),
    ],
)
def test_a_thousand_states_of_every_model(name):
    check_points(name, 1000, "node")


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="no chromium here")
@pytest.mark.parametrize("name", [*MODELS, *LINKAGES])
def test_a_thousand_states_in_chromium(name):
    check_points(name, 1000, "chromium")


@node
@wasmtime
@pytest.mark.second
@pytest.mark.parametrize(
    "name",
    [
        *QUICK,
        "CardanDriveline",
        "KnifeDrive",
        "LoadObserver",
        pytest.param("knife_drive.direct", marks=pytest.mark.slow),
    ],
)
def test_engines_have_the_same_bits(name):
    points = Points(name, 300)
    directions = [points.rng.normal(size=array.shape) for array in (points.u, points.x)]
    there, here = (ENGINES[engine](*job(points, directions)) for engine in ("node", "wasmtime"))
    assert len(there) == len(here) > 0
    for a, b in zip(there, here, strict=True):
        np.testing.assert_array_equal(a, b)


def own_functions(kinds):
    """A module that computes functions of our own from numbers in memory to numbers behind them."""
    module = Module()
    own = OwnFunctions(module)
    for kind in kinds:
        function = own.of(kind)
        caller, (value, other) = module.function(export=kind), (0, 0)
        value, other = caller.local(), caller.local()
        for k in range(len(function.parameters)):
            caller.at(8 + 8 * k)
        caller.call(function)
        for k, local in list(zip(range(len(function.results)), (value, other), strict=False))[::-1]:
            caller.set(local)
            with caller.into(24 + 8 * k):
                caller.get(local)
    return module.bytes_of(64)


@engines
def test_own_functions_have_the_bits_of_the_definition(engine):
    rng, xp = np.random.default_rng(4), elementary.numpy_basic()
    with np.errstate(all="ignore"):
        for kind, (function, count, place) in elementary.OWN.items():
            x = rng.choice([-1.0, 1.0], (500, count)) * 10.0 ** rng.uniform(-4.0, 4.0, (500, count))
            if kind in ("ASIN", "ACOS"):
                x = rng.uniform(-1.1, 1.1, (500, count))
            x = np.concatenate([x, np.full((1, count), np.nan), np.zeros((1, count)), -np.zeros((1, count))])
            want = function(xp, *x.T)
            want = want[place] if isinstance(want, tuple) else want
            steps = []
            for row in x:
                steps += [("write", 8, numbers(row)), ("call", kind, []), ("read", 24 + 8 * place, 1)]
            results = ENGINES[engine](own_functions([kind]), steps)
            got = np.concatenate([each for each in results if each is not None])
            np.testing.assert_array_equal(got, want, kind)
            known = ~np.isnan(want)
            np.testing.assert_array_equal(np.signbit(got)[known], np.signbit(want)[known], kind)


@pytest.mark.second
@pytest.mark.parametrize("name, most", [("InductionMotor", 12_000), ("KnifeDrive", 100_000)])
def test_the_bytes_are_the_same_in_every_process(name, most):
    """The equations alone make them: a new process, with other hashes of texts, has the same."""
    script = (
        "import hashlib, json; from chainunit.models import MODELS;"
        f"from chainunit.core.wasm.module import wasm_module; m = wasm_module(MODELS['{name}']);"
        "print(hashlib.sha256(m.content + json.dumps(m.description).encode()).hexdigest())"
    )
    there = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True).stdout
    here = wasm_module(MODELS[name])
    assert there.strip() == hashlib.sha256(here.content + json.dumps(here.description).encode()).hexdigest()
    assert len(here.content) < most


@declaration
class One:
    """A number."""

    a: Value = quantity("1", "a number", default=2.0, min=0.0)


@declaration
class Power:
    """A number."""

    b: Value = quantity("1", "a power of it")


class Powers(Model):
    """A power that no engine has."""

    name = "Powers"
    description = "a power with a broken exponent"
    Parameters, Inputs = One, One
    parts = (Part(Power, lambda xp, p, u, x, shared: Power(b=u.a**1.7)),)


def test_a_function_that_no_engine_has_is_refused():
    with pytest.raises(InputError, match=r"constpow: .* WebAssembly; a power x\*\*y is exp\(y\*log\(x\)\)"):
        wasm_module(Powers)


class Run:
    """A run of a model in both worlds: inputs at rest but for `signals`, rows every `step` [s]."""

    def __init__(self, name, rows, step, signals, values=None, inputs=None, longest=0.0):
        self.model, self.rows, self.step, self.signals = model_of(name), rows, step, signals
        self.longest = longest
        self.p = self.model.parameter_layout.from_names(values or {})
        self.inputs = {v.name: v.quantity.start for v in self.model.input_layout.variables} | (inputs or {})
        self.names = list(self.model.state_layout.names)

    def in_engine(self, engine, function="run"):
        """The rows of the states, shape (rows, states), and the number of rows."""
        content, d = wasm_module(self.model).content, wasm_module(self.model).description
        steps = [
            ("write", d["parameters"]["address"], numbers(self.model.parameter_layout.values(self.p))),
            ("write", d["inputs"]["address"], numbers(list(self.inputs.values()))),
            *([("call", "derive", [])] if "derive" in d["functions"] else []),
            ("call", "start", []),
            *run_steps(
                d,
                self.signals,
                self.names,
                begin=0.5,
                step=self.step,
                rows=self.rows,
                longest=self.longest,
                function=function,
            ),
        ]
        *_, count, rows, states = ENGINES[engine](content, steps)
        rows = rows.reshape(self.rows, -1)
        if count == self.rows:
            np.testing.assert_array_equal(rows[-1], states)
        return rows, count

    def in_python(self):
        """The same by the integrators of the package."""
        model, p = self.model, self.model.with_derived(MATH, self.p)

        def inputs(t):
            now = {
                name: float(signal(t)) if callable(signal) else float(np.interp(t, *np.transpose(signal)))
                for name, signal in self.signals.items()
            }
            return model.input_layout.from_names({**self.inputs, **now})

        def instance(x):
            return model.state_layout.instance(list(x))

        x = model.state_layout.values(model.start(MATH, p, model.input_layout.from_names(self.inputs)))
        longest, pace, rows = self.longest or model.internal_step(MATH, p), 0.0, [x]
        for n in range(self.rows - 1):
            begin = 0.5 + n * self.step

            def rates(t, x, begin=begin):
                return model.derivatives(MATH, p, inputs(begin + t), instance(x))

            def close(t, x, begin=begin):
                return model.constrained_states(MATH, p, inputs(begin + t), instance(x))

            if model.controlled:
                nominal = [v.quantity.nominal or 1.0 for v in model.state_layout.variables]
                x, pace = integrators.controlled(
                    rates, close, x, self.step, pace, longest, model.tolerance(MATH, p), nominal
                )
            else:
                x = integrators.rk4(rates, x, self.step, longest)
            rows.append(x)
        return np.array(rows)


RUNS = {
    "DcMotor": Run(
        "DcMotor", 201, 1e-3,
        {
            "w_ref": Profile(0.0, ((0.5, 0.1, 60.0), (0.62, 0.05, 20.0))),
            "load.tau_bias": [(0.55, 0.0), (0.6, 1.5), (0.6507, -0.5), (0.68, 0.0)],
        },
        inputs={"load.J": 0.01},
    ),
    "InductionMotor": Run(
        "InductionMotor", 101, 1e-3,
        {"w_ref": Profile(0.0, ((0.5, 0.05, 100.0),)), "load.tau_bias": [(0.52, 0.0), (0.57, 20.0)]},
        longest=7e-5,
    ),
    "ChainUnit": Run(
        "ChainUnit", 101, 2e-3,
        {"tau": [(0.5, 300.0), (0.6, -200.0)], "left.processing_force": Profile(0.0, ((0.55, 0.04, 800.0),))},
    ),
    "slider_crank_press.direct": Run("slider_crank_press.direct", 41, 2e-3, {"tau": [(0.5, 900.0), (0.55, 0.0)]}),
    "tipper.direct": Run("tipper.direct", 41, 5e-3, {}),
}  # fmt: skip


@engines
@pytest.mark.parametrize("name", RUNS)
def test_a_run_is_that_of_the_integrators(name, engine):
    run = RUNS[name]
    rows, count = run.in_engine(engine)
    assert count == run.rows
    want = run.in_python()
    assert np.max(np.abs(want - want[0])) > 0.0
    units = [v.unit for v in run.model.state_layout.variables]
    compare(rows.T, want.T, run.names, units, most=1e-10)


BENT = Run(
    "ChainUnit", 401, 2e-3,
    {
        "left.processing_force": Profile(0.0, ((0.55, 0.04, 800.0), (0.9, 1e-4, 0.0))),
        "tau": [(0.5, 300.0), (1.1, 20.0)],
    },
    longest=0.1,
)  # fmt: skip


@engines
def test_rows_between_the_substeps_are_those_of_a_run(engine):
    """The same rows to the tolerance of the integrator, also where a profile bends between two of them."""
    (rows, count), (want, _) = BENT.in_engine(engine, "dense"), BENT.in_engine(engine)
    assert count == BENT.rows and np.max(np.abs(np.diff(want, axis=0))) > 0.01
    units = [v.unit for v in BENT.model.state_layout.variables]
    compare(rows.T, want.T, BENT.names, units, most=1e-6)
    assert np.any(rows != want)


@engines
def test_rows_between_the_substeps_need_fewer_of_them(engine):
    """A row every 0.2 ms would take 201 substeps."""
    run = Run("ChainUnit", 202, 2e-4, {"tau": [(0.5, 300.0)]}, {"solver.max_steps": 20}, longest=0.1)
    rows, count = run.in_engine(engine, "dense")
    assert count == run.rows
    stepwise, _ = run.in_engine(engine)
    compare(rows.T, stepwise.T, run.names, [v.unit for v in run.model.state_layout.variables], most=1e-6)
    # a substep that takes all of a run, and one whose error is above the permitted one
    few = Run("ChainUnit", 3, 0.1, {"tau": [(0.5, 3e4)]}, {"solver.max_steps": 1}, longest=0.1)
    rows, count = few.in_engine(engine, "dense")
    assert count < few.rows and np.isfinite(rows[0]).all()


def test_a_model_with_constraints_has_no_rows_between_its_substeps():
    models = [MODELS["ChainUnit"], MODELS["DcMotor"], flexible(1, 1).direct()]
    assert [m.controlled for m in models] == [True, False, True]
    found = ["dense" in wasm_module(m, False).description["functions"] for m in models]
    assert found == [True, False, False]


@engines
def test_signals_at_the_rows(engine):
    """Lines, of which a jump is one without length, and smooth changes; also where a row lies on a corner."""
    lines = [(0.51, 3.0), (0.52, 5.0), (0.54, 5.0), (0.54, -1.0), (0.545, 2.0)]
    profile = Profile(2.0, ((0.505, 0.01, 4.0), (0.53, 0.02, -3.0)))
    run = Run("DcMotor", 61, 1e-3, {"load.tau_bias": lines, "w_ref": profile, "load.J": [(0.0, 0.1)]})
    run.names = ["load.tau_bias", "w_ref", "load.J"]
    content, d = wasm_module(run.model).content, wasm_module(run.model).description
    steps = [("call", "start", []), *run_steps(d, run.signals, run.names, begin=0.5, step=1e-3, rows=61)]
    *_, count, rows, _ = ENGINES[engine](content, steps)
    tau, w_ref, inertia = rows.reshape(61, -1).T
    times = 0.5 + 1e-3 * np.arange(61)
    behind = times >= 0.54
    want = np.where(
        behind, np.interp(times, *np.transpose(lines[3:])), np.interp(times, *np.transpose(lines[:3]))
    )
    np.testing.assert_allclose(tau, want, rtol=1e-12)
    assert tau[40] == -1.0 and tau[39] == 5.0 and tau[0] == 3.0 and tau[60] == 2.0
    np.testing.assert_array_equal(w_ref, [profile(float(t)) for t in times])
    assert count == 61 and np.all(inertia == 0.1)


@engines
def test_a_run_stops_where_it_cannot_go_on(engine):
    """With too few substeps, and with states without bounds: its states are those of its last row."""
    few = Run("DcMotor", 20, 1e-3, {}, values={"solver.max_steps": 1}, longest=2e-4)
    rows, count = few.in_engine(engine)
    assert count == 1 and not rows[1:].any()
    enough = Run("DcMotor", 20, 1e-3, {}, values={"solver.max_steps": 5}, longest=2e-4)
    assert enough.in_engine(engine)[1] == 20
    for name, signal in (("DcMotor", "load.tau_bias"), ("ChainUnit", "tau")):
        run = Run(name, 20, 1e-3, {signal: [(0.0, 1.0), (0.5055, 1.0), (0.5056, math.inf)]})
        content, d = wasm_module(run.model).content, wasm_module(run.model).description
        steps = run_steps(d, run.signals, run.names, begin=0.5, step=1e-3, rows=20)
        derive = [("call", "derive", [])] if "derive" in d["functions"] else []
        *_, count, rows, states = ENGINES[engine](content, [*derive, ("call", "start", []), *steps])
        rows = rows.reshape(20, -1)
        assert count == 6 and np.isfinite(rows).all() and not rows[6:].any()
        np.testing.assert_array_equal(states, rows[5])


@pytest.mark.second
@engines
def test_start_and_requirements_are_those_of_python(engine):
    """Also of chains, whose start is an iteration."""
    for model in (flexible(2, 1), MODELS["ChainUnit"], MODELS["KnifeDrive"]):
        content, d = wasm_module(model, slopes=False).content, wasm_module(model, slopes=False).description
        assert "forward" not in d["functions"]
        called = [
            name for name in ("derive", "requirements", "start", "start_limits") if name in d["functions"]
        ]
        tables = [d["requirements"], d["start_limits"]]
        results = ENGINES[engine](
            content,
            [
                *(("call", name, []) for name in called),
                *(("read", each["address"], 3 * len(each["rules"])) for each in tables),
                ("read", d["states"]["address"], len(d["states"]["names"])),
            ],
        )
        required, limits, states = (each for each in results if isinstance(each, np.ndarray))
        p = model.parameter_layout.instance([v.quantity.start for v in model.parameter_layout.variables])
        p = model.with_derived(MATH, p)
        np.testing.assert_allclose(required.reshape(-1, 3), list(model.requirements(MATH, p)), rtol=1e-12)
        assert [each["subject"] for each in tables[0]["rules"]] == [each.subject for each in model.required]
        if model.state_layout:
            u = model.input_layout.instance([v.quantity.start for v in model.input_layout.variables])
            x = model.start(MATH, p, u)
            np.testing.assert_allclose(states, model.state_layout.values(x), rtol=1e-12, atol=1e-13)
            want = np.reshape(list(model.start_limits(MATH, p, u, x)), (-1, 3))
            np.testing.assert_allclose(limits.reshape(-1, 3), want, rtol=1e-9)


@node
@wasmtime
@pytest.mark.second
@pytest.mark.parametrize("name", RUNS)
def test_a_run_has_the_same_bits_in_every_engine(name):
    (there, _), (here, _) = (RUNS[name].in_engine(engine) for engine in ("node", "wasmtime"))
    np.testing.assert_array_equal(there, here)


@node
@wasmtime
@pytest.mark.second
def test_rows_between_the_substeps_have_the_same_bits_in_every_engine():
    (there, _), (here, _) = (BENT.in_engine(engine, "dense") for engine in ("node", "wasmtime"))
    np.testing.assert_array_equal(there, here)


@engines
@pytest.mark.second
def test_a_jam_of_a_drive_is_that_of_the_reference(engine):
    """A motor on its machine as one model: the start, and a lump on the left."""
    config = parse("")
    drive = Drive(MODELS["DcMotor"], config.motor.parameters, config.machine)
    whole, loads = compiled(drive.graph), drive.loads(config.feed)
    model, names = (
        whole.model,
        ["motor.tau", "motor.air_gap_tau", "machine.rocker.tau", "motor.w", "motor.phi"],
    )
    signals = {
        "motor.w_ref": Profile(0.0, ((0.0, 0.6, 3.0 * drive.ratio),)),
        "machine.left.processing_force": Profile(10.0, ((1.0, 0.02, 1500.0), (1.2, 0.02, 10.0))),
    }
    content, d = wasm_module(model, slopes=False).content, wasm_module(model, slopes=False).description
    assert len(content) < 20_000
    inputs = model.input_layout.values(model.input_layout.from_names(loads))
    steps = [
        ("write", d["parameters"]["address"], numbers(model.parameter_layout.values(whole.parameters))),
        ("write", d["inputs"]["address"], numbers(inputs)),
        ("call", "start", []),
        *run_steps(d, signals, names, begin=0.0, step=1e-3, rows=1501),
    ]
    *_, count, rows, _ = ENGINES[engine](content, steps)
    reference = monolithic(drive.graph, {**loads, **signals}, 1e-3 * np.arange(1501))
    assert count == 1501
    for name, row in zip(names, rows.reshape(1501, -1).T, strict=True):
        wanted = reference[name].values
        assert np.max(np.abs(row - wanted)) < 1e-7 * np.max(np.abs(wanted)), name
