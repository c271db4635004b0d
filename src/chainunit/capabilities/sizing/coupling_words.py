"""The sentences on the torque limiter of a sized drive, and on the ways to another."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ...core.descriptions import of_driver
from ...core.quantities import variables
from ...reading.text import aside, number
from ...study.coupling import (
    LESS_TORQUE,
    TRIPS_IN_TRANSIENT,
    hardest_start,
    transient_of_starts,
)
from ...study.drive import Drive
from ...study.record import StudyRecord, StudyRuns
from ...study.sections import Coupling
from ...study.starts import transient_words
from ...study.torques import running_peak, running_words
from .protection import MARGIN, Alternative, CouplingEffect, Obstacle, Setting, Way, WayNumbers, spares


def _torque(value: float) -> str:
    return number(value, "N.m")


def _at_both(drive: Drive, value: float) -> str:
    """A torque at the crank, and at the motor's shaft, on which the coupling sits."""
    at_motor = _torque(drive.at_motor_shaft(value))
    return f"{_torque(value)} at the {drive.driver_noun}, {at_motor} at the motor's shaft"


def _list_of(runs: StudyRuns, peaks: Mapping[str, float]) -> str:
    """A list of runs with their peaks on the coupling [N m], in words."""
    return ", ".join(f"{runs.title_of(name)} ({_torque(peak)})" for name, peak in peaks.items())


_OBSTACLES = {
    Obstacle.START: "No torque limiter: {start} needs a setting of {least} ({start_torque} by load and "
    "acceleration); {bound}. For running alone {least_in_running} would do.",
    Obstacle.MOTOR: "No torque limiter: it has to open above {above}; the warm motor gives at most {motor} at the "
    "{driver}.",
    Obstacle.GEAR: "No torque limiter: it has to open above {above}; the gear may carry {gear} in running.",
    Obstacle.OVERLOADS: "No torque limiter: it has to open above {above}; {bound}.",
    Obstacle.RELEASE: "No torque limiter: one that opens at {setting}, opens too late. The largest "
    "torques until no torque passes it, {release} after its trip: {effects}. That saves nothing.",
    Obstacle.ENERGY: "No torque limiter: the energy balance is not kept in {wrong}, so that no "
    "setting follows from its numbers.",
}
"""By obstacle, the sentence on it."""


_REASONS = {
    Obstacle.START: "a start loads it with {start}",
    Obstacle.MOTOR: "the warm motor gives {motor} at most",
    Obstacle.GEAR: "the gear may carry {gear} in running",
    Obstacle.OVERLOADS: "no overload of this study would open it",
    Obstacle.RELEASE: "it opens too late",
    Obstacle.ENERGY: "the energy balance of its runs is not kept",
}
"""By obstacle, a few words on it."""


def why_none(setting: Setting) -> str:
    """A few words on the reason why no coupling is recommended; empty where one is."""
    if setting.obstacle is None:
        return ""
    return _REASONS[setting.obstacle].format(
        start=_torque(setting.start), motor=_torque(setting.motor), gear=_torque(setting.gear)
    )


