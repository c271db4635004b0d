"""What a study knows of the elements of the template, in the template's units; nothing else is written.

A required element that the study does not know stands there without a value. A transformation mechanism is left out:
the template has none with a crank or a linkage. The load of such a machine is the motion section with its file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ...core.errors import printable
from ...study.record import LOAD_CYCLE
from .cycle import COLUMNS
from .rows import text_of
from .shell import Content, LinkedFile, TextRange
from .studied import StudiedDrive

STUDY, CYCLE, RUN = "study.json", "cycle.csv", "run.csv"
"""Names of the files beside the shell: the numbers of the study, the steady turns and the whole run."""
MEDIA_TYPES = {STUDY: "application/json", LOAD_CYCLE: "text/csv", CYCLE: "text/csv", RUN: "text/csv"}
"""Media types of these files."""
_SAFETY = "torque limiter"
"""The kind of this part in the list of parts that sizing gives."""
_KELVIN = 273.15
_JOULE_PER_KWH = 3.6e6
_RPM = 30.0 / np.pi
_PERCENT = 100.0


def content_of(study: StudiedDrive) -> Content:
    """What the submodel says on a study."""
    return {
        "SizingProjectInformation": _project(study),
        "ApplicationRequirements": _requirements(study),
        "SizingResult": _known(
            OverallSystem=_system(study),
            MainComponent=[*_components(study)],
            OtherComponent=[*_others(study)],
            Messages={"Message": [*_messages(study)]},
            TextStatement=_statement(study),
        ),
    }


def _known(**values: Any) -> dict[str, Any]:
    """The values that are known; empty lists are none."""
    return {name: value for name, value in values.items() if value is not None and value != []}


def _times(factor: float, value: float | None) -> float | None:
    return None if value is None else factor * value


def _shown(value: float | None, unit: str) -> str:
    return "" if value is None else f"{value:.4g} {unit}"


def _project(study: StudiedDrive) -> Content:
    return {
        "ClientName": None,
        "SizingProjectName": study.text("report", "project") or study.text("title") or None,
        **_known(SizingProjectDescription=study.text("title") or None),
        "SizingProjectLink": [LinkedFile(name, MEDIA_TYPES[name]) for name in (STUDY, LOAD_CYCLE)],
        "SizingToolName": f"chainunit {study.text('chainunit')}",
        "DateCreated": study.dated.isoformat(),
        "DateChanged": study.written.isoformat(),
        "ContactInformation": {},
    }


def _requirements(study: StudiedDrive) -> Content:
    ambient = study.number("sizing", "asked", "ambient") or study.number("motor", "ambient.T")
    warmest = None if ambient is None else TextRange(None, f"{ambient - _KELVIN:.4g}")
    voltage, frequency = study.number("motor", "supply.V"), study.number("motor", "supply.f")
    # behind an inverter the supply of the motor is not the mains
    has_mains = study.text("start") in ("direct", "soft") and voltage and frequency
    mains = f"{voltage:g} V, {frequency:g} Hz" if has_mains else None
    sections = [_section(CYCLE), _section(RUN)]
    return {
        "MotionPattern": {
            **_known(MotionPatternName=study.text("title") or None),
            "MotionPatternSections": {"RotativeSection": sections},
        },
        **({"Environmental": _known(AmbientTemperatureMotor=warmest)} if warmest else {}),
        **({"OverallSystemRequirements": _known(MainsConnection=mains)} if mains else {}),
        "UsageProfile": {
            "CyclesPerMinute": 60.0 / float(study.steady.time[-1]),
            "OperatingHoursPerDay": study.number("usage", "hours"),
            "OperatingDaysPerYear": study.number("usage", "days"),
        },
    }


def _section(file: str) -> Content:
    columns = dict.fromkeys(COLUMNS)
    return {"MetadataRotativeMotionFile": columns, "MotionSectionFile": LinkedFile(file, MEDIA_TYPES[file])}


def _inertias(study: StudiedDrive) -> tuple[float | None, float | None]:
    """The largest inertia of the load over the turn with gear and flywheel, and that of the rotor [kg m2]."""
    load = None if study.steady.inertia is None else float(np.max(study.steady.inertia))
    beside = (
        study.number("gear", "J"),
        study.number("flywheel", "J"),
        study.number("sizing", "flywheel", "J"),
    )
    return None if load is None else load + sum(x or 0.0 for x in beside), study.number("motor", "rotor.J")


def _ratio(study: StudiedDrive) -> float | None:
    load, rotor = _inertias(study)
    return load / rotor if load is not None and rotor else None


def _energy(study: StudiedDrive) -> float | None:
    """Electric energy of one passage of the steady turns [kWh]; None where no mean stands for running that lasts."""
    mean = study.number("answers", "steady", "supply_power_mean")
    return _times(float(study.steady.time[-1]) / _JOULE_PER_KWH, mean)


def _system(study: StudiedDrive) -> Content:
    load, rotor = _inertias(study)
    return _known(
        ExternalMomentOfInertia=load,
        InternalMomentOfIntertia=rotor,
        MassInertiaRatio=_ratio(study),
        EnergyConsumtionPerCycle=_energy(study),
    )


def _order_code(part: Mapping[str, Any]) -> str | None:
    """The order number of a part of a catalogue, if it has one."""
    return printable(text_of(part, "order_number")) or None


def _component(kind: str, designation: str, order_code: str | None, **numbers: float | None) -> Content:
    """A main component. Maker, article and order code are required; a catalogue has the order code alone."""
    return {
        "MainComponentType": kind,
        "ManufacturerName": None,
        "ManufacturerArticleNumber": None,
        "ManufacturerProductDesignation": designation,
        "ManufacturerOrderCode": order_code,
        **_known(**numbers),
    }


def _components(study: StudiedDrive) -> Iterator[Content]:
    yield _motor(study)
    ratio = study.number("machine", "ratio")
    if ratio is not None and ratio != 1.0:
        peak = study.check("gear", "value") or study.number("answers", "steady", "crank_torque_peak")
        parts = [str(study.best.get("gear") or "gear"), f"ratio {ratio:.6g}"]
        rated = study.number("sizing", "gear", "rated_torque")
        if rated is not None:
            parts.append(f"rated output torque at least {_shown(rated, 'Nm')}")
        share = _times(_PERCENT, study.check("gear", "utilisation"))
        names = {"MaxTorqueUtilizationPercentage": share, "MaxTorqueUtilization": peak}
        yield _component("gearbox", ", ".join(parts), _order_code(study.ordered("gear")), **names)
    current = study.inverter_current
    if study.text("start") == "inverter":
        least = f", rated current at least {_shown(current, 'A')}" if current else ""
        yield _component("drive controller", f"inverter{least}", None, ContinuousCurrent=current)


def _motor(study: StudiedDrive) -> Content:
    def steady(name: str) -> float | None:
        return study.number("answers", "steady", name)

    def rated(name: str) -> float | None:
        return study.number("motor", f"rated_{name}")

    def share(value: float | None, of: float | None) -> float | None:
        return _PERCENT * value / of if value is not None and of else None

    rise, ambient = study.check("temperature", "value"), study.number("sizing", "asked", "ambient")
    hottest = steady("winding_temperature") if rise is None or ambient is None else ambient + rise
    used = study.check("temperature", "utilisation")
    if used is None:
        used = study.number("verdict", "motor", "limits", "temperature")
    fastest = float(np.max(np.abs(study.steady.speed)))
    taken, given_back = _electric(study)
    return _component(
        "motor",
        study.text("motor", "title"),
        _order_code(study.ordered("motor")),
        MaxCurrentUtilizationPercentage=share(steady("current_peak"), rated("current")),
        MaxCurrentUtilization=steady("current_peak"),
        MaxThermalUtilizationPercentage=_times(_PERCENT, used),
        MaxThermalUtilization=None if hottest is None else hottest - _KELVIN,
        RmsOfPower=float(np.sqrt(_mean(study.steady.time, (study.steady.torque * study.steady.speed) ** 2))),
        MaxTorqueUtilizationPercentage=_times(_PERCENT, study.check("peak_torque", "utilisation")),
        MaxTorqueUtilization=study.check("peak_torque", "value") or steady("motor_torque_peak"),
        MaxRotationSpeedUtilization=_RPM * fastest,
        EffectiveUtilization=share(steady("power_mean"), rated("power")),
        MassInertiaRatio=_ratio(study),
        FrequencyAtMaxSpeed=fastest / (2.0 * np.pi),
        PowerInRegenerativeOperation=given_back,
        PowerInMotorOperation=taken,
        RmsOfMotorTorque=steady("motor_torque_rms"),
        EnergyConsumtionPerCycle=_energy(study),
    )


def _mean(time: np.ndarray, values: np.ndarray) -> float:
    return float(np.trapezoid(values, time) / (time[-1] - time[0]))


def _electric(study: StudiedDrive) -> tuple[float | None, float | None]:
    """The means over the steady turns of the electric power that the motor takes, and of that which it gives back
    [W]."""
    if study.supply_power is None:
        return None, None
    time, power = study.steady.time, study.supply_power
    return _mean(time, np.maximum(power, 0.0)), _mean(time, np.maximum(-power, 0.0))


def _others(study: StudiedDrive) -> Iterator[Content]:
    wheel = study.number("sizing", "flywheel", "J") or study.number("flywheel", "J")
    if wheel:
        yield _part(f"flywheel of {_shown(wheel, 'kg m2')} on the motor shaft")
    trip = study.number("sizing", "protection", "trip_torque_at_motor")
    if trip:
        name = " ".join(filter(None, (_SAFETY, printable(text_of(study.ordered(_SAFETY), "designation")))))
        words = f"{name}, trip torque {_shown(trip, 'Nm')} at the motor's shaft"
        yield _part(words, _order_code(study.ordered(_SAFETY)))
    if flexible := study.flexible_coupling:
        yield _part(f"flexible coupling {printable(text_of(flexible, 'designation'))}", _order_code(flexible))
    relay = study.number("sizing", "protection", "relay_current")
    if relay:
        device = study.text("sizing", "protection", "device")
        trip_class = study.text("sizing", "protection", "relay_class", "value")
        yield _part(", ".join(filter(None, (device, f"set at {_shown(relay, 'A')}", trip_class))))


def _part(designation: str, order_code: str | None = None) -> Content:
    return {
        "ManufacturerProductDesignation": designation,
        **_known(ManufacturerOrderCode=order_code),
        "QuantityOfParts": 1,
    }


def _messages(study: StudiedDrive) -> Iterator[Content]:
    for key, word in (("warnings", "warning"), ("notes", "note")):
        found = study.result.data.get(key)
        for each in found if isinstance(found, list) else []:
            text = each.get("text") if isinstance(each, dict) else None
            if isinstance(text, str):
                yield {"CriticalityOfMessage": word, "MessageText": text}


def _statement(study: StudiedDrive) -> str:
    labels = (("author", "Author"), ("revision", "Revision"))
    said = [f"{word}: {study.text('report', key)}." for key, word in labels if study.text("report", key)]
    said += [study.text("verdict", subject, "text") for subject in ("model", "motor")]
    said.append(
        "Motion, load and inertia are those of the motor's shaft, in front of the gear. LoadTorque holds the torque "
        "that accelerates the machine, whose inertia changes over the turn (load_cycle.csv); ExternalMomentOfInertia "
        "is the largest over the turn, with gear and flywheel. A whole number of the template that differs by more "
        "than 0.5 % from the number itself is left out; the extension ExactValue has the number."
    )
    return " ".join(filter(None, said))
