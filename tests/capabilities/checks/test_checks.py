"""Checks by clause: the worked examples of docs/checks.md, the direction in which each input moves the used share,
and a study whose checks are computed once more from its stored runs."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from command import chainunit
from reports import at

from chainunit.capabilities.checks import bearings
from chainunit.capabilities.checks.row import CheckRow, Checks
from chainunit.capabilities.checks.tables import BearingTable
from chainunit.core.errors import InputError
from chainunit.reading.result_entries import ResultEntries
from chainunit.reading.tables import instance
from chainunit.reading.text import number
from chainunit.study.config import parse

pytestmark = pytest.mark.second

DOCS = (Path(__file__).parents[3] / "docs" / "checks.md").read_text("utf-8")
STUDY = """
title = "Bearings of a chain unit"

[run]
settle_turns = 2

[[event]]
type = "jam"
side = "left"

[driveline]

[bearing.O1]
kind = "ball"
C = "20 kN"
C0 = "9 kN"
elements = 9

[bearing."C rocker pivot"]
kind = "roller"
C = "150 kN"
C0 = "200 kN"
elements = 24
diameter_ratio = 0.1
life = "30000 h"

[bearing.A1]
kind = "plain"
diameter = "50 mm"
width = "40 mm"
pressure = "20 MPa"
speed = "0.2 m/s"
"""


def table(**values):
    return instance(BearingTable, values)


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        (('kind = "roller"', 'kind = "spherical roller"'), 'was "roller" meant?'),
        (('kind = "ball"', 'kind = "deep groove ball"'), 'was "ball" meant?'),
        (('life = "30000 h"', "life = 30000"), 'was "30000 h" meant?'),
    ],
)
def test_bearings_of_a_catalogue_are_understood(changed, told):
    """A kind by its full name, and a life in hours."""
    with pytest.raises(InputError) as refusal:
        parse(STUDY.replace(*changed))
    assert told in str(refusal.value) and len(refusal.value.faults) == 1


def triangle(swing, cycles=3, points=200):
    """Time [s] and angle [rad] of a pin that swings there and back once a second at an even speed."""
    time = np.linspace(0.0, cycles, 2 * cycles * points + 1)
    return time, swing * (1.0 - np.abs(2.0 * (time % 1.0) - 1.0))


def rows_of_bearing(check, bearing, given, run="jam"):
    """The rows of a bearing by their titles."""
    checks = Checks()
    check(checks, "C", bearing, given, run)
    return {row.title: row for row in checks.rows}


def documented(*numbers):
    """The numbers of an example, as they stand in the documentation."""
    for each in numbers:
        assert each in DOCS, each


def test_the_example_of_a_rolling_bearing():
    time, angle = triangle(math.radians(60.0))
    rising = np.concatenate([np.diff(angle) > 0.0, [False]])
    force = np.where(rising, 10e3, 20e3)
    given = table(C=100e3, C0=120e3, elements=18.0, diameter_ratio=0.2, static_safety=3.0)
    found = bearings.rolling_bearing("roller", given, 2.0 * time, 3.0, force, angle, 40e3, "jam")
    documented("16.71 kN", "388.9 million turns", "648 200 h", "50.0 deg", "83.3 %")
    # the force changes within a step of the cycle, of which there are 200 in a way
    assert found.load == pytest.approx(16.71e3, rel=0.01)
    assert bearings.rating_life(100e3, 16.713e3, 10.0 / 3.0, 2.0 * math.pi) == pytest.approx(
        388.9e6, rel=1e-3
    )
    assert found.life / 3600.0 == pytest.approx(648_200.0, rel=0.01)
    assert found.speed == pytest.approx(10.0 * 2.0 * math.pi / 60.0, rel=1e-9)
    assert found.amplitude_factor == pytest.approx(3.0, rel=1e-9)  # 180/60, one swing a turn
    assert found.static_safety == pytest.approx(3.0, rel=1e-12)
    assert math.degrees(found.critical_swing) == pytest.approx(50.0, rel=1e-3)
    rows = rows_of_bearing(bearings.check_rolling, found, given, "a jam")
    assert rows["swing"].utilisation == pytest.approx(0.833, rel=0.01) and rows["swing"].holds
    assert rows["static safety (a jam)"].utilisation == pytest.approx(1.0, rel=1e-12)
    assert rows["equivalent load"].limit == 50e3


def test_the_example_of_a_plain_bearing():
    time, angle = triangle(math.radians(20.0))
    given = table(diameter=0.06, width=0.06, pressure=20e6, speed=0.1, pv=0.1e6)
    found = bearings.plain_bearing(given, time, np.full_like(time, 7200.0), angle, 36e3, "jam")
    documented("10.0 MPa", "0.02094 m/s", "0.0419 MPa m/s")
    assert found.pressure == pytest.approx(10.0e6, rel=0.01)
    assert found.speed == pytest.approx(0.02094, rel=0.01)
    assert found.pv == pytest.approx(0.0419e6, rel=0.01)


def test_the_example_of_a_rigid_model():
    documented("45/3 = 15", "66.7 %")
    row = CheckRow("line", "ratio", "VDI 2149", "", 45.0 / 3.0, 10.0, "x", {}, at_least=True)
    assert row.utilisation == pytest.approx(0.667, rel=0.01) and row.holds


def test_a_constant_force_is_its_own_equivalent_load_and_round_turning_has_no_swing():
    time = np.linspace(0.0, 4.0, 401)
    for kind in ("ball", "roller"):
        found = bearings.rolling_bearing(
            kind, table(C=50e3), time, 2.0, np.full_like(time, 5e3), math.pi * time, 5e3, "steady"
        )
        assert found.load == pytest.approx(5e3, rel=1e-12) and found.swing is None
        assert found.amplitude_factor == pytest.approx(1.0, rel=1e-12)
        assert found.life == pytest.approx(
            10.0 ** bearings.EXPONENT[kind] * 2e6, rel=1e-9
        )  # half a turn a second
        assert bearings.rating_life(found.needed, 5e3, found.p, found.speed) == pytest.approx(7.2e7, rel=1e-9)


def used(kind, force=8e3, swing=0.8, speed=1.0, largest=20e3, **values):
    """By title, the used shares of a bearing under an uneven force."""
    sizes = {"ball": {"C": 60e3, "C0": 50e3, "elements": 30.0, "static_safety": 1.5}}
    sizes["roller"] = sizes["ball"]
    sizes["plain"] = {"diameter": 0.06, "width": 0.05, "pressure": 20e6, "speed": 0.1, "pv": 0.3e6}
    given = table(**sizes[kind] | values)
    time, angle = triangle(swing)
    cycle = force * (1.0 + 0.3 * np.sin(2.0 * np.pi * time))
    if kind == "plain":
        found = bearings.plain_bearing(given, time / speed, cycle, angle, largest, "jam")
        rows = rows_of_bearing(bearings.check_plain, found, given)
    else:
        found = bearings.rolling_bearing(kind, given, time / speed, 3.0, cycle, angle, largest, "jam")
        rows = rows_of_bearing(bearings.check_rolling, found, given)
    return {title: row.utilisation for title, row in rows.items()}


ROLLING = {
    "rating life": {
        "force": 1,
        "swing": 1,
        "speed": 1,
        "C": -1,
        "life": 1,
        "life_factor": -1,
        "largest": 0,
        "C0": 0,
    },
    "equivalent load": {"force": 1, "swing": 0, "speed": 0, "C": -1, "largest": 0, "life": 0},
    "static safety (jam)": {"force": 0, "largest": 1, "C0": -1, "static_safety": 1, "C": 0, "swing": 0},
    "swing": {"force": 0, "swing": -1, "elements": -1, "diameter_ratio": 1, "C": 0, "speed": 0},
}
PLAIN = {
    "pressure (jam)": {
        "force": 0,
        "largest": 1,
        "diameter": -1,
        "width": -1,
        "pressure_limit": -1,
        "speed": 0,
    },
    "sliding speed": {"force": 0, "swing": 1, "speed": 1, "diameter": 1, "width": 0, "speed_limit": -1},
    # the diameter enters speed and area alike
    "pressure times speed": {
        "force": 1,
        "swing": 1,
        "speed": 1,
        "width": -1,
        "diameter": 0,
        "pv": -1,
        "largest": 0,
    },
}
BASE = {
    "force": 8e3, "swing": 0.8, "speed": 1.0, "largest": 20e3, "C": 60e3, "C0": 50e3, "life": 7.2e7,
    "life_factor": 1.0, "static_safety": 1.5, "elements": 12.0, "diameter_ratio": 0.2, "diameter": 0.06,
    "width": 0.05, "pv": 0.3e6,
}  # fmt: skip


@pytest.mark.parametrize(
    ("kind", "title", "name", "sign"),
    [
        (kind, title, name, sign)
        for kind, of in (("ball", ROLLING), ("roller", ROLLING), ("plain", PLAIN))
        for title, signs in of.items()
        for name, sign in signs.items()
    ],
)
def test_the_used_share_moves_in_the_right_direction(kind, title, name, sign):
    shares = []
    for factor in (1.0, 1.1, 1.3, 2.0):
        if name.endswith("_limit"):
            limits = {"pressure_limit": {"pressure": 20e6 * factor}, "speed_limit": {}}[name]
            if name == "speed_limit":
                given = table(diameter=0.06, width=0.05, speed=0.1 * factor)
                time, angle = triangle(0.8)
                found = bearings.plain_bearing(given, time, np.full_like(time, 8e3), angle, 2e4, "jam")
                (row,) = rows_of_bearing(bearings.check_plain, found, given).values()
                shares.append(row.utilisation)
                continue
            shares.append(used(kind, **limits)[title])
        else:
            shares.append(used(kind, **{name: BASE[name] * factor})[title])
    steps = np.diff(shares)
    if sign:
        assert np.all(sign * steps > 0.0), shares
    else:
        assert np.allclose(steps, 0.0, atol=1e-12), shares


def test_a_pin_that_carries_or_turns_nothing_lasts():
    time = np.linspace(0.0, 1.0, 50)
    for force, angle in ((np.zeros(50), time), (np.ones(50), np.zeros(50))):
        given = table(C=1e3)
        of = bearings.rolling_bearing("ball", given, time, 1.0, force, angle, float(force[0]), "steady")
        rows = rows_of_bearing(bearings.check_rolling, of, given)
        assert of.life is None and all(row.holds for row in rows.values())
        assert rows["rating life"].utilisation == 0.0


# -- a study


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    folder = tmp_path_factory.mktemp("checks")
    (folder / "mine.toml").write_text(STUDY, "utf-8")
    assert chainunit("study", "mine.toml", "-o", "out", cwd=folder).returncode == 0
    return folder / "out"


@pytest.fixture(scope="module")
def result(done):
    return ResultEntries(json.loads((done / "result.json").read_text("utf-8")))


def rows_of(result, pin):
    return {row["title"].partition(" (")[0]: row for row in result["checks"]["rows"] if row["of"] == pin}


def test_each_check_names_its_clause_and_the_place_of_its_number(result):
    rows = result["checks"]["rows"]
    # the rocker swings too little for a rating life
    assert len(rows) == 3 + 3 + 2 + 2 + 1 and "rating life" not in rows_of(result, "C rocker pivot")
    for row in rows:
        there = at(result, row["number"])
        assert there["value"] == row["value"]["value"] and there["unit"] == row["value"]["unit"]
        assert row["clause"] and row["formula"]
        for place in row["numbers"].values():
            assert at(result, place)["value"] is not None
        value, limit = row["value"]["value"], row["limit"]["value"]
        share = limit / value if row["at_least"] else value / limit
        assert row["utilisation"]["value"] == pytest.approx(share, rel=1e-12)
        assert row["holds"] == (share <= 1.0)


def test_the_numbers_follow_from_the_stored_runs(done, result):
    """Once more, by hand, from angle and force of the rocker's pivot in the run of the start-up."""
    turns = result["run"]["turns"]["value"]
    with xr.open_dataset(done / "result.nc", group="start_up") as run:
        angle = run["machine.phi0"].values  # the driveline is behind the gear
        run = run.sel(time=angle >= angle[-1] - 2.0 * np.pi * turns)
        force = np.hypot(run["machine.pivot.fx"].values, run["machine.pivot.fy"].values)
        psi, span = run["machine.rocker.psi"].values, float(np.ptp(run["time"].values))
    p, way = 10.0 / 3.0, np.abs(np.diff(psi))
    load = (np.sum((0.5 * (force[1:] + force[:-1])) ** p * way) / np.sum(way)) ** (1.0 / p)
    hours = (150e3 / load) ** p * 1e6 / (np.sum(way) / (2.0 * np.pi) / span) / 3600.0
    found = result["checks"]["rolling"]["C rocker pivot"]
    assert found["load"]["value"] == pytest.approx(load, rel=2e-3)
    assert found["life"]["value"] / 3600.0 == pytest.approx(hours, rel=8e-3)
    assert found["swing"]["value"] == pytest.approx(np.ptp(psi), rel=1e-3)
    # the largest force is that of all runs, not of steady running
    peaks = [pins["C rocker pivot"]["peak"]["value"] for pins in result["pins"].values()]
    assert found["largest_force"]["value"] == max(peaks) > 1.1 * np.max(force)
    assert result["checks"]["rolling"]["O1 crank bearing"]["swing"]["value"] is None
    # the swing of the rocker is below 4 pi/(24 x 0.9) = 33.3 deg
    row = rows_of(result, "C rocker pivot")["swing"]
    assert not row["holds"] and row["limit"]["value"] == pytest.approx(math.radians(100.0 / 3.0), rel=1e-9)
    whys = {each["what"]: each["why"] for each in result["checks"]["not_checked"]}
    assert whys["C rocker pivot, rating life"].startswith(
        "its swing of 17.3 deg stays below 33.3 deg, from where on"
    )
    (warning,) = (each for each in result["warnings"] if each["code"] == "check-needed")
    assert warning["text"].startswith("C rocker pivot: swing 17.3 deg, and at least 33.3 deg are needed")


