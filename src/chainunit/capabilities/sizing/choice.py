"""The choice of the motor of a study by sizing."""

from __future__ import annotations

from pathlib import Path

from ...fmu.backends import Backend
from ...study.proposal import DriveProposal, DriveRequest, MotorChoice
from ...work.progress import TaskProgress
from .table import SizingPlan


class SizingChoice(SizingPlan, MotorChoice):
    """The plan of a study with the table [sizing]."""

    @property
    def permitted_temperature(self) -> tuple[str, float]:
        """See `MotorChoice`."""
        return "sizing.temperature", float(self.demands.temperature)

    def proposal(
        self, request: DriveRequest, folder: Path, progress: TaskProgress, backend: Backend | None
    ) -> DriveProposal:
        """The best of the motors that are tried."""
        from ...drives.catalogue import offer
        from .duty import duty_of
        from .gear_rows import strong_enough
        from .search import motors_on_offer, size
        from .task import SizingTask

        offered, tables = offer(*request.catalogues), request.tables
        gears = strong_enough(offered.gears, float(self.demands.gear_torque))
        task = SizingTask(
            self, tables, request.machine, request.operation, request.events, gears, offered.couplings
        )
        motors = motors_on_offer(task, offered.motors)
        progress("the machine at constant speed", 0.0, 1.0)
        duty = duty_of(task, request.organs, request.values, folder, backend)
        return size(task, motors, duty, folder, progress, backend).proposal(tables)
