"""Standard motors: the packaged table, and the rows of the user's file.

The packaged table has cage motors for 400 V, 50 Hz, 0.55 to 75 kW, with 2, 4 and 6 poles, in the frames of
EN 50347. Their efficiencies are the limits in IEC 60034-30-1 of the class that the regulation EU 2019/1781 asks of
motors on the market: IE3, and IE4 from 75 kW on (since July 2023, up to 200 kW, with 2 to 6 poles). All other values
are typical of such motors but belong to no maker: they vary smoothly with size, and take the place of a supplier's
catalogue.

A user's file has the same columns. In CSV a heading is the name of a value, with its unit in brackets where it
has one ("power [kW]", "speed [rev/min]"); in TOML each motor is a table ``[[motor]]``, a number is in the
declared SI unit, and a text may have a unit ("1455 rev/min"). Columns with a start value are optional.
"""

from __future__ import annotations

import csv
import difflib
import io
import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from ..core import units
from ..core.errors import Faults, InputError, each_refusal, near_name, shown
from ..core.quantities import DISPLAY_UNITS, Layout, Value, Variable, declaration, quantity
from ..reading import toml_lines
from ..reading.tables import file_text, in_file, packaged, to_number, toml
from .induction_motor import InductionMotor
from .motor import Motor
from .nameplate import Identification, Nameplate, check, identify


@declaration
class CatalogueData(Nameplate):
    """A nameplate, and the other values of a catalogue."""

    mass: Value = quantity("kg", "mass; 0: unknown", default=0.0, min=0.0)
    price: Value = quantity("1", "price, in one currency for all; 0: unknown", default=0.0, min=0.0, max=1e12)
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
"""Columns of texts, with their descriptions."""
REQUIRED = ("designation", *(v.name for v in LAYOUT.variables if v.quantity.start is None))
"""Columns that each file has."""
_LONGEST = 200
_HEADING = re.compile(r"\s*(\w+)\s*(?:\[\s*(.*?)\s*\])?\s*")


@dataclass(frozen=True)
class CatalogueMotor:
    """A motor of the catalogue; `origin` is its file and row, `source` the source of its values."""

    designation: str
    nameplate: CatalogueData
    source: str
    origin: str

    def identify(self) -> Identification:
        """The equivalent circuit of the motor; see `chainunit.drives.nameplate.identify`.

        Raises
        ------
        InputError
            in one line, where no circuit meets the nameplate.
        """
        with each_refusal(
            lambda fault: InputError(f"{self.origin}: {self.designation}: {fault}", placed=True)
        ):
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
    """The packaged motors, followed by the motors of the file `extra` (CSV, or TOML if its name ends in .toml).

    Raises
    ------
    InputError
        with a line for each wrong value: the file, the line, the column, the value and the allowed range.
    """
    motors = list(_packaged())
    if extra is not None:
        rows = _toml_rows if extra.suffix.lower() == ".toml" else _csv_rows
        motors += _motors(rows, file_text(extra), str(extra), {m.designation for m in motors})
    return motors


