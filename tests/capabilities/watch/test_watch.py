"""``chainunit watch``: the load observer over recordings in files."""

from __future__ import annotations

import json
import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from command import chainunit
from reports import plain
from synthetic import HiddenRun, Logger, synthetic, write_recording

from chainunit import InputError, Study
from chainunit.capabilities.watch import page as watch_page
from chainunit.capabilities.watch.crank_motion import crank_motion
from chainunit.capabilities.watch.watch import Begin
from chainunit.core.native.compilers import compiler
from chainunit.drives.dc_motor import DcMotor
from chainunit.reading.result_entries import ResultEntries
from chainunit.recordings.recording import Recording, read_recording
from chainunit.study.choice import drive_of
from chainunit.study.config import parse
from chainunit.study.drive import Drive
from chainunit.system import Profile

pytestmark = [pytest.mark.second, pytest.mark.skipif(compiler() is None, reason="no C compiler")]
EXAMPLES = Path(__file__).parents[3] / "examples" / "identification"
TRUTH = json.loads((EXAMPLES / "truth.json").read_text("utf-8"))
TURN = 2.0 * math.pi / TRUTH["crank_speed"]


def study_text(machine, **watch):
    """A study file of the example's machine with a recording to watch."""
    lines = [f"{name} = {value}" for name, value in machine.items()]
    keys = {"file": EXAMPLES / "watch.csv.gz"} | watch
    return "\n".join(
        [
            'title = "A mill"',
            "[machine]",
            *lines,
            "[motor]",
            *(f"{name} = {x}" for name, x in GAINS.items()),
            "[run]",
            f"crank_speed = {TRUTH['crank_speed']}",
            "[feed]",
            *(f"{side}.material_mass = 30" for side in ("left", "right")),
            *(f"{side}.processing_force = 40" for side in ("left", "right")),
            "[watch]",
            *(f"{name} = {json.dumps(str(x) if isinstance(x, Path) else x)}" for name, x in keys.items()),
        ]
    )


def said_of(result):
    """The short form of the report of a result, as one line."""
    return " ".join(plain(result._report).split())


GAINS = {
    "speed_control.kp": 0.1017,
    "speed_control.ki": 0.6102,
    "current_control.kp": 33,
    "current_control.ki": 2850,
}


@pytest.fixture(scope="module")
def watched(tmp_path_factory):
    """The folder of a watched recording, and what the command printed."""
    folder = tmp_path_factory.mktemp("watch")
    (folder / "mine.toml").write_text(study_text(TRUTH["machine"]), "utf-8")
    done = chainunit("watch", "mine.toml", cwd=folder)
    # an alarm
    assert done.returncode == 3, done.stderr
    return folder / "watched", " ".join(done.stdout.split())


def test_a_shift_of_a_fifth_is_found_within_a_turn(watched):
    """With the right side, on the ground of the feed, and no alarm before; the page and the pictures are there."""
    folder, printed = watched
    result = ResultEntries(json.loads((folder / "result.json").read_text("utf-8")))
    assert {each["side"] for each in result["alarms"]} == {"left"}
    assert result["is_described"] and "does not describe" not in printed
    first = result["alarms"][0]
    assert first["ground"] == "imbalance of the feed"
    assert 70.0 < first["begin"]["value"] < 70.5 + TURN
    assert "Overload of the left side from" in printed
    assert {each.name for each in folder.iterdir()} >= {
        "report.html",
        "result.md",
        "loads.png",
        "imbalance.png",
    }
    # what is shown before the alarm is the hidden feed
    usual = result["usual"]
    for side in ("left", "right"):
        assert usual[f"{side}.material_mass"]["value"]["value"] == pytest.approx(30.0, abs=1.0)
        assert usual[f"{side}.processing_force"]["value"]["value"] == pytest.approx(50.0, abs=5.0)
    assert usual["imbalance.feed"]["threshold"]["value"] == pytest.approx(
        result["feed_threshold_least"]["value"], rel=0.1
    )
    time, after = result["course"]["time"]["value"], result["course"]["imbalance.feed"]["value"]
    late = [x for t, x in zip(time, after, strict=True) if t > 80.0]
    assert np.mean(late) == pytest.approx(12.0, abs=1.0)
    assert result["learned"]["mark.angle"]["value"]["value"] == pytest.approx(-0.13, abs=0.01)


