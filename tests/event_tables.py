"""Study files in tests: events by the names of their runs, and a machine to size a motor for."""

from __future__ import annotations

import dataclasses

from chainunit.core.quantities import Layout
from chainunit.study.event import TYPES

STANDARD = ("right_empties", "left_empties", "feed_left", "feed_right", "jam_left", "jam_right")
"""Those of the packaged example."""


def event_line(*runs: str, **quantities: float) -> str:
    """The line ``event = [...]`` with the events of these names, each with the `quantities` that its type declares.
    It stands before the tables of a file."""
    return f"event = [{', '.join(_table(run, quantities) for run in runs)}]\n"


def _table(run: str, quantities: dict[str, float]) -> str:
    for kind, of in TYPES.items():
        for side in ("left", "right") if of.has_side else ("",):
            if of.on(side).name == run:
                names = Layout(of.Parameters).names
                keys = [f'type = "{kind}"', *([f'side = "{side}"'] if side else [])]
                keys += [f"{name} = {x}" for name, x in quantities.items() if name in names]
                return f"{{ {', '.join(keys)} }}"
    raise ValueError(run)


HEAVY_TABLES = """
[machine]
crank = { m = 160, s = 0.05, I = 4 }
coupler = { m = 120, s = 0.7, I = 24 }
rocker = { m = 480, s = 0.5, I = 60 }
left = { wall_mass = 540, web_mass = 216 }
right = { wall_mass = 540, web_mass = 216 }
[feed]
left = { material_mass = 300, processing_force = 120 }
right = { material_mass = 300, processing_force = 120 }
"""
"""A machine ten times as heavy as the packaged one."""

HEAVY_MACHINE = f"{HEAVY_TABLES}[run]\nstep = 0.002\n"
"""The same, with a given step of its runs."""


def demanding(config, **demands):
    """The study with [sizing], with other demands on the motor."""
    plan = config.plans["sizing"]
    plan = dataclasses.replace(plan, demands=dataclasses.replace(plan.demands, **demands))
    return dataclasses.replace(config, plans={**config.plans, "sizing": plan})
