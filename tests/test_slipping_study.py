"""Fluid coupling and V-belt in a study: their place in the drive, the values that follow, the refusals, and both
examples by hand."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from command import chainunit
from records import like, record_of
from scipy.optimize import brentq
from sizings import duty_by, trials_of

from chainunit import InputError
from chainunit.capabilities.checks.coupling import inertias
from chainunit.capabilities.energy.running import run_steadily
from chainunit.capabilities.handover.sizing import largest_load_inertia
from chainunit.capabilities.handover.studied import StudiedDrive
from chainunit.capabilities.sizing.alternatives import on_motor_side
from chainunit.capabilities.sizing.protection import Obstacle, Setting
from chainunit.core.engines import MATH
from chainunit.drives import v_belt
from chainunit.drives.belt import _diameters
from chainunit.drives.catalogue import motor_of_catalogue
from chainunit.drives.v_belt import bending, torques
from chainunit.reading.result_entries import ResultEntries
from chainunit.study import readings
from chainunit.study.analyses import GearAnalysis
from chainunit.study.choice import drive_of
from chainunit.study.config import parse
from chainunit.study.line.belt import BeltFindings
from chainunit.study.permitted_starts import starting_data
from chainunit.study.rig import Rig
from chainunit.study.torques import on_coupling
from chainunit.study.verdict import STEADY

EXAMPLES = Path(__file__).parents[1] / "examples"
MOTOR = "IE3 4-pole 0.37 kW, 71M"
MILL = f"""
event = []
[system]
motor = "{MOTOR}"
"""
POWER, SPEED = 370.0, 1424.0 * math.pi / 30.0


def drive(text):
    return drive_of(parse(MILL + text))


# -- the place in the drive


def test_the_ratio_makes_up_for_the_slip():
    """The motor turns the machine at the speed that is asked for, behind 3 % of slip at the rated torque."""
    bare, slipping = drive(""), drive("[fluid_coupling]\nrated_slip = '6 %'\n")
    p = slipping.line.parts[0].parameters
    assert (p.rated_power, p.rated_speed) == (POWER, pytest.approx(SPEED, rel=1e-12))
    lost = 1.0 - slipping.ratio / bare.ratio
    # the mean torque is a share of the rated one, and so is the slip
    mean = (1500.0 - bare.ratio * 3.0 * 30.0 / math.pi) / (1500.0 - 1424.0)
    assert lost == pytest.approx(0.06 * mean, rel=0.02) and lost > 0.002
    assert slipping.line.stall_torque == pytest.approx(2.0 * POWER / SPEED, rel=1e-9)


def test_a_belt_has_its_part_of_the_ratio_and_the_gear_the_rest():
    whole, split = drive("[gear]\nratio = 6\n[belt]\n"), drive("[gear]\nratio = 60\n[belt]\nratio = 4\n")
    # one belt has a ratio of 6, and then there is no gear that loses anything
    assert whole.line.ratio == 6.0 and whole.gear.loss == 0.0
    assert split.line.ratio == 4.0 and split.driven_machine.ratio == pytest.approx(15.0)
    # a gear of 15 has two stages of 98 %
    assert split.gear.loss == pytest.approx(1.0 / 0.98**2 - 1.0, rel=1e-12)
    p = split.line.parts[0].parameters
    assert p.distance == pytest.approx(5.0 * p.diameter, rel=1e-12)
    # the motor's pulley is a standard one
    assert p.diameter == 0.063


def test_the_gear_turns_with_the_driven_shaft():
    """Inertia, drag and loss of the gear, given at the motor's shaft, are those of the driven pulley."""
    gear = "[gear]\nratio = 60\nJ = 0.002\nd = 0.001\nefficiency = 0.9\n"
    bare, split = drive(gear), drive(gear + "[fluid_coupling]\n[belt]\nratio = 4\nJ_driven = 0.03\n")
    first, last = split.geared_line.parts
    assert (first.name, last.name) == ("fluid_coupling", "belt")
    assert first.parameters.gear.loss == 0.0 and last.parameters.gear.loss == pytest.approx(1.0 / 0.9 - 1.0)
    assert last.parameters.J_driven == pytest.approx(0.03 + 0.002 * 16.0, rel=1e-12)
    assert last.parameters.gear.d == pytest.approx(0.001 * 16.0, rel=1e-12)
    motor = split.fmu_parameters
    assert motor.gear.loss == 0.0 and motor.rotor == split.parameters.rotor
    # the inertia at the motor is that of rotor, gear and both parts
    belts = last.parameters.J_motor + 0.03 / 16.0
    wheels = first.parameters.J_motor + first.parameters.J_driven
    assert split.rotor_inertia == pytest.approx(bare.rotor_inertia + belts + wheels, rel=1e-12)


