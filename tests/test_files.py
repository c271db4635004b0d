"""Files appear whole or not at all; one process writes to a folder at a time; nothing stays behind."""

from __future__ import annotations

import hashlib
import os
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import pytest
from command import chainunit

from chainunit.core.errors import InputError, WriteError
from chainunit.core.files import LIST, LOCK, FileList, atomic_file, claim, clear, folder, scratch

pytestmark = pytest.mark.second

SHORT = """
event = []
[run]
ramp = 0.3
turns = 1
step = 0.004
crank_speed = 6
[machine]
ratio = 25
"""

posix = pytest.mark.skipif(sys.platform == "win32", reason="signals and limits of POSIX")


def python(script, cwd, **more):
    return subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(script)],
        cwd=cwd,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        **more,
    )


def names(folder):
    return sorted(p.name for p in folder.iterdir())


def test_two_writers_of_one_file_do_not_disturb_each_other(tmp_path):
    file = tmp_path / "a.txt"
    with atomic_file(file) as first:
        first.write_text("first")
        with atomic_file(file) as second:
            second.write_text("second")
        assert file.read_text() == "second"
    assert file.read_text() == "first"
    assert names(tmp_path) == ["a.txt"]


def test_a_user_s_files_in_the_folder_are_left_alone(tmp_path):
    for name in (".chainunit", "result.json.part"):
        (tmp_path / name).write_text("mine")
    folder(tmp_path)
    with claim(tmp_path):
        pass
    assert {p.name: p.read_text() for p in tmp_path.iterdir()} == {
        ".chainunit": "mine",
        "result.json.part": "mine",
    }


def test_one_process_at_a_time_and_the_lock_goes_with_it(tmp_path):
    holder = python(
        """
        import time
        from pathlib import Path
        from chainunit.core.files import claim
        with claim(Path("out")):
            print("has it", flush=True)
            time.sleep(600)
        """,
        tmp_path,
    )
    assert holder.stdout.readline() == "has it\n"
    with pytest.raises(InputError, match="another chainunit writes to this folder"):
        with claim(tmp_path / "out"):
            pass
    holder.kill()
    holder.communicate()
    with claim(tmp_path / "out"):
        assert (tmp_path / "out" / LOCK).exists()
    assert list((tmp_path / "out").iterdir()) == []


def test_a_second_study_in_a_folder_is_refused_and_takes_nothing_away(tmp_path):
    out = tmp_path / "out"
    with claim(out):
        (out / "result.json").write_text("of the first")
        second = subprocess.run(
            [sys.executable, "-m", "chainunit.app.cli", "study", "-o", "out"],
            cwd=tmp_path,
            capture_output=True,
            text=True,
        )
        assert second.returncode == 2
        assert second.stderr.startswith("chainunit: out: another chainunit writes to this folder")
        assert (out / "result.json").read_text() == "of the first"


def test_pngs_appear_whole(tmp_path):
    """A figure that fails to be drawn, or written, leaves what was there."""
    import matplotlib.pyplot as plt

    from chainunit.report.style import draw

    (tmp_path / "a.png").write_bytes(b"before")

    def broken():
        figure = plt.figure()

        def fails(out, **options):
            out.write_bytes(b"\x89PNG")
            raise OSError(28, "No space left on device")

        figure.savefig = fails
        return figure

    with pytest.raises(WriteError, match=r"a\.png: cannot be written \(No space left"):
        draw({"a.png": broken}, tmp_path)
    assert names(tmp_path) == ["a.png"] and (tmp_path / "a.png").read_bytes() == b"before"
    draw({"a.png": plt.figure}, tmp_path)
    assert (tmp_path / "a.png").read_bytes()[:4] == b"\x89PNG"


@posix
@pytest.mark.slow
def test_a_full_disk_is_named_and_costs_no_more_than_the_file(tmp_path):
    """No file may grow beyond 300 kB: the series and the page have no room, numbers and plots have."""
    (tmp_path / "short.toml").write_text(SHORT)
    command = python(
        """
        import resource, sys
        from chainunit.app.cli import main
        from chainunit.study import run

        study = run.run_study

        def then_full(*args, **options):
            done = study(*args, **options)
            resource.setrlimit(resource.RLIMIT_FSIZE, (300_000, resource.RLIM_INFINITY))
            return done

        run.run_study = then_full
        sys.argv = ["chainunit", "study", "short.toml", "-o", "out"]
        main()
        """,
        tmp_path,
    )
    message, errors = command.communicate()
    assert command.returncode == 1, errors
    assert "out/result.nc: cannot be written" in errors and "Traceback" not in errors
    there = names(tmp_path / "out")
    assert {"result.json", "load_cycle.csv", "machine.svg", "fmu"} <= set(there)
    assert not {n for n in there if "part" in n or n in ("result.nc", "report.html", LOCK)}
    assert "crank torque, peak" in message


