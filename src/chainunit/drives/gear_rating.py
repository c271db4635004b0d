"""The ratings of a gear, as its maker's catalogue or a study file gives them."""

from __future__ import annotations

from ..core.quantities import Value, declaration, quantity


@declaration
class GearRating:
    """The ratings of a gear; 0 stands for one that is unknown."""

    rated_torque: Value = quantity("N.m", "rated torque of the output; 0: unknown", default=0.0, min=0.0)
    application_factor: Value = quantity(
        "1",
        "application factor that the gear permits: torque of equal damage over rated torque",
        default=1.0,
        above=0.0,
        max=100.0,
    )
    thermal_power: Value = quantity(
        "W", "power that the gear passes for ever without getting too hot; 0: unknown", default=0.0, min=0.0
    )
    overhung_load: Value = quantity(
        "N", "permitted radial force on the output shaft in running; 0: unknown", default=0.0, min=0.0
    )
    largest_speed: Value = quantity(
        "rad/s", "permitted speed of the input shaft; 0: unknown", default=0.0, min=0.0, kind="speed"
    )
