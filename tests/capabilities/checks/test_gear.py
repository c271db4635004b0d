"""The checks of the gear and of the motor's shaft: the worked example of docs/checks.md, the limit cases of the
torque of equal damage, the directions, and a study whose numbers are computed once more from its stored runs."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from records import like
from reports import at

from chainunit.capabilities.checks.gear import (
    _PULLEY,
    GearDuty,
    ShaftLoad,
    check_gear,
    equivalent_torque,
    gear_check,
    peak_factor_of,
    pulley_force,
    rating_of,
)
from chainunit.capabilities.checks.row import Checks
from chainunit.capabilities.checks.tables import GearRatingTable, MotorShaftTable
from chainunit.core.errors import InputError
from chainunit.drives.gear_rating import GearRating
from chainunit.drives.gearing import Transmission
from chainunit.reading.result_entries import ResultEntries
from chainunit.reading.results import InUnit
from chainunit.study import torques
from chainunit.study.bearings import driver_bearing
from chainunit.study.config import parse

DOCS = (Path(__file__).parents[3] / "docs" / "checks.md").read_text("utf-8")
LINKAGES = Path(__file__).parents[3] / "examples" / "linkages"
RATING = GearRating(
    rated_torque=1000.0,
    application_factor=1.25,
    thermal_power=5000.0,
    overhung_load=9000.0,
    largest_speed=188.5,
)
LOAD = GearDuty(
    ratio=50.0, exponent=6.6, equivalent=721.4, running=721.4, mean=600.0, largest=1700.0, power=600.0, radial=6000.0,
    largest_radial=9500.0, speed=160.0,
)  # fmt: skip


def checked(load=LOAD, rating=RATING, peak_factor=2.0, permitted_peak=12e3):
    checks = Checks()
    check_gear(checks, gear_check(load, rating, peak_factor, "start_up"), rating, permitted_peak, "start-up")
    return checks


def used(*given, **more):
    return {row.title: row.utilisation for row in checked(*given, **more).rows}


def test_the_example():
    for each in ("721.4 N m", "57.7 %", "64.0 %", "85.0 %", "12.0 %", "66.7 %", "437.5 N", "62.5 %"):
        assert each in DOCS, each
    angle = np.linspace(0.0, 2.0 * np.pi, 10_001)
    torque = np.where(angle < np.pi, 400.0, 800.0)
    by_hand = ((400.0**6.6 + 800.0**6.6) / 2.0) ** (1.0 / 6.6)
    assert by_hand == pytest.approx(721.4, rel=1e-3)
    assert equivalent_torque(torque, angle, 6.6) == pytest.approx(by_hand, rel=1e-3)
    assert equivalent_torque(torque, angle, 0.0) == 800.0
    shares = used()
    assert shares["torque of running"] == pytest.approx(0.577, rel=0.01)
    assert used(replace(LOAD, running=800.0))["torque of running"] == pytest.approx(0.64, rel=0.01)
    assert shares["largest torque of the output (start-up)"] == pytest.approx(0.85, rel=0.01)
    assert shares["mean power"] == pytest.approx(0.12, rel=0.01)
    assert shares["overhung load"] == pytest.approx(0.667, rel=0.01)
    radial = pulley_force(20.0, 0.16, 1.75)
    assert radial == pytest.approx(437.5, rel=0.01)
    tables = {"motor_shaft": MotorShaftTable(pulley_diameter=0.16, tension_factor=1.75)}
    shaft = _PULLEY.row("motor", "checks.motor_shaft", ShaftLoad(20.0, radial), 700.0, tables)
    assert shaft.utilisation == pytest.approx(0.625, rel=0.01)
    # the numbers of the formula, of the findings and of the study file, with their places
    assert shaft.letters["T"] == (InUnit(20.0, "N.m"), "findings.checks.motor_shaft.torque")
    assert shaft.letters["f"] == (InUnit(1.75, "1"), "given.motor_shaft.tension_factor")
    assert shaft.numbers["d"] == "motor_shaft.pulley_diameter"


def test_the_torque_of_equal_damage_lies_between_mean_and_largest_and_grows_with_the_exponent():
    angle = np.linspace(0.0, 2.0 * np.pi, 2001)
    torque = 300.0 * np.sin(angle) + 100.0
    means = [equivalent_torque(torque, angle, p) for p in (1.0, 3.0, 6.6, 20.0, 50.0, 0.0)]
    assert means[0] == pytest.approx(np.mean(np.abs(torque)), rel=1e-2)
    assert np.all(np.diff(means) > 0.0) and means[-1] == pytest.approx(400.0, rel=1e-9)
    assert equivalent_torque(torque, -angle, 3.0) == pytest.approx(means[1], rel=1e-12)


SIGNS = {
    "torque of running": ("running", "application_factor"),
    "largest torque of the output (start-up)": ("largest", "rated_torque"),
    "mean power": ("power", "thermal_power"),
    "overhung load": ("radial", "overhung_load"),
    "speed of the input shaft": ("speed", "largest_speed"),
    "overhung load of all runs": ("largest_radial", ""),
}


@pytest.mark.parametrize("title", SIGNS)
def test_the_used_share_rises_with_its_load_and_falls_with_its_rating(title):
    load, rating = SIGNS[title]
    for name in SIGNS.values():
        shares = [
            used(replace(LOAD, **{name[0]: getattr(LOAD, name[0]) * factor}))[title] for factor in (1.0, 1.3)
        ]
        assert (np.diff(shares) > 0.0) == (name[0] == load)
    for name in vars(RATING):
        both = (rating, "rated_torque") if title == "torque of running" else (rating,)
        shares = [
            used(rating=replace(RATING, **{name: getattr(RATING, name) * factor}))[title]
            for factor in (1.0, 1.3)
        ]
        assert (np.diff(shares) < 0.0) == (name in both)
    assert (used(permitted_peak=13e3)[title] < used()[title]) == (title == "overhung load of all runs")
    assert (used(peak_factor=2.5)[title] < used()[title]) == title.startswith("largest torque")


def test_what_nobody_gives_is_named():
    nothing = GearRating()
    checks = checked(rating=nothing, permitted_peak=0.0)
    assert not checks.rows and [each.why.rpartition(" ")[2] for each in checks.missing] == [
        "rated_torque", "thermal_power", "overhung_load", "largest_speed",
    ]  # fmt: skip
    assert checked(permitted_peak=0.0).missing[-1].why.endswith("add [gear_rating] with peak_overhung_load")
    without = replace(LOAD, radial=None, largest_radial=None)
    missing = checked(without, permitted_peak=0.0).missing
    assert [each.why for each in missing] == ["no pin of the machine turns with the output shaft"]


def test_a_crank_with_bearings_of_its_own_puts_no_load_on_the_gear():
    plans = [parse(text).plans["checks"] for text in ("[sizing]\nseparate_bearing = true", "[sizing]", "")]
    assert [plan.separate_bearing for plan in plans] == [True, False, False]


def test_the_application_factor_is_over_the_mean_torque_and_stands_beside_the_torque_of_running():
    for load, symbols in ((LOAD, ["TN", "p", "KA"]), (replace(LOAD, exponent=None), ["TN", "KA"])):
        found = gear_check(load, RATING, 2.0)
        row = checked(load, permitted_peak=0.0).rows[0]
        assert list(row.numbers) == symbols and all(each in row.formula for each in symbols)
        assert found.application_factor == pytest.approx(721.4 / 600.0)
        assert (row.value, row.limit, row.unit) == (721.4, 1250.0, "N.m")


def test_the_bearing_of_the_crank_is_that_in_the_ground_wherever_it_stands_in_the_file(tmp_path):
    """The block of a yoke that only slides turns on the crank's pin A as far as the crank in its bearing."""
    yoke = (LINKAGES / "scotch_yoke_pump.toml").read_text("utf-8")
    pin = '[joints.A]\non = "crank.A"\nby = "block.A"\n\n'
    (tmp_path / "yoke.toml").write_text(yoke.replace("[joints.slot]", f"{pin}[joints.slot]"), "utf-8")
    machines = (
        ("yoke.toml", "A", "O1"),
        ("KnifeDrive", "O1 crank bearing", "O1 crank bearing"),
        ("Accelerator", "O rotor bearing", "O rotor bearing"),
    )
    for name, first, bearing in machines:
        machine = parse(f'[system]\nmachine = "{name}"', str(tmp_path / "study.toml")).machine
        assert next(iter(machine.model.pins)) == first
        assert driver_bearing(SimpleNamespace(foreign_machine=None, simulated_machine=machine)) == bearing


