"""Batches on a GPU of NVIDIA, by CuPy: the code of the native lanes, compiled for the threads of the device.

The code is compiled at its first use for the device of this machine, and cached by CuPy. Arguments that lie on the
device, as CuPy arrays, stay there, and so do the results.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from ..core.errors import InputError, RunError
from ..core.printing.c_forms import c_file
from ..core.printing.vector_code import VectorCode, header
from .equations import Equations
from .native import defines
from .reductions import Reductions, row_count

_WARP, _BLOCK, _RESIDENT = 32, 64, 4
"""Number of threads of a warp and of a block, and of the blocks on a processor of the device. With more blocks the
values of a state do not fit into the registers of a thread."""
_WARPS, _LEAST = 8192, 128
"""Number of warps that keep the device busy, and the least number of states of a piece of a row."""
_MOST_COUNTERS = 6000
"""Largest number of results of a row beside a histogram, whose counts are in the memory of a processor."""
_OPTIONS = ("--std=c++17",)


def cupy_() -> Any:
    """The module CuPy.

    Raises
    ------
    InputError
        if it is not installed, and without a GPU.
    """
    try:
        import cupy
    except ImportError:
        raise InputError(
            "engine 'cuda': needs CuPy: pip install 'chainunit[cuda]'; or take engine 'native'"
        ) from None
    try:
        count = cupy.cuda.runtime.getDeviceCount()
    except cupy.cuda.runtime.CUDARuntimeError:
        count = 0
    if not count:
        raise InputError(
            "engine 'cuda': CuPy finds no GPU of NVIDIA with its driver here; take engine 'native'"
        )
    return cupy


def on_device(x: Any) -> bool:
    """Whether an array lies on a GPU."""
    return hasattr(x, "__cuda_array_interface__")


def host(x: Any) -> Any:
    """An array as one of numpy."""
    return x.get() if on_device(x) else x


def namespace(x: Any) -> Any:
    """The module of an array: CuPy for one on a GPU, numpy for all else."""
    return cupy_() if on_device(x) else np


def source(equations: Equations, code: VectorCode, reductions: Reductions) -> str:
    """The source of the kernels in CUDA: the sizes as defines, the code of the states, and the loop over them."""
    has_counts = any(column.name == "histogram" for column in reductions)
    sizes = {
        "BLOCK": _BLOCK,
        "RESIDENT": _RESIDENT,
        "COUNTERS": row_count(reductions) if has_counts else 1,
    }
    return "\n".join(
        [
            header("cuda"),
            defines(equations, code, reductions, sizes),
            code.uniform(),
            code.body("states", (0, 1)),
            c_file("cuda_states.h", __package__),
        ]
    )


class CudaKernel:
    """The compiled kernels of some equations with given varying arguments.

    Raises
    ------
    InputError
        for more results of a row, with a histogram, than a processor of the device has room for.
    """

    def __init__(
        self,
        equations: Equations,
        varying: Sequence[tuple[int, int]],
        reductions: Reductions,
        cupy: Any,
    ) -> None:
        rows = row_count(reductions)
        if any(column.bins > 1 for column in reductions) and rows > _MOST_COUNTERS:
            raise InputError(
                f"reduce: {rows} results, bins of histograms included: the engine 'cuda' has room for "
                f"{_MOST_COUNTERS}; give fewer bins, or take engine 'native'"
            )
        code = VectorCode(equations.operations, varying)
        self.inputs, self.columns, self._room, self._rows = code.inputs, code.columns, code.room, rows
        self._cupy = cupy
        module = cupy.RawModule(code=source(equations, code, reductions), options=_OPTIONS)
        names = ("rows", "pieces", "finish") if reductions else ("rows", "stored")
        self.functions = {name: module.get_function(name) for name in names}

    def __call__(
        self,
        uniform: Sequence[Any],
        columns: Sequence[Any],
        out: Any,
        reason: Any,
        size: tuple[int, int],
        numbers: Any,
        workers: int,
    ) -> None:
        """Compute all states; see `chainunit.batch.native.NativeKernel`. `uniform` and `columns` are arrays of numpy
        or of CuPy, `out` and `reason` of CuPy; the device has its own `workers`."""
        cupy, (outer, inner) = self._cupy, size
        values, ends = self._packed([*uniform, numbers]), np.cumsum([0, *map(len, uniform)])
        varied = [cupy.asarray(x, float) for x in columns]
        lists = [
            [values.data.ptr + values.itemsize * int(begin) for begin in ends[:-1]],
            [int(len(x) > 1) for x in uniform],
            [x.data.ptr for x in varied],
            [inner * int(len(x) > 1) for x in varied],
            [x.data.ptr for x in out],
        ]
        table, cuts = cupy.asarray(np.array(sum(lists, [0]), np.int64)), np.cumsum([1, *map(len, lists)])
        places, steps, column, column_step, results = (table[int(cut) :] for cut in cuts[:-1])
        of_rows = cupy.empty(outer * self._room)
        count, length = np.int64(outer), np.int64(inner)
        self._launch("rows", outer, count, places, steps, of_rows)
        if not self._rows:
            self._launch(
                "stored", outer * inner, count, length, of_rows, column, column_step, results, reason
            )
            return
        parts = max(1, min(-(-_WARPS // outer), inner // _LEAST))
        part, part_reason = cupy.empty(self._rows * outer * parts), cupy.empty(outer * parts, np.int16)
        limits, pieces = values[int(ends[-1]) :], np.int64(parts)
        in_order = count, length, pieces, of_rows, column, column_step, limits, part, part_reason
        self._launch("pieces", _WARP * outer * parts, *in_order)
        self._launch("finish", outer, count, length, pieces, part, part_reason, results, reason)

    def _packed(self, arrays: Sequence[Any]) -> Any:
        """The arrays one after the other on the device; arrays of the host need one transfer."""
        if any(map(on_device, arrays)):
            return self._cupy.concatenate([self._cupy.asarray(x, float) for x in arrays])
        return self._cupy.asarray(np.concatenate(arrays))

    def _launch(self, name: str, threads: int, *arguments: Any) -> None:
        self.functions[name]((-(-threads // _BLOCK),), (_BLOCK,), arguments)


@lru_cache(maxsize=64)
def _kernel(
    equations: Equations, varying: tuple[tuple[int, int], ...], reductions: Reductions, cupy: Any
) -> CudaKernel:
    return CudaKernel(equations, varying, reductions, cupy)


def cuda_kernel(
    equations: Equations, varying: tuple[tuple[int, int], ...], reductions: Reductions
) -> CudaKernel:
    """The kernels, compiled at the first call.

    Raises
    ------
    InputError
        see `cupy_` and `CudaKernel`.
    RunError
        if the compiler of the device fails.
    """
    cupy = cupy_()
    try:
        return _kernel(equations, varying, reductions, cupy)
    except cupy.cuda.compiler.CompileException as error:
        raise RunError(f"the compiler of the GPU failed: {error}") from error
