"""Gears that somebody sells: each is one gear with its real ratio, its losses and its limits."""

from __future__ import annotations

from ..core.quantities import Value, declaration, quantity
from .catalogue_rows import CatalogueItem, CatalogueKind, Sold
from .gear_rating import GearRating
from .gearing import START_FACTOR, Transmission


@declaration
class GearValues:
    """The values of a gear: its ratio, its losses, its limits."""

    ratio: Value = quantity("1", "real ratio, motor turns per turn of the output", above=0.0, max=1e4)
    rated_torque: Value = quantity("N.m", "rated torque of the output", above=0.0)
    application_factor: Value = quantity(
        "1",
        "application factor that the rating includes: running may put as many times the rated torque on the output",
        default=1.0,
        min=0.1,
        max=10.0,
    )
    start_factor: Value = quantity(
        "1",
        "permitted torque of the output in a start, over rated_torque x application_factor; catalogues commonly "
        "permit about twice",
        default=START_FACTOR,
        min=1.0,
        max=10.0,
    )
    efficiency: Value = quantity("1", "efficiency while the motor drives", min=0.05, max=1.0, kind="percent")
    J: Value = quantity("kg.m2", "inertia at the motor's shaft", default=0.0, min=0.0)
    largest_speed: Value = quantity(
        "rad/s", "largest speed of the motor's shaft; 0: unknown", default=0.0, min=0.0, kind="speed"
    )
    thermal_power: Value = quantity(
        "W", "thermal rating: lasting power that the gear passes; 0: unknown", default=0.0, min=0.0
    )
    overhung_load: Value = quantity(
        "N", "permitted radial force on the output shaft; 0: unknown", default=0.0, min=0.0
    )
    backlash: Value = quantity("rad", "play at the output; 0: unknown", default=0.0, min=0.0, max=1.0)


@declaration
class GearData(Sold, GearValues):
    """The columns of a gear in a catalogue."""


class CatalogueGear(CatalogueItem):
    """A gear of a catalogue; its `data` are a `GearData`."""

    @property
    def transmission(self) -> Transmission:
        """The gear as a part of a drive; its drag that grows with speed is not known."""
        data: GearData = self.data
        return Transmission(
            ratio=data.ratio,
            efficiency=data.efficiency,
            J=data.J,
            torque_limit=data.rated_torque * data.application_factor,
            start_factor=data.start_factor,
        )

    @property
    def rating(self) -> GearRating:
        """The ratings of the gear, for its checks."""
        data: GearData = self.data
        return GearRating(
            rated_torque=data.rated_torque,
            application_factor=data.application_factor,
            thermal_power=data.thermal_power,
            overhung_load=data.overhung_load,
            largest_speed=data.largest_speed,
        )


GEARS = CatalogueKind(
    "gear",
    "gears",
    GearData,
    examples=(
        {
            "designation": "Made-up H3 i=99.7",
            "order_number": "G-3-0997",
            "source": "made up, as an example of a row",
            "ratio": "99.7",
            "rated_torque": "1600",
            "efficiency": "0.94",
            "J": "0.0004",
            "largest_speed": "3000",
            "thermal_power": "7500",
            "overhung_load": "16000",
            "backlash": "0.15",
            "mass": "66",
            "price": "1180",
        },
    ),
)
"""Gears in catalogues."""
