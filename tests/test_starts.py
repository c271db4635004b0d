"""Starts from several crank angles, what the gear carries in them, and what a setting means at a ram."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from records import like
from typer.testing import CliRunner

from chainunit.app import cli
from chainunit.capabilities.sizing import search as sizing
from chainunit.capabilities.sizing.candidate import Candidate, TrialResult
from chainunit.capabilities.sizing.preference import rank
from chainunit.core.quantities import Layout
from chainunit.drives.induction_steady import breakdown
from chainunit.machines.api import machine_of
from chainunit.machines.linkages.file import read_linkage
from chainunit.reading.results import as_data
from chainunit.study import config
from chainunit.study.choice import drive_of
from chainunit.study.coupling import rams
from chainunit.study.cycle import cycle
from chainunit.study.inverter import inverter_need, need_of
from chainunit.study.limits import Check
from chainunit.study.readings import crank_angle
from chainunit.study.rig import Rig
from chainunit.study.run import run_study
from chainunit.study.sections import Starter
from chainunit.study.start_runs import START_ANGLES, StartNumbers, speed_backwards, starts_from_all
from chainunit.study.starts import StartFindings, _with_own_limit
from chainunit.study.turn import TurnAnalysis, TurnFindings
from chainunit.study.verdict import shown_speed

LINKAGES = Path(__file__).parents[1] / "examples" / "linkages"
PUMP = f"""event = []
[system]
machine = "{LINKAGES / "pump_jack.toml"}"
motor = "IE3 4-pole 11 kW, 160M"
[run]
crank_speed = "8 rev/min"
turns = 1
settle_turns = 0
[gear]
ratio = 185
"""


# with its compensation a wheel swings, and with its boost an unloaded motor is overexcited at low frequency
PLAIN = "[starter]\ninverter = { slip = 0, boost = 0.005 }\n"
NONE = {v.name: None for v in Layout(StartNumbers).variables}


@pytest.fixture(scope="module")
def pump(tmp_path_factory):
    """A beam pump that starts direct on line."""
    return run_study(config.parse(PUMP), tmp_path_factory.mktemp("pump"))


@pytest.mark.second
def test_the_worst_start_is_named_with_its_angle(pump):
    """The start puts more on the gear than running does, and the worst is that of all angles; the electromagnetic
    transient, by which the gear was ordered, stands beside it."""
    assert pump.findings.failure is None
    found = pump.findings.by_analysis["starts"]
    peaks = [start.quasi_static for start in found.starts]
    assert len(peaks) == START_ANGLES and found.worst.quasi_static == max(peaks) > 1.02 * min(peaks)
    assert found.starts[0].gear_torque == pytest.approx(pump.runs.start.crank_torque_peak, rel=1e-6)
    steady = pump.runs.answers["steady"].crank_torque_peak
    assert found.running == pytest.approx(steady) and found.worst.quasi_static < 2.0 * steady
    assert found.transient == max(start.gear_torque for start in found.starts) > 2.0 * steady
    assert not [each for each in pump.findings.warnings if each.code.startswith("start-at-gear")]
    hard, warned = dataclasses.replace(found, running=0.4 * found.worst.quasi_static), []
    study = like(
        config=pump.setup.config,
        drive=pump.setup.drive,
        title_of=pump.runs.title_of,
        say=lambda code, *runs, **values: warned.append(values),
    )
    hard.remark(study)
    (numbers,) = warned
    assert numbers["torque"] == found.worst.quasi_static and numbers["over"] == pytest.approx(2.5)
    assert numbers["angle"] == found.worst.angle and numbers["most"] == found.transient
    assert "(an upper bound, as the shafts are rigid)" in numbers["transient"]


def test_a_start_of_a_wheel_by_hand(tmp_path):
    """A wheel without load: the motor runs through its pull-out torque M, of which the gear carries the share of the
    inertia behind it, i M JL/(JM + JL). The transient of the field puts far more on a rigid line."""
    file = tmp_path / "wheel.toml"
    file.write_text(
        "[ground]\nO = [0, 0]\n[driver]\nlink = 'wheel'\n[links.wheel]\npoints = { O = [0, 0], R = ['250 mm', 0] }\n"
        "mass = '50 kg'\ninertia = '20 kg m2'\n"
    )
    text = f"event = []\n[system]\nmachine = '{file}'\nmotor = 'IE3 4-pole 11 kW, 160M'\n[gear]\nratio = 29\n"
    given = config.parse(f"{text}[run]\ncrank_speed = '50 rev/min'\n")
    drive = drive_of(given)
    (start, *_) = starts_from_all(Rig(given.operation, drive, None), 1.0)
    p, at_motor = drive.fmu_parameters, 20.0 / 29.0**2
    pull_out = float(breakdown(p, 1.0, 50.0, p.ambient.T).tau)
    by_hand = 29.0 * pull_out * at_motor / (at_motor + p.rotor.J)
    assert start.quasi_static == pytest.approx(by_hand, rel=0.01)
    assert start.gear_torque > 1.8 * start.quasi_static


@pytest.mark.second
def test_a_start_from_an_angle_by_the_compiled_system(pump):
    """The same start by another route: one system with the motor's shaft at that angle, without FMUs."""
    worst, drive = pump.findings.by_analysis["starts"].worst, pump.setup.drive
    p = dataclasses.replace(drive.parameters, phi_start=worst.angle * drive.ratio)
    turned = dataclasses.replace(drive, parameters=p)
    with Rig(pump.setup.config.operation, turned, None).from_rest() as simulation:
        run = simulation.run(worst.start_time + 0.25, 1e-3)
    assert float(crank_angle(drive, run)[0]) == pytest.approx(worst.angle)
    inertia, rotor = run["machine.J"].values, drive.fmu_parameters.rotor
    # J a + tau_bias of the machine, and what the motor gives less its own inertia and friction
    by_machine = inertia * run["motor.a"].values + run["machine.tau_bias"].values
    by_motor = (
        run["motor.air_gap_tau"].values - rotor.J * run["motor.a"].values - rotor.d * run["motor.w"].values
    )
    for torque in (by_machine, by_motor / (1.0 + np.sign(by_motor) * drive.gear.loss)):
        assert float(np.max(np.abs(torque))) * drive.ratio == pytest.approx(worst.gear_torque, rel=0.02)


