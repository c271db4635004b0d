"""Protection and mean loads against computations by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
import xarray as xr
from event_tables import HEAVY_MACHINE, event_line
from reports import said_of

from chainunit.drives.induction_motor import InductionMotor, steady
from chainunit.drives.motor import T_RATED
from chainunit.engines import MATH
from chainunit.machines.chain_unit import SIDES
from chainunit.report import blocks, terminal
from chainunit.report.sizing import _best
from chainunit.study import config, sizing
from chainunit.study.bearings import mean_load
from chainunit.study.coupling import coupling_sentence
from chainunit.study.drive import Drive
from chainunit.study.judgement import motor_verdict
from chainunit.study.protection import Obstacle, Setting, relay_trip, stall
from chainunit.study.result import as_dict
from chainunit.study.run import run_study
from chainunit.text import entry


def test_a_relay_of_class_10_trips_when_its_class_says():
    time = np.linspace(0.0, 12.0, 1201)
    assert relay_trip(time, np.full(1201, 7.2 * 5.0), 5.0, 0.0, 36.0) == pytest.approx(10.0, abs=0.011)
    # 1.05 times the setting never trips it, 1.2 times does
    assert relay_trip(time, np.full(1201, 5.25), 5.0, 0.0, 5.25) is None
    late = relay_trip(time, np.full(1201, 6.0), 5.0, 0.0, 6.0)
    assert late is not None and 12.0 < late < 7200.0
    # what has run before leaves it warm: sooner
    warm = relay_trip(time, np.full(1201, 36.0), 5.0, 5.0, 36.0)
    assert warm is not None and warm < 5.0


def test_a_stall_is_the_time_from_which_it_stands():
    time = np.linspace(0.0, 10.0, 1001)
    speed = np.where(time < 4.0, 3.0, 0.1)
    assert stall(time, speed, 3.0) == pytest.approx(4.0)
    assert stall(time, np.full(1001, 3.0), 3.0) is None
    assert stall(time, np.where(time < 9.5, 3.0, 0.0), 3.0) is None


def test_mean_load_by_hand():
    turned = np.linspace(0.0, 2.0 * math.pi, 100_001)
    assert mean_load(np.full(100_001, 7.0), turned) == pytest.approx(7.0)
    # F = F0 |sin a|: the mean of |sin|^3 is 4/(3 pi)
    got = mean_load(100.0 * np.abs(np.sin(turned)), turned)
    assert got == pytest.approx(100.0 * (4.0 / (3.0 * math.pi)) ** (1.0 / 3.0), rel=1e-6)
    # half the way at 1 N, half at 2 N
    force, way = np.array([1.0, 1.0, 2.0, 2.0]), np.array([0.0, 1.0, 1.0, 2.0])
    assert mean_load(force, way) == pytest.approx((0.5 * (1.0 + 8.0)) ** (1.0 / 3.0))
    assert mean_load(np.ones(3), np.zeros(3)) == 0.0


def test_a_setting_lies_between_normal_duty_and_what_opens_it():
    jam, blocked = {"jam_left": 400.0}, {"blocked": 900.0}
    result = Setting(normal=200.0, motor=600.0, gear=1000.0, overloads=jam | blocked | {"lumps": 230.0})
    assert result.torque == 250.0 and result.obstacle is None and result.opens == jam | blocked
    # what the motor cannot give, what the gear may not carry, and what no overload reaches
    for least, obstacle in (
        (Setting(500.0, 600.0, 1000.0, jam), Obstacle.MOTOR),
        (Setting(200.0, 600.0, 240.0, jam | blocked), Obstacle.GEAR),
        (Setting(350.0, 600.0, 1000.0, jam), Obstacle.OVERLOADS),
        (Setting(350.0, 600.0, 1000.0, {}), Obstacle.OVERLOADS),
    ):
        assert least.torque is None and least.obstacle is obstacle
    # with the inertia of rotor and flywheel a shock reaches more than the motor gives
    flywheel = Setting(500.0, 600.0, 1000.0, jam | blocked)
    assert flywheel.torque == 625.0 and flywheel.opens == blocked and flywheel.stalls and not result.stalls
    # a dip of the voltage that opens it is no protection
    dip = Setting(200.0, 600.0, 1000.0, {"jam_left": 240.0}, {"dip": 300.0})
    assert dip.obstacle is Obstacle.OVERLOADS and dip.opens == {} and dip.nuisances == {"dip": 300.0}


HEAVY = f"""{HEAVY_MACHINE}[sizing]
candidates = 1
fluctuation = 0.3
"""


MOTOR = "IE3 4-pole 1.1 kW, 90S"
SIX = ("feed_left", "feed_right", "jam_left", "jam_right", "blocked", "dip")


def heavy(*runs):
    return event_line(*runs, turns=1, force=6000.0) + HEAVY


def ran(text, folder, monkeypatch):
    """A study with the motor of 1.1 kW and 4 poles."""
    one = [m for m in sizing.catalogue(None) if (m.nameplate.power, m.nameplate.poles) == (1100.0, 4.0)]
    monkeypatch.setattr(sizing, "catalogue", lambda extra: one)
    return run_study(config.parse(text), folder)


def test_the_recommended_coupling_is_tried_in_its_own_study(tmp_path, monkeypatch):
    """With it, the study opens it in just those overloads that the recommendation names."""
    study = ran(heavy(*SIX), tmp_path, monkeypatch)
    result = study.setting
    assert result.torque is not None and not study.insufficient
    steady = study.answers["steady"].crank_torque_peak
    assert 1.2 * steady < result.torque < result.motor < study.start_torque
    message = coupling_sentence(study)
    assert "held shut in the start (coupling.held_in_start = true)" in message
    assert "softly" not in message
    # all feed on the right is normal duty, and its torque the larger
    assert result.normal > 1.15 * max(study.sizing.duty.numbers.torque_peak, 208.0)
    monkeypatch.undo()
    coupling = f"[coupling]\ntrip_torque = {result.torque}\n"
    open_start = ran(heavy(*SIX) + coupling, tmp_path, monkeypatch)
    monkeypatch.undo()
    assert "opens in the start-up" in str(open_start.failure)
    assert "coupling.held_in_start = true" in str(open_start.failure)
    coupling += "held_in_start = true\n"
    trials = ran(heavy(*SIX) + coupling, tmp_path, monkeypatch)
    assert trials.failure is None
    opened = {n for n, a in trials.answers.items() if a.coupling_trip_time is not None}
    assert set(result.opens) == {"jam_left", "jam_right", "blocked"} and set(result.nuisances) == {"dip"}
    assert opened == {*result.opens, *result.nuisances}
    assert "nuisance trip, which protects nothing: it opens, too, where the voltage" in message
    (nuisance,) = [warning for warning in trials.warnings if warning.kind == "nuisance trip"]
    assert "nuisance trip that protects nothing: the voltage dips." in nuisance.text and nuisance.runs == (
        "dip",
    )
    # it cuts off the peaks that would set it: no advice, and the stiffer stops without it
    assert trials.setting is None and set(as_dict(trials)["sizing"]["protection"]) == {"relay_current"}
    for name, peaks in study.spreads["blocked"].peaks.items():
        assert trials.spreads["blocked"].peaks[name] == pytest.approx(peaks, rel=1e-6), name
    (note,) = [note.text for note in trials.notes if note.kind == "assumption"]
    assert "These peaks are without the safety coupling" in note
    (warning,) = [warning.text for warning in trials.warnings if warning.kind == "coupling held shut"]
    assert "held shut in the start (coupling.held_in_start)." in warning
    # the same motor, named by the file, with the same coupling
    names = heavy(*SIX).partition("[sizing]")[0] + f'[system]\nmotor = "{MOTOR}"\n' + coupling
    values = run_study(config.parse(names), tmp_path)
    assert values.failure is None and {w.kind for w in values.warnings} >= {"coupling held shut"}
    assert {n for n, a in values.answers.items() if a.coupling_trip_time is not None} == opened


def test_without_a_shock_no_coupling_is_recommended(tmp_path, monkeypatch):
    study = ran(heavy("feed_left", "feed_right"), tmp_path, monkeypatch)
    assert study.setting.obstacle is Obstacle.OVERLOADS
    numbers = as_dict(study)["sizing"]["protection"]
    assert numbers["trip_torque"]["value"] is None and numbers["coupling"].startswith("No safety coupling")


def test_one_sided_feed_and_a_loaded_soft_start_are_normal_duty(tmp_path, monkeypatch):
    """Sizing has the torque of all feed on the right as the study has it, whatever side is the heavier. A start under
    load is no shock; what passes the gear is told."""
    text = 'start = "soft"\n' + heavy("feed_right", "start_loaded_left", "jam_right")
    study = ran(text + "[gear]\ntorque_limit = 450\n", tmp_path, monkeypatch)
    assert study.failure is None and not study.insufficient
    result = study.setting
    assert set(result.overloads) == {"jam_right"} and not result.disturbances
    start = float(abs(study.runs["start_loaded_left"]["motor.tau"]).max()) * study.drive.ratio
    assert result.normal == pytest.approx(max(start, study.sizing.best.peak_torque), rel=1e-3)
    fed = float(abs(study.runs["feed_right"]["motor.tau"]).max()) * study.drive.ratio
    assert study.sizing.best.duty_torque == pytest.approx(fed, rel=0.01)
    (warning,) = [warning for warning in study.warnings if warning.kind == "gear passed"]
    assert "the gear's permitted 450 N m" in warning.text and study.title_of("jam_right") in warning.text
    assert warning.runs == ("jam_right",) and warning.quantities["passed"] == (450.0, "N.m")


@pytest.mark.parametrize(
    ("protection", "ending"),
    [
        ({"trip_torque": (None, "N.m")}, "; flywheel 0.300 kg m²; no safety coupling; relay at 2.45 A."),
        ({"trip_torque": (400.0, "N.m")}, "; trip torque 400 N m; relay at 2.45 A."),
        ({}, "; thermal relay, setting 2.45 A."),
    ],
)
def test_the_protection_of_a_chosen_motor_is_told_once(protection, ending):
    """Where the file gives a coupling, there is no empty trip torque, and the relay stands once."""
    relay = {"relay_current": entry(2.45, "A") | {"title": "thermal relay, setting"}}
    source = blocks.Source(
        {
            "verdict": {"model": None},
            "sizing": {
                "candidates": [
                    {"motor": "M", "ratio": entry(50.0, "1"), "verdict": "chosen", "reason": "it fits"}
                ],
                "flywheel": {"J": entry(0.3, "kg.m2") | {"title": "flywheel"}},
                "protection": {
                    **{name: entry(*size) | {"title": "trip torque"} for name, size in protection.items()},
                    **relay,
                },
            },
        }
    )
    sentence = next(each for each in _best(source, "sizing.candidates.0", "Motor") if each.form == "short")
    assert terminal.plain_line(sentence.line).endswith(ending)


def test_an_insufficient_motor_gets_no_advice(tmp_path, monkeypatch):
    study = ran(heavy("jam_left") + "[gear]\ntorque_limit = 250\n", tmp_path, monkeypatch)
    assert study.insufficient and study.setting is None
    assert as_dict(study)["sizing"]["protection"] == {}
    text = said_of(study)
    assert "Insufficient motor:" in text and "relay at" not in text


def test_a_coupling_that_never_opens_gets_a_remark(tmp_path):

    def light(force):
        return event_line("jam_left", turns=1, force=force) + "[run]\nstep = 0.002\n"

    study = run_study(config.parse(light(2000) + "[coupling]\ntrip_torque = 5000\n"), tmp_path)
    (remark,) = [warning.text for warning in study.warnings if warning.kind == "coupling never opens"]
    assert "opens in no jam, lump or block" in remark
    # what the jam asks, and the motor's current limit times its torque constant through the gear
    assert f"{study.answers['jam_left'].crank_torque_peak:.0f} N m on it at most" in remark
    assert f"motor gives {4.4 * 1.27 * 50:.0f} N m at most" in remark
    study = run_study(config.parse(light(9000) + "[coupling]\ntrip_torque = 320\n"), tmp_path)
    assert study.answers["jam_left"].coupling_trip_time is not None
    assert any(w.kind == "coupling above motor" and "stalls the motor" in w.text for w in study.warnings)
    assert not any(warning.kind == "coupling never opens" for warning in study.warnings)


def test_a_motor_at_its_voltage_limit_has_no_reserve(tmp_path):
    """Asked for 30 rad/s, the DC motor turns the crank at an eighth of it: the voltage leaves no more torque."""
    text = "event = []\n[run]\ncrank_speed = 30\nstep = 0.002\nsettle_turns = 3\n"
    study = run_study(config.parse(text), tmp_path)
    result, p = study.answers["steady"], study.motor
    assert result.speed_mean < 5.0 and result.torque_reserve == 0.0
    verdict = motor_verdict(study)
    assert verdict["holds"] == "false" and "least reserve of torque 0 %" in verdict["text"]
    run = study.steady
    warm = p.armature.R * (1.0 + p.armature.alpha * (result.winding_temperature - T_RATED))
    left = p.armature.k * (p.limit.v - p.armature.k * run["motor.w"].values) / warm
    limit = np.minimum(left, p.armature.k * p.limit.i)
    driving = run["motor.air_gap_tau"].values * run["motor.w"].values > 0.0
    limits = study.drive.largest_torque(run, result.winding_temperature)
    assert limits[driving] == pytest.approx(limit[driving], rel=1e-6, abs=1e-6)
    assert np.min(limits) < 0.5 * p.armature.k * p.limit.i


def test_the_largest_torque_is_that_of_voltage_frequency_and_a_warm_winding():
    """On the line, in a dip and above the corner, against the largest of the torques over a thousand speeds."""
    p = InductionMotor.Parameters()
    T, volts, hertz = 380.0, np.array([400.0, 200.0, 400.0, 0.0]), np.array([50.0, 50.0, 90.0, 50.0])
    run = xr.Dataset(
        {
            "motor.v": ("time", volts),
            "motor.supply.frequency": ("time", hertz),
            "motor.w": ("time", np.full(4, 150.0)),
            "motor.air_gap_tau": ("time", np.full(4, 5.0)),
        },
        {"time": np.arange(4.0)},
    )
    drive = Drive(InductionMotor, p, config.load().machine)
    result = drive.largest_torque(run, T)
    for k in range(3):
        w = 2.0 * math.pi * hertz[k] / p.pole_pairs * np.linspace(0.0, 1.0, 1001)
        torques = [steady(MATH, p, float(x), volts[k] / 400.0, float(hertz[k]), T).air_gap_tau for x in w]
        assert result[k] == pytest.approx(max(torques), rel=3e-3)
    assert result[3] == 0.0 and result[1] < 0.3 * result[0] and result[2] < 0.5 * result[0]
    # warm less than cold, and behind friction less than at the air gap
    assert result[0] < drive.largest_torque(run, T_RATED)[0]
    assert drive.pull_out(run.isel(time=[0]), T) < result[0] * drive.ratio


def test_behind_an_open_coupling_the_machine_has_its_chains(tmp_path):
    """It goes on from the rods' angles and speeds at that instant, and its energy from there on is only lost."""
    text = """organ = "chain"
[coupling]
trip_torque = 350
[[event]]
type = "jam"
side = "left"
force = "6 kN"
[chain]
rods = 4
sweep_points = 0
"""
    study = run_study(config.parse(text), tmp_path)
    jam, coasting = study.runs["jam_left"], study.runs["jam_left_coasting"]
    rods = [f"machine.{side}.{x}_{k}" for side in SIDES for x in ("theta", "omega") for k in range(1, 5)]
    for name in ("machine.rocker.psi", "machine.kinetic_energy", "machine.potential_energy", *rods):
        # at a communication point the shaft's speed was just corrected: the rods' speeds are closed to it
        near = 1e-3 if "omega" in name or "kinetic" in name else 1e-6
        assert float(coasting[name][0]) == pytest.approx(float(jam[name][-1]), rel=near, abs=near), name
    energy = coasting["machine.kinetic_energy"] + coasting["machine.potential_energy"]
    assert float(energy[-1]) < float(energy[0]) - 1.0
    # what is in the machine is what was there less what was lost
    losses = np.trapezoid(coasting["machine.dissipated_power"], coasting["time"])
    assert float(energy[0] - energy[-1]) == pytest.approx(losses, rel=0.02)
    for side in SIDES:
        assert float(np.max(coasting[f"machine.{side}.drift"])) < 1e-6
        assert {f"A2 {side} web at rocker", f"B {side} hinge"} <= set(study.pins["jam_left"])


