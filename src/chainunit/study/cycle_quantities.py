"""Quantities of a turn of the crank at constant speed: declared once, for one machine or for arrays of machines.

The name of a quantity is a reduction of a column over the turn, such as ``peak(crank_torque)``, ``rms(tau)``,
``max(force(pivot))``, ``min(margin)`` or ``range(rocker.psi)``, or one of `NAMED`. A column is an output of the
machine, or one of the quantities beside the outputs: ``crank_torque``, the size of a force, and the places of pins.

``installed_power`` is the power of a motor that carries the turn for ever: the speed of its shaft times the larger
one of the RMS torque, which heats the motor, and the peak torque over the permitted `overload`. ``energy_per_year``
is the energy that the shaft takes in the operating hours of a year, the mean power times the time; power that flows
back in a part of the turn counts as recovered, by the masses or the supply.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..batch.equations import columns_of
from ..batch.reductions import REDUCTIONS
from ..core.errors import InputError, near_name, shown
from ..core.model import Model
from ..core.quantities import Value, declaration, quantity
from ..machines.machine import Machine
from .arrays import Dataset

ANGLES = 720
"""Number of crank angles at which a quantity is computed."""


@declaration
class CycleBasis:
    """The assumptions behind installed power and energy per year."""

    operating_hours: Value = quantity(
        "1", "hours of operation in a year", default=4000.0, above=0.0, max=8784.0
    )
    overload: Value = quantity(
        "1", "permitted ratio of the motor's peak torque to its rated torque", default=1.6, min=1.0, max=10.0
    )


@dataclass(frozen=True)
class Integrand:
    """A column and its reduction over the turn, one of `REDUCTIONS`."""

    column: str
    reduction: str

    @property
    def name(self) -> str:
        """The name that a batch gives the result."""
        return f"{self.reduction}({self.column})"


@dataclass(frozen=True)
class CycleQuantity:
    """A quantity of a turn: the reductions that it needs (`integrands`), and `combine`, which makes its value from
    theirs, from the speed of the motor [rad/s] and from a `CycleBasis`."""

    name: str
    unit: str
    description: str
    integrands: tuple[Integrand, ...]
    combine: Callable[[Sequence[Any], Any, CycleBasis], Any]
    kind: str = ""
    """how people show it, see `chainunit.reading.text`"""
    reduction: str = ""
    """name of the reduction of its column; of a quantity that is no single reduction, its own name"""


def _installed_power(values: Sequence[Any], w: Any, basis: CycleBasis) -> Any:
    """Power [W] of the motor that carries RMS and peak of its torque, `values` [N m], at the speed `w` [rad/s]."""
    rms, peak = values
    return w * np.maximum(rms, peak / basis.overload)


def _energy_per_year(values: Sequence[Any], w: Any, basis: CycleBasis) -> Any:
    return 3600.0 * basis.operating_hours * values[0]


def _only(values: Sequence[Any], w: Any, basis: CycleBasis) -> Any:
    return values[0]


def _difference(values: Sequence[Any], w: Any, basis: CycleBasis) -> Any:
    return values[0] - values[1]


def _extent(values: Sequence[Any], w: Any, basis: CycleBasis) -> Any:
    """The largest of the first half of the `values` less the least of the second half; NaN without values."""
    if not (half := len(values) // 2):
        return math.nan
    highest = np.max(np.stack(np.broadcast_arrays(*values[:half])), axis=0)
    return highest - np.min(np.stack(np.broadcast_arrays(*values[half:])), axis=0)


NAMED: Mapping[str, tuple[str, str]] = {
    "installed_power": (
        "W",
        "power of the motor that carries the turn for ever, by RMS torque and peak torque",
    ),
    "energy_per_year": ("J", "energy that the shaft takes in a year"),
    "box.width": ("m", "width of the box about the paths of all pins"),
    "box.height": ("m", "height of the box about the paths of all pins"),
}
"""The quantities that are no single reduction: unit and description."""
RANGE = "range"
_WORDS = {name: reduction.title for name, reduction in REDUCTIONS.items()} | {
    RANGE: "largest less least value"
}
_FORM = re.compile(r"(\w+)\((.+)\)")


def cycle_quantity(name: str, model: Model) -> CycleQuantity:
    """The quantity of that name for the machines of a model.

    Raises
    ------
    InputError
        for a name that is none, or a column that the model does not have.
    """
    if name in NAMED:
        return _named(name, model)
    form = _FORM.fullmatch(name)
    if form is None or form[1] not in _WORDS:
        names = [*NAMED, *(f"{reduction}(...)" for reduction in _WORDS)]
        raise InputError(f"{shown(name)}: must be one of {', '.join(names)}{near_name(name, NAMED)}")
    reduction, column = form.groups()
    columns = {v.name: v for v in columns_of(model)}
    if column not in columns:
        raise InputError(
            f"{shown(name)}: the {model.name} has no output {column}; it has crank_torque, force(NAME), x(PIN), "
            f"y(PIN) and its outputs{near_name(column, columns)}"
        )
    variable = columns[column]
    description = f"{_WORDS[reduction]}, {variable.description}"
    if reduction == RANGE:
        pair = (Integrand(column, "max"), Integrand(column, "min"))
        return CycleQuantity(name, variable.unit, description, pair, _difference, reduction=reduction)
    single = (Integrand(column, reduction),)
    return CycleQuantity(name, variable.unit, description, single, _only, reduction=reduction)


def _named(name: str, model: Model) -> CycleQuantity:
    """The quantity of one of the names `NAMED`."""
    integrands: tuple[Integrand, ...]
    combine: Callable[..., Any]
    if name == "installed_power":
        integrands, combine = (Integrand("tau", "rms"), Integrand("tau", "peak")), _installed_power
    elif name == "energy_per_year":
        integrands, combine = (Integrand("power", "mean"),), _energy_per_year
    else:
        axis = {"box.width": "x", "box.height": "y"}[name]
        places = [v.name for v in columns_of(model) if v.name.startswith(f"{axis}(")]
        if not places:
            raise InputError(
                f"{name}: the pins of the {model.name} have no places of their own; leave it out"
            )
        integrands = tuple(Integrand(place, end) for end in ("max", "min") for place in places)
        combine = _extent
    kind = "energy" if name == "energy_per_year" else ""
    return CycleQuantity(name, *NAMED[name], integrands, combine, kind, reduction=name)


def evaluate(
    machine: Machine,
    quantities: Sequence[CycleQuantity],
    crank_speed: Any,
    feed: Any = None,
    values: Mapping[str, Any] | None = None,
    basis: CycleBasis | None = None,
    angles: int = ANGLES,
    **options: Any,
) -> Dataset:
    """Quantities of a turn for one machine, or for arrays of machines.

    Parameters
    ----------
    crank_speed : the constant speed of the crank [rad/s], a number or a DataArray
    feed : the loads, an instance of ``model.Feed``; by default those of normal running
    values : further values by the names of parameters and inputs, as `chainunit.batch.evaluate` takes them: arrays of
        any dimensions
    angles : number of crank angles, evenly over the turn; extremes are those at these angles
    **options : `engine` and `workers` of `chainunit.batch.evaluate`

    Returns
    -------
    a Dataset with a variable for each quantity, by its name, and ``reason``

    Raises
    ------
    InputError
        see `chainunit.batch.evaluate`.
    """
    import xarray as xr

    further_values = dict(values or {})
    ratio = further_values.get("ratio", machine.ratio)
    if not isinstance(ratio, xr.DataArray) and np.ndim(ratio):
        ratio = xr.DataArray(np.asarray(ratio, float), dims="ratio")
    angle = xr.DataArray(np.arange(angles) * (2.0 * math.pi / angles), dims="angle")
    w = crank_speed * ratio
    loads = machine.model.feed_layout.by_name(machine.model.Feed() if feed is None else feed)
    reduce: dict[str, list[str]] = {}
    for integrand in (integrand for q in quantities for integrand in q.integrands):
        names = reduce.setdefault(integrand.column, [])
        if integrand.reduction not in names:
            names.append(integrand.reduction)
    points = {**loads, "a": 0.0, **further_values, "phi": angle * ratio, "w": w}
    table = machine.batch(points, over="angle", reduce=reduce, **options)
    results: dict[str, Any] = {}
    for q in quantities:
        parts = xr.broadcast(*(table[integrand.name] for integrand in q.integrands))
        value = q.combine(parts, w, basis or CycleBasis())
        result = value if isinstance(value, xr.DataArray) else parts[0].copy(data=value)
        results[q.name] = result.assign_attrs(units=q.unit, long_name=q.description)
    return xr.Dataset(results | {"reason": table.reason})
