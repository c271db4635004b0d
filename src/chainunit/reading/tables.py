"""The reader of TOML tables, by pydantic models that are generated from declarations.

A number is in the declared SI unit; a text may carry a unit ("150 mm", "30 rev/min", "4 kNm"), see `units`.
Every refusal is one line that names the field, its value and the allowed range.
"""

from __future__ import annotations

import dataclasses
import math
import re
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from importlib import resources
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationError,
    create_model,
)
from pydantic_core import ErrorDetails

from ..core import units
from ..core.declared_numbers import as_text, kind_words, number_of_text
from ..core.errors import InputError, near_name, printable, shown
from ..core.inputs import TOML, file_text
from ..core.messages import unit_behind
from ..core.quantities import Layout, Quantity, Variable, complaint, variables
from . import toml_lines
from .results import InUnit, derived, part, result
from .toml_faults import syntax_faults

T = TypeVar("T")


def to_number(variable: Variable, entry: Any) -> float:
    """The value of a config entry in the declared unit.

    Raises
    ------
    ValueError
        for a text that is no number, a unit of another kind, or a value out of bounds.
    """
    entry = as_text(entry)
    if variable.type == "Boolean":
        fits = isinstance(entry, int | float) and entry in (0, 1)
    else:
        fits = isinstance(entry, int | float | str) and not isinstance(entry, bool)
    if not fits:
        raise ValueError(f"{variable.name} = {shown(entry)}: must be {kind_words(variable)}")
    try:
        value = number_of_text(variable, entry) if isinstance(entry, str) else float(entry)
    except OverflowError:
        raise ValueError(
            f"{variable.name}: the number is too large; must be {kind_words(variable)}"
        ) from None
    if not variable.quantity.admits(value):
        meant = _meant(variable, entry)
        hints = [
            f"; {units.IN_RADIANS}" * (variable.unit == "rad" and not units.has_unit(entry)),
            _SENSE * (variable.unit == "rad/s" and bool(variable.quantity.admits(-value))),
            f'; was "{meant}" meant?' if meant else "",
        ]
        raise ValueError(complaint(variable, value) + "".join(hints))
    return variable.quantity.within_bounds(value)


_SENSE = '; a linkage turns the other way by positive = "clockwise" in [driver] of its file'


def option_value(name: str, text: str, unit: str, description: str, most: float = math.inf) -> float:
    """The positive value of an option of the command line in `unit`, at most `most`. A number without a unit is
    refused, as a reader may take another unit for granted.

    Raises
    ------
    InputError
        in one line, with the range and an example.
    """
    parts = units.split(text)
    if parts is not None and parts[0] and not parts[1]:
        examples = " or ".join(f'"{parts[0]:g} {symbol}"' for symbol in units.fitting(unit)[:2])
        raise InputError(f"{name} {printable(text)}: has no unit; give it as {examples}")
    quantity = Quantity(unit, description, low=0.0, open_low=True, high=most)
    if parts is not None and parts[1] and not units.converts(parts[1], unit):
        kind = units.of_other_kind(parts[1], unit) or f"{printable(parts[1])} is no known unit"
        raise InputError(
            f'{name} "{printable(text)}": {kind}; must be {units.with_units(unit)} ({description})'
        )
    try:
        return to_number(Variable(name, description, quantity), text)
    except ValueError as error:
        raise InputError(str(error)) from None


