"""``chainunit identify``: from recordings in files to numbers, page and study file."""

from __future__ import annotations

import json
import math
import re
import tomllib
from dataclasses import fields, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from command import chainunit
from synthetic import HiddenRun, Logger, synthetic

from chainunit import InputError, Study
from chainunit.capabilities.identification import identification, suspects
from chainunit.capabilities.identification import page as report
from chainunit.capabilities.identification.information import Proposal
from chainunit.capabilities.identification.result import (
    IdentificationSummary,
    _number,
    identified_tables,
    sentences,
)
from chainunit.capabilities.identification.study_method import IdentificationResult
from chainunit.capabilities.watch.false_loads import false_loads
from chainunit.core.errors import InterruptedRunError
from chainunit.core.native.compilers import compiler
from chainunit.machines.load_observer import LoadObserver
from chainunit.reading.result_entries import ResultEntries
from chainunit.reading.results import as_data
from chainunit.recordings import fit as fitting
from chainunit.recordings.measurands import MEASURANDS
from chainunit.recordings.unknown import Unknown
from chainunit.report.cited import cited
from chainunit.report.console import Forecast, carry_out
from chainunit.study import config as study_files
from chainunit.study.choice import choose
from chainunit.system import Profile

pytestmark = [pytest.mark.slow, pytest.mark.skipif(compiler() is None, reason="no C compiler")]
FILE = """
title = "A mill"
[motor]
speed_control.kp = 0.1017
speed_control.ki = 0.6102
current_control.kp = 33
current_control.ki = 2850
[run]
crank_speed = 3
[feed]
left.processing_force = 0
right.processing_force = 0
[identify]
gain = 0
[[identify.parameter]]
name = "feed.left.material_mass"
from = "10 kg"
to = "60 kg"
[[identify.parameter]]
name = "feed.right.material_mass"
from = 10
to = 60
[[identify.parameter]]
name = "machine.left.web_mass"
deviation = "20 %"
[[identify.parameter]]
name = "machine.joint_damping"
from = 0.1
to = 3
[[identify.run]]
name = "loaded"
file = "loaded.csv.gz"
[[identify.sensor]]
column = "motor.i"
offset = "0.1 A"
"""
EMPTY = '[[identify.run]]\nname = "empty"\nfile = "empty.csv"\nfeed = "none"\n'
TRUTH = {
    "feed.left.material_mass": 41.0,
    "feed.right.material_mass": 24.0,
    "machine.left.web_mass": 24.5,
    "machine.joint_damping": 1.3,
}
MOTOR = ("motor.i", "motor.u", "motor.w")
HEADS = {"motor.i": "I_A [mA]", "motor.w": "n [rev/min]"}
FACTORS = {"motor.i": 1e3, "motor.w": 60.0 / (2.0 * math.pi)}


def write(
    folder, name, *, empty=False, heads=HEADS, seed=3, measured=MOTOR, of_run=None, w_ref=150.0, **changes
):
    """Write a recording with a logger's own names and units; `changes` are functions of columns, `of_run` is more of
    the hidden run."""
    config = study_files.parse(FILE)
    drive = choose(config, folder, lambda *_: None).drive
    values = {key.replace("feed.", "machine."): x for key, x in TRUTH.items()}
    values |= {f"machine.{side}.processing_force": 0.0 for side in ("left", "right")} | {"motor.w_ref": w_ref}
    if empty:
        values |= {key: 0.0 for key in values if "material" in key}
    run = HiddenRun(3.0, 12.0, values, angle=1.0, temperature=300.0, **(of_run or {}))
    logger = Logger(rate=200.0, offset={"motor.i": 0.03}, mark_angle=0.1)
    recording = synthetic(drive, measured, run, logger, np.random.default_rng(seed))
    columns = {"time": recording.time, **recording.columns}
    for key, change in changes.items():
        columns[key.replace("_", ".")] = change(columns[key.replace("_", ".")])
    table = np.stack([x * FACTORS.get(key, 1.0) if heads else x for key, x in columns.items()], axis=1)
    names = [heads.get(key, f"{key} [{MEASURANDS[key].unit}]") for key in columns]
    np.savetxt(folder / name, table, "%.7g", ",", header=",".join(names), comments="")


