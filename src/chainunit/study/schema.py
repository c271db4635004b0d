"""The JSON Schema of study files, by which editors complete and check them. It is made of the keys (`keys`)."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from ..quantities import Quantity
from .keys import Key, KeyTable, key_tables

FILE = "chainunit.schema.json"
"""The name by which examples refer to it."""
_WITH_UNIT = r"^\s*[+−-]?[\d.]"


def json_schema() -> dict[str, Any]:
    """The schema of a study file with any machine and motor: a key of several machines takes the values of each."""
    tables = key_tables()
    properties: dict[str, Any] = {}
    for table in tables:
        if table.name == "event":
            continue
        place = properties if not table.name else _object(properties, table.name, table.title)["properties"]
        for key in table.keys:
            _add(place, key, table)
    events = [table for table in tables if table.name == "event"]
    properties["event"] = {
        "type": "array",
        "description": "events, each followed from steady running, or in a start; of a file that has none, those "
        "of the example",
        "items": {"anyOf": [_event(table) for table in events]},
    }
    # the event of random overloads may have ranges in place of numbers
    properties["monte_carlo"]["properties"]["event"] = {
        "description": "the event; a quantity may be a range, [least, most]",
        "anyOf": [_event(table, random=True) for table in events],
    }
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "Study file of chainunit",
        "type": "object",
        "additionalProperties": False,
        "properties": properties,
    }


def _object(place: dict[str, Any], name: str, description: str = "") -> dict[str, Any]:
    """The table `name` in a table, made where it is missing."""
    made: dict[str, Any] = {"type": "object", "additionalProperties": False, "properties": {}}
    inner: dict[str, Any] = place.setdefault(name, made)
    if description:
        inner.setdefault("description", description)
    return inner


def _add(place: dict[str, Any], key: Key, table: KeyTable) -> None:
    """Add a key to the properties of a table; one that has it already takes the values of both."""
    *tables, name = key.name.split(".")
    for each in tables:
        place = _object(place, each)["properties"]
    form = _form(key)
    if table.of:
        form["description"] = f"{table.of}: {form['description']}"
    if name in place:
        others = place[name].get("anyOf", [place[name]])
        if form not in others:
            words = "; ".join(dict.fromkeys((place[name]["description"], form["description"])))
            place[name] = {"anyOf": [*others, form], "description": words}
    else:
        place[name] = form


def _event(table: KeyTable, *, random: bool = False) -> dict[str, Any]:
    properties: dict[str, Any] = {}
    for key in table.keys:
        form = _form(key)
        if random and key.variable is not None:
            pair = {"type": "array", "items": dict(form), "minItems": 2, "maxItems": 2}
            form = {"anyOf": [form, pair], "description": form["description"]}
        properties[key.name] = form
    required = [] if random and table.of == "jam" else ["type"]
    return {
        "type": "object",
        "title": table.of,
        "description": table.title,
        "additionalProperties": False,
        "properties": properties,
        "required": required,
    }


def _form(key: Key) -> dict[str, Any]:
    description = {"description": _sentence(key)}
    if key.variable is not None:
        return {
            "anyOf": [_number(key.variable.quantity), {"type": "string", "pattern": _WITH_UNIT}]
        } | description
    if key.sort == "switch":
        return {"type": "boolean"} | description
    if key.sort in ("list", "table"):
        return {"type": "array" if key.sort == "list" else "object"} | description
    choices = [word.strip('"') for word in key.words]
    if choices and all(word.startswith('"') for word in key.words):
        return {"type": "string", "enum": choices} | description
    # beside the known names there may be a file or a designation
    return {"type": "string"} | ({"examples": choices} if choices else {}) | description


def _number(quantity: Quantity) -> dict[str, Any]:
    form: dict[str, Any] = {"type": "number"}
    slack = quantity.slack
    if math.isfinite(quantity.low):
        form |= {"exclusiveMinimum": quantity.low} if quantity.open_low else {"minimum": quantity.low - slack}
    if math.isfinite(quantity.high):
        form["maximum"] = quantity.high + slack
    return form


def _sentence(key: Key) -> str:
    parts: Iterable[str] = (
        key.description,
        f"[{key.unit.replace('.', ' ')}]" if key.unit else "",
        f"(left out: {left_out})" if (left_out := key.left_out or key.follows) else "",
    )
    return " ".join(filter(None, parts))
