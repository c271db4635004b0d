"""Parameters that are expressions of others, powers and exponentials in loads, and a list of groups."""

from __future__ import annotations

import contextlib
import math
import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from chainunit.core.engines import MATH, Dual, casadi_, dual, numpy_, slope
from chainunit.core.errors import InputError
from chainunit.machines.linkages.file import description_of, read_linkage
from chainunit.machines.linkages.model import machine_of
from chainunit.machines.machine import Machine
from chainunit.mechanism.expressions import expression
from chainunit.reading.tables import toml
from chainunit.report.drawing import drawing

PRESS = (Path(__file__).parents[1] / "examples" / "linkages" / "slider_crank_press.toml").read_text("utf-8")


def machine(text, **values):
    return Machine(machine_of(description_of(toml(text), "press")), values)


def test_a_parameter_may_be_an_expression_of_others_in_any_order():
    """It follows them, and is none of the FMU."""
    half = 'half = { value = "3 * r - quarter", description = "half the rod" }'
    lengths = f'l = "2 * half"\n{half}\nquarter = "60 mm"\n'
    derived = PRESS.replace("[inputs]", lengths + "[inputs]").replace(
        next(line for line in PRESS.splitlines() if line.startswith("l = ")), ""
    )
    plain, other = machine(PRESS), machine(derived)
    assert set(plain.model.parameter_layout.names) - set(other.model.parameter_layout.names) == {"l"}
    assert "quarter" in other.model.parameter_layout.names
    for r in (0.08, 0.09):
        one = machine(PRESS, l=2.0 * (3.0 * r - 0.06), r=r).outputs(0.7, 3.0, 1.0)
        two = other.replace({"r": r}).outputs(0.7, 3.0, 1.0)
        assert float(one.tau) == pytest.approx(float(two.tau), rel=1e-13)


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("exp(-x) * log(y)", math.exp(-1.3) * math.log(2.7)),
        ("y ** 1.4 + x ** 3", 2.7**1.4 + 1.3**3),
        ("x ** 0.5 / y", math.sqrt(1.3) / 2.7),
    ],
)
def test_powers_and_exponentials_in_every_engine(text, wanted):
    of = {"x": 1.3, "y": 2.7}
    assert expression(text).value(MATH, of) == pytest.approx(wanted, rel=1e-14)
    array = expression(text).value(numpy_(), {name: np.full(3, v) for name, v in of.items()})
    assert array == pytest.approx(wanted, rel=1e-14)
    xp = casadi_()
    import casadi

    x = casadi.SX.sym("x")
    f = casadi.Function("f", [x], [expression(text).value(xp, {"x": x, "y": 2.7})])
    assert float(f(1.3)) == pytest.approx(wanted, rel=1e-14)
    h = 1e-6
    near = [expression(text).value(MATH, of | {"x": 1.3 + k * h}) for k in (-1, 1)]
    by_dual = slope(expression(text).value(dual(MATH), of | {"x": Dual(1.3, 1.0)}))
    assert by_dual == pytest.approx((near[1] - near[0]) / (2.0 * h), rel=1e-8)


def test_the_pressure_of_a_gas_gives_back_its_work():
    """An adiabatic spring behind the ram: the torque by virtual work is minus the work of the gas by the angle."""
    gas = PRESS.replace(
        "[loads.pressing]",
        '[loads.gas]\non = "ram.C"\nforce = [0, "F0 * (d / (d - y - 0.2)) ** 1.4"]\n[loads.pressing]',
    )
    gas = gas.replace("[inputs]", 'F0 = "800 N"\nd = "100 mm"\n[inputs]')
    with_gas, without = machine(gas), machine(PRESS)
    q, h = 1.1, 1e-5

    def work(q):
        # of the force F0 (d/v)^1.4 over the way y, v = d - y - 0.2
        v = 0.1 - float(without.outputs(q).ram.C.y) - 0.2
        return 800.0 * 0.1**1.4 / 0.4 * v**-0.4

    more = float(with_gas.outputs(q).tau_bias) - float(without.outputs(q).tau_bias)
    assert more == pytest.approx(-(work(q + h) - work(q - h)) / (2.0 * h), rel=1e-7)


GROUPS = """
[[groups]]
kind = "RRP"
links = ["ram", "rod"]
"""


FAULTS = {
    "1/(1-1)": "1/(1-1) divides by zero",
    "table(y, sqrt(-1), 1, 2, 3)": "sqrt(-1) has no value, or an infinite one",
    "table(y, 0, 1, 2, 1e400)": "1e400 has no value, or an infinite one",
    "press_force * log(0)": "log(0) has no value, or an infinite one",
    "press_force * exp(1000)": "exp(1000) has no value, or an infinite one",
    "press_force * asin(2)": "asin(2) has no value, or an infinite one",
    "press_force * asin(50 * y / pressing_way)": "has no value, or an infinite one, at ",
    "press_force * exp(1e6 * abs(y / pressing_way))": "has no value, or an infinite one, at ",
    " + ".join(["press_force"] * 1500): "has letters",
    "+".join(["y"] * 1500): "has 1500 terms; must have <= 1000",
    "-" * 300 + "press_force": "is nested more than 100 times",
    "abs(" * 150 + "press_force" + ")" * 150: "is nested more than 100 times",
    "(" * 250 + "press_force" + ")" * 250: "is nested more than 100 times",
}


