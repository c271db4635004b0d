"""A motor that the file gives is judged by its limits, as those that sizing tries are."""

from __future__ import annotations

import dataclasses
import math
import re

import numpy as np
import pytest
from event_tables import event_line
from records import changed

from chainunit import InputError
from chainunit.core.engines import MATH
from chainunit.core.quantities import variables
from chainunit.drives import induction_steady as induction
from chainunit.study.config import parse
from chainunit.study.judgement import motor_limits, motor_verdict
from chainunit.study.limits import SPEED_DEVIATION, heating, starting
from chainunit.study.readings import breakdown_speed
from chainunit.study.remarks import _on_inertia, _on_star
from chainunit.study.run import run_study
from chainunit.study.start_runs import StartNumbers
from chainunit.study.starts import StartFindings

STAR = """start = "star-delta"
event = []
[system]
machine = "ChamberForces"
motor = "IE3 4-pole 2.2 kW, 100L"
[run]
crank_speed = "30 rev/min"
turns = 1
[starter]
star_delta = { time = "%s" }
"""
KNIFE = f"""{event_line("dip", turns=1)}
empty_start = true
[system]
machine = "KnifeDrive"
motor = "IE3 4-pole 1.5 kW, 90L"
[feed]
cut_force = "14 kN"
[gear]
efficiency = 1
[run]
crank_speed = "40 rev/min"
step = "4 ms"
"""
CHAIN_UNIT = """
[motor]
armature = {{ R_th = {R_th} }}
[run]
ramp = 0.5
settle_turns = 1
step = "2 ms"
"""


JAM = event_line("jam_left", turns=1)


def studied(text, folder):
    study = run_study(parse(text), folder)
    assert study.findings.failure is None
    return study, motor_verdict(study), {each.code: each for each in study.findings.warnings}


@pytest.mark.slow
def test_a_motor_that_burns_in_steady_running_is_no_good(tmp_path):
    """It keeps the speed of a load that comes and goes, with 129 % of its rated current and no reserve of torque."""
    study, verdict, warnings = studied(KNIFE, tmp_path)
    steady, plate = study.runs.answers["steady"], study.setup.config.plate.nameplate
    assert study.runs.reaches and steady.current_share > 1.2 and steady.winding_temperature > 450.0
    assert verdict.holds == "false" and "keeps the crank" in verdict.text
    assert "its winding becomes too hot in steady running" in verdict.text
    assert verdict.limits["temperature"] > 1.5
    hot, current = warnings["motor-temperature"], warnings["motor-current"]
    assert hot.quantities["value"][0] == steady.winding_temperature and hot.quantities["limit"][0] == 393.15
    assert "(run.winding_temperature)" in hot.text and "a larger motor" in hot.text
    assert current.quantities["limit"][0] == plate.rated_current
    assert current.quantities["value"][0] == pytest.approx(steady.current_share * plate.rated_current)
    assert warnings["no-reserve"].quantities["over"][0] == -steady.torque_reserve > 0.1
    # steady running comes in each turn, a dip for a moment: one sentence, of the verdict as of the warning
    for when, where in (("in each turn", warnings["no-reserve"].text), ("for a moment", verdict.text)):
        assert re.search(rf"{when} its torque exceeds the pull-out torque by \d", where)
        assert "a moment the motor gives" not in where
    assert ". A heavier load or a dip of the voltage stalls it. " in warnings["no-reserve"].text


STALLED = """event = {events}
empty_start = true
[system]
machine = "KnifeDrive"
motor = "IE3 4-pole 1.5 kW, 90L"
[run]
turns = 2
"""


@pytest.mark.slow
def test_a_motor_below_its_breakdown_speed_stalls_under_the_load(tmp_path):
    """That is said in place of ratio and slip, and no state of overloads where there are none."""
    study, verdict, warnings = studied(STALLED.format(events="[]"), tmp_path)
    steady, motor = study.runs.answers["steady"], study.setup.drive.parameters
    missed = warnings["motor-below-pull-out"].text
    below = breakdown_speed(study.setup.drive, study.runs.steady)
    assert steady.speed_mean < 0.5 * below
    assert f"The motor stalls below its pull-out speed, {below:.2f} rad/s. " in missed
    assert "slip" not in missed and "verload" not in missed
    # there the torque is the largest of all speeds
    T, w = float(study.runs.steady["motor.stator.T"].mean()), below * study.setup.drive.ratio
    slower, there, faster = (induction.steady(MATH, motor, w * x, T=T).tau for x in (0.9, 1.0, 1.1))
    assert there > max(slower, faster)
    said = "in each turn its torque exceeds the pull-out torque by 100 % or more"
    assert said in verdict.text
    # it is stalled already
    assert warnings["no-reserve"].text.endswith(f"{said}. Take a larger motor or a heavier flywheel.")


