"""A C compiler that remembers, for the tests: the same command on the same files is compiled once.

It stands before the system's compilers in PATH (see conftest.py), so that exports in tests, in other workers and
in processes that tests start share what one of them compiled. A result is kept under a hash of the compiler, the
whole command and every file in the folder that it is called in; commands that name a path, and so may read other
files, go to the compiler as they are.
"""

from __future__ import annotations

import fcntl
import hashlib
import os
import shutil
import subprocess
import sys
from pathlib import Path


def main(store: Path, compiler: str, arguments: list[str]) -> int:
    """Run `compiler`, or give what it gave before; its exit status."""
    command = [compiler, *arguments]
    if "-o" not in arguments or any("/" in a for a in arguments):
        os.execv(compiler, command)
    made = Path(arguments[arguments.index("-o") + 1])
    real = Path(compiler).resolve().stat()
    digest = hashlib.sha256(repr((command, real.st_ino, real.st_size, real.st_mtime_ns)).encode())
    for file in sorted(Path().iterdir()):
        digest.update(f"{file.name} {file.stat().st_size} ".encode() + file.read_bytes())
    kept = store / digest.hexdigest()
    with kept.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # another process may be at it
        if kept.exists():
            made.write_bytes(kept.read_bytes())
            return 0
        done = subprocess.run(command, stderr=subprocess.PIPE)
        sys.stderr.buffer.write(done.stderr)
        if done.returncode == 0 and not done.stderr:
            part = kept.with_suffix(".part")
            part.write_bytes(made.read_bytes())
            part.rename(kept)
        return done.returncode


def install(store: Path) -> None:
    """Put this before the system's compilers in the PATH of this process and of those that it starts."""
    found = {name: path for name in ("cc", "gcc", "clang") if (path := shutil.which(name))}
    for name, path in found.items():
        shim = store / name
        call = f"import sys\nsys.path.insert(0, {str(Path(__file__).parent)!r})\nfrom pathlib import Path\n"
        call += f"import cc\nsys.exit(cc.main(Path({str(store)!r}), {path!r}, sys.argv[1:]))\n"
        shim.write_text(f"#!{sys.executable} -ISB\n{call}")
        shim.chmod(0o755)
    os.environ["PATH"] = f"{store}{os.pathsep}{os.environ['PATH']}"
