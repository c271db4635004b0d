"""Overloads of a machine with chains: lumps on both strokes, and random ones in other processes."""

import pickle

import pytest

from chainunit.machines.flexible import flexible
from chainunit.machines.knife_drive import KnifeDrive
from chainunit.models import MODELS
from chainunit.study.config import parse
from chainunit.study.run import run_study

pytestmark = pytest.mark.second

SHORT = """organ = "chain"
[chain]
rods = 8
sweep_points = 0
[run]
ramp = 1
settle_turns = 1
step = "2 ms"
"""
LUMPS = """[[event]]
type = "jam"
side = "right"
force = "3 kN"
[[event]]
type = "jam"
name = "pulled"
side = "right"
force = "3 kN"
crank_angle = "180 deg"
"""


@pytest.mark.slow
def test_a_lump_that_the_web_folds_before_is_told(tmp_path):
    """On one stroke the lump pulls the web and loads the drive; on the other stroke the web folds."""
    study = run_study(parse(SHORT + LUMPS), tmp_path)
    peaks = {run: study.runs.answers[run].crank_torque_peak for run in ("steady", "jam_right", "pulled")}
    assert peaks["pulled"] > 2.0 * peaks["jam_right"] and peaks["jam_right"] < 1.1 * peaks["steady"], peaks
    remarks = [remark for remark in study.findings.warnings if remark.code == "lump-not-felt"]
    assert [remark.runs for remark in remarks] == [("jam_right",)]
    assert 'crank_angle = "180 deg"' in remarks[0].text


@pytest.mark.slow
def test_random_overloads_of_chains(tmp_path):
    study = run_study(parse("event = []\n" + SHORT + "[monte_carlo]\nruns = 2\nduration = 0.2\n"), tmp_path)
    assert study.findings.failure is None and "monte_carlo" in study.findings.by_analysis


@pytest.mark.parametrize(
    "model", [*MODELS.values(), flexible(3, 1), flexible(3, 1).direct(), KnifeDrive.direct()]
)
def test_a_model_reaches_another_process(model):
    assert pickle.loads(pickle.dumps(model)) is model
