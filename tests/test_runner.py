"""Long work in batches: whatever ends a run, the next one goes on, and at the end the store has the same bytes."""

from __future__ import annotations

import contextlib
import json
import multiprocessing
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import batches
import numpy as np
import pytest
import xarray as xr

from chainunit.core.errors import InputError, InterruptedRunError, RunError
from chainunit.work import runner
from chainunit.work.job import CHECKS, Job, ResultVariable, text_array, texts
from chainunit.work.store import BatchStore

HERE = Path(__file__).parent


def quiet(*said):
    pass


def content(store):
    """All files of a store, by their names."""
    return {p.relative_to(store).as_posix(): p.read_bytes() for p in store.rglob("*") if p.is_file()}


def seen(folder):
    """The first points of the batches that were made, in order."""
    return sorted(int(p.name.split("_")[0]) for p in folder.iterdir())


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory):
    """The store of a run that nothing disturbed."""
    return runner.run(batches.job(), tmp_path_factory.mktemp("unbroken"), quiet, workers=1)


def test_the_dataset_is_the_work(unbroken):
    dataset, wanted = unbroken.dataset, batches.results(0, 100)
    assert list(dataset) == list(wanted) and dict(dataset.sizes)["point"] == 100
    np.testing.assert_array_equal(dataset["height"], wanted["height"])
    np.testing.assert_array_equal(dataset["curve"], wanted["curve"].astype("float32"))
    assert dataset["colour"].dtype == np.int8 and list(dataset["colour"].values[:4]) == [0, 1, 2, 0]
    assert texts(dataset["remark"]) == wanted["remark"]
    assert dataset["curve"].attrs == {"units": "N.m", "long_name": "torque over the angle"}
    assert dataset["colour"].attrs["flag_meanings"] == "red green blue"
    assert list(dataset["colour"].attrs["flag_values"]) == [0, 1, 2]
    assert list(dataset["angle"].values) == [0.0, 0.5, 1.0] and dataset["angle"].attrs["units"] == "rad"
    # the store is one of Zarr to any reader
    other = xr.open_zarr(unbroken.file, consolidated=False)
    xr.testing.assert_identical(other[list(wanted)].drop_attrs(), dataset.drop_attrs())


def test_the_dataset_is_read_when_it_is_used(tmp_path):
    """A chunk that goes after the dataset is opened is missing in it."""
    made = runner.run(batches.job(), tmp_path, quiet, workers=1)
    dataset = made.dataset
    chunk(made.file, "curve", 1).unlink()
    assert np.isnan(dataset["curve"][16:32]).all() and not np.isnan(dataset["curve"][32:]).any()


def test_a_small_job_needs_no_dask(tmp_path):
    made = subprocess.run(
        [sys.executable, HERE / "batches.py", tmp_path, "8", "1"], capture_output=True, text=True, check=True
    )
    assert made.stdout.split() == ["0", "False"]


@pytest.mark.second
def test_a_script_that_is_run_by_its_workers_is_told_what_to_do(tmp_path):
    """Each local process imports the script, which then starts processes itself."""
    script = tmp_path / "script.py"
    script.write_text(
        "import sys; from pathlib import Path; import batches\nfrom chainunit.work.runner import run\n"
        "run(batches.job(), Path(sys.argv[1]), print, workers=2)\n"
    )
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(HERE), *filter(None, sys.path)])}
    made = subprocess.run(
        [sys.executable, script, tmp_path], env=environment, cwd=tmp_path, capture_output=True, text=True
    )
    assert made.returncode == 1
    assert "RunError: the local processes cannot be started" in made.stderr and "__main__" in made.stderr


def test_progress_and_the_end_are_told(tmp_path):
    said, ends = [], []
    runner.run(batches.job(40, closing=lambda: ends.append(1)), tmp_path, lambda *each: said.append(each), 1)
    assert said[0] == ("points of a demo", 0, 40) and ends == [1]
    assert [done for _, done, _ in said[1:]] == [0, 16, 32, 40]


