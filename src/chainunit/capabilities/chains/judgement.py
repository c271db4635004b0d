"""The verdict on organs as chains, and the remarks on them.

Chains are a good model as long as their energy balance is kept, no rod folds through its stop, and the peaks do not
depend on the start.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from ...study.events import Jam
from ...study.measures import Answers
from ...study.quantiles import HIGH, runs_needed
from ...study.record import StudyRecord
from ...study.remark import fault, note, warning
from ...study.verdict import RESIDUAL, SETTLING, START, STEADY, TOPICS, Reason, Topic, Verdict, balance_faults
from .analysis import rods_of
from .result import ChainResult
from .table import ChainOrgans

CONSTANT = "constant"
"""Name of the runs of chains at constant speed among the judged runs."""
_TOPICS: Mapping[str, Topic] = {
    **TOPICS,
    "folded through": Topic(
        "rods fold through their stop",
        fault("model-folded-through", "Rods that fold through their stop: {where}."),
        "raise chain.fold_stiffness, or assume that the machine breaks",
    ),
    "folded": Topic(
        "rods meet the stop between them, whose stiffness is assumed",
        warning("model-folded", "Rods that fold and meet the stop between them: {where}."),
    ),
    "slack": Topic(
        "rods go slack and snatch: a single peak is no prediction",
        warning(
            "model-slack",
            "Share of the time with a slack rod (no single peak of a snatching chain is a prediction): {where}.",
        ),
    ),
    "starts": Topic(
        "the starts differ so much that they do not determine the quantile of peaks",
        warning("model-starts", "Turns that count as independent, too few for the quantile: {where}."),
        "raise chain.starts",
    ),
}
"""By kind of fault, its words."""


_CHAINS = note(
    "chains",
    "The organs are chains of {walls} + {webs} rods. Their damping (eta {eta} N m2 s, ends {ends} N m s) and their "
    "folding are assumed.",
)
_FEW_RODS = note(
    "few-rods", "Chains: {rods} rods have {frequencies} natural frequencies. 8 rods show a chain well."
)
_SPEED_TO_AVOID = warning(
    "speed-to-avoid",
    "Chains: the crank speed lies in a range to avoid, {band} ({why}).",
    sizes={("rad/s", "speed"): "speed"},
)
_SPEED_MISSING = warning(
    "speed-missing", "Chains: the speed {speed} is missing ({why}).", sizes={("rad/s", "speed"): "speed"}
)
_ENERGY = fault(
    "energy-of-chains",
    "Chains: the energy residual reaches {residual} of the energy moved.",
    remedy="Lower chain.fold_stiffness.",
    sizes={"1": "residual"},
)
_NOT_FELT = warning(
    "lump-not-felt",
    "{run}: the drive hardly feels the lump, as the web folds before it on this stroke. On the other stroke the web "
    "is pulled.",
    remedy="Try crank_angle = {angle}.",
)


def verdict_on(study: StudyRecord, speed: float, actual: float, residuals: Mapping[str, float]) -> Verdict:
    """The verdict on the chains of a study, by its runs and, where these were made, the turns at constant speed: by
    the folds and the slack of their rods, their energy residuals and the number of turns. For arguments see
    `chains`."""
    runs = study.runs
    answers: dict[str, Answers | None] = {**runs.answers, START: runs.start, SETTLING: runs.settling}
    folds = {name: a.fold_largest for name, a in answers.items() if a is not None}
    slack = {name: a.slack_time for name, a in answers.items() if a is not None}
    residuals, turns = dict(residuals), math.inf
    if (findings := ChainResult.found_in(study.findings)) is not None:
        at_constant_speed = findings.own
        folds[CONSTANT], slack[CONSTANT] = at_constant_speed.fold_largest, at_constant_speed.slack_time
        residuals[CONSTANT] = at_constant_speed.energy_residual
        turns = at_constant_speed.independent_turns
    limit, least_turns = study.setup.config.table("chain").fold_limit, runs_needed(HIGH)
    return chains(speed, residuals, folds, limit, slack, turns, least_turns, actual=actual)


def chains(
    speed: float,
    residuals: Mapping[str, float],
    folds: Mapping[str, float],
    fold_limit: float,
    slack: Mapping[str, float],
    independent: float,
    least_turns: float,
    *,
    actual: float | None = None,
) -> Verdict:
    """The verdict on organs as chains.

    Parameters
    ----------
    speed : crank speed at which the model is judged [rad/s]
    residuals, folds, slack : by run, the energy residual over the energy moved, the largest angle between two rods
        [rad], the share of the time with a slack rod
    fold_limit : angle at which two rods meet the stop between them [rad]
    independent, least_turns : turns at constant speed that count as independent, and the number that the quantile
        needs
    actual : crank speed in the runs, if that is another [rad/s]
    """
    reasons: list[Reason] = []
    for run, fold in folds.items():
        if fold > math.pi:
            reasons.append(
                Reason("folded through", "fold_largest", fold, math.pi, "rad", run, grave=run == STEADY)
            )
        elif fold > fold_limit:
            reasons.append(Reason("folded", "fold_largest", fold, fold_limit, "rad", run))
    for run, share in slack.items():
        if share > 0.0:
            reasons.append(Reason("slack", "slack_time", share, 0.0, "1", run, "percent"))
    if independent < least_turns:
        reasons.append(Reason("starts", "independent_turns", independent, least_turns, "1"))
    titles = {CONSTANT: "chains at constant speed"}
    reasons += balance_faults(residuals)
    return Verdict("organs", "chains", speed, tuple(reasons), actual, topics=_TOPICS, titles=titles)


def remark_on(study: StudyRecord) -> None:
    """The remarks on chains."""
    chain: ChainOrgans = study.setup.config.table("chain")
    result = ChainResult.found_in(study.findings)
    walls, webs = rods_of(study.setup.drive)
    study.findings.say(
        _CHAINS, walls=f"{walls}", webs=f"{webs}", eta=f"{chain.eta:g}", ends=f"{chain.end_damping:g}"
    )
    if walls + webs < 4:
        study.findings.say(_FEW_RODS, rods=f"{walls + webs}", frequencies=f"{walls + webs - 2}")
    _on_folding(study)
    if result is None:
        return
    speed = result.own.speed
    for band in result.avoid:
        if band.low <= speed <= band.high:
            study.findings.say(_SPEED_TO_AVOID, band=str(band), why=band.why, speed=speed)
    for missing, why in result.failures.items():
        study.findings.say(_SPEED_MISSING, why=str(why), speed=missing)
    residual = max(n.energy_residual for n in result.speeds)
    if not residual < RESIDUAL:
        study.findings.say(_ENERGY, residual=residual)


FELT = 1.1
"""The drive hardly feels a lump whose peak torque is below this multiple of the peak in steady running."""


def _on_folding(study: StudyRecord) -> None:
    """Warn of lumps on the stroke on which the web folds: the drive feels a lump only on the other stroke."""
    steady = study.runs.answers.get(STEADY)
    for run, event in study.setup.config.events.items():
        answers = study.runs.answers.get(run)
        if not isinstance(event, Jam) or steady is None or answers is None:
            continue
        if answers.crank_torque_peak < FELT * steady.crank_torque_peak:
            angle = math.degrees((event.p.crank_angle + math.pi) % (2.0 * math.pi))
            study.findings.say(_NOT_FELT, run, run=study.runs.title_of(run), angle=f'"{angle:.4g} deg"')
