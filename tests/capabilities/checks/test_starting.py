"""The check of the starts per hour: the worked example of docs/checks.md, the heat of the slip by its integral, the
directions, and a study."""

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
from records import like

from chainunit.capabilities.checks import starting
from chainunit.capabilities.checks.row import Checks
from chainunit.capabilities.checks.starting import check_starts
from chainunit.capabilities.checks.tables import StartingTable
from chainunit.drives.catalogue import catalogue
from chainunit.reading.result_entries import ResultEntries
from chainunit.study.config import parse
from chainunit.study.line.placed import Line
from chainunit.study.permitted_starts import StartingData, permitted_starts, start_torques

DOCS = (Path(__file__).parents[3] / "docs" / "checks.md").read_text("utf-8")
BASE = {
    "per_hour": 60.0, "bare": 1800.0, "rotor_inertia": 0.014, "inertia": 0.042, "motor_torque": 45.0,
    "counter_torque": 15.0, "current": 4.0, "rated_current": 6.2,
}  # fmt: skip


def row(most=math.inf, is_chosen=False, **values):
    checks = Checks()
    check_starts(checks, permitted_starts(StartingData(**BASE | values), most), is_chosen)
    (only,) = checks.rows
    return only


def test_the_example():
    for each in ("FI = 0.042/0.014 = 3.00", "0.667", "0.584", "233.5 an hour", "25.7 %"):
        assert each in DOCS, each
    assert row().limit == pytest.approx(233.5, rel=0.01)
    assert row().utilisation == pytest.approx(0.257, rel=0.01)


def test_the_heat_of_the_slip_is_larger_than_that_of_the_bare_rotor_by_the_factors():
    """The integral of slip speed times torque, beside 1/2 J ws^2 of a start without load."""
    ws, motor, counter, inertia, bare = 157.0, 45.0, 15.0, 0.042, 0.014
    time = np.linspace(0.0, inertia * ws / (motor - counter), 20_001)
    speed = (motor - counter) / inertia * time
    heat = np.trapezoid((ws - speed) * motor, time)
    found = permitted_starts(StartingData(**BASE | {"current": 0.0}))
    share = found.permitted / found.bare
    assert heat / (0.5 * bare * ws**2) == pytest.approx(1.0 / share, rel=1e-6)
    assert start_torques(time, np.full_like(time, motor), speed, inertia) == pytest.approx((motor, counter))


@pytest.mark.parametrize(
    ("name", "sign"),
    [
        ("per_hour", 1),
        ("bare", -1),
        ("rotor_inertia", -1),
        ("inertia", 1),
        ("motor_torque", -1),
        ("counter_torque", 1),
        ("current", 1),
        ("rated_current", -1),
    ],
)
def test_the_used_share_moves_in_the_right_direction(name, sign):
    steps = np.diff([row(**{name: BASE[name] * factor}).utilisation for factor in (1.0, 1.1, 1.5)])
    assert np.all(sign * steps > 0.0)


def test_another_rule_may_permit_fewer_starts():
    """Sizing and the check show one number: the least of the rule of the maker and the heat of the winding."""
    of = StartingData(**BASE)
    assert permitted_starts(of, 164.0).permitted == 164.0
    assert permitted_starts(of, 390.0).permitted == permitted_starts(of).permitted
    chosen = row(164.0, is_chosen=True)
    assert chosen.limit == 164.0 and chosen.formula.endswith("by the heat of its winding")


def test_a_motor_at_its_rated_current_may_not_start_again():
    assert row(current=6.2).limit == 0.0 and not row(current=6.2).holds
    # a load that drives takes no share
    assert start_torques(np.array([0.0, 1.0]), np.ones(2), np.array([0.0, 10.0]), 1.0)[1] == 0.0