@result
class UnusualValue:
    """A value that no machine of this kind has, so that a mistaken unit is likely.

    A value that the file has `with_unit` was hardly meant in another one: it is a note, and asks no question.
    """

    variable: Variable
    value: float
    written: str
    """the text of the file, if it states the unit"""
    meant: str | None = part("the probable value, in the form of a study file")

    @classmethod
    def of_entry(cls, variable: Variable, entry: Any, value: float) -> UnusualValue | None:
        """The unusual `value` of a variable, which a file has as `entry`; None for a usual one."""
        if variable.quantity.is_usual(value):
            return None
        if units.has_unit(entry):
            return cls(variable, value, str(entry), None)
        return cls(variable, value, "", _meant(variable, entry))

    @property
    def with_unit(self) -> bool:
        """Whether the file states the unit."""
        return bool(self.written)

    @derived()
    def name(self) -> str:
        """Name of the value."""
        return self.variable.name

    @derived()
    def given(self) -> InUnit:
        """The value."""
        return InUnit(self.value, self.variable.unit)

    @derived()
    def said(self) -> str:
        """The remark in words."""
        return str(self)

    @property
    def sentence(self) -> str:
        """The remark as a sentence with a full stop."""
        return str(self) if self.meant else f"{self}."

    def __str__(self) -> str:
        v, (low, high) = self.variable, self.variable.quantity.usual or (0.0, 0.0)
        if parts := units.split(self.written):
            _, unit = parts
            zero, one = (units.convert(x, unit, v.unit) for x in (0.0, 1.0))
            low, high = ((x - zero) / (one - zero) for x in (low, high))
            usual = f"usual: {low:.4g} to {high:.4g} {unit}"
            return f"{v.name} = {self.written}: is unusual ({v.description}; {usual}); check it"
        unit = unit_behind(v.unit)
        hint = f'; was "{self.meant}" meant?' if self.meant else ""
        if v.unit == "rad" and not self.with_unit:
            hint = f"; {units.IN_RADIANS}{hint}"
        usual = f"usual: {low:g} to {high:g}{unit}"
        return f"{v.name} = {self.value:g}{unit}: is unusual ({v.description}; {usual}){hint}"


def slips_of(unusual: Iterable[UnusualValue]) -> tuple[UnusualValue, ...]:
    """The unusual values whose unit is likely mistaken, as the file does not state it."""
    return tuple(value for value in unusual if not value.with_unit)


def unusual_values(
    declared: Mapping[str, type],
    data: Mapping[str, Any],
    usual: Mapping[str, tuple[float, float]] = MappingProxyType({}),
) -> Iterator[UnusualValue]:
    """The unusual values in the sections of a checked file. `declared` has the declaration of each section by
    its name. `usual` has, by the name of a quantity, the usual sizes that replace the declared ones; these quantities
    are looked at if the file leaves them at their start values, too."""
    for section, section_type in declared.items():
        for variable in variables(section_type, f"{section}."):
            entry: Any = data
            for name in variable.name.split("."):
                entry = entry.get(name) if isinstance(entry, Mapping) else None
            if variable.name in usual:
                quantity = dataclasses.replace(variable.quantity, usual=usual[variable.name])
                variable = dataclasses.replace(variable, quantity=quantity)
                start = float(quantity.start or 0.0)
                if entry is None and not quantity.is_usual(start):
                    template = f"{variable.template}; not in the file"
                    yield UnusualValue(dataclasses.replace(variable, template=template), start, "", None)
            if entry is not None and (
                value := UnusualValue.of_entry(variable, entry, to_number(variable, entry))
            ):
                yield value


def _meant(variable: Variable, entry: Any) -> str | None:
    """The number of an entry with the unit in which it is allowed and usual; None if there is no such unit."""
    parts = units.split(str(entry))
    if parts is None or not math.isfinite(parts[0]):
        return None
    for unit in units.fitting(variable.unit, variable.kind):
        value = units.convert(parts[0], unit, variable.unit, variable.kind)
        if variable.quantity.admits(value) and variable.quantity.is_usual(value):
            return f"{parts[0]:.15g} {unit}"
    return None


Title = Annotated[str, AfterValidator(printable)]
"""A text of the user for display: in one line, without characters that control a terminal or a page."""


def number(variable: Variable) -> Any:
    """The pydantic field of one scalar."""
    check = BeforeValidator(lambda entry: to_number(variable, entry))
    return Annotated[float, check], Field(None, description=variable.description)


def file_key(kind: Any, usual: Any, description: str, **limits: Any) -> Any:
    """A key of a table that is no quantity, as a pydantic field: its type, its value where a file leaves it out, and
    its meaning."""
    return kind, Field(usual, description=description, **limits)


