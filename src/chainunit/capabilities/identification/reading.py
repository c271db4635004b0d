"""The reader of the table [identify]: its entries against the quantities of the study, as an `IdentificationPlan`."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Iterator, Mapping

from ...core.errors import Faults, InputError, near_name
from ...core.messages import unit_behind
from ...core.quantities import Variable, named_values, plain_variable, variable_of
from ...core.units import split
from ...reading.lists import Entry, leaves
from ...recordings.measurands import MEASURANDS
from ...recordings.table import PlannedRecording, read_span, recording_values
from ...recordings.unknown import Unknown
from ...study.config import FileReading
from .table import RUNS, SENSORS, SOUGHT, IdentifyTable, RunTable

_NAME = re.compile(r"[a-z][a-z0-9_]{0,19}")
_FIXED = {"mark": "stands for the mark of a turn; give it another"}
"""Names that no run may have, each with the reason."""
_KNOWN = {"machine.ratio": "is needed to read the recordings; count the teeth"}
"""Numbers that cannot be sought, each with the reason."""
_ANALOG = [name for name, measurand in MEASURANDS.items() if measurand.analog]


@dataclasses.dataclass(frozen=True)
class SensorKnowledge:
    """The knowledge of a sensor: noise in parts of the RMS of its column, standard deviation of its gain, and, in the
    unit of the column, the standard deviation of its offset (None: the usual one) and the step of its converter."""

    noise: float
    gain: float
    offset: float | None = None
    resolution: float = 0.0


@dataclasses.dataclass(frozen=True)
class PlannedRun(PlannedRecording):
    """A recording of the plan: its name, whether it has the feed that is sought, and the amounts that were `added` to
    sought numbers by their full names; the changes of the crank speed (begin and duration [s], speed after it
    [rad/s]), and the time at which the motor is switched off [s], or None."""

    name: str
    has_feed: bool
    added: Mapping[str, float]
    speeds: tuple[tuple[float, float, float], ...] = ()
    off: float | None = None


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


def read_identification(reading: FileReading) -> IdentificationPlan | None:
    """The plan of a study with a checked table [identify]; None for a machine that was refused.

    Raises
    ------
    InputError
        with a line for each fault: the key, its value and the allowed range.
    """
    if reading.machine is None:
        return None
    form, table = reading.form.identify, reading.values["identify"]
    crank_speed, faults = reading.values["run"].crank_speed, Faults()
    declared = {"machine": reading.machine.p, "feed": reading.values["feed"]}
    if reading.parts.gives_motor:
        declared["motor"] = reading.values["motor"]
    numbers = {v.name: (v, value) for name, p in declared.items() for v, value in named_values(p, f"{name}.")}

    def read_run(entry: Entry, name: str) -> PlannedRun:
        """A run; an amount may be added to sought numbers alone."""
        run = _run(entry, name, crank_speed, numbers, reading.source)
        for other in sorted(run.added.keys() - sought.keys()) if not faults.errors else ():
            entry.fault(f"added.{other}", "is not sought; add [[identify.parameter]] with this name")
        return run

    sought = SOUGHT.read(
        form.parameter, faults, lambda entry, name: _sought(entry, name, *numbers[name]), numbers, _KNOWN
    )
    for name, meaning in (("parameter", "a number that is sought"), ("run", "a recording")):
        if not getattr(form, name):
            key = f"identify.{name}"
            faults.add([InputError(f"{key}: is missing; add [[{key}]] with {meaning}", key)])
    runs = RUNS.read(form.run, faults, read_run, fixed=_FIXED, usual="run_")
    sensors = SENSORS.read(form.sensor, faults, lambda entry, column: _sensor(entry, column, table), _ANALOG)
    faults.refuse()
    return IdentificationPlan(
        sought=tuple(sought.values()),
        variables={name: numbers[name][0] for name in sought},
        runs=tuple(runs.values()),
        sensors=sensors,
        usual=SensorKnowledge(float(table.noise), float(table.gain)),
        starts=int(table.starts),
        seed=int(table.seed),
    )


def _sought(entry: Entry, name: str, variable: Variable, value: float) -> Unknown:
    """A sought number, with its bounds and its prior."""
    content, q, place = entry.given, variable.quantity, entry.place
    low = entry.quantity("from", variable, content["from"]) if "from" in content else q.low
    high = entry.quantity("to", variable, content["to"]) if "to" in content else q.high
    entry.refuse()
    unit = unit_behind(variable.unit)
    if not low < high:
        entry.fault("to", f"must be > from, {low:g}{unit} ({name})")
    elif "deviation" in content:
        deviation = _deviation(entry, variable, value)
        if not low <= value <= high:
            line = (
                f"{place} ({name}): its value in the study, {value:g}{unit}, must lie between from and to, here from "
                f"{low:g} to {high:g}{unit}, as its deviation is counted from it"
            )
            raise InputError(line, place)
        return Unknown(name, variable.unit, value, low, high, deviation)
    elif not {"from", "to"} <= content.keys():
        line = (
            f"{place} ({name}): must have from and to, or the standard deviation of the value of the study "
            '(deviation = "5 %"), or both'
        )
        raise InputError(line, place)
    return Unknown.within(name, variable.unit, low, high)


def _deviation(entry: Entry, variable: Variable, value: float) -> float:
    """A standard deviation: a number in the unit of the quantity, or a share of the value."""
    stated = entry.given["deviation"]
    parts = split(stated) if isinstance(stated, str) else None
    if parts is not None and parts[1] == "%":
        deviation = parts[0] / 100.0 * abs(value)
    else:
        kind = "difference" if variable.unit == "K" else ""
        positive = plain_variable("", variable.unit, "standard deviation", low=0.0, open_low=True, kind=kind)
        deviation = entry.quantity("deviation", positive, stated)
        entry.refuse()
    if not (math.isfinite(deviation) and deviation > 0.0):
        share = f"{value:g}{unit_behind(variable.unit)}"
        entry.wrong("deviation", stated, f"must be > 0; a share is one of the value of the study, {share}")
        entry.refuse()
    return deviation


def _run(
    entry: Entry, name: str, crank_speed: float, numbers: Mapping[str, tuple[Variable, float]], source: str
) -> PlannedRun:
    """A run of the file; `numbers` are the numbers of the study to which a run may add, by their full names."""
    content = entry.given
    if not _NAME.fullmatch(name):
        reason = "must begin with a small letter, and have at most 20 small letters, digits and _"
        entry.wrong("name", name, reason)
    if "file" not in content:
        entry.fault("file", "must be given, the recording")
    begin, end = read_span(entry)
    off = float(content["switched_off"]) if "switched_off" in content else None
    if off is not None and not begin < off < end:
        bounds = (("> begin", begin), ("< end", end))
        reason = "must be " + " and ".join(f"{word} = {x:g} s" for word, x in bounds if math.isfinite(x))
        key = entry.key("switched_off")
        entry.add([InputError(f"{key} = {off:g} s: {reason}", key)])
    added: dict[str, float] = {}
    for full, value in leaves(content.get("added", {})):
        if full not in numbers:
            entry.fault(f"added.{full}", f"no such number of the study{near_name(full, numbers)}")
            continue
        amount = plain_variable("", numbers[full][0].unit, "amount that was added")
        added[full] = entry.quantity(f"added.{full}", amount, value)
    speeds = tuple(_speeds(entry))
    values = recording_values(entry, crank_speed, source)
    return PlannedRun(
        **values,
        name=name,
        has_feed=content.get("feed", "same") == "same",
        added=added,
        speeds=speeds,
        off=off,
    )


def _speeds(entry: Entry) -> Iterator[tuple[float, float, float]]:
    """The changes of the speed, in order."""
    begin_time, speed_then = (variable_of(RunTable, name) for name in ("begin", "crank_speed"))
    duration = plain_variable("", "s", "duration of the change", low=0.0, open_low=True)
    kinds = (begin_time, duration, speed_then)
    end = -math.inf
    for k, change in enumerate(entry.given.get("speeds", []), 1):
        if len(change) != len(kinds):
            reason = 'must be a list of begin, duration and crank speed, such as ["5 s", "1 s", "2 rad/s"]'
            entry.wrong("speeds", change, reason)
            continue
        begin, lasts, speed = (entry.quantity("speeds", v, x) for x, v in zip(change, kinds, strict=True))
        if begin < end:
            entry.fault("speeds", f"change {k} begins before the one before it ends, at {end:g} s")
        end = begin + lasts
        yield begin, lasts, speed


def _sensor(entry: Entry, column: str, table: IdentifyTable) -> SensorKnowledge:
    """What the file says of the sensor of a column; the `table` has the noise and the gain of all others."""
    content, numbers = entry.given, dict[str, float]()
    for name in ("offset", "resolution"):
        if name in content:
            size = plain_variable("", MEASURANDS[column].unit, f"{name} of the sensor", low=0.0)
            numbers[name] = entry.quantity(name, size, content[name])
    return SensorKnowledge(
        float(content.get("noise", table.noise)),
        float(content.get("gain", table.gain)),
        numbers.get("offset"),
        numbers.get("resolution", 0.0),
    )
