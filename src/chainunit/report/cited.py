"""A declared result as a report cites it: its numbers and texts are pieces of a line that know their places in the
result."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import is_dataclass, replace
from operator import attrgetter
from typing import Any, NamedTuple, TypeVar, cast

from ..core.descriptions import USUAL_DRIVER, of_driver
from ..core.quantities import finite
from ..reading.results import GIVEN, Estimate, InUnit, ResultPart, UnitOf, part_unit, parts
from ..study.provenance import Heading
from . import blocks as b
from .lines import Aside, Line, Name, Number, Words, capital, filled, line

T = TypeVar("T")


def cited(result: T, path: str = "", unit_of: UnitOf = str) -> T:
    """The same result, which stands at `path`, with pieces of a line in place of its numbers and texts. A type
    checker takes it for the result, so that it sees each attribute; `number` gives the piece its type. `unit_of` is
    that of `chainunit.reading.results.as_data`."""
    return cast("T", _Citation(unit_of).piece(result, path))


class _Cited:
    """A result whose attributes are pieces; an attribute that is no part of its data is that of the result."""

    def __init__(self, result: Any, path: str, citation: _Citation) -> None:
        result_type: Any = type(result)
        self._result, self._path, self._citation = result, path, citation
        self._parts: dict[str, ResultPart] = {part.attribute: part for part in parts(result_type)}

    def __getattr__(self, name: str) -> Any:
        value, declared = attrgetter(name)(self._result), self._parts.get(name)
        if declared is None:
            # the parts of a group have its name before theirs
            is_group = any(part.startswith(f"{name}.") for part in self._parts)
            return _Cited(value, f"{self._path}.{name}", self._citation) if is_group else value
        path = self._path if declared.inline else f"{self._path}.{declared.name}".removeprefix(".")
        return self._citation.piece(value, path, *part_unit(self._result, declared, self._citation.unit_of))


class _Citation(NamedTuple):
    unit_of: UnitOf

    def piece(self, value: Any, path: str, unit: str = "", kind: str = "") -> Any:
        """A value with pieces in place of its numbers and texts: a `Number` for a number with a unit, `Words` for a
        text, a result whose attributes are pieces for a result; mappings and sequences keep their shape. A switch
        stays as it is, and so does what has the unit `GIVEN` and is no text. `unit` and `kind` are those of all
        numbers in the value."""
        if isinstance(value, InUnit):
            return self.piece(value.value, path, value.unit, value.kind)
        if isinstance(value, Estimate):
            places = {"value": path, "low": f"{path}.low", "high": f"{path}.high"}
            ends: Any = {
                end: Number(finite(getattr(value, end)), value.unit, value.kind, place)
                for end, place in places.items()
            }
            return Estimate(**ends)
        if isinstance(value, Mapping):
            places = {key: f"{path}.{key}".removeprefix(".") for key in value}
            return {key: self.piece(entry, places[key], unit, kind) for key, entry in value.items()}
        if isinstance(value, str):
            return Words(value, path)
        if unit == GIVEN:
            return value
        if isinstance(value, list | tuple) or (unit and getattr(value, "ndim", False)):
            # numbers with a unit are the entry "value" beside "unit", once for all lists in a list
            place = f"{path}.value" if unit and ".value." not in path else path
            return [self.piece(entry, f"{place}.{k}", unit, kind) for k, entry in enumerate(value)]
        if unit:
            return Number(value if type(value) is int else finite(value), unit, kind, path)
        return _Cited(value, path, self) if is_dataclass(value) else value


def number(cited_number: object, digits: int = 0, **more: Any) -> Number:
    """A cited number with so many digits; `more` are further fields of `Number`."""
    assert isinstance(cited_number, Number), cited_number
    return replace(cited_number, digits=digits, **more)


def exact(cited_number: object, digits: int = 0, **more: Any) -> Number:
    """A cited number with the digits of a given value, see `number`."""
    return number(cited_number, digits, as_given=True, **more)


def estimate(cited_estimate: Estimate) -> Line:
    """A cited estimate with its interval in brackets."""
    ends = filled("{} to {}", number(cited_estimate.low), number(cited_estimate.high))
    return line(number(cited_estimate.value), Aside(ends))


def source_line(heading: Heading) -> Line:
    """Project, author, date and revision of a cited heading, if it has them; its study file, and the version."""
    labels = [filled("{}: {} · ", capital(name), label) for name, label in heading.report.items()]
    return line(*labels, filled("Study file: {} · chainunit {}", heading.source, heading.chainunit))


def as_name(cited_name: object) -> Name:
    """A cited text as a name, whose letters stay as they are."""
    assert isinstance(cited_name, Words), cited_name
    return Name(str(cited_name))


def numbers(cited_result: object) -> dict[str, Number]:
    """The numbers of a cited result by their names."""
    return {declared.name: cited_number for declared, cited_number in _numbers(cited_result)}


def quantity_rows(
    cited_result: object, driver: str = USUAL_DRIVER, only: str = "", **more: Any
) -> tuple[b.TableRow, ...]:
    """A row (description, number) for each number of a cited result, or for the one with the name `only`; `driver` is
    the noun of the driver in descriptions, `more` are further fields of `Number`."""
    return tuple(
        b.TableRow((of_driver(declared.description, driver), replace(cited_number, **more)))
        for declared, cited_number in _numbers(cited_result)
        if only in ("", declared.name)
    )


def _numbers(cited_result: object) -> Iterator[tuple[ResultPart, Number]]:
    """The numbers of a cited result with their declarations, without optional ones that are None."""
    assert isinstance(cited_result, _Cited), cited_result
    for name, declared in cited_result._parts.items():
        if declared.unit:
            cited_number = number(getattr(cited_result, name))
            if not declared.optional or cited_number.value is not None:
                yield declared, cited_number


def table(
    items: Iterable[T], *columns: tuple[Line | b.Column, Callable[[T], b.Cell]], **more: Any
) -> Iterator[b.Table]:
    """A table with a row for each item; a column is its head and the cell of an item. No table without items; `more`
    are further fields of `Table`."""
    rows = tuple(b.TableRow(tuple(cell(item) for _, cell in columns)) for item in items)
    if rows:
        heads = (head if isinstance(head, b.Column) else b.Column(head) for head, _ in columns)
        yield b.Table(rows, tuple(heads), **more)
