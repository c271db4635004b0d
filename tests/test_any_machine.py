"""A study of another machine than the chain unit has sizing and random overloads, too."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from reports import report_of

from chainunit import InputError
from chainunit.report.markdown import markdown
from chainunit.study.config import parse
from chainunit.study.result import as_dict
from chainunit.study.run import run_study

pytestmark = pytest.mark.slow

KNIFE = """
[system]
machine = "KnifeDrive"
[sizing]
fluctuation = 0.05
poles_least = 2
poles_most = 2
candidates = 1
[gear]
efficiency = 0.95
[run]
settle_turns = 8
turns = 1
[monte_carlo]
runs = 2
duration = 1
event = { type = "cut" }
[[event]]
type = "cut"
turns = 1
"""


@pytest.fixture(scope="module")
def sized(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sized")
    study = run_study(parse(KNIFE), folder)
    assert study.findings.failure is None
    return study, folder


def test_a_flywheel_makes_a_small_motor_fit_a_load_that_comes_and_goes(sized):
    study, _ = sized
    best = study.findings.by_analysis["sizing"].best
    assert study.findings.by_analysis["sizing"].chosen_candidate is best and best.drive.added_inertia > 0.0
    steady, ratio = study.runs.answers["steady"], study.setup.drive.ratio
    plate = best.motor.nameplate
    # without it the RMS torque of the turn alone asks for more than the motor has
    by_turn = study.setup.statics.cycles["normal running"].crank_torque / ratio
    assert np.sqrt(np.mean(by_turn**2)) > plate.torque > steady.motor_torque_rms > np.mean(by_turn)
    assert steady.speed_ripple <= study.setup.config.plans["sizing"].demands.fluctuation
    # it starts without a cut; it is judged once it has settled to its cuts
    settled = np.sqrt(np.mean(study.runs.steady["motor.air_gap_tau"].values ** 2))
    assert best.checks["rms_torque"].value == pytest.approx(settled, rel=0.01)
    # the duty has one feed, and no sides, nor is there a word on them
    assert not re.search(r"\bsides?\b", markdown(report_of(study), []))
    numbers = as_dict(study)
    assert "one_sided" not in numbers["sizing"]
    assert numbers["sizing"]["cycle"]["torque_peak_one_sided"]["value"] is None
    assert numbers["sizing"]["cycle"]["torque_peak"]["value"] == pytest.approx(
        np.max(np.abs(by_turn)) * ratio
    )


def test_random_overloads_of_a_machine_without_sides(sized):
    study, _ = sized
    random = study.findings.by_analysis.get("monte_carlo")
    runs = random.dataset
    assert random.runs == 2 and random.failures == 0 and random.sides == {}
    assert (runs["side"] == 0).all() and np.isnan(runs["rocker_torque_peak"]).all()
    assert ((runs["drawn_force"] >= 3e4) & (runs["drawn_force"] <= 1e5)).all()
    assert np.isfinite(runs["crank_torque_peak"]).all()
    assert len(json.dumps(as_dict(study), allow_nan=False)) > 1000


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (("candidates = 1", "one_sided_share = 0.2"), "sizing.one_sided_share: the KnifeDrive has no sides"),
        (("[run]", "[ratios]\nrho = 0.1\n[run]"), "ratios: is of the chain unit"),
        (('"KnifeDrive"', '"Knife"'), 'system.machine = "Knife": must be one of'),
    ],
)
def test_what_belongs_to_another_machine_is_refused(change, told):
    with pytest.raises(InputError) as caught:
        parse(KNIFE.replace(*change))
    assert told in str(caught.value)
