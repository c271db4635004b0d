"""The limits of a motor: a study checks its motor by them, and a search for one its candidates."""

from __future__ import annotations

import math
from collections.abc import Iterable

from ..core.descriptions import USUAL_DRIVER
from ..drives.catalogue import CatalogueMotor
from ..drives.nameplate import Nameplate
from ..reading.results import OWN, derived, part, result
from ..reading.text import MOST_PERCENT, number
from .drive import Drive
from .window import BURNT

SPEED_DEVIATION = 0.03
"""Relative deviation of the crank's mean speed from the requested one, up to which a drive keeps the
speed."""


_HARDLY_OVER = 1.005
"""Used share of a limit below which it reads as 100 %."""
_AT_LIMIT = 1e-3
"""Relative distance within which a current is at its limit."""


def limit_reached(drive: Drive, currents: Iterable[float]) -> float | None:
    """The limit of the motor's current [A], where one of the `currents` is at it; else None."""
    limit = drive.motor.current_limit(drive.parameters) if drive.foreign is None else None
    return limit if limit is not None and any(i >= (1.0 - _AT_LIMIT) * limit for i in currents) else None


@result
class Check:
    """A value beside its limit, in one unit."""

    title: str = part("the limited quantity")
    value: float | None = part("its value", unit=OWN)
    limit: float = part("its limit", unit=OWN)
    unit: str
    kind: str = ""
    forbidden: str = ""
    """the reason, in words, why the limit is 0"""

    @derived("1", "used")
    def utilisation(self) -> float | None:
        """value/limit; None where the candidate does not get so far that there is a value. It is infinite for
        any value where nothing is permitted."""
        if self.value is None:
            return None
        if self.limit > 0.0:
            return self.value / self.limit
        return math.inf if self.value > 0.0 else 0.0

    @property
    def over(self) -> bool:
        """Whether the value is known and exceeds the limit."""
        return self.utilisation is not None and self.utilisation > 1.0

    @property
    def excess(self) -> str:
        """Words on a limit that is exceeded."""
        if self.limit <= 0.0 and self.forbidden:
            return self.forbidden
        if self.utilisation is not None and self.utilisation < _HARDLY_OVER:
            # the numbers would read as if the limit were kept
            value, limit = (number(x, self.unit, self.kind, 5, full=False) for x in (self.value, self.limit))
            above = number(self.utilisation - 1.0, "1", "percent", 1, full=False)
            return f"{self.title} {value}, {above} above the permitted {limit}"
        value, limit = (number(x, self.unit, self.kind, full=False) for x in (self.value, self.limit))
        share, multiple = number(self.utilisation, "1", "used"), (self.utilisation or 0.0) > MOST_PERCENT
        return f"{self.title} {value}, {share}{'' if multiple else ' of'} the permitted {limit}"

    @derived(name="forbidden", optional=True)
    def reason(self) -> str | None:
        """The reason why nothing is permitted, where something is used."""
        return self.forbidden if self.limit <= 0.0 and self.over and self.forbidden else None


def heating(temperature: float, ambient: float, permitted: float) -> Check:
    """The rise of a winding from the `ambient` to its final `temperature`, beside the `permitted`
    temperature's rise [K]."""
    hot = min(BURNT, temperature)
    return Check("rise of temperature", hot - ambient, permitted - ambient, "K", "difference")


def starting(time: float | None, plate: Nameplate, in_star: float = 0.0) -> Check:
    """The time of a start on the line [s], beside the permitted locked-rotor time of a warm motor: while the
    motor speeds up, it takes about the locked-rotor current. The time `in_star` [s] counts a third, as its current
    is 1/sqrt(3) of this one in each winding."""
    title = "time to start" + (", the time in star a third" if in_star else "")
    return Check(
        title, None if time is None else time - 2.0 / 3.0 * min(time, in_star), plate.locked_time, "s"
    )


def lasting_current(rms: float, plate: Nameplate) -> Check:
    """The RMS current of a duty beside the rated one [A]."""
    return Check("RMS current", rms, plate.rated_current, "A")


def keeping_speed(speed: float, requested: float, driver: str = USUAL_DRIVER) -> Check:
    """The deviation of the mean speed of the crank from the `requested` one [rad/s]; both may be motor speeds
    as well. The title names the `driver`."""
    return Check(
        f"deviation of the {driver} speed", abs(speed / requested - 1.0), SPEED_DEVIATION, "1", "percent"
    )


def reaches(speed: float, requested: float) -> bool:
    """Whether the crank runs at the `requested` speed [rad/s]."""
    check = keeping_speed(speed, requested)
    return check.utilisation is not None and check.utilisation <= 1.0


def given_motor(
    drive: Drive,
    plate: CatalogueMotor | None,
    permitted: float,
    temperature: float | None,
    current: float | None,
    start: float | None,
) -> dict[str, Check]:
    """The limits of the motor that a study gives, by name. A foreign motor has none; a motor without a
    nameplate has only that of the winding.

    Parameters
    ----------
    plate : the motor of the catalogue, where the file names one
    permitted : permitted temperature of the winding [K]
    temperature : final temperature of the winding if steady running goes on for ever [K]
    current : RMS current of steady running [A]
    start : time of the start [s]; a start by an inverter has no limit
    """
    if drive.foreign is not None:
        return {}
    checks = {}
    if temperature is not None:
        checks["temperature"] = heating(temperature, drive.fmu_parameters.ambient.T, permitted)
    if plate is not None:
        if current is not None:
            checks["current"] = lasting_current(current, plate.nameplate)
        if not drive.follows:
            checks["start"] = starting(start, plate.nameplate, drive.star.time)
    return checks
