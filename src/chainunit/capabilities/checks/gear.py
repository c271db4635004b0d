"""A gear beside its ratings: torque of running, largest torque, thermal rating, overhung load, speed; and the
overhung load of the motor's shaft.

ISO 6336-6 takes the application factor from the spectrum of the torque: KA = Teq/Tn, with Teq of the same damage by
Woehler's line of exponent p and Palmgren and Miner's rule, and Tn the mean torque of the machine. A gear with the
rated torque TN that is rated for the factor KAN carries Teq = KA Tn <= KAN TN. A wheel on the crank's shaft meets
each angle of the crank with the same teeth: they carry the largest torque of the turn in each turn, so that without
an exponent Teq is the largest torque of running.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from ...core.quantities import Value, declaration, quantity
from ...drives.gear_rating import GearRating
from ...drives.gearing import Transmission
from ...reading.results import part, result
from ...study.arrays import peak
from ...study.bearings import driver_bearing, largest_load, mean_load, pin_force
from ...study.readings import crank_angle, gear_loss, gear_speed, shaft_power, torque_before_gear
from ...study.record import StudyRecord, StudyRuns
from ...study.starts import StartFindings
from ...study.torques import at_gear, gear_peaks, gear_torque, running_peak
from ...study.verdict import START
from ...study.window import mean
from .plan import CheckPlan
from .row import CheckRule, Checks
from .runs import largest
from .tables import GearRatingTable

_MAKER = "Rating of the maker of the gear"
_TEQ = {True: "Teq = (sum |T|^p |dphi| / sum |dphi|)^(1/p)", False: "Teq: largest |T| of running"}
"""By whether there is an exponent."""
_RUNNING = CheckRule(
    "torque of running", "running", "ISO 6336-6:2019, annex on KA from a load spectrum",
    "Teq <= KAN TN, KAN: application factor that the gear permits; {teq}; KA = Teq/mean |T|, both of steady running",
    "TN = rated_torque; p = exponent; KA = application_factor",
)  # fmt: skip
_LARGEST = CheckRule(
    "largest torque of the output ({run})", "largest", _MAKER, "T <= peak factor x TN",
    "TN = rated_torque; permitted = torque_limit",
)  # fmt: skip
_RADIAL = "largest |F| of the bearing <= permitted"
_RATINGS = {
    "thermal_power": CheckRule("mean power", "power", _MAKER, "mean of |P| <= thermal rating"),
    "overhung_load": CheckRule("overhung load", "radial", _MAKER, _RADIAL),
    "largest_speed": CheckRule("speed of the input shaft", "speed", _MAKER, "largest |w| of all runs"),
}
"""By the key of the rating."""
_EVENTS = CheckRule("overhung load of all runs", "largest_radial", _MAKER, f"{_RADIAL} in events")
_UNTURNED = "no pin of the machine turns with the output shaft"
_SHAFT = ("overhung load of the shaft", "radial", "Permitted radial force of the maker of the motor")
_PULLEY = CheckRule(
    *_SHAFT, "F = 2 T f/d, T: largest torque at the motor's shaft in steady running",
    "T = torque; f = /motor_shaft.tension_factor; d = /motor_shaft.pulley_diameter",
)  # fmt: skip
_BELT = CheckRule(*_SHAFT, "largest force of both strands of the belt in steady running, as vectors")
_CRANK = CheckRule(*_SHAFT, "largest reaction of {pin} in steady running")


@declaration
class GearDuty:
    """The load of the gear; None for what is not known."""

    ratio: Value = quantity("1", "ratio")
    exponent: Value = quantity("1", "exponent of Woehler's line; none where Teq is the largest torque")
    equivalent: Value = quantity("N.m", "torque of equal damage Teq at the output, in steady running")
    mean: Value = quantity("N.m", "mean of the size of the torque at the output, in steady running")
    running: Value = quantity(
        "N.m", "torque of running beside the rating: Teq, or the largest torque without an exponent"
    )
    largest: Value = quantity(
        "N.m", "largest torque at the output, of all runs, of starts by load and acceleration"
    )
    power: Value = quantity("W", "mean of the size of the power in steady running")
    radial: Value = quantity("N", "largest reaction of the {driver}'s bearing in steady running")
    largest_radial: Value = quantity("N", "largest reaction of the {driver}'s bearing, of all runs")
    speed: Value = quantity("rad/s", "largest speed of the input shaft, of all runs", kind="speed")


@result
class GearCheck(GearDuty):
    """The gear. Its application factor is the torque of equal damage over the mean one."""

    run: str = part("the run with the largest torque")
    bearing: str = part("pin whose reaction the output shaft carries; empty where it carries none")
    rated_torque: float | None = quantity("N.m", "rated torque of the output TN")
    application_factor: float | None = quantity(
        "1", "application factor of the cycle, Teq over the mean torque"
    )
    running_limit: float | None = quantity("N.m", "permitted torque of the output in running")
    torque_limit: float | None = quantity("N.m", "permitted torque of the output in peaks")


@result
class ShaftLoad:
    """The radial force on the motor's shaft."""

    torque: float | None = quantity(
        "N.m", "largest torque at the motor's shaft in steady running; none without a pulley"
    )
    radial: float = quantity("N", "largest radial force on the shaft in steady running")


