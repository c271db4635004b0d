"""Rows of catalogues: files in which each row is a thing that somebody sells, such as a motor, a gear or a coupling.

A `CatalogueKind` declares the columns of its things once: unit, range and meaning of each. The reader, the check of a
file, its template and the documentation follow from it.

In CSV a file has things of one kind, by its headings. A heading is the name of a value, with its unit in brackets
where it has one ("power [kW]", "speed [rev/min]"). In TOML each thing is a table of its kind (``[[motor]]``,
``[[gear]]``), a number is in the declared SI unit, and a text may have a unit ("1455 rev/min"). Columns with a start
value are optional.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any

from ..core import units
from ..core.errors import Faults, InputError, each_refusal, near_name, shown
from ..core.inputs import TEXT, TOML, file_text, lines_of_table
from ..core.quantities import DISPLAY_UNITS, Layout, Value, Variable, declaration, quantity
from ..reading import toml_lines
from ..reading.tables import in_file, to_number, toml

TEXTS: Mapping[str, str] = MappingProxyType(
    {
        "designation": "its name; no other row of its kind has the same one",
        "order_number": "number or code by which it is ordered",
        "source": "where its values are from",
    }
)
"""Columns of texts of every kind, with their descriptions."""
LEFT_OUT: Mapping[str, str] = MappingProxyType({"order_number": "none", "source": "file and line"})
"""What stands for a column of texts that a file leaves out, in words; each file has the others."""
_LONGEST = 200
MOST_ROWS, MOST_FAULTS = 10_000, 100
"""Most rows of a file, and most faults before the rest of a file is left unread."""
_HEADING = re.compile(r"\s*(\w+)\s*(?:\[\s*(.*?)\s*\])?\s*")


@declaration
class Sold:
    """The values of everything that is sold."""

    mass: Value = quantity("kg", "mass; 0: unknown", default=0.0, min=0.0)
    price: Value = quantity("1", "price, in one currency for all; 0: unknown", default=0.0, min=0.0, max=1e12)


@dataclass(frozen=True)
class CatalogueItem:
    """A row of a catalogue: its designation, its order number, the source of its values; `origin` is its file and
    row, `data` the declared values of its kind."""

    designation: str
    data: Any
    source: str
    origin: str
    order_number: str = ""

    @property
    def price(self) -> float | None:
        """Its price; None where it is unknown."""
        return float(self.data.price) or None


@dataclass(frozen=True)
class CatalogueKind:
    """A kind of things in catalogues.

    `name` is that of its table in TOML, `plural` the noun of many. `declared` has the columns of numbers. `check`, if
    there is one, refuses values that do not fit together. `examples` are made-up rows for a template, by column."""

    name: str
    plural: str
    declared: type
    check: Callable[[Any], None] | None = None
    examples: Sequence[Mapping[str, str]] = ()

    @cached_property
    def variables(self) -> dict[str, Variable]:
        """The columns of numbers by name."""
        return {v.name: v for v in Layout(self.declared).variables}

    @property
    def columns(self) -> tuple[str, ...]:
        """The names of all columns."""
        return (*TEXTS, *self.variables)

    @property
    def required(self) -> tuple[str, ...]:
        """Columns that each file has."""
        texts = (name for name in TEXTS if name not in LEFT_OUT)
        return (*texts, *(v.name for v in self.variables.values() if v.quantity.start is None))

    def heading(self, name: str) -> str:
        """The heading of a column, with the unit that engineers read."""
        return heading(self.variables[name]) if name in self.variables else name

    def template(self) -> str:
        """The text of a CSV file with all columns and the made-up rows of `examples`."""
        text = io.StringIO()
        writer = csv.DictWriter(text, list(map(self.heading, self.columns)), lineterminator="\n")
        writer.writeheader()
        for row in self.examples:
            writer.writerow({self.heading(name): cell for name, cell in row.items()})
        return text.getvalue()

    def items(
        self, rows: Iterable[CatalogueRow], others: Collection[str], faults: Faults
    ) -> list[CatalogueItem]:
        """The things in these rows; things with the designations `others` stand before them. A wrong row is added to
        the `faults`."""
        items, taken = [], set(others)
        for row in rows:
            if len(faults.errors) >= MOST_FAULTS:
                message = (
                    f"this row and those after it are not checked, as {len(faults.errors)} faults stand "
                    "before it"
                )
                faults.add([InputError(f"{row.origin}: {message}", placed=True)])
                break
            with faults.collected(), each_refusal(row.refusal):
                if (item := self._item(row, taken)) is not None:
                    items.append(item)
            taken.add(str(row.values.get("designation", "")).strip())
        return items

    def _item(self, row: CatalogueRow, others: set[str]) -> CatalogueItem | None:
        """The thing of a row; None where its file lacks a column or has a wrong one."""
        faults, values = Faults(), dict[str, float]()
        for name in row.values:
            if name not in self.columns:
                message = f"unknown{near_name(name, self.columns)}; known here: {', '.join(self.columns)}"
                faults.add([InputError(f"{shown(name)}: {message}", name)])
        texts = {name: row.values.get(name, row.origin if name == "source" else "") for name in TEXTS}
        for name, text in texts.items():
            if name not in row.absent:
                faults.add(_wrong_text(name, text, is_needed=name != "order_number"))
        name, text = "designation", texts["designation"]
        if isinstance(text, str) and text.strip() in others and name not in row.absent:
            message = "stands in the catalogue already; give each row a name of its own"
            faults.add([InputError(f"{name} = {shown(text.strip())}: {message}", name)])
        for name, variable in self.variables.items():
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
        data = Layout(self.declared).from_names(values)
        if self.check is not None:
            self.check(data)
        plain_texts = {name: text.strip() for name, text in texts.items()}
        return CatalogueItem(data=data, origin=row.origin, **plain_texts)


def _wrong_text(name: str, text: Any, *, is_needed: bool) -> Iterator[InputError]:
    if isinstance(text, str) and not text.strip() and not is_needed:
        return
    if not isinstance(text, str) or not text.strip() or not text.isprintable() or len(text) > _LONGEST:
        message = f"must be a text of one line, of at most {_LONGEST} characters"
        yield InputError(f"{name} = {shown(text)}: {message}", name)


def heading(variable: Variable) -> str:
    """Name and unit of a column, in the unit that engineers read."""
    unit = DISPLAY_UNITS.get(variable.unit, (variable.unit,))[0]
    return variable.name if unit == "1" else f"{variable.name} [{unit}]"


@dataclass(frozen=True)
class CatalogueRow:
    """A row of a file."""

    file: str
    line: int
    values: Mapping[str, Any]
    """values by the names of their columns"""
    prefix: str
    """text before the name of a column in a refusal"""
    lines: Mapping[str, int] = field(default_factory=dict)
    """line of each value, where the values stand on separate lines"""
    absent: Collection[str] = ()
    """columns that the whole file lacks or has wrongly, which is a fault of its headings"""

    @property
    def origin(self) -> str:
        """The file and the line."""
        return f"{self.file}:{self.line}"

    def refusal(self, fault: InputError) -> InputError:
        """A fault in this row, with its place."""
        line = self.lines.get(fault.key, self.line)
        return InputError(f"{self.file}:{line}: {self.prefix}{fault}", placed=True)


def items_in(
    files: Iterable[Path], kinds: Sequence[CatalogueKind], taken: Mapping[str, Collection[str]] | None = None
) -> dict[str, list[CatalogueItem]]:
    """The things in some files (CSV, or TOML if the name ends in .toml), by the names of their `kinds`, in the order
    of files and rows; `taken` has by kind the designations that stand before them.

    Raises
    ------
    InputError
        with a line for each fault of all files: the file, the line, the column, the value and the allowed range.
    """
    faults = Faults()
    items_by_kind: dict[str, list[CatalogueItem]] = {kind.name: [] for kind in kinds}
    for file in files:
        with faults.collected():
            is_toml = file.suffix.lower() == ".toml"
            text = file_text(file, TOML if is_toml else TEXT)
            for kind, rows in (_toml_rows if is_toml else csv_rows)(text, str(file), kinds, faults):
                before = {item.designation for item in items_by_kind[kind.name]} | set(
                    (taken or {}).get(kind.name, ())
                )
                items_by_kind[kind.name] += kind.items(rows, before, faults)
    faults.refuse()
    return items_by_kind


def csv_rows(
    text: str, file: str, kinds: Sequence[CatalogueKind], faults: Faults
) -> Iterator[tuple[CatalogueKind, Iterable[CatalogueRow]]]:
    """The rows of a CSV file, and the one of the `kinds` whose columns its headings are.

    Raises
    ------
    InputError
        for a file without headings, or that is no CSV.
    """
    lines = list(_lines_of_cells(text, file))
    if not lines:
        raise InputError(f"{file}: is empty; must begin with a row of headings, parted by commas")
    (first, headings), *others = lines
    names = {match[1] for cell in headings if (match := _HEADING.fullmatch(cell))}
    # the kind that knows most of the headings; of equals the one that needs most of them
    kind = max(
        kinds, key=lambda candidate: (len(names & {*candidate.columns}), len(names & {*candidate.required}))
    )
    parts = {part.partition("[")[0].strip() for cell in headings for part in re.split("[;\t]", cell)}
    if not any(part in kind.columns or near_name(part, kind.columns) for part in parts):
        known_headings = ", ".join(map(kind.heading, kind.columns))
        raise InputError(
            f"{file}:{first}: has no heading of a catalogue; known here: {known_headings}", placed=True
        )
    columns, wrong = _columns(kind, headings, f"{file}:{first}", faults)
    missing = {name for name in kind.required if name not in dict(columns) and name not in wrong}
    if not any(name for name, _ in columns):
        # these are no headings of a catalogue: what is missing beside them says nothing
        faults.refuse()
    for name in (name for name in kind.required if name in missing):
        message = f"is missing; add the heading {shown(kind.heading(name))}"
        faults.add([InputError(f"{file}:{first}: column {name}: {message}", placed=True)])

    def rows() -> Iterator[CatalogueRow]:
        """The rows of the table; one with more or fewer cells than headings is a fault."""
        for line, row in others:
            if len(row) == len(columns):
                cells = zip(columns, map(str.strip, row), strict=True)
                values = {name: _with_unit(cell, unit) for (name, unit), cell in cells if cell and name}
                yield CatalogueRow(file, line, values, "column ", absent=missing | wrong)
            else:
                quotes = (
                    "; a comma in a cell needs quotation marks around it" if len(row) > len(columns) else ""
                )
                finding = f"has {len(row)} cells; must have {len(columns)}, as the headings{quotes}"
                faults.add([InputError(f"{file}:{line}: {finding}", placed=True)])

    yield kind, rows()


def _lines_of_cells(text: str, file: str) -> Iterator[tuple[int, list[str]]]:
    """The rows that are not empty, each with its first line."""
    lines_of_table(Path(file), text, MOST_ROWS)
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    line = 1
    try:
        for row in reader:
            if any(cell.strip() for cell in row):
                yield line, row
            line = reader.line_num + 1
    except csv.Error as error:
        raise InputError(f"{file}:{line}: no valid CSV: {error}", placed=True) from error


def _columns(
    kind: CatalogueKind, headings: Sequence[str], place: str, faults: Faults
) -> tuple[list[tuple[str, str]], set[str]]:
    """Names and units of the columns, and the names of columns whose headings are wrong; a column whose cells cannot
    be read has an empty name."""
    columns, wrong = list[tuple[str, str]](), set[str]()
    for cell in headings:
        match = _HEADING.fullmatch(cell)
        name, unit = (match[1], match[2] or "") if match else ("", "")
        if name not in kind.columns:
            near = near_name(name, kind.columns)
            known_headings = ", ".join(map(kind.heading, kind.columns))
            parted = "; cells must be parted by commas" if cell.count(";") > 2 or "\t" in cell else ""
            message = f"unknown{parted}{near}; known here: {known_headings}"
            faults.add([InputError(f"{place}: heading {shown(cell)}: {message}", placed=True)])
            # the column that was meant is not missing, too
            wrong |= {column for column in kind.columns if near == near_name(name, [column]) != ""}
            name = ""
        elif any(name == other for other, _ in columns):
            faults.add(
                [InputError(f"{place}: column {name}: stands twice; take one of both out", placed=True)]
            )
            name = ""
        elif unit and (name in TEXTS or not _fits(unit, kind.variables[name])):
            has = "has no unit" if name in TEXTS else f"must have a unit such as {kind.heading(name)}"
            faults.add([InputError(f"{place}: heading {shown(cell)}: {has}", placed=True)])
            wrong, name = wrong | {name}, ""
        columns.append((name, unit))
    return columns, wrong


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


def _toml_rows(
    text: str, file: str, kinds: Sequence[CatalogueKind], faults: Faults
) -> Iterator[tuple[CatalogueKind, Iterable[CatalogueRow]]]:
    """By kind, the tables [[kind]] of a TOML text as rows, with the lines of their keys. What is no such table is
    refused, with the name of the `file`."""
    brackets = [f"[[{kind.name}]]" for kind in kinds]
    each_is = f"each thing is a table {' or '.join(brackets)}"
    with in_file(file, lambda: toml_lines.lines_of(text)):
        data = toml(text, 20 * MOST_ROWS)
        wrong, names = Faults(), {kind.name for kind in kinds}
        if not data:
            wrong.add([InputError(f"is empty; {each_is}")])
        for name, tables in data.items():
            if name not in names:
                wrong.add([InputError(f"{shown(name)}: unknown; {each_is}", name)])
            elif not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables):
                message = f"each {name} must be a table [[{name}]]"
                wrong.add([InputError(f"{name} = {shown(tables)}: {message}", name)])
        wrong.refuse()
    lines = toml_lines.lines_of(text)
    for kind in kinds:
        rows = []
        for number, table in enumerate(data.get(kind.name, ()), 1):
            place = f"{kind.name}.{number}"
            key_lines = {name: lines.get(f"{place}.{name}", 0) for name in table}
            rows.append(CatalogueRow(file, lines.get(place, 0), table, f"{kind.name} {number}: ", key_lines))
        yield kind, rows
