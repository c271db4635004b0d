"""Flexible couplings that somebody sells, with the ratings of DIN 740-2 and the speed that they bear."""

from __future__ import annotations

from ..core.errors import InputError
from ..core.quantities import Value, declaration, quantity
from .catalogue_rows import CatalogueItem, CatalogueKind, Sold


@declaration
class FlexibleCouplingValues:
    """The values of a flexible coupling: its ratings, its elastic part, its limits."""

    rated_torque: Value = quantity("N.m", "rated torque TKN", above=0.0)
    peak_torque: Value = quantity("N.m", "peak torque TKmax", above=0.0)
    alternating_torque: Value = quantity(
        "N.m", "alternating torque TKW that it carries for ever at 10 Hz", above=0.0
    )
    stiffness: Value = quantity("N.m/rad", "dynamic torsional stiffness CTdyn", above=0.0)
    damping: Value = quantity(
        "1",
        "relative damping psi: energy of damping over elastic energy of a swing",
        above=0.0,
        max=10.0,
    )
    J: Value = quantity("kg.m2", "inertia, at its own shaft; 0: unknown", default=0.0, min=0.0)
    largest_speed: Value = quantity("rad/s", "largest speed; 0: unknown", default=0.0, min=0.0, kind="speed")


@declaration
class FlexibleCouplingData(Sold, FlexibleCouplingValues):
    """The columns of a flexible coupling in a catalogue."""


class CatalogueFlexible(CatalogueItem):
    """A flexible coupling of a catalogue; its `data` are a `FlexibleCouplingData`."""


def _consistent(data: FlexibleCouplingData) -> None:
    """Refuse a coupling that carries more for ever than in a peak.

    Raises
    ------
    InputError
        for the peak torque.
    """
    for name, title in (
        ("rated_torque", "rated torque TKN"),
        ("alternating_torque", "alternating torque TKW"),
    ):
        least = getattr(data, name)
        if data.peak_torque < least:
            raise InputError(
                f"peak_torque = {data.peak_torque:g} N m: must be >= {name} = {least:g} N m (the {title})",
                "peak_torque",
            )


FLEXIBLE = CatalogueKind(
    "flexible_coupling",
    "flexible couplings",
    FlexibleCouplingData,
    _consistent,
    (
        {
            "designation": "Made-up F20",
            "order_number": "F-20-92",
            "source": "made up, as an example of a row",
            "rated_torque": "20",
            "peak_torque": "40",
            "alternating_torque": "5.2",
            "stiffness": "1100",
            "damping": "0.8",
            "J": "0.00017",
            "largest_speed": "9500",
            "mass": "0.6",
            "price": "38",
        },
    ),
)
"""Flexible couplings in catalogues."""
