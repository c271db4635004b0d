"""Whether a rigid model of a drive with an elastic line holds, by the rule of VDI 2149."""

from __future__ import annotations

from ...core.quantities import quantity
from ...reading.results import derived, result

HOLDS_FROM = 10.0
"""The lowest natural frequency over the frequency of the crank's turns, from which on a rigid model holds (VDI
2149)."""


@result
class RigidLine:
    """The lowest natural frequency of a line beside the turns of the crank in normal running."""

    natural_frequency: float = quantity(
        "rad/s",
        "lowest natural frequency of torsion of the line at i23 = 1, with the machine's largest inertia",
        kind="frequency",
    )
    driver_frequency: float = quantity("rad/s", "turns of the {driver} in normal running", kind="frequency")

    @derived("1")
    def ratio(self) -> float:
        """The first over the second."""
        return self.natural_frequency / self.driver_frequency

    @derived()
    def holds(self) -> bool:
        """Whether a rigid model of the drive holds: from ten times on (VDI 2149)."""
        return self.ratio >= HOLDS_FROM
