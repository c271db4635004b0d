"""Starts from several crank angles: whether the gear carries their torque, and whether the motor starts from each."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from ..core.quantities import quantity
from ..drives.catalogue import CatalogueMotor
from ..drives.gearing import START_FACTOR
from ..reading.results import derived, part, result
from ..reading.text import number
from .analysis import Analysis, Findings, Work
from .catalogue_drive import usual_boost
from .drive import Drive
from .operation import DriveTables
from .record import StudyFindings, StudyRecord, StudySetup
from .remark import fault, warning
from .rig import Rig
from .sections import SOFTER
from .start_runs import BACKWARDS, StartNumbers, longest_start, starts_from_all
from .torques import at_gear, running_peak, running_words
from .verdict import START

LIMIT = "starter.inverter.limit"
"""Key of the current limit of the inverter."""
FULL_STAR = 0.8
"""Share of the synchronous speed from which on a motor in star may be changed over to delta: below it the current
jumps almost to the one of a start direct on line."""
_PATIENCE = 3.0
"""Time for which a start with a current limit is followed, over that without one."""


@result
class StartFindings(Findings):
    """The starts from several crank angles."""

    starts: tuple[StartNumbers, ...] = part("the starts", name="from")
    running: float = quantity("N.m", "largest torque of running at the output of the gear")
    limit: float = quantity("N.m", "permitted torque of the gear in a start, infinite where none is given")
    running_in: str = part("the run in which running puts most on the gear")
    limited: tuple[StartNumbers, ...] = part(
        "the starts with the current limit of an inverter with the rated current of the motor", default=()
    )
    current_limit: float | None = part(
        "this limit; none where the starts take less current, or on the line", unit="A", default=None
    )

    @derived()
    def worst(self) -> StartNumbers:
        """The start with the largest torque at the output of the gear by load and acceleration."""
        return max(self.starts, key=lambda start: start.quasi_static)

    @derived("N.m")
    def transient(self) -> float:
        """The largest torque of all starts at the output of the gear, with the electromagnetic transient."""
        return float(max(start.gear_torque for start in self.starts))

    @property
    def start_class(self) -> int:
        """Trip class of the relay that holds in every start that reaches its speed; 0 for an inverter."""
        return int(max((start.start_class or 0 for start in self.starts), default=0))

    @property
    def relay_seconds(self) -> float:
        """The hardest start as time at `MULTIPLE` times the rated current [s]; infinite if a start does not reach its
        speed, and 0 for an inverter."""
        return max(math.inf if s.start_time is None else s.relay_seconds or 0.0 for s in self.starts)

    @property
    def weak_star(self) -> list[StartNumbers]:
        """The starts whose change from star to delta comes below `FULL_STAR`, as hard as one direct on line."""
        return [
            start for start in self.starts if start.star_speed is not None and start.star_speed < FULL_STAR
        ]

    @property
    def stuck(self) -> list[StartNumbers]:
        """The starts in which the crank does not come to its speed."""
        return [start for start in self.starts if start.start_time is None]

    @derived("1")
    def over_running(self) -> float:
        """The largest torque of a start over that of running."""
        return float(self.worst.quasi_static / self.running)

    def remark(self, study: StudyRecord) -> None:
        """Warn of a start that is hard on the gear, of a motor that hunts, and of angles from which it does not
        start."""
        self._on_gear(study)
        setup = study.setup
        if setup.drive.follows and setup.plate is not None:
            hunting = self._hunting(setup.drive, setup.plate)
            if hunting is not None:
                study.findings.say(_HUNTS, START, **hunting)
        if self.stuck:
            angles = " and ".join(number(start.angle, "rad") for start in self.stuck)
            is_soft = setup.config.drive.start == "soft"
            ramp = ", or a higher voltage of the soft starter" if is_soft else ""
            study.findings.say(_NO_START, START, where=angles, ramp=ramp)

    def _on_gear(self, study: StudyRecord) -> None:
        """Warn of a start that the gear does not carry, or, if its limit is not known, that puts much more on it than
        running does."""
        worst, starter = self.worst, study.setup.config.drive.start
        numbers: dict[str, Any] = {
            "start": _STARTERS[starter],
            "torque": worst.quasi_static,
            "angle": worst.angle,
            "transient": transient_words(study.setup),
            "most": self.transient,
            "softer": SOFTER[starter],
        }
        large = START_FACTOR * self.running
        if worst.quasi_static > self.limit:
            study.findings.say(_OVER_LIMIT, START, limit=self.limit, **numbers)
        elif study.setup.drive.is_geared and math.isinf(self.limit) and worst.quasi_static > large:
            study.findings.say(
                _OVER_RUNNING,
                START,
                large=f"{START_FACTOR:g}",
                over=self.over_running,
                running=self.running,
                running_in=running_words(study.runs, self.running_in),
                **numbers,
            )

    def _hunting(self, drive: Drive, plate: CatalogueMotor) -> dict[str, Any] | None:
        """The values of the warning of a motor on an inverter that turns backwards in a start; None for others."""
        worst = max(self.starts, key=lambda start: start.backwards)
        if not worst.backwards > BACKWARDS:
            return None
        p = drive.fmu_parameters
        usual, boost = usual_boost(p, plate.nameplate), float(p.inverter.boost)
        least = f"to {number(usual, '1', 'percent')} for this motor"
        if boost <= usual:
            least = f"below {number(boost, '1', 'percent')}"
        return {"backwards": worst.backwards, "angle": worst.angle, "least": least}


_PUTS = "{start} from {a driver} angle of {angle} puts {torque} on the output of the gear by load and acceleration"
_OVER_LIMIT = warning(
    "start-at-gear",
    f"{_PUTS}.",
    "The gear permits {limit} in a start (gear.torque_limit x gear.start_factor). The {transient}, {most}.",
    remedy="{softer}.",
    sizes={"N.m": "torque limit most", "rad": "angle"},
)
_OVER_RUNNING = warning(
    "start-at-gear-over-running",
    f"{_PUTS}, {{over}} times the {{running}} of {{running_in}}.",
    "Gears of catalogues commonly permit about {large} times their rated torque in a start. The {transient}, "
    "{most}.",
    remedy="Choose the gear by this torque (gear.torque_limit, gear.start_factor), or {softer}.",
    sizes={"N.m": "torque running most", "rad": "angle", "1": "over"},
)
_HUNTS = warning(
    "start-hunts",
    "In the start by the inverter the motor turns backwards, at up to {backwards} of its synchronous speed, from "
    "{a driver} angle of {angle}. Too high a voltage at low frequency makes it hunt.",
    remedy="Lower the boost (starter.inverter.boost) {least}.",
    sizes={("1", "percent"): "backwards", "rad": "angle"},
)
_NO_START = fault(
    "no-start",
    "The motor does not bring the {driver} to its speed from {where}.",
    remedy="Take a larger motor{ramp}.",
)


def _with_own_limit(
    tables: DriveTables, rig: Rig, starts: Sequence[StartNumbers], longest: float
) -> tuple[tuple[StartNumbers, ...], float | None]:
    """The starts with the current limit of an inverter with the rated current of the motor, and this limit [A]; none
    where the starts take less current, where the file gives a limit, or on the line."""
    drive = rig.drive
    limit = tables.starter.overload * (drive.rated_current or 0.0)
    if not drive.follows or LIMIT in tables.given or max(start.current for start in starts) <= limit:
        return (), None
    inverter = replace(drive.parameters.inverter, limit=limit)
    drive = replace(drive, parameters=replace(drive.parameters, inverter=inverter))
    limited = starts_from_all(replace(rig, drive=drive, files=None), _PATIENCE * longest)
    return tuple(limited), limit


def weak_in_star(findings: StudyFindings) -> bool:
    """Whether the change from star to delta comes too early in a start, see `StartFindings.weak_star`."""
    starts = StartFindings.found_in(findings)
    return starts is not None and bool(starts.weak_star)


def transient_words(setup: StudySetup) -> str:
    """The title of the largest torque of a start at the output of the gear, with the electromagnetic transient."""
    line = "an upper bound, as the shafts are rigid"
    if setup.drive.line.is_elastic:
        line = "with the stiffness of the driveline"
    return f"electromagnetic transient of the motor puts more on it for some milliseconds ({line})"


_STARTERS = {
    "direct": "A start direct on line",
    "star-delta": "A start in star and delta",
    "soft": "A start with the soft starter",
    "inverter": "A start by the inverter",
}


class StartAnalysis(Analysis):
    """Starts from several angles of a drive with a motor of the catalogue, which has a gear."""

    name = "starts"
    needs_runs = True

    @staticmethod
    def applies(drive: Drive, plans: Mapping[str, Any]) -> bool:
        """Where the motor is of the catalogue; a machine that never repeats a turn takes too long."""
        return drive.rated_current is not None and not drive.simulated_machine.model.never_repeats

    @staticmethod
    def find(study: StudyRecord, work: Work) -> StartFindings | None:
        """The starts; None where the motor does not start at all."""
        if study.runs.start is None or study.runs.start.start_time is None:
            return None
        work.progress(f"starts from other {study.setup.driver_noun} angles", 1.0, 1.0)
        rig, longest = work.rig, longest_start(work.rig.operation.ramp_end, study.runs.start.start_time)
        starts = starts_from_all(rig, longest)
        tables = study.setup.config.drive
        limited, limit = _with_own_limit(tables, rig, starts, longest)
        permitted = tables.gear.start_limit if "gear.torque_limit" in tables.given else math.inf
        running = running_peak(study, at_gear)
        return StartFindings(tuple(starts), running.torque, permitted, running.run, limited, limit)
