"""The thermal overload relay of a motor on the line: the class that lets the start through, and the time at which it
trips in a stall, beside the time for which the motor may stand.

IEC 60947-4-1 gives each class a band of trip times: a relay of the class may be as fast as the one end, where a start
must not trip it, and as slow as the other, where it must still save the motor.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ...core.quantities import Value, declaration, quantity
from ...reading.results import part, result
from ...study.event_torques import from_event_on
from ...study.record import StudyRecord
from ...study.relay import (
    CLASSES,
    HOLDS_AT,
    LIGHT,
    MULTIPLE,
    TRIPS_AT,
    TripClass,
    lasting_current,
    relay_trip,
    stall_trip,
    start_seconds,
)
from ...study.starts import StartFindings
from ...study.verdict import STEADY
from .plan import RelayPlan
from .row import CheckRow, CheckRule, NotChecked

if TYPE_CHECKING:
    import xarray as xr

_CLAUSE = "IEC 60947-4-1, trip classes"
_STALL = f"{_CLAUSE}; locked-rotor time of the maker of the motor"
_RUNNING = CheckRule(
    "before", "running", "IEC 60947-4-1, limits of operation",
    f"RMS current of steady running <= {HOLDS_AT:g} Ir, at which the relay must not trip", "Ir = setting",
)  # fmt: skip
_WHAT = "thermal overload relay"


@declaration
class RelaySetting:
    """The relay and the motor behind it."""

    setting: Value = quantity("A", "setting")
    before: Value = quantity("A", "RMS current of steady running")
    start_seconds: Value = quantity("s", "the start as time at 7.2 times the setting")
    stall_current: Value = quantity("A", "current with the rotor locked")
    stall_time: Value = quantity("s", "time for which the rotor of a warm motor may be locked")


@declaration
class RelayOfClass:
    """A relay of a trip class."""

    shortest: Value = quantity("s", "least trip time of a cold relay at 7.2 times its setting")
    longest: Value = quantity("s", "largest trip time of a cold relay at 7.2 times its setting")
    stall_trip: Value = quantity(
        "s",
        "trip time of the slowest relay, warm from running, with the rotor locked; none if running trips it",
    )


@declaration
class StallHeat:
    """An event in which the motor stalls, or a relay trips."""

    trip_time: Value = quantity("s", "time after the event at which the slowest relay trips")
    seconds: Value = quantity("s", "heat of the motor until then, as time with the rotor locked")


@result
class RelayFindings:
    """The relay: its class is that of the file, or else the one of the study, see `StudyRecord.relay_class`."""

    trip_class: str = part("name of the class")
    numbers: RelaySetting = part(inline=True)
    holds_up_to: float = quantity("A", "current at which no relay of this setting trips")
    classes: Mapping[str, RelayOfClass] = part("relays by their class")
    suitable: tuple[str, ...] = part(
        "classes that let the start through and trip within the time of the stall"
    )
    events: Mapping[str, StallHeat] = part("events, with the relay of the class")


def stall_heat(
    relay_class: TripClass,
    time: Any,
    current: Any,
    setting: float,
    before: float,
    stall_current: float,
    after: float | None = None,
) -> StallHeat | None:
    """An event: the trip of the slowest relay of a class, and the heat of the motor until then. `time` [s] since the
    event and `current` [A] are of shape (n,); the current flows on as `lasting_current` says. None if the relay never
    trips."""
    if before >= TRIPS_AT * setting:
        return None
    lasts = lasting_current(current, after)
    trip = relay_trip(time, current, setting, before, lasts, relay_class.longest, TRIPS_AT)
    if trip is None:
        return None
    until = time <= trip
    heat = float(np.trapezoid((current[until] / stall_current) ** 2, time[until]))
    heat += max(0.0, trip - float(time[-1])) * (lasts / stall_current) ** 2
    return StallHeat(trip_time=trip, seconds=heat)


def relay_findings(
    trip_class: str, numbers: RelaySetting, runs: Mapping[str, Sequence[Any]], least: int = LIGHT
) -> RelayFindings:
    """The relay with these `numbers`.

    Parameters
    ----------
    trip_class : name of its class; empty for the class `least`, or the heaviest
    runs : by event, the time since it began [s] and the current [A], shape (n,), the RMS current before [A], and the
        one that flows after it if it passes [A]
    least : the least class that all starts need, by `chainunit.study.relay.start_class`
    """
    classes: dict[str, RelayOfClass] = {}
    starting = []
    for relay_class in CLASSES:
        trip = stall_trip(relay_class, numbers.setting, numbers.before, numbers.stall_current)
        classes[relay_class.name] = RelayOfClass(
            shortest=relay_class.shortest, longest=relay_class.longest, stall_trip=trip
        )
        enough = least <= LIGHT or relay_class.longest >= least
        if numbers.start_seconds <= relay_class.shortest and enough:
            starting.append(relay_class)
    named = {relay_class.name: relay_class for relay_class in CLASSES}
    chosen_class = named[trip_class] if trip_class else named.get(str(least), CLASSES[-1])
    trips = {name: classes[name].stall_trip for name in (relay_class.name for relay_class in starting)}
    suitable = [name for name, trip in trips.items() if trip is not None and trip <= numbers.stall_time]
    heats = {
        name: stall_heat(chosen_class, time, current, numbers.setting, before, numbers.stall_current, *after)
        for name, (time, current, before, *after) in runs.items()
    }
    events = {name: heat for name, heat in heats.items() if heat is not None}
    holds = HOLDS_AT * numbers.setting
    return RelayFindings(chosen_class.name, numbers, holds, classes, tuple(suitable), events)


def find(study: StudyRecord, plan: RelayPlan) -> tuple[RelayFindings | None, list[CheckRow | NotChecked]]:
    """The relay of a study and its checks, or the reason against them."""
    if study.drive.follows and study.drive.foreign is None:
        what = f"{_WHAT}, starts per hour"
        return None, [NotChecked(what, "the motor is controlled; its converter limits and protects it")]
    if why := _why_none(study):
        return None, [NotChecked(_WHAT, why)]
    plate, drive = None if study.plate is None else study.plate.nameplate, study.drive
    # a relay in the phases of a delta carries the current of a winding
    in_phases = drive.star_delta is not None and plan.is_in_phases
    share = 1.0 / math.sqrt(3.0) if in_phases else 1.0
    settings = {
        "setting": plan.table.setting or share * (drive.rated_current or 0.0),
        "stall_time": plan.table.stall_time or (plate.locked_time if plate else 0.0),
        "stall_current": plan.table.stall_current
        or (share * plate.rated_current * plate.locked_current_ratio if plate else 0.0),
    }
    if missing := [name for name, value in settings.items() if not value]:
        return None, [NotChecked(_WHAT, f"the motor has no nameplate; add [relay] with {', '.join(missing)}")]
    assert study.start is not None
    before = share * study.answers[STEADY].current_rms

    def current_of(run: xr.Dataset) -> Any:
        current = np.abs(run[f"motor.{drive.motor.current}"].values)
        return share * (drive.relay_current(run["time"].values, current) if in_phases else current)

    rise = study.runs["start_up"].sel(time=slice(None, study.start_end))
    seconds = start_seconds(rise["time"].values, current_of(rise), settings["setting"])
    starts = StartFindings.found_in(study)
    if (
        starts is not None
        and drive.rated_current
        and not starts.stuck
        and in_phases == (drive.star_delta is not None)
    ):
        # the hardest of the starts from all crank angles, which are for a relay at the rated current
        seconds = max(
            seconds, starts.relay_seconds * (share * drive.rated_current / settings["setting"]) ** 2
        )
    runs: dict[str, tuple[Any, Any, float, float | None]] = {}
    for event in study.overloads:
        # behind a coupling that opens no load is left that could trip the relay
        if study.answers[event].coupling_trip_time is None:
            run = from_event_on(study, event)
            from_rest = study.config.events[event].from_rest
            time = run["time"].values - study.event[event]
            passes = study.config.events[event].passes and study.answers[event].stall_time is None
            runs[event] = time, current_of(run), 0.0 if from_rest else before, before if passes else None
    numbers = RelaySetting(before=before, start_seconds=seconds, **settings)
    findings = relay_findings(plan.trip_class, numbers, runs, study.relay_class)
    return findings, list(relay_rows(findings, {event: study.title_of(event) for event in findings.events}))


def _why_none(study: StudyRecord) -> str:
    """The reason why no relay is checked; empty where one is."""
    if study.drive.foreign is not None:
        return "the motor is an FMU, whose current is not known"
    if study.start is None or study.start.start_time is None:
        return "the motor does not come to its speed"
    return ""


def relay_rows(findings: RelayFindings, titles: Mapping[str, str]) -> Iterator[CheckRow | NotChecked]:
    """The rows of a relay; `titles` are those of its events."""
    numbers, chosen_class, root = findings.numbers, findings.classes[findings.trip_class], "checks.relay"
    here, name = f"{root}.classes.{findings.trip_class}", f"thermal relay of class {findings.trip_class}"
    places = {
        "Ir": f"{root}.setting",
        "IA": f"{root}.stall_current",
        "I0": f"{root}.before",
        "largest": f"{here}.longest",
    }
    yield CheckRow(
        name, "start", _CLAUSE,
        f"t = sum (I/({MULTIPLE:g} Ir))^2 dt <= least trip time of the class at {MULTIPLE:g} Ir, cold",
        numbers.start_seconds, chosen_class.shortest, f"{root}.start_seconds",
        {"Ir": places["Ir"], "limit": f"{here}.shortest"}, "s",
    )  # fmt: skip
    yield _RUNNING.row(name, root, numbers, findings.holds_up_to)
    if numbers.before >= TRIPS_AT * numbers.setting:
        yield NotChecked(f"{name}, stall and events", "running alone trips it")
        return
    yield CheckRow(
        name, "trip with the rotor locked", _STALL,
        f"t = T ln(((IA/Ir)^2 - (I0/Ir)^2)/((IA/Ir)^2 - {TRIPS_AT:g}^2)), T from the largest trip time of the class",
        math.inf if chosen_class.stall_trip is None else chosen_class.stall_trip, numbers.stall_time,
        f"{here}.stall_trip", places, "s",
    )  # fmt: skip
    for event, heat in findings.events.items():
        path = f"{root}.events.{event}"
        yield CheckRow(
            name, f"heat of the motor until the trip ({titles[event]})", _STALL,
            "t = sum (I/IA)^2 dt until the slowest relay trips", heat.seconds, numbers.stall_time, f"{path}.seconds",
            {"IA": places["IA"], "trip": f"{path}.trip_time"}, "s",
        )  # fmt: skip
