"""The stored study that is handed over: its entries by their paths, and the load of the motor's shaft over time."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...core.errors import InputError, printable
from ...core.inputs import cells_of, dataset, file_text, lines_of_table
from ...reading.result_entries import as_mapping
from ...report.series import LOAD_CYCLE_HEADS, SERIES, STEADY_BEGIN
from ...study.record import LOAD_CYCLE
from ...study.stored_result import StoredResult, read_result

_CLOSE = 1e-6
"""Difference, relative to the largest value, up to which a series is that of load_cycle.csv, which has nine
digits."""


class ShaftCycle(NamedTuple):
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
    """torque that the motor gives to the load, with the torque that accelerates the machine [N m]"""


class StudiedDrive(NamedTuple):
    """The result of a study in its folder, without its overloads. The path of an entry is its names and places in
    lists with / between them, such as ``sizing/candidates/0/ratio``."""

    result: StoredResult
    steady: ShaftCycle
    """the steady turns, those of load_cycle.csv"""
    inertia: np.ndarray
    """inertia of the load at the motor's shaft in the steady turns [kg m2], shape (time,)"""
    run: ShaftCycle
    """start-up and steady running"""
    supply_power: np.ndarray | None
    """electric power that the motor takes in the steady turns [W], shape (time,); None where it is not known"""

    def number(self, *paths: str) -> float | None:
        """The first number of these paths that is known and not 0, in its unit there; else that of the last path."""
        number = None
        for path in paths:
            value = self._entry(f"{path}/value")
            number = float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None
            if number:
                break
        return number

    def text(self, path: str) -> str:
        """The text of the result at a path; empty where it has none."""
        text = self._entry(path)
        return printable(text, 2000) if isinstance(text, str) else ""

    def rows(self, path: str) -> list[Mapping[str, Any]]:
        """The rows of the list at a path; none where there is none."""
        rows = self._entry(path)
        return [as_mapping(row) for row in rows] if isinstance(rows, list) else []

    def ordered(self, kind: str) -> Mapping[str, Any]:
        """The row of a catalogue that is a part of the drive of sizing, by its kind: "motor", "gear", "torque
        limiter"; empty where the part is of no catalogue of the user."""
        return next((row for row in self.rows("sizing/parts/parts") if row.get("part") == kind), {})

    def _entry(self, path: str) -> Any:
        """The entry of result.json at a path such as ``sizing/candidates/0/gear``; None where there is none."""
        node: Any = self.result.data
        for name in path.split("/"):
            if isinstance(node, list):
                node = dict(enumerate(node)).get(int(name))
            else:
                node = as_mapping(node).get(name)
        return node


def read_study(folder: Path) -> StudiedDrive:
    """The study in a folder of ``chainunit study``.

    Raises
    ------
    InputError
        where the folder has no complete result, or no steady turn of the motor's shaft.
    """
    result = read_result(folder)
    folder = result.file.parent
    if result.data.get("status") != "complete":
        raise InputError(f"{folder}: the study is not complete ({result.words('status')}); run it again")
    if not (folder / LOAD_CYCLE).is_file():
        raise InputError(
            f"{folder}: has no {LOAD_CYCLE}, as its machine makes no whole turn in steady running; a sizing needs one"
        )
    try:
        time, speed, torque, inertia = load_cycle(folder / LOAD_CYCLE)
        start = dataset(folder / SERIES, "start_up")
    except InputError as error:
        raise InputError(f"{error}; run the study again") from error
    if STEADY_BEGIN not in start.attrs:
        raise InputError(
            f"{folder / SERIES}: does not say when the steady turns begin, as an earlier version wrote it; run the "
            "study again"
        )
    missing = [name for name in ("motor.phi", "motor.w", "motor.a") if name not in start]
    if missing:
        raise InputError(
            f"{folder / SERIES}: has no {', '.join(missing)}: its motor is an FMU that does not give the motion of "
            "its shaft by these names"
        )
    of_run = start["time"].values
    instants = float(start.attrs[STEADY_BEGIN]) + time

    def in_steady(variable: str) -> np.ndarray:
        return np.interp(instants, of_run, start[variable].values)

    # load_cycle.csv has the torque of the shaft behind the motor, of which part depends on the line
    torques = [name for name in map(str, start) if name.count(".") == 1 and name.endswith(".tau")]
    gaps = {name: float(np.max(np.abs(in_steady(name) - torque))) for name in torques}
    nearest = min(gaps, key=lambda name: gaps[name], default="")
    if not nearest or gaps[nearest] > _CLOSE * float(np.max(np.abs(torque))):
        raise InputError(f"{folder}: {SERIES} and {LOAD_CYCLE} are not of the same run; run the study again")
    angle, whole_angle = in_steady("motor.phi"), start["motor.phi"].values
    return StudiedDrive(
        result,
        ShaftCycle(time, angle - angle[0], speed, in_steady("motor.a"), torque),
        inertia,
        ShaftCycle(
            of_run - of_run[0],
            whole_angle - whole_angle[0],
            start["motor.w"].values,
            start["motor.a"].values,
            start[nearest].values,
        ),
        in_steady("motor.supply_power") if "motor.supply_power" in start else None,
    )


def load_cycle(file: Path) -> np.ndarray:
    """Time, speed, torque and inertia of a load_cycle.csv, shape (4, time).

    Raises
    ------
    InputError
        for other heads, fewer than two rows, cells that are no finite numbers, and a time that runs backwards.
    """
    rows = cells_of(file, lines_of_table(file, file_text(file)), ",")
    if not rows or tuple(rows[0]) != LOAD_CYCLE_HEADS:
        raise InputError(f"{file}: the first line of a load cycle must be {','.join(LOAD_CYCLE_HEADS)}")
    try:
        columns = np.array([[*map(float, column[1:])] for column in zip(*rows, strict=True)])
    except ValueError:
        raise InputError(f"{file}: a row of the load cycle is not four numbers") from None
    if columns.shape[1] < 2 or not np.isfinite(columns).all():
        raise InputError(f"{file}: the load cycle must have at least two rows of finite numbers")
    time = columns[0]
    for k in np.flatnonzero(np.diff(time) < 0.0)[:1]:
        raise InputError(f"{file}: the time runs backwards, from {time[k]:.9g} s to {time[k + 1]:.9g} s")
    return columns
