"""The stored study that is handed over: its numbers, and the load of the motor's shaft over time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, date, datetime
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...core.errors import InputError, printable
from ...core.inputs import dataset, file_bytes
from ...reading.result_entries import as_mapping
from ...report.series import SERIES, STEADY_BEGIN
from ...study.record import LOAD_CYCLE
from ...study.stored_result import StoredResult, read_result
from .cycle import ShaftCycle, load_cycle

if TYPE_CHECKING:
    import xarray as xr

_CLOSE = 1e-6
"""Difference, relative to the largest value, up to which a series is that of load_cycle.csv, which has nine
digits."""


@dataclass(frozen=True)
class StudiedDrive:
    """The result of a study in its folder, without its overloads."""

    result: StoredResult
    steady: ShaftCycle
    """the steady turns, those of load_cycle.csv"""
    run: ShaftCycle
    """start-up and steady running"""
    supply_power: np.ndarray | None
    """electric power that the motor takes in the steady turns [W], shape (time,); None where it is not known"""
    files: Mapping[str, bytes] = field(repr=False)
    """the content of result.json and load_cycle.csv, by name"""

    def number(self, *path: str) -> float | None:
        """The number of the result at a path, in its unit there; None where it has none."""
        return _number(self.result.data, *path)

    def text(self, *path: str) -> str:
        """The text of the result at a path; empty where it has none."""
        node = _at(self.result.data, *path)
        return printable(node, 2000) if isinstance(node, str) else ""

    @cached_property
    def written(self) -> datetime:
        """The time at which the result was written."""
        return datetime.fromtimestamp(int(self.result.file.stat().st_mtime), UTC)

    @property
    def dated(self) -> datetime:
        """The date of the report, where the study file gives one in ISO 8601; else the time of the result."""
        try:
            day = date.fromisoformat(self.text("report", "date"))
        except ValueError:
            return self.written
        return datetime(day.year, day.month, day.day, tzinfo=UTC)

    @property
    def candidates(self) -> list[Mapping[str, Any]]:
        """The candidates of sizing by their rank; none without sizing."""
        rows = _at(self.result.data, "sizing", "candidates")
        return [as_mapping(row) for row in rows] if isinstance(rows, list) else []

    @property
    def checks(self) -> list[Mapping[str, Any]]:
        """The checks by clause; none without."""
        rows = _at(self.result.data, "checks", "rows")
        return [as_mapping(row) for row in rows] if isinstance(rows, list) else []

    @property
    def best(self) -> Mapping[str, Any]:
        """The candidate with which all runs are; empty without sizing."""
        sizing = as_mapping(self.result.data.get("sizing"))
        place = sizing.get("nearest") if sizing.get("chosen") is None else sizing["chosen"]
        return self.candidates[place] if isinstance(place, int) else {}

    def ordered(self, kind: str) -> Mapping[str, Any]:
        """The row of a catalogue that is a part of the drive of sizing, by its kind: "motor", "gear", "torque
        limiter"; empty where the part is of no catalogue of the user."""
        parts = _at(self.result.data, "sizing", "parts", "parts")
        rows = map(as_mapping, parts if isinstance(parts, list) else ())
        return next((row for row in rows if row.get("part") == kind), {})

    @property
    def flexible_coupling(self) -> Mapping[str, Any]:
        """The row of a catalogue that is the flexible coupling; empty where no row carries the torque."""
        rows = _at(self.result.data, "checks", "flexible_coupling", "candidates")
        first = as_mapping(rows[0]) if isinstance(rows, list) and rows else {}
        return first if first.get("verdict") == "chosen" else {}

    def check(self, name: str, part: str) -> float | None:
        """A number of a check of the drive of sizing: its ``value``, ``limit`` or ``utilisation``."""
        return _number(self.best, "checks", name, part)

    @property
    def inverter_current(self) -> float | None:
        """The least rated current of the inverter that the drive of sizing needs [A]."""
        return self.number("sizing", "inverter", "rated_current")


def _at(node: Any, *path: str) -> Any:
    """What stands at a path below a node; None where nothing does."""
    for name in path:
        node = as_mapping(node).get(name)
    return node


def _number(node: Any, *path: str) -> float | None:
    """The number of the entry at a path below a node; None where there is none."""
    value = _at(node, *path, "value")
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None


def read_study(folder: Path) -> StudiedDrive:
    """The study in a folder of ``chainunit study``.

    Raises
    ------
    InputError
        where the folder has no complete result, or no steady turn of the motor's shaft.
    """

    result = read_result(folder)
    if not folder.is_dir():
        folder = result.file.parent
    if result.data.get("status") != "complete":
        raise InputError(f"{folder}: the study is not complete ({result.words('status')}); run it again")
    if not (folder / LOAD_CYCLE).is_file():
        raise InputError(
            f"{folder}: has no {LOAD_CYCLE}, as its machine makes no whole turn in steady running; a sizing needs one"
        )
    files = {name: file_bytes(folder / name) for name in (result.file.name, LOAD_CYCLE)}
    try:
        plain = load_cycle(files[LOAD_CYCLE])
    except ValueError as error:
        raise InputError(
            f"{folder / LOAD_CYCLE}: is no load cycle, which has four columns ({printable(str(error))}); run the "
            "study again"
        ) from error
    try:
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
    instants = float(start.attrs[STEADY_BEGIN]) + plain[0]
    torque = _torque(start, instants, plain[2], folder)
    power = start.get("motor.supply_power")
    time = start["time"].values
    return StudiedDrive(
        result,
        _steady(start, instants, plain),
        ShaftCycle(
            time - time[0],
            start["motor.phi"].values - float(start["motor.phi"][0]),
            start["motor.w"].values,
            start["motor.a"].values,
            torque,
        ),
        None if power is None else np.interp(instants, time, power.values),
        files,
    )


def _steady(start: xr.Dataset, instants: np.ndarray, plain: np.ndarray) -> ShaftCycle:
    """The steady turns: speed, torque and inertia as load_cycle.csv has them, angle and acceleration of the same
    rows."""
    time, speed, torque, inertia = plain
    angle, acceleration = (
        np.interp(instants, start["time"].values, start[f"motor.{x}"].values) for x in ("phi", "a")
    )
    return ShaftCycle(time, angle - angle[0], speed, acceleration, torque, inertia)


def _torque(start: xr.Dataset, instants: np.ndarray, wanted: np.ndarray, folder: Path) -> np.ndarray:
    """The torque of the motor's shaft in the whole run [N m], shape (time,): the variable that load_cycle.csv has in
    the steady turns. Of which part of the drive it is depends on the parts between motor and machine."""
    names = [
        str(name) for name in start.data_vars if str(name).count(".") == 1 and str(name).endswith(".tau")
    ]
    gaps = {
        name: float(np.max(np.abs(np.interp(instants, start["time"].values, start[name].values) - wanted)))
        for name in names
    }
    best = min(gaps, key=lambda name: gaps[name], default="")
    if not best or gaps[best] > _CLOSE * float(np.max(np.abs(wanted))):
        raise InputError(f"{folder}: {SERIES} and {LOAD_CYCLE} are not of the same run; run the study again")
    torque: np.ndarray = start[best].values
    return torque
