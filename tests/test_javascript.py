"""Models in JavaScript: outputs and derivatives at random states against Python and, to the bit, against the list of
their operations; and runs against the package's integrators."""

from __future__ import annotations

import hashlib
import math
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from basic_operations import ARRAYS
from javascript_hosts import HOSTS, chromium, in_node, node, profile_numbers

from chainunit import InputError
from chainunit.core import integrators
from chainunit.core.engines import MATH, casadi_, numpy_
from chainunit.core.model import Model, Part
from chainunit.core.printing import elementary
from chainunit.core.printing.javascript import model_text, program
from chainunit.core.printing.kernels import kernels
from chainunit.core.printing.operations import ARGUMENT, NUMBER, Operations
from chainunit.core.quantities import Value, declaration, quantity
from chainunit.core.symbolic_trace import outputs_of, trace
from chainunit.machines.flexible import flexible
from chainunit.machines.linkages.file import read_linkage
from chainunit.models import MODELS
from chainunit.study.config import parse
from chainunit.study.drive import Drive
from chainunit.system import compiled, monolithic
from chainunit.system.signals import Profile

pytestmark = node
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

    def by_operations(self):
        """The same by the list of the operations that is printed, with our own functions, in columns of points."""
        t = trace(self.model)
        derived = self.model.derive(casadi_(), t.p) if self.model.derived_count else []
        functions = {f.name: f for f in kernels(t, derived, False, [v.name for v in outputs_of(self.model)])}
        values = {"p": np.array(self.model.parameter_layout.values(self.p), float), "u": self.u, "x": self.x}
        if derived:
            values["k"] = evaluated(functions["derive"], values)
        return [
            np.array([np.broadcast_to(v, self.count) for v in evaluated(functions[name], values)])
            for name in ("values", "derivatives")
            if name in functions
        ]


def by_numpy_operations():
    """Each operation on arrays, by its kind."""
    forms = {
        "ADD": np.add, "SUB": np.subtract, "MUL": np.multiply, "DIV": np.divide, "NEG": np.negative,
        "SQ": np.square, "TWICE": lambda x: 2.0 * x, "INV": lambda x: 1.0 / x, "ASSIGN": np.positive,
        "SQRT": np.sqrt, "FABS": np.abs, "FLOOR": np.floor, "CEIL": np.ceil, "SIGN": np.sign,
        "FMIN": np.minimum, "FMAX": np.maximum, "COPYSIGN": np.copysign,
        "LT": np.less, "LE": np.less_equal, "EQ": np.equal, "NE": np.not_equal,
        "AND": np.logical_and, "OR": np.logical_or, "NOT": np.logical_not,
        "IF_ELSE_ZERO": lambda c, x: np.where(c, x, 0.0),
    }  # fmt: skip
    for kind, (function, _, place) in elementary.OWN.items():

        def own(*x, function=function, place=place):
            result = function(ARRAYS, *x)
            return result[place] if isinstance(result, tuple) else result

        forms[kind] = own
    return forms


def evaluated(kernel, values):
    """The results of a function of one group, from its arguments by letter."""
    operations, forms, found = Operations(kernel.arguments, kernel.groups), by_numpy_operations(), []
    with np.errstate(all="ignore"):
        for each in operations.items:
            if each.kind == NUMBER:
                found.append(each.value)
            elif each.kind == ARGUMENT:
                found.append(values[kernel.takes[each.entry[0]]][each.entry[1]])
            else:
                found.append(1.0 * forms[each.kind](*(found[k] for k in each.operands)))
    return [found[place] for place in operations.results[0]]


POINTS = """
const m = models.m, outputs = [], rates = [];
m.p.set(given.p);
m.derive?.();
for (let k = 0; k < given.count; k++) {
  for (const letter of "ux")
    for (let n = 0; n < m[letter].length; n++) m[letter][n] = given[letter][n * given.count + k];
  m.values();
  m.derivatives?.();
  outputs.push(...m.y);
  rates.push(...(m.rates ?? []));
}
return [coded(outputs), coded(rates)];
"""