def test_both_supports_have_the_bearing_of_their_common_name(result):
    assert list(result["checks"]["plain"]) == ["A1 left support", "A1 right support"]
    missing = {each["what"]: each["why"] for each in result["checks"]["not_checked"]}
    assert missing["A1 left support, pressure times speed"] == "the file gives no permitted pv"
    assert "A crank pin, Bd coupler pin" in next(what for what in missing if what.startswith("bearings at"))


def test_page_markdown_and_result_have_one_share(done, result):
    page, text = ((done / name).read_text("utf-8") for name in ("report.html", "result.md"))
    for k, row in enumerate(result["checks"]["rows"]):
        used = json.dumps(row["utilisation"]["value"])
        written = f'data-path="findings.checks.rows.{k}.utilisation" value="{used}"'
        assert written in page
        line = next(line for line in text.splitlines() if line.startswith(f"| {row['of']}: {row['title']} |"))
        assert number(row["utilisation"]["value"], "1", "used") in line
        assert row["clause"] in line
    assert "Parts that were not checked" in page and "the file gives no permitted pv" in text


def test_the_rigid_model_has_both_numbers(result):
    row = rows_of(result, "shaft line")["lowest natural frequency over that of the turns"]
    line = result["rigid_line"]
    both = line["natural_frequency"]["value"] / line["driver_frequency"]["value"]
    assert row["value"]["value"] == pytest.approx(both, rel=1e-12) and row["limit"]["value"] == 10.0


