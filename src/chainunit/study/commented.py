"""A study file with every possible key and its meaning; the keys that the file leaves out are comments."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from itertools import groupby

from ..core.messages import unit_behind
from ..models import MOTORS
from ..reading.tables import toml
from ..reading.toml_lines import Statement, statements
from .keys import NAME, Key, KeyTable, entry_tables, key_tables
from .schema import FILE

_OF_OTHERS = ("motor_names.", "machine_names.", "motor_parameters")
"""Prefixes of keys for foreign FMUs, which an example does not have."""
_MACHINE = "ChamberForces"
_COLUMN = 34
"""The column at which comments begin, if the line is not longer."""


def commented(text: str) -> str:
    """The study file `text` of a chain unit, with a comment from the declarations on each line that has none.
    The keys that it leaves out follow as comments at the end of each table, the tables that it leaves out at
    the end of the file."""
    lines = text.splitlines()
    types = [str(event["type"]) for event in toml(text).get("event", [])]
    settings = [*statements(text)]
    names = {name for statement in settings for name in statement.keys}
    below: dict[int, list[str]] = {}
    for table, group in groupby(settings, key=lambda statement: statement.table):
        table_statements = [*group]
        keys = {f"{table}.{key.name}".lstrip("."): key for key in _keys(table, types)}
        for statement in table_statements:
            _comment(lines, statement, keys)
        below[table_statements[-1].last] = [_line(key) for name, key in keys.items() if name not in names]
    result = [f"#:schema {FILE}"]
    for number, line in enumerate(lines, 1):
        result += [line, *below.get(number, [])]
    for absent in _absent({statement.table.split(".")[0] for statement in settings}):
        title = f"{absent.title}: {absent.of}" if absent.of else absent.title
        result += ["", f"{f'# {absent.bracketed}':<{_COLUMN}} # {title}", *map(_line, absent.keys)]
    return "\n".join(result) + "\n"


def _keys(table: str, types: list[str]) -> Iterator[Key]:
    """The keys of a table of the file; `types` are the types of its events. The table ``event.2`` has the keys of the
    second type, and a table of entries with names, as ``bearing.pin``, those of any entry, ``bearing.NAME``."""
    name, _, number = table.partition(".")
    for entry_table in entry_tables():
        if table.startswith(entry_table.removesuffix(f".{NAME}") + "."):
            name = entry_table
            break
    model = types[int(number) - 1] if name == "event" else _MACHINE
    for key_table in key_tables():
        if key_table.name == name and key_table.of in ("", model):
            yield from (key for key in key_table.keys if not key.name.startswith(_OF_OTHERS))


def _absent(present: set[str]) -> Iterable[KeyTable]:
    """The tables that a file without them may have, but for events: for its machine, and for each motor."""
    return (
        key_table
        for key_table in key_tables()
        if key_table.name
        and key_table.name.removesuffix(f".{NAME}") not in {*present, "event"}
        and key_table.of in ("", _MACHINE, *MOTORS)
    )


def _comment(lines: list[str], statement: Statement, keys: dict[str, Key]) -> None:
    """Add the meaning of each key that a statement sets, where its line has no comment."""
    line = lines[statement.line - 1]
    meanings = [_meaning(keys[name], line) for name in statement.keys if name in keys]
    if meanings and "#" not in re.sub(r"\"[^\"]*\"|'[^']*'", "", line):
        part = meanings[0].partition(": ")[0] + ": "
        if all(meaning.startswith(part) for meaning in meanings):
            # of one link: its name stands once
            meanings[1:] = [meaning.removeprefix(part) for meaning in meanings[1:]]
        lines[statement.line - 1] = f"{line:<{_COLUMN}} # {'; '.join(meanings)}"


def _meaning(key: Key, line: str) -> str:
    """The meaning of a key that a line sets; where the line gives a bare number, with the unit that it has."""
    number = re.search(rf"(?<![\w.]){re.escape(key.name.rpartition('.')[2])}\s*=\s*[-+.\d]", line)
    return key.description + (f" [{unit_behind(key.unit).strip()}]" if number and key.unit else "")


def _line(key: Key) -> str:
    """The line of a key that the file leaves out, with its default value, if it has one."""
    choices = f" ({', '.join(key.words)})" if key.words else ""
    follows = f"; left out: {key.follows}" if key.follows else ""
    text = f"# {key.name} = {key.left_out}".rstrip()
    return f"{text:<{_COLUMN}} # {key.description}{choices}{follows}"
