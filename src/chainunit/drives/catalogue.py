"""Standard motors: the packaged table, and rows of the user's own.

The packaged table holds cage motors for 400 V, 50 Hz, 0.55 to 75 kW, with 2, 4 and 6 poles, in the frames of
EN 50347. Their efficiencies are the limits of class IE3 in IEC 60034-30-1. Everything else is typical of such motors
and of no maker's: it varies smoothly with size, and stands in for the catalogue of the supplier.

A user's file has the same columns. In CSV a heading is the name of a value, with its unit in brackets where it
has one ("power [kW]", "speed [rev/min]"); in TOML each motor is a table ``[[motor]]``, a number is in the
declared SI unit, and a text may carry a unit ("1455 rev/min"). Columns that have a start value may be left out.
"""

from __future__ import annotations

import csv
import difflib
import io
import re
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from ..errors import InputError, near_name, refusal_prefix, shown
from ..quantities import DISPLAY_UNITS, Layout, Value, Variable, declaration, quantity
from ..reading import file_text, packaged, to_number, toml
from .induction_motor import InductionMotor
from .motor import Motor
from .nameplate import Identification, Nameplate, check, identify


@declaration
class CatalogueData(Nameplate):
    """A nameplate, and the other values of a catalogue."""

    mass: Value = quantity("kg", "mass; 0: unknown", default=0.0, min=0.0)
    starts: Value = quantity(
        "1",
        "permitted starts direct on line in an hour, without load; 0: unknown",
        default=0.0,
        min=0.0,
        max=1e5,
    )


LAYOUT = Layout(CatalogueData)
_VARIABLES = {v.name: v for v in LAYOUT.variables}
TEXTS = {"designation": "name of the motor, as [system] names it", "source": "where its values are from"}
"""Columns of words, with their descriptions."""
_LONGEST = 200
_HEADING = re.compile(r"\s*(\w+)\s*(?:\[\s*(.*?)\s*\])?\s*")


@dataclass(frozen=True)
class CatalogueMotor:
    """A motor of the catalogue; `origin` is the file and row it comes from, `source` that of its values."""

    designation: str
    nameplate: CatalogueData
    source: str
    origin: str

    def identify(self) -> Identification:
        """Its equivalent circuit; see `chainunit.drives.nameplate.identify`.

        Raises
        ------
        InputError
            in one line, where no circuit meets its nameplate.
        """
        with refusal_prefix(f"{self.origin}: {self.designation}: "):
            return identify(self.nameplate)

    def model(self) -> tuple[type[Motor], Any]:
        """The model of the motor, and its parameters.

        Raises
        ------
        InputError
            see `identify`.
        """
        return InductionMotor, self.identify().parameters


def heading(variable: Variable) -> str:
    """Name and unit of a column, in the unit that engineers read."""
    unit = DISPLAY_UNITS.get(variable.unit, (variable.unit,))[0]
    return variable.name if unit == "1" else f"{variable.name} [{unit}]"


def catalogue(extra: Path | None = None) -> list[CatalogueMotor]:
    """The packaged motors, and behind them those of the file `extra` (CSV; TOML where its name ends in .toml).

    Raises
    ------
    InputError
        in one line: the file, the row, the field, its value and the allowed range.
    """
    motors = list(_packaged())
    if extra is not None:
        rows = _toml_rows if extra.suffix.lower() == ".toml" else _csv_rows
        motors += _motors(rows(file_text(extra), str(extra)), {m.designation for m in motors})
    return motors


def motor_of_catalogue(
    designation: str, extra: Path | None = None, others: Collection[str] = ()
) -> CatalogueMotor:
    """The motor with this `designation`, of the packaged ones and those of the file `extra`; `others` are names that
    may have been meant.

    Raises
    ------
    InputError
        in one line, with the nearest designations, where there is none; and see `catalogue`.
    """
    motors = {m.designation: m for m in catalogue(extra)}
    if designation not in motors:
        near = difflib.get_close_matches(designation, motors, n=3, cutoff=0.0)
        hint = near_name(designation, (*motors, *others))
        raise InputError(
            f"{shown(designation)}: not in the catalogue; must be one of its designations, such as "
            + ", ".join(f'"{name}"' for name in near)
            + hint
        )
    return motors[designation]


