"""The energy of a year: against a simulated day, a balance, limit cases and tables; refusals."""

from __future__ import annotations

import dataclasses
import json
from types import SimpleNamespace

import numpy as np
import pytest
from records import like
from reports import write

from chainunit.app import cli
from chainunit.capabilities.energy import inverter
from chainunit.capabilities.energy.analysis import EnergyFindings, MotorEnergy, compared, year_of
from chainunit.capabilities.energy.efficiency_class import (
    CLASSES,
    class_of,
    falls_short,
    limit,
    next_class,
    no_class,
    required,
)
from chainunit.capabilities.energy.motor_class import MotorClass, MotorClassAnalysis, words_of
from chainunit.capabilities.energy.other_motor import other_motor
from chainunit.capabilities.energy.page import verdict
from chainunit.capabilities.energy.running import PLACES, Losses, scale_faults, scaled, warm
from chainunit.core.errors import InputError
from chainunit.core.quantities import Layout, declaration, quantity
from chainunit.drives.catalogue import catalogue
from chainunit.machines.knife_drive import KnifeDrive
from chainunit.reading.result_entries import ResultEntries
from chainunit.report.cited import cited
from chainunit.report.lines import Number, pieces
from chainunit.study.config import parse
from chainunit.study.run import run_study
from chainunit.system import CompiledSimulation, Profile

STUDY = """
event = []
start = "{start}"
[system]
motor = "IE3 4-pole 1.5 kW, 90L"
[feed]
left = {{ material_mass = 30, processing_force = 200 }}
right = {{ material_mass = 20, processing_force = 300 }}
[gear]
efficiency = 0.95
[run]
crank_speed = 8
settle_turns = 3
turns = 3
step = "2 ms"
[usage]
hours = 10
days = 200
tonnes_per_hour = 4
price = 0.25
co2 = 0.4
years = 10
motor_price = 400
other_price = 450
[[usage.load]]
share = "60 %"
[[usage.load]]
name = "half"
share = "30 %"
factor = 0.5
[[usage.load]]
name = "empty"
share = "10 %"
factor = 0
"""
SHARES = {"load 1": 0.6, "half": 0.3, "empty": 0.1}
FACTORS = {"load 1": 1.0, "half": 0.5, "empty": 0.0}


@pytest.fixture(scope="module", params=["direct", pytest.param("inverter", marks=pytest.mark.second)])
def study(request, tmp_path_factory):
    made = run_study(parse(STUDY.format(start=request.param)), tmp_path_factory.mktemp(request.param))
    assert made.findings.failure is None
    return made


def found(study) -> EnergyFindings:
    return study.findings.by_analysis["energy"]


def test_the_losses_by_place_add_up_to_the_electric_power(study):
    for losses in (
        found(study).own.mean,
        found(study).other.mean,
        *(x.losses for x in found(study).loads.values()),
    ):
        places = [getattr(losses, name) for name in PLACES]
        assert sum(x for x in places if x is not None) + losses.missing == pytest.approx(
            losses.electric, rel=1e-12
        )
        assert abs(losses.missing) < 1e-3 * losses.electric
        # each place on its own: none takes back what another gives
        assert all(x is None or x >= 0.0 for x in places)


@pytest.mark.stages(second=1)
@pytest.mark.second
def test_a_year_is_the_integral_over_a_simulated_day(study):
    """The feed changes its size through a day of the shares, scaled down; the supply's power of the compiled system
    is integrated from a steady state to the same steady state. Material that comes with a change brings its energy
    with it; the day has enough turns for that not to count."""
    drive = warm(study.setup.drive, found(study).own.temperature)
    operation, turn = study.setup.config.operation, study.setup.config.operation.turn
    whole = 2000.0 * turn
    at, changes = 30.0 * turn, {}
    names = Layout(type(operation.feed)).by_name(operation.feed)
    for load in ("half", "empty", "load 1"):
        # the day begins in the middle of the first load
        at += (
            whole * {"half": 0.5 * SHARES["load 1"], "empty": SHARES["half"], "load 1": SHARES["empty"]}[load]
        )
        changes[load] = at
    signals = {
        f"machine.{name}": Profile(x, tuple((at, 0.02, FACTORS[load] * x) for load, at in changes.items()))
        for name, x in names.items()
    }
    begin, end = 30.0 * turn, 30.0 * turn + whole
    with CompiledSimulation(drive.graph, signals | drive.reference(operation.crank_speed, 1.0)) as simulation:
        simulation.run(begin, 2e-3, names=())
        names = ("motor.supply_power", "motor.supply.frequency", "motor.air_gap_tau")
        run = simulation.run(end, 2e-3, names=names)
    power = run["motor.supply_power"].values
    if drive.follows:
        plate = study.setup.plate.nameplate
        losses = inverter.typical_losses(plate.power)
        f = run["motor.supply.frequency"].values / plate.frequency
        power = power + inverter.loss(losses, f, run["motor.air_gap_tau"].values / plate.torque)
    day = np.trapezoid(power, run["time"].values) / (end - begin) * 10.0 * 3600.0
    assert day * 200.0 == pytest.approx(found(study).own.year.energy, rel=1e-3)