@pytest.mark.second
def test_local_processes_make_the_same_store(unbroken, tmp_path):
    (tmp_path / "seen").mkdir()
    with contextlib.ExitStack() as stack:
        for host in ("127.0.0.1", "0.0.0.0"):
            # the port at which a scheduler shows its state is taken, by this or another process
            with contextlib.suppress(OSError):
                stack.enter_context(socket.create_server((host, 8787)))
        made = runner.run(batches.job(seen=str(tmp_path / "seen")), tmp_path, quiet, workers=2)
    assert content(made.file) == content(unbroken.file)
    processes = {p.name.split("_")[1] for p in (tmp_path / "seen").iterdir()}
    assert seen(tmp_path / "seen") == list(range(0, 100, 16)) and str(os.getpid()) not in processes
    assert not multiprocessing.active_children()


@pytest.mark.second
def test_a_killed_run_goes_on(tmp_path):
    """SIGKILL of the main process, after some batches."""
    killed, whole = tmp_path / "killed", tmp_path / "whole"
    killed.mkdir(), whole.mkdir()
    first = subprocess.Popen(
        [sys.executable, HERE / "batches.py", killed, "400", "2", "slowly"], start_new_session=True
    )
    marks = killed / batches.job().store_name / CHECKS / "c"
    while not marks.exists() or len(list(marks.iterdir())) < 8:
        assert first.poll() is None
        time.sleep(0.01)
    first.kill()
    first.wait()
    assert len(list(marks.iterdir())) < 100
    (tmp_path / "seen").mkdir()
    again = runner.run(batches.job(400, 4, seen=str(tmp_path / "seen")), killed, quiet, workers=1)
    assert again.earlier_points >= 32 and again.damaged_batches == 0
    assert len(seen(tmp_path / "seen")) == (400 - again.earlier_points) // 4
    assert content(again.file) == content(runner.run(batches.job(400, 4), whole, quiet, workers=1).file)


class Killed(BaseException):
    """The process ended here."""


@pytest.mark.parametrize("before", [True, False])
def test_a_kill_at_any_file(before, unbroken, tmp_path, monkeypatch):
    """Before or after each file that a run of three batches writes; before it, a temporary file is left behind."""
    put, job = BatchStore._put, batches.job(40)
    wanted = content(runner.run(job, tmp_path / "whole", quiet, workers=1).file)
    for last in range(len(wanted)):
        count, folder = iter(range(1000)), tmp_path / str(last)

        def dies(self, file, *rest, count=count, last=last, **more):
            ends = next(count) == last
            if not (ends and before):
                put(self, file, *rest, **more)
            if ends and before:
                file.parent.mkdir(parents=True, exist_ok=True)
                file.with_name(f"{file.name}.0123456789abcdef.part").write_bytes(b"half")
            if ends:
                raise Killed

        monkeypatch.setattr(BatchStore, "_put", dies)
        with pytest.raises(Killed):
            runner.run(job, folder, quiet, workers=1)
        monkeypatch.setattr(BatchStore, "_put", put)
        again = runner.run(job, folder, quiet, workers=1)
        assert content(again.file) == wanted and again.damaged_batches == 0


def chunk(store, name, batch):
    inner = {"curve": "/0/0", "remark": "/0"}.get(name, "")
    return store / name / f"c/{batch}{inner}"


def changed(file, change):
    file.write_bytes(change(file.read_bytes()))


def reshaped(store):
    file = store / "height" / "zarr.json"
    changed(file, lambda old: json.dumps(json.loads(old) | {"shape": [7]}).encode())


