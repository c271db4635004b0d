"""Sizing of the drive: which motor of the catalogue, behind which gear, with which flywheel.

First the cycle is computed by inverse dynamics. Then every candidate is simulated: a start
under load, steady running, and steady running with all feed on one side. Each check is a utilisation, value
over limit. Hand formulas (RMS torque, flywheel, relay) are here and in `protection`; all else is read from
the runs.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Any

from ..drives.catalogue import CatalogueMotor, catalogue
from ..errors import InputError, InterruptedRunError, RunError
from ..fmu.backends import Backend
from ..native.compilers import compiler
from ..progress import Report
from ..quantities import Value, declaration, quantity
from ..text import entries, number
from .catalogue_drive import catalogue_drive
from .chain import HIGH
from .config import Config
from .drive import Drive
from .duty import CycleNumbers, Duty, duty_of
from .limits import Check
from .trial import try_motor


@declaration
class Flywheel:
    """The flywheel of the chosen motor."""

    J: Value = quantity("kg.m2", "flywheel on the motor shaft")
    fluctuation: Value = quantity("1", "fluctuation of the crank speed in the run", kind="percent")


class Standing(StrEnum):
    """The result of a candidate."""

    CHOSEN = "chosen"
    FITS = "fits"
    INSUFFICIENT = "insufficient"
    """the nearest candidate, where none fits; the study goes on with it"""
    REJECTED = "rejected"


_EVENED = ("speed", "rms_torque", "peak_torque", "temperature")
"""Checks that a flywheel improves: it evens the speed, and with it the torque of a varying load."""
_WORSE_WITH_INERTIA = ("start", "inertia")
"""Checks that a flywheel makes worse."""
_SMALL = 0.1
"""Inertia of a flywheel, relative to all other inertia, below which it hardly evens the speed."""
_NEAR = 0.2
"""Relative difference of flywheels up to which they count as equal in the ranking, as the search finds each
flywheel only to about a tenth."""
_ALIKE = 0.05
"""Difference of utilisations up to which they count as equal in the ranking, as the search for a flywheel
ends where a limit is used by 90 to 100 %."""


@dataclass
class Candidate:
    """A motor behind a gear, with the results of its runs."""

    motor: CatalogueMotor
    drive: Drive
    checks: dict[str, Check]
    peak_torque: float = math.nan
    """largest torque at the crank, in the start and in steady running with either load [N m]"""
    breakdown_torque: float = math.nan
    """breakdown torque of the motor [N m]"""
    duty_torque: float = math.nan
    """peak torque at the crank in steady running, and while all feed moves to either side and stays there [N
    m]"""
    fluctuation: float = math.nan
    verdict: Standing | None = None
    """None until the candidate is judged or ranked"""
    reason: str = ""

    @property
    def sizes(self) -> dict[str, float]:
        """Utilisation by check; infinite where the candidate does not get so far."""
        return {n: math.inf if c.utilisation is None else c.utilisation for n, c in self.checks.items()}

    @property
    def violation(self) -> float:
        """Largest utilisation of all checks; infinite where the run of the candidate failed."""
        return max(self.sizes.values(), default=math.inf)

    @property
    def flywheel_at_crank(self) -> float:
        """Inertia of the flywheel reduced to the crank [kg m2]: a measure of its energy, whatever the
        gear."""
        return float(self.drive.flywheel * self.drive.ratio**2)

    @property
    def fits(self) -> bool:
        """Whether every check is within its limit."""
        return self.violation <= 1.0


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
    """number of motors that were left out, as their rated power is less than 0.7 times the power that the
    cycle needs"""

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
        if self.chosen_candidate:
            return f"{self.best.motor.designation} is {self.best.reason} ({count})"
        return (
            f"no motor of the catalogue fits ({count}); {self.best.motor.designation} is {self.best.reason}"
        )

    def as_dict(self) -> dict[str, Any]:
        """Ready for JSON, each number with its unit."""
        best = self.best
        assert self.config.sizing is not None
        return {
            "asked": entries(self.config.sizing, with_titles=True),
            **self.duty.as_dict(),
            "flywheel": entries(
                Flywheel(J=best.drive.flywheel, fluctuation=best.fluctuation), with_titles=True
            ),
            "tried": {"value": len(self.candidates), "unit": "1"},
            "motors": {"value": self.motors, "unit": "1"},
            "weak": {"value": self.weak, "unit": "1"},
            "candidates": [
                {
                    "motor": c.motor.designation,
                    "ratio": {"value": c.drive.ratio, "unit": "1"},
                    "verdict": c.verdict,
                    "reason": c.reason,
                    "checks": {name: check.as_dict() for name, check in c.checks.items()},
                }
                for c in self.candidates
            ],
            "chosen": self.candidates.index(self.chosen_candidate) if self.chosen_candidate else None,
            "nearest": None if self.chosen_candidate else self.candidates.index(best),
            "notes": self.notes,
        }


def size(config: Config, folder: Path, report: Report, backend: Backend | None = None) -> SizingResult:
    """Choose a motor of the catalogue for the study. At least `sizing.candidates` motors are tried, from
    small to large, and then more until one fits or the catalogue ends.

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
    report("the machine at constant speed", 0.0, 1.0)
    duty = duty_of(config, folder, backend)
    numbers = duty.numbers
    notes = [
        "Catalogue data are typical; iron losses are not in the motor model.",
        "The gear's losses act as viscous drag on the motor shaft, with the mean power that its efficiency costs.",
    ]
    if config.chain is not None:
        notes.append(
            f"Peaks of the cycle and the flywheel are those of single turns, {100 * HIGH:g} % quantile over all "
            "turns of all starts of the chains."
        )
    motors = [
        m for m in catalogue(config.catalogue) if limits.poles_least <= m.nameplate.poles <= limits.poles_most
    ]
    # the search begins below the power that the cycle needs, so that the first motor that fits is the
    # smallest
    power = max(numbers.power_mean, numbers.torque_rms * config.run.crank_speed)
    motors.sort(key=lambda m: (m.nameplate.power, abs(m.nameplate.poles - 4.0)))
    if not motors:
        raise InputError(
            f"sizing.poles_least = {limits.poles_least:g}, sizing.poles_most = {limits.poles_most:g}: the catalogue "
            "has no motor with so many poles"
        )
    strong = [m for m in motors if m.nameplate.power >= 0.7 * power]
    if not strong:
        notes.append(
            "No motor of the catalogue has 0.7 times the power of the cycle, "
            f"{number(0.7 * power, 'W')}: the largest were tried."
        )
        strong = [m for m in motors if m.nameplate.power == motors[-1].nameplate.power]
    candidates: list[Candidate] = []
    files: Mapping[str, Path] | None = {}
    for k, motor in enumerate(strong):
        if len(candidates) >= limits.candidates and any(c.fits for c in candidates):
            break
        report(f"simulating {motor.designation}", float(k), float(len(strong)))
        candidate = proposal(config, motor, duty)
        if compiler() is not None and backend != "python" and not candidate.drive.outsiders:
            files = None  # the candidates run on the compiled system
        elif not files:
            files, _ = candidate.drive.export(folder, backend, partial(_exporting, report))
        candidates.append(with_flywheel(config, candidate, duty, files))
    rank(candidates)
    return SizingResult(config, duty, candidates, notes, len(motors), len(motors) - len(strong))


