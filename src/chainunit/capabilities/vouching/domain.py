"""The domain of validity of an FMU as numbers: bounds of its variables, ranges that were tried, conditions on its
parameters, and of a chain unit the speeds up to which two bars are a model of its organs."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any

from ...core.engines import MATH
from ...core.errors import InputError
from ...fmu.description import Interface
from ...fmu.reference import parameters_at_start
from ...machines.api import ChainUnitMachine
from ...machines.chain_unit import SIDES, ChamberForces, Feed, SideLoads
from ...study.organ_limits import two_bar_limits
from ...study.verdict import SpeedLimit
from .experiments import StatePoint
from .rerun import TimeTable, UnpackedFmu


def domain(
    fmu: UnpackedFmu, interface: Interface | None, points: Iterable[StatePoint], given: Iterable[TimeTable]
) -> dict[str, Any]:
    """The content of domain.json.

    Parameters
    ----------
    interface : of the model with the start values of the FMU, if the model is known
    points, given : the points and the tables of inputs that were run; their values are the tried ranges
    """
    tried = ranges(points, given)
    variables = {
        v.name: {
            "causality": v.causality,
            "unit": v.unit,
            "start": v.start,
            "min": v.low,
            "max": v.high,
            "tried": tried.get(v.name),
        }
        for causality in ("parameter", "input")
        for v in fmu.of(causality)
    }
    return {
        "model": fmu.name,
        "variables": variables,
        "conditions": list(_conditions(interface)) if interface else [],
        "limits": list(_limits(fmu)),
    }


def ranges(points: Iterable[StatePoint], given: Iterable[TimeTable]) -> dict[str, list[float]]:
    """By variable, the least and the largest value among points and rows of tables."""
    found: dict[str, list[float]] = {}

    def take(name: str, low: float, high: float) -> None:
        own = found.setdefault(name, [low, high])
        own[:] = min(own[0], low), max(own[1], high)

    for point in points:
        for name, value in point.given.items():
            take(name, value, value)
    for each in given:
        for name, column in zip(each.names, each.values.T, strict=True):
            take(name, float(column.min()), float(column.max()))
    return found


def _conditions(interface: Interface) -> Iterator[dict[str, Any]]:
    """The conditions of the model on its parameters beside their bounds, with their limits at the start values."""
    model, p = interface.model, parameters_at_start(interface)
    for each, (value, low, high) in zip(model.required, model.requirements(MATH, p), strict=True):
        yield {
            "subject": each.subject,
            "unit": each.unit,
            "why": each.why,
            "value": _finite(value),
            "above": _finite(low),
            "below": _finite(high),
            "of": [*each.context, *each.depends],
        }


def _finite(value: Any) -> float | None:
    return float(value) if math.isfinite(value) else None


def _limits(fmu: UnpackedFmu) -> Iterator[dict[str, Any]]:
    """The speeds of the crank up to which two bars are a model of the organs, of a chain unit that the FMU is or has;
    they follow from the names of its variables."""
    names = ChamberForces.parameter_layout.names
    start, loads = fmu.start("parameter"), fmu.start("input")
    for prefix in ("", "machine."):
        if not all(prefix + name in start for name in names):
            continue
        try:
            machine = ChainUnitMachine({name: start[prefix + name] for name in names})
        except InputError:
            return
        sides = {
            side: SideLoads(
                **{k: loads.get(f"{prefix}{side}.{k}", 0.0) for k in ("material_mass", "processing_force")}
            )
            for side in SIDES
        }
        feed = Feed(**sides)
        mode, limits = two_bar_limits(machine, feed)
        own = [
            ("chain_resonance", mode, "crank speed at the lowest natural frequency of an organ as a chain")
        ]
        if f"{prefix}left.theta_1" not in fmu.variables:
            own += _of_two_bars(limits)
        masses = {f"{prefix}{side}.material_mass": sides[side].material_mass for side in SIDES}
        for name, value, words in own:
            yield {"name": name, "unit": "rad/s", "value": _finite(value), "with": masses, "meaning": words}


def _of_two_bars(limits: Iterable[SpeedLimit]) -> Iterator[tuple[str, float, str]]:
    """Name, crank speed [rad/s] and meaning of each limit of two bars in place of chains."""
    good = {each.topic: each.speed for each in limits}
    yield (
        "slack_free_speed",
        good["slack speed"],
        "crank speed at which a web first goes slack; above, two bars are no chain",
    )
    for link in ("crank", "rocker"):
        words = f"crank speed up to which the {link} torque of two bars is good to 10 %, as a chain resonates above"
        yield f"{link}_torque_speed", good[f"{link} torque"], words
