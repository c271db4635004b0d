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


def asks_for_equilibrium(at: object) -> TypeGuard[str]:
    """Whether a point is given as an equilibrium."""
    return isinstance(at, str) and at.strip().partition(":")[0].strip() == "equilibrium"


def equilibrium_point(model: InverseMachine, values: Mapping[str, float], at: str) -> tuple[int, Equilibrium]:
    """The number of an equilibrium of a machine and the equilibrium: by default the stable one with the least
    potential, the first one where it has none.

    Parameters
    ----------
    values : parameters and loads that differ from their start values, by name; other names do not matter
    at : ``"equilibrium"``, or ``"equilibrium:N"`` with the number in the table of ``chainunit linkage``

    Raises
    ------
    InputError
        where there is none, and for one on a stop or over a range; the message lists all.
    """
    machine = Machine(model, {name: x for name, x in values.items() if name in model.parameter_layout.names})
    feed = model.feed_layout.from_names(
        {name: x for name, x in values.items() if name in model.feed_layout.names}
    )
    found = machine.equilibria(feed)
    number = _number(at, found, model)
    own = found.places[number - 1]
    if own.kind in (STOP, INDIFFERENT):
        where = "on an end stop" if own.kind == STOP else "indifferent over a range"
        raise InputError(
            f"at = {shown(at)}: the equilibrium {number} is {where}; {_listed(found, model)}; "
            f"give {_others(found)}"
        )
    return number, own


def _number(at: str, found: Equilibria, model: InverseMachine) -> int:
    match = _FORM.fullmatch(at.strip())
    text = match[1] if match else at
    if text is None:
        if not found.stable:
            raise InputError(
                f"at = {shown(at)}: there is no stable equilibrium; {_listed(found, model)}; "
                f"give {_others(found)}"
            )
        lowest = min(found.stable, key=lambda each: each.potential or 0.0)
        return found.places.index(lowest) + 1
    if not text.isdecimal() or not 1 <= int(text) <= len(found.places):
        raise InputError(
            f"at = {shown(at)}: must be equilibrium:N with N from 1 to {len(found.places)}; "
            f"{_listed(found, model)}"
        )
    return int(text)


def _others(found: Equilibria) -> str:
    """The points that are left, in words: equilibria that are no stop and no range, by number, and places."""
    free = [k for k, each in enumerate(found.places, 1) if each.kind not in (STOP, INDIFFERENT)]
    by_number = f'the number of one, as in "equilibrium:{free[0]}", or ' if free else ""
    return f'{by_number}a place, "phi=.., w=0"'


def _listed(found: Equilibria, model: InverseMachine) -> str:
    """The equilibria in words."""
    if not found.places:
        return "it has no equilibrium"
    return "its equilibria are " + ", ".join(
        f"{k} ({place_words(model, each)})" for k, each in enumerate(found.places, 1)
    )


def place_words(model: InverseMachine, each: Equilibrium) -> str:
    """Kind and place of an equilibrium in words."""
    unit = "m" if model.slides else "rad"
    on = "on its stop" if each.kind == STOP else each.kind
    return f"{on}, {each.place:.6g} {unit}"
