"""Numbers with units as engineers write them: ``4 kNm``, ``30 rev/min``, ``0.5 kg m²``, ``8 %``, ``40 °C``.

A product is written with a point, a star or a blank, or, in a torque or an inertia, with nothing (``Nm``,
``kgm2``). All factors after a stroke are in the denominator, as in FMI. Every number and unit that the
program prints can be read back.
"""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Mapping, Sequence
from functools import cache

from .quantities import SI, base_units
from .unit_table import NAMED, PREFIXED, UNITS, ZEROS

_NUMBER = re.compile(
    r"([+-]?(?:\d{1,3}(?:[ ']\d{3})+(?:\.\d*)?|\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3}| ?[x*] ?10\^[+-]?\d{1,3})?)"
    r" ?(\D.*|)"
)
_THOUSANDS = re.compile(r"^\s*[+-]?\d{1,3},\d{3}(?!\d)")
_COMMA = re.compile(r"([+-]?\d+),(\d+)(?![\d,.])(.*)")
_TOKEN = re.compile(r" ?([A-Za-zµ%‰]+(?:\^|\*\*)?(?:[+-]?\d)?|[*./()]|1(?!\d)) ?")
_FACTOR = re.compile(r"([A-Za-zµ%‰]+)(?:\^|\*\*)?([+-]?\d)?")
_GLUED = re.compile(r"((?:[kMmµ]|da)?N|kp|k?g|[kM]?[AVW])(mm|cm|m)?(s)?")
_SIGNS = {
    "−": "-",
    "°C": "degC",
    "°F": "degF",
    "°": "deg",
    "Ω": "ohm",
    "Ohm": "ohm",
    "·": "*",
    "⋅": "*",
    "×": "x",
    "μ": "µ",  # the Greek letter, which normal forms have
}
_ANGLES = frozenset(name for name, unit in UNITS.items() if "rad" in unit.base)
_TORQUE_CONSTANT = base_units("N.m/A")
"""As a voltage constant it is in V s/rad."""

FITTING: dict[str, tuple[str, ...]] = {
    "m": ("mm", "cm", "m"),
    "m/s": ("m/s", "mm/s"),
    "m/s2": ("m/s2", "mm/s2"),
    "m2": ("mm2", "cm2", "m2"),
    "kg/m3": ("kg/m3", "g/cm3"),
    "kg": ("kg", "g", "t"),
    "kg.m2": ("kg m2", "kg cm2"),
    "N": ("N", "kN"),
    "N.m": ("N m", "kN m"),
    "N.m/rad": ("N m/rad", "kN m/rad", "N m/deg"),
    "N/m2": ("GPa", "MPa", "N/m2"),
    "s": ("s", "ms", "min", "h"),
    "rad": ("deg", "rad"),
    "rad/s": ("rev/min", "rad/s", "Hz", "rpm"),
    "K": ("degC", "K"),
    "W": ("kW", "W"),
    "V": ("V", "kV"),
    "A": ("A", "mA"),
    "H": ("mH", "H"),
    "Ohm": ("Ohm", "mOhm"),
    "J/K": ("J/K", "kJ/K"),
    "1/K": ("%/K", "1/K"),
}
"""By declared unit, the units in which people write a quantity, the usual one first."""


_KINDS = {
    "m": "a length",
    "m/s": "a speed along a path",
    "m/s2": "an acceleration",
    "m2": "an area",
    "kg/m3": "a density",
    "kg": "a mass",
    "kg.m2": "an inertia",
    "N": "a force",
    "N.m": "a torque",
    "N/m2": "a pressure",
    "s": "a time",
    "rad": "an angle",
    "rad/s": "a speed",
    "K": "a temperature",
    "W": "a power",
    "V": "a voltage",
    "A": "a current",
    "Ohm": "a resistance",
    "H": "an inductance",
}
"""By declared unit, what it measures."""
_WRITTEN_TOO = {"rad/s": ("U/min", "1/min", "r/min"), "N.m": ("Nmm", "Ncm"), "H": ("µH",), "s": ("µs",)}
"""Units that people write beside them, by the declared unit."""
_RARE = ("cm", "g", "t", "h", "kg cm2", "mOhm", "rpm", "Hz")
"""Units that are read but never written."""


