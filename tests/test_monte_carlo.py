"""Random overloads: every process computes the same numbers, and a kill loses no finished run."""

from __future__ import annotations

import contextlib
import dataclasses
import errno
import json
import math
import os
import signal
import subprocess
import sys
import textwrap
import time
from concurrent.futures import ThreadPoolExecutor

import pytest
from command import chainunit

from chainunit.drives.dc_motor import DcMotor
from chainunit.errors import RunError, WriteError
from chainunit.study import monte_carlo, quantiles
from chainunit.study.config import parse
from chainunit.study.drive import Drive
from chainunit.system import CoSimulation
from chainunit.text import number as shown

STUDY = """
[run]
step = 0.004
ramp = 0.3
[monte_carlo]
runs = {runs}
duration = 0.5
event = {{ force = [4000, 9000], duration = 0.1 }}
[coupling]
trip_torque = 500
scatter = 0.2
"""
# alone in a process, as workers are started anew
SCRIPT = """
    import sys
    from pathlib import Path
    from chainunit.study.config import parse
    from chainunit.drives.dc_motor import DcMotor
    from chainunit.study import monte_carlo, quantiles
    from chainunit.study.drive import Drive

    if __name__ == "__main__":
        config = parse(Path("study.toml").read_text())
        drive = Drive(DcMotor, config.motor, config.machine)
        files, _ = drive.export(Path("."))
        task = monte_carlo.Task(config, drive, files, 1.0)
        result = monte_carlo.run(task, Path("."), lambda what, done, todo: print(done, todo, flush=True), workers=2)
        print("resumed", result.earlier_runs, flush=True)
"""


def start(folder, runs, **more):
    (folder / "study.toml").write_text(STUDY.format(runs=runs))
    (folder / "script.py").write_text(textwrap.dedent(SCRIPT))
    return subprocess.Popen(
        [sys.executable, "script.py"],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        **more,
    )


@pytest.fixture(scope="module")
def killed(tmp_path_factory):
    """A run that was killed after its first results, a torn line left behind, and then resumed."""
    folder = tmp_path_factory.mktemp("monte carlo")
    first = start(folder, 100_000)
    while not list(folder.glob("*.jsonl")) or next(folder.glob("*.jsonl")).read_text().count("\n") < 25:
        assert first.poll() is None, first.stderr.read()
        time.sleep(0.05)
    os.killpg(first.pid, signal.SIGKILL)
    first.communicate()
    (file,) = folder.glob("*.jsonl")
    with file.open("a") as out:
        out.write('{"run": 99999, "crank_a')
    before, _ = monte_carlo.read_rows(file)
    second = start(folder, len(before) + 10)
    message, errors = second.communicate()
    assert second.returncode == 0, errors
    return file, before, message


def test_a_killed_study_goes_on_from_what_it_saved(killed):
    file, before, message = killed
    assert before and f"resumed {len(before)}" in message
    rows = [json.loads(line) for line in file.read_text().splitlines()]
    assert sorted(row["run"] for row in rows) == list(range(len(before) + 10))
    for row in rows:
        assert before.get(row["run"], row) == row


def test_a_row_is_what_its_number_says(killed):
    """Run again here, in this process, in another order."""
    file, before, _ = killed
    config = parse(STUDY.format(runs=10))
    drive = Drive(DcMotor, config.motor, config.machine)
    files = {name: file.parent / f"{part.model.name}.fmu" for name, part in drive.graph.components.items()}
    task = monte_carlo.Task(config, drive, files, 1.0)
    signals = {**drive.loads(config.feed), **drive.reference(config.run.crank_speed, config.run.ramp)}
    with CoSimulation(drive.system(files), signals) as simulation:
        simulation.run(1.0, config.run.step)
        simulation.save()
        for number in (7, 3, 20):
            got = monte_carlo.Layout(monte_carlo.Sample).by_name(monte_carlo.one(task, number, simulation))
            drawn = monte_carlo.draw(config, number)
            row = {"run": number, "side": drawn.event.side, "drawn": drawn.values, "failed": None}
            assert {**row, **got} == before[number]


