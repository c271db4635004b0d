"""Numbers and words on a page, each traced to its place in result.json."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator, Mapping
from html import escape
from typing import Any

from ..quantities import DISPLAY_UNITS

_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_THIN = "\u202f"  # between thousands
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


def unit_text(unit: str) -> str:
    """A declared unit as it is printed: ``kg.m2`` -> kg m², ``1`` -> nothing."""
    if unit == "1":
        return ""
    named = unit.replace("Ohm", "Ω").replace("degC", "°C")
    named = re.sub(r"\bdeg\b", "°", named)
    raised = re.sub(r"(?<=[A-Za-zΩ])-?\d+", lambda power: power[0].translate(_SUPERSCRIPTS), named)
    return raised.replace(".", _SPACE)


def digits_text(value: float, digits: int = 3, *, full: bool = True) -> str:
    """A number with that many digits that count, up to a million with all before the point; with `full`, zeros
    at the end are kept: they say how exact the number is."""
    size = abs(value)
    if value == 0.0:
        return "0"
    if not math.isfinite(value):
        return "∞" if value > 0.0 else "−∞" if value < 0.0 else "-"
    if size >= 1e6 or size < 1e-3:
        mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
        if "." in mantissa and not full:
            mantissa = mantissa.rstrip("0").rstrip(".")
        text = f"{mantissa}{_SPACE}×{_SPACE}10{str(int(exponent)).translate(_SUPERSCRIPTS)}"
    elif size >= 10.0 ** (digits - 1):
        text = f"{value:,.0f}" if size >= 9999.5 else f"{value:.0f}"
        text = text.replace(",", _THIN)
    else:
        text = f"{value:#.{digits}g}".rstrip(".") if full else f"{value:.{digits}g}"
    return text.replace("-", "−")


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
        form: str = "",
        none: str = "–",
        prefix: str = "",
    ) -> str:
        """The number at `path` with its unit, results with 3 digits, what was `given` as it was given.

        `form` "percent" shows a ratio in %, "display" uses the display unit (deg, rev/min, °C) where there is
        one. `none` stands for a value that does not exist, `prefix` is a sign before the number.
        """
        entry = at(self.result, path)
        value, unit = entry["value"], entry["unit"]
        exact = json.dumps(value)
        if value is None:
            shown = f'<span class="none">{escape(none)}</span>'
        else:
            factor, offset, shown_unit = 1.0, 0.0, unit
            if form == "percent" and unit == "1":
                factor, shown_unit = 100.0, "%"
            elif form == "display" and unit in DISPLAY_UNITS:
                shown_unit, factor, offset = DISPLAY_UNITS[unit]
            text = unit_text(shown_unit)
            gap = "" if text in ("", "°") else _SPACE
            number = factor * value + offset
            shown = digits_text(number, digits or (6 if given else 3), full=not given)
            shown = escape(prefix + shown)
            shown += f'{gap}<span class="u">{escape(text)}</span>' if text else ""
        known = "no value" if value is None else f"{value:.9g}" + ("" if unit == "1" else f" {unit}")
        return (
            f'<data class="n" data-path="{escape(path)}" value="{exact}" '
            f'title="{escape(f"{path}: {known}")}">{shown}</data>'
        )

    def text(self, path: str) -> str:
        """The words at `path`."""
        return f'<span class="t" data-path="{escape(path)}">{escape(str(at(self.result, path)))}</span>'