def fitting(unit: str, kind: str = "") -> tuple[str, ...]:
    """Units for a quantity of the declared `unit` and `kind`, as a file may write them, the usual one
    first."""
    if unit == "1":
        return ("%",) if kind == "percent" else ()
    if kind == "hours":
        return ("h", "s")
    return FITTING.get(unit, (unit.replace(".", " "),))


IN_RADIANS = "a number without a unit is in radians"


def has_unit(value: object) -> bool:
    """Whether a value of a file is a text with a unit."""
    parts = split(value) if isinstance(value, str) else None
    return parts is not None and bool(parts[1])


def split(text: str) -> tuple[float, str] | None:
    """The number with which a text begins, and the unit after it; None if the text does not begin with a number.

    Blanks and apostrophes between thousands are read (``10 500 N``), as is a power of ten (``2.3 × 10⁻⁷``).
    """
    match = _NUMBER.fullmatch(_ascii(text))
    if match is None:
        return None
    number = re.sub(r" ?[x*] ?10\^", "e", match[1]).replace(" ", "").replace("'", "")
    return float(number), match[2]


def with_point(text: str) -> str:
    """The text with a point in place of a decimal comma; empty if it has none."""
    match = _COMMA.fullmatch(_ascii(text))
    return f"{match[1]}.{match[2]}{match[3]}" if match else ""


def _ascii(text: str) -> str:
    """The text in one spelling: superscripts, signs and blanks of all kinds become plain characters."""
    if text.isascii():
        return " ".join(text.replace("Ohm", "ohm").split())
    # a dash that stands for a minus, and the sign for an ordinal number that looks like a degree
    text = re.sub(r"^(\s*)[–‒]", r"\1-", text).replace("º", "°").replace("’", "'")
    with_carets = re.sub("([⁺⁻]?[⁰¹²³⁴-⁹]+)", r"^\1", text)
    plain = unicodedata.normalize("NFKC", with_carets)
    for sign, letters in _SIGNS.items():
        plain = plain.replace(sign, letters)
    return " ".join(plain.split())


@cache
def single_names() -> tuple[str, ...]:
    """All units that are read and have one name, without a power."""
    glued = [
        f"{first}{length}{time}"
        for first in "N daN kN MN mN µN kp g kg A V W kA kV kW MA MV MW".split()
        for length in ("", "mm", "cm", "m")
        for time in ("", "s")
    ]
    names = dict.fromkeys([*sorted(NAMED), *PREFIXED, *glued])
    return tuple(name for name in names if is_unit(name))


@cache
def dimension(unit_text: str) -> dict[str, int]:
    """The dimension of a unit, as exponents of the SI base units: angles have none, and "C" is a charge."""
    return _dimension(_factors(_ascii(unit_text)))


def _dimension(factors: Sequence[tuple[str, int]]) -> dict[str, int]:
    """The exponents of the SI base units, without angles, of names of `UNITS` with their powers."""
    exponents = dict.fromkeys(SI, 0)
    for name, power in factors:
        for base, exponent in UNITS[name].base.items():
            exponents[base] += power * exponent
    return _without_angle(exponents)


def _without_angle(exponents: Mapping[str, int]) -> dict[str, int]:
    return {base: exponent for base, exponent in exponents.items() if exponent and base != "rad"}


def is_unit(unit_text: str) -> bool:
    """Whether the text is a unit that is read."""
    try:
        dimension(unit_text)
    except ValueError:
        return False
    return True


def convert(number: float, unit_text: str, unit: str, kind: str = "") -> float:
    """The `number`, which is in the unit `unit_text`, in the declared `unit`.

    Raises
    ------
    ValueError
        for a unit of another kind, or an unknown unit.
    """
    factor, zero = scale(unit_text, unit, kind)
    return number * factor + zero