SHORT_LINE = r"(left|right)[.](web|wall)[.](angle|w|a)|cylinder[.]moment"
"""Outputs of a chain that divide by the length of a line, which is nearly 0 in a few random states. There slopes
change ten times as much by the last bit of the angles as by the rounding of the formula (against 50 digits). The
moment of a cylinder is the small difference of reactions that are large in four of a thousand random states."""


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


def check_points(name, count, host="node"):
    points = Points(name, count)
    given = {
        "p": np.array(points.model.parameter_layout.values(points.p)),
        "u": points.u,
        "x": points.x,
        "count": count,
    }
    outputs, rates = (each.reshape(count, -1).T for each in HOSTS[host]({"m": points.model}, POINTS, given))
    want = points.by_numpy()
    assert np.isfinite(want[0]).all()
    compare(outputs, want[0], *names_and_units(outputs_of(points.model)))
    if points.model.state_layout:
        compare(rates, want[1], *names_and_units(points.model.state_layout.variables))
    for got, bits in zip((outputs, rates), points.by_operations(), strict=False):
        np.testing.assert_array_equal(got, bits)


def names_and_units(variables):
    return [v.name for v in variables], [v.unit for v in variables]


@pytest.mark.stages(first=2)
@pytest.mark.parametrize("name", QUICK)
def test_random_states_are_those_of_python(name):
    check_points(name, 200)


@pytest.mark.stages(second=4)
@pytest.mark.second
@pytest.mark.parametrize(
    "name",
    [
        *QUICK,
        *(n if n in OFTEN or n in MODELS else pytest.param(n, marks=pytest.mark.slow) for n in REST),
    ],
)
def test_a_thousand_states_of_every_model(name):
    check_points(name, 1000)


@pytest.mark.slow
@chromium
@pytest.mark.parametrize("name", [*MODELS, *LINKAGES])
def test_a_thousand_states_in_chromium(name):
    check_points(name, 1000, "chromium")


def test_own_functions_have_the_bits_of_the_definition():
    """Each as the output of a model."""
    rng, xp = np.random.default_rng(4), ARRAYS
    x = rng.choice([-1.0, 1.0], (500, 2)) * 10.0 ** rng.uniform(-4.0, 4.0, (500, 2))
    x[:100] = rng.uniform(-1.1, 1.1, (100, 2))
    x = np.concatenate([x, np.full((1, 2), np.nan), np.zeros((1, 2)), -np.zeros((1, 2))])
    script = """const m = models.m, found = [];
      for (let k = 0; k < given.length; k += 2) { m.u.set(given.subarray(k, k + 2)); m.values(); found.push(...m.y); }
      return coded(found);"""
    got = in_node({"m": Functions}, script, x).reshape(len(x), -1)
    with np.errstate(all="ignore"):
        for column, kind in enumerate(KINDS):
            function, count, place = elementary.OWN[kind]
            want = function(xp, *x.T[:count])
            want = want[place] if isinstance(want, tuple) else want
            np.testing.assert_array_equal(got[:, column], want, kind)
            known = ~np.isnan(want)
            np.testing.assert_array_equal(np.signbit(got[known, column]), np.signbit(want[known]), kind)


@pytest.mark.second
@pytest.mark.parametrize("name", ["InductionMotor", "KnifeDrive"])
def test_the_text_calls_nothing_whose_bits_differ_and_evaluates_none(name):
    text = program({"m": model_text(MODELS[name])})
    assert set(re.findall(r"Math[.](\w+)", text)) <= {"abs", "ceil", "floor", "max", "min", "sign", "sqrt"}
    assert not re.search(r"\beval\b|\bFunction\b|WebAssembly|\bimport\b", text)


@pytest.mark.stages(second=1)
@pytest.mark.second
@pytest.mark.parametrize("name, most", [("InductionMotor", 8_000), ("KnifeDrive", 210_000)])
def test_the_text_is_the_same_in_every_process(name, most):
    """The equations alone make them: a new process, with other hashes of texts, has the same."""
    script = (
        "import hashlib; from chainunit.models import MODELS;"
        f"from chainunit.core.printing.javascript import model_text; text = model_text(MODELS['{name}']);"
        "print(hashlib.sha256(text.encode()).hexdigest())"
    )
    there = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True).stdout
    here = model_text(MODELS[name]).encode()
    assert there.strip() == hashlib.sha256(here).hexdigest() and len(here) < most


