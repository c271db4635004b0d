"""The live machine of a study: its quantities, and the study file that its page gives."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any

from ...core.quantities import named_values, variable_of
from ...drives.catalogue import CatalogueMotor
from ...machines.machine import Machine
from ...study.config import Config
from ...study.drive import Drive
from ...study.event import Event
from ...study.operation import DriveTables
from ...study.parts import LENGTHS
from ...study.proposal import DriveProposal
from ...study.registry import parts_of_line
from ...study.sections import FlywheelTable, choosing_tables
from ...study.study_file import changed_tables
from ...study.verdict import Verdict
from ..blocks import LiveMachine
from .machine import assembled
from .quantities import LiveQuantity, of_machine, speed_of_crank
from .runs import live_runs, reason_without_runs, stand_in
from .turn import live_turn

_TITLE = "with other values"


def of_study(
    config: Config,
    drive: Drive,
    tables: DriveTables,
    proposal: DriveProposal | None = None,
    verdict: Verdict | None = None,
) -> LiveMachine:
    """The live machine of a study.

    Parameters
    ----------
    drive, tables : the drive with the values that follow from it
    proposal : the choice of the drive, where a capability made it
    verdict : the verdict on the model with the values of the study, if it was judged

    Raises
    ------
    InputError
        for an equation with a function that has not the same bits in each browser.
    """
    machine, units, speed = drive.machine, config.units, config.run.crank_speed
    turn = live_turn(machine, float(speed), units)
    why, runs = reason_without_runs(drive), None
    plate = proposal.motor if proposal is not None else config.plate
    if not why:
        runs = live_runs(drive, config.operation, config.events, units)
    model_names = runs.names if runs else set()
    chosen = [*of_machine("feed", config.feed, model_names)]
    if drive.follows or drive.foreign is not None:
        chosen.append(speed_of_crank(float(speed), bool(drive.droop_speed)))
    chosen += [*_ratio(drive, plate is not None), *of_machine("machine", machine.p, model_names)]
    if runs:
        chosen += [*runs.quantities, *_flywheel(drive)]
    # names of other files are as in the study file, beside which the copy lies
    folder = Path(config.file.source).parent
    copied = changed_tables(config, _settled_values(machine, drive, tables, plate), _TITLE, folder)
    copied = _without_dates(_with_drive(copied, drive, tables.start, proposal, config.events))
    live = assembled(turn, runs, why, chosen, copied, units)
    judged = None if verdict is None else {"holds": verdict.holds, "text": verdict.text}
    return replace(live, data={**live.data, "verdict": judged, "organs": stand_in(drive)})


def without_drive(config: Config) -> LiveMachine:
    """The live machine of a study whose drive is not known, as a capability has to choose it."""
    why = "the study chooses the motor; a run of the study makes the page with it"
    machine, speed = config.machine, float(config.run.crank_speed)
    chosen = [*of_machine("feed", config.feed), speed_of_crank(speed), *of_machine("machine", machine.p)]
    turn = live_turn(machine, speed, config.units)
    copied = changed_tables(config, _lengths(machine), _TITLE, Path(config.file.source).parent)
    return assembled(turn, None, why, chosen, _without_dates(copied), config.units)


def _flywheel(drive: Drive) -> Iterable[LiveQuantity]:
    """The inertia of the flywheel, on the motor's shaft or as a part of the line. On a driven pulley it is a part of
    the inertia of the pulley, and no quantity of its own."""
    key, J = ("flywheel", "J"), variable_of(FlywheelTable, "J")
    if drive.flywheel_shaft.is_motor:
        yield LiveQuantity(key, J, drive.added_inertia, "drive", role="added")
    elif drive.geared_line.part("flywheel") is not None:
        yield LiveQuantity(key, J, drive.added_inertia, "drive", runs=("flywheel.J_wheel",))


def _ratio(drive: Drive, is_plate: bool) -> Iterable[LiveQuantity]:
    """The ratio of the gear, where it is one number of the drive."""
    model = drive.machine.model
    if not drive.whole_line and "ratio" in model.parameter_layout.names:
        key = ("gear", "ratio") if is_plate else ("machine", "ratio")
        yield LiveQuantity(key, variable_of(model.Parameters, "ratio"), drive.ratio, "drive", role="ratio")


def _settled_values(
    machine: Machine, drive: Drive, tables: DriveTables, plate: CatalogueMotor | None
) -> dict[str, float]:
    """What follows from the machine, by its key in a study file: another machine shall not have another motor, gear
    or control."""
    values = {f"motor.{name}": x for name, x in (drive.tuning.parameters if drive.tuning else {}).items()}
    values |= _lengths(machine)
    if plate is not None:
        values |= {"gear.ratio": drive.ratio, "gear.efficiency": float(tables.gear.efficiency)}
        if drive.follows:
            inverter = tables.starter.inverter
            values |= {"starter.inverter.boost": inverter.boost, "starter.inverter.slip": inverter.slip}
    return values


def _with_drive(
    copied: dict[str, Any],
    drive: Drive,
    start: str,
    proposal: DriveProposal | None,
    events: Mapping[str, Event],
) -> dict[str, Any]:
    """The tables of a study file with the chosen motor and its `start`, the parts of the line, and the events."""
    if proposal is not None:
        for table in choosing_tables():
            copied.pop(table, None)
        copied.setdefault("system", {})["motor"] = proposal.motor.designation
        copied["start"] = start
        if drive.added_inertia:
            copied.setdefault("flywheel", {})["J"] = drive.added_inertia
    for part in parts_of_line():
        if (placed := drive.line.part(part.name)) is not None:
            copied = part.settled(copied, placed)
    copied["event"] = [_entry(event) for event in events.values()]
    return copied


def _lengths(machine: Machine) -> dict[str, float]:
    """All lengths of a chain unit: a file that gives one takes none from its ratios."""
    values = machine.by_name
    return {f"machine.{name}": values[name] for name in LENGTHS} if machine.model.sides else {}


def _without_dates(copied: dict[str, Any]) -> dict[str, Any]:
    """The tables with the text of a date, which the file takes, too, and JSON does not have."""
    labels = {
        name: x.isoformat() if isinstance(x, date) else x for name, x in copied.get("report", {}).items()
    }
    return copied | ({"report": labels} if labels else {})


def _entry(event: Event) -> dict[str, Any]:
    """An event as a study file has it, with all its quantities."""
    names = {"type": event.kind, "name": event.name} | ({"side": event.side} if event.side else {})
    if event.has_input:
        names["input"] = event.input
    values = {v.name: (int(x) if v.type == "Integer" else x) for v, x in named_values(event.p)}
    return names | values
