"""The cache of compiled code never gives code of other sources, compiles the same once, and costs nothing else."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from chainunit import InputError, RunError
from chainunit.core.native import cache
from chainunit.core.native.cache import OFF, VARIABLE, entry
from chainunit.core.native.compilers import Compiler, compile_code
from chainunit.fmu.native import platforms
from chainunit.fmu.native.export import export
from chainunit.models import MODELS

pytestmark = pytest.mark.second

COUNTING = """#!/bin/sh
if [ "$1" != --version ]; then echo called >> "$(dirname "$0")/calls"; fi
exec {compiler} "$@"
"""
FILES = {"a.c": b'#include "a.h"\nint f(void) { return N; }\n', "a.h": b"#define N 1\n"}
ARGUMENTS = ("-O1", "-c", "a.c", "-o", "a.o")


@pytest.fixture
def store(tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(tmp_path / "named"))
    return tmp_path / "named" / "chainunit"


@pytest.fixture
def counting(tmp_path, store):
    """A compiler, and how often it was called so far."""
    if sys.platform == "win32" or shutil.which("cc") is None:
        pytest.skip("no compiler")
    real = tmp_path / "real cc"
    real.write_text(COUNTING.format(compiler=shutil.which("cc")))
    real.chmod(0o755)
    calls = tmp_path / "calls"
    return Compiler(
        (str(real),), zig=False
    ), lambda: len(calls.read_text().splitlines()) if calls.exists() else 0


def test_the_same_is_compiled_once_and_nothing_else(counting, monkeypatch):
    compiler, calls = counting
    first = compile_code(compiler, ARGUMENTS, FILES, "a.o")
    assert first and calls() == 1
    assert compile_code(compiler, ARGUMENTS, FILES, "a.o") == first and calls() == 1
    # a header, a flag, another file beside them, the name of a file
    assert (
        compile_code(compiler, ARGUMENTS, FILES | {"a.h": b"#define N 2\n"}, "a.o") != first and calls() == 2
    )
    compile_code(compiler, ("-DX", *ARGUMENTS), FILES, "a.o")
    compile_code(compiler, ARGUMENTS, FILES | {"b.h": b""}, "a.o")
    assert calls() == 4
    # another version of the compiler
    variant = Compiler(compiler.command, zig=False)
    with Path(compiler.command[0]).open("a") as file:
        file.write("\n")
    compile_code(variant, ARGUMENTS, FILES, "a.o")
    assert calls() == 5
    # where headers are looked for
    monkeypatch.setenv("CPATH", "/nowhere")
    compile_code(Compiler(compiler.command, zig=False), ARGUMENTS, FILES, "a.o")
    assert calls() == 6


def test_a_failure_is_not_entry(counting, store):
    compiler, calls = counting
    for n in (1, 2):
        with pytest.raises(RunError, match=r"the C compiler .*real cc failed: .*a\.c"):
            compile_code(compiler, ARGUMENTS, FILES | {"a.c": b"int f(void) { return g; }\n"}, "a.o")
        assert calls() == n
    assert not store.exists()


@pytest.mark.parametrize(
    "writes", ["echo junk > a.o", ": > a.o", "true"], ids=["another file", "an empty file", "no file"]
)
def test_a_compiler_that_writes_no_code_is_refused(store, tmp_path, monkeypatch, writes):
    """Its status is 0; what it wrote does not come into the cache."""
    if sys.platform == "win32":
        pytest.skip("a script of the shell")
    monkeypatch.chdir(tmp_path)  # it writes where it is asked for its version, too
    (tmp_path / "cc").write_text(f"#!/bin/sh\n{writes}\n")
    (tmp_path / "cc").chmod(0o755)
    with pytest.raises(RunError, match=r"cc ended without an error and wrote no code into a\.o; is it"):
        compile_code(Compiler((str(tmp_path / "cc"),), zig=False), ARGUMENTS, FILES, "a.o")
    assert not store.exists()


def test_a_second_export_compiles_nothing(counting, tmp_path, monkeypatch):
    """An FMU with other start values does not compile the kernels again, either."""
    compiler, calls = counting
    monkeypatch.setattr(platforms, "compiler", lambda: compiler)
    first, again, other = (tmp_path / f"{n}.fmu" for n in range(3))
    export(MODELS["DcMotor"], first)
    assert calls() == 2
    export(MODELS["DcMotor"], again)
    assert calls() == 2 and again.read_bytes() == first.read_bytes()
    export(MODELS["DcMotor"], other, {"rotor.J": 0.01})
    assert calls() == 3


@pytest.mark.parametrize("damage", [lambda b: b[:-1], lambda b: b"", lambda b: b[:40] + b"x" + b[41:]])
def test_a_damaged_entry_is_made_anew(store, damage):
    assert entry(b"key", lambda: b"code " * 10) == b"code " * 10
    (file,) = store.iterdir()
    good = file.read_bytes()
    file.write_bytes(damage(good))
    assert entry(b"key", lambda: b"code " * 10) == b"code " * 10 and file.read_bytes() == good
    assert entry(b"key", lambda: b"other") == b"code " * 10


def test_off_keeps_nothing(store, monkeypatch, tmp_path):
    monkeypatch.setenv(VARIABLE, OFF)
    calls = []
    for _ in range(2):
        assert entry(b"key", lambda: calls.append(1) or b"code") == b"code"
    assert len(calls) == 2 and cache.folder() is None and not store.exists()
    environment = os.environ | {VARIABLE: str(store.parent)}
    command = [sys.executable, "-m", "chainunit.app.cli", "--no-cache", "export", "DcMotor"]
    subprocess.run(command, cwd=tmp_path, env=environment, check=True, capture_output=True)
    assert (tmp_path / "DcMotor.fmu").exists() and not store.exists()


def test_a_folder_that_takes_nothing_costs_only_the_cache(store, monkeypatch, tmp_path):
    store.parent.mkdir()
    store.write_text("a file in its place")
    assert entry(b"key", lambda: b"code") == b"code"
    store.unlink()

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("pathlib.Path.write_bytes", full)
    assert entry(b"key", lambda: b"code") == b"code"
    monkeypatch.undo()
    assert list(store.iterdir()) == [], "nothing half-written"


def test_where_it_is(monkeypatch, tmp_path):
    monkeypatch.delenv(VARIABLE)
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache.folder() == tmp_path / "chainunit"
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert cache.folder() == tmp_path / ".cache" / "chainunit"
    monkeypatch.setattr(sys, "platform", "win32")
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path))
    assert cache.folder() == tmp_path / "chainunit"


def test_it_is_bounded_and_keeps_what_was_used_last(store, monkeypatch):
    monkeypatch.setattr(cache, "_MOST", 5 * (32 + 1000))
    for n in range(5):
        entry(b"%d" % n, lambda: bytes(1000))
        for k, file in enumerate(sorted(store.iterdir(), key=lambda f: f.stat().st_mtime)):
            os.utime(file, (1000.0 * n + k, 1000.0 * n + k))
    calls = []
    entry(b"0", lambda: calls.append(0) or b"")
    entry(b"5", lambda: bytes(1000))
    assert len(list(store.iterdir())) == 5 and not calls
    entry(b"0", lambda: calls.append(0) or b"")
    assert not calls
    entry(b"1", lambda: calls.append(1) or b"")
    assert calls == [1], "the one that was not used for longest"
    # what a killed process left, and what another one is at
    old, new = store / f"{'a' * 64}.1234.part", store / f"{'b' * 64}.1234.part"
    for file in (old, new):
        file.write_bytes(b"x")
    os.utime(old, (time.time() - 1e5,) * 2)
    entry(b"6", lambda: b"code")
    assert not old.exists() and new.exists()


def test_files_of_others_stay(store, monkeypatch):
    """A user may name a folder with other files: only entries of the cache count and are deleted."""
    monkeypatch.setattr(cache, "_MOST", 1000)
    store.mkdir(parents=True, mode=0o700)
    others = [folder / name for folder in (store, store.parent) for name in ("study.toml", "data.part", "x")]
    for file in others:
        file.write_bytes(bytes(2000))
        os.utime(file, (1.0, 1.0))
    for n in range(3):
        entry(b"%d" % n, lambda: bytes(500))
    assert all(file.exists() for file in others)
    assert len(list(store.iterdir())) == 3 + 1


@pytest.mark.parametrize("word", ["off", "OFF", "0", "no", "False"])
def test_words_that_switch_it_off(monkeypatch, word):
    monkeypatch.setenv(VARIABLE, word)
    assert cache.folder() is None


def test_many_at_once(store):
    results = []

    def make():
        time.sleep(0.01)
        return b"code" * 1000

    def one():
        results.extend(entry(b"%d" % n, make) for n in range(5))

    threads = [threading.Thread(target=one) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert results == [b"code" * 1000] * 40 and len(list(store.iterdir())) == 5


posix = pytest.mark.skipif(not hasattr(os, "geteuid"), reason="owners and rights of POSIX")


@posix
@pytest.mark.parametrize("mode", [0o775, 0o770, 0o707])
def test_an_own_folder_is_closed_to_others(mode, store):
    """A umask of 002 makes it open to the group. The code that was there meanwhile is not run."""
    entry(b"key", lambda: b"code")
    (file,) = store.iterdir()
    file.write_bytes(cache._mark(file.name, b"planted") + b"planted")
    (store / "notes.txt").write_text("of the user")
    store.chmod(mode)
    assert entry(b"key", lambda: b"made") == b"made" and store.stat().st_mode & 0o777 == 0o700
    assert entry(b"key", lambda: b"other") == b"made" and (store / "notes.txt").exists()


@posix
@pytest.mark.parametrize("kind", ["of another user", "stays open", "behind a link"])
def test_a_folder_in_which_others_can_put_code_is_refused(kind, store, tmp_path, monkeypatch):
    """Where the user named it; else it is not used, and nothing is written there."""
    entry(b"key", lambda: b"code")
    (file,) = store.iterdir()
    file.write_bytes(cache._mark(file.name, b"planted") + b"planted")
    if kind == "of another user":
        own = os.geteuid()
        monkeypatch.setattr("os.geteuid", lambda: own + 1)
    else:
        store.chmod(0o770)
    if kind == "stays open":

        def refused(*_):
            raise PermissionError(1, "Operation not permitted")

        monkeypatch.setattr("os.fchmod", refused)
    if kind == "behind a link":
        store.rename(tmp_path / "elsewhere")
        store.symlink_to(tmp_path / "elsewhere")
    words = "belongs to another user" if kind == "of another user" else "can be written by other users"
    with pytest.raises(
        InputError, match=f"CHAINUNIT_CACHE: its folder {store} {words}, so that .*; name a folder"
    ):
        entry(b"key", lambda: b"code")
    monkeypatch.delenv(VARIABLE)
    monkeypatch.setenv("XDG_CACHE_HOME", str(store.parent))
    assert cache.folder() == store or sys.platform == "darwin"
    assert entry(b"key", lambda: b"mine") == b"mine" and entry(b"other", lambda: b"mine") == b"mine"
    assert len(list(store.iterdir())) == 1


@posix
def test_a_planted_file_is_no_entry(store, tmp_path, monkeypatch):
    """A file that others can write, one of another user, a link, a pipe, and an entry of other sources."""
    entry(b"key", lambda: b"code")
    (file,) = store.iterdir()
    assert file.stat().st_mode & 0o777 == 0o600

    def is_made_anew():
        made = entry(b"key", lambda: b"code") == b"code"
        good = file.read_bytes() == cache._mark(file.name, b"code") + b"code"
        return made and good and file.stat().st_mode & 0o777 == 0o600 and not file.is_symlink()

    planted = cache._mark(file.name, b"planted") + b"planted"
    for mode in (0o620, 0o602):
        file.write_bytes(planted)
        file.chmod(mode)
        assert is_made_anew()
    elsewhere = tmp_path / "elsewhere"
    elsewhere.write_bytes(planted)
    file.unlink()
    file.symlink_to(elsewhere)
    assert is_made_anew() and elsewhere.read_bytes() == planted
    entry(b"other", lambda: b"of other sources")
    (other,) = set(store.iterdir()) - {file}
    shutil.copy(other, file)
    assert is_made_anew()
    file.unlink()
    os.mkfifo(file)
    assert entry(b"key", lambda: b"code") == b"code"


@posix
def test_entries_are_private_whatever_the_user_s_mask(store):
    """A group that may write the files of this user by default may not write the code."""
    before = os.umask(0o002)
    try:
        entry(b"key", lambda: b"code")
    finally:
        os.umask(before)
    assert entry(b"key", lambda: b"other") == b"code"