@pytest.mark.second
def test_a_start_with_the_limit_of_an_inverter_of_the_rated_current(tmp_path):
    """A heavy wheel cannot follow a short ramp; the start with the limit of an inverter of the rated current is run:
    it takes longer and keeps the limit."""
    file = tmp_path / "wheel.toml"
    file.write_text(
        "[ground]\nO = [0, 0]\n[driver]\nlink = 'wheel'\n[links.wheel]\npoints = { O = [0, 0], R = ['250 mm', 0] }\n"
        "mass = '50 kg'\ninertia = '300 kg m2'\n"
    )
    text = f"start = 'inverter'\nevent = []\n[system]\nmachine = '{file}'\nmotor = 'IE3 4-pole 3 kW, 100L'\n"
    given = config.parse(
        f"{text}[gear]\nratio = 29\n[run]\ncrank_speed = '50 rev/min'\nramp = '1 s'\n{PLAIN}"
    )
    drive = drive_of(given)
    rig = Rig(given.operation, drive, None)
    starts = starts_from_all(rig, 4.0)
    limited, limit = _with_own_limit(given.drive, rig, starts, 4.0)
    assert limit == 1.5 * drive.rated_current < starts[0].current
    assert max(start.current for start in limited) < 1.2 * limit
    assert limited[0].start_time > starts[0].start_time