def coupling_sentence(study: StudyRecord, setting: Setting, alternatives: Sequence[Alternative] = ()) -> str:
    """A sentence on the recommended torque limiter of a sized drive and its effect in the overloads, or on
    the reason why no coupling protects the drive."""
    caveat = aside(study.findings.verdict.caveat if study.findings.verdict else None)
    hardest, running = hardest_start(study), running_peak(study)
    start = hardest.named(study.runs)
    by = " by load and acceleration" if setting.is_of_start else ""
    cause = f"that {start}" if setting.is_of_start else f"that {running_words(study.runs, running.run)}"
    above = f"{_torque(setting.least)}, {MARGIN:g} times the {_torque(setting.normal)} {cause} puts on it{by}"
    torque = _at_both(study.setup.drive, setting.least)
    if setting.obstacle is not None:
        return of_driver(_OBSTACLES[setting.obstacle], study.setup.driver_noun).format(
            start=start,
            setting=torque,
            release=number(Coupling().release_time, "s"),
            effects=_effects(study.runs, setting.effects),
            wrong=", ".join(map(study.runs.title_of, setting.wrong)),
            start_torque=_torque(hardest.torque),
            least=_torque(setting.least),
            least_in_running=_torque(setting.least_in_running),
            above=above,
            motor=_torque(setting.motor),
            gear=_torque(setting.gear),
            bound=_bound(study.runs, setting),
        )
    shut = {name: peak for name, peak in setting.overloads.items() if name not in setting.opens}
    less = number(LESS_TORQUE, "1", "percent", full=False)
    text = (
        f"Recommended torque limiter{caveat}: {torque}; this is {MARGIN:g} times the "
        f"{_torque(setting.normal)} {cause} puts on it{by}; the warm motor gives {_torque(setting.motor)} at the "
        f"{study.setup.driver_noun}, and may give {less} less by IEC 60034-1. It opens where "
        f"{_effects(study.runs, setting.effects)}"
    )
    text += f"; it stays shut where {_list_of(study.runs, shut)}." if shut else "."
    text += _transient(study, setting) + _too_late(study.runs, setting, alternatives)
    if setting.wrong:
        names = ", ".join(map(study.runs.title_of, setting.wrong))
        text += f" Left out, as the energy balance is not kept: {names}."
    if setting.stalls:
        text += " A load that rises slowly may stall the motor and not open it: the relay has to trip there."
    if setting.nuisances:
        nuisances = _list_of(study.runs, setting.nuisances)
        text += f" A nuisance trip, which protects nothing: it opens, too, where {nuisances}."
    if setting.start_decides:
        text += f" For running alone {_torque(setting.least_in_running)} would do."
    return text


def _transient(study: StudyRecord, setting: Setting) -> str:
    """A sentence on the electromagnetic transient of a start, if it puts more on the coupling than its setting."""
    most = transient_of_starts(study).transient
    if study.setup.drive.follows or most <= setting.least:
        return ""
    return f" The {transient_words(study.setup)}: {_torque(most)}. {TRIPS_IN_TRANSIENT}."


def _effects(runs: StudyRuns, effects: Mapping[str, CouplingEffect]) -> str:
    """A list of overloads with the effects of a coupling in them, in words."""
    return ", ".join(
        f"{runs.title_of(name)} ({_torque(effect.with_coupling)} at the output of the gear in place of "
        f"{_torque(effect.without)})"
        for name, effect in effects.items()
    )


def _bound(runs: StudyRuns, setting: Setting) -> str:
    """The reason why a coupling of the least setting protects nothing, in words."""
    if setting.obstacle is Obstacle.START and setting.least >= setting.gear:
        return f"the gear may carry {_torque(setting.gear)} in running"
    if not setting.overloads:
        return "this study has no overload that could open it"
    return f"the overloads of this study give less: {_list_of(runs, setting.overloads)}"


def _too_late(runs: StudyRuns, setting: Setting, alternatives: Sequence[Alternative]) -> str:
    """A sentence on the overloads in which the gear carries more than it may, though the coupling opens, and on the
    cures; empty where there are none."""
    if not setting.passed:
        return ""
    over = ", ".join(
        f"{runs.title_of(name)} (by {_torque(effect.with_coupling - setting.gear)}, "
        f"{number(effect.with_coupling / setting.gear - 1.0, '1', 'percent')})"
        for name, effect in setting.passed.items()
    )
    cures = []
    for alternative in alternatives:
        if alternative.way is Way.RELEASE:
            declared = number(Coupling().release_time, "s")
            cures.append(
                f"a release time of {number(alternative.numbers.release_time, 's')} in place of {declared}"
            )
    cures.append(f"a gear that may carry {_torque(max(e.with_coupling for e in setting.passed.values()))}")
    cures.append("a device at the machine, nearer to the overload")
    return (
        f" It opens too late to keep below the {_torque(setting.gear)} that the gear may carry where {over}; the "
        f"cure is {', or '.join(cures)}."
    )


