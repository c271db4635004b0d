"""Torsional stiffness of shafts from their geometry: torsion constants I_t [m4], stiffness G I_t/length."""

from __future__ import annotations

import importlib.util
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from ..core.errors import InputError
from ..core.quantities import Value, declaration, quantity

Point = tuple[float, float]
STEEL = 8.0e10
"""Shear modulus [N/m2]."""


@declaration
class Shaft:
    """A shaft of one section over its whole length; `SECTIONS` lists the dimensions of each section."""

    outer: Value = quantity("m", "outer diameter", default=0.06, above=0.0, max=10.0)
    inner: Value = quantity("m", "inner diameter", default=0.0, min=0.0, max=10.0)
    a: Value = quantity("m", "outer width", default=0.06, above=0.0, max=10.0)
    b: Value = quantity("m", "outer height", default=0.06, above=0.0, max=10.0)
    wall: Value = quantity("m", "thickness of the wall", default=0.005, above=0.0, max=1.0)
    length: Value = quantity("m", "twisted length", default=1.0, above=0.0, max=1000.0)
    shear_modulus: Value = quantity(
        "N/m2", "shear modulus; that of steel by default", default=STEEL, above=0.0, max=1e13
    )


def stiffness(torsion_constant: float, length: float, shear_modulus: float = STEEL) -> float:
    """Torsional stiffness [N m/rad] of a shaft of the `length` [m]; steel by default."""
    return shear_modulus * torsion_constant / length


def hollow(outer: float, inner: float = 0.0) -> float:
    """Torsion constant of a round shaft with diameters `outer` and `inner` [m]; solid by default.

    Raises
    ------
    InputError
        where the inner diameter leaves no wall.
    """
    if not 0.0 <= inner < outer:
        raise InputError(f"inner = {inner:g} m: must be >= 0 and < the outer diameter, {outer:g} m")
    return math.pi / 32.0 * (outer**4 - inner**4)


def rectangle(a: float, b: float, terms: int = 12) -> float:
    """Torsion constant of a rectangular shaft with the sides `a`, `b` [m], by Saint-Venant's series.

    Raises
    ------
    InputError
        for a side that is not above zero.
    """
    if not (a > 0.0 and b > 0.0):
        raise InputError(f"sides {a:g} m and {b:g} m: must be > 0 m")
    long, short = max(a, b), min(a, b)
    series = sum(math.tanh(0.5 * n * math.pi * long / short) / n**5 for n in range(1, 2 * terms, 2))
    return long * short**3 / 3.0 * (1.0 - 192.0 / math.pi**5 * short / long * series)


def box(a: float, b: float, wall: float) -> float:
    """Torsion constant of a thin-walled box with outer sides `a`, `b` and the `wall` thickness [m], by Bredt's second
    formula on the middle line.

    Raises
    ------
    InputError
        where the wall leaves no hollow.
    """
    if not 0.0 < wall < 0.5 * min(a, b):
        raise InputError(f"wall = {wall:g} m: must be > 0 and < {0.5 * min(a, b):g} m, half the shorter side")
    width, height = a - wall, b - wall
    return 2.0 * wall * (width * height) ** 2 / (width + height)


_ELEMENTS = 1000
"""Number of elements of the mesh: the error of the torsion constants of rectangles and rings is below 1e-3."""


def polygon(outline: Sequence[Point], holes: Sequence[Sequence[Point]] = ()) -> float:
    """Torsion constant of any section, by finite elements (sectionproperties, extra ``sections``).

    `outline` and each of `holes` are corners [m] in order, shape (corners, 2).

    Raises
    ------
    InputError
        without the extra, and for corners that do not bound one connected area.
    """
    if importlib.util.find_spec("sectionproperties") is None:
        raise InputError('section: "polygon" needs the extra sections: pip install "chainunit[sections]"')
    from sectionproperties.analysis import Section
    from sectionproperties.pre import Geometry
    from shapely import Polygon

    for corners in (outline, *holes):
        if len(corners) < 3:
            raise InputError(f"outline: {len(corners)} corners; an outline or a hole needs at least 3")
    shape = Polygon(outline, holes)
    if not shape.is_valid or not shape.area > 0.0:
        raise InputError("outline: crosses itself, or a hole is not inside it; give its corners in order")
    geometry = Geometry(shape)
    geometry.create_mesh(mesh_sizes=[shape.area / _ELEMENTS])
    section = Section(geometry)
    section.calculate_geometric_properties()
    section.calculate_warping_properties()
    return float(section.get_j())


class CrossSection(NamedTuple):
    """A kind of cross-section: its dimensions, in the order of its formula, and its torsion constant."""

    takes: tuple[str, ...]
    constant: Callable[..., float]
    also: tuple[str, ...] = ()
    """optional dimensions"""


SECTIONS = {
    "round": CrossSection(("outer",), hollow),
    "hollow": CrossSection(("outer", "inner"), hollow),
    "rectangle": CrossSection(("a", "b"), rectangle),
    "box": CrossSection(("a", "b", "wall"), box),
    "polygon": CrossSection(("outline",), polygon, ("holes",)),
}


def stiffness_of(keys: Mapping[str, Any]) -> float:
    """Torsional stiffness [N m/rad] from the keys of a shaft's table: `section`, its dimensions, `length`, and
    `shear_modulus` if it is not steel.

    Raises
    ------
    InputError
        in one line, for a missing value, a value of another section, or an impossible value.
    """
    name = keys.get("section")
    if name is None:
        raise InputError(f"section: missing; one of {', '.join(SECTIONS)}")
    section = SECTIONS[name]
    required = (*section.takes, "length")
    faults = [
        InputError(f'{key}: missing; section "{name}" needs {", ".join(required)}')
        for key in required
        if key not in keys
    ]
    faults += [
        InputError(f'{key}: not of section "{name}", which takes {", ".join((*required, *section.also))}')
        for key in keys
        if key not in (*required, *section.also, "section", "shear_modulus")
    ]
    if faults:
        raise InputError.joined(faults)
    constant = section.constant(*(keys[key] for key in (*section.takes, *section.also) if key in keys))
    modulus = {"shear_modulus": keys["shear_modulus"]} if "shear_modulus" in keys else {}
    return stiffness(constant, keys["length"], **modulus)
