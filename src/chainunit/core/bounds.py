"""Bounds of numbers, and the lines that refuse a number. Python FMUs carry this file."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from . import messages


def admits(x: Any, low: float, high: float, slack: float, open_low: bool, whole: bool) -> Any:
    """Whether the number `x`, or each of an array, is finite and inside the bounds, or beyond one by the `slack` at
    most, and, if it must be `whole`, a whole number. The bound `low` is not allowed itself if it is `open_low`."""
    above = x > low if open_low else x >= low - slack
    return (abs(x) < math.inf) & above & (x <= high + slack) & (not whole or x % 1 == 0)


def within(x: float, low: float, high: float) -> float:
    """The admitted number `x`; the bound in place of a number that is beyond it by rounding."""
    return low if x < low else high if x > high else x


def complaint(name: str, x: float, unit: str, allowed: str, bounded: bool, description: str) -> str:
    """The line that refuses the value `x` of a variable, which is `bounded` or any number."""
    if not math.isfinite(x):
        allowed = messages.FINITE.format(allowed=allowed) if bounded else messages.NUMBER
    line = messages.VALUE.format(name=name, value=x, unit=messages.unit_behind(unit), allowed=allowed)
    return f"{line} ({description})" if description else line


def refusal(
    subject: str,
    unit: str,
    why: str,
    remedy: str,
    context: Mapping[str, float],
    limits: Sequence[float],
) -> str:
    """The line that refuses a requirement that is not met. `limits` are its value, the lower and the upper limit, and
    `context` the parameters on which they depend."""
    value, low, high = limits
    unit = messages.unit_behind(unit)
    formats = (messages.FIRST_PARAMETER, *[messages.NEXT_PARAMETER] * len(context))
    parameters = "".join(
        f.format(name=n, value=x) for f, (n, x) in zip(formats, context.items(), strict=False)
    )
    sides = math.isfinite(low), math.isfinite(high)
    text = {(True, False): messages.ABOVE, (False, True): messages.BELOW}.get(sides, messages.BETWEEN)
    return messages.REQUIREMENT.format(
        subject=subject,
        value=value,
        unit=unit,
        why=why,
        parameters=parameters,
        limits=(text if low < high else messages.NO_VALUE).format(
            low=low, high=high, unit=unit, remedy=remedy
        ),
    )
