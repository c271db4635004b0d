"""Platforms of native FMUs, and the choice of a compiler for them.

Floors: glibc 2.17, by either compiler; macOS 10.15 on x86_64 and 11.0 on arm64.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ...core.errors import InputError, RunError, texts_in
from ...core.native.compilers import COMPILERS, Compiler, compile_code, compiler, host, zig_compiler
from ...core.printing.c_elementary import HEADER

_FLAGS = ("-std=c99", "-O2", "-fPIC", "-fvisibility=hidden", "-ffp-contract=off")
_SHARED = ("-shared", "-s")
KERNELS, _KERNELS_OBJECT, HEADERS = "kernels.c", "kernels.o", ("model.h", HEADER)


def units_of(fmi: int) -> tuple[str, ...]:
    """The names of the sources that are compiled, for that version of FMI; they include the others."""
    return KERNELS, "model.c", f"fmi{fmi}.c"


@dataclass(frozen=True)
class Platform:
    """One platform: the suffix of its libraries, and for each FMI version the folders of `binaries` with the zig
    targets of the library in it; several targets make one fat library. `tests` tells how far its binaries are tested;
    `link_options` are further options of the linker."""

    suffix: str
    folders: Mapping[int, Mapping[str, tuple[str, ...]]]
    tests: str
    link_options: tuple[str, ...] = ("-lm",)


_LINUX, _ARM_LINUX = "x86_64-linux-gnu.2.17", "aarch64-linux-gnu.2.17"
_MAC, _ARM_MAC, _WINDOWS = "x86_64-macos.10.15", "aarch64-macos.11.0", "x86_64-windows-gnu"
PLATFORMS: dict[str, Platform] = {
    "linux64": Platform(".so", {2: {"linux64": (_LINUX,)}, 3: {"x86_64-linux": (_LINUX,)}}, "run"),
    "win64": Platform(
        ".dll", {2: {"win64": (_WINDOWS,)}, 3: {"x86_64-windows": (_WINDOWS,)}}, "run under Wine", ()
    ),
    "darwin64": Platform(
        ".dylib",
        {2: {"darwin64": (_MAC, _ARM_MAC)}, 3: {"x86_64-darwin": (_MAC,), "aarch64-darwin": (_ARM_MAC,)}},
        "built, not run",
    ),
    "aarch64-linux": Platform(".so", {3: {"aarch64-linux": (_ARM_LINUX,)}}, "run under QEMU"),
}
"""Platforms by their names for ``--platforms``. FMI 2.0 has no folder for Linux on ARM."""


def compiles(fmi: int) -> bool:
    """Whether there is a compiler for this machine, and a folder for it in that version of FMI."""
    return compiler() is not None and fmi in PLATFORMS[host() or "linux64"].folders


def choose(names: Sequence[str], fmi: int) -> tuple[tuple[str, ...], Compiler]:
    """The platforms and a compiler for them; without names, the platform of this machine.

    Raises
    ------
    InputError
        for an unknown platform, a platform without folder in the FMI version, or one without compiler.
    """
    names = texts_in("platforms", names)
    for name in names:
        if name not in PLATFORMS:
            raise InputError(f"platforms = {name}: no such platform; there are {', '.join(PLATFORMS)}")
        if fmi not in PLATFORMS[name].folders:
            raise InputError(f"platforms = {name}: FMI {fmi}.0 has no folder for it; export with fmi 3")
    local_platform = host()
    if not names:
        local_compiler = compiler()
        if local_platform is None or local_compiler is None:
            raise InputError(
                f"no C compiler ({COMPILERS}) for this machine found: install one, or export with backend python"
            )
        if fmi not in PLATFORMS[local_platform].folders:
            raise InputError(
                f"FMI {fmi}.0 has no folder for {local_platform}; export with fmi 3 or backend python"
            )
        return (local_platform,), local_compiler
    # zig comes first, for its old system libraries; the system's compiler knows only this machine
    chosen_compiler = zig_compiler() or (compiler() if set(names) == {local_platform} else None)
    if chosen_compiler is None:
        raise InputError(
            f"platforms = {', '.join(names)}: needs zig, a C compiler for all of them: pip install 'chainunit[cross]'"
        )
    return tuple(dict.fromkeys(names)), chosen_compiler


def build(
    compiler: Compiler,
    name: str,
    fmi: int,
    identifier: str,
    sources: Mapping[str, bytes],
    units: Sequence[str],
) -> dict[str, bytes]:
    """Libraries of one platform, by their path inside the FMU.

    Parameters
    ----------
    compiler : see `choose`
    name, fmi : platform and version of FMI
    identifier : model identifier, the library's name
    sources : files by name
    units : names of the files to compile

    Raises
    ------
    RunError
        if the compiler fails, with its messages.
    """
    target_platform = PLATFORMS[name]
    libraries = {}
    for folder, targets in target_platform.folders[fmi].items():
        slices = [
            _compile(compiler, target, target_platform, identifier, sources, units) for target in targets
        ]
        library = slices[0] if len(slices) == 1 else fat(slices)
        libraries[f"binaries/{folder}/{identifier}{target_platform.suffix}"] = library
    return libraries


def build_here(compiler: Compiler, fmi: int, identifier: str, sources: Mapping[str, bytes]) -> bytes:
    """The library for this machine from the sources of an FMU. `compiler` is that for this machine, the other
    arguments are as for `build`.

    Raises
    ------
    RunError
        if the compiler fails, with its messages.
    """
    name = host() or "linux64"
    # a library is the same in each folder; of macOS the one of FMI 2.0 has all processors
    version = 2 if 2 in PLATFORMS[name].folders else 3
    (library,) = build(compiler, name, version, identifier, sources, units_of(fmi)).values()
    return library


def _compile(
    compiler: Compiler,
    target: str,
    target_platform: Platform,
    identifier: str,
    sources: Mapping[str, bytes],
    units: Sequence[str],
) -> bytes:
    """The library for a target. The kernels are compiled apart: they take almost all of the time, and are the same
    for any start values."""
    options = ("-target", target) if compiler.zig else ("-Wl,--build-id=none", "-DCHAINUNIT_OLD_GLIBC")
    flags = (*options, *_FLAGS)
    kernels = {name: sources[name] for name in (KERNELS, *HEADERS)}
    object_code = compile_code(
        compiler, (*flags, "-c", KERNELS, "-o", _KERNELS_OBJECT), kernels, _KERNELS_OBJECT
    )
    rest = {name: text for name, text in sources.items() if name != KERNELS}
    library = identifier + target_platform.suffix
    arguments = (*flags, *(name for name in units if name != KERNELS), _KERNELS_OBJECT, "-o", library)
    link = (*_SHARED, *target_platform.link_options)
    return compile_code(compiler, (*arguments, *link), rest | {_KERNELS_OBJECT: object_code}, library)


def fat(slices: Sequence[bytes]) -> bytes:
    """One Mach-O file for several processors, each slice on a page of its own (Apple's `fat_header`)."""
    page = 14  # 16 KiB, the page of arm64
    head = struct.pack(">II", 0xCAFEBABE, len(slices))
    offset = 8 + 20 * len(slices)
    body = b""
    for code in slices:
        magic, processor, subtype = struct.unpack("<III", code[:12])
        if magic != 0xFEEDFACF:
            raise RunError("the C compiler made no 64-bit Mach-O library for macOS")
        padding = -(offset + len(body)) % (1 << page)
        body += bytes(padding)
        head += struct.pack(">IIIII", processor, subtype, offset + len(body), len(code), page)
        body += code
    return head + body