def test_answers_hang_together(killed):
    rows = list(killed[1].values())
    assert 0.0 < sum(row["trips"] for row in rows) < len(rows)
    for row in rows:
        assert (row["crank_torque_peak"] > row["trip_torque"]) == bool(row["trips"])
        assert 4000.0 <= row["drawn"]["force"] <= 9000.0
    assert {row["side"] for row in rows} == {"left", "right"}
    result = monte_carlo.MonteCarloResult(rows, killed[0], 0)
    sides = {side: runs["value"] for side, runs in result.as_dict()["sides"].items()}
    assert sides == {side: sum(row["side"] == side for row in rows) for side in ("left", "right")}
    outcome = result.as_dict()["quantiles"]
    share = outcome["trips"]["share"]
    assert share["unit"] == "1" and share["low"]["value"] < share["value"] < share["high"]["value"]


def test_quantiles_have_intervals_or_are_left_out(killed):
    """Of the few runs the median is told, of 100 like them the 5 % and 95 % quantiles, too, of 400 all."""
    few = list(killed[1].values())
    for number, entries in ((30, ["q50"]), (100, ["q5", "q50", "q95"]), (400, ["q5", "q50", "q95", "q99"])):
        rows = [
            {**few[k % len(few)], "run": k, "crank_torque_peak": 100.0 + k % 97 + 1e-3 * k}
            for k in range(number)
        ]
        result = monte_carlo.MonteCarloResult(rows, killed[0], 0)
        sizes = result.quantiles()["crank_torque_peak"]
        assert list(sizes) == entries
        values = [row["crank_torque_peak"] for row in rows]
        for name, each in sizes.items():
            assert each == quantiles.quantile(values, float(name[1:]) / 100.0)
            assert each.low < each.value < each.high
        entry = result.as_dict()["quantiles"]["crank_torque_peak"][entries[-1]]
        assert entry["low"] == {"value": sizes[entries[-1]].low, "unit": "N.m"}
        assert bool(result.remark) == (number < 368)
    assert (
        "30 runs are too few" in (monte_carlo.MonteCarloResult(few[:25] + few[:5], killed[0], 0).remark)
        and "the 99 % quantile takes 368" in monte_carlo.MonteCarloResult(few, killed[0], 0).remark
    )


class Still:
    """A stand-in for a simulation: it records its arguments and ends."""

    time = 1.0

    def restore(self):
        pass

    def run(self, stop, step, progress=None, *, guards=None):
        raise RunError("seen")


@pytest.mark.parametrize("number", range(6))
def test_the_lump_comes_on_the_side_of_its_number(number):
    """By the number alone; the other side keeps its feed, and the lump lies on top of what its side has."""
    config = parse(
        STUDY.format(runs=10)
        + "[feed]\nleft = { processing_force = 100 }\nright = { processing_force = 700 }\n"
    )
    task = monte_carlo.Task(config, Drive(DcMotor, config.motor, config.machine), {}, 1.0)
    drawn, simulation = monte_carlo.draw(config, number), Still()
    assert drawn == monte_carlo.draw(parse(STUDY.format(runs=99)), number)
    with pytest.raises(RunError, match="seen"):
        monte_carlo.one(task, number, simulation)
    feed, lump = {"left": 100.0, "right": 700.0}, drawn.event.p
    for side, normal in feed.items():
        force = simulation.signals[f"machine.{side}.processing_force"]
        if side == drawn.event.side:
            assert force(0.0) == normal and lump.force == drawn.values["force"]
            assert force(1.0 + drawn.offset + lump.rise + 0.05) == pytest.approx(normal + lump.force)
        else:
            assert force == normal


def test_lumps_come_on_both_sides_alike_often_and_by_the_seed():
    config = parse(STUDY.format(runs=10))
    drawn = [monte_carlo.draw(config, k) for k in range(2000)]
    left = [d.event for d in drawn if d.event.side == "left"]
    assert abs(len(left) - 1000) < 4.0 * math.sqrt(500.0)
    # the side does not depend on how hard the lump is
    assert abs(sum(event.p.force for event in left) / len(left) - 6500.0) < 4.0 * 5000.0 / math.sqrt(
        12.0 * len(left)
    )
    other = parse(STUDY.format(runs=10).replace("[monte_carlo]", "[monte_carlo]\nseed = 2"))
    sides = [monte_carlo.draw(other, k).event.side for k in range(50)]
    assert [d.event.side for d in drawn[:50]] != sides


def test_lumps_come_anywhere_in_a_turn(killed):
    angles = sorted(row["crank_angle"] for row in killed[1].values())
    gaps = [b - a for a, b in zip(angles, [*angles[1:], angles[0] + 2.0 * math.pi], strict=True)]
    # of n uniform angles the largest gap is about 2 pi (ln n + 3)/n at most
    n = len(angles)
    assert max(gaps) < 2.0 * math.pi * (math.log(n) + 3.0) / n


