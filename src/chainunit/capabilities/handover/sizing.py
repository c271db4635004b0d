"""The numbers of a sized drive by the names of its parts: what sizing.json says, and what it leaves open.

A number has its unit. A value that the study does not know is null, and ``open`` lists its name; a part that the
drive does not have is left out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ... import __version__
from ...core.errors import printable
from ...reading.text import entry
from ...study.record import LOAD_CYCLE
from .rows import text_of
from .studied import StudiedDrive

STUDY, CYCLE, RUN = "study.json", "cycle.csv", "run.csv"
"""Names of the files beside it: the numbers of the study, the steady turns and the whole run."""
_FILES = {
    CYCLE: "the steady turns of the motor's shaft; LoadTorque is the negative of the motor's torque, with the torque "
    "that accelerates the machine",
    RUN: "start-up and steady running, likewise",
    LOAD_CYCLE: "the steady turns with the inertia of the load over the turn",
    STUDY: "all numbers of the study",
}
_LIMITER = "torque limiter"
"""The kind of this part in the list of parts that sizing gives."""
_KELVIN = 273.15
_JOULE_PER_KWH = 3.6e6
_RPM = 30.0 / np.pi
_PERCENT = 100.0

Part = dict[str, Any]
"""A part by the names of its values: texts, and numbers with their units; None for a text that is not known."""


def sizing_of(study: StudiedDrive) -> dict[str, Any]:
    """The content of sizing.json."""
    parts = {
        "application": _application(study),
        "drive": _drive(study),
        "motor": _motor(study),
        "gear": _gear(study),
        "inverter": _inverter(study),
        "flywheel": _flywheel(study),
        "torque_limiter": _torque_limiter(study),
        "flexible_coupling": _flexible_coupling(study),
        "relay": _relay(study),
    }
    parts = {name: part for name, part in parts.items() if part}
    return {
        "chainunit": __version__,
        "title": study.text("title"),
        "project": study.text("report", "project"),
        "author": study.text("report", "author"),
        "revision": study.text("report", "revision"),
        "date": study.dated.isoformat(),
        "source": str(study.result.file),
        **parts,
        "verdict": {name: study.text("verdict", name, "text") for name in ("model", "motor")},
        "messages": [*_messages(study)],
        "files": _FILES,
        "open": [name for name, value in values_of(parts) if not _is_known(value)],
    }


def values_of(sizing: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """The dotted names of the values of all parts, and the values."""
    for name, part in sizing.items():
        if isinstance(part, Mapping) and name not in ("verdict", "files"):
            yield from ((f"{name}.{value}", part[value]) for value in part)


def _is_known(value: Any) -> bool:
    return value is not None and (isinstance(value, str) or value["value"] is not None)


def _percent(share: float | None) -> dict[str, Any]:
    return entry(None if share is None else _PERCENT * share, "%")


def _ratio(value: float | None, limit: float | None) -> float | None:
    return value / limit if value is not None and limit else None


def _degrees(kelvin: float | None) -> dict[str, Any]:
    return entry(None if kelvin is None else kelvin - _KELVIN, "degC")


def _application(study: StudiedDrive) -> Part:
    part = {
        "cycles_per_minute": entry(60.0 / float(study.steady.time[-1]), "1/min"),
        "hours_per_day": entry(study.number("usage", "hours"), "h"),
        "days_per_year": entry(study.number("usage", "days"), "1"),
        "ambient_temperature": _degrees(
            study.number("sizing", "asked", "ambient") or study.number("motor", "ambient.T")
        ),
    }
    # an inverter separates the supply of the motor from the mains
    if study.text("start") in ("direct", "soft"):
        part["mains_voltage"] = entry(study.number("motor", "supply.V"), "V")
        part["mains_frequency"] = entry(study.number("motor", "supply.f"), "Hz")
    return part


def _drive(study: StudiedDrive) -> Part:
    """Inertia and energy of the whole drive; the inertia of the load is the largest over the turn, with gear and
    flywheel, at the motor's shaft."""
    load, rotor = None, study.number("motor", "rotor.J")
    if study.steady.inertia is not None:
        beside = (("gear", "J"), ("flywheel", "J"), ("sizing", "flywheel", "J"))
        load = float(np.max(study.steady.inertia)) + sum(study.number(*path) or 0.0 for path in beside)
    # the mean is known only if the running lasts
    mean = study.number("answers", "steady", "supply_power_mean")
    energy = None if mean is None else mean * float(study.steady.time[-1]) / _JOULE_PER_KWH
    return {
        "load_inertia": entry(load, "kg.m2"),
        "rotor_inertia": entry(rotor, "kg.m2"),
        "inertia_ratio": entry(_ratio(load, rotor), "1"),
        "energy_per_cycle": entry(energy, "kWh"),
    }