def test_a_study_without_such_a_part_has_the_gear_at_the_rotor():
    bare = drive("[gear]\nJ = 0.002\nd = 0.001\n")
    p = bare.fmu_parameters
    assert p.rotor.J == bare.parameters.rotor.J + 0.002 and p.rotor.d == bare.parameters.rotor.d + 0.001
    assert p.gear.loss == bare.gear.loss > 0.0 and bare.geared_line.parts == ()


# -- torques and inertias of both sides


def columns(time, **values):
    """A run with these variables, whose names have _ in place of the first dot."""
    shape = np.shape(time)
    return xr.Dataset(
        {name.replace("_", ".", 1): ("time", np.broadcast_to(x, shape)) for name, x in values.items()},
        {"time": time},
    )


WORM = "[gear]\nratio = 60\nefficiency = 0.7\nJ = 0.002\nd = 0.001\n"


def test_the_loss_of_a_gear_behind_a_belt_counts_once():
    """The torque of the motor's shaft, less the bending of the belt, comes to the crank through the gear alone."""
    belt = drive(WORM + "[belt]\nratio = 4\n")
    bend = bending(MATH, belt.line.parts[0].parameters)
    crank = (2.0 - bend) * belt.ratio * 0.7
    run = columns([0.0, 1.0], motor_tau=[1.0, 2.0])
    assert bend > 0.05 and on_coupling(belt, run) == pytest.approx(crank, rel=1e-12)
    assert belt.at_motor_shaft(crank) == pytest.approx(2.0, rel=1e-12)
    # the belt takes its load from the same shaft
    config = parse(MILL + WORM + f"[belt]\nratio = 4\n[coupling]\ntrip_torque = {crank}\n")
    guards = Rig(config.operation, drive_of(config), None).guards
    assert guards == {"motor.tau": pytest.approx(2.0, rel=1e-12)}
    # without a part that slips the motor's torque is the one behind the loss
    bare = drive(WORM)
    assert on_coupling(bare, run) == 2.0 * bare.ratio
    assert bare.at_motor_shaft(2.0 * bare.ratio) == pytest.approx(2.0 / 0.7)


def test_the_largest_torque_at_the_crank_is_without_the_bending_of_the_belt(monkeypatch):
    belt = drive(WORM + "[belt]\nratio = 4\n")
    p, run = belt.line.parts[0].parameters, columns([0.0, 1.0])
    monkeypatch.setattr(readings, "motor_pull_out", lambda *args: 1e3)
    # the driven pulley stands while the belt slips through at the rated speed of the motor
    _, passed = torques(MATH, p, p.rated_speed, 0.0)
    reached = passed * 15.0 * 0.7
    assert readings.pull_out_torque(belt, run, 300.0) == pytest.approx(reached, rel=1e-3)
    monkeypatch.setattr(readings, "motor_pull_out", lambda *args: 3.0)
    weak = (3.0 - bending(MATH, p)) * belt.ratio * 0.7
    assert readings.pull_out_torque(belt, run, 300.0) == pytest.approx(weak, rel=1e-12)


def test_a_coupling_before_the_flywheel_accelerates_what_is_on_the_rotor():
    """The gear behind the belt is not on the rotor: its inertia, drag and loss are in the torque of the shaft."""
    wheel = "[flywheel]\nJ = 0.01\n"
    belt, bare = drive(WORM + wheel + "[belt]\nratio = 4\n"), drive(WORM + wheel)
    run = columns([0.0, 1.0], motor_tau=2.0, motor_a=50.0, motor_w=100.0)
    assert on_motor_side(belt, run) == pytest.approx(belt.at_crank(2.0 + 0.01 * 50.0), rel=1e-12)
    more = (0.012 * 50.0 + 0.001 * 100.0) * 0.7
    assert on_motor_side(bare, run) == pytest.approx((2.0 + more) * bare.ratio, rel=1e-12)


def test_a_limiter_that_the_line_cannot_open_is_not_recommended():
    jam = {"jam": 400.0}
    assert Setting(200.0, 0.0, 600.0, 1000.0, jam, line=300.0).torque == 250.0
    slips = Setting(200.0, 0.0, 240.0, 1000.0, jam, line=240.0)
    assert slips.torque is None and slips.obstacle is Obstacle.MOTOR


