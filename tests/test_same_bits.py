"""The same bits on every platform: one digest of a run of a compiled drive, in native code of several compilers and
machines, and in JavaScript."""

from __future__ import annotations

import importlib.util
import shutil
import struct
import subprocess
import sys
import tempfile
from functools import cache
from pathlib import Path

import fmpy
import numpy as np
import pytest
from javascript_hosts import in_node, node

from chainunit.core.native.compilers import compiler, host
from chainunit.fmu.native.export import export
from chainunit.models import MODELS
from chainunit.study.choice import drive_of
from chainunit.study.config import parse
from chainunit.system import ModelComponent, compiled

HERE = Path(__file__).parent
GALLERY = HERE.parent / "examples" / "linkages"
ZIG = [sys.executable, "-m", "ziglang", "cc"]
STEP, STEPS, WHOLE = 1e-3, 500, 2000
"""Communication step [s], steps of a piece with the same inputs, and pieces of the whole run: 1e6 steps."""
here = pytest.mark.skipif(host() != "linux64", reason="run on 64-bit Linux")
zig = pytest.mark.skipif(importlib.util.find_spec("ziglang") is None, reason="ziglang is not installed")
SYSTEMS = {
    # study file of a compiled drive, or a model; by input its lowest and highest value
    "chain_unit": (
        "",
        {
            "motor.w_ref": (60.0, 180.0),
            "machine.left.processing_force": (0.0, 900.0),
            "machine.right.material_mass": (0.0, 60.0),
        },
    ),
    "stephenson_six_bar": (
        f'[system]\nmachine = "{GALLERY}/stephenson_six_bar.toml"\n',
        {"motor.w_ref": (2.0, 8.0), "machine.resistance": (0.0, 200.0)},
    ),
    "equal steps": (
        MODELS["InductionMotor"],
        {"w_ref": (20.0, 150.0), "load.tau_bias": (-5.0, 20.0)},
    ),
}


