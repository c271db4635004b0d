"""The files for other programs: the numbers are those of the study, and the cycle comes back."""

from __future__ import annotations

import csv
import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from command import chainunit

from chainunit import InputError
from chainunit.capabilities.handover.page import hand_over
from chainunit.reading.result_entries import ResultEntries

pytestmark = pytest.mark.slow

LINKAGES = Path(__file__).parents[3] / "examples" / "linkages"
SHORT = "event = []\n[run]\nramp = 0.3\nsettle_turns = 1\n"
STUDIES = {
    "sized": """
title = "A mill picks its motor"
start = "direct"
event = []
[report]
project = "Quarry"
author = "A. Miller"
date = 2026-03-01
[machine]
left = { wall_mass = 540, web_mass = 216 }
right = { wall_mass = 540, web_mass = 216 }
[usage]
hours = 7.5
days = 220
[sizing]
candidates = 3
poles_least = 4
fluctuation = 0.1
inertia_ratio = 50
""",
    "knife": SHORT + '[system]\nmachine = "KnifeDrive"\n',
    "press": f"""{SHORT}crank_speed = "60 rpm"
[system]
motor = "IE3 4-pole 5.5 kW, 132S"
[machine]
linkage = '{LINKAGES / "slider_crank_press.toml"}'
""",
    "line": SHORT
    + '[driveline]\nplace = "motor"\nalpha1 = "5 deg"\nalpha2 = "5 deg"\nc2 = 300\nd2 = 1\nc3 = 300\nd3 = 1\n',
}


@pytest.fixture(scope="module", params=STUDIES)
def folder(request, tmp_path_factory):
    """A folder with the result of a study and its files for others, in the folder ``out``."""
    folder = tmp_path_factory.mktemp(request.param)
    (folder / "study.toml").write_text(STUDIES[request.param], "utf-8")
    done = chainunit("study", "study.toml", "-o", "results", cwd=folder)
    assert done.returncode in (0, 1), done.stderr
    done = chainunit("handover", "results", "-o", "out", cwd=folder)
    assert done.returncode == 0, done.stderr
    return folder


def only(name):
    """A test of one study."""
    return pytest.mark.parametrize("folder", [name], indirect=True, scope="module")


def numbers(folder):
    return ResultEntries(json.loads((folder / "results" / "result.json").read_text("utf-8")))


def plain(folder):
    return np.loadtxt(folder / "results" / "load_cycle.csv", delimiter=",", skiprows=1).T


def sizing(folder, out="out"):
    return json.loads((folder / out / "sizing.json").read_text("utf-8"))


def value_of(data, name):
    """The value of a name such as ``motor.torque_rms`` of sizing.json."""
    part, value = name.split(".")
    entry = data[part][value]
    return entry["value"] if isinstance(entry, dict) else entry


def cycle_of(file):
    """Time, angle, speed, acceleration, and the motor's torque of a cycle.csv, shape (5, time)."""
    columns = np.loadtxt(file, delimiter=";", skiprows=1).T
    return *columns[:4], -columns[4]


def test_a_name_has_a_value_with_a_unit_or_is_open(folder):
    data = sizing(folder)
    parts = {
        name: part
        for name, part in data.items()
        if isinstance(part, dict) and name not in ("verdict", "files")
    }
    names = {f"{name}.{key}": value for name, part in parts.items() for key, value in part.items()}
    assert {"application.cycles_per_minute", "drive.load_inertia", "motor.torque_rms"} <= set(names)
    assert [name for name in names if value_of(data, name) is None] == data["open"]
    numbers = {name: entry for name, entry in names.items() if isinstance(entry, dict)}
    assert len(numbers) > 15 and all(set(entry) == {"value", "unit"} for entry in numbers.values())
    page = (folder / "out" / "sizing.md").read_text("utf-8").replace("\\_", "_")
    said, left_open = page.split("## What the files leave open")
    for name in names:
        assert f"| {name} |" in (left_open if name in data["open"] else said), name
    assert {*data["files"]} == {"cycle.csv", "run.csv", "load_cycle.csv", "study.json"}
    assert all((folder / "out" / name).is_file() for name in data["files"])


