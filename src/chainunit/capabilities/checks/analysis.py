"""The checks of a study as an analysis: each check of the data that the file gives, and all that was not checked."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from ...reading.results import part, result
from ...reading.text import number
from ...study.analysis import Analysis, Findings, Work
from ...study.line.rigid_line import HOLDS_FROM
from ...study.permitted_starts import PermittedStarts
from ...study.readings import has_turn, less_than_a_turn
from ...study.record import StudyRecord
from ...study.remark import warning
from . import bearings, coupling, gear, relay, section, starting
from .bearings import PlainBearing, RollingBearing
from .coupling import CouplingCheck
from .gear import GearCheck, ShaftLoad
from .plan import CheckPlan
from .relay import RelayFindings
from .row import CheckRow, CheckRule, Checks, NotChecked
from .section import ShaftSection

_RIGID = CheckRule(
    "lowest natural frequency over that of the turns", "ratio", "VDI 2149 Part 1",
    f"f1/f >= {HOLDS_FROM:g}: the rigid model holds", "f1 = natural_frequency; f = driver_frequency", at_least=True,
)  # fmt: skip


@result
class CheckFindings(Findings):
    """The checks, the numbers behind them, and what was not checked."""

    rolling: Mapping[str, RollingBearing] = part("rolling bearings, by the pin")
    plain: Mapping[str, PlainBearing] = part("plain bearings, by the pin")
    section: Mapping[str, ShaftSection] = part("shaft sections, by name", default_factory=dict)
    relay: RelayFindings | None = part(
        "thermal overload relay, where it is checked", optional=True, default=None
    )
    starting: PermittedStarts | None = part(
        "starts per hour, where they are checked", optional=True, default=None
    )
    gear: GearCheck | None = part("the gear beside its ratings", optional=True, default=None)
    motor_shaft: ShaftLoad | None = part("the shaft of the motor", optional=True, default=None)
    flexible_coupling: CouplingCheck | None = part("the flexible coupling", optional=True, default=None)
    rows: tuple[CheckRow, ...] = part("the checks", default=())
    not_checked: tuple[NotChecked, ...] = part("what was not checked", default=())

    def remark(self, study: StudyRecord) -> None:
        """Warn of each check that does not hold, and where no flexible coupling of a catalogue fits."""
        if self.flexible_coupling is not None:
            coupling.remark_on_coupling(study.findings, self.flexible_coupling)
        for row in self.rows:
            if not row.holds:
                study.findings.say(
                    _NEEDED if row.at_least else _PERMITTED,
                    of=row.of,
                    title=row.title,
                    value="never" if row.value is None else (row.value, row.unit, row.kind),
                    limit=(row.limit, row.unit, row.kind),
                    used=None if math.isinf(row.utilisation) else number(row.utilisation, "1", "used"),
                    clause=row.clause,
                )


_NEEDED = warning(
    "check-needed",
    "{of}: {title} {value}, and at least {limit} are needed ({clause}). {used} of the limit is used.",
)
_PERMITTED = warning(
    "check",
    "{of}: {title} {value}, and at most {limit} are permitted ({clause}). {used} of the limit is used.",
)


class CheckAnalysis(Analysis):
    """The checks of every study, also of one whose file gives no data for them."""

    name = "checks"
    needs_runs = True

    @staticmethod
    def find(study: StudyRecord, work: Work) -> CheckFindings:
        """The checks over steady running, and of the largest loads of all runs."""
        plan: CheckPlan = study.setup.config.plans[CheckAnalysis.name]
        checks, line = Checks(tables=study.setup.config.values), study.setup.statics.rigid_line
        turns = has_turn(study.setup.drive, study.runs.steady)
        rolling, plain = bearings.find(study.runs, plan.bearings, checks) if turns else ({}, {})
        if line is None:
            why = "the file gives no elastic line; add [driveline]"
            checks.lack("rigid model of the drive", why, "driveline")
        else:
            checks.check(_RIGID, "shaft line", "rigid_line", line, HOLDS_FROM)
        parts: dict[str, Any] = {
            "relay": relay.find(study, plan, checks),
            "starting": starting.find(study, plan, checks),
        }
        if turns:
            parts |= {
                "gear": gear.find(study, plan, checks),
                "motor_shaft": gear.motor_shaft(study.runs, plan, checks),
                "flexible_coupling": coupling.find(study.runs, plan, checks),
                "section": section.find(study.runs, plan.sections, checks),
            }
        else:
            what = "bearings, gear, shaft of the motor, coupling, shaft sections"
            checks.lack(what, less_than_a_turn(study.setup.drive, study.runs.steady))
        rows, not_checked = tuple(checks.rows), tuple(checks.missing)
        return CheckFindings(rolling, plain, rows=rows, not_checked=not_checked, **parts)
