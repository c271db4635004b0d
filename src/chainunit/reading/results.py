"""Results, declared once: their data for a file, and their documentation, follow from the declaration.

A result is a dataclass. Its field is in the data if it is declared: a number, or an array of numbers, by
`quantity` with its unit, anything else by `part`. A property is in the data if it is `derived`. All other fields
and properties are means of the computation. A mapping, a sequence or a nested result has data by the same rules.
"""

from __future__ import annotations

import dataclasses
import typing
from collections.abc import Callable, Iterator, Mapping
from functools import cache, partial
from operator import attrgetter
from pathlib import Path
from typing import Any, NamedTuple, TypeVar, dataclass_transform

from ..core.brief import briefly_shown
from ..core.descriptions import USUAL_DRIVER, of_driver
from ..core.quantities import group, percentage, quantity, whole_number
from .text import array_entry, entry

T = TypeVar("T")
OWN = "own"
"""Unit of a part whose unit and kind are the fields `unit` and `kind` of the same result; it may have no kind."""


GIVEN = "given"
"""Unit of a part that stands in the data as it is, such as a list of a study file."""


class InUnit(NamedTuple):
    """A number, or an array, whose unit, kind and title are known only when it is computed."""

    value: Any
    unit: str
    kind: str = ""
    title: str = ""


def difference(x: float | None, unit: str) -> InUnit:
    """A number that is no temperature itself, such as a standard deviation."""
    return InUnit(x, unit, "difference" if unit == "K" else "")


@dataclasses.dataclass(frozen=True)
class Estimate:
    """A number that is estimated from random runs, and the interval that holds the true number; all in one unit."""

    value: float
    low: float
    high: float
    unit: str = ""
    kind: str = ""


class ResultPart(NamedTuple):
    """A declared part of a result: the `attribute` that holds it, and its name in the data."""

    attribute: str
    name: str
    description: str
    unit: str = ""
    """unit of its numbers; empty for a part that is no number, or whose numbers have units of their own"""
    kind: str = ""
    inline: bool = False
    """whether the parts of its value stand among the parts of the result"""
    titled: bool = False
    """whether its numbers have their descriptions in the data"""
    optional: bool = False
    """whether it is left out if it is None"""


def part(
    description: str = "",
    *,
    unit: str = "",
    kind: str = "",
    name: str = "",
    inline: bool = False,
    titled: bool = False,
    optional: bool = False,
    default: Any = dataclasses.MISSING,
    default_factory: Any = dataclasses.MISSING,
) -> Any:
    """A field that is in the data of a result, see `ResultPart`; its `name` there is by default the name of the
    field."""
    declared_part = ResultPart("", name, description, unit, kind, inline, titled, optional)
    if default_factory is not dataclasses.MISSING:
        return dataclasses.field(default_factory=default_factory, metadata={"part": declared_part})
    return dataclasses.field(default=default, metadata={"part": declared_part})


@dataclass_transform(frozen_default=True, field_specifiers=(quantity, percentage, whole_number, group, part))
def result(cls: Any = None, *, frozen: bool = True) -> Any:
    """Make `cls` a result: a dataclass with declared parts."""
    if cls is None:
        return partial(result, frozen=frozen)
    return briefly_shown(dataclasses.dataclass(frozen=frozen)(cls))


class _Derived(property):
    """A property that is in the data of a result."""

    part: ResultPart


def derived(
    unit: str = "", kind: str = "", *, name: str = "", titled: bool = False, optional: bool = False
) -> Callable[[Callable[[Any], T]], T]:
    """A decorator for a property that is in the data of a result, see `ResultPart`. Its docstring is the
    description. A type checker takes the property for an attribute of the type that it gives."""

    def declared(function: Callable[[Any], T]) -> Any:
        """The property of a function, whose docstring is the description of the part."""
        derived_part = _Derived(function)
        description = " ".join((function.__doc__ or "").split()).removesuffix(".")
        description = description[:1].lower() + description[1:]
        derived_part.part = ResultPart(
            function.__name__,
            name or function.__name__,
            description,
            unit,
            kind,
            titled=titled,
            optional=optional,
        )
        return derived_part

    return declared


@cache
def parts(result_type: Any) -> tuple[ResultPart, ...]:
    """The declared parts of a result: its fields, then its properties. The parts of a group have its name before
    theirs."""
    listed = []
    for field in dataclasses.fields(result_type):
        if "quantity" in field.metadata:
            q = field.metadata["quantity"]
            listed.append(ResultPart(field.name, field.name, q.template, q.unit, q.kind))
        elif "group" in field.metadata:
            for member in parts(field.metadata["of"]):
                attribute, name = (f"{field.name}.{x}" for x in (member.attribute, member.name))
                description = f"{field.metadata['group']}: {member.description}"
                listed.append(member._replace(attribute=attribute, name=name, description=description))
        elif "part" in field.metadata:
            declared_part = field.metadata["part"]
            listed.append(declared_part._replace(attribute=field.name, name=declared_part.name or field.name))
    members = {name: x for base in reversed(result_type.__mro__) for name, x in vars(base).items()}
    return (*listed, *(x.part for x in members.values() if isinstance(x, _Derived)))


UnitOf = Callable[[str], str]
"""The unit of a quantity at the driver, by its unit on a driver that turns."""


class _Form(NamedTuple):
    """The arguments of `as_data` that say how data are written."""

    titled: bool
    driver: str
    unit_of: UnitOf


