"""The pull along the rods of the organs in a run with two bars: at their ends, and in the mean of a rod."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..core.quantities import Layout
from ..machines.api import ChainUnitMachine
from ..machines.chain_unit import RODS, SIDES, RodName, SideLoads
from .drive import Drive

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class LeastPull:
    """The least pull in a kind of rod on either side in a run [N]: at an `end`, just inside this `pin`, and the least
    `mean` of a rod. A rod is slack where its mean pull is negative."""

    end: float
    pin: str
    mean: float


def least_pulls(drive: Drive, run: xr.Dataset, sides: tuple[str, ...]) -> dict[RodName, LeastPull]:
    """The least pulls in webs and walls of the `sides`; empty where there is none, and where the organs of the run
    are not two bars."""
    machine = drive.simulated_machine
    if not sides or not isinstance(machine, ChainUnitMachine):
        return {}
    left, right = (
        SideLoads(**{load: run[f"machine.{side}.{load}"].values for load in Layout(SideLoads).names})
        for side in SIDES
    )
    psi, w, a = (run[f"machine.rocker.{name}"].values for name in ("psi", "w", "a"))
    pulls = machine.organ_pulls(psi, w, a, left, right)
    least: dict[RodName, LeastPull] = {}
    for rod in RODS:
        ends = {
            (side, pin): np.min(pull)
            for side in SIDES
            if side in sides
            for pin, pull in pulls[side][rod].items()
        }
        weakest = min(ends, key=lambda place: float(ends[place]))
        means = [np.min(sum(pulls[side][rod].values())) / 2.0 for side in SIDES if side in sides]
        least[rod] = LeastPull(float(ends[weakest]), weakest[1], float(min(means)))
    return least
