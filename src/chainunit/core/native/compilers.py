"""C compilers of this machine.

The system's own compiler makes code for this machine. The ``ziglang`` wheel (extra `cross`) makes code for
every platform.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

from ..errors import RunError
from ..files import scratch
from ..inputs import regular_bytes
from .cache import entry

_CODE = (
    b"\x7fELF", b"MZ", b"\x64\x86", b"\x4c\x01", b"\xcf\xfa\xed\xfe", b"\xca\xfe\xba\xbe",
)  # fmt: skip
"""First bytes of libraries and objects: ELF, Windows (library, objects), macOS (one processor, more)."""
COMPILERS = "cc, gcc, clang, or zig by pip install 'chainunit[cross]'"
"""The compilers that serve, and how to have one, for refusals."""


@dataclass(frozen=True)
class Compiler:
    """A C compiler: its command, and whether it is zig's, which takes a target."""

    command: tuple[str, ...]
    zig: bool

    @property
    def name(self) -> str:
        """The name in messages."""
        return "zig" if self.zig else self.command[0]

    @cached_property
    def identity(self) -> tuple[Any, ...]:
        """Data that differ for another compiler or another version: the command, size and time of its file, its
        version text, and the variables that lead it to other headers and libraries."""
        file = Path(self.command[0]).resolve().stat()
        version = subprocess.run([*self.command, "--version"], capture_output=True, text=True).stdout
        paths = [os.environ.get(name) for name in ("CPATH", "C_INCLUDE_PATH", "LIBRARY_PATH")]
        return self.command, file.st_size, file.st_mtime_ns, version, paths


def host() -> str | None:
    """This machine's platform, if it is among `PLATFORMS`."""
    machine = {"AMD64": "x86_64", "arm64": "aarch64"}.get(platform.machine(), platform.machine())
    return {
        ("linux", "x86_64"): "linux64",
        ("linux", "aarch64"): "aarch64-linux",
        ("win32", "x86_64"): "win64",
        ("darwin", "x86_64"): "darwin64",
        ("darwin", "aarch64"): "darwin64",
    }.get((sys.platform, machine))


def compiler() -> Compiler | None:
    """The compiler for this machine: the system's, else zig's."""
    if host() is None:
        return None
    # other platforms have their own format of libraries, which zig knows
    if sys.platform == "linux":
        for name in ("cc", "gcc", "clang"):
            if path := shutil.which(name):
                return Compiler((path,), zig=False)
    return zig_compiler()


def zig_compiler() -> Compiler | None:
    """The compiler of the ``ziglang`` wheel."""
    if importlib.util.find_spec("ziglang") is None:
        return None
    return Compiler((sys.executable, "-m", "ziglang", "cc"), zig=True)


def compile_code(
    compiler: Compiler, arguments: Sequence[str], files: Mapping[str, bytes], product: str
) -> bytes:
    """The file `product` that the compiler makes with `arguments` from these `files` (contents by name), or the
    cached one, see `chainunit.core.native.cache`.

    Raises
    ------
    RunError
        if the compiler fails, with its messages, or makes no code.
    """

    def make() -> bytes:
        """The code, compiled in a folder of its own."""
        with scratch() as work:
            for name, content in files.items():
                (work / name).write_bytes(content)
            process = subprocess.run(
                [*compiler.command, *arguments],
                cwd=work,
                env=os.environ | {"TMPDIR": str(work)},  # a killed compiler leaves its own files there
                capture_output=True,
                text=True,
            )
            if process.returncode:
                raise RunError(f"the C compiler {compiler.name} failed: {process.stderr.strip()}")
            code = regular_bytes(work / product) or b""
            if not code.startswith(_CODE):
                raise RunError(
                    f"the C compiler {compiler.name} ended without an error and wrote no code into {product}; "
                    "is it a C compiler?"
                )
            return code

    key = hashlib.sha256(repr((compiler.identity, list(arguments), product)).encode())
    for name, content in sorted(files.items()):
        key.update(f"{name} {len(content)} ".encode() + content)
    return entry(key.digest(), make)


class ProcessorFlags(NamedTuple):
    """Flags for fast code that runs on this machine alone, the libraries that they need, and files that are part of
    the code's name in the cache: the properties of this processor."""

    flags: tuple[str, ...]
    libraries: tuple[str, ...]
    files: dict[str, bytes]


def flags_for_this_processor(compiler: Compiler) -> ProcessorFlags:
    """The flags for the processor of this machine.

    The code has vectors and may contract products and sums; it does not reorder sums, and NaN and infinity keep their
    meaning.
    """
    flags: tuple[str, ...] = ("-std=gnu11", "-O2", "-march=native", "-fPIC", "-shared", "-w")
    flags += ("-fno-math-errno", "-fno-trapping-math", "-ffp-contract=fast", "-fno-semantic-interposition")
    macros = subprocess.run(
        [*compiler.command, "-march=native", "-dM", "-E", "-x", "c", os.devnull], capture_output=True
    ).stdout
    libc, version = platform.libc_ver()
    if compiler.zig or libc != "glibc" or host() != "linux64":
        return ProcessorFlags(flags, ("-lm",), {"processor.txt": macros})
    number = "".join(part.zfill(2) if k else part for k, part in enumerate(version.split(".")[:2]))
    # schedules a long body for its many values; GCC for this processor would not
    flags += ("-fschedule-insns", "-fsched-pressure")
    flags += (f"-DVECTOR_LIBRARY={number}",)
    return ProcessorFlags(flags, ("-lmvec", "-lm"), {"processor.txt": macros})
