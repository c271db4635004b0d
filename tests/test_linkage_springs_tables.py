"""Springs with dampers, and tables over the coordinate: the physics that they stand for."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from chainunit.core.engines import MATH, NAMES, Dual, casadi_, dual, numpy_, slope
from chainunit.core.errors import InputError
from chainunit.core.printing.operations import Operations
from chainunit.machines.linkages.file import description_of
from chainunit.machines.linkages.model import machine_of
from chainunit.machines.machine import Machine
from chainunit.mechanism.curves import TableCurve

R, L, K, FREE, C = 0.1, 0.4, 3000.0, 0.32, 45.0


def press(loads):
    """A light slider-crank in line along x, with loads."""
    return {
        "ground": {"O1": [0, 0], "X": [1, 0], "W": [0.7, 0.2]},
        "driver": {"link": "crank"},
        "links": {
            "crank": {"points": {"O1": [0, 0], "A": [R, 0]}},
            "rod": {"points": {"A": [0, 0], "B": [L, 0]}},
            "ram": {"points": {"B": [0, 0]}},
        },
        "joints": {"guide": {"on": "ram.B", "by": "ground.O1", "toward": "X"}},
        "start": {"phi": 0.5, "points": {"B": [0.45, 0]}},
        **loads,
    }


def machine(**loads):
    return Machine(machine_of(description_of(press(loads), "press")))


def ram(q, w):
    """Place and speed of the ram, from the textbook."""
    root = np.sqrt(L * L - (R * np.sin(q)) ** 2)
    return R * np.cos(q) + root, -R * np.sin(q) * w * (1.0 + R * np.cos(q) / root)


def sprung(**more):
    spring = {"type": "spring", "on": "ram.B", "by": "ground.W", "stiffness": K, "length": FREE, **more}
    return machine(loads={"spring": spring})


Q = np.linspace(-7.0, 7.0, 141)


def test_the_torque_of_a_spring_is_the_slope_of_its_energy():
    """Against the textbook's slider-crank: energy of the length, pull times its rate, damping in the square."""
    w = 3.0
    out = sprung(damping=C).outputs(Q, w, 0.0)
    x, v = ram(Q, w)
    length = np.hypot(0.7 - x, 0.2)
    rate = -(0.7 - x) * v / length
    np.testing.assert_allclose(out.potential_energy, 0.5 * K * (length - FREE) ** 2, rtol=1e-11)
    np.testing.assert_allclose(out.dissipated_power, C * rate**2, rtol=1e-10, atol=1e-12)
    power = K * (length - FREE) * rate + C * rate**2
    np.testing.assert_allclose(out.power, power, rtol=1e-10, atol=1e-10)
    # across the guide it pulls the ram with the part along y
    across = (K * (length - FREE) + C * rate) * 0.2 / length
    # and the rod presses it against the guide
    along = (K * (length - FREE) + C * rate) * (0.7 - x) / length
    leaning = along * R * np.sin(Q) / np.sqrt(L * L - (R * np.sin(Q)) ** 2)
    np.testing.assert_allclose(out.guide.normal, -across - leaning, rtol=1e-9, atol=1e-9)


def test_a_spring_at_its_free_length_is_slack():
    """Where it has its free length it does nothing, and from there on it resists either way."""
    q = np.array([0.4, 1.2, 2.0])
    for each in q:
        free = float(np.hypot(0.7 - ram(each, 0.0)[0], 0.2))
        out = sprung(length=free).outputs(np.array([each - 0.01, each, each + 0.01]), 0.0, 0.0)
        assert abs(float(out.tau[1])) < 1e-11
        assert out.tau[0] < 0.0 < out.tau[2]
        assert float(out.potential_energy[1]) < 1e-20


def test_a_spring_takes_no_energy_in_a_turn_and_a_damper_does():
    q = np.linspace(0.0, 2.0 * math.pi, 721)[:-1]
    work = 2.0 * math.pi * np.mean(sprung().outputs(q, 2.0, 0.0).tau)
    assert abs(work) < 1e-10
    damped = sprung(damping=C).outputs(q, 2.0, 0.0)
    assert 2.0 * math.pi * np.mean(damped.tau) == pytest.approx(
        math.pi * float(np.mean(damped.dissipated_power)), rel=1e-10
    )
    assert np.all(damped.dissipated_power >= 0.0)


