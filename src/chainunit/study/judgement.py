"""The verdicts on the model and on the motor, from the numbers of the runs."""

from __future__ import annotations

from collections.abc import Mapping

from ..core.quantities import percentage, quantity
from ..reading.results import part, result
from ..reading.text import number
from .coupling import LESS_TORQUE
from .event import Role
from .limits import Check, given_motor, reaches
from .readings import has_turn, less_than_a_turn, motor_run_up
from .record import StudyRecord, StudyRuns
from .rig import worst_residual
from .start_runs import longest_of
from .starts import StartFindings
from .verdict import RESIDUAL, START, STEADY, Holds, Verdict, balance_faults, shown_speed
from .window import Phase


def model_verdict(study: StudyRecord) -> Verdict:
    """The verdict on the model of the machine, from the numbers of the runs: at the crank speed asked for, or at that
    of steady running if it is higher."""
    setup, runs = study.setup, study.runs
    asked, steady = setup.config.run.crank_speed, runs.answers.get(STEADY)
    actual = steady.speed_mean if steady else asked
    speed, residuals = max(asked, actual), _residuals(runs.certificate)
    if setup.drive.foreign_machine:
        return Verdict("energy balance", None, speed, balance_faults(residuals), actual)
    if setup.drive.machine.model.sides:
        verdict: Verdict = setup.config.organs.verdict(study, speed, actual, residuals)
        return verdict
    return Verdict("machine", "rigid links", speed, balance_faults(residuals), actual, setup.driver_noun)


def wrong_runs(runs: StudyRuns) -> list[str]:
    """The runs whose energy balance is not kept, so that their numbers count as wrong; start-up and steady running
    are one run."""
    # a balance of NaN is not kept either
    return [name for name, residual in _residuals(runs.certificate).items() if not residual < RESIDUAL]


def _residuals(certificate: Mapping[str, Mapping[str, float]]) -> dict[str, float]:
    """By run, the largest energy residual over the energy moved; start-up and steady running are one run."""
    return {STEADY if name == START else name: worst_residual(shares) for name, shares in certificate.items()}


