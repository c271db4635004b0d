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
    columns, time = recording.columns, recording.time
    if "motor.count" in columns:
        # the count is rounded down
        phi = angle + (columns["motor.count"] + 0.5) * (2.0 * math.pi / COUNTS) / ratio
        w = measured_speed(recording, ratio)
        return phi, _counted_speed(recording, phi) if w is None else w
    w, passed = measured_speed(recording, ratio), mark_times(recording)
    if w is None or len(passed) < 3:
        raise InputError(
            f"{recording.source}: the angle of the crank is not known; must have a column motor.count, or mark with "
            "three passes beside motor.w or crank.w"
        )
    way = np.concatenate([[0.0], np.cumsum(0.5 * (w[1:] + w[:-1]) * np.diff(time))])
    ahead = angle + 2.0 * math.pi * _turns(passed) - np.interp(passed, time, way)
    smooth = np.empty(len(passed))
    for k in range(len(passed)):
        near = slice(max(0, k - NEIGHBOURS), k + NEIGHBOURS + 1)
        smooth[k] = np.polynomial.Polynomial.fit(passed[near], ahead[near], 1)(passed[k])
    return way + _extended(time, passed, smooth), w


def _turns(passed: Any) -> Any:
    """The number of the turn at each pass; a gap may hide some."""
    gaps = np.diff(passed)
    return np.concatenate([[0.0], np.cumsum(np.round(gaps / np.median(gaps)))])


def _counted_speed(recording: Recording, phi: Any) -> Any:
    """The speed that an encoder gives with these angles."""
    half = max(1, round(0.5 * WINDOW / recording.step))
    last = len(phi) - 1
    later, sooner = (np.clip(np.arange(last + 1) + sign * half, 0, last) for sign in (1, -1))
    return (phi[later] - phi[sooner]) / (recording.time[later] - recording.time[sooner])


def _extended(time: Any, places: Any, values: Any) -> Any:
    """Linear between the points, and beyond them on the lines through their first and last ones."""
    inside = np.interp(time, places, values)
    few = min(len(places), NEIGHBOURS + 1)
    first, last = (
        np.polynomial.Polynomial.fit(places[s], values[s], 1) for s in (slice(few), slice(-few, None))
    )
    return np.where(time < places[0], first(time), np.where(time > places[-1], last(time), inside))
