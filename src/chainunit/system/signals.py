"""Loads and references over time.

A signal is a number, or a function of the time [s]. If it jumps or bends, its attribute `corners` lists the times at
which it does so: a solver stops there.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..core.brief import briefly_shown
from ..core.declared_numbers import number_in
from ..core.errors import InputError, check_kind, shown

_CHANGES = "a list of (begin, duration, value after it)"


def _share(t: Any, begin: float, duration: float) -> Any:
    """The share of a change that is past at the time `t`, between 0 and 1; that of a float without numpy, ten times
    as fast for a solver."""
    if isinstance(t, float):
        return min(max((t - begin) / duration, 0.0), 1.0)
    return np.clip((np.asarray(t) - begin) / duration, 0.0, 1.0)


def _number(unit: str, name: str, value: Any, description: str) -> Any:
    """A number of a profile; the symbols of a page in which the machine runs stay as they are."""
    return value if getattr(value, "is_symbol", False) else number_in(unit, name, value, description)


def signals_by_name(signals: Mapping[str, Any] | None) -> dict[str, Any]:
    """A copy of the signals of a script.

    Raises
    ------
    InputError
        in one line, for another value than a mapping.
    """
    check_kind("signals", signals, Mapping | None, "a mapping of full names to numbers or functions of time")
    return dict(signals or {})


@briefly_shown
@dataclass(frozen=True)
class Profile:
    """A value with smooth changes at given times.

    `changes` lists (time at which the change begins [s], its duration [s], value after it), in order and
    without overlap; each change is a quintic step, continuous to the second derivative, so that a
    communication step or a solver meets no jump.

    Values are in the unit of the signal; times are in s, or texts or quantities of pint with a unit.

    Raises
    ------
    InputError
        where changes overlap, a duration is not positive, and for other values than numbers.
    """

    start: float
    changes: tuple[tuple[float, float, float], ...] = ()

    def __post_init__(self) -> None:
        check_kind("changes", self.changes, tuple | list, _CHANGES)
        changes = []
        for change in self.changes:
            if not isinstance(change, tuple | list) or len(change) != 3:
                raise InputError(f"changes = {shown(self.changes)}: must be {_CHANGES}", "changes")
            begin, duration, value = change
            changes.append(
                (
                    _number("s", "begin", begin, "time at which a change begins"),
                    _number("s", "duration", duration, "duration of a change"),
                    _number("1", "value", value, "value after a change, in the unit of the signal"),
                )
            )
        start = _number("1", "start", self.start, "value at the start, in the unit of the signal")
        object.__setattr__(self, "start", start)
        object.__setattr__(self, "changes", tuple(changes))
        free = -float("inf")
        for begin, duration, _ in self.changes:
            if duration <= 0.0 or begin < free:
                raise InputError(
                    f"change at t = {begin:g} s: must last > 0 s and begin after the one before ends"
                )
            free = begin + duration

    def __call__(self, t: Any) -> Any:
        """The value at time `t` (float or array)."""
        value: Any = self.start
        before = self.start
        for begin, duration, after in self.changes:
            s = _share(t, begin, duration)
            value = value + (after - before) * (s * s * s * (10.0 + s * (6.0 * s - 15.0)))
            before = after
        return value if np.ndim(t) else float(value)

    def rate(self, t: Any) -> Any:
        """The derivative of the value at time `t` (float or array)."""
        value: Any = 0.0
        before = self.start
        for begin, duration, after in self.changes:
            s = _share(t, begin, duration)
            value = value + (after - before) / duration * (30.0 * s * s * (1.0 - s) ** 2)
            before = after
        return value if np.ndim(t) else float(value)

    @property
    def corners(self) -> list[float]:
        """Times at which a change begins or ends."""
        return [x for begin, duration, _ in self.changes for x in (begin, begin + duration)]


@dataclass(frozen=True)
class Jump:
    """A value that is `before` up to and including the time `at` [s], and `after` later."""

    at: float
    before: float
    after: float

    def __call__(self, t: Any) -> Any:
        """The value at time `t` (float or array)."""
        value = np.where(np.asarray(t) > self.at, self.after, self.before)
        return value if np.ndim(t) else float(value)

    @property
    def corners(self) -> list[float]:
        """The time of the jump."""
        return [self.at]


def corners(signals: Iterable[Any]) -> list[float]:
    """Times at which one of the signals jumps or bends [s], in order."""
    return sorted({float(corner) for signal in signals for corner in getattr(signal, "corners", ())})


def at_time(signal: Any, t: Any) -> Any:
    """The value of a signal at the time `t` (float or array)."""
    return signal(t) if callable(signal) else signal