def schema(declared: type, title: str, prefix: str, **more: Any) -> type[BaseModel]:
    """The pydantic model of a declaration. It has the fields of the declaration and the fields `more`; none
    is required, and unknown keys are refused."""
    scalars = {v.name: v for v in variables(declared, prefix)}
    fields: dict[str, Any] = {}
    for field in dataclasses.fields(declared):
        name = prefix + field.name
        if name in scalars:
            fields[field.name] = number(scalars[name])
        else:
            inner = schema(field.metadata["of"], f"{title}_{field.name}", name + ".")
            fields[field.name] = (inner, Field(default_factory=inner))
    return create_model(title, __config__=ConfigDict(extra="forbid"), **fields, **more)


def file_form(name: str, tables: Mapping[str, type[BaseModel]], **keys: Any) -> type[BaseModel]:
    """The form of a whole file: its title, its tables and other `keys`; none of them is required."""
    fields: dict[str, Any] = {table: (form, Field(default_factory=form)) for table, form in tables.items()}
    return create_model(name, __config__=ConfigDict(extra="forbid"), title=(Title, ""), **fields, **keys)


def read_table(form: type[BaseModel], table: Mapping[str, Any], prefix: str = "") -> Any:
    """The values of a `table`, checked by its `form`. In a refusal `prefix` stands before the names of its
    keys.

    Raises
    ------
    InputError
        with a line for each unknown key and each value that is not allowed.
    """
    try:
        return form.model_validate(dict(table))
    except ValidationError as error:
        raise InputError.joined(refusals(error, form, prefix)) from error


def given_values(section: BaseModel) -> dict[str, Any]:
    """Names and values that were set in a section."""
    flat: dict[str, Any] = {}
    for name in section.model_fields_set:
        value = getattr(section, name)
        if isinstance(value, BaseModel):
            flat.update({f"{name}.{inner}": v for inner, v in given_values(value).items()})
        else:
            flat[name] = value
    return flat


def refusals(error: ValidationError, file: type[BaseModel], prefix: str = "") -> list[InputError]:
    """The faults of a table of the form `file`, in the order of its keys; `prefix` stands before their
    names."""
    return [
        InputError(_line(detail, file, prefix), key=prefix + ".".join(_path(detail)))
        for detail in error.errors()
    ]


def _path(error: ErrorDetails) -> list[str]:
    """The names of the key with a fault from the file on; the entries of a list count from 1."""
    return [str(part + 1 if isinstance(part, int) else part) for part in error["loc"]]


def _line(error: ErrorDetails, file: type[BaseModel], prefix: str) -> str:
    """The refusal of a value by pydantic in one line of our words."""
    path = error["loc"]
    full_name = prefix + printable(".".join(_path(error)), 80)
    if error["type"] == "extra_forbidden":
        table: Any = file
        for part in path[:-1]:
            table = table.model_fields[part].annotation
        keys = f"known here: {', '.join(table.model_fields)}"
        hint = near_name(str(path[-1]), table.model_fields) or _elsewhere(str(path[-1]), file)
        return f"{full_name}: unknown key{hint}{' ' if hint.endswith('?') else '; '}{keys}"
    if error["type"] == "model_type":
        array = f", below [{full_name}]" if isinstance(error["input"], list) else ""
        named = _holders(full_name, file) if isinstance(error["input"], str) else []
        hint = f"; its name stands in {' or '.join(named)}" if named else ""
        return f"{full_name} = {shown(error['input'])}: must be a table{array}{hint}"
    if error["type"] == "value_error":
        return str(error["ctx"]["error"])
    return f"{full_name} = {shown(error['input'])}: {_allowed(error, full_name.removeprefix(prefix))}"


def _elsewhere(key: str, file: type[BaseModel]) -> str:
    """Words on the tables of a file that have the key, to follow a refusal."""
    places = ["before all tables"] if key in file.model_fields else _holders(key, file)
    return (
        f"; it stands {'in ' if key not in file.model_fields else ''}{' or '.join(places)}" if places else ""
    )