def _exporting(report: Report, what: str) -> None:
    report(what, 0.0, 1.0)


def with_flywheel(config: Config, bare: Candidate, duty: Duty, files: Mapping[str, Path] | None) -> Candidate:
    """The candidate with the least flywheel, to about a tenth, that keeps the permitted fluctuation and the
    limits of torque and temperature. It has no flywheel where none is needed, or where it exceeds a limit
    that no flywheel improves. If such a flywheel exceeds another limit, it is the flywheel that comes nearest
    to all limits.

    The largest flywheel that is tried is that of the hand formulas for speed and torque. It is on the safe
    side for the speed, as the formula leaves out that a motor's torque falls with speed, which evens the
    speed, too. None is tried where this flywheel is a small part of the other inertia."""
    there = bare.drive.rotor_inertia + duty.numbers.inertia_mean / bare.drive.ratio**2
    trials: list[Candidate] = []

    def trial_with(flywheel: float) -> Candidate:
        candidate = dataclasses.replace(bare, drive=dataclasses.replace(bare.drive, flywheel=flywheel))
        judge(config, candidate, duty, files)
        trials.append(candidate)
        return candidate

    def heavy_enough(candidate: Candidate) -> bool:
        return too_heavy(candidate) or is_even(candidate)

    first = trial_with(0.0)
    mean = duty.numbers.torque_mean / bare.drive.ratio
    if heavy_enough(first) or mean > bare.motor.nameplate.torque:
        return first
    inertia = duty.numbers.inertia_wanted / bare.drive.ratio**2
    whole = max(inertia, torque_evening_inertia(first, duty.numbers, config.run.crank_speed)) - there
    if whole < _SMALL * there:
        return first
    below = 0.0
    for share in (0.03, 0.1, 0.3, 1.0):
        if heavy_enough(trial_with(share * whole)):
            break
        below = share
    else:
        return min(trials, key=lambda c: c.violation)
    for _ in range(3):
        middle = 0.5 * (below + share)
        if heavy_enough(trial_with(middle * whole)):
            share = middle
        else:
            below = middle
    solutions = [c for c in trials if is_even(c) and not too_heavy(c)]
    return (
        min(solutions, key=lambda c: c.drive.flywheel)
        if solutions
        else min(trials, key=lambda c: c.violation)
    )


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
        name: c.checks[name].limit for name in ("rms_torque", "peak_torque") if c.sizes.get(name, 0.0) > 1.0
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
    """Whether the candidate keeps every limit that a flywheel improves."""
    return not any(1.0 < c.sizes.get(name, 0.0) < math.inf for name in _EVENED)


