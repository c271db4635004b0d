"""The limits of a motor: sizing checks its candidates by them, and a study the motor that it was given."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from ..drives.nameplate import Nameplate
from ..text import entry, number
from .window import BURNT


@dataclass(frozen=True)
class Check:
    """A value beside its limit, in one unit."""

    title: str
    value: float | None
    limit: float
    unit: str
    kind: str = ""

    @property
    def utilisation(self) -> float | None:
        """value/limit; None where there is no value: the candidate does not get that far. Where nothing is permitted,
        any value passes it without end."""
        if self.value is None:
            return None
        return self.value / self.limit if self.limit > 0.0 else math.inf

    @property
    def passed(self) -> str:
        """A limit that is passed, in words."""
        value, limit = (number(x, self.unit, self.kind, full=False) for x in (self.value, self.limit))
        used = number(self.utilisation, "1", "used")
        return f"{self.title} {value}, {used}{' of' if used.endswith('%') else ''} the permitted {limit}"

    def as_dict(self) -> dict[str, Any]:
        """Ready for JSON."""
        return {
            "title": self.title,
            "utilisation": entry(self.utilisation, "1", "used"),
            "value": entry(self.value, self.unit, self.kind),
            "limit": entry(self.limit, self.unit, self.kind),
        }


def heating(temperature: float, ambient: float, permitted: float) -> Check:
    """The rise of a winding that comes to rest at `temperature` over the `ambient`, beside the permitted one [K]."""
    hot = min(BURNT, temperature)
    return Check("rise of temperature", hot - ambient, permitted - ambient, "K", "difference")


def starting(time: float | None, plate: Nameplate) -> Check:
    """The time of a start on the line [s], beside that for which the rotor of a warm motor may be locked: as long as
    it speeds up, it takes about the locked-rotor current."""
    return Check("time to start", time, plate.locked_time, "s")


def lasting_current(rms: float, plate: Nameplate) -> Check:
    """The RMS current of a duty beside the rated one [A]."""
    return Check("RMS current", rms, plate.rated_current, "A")
