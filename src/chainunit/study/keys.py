"""All keys that a study file or a catalogue may have, made from the declarations. The reference, the
commented example and the schema for editors are made from them."""

from __future__ import annotations

import dataclasses
import types
import typing
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from types import MappingProxyType
from typing import Any

from ..core.quantities import Layout, Variable, variables, written
from ..core.units import shortest_text
from ..drives.catalogue import KINDS as CATALOGUES
from ..drives.catalogue_rows import LEFT_OUT, TEXTS
from ..machines.differing import PLAIN, ROLLING, ROLLING_FRICTION, SHARED
from ..machines.paper_ratios import Ratios
from ..machines.parts import PinLaw
from ..mechanism.models import InverseMachine
from ..models import MACHINES, MOTORS
from ..reading.lists import TableList
from ..reading.tables import instance
from ..reading.text import CHOICES as UNITS
from .config import Config, parse
from .event import TYPES, Event
from .file_section import FileSection
from .motor_sources import OwnMotor
from .parts import ReportTable
from .sections import SystemTable, all_choices, all_sections

_OF_MOTORS = {
    "speed_control.kp": "tuned",
    "speed_control.ki": "tuned",
    "current_control.kp": "tuned",
    "current_control.ki": "tuned",
}
"""By key of [motor], the source of its value if the file leaves the key out."""


NONE: Mapping[str, str] = MappingProxyType({})
NAME = "NAME"
"""It stands for a name that the file chooses."""
_VALUE = "a number, or a text with a unit"
_TEXTS = "a text, or a list of texts"


Sort = typing.Literal["number", "text", "texts", "switch", "list", "table", "value"]


@dataclass(frozen=True)
class Key:
    """A key of a file; `name` is its full name within its table (``crank.m``)."""

    name: str
    description: str
    variable: Variable | None = None
    """the quantity of the key; None for a word, a switch or a list"""
    words: tuple[str, ...] = ()
    """the allowed values, as a file writes them; empty where any text is allowed"""
    sort: Sort = "number"
    """a value is a number or a text with a unit, of a quantity that another key names"""
    left_out: str = ""
    """the value of a key that a file leaves out, as a file would write it; empty where there is none"""
    items: Variable | None = None
    """the quantity of the entries of a list"""
    most: int = 0
    """the largest length of a list; 0 where it has no limit"""
    follows: str = ""
    """the source of the value of a key that a file leaves out"""

    @property
    def unit(self) -> str:
        """The declared unit; empty for a pure number, a text and a switch."""
        return "" if self.variable is None or self.variable.unit == "1" else self.variable.unit

    @property
    def allowed(self) -> str:
        """The range, or the values to choose from, in words."""
        if self.variable is not None:
            return self.variable.quantity.allowed_range
        if self.words:
            return ", ".join(self.words)
        return {"text": "a text", "texts": _TEXTS, "list": "a list", "table": "a table", "value": _VALUE}.get(
            self.sort, ""
        )


@dataclass(frozen=True)
class KeyTable:
    """A table of a study file, or the columns of a catalogue."""

    name: str
    """name of the table in the file; empty for the keys before all tables"""
    title: str
    keys: tuple[Key, ...]
    of: str = ""
    """the machine, the motor or the type of event to which the table belongs, if others have another table"""

    @property
    def heading(self) -> str:
        """The heading of the table: ``[motor] of DcMotor``."""
        return " ".join(filter(None, (self.bracketed, self.of and f"of {self.of}")))

    @property
    def is_named(self) -> bool:
        """Whether the file chooses the name of the table, which stands here as ``NAME``."""
        return self.name.endswith(f".{NAME}")

    @property
    def bracketed(self) -> str:
        """The line that opens the table: ``[motor]``."""
        if self.name == "event" or (self.name in entry_tables() and not self.is_named):
            return f"[[{self.name}]]"
        return f"[{self.name}]" if self.name else "before all tables"


@cache
def entry_tables() -> dict[str, TableList]:
    """The declarations of the lists of tables in a table, by the names of table and key; and of the tables whose
    names the file chooses, by the name of the table that holds them and `NAME`."""
    table_lists: dict[str, TableList] = {}
    for table, section in all_sections().items():
        table_lists |= {f"{table}.{key}": entry for key, entry in section.lists.entries.items()}
        if section.lists.named is not None:
            table_lists[f"{table}.{NAME}"] = section.lists.named
    return table_lists


