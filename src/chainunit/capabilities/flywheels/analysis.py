"""Flywheels of a drive with a varying load: their runs, and the least flywheel that keeps the permitted
fluctuation."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ...core.quantities import Layout, variable_of
from ...drives.catalogue import CatalogueMotor
from ...reading.results import derived, part, result
from ...reading.text import number
from ...study.analysis import Analysis, Findings, Work
from ...study.arrays import Dataset
from ...study.catalogue_drive import with_inertia
from ...study.cycle import needed_inertia
from ...study.limits import given_motor
from ...study.line.shaft import driveline_of, remedies
from ...study.measures import Answers, read_answers
from ...study.record import StudyRecord, StudySetup
from ...study.remark import RemarkCode, fault, note, warning
from ...study.rig import Rig, worst_residual
from ...study.start_up import start_up
from ...study.turn import TurnFindings
from ...study.verdict import CREEPS, RESIDUAL, STEADY
from .wheel import FlywheelAnswers, Wheel

CLOSE = 0.03
"""The fluctuation with the least flywheel lies below the permitted one by at most this share of it."""
_TRIALS = 8
_WORSE = 1.1
"""Ratio of the fluctuation with a heavier flywheel to that with a lighter one, from which on the heavier one
is called worse."""


@result(frozen=False)
class FlywheelFindings(Findings):
    """The flywheels by their inertia at their own shaft, the `least` one that keeps the `permitted` fluctuation, if
    there is one, and the inputs of the hand formula: the `swing` of the energy in a turn [J], the speed of the
    motor [rad/s], and the inertia on its shaft without a flywheel (`bare`) [kg m2]."""

    own: float
    """flywheel of the study [kg m2]"""
    permitted_fluctuation: float = part(
        "permitted ripple of the speed", unit="1", kind="percent", name="permitted"
    )
    swing: float
    speed: float
    bare: float
    mean_torque: float
    """mean torque of the machine at the motor's shaft, at constant speed [N m]"""
    wheels: list[Wheel] = part("the flywheels that are compared", name="compared", default_factory=list)
    least: Wheel | None = None
    is_searched: bool = False
    is_retuned: bool = part(
        "whether the gains of the speed control differ, as they are tuned to the inertia with each flywheel",
        name="retuned",
        default=False,
    )
    ratio: float = 1.0
    """turns of the motor per turn of the flywheel"""

    def by_hand(self, flywheel: float) -> float:
        """Fluctuation with that flywheel [kg m2] where the drive gives a constant torque."""
        return self.swing / (self.inertia(flywheel) * self.speed * self.speed)

    def inertia(self, flywheel: float) -> float:
        """All inertia at the motor's shaft with that flywheel [kg m2]."""
        return self.bare + flywheel / self.ratio**2

    def permits(self, wheel: Wheel) -> bool:
        """Whether a flywheel keeps the permitted fluctuation and exceeds no other limit."""
        return wheel.keeps(self.permitted_fluctuation) and not wheel.excesses

    def overloads_motor(self, plate: CatalogueMotor | None) -> bool:
        """Whether the mean torque of the machine exceeds the rated one of the motor, so that no flywheel helps."""
        return plate is not None and self.mean_torque > plate.nameplate.torque

    @derived("kg.m2", name="by_hand")
    def flywheel_by_hand(self) -> float:
        """Flywheel that keeps the permitted fluctuation by the hand formula [kg m2]; 0 where none is needed."""
        needed = needed_inertia(self.swing, self.speed, self.permitted_fluctuation, self.bare)
        return needed * self.ratio**2

    @property
    def rows(self) -> list[tuple[str, Wheel, str]]:
        """For each flywheel, by inertia: its description, its run, and its place in the result."""
        runs = [(wheel, f"findings.flywheels.compared.{i}") for i, wheel in enumerate(self.wheels)]
        if self.least is not None and self.least not in self.wheels:
            runs.append((self.least, "findings.flywheels.least"))
        return [
            (self._words(wheel), wheel, path) for wheel, path in sorted(runs, key=lambda run: run[0].flywheel)
        ]

    def _words(self, wheel: Wheel) -> str:
        special = (("given", wheel.flywheel == self.own), ("least", wheel is self.least))
        return ", ".join(word for word, so in (*special, ("stalls", wheel.stalls)) if so)

    @derived(name="least")
    def least_answers(self) -> FlywheelAnswers | None:
        """The answers with the least flywheel that keeps the permitted fluctuation."""
        return None if self.least is None else self.least.answers

    def remark(self, study: StudyRecord) -> None:
        """Add the troubles with their remedies, and a note on the least flywheel."""
        _on_wheels(self, study)
        _on_fluctuation(self, study)
        if not study.setup.drive.follows:
            study.findings.say(_COLD)