def test_permitted_starts_count_what_the_motor_brings_to_its_speed():
    """Behind the fluid coupling the machine comes later: rotor and pump wheel, and the time of the motor alone."""
    coupled, plate = drive("[fluid_coupling]\nJ_motor = 0.003\nJ_driven = 0.5\n"), parse(MILL).plate.nameplate
    time = np.linspace(0.0, 4.0, 401)
    speed = 150.0 * np.minimum(time, 1.0)
    start = columns(time, motor_w=speed, motor_air_gap_tau=np.where(time <= 1.0, 5.0, 1.0))
    steady = columns([0.0, 1.0], machine_J=2.0)
    more = {"per_hour": 10.0, "bare": 1000.0, "current": 0.5}
    data = starting_data(coupled, plate, start, steady, **more)
    inertia = coupled.fmu_parameters.rotor.J + 0.003
    assert data.inertia == pytest.approx(inertia, rel=1e-12)
    assert data.motor_torque == pytest.approx(5.0, rel=1e-12)
    assert data.counter_torque == pytest.approx(5.0 - inertia * 150.0, rel=1e-9)
    # a belt brings the machine up with the motor
    belt = drive("[belt]\nratio = 4\n")
    data = starting_data(belt, plate, start, steady, **more)
    assert data.inertia == pytest.approx(
        float(belt.fmu_parameters.rotor.J + belt.whole_line.at_motor(2.0)), rel=1e-12
    )
    assert data.motor_torque == pytest.approx(2.0, rel=0.01)


def test_a_flexible_coupling_at_the_crank_has_pulleys_and_gear_before_it():
    belt, turns = drive(WORM + "[belt]\nratio = 4\nJ_driven = 0.03\n"), columns([0.0, 1.0], machine_J=0.4)
    before, behind = inertias(belt, turns, is_on_crank=True)
    assert behind == pytest.approx(0.4 * 15.0**2, rel=1e-9)
    p = belt.line.parts[0].parameters
    at_rotor = belt.parameters.rotor.J + p.J_motor + 0.002 + 0.03 / 16.0
    assert before == pytest.approx(at_rotor * belt.ratio**2, rel=1e-9)
    at_motor = inertias(belt, turns, is_on_crank=False)
    assert sum(at_motor) == pytest.approx((before + behind) / belt.ratio**2, rel=1e-12)
    assert at_motor[0] == belt.parameters.rotor.J


def test_the_handover_has_the_gear_behind_a_belt_once():
    def handed(**tables):
        entries = {"gear": {"J": {"value": 0.002}}, "flywheel": {"J": {"value": 0.01}}, **tables}
        return StudiedDrive(SimpleNamespace(data=entries), None, np.array([0.1, 0.3]), None, None)

    assert largest_load_inertia(handed()) == pytest.approx(0.312, rel=1e-12)
    assert largest_load_inertia(handed(belt={"ratio": {"value": 4.0}})) == pytest.approx(0.31, rel=1e-12)


def test_the_drag_of_a_gear_behind_a_belt_is_that_at_the_driven_speed():
    belt, bare = drive(WORM + "[belt]\nratio = 4\n"), drive(WORM)
    variables = {"belt_gear_loss": 90.0, "belt_driven.w": 30.0, "belt_power": 200.0, "belt_tau": 2.0}
    run = columns([0.0, 1.0], motor_w=150.0, motor_tau=2.0, machine_power=200.0, **variables)

    def without_load(turning):
        window = SimpleNamespace(mean=lambda reading: float(np.mean(reading(turning, run))), warm=300.0)
        study = like(
            drive=turning,
            steady=run,
            by_analysis={},
            answers={STEADY: SimpleNamespace(power_mean=200.0)},
            window=lambda *args: window,
        )
        return GearAnalysis.find(study, None).loss.without_load

    assert without_load(belt) == pytest.approx(0.001 * 16.0 * 30.0**2, rel=1e-12)
    assert without_load(bare) == pytest.approx(0.001 * 150.0**2, rel=1e-12)


# -- refusals


