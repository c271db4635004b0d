"""The verdicts on the model and on the motor, from the numbers of the runs."""

from __future__ import annotations

from collections.abc import Mapping

from ..core.quantities import quantity
from ..reading.results import part, result
from ..reading.text import number
from . import verdict
from .coupling import LESS_TORQUE
from .event import Role
from .limits import Check, given_motor, reaches
from .readings import has_turn, less_than_a_turn, motor_run_up
from .record import StudyRecord
from .rig import worst_residual
from .start_runs import longest_of
from .starts import StartFindings
from .verdict import RESIDUAL, STEADY, Holds, Verdict, shown_speed
from .window import Phase


def model_verdict(study: StudyRecord) -> Verdict:
    """The verdict on the model of the machine, from the numbers of the runs."""
    config, answers = study.config, study.answers
    steady = answers.get(STEADY)
    mean = steady.speed_mean if steady else config.run.crank_speed
    speed, residuals = max(config.run.crank_speed, mean), _residuals(study)
    if study.drive.foreign_machine:
        return verdict.foreign_machine(speed, residuals, actual=mean)
    if not study.drive.machine.model.sides:
        return verdict.rigid_links(speed, residuals, actual=mean, driver=study.driver_noun)
    return config.organs.verdict(study, speed, mean, residuals)


def wrong_runs(study: StudyRecord) -> list[str]:
    """The runs whose energy balance is not kept, so that their numbers count as wrong; start-up and steady running
    are one run."""
    # a balance of NaN is not kept either
    return [name for name, residual in _residuals(study).items() if not residual < RESIDUAL]


def _residuals(study: StudyRecord) -> dict[str, float]:
    """By run, the largest energy residual over the energy moved; start-up and steady running are one run."""
    return {
        STEADY if name == verdict.START else name: worst_residual(shares)
        for name, shares in study.certificate.items()
    }


def motor_limits(study: StudyRecord) -> dict[str, Check]:
    """The values of the motor in its start and in steady running beside its limits, by name. Of a
    proposed motor only the temperature is checked here, as its starts and its duty were checked before."""
    steady, start = study.answers.get(STEADY), study.start
    if steady is None or start is None:
        return {}
    time, findings = start.start_time, StartFindings.found_in(study)
    if findings is not None:
        # the worst crank angle counts
        others = longest_of(findings.starts)
        time = None if others is None or time is None else max(time, others)
    time = motor_run_up(
        study.drive, study.runs[verdict.START].sel(time=slice(None, study.steady_begin)), time
    )
    config, permitted = study.config, study.config.permitted_temperature[1]
    return given_motor(
        study.drive, config.plate, permitted, steady.winding_temperature, steady.current_rms, time
    )


_EXCESSES = {
    "temperature": "its winding becomes too hot in steady running",
    "current": "its RMS current in steady running passes the rated one",
    "start": "its start takes too long",
}
"""By limit of the motor, the words that say that it is exceeded."""

AMPLE = 0.02
"""Reserve of torque from which on the motor counts as strong enough; with less it is at its limit. A motor of a
catalogue needs more: its pull-out torque may be less by a tolerance (`LESS_TORQUE`)."""
_SLOWED = 0.5
"""Dip of the speed from which on an event counts as a stall."""


def no_reserve(run: str, reserve: float) -> str:
    """Words on how far the motor's torque in a run exceeds its lasting torque, where the `reserve` is below
    0."""
    over = number(-reserve, "1", "percent") + (" or more" if reserve <= -1.0 else "")
    when = "in each turn" if run == STEADY else "for a moment"
    return f"{when} its torque exceeds the pull-out torque by {over}"


def slowed(study: StudyRecord) -> dict[str, float]:
    """The overloads that pull the motor below half its speed without standing still or opening a coupling, with the
    dip of the speed, a share of it."""
    events = study.config.events
    return {
        name: answers.speed_dip
        for name, answers in study.answers.items()
        if name in study.overloads
        and events[name].role is Role.SHOCK
        and not events[name].from_rest
        and answers.stall_time is None
        and answers.coupling_trip_time is None
        and answers.speed_dip > _SLOWED
    }


def lasts(study: StudyRecord) -> bool:
    """Whether means of steady running stand for running that lasts, see `Window.lasts`."""
    return study.window(Phase.STEADY, study.steady).lasts


def _no_judgement(study: StudyRecord, speed: str) -> str:
    """Words on a motor that is not told as one that keeps the speed, though the mean `speed` is near: it does not
    start from another angle, or its turns are not steady; empty where neither is so."""
    findings, driver = StartFindings.found_in(study), study.driver_noun
    if findings is not None and findings.stuck:
        where = " and ".join(number(start.angle, "rad") for start in findings.stuck)
        return f"The motor does NOT bring the {driver} to its speed from {where}, though it turns at {speed} here"
    if lasts(study):
        return ""
    steady, why = study.answers[STEADY], less_than_a_turn(study.drive, study.steady)
    if has_turn(study.drive, study.steady):
        gap, energy = (number(abs(x), "1", "percent") for x in (steady.cycle_gap, steady.energy_gap))
        why = f"their ends differ by {gap}, and the moving masses take up or give {energy} of the energy that passes"
    return (
        f"The motor is not judged: the {driver} turns at {speed}, but its turns are not steady ({why}); raise "
        "run.settle_turns or run.turns"
    )