def motor_of_catalogue(
    designation: str, extra: Path | None = None, others: Collection[str] = ()
) -> CatalogueMotor:
    """The motor with this `designation`, among the packaged motors and the motors of the file `extra`; `others` are
    further names to suggest for a misspelled one.

    Raises
    ------
    InputError
        for an unknown designation, in one line with the nearest ones; and see `catalogue`.
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
    faults = Faults()
    for motor in catalogue(extra)[len(_packaged()) :]:
        with faults.collected():
            motor.identify()
    faults.refuse()


@cache
def _packaged() -> tuple[CatalogueMotor, ...]:
    name = "motors.csv"
    return tuple(_motors(_csv_rows, packaged(name), name, set()))


@dataclass(frozen=True)
class _Row:
    """A row of a file with one motor."""

    file: str
    line: int
    values: Mapping[str, Any]
    """values by the names of their columns"""
    prefix: str
    """text before the name of a column in a refusal"""
    lines: Mapping[str, int] = field(default_factory=dict)
    """line of each value, where the values stand on separate lines"""
    absent: Collection[str] = ()
    """columns that the whole file lacks, which is a fault of its headings"""

    @property
    def origin(self) -> str:
        """The file and the line."""
        return f"{self.file}:{self.line}"

    def refusal(self, fault: InputError) -> InputError:
        """A fault in this row, with its place."""
        line = self.lines.get(fault.key, self.line)
        return InputError(f"{self.file}:{line}: {self.prefix}{fault}", placed=True)


def _motors(
    rows: Callable[[str, str, Faults], Iterator[_Row]], text: str, file: str, others: set[str]
) -> list[CatalogueMotor]:
    """The motors of a file whose `rows` these are, behind the motors of the designations `others`."""
    motors, others, faults = [], set(others), Faults()
    for row in rows(text, file, faults):
        with faults.collected(), each_refusal(row.refusal):
            motors.append(_motor(row, others))
        others.add(str(row.values.get("designation", "")).strip())
    faults.refuse()
    return [motor for motor in motors if motor is not None]


def _motor(row: _Row, others: set[str]) -> CatalogueMotor | None:
    """The motor of a row; None where its file lacks a column."""
    faults, values = Faults(), dict[str, float]()
    for name in row.values:
        if name not in _VARIABLES and name not in TEXTS:
            hint = near_name(name, (*TEXTS, *_VARIABLES))
            known = f"unknown{hint}; known here: {', '.join((*TEXTS, *_VARIABLES))}"
            faults.add([InputError(f"{shown(name)}: {known}", name)])
    texts = {name: row.values.get(name, row.origin if name == "source" else "") for name in TEXTS}
    for name, text in texts.items():
        if name in row.absent:
            continue
        if not isinstance(text, str) or not text.strip() or not text.isprintable() or len(text) > _LONGEST:
            words = f"must be a text of one line, of at most {_LONGEST} characters"
            faults.add([InputError(f"{name} = {shown(text)}: {words}", name)])
        elif name == "designation" and text.strip() in others:
            words = "stands in the catalogue already"
            faults.add([InputError(f"{name} = {shown(text.strip())}: {words}", name)])
    for name, variable in _VARIABLES.items():
        if name in row.values:
            try:
                values[name] = to_number(variable, row.values[name])
            except ValueError as error:
                faults.add([InputError(str(error), name)])
        elif variable.quantity.start is None and name not in row.absent:
            allowed = f"{variable.quantity.allowed_range} ({variable.description})"
            faults.add([InputError(f"{name}: is missing; must be {allowed}", name)])
    faults.refuse()
    if row.absent:
        return None
    nameplate = LAYOUT.from_names(values)
    check(nameplate)
    own = {name: text.strip() for name, text in texts.items()}
    return CatalogueMotor(nameplate=nameplate, origin=row.origin, **own)


def _csv_rows(text: str, file: str, faults: Faults) -> Iterator[_Row]:
    rows = list(_lines_of_cells(text, file))
    if not rows:
        raise InputError(f"{file}: is empty; must begin with a row of headings, parted by commas")
    (first, headings), *others = rows
    columns = _columns(headings, file, first)
    missing = {name for name in REQUIRED if name not in dict(columns)}
    for name in (name for name in REQUIRED if name in missing):
        whole = heading(_VARIABLES[name]) if name in _VARIABLES else name
        words = f"is missing; add the heading {shown(whole)}"
        faults.add([InputError(f"{file}:{first}: column {name}: {words}", placed=True)])
    for line, row in others:
        if len(row) == len(columns):
            cells = zip(columns, map(str.strip, row), strict=True)
            values = {name: _with_unit(cell, unit) for (name, unit), cell in cells if cell}
            yield _Row(file, line, values, "column ", absent=missing)
        else:
            quotes = "; a comma in a cell needs quotation marks around it" if len(row) > len(columns) else ""
            words = f"has {len(row)} cells; must have {len(columns)}, as the headings{quotes}"
            faults.add([InputError(f"{file}:{line}: {words}", placed=True)])


def _lines_of_cells(text: str, file: str) -> Iterator[tuple[int, list[str]]]:
    """The rows that are not empty, each with its first line."""
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    line = 1
    try:
        for row in reader:
            if any(cell.strip() for cell in row):
                yield line, row
            line = reader.line_num + 1
    except csv.Error as error:
        raise InputError(f"{file}:{line}: no valid CSV: {error}", placed=True) from error


def _columns(headings: Sequence[str], file: str, line: int) -> list[tuple[str, str]]:
    """Names and units of the columns."""
    faults, columns = Faults(), list[tuple[str, str]]()
    names = (*TEXTS, *_VARIABLES)
    for cell in headings:
        match = _HEADING.fullmatch(cell)
        name, unit = (match[1], match[2] or "") if match else ("", "")
        if name not in names:
            parted = "; cells must be parted by commas" if cell.count(";") > 2 or "\t" in cell else ""
            known = ", ".join((*TEXTS, *(heading(v) for v in _VARIABLES.values())))
            words = f"unknown{parted}{near_name(name, names)}; known here: {known}"
            faults.add([InputError(f"{file}:{line}: heading {shown(cell)}: {words}", placed=True)])
        elif any(name == other for other, _ in columns):
            faults.add([InputError(f"{file}:{line}: column {name}: stands twice", placed=True)])
        elif unit and (name in TEXTS or not _fits(unit, _VARIABLES[name])):
            has = (
                f"must have a unit such as {heading(_VARIABLES[name])}"
                if name not in TEXTS
                else "has no unit"
            )
            faults.add([InputError(f"{file}:{line}: heading {shown(cell)}: {has}", placed=True)])
        columns.append((name, unit))
    faults.refuse()
    return columns


def _fits(unit: str, variable: Variable) -> bool:
    """Whether a value in this unit can be converted to the unit of the variable."""
    try:
        units.convert(1.0, unit, variable.unit, variable.kind)
    except ValueError:
        return False
    return True


def _with_unit(cell: str, unit: str) -> str:
    """A cell with the unit of its column; a cell with its own unit, or without a number, is unchanged."""
    parts = units.split(cell)
    return f"{cell} {unit}" if unit and parts is not None and not parts[1] else cell


def _toml_rows(text: str, file: str, faults: Faults) -> Iterator[_Row]:
    with in_file(file, lambda: toml_lines.lines_of(text)):
        data = toml(text)
        tables = data.pop("motor", None)
        wrong = Faults()
        for name in data:
            wrong.add([InputError(f"{shown(name)}: unknown; each motor is a table [[motor]]", name)])
        if tables is None and not data:
            wrong.add([InputError("has no motor; each motor must be a table [[motor]]")])
        elif tables is not None and not (
            isinstance(tables, list) and all(isinstance(table, dict) for table in tables)
        ):
            wrong.add([InputError(f"motor = {shown(tables)}: each motor must be a table [[motor]]", "motor")])
        wrong.refuse()
    lines = toml_lines.lines_of(text)
    for number, table in enumerate(tables, 1):
        own = {name: lines.get(f"motor.{number}.{name}", 0) for name in table}
        yield _Row(file, lines.get(f"motor.{number}", 0), table, f"motor {number}: ", own)
