"""The compiler that remembers never gives a library of other sources, and compiles the same ones once."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
pytestmark = pytest.mark.skipif(
    sys.platform != "linux" or shutil.which("cc") is None, reason="a compiler on Linux"
)
COUNTING = """#!/bin/sh
echo called >> "$(dirname "$0")/calls"
exec {compiler} "$@"
"""


@pytest.fixture
def compiled(tmp_path, plain_path):
    """Compile those files by those arguments; what was made, and how often the real compiler was called so far."""
    real = tmp_path / "real cc"
    real.write_text(COUNTING.format(compiler=shutil.which("cc", path=plain_path)))
    real.chmod(0o755)
    store, rounds = tmp_path / "store", iter(range(100))
    store.mkdir()

    def run(files, *arguments):
        work = tmp_path / f"work {next(rounds)}"
        work.mkdir()
        for name, text in files.items():
            (work / name).write_text(text)
        call = (
            "import cc, pathlib, sys; sys.exit(cc.main(pathlib.Path(sys.argv[1]), sys.argv[2], sys.argv[3:]))"
        )
        done = subprocess.run(
            [sys.executable, "-c", call, str(store), str(real), *arguments],
            cwd=work,
            env={"PYTHONPATH": str(HERE), "PATH": plain_path},
            capture_output=True,
        )
        made = work / "a.o"
        calls = len((tmp_path / "calls").read_text().splitlines())
        return done.returncode, made.read_bytes() if made.exists() else b"", calls

    return run


def test_the_same_is_compiled_once_and_nothing_else(compiled):
    files = {"a.c": '#include "a.h"\nint f(void) { return N; }\n', "a.h": "#define N 1\n"}
    status, first, calls = compiled(files, "-O1", "-c", "a.c", "-o", "a.o")
    assert status == 0 and first and calls == 1
    assert compiled(files, "-O1", "-c", "a.c", "-o", "a.o") == (0, first, 1)
    # a header, a flag, another file beside them
    status, other, calls = compiled(files | {"a.h": "#define N 2\n"}, "-O1", "-c", "a.c", "-o", "a.o")
    assert status == 0 and other != first and calls == 2
    assert compiled(files, "-O1", "-DX", "-c", "a.c", "-o", "a.o")[2] == 3
    assert compiled(files | {"b.h": ""}, "-O1", "-c", "a.c", "-o", "a.o")[2] == 4


def test_failures_and_commands_with_paths_are_not_remembered(compiled, tmp_path):
    for calls in (1, 2):
        assert compiled({"a.c": "int f(void) { return g; }\n"}, "-c", "a.c", "-o", "a.o") == (1, b"", calls)
    (tmp_path / "include").mkdir()
    header = tmp_path / "include" / "a.h"
    made = []
    for n in (1, 2):
        header.write_text(f"#define N {n}\n")
        files = {"a.c": '#include "a.h"\nint f(void) { return N; }\n'}
        status, library, _ = compiled(files, "-I", str(header.parent), "-c", "a.c", "-o", "a.o")
        assert status == 0
        made.append(library)
    assert made[0] != made[1]
