"""The study file with the best machine: the tables of the study, with the new values in [machine]."""

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

from ...machines.machine import Machine
from ..config import Config
from ..parts import LENGTHS

_BARE = re.compile(r"[A-Za-z0-9_-]+")


def best_tables(config: Config, machine: Machine, names: tuple[str, ...], folder: Path) -> dict[str, Any]:
    """The tables of the study with the parameters `names` of a machine, as a file in `folder` has them: names of
    other files are relative to it. Lengths that came from [ratios] are given one by one."""
    tables = copy.deepcopy(dict(config.tables))
    values = machine.by_name
    written = set(names)
    if machine.model.sides and written & set(LENGTHS):
        # a file that gives one length takes none from the ratios of the example
        written |= set(LENGTHS)
        tables.pop("ratios", None)
    section = tables.setdefault("machine", {})
    for name in [name for name in machine.model.parameter_layout.names if name in written]:
        inner = section
        *above, last = name.split(".")
        for part in above:
            inner = inner.setdefault(part, {})
        inner[last] = float(values[name])
    tables["title"] = f"{config.title}: the best machine" if config.title else "The best machine"
    for table, key in (("", "catalogue"), ("system", "machine"), ("system", "motor"), ("machine", "linkage")):
        inner = tables.get(table, {}) if table else tables
        if isinstance(inner.get(key), str) and inner[key].lower().endswith((".toml", ".fmu", ".csv")):
            inner[key] = _from(folder, Path(config.source).parent / inner[key])
    return tables


def _from(folder: Path, file: Path) -> str:
    """The name of a file as seen from a folder."""
    try:
        return Path(os.path.relpath(file.resolve(), folder.resolve())).as_posix()
    except ValueError:  # on another drive
        return file.resolve().as_posix()


def toml_text(tables: Mapping[str, Any]) -> str:
    """Tables as a TOML text, which reads as these tables again."""
    return "\n".join(_lines(tables, "")).strip() + "\n"


def _lines(table: Mapping[str, Any], prefix: str) -> Iterator[str]:
    """The keys of a table, then the tables in it; a table of plain values stands in one line of the table above,
    except at the top."""
    later: list[tuple[str, Any]] = []
    for name, value in table.items():
        nested = isinstance(value, Mapping) and (
            not prefix or any(isinstance(inner, Mapping) for inner in value.values())
        )
        many = isinstance(value, list) and bool(value) and all(isinstance(each, Mapping) for each in value)
        if nested or (many and not prefix):
            later.append((name, value))
        else:
            yield f"{_key(name)} = {_value(value)}"
    for name, value in later:
        full = f"{prefix}{_key(name)}"
        for each in value if isinstance(value, list) else [value]:
            yield ""
            yield f"[[{full}]]" if isinstance(value, list) else f"[{full}]"
            yield from _lines(each, f"{full}.")


def _key(name: str) -> str:
    return name if _BARE.fullmatch(name) else json.dumps(name, ensure_ascii=False)


def _value(value: Any) -> str:
    if isinstance(value, Mapping):
        return (
            f"{{ {', '.join(f'{_key(name)} = {_value(x)}' for name, x in value.items())} }}"
            if value
            else "{}"
        )
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_value, value))}]"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return repr(value) if math.isfinite(value) else str(value)
    if isinstance(value, date | time):
        return value.isoformat()
    return json.dumps(value, ensure_ascii=False)
