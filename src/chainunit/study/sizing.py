"""Sizing of the drive: which motor of the catalogue, behind which gear, with which flywheel.

First the cycle is computed by inverse dynamics. Then every candidate is simulated: a start
under load, steady running, and steady running with all feed on one side. Each check is a utilisation, value
over limit. Hand formulas (RMS torque, flywheel, relay) are here and in `protection`; all else is read from
the runs.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from ..core.errors import InputError, InterruptedRunError, RunError
from ..core.native.compilers import compiler
from ..drives.catalogue import CatalogueMotor, catalogue
from ..drives.gear_ratios import UNITS, gear_unit, next_ratio, ratio_on_offer
from ..fmu.backends import Backend
from ..reading.text import entries, number
from ..work.progress import Report
from .candidate import Candidate, Standing
from .catalogue_drive import catalogue_drive, check_ratios, is_of_a_gear, with_wheel
from .config import Config
from .duty import CycleNumbers, Duty, duty_of
from .inverter import inverter_needs, least_boost, misses_by_a_hair
from .limits import SPEED_DEVIATION
from .preference import ORDER, choice, poles_rank, rank
from .quantiles import HIGH
from .relay import HEAVIEST, LIGHT, class_words
from .sections import SOFTER
from .sizing_table import SIZING_KEYS
from .trial import try_motor

_EVENED = ("speed", "rms_torque", "peak_torque", "temperature")
"""Checks that a flywheel improves: it evens the speed, and with it the torque of a varying load."""
_WORSE_WITH_INERTIA = ("start", "inertia")
"""Checks that a flywheel makes worse."""
_WORSE_WITH_POWER = ("gear_start",)
"""Checks that a larger motor makes worse."""
_SMALL = 0.1
"""Inertia of a flywheel, relative to all other inertia, below which it hardly evens the speed."""
_TOLERANCE = SPEED_DEVIATION - 0.005
"""Relative deviation of the crank speed up to which a ratio of a series is taken; the rest of the permitted
deviation is for the slip in the run."""


@dataclass
class SizingResult:
    """Cycle, candidates in the order of their rank, and the chosen candidate."""

    config: Config
    duty: Duty
    candidates: list[Candidate]
    notes: list[str]
    motors: int
    """number of motors of the catalogue with a permitted number of poles; `candidates` are those that were
    tried"""
    weak: int = 0
    """number of motors that were left out, as their rated power does not give the mean power of the cycle with the
    margin"""

    @property
    def chosen_candidate(self) -> Candidate | None:
        """The candidate that was chosen, if one fits."""
        return self.candidates[0] if self.candidates[0].verdict is Standing.CHOSEN else None

    @property
    def best(self) -> Candidate:
        """The candidate that the study goes on with: the chosen one, or the nearest where none fits."""
        return self.candidates[0]

    @property
    def answer(self) -> str:
        """The result of sizing, in a sentence; with the words of `rank`."""
        count = f"{len(self.candidates)} of {self.motors} were tried"
        if self.weak:
            count += f", {self.weak} {'is' if self.weak == 1 else 'are'} too weak by the nameplate"
        best = f"{self.best.motor.designation}: {self.best.reason}"
        return (
            f"{best} ({count})"
            if self.chosen_candidate
            else f"no motor of the catalogue fits ({count}); {best}"
        )

    @property
    def trade(self) -> tuple[Candidate, Candidate] | None:
        """The smallest motor that fits with a flywheel, and the next larger one that fits without; None where
        the candidates do not have both."""
        fitting = [c for c in self.candidates if c.fits]
        fitting.sort(key=lambda c: (not c.keeps_margin, c.power, poles_rank(c.motor.nameplate.poles)))
        with_one = next((c for c in fitting if c.drive.flywheel), None)
        if with_one is None:
            return None
        bare = (c for c in fitting if not c.drive.flywheel and c.power >= with_one.power)
        without = next(bare, None)
        return None if without is None else (with_one, without)

    def as_dict(self) -> dict[str, Any]:
        """Ready for JSON, each number with its unit."""
        best = self.best
        assert self.config.sizing is not None
        return {
            "asked": entries(self.config.sizing, with_titles=True) | _words_asked(self.config),
            **self.duty.as_dict(),
            "flywheel": entries(best.flywheel_numbers(), with_titles=True),
            "tried": {"value": len(self.candidates), "unit": "1"},
            "motors": {"value": self.motors, "unit": "1"},
            "weak": {"value": self.weak, "unit": "1"},
            "candidates": [c.as_dict() for c in self.candidates],
            "order": [words.format(larger=f"{self.config.sizing.larger:g}") for words in ORDER.values()],
            "trade": None if self.trade is None else [self.candidates.index(c) for c in self.trade],
            "chosen": self.candidates.index(self.chosen_candidate) if self.chosen_candidate else None,
            "nearest": None if self.chosen_candidate else self.candidates.index(best),
            "notes": self.notes,
        }


def _words_asked(config: Config) -> dict[str, Any]:
    """The words and lists of the table [sizing], by key, without empty ones."""
    words = {key: config.choices[f"sizing.{key}"] for key in SIZING_KEYS}
    return {key: x for key, x in words.items() if x}


def size(config: Config, folder: Path, report: Report, backend: Backend | None = None) -> SizingResult:
    """Choose a motor of the catalogue for the study. At least `sizing.candidates` motors are tried, from
    small to large, and then more until one fits with the margin, and none that follows could be preferred to
    it, or the catalogue ends.

    Parameters
    ----------
    config : a study with `sizing`
    folder : where the FMUs are written
    report, backend : see `chainunit.study.run.run_study`

    Raises
    ------
    InputError
        for a catalogue that cannot be read, or that has no motor with the requested numbers of poles.
    """
    limits = config.sizing
    assert limits is not None
    motors = [
        m for m in catalogue(config.catalogue) if limits.poles_least <= m.nameplate.poles <= limits.poles_most
    ]
    motors.sort(key=lambda m: (m.nameplate.power, poles_rank(m.nameplate.poles)))
    if not motors:
        raise InputError(
            f"sizing.poles_least = {limits.poles_least:g}, sizing.poles_most = {limits.poles_most:g}: the catalogue "
            "has no motor with so many poles"
        )
    check_ratios(config, motors)
    report("the machine at constant speed", 0.0, 1.0)
    duty = duty_of(config, folder, backend)
    numbers = duty.numbers
    notes = [
        "Catalogue data are typical; iron losses are not in the motor model.",
        "The gear's losses act as viscous drag on the motor shaft, with the mean power that its efficiency costs.",
    ]
    if config.machine.in_place:
        notes.append(
            f"Peaks of the cycle and the flywheel are those of single turns, {100 * HIGH:g} % quantile over all "
            "turns of all starts of the chains."
        )
    # a flywheel evens the torque of a cycle, but gives no mean power
    power = numbers.power_mean / (1.0 - limits.margin)
    strong = [m for m in motors if m.nameplate.power >= power]
    if not strong:
        notes.append(
            "No motor of the catalogue gives the mean power of the cycle with the margin, "
            f"{number(power, 'W')}: the largest were tried."
        )
        strong = [m for m in motors if m.nameplate.power == motors[-1].nameplate.power]
    candidates = _search(config, strong, duty, folder, report, backend)
    notes += [
        f"{c.motor.designation} would be preferred, but for its start: {c.reason}."
        for c in candidates[1:]
        if c.remedy
    ]
    notes += _needs(candidates[0], config)
    return SizingResult(config, duty, candidates, notes, len(motors), len(motors) - len(strong))


def _search(
    config: Config,
    motors: list[CatalogueMotor],
    duty: Duty,
    folder: Path,
    report: Report,
    backend: Backend | None,
) -> list[Candidate]:
    """The candidates that `size` tries of the `motors`, in the order of their rank. The start of the best one is that
    from the worst crank angle; a candidate that fails in it makes room for the next."""
    limits = config.sizing
    assert limits is not None
    candidates: list[Candidate] = []
    files: Mapping[str, Path] | None = {}
    rest = iter(motors)
    following = next(rest, None)

    def is_over() -> bool:
        if following is None:
            return True
        return len(candidates) >= limits.candidates and _is_settled(candidates, following, limits.larger)

    while not candidates or not is_over():
        while following is not None and not is_over():
            report(f"simulating {following.designation}", float(len(candidates)), float(len(motors)))
            candidate = proposal(config, following, duty)
            if compiler() is not None and backend != "python" and not candidate.drive.outsiders:
                files = None  # the candidates run on the compiled system
            elif not files:
                files, _ = candidate.drive.export(folder, backend, partial(_exporting, report))
            candidates.append(_tried(config, candidate, duty, files))
            following = next(rest, None)
        _from_all_angles(config, candidates, duty, files)
    if candidates[0].fits and candidates[0].drive.flywheel:
        report("a larger motor without a flywheel", 0.0, 1.0)
        if (larger := _without_flywheel(config, motors, candidates, duty, files)) is not None:
            candidates.append(larger)
            _from_all_angles(config, candidates, duty, files)
    hard = [c for c in candidates if c.breaks_gear]
    best, _ = choice([candidates[0], *hard], limits.larger) if hard else (candidates[0], {})
    if best.breaks_gear:
        report("a softer start", 0.0, 1.0)
        best.remedy = _remedy(config, best, duty, files)
        rank(candidates, limits.larger)
    return candidates


def _remedy(config: Config, c: Candidate, duty: Duty, files: Mapping[str, Path] | None) -> str:
    """What makes a candidate fit whose start alone is too hard for the gear: on the line it is tried with a soft
    starter."""
    if config.start != "direct":
        return SOFTER[config.start]
    config = dataclasses.replace(config, start="soft")
    soft = proposal(config, c.motor, duty, c.drive.ratio)
    soft.drive = dataclasses.replace(soft.drive, flywheel=c.drive.flywheel)
    judge(config, soft, duty, files, worst_start=True)
    if not soft.fits:
        return SOFTER["direct"]
    start = soft.checks["gear_start"]
    return f'with start = "soft" it fits, and puts {number(start.value, start.unit)} on the gear in a start'


def _tried(config: Config, bare: Candidate, duty: Duty, files: Mapping[str, Path] | None) -> Candidate:
    """The candidate with the least flywheel, and with an inverter with the least boost. Where it then misses its
    limits by a hair, it gets the ratio above, as an inverter keeps the speed of the crank with either ratio."""

    def tried(c: Candidate) -> Candidate:
        return least_boost(config, c, lambda each: with_flywheel(config, each, duty, files))

    candidate = tried(bare)
    if not bare.drive.follows or "gear.ratio" in config.given or not misses_by_a_hair(candidate):
        return candidate
    above = next_ratio(bare.drive.ratio, config.choices["sizing.ratios"])
    if above is None:
        return candidate
    other = tried(proposal(config, bare.motor, duty, above))
    return other if other.keeps_margin else candidate


def _from_all_angles(
    config: Config, candidates: list[Candidate], duty: Duty, files: Mapping[str, Path] | None
) -> None:
    """Rank the candidates, with the start of the best one from all crank angles."""
    assert config.sizing is not None

    def judged(c: Candidate) -> Candidate:
        judge(config, c, duty, files, worst_start=True)
        return c

    rank(candidates, config.sizing.larger)
    while candidates[0].fits and not candidates[0].worst_start:
        candidates[0] = least_boost(config, candidates[0], judged)
        rank(candidates, config.sizing.larger)


def _needs(best: Candidate, config: Config) -> Iterator[str]:
    """What has to be ordered beside the usual parts: a relay for a heavy start or the settings of the inverter, a
    second gear unit."""
    if best.start_class and best.start_class > LIGHT:
        relay = f"{'of ' if best.start_class <= HEAVIEST else ''}{class_words(best.start_class)}"
        yield f"The start takes an overload relay {relay}; one of class {LIGHT} may trip in it."
    if best.drive.follows:
        yield from inverter_needs(best, config)
    if best.unit is None:
        largest = UNITS[config.choices["sizing.gear_kind"]][-1]
        end = (
            f"even of makers with large ratios ends at about {largest.made:g}"
            if is_of_a_gear(config)
            else (f"ends at about {largest.largest:g}")
        )
        yield f"A ratio of {best.drive.ratio:g} takes two gear units: a {largest.title} {end}."


def _is_settled(candidates: list[Candidate], following: CatalogueMotor, larger: float) -> bool:
    """Whether a candidate keeps the margin, and neither the `following` motor nor a larger one could be
    preferred to the best."""
    keeping = [c for c in candidates if c.keeps_margin]
    if not keeping:
        return False
    best, _ = choice(keeping, larger)
    is_light = best.unit is not None and (best.start_class or 0) <= LIGHT and not best.drive.flywheel
    if (
        is_light
        and not best.weakened
        and poles_rank(best.motor.nameplate.poles) <= poles_rank(following.nameplate.poles)
    ):
        return best.power < following.nameplate.power
    return following.nameplate.power > larger * min(c.power for c in keeping)


def _without_flywheel(
    config: Config,
    motors: list[CatalogueMotor],
    candidates: list[Candidate],
    duty: Duty,
    files: Mapping[str, Path] | None,
) -> Candidate | None:
    """The next larger motor that fits without a flywheel, of the best candidate's number of poles; None where
    the candidates have one, or the `motors` none."""
    best = candidates[0]
    if any(c.keeps_margin and not c.drive.flywheel and c.power >= best.power for c in candidates):
        return None
    tried = {c.motor.designation for c in candidates}
    poles = best.motor.nameplate.poles
    rest = [
        m
        for m in motors
        if m.nameplate.poles == poles and m.nameplate.power > best.power and m.designation not in tried
    ]

    def judged(c: Candidate) -> Candidate:
        judge(config, c, duty, files)
        return c

    # a larger motor runs more evenly, but puts more on the gear in its start: the largest may not fit
    least = None
    while rest:
        middle = len(rest) // 2
        candidate = least_boost(config, proposal(config, rest[middle], duty), judged)
        if candidate.keeps_margin:
            least = candidate
        too_weak = any(candidate.exceeds(name) for name in candidate.checks if name not in _WORSE_WITH_POWER)
        rest = rest[middle + 1 :] if too_weak else rest[:middle]
    return least


def _exporting(report: Report, what: str) -> None:
    report(what, 0.0, 1.0)


def with_flywheel(config: Config, bare: Candidate, duty: Duty, files: Mapping[str, Path] | None) -> Candidate:
    """The candidate with the least flywheel, to about a tenth, that keeps the permitted fluctuation and the
    limits of torque and temperature. It has no flywheel where none is needed, or where it exceeds a limit
    that no flywheel improves. If such a flywheel exceeds another limit, it is the flywheel that comes nearest
    to all limits. A motor that stalls in the peak of the cycle may run with a flywheel, which carries it through.

    The largest flywheel that is tried is that of the hand formulas for speed and torque. It is on the safe
    side for the speed, as the formula leaves out that a motor's torque falls with speed, which evens the
    speed, too. None is tried where this flywheel is a small part of the other inertia."""
    there = bare.drive.rotor_inertia + duty.numbers.inertia_mean / bare.drive.ratio**2
    trials: list[Candidate] = []

    def trial_with(flywheel: float) -> Candidate:
        candidate = dataclasses.replace(bare, drive=with_wheel(config, bare.drive, flywheel))
        judge(config, candidate, duty, files)
        trials.append(candidate)
        return candidate

    def heavy_enough(candidate: Candidate) -> bool:
        if candidate.checks and not candidate.starts:
            # it stalls for want of inertia, unless it starts with less
            return any(c.starts for c in trials if c.drive.flywheel < candidate.drive.flywheel)
        return too_heavy(candidate) or is_even(candidate)

    first = trial_with(0.0)
    mean = duty.numbers.torque_mean / bare.drive.ratio
    if heavy_enough(first) or mean > bare.motor.nameplate.torque:
        return first
    inertia = duty.numbers.inertia_wanted / bare.drive.ratio**2 / (1.0 - bare.margin)
    whole = max(inertia, torque_evening_inertia(first, duty.numbers, config.run.crank_speed)) - there
    if whole < _SMALL * there:
        return first
    below = 0.0
    for share in (0.03, 0.1, 0.3, 1.0):
        if heavy_enough(trial_with(share * whole)):
            break
        below = share
    else:
        return _nearest(trials)
    for _ in range(3):
        middle = 0.5 * (below + share)
        if heavy_enough(trial_with(middle * whole)):
            share = middle
        else:
            below = middle
    solutions = [c for c in trials if is_even(c) and not too_heavy(c)]
    return min(solutions, key=lambda c: c.drive.flywheel) if solutions else _nearest(trials)


def _nearest(trials: list[Candidate]) -> Candidate:
    """The trial that comes nearest to all limits; where none starts, the one without a flywheel."""
    best = min(trials, key=lambda c: c.violation)
    best.heaviest = max(c.drive.flywheel for c in trials)
    best.bound = next((c.checks["inertia"].limit for c in trials if c.exceeds("inertia")), None)
    return best


def torque_evening_inertia(c: Candidate, numbers: CycleNumbers, crank_speed: float) -> float:
    """Inertia on the motor's shaft [kg m2] that brings the RMS and peak torque of a candidate down to their
    limits, by hand; 0 where it exceeds neither limit, or where the mean torque alone exceeds one.

    A motor whose torque falls by D [N m s/rad] with speed gives 1/sqrt(1 + (n w J/D)^2) of the n-th harmonic
    of the load, with the crank speed w [rad/s]. The factor of the first harmonic is taken for all, which is
    on the safe side."""
    plate, ratio = c.motor.nameplate, c.drive.ratio
    mean, rms = numbers.torque_mean / ratio, numbers.torque_rms / ratio
    peak = max(numbers.torque_peak, numbers.torque_peak_one_sided or 0.0) / ratio
    limits = {
        name: (1.0 - c.margin) * c.checks[name].limit
        for name in ("rms_torque", "peak_torque")
        if c.exceeds(name)
    }
    # the parts of load and limit above the mean
    beyond = []
    if "rms_torque" in limits:
        beyond.append((rms**2 - mean**2, limits["rms_torque"] ** 2 - mean**2))
    if "peak_torque" in limits:
        beyond.append(((peak - mean) ** 2, max(0.0, limits["peak_torque"] - mean) ** 2))
    square = max((load / bound for load, bound in beyond if bound > 0.0), default=0.0)
    slope = plate.torque / (plate.synchronous - plate.speed)
    return float(slope / crank_speed * math.sqrt(max(0.0, square - 1.0)))


def is_even(c: Candidate) -> bool:
    """Whether the candidate keeps every limit that a flywheel improves, with the margin."""
    return not any(map(c.exceeds, _EVENED))


def too_heavy(c: Candidate) -> bool:
    """Whether the candidate exceeds a limit that a flywheel makes worse, or its run failed."""
    # a winding that is too hot from running alone permits no starts, too
    return (
        not c.checks
        or any(map(c.exceeds, _WORSE_WITH_INERTIA))
        or (c.exceeds("starts") and not c.exceeds("temperature"))
    )


def proposal(config: Config, motor: CatalogueMotor, duty: Duty, chosen: float | None = None) -> Candidate:
    """A candidate without a flywheel, with the `chosen` ratio, or that which the file gives, or the ratio on offer
    that is nearest to the one at which the crank has its speed."""
    limits, kind, series = config.sizing, config.choices["sizing.gear_kind"], ""
    assert limits is not None
    torque = duty.normal.crank_torque
    ratios = config.choices["sizing.ratios"]
    drive = catalogue_drive(config, motor, torque, limits.ambient, chosen)
    if chosen is not None:
        series = "own list" if ratios else "R80"
    elif "gear.ratio" not in config.given:
        ratio, series = ratio_on_offer(drive.ratio, config.choices["sizing.ratio_series"], ratios, _TOLERANCE)
        drive = catalogue_drive(config, motor, torque, limits.ambient, ratio)
    unit = gear_unit(kind, drive.ratio, is_given=is_of_a_gear(config))
    return Candidate(motor, drive, {}, limits.margin, unit, series)


def judge(
    config: Config,
    c: Candidate,
    duty: Duty,
    files: Mapping[str, Path] | None,
    *,
    worst_start: bool = False,
) -> None:
    """Try a candidate and fill in its checks; with `worst_start` its start is that from the worst crank angle."""
    c.worst_start = worst_start
    try:
        trial = try_motor(config, c.motor, c.drive, duty, files, worst_start=worst_start)
    except InterruptedRunError:
        raise
    except RunError as error:
        c.checks, c.reason = {}, f"its run failed: {error}"
        return
    c.checks, c.fluctuation = trial.checks(), trial.fluctuation
    c.duty, c.stall_angle = trial.duty, trial.stall_angle
    c.start_class, c.start_current = trial.start_class, trial.start_current
    c.inverter_current, c.overload_time = trial.inverter_current, trial.overload_time
    if trial.start_time is not None:
        c.speed, c.frequency = trial.speed, trial.frequency
