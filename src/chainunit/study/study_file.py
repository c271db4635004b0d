"""Study files as text: the tables of a study, with other values of some of its numbers."""

from __future__ import annotations

import copy
import json
import math
import os
import re
from collections.abc import Iterator, Mapping
from datetime import date, time
from pathlib import Path
from typing import Any

from ..mechanism.models import MachineModel
from .capability import FileReference
from .config import Config
from .parts import LENGTHS
from .registry import registered

_BARE = re.compile(r"[A-Za-z0-9_-]+")


def changed_tables(config: Config, values: Mapping[str, float], title: str, folder: Path) -> dict[str, Any]:
    """The tables of a study with other `values` by full name ("machine.crank.m"), as a file in `folder` has them:
    names of other files are relative to it. `title` follows that of the study. Where one length of a chain unit
    changes, all are given one by one."""
    tables = copy.deepcopy(dict(config.file.tables))
    written = dict(values)
    lengths = [f"machine.{name}" for name in LENGTHS]
    if config.machine.model.sides and written.keys() & set(lengths):
        # a file that gives one length takes none from the ratios of the example
        machine_values = config.machine.by_name
        written = {f"machine.{name}": machine_values[name] for name in LENGTHS} | written
        tables.pop("ratios", None)
    for name, value in sorted(written.items(), key=lambda item: _place(config.machine.model, item[0])):
        *above, last = name.split(".")
        inner = tables
        for part in above:
            inner = inner.setdefault(part, {})
        inner[last] = float(value)
    tables["title"] = f"{config.title}: {title}" if config.title else title.capitalize()
    for file in named_files(tables):
        file.table[file.name] = _from(folder, Path(config.file.source).parent / file.table[file.name])
    return tables


def named_files(tables: Mapping[str, Any]) -> Iterator[FileReference]:
    """The files that the tables of a study file name: catalogues, motor and machine, and files of capabilities."""
    catalogues: Any = tables.get("catalogue")
    if isinstance(catalogues, list):
        yield from (FileReference("catalogue", catalogues, place) for place in range(len(catalogues)))
    for table, key in (("", "catalogue"), ("system", "motor"), ("system", "machine"), ("machine", "linkage")):
        inner: Any = tables.get(table, {}) if table else tables
        name = inner.get(key)
        if isinstance(name, str) and (
            name if key == "catalogue" else name.lower().endswith((".toml", ".fmu"))
        ):
            yield FileReference(f"{table}.{key}".removeprefix("."), inner, key)
    for part in registered():
        yield from (file for file in part.files(tables) if file.table.get(file.name))


def _place(model: MachineModel, name: str) -> int:
    """The place of a parameter of the machine in its declaration; others stay behind them."""
    names = model.parameter_layout.names
    parameter = name.removeprefix("machine.")
    return names.index(parameter) if parameter in names else len(names)


def _from(folder: Path, file: Path) -> str:
    """The name of a file as seen from a folder."""
    try:
        return Path(os.path.relpath(file.resolve(), folder.resolve())).as_posix()
    except ValueError:  # on another drive
        return file.resolve().as_posix()


def toml_text(tables: Mapping[str, Any], notes: Mapping[str, str] | None = None) -> str:
    """Tables as a TOML text, which reads as these tables again. Comments are `notes` on values by full name."""
    return "\n".join(_lines(tables, "", notes or {})).strip() + "\n"


def _lines(table: Mapping[str, Any], prefix: str, notes: Mapping[str, str]) -> Iterator[str]:
    """The keys of a table, then the tables in it; a table of plain values stands in one line of the table above,
    except at the top."""
    later: list[tuple[str, Any]] = []
    for name, value in table.items():
        nested = isinstance(value, Mapping) and (
            not prefix or any(isinstance(inner, Mapping) for inner in value.values())
        )
        many = isinstance(value, list) and bool(value) and all(isinstance(entry, Mapping) for entry in value)
        if nested or (many and not prefix):
            later.append((name, value))
        else:
            full_name = f"{prefix}{_key(name)}"
            yield from (
                f"# {full}: {note}" for full, note in notes.items() if f"{full}.".startswith(f"{full_name}.")
            )
            yield f"{_key(name)} = {_value(value)}"
    for name, value in later:
        full = f"{prefix}{_key(name)}"
        for entry in value if isinstance(value, list) else [value]:
            yield ""
            yield f"[[{full}]]" if isinstance(value, list) else f"[{full}]"
            yield from _lines(entry, f"{full}.", notes)


def _key(name: str) -> str:
    return name if _BARE.fullmatch(name) else json.dumps(name, ensure_ascii=False)


def _value(value: Any) -> str:
    """A value as TOML writes it."""
    if isinstance(value, Mapping):
        entries = ", ".join(f"{_key(name)} = {_value(x)}" for name, x in value.items())
        return f"{{ {entries} }}" if value else "{}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_value, value))}]"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return repr(value) if math.isfinite(value) else str(value)
    if isinstance(value, date | time):
        return value.isoformat()
    return json.dumps(value, ensure_ascii=False)