def test_what_the_numbers_depend_on_is_in_the_name(killed):
    config = parse(STUDY.format(runs=10))
    drive = Drive(DcMotor, config.motor, config.machine)
    files = {
        name: killed[0].parent / f"{part.model.name}.fmu" for name, part in drive.graph.components.items()
    }
    digest = monte_carlo.Task(config, drive, files, 1.0).digest()
    assert killed[0].name == f"monte_carlo_{digest}.jsonl"
    other = dataclasses.replace(drive, feed_forward=True)
    assert monte_carlo.Task(config, other, files, 1.0).digest() != digest
    solver = dataclasses.replace(config, simulation="me")
    assert monte_carlo.Task(solver, drive, files, 1.0).digest() != digest
    more = parse(STUDY.format(runs=20))
    assert monte_carlo.Task(more, drive, files, 1.0).digest() == digest


def test_a_run_that_fails_is_a_row(killed, monkeypatch):
    config = parse(STUDY.format(runs=10))
    drive = Drive(DcMotor, config.motor, config.machine)
    files = {
        name: killed[0].parent / f"{part.model.name}.fmu" for name, part in drive.graph.components.items()
    }
    task = monte_carlo.Task(config, drive, files, 1.0)
    good = monte_carlo.one

    def fails(task, number, simulation):
        if number == 2:
            raise RunError("machine: it broke")
        return good(task, number, simulation)

    monkeypatch.setattr(monte_carlo, "one", fails)
    rows = [monte_carlo.row_of(task, task.digest(), k) for k in (1, 2, 3)]
    monte_carlo._worker.popitem()[1].close()
    assert [row["failed"] for row in rows] == [None, "machine: it broke", None]
    result = monte_carlo.MonteCarloResult(rows, killed[0], 0)
    assert result.failures == 1 and result.quantiles()["crank_torque_peak"] == {}


def line(number, **changed):
    good = dict.fromkeys(monte_carlo.Layout(monte_carlo.Sample).names, 1.0)
    row = {"run": number, "side": "left", "drawn": {"force": 1.0}, "failed": None}
    return json.dumps({**row, **good, **changed}).encode()


BAD = {
    "null": b"null",
    "5": b"5",
    "{}": b"{}",
    "[]": b"[]",
    "no text": b"\xff",
    "no text in a text": line(3, failed="\x01").replace(b"\\u0001", b"\xff"),
    "not a number": line(3, event=math.nan),
    "infinite": line(3, event=math.inf),
    "drawn is not a number": line(3, drawn={"force": math.nan}),
    "drawn is no table": line(3, drawn=1.0),
    "run -1": line(-1),
    "run 0.5": line(0.5),
    "run true": line(True),
    "no run": line(3).replace(b'"run"', b'"ran"'),
    "a value missing": line(3).replace(b'"event": 1.0, ', b""),
    "null in a run that did not fail": line(3, event=None),
    "text": line(3, event="1.0"),
    "no side": line(3, side="middle"),
    "the side missing": line(3).replace(b'"side": "left", ', b""),
    "unknown key": line(3, what=1.0),
    "failed, and numbers": line(3, failed="it broke"),
    "nested": b"[" * 100_000,
    "empty": b"",
}


@pytest.mark.parametrize("what", BAD)
def test_a_line_that_is_no_row_is_left_out_and_counted(what, tmp_path):
    file = tmp_path / "rows.jsonl"
    file.write_bytes(b"\n".join([line(1), BAD[what], line(2, trip_torque=None), b""]))
    rows, left_out = monte_carlo.read_rows(file)
    assert sorted(rows) == [1, 2] and left_out == 1
    assert monte_carlo.MonteCarloResult(list(rows.values()), file, 2).quantiles()


def test_rows_of_one_number(tmp_path):
    """Twice the same is one row; two that differ are none."""
    file = tmp_path / "rows.jsonl"
    file.write_bytes(
        b"\n".join([line(1), line(1), line(2), line(2, event=7.0), line(3), b'{"run": 4, "crank'])
    )
    rows, left_out = monte_carlo.read_rows(file)
    assert sorted(rows) == [1, 3] and left_out == 3