@cache
def key_tables() -> tuple[KeyTable, ...]:
    """All tables of a study file, in the order in which a file has them."""
    return (
        KeyTable(
            "",
            "Study",
            (
                Key("title", "title of the study", sort="text"),
                *_of_fields(all_choices(), _study().file.choices),
            ),
        ),
        KeyTable("system", "Machine and motor", tuple(_of_system())),
        *(
            KeyTable("machine", model.noun.capitalize(), tuple(_of_machine(name, "machine")), name)
            for name, model in MACHINES.items()
        ),
        KeyTable("ratios", "The papers' ratios", tuple(quantity_keys(Ratios, Ratios())), "ChamberForces"),
        *(
            KeyTable("feed", "Feed in normal running", tuple(_of_machine(name, "feed")), name)
            for name in MACHINES
        ),
        *(KeyTable("motor", "Motor", tuple(_of_motor(name)), name) for name in MOTORS),
        *(
            KeyTable(name, section.title, tuple(_of_section(name, section)))
            for name, section in all_sections().items()
            if section.lists.named is None
        ),
        *(KeyTable(name, entry.title, tuple(_of_entry(entry))) for name, entry in entry_tables().items()),
        KeyTable("report", "Report", tuple(_of_report())),
        *(
            KeyTable("event", (event_type.__doc__ or "").split(".")[0], tuple(_of_event(event_type)), name)
            for name, event_type in TYPES.items()
        ),
    )


def catalogue_columns() -> tuple[KeyTable, ...]:
    """The columns of catalogues, and keys of their tables [[motor]], [[gear]] and so on."""
    texts = tuple(
        Key(name, meaning, sort="text", follows=LEFT_OUT.get(name, "")) for name, meaning in TEXTS.items()
    )
    return tuple(
        KeyTable(
            kind.name,
            f"Catalogue of {kind.plural}",
            (*texts, *quantity_keys(kind.declared)),
            "a catalogue",
        )
        for kind in CATALOGUES
    )


@cache
def _study(machine: str = "ChamberForces", motor: str = "") -> Config:
    """The study of a file that names only machine and motor; it has the default values of all other keys."""
    names = [f'machine = "{machine}"'] + ([f'motor = "{motor}"'] if motor else [])
    return parse("\n".join(["[system]", *names]))


def quantity_keys(
    declared: type, values: Any = None, prefix: str = "", sources: Mapping[str, str] = NONE
) -> Iterator[Key]:
    """Keys of declared quantities. `values` are the values of a file that leaves them out, and `sources` says by key
    where they come from."""
    values_by_name = Layout(declared).by_name(values) if values is not None else {}
    for v in variables(declared):
        value = values_by_name.get(v.name, v.quantity.start)
        left_out = "" if value is None else shortest_text(value, v.unit, v.kind)
        if value is not None and v.type != "Real":
            left_out = written(value, v.type)
        follows = sources.get(v.name, "")
        yield Key(
            prefix + v.name,
            v.description,
            v,
            left_out="" if follows else left_out,
            follows=follows,
        )


def _of_machine(name: str, table: str) -> Iterator[Key]:
    """The keys of [machine], or of the `table` [feed], for a machine of that name, with the further ones that a
    file may name."""
    config = _study(name)
    model: InverseMachine = config.machine.model.having(config.machine.model.further)
    if table == "feed":
        feed = model.feed_layout.from_names(config.machine.model.feed_layout.by_name(config.feed))
        places = {f"{side}.force_across": f"{side}.across" for side in model.sides}
        yield from quantity_keys(model.Feed, feed, sources=places)
        return
    values = model.parameter_layout.from_names(config.machine.by_name)
    sources = dict.fromkeys(model.further, "none, and nothing that follows from it")
    yield from quantity_keys(model.Parameters, values, sources=sources)
    if model.pin_names:
        pins = f"pins.{NAME}."
        yield from quantity_keys(PinLaw, prefix=pins, sources=SHARED)
        kinds = f'"{PLAIN}"', f'"{ROLLING}"'
        text = f"kind of the bearing; a rolling one has the friction {ROLLING_FRICTION:g}"
        yield Key(f"{pins}kind", text, words=kinds, sort="text", left_out=kinds[0])


def _of_motor(name: str) -> Iterator[Key]:
    """The keys of [motor] for a motor of that name."""
    motor = _study(motor=name).motor
    values = motor.parameters if isinstance(motor, OwnMotor) else None
    return quantity_keys(MOTORS[name].Parameters, values, sources=_OF_MOTORS)


def _of_section(name: str, section: FileSection) -> Iterator[Key]:
    """The keys of a declared table of that name: its quantities, its other keys, and keys that may stand instead."""
    values = _study().table(name)
    if values is None:
        values = section.default or section.declaration()
    yield from quantity_keys(section.declaration, values, sources=section.follows)
    for key in _of_fields(section.keys):
        yield dataclasses.replace(key, follows=section.follows.get(key.name, ""))
    if section.form.instead is not None:
        yield from quantity_keys(section.form.instead)
    yield from section.form.keys()


