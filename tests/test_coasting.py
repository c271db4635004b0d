"""The machine behind a torque limiter that opens: of the same kind as in the study, from its state then."""

from __future__ import annotations

import numpy as np
import pytest
from reports import report_of
from scipy.integrate import cumulative_simpson

from chainunit.study import config
from chainunit.study.drive_fmus import coasting_model, coasting_parameters
from chainunit.study.readings import crank_speed
from chainunit.study.rig import Rig
from chainunit.study.run import Runner, run_study
from chainunit.system import System, monolithic
from chainunit.system.graph import ModelComponent

pytestmark = pytest.mark.second

STUDY = """
organ = "{organ}"
[run]
crank_speed = 4
ramp = 0.4
settle_turns = 1
step = 0.002
[coupling]
trip_torque = {trip}
release_time = 0.001
[[event]]
type = "jam"
side = "left"
force = "4 kN"
turns = 1
{more}
"""
CHAIN = "[chain]\nrods = 4\nsweep_points = 0\n"
LINE = '[driveline]\nJ4 = 2\nc2 = 6000\nc3 = 6000\nd2 = 15\nd3 = 15\nalpha1 = "5 deg"\n'


@pytest.mark.parametrize(
    ("organ", "more", "trip"), [("chain", CHAIN, 250), ("two-bar", "", 250), ("chain", CHAIN + LINE, 250)]
)
@pytest.mark.slow
def test_it_goes_on_as_the_same_machine(organ, more, trip, tmp_path, monkeypatch):
    """Positions, speeds and energy do not jump as the coupling opens; from then on the loss of energy is its
    dissipation."""
    monkeypatch.setattr("chainunit.capabilities.chains.analysis.ChainAnalysis.find", lambda *_: None)
    text = STUDY.format(organ=organ, more=more, trip=trip)
    study = run_study(config.parse(text), tmp_path)
    assert study.findings.failure is None and study.runs.answers["jam_left"].coupling_trip_time is not None
    run, coasting = study.runs.series["jam_left"], study.runs.series["jam_left_coasting"]
    J4 = study.setup.drive.line.inertia
    own = {name for name in run if name.startswith("machine.")} & set(coasting)
    assert ("machine.left.theta_1" in own) == (organ == "chain")
    w = float(run["machine.w0"][-1])
    pairs = [(name, 0.0) for name in own if ".theta_" in name or ".omega_" in name or name.endswith("psi")]
    pairs += [("machine.kinetic_energy", 0.5 * J4 * w * w), ("machine.potential_energy", 0.0)]
    for name, added in pairs:
        size = max(0.3, abs(float(run[name][-1])))
        assert float(coasting[name][0]) == pytest.approx(float(run[name][-1]) + added, abs=1e-3 * size), name
    held = coasting["machine.kinetic_energy"] + coasting["machine.potential_energy"]
    losses = cumulative_simpson(
        coasting["machine.dissipated_power"].values, x=coasting["time"].values, initial=0
    )
    gap = held.values - held.values[0] + losses
    assert np.max(np.abs(gap)) < 5e-3 * np.max(losses)
    assert not [remark for remark in study.findings.notes if "two bars" in remark.text]
    answers = study.runs.answers["jam_left"]
    assert answers.energy_behind == pytest.approx(float(coasting["machine.kinetic_energy"][0]))
    if organ == "chain":
        return
    # the equations of the direct model, without its FMU
    model = coasting_model(study.setup.drive)
    start = model.start_from({"phi0": float(run["machine.phi0"][-1]), "w0": w})
    p = model.parameter_layout.from_names(coasting_parameters(study.setup.drive) | start)
    loads = study.setup.drive.loads(study.setup.config.feed)
    rig = Rig(study.setup.config.operation, study.setup.drive, {})
    (event,) = Runner(study, rig, print).events
    jam = rig.event_signals(event, study.runs.event_times["jam_left"], {})
    times = coasting["time"].values
    alone = System({"machine": ModelComponent(model, p)})
    exact = monolithic(alone, {**loads, **jam, "machine.tau": 0.0}, times)
    np.testing.assert_allclose(coasting["machine.w"], exact["machine.w"], atol=5e-4 * w)


def test_the_axis_of_time_ends_where_the_crank_stands(tmp_path, monkeypatch):
    """The run behind the open coupling lasts on: it took nine tenths of the figure of a jam, at rest."""
    monkeypatch.setattr("chainunit.capabilities.chains.analysis.ChainAnalysis.find", lambda *_: None)
    study = run_study(config.parse(STUDY.format(organ="two-bar", more="", trip=250)), tmp_path)
    assert study.findings.failure is None
    figure = next(each for each in report_of(study).figures if each.name == "time-jam-left")
    event, coasting = study.runs.event_times["jam_left"], study.runs.series["jam_left_coasting"]
    time, speed = coasting["time"].values - event, abs(crank_speed(study.setup.drive, coasting))
    stands = time[np.flatnonzero(speed > 0.02 * 4.0)[-1]]
    axis = figure.panels[0][0].x
    assert stands < axis.high < 2.0 * stands < 0.5 * time[-1]
    assert -axis.high < axis.low < 0.0
