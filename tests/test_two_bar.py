"""The error of two bars at rest, and the range in which they are good enough."""

from __future__ import annotations

import dataclasses
import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from papers.two_bar import loads, statement, two_bar_error

from chainunit import ChainUnitMachine

pytestmark = pytest.mark.second
EXAMPLES = Path(__file__).parents[1] / "examples"


@pytest.fixture(scope="module")
def comparison():
    return two_bar_error()


def test_two_bars_are_the_papers_statics():
    """Paper 000, Figs 17-22: left organ, divided by its weight, at psi = -12, 0, 12 deg."""
    for degrees, tangential, normal in (
        (-12.0, 0.0281, 0.3615),
        (0.0, 0.1360, 0.3240),
        (12.0, 0.2381, 0.2824),
    ):
        assert loads(0.6, 0.5, math.radians(degrees), (1, 1)) == pytest.approx((tangential, normal), abs=6e-5)


def test_the_packaged_organ_has_these_errors(comparison):
    """The same organ with its own lengths and masses (equal mass per length): 40 kg/m; two bars overstate R_t by a
    third in the middle, as the reference of the chain shows (100.86 against 76.94 N)."""
    machine = ChainUnitMachine()
    i, j = int(np.argmin(np.abs(comparison.mu - 0.6))), int(np.argmin(np.abs(comparison.zeta - 0.5)))
    weight = (machine.p.left.wall_mass + machine.p.left.web_mass) * machine.p.g
    bars = float(machine.chamber(0.0).left.tangential_load) / weight
    k = int(np.argmin(np.abs(comparison.psi)))
    assert comparison.load_t[i, j, k] + comparison.error_t[i, j, k] == pytest.approx(bars, rel=1e-5)
    assert comparison.error_t[i, j, k] / comparison.load_t[i, j, k] == pytest.approx(
        100.86 / 76.94 - 1.0, abs=2e-3
    )


def test_many_rods_have_none_of_it():
    for psi in (-0.2, 0.1):
        bars, chain = loads(0.6, 0.5, psi, (90, 36)), loads(0.6, 0.5, psi, None)
        assert bars == pytest.approx(chain, abs=2e-5)


def test_the_statement_is_that_of_the_table(comparison):
    lines = statement(comparison)
    for limit, line in zip((0.02, 0.05, 0.10), lines, strict=False):
        good = comparison.largest < limit
        assert f"good to {100 * limit:.0f} %" in line
        assert f"in {100.0 * good.sum() / np.isfinite(comparison.largest).sum():.0f} % of the range" in line
    hopeless = dataclasses.replace(comparison, error_t=comparison.error_t + 1.0)
    assert statement(hopeless)[0].startswith("Nowhere in the range are two bars good to 2 %")


def test_the_range_of_zeta_has_both_its_ends(comparison):
    """Two bars fail towards zeta = 1, too, where the organ is nearly straight."""
    for limit in (0.02, 0.05, 0.10):
        for row, ranges in zip(comparison.largest, comparison.good_zeta(limit), strict=True):
            good = [any(low <= zeta <= high for low, high in ranges) for zeta in comparison.zeta]
            assert good == (row < limit).tolist()
    first, last = comparison.good_zeta(0.10)[0], comparison.good_zeta(0.10)[-1]
    assert first[0][0] > 0.15 and first[0][1] < 0.95 and last[0][1] < first[0][1]
    assert "zeta" not in " ".join(statement(comparison)).replace("mu and zeta", "")


@pytest.mark.slow
def test_command(tmp_path):
    command = [sys.executable, "-m", "papers", "two-bar", tmp_path / "out"]
    process = subprocess.run(command, cwd=EXAMPLES, capture_output=True, text=True)
    assert process.returncode == 0, process.stderr
    assert {f.name for f in (tmp_path / "out").iterdir()} == {
        "two_bar_error.json", "two_bar_error.md", "two_bar_error.png", "report.html"
    }  # fmt: skip
    numbers = json.loads((tmp_path / "out" / "two_bar_error.json").read_text())
    assert numbers["error_t"]["unit"] == "1" and numbers["psi"]["unit"] == "rad"
    (low, high), *_ = numbers["good_zeta"]["10 %"]["mu = 0.70"]["value"]
    assert high < 0.85 and "│ 0.70 │" in process.stdout and f"{low:.2f} to {high:.2f}" in process.stdout
    assert all(line in " ".join(process.stdout.split()) for line in numbers["statement"])
