"""The table [chain] of a study file, with the range of speeds that follows from the rest of the file."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from ...core.quantities import Value, declaration, quantity, whole_number
from ...machines.api import ChainUnitMachine
from ...machines.chain_organs import LEAST, MOST, USUAL, OrganLaw
from ...machines.chain_unit import Parameters
from ...study.config import FileReading
from ...study.file_section import FileSection
from ...study.organ_limits import slack_and_mode

_BEYOND = 1.2
"""Highest speed of the range, over the lowest natural frequency."""


@declaration
class ChainOrgans(OrganLaw):
    """The organs as chains, where `organ` is "chain", and the sweep over crank speeds with them."""

    rods: Value = whole_number("number of rods of an organ", default=USUAL, min=LEAST, max=MOST)
    sweep_lowest: Value = quantity(
        "rad/s", "lowest crank speed of the sweep", default=1.0, min=0.01, max=1000.0
    )
    sweep_highest: Value = quantity(
        "rad/s", "highest crank speed of the sweep", default=15.0, above=0.0, max=1000.0
    )
    sweep_points: Value = whole_number(
        "number of speeds of the sweep, to which run.crank_speed is added; with 0 it is alone",
        default=15,
        min=0,
        max=200,
    )
    starts: Value = whole_number(
        "starts at each speed, evenly over the turn: at least 10", default=10, min=10, max=1000
    )
    turns: Value = whole_number(
        "crank turns that are evaluated of each start: at least 30", default=30, min=30, max=10_000
    )

    @property
    def ends(self) -> tuple[float, float]:
        """Lowest and highest speed of the range [rad/s]."""
        return float(self.sweep_lowest), float(self.sweep_highest)

    @property
    def speeds(self) -> list[float]:
        """The speeds at even distances [rad/s]."""
        speeds: list[float] = np.linspace(*self.ends, int(self.sweep_points)).tolist()
        return speeds


def _completed(chain: ChainOrgans, reading: FileReading) -> ChainOrgans | None:
    """The table of a study with chains, with its damping, and with the highest of the speeds: twice the speed of
    normal running, or a fifth beyond the lowest natural frequency of an organ where that is higher. None with two
    bars."""
    if reading.form.organ != "chain" or not isinstance(reading.machine, ChainUnitMachine):
        return None
    keys = reading.given["chain"]
    usual = damping_of_organ(reading.machine)
    chain = replace(chain, **{name: x for name, x in usual.items() if name not in keys})
    if "sweep_highest" in keys:
        return chain
    _, mode = slack_and_mode(reading.machine, reading.values["feed"])
    beyond = _BEYOND * mode if math.isfinite(mode) else 0.0
    highest = max(2.0 * reading.values["run"].crank_speed, beyond, chain.sweep_lowest)
    return replace(chain, sweep_highest=highest)


def damping_of_organ(machine: ChainUnitMachine) -> dict[str, float]:
    """The damping of the pins of the heavier organ, by its names in `OrganLaw`: it damps the small vibration of any
    organ as much as that of the packaged machine. The moment of the weight is m g l and the time of the vibration
    sqrt(l/g), so that the damping of a pin grows as m l^1.5, and `eta` once more with the length."""
    usual, law = Parameters(), OrganLaw()
    mass, length = _mass(machine.p) / _mass(usual), machine.p.l1 / usual.l1
    return {"eta": law.eta * mass * length**2.5, "end_damping": law.end_damping * mass * length**1.5}


def _mass(p: Any) -> float:
    """The mass of the heavier organ without material [kg]."""
    return max(side.wall_mass + side.web_mass for side in (p.left, p.right))


CHAIN = FileSection(
    ChainOrgans,
    title="Chains",
    follows={
        "eta": "that of the packaged machine by mass of the organ and l1^2.5",
        "end_damping": "that of the packaged machine by mass of the organ and l1^1.5",
        "sweep_highest": "twice run.crank_speed, or 1.2 times the lowest mode of an organ if that is more",
    },
    order=(("sweep_lowest", ">", "sweep_highest"),),
    completed=_completed,
)
