"""The linear model of any model at a point: A, B, C, D by exact derivatives of the traced equations.

    dx/dt = dx0 + A (x - x0) + B (u - u0)        y = y0 + C (x - x0) + D (u - u0)

A compiled system (`chainunit.system.compiled`) is a model, too. The equations are differentiated in
CasADi's symbols (`chainunit.core.symbolic_trace`), from which the C code of FMUs comes: none is a difference.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from ..core.engines import MATH
from ..core.errors import InputError, near_name, shown
from ..core.model import Model
from ..core.quantities import Variable, quotient
from ..core.symbolic_trace import outputs_of, trace
from ..reading.results import GIVEN, OWN, InUnit, derived, part, result
from .poles import Pole, poles_of

NEAR = 1e-3
"""Distance over which the slopes are compared, as a share of the size of a state or input."""
AT = 1e-9
"""The same for a kink at the point itself."""
CHANGE = 0.05
"""Change of a slope over that distance, as a share of its largest value, from which it is told."""
_SHARP = 0.2
"""Share of this change that is made in the nearest tenth of the distance, from which it is told: of the slope of a
square it is 0.1, of that of a cube 0.01, of a kink 1."""
_SLIGHT = 1e-6
"""Effect of a slope over the size of its column, as a share of the size of its row, below which it is none."""


@result
class LinearSignal:
    """An input or output of a linear model, and its value at the point."""

    name: str = part("its name in the model")
    unit: str = part("its unit")
    description: str = part("its description")
    value: float = part("its value at the point", unit=OWN)


@result
class LinearState(LinearSignal):
    """A state of a linear model, its value at the point, and its time derivative there."""

    rate: InUnit = part("its time derivative at the point; not 0 where the point is no rest")


@result
class Bend:
    """A place near the point where the slopes change so much that the linear model holds only nearer than that."""

    by: str = part("the state or input that moves")
    kink: bool = part(
        "whether the slopes jump at the point itself, as at the end of a limit: the matrices have the slopes of one "
        "side; else they bend within the distance, as friction does near rest"
    )
    within: InUnit = part("distance from the point, to either side, between which the slopes are compared")
    rows: tuple[str, ...] = part("the states, by der(..), and outputs whose slopes change", unit=GIVEN)
    change: float = part(
        "largest change of a slope over its largest value within the distance",
        unit="1",
    )


@result
class LinearModel:
    """The linear model of a model at a point. Its outputs are the states and the outputs of the model, as its FMU has
    them, without counts and switches."""

    title: str = part("title of the study or the machine, or the name of the model")
    model: str = part("name of the model")
    description: str = part("description of the model")
    at: str = part("the point in words")
    states: tuple[LinearState, ...] = part("the states x")
    inputs: tuple[LinearSignal, ...] = part("the inputs u")
    outputs: tuple[LinearSignal, ...] = part("the outputs y")
    A: np.ndarray
    """derivatives of dx/dt by x, shape (states, states); `unit_of` gives the units of the entries"""
    B: np.ndarray
    """derivatives of dx/dt by u, shape (states, inputs)"""
    C: np.ndarray
    """derivatives of y by x, shape (outputs, states)"""
    D: np.ndarray
    """derivatives of y by u, shape (outputs, inputs)"""
    bends: tuple[Bend, ...] = part("places near the point where the slopes change, none where all is smooth")

    @derived(GIVEN)
    def matrices(self) -> dict[str, Any]:
        """A, B, C and D as lists of rows, in the order of states, inputs and outputs; null for a slope that is not
        defined at the point. The unit of an entry is that of its row by that of its column; a row of A and B is in
        the unit of the state per second."""
        return {name: _rows(getattr(self, name)) for name in "ABCD"}

    @derived()
    def poles(self) -> tuple[Pole, ...]:
        """The poles: eigenvalues of A, the slowest first; none where a slope in A is not defined."""
        if not np.isfinite(self.A).all():
            return ()
        return poles_of(self.A, [state.name for state in self.states])

    def unit_of(self, matrix: str, row: int, column: int) -> str:
        """The unit of an entry of the `matrix` "A", "B", "C" or "D"."""
        if matrix in "AB":
            above = quotient(self.states[row].unit, "s")
        else:
            above = self.outputs[row].unit
        below = (self.states if matrix in "AC" else self.inputs)[column].unit
        return quotient(above, below)

    def response(self, to: str, of: str, frequency: Any) -> np.ndarray:
        """The frequency response of an output to an input.

        Parameters
        ----------
        to, of : names of the input and of the output
        frequency : frequencies [rad/s], shape (n,)

        Returns
        -------
        the complex gain C (jw - A)^-1 B + D in the unit of the output by that of the input, shape (n,); NaN at a
        frequency that is an undamped pole.

        Raises
        ------
        InputError
            for a name that is no input or no output, and where a slope is not defined at the point.
        """
        column, row = place("input", to, self.inputs), place("output", of, self.outputs)
        self._refuse_undefined()
        b, c, d = self.B[:, column], self.C[row], self.D[row, column]
        one, values = np.eye(len(self.states)), []
        for w in np.asarray(frequency, float):
            try:
                values.append(c @ np.linalg.solve(1j * w * one - self.A, b) + d)
            except np.linalg.LinAlgError:
                values.append(complex(np.nan, np.nan))
        return np.array(values, complex)

    def state_space(self) -> Any:
        """The linear model as python-control's ``StateSpace``, whose states, inputs and outputs have the names of the
        model with _ in place of each point, as python-control takes no points in names: ``motor_w`` is motor.w.

        Its signals count from the point: they are x - x0, u - u0 and y - y0.

        Raises
        ------
        InputError
            where a slope is not defined at the point.
        """
        import control

        self._refuse_undefined()
        kinds = {"states": self.states, "inputs": self.inputs, "outputs": self.outputs}
        names = {kind: labels([signal.name for signal in signals]) for kind, signals in kinds.items()}
        return control.ss(self.A, self.B, self.C, self.D, name=self.model, **names)

    def _refuse_undefined(self) -> None:
        """Refuse a linear model with a derivative that is not defined."""
        for name in "ABCD":
            for row, column in np.argwhere(~np.isfinite(getattr(self, name)))[:1]:
                row_name = (self.states if name in "AB" else self.outputs)[row].name
                by = (self.states if name in "AC" else self.inputs)[column].name
                raise InputError(
                    f"{self.model}: the derivative of "
                    f"{'der(' + row_name + ')' if name in 'AB' else row_name} by {by} "
                    "is not defined at this point, a corner of the equations; take a point beside it"
                )


def _rows(matrix: Any) -> list[list[float | None]]:
    return [[float(x) if np.isfinite(x) else None for x in row] for row in matrix]


def labels(names: Sequence[str]) -> list[str]:
    """The names with _ in place of points, each of them another one."""
    taken: list[str] = []
    for name in names:
        label = name.replace(".", "_")
        while label in taken:
            label += "_"
        taken.append(label)
    return taken


def place(kind: str, name: str, signals: Sequence[LinearSignal | Variable]) -> int:
    """The place of the `kind` of signal with that name.

    Raises
    ------
    InputError
        where there is none; it names the signals that there are.
    """
    names = [signal.name for signal in signals]
    if name not in names:
        there = f"there are {', '.join(names)}" if len(names) <= _MOST else f"there are {len(names)}"
        raise InputError(f"{shown(name)}: no such {kind}{near_name(name, names) or ';'} {there}")
    return names.index(name)


_MOST = 60


def linearize(
    model: Model,
    parameters: Any = None,
    inputs: Mapping[str, float] | None = None,
    states: Mapping[str, float] | None = None,
    *,
    at: str = "",
    title: str = "",
) -> LinearModel:
    """The linear model of `model` at a point.

    Parameters
    ----------
    parameters : its `Parameters`, or values by name; all others have their start values
    inputs : values by name; all others have their start values
    states : values by name; all others have the values of the model's own start with these inputs
    at : the point in words
    title : the title of the study or the machine; by default the name of the model

    Raises
    ------
    KeyError
        for a name that is not declared.
    InputError, GeometryError
        for parameters that are refused, and for a point at which the model has no finite values.
    """
    layout = model.parameter_layout
    if not isinstance(parameters, model.Parameters):
        parameters = layout.from_names(dict(parameters or {}))
    p = model.check(parameters)
    u = model.input_layout.from_names(dict(inputs or {}))
    x = _states(model, p, u, states or {})
    if model.derived_count and not hasattr(p, "derived"):
        p = model.with_derived(MATH, p)
    derivatives, n = _derivatives(model), len(x)
    of_inputs = np.array(model.input_layout.values(u), float)
    z = np.array([*x, *of_inputs[derivatives.inputs]], float)
    fixed = (
        np.delete(of_inputs, derivatives.inputs),
        layout.values(p),
        p.derived if model.derived_count else [],
    )

    def at_columns(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        values, slopes = derivatives.function(z, *fixed)
        return np.array(values, float).ravel(), np.array(slopes, float).reshape(-1, len(z))

    values, slopes = at_columns(z)
    for k in np.flatnonzero(~np.isfinite(values))[:1]:
        raise InputError(
            f"{model.name}: {derivatives.row_names[k]} is not a finite number at this point; take another point"
        )
    rows = [
        LinearSignal(v.name, v.unit, v.description, float(y))
        for v, y in zip(derivatives.rows, values, strict=True)
    ]
    columns = [
        LinearSignal(v.name, v.unit, v.description, float(y))
        for v, y in zip(derivatives.columns, z, strict=True)
    ]
    return LinearModel(
        title or model.name,
        model.name,
        model.description,
        at,
        tuple(
            LinearState(s.name, s.unit, s.description, s.value, InUnit(r.value, quotient(s.unit, "s")))
            for s, r in zip(columns[:n], rows[:n], strict=True)
        ),
        tuple(columns[n:]),
        tuple(rows[n:]),
        slopes[:n, :n],
        slopes[:n, n:],
        slopes[n:, :n],
        slopes[n:, n:],
        tuple(_bends(derivatives, z, values, slopes, lambda z: at_columns(z)[1])),
    )


def _states(model: Model, p: Any, u: Any, states: Mapping[str, float]) -> list[float]:
    """The states in the declared order; a state that is not given has its value at the start of the model."""
    layout = model.state_layout
    if layout is None:
        if states:
            raise KeyError(next(iter(states)))
        return []
    if set(states) == set(layout.names):
        return [float(states[name]) for name in layout.names]
    return [float(x) for x in layout.values(layout.from_names(dict(states), model.begin(p, u)))]


class _Derivatives(NamedTuple):
    """The equations of a model with their derivatives. Rows are the derivatives of the states, the states and the
    outputs; columns are the states and the inputs."""

    rows: tuple[Variable, ...]
    row_names: list[str]
    columns: tuple[Variable, ...]
    inputs: list[int]
    """places of the inputs that are columns: a count or a switch has no slope"""
    function: Any
    """casadi function of columns, other inputs, parameters and derived values: values and slopes of the rows"""


@lru_cache(maxsize=8)
def _derivatives(model: Model) -> _Derivatives:
    """The equations of a model with their derivatives, by its symbols; counts and switches are no rows or columns."""
    import casadi

    traced = trace(model)
    p, u, x, derived_values = traced.symbols
    states = model.state_layout.variables if model.state_layout else ()
    of_states, of_inputs = (casadi.vertsplit(vector) if vector.numel() else [] for vector in (x, u))
    outputs, inputs = outputs_of(model), model.input_layout.variables
    kept = [k for k, v in enumerate(outputs) if v.type == "Real"]
    rows = (*states, *states, *(outputs[k] for k in kept))
    chosen = [k for k, v in enumerate(inputs) if v.type == "Real"]
    of_rows = [*traced.derivatives, *of_states, *(traced.outputs[k] for k in kept)]
    values = casadi.vertcat(*map(casadi.SX, of_rows))
    columns = casadi.vertcat(*of_states, *(of_inputs[k] for k in chosen))
    others = casadi.vertcat(*(symbol for k, symbol in enumerate(of_inputs) if k not in chosen))
    results = [casadi.densify(values), casadi.densify(casadi.jacobian(values, columns))]
    return _Derivatives(
        rows,
        [f"der({v.name})" if k < len(states) else v.name for k, v in enumerate(rows)],
        (*states, *(inputs[k] for k in chosen)),
        chosen,
        casadi.Function("rows", [columns, others, p, derived_values], results, {"cse": True}),
    )


def _bends(
    derivatives: _Derivatives,
    z: np.ndarray,
    values: np.ndarray,
    slopes: np.ndarray,
    slopes_at: Callable[[np.ndarray], np.ndarray],
) -> Iterator[Bend]:
    """By column, the rows that bend within a small distance of the point: their slopes by the column change as those
    of no smooth power do, such as at the edge of a stop. A slope that is not defined there counts as a bend of its
    row, but has no size.

    Parameters
    ----------
    z : values of the columns, shape (columns,)
    values, slopes : of the rows at the point, shapes (rows,) and (rows, columns)
    slopes_at : the slopes at other values of the columns
    """
    columns, rows = derivatives.columns, derivatives.rows
    sizes = np.array([_size(v, value) for v, value in zip(columns, z, strict=True)])
    least = _SLIGHT * (np.array([[v.quantity.nominal or 1.0] for v in rows]) + np.abs(values)[:, None])
    defined = np.isfinite(slopes)

    def jump(column: int, distance: float) -> tuple[np.ndarray, np.ndarray]:
        """The largest change of each slope between the point and both sides, and the largest of the three, shape
        (rows, columns), both by the sizes of the columns."""
        step = distance * (np.arange(len(z)) == column)
        here, low, high = (
            np.where(defined, by * sizes, 0.0) for by in (slopes, slopes_at(z - step), slopes_at(z + step))
        )
        changes = np.abs([high - low, high - here, here - low])
        return np.max(changes, axis=0), np.max(np.abs([low, high, here]), axis=0)

    def bend(column: int, share: float) -> Bend | None:
        """The bend within this share of the size of a column; None without one."""
        v, distance = columns[column], float(share * sizes[column])
        with np.errstate(all="ignore"):
            change, most = jump(column, distance)
            # a smooth function has a small change, or one that shrinks with the distance
            is_small = change <= CHANGE * most + least
            bent = ~is_small & ~(jump(column, 0.1 * distance)[0] <= _SHARP * change)
        bent_rows = bent.any(axis=1) | ~defined[:, column]
        if not bent_rows.any():
            return None
        largest = max((float(x) for x in change[bent] / most[bent] if np.isfinite(x)), default=1.0)
        names = tuple(name for name, is_bent in zip(derivatives.row_names, bent_rows, strict=True) if is_bent)
        return Bend(v.name, share == AT, InUnit(distance, v.unit), names, largest)

    for column in range(len(columns)):
        yield from filter(None, [bend(column, AT) or bend(column, NEAR)])


def _size(v: Variable, value: float) -> float:
    """The size of a state or input: its value, or its nominal one if that is larger; of an angle, which may have
    many turns, one turn at most."""
    size = max(v.quantity.nominal or 1.0, abs(value))
    return min(size, 2.0 * np.pi) if v.unit == "rad" else size
