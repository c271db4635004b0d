"""Numbers as people read them: one form for the terminal, pages, Markdown and messages, by unit and kind of quantity.

Kinds, beside the unit (see `quantities.quantity`):

``percent``     a share, shown in %
``dip``         the share of a speed that is lost: where all or more is lost, the shaft stands or turns back
``used``        how much of what is permitted, in % up to ten times of it
``difference``  of temperatures: it stays in K
``rotation``    a speed in rev/min
"""

from __future__ import annotations

import math
import re
from typing import Any

from .quantities import DISPLAY_UNITS, finite

_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_THIN = "\u202f"  # between thousands
_SPACE = "\u00a0"  # before a unit
_PERCENT = 10.0
"""Up to there a share is shown in %, beyond as "over 1000 %", or what is used as so many times of it."""
_NOTHING = 5e-5
"""A share below that is none."""
_TIMES = 1000.0
"""Beyond, what is used is "over 1000 times" of what is permitted: its size says nothing any more."""


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


def shown(value: float, unit: str, kind: str = "", digits: int = 3, *, full: bool = True) -> tuple[str, str]:
    """The number, or words in its place, and the unit that follows it, of a `value` in its declared `unit`."""
    if kind == "dip" and value >= 0.995:
        return "stands" if value < 1.005 else "turns back", ""
    if kind in ("percent", "dip", "used"):
        if abs(value) < _NOTHING:
            value = 0.0
        if abs(value) <= _PERCENT:
            return digits_text(100.0 * value, digits, full=full), "%"
        if kind == "used":
            much = value <= _TIMES
            return (digits_text(value, digits) if much else f"over {digits_text(_TIMES)}"), "times"
        return f"{'over' if value > 0.0 else 'below −'} {digits_text(100.0 * _PERCENT)}".replace(
            "− ", "−"
        ), "%"
    factor, offset = 1.0, 0.0
    if unit in DISPLAY_UNITS and (kind == "rotation" or (unit != "rad/s" and kind != "difference")):
        unit, factor, offset = DISPLAY_UNITS[unit]
    return digits_text(factor * value + offset, digits, full=full), unit_text(unit)


def entry(value: float | None, unit: str, kind: str = "") -> dict[str, Any]:
    """A number as it stands in a result: with its unit, and its kind if it has one; null where it is not finite."""
    return {"value": finite(value), "unit": unit} | ({"kind": kind} if kind else {})


def number(
    value: float | None,
    unit: str,
    kind: str = "",
    digits: int = 3,
    *,
    full: bool = True,
    none: str = "-",
) -> str:
    """The same in one piece and in plain letters, for a terminal or a message; `none` stands for a number that is not
    there."""
    if value is None or math.isnan(value):
        return none
    text, follows = shown(value, unit, kind, digits, full=full)
    return plain(f"{text} {follows}") if follows else plain(text)


_PLAIN = {"−": "-", _THIN: "", "°C": "degC", "°": "deg", "Ω": "Ohm", "∞": "inf"}


def plain(text: str) -> str:
    """A number and its unit in ASCII: 2.34 × 10⁻⁷ kg m² -> 2.34e-7 kg m2."""
    for sign, letters in _PLAIN.items():
        text = text.replace(sign, letters)
    text = text.replace(f"{_SPACE}×{_SPACE}10", "e").replace(_SPACE, " ")
    return text.translate({ord("⁻⁰¹²³⁴⁵⁶⁷⁸⁹"[k]): "-0123456789"[k] for k in range(11)})
