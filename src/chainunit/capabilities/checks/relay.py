"""The thermal overload relay of a motor on the line: the class that lets the start through, and the time at which it
trips in a stall, beside the time for which the motor may stand.

IEC 60947-4-1 gives each class a band of trip times: a relay of the class may be as fast as the one end, where a start
must not trip it, and as slow as the other, where it must still save the motor.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...core.quantities import Value, declaration, quantity
from ...reading.results import part, result
from ...study.arrays import Dataset
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
from .plan import CheckPlan
from .row import CheckRule, Checks

_CLAUSE = "IEC 60947-4-1, trip classes"
_STALL = f"{_CLAUSE}; locked-rotor time of the maker of the motor"
_START = CheckRule(
    "start", "start_seconds", _CLAUSE,
    f"t = sum (I/({MULTIPLE:g} Ir))^2 dt <= least trip time of the class at {MULTIPLE:g} Ir, cold",
    "Ir = setting; limit = classes.{name}.shortest",
)  # fmt: skip
_RUNNING = CheckRule(
    "running", "before", "IEC 60947-4-1, limits of operation",
    f"RMS current of steady running <= {HOLDS_AT:g} Ir, at which the relay must not trip", "Ir = setting",
)  # fmt: skip
_LOCKED = CheckRule(
    "trip with the rotor locked", "classes.{name}.stall_trip", _STALL,
    f"t = T ln(((IA/Ir)^2 - (I0/Ir)^2)/((IA/Ir)^2 - {TRIPS_AT:g}^2)), T from the largest trip time of the class",
    "Ir = setting; IA = stall_current; I0 = before; largest = classes.{name}.longest",
)  # fmt: skip
_HEAT = CheckRule(
    "heat of the motor until the trip ({title})", "events.{name}.seconds", _STALL,
    "t = sum (I/IA)^2 dt until the slowest relay trips", "IA = stall_current; trip = events.{name}.trip_time",
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
class RelayFindings(RelaySetting):
    """The relay: its class is that of the file, or else the one of the study, see `StudyRecord.relay_class`."""

    trip_class: str = part("name of the class")
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
    """The trip of the slowest relay of a class, set to `setting` [A], in an event, and the heat of the motor until
    then, as time with its `stall_current` [A]; None if the relay never trips. The run has the `time` since the event
    [s] and the `current` [A], shape (n,); `before` is the RMS current before it [A], for `after` see
    `lasting_current`."""
    if before >= TRIPS_AT * setting:
        return None
    lasting = lasting_current(current, after)
    trip = relay_trip(time, current, setting, before, lasting, relay_class.longest)
    if trip is None:
        return None
    until = time <= trip
    heat = float(np.trapezoid((current[until] / stall_current) ** 2, time[until]))
    heat += max(0.0, trip - float(time[-1])) * (lasting / stall_current) ** 2
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
    least : the least class that all starts need, see `chainunit.study.relay`
    """
    n, named = numbers, {relay_class.name: relay_class for relay_class in CLASSES}
    classes = {
        name: RelayOfClass(
            shortest=x.shortest,
            longest=x.longest,
            stall_trip=stall_trip(x, n.setting, n.before, n.stall_current),
        )
        for name, x in named.items()
    }
    chosen = named[trip_class] if trip_class else named.get(str(least), CLASSES[-1])
    heats = {
        name: stall_heat(chosen, time, current, n.setting, before, n.stall_current, *after)
        for name, (time, current, before, *after) in runs.items()
    }
    return RelayFindings(
        **vars(numbers),
        trip_class=chosen.name,
        holds_up_to=HOLDS_AT * n.setting,
        classes=classes,
        suitable=tuple(
            name
            for name, x in classes.items()
            if n.start_seconds <= x.shortest
            and (least <= LIGHT or x.longest >= least)
            and x.stall_trip is not None
            and x.stall_trip <= n.stall_time
        ),
        events={name: heat for name, heat in heats.items() if heat is not None},
    )


def check_relay(checks: Checks, relay: RelayFindings, titles: Mapping[str, str]) -> None:
    """Check a relay; `titles` are those of its events."""
    name = relay.trip_class
    title, own_class = f"thermal relay of class {name}", relay.classes[name]
    place = (title, "checks.relay", relay)
    checks.check(_START, *place, own_class.shortest, name=name)
    checks.check(_RUNNING, *place, relay.holds_up_to)
    if relay.before >= TRIPS_AT * relay.setting:
        checks.lack(f"{title}, stall and events", "running alone trips it")
        return
    checks.check(_LOCKED, *place, relay.stall_time, name=name)
    for event in relay.events:
        checks.check(_HEAT, *place, relay.stall_time, name=event, title=titles[event])


def find(study: StudyRecord, plan: CheckPlan, checks: Checks) -> RelayFindings | None:
    """The relay of a study, and its `checks`."""
    drive, table = study.setup.drive, plan.relay
    if drive.foreign is not None:
        checks.lack(_WHAT, "the motor is an FMU, whose current is not known")
        return None
    if drive.follows:
        why = "the motor is controlled; its converter limits and protects it"
        checks.lack(f"{_WHAT}, starts per hour", why)
        return None
    if study.runs.start is None or study.runs.start.start_time is None:
        checks.lack(_WHAT, "the motor does not come to its speed")
        return None
    plate = None if study.setup.plate is None else study.setup.plate.nameplate
    # a relay in the phases of a delta carries the current of a winding
    in_phases = bool(drive.star) and plan.relay_in_phases
    share = 1.0 / math.sqrt(3.0) if in_phases else 1.0
    locked = share * plate.rated_current * plate.locked_current_ratio if plate else 0.0
    settings = {
        "setting": table.setting or share * (drive.rated_current or 0.0),
        "stall_time": table.stall_time or (plate.locked_time if plate else 0.0),
        "stall_current": table.stall_current or locked,
    }
    if missing := [name for name, value in settings.items() if not value]:
        checks.lack(_WHAT, f"the motor has no nameplate; add [relay] with {', '.join(missing)}")
        return None
    before = share * study.runs.answers[STEADY].current_rms

    def current_of(run: Dataset) -> Any:
        current = np.abs(run[f"motor.{drive.motor.current}"].values)
        return share * (drive.star.winding_current(run["time"].values, current) if in_phases else current)

    rise = study.runs.series["start_up"].sel(time=slice(None, study.runs.start_end))
    seconds = start_seconds(rise["time"].values, current_of(rise), settings["setting"])
    starts = StartFindings.found_in(study.findings)
    is_usual = in_phases == bool(drive.star)
    if starts is not None and drive.rated_current and not starts.stuck and is_usual:
        # the hardest of the starts from all crank angles, which are for a relay at the rated current
        times = share * drive.rated_current / settings["setting"]
        seconds = max(seconds, starts.relay_seconds * times**2)
    runs: dict[str, tuple[Any, Any, float, float | None]] = {}
    for name in study.runs.overloads:
        event, answer = study.setup.config.events[name], study.runs.answers[name]
        # behind a coupling that opens no load is left that could trip the relay
        if answer.coupling_trip_time is None:
            run = study.runs.event_parts[name]
            after = before if event.passes and answer.stall_time is None else None
            time = run["time"].values - study.runs.event_times[name]
            runs[name] = time, current_of(run), 0.0 if event.from_rest else before, after
    numbers = RelaySetting(before=before, start_seconds=seconds, **settings)
    relay = relay_findings(plan.trip_class, numbers, runs, study.runs.relay_class)
    check_relay(checks, relay, study.runs.titles)
    return relay