_WAYS = {
    Way.RELEASE: "With a release time of {release_time}: {set}.",
    Way.GEAR: "With a gear that may carry {gear}: {set}.",
    Way.SOFT_STARTER: 'With a soft starter (start = "soft"; starter.soft_start: voltage = "{voltage}", '
    'time = "{ramp}") a start puts at most {start} on it and takes {start_time}: {set}.',
    Way.INVERTER: 'With an inverter (start = "inverter"; run.ramp = "{ramp}", starter.inverter.boost = "{boost}") a '
    "start puts at most {start} on it, running {running}: {set}.",
    Way.SLIP_CLUTCH: "With a slip clutch, set to {setting}, the motor starts on line, and the clutch slips for "
    "{slip_time} in each start, which makes {slip_energy} of heat. It slips, too, where {opens}: a switch has to "
    "stop the motor then, as the slip makes {slip_power} of heat.",
    Way.HIGHER: "With the start direct on line and a higher setting: {set}.",
    Way.BEFORE_FLYWHEEL: "Between motor and flywheel in place of behind the flywheel: a start puts {start} on it, "
    "running {running}: {set}. There it does not protect the machine from the energy of the flywheel.",
}
"""By way, its sentence; the values in quotes are those of a study file."""


_FAILURES = {
    Way.SOFT_STARTER: "No soft starter that was tried brings the {driver} to its speed from every angle within the "
    "limits of this motor: its locked-rotor time, the heat of its starts, their number in an hour, each with the "
    'margin. A larger motor may have one (start = "soft").',
    Way.INVERTER: "An inverter does not bring the {driver} to its speed from every angle, within the limits of this "
    "motor, with any ramp and boost (starter.inverter.boost) that were tried.",
    Way.SLIP_CLUTCH: "A slip clutch that running alone permits slips on in the start and does not bring the machine "
    "to its speed within the limits of this motor.",
}
"""By way, the sentence on one with which the machine does not start."""


def way_words(study: StudyRecord, alternative: Alternative, setting: Setting) -> str:
    """The sentence on a way to a torque limiter that a start does not open, beside the one of that `setting`."""
    if alternative.numbers.start is None:
        return of_driver(_FAILURES[alternative.way], study.setup.driver_noun)
    numbers = {
        v.name: number(value, v.unit, v.kind, full=v.name not in ("voltage", "ramp", "boost"))
        for v in variables(WayNumbers)
        if (value := getattr(alternative.numbers, v.name)) is not None
    }
    if alternative.numbers.setting is not None:
        numbers["setting"] = _at_both(study.setup.drive, alternative.numbers.setting)
    return _WAYS[alternative.way].format(
        **numbers, opens=_list_of(study.runs, alternative.opens), set=_set(study, alternative, setting)
    )


def _set(study: StudyRecord, alternative: Alternative, setting: Setting) -> str:
    """The setting of a way and what it protects, in words."""
    gear = study.setup.config.drive.gear.torque_limit
    if alternative.numbers.setting is None:
        return f"no setting is left below the {_torque(gear)} that the gear may carry"
    text = f"set to {_at_both(study.setup.drive, alternative.numbers.setting)}, it opens "
    if not alternative.opens:
        return text + "in no overload of this study and protects nothing"
    effects, opens = alternative.effects, alternative.opens
    text += f"where {_effects(study.runs, effects) if effects else _list_of(study.runs, opens)}"
    if effects and not spares(effects, gear):
        text += ", too late to save anything"
    if shut := [name for name in setting.overloads if name not in opens]:
        text += f", but stays shut where {', '.join(map(study.runs.title_of, shut))}"
    if alternative.numbers.rocker is not None:
        text += f"; the rocker sees up to {_torque(alternative.numbers.rocker)}"
    return text
