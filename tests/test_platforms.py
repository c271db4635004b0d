"""Native FMUs for other machines than this one, and which compiler makes them."""

from __future__ import annotations

import importlib.util
import re
import shutil
import struct
import subprocess
import sys
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from test_native import HERE, host_arguments, host_torque

from chainunit import InputError, RunError
from chainunit.core.native import compilers
from chainunit.core.native.compilers import Compiler
from chainunit.fmu.backends import export as export_any
from chainunit.fmu.native import platforms
from chainunit.fmu.native.export import export
from chainunit.fmu.native.platforms import PLATFORMS
from chainunit.models import MODELS

pytestmark = pytest.mark.slow

here = pytest.mark.skipif(platforms.host() != "linux64", reason="run on 64-bit Linux")
zig = pytest.mark.skipif(importlib.util.find_spec("ziglang") is None, reason="ziglang is not installed")

ZIG = [sys.executable, "-m", "ziglang", "cc"]
EXPORTED = {
    2: {"fmi2Instantiate", "fmi2DoStep", "fmi2GetDerivatives", "fmi2SerializeFMUstate", "fmi2GetString"},
    3: {"fmi3InstantiateCoSimulation", "fmi3DoStep", "fmi3GetClock", "fmi3GetAdjointDerivative"},
}


@here
def test_backends_say_what_they_took(tmp_path, monkeypatch):
    motor = MODELS["DcMotor"]
    origin = export_any(motor, tmp_path / "a.fmu")
    message = str(origin)
    assert origin.backend == "native" and "native code by" in message and "found here" in message
    origin = export_any(motor, tmp_path / "b.fmu", backend="python")
    assert origin.backend == "python" and "pythonfmu" in str(origin)
    with pytest.raises(InputError, match="platforms: need the native backend"):
        export_any(motor, tmp_path / "d.fmu", backend="python", platforms=["linux64"])
    with pytest.raises(InputError, match="must be 2 or 3"):
        export_any(motor, tmp_path / "d.fmu", fmi=1)
    with pytest.raises(InputError, match=r"platforms = beos: no such platform; there are linux64, win64"):
        export_any(motor, tmp_path / "d.fmu", platforms=["beos"])
    with pytest.raises(InputError, match=r"aarch64-linux: FMI 2\.0 has no folder for it; export with fmi 3"):
        export_any(motor, tmp_path / "d.fmu", platforms=["aarch64-linux"])
    # without zig the system's compiler serves this machine alone
    for module in (compilers, platforms):
        monkeypatch.setattr(module, "zig_compiler", lambda: None)
    assert "linux64 (run)" in str(export_any(motor, tmp_path / "a.fmu", platforms=["linux64"]))
    with pytest.raises(InputError, match=r"needs zig.*pip install 'chainunit\[cross\]'"):
        export_any(motor, tmp_path / "d.fmu", platforms=["linux64", "win64"])
    # without any
    monkeypatch.setattr(shutil, "which", lambda name: None)
    assert "no C compiler for this machine found" in str(export_any(motor, tmp_path / "c.fmu"))
    with pytest.raises(InputError, match="fmi 3 needs the native backend"):
        export_any(motor, tmp_path / "d.fmu", fmi=3)
    with pytest.raises(InputError, match="for this machine found: install one"):
        export_any(motor, tmp_path / "d.fmu", backend="native")
    # one that is there but does not work
    monkeypatch.undo()
    false = shutil.which("false")
    monkeypatch.setattr(platforms, "compiler", lambda: Compiler((false,), zig=False))
    assert "false failed" in str(export_any(motor, tmp_path / "e.fmu"))
    with pytest.raises(RunError, match=r"the C compiler .*false failed"):
        export_any(motor, tmp_path / "d.fmu", backend="native")
    assert {p.name for p in tmp_path.iterdir()} == {"a.fmu", "b.fmu", "c.fmu", "e.fmu"}


@zig
@here
def test_zig_serves_where_the_system_has_no_compiler(tmp_path, monkeypatch):
    monkeypatch.setattr(shutil, "which", lambda name: None)
    message = str(export_any(MODELS["DcMotor"], tmp_path / "a.fmu"))
    assert "native code by zig, the C compiler found here" in message
    end = fmpy.simulate_fmu(str(tmp_path / "a.fmu"), start_values={"w_ref": 50.0}, stop_time=0.05)[-1]
    assert end["w"] > 1.0


def needed_glibc(library: bytes) -> tuple[int, int]:
    return max(tuple(map(int, v)) for v in re.findall(rb"GLIBC_(\d+)\.(\d+)", library))


def slices(library: bytes) -> list[bytes]:
    magic, count = struct.unpack(">II", library[:8])
    assert magic == 0xCAFEBABE
    results = []
    for k in range(count):
        processor, _, at, size, align = struct.unpack(">IIIII", library[8 + 20 * k : 28 + 20 * k])
        assert at % (1 << align) == 0 and at + size <= len(library)
        assert struct.unpack("<I", library[at + 4 : at + 8])[0] == processor
        results.append(library[at : at + size])
    return results


