"""The fluid coupling on the motor's shaft, before belt and gear."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.quantities import Value, declaration, percentage, quantity
from ...drives.fluid_coupling import FluidCoupling, FluidCouplingData
from ...reading.results import part, result
from ..analysis import Analysis, Findings, Work
from ..arrays import peak
from ..file_section import FileSection
from ..readings import motor_pull_out
from ..record import StudyRecord
from ..remark import note, warning
from ..verdict import STEADY
from ..window import Phase
from .slip_plan import SlipPlan
from .slipping import SlippingPart, SlipRun, parts_of_runs

_PUMP, _TURBINE = 20.0, 10.0
"""Inertia of pump wheel and housing and of the turbine wheel over the rated torque by the square of the rated speed
[1]: torque and inertia grow alike with the density of the oil and the fifth power of the diameter."""


_MUCH = 1.5
"""Slip in steady running over the rated one from which on the coupling is too small."""


@declaration
class FluidCouplingTable(FluidCouplingData):
    """A fluid coupling on the motor's shaft."""

    heat_capacity: Value = quantity(
        "J/K", "heat capacity of oil and wheels; 0: not known, and no time to the plug", default=0.0, min=0.0
    )
    temperature: Value = quantity("K", "temperature of the oil before an overload", default=343.15, min=230.0)
    plug_temperature: Value = quantity(
        "K", "temperature at which its fusible plug melts", default=413.15, min=330.0
    )


@dataclass(frozen=True)
class FluidCouplingPlan(SlipPlan):
    """The coupling of a study."""

    name = "fluid_coupling"
    model = FluidCoupling
    decouples = True

    def completed(self, table: Any, ratio: float) -> Any:
        """With the inertia of a coupling of this size."""
        size = table.rated_power / table.rated_speed**3
        return self.filled(table, J_motor=_PUMP * size, J_driven=_TURBINE * size)

    def stall_torque(self, table: Any) -> float:
        """See `SlipPlan`."""
        return float(table.stall_torque)


@declaration
class CouplingAnswers:
    """The load of the coupling in a run. `plug_time` is the time from the begin of an event until its plug melts, if
    all its heat stays in it."""

    torque_peak: Value = quantity("N.m", "torque at the motor's shaft, peak")
    torque_share: Value = percentage("the same over the rated torque")
    slip_mean: Value = percentage("slip, mean")
    slip_largest: Value = percentage("slip, largest")
    loss_mean: Value = quantity("W", "power turned into heat, mean")
    heat: Value = quantity("J", "heat")
    plug_time: Value = quantity("s", "fusible plug melts after, at the earliest")


@result
class CouplingFindings(Findings):
    """By run, the load of the fluid coupling; and its rated and its stall torque."""

    rated_torque: float = quantity("N.m", "rated torque")
    rated_slip: float = percentage("rated slip")
    stall_torque: float = quantity("N.m", "torque in a stall with the motor at its rated speed")
    motor_torque: float | None = quantity("N.m", "pull-out torque of the motor, at its shaft")
    answers: Mapping[str, CouplingAnswers] = part("load of the fluid coupling, by run", default_factory=dict)

    def remark(self, study: StudyRecord) -> None:
        """The load beside the rated one, the motor in a stall, and the plug."""
        steady, findings = self.answers[STEADY], study.findings
        if steady.slip_mean > _MUCH * self.rated_slip:
            findings.say(_TOO_SMALL, STEADY, slip=steady.slip_mean, rated=self.rated_torque)
        if self.motor_torque is not None and self.stall_torque > self.motor_torque:
            findings.say(_MOTOR_STALLS, stall=self.stall_torque, motor=self.motor_torque)
        for name, answers in self.answers.items():
            if answers.plug_time is not None:
                title = study.runs.title_of(name)
                findings.say(_PLUG, name, title=title, time=answers.plug_time, heat=answers.heat)


