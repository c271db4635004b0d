"""Why a linkage does not close: the group, its gap, and the lengths with which it closes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from ...core.engines import MATH
from ...core.errors import InputError
from ...groups.dyad import RRP, Dyad
from ...mechanism.assur import AssurGroup
from ...mechanism.linkage import Linkage
from ...mechanism.machine import Mechanism
from .joint_kinds import SINGLES

PLACES = 720
"""Places over the span at which a group is looked at."""
_ROUNDING = 1e-12
"""Gap in parts of the lengths that is rounding: the group just closes, in a dead position."""
_NO_MARGIN = 1e-6
_ROUNDED = 2e-3
"""Part of a length by which its two limits, rounded towards each other, may come closer."""


def open_group(links: Sequence[str], where: str, hint: str = "") -> InputError:
    """The refusal of a group that does not close."""
    return InputError(
        f"the group of {', '.join(links)} cannot close at {where}{hint or ': change its lengths'}",
        key=f"links.{links[0]}",
    )


_MEET = ", and its two ways of closing meet"
_DEAD = {
    "RRR": f"{{0}} and {{1}} are in line{_MEET}",
    "RRP": f"{{0}} is square to the guide of {{1}}{_MEET}",
    "RPR": f"the line of its outer pins is square to its guide{_MEET}",
    "PRP": "its two guides are parallel",
    "RPP": "its two guides are parallel",
    "cylinder": f"the cylinder and {{2}} are in line{_MEET}",
    "triad": "the lines of its three legs meet in one point or are parallel",
}
"""What holds in the dead position of a group, by its kind and with its links."""


def dead_group(group: AssurGroup, where: str, margin: float, least: float) -> InputError:
    """The refusal of a group that comes to a dead position, where its `margin` is not above the `least` one."""
    key = f"links.{group.links[0]}"
    if group.kind in SINGLES:
        return InputError(SINGLES[group.kind].dead(group, where), key)
    reason = _DEAD[group.kind].format(*group.links)
    size = f"{margin:.1g}" if margin > _NO_MARGIN else "0"
    return InputError(
        f"the group of {', '.join(group.links)} comes to a dead position at {where}: there {reason}, so that its "
        f"forces have no limit (its margin is {size} and must be > {least:g}); change its lengths",
        key=key,
    )


def just_closes(linkage: Linkage, number: int, derived: Sequence[Any], q: float) -> bool:
    """Whether a group that does not close at the place `q` of the driver does so by rounding alone: its links are in
    line there, as those of a parallelogram at its change point. The arguments are those of `gap_hint`."""
    group, before = linkage.groups[number], linkage.before(number)
    if not isinstance(group, Dyad | RRP):
        return False
    try:
        gap, size = _gap(group, _apart(group, Mechanism(MATH, before, q, derived[: before.derived_count])))
    except (ArithmeticError, ValueError, IndexError):
        return False
    return gap <= _ROUNDING * size


def _gap(group: Dyad | RRP, apart: float) -> tuple[float, float]:
    """By how much a group does not close whose outer joints are `apart`, and its size [m]."""
    if isinstance(group, RRP):
        return apart - group.first.length, group.first.length
    one, other = group.first.length, group.second.length
    return max(apart - (one + other), abs(one - other) - apart), one + other


def gap_hint(
    linkage: Linkage, number: int, derived: Sequence[Any], q: float, span: tuple[float, float]
) -> str:
    """Words on the gap in a group at the place `q` of the driver, and on the lengths that close it over the `span`;
    empty for a group whose gap is no matter of two lengths, or where what stands before it does not close.

    Parameters
    ----------
    number : index of the group in the linkage
    """
    low, high = span
    places = [low + (high - low) * k / PLACES for k in range(PLACES + 1)]
    group, before = linkage.groups[number], linkage.before(number)
    if not isinstance(group, Dyad | RRP):
        return ""
    try:
        apart = [
            _apart(group, Mechanism(MATH, before, place, derived[: before.derived_count]))
            for place in (q, *places)
        ]
    except (ArithmeticError, ValueError, IndexError):
        return ""
    gap, _ = _gap(group, apart[0])
    if isinstance(group, RRP):
        rod = group.first
        wanted = [(rod.name, rod.length, max(apart), math.inf)]
        gap_text = (
            f": its line is {_mm(apart[0])} from the pin {rod.pin}, {_mm(gap)} more than {rod.name} is long"
        )
    else:
        one, other = group.first, group.second
        near, far = abs(one.length - other.length), one.length + other.length
        missing = (
            f"more than both are long ({_mm(far)})"
            if apart[0] > far
            else f"less than they differ ({_mm(near)})"
        )
        gap_text = f": its pins {one.pin} and {other.pin} are {_mm(apart[0])} apart, {_mm(gap)} {missing}"
        wanted = [
            (a.name, a.length, max(max(apart) - b.length, b.length - min(apart)), min(apart) + b.length)
            for a, b in ((one, other), (other, one))
        ]
    if not gap > 0.0:
        return ""
    fits = []
    for name, _, low, high in wanted:
        if high - low > _ROUNDED * low:
            most = "" if high == math.inf else f" and {_mm(high, -1.0)}"
            fits.append(f"a length of {name} {'between' if most else 'above'} {_mm(low, 1.0)}{most}")
    return (
        f"{gap_text}; {' or '.join(fits)} closes it all the way"
        if fits
        else f"{gap_text}; change both lengths"
    )


def _apart(group: Dyad | RRP, m: Mechanism) -> float:
    """How far apart the outer joints of the group are [m]."""
    if isinstance(group, Dyad):
        return math.sqrt((m.pins[group.first.pin].p - m.pins[group.second.pin].p).squared())
    line = group.rail.at_position(m.links)
    return abs(line.u.cross(m.pins[group.first.pin].p - line.pin.p))


def _mm(length: float, sense: float = 0.0) -> str:
    """A length in four digits, rounded upward where `sense` is +1, downward where it is -1."""
    if sense and length > 0.0:
        unit = 10.0 ** (math.floor(math.log10(length)) - 3)
        length = (math.ceil if sense > 0.0 else math.floor)(length / unit) * unit
    return f"{1e3 * length:.4g} mm"
