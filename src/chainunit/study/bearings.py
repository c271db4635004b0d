"""What the pins of the machine carry in a run."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import xarray as xr

from .drive import Drive
from .measures import mean, whole_turns


def pin_loads(drive: Drive, run: xr.Dataset) -> dict[str, dict[str, float]]:
    """Peak, RMS and equivalent load (mean of ISO 281 over what the pin turns) of the reaction of every pin [N]."""
    table, turns = {}, whole_turns(drive, run)
    turned = drive.driven.pin_turns(turns["machine.phi0"].values)
    if drive.chain is not None:
        turned[4:] = _chain_turns(drive, turns)

    def size(name: str, of: xr.Dataset) -> Any:
        return np.hypot(of[f"machine.{name}.fx"].values, of[f"machine.{name}.fy"].values)

    for (title, name), angle in zip(drive.driven.model.pins.items(), turned, strict=True):
        evaluated = size(name, turns)
        table[title] = {
            "peak": float(np.max(size(name, run))),
            "rms": math.sqrt(mean(turns, evaluated**2)),
            "equivalent": mean_load(evaluated, angle),
        }
    return table


def _chain_turns(drive: Drive, run: xr.Dataset) -> list[Any]:
    """Relative angle in A2, B and A1 of each side [rad], shape (time,), of chains."""
    walls, webs = drive.rods
    angles = []
    for side in ("left", "right"):
        first, last, other, end = (
            run[f"machine.{side}.theta_{k}"].values for k in (1, walls, walls + 1, walls + webs)
        )
        angles += [end - run["machine.rocker.psi"].values, other - last, first]
    return angles


def mean_load(force: Any, turned: Any, exponent: float = 3.0) -> float:
    """Equivalent load of a bearing [N]: the mean of ISO 281 over what it turns.

    P = (integral of F^p |d alpha| / integral of |d alpha|)^(1/p), with `force` [N] and the angle `turned` [rad] of
    the pin in its bearing, both of shape (n,); p = 3 for ball bearings, 10/3 for rollers. Zero where nothing turns.
    """
    force = np.asarray(force)
    weight = np.abs(np.diff(np.asarray(turned)))
    total = float(np.sum(weight))
    if total == 0.0:
        return 0.0
    middle = 0.5 * (force[1:] + force[:-1])
    return float((np.sum(middle**exponent * weight) / total) ** (1.0 / exponent))
