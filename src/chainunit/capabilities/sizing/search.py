"""Sizing of the drive: which motor of the catalogue, behind which gear, with which flywheel.

First the cycle is computed by inverse dynamics. Then every candidate is simulated: a start
under load, steady running, and steady running with all feed on one side. Each check is a utilisation, value
over limit.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import count
from pathlib import Path

from ...batch.transients import can_run
from ...core.errors import InputError
from ...drives.catalogue import CatalogueMotor, catalogue, high_slip_motors
from ...drives.catalogue_gears import CatalogueGear
from ...drives.gear_ratios import UNITS, nearest
from ...fmu.backends import Backend
from ...reading.text import number
from ...study.drive_fmus import export_drive
from ...study.limits import SPEED_DEVIATION
from ...study.quantiles import HIGH
from ...study.relay import HEAVIEST, LIGHT, class_words
from ...study.sections import SOFTER
from ...work.progress import TaskProgress
from .candidate import Candidate
from .duty import Duty
from .findings import SizingFindings
from .inverter import inverter_needs
from .motor_trials import EVENED, WORSE_WITH_INERTIA, MotorTrials
from .preference import SPARED, STEP, choice, poles_rank, rank
from .table import HIGH_SLIP, PRICE, Sizing
from .task import SizingTask

_WISHES: Mapping[str, str] = {"speed": "fluctuation", "inertia": "inertia_ratio"}
"""By check, the demand that only a wish of the file makes."""
_SAME_FREQUENCY = 0.01
"""Relative difference of rated frequencies that count as equal."""
_WORSE_WITH_POWER = ("gear_start", "gear_service")
"""Checks that a larger motor makes worse."""


def motors_on_offer(task: SizingTask, own_motors: Sequence[CatalogueMotor]) -> list[CatalogueMotor]:
    """The motors of the catalogue for the requested frequency with the requested numbers of poles, the smallest
    first, with the user's `own_motors`.

    Raises
    ------
    InputError
        for a catalogue that has no such motor, and as `check_ratios`.
    """
    limits, tables = task.plan.demands, task.tables
    packaged = high_slip_motors() if task.plan.motors == HIGH_SLIP else catalogue()
    offered = own_motors if task.plan.own_only else [*packaged, *own_motors]
    motors = [m for m in offered if limits.poles_least <= m.nameplate.poles <= limits.poles_most]
    if not motors and task.plan.own_only:
        raise InputError(
            "sizing.own_only: the catalogues have no motor of their own with so many poles; name one by "
            "catalogue, or leave it out",
            "sizing.own_only",
        )
    motors.sort(key=lambda m: (m.nameplate.power, poles_rank(m.nameplate.poles)))
    if not motors:
        raise InputError(
            f"sizing.poles_least = {limits.poles_least:g}, sizing.poles_most = {limits.poles_most:g}: the catalogue "
            "has no motor with so many poles"
        )
    frequencies = sorted({float(m.nameplate.frequency) for m in motors})
    motors = [m for m in motors if abs(m.nameplate.frequency / limits.frequency - 1.0) < _SAME_FREQUENCY]
    if not motors:
        text = " or ".join(f'"{frequency:g} Hz"' for frequency in frequencies)
        raise InputError(
            f"sizing.frequency = {limits.frequency:g} Hz: the catalogue has no such motor with so many poles; must "
            f"be {text}",
            "sizing.frequency",
        )
    if limits.gear_torque and not task.gears:
        text = "sizing.gear_torque: is of gears of a catalogue; name one by catalogue, or leave it out"
        raise InputError(text, "sizing.gear_torque")
    if tables.start != "inverter" and "gear.ratio" not in tables.given:
        key = "sizing.ratios" if task.plan.ratios else "sizing.gear_kind"
        check_ratios(task.plan.offered, task.operation.crank_speed, motors, key)
        of_gears = [gear.data.ratio for gear in task.gears]
        check_ratios(of_gears, task.operation.crank_speed, motors, "catalogue")
    return motors


def size(
    task: SizingTask,
    motors: list[CatalogueMotor],
    duty: Duty,
    folder: Path,
    progress: TaskProgress,
    backend: Backend | None = None,
) -> SizingFindings:
    """Choose one of the `motors` for the `duty`. At least `sizing.candidates` motors are tried, from small to large,
    and then more until one fits with the margin and none that follows could be preferred to it, or the catalogue
    ends.

    Parameters
    ----------
    folder : where the FMUs are written
    progress, backend : see `chainunit.study.run.run_study`
    """
    numbers = duty.numbers
    notes = ["Catalogue data are typical; iron losses are not in the motor model."]
    if task.machine.in_place:
        notes.append(
            f"Peaks of the cycle and the flywheel are those of single turns, {100 * HIGH:g} % quantile over all "
            "turns of all starts of the chains."
        )
    # a flywheel evens the torque of a cycle, but gives no mean power
    power = numbers.power_mean / (1.0 - task.plan.demands.margin)
    strong = [m for m in motors if m.nameplate.power >= power]
    if not strong:
        notes.append(
            "No motor of the catalogue gives the mean power of the cycle with the margin, "
            f"{number(power, 'W')}: the largest were tried."
        )
        strong = [m for m in motors if m.nameplate.power == motors[-1].nameplate.power]
    trials = MotorTrials(task, duty)
    if task.plan.objective == PRICE:
        notes += _without_price(strong, task.gears)
    trials = _with_files(trials, strong[0], folder, progress, backend)
    candidates = _search(trials, strong, progress)
    best = candidates[0]
    ends = _end_of_catalogue(best, motors), _cost_of_wishes(trials, strong, candidates, progress)
    best.reason += "".join(f"; {reason}" for reason in ends if reason)
    notes += [
        f"{c.motor.designation} would be preferred, but for its start: {c.reason}."
        for c in candidates[1:]
        if c.remedy
    ]
    notes += _needs(candidates[0], trials)
    tried = len({c.motor.designation for c in candidates})
    return SizingFindings(
        plan=task.plan,
        duty=duty,
        candidates=candidates,
        notes=notes,
        motors=len(motors),
        weak=len(motors) - len(strong),
        tried=tried,
        gears=task.gears,
        couplings=task.couplings,
    )


def _without_price(motors: Sequence[CatalogueMotor], gears: Sequence[CatalogueGear]) -> Iterator[str]:
    """The note on rows without a price, where the lowest price is wanted."""
    counts = {"motor": sum(m.price is None for m in motors), "gear": sum(g.price is None for g in gears)}
    nouns = [f"{n} {noun}{'s' if n > 1 else ''}" for noun, n in counts.items() if n]
    if nouns:
        have = "have" if sum(counts.values()) > 1 else "has"
        yield f"{' and '.join(nouns)} of the catalogues {have} no price: drives with them come last."
    if not gears:
        yield "The catalogues have no gear: the price is that of the motor alone."


def check_ratios(
    ratios: Sequence[float],
    crank_speed: float,
    motors: Sequence[CatalogueMotor],
    key: str = "sizing.ratios",
) -> None:
    """Refuse the ratios of that `key` with which none of the `motors`, the smallest first, keeps the speed of the
    crank [rad/s] on the line, at any slip up to the rated one. An inverter keeps the speed with any ratio.

    Raises
    ------
    InputError
        with the ratios that are needed.
    """
    if not ratios:
        return
    w = crank_speed
    needed: dict[float, float] = {}
    for plate in (motor.nameplate for motor in motors):
        least, most = plate.speed / w, plate.synchronous / w
        if any((1.0 - SPEED_DEVIATION) * least <= x <= (1.0 + SPEED_DEVIATION) * most for x in ratios):
            return
        needed.setdefault(plate.poles, least)
    needs = sorted((ratio, poles) for poles, ratio in needed.items())
    near, _ = min(needs, key=lambda pair: abs(math.log(pair[0] / nearest(pair[0], ratios))))
    choices = " or ".join(f"{number(ratio, '1', digits=2)} ({poles:g} poles)" for ratio, poles in needs)
    if key == "sizing.gear_kind":
        raise InputError(
            f'{key} = "none": no motor of the catalogue turns at {number(w, "rad/s", "speed")} on the line: '
            f"a ratio of about {choices} is needed; give another sizing.gear_kind, change run.crank_speed, or take "
            "an inverter (start)",
            key,
        )
    raise InputError(
        f"{key}: no ratio on offer brings the crank to {number(w, 'rad/s', 'speed')} with a motor of the "
        f"catalogue: about {choices} is needed, the nearest on offer is {nearest(near, ratios):g}; add such a ratio, "
        "change run.crank_speed, or take an inverter (start)",
        key,
    )


def _with_files(
    trials: MotorTrials, motor: CatalogueMotor, folder: Path, progress: TaskProgress, backend: Backend | None
) -> MotorTrials:
    """The trials of motors such as this one: on the compiled system where there is a loop for it, else by FMUs."""
    drive = trials.candidate(motor).drive
    if can_run() and backend != "python" and not drive.foreign_titles:
        return trials
    files, _ = export_drive(drive, folder, backend, lambda what: progress(what, 0.0, 1.0))
    return dataclasses.replace(trials, files=files)


def _search(trials: MotorTrials, motors: list[CatalogueMotor], progress: TaskProgress) -> list[Candidate]:
    """The candidates that `size` tries of the `motors`, in the order of their rank. The start of the best one is that
    from the worst crank angle; a candidate that fails in it makes room for the next."""
    demands, objective = trials.plan.demands, trials.plan.objective
    # a bisection without flywheels, one with them, and the candidates
    expected = 2 * len({m.nameplate.power for m in motors}).bit_length() + int(demands.candidates)
    simulated = count()

    def says(motor: CatalogueMotor) -> None:
        progress(f"simulating {motor.designation}", float(min(next(simulated), expected)), float(expected))

    candidates, least = _least_power(trials, motors, says)
    tried = {c.motor.designation for c in candidates}
    spared: list[CatalogueMotor] = []
    cheapest_gear = min((gear.price or math.inf for gear in trials.task.gears), default=0.0)
    untried = [m for m in motors if m.nameplate.power >= least and m.designation not in tried]
    if objective == PRICE:
        untried.sort(key=lambda m: m.price or math.inf)
    queue = iter(untried)
    following = next(queue, None)

    def is_over() -> bool:
        """Whether no motor of the queue can become the best one."""
        if following is None:
            return True
        if len(tried) < demands.candidates:
            return False
        if objective == PRICE and following.price is not None:
            prices = (c.price for c in candidates if c.keeps_margin and c.price is not None)
            return min(prices, default=math.nan) <= following.price + cheapest_gear
        return _is_settled(candidates, following, demands.larger)

    def next_spared() -> CatalogueMotor | None:
        """A motor that was tried without flywheels alone, and may become the best one with them."""
        return next((m for m in spared if not _comes_after(m, candidates, demands.larger)), None)

    while True:
        while following is not None and not is_over():
            says(following)
            # a larger motor may need no flywheel: then none of the others has to be tried with one
            is_larger = any(c.keeps_margin and c.power < following.nameplate.power for c in candidates)
            is_bare = is_larger and objective != PRICE and trials.task.tables.start != "inverter"
            tries = trials.candidates_of(following, trials.with_least_boost if is_bare else None)
            if is_bare and not any(c.keeps_margin for c in tries):
                spared.append(following)
                for c in tries:
                    c.stop = SPARED
            candidates += tries
            tried.add(following.designation)
            following = next(queue, None)
        while (motor := next_spared()) is not None:
            says(motor)
            spared.remove(motor)
            candidates[:] = [c for c in candidates if c.motor is not motor] + trials.candidates_of(motor)
        _from_all_angles(trials, candidates)
        if is_over() and next_spared() is None:
            break
    if candidates[0].fits and candidates[0].drive.added_inertia:
        progress("a larger motor without a flywheel", 0.0, 1.0)
        if (larger := _without_flywheel(trials, motors, candidates)) is not None:
            candidates.append(larger)
            _from_all_angles(trials, candidates)
    hard = [c for c in candidates if c.breaks_gear]
    best, _ = choice([candidates[0], *hard], demands.larger, objective) if hard else (candidates[0], {})
    if best.breaks_gear:
        progress("a softer start", 0.0, 1.0)
        best.remedy = _remedy(trials, best)
        rank(candidates, demands.larger, objective)
    return candidates


def _least_power(
    trials: MotorTrials, motors: Sequence[CatalogueMotor], says: Callable[[CatalogueMotor], None]
) -> tuple[list[Candidate], float]:
    """The least power [W] of the `motors`, the smallest first, with which one is strong enough, and the candidates
    that were tried for it: among them are all of the power below. 0 where none suffices.

    A motor that is too weak takes a run for each flywheel. So the power is bisected, as a larger motor is stronger:
    first without flywheels, and below the power that this gives with them."""
    powers = sorted({m.nameplate.power for m in motors})
    candidates: list[Candidate] = []

    def motors_of(power: float) -> list[CatalogueMotor]:
        same = [m for m in motors if m.nameplate.power == power]
        return sorted(same, key=lambda m: poles_rank(m.nameplate.poles))

    def suffices_bare(n: int) -> bool:
        """Whether the best motor of the power number `n` is strong enough without a flywheel."""
        motor = motors_of(powers[n])[0]
        says(motor)
        return not _is_weak(trials.candidates_of(motor, trials.with_least_boost)[-1])

    def suffices(n: int) -> bool:
        """Whether a motor of the power number `n` is strong enough, with or without a flywheel."""
        for motor in motors_of(powers[n]):
            says(motor)
            tries = trials.candidates_of(motor)
            candidates.extend(tries)
            if not all(map(_is_weak, tries)):
                return True
        return False

    weak, strong = -1, 0
    while not suffices_bare(strong):
        weak = strong
        if weak == len(powers) - 1:
            return [], 0.0
        strong = min(2 * strong + 1, len(powers) - 1)
    strong = _bisected(suffices_bare, weak, strong)
    strong = _bisected(suffices, -1, strong)
    return candidates, powers[strong]


def _bisected(suffices: Callable[[int], bool], weak: int, strong: int) -> int:
    """The least number above `weak` that `suffices`, as `strong` does and `weak` does not."""
    while strong - weak > 1:
        middle = (weak + strong + 1) // 2
        if suffices(middle):
            strong = middle
        else:
            weak = middle
    return strong


def _is_weak(c: Candidate) -> bool:
    """Whether a candidate exceeds a limit that a larger motor improves, or its run failed."""
    return not c.checks or any(c.exceeds(name) for name in c.checks if name not in _WORSE_WITH_POWER)


def _cost_of_wishes(
    trials: MotorTrials, motors: list[CatalogueMotor], candidates: list[Candidate], progress: TaskProgress
) -> str:
    """The wishes of the file that decide the choice, and the choice without them, in words; empty if none decides.
    Motors up to the largest one among the rivals of the best candidate are tried without the wishes."""
    best, demands = candidates[0], trials.plan.demands
    rivals = [c for c in candidates if not best.fits or c.power <= best.power]
    deciding = {name for c in rivals for name in _wishes_of(c)}
    wishes = [key for name, key in _WISHES.items() if name in deciding]
    if not wishes:
        return ""
    names = " and ".join(f"sizing.{key} = {_value(demands, key)}" for key in wishes)
    progress(f"the choice without {names}", 0.0, 1.0)
    largest = max(c.power for c in rivals)
    small = [m for m in motors if m.nameplate.power <= largest]
    other = _search(_without_wishes(trials, wishes), small, progress)[0]
    is_same = (other.motor, other.gear) == (best.motor, best.gear)
    if not other.fits or (best.fits and is_same and other.drive.added_inertia >= best.drive.added_inertia):
        return ""
    return f"{names} {'decide' if len(wishes) > 1 else 'decides'}: else {_would_do(other, best)}"


def _without_wishes(trials: MotorTrials, wishes: Sequence[str]) -> MotorTrials:
    """The same trials without the limits of these `wishes`, for the first motor that fits."""
    demands = dataclasses.replace(trials.plan.demands, candidates=1, **dict.fromkeys(wishes, math.inf))
    plan = dataclasses.replace(trials.plan, demands=demands)
    return dataclasses.replace(trials, task=dataclasses.replace(trials.task, plan=plan))


def _would_do(other: Candidate, best: Candidate) -> str:
    """Another candidate as the choice, in words, with its start and its price beside those of a `best` that fits."""
    wheel = f"a flywheel of {other.flywheel_words}" if other.disc else "no flywheel"
    text = f"{other.motor.designation} with {wheel} would do"
    if not best.fits:
        return text
    starts = [c.checks["gear_start"].value for c in (best, other) if "gear_start" in c.checks]
    if len(starts) == 2:
        best_start, other_start = (number(torque, "N.m") for torque in starts)
        text += f", and its start would put {other_start} on the gear in place of {best_start}"
    if best.price is not None and other.price is not None:
        text += f", at a price of {other.price:g} in place of {best.price:g}"
    return text


def _wishes_of(c: Candidate) -> set[str]:
    """The checks of wishes that alone reject a candidate, or for which it has its flywheel."""
    over = {name for name in c.checks if c.exceeds(name)}
    sized = {max((c.sizes.get(name, 0.0), name) for name in EVENED)[1]} if c.drive.added_inertia else set()
    other_limits = over - set(_WISHES) - (set(WORSE_WITH_INERTIA) if c.drive.added_inertia else set())
    return set() if other_limits else (over | sized) & set(_WISHES)


def _value(demands: Sizing, key: str) -> str:
    """The value of a wish in words."""
    return number(getattr(demands, key), "1", "percent" if key == "fluctuation" else "", full=False)


def _end_of_catalogue(best: Candidate, motors: Sequence[CatalogueMotor]) -> str:
    """Words on the end of the catalogue, where it decides: its `motors`, the smallest first, have none that is small
    enough, or large enough."""
    least, most = motors[0].nameplate.power, motors[-1].nameplate.power
    if not best.fits:
        return f"the catalogue ends at {number(most, 'W')}" if best.power == most else ""
    if best.power > least or STEP * best.use > 1.0 - best.margin:
        return ""
    return f"the catalogue begins at {number(least, 'W')}, else a smaller motor would do"


def _remedy(trials: MotorTrials, c: Candidate) -> str:
    """What makes a candidate fit whose start alone is too hard for the gear: on the line it is tried with a soft
    starter."""
    tables = trials.task.tables
    start = tables.start
    if start != "direct":
        return SOFTER[start]
    soft_tables = dataclasses.replace(tables, start="soft")
    operation = dataclasses.replace(trials.task.operation, starter_time=soft_tables.starter_time)
    softly = dataclasses.replace(
        trials, task=dataclasses.replace(trials.task, tables=soft_tables, operation=operation)
    )
    soft = softly.candidate(c.motor, c.drive.ratio, c.sold)
    soft.drive = dataclasses.replace(soft.drive, added_inertia=c.drive.added_inertia)
    if not softly.judged(soft, worst_start=True).fits:
        return SOFTER["direct"]
    check = soft.checks["gear_start"]
    return f'with start = "soft" it fits, and puts {number(check.value, check.unit)} on the gear in a start'


def _from_all_angles(trials: MotorTrials, candidates: list[Candidate]) -> None:
    """Rank the candidates, with the start of the best one from all crank angles."""
    larger, objective = trials.plan.demands.larger, trials.plan.objective
    rank(candidates, larger, objective)
    while candidates[0].fits and not candidates[0].worst_start:
        candidates[0] = trials.with_least_boost(candidates[0], worst_start=True)
        rank(candidates, larger, objective)


def _needs(best: Candidate, trials: MotorTrials) -> Iterator[str]:
    """What has to be ordered beside the usual parts: a relay for a heavy start or the settings of the inverter, a
    second gear unit."""
    relay_class = best.trial.tolerant_class or 0
    if relay_class > LIGHT:
        relay = f"{'of ' if relay_class <= HEAVIEST else ''}{class_words(relay_class)}"
        yield f"The start takes an overload relay {relay}; one of class {LIGHT} may trip in it."
    if best.drive.follows:
        yield from inverter_needs(best, trials.has_given_boost)
    if best.unit is None:
        unit = UNITS[trials.plan.gear_kind][-1]
        end = f"ends at about {unit.largest:g}"
        if trials.is_made:
            end = f"even of makers with large ratios ends at about {unit.made:g}"
        yield f"A ratio of {best.drive.ratio:g} takes two gear units: a {unit.title} {end}."


def _is_settled(candidates: list[Candidate], following: CatalogueMotor, larger: float) -> bool:
    """Whether a candidate keeps the margin, and neither the `following` motor nor a larger one could be
    preferred to the best."""
    keeping = [c for c in candidates if c.keeps_margin]
    if not keeping:
        return False
    best, _ = choice(keeping, larger)
    if _is_light(best) and not best.drive.added_inertia and _has_poles_as_good(best, following):
        return best.power < following.nameplate.power
    return following.nameplate.power > larger * min(c.power for c in keeping)


def _comes_after(motor: CatalogueMotor, candidates: list[Candidate], larger: float) -> bool:
    """Whether a `motor` that needs a flywheel comes after the best of the candidates that keep the margin."""
    power = motor.nameplate.power
    keeping = [c for c in candidates if c.keeps_margin]
    if not any(c.power < power for c in keeping):
        return False
    best, _ = choice(keeping, larger)
    is_smaller = best.power < power and _has_poles_as_good(best, motor)
    return _is_light(best) and (is_smaller or not best.drive.added_inertia)


def _is_light(c: Candidate) -> bool:
    """Whether a drive has one gear unit, a light start, and no field weakening: no other one is better in these."""
    return c.unit is not None and (c.trial.start_class or 0) <= LIGHT and not c.weakened


def _has_poles_as_good(c: Candidate, motor: CatalogueMotor) -> bool:
    return poles_rank(c.motor.nameplate.poles) <= poles_rank(motor.nameplate.poles)


def _without_flywheel(
    trials: MotorTrials, motors: list[CatalogueMotor], candidates: list[Candidate]
) -> Candidate | None:
    """The next larger motor that fits without a flywheel, of the best candidate's number of poles; None where
    the candidates have one, or the `motors` none."""
    best = candidates[0]
    if any(c.keeps_margin and not c.drive.added_inertia and c.power >= best.power for c in candidates):
        return None
    tried = {c.motor.designation for c in candidates}
    poles = best.motor.nameplate.poles
    larger = [
        m
        for m in motors
        if m.nameplate.poles == poles and m.nameplate.power > best.power and m.designation not in tried
    ]
    # halve the list: above a motor that is too weak, below one that fits or is too hard on the gear in its start
    smallest = None
    while larger:
        middle = len(larger) // 2
        candidate = trials.candidates_of(larger[middle], trials.with_least_boost)[-1]
        if candidate.keeps_margin:
            smallest = candidate
        larger = larger[middle + 1 :] if _is_weak(candidate) else larger[:middle]
    return smallest