DAMAGES = {
    "a chunk is missing": (lambda s: chunk(s, "curve", 2).unlink(), [2]),
    "a chunk is cut off": (lambda s: changed(chunk(s, "height", 1), lambda b: b[:-5]), [1]),
    "a chunk is empty": (lambda s: changed(chunk(s, "height", 0), lambda b: b""), [0]),
    "a byte is another": (lambda s: changed(chunk(s, "remark", 6), lambda b: b[:9] + b"x" + b[10:]), [6]),
    "the chunk of another batch": (
        lambda s: shutil.copy(chunk(s, "height", 3), chunk(s, "height", 4)),
        [4],
    ),
    "a checksum is missing": (lambda s: chunk(s, CHECKS, 5).unlink(), [5]),
    "a checksum is cut off": (lambda s: changed(chunk(s, CHECKS, 5), lambda b: b[:2]), [5]),
    "a variable is missing": (lambda s: shutil.rmtree(s / "colour"), list(range(7))),
    "two batches": (
        lambda s: [chunk(s, "height", 1).unlink(), chunk(s, "colour", 3).unlink()],
        [1, 3],
    ),
    "the shape is another": (reshaped, []),
    "no declaration": (lambda s: (s / "curve" / "zarr.json").unlink(), []),
    "no group": (lambda s: changed(s / "zarr.json", lambda b: b"{"), []),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_damage_is_noticed_and_made_anew(damage, unbroken, tmp_path):
    """Only the damaged batches are made again."""
    store = shutil.copytree(unbroken.file, tmp_path / unbroken.file.name)
    spoil, anew = DAMAGES[damage]
    spoil(store)
    assert content(store) != content(unbroken.file)
    (tmp_path / "seen").mkdir()
    again = runner.run(batches.job(seen=str(tmp_path / "seen")), tmp_path, quiet, workers=1)
    assert content(store) == content(unbroken.file)
    assert seen(tmp_path / "seen") == [16 * batch for batch in anew]
    assert again.damaged_batches == (0 if damage == "a checksum is missing" else len(anew))
    assert again.earlier_points == 100 - sum(4 if batch == 6 else 16 for batch in anew)


def test_a_store_grows_and_never_shrinks(unbroken, tmp_path):
    """With another number of points; its last batch was incomplete."""
    (tmp_path / "seen").mkdir()
    small = runner.run(batches.job(40), tmp_path, quiet, workers=1)
    grown = runner.run(batches.job(100, seen=str(tmp_path / "seen")), tmp_path, quiet, workers=1)
    assert (grown.earlier_points, grown.damaged_batches) == (32, 0)
    assert seen(tmp_path / "seen") == [32, 48, 64, 80, 96] and small.file == grown.file
    assert content(grown.file) == content(unbroken.file)
    few = runner.run(batches.job(40, fails=32), tmp_path, quiet, workers=1)
    assert few.earlier_points == 40 and few.dataset.sizes["point"] == 40
    np.testing.assert_array_equal(few.dataset["height"], batches.results(0, 40)["height"])
    assert content(grown.file) == content(unbroken.file)


def test_results_of_another_digest_or_declaration_are_not_mixed_in(unbroken, tmp_path):
    other = runner.run(batches.job(digest="fedcba9876543210"), tmp_path, quiet, workers=1)
    assert other.file.name != unbroken.file.name and other.earlier_points == 0
    # the same name, other batches: nothing of it counts
    shutil.copytree(unbroken.file, tmp_path / unbroken.file.name)
    again = runner.run(batches.job(batch=20), tmp_path, quiet, workers=1)
    assert again.earlier_points == 0
    np.testing.assert_array_equal(again.dataset["height"], batches.results(0, 100)["height"])


def test_two_runs_do_not_write_to_one_store(tmp_path):
    def second(*said):
        with pytest.raises(InputError, match="another chainunit writes"):
            runner.run(batches.job(), tmp_path, quiet, workers=1)

    runner.run(batches.job(), tmp_path, second, workers=1)


@pytest.mark.second
@pytest.mark.parametrize(
    ("workers", "wrong", "words"),
    [
        (1, {"fails": 32}, r"batch 2 \(point 32 to 47\) failed: ValueError\('no such point'\)"),
        (2, {"fails": 32, "slow": [48], "seconds": 60}, r"batch 2 \(point 32 to 47\) failed: ValueError"),
        (2, {"dies": 32, "slow": [48], "seconds": 60}, r"batch [23] \(point .*\) was lost, as its worker"),
    ],
)
def test_a_batch_that_fails_is_named_and_the_others_are_kept(workers, wrong, words, unbroken, tmp_path):
    # the others are written before it goes wrong, and 48 is in work, perhaps on the worker that ends
    marks = str(tmp_path / batches.job().store_name / CHECKS / "c")
    with pytest.raises(RunError, match=words):
        runner.run(batches.job(**wrong, waits=32, marks=marks), tmp_path, quiet, workers=workers)
    assert not multiprocessing.active_children()
    (tmp_path / "seen").mkdir()
    again = runner.run(batches.job(seen=str(tmp_path / "seen")), tmp_path, quiet, workers=1)
    assert again.earlier_points == 32 and content(again.file) == content(unbroken.file)
    assert seen(tmp_path / "seen") == [32, 48, 64, 80, 96]


@pytest.mark.second
@pytest.mark.parametrize("workers", [1, 2])
def test_ctrl_c_keeps_what_is_finished(workers, tmp_path):
    def interrupt(title, done, todo):
        if done >= 32:
            raise KeyboardInterrupt

    with pytest.raises(InterruptedRunError, match="interrupted after 32 of 100 points of a demo"):
        runner.run(batches.job(slow=[48, 64], seconds=60), tmp_path, interrupt, workers)
    assert not multiprocessing.active_children()
    assert runner.run(batches.job(), tmp_path, quiet, workers=1).earlier_points == 32


def test_results_that_were_not_declared_are_refused(tmp_path):
    def flawed(task, begin, end):
        return {**batches.results(begin, end), **task}

    for wrong, words in (
        (
            {"height": np.zeros(3)},
            r"height is float64 of the shape \(3,\), must be float64 of the shape \(16,\)",
        ),
        ({"colour": np.zeros(16)}, "colour is float64 .* must be int8"),
        ({"colours": np.zeros(16)}, "the results are .*'colours'.* must be"),
    ):
        job = batches.job(**wrong)
        object.__setattr__(job, "work", flawed)
        with pytest.raises(RunError, match=words):
            runner.run(job, tmp_path, quiet, workers=1)
    assert runner.run(batches.job(), tmp_path, quiet, workers=1).earlier_points == 0


@pytest.mark.second
def test_few_batches_are_in_work(tmp_path, monkeypatch):
    """The memory holds a batch for each worker, and the one that is being written."""
    from distributed import Client

    submit, write, balance, most = Client.submit, BatchStore.write, [0], [0]

    def counted(*args, **more):
        balance[0] += 1
        most[0] = max(most[0], balance[0])
        return submit(*args, **more)

    def written(*args):
        write(*args)
        balance[0] -= 1

    monkeypatch.setattr(Client, "submit", counted)
    monkeypatch.setattr(BatchStore, "write", written)
    runner.run(batches.job(400, 8), tmp_path, quiet, workers=2)
    assert balance == [0] and most[0] == 3


def free_port():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        return taken.getsockname()[1]


def test_a_scheduler_that_does_not_answer_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(runner, "PATIENCE", 0.3)
    with socket.create_server(("127.0.0.1", 0)) as mute:
        addresses = [
            f"tcp://127.0.0.1:{free_port()}",
            f"tcp://127.0.0.1:{mute.getsockname()[1]}",
            "tcp://127.0.0.1",
            "post://127.0.0.1:8786",
        ]
        for address in addresses:
            with pytest.raises(InputError, match=f"scheduler {address}: does not answer"):
                runner.run(batches.job(), tmp_path, quiet, scheduler=address)
            with pytest.raises(InputError, match="such as tcp://"):
                runner.check_scheduler(address)


@pytest.mark.second
def test_a_scheduler_with_two_workers_makes_the_same_store(unbroken, tmp_path):
    """Processes of their own, as on other machines; then one of them ends."""
    port = free_port()
    address = f"tcp://127.0.0.1:{port}"
    local = ["--host", "127.0.0.1", "--no-dashboard"]
    python = [sys.executable, "-W", "ignore", "-m"]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(HERE), *filter(None, sys.path)])}
    environment["DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES"] = "0"
    started = []

    def start(*command):
        started.append(
            subprocess.Popen(
                [*python, *command, *local], env=environment, cwd=tmp_path, stderr=subprocess.DEVNULL
            )
        )

    def answer(words):
        while True:
            try:
                return runner.check_scheduler(address)
            except InputError as error:
                if words in str(error):
                    return None
                assert not [process for process in started if process.poll() is not None]

    (tmp_path / "seen").mkdir()
    try:
        start("distributed.cli.dask_scheduler", "--port", str(port))
        answer("has no workers")
        for _ in range(2):
            start("distributed.cli.dask_worker", address, "--nthreads", "2", "--no-nanny")
        answer("never")
        made = runner.run(batches.job(seen=str(tmp_path / "seen")), tmp_path, quiet, scheduler=address)
        assert content(made.file) == content(unbroken.file)
        processes = {int(p.name.split("_")[1]) for p in (tmp_path / "seen").iterdir()}
        assert processes <= {process.pid for process in started[1:]}
        with pytest.raises(RunError, match=r"batch \d+ \(point .*\) was lost, as its worker"):
            runner.run(batches.job(400, dies=144), tmp_path, quiet, scheduler=address)
    finally:
        for process in started:
            process.send_signal(signal.SIGKILL)
            process.wait()


