"""The ratios of the papers 000 and 001, and the chain unit that they make."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TypeVar

import numpy as np

from ..core.errors import GeometryError, InputError
from ..core.quantities import Layout, Value, declaration, quantity
from .admissible import causes

M = TypeVar("M")


@declaration
class Ratios:
    """The ratios of the papers, which may be given in place of lengths."""

    rho: Value = quantity("1", "r/l, crank to coupler", default=0.1, above=0.0, max=0.999)
    lam: Value = quantity("1", "h/l, rocker to coupler", default=2.0 / 3.0, above=0.0, max=100.0)
    mu: Value = quantity("1", "e/l1, rocker arm of the web hinge to wall", default=0.6, above=0.0, max=0.999)
    zeta: Value = quantity("1", "z/z_max, half width", default=0.5, above=0.0, max=1.0)
    l: Value = quantity("m", "coupler A-Bd", default=1.5, above=0.0)
    l1: Value = quantity("m", "wall A1-B", default=1.35, above=0.0)


RATIOS = {variable.name: variable for variable in Layout(Ratios).variables}
_TRIALS = np.geomspace(0.02, 50.0, 40)
"""Values of a ratio, in parts of its usual one, with which a machine is tried if the usual one makes none."""


def lengths(rho: float, lam: float, mu: float, zeta: float, l: float, l1: float) -> dict[str, float]:
    """Lengths [m] from the papers' ratios, by parameter name; see `ChainUnitMachine.from_ratios`."""
    r = rho * l
    return {
        "r": r,
        "l": l,
        "h": lam * l,
        "c": math.sqrt(l * l - r * r),
        "hy": lam * l,
        "e": mu * l1,
        "l1": l1,
        "l2": l1 - mu * l1,
        "z": zeta * 2.0 * l1 * math.sqrt(1.0 - mu),
    }


def of_ratios(make: Callable[[dict[str, float]], M], ratios: Mapping[str, float]) -> M:
    """What `make` makes of the lengths by these ratios.

    Raises
    ------
    GeometryError
        for ratios that make no machine, with the range of each that would mend it alone.
    """
    try:
        return make(lengths(**ratios))
    except GeometryError as error:
        reason = error

    def admitted(trial: Mapping[str, float]) -> bool:
        """Whether the ratios are in their ranges and make a machine."""
        try:
            return all(RATIOS[name].quantity.admits(x) for name, x in trial.items()) and bool(
                make(lengths(**trial))
            )
        except InputError:
            return False

    usual, layout = Ratios(), Layout(Ratios)
    spoil = causes(admitted, ratios, layout, usual)
    if not spoil:
        starts = {
            name: next((float(y) for y in x * _TRIALS if admitted({**ratios, name: float(y)})), x)
            for name, x in layout.by_name(usual).items()
        }
        spoil = causes(admitted, ratios, layout, Ratios(**starts))
    remedy = f"with all other values as they are, {', or '.join(spoil.values())}"
    if not spoil:
        values, start = (
            ", ".join(f"{name} = {x:.4g}" for name, x in numbers.items())
            for numbers in (ratios, layout.by_name(usual))
        )
        remedy = f"no other value of one of {values} alone makes a machine; begin with {start}"
    raise GeometryError(f"{reason}; {remedy}", next((f"ratios.{name}" for name in spoil), "")) from reason