def equivalent_torque(torque: Any, angle: Any, exponent: float) -> float:
    """Torque of equal damage [N m] of a `torque` [N m] over the `angle` of its shaft [rad], both of shape (n,):
    (integral of |T|^p |d angle| / integral of |d angle|)^(1/p). With an exponent of 0, the largest torque."""
    return mean_load(np.abs(torque), angle, exponent) if exponent else peak(torque)


def pulley_force(torque: float, diameter: float, factor: float) -> float:
    """Radial force [N] of a belt on a pulley of that `diameter` [m] with the `torque` [N m]; the `factor` is the
    force over that of the torque at the rim, as the tension of the belt adds to it."""
    return 2.0 * torque * factor / diameter


def rating_of(table: GearRatingTable, sold: GearRating | None, torque_limit: float) -> GearRating:
    """The ratings in the `table` of the file. A rating that it leaves out is taken from the gear that is `sold` in a
    catalogue; without such a gear the `torque_limit` of [gear] is the rated torque times the application factor."""
    factor = table.application_factor
    sold = sold or GearRating(rated_torque=torque_limit / factor, application_factor=factor)
    torque = table if table.rated_torque else sold
    return GearRating(
        rated_torque=torque.rated_torque,
        application_factor=torque.application_factor,
        **{key: getattr(table, key) or getattr(sold, key) for key in _RATINGS},
    )


def peak_factor_of(table: GearRatingTable, sold: GearRating | None, gear: Transmission) -> float:
    """The permitted torque in peaks over the rated torque: that in the `table` of the file, else in a start of the
    `gear`, which permits it over the rated torque times the application factor if the `table` has no rated torque."""
    over_rated = 1.0 if table.rated_torque else (sold or table).application_factor
    return float(table.peak_factor or gear.start_factor * over_rated)


def gear_check(
    load: GearDuty, rating: GearRating, peak_factor: float, run: str = "", bearing: str = ""
) -> GearCheck:
    """The gear under its load."""
    rated = rating.rated_torque or None
    return GearCheck(
        **vars(load),
        run=run,
        bearing=bearing,
        rated_torque=rated,
        application_factor=load.equivalent / load.mean if load.mean else None,
        running_limit=rated * rating.application_factor if rated else None,
        torque_limit=rated * peak_factor if rated else None,
    )


def check_gear(
    checks: Checks, gear: GearCheck, rating: GearRating, peak_load: float, run: str, unloaded: str = _UNTURNED
) -> None:
    """Check a gear; `peak_load` is the permitted radial force in events [N], 0 if it is unknown, and `run` the title
    of the run with the largest torque. `unloaded` says why the output shaft has no reaction, if it has none."""
    place, lacking = ("gear", "checks.gear", gear), "its limit is not known; add [gear_rating] with "
    if gear.rated_torque:
        checks.check(_RUNNING, *place, gear.running_limit, teq=_TEQ[bool(gear.exponent)])
        checks.check(_LARGEST, *place, gear.torque_limit, run=run)
    else:
        checks.lack("gear, torque of running and largest torque", f"{lacking}rated_torque")
    for key, rule in _RATINGS.items():
        if getattr(gear, rule.value) is None:
            checks.lack(f"gear, {rule.title}", unloaded)
        else:
            checks.check(rule, *place, getattr(rating, key), f"{lacking}{key}")
    if gear.largest_radial is not None and rating.overhung_load:
        checks.check(_EVENTS, *place, peak_load, f"{lacking}peak_overhung_load")