def test_processing_is_the_work_of_its_force_and_falls_with_the_feed(study):
    loads = {name: each.losses for name, each in found(study).loads.items()}
    assert loads["empty"].processing == pytest.approx(0.0, abs=1e-9)
    # the force is smoothed at rest; the speed of a motor on the line changes with the load
    assert loads["half"].processing == pytest.approx(0.5 * loads["load 1"].processing, rel=0.01)
    assert loads["load 1"].joints > loads["half"].joints > loads["empty"].joints > 0.0
    assert loads["load 1"].electric > loads["half"].electric > loads["empty"].electric


def test_cost_and_co2_follow_from_the_energy(study):
    own, other, comparison = found(study).own, found(study).other, found(study).comparison
    kWh = own.mean.electric / 1e3 * 2000.0
    assert own.year.energy / 3.6e6 == pytest.approx(kWh)
    assert own.year.cost == pytest.approx(0.25 * kWh) and own.year.co2 == pytest.approx(0.4 * kWh)
    assert own.year.energy_per_tonne / 3.6e6 == pytest.approx(kWh / 8000.0)
    assert own.year.life_cost == pytest.approx(400.0 + 10.0 * 0.25 * kWh)
    # the same losses at a better class: less energy, and the extra price pays back at the saving of a year
    assert other.year.energy < own.year.energy and comparison.better == other.motor
    assert comparison.pays_after == pytest.approx(50.0 / (own.year.cost - other.year.cost))


def test_an_inverter_has_losses_and_a_line_has_none(study):
    assert (found(study).own.mean.inverter is not None) == study.setup.drive.follows
    kinds = {remark.code for remark in study.findings.remarks}
    assert "losses-in-iron" in kinds and ("losses-of-the-inverter" in kinds) == study.setup.drive.follows
    # half of the feed goes with the loss of the whole feed in the gear
    assert "gear-at-other-loads" in kinds


# -- inverter


def test_the_interpolation_meets_its_points_and_its_borders():
    losses = inverter.typical_losses(4000.0)
    f, i = np.array(inverter.POINTS).T
    assert inverter.loss(losses, f, i) == pytest.approx(losses)
    # a quarter less than the reference drive of class IE1, 374 W
    assert losses[-1] == 280.5 and inverter.apparent_power(4000.0) == 5440.0
    # between two points the mean; on the plane at the corner without a point; beyond the border that of the border
    assert inverter.loss(losses, 0.25, 1.0) == pytest.approx(0.5 * (losses[2] + losses[5]))
    corner = losses[3] + losses[6] - losses[4]
    assert inverter.loss(losses, 0.9, 0.25) == pytest.approx(corner)
    assert inverter.loss(losses, [1.0, 0.9, -0.9], [-1.0, 3.0, 1.0]) == pytest.approx([losses[-1]] * 3)
    assert inverter.loss(losses, 0.0, 0.0) == pytest.approx(losses[0])
    assert inverter.apparent_power(4000.0) < inverter.apparent_power(4500.0) < inverter.apparent_power(5500.0)
    assert inverter.typical_losses(400e3)[-1] == pytest.approx(2.0 * inverter.typical_losses(200e3)[-1])


@pytest.mark.second
def test_the_losses_of_the_maker_stand_in_place_of_the_reference(tmp_path):
    given = "inverter_losses = [1, 1, 1, 1, 1, 1, 1, 1]\n".replace("1", "0.02")
    text = STUDY.format(start="inverter").replace("hours = 10\n", f"hours = 10\n{given}")
    made = run_study(parse(text.partition("[[usage")[0]), tmp_path)
    # the same at every point: 2 % of the apparent power
    assert found(made).own.mean.inverter == pytest.approx(0.02 * inverter.apparent_power(1500.0))
    assert list(found(made).loads) == ["load 1"] and found(made).loads["load 1"].share == 1.0