def converts(unit_text: str, unit: str) -> bool:
    """Whether a number in the unit `unit_text` can be converted to the declared `unit`."""
    try:
        scale(unit_text, unit)
    except ValueError:
        return False
    return True


@cache
def scale(unit_text: str, unit: str, kind: str = "") -> tuple[float, float]:
    """Factor and offset from the unit `unit_text` to the declared `unit`.

    A temperature alone counts from the zero of its scale; a temperature in a product, or a difference, is a number of
    degrees.

    Raises
    ------
    ValueError
        for a unit of another kind, or an unknown unit.
    """
    base = base_units(unit)
    factors = _with_turn(_factors(_ascii(unit_text)), base)
    if "K" in base:
        factors = [("degC" if name == "C" else name, power) for name, power in factors]
    if _dimension(factors) != _without_angle(base):
        raise ValueError(f"{unit_text}: is no unit of {unit}")
    factor = math.prod(UNITS[name].factor ** power for name, power in factors)
    zero = next((zero for name, zero in ZEROS.items() if factors == [(name, 1)]), 0.0)
    return factor, 0.0 if kind == "difference" else zero


def of_other_kind(unit_text: str, unit: str) -> str:
    """The remark that a unit measures something else than the declared `unit`: ``kg is a mass``. Empty for an unknown
    unit, and for one of the same dimension."""
    try:
        text_dimension = dimension(unit_text)
    except ValueError:
        return ""
    if text_dimension == dimension("" if unit == "1" else unit):
        return ""
    if unit_text.strip() == "1":
        return "the quantity has no dimension"
    is_share = not text_dimension and not any(name in _ANGLES for name, _ in _factors(_ascii(unit_text)))
    alike = {**_KINDS, "N.m": "a torque or an energy"}
    kind = next(
        (title for sample, title in alike.items() if dimension(sample) == text_dimension),
        "of another quantity",
    )
    return f"{unit_text} is {'a share' if is_share else kind}"


def kind_of(unit: str) -> str:
    """The kind of a quantity of the declared `unit`, such as ``a length``."""
    return _KINDS.get(unit, "a number")


def with_units(unit: str) -> str:
    """The kind and the units of a quantity of the declared `unit`: ``a speed in rev/min, rad/s, Hz or rpm``."""
    *names, last = fitting(unit)
    return f"{kind_of(unit)} in {', '.join(names)}{' or ' if names else ''}{last}"


COMMA = "numbers have a decimal point"


def spelling(text: str, unit: str, kind: str = "") -> str:
    """The advice on the spelling of a refused text, to follow its refusal; empty if nothing similar is allowed."""
    comma = f"; {COMMA}" if re.search(r"\d,\d", text) else ""
    probable = " or ".join(f'"{candidate}"' for candidate in _probable_texts(text, unit, kind))
    return comma + (f"; was {probable} meant?" if probable else "")


_INCHES = {'"': "in", "''": "in", "\u2033": "in", "'": "ft", "\u2032": "ft"}
"""Signs for inches and feet."""


def _probable_texts(text: str, unit: str, kind: str) -> list[str]:
    """The texts that the user may have meant, for a quantity of this `unit` and `kind`: with a point in place of a
    comma, or with the right case of letters. A comma after which three digits stand may also part thousands."""
    if _THOUSANDS.search(text):
        candidates = [text.replace(",", sign, 1).strip() for sign in ("", ".")]
        return candidates if all(_reads(candidate, unit, kind) for candidate in candidates) else []
    text = with_point(text) or text
    if (parts := split(text)) and parts[1] in _INCHES:
        text = f"{parts[0]:.15g} {_INCHES[parts[1]]}"
    if _reads(text, unit, kind):
        return [text.strip()]
    number, unit_text = split(text) or (math.nan, "")
    for name in ("", *fitting(unit, kind), *_WRITTEN_TOO.get(unit, ()), *single_names()):
        candidate = f"{number:.15g} {name}".strip()
        same = name.lower().replace(" ", "") == unit_text.lower().replace(" ", "")
        if same and _reads(candidate, unit, kind):
            return [candidate]
    return []


