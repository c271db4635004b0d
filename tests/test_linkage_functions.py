"""Smooth functions, tables and extremes in the loads of linkage files: in every engine, with exact slopes."""

from __future__ import annotations

import math
import re
from itertools import pairwise
from pathlib import Path

import casadi
import numpy as np
import pytest

from chainunit.core.engines import MATH, Dual, casadi_, dual, numpy_, slope
from chainunit.core.errors import InputError
from chainunit.core.native.compilers import compiler
from chainunit.machines.linkages.file import description_of, read_linkage
from chainunit.machines.linkages.model import machine_of
from chainunit.machines.machine import Machine
from chainunit.mechanism.expressions import expression
from chainunit.reading.tables import toml

EXAMPLES = Path(__file__).parents[1] / "examples" / "linkages"
PRESS = (EXAMPLES / "slider_crank_press.toml").read_text("utf-8")
BODY, _, START = PRESS.partition("[loads.pressing]")
BODY = BODY.replace("pressing_way = ", "way = ")
START = "[start]" + START.partition("[start]")[2]


def machine(load, more="", **values):
    """The press with another load."""
    text = f"{BODY}\n[loads.tool]\n{load}\n{more}\n{START}"
    return Machine(machine_of(description_of(toml(text), "press")), values)


FUNCTIONS = [
    "step(x, 0.4)", "positive(x, 0.4)", "ramp(x, -0.3, 1.1)", "ramp(x, 0.9, 0.2)",
    "where(x > 0.1, 3 * x, -x**2, 0.3)",
    "where(x <= 0.1, 3, x, 0.3)", "table(x, -0.5, 0, 0.2, 3, 0.6, 2.5, 1, 4)",
]  # fmt: skip


@pytest.mark.parametrize("text", FUNCTIONS)
def test_every_engine_gives_one_value_and_one_slope(text):
    """Also where two pieces meet, far away, and of whole arrays."""
    f, at = expression(text), [*np.linspace(-1.0, 1.5, 251), -0.2, 0.2, 0.05, -0.05, 1e6, -1e6]
    values = [f.value(MATH, {"x": x}) for x in at]
    slopes = [slope(f.value(dual(MATH), {"x": Dual(x, 1.0)})) for x in at]
    assert f.value(numpy_(), {"x": np.array(at)}) == pytest.approx(values, rel=1e-12, abs=1e-12)
    x = casadi.SX.sym("x")
    value = f.value(casadi_(), {"x": x})
    symbols = casadi.Function("f", [x], [value, casadi.jacobian(value, x)])
    by_symbols = [[float(y) for y in symbols(each)] for each in at]
    assert [y for y, _ in by_symbols] == pytest.approx(values, rel=1e-12, abs=1e-12)
    assert [y for _, y in by_symbols] == pytest.approx(slopes, rel=1e-9, abs=1e-9)
    h = 1e-6
    near = [(f.value(MATH, {"x": x + h}) - f.value(MATH, {"x": x - h})) / (2.0 * h) for x in at[:-2]]
    assert near == pytest.approx(slopes[:-2], rel=1e-4, abs=1e-4)


def test_the_functions_are_exact_outside_of_their_width():
    def value(text, x):
        return expression(text).value(MATH, {"x": x})

    assert [value("step(x, 0.4)", x) for x in (-9.0, -0.2, 0.0, 0.2, 9.0)] == [0.0, 0.0, 0.5, 1.0, 1.0]
    assert [value("positive(x, 0.4)", x) for x in (-9.0, -0.2, 9.0)] == [0.0, 0.0, 9.0]
    assert value("positive(x, 0.4)", 0.2) == pytest.approx(0.2, rel=1e-15)
    assert [value("ramp(x, 1, 3)", x) for x in (0.8, 2.0, 3.2)] == pytest.approx([0.0, 0.5, 1.0], abs=1e-15)
    assert [value("ramp(x, 3, 1)", x) for x in (0.8, 2.0, 3.2)] == pytest.approx([1.0, 0.5, 0.0], abs=1e-15)
    assert [value("where(x < 0, 5, 7, 0.1)", x) for x in (-1.0, 1.0)] == [5.0, 7.0]
    assert [value("table(x, 0, 2, 1, 4)", x) for x in (-1.0, 0.0, 0.5, 1.0, 2.0)] == pytest.approx(
        [2.0, 2.0, 3.0, 4.0, 4.0], abs=1e-14
    )
    # positive is the integral of step
    x = np.linspace(-0.3, 0.3, 6001)
    area = np.sum(expression("step(x, 0.4)").value(numpy_(), {"x": 0.5 * (x[1:] + x[:-1])}) * np.diff(x))
    assert area == pytest.approx(value("positive(x, 0.4)", 0.3), rel=1e-7)


