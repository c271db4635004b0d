"""Texts of numbers with units as patterns of a JSON Schema. `units` refuses every text that does not match.

A unit of one name must fit the quantity. The reader checks products, quotients and
powers, and characters that have no place in a unit. The patterns use only features that the regular
expressions of Python, ECMAScript and Rust have in common.
"""

from __future__ import annotations

import re
from functools import cache

from ..core import units
from ..core.quantities import Quantity

_POWER = r"[eE][+−-]?\d{1,3}|\s?[x×*]\s?10(?:\^[+−-]?\d{1,3}|[⁺⁻]?[⁰¹²³⁴⁵⁶⁷⁸⁹]{1,3})"
_DIGITS = rf"(?:\d{{1,3}}(?:[\s']\d{{3}})+(?:\.\d*)?|\d+\.?\d*|\.\d+)(?:{_POWER})?"
_WHOLE = r"(?:\d{1,3}(?:[\s']\d{3})+|\d+)(?:\.0*)?"
"""A number without its sign, and a whole one."""
_ZERO = r"(?:0+\.?0*|\.0+)"
_SIGNS = "°Ω℃µμ−‰⁰¹²³⁴⁵⁶⁷⁸⁹⁺⁻·⋅×"
"""Characters beyond ASCII that have a place in a number or a unit."""
_COMPOUND = r"(?:1\s?/.*|[A-Za-zµμ°Ω℃%‰(/].*[*/.()\s\d⁰¹²³⁴⁵⁶⁷⁸⁹⁻·⋅×^].*|[(/].*)"
_SPELLINGS = (("degC", "°C"), ("degC", "℃"), ("deg", "°"), ("ohm", "Ω"), ("ohm", "Ohm"), ("µ", "μ"))


def pattern(quantity: Quantity, *, whole: bool, share: bool) -> str:
    """The pattern of the texts that may state a quantity: with `whole` only whole numbers, with `share` also
    percent."""
    digits = rf"(?:{_WHOLE}|\d+\.?\d*[eE]\+?\d{{1,3}})" if whole else _DIGITS
    signed = rf"[+−-]?{digits}"
    if quantity.unit != "K" and quantity.low >= 0.0:
        signed = rf"(?:\+?{digits}|[−-]{_ZERO})"
    names = [name for name in _names(quantity.unit) if share or not set(name) & set("%‰")]
    unit = "|".join([*map(re.escape, names), _COMPOUND])
    return rf"^(?:\s*{signed}\s*(?:{unit})?\s*|.*[^\x00-\x7F\s{_SIGNS}].*)$".replace("\\%", "%")


def zero() -> str:
    """The pattern of texts that state zero in any unit."""
    return r"^\s*[+−-]?[0.]+\s*(?:[A-Za-z%‰°µμΩ(/].*)?$"


@cache
def _names(unit: str) -> tuple[str, ...]:
    """The units of one name that fit a quantity of the declared `unit`, in all spellings."""
    fitting = [name for name in units.single_names() if units.converts(name, unit)]
    spellings = [name.replace(plain, sign) for plain, sign in _SPELLINGS for name in fitting if plain in name]
    return tuple(dict.fromkeys([*fitting, *spellings]))