_TOO_SMALL = warning(
    "fluid-coupling-too-small",
    "The fluid coupling slips by {slip} in steady running, more than 1.5 times its rated slip. Its rated torque is "
    "{rated}.",
    remedy="A coupling of more power (fluid_coupling.rated_power) or more oil (filling) slips less.",
    sizes={("1", "percent"): "slip", "N.m": "rated"},
)
_MOTOR_STALLS = warning(
    "fluid-coupling-stalls-motor",
    "The fluid coupling takes up to {stall} from the motor's shaft if the machine is stuck, and the motor gives "
    "{motor} at most. The motor stalls with the machine.",
    remedy="A lower peak factor or less oil (fluid_coupling.filling) lets the motor run on.",
    sizes={"N.m": "stall motor"},
)
_PLUG = note(
    "fusible-plug",
    "{title}: the fluid coupling takes up {heat}, and its fusible plug melts {time} after the begin if all of it "
    "stays in the coupling.",
    sizes={"s": "time", "J": "heat"},
)


def melting(run: SlipRun, table: FluidCouplingTable) -> float | None:
    """Time from the begin of a run until the plug melts [s]; None where it does not, or where the heat capacity is
    not known."""
    if not table.heat_capacity:
        return None
    steps = 0.5 * (run.heat[1:] + run.heat[:-1]) * np.diff(run.time)
    needed = table.heat_capacity * (table.plug_temperature - table.temperature)
    melted = np.flatnonzero(np.cumsum(steps) >= needed)
    if melted.size:
        return float(run.time[melted[0] + 1] - run.time[0])
    if run.slip[-1] < 0.5 or not run.heat[-1] > 0.0:
        return None
    # the machine stands at the end, and the heat goes on
    return float(run.time[-1] - run.time[0] + (needed - np.sum(steps)) / run.heat[-1])


class CouplingAnalysis(Analysis):
    """The load of the fluid coupling in each run."""

    name = "coupling_slip"
    needs_runs = True
    applies = staticmethod(lambda drive, plans: drive.line.part(FluidCouplingPlan.name) is not None)

    @staticmethod
    def find(study: StudyRecord, work: Work) -> CouplingFindings:
        """The load in each run."""
        drive = study.setup.drive
        placed = drive.line.part(FluidCouplingPlan.name)
        assert placed is not None
        table = placed.table
        rated, answers = table.rated_power / table.rated_speed, {}
        for name, run in parts_of_runs(study.runs, placed):
            torque = peak(run.variables["tau"])
            answers[name] = CouplingAnswers(
                torque_peak=torque,
                torque_share=torque / rated,
                slip_mean=run.mean(run.slip),
                slip_largest=float(np.max(run.slip)),
                loss_mean=run.mean(run.heat),
                heat=run.sum(run.heat),
                plug_time=melting(run, table) if name in study.runs.event_times else None,
            )
        motor = None
        if drive.foreign is None:
            steady = study.runs.window(Phase.STEADY, study.runs.steady)
            motor = motor_pull_out(drive, steady.run, steady.warm)
        return CouplingFindings(rated, table.rated_slip, table.stall_torque, motor, answers)


class FluidCouplingPart(SlippingPart):
    """The part, with the table [fluid_coupling]."""

    name = FluidCouplingPlan.name
    order = 4
    model = FluidCoupling
    plan_type = FluidCouplingPlan
    analysis = CouplingAnalysis
    tables = {  # noqa: RUF012
        "fluid_coupling": FileSection(
            FluidCouplingTable,
            optional=True,
            title="Fluid coupling",
            order=(("temperature", ">", "plug_temperature"),),
            follows={
                "rated_power": "the motor's, by its nameplate",
                "rated_speed": "the motor's, by its nameplate",
                "J_motor": f"{_PUMP:g} times the rated torque by the square of the speed",
                "J_driven": f"{_TURBINE:g} times the rated torque by the square of the speed",
            },
        )
    }


PART = FluidCouplingPart()
