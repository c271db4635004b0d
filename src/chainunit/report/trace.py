"""Numbers and words on a page, each traced to its place in result.json."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from html import escape
from typing import Any

from ..text import shown

_SPACE = "\u00a0"  # before a unit


def at(result: Any, path: str) -> Any:
    """What stands at the dotted `path` in a result; a key may itself hold dots ("machine.crank.m"), and the items
    of a list have their number.

    Raises
    ------
    KeyError
        where there is nothing.
    """
    for found in _matches(result, path):
        return found
    raise KeyError(path)


def _matches(node: Any, path: str) -> Iterator[Any]:
    keys: Mapping[str, Any] = {}
    if isinstance(node, Mapping):
        keys = node
    elif isinstance(node, list):
        keys = {str(i): item for i, item in enumerate(node)}
    for key, below in keys.items():
        if path == key:
            yield below
        elif path.startswith(f"{key}."):
            yield from _matches(below, path[len(key) + 1 :])


def markdown_text(text: str) -> str:
    """A text that is not ours, as Markdown shows it literally: no link, no table cell, no HTML."""
    return re.sub(r"([\\`*_\[\]<>#!|~&$])", r"\\\1", text)


class Traced:
    """Renders entries of a `result` as HTML elements that carry their path and their value as it is there."""

    def __init__(self, result: Mapping[str, Any]) -> None:
        self.result = result

    def value(self, path: str) -> float | None:
        """The bare value of the entry at `path`."""
        return at(self.result, path)["value"]

    def number(
        self,
        path: str,
        *,
        digits: int | None = None,
        given: bool = False,
        kind: str | None = None,
        none: str = "–",
        prefix: str = "",
    ) -> str:
        """The number at `path` with its unit, results with 3 digits, what was `given` as it was given.

        `kind` is that of the quantity (see `chainunit.text`), by default the entry's own. `none` stands for a value
        that does not exist, `prefix` is a sign before the number.
        """
        entry = at(self.result, path)
        value, unit = entry["value"], entry["unit"]
        exact = json.dumps(value)
        if value is None:
            words = f'<span class="none">{escape(none)}</span>'
        else:
            kind = entry.get("kind", "") if kind is None else kind
            text, follows = shown(value, unit, kind, digits or (6 if given else 3), full=not given)
            gap = "" if follows in ("", "°") else _SPACE
            words = escape(prefix + text)
            words += f'{gap}<span class="u">{escape(follows)}</span>' if follows else ""
        known = "no value" if value is None else f"{value:.9g}" + ("" if unit == "1" else f" {unit}")
        return (
            f'<data class="n" data-path="{escape(path)}" value="{exact}" '
            f'title="{escape(f"{path}: {known}")}">{words}</data>'
        )

    def text(self, path: str) -> str:
        """The words at `path`."""
        return f'<span class="t" data-path="{escape(path)}">{escape(str(at(self.result, path)))}</span>'
