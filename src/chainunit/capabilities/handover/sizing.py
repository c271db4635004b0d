"""The numbers of a sized drive by the names of its parts: what sizing.json says, and what it leaves open.

A number has its unit. A value that the study does not know is null, and ``open`` lists its name; a part that the
drive does not have is left out."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import suppress
from datetime import UTC, date, datetime, time
from typing import Any

import numpy as np

from ... import __version__
from ...core.errors import printable
from ...core.quantities import finite
from ...reading.results import GIVEN, InUnit, part, result
from ...study.line.flywheel import MOTOR
from ...study.line.slipping import SlippingPart
from ...study.record import LOAD_CYCLE
from ...study.registry import parts_of_line
from .studied import StudiedDrive
from .tables import text_of

STUDY, CYCLE, RUN = "study.json", "cycle.csv", "run.csv"
"""Names of the files beside it: the numbers of the study, the steady turns and the whole run."""
_FILES = {
    CYCLE: "the steady turns of the motor's shaft; LoadTorque is the negative of the motor's torque, with the torque "
    "that accelerates the machine",
    RUN: "start-up and steady running, likewise",
    LOAD_CYCLE: "the steady turns with the inertia of the load over the turn",
    STUDY: "all numbers of the study",
}
_FROM_SI = {"degC": (1.0, -273.15), "%": (100.0, 0.0), "rpm": (30.0 / np.pi, 0.0), "kWh": (1.0 / 3.6e6, 0.0)}
"""Factor and offset of the units of sizing.json that no result has."""
Value = tuple[str, str, float | str | None]
"""A value of the drive: part and name, its unit in sizing.json, and its number in the unit of the result. A text has
no unit."""
Parts = Mapping[str, Mapping[str, InUnit | str | None]]
"""By part of the drive and name, its values."""


@result
class Message:
    """A warning or a note of the study."""

    kind: str = part("warning or note")
    text: str = part("the sentences")


@result
class HandedDrive:
    """The numbers of a sized drive: the content of sizing.json."""

    chainunit: str = part("version of chainunit")
    title: str = part("title of the study")
    project: str = part("its project")
    author: str = part("its author")
    revision: str = part("its revision")
    date: str = part("its date")
    source: str = part("its result")
    parts: Parts = part("the values by the parts of the drive", unit=GIVEN, inline=True)
    verdict: Mapping[str, str] = part("the verdicts on model and motor")
    messages: list[Message] = part("warnings and notes")
    files: Mapping[str, str] = part("what the files beside it say")
    open: list[str] = part("names of the values that the study does not know")


def sizing_of(study: StudiedDrive) -> HandedDrive:
    """The numbers of the drive of a study."""
    parts: dict[str, dict[str, InUnit | str | None]] = {}
    for name, unit, value in _values(study):
        drive_part, _, key = name.partition(".")
        factor, offset = _FROM_SI.get(unit, (1.0, 0.0))
        size = factor * value + offset if isinstance(value, float) else None
        text = value if isinstance(value, str) else None
        parts.setdefault(drive_part, {})[key] = InUnit(size, unit) if unit else text
    written = datetime.fromtimestamp(int(study.result.file.stat().st_mtime), UTC)
    with suppress(ValueError):  # of a study without a date in ISO 8601
        written = datetime.combine(date.fromisoformat(study.text("report/date")), time(), UTC)
    return HandedDrive(
        __version__,
        study.text("title"),
        study.text("report/project"),
        study.text("report/author"),
        study.text("report/revision"),
        written.isoformat(),
        str(study.result.file),
        parts,
        {name: study.text(f"verdict/{name}/text") for name in ("model", "motor")},
        [
            Message(kind, printable(message["text"], 2000))
            for kind in ("warning", "note")
            for message in study.rows(f"{kind}s")
            if isinstance(message.get("text"), str)
        ],
        _FILES,
        [
            name
            for name, value in by_name(parts)
            if value is None or (isinstance(value, InUnit) and finite(value.value) is None)
        ],
    )


def by_name(parts: Parts) -> Iterator[tuple[str, InUnit | str | None]]:
    """The dotted names of the values of all parts, and the values."""
    return ((f"{name}.{key}", value) for name, values in parts.items() for key, value in values.items())


def largest_load_inertia(study: StudiedDrive) -> float:
    """The largest inertia of the load over the turn, with gear and flywheel, at the motor's shaft [kg m2]. That of
    the machine has a flywheel on another shaft already, and a gear behind a part that slips."""
    slipping = [part.name for part in parts_of_line() if isinstance(part, SlippingPart)]
    paths = () if any(name in study.result.data for name in slipping) else ("gear/J",)
    if study.text("flywheel/place") in ("", MOTOR):
        paths = (*paths, "flywheel/J", "sizing/flywheel/J")
    return float(np.max(study.inertia)) + sum(study.number(path) or 0.0 for path in paths)


def _values(study: StudiedDrive) -> Iterator[Value]:
    """All values by the parts of the drive."""
    number, text, time = study.number, study.text, study.steady.time
    steady, check = "answers/steady/", "sizing/candidates/0/checks/"
    period, speed = float(time[-1]), study.steady.speed
    fastest = float(np.max(np.abs(speed)))
    ambient = number("sizing/asked/ambient")
    yield "application.cycles_per_minute", "1/min", 60.0 / period
    yield "application.hours_per_day", "h", number("usage/hours")
    yield "application.days_per_year", "1", number("usage/days")
    yield "application.ambient_temperature", "degC", ambient or number("motor/ambient.T")
    # an inverter separates the supply of the motor from the mains
    if text("start") in ("direct", "soft"):
        yield "application.mains_voltage", "V", number("motor/supply.V")
        yield "application.mains_frequency", "Hz", number("motor/supply.f")

    load, rotor = largest_load_inertia(study), number("motor/rotor.J")
    mean = number(f"{steady}supply_power_mean")  # known only if the running lasts
    yield "drive.load_inertia", "kg.m2", load
    yield "drive.rotor_inertia", "kg.m2", rotor
    yield "drive.inertia_ratio", "1", _ratio(load, rotor)
    yield "drive.energy_per_cycle", "kWh", None if mean is None else mean * period

    rise, hottest = number(f"{check}temperature/value"), number(f"{steady}winding_temperature")
    if rise is not None and ambient is not None:
        hottest = ambient + rise
    heated = number(f"{check}temperature/utilisation", "verdict/motor/limits/temperature")
    current = number(f"{steady}current_peak")
    yield from _catalogue_part("motor", text("motor/title"), study.ordered("motor"))
    yield "motor.torque_rms", "N.m", number(f"{steady}motor_torque_rms")
    yield "motor.torque_peak", "N.m", number(f"{check}peak_torque/value", f"{steady}motor_torque_peak")
    yield "motor.torque_utilisation", "%", number(f"{check}peak_torque/utilisation")
    yield "motor.current_peak", "A", current
    yield "motor.current_utilisation", "%", _ratio(current, number("motor/rated_current"))
    yield "motor.winding_temperature", "degC", hottest
    yield "motor.temperature_utilisation", "%", heated
    yield "motor.speed_peak", "rpm", fastest
    yield "motor.frequency_at_speed_peak", "Hz", fastest / (2.0 * np.pi)
    yield "motor.power_rms", "W", math.sqrt(np.trapezoid((study.steady.torque * speed) ** 2, time) / period)
    power_mean = number(f"{steady}power_mean")
    yield "motor.power_utilisation", "%", _ratio(power_mean, number("motor/rated_power"))
    for name, sign in (("taken", 1.0), ("returned", -1.0)):
        power = study.supply_power
        part = None if power is None else float(np.trapezoid(np.maximum(sign * power, 0.0), time) / period)
        yield f"motor.electric_power_{name}", "W", part

    ratio, rated = number("machine/ratio"), number("sizing/gear/rated_torque")
    if ratio is not None and ratio != 1.0:
        designation = text("sizing/candidates/0/gear") or "gear"
        yield from _catalogue_part("gear", designation, study.ordered("gear"))
        yield "gear.ratio", "1", ratio
        if rated is not None:
            yield "gear.least_rated_torque", "N.m", rated
        yield "gear.torque_peak", "N.m", number(f"{check}gear/value", f"{steady}crank_torque_peak")
        yield "gear.torque_utilisation", "%", number(f"{check}gear/utilisation")
    if text("start") == "inverter":
        yield "inverter.order_number", "", None
        yield "inverter.least_rated_current", "A", number("sizing/inverter/rated_current")
    if inertia := number("sizing/flywheel/J", "flywheel/J"):
        yield "flywheel.inertia", "kg.m2", inertia
    if trip := number("sizing/protection/trip_torque_at_motor"):
        if row := study.ordered("torque limiter"):
            yield from _catalogue_part("torque_limiter", text_of(row, "designation"), row)
        yield "torque_limiter.trip_torque", "N.m", trip
    for row in study.rows("checks/flexible_coupling/candidates")[:1]:
        if row.get("verdict") == "chosen":
            yield from _catalogue_part("flexible_coupling", text_of(row, "designation"), row)
    if setting := number("sizing/protection/relay_current"):
        yield "relay.type", "", text("sizing/protection/device")
        yield "relay.setting", "A", setting
        if trip_class := text("sizing/protection/relay_class/value"):
            yield "relay.trip_class", "", trip_class


def _catalogue_part(part: str, designation: str, row: Mapping[str, Any]) -> Iterator[Value]:
    """Designation of a part, and its order number in the row of a catalogue."""
    yield f"{part}.designation", "", printable(designation)
    yield f"{part}.order_number", "", printable(text_of(row, "order_number")) or None


def _ratio(value: float | None, limit: float | None) -> float | None:
    return value / limit if value is not None and limit else None