def test_the_cycle_comes_back(folder):
    own_time, angle, own_speed, acceleration, own_torque = cycle_of(folder / "out" / "cycle.csv")
    time, speed, torque, _ = plain(folder)
    np.testing.assert_array_equal([own_time, own_speed, own_torque], [time, speed, torque])
    # angle and acceleration are those of this speed
    steps = np.diff(time) * 0.5 * (speed[1:] + speed[:-1])
    np.testing.assert_allclose(np.diff(angle), steps, atol=2e-3 * np.max(np.abs(steps)))
    gained = np.trapezoid(acceleration, time)
    assert gained == pytest.approx(speed[-1] - speed[0], abs=2e-3 * np.max(np.abs(speed)))


def test_the_whole_run_begins_at_rest_and_ends_with_the_steady_turns(folder):
    of_run, angle, run_speed, _, run_torque = cycle_of(folder / "out" / "run.csv")
    time, speed, torque, _ = plain(folder)
    assert of_run[0] == angle[0] == run_speed[0] == 0.0
    # the speed of the first row may come back within a turn, in all nine digits, but not with its torque
    is_first = np.isclose(run_speed, speed[0], rtol=1e-9, atol=0.0) & np.isclose(
        run_torque, torque[0], rtol=1e-8, atol=0.0
    )
    begin = np.flatnonzero(is_first)[-1]
    # the last row of a turn lies between two steps
    own = slice(begin, begin + len(time) - 1)
    np.testing.assert_allclose(run_torque[own], torque[:-1], rtol=1e-8, atol=1e-8 * np.max(np.abs(torque)))
    np.testing.assert_allclose(of_run[own] - of_run[begin], time[:-1], atol=1e-8)


def test_the_numbers_are_those_of_the_result(folder):
    data, result = sizing(folder), numbers(folder)
    assert (folder / "out" / "candidates.csv").exists() == ("sizing" in result)
    steady = result["answers"]["steady"]
    time, speed, torque, inertia = plain(folder)
    assert value_of(data, "motor.current_peak") == steady["current_peak"]["value"]
    assert value_of(data, "motor.torque_rms") == steady["motor_torque_rms"]["value"]
    mean = steady["supply_power_mean"]["value"]
    taken, returned = (value_of(data, f"motor.electric_power_{name}") for name in ("taken", "returned"))
    if mean is not None:
        energy = mean * time[-1] / 3.6e6
        assert value_of(data, "drive.energy_per_cycle") == pytest.approx(energy, rel=1e-12)
        # without what the masses take up
        assert taken - returned == pytest.approx(mean, rel=0.02)
    assert value_of(data, "application.cycles_per_minute") == 60.0 / time[-1]
    assert value_of(data, "motor.speed_peak") == pytest.approx(np.max(speed) * 30 / np.pi, rel=1e-8)
    power = math.sqrt(np.trapezoid((torque * speed) ** 2, time) / time[-1])
    assert value_of(data, "motor.power_rms") == pytest.approx(power, rel=1e-12)
    rotor, load = result["motor"]["rotor.J"]["value"], value_of(data, "drive.load_inertia")
    assert load >= np.max(inertia) and value_of(data, "drive.rotor_inertia") == rotor
    assert value_of(data, "drive.inertia_ratio") == pytest.approx(load / rotor, rel=1e-12)
    assert data["verdict"] == {name: result["verdict"][name]["text"] for name in ("model", "motor")}
    kinds = {"warning": result["warnings"], "note": result["notes"]}
    messages = [{"kind": kind, "text": each["text"]} for kind, texts in kinds.items() for each in texts]
    assert data["messages"] == messages


