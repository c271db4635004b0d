"""Rolling bearings in the place of pins: rating life by ISO 281 over the real cycle of force and swing, static safety
by ISO 76, and the swing below which the tracks of the rolling elements do not meet.

The life of a bearing that swings is counted by the way that it turns to and fro, as the amplitude factor of Harris:
a swing of theta from end to end, to and fro, is 2 theta/360 deg of a turn. Menck and Stammler, "Review of rolling
contact fatigue life calculation for oscillating bearings", Wind Energ. Sci. 9 (2024) 777, compare it with the other
factors.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from ...core.quantities import Value, declaration, quantity
from ...reading.results import part, result
from ...reading.text import number
from ...study.bearings import EXPONENT, mean_load
from .row import CheckRow, CheckRule, NotChecked

_ISO_281 = {"ball": "ISO 281:2007, 5.3", "roller": "ISO 281:2007, 7.3"}
_LIFE = {
    kind: CheckRule(
        "life", "rating life", _ISO_281[kind],
        f"L = a (C/P)^p 10^6 turns, p = {p}; P = (sum F^p |dphi| / sum |dphi|)^(1/p)",
        "a = life_factor; C = C; P = load; mean |dphi/dt| = speed", at_least=True,
    )
    for kind, p in (("ball", "3"), ("roller", "10/3"))
}  # fmt: skip
_LOAD = {
    kind: CheckRule(
        "load", "equivalent load", _ISO_281[kind],
        "P <= 0.5 C, and P <= C0: beyond it the formula of the life does not hold", "P = load; C = C; C0 = C0",
    )
    for kind in _ISO_281
}  # fmt: skip
_STATIC = CheckRule(
    "static_safety", "static safety ({run})", "ISO 76:2006, static safety factor",
    "S0 = C0/F, F: largest force of all runs", "C0 = C0; F = largest_force", at_least=True,
)  # fmt: skip
_SWING = CheckRule(
    "swing", "swing", "Rumbarger and Jones 1968; Harris, Rolling Bearing Analysis",
    "theta >= 4 pi/(Z (1 - gamma)): below it false brinelling threatens, and the rating life does not hold",
    "least = critical_swing", at_least=True,
)  # fmt: skip
_MILLION_TURNS = 2e6 * math.pi
MOST_LOAD = 0.5
"""Equivalent load over the dynamic load rating up to which the formula of the life holds."""


@declaration
class RollingNumbers:
    """The bearing in steady running, and the largest force of all runs; None for a bearing that does not turn or
    carries nothing, or whose data the file does not give."""

    C: Value = quantity("N", "dynamic load rating")
    C0: Value = quantity("N", "static load rating")
    p: Value = quantity("1", "exponent of the load")
    load: Value = quantity("N", "equivalent load P over the angle that it turns")
    speed: Value = quantity("rad/s", "mean speed to and fro")
    swing: Value = quantity("rad", "swing from end to end; none for a pin that turns round")
    amplitude_factor: Value = quantity("1", "a turn over the way that it turns in a turn of the {driver}")
    life_factor: Value = quantity("1", "factor a1 aISO of the life")
    life: Value = quantity("s", "rating life", kind="hours")
    needed: Value = quantity("N", "dynamic load rating for the life asked for")
    critical_swing: Value = quantity("rad", "swing from which the tracks of the rolling elements meet")
    largest_force: Value = quantity("N", "largest force of all runs")
    static_safety: Value = quantity("1", "static safety C0/F")


@result
class RollingBearing:
    """A rolling bearing; `run` has the largest force."""

    kind: str = part("ball or roller")
    run: str = part("the run with the largest force")
    numbers: RollingNumbers = part(inline=True)


def rating_life(C: float, load: float, p: float, speed: float, factor: float = 1.0) -> float:
    """Rating life [s] of a bearing with the dynamic load rating `C` [N] at the equivalent `load` [N], exponent `p`,
    and a mean `speed` to and fro [rad/s]: factor (C/P)^p million turns."""
    return factor * (C / load) ** p * _MILLION_TURNS / speed


def needed_rating(life: float, load: float, p: float, speed: float, factor: float = 1.0) -> float:
    """Dynamic load rating [N] with which a bearing has that `life` [s]; see `rating_life`."""
    return load * (life * speed / (_MILLION_TURNS * factor)) ** (1.0 / p)


def critical_swing(elements: float, ratio: float) -> float:
    """Swing from end to end [rad] from which the tracks of neighbouring rolling elements meet on both rings.

    The cage turns (1 - gamma)/2 of the swing against the outer ring and (1 + gamma)/2 against the inner one; on the
    outer ring this has to reach the distance of two elements, 2 pi/Z: theta = 4 pi/(Z (1 - gamma)). Below it the
    lubricant is not brought back, and false brinelling threatens.
    """
    return 4.0 * math.pi / (elements * (1.0 - ratio))


def turns_round(angle: Any) -> bool:
    """Whether a pin with these angles [rad], shape (n,), turns round in place of swinging."""
    return bool(abs(angle[-1] - angle[0]) > math.pi)


def rolling_bearing(
    kind: str, table: Any, time: Any, turns: float, force: Any, angle: Any, largest: float, run: str
) -> RollingBearing:
    """The bearing of that `kind` with the values of its `table`, over `turns` turns of the driver: `time` [s],
    `force` [N] and `angle` [rad] of the pin, each of shape (n,); its `largest` force [N] comes in `run`."""
    p, span = EXPONENT[kind], float(time[-1] - time[0])
    load, way = mean_load(force, angle, p), float(np.sum(np.abs(np.diff(angle))))
    speed, is_moved = way / span, load * way > 0.0
    terms = (table.C, load, p, speed, table.life_factor)
    swings = is_moved and not turns_round(angle)
    numbers = RollingNumbers(
        C=table.C,
        C0=table.C0,
        p=p,
        load=load,
        speed=speed,
        swing=float(np.ptp(angle)) if swings else None,
        amplitude_factor=2.0 * math.pi * turns / way if is_moved else None,
        life_factor=table.life_factor,
        life=rating_life(*terms) if is_moved else None,
        needed=needed_rating(table.life, *terms[1:]) if is_moved else None,
        critical_swing=critical_swing(table.elements, table.diameter_ratio) if table.elements else None,
        largest_force=largest,
        static_safety=table.C0 / largest if table.C0 and largest > 0.0 else None,
    )
    return RollingBearing(kind, run, numbers)


def checks(
    pin: str, bearing: RollingBearing, table: Any, path: str, run: str
) -> Iterator[CheckRow | NotChecked]:
    """The checks of a bearing whose numbers stand at `path` of the result; `run` is the title of the run with the
    largest force."""
    numbers = bearing.numbers
    least = numbers.critical_swing
    if numbers.swing is not None and least is not None and numbers.swing < least:
        why = (
            f"its swing of {number(numbers.swing, 'rad')} stays below {number(least, 'rad')}, from where on the "
            "formula holds; take a plain bearing, or ask the maker"
        )
        yield NotChecked(f"{pin}, rating life", why)
    else:
        yield _LIFE[bearing.kind].row(pin, path, numbers, table.life)
    most = MOST_LOAD * table.C
    yield _LOAD[bearing.kind].row(pin, path, numbers, min(most, table.C0) if table.C0 else most)
    if table.C0:
        yield _STATIC.row(pin, path, numbers, table.static_safety or 0.0, run)
    else:
        yield NotChecked(f"{pin}, static safety", "the file gives no static load rating C0")
    if numbers.swing is None:
        return
    if least is None:
        why = "the file does not give the number of rolling elements (elements)"
        yield NotChecked(f"{pin}, swing against false brinelling", why)
        return
    yield _SWING.row(pin, path, numbers, least)
