"""The checks of a study as an analysis: each check of the data that the file gives, and all that was not checked."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, TypeVar

from ...reading.results import part, result
from ...reading.text import number
from ...study.analysis import Analysis, Findings, Work
from ...study.bearings import largest_load, pin_force
from ...study.permitted_starts import PermittedStarts
from ...study.readings import has_turn, less_than_a_turn, machine_series, turns_made
from ...study.record import StudyRecord
from ...study.remark import warning
from . import coupling, gear, plain, relay, rigid, rolling, section, starting
from .coupling import CouplingCheck, remark_on_coupling
from .gear import GearCheck, ShaftLoad
from .pins import first_word, turning_pins
from .plain import PlainBearing
from .plan import CheckPlan
from .relay import RelayFindings
from .rolling import RollingBearing
from .row import CheckRow, NotChecked
from .section import ShaftSection
from .tables import PLAIN

T = TypeVar("T")


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
            remark_on_coupling(study, self.flexible_coupling)
        for row in self.rows:
            if not row.holds:
                share = number(row.utilisation, "1", "used")
                study.say(
                    _NEEDED if row.at_least else _PERMITTED,
                    of=row.of,
                    title=row.title,
                    value="never" if row.value == math.inf else (row.value, row.unit, row.kind),
                    limit=(row.limit, row.unit, row.kind),
                    used=None if row.utilisation == math.inf else share,
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
        plan: CheckPlan = study.config.plans[CheckAnalysis.name]
        collection = _Found()
        turns = has_turn(study.drive, study.steady)
        if turns:
            _bearings(study, plan, collection)
        collection.add(rigid.checks(study))
        parts: dict[str, Any] = {
            "relay": collection.of(*relay.find(study, plan.relay)),
            "starting": collection.of(*starting.find(study, plan.starting, plan.starts_per_hour)),
        }
        if turns:
            parts |= _of_cycle(study, plan, collection)
        else:
            what = "bearings, gear, shaft of the motor, coupling, shaft sections"
            collection.add([NotChecked(what, less_than_a_turn(study.drive, study.steady))])
        return CheckFindings(
            collection.rolling,
            collection.plain,
            rows=tuple(collection.rows),
            not_checked=tuple(collection.missing),
            **parts,
        )


class _Found:
    """What the checks have found so far."""

    def __init__(self) -> None:
        self.rows: list[CheckRow] = []
        self.missing: list[NotChecked] = []
        self.rolling: dict[str, RollingBearing] = {}
        self.plain: dict[str, PlainBearing] = {}

    def add(self, checks: Iterable[CheckRow | NotChecked]) -> None:
        """Add checks, and things that were not checked."""
        for check in checks:
            if isinstance(check, CheckRow):
                self.rows.append(check)
            else:
                self.missing.append(check)

    def of(self, findings: T, checks: Iterable[CheckRow | NotChecked]) -> T:
        """The findings of a part, whose checks are added."""
        self.add(checks)
        return findings


def _of_cycle(study: StudyRecord, plan: CheckPlan, collection: _Found) -> dict[str, Any]:
    """The findings on parts that carry the cycle, by name; their checks are added."""
    starts, place_and_name = plan.starts_per_hour, (plan.coupling_place, plan.coupling_name)
    return {
        "gear": collection.of(*gear.find(study, plan.gear, plan.separate_bearing)),
        "motor_shaft": collection.of(*gear.motor_shaft(study, plan.motor_shaft)),
        "flexible_coupling": collection.of(
            *coupling.find(study, plan.coupling, *place_and_name, starts, plan.couplings)
        ),
        "section": collection.of(*section.find(study, plan.sections)),
    }


def _bearings(study: StudyRecord, plan: CheckPlan, collection: _Found) -> None:
    """The checks of all bearings."""
    drive, asked = study.drive, plan.bearings
    if drive.foreign_machine:
        collection.add([NotChecked("bearings", "the machine is an FMU, whose pins are not known")])
        return
    if asked:
        turns = study.steady
        machine = drive.simulated_machine
        angles = machine.pin_turns(machine_series(turns))
        time, turn_count = turns["time"].values, turns_made(drive, turns)
    for pin, bearing in asked.items():
        name = machine.model.pins.get(pin)
        if name is None or name not in angles:
            collection.add(
                [NotChecked(f"{pin}, bearing", "its angle is not known with organs that are chains")]
            )
            continue
        force = pin_force(drive, turns, pin)
        largest, run = largest_load(study.pins, pin)
        if bearing.kind == PLAIN:
            of_plain = plain.plain_bearing(bearing.table, time, force, angles[name], largest, run)
            collection.plain[pin] = of_plain
            collection.add(
                plain.checks(pin, of_plain, bearing.table, f"checks.plain.{pin}", study.title_of(run))
            )
        else:
            args = (bearing.kind, bearing.table, time, turn_count, force, angles[name], largest, run)
            of_rolling = rolling.rolling_bearing(*args)
            collection.rolling[pin] = of_rolling
            collection.add(
                rolling.checks(pin, of_rolling, bearing.table, f"checks.rolling.{pin}", study.title_of(run))
            )
    collection.add(_without(turning_pins(drive.machine.model), asked))


def _without(pins: Iterable[str], asked: Mapping[str, Any]) -> Iterator[NotChecked]:
    """The pins without data."""
    if missing := [pin for pin in pins if pin not in asked]:
        table = f"bearing.{first_word(missing[0])}"
        why = f"the file has no table for {'them' if len(missing) > 1 else 'it'}; add [{table}]"
        yield NotChecked(f"bearings at {', '.join(missing)}", why, table)