HELD = '[coupling]\ntrip_torque = "{trip} N m"\nheld_in_start = true\n[run]\nturns = 1\nsettle_turns = 1\n'


def held_shut(text, folder):
    """The study of a coupling that is held shut in the start, and its sentences on the coupling."""
    study = run_study(config.parse(text), folder)
    assert study.failure is None
    (messages,) = [remark for remark in study.remarks if remark.kind == "coupling held shut"]
    return study, messages


def largest(study, run, begin=0.0, end=None):
    """Largest torque of the motor in a run from `begin` to `end`, at the crank [N m]."""
    return float(abs(study.runs[run]["motor.tau"].sel(time=slice(begin, end))).max()) * study.drive.ratio


def test_a_coupling_is_needless_to_hold_only_where_no_start_would_open_it(tmp_path):
    """Also the starts under load run with it held shut."""
    starts = event_line("start_loaded_left", "start_loaded_right")
    study, message = held_shut(starts + HELD.format(trip=46), tmp_path)
    hardest = largest(study, "start_loaded_right")
    assert max(largest(study, "start_up"), largest(study, "start_loaded_left")) < 46.0 < hardest
    assert message.severity == "warning" and message.runs == ("start_loaded_right",)
    assert message.quantities["start"][0] == pytest.approx(hardest)
    assert f"start with all feed on the right ({hardest:.1f} N m)" in message.text
    assert "not needed" not in message.text and "all feed on the left" not in message.text
    study, message = held_shut(starts + HELD.format(trip=60), tmp_path / "needless")
    assert message.severity == "note" and "which is not needed" in message.text
    assert message.runs == ("start_loaded_right",) and "start with all feed on the right" in message.text


