"""Means of steady running are those of a machine that repeats its turns: a heavy flywheel that still takes up energy
changes its speed by little, and its energy by much."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from records import like, record_of

from chainunit.reading.results import as_data
from chainunit.study.analyses import GearAnalysis
from chainunit.study.analysis import Work
from chainunit.study.catalogue_drive import catalogue_drive
from chainunit.study.config import parse
from chainunit.study.cycle import cycle
from chainunit.study.measures import read_answers, read_measure
from chainunit.study.readings import (
    breakdown_speed,
    crank_speed,
    energy_behind,
    energy_gap,
    energy_held,
    only_whole_turns,
    shaft_power,
)
from chainunit.study.remarks import _on_steady_running, _stall_speed, _why_missed
from chainunit.study.rig import Rig
from chainunit.study.start_up import StartUp, speeds_up, start_up
from chainunit.study.window import CLOSED, DRIFT, STORED, Phase, Window, drift, end_gap, is_settled

# the packaged mill at twice its lengths with 300 kg a side; the flywheel has 200 times the inertia of the rotor
MILL = """
start = "direct"
event = []
[system]
motor = "IE3 2-pole 0.55 kW, 71M"
[ratios]
rho = 0.1
lam = 0.6666666666666666
mu = 0.6
zeta = 0.5
l = "3 m"
l1 = "2.7 m"
[feed]
left = { material_mass = 300, processing_force = 10 }
right = { material_mass = 300, processing_force = 10 }
[gear]
ratio = 197
efficiency = 0.94
d = 1e-5
[flywheel]
J = 0.107
compare = []
[run]
crank_speed = "15 rev/min"
"""


@pytest.fixture(scope="module")
def mill():
    """The rig, the turn right after the start, the turn that a study evaluates, and one that is four turns later."""
    config = parse(MILL)
    bars = cycle(config.machine, config.run.crank_speed, config.feed)
    drive = catalogue_drive(config.drive, config.machine, bars, config.plate)
    drive = replace(drive, added_inertia=config.drive.flywheel.J)
    rig = Rig(config.operation, drive, None)
    with rig.from_rest() as simulation:
        start = start_up(rig, simulation, lambda time: None, {})
        later = simulation.run(simulation.time + 4.2 * config.operation.turn, rig.step)
    first = only_whole_turns(drive, start.run.sel(time=slice(9.5, None)), 1)
    told = only_whole_turns(drive, start.run.sel(time=slice(start.steady_from, None)), 1)
    last = later.sel(time=slice(later["time"][-1].item() - 1.1 * config.operation.turn, None))
    return rig, first, told, only_whole_turns(drive, last, 1)


def window(rig, turns, phase=Phase.STEADY):
    return Window(phase, turns, rig.drive, ("left", "right"), rig.operation.crank_speed)


def test_a_turn_counts_as_steady_once_its_flywheel_takes_up_little_energy(mill):
    rig, first, told, last = mill
    # by speed and torque alone the turn after the start is steady, while it takes up 3 % of the energy
    assert end_gap(rig.drive, first) < CLOSED and abs(drift(rig.drive, first)) < DRIFT
    assert energy_gap(rig.drive, first) > 0.02
    assert not is_settled(rig.drive, first)
    assert is_settled(rig.drive, told) and abs(energy_gap(rig.drive, told)) < STORED
    for name in ("power_mean", "supply_power_mean", "current_rms", "motor_torque_rms", "speed_ripple"):
        steady = read_measure(name, window(rig, last))
        assert read_measure(name, window(rig, told)) == pytest.approx(steady, rel=1e-3)


def test_mean_powers_are_those_of_steady_running_before_it_is_reached(mill):
    rig, first, _, last = mill
    for name, tolerance in (("power_mean", 5e-3), ("supply_power_mean", 1e-3)):
        steady = read_measure(name, window(rig, last))
        assert read_measure(name, window(rig, first)) == pytest.approx(steady, rel=tolerance)
    # the mean over the rows of that turn is 4 % above
    time, power = first["time"].values, first["motor.supply_power"].values
    raw = float(np.trapezoid(power, time) / (time[-1] - time[0]))
    assert raw > 1.035 * read_measure("supply_power_mean", window(rig, last))
    # an overload does not repeat its turns: there the mean is that of the rows
    assert read_measure("supply_power_mean", window(rig, first, Phase.EVENT)) == pytest.approx(raw)


def test_the_energy_that_is_held_grows_by_the_power_that_comes_in(mill):
    rig, first, _, _ = mill
    time = first["time"].values

    def over_turn(power):
        return float(np.trapezoid(power, time))

    held, behind = energy_held(rig.drive, first), energy_behind(rig.drive, first)
    w, p = first["motor.w"].values, rig.drive.fmu_parameters
    to_rotor = over_turn((first["motor.air_gap_tau"].values - first["motor.tau"].values - p.rotor.d * w) * w)
    to_rotor -= (1.0 / 0.94 - 1.0) * over_turn(np.abs(first["motor.tau"].values) * w)
    lost = first["machine.dissipated_power"].values
    to_machine = over_turn(shaft_power(rig.drive, first) - lost)
    assert behind[-1] - behind[0] == pytest.approx(to_machine, abs=0.05)
    assert held[-1] - held[0] == pytest.approx(to_rotor + to_machine, rel=0.01)
    share = (to_rotor + to_machine) / over_turn(np.abs(shaft_power(rig.drive, first)))
    assert energy_gap(rig.drive, first) == pytest.approx(share, rel=0.01)


def test_a_turn_that_never_settles_is_told_with_its_energy(mill):
    rig, first, told, _ = mill
    study = record_of(parse(MILL), rig.drive)
    study.runs.series["start_up"] = first

    def remarks(turns):
        names = ("speed_mean", "cycle_gap", "speed_drift", "energy_gap", "winding_temperature")
        answers = SimpleNamespace(**{name: read_measure(name, window(rig, turns)) for name in names})
        study.runs.answers["steady"] = answers
        study.findings.remarks.clear()
        _on_steady_running(study, answers)
        return [remark for remark in study.findings.warnings if remark.code == "energy-taken-up"]

    (remark,) = remarks(first)
    assert "still take up energy, over the evaluated turns 3.2" in remark.text
    assert remark.quantities["energy_gap"][0] == energy_gap(rig.drive, first)
    assert not remarks(told)


def test_the_loss_of_the_gear_stands_beside_the_net_power(mill):
    """By the turn at constant speed: the teeth lose their share of |power|, which is five times the net power."""
    rig, _, told, _ = mill
    study = record_of(parse(MILL), rig.drive)
    assert GearAnalysis.applies(rig.drive, {})
    assert GearAnalysis.find(study, Work(rig, lambda *_: None)) is None  # no steady running yet
    study.runs.series["start_up"], study.runs.started = told, StartUp(told, float(told["time"][0]), 0.0, rig)
    study.runs.answers["steady"] = SimpleNamespace(power_mean=read_measure("power_mean", window(rig, told)))
    findings = GearAnalysis.find(study, Work(rig, lambda *_: None))
    torque, w = study.setup.statics.normal.crank_torque, read_measure("speed_mean", window(rig, told))
    loss = findings.loss
    assert loss.by_load == pytest.approx((1.0 / 0.94 - 1.0) * np.mean(np.abs(torque)) * w, rel=0.03)
    assert loss.without_load == pytest.approx(1e-5 * (197.0 * w) ** 2, rel=1e-3)
    assert loss.net_power == pytest.approx(np.mean(torque) * w, rel=0.05)
    assert loss.whole == pytest.approx(loss.by_load + loss.without_load)
    assert loss.share == pytest.approx(loss.whole / loss.net_power)
    assert loss.share > 5.0 * (1.0 / 0.94 - 1.0) and loss.passed_power > 4.0 * loss.net_power
    findings.remark(study)
    (note,) = study.findings.notes
    assert note.quantities["share"][0] == loss.share
    assert note.quantities["efficiency"][0] == pytest.approx(0.94, rel=1e-12)
    assert "swings energy to and fro" in note.text
    assert note.quantities["without_load"].title == "loss without load (gear.d)"
    assert as_data(findings)["without_load"] == {"value": loss.without_load, "unit": "W"}
    # the warm motor of the energy turns more slowly: one number
    study.findings.by_analysis["energy"] = SimpleNamespace(gear_loss=0.99 * loss.whole)
    warm = GearAnalysis.find(study, Work(rig, lambda *_: None)).loss
    assert warm.whole == 0.99 * loss.whole and warm.by_load + warm.without_load == pytest.approx(warm.whole)


@pytest.fixture(scope="module")
def heavy(mill):
    """The rig with a flywheel three times as heavy, whose start is longer than the time for which a study waits, and
    its start-up."""
    rig = mill[0]
    drive = replace(rig.drive, added_inertia=3.0 * rig.drive.added_inertia)
    operation = replace(rig.operation, run=replace(rig.operation.run, step=4e-3))
    rig = Rig(operation, drive, None)
    with pytest.MonkeyPatch.context() as patch, rig.from_rest() as simulation:
        patch.setattr("chainunit.study.start_up.PATIENCE", 0.2)
        patch.setattr("chainunit.study.start_up._SETTLES", 1.0)
        return rig, start_up(rig, simulation, lambda time: None, {})


def test_a_start_that_has_not_ended_is_awaited(heavy):
    rig, started = heavy
    steady = window(
        rig, only_whole_turns(rig.drive, started.run.sel(time=slice(started.steady_from, None)), 1)
    )
    usual = rig.operation.stop + 1.0
    at_speed = started.run["time"].values[
        crank_speed(rig.drive, started.run) > 0.95 * rig.operation.crank_speed
    ]
    assert at_speed[0] > usual and started.steady_from > usual
    assert is_settled(rig.drive, steady.run) and steady.lasts
    assert read_measure("speed_mean", steady) == pytest.approx(rig.operation.crank_speed, rel=0.03)


def test_only_a_machine_that_comes_to_its_speed_speeds_up(heavy):
    rig, started = heavy
    assert speeds_up(rig, started.run.sel(time=slice(None, 16.0)))
    # by its rise it would come to its speed ten minutes after the ramp
    assert not speeds_up(rig, started.run.sel(time=slice(None, 16.0)), 600.0)
    assert not speeds_up(rig, started.run)
    # it has made no turn yet
    assert not speeds_up(rig, started.run.sel(time=slice(None, 2.0)))


def test_a_machine_that_speeds_up_is_not_called_stalled(heavy):
    rig, started = heavy
    early = started.run.sel(time=slice(8.0, 16.0))
    steady = window(rig, only_whole_turns(rig.drive, early, 1))
    answers = read_answers(steady)
    study = like(reaches=False, drive=rig.drive, steady=steady.run)
    assert answers.speed_mean < breakdown_speed(rig.drive, steady.run)
    assert _stall_speed(study.runs, answers) is None
    assert _why_missed(study.runs, answers).code == "start-does-not-end"
