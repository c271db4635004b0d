"""Why a linkage does not close: the group, its gap, and the lengths with which it closes; or its dead position."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress

from ...core.engines import MATH
from ...core.errors import InputError
from ...core.planar import Vec2
from ...groups.driver import Cylinder, Elbow
from ...groups.dyad import RRP, Dyad
from ...groups.group import Group
from ...mechanism.assur import REVOLUTE, SHARED, AssurGroup
from ...mechanism.machine import Mechanism
from ..admissible import rounded_inward
from .joint_kinds import SINGLES

LEAST_MARGIN = 1e-3
"""Least margin of a group: closer to a dead position its forces have no limit."""
_ROUNDING = 1e-12
"""Gap in parts of the lengths that is rounding: the group just closes, in a dead position."""
_NO_MARGIN = 1e-6
_ROUNDED = 2e-3
"""Part of a length by which its two limits, rounded towards each other, may come closer."""

_MEET = ", and its two ways of closing meet"
_DEAD = {
    "RRR": f"{{0}} and {{1}} are in line{_MEET}",
    "RRP": f"{{0}} is square to the guide of {{1}}{_MEET}",
    "RPR": f"the line of its outer pins is square to its guide{_MEET}",
    "PRP": "its two guides are parallel",
    "RPP": "its two guides are parallel",
    "cylinder": f"the cylinder and {{2}} are in line{_MEET}",
    "elbow": f"its outer pins and that of {{1}} with {{2}} are in line{_MEET}",
    "triad": "the lines of its three legs meet in one point or are parallel",
    "shared plate": "the lines of its legs meet in one point or are parallel, and none of them holds {0}",
    "tetrad": "the lines of {2} and {3} meet on that of its outer pins, or all are parallel",
}
"""What holds in the dead position of a group, by its kind and with its links."""


def dead_group(group: AssurGroup, where: str, margin: float) -> InputError:
    """The refusal of a group that comes to a dead position, as its `margin` is not above the least one."""
    key = f"links.{group.links[0]}"
    if group.kind in SINGLES:
        return InputError(SINGLES[group.kind].dead(group, where), key)
    reason = _DEAD[group.kind].format(*group.links)
    size = f"{margin:.1g}" if margin > _NO_MARGIN else "0"
    remedy = "change its lengths"
    if group.kind == SHARED:
        remedy = "change its lengths, or let the driver swing by a range without this place"
        if len(group.joints) % 2 and group.joints[0].kind == REVOLUTE:
            reason = (
                f"the lines of {' and '.join(group.links[1:])} go through the pin {group.joints[0].name} of "
                f"{group.links[0]}, as of cranks that all stand in line with their rod"
            )
            remedy = (
                "couple each crank with the next one by two rods, on pins at 90 deg to each other, or let the driver "
                "swing by a range without this place"
            )
    return InputError(
        f"the group of {', '.join(group.links)} comes to a dead position at {where}: there {reason}, so that its "
        f"forces have no limit (its margin is {size} and must be > {LEAST_MARGIN:g}); {remedy}",
        key=key,
    )


def misfit_of_leg(group: AssurGroup, number: int, gap: float, where: str) -> InputError:
    """The refusal of a plate on redundant legs of which this one does not fit, by its `gap` at the worst place."""
    leg, state = group.links[1 + number], "short" if gap > 0.0 else "long"
    return InputError(
        f"the legs {', '.join(group.links[1:])} do not fit {group.links[0]} all the way: at {where} {leg} is "
        f"{_mm(abs(gap))} too {state}, if the others fit; correct the places of its points, or of the others, in all "
        "their digits",
        key=f"links.{leg}",
    )


def open_group(
    group: AssurGroup,
    where: str,
    dyad: Group,
    ground: Mapping[str, Vec2],
    before: Callable[[float], Mechanism],
    places: Sequence[float],
) -> InputError:
    """The refusal of a group that does not close, with its gap and the lengths that close it over all places. A group
    that fails to close by rounding alone, as a parallelogram at its change point, is in a dead position.

    Parameters
    ----------
    where : the first of the places in words
    dyad : the group with its lengths
    ground : the places of the pins of the ground [m]
    before : the linkage before the group, of the place of the driver
    places : that at which the group does not close, then those over the way
    """
    hint = ": change its lengths"
    with suppress(ArithmeticError, ValueError, IndexError):
        if isinstance(dyad, Cylinder | Elbow):
            hint = _drive_hint(dyad, ground, before, places)
        elif isinstance(dyad, Dyad | RRP):
            apart = _apart(dyad, before(places[0]))
            gap, size = _gap(dyad, apart)
            if gap <= _ROUNDING * size:
                return dead_group(group, where, 0.0)
            hint = _gap_hint(dyad, [apart, *(_apart(dyad, before(place)) for place in places[1:])])
    return InputError(
        f"the group of {', '.join(group.links)} cannot close at {where}{hint}", key=f"links.{group.links[0]}"
    )


def _apart(group: Dyad | RRP, m: Mechanism) -> float:
    """The distance of the outer joints of the group [m]."""
    if isinstance(group, Dyad):
        return math.sqrt((m.pins[group.first.pin].p - m.pins[group.second.pin].p).squared())
    line = group.rail.at_position(m.links)
    return abs(line.u.cross(m.pins[group.first.pin].p - line.pin.p))


def _gap(group: Dyad | RRP, apart: float) -> tuple[float, float]:
    """By how much a group does not close whose outer joints are `apart`, and its size [m]."""
    if isinstance(group, RRP):
        return apart - group.first.length, group.first.length
    one, other = group.first.length, group.second.length
    return max(apart - (one + other), abs(one - other) - apart), one + other


def _gap_hint(group: Dyad | RRP, apart: Sequence[float]) -> str:
    """Words on the gap in a group, and on the lengths that close it. Its outer joints are `apart` [m]: first where it
    does not close, then at places over the way."""
    first, (gap, _) = group.first, _gap(group, apart[0])
    least, most = min(apart), max(apart)
    if isinstance(group, RRP):
        state = (
            f"its line is {_mm(apart[0])} from the pin {first.pin}, {_mm(gap)} more than {first.name} is long"
        )
        limits = {first.name: (most, math.inf)}
    else:
        second = group.second
        near, far = abs(first.length - second.length), first.length + second.length
        missing = (
            f"more than both are long ({_mm(far)})"
            if apart[0] > far
            else f"less than they differ ({_mm(near)})"
        )
        state = f"its pins {first.pin} and {second.pin} are {_mm(apart[0])} apart, {_mm(gap)} {missing}"
        limits = {
            bar.name: (max(most - length, length - least), least + length)
            for bar, length in ((first, second.length), (second, first.length))
        }
    return f": {state}; {_remedy(limits)}"


def _drive_hint(
    group: Cylinder | Elbow,
    ground: Mapping[str, Vec2],
    before: Callable[[float], Mechanism],
    places: Sequence[float],
) -> str:
    """The same words on a cylinder, or on two arms with a motor, and their lever."""
    lever, pins = group.lever, (group.bar.pin, group.lever.pin)

    def between(q: float) -> float:
        one, other = (ground[pin] if pin in ground else before(q).pins[pin].p for pin in pins)
        return math.sqrt((one - other).squared())

    apart, length = [between(q) for q in places], lever.length
    state = f"its pins {' and '.join(pins)} are {_mm(apart[0])} apart, {lever.name} is {_mm(length)} long"
    if isinstance(group, Cylinder):
        ways = [
            math.sqrt(max(reach * reach - group.offset * group.offset, 0.0)) - group.shift
            for reach in (abs(apart[0] - length), apart[0] + length)
        ]
        return (
            f": {state}: it closes at a way from {ways[0]:.4g} m to {ways[1]:.4g} m; change range or lengths"
        )
    angles = (group.course_at(MATH, q).place for q in places)
    both = [(math.sqrt(group.reach(MATH, x)[1].squared()), d) for x, d in zip(angles, apart, strict=True)]
    limits = max(abs(reach - d) for reach, d in both), min(reach + d for reach, d in both)
    return f": {state}, its arms reach over {_mm(both[0][0])}; {_remedy({lever.name: limits})}"


def _remedy(limits: Mapping[str, tuple[float, float]]) -> str:
    """The lengths that close a group all the way, by link its least and its largest one [m]."""
    fits = []
    for name, (low, high) in limits.items():
        if high - low > _ROUNDED * low:
            most_text = "" if high == math.inf else f" and {_mm(high, -1.0)}"
            fits.append(
                f"a length of {name} {'between' if most_text else 'above'} {_mm(low, 1.0)}{most_text}"
            )
    return f"{' or '.join(fits)} closes it all the way" if fits else "change its lengths"


def _mm(length: float, sense: float = 0.0) -> str:
    """A length in four digits; as a limit that is rounded upward if `sense` is +1, downward if it is -1."""
    return f"{1e3 * (rounded_inward(length, sense) if sense else length):.4g} mm"
