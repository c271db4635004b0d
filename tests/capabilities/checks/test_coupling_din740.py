"""The check of a flexible coupling: the worked example of docs/checks.md, the amplification beside the solved
equations of two inertias, the directions, and a study."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from command import chainunit
from reports import at

from chainunit.capabilities.checks.coupling import (
    CouplingDuty,
    amplification,
    check_coupling,
    coupling_check,
    natural_frequency,
    start_factor,
    swinging,
)
from chainunit.capabilities.checks.row import Checks
from chainunit.capabilities.checks.tables import FlexibleCouplingTable
from chainunit.core.errors import InputError
from chainunit.reading.result_entries import ResultEntries
from chainunit.study.config import parse

DOCS = (Path(__file__).parents[3] / "docs" / "checks.md").read_text("utf-8")
TABLE = FlexibleCouplingTable(
    rated_torque=100.0, peak_torque=300.0, alternating_torque=35.0, temperature_factor=1.2, surge_factor=1.8
)
BASE = {
    "amplitude": 12.0, "mean": 40.0, "largest": 120.0, "frequency": 20.0, "stiffness": 2000.0, "damping": 0.8,
    "drive": 0.05, "load": 0.1, "temperature": 1.2, "start": 1.0, "surge": 1.8,
}  # fmt: skip


def found(table=TABLE, **values):
    v = BASE | values
    time = np.linspace(0.0, 1.0, 4001)
    torque = v["mean"] + v["amplitude"] * np.sin(2.0 * np.pi * v["frequency"] * time)
    rms = math.sqrt(v["mean"] ** 2 + v["amplitude"] ** 2 / 2.0)
    duty = CouplingDuty(
        mean=v["mean"], rms=rms, largest=v["largest"], drive_inertia=v["drive"], load_inertia=v["load"]
    )
    table = replace(
        table,
        stiffness=v["stiffness"],
        damping=v["damping"],
        temperature_factor=v["temperature"],
        surge_factor=v["surge"],
    )
    of = coupling_check(table, duty, time, torque, v["start"], "motor", "jam")
    return of, {row.title: row for row in checked(of, table).rows}


def checked(of, table=TABLE):
    checks = Checks()
    check_coupling(checks, of, table, "a jam")
    return checks


def test_the_example():
    for each in (
        "49.1 N m",
        "220.8 N m",
        "73.6 %",
        "fe = 39.0 Hz",
        "27.5 N m",
        "78.4 %",
        "162 N m",
        "54.0 %",
    ):
        assert each in DOCS, each
    of, rows = found()
    assert rows["rated torque"].utilisation == pytest.approx(0.491, rel=0.01)
    assert rows["peak torque (a jam)"].utilisation == pytest.approx(0.736, rel=0.01)
    assert of.swinging.natural_frequency / (2.0 * math.pi) == pytest.approx(39.0, rel=0.01)
    assert of.swinging.rigid == pytest.approx(12.0, rel=0.001)
    by_hand = math.hypot(1.0, 0.8 / (2 * math.pi)) / math.hypot(1 - (20 / 38.985) ** 2, 0.8 / (2 * math.pi))
    assert by_hand == pytest.approx(1.348, rel=1e-3)
    assert rows["alternating torque"].value == pytest.approx(12 * by_hand * math.sqrt(2) * 1.2, rel=0.01)
    assert rows["alternating torque"].utilisation == pytest.approx(0.784, rel=0.01)
    assert of.swinging.passed < 1e-6 * 12.0
    softer, rows = found(stiffness=400.0)
    assert softer.swinging.natural_frequency / (2.0 * math.pi) == pytest.approx(17.4, rel=0.01)
    assert softer.factors.resonance == pytest.approx(7.92, rel=0.01)
    assert rows["passage through resonance"].value == pytest.approx(162.0, rel=0.01)
    assert rows["passage through resonance"].utilisation == pytest.approx(0.54, rel=0.01)


@pytest.mark.parametrize("frequency", [0.5, 20.0, 38.98, 100.0])
@pytest.mark.parametrize("side", [0, 1])
def test_the_amplification_is_that_of_two_inertias_on_a_complex_spring(frequency, side):
    J, stiffness, damping, w = (0.05, 0.1), 2000.0, 0.8, 2.0 * math.pi * frequency
    spring = stiffness * (1.0 + 1j * damping / (2.0 * math.pi))
    matrix = np.diag([-J[0] * w**2, -J[1] * w**2]) + spring * np.array([[1, -1], [-1, 1]])
    angles = np.linalg.solve(matrix, np.eye(2)[side])
    torque = spring * (angles[0] - angles[1])
    rigid = (1.0 if side == 0 else -1.0) * J[1 - side] / sum(J)
    natural = natural_frequency(stiffness, *J)
    assert complex(amplification(w, natural, damping)) == pytest.approx(torque / rigid, rel=1e-9)


def test_parts_of_several_frequencies_add_with_their_phases():
    time = np.linspace(0.0, 2.0, 8001)
    torque = 5.0 + 3.0 * np.cos(2 * np.pi * 1.5 * time) - 2.0 * np.sin(2 * np.pi * 4.0 * time + 0.4)
    swing = swinging(time, torque, 2.0 * math.pi * 6.0, 0.5)
    fine = np.linspace(0.0, 2.0, 40_001)
    V = [complex(amplification(f, 6.0, 0.5)) for f in (1.5, 4.0)]
    by_hand = np.real(
        3.0 * V[0] * np.exp(2j * np.pi * 1.5 * fine)
        + 2.0j * V[1] * np.exp(1j * (2 * np.pi * 4.0 * fine + 0.4))
    )
    assert swing.elastic == pytest.approx(0.5 * np.ptp(by_hand), rel=1e-3)
    assert swing.weighted == pytest.approx(swing.elastic, rel=1e-9)  # all below 10 Hz
    assert swing.rigid == pytest.approx(0.5 * np.ptp(torque), rel=1e-3)
    assert swinging(time, torque, 2.0 * math.pi * 2.0, 0.5).passed == pytest.approx(2.0, rel=1e-2)


SIGNS = {
    "rated torque": {"mean": 1, "amplitude": 1, "temperature": 1, "largest": 0, "stiffness": 0, "start": 0},
    "peak torque (a jam)": {"largest": 1, "surge": 1, "start": 1, "temperature": 1, "amplitude": 0},
    "alternating torque": {
        "amplitude": 1,
        "stiffness": -1,
        "temperature": 1,
        "start": 0,
        "mean": 0,
        "surge": 0,
    },
}


@pytest.mark.parametrize(
    ("title", "name", "sign"), [(a, b, c) for a, of in SIGNS.items() for b, c in of.items()]
)
def test_the_used_share_moves_in_the_right_direction(title, name, sign):
    shares = [found(**{name: BASE[name] * factor})[1][title].utilisation for factor in (1.0, 1.1, 1.5)]
    steps = np.diff(shares)
    assert np.all(sign * steps > 0.0) if sign else np.allclose(steps, 0.0, atol=1e-9)


@pytest.mark.parametrize(
    ("name", "sign"), [("amplitude", 1), ("damping", -1), ("start", 1), ("temperature", 1), ("largest", 0)]
)
def test_the_passage_moves_in_the_right_direction(name, sign):
    values = BASE | {"stiffness": 400.0}
    shares = [
        found(**values | {name: values[name] * factor})[1]["passage through resonance"].utilisation
        for factor in (1.0, 1.1, 1.5)
    ]
    assert np.all(sign * np.diff(shares) > 0.0) if sign else np.allclose(np.diff(shares), 0.0, atol=1e-9)


def test_each_rating_lessens_its_share_alone():
    rows = found()[1]
    for key, titles in {
        "rated_torque": {"rated torque"},
        "peak_torque": {"peak torque (a jam)", "passage through resonance"},
        "alternating_torque": {"alternating torque"},
    }.items():
        more = found(replace(TABLE, **{key: 2.0 * getattr(TABLE, key)}))[1]
        assert {title for title in rows if more[title].utilisation < rows[title].utilisation} == titles


def test_start_factors_and_missing_data():
    assert [start_factor(x) for x in (0.0, 120.0, 121.0, 240.0, 241.0)] == [1.0, 1.0, 1.3, 1.3, None]
    of, _ = found()
    missing = checked(replace(of, alternating=None, passage=None)).missing
    elastic, speed = (
        f"add [flexible_coupling] with {what}, by its maker"
        for what in ("stiffness and damping", "largest_speed")
    )
    assert [each.why for each in missing] == [elastic, elastic, speed]


# -- a study

STUDY = """
title = "Coupling"
[system]
motor = "IE3 4-pole 0.75 kW, 80M"
[run]
settle_turns = 2
[flexible_coupling]
place = "crank"
rated_torque = 100
peak_torque = 200
stiffness = 900
damping = 0.8
temperature_factor = 1.2
"""


@pytest.mark.slow
def test_the_numbers_of_a_study_follow_from_its_runs(tmp_path):
    (tmp_path / "mine.toml").write_text(STUDY, "utf-8")
    assert chainunit("study", "mine.toml", "-o", "out", cwd=tmp_path).returncode == 0
    result = ResultEntries(json.loads((tmp_path / "out" / "result.json").read_text("utf-8")))
    of = result["checks"]["flexible_coupling"]
    ratio = result["machine"]["ratio"]["value"]
    with xr.open_dataset(tmp_path / "out" / "result.nc", group="start_up") as run:
        whole = result["run"]["turns"]["value"]
        angle = run["machine.phi0"].values / ratio
        turns = run.sel(time=angle >= angle[-1] - 2.0 * np.pi * whole)
        torque, time = turns["machine.tau"].values * ratio, turns["time"].values
        largest = np.max(np.abs(run["machine.tau"].values)) * ratio
        inertia = np.mean(turns["machine.J"].values) * ratio**2
    assert of["place"] == "crank" and of["run"] == "start_up"
    assert of["largest"]["value"] == pytest.approx(largest, rel=1e-9)
    rms = math.sqrt(np.trapezoid(torque**2, time) / (time[-1] - time[0]))
    assert of["rms"]["value"] == pytest.approx(rms, rel=2e-3)
    assert of["load_inertia"]["value"] == pytest.approx(inertia, rel=1e-2)
    assert of["swinging"]["rigid"]["value"] == pytest.approx(0.5 * np.ptp(torque), rel=1e-2)
    rows = [row for row in result["checks"]["rows"] if row["of"] == "coupling"]
    assert len(rows) == 3
    for row in rows:
        assert at(result, row["number"])["value"] == row["value"]["value"]
        assert all(at(result, place)["value"] is not None for place in row["numbers"].values())
    missing = {each["what"]: each["why"] for each in result["checks"]["not_checked"]}
    assert missing["coupling, alternating torque"].endswith("with alternating_torque, by its maker")


def test_a_wrong_place_is_refused():
    with pytest.raises(InputError, match=r"flexible_coupling\.place"):
        parse('[flexible_coupling]\nplace = "gear"')
    plan = parse("[flexible_coupling]\nrated_torque = 5").plans["checks"]
    assert plan.coupling_place == "motor" and plan.coupling.surge_factor == 2.0
    assert parse("").plans["checks"].coupling is None