@result
class MotorVerdict:
    """The verdict on the motor."""

    holds: Holds = part("whether the motor suffices: true, in part or false")
    text: str = part("the verdict in a sentence")
    speed: float = quantity("rad/s", "mean speed in steady running", kind="speed")
    asked: float = quantity("rad/s", "speed asked for", kind="speed")
    least_reserve: float | None = quantity("1", "least reserve of torque", kind="percent")
    run: str | None = part("the run of the least reserve")
    left_out: list[str] = part("runs that are left out, as their energy balance is not kept")
    limits: Mapping[str, float | None] = part("used share of each limit", unit="1", kind="used")


def motor_verdict(study: StudyRecord) -> MotorVerdict | None:
    """The verdict on the motor; None without steady running. It is "false" where the motor
    does not reach the speed or becomes too hot. It is "in part" where no reserve of torque is left or known,
    another limit is exceeded, or no motor was found that suffices. The least reserve is given with its
    run. Runs whose energy balance is not kept are left out, as they say nothing about the motor."""
    steady, requested = study.answers.get(STEADY), study.config.run.crank_speed
    if steady is None:
        return None
    keeps_speed, wrong = reaches(steady.speed_mean, requested), wrong_runs(study)
    left_out = [name for name in study.answers if name in wrong]
    reserves = {
        name: a.torque_reserve
        for name, a in study.answers.items()
        if name not in left_out and a.torque_reserve is not None
    }
    run = min(reserves, key=lambda name: float(reserves[name]), default=None)
    reserve = None if run is None else reserves[run]
    speed = number(shown_speed(steady.speed_mean, requested), "rad/s", "speed", beside=False)
    requested_text = number(requested, "rad/s", "speed", full=False, beside=False)
    unjudged = _no_judgement(study, speed) if keeps_speed else ""
    if unjudged:
        text, keeps_speed = unjudged, False
    elif keeps_speed:
        text = f"The motor keeps the {study.driver_noun} at {speed}"
        if speed != number(requested, "rad/s", "speed", beside=False):
            share = number(steady.speed_mean / requested - 1.0, "1", "percent")
            text += f", {'+' if steady.speed_mean > requested else ''}{share} of {requested_text}"
    elif steady.speed_mean > requested:
        text = (
            f"The motor does NOT keep the speed: the {study.driver_noun} turns at {speed}, faster than the "
            f"required {requested_text}"
        )
    else:
        text = f"The motor does NOT reach the speed: {speed} in place of {requested_text}"
    if study.insufficient:
        assert study.proposal is not None
        text += f"{', but it' if keeps_speed else '; it'} is insufficient by the limits of the {study.proposal.name}"
    limits = {} if STEADY in left_out else motor_limits(study)
    excesses = [
        name for name, check in limits.items() if check.utilisation is None or check.utilisation > 1.0
    ]
    if excesses:
        link = ", but" if keeps_speed and not study.insufficient else ";"
        text += f"{link} {', '.join(_EXCESSES[name] for name in excesses)}"
    if run is None:
        text += "; its reserve of torque is not known"
    elif reserve is not None and reserve >= 0.0:
        text += f"; least reserve of torque {number(reserve, '1', 'percent')} ({study.title_of(run)})"
        if study.plate is not None and reserve < LESS_TORQUE:
            weaker = number(LESS_TORQUE, "1", "percent")
            text += f", less than the {weaker} by which IEC 60034-1 permits it to be weaker"
    else:
        bare = ", without the recommended torque limiter" if run in study.currents_until_trip else ""
        text += f"; {no_reserve(run, reserves[run])} ({study.title_of(run)}{bare})"
    if stalls := slowed(study):
        dips = ", ".join(
            f"{study.title_of(name)}: by {number(dip, '1', 'percent')}" for name, dip in stalls.items()
        )
        text += f"; its speed dips as in a stall ({dips})"
    if left_out:
        names = ", ".join(study.title_of(name) for name in left_out)
        text += f"; runs whose energy balance is not kept are left out ({names})"
    ample = AMPLE if study.plate is None else LESS_TORQUE
    enough = (
        reserve is not None and reserve >= ample and not stalls and not study.insufficient and not excesses
    )
    burns = not keeps_speed or "temperature" in excesses
    holds: Holds = "false" if burns else "true" if enough else "in part"
    return MotorVerdict(
        holds,
        f"{text}.",
        steady.speed_mean,
        requested,
        reserve,
        run,
        left_out,
        {name: check.utilisation for name, check in limits.items()},
    )
