"""Trials of candidates: each gets its ratio, the least boost of an inverter, and the least flywheel that it needs."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from ...core.errors import InterruptedRunError, RunError
from ...drives.catalogue import CatalogueMotor
from ...drives.catalogue_gears import CatalogueGear
from ...drives.gear_ratios import DIRECT, gear_unit, next_ratio, ratio_on_offer
from ...study.catalogue_drive import catalogue_drive, with_inertia, with_slipping_parts
from ...study.limits import SPEED_DEVIATION
from ...study.line.placed import Line
from .candidate import Candidate, TrialResult
from .duty import Duty
from .gear_rows import helps, rows_for, spent, unit_of
from .inverter import least_boost, misses_by_a_hair
from .preference import EVEN, FAILED, MEAN, UNSTARTED
from .table import SizingPlan
from .task import SizingTask
from .trial import try_motor

EVENED = ("speed", "rms_torque", "peak_torque", "temperature")
"""Checks that a flywheel improves: it evens the speed, and with it the torque of a varying load."""
WORSE_WITH_INERTIA = ("start", "inertia")
"""Checks that a flywheel makes worse."""
_SMALL, _LARGER = 0.1, 3.0
"""Inertia of the first flywheel that is tried, relative to all other inertia, as a smaller one hardly evens the
speed, and the ratio of each further one to the one before."""
_ALMOST = 1.02
"""RMS torque over mean torque up to which the torque counts as even."""
_TOLERANCE = SPEED_DEVIATION - 0.005
"""Relative deviation of the crank speed up to which a ratio of a series is taken; the rest of the permitted
deviation is for the slip in the run."""


@dataclass(frozen=True)
class MotorTrials:
    """Trials of motors for the `duty` of a study, by the FMU `files`, or without them on the compiled system."""

    task: SizingTask
    duty: Duty
    files: Mapping[str, Path] | None = None

    @property
    def plan(self) -> SizingPlan:
        """The demands on the motor, and the gears on offer."""
        return self.task.plan

    @property
    def has_given_ratio(self) -> bool:
        """Whether the file gives the ratio of the gear."""
        return "gear.ratio" in self.task.tables.given

    @property
    def has_given_boost(self) -> bool:
        """Whether the file gives the boost of the inverter."""
        return "starter.inverter.boost" in self.task.tables.given

    @property
    def is_made(self) -> bool:
        """Whether the ratios are those of gears that there are: the file gives one, or a list of them."""
        return self.has_given_ratio or self.plan.offer.is_made

    def candidate(
        self, motor: CatalogueMotor, chosen: float | None = None, gear: CatalogueGear | None = None
    ) -> Candidate:
        """A candidate without a flywheel, with a `gear` of the catalogue, or with the `chosen` ratio, or that of the
        file, or the ratio on offer that is nearest to the one at which the crank has its speed."""
        plan, task, series = self.plan, self.task.of_gear(gear), ""
        ambient, offer = plan.demands.ambient, plan.offer
        with_ratio = partial(
            catalogue_drive, task.tables, task.machine, self.duty.normal, motor, ambient, offer=offer
        )
        drive = with_ratio(gear_ratio=chosen)
        if gear is not None:
            rating = gear.rating
            if plan.separate_bearing:
                rating = dataclasses.replace(rating, overhung_load=0.0)
            drive = dataclasses.replace(drive, gear=dataclasses.replace(drive.gear, rating=rating))
            return Candidate(
                motor, drive, margin=plan.demands.margin, unit=unit_of(gear), series="catalogue", sold=gear
            )
        if chosen is not None:
            series = "own list" if plan.offered else "R80"
        elif not self.has_given_ratio:
            # the parts of the line have their share, and the gear the rest
            share = task.tables.line_ratio(drive.ratio)
            ratio, series = ratio_on_offer(drive.ratio / share, plan.ratio_series, plan.offered, _TOLERANCE)
            drive = with_ratio(gear_ratio=share * ratio)
        if task.tables.line:
            inertia = np.mean(drive.whole_line.at_motor(self.duty.normal.inertia_at(drive.ratio)))
            tables = plan.tensioned(task.tables, float(inertia / drive.fmu_parameters.rotor.J))
            drive = with_slipping_parts(dataclasses.replace(drive, line=Line()), tables, motor.nameplate)
        behind = task.tables.ratio_behind(drive.ratio)
        unit = gear_unit(plan.gear_kind, behind, is_given=self.is_made)
        if unit is DIRECT and not self.has_given_ratio:
            series = ""
        if unit is not None and (belt := task.tables.line_ratio(drive.ratio)) != 1.0:
            title = (
                "V-belt" if unit is DIRECT else f"V-belt of {belt:.3g} before a {unit.title} of {behind:.4g}"
            )
            unit = dataclasses.replace(unit, title=title)
        return Candidate(motor, drive, margin=plan.demands.margin, unit=unit, series=series)

    def judged(self, c: Candidate, *, worst_start: bool = False) -> Candidate:
        """The same candidate with the results of its runs; with `worst_start` its start is that from the worst crank
        angle."""
        c.worst_start = worst_start
        try:
            task = self.task.of_gear(c.sold)
            trial = try_motor(task, c.motor, c.drive, self.duty, self.files, worst_start=worst_start)
            c.trial = trial.result()
        except InterruptedRunError:
            raise
        except RunError as error:
            c.trial, c.reason = TrialResult(), f"its run failed: {error}"
        return c

    def with_least_boost(self, c: Candidate, *, worst_start: bool = False) -> Candidate:
        """The judged candidate, with an inverter with the least boost with which it starts."""
        return least_boost(c, partial(self.judged, worst_start=worst_start), self.has_given_boost)

    def candidates_of(
        self, motor: CatalogueMotor, judge: Callable[[Candidate], Candidate] | None = None
    ) -> list[Candidate]:
        """The candidates with this motor, each as the function `judge` judges one without a flywheel, by default as
        `best_of`. With gears of a catalogue there is one for each gear that has the ratio, up to the first with which
        the motor fits with the margin, from every crank angle; a gear that the runs with another one surely rule out
        has the values of these runs."""
        if not self.task.gears:
            return [self.best_of(motor) if judge is None else judge(self.candidate(motor))]
        flywheel = partial(least_boost, judged=self.with_flywheel, is_given=self.has_given_boost)
        judge = judge or flywheel
        plan, task, needed = self.plan, self.task, self.task.tables.gear.ratio
        if not self.has_given_ratio:
            # the ratio at which the crank has its speed
            machine = task.tables, task.machine, self.duty.normal, motor, plan.demands.ambient
            needed = catalogue_drive(*machine, offer=plan.offer).ratio
        tried = self._over_gears(motor, needed, judge)
        last = tried[-1]
        if last.drive.follows and not self.has_given_ratio and misses_by_a_hair(last):
            above = next_ratio(last.drive.ratio, [gear.data.ratio for gear in self.task.gears])
            gears = {c.gear for c in tried}
            more = [] if above is None else self._over_gears(motor, above, judge)
            tried += [c for c in more if c.gear not in gears]
        return tried

    def _over_gears(
        self, motor: CatalogueMotor, ratio: float, judge: Callable[[Candidate], Candidate]
    ) -> list[Candidate]:
        """The candidates with the gears about this ratio, up to the first that fits with the margin. A gear that
        surely does not hold by the runs with an earlier one has none of its own."""
        candidates: list[Candidate] = []
        with_runs: list[Candidate] = []
        for gear in rows_for(self.task.gears, ratio, _TOLERANCE, self.plan.objective):
            if not helps(gear, with_runs):
                continue
            c = self.candidate(motor, gear=gear)
            if (ruled_out := spent(c, with_runs)) is not None:
                candidates.append(ruled_out)
                continue
            c = judge(c)
            if c.fits and not c.worst_start:
                c = self.with_least_boost(c, worst_start=True)
            candidates.append(c)
            with_runs.append(c)
            if c.keeps_margin:
                break
        return candidates

    def best_of(self, motor: CatalogueMotor) -> Candidate:
        """The candidate with the least flywheel, and with an inverter with the least boost. Where it then misses its
        limits by a hair, it gets the ratio above, as an inverter keeps the speed of the crank with either ratio."""
        bare, is_given = self.candidate(motor), self.has_given_boost
        candidate = least_boost(bare, self.with_flywheel, is_given)
        if not bare.drive.follows or self.has_given_ratio or not misses_by_a_hair(candidate):
            return candidate
        above = next_ratio(bare.drive.ratio, self.plan.offered)
        if above is None:
            return candidate
        other = least_boost(self.candidate(motor, above), self.with_flywheel, is_given)
        return other if other.keeps_margin else candidate

    def with_flywheel(self, bare: Candidate) -> Candidate:
        """The candidate with the least flywheel, to about a tenth, that keeps the limits that a flywheel improves.
        It has no flywheel where none is needed, or where it exceeds a limit that no flywheel improves. If such a
        flywheel exceeds another limit, it is the flywheel that comes nearest to all limits. A motor that stalls in
        the peak of the cycle may run with a flywheel, which carries it through.

        The first flywheel has the share `_SMALL` of all other inertia, and each further one `_LARGER` times as much,
        until one suffices, a limit that inertia makes worse is exceeded, or the torque is even; all of them count at
        the motor's shaft. Only runs tell: where
        a load changes faster than the cage of the motor follows, a small flywheel may make its torque less even."""
        numbers = self.duty.numbers
        at_motor = bare.drive.flywheel_ratio**2
        present = bare.drive.rotor_inertia + numbers.inertia_mean / bare.drive.ratio**2
        trials: list[Candidate] = []

        def trial_with(flywheel: float) -> Candidate:
            """The candidate with a flywheel of this inertia at the motor [kg m2], judged."""
            drive = with_inertia(self.task.tables, bare.drive, flywheel * at_motor)
            candidate = dataclasses.replace(bare, drive=drive)
            trials.append(self.judged(candidate))
            return candidate

        def heavy_enough(candidate: Candidate) -> bool:
            """Whether a heavier flywheel is no use."""
            if candidate.checks and not candidate.starts:
                # it stalls for want of inertia, unless it starts with less
                return any(c.starts for c in trials if c.drive.added_inertia < candidate.drive.added_inertia)
            return too_heavy(candidate) or is_even(candidate)

        first = trial_with(0.0)
        if heavy_enough(first):
            return first
        if numbers.torque_mean / bare.drive.ratio > (1.0 - bare.margin) * bare.motor.nameplate.torque:
            first.stop = MEAN
            return first
        heaviest = heaviest_started(first)
        below, flywheel = 0.0, min(_SMALL * present, heaviest)
        last = trial_with(flywheel)
        while flywheel < heaviest and not (heavy_enough(last) or _has_even_torque(last)):
            below, flywheel = flywheel, min(_LARGER * flywheel, heaviest)
            last = trial_with(flywheel)
        # a lighter one is less even: no halving finds one where this one is not even
        if below and heavy_enough(last) and (is_even(last) or not last.starts):
            for _ in range(3):
                middle = 0.5 * (below + flywheel)
                if heavy_enough(trial_with(middle)):
                    flywheel = middle
                else:
                    below = middle
        solutions = [c for c in trials if is_even(c) and not too_heavy(c)]
        return min(solutions, key=lambda c: c.drive.added_inertia) if solutions else _nearest(trials)


def _nearest(trials: list[Candidate]) -> Candidate:
    """The trial that comes nearest to all limits; where none starts, the one without a flywheel. It gets the heaviest
    flywheel that was tried, and the reason to stop there (`stop`): the first limit that this flywheel exceeds."""
    best = min(trials, key=lambda c: c.violation)
    heaviest = max(trials, key=lambda c: c.drive.added_inertia)
    best.heaviest = heaviest.drive.added_inertia
    if not heaviest.checks:
        best.stop = FAILED
    elif heaviest.starts:
        exceeded = (name for name in (*WORSE_WITH_INERTIA, "starts") if heaviest.exceeds(name))
        best.stop = next(exceeded, EVEN if _has_even_torque(heaviest) else "start")
    else:
        best.stop = UNSTARTED if any(c.starts for c in trials) else "start"
    return best


def heaviest_started(c: Candidate) -> float:
    """The inertia [kg m2] that four fifths of the largest torque of the motor, about its mean over a start without a
    load, bring up to speed in the permitted time."""
    plate = c.motor.nameplate
    largest = max(plate.breakdown_ratio, plate.locked_torque_ratio) * plate.torque
    return float(0.8 * largest * c.checks["start"].limit / plate.speed)


def _has_even_torque(c: Candidate) -> bool:
    """Whether the torque of the motor is so even that a heavier flywheel makes no difference to its load."""
    rms = c.checks["rms_torque"].value if c.starts and "rms_torque" in c.checks else None
    return rms is not None and not c.exceeds("speed") and rms <= _ALMOST * abs(c.trial.torque_mean)


def is_even(c: Candidate) -> bool:
    """Whether the candidate keeps every limit that a flywheel improves, with the margin."""
    return not any(map(c.exceeds, EVENED))


def too_heavy(c: Candidate) -> bool:
    """Whether the candidate exceeds a limit that a flywheel makes worse, or its run failed."""
    # a winding that is too hot from running alone permits no starts, too
    return (
        not c.checks
        or any(map(c.exceeds, WORSE_WITH_INERTIA))
        or (c.exceeds("starts") and not c.exceeds("temperature"))
    )