# -- a study


def test_running_puts_its_torque_of_the_run_on_the_gear_not_that_of_the_curve(monkeypatch):
    """The cage does not follow fast loads: in running the torque by the curve of the motor is another one."""
    time = np.arange(6.0)
    run = xr.Dataset({"torque": ("time", [0.0, 9.0, 2.0, 5.0, 4.0, 5.0])}, {"time": time})

    def of_run(drive, run):
        return float(run["torque"].max())

    monkeypatch.setattr(torques, "at_gear", of_run)
    monkeypatch.setattr(torques, "quasi_static_peak", lambda *given: 0.4 * of_run(*given))
    study = like(
        drive=None, events={}, event_parts={}, rise=run.sel(time=slice(None, 2.5)),
        steady=run.sel(time=slice(2.5, None)),
    )  # fmt: skip
    assert torques.gear_peaks(study.runs) == {"steady": 5.0, "start_up": pytest.approx(3.6)}


@pytest.mark.second
def test_the_numbers_of_a_study_follow_from_its_runs(rated):
    result = ResultEntries(json.loads((rated / "result.json").read_text("utf-8")))
    found, shaft = result["checks"]["gear"], result["checks"]["motor_shaft"]
    with xr.open_dataset(rated / "result.nc", group="start_up") as run:
        angle = run["machine.phi0"].values / found["ratio"]["value"]
        turns = run.sel(time=angle >= angle[-1] - 2.0 * np.pi * result["run"]["turns"]["value"])
        torque = turns["machine.tau"].values * found["ratio"]["value"]
        power = turns["machine.tau"].values * turns["machine.w0"].values
        force = np.hypot(turns["machine.crank_bearing.fx"].values, turns["machine.crank_bearing.fy"].values)
        way = np.diff(turns["machine.phi0"].values)
        fastest, largest = np.max(run["motor.w"].values), np.max(np.abs(turns["motor.tau"].values))
    largest /= result["gear"]["efficiency"]["value"]  # before the gear
    middle = 0.5 * np.abs(torque[1:] + torque[:-1])
    equivalent = (np.sum(middle**6.6 * way) / np.sum(way)) ** (1.0 / 6.6)
    assert found["bearing"] == "O1 crank bearing"
    assert found["equivalent"]["value"] == pytest.approx(equivalent, rel=2e-3)
    mean = np.trapezoid(np.abs(torque), turns["time"]) / float(turns["time"][-1] - turns["time"][0])
    assert found["application_factor"]["value"] == pytest.approx(equivalent / mean, rel=2e-3)
    assert found["running"]["value"] == found["equivalent"]["value"]
    assert found["power"]["value"] == pytest.approx(np.mean(np.abs(power)), rel=2e-3)
    assert found["radial"]["value"] == pytest.approx(np.max(force), rel=1e-3)
    assert found["speed"]["value"] == pytest.approx(fastest, rel=1e-9)
    assert found["largest"]["value"] >= result["starts"]["worst"]["quasi_static"]["value"]
    assert found["largest_radial"]["value"] == max(
        pins["O1 crank bearing"]["peak"]["value"] for pins in result["pins"].values()
    )
    assert shaft["radial"]["value"] == pytest.approx(2.0 * largest * 1.75 / 0.12, rel=1e-3)
    for row in result["checks"]["rows"]:
        if row["of"] in ("gear", "motor"):
            assert at(result, row["number"])["value"] == row["value"]["value"]
            assert all(at(result, place)["value"] is not None for place in row["numbers"].values())
    missing = {each["what"]: each["why"] for each in result["checks"]["not_checked"]}
    assert missing["gear, overhung load of all runs"].endswith("[gear_rating] with peak_overhung_load")


