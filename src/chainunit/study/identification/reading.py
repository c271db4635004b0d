"""The reader of the table [identify]: its entries against the quantities of the study, as an `IdentificationPlan`."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from ...core.errors import Faults, InputError, near_name, shown
from ...core.messages import unit_behind
from ...core.quantities import Layout, Quantity, Variable, named_values
from ...core.units import split
from ...reading.tables import given_values, instance, read_table, to_number
from .measurands import MEASURANDS
from .table import (
    RUN_KEYS,
    SENSOR_KEYS,
    IdentifyTable,
    ParameterEntry,
    RunTable,
    SensorTable,
    WatchTable,
    entry_form,
)
from .unknown import Unknown

OFFSET_SHARE = 0.05
"""Standard deviation of the offset of a sensor of current or torque without another knowledge, in parts of the RMS of
its column."""
WITH_OFFSET = ("motor.i", "crank.tau")
"""Quantities whose sensors usually have an offset."""
_NAME = re.compile(r"[a-z][a-z0-9_]{0,19}")


@dataclasses.dataclass(frozen=True)
class SensorKnowledge:
    """The knowledge of a sensor: noise in parts of the RMS of its column, standard deviation of its gain, and, in the
    unit of the column, the standard deviation of its offset (None: the usual one) and the step of its converter."""

    noise: float
    gain: float
    offset: float | None = None
    resolution: float = 0.0


@dataclasses.dataclass(frozen=True)
class PlannedRun:
    """A recording of the plan: its `file`, the heads of its `columns` by quantity, the speed of the crank [rad/s],
    the part that counts [s], the temperature of the surroundings [K], whether it has the `feed` that is sought, and
    the amounts that were added to sought numbers by their full names; the changes of the crank speed (begin and
    duration [s], speed after it [rad/s]), and the time at which the motor is switched off [s], or None."""

    name: str
    file: Path
    columns: Mapping[str, str]
    crank_speed: float
    begin: float
    end: float
    ambient: float
    has_feed: bool
    added: Mapping[str, float]
    speeds: tuple[tuple[float, float, float], ...] = ()
    off: float | None = None


@dataclasses.dataclass(frozen=True)
class WatchPlan:
    """A recording that is watched: its `file`, the heads of its `columns` by quantity, the speed of the crank
    [rad/s], the part that counts [s], the temperature of the surroundings [K]; the time of its begin in which is
    learned [s], the standard deviation of the feed as a share, the noise of the sensors in parts of the RMS of their
    columns, the standard deviation of their gains, and the result of an identification, if there is one."""

    file: Path
    columns: Mapping[str, str]
    crank_speed: float
    begin: float
    end: float
    ambient: float
    learning: float
    feed_deviation: float
    noise: float
    gain: float
    identification: Path | None

    @property
    def turn(self) -> float:
        """Time of a turn of the crank [s]."""
        return 2.0 * math.pi / self.crank_speed


@dataclasses.dataclass(frozen=True)
class IdentificationPlan:
    """The sought numbers by the full names of the study file, the recordings, and the knowledge of the sensors."""

    sought: tuple[Unknown, ...]
    variables: Mapping[str, Variable]
    """the declarations of the sought numbers"""
    runs: tuple[PlannedRun, ...]
    sensors: Mapping[str, SensorKnowledge]
    usual: SensorKnowledge
    starts: int
    seed: int

    def sensor(self, column: str) -> SensorKnowledge:
        """The knowledge of the sensor of a column."""
        return self.sensors.get(column, self.usual)


def read_identification(
    form: Any,
    table: IdentifyTable,
    declared: Sequence[tuple[Any, str]],
    crank_speed: float,
    fixed: Mapping[str, str],
    source: str,
) -> IdentificationPlan:
    """The plan of a checked table [identify]: its `form` with what the file gives, and its declared values `table`.

    Parameters
    ----------
    declared : instances of the declarations whose numbers can be sought, each with the name of its table
    crank_speed : the speed of a run that does not give its own [rad/s]
    fixed : by the full name of a number that cannot be sought, the reason
    source : the study file; recordings are named relative to it

    Raises
    ------
    InputError
        with a line for each fault: the key, its value and the allowed range.
    """
    known = {
        v.name: (v, value) for instance, name in declared for v, value in named_values(instance, f"{name}.")
    }
    faults, sought = Faults(), dict[str, Unknown]()
    for k, entry in enumerate(form.parameter, 1):
        with faults.collected():
            found = _parameter(entry, f"identify.parameter.{k}", known, fixed)
            if found.name in sought:
                key = f"identify.parameter.{k}.name"
                raise InputError(f"{key} = {shown(found.name)}: stands there twice; take one out", key)
            sought[found.name] = found
    for name, words in (("parameter", "a number that is sought"), ("run", "a recording")):
        if not getattr(form, name):
            key = f"identify.{name}"
            faults.add([InputError(f"{key}: is missing; add [[{key}]] with {words}", key)])
    runs: list[PlannedRun] = []
    for k, entry in enumerate(form.run, 1):
        with faults.collected():
            run = _run(entry, f"identify.run.{k}", k, crank_speed, known, source)
            key = f"identify.run.{k}.name"
            if any(run.name == other.name for other in runs):
                raise InputError(
                    f"{key} = {shown(run.name)}: is the name of another run; give it another", key
                )
            if run.name == "mark":
                raise InputError(
                    f"{key} = {shown(run.name)}: stands for the mark of a turn; give it another", key
                )
            for name in run.added.keys() - sought.keys() if not faults.errors else ():
                key = f"identify.run.{k}.added.{name}"
                raise InputError(f"{key}: is not sought; add [[identify.parameter]] with this name", key)
            runs.append(run)
    sensors: dict[str, SensorKnowledge] = {}
    for k, entry in enumerate(form.sensor, 1):
        with faults.collected():
            column, knowledge = _sensor(entry, f"identify.sensor.{k}", table)
            if column in sensors:
                key = f"identify.sensor.{k}.column"
                raise InputError(f"{key} = {shown(column)}: stands there twice; take one out", key)
            sensors[column] = knowledge
    faults.refuse()
    return IdentificationPlan(
        tuple(sought.values()),
        {name: known[name][0] for name in sought},
        tuple(runs),
        sensors,
        SensorKnowledge(float(table.noise), float(table.gain)),
        int(table.starts),
        int(table.seed),
    )


def read_watch(form: Any, crank_speed: float, source: str) -> WatchPlan:
    """The plan of a checked table [watch], its `form` with what the file gives.

    Parameters
    ----------
    crank_speed : the speed where the table does not give its own [rad/s]
    source : the study file; other files are named relative to it

    Raises
    ------
    InputError
        with a line for each fault.
    """
    given, usual, faults = given_values(form), instance(WatchTable, {}), Faults()
    if not given.get("file"):
        faults.add([InputError("watch.file: must be given, the recording", "watch.file")])
    begin, end = _part(given, "watch", faults)
    columns: dict[str, str] = {}
    with faults.collected():
        columns = _columns(given, "watch")
    faults.refuse()
    folder, identification = Path(source).parent, given.get("identification")
    numbers = {name: float(given.get(name, getattr(usual, name))) for name in _OF_WATCH}
    return WatchPlan(
        file=folder / given["file"],
        columns=columns,
        crank_speed=float(given.get("crank_speed", crank_speed)),
        begin=begin,
        end=end,
        identification=folder / identification if identification else None,
        **numbers,
    )


_OF_WATCH = ("ambient", "learning", "feed_deviation", "noise", "gain")


def _part(given: Mapping[str, Any], place: str, faults: Faults) -> tuple[float, float]:
    """Begin and end of the part that counts [s]."""
    begin, end = given.get("begin", -math.inf), given.get("end", math.inf)
    if not begin < end:
        faults.add([InputError(f"{place}.end = {end:g} s: must be > begin = {begin:g} s", f"{place}.end")])
    return begin, end


def _columns(given: Mapping[str, Any], place: str) -> dict[str, str]:
    """The heads of columns by quantity."""
    columns, faults = dict[str, str](), Faults()
    for quantity, head in _leaves(given.get("columns", {})):
        key = f"{place}.columns.{quantity}"
        if quantity not in MEASURANDS:
            hint = near_name(quantity, MEASURANDS) or f"; there are {', '.join(MEASURANDS)}"
            faults.add([InputError(f"{key}: no such quantity{hint}", key)])
        elif not isinstance(head, str):
            faults.add([InputError(f"{key} = {shown(head)}: must be the head of its column", key)])
        else:
            columns[quantity] = head
    faults.refuse()
    return columns


def _checked(entry: Any, form: Any, place: str) -> dict[str, Any]:
    """What an entry gives, by key."""
    if not isinstance(entry, Mapping):
        raise InputError(f"{place} = {shown(entry)}: must be a table", place)
    return given_values(read_table(form, entry, f"{place}."))


def _parameter(
    entry: Any, place: str, known: Mapping[str, tuple[Variable, float]], fixed: Mapping[str, str]
) -> Unknown:
    """A sought number, with its bounds and its prior."""
    given = _checked(entry, ParameterEntry, place)
    name = given.get("name", "")
    key = f"{place}.name"
    if not name:
        raise InputError(f'{key}: must be given, such as "machine.left.web_mass"', key)
    if name in fixed:
        raise InputError(f"{key} = {shown(name)}: {fixed[name]}", key)
    if name not in known:
        raise InputError(
            f"{key} = {shown(name)}: must be the full name of a number of the machine (machine.left.web_mass), of "
            f"its feed (feed. ..), or of the motor (motor. ..){near_name(name, known)}",
            key,
        )
    variable, value = known[name]
    q, faults = variable.quantity, Faults()
    ends: dict[str, float] = {"from": q.low, "to": q.high}
    for end in [end for end in ends if end in given]:
        with faults.collected():
            ends[end] = _number(f"{place}.{end}", given[end], variable)
    faults.refuse()
    low, high, unit = ends["from"], ends["to"], unit_behind(variable.unit)
    if not low < high:
        raise InputError(f"{place}.to: must be > from, {low:g}{unit} ({name})", f"{place}.to")
    if "deviation" not in given:
        if not {"from", "to"} <= given.keys():
            raise InputError(
                f"{place} ({name}): must have from and to, or the standard deviation of the value of the study "
                '(deviation = "5 %"), or both',
                place,
            )
        return Unknown.within(name, variable.unit, low, high)
    deviation = _deviation(f"{place}.deviation", given["deviation"], variable, value)
    if not low <= value <= high:
        raise InputError(
            f"{place} ({name}): its value in the study, {value:g}{unit}, must lie between from and to, here from "
            f"{low:g} to {high:g}{unit}, as its deviation is counted from it",
            place,
        )
    return Unknown(name, variable.unit, value, low, high, deviation)


def _deviation(key: str, given: Any, variable: Variable, value: float) -> float:
    """A standard deviation: a number in the unit of the quantity, or a share of the value."""
    parts = split(given) if isinstance(given, str) else None
    if parts is not None and parts[1] == "%":
        deviation = parts[0] / 100.0 * abs(value)
    else:
        kind = "difference" if variable.unit == "K" else ""
        of = Quantity(variable.unit, "standard deviation", low=0.0, open_low=True, kind=kind)
        deviation = _number(key, given, Variable(key, of.description, of))
    if not (math.isfinite(deviation) and deviation > 0.0):
        raise InputError(
            f"{key} = {shown(given)}: must be > 0; a share is one of the value of the study, "
            f"{value:g}{unit_behind(variable.unit)}",
            key,
        )
    return deviation


def _number(key: str, given: Any, variable: Variable) -> float:
    try:
        return to_number(dataclasses.replace(variable, name=key), given)
    except ValueError as error:
        raise InputError(str(error), key) from None


def _run(
    entry: Any,
    place: str,
    k: int,
    crank_speed: float,
    known: Mapping[str, tuple[Variable, float]],
    source: str,
) -> PlannedRun:
    given = _checked(entry, entry_form(RunTable, RUN_KEYS, f"{place}."), place)
    faults, usual = Faults(), instance(RunTable, {})
    name = given.get("name", f"run_{k}")
    if not _NAME.fullmatch(name):
        key = f"{place}.name"
        words = "must begin with a small letter, and have at most 20 small letters, digits and _"
        faults.add([InputError(f"{key} = {shown(name)}: {words}", key)])
    if "file" not in given:
        faults.add([InputError(f"{place}.file: must be given, the recording", f"{place}.file")])
    begin, end = _part(given, place, faults)
    off = float(given["switched_off"]) if "switched_off" in given else None
    if off is not None and not begin < off < end:
        key = f"{place}.switched_off"
        bounds = (("> begin", begin), ("< end", end))
        words = "must be " + " and ".join(f"{word} = {x:g} s" for word, x in bounds if math.isfinite(x))
        faults.add([InputError(f"{key} = {off:g} s: {words}", key)])
    added: dict[str, float] = {}
    for full, value in _leaves(given.get("added", {})):
        key = f"{place}.added.{full}"
        with faults.collected():
            if full not in known:
                raise InputError(f"{key}: no such number of the study{near_name(full, known)}", key)
            of = Quantity(known[full][0].unit, "amount that was added")
            added[full] = _number(key, value, Variable(key, of.description, of))
    speeds: list[tuple[float, float, float]] = []
    with faults.collected():
        speeds = list(_speeds(given.get("speeds", []), f"{place}.speeds"))
    columns: dict[str, str] = {}
    with faults.collected():
        columns = _columns(given, place)
    faults.refuse()
    return PlannedRun(
        name,
        Path(source).parent / given["file"],
        columns,
        float(given.get("crank_speed", crank_speed)),
        begin,
        end,
        float(given.get("ambient", usual.ambient)),
        given.get("feed", "same") == "same",
        added,
        tuple(speeds),
        off,
    )


def _speeds(entries: Sequence[Any], key: str) -> Iterator[tuple[float, float, float]]:
    """The changes of the speed, in order."""
    of = {v.name: v.quantity for v in Layout(RunTable).variables}
    duration = Quantity("s", "duration of the change", low=0.0, open_low=True)
    kinds = (of["begin"], duration, of["crank_speed"])
    end = -math.inf
    for k, entry in enumerate(entries, 1):
        if len(entry) != len(kinds):
            raise InputError(
                f'{key} = {shown(entry)}: must be a list of begin, duration and crank speed, such as ["5 s", "1 s", '
                '"2 rad/s"]',
                key,
            )
        begin, lasts, speed = (
            _number(key, x, Variable(key, q.description, q)) for x, q in zip(entry, kinds, strict=True)
        )
        if begin < end:
            raise InputError(f"{key}: change {k} begins before the one before it ends, at {end:g} s", key)
        end = begin + lasts
        yield begin, lasts, speed


def _leaves(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """The values of nested tables with their full names."""
    for name, value in table.items():
        if isinstance(value, Mapping):
            yield from _leaves(value, f"{prefix}{name}.")
        else:
            yield prefix + name, value


def _sensor(entry: Any, place: str, table: Any) -> tuple[str, SensorKnowledge]:
    given = _checked(entry, entry_form(SensorTable, SENSOR_KEYS, f"{place}."), place)
    column, key = given.get("column", ""), f"{place}.column"
    analog = [name for name, each in MEASURANDS.items() if each.analog]
    if column not in analog:
        words = f"must be one of {', '.join(analog)}{near_name(column, analog)}"
        raise InputError(f"{key} = {shown(column)}: {words}", key)
    numbers, faults = dict[str, float](), Faults()
    for name in ("offset", "resolution"):
        if name in given:
            of = Quantity(MEASURANDS[column].unit, f"{name} of the sensor", low=0.0)
            with faults.collected():
                numbers[name] = _number(f"{place}.{name}", given[name], Variable(name, of.description, of))
    faults.refuse()
    return column, SensorKnowledge(
        float(given.get("noise", table.noise)),
        float(given.get("gain", table.gain)),
        numbers.get("offset"),
        numbers.get("resolution", 0.0),
    )
