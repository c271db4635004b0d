"""The checks of a study as an analysis: each check of the data that the file gives, and all that was not checked."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np

from ...reading.results import part, result
from ...reading.text import number
from ...study.analysis import Analysis, Findings, Work
from ...study.bearings import hardest_run
from ...study.readings import crank_angle, machine_series
from ...study.record import StudyRecord
from ...study.window import whole_turns
from . import plain, rigid, rolling
from .plain import PlainBearing
from .plan import CheckPlan, turning_pins
from .rolling import RollingBearing
from .row import CheckRow, NotChecked
from .tables import PLAIN


@result
class CheckFindings(Findings):
    """The checks, the numbers behind them, and what was not checked."""

    rolling: Mapping[str, RollingBearing] = part("rolling bearings, by the pin")
    plain: Mapping[str, PlainBearing] = part("plain bearings, by the pin")
    rows: tuple[CheckRow, ...] = part("the checks")
    not_checked: tuple[NotChecked, ...] = part("what was not checked")

    def remark(self, study: StudyRecord) -> None:
        """Warn of each check that does not hold."""
        for row in self.rows:
            if not row.holds:
                study.warn(
                    "check",
                    "{of}: {title} {value}, and {bound} {limit} {allowed}: {used} of the limit is used ({clause}).",
                    of=row.of,
                    title=row.title,
                    value=(row.value, row.unit, row.kind),
                    bound="at least" if row.at_least else "at most",
                    limit=(row.limit, row.unit, row.kind),
                    allowed="are needed" if row.at_least else "are permitted",
                    used=number(row.utilisation, "1", "used"),
                    clause=row.clause,
                )


class CheckAnalysis(Analysis):
    """The checks of every study, also of one whose file gives no data for them."""

    name = "checks"
    needs_runs = True

    @staticmethod
    def find(study: StudyRecord, work: Work) -> CheckFindings:
        """The checks over steady running, and of the largest loads of all runs."""
        plan: CheckPlan = study.config.plans[CheckAnalysis.name]
        found = _Found()
        _bearings(study, plan, found)
        found.add(rigid.checks(study))
        return CheckFindings(found.rolling, found.plain, tuple(found.rows), tuple(found.missing))


class _Found:
    """What the checks have found so far."""

    def __init__(self) -> None:
        self.rows: list[CheckRow] = []
        self.missing: list[NotChecked] = []
        self.rolling: dict[str, RollingBearing] = {}
        self.plain: dict[str, PlainBearing] = {}

    def add(self, checks: Iterable[CheckRow | NotChecked]) -> None:
        """Add checks, and things that were not checked."""
        for each in checks:
            if isinstance(each, CheckRow):
                self.rows.append(each)
            else:
                self.missing.append(each)


def _bearings(study: StudyRecord, plan: CheckPlan, found: _Found) -> None:
    """The checks of all bearings."""
    drive, asked = study.drive, plan.bearings
    if drive.foreign_machine:
        found.add([NotChecked("bearings", "the machine is an FMU, whose pins are not known")])
        return
    if asked:
        turns = whole_turns(drive, study.steady)
        machine = drive.simulated_machine
        angles = machine.pin_turns(machine_series(turns))
        time = turns["time"].values
        made = float(np.ptp(crank_angle(drive, turns))) / (2.0 * np.pi)
    for pin, bearing in asked.items():
        name = machine.model.pins.get(pin)
        if name is None or name not in angles:
            found.add([NotChecked(f"{pin}, bearing", "its angle is not known with organs that are chains")])
            continue
        force = np.hypot(*(turns[f"machine.{name}.{axis}"].values for axis in ("fx", "fy")))
        run = hardest_run(study.pins, pin)
        largest = study.pins[run][pin]["peak"] or 0.0
        if bearing.kind == PLAIN:
            of_plain = plain.plain_bearing(bearing.table, time, force, angles[name], largest, run)
            found.plain[pin] = of_plain
            found.add(plain.checks(pin, of_plain, bearing.table, f"checks.plain.{pin}", study.title_of(run)))
        else:
            args = (bearing.kind, bearing.table, time, made, force, angles[name], largest, run)
            of_rolling = rolling.rolling_bearing(*args)
            found.rolling[pin] = of_rolling
            found.add(
                rolling.checks(pin, of_rolling, bearing.table, f"checks.rolling.{pin}", study.title_of(run))
            )
    found.add(_without(turning_pins(drive.machine.model), asked))


def _without(pins: Iterable[str], asked: Mapping[str, Any]) -> Iterator[NotChecked]:
    """The pins without data."""
    if missing := [pin for pin in pins if pin not in asked]:
        why = f"the file has no table for {'them' if len(missing) > 1 else 'it'}; add [bearing.{_key(missing[0])}]"
        yield NotChecked(f"bearings at {', '.join(missing)}", why)


def _key(pin: str) -> str:
    """The first word of a pin's title, as a key of TOML."""
    return pin.split(" ")[0]
