"""A table of a study file, as its declaration, and the types of its values: entries whose quantity another key names,
and lists of a declared quantity."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, create_model
from pydantic_core import PydanticCustomError

from ..core.quantities import declaration, variable_of
from ..reading.lists import TableList
from ..reading.tables import given_values, schema, to_number


def _admitted(value: Any) -> Any:
    """A number or a text; its quantity, and so its unit, stand in another key."""
    is_number = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    if is_number or isinstance(value, str):
        return value
    raise PydanticCustomError("number_or_text", "must be a number, or a text with a unit")


Entered = Annotated[Any, BeforeValidator(_admitted)]
"""A number, or a text with a unit."""


def _file_names(value: Any) -> Any:
    """A name of a file, or a list of names."""
    if isinstance(value, str):
        return value
    are_names = isinstance(value, list) and all(isinstance(name, str) and name for name in value)
    if are_names and 0 < len(value) <= MOST_FILES:
        return value
    message = "must be the name of a file, or a list of at least one and at most {most} names of files"
    raise PydanticCustomError("file_names", message, {"most": MOST_FILES})


MOST_FILES = 100
"""Largest number of files that a list names."""
FileNames = Annotated[str | list[str], BeforeValidator(_file_names)]
"""The name of a file, or a list of names."""


def entered(description: str) -> Any:
    """The key of a number, or a text with a unit, as a pydantic field; without a value where it is left out."""
    return Entered, Field(None, description=description)


def filled_text(description: str) -> Any:
    """The key of a text that is not empty, as a pydantic field."""
    return str, Field("", min_length=1, description=description)


def numbers(
    declaration: type, quantity_name: str, name: str, most: int, is_empty_allowed: bool = True
) -> Any:
    """The type of a list of at most `most` values of a quantity of the `declaration`, and of at least one unless
    `is_empty_allowed`; a refusal calls the list `name`."""
    variable = dataclasses.replace(variable_of(declaration, quantity_name), name=name)
    value = Annotated[float, BeforeValidator(lambda entry: to_number(variable, entry))]

    def filled(entry: Any) -> Any:
        if entry == [] and not is_empty_allowed:
            raise PydanticCustomError("empty_list", "must have at least one value")
        return entry

    return Annotated[list[value], Field(max_length=most), BeforeValidator(filled), variable]


@dataclass(frozen=True)
class TableForm:
    """The form of a table, and those keys that stand in place of its declared quantities."""

    model: Callable[..., type[BaseModel]] = schema
    values: Callable[[Any], dict[str, Any]] = given_values
    """the values of a checked table, by the name of the quantity"""
    instead: type | None = None
    """declaration of the numbers that stand in place of others"""
    keys: Callable[[], Iterable[Any]] = tuple
    """other such keys, each a `chainunit.study.keys.Key`"""
    conditions: Callable[[], Mapping[str, Any]] | None = None
    """the JSON Schema of which keys go together"""
    displaced: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """by key, the keys of a file with which the value of the example has no meaning"""
    texts: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    """by key, also of entries, further conditions of the JSON Schema on its text or list"""
    required: tuple[str, ...] = ()
    """keys that the table must have"""


@dataclass(frozen=True)
class TableLists:
    """The lists of tables in a table, and how far their faults go."""

    entries: Mapping[str, TableList] = field(default_factory=dict)
    """by key, the lists of tables"""
    named: TableList | None = None
    """where the file chooses the names in the table, the declaration of the tables [table.NAME]"""
    single_keys: tuple[str, ...] = ()
    """lists and tables whose faults say nothing of the other keys"""
    deciders: Mapping[str, str] = field(default_factory=dict)
    """by a key of entries, the key of the table that decides whether it has a meaning"""


@dataclass(frozen=True)
class FileSection:
    """A table of a study file. The study has its values, or None if the table is `optional` and the file does
    not have it; a value that the table does not name is that of `default`."""

    declaration: type
    default: Any = None
    optional: bool = False
    keys: Mapping[str, Any] = field(default_factory=dict)
    """other keys than quantities, as pydantic fields with their descriptions"""
    before: str = ""
    """table of the base before which it stands; empty for one behind them"""
    title: str = ""
    """title of the table in a report"""
    is_used: Callable[[Any], bool] = lambda study: True
    """whether a study uses the values of the table, by its `chainunit.study.record.StudyRecord`"""
    apart: bool = False
    """whether the result has other things of the same names"""
    form: TableForm = field(default_factory=TableForm)
    lists: TableLists = field(default_factory=TableLists)
    completed: Callable[[Any, Any], Any] = lambda values, reading: values
    """gets the values and the `FileReading`; gives them with the values that follow from the rest of the file, or
    None where the study does not use the table"""
    follows: Mapping[str, str] = field(default_factory=dict)
    """by key, the source of its value if the file leaves the key out"""
    order: tuple[tuple[str, str, str], ...] = ()
    """triples (low, relation, high) of keys: the value of `high` has to have this relation to that of `low`"""
    random_events: tuple[str, ...] = ()
    """keys that hold an event whose quantities may be ranges"""
    chooses_motor: bool = False
    """whether a file with the table leaves the choice of the motor to its capability, whose plan is a
    `chainunit.study.proposal.MotorChoice`"""
    places: Mapping[str, str] = field(default_factory=dict)
    """by a key that people look for in the table, where the file has it"""


@declaration
class NoQuantities:
    """A table without quantities of its own."""


def _open_form(declared: type, title: str, prefix: str, **more: Any) -> type[BaseModel]:
    """The form of a table in which any name may stand; a capability reads the tables of these names."""
    return create_model(title, __config__=ConfigDict(extra="allow"))


def of_named(named: TableList) -> FileSection:
    """The section of a table whose inner tables have names that the file chooses: [table.NAME]. Its capability reads
    them by `TableList.read_named`, and its findings hold their values."""
    return FileSection(
        NoQuantities,
        optional=True,
        title=named.title,
        is_used=lambda study: False,
        form=TableForm(_open_form, lambda checked: {}),
        lists=TableLists(named=named),
    )