@declaration
class One:
    """A number."""

    a: Value = quantity("1", "a number", default=2.0, min=0.0)


@declaration
class Power:
    """A number."""

    b: Value = quantity("1", "a power of it")


Powers = Model(
    name="Powers",
    text="A power whose bits differ between browsers.",
    description="a power with a broken exponent",
    Parameters=One,
    Inputs=One,
    parts=(Part(Power, lambda xp, p, u, x, shared: Power(b=u.a**1.7)),),
)


def test_a_function_whose_bits_differ_is_refused():
    with pytest.raises(InputError, match=r"constpow: .* each browser; a power x\*\*y is exp\(y\*log\(x\)\)"):
        model_text(Powers)


@declaration
class Arguments:
    """Two numbers."""

    a: Value = quantity("1", "first argument")
    b: Value = quantity("1", "second argument")


@declaration
class Results:
    """Results of functions."""

    sine: Value = quantity("1", "sine")
    cosine: Value = quantity("1", "cosine")
    arcsine: Value = quantity("1", "arcsine")
    arccosine: Value = quantity("1", "arccosine")
    arctangent: Value = quantity("1", "arctangent")
    exponential: Value = quantity("1", "exponential")
    logarithm: Value = quantity("1", "logarithm")


KINDS = ["SIN", "COS", "ASIN", "ACOS", "ATAN2", "EXP", "LOG"]
"""The operations that compute `Results`."""


def results_of(xp, p, u, x, shared):
    return Results(
        sine=xp.sin(u.a),
        cosine=xp.cos(u.a),
        arcsine=xp.asin(u.a),
        arccosine=xp.acos(u.a),
        arctangent=xp.atan2(u.a, u.b),
        exponential=xp.exp(u.a),
        logarithm=xp.log(u.a),
    )


Functions = Model(
    name="Functions",
    text="Each function of our own.",
    description="functions of two numbers",
    Parameters=One,
    Inputs=Arguments,
    parts=(Part(Results, results_of),),
)


RUN = """
const m = models.m, chosen = placesOf(m, given.names);
m.p.set(given.p);
m.u.set(given.u);
m.derive?.();
m.start();
const found = [];
const count = m.run({
  begin: given.begin, step: given.step, rows: given.rows, longest: given.longest, between: given.between,
  signals: Object.entries(given.signals).map(([name, numbers]) => [m.about.u.indexOf(name), numbers]),
  row: () => found.push(...chosen.map(([a, n]) => a[n])),
});
return [coded(found), count, coded(m.x)];
"""


class Run:
    """A run of a model in both worlds: inputs at rest but for `signals`, rows every `step` [s]."""

    def __init__(self, name, rows, step, signals, values=None, inputs=None, longest=0.0):
        self.model, self.rows, self.step, self.signals = model_of(name), rows, step, signals
        self.longest = longest
        self.p = self.model.parameter_layout.from_names(values or {})
        self.inputs = {v.name: v.quantity.start for v in self.model.input_layout.variables} | (inputs or {})
        self.names = list(self.model.state_layout.names)

    def in_node(self, between=False):
        """The rows of the named states, outputs and inputs, shape (rows, names), their number and the states at the
        end."""
        given = {
            "p": np.array(self.model.parameter_layout.values(self.p)),
            "u": np.array(list(self.inputs.values())),
            "signals": {name: profile_numbers(signal) for name, signal in self.signals.items()},
            **{name: getattr(self, name) for name in ("names", "step", "rows", "longest")},
            "begin": 0.5,
            "between": between,
        }
        rows, count, states = in_node({"m": self.model}, RUN, given)
        assert len(rows) == count * len(self.names)
        return rows.reshape(count, -1), count, states

    def in_python(self):
        """The same by the integrators of the package."""
        model, p = self.model, self.model.with_derived(MATH, self.p)

        def inputs(t):
            now = {name: float(signal(t)) for name, signal in self.signals.items()}
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
            "load.tau_bias": Profile(0.0, ((0.55, 0.04, 1.5), (0.6, 0.0507, -0.5), (0.66, 0.03, 0.0))),
        },
        inputs={"load.J": 0.01},
    ),
    "InductionMotor": Run(
        "InductionMotor", 101, 1e-3,
        {"w_ref": Profile(0.0, ((0.5, 0.05, 100.0),)), "load.tau_bias": Profile(0.0, ((0.52, 0.05, 20.0),))},
        longest=7e-5,
    ),
    "ChainUnit": Run(
        "ChainUnit", 101, 2e-3,
        {"tau": Profile(300.0, ((0.5, 0.1, -200.0),)), "left.processing_force": Profile(0.0, ((0.55, 0.04, 800.0),))},
    ),
    "slider_crank_press.direct": Run(
        "slider_crank_press.direct", 41, 2e-3, {"tau": Profile(900.0, ((0.5, 0.05, 0.0),))}
    ),
    "tipper.direct": Run("tipper.direct", 41, 5e-3, {}),
}  # fmt: skip


