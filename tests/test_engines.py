"""The same kernel under every engine."""

from __future__ import annotations

import math

import casadi
import numpy as np
import pytest
from machines import random_loads, random_machine, random_state
from test_javascript import OFTEN, QUICK, REST, Points, compare

from chainunit.core import engines
from chainunit.core.printing import python_math
from chainunit.core.printing.kernels import kernels
from chainunit.core.printing.python_code import python_text
from chainunit.core.symbolic_trace import outputs_of, trace
from chainunit.machines.chain_unit import ChamberForces
from chainunit.models import MODELS

MODEL = ChamberForces


def all_outputs(xp, p, u):
    parts = MODEL.evaluate(xp, p, u)
    return [v for part, out in zip(MODEL.parts, parts, strict=True) for v in part.layout.values(out)]


def case(seed):
    rng = np.random.default_rng(seed)
    machine = random_machine(rng)
    phi, w, a = random_state(rng, machine)
    u = MODEL.Inputs(phi=float(phi), w=float(w), a=float(a), left=random_loads(rng), right=random_loads(rng))
    return machine.p, u


@pytest.mark.parametrize("seed", range(20))
def test_math_numpy_and_casadi_agree(seed):
    p, u = case(seed)
    by_math = np.array(all_outputs(engines.MATH, p, u))

    arrays = MODEL.input_layout.instance([np.full((2, 1), v) for v in MODEL.input_layout.values(u)])
    by_numpy = np.array([np.broadcast_to(v, (2, 1)) for v in all_outputs(engines.numpy_(), p, arrays)])
    np.testing.assert_allclose(by_numpy[:, 0, 0], by_math, rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(by_numpy[:, 1, 0], by_math, rtol=1e-12, atol=1e-9)

    ps = casadi.SX.sym("p", len(MODEL.parameter_layout.names))
    us = casadi.SX.sym("u", len(MODEL.input_layout.names))
    symbols = all_outputs(
        engines.casadi_(),
        MODEL.parameter_layout.instance(casadi.vertsplit(ps)),
        MODEL.input_layout.instance(casadi.vertsplit(us)),
    )
    f = casadi.Function("f", [ps, us], [casadi.vertcat(*symbols)])
    by_casadi = f(MODEL.parameter_layout.values(p), MODEL.input_layout.values(u)).full().ravel()
    np.testing.assert_allclose(by_casadi, by_math, rtol=1e-12, atol=1e-9)


def test_dual_slopes_are_casadis_derivatives():
    p, u = case(3)
    names = MODEL.input_layout.names
    us = casadi.SX.sym("u", len(names))
    ui = MODEL.input_layout.instance(casadi.vertsplit(us))
    xp = engines.casadi_()
    state = MODEL.shared(xp, p, ui, None)
    bias = MODEL.parts[0].equations(xp, p, ui, None, state).tau_bias
    gradient = casadi.Function("g", [us], [casadi.jacobian(bias, us)])
    exact = gradient(MODEL.input_layout.values(u)).full().ravel()
    slopes = MODEL.parts[1].equations(engines.MATH, p, u, None, MODEL.shared(engines.MATH, p, u, None))
    assert slopes.tau_bias_dphi == pytest.approx(exact[names.index("phi")], rel=1e-10)
    assert slopes.tau_bias_dw == pytest.approx(exact[names.index("w")], rel=1e-10)


def test_broadcasting_over_states_and_parameters():
    p, u = case(5)
    phi, w = np.linspace(0.0, 6.0, 7)[:, None], np.linspace(1.0, 5.0, 3)
    masses = np.linspace(0.0, 20.0, 4)[:, None, None]
    xp = engines.numpy_()
    loads = MODEL.input_layout.from_names({"phi": phi, "w": w, "left.material_mass": masses}, u)
    tau = MODEL.evaluate(xp, p, loads)[0].tau
    assert tau.shape == (4, 7, 3)
    one = MODEL.input_layout.from_names(
        {"phi": float(phi[2, 0]), "w": float(w[1]), "left.material_mass": float(masses[3, 0, 0])}, u
    )
    assert tau[3, 2, 1] == pytest.approx(MODEL.evaluate(engines.MATH, p, one)[0].tau, rel=1e-12)


def test_every_engine_has_exactly_the_names():
    made = [engines.MATH, engines.numpy_(), engines.casadi_(), engines.dual(engines.MATH)]
    assert all(set(vars(xp)) == set(engines.NAMES) for xp in made)


def test_dual_functions_against_differences():
    xp = engines.dual(engines.MATH)
    x, h = 0.37, 1e-6
    for name in ("sin", "cos", "sqrt", "asin", "acos", "abs"):
        f = getattr(xp, name)
        assert engines.slope(f(engines.Dual(x, 1.0))) == pytest.approx(
            (f(x + h) - f(x - h)) / (2 * h), rel=1e-8
        )
    d = engines.Dual(x, 1.0)
    assert engines.slope(xp.atan2(d, 2.0 - d)) == pytest.approx(
        (xp.atan2(x + h, 2 - x - h) - xp.atan2(x - h, 2 - x + h)) / (2 * h), rel=1e-8
    )
    assert engines.slope(xp.minimum(d, 0.2)) == 0.0 and engines.slope(xp.maximum(d, 0.2)) == 1.0
    assert engines.slope(xp.abs(-d)) == 1.0
    assert engines.slope(2.0 / d) == pytest.approx(-2.0 / x**2)
    assert engines.slope(3.0 - d * d) == pytest.approx(-2.0 * x)


@pytest.mark.parametrize(("a", "b"), [(1e17, 1.0), (0.1, 1e6), (float("inf"), 1.0), (-3.0, 2.0)])
def test_the_lesser_of_two_duals_is_one_of_them(a, b):
    xp = engines.dual(engines.MATH)
    lesser = xp.minimum(engines.Dual(a, 5.0), engines.Dual(b, 7.0))
    assert (engines.value(lesser), engines.slope(lesser)) == ((a, 5.0) if a < b else (b, 7.0))


def printed(model):
    """The functions of a model as printed Python, by name."""
    t = trace(model)
    derived = model.derive(engines.casadi_(), t.p) if model.derived_count else []
    names = vars(math) | vars(python_math)
    exec(python_text(kernels(t, derived, False, [v.name for v in outputs_of(model)])), names)
    return names


@pytest.mark.stages(second=4)
@pytest.mark.second
@pytest.mark.parametrize(
    "name",
    [
        *QUICK,
        *(n if n in OFTEN or n in MODELS else pytest.param(n, marks=pytest.mark.slow) for n in REST),
    ],
)
def test_printed_python_is_the_equations(name):
    """Outputs and derivatives at a thousand states, against numpy."""
    points = Points(name, 1000)
    model, functions = points.model, printed(points.model)
    p = model.parameter_layout.values(points.p)
    more = (functions["derive"](p),) if model.derived_count else ()
    states = [(p, u, x, *more) for u, x in zip(points.u.T.tolist(), points.x.T.tolist(), strict=True)]
    values, rates = points.by_numpy()
    outputs = outputs_of(model)
    assert np.isfinite(values).all()
    got = np.array([functions["values"](*state) for state in states]).T
    compare(got, values, [v.name for v in outputs], [v.unit for v in outputs])
    if layout := model.state_layout:
        got = np.array([functions["derivatives"](*state) for state in states]).T
        compare(got, rates, layout.names, [v.unit for v in layout.variables])


@pytest.mark.second
def test_what_is_printed_to_be_computed_once_has_no_errors():
    """As C: a later requirement may be undefined where an earlier one is not met."""
    assert python_math.Quotient(-1.0, 0.0) == python_math.Quotient(1.0, -0.0) == -math.inf
    assert math.isnan(python_math.Quotient(0.0, 0.0)) and python_math.Quotient(3.0, 2.0) == 1.5
    assert math.isnan(python_math.Sqrt(-1.0)) and python_math.Exp(1e4) == math.inf
    model = MODELS["KnifeDrive"]
    values = model.parameter_layout.values(model.parameter_layout.from_names({"r": 0.9}))
    functions = printed(model)
    derived = functions["derive"](values)
    value, low, high = np.reshape(functions["requirements"](values, derived), (-1, 3)).T
    assert np.isnan(derived).any() and not ((low < value) & (value < high)).all()