# -- classes


def test_the_packaged_motors_have_the_class_that_their_names_say():
    for motor in catalogue():
        plate = motor.nameplate
        if plate.frequency == 60.0:
            assert class_of(plate) == ""  # the limits here are those for 50 Hz
            continue
        assert class_of(plate) == motor.designation[:3], motor.designation
        assert limit(class_of(plate), plate.power, plate.poles) == pytest.approx(plate.efficiency), motor
        assert not falls_short(plate)
        assert required(plate) == ("IE4" if plate.power >= 75e3 else "IE3" if plate.power >= 750.0 else "IE2")


def test_limits_rise_with_class_and_size():
    for poles in (2, 4, 6):
        table = [[limit(of, power, poles) for power in (120.0, 1e3, 75e3, 200e3)] for of in CLASSES]
        assert np.all(np.diff(table, axis=0) > 0.0) and np.all(np.diff(table, axis=1) > 0.0)
        assert limit("IE3", 1e6, poles) == limit("IE3", 2e5, poles)
        assert limit("IE3", 119.0, poles) is None and limit("IE3", 1.1e6, poles) is None
    assert limit("IE3", 1e3, 12) is None


@pytest.mark.parametrize(
    ("power", "poles", "asked"),
    [
        *(
            (110, 4, ""),
            (120, 4, "IE2"),
            (740, 8, "IE2"),
            (750, 8, "IE3"),
            (74e3, 2, "IE3"),
            (75e3, 6, "IE4"),
        ),
        *(
            (75e3, 8, "IE3"),
            (200e3, 4, "IE4"),
            (201e3, 4, "IE3"),
            (1e6, 2, "IE3"),
            (1.1e6, 2, ""),
            (1e3, 10, ""),
        ),
    ],
)
def test_what_the_regulation_asks(power, poles, asked):
    plate = dataclasses.replace(catalogue()[0].nameplate, power=power, poles=poles)
    assert required(plate) == asked


def test_the_regulation_covers_motors_for_50_and_60_hz():
    plate = dataclasses.replace(catalogue()[0].nameplate, power=1e3)
    asked = {f: required(dataclasses.replace(plate, frequency=f)) for f in (50.0, 60.0, 87.0, 100.0)}
    assert asked == {50.0: "IE3", 60.0: "IE3", 87.0: "", 100.0: ""}


@pytest.mark.second
def test_a_motor_of_75_kw_below_ie4_is_warned_of(tmp_path):
    """The row as the packaged catalogue had it before: of class IE3."""
    row = (
        "designation,power [W],poles,speed [rev/min],efficiency,power_factor,breakdown_ratio,locked_torque_ratio,"
        'locked_current_ratio,J [kg.m2],locked_time [s]\n"Old 75",75000,4,1486,0.950,0.86,2.96,2.11,7.3,1.2,11\n'
    )
    (tmp_path / "motors.csv").write_text(row)
    old = next(
        motor for motor in catalogue(tmp_path / "motors.csv") if motor.designation == "Old 75"
    ).nameplate
    assert class_of(old) == "IE3" and required(old) == "IE4" and falls_short(old)
    assert next_class(old) == ("IE4", 0.96) and next_class(dataclasses.replace(old, efficiency=0.961)) is None
    text = 'event = []\ncatalogue = "motors.csv"\n[system]\nmotor = "Old 75"\n[run]\nsettle_turns = 1\n'
    made = run_study(parse(text, source=str(tmp_path / "study.toml")), tmp_path / "out")
    assert isinstance(made.findings.by_analysis["motor_class"], MotorClass)
    (warning,) = [remark for remark in made.findings.warnings if remark.code == "efficiency-class"]
    assert "is IE3" in warning.text and "asks IE4" in warning.text and "brake motors" in warning.text


def test_a_study_without_usage_has_no_new_findings(tmp_path):
    text = STUDY.format(start="direct").partition("[usage]")[0]
    made = run_study(parse(text), tmp_path)
    assert not {"energy", "motor_class"} & set(made.findings.by_analysis)


# -- input


def test_a_feed_is_scaled_within_its_bounds():
    feed = KnifeDrive.Feed(cut_force=2000.0)
    assert scaled(feed, 0.25).cut_force == 500.0 and scaled(feed, 0.0).cut_force == 0.0


