"""One step in every language: a stiff problem with kinks has the same accepted steps by the integrators of Python, of
native and Python FMUs, of the lanes of a batch, and of JavaScript.

A constraint is closed after each accepted step. That of the problem writes the time down, so that the states of any
integrator have the times of its last steps.
"""

from __future__ import annotations

import fmpy
import numpy as np
import pytest
from javascript_hosts import NODE, in_node
from test_javascript import RUN

from chainunit.batch.transients import Transients
from chainunit.core import integrators
from chainunit.core.engines import MATH
from chainunit.core.model import Model, Part
from chainunit.core.native.compilers import compiler
from chainunit.core.ports import Solver
from chainunit.core.quantities import Layout, Value, declaration, declared_class, group, quantity
from chainunit.fmu.backends import export

NOTES, ROWS, STEP = 30, 11, 0.02
"""Number of the last steps whose times are states; rows, and their distance [s]."""
LONGEST, TOLERANCE, START = 0.05, 1e-6, (0.0, 0.2, 0.0)
NAMES = ["clock", "stiff", "bent"]


@declaration
class Numbers:
    """Parameters of the problem."""

    rate: Value = quantity("1/s", "rate of the stiff part", default=800.0)
    bend: Value = quantity("s", "time of a kink", default=0.0313)
    solver: Solver = group(Solver, "internal integrator", default=Solver())


@declaration
class Nothing:
    """An input without effect."""

    idle: Value = quantity("1", "no effect", default=0.0)


@declaration
class Answer:
    """The output of the problem."""

    height: Value = quantity("1", "the stiff state")


def states_with(notes):
    """The declaration of the states, with so many notes."""
    fields = [(name, Value, quantity("1", name)) for name in (*NAMES, *(f"note{k}" for k in range(notes)))]
    return declared_class("Path", (), fields)


def slope(xp, p, x):
    """Derivatives of the clock, of a stiff state, and of one that a kink and a stop bend."""
    late = x.clock - p.bend
    pull = 300.0 * xp.maximum(x.clock - 0.11, 0.0) - 40.0 * xp.maximum(x.bent - 0.3, 0.0)
    return [1.0, -p.rate * (x.stiff - xp.cos(9.0 * x.clock)), xp.abs(late) / (1e-3 + xp.abs(late)) + pull]


def problem(name, notes, controlled, longest):
    """The problem with notes of the accepted steps; without notes it has no constraints, and rows between its
    steps."""
    States = states_with(notes)
    layout, more = Layout(States), notes + len(NAMES) - len(START)

    def constrained(xp, p, u, x):
        now = layout.values(x)
        before = now[len(NAMES) :]
        return [*now[: len(NAMES)], *([x.clock, *before[:-1]] if before else [])]

    return Model(
        name=name,
        description="a stiff problem with kinks",
        Parameters=Numbers,
        Inputs=Nothing,
        States=States,
        parts=(Part(Answer, lambda xp, p, u, x, shared: Answer(height=x.stiff)),),
        controlled=controlled,
        initial_states=lambda xp, p: None,
        start_states=lambda xp, p, u, z: layout.instance([*START, *[0.0] * more]),
        derivatives=lambda xp, p, u, x: [*slope(xp, p, x), *[0.0] * more],
        internal_step=lambda xp, p: longest,
        tolerance=lambda xp, p: TOLERANCE,
        constrained_states=constrained,
    )


Problem = problem("Problem", NOTES, True, LONGEST)
Free = problem("Free", 0, True, LONGEST)
Even = problem("Even", 0, False, 0.0015)


def by_python(model):
    """The states at the rows by the integrators of the package, shape (rows, states)."""
    p = model.Parameters()
    x, pace, rows = list(model.state_layout.values(model.start(MATH, p, None))), 0.0, []
    instance = model.state_layout.instance
    for _ in range(ROWS):
        rows.append(x)

        def rates(t, x):
            return model.derivatives(MATH, p, None, instance(list(x)))

        def close(t, x):
            return model.constrained_states(MATH, p, None, instance(list(x)))

        if model.controlled:
            sizes = [1.0] * len(x)
            x, pace = integrators.controlled(rates, close, x, STEP, pace, LONGEST, TOLERANCE, sizes)
        else:
            x = integrators.rk4(rates, x, STEP, model.internal_step(MATH, p))
    return np.array(rows)


