"""A gear beside its ratings: torque of running, largest torque, thermal rating, overhung load, speed; and the
overhung load of the motor's shaft.

ISO 6336-6 takes the application factor from the spectrum of the torque: KA = Teq/Tn, with Teq of the same damage by
Woehler's line of exponent p and Palmgren and Miner's rule, and Tn the mean torque of the machine. A gear with the
rated torque TN that is rated for the factor KAN carries Teq = KA Tn <= KAN TN. A wheel on the crank's shaft meets
each angle of the crank with the same teeth: they carry the largest torque of the turn in each turn, so that without
an exponent Teq is the largest torque of running.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ...core.quantities import Value, declaration, quantity
from ...drives.gear_rating import GearRating
from ...drives.gearing import Transmission
from ...reading.results import part, result
from ...study.arrays import peak
from ...study.bearings import driver_bearing, largest_load, mean_load, pin_force
from ...study.event_torques import gear_peaks, running_peak
from ...study.readings import crank_angle, shaft_power
from ...study.record import StudyRecord
from ...study.starts import StartFindings
from ...study.torques import at_gear, gear_torque
from ...study.verdict import START
from ...study.window import mean
from .row import CheckRow, CheckRule, NotChecked
from .runs import largest
from .tables import GearRatingTable, MotorShaftTable

if TYPE_CHECKING:
    import xarray as xr

_MAKER = "Rating of the maker of the gear"
_TEQ = {True: "Teq = (sum |T|^p |dphi| / sum |dphi|)^(1/p)", False: "Teq: largest |T| of running"}
_RUNNING = {
    has_exponent: CheckRule(
        "running", "torque of running", "ISO 6336-6:2019, annex on KA from a load spectrum",
        f"Teq <= KAN TN, KAN: application factor that the gear permits; {teq}; KA = Teq/mean |T|, both of steady "
        "running", "TN = rated_torque; p = exponent; KA = application_factor",
    )
    for has_exponent, teq in _TEQ.items()
}  # fmt: skip
_LARGEST = CheckRule(
    "largest", "largest torque of the output ({run})", _MAKER, "T <= peak factor x TN",
    "TN = rated_torque; permitted = torque_limit",
)  # fmt: skip
_RATINGS = {
    "thermal_power": CheckRule("power", "mean power", _MAKER, "mean of |P| <= thermal rating"),
    "overhung_load": CheckRule("radial", "overhung load", _MAKER, "largest |F| of the bearing <= permitted"),
    "largest_speed": CheckRule("speed", "speed of the input shaft", _MAKER, "largest |w| of all runs"),
}
"""By the key of the rating."""
_EVENTS = CheckRule(
    "largest_radial", "overhung load of all runs", _MAKER, "largest |F| of the bearing <= permitted in events"
)
_UNTURNED = "no pin of the machine turns with the output shaft"
_SEPARATE = "the crank has bearings of its own (sizing.separate_bearing)"


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
class GearCheck:
    """The gear. Its application factor is the torque of equal damage over the mean one."""

    run: str = part("the run with the largest torque")
    bearing: str = part("pin whose reaction the output shaft carries; empty where it carries none")
    load: GearDuty = part(inline=True)
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


def gear_check(
    load: GearDuty, rating: GearRating, peak_factor: float, run: str = "", bearing: str = ""
) -> GearCheck:
    """The gear under its load."""
    rated = rating.rated_torque or None
    return GearCheck(
        run=run,
        bearing=bearing,
        load=load,
        rated_torque=rated,
        application_factor=load.equivalent / load.mean if load.mean else None,
        running_limit=rated * rating.application_factor if rated else None,
        torque_limit=rated * peak_factor if rated else None,
    )


def gear_rows(
    check: GearCheck,
    rating: GearRating,
    permitted_peak: float,
    titles: Mapping[str, str],
    unloaded: str = _UNTURNED,
) -> Iterator[CheckRow | NotChecked]:
    """The rows of a gear; `permitted_peak` is the permitted radial force in events [N], 0 where it is unknown, and
    `titles` are those of runs. `unloaded` says why the output shaft carries no reaction, where it carries none."""
    load, path = check.load, "checks.gear"
    if check.running_limit is not None and check.torque_limit is not None:
        yield _RUNNING[bool(load.exponent)].row("gear", path, load, check.running_limit)
        yield _LARGEST.row("gear", path, load, check.torque_limit, titles.get(check.run, check.run))
    else:
        yield _lacks("torque of running and largest torque", "rated_torque")
    for key, rule in _RATINGS.items():
        if getattr(load, rule.value) is None:
            yield NotChecked(f"gear, {rule.title}", unloaded)
        elif not (limit := getattr(rating, key)):
            yield _lacks(rule.title, key)
        else:
            yield rule.row("gear", path, load, limit)
    if load.largest_radial is not None and rating.overhung_load:
        if permitted_peak:
            yield _EVENTS.row("gear", path, load, permitted_peak)
        else:
            yield _lacks(_EVENTS.title, "peak_overhung_load")


def _lacks(title: str, key: str) -> NotChecked:
    return NotChecked(f"gear, {title}", f"its limit is not known; add [gear_rating] with {key}")


def bearing_force(study: StudyRecord, turns: xr.Dataset) -> tuple[str, float | None, float | None]:
    """The bearing of the crank by its title, its largest force over whole `turns`, and that of all runs [N]; an empty
    title, and None, where the machine has none."""
    title = driver_bearing(study.drive)
    if not title:
        return "", None, None
    return title, peak(pin_force(study.drive, turns, title)), largest_load(study.pins, title)[0]


def find(
    study: StudyRecord, table: GearRatingTable, separate: bool = False
) -> tuple[GearCheck | None, list[CheckRow | NotChecked]]:
    """The gear of a study and its checks; none for a drive without a gear. `separate` tells whether the crank has
    bearings of its own."""
    drive, tables = study.drive, study.config.drive
    if drive.ratio == 1.0:
        return None, []
    transmission = tables.gear if "gear.torque_limit" in tables.given else None
    rating = rating_of(table, drive.gear_rating, transmission.torque_limit if transmission else 0.0)
    if not any((rating.rated_torque, rating.thermal_power, rating.overhung_load, rating.largest_speed)):
        why = "the file gives no rating of the gear; add [gear_rating]"
        return None, [NotChecked("gear", why, "gear_rating")]
    if drive.foreign is not None:
        return None, [NotChecked("gear", "the motor is an FMU, whose torque is not known")]
    turns = study.steady
    torque = gear_torque(drive, turns)
    most, run = max((torque, name) for name, torque in gear_peaks(study).items())
    starts = StartFindings.found_in(study)
    if starts is not None and starts.worst.quasi_static > most:
        most, run = starts.worst.quasi_static, START
    title, radial, largest_radial = ("", None, None) if separate else bearing_force(study, turns)
    equivalent = equivalent_torque(torque, crank_angle(drive, turns), table.exponent)
    load = GearDuty(
        ratio=drive.ratio,
        exponent=table.exponent or None,
        equivalent=equivalent,
        running=equivalent if table.exponent else running_peak(study, at_gear).torque,
        mean=mean(turns, np.abs(torque)),
        largest=most,
        power=mean(turns, np.abs(shaft_power(drive, turns))),
        radial=radial,
        largest_radial=largest_radial,
        speed=largest(study, lambda run: run[drive.motor_speed].values)[0],
    )
    check = gear_check(load, rating, peak_factor_of(table, drive.gear_rating, tables.gear), run, title)
    why = _SEPARATE if separate else _UNTURNED
    return check, list(gear_rows(check, rating, table.peak_overhung_load, study.titles, why))


def rating_of(table: GearRatingTable, sold: GearRating | None, torque_limit: float) -> GearRating:
    """The ratings in the `table` of the file; for those that it leaves out, those of the gear that is `sold` in a
    catalogue, and else the `torque_limit` of [gear]: the rated torque times the application factor, as of a gear of
    a catalogue."""
    factor = table.application_factor
    sold = sold or GearRating(rated_torque=torque_limit / factor, application_factor=factor)
    torque = table if table.rated_torque else sold
    return GearRating(
        rated_torque=torque.rated_torque,
        application_factor=torque.application_factor,
        thermal_power=table.thermal_power or sold.thermal_power,
        overhung_load=table.overhung_load or sold.overhung_load,
        largest_speed=table.largest_speed or sold.largest_speed,
    )


def peak_factor_of(table: GearRatingTable, sold: GearRating | None, gear: Transmission) -> float:
    """The permitted torque in peaks over the rated torque: that in the `table` of the file, else in a start of the
    `gear`, which permits it over the rated torque times the application factor if the `table` has no rated torque."""
    over_rated = 1.0 if table.rated_torque else (sold or table).application_factor
    return float(table.peak_factor or gear.start_factor * over_rated)


def motor_shaft(
    study: StudyRecord, table: MotorShaftTable
) -> tuple[ShaftLoad | None, list[CheckRow | NotChecked]]:
    """The radial force on the motor's shaft and its check, or the reason against it."""
    what = "overhung load of the motor's shaft"
    direct = study.drive.ratio == 1.0
    if not table.overhung_load:
        why = "the file gives no permitted load; add [motor_shaft] with overhung_load"
        belt = "" if direct else ", and for a belt on it with pulley_diameter and tension_factor"
        return None, [NotChecked(what, why + belt, "motor_shaft")]
    turns, torque = study.steady, None
    if table.pulley_diameter and table.tension_factor:
        torque = peak(turns[study.drive.motor_torque].values)
        radial = pulley_force(torque, table.pulley_diameter, table.tension_factor)
        formula = "F = 2 T f/d, T: largest torque at the motor's shaft in steady running"
        numbers = {
            "T": "checks.motor_shaft.torque",
            "f": "motor_shaft.tension_factor",
            "d": "motor_shaft.pulley_diameter",
        }
    elif direct:
        title, force, _ = bearing_force(study, turns)
        if force is None:
            return None, [NotChecked(what, "no pin of the machine turns with the shaft")]
        radial, formula, numbers = force, f"largest reaction of {title} in steady running", {}
    else:
        return None, [
            NotChecked(what, "a belt or wheel on it is not known; add pulley_diameter and tension_factor")
        ]
    load = ShaftLoad(torque, radial)
    return load, [shaft_row(load, table.overhung_load, formula, numbers)]


def pulley_force(torque: float, diameter: float, factor: float) -> float:
    """Radial force [N] of a belt on a pulley of that `diameter` [m] with the `torque` [N m]; the `factor` is the
    force over that of the torque at the rim, as the tension of the belt adds to it."""
    return 2.0 * torque * factor / diameter


def shaft_row(load: ShaftLoad, limit: float, formula: str, numbers: Mapping[str, str]) -> CheckRow:
    """The row of the motor's shaft."""
    source, place = "Permitted radial force of the maker of the motor", "checks.motor_shaft.radial"
    return CheckRow(
        "motor", "overhung load of the shaft", source, formula, load.radial, limit, place, numbers, "N"
    )
