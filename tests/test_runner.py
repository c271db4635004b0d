"""Long work in batches: whatever ends a run, the next one goes on, and at the end the store has the same bytes."""

from __future__ import annotations

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
from chainunit.core.files import claim
from chainunit.work import runner
from chainunit.work.job import CHECKS, BatchStore, ResultVariable

HERE = Path(__file__).parent


def quiet(*said):
    pass


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
    np.testing.assert_array_equal(dataset["torque"], wanted["torque"].astype("float32"))
    assert dataset["colour"].dtype == np.int8 and list(dataset["colour"].values[:4]) == [0, 1, 2, 0]
    assert dataset["remark"].values.tolist() == wanted["remark"]
    assert dataset["torque"].attrs == {"units": "N.m", "long_name": "torque at a point"}
    assert dataset["colour"].attrs["flag_meanings"] == "red green blue"
    assert list(dataset["colour"].attrs["flag_values"]) == [0, 1, 2]
    # the store is a file of NetCDF to any reader
    other = xr.open_dataset(unbroken.file)
    xr.testing.assert_identical(other[list(wanted)].drop_attrs(), dataset.drop_attrs())


def test_local_processes_need_no_dask(tmp_path):
    made = subprocess.run(
        [sys.executable, HERE / "batches.py", tmp_path, "8", "2"], capture_output=True, text=True, check=True
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


def test_progress_is_told(tmp_path):
    said = []
    runner.run(batches.job(40), tmp_path, lambda *each: said.append(each), 1)
    assert said[0] == ("points of a demo", 0, 40)
    assert [done for _, done, _ in said[1:]] == [0, 16, 32, 40]


@pytest.mark.second
def test_local_processes_make_the_same_store(unbroken, tmp_path):
    (tmp_path / "seen").mkdir()
    made = runner.run(batches.job(seen=str(tmp_path / "seen")), tmp_path, quiet, workers=2)
    assert made.file.read_bytes() == unbroken.file.read_bytes()
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
    store = killed / batches.job().store_name
    while batches.finished(store) < 8:
        assert first.poll() is None
        time.sleep(0.01)
    first.kill()
    first.wait()
    assert batches.finished(store) < 100
    (tmp_path / "seen").mkdir()
    again = runner.run(batches.job(400, 4, seen=str(tmp_path / "seen")), killed, quiet, workers=1)
    assert again.earlier_points >= 32 and again.damaged_batches == 0
    assert len(seen(tmp_path / "seen")) == (400 - again.earlier_points) // 4
    assert (
        again.file.read_bytes() == runner.run(batches.job(400, 4), whole, quiet, workers=1).file.read_bytes()
    )


class Killed(BaseException):
    """The process ended here."""


@pytest.mark.parametrize("before", [True, False])
def test_a_kill_at_any_write(before, tmp_path, monkeypatch):
    """Before or after each variable that a run of three batches writes."""
    put, job = BatchStore._put, batches.job(40)
    wanted = runner.run(job, tmp_path / "whole", quiet, workers=1).file.read_bytes()
    for last in range(3 * (len(batches.VARIABLES) + 1)):
        count, folder = iter(range(1000)), tmp_path / str(last)

        def dies(self, *values, count=count, last=last):
            ends = next(count) == last
            if not (ends and before):
                put(self, *values)
            if ends:
                raise Killed

        monkeypatch.setattr(BatchStore, "_put", dies)
        with pytest.raises(Killed):
            runner.run(job, folder, quiet, workers=1)
        monkeypatch.setattr(BatchStore, "_put", put)
        again = runner.run(job, folder, quiet, workers=1)
        assert again.file.read_bytes() == wanted and again.damaged_batches == 0


def test_a_kill_while_the_file_is_made_leaves_nothing(tmp_path, monkeypatch):
    def dies(self, file):
        part = Path(file.filepath())
        shutil.copy(part, part.with_name(re.sub(r"[0-9a-f]{16}", "0123456789abcdef", part.name)))
        raise Killed

    monkeypatch.setattr(BatchStore, "_declare", dies)
    with pytest.raises(Killed):
        runner.run(batches.job(), tmp_path, quiet, workers=1)
    monkeypatch.undo()
    assert len(list(tmp_path.iterdir())) == 1
    with claim(tmp_path):
        made = runner.run(batches.job(), tmp_path, quiet, workers=1)
    assert list(tmp_path.iterdir()) == [made.file]


def changed(file, change):
    file.write_bytes(change(file.read_bytes()))


def anew(file):
    file.unlink()


ALL = list(range(7))
DAMAGES = {
    "a number is another": (lambda s: batches.damage(s, "height", 16), [1]),
    "a letter is another": (lambda s: batches.damage(s, "remark", 96), [6]),
    "a torque is another": (lambda s: batches.damage(s, "torque", 47), [2]),
    "a checksum is another": (lambda s: batches.damage(s, CHECKS, 5), [5]),
    "two batches": (lambda s: [batches.damage(s, "height", 16), batches.damage(s, "colour", 63)], [1, 3]),
    "a checksum is missing": (lambda s: batches.damage(s, CHECKS, 5, 0), [5]),
    "the checksums are cut off": (lambda s: changed(s, lambda b: b[:-12]), [4, 5, 6]),
    "the file is cut off": (lambda s: changed(s, lambda b: b[: len(b) // 2]), ALL),
    "the file has a head alone": (lambda s: changed(s, lambda b: b[:200]), ALL),
    "the declaration is another": (lambda s: changed(s, lambda b: b.replace(LAYOUT, b"0" * 64)), ALL),
    "no store of ours": (lambda s: s.write_text("hello"), ALL),
    "an empty file": (lambda s: s.write_bytes(b""), ALL),
    "no file": (anew, ALL),
}
LAYOUT = batches.job().layout.encode()
UNNOTICED = [name for name, (_, gaps) in DAMAGES.items() if gaps == ALL] + [
    "a checksum is missing",
    "the checksums are cut off",
]
"""Batches without a checksum are missing, and not damaged."""


@pytest.mark.parametrize("damage", DAMAGES)
def test_damage_is_noticed_and_made_anew(damage, unbroken, tmp_path):
    """Only the damaged batches are made again."""
    store = Path(shutil.copy(unbroken.file, tmp_path))
    spoil, gaps = DAMAGES[damage]
    spoil(store)
    assert not store.exists() or store.read_bytes() != unbroken.file.read_bytes()
    (tmp_path / "seen").mkdir()
    again = runner.run(batches.job(seen=str(tmp_path / "seen")), tmp_path, quiet, workers=1)
    assert store.read_bytes() == unbroken.file.read_bytes()
    assert seen(tmp_path / "seen") == [16 * batch for batch in gaps]
    assert again.damaged_batches == (0 if damage in UNNOTICED else len(gaps))
    assert again.earlier_points == 100 - sum(4 if batch == 6 else 16 for batch in gaps)


def test_a_store_grows_and_never_shrinks(unbroken, tmp_path):
    """With another number of points; its last batch was incomplete."""
    (tmp_path / "seen").mkdir()
    small = runner.run(batches.job(40), tmp_path, quiet, workers=1)
    grown = runner.run(batches.job(100, seen=str(tmp_path / "seen")), tmp_path, quiet, workers=1)
    assert (grown.earlier_points, grown.damaged_batches) == (32, 0)
    assert seen(tmp_path / "seen") == [32, 48, 64, 80, 96] and small.file == grown.file
    assert grown.file.read_bytes() == unbroken.file.read_bytes()
    few = runner.run(batches.job(40, fails=32), tmp_path, quiet, workers=1)
    assert few.earlier_points == 40 and few.dataset.sizes["point"] == 40
    np.testing.assert_array_equal(few.dataset["height"], batches.results(0, 40)["height"])
    assert grown.file.read_bytes() == unbroken.file.read_bytes()


def test_results_of_another_digest_or_declaration_are_not_mixed_in(unbroken, tmp_path):
    other = runner.run(batches.job(digest="fedcba9876543210"), tmp_path, quiet, workers=1)
    assert other.file.name != unbroken.file.name and other.earlier_points == 0
    # the same name, other batches: nothing of it counts
    shutil.copy(unbroken.file, tmp_path)
    again = runner.run(batches.job(batch=20), tmp_path, quiet, workers=1)
    assert again.earlier_points == 0
    np.testing.assert_array_equal(again.dataset["height"], batches.results(0, 100)["height"])


@pytest.mark.second
@pytest.mark.parametrize(
    ("workers", "wrong", "words"),
    [
        (1, {"fails": 32}, r"batch 2 \(point 32 to 47\) failed: ValueError\('no such point'\)"),
        (2, {"fails": 32, "slow": [48], "seconds": 60}, r"batch 2 \(point 32 to 47\) failed: ValueError"),
        (
            2,
            {"dies": 32, "slow": [48], "seconds": 60},
            r"batch [23] \(point .*\) was lost, as a worker ended",
        ),
    ],
)
def test_a_batch_that_fails_is_named_and_the_others_are_kept(workers, wrong, words, unbroken, tmp_path):
    # the others are written before it goes wrong, and 48 is in work, perhaps on the worker that ends
    marks = str(tmp_path / batches.job().store_name)
    with pytest.raises(RunError, match=words):
        runner.run(batches.job(**wrong, waits=32, marks=marks), tmp_path, quiet, workers=workers)
    assert not multiprocessing.active_children()
    (tmp_path / "seen").mkdir()
    again = runner.run(batches.job(seen=str(tmp_path / "seen")), tmp_path, quiet, workers=1)
    assert again.earlier_points == 32 and again.file.read_bytes() == unbroken.file.read_bytes()
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


@pytest.mark.second
def test_few_batches_are_in_work(tmp_path):
    """The memory holds a batch for each worker, and the one that is being written: the other worker waits for it."""
    (tmp_path / "seen").mkdir()

    def counted(title, done, todo):
        assert len(seen(tmp_path / "seen")) <= done // 8 + 3

    runner.run(batches.job(400, 8, seen=str(tmp_path / "seen")), tmp_path, counted, workers=2)


def free_port():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        return taken.getsockname()[1]


def test_a_scheduler_without_dask_is_refused_with_a_remedy(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"a scheduler needs Dask: pip install 'chainunit\[cluster\]'"):
        runner.check_scheduler("tcp://127.0.0.1:8786")


@pytest.mark.second
def test_a_scheduler_that_does_not_answer_is_refused(tmp_path, monkeypatch):
    pytest.importorskip("distributed")
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


@pytest.mark.slow
def test_a_scheduler_with_two_workers_makes_the_same_store(unbroken, tmp_path):
    """Processes of their own, as on other machines; then one of them ends."""
    pytest.importorskip("distributed")
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
        assert made.file.read_bytes() == unbroken.file.read_bytes()
        processes = {int(p.name.split("_")[1]) for p in (tmp_path / "seen").iterdir()}
        assert processes <= {process.pid for process in started[1:]}
        with pytest.raises(RunError, match=r"batch \d+ \(point .*\) was lost, as a worker ended"):
            runner.run(batches.job(400, dies=144), tmp_path, quiet, scheduler=address)
    finally:
        for process in started:
            process.send_signal(signal.SIGKILL)
            process.wait()


def test_texts_are_cut_between_characters():
    def stored(letters, *texts):
        return [
            b"".join(row).decode() for row in ResultVariable("x", "1", "x", letters=letters).stored(texts)
        ]

    assert stored(4, "", "Öl", "Öl und mehr") == ["", "Öl", "Öl "] and stored(3, "aaÖ") == ["aa"]


def test_a_store_that_is_no_file_is_refused(tmp_path):
    store = tmp_path / batches.job().store_name
    store.mkdir()
    with pytest.raises(InputError, match=r"demo_0123456789ab.nc: is not a regular file; remove it"):
        runner.run(batches.job(), tmp_path, quiet, workers=1)
    if hasattr(os, "mkfifo"):
        store.rmdir()
        os.mkfifo(store)
        with pytest.raises(InputError, match=r"demo_0123456789ab.nc: is not a regular file; remove it"):
            runner.run(batches.job(), tmp_path, quiet, workers=1)