def _reads(text: str, unit: str, kind: str) -> bool:
    """Whether the text is a number of that unit and kind."""
    parts = split(text)
    try:
        return parts is not None and (not parts[1] or math.isfinite(convert(*parts, unit, kind)))
    except ValueError:
        return False


def _with_turn(factors: list[tuple[str, int]], base: dict[str, int]) -> list[tuple[str, int]]:
    """The factors, with a turn added if a speed is given without an angle: 15 1/min or 0.25 Hz of a machine.

    Raises
    ------
    ValueError
        if the unit names an angle and the quantity has none, or the reverse. The torque constant of a motor is also a
        voltage per speed.
    """
    angles = [power for name, power in factors if name in _ANGLES]
    power = base.get("rad", 0)
    if base == _TORQUE_CONSTANT and sum(angles) == -1:
        return factors
    if angles and sum(angles) != power:
        raise ValueError("an angle is named that the quantity does not have")
    if angles or power <= 0:
        return factors
    if ("Hz", 1) in factors or factors[:1] == [("min", -1)]:
        return [*factors, ("revolution", 1)]
    raise ValueError("no angle is named, and the quantity has one")


def _factors(unit_text: str) -> list[tuple[str, int]]:
    """The names of `UNITS` and their powers in a unit without special signs.

    Raises
    ------
    ValueError
        for a name that is no unit, and for unpaired brackets.
    """
    factors: list[tuple[str, int]] = []
    outer_signs: list[int] = []
    # a stroke inverts all factors after it, up to the end of its brackets
    begin, sign, position = 1, 1, 0
    while position < len(unit_text):
        match = _TOKEN.match(unit_text, position)
        if match is None:
            raise ValueError(f"{unit_text}: cannot be read")
        token, position = match[1], match.end()
        if token == "/":
            sign = -begin
        elif token == "(":
            outer_signs.append(begin)
            begin = sign
        elif token == ")":
            if not outer_signs:
                raise ValueError(f"{unit_text}: brackets do not open")
            sign, begin = begin, outer_signs.pop()
        elif token not in ("*", ".", "1"):
            factors += _named_factors(token, sign)
    if outer_signs:
        raise ValueError(f"{unit_text}: brackets do not close")
    return factors


def _named_factors(token: str, sign: int) -> list[tuple[str, int]]:
    """The factors of a name with its power, such as ``kg``, ``m2`` and the product ``Nm``."""
    match = _FACTOR.fullmatch(token)
    assert match is not None  # a token of a name is a factor
    name, power = match[1], sign * int(match[2] or 1)
    product = _GLUED.fullmatch(name)
    if name in UNITS:
        return [(name, power)]
    if product is None or (product[2] is None and product[3] is None) or name == "gs":
        raise ValueError(f"{name}: is no unit")
    parts = [part for part in product.groups() if part]
    return [*((part, sign) for part in parts[:-1]), (parts[-1], power)]


def shortest_text(value: float, unit: str, kind: str = "") -> str:
    """The value of a quantity as TOML, in the unit in which its text is shortest and exact: 0.06 m -> ``"60 mm"``. A
    pure number has no unit; a share is in percent."""
    if value == 0.0 and unit != "1":
        # a temperature is not zero in every unit
        return f'"0 {fitting(unit, kind)[-1 if unit == "K" else 0]}"'
    texts = []
    for name in fitting(unit, kind):
        if name in _RARE and name != unit:
            continue
        factor, zero = scale(name, unit, kind)
        number = f"{(value - zero) / factor:.12g}"
        if abs(convert(float(number), name, unit, kind) - value) <= 1e-12 * abs(value):
            texts.append(f'"{number} {name}"')
    return min(texts, key=len) if texts else f"{value:.15g}"
