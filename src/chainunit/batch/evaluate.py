"""Outputs over arrays: xarray in, xarray out, with units."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.errors import InputError, RemarkWarning, RunError, shown
from ..core.model import Model
from ..core.native.compilers import COMPILERS
from ..core.printing.operations import ARGUMENT
from ..core.quantities import Variable
from ..core.symbolic_trace import outputs_of
from ..core.units import convert, scale, split
from . import arrays
from .equations import Equations, Result, equations, find, names_of
from .native import Reductions, aligned, native_kernel
from .reductions import REDUCTIONS

if TYPE_CHECKING:
    import xarray as xr

ENGINES = ("native", "numpy", "jax")
_LEAST_INNER = 64
"""A last dimension that is shorter is no loop of its own: all dimensions are one loop then."""


class ReasonKind(Enum):
    """Why a state has no result, with its text; the first is that of a state with a result."""

    NONE = "valid"
    REQUIREMENT = "{subject}: {words}"
    POSITION = "the machine cannot be assembled in this position, or stands in a dead position"
    BOUNDS = "{subject}: must be {words}"


@dataclass(frozen=True)
class StateReason:
    """A reason for which there is no result: its kind, whose value is its text, and what the text is about."""

    kind: Enum
    subject: str = ""
    words: str = ""

    def __str__(self) -> str:
        return str(self.kind.value).format(subject=self.subject, words=self.words)


def reasons_of(model: type[Model]) -> list[StateReason]:
    """The reasons of a model by their codes; those of values outside their bounds follow them."""
    return [
        StateReason(ReasonKind.NONE),
        *(StateReason(ReasonKind.REQUIREMENT, each.subject, each.why) for each in model.required),
        StateReason(ReasonKind.POSITION),
    ]


def evaluate(
    model: type[Model],
    values: Mapping[str, Any],
    outputs: Sequence[str] | None = None,
    *,
    by: Sequence[str] = (),
    over: str | None = None,
    reduce: Mapping[str, Sequence[str]] | None = None,
    parameters: Any = None,
    engine: str = "native",
    workers: int | None = None,
    out: xr.Dataset | None = None,
) -> xr.Dataset:
    """Outputs of a model over arrays of parameters, inputs and states.

    Parameters
    ----------
    model : the model, such as `ChamberForces`; a model with states takes each state from `values`
    values : by the name of a parameter, input or state: a number, a DataArray, or an array of one dimension, which
        becomes the dimension of that name. A DataArray whose ``units`` differ from the declared units is
        converted. Dimensions of the same name belong together; all others are combined.
    outputs : names of the outputs, or of quantities beside them (`Model.further`: ``crank_torque``,
        ``force(pivot)``); by default all outputs
    by : names of parameters, inputs and states by which each output is differentiated; the derivatives are exact,
        with the names ``d(tau)/d(r)``
    over, reduce : the dimension over which outputs are reduced, and by output the names of `REDUCTIONS`; the results
        have the names ``peak(tau)``. With them, `outputs` and `by` are not given.
    parameters : an instance of `model.Parameters` with the values of all other parameters
    engine : "native" (compiled C, SIMD, threads), "numpy" or "jax"; without a C compiler "native" is numpy, with a
        warning
    workers : number of threads of the native engine; by default that of the processors
    out : the result of an earlier call with the same outputs and dimensions. Its memory takes the new results, and
        its own values are gone; new memory takes as long as the computation.

    Returns
    -------
    a Dataset with a variable for each output, and ``reason``: 0 for a valid state. Where it is not 0 the results are
    NaN; its attributes ``flag_values`` and ``reasons`` say why, and ``subjects`` what the reason is about.

    Raises
    ------
    InputError
        for an unknown name, a value that is missing or of a wrong unit, and sizes that do not fit.
    """
    if engine not in ENGINES:
        raise InputError(f"engine {engine!r}: must be one of {', '.join(ENGINES)}")
    reductions: Reductions = ()
    if reduce is not None:
        if over is None or outputs is not None or by:
            raise InputError("reduce: needs the dimension `over`, and takes the place of `outputs` and `by`")
        outputs, reductions = list(reduce), _reductions(reduce)
    names = tuple(outputs if outputs is not None else (v.name for v in outputs_of(model)))
    own = equations(model, names, tuple(by))
    grid = Grid(own, values, parameters, over)
    memory = grid.memory(reductions, out)
    grid.compute(memory, engine, reductions, workers or os.cpu_count() or 1)
    return grid.dataset(memory, reductions)


def _reductions(reduce: Mapping[str, Sequence[str]]) -> Reductions:
    pairs = []
    for place, (output, names) in enumerate(reduce.items()):
        for name in names:
            if name not in REDUCTIONS:
                raise InputError(f"{output}: no reduction {name!r}; there are {', '.join(REDUCTIONS)}")
            pairs.append((place, name))
    return tuple(pairs)


@dataclass(frozen=True)
class Memory:
    """Where the results go: an array of each, shape (outer, inner) or, reduced, (outer,), and their reasons."""

    results: Any
    reason: Any


class Grid:
    """The states of a batch: arguments over named dimensions."""

    def __init__(
        self, equations: Equations, values: Mapping[str, Any], parameters: Any, over: str | None
    ) -> None:
        model = equations.model
        self._equations = equations
        places = find(values, names_of(equations.arguments), "parameter, input or state")
        given = {
            name: _array(equations.arguments[k], x)
            for k, (name, x) in zip(places, values.items(), strict=True)
        }
        self.sizes: dict[str, int] = {}
        self._coords: dict[str, Any] = {}
        for name, x in given.items():
            for dim, size in x.sizes.items():
                if self.sizes.setdefault(str(dim), size) != size:
                    raise InputError(
                        f"{name}: has {size} values over {dim}, another one has {self.sizes[str(dim)]}"
                    )
            self._coords |= {str(k): c for k, c in x.coords.items()}
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
        items = equations.operations.items
        self._needed = {
            equations.arguments[equations.place(each.entry)].name for each in items if each.kind == ARGUMENT
        }
        self._bounds: list[tuple[str, Any]] = []
        self._arguments = [self._flat(v, given.get(v.name), base[v.name]) for v in equations.arguments]

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
        values = np.asarray(x.values, float)
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
        """The values over the outer and the inner dimensions, each flat, or of length 1 where they do not vary."""
        dims = set(map(str, x.dims))
        sides = [side if dims & set(side) else [] for side in (self._outer, self._inner)]
        order = [d for side in sides for d in side]
        full = x.expand_dims({d: self.sizes[d] for d in order if d not in dims}).transpose(*order)
        shape = [math.prod(self.sizes[d] for d in side) for side in sides]
        return np.ascontiguousarray(np.broadcast_to(full.values, full.shape), float).reshape(shape)

    def memory(self, reductions: Reductions, earlier: xr.Dataset | None) -> Memory:
        """New memory for the results, or that of an `earlier` result.

        Raises
        ------
        InputError
            where the earlier result has no memory for these results.
        """
        shape = self.size[:1] if reductions else self.size
        columns = self._columns(reductions)
        if earlier is None:
            return Memory(aligned((len(columns), *shape)), np.zeros(shape, np.int16))
        dims = self._dims(reductions)
        results = []
        for name in (*(each.name for each in columns), "reason"):
            x = earlier.variables.get(name)
            kind = np.int16 if name == "reason" else np.float64
            if x is None or x.dims != tuple(dims) or x.shape != tuple(self.sizes[d] for d in dims):
                over = ", ".join(f"{d}: {self.sizes[d]}" for d in dims) or "one state"
                raise InputError(
                    f"out: has no {name} over ({over}); give the result of a call like this one, or none"
                )
            values = x.values
            if values.dtype != kind or not (values.flags.c_contiguous and values.flags.writeable):
                raise InputError(
                    f"out: {name} is no array that can be filled; give the result of a call, unchanged"
                )
            results.append(values.reshape(shape))
        reason = results.pop()
        reason[...] = 0
        return Memory(results, reason)

    def compute(self, memory: Memory, engine: str, reductions: Reductions, workers: int) -> None:
        """Fill the memory with results and reasons."""
        own, (outer, inner) = self._equations, self.size
        if not outer:
            return
        entries = self._entries()
        if engine == "native" and (call := self._native(entries, reductions)) is not None:
            columns = [np.broadcast_to(entries[e], (len(entries[e]), inner)) for e in call.columns]
            call(
                [entries[e][:, 0].copy() for e in call.inputs],
                [np.ascontiguousarray(c) for c in columns],
                memory.results,
                memory.reason,
                self.size,
                workers,
            )
        else:
            states = memory
            if reductions:
                states = Memory(
                    np.empty((len(own.results), outer, inner)), np.zeros((outer, inner), np.int16)
                )
            fill = arrays.by_jax if engine == "jax" else arrays.by_numpy
            fill(own.operations, entries, states.results, states.reason, own.not_finite)
            if reductions:
                with np.errstate(invalid="ignore"):
                    for to, (place, name) in zip(memory.results, reductions, strict=True):
                        to[...] = REDUCTIONS[name].of_array(states.results[place])
                memory.reason[...] = np.max(states.reason, axis=1)
        self._refuse(memory)

    def _entries(self) -> dict[tuple[int, int], Any]:
        sizes = self._equations.sizes
        entries = [(kind, k) for kind, size in enumerate(sizes) for k in range(size)]
        return dict(zip(entries, self._arguments, strict=True))

    def _native(self, entries: Mapping[tuple[int, int], Any], reductions: Reductions) -> Any:
        varying = tuple(entry for entry, x in entries.items() if x.shape[1] > 1)
        try:
            kernel = native_kernel(self._equations, varying, reductions)
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
            bad: Any = np.broadcast_to(self._shaped(outside).astype(bool), self.size)
            bad = bad.any(axis=1) if memory.reason.ndim == 1 else bad
            memory.reason[bad] = self._equations.not_finite + 1 + k
            for x in memory.results:
                x[bad] = np.nan

    @property
    def reasons(self) -> list[StateReason]:
        """The reasons by their codes."""
        bounds = {v.name: v.quantity.allowed_range for v in self._equations.arguments}
        outside = (StateReason(ReasonKind.BOUNDS, name, bounds[name]) for name, _ in self._bounds)
        return [*reasons_of(self._equations.model), *outside]

    def _dims(self, reductions: Reductions) -> list[str]:
        """The dimensions of the results."""
        return self.dims[:-1] if reductions else self.dims

    def _columns(self, reductions: Reductions) -> Sequence[Result]:
        """Name, unit and description of each column."""
        results = self._equations.results
        if not reductions:
            return results
        return [
            Result(
                f"{name}({results[k].name})",
                results[k].unit,
                f"{REDUCTIONS[name].words}, {results[k].description}",
            )
            for k, name in reductions
        ]

    def dataset(self, memory: Memory, reductions: Reductions) -> xr.Dataset:
        """The results with names, units and coordinates."""
        import xarray as xr

        dims = self._dims(reductions)
        shape = [self.sizes[d] for d in dims]
        variables = {
            each.name: (dims, x.reshape(shape), {"units": each.unit, "long_name": each.description})
            for each, x in zip(self._columns(reductions), memory.results, strict=True)
        }
        flags: dict[str, Any] = {
            "flag_values": list(range(len(self.reasons))),
            "reasons": [str(reason) for reason in self.reasons],
            "subjects": [reason.subject for reason in self.reasons],
            "long_name": "reason for which there is no result",
        }
        variables["reason"] = (dims, memory.reason.reshape(shape), flags)
        coords = {name: c for name, c in self._coords.items() if set(map(str, c.dims)) <= set(dims)}
        return xr.Dataset(variables, coords)


def _array(variable: Variable, x: Any) -> xr.DataArray:
    """The values of an argument as a DataArray in the declared unit; over its own dimension they are coordinates."""
    import xarray as xr

    if isinstance(x, xr.DataArray):
        unit = x.attrs.get("units")
        if unit is not None and unit != variable.unit:
            try:
                factor, offset = scale(str(unit), variable.unit, variable.kind)
            except ValueError as error:
                raise InputError(f"{variable.name} in {unit}: {error}") from error
            x = x * factor + offset
        return _array(variable, x.values) if x.dims == (variable.name,) else x
    try:
        # numpy takes None for a number that is not finite
        values = np.asarray(_in_unit(variable, x) if isinstance(x, str | None) else x, float)
    except (TypeError, ValueError):
        words = f"must be a number in {variable.unit}, a text with a unit, an array or a DataArray"
        raise InputError(f"{variable.name} = {shown(x)}: {words}") from None
    if values.ndim > 1:
        raise InputError(f"{variable.name}: has {values.ndim} dimensions; give them names, in a DataArray")
    attributes = {"units": variable.unit, "long_name": variable.description}
    coords = {variable.name: (variable.name, values, attributes)} if values.ndim else {}
    return xr.DataArray(values, coords, [variable.name] if values.ndim else [])


def _in_unit(variable: Variable, text: str | None) -> float:
    """The number of a text such as "150 mm", in the declared unit; a ValueError for a text that is none."""
    parts = None if text is None else split(text)
    if parts is None:
        raise ValueError(text)
    number, unit = parts
    return convert(number, unit, variable.unit, variable.kind) if unit else number
