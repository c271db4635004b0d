"""Torque limiters that somebody sells, for the motor's shaft: each opens at a torque that can be set."""

from __future__ import annotations

from ..core.errors import InputError
from ..core.quantities import Value, declaration, quantity
from .catalogue_rows import CatalogueItem, CatalogueKind, Sold


@declaration
class SafetyCouplingValues:
    """The values of a torque limiter: its settings and its limits."""

    setting_least: Value = quantity("N.m", "least torque at which it can be set to open", above=0.0)
    setting_most: Value = quantity("N.m", "largest torque at which it can be set to open", above=0.0)
    release_time: Value = quantity(
        "s",
        "time from the trip until no torque passes",
        default=0.005,
        min=0.0,
        max=1.0,
    )
    J: Value = quantity("kg.m2", "inertia, at its own shaft; 0: unknown", default=0.0, min=0.0)
    largest_speed: Value = quantity("rad/s", "largest speed; 0: unknown", default=0.0, min=0.0, kind="speed")


@declaration
class SafetyCouplingData(Sold, SafetyCouplingValues):
    """The columns of a torque limiter in a catalogue."""


class CatalogueCoupling(CatalogueItem):
    """A torque limiter of a catalogue; its `data` are a `SafetyCouplingData`."""

    def can_be_set(self, torque: float, speed: float) -> bool:
        """Whether it can be set to that `torque` [N m] and may turn at that `speed` [rad/s]."""
        data: SafetyCouplingData = self.data
        fast_enough = not data.largest_speed or speed <= data.largest_speed
        return bool(data.setting_least <= torque <= data.setting_most and fast_enough)


def _consistent(data: SafetyCouplingData) -> None:
    """Refuse a range of settings without an inside.

    Raises
    ------
    InputError
        for the larger end.
    """
    if data.setting_most < data.setting_least:
        raise InputError(
            f"setting_most = {data.setting_most:g} N m: must be >= setting_least = {data.setting_least:g} N m "
            "(largest torque at which it can be set to open)",
            "setting_most",
        )


COUPLINGS = CatalogueKind(
    "coupling",
    "torque limiters",
    SafetyCouplingData,
    _consistent,
    (
        {
            "designation": "Made-up S2",
            "order_number": "S-2-0020",
            "source": "made up, as an example of a row",
            "setting_least": "5",
            "setting_most": "20",
            "release_time": "0.004",
            "J": "0.0009",
            "largest_speed": "3600",
            "mass": "2.1",
            "price": "260",
        },
    ),
)
"""Torque limiters in catalogues."""
