"""The safety coupling of a drive: the recommended setting, and whether a given coupling protects the
drive."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from ..core.quantities import variables
from ..reading.text import number
from .event import Role
from .event_torques import effects, peaks_in_events, running_peak, running_words
from .judgement import wrong_runs
from .protection import MARGIN, Alternative, CouplingEffect, Obstacle, Setting, Way, WayNumbers, spares
from .ram_force import TIMES, rams
from .readings import pull_out_torque
from .record import StudyRecord
from .sections import Coupling
from .starts import StartAnalysis
from .torques import on_coupling
from .verdict import START, STEADY
from .window import Phase


def recommended_setting(study: StudyRecord) -> Setting | None:
    """The recommended safety coupling of a sized drive, judged by the events of the study. None where no
    motor was chosen, where the file gives a coupling, or where the study ended before steady running."""
    if not study.sizing or study.insufficient or study.config.coupling or STEADY not in study.answers:
        return None
    events, wrong = study.config.events, wrong_runs(study)
    normal = [n for n in wrong if n not in events or events[n].from_rest or events[n].role is Role.DUTY]
    shocks = peaks_in_events(study, Role.SHOCK)
    setting = Setting(
        running=running_peak(study).torque,
        start=hardest_start(study).torque,
        motor=pull_out(study),
        gear=study.config.gear.torque_limit,
        overloads={} if normal else {n: peak for n, peak in shocks.items() if n not in wrong},
        disturbances={n: x for n, x in peaks_in_events(study, Role.DISTURBANCE).items() if n not in wrong},
        wrong=normal or [n for n in wrong if n in shocks],
    )
    if setting.obstacle is not None:
        return setting
    tried = effects(study, setting.least)
    return replace(setting, effects={n: tried[n] for n in setting.opens})


@dataclass(frozen=True)
class StartPeak:
    """The largest torque of a start on the coupling, at the crank [N m]: in the run of that name, or in a start from
    a crank angle [rad] without a run of its own."""

    torque: float
    run: str = START
    angle: float | None = None

    def title(self, study: StudyRecord) -> str:
        """The start in words."""
        return study.title_of(self.run) if self.angle is None else f"start from {number(self.angle, 'rad')}"

    def named(self, study: StudyRecord) -> str:
        """The start in words, with its article."""
        return f"{'the' if self.run == START and self.angle is None else 'a'} {self.title(study)}"


def start_peaks(study: StudyRecord) -> list[StartPeak]:
    """The largest torques on the coupling in the parts of the start: the start-up with the settling under a feed that
    comes later, starts from other crank angles, starts under load."""
    events, peaks = study.config.events, peaks_in_events(study)
    run = study.runs[START].sel(time=slice(None, study.steady_begin))
    parts = [StartPeak(on_coupling(study.drive, run))]
    if findings := study.findings.get(StartAnalysis.name):
        parts += [StartPeak(start.coupling_torque, angle=start.angle) for start in findings.starts]
    return parts + [StartPeak(peak, name) for name, peak in peaks.items() if events[name].from_rest]


def hardest_start(study: StudyRecord) -> StartPeak:
    """The part of the start with the largest torque on the coupling."""
    return max(start_peaks(study), key=lambda start: start.torque)


def pull_out(study: StudyRecord) -> float:
    """Largest torque of the warm motor at the crank in steady running [N m]."""
    return pull_out_torque(study.drive, study.steady, study.window(Phase.STEADY, study.steady).warm)


def _torque(value: float) -> str:
    return number(value, "N.m")


def _at_both(study: StudyRecord, value: float) -> str:
    """A torque at the crank, and at the motor's shaft, on which the coupling sits."""
    return f"{_torque(value)} at the crank, {_torque(value / study.drive.ratio)} at the motor's shaft"


def _list_of(study: StudyRecord, peaks: Mapping[str, float]) -> str:
    """A list of runs with their peaks on the coupling [N m], in words."""
    return ", ".join(f"{study.title_of(name)} ({_torque(peak)})" for name, peak in peaks.items())


