"""Engines for the WebAssembly modules of models: node, wasmtime in Python, and Chromium.

A job is a module and steps: ``("write", address, bytes)``, ``("call", name, arguments)``, ``("read", address,
count)``. Its results are those of the calls and, as arrays, of the reads.
"""

from __future__ import annotations

import base64
import ctypes
import importlib.util
import json
import shutil
import struct
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from browser import Page

NODE = shutil.which("node")
HAS_WASMTIME = importlib.util.find_spec("wasmtime") is not None
PAGE = 65536


def _job(content, steps):
    """A job as JSON."""
    coded = [
        (what, first, base64.b64encode(rest[0]).decode()) if what == "write" else (what, first, *rest)
        for what, first, *rest in steps
    ]
    return json.dumps({"module": base64.b64encode(content).decode(), "steps": coded})


def _results(text):
    """The results of a job from JSON."""
    return [
        np.frombuffer(base64.b64decode(each)) if isinstance(each, str) else each for each in json.loads(text)
    ]


def in_node(content, steps):
    """The results of a job in node."""
    script = Path(__file__).with_name("wasm_host.mjs")
    command, job = [NODE, script], _job(content, steps) + "\n"
    return _results(subprocess.run(command, input=job, capture_output=True, text=True, check=True).stdout)


def in_chromium(content, steps):
    """The results of a job in a page of Chromium."""
    script = Path(__file__).with_name("wasm_job.mjs").read_text("utf-8").replace("export ", "")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        file = Path(name) / "empty.html"
        file.write_text("<!DOCTYPE html><title>job</title>", "utf-8")
        with Page(file, Path(name) / "browser") as page:
            return _results(
                page.evaluate(f"""(() => {{
                  {script}
                  const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
                  const text = (data) => btoa(Array.from(data, (each) => String.fromCharCode(each)).join(""));
                  return JSON.stringify(carryOut({_job(content, steps)}, bytes, text));
                }})()""")
            )


class Wasmtime:
    """A module in wasmtime."""

    def __init__(self, content):
        import wasmtime

        self._store = wasmtime.Store()
        module = wasmtime.Module(self._store.engine, content)
        self._exports = wasmtime.Instance(self._store, module, []).exports(self._store)

    def do(self, what, first, *rest):
        """Carry out a step."""
        if what == "call":
            return self._exports[first](self._store, *rest[0])
        memory = self._exports["memory"]
        size = 8 * rest[0] if what == "read" else len(rest[0])
        lacking = first + size - memory.data_len(self._store)
        if lacking > 0:
            memory.grow(self._store, -(-lacking // PAGE))
        begin = ctypes.addressof(memory.data_ptr(self._store).contents) + first
        if what == "read":
            return np.frombuffer(ctypes.string_at(begin, size))
        return ctypes.memmove(begin, rest[0], size)


def in_wasmtime(content, steps):
    """The results of a job in wasmtime."""
    host = Wasmtime(content)
    results = [(step[0], host.do(*step)) for step in steps]
    return [result for what, result in results if what != "write"]


ENGINES = {"node": in_node, "wasmtime": in_wasmtime, "chromium": in_chromium}


def numbers(values):
    """Numbers as they lie in memory."""
    return np.ascontiguousarray(values, float).tobytes()


def table(description, signals, at):
    """The table of the signals by the names of inputs, for a place in memory, see `chainunit.core.wasm.runs`: a
    `Profile`, or a list of points (time, value)."""
    inputs = description["inputs"]
    records, tail = b"", b""
    behind = at + 8 + 24 * len(signals)
    for name, signal in signals.items():
        changes = getattr(signal, "changes", None)
        values = (
            np.ravel(signal) if changes is None else [signal.start, *(x for each in changes for x in each)]
        )
        count = len(signal) if changes is None else len(changes)
        address = inputs["address"] + 8 * inputs["names"].index(name)
        records += struct.pack("<6i", address, int(changes is not None), count, behind + len(tail), 0, 0)
        tail += numbers(values)
    return struct.pack("<2i", len(signals), 0) + records + tail


def addresses(description, names):
    """The table of the results of a row, by the names of outputs and states."""
    known = {
        name: description[kind]["address"] + 8 * k
        for kind in ("outputs", "states", "inputs")
        for k, name in enumerate(description[kind]["names"])
    }
    return struct.pack(f"<2i{len(names)}i", len(names), 0, *(known[name] for name in names))


def run_steps(description, signals, names, *, begin, step, rows, longest=0.0, function="run"):
    """The steps of a run, whose last results are the number of its rows, the rows and the states at the end."""
    at = -(-description["memory"]["free"] // 16) * 16
    signal_table = table(description, signals, at)
    chosen = at + -(-len(signal_table) // 16) * 16
    chosen_table = addresses(description, names)
    into = chosen + -(-len(chosen_table) // 16) * 16
    every = (1 << len(description["groups"])) - 1
    states = description["states"]
    return [
        ("write", at, signal_table),
        ("write", chosen, chosen_table),
        ("write", into, bytes(8 * rows * len(names))),
        ("call", function, [begin, step, longest, rows, at, chosen, into, every]),
        ("read", into, rows * len(names)),
        ("read", states["address"], len(states["names"])),
    ]