@pytest.mark.parametrize(
    ("force", "words"),
    [
        ("step(vy, 0)", "the width of step(vy, 0) is 0; must be > 0"),
        ("positive(y, -0.1) / way", "the width of positive(y, -0.1) is -0.1; must be > 0"),
        ("where(vy > 0, 1, 2, 0.1 - 0.3)", "the width of where(vy > 0, 1, 2, 0.1 - 0.3) is -0.2; must be > 0"),
        ("ramp(vy, 0.2, 2 * 0.1)", "the begin and the end of ramp(vy, 0.2, 2 * 0.1) must differ"),
        ("step(vy, 1 / (2 - 2))", "1 / (2 - 2) divides by zero"),
        ("step(y, way - 0.02)", "the width of step(y, way - 0.02) is -0.01; must be > 0 (way = 0.01)"),
        ("step(y, -stroke(y))", "the width of step(y, -stroke(ram.T.y)) is -0.16"),
        ("step(vy, 0.1 * vx)", "the width of step(vy, 0.1 * vx) changes with vx; must be a number or an expression"),
        ("step(vy, valve)", "the width of step(vy, valve) changes with valve; must be a number or an expression"),
    ],
)  # fmt: skip
def test_a_width_that_is_not_above_zero_is_refused_with_its_key(force, words, tmp_path):
    """Also one that follows from parameters, at their start values."""
    file = tmp_path / "press.toml"
    more = '[inputs.valve]\nvalue = "1 m/s"\n'
    used = "0 * press_force * valve / valve * way / way"
    load = f'[loads.tool]\non = "ram.T"\nforce = [0, "press_force * {force} + {used}"]\n'
    file.write_text(f"{BODY}\n{load}\n{more}\n{START}")
    with pytest.raises(InputError) as refusal:
        read_linkage(file)
    line = str(refusal.value)
    assert re.match(rf"{re.escape(str(file))}:\d+: loads\.tool\.force: ", line) and words in line


def test_a_width_of_parameters_stays_above_zero_when_they_change():
    """A falling ramp stays one that falls. The FMU has the same requirement."""
    m = machine('on = "ram.T"\nforce = [0, "press_force * step(y, way - 0.005) * ramp(y, 0.1, 0.1 - way)"]')
    assert [each.subject for each in m.model.required[-2:]] == [
        "width of step(y, way - 0.005) in loads.tool.force",
        "fall of ramp(y, 0.1, 0.1 - way) in loads.tool.force",
    ]
    assert m.replace({"way": 0.006}).p.way == 0.006
    with pytest.raises(InputError, match=r"width of step\(y, way - 0.005\) in loads.tool.force = -0.004"):
        m.replace({"way": 0.001})


def test_a_quantity_may_have_the_name_of_a_new_function():
    """Files of before have such names; a call is told from a name."""
    m = machine(
        'on = "ram.T"\nforce = [0, "stroke * step * step(-vy, 0.02) + 0 * press_force * way / table"]',
        BODY and '[parameters.stroke]\nvalue = "3 N"\n[parameters.step]\nvalue = "2 * stroke / stroke"\n'
        '[parameters.table]\nvalue = "1 m"\n',
    )  # fmt: skip
    assert np.min(m.outputs(np.linspace(0.0, 6.28, 99), 3.0).load_power) < 0.0


@pytest.mark.slow
def test_extremes_follow_the_lengths_in_every_kind_of_run():
    """In Python, over arrays, as symbols; against the closed form of the slider crank and against a fine turn."""
    m = machine(
        'on = "ram.T"\nforce = [0, "press_force * (max(y) - y) / stroke(y) + 0 * way * press_force / way"]'
    )
    fine = np.linspace(0.0, 2.0 * math.pi, 20001)
    for r, offset in ((0.08, 0.025), (0.13, -0.06)):
        own = m.replace({"r": r, "offset": offset})
        high, low = (-math.sqrt((0.36 + k * r) ** 2 - offset**2) - 0.12 for k in (-1.0, 1.0))
        assert own.p.derived == pytest.approx([high, low], rel=1e-13)
        y = own.outputs(fine).ram.T.y
        assert (np.max(y), np.min(y)) == pytest.approx((high, low), abs=1e-7)
        out = own.outputs(fine, 2.0)
        wanted = 20e3 * (high - out.ram.T.y) / (high - low) * out.ram.C.vy
        assert out.load_power == pytest.approx(wanted, rel=1e-9, abs=1e-6)
    values = {"phi": 4.0, "r": [0.06, 0.08, 0.13], "w": 2.0}
    several = m.batch(values, ["load_power", "tau_bias_dphi"], engine="native" if compiler() else "numpy")
    for k, r in enumerate((0.06, 0.08, 0.13)):
        one = m.replace({"r": r}).outputs(4.0, 2.0)
        assert float(several.load_power[k]) == pytest.approx(float(one.load_power), rel=1e-11)


