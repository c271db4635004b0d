"""The JSON Schema of study files, by which editors complete and check them. It is made from the keys
(`keys`); the rules of their combinations are in `schema_rules`.

An editor sees a date of TOML as a text. A schema can neither compare the sizes of two values, such as lengths
with which the crank cannot turn, nor read another file: the reader of study files checks these.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

from ..core.declared_numbers import may_be_share
from ..core.quantities import Variable
from ..drives.catalogue import packaged_motors
from ..reading.unit_patterns import pattern, zero
from .entry_values import MOST_FILES
from .event import TYPES
from .event_table import LONGEST_NAME, PLACED, RESERVED
from .keys import Key, KeyTable, entry_tables, key_tables
from .parts import LONGEST_FILE
from .schema_rules import OF_PARTS, rules
from .sections import all_sections

FILE = "chainunit.schema.json"
"""The name by which examples refer to it."""
_EVENT_NAME = {
    "pattern": rf"^[a-z][a-z0-9_]{{0,{LONGEST_NAME - 1}}}$",
    "not": {"anyOf": [{"enum": list(RESERVED)}, {"pattern": "_coasting$"}]},
}
_VALUE: dict[str, Any] = {"type": ["number", "string"]}
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
    return _FORMS.get(name) or (sections[table].forms.get(key) if table in sections else None)


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
            place = properties
            if table.name in entry_tables():
                above, _, name = table.name.partition(".")
                if table.is_named:
                    _object(properties, above, table.title)["additionalProperties"] = self._entry(table)
                    continue
                properties[above]["properties"][name]["items"] = self._entry(table)
                continue
            if table.name:
                place = _object(properties, table.name, table.title)["properties"]
            for key in table.keys:
                self._add(place, key, table)
            if table.name in OF_PARTS:
                part_tables: dict[str, Any] = {}
                inside = _object(part_tables, table.name)["properties"]
                for key in table.keys:
                    self._add(inside, key, table)
                self.definitions[f"{table.name}.{table.of}"] = part_tables[table.name]
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

    def _add(self, place: dict[str, Any], key: Key, table: KeyTable) -> None:
        """Add a key to the properties of a table; a key that is there already takes the values of both."""
        *tables, name = key.name.split(".")
        for part in tables:
            place = _object(place, part)["properties"]
        form = self._form(key, table)
        if table.of:
            form["description"] = f"{table.of}: {form['description']}"
        if name in place:
            others = place[name].get("anyOf", [place[name]]) if "anyOf" in place[name] else [place[name]]
            if form not in others:
                description = "; ".join(dict.fromkeys((place[name]["description"], form["description"])))
                place[name] = {"anyOf": [*others, form], "description": description}
        else:
            place[name] = form

    def _event(self, table: KeyTable, *, random: bool = False) -> dict[str, Any]:
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
        needed = ["type"] if not random or table.of != "jam" else []
        if "side" in properties and not random:
            needed.append("side")
        if "input" in properties:
            needed.append("input")
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
        description = {"description": _sentence(key)}
        if key.variable is not None:
            return self._quantity(key.variable) | description
        if key.sort == "switch":
            return {"type": "boolean"} | description
        if key.sort == "list" and key.items is None:
            return {"type": "array"} | dict(_further(f"{table.name}.{key.name}") or {}) | description
        if key.sort == "list":
            return self._list(key) | description
        if key.sort == "value":
            return dict(_VALUE) | description
        if key.sort == "texts":
            one = {"type": "string"} | dict(_further(key.name) or {})
            listed = {"type": "array", "items": one | {"minLength": 1}, "minItems": 1, "maxItems": MOST_FILES}
            return {"anyOf": [one, listed]} | description
        if key.sort == "table":
            return {"type": "object"} | description
        choices = [word.strip('"') for word in key.words if word.startswith('"')]
        if choices and len(choices) == len(key.words):
            return {"type": "string", "enum": choices} | description
        # a file or a designation is allowed beside the known names
        name = f"{table.name}.{key.name}".lstrip(".")
        further = _further(name) or ({"minLength": 1} if "_names." in name else {})
        form: dict[str, Any] = {"type": "string"} | dict(further)
        return form | ({"examples": choices} if choices else {}) | description

    def _list(self, key: Key) -> dict[str, Any]:
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
    parts: Iterable[str] = (
        key.description,
        f"[{key.unit.replace('.', ' ')}]" if key.unit else "",
        f"(left out: {left_out})" if (left_out := key.left_out or key.follows) else "",
    )
    return " ".join(filter(None, parts))
