"""The working organs of a chain unit as two bars each: their loads, their names in the linkage, and their groups."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

from ..core.quantities import Value, declaration, quantity
from ..groups.body import Bar, Mass
from ..groups.dyad import Dyad
from ..groups.loads import Resistance

SideName = Literal["left", "right"]
SIDES: tuple[SideName, ...] = ("left", "right")


def other(side: SideName) -> SideName:
    """The opposite side."""
    return "right" if side == "left" else "left"


@declaration
class SideLoads:
    """The material on one organ."""

    material_mass: Value = quantity("kg", "material that lies on the organ", default=30.0, min=0.0)
    processing_force: Value = quantity(
        "N", "force on the web at B, against the motion of B", default=0.0, min=0.0, nominal=100.0
    )


class OrganNames(NamedTuple):
    """The names of an organ's parts in the linkage (pins, links, load), and its `hand`: +1 left, -1 right."""

    a1: str
    b: str
    wall: str
    web: str
    processing: str
    hand: float


NAMES: dict[SideName, OrganNames] = {
    side: OrganNames(f"A1 {side}", f"B {side}", f"{side} wall", f"{side} web", f"{side} processing", hand)
    for side, hand in zip(SIDES, (1.0, -1.0), strict=True)
}


def organ_masses(p: Any, side: str, loads: Any) -> tuple[Any, Any]:
    """The masses of wall and web of an organ with the material of these loads on them [kg]."""
    masses, on_web = getattr(p, side), p.web_share * loads.material_mass
    return masses.wall_mass + (loads.material_mass - on_web), masses.web_mass + on_web


def organ(p: Any, u: Any, side: SideName) -> Dyad:
    """A working organ as two bars: wall (A1-B) and web (A2-B) with the material on it."""
    return two_bars(p, side, *organ_masses(p, side, getattr(u, side)))


def two_bars(p: Any, side: SideName, on_wall: Any, on_web: Any) -> Dyad:
    """Wall and web of an organ with these masses [kg]."""
    names = NAMES[side]
    wall = Bar(names.wall, names.a1, p.l1, _rod(p, on_wall, p.l1))
    web = Bar(names.web, "A2", p.l2, _rod(p, on_web, p.l2))
    return Dyad(names.b, wall, web, -names.hand)


def _rod(p: Any, mass: Any, length: Any) -> Mass:
    return Mass(mass, 0.5 * length, p.rod_inertia * mass * (length * length) * (1.0 / 12.0))


def resistances(p: Any, u: Any) -> dict[str, Resistance]:
    """The processing force of each side."""
    law = p.processing
    return {
        names.processing: Resistance(names.b, getattr(u, side).processing_force, law)
        for side, names in NAMES.items()
    }