def _holders(key: str, file: type[BaseModel]) -> list[str]:
    """The tables of a file that have the key."""
    tables = {name: field.annotation for name, field in file.model_fields.items()}
    return [f"[{name}]" for name, form in tables.items() if key in getattr(form, "model_fields", ())]


_KINDS = {
    "string_type": "a text",
    "string_too_short": "a text that is not empty",
    "bool_type": "true or false",
    "dict_type": "a table",
    "tuple_type": "a list of 2",
}
"""By pydantic's kind of error, the words on what the value must be."""


def _allowed(error: ErrorDetails, key: str) -> str:
    """Words on what a value that pydantic refuses must be."""
    kind, value = error["type"], error["input"]
    if kind == "literal_error":
        expected = error["ctx"]["expected"].replace("'", '"')
        return f"must be {expected}{near_name(str(value), expected.split(chr(34))[1::2])}"
    if kind == "list_type":
        return "must be a list" + (f" of tables, each below [[{key}]]" if isinstance(value, Mapping) else "")
    if kind == "too_long":
        length = error["ctx"]
        most = "exactly 2" if isinstance(value, tuple) else f"at most {length['max_length']}"
        return f"must be a list of {most}, and has {length['actual_length']}"
    if kind == "missing":
        return "must be a list of 2"
    return f"must be {_KINDS[kind]}" if kind in _KINDS else error["msg"].lower()


