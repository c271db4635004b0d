"""The choice of a drive by sizing, for the machine of a study or for another one with the same duty."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from ...drives.catalogue import CatalogueMotor, Offer, offer
from ...fmu.backends import Backend
from ...machines.machine import Machine
from ...study.config import Config
from ...study.drive import Drive
from ...study.proposal import DriveProposal, Judged
from ...work.progress import TaskProgress
from .duty import Duty, duty_of
from .gear_rows import strong_enough
from .motor_trials import MotorTrials
from .search import motors_on_offer, size
from .table import SizingPlan
from .task import SizingTask


@dataclass(frozen=True)
class SizingChooser:
    """Sizing of a study by its `plan`; FMUs that it needs are written to `folder`."""

    plan: SizingPlan
    config: Config
    folder: Path
    progress: TaskProgress
    backend: Backend | None
    duty: Duty | None = None
    """the duty of the machine for which it has chosen"""

    def _task(self, machine: Machine, own: Offer) -> SizingTask:
        config = self.config
        gears = strong_enough(own.gears, float(self.plan.demands.gear_torque))
        return SizingTask(
            self.plan, config.drive, machine, config.operation, config.events, gears, own.couplings
        )

    def choose(self, machine: Machine) -> DriveProposal:
        """See `chainunit.study.proposal.Chooser`."""
        own = offer(*self.config.file.catalogues)
        task = self._task(machine, own)
        motors = motors_on_offer(task, own.motors)
        self.progress("the machine at constant speed", 0.0, 1.0)
        duty = duty_of(task, self.config.values, self.folder, self.backend)
        # another machine is no model that an FMU can be made of
        backend = self.backend if machine is self.config.machine else None
        found = size(task, motors, duty, self.folder, self.progress, backend)
        return replace(found.proposal(self.config.drive), chooser=replace(self, duty=duty))

    def judge(self, drive: Drive, motor: CatalogueMotor) -> Judged:
        """See `chainunit.study.proposal.Chooser`; on the compiled system."""
        assert self.duty is not None
        task = self._task(self.config.machine, offer(*self.config.file.catalogues))
        return MotorTrials(task, self.duty).judged_drive(drive, motor)