def too_heavy(c: Candidate) -> bool:
    """Whether the candidate exceeds a limit that a flywheel makes worse, or its run failed."""
    sizes = {name: c.sizes.get(name, 0.0) for name in (*_WORSE_WITH_INERTIA, "starts", "temperature")}
    # a winding that is too hot from running alone permits no starts, too
    return (
        not c.checks
        or any(sizes[name] > 1.0 for name in _WORSE_WITH_INERTIA)
        or sizes["starts"] > 1.0 >= sizes["temperature"]
    )


def proposal(config: Config, motor: CatalogueMotor, duty: Duty) -> Candidate:
    """A candidate without a flywheel, with the gear ratio at which the crank has its speed."""
    assert config.sizing is not None
    drive = catalogue_drive(config, motor, duty.normal.crank_torque, config.sizing.ambient)
    return Candidate(motor, drive, {})


def judge(config: Config, c: Candidate, duty: Duty, files: Mapping[str, Path] | None) -> None:
    """Try a candidate and fill in its checks."""
    try:
        trial = try_motor(config, c.motor, c.drive, duty, files)
    except InterruptedRunError:
        raise
    except RunError as error:
        c.reason = f"its run failed: {error}"
        return
    c.checks, c.fluctuation = trial.checks(), trial.fluctuation
    c.peak_torque, c.duty_torque = trial.peak_torque, trial.duty_torque
    c.breakdown_torque = trial.breakdown_torque


def rank(candidates: list[Candidate]) -> None:
    """Order the candidates by rank and set their reasons. First come those that fit, see `in_rank`, then
    those that do not fit, by their largest utilisation; among those that do not start at all a larger motor
    comes first."""
    for c in candidates:
        over = [check for name, check in c.checks.items() if c.sizes[name] > 1.0]
        if c.fits:
            most = max(c.checks.values(), key=lambda check: check.utilisation or 0.0)
            c.verdict, c.reason = (
                Standing.FITS,
                f"most used: {most.title}, {number(c.violation, '1', 'used')}",
            )
        elif not c.checks:
            # the run failed, and the reason is already set
            c.verdict = Standing.REJECTED
        elif math.isinf(c.violation):
            c.verdict, c.reason = Standing.REJECTED, "it does not bring the machine up to speed"
        else:
            c.verdict, c.reason = Standing.REJECTED, "; ".join(check.excess for check in over)
        if c.drive.flywheel:
            c.reason += f", with a flywheel of {number(c.drive.flywheel, 'kg.m2')}"
    others = [c for c in candidates if not c.fits]
    others.sort(key=lambda c: (c.violation, -c.motor.nameplate.power, c.motor.designation))
    candidates[:] = in_rank([c for c in candidates if c.fits]) + others
    best = candidates[0]
    if not best.fits:
        best.verdict = Standing.INSUFFICIENT
        best.reason = f"the nearest of those that do not fit; {best.reason}"
        return
    best.verdict, best.reason = Standing.CHOSEN, f"the smallest that fits; {best.reason}"
    for c in candidates[1:]:
        if c.fits:
            c.reason = f"{_behind(c, best)}; {c.reason}"


def in_rank(fitting: list[Candidate]) -> list[Candidate]:
    """Candidates that fit, best first: by smaller power, then by lighter flywheel if they differ by more than
    `_NEAR`, then by smaller utilisation if they differ by more than `_ALIKE`, then by designation."""
    rest, ranking = sorted(fitting, key=lambda c: c.motor.designation), []
    while rest:
        power = min(c.motor.nameplate.power for c in rest)
        small = [c for c in rest if c.motor.nameplate.power == power]
        lightest = min(c.flywheel_at_crank for c in small)
        light = [c for c in small if c.flywheel_at_crank <= (1.0 + _NEAR) * lightest]
        least = min(c.violation for c in light)
        ranking.append(next(c for c in light if c.violation <= least + _ALIKE))
        rest.remove(ranking[-1])
    return ranking


def _behind(c: Candidate, best: Candidate) -> str:
    """The reason why a candidate that fits comes after the best one."""
    if c.motor.nameplate.power > best.motor.nameplate.power:
        return "larger than needed"
    if c.flywheel_at_crank > (1.0 + _NEAR) * best.flywheel_at_crank:
        return "takes more flywheel at the crank than the chosen one"
    if c.violation > best.violation + _ALIKE:
        return "more used than the chosen one"
    return "as good as the chosen one"