def _of_system() -> Iterator[Key]:
    """The keys of [system]: machine and motor with the names to choose from, and the names of variables in FMUs."""
    machines = tuple(f'"{name}"' for name in MACHINES)
    motors = tuple(f'"{name}"' for name in MOTORS)
    choices = {
        "machine": (*machines, "a linkage file (.toml)", "an FMU (.fmu)"),
        "motor": (*motors, "a designation of the catalogue", "an FMU (.fmu)"),
    }
    for name, field in SystemTable.model_fields.items():
        if name in choices:
            left_out, follows = ('"ChamberForces"', "") if name == "machine" else ("", "the example's")
            yield Key(
                name,
                str(field.description),
                words=choices[name],
                sort="text",
                left_out=left_out,
                follows=follows,
            )
        elif name == "motor_parameters":
            yield from _of_fields({name: (dict[str, Any], field)})
        else:
            # names of variables in an FMU, some of them in a table of their own
            names: Any = field.annotation
            for key, entry in names.model_fields.items():
                members = getattr(entry.annotation, "model_fields", None)
                for variable in [key] if members is None else [f"{key}.{member}" for member in members]:
                    yield Key(f"{name}.{variable}", f"name of {variable} in the FMU", sort="text")


def _of_report() -> Iterator[Key]:
    """The keys of [report]: the units of kinds of quantities, and the labels at its head."""
    for kind, names in UNITS.items():
        choices = tuple(f'"{name}"' for name in names)
        yield Key(f"units.{kind}", f"unit of each {kind} in the report", words=choices, sort="text")
    for name, field in ReportTable.model_fields.items():
        if name != "units":
            yield Key(name, str(field.description), sort="text")


def _of_event(event_type: type[Event]) -> Iterator[Key]:
    """The keys of an [[event]] of that type."""
    yield Key("type", "type of the event", words=(f'"{event_type.kind}"',), sort="text")
    if event_type.has_side:
        yield Key("side", "side that it comes on", words=('"left"', '"right"'), sort="text")
    if event_type.has_input:
        yield Key("input", "input of the machine that rises, as [feed] has it", sort="text")
    yield Key("name", "name of its run, in small letters, digits and _", sort="text", follows="type and side")
    yield from quantity_keys(event_type.Parameters, event_type.Parameters())


def _of_entry(entry: TableList) -> Iterator[Key]:
    """The keys of an entry in a list of tables: first keys that are no quantities, then its quantities."""
    for key in _of_fields(entry.keys):
        yield dataclasses.replace(key, follows=entry.follows.get(key.name, ""))
    if entry.declared is not None:
        yield from quantity_keys(entry.declared, instance(entry.declared, {}), sources=entry.follows)


def _of_fields(fields: Mapping[str, Any], values: Mapping[str, Any] | None = None) -> Iterator[Key]:
    """Keys that are no quantities, from their pydantic fields, with these `values` or their defaults."""
    for name, (annotation, field) in fields.items():
        value = field.default if values is None else values.get(name)
        base, limits = _parted(annotation)
        sort = _sort(base)
        left_out = f'"{value}"' if value and sort not in ("switch", "table") else ""
        if sort == "switch" and value is not None:
            left_out = "true" if value else "false"
        yield Key(
            name,
            str(field.description),
            words=_choices(base),
            sort=sort,
            left_out=left_out,
            items=next((limit for limit in limits if isinstance(limit, Variable)), None),
            most=max((x.max_length for limit in limits for x in getattr(limit, "metadata", ())), default=0),
        )


def _parted(annotation: Any) -> tuple[Any, list[Any]]:
    """The type of a field, and its limits: what ``Annotated`` adds to the type."""
    limits: list[Any] = []
    while typing.get_origin(annotation) is typing.Annotated:
        annotation, *inner = typing.get_args(annotation)
        limits += inner
    return annotation, limits


def _sort(annotation: Any) -> Sort:
    """The sort of a key whose field has this annotation."""
    if isinstance(annotation, types.UnionType):
        return "texts"
    sorts: dict[Any, Sort] = {Any: "value", bool: "switch", list: "list", dict: "table"}
    return sorts.get(typing.get_origin(annotation) or annotation, "text")


def _choices(annotation: Any) -> tuple[str, ...]:
    """The values to choose from of a field with this annotation, as a file writes them."""
    if typing.get_origin(annotation) is typing.Literal:
        return tuple(f'"{word}"' for word in typing.get_args(annotation))
    return ("true", "false") if annotation is bool else ()