def as_data(x: Any, *, titled: bool = False, driver: str = USUAL_DRIVER, unit_of: UnitOf = str) -> Any:
    """A result, or a mapping or sequence of results, as a file in JSON has it: each number as an entry with its unit.

    Parameters
    ----------
    titled : whether each declared number has its description as its title
    driver : the noun of the link that the motor turns, for titles
    unit_of : the unit of a quantity at the driver, see `part_unit`

    Raises
    ------
    TypeError
        for a number without a unit, and for a value that is no result.
    """
    return _data(x, "", "", _Form(titled, driver, unit_of))


def part_unit(x: Any, declared: ResultPart, unit_of: UnitOf) -> tuple[str, str]:
    """Unit and kind of a part of `x`. The class of `x` may name parts at the driver, `AT_DRIVER`; their unit is
    declared as of a driver that turns."""
    if declared.unit == OWN:
        return x.unit, getattr(x, "kind", "")
    is_at_driver = declared.attribute in getattr(type(x), "AT_DRIVER", ())
    return unit_of(declared.unit) if is_at_driver else declared.unit, declared.kind


def _data(x: Any, unit: str, kind: str, form: _Form) -> Any:
    """A value as JSON has it: a number in its `unit` as an entry with it, a result as a table of its parts, and a
    mapping or a sequence value by value. `kind` says how a number is shown."""
    if isinstance(x, InUnit):
        return _number(x.value, x.unit, x.kind) | ({"title": x.title} if x.title else {})
    if isinstance(x, Estimate):
        ends = {end: entry(getattr(x, end), x.unit, x.kind) for end in ("low", "high")}
        return entry(x.value, x.unit, x.kind) | ends
    if isinstance(x, Mapping):
        return {str(key): _data(element, unit, kind, form) for key, element in x.items()}
    if unit == GIVEN:
        return list(x) if isinstance(x, tuple) else x
    if unit:
        return _number(x, unit, kind)
    # a machine may have no inputs: a table without entries
    if dataclasses.is_dataclass(x) and (parts(type(x)) or not dataclasses.fields(x)):  # type: ignore[arg-type]
        return _table(x, form)
    if hasattr(x, "tolist"):
        x = x.tolist()
    if isinstance(x, list | tuple | frozenset):
        return [_data(element, "", "", form) for element in x]
    if isinstance(x, Path):
        return str(x)
    if x is None or isinstance(x, str | bool | int):
        return x
    raise TypeError(f"{x!r} has no declared unit, and no declared parts")


def _table(x: Any, form: _Form) -> dict[str, Any]:
    """The data of a result `x` by the names of its declared parts: a number with its unit, and with its description
    as `title` if the form asks for titles; an inner result as a table of its own, or, `inline`, with its parts among
    those of `x`. A part that is optional and None is left out."""
    data: dict[str, Any] = {}
    result_type: Any = type(x)
    for member in parts(result_type):
        value = attrgetter(member.attribute)(x)
        if value is None and member.optional:
            continue
        unit, kind = part_unit(x, member, form.unit_of)
        is_titled = form.titled or member.titled
        content = _data(value, unit, kind, form._replace(titled=is_titled))
        if member.inline:
            data |= content
        else:
            if form.titled and unit and "value" in content and "title" not in content:
                content = content | {"title": of_driver(member.description, form.driver)}
            data[member.name] = content
    return data


def _number(x: Any, unit: str, kind: str) -> dict[str, Any]:
    """The entry of a number or an array."""
    is_array = isinstance(x, list | tuple) or bool(getattr(x, "ndim", 0))
    if is_array:
        return array_entry(x, unit, kind)
    # a count stays one
    return entry(x, unit, kind) | ({"value": x} if type(x) is int else {})


def documented(result_type: type, prefix: str = "") -> Iterator[tuple[str, str, str]]:
    """Name in the data, unit and description of each number and text of a result and of the results in it. In a
    name ``*`` stands for the key of a mapping, and ``#`` for the place in a sequence."""
    for member in parts(result_type):
        steps, inner = results_in(_annotated(result_type, member.attribute))
        path = prefix if member.inline else f"{prefix}{member.name}."
        name = f"{path.removesuffix('.')}{steps}".removeprefix(".")
        if inner is None or member.unit:
            yield name, "" if member.unit in (OWN, GIVEN) else member.unit, of_driver(member.description)
        else:
            yield from documented(inner, name and f"{name}.")


def _annotated(result_type: type, attribute: str) -> Any:
    """The type of a part; None for a part of a group, which is a number."""
    for base in result_type.__mro__:
        member: Any = vars(base).get(attribute)
        if isinstance(member, _Derived):
            hint = member.fget.__annotations__["return"]
        else:
            hint = vars(base).get("__annotations__", {}).get(attribute)
        if hint is not None:
            # other annotations of the class may have names that only a type checker knows
            alone = type("Alone", (), {"__annotations__": {"x": hint}, "__module__": base.__module__})
            return typing.get_type_hints(alone)["x"]
    return None


def results_in(hint: Any) -> tuple[str, Any]:
    """The steps from a value of this type to the results in it, and their class; None if it has none."""
    if hasattr(hint, "__dataclass_fields__"):
        return "", hint if parts(hint) else None
    candidates = [results_in(argument) for argument in typing.get_args(hint)]
    steps, inner = next(
        (candidate for candidate in candidates if candidate[1] is not None),
        max(candidates, key=lambda candidate: candidate[0], default=("", None)),
    )
    outer = typing.get_origin(hint)
    if isinstance(outer, type) and issubclass(outer, Mapping):
        return f".*{steps}", inner
    return (f".#{steps}" if outer in (list, tuple) and inner is not None else steps), inner