def test_the_heat_of_a_relay_is_that_of_the_hardest_start():
    """The time at 7.2 times the rated current; a start that fails heats it for ever."""
    starts = tuple(StartNumbers(**NONE | {"start_time": 2.0, "relay_seconds": x}) for x in (0.4, 3.4, 1.0))
    assert StartFindings(starts, 1.0, math.inf, "steady").relay_seconds == 3.4
    stuck = StartFindings((*starts, StartNumbers(**NONE)), 1.0, math.inf, "steady")
    assert math.isinf(stuck.relay_seconds)


def test_the_inverter_is_ordered_by_all_starts_and_events():
    """By hand: a start from another angle takes 3.95 times the rated 6 A, the worst run of the study 2.3 times: 3.95
    x 6 A/1.5 = 15.8 A; the runs of the choice alone said 6 A."""

    def study(peaks, event, proposal=None, until_trip=()):
        starts = tuple(
            StartNumbers(**NONE | {"angle": 0.1 * k, "current": 6.0 * x, "long_current": 0.0})
            for k, x in enumerate(peaks)
        )
        record = like(
            drive=SimpleNamespace(rated_current=6.0),
            config=SimpleNamespace(drive=SimpleNamespace(start="inverter", starter=Starter())),
            start=SimpleNamespace(current_peak=11.8),
            answers={
                "steady": SimpleNamespace(current_peak=9.0, current_rms=4.0),
                "surge": SimpleNamespace(current_peak=6.0 * event),
            },
            by_analysis={
                "starts": StartFindings(starts, 1.0, math.inf, "steady"),
            },
            proposal=proposal,
            title_of=lambda name: name,
        )
        record.currents_until_trip = dict(until_trip)
        return record

    need = inverter_need(study((1.9, 3.95), 2.3))
    assert need.current == pytest.approx(15.8) and need.case == "a start from 5.73 deg"
    need = inverter_need(study((1.2, 1.3), 2.3, SimpleNamespace(inverter_current=6.0)))
    assert (need.current, need.case) == (pytest.approx(9.2), "surge")
    need = inverter_need(study((1.2, 1.3), 2.3, SimpleNamespace(inverter_current=9.5)))
    assert (need.current, need.case) == (9.5, "the runs of the choice")
    # the recommended torque limiter ends the surge: 136 A were ordered for a motor of 54 A
    need = inverter_need(study((1.2, 1.3), 2.3, until_trip={"surge": 12.6}))
    assert (need.current, need.case) == (pytest.approx(8.4), "surge, with the torque limiter")


@pytest.mark.parametrize(
    ("values", "case", "current"),
    [
        ((6.0, 5.0, [], {"start": 8.0}), "the rated current of the motor", 6.0),
        ((6.0, 6.5, [4.0], {"start": 8.0}), "the RMS current of running", 6.5),
        ((6.0, 6.5, [4.0, 7.0], {"start": 8.0}), "a start of more than 60 s", 7.0),
        ((6.0, None, [4.0, 7.0], {"start": 9.0, "running": 12.0}), "running", 8.0),
    ],
)
def test_each_current_may_decide_on_the_inverter(values, case, current):
    """The one rule for the runs of a choice and for those of a study."""
    need = need_of(*values, 1.5)
    assert (need.case, need.current) == (case, current)


@pytest.mark.parametrize(("factor", "passed"), [(1.0, True), (9.0, False)])
def test_the_gear_has_a_limit_of_its_own_in_a_start(pump, factor, passed):
    """gear.start_factor times gear.torque_limit; the study warns where a start passes it."""
    limit = 1.2 * pump.runs.answers["steady"].crank_torque_peak
    text = f"torque_limit = {limit}\nstart_factor = {factor}\n"
    given = config.parse(PUMP + text)
    assert given.drive.gear.start_limit == pytest.approx(factor * limit)
    found = dataclasses.replace(pump.findings.by_analysis["starts"], limit=given.drive.gear.start_limit)
    said = like(
        config=given,
        drive=pump.setup.drive,
        say=lambda code, *runs, **values: kinds.append((code.code, values)),
    )
    kinds: list[tuple[str, dict]] = []
    found.remark(said)
    assert [kind for kind, _ in kinds] == (["start-at-gear"] if passed else [])
    assert not passed or kinds[0][1]["limit"] == given.drive.gear.start_limit


