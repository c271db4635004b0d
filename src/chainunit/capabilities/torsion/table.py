"""The table [torsion] of a study file: declarations only."""

from __future__ import annotations

from dataclasses import dataclass

from ...core.quantities import Value, declaration, percentage, quantity, whole_number


@declaration
class TorsionTable:
    """The analysis of the torsion of a cardan line in rotation: the speeds of the shaft that are analysed,
    the permitted values, and the grid of the map of stability."""

    slowest: Value = quantity(
        "1", "least speed, in parts of that of normal running", default=0.3, above=0.0, max=1e3
    )
    fastest: Value = quantity(
        "1", "largest speed, in parts of that of normal running", default=2.0, above=0.0, max=1e3
    )
    points: Value = whole_number("number of speeds of the resonance curve", default=200, min=10, max=5000)
    margin: Value = percentage(
        "permitted nearness to a resonance, as a share of the speed", default=0.15, min=0.0, max=1.0
    )
    factor: Value = quantity(
        "1", "permitted ratio of the peak torque to that of the load alone", default=1.5, min=1.0, max=100.0
    )
    bend_low: Value = quantity("rad", "least bend of the map", default=0.0, min=0.0, max=1.5)
    bend_high: Value = quantity("rad", "largest bend of the map", default=0.7, min=0.0, max=1.5)
    speeds: Value = whole_number("number of speeds of the map", default=64, min=2, max=1000)
    bends: Value = whole_number("number of bends of the map", default=14, min=2, max=1000)


JOINTS = {
    "alpha1": "bend of the joint on shaft 2",
    "alpha2": "bend of the joint on shaft 3",
    "both": "both bends",
}
"""The bends that the map of stability may vary, with their titles."""


@dataclass(frozen=True)
class TorsionPlan:
    """The values of the analysis; the `joint` whose bend the map of stability varies, one of `JOINTS`; and the
    damping ratios of that map, none for that of the line itself."""

    table: TorsionTable
    joint: str
    damping_ratios: tuple[float, ...]
