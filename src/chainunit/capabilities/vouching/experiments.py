"""The experiments that an FMU carries: what they must give, and how far it is from that on this machine.

Three experiments are of a certified FMU:

- the *reference experiment*, which every FMU of this package has: all inputs move, and are set every 40 ms;
  its results come from the equations in Python under CVODES;
- the *smooth experiment*: a shaft or ram that is an input moves smoothly, all other inputs stay. The FMU itself runs
  it at the steps h, h/2 and h/4, from which the error of the step and its order follow, at h/4 the energy balance;
- *points*: states at the start with varied parameters and inputs; the outputs come from the equations in Python.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from ...core.engines import MATH
from ...core.errors import InputError
from ...core.model import Model
from ...fmu.description import Interface
from ...fmu.reference import INPUTS, READ, REFERENCE, ROWS, STEPPED, excitation
from ...fmu.reference import STEP as REFERENCE_STEP
from ...fmu.reference import reference_tables as equation_tables
from .rerun import TimeTable, UnpackedFmu, deviation, sizes, slave, stepped

STEP, END = 0.004, 1.0
"""Largest step and end of the smooth experiment [s]."""
HALVINGS = 2
_EVERY = 40
"""One of so many rows of the smooth experiment is kept as a result."""
TOLERANCE = 1e-5
"""Allowed deviation from reference results of a model with states, over the size of the column."""
TOLERANCE_WITHOUT_STATES = 1e-9
_ROUNDING = 1e-11
"""Differences of runs below this are of rounding and have no order."""
MISSING, POWER_GAP, STEP_ERROR = 1e-2, 1e-6, 1e-2
"""Largest share of the energy that may be missing, of which a part is the interpolation between steps, largest gap of
the power balance, and largest error of the smallest step, with which an FMU is certified and holds."""
POINTS, SPREAD = 12, 0.05
"""Number of points, and range of the factors of their parameters about 1."""
_ANGLE = math.pi * (3.0 - math.sqrt(5.0))
"""Angle of the crank from a point to the next [rad]: by the golden angle, points spread over the whole turn."""


class Deviation(NamedTuple):
    """The largest deviation of a run from its results, over the size of its column `of`."""

    value: float
    of: str


def allowed(interface: Interface | None) -> float:
    """The allowed deviation of an FMU of this model, or of an unknown one."""
    return TOLERANCE if interface is None or interface.states else TOLERANCE_WITHOUT_STATES


class Experiments(NamedTuple):
    """What the equations in Python ask of an FMU with its start values: the tables of the reference experiment (None
    where it has none), the inputs of the smooth experiment, and the points."""

    reference: tuple[TimeTable, TimeTable, TimeTable] | None
    smooth: TimeTable | None
    points: list[StatePoint]


def by_equations(interface: Interface) -> Experiments:
    """The experiments of a model.

    Raises
    ------
    ModuleNotFoundError
        without casadi, for models with states or with a torque as input.
    """
    try:
        tables = equation_tables(interface)
    except (ArithmeticError, ValueError):
        reference = None
    else:
        given, before, behind = (_time_table(*tables[end]) for end in (INPUTS, STEPPED, READ))
        reference = given, before, behind
    return Experiments(reference, smooth_inputs(interface), chosen_points(interface))


def _time_table(head: Sequence[str], rows: Sequence[Sequence[float]]) -> TimeTable:
    values = np.array(rows, float)
    return TimeTable(tuple(head[1:]), values[:, 0], values[:, 1:])


def reference_tables(fmu: UnpackedFmu) -> tuple[TimeTable, TimeTable, TimeTable] | None:
    """Inputs, and outputs before and after the inputs are set, of the reference experiment; None where the FMU has
    none.

    Raises
    ------
    InputError
        for files that are no tables of variables of the FMU over the time of the experiment.
    """
    files = [f"{REFERENCE}/{fmu.name}_{end}.csv" for end in (INPUTS, STEPPED, READ)]
    texts = [fmu.file(name) for name in files]
    if None in texts:
        return None
    found = []
    for name, text in zip(files, texts, strict=True):
        try:
            own = fmu.table(text or b"")
        except InputError as error:
            raise InputError(f"{name}: {error}") from error
        if unknown := [each for each in own.names if each not in fmu.variables]:
            raise InputError(f"{name}: {unknown[0]}: is no variable of the FMU")
        if not covers(own, REFERENCE_STEP, ROWS):
            raise InputError(f"{name}: must have {ROWS} rows, one in {REFERENCE_STEP:g} s from 0 s on")
        found.append(own)
    return found[0], found[1], found[2]


def covers(given: TimeTable, step: float, rows: int) -> bool:
    """Whether a table has so many rows from the time 0 on, one in each step [s]."""
    return given.time.shape == (rows,) and bool(np.allclose(given.time, step * np.arange(rows), 0.0, 1e-9))


def rerun_reference(fmu: UnpackedFmu, tables: tuple[TimeTable, TimeTable, TimeTable]) -> Deviation:
    """The FMU on this machine against its reference results.

    Raises
    ------
    RunError
        where the FMU cannot run.
    """
    given, before, behind = tables
    got = stepped(fmu, given, before.names)
    return Deviation(
        *max(deviation(one, other, fmu) for one, other in zip(got, (before, behind), strict=True))
    )


# -- the smooth experiment


def smooth_inputs(interface: Interface) -> TimeTable:
    """The inputs of the smooth experiment, at its smallest step."""
    course = excitation(interface)
    names = [s.name for s in interface.signals_of("input")]
    gear = _gear(interface)
    count = round(END / STEP) * 2**HALVINGS
    time = np.linspace(0.0, END, count + 1)
    still = course(0.0)
    values = {name: np.full(len(time), still[name]) for name in names}
    for own in _drivers(interface.model):
        if set(own.values()) <= set(names):
            values |= dict(zip(own.values(), _motion(course, own, time, gear), strict=True))
    columns = np.array([values[name] for name in names], float).T
    return TimeTable(tuple(names), time, columns.reshape(len(time), len(names)))


def _drivers(model: Model) -> list[dict[str, str]]:
    """The names of way, speed and acceleration of each shaft or ram at a terminal of the model."""
    members = [terminal.members for terminal in model.terminals]
    return [{n: own[n] for n in ("phi", "w", "a")} for own in members if {"phi", "w", "a"} <= set(own)]


def _gear(interface: Interface) -> float:
    """The turns of the shaft in a turn of the crank, by the start values; 1 for a model without a gear."""
    ratios = [s.start for s in interface.signals_of("parameter") if s.name.rpartition(".")[2] == "ratio"]
    return float(ratios[0] or 1.0) if ratios else 1.0


def _motion(
    course: Callable[[float], Mapping[str, float]], own: Mapping[str, str], time: Any, gear: float
) -> list[Any]:
    """Way, speed and acceleration of a driver, each of shape (n,): those of the reference experiment where they fit
    each other, as those of a shaft do, so much faster that the crank behind the gear has them; else a swing over the
    same way."""
    rows = [course(float(t)) for t in time]
    phi, w, a = (np.array([row[own[n]] for row in rows]) for n in ("phi", "w", "a"))
    if np.allclose(np.gradient(phi, time)[1:-1], w[1:-1], rtol=0.0, atol=1e-3 * float(np.max(np.abs(w)))):
        return [gear * phi, gear * w, gear * a]
    middle, reach = 0.5 * (phi.max() + phi.min()), 0.5 * (phi.max() - phi.min())
    swing = reach * np.sin(2.0 * time)
    return [middle + swing, 2.0 * reach * np.cos(2.0 * time), -4.0 * swing]


class Convergence(NamedTuple):
    """Runs at the steps h, h/2 and h/4: the largest differences of the first two pairs, over the size of their
    column, the order that follows, and the estimated error of the run at the smallest step. The order is None where
    the step sets no error: the differences are of rounding, or do not shrink, as steps of the FMU inside a step set
    them."""

    steps: tuple[float, ...]
    differences: tuple[float, float]
    order: float | None
    error: float


def convergence(fmu: UnpackedFmu, given: TimeTable, outputs: Sequence[str]) -> tuple[Convergence, TimeTable]:
    """Run the smooth experiment at its three steps; also the outputs of the last run. Outputs are read once
    the inputs of their time are set.

    Raises
    ------
    RunError
        where the FMU cannot run.
    """
    runs = [stepped(fmu, given, outputs, every=2**k)[1] for k in reversed(range(HALVINGS + 1))]
    size = sizes(runs[-1], fmu)
    common = [run.values[:: 2**k] for k, run in enumerate(runs)]
    first, second = (
        float(np.max(np.abs(one - other) / size, initial=0.0)) for one, other in pairwise(common)
    )
    shrinks = second > _ROUNDING and first > 1.3 * second
    order = math.log2(first / second) if shrinks else None
    error = max(first, second) if order is None else second / (2.0**order - 1.0)
    steps = tuple(STEP / 2**k for k in range(HALVINGS + 1))
    return Convergence(steps, (first, second), order, error), runs[-1]


def with_shaft(fmu: UnpackedFmu, outputs: Sequence[str]) -> list[str]:
    """The outputs, and behind them torque and speed of a shaft, by which energy is balanced."""
    return [*outputs, *(n for n in ("tau", "w") if n in fmu.variables and n not in outputs)]


def kept(run: TimeTable, outputs: Sequence[str]) -> TimeTable:
    """What is kept of the smooth experiment as the results of these `outputs`, its first columns."""
    return TimeTable(tuple(outputs), run.time[::_EVERY], run.values[::_EVERY, : len(outputs)])


# -- the energy balance of a run


class EnergyBalance(NamedTuple):
    """The names of the outputs by which energy is balanced: what is given as an energy or as torque and speed, and by
    component the stored energies and the dissipated power."""

    supply: tuple[str, ...]
    stores: tuple[str, ...]
    losses: tuple[str, ...]


_STORES = ("kinetic_energy", "potential_energy")


def balance_of(names: Sequence[str]) -> EnergyBalance | None:
    """The energy balance that variables of these names allow: of a machine by the torque and speed of its shaft, of a
    system by the energy that its motor has given to its load; None where they allow none."""
    there = set(names)
    losses = [n for n in names if n.rpartition(".")[2] == "dissipated_power"]
    parts = [n.removesuffix("dissipated_power") for n in losses]
    parts = [p for p in parts if p != "model." and all(p + each in there for each in _STORES)]
    if not parts:
        return None
    stores = tuple(p + each for p in parts for each in _STORES)
    own = tuple(p + "dissipated_power" for p in parts)
    if parts == [""] and {"tau", "w"} <= there:
        onward = ("load_energy",) if "load_energy" in there else ()
        return EnergyBalance(("tau", "w"), (*stores, *onward), own)
    if "" not in parts and "motor.load_energy" in there:
        return EnergyBalance(("motor.load_energy",), stores, own)
    return None


def energy_residual(run: TimeTable, balance: EnergyBalance) -> tuple[float, float]:
    """The largest missing energy of a run, and the energy that went to and fro [J]."""
    from scipy.integrate import cumulative_simpson

    column = dict(zip(run.names, run.values.T, strict=True))
    lost = cumulative_simpson(sum(column[n] for n in balance.losses), x=run.time, initial=0.0)
    if len(balance.supply) == 2:
        power = column[balance.supply[0]] * column[balance.supply[1]]
        given = cumulative_simpson(power, x=run.time, initial=0.0)
        flow = float(np.trapezoid(np.abs(power), run.time))
    else:
        given = column[balance.supply[0]] - column[balance.supply[0]][0]
        flow = float(np.sum(np.abs(np.diff(given))))
    stored = sum(column[n] for n in balance.stores)
    gap = given - lost - (stored - stored[0])
    return float(np.max(np.abs(gap))), max(flow, float(np.max(np.abs(stored - stored[0]))))


# -- points


class StatePoint(NamedTuple):
    """Parameters and inputs of a state at the start, and the outputs there."""

    given: dict[str, float]
    outputs: dict[str, float]


def chosen_points(interface: Interface) -> list[StatePoint]:
    """Points about the start values with the outputs by the equations in Python; always the same. At the first one
    the parameters have their start values. The crank stands at another angle of its turn at each point. Parameters
    with which the model does not work are left as they are."""
    rng = np.random.default_rng(20)
    course, gear = excitation(interface), _gear(interface)
    parameters = interface.signals_of("parameter")
    start = {s.name: float(s.start or 0.0) for s in parameters}
    at_rest = [n for n, x in start.items() if x == 0.0 and n.rpartition(".")[2] in ("phi_start", "w_start")]
    real = [s for s in parameters if s.variable.type == "Real" and s.start and s.name.find("solver.") < 0]
    points = []
    for k in range(POINTS):
        inputs = _turned(interface, {name: float(x) for name, x in course(0.08 * k).items()}, gear, k)
        values = dict(start)
        # all at once; where that makes no machine, one by one
        factors = {s.name: float(1.0 + SPREAD * (2.0 * rng.random() - 1.0)) for s in real} if k else {}
        if k:
            at = {"phi_start": gear * _ANGLE * k, "w_start": gear * 0.2 * k}
            moved = {n: at[n.rpartition(".")[2]] for n in at_rest}
            start |= {n: _within(interface, n, x) for n, x in moved.items()}
            values = dict(start)
        for changes in ([factors], [{name: x} for name, x in factors.items()]):
            for change in changes:
                trial = values | {
                    name: _within(interface, name, start[name] * x) for name, x in change.items()
                }
                if outputs_at(interface.model, trial, inputs) is not None:
                    values = trial
            if values != start or not factors:
                break
        outputs = outputs_at(interface.model, values, inputs)
        if outputs is not None:
            points.append(StatePoint(values | inputs, outputs))
    return points


def _turned(interface: Interface, inputs: dict[str, float], gear: float, k: int) -> dict[str, float]:
    """The inputs of the point `k`, with each shaft that has no bounds so far on and so fast that the crank behind the
    gear stands at an angle of its own, and has the speed of the course."""
    quantities = {s.name: s.variable.quantity for s in interface.signals_of("input")}
    for own in _drivers(interface.model):
        if not set(own.values()) <= set(inputs):
            continue
        angle = quantities[own["phi"]]
        if not math.isfinite(angle.high - angle.low):
            inputs[own["phi"]] += _ANGLE * k
            inputs |= {name: gear * inputs[name] for name in own.values()}
    return inputs


def _within(interface: Interface, name: str, x: float) -> float:
    quantity = next(s.variable.quantity for s in interface.signals if s.name == name)
    return min(max(x, quantity.low), quantity.high)


def outputs_at(
    model: Model, parameters: Mapping[str, float], inputs: Mapping[str, float]
) -> dict[str, float] | None:
    """The states and outputs at the start by the equations in Python; None where there is no machine."""
    try:
        p = model.check(model.parameter_layout.from_names(dict(parameters)))
        u = model.input_layout.from_names(dict(inputs))
        x = model.begin(p, u) if model.state_layout else None
        parts = model.evaluate(MATH, p, u, x)
    except (InputError, ArithmeticError, ValueError):
        return None
    found = model.state_layout.by_name(x) if model.state_layout else {}
    for part, out in zip(model.parts, parts, strict=True):
        found |= part.layout.by_name(out)
    numbers = {name: float(value) for name, value in found.items()}
    return numbers if all(map(math.isfinite, numbers.values())) else None


def rerun_points(fmu: UnpackedFmu, points: Sequence[StatePoint]) -> Deviation:
    """The FMU on this machine against the outputs of the points; each is compared at its own size, at least that of
    its variable.

    Raises
    ------
    RunError
        where the FMU cannot run.
    """
    worst = Deviation(0.0, "")
    for point in points:
        with slave(fmu, point.given) as running:
            got = running.get(list(point.outputs))
        worst = max(worst, _largest(fmu, dict(zip(point.outputs, got, strict=True)), point.outputs))
    return worst


def recomputed(model: Model, points: Sequence[StatePoint]) -> list[StatePoint]:
    """The points with the outputs by the equations in Python on this machine, of which one without a machine has
    none."""
    layouts = (model.parameter_layout, model.input_layout)
    return [
        point._replace(outputs=outputs_at(model, *(_of(point, each.names) for each in layouts)) or {})
        for point in points
    ]


def point_gap(fmu: UnpackedFmu, stated: Sequence[StatePoint], wanted: Sequence[StatePoint]) -> Deviation:
    """The largest deviation of stated points, values and outputs, from the wanted ones."""
    if len(stated) != len(wanted):
        return Deviation(math.inf, "the number of points")
    pairs = [pair for one, other in zip(stated, wanted, strict=True) for pair in zip(one, other, strict=True)]
    worst = Deviation(0.0, "")
    for got, own in pairs:
        if got.keys() != own.keys():
            return Deviation(math.inf, "the names of a point")
        worst = max(worst, _largest(fmu, got, own))
    return worst


def _largest(fmu: UnpackedFmu, got: Mapping[str, float], wanted: Mapping[str, float]) -> Deviation:
    def gap(name: str) -> float:
        size = max(abs(wanted[name]), fmu.variables[name].nominal)
        value = abs(got.get(name, math.inf) - wanted[name]) / size
        return value if math.isfinite(value) else math.inf

    return max((Deviation(gap(name), name) for name in wanted), default=Deviation(0.0, ""))


def power_gap(interface: Interface, points: Sequence[StatePoint], balance: EnergyBalance) -> float | None:
    """The largest gap of the power balance at the points, by the second route: the rate of the stored energy is its
    exact derivative along the motion, which the torque does not use. Over the sum of the powers' sizes, at least a
    millionth of the largest one, as a point without torque has rounding alone; None for models whose supply is no
    torque."""
    import casadi

    if len(balance.supply) != 2:
        return None
    model, trace = interface.model, interface.trace
    symbols, columns = trace.symbols, {name: value for name, (_, value) in trace.columns.items()}
    for layout, place in ((model.input_layout, 1), (model.state_layout, 2)):
        columns |= {name: symbols[place][k] for k, name in enumerate(layout.names)} if layout else {}
    names = model.input_layout.names
    rates = {own[n]: own[rate] for own in _drivers(model) for n, rate in (("phi", "w"), ("w", "a"))}
    along = [columns[rates[n]] if n in rates else casadi.SX(0.0) for n in names]
    stored = casadi.SX(sum(columns[n] for n in balance.stores))
    rate = casadi.jtimes(stored, symbols[1], casadi.vertcat(*along)) if names else casadi.SX(0.0)
    if trace.derivatives:
        rate += casadi.jtimes(stored, symbols[2], casadi.vertcat(*trace.derivatives))
    given = columns[balance.supply[0]] * columns[balance.supply[1]]
    lost = casadi.SX(sum(columns[n] for n in balance.losses))
    powers = casadi.Function("powers", symbols, [casadi.vertcat(given, lost, rate)])
    gaps, flows = [0.0], [0.0]
    for point in points:
        p = model.with_derived(
            MATH, model.parameter_layout.from_names(_of(point, model.parameter_layout.names))
        )
        u = model.input_layout.from_names(_of(point, names))
        x = model.state_layout.values(model.begin(p, u)) if model.state_layout else []
        at = [model.parameter_layout.values(p), model.input_layout.values(u), x, getattr(p, "derived", [])]
        supply, loss, rise = (float(v) for v in powers(*at).full().ravel())
        gaps.append(abs(supply - loss - rise))
        flows.append(abs(supply) + abs(loss) + abs(rise))
    least = 1e-6 * max(flows) or 1.0
    return max(gap / max(flow, least) for gap, flow in zip(gaps, flows, strict=True))


def _of(point: StatePoint, names: Sequence[str]) -> dict[str, float]:
    return {name: point.given[name] for name in names}