def test_no_start_is_permitted_where_running_alone_is_too_hot():
    """The reason has words and no multiple of nothing, and such a motor does start."""
    words = "no start is permitted, as running alone is too hot"
    none = Check("starts per hour", 2.0, 0.0, "1", forbidden=words)
    assert none.over and none.excess == words and as_data(none)["forbidden"] == words
    assert Check("starts per hour", 0.0, 0.0, "1", forbidden=words).utilisation == 0.0
    (motor,) = [m for m in sizing.catalogue() if m.designation == "IE3 4-pole 0.55 kW, 80M"]
    drive = SimpleNamespace(added_inertia=0.0, ratio=50.0)
    hot = Check("rise of temperature", 100.0, 80.0, "K", "difference")
    lost = Check("time to start", None, 10.0, "s")
    first = Candidate(motor, drive, TrialResult({"start": lost, "starts": none}))
    second = Candidate(motor, drive, TrialResult({"temperature": hot, "starts": none}))
    candidates = [first, second]
    rank(candidates, larger=2.0)
    assert candidates[0] is second and second.reason.endswith(words) and "1000" not in second.reason
    assert first.reason == "it does not bring the machine up to speed in the permitted 10.0 s"
    drive.driver_noun = "crank"
    some = Candidate(motor, drive, TrialResult({"start": lost}, failed_angle=math.pi / 4.0))
    rank([some], larger=2.0)
    assert "up to speed from 0 deg, but not from 45.0 deg of the crank in the permitted" in some.reason


@pytest.mark.slow
def test_a_study_whose_crank_does_not_turn_ends_with_status_1(tmp_path):
    """Masses of a million kilograms: the crank stands, and that is said as a person writes it."""
    masses = "".join(f"{link} = {{ m = 1e6, I = 1e7 }}\n" for link in ("crank", "coupler", "rocker"))
    file = tmp_path / "heavy.toml"
    file.write_text(
        f"event = []\n[machine]\n{masses}[run]\nstep = 0.01\nsettle_turns = 0\nturns = 1\nramp = 0.1\n"
    )
    result = CliRunner().invoke(cli.app, ["study", str(file), "-o", str(tmp_path / "out")])
    assert result.exit_code == 1, result.output
    words = " ".join(result.output.split())
    assert "The motor does NOT reach the speed" in words and "10⁻" not in words.partition("Demands")[0]
    assert "The motor does not keep the speed asked for." in words


def test_a_crank_that_stands_has_no_speed_of_many_digits():
    assert shown_speed(5.39e-5, 3.0) == 0.0 and shown_speed(-5.39e-5, 3.0) == 0.0
    assert shown_speed(0.0711, 3.0) == 0.0711