@pytest.mark.slow
def test_a_motor_above_its_breakdown_speed_has_the_speed_of_ratio_and_slip(tmp_path):
    """Overloads start from there."""
    text = JAM + '[system]\nmotor = "IE3 4-pole 0.55 kW, 80M"\n[gear]\nratio = 55\n[run]\nturns = 1\n'
    missed = studied(text, tmp_path)[2]["speed-by-slip"].text
    assert "the speed that gear ratio and slip give. The overloads begin from this state." in missed
    assert "stalls" not in missed


@pytest.mark.slow
def test_the_permitted_temperature_of_a_dc_motor(tmp_path):
    """One that is badly cooled passes the permitted temperature, which the file may set."""
    study, verdict, warnings = studied(JAM + CHAIN_UNIT.format(R_th=60), tmp_path)
    T = study.runs.answers["steady"].winding_temperature
    assert T > 500.0 and verdict.holds == "false" and set(motor_limits(study)) == {"temperature"}
    assert warnings["motor-temperature"].quantities["value"][:2] == (T, "K")
    hot = JAM + CHAIN_UNIT.format(R_th=60).replace(
        "ramp = 0.5", f"ramp = 0.5\nwinding_temperature = {T + 1.0}"
    )
    _, verdict, warnings = studied(hot, tmp_path / "hot")
    assert verdict.holds != "false" and "too hot" not in verdict.text
    assert not any(kind.startswith("motor-") for kind in warnings)
    _, verdict, warnings = studied(JAM + CHAIN_UNIT.format(R_th=0.9), tmp_path / "cool")
    assert verdict.holds != "false" and "too hot" not in verdict.text
    assert not any(kind.startswith("motor-") for kind in warnings)


def test_sizing_has_the_permitted_temperature():
    assert parse("[sizing]\ntemperature = 400").permitted_temperature == ("sizing.temperature", 400.0)
    with pytest.raises(InputError, match=r"run.winding_temperature: is sizing.temperature"):
        parse("[sizing]\n[run]\nwinding_temperature = 400")


@pytest.mark.slow
def test_a_motor_that_fits_by_its_speed_keeps_it(tmp_path):
    """One limit for the choice and the verdict: behind the given gear the crank is 2.5 % too fast."""
    text = "event = []\n[sizing]\npoles_least = 4\npoles_most = 4\ncandidates = 1\n[gear]\nratio = 50.4\n"
    study, verdict, warnings = studied(text + "[run]\nturns = 1\n", tmp_path)
    check = study.findings.by_analysis["sizing"].chosen_candidate.checks["crank_speed"]
    assert 0.5 < check.utilisation < 1.0 and check.limit == SPEED_DEVIATION
    mean = study.runs.answers["steady"].speed_mean
    assert mean == pytest.approx(3.0 * (1.0 + check.value), rel=2e-3)
    assert verdict.holds == "true" and verdict.text.startswith(
        f"The motor keeps the crank at {mean:.2f} rad/s, {100.0 * (mean / 3.0 - 1.0):+.2f} % of 3 rad/s; "
    )
    assert not {"speed-missed", "speed-by-slip"} & set(warnings)


@pytest.mark.slow
def test_a_motor_whose_gear_misses_the_speed_starts_all_the_same(tmp_path):
    """Behind a gear for three quarters of the speed: the verdict speaks of the speed alone."""
    text = KNIFE.replace("1.5 kW, 90L", "3 kW, 100L").replace("efficiency = 1", "ratio = 49")
    study, verdict, warnings = studied(text, tmp_path)
    assert not study.runs.reaches and {"speed-missed", "speed-by-slip"} & set(warnings)
    assert 0.7 < study.runs.answers["steady"].speed_mean / study.setup.config.run.crank_speed < 0.8
    check = motor_limits(study)["start"]
    assert 0.0 < check.utilisation < 1.0 and check.value == study.runs.start.start_time
    assert "does NOT reach the speed" in verdict.text and "start takes too long" not in verdict.text


def test_surroundings_as_hot_as_the_winding_may_be_pass_the_limit():
    """Nothing is left to rise by: no division by zero, and no tick."""
    for ambient in (330.0, 340.0):
        check = heating(350.0, ambient, 330.0)
        assert check.utilisation == math.inf and "over 1000 times" in check.excess