@pytest.mark.slow
def test_the_coming_of_the_feed_belongs_to_the_start_of_a_coupling(tmp_path, monkeypatch):
    """It puts more on the coupling than a recommended setting, and than one that is given."""
    empty = "empty_start = true\n" + event_line("jam_left", force=2000.0, turns=1)
    motor = '[system]\nmotor = "IE3 4-pole 0.55 kW, 80M"\n'
    study, message = held_shut(empty + motor + HELD.format(trip=60), tmp_path)
    first = largest(study, "start_up", end=study.fed_from)
    fed = largest(study, "start_up", study.fed_from, study.steady_begin)
    assert first > fed > 60.0
    assert study.start_torques == pytest.approx({"start_up": first, "settling": fed})
    assert message.severity == "warning" and message.runs == ("start_up", "settling")
    assert f"settling under the feed ({fed:.0f} N m)" in message.text
    one = [m for m in sizing.catalogue(None) if (m.nameplate.power, m.nameplate.poles) == (550.0, 4.0)]
    monkeypatch.setattr(sizing, "catalogue", lambda extra: one)
    sized = run_study(
        config.parse(empty + "[sizing]\ncandidates = 1\n[run]\nturns = 2\n"), tmp_path / "sized"
    )
    assert sized.failure is None and sized.setting.torque < min(sized.start_torques.values())
    assert set(sized.start_torques) == {"start_up", "settling"}
    message = coupling_sentence(sized)
    assert "settling under the feed" in message and "start-up" in message