def mach_commands(code: bytes) -> dict[int, bytes]:
    """Load commands of a Mach-O library by their number."""
    count = struct.unpack("<I", code[16:20])[0]
    at, result = 32, {}
    for _ in range(count):
        number, size = struct.unpack("<II", code[at : at + 8])
        result[number] = code[at : at + size]
        at += size
    return result


def oldest_mac(code: bytes) -> tuple[int, int]:
    build_version, version_min = 0x32, 0x24
    commands = mach_commands(code)
    if build_version in commands:
        packed = struct.unpack("<I", commands[build_version][12:16])[0]
    else:
        packed = struct.unpack("<I", commands[version_min][8:12])[0]
    return packed >> 16, packed >> 8 & 0xFF


@zig
@pytest.mark.parametrize("fmi", [2, 3])
def test_other_platforms_are_built_alike_each_time(fmi, tmp_path):
    """Linux and macOS: floors, functions shown, the same bytes again; what runs here runs."""
    names = [n for n, p in PLATFORMS.items() if fmi in p.folders and n != "win64"]
    file, again = (
        export(MODELS["ChamberForces"], tmp_path / f"{k}.fmu", fmi=fmi, platforms=names) for k in "ab"
    )
    assert file.read_bytes() == again.read_bytes()
    with zipfile.ZipFile(file) as archive:
        libraries = {
            n.split("/")[1]: archive.read(n) for n in archive.namelist() if n.startswith("binaries/")
        }
    reference = {
        2: {"linux64", "darwin64"},
        3: {"x86_64-linux", "aarch64-linux", "x86_64-darwin", "aarch64-darwin"},
    }
    assert set(libraries) == reference[fmi]
    for folder, library in libraries.items():
        assert len(library) < (600_000 if folder == "darwin64" else 300_000)
        for function in EXPORTED[fmi]:
            assert function.encode() + b"\0" in library, (folder, function)
        if "linux" in folder:
            assert needed_glibc(library) <= (2, 17)
    macs = (
        slices(libraries["darwin64"])
        if fmi == 2
        else [libraries["x86_64-darwin"], libraries["aarch64-darwin"]]
    )
    assert [oldest_mac(code) for code in macs] == [(10, 15), (11, 0)]
    assert 0x1D in mach_commands(macs[1])  # arm64 loads nothing without a signature
    if platforms.host() == "linux64":
        inputs = {"phi": 1.0, "w": 6.0}
        rows = [
            fmpy.simulate_fmu(str(f), start_values=inputs, stop_time=1e-3, output=["tau"])[-1]["tau"]
            for f in (file, export(MODELS["ChamberForces"], tmp_path / "c.fmu", fmi=fmi))
        ]
        assert rows[0] == pytest.approx(rows[1], rel=1e-12) and abs(rows[0]) > 1.0


def run_foreign(tmp_path, name, fmi, target, library_folder, runner):
    """An FMU of another machine in host.c built for it, run by `runner`."""
    file = export(MODELS["ChamberForces"], tmp_path / "a.fmu", fmi=fmi, platforms=[name])
    folder = fmpy.extract(str(file), unzipdir=str(tmp_path / "unpacked"))
    host = tmp_path / ("host.exe" if name == "win64" else "host")
    command = [*ZIG, "-target", target, "-O1", f"-DFMI={fmi}", str(HERE / "host.c"), "-o", str(host)]
    subprocess.run([*command, "-I", f"{folder}/sources"], check=True, capture_output=True)
    (library,) = Path(folder, "binaries", library_folder).iterdir()
    process = subprocess.run(
        [*runner, str(host), *host_arguments(folder, library)], capture_output=True, text=True
    )
    assert process.returncode == 0, process.stderr[-2000:]
    np.testing.assert_allclose([float(x) for x in process.stdout.split()], host_torque(), rtol=1e-12)


@zig
@pytest.mark.parametrize(("fmi", "folder"), [(2, "win64"), (3, "x86_64-windows")])
def test_windows_library_runs_under_wine(tmp_path, fmi, folder):
    wine = shutil.which("wine64") or shutil.which("wine64", path="/usr/lib/wine")
    if wine is None:
        pytest.skip("wine64 is not installed")
    run_foreign(tmp_path, "win64", fmi, "x86_64-windows-gnu", folder, [wine])


@zig
def test_arm_library_runs_under_qemu(tmp_path):
    qemu, root = shutil.which("qemu-aarch64"), Path("/usr/aarch64-linux-gnu")
    if qemu is None or not root.exists():
        pytest.skip("qemu-user and libc6-arm64-cross are not installed")
    runner = [qemu, "-L", str(root)]
    run_foreign(tmp_path, "aarch64-linux", 3, "aarch64-linux-gnu.2.17", "aarch64-linux", runner)