def test_ratings_out_of_bounds_are_refused():
    for text, words in (
        ("rated_torque = -1", "gear_rating.rated_torque = -1"),
        ("thermal_power = '3 m'", "gear_rating.thermal_power"),
        ("power = 3", "gear_rating.power: unknown key"),
    ):
        with pytest.raises(InputError) as refusal:
            parse(f"[gear_rating]\n{text}")
        assert words in str(refusal.value)


def test_ratings_of_the_file_come_before_those_of_the_catalogue():
    sold = GearRating(rated_torque=500.0, application_factor=1.4, thermal_power=3e3, overhung_load=6e3)
    assert rating_of(GearRatingTable(), sold, 700.0) == sold
    # a rated torque brings its own application factor
    given = rating_of(GearRatingTable(rated_torque=800.0, overhung_load=7e3), sold, 700.0)
    assert given == replace(sold, rated_torque=800.0, application_factor=1.0, overhung_load=7e3)
    limit = rating_of(GearRatingTable(application_factor=1.3, largest_speed=300.0), None, 700.0)
    assert limit.application_factor == 1.3 and limit.largest_speed == 300.0
    # gear.torque_limit is permitted in running, which sizing checks, too
    assert gear_check(LOAD, limit, 2.0).running_limit == pytest.approx(700.0)


def test_a_gear_of_a_catalogue_permits_the_same_torque_in_peaks_as_in_the_choice():
    """Its start factor is over the rated torque times the application factor; one of the file over the rated one."""
    gear = Transmission(torque_limit=450.0, start_factor=2.0)
    sold = GearRating(rated_torque=300.0, application_factor=1.5)
    factor = peak_factor_of(GearRatingTable(), sold, gear)
    assert gear_check(LOAD, sold, factor).torque_limit == gear.start_limit == 900.0
    assert peak_factor_of(GearRatingTable(), None, gear) == 2.0
    own = GearRatingTable(application_factor=1.5)
    limit = gear_check(LOAD, rating_of(own, None, 450.0), peak_factor_of(own, None, gear)).torque_limit
    assert limit == gear.start_limit
    assert peak_factor_of(GearRatingTable(rated_torque=400.0), sold, gear) == 2.0
    assert peak_factor_of(GearRatingTable(peak_factor=1.8), sold, gear) == 1.8