def test_a_spring_between_two_links_is_one_seen_from_either():
    """Ends that are swapped give the same machine."""
    ends = [("crank.A", "ram.B"), ("ram.B", "crank.A")]
    results = []
    for on, by in ends:
        spring = {"type": "spring", "on": on, "by": by, "stiffness": K, "length": 0.1, "damping": C}
        results.append(machine(loads={"spring": spring}).evaluate({"phi": Q, "w": 2.0, "a": 1.0}))
    for name, value in results[0].items():
        np.testing.assert_allclose(results[1][name], value, rtol=1e-12, atol=1e-10, err_msg=name)
    # the rod keeps this length: a load within the machine, which the rod carries
    assert np.max(np.abs(results[0]["tau"])) < 1e-9
    pull = K * (L - 0.1)
    np.testing.assert_allclose(np.hypot(results[0]["B.fx"], results[0]["B.fy"]), pull, rtol=1e-9)


PLACES, VALUES = [0.3, 1.0, 1.8, 3.0, 4.1, 5.5], [2.0, 5.0, 5.0, -1.0, 0.0, 3.0]


def table(turns=True):
    return TableCurve(PLACES, VALUES, turns)


@pytest.mark.parametrize("turns", [True, False])
def test_a_table_goes_through_its_points(turns):
    for place, value in zip(PLACES, VALUES, strict=True):
        assert table(turns).value(MATH, place) == pytest.approx(value, abs=1e-13)


def test_a_table_repeats_itself():
    q = np.linspace(-9.0, 9.0, 1001)
    one = table().value(numpy_(), q)
    for turns in (-3, 1, 40):
        np.testing.assert_allclose(table().value(numpy_(), q + 2.0 * math.pi * turns), one, atol=1e-11)


@pytest.mark.parametrize("turns", [True, False])
def test_a_table_stays_between_its_points(turns):
    """No value beyond those of both ends of a piece: a load that is zero between two points is zero there."""
    places, values = PLACES + [PLACES[0] + 2.0 * math.pi] * turns, VALUES + VALUES[:1] * turns
    for k in range(len(places) - 1):
        inside = table(turns).value(numpy_(), np.linspace(places[k], places[k + 1], 101))
        low, high = sorted(values[k : k + 2])
        assert low - 1e-12 <= np.min(inside) and np.max(inside) <= high + 1e-12
        assert np.all(np.diff(inside) * (values[k + 1] - values[k]) >= -1e-12)


@pytest.mark.parametrize("values", [VALUES, [4.0, 5.0, 5.0, -1.0, 0.0, 3.0]], ids=["low", "rising"])
@pytest.mark.parametrize("turns", [True, False])
def test_the_slope_of_a_table_is_continuous(turns, values):
    """At its points as elsewhere; what dual numbers give is the difference quotient, at the points, too."""
    of, engine, h = TableCurve(PLACES, values, turns), dual(MATH), 1e-5

    def derivative(q):
        return slope(of.value(engine, Dual(q, 1.0)))

    ends = () if turns else (PLACES[0], PLACES[-1])
    for q in (*np.linspace(-4.0, 8.0, 301), *PLACES):
        quotient = (of.value(MATH, q + h) - of.value(MATH, q - h)) / (2.0 * h)
        assert derivative(float(q)) == pytest.approx(quotient, abs=2e-3), q
    for place in PLACES:
        before, after = derivative(place - 1e-9), derivative(place + 1e-9)
        assert before == pytest.approx(after, abs=1e-6)
        assert derivative(place) == pytest.approx(before, abs=1e-6), place
    for q in ends:
        assert derivative(q) == pytest.approx(0.0, abs=1e-6)


def test_beyond_its_ends_a_table_over_a_way_goes_on():
    of = table(turns=False)
    assert of.value(MATH, -5.0) == VALUES[0]
    assert of.value(MATH, 50.0) == pytest.approx(VALUES[-1], abs=1e-12)


@pytest.mark.parametrize("positive", ["clockwise", "counter-clockwise"])
def test_a_table_is_over_the_angle_of_the_driver(positive):
    """Not over that of the motor, and in its sense: with a gear of 5 the force at a fifth of the motor's angle."""
    loads = {
        "tables": {"share": {"phi": PLACES, "value": VALUES}},
        "parameters": {"f": "200 N"},
        "loads": {"push": {"on": "ram.B", "force": ["f * share", 0]}},
        "ratio": 5,
    }
    data = press(loads)
    data["driver"] = {"link": "crank", "positive": positive}
    if positive == "clockwise":
        data["start"]["phi"] = -0.5
    out = Machine(machine_of(description_of(data, "press"))).outputs(5.0 * Q, 10.0, 0.0)
    sign = -1.0 if positive == "clockwise" else 1.0
    speed = ram(sign * Q, sign * 2.0)[1]
    force = 200.0 * table().value(numpy_(), Q)
    np.testing.assert_allclose(out.load_power, force * speed, rtol=1e-10, atol=1e-9)
    np.testing.assert_allclose(out.tau * 10.0, -force * speed, rtol=1e-10, atol=1e-9)


