"""The load of the motor's shaft over time: as a study has it, in the CSV of the template, and read back from it.

The columns of the CSV are those of ``MetadataRotativeMotionFile``. The template's load torque acts on the turning
mass from outside, positive along a growing angle: the torque that the motor must give is its negative. It holds all
of that torque, also the part that accelerates the machine, whose inertia changes over the turn;
``MomentOfInertiaOfLoad`` of the template is one number, and stays empty, so that no reader adds an inertia twice. The
inertia over the turn is a column of load_cycle.csv."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ...core.errors import InputError, printable
from ...core.inputs import cells_of, decoded, file_text, lines_of_table
from .rows import as_rows
from .shell import environment_of
from .template import ROOT, elements

SECTION = f"{ROOT}/ApplicationRequirements/MotionPattern/MotionPatternSections/RotativeSection"
COLUMNS = ("Time", "AngularPosition", "AngularVelocity", "AngularAcceleration", "LoadTorque")
"""The names of the columns, elements of ``MetadataRotativeMotionFile``."""


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


def headings() -> list[str]:
    """The headings of the CSV: name and unit of each column."""
    units = (elements()[f"{SECTION}/MetadataRotativeMotionFile/{name}"].unit for name in COLUMNS)
    return [f"{name} [{unit}]" for name, unit in zip(COLUMNS, units, strict=True)]


def as_csv(cycle: ShaftCycle) -> str:
    """The CSV of the template: headings, then a row for each instant; separated by ``;``, with decimal points."""
    columns = cycle.time, cycle.angle, cycle.speed, cycle.acceleration, -cycle.torque
    return as_rows(headings(), ([f"{x + 0.0:.9g}" for x in row] for row in zip(*columns, strict=True)))


def read_cycle(file: str | Path, section: str = "RotativeSection") -> ShaftCycle:
    """The load of the motor's shaft from the files of ``chainunit handover``.

    Parameters
    ----------
    file : sizing.aasx, sizing.json with the CSV beside it, or the CSV itself
    section : name of the motion section in a shell: ``RotativeSection`` is the steady turns, ``RotativeSection02``
        the whole run

    Returns
    -------
    the cycle; with the inertia where the shell links a load_cycle.csv with the same instants

    Raises
    ------
    InputError
        for a file that is none of these, or has no such section; for an AASX without basyx-python-sdk.
    """
    path = Path(file)
    if path.suffix.lower() == ".csv":
        return _of_csv(file_text(path), path)
    environment, supplement = environment_of(path)
    sections = _at(_submodel(environment, path), SECTION.split("/")[1:-1])
    own = next((each for each in sections if each.get("idShort") == section), None)
    if own is None:
        names = ", ".join(str(each.get("idShort")) for each in sections) or "none"
        raise InputError(f"{path}: has no motion section {printable(section)}; it has {names}")
    name = next((each.get("value") for each in own["value"] if each["idShort"] == "MotionSectionFile"), None)
    if not name:
        raise InputError(f"{path}: the MotionSectionFile of {section} names no file")
    cycle = _of_csv(decoded(path, supplement(name)), path)
    links = _at(_submodel(environment, path), ["SizingProjectInformation"])
    plain = [each["value"] for each in links if str(each.get("value", "")).endswith("load_cycle.csv")]
    return _with_inertia(cycle, supplement(plain[0]), f"{path}: {plain[0]}") if plain else cycle


def _submodel(environment: Mapping[str, Any], path: Path) -> Mapping[str, Any]:
    own = [each for each in environment.get("submodels", []) if each.get("idShort") == ROOT]
    if not own:
        raise InputError(f"{path}: has no submodel {ROOT}; chainunit handover writes one")
    return own[0]


def _at(submodel: Mapping[str, Any], names: Sequence[str]) -> list[dict[str, Any]]:
    """The elements below the collection with these names; none where there is no such collection."""
    below: list[dict[str, Any]] = submodel.get("submodelElements", [])
    for name in names:
        below = next((each.get("value", []) for each in below if each.get("idShort") == name), [])
    return below


def _of_csv(text: str, path: Path) -> ShaftCycle:
    rows = cells_of(path, lines_of_table(path, text), ";")
    if not rows or rows[0] != headings():
        raise InputError(f"{path}: the first line of the motion section must be {';'.join(headings())}")
    try:
        values = np.array(rows[1:], float)
    except ValueError as error:
        raise InputError(f"{path}: a row of the motion section is not {len(COLUMNS)} numbers") from error
    if values.ndim != 2 or len(values) < 2 or not np.all(np.isfinite(values)):
        raise InputError(f"{path}: the motion section must have at least two rows of finite numbers")
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


def _with_inertia(cycle: ShaftCycle, content: bytes, name: str) -> ShaftCycle:
    """The cycle with the inertia of the load_cycle.csv of this `name`, where this has the same instants."""
    try:
        time, _, _, inertia = load_cycle(content)
    except ValueError as error:
        raise InputError(
            f"{name}: must have four columns of numbers: time, speed, torque, inertia ({printable(str(error))})"
        ) from error
    if time.shape != cycle.time.shape or not np.allclose(time, cycle.time, rtol=1e-8, atol=1e-12):
        return cycle
    return replace(cycle, inertia=inertia)