class Job:
    """A run of a model, with inputs that jump at the begin of each piece."""

    def __init__(self, name, folder, pieces):
        what, self.bounds = SYSTEMS[name]
        drive = isinstance(what, str)
        self.whole = (
            compiled(drive_of(parse(what)).graph) if drive else ModelComponent(what, what.Parameters())
        )
        self.model, self.folder, self.pieces = self.whole.model, folder, pieces
        self.every = max(1, pieces // 10)
        low, high = np.transpose(list(self.bounds.values()))
        self.given = np.random.default_rng(9).uniform(low, high, (pieces, len(low)))
        outputs = (v for part in self.model.parts for v in part.layout.variables)
        # an output that repeats another one, as the place of a pin of two links, is that one in an FMU
        own = [v.name for v in outputs if v.type == "Real" and v.name not in self.model.repeated]
        self.results = [*self.model.state_layout.names, *own]

    def native(self, platform="", target="", runner=(), compile_sources=()):
        """The digests of an FMU for a platform, in a host for it that `runner` runs; or of its sources, compiled by
        another command."""
        folder = self.folder / (platform or "here")
        folder.mkdir()
        platforms = [platform] if platform else ()
        export(self.model, folder / "a.fmu", self.whole.start, fmi=3, platforms=platforms)
        fmpy.extract(str(folder / "a.fmu"), unzipdir=str(folder))
        description = fmpy.read_model_description(str(folder))
        reference = {v.name: v.valueReference for v in description.modelVariables}
        head = [len(self.bounds), len(self.results), STEPS, self.pieces, self.every]
        values = [reference[name] for name in (*self.bounds, *self.results)]
        job = (
            struct.pack(f"<{len(head) + len(values)}I", *head, *values)
            + struct.pack("<d", STEP)
            + np.ascontiguousarray(self.given).tobytes()
        )
        (folder / "job").write_bytes(job)
        program = folder / "host.exe"
        command = [*ZIG, "-target", target] if target else [compiler().command[0]]
        command += ["-O1", "-I", folder / "sources", HERE / "digest.c", "-o", program]
        subprocess.run([*command, *([] if target else ["-ldl"])], check=True, capture_output=True)
        (library,) = (folder / "binaries").glob("*/*")
        if compile_sources:
            files = [folder / "sources" / f"{name}.c" for name in ("kernels", "model", "fmi3")]
            command = [*compile_sources, "-fPIC", "-shared", *files, "-o", library, "-lm"]
            subprocess.run(command, check=True, capture_output=True)
        arguments = [*runner, program, library, description.instantiationToken, "job"]
        process = subprocess.run(arguments, cwd=folder, capture_output=True, text=True)
        assert process.returncode == 0, process.stderr[-2000:]
        return process.stdout.split()

    def in_node(self):
        """The digests of JavaScript in node."""
        inputs = list(self.model.input_layout.names)
        given = {
            "p": np.array(self.model.parameter_layout.values(self.whole.parameters), float),
            "inputs": [inputs.index(name) for name in self.bounds],
            "values": self.given,
            "results": self.results,
            **{"step": STEP, "steps": STEPS, "pieces": self.pieces, "every": self.every},
        }
        return in_node({"m": self.model}, DIGEST, given)


DIGEST = """
const m = models.m, { inputs, values, results, step, steps, pieces, every } = given, digests = [];
const chosen = placesOf(m, results);
const row = new Float64Array(results.length), words = new Uint32Array(row.buffer);
const take = (piece) => inputs.forEach((place, k) => (m.u[place] = values[piece * inputs.length + k]));
m.p.set(given.p);
take(0);
m.derive?.();
m.start();
let [a, b] = [0x811c9dc5, 0x9747b28c];
const digest = (r) => {
  if (r === 0) return;
  for (let n = 0; n < row.length; n++) row[n] = chosen[n][0][chosen[n][1]];
  for (const word of words) {
    a = Math.imul(a ^ word, 0x01000193);
    b = Math.imul(b ^ word, 0x85ebca6b);
    b ^= b >>> 13;
  }
};
for (let piece = 0; piece < pieces; ++piece) {
  take(piece);
  const rows = m.run({ begin: piece * steps * step, step, rows: steps + 1, between: false, row: digest });
  if (rows !== steps + 1) throw new Error(`${rows} rows in piece ${piece}`);
  if ((piece + 1) % every === 0) digests.push([a, b].map((x) => (x >>> 0).toString(16).padStart(8, "0")).join(""));
}
return digests;
"""
"""The digests of digest.c of the same run."""


@pytest.mark.second
@here
@node
@pytest.mark.parametrize("name", SYSTEMS)
def test_native_code_and_javascript_have_the_same_bits(name, tmp_path):
    """10,000 steps: the motor follows jumps of its reference under jumps of the load."""
    job = Job(name, tmp_path, 20)
    digests = job.native()
    assert digests == job.in_node() and len(set(digests)) == 10


@pytest.mark.stages(second=1)
@here
@zig
@pytest.mark.second
@pytest.mark.parametrize("command", [["cc"], ZIG])
def test_compilers_that_would_contract_have_the_same_bits(command, tmp_path):
    """The sources of an FMU, compiled by an importer for this processor, which rounds a product and a sum at once."""
    job = Job("chain_unit", tmp_path, 20)
    assert job.native(compile_sources=[*command, "-O3", "-march=native"]) == job.in_node()


def wine():
    found = shutil.which("wine64") or shutil.which("wine64", path="/usr/lib/wine")
    return [found] if found else None


def qemu():
    found, root = shutil.which("qemu-aarch64"), Path("/usr/aarch64-linux-gnu")
    return [found, "-L", str(root)] if found and root.exists() else None


OTHERS = {
    # platform: target of zig for the host, what runs it
    "linux64": ("x86_64-linux-gnu", list),
    "win64": ("x86_64-windows-gnu", wine),
    "aarch64-linux": ("aarch64-linux-gnu.2.17", qemu),
}


@cache
def whole_run(name):
    """The digests of the whole run in native code of the system's compiler."""
    with tempfile.TemporaryDirectory() as folder:
        return Job(name, Path(folder), WHOLE).native()


@here
@zig
@pytest.mark.slow
@pytest.mark.parametrize("name", SYSTEMS)
@pytest.mark.parametrize("platform", OTHERS)
def test_every_platform_has_the_same_bits(name, platform, tmp_path):
    """A million steps: GCC's code against that of Clang (which zig is) for Linux, Windows and ARM."""
    target, runner = OTHERS[platform]
    if (command := runner()) is None:
        pytest.skip("Wine, or QEMU with the C library for ARM, is not installed")
    assert Job(name, tmp_path, WHOLE).native(platform, target, command) == whole_run(name)


@here
@node
@pytest.mark.slow
@pytest.mark.parametrize("name", SYSTEMS)
def test_a_million_steps_in_javascript(name, tmp_path):
    assert Job(name, tmp_path, WHOLE).in_node() == whole_run(name)