@pytest.mark.stages(first=1)
@pytest.mark.parametrize("name", RUNS)
def test_a_run_is_that_of_the_integrators(name):
    run = RUNS[name]
    rows, count, states = run.in_node()
    assert count == run.rows
    np.testing.assert_array_equal(rows[-1], states)
    want = run.in_python()
    assert np.max(np.abs(want - want[0])) > 0.0
    compare(rows.T, want.T, *names_and_units(run.model.state_layout.variables), most=1e-10)


BENT = Run(
    "ChainUnit", 401, 2e-3,
    {
        "left.processing_force": Profile(0.0, ((0.55, 0.04, 800.0), (0.9, 1e-4, 0.0))),
        "tau": Profile(300.0, ((0.5, 0.6, 20.0),)),
    },
    longest=0.1,
)  # fmt: skip


def test_rows_between_the_substeps_are_those_of_a_run():
    """The same rows to the tolerance of the integrator, also where a profile bends between two of them."""
    (rows, count, _), (want, *_) = BENT.in_node(between=True), BENT.in_node()
    assert count == BENT.rows and np.max(np.abs(np.diff(want, axis=0))) > 0.01
    compare(rows.T, want.T, *names_and_units(BENT.model.state_layout.variables), most=1e-6)
    assert np.any(rows != want)


def test_rows_between_the_substeps_need_fewer_of_them():
    """A row every 0.2 ms would take 201 substeps."""
    pull = {"tau": 300.0}
    run = Run("ChainUnit", 202, 2e-4, {}, {"solver.max_steps": 20}, pull, longest=0.1)
    rows, count, _ = run.in_node(between=True)
    assert count == run.rows
    compare(rows.T, run.in_node()[0].T, *names_and_units(run.model.state_layout.variables), most=1e-6)
    # a substep that takes all of a run, and one whose error is above the permitted one
    few = Run("ChainUnit", 3, 0.1, {}, {"solver.max_steps": 1}, {"tau": 3e4}, longest=0.1)
    rows, count, _ = few.in_node(between=True)
    assert count < few.rows and np.isfinite(rows[0]).all()


def test_a_model_with_constraints_has_no_rows_between_its_substeps():
    models = {"unit": MODELS["ChainUnit"], "motor": MODELS["DcMotor"], "chains": flexible(1, 1).direct()}
    script = "return Object.values(models).map((m) => [m.about.controlled, m.about.free]);"
    assert in_node(models, script) == [[True, True], [False, False], [True, False]]


def test_signals_at_the_rows():
    """Smooth changes, also where a row lies on a corner, and a constant."""
    profile = Profile(2.0, ((0.505, 0.01, 4.0), (0.53, 0.02, -3.0)))
    run = Run("DcMotor", 61, 1e-3, {"w_ref": profile, "load.J": 0.1})
    run.names = ["w_ref", "load.J"]
    rows, count, _ = run.in_node()
    w_ref, inertia = rows.T
    np.testing.assert_array_equal(w_ref, [profile(float(t)) for t in 0.5 + 1e-3 * np.arange(61)])
    assert count == 61 and np.all(inertia == 0.1)


