"""The experiments of a certified FMU: what the equations in Python ask, and how far the FMU is from that here.

- The *reference experiment*, which every FMU of this package has: all inputs move, and are set every 40 ms; its
  results come from the equations in Python under CVODES.
- *Points*: states at the start with varied parameters and inputs; the outputs come from the equations in Python.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...core.engines import MATH
from ...core.errors import InputError
from ...core.model import Model
from ...fmu.description import Interface
from ...fmu.reference import INPUTS, READ, REFERENCE, ROWS, STEP, STEPPED, excitation, reference_tables
from .runs import TimeTable, UnpackedFmu, simulated

POINTS, SPREADS = 12, (0.05, 0.01, 0.002)
"""Number of points, and ranges of the factors of their parameters about 1: the first that makes a machine counts."""
_ANGLE = math.pi * (3.0 - math.sqrt(5.0))
"""Angle of the crank from a point to the next [rad]: by the golden angle, points spread over the whole turn."""
Tables = tuple[TimeTable, ...]
"""Inputs, and outputs before and after the inputs are set."""


def tolerance(interface: Interface | None) -> float:
    """The largest deviation of an FMU of this model, or of an unknown one, over the size of the column."""
    return 1e-5 if interface is None or interface.states else 1e-9


class StatePoint(NamedTuple):
    """Parameters and inputs of a state at the start, and the outputs there."""

    start: dict[str, float]
    outputs: dict[str, float]


class Experiments(NamedTuple):
    """What is asked of an FMU: the tables of the reference experiment, None if it has none; and points, none of an
    unknown model."""

    reference: Tables | None
    points: Sequence[StatePoint] = ()


def by_equations(interface: Interface) -> Experiments:
    """The experiments of a model.

    Raises
    ------
    ModuleNotFoundError
        without casadi, for models with states or with a torque as input.
    """
    reference = None
    with contextlib.suppress(ArithmeticError, ValueError):
        tables = reference_tables(interface, traced=False)
        reference = tuple(_time_table(*tables[end]) for end in (INPUTS, STEPPED, READ))
    return Experiments(reference, chosen_points(interface))


def _time_table(head: Sequence[str], rows: Sequence[Sequence[float]]) -> TimeTable:
    values = np.array(rows, float)
    return TimeTable(tuple(head[1:]), values[:, 0], values[:, 1:])


def tables_in(fmu: UnpackedFmu) -> Tables | None:
    """The tables of the reference experiment in an FMU; None if it has none.

    Raises
    ------
    InputError
        for files that are no tables of variables of the FMU over the time of the experiment.
    """
    names = [f"{REFERENCE}/{fmu.name}_{end}.csv" for end in (INPUTS, STEPPED, READ)]
    if not all((fmu.folder / name).is_file() for name in names):
        return None
    tables = tuple(fmu.table(name) for name in names)
    for name, table in zip(names, tables, strict=True):
        if table.time.shape != (ROWS,) or not np.allclose(table.time, STEP * np.arange(ROWS)):
            raise InputError(f"{name}: must have {ROWS} rows, one in {STEP:g} s from 0 s on")
    return tables


class Deviation(NamedTuple):
    """The largest deviation of a run from its results, over the size of its column `name`."""

    value: float
    name: str

    def sentence(self, limit: float) -> str:
        """The deviation and its limit."""
        most = (
            f"largest deviation {self.value:.2g} of the size of {self.name}" if self.value else "no deviation"
        )
        return f"{most}, allowed are {limit:g}"


def deviation(table: TimeTable, wanted: TimeTable, fmu: UnpackedFmu) -> Deviation:
    """The largest deviation of a table from the wanted one, over the peak of a column, at least a thousandth of the
    nominal size of its variable; infinite if a number is none, and for other columns or times."""
    if table.names != wanted.names or table.values.shape != wanted.values.shape:
        return Deviation(math.inf, "the columns or rows")
    if not np.allclose(table.time, wanted.time, rtol=0.0, atol=1e-9):
        return Deviation(math.inf, "the time")
    sizes = {
        name: max(float(np.max(np.abs(column))), 1e-3 * fmu.variables[name].nominal)
        for name, column in zip(wanted.names, wanted.values.T, strict=True)
    }
    gaps = np.max(np.abs(table.values - wanted.values), axis=0)
    return _largest(dict(zip(wanted.names, gaps, strict=True)), sizes)


def _largest(gaps: Mapping[str, float], sizes: Mapping[str, float]) -> Deviation:
    """The largest gap over the size of its variable; infinite for one that is no number."""
    shares = {name: float(gap / sizes[name]) for name, gap in gaps.items()}
    deviations = (Deviation(x if math.isfinite(x) else math.inf, name) for name, x in shares.items())
    return max(deviations, default=Deviation(0.0, ""))


def table_gap(one: Tables | None, wanted: Tables | None, fmu: UnpackedFmu) -> Deviation:
    """The largest deviation of the tables of one reference experiment from the wanted tables."""
    if one is None or wanted is None:
        return Deviation(0.0 if one is wanted else math.inf, "a reference experiment that one of both lacks")
    return max(deviation(table, other, fmu) for table, other in zip(one, wanted, strict=True))


def measured(fmu: UnpackedFmu, experiments: Experiments) -> dict[str, Deviation]:
    """Run the experiments; by their names, how far the FMU is from their results.

    Raises
    ------
    RunError
        if the FMU cannot run.
    """
    deviations = {}
    if experiments.reference:
        inputs, wanted, _ = experiments.reference
        run = simulated(fmu, dict(zip(inputs.names, inputs.values[0], strict=True)), wanted.names, inputs)
        deviations["reference experiment"] = deviation(run, wanted, fmu)
    if experiments.points:
        deviations["points"] = max(_at_point(fmu, point) for point in experiments.points)
    return deviations


def _at_point(fmu: UnpackedFmu, point: StatePoint) -> Deviation:
    """The deviation at a point; each output is compared at its own size, at least that of its variable."""
    run = simulated(fmu, point.start, list(point.outputs))
    gaps = dict(zip(run.names, np.abs(run.values[0] - list(point.outputs.values())), strict=True))
    sizes = {name: max(abs(x), fmu.variables[name].nominal) for name, x in point.outputs.items()}
    return _largest(gaps, sizes)


# -- points


def chosen_points(interface: Interface) -> list[StatePoint]:
    """The points of the experiments with their outputs by the equations in Python; always the same. The parameters
    lie about their start values, at the first point on them, and the crank stands at another angle at each point. If
    no machine has the parameters of a point, they come closer to the start values, by the `SPREADS`; a point without
    a machine even at the start values is left out."""
    rng = np.random.default_rng(20)
    course, gear = excitation(interface), _gear(interface)
    parameters = interface.signals_of("parameter")
    start = {s.name: float(s.start or 0.0) for s in parameters}
    quantities = {s.name: s.variable.quantity for s in interface.signals}
    real = [s.name for s in parameters if s.variable.type == "Real" and s.start and "solver." not in s.name]
    # parameters such as motor.phi_start that are 0
    motion_starts = {name: name.rpartition(".")[2] for name, x in start.items() if x == 0.0}
    points = []
    for k in range(POINTS):
        inputs = {name: float(x) for name, x in course(0.08 * k).items()}
        inputs |= _turned_shafts(interface, inputs, gear, k)
        motion = {"phi_start": gear * _ANGLE * k, "w_start": gear * 0.2 * k}
        moved = {name: motion[last] for name, last in motion_starts.items() if last in motion}
        shifts = {name: 2.0 * rng.random() - 1.0 for name in real}
        for spread in (*SPREADS, 0.0) if k else (0.0,):
            values = start | moved | {name: start[name] * (1.0 + spread * x) for name, x in shifts.items()}
            values = {name: quantities[name].within_bounds(x) for name, x in values.items()}
            if (outputs := outputs_at(interface.model, values, inputs)) is not None:
                points.append(StatePoint(values | inputs, outputs))
                break
    return points


def _gear(interface: Interface) -> float:
    """The turns of the shaft in a turn of the crank, by the start values; 1 for a model without a gear."""
    ratios = [s.start for s in interface.signals_of("parameter") if s.name.rpartition(".")[2] == "ratio"]
    return float(ratios[0] or 1.0) if ratios else 1.0


def _turned_shafts(
    interface: Interface, inputs: Mapping[str, float], gear: float, k: int
) -> dict[str, float]:
    """Angle, speed and acceleration of each shaft among the `inputs` of the point `k`, for shafts whose angle has no
    bounds. The inputs count as those of the crank: the shaft turns `gear` times as far and as fast, and each point is
    turned on by `_ANGLE` of the crank."""
    quantities = {s.name: s.variable.quantity for s in interface.signals_of("input")}
    turned = dict[str, float]()
    for terminal in interface.model.terminals:
        phi, w, a = (terminal.members.get(key, "") for key in ("phi", "w", "a"))
        if {phi, w, a} <= inputs.keys() and not math.isfinite(quantities[phi].high - quantities[phi].low):
            turned[phi] = gear * (inputs[phi] + _ANGLE * k)
            turned |= {name: gear * inputs[name] for name in (w, a)}
    return turned


def outputs_at(
    model: Model, parameters: Mapping[str, float], inputs: Mapping[str, float]
) -> dict[str, float] | None:
    """The states and outputs at the start by the equations in Python; None if there is no machine."""
    try:
        p = model.check(model.parameter_layout.from_names(dict(parameters)))
        u = model.input_layout.from_names(dict(inputs))
        x = model.begin(p, u) if model.state_layout else None
        parts = model.evaluate(MATH, p, u, x)
    except (InputError, ArithmeticError, ValueError):
        return None
    values = model.state_layout.by_name(x) if model.state_layout else {}
    for part, out in zip(model.parts, parts, strict=True):
        values |= part.layout.by_name(out)
    numbers = {name: float(value) for name, value in values.items()}
    return numbers if all(map(math.isfinite, numbers.values())) else None
