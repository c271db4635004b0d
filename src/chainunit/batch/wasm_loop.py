"""Transients of a model where there is no C compiler: run by run in its WebAssembly module, by ``wasmtime``.

As those of the native loop, the steps of the integrator need not end at a row where the states have no constraints.
Both loops agree to the tolerance of the integrator. Derivatives of runs there are none.
"""

from __future__ import annotations

import atexit
import ctypes
import hashlib
import importlib.util
import math
from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.model import Model
from ..core.wasm.encoding import PAGE
from ..core.wasm.memory import BYTES
from ..core.wasm.module import wasm_module
from ..core.wasm.signals import PROFILE, RECORD
from .equations import find

if TYPE_CHECKING:
    from wasmtime import Engine, Module

_PIECE = 1024
"""Largest number of rows in one call: the memory of a module has room for so many, and Ctrl-C is heard between."""


def has_wasmtime() -> bool:
    """Whether ``wasmtime`` is installed."""
    return importlib.util.find_spec("wasmtime") is not None


@lru_cache(maxsize=16)
def _loaded(content: bytes) -> tuple[Engine, Module]:
    """The compiled module, and the engine that it is for."""
    from wasmtime import Engine, Module

    engine = Engine()
    return engine, Module(engine, content)


# at the end of the process wasmtime is gone before its objects are, which it would tell on the terminal
atexit.register(_loaded.cache_clear)


class WasmLoop:
    """The loop of a model, with the interface of the native one; `names` are the uniform arguments, `lanes` the
    number of runs that share a vector, and `digest` is that of the module and of all that is chosen.

    Parameters
    ----------
    model, outputs, varying, driven, guarded, changes : see `chainunit.batch.transients.Transients`

    Raises
    ------
    InputError
        for an unknown name.
    """

    lanes = 1

    def __init__(
        self,
        model: type[Model],
        outputs: Sequence[str],
        varying: Sequence[str],
        driven: Sequence[str],
        guarded: Sequence[str],
        changes: int,
    ) -> None:
        module = wasm_module(model, slopes=False)
        chosen = repr((tuple(outputs), tuple(varying), tuple(driven), tuple(guarded), changes))
        self.digest = hashlib.sha256(module.content + chosen.encode()).hexdigest()
        self._content = module.content
        self.description = d = module.description
        self.names = [*d["parameters"]["names"], *d["inputs"]["names"]]
        self.varying = find(varying, d["parameters"]["names"], "parameter")
        self.guarded = find(guarded, outputs, "output that is kept")
        self.driven = _addresses(d, ("inputs",), driven, "input")
        self.chosen = _addresses(d, ("states", "outputs"), outputs, "output")
        places = {name: k for k, name in enumerate(d["outputs"]["names"])}
        wanted = {places[name] for name in outputs if name in places}
        self.groups = sum(1 << k for k, group in enumerate(d["groups"]) if wanted & set(group))
        self.numbers = 1 + 3 * changes
        self.function = "dense" if "dense" in d["functions"] else "run"

    def __call__(
        self,
        runs: tuple[int, int],
        numbers: Sequence[float],
        arrays: Sequence[Any],
        x: Any,
        out: Any,
        count: Any,
    ) -> None:
        """Simulate the runs from the first number to before the second.

        Parameters
        ----------
        numbers : time between rows [s], longest step [s], and two that the module takes from its parameters
        arrays : uniform arguments, shape (arguments,); varying parameters; signals; begins and stops; limits: see
            `chainunit.batch.transients.Transients.run`, the runs last
        x : states at the begin, shape (states, runs); those at the end replace them
        out : rows to be filled, shape (outputs, runs, rows)
        count : numbers of rows to be filled, shape (runs,); negative where the last one is not finite
        """
        uniform, varying, signals, begin, stop, limits = arrays
        step, longest = numbers[:2]
        instance = _Instance(*_loaded(self._content), self)
        for r in range(*runs):
            instance.prepare(uniform, varying[:, r], signals[:, :, r], x[:, r])
            count[r] = instance.run(float(begin[r]), float(stop[r]), step, longest, limits[:, r], out[:, r])
            x[:, r] = instance.states


def _addresses(description: Any, kinds: Sequence[str], names: Sequence[str], what: str) -> list[int]:
    known = [
        (name, description[kind]["address"] + BYTES * k)
        for kind in kinds
        for k, name in enumerate(description[kind]["names"])
    ]
    return [known[k][1] for k in find(names, [name for name, _ in known], what)]