class FlywheelAnalysis(Analysis):
    """The flywheels of the table [flywheel]. Each is run as the study is, with gains tuned to its inertia."""

    name = "flywheels"
    needs_runs = True
    applies = staticmethod(lambda drive, plans: plans["flywheels"] is not None and drive.foreign is None)

    @staticmethod
    def find(study: StudyRecord, work: Work) -> FlywheelFindings:
        """Run the flywheels.

        Raises
        ------
        RunError
            where a run fails; the earlier results are in the study.
        """
        config, drive, table = study.setup.config, study.setup.drive, study.setup.config.drive.flywheel
        assert table is not None
        turn = TurnFindings.of_study(study.findings).numbers
        findings = FlywheelFindings(
            own=table.J,
            permitted_fluctuation=table.fluctuation,
            swing=turn.energy_swing,
            speed=config.run.crank_speed * drive.ratio,
            bare=drive.rotor_inertia
            - drive.added_inertia / drive.flywheel_ratio**2
            + turn.inertia_mean / drive.ratio**2,
            mean_torque=turn.torque_mean / drive.ratio,
            ratio=drive.flywheel_ratio,
        )
        study.findings.by_analysis[FlywheelAnalysis.name] = findings
        sizes = sorted({table.J, *config.plans["flywheels"]})

        def run(flywheel: float) -> Wheel:
            """Run the drive with a flywheel of this inertia [kg m2]."""
            finished = float(len(findings.wheels))
            work.progress(f"flywheel of {number(flywheel, 'kg.m2')}", finished, float(len(sizes) + 1))
            return _run(study.setup, work.rig, findings, flywheel)

        for size in sizes:
            findings.wheels.append(_own(study, findings) if size == table.J else run(size))
        findings.least = least_flywheel(
            findings.wheels,
            findings.permitted_fluctuation,
            findings.bare * findings.ratio**2,
            findings.flywheel_by_hand,
            run,
        )
        findings.is_searched = True
        return findings


def _own(study: StudyRecord, findings: FlywheelFindings) -> Wheel:
    """The flywheel of the study, from the run that the study has."""
    setup, runs = study.setup, study.runs
    assert runs.start is not None
    residual = worst_residual(runs.certificate["start_up"])
    return _wheel(setup, findings, findings.own, runs.answers[STEADY], runs.start, runs.steady, residual)


def _run(setup: StudySetup, rig: Rig, findings: FlywheelFindings, flywheel: float) -> Wheel:
    """The start-up and steady running of the study with another flywheel [kg m2], without its torque limiter."""
    tables = setup.config.drive
    turned = with_inertia(tables, replace(setup.drive, observer=None), flywheel)
    assert setup.config.motor is not None
    drive, _ = setup.config.motor.completed(turned, tables, setup.statics.normal)
    findings.is_retuned = findings.is_retuned or drive.parameters != turned.parameters
    rig = replace(rig, drive=drive, fed_from=None)
    with rig.from_rest() as simulation:
        started = start_up(rig, simulation, lambda time: None, {})
    residual = worst_residual(rig.residuals(started.run))
    steady, start = started.windows
    return _wheel(setup, findings, flywheel, read_answers(steady), read_answers(start), steady.run, residual)


def _wheel(
    setup: StudySetup,
    findings: FlywheelFindings,
    flywheel: float,
    steady: Answers,
    start: Answers,
    turns: Dataset,
    residual: float,
) -> Wheel:
    """A flywheel with its answers; a machine that stands or creeps has no answers of steady running."""
    turning = steady.speed_mean > CREEPS * setup.config.run.crank_speed
    drive, motor_ripple, by_hand = setup.drive, None, findings.by_hand(flywheel)
    if drive.line and turning:
        w = turns[drive.motor_speed].values
        motor_ripple = float(np.ptp(w) / np.mean(w))
    further = {
        "flywheel": flywheel,
        "inertia": findings.inertia(flywheel),
        "start_time": start.start_time,
        # the formula does not hold for a ripple of more than 2
        "by_hand": by_hand if by_hand < 2.0 else None,
        "motor_ripple": motor_ripple,
        "residual": residual,
    }
    measures = set(Layout(FlywheelAnswers).names) - set(further)
    answers = FlywheelAnswers(
        **further, **{name: getattr(steady, name) if turning else None for name in measures}
    )
    checks = given_motor(
        drive,
        setup.config.plate,
        setup.config.permitted_temperature[1],
        answers.winding_temperature,
        answers.current_rms,
        answers.start_time,
    )
    return Wheel(answers, turns, checks)


