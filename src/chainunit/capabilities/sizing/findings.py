"""The findings of sizing: the chosen drive, the candidates behind it, and the protection of the drive."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from ...core.quantities import ROUNDING
from ...drives.catalogue_couplings import CatalogueCoupling
from ...drives.catalogue_gears import CatalogueGear
from ...reading.results import GIVEN, as_data, derived, part, result
from ...reading.text import number
from ...study.analysis import Analysis, Findings, Work
from ...study.catalogue_drive import as_used
from ...study.coupling import remark_on_rams
from ...study.operation import DriveTables
from ...study.proposal import DriveProposal
from ...study.record import StudyRecord
from ...study.remark import fault, note, warning
from ...study.starts import weak_in_star
from .alternatives import ChosenMotor, alternatives
from .candidate import Candidate, Flywheel, Standing
from .coupling import coupling_of, recommended_setting
from .duty import Duty
from .gear_order import GearOrder, gear_order
from .gear_rows import stronger, unknown_limits
from .gear_tables import with_gear
from .parts import OrderedPart, PartsList, parts_list
from .preference import order_words, poles_rank
from .protection import Alternative, Obstacle, Setting
from .result import SizedDrive, drive_protection, ordered_belt, ordered_gear, ordered_inverter
from .table import Sizing, SizingPlan

INSUFFICIENT = "No motor of the catalogue fits; all runs are with the nearest, which is insufficient."
"""The sentence on a study for which no motor fits."""


@result
class Asked:
    """The demands on the drive."""

    demands: Sizing = part(inline=True, titled=True)
    words: Mapping[str, Any] = part("kinds and series of gears", unit=GIVEN, inline=True)


@result(frozen=False)
class SizingFindings(Findings):
    """Cycle, candidates in the order of their rank, the chosen candidate, and its protection."""

    plan: SizingPlan
    duty: Duty = part(inline=True)
    candidates: list[Candidate] = part("the motors that were tried, by their rank")
    notes: list[str] = part("notes on the choice")
    motors: int = part("number of motors of the catalogue with a permitted number of poles", unit="1")
    weak: int = part(
        "number of motors that were left out, as their rated power does not give the mean power of the cycle with "
        "the margin",
        unit="1",
        default=0,
    )
    tried: int = part("number of motors that were tried", unit="1", default=0)
    gears: Sequence[CatalogueGear] = ()
    couplings: Sequence[CatalogueCoupling] = ()
    """the gears and torque limiters of catalogues"""
    setting: Setting | None = None
    """the recommended torque limiter, see `chainunit.capabilities.sizing.coupling.recommended_setting`"""
    alternatives: tuple[Alternative, ...] = ()
    """ways to a coupling that a start does not open, where the start is more than running"""

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
        count = f"{self.tried} of {self.motors} were tried"
        if self.weak:
            count += f", {self.weak} {'is' if self.weak == 1 else 'are'} too weak by the nameplate"
        best = f"{self.best.motor.designation}: {self.best.reason}"
        if self.chosen_candidate:
            return f"{best} ({count})"
        return f"no motor of the catalogue fits ({count}); {best}"

    @property
    def trade(self) -> tuple[Candidate, Candidate] | None:
        """The smallest motor that fits with a flywheel, and the next larger one that fits without; None where
        the candidates do not have both."""
        fitting = [c for c in self.candidates if c.fits]
        fitting.sort(key=lambda c: (not c.keeps_margin, c.power, poles_rank(c.motor.nameplate.poles)))
        with_one = next((c for c in fitting if c.drive.added_inertia), None)
        if with_one is None:
            return None
        bare = (c for c in fitting if not c.drive.added_inertia and c.power >= with_one.power)
        without = next(bare, None)
        return None if without is None else (with_one, without)

    @derived()
    def asked(self) -> Asked:
        """The demands."""
        return Asked(self.plan.demands, self.plan.words)

    @derived(titled=True)
    def flywheel(self) -> Flywheel:
        """The flywheel of the drive."""
        return self.best.flywheel_numbers

    @derived()
    def order(self) -> list[str]:
        """The order of preference among candidates that fit."""
        return order_words(self.plan.demands.larger, self.plan.objective)

    @derived(name="trade")
    def traded(self) -> list[int] | None:
        """Places of the smallest motor that fits with a flywheel, and of the next larger one that fits without."""
        return None if self.trade is None else [self.candidates.index(c) for c in self.trade]

    @derived()
    def chosen(self) -> int | None:
        """Place of the chosen candidate."""
        return self.candidates.index(self.chosen_candidate) if self.chosen_candidate else None

    @derived()
    def nearest(self) -> int | None:
        """Place of the nearest candidate, where none fits."""
        return None if self.chosen_candidate else self.candidates.index(self.best)

    def proposal(self, tables: DriveTables) -> DriveProposal:
        """The drive of a study by these findings, with the gear of its `tables`."""
        best, trial, fits = self.best, self.best.trial, self.chosen_candidate is not None
        return DriveProposal(
            name="sizing",
            findings=self,
            drive=best.drive,
            motor=best.motor,
            tables=as_used(
                with_gear(tables, best.sold) if best.sold else tables, best.drive, self.plan.offer
            ),
            question="Which motor, gear and flywheel does {} need? Its {driver} turns at {}.",
            reason=self.answer,
            sentence=lambda study: SizingFindings.of_study(study.findings).sized(study).sentence,
            currents_until_trip=lambda study: SizingFindings.of_study(study.findings).currents_until_trip(
                study
            ),
            insufficient="" if fits else INSUFFICIENT,
            keys={"ambient.T": "sizing.ambient"},
            start_class=trial.start_class or 0,
            duty=trial.duty if fits else None,
            permitted_starts=trial.checks["starts"].limit if "starts" in trial.checks else math.inf,
            inverter_current=trial.inverter_current,
        )

    def coupling(self, study: StudyRecord) -> Setting | None:
        """The recommended torque limiter; of a study that ended before it was judged, by the runs up to there."""
        return self.setting or recommended_setting(study, self.couplings)

    def parts(self, study: StudyRecord, setting: Setting | None) -> PartsList | None:
        """The parts to order, with a coupling of that `setting`; None where no motor fits, and for a packaged motor
        alone, which nobody sells."""
        best = self.best
        if study.setup.insufficient or (best.sold is None and best.motor.is_packaged):
            return None
        items, limiter = best.parts, ""
        if setting is not None and setting.torque is not None:
            if sold := coupling_of(study.runs, setting, self.couplings):
                items = [*items, OrderedPart.of("torque limiter", sold)]
            else:
                torque = number(study.setup.drive.at_motor_shaft(setting.torque), "N.m")
                limiter = f"a torque limiter that opens at {torque} on the motor's shaft"
        unknown = [] if best.sold is None else unknown_limits(best.sold)
        flywheel = f"a flywheel of {best.flywheel_words}" if best.disc else ""
        listed = parts_list(items, unknown, flywheel, limiter)
        if (needed := self._gear_needed(study, setting)) is not None:
            order, remedy = needed
            decides = order.decides
            sentence = f"{decides.words}{decides.rule} takes one that permits {number(order.rated, 'N.m')} in running"
            listed = replace(listed, open=[f"The gear is too weak: {sentence}; {remedy}.", *listed.open])
        if best.motor.is_packaged:
            sentence = (
                "The motor is one of the packaged table: typical values of no maker. Ask for offers to them."
            )
            listed = replace(listed, open=[sentence, *listed.open])
        return listed

    def data(self, study: StudyRecord) -> dict[str, Any]:
        """Its declared parts, with the parts to order and the protection."""
        return self.data_with(self.sized(study), study)

    def data_with(self, drive: SizedDrive, study: StudyRecord) -> dict[str, Any]:
        """The same with the sized `drive`, see `sized`."""
        return super().data(study) | as_data(drive, driver=study.setup.driver_noun)

    def sized(self, study: StudyRecord) -> SizedDrive:
        """The drive with its protection by the runs of the study."""
        setting, trial = self.coupling(study), self.best.trial
        return SizedDrive(
            best=self.best,
            insufficient=bool(study.setup.insufficient),
            driver=study.setup.driver_noun,
            caveat=study.findings.verdict.caveat if study.findings.verdict else None,
            needs_empty_start=weak_in_star(study.findings) and not study.setup.config.empty_start,
            gear=ordered_gear(study, setting, self.plan, trial.inertia_factor),
            protection=drive_protection(
                study, setting, self.alternatives, self.best.motor.nameplate.rated_current
            ),
            belt=ordered_belt(study, self.plan, trial),
            inverter=ordered_inverter(study),
            parts=self.parts(study, setting),
        )

    def currents_until_trip(self, study: StudyRecord) -> Mapping[str, float]:
        """By overload that opens the recommended torque limiter, the largest current of the motor until then [A]."""
        setting = self.coupling(study)
        if setting is None or setting.torque is None:
            return {}
        return {name: effect.current for name, effect in setting.effects.items()}

    def remark(self, study: StudyRecord) -> None:
        """Add the notes on the choice, and one on each ram of a linkage at the recommended coupling."""
        for text in self.notes:
            study.findings.say(_CHOICE, text=text)
        if study.setup.insufficient:
            study.findings.say(_INSUFFICIENT, answer=self.answer)
        setting = self.coupling(study)
        self._remark_on_gear(study, setting)
        if study.setup.statics.modes is not None:
            study.findings.say(_WITHOUT_LINE)
        if setting is not None and setting.obstacle in (None, Obstacle.RELEASE):
            # this is the setting that the answer names, recommended or not
            remark_on_rams(study, setting.least)
        elif setting is not None:
            remark_on_rams(study, setting.least_in_running, "set for running alone ")

    def _gear_needed(self, study: StudyRecord, setting: Setting | None) -> tuple[GearOrder, str] | None:
        """The gear to order and the remedy in words, where it has to carry more than the chosen one of the catalogue;
        else None."""
        sold = self.best.sold
        service = self.plan.gear_factor(self.best.trial.inertia_factor)
        order = None if sold is None else gear_order(study, setting, 0.0, service)
        if sold is None or order is None:
            return None
        # the torque to order is rounded up
        if order.decides.rated <= sold.transmission.torque_limit * (1.0 + ROUNDING):
            return None
        if other := stronger(self.gears, sold, order.rated):
            return order, f"{other.designation} of the catalogue does so; give sizing.gear_torque"
        return order, "the catalogue has none of this ratio"

    def _remark_on_gear(self, study: StudyRecord, setting: Setting | None) -> None:
        """Warn where the runs ask more of the gear than its catalogue permits."""
        sold, needed = self.best.sold, self._gear_needed(study, setting)
        if sold is None or needed is None:
            return
        order, remedy = needed
        study.findings.say(
            _GEAR_TOO_WEAK,
            gear=sold.designation,
            limit=sold.transmission.torque_limit,
            start=sold.transmission.start_limit,
            case=order.decides.words,
            torque=order.decides.torque,
            rated=order.rated,
            way=remedy,
        )


_CHOICE = note("sizing", "{text}")
_INSUFFICIENT = fault("insufficient-motor", "{answer}. All runs are with it.")
_WITHOUT_LINE = note(
    "sized-without-line",
    "Sizing took the shafts as rigid and the driveline as massless. The runs include the line.",
)
_GEAR_TOO_WEAK = warning(
    "gear-too-weak",
    "The gear {gear} permits {limit} in running and {start} in a start or an overload. {case} puts {torque} on it.",
    remedy="A gear that permits {rated} in running carries it ({way}).",
    sizes={"N.m": "limit start torque rated"},
)


class ProtectionAnalysis(Analysis):
    """The torque limiter of a sized drive, and the ways to another; it completes the findings of sizing."""

    name = "protection"
    needs_runs = True
    applies = staticmethod(lambda drive, plans: plans["sizing"] is not None)

    @staticmethod
    def find(study: StudyRecord, work: Work) -> None:
        """Judge the coupling by the runs of the study, and try each way."""
        sizing = SizingFindings.of_study(study.findings)
        sizing.setting = recommended_setting(study, sizing.couplings)
        if sizing.setting is not None:
            chosen = ChosenMotor(sizing.plan, sizing.duty, sizing.best)
            sizing.alternatives = alternatives(study, sizing.setting, work.rig, chosen, work.progress)