# -- refusals

REFUSALS = [
    ('[bearing.C1]\nkind = "ball"\nC = 1e5', "bearing.C1: is no turning pin", "there are O1 crank bearing"),
    ('[bearing."C rocker pivo"]\nkind = "ball"\nC = 1e5', "is no turning pin", 'was "C rocker pivot" meant?'),
    ("[bearing.C]\nC = 1e5", "bearing.C.kind: must be given", "one of ball, roller, plain"),
    ('[bearing.C]\nkind = "bal"\nC = 1e5', "bearing.C.kind", 'was "ball" meant?'),
    ('[bearing.C]\nkind = "ball"', "bearing.C.C: must be given", "for the kind ball"),
    ('[bearing.C]\nkind = "plain"\ndiameter = 0.1', "bearing.C.width: must be given", "for the kind plain"),
    ('[bearing.C]\nkind = "plain"\ndiameter = 0.1\nwidth = 0.1\nC = 1', "bearing.C.C: is of the kind ball or roller",
     "and the kind is plain; leave it out"),
    ('[bearing.C]\nkind = "ball"\nC = 1\npv = 1', "bearing.C.pv: is of the kind plain",
     "and the kind is ball; leave it out"),
    ('[bearing.C]\nkind = "ball"\nC = "5 m"', "bearing.C.C", 'such as "2 N"'),
    ('[bearing.C]\nkind = "ball"\nC = -1', "bearing.C.C = -1", "must be > 0 N"),
    ('[bearing.C]\nkind = "ball"\nC = 1\nC1 = 3', "bearing.C.C1: unknown key", "known here: C, C0, life"),
    ("bearing = 3", "bearing = 3", "must be a table"),
    ("[bearing]\nC = 3", "bearing.C = 3", "must be a table"),
    (
        '[bearing.A1]\nkind = "ball"\nC = 1\n[bearing."A1 left"]\nkind = "ball"\nC = 1',
        "the pin A1 left support has its bearing in bearing.A1",
        "leave out one of the two",
    ),
]  # fmt: skip


