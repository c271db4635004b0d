"""The safety coupling of a drive: the recommended setting, and whether a given coupling protects the
drive."""

from __future__ import annotations

from collections.abc import Mapping

import xarray as xr

from ..text import number
from .arrays import peak
from .drive import Drive
from .event import Role
from .protection import MARGIN, Obstacle, Setting
from .record import StudyRecord
from .window import BURNT


def on_coupling(drive: Drive, run: xr.Dataset) -> float:
    """Peak torque in a run on a coupling that sits on the motor shaft, reduced to the crank [N m]."""
    return peak(run["motor.tau"].values) * drive.ratio


def peaks_on_coupling(study: StudyRecord, *roles: Role) -> dict[str, float]:
    """Peak torque on the coupling in each event with one of these `roles`, or in every event without `roles`,
    at the crank [N m]. A start direct on line is left out, as it is judged apart."""
    events = study.config.events
    return {
        name: on_coupling(study.drive, study.runs[name].sel(time=slice(begin, None)))
        for name, begin in study.event.items()
        if name in study.runs
        and not (study.start_apart and events[name].from_rest)
        and (not roles or events[name].role in roles)
    }


def recommended_setting(study: StudyRecord) -> Setting | None:
    """The recommended safety coupling of a sized drive, judged by the events of the study. None where no
    motor was chosen, where the file gives a coupling, or where the study ended before steady running."""
    if not study.sizing or study.insufficient or study.config.coupling or "steady" not in study.answers:
        return None
    best, drive = study.sizing.best, study.drive
    lasting = peaks_on_coupling(study, Role.DUTY).values()
    normal = [on_coupling(drive, study.steady), best.duty_torque, *lasting]
    if not study.start_apart:
        normal.append(on_coupling(drive, study.runs["start_up"]))
    return Setting(
        normal=max(normal),
        motor=pull_out(study),
        gear=study.config.gear.torque_limit,
        overloads=peaks_on_coupling(study, Role.SHOCK),
        disturbances=peaks_on_coupling(study, Role.DISTURBANCE),
    )


def pull_out(study: StudyRecord) -> float:
    """Largest torque of the warm motor at the crank in steady running [N m]."""
    return study.drive.pull_out(study.steady, min(BURNT, study.answers["steady"].winding_temperature))


def _torque(value: float) -> str:
    return number(value, "N.m")


def _list_of(study: StudyRecord, peaks: Mapping[str, float]) -> str:
    """A list of runs with their peaks on the coupling [N m], in words."""
    return ", ".join(f"{study.title_of(name)} ({_torque(peak)})" for name, peak in peaks.items())


def _starts_above(study: StudyRecord, torque: float) -> dict[str, float]:
    """The parts of the start in which the coupling carries more than `torque` [N m], with their peaks [N
    m]."""
    return {name: peak for name, peak in study.start_torques.items() if peak > torque}


def coupling_sentence(study: StudyRecord) -> str:
    """A sentence on the recommended safety coupling of a sized drive and its effect in the overloads, or on
    the reason why no coupling protects the drive."""
    setting = study.setting
    assert setting is not None
    caveat = f" ({study.verdict.caveat})" if study.verdict and study.verdict.caveat else ""
    above = f"{_torque(setting.least)}, {MARGIN:g} times the {_torque(setting.normal)} of normal duty"

    if setting.obstacle is Obstacle.MOTOR:
        return (
            f"No safety coupling protects this drive: it has to open above {above}, and the motor gives at most "
            f"{_torque(setting.motor)} at the crank."
        )
    if setting.obstacle is Obstacle.GEAR:
        return (
            f"No safety coupling protects this drive: it has to open above {above}, and the gear may carry "
            f"{_torque(setting.gear)}."
        )
    if setting.obstacle is Obstacle.OVERLOADS:
        most = max(setting.overloads.values(), default=0.0)
        return f"No safety coupling is recommended: it has to open above {above}, and " + (
            f"the jams, lumps and blocks of this study put {_torque(most)} on it at most."
            if setting.overloads
            else "this study has no jam, lump or block that could open it."
        )
    shut = {name: peak for name, peak in setting.overloads.items() if name not in setting.opens}
    text = (
        f"Recommended safety coupling{caveat}: {above}, {'above' if setting.stalls else 'below'} the "
        f"{_torque(setting.motor)} that the motor gives at the crank. It opens where {_list_of(study, setting.opens)}"
    )
    text += f"; it stays shut where {_list_of(study, shut)}." if shut else "."
    if setting.stalls:
        text += (
            " A load that rises slowly stalls the motor and does not open it: the relay has to trip there."
        )
    if setting.nuisances:
        nuisances = _list_of(study, setting.nuisances)
        text += f" A nuisance trip, which protects nothing: it opens, too, where {nuisances}."
    if starts := _starts_above(study, setting.least):
        text += (
            f" A start direct on line puts more on it: {_list_of(study, starts)}; it has to be held shut in the "
            "start (coupling.held_in_start = true)."
        )
    return text


def remark_on_coupling(study: StudyRecord, trip: float) -> None:
    """Warn where a given coupling, set to `trip` [N m], does not protect the drive as it should."""
    # the limit of a foreign motor is not known
    most = None if study.drive.foreign else pull_out(study)
    peaks, shocks = peaks_on_coupling(study), peaks_on_coupling(study, Role.SHOCK)
    amounts = {"trip": (trip, "N.m")} | ({} if most is None else {"motor": (most, "N.m")})
    warn = study.warn
    if starts := study.start_torques:
        above = _starts_above(study, trip)
        hardest = max(starts, key=starts.__getitem__)
        text = (
            "The safety coupling opens at {trip}, and starting puts more on it: {where}. It is held shut in the "
            "start (coupling.held_in_start)."
            if above
            else "Starting puts {start} on the safety coupling at most ({where}), which opens at {trip}: it is held "
            "shut in the start (coupling.held_in_start), which is not needed."
        )
        (warn if above else study.note)(
            "coupling held shut",
            text,
            *(above or [hardest]),
            where=_list_of(study, above) if above else study.title_of(hardest),
            start=(starts[hardest], "N.m"),
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