@pytest.mark.parametrize(
    ("text", "refusal"),
    [
        ("[driveline]\n[belt]\n", r"driveline: takes what is before it for rigid, and \[belt\] slips"),
        (
            "[fluid_coupling]\npeak_factor = 0.9\n",
            r"fluid_coupling.peak_factor = 0.9: must be >= 1.1 and <= 5",
        ),
        (
            "[fluid_coupling]\ntemperature = '150 degC'\n",
            r"fluid_coupling.plug_temperature = 413.15 K: must be > fluid_coupling.temperature",
        ),
    ],
)
def test_a_file_is_refused(text, refusal):
    with pytest.raises(InputError, match=refusal):
        parse(MILL + text)


def test_a_motor_without_nameplate_needs_the_rated_power():
    config = parse("event = []\n[fluid_coupling]\n")
    with pytest.raises(InputError, match=r"fluid_coupling.rated_power: is that of the motor's nameplate"):
        drive_of(config)
    given = parse("event = []\n[fluid_coupling]\nrated_power = '500 W'\nrated_speed = '150 rad/s'\n")
    assert drive_of(given).line.parts[0].parameters.rated_power == 500.0


def test_a_belt_that_is_too_slack_is_refused_with_its_least_tension():
    with pytest.raises(InputError, match=r"belt\.pretension = 20 N: the belt slips .*must be > "):
        drive("[gear]\nratio = 60\n[belt]\nratio = 4\npretension = 20\n")


def test_sizing_has_no_second_belt():
    with pytest.raises(InputError, match=r"belt: is the belt; take sizing.gear_kind"):
        parse("event = []\n[belt]\n[sizing]\ngear_kind = 'belt'\n")


# -- energy


@pytest.mark.second
def test_the_account_of_energy_closes_with_both_parts():
    """The electric power goes to motor, line, gear and machine; the gear, which turns with the belt, counts once."""
    config = parse(MILL + "[gear]\nratio = 52\nd = 0.0005\n[fluid_coupling]\n[belt]\nratio = 4\n")
    slipping = drive_of(config)
    load = run_steadily(Rig(config.operation, slipping, None), slipping, config.feed, None)
    losses = load.losses
    assert abs(losses.missing) < 2e-3 * losses.electric
    turns = load.turns
    heat = sum(np.mean(turns[f"{name}.dissipated_power"].values) for name in ("fluid_coupling", "belt"))
    assert (
        losses.gear == pytest.approx(np.mean(turns["belt.gear_loss"].values), rel=0.01) and losses.gear > 0.0
    )
    assert losses.line == pytest.approx(heat - losses.gear, rel=0.01) and losses.line > losses.gear


# -- the examples


def result_of(name, folder):
    process = chainunit("study", EXAMPLES / f"{name}.toml", "-o", "out", "--all", cwd=folder)
    assert process.returncode == 0, process.stderr
    result = ResultEntries(json.loads((folder / "out" / "result.json").read_text("utf-8")))
    with xr.open_dataset(folder / "out" / "result.nc", group="jam") as run:
        return result, run.load(), process.stdout


def verdict_of(result):
    """The clause on the machine that stands."""
    return result["verdict"]["motor"]["text"].removesuffix(".").split("; ")[-1]


@pytest.mark.second
def test_the_mill_with_a_fluid_coupling_by_hand(tmp_path):
    """The motor turns on while the mill is jammed: the coupling takes its stall torque at the speed of the motor."""
    result, jam, text = result_of("mill_with_fluid_coupling", tmp_path)
    rated, w_rated, w_0 = 15e3 / (1476.0 * math.pi / 30.0), 1476.0 * math.pi / 30.0, 1500.0 * math.pi / 30.0
    stall = 2.0 * rated
    # the slip of the motor in proportion to its torque
    w = w_0 - (w_0 - w_rated) * stall * 0.97 / rated
    torque = stall * (w / w_rated) ** 2
    assert float(jam["fluid_coupling.tau"][-1]) == pytest.approx(torque, rel=0.02)
    assert float(jam["motor.w"][-1]) == pytest.approx(w, rel=0.01)
    # the law itself, at the speed and slip of the run
    last = {name: float(jam[f"fluid_coupling.{name}"][-1]) for name in ("tau", "slip", "dissipated_power")}
    speed = float(jam["motor.w"][-1])
    b, s = 0.03 * 1.0 / (1.0 - 0.06), last["slip"] / speed
    assert last["tau"] == pytest.approx(stall * (1.0 + b) * s / (s + b) * (speed / w_rated) ** 2, rel=2e-3)
    assert last["dissipated_power"] == pytest.approx(torque * w, rel=0.03)
    assert abs(float(jam["fluid_coupling.driven.w"][-1])) < 0.02 * w
    findings = result["coupling_slip"]
    jammed, steady = findings["answers"]["jam"], findings["answers"]["steady"]
    assert findings["stall_torque"]["value"] == pytest.approx(stall, rel=1e-9)
    assert jammed["plug_time"]["value"] == pytest.approx(40e3 * 70.0 / (torque * w), rel=0.03)
    assert jammed["heat"]["value"] == pytest.approx(
        np.trapezoid(jam["fluid_coupling.dissipated_power"], jam["time"]), rel=0.02
    )
    assert steady["slip_mean"]["value"] == pytest.approx(0.018, rel=0.03)
    assert verdict_of(result) == "the rotor stands after crushing rises (jam)"
    assert "fusible plug" in text and "IEC 60034-12" not in text
    assert all(x["value"] < 1e-3 for x in result["certificate"]["jam"].values())