@posix
def test_a_disk_that_is_full_from_the_start_is_named(tmp_path):
    command = python(
        """
        import resource, sys
        from chainunit.app.cli import main
        from chainunit.fmu import pack
        from chainunit.fmu.native import export
        written = export.pack

        def full(*args):
            resource.setrlimit(resource.RLIMIT_FSIZE, (1000, resource.RLIM_INFINITY))
            written(*args)

        export.pack = full
        sys.argv = ["chainunit", "export", "DcMotor", "-o", "out/x.fmu", "--backend", "native"]
        main()
        """,
        tmp_path,
    )
    _, errors = command.communicate()
    assert command.returncode == 1
    assert errors.splitlines()[-1].startswith("chainunit: out/x.fmu: cannot be written (File too large")
    assert list((tmp_path / "out").iterdir()) == []


@posix
@pytest.mark.slow
def test_sigterm_ends_in_order(tmp_path):
    """What was computed is written, and no folder for temporary files stays behind."""
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    (tmp_path / "long.toml").write_text(SHORT.replace("turns = 1", "turns = 300"))
    running = subprocess.Popen(
        [sys.executable, "-m", "chainunit.app.cli", "study", "long.toml", "-o", "out"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"TMPDIR": str(scratch)},
    )
    while len(list(scratch.glob("chainunit_fmu_*/binaries"))) < 2:
        assert running.poll() is None, running.communicate()
        time.sleep(0.05)
    time.sleep(0.5)
    running.send_signal(signal.SIGTERM)
    _, err = running.communicate(timeout=60)
    assert running.returncode == 143, err
    assert "Traceback" not in err
    assert list(scratch.glob("chainunit*")) == []
    assert (tmp_path / "out" / "result.json").exists() and not (tmp_path / "out" / LOCK).exists()


def test_the_command_leaves_the_signals_as_they_were(monkeypatch, capsys):
    from chainunit.app.cli import main

    before = signal.getsignal(signal.SIGTERM)
    monkeypatch.setattr(sys, "argv", ["chainunit", "--version"])
    with pytest.raises(SystemExit):
        main()
    assert signal.getsignal(signal.SIGTERM) is before
    capsys.readouterr()