def by_lanes(model, rates=(800.0,)):
    """The same by the loop of transients, for runs with these rates of the stiff part."""
    names = model.state_layout.names
    loop = Transients(model, names, varying=["rate"])
    start = model.state_layout.values(model.start(MATH, model.Parameters(), None))
    runs = loop.run(
        model.Parameters(), {}, start, begin=0.0, step=STEP,
        stop=[STEP * (ROWS - 1)] * len(rates), varying=[list(rates)],
    )  # fmt: skip
    assert not runs.failed.any() and (runs.count == ROWS).all()
    return np.moveaxis(runs.rows, 0, -1)


def by_javascript(model, between=False):
    """The same in node."""
    given = {
        "p": np.array(model.parameter_layout.values(model.Parameters())), "u": np.zeros(1), "signals": {},
        "names": list(model.state_layout.names), "step": STEP, "rows": ROWS, "longest": 0, "begin": 0.0,
        "between": between,
    }  # fmt: skip
    rows, count, _ = in_node({"m": model}, RUN, given)
    assert count == ROWS
    return rows.reshape(ROWS, -1)


def by_fmu(model, backend, file):
    """The same in an FMU."""
    export(model, file, backend=backend)
    names = list(model.state_layout.names)
    rows = fmpy.simulate_fmu(
        str(file), fmi_type="CoSimulation", stop_time=STEP * (ROWS - 1), step_size=STEP, output_interval=STEP,
        output=names,
    )  # fmt: skip
    return np.array([rows[name] for name in names]).T


def accepted(rows):
    """By row the times of the ends of the accepted steps before it, without those of earlier rows."""
    times = []
    for n in range(1, ROWS):
        notes = rows[n, len(NAMES) :]
        assert len(notes) == NOTES and (n == 1 or notes[-1] <= rows[n - 1, 0] + 1e-9), "too few notes"
        times.append(sorted(t for t in notes if t > rows[n - 1, 0] + 1e-9))
    return times


NEEDS_COMPILER = pytest.mark.skipif(compiler() is None, reason="no C compiler")
NEEDS_NODE = pytest.mark.skipif(NODE is None, reason="no node")
WAYS = [
    pytest.param(lambda model, folder: by_lanes(model)[0], marks=NEEDS_COMPILER, id="lanes"),
    pytest.param(lambda model, folder: by_javascript(model), marks=NEEDS_NODE, id="javascript"),
    pytest.param(
        lambda model, folder: by_fmu(model, "native", folder / "native.fmu"),
        marks=NEEDS_COMPILER,
        id="native",
    ),
    pytest.param(lambda model, folder: by_fmu(model, "python", folder / "python.fmu"), id="python"),
]


@pytest.mark.second
@pytest.mark.parametrize("way", WAYS)
def test_every_language_accepts_the_same_steps(way, tmp_path):
    rows, wanted = way(Problem, tmp_path), by_python(Problem)
    steps = accepted(wanted)
    # a stiff part holds the steps short, kinks shorten some, and a row ends some
    assert min(map(len, steps)) >= 5 and sum(map(len, steps)) > 60
    for own, other in zip(accepted(rows), steps, strict=True):
        np.testing.assert_allclose(own, other, rtol=1e-9)
    np.testing.assert_allclose(rows[:, : len(NAMES)], wanted[:, : len(NAMES)], rtol=1e-9, atol=1e-12)


@pytest.mark.second
@pytest.mark.parametrize("way", WAYS)
def test_every_language_takes_the_same_equal_steps(way, tmp_path):
    np.testing.assert_allclose(way(Even, tmp_path), by_python(Even), rtol=1e-12, atol=1e-13)


@NEEDS_COMPILER
@NEEDS_NODE
def test_rows_between_steps_are_the_same_in_lanes_and_in_javascript():
    """Their steps do not end at rows: these are interpolated."""
    lanes, script, wanted = by_lanes(Free)[0], by_javascript(Free, between=True), by_python(Free)
    np.testing.assert_allclose(lanes, script, rtol=1e-9, atol=1e-12)
    assert 1e-12 < np.max(np.abs(lanes - wanted)) < 1e-4


@NEEDS_COMPILER
def test_each_lane_has_steps_of_its_own():
    """Runs side by side, of which each is as stiff as it is, take the steps that they take alone."""
    rates = (800.0, 100.0, 1500.0, 10.0, 400.0)
    for model in (Problem, Free, Even):
        together = by_lanes(model, rates)
        for run, rate in zip(together, rates, strict=True):
            np.testing.assert_array_equal(run, by_lanes(model, (rate,))[0])