@pytest.mark.parametrize(("text", "words", "remedy"), REFUSALS)
def test_a_wrong_bearing_is_refused(text, words, remedy):
    with pytest.raises(InputError) as refusal:
        parse(text)
    assert words in str(refusal.value) and remedy in str(refusal.value)


def test_a_knife_drive_has_its_own_pins():
    plan = parse('[system]\nmachine = "KnifeDrive"\n[bearing.B]\nkind = "ball"\nC = 1e4').plans["checks"]
    assert list(plan.bearings) == ["B coupler AB", "B leg BC"]
    assert {each.table.static_safety for each in plan.bearings.values()} == {1.5}
    rollers = parse('[bearing.C]\nkind = "roller"\nC = 1e4').plans["checks"].bearings["C rocker pivot"]
    assert rollers.table.static_safety == 3.0


def test_a_machine_of_somebody_else_has_no_known_pins(tmp_path):
    assert chainunit("export", "ChamberForces", "-o", "m.fmu", cwd=tmp_path).returncode == 0
    text = '[system]\nmachine = "m.fmu"\n[bearing.C]\nkind = "ball"\nC = 1e4\n'
    (tmp_path / "s.toml").write_text(text, "utf-8")
    done = chainunit("study", "s.toml", "-o", "out", cwd=tmp_path)
    assert done.returncode == 2
    assert re.search(r"s.toml:3: bearing: needs the pins of the machine, which is an FMU", done.stderr)


@pytest.mark.slow
def test_a_crank_that_stands_has_no_cycle_to_check(tmp_path):
    """A jaw crusher whose motor is too weak for its feed."""
    crusher = Path(__file__).parents[3] / "examples" / "linkages" / "blake_jaw_crusher.toml"
    text = f'event = []\n[system]\nmachine = "{crusher}"\n[motor_shaft]\noverhung_load = 2000\n'
    (tmp_path / "s.toml").write_text(text, "utf-8")
    chainunit("study", "s.toml", "-o", "out", cwd=tmp_path)
    checks = ResultEntries(json.loads((tmp_path / "out" / "result.json").read_text("utf-8")))["checks"]
    assert checks["rows"] == [] and checks["rolling"] == {} and "motor_shaft" not in checks
    missing = {each["what"]: each["why"] for each in checks["not_checked"]}
    cycle = "bearings, gear, shaft of the motor, coupling, shaft sections"
    assert re.fullmatch(r"the eccentric makes \S+ of a turn in the \S+ s that are evaluated", missing[cycle])
