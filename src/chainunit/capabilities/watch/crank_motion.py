"""The motion of the crank over a recording, for an observer that is fed with it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...core.errors import InputError
from ...recordings.measurands import COUNTS
from ...recordings.problem import mark_times, measured_speed
from ...recordings.recording import Recording

NEIGHBOURS = 4
"""Passes of the mark on both sides over which the instant of one is smoothed."""
WINDOW = 0.01
"""Time over which the count of an encoder gives a speed [s]."""


def crank_motion(recording: Recording, angle: float, ratio: float) -> tuple[Any, Any]:
    """Angle [rad] and speed [rad/s] of the crank at the rows of a recording, each of shape (n,).

    Between two passes of the mark the angle is the integral of the measured speed, laid on the passes. An encoder
    gives the angle itself, and the speed over `WINDOW`.

    Parameters
    ----------
    angle : of the crank at the mark, or at the first row of a recording with an encoder [rad]
    ratio : turns of the motor in a turn of the crank

    Raises
    ------
    InputError
        for a recording with neither an encoder nor a mark beside a speed.
    """
    from scipy.integrate import cumulative_trapezoid

    columns, time = recording.columns, recording.time
    w = measured_speed(recording, ratio)
    if "motor.count" in columns:
        # the count is rounded down
        phi = angle + (columns["motor.count"] + 0.5) * (2.0 * math.pi / COUNTS) / ratio
        return phi, _counted_speed(recording, phi) if w is None else w
    passed = mark_times(recording)
    if w is None or len(passed) < 3:
        raise InputError(
            f"{recording.source}: the angle of the crank is not known; must have a column motor.count, or mark with "
            "three passes beside motor.w or crank.w"
        )
    way, gaps = cumulative_trapezoid(w, time, initial=0.0), np.diff(passed)
    # a gap of the recording may hide some turns
    turns = np.append(0.0, np.cumsum(np.round(gaps / np.median(gaps))))
    ahead = angle + 2.0 * math.pi * turns - np.interp(passed, time, way)
    neighbours = (slice(max(0, k - NEIGHBOURS), k + NEIGHBOURS + 1) for k in range(len(passed)))
    smooth = [
        _line(passed[near], ahead[near])(instant) for near, instant in zip(neighbours, passed, strict=True)
    ]
    return way + _extended(time, passed, np.array(smooth)), w


def _line(x: Any, y: Any) -> Any:
    """The straight line through points, a polynomial."""
    return np.polynomial.Polynomial.fit(x, y, 1)


def _counted_speed(recording: Recording, phi: Any) -> Any:
    """The speed that an encoder gives with these angles."""
    half, rows = max(1, round(0.5 * WINDOW / recording.step)), np.arange(len(phi))
    later, sooner = np.minimum(rows + half, rows[-1]), np.maximum(rows - half, 0)
    return (phi[later] - phi[sooner]) / (recording.time[later] - recording.time[sooner])


def _extended(time: Any, places: Any, values: Any) -> Any:
    """Linear between the points, and beyond them on the lines through their first and last ones."""
    few = min(len(places), NEIGHBOURS + 1)
    first, last = _line(places[:few], values[:few])(time), _line(places[-few:], values[-few:])(time)
    outside = [time < places[0], time > places[-1]]
    return np.select(outside, [first, last], np.interp(time, places, values))