def test_texts_are_cut_between_characters():
    array = text_array(["", "Öl", "Öl und mehr"], 4)
    assert array.shape == (3, 4) and texts(array) == ["", "Öl", "Öl "]
    assert texts(text_array(["aaÖ"], 3)) == ["aa"]


@pytest.mark.parametrize(
    "wrong",
    [
        {"points": -1},
        {"batch": 0},
        {"digest": "0123"},
        {"digest": "../../0123456789"},
        {"name": "a/b"},
        {"variables": (ResultVariable("x", "m", "x"), ResultVariable("x", "m", "x"))},
        {"variables": (ResultVariable("x", "mm", "x"),)},
        {"variables": (ResultVariable("x", "m", "x", dims=("y",)),)},
    ],
)
def test_a_wrong_declaration_is_refused(wrong):
    good = {name: getattr(batches.job(), name) for name in Job.__dataclass_fields__}
    with pytest.raises(ValueError):
        Job(**{**good, **wrong})


def test_what_others_put_into_a_store_is_not_read(tmp_path, recwarn):
    """A damaged array, a file and a folder beside the arrays of the job; a pipe in place of a chunk is named."""
    made = runner.run(batches.job(), tmp_path, quiet, workers=1).file
    for name, text in (("extra/zarr.json", "{damaged"), ("old/.zarray", "{"), ("note.txt", "hello")):
        (made / name).parent.mkdir(exist_ok=True)
        (made / name).write_text(text)
    again = runner.run(batches.job(), tmp_path, quiet, workers=1)
    assert again.earlier_points == 100 and set(again.dataset.load()) == {
        v.name for v in batches.job().variables
    }
    assert not list(recwarn)
    if hasattr(os, "mkfifo"):
        for name in ("height/c/0", f"{CHECKS}/c/0", "zarr.json"):
            content = (made / name).read_bytes()
            (made / name).unlink()
            os.mkfifo(made / name)
            with pytest.raises(InputError, match=rf"{re.escape(name)}: is not a regular file"):
                runner.run(batches.job(), tmp_path, quiet, workers=1)
            (made / name).unlink()
            (made / name).write_bytes(content)