def test_a_run_stops_where_it_cannot_go_on():
    """With too few substeps, and with states without bounds: its states are those of its last row."""
    few = Run("DcMotor", 20, 1e-3, {}, values={"solver.max_steps": 1}, longest=2e-4)
    assert few.in_node()[1] == 1
    enough = Run("DcMotor", 20, 1e-3, {}, values={"solver.max_steps": 5}, longest=2e-4)
    assert enough.in_node()[1] == 20
    for name, signal in (("DcMotor", "load.tau_bias"), ("ChainUnit", "tau")):
        run = Run(name, 20, 1e-3, {signal: Profile(1.0, ((0.5055, 1e-4, 1e308),))})
        rows, count, states = run.in_node()
        assert count == 6 and np.isfinite(rows).all()
        np.testing.assert_array_equal(states, rows[5])


@pytest.mark.second
def test_start_and_requirements_are_those_of_python():
    """Also of chains, whose start is an iteration."""
    script = """const m = models.m;
      for (const name of ["derive", "requirements", "start", "start_limits"]) m[name]?.();
      return [m.about.requirements, coded(m.requirements_ ?? []), coded(m.start_limits_ ?? []), coded(m.x)];"""
    for model in (flexible(2, 1), MODELS["ChainUnit"], MODELS["KnifeDrive"]):
        rules, required, limits, states = in_node({"m": model}, script)
        p = model.parameter_layout.instance([v.quantity.start for v in model.parameter_layout.variables])
        p = model.with_derived(MATH, p)
        np.testing.assert_allclose(required.reshape(-1, 3), list(model.requirements(MATH, p)), rtol=1e-12)
        assert [each["subject"] for each in rules] == [each.subject for each in model.required]
        if model.state_layout:
            u = model.input_layout.instance([v.quantity.start for v in model.input_layout.variables])
            x = model.start(MATH, p, u)
            np.testing.assert_allclose(states, model.state_layout.values(x), rtol=1e-12, atol=1e-13)
            want = np.reshape(list(model.start_limits(MATH, p, u, x)), (-1, 3))
            np.testing.assert_allclose(limits.reshape(-1, 3), want, rtol=1e-9)


@pytest.mark.second
def test_a_jam_of_a_drive_is_that_of_the_reference():
    """A motor on its machine as one model: the start, and a lump on the left."""
    config = parse("")
    drive = Drive(MODELS["DcMotor"], config.motor.parameters, config.machine)
    whole, loads = compiled(drive.graph), drive.loads(config.feed)
    model = whole.model
    names = ["motor.tau", "motor.air_gap_tau", "machine.rocker.tau", "motor.w", "motor.phi"]
    signals = {
        "motor.w_ref": Profile(0.0, ((0.0, 0.6, 3.0 * drive.ratio),)),
        "machine.left.processing_force": Profile(10.0, ((1.0, 0.02, 1500.0), (1.2, 0.02, 10.0))),
    }
    assert len(model_text(model)) < 25_000  # packed, a third of it in the page
    given = {
        "p": np.array(model.parameter_layout.values(whole.parameters), float),
        "u": np.array(model.input_layout.values(model.input_layout.from_names(loads)), float),
        "signals": {name: profile_numbers(signal) for name, signal in signals.items()},
        **{"names": names, "begin": 0.0, "step": 1e-3, "rows": 1501, "longest": 0.0, "between": False},
    }
    rows, count, _ = in_node({"m": model}, RUN, given)
    reference = monolithic(drive.graph, {**loads, **signals}, 1e-3 * np.arange(1501))
    assert count == 1501
    for name, row in zip(names, rows.reshape(1501, -1).T, strict=True):
        wanted = reference[name].values
        assert np.max(np.abs(row - wanted)) < 1e-7 * np.max(np.abs(wanted)), name