def test_a_ramp_is_told_within_a_turn_of_its_threshold(tmp_path):
    """A shift of 12 kg that comes in 10 s is seen as soon as the part that has come is beyond the threshold."""
    config, speed = parse(study_text(TRUTH["machine"])), TRUTH["crank_speed"]
    signs = {"left": 1.0, "right": -1.0}
    ramps = {
        f"machine.{side}.material_mass": Profile(30.0, ((30.0, 10.0, 30.0 + 6.0 * sign),))
        for side, sign in signs.items()
    }
    forces = {f"machine.{side}.processing_force": 50.0 for side in signs}
    run = HiddenRun(speed, 45.0, ramps | forces | {"motor.w_ref": speed * config.machine.ratio}, before=5.0)
    logger = Logger(rate=200.0, offset={"motor.i": 0.02}, mark_angle=-0.1)
    drive = Drive(DcMotor, config.motor.parameters, config.machine)
    columns, rng = ("motor.i", "motor.u", "motor.w"), np.random.default_rng(3)
    write_recording(synthetic(drive, columns, run, logger, rng), tmp_path / "ramp.csv.gz")
    (tmp_path / "mine.toml").write_text(study_text(TRUTH["machine"], file="ramp.csv.gz"), "utf-8")
    found = Study.from_file(tmp_path / "mine.toml").watch().record
    assert {each.side for each in found.alarms} == {"left"} and found.is_described
    time, shift = found.recording.time, Profile(0.0, ((30.0, 10.0, 12.0),))
    beyond = [shift(t) > x for t, x in zip(time, found.outputs["imbalance.feed_threshold"], strict=True)]
    passed = float(time[beyond.index(True)])
    assert 30.0 + 2.0 * TURN < passed < found.alarms[0].begin < passed + TURN
    assert found.alarms[0].begin < 30.0 + 4.2 * TURN  # as the page has it


@pytest.mark.slow
@pytest.mark.parametrize("start", ["direct", "inverter"])
def test_behind_a_gear_that_loses_much_equal_feeds_make_no_alarm(start, tmp_path):
    """The power of an induction motor behind a gear of 70 %: with a mean friction in place of the loss, an imbalance
    of 20 kg was seen."""
    text = f'start = "{start}"\n[system]\nmotor = "IE3 4-pole 0.55 kW, 80M"\n[gear]\nefficiency = 0.7\n'
    config = parse(text)
    drive, speed = drive_of(config), config.run.crank_speed
    feed = {f"machine.{side}.material_mass": 30.0 for side in ("left", "right")}
    run = HiddenRun(speed, 40.0, feed | drive.reference(speed), before=5.0)
    columns, rng = ("motor.i", "motor.power", "motor.w"), np.random.default_rng(3)
    recording = synthetic(drive, columns, run, Logger(rate=500.0, mark_angle=-0.1), rng)
    write_recording(recording, tmp_path / "geared.csv.gz")
    (tmp_path / "mine.toml").write_text(f'{text}[watch]\nfile = "geared.csv.gz"\n', "utf-8")
    record = Study.from_file(tmp_path / "mine.toml").watch().record
    assert record.is_described and not record.alarms
    late = record.recording.time > 20.0
    assert abs(np.mean(record.outputs["imbalance.feed"][late])) < 2.0
    for side in ("left", "right"):
        assert np.mean(record.outputs[f"{side}.material_mass"][late]) == pytest.approx(30.0, abs=2.0)


def test_a_machine_that_does_not_describe_the_begin(tmp_path):
    """One whose left wall is heavier by a third is named, with the column and the feed that tell."""
    wrong = TRUTH["machine"] | {"left.wall_mass": 81.0}
    (tmp_path / "mine.toml").write_text(study_text(wrong, end=40), "utf-8")
    found = Study.from_file(tmp_path / "mine.toml").watch()
    assert not found.record.is_described and watch_page.TASK.shortfall(found.record) == ""
    assert "does not describe the begin of the recording" in " ".join(repr(found).split())
    doubts = ResultEntries(json.loads(found.to_json()))["doubts"]
    assert any("remains in motor.i" in each for each in doubts)
    assert any(each.startswith("feed.left.material_mass") for each in doubts)


