"""The same duty with the inertia of the machine as one number, and the drive that would have been chosen by it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...core.errors import InterruptedRunError, RunError
from ...core.quantities import Layout, Value, declaration, quantity
from ...reading.results import part, result
from ...study.analysis import Analysis, Findings, Work
from ...study.cycle import Cycle, cycle
from ...study.drive import Drive
from ...study.event import Event
from ...study.event_torques import from_event_on
from ...study.record import StudyRecord
from .choice import OtherChoice, choose_other
from .runs import (
    DutyNumbers,
    EventNumbers,
    TwinRuns,
    event_numbers,
    numbers_of,
    obstacle,
    run_twin,
    with_machine,
)
from .twin import twin
from .words import KIND, remark_on

ALIKE = 0.02
"""Relative deviation up to which two numbers are alike."""


@declaration
class Inertia:
    """The inertia of the machine over a turn with its normal feed, at the crank."""

    mean: Value = quantity("kg.m2", "inertia, mean over the turn: the number that the program takes")
    least: Value = quantity("kg.m2", "inertia, least")
    largest: Value = quantity("kg.m2", "inertia, largest")


@declaration
class ConstantSpeed:
    """RMS torque at the crank over a turn at constant speed, without a motor, as a calculation by hand has it."""

    machine: Value = quantity("N.m", "with the terms of inertia, as the machine has it")
    static: Value = quantity("N.m", "without the terms of inertia")


@result
class ModelDuty:
    """The demands of the duty with one model of the load."""

    words: str = part("the model")
    numbers: DutyNumbers = part(inline=True)


@result
class EventPeaks:
    """The peaks of an event with the inertia of the machine, and with one inertia."""

    machine: EventNumbers = part("with the inertia over the angle")
    static: EventNumbers = part("with one inertia")


@result
class StaticInertiaFindings(Findings):
    """The duty with each model of the load, and the other choice."""

    speed: float = quantity(
        "rad/s", "speed of the {driver} to which the terms of inertia belong", kind="speed"
    )
    inertia: Inertia = part("the inertia over a turn", titled=True)
    constant_speed: ConstantSpeed = part(
        "RMS torque over a turn at constant speed, without a motor", titled=True
    )
    machine: ModelDuty = part("the machine, with its inertia over the angle")
    static: ModelDuty = part("one inertia, torque without terms of inertia")
    with_terms: ModelDuty = part("one inertia, torque with the terms of inertia at constant speed")
    deviations: Mapping[str, Mapping[str, float]] = part(
        "relative deviation of each number from that of the machine, by model", unit="1", kind="percent"
    )
    events: Mapping[str, EventPeaks] = part("peaks of the events, by name")
    residual: float = quantity(
        "1",
        "energy residual of start-up and steady running with one inertia over the energy moved, the largest",
    )
    choice: OtherChoice | None = part(
        "the drive that is chosen with one inertia; none where the file gives the motor"
    )
    no_choice: str = part("why there is no other choice, where the search or its trial failed; else empty")
    runs: TwinRuns

    @property
    def differs(self) -> bool:
        """Whether one inertia gives other numbers, or another drive."""
        shares = [*self.deviations["static"].values()]
        for peaks in self.events.values():
            own, its = (Layout(EventNumbers).values(each) for each in (peaks.machine, peaks.static))
            shares += [x / y - 1.0 for x, y in zip(its, own, strict=True) if y]
        is_other = self.choice is not None and self.choice.differs
        return is_other or any(abs(share) > ALIKE for share in shares)

    def remark(self, study: StudyRecord) -> None:
        """The warning where another drive would have been chosen."""
        remark_on(study, self.inertia.mean, self.choice, self.no_choice)


class StaticInertiaAnalysis(Analysis):
    """The comparison, where the study asks for it and the machine has an inertia that belongs to its angle."""

    name = "static_inertia"
    needs_runs = True

    @staticmethod
    def applies(drive: Drive, plans: Mapping[str, Any]) -> bool:
        """Whether the study asks for it, and the drive can be run so."""
        return bool(plans["static_inertia"]) and not obstacle(drive)

    @staticmethod
    def find(study: StudyRecord, work: Work) -> StaticInertiaFindings | None:
        """Run the duty with one inertia, and repeat the choice of the motor. None where a run with one inertia fails:
        that is no fault of the drive, and a note tells it.

        Raises
        ------
        InterruptedRunError
            after Ctrl-C.
        """
        operation, machine = work.rig.operation, study.drive.machine
        turn = cycle(machine, operation.crank_speed, operation.feed)
        inertia = turn.inertia_at(1.0)
        mean = float(np.mean(inertia))
        other = twin(machine, mean)
        rig = with_machine(work.rig, other)

        def progress(time: float) -> None:
            work.progress("the machine with one inertia", time, operation.stop)

        try:
            runs = run_twin(rig, _events(study), progress)
        except InterruptedRunError:
            raise
        except RunError as error:
            study.note(KIND, "The duty could not be run with one inertia: {why}.", why=str(error))
            return None
        assert study.started is not None
        numbers = numbers_of(*study.started.windows)
        choice, no_choice = choose_other(study, mean, work)
        return StaticInertiaFindings(
            speed=operation.crank_speed,
            inertia=Inertia(mean=mean, least=float(np.min(inertia)), largest=float(np.max(inertia))),
            constant_speed=ConstantSpeed(
                machine=_rms(turn), static=_rms(cycle(other, turn.crank_speed, operation.feed))
            ),
            machine=ModelDuty("J over the angle: the machine", numbers),
            static=ModelDuty("one J, torque without terms of inertia", runs.numbers),
            with_terms=ModelDuty(
                "one J, torque with terms of inertia at constant speed", runs.numbers_with_terms
            ),
            deviations={
                "static": deviations(numbers, runs.numbers),
                "with_terms": deviations(numbers, runs.numbers_with_terms),
            },
            events={
                name: EventPeaks(event_numbers(work.rig, from_event_on(study, name)), peaks)
                for name, peaks in runs.events.items()
            },
            residual=runs.residual,
            choice=choice,
            no_choice=no_choice,
            runs=runs,
        )


def _events(study: StudyRecord) -> list[Event]:
    """The events whose runs can be compared: a torque limiter cuts the peaks off."""
    if study.config.coupling:
        return []
    return [event for name, event in study.config.events.items() if name in study.answers]


def _rms(turn: Cycle) -> float:
    return float(np.sqrt(np.mean(np.square(turn.crank_torque))))


def deviations(machine: DutyNumbers, other: DutyNumbers) -> dict[str, float]:
    """The relative deviation of each number that both have; that of a temperature is left out."""
    found = {}
    for v in Layout(DutyNumbers).variables:
        own, its = getattr(machine, v.name), getattr(other, v.name)
        if own and its is not None and v.unit != "K":
            found[v.name] = float(its) / float(own) - 1.0
    return found
