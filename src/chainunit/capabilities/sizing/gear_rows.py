"""Gears of a catalogue in sizing: the rows with the ratio of a motor, the limits of each beside the runs, and the
rows that the runs with another one rule out."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np

from ...core.errors import InputError
from ...drives.catalogue_gears import CatalogueGear
from ...drives.gear_rating import GearRating
from ...drives.gear_ratios import GearUnit, nearest
from ...study.arrays import Dataset, peak
from ...study.bearings import driver_bearing, pin_force
from ...study.drive import Drive
from ...study.limits import SPEED_DEVIATION, Check
from ...study.readings import shaft_power
from .candidate import Candidate
from .table import PRICE

OWN_KEYS = (
    "sizing.gear_kind",
    "sizing.ratio_series",
    "sizing.ratios",
    "gear.efficiency",
    "gear.J",
    "gear.torque_limit",
    "gear.start_factor",
)
"""Keys of a study file whose values each gear of a catalogue has by itself."""
SURELY = 1.05
"""Share of a limit in the runs with a gear from which on another gear of that limit is not tried: its inertia and its
losses differ, and the torques with them by a few per cent."""
_SAME = 1e-3
"""Relative difference up to which ratios count as equal."""
_MAY_LACK: Mapping[str, str] = {
    "thermal_power": "thermal rating",
    "overhung_load": "permitted overhung load",
    "largest_speed": "largest speed",
}
"""Limits that a catalogue may leave out, by their columns."""


def strong_enough(gears: Iterable[CatalogueGear], torque: float) -> list[CatalogueGear]:
    """The gears that permit at least that `torque` in running [N m]."""
    return [gear for gear in gears if gear.transmission.torque_limit >= torque]


def gear_faults(
    gears: Sequence[CatalogueGear], keys: Iterable[str], ratio: float, torque: float
) -> Iterator[InputError]:
    """Refusals of keys beside the `gears` of a catalogue; `keys` are the keys of the file, `ratio` is `gear.ratio`,
    and `torque` is `sizing.gear_torque` [N m]."""
    keys = set(keys)
    most = max(gear.transmission.torque_limit for gear in gears)
    if torque > most:
        yield InputError(
            f"sizing.gear_torque = {torque:g} N m: no gear of the catalogue permits it; must be <= {most:g} N m",
            "sizing.gear_torque",
        )
        return
    gears = strong_enough(gears, torque)
    for name in OWN_KEYS:
        if name in keys:
            yield InputError(f"{name}: each gear of the catalogue has its own; leave it out", name)
    if "gear.ratio" in keys and not _of_ratio(gears, ratio):
        near = nearest(ratio, (gear.data.ratio for gear in gears))
        yield InputError(
            f"gear.ratio = {ratio:g}: no gear of the catalogue has it; must be a ratio of the catalogue, such as "
            f"{near:g}, or be left out",
            "gear.ratio",
        )


def unit_of(gear: CatalogueGear) -> GearUnit:
    """The gear as one unit."""
    data = gear.data
    return GearUnit(gear.designation, data.ratio, data.ratio, data.efficiency)


def _of_ratio(gears: Iterable[CatalogueGear], ratio: float) -> list[CatalogueGear]:
    return [gear for gear in gears if abs(gear.data.ratio / ratio - 1.0) <= _SAME]


def rows_for(
    gears: Sequence[CatalogueGear], ratio: float, tolerance: float, objective: str
) -> list[CatalogueGear]:
    """The gears with which the speed differs by at most the `tolerance` from that with the needed `ratio`, or those
    with the nearest ratio. The smallest come first, or for the lowest price the cheapest, with gears without a price
    at the end."""
    near = [gear for gear in gears if abs(ratio / gear.data.ratio - 1.0) <= tolerance]
    rows = near or _of_ratio(gears, nearest(ratio, (gear.data.ratio for gear in gears)))

    def order(gear: CatalogueGear) -> tuple[float, float, str]:
        size, price = gear.transmission.torque_limit, gear.price or math.inf
        return (price, size, gear.designation) if objective == PRICE else (size, price, gear.designation)

    return sorted(rows, key=order)


def gear_checks(
    rating: GearRating, drive: Drive, running: Sequence[Dataset], cases: Sequence[tuple[float, Dataset]]
) -> dict[str, Check]:
    """The checks of a gear beside those of its torque, as far as its ratings have their limits.

    The thermal rating is compared with the mean of |power| at the gear, as its loss by load is a share of the power
    in either direction. The overhung load is the largest reaction at the bearing of the driver in running, where the
    crank sits on the shaft of the gear.

    Parameters
    ----------
    running : all runs of running
    cases : the runs of the duty, each with its share of the time
    """
    checks = dict[str, Check]()
    if rating.thermal_power:
        passed = sum(share * float(np.mean(np.abs(shaft_power(drive, run)))) for share, run in cases)
        checks["gear_thermal"] = Check("mean power of the gear", passed, rating.thermal_power, "W")
    if rating.overhung_load and (bearing := driver_bearing(drive)):
        largest = max(peak(pin_force(drive, run, bearing)) for run in running)
        checks["gear_overhung"] = Check("overhung load of the gear", largest, rating.overhung_load, "N")
    if rating.largest_speed:
        fastest = max(peak(run["motor.w"].values) for run in running)
        checks["gear_speed"] = Check(
            "speed of the gear's input shaft", fastest, rating.largest_speed, "rad/s", "speed"
        )
    return checks


def spent(c: Candidate, tried: Iterable[Candidate]) -> Candidate | None:
    """The candidate `c` without runs, if its gear surely does not hold: it gets the runs of a candidate that was
    `tried` with another gear, and the limits of its gear. None if it has to be tried itself."""
    assert c.sold is not None
    data, transmission = c.sold.data, c.sold.transmission
    limits = {
        "gear": transmission.torque_limit,
        "gear_start": transmission.start_limit,
        "gear_service": transmission.torque_limit,
        "gear_thermal": data.thermal_power,
        "gear_overhung": data.overhung_load,
        "gear_speed": data.largest_speed,
    }
    for other in tried:
        checks = {name: check for name, check in other.checks.items() if name not in limits}
        of_gear = {
            name: dataclasses.replace(check, limit=limits[name])
            for name, check in other.checks.items()
            if limits.get(name)
        }
        trial = dataclasses.replace(other.trial, checks=checks | of_gear)
        judged = dataclasses.replace(c, trial=trial, runs_with=other.runs_with or other.gear)
        if any(judged.sizes[name] > SURELY for name in of_gear):
            return judged
    return None


def helps(gear: CatalogueGear, tried: Iterable[Candidate]) -> bool:
    """Whether a further gear may make a motor fit: not where the motor itself exceeds a limit with a gear that is as
    efficient."""
    return not any(
        c.sold is not None
        and not any(c.exceeds(name) for name in c.checks if name.startswith("gear"))
        and c.sold.data.efficiency >= gear.data.efficiency
        for c in tried
    )


def stronger(gears: Iterable[CatalogueGear], chosen: CatalogueGear, torque: float) -> CatalogueGear | None:
    """The smallest of the gears with about the ratio of the `chosen` one that permits that `torque` in running
    [N m]; None where there is none."""
    ratio = chosen.data.ratio
    near = [
        gear for gear in strong_enough(gears, torque) if abs(gear.data.ratio / ratio - 1.0) <= SPEED_DEVIATION
    ]
    return min(near, key=lambda gear: (gear.transmission.torque_limit, gear.designation), default=None)


def unknown_limits(gear: CatalogueGear) -> list[str]:
    """The limits of a gear that its catalogue leaves out, in words."""
    return [limit for column, limit in _MAY_LACK.items() if not getattr(gear.data, column)]