def test_what_is_left_out_is_computed_anew_and_told(killed, tmp_path):
    """In a copy of the folder: two rows spoilt, then run again."""
    file, before, _ = killed
    config = parse(STUDY.format(runs=5))
    drive = Drive(DcMotor, config.motor, config.machine)
    files = {name: file.parent / f"{part.model.name}.fmu" for name, part in drive.graph.components.items()}
    task = monte_carlo.Task(config, drive, files, 1.0)
    lines = [json.dumps(before[k]) for k in (0, 1, 2)]
    (tmp_path / file.name).write_text("\n".join([*lines, lines[0].replace(":", ";"), "5"]) + "\n")
    reports = []
    result = monte_carlo.run(task, tmp_path, lambda *said: reports.append(said[1:]), workers=1)
    assert (result.earlier_runs, result.left_out) == (3, 2)
    assert result.rows == [before[k] for k in range(5)]
    assert result.as_dict()["left_out"]["value"] == 2
    # one at a time
    assert reports == [(3, 5), (4, 5), (5, 5)]
    assert monte_carlo.read_rows(tmp_path / file.name) == ({k: before[k] for k in range(5)}, 0)


@pytest.mark.parametrize("end", [None, signal.SIGTERM])
def test_processes_leave_nothing_behind(end, tmp_path):
    """No folder stays behind when the processes end, nor after SIGTERM to all of them."""
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    running = start(tmp_path, 4 if end is None else 10_000, env=os.environ | {"TMPDIR": str(scratch)})
    if end is not None:
        while not list(tmp_path.glob("*.jsonl")) or len(list(scratch.glob("chainunit*"))) < 4:
            assert running.poll() is None
            time.sleep(0.02)
        os.killpg(running.pid, end)
    _, errors = running.communicate(timeout=120)
    assert (running.returncode == 0) == (end is None), errors
    with contextlib.suppress(ProcessLookupError):
        while True:  # until the last of its processes is gone
            os.killpg(running.pid, 0)
            time.sleep(0.02)
    assert list(scratch.glob("chainunit*")) == []


def test_an_error_in_a_process_is_not_the_files(tmp_path, monkeypatch):
    """The second run fails for want of file handles: the first stays, and the file is not blamed."""
    config = parse(STUDY.format(runs=3))
    drive = Drive(DcMotor, config.motor, config.machine)
    task = monte_carlo.Task(config, drive, {}, 1.0)

    def row(_task, _digest, number):
        if number:
            raise OSError(errno.EMFILE, "Too many open files")
        return {"run": number}

    monkeypatch.setattr(monte_carlo.Task, "digest", lambda self: "0")
    monkeypatch.setattr(
        monte_carlo, "ProcessPoolExecutor", lambda workers, **_: ThreadPoolExecutor(max_workers=workers)
    )
    monkeypatch.setattr(monte_carlo, "row_of", row)
    with pytest.raises(RunError, match=r"a process .* failed .*\(Too many open files\)") as failed:
        monte_carlo.run(task, tmp_path, lambda *said: None, workers=1)
    assert not isinstance(failed.value, WriteError) and "jsonl" not in str(failed.value)


def test_question_and_answer_tell_of_random_overloads(tmp_path):
    """A coupling that opens in most runs is a warning, not a number in a table alone."""
    (tmp_path / "study.toml").write_text("event = []\n" + STUDY.format(runs=6))
    process = chainunit("study", "study.toml", "-o", "out", cwd=tmp_path)
    assert process.returncode == 0, process.stderr
    result = json.loads((tmp_path / "out" / "result.json").read_text())
    quantiles_of = result["monte_carlo"]["quantiles"]
    opens = shown(quantiles_of["trips"]["share"]["value"], "1", "percent")
    assert quantiles_of["trips"]["share"]["value"] > 0.0
    (warning,) = (each for each in result["warnings"] if each["kind"] == "random overload trips")
    assert warning["text"] == f"Overloads at random: in {opens} of them the safety coupling opens."
    text = " ".join((tmp_path / "out" / "result.md").read_text().split())
    question, _, answer = text.partition("## The answer")
    assert (
        "Then come 6 overloads at random, each by itself: a lump jams the left or the right side." in question
    )
    assert f"the safety coupling opens in {opens} (" in answer.partition("##")[0]
    peak = shown(quantiles_of["crank_torque_peak"]["q50"]["value"], "N.m")
    assert f"Of 6 overloads at random: 50 % stay below a crank torque of {peak} (" in answer
    assert f"the safety coupling opens in {opens} (" in " ".join(process.stdout.split())
