"""Numbers as people give them, in the unit of their declaration: plain ones, texts with a unit, and quantities of a
library such as pint."""

from __future__ import annotations

import contextlib
from typing import Any

import numpy as np

from . import units
from .errors import InputError, printable, shown
from .quantities import Quantity, Variable


def may_be_share(variable: Variable) -> bool:
    """Whether a quantity may be given in percent: no count, and no ratio of gears."""
    low, high = variable.quantity.low, variable.quantity.high
    if variable.type != "Real":
        return False
    return variable.unit != "1" or variable.kind == "percent" or (low < 1.0 and high <= 100.0)


def kind_words(variable: Variable) -> str:
    """The allowed form of a value of a file: ``a number in m, or a text such as "2 mm" (crank O1-A)``."""
    fitting = units.fitting(variable.unit, variable.kind)
    # a variable of an FMU may have no description
    meaning = f" ({variable.description})" if variable.description else ""
    if variable.type != "Real":
        return f"{variable.quantity.allowed_range}{meaning}"
    if variable.unit == "1":
        share = ', or a text such as "8 %"' if may_be_share(variable) else ""
        return f"a pure number{share}{meaning}"
    declared = variable.unit.replace(".", " ")
    return f'a number in {declared}, or a text such as "2 {fitting[0]}"{meaning}'


def number_of_text(variable: Variable, text: str) -> float:
    """The number of a text such as "150 mm" in the unit of the declaration.

    Raises
    ------
    ValueError
        in one line, for a text that is no number and a unit of another kind.
    """
    number, unit = units.split(text) or (None, "")
    if number is not None and not unit:
        return number
    if number is not None and (may_be_share(variable) or not set(unit) & set("%‰")):
        with contextlib.suppress(ValueError):
            return units.convert(number, unit, variable.unit, variable.kind)
    is_pure = variable.type != "Real" or (variable.unit == "1" and not may_be_share(variable))
    hint = "" if is_pure else units.spelling(text, variable.unit, variable.kind)
    kind = units.of_other_kind(unit, variable.unit) if unit else ""
    kind = f"; {printable(kind)}" if kind else ""
    raise ValueError(f"{variable.name} = {shown(text)}: must be {kind_words(variable)}{kind}{hint}")


def magnitude_and_unit(value: Any) -> tuple[Any, str] | None:
    """The number, or the array of numbers, of a quantity of a library such as pint, or of a DataArray with ``units``,
    and its unit as a text that is read here, "1" without a dimension; None for another value. The library need not be
    installed."""
    if isinstance(value, type):
        return None
    if hasattr(value, "dims") and "units" in (attributes := getattr(value, "attrs", {})):
        return value.values, str(attributes["units"])
    if not all(hasattr(value, name) for name in ("magnitude", "units", "to")):
        return None
    # a unit that only the library knows is converted to its base units
    for quantity in (value, value.to_base_units()):
        unit = f"{quantity.units:~C}" or "1"
        if units.is_unit(unit):
            return quantity.magnitude, unit
    return value.magnitude, f"{value.units:~C}"


def has_own_unit(value: Any) -> bool:
    """Whether a value is a text, or a quantity of a library, and no plain number."""
    return isinstance(value, str) or magnitude_and_unit(value) is not None


def as_text(value: Any) -> Any:
    """A quantity of a library in the form of a file: a text with a unit such as "1.5 kN", or a list of such texts.
    Another value stays as it is."""
    parts = magnitude_and_unit(value)
    if parts is None:
        return value
    numbers, unit = parts
    return _texts(numbers.tolist() if isinstance(numbers, np.ndarray | np.generic) else numbers, unit)


def _texts(numbers: Any, unit: str) -> Any:
    if isinstance(numbers, list):
        return [_texts(number, unit) for number in numbers]
    return f"{float(numbers)!r} {unit}"


def in_declared_unit(variable: Variable, value: Any) -> Any:
    """A float, or an array of floats, in the unit of the declaration.

    Parameters
    ----------
    value : a number, or a text with a unit, such as "150 mm"; an array or a list of them; or a quantity of a library
        such as pint, or a DataArray with ``units``, whose number may be an array

    Raises
    ------
    InputError
        in one line, for a value of another type and a unit of another kind.
    """
    if isinstance(value, float) or (isinstance(value, np.ndarray) and value.dtype == float and value.ndim):
        return value
    numbers, unit = magnitude_and_unit(value) or (value, "")
    if isinstance(numbers, str) or (unit and np.ndim(numbers) == 0):
        return _read(variable, as_text(value))
    try:
        # numpy takes None for a number that is not finite, and true for 1
        array = np.asarray(numbers)
        if array.dtype.kind == "U":
            unit, array = "", np.array([_read(variable, str(x)) for x in array.flat]).reshape(array.shape)
        if array.dtype.kind not in ("fiub" if variable.type == "Boolean" else "fiu"):
            raise TypeError
        factor, offset = units.scale(unit, variable.unit, variable.kind) if unit else (1.0, 0.0)
    except InputError:
        raise
    except (TypeError, ValueError):
        line = f"{variable.name} = {shown(as_text(value))}: must be {kind_words(variable)}"
        raise InputError(line, variable.name) from None
    array = array.astype(float) * factor + offset if unit else array.astype(float, copy=False)
    return float(array) if array.ndim == 0 else array


def _read(variable: Variable, text: str) -> float:
    """See `number_of_text`; its error is an InputError."""
    try:
        return number_of_text(variable, text)
    except ValueError as error:
        raise InputError(str(error), variable.name) from None


def one_number(variable: Variable, value: Any) -> float:
    """One number in the unit of the declaration.

    Raises
    ------
    InputError
        for several numbers; see also `in_declared_unit`.
    """
    number = in_declared_unit(variable, value)
    if not isinstance(number, float):
        raise InputError(f"{variable.name} = {shown(value)}: must be one number", variable.name)
    return number


def number_in(unit: str, name: str, value: Any, description: str) -> float:
    """One number in the `unit`, of an argument that no model declares; see `one_number` for its errors."""
    return one_number(Variable(name, description, Quantity(unit, description)), value)
