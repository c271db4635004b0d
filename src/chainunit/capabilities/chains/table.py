"""The table [chain] of a study file: declarations only."""

from __future__ import annotations

from ...core.quantities import Value, declaration, quantity
from ...machines.chain_organs import LEAST, MOST, USUAL, OrganLaw


@declaration
class ChainOrgans(OrganLaw):
    """The organs as chains, where `organ` is "chain", and the sweep over crank speeds with them."""

    rods: Value = quantity(
        "1", "number of rods of an organ", default=USUAL, min=LEAST, max=MOST, type="Integer"
    )
    sweep_lowest: Value = quantity(
        "rad/s", "lowest crank speed of the sweep", default=1.0, min=0.01, max=1000.0
    )
    sweep_highest: Value = quantity(
        "rad/s", "highest crank speed of the sweep", default=15.0, above=0.0, max=1000.0
    )
    sweep_points: Value = quantity(
        "1",
        "number of speeds of the sweep, to which run.crank_speed is added; with 0 it is alone",
        default=15,
        min=0,
        max=200,
        type="Integer",
    )
    starts: Value = quantity(
        "1",
        "starts at each speed, evenly over the turn: at least 10",
        default=10,
        min=10,
        max=1000,
        type="Integer",
    )
    turns: Value = quantity(
        "1",
        "crank turns that are evaluated of each start: at least 30",
        default=30,
        min=30,
        max=10_000,
        type="Integer",
    )
