"""Numbers as people read them: one form for the terminal, pages, Markdown and messages, by unit and kind of quantity.

Kinds, beside the unit (see `quantities.quantity`):

``percent``      a share, shown in %
``dip``          the lost share of a speed; at 100 % or more, "stands" or "turns back"
``used``         the used share of a limit: in % up to ten times the limit, beyond that as a multiple
``points``       a difference of shares, in percentage points
``difference``   a difference of temperatures, which stays in K
``speed``        the speed of a shaft, in rad/s and rev/min
``frequency``    an angular frequency, in rad/s and Hz
``energy``       the energy of long operation, in kWh
``hours``        the time of long operation, in h
``assumed``      a value that is known to one digit
``millimetres``  a length in mm
``stress``       a stress or a pressure, in MPa
``pv``           a pressure times a sliding speed, in MPa m/s
``per_hour``     a number in each hour
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from types import MappingProxyType
from typing import Any, TypeAlias

from ..core.errors import Faults, InputError, near_name, printable, shown
from ..core.quantities import DISPLAY_UNITS, Layout, finite

_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_THIN = "\u202f"  # between thousands
_SPACE = "\u00a0"  # before a unit
MOST_PERCENT = 10.0
"""Largest share that is shown in %. A larger one is "over 1000 %"; a larger used share is a multiple."""
_NOTHING = 5e-5
"""A share below this value is shown as 0."""
_TIMES = 1000.0
"""Largest multiple of a limit that is shown. A larger one is "over 1000 times", as its size has no meaning
any more."""
_SHARES = ("percent", "dip", "used")

Units: TypeAlias = Mapping[str, tuple[str, ...]]
"""By kind, the units in which its numbers are shown: one unit, or one and a second beside it."""

DEFAULT_UNITS: Units = MappingProxyType(
    {
        "speed": ("rad/s", "rev/min"),
        "frequency": ("rad/s", "Hz"),
        "power": ("kW",),
        "points": ("% points",),
        "energy": ("kWh",),
        "hours": ("h",),
        "millimetres": ("mm",),
        "stress": ("MPa",),
        "pv": ("MPa m/s",),
        "per_hour": ("1/h",),
    }
)
_SHOWN_IN: ContextVar[Units] = ContextVar("units of words", default=DEFAULT_UNITS)
_KIND_OF = {"W": "power", "N.m": "torque", "N": "force", "J": "work", "N/m2": "stress"}
"""By unit, the kind of a quantity that declares none."""
_SCALES: dict[str, dict[str, tuple[float, float]]] = {
    "speed": {"rad/s": (1.0, 0.0), "rev/min": (30.0 / math.pi, 0.0)},
    "frequency": {"rad/s": (1.0, 0.0), "Hz": (0.5 / math.pi, 0.0)},
    "power": {"W": (1.0, 0.0), "kW": (1e-3, 0.0)},
    "points": {"% points": (100.0, 0.0)},
    "energy": {"J": (1.0, 0.0), "kWh": (1.0 / 3.6e6, 0.0)},
    "hours": {"h": (1.0 / 3600.0, 0.0)},
    "torque": {"N.m": (1.0, 0.0), "kN.m": (1e-3, 0.0)},
    "force": {"N": (1.0, 0.0), "kN": (1e-3, 0.0)},
    "work": {"J": (1.0, 0.0), "kJ": (1e-3, 0.0)},
    "millimetres": {"mm": (1e3, 0.0)},
    "stress": {"MPa": (1e-6, 0.0)},
    "pv": {"MPa m/s": (1e-6, 0.0)},
    "per_hour": {"1/h": (3600.0, 0.0)},
}
"""By kind, the units in which it may be shown, with factor and offset: shown = factor * value + offset."""
_BY_SIZE: Mapping[str, tuple[float, float, str]] = {
    "power": (0.0, 100.0, "W"),
    "torque": (1e4, math.inf, "kN.m"),
    "force": (1e4, math.inf, "kN"),
    "work": (1e4, math.inf, "kJ"),
}
"""By kind, from which size on, up to which, and in which unit a number is shown whose unit nobody chose."""
_ROUNDING = 1e-9
"""Size of a power [W] below which it is rounding."""
CHOICES = {
    kind: tuple(scales)
    for kind, scales in _SCALES.items()
    if len(scales) > 1 and kind not in ("frequency", "energy")
}
"""Units that an engineer may choose, by kind."""


def chosen_units(choices: Mapping[str, Any]) -> Units:
    """The units in which numbers are shown, with the units that the user chooses for some kinds: ``{"speed":
    "rev/min"}``.

    Raises
    ------
    InputError
        with a line for each unknown kind and unit.
    """
    faults = Faults()
    for kind, unit in choices.items():
        key = f"report.units.{printable(kind, 80)}"
        if kind not in CHOICES:
            problem = f"unknown kind; must be one of {', '.join(CHOICES)}{near_name(kind, CHOICES)}"
            faults.add([InputError(f"{key}: {problem}", key)])
        elif unit not in CHOICES[kind]:
            allowed_units = " or ".join(f'"{name}"' for name in CHOICES[kind])
            faults.add([InputError(f"{key} = {shown(unit)}: must be {allowed_units}", key)])
    faults.refuse()
    return {**DEFAULT_UNITS, **{kind: (unit,) for kind, unit in choices.items()}}


@contextmanager
def shown_in(units: Units) -> Iterator[None]:
    """A context in which the numbers in sentences are in these units, as a study uses the units that its
    reader chose."""
    token = _SHOWN_IN.set(units)
    try:
        yield
    finally:
        _SHOWN_IN.reset(token)


def scales(unit: str, kind: str = "", units: Units = DEFAULT_UNITS) -> list[tuple[str, float, float]]:
    """The units in which a quantity is shown, first unit first, each with factor and offset:
    shown = factor * value + offset."""
    if kind in _SHARES:
        return [("%", 100.0, 0.0)]
    quantity_kind = kind if kind in _SCALES else _KIND_OF.get(unit, "")
    if quantity_kind in units:
        return [(name, *_SCALES[quantity_kind][name]) for name in units[quantity_kind]]
    if unit in DISPLAY_UNITS and unit != "rad/s" and kind != "difference":
        return [DISPLAY_UNITS[unit]]
    return [(unit, 1.0, 0.0)]


def scales_of_size(value: float, unit: str, kind: str, units: Units) -> list[tuple[str, float, float]]:
    """The `scales` of one number, or of an axis up to that number: a large torque is in kN m and a small power in W,
    unless the user chose another unit."""
    quantity_kind = kind if kind in _SCALES else _KIND_OF.get(unit, "")
    if quantity_kind not in _BY_SIZE or units.get(quantity_kind) != DEFAULT_UNITS.get(quantity_kind):
        return scales(unit, kind, units)
    low, high, name = _BY_SIZE[quantity_kind]
    if not low <= abs(value) < high:
        return scales(unit, kind, units)
    factor, offset = _SCALES[quantity_kind][name]
    return [(name, 0.0 if quantity_kind == "power" and abs(value) < _ROUNDING else factor, offset)]


def unit_text(unit: str) -> str:
    """A declared unit as it is printed: ``kg.m2`` -> kg m², ``1`` -> nothing."""
    if unit == "1":
        return ""
    name = unit.replace("Ohm", "Ω").replace("degC", "°C")
    name = re.sub(r"\bdeg\b", "°", name)
    text = re.sub(r"(?<=[A-Za-zΩ])-?\d+", lambda power: power[0].translate(_SUPERSCRIPTS), name)
    return text.replace(".", _SPACE)


def digits_text(value: float, digits: int = 3, *, full: bool = True) -> str:
    """A number with so many significant `digits`; up to a million all digits before the point are written.
    With `full`, zeros at the end are kept: they show how exact the number is."""
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


def _share(value: float, kind: str, digits: int, full: bool) -> tuple[str, str]:
    """A share as the number, or words in its place, and the sign that follows it."""
    if kind == "dip" and value >= 0.995:
        return "stands" if value < 1.005 else "turns back", ""
    if abs(value) < _NOTHING:
        value = 0.0
    if abs(value) <= MOST_PERCENT:
        return digits_text(100.0 * value, digits, full=full), "%"
    if kind == "used":
        much = value <= _TIMES
        return (digits_text(value, digits) if much else f"over {digits_text(_TIMES)}"), "times"
    return f"{'over ' if value > 0.0 else 'below −'}{digits_text(100.0 * MOST_PERCENT)}", "%"


def forms(
    value: float,
    unit: str,
    kind: str = "",
    digits: int = 3,
    *,
    full: bool = True,
    units: Units = DEFAULT_UNITS,
) -> list[tuple[str, str]]:
    """A `value` in its declared `unit` as text: for each unit in which it is shown, the number (or words in
    its place) and the unit that follows it."""
    if kind in _SHARES:
        return [_share(value, kind, digits, full)]
    if kind == "assumed":
        value, full = float(f"{value:.0e}"), False
    texts = []
    for name, factor, offset in scales_of_size(value, unit, kind, units):
        texts.append((digits_text(factor * value + offset, digits, full=full), unit_text(name)))
        # beside a number as it was given the other unit is a result
        digits, full = digits if full else 3, True
    return texts


def entry(value: float | None, unit: str, kind: str = "") -> dict[str, Any]:
    """A number as a result holds it: with its unit, and its kind if it has one; None if it is not
    finite."""
    return {"value": finite(value), "unit": unit} | ({"kind": kind} if kind else {})


def array_entry(x: Any, unit: str, kind: str = "") -> dict[str, Any]:
    """An array as a result holds it, see `entry`; None for each number that is not finite."""

    def plain_list(x: Any) -> Any:
        return [plain_list(element) for element in x] if isinstance(x, list | tuple) else finite(float(x))

    value = plain_list(x.tolist() if hasattr(x, "tolist") else x)
    return {"value": value, "unit": unit} | ({"kind": kind} if kind else {})


def entries(instance: Any) -> dict[str, Any]:
    """The declared values of an instance as ``{name: entry}``."""
    layout = Layout(type(instance))
    return {
        v.name: entry(value, v.unit, v.kind)
        for v, value in zip(layout.variables, layout.values(instance), strict=True)
    }


def number(
    value: float | None,
    unit: str,
    kind: str = "",
    digits: int = 3,
    *,
    full: bool = True,
    none: str = "-",
    units: Units | None = None,
    beside: bool = True,
) -> str:
    """The text of `forms` in one piece and in plain letters, for a terminal or a message. With `beside`, the
    second unit follows in brackets. `none` is the text for a missing number. The units are the ones of
    `shown_in`, unless `units` gives others."""
    if value is None or math.isnan(value):
        return none
    texts = [
        plain(f"{text} {follows}" if follows else text)
        for text, follows in forms(value, unit, kind, digits, full=full, units=units or _SHOWN_IN.get())
    ]
    return texts[0] + "".join(f" ({other})" for other in texts[1:] if beside)


def aside(text: str | None) -> str:
    """The text in brackets, to follow a word; empty for none."""
    return f" ({text})" if text else ""


_PLAIN = {"−": "-", _THIN: "", "°C": "degC", "°": "deg", "Ω": "Ohm", "∞": "inf"}


def plain(text: str) -> str:
    """A number and its unit in characters that can be typed, except the powers of units: 2.34 × 10⁻⁷ kg m² ->
    2.34e-7 kg m²."""
    for sign, letters in _PLAIN.items():
        text = text.replace(sign, letters)
    digits = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
    exponent = f"{_SPACE}×{_SPACE}10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)"
    text = re.sub(exponent, lambda power: f"e{power[1].translate(digits)}", text)
    return text.replace(_SPACE, " ")
