"""The reference points: an independent constrained-multibody solution in 40-digit arithmetic."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from chainunit import ChainUnitMachine

POINTS = json.loads((Path(__file__).parent / "data" / "chamber_forces.json").read_text())["points"]


def deviation(got: float, wanted: float) -> float:
    """Relative, or absolute where the wanted value is below 1."""
    return abs(got - wanted) / max(1.0, abs(wanted))


@pytest.mark.parametrize("point", POINTS, ids=lambda p: p["name"])
def test_python_api(point):
    machine = ChainUnitMachine(point["parameters"])
    outputs = machine.evaluate(point["inputs"])
    assert set(outputs) == set(point["outputs"])
    worst = {name: deviation(float(outputs[name]), reference) for name, reference in point["outputs"].items()}
    assert max(worst.values()) < 1e-9, max(worst.items(), key=lambda kv: kv[1])


def test_papers_statics():
    """Paper 000, Figs 17-22: left organ, divided by its weight, at psi = -12, 0, +12 deg."""
    machine = ChainUnitMachine.from_ratios(0.1, 2 / 3, 0.6, 0.5)
    weight = (machine.p.left.wall_mass + machine.p.left.web_mass) * machine.p.g
    left = machine.chamber(np.radians([-12.0, 0.0, 12.0])).left
    table = {
        "X": (left.rocker_joint.fx, [0.1027, 0.1360, 0.1742]),
        "Y_A2": (left.rocker_joint.fy, [0.3477, 0.3240, 0.3257]),
        "Y_A1": (left.support.fy, [0.6523, 0.6760, 0.6743]),
        "R_n": (left.normal_load, [0.3615, 0.3240, 0.2824]),
        "R_t": (left.tangential_load, [0.0281, 0.1360, 0.2381]),
    }
    for name, (got, reference) in table.items():
        np.testing.assert_allclose(got / weight, reference, atol=6e-5, err_msg=name)


def test_papers_extremes():
    (right, phi_right), (left, phi_left) = ChainUnitMachine.from_ratios(
        0.1, 2 / 3, 0.6, 0.5
    ).rocker_extremes()
    np.testing.assert_allclose(np.degrees([right, left]), [9.060, -8.194], atol=5e-4)
    np.testing.assert_allclose(np.degrees([phi_right, phi_left]), [89.57, 269.57], atol=5e-3)


def test_overload_factor_is_the_erratas():
    """Errata, paper 000, item 14: R_left/(R_left - R_right), static."""
    machine = ChainUnitMachine.from_ratios(0.1, 2 / 3, 0.6, 0.5)
    chamber = machine.chamber(np.radians([0.5, 1.0, 3.0, 6.0, 9.0, 12.0]))
    factor = chamber.left.tangential_load / chamber.rocker.tangential_load
    printout = ["16.3", "8.4", "3.1", "1.81", "1.36", "1.134"]
    assert [f"{x:.{len(text.split('.')[1])}f}" for x, text in zip(factor, printout, strict=True)] == printout


def test_papers_dynamics():
    """Errata, the table under paper 000: R_t of the left organ at the extremes, 10 and 50 rad/s."""
    for inertia, reference in ((0.0, [0.28, 5.50, -0.28, -12.12]), (1.0, [0.31, 6.16, -0.34, -13.63])):
        machine = ChainUnitMachine.from_ratios(0.1, 2 / 3, 0.6, 0.5, {"rod_inertia": inertia})
        weight = (machine.p.left.wall_mass + machine.p.left.web_mass) * machine.p.g
        (_, at_right), (_, at_left) = machine.rocker_extremes()
        out = machine.forces([at_left, at_left, at_right, at_right], [10.0, 50.0, 10.0, 50.0])
        np.testing.assert_allclose(out.left.tangential_load / weight, reference, atol=6e-3)


def test_pushed_speed_of_the_papers_machine():
    """The pull at A2 reaches zero near 7.5 rad/s, and the limit scales as 1/sqrt(l1)."""
    machine = ChainUnitMachine.from_ratios(0.1, 2 / 3, 0.6, 0.5, {"rod_inertia": 0.0})
    slack = machine.pushed_speed()
    assert slack == pytest.approx(7.5, abs=0.15)
    assert machine.least_web_pull(slack * 0.999) > 0.0 > machine.least_web_pull(slack * 1.001)
    small = ChainUnitMachine.from_ratios(0.1, 2 / 3, 0.6, 0.5, {"rod_inertia": 0.0}, l=0.15, l1=0.135)
    assert small.pushed_speed() == pytest.approx(slack * 10**0.5, rel=1e-6)
