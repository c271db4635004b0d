"""Batches in native code: one loop over vectors of lanes, in several threads.

The code is compiled at its first use for the processor of this machine. It may contract a product and a sum to one
rounding, and takes sines from a vector library; FMUs do neither, and so have the same bits everywhere.
"""

from __future__ import annotations

import ctypes
import itertools
import math
import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from typing import Any

import numpy as np

from ..core.files import scratch
from ..core.native.compilers import Compiler, compile_code, compiler, flags_for_this_processor
from ..core.printing.c_forms import c_file
from ..core.printing.vector_code import VectorCode, header
from .equations import Equations
from .reductions import Reductions, loop_text

_PIECES = 4
"""Number of pieces of the work for each thread."""
_LANES = 8
"""Number of numbers in a line of the cache; the pieces of the last dimension are multiples of it."""

_BLOCK = 64
"""Number of states that are kept in the first cache before they are stored."""


def defines(
    equations: Equations, code: VectorCode, reductions: Reductions, own_sizes: Mapping[str, int]
) -> str:
    """The sizes and statements that the generated code defines for its loop, see states.h, with the `own_sizes` of a
    language."""
    sizes = {
        "INPUTS": len(code.inputs),
        "COLUMNS": len(code.columns),
        "RESULTS": len(equations.results),
        "ROOM": code.room,
        "REDUCED": int(bool(reductions)),
        "NOT_FINITE": equations.not_finite,
    }
    values = {**sizes, **own_sizes, **loop_text(reductions)}
    return "\n".join(f"#define {name} {value}" for name, value in values.items())


def _source(equations: Equations, code: VectorCode, reductions: Reductions) -> str:
    """The C source of the loop."""
    return "\n".join(
        [
            header(),
            defines(equations, code, reductions, {"BLOCK": _BLOCK}),
            code.uniform(),
            code.body("states", (0, 1)),
            c_file("states.h", __package__),
        ]
    )


class NativeKernel:
    """The compiled loop of some equations with given varying arguments."""

    def __init__(
        self,
        equations: Equations,
        varying: Sequence[tuple[int, int]],
        reductions: Reductions,
        compiler: Compiler,
    ) -> None:
        code = VectorCode(equations.operations, varying)
        self.inputs, self.columns = code.inputs, code.columns
        self._library = load(_source(equations, code, reductions), compiler)

    def __call__(
        self,
        uniform: Any,
        columns: Any,
        out: Any,
        reason: Any,
        size: tuple[int, int],
        numbers: Any,
        workers: int,
    ) -> None:
        """Compute all states.

        Parameters
        ----------
        uniform : arrays of shape (1,) or (outer,), by `inputs`, or one array of which they are the rows
        columns : arrays of shape (1, inner) or (outer, inner), by `columns`, or one array of which they are the parts
        out : arrays to be filled, each of shape (outer, inner), or, reduced, (outer,), or one array of which they are
            the parts
        reason : array to be filled, of the same shape
        size : (outer, inner)
        numbers : see `chainunit.batch.reductions.flat_numbers`
        workers : number of threads
        """
        outer, inner = size
        pointers = [_pointers(arrays) for arrays in (uniform, columns, out)]
        steps = [
            (ctypes.c_long * (len(uniform) + 1))(*(int(len(x) > 1) for x in uniform)),
            (ctypes.c_long * (len(columns) + 1))(*(inner * int(len(x) > 1) for x in columns)),
        ]

        def piece(ends: tuple[int, int, int, int]) -> None:
            """Compute the states of a piece: begin and end of its rows, begin and end of its columns."""
            self._library.batch(
                *map(ctypes.c_long, (*ends, inner)),
                pointers[0],
                steps[0],
                pointers[1],
                steps[1],
                pointers[2],
                *(x.ctypes.data_as(ctypes.c_void_p) for x in (reason, numbers)),
            )

        pieces = _pieces(outer, inner, workers, divide=reason.ndim > 1)
        if workers == 1 or len(pieces) == 1:
            for result in pieces:
                piece(result)
        else:
            list(threads(workers).map(piece, pieces))


@lru_cache
def threads(workers: int) -> ThreadPoolExecutor:
    """So many threads, which stay: their start takes as long as some ten thousand states."""
    return ThreadPoolExecutor(workers, "chainunit")


if hasattr(os, "register_at_fork"):
    # a child of a fork has none of the threads
    os.register_at_fork(after_in_child=threads.cache_clear)


def aligned(shape: tuple[int, ...]) -> Any:
    """An array for results that begins at a line of the cache."""
    size = math.prod(shape)
    memory = np.empty(size + _LANES)
    begin = -(memory.ctypes.data // memory.itemsize) % _LANES
    return memory[begin : begin + size].reshape(shape)


def _pointers(arrays: Any) -> Any:
    """The addresses of some arrays, and one more, as C has no empty arrays."""
    if isinstance(arrays, np.ndarray):
        first, step = arrays.ctypes.data, arrays.strides[0]
        return (ctypes.c_void_p * (len(arrays) + 1))(*range(first, first + step * len(arrays), step))
    return (ctypes.c_void_p * (len(arrays) + 1))(*(x.ctypes.data for x in arrays))


def _pieces(outer: int, inner: int, workers: int, divide: bool) -> list[tuple[int, int, int, int]]:
    """Ranges of both dimensions; the inner one is divided only if there are too few outer ones."""
    count = 1 if workers == 1 else _PIECES * workers
    if outer >= count or not divide:
        cuts = [outer * k // count for k in range(count + 1)]
        return [(a, b, 0, inner) for a, b in itertools.pairwise(cuts) if a < b]
    length = max(_LANES, -(-inner * outer // count) // _LANES * _LANES)
    return [(o, o + 1, a, min(a + length, inner)) for o in range(outer) for a in range(0, inner, length)]


def load(source: str, compiler: Compiler, files: Mapping[str, str] | None = None) -> ctypes.CDLL:
    """The compiled library of a C source, which includes these `files`, texts by name.

    Raises
    ------
    RunError
        if the compiler fails.
    """
    native = flags_for_this_processor(compiler)
    arguments = (*native.flags, "batch.c", "-o", "batch.so", *native.libraries)
    texts = {name: text.encode() for name, text in {"batch.c": source, **(files or {})}.items()}
    binary = compile_code(compiler, arguments, {**texts, **native.files}, "batch.so")
    with scratch() as folder:  # a loaded library stays usable
        file = folder / "batch.so"
        file.write_bytes(binary)
        return ctypes.CDLL(str(file))


@lru_cache(maxsize=64)
def native_kernel(
    equations: Equations, varying: tuple[tuple[int, int], ...], reductions: Reductions
) -> NativeKernel | None:
    """The loop, compiled at the first call; None without a C compiler.

    Raises
    ------
    RunError
        if the compiler fails.
    """
    local_compiler = compiler()
    return None if local_compiler is None else NativeKernel(equations, varying, reductions, local_compiler)