RECORDED = Path(__file__).parents[3] / "examples" / "identification"
COLUMNS = 'columns = { "motor.i" = "I_A", "motor.w" = "n" }\n'


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The folder of a finished identification from two runs."""
    folder = tmp_path_factory.mktemp("identify")
    write(folder, "loaded.csv.gz")
    write(folder, "empty.csv", empty=True, seed=5)
    text = FILE.replace('"loaded.csv.gz"\n', f'"loaded.csv.gz"\n{COLUMNS}') + EMPTY + COLUMNS
    (folder / "mine.toml").write_text(text, "utf-8")
    done = chainunit("identify", "mine.toml", cwd=folder)
    assert done.returncode == 0, done.stderr
    (folder / "stdout.txt").write_text(done.stdout, "utf-8")
    return folder


def test_the_numbers_are_found_and_written(folder):
    """Within four standard deviations; the study file has them, and runs; the page and the pictures are there."""
    result = ResultEntries(json.loads((folder / "identified" / "result.json").read_text("utf-8")))
    for name, true in TRUTH.items():
        own = result["numbers"][name]
        assert own["told"] and abs(own["value"]["value"] - true) < 4.0 * own["deviation"]["value"], name
        # an interval of 95 %
        half = 1.96 * own["deviation"]["value"]
        assert own["from"]["value"] == pytest.approx(own["value"]["value"] - half, rel=1e-3)
        assert own["to"]["value"] == pytest.approx(own["value"]["value"] + half, rel=1e-3)
    assert abs(result["sensors"]["loaded.offset(motor.i)"]["value"]["value"] - 0.03) < 0.01
    covariance = result["covariance"]
    np.testing.assert_allclose(
        np.sqrt(np.diag(covariance["matrix"])),
        [result["numbers"][name]["deviation"]["value"] for name in covariance["names"]],
    )
    tables = tomllib.loads((folder / "identified" / "identified.toml").read_text("utf-8"))
    assert "identify" not in tables and tables["title"] == "A mill: identified"
    own = result["numbers"]["feed.left.material_mass"]
    assert tables["feed"]["left"]["material_mass"] == pytest.approx(own["fitted"]["value"], rel=1e-5)
    # the page has the values of the file
    for name, each in result["numbers"].items():
        value = re.search(rf"{re.escape(name)} +\S +([-.0-9]+)", (folder / "stdout.txt").read_text("utf-8"))
        assert value and float(value[1]) == pytest.approx(each["fitted"]["value"], rel=5e-4)
    # the best fit is near the mean of the distribution
    assert abs(own["fitted"]["value"] - own["value"]["value"]) < 0.3 * own["deviation"]["value"]
    config = study_files.load(folder / "identified" / "identified.toml")
    assert config.machine.by_name["left.web_mass"] == pytest.approx(tables["machine"]["left"]["web_mass"])
    written = {each.name for each in (folder / "identified").iterdir()}
    assert written >= {"report.html", "result.md", "course_loaded.png", "course_empty.png"}
    assert "identified.toml" in (folder / "stdout.txt").read_text("utf-8")


def test_the_courses_are_means_of_the_recordings(folder):
    """By a second route: classes of the angle between two passes of the mark."""
    result = ResultEntries(json.loads((folder / "identified" / "result.json").read_text("utf-8")))
    time, current, _, _, mark = np.loadtxt(folder / "empty.csv", delimiter=",", skiprows=1).T
    passed = time[mark > 0.5] - 0.0025
    angle = np.interp(time, passed, 2.0 * math.pi * np.arange(len(passed))) + 0.1
    inside = (time > passed[0]) & (time < passed[-1])
    course = result["courses"]["empty"]["motor.i"]
    for k in (5, 30, 60):
        at = course["angle"]["value"][k]
        near = inside & (np.abs((angle - at + math.pi) % (2.0 * math.pi) - math.pi) < 0.12)
        own = np.mean(current[near]) * 1e-3
        assert course["measured"]["value"][k] == pytest.approx(own, abs=0.03)
        assert course["simulated"]["value"][k] == pytest.approx(course["measured"]["value"][k], abs=0.02)


def test_one_run_does_not_tell_web_from_feed(tmp_path):
    """It says so, shows no bare number, and proposes an empty run; from Python the same."""
    write(tmp_path, "loaded.csv.gz", heads={})
    text = FILE.replace('deviation = "20 %"', "from = 12\nto = 32") + "[observer]\nfalse_alarms = 3\n"
    (tmp_path / "mine.toml").write_text(text, "utf-8")
    done = chainunit("identify", "mine.toml", "-o", "out", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    before = " ".join(done.stderr.split())
    assert "loaded.csv.gz is read with time in s, commas between columns, decimal point, " in before
    assert (
        "Before the fit: these recordings can determine 2 of 4 numbers (feed.right.material_mass to" in before
    )
    assert "this one would tell most: empty (then 4 numbers)" in before
    words = " ".join(done.stdout.split())
    assert "These recordings determine 2 of 4 numbers" in words
    assert "No trace in any column: left.material_mass" in words or "left.web_mass up by 1 kg" in words
    result = ResultEntries(json.loads((tmp_path / "out" / "result.json").read_text("utf-8")))
    own = result["numbers"]["machine.left.web_mass"]
    assert (
        not own["told"] and own["value"]["value"] is None and own["from"]["value"] < 24.5 < own["to"]["value"]
    )
    assert result["proposals"][0]["text"] == "empty"
    file = (tmp_path / "out" / "identified.toml").read_text("utf-8")
    low, high = (f"{own[end]['value']:.4g}" for end in ("from", "to"))
    assert f"# machine.left.web_mass: not determined, 95 % from {low} to {high} kg" in file
    # an error of the web is one of the feed on it; the observer does not know the damping of the joints
    observer = tomllib.loads(file)["observer"]
    assert observer["false_alarms"] == 3
    assert observer["uncertainty"] == pytest.approx(own["deviation"]["value"], rel=0.02)
    (total,) = result["combinations"]
    true = sum(
        factor * TRUTH[name.replace("machine.left.material", "feed.left.material")]
        for name, factor in total["terms"].items()
    )
    assert abs(total["value"]["value"] - true) < 4.0 * total["deviation"]["value"] < 2.0
    found = Study.from_file(tmp_path / "mine.toml").identify(tmp_path / "again")
    assert found.is_described and "A mill" in repr(found)
    again = ResultEntries(json.loads((tmp_path / "again" / "result.json").read_text("utf-8")))
    assert again["numbers"] == result["numbers"] and again["courses"] == result["courses"]
    numbers = found.answers
    assert list(numbers.index) == list(TRUTH) and numbers["is_determined"].sum() == 2
    assert math.isnan(numbers.loc["machine.left.web_mass", "value"])
    for name, own in result["numbers"].items():
        # as identified.toml and the page
        assert (
            not own["told"] or numbers.loc[name, "value"] == own["fitted"]["value"] != own["value"]["value"]
        )


def found_within(done, folder, most=4.0):
    """The numbers of a finished identification that are told, each within its deviations."""
    result = ResultEntries(json.loads((folder / "result.json").read_text("utf-8")))
    assert done.returncode == 0, done.stdout + done.stderr
    told = {name: own for name, own in result["numbers"].items() if own["told"]}
    for name, own in told.items():
        assert abs(own["value"]["value"] - TRUTH[name]) < most * own["deviation"]["value"], name
    return told


def test_a_shaken_run_that_is_switched_off(tmp_path):
    """The speed reference changes at stated times, then the motor is switched off."""
    reference = Profile(150.0, ((2.0, 1.0, 100.0), (4.0, 1.0, 170.0)))
    write(tmp_path, "loaded.csv.gz", heads={}, w_ref=reference, of_run={"off": 9.0})
    lines = 'speeds = [["2 s", "1 s", "2 rad/s"], [4, 1, 3.4]]\nswitched_off = "9 s"\n'
    text = FILE.replace("[[identify.sensor]]", f"{lines}[[identify.sensor]]")
    (tmp_path / "mine.toml").write_text(text, "utf-8")
    done = chainunit("identify", "mine.toml", "-o", "out", cwd=tmp_path)
    assert found_within(done, tmp_path / "out")
    wrong = text.replace("[4, 1, 3.4]", "[2.5, 1, 3.4]")
    (tmp_path / "mine.toml").write_text(wrong, "utf-8")
    done = chainunit("identify", "mine.toml", "-o", "other", cwd=tmp_path)
    assert done.returncode == 2 and "change 2 begins before the one before it ends" in done.stderr
    (tmp_path / "mine.toml").write_text(text.replace('"9 s"', '"30 s"'), "utf-8")
    done = chainunit("identify", "mine.toml", "-o", "other", cwd=tmp_path)
    assert done.returncode == 2 and "goes from 0 to 11.995 s; must lie within" in done.stderr


def test_a_measured_shaft_needs_no_motor(tmp_path):
    """Torque and speed behind the gear, in a file without a motor."""
    for name, empty in (("loaded.csv.gz", False), ("empty.csv", True)):
        write(tmp_path, name, empty=empty, heads={}, measured=("crank.tau", "crank.w"))
    begin, end = FILE.index("[motor]"), FILE.index("[run]")
    sensor = FILE.index("[[identify.sensor]]")
    (tmp_path / "mine.toml").write_text(FILE[:begin] + FILE[end:sensor] + EMPTY, "utf-8")
    done = chainunit("identify", "mine.toml", "-o", "out", cwd=tmp_path)
    assert len(found_within(done, tmp_path / "out")) >= 3


@pytest.mark.parametrize(
    ("column", "change", "words"),
    [
        ("motor_i", lambda x: 1e3 * x, "the values look like mA"),
        ("motor_i", lambda x: -x, "the sign is reversed"),
        ("motor_i", lambda x: np.minimum(x, 0.8 * x.max()), "it is clipped"),
        ("motor_w", lambda x: np.where(np.arange(len(x)) > 500, x[500], x), "is stuck"),
        ("motor_w", lambda x: 0.0 * x, "although the mark is passed"),
    ],
)
def test_a_bad_recording_is_refused_by_its_column(column, change, words, tmp_path):
    write(tmp_path, "loaded.csv.gz", heads={}, **{column: change})
    (tmp_path / "mine.toml").write_text(FILE, "utf-8")
    done = chainunit("identify", "mine.toml", "-o", "out", cwd=tmp_path)
    assert done.returncode == 2 and not (tmp_path / "out").exists()
    assert words in done.stderr and f"column {column.replace('_', '.')}" in done.stderr


def test_a_speed_that_wanders_is_refused_where_its_changes_are_not_stated(tmp_path):
    """Before the fit, which would take minutes; with its remedy."""
    changes = ((-4.0, 1.0, 143.0), (3.0, 2.0, 160.0), (8.0, 1.0, 146.0))
    write(tmp_path, "loaded.csv.gz", heads={}, w_ref=Profile(150.0, changes))
    (tmp_path / "mine.toml").write_text(FILE, "utf-8")
    done = chainunit("identify", "mine.toml", "-o", "out", cwd=tmp_path)
    assert done.returncode == 2 and not (tmp_path / "out").exists()
    words = " ".join(done.stderr.split())
    assert "loaded.csv.gz, column mark [1]: the mean speed of the crank in a turn wanders from 2." in words
    assert "state its changes (speeds), name a part in which it is steady (begin, end)" in words


def test_further_runs_beside_numbers_that_are_all_determined():
    """No run can determine one more of them."""

    def shown(determined):
        parts = {
            **dict.fromkeys(field.name for field in fields(IdentificationSummary)),
            "told": determined,
            "sought": 3,
            "told_at_start": 2,
            "blind": [],
            "combinations": [],
            "proposals": (Proposal("empty", 1.2, 2),),
        }
        return str(list(report._limits(cited(IdentificationSummary(**parts)))))

    assert "None of these runs determines one more number" in shown(2.0) and "without one" in shown(2.0)
    assert "None of these runs" not in shown(3.0) and "would make the numbers sharper" in shown(3.0)


def test_a_wrong_crank_is_recognised(tmp_path):
    """The exit status is 1, nothing is determined, no interval is narrower than before, no study file is written, and
    the crank is a suspect."""
    write(tmp_path, "loaded.csv.gz", heads={})
    (tmp_path / "mine.toml").write_text(FILE + "[machine]\nr = 0.16\n", "utf-8")
    done = chainunit("identify", "mine.toml", "-o", "out", cwd=tmp_path)
    assert done.returncode == 1
    assert "The model does not describe the recordings. No number is determined" in " ".join(
        done.stdout.split()
    )
    result = ResultEntries(json.loads((tmp_path / "out" / "result.json").read_text("utf-8")))
    assert any(not each["is_noise"] for each in result["residuals"])
    assert result["told"]["value"] == 0 and result["combinations"] == [] == result["proposals"]
    for own in result["numbers"].values():
        assert not own["told"] and own["value"]["value"] is None and own["fitted"]["value"] is None
        assert own["deviation"] == own["given_deviation"]
    feed, web = (result["numbers"][name] for name in ("feed.left.material_mass", "machine.left.web_mass"))
    assert (feed["from"]["value"], feed["to"]["value"]) == (10.0, 60.0)
    assert web["to"]["value"] - web["from"]["value"] == pytest.approx(2 * 1.96 * 0.2 * 21.6)
    np.testing.assert_allclose(
        np.sqrt(np.diag(result["covariance"]["matrix"])),
        [each["given_deviation"]["value"] for each in result["numbers"].values()],
    )
    assert not (tmp_path / "out" / "identified.toml").exists()
    assert "identified.toml has it" not in (tmp_path / "out" / "result.md").read_text("utf-8")
    suspects = [each["name"] for some in result["suspects"] for each in some["suspects"]]
    assert "machine.r" in suspects and not any("smooth" in name for name in suspects)
    first = result["suspects"][0]
    assert first["describes"] and first["suspects"][0]["known"]["value"] == 0.16


@pytest.fixture
def wrong_gain(tmp_path, monkeypatch):
    """The packaged recordings, with a gain of the converter that is not the recorded one. The sensor of the current
    makes up for it in part by a gain of its own. Only two known numbers are doubted."""
    doubted, numbers = ("motor.speed_control.kp", "motor.rotor.J"), suspects.known_numbers
    monkeypatch.setattr(
        suspects, "known_numbers", lambda *args: [u for u in numbers(*args) if u.name in doubted]
    )
    text = (RECORDED / "mill.toml").read_text("utf-8").replace("kp = 0.1017", "kp = 0.06")
    for name in ("loaded.csv.gz", "empty.csv.gz"):
        text = text.replace(f'"{name}"', f'"{(RECORDED / name).as_posix()}"\nend = "20 s"')
    (tmp_path / "mine.toml").write_text(text.partition("[watch")[0], "utf-8")
    return tmp_path / "mine.toml"


def test_one_cause_is_named_and_its_search_has_a_forecast(wrong_gain):
    """The number that explains the recordings alone, and not the sensor that made up for it. The search for it
    reports its steps, so that a forecast is made like that of other long work."""
    reports = list[tuple[str, float, float]]()
    found = Study.from_file(wrong_gain).identify(progress=lambda *report: reports.append(report))
    assert [conflict.name for conflict in found.found.prior_conflicts] == ["gain(motor.i)"]
    (cause,) = found.warnings
    assert re.match(
        r"The model describes the recordings with motor[.]speed_control[.]kp = 0[.](099|10)", cause
    )
    of_search = [report for report in reports if report[0].startswith("suspects, at most")]
    shares = [complete / total for _, complete, total in of_search]
    assert shares == sorted(shares) and len(set(shares)) > 5 and 0.0 == shares[0] < shares[-1] <= 1.0
    # a step takes six seconds: after the first one the forecast is near that of all steps
    forecast = Forecast()
    texts = [
        forecast.words(6.0 * share * report[2], *report)
        for share, report in zip(shares, of_search, strict=True)
    ]
    (text,) = filter(None, texts)
    assert texts.index(text) == 1 and re.fullmatch(
        r"About 2 min more: suspects, at most 23 steps \(.*\)[.]", text
    )


def test_an_interrupted_search_for_suspects_leaves_the_fit(wrong_gain, monkeypatch, capsys):
    """The command says that the search was not finished, writes the files, and ends with the status of Ctrl-C; in
    Python the result is that of the fit, too."""
    computed = list[identification.IdentifiedMachine]()

    def interrupted(what, complete, total):
        if what.startswith("suspects"):
            raise KeyboardInterrupt

    def once(config, folder, progress, **options):
        if not computed:
            computed.append(identification.identify(config, interrupted))
        return computed[0]

    monkeypatch.setattr(report, "TASK", replace(report.TASK, compute=once))
    monkeypatch.setattr(IdentificationResult, "_task", report.TASK)
    with pytest.raises(InterruptedRunError, match="search for suspects was interrupted") as ended:
        Study.from_file(wrong_gain).identify()
    (note,) = [text for text in ended.value.partial.warnings if "search for suspects" in text]
    assert note == (
        "The search for suspects was interrupted, and none are named; identify again to name them."
    )
    assert not ended.value.partial.is_described and len(ended.value.partial.answers) == 16
    folder = wrong_gain.parent / "out"
    with pytest.raises(SystemExit) as end:
        carry_out(report.TASK, study_files.load(wrong_gain), folder, whole=True)
    assert end.value.code == 130
    shown = capsys.readouterr()
    assert "The search for suspects was interrupted" in shown.out
    assert "The run stopped early: the search for suspects was interrupted" in shown.err
    result = ResultEntries(json.loads((folder / "result.json").read_text("utf-8")))
    assert result["fit"]["is_ended"] and result["suspects"] == [] and "was interrupted" in result["status"]


def test_a_fit_without_an_end(tmp_path, monkeypatch):
    """The model does not describe the recording, and the column from which it is farthest is named."""
    write(tmp_path, "loaded.csv.gz", heads={})
    (tmp_path / "mine.toml").write_text(FILE, "utf-8")
    monkeypatch.setattr(fitting, "MOST_ROUNDS", 2)
    found = Study.from_file(tmp_path / "mine.toml").identify()
    assert not found.is_described and not ResultEntries(json.loads(found.to_json()))["fit"]["is_ended"]
    (words,) = [each for each in sentences(found.found) if "still improved" in each]
    assert re.search(r"farthest from (motor\.[iuw]|mark) of the run loaded, with residuals of", words)


def test_what_was_known_and_is_contradicted(tmp_path):
    """A weighing that is wrong by a half, and a bound that leaves out the true value, are named with both values; a
    number at its bound is not shown as determined."""
    for name, empty in (("loaded.csv.gz", False), ("empty.csv", True)):
        write(tmp_path, name, empty=empty, heads={})
    text = (FILE + EMPTY).replace('deviation = "20 %"', "deviation = 0.3").replace("to = 3\n", "to = 1.1\n")
    (tmp_path / "mine.toml").write_text(text, "utf-8")
    done = chainunit("identify", "mine.toml", "-o", "out", cwd=tmp_path)
    assert done.returncode == 1
    words = " ".join(sentences(Study.from_file(tmp_path / "mine.toml").identify().found))
    result = ResultEntries(json.loads((tmp_path / "out" / "result.json").read_text("utf-8")))
    assert "machine.left.web_mass = " in words and "deviations beside the known value, 21.6 kg" in words
    assert (
        "machine.joint_damping = 1.1 N m s/rad lies at its upper bound, and the recordings contradict"
        in words
    )
    damping = result["numbers"]["machine.joint_damping"]
    assert (damping["from"]["value"], damping["to"]["value"]) == (0.1, 1.1)
    assert not result["numbers"]["machine.joint_damping"]["told"]


def test_a_motor_beside_the_torque_of_the_crank(tmp_path):
    """The motor follows its reference also where the torque behind the gear is recorded."""
    write(tmp_path, "loaded.csv.gz", heads={}, measured=(*MOTOR, "crank.tau"))
    (tmp_path / "mine.toml").write_text(FILE, "utf-8")
    config = study_files.load(tmp_path / "mine.toml")
    plan = identification.plan_of(config.plans)
    recordings = identification.read_runs(plan.runs)
    problem = identification._problem(config.feed, plan, identification.drive_of(config), recordings)
    assert problem.runs[0].values["motor.w_ref"] == 150.0
    identification.inspect_runs(problem, 1)


def test_a_deviation_of_a_temperature_is_a_difference():
    """20 K are no -253 degC."""
    unknown = Unknown("motor.ambient.T", "K", 293.15, 250.0, 340.0, 5.0)
    expected = SimpleNamespace(name="motor.ambient.T", by_both=2.0, by_runs=3.0)
    variable = SimpleNamespace(description="", unit="K", kind="temperature")
    found = SimpleNamespace(
        plan=SimpleNamespace(variables={"motor.ambient.T": variable}),
        information_at_start=SimpleNamespace(determinations=[expected]),
    )
    each = identification.FittedNumber(unknown, 300.0, 300.0, 2.0, 296.0, 304.0, True)
    own = as_data(_number(found, each))
    for key in ("deviation", "given_deviation", "expected", "by_runs"):
        assert own[key]["kind"] == "difference", key
    assert own["value"]["kind"] == "temperature"


@pytest.mark.parametrize("loss", [0.0, 0.4])
def test_the_observer_gets_the_errors_at_the_fitted_loads(loss, tmp_path):
    """An error of the friction makes false loads by the forces that there are, and by the loss of the gear."""
    feed = "[feed]\nright = { material_mass = 20, processing_force = 100 }\n"
    config = study_files.parse(f"[observer]\n[motor]\ngear.loss = {loss}\n{feed}")
    values = {"machine.pin.friction": (0.12, 0.01), "feed.left.processing_force": (300.0, 1.0)}
    estimates = {
        name: identification.FittedNumber(Unknown.within(name, "1", 0.0, 1e3), x, x, s, x - s, x + s, True)
        for name, (x, s) in values.items()
    }
    found = SimpleNamespace(config=config, estimates=estimates, covariance=np.diag([1e-4, 1.0]))
    written = identified_tables(found, tmp_path)["observer"]
    known = {"pin.friction": 0.12, "feed.expected": 25.0, "force.expected": 200.0, "gear.loss": loss}
    p = LoadObserver.parameter_layout.from_names(known)
    own = false_loads(p, ["pin.friction"], [[1e-4]], config.run.crank_speed)
    assert written["uncertainty"] == pytest.approx(own.imbalance, rel=1e-3)
    assert written["force_uncertainty"] == pytest.approx(own.force_imbalance, rel=1e-3)
    without = LoadObserver.parameter_layout.from_names({"pin.friction": 0.12})
    other = false_loads(without, ["pin.friction"], [[1e-4]], config.run.crank_speed)
    assert written["force_uncertainty"] != pytest.approx(other.force_imbalance, rel=0.1)


def test_refusals(tmp_path):
    (tmp_path / "mine.toml").write_text(FILE, "utf-8")
    done = chainunit("identify", "mine.toml", cwd=tmp_path)
    assert done.returncode == 2 and "loaded.csv.gz" in done.stderr and not (tmp_path / "identified").exists()
    with pytest.raises(InputError, match="identify: is missing"):
        Study().identify()
    write(tmp_path, "loaded.csv.gz", heads={})
    begin, end = FILE.index("[motor]"), FILE.index("[run]")
    (tmp_path / "mine.toml").write_text(FILE[:begin] + FILE[end:], "utf-8")
    done = chainunit("identify", "mine.toml", cwd=tmp_path)
    assert (
        done.returncode == 2 and "motor: is missing, and the recordings have motor.i, motor.u" in done.stderr
    )
