"""A study where no C compiler is found: its FMUs are Python code. Its runs are made as one system in WebAssembly
where ``wasmtime`` is installed, and the study is one that this serves; otherwise by these FMUs."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import replace

from ..batch.transients import only_wasm
from ..batch.wasm_loop import has_wasmtime
from ..core.errors import InputError
from ..system.compiled_simulation import CompiledSystem, is_evaluated
from .event import Event
from .rig import Rig

BY_WASM = (
    "No C compiler was found: the runs are made as one system in WebAssembly, by wasmtime, without an error of a "
    "coupling between FMUs. The FMUs in the folder are Python code; for native ones install gcc or clang, or the "
    "compiler that comes with pip install 'chainunit[cross]'."
)
BY_PYTHON = (
    "No C compiler was found: the FMUs run in Python. With one the runs take about a tenth of the time: install gcc "
    "or clang, or the compiler that comes with pip install 'chainunit[cross]'."
)
WITHOUT_WASMTIME = (
    " Without a compiler, wasmtime makes the runs of most studies as fast: pip install 'chainunit[wasm]'."
)


def rig_and_note(rig: Rig, events: Iterable[Event]) -> tuple[Rig, str]:
    """The rig by which a study with these events is run where its FMUs are Python code, and a sentence on it."""
    if only_wasm() and _serves(rig, events):
        return replace(rig, files=None), BY_WASM
    return rig, BY_PYTHON + ("" if has_wasmtime() else WITHOUT_WASMTIME)


def _serves(rig: Rig, events: Iterable[Event]) -> bool:
    """Whether the runs can be made as one system: it is a co-simulation of models alone, and its signals are numbers
    and profiles."""
    if rig.operation.simulation != "cs" or rig.drive.foreign_titles:
        return False
    unknown: dict[str, float] = defaultdict(float)
    signals = [*rig.signals(ramp=True).values()]
    for event in events:
        if rig.takes(event):
            signals += rig.event_signals(event, 0.0, unknown).values()
    try:
        CompiledSystem(rig.graph)
    except InputError:
        return False
    return all(map(is_evaluated, signals))