_OBSTACLES = {
    Obstacle.START: "No safety coupling protects this drive as it starts now: {start} puts {start_torque} on it, so "
    "that it has to open above {least}, and {bound}. For running alone {least_in_running} would do.",
    Obstacle.MOTOR: "No safety coupling protects this drive: it has to open above {above}, and the motor gives at "
    "most {motor} at the crank.",
    Obstacle.GEAR: "No safety coupling protects this drive: it has to open above {above}, and the gear may carry "
    "{gear}.",
    Obstacle.OVERLOADS: "No safety coupling is recommended: it has to open above {above}, and {bound}.",
    Obstacle.RELEASE: "No safety coupling is recommended: one that opens at {setting}, opens too late. The largest "
    "torques until no torque passes it, {release} after its trip: {effects}. That saves nothing.",
    Obstacle.ENERGY: "No safety coupling is recommended: the energy balance is not kept in {wrong}, so that no "
    "setting follows from its numbers.",
}
"""By obstacle, the sentence on it."""


_REASONS = {
    Obstacle.START: "a start puts {start} on it",
    Obstacle.MOTOR: "the motor gives {motor} at most",
    Obstacle.GEAR: "the gear may carry {gear}",
    Obstacle.OVERLOADS: "no overload of this study would open it",
    Obstacle.RELEASE: "it opens too late",
    Obstacle.ENERGY: "the energy balance of its runs is not kept",
}
"""By obstacle, a few words on it."""


def why_none(study: StudyRecord) -> str:
    """A few words on the reason why no coupling is recommended; empty where one is."""
    setting = study.setting
    if setting is None or setting.obstacle is None:
        return ""
    return _REASONS[setting.obstacle].format(
        start=_torque(setting.start), motor=_torque(setting.motor), gear=_torque(setting.gear)
    )


def coupling_sentence(study: StudyRecord) -> str:
    """A sentence on the recommended safety coupling of a sized drive and its effect in the overloads, or on
    the reason why no coupling protects the drive."""
    setting = study.setting
    assert setting is not None
    caveat = f" ({study.verdict.caveat})" if study.verdict and study.verdict.caveat else ""
    hardest, running = hardest_start(study), running_peak(study)
    start = hardest.named(study)
    of = f"that {start}" if setting.start > setting.running else f"that {running_words(study, running.run)}"
    above = f"{_torque(setting.least)}, {MARGIN:g} times the {_torque(setting.normal)} {of} puts on it"
    if setting.obstacle is not None:
        return _OBSTACLES[setting.obstacle].format(
            start=start,
            setting=_at_both(study, setting.least),
            release=number(Coupling().release_time, "s"),
            effects=_effects(study, setting.effects),
            wrong=", ".join(map(study.title_of, setting.wrong)),
            start_torque=_torque(hardest.torque),
            least=_torque(setting.least),
            least_in_running=_torque(setting.least_in_running),
            above=above,
            motor=_torque(setting.motor),
            gear=_torque(setting.gear),
            bound=_bound(setting),
        )
    shut = {name: peak for name, peak in setting.overloads.items() if name not in setting.opens}
    text = (
        f"Recommended safety coupling{caveat}: {_at_both(study, setting.least)}; this is {MARGIN:g} times the "
        f"{_torque(setting.normal)} {of} puts on it, and {'above' if setting.stalls else 'below'} the "
        f"{_torque(setting.motor)} that the motor gives at the crank. It opens where "
        f"{_effects(study, setting.effects)}"
    )
    text += f"; it stays shut where {_list_of(study, shut)}." if shut else "."
    text += _too_late(study, setting)
    if setting.wrong:
        names = ", ".join(map(study.title_of, setting.wrong))
        text += f" Left out, as the energy balance is not kept: {names}."
    if setting.stalls:
        text += (
            " A load that rises slowly stalls the motor and does not open it: the relay has to trip there."
        )
    if setting.nuisances:
        nuisances = _list_of(study, setting.nuisances)
        text += f" A nuisance trip, which protects nothing: it opens, too, where {nuisances}."
    if setting.start_decides:
        text += f" For running alone {_torque(setting.least_in_running)} would do."
    return text


