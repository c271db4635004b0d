"""The load of the motor's shaft over time as CSV, and read back from it.

The load torque of the CSV acts on the turning mass from outside, positive along a growing angle: the torque that the
motor must give is its negative. It has all of that torque, also the part that accelerates the machine, whose inertia
changes over the turn; so no reader may add an inertia again. load_cycle.csv has the inertia over the turn."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...core.errors import InputError
from ...core.inputs import cells_of, file_text, lines_of_table
from .rows import as_rows

HEADINGS = (
    "Time [s]",
    "AngularPosition [rad]",
    "AngularVelocity [rad/s]",
    "AngularAcceleration [rad/s²]",
    "LoadTorque [Nm]",
)
"""The headings of the CSV."""


@dataclass(frozen=True)
class ShaftCycle:
    """The motor's shaft over time; every array has the shape (time,)."""

    time: np.ndarray
    """time from the first row [s]"""
    angle: np.ndarray
    """angle from the first row [rad]"""
    speed: np.ndarray
    """speed [rad/s]"""
    acceleration: np.ndarray
    """acceleration [rad/s2]"""
    torque: np.ndarray
    """torque that the motor gives to the load [N m], with the torque that accelerates it"""
    inertia: np.ndarray | None = None
    """inertia of the load at the motor's shaft [kg m2]; None where the file does not have it"""


def as_csv(cycle: ShaftCycle) -> str:
    """The CSV: headings, then a row for each instant; separated by ``;``, with decimal points."""
    columns = cycle.time, cycle.angle, cycle.speed, cycle.acceleration, -cycle.torque
    return as_rows(HEADINGS, ([f"{x + 0.0:.9g}" for x in row] for row in zip(*columns, strict=True)))


def read_cycle(file: str | Path) -> ShaftCycle:
    """The load of the motor's shaft from cycle.csv or run.csv of ``chainunit handover``.

    Raises
    ------
    InputError
        for a file that is none of these.
    """
    path = Path(file)
    rows = cells_of(path, lines_of_table(path, file_text(path)), ";")
    if not rows or tuple(rows[0]) != HEADINGS:
        raise InputError(f"{path}: the first line of the load must be {';'.join(HEADINGS)}")
    try:
        values = np.array(rows[1:], float)
    except ValueError as error:
        raise InputError(f"{path}: a row of the load is not {len(HEADINGS)} numbers") from error
    if values.ndim != 2 or len(values) < 2 or not np.all(np.isfinite(values)):
        raise InputError(f"{path}: the load must have at least two rows of finite numbers")
    time, angle, speed, acceleration, torque = values.T
    _check_time(time, f"{path}: ")
    return ShaftCycle(time, angle, speed, acceleration, -torque)


def load_cycle(content: bytes) -> np.ndarray:
    """Time, speed, torque and inertia of the content of a load_cycle.csv, shape (4, time).

    Raises
    ------
    ValueError
        where it has other columns, fewer than two rows, a number that is not finite, or a time that runs backwards.
    """
    try:
        values = np.array([line.split(",") for line in content.decode("utf-8").splitlines()[1:]], float)
    except ValueError:
        raise ValueError("a row is not four numbers") from None
    if values.ndim != 2 or values.shape[1] != 4 or len(values) < 2:
        raise ValueError(f"its shape is {values.shape}")
    if not np.all(np.isfinite(values)):
        raise ValueError("a number is not finite")
    _check_time(values[:, 0])
    return values.T


def _check_time(time: np.ndarray, place: str = "") -> None:
    back = np.flatnonzero(np.diff(time) < 0.0)
    if back.size:
        before, after = time[back[0]], time[back[0] + 1]
        raise InputError(f"{place}the time runs backwards, from {before:.9g} s to {after:.9g} s")
