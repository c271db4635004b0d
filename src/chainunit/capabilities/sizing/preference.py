"""The order of preference of drives: the choice of a drive engineer among drives that fit."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial

from ...reading.text import number
from ...study.relay import HEAVIEST, class_words
from .candidate import TOLERANCES, Candidate, Criterion, Standing
from .parts import price_words
from .table import PREFERENCE, PRICE

ALIKE = 0.05
"""Difference of utilisations, or relative difference of costs, up to which they count as equal, as the search for
a flywheel ends near a limit."""
STEP = 1.5
"""Ratio of the powers of neighbouring standard motors, at most."""

EVEN, MEAN, UNSTARTED, FAILED, SPARED = "even", "mean", "unstarted", "failed", "spared"
"""What ends the trials of flywheels, beside a check that more inertia makes worse: the torque is even, the mean
torque alone is too much, the heaviest does not start, its run fails, or the drive would not be chosen with one."""
STOPS: Mapping[str, str] = {
    "start": "of up to {J} were tried; with a heavier one its start takes too long",
    "starts": "of up to {J} were tried, with which too few starts are permitted",
    "inertia": "that sizing.inertia_ratio = {limit:g} permits suffices",
    EVEN: "of up to {J} were tried, with which its torque is even",
    MEAN: "helps, as the mean torque alone is more than the margin leaves of the rated one",
    UNSTARTED: "of up to {J} were tried; with a heavier one it does not start",
    FAILED: "of up to {J} were tried, with which its run failed",
    SPARED: "was tried, as with one it would come after the chosen drive, too",
}
"""By what ended them, the words on the trials of flywheels."""

ORDER: Mapping[Criterion, str] = {
    Criterion.MARGIN: "each limit is kept with the margin",
    Criterion.LARGER: "the power is at most {larger} times (sizing.larger) that of the smallest motor that fits so",
    Criterion.FIELD: "an inverter runs the motor at no more than 1.1 times its rated frequency",
    Criterion.GEAR: "one gear unit has the ratio",
    Criterion.START: "the start takes a relay of a lower trip class, at 20 % more current, too",
    Criterion.FLYWHEEL: "there is no flywheel",
    Criterion.POLES: "4 poles, then 6, then 2, then more than 6; a motor one step larger may have the better number",
    Criterion.POWER: "the power is smaller",
    Criterion.COST: "the price is lower, or without prices the mass of motor and flywheel",
    Criterion.USE: "the most used limit is used less",
}
"""The criteria in their order, in words; `larger` stands for the number of that key."""


_BY_PRICE = (
    "the price of motor and gear is lower; a drive of which a part has no price comes last, and so does one with a "
    "flywheel, which no catalogue prices"
)


def order_words(larger: float, objective: str) -> list[str]:
    """The criteria of `choice` in their order, in words. If the price is the objective, it stands in the place of the
    power that is up to `larger` times the smallest one."""
    texts = {
        criterion: _BY_PRICE if objective == PRICE and criterion is Criterion.LARGER else text
        for criterion, text in ORDER.items()
    }
    return [text.format(larger=f"{larger:g}") for text in texts.values()]


def poles_rank(poles: float) -> float:
    """The place of a number of poles in the order of preference; a smaller one is better."""
    return {4.0: 0.0, 6.0: 1.0, 2.0: 2.0}.get(poles, poles)


def rank(candidates: list[Candidate], larger: float, objective: str = PREFERENCE) -> None:
    """Order the candidates by rank and set their reasons. First come candidates that fit, by the order of preference,
    then candidates whose start alone is too hard for the gear, by the same order, then the others, by their largest
    utilisation; among candidates that do not start at all a larger motor comes first. For `larger` and `objective`
    see `chainunit.capabilities.sizing.table`."""
    for c in candidates:
        _judge(c)
    ranking, behind = _ranking([c for c in candidates if c.fits], larger, objective)
    hard, _ = _ranking([c for c in candidates if c.breaks_gear], larger, objective)
    others = [c for c in candidates if not c.fits and not c.breaks_gear]
    others.sort(key=lambda c: (not c.starts, c.violation, -c.power, c.motor.designation))
    candidates[:] = ranking + hard + others
    best = candidates[0]
    if not best.fits:
        best.verdict = Standing.INSUFFICIENT
        best.reason = f"the nearest of the drives that do not fit; {best.reason}"
        return
    for c in ranking[1:]:
        c.criterion = behind[id(c)]
        c.reason = f"{_behind(c, best)}; {c.reason}"
    best.verdict, best.reason = Standing.CHOSEN, f"{_chosen(best, ranking, objective)}; {best.reason}"


def _ranking(
    left: list[Candidate], larger: float, objective: str
) -> tuple[list[Candidate], dict[int, Criterion]]:
    """Candidates in the order of preference, and by the `id` of each but the first the criterion by which it was left
    out."""
    ranking = []
    behind: dict[int, Criterion] = {}
    while left:
        best, dropped = choice(left, larger, objective)
        behind = behind or dropped
        ranking.append(best)
        left.remove(best)
    return ranking, behind


def choice(
    fitting: Sequence[Candidate], larger: float, objective: str = PREFERENCE
) -> tuple[Candidate, dict[int, Criterion]]:
    """The preferred one of candidates that fit, and by the `id` of each other one the criterion by which it was
    left out."""
    rivals = sorted(fitting, key=lambda c: (c.motor.designation, c.gear))
    dropped: dict[int, Criterion] = {}
    for criterion, keep in _steps(larger, objective):
        equals = keep(rivals)
        dropped |= {id(c): criterion for c in rivals if not any(c is candidate for candidate in equals)}
        rivals = equals
    return rivals[0], dropped | {id(c): Criterion.USE for c in rivals[1:]}


def _steps(
    larger: float, objective: str
) -> Sequence[tuple[Criterion, Callable[[list[Candidate]], list[Candidate]]]]:
    """The criteria in the order of preference, each with the function that keeps the preferred ones of candidates."""
    most: Callable[[list[Candidate]], list[Candidate]] = partial(_powerful, most=larger)
    cheapest: Callable[[list[Candidate]], list[Candidate]] = partial(
        _least, value=lambda c: math.inf if c.price is None else c.price
    )
    return (
        (Criterion.MARGIN, lambda left: [c for c in left if c.leaves_margin] or _less_used(left)),
        (Criterion.PRICE, cheapest) if objective == PRICE else (Criterion.LARGER, most),
        (Criterion.FIELD, partial(_least, value=lambda c: float(c.weakened))),
        # a ratio may take two units, such as a belt before a gear
        (
            Criterion.GEAR,
            partial(_least, value=lambda c: float(c.unit is None or c.unit.noun == "belt and gear")),
        ),
        (Criterion.START, partial(_least, value=lambda c: c.trial.tolerant_class or 0)),
        (Criterion.FLYWHEEL, partial(_least, value=lambda c: float(c.drive.added_inertia > 0.0))),
        # the better number of poles may cost one step of power
        (Criterion.POWER, partial(_powerful, most=STEP)),
        (Criterion.POLES, partial(_least, value=lambda c: poles_rank(c.motor.nameplate.poles))),
        (Criterion.POWER, partial(_least, value=lambda c: c.power)),
        (Criterion.COST, _cheaper),
        (Criterion.USE, _less_used),
    )


def _least(left: list[Candidate], value: Callable[[Candidate], float]) -> list[Candidate]:
    least = min(map(value, left))
    return [c for c in left if value(c) == least]


def _powerful(left: list[Candidate], most: float) -> list[Candidate]:
    least = min(c.power for c in left)
    return [c for c in left if c.power <= most * least * (1.0 + 1e-9)]


def _cheaper(left: list[Candidate]) -> list[Candidate]:
    """Those with the lowest cost, to a twentieth: the prices, where each motor has one and no drive a flywheel, else
    the masses, where each is known."""
    costs = [c.price for c in left]
    if None in costs:
        costs = [c.mass for c in left]
    amounts = [cost for cost in costs if cost is not None]
    if len(amounts) < len(left):
        return left
    return [c for c, cost in zip(left, amounts, strict=True) if cost <= (1.0 + ALIKE) * min(amounts)]


def _less_used(left: list[Candidate]) -> list[Candidate]:
    least = min(c.use for c in left)
    return [c for c in left if c.use <= least + ALIKE]


# -- reasons


def _judge(c: Candidate) -> None:
    """Set verdict and reason of a candidate by its own checks."""
    c.criterion, suffix = None, ""
    if c.fits:
        loads = [check for name, check in c.checks.items() if name not in TOLERANCES]
        most = max(loads, key=lambda check: check.utilisation or 0.0)
        c.verdict = Standing.FITS if c.keeps_margin else Standing.BARELY
        c.reason = f"most used: {most.title}, {number(most.utilisation, '1', 'used')}"
    elif not c.checks:
        # the run failed, and the reason is already set
        c.verdict = Standing.REJECTED
    elif not c.starts:
        c.verdict, c.reason = Standing.REJECTED, _unstarted(c)
        suffix = _flywheels(c)
    else:
        over = [check for name, check in c.checks.items() if c.sizes[name] > 1.0]
        c.verdict, c.reason = Standing.REJECTED, "; ".join(check.excess for check in over)
        suffix = _flywheels(c) + (f"; {c.remedy}" if c.remedy else "")
    if c.disc:
        c.reason += f", with a flywheel of {c.flywheel_words}"
    c.reason += suffix


def _flywheels(c: Candidate) -> str:
    """The flywheels that were tried with a candidate that does not fit, in words that follow others."""
    if not c.stop:
        return ""
    limit = c.checks["inertia"].limit if "inertia" in c.checks else math.inf
    reason = STOPS[c.stop].format(J=number(c.heaviest, "kg.m2"), limit=limit)
    return f"; {'no flywheel' if c.stop in ('inertia', MEAN, SPARED) else 'flywheels'} {reason}"


def _unstarted(c: Candidate) -> str:
    """The reason of a candidate that does not bring the machine up to speed."""
    if c.trial.stall_angle is None:
        start = c.checks.get("start")
        late = f" in the permitted {number(start.limit, 's')}" if start else ""
        if c.trial.failed_angle is not None:
            angle = f"{number(c.trial.failed_angle, 'rad')} of the {c.drive.driver_noun}"
            return f"it brings the machine up to speed from 0 deg, but not from {angle}{late}"
        return f"it does not bring the machine up to speed{late}"
    return (
        f"without a flywheel it stalls at {number(c.trial.stall_angle, 'rad')} of the {c.drive.driver_noun}"
    )


def _chosen(best: Candidate, ranking: Sequence[Candidate], objective: str) -> str:
    """The reason for the chosen candidate."""
    if not best.keeps_margin:
        return f"no motor keeps the margin of {_margin(best)}; the nearest to it"
    if objective == PRICE:
        if best.price is None:
            return "the first that fits, of drives of which none has a price for each part"
        return f"the cheapest that fits: {price_words(best.price)} without a torque limiter"
    smaller = [c for c in ranking[1:] if c.keeps_margin and c.power < best.power]
    if not smaller:
        barely = any(c.power < best.power for c in ranking[1:])
        return (
            f"the smallest that keeps the margin of {_margin(best)}" if barely else "the smallest that fits"
        )
    least = min(c.power for c in smaller)
    # the one of the smallest that comes farthest in the order of preference
    rival = max((c for c in smaller if c.power == least), key=lambda c: [*Criterion].index(c.criterion))
    name = f"{rival.motor.designation}, the smallest that fits,"
    if rival.criterion is Criterion.FIELD:
        return f"runs at {number(best.trial.frequency, 'Hz')}, where {name} {_weakened(rival)}"
    if rival.criterion is Criterion.GEAR:
        return f"takes one unit, where {name} takes {_units(rival)}"
    if rival.criterion is Criterion.START:
        return f"its start takes a relay {_class(best)}, the start of {name} one {_class(rival)}"
    if rival.criterion is Criterion.FLYWHEEL:
        return f"needs no flywheel, where {name} needs one of {rival.flywheel_words}"
    return f"has {best.motor.nameplate.poles:g} poles, where {name} has {rival.motor.nameplate.poles:g}"


def _behind(c: Candidate, best: Candidate) -> str:
    """The reason why a candidate that fits comes after the best one."""
    if c.criterion is Criterion.PRICE:
        if c.drive.added_inertia:
            return "its flywheel has no price"
        if c.price is None:
            lacking = " and ".join(part.kind for part in c.parts if part.price is None)
            return f"its {lacking} {'have' if ' and ' in lacking else 'has'} no price"
        return f"dearer: {price_words(c.price)}"
    if c.criterion is Criterion.COST:
        if c.price is not None:
            return "dearer than the chosen one"
        with_flywheel = " with its flywheel" if c.disc else ""
        return f"heavier than the chosen one: {number(c.mass, 'kg')}{with_flywheel}"
    if c.criterion is Criterion.USE:
        is_more = c.use > best.use + ALIKE
        return "more used than the chosen one" if is_more else "as good as the chosen one"
    poles = (candidate.motor.nameplate.poles for candidate in (c, best))
    return {
        Criterion.MARGIN: f"leaves less than the margin of {_margin(c)}",
        Criterion.FIELD: f"{_weakened(c)}",
        Criterion.GEAR: f"its ratio takes {_units(c)}",
        Criterion.START: f"its start takes a relay {_class(c)}, the start of the chosen one {_class(best)}",
        Criterion.FLYWHEEL: "needs a flywheel, the chosen one none",
        Criterion.POLES: "{:g} poles, where {:g} are to be had".format(*poles),
    }.get(c.criterion or Criterion.POWER, "larger than needed")


def _units(c: Candidate) -> str:
    return "two gear units" if c.unit is None else f"a {c.unit.title}"


def _weakened(c: Candidate) -> str:
    """The field weakening of a candidate, in words."""
    rated = number(c.motor.nameplate.frequency, "Hz")
    return (
        f"runs at {number(c.trial.frequency, 'Hz')} in field weakening, with less torque than at its {rated}"
    )


def _margin(c: Candidate) -> str:
    return number(c.margin, "1", "percent", full=False)


def _class(c: Candidate) -> str:
    """The class of the relay for a start, in words that follow the noun."""
    trip_class = c.trial.tolerant_class or 0
    return class_words(trip_class) if trip_class > HEAVIEST else f"of class {trip_class}"
