"""A checked catalogue of the user: what it offers, and what it leaves open."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from ..core.quantities import Variable
from ..drives.catalogue import KINDS, check_own
from ..drives.catalogue_rows import TEXTS, CatalogueKind
from ..reading.text import number
from ..study.keys import catalogue_columns
from .blocks import Report, Table, TableRow, Text, heads
from .reference import key_rows


def checked(files: Sequence[Path]) -> Report:
    """The contents of catalogues (CSV or TOML) whose every row is right.

    Raises
    ------
    InputError
        with a line for each fault of all files; see `chainunit.drives.catalogue.check_own`.
    """
    rows = check_own(files)
    of_kinds = zip(KINDS, (rows.motors, rows.gears, rows.couplings, rows.flexible), strict=True)
    tables = [_contents(kind, items) for kind, items in of_kinds if items]
    names = ", ".join(str(file) for file in files)
    more = "Name the files in a study file: catalogue = [...]."
    return Report("", "catalogue", {}, (Text(f"{names}: every row is right."), *tables, Text(more)), ())


def _contents(kind: CatalogueKind, items: Sequence[Any]) -> Table:
    """The ranges of the columns of one kind, and the columns that some rows leave open."""
    data = [item.nameplate if kind.name == "motor" else item.data for item in items]
    name = "order_number"
    unknown = sum(not item.order_number for item in items)
    rows = [TableRow((name, "-", str(unknown or "-"), TEXTS[name]))]
    for name, variable in kind.variables.items():
        values = [float(getattr(entry, name)) for entry in data]
        # of a column that may be left out, the start value 0 stands for a value that is not known
        unknown = values.count(0.0) if variable.quantity.start == 0.0 else 0
        sizes = [x for x in values if x or variable.quantity.start != 0.0]
        rows.append(TableRow((name, _range(variable, sizes), str(unknown or "-"), variable.description)))
    title = f"{len(items)} {kind.plural if len(items) > 1 else kind.plural.removesuffix('s')}"
    return Table(tuple(rows), heads("column", "from, to", "rows without", "meaning"), title, numeric=False)


def _range(variable: Variable, values: Iterable[float]) -> str:
    sizes = sorted(values)
    if not sizes:
        return "-"
    ends = dict.fromkeys(number(x, variable.unit, variable.kind) for x in (sizes[0], sizes[-1]))
    return " to ".join(ends)


def columns() -> Report:
    """The columns of catalogues of every kind: unit, allowed range, meaning."""
    tables = (Table(*key_rows(table), table.title, numeric=False) for table in catalogue_columns())
    hint = Text(
        "A column without a default must be there. chainunit catalogue --template writes "
        "a file of each kind to be filled, chainunit catalogue FILE checks one."
    )
    return Report("Columns of a catalogue", "catalogue", {}, (*tables, hint), ())