@pytest.mark.parametrize(
    ("inertia", "start", "words"),
    [
        (
            4.30,
            "star-delta",
            "1.96 kg m² beside its rotor up to speed, twice from cold",
        ),
        (4.30, "direct", "4.28 kg m², more: ask the maker of the motor"),
        (1.90, "direct", "1.88 kg m², within it"),
        (4.30, "soft", ""),
    ],
)
def test_the_inertia_that_a_standard_has_every_motor_start(monkeypatch, inertia, start, words):
    """An 11 kW motor of 4 poles starts 1.96 kg m2 by IEC 60034-12: 0.04 11^0.9 2^2.5; a crusher has 4.3 kg m2, and
    the sheet said nothing."""
    plate = next(m.nameplate for m in catalogue() if m.designation == "IE3 4-pole 11 kW, 160M")
    flywheel, rotor = 0.01, SimpleNamespace(J=plate.J + 0.01)
    study = like(
        drive=SimpleNamespace(foreign=None, line=Line(), fmu_parameters=SimpleNamespace(rotor=rotor)),
        plate=SimpleNamespace(nameplate=dataclasses.replace(plate, starts=0.0)),
        config=SimpleNamespace(drive=SimpleNamespace(start=start)),
        steady=None,
    )
    monkeypatch.setattr(
        "chainunit.study.permitted_starts.load_inertia",
        lambda drive, run: np.full(3, inertia - 0.02 - flywheel),
    )
    why = starting._why_none(study, SimpleNamespace(starting=StartingTable(), starts_per_hour=2.0))
    assert words in why and ("IEC 60034-12" in why) == bool(words)


# -- a study

STUDY = """
title = "Starts"
[system]
motor = "IE3 4-pole 0.75 kW, 80M"
[run]
settle_turns = 2
[starting]
per_hour = 30
permitted = 2000
"""


@pytest.mark.slow
def test_the_numbers_of_a_study_follow_from_its_run(tmp_path):
    (tmp_path / "mine.toml").write_text(STUDY, "utf-8")
    assert chainunit("study", "mine.toml", "-o", "out", cwd=tmp_path).returncode == 0
    result = ResultEntries(json.loads((tmp_path / "out" / "result.json").read_text("utf-8")))
    found = {name: each["value"] for name, each in result["checks"]["starting"].items()}
    start = result["start_up"]["start_time"]["value"]
    with xr.open_dataset(tmp_path / "out" / "result.nc", group="start_up") as run:
        names = ("time", "motor.air_gap_tau", "motor.w", "machine.J")
        rise, after = (
            {name: run[name].sel(time=of).values for name in names}
            for of in (slice(None, start), slice(start, None))
        )
    impulse = np.trapezoid(rise["motor.air_gap_tau"], rise["time"])
    assert found["motor_torque"] == pytest.approx(impulse / start, rel=1e-9)
    total = found["rotor_inertia"] + np.mean(after["machine.J"])
    assert found["inertia"] == pytest.approx(total, rel=0.02)
    counter = max(0.0, (impulse - found["inertia"] * rise["motor.w"][-1]) / start)
    assert found["counter_torque"] == pytest.approx(counter, rel=1e-6)
    assert found["rated_current"] == pytest.approx(750.0 / (0.825 * 0.75 * 3.0**0.5 * 400.0), rel=1e-9)
    expected = 2000.0 * found["rotor_inertia"] / found["inertia"] * (1.0 - counter / found["motor_torque"])
    expected *= 1.0 - (found["current"] / found["rated_current"]) ** 2
    (check,) = (each for each in result["checks"]["rows"] if each["title"] == "starts per hour")
    assert check["limit"]["value"] == pytest.approx(expected, rel=1e-9)
    assert check["utilisation"]["value"] == pytest.approx(30.0 / expected, rel=1e-9)


def test_the_starts_of_sizing_are_asked_for_where_the_table_does_not_say():
    assert parse("[sizing]\nstarts_per_hour = 12").plans["checks"].starts_per_hour == 12.0
    assert parse("[sizing]\n[starting]\nper_hour = 7").plans["checks"].starts_per_hour == 7.0
    assert parse("").plans["checks"].starts_per_hour == 0.0