def test_the_time_in_star_counts_a_third():
    """1/sqrt(3) of the current in each winding is a third of the heat."""
    plate = parse(STAR % "1 s").plate.nameplate
    check = starting(9.8, plate, in_star=8.0)
    assert check.value == pytest.approx(8.0 / 3.0 + 1.8) and "star" in check.title
    assert starting(3.0, plate, in_star=8.0).value == pytest.approx(1.0)
    assert starting(3.0, plate).value == 3.0 and starting(None, plate, in_star=8.0).value is None


def held_in_star(angles, star_speed):
    """Starts from these angles [deg] with that speed at the end of the time in star, others at nine tenths."""
    values = {v.name: 1.0 for v in variables(StartNumbers)}
    return StartFindings(
        tuple(
            StartNumbers(
                **values
                | {
                    "angle": math.radians(x),
                    "current": 600.0 + x,
                    "star_speed": star_speed if x in angles else 0.9,
                }
            )
            for x in (0.0, 90.0, 225.0)
        ),
        1.0,
        math.inf,
        "steady",
    )


@pytest.mark.second
def test_a_load_that_holds_the_motor_in_star_is_named(tmp_path):
    """A crusher stood for 8 s in star and then started direct; "more time in star" was the advice."""
    study = run_study(parse(STAR % "3 s"), tmp_path)
    for speed, codes in (
        (-0.001, ["stands-in-star"]),
        (0.3, ["star-too-short"]),
        (0.81, ["star-just-long-enough"]),
        (0.95, []),
    ):
        study.findings.by_analysis["starts"] = held_in_star((0.0, 225.0), speed)
        study.findings.remarks.clear()
        _on_star(study)
        assert [remark.code for remark in study.findings.remarks] == codes
        for remark in study.findings.remarks:
            size = remark.quantities["share"]
            if speed > 0.0:
                assert size.value == speed and remark.text.startswith("In a start from 0 deg ")
                assert "more time in star" in remark.remedy
                continue
            assert remark.text.startswith(
                "The load holds the motor in star from 2 of 3 angles (0 deg, 225 deg), "
            )
            assert "the change to delta takes 825 A" in remark.text
            assert remark.quantities["delta"].value == 825.0 and "empty_start" in remark.remedy
            assert size.value == 0.9
    # every start is held: no other angle is named
    study.findings.by_analysis["starts"] = held_in_star((0.0, 90.0, 225.0), 0.0)
    study.findings.remarks.clear()
    _on_star(study)
    assert "other angles" not in study.findings.remarks[0].text


@pytest.mark.second
def test_an_inertia_beyond_the_standard_is_a_warning(tmp_path):
    """0.04 P^0.9 p^2.5 of IEC 60034-12, by hand; it stood in the list of what is not checked alone."""
    study = run_study(parse(STAR % "3 s"), tmp_path)
    plate, whole = study.setup.plate.nameplate, study.setup.drive
    most = 0.04 * (plate.power / 1e3) ** 0.9 * (plate.poles / 2.0) ** 2.5
    inertia = float(np.mean(study.runs.steady["machine.J"])) + whole.fmu_parameters.rotor.J - plate.J
    for added, expected in (
        (0.0, inertia > most),
        (1.01 * most - inertia, True),
        (0.99 * most - inertia, False),
    ):
        drive = dataclasses.replace(whole, added_inertia=whole.added_inertia + added)
        heavier = changed(study, drive=drive, remarks=[])
        _on_inertia(heavier)
        assert [remark.code for remark in heavier.findings.remarks] == ["heavy-to-start"] * expected


@pytest.mark.slow
def test_a_change_to_delta_at_half_the_speed_is_warned_of(tmp_path):
    """The current jumps to that of a start direct on line, and the starter is good for nothing."""
    short, long = (run_study(parse(STAR % time), tmp_path / time[0]) for time in ("0.05 s", "3 s"))
    (warning,) = [each for each in short.findings.warnings if each.code == "star-too-short"]
    run, plate = short.runs.series["start_up"], short.setup.plate.nameplate
    share = float(np.interp(0.05, run["time"], run["motor.w"])) / plate.synchronous
    slowest = min(start.star_speed for start in short.findings.by_analysis["starts"].starts)
    assert warning.quantities["share"].value == pytest.approx(min(share, slowest)) and share < 0.8
    assert warning.quantities["delta"].value > 1.5 * plate.rated_current
    assert not [each for each in long.findings.warnings if each.code == "star-too-short"]
