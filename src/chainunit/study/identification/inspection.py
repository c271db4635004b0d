"""Faults of a recording that would spoil an identification, each with its column and a remedy."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...errors import InputError
from ...refusals import unit_behind
from ..arrays import rms, stretches
from .measurands import MEASURANDS
from .recording import Recording

MISSING = 0.2
"""Largest share of rows that may be missing."""
LEAST_ROWS = 40.0
"""Fewest rows in a turn of the crank: the torque has orders up to some 20."""
FEWEST_TURNS = 3.0
STUCK = 0.2
"""Longest time for which a column with noise may keep its value [s]."""
CLIPPED = 2e-3
"""Largest share of rows at the same extreme value, in parts of all rows."""
STANDS = 0.05
"""Mean speed, in parts of the expected one, below which the machine stands."""
_ROWS_STUCK = 20
OF_SPEED = ("motor.w", "crank.w", "motor.u")
"""Quantities whose sizes follow from the speed."""


@dataclass(frozen=True)
class Expectation:
    """The sizes that a column can have: its RMS lies between `low` and `high`; `words` say from where the upper limit
    comes. A quantity that is `driving` has a mean of the sign of the speed."""

    low: float
    high: float
    words: str
    driving: bool = False

    def admits(self, size: float) -> bool:
        """Whether the RMS can have this size."""
        return self.low <= size <= self.high


def inspect(
    recording: Recording, expected: Mapping[str, Expectation], crank_speed: float, ratio: float
) -> list[InputError]:
    """The faults of a recording of a running machine.

    Parameters
    ----------
    expected : by quantity, the sizes that its column can have
    crank_speed : the usual speed of the crank [rad/s]
    ratio : motor turns per crank turn
    """
    faults = [*_rows(recording, crank_speed)]
    stands = _stands(recording, crank_speed, ratio)
    if stands:
        return [*faults, *stands]
    sizes = {name: rms(x) for name, x in recording.columns.items()}
    swapped = _swapped(sizes, expected)
    if swapped:
        first, second = swapped
        faults.append(
            _fault(recording, first, f"RMS of {_size(first, sizes[first])} and of {recording.heads[second]} "
                   f"{_size(second, sizes[second])}: the two columns look swapped; exchange their heads")
        )  # fmt: skip
    for name, x in recording.columns.items():
        if name not in expected or (swapped and name in swapped):
            continue
        faults += _of_column(recording, name, x, sizes[name], expected[name])
    return faults


def _of_column(
    recording: Recording, name: str, x: Any, size: float, expected: Expectation
) -> Iterator[InputError]:
    stuck = _longest_constant(recording.time, x)
    extreme, share, at = _extremes(x)
    if stuck is not None and not (share > CLIPPED and x[stuck[0]] in (x.min(), x.max())):
        begin, end = recording.time[stuck[0]], recording.time[stuck[1]]
        words = f"keeps the value {_size(name, float(x[stuck[0]]))} from {begin:.3g} to {end:.3g} s: "
        words += "the sensor or the logger is stuck; " + (
            "record again" if end - begin > 0.5 * (recording.time[-1] - recording.time[0]) else
            "leave this part out (begin, end), or record again"
        )  # fmt: skip
        yield _fault(recording, name, words)
        return
    if not expected.admits(size):
        yield _fault(recording, name, _scale_words(name, size, expected))
        return
    if expected.driving and float(np.mean(x)) < 0.0:
        yield _fault(
            recording, name,
            f"mean of {_size(name, float(np.mean(x)))}, although the motor drives: the sign is reversed; change the "
            "sign of the column, or turn the sensor round",
        )  # fmt: skip
    if share > CLIPPED and at >= 3:
        yield _fault(
            recording, name,
            f"{100.0 * share:.2g} % of the rows have its {extreme} value, "
            f"{_size(name, float(x.max() if extreme == 'largest' else x.min()))}: it is clipped; record again with a "
            "larger range of the sensor",
        )  # fmt: skip


def _rows(recording: Recording, crank_speed: float) -> Iterator[InputError]:
    step, turn = recording.step, 2.0 * math.pi / crank_speed
    if turn / step < LEAST_ROWS:
        yield _fault(
            recording, "time",
            f"{1.0 / step:.3g} rows a second are {turn / step:.2g} in a turn of the crank; record >= "
            f"{LEAST_ROWS / turn:.2g} rows a second, better 200",
        )  # fmt: skip
    if recording.missing > MISSING:
        begin, end = max(recording.gaps, key=lambda gap: gap[1] - gap[0])
        yield _fault(
            recording, "time",
            f"{100.0 * recording.missing:.0f} % of the rows are missing, {end - begin:.3g} s of them in one piece "
            f"from {begin:.3g} s; must be <= {100.0 * MISSING:.0f} %: name a part without gaps (begin, end), or "
            "record again",
        )  # fmt: skip
    span = float(recording.time[-1] - recording.time[0])
    if span < FEWEST_TURNS * turn:
        yield _fault(
            recording, "time",
            f"{span:.3g} s are {span / turn:.2g} turns of the crank; record >= {FEWEST_TURNS:.0f} turns",
        )  # fmt: skip


def _stands(recording: Recording, crank_speed: float, ratio: float) -> list[InputError]:
    """That the machine does not turn, by the first column that tells."""
    for name, of in (("motor.w", ratio), ("crank.w", 1.0)):
        if name in recording.columns:
            mean = float(np.mean(recording.columns[name]))
            if abs(mean) < STANDS * crank_speed * of:
                return [_standing(recording, name, f"mean of {_size(name, mean)}")]
    if "motor.count" in recording.columns and np.ptp(recording.columns["motor.count"]) < 4.0:
        return [_standing(recording, "motor.count", "does not change")]
    if "mark" in recording.columns and not np.any(recording.columns["mark"]):
        turns = (recording.time[-1] - recording.time[0]) * crank_speed / (2.0 * math.pi)
        if turns > FEWEST_TURNS:
            return [_standing(recording, "mark", f"is not passed in {turns:.0f} turns")]
    return []


def _standing(recording: Recording, name: str, words: str) -> InputError:
    return _fault(
        recording,
        name,
        f"{words}: the machine stands, or the sensor is not connected; record the running machine",
    )


def _scale_words(name: str, size: float, expected: Expectation) -> str:
    words = f"RMS of {_size(name, size)}"
    limit = f"must be from {_size(name, expected.low)} to {_size(name, expected.high)} ({expected.words})"
    unit = MEASURANDS[name].unit
    for factor, prefix in ((1e-3, "m"), (1e3, "k")):
        if expected.admits(size * factor):
            return (
                f"{words}; {limit}: the values look like {prefix}{unit}; write [{prefix}{unit}] into its head"
            )
    more = ", crank_speed and machine.ratio" if name in OF_SPEED else ""
    return f"{words}; {limit}: check the sensor, the unit in its head{more}"


def _swapped(sizes: Mapping[str, float], expected: Mapping[str, Expectation]) -> tuple[str, str] | None:
    """Two columns of which neither can have its size, and each can have that of the other one."""
    wrong = [name for name, size in sizes.items() if name in expected and not expected[name].admits(size)]
    for k, first in enumerate(wrong):
        for second in wrong[k + 1 :]:
            if expected[first].admits(sizes[second]) and expected[second].admits(sizes[first]):
                return first, second
    return None


def _longest(stretched: list[tuple[int, int]]) -> tuple[int, int]:
    return max(stretched, key=lambda ends: ends[1] - ends[0], default=(0, 0))


def _longest_constant(time: Any, x: Any) -> tuple[int, int] | None:
    """First and last row of the longest part in which the column keeps its value, if that is too long."""
    begin, end = _longest(stretches(np.diff(x) == 0.0))
    return (begin, end) if end - begin >= _ROWS_STUCK and time[end] - time[begin] >= STUCK else None


def _extremes(x: Any) -> tuple[str, float, int]:
    """Which extreme value more rows have, their share, and the length of the longest series of them."""
    found = []
    for name, value in (("largest", x.max()), ("least", x.min())):
        begin, end = _longest(stretches(x == value))
        found.append((float(np.mean(x == value)), end - begin, name))
    share, longest, name = max(found)
    return name, share, longest


def _size(name: str, x: float) -> str:
    return f"{x:.4g}{unit_behind(MEASURANDS[name].unit)}"


def _fault(recording: Recording, name: str, words: str) -> InputError:
    return InputError(f"{recording.source}, column {recording.heads[name]}: {words}")
