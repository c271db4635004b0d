"""Events of study files in tests, by the names of their runs."""

from __future__ import annotations

from chainunit.quantities import Layout
from chainunit.studies.events import TYPES

STANDARD = ("right_empties", "left_empties", "feed_left", "feed_right", "jam_left", "jam_right")
"""Those of the packaged example."""


def event_line(*runs: str, **quantities: float) -> str:
    """The line ``event = [...]`` with the events of these names; each has those of the quantities that its type has.
    It stands before the tables of a file."""
    return f"event = [{', '.join(_table(run, quantities) for run in runs)}]\n"


def _table(run: str, quantities: dict[str, float]) -> str:
    for kind, of in TYPES.items():
        for side in ("left", "right") if of.sided else ("",):
            if of.on(side).name == run:
                names = Layout(of.Parameters).names
                keys = [f'type = "{kind}"', *([f'side = "{side}"'] if side else [])]
                keys += [f"{name} = {x}" for name, x in quantities.items() if name in names]
                return f"{{ {', '.join(keys)} }}"
    raise ValueError(run)
