"""A part in the line of a drive."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from ...core.model import Model
from ...system import ModelComponent


@dataclass(frozen=True)
class PlacedPart:
    """A part between motor and machine, with the `name` of its component in the system. Its `model` takes the load
    port of the part behind it and shows one to the part before it."""

    name: str
    model: type[Model]
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
