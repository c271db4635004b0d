"""A study that runs as one ODE of Model Exchange FMUs, beside the co-simulation and the models' own equations."""

from __future__ import annotations

import numpy as np
import pytest

from chainunit import InputError
from chainunit.study import config
from chainunit.study.line.shaft_runs import shaft_findings
from chainunit.study.run import run_study

pytestmark = pytest.mark.second

TEXT = """
simulation = "{simulation}"
[run]
crank_speed = 3
ramp = 0.5
settle_turns = 1
step = {step}
[[event]]
type = "jam"
side = "left"
turns = 1
[[event]]
type = "blocked"
turns = 1
[coupling]
trip_torque = {trip}
"""
TRIP = 250.0
WAYS = {"me": ("me", 0.004), "coarse": ("cs", 0.004), "fine": ("cs", 0.002)}


@pytest.fixture(scope="module")
def studies(tmp_path_factory):
    """The packaged chain unit: by Model Exchange, and by co-simulation with two steps."""
    studies = {}
    for name, (simulation, step) in WAYS.items():
        values = config.parse(TEXT.format(simulation=simulation, step=step, trip=TRIP))
        studies[name] = run_study(values, tmp_path_factory.mktemp(name), check=True)
        assert studies[name].findings.failure is None
    return studies


@pytest.mark.slow
@pytest.mark.parametrize("run", ["start_up", "jam_left", "blocked"])
@pytest.mark.parametrize("of", ["machine.tau", "motor.w"])
def test_me_is_near_the_equations_and_cs_comes_nearer_as_the_step_shrinks(of, run, studies):
    off = {
        name: study.runs.certificate[run][f"{of}_difference_to_monolithic"] for name, study in studies.items()
    }
    assert off["me"] < 1e-6
    if run != "jam_left":
        # in the jam the difference is that of the start-up before it
        assert off["me"] < 0.01 * off["fine"]
        assert 1.4 < np.log2(off["coarse"] / off["fine"]) < 2.6, off


@pytest.mark.slow
def test_answers_agree(studies):
    """Events that open no coupling: each run starts from the saved state."""
    for run in ("steady", "jam_left"):
        for name in ("crank_torque_peak", "crank_torque_rms", "speed_mean", "speed_least", "current_rms"):
            me, fine = (getattr(studies[way].runs.answers[run], name) for way in ("me", "fine"))
            assert fine == pytest.approx(me, rel=1e-3), (run, name)


@pytest.mark.slow
def test_the_coupling_opens_at_the_instant_at_which_its_torque_is_reached(studies):
    """In co-simulation the coupling opens at the end of the step in which the torque is reached."""
    limit = TRIP / studies["me"].setup.drive.ratio
    times = {}
    for name, study in studies.items():
        run, answers = study.runs.series["blocked"], study.runs.answers["blocked"]
        times[name] = answers.coupling_trip_time
        at = study.runs.event_times["blocked"] + times[name]
        before = run.sel(time=slice(None, at + 1e-9))
        torque = abs(before["motor.tau"].values)
        assert np.all(torque[:-1] < limit) and torque[-1] >= limit
        if name == "me":
            assert torque[-1] == pytest.approx(limit, rel=1e-9)
    for name in ("coarse", "fine"):
        assert 0.0 <= times[name] - times["me"] < WAYS[name][1] + 1e-3
    coasting = studies["me"].runs.series["blocked_coasting"]
    assert float(coasting["machine.w"][0]) == pytest.approx(
        float(studies["me"].runs.series["blocked"]["machine.w0"][-1])
    )


@pytest.mark.slow
def test_chains_and_a_line(tmp_path, monkeypatch):
    """A chain asks for events of its own; the twin with a rigid shaft runs in the same way."""
    monkeypatch.setattr("chainunit.capabilities.chains.analysis.ChainAnalysis.find", lambda *_: None)
    text = """
simulation = "me"
organ = "chain"
[chain]
rods = 2
[run]
crank_speed = 3
ramp = 0.3
settle_turns = 0.2
step = 0.004
[driveline]
J4 = 2
c2 = 6000
c3 = 6000
d2 = 15
d3 = 15
[[event]]
type = "jam"
side = "right"
turns = 1
"""
    study = run_study(config.parse(text), tmp_path, check=True)
    assert (
        study.findings.failure is None
        and shaft_findings(study.findings).answers["jam_right"].amplification > 0.0
    )
    for run in ("start_up", "jam_right"):
        shares = study.runs.certificate[run]
        assert shares["machine.tau_difference_to_monolithic"] < 1e-4
        assert shares["driveline_energy_residual_share"] < 1e-3


def test_what_is_not_for_model_exchange_is_refused(tmp_path):
    values = config.parse(TEXT.format(simulation="me", step=0.004, trip=TRIP))
    with pytest.raises(InputError, match=r'simulation = "me": .*must be FMI 2\.0 for Model Exchange'):
        run_study(values, tmp_path, backend="python")
    with pytest.raises(InputError, match=r'simulation = "mee": must be "cs" or "me"'):
        config.parse('simulation = "mee"')