def test_the_slopes_of_the_load_port_are_those_of_the_load():
    m = machine(
        'on = "ram.T"\nforce = [0, "press_force * step(min(y) + 5 * way - y, 0.02) * where(vy < 0, 1, 0.2, 0.3)"]'
    )
    h = 1e-6
    for q in (3.3, 4.0, 4.3, 4.6, 4.72, 5.2):
        at = [float(m.outputs(q + k * h, 2.0).tau_bias) for k in (-1, 1)]
        by_w = [float(m.outputs(q, 2.0 + k * h).tau_bias) for k in (-1, 1)]
        out = m.evaluate({"phi": q, "w": 2.0, **m.model.feed_layout.by_name(m.model.Feed())})
        assert (at[1] - at[0]) / (2.0 * h) == pytest.approx(float(out["tau_bias_dphi"]), rel=1e-5, abs=1e-3)
        assert (by_w[1] - by_w[0]) / (2.0 * h) == pytest.approx(float(out["tau_bias_dw"]), rel=1e-5, abs=1e-3)


def test_a_table_of_force_over_way_comes_from_a_file(tmp_path):
    """The work of a turn is the area of the table, in any of the spellings of a spreadsheet."""
    way, force = [0.0, 2.0, 4.0, 7.0, 10.0], [0.0, 12.0, 20.0, 18.0, 19.0]
    rows = list(zip(way, force, strict=True))
    texts = {
        "comma.csv": "way [mm], force [kN]\n" + "".join(f"{s},{f}\n" for s, f in rows),
        "semicolon.csv": "# measured\nWeg (mm);Kraft (kN)\n"
        + "".join(f"{s};{f}\n".replace(".", ",") for s, f in rows),
        "numbers.csv": "".join(f"{1e-3 * s}\t{1e3 * f}\n" for s, f in rows),
    }
    works = []
    for name, text in texts.items():
        # without units the table has numbers
        factor = "press_force / 20000" if name == "numbers.csv" else "press_force / (20 * kilo)"
        (tmp_path / name).write_text(text, "utf-8")
        load = (
            f'on = "ram.T"\nforce = [0, "{factor} * table(min(y) + way - y, measured) * step(-vy, 0.02) + 0 * kilo"]'
            f'\n[tables.measured]\nfile = "{name}"\n[parameters.kilo]\nvalue = "1 kN"'
        )
        file = tmp_path / "press.toml"
        file.write_text(f"{BODY}\n[loads.tool]\n{load}\n{START}", "utf-8")
        m = Machine(read_linkage(file))
        q = np.linspace(0.0, 2.0 * math.pi, 7201)
        works.append(-np.trapezoid(m.outputs(q, 60.0).load_power, q) / 60.0)
    assert works == pytest.approx([works[0]] * 3, rel=1e-12)
    assert works[0] == pytest.approx(np.trapezoid(force, way), rel=0.02)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "two or more rows"),
        ("1,2,3\n2,3,4\n", "each row must have two columns"),
        ("way [kg m], force [N]\n0,1\n1,2\n", "unit is not known"),
        ("0,1\n0,2\n", "x must rise"),
        ("0,1\n1,nothing\n", "is no number"),
        ('0,"1,200"\n1,"2,400"\n', '"1,200" is not clear'),
        ('0,"1,5"\n1,2\n', '"1,5" is not clear'),
        ("0;1,200\n1;12,400\n", '"1,200" is not clear'),
        ("0\t1,200\n0.5\t0,4\n", '"1,200" is not clear'),
        ("0;2\n1;1,200,000\n", "is no number"),
    ],
)
def test_wrong_tables_are_refused_with_the_file(text, words, tmp_path):
    (tmp_path / "bad.csv").write_text(text, "utf-8")
    load = 'on = "ram.T"\nforce = ["0 * way * press_force", "table(y, bad)"]\n[tables.bad]\nfile = "bad.csv"'
    (tmp_path / "press.toml").write_text(f"{BODY}\n[loads.tool]\n{load}\n{START}", "utf-8")
    with pytest.raises(InputError, match=r"tables\.bad") as caught:
        read_linkage(tmp_path / "press.toml")
    assert words in str(caught.value)