def least_flywheel(
    wheels: Sequence[Wheel], permitted: float, bare: float, by_hand: float, run: Callable[[float], Wheel]
) -> Wheel | None:
    """The least flywheel that keeps the `permitted` fluctuation, to `CLOSE` of the fluctuation; all inertias count at
    its shaft.

    The `wheels` are in order of their inertia. The result is None where none of them keeps it, nor the
    flywheel of the hand formula, nor one that is a fifth heavier than the heaviest. The fluctuation falls
    with the inertia; between two flywheels it is nearly a power of the inertia.

    Parameters
    ----------
    bare : inertia without a flywheel [kg m2]
    by_hand : flywheel by the hand formula [kg m2]
    run : makes the run with a flywheel of that inertia [kg m2]
    """
    above = next((wheel for wheel in wheels if wheel.keeps(permitted)), None)
    # a flywheel with which the motor does not start is no lower end of the search
    starting = [wheel for wheel in wheels if wheel.answers.start_time is not None]
    below = next((w for w in reversed(starting) if above is None or w.flywheel < above.flywheel), None)
    if below is None:
        if above is not None and above.flywheel == 0.0:
            return above
        below = run(0.0)
        if below.keeps(permitted):
            return below
    if above is None:
        above = run(max(by_hand, 1.2 * below.flywheel))
        if not above.keeps(permitted):
            return None
    for _ in range(_TRIALS):
        if above.answers.speed_ripple >= (1.0 - CLOSE) * permitted:
            break
        x = [math.log(bare + wheel.flywheel) for wheel in (below, above)]
        share = 0.5
        if below.answers.speed_ripple is not None:
            y = [math.log(wheel.answers.speed_ripple) for wheel in (below, above)]
            # a little below the permitted one, so that the next flywheel is likely to keep it
            goal = math.log((1.0 - 0.5 * CLOSE) * permitted)
            share = min(max((y[0] - goal) / (y[0] - y[1]), 0.05), 0.95)
        middle = run(math.exp(x[0] + share * (x[1] - x[0])) - bare)
        if middle.keeps(permitted):
            above = middle
        else:
            below = middle
    return above


# -- remarks


@dataclass(frozen=True)
class Trouble:
    """A kind of trouble with flywheels: the test for it, the answer that shows it, and the limit of the motor
    that is exceeded, if it is one; of such a limit the study itself warns for its own flywheel."""

    code: RemarkCode
    has: Callable[[Wheel], bool]
    number: str = ""
    limit: str = ""

    def amount(self, wheel: Wheel) -> tuple[float | None, str, str]:
        """The answer with its unit and kind."""
        v = variable_of(FlywheelAnswers, self.number)
        return getattr(wheel.answers, v.name), v.unit, v.kind

    def words(self, wheel: Wheel) -> str:
        """The flywheel, and the answer where there is one."""
        size = number(wheel.flywheel, "kg.m2")
        if not self.number:
            return size
        value, unit, kind = self.amount(wheel)
        # a winding whose loss grows faster than its cooling reaches no final temperature
        return f"{size} ({'without end' if value == math.inf else number(value, unit, kind)})"