def check_own(extra: Path | None) -> None:
    """Read the user's rows and fit a circuit to each.

    Raises
    ------
    InputError
        see `catalogue` and `CatalogueMotor.identify`.
    """
    for motor in catalogue(extra)[len(_packaged()) :]:
        motor.identify()


@cache
def _packaged() -> tuple[CatalogueMotor, ...]:
    name = "motors.csv"
    return tuple(_motors(_csv_rows(packaged(name), name), set()))


def _motors(rows: Iterator[tuple[str, Mapping[str, Any]]], others: set[str]) -> list[CatalogueMotor]:
    motors = []
    for origin, row in rows:
        try:
            motors.append(_motor(origin, row, others))
        except ValueError as error:
            raise InputError(f"{origin}: {error}") from error
        others.add(motors[-1].designation)
    return motors


def _motor(origin: str, row: Mapping[str, Any], others: set[str]) -> CatalogueMotor:
    for name in row:
        if name not in _VARIABLES and name not in TEXTS:
            raise InputError(f"{shown(name)}: unknown; known here: {', '.join((*TEXTS, *_VARIABLES))}")
    texts = {}
    for name in TEXTS:
        text = row.get(name, origin if name == "source" else "")
        if not isinstance(text, str) or not text.strip() or not text.isprintable() or len(text) > _LONGEST:
            raise InputError(
                f"{name} = {shown(text)}: must be a text of one line, of at most {_LONGEST} characters"
            )
        texts[name] = text.strip()
    if texts["designation"] in others:
        raise InputError(f"designation = {shown(texts['designation'])}: stands in the catalogue already")
    values = {}
    for name, variable in _VARIABLES.items():
        if name in row:
            values[name] = to_number(variable, row[name])
        elif variable.quantity.start is None:
            raise InputError(
                f"{name}: is missing; must be {variable.quantity.allowed_range} ({variable.description})"
            )
    nameplate = LAYOUT.from_names(values)
    check(nameplate)
    return CatalogueMotor(nameplate=nameplate, origin=origin, **texts)


def _csv_rows(text: str, file: str) -> Iterator[tuple[str, Mapping[str, Any]]]:
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    try:
        rows = [(reader.line_num, row) for row in reader if any(cell.strip() for cell in row)]
    except csv.Error as error:
        raise InputError(f"{file}: line {reader.line_num}: no valid CSV: {error}") from error
    if not rows:
        raise InputError(f"{file}: is empty; must begin with a row of headings, parted by commas")
    columns = [_column(cell, file) for cell in rows[0][1]]
    names = [name for name, _ in columns]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{file}: {name}: has two columns")
    for line, row in rows[1:]:
        origin = f"{file}: line {line}"
        if len(row) != len(columns):
            raise InputError(f"{origin}: has {len(row)} cells; must have {len(columns)}, as the headings")
        yield (
            origin,
            {
                name: _with_unit(cell.strip(), unit)
                for (name, unit), cell in zip(columns, row, strict=True)
                if cell.strip()
            },
        )


def _column(cell: str, file: str) -> tuple[str, str]:
    match = _HEADING.fullmatch(cell)
    if match is None or (match[1] not in _VARIABLES and match[1] not in TEXTS):
        names = ", ".join((*TEXTS, *(heading(v) for v in _VARIABLES.values())))
        raise InputError(f"{file}: heading {shown(cell)}: unknown; known here: {names}")
    return match[1], match[2] or ""


def _with_unit(cell: str, unit: str) -> str:
    try:
        float(cell)
    except ValueError:
        return cell
    return f"{cell} {unit}" if unit else cell


def _toml_rows(text: str, file: str) -> Iterator[tuple[str, Mapping[str, Any]]]:
    with refusal_prefix(f"{file}: "):
        data = toml(text)
    tables = data.pop("motor", None)
    for name in data:
        raise InputError(f"{file}: {shown(name)}: unknown; each motor is a table [[motor]]")
    if tables is None:
        raise InputError(f"{file}: has no motor; each motor must be a table [[motor]]")
    if not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables):
        raise InputError(f"{file}: motor = {shown(tables)}: each motor must be a table [[motor]]")
    for number, table in enumerate(tables, 1):
        yield f"{file}: motor {number}", table
