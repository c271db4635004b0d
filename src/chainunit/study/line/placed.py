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
    inertia_before: float = 0.0
    """inertia that turns with its shaft on the motor's side [kg m2]"""
    table: Any = None
    """the values of its table, completed by the drive, if the drive completes them"""
    slips: bool = False
    """whether its driven shaft has a speed of its own, so that the gear behind it turns with this shaft"""
    decouples: bool = False
    """whether a motor comes to its speed before the machine does, as its torque grows with the speed"""
    stall_torque: float = math.inf
    """largest torque that it takes from the motor's shaft while the machine stands [N m]"""
    drag: float = 0.0
    """torque that it takes from the motor's shaft and does not pass on [N m]"""

    @property
    def component(self) -> ModelComponent:
        """Its component of the system."""
        return ModelComponent(self.model, self.parameters)

    def with_inertia(self, J: float) -> PlacedPart:
        """The part with the inertia `J` [kg m2] on its driven shaft, before the gear."""
        p = replace(self.parameters, J_driven=self.inertia + J)
        return replace(self, parameters=p, inertia=p.J_driven)

    def with_gear(self, J: float, d: float, loss: float) -> PlacedPart:
        """The part before a gear with this inertia [kg m2] and drag [N m s/rad] at its shaft on the motor's side, and
        this `Transmission.loss`."""
        part, square = self.with_inertia(J * self.ratio**2), self.ratio**2
        gear = replace(part.parameters.gear, d=d * square, loss=loss)
        return replace(part, parameters=replace(part.parameters, gear=gear))

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

    @property
    def is_elastic(self) -> bool:
        """Whether it has parts, none of which slips."""
        return bool(self) and self.before_gear is None

    @property
    def before_gear(self) -> PlacedPart | None:
        """The last part that slips; None where the gear turns with the motor."""
        return next((part for part in reversed(self.parts) if part.slips), None)

    def with_gear(self, J: float, d: float, loss: float) -> Line:
        """The line whose `before_gear` turns a gear with this inertia [kg m2] and drag [N m s/rad] at the motor's
        shaft, and this `Transmission.loss`; without such a part the same line."""
        geared, ratio, parts = self.before_gear, 1.0, []
        for part in self:
            gear = (J * ratio**2, d * ratio**2, loss)
            parts.append(part.with_gear(*gear) if part is geared else part)
            ratio *= part.ratio
        return Line(tuple(parts))

    @property
    def decouples(self) -> bool:
        """Whether a motor comes to its speed before the machine does."""
        return any(part.decouples for part in self)

    @property
    def stall_torque(self) -> float:
        """Largest torque that the line takes from the motor's shaft while the machine stands [N m]."""
        ratio, least = 1.0, math.inf
        for part in self:
            least, ratio = min(least, part.stall_torque / ratio), ratio * part.ratio
        return least

    @property
    def drag(self) -> float:
        """Torque that the line takes from the motor's shaft and does not pass on [N m]."""
        ratio, drag = 1.0, 0.0
        for part in self:
            drag, ratio = drag + part.drag / ratio, ratio * part.ratio
        return drag

    def behind(self, part: PlacedPart) -> Line:
        """The line with one more part, behind the others."""
        return Line((*self, part))

    def around(self, name: str) -> tuple[Line, Line]:
        """The parts before the part of that name, and those behind it."""
        place = [part.name for part in self].index(name)
        return Line(self.parts[:place]), Line(self.parts[place + 1 :])

    def up_to(self, name: str) -> Line:
        """The parts up to the one of that name, with it."""
        return Line(self.parts[: len(self.around(name)[0].parts) + 1])

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
            inertia = (inertia + part.inertia_before) * part.ratio**2 + part.inertia
        return inertia

    def at_motor(self, inertia: Any) -> Any:
        """An inertia on the shaft behind the line, and the inertias of the parts, at the motor's shaft [kg m2]; a
        part counts as rigid, and as if its ratio were even."""
        for part in reversed(self.parts):
            inertia = (inertia + part.inertia) / part.ratio**2 + part.inertia_before
        return inertia

    def in_run_up(self, inertia: Any) -> Any:
        """The inertia at the motor's shaft [kg m2] with which the motor comes to its speed: that `at_motor`, or as
        far as the first part that decouples, with its wheel on the motor's side."""
        place = next((k for k, part in enumerate(self.parts) if part.decouples), None)
        if place is None:
            return self.at_motor(inertia)
        return Line(self.parts[:place]).at_motor(self.parts[place].inertia_before)
