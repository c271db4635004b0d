"""Parameters that are expressions of others, powers and exponentials in loads, and a list of groups."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from chainunit.core.engines import MATH, Dual, casadi_, dual, numpy_, slope
from chainunit.core.errors import InputError
from chainunit.machines.linkages.file import description_of
from chainunit.machines.linkages.model import machine_of
from chainunit.machines.machine import Machine
from chainunit.mechanism.expressions import expression
from chainunit.reading.tables import toml

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


def test_groups_may_be_listed_and_are_checked():
    assert json.loads(description_of(toml(PRESS + GROUPS), "press"))["groups"] == [["RRP", ["ram", "rod"]]]
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
