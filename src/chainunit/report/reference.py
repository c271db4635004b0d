"""The reference of all keys of study files and catalogues, of the variables of all FMUs, and of the commands: tables
that follow from the declarations."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from ..errors import InputError
from ..fmu.description import Interface
from ..model import Model
from ..models import MODELS
from ..refusals import unit_behind
from ..study.keys import Key, KeyTable, catalogue_columns, key_tables
from .blocks import Block, Report, Section, Table, TableRow, Text, heads

_KEY_COLUMNS = heads("key", "where it is left out", "allowed", "meaning")


def overview() -> Report:
    """The tables of a study file, with what they are."""
    rows = tuple(
        TableRow((table.heading, table.title, str(len(table.keys))))
        for table in (*key_tables(), catalogue_columns())
    )
    table = Table(rows, heads("table", "contents", "keys"), numeric=False)
    hint = Text("chainunit keys TABLE shows the keys of a table, such as machine, event or motor.")
    return Report("Keys of a study file", "reference", {}, (table, hint), ())


def keys_of(name: str) -> Report:
    """The keys of the tables of that name.

    Raises
    ------
    InputError
        where no table has it.
    """
    tables = [
        table
        for table in (*key_tables(), catalogue_columns())
        if name in (table.name, table.of, table.of.removeprefix("a "))
    ]
    if not tables:
        known = dict.fromkeys(table.name for table in key_tables() if table.name)
        raise InputError(f"{name}: no such table; there are {', '.join(known)}")
    return Report("", "reference", {}, tuple(_block(table, table.heading) for table in tables), ())


def _block(table: KeyTable, title: str = "") -> Table:
    return Table(tuple(map(_row, table.keys)), _KEY_COLUMNS, title=title, numeric=False)


def _row(key: Key) -> TableRow:
    return TableRow((key.name, key.left_out or key.follows or "-", key.allowed or "-", key.description))


def reference(commands: Iterable[tuple[str, str, Iterable[tuple[str, str]]]]) -> Report:
    """The whole reference; `commands` have a name, what they do, and options with their help."""
    sections = [
        Section(
            f"{table.name}-{table.of}",
            f"{table.heading}: {table.title}" if table.title else table.heading,
            (_block(table),),
        )
        for table in (*key_tables(), catalogue_columns())
    ]
    sections += [Section(name, f"FMU {name}", tuple(_variables(model))) for name, model in MODELS.items()]
    for name, words, options in commands:
        rows = tuple(TableRow((option, words)) for option, words in options)
        sections.append(
            Section(
                f"command-{name}",
                f"chainunit {name}".strip(),
                (Text(words), *((Table(rows, heads("option", "meaning"), numeric=False),) if rows else ())),
            )
        )
    return Report("Reference", "reference", {}, (), tuple(sections))


def _variables(model: type[Model]) -> Iterator[Block]:
    """Of an FMU of that model."""
    interface: Any = Interface(model, {})
    rows = []
    for causality in ("parameter", "input", "output"):
        for signal in interface.of(causality):
            v = signal.variable
            start = "-" if causality == "output" else f"{v.quantity.start:g}{unit_behind(v.unit)}"
            allowed = v.quantity.allowed_range if causality != "output" else "-"
            unit = unit_behind(v.unit).strip() or "1"
            rows.append(TableRow((v.name, causality, unit, start, allowed, v.description)))
    yield Table(
        tuple(rows), heads("variable", "causality", "unit", "start", "allowed", "meaning"), numeric=False
    )