@pytest.mark.second
def test_the_belt_that_slips_by_hand(tmp_path):
    """Grip, slip and forces on the shafts; in the jam the motor keeps its speed and the belt slips through."""
    result, jam, text = result_of("belt_slips", tmp_path)
    w, r = 1476.0 * math.pi / 30.0, 0.1
    wrap = math.pi - 2.0 * math.asin(0.5 * 0.2 / 1.2)
    m, tension = math.exp(0.92 * wrap), 900.0 - 0.6 * (r * w) ** 2
    bending = (1.0 - 0.95 / 0.99) * 15e3 / w
    # with the rotor the belt comes to rest, and the whole tension presses on the pulleys
    limit = 2.0 * 900.0 * (m - 1.0) / (m + 1.0) * r + bending
    findings = result["belt_slip"]
    assert findings["slip_torque"]["value"] == pytest.approx(limit, rel=1e-9)
    assert findings["static_force"]["value"] == pytest.approx(1800.0 * math.sin(0.5 * wrap), rel=1e-9)
    assert findings["wrap"]["value"] == pytest.approx(wrap, rel=1e-12)
    stuck = jam.isel(time=int(np.argmin(np.abs(jam["belt.driven.w"].values))))
    assert float(stuck["belt.tau"]) == pytest.approx(limit, rel=0.01)
    assert float(stuck["motor.w"]) > 0.95 * w and abs(float(stuck["belt.driven.w"])) < 1.0
    jammed, steady = findings["answers"]["jam"], findings["answers"]["steady"]
    assert jammed["slipping_time"]["value"] > 1.0 and steady["slipping_time"]["value"] == 0.0
    assert steady["slip_mean"]["value"] == pytest.approx(0.004, rel=0.15)
    assert steady["shaft_force_mean"]["value"] == pytest.approx(
        2.0 * tension * math.sin(0.5 * wrap), rel=0.01
    )
    # the efficiency of the data at full load, less at part load
    loads = {row["load"]["value"]: row["efficiency"]["value"] for row in findings["loads"]}
    assert loads[1.0] == pytest.approx(0.95, rel=1e-6) and loads[0.25] < 0.86 < loads[0.5]
    (shaft,) = (row for row in result["checks"]["rows"] if row["title"] == "overhung load of the shaft")
    assert shaft["value"]["value"] == pytest.approx(2.0 * tension * math.sin(0.5 * wrap), rel=0.01)
    assert "the belt slips through" in text
    assert verdict_of(result) == "the rotor stands after crushing rises (jam)"
    assert all(x["value"] < 1e-3 for x in result["certificate"]["jam"].values())


@pytest.mark.slow
def test_sizing_takes_the_line_into_its_trials(tmp_path):
    """The chosen drive has coupling, belt and gear; the machine has its speed in spite of the slip, and the motor is
    at its speed before the machine, so that its start is short."""
    text = "event = []\n[fluid_coupling]\nrated_slip = '6 %'\n[belt]\nratio = 3\n"
    text += "[sizing]\npoles_least = 4\npoles_most = 4\n"
    (tmp_path / "mill.toml").write_text(text, "utf-8")
    process = chainunit("study", "mill.toml", "-o", "out", cwd=tmp_path)
    assert process.returncode == 0, process.stderr
    result = ResultEntries(json.loads((tmp_path / "out" / "result.json").read_text("utf-8")))
    assert "V-belt of 3 before a two-stage helical gear of" in process.stdout.replace("\n", " ")
    assert list(result["fmus"]) == ["machine", "belt", "fluid_coupling", "motor"]
    assert result["answers"]["steady"]["speed_mean"]["value"] == pytest.approx(3.0, rel=0.03)
    steady = result["coupling_slip"]["answers"]["steady"]
    assert 0.0 < steady["slip_mean"]["value"] < 0.06
    chosen = result["sizing"]["candidates"][result["sizing"]["chosen"]]
    assert chosen["checks"]["start"]["value"]["value"] < result["answers"]["steady"]["speed_mean"]["value"]


