"""Checks of values of a study file that contradict each other."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from ..errors import InputError, shown
from ..quantities import Layout
from ..refusals import unit_behind
from .foreign_machine import ForeignModel
from .parts import Parts, named_table

_NEEDS_MODEL = "needs a model of the machine, which is an FMU; leave it out"
_TWO_BARS = 'quantities of a turn are of organs with two bars; leave out organ = "chain"'


def check_company(data: Mapping[str, Any], parts: Parts) -> list[InputError]:
    """Refusals of values that would otherwise be ignored without a word."""
    return [InputError(f"{key}: {words}", key=key) for key, words in _company(data, parts)]


def _company(data: Mapping[str, Any], parts: Parts) -> Iterator[tuple[str, str]]:
    """Pairs of a refused key and the reason."""
    motor = data.get("system", {}).get("motor")
    if data.get("system") == {}:
        yield ("system", 'names nothing; add motor = "file.fmu", or leave [system] out')
    foreign = {"motor": bool(parts.file), "machine": issubclass(parts.machine, ForeignModel)}
    for part, is_foreign in foreign.items():
        if f"{part}_names" in data.get("system", {}) and not is_foreign:
            yield (
                f"system.{part}_names",
                f'are of an FMU of somebody else; add {part} = "file.fmu", or leave them out',
            )
    if foreign["machine"] and data.get("feed_forward"):
        yield ("feed_forward", _NEEDS_MODEL)
    has_torque_input = foreign["motor"] or "sizing" in data or "tau_ff" in parts.motor.input_layout.names
    if data.get("feed_forward") and not has_torque_input:
        yield (
            "feed_forward",
            f"a motor of the type {parts.motor.name} has no input for the torque; leave it out",
        )
    if foreign["machine"] and named_table(data, "monte_carlo").get("runs"):
        yield ("monte_carlo.runs", _NEEDS_MODEL)
    if motor is not None:
        for name in ("motor", "sizing"):
            if name in data and not (name == "motor" and parts.gives_motor):
                yield (
                    name,
                    f"given beside system.motor = {shown(motor)}, which is the motor; leave out one of "
                    "the two",
                )
    if not parts.machine.sides:
        for name in ("ratios", "chain", "organ"):
            if name in data:
                yield (
                    name,
                    f"is of the chain unit, and the machine is {parts.machine.name}; leave it out",
                )
        if "one_sided_share" in data.get("sizing", {}):
            yield ("sizing.one_sided_share", f"the {parts.machine.name} has no sides; leave it out")
    if "sizing" in data:
        for name in ("motor", "feed_forward", "flywheel"):
            if data.get(name):
                words = (
                    "sizing finds its own"
                    if name == "flywheel"
                    else "is of the DC motor, and [sizing] picks another"
                )
                yield (name, f"{words}; leave out one of the two")
        if "winding_temperature" in data.get("run", {}):
            yield ("run.winding_temperature", "is sizing.temperature with [sizing]; leave it out")
        if "ratio" in data.get("machine", {}):
            yield ("machine.ratio", "[sizing] finds it; to have it kept, give gear.ratio")
    elif not parts.designation:
        for name in ("gear", "start", "starter", "catalogue"):
            if name in data:
                yield (
                    name,
                    "is of a motor of the catalogue; add [sizing] or system.motor, or leave it out",
                )
    elif "ratio" in data.get("machine", {}):
        yield ("machine.ratio", "follows from the motor's rated speed; to have another, give gear.ratio")
    if "sweep" in data:
        yield from _sweep_company(data, foreign)
    if "optimize" in data:
        if foreign["machine"]:
            yield ("optimize", _NEEDS_MODEL)
        if data.get("organ") == "chain":
            yield ("optimize", _TWO_BARS)
    for name in ("identify", "watch"):
        if name in data:
            yield from ((name, words) for words in _unfit_for_recordings(data, foreign))
    if "watch" in data and not parts.machine.sides:
        yield (
            "watch",
            f"is of the chain unit, and the machine is {parts.machine.name}: the observer compares the feed and the "
            "force of two sides, which this machine does not have; leave it out. chainunit identify finds the loads "
            "of this machine from its recordings",
        )
    if "observer" in data:
        yield from (("observer", words) for words in _unfit_for_observer(data, parts, foreign))
    if "torsion" in data and "driveline" not in data:
        yield ("torsion", "is of a driveline; add [driveline], or leave it out")
    if "chain" in data and data.get("organ") != "chain":
        yield ("chain", 'is of organs that are chains; add organ = "chain", or leave it out')


def _unfit_for_recordings(data: Mapping[str, Any], foreign: Mapping[str, bool]) -> Iterator[str]:
    """Reasons why the drive of a study cannot be compared with recordings."""
    unfit = {
        "machine": foreign["machine"] and "machine is an FMU",
        "motor": foreign["motor"] and "motor is an FMU",
        "sizing": "sizing" in data and "motor is not known before it is chosen",
        "driveline": "driveline" in data and "driveline stands between motor and machine",
        "organ": data.get("organ") == "chain" and "organs are chains",
    }
    for words in filter(None, unfit.values()):
        yield f"needs a motor and a machine of two-bar organs as models, and here the {words}"


def _unfit_for_observer(data: Mapping[str, Any], parts: Parts, foreign: Mapping[str, bool]) -> Iterator[str]:
    """Reasons why an observer cannot know the drive of a study."""
    if not parts.machine.sides:
        machine = "an FMU" if foreign["machine"] else parts.machine.name
        yield f"knows the chain unit, and the machine is {machine}; leave it out"
    if foreign["motor"]:
        yield "needs a model of the motor, which is an FMU; leave it out"
    if "driveline" in data:
        yield "takes the shaft between motor and machine for rigid; leave out [driveline] or [observer]"


def _sweep_company(data: Mapping[str, Any], foreign: Mapping[str, bool]) -> Iterator[tuple[str, str]]:
    """Pairs of a refused key and the reason, of a study with a sweep; `foreign` tells whether motor and machine are
    FMUs."""
    if foreign["machine"]:
        yield ("sweep", _NEEDS_MODEL)
    if "sizing" in data:
        yield ("sweep", "varies one drive, and [sizing] tries many; leave out one of the two")
    measures = named_table(data, "sweep").get("measures")
    if isinstance(measures, list) and "coupling_trip_time" in measures and "coupling" not in data:
        yield (
            "sweep.measures",
            "coupling_trip_time is of a safety coupling; add [coupling], or leave it out",
        )
    if measures and foreign["motor"]:
        yield ("sweep.measures", "need a model of the motor, which is an FMU; leave them out")
    if named_table(data, "sweep").get("quantities") and data.get("organ") == "chain":
        yield ("sweep.quantities", f"{_TWO_BARS}, or give measures")


_ORDER = (
    ("sizing.poles_least", ">=", "sizing.poles_most"),
    ("sizing.ambient", ">", "sizing.temperature"),
    ("chain.sweep_lowest", ">", "chain.sweep_highest"),
    ("torsion.slowest", ">", "torsion.fastest"),
    ("torsion.bend_low", ">", "torsion.bend_high"),
)
"""Triples (low, relation, high): the value of `high` has to have this relation to that of `low`."""
LOWER_LIMITS = {high: low for low, _, high in _ORDER}


def check_order(values: Mapping[str, Any]) -> Iterator[InputError]:
    """Refusals of limits with no value between them."""

    def value(name: str) -> tuple[float, str]:
        section, _, key = name.partition(".")
        x, declaration = getattr(values[section], key), type(values[section])
        unit = next(v.unit for v in Layout(declaration).variables if v.name == key)
        return x, f"{x:g}" + unit_behind(unit)

    for low, relation, high in _ORDER:
        (least, limit), (most, text) = value(low), value(high)
        if most < least or (most == least and relation == ">"):
            yield InputError(f"{high} = {text}: must be {relation} {low}, {limit}", key=high)
