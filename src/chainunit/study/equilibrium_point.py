"""An equilibrium as the point of a linear model: `equilibrium`, or `equilibrium:2` by its number."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TypeGuard

from ..core.errors import InputError, shown
from ..machines.equilibria import INDIFFERENT, STOP, Equilibria, Equilibrium
from ..machines.machine import Machine
from ..mechanism.models import InverseMachine

_FORM = re.compile(r"equilibrium\s*(?::\s*(.*))?")


def asks_for_equilibrium(operating_point: object) -> TypeGuard[str]:
    """Whether a point is given as an equilibrium."""
    return (
        isinstance(operating_point, str)
        and operating_point.strip().partition(":")[0].strip() == "equilibrium"
    )


def equilibrium_point(
    model: InverseMachine, values: Mapping[str, float], operating_point: str
) -> tuple[int, Equilibrium]:
    """The number of an equilibrium of a machine and the equilibrium: by default the stable one with the least
    potential, the first one where it has none.

    Parameters
    ----------
    values : parameters and loads that differ from their start values, by name; other names do not matter
    operating_point : ``"equilibrium"``, or ``"equilibrium:N"`` with the number in the table of ``chainunit linkage``

    Raises
    ------
    InputError
        where there is none, and for one on a stop or over a range; the message lists all.
    """
    machine = Machine(model, {name: x for name, x in values.items() if name in model.parameter_layout.names})
    feed = model.feed_layout.from_names(
        {name: x for name, x in values.items() if name in model.feed_layout.names}
    )
    equilibria = machine.equilibria(feed)
    number = _number(operating_point, equilibria, model)
    equilibrium = equilibria.places[number - 1]
    if equilibrium.kind in (STOP, INDIFFERENT):
        where = "on an end stop" if equilibrium.kind == STOP else "indifferent over a range"
        raise InputError(
            f"at = {shown(operating_point)}: the equilibrium {number} is {where}; {_listed(equilibria, model)}; "
            f"give {_others(equilibria)}"
        )
    return number, equilibrium


def _number(operating_point: str, equilibria: Equilibria, model: InverseMachine) -> int:
    match = _FORM.fullmatch(operating_point.strip())
    text = match[1] if match else operating_point
    if text is None:
        if not equilibria.stable:
            raise InputError(
                f"at = {shown(operating_point)}: there is no stable equilibrium; {_listed(equilibria, model)}; "
                f"give {_others(equilibria)}"
            )
        lowest = min(equilibria.stable, key=lambda equilibrium: equilibrium.potential or 0.0)
        return equilibria.places.index(lowest) + 1
    if not text.isdecimal() or not 1 <= int(text) <= len(equilibria.places):
        raise InputError(
            f"at = {shown(operating_point)}: must be equilibrium:N with N from 1 to {len(equilibria.places)}; "
            f"{_listed(equilibria, model)}"
        )
    return int(text)


def _others(equilibria: Equilibria) -> str:
    """The points that are left, in words: equilibria that are no stop and no range, by number, and places."""
    free = [
        k for k, equilibrium in enumerate(equilibria.places, 1) if equilibrium.kind not in (STOP, INDIFFERENT)
    ]
    by_number = f'the number of one, as in "equilibrium:{free[0]}", or ' if free else ""
    return f'{by_number}a place, "phi=.., w=0"'


def _listed(equilibria: Equilibria, model: InverseMachine) -> str:
    """The equilibria in words."""
    if not equilibria.places:
        return "it has no equilibrium"
    return "its equilibria are " + ", ".join(
        f"{k} ({place_words(model, equilibrium)})" for k, equilibrium in enumerate(equilibria.places, 1)
    )


def place_words(model: InverseMachine, equilibrium: Equilibrium) -> str:
    """Kind and place of an equilibrium in words."""
    unit = "m" if model.slides else "rad"
    on = "on its stop" if equilibrium.kind == STOP else equilibrium.kind
    return f"{on}, {equilibrium.place:.6g} {unit}"