def test_a_setting_at_the_ram_by_hand():
    """F = T/|ds/dphi|, with the way of a slider-crank in closed form; without limit at the dead centre."""
    machine = machine_of(read_linkage(LINKAGES / "slider_crank_press.toml"))
    speed = 2.0 * math.pi
    turn = cycle(machine, speed, machine.model.Feed(), 3600)
    study = like(
        drive=SimpleNamespace(machine=machine),
        config=SimpleNamespace(run=SimpleNamespace(crank_speed=speed)),
        by_analysis={TurnAnalysis.name: TurnFindings(turn, turn, None, None, {})},
    )
    (ram,) = rams(study)
    r, rod, offset = 0.08, 0.36, 0.025
    # crank pin (r cos, r sin), ram at x = offset below it: y = r sin - sqrt(l^2 - (r cos - offset)^2)
    across = r * np.cos(ram.angle) - offset
    lever = r * np.cos(ram.angle) - across * r * np.sin(ram.angle) / np.sqrt(rod**2 - across**2)
    assert ram.rate == pytest.approx(lever, abs=1e-9) or ram.rate == pytest.approx(-lever, abs=1e-9)
    torque = 200.0
    assert ram.least(torque) == pytest.approx(torque / np.max(np.abs(lever)))
    # where crank and rod are in line the ram is lowest or highest, and the lever is nothing
    low, high = math.acos(offset / (rod + r)), math.acos(offset / (rod - r))
    turned = [abs(math.remainder(ram.dead - each, 2.0 * math.pi)) for each in (-low, math.pi - high)]
    assert min(turned) < 1e-7
    assert ram.before(torque, 0.0) > 1e6 * ram.least(torque)
    # a hundredth of a degree before it the force is that of the slope of the lever there
    near, far = (ram.before(torque, math.radians(x)) for x in (0.01, 0.1))
    assert near == pytest.approx(10.0 * far, rel=1e-3)
    assert ram.before(torque, math.radians(10.0)) > 2.0 * ram.before(torque, math.radians(30.0))
    angle, way = ram.overloaded(torque)
    assert ram.before(torque, angle) == pytest.approx(2.0 * ram.working, rel=1e-6)

    def height(phi):
        return r * np.sin(phi) - np.sqrt(rod**2 - (r * np.cos(phi) - offset) ** 2)

    assert way == pytest.approx(abs(height(ram.dead) - height(ram.dead - angle)), rel=1e-4)
    assert ram.ram == "ram"


TRIPLEX = """
start = "inverter"
event = []
[machine]
linkage = "triplex_pump.toml"
[run]
crank_speed = "250 rev/min"
ramp = "5 s"
[system]
motor = "IE3 4-pole 30 kW, 200L"
[gear]
ratio = 6
efficiency = 0.98
"""


@pytest.mark.slow
def test_a_large_motor_has_the_boost_of_its_stator_and_does_not_hunt(tmp_path):
    """A triplex pump was ordered with a boost of 5 %: the motor turned back at 13.5 rad/s in its start, and took
    183 A, in silence."""
    source = str(Path(__file__).parent / "data" / "pump.toml")
    pump = config.parse(TRIPLEX, source)
    p, plate = drive_of(pump).parameters, pump.plate.nameplate
    assert p.inverter.boost == pytest.approx(
        p.stator.R * plate.rated_current / (400.0 / math.sqrt(3.0)), abs=5e-4
    )
    quiet = run_study(pump, tmp_path / "quiet")
    hunting = run_study(
        config.parse(f"{TRIPLEX}[starter.inverter]\nboost = 0.05\n", source), tmp_path / "hunting"
    )
    codes = [{remark.code for remark in study.findings.warnings} for study in (quiet, hunting)]
    assert "start-hunts" not in codes[0] and "start-hunts" in codes[1]
    (said,) = [remark for remark in hunting.findings.warnings if remark.code == "start-hunts"]
    run = hunting.runs.series["start_up"]["motor.w"].values
    assert said.quantities["backwards"].value >= -np.min(run) / plate.synchronous > 0.05
    assert "to 2.70 % for this motor" in said.remedy and p.inverter.boost == 0.027
    starts = [study.findings.by_analysis["starts"].starts for study in (quiet, hunting)]
    assert max(start.backwards for start in starts[0]) == 0.0
    assert max(start.current for start in starts[0]) < 0.6 * max(start.current for start in starts[1])


def test_a_load_that_turns_the_motor_back_at_first_is_no_hunting():
    """The counterweight of a beam pump turns the motor back for a tenth of a second."""
    p = SimpleNamespace(pole_pairs=2, supply=SimpleNamespace(f=50.0))
    drive, synchronous = SimpleNamespace(fmu_parameters=p), 50.0 * math.pi

    def backwards(*shares):
        return speed_backwards(drive, xr.Dataset({"motor.w": ("time", synchronous * np.array(shares))}))

    assert backwards(0.0, -0.03, 0.0, 0.5, 1.0) == 0.0
    assert backwards(0.0, -0.03, 0.1, -0.07, 1.0) == pytest.approx(0.07)
    assert backwards(0.0, -0.03, -1.0) == 0.0