_COLD = note(
    "cold-windings",
    "The windings begin cold and have no time to warm up in these runs. A warm motor slips more.",
)
_TROUBLES = (
    Trouble(
        fault(
            "flywheel-stalls",
            "The motor stalls with a flywheel of {where}.",
            remedy="Take {motor}, or less load.",
        ),
        lambda wheel: wheel.stalls,
    ),
    Trouble(
        fault("flywheel-does-not-start", "The motor does not come up to speed with a flywheel of {where}."),
        lambda wheel: wheel.answers.start_time is None,
    ),
    Trouble(
        warning(
            "rated-current",
            "The RMS current passes the rated {limit} with a flywheel of {where}. The motor becomes too hot.",
        ),
        lambda wheel: wheel.passes("current"),
        "current_rms",
        "current",
    ),
    Trouble(
        warning(
            "hot-winding", "The winding becomes hotter than the permitted {limit} with a flywheel of {where}."
        ),
        lambda wheel: wheel.passes("temperature"),
        "winding_temperature",
        "temperature",
    ),
    Trouble(
        warning(
            "long-start",
            "The start takes longer than the {limit} for which the rotor may be locked with a flywheel of {where}.",
        ),
        lambda wheel: wheel.passes("start"),
        "start_time",
        "start",
    ),
    Trouble(
        fault(
            "energy-with-flywheel",
            "Energy is missing with a flywheel of {where}.",
            remedy="Take a shorter run.step.",
        ),
        lambda wheel: not wheel.answers.residual < RESIDUAL,
        "residual",
    ),
    Trouble(
        fault(
            "flywheel-not-settled",
            "The turns do not close with a flywheel of {where}.",
            remedy="Raise run.settle_turns.",
        ),
        lambda wheel: not wheel.is_settled,
    ),
)
_TOO_SMALL = warning(
    "motor-too-small",
    "The load takes a torque of {mean} on average, rated is {rated}.",
    remedy="Take a larger motor, as no flywheel helps.",
    sizes={"N.m": "mean rated"},
)
_FLUCTUATION = warning(
    "fluctuation",
    "The speed fluctuates by {speed_ripple} with the study's flywheel, {flywheel}. Permitted is {permitted}.",
    sizes={("1", "percent"): "speed_ripple permitted", "kg.m2": "flywheel"},
)
_NONE_KEEPS = warning(
    "no-flywheel-keeps-it",
    "No flywheel of the list keeps the speed within {limit}. A larger one that was tried does not{larger}.",
)
_BEHIND = warning(
    "ripple-behind-flywheel",
    "With a flywheel of {flywheel} the motor's speed fluctuates by {motor_ripple}, the {driver}'s by "
    "{speed_ripple}. The shaft line makes the rest, which no flywheel on the motor's shaft evens.",
    remedy="{way}.",
    sizes={"kg.m2": "flywheel", ("1", "percent"): "motor_ripple speed_ripple"},
)
_HEAVIER_WORSE = warning(
    "heavier-flywheel-worse",
    "The speed fluctuates more, not less, with the heavier flywheel of {where}. The drive swings with it.",
    sizes={("1", "percent"): "speed_ripple"},
)
_LEAST = note(
    "least-flywheel",
    "A fluctuation of {permitted} takes a flywheel of {flywheel} at least (the search ends within {close} of that "
    "fluctuation). For a fluctuation of {permitted} no flywheel is needed{bare}. The hand formula asks for "
    "{by_hand}{left_out}. By the hand formula none is needed{none_by_hand}. {beside} lend {stored} of a cut's work. "
    "The RMS current is {current} of the rated. The start takes {start}. It is not recommended{heavy}. Over the "
    "limit: {excesses}. {fit} keeps all. No flywheel that was run keeps all{no_fit}.",
    sizes={("1", "percent"): "permitted stored current", "kg.m2": "flywheel by_hand", "s": "start"},
)


def _on_wheels(findings: FlywheelFindings, study: StudyRecord) -> None:
    """A warning for each kind of trouble, with all flywheels that have it; the study itself warns for its own
    flywheel."""
    plate = study.setup.config.plate
    too_small = findings.overloads_motor(plate)
    remedy = "a larger motor" if too_small else "a larger motor or flywheel"
    if plate is not None and too_small:
        study.findings.say(_TOO_SMALL, mean=findings.mean_torque, rated=plate.nameplate.torque)
    for trouble in _TROUBLES:
        wheels = [wheel for wheel in findings.wheels if trouble.has(wheel)]
        if trouble.limit and all(wheel.flywheel == findings.own for wheel in wheels):
            continue
        if wheels:
            amounts = {
                f"{wheel.flywheel:g}.{trouble.number}": trouble.amount(wheel)
                for wheel in wheels
                if trouble.number
            }
            where = ", ".join(map(trouble.words, wheels))
            limit = _limit(wheels[0], trouble.limit, study.setup)
            study.findings.say(trouble.code, where=where, motor=remedy, limit=limit, **amounts)


def _limit(wheel: Wheel, name: str, setup: StudySetup) -> str:
    """A limit of the motor, in words; the limit of the winding is a temperature, not a rise."""
    if name == "temperature":
        return number(setup.config.permitted_temperature[1], "K", full=False)
    check = wheel.checks.get(name)
    return "" if check is None else number(check.limit, check.unit, check.kind, full=False)