def _effects(study: StudyRecord, effects: Mapping[str, CouplingEffect]) -> str:
    """A list of overloads with the effects of a coupling in them, in words."""
    return ", ".join(
        f"{study.title_of(name)} ({_torque(effect.with_coupling)} at the output of the gear in place of "
        f"{_torque(effect.without)})"
        for name, effect in effects.items()
    )


def _bound(setting: Setting) -> str:
    """The reason why a coupling of the least setting protects nothing, in words."""
    if setting.obstacle is Obstacle.START and setting.least >= setting.gear:
        return f"the gear may carry {_torque(setting.gear)}"
    if not setting.overloads:
        return "this study has no jam, lump or block that could open it"
    most = _torque(max(setting.overloads.values()))
    return f"the jams, lumps and blocks of this study put {most} on it at most"


def _too_late(study: StudyRecord, setting: Setting) -> str:
    """A sentence on the overloads in which the gear carries more than it may, though the coupling opens, and on the
    cures; empty where there are none."""
    if not setting.passed:
        return ""
    over = ", ".join(
        f"{study.title_of(name)} (by {_torque(effect.with_coupling - setting.gear)}, "
        f"{number(effect.with_coupling / setting.gear - 1.0, '1', 'percent')})"
        for name, effect in setting.passed.items()
    )
    cures = []
    for each in study.alternatives:
        if each.way is Way.RELEASE:
            declared = number(Coupling().release_time, "s")
            cures.append(f"a release time of {number(each.numbers.release_time, 's')} in place of {declared}")
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
    Way.SOFT_STARTER: "No soft starter that was tried brings the crank to its speed from every angle within the "
    "locked-rotor time of the motor.",
    Way.INVERTER: "An inverter does not bring the crank to its speed from every angle with any ramp and boost "
    "(starter.inverter.boost) that were tried.",
    Way.SLIP_CLUTCH: "A slip clutch that running alone permits slips on in the start and does not bring the machine "
    "to its speed.",
}
"""By way, the sentence on one with which the machine does not start."""


def way_words(study: StudyRecord, each: Alternative) -> str:
    """The sentence on a way to a safety coupling that a start does not open."""
    if each.numbers.start is None:
        return _FAILURES[each.way]
    numbers = {
        v.name: number(value, v.unit, v.kind, full=v.name not in ("voltage", "ramp", "boost"))
        for v in variables(WayNumbers)
        if (value := getattr(each.numbers, v.name)) is not None
    }
    if each.numbers.setting is not None:
        numbers["setting"] = _at_both(study, each.numbers.setting)
    return _WAYS[each.way].format(**numbers, opens=_list_of(study, each.opens), set=_set(study, each))


def _set(study: StudyRecord, each: Alternative) -> str:
    """The setting of a way and what it protects, in words."""
    gear = study.config.gear.torque_limit
    if each.numbers.setting is None:
        return f"no setting is left below the {_torque(gear)} that the gear may carry"
    text = f"set to {_at_both(study, each.numbers.setting)}, it opens "
    if not each.opens:
        return text + "in no overload of this study and protects nothing"
    text += f"where {_effects(study, each.effects) if each.effects else _list_of(study, each.opens)}"
    if each.effects and not spares(each.effects, gear):
        text += ", too late to save anything"
    assert study.setting is not None
    if shut := {n: p for n, p in study.setting.overloads.items() if n not in each.opens}:
        text += f", but stays shut where {', '.join(map(study.title_of, shut))}"
    if each.numbers.rocker is not None:
        text += f"; the rocker sees up to {_torque(each.numbers.rocker)}"
    return text