def entries(data: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """The entries of a table and of all its inner tables, each by its full name."""
    # not by recursion: a wrong file may be nested without end
    tables = [("", data)]
    for prefix, table in tables:
        for name, value in table.items():
            yield prefix + name, value
            if isinstance(value, Mapping):
                tables.append((f"{prefix}{name}.", value))


def merged(base: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """The table `over`, completed by the values of `base` that it does not have."""
    result = dict(base)
    for name, value in over.items():
        below = result.get(name)
        result[name] = merged(below, value) if isinstance(below, dict) and isinstance(value, dict) else value
    return result


def filled(declared: type, values: Mapping[str, float]) -> dict[str, Any]:
    """Every value of a declaration by name: the given value, or else the start value."""
    return {v.name: values.get(v.name, v.quantity.start) for v in variables(declared)}


def instance(declared: type, values: Mapping[str, float]) -> Any:
    """An instance of a declaration with the `values` by name; the other values are the start values."""
    return Layout(declared).from_names(dict(values))


def packaged(name: str) -> str:
    """The text of a file that comes with the package."""
    return (resources.files("chainunit") / "data" / name).read_text("utf-8")


MOST_KEYS = 5000
"""Most keys of a file, with the keys of its tables."""


def toml(text: str, most: int = MOST_KEYS) -> dict[str, Any]:
    """The tables in a TOML text.

    Raises
    ------
    InputError
        if the text is no TOML, each fault with its line, has more than so many keys, or a character that is no sign
        of a text.
    """
    try:
        data = tomllib.loads(text)
    except ValueError as error:  # TOMLDecodeError, and numbers that are too long
        raise InputError.joined(syntax_faults(text, error)) from error
    except RecursionError as error:
        raise InputError(TOO_DEEP) from error
    if nested_deeply(data):
        raise InputError(TOO_DEEP)
    if _keys_in(data) > most:
        raise InputError(f"has more than {most} keys, the most that are read")
    if faults := text_faults(data):
        raise InputError.joined(faults)
    return data


_NO_SIGNS = re.compile(
    "[\\x00-\\x08\\x0b\\x0c\\x0e-\\x1f\\x7f-\\x9f\\ud800-\\udfff\\ufdd0-\\ufdef"
    + "".join(f"{chr(plane + 0xFFFE)}{chr(plane + 0xFFFF)}" for plane in range(0, 0x110000, 0x10000))
    + "]"
)
"""Characters that are no signs of a text: control characters except tab and ends of lines, surrogates, and characters
that Unicode assigns to nothing. XML, and with it an FMU, an SVG and a page, has no place for them."""


def named_table(data: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    """The table of that name in a file, empty if there is none.

    Raises
    ------
    InputError
        if it is no table.
    """
    table = data.get(name, {})
    if not isinstance(table, Mapping):
        raise InputError(f"{name} = {shown(table)}: must be a table", key=name)
    return table


def text_faults(data: Any) -> list[InputError]:
    """The faults of all texts and names in the tables of a file that have a character that is no sign."""
    return list(_wrong_texts(data, ""))


def _wrong_texts(data: Any, key: str) -> Iterator[InputError]:
    """See `text_faults`; `key` is the full name of the data."""
    if isinstance(data, Mapping):
        for name, value in data.items():
            inner = f"{key}.{name}" if key else str(name)
            yield from _wrong_text(str(name), inner, "its name")
            yield from _wrong_texts(value, inner)
    elif isinstance(data, list | tuple):
        for k, value in enumerate(data, 1):
            yield from _wrong_texts(value, f"{key}.{k}" if isinstance(value, Mapping) else key)
    elif isinstance(data, str):
        yield from _wrong_text(data, key)


def _wrong_text(text: str, key: str, subject: str = "") -> Iterator[InputError]:
    """The fault of a text with a character that is no sign; the refusal names it by `subject`, or
    cites it."""
    if wrong := _NO_SIGNS.search(text):
        message = f"has U+{ord(wrong[0]):04X}, which is no sign of a text; take it out"
        yield InputError(f"{printable(key)}: {subject or shown(text)} {message}", key)


_DEEPEST = 30
"""Most tables and lists inside each other: no key of a file has as many."""
TOO_DEEP = f"tables or lists are nested more than {_DEEPEST} times"


def nested_deeply(data: Any) -> bool:
    """Whether tables and lists are nested more than any file needs."""
    level = [data]
    for _ in range(_DEEPEST + 1):
        inner = (container.values() if isinstance(container, Mapping) else container for container in level)
        level = [x for container in inner for x in container if isinstance(x, Mapping | list | tuple)]
    return bool(level)


def _keys_in(data: Any) -> int:
    if isinstance(data, Mapping):
        return len(data) + sum(map(_keys_in, data.values()))
    return sum(map(_keys_in, data)) if isinstance(data, list) else 0


def read(file: Path | None, example: Callable[[], str], parse: Callable[[str, str], T]) -> T:
    """The result of `parse` for the text of a file and the file's name; without a file, for the packaged
    `example`.

    Raises
    ------
    InputError
        in one line that begins with the name of the file.
    """
    source = str(file) if file else "packaged example"
    text = file_text(file, TOML) if file else example()
    with in_file(source, lambda: toml_lines.lines_of(text)):
        return parse(text, source)


@contextmanager
def in_file(source: str, lines_of: Callable[[], Mapping[str, int]]) -> Iterator[None]:
    """Name the file `source`, and the line of the refused key, before each line of an InputError; `lines_of` gives
    the lines of its keys."""
    try:
        yield
    except InputError as error:
        lines = lines_of() if any(fault.key for fault in error.faults) else {}

        def line_of(fault: InputError) -> int:
            return fault.line or _line_of(fault.key, lines)

        # faults of another file that this file names come last
        ordered = sorted(error.faults, key=lambda fault: (fault.placed, line_of(fault)))
        raise InputError.joined(
            [
                fault
                if fault.placed
                else InputError(
                    f"{source}:{f'{line}:' if (line := line_of(fault)) else ''} {fault}", placed=True
                )
                for fault in ordered
            ]
        ) from error


def _line_of(key: str, lines: Mapping[str, int]) -> int:
    """The line of a key, or else of the innermost table that contains it; 0 if the file has neither."""
    while key and key not in lines:
        key = key.rpartition(".")[0]
    return lines.get(key, 0)