def test_the_checks_have_one_number_for_each_utilisation(folder):
    rows = numbers(folder)["checks"]["rows"]
    assert (folder / "out" / "checks.csv").exists() == bool(rows)
    if rows:
        with (folder / "out" / "checks.csv").open(newline="", encoding="utf-8") as file:
            written = list(csv.DictReader(file, delimiter=";"))
        assert [each["title"] for each in written] == [row["title"] for row in rows]
        for own, row in zip(written, rows, strict=True):
            assert float(own["utilisation"]) == row["utilisation"]["value"]
            assert float(own["value"]) == row["value"]["value"] and own["unit"] == row["limit"]["unit"]
            assert own["holds"] == ("yes" if row["holds"] else "no")


@only("sized")
def test_a_sized_drive_has_one_number_for_each_utilisation(folder):
    data, found = sizing(folder), numbers(folder)["sizing"]
    checks = found["candidates"][0]["checks"]
    with (folder / "out" / "candidates.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file, delimiter=";"))
    assert [row["motor"] for row in rows] == [each["motor"] for each in found["candidates"]]
    assert [row["reason"] for row in rows] == [each["reason"] for each in found["candidates"]]
    for name, check in checks.items():
        assert float(rows[0][f"{name}.utilisation"]) == check["utilisation"]["value"]
    for name, check in (("torque_utilisation", "peak_torque"), ("temperature_utilisation", "temperature")):
        share = checks[check]["utilisation"]["value"]
        assert value_of(data, f"motor.{name}") == pytest.approx(100.0 * share, rel=1e-12)
    assert value_of(data, "motor.winding_temperature") == pytest.approx(
        checks["temperature"]["value"]["value"] + found["asked"]["ambient"]["value"] - 273.15
    )
    ratio = value_of(data, "drive.inertia_ratio")
    assert ratio == pytest.approx(checks["inertia"]["value"]["value"], rel=1e-3)
    assert (data["project"], data["author"]) == ("Quarry", "A. Miller")
    assert data["date"] == "2026-03-01T00:00:00+00:00"
    assert value_of(data, "gear.ratio") == found["candidates"][0]["ratio"]["value"]


def test_order_numbers_of_catalogues_are_handed_over(tmp_path):
    """Motor, gear and both couplings are rows of catalogues, and have the order numbers of these rows; without one
    there, nothing is written."""
    example = LINKAGES.parent / "own_catalogue.toml"
    text = example.read_text("utf-8").replace('"catalogue/', f'"{example.parent.as_posix()}/catalogue/')
    (tmp_path / "own.toml").write_text(text, "utf-8")
    done = chainunit("study", "own.toml", "-o", "results", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert chainunit("handover", "results", "-o", "out", cwd=tmp_path).returncode == 0
    data = sizing(tmp_path)
    rows = {}
    for file in ("motors", "gears", "torque_limiters", "flexible_couplings"):
        with (example.parent / "catalogue" / f"{file}.csv").open(newline="", encoding="utf-8") as table:
            rows |= {row["designation"]: row["order_number"] for row in csv.DictReader(table)}
    kinds = ("motor", "gear", "torque limiter")
    chosen = {part["part"]: part["designation"] for part in numbers(tmp_path)["sizing"]["parts"]["parts"]}
    assert tuple(chosen) == kinds
    flexible = numbers(tmp_path)["checks"]["flexible_coupling"]["candidates"][0]["designation"]
    for kind, designation in {**chosen, "flexible coupling": flexible}.items():
        part = kind.replace(" ", "_")
        assert value_of(data, f"{part}.order_number") == rows[designation] != ""
        assert value_of(data, f"{part}.designation") == designation
    assert not any("order_number" in name for name in data["open"])
    spoilt = numbers(tmp_path)
    spoilt["sizing"]["parts"]["parts"][1]["order_number"] = ""
    (tmp_path / "results" / "result.json").write_text(json.dumps(spoilt), "utf-8")
    assert chainunit("handover", "results", "-o", "other", cwd=tmp_path).returncode == 0
    data = sizing(tmp_path, "other")
    assert "gear.order_number" in data["open"] and "motor.order_number" not in data["open"]


def test_the_hours_of_the_usage_are_handed_over(folder):
    data, names = sizing(folder), ["application.hours_per_day", "application.days_per_year"]
    is_known = "usage" in numbers(folder)
    assert [value_of(data, name) for name in names] == ([7.5, 220.0] if is_known else [None, None])
    assert (set(names) <= set(data["open"])) != is_known


@pytest.fixture
def results(folder, tmp_path):
    """A copy of the results of a study, whose files may be spoilt."""
    for name in ("result.json", "result.nc", "load_cycle.csv"):
        (tmp_path / name).write_bytes((folder / "results" / name).read_bytes())
    return tmp_path


def refused(results):
    with pytest.raises(InputError) as caught:
        hand_over(results)
    return str(caught.value)


@only("knife")
def test_wrong_results_are_refused(results):
    cycle = (results / "load_cycle.csv").read_text().splitlines()
    spoilt = [cycle[0], *(",".join([*row.split(",")[:2], "1", row.split(",")[3]]) for row in cycle[1:])]
    (results / "load_cycle.csv").write_text("\n".join(spoilt))
    assert "are not of the same run; run the study again" in refused(results)
    (results / "load_cycle.csv").write_text("\n".join(x.rsplit(",", 1)[0] for x in cycle))
    assert "the first line of a load cycle must be" in refused(results)
    (results / "load_cycle.csv").unlink()
    assert "makes no whole turn in steady running" in refused(results)
    data = ResultEntries(json.loads((results / "result.json").read_text()))
    (results / "result.json").write_text(json.dumps(data | {"status": "failed: no"}))
    assert "is not complete (failed: no)" in refused(results)


@only("knife")
def test_a_study_without_a_title_begins_its_sentence(folder):
    said = (folder / "out" / "sizing.md").read_text("utf-8")
    assert re.search(r"^\d+ values of the drive are in sizing\.json\.$", said, re.MULTILINE)


def test_a_folder_without_a_study_is_refused_before_all_else(tmp_path):
    done = chainunit("handover", "nothere", "-o", "out", cwd=tmp_path)
    assert done.returncode == 2 and "nothere: has no result" in done.stderr
    assert not (tmp_path / "out").exists()


@only("knife")
def test_an_earlier_result_is_refused(results):
    import xarray as xr

    run = xr.load_dataset(results / "result.nc", group="start_up")
    del run.attrs["steady_begin"]
    run.to_netcdf(results / "result.nc", group="start_up", mode="w")
    assert "an earlier version wrote it; run the study again" in refused(results)
    (results / "result.nc").write_bytes(b"no")
    assert "cannot be read" in refused(results)


HEAD = "time [s],speed [rad/s],torque [N.m],inertia [kg.m2]"


@only("knife")
@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("", "the first line of a load cycle must be time"),
        ("a\n1,2,3,4\n2,3,4,5\n", f"the first line of a load cycle must be {HEAD}; run the study again"),
        (f"{HEAD}\n1,2\n1,2\n", "a row of the load cycle is not four numbers"),
        (f"{HEAD}\n1,2,3,x\n1,2,3,4\n", "a row of the load cycle is not four numbers"),
        (f"{HEAD}\n1,2,3,4\n1,2\n", "a row of the load cycle is not four numbers"),
        (f"{HEAD}\n1,2,3,4\n", "at least two rows of finite numbers"),
        (f"{HEAD}\n1,2,3,4\n2,3,4,nan\n", "at least two rows of finite numbers"),
        (f"{HEAD}\n2,3,4,5\n1,3,4,5\n", "the time runs backwards, from 2 s to 1 s"),
    ],
)
def test_a_file_that_is_no_load_cycle_is_refused(results, content, words):
    (results / "load_cycle.csv").write_text(content, "utf-8")
    said = refused(results)
    assert words in said.partition("load_cycle.csv: ")[2]
    assert said.endswith("run the study again")


def test_the_columns_have_their_units(folder):
    heads = (folder / "out" / "cycle.csv").read_text("utf-8").splitlines()[0]
    assert (
        heads
        == "Time [s];AngularPosition [rad];AngularVelocity [rad/s];AngularAcceleration [rad/s²];LoadTorque [Nm]"
    )