def find(study: StudyRecord, plan: CheckPlan, checks: Checks) -> GearCheck | None:
    """The gear of a study, and its `checks`; none for a drive without a gear."""
    runs, drive, tables, table = study.runs, study.setup.drive, study.setup.config.drive, plan.gear
    sold = drive.gear.rating
    if drive.ratio == 1.0:
        return None
    limit = tables.gear.torque_limit if "gear.torque_limit" in tables.given else 0.0
    rating = rating_of(table, sold, limit)
    if not any((rating.rated_torque, *(getattr(rating, key) for key in _RATINGS))):
        checks.lack("gear", "the file gives no rating of the gear; add [gear_rating]", "gear_rating")
        return None
    if drive.foreign is not None:
        checks.lack("gear", "the motor is an FMU, whose torque is not known")
        return None
    turns = runs.steady
    torque = gear_torque(drive, turns)
    most, run = max((torque, name) for name, torque in gear_peaks(runs).items())
    starts = StartFindings.found_in(study.findings)
    if starts is not None and starts.worst.quasi_static > most:
        most, run = starts.worst.quasi_static, START
    bearing = "" if plan.separate_bearing else driver_bearing(drive)
    equivalent = equivalent_torque(torque, crank_angle(drive, turns), table.exponent)
    power, ratio = shaft_power(drive, turns), drive.ratio
    if drive.line.before_gear is not None:
        ratio /= drive.line.ratio
        power = torque * gear_speed(drive, turns) / ratio + gear_loss(drive, turns)
    load = GearDuty(
        ratio=ratio,
        exponent=table.exponent or None,
        equivalent=equivalent,
        running=equivalent if table.exponent else running_peak(study, at_gear).torque,
        mean=mean(turns, np.abs(torque)),
        largest=most,
        power=mean(turns, np.abs(power)),
        radial=peak(pin_force(drive, turns, bearing)) if bearing else None,
        largest_radial=largest_load(runs.pins, bearing)[0] if bearing else None,
        speed=largest(runs, partial(gear_speed, drive))[0],
    )
    gear = gear_check(load, rating, peak_factor_of(table, sold, tables.gear), run, bearing)
    separate = "the crank has bearings of its own (sizing.separate_bearing)"
    unloaded = separate if plan.separate_bearing else _UNTURNED
    check_gear(checks, gear, rating, table.peak_overhung_load, runs.title_of(run), unloaded)
    return gear


def motor_shaft(runs: StudyRuns, plan: CheckPlan, checks: Checks) -> ShaftLoad | None:
    """The radial force on the motor's shaft, and its `checks`."""
    what, table = "overhung load of the motor's shaft", plan.motor_shaft
    drive, turns = runs.drive, runs.steady
    direct = drive.ratio == 1.0
    if not table.overhung_load:
        why = "the file gives no permitted load; add [motor_shaft] with overhung_load"
        belt = "" if direct else ", and for a belt on it with pulley_diameter and tension_factor"
        checks.lack(what, why + belt, "motor_shaft")
        return None
    bearing = driver_bearing(drive)
    parts = [part.name for part in drive.line]
    if parts[:1] == ["belt"]:
        load, rule = ShaftLoad(None, peak(turns["belt.shaft_force"].values)), _BELT
    elif table.pulley_diameter and table.tension_factor:
        torque = peak(torque_before_gear(drive, turns))
        load = ShaftLoad(torque, pulley_force(torque, table.pulley_diameter, table.tension_factor))
        rule = _PULLEY
    elif direct and bearing:
        load, rule = ShaftLoad(None, peak(pin_force(drive, turns, bearing))), _CRANK
    else:
        belt = "a belt or wheel on it is not known; add pulley_diameter and tension_factor"
        checks.lack(what, "no pin of the machine turns with the shaft" if direct else belt)
        return None
    checks.check(rule, "motor", "checks.motor_shaft", load, table.overhung_load, pin=bearing)
    return load
