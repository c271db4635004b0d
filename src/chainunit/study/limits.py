"""The limits of a motor: sizing checks its candidates by them, and a study the motor that it was given."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from ..drives.nameplate import Nameplate
from ..text import entry, number
from .config import Config
from .drive import Drive
from .window import BURNT

SPEED_DEVIATION = 0.03
"""Of the crank's mean speed from the one that is asked for, in parts of it, up to which a drive keeps that."""


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
    def over(self) -> bool:
        """Whether a value is known, and passes the limit."""
        return self.utilisation is not None and self.utilisation > 1.0

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


def keeping_speed(speed: float, asked: float) -> Check:
    """How far the mean speed of the crank, or of the motor at its ratio, is from the one `asked` [rad/s]."""
    return Check("deviation of the crank speed", abs(speed / asked - 1.0), SPEED_DEVIATION, "1", "percent")


def reaches(speed: float, asked: float) -> bool:
    """Whether the crank runs at the speed that is asked of it."""
    check = keeping_speed(speed, asked)
    return check.utilisation is not None and check.utilisation <= 1.0


def given_motor(
    config: Config, drive: Drive, temperature: float | None, current: float | None, start: float | None
) -> dict[str, Check]:
    """The limits of the motor that a study gives, by name; none of a motor of somebody else, and of one without a
    nameplate that of the winding alone.

    Parameters
    ----------
    temperature : at which the winding comes to rest if steady running goes on for ever [K]
    current : RMS of steady running [A]
    start : time of the start [s]; one by an inverter has no limit
    """
    if drive.foreign is not None:
        return {}
    checks = {}
    if temperature is not None:
        _, permitted = config.permitted_temperature
        checks["temperature"] = heating(temperature, drive.fmu_parameters.ambient.T, permitted)
    if config.plate is not None:
        plate = config.plate.nameplate
        if current is not None:
            checks["current"] = lasting_current(current, plate)
        if not drive.follows:
            checks["start"] = starting(start, plate)
    return checks