@posix
@pytest.mark.parametrize(("sent", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
@pytest.mark.parametrize("command", ["study", "export"])
@pytest.mark.parametrize("at", ["chainunit.study.config.load", "chainunit.fmu.export.printed_model"])
def test_an_early_end_is_told_and_leaves_nothing(sent, status, command, at, tmp_path, monkeypatch, capsys):
    """While the file is read, and while an FMU is made, into folders that were not there."""
    from chainunit.app import cli

    (tmp_path / "mine.toml").write_text(SHORT)
    folder, where = tmp_path / "out", tmp_path / "mine.toml"
    words = {
        "study": [str(where), "-o", str(folder)],
        "export": ["DcMotor", "--config", str(where), "-o", str(tmp_path / "x.fmu")],
    }
    monkeypatch.setattr(at, lambda *_, **__: signal.raise_signal(sent))
    monkeypatch.setattr(sys, "argv", ["chainunit", command, *words[command], "--backend", "python"])
    with pytest.raises(SystemExit) as left:
        cli.main()
    assert left.value.code == status
    assert capsys.readouterr().err.endswith("chainunit: interrupted; nothing was written\n")
    assert list(tmp_path.iterdir()) == [where]


def test_a_folder_that_was_there_or_holds_a_file_stays(tmp_path):
    for name, there in (("old", True), ("full", False), ("new", False)):
        if there:
            (tmp_path / name).mkdir()
        with pytest.raises(KeyboardInterrupt), claim(tmp_path / name) as path:
            (path / "fmu").mkdir()
            if name == "full":
                (path / "result").touch()
            raise KeyboardInterrupt
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["fmu", "full", "old", "result"]


def write(folder, text, *names):
    with claim(folder, *names) as place:
        for name in names:
            with atomic_file(place / name) as part:
                part.write_text(text)


def test_a_file_that_no_run_wrote_is_never_overwritten(tmp_path):
    """Not where it was there before, nor where a user has changed it since, nor where it came in the meantime."""
    out = tmp_path / "out"
    out.mkdir()
    mine = out / "report.html"
    mine.write_text("mine")
    with pytest.raises(InputError, match=r"out/report\.html: would be lost, as chainunit did not write it"):
        write(out, "first", "comparison.json", "report.html")
    assert names(out) == ["report.html"] and mine.read_text() == "mine"
    mine.unlink()
    write(out, "first", "report.html", "comparison.json")
    write(out, "second", "report.html", "comparison.json")
    assert mine.read_text() == "second" and LIST in names(out)
    mine.write_text("mine again")
    (out / "notes.md").write_text("mine, too")
    with pytest.raises(InputError) as refusal:
        write(out, "third", "report.html", "comparison.json", "notes.md")
    assert [str(fault).split(":")[0] for fault in refusal.value.faults] == [str(mine), str(out / "notes.md")]
    mine.unlink()
    with claim(out) as place, pytest.raises(WriteError, match=r"notes\.md: stays as it is"):
        clear(place, "notes.md")
        with atomic_file(place / "notes.md") as part:
            part.write_text("third")
    assert (out / "notes.md").read_text() == "mine, too"


def test_the_list_of_files_is_that_of_sha256sum_and_goes_with_them(tmp_path):
    write(tmp_path / "out", "text", "b.csv", "a.png")
    lines = (tmp_path / "out" / LIST).read_text().splitlines()
    digest = hashlib.sha256(b"text").hexdigest()
    assert lines == [f"{digest}  a.png", f"{digest}  b.csv"]
    with claim(tmp_path / "out", "a.png", "b.csv") as place:
        clear(place, "a.png", "b.csv")
    assert names(tmp_path / "out") == []
    (tmp_path / "out" / LIST).write_text("a list of my own\n")
    with pytest.raises(InputError, match="is no list of files of chainunit"):
        write(tmp_path / "out", "text", "b.csv")


@posix
@pytest.mark.parametrize("moment", ["before", "after"])
def test_a_run_that_is_killed_while_it_replaces_a_file_leaves_its_own(moment, tmp_path):
    """The list has the old and the new content until the file has its name; the next run takes neither for a
    foreign file."""
    out = tmp_path / "out"
    write(out, "first", "a.txt", "b.txt")
    kill = "os.kill(os.getpid(), signal.SIGKILL)"
    renames = "real(part, file); " if moment == "after" else ""
    code = (
        "import os, signal; from pathlib import Path\n"
        "from chainunit.core.files import claim, atomic_file\n"
        "real = Path.replace\n"
        "def replace(part, file):\n"
        "    if file.name != 'a.txt': return real(part, file)\n"
        f"    {renames}{kill}\n"
        f"with claim(Path({str(out)!r}), 'a.txt') as place, atomic_file(place / 'a.txt') as part:\n"
        "    part.write_text('second'); Path.replace = replace\n"
    )
    killed = python(code, tmp_path)
    killed.communicate()
    assert killed.returncode == -signal.SIGKILL
    assert (out / "a.txt").read_text() == ("second" if moment == "after" else "first")
    write(out, "third", "a.txt", "b.txt")
    assert (out / "a.txt").read_text() == "third"
    lines = (out / LIST).read_text().splitlines()
    assert [line.split()[1] for line in lines] == ["a.txt", "b.txt"]
    (out / "a.txt").write_text("first")  # what the program wrote long ago is changed, too
    with pytest.raises(InputError, match=r"a\.txt: would be lost"):
        write(out, "fourth", "a.txt")


def test_a_command_leaves_a_foreign_page_alone(tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "report.html").write_text("mine")
    press = Path(__file__).parents[1] / "examples" / "linkages" / "slider_crank_press.toml"
    done = chainunit("linkage", press, "-o", "out", cwd=tmp_path)
    assert done.returncode == 2 and done.stderr.startswith("chainunit: out/report.html: would be lost")
    assert names(tmp_path / "out") == ["report.html"]


def test_what_a_killed_process_left_of_a_file_goes(tmp_path):
    part, mine = tmp_path / f"a.txt.{'0' * 16}.part", tmp_path / "a.txt.part"
    part.touch(), mine.touch()
    with claim(tmp_path):
        assert not part.exists()
    assert names(tmp_path) == ["a.txt.part"]


def test_a_pipe_or_a_link_in_place_of_the_list_of_files(tmp_path):
    """A pipe would be waited for, and a link may lead anywhere."""
    with claim(tmp_path), scratch() as elsewhere:
        pass
    assert not elsewhere.exists() and names(tmp_path) == []
    file = tmp_path / LIST
    (tmp_path / "other").write_text(f"{'0' * 64}  a.txt\n")
    file.symlink_to(tmp_path / "other")
    with pytest.raises(InputError, match="is no list of files of chainunit"):
        FileList(tmp_path)
    file.unlink()
    os.mkfifo(file)
    with pytest.raises(InputError, match="is no list of files of chainunit"):
        FileList(tmp_path)