def test_a_torque_may_depend_on_the_angle_of_its_link():
    """A torsion spring on the rod: the torque of the crank gives back its energy."""
    m = machine(
        'type = "torque"\non = "rod"\ntorque = "-k * (angle - 4.5) + 0 * press_force * way"\n'
        '[parameters.k]\nvalue = "900 N m"'
    )
    bare = machine('type = "torque"\non = "rod"\ntorque = "0 * press_force * way"')
    q, h = np.linspace(0.0, 6.2, 32), 1e-5

    def energy(q):
        return 0.5 * 900.0 * (bare.outputs(q).rod.angle - 4.5) ** 2

    more = m.outputs(q).tau_bias - bare.outputs(q).tau_bias
    assert more == pytest.approx((energy(q + h) - energy(q - h)) / (2.0 * h), rel=1e-6, abs=1e-6)
    # of a link that turns round it goes on, and its extremes are refused
    round_ = machine('type = "torque"\non = "crank"\ntorque = "0 * way * press_force * sin(angle)"')
    assert float(round_.outputs(9.0).crank.angle) == pytest.approx(9.0, rel=1e-14)
    with pytest.raises(InputError, match="crank turns all the way round"):
        machine('type = "torque"\non = "rod"\ntorque = "0 * way * press_force * min(crank.angle)"')
    with pytest.raises(InputError, match="y is known in a force alone"):
        machine('type = "torque"\non = "rod"\ntorque = "0 * way * press_force * y"')


def test_the_stroke_of_an_angle_is_its_swing():
    m = machine('type = "torque"\non = "rod"\ntorque = "0 * way * press_force * stroke(angle)"')
    swing = m.outputs(np.linspace(0.0, 2.0 * math.pi, 20001)).rod.angle
    assert m.p.derived[0] - m.p.derived[1] == pytest.approx(np.ptp(swing), abs=1e-7)
    assert m.p.derived[0] - m.p.derived[1] == pytest.approx(
        math.asin((0.08 + 0.025) / 0.36) + math.asin((0.08 - 0.025) / 0.36), rel=1e-12
    )


PAGE = (EXAMPLES.parents[1] / "docs" / "linkages.md").read_text("utf-8")
PIECES = PAGE.partition("## Recipes")[2].partition("\n## ")[0].split("```toml\n")
RECIPES = {
    re.findall(r"\*\*([^*]+)\*\*", before)[-1]: behind.partition("```")[0]
    for before, behind in pairwise(PIECES)
}
STROKE = math.sqrt(0.44**2 - 0.025**2) - math.sqrt(0.28**2 - 0.025**2)
SWING = math.asin((0.08 + 0.025) / 0.36) + math.asin((0.08 - 0.025) / 0.36)
WORK = {
    "Press": 20e3 * 0.005,
    "Force over way": None,
    "Pump": 50e-4 * (12e5 + 0.2e5) * STROKE,
    "Spring": 0.0,
    "Gas spring": 0.0,
    "Ratchet": 30.0 * SWING,
}
"""The work of each recipe in a turn [J], where it has a closed form."""


@pytest.mark.parametrize("name", WORK)
def test_a_recipe_of_the_page_does_its_work(name):
    assert RECIPES.keys() == WORK.keys()
    body = re.sub(r"pressing_way = .*\n|way = .*\n|\[inputs\]\npress_force = .*\n", "", BODY)
    merged = toml(f"{body}\n{START}")
    for table, entries in toml(RECIPES[name]).items():
        merged[table] = merged.get(table, {}) | entries
    m = Machine(machine_of(description_of(merged, "recipe")))
    q = np.linspace(0.0, 2.0 * math.pi, 14401)
    out = m.outputs(q, 60.0)
    work = -np.trapezoid(out.load_power, q) / 60.0
    if name == "Force over way":
        # Hermite cubics between the points: the trapezoid of the table, and h^2/12 of the difference of the slopes
        assert work == pytest.approx(np.trapezoid([0.0, 20.0, 12.0, 0.0], [0.0, 1.0, 3.0, 5.0]), rel=0.05)
    else:
        assert work == pytest.approx(WORK[name], rel=2e-3, abs=1e-4)
    if name == "Gas spring":  # between two places of T it gives its mean force times the way
        bare = Machine(machine_of(description_of(toml(f"{body}\n{START}"), "bare"))).outputs(q, 60.0)
        given = bare.potential_energy - out.potential_energy
        apart = np.hypot(out.ram.T.x - 0.025, out.ram.T.y + 0.2)
        force = 700.0 + 180.0 * (0.6 - apart) / 0.48
        mean = 0.5 * (force + force[0])
        assert given - given[0] == pytest.approx(mean * (apart - apart[0]), rel=1e-9, abs=1e-9)
    if name == "Spring":  # on its way up the ram gives it the energy of 20 mm
        rising = out.ram.C.vy > 0.0
        assert -np.sum(out.load_power[rising]) * (q[1] - q[0]) / 60.0 == pytest.approx(
            0.5 * 40e3 * 0.02**2, rel=0.01
        )
