"""The JSON Schema of study files, by which editors complete and check them: the keys (`keys`), the keys that follow
from machine and motor, and the rules of keys that do not go together (`chainunit.study.rules`).

An editor sees a date of TOML as a text. A schema can neither compare the sizes of two values, such as lengths
with which the crank cannot turn, nor read another file: the reader of study files checks these.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from ..core.declared_numbers import may_be_share
from ..core.quantities import Variable
from ..drives.catalogue import packaged_motors
from ..models import MACHINES, MOTORS
from ..reading.unit_patterns import pattern, zero
from .conditions import Condition, Schema, ends_with, given, is_one_of
from .event import TYPES
from .event_table import LONGEST_NAME, PLACED, RESERVED
from .file_section import MOST_FILES
from .keys import NAME, Key, KeyTable, entry_tables, key_tables
from .parts import FMU, LINKAGE, LONGEST_FILE
from .rules import all_rules, machine_is, motor_is
from .sections import all_sections

OF_PARTS = ("machine", "feed", "motor")
"""Tables whose keys follow from the machine and the motor that the file names."""


def rules() -> Iterator[Schema]:
    """The conditions of a whole file."""
    yield from (rule.schema() for rule in all_rules())
    machines = is_one_of("system.machine", *MACHINES) | ends_with("system.machine", FMU)
    yield _where(given("system.machine"), (machines | ends_with("system.machine", LINKAGE)).schema())
    yield _where(given("machine.linkage"), (~given("system.machine")).schema())
    yield _where(given("machine.linkage"), ends_with("machine.linkage", LINKAGE).schema())
    for name in MACHINES:
        yield _where(machine_is(name), _of_machine(name))
    packaged = [motor.designation for motor in packaged_motors()]
    motors = motor_is(*MOTORS, *packaged) | ends_with("system.motor", FMU)
    yield _where(given("system.motor") & ~given("catalogue"), motors.schema())
    for name in MOTORS:
        condition = motor_is(name) | ~given("system.motor") if name == "DcMotor" else motor_is(name)
        yield _where(condition, {"properties": {"motor": {"$ref": f"#/definitions/motor.{name}"}}})
    for table, section in all_sections().items():
        for key in section.form.required:
            yield _where(given(table), given(f"{table}.{key}").schema())
        if section.form.conditions is not None:
            yield _where(given(table), {"properties": {table: dict(section.form.conditions())}})


def _where(condition: Condition, then: Schema) -> Schema:
    return {"if": condition.schema(), "then": then}


def _of_machine(name: str) -> Schema:
    """The tables and events of a machine."""
    model = MACHINES[name]
    inputs = {v.name for v in model.input_layout.variables}
    inputs |= {v.name for motor in MOTORS.values() for v in motor.input_layout.variables}
    events = [
        kind
        for kind, event_type in TYPES.items()
        if event_type.has_input or {*event_type.on("left" if event_type.has_side else "").inputs} <= inputs
    ]
    tables: Schema = {table: {"$ref": f"#/definitions/{table}.{name}"} for table in ("machine", "feed")}
    tables["event"] = {"items": {"properties": {"type": {"enum": events}}}}
    return {"properties": tables}


FILE = "chainunit.schema.json"
"""The name by which examples refer to it."""
_EVENT_NAME = {
    "pattern": rf"^[a-z][a-z0-9_]{{0,{LONGEST_NAME - 1}}}$",
    "not": {"anyOf": [{"enum": list(RESERVED)}, {"pattern": "_coasting$"}]},
}
_TYPES = {"switch": "boolean", "list": "array", "value": ["number", "string"], "table": "object"}
"""The type of a value, by the sort of its key."""
_FORMS: dict[str, dict[str, Any]] = {
    "event.name": _EVENT_NAME,
    "catalogue": {"maxLength": LONGEST_FILE, "pattern": r"^[^\x00-\x1f\x7f]*$"},
    "system.machine": {"minLength": 1, "maxLength": LONGEST_FILE},
    "system.motor": {"minLength": 1, "maxLength": LONGEST_FILE},
}
"""By the name of a key of the base, further conditions on its text or list."""


def _further(name: str) -> Mapping[str, Any] | None:
    """Further conditions on the text or list of a key, by its full name; None where there are none."""
    if name in (lists := entry_tables()):
        least = {"minItems": lists[name].least} if lists[name].least else {}
        return {"maxItems": lists[name].most} | least
    table, _, key = name.partition(".")
    sections = all_sections()
    return _FORMS.get(name) or (sections[table].form.texts.get(key) if table in sections else None)


def json_schema() -> dict[str, Any]:
    """The schema of a study file."""
    return _Schema().whole()


class _Schema:
    """A schema in the making. Its `definitions` are the texts of quantities, and the tables of machines and
    motors."""

    def __init__(self) -> None:
        self.definitions: dict[str, Any] = {}
        self._texts: dict[tuple[str, bool], str] = {}

    def whole(self) -> dict[str, Any]:
        """The schema of a whole file."""
        properties: dict[str, Any] = {}
        tables = key_tables()
        for table in tables:
            if table.name == "event":
                self.definitions[f"event.{table.of}"] = self._event(table)
                continue
            above, _, name = table.name.partition(".")
            if table.is_named:
                _object(properties, above, table.title)["additionalProperties"] = self._entry(table)
                continue
            if table.name in entry_tables():
                properties[above]["properties"][name]["items"] = self._entry(table)
                continue
            place = _object(properties, table.name, table.title)["properties"] if table.name else properties
            self._add(place, table)
            if table.name in OF_PARTS:
                self._add(_object(self.definitions, f"{table.name}.{table.of}")["properties"], table)
        for name in OF_PARTS:
            # the keys depend on the machine and the motor: the `rules` give them
            del properties[name]["additionalProperties"]
        properties["event"] = {
            "type": "array",
            "description": "events, each followed from steady running, or in a start; a file that has none has "
            "the events of the example",
            "items": {"anyOf": [_reference(f"event.{name}") for name in TYPES]},
        }
        random = {
            "description": "the event; a quantity may be a range, [least, most]",
            "anyOf": [
                self._event(table, random=True)
                for table in tables
                if table.name == "event" and not TYPES[table.of].from_rest
            ],
        }
        for name, section in all_sections().items():
            for event in section.random_events:
                properties[name]["properties"][event] = random
        properties["system"]["properties"]["motor"]["examples"] += [
            motor.designation for motor in packaged_motors()
        ]
        return {
            "$schema": "http://json-schema.org/draft-07/schema#",
            "title": "Study file of chainunit",
            "type": "object",
            "additionalProperties": False,
            "properties": properties,
            "allOf": list(rules()),
            "definitions": self.definitions,
        }

    def _add(self, properties: dict[str, Any], table: KeyTable) -> None:
        """Add the keys of a table to its `properties`: a key as ``rotor.J`` to those of ``rotor``, one as ``NAME.J``
        to those of tables with any name. A key that is there already takes the values of both."""
        for key in table.keys:
            *inner_tables, name = key.name.split(".")
            inner, holder = properties, dict[str, Any]()
            for table_name in inner_tables:
                if table_name != NAME:
                    holder = _object(inner, table_name)
                else:
                    if not holder["additionalProperties"]:
                        del holder["additionalProperties"]
                    holder = _object(holder, "additionalProperties")
                inner = holder["properties"]
            form = self._form(key, table)
            if table.of:
                form["description"] = f"{table.of}: {form['description']}"
            present = inner.setdefault(name, form)
            forms = present.get("anyOf", [present])
            if present is not form and form not in forms:
                description = "; ".join(dict.fromkeys((present["description"], form["description"])))
                inner[name] = {"anyOf": [*forms, form], "description": description}

    def _event(self, table: KeyTable, *, random: bool = False) -> dict[str, Any]:
        """The form of an event of one type; a `random` one may have a pair of ends for a quantity."""
        properties: dict[str, Any] = {}
        for key in table.keys:
            if random and key.name in (*PLACED, "name"):
                continue
            form = self._form(key, table)
            if random and key.variable is not None:
                ends = self._quantity(key.variable)
                pair = {"type": "array", "items": ends, "minItems": 2, "maxItems": 2}
                form = {"anyOf": [*form["anyOf"], pair], "description": form["description"]}
            properties[key.name] = form
        # a random event is a jam by default, and its side may be drawn
        by_default = {"type", "side"} if random and table.of == "jam" else {"side"} if random else set()
        needed = [name for name in ("type", "side", "input") if name in properties and name not in by_default]
        return {
            "type": "object",
            "title": table.of,
            "description": table.title,
            "additionalProperties": False,
            "properties": properties,
            "required": needed,
        }

    def _entry(self, table: KeyTable) -> dict[str, Any]:
        """A table of a list in a table."""
        return {
            "type": "object",
            "description": table.title,
            "additionalProperties": False,
            "properties": {key.name: self._form(key, table) for key in table.keys},
        } | dict(entry_tables()[table.name].conditions)

    def _form(self, key: Key, table: KeyTable) -> dict[str, Any]:
        """The form of the value of a key."""
        return self._value(key, f"{table.name}.{key.name}".lstrip(".")) | {"description": _sentence(key)}

    def _value(self, key: Key, name: str) -> dict[str, Any]:
        """The form of the value of a key with that full name, without its description."""
        if key.variable is not None:
            return self._quantity(key.variable)
        if key.items is not None:
            return self._list(key)
        if key.sort in _TYPES:
            return {"type": _TYPES[key.sort]} | (dict(_further(name) or {}) if key.sort == "list" else {})
        text = {"type": "string"} | dict(_further(name) or ({"minLength": 1} if "_names." in name else {}))
        if key.sort == "texts":
            listed = {
                "type": "array",
                "items": text | {"minLength": 1},
                "minItems": 1,
                "maxItems": MOST_FILES,
            }
            return {"anyOf": [text, listed]}
        choices = [word.strip('"') for word in key.words if word.startswith('"')]
        if choices and len(choices) == len(key.words):
            return {"type": "string", "enum": choices}
        # a file or a designation is allowed beside the known names
        return text | ({"examples": choices} if choices else {})

    def _list(self, key: Key) -> dict[str, Any]:
        """The form of a list of quantities; the outline of a shaft is a list of corners (x, y), and its holes are
        outlines."""
        assert key.items is not None
        entry = self._quantity(key.items)
        if not key.name.startswith("shaft"):
            return {"type": "array", "items": entry, "maxItems": key.most}
        corner = {"type": "array", "items": entry, "minItems": 2, "maxItems": 2}
        outline = {"type": "array", "items": corner, "minItems": 3}
        return {"type": "array", "items": outline} if key.name.endswith("holes") else outline

    def _quantity(self, variable: Variable) -> dict[str, Any]:
        """A number within its bounds, or a text with a unit that fits; or a switch."""
        q = variable.quantity
        if q.type == "Boolean":
            return {"anyOf": [{"type": "boolean"}, {"enum": [0, 1]}]}
        form: dict[str, Any] = {"type": "number"}
        if math.isfinite(q.low):
            form |= {"exclusiveMinimum": q.low} if q.open_low else {"minimum": q.low - q.slack}
        if math.isfinite(q.high):
            form["maximum"] = q.high + q.slack
        if whole := q.type == "Integer":
            form["multipleOf"] = 1
        positive = q.open_low and q.low == 0.0 and q.unit != "K"
        text = (pattern(q, whole=whole, share=may_be_share(variable)), positive)
        if text not in self._texts:
            self._texts[text] = f"text {len(self._texts) + 1}"
            written: dict[str, Any] = {"type": "string", "pattern": text[0]}
            if positive:
                written["not"] = {"pattern": zero()}
            self.definitions[self._texts[text]] = written
        return {"anyOf": [form, _reference(self._texts[text])]}


def _object(place: dict[str, Any], name: str, description: str = "") -> dict[str, Any]:
    """The table `name` in a table, made where it is missing."""
    new_table: dict[str, Any] = {"type": "object", "additionalProperties": False, "properties": {}}
    inner: dict[str, Any] = place.setdefault(name, new_table)
    if description:
        inner.setdefault("description", description)
    return inner


def _reference(name: str) -> dict[str, Any]:
    return {"$ref": f"#/definitions/{name}".replace(" ", "%20")}


def _sentence(key: Key) -> str:
    """The meaning of a key, with its unit and the value that it has if the file leaves it out."""
    parts: Iterable[str] = (
        key.description,
        f"[{key.unit.replace('.', ' ')}]" if key.unit else "",
        f"(left out: {left_out})" if (left_out := key.left_out or key.follows) else "",
    )
    return " ".join(filter(None, parts))