def remark_on_coupling(study: StudyRecord, trip: float) -> None:
    """Warn where a given coupling, set to `trip` [N m], does not protect the drive as it should."""
    # the limit of a foreign motor is not known
    most = None if study.drive.foreign else pull_out(study)
    peaks, shocks = peaks_in_events(study), peaks_in_events(study, Role.SHOCK)
    amounts = {"trip": (trip, "N.m")} | ({} if most is None else {"motor": (most, "N.m")})
    warn = study.warn
    start = hardest_start(study)
    if start.torque > trip:
        warn(
            "coupling opens in start",
            "The safety coupling opens at {trip}, and a start puts up to {start} on it ({where}): it opens in some "
            'of the starts. Set it higher, or start softer (start = "soft" or "inverter").',
            "start_up",
            where=start.title(study),
            start=(start.torque, "N.m"),
            **amounts,
        )
    openings = [name for name in peaks if study.answers[name].coupling_trip_time is not None]
    if nuisances := [name for name in openings if name not in shocks]:
        warn(
            "nuisance trip",
            "The safety coupling, set to {trip}, opens where no shock asks for it, a nuisance trip that protects "
            "nothing: {where}.",
            *nuisances,
            where="; ".join(map(study.title_of, nuisances)),
            **amounts,
        )
    if shocks and not set(openings) & set(shocks):
        warn(
            "coupling never opens",
            "The safety coupling opens in no jam, lump or block of this study: it is set to {trip}, they put "
            "{largest} on it at most, steady running {steady}"
            + ("." if most is None else "; the motor gives {motor} at most."),
            *shocks,
            largest=(max(shocks.values()), "N.m"),
            steady=(on_coupling(study.drive, study.steady), "N.m"),
            **amounts,
        )
    elif most is not None and trip > most:
        warn(
            "coupling above motor",
            "The safety coupling is set to {trip} and the motor gives {motor} at most: a load that rises "
            "slowly stalls the motor and does not open it.",
            **amounts,
        )


_RAM = (
    "A coupling {set_for}that opens at {trip} does not limit the force on the link {ram} near its dead centre, at a "
    "crank angle of {dead}: the setting stands for {fastest} where the link is fastest, for {thirty} at 30 deg and "
    "{ten} at 10 deg before the dead centre; at the dead centre the force has no limit. In running the pin "
    "pushes with {working} at most; "
)
_RAM_WITHIN, _RAM_ALWAYS = "within {angle}, the last {way}, ", "at every angle "
_RAM_END = (
    "it can push with more than {times} times that while the coupling stays shut. A device at the link protects it "
    "there, such as a hydraulic overload cushion or a shear plate."
)


def remark_on_rams(study: StudyRecord) -> None:
    """Note for each ram of a linkage what the setting of the coupling means at it."""
    if study.config.coupling is not None:
        torque, set_for = study.config.coupling.trip_torque, ""
    elif study.setting is not None and study.setting.obstacle in (None, Obstacle.RELEASE):
        # this is the setting that the answer names, recommended or not
        torque, set_for = study.setting.least, ""
    elif study.setting is not None:
        torque, set_for = study.setting.least_in_running, "set for running alone "
    else:
        return
    for ram in rams(study):
        overloaded = ram.overloaded(torque)
        quantities: dict[str, Any] = {}
        if overloaded is not None:
            quantities = {"angle": (overloaded[0], "rad"), "way": (overloaded[1], "m", "millimetres")}
        study.note(
            "coupling at ram",
            _RAM + (_RAM_WITHIN if quantities else _RAM_ALWAYS) + _RAM_END,
            trip=(torque, "N.m"),
            set_for=set_for,
            ram=ram.ram,
            dead=(ram.dead, "rad"),
            fastest=(ram.least(torque), "N"),
            thirty=(ram.before(torque, math.radians(30.0)), "N"),
            ten=(ram.before(torque, math.radians(10.0)), "N"),
            working=(ram.working, "N"),
            times=f"{TIMES:g}",
            **quantities,
        )