@pytest.mark.parametrize(
    ("text", "factor", "gentle"),
    [
        ("load_class = 'very heavy'", 1.6, 1.4),
        ("load_class = 'very heavy'\nhours = 8", 1.5, 1.3),
        ("service_factor = 2", 2.0, 2.0),
        # moderate by the inertia of the mill, 1.8 times that of the motor
        ("", 1.3, 1.2),
    ],
)
def test_sizing_tensions_a_belt_as_it_orders_one(text, factor, gentle, tmp_path):
    """The factor of DIN 7753-2; a gentle start has less, and a factor in the file of the belt is kept."""
    motor = motor_of_catalogue(MOTOR)
    for start, belt, wanted in (
        ("direct", "", factor),
        ("soft", "", gentle),
        ("direct", "service_factor = 1.4", 1.4),
    ):
        config = parse(f"event = []\nstart = '{start}'\n[belt]\nratio = 3\n{belt}\n[sizing]\n{text}\n")
        placed = trials_of(config, duty_by(config, tmp_path)).candidate(motor).drive.line.part("belt")
        assert placed.table.service_factor == pytest.approx(wanted, rel=1e-12)
        assert placed.table.pretension == pytest.approx(
            v_belt.usual_pretension(placed.table, wanted), rel=1e-12
        )


def test_a_belt_without_ratio_has_the_whole_ratio_of_a_machine_near_the_speed_of_the_motor():
    for ratio in (0.5, 0.98, 1.0, 6.0):
        plan = next(plan for plan in parse("[belt]\n").drive.line if plan.name == "belt")
        assert plan.share(ratio) == ratio
        table = plan.completed(dataclasses.replace(plan.table, rated_power=5e3, rated_speed=150.0), ratio)
        # the smaller pulley is a standard one
        small = min(table.diameter, table.diameter * ratio)
        assert min(abs(small / size - 1.0) for size in _diameters("R40")) < 1e-9


def test_the_rated_torque_has_the_rated_slip():
    p = v_belt.VBelt.Parameters()
    slip = brentq(
        lambda slip: v_belt.force(MATH, p, p.rated_speed, p.rated_speed * (1.0 - slip) / p.ratio)
        - v_belt.rated_force(MATH, p),
        1e-4, 0.1,
    )  # fmt: skip
    assert slip == pytest.approx(p.rated_slip, rel=1e-9)


def test_the_question_names_the_belt():
    assert drive("[gear]\nratio = 4\n[belt]\nratio = 4\n").ratio_noun == "belt"
    assert drive("[gear]\nratio = 60\n[belt]\nratio = 4\n").ratio_noun == "belt and gear"


def test_a_belt_whose_pulleys_touch_is_refused_with_the_least_distance():
    with pytest.raises(
        InputError, match=r"belt\.distance = 50 mm: must be > .* mm, half of both pulleys; leave it out"
    ):
        drive("[gear]\nratio = 6\n[belt]\ndistance = '50 mm'\n")


def test_a_gear_that_speeds_up_behind_a_belt_is_told():
    for ratio, behind in ((2.0, 0.5), (8.0, None), (4.0, None)):
        config = parse(MILL + f"[gear]\nratio = {ratio}\n[belt]\nratio = 4\n")
        study = record_of(config, drive_of(config))
        BeltFindings(0.1, 0.4, 3.0, 10.0, 500.0, 1e3, 30.0).remark(study)
        told = [(remark.code, remark.quantities["behind"][0]) for remark in study.findings.remarks]
        assert told == ([] if behind is None else [("gear-speeds-up", behind)])


def test_a_belt_has_its_own_pulley_on_the_motor_shaft():
    with pytest.raises(InputError, match=r"motor_shaft\.pulley_diameter: is of a belt without a table"):
        parse(MILL + "[belt]\n[motor_shaft]\noverhung_load = '1 kN'\npulley_diameter = '200 mm'\n")
