"""Random overloads: every process computes the same numbers, and a kill loses no finished run."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import math
import os
import pickle
import shutil
import signal
import socket
import subprocess
import sys
import textwrap
import time
from pathlib import Path
from types import SimpleNamespace

import batches
import netCDF4
import numpy as np
import pytest
import xarray as xr
from command import chainunit
from records import like

from chainunit.capabilities.random_overloads import page
from chainunit.capabilities.random_overloads import runs as monte_carlo
from chainunit.core.errors import RunError
from chainunit.core.native.compilers import compiler
from chainunit.core.quantities import Layout
from chainunit.drives.dc_motor import DcMotor
from chainunit.reading.result_entries import ResultEntries
from chainunit.reading.results import as_data
from chainunit.reading.text import number as shown
from chainunit.report.terminal import plain_line
from chainunit.study import block_runs, quantiles
from chainunit.study.block_runs import BlockRuns, Cause, EventSimulation
from chainunit.study.choice import choose
from chainunit.study.config import parse
from chainunit.study.drive import Drive
from chainunit.study.drive_fmus import export_drive, with_files
from chainunit.study.quantiles import Estimate
from chainunit.study.rig import Rig
from chainunit.system import CoSimulation, monolithic
from chainunit.work.job import CHECKS

needs_compiler = pytest.mark.skipif(compiler() is None, reason="no C compiler")
RUNS = 50
"""Three whole batches, and one of two runs."""
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
    from chainunit.capabilities.random_overloads import runs as monte_carlo
    from chainunit.study import quantiles
    from chainunit.study.drive import Drive
    from chainunit.study.drive_fmus import export_drive
    from chainunit.study.rig import Rig

    if __name__ == "__main__":
        config = parse(Path("study.toml").read_text())
        drive = Drive(DcMotor, config.motor.parameters, config.machine)
        files, _ = export_drive(drive, Path("."))
        plan, rig = config.plans["random_overloads"], Rig(config.operation, drive, files)
        task = monte_carlo.RandomTask(plan, rig, 1.0, cosimulated=True)
        result = monte_carlo.run(task, Path("."), lambda what, done, todo: print(done, todo, flush=True), workers=2)
        print("resumed", result.earlier_runs, result.damaged_batches, flush=True)
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


def finished(folder):
    """The number of finished batches."""
    return sum(map(batches.finished, folder.glob("monte_carlo_*.nc")))


def vanish(process):
    """Wait until the last process of a group is gone."""
    with contextlib.suppress(ProcessLookupError):
        while True:
            os.killpg(process.pid, 0)
            time.sleep(0.02)


def opened(folder):
    """The results in a folder."""
    (store,) = folder.glob("monte_carlo_*.nc")
    dataset = xr.open_dataset(store).drop_vars(CHECKS)
    return monte_carlo.MonteCarloResult(dataset.load(), store, "cs")


@pytest.fixture(scope="module")
def killed(tmp_path_factory):
    """The folder of a study that was killed after its first batch, of which a number was then changed, and that was
    resumed; the number of batches that it had, and what the second process said."""
    folder = tmp_path_factory.mktemp("monte carlo")
    scratch = folder / "scratch"
    scratch.mkdir()
    first = start(folder, RUNS, env=os.environ | {"TMPDIR": str(scratch)})
    while not finished(folder):
        assert first.poll() is None, first.stderr.read()
        time.sleep(0.02)
    # its workers notice, and remove what they have unpacked
    os.kill(first.pid, signal.SIGKILL)
    first.communicate()
    vanish(first)
    assert list(scratch.glob("chainunit*")) == []
    done = finished(folder)
    (store,) = folder.glob("monte_carlo_*.nc")
    with netCDF4.Dataset(store) as stored:
        first_run = int(np.flatnonzero(stored[CHECKS][:])[0]) * monte_carlo.COSIMULATED_BATCH
    batches.damage(store, "crank_torque_peak", first_run)
    second = start(folder, RUNS)
    message, errors = second.communicate()
    assert second.returncode == 0, errors
    return folder, done, message


def task_of(folder, runs=RUNS, text=STUDY, cosimulated=True):
    config = parse(text.format(runs=runs))
    drive = Drive(DcMotor, config.motor.parameters, config.machine)
    files = {name: folder / f"{part.model.name}.fmu" for name, part in drive.graph.components.items()}
    return random_task(config, drive, files, 1.0, cosimulated=cosimulated)


def random_task(config, drive, files, steady, **options):
    rig = Rig(config.operation, drive, files)
    return monte_carlo.RandomTask(config.plans["random_overloads"], rig, steady, **options)


def with_rig(task, **changes):
    return dataclasses.replace(task, rig=dataclasses.replace(task.rig, **changes))


def draw(task, number):
    return monte_carlo.draw(task.plan, task.rig.operation, number)


def point(task, drawn):
    return monte_carlo.point(task.rig, drawn, task.plan.duration)


def task_by(config):
    """The task of a study without FMUs."""
    return random_task(config, Drive(DcMotor, config.motor.parameters, config.machine), {}, 1.0)


@pytest.mark.slow
def test_a_killed_study_goes_on_from_what_it_saved(killed):
    folder, done, message = killed
    assert 0 < done < 4 and f"resumed {16 * (done - 1)} 1" in message
    assert opened(folder).runs == RUNS


@pytest.mark.slow
def test_the_store_is_that_of_an_unbroken_study(killed, tmp_path, monkeypatch):
    """In this process, from the first to the last run: the bytes of every file are the same."""
    folder, _, _ = killed
    closed, close = [], EventSimulation.close
    monkeypatch.setattr(EventSimulation, "close", lambda self: closed.append(close(self)))
    result = monte_carlo.run(task_of(folder), tmp_path, lambda *said: None, workers=1)
    assert result.file.read_bytes() == opened(folder).file.read_bytes() and len(closed) == 1


def branches(task, simulation, *drawn):
    """The runs with these events from the saved state of a simulation."""
    system = EventSimulation.__new__(EventSimulation)
    system.rig, system._start, system._simulation = task.rig, task.steady, simulation
    return list(system.runs([point(task, each) for each in drawn]))


@pytest.mark.slow
def test_a_run_is_what_its_number_says(killed):
    """Run again here, in this process, in another order."""
    task, results = task_of(killed[0]), opened(killed[0]).dataset
    drive, run = task.rig.drive, task.rig.operation.run
    signals = {**drive.loads(task.rig.operation.feed), **drive.reference(run.crank_speed, run.ramp)}
    with CoSimulation(with_files(drive, task.files), signals) as simulation:
        simulation.run(1.0, run.step)
        simulation.save()
        for number in (7, 3, 20):
            drawn, run = draw(task, number), results.isel(run=number)
            (branch,) = branches(task, simulation, drawn)
            got = Layout(monte_carlo.Sample).by_name(monte_carlo.sample(task, drawn, branch))
            assert ("none", "left", "right")[int(run["side"])] == drawn.event.side
            assert float(run["drawn_force"]) == drawn.values["force"]
            assert {name: float(run[name]) for name in got} == got


@pytest.mark.slow
def test_the_store_says_what_its_numbers_are(killed):
    results = opened(killed[0]).dataset
    assert results["side"].attrs["flag_meanings"] == "none left right"
    assert list(results["side"].attrs["flag_values"]) == [0, 1, 2]
    assert results["drawn_force"].attrs["units"] == "N" and results["trip_torque"].attrs["units"] == "N.m"
    for v in Layout(monte_carlo.Sample).variables:
        assert results[v.name].attrs == {"units": v.unit, "long_name": v.description}


@pytest.mark.slow
def test_answers_hang_together(killed):
    result = opened(killed[0])
    runs = result.dataset
    assert 0 < float(runs["trips"].sum()) < result.runs
    np.testing.assert_array_equal(runs["crank_torque_peak"] > runs["trip_torque"], runs["trips"] > 0.5)
    assert ((runs["drawn_force"] >= 4000.0) & (runs["drawn_force"] <= 9000.0)).all()
    sides = {side: runs["value"] for side, runs in as_data(result)["sides"].items()}
    assert sides == {"left": int((runs["side"] == 1).sum()), "right": int((runs["side"] == 2).sum())}
    assert min(sides.values()) > 0 and sum(sides.values()) == RUNS
    outcome = as_data(result)["quantiles"]
    share = outcome["trips"]["share"]
    assert share["unit"] == "1" and share["low"]["value"] < share["value"] < share["high"]["value"]


@pytest.mark.slow
def test_quantiles_have_intervals_or_are_left_out(killed):
    """Of the few runs the median is told, of 100 like them the 5 % and 95 % quantiles, too, of 400 all."""
    few = opened(killed[0]).dataset
    for number, entries in ((30, ["q50"]), (100, ["q5", "q50", "q95"]), (400, ["q5", "q50", "q95", "q99"])):
        runs = few.isel(run=np.arange(number) % few.sizes["run"])
        k = np.arange(number)
        values = 100.0 + k % 97 + 1e-3 * k
        runs = runs.assign(crank_torque_peak=("run", values))
        result = monte_carlo.MonteCarloResult(runs, killed[0], "cs")
        sizes = result.quantiles["crank_torque_peak"]
        assert list(sizes) == entries
        for name, each in sizes.items():
            assert dataclasses.replace(each, unit="") == quantiles.quantile(
                list(values), float(name[1:]) / 100.0
            )
            assert each.low < each.value < each.high
        entry = as_data(result)["quantiles"]["crank_torque_peak"][entries[-1]]
        assert entry["low"] == {"value": sizes[entries[-1]].low, "unit": "N.m"}
        assert bool(result.shortage) == (number < 368)
    remark = monte_carlo.MonteCarloResult(few.isel(run=slice(0, 30)), killed[0], "cs").shortage
    assert "30 runs are too few" in remark and "the 99 % quantile takes 368" in remark


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
    task = task_by(config)
    drawn, simulation = draw(task, number), Still()
    assert drawn == draw(task_by(parse(STUDY.format(runs=99))), number)
    (branch,) = branches(task, simulation, drawn)
    assert str(branch.fault) == "seen"
    feed, lump = {"left": 100.0, "right": 700.0}, drawn.event.p
    for side, normal in feed.items():
        force = simulation.signals[f"machine.{side}.processing_force"]
        if side == drawn.event.side:
            assert force(0.0) == normal and lump.force == drawn.values["force"]
            assert force(1.0 + drawn.offset + lump.rise + 0.05) == pytest.approx(normal + lump.force)
        else:
            assert force == normal


def test_lumps_come_on_both_sides_alike_often_and_by_the_seed():
    task = task_by(parse(STUDY.format(runs=10)))
    drawn = [draw(task, k) for k in range(2000)]
    left = [d.event for d in drawn if d.event.side == "left"]
    assert abs(len(left) - 1000) < 4.0 * math.sqrt(500.0)
    # the side does not depend on how hard the lump is
    assert abs(sum(event.p.force for event in left) / len(left) - 6500.0) < 4.0 * 5000.0 / math.sqrt(
        12.0 * len(left)
    )
    other = task_by(parse(STUDY.format(runs=10).replace("[monte_carlo]", "[monte_carlo]\nseed = 2")))
    sides = [draw(other, k).event.side for k in range(50)]
    assert [d.event.side for d in drawn[:50]] != sides


@pytest.mark.slow
def test_lumps_come_anywhere_in_a_turn(killed):
    angles = sorted(opened(killed[0]).values("crank_angle"))
    gaps = [b - a for a, b in zip(angles, [*angles[1:], angles[0] + 2.0 * math.pi], strict=True)]
    # of n uniform angles the largest gap is about 2 pi (ln n + 3)/n at most
    n = len(angles)
    assert max(gaps) < 2.0 * math.pi * (math.log(n) + 3.0) / n


@pytest.mark.slow
def test_what_the_numbers_depend_on_is_in_the_name(killed):
    folder, _, _ = killed
    task = task_of(folder)
    digest = task.digest()
    assert opened(folder).file.name == f"monte_carlo_{digest}.nc"
    for other in (
        with_rig(task, drive=dataclasses.replace(task.rig.drive, feed_forward=True)),
        with_rig(task, operation=dataclasses.replace(task.rig.operation, simulation="me")),
        task_of(folder, text=STUDY.replace("scatter = 0.2", "scatter = 0.3")),
    ):
        assert other.digest() != digest
    assert task_of(folder, runs=20).digest() == digest


@pytest.mark.slow
def test_a_run_that_fails_is_a_result(killed, tmp_path, monkeypatch):
    """Its numbers are missing, its event and the reason are kept, and the runs after it are the same."""
    task, good = task_of(killed[0], runs=5), block_runs.follow
    third = task.steady + draw(task, 2).offset

    def fails(rig, simulation, event, begin, *rest, **more):
        if begin == third:
            raise RunError("machine: it broke")
        return good(rig, simulation, event, begin, *rest, **more)

    monkeypatch.setattr(block_runs, "follow", fails)
    result = monte_carlo.run(task, tmp_path, lambda *said: None, workers=1)
    assert result.reasons == {2: "machine: it broke"} and result.failures == 1 and result.method == "cs"
    assert as_data(result)["failed"]["value"] == 1 and len(result.values("event")) == 4
    got, wanted = result.dataset, opened(killed[0]).dataset
    for name in Layout(monte_carlo.Sample).names:
        assert np.isnan(got[name][2]), name
        np.testing.assert_array_equal(got[name][[0, 1, 3, 4]], wanted[name][[0, 1, 3, 4]])
    np.testing.assert_array_equal(got["drawn_force"], wanted["drawn_force"][:5])
    # of four runs there is no quantile
    assert result.quantiles["crank_torque_peak"] == {}


@pytest.mark.slow
def test_a_damaged_batch_is_computed_anew_and_told(killed, tmp_path):
    (store,) = killed[0].glob("monte_carlo_*.nc")
    copy = Path(shutil.copy(store, tmp_path))
    batches.damage(copy, "stalls", 49)
    reports = []
    result = monte_carlo.run(task_of(killed[0]), tmp_path, lambda *said: reports.append(said[1:]), workers=1)
    assert (result.earlier_runs, result.damaged_batches) == (48, 1)
    assert as_data(result)["damaged_batches"]["value"] == 1
    assert reports == [(0, 50), (48, 50), (50, 50)] and copy.read_bytes() == store.read_bytes()


@pytest.mark.slow
def test_a_machine_without_the_files_of_the_fmus_makes_the_same_runs(killed, tmp_path):
    """A parcel that has come over a wire holds all that a run needs."""
    parcel = monte_carlo.Parcel.of(task_of(killed[0]))
    nowhere = dict.fromkeys(parcel.content, tmp_path / "nowhere.fmu")
    away = dataclasses.replace(parcel, task=with_rig(parcel.task, files=nowhere))
    runs = monte_carlo.make_runs(pickle.loads(pickle.dumps(away)), 17, 19)
    wanted = opened(killed[0]).dataset.isel(run=slice(17, 19))
    assert runs["failed"] == ["", ""] and len(runs) == len(wanted)
    for name in set(runs) - {"failed"}:
        np.testing.assert_array_equal(runs[name], wanted[name])


def test_a_parcel_makes_its_system_once_and_closes_it_when_it_goes(monkeypatch):
    made, closed = [], []

    class Simulation:
        def __init__(self, rig, start):
            made.append(start)

        def close(self):
            closed.append(self)

    monkeypatch.setattr(monte_carlo, "EventSimulation", Simulation)
    parcel = monte_carlo.Parcel(task_by(parse(STUDY.format(runs=4))), "", {})
    assert parcel.system is parcel.system and made == [1.0] and not closed
    del parcel
    assert len(closed) == 1


@pytest.mark.slow
def test_a_scheduler_is_asked_before_any_run(tmp_path):
    pytest.importorskip("distributed")
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{taken.getsockname()[1]}"
        for runs, words in (
            (4, f"scheduler {address}: does not answer"),
            (0, f"scheduler {address}: is for random"),
        ):
            (tmp_path / "study.toml").write_text(STUDY.format(runs=runs))
            done = chainunit("study", "study.toml", "-o", "out", "--scheduler", address, cwd=tmp_path)
            assert done.returncode == 2 and words in done.stderr and len(done.stderr.splitlines()) == 1
            assert not (tmp_path / "out" / "fmu").exists()


@pytest.mark.slow
@pytest.mark.parametrize("end", [None, signal.SIGTERM])
def test_processes_leave_nothing_behind(end, tmp_path):
    """No folder stays behind when the processes end, nor after SIGTERM to all of them."""
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    running = start(tmp_path, 18 if end is None else 10_000, env=os.environ | {"TMPDIR": str(scratch)})
    if end is not None:
        while not finished(tmp_path) or len(list(scratch.rglob("chainunit_fmu_*"))) < 4:
            assert running.poll() is None
            time.sleep(0.02)
        os.killpg(running.pid, end)
    _, errors = running.communicate(timeout=120)
    assert (running.returncode == 0) == (end is None), errors
    vanish(running)
    assert list(scratch.glob("chainunit*")) == []


@pytest.mark.parametrize(("current", "told"), [(4.4, True), (4.3, False)])
def test_a_current_at_its_limit_and_damaged_batches_are_noted(current, told):
    drive = choose(parse(""), Path(), lambda *said: None).drive
    assert drive.parameters.limit.i == 4.4
    quantiles = {"current_peak": {"q50": Estimate(2.0, 1.0, 3.0), "q95": Estimate(current, 4.0, 4.4)}}
    random = SimpleNamespace(quantiles=quantiles, shortage="", damaged_batches=1, file_name="runs.nc")
    notes = {}
    study = like(drive=drive, say=lambda code, **values: notes.update({code.code: values}))
    monte_carlo.MonteCarloResult.remark(random, study)
    at = notes.get("random-overloads-at-current-limit")
    assert at == ({"limit": 4.4} if told else None)
    words = "1 batch of runs in runs.nc was damaged, and was computed anew"
    assert notes["runs-made-anew"] == {"text": words}


@pytest.mark.slow
def test_question_and_answer_tell_of_random_overloads(tmp_path):
    """A coupling that opens in most runs is a warning, not a number in a table alone."""
    (tmp_path / "study.toml").write_text("event = []\n" + STUDY.format(runs=6))
    process = chainunit("study", "study.toml", "-o", "out", cwd=tmp_path)
    assert process.returncode == 0, process.stderr
    result = ResultEntries(json.loads((tmp_path / "out" / "result.json").read_text()))
    quantiles_of = result["monte_carlo"]["quantiles"]
    opens = shown(quantiles_of["trips"]["share"]["value"], "1", "percent")
    assert quantiles_of["trips"]["share"]["value"] > 0.0
    (warning,) = (each for each in result["warnings"] if each["code"] == "random-overload-trips")
    assert warning["text"] == f"Overloads at random: in {opens} of them the torque limiter opens."
    text = " ".join((tmp_path / "out" / "result.md").read_text().split())
    _, _, answer = text.partition("## The answer")
    assert "Then come 6 overloads at random, each by itself: a lump jams the left or the right side." in text
    assert f"the torque limiter opens in {opens} (" in answer.partition("##")[0]
    peak = shown(quantiles_of["crank_torque_peak"]["q50"]["value"], "N.m")
    assert f"Of 6 overloads at random: 50 % stay below a crank torque of {peak} (" in answer
    said = " ".join(process.stdout.split())
    assert f"the torque limiter opens in {opens} (" in said
    method, words = (
        ("compiled", "on the compiled system") if compiler() else ("cs", "by co-simulation of the FMUs")
    )
    assert result["monte_carlo"]["method"] == method
    assert all(f"The random overloads were run {words}." in each for each in (text, said))


@pytest.mark.parametrize(
    "key, words", [("cs", "by co-simulation of the FMUs"), ("me", "by Model Exchange of the FMUs")]
)
def test_runs_of_the_fmus_are_told_as_such(key, words, monkeypatch):
    """Those that the study asks for, and those that it makes as there is no C compiler."""
    config = parse(f'simulation = "{key}"\n' + STUDY.format(runs=4))
    task = task_by(config)
    assert dataclasses.replace(task, cosimulated=True).method == key
    monkeypatch.setattr(monte_carlo, "can_run", lambda: False)
    # without quantiles there is no table, and the line stands alone
    no_runs = xr.Dataset(
        {"side": ("run", [])} | {v.name: ("run", []) for v in Layout(monte_carlo.Sample).variables}
    )
    findings = monte_carlo.MonteCarloResult(no_runs, Path("runs.nc"), task.method)
    (block,) = page.blocks(like(by_analysis={"monte_carlo": findings}))
    assert plain_line(block.line) == f"The random overloads were run {words}."


MOTOR = '[system]\nmotor = "InductionMotor"\n'
EMPTY = "empty_start = true\n"
CHAIN = 'organ = "chain"\n[chain]\nrods = 3\n'
BLOCKED = STUDY.replace(
    "event = {{ force = [4000, 9000], duration = 0.1 }}", 'event = {{ type = "blocked" }}'
)


def compiled_task(text, folder=None, runs=6):
    """The task of a study on its compiled system; the FMUs are written where a `folder` is given."""
    config = parse(text.format(runs=runs).replace("step = 0.004", "step = 0.001"))
    drive = choose(config, Path("fmu"), lambda *said: None).drive
    files = export_drive(drive, folder)[0] if folder else {}
    return random_task(config, drive, files, 1.2)


@pytest.mark.slow
@needs_compiler
@pytest.mark.parametrize(
    "text", [STUDY, BLOCKED, MOTOR + STUDY, CHAIN + STUDY], ids="bars blocked induction chains".split()
)
def test_the_compiled_system_agrees_with_the_co_simulation(text, tmp_path):
    """To the error of the coupling; the same runs trip, at the same row."""
    task = compiled_task(text, tmp_path)
    drawn = [draw(task, number) for number in range(4)]
    points = [point(task, each) for each in drawn]
    reference = EventSimulation(dataclasses.replace(task, cosimulated=True).rig, task.steady)
    try:
        wanted = list(reference.runs(points))
    finally:
        reference.close()
    for got, other, each in zip(task.block().runs(points), wanted, drawn, strict=True):
        assert got.fault is None and got.ended == other.ended and got.series.sizes == other.series.sizes
        a, b = (
            Layout(monte_carlo.Sample).by_name(monte_carlo.sample(task, each, run)) for run in (got, other)
        )
        for name, x in a.items():
            assert x == b[name] or abs(x - b[name]) < 1e-3 * max(abs(b[name]), 0.1), (name, x, b[name])


@pytest.mark.slow
@needs_compiler
@pytest.mark.parametrize(
    "text, fed_from",
    [(STUDY, None), (BLOCKED, None), (MOTOR + STUDY, None), (CHAIN + STUDY, None), (EMPTY + STUDY, 0.5)],
    ids="bars blocked induction chains empty".split(),
)
def test_a_compiled_start_is_the_monolithic_solution(text, fed_from, monkeypatch):
    task = with_rig(compiled_task(text), fed_from=fed_from)
    block, rig = task.block(), task.rig
    reference = monolithic(rig.graph, rig.signals(ramp=True), np.linspace(0.0, task.steady, 25))
    monkeypatch.delattr(block_runs, "monolithic")
    names = block.system.model.state_layout.names
    for name, x in zip(names, block.states, strict=True):
        row = reference[name].values
        assert abs(x - row[-1]) <= 1e-6 * max(np.max(np.abs(row)), 1e-3), (name, x, row[-1])


@needs_compiler
def test_a_feed_forward_starts_by_the_monolithic_solution():
    """Its model takes the rate of the reference, which the compiled loop does not evaluate."""
    task = compiled_task("feed_forward = true\n" + STUDY)
    block, rig = task.block(), task.rig
    assert "model.a" in rig.signals(ramp=True)
    reference = monolithic(rig.graph, rig.signals(ramp=True), [0.0, task.steady], rtol=1e-11)
    wanted = [float(reference[name][-1]) for name in block.system.model.state_layout.names]
    np.testing.assert_allclose(block.states, wanted, rtol=1e-6, atol=1e-9)


@needs_compiler
def test_a_start_that_leaves_all_bounds_is_told():
    task = compiled_task(STUDY)
    operation = task.rig.operation
    left = dataclasses.replace(operation.feed.left, processing_force=1e300)
    operation = dataclasses.replace(operation, feed=dataclasses.replace(operation.feed, left=left))
    with pytest.raises(RunError, match=r"^at t = \S+ s: the states left all bounds$"):
        monte_carlo.Parcel.of(with_rig(task, operation=operation))


@needs_compiler
def test_a_parcel_builds_the_system_once(monkeypatch):
    built, init = [], BlockRuns.__init__

    def counted(self, *given, **named):
        built.append(1)
        init(self, *given, **named)

    monkeypatch.setattr(BlockRuns, "__init__", counted)
    task = compiled_task(STUDY)
    parcel = monte_carlo.Parcel.of(task)
    assert len(built) == 1 and parcel.digest == task.digest()


@needs_compiler
def test_runs_on_the_compiled_system_do_not_depend_on_their_batch(tmp_path):
    """In one process without Dask; made again by a worker from its parcel, in other batches."""
    task = compiled_task(STUDY, runs=30)
    result = monte_carlo.run(task, tmp_path, lambda *said: None)
    assert result.runs == 30 and not result.failures
    assert result.method == "compiled"
    parcel = pickle.loads(pickle.dumps(monte_carlo.Parcel.of(task)))
    pieces = [monte_carlo.make_runs(parcel, a, b) for a, b in ((0, 7), (7, 30))]
    for name in pieces[0]:
        both = [x for piece in pieces for x in piece[name]]
        stored = result.dataset[name].values
        assert name == "failed" or np.array_equal(both, stored, equal_nan=True), name
    # the event of a run is that of its number, whatever computes it
    drawn = [draw(task, k).values["force"] for k in range(30)]
    np.testing.assert_array_equal(result.dataset["drawn_force"], drawn)
    assert task.digest() != dataclasses.replace(task, cosimulated=True).digest()


@needs_compiler
def test_a_wild_run_on_the_compiled_system_fails_alone():
    task = compiled_task(STUDY)
    block, drawn = task.block(), [draw(task, k) for k in range(3)]
    points = [point(task, each) for each in drawn]
    wild = dataclasses.replace(points[1].event, p=dataclasses.replace(points[1].event.p, force=1e300))
    runs = list(block.runs([points[0], dataclasses.replace(points[1], event=wild), points[2]]))
    assert [run.fault is None for run in runs] == [True, False, True]
    fault = runs[1].fault
    assert fault.cause is Cause.LEFT_BOUNDS and fault.time == runs[1].series["time"][-1]
    assert str(fault) == f"at t = {fault.time:g} s: the states of the drive left all bounds"
    for k in (0, 2):
        (alone,) = block.runs([points[k]])
        xr.testing.assert_identical(alone.series, runs[k].series)