def test_a_year_without_prices_has_energy_alone(study):
    plan = study.setup.config.plans["energy"]
    bare = dataclasses.replace(plan.table, price=0.0, co2=0.0, tonnes_per_hour=0.0)
    year = year_of(dataclasses.replace(plan, table=bare), 1000.0, None)
    assert (year.cost, year.co2, year.energy_per_tonne, year.life_cost) == (None,) * 4
    assert year.life_energy == pytest.approx(10.0 * 1000.0 * 2000.0 * 3600.0)


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ("[[usage.load]]\nshare = 0.5\n", "the shares are 50 % together; must be 100 %"),
        ("[[usage.load]]\nshare = 1.5\n", "usage.load.1.share"),
        (
            "[[usage.load]]\nname = 'a'\nshare = 0.5\n[[usage.load]]\nname = 'a'\nshare = 0.5\n",
            "stands there twice",
        ),
        ("[usage]\ninverter_losses = [0.02, 0.03]\n", "has 2 values; must have 8"),
        ("[usage]\nother = 'IE9'\n", 'usage.other = "IE9": not in the catalogue'),
        ("[usage]\nhours = 25\n", "usage.hours"),
        ("[usage]\nhour = 8\n", "hours"),
    ],
)
def test_refusals_name_key_and_remedy(table, words):
    with pytest.raises(InputError, match="usage") as refused:
        parse(f"event = []\n[system]\nmotor = 'IE3 4-pole 1.5 kW, 90L'\n{table}")
    assert words in str(refused.value)


@pytest.mark.slow
def test_the_reports_have_the_numbers_of_the_result(tmp_path, monkeypatch, capsys):
    file = tmp_path / "study.toml"
    file.write_text(STUDY.format(start="inverter"))
    arguments = ["chainunit", "study", str(file), "-o", str(tmp_path / "out"), "--all", "--png"]
    monkeypatch.setattr("sys.argv", arguments)
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == 0
    out = tmp_path / "out"
    energy = ResultEntries(json.loads((out / "result.json").read_text("utf-8")))["energy"]
    assert energy["own"]["energy"]["unit"] == "J" and energy["own"]["energy"]["kind"] == "energy"
    assert set(energy["loads"]) == set(SHARES)
    page, words, said = (
        (out / "report.html").read_text("utf-8"),
        (out / "result.md").read_text("utf-8"),
        capsys.readouterr().out,
    )
    assert 'id="energy"' in page and (out / "energy.png").exists()
    for text in (words, said):
        assert "Electric power, and where it goes" in text and "it has paid after" in text


# -- limits of the numbers


def short_study(start="direct", table="", loads=""):
    head = STUDY.format(start=start).partition("[[usage")[0].replace("tonnes_per_hour = 4\n", table)
    return head + loads


def test_the_winding_has_the_temperature_of_the_duty(study):
    """A difference of 5 K would change the energy by more than 0.1 %."""
    own, drive = found(study).own, study.setup.drive
    settled = drive.motor.settled_temperature(
        drive.fmu_parameters, own.mean.winding, own.temperature, own.speed
    )
    assert settled == pytest.approx(own.temperature, abs=0.5) and not own.too_hot


@pytest.mark.slow
def test_a_duty_that_is_too_hot_is_warned_of(tmp_path):
    made = run_study(parse(short_study(loads="[[usage.load]]\nfactor = 10\n")), tmp_path)
    own = found(made).own
    assert own.too_hot and own.temperature == made.setup.config.permitted_temperature[1]
    (warning,) = [
        remark
        for remark in made.findings.warnings
        if remark.code == "energy-of-a-winding-too-hot"
        and own.motor in remark.text.split("winding of")[1][:30]
    ]
    assert "120 degC" in warning.text and "usage.load.factor" in warning.text


@pytest.mark.second
def test_another_motor_is_one_for_the_same_mains():
    fifty, sixty = ("IE3 4-pole 1.5 kW, 90L" + hertz for hertz in ("", ", 60 Hz"))
    motors = {motor.designation: motor for motor in catalogue()}
    assert other_motor(motors[sixty], sixty, ()) == motors[sixty]
    with pytest.raises(InputError, match=r"usage\.other = .* has 60 Hz, and the motor of the study 50 Hz"):
        other_motor(motors[fifty], sixty, ())


@pytest.mark.second
def test_another_motor_that_changes_the_speed_is_no_comparison(tmp_path):
    """A motor of two poles on the line turns the same gear and crank twice as fast."""
    made = run_study(parse(short_study(table='other = "IE3 2-pole 1.5 kW, 90S"\n')), tmp_path)
    assert found(made).other is None and found(made).comparison is None
    assert "turns at 1.9" in found(made).no_other and "usage.other" in found(made).no_other