def _pieces(whole: int, rest: float, step: float) -> Iterator[tuple[int, int, float]]:
    """First row, number of rows and time between them [s] of each call of a run with so many whole steps and a rest
    of a step [s]; the first row of a piece is the last one of the piece before."""
    for first in range(0, whole or 1, _PIECE - 1):
        yield first, min(whole - first, _PIECE - 1) + 1, step
    if rest:
        yield whole, 2, rest


class _Instance:
    """An instance of a module, with views of its memory; `states` are those at the end of a run."""

    def __init__(self, engine: Engine, module: Module, loop: WasmLoop) -> None:
        from wasmtime import Instance, Store

        self._loop = loop
        self._store = Store(engine)
        exports: Any = Instance(self._store, module, []).exports(self._store)
        self._exports = exports
        free = -(-loop.description["memory"]["free"] // BYTES) * BYTES
        self._table = free
        at = free + BYTES + RECORD * len(loop.driven)
        own = at + BYTES * loop.numbers * len(loop.driven)
        self._list = own
        self._into = own + BYTES + -(-len(loop.chosen) // 2) * BYTES
        memory: Any = self._exports["memory"]
        lacking = self._into + BYTES * _PIECE * len(loop.chosen) - memory.data_len(self._store)
        if lacking > 0:
            memory.grow(self._store, -(-lacking // PAGE))
        size = memory.data_len(self._store)
        begin = ctypes.addressof(memory.data_ptr(self._store).contents)
        whole: Any = (ctypes.c_ubyte * size).from_address(begin)
        self._values, words = np.frombuffer(whole), np.frombuffer(whole, np.int32)
        records = [
            [address, PROFILE, loop.numbers // 3, at + BYTES * loop.numbers * k, 0, 0]
            for k, address in enumerate(loop.driven)
        ]
        self._put(words, self._table, [len(records), 0, *(x for record in records for x in record)])
        self._put(words, self._list, [len(loop.chosen), 0, *loop.chosen])
        self._signals = self._at(at, loop.numbers * len(loop.driven))
        d = loop.description
        self._parameters = self._at(d["parameters"]["address"], len(d["parameters"]["names"]))
        self._inputs = self._at(d["inputs"]["address"], len(d["inputs"]["names"]))
        self.states = self._at(d["states"]["address"], len(d["states"]["names"]))
        self._pace = self._at(d["addresses"]["pace"], 1)
        self._rows = self._at(self._into, _PIECE * len(loop.chosen))

    @staticmethod
    def _put(words: Any, address: int, values: Sequence[int]) -> None:
        words[address // 4 : address // 4 + len(values)] = values

    def _at(self, address: int, size: int) -> Any:
        return self._values[address // BYTES : address // BYTES + size]

    def prepare(self, uniform: Any, varying: Any, signals: Any, states: Any) -> None:
        """Take the values of a run, and its states at the begin."""
        count = len(self._parameters)
        self._parameters[:], self._inputs[:] = uniform[:count], uniform[count:]
        self._parameters[self._loop.varying] = varying[: len(self._loop.varying)]
        self._signals[:] = np.ravel(signals)[: len(self._signals)]
        if "derive" in self._loop.description["functions"]:
            self._exports["derive"](self._store)
        self.states[:], self._pace[:] = states, 0.0

    def run(self, begin: float, stop: float, step: float, longest: float, limits: Any, out: Any) -> int:
        """Fill the rows of a run, shape (outputs, rows); gives their number, negative where the last one is not
        finite."""
        whole = math.floor((stop - begin) / step + 1e-9)
        rest = stop - begin - whole * step
        number = 1
        for first, rows, size in _pieces(whole, rest if rest > 1e-9 * step else 0.0, step):
            kept = self.states.copy(), self._pace.copy()
            arguments = begin + first * step, size, longest
            made = self._call(*arguments, rows)
            table = self._rows[: made * len(self._loop.chosen)].reshape(made, -1)
            sound = np.isfinite(table).all(axis=1)
            ends = ~sound | (np.abs(table[:, self._loop.guarded]) > limits[: len(self._loop.guarded)]).any(
                axis=1
            )
            out[:, first : first + made] = table.T
            if ends.any():
                last = int(np.argmax(ends))
                if last + 1 < made:  # the states of that row
                    self.states[:], self._pace[:] = kept
                    self._call(*arguments, last + 1)
                number = first + last + 1
                return number if sound[last] else -number
            if made < rows:
                out[:, first + made] = np.nan
                return -(first + made + 1)
            number = first + rows
        return number

    def _call(self, begin: float, step: float, longest: float, rows: int) -> int:
        places = self._table, self._list, self._into
        run = self._exports[self._loop.function]
        return int(run(self._store, begin, step, longest, rows, *places, self._loop.groups))
