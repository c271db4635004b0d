"""Outputs over arrays: xarray in, xarray out, with units."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.declared_numbers import in_declared_unit, kind_words, magnitude_and_unit, number_in
from ..core.errors import InputError, RemarkWarning, RunError, check_choice, check_kind, printable, texts_in
from ..core.model import Model
from ..core.native.compilers import COMPILERS
from ..core.printing.operations import ARGUMENT
from ..core.quantities import Variable
from ..core.symbolic_trace import outputs_of
from ..core.units import of_other_kind, scale
from . import arrays
from .cuda import cuda_kernel, cupy_, host, namespace, on_device
from .equations import Equations, Result, equations, find, names_of
from .native import aligned, native_kernel
from .reductions import REDUCTIONS, Beyond, Histogram, ReducedColumn, Reductions, Request, flat_numbers

if TYPE_CHECKING:
    import xarray as xr

ENGINES = ("native", "numpy", "cuda")
_LEAST_INNER = 64
"""A last dimension that is shorter is no loop of its own: all dimensions are one loop then."""


class ReasonKind(Enum):
    """Why a state has no result, with its text; ``NONE`` is for a state with a result."""

    NONE = "valid"
    REQUIREMENT = "{subject}: {detail}"
    POSITION = "the machine cannot be assembled in this position, or stands in a dead position"
    BOUNDS = "{subject}: must be {detail}"


@dataclass(frozen=True)
class StateReason:
    """A reason for which there is no result: its kind, whose value is a text with slots for the `subject`, such as
    the name of a parameter, and a `detail`."""

    kind: Enum
    subject: str = ""
    detail: str = ""

    def __str__(self) -> str:
        return str(self.kind.value).format(subject=self.subject, detail=self.detail)


def reasons_of(model: Model) -> list[StateReason]:
    """The reasons of a model by their codes. The reasons for values outside their bounds follow them."""
    return [
        StateReason(ReasonKind.NONE),
        *(
            StateReason(ReasonKind.REQUIREMENT, requirement.subject, requirement.why)
            for requirement in model.required
        ),
        StateReason(ReasonKind.POSITION),
    ]


def evaluate(
    model: Model,
    values: Mapping[str, Any],
    outputs: Sequence[str] | None = None,
    *,
    by: Sequence[str] = (),
    over: str | None = None,
    reduce: Mapping[str, Request | Sequence[Request]] | None = None,
    parameters: Any = None,
    engine: str = "native",
    workers: int | None = None,
    out: xr.Dataset | None = None,
    on_host: bool = False,
) -> xr.Dataset:
    """Outputs of a model over arrays of parameters, inputs and states.

    Parameters
    ----------
    model : the model, such as `ChamberForces`; a model with states takes each state from `values`
    values : by the name of a parameter, input or state: a number, a DataArray, or an array of one dimension, which
        becomes the dimension of that name. A text or a quantity of pint has its unit; a DataArray whose ``units``
        differ from the declared units is converted. Dimensions of the same name belong together; all others are
        combined. A dimension along which one value alone varies has this value as its coordinate.
    outputs : names of the outputs, or of quantities beside them (`Model.further`: ``crank_torque``,
        ``force(pivot)``); by default all outputs
    by : names of parameters, inputs and states by which each output is differentiated; the derivatives are exact,
        with the names ``d(tau)/d(r)``
    over, reduce : the dimension over which outputs are reduced, and by output the names of `REDUCTIONS`, `Beyond` and
        `Histogram`; the results have the names ``peak(tau)``, ``beyond(tau, 500)`` and ``histogram(tau)``, the latter
        with a further dimension ``bin(tau)``. With them, `outputs` and `by` are not given.
    parameters : an instance of `model.Parameters` with the values of all other parameters
    engine : "native" (compiled C, SIMD, threads), "numpy", or "cuda" (a GPU of NVIDIA, by CuPy); without a C compiler
        "native" is numpy, with a warning
    workers : number of threads of the native engine; by default one for each processor
    out : the result of an earlier call with the same outputs and dimensions. Its memory takes the new results, and
        its own values are gone; new memory takes as long as the computation.
    on_host : whether results of "cuda" are copied to the host, as arrays of numpy. Without it they stay on the
        device, as arrays of CuPy; `values` may be such arrays, too.

    Returns
    -------
    a Dataset with a variable for each output, and ``reason``: 0 for a valid state. Where it is not 0 the results are
    NaN; its attributes ``flag_values`` and ``reasons`` say why, and ``subjects`` what the reason is about.

    Raises
    ------
    InputError
        for an unknown name, a value that is missing or of a wrong unit, sizes that do not fit, and the engine "cuda"
        without CuPy or a GPU.
    RunError
        for results that do not fit into the memory.
    """
    import xarray as xr

    check_kind("model", model, Model, 'a model, such as MODELS["DcMotor"] of chainunit.models')
    check_kind("values", values, Mapping, "a mapping of names to values")
    check_kind("over", over, str | None, "the name of a dimension")
    check_kind("workers", workers, int | None, "a number of threads")
    check_kind("out", out, xr.Dataset | None, "the result of an earlier call")
    check_engine(engine)
    if reduce is not None:
        check_kind("reduce", reduce, Mapping, 'a mapping such as {"tau": ["peak"]}')
        if over is None or outputs is not None or by:
            raise InputError("reduce: needs the dimension `over`, and takes the place of `outputs` and `by`")
        outputs = list(reduce)
    names = texts_in("outputs", outputs) if outputs is not None else tuple(v.name for v in outputs_of(model))
    traced = equations(model, names, texts_in("by", by))
    grid = Grid(traced, values, parameters, over, engine, _reductions(reduce or {}, traced.results))
    try:
        memory = grid.memory(out)
        grid.compute(memory, workers or os.cpu_count() or 1)
        return grid.dataset(memory, on_host)
    except MemoryError as error:
        size = 8e-9 * math.prod(grid.sizes.values()) * len(traced.results)
        message = (
            f"{size:.3g} GB of results: more than there is memory; evaluate fewer states, or reduce them"
        )
        raise RunError(message) from error


def check_engine(engine: str) -> None:
    """Refuse an engine that there is not, or not on this machine.

    Raises
    ------
    InputError
        see `evaluate`.
    """
    check_choice("engine", engine, ENGINES)
    if engine == "cuda":
        cupy_()


def _reductions(reduce: Mapping[str, Request | Sequence[Request]], results: Sequence[Result]) -> Reductions:
    """The checked requests; one request is a list of one. The output at each place has the unit of its result."""
    columns: list[ReducedColumn] = []
    for place, (output, listed) in enumerate(reduce.items()):
        requests = listed if isinstance(listed, list | tuple) else [listed]
        count = sum(isinstance(request, Histogram) for request in requests)
        if count > 1:
            raise InputError(f"{output}: has {count} histograms; give one, with more bins")
        columns += [
            ReducedColumn.checked(place, _in_unit(request, results[place].unit), output)
            for request in requests
        ]
    return tuple(columns)


def _in_unit(request: Any, unit: str) -> Any:
    """A request whose limit or ends are numbers in the `unit` of its column."""
    if not isinstance(request, Beyond | Histogram):
        return request
    ends: Any = {
        name: number_in(unit, f"{type(request).__name__}: {name}", x, "limit")
        for name, x in vars(request).items()
        if name != "bins"
    }
    return replace(request, **ends)


@dataclass(frozen=True)
class ResultRows:
    """A variable of the results. A histogram has its `bins`: a row of the results for each, at these middles, in a
    `unit`."""

    result: Result
    bins: Any = None
    unit: str = ""

    @property
    def rows(self) -> int:
        """Its number of rows."""
        return 1 if self.bins is None else len(self.bins)

    @property
    def dims(self) -> list[str]:
        """Its dimensions before the dimensions of the states."""
        return [] if self.bins is None else [self.result.name.replace("histogram(", "bin(", 1)]


@dataclass(frozen=True)
class Memory:
    """Where the results go: an array of each row, shape (outer, inner) or, reduced, (outer,), and their reasons;
    `parts` are the rows by variable, each of shape (rows, outer, inner) or (rows, outer)."""

    results: Any
    reason: Any
    parts: Sequence[Any] = ()


class Grid:
    """The states of a batch: arguments over named dimensions.

    `sizes` are the lengths of the dimensions, `dims` their names, last the one that is reduced or the longest; `size`
    is the number of states over the outer dimensions, and over the inner one.
    """

    def __init__(
        self,
        equations: Equations,
        values: Mapping[str, Any],
        parameters: Any,
        over: str | None,
        engine: str,
        reductions: Reductions,
    ) -> None:
        model = equations.model
        self._equations, self._engine, self._reductions = equations, engine, reductions
        places = find(texts_in("values", values), names_of(equations.arguments), "parameter, input or state")
        variations = {
            name: _array(equations.arguments[k], x)
            for k, (name, x) in zip(places, values.items(), strict=True)
        }
        self.sizes: dict[str, int] = {}
        self._coords: dict[str, Any] = {}
        for name, x in variations.items():
            if engine != "cuda" and on_device(x.data):
                raise InputError(f"{name}: is on the GPU; take engine 'cuda', or give its values of numpy")
            for dim, size in x.sizes.items():
                if self.sizes.setdefault(str(dim), size) != size:
                    raise InputError(
                        f"{name}: has {size} values over {dim}, another one has {self.sizes[str(dim)]}"
                    )
            self._coords |= {str(k): c for k, c in x.coords.items()}
        self._name_places(variations)
        if over is not None and over not in self.sizes:
            raise InputError(
                f"over = {over!r}: no such dimension; there are {', '.join(self.sizes) or 'none'}"
            )
        self._over = over
        last = over or max(reversed(self.sizes), key=self.sizes.__getitem__, default=None)
        self.dims = [d for d in self.sizes if d != last] + ([last] if last else [])
        self._loops()
        base = {v.name: v.quantity.start for v in equations.arguments}
        if parameters is not None:
            base |= model.parameter_layout.by_name(parameters)
        self._bounds: list[tuple[str, Any]] = []
        self._arguments = [self._flat(v, variations.get(v.name), base[v.name]) for v in equations.arguments]

    def _name_places(self, variations: Mapping[str, xr.DataArray]) -> None:
        """Give each dimension along which one argument alone varies, and which has no coordinate, the values of this
        argument as its coordinate."""
        for dim in set(self.sizes) - set(self._coords):
            along = [x for x in variations.values() if dim in x.dims]
            if len(along) == 1 and along[0].ndim == 1:
                self._coords[dim] = along[0].variable

    @cached_property
    def _needed(self) -> set[str]:
        """The names of the arguments on which the results depend."""
        operations = self._equations.operations.items
        return {self._equations.entries[x.entry].name for x in operations if x.kind == ARGUMENT}

    def _loops(self) -> None:
        """Divide the dimensions into outer ones and the inner one, the longest."""
        last = self.dims[-1] if self.dims else None
        total = math.prod(self.sizes.values())
        if last is not None and (self._over or self.sizes[last] >= _LEAST_INNER):
            self._outer, self._inner = self.dims[:-1], [last]
        else:
            self._outer, self._inner = [], self.dims
        inner = math.prod(self.sizes[d] for d in self._inner)
        self.size = (total // inner, inner) if inner else (0, 1)

    def _flat(self, variable: Variable, x: xr.DataArray | None, start: float | None) -> Any:
        """An argument as an array of shape (1 or outer, 1 or inner)."""
        if x is None:
            if start is None and variable.name in self._needed:
                raise InputError(f"{variable.name}: has no value; a state has no start value of its own")
            return np.full((1, 1), np.nan if start is None else start)
        q = variable.quantity
        values = x.data.astype(float, copy=False)
        with np.errstate(invalid="ignore"):
            # two passes over many values in place of seven; an extreme of values with a NaN is NaN
            if values.size and q.low < values.min() and values.max() < q.high:
                return self._shaped(x)
            outside: Any = ~q.admits(values)
            inside = np.where(outside, values, np.clip(values, q.low, q.high))
        if outside.any():
            self._bounds.append((variable.name, x.copy(data=outside)))
        return self._shaped(x.copy(data=inside))

    def _shaped(self, x: xr.DataArray) -> Any:
        """The values, shape (1 or outer, 1 or inner): 1 for dimensions along which they do not vary."""
        dims = set(map(str, x.dims))
        sides = [side if dims & set(side) else [] for side in (self._outer, self._inner)]
        order = [d for side in sides for d in side]
        full = x.expand_dims({d: self.sizes[d] for d in order if d not in dims}).transpose(*order)
        shape = [math.prod(self.sizes[d] for d in side) for side in sides]
        return namespace(full.data).ascontiguousarray(full.data, float).reshape(shape)

    def memory(self, earlier: xr.Dataset | None) -> Memory:
        """New memory for the results, or the memory of an `earlier` result.

        Raises
        ------
        InputError
            if the earlier result has no memory for these results.
        """
        shape = self.size[:1] if self._reductions else self.size
        columns = self._columns
        if earlier is None:
            ends = np.cumsum([0, *(column.rows for column in columns)])
            whole = (int(ends[-1]), *shape)
            on_gpu = self._engine == "cuda"
            block = cupy_().empty(whole) if on_gpu else aligned(whole)
            reason = (cupy_() if on_gpu else np).zeros(shape, np.int16)
            return Memory(block, reason, [block[begin:end] for begin, end in pairwise(ends.tolist())])
        parts = [
            self._earlier(earlier, column.result.name, column.dims, column.rows, np.float64)
            for column in columns
        ]
        parts = [x.reshape(column.rows, *shape) for x, column in zip(parts, columns, strict=True)]
        reason = self._earlier(earlier, "reason", [], 1, np.int16).reshape(shape)
        reason[...] = 0
        return Memory([row for part in parts for row in part], reason, parts)

    def _earlier(self, earlier: xr.Dataset, name: str, first: list[str], rows: int, kind: Any) -> Any:
        """The array of a variable of an earlier result, with these `first` dimensions."""
        x, dims = earlier.variables.get(name), (*first, *self._dims)
        sizes = (*([rows] * len(first)), *(self.sizes[d] for d in self._dims))
        if x is None or x.dims != dims or x.shape != sizes:
            over = ", ".join(f"{d}: {size}" for d, size in zip(dims, sizes, strict=True)) or "one state"
            raise InputError(
                f"out: has no {name} over ({over}); give the result of a call like this one, or none"
            )
        values = x.data
        of_engine = on_device(values) == (self._engine == "cuda")
        if not (of_engine and values.dtype == kind and values.flags.c_contiguous) or not getattr(
            values.flags, "writeable", True
        ):
            raise InputError(
                f"out: {name} is no array that can be filled; give the result of a call, unchanged"
            )
        return values

    def compute(self, memory: Memory, workers: int) -> None:
        """Fill the memory with results, reduced if reductions are asked for, and with the reasons of states without a
        result: by a compiled kernel if there is one, else by numpy."""
        traced = self._equations
        if not self.size[0]:
            return
        entries = dict(zip(traced.entries, self._arguments, strict=True))
        if (kernel := self._kernel(entries)) is not None:
            kernel(
                [entries[e][:, 0].copy() for e in kernel.inputs],
                [entries[e] for e in kernel.columns],
                memory.results,
                memory.reason,
                self.size,
                flat_numbers(self._reductions),
                workers,
            )
        else:
            states = memory
            if self._reductions:
                states = Memory(np.empty((len(traced.results), *self.size)), np.zeros(self.size, np.int16))
            arrays.by_numpy(traced.operations, entries, states.results, states.reason, traced.not_finite)
            if self._reductions:
                self._reduce(states, memory)
        self._refuse(memory)

    def _reduce(self, states: Memory, memory: Memory) -> None:
        """Reduce the inner dimension of stored `states` into `memory`: a row with a state without results has the
        largest reason of its states, and no results."""
        memory.reason[...] = np.max(states.reason, axis=1)
        rows = iter(memory.results)
        for column in self._reductions:
            with np.errstate(invalid="ignore"):
                reduced = column.of_array(states.results[column.place])
            for result in reduced:
                next(rows)[...] = np.where(memory.reason == 0, result, np.nan)

    def _kernel(self, entries: Mapping[tuple[int, int], Any]) -> Any:
        """The compiled loop of the engine; None if numpy computes."""
        if self._engine == "numpy":
            return None
        varying = tuple(entry for entry, x in entries.items() if x.shape[1] > 1)
        if self._engine == "cuda":
            return cuda_kernel(self._equations, varying, self._reductions)
        try:
            kernel = native_kernel(self._equations, varying, self._reductions)
        except RunError as error:
            warnings.warn(
                f"the native engine is not available, numpy computes: {error}", RemarkWarning, stacklevel=4
            )
            return None
        if kernel is None:
            warnings.warn(
                f"no C compiler ({COMPILERS}) found: numpy computes, some twenty times slower",
                RemarkWarning,
                stacklevel=4,
            )
        return kernel

    def _refuse(self, memory: Memory) -> None:
        """Values outside their bounds come before all other reasons."""
        for k, (_, outside) in enumerate(self._bounds):
            bad = self._shaped(outside) != 0.0
            if memory.reason.ndim == 1:
                bad = bad.any(axis=1)
            if self._engine == "cuda":
                bad = cupy_().asarray(bad)
            bad = np.broadcast_to(bad, memory.reason.shape)
            memory.reason[bad] = self._equations.not_finite + 1 + k
            for x in memory.results:
                x[bad] = np.nan

    @property
    def reasons(self) -> list[StateReason]:
        """The reasons by their codes."""
        quantities = {v.name: v.quantity for v in self._equations.arguments}
        outside = (
            StateReason(ReasonKind.BOUNDS, name, quantities[name].allowed_range) for name, _ in self._bounds
        )
        return [*reasons_of(self._equations.model), *outside]

    @property
    def _dims(self) -> list[str]:
        """The dimensions of the states that the results have."""
        return self.dims[:-1] if self._reductions else self.dims

    @property
    def _columns(self) -> list[ResultRows]:
        """The variables of the results."""
        results = self._equations.results
        if not self._reductions:
            return [ResultRows(result) for result in results]
        return [_reduced_rows(results[column.place], column.request) for column in self._reductions]

    def dataset(self, memory: Memory, on_host: bool) -> xr.Dataset:
        """The results with names, units and coordinates; of a GPU as arrays of the device, unless `on_host`."""
        import xarray as xr

        dims, take = self._dims, host if on_host else (lambda x: x)
        shape = [self.sizes[d] for d in dims]
        variables, coords = {}, {}
        for column, x in zip(self._columns, memory.parts, strict=True):
            result = column.result
            attributes = {"units": result.unit, "long_name": result.description}
            if column.bins is not None:
                (name,) = column.dims
                of_bins = {"units": column.unit, "long_name": f"middle of a bin, {result.description}"}
                coords[name] = (name, column.bins, of_bins)
            sizes = [len(x)] * len(column.dims) + shape
            variables[result.name] = ([*column.dims, *dims], take(x.reshape(sizes)), attributes)
        flags: dict[str, Any] = {
            "flag_values": list(range(len(self.reasons))),
            "reasons": [str(reason) for reason in self.reasons],
            "subjects": [reason.subject for reason in self.reasons],
            "long_name": "reason for which there is no result",
        }
        variables["reason"] = (dims, take(memory.reason.reshape(shape)), flags)
        coords |= {
            name: c
            for name, c in self._coords.items()
            if set(map(str, c.dims)) <= set(dims) and name not in variables
        }
        return xr.Dataset(variables, coords)


def _reduced_rows(result: Result, request: Request) -> ResultRows:
    """The variable of a reduced result."""
    if isinstance(request, Histogram):
        counts = Result(f"histogram({result.name})", "1", f"number of states by value, {result.description}")
        return ResultRows(counts, request.middles, result.unit)
    if isinstance(request, Beyond):
        size = f"{request.limit:.15g}"
        text = f"number of states with a size beyond {size} {result.unit}, {result.description}"
        return ResultRows(Result(f"beyond({result.name}, {size})", "1", text))
    return ResultRows(
        Result(f"{request}({result.name})", result.unit, f"{REDUCTIONS[request].title}, {result.description}")
    )


def _array(variable: Variable, x: Any) -> xr.DataArray:
    """The values of an argument as a DataArray in the declared unit, with the values of one dimension as a coordinate
    of the argument's name."""
    import xarray as xr

    attributes = {"units": variable.unit, "long_name": variable.description}
    if isinstance(x, xr.DataArray):
        parts = magnitude_and_unit(x.data)
        unit = x.attrs.get("units") if parts is None else parts[1]
        values = (x.data if on_device(x.data) else x.values) if parts is None else parts[0]
        if values.dtype.kind not in "fiub":
            values, unit = in_declared_unit(variable, values), None
        if unit is not None and unit != variable.unit:
            try:
                factor, offset = scale(str(unit), variable.unit, variable.kind)
            except ValueError as error:
                kind = of_other_kind(str(unit), variable.unit)
                line = f"{variable.name} in {printable(str(unit))}: must be {kind_words(variable)}"
                raise InputError(f"{line}; {kind}" if kind else line, variable.name) from error
            values = values * factor + offset
        x = x.copy(data=values).assign_attrs(attributes)
        if x.dims == (variable.name,):
            return _array(variable, values)
        # one dimension of another name has these values, too
        return x.assign_coords({variable.name: (x.dims, host(values), attributes)}) if x.ndim == 1 else x
    values = namespace(x).asarray(x, float) if on_device(x) else in_declared_unit(variable, x)
    if np.ndim(values) > 1:
        raise InputError(
            f"{variable.name}: has {np.ndim(values)} dimensions; give them names, in a DataArray"
        )
    dims = [variable.name] if np.ndim(values) else []
    return xr.DataArray(values, {name: (name, host(values), attributes) for name in dims}, dims)
