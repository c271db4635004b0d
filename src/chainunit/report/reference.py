"""The reference: all keys of study files and catalogues, the variables of all FMUs, the results, and the commands, as
tables that follow from the declarations."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, get_type_hints

from ..core.descriptions import of_driver
from ..core.errors import InputError, near_name
from ..core.messages import unit_behind
from ..core.model import Model
from ..core.quantities import Variable, written
from ..drives.catalogue import KINDS, check_own
from ..drives.catalogue_rows import TEXTS, CatalogueKind
from ..fmu.description import Interface
from ..models import MODELS
from ..reading.results import documented, results_in
from ..reading.text import number
from ..study.analyses import all_analyses
from ..study.keys import NAME, KeyTable, catalogue_columns, key_tables
from ..study.remark import SEVERITIES
from ..study.remarks import declared_remarks
from .blocks import Block, Column, Report, Section, Table, TableRow, Text, heads

_KEY_COLUMNS = heads("key", "default", "allowed", "meaning")


def _tables() -> tuple[KeyTable, ...]:
    """The tables of a study file, and the tables of the columns of catalogues."""
    return (*key_tables(), *catalogue_columns())


def overview() -> Report:
    """The tables of a study file with their contents and their number of keys."""
    hint = Text("chainunit keys TABLE shows the keys of a table, such as run, event or ChamberForces.")
    return Report("Keys of a study file", "reference", {}, (_contents(_tables()), hint), ())


def _contents(tables: Iterable[KeyTable], head: str = "table") -> Table:
    """A row for each table: its heading, or with another `head` the command that shows it; its title; its number of
    keys."""
    rows = []
    for table in tables:
        name = table.heading if head == "table" else f"chainunit keys {_kind(table)}"
        rows.append(TableRow((name, table.title, str(len(table.keys)))))
    return Table(tuple(rows), heads(head, "contents", "keys"), numeric=False)


def _kind(table: KeyTable) -> str:
    """The machine, motor or event whose table it is; empty where all share one."""
    return table.of.removeprefix("a ")


def keys_of(name: str) -> Report:
    """The keys of the table `name`, or of the tables of the machine, motor or event `name`. Where machines, motors or
    events each have a table of this name, the report lists these tables and tells how to ask for one. Where no
    table has the name, it is that of a key, such as run.crank_speed or crank_speed, whose row is shown.

    Raises
    ------
    InputError
        where neither a table nor a key has this name.
    """
    name = name.strip("[]")
    tables = [table for table in _tables() if name in (table.name, table.of, _kind(table))]
    if not tables:
        tables = list(_with_key(name))
    if not tables:
        table_names = dict.fromkeys(table.name for table in key_tables() if table.name)
        kinds = dict.fromkeys(_kind(table) for table in _tables() if table.of)
        near = near_name(name, (*table_names, *kinds, *_key_names())) or ";"
        raise InputError(f"{name}: no such table and no such key{near} chainunit keys lists the tables")
    if sum(name == table.name and bool(table.of) for table in tables) > 1:
        heading = tables[0].heading.removesuffix(f" of {tables[0].of}")
        lead = Text(f"{heading} has a table of keys for each type; a command shows one of them:")
        return Report("", "reference", {}, (lead, _contents(tables, head="command")), ())
    return Report("", "reference", {}, tuple(_block(table, table.heading) for table in tables), ())


def _with_key(name: str) -> Iterator[KeyTable]:
    """The tables that have a key of this name, or keys below it, cut down to these keys. The name may begin with that
    of the table or of its type, as in run.crank_speed, and have any word where the key has `NAME`."""
    for table in key_tables():
        names = {name, *(name.removeprefix(f"{part}.") for part in (table.name, table.of) if part)}
        keys = tuple(
            key
            for key in table.keys
            if any(_begins(key.name.split("."), prefix.split(".")) for prefix in names)
        )
        if keys:
            yield dataclasses.replace(table, keys=keys)


def _begins(key: list[str], prefix: list[str]) -> bool:
    """Whether the parts of the name of a key begin with these parts."""
    return len(prefix) <= len(key) and all(x in (y, NAME) for x, y in zip(key, prefix, strict=False))


def _key_names() -> Iterator[str]:
    """The names of all keys as in a study file, and by themselves."""
    for table in key_tables():
        for key in table.keys:
            yield f"{table.name}.{key.name}" if table.name else key.name
            yield key.name


def _block(table: KeyTable, title: str = "") -> Table:
    return Table(*_key_rows(table), title=title, numeric=False)


def _key_rows(table: KeyTable) -> tuple[tuple[TableRow, ...], tuple[Column, ...]]:
    """A row for each key of a table, and the heads of the columns."""
    rows = []
    for key in table.keys:
        left_out = key.left_out or key.follows or "-"
        rows.append(TableRow((key.name, left_out, key.allowed or "-", key.description)))
    return tuple(rows), _KEY_COLUMNS


def reference(
    commands: Iterable[tuple[str, str, Iterable[tuple[str, str]]]], contents: Mapping[str, type | None]
) -> Report:
    """The whole reference; each of the `commands` has a name, a description, and options with their help, and
    `contents` the declared content of the result.json of some."""
    sections = [
        Section(
            f"{table.name}-{table.of}",
            f"{table.heading}: {table.title}" if table.title else table.heading,
            (_block(table),),
        )
        for table in _tables()
    ]
    sections += [Section(name, f"FMU {name}", tuple(_variables(model))) for name, model in MODELS.items()]
    sections += [
        Section(f"result-{name}", f"result.json: {name}", (_parts(result_type),))
        for name, result_type in _results(contents).items()
    ]
    sections.append(Section("remarks", "Warnings and notes of a study", tuple(_remarks())))
    for name, description, options in commands:
        rows = tuple(TableRow((option, meaning)) for option, meaning in options)
        sections.append(
            Section(
                f"command-{name}",
                f"chainunit {name}".strip(),
                (
                    Text(description),
                    *((Table(rows, heads("option", "meaning"), numeric=False),) if rows else ()),
                ),
            )
        )
    return Report("Reference", "reference", {}, (), tuple(sections))


def _results(contents: Mapping[str, type | None]) -> dict[str, type]:
    """The declared results by their names: the results of the analyses of a study, and of other commands."""
    returned = ((analysis.name, get_type_hints(analysis.find)["return"]) for analysis in all_analyses())
    results = {name: results_in(hint)[1] for name, hint in returned}
    return {
        name: result_type
        for name, result_type in (results | dict(contents)).items()
        if result_type is not None
    }


def _parts(result_type: type) -> Table:
    """A row for each part of a result."""
    rows = (
        TableRow((name or "(the number)", unit or "-", description))
        for name, unit, description in documented(result_type)
    )
    return Table(tuple(rows), heads("name", "unit", "meaning"), numeric=False)


_ADDED = re.compile(r"(?<=\w)\{\w+\}(?=\.)")
"""What a remark adds to the end of a sentence in some studies, and the switches of sentences."""


def _remarks() -> Iterator[Block]:
    """A row for each declared remark."""
    meanings = "; ".join(f"{severity}: {meaning}" for severity, meaning in SEVERITIES.items())
    yield Text(f"By their code in result.json, the gravest first. {meanings}.")
    rows = []
    for remark in declared_remarks():
        text = _ADDED.sub("", of_driver(" ".join(remark.sentences)))
        remedy = _ADDED.sub("", of_driver(remark.remedy)) or "-"
        numbers = ", ".join(f"{name} [{size.unit}]" for name, size in remark.sizes.items()) or "-"
        rows.append(TableRow((remark.code, remark.severity, text, remedy, numbers)))
    yield Table(tuple(rows), heads("code", "severity", "sentences", "remedy", "numbers"), numeric=False)


def _variables(model: Model) -> Iterator[Block]:
    """The table of the variables of an FMU of that model."""
    interface: Any = Interface(model, {})
    rows = []
    for causality in ("parameter", "input", "output"):
        for signal in interface.signals_of(causality):
            v = signal.variable
            start = f"{v.quantity.start or 0.0:g}{unit_behind(v.unit)}"
            unit = unit_behind(v.unit).strip() or "1"
            if v.type != "Real":
                start, unit = written(v.quantity.start or 0.0, v.type), v.type
            allowed = v.quantity.allowed_range if causality != "output" else "-"
            shown = start if causality != "output" else "-"
            rows.append(TableRow((v.name, causality, unit, shown, allowed, v.description)))
    yield Table(
        tuple(rows),
        heads("variable", "causality", "unit or type", "start", "allowed", "meaning"),
        numeric=False,
    )


# -- catalogues of the user


def checked_catalogues(files: Sequence[Path]) -> Report:
    """The contents of catalogues (CSV or TOML) whose every row is right.

    Raises
    ------
    InputError
        with a line for each fault of all files; see `chainunit.drives.catalogue.check_own`.
    """
    rows = check_own(files)
    of_kinds = zip(KINDS, (rows.motors, rows.gears, rows.couplings, rows.flexible), strict=True)
    tables = [_catalogue(kind, items) for kind, items in of_kinds if items]
    names = ", ".join(str(file) for file in files)
    more = "Name the files in a study file: catalogue = [...]."
    return Report("", "catalogue", {}, (Text(f"{names}: every row is right."), *tables, Text(more)), ())


def _catalogue(kind: CatalogueKind, items: Sequence[Any]) -> Table:
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


def catalogue_tables() -> Report:
    """The columns of catalogues of every kind: unit, allowed range, meaning."""
    tables = (Table(*_key_rows(table), table.title, numeric=False) for table in catalogue_columns())
    hint = Text(
        "A column without a default must be there. chainunit catalogue --template writes "
        "a file of each kind to be filled, chainunit catalogue FILE checks one."
    )
    return Report("Columns of a catalogue", "catalogue", {}, (*tables, hint), ())