def motor_limits(study: StudyRecord) -> dict[str, Check]:
    """The values of the motor in its start and in steady running beside its limits, by name. Of a
    proposed motor only the temperature is checked here, as its starts and its duty were checked before."""
    setup, runs = study.setup, study.runs
    steady, start = runs.answers.get(STEADY), runs.start
    if steady is None or start is None:
        return {}
    time, findings = start.start_time, StartFindings.found_in(study.findings)
    if findings is not None:
        # the worst crank angle counts
        others = longest_of(findings.starts)
        time = None if others is None or time is None else max(time, others)
    time = motor_run_up(setup.drive, runs.rise, time)
    config, permitted = setup.config, setup.config.permitted_temperature[1]
    return given_motor(
        setup.drive, config.plate, permitted, steady.winding_temperature, steady.current_rms, time
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


def slowed(runs: StudyRuns) -> dict[str, float]:
    """The overloads that pull the motor below half its speed without standing still or opening a coupling, with the
    dip of the speed, a share of it."""
    events = runs.events
    return {
        name: answers.speed_dip
        for name, answers in runs.answers.items()
        if name in runs.overloads
        and events[name].role is Role.SHOCK
        and not events[name].from_rest
        and answers.stall_time is None
        and answers.coupling_trip_time is None
        and answers.speed_dip > _SLOWED
    }


def lasts(runs: StudyRuns) -> bool:
    """Whether means of steady running stand for running that lasts, see `Window.lasts`."""
    return runs.window(Phase.STEADY, runs.steady).lasts


def _not_judged(study: StudyRecord, speed: str) -> str:
    """Why a motor is not said to keep its speed though the mean `speed` is near: it does not start from another
    angle, or its turns are not steady; empty where neither is so."""
    findings, driver = StartFindings.found_in(study.findings), study.setup.driver_noun
    if findings is not None and findings.stuck:
        where = " and ".join(number(start.angle, "rad") for start in findings.stuck)
        return f"The motor does NOT bring the {driver} to its speed from {where}, though it turns at {speed} here"
    if lasts(study.runs):
        return ""
    steady, why = study.runs.answers[STEADY], less_than_a_turn(study.setup.drive, study.runs.steady)
    if has_turn(study.setup.drive, study.runs.steady):
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
    least_reserve: float | None = percentage("least reserve of torque")
    run: str | None = part("the run of the least reserve")
    left_out: list[str] = part("runs that are left out, as their energy balance is not kept")
    limits: Mapping[str, float | None] = part("used share of each limit", unit="1", kind="used")


def motor_verdict(study: StudyRecord) -> MotorVerdict | None:
    """The verdict on the motor; None without steady running. It is "false" where the motor
    does not reach the speed or becomes too hot. It is "in part" where no reserve of torque is left or known,
    another limit is exceeded, or no motor was found that suffices. The least reserve is given with its
    run. Runs whose energy balance is not kept are left out, as they say nothing about the motor."""
    setup, runs, steady = study.setup, study.runs, study.runs.answers.get(STEADY)
    if steady is None:
        return None
    wrong = wrong_runs(runs)
    left_out = [name for name in runs.answers if name in wrong]
    reserves = {
        name: answers.torque_reserve
        for name, answers in runs.answers.items()
        if name not in left_out and answers.torque_reserve is not None
    }
    run = min(reserves, key=lambda name: float(reserves[name]), default=None)
    reserve = None if run is None else reserves[run]
    limits = {} if STEADY in left_out else motor_limits(study)
    used = {name: check.utilisation for name, check in limits.items()}
    excesses = [name for name, share in used.items() if share is None or share > 1.0]
    stalls, (keeps_speed, text) = slowed(runs), _on_speed(study, steady.speed_mean)
    if setup.proposal is not None and setup.insufficient:
        text += f"{', but it' if keeps_speed else '; it'} is insufficient by the limits of the {setup.proposal.name}"
    if excesses:
        link = ", but" if keeps_speed and not setup.insufficient else ";"
        text += f"{link} {', '.join(_EXCESSES[name] for name in excesses)}"
    text += f"; {_on_reserve(study, run, reserve)}"
    if stalls:
        dips = (f"{runs.title_of(name)}: by {number(dip, '1', 'percent')}" for name, dip in stalls.items())
        text += f"; its speed dips as in a stall ({', '.join(dips)})"
    # behind a part that slips the motor has a reserve while the machine stands
    stands = [runs.title_of(name) for name, answers in runs.answers.items() if answers.stall_time is not None]
    if stands and setup.drive.line.before_gear is not None:
        text += f"; the {setup.driver_noun} stands after {', '.join(stands)}"
    if left_out:
        names = ", ".join(map(runs.title_of, left_out))
        text += f"; runs whose energy balance is not kept are left out ({names})"
    is_ample = reserve is not None and reserve >= (AMPLE if setup.plate is None else LESS_TORQUE)
    holds: Holds = "true" if is_ample and not (stalls or setup.insufficient or excesses) else "in part"
    if not keeps_speed or "temperature" in excesses:
        holds = "false"
    asked = setup.config.run.crank_speed
    return MotorVerdict(holds, f"{text}.", steady.speed_mean, asked, reserve, run, left_out, used)


def _on_speed(study: StudyRecord, mean: float) -> tuple[bool, str]:
    """Whether the motor keeps the speed asked for, by the `mean` speed of steady running [rad/s], and the begin of
    the sentence on it."""
    asked, driver = study.setup.config.run.crank_speed, study.setup.driver_noun
    speed = number(shown_speed(mean, asked), "rad/s", "speed", beside=False)
    asked_words = number(asked, "rad/s", "speed", full=False, beside=False)
    if not reaches(mean, asked) and mean > asked:
        faster = f"the {driver} turns at {speed}, faster than the required {asked_words}"
        return False, f"The motor does NOT keep the speed: {faster}"
    if not reaches(mean, asked):
        return False, f"The motor does NOT reach the speed: {speed} in place of {asked_words}"
    if reason := _not_judged(study, speed):
        return False, reason
    text = f"The motor keeps the {driver} at {speed}"
    if speed != number(asked, "rad/s", "speed", beside=False):
        share = number(mean / asked - 1.0, "1", "percent")
        text += f", {'+' if mean > asked else ''}{share} of {asked_words}"
    return True, text


def _on_reserve(study: StudyRecord, run: str | None, reserve: float | None) -> str:
    """The clause on the least `reserve` of torque and its run."""
    if run is None or reserve is None:
        return "its reserve of torque is not known"
    if not reserve >= 0.0:
        bare = ", without the recommended torque limiter" if run in study.currents_until_trip else ""
        return f"{no_reserve(run, reserve)} ({study.runs.title_of(run)}{bare})"
    text = f"least reserve of torque {number(reserve, '1', 'percent')} ({study.runs.title_of(run)})"
    if study.setup.plate is not None and reserve < LESS_TORQUE:
        weaker = number(LESS_TORQUE, "1", "percent")
        text += f", less than the {weaker} by which IEC 60034-1 permits it to be weaker"
    return text