@pytest.mark.slow
def test_errors_of_an_identified_machine_widen_the_threshold(tmp_path):
    """By the factor that the page states; a file that is no identification is refused."""
    covariance = {
        "names": ["machine.left.web_mass", "feed.left.material_mass"],
        "matrix": [[1.0, 0.0], [0.0, 9.0]],
    }
    result = {"is_described": True, "covariance": covariance}
    (tmp_path / "result.json").write_text(json.dumps(result), "utf-8")
    thresholds, results = [], []
    for more in ({}, {"identification": "result.json"}):
        (tmp_path / "mine.toml").write_text(study_text(TRUTH["machine"], end=60, **more), "utf-8")
        found = Study.from_file(tmp_path / "mine.toml").watch()
        results.append(ResultEntries(json.loads(found.to_json())))
        thresholds.append(np.median(found.record.outputs["imbalance.feed_threshold"]))
    assert results[0]["widening"]["value"] == 1.0
    # a web that is heavier by 1 kg is as good as feed
    assert results[1]["uncertainty"]["value"] == pytest.approx(1.0, abs=0.1)
    assert results[1]["widening"]["value"] == pytest.approx(thresholds[1] / thresholds[0], rel=0.01)
    assert results[1]["widening"]["value"] > 1.02
    assert not results[0]["alarms"] and not results[1]["alarms"]
    (tmp_path / "result.json").write_text("{}", "utf-8")
    with pytest.raises(InputError, match=r"is no result\.json of chainunit identify"):
        Study.from_file(tmp_path / "mine.toml").watch()


def changed(folder, keep=lambda time: time < 60.0, **columns):
    """Write the example's recording with other rows and columns; returns the file."""
    recording = read_recording(EXAMPLES / "watch.csv.gz")
    values = {
        name: columns[name.replace(".", "_")](recording.time, x) if name.replace(".", "_") in columns else x
        for name, x in recording.columns.items()
    }
    rows = keep(recording.time)
    values = {name: x[rows] for name, x in values.items()}
    write_recording(Recording("", recording.time[rows], values, recording.heads), folder / "changed.csv")
    return folder / "changed.csv"


def test_behind_a_gap_the_observer_starts_anew(tmp_path):
    """Without a false alarm, and it finds the shift that comes later. A noise that is louder than stated is told and
    counts, and so are errors of the forces and an identification that failed."""
    file = changed(tmp_path, lambda t: (t < 30.0) | ((t > 33.0) & (t < 50.0)) | ((t > 51.1) & (t < 80.0)))
    result = {
        "is_described": False,
        "covariance": {"names": ["motor.rotor.J"], "matrix": [[1.0]]},
    }
    (tmp_path / "result.json").write_text(json.dumps(result), "utf-8")
    more = {"noise": 0.002, "identification": "result.json"}
    text = study_text(TRUTH["machine"], file=file, **more)
    (tmp_path / "mine.toml").write_text(text, "utf-8")
    found = Study.from_file(tmp_path / "mine.toml").watch()
    alarms = found.alarms
    assert {each.side for each in alarms} == {"left"} and 70.0 < alarms[0].begin < 70.5 + TURN
    words = said_of(found)
    assert "No rows from 30.00 s to 33.01 s: the observer starts anew behind this gap." in words
    assert "No rows from 49.99 s to 51.1" in words
    assert "The identification of this machine failed: its model does not describe its recordings." in words
    assert "The identification sought no number of the machine that the observer knows." in words
    noise = {
        name: each["value"] for name, each in ResultEntries(json.loads(found.to_json()))["noise"].items()
    }
    assert list(noise.values()) == pytest.approx([5.0, 5.0], rel=0.1)
    assert (
        f"The noise of the measured speed at the begin is {noise['speed']:.2g} times the stated one" in words
    )
    assert found.record.parameters["noise.w"] == pytest.approx(0.002 * noise["speed"] * 150.0, rel=0.01)


def test_the_noise_of_columns_that_the_observer_does_not_use():
    """It is no noise of the observer."""
    recording = Recording(
        "", np.arange(9.0), dict.fromkeys(("motor.i", "motor.u", "motor.w"), np.ones(9)), {}
    )
    measured = {"motor.i": 3.0, "motor.u": 8.0, "motor.w": 0.9}
    checks = [SimpleNamespace(column=name, noise=x) for name, x in measured.items()]
    problem = SimpleNamespace(runs=[SimpleNamespace(recording=recording)])
    assert Begin(problem, None, checks).noises == (3.0, 1.0)


def test_a_sensor_that_fails_behind_the_begin(tmp_path):
    """It makes a false alarm, which the page doubts; a machine that stops is watched all the same."""
    stuck = changed(tmp_path, motor_i=lambda t, x: np.where(t > 35.0, x[7000], x))
    (tmp_path / "mine.toml").write_text(study_text(TRUTH["machine"], file=stuck), "utf-8")
    words = said_of(Study.from_file(tmp_path / "mine.toml").watch())
    assert "Overload of the" in words and "motor.i keeps the value" in words
    doubt = (
        "from 35 to 59.995 s: a sensor that is stuck, a stop or a limit. An alarm in this time may be false."
    )
    assert doubt in words
    stop = {
        name: lambda t, x: np.where(t > 50.0, 0.0, x) for name in ("motor_i", "motor_u", "motor_w", "mark")
    }
    changed(tmp_path, **stop)
    words = said_of(Study.from_file(tmp_path / "mine.toml").watch())
    assert "motor.w keeps the value 0 rad/s from 50" in words