@pytest.mark.parametrize(("text", "words"), FAULTS.items(), ids=range(len(FAULTS)))
def test_an_expression_without_a_value_is_refused_at_its_key(text, words, tmp_path):
    words = words.replace("has letters", f"has {len(text)} letters; must have <= 10000")
    file = tmp_path / "press.toml"
    load = f'[loads.tool]\non = "ram.T"\nforce = [0, "{text}"]\n'
    file.write_text(PRESS.replace("[start]", f"{load}[start]"), "utf-8")
    with pytest.raises(InputError) as caught:
        read_linkage(file)
    (told,) = str(caught.value).splitlines()
    assert re.match(rf"{re.escape(str(file))}:\d+: loads\.tool\.force: ", told)
    assert words in told and len(told) < 600


def test_an_expression_is_read_once_whatever_is_in_its_widths():
    """The width of each step is a step: two ways down at each would never end."""
    text = "x"
    for _ in range(40):
        text = f"step(x, {text} + 1)"
    of = expression(text)
    assert len(of.widths) == 40 and of.names == ("x",)
    assert of.value(MATH, {"x": 0.0}) == 0.5


def test_parameters_that_double_are_read_once():
    """Each is the sum of the one before with itself, 60 times."""
    more = "".join(f'p{k} = "p{k - 1} + p{k - 1}"\n' for k in range(1, 61))
    text = PRESS.replace("[inputs]", f'p0 = "1 mm"\n{more}q = "p60 / 2 ** 12"\n[inputs]')
    line = next(line for line in PRESS.splitlines() if line.startswith("l = "))
    made = machine(text.replace(line, f'l = "{0.36 / 2.0**48 / 1e-3} * q"'))
    length = 0.36
    assert "p0" in made.model.parameter_layout.names
    values = made.model.described_by.values(MATH, made.p, made.model.Inputs())
    assert values["p60"] == pytest.approx(1e-3 * 2.0**60, rel=1e-14)
    assert values["l"] == pytest.approx(length, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("r * r / (r - r)", 'is "r * r / (r - r)", which has no value, or an infinite one, with r = 0.08'),
        ("sqrt(r * (r - 2 * r))", "has no value, or an infinite one, with r = 0.08"),
    ],
)  # fmt: skip
def test_a_parameter_without_a_value_is_refused_at_its_key(text, words):
    line = next(line for line in PRESS.splitlines() if line.startswith("l = "))
    with pytest.raises(InputError) as caught:
        machine(PRESS.replace(line, f'l = "{text}"'))
    assert str(caught.value).startswith("parameters.l: ") and words in str(caught.value)


DRUM = """
[parameters]
drag = "2 kN"
radius = "250 mm"
[ground]
O = [0, 0]
[driver]
link = "drum"
[links.drum]
points = { O = [0, 0] }
mass = "80 kg"
inertia = "3.2 kg m2"
[loads.belt]
type = "torque"
on = "drum"
torque = "-drag * radius * step(angle_rate, 0.1)"
"""


def test_a_driver_with_its_bearing_alone_is_drawn_as_a_disc():
    drum = machine(DRUM)
    assert float(drum.outputs(0.3, 6.283).tau) == pytest.approx(2000.0 * 0.25, rel=1e-12)
    picture = ElementTree.fromstring(drawing(drum))
    assert any(float(each.get("r")) > 20.0 for each in picture.iter("{http://www.w3.org/2000/svg}circle"))


WRONG = [
    [],
    {},
    ["crank", "rod"],
    [["a"]],
    {"a": ["b"]},
    10**400,
    math.nan,
    math.inf,
    "1e400 m",
    "1 / 0",
    True,
    "",
]


def places(table, path=()):
    for key, value in table.items() if isinstance(table, dict) else enumerate(table):
        yield *path, key
        if isinstance(value, dict | list):
            yield from places(value, (*path, key))


PLACES = list(places(toml(PRESS)))


@pytest.mark.parametrize("path", PLACES, ids=[".".join(map(str, each)) for each in PLACES])
def test_any_entry_of_another_kind_is_read_or_refused_in_lines(path):
    for wrong in WRONG:
        tables = toml(PRESS)
        inner = tables
        for key in path[:-1]:
            inner = inner[key]
        inner[path[-1]] = wrong
        with contextlib.suppress(InputError):
            description_of(tables, "press")


def test_groups_may_be_listed_and_are_checked():
    assert description_of(toml(PRESS + GROUPS), "press")["groups"] == [["RRP", ["ram", "rod"]]]
    machine(PRESS + GROUPS)
    machine(PRESS + GROUPS.replace('kind = "RRP"\n', ""))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (('"RRP"', '"RRR"'), "the links ram, rod form the group RRP, not RRR"),
        (('["ram", "rod"]', '["ram"]'), "ram is no group; the groups are RRP (rod, ram)"),
        (('["ram", "rod"]', '["ram", "rodd"]'), 'rodd is no link; was "rod" meant?'),
        (('"RRP"', '"RRPP"'), "kind"),
        (("kind", "sort"), "unknown key"),
    ],
)
def test_groups_that_are_wrong(change, words):
    with pytest.raises(InputError) as caught:
        machine(PRESS + GROUPS.replace(*change))
    assert words in str(caught.value)