@pytest.mark.slow
def test_the_same_motor_takes_the_same_energy(tmp_path):
    made = run_study(parse(short_study(table='other = "IE3 4-pole 1.5 kW, 90L"\n')), tmp_path)
    write(made, tmp_path)
    comparison = found(made).comparison
    assert (comparison.better, comparison.saving, comparison.pays_after) == ("", 0.0, None)
    assert "Both motors take the same energy." in (tmp_path / "result.md").read_text("utf-8")


def motor_energy(plan, name, power, price):
    losses = Losses(**dict.fromkeys(Layout(Losses).names) | {"electric": power})
    return MotorEnergy(name, year_of(plan, power, price), losses, 300.0, False, 150.0, price)


@pytest.mark.parametrize(
    ("price", "words"),
    [
        (450.0, "it has paid after"),
        (380.0, "it costs no more than the other"),
        (4000.0, "does not pay in a life of"),
        (None, "payback: enter motor_price and other_price"),
    ],
)
def test_the_life_decides_whether_a_motor_pays(study, price, words):
    plan = study.setup.config.plans["energy"]
    own = motor_energy(plan, "own", 1000.0, 400.0)
    other = motor_energy(plan, "other", 950.0, price)
    comparison = compared(own, other)
    # 50 W over 10 years of 2000 h at 0.25 a kWh are 250
    if price is None:
        assert comparison.life_saving is None and comparison.pays_after is None
    else:
        assert comparison.life_saving == pytest.approx(250.0 - (price - 400.0))
        assert (comparison.pays_after < 10.0) == (comparison.life_saving > 0.0)
    said = verdict(comparison, cited(comparison), Number(10.0, "1"))
    assert words in "".join(str(getattr(piece, "text", piece)) for piece in pieces(said))


def test_shares_of_a_third_are_complete():
    three = "".join(f"[[usage.load]]\nshare = '33.3 %'\nfactor = {f}\n" for f in (1, 0.5, 0))
    plan = parse(short_study(loads=three)).plans["energy"]
    assert len(plan.loads) == 3


def test_a_switch_of_the_feed_stays_and_a_factor_keeps_the_bounds():
    @declaration
    class Feed:
        """A feed with a bound and a count."""

        force: float = quantity("N", "force", default=100.0, min=20.0, max=500.0)
        lumps: float = quantity("1", "lumps", default=3, min=1, max=9, type="Integer")

    feed = Feed(force=200.0, lumps=4)
    assert scaled(feed, 0.5) == Feed(force=100.0, lumps=4) and scale_faults(feed, 0.5) == []
    (words,) = scale_faults(feed, 10.0)
    assert words == "feed.force comes to 2000 N with it: must be >= 20 N and <= 500 N"
    assert scale_faults(feed, 0.0)


def test_a_motor_of_eight_poles_is_in_the_scope_without_a_known_class():
    plate = dataclasses.replace(catalogue()[0].nameplate, power=1500.0, poles=8)
    words = words_of(MotorClass("8", class_of(plate), required(plate), False, 0.8, no_class(plate)))
    assert "is not checked: its limits here are those for 2, 4 or 6 poles" in words and "asks IE3" in words


@pytest.mark.parametrize(
    ("name", "poles", "words"),
    [
        (
            "IE3 4-pole 1.1 kW, 90S, 60 Hz",
            4,
            "those at 50 Hz, and the motor is one for 60 Hz. EU 2019/1781 asks IE3",
        ),
        ("IE3 4-pole 1.1 kW, 90S", 8, "those for 2, 4 or 6 poles and 0.12 to 1000 kW. EU 2019/1781 asks IE3"),
        ("IE3 4-pole 1.1 kW, 90S", 4, ""),
    ],
)
def test_a_study_tells_that_the_class_of_its_motor_is_not_checked(name, poles, words):
    motor = next(m for m in catalogue() if m.designation == name)
    motor = dataclasses.replace(motor, nameplate=dataclasses.replace(motor.nameplate, poles=poles))
    notes = []
    study = like(
        plate=motor,
        drive=SimpleNamespace(foreign=None),
        config=SimpleNamespace(plans={"energy": None}),
        say=lambda code, **values: notes.append(code.remark(**values).text),
    )
    found = MotorClassAnalysis.find(study, None)
    if not words:
        assert found is None
        return
    found.remark(study)
    assert not found.falls_short and words in notes[0]
