"""The units that people write: their names, and the factor of each to the units of the declarations."""

from __future__ import annotations

import math
from typing import NamedTuple

from .quantities import base_units


class Unit(NamedTuple):
    """A unit that has a name."""

    factor: float
    """One of it in units of the declarations; of a temperature, one degree of its scale."""
    base: dict[str, int]
    """Exponents of the SI base units, see `base_units`."""


_FORCE = 9.80665
"""One kilogram-force [N]."""
_TURN = 2.0 * math.pi
_ROWS = (
    ("m metre metres meter meters", 1.0, "m"),
    ("in inch inches", 0.0254, "m"),
    ("ft", 0.3048, "m"),
    ("kilogram kilograms", 1.0, "kg"),
    ("g gram grams", 1e-3, "kg"),
    ("t tonne tonnes", 1e3, "kg"),
    ("lb", 0.45359237, "kg"),
    ("s sec second seconds", 1.0, "s"),
    ("min minute minutes", 60.0, "s"),
    ("h hour hours", 3600.0, "s"),
    ("d day days", 86400.0, "s"),
    ("Hz hertz", 1.0, "Hz"),
    ("N newton", 1.0, "N"),
    ("kp kgf", _FORCE, "N"),
    ("lbf", 4.4482216152605, "N"),
    ("Pa", 1.0, "N/m2"),
    ("bar", 1e5, "N/m2"),
    ("J joule", 1.0, "J"),
    ("Wh", 3600.0, "J"),
    ("kWh", 3.6e6, "J"),
    ("W watt VA", 1.0, "W"),
    ("kVA", 1e3, "W"),
    ("PS", 75.0 * _FORCE, "W"),
    # 550 ft lbf/s
    ("hp", 745.6998715822702, "W"),
    ("V volt", 1.0, "V"),
    ("A amp ampere", 1.0, "A"),
    ("C", 1.0, "A.s"),
    ("ohm", 1.0, "Ohm"),
    ("H henry", 1.0, "H"),
    ("F", 1.0, "A.s/V"),
    ("Wb", 1.0, "Wb"),
    ("T", 1.0, "Wb/m2"),
    ("K kelvin degC", 1.0, "K"),
    ("degF", 5.0 / 9.0, "K"),
    ("% percent", 0.01, "1"),
    ("‰ permille", 0.001, "1"),
    ("rad radian radians", 1.0, "rad"),
    ("mrad", 1e-3, "rad"),
    ("deg degree degrees", math.pi / 180.0, "rad"),
    ("arcmin", math.pi / 10800.0, "rad"),
    ("arcsec", math.pi / 648000.0, "rad"),
    ("rev revs r U revolution revolutions turn turns", _TURN, "rad"),
    ("rpm", _TURN * 60.0**-1, "rad/s"),
)
NAMED = {name: Unit(factor, base_units(unit)) for names, factor, unit in _ROWS for name in names.split()}
_PREFIXES = {
    "k": 3,
    "M": 6,
    "G": 9,
    "T": 12,
    "m": -3,
    "µ": -6,
    "u": -6,
    "n": -9,
    "p": -12,
    "d": -1,
    "c": -2,
    "da": 1,
}
"""Powers of ten."""
PREFIXED = {
    f"{prefix}{name}": Unit(float(f"1e{power}") * NAMED[name].factor, NAMED[name].base)
    for prefix, power in _PREFIXES.items()
    for name in "m g s N J W V A K Hz Pa ohm H Wb T F".split()
}
UNITS = {**PREFIXED, **NAMED}
"""All units that are read, by name. A name has the meaning that engineers intend: h is an hour, t is 1000 kg."""
ZEROS = {"degC": 273.15, "degF": 233.15 + 200.0 / 9.0}
"""Zeros of scales of temperature [K]."""