def test_refusals(tmp_path):
    with pytest.raises(InputError, match="watch: is missing"):
        Study().watch()
    for more, words in (
        ({"begin": 300}, "begin = 300 s: .* goes from 0 s to 119.995 s; must lie within"),
        ({"learning": 500}, "and < 120 s, the duration"),
        ({"learning": 5}, r"watch\.learning = 5 s: must be >= 6\.283 s, 3 turns"),
    ):
        (tmp_path / "mine.toml").write_text(study_text(TRUTH["machine"], **more), "utf-8")
        with pytest.raises(InputError, match=words):
            Study.from_file(tmp_path / "mine.toml").watch()
    # a matrix of another size than its names
    covariance = {"names": ["machine.crank.m", "machine.rocker.m"], "matrix": [[1.0]]}
    (tmp_path / "small.json").write_text(
        json.dumps({"is_described": True, "covariance": covariance}), "utf-8"
    )
    text = study_text(TRUTH["machine"], identification="small.json")
    (tmp_path / "mine.toml").write_text(text, "utf-8")
    with pytest.raises(InputError, match=r"small\.json: is no result\.json of chainunit identify"):
        Study.from_file(tmp_path / "mine.toml").watch()
    (tmp_path / "mine.toml").write_text(
        "[watch]\nbegin = 3\nend = 2\ncolumns = { 'motor.v' = 'U' }\n", "utf-8"
    )
    done = chainunit("watch", "mine.toml", cwd=tmp_path)
    assert done.returncode == 2
    for words in (
        "watch.file: must be given",
        "watch.end = 2 s: must be > begin",
        "watch.columns.motor.v: no such",
    ):
        assert words in done.stderr
    knife = "[system]\nmachine = 'KnifeDrive'\n[watch]\nfile = 'a.csv'\n"
    (tmp_path / "mine.toml").write_text(knife, "utf-8")
    done = chainunit("watch", "mine.toml", cwd=tmp_path)
    assert done.returncode == 2 and "watch: is of the chain unit" in done.stderr


def test_the_angle_between_marks():
    """Of a crank whose speed changes within the turn, with a noisy speed: within 6 mrad of the true one,
    a third of which is the distance of rows, and twice that at a gap."""
    rng = np.random.default_rng(3)
    time = np.arange(0.0, 40.0, 0.002)
    phi = 3.0 * time + 0.2 * np.sin(3.0 * time) + 0.7
    speed = 3.0 + 0.6 * np.cos(3.0 * time)
    mark = np.append(0.0, np.diff(np.floor((phi - 0.1) / (2.0 * math.pi))))
    columns = {"motor.w": 50.0 * speed * (1.0 + 0.01 * rng.standard_normal(len(time))), "mark": mark}
    kept = (time < 11.0) | (time > 11.3)
    recording = Recording("r.csv", time[kept], {k: x[kept] for k, x in columns.items()}, {})
    angle, w = crank_motion(recording, 0.1, 50.0)
    off = angle - phi[kept]
    off -= 2.0 * math.pi * np.round(np.mean(off) / (2.0 * math.pi))
    outside = (recording.time < 10.0) | (recording.time > 12.5)
    assert np.max(np.abs(off[outside])) < 0.006 and np.max(np.abs(off)) < 0.012
    assert np.max(np.abs(w - speed[kept])) < 0.3
    counted = Recording(
        "r.csv", time, {"motor.count": np.floor((phi - phi[0]) * 50.0 * 4096 / (2.0 * math.pi))}, {}
    )
    angle, w = crank_motion(counted, 0.7, 50.0)
    assert np.max(np.abs(angle - phi)) < 1e-4 and np.max(np.abs(w - speed)[10:-10]) < 0.02
    with pytest.raises(InputError, match="the angle of the crank is not known"):
        crank_motion(Recording("r.csv", time, {"motor.i": time}, {}), 0.0, 50.0)


def test_the_recording_is_that_of_the_examples():
    recording = read_recording(EXAMPLES / "watch.csv.gz")
    assert set(recording.columns) == {"motor.i", "motor.u", "motor.w", "mark"}
