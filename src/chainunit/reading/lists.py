"""The reader of lists of tables, and of tables by name: the events of a study, the joints of a linkage. The faults
of all entries come at once, each with its full key."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, Field, create_model

from ..core import units
from ..core.errors import Faults, InputError, meant, near_name, one_of, refusal_prefix, shown
from ..core.quantities import Variable
from .tables import given_values, read_table, schema, to_number

T = TypeVar("T")


class Entry(Faults):
    """A table of a file, with the faults in it. `place` is its full key, empty for a whole file; in a refusal `title`
    stands before the names of its keys, unless it is empty, and `more` at the end."""

    def __init__(self, place: str, table: Any, title: str = "") -> None:
        super().__init__()
        self.place, self.raw, self.title, self.more = place, table, title, ""

    @property
    def given(self) -> Mapping[str, Any]:
        """The values of the table by key.

        Raises
        ------
        InputError
            if it is no table.
        """
        if not isinstance(self.raw, Mapping):
            self.wrong("", self.raw, "must be a table")
            self.refuse()
        return self.raw

    def key(self, name: str) -> str:
        """The full key of a name in the table; for an empty name, the key of the table itself."""
        return ".".join(filter(None, (self.place, name)))

    @contextmanager
    def at(self, name: str, sign: str = ": ") -> Iterator[None]:
        """Collect the faults of a key; `sign` stands after the key."""
        begin = ": ".join(filter(None, (self.title, name))) if self.title else self.key(name)
        with self.collected(), refusal_prefix(begin + sign, self.key(name)):
            yield

    def fault(self, name: str, message: str) -> None:
        """Collect the fault of a key."""
        with self.at(name):
            raise InputError(message + self.more)

    def wrong(self, name: str, value: Any, message: str) -> None:
        """Collect the fault of the value of a key."""
        with self.at(name, " = "):
            raise InputError(f"{shown(value)}: {message}{self.more}")

    def keys(self, name: str, keys: Iterable[str], allowed: Collection[str]) -> None:
        """Collect the faults of the unknown `keys` of the table `name` in it, or, with an empty name, of the table
        itself."""
        for key in keys:
            if key not in allowed:
                full_name = ".".join(filter(None, (name, str(key))))
                self.fault(
                    full_name, f"unknown key{meant(str(key), allowed)} known here: {', '.join(allowed)}"
                )

    def choice(self, name: str, allowed: Mapping[str, T]) -> T | None:
        """The one of the `allowed` values that the table names; None, with a fault, if it names none."""
        value = self.given.get(name)
        if isinstance(value, str) and value in allowed:
            return allowed[value]
        if value is None:
            self.fault(name, f"must be given, {one_of('', allowed)}")
        else:
            self.wrong(name, value, f"must be {one_of(value, allowed)}")
        return None

    def quantity(self, name: str, variable: Variable, value: Any) -> float:
        """The `value` of a key in the unit of the `variable`; not a number, with a fault, if it is wrong. An angle
        of more than a turn without a unit is one in degrees."""
        key = self.key(name)
        with self.collected():
            try:
                number = to_number(dataclasses.replace(variable, name=key), value)
            except ValueError as error:
                raise InputError(f"{error}{self.more}", key) from None
            if variable.unit == "rad" and not units.has_unit(value) and abs(number) > 2.0 * math.pi:
                message = f'is more than a turn; {units.IN_RADIANS}; was "{value} deg" meant?'
                raise InputError(f"{key}: {message}{self.more}", key)
            return number
        return math.nan


def leaves(
    table: Mapping[str, Any], is_nested: Callable[[str, Any], bool] | None = None, prefix: str = ""
) -> Iterator[tuple[str, Any]]:
    """The values of nested tables with their full names; `is_nested` tells whether a table of that full name is one
    of them, and no value."""
    for name, value in table.items():
        full = f"{prefix}{name}"
        if isinstance(value, Mapping) and (is_nested is None or is_nested(full, value)):
            yield from leaves(value, is_nested, f"{full}.")
        else:
            yield full, value


def read_entries(
    tables: Iterable[tuple[Any, Any]],
    place: str,
    faults: Faults,
    read: Callable[[Entry, Any], T],
    title: str = "",
) -> list[T]:
    """The results of `read` for the entries without a fault; the faults of the others go to `faults`. `tables` has
    pairs of the name of an entry, or its number, and its table; the full key of an entry begins with `place`, and its
    `title`, unless it is empty, with these words."""
    results = []
    for name, table in tables:
        entry = Entry(f"{place}.{name}", table, title and f"{title} {name}")
        with faults.collected():
            with entry.collected():
                result = read(entry, name)
            entry.refuse()
            results.append(result)
    return results


@dataclass(frozen=True)
class TableList:
    """The declaration of the list of tables [[name]] of a study file.

    `keys` are pydantic fields beside the quantities of `declared`; the key `named_by` names an entry. `must_be` are
    words on the allowed names, for example `example`; without them, the refusal of a name lists the known ones.
    `is_twice` are words on a name that two entries have.
    """

    name: str
    title: str
    description: str
    most: int
    keys: Mapping[str, Any]
    declared: type | None = None
    named_by: str = "name"
    must_be: str = ""
    example: str = ""
    is_twice: str = "stands there twice; take one out"
    least: int = 0
    """least number of entries"""
    conditions: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    """the conditions of the JSON Schema on the keys of an entry"""
    follows: Mapping[str, str] = dataclasses.field(default_factory=dict)
    """by key, the source of its value if an entry leaves the key out"""

    @property
    def field(self) -> tuple[Any, Any]:
        """The pydantic field of the list."""
        description = f"{self.description}: tables [[{self.name}]]"
        return list[dict[str, Any]], Field([], max_length=self.most, description=description)

    def form(self, prefix: str) -> type[BaseModel]:
        """The form of an entry; in a refusal `prefix` stands before its keys."""
        title = self.name.replace(".", "_")
        if self.declared is None:
            return create_model(title, __config__=ConfigDict(extra="forbid"), **self.keys)
        return schema(self.declared, title, prefix, **self.keys)

    def read(
        self,
        tables: Iterable[Any],
        faults: Faults,
        read: Callable[[Entry, str], T],
        names: Collection[str] | None = None,
        fixed: Mapping[str, str] | None = None,
        usual: str = "",
    ) -> dict[str, T]:
        """The results of `read` by the names of the entries, for those without a fault; the faults of the others go
        to `faults`. The allowed `names` are these, or any; `fixed` has the reasons against further names. An entry
        without a name has the name `usual` with its number."""
        present: set[str] = set()

        def named_result(entry: Entry, number: int) -> tuple[str, T]:
            """The name of an entry and what `read` gives for it; a name that stands there twice is a fault."""
            self._read_form(entry)
            name = entry.given.get(self.named_by, usual and f"{usual}{number}")
            self._check(entry, name, names, fixed or {})
            entry.refuse()
            if name in present:
                entry.wrong(self.named_by, name, self.is_twice)
            present.add(name)
            return name, read(entry, name)

        return dict(read_entries(enumerate(tables, 1), self.name, faults, named_result))

    def read_named(
        self, tables: Mapping[str, Any], faults: Faults, read: Callable[[Entry, str], T]
    ) -> dict[str, T]:
        """The results of `read` by the names of the tables [name.NAME], for those without a fault; the faults of the
        others go to `faults`."""

        def named_result(entry: Entry, name: str) -> tuple[str, T]:
            self._read_form(entry)
            return name, read(entry, name)

        return dict(read_entries(tables.items(), self.name, faults, named_result))

    def _read_form(self, entry: Entry) -> None:
        """Put the checked values of an entry, by key, in place of its table."""
        prefix = f"{entry.place}."
        entry.raw = given_values(read_table(self.form(prefix), entry.given, prefix))

    def _check(
        self, entry: Entry, name: str, names: Collection[str] | None, fixed: Mapping[str, str]
    ) -> None:
        """Collect the fault of a name that is missing, or not allowed."""
        if not name:
            example = f'such as "{self.example}"' if self.example else one_of("", names or ())
            entry.fault(self.named_by, f"must be given, {example}")
        elif name in fixed:
            entry.wrong(self.named_by, name, fixed[name])
        elif names is not None and name not in names:
            allowed = f"{self.must_be}{near_name(name, names)}" if self.must_be else one_of(name, names)
            entry.wrong(self.named_by, name, f"must be {allowed}")