def _catalogue_part(designation: str, row: Mapping[str, Any]) -> Part:
    """Designation of a part, and its order number in the row of a catalogue."""
    return {"designation": designation, "order_number": printable(text_of(row, "order_number")) or None}


def _motor(study: StudiedDrive) -> Part:
    def steady(name: str) -> float | None:
        return study.number("answers", "steady", name)

    cycle = study.steady
    rise, ambient = study.check("temperature", "value"), study.number("sizing", "asked", "ambient")
    hottest = steady("winding_temperature") if rise is None or ambient is None else ambient + rise
    heated = study.check("temperature", "utilisation")
    if heated is None:
        heated = study.number("verdict", "motor", "limits", "temperature")
    fastest = float(np.max(np.abs(cycle.speed)))
    taken, returned = _electric(study)
    return {
        **_catalogue_part(study.text("motor", "title"), study.ordered("motor")),
        "torque_rms": entry(steady("motor_torque_rms"), "N.m"),
        "torque_peak": entry(study.check("peak_torque", "value") or steady("motor_torque_peak"), "N.m"),
        "torque_utilisation": _percent(study.check("peak_torque", "utilisation")),
        "current_peak": entry(steady("current_peak"), "A"),
        "current_utilisation": _percent(
            _ratio(steady("current_peak"), study.number("motor", "rated_current"))
        ),
        "winding_temperature": _degrees(hottest),
        "temperature_utilisation": _percent(heated),
        "speed_peak": entry(_RPM * fastest, "rpm"),
        "frequency_at_speed_peak": entry(fastest / (2.0 * np.pi), "Hz"),
        "power_rms": entry(float(np.sqrt(_mean(cycle.time, (cycle.torque * cycle.speed) ** 2))), "W"),
        "power_utilisation": _percent(_ratio(steady("power_mean"), study.number("motor", "rated_power"))),
        "electric_power_taken": entry(taken, "W"),
        "electric_power_returned": entry(returned, "W"),
    }


def _mean(time: np.ndarray, values: np.ndarray) -> float:
    return float(np.trapezoid(values, time) / (time[-1] - time[0]))


def _electric(study: StudiedDrive) -> tuple[float | None, float | None]:
    """The means over the steady turns of the electric power that the motor takes, and of the power that it returns
    [W]."""
    if study.supply_power is None:
        return None, None
    time, power = study.steady.time, study.supply_power
    return _mean(time, np.maximum(power, 0.0)), _mean(time, np.maximum(-power, 0.0))


def _gear(study: StudiedDrive) -> Part:
    ratio = study.number("machine", "ratio")
    if ratio is None or ratio == 1.0:
        return {}
    rated = study.number("sizing", "gear", "rated_torque")
    peak = study.check("gear", "value") or study.number("answers", "steady", "crank_torque_peak")
    return {
        **_catalogue_part(str(study.best.get("gear") or "gear"), study.ordered("gear")),
        "ratio": entry(ratio, "1"),
        **({} if rated is None else {"least_rated_torque": entry(rated, "N.m")}),
        "torque_peak": entry(peak, "N.m"),
        "torque_utilisation": _percent(study.check("gear", "utilisation")),
    }


def _inverter(study: StudiedDrive) -> Part:
    if study.text("start") != "inverter":
        return {}
    return {"order_number": None, "least_rated_current": entry(study.inverter_current, "A")}


def _flywheel(study: StudiedDrive) -> Part:
    inertia = study.number("sizing", "flywheel", "J") or study.number("flywheel", "J")
    return {"inertia": entry(inertia, "kg.m2")} if inertia else {}


def _torque_limiter(study: StudiedDrive) -> Part:
    trip, row = study.number("sizing", "protection", "trip_torque_at_motor"), study.ordered(_LIMITER)
    if not trip:
        return {}
    named = _catalogue_part(printable(text_of(row, "designation")), row) if row else {}
    return {**named, "trip_torque": entry(trip, "N.m")}


def _flexible_coupling(study: StudiedDrive) -> Part:
    row = study.flexible_coupling
    return _catalogue_part(printable(text_of(row, "designation")), row) if row else {}


def _relay(study: StudiedDrive) -> Part:
    current = study.number("sizing", "protection", "relay_current")
    if not current:
        return {}
    trip_class = study.text("sizing", "protection", "relay_class", "value")
    return {
        "type": study.text("sizing", "protection", "device"),
        "setting": entry(current, "A"),
        **({"trip_class": trip_class} if trip_class else {}),
    }


def _messages(study: StudiedDrive) -> Iterator[dict[str, str]]:
    for key, kind in (("warnings", "warning"), ("notes", "note")):
        messages = study.result.data.get(key)
        for message in messages if isinstance(messages, list) else []:
            text = message.get("text") if isinstance(message, dict) else None
            if isinstance(text, str):
                yield {"kind": kind, "text": printable(text, 2000)}
