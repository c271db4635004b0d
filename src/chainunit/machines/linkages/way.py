"""The way of a driver: all the way round, or within its range."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

ANGLES = 48
"""Places of the driver at which a linkage is checked to close."""
WHOLE = 2.0 * math.pi
_SWINGS = 6.0
"""A link that turns by more [rad] over the range of its driver has an angle that follows the driver's, so that it has
no jumps."""


@dataclass(frozen=True)
class DriverWay:
    """The way of a driver: whether it slides (`linear`), the `name` of its joint, or of the link that turns, its
    place at the `start`, and the `limits` of its range; None for one that turns all the way round. Places are in rad
    or m; `count` is their number."""

    linear: bool
    name: str
    start: float
    limits: tuple[float, float] | None = None
    count: int = ANGLES

    @classmethod
    def of(cls, data: Mapping[str, Any], rate: float = 1.0) -> DriverWay:
        """The way of the driver of a description; a link turns `rate` times in a turn of it, at most."""
        driver, span = data["driver"], data.get("range")
        name = driver["joint" if driver["linear"] else "link"]
        limits = None if span is None else (float(span[0]), float(span[1]))
        return cls(driver["linear"], name, data["start"]["value"], limits, ANGLES * math.ceil(0.5 * rate))

    @property
    def turns(self) -> bool:
        """Whether the driver turns all the way round."""
        return self.limits is None

    @property
    def swings(self) -> bool:
        """Whether the driver turns to and fro within a range."""
        return self.limits is not None and not self.linear

    @property
    def span(self) -> tuple[float, float]:
        """The least and the largest place: the range, or a turn from the start on."""
        return self.limits or (self.start, self.start + WHOLE)

    def places(self) -> list[float]:
        """Evenly spaced places: from one end of the range to the other, or from the start on around."""
        if self.limits is None:
            return [self.start + WHOLE * k / self.count for k in range(self.count)]
        low, high = self.limits
        return [*(low + (high - low) * k / self.count for k in range(self.count)), high]

    def closed_places(self) -> list[float]:
        """The places with the last one, which after a turn is the first one again."""
        return [*self.places(), self.start + WHOLE] if self.turns else self.places()

    def rate(self, angles: Sequence[float]) -> float:
        """How often a link turns per turn of the driver, by its `angles` at the `closed_places` [rad]; 0 if it
        swings by less than a turn."""
        if self.linear or (self.swings and max(angles) - min(angles) < _SWINGS):
            return 0.0
        low, high = self.span
        return float(round((angles[-1] - angles[0]) / (high - low)))

    def words(self, q: float) -> str:
        """A place in words."""
        if self.linear:
            return f"{self.name} = {q:.6g} m"
        degrees = math.degrees(q)
        degrees = round(degrees % 360.0 if self.turns else degrees, 4) + 0.0  # which makes -0 a 0
        return f"{degrees:.4g} deg of {self.name}"

    def inside(self, q: float, sense: float) -> str:
        """A place as a file has it, without its unit, rounded upward if `sense` is +1, downward if it is -1,
        and to the nearest one if it is 0: an angle in degrees to four digits after the point, a way in metres to
        six."""
        unit = 1e-6 if self.linear else 1e-4
        to = math.ceil if sense > 0.0 else math.floor if sense < 0.0 else round
        rounded = to((q if self.linear else math.degrees(q)) / unit)
        return f"{rounded * unit:.6f}".rstrip("0").rstrip(".")
