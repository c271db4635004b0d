"""Types of values of a study file: entries whose quantity another key names, such as the ends of a swept
parameter, and lists of a declared quantity."""

from __future__ import annotations

import dataclasses
import math
from typing import Annotated, Any

from pydantic import BeforeValidator, Field
from pydantic_core import PydanticCustomError

from ..core.quantities import variable_of
from ..reading.tables import to_number


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