def test_the_slope_in_an_fmu_is_right_at_the_points_of_a_table():
    """A turn that begins at a point of the table: symbols differentiate a size at zero as zero."""
    import casadi

    of = TableCurve(PLACES, [4.0, 5.0, 5.0, -1.0, 0.0, 3.0], True)
    q = casadi.SX.sym("q")
    derivative = casadi.Function("d", [q], [casadi.gradient(of.value(casadi_(), q), q)])
    for place in (*PLACES, PLACES[0] + 2.0 * math.pi):
        before, at, after = (float(derivative(place + h)) for h in (-1e-9, 0.0, 1e-9))
        assert before == pytest.approx(after, abs=1e-6)
        assert at == pytest.approx(before, abs=1e-6), place


def wild(turns, points=200):
    """A table with uneven places and jumping values."""
    rng = np.random.default_rng(5)
    places = np.sort(rng.uniform(0.0, 6.28, points))
    return TableCurve(list(places), list(rng.normal(0.0, 1e4, points)), turns)


@pytest.mark.parametrize("turns", [True, False])
def test_numbers_are_looked_up_in_a_table_and_symbols_say_the_same(turns):
    """Value and slope of floats, of arrays and of symbols; a number takes one piece, and not a sum over all."""
    import casadi

    of, symbol = wild(turns), casadi.SX.sym("q")
    lifted = of.value(dual(casadi_()), Dual(symbol, 2.0))
    value = of.value(casadi_(), symbol)
    traced = casadi.Function("f", [symbol], [value, casadi.gradient(value, symbol), lifted.v, lifted.d])
    calls = []

    def counted(name):
        return lambda *x: calls.append(name) or getattr(MATH, name)(*x)

    counting = SimpleNamespace(**{name: counted(name) for name in NAMES})
    q = np.linspace(-1.0, 8.0, 997)
    array = of.value(dual(numpy_()), Dual(q, 2.0))
    for k, each in enumerate(q):
        calls.clear()
        single = of.value(dual(counting), Dual(float(each), 2.0))
        assert len(calls) < 10
        by_symbol, by_gradient, by_lifted, slope_of_lifted = map(float, traced(each))
        values = [single.v, array.v[k], by_symbol, by_lifted, of.value(MATH, float(each))]
        slopes = [single.d, array.d[k], 2.0 * by_gradient, slope_of_lifted]
        assert values == pytest.approx([values[0]] * 5, rel=1e-9, abs=1e-7), each
        assert slopes == pytest.approx([slopes[0]] * 4, rel=1e-9, abs=1e-5), each


def test_a_point_of_a_table_adds_few_operations_to_an_fmu():
    """The slope, and its own derivative, take the piece that the value takes."""
    import casadi

    def count(points):
        q = casadi.SX.sym("q")
        both = wild(True, points).value(dual(casadi_()), Dual(q, 1.0))
        along = casadi.jtimes(casadi.vertcat(both.v, both.d), q, casadi.SX(1.0))
        items = Operations([q], [casadi.vertcat(both.v, both.d, along)]).items
        return sum(bool(each.operands) for each in items)

    assert count(200) - count(100) < 1400


def test_the_points_of_all_tables_are_counted_as_often_as_loads_take_them():
    """Each costs time in each step of an FMU and in its compiler."""

    def many(*force, **more):
        half = {"value": [0.0] * 100}
        over = {"x": [0.001 * k for k in range(100)]}, {"phi": [0.01 * k for k in range(100)]}
        tables = {"a": half | over[0], "b": half | over[1]}
        forces = {f"push{k}": {"on": "ram.B", "force": [each, 0]} for k, each in enumerate(force)}
        return description_of(press({"tables": tables, "loads": forces, **more}), "press")

    assert many("table(x, a) + b * b")
    for force in (["table(x, a) + table(y, a) + b"], ["table(x, a) + b", "b"]):
        with pytest.raises(InputError, match=r"brings the points of tables to 300.* at most 200"):
            many(*force)
    numbers = "table(r, " + ", ".join(f"{k}, 0" for k in range(101)) + ")"
    with pytest.raises(InputError, match=r"parameters.s: brings the points of tables to 201|loads.push0"):
        many("table(x, a) + b + s", parameters={"r": 1, "s": numbers})
