"""The damping of chains that a study file does not give follows from the organ."""

from __future__ import annotations

import numpy as np
import pytest

from chainunit.study.config import parse

SMALL = """[machine]
r = "60 mm"
l = "420 mm"
h = "380 mm"
e = "310 mm"
l1 = "510 mm"
l2 = "205 mm"
z = "320 mm"
hy = "380 mm"
c = "416 mm"
crank = { s = "20 mm" }
coupler = { s = "210 mm" }
rocker = { s = "190 mm" }
left = { wall_mass = 9, web_mass = 3.5 }
right = { wall_mass = 8, web_mass = 3 }
"""


def _damping_ratio(config):
    """Of the lowest mode, in parts that are equal for all machines: damping of a pin over inertia and frequency."""
    machine, chain = config.machine, config.table("chain")
    mode = machine.chain_modes().frequency[0]
    mass = machine.p.left.wall_mass + machine.p.left.web_mass
    size = mass * machine.p.l1**2 * mode
    return np.array([chain.end_damping, chain.eta / machine.p.l1]) / size


def test_organs_of_any_size_are_damped_alike():
    packaged, small = (parse(f'organ = "chain"\n{text}') for text in ("", SMALL))
    assert (packaged.table("chain").eta, packaged.table("chain").end_damping) == (0.24, 1.0)
    # the frequency grows as sqrt(g/l1), but for the shape of the organ
    np.testing.assert_allclose(_damping_ratio(small), _damping_ratio(packaged), rtol=0.25)


@pytest.mark.parametrize(("name", "other"), [("eta", "end_damping"), ("end_damping", "eta")])
def test_a_damping_that_is_given_stays(name, other):
    chain = parse(f'organ = "chain"\n{SMALL}[chain]\n{name} = 0.5\n').table("chain")
    assert getattr(chain, name) == 0.5 and 0.0 < getattr(chain, other) < 0.1
