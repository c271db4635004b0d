"""The line of a drive: its parts between motor and machine."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

from ...core.model import Model
from ...system import ModelComponent


@dataclass(frozen=True)
class PlacedPart:
    """A part between motor and machine, with the `name` of its component in the system. Its `model` takes the load
    port of the part behind it and shows one to the part before it."""

    name: str
    model: Model
    parameters: Any
    ratio: float = 1.0
    """turns of its shaft on the motor's side per turn of that on the machine's side"""
    inertia: float = 0.0
    """inertia that turns with its shaft on the machine's side, in addition to the machine's [kg m2]"""

    @property
    def component(self) -> ModelComponent:
        """Its component of the system."""
        return ModelComponent(self.model, self.parameters)

    def turned(self, angle: float) -> PlacedPart:
        """The part that starts with its shaft on the motor's side turned by the `angle` [rad]."""
        start = self.parameters.phi_start + angle
        return replace(self, parameters=replace(self.parameters, phi_start=start))


@dataclass(frozen=True)
class Line:
    """The `parts` between motor and machine, from the motor on."""

    parts: tuple[PlacedPart, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.parts)

    def __iter__(self) -> Iterator[PlacedPart]:
        return iter(self.parts)

    def part(self, name: str) -> PlacedPart | None:
        """The part of that name; None where there is none."""
        return next((part for part in self if part.name == name), None)

    def behind(self, part: PlacedPart) -> Line:
        """The line with one more part, behind the others."""
        return Line((*self, part))

    def around(self, name: str) -> tuple[Line, Line]:
        """The parts before the part of that name, and those behind it."""
        place = [part.name for part in self].index(name)
        return Line(self.parts[:place]), Line(self.parts[place + 1 :])

    def turned(self, angle: float) -> Line:
        """The line that starts with the motor's shaft turned by the `angle` [rad]."""
        parts = []
        for part in self:
            parts.append(part.turned(angle))
            angle /= part.ratio
        return Line(tuple(parts))

    @property
    def ratio(self) -> float:
        """Turns of the motor per turn of the shaft behind the line."""
        return math.prod(part.ratio for part in self)

    @property
    def inertia(self) -> float:
        """Inertia of the parts at the shaft behind the line [kg m2]."""
        inertia = 0.0
        for part in self:
            inertia = inertia * part.ratio**2 + part.inertia
        return inertia

    def at_motor(self, inertia: Any) -> Any:
        """An inertia on the shaft behind the line, and the inertias of the parts, at the motor's shaft [kg m2]; a
        part counts as rigid, and as if its ratio were even."""
        for part in reversed(self.parts):
            inertia = (inertia + part.inertia) / part.ratio**2
        return inertia