def _on_fluctuation(findings: FlywheelFindings, study: StudyRecord) -> None:
    """Warn where the flywheel of the study, or every flywheel, does not keep the permitted fluctuation."""
    permitted = findings.permitted_fluctuation
    wheel = next((wheel for wheel in findings.wheels if wheel.flywheel == findings.own), None)
    ripple = None if wheel is None else wheel.answers.speed_ripple
    if wheel is not None and ripple is not None and ripple > permitted:
        study.findings.say(
            _FLUCTUATION, STEADY, speed_ripple=ripple, flywheel=wheel.flywheel, permitted=permitted
        )
    # flywheels without a run are not judged
    if findings.is_searched and not any(wheel.keeps(permitted) for wheel in findings.wheels):
        limit = number(permitted, "1", "percent")
        study.findings.say(_NONE_KEEPS, limit=limit, larger="" if findings.least is None else None)
        _on_line(findings, study)
    _on_heavier(findings, study)
    if findings.least is not None:
        _on_least(findings, findings.least, study)


def _on_line(findings: FlywheelFindings, study: StudyRecord) -> None:
    """Warn where the motor runs evenly enough and the crank does not: the ripple is made behind the flywheel."""
    ripples = [(wheel, wheel.answers.motor_ripple) for wheel in findings.wheels]
    even = [
        wheel for wheel, ripple in ripples if ripple is not None and ripple <= findings.permitted_fluctuation
    ]
    if not even or not study.setup.drive.line.is_elastic:
        return
    best = min(even, key=lambda wheel: float(wheel.answers.speed_ripple))
    causes = remedies(driveline_of(study.setup.drive))
    way = ", and ".join([*causes, "stiffen the shafts"] if causes else ["take stiffer shafts"])
    study.findings.say(
        _BEHIND,
        flywheel=best.flywheel,
        motor_ripple=best.answers.motor_ripple,
        speed_ripple=best.answers.speed_ripple,
        way=way,
    )


def _on_heavier(findings: FlywheelFindings, study: StudyRecord) -> None:
    """Warn of flywheels with which the speed fluctuates more than with a lighter one."""
    running = [wheel for wheel in findings.wheels if wheel.answers.speed_ripple is not None]
    worse = [
        (heavier.flywheel, heavier.answers.speed_ripple)
        for lighter, heavier in pairwise(running)
        if heavier.answers.speed_ripple
        > max(findings.permitted_fluctuation, _WORSE * lighter.answers.speed_ripple)
    ]
    if worse:
        sizes = (f"{number(size, 'kg.m2')} ({number(ripple, '1', 'percent')})" for size, ripple in worse)
        ripples = {f"{size:g}.speed_ripple": ripple for size, ripple in worse}
        study.findings.say(_HEAVIER_WORSE, where=", ".join(sizes), **ripples)


def _on_least(findings: FlywheelFindings, least: Wheel, study: StudyRecord) -> None:
    """Note the least flywheel that keeps the permitted fluctuation, beside that of the hand formula; it is not
    recommended if another limit is still exceeded. None as a value leaves out the sentence that has it, and empty
    words keep a sentence."""
    answers, by_hand, is_needed = least.answers, findings.flywheel_by_hand, bool(least.flywheel)
    left_out = ""
    if by_hand > least.flywheel:
        left_out = ", as it leaves out that the motor's torque rises where the speed falls"
    elif answers.motor_ripple is not None and by_hand < least.flywheel:
        left_out = ", as it leaves out the shaft line"
    too_small = findings.overloads_motor(study.setup.config.plate)
    excesses = [*least.excesses, *(["mean torque"] if too_small else [])]
    fitting = None if too_small else next((w for _, w, _ in findings.rows if findings.permits(w)), None)
    study.findings.say(
        _LEAST,
        permitted=findings.permitted_fluctuation,
        flywheel=least.flywheel,
        close=number(CLOSE, "1", "percent", full=False) if is_needed else None,
        bare=None if is_needed else "",
        by_hand=by_hand or None,
        left_out=left_out,
        none_by_hand=None if by_hand else left_out,
        beside="With it flywheel and moving masses" if is_needed else "Without one the moving masses",
        stored=answers.stored_share_most,
        current=answers.current_share,
        start=answers.start_time,
        heavy="" if is_needed and excesses else None,
        excesses=", ".join(excesses) or None,
        fit=number(fitting.flywheel, "kg.m2") if fitting and excesses else None,
        no_fit="" if excesses and fitting is None else None,
    )
