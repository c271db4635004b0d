"""Study files: their contents, and the checks of values that must fit together; `reading` has the reader."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from contextlib import AbstractContextManager, nullcontext
from functools import cached_property
from pathlib import Path
from typing import Any

from ..core.brief import briefly_shown
from ..core.errors import Faults, GeometryError, InputError, each_refusal, refusal_prefix
from ..core.quantities import USUAL, Layout, variables
from ..drives.catalogue import CatalogueMotor
from ..machines.admissible import admits, causes
from ..machines.api import machine_of
from ..machines.machine import Machine
from ..machines.paper_ratios import Ratios, of_ratios
from ..mechanism.models import MachineModel
from ..reading.tables import (
    UnusualValue,
    entries,
    filled,
    given_values,
    in_file,
    named_table,
    read,
    read_table,
    slips_of,
    text_faults,
    toml,
    unusual_values,
)
from ..reading.text import DEFAULT_UNITS, Units, chosen_units
from ..reading.toml_lines import lines_of
from .checks import (
    check_order,
    check_values,
    endless,
    independent,
    loads_beyond,
    missing_recordings,
    plate_of,
    without,
)
from .event import Event
from .event_table import read_events
from .file_section import FileSection
from .foreign_machine import ForeignMachine, ForeignModel
from .line.flywheel import FlywheelShaft
from .line.slip_plan import SlipPlan
from .motor_sources import ForeignMotor, MotorSource, NamedMotor, OwnMotor
from .operation import DriveTables, OperatingConditions
from .parts import (
    Parts,
    beside,
    catalogues_of,
    example,
    linkage_lines,
    motor_is_left,
    over_example,
    with_frictions,
    with_linkage,
)
from .proposal import DriveRequest, motor_choice
from .registry import organ_models, registered
from .sections import (
    Coupling,
    Run,
    all_choices,
)


@briefly_shown
@dataclasses.dataclass(frozen=True)
class FileContents:
    """The contents of a study file, as they stand in it, and where each value comes from."""

    source: str
    """name of the file, or words for tables from Python"""
    given: frozenset[str] = frozenset()
    """names of all values that the file sets, such as "machine.crank.m"; see `of_example`"""
    of_example: frozenset[str] = frozenset()
    """names of all values that the file leaves out and the example sets; all others have their declared start
    values"""
    choices: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    """by name, all values that are no quantities, such as "start" or "driveline.place", given or not"""
    catalogues: tuple[Path, ...] = ()
    """the catalogues that it names"""
    unusual: tuple[UnusualValue, ...] = ()
    """values of an unusual size, also in the linkage file if the study does not replace them"""
    tables: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    """the tables and keys as the file has them"""
    text: str = dataclasses.field(default="", repr=False)
    """the file as it was read; empty for tables from Python"""
    linkage: str = ""
    """name of the linkage file of its machine, if it names one"""
    linkage_lines: Mapping[str, int] = dataclasses.field(default_factory=dict)
    """the line of each key in the linkage file"""
    labels: Mapping[str, str] = dataclasses.field(default_factory=dict)
    """project, author, date and revision, as far as the file gives them"""
    is_packaged: bool = False
    """whether it is the packaged example"""

    def refusals(self) -> AbstractContextManager[None]:
        """A context in which an InputError begins with the name of the study file and the line of its key; with
        tables from Python the error stays as it is."""
        return in_file(self.source, lambda: self.lines) if self.text else nullcontext()

    @cached_property
    def lines(self) -> Mapping[str, int]:
        """The line of each key in the file."""
        return lines_of(self.text)

    @property
    def slips(self) -> tuple[UnusualValue, ...]:
        """The unusual values whose unit is likely mistaken, as the file does not state it."""
        return slips_of(self.unusual)

    def gives(self, section: str) -> bool:
        """Whether the file sets anything in that table."""
        return any(name.startswith(f"{section}.") for name in self.given)


@dataclasses.dataclass(frozen=True)
class FileReading:
    """A study file each of whose values is allowed, on the way to its `Config`."""

    data: Mapping[str, Any]
    """tables and keys as the file has them"""
    form: Any
    """its checked form, completed by the example"""
    parts: Parts
    values: Mapping[str, Any]
    """by table, its declared quantities, completed by their start values"""
    given: Mapping[str, Mapping[str, float]]
    """by table, the quantities that file and example give"""
    machine: Machine | None
    """None for a machine that was refused"""
    events: Mapping[str, Event]
    source: str
    """name of the file; paths in it are relative to it"""


@briefly_shown
@dataclasses.dataclass(frozen=True)
class Config:
    """A study, checked: machine, motor, loads, runs and events by the names of their runs."""

    title: str
    machine: Machine
    feed: Any
    """loads in normal running, as the machine declares them"""
    motor: MotorSource | None
    """None where a capability chooses the motor"""
    drive: DriveTables
    run: Run
    events: Mapping[str, Event]
    coupling: Coupling | None
    empty_start: bool
    """whether the feed comes once the machine runs"""
    simulation: str
    """one of `SIMULATIONS`"""
    file: FileContents
    units: Units = dataclasses.field(default_factory=lambda: DEFAULT_UNITS)
    """units in which the report shows numbers"""
    values: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    """by table of a part of the line or of a capability, the values of its declared quantities; None for an optional
    table that the file does not have"""
    plans: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    """by part of the line and capability, the plan that its tables state, or None"""

    def with_file(self, **changes: Any) -> Config:
        """The study with other facts on its file, by the names of `FileContents`."""
        return dataclasses.replace(self, file=dataclasses.replace(self.file, **changes))

    @cached_property
    def operation(self) -> OperatingConditions:
        """What the runs of the drive have in common."""
        return OperatingConditions(
            self.run, self.feed, self.empty_start, self.drive.starter_time, self.coupling, self.simulation
        )

    @property
    def drive_request(self) -> DriveRequest:
        """The machine for a capability that chooses its motor."""
        return DriveRequest(
            self.machine,
            self.organs,
            self.operation,
            self.events,
            self.drive,
            self.values,
            self.file.catalogues,
        )

    @property
    def permitted_temperature(self) -> tuple[str, float]:
        """Permitted temperature of the winding if the steady turns go on for ever [K], after its name in the
        study file."""
        if (choice := motor_choice(self.plans)) is not None:
            return choice.permitted_temperature
        return "run.winding_temperature", float(self.run.winding_temperature)

    @property
    def organs(self) -> Any:
        """The model of the organs in its runs, a `chainunit.study.organs.OrganModel`."""
        return organ_models()[self.file.choices["organ"]]

    @property
    def plate(self) -> CatalogueMotor | None:
        """The motor of the catalogue that the file names, if it names one."""
        return None if self.motor is None else self.motor.plate

    @property
    def given_events(self) -> list[str]:
        """Names of the events that the file gives itself."""
        return list(self.events) if self.file.gives("event") else []

    @property
    def knows_motor(self) -> bool:
        """Whether the file has the data of the motor."""
        return self.file.gives("motor") or self.plate is not None

    @property
    def of_catalogue(self) -> bool:
        """Whether the motor is one of the catalogue."""
        return self.motor is None or self.plate is not None

    def table(self, name: str) -> Any:
        """The values of a table; None for an optional table that the file does not have."""
        if name in _OF_DRIVE:
            return getattr(self.drive, name)
        return getattr(self, name) if name in _OWN_TABLES else self.values[name]


def load(file: Path | None = None) -> Config:
    """Read and check a study file; without one, the packaged example.

    Raises
    ------
    InputError
        with a line for each fault: the file, the key, its value and the allowed range.
    """
    config = read(file, example, parse)
    return config.with_file(is_packaged=file is None)


def parse(text: str, source: str = "config") -> Config:
    """A study from TOML text, see `of_tables`.

    Raises
    ------
    InputError
        see `load`.
    """
    return of_tables(toml(text), source).with_file(text=text)


def of_tables(data: Mapping[str, Any], source: str) -> Config:
    """A study from the tables and keys of its file. A value that they leave out is that of the packaged
    example, or else the declared start value. Paths are relative to the file `source`.

    Raises
    ------
    InputError
        with a line for each fault.
    """
    if faults := text_faults(data):
        raise InputError.joined(faults)
    if isinstance(data.get("motor"), list):
        raise InputError(
            "motor: tables [[motor]] make a catalogue; name this file in a study file by catalogue", "motor"
        )
    if isinstance(data.get("links"), Mapping) and "driver" in data:
        raise InputError(
            "links, driver: this is a linkage file, which describes a machine; a study file names it by linkage "
            "in [machine], and chainunit linkage FILE shows it",
            "links",
        )
    try:
        return _of_tables(data, source)
    except InputError as error:
        # the commands read the recordings; a missing one is told beside the faults of the file
        if missing := list(missing_recordings(data, source)):
            raise InputError.joined([*error.faults, *missing]) from error
        raise


def _of_tables(data: Mapping[str, Any], source: str) -> Config:
    """See `of_tables`. Faults of single values are refused together with the faults of the whole study that do not
    depend on them."""
    in_system, kind_faults = with_frictions(with_linkage(data))
    parts, faults = check_values(in_system, source)
    faults = [*kind_faults, *faults]
    if parts is None:
        # a key that the file has, not the one that stands for it
        same = in_system.get("system") is data.get("system")
        raise InputError.joined(faults if same else [_of_linkage(fault) for fault in faults])
    data = in_system
    if not faults:
        return _of_values(data, parts, source)
    # the right values are checked together, too, as far as they do not depend on the wrong ones
    try:
        _of_values(without(data, faults), parts, source)
    except InputError as error:
        faults += independent(error.faults, faults)
    raise InputError.joined(faults)


def _of_linkage(fault: InputError) -> InputError:
    """The refusal of the machine that ``linkage`` in [machine] names, by that key."""
    if fault.placed or fault.key != "system.machine":
        return fault
    key = "machine.linkage"
    return InputError(str(fault).replace(fault.key, key, 1), key)


def _of_values(data: Mapping[str, Any], parts: Parts, source: str) -> Config:
    """The study of a file each of whose values is allowed; see `of_tables`."""
    whole = over_example(data, parts)
    form = read_table(parts.form, whole)
    declared = {name: section.declaration for name, section in parts.sections.items()}
    replaced = {f"parameters.{name}" for name in named_table(data, "machine")}
    replaced |= {f"inputs.{name}" for name in named_table(data, "feed")}
    unusual = tuple(value for value in parts.unusual if value.name not in replaced)
    usual = {"run.crank_speed": parts.machine.usual_speed, **_usual_lengths(parts.machine, form)}
    unusual += tuple(unusual_values(declared, data, usual))
    with each_refusal(lambda fault: _with_hints(fault, unusual)):
        events = read_events(form.event, parts.machine)
        if "event" in data:
            kinds = {f"event.{name}": event.Parameters for name, event in events.items()}
            tables = dict(zip(events, data["event"], strict=True))
            unusual += tuple(unusual_values(kinds, {"event": tables}))
        given_names, names = _names(data, events), _names(whole, events)
        linkage, lines = linkage_lines(data, source)
        contents = FileContents(
            source,
            given_names,
            of_example=names - given_names - {"title"},
            choices=_choices(form, parts),
            unusual=unusual,
            tables=data,
            linkage=linkage,
            linkage_lines=lines,
            labels=form.report.labels,
        )
        return _config(form, parts, events, contents)


def _usual_lengths(machine: MachineModel, form: Any) -> dict[str, tuple[float, float]]:
    """The usual sizes of lengths that another length of the file limits; see `InverseMachine.within`."""
    low, high = USUAL["m"]
    return {
        f"machine.{name}": (low, min(most, high))
        for name, longer in machine.within.items()
        if (most := getattr(form.machine, longer, None)) is not None
    }


def _with_hints(fault: InputError, unusual: Iterable[UnusualValue]) -> InputError:
    """A refusal, followed by the unusual values of its table: where values do not fit together, one may be a
    slip of the unit."""
    table = fault.key.partition(".")[0]
    hints = [
        f'was {value.variable.name} = "{value.meant}" meant?'
        for value in unusual
        if value.meant and value.variable.name.startswith(f"{table}.")
    ]
    return InputError("; ".join([str(fault), *hints]), fault.key) if hints else fault


_OF_PARTS = ("machine", "ratios", "motor")
"""Tables whose values follow from others, too: `Config` has them as machine and motor."""
_OWN_TABLES = ("feed", "run", "coupling")
"""Tables whose values are fields of a `Config`."""
_OF_DRIVE = ("gear", "starter", "flywheel")
"""Tables whose values are fields of `Config.drive`."""


def _config(checked: Any, parts: Parts, events: Mapping[str, Event], contents: FileContents) -> Config:
    """The study of a file each of whose values is allowed: first its parts, whose faults are refused together, then
    the whole, in which parts may not fit each other. An optional table that the file leaves out is None."""
    sections, faults = parts.sections, Faults()
    data, source = contents.tables, contents.source
    tables, values = _read_sections(sections, checked, faults)
    faults.add(check_order(values))
    catalogues: tuple[Path, ...] = ()
    with faults.collected(), refusal_prefix("catalogue = ", "catalogue"):
        catalogues = catalogues_of(checked.catalogue, source)
    machine: Any = None
    plate = None
    with faults.collected():
        machine = _machine(parts, tables["machine"], tables["ratios"])
    with faults.collected():
        plate = plate_of(parts.designation, catalogues)
    with faults.collected(), refusal_prefix("motor: ", "motor"):
        if parts.gives_motor:
            parts.motor.check(values["motor"])
    reading = FileReading(data, checked, parts, values, tables, machine, events, source)
    plans: dict[str, Any] = {}
    for capability in registered():
        with faults.collected():
            plans[capability.name] = capability.plan(reading)
    faults.refuse()
    completed: dict[str, Any] = {
        name: section.completed(values[name], reading) if name in data or not section.optional else None
        for name, section in sections.items()
        if name not in _OF_PARTS
    }
    config = Config(
        title=checked.title,
        machine=organ_models()[checked.organ].machine(machine, completed),
        motor=_motor(data, parts, checked, values["motor"], plate, source),
        drive=DriveTables(
            feed_forward=checked.feed_forward,
            start=checked.start,
            given=contents.given,
            flywheel_shaft=FlywheelShaft(checked.flywheel.place, float(values["flywheel"].turns)),
            line=tuple(plan for plan in plans.values() if isinstance(plan, SlipPlan)),
            **{name: completed[name] for name in _OF_DRIVE},
        ),
        events=events,
        empty_start=checked.empty_start,
        simulation=checked.simulation,
        file=dataclasses.replace(contents, catalogues=catalogues),
        units=chosen_units(checked.report.units),
        values={name: table for name, table in completed.items() if name not in (*_OWN_TABLES, *_OF_DRIVE)},
        plans=plans,
        **{name: completed[name] for name in _OWN_TABLES},
    )
    faults.add(loads_beyond(machine.model, config.feed, events, plans, known_motor=not parts.file))
    for capability in registered():
        faults.add(capability.faults(config))
    faults.add(endless(config.operation, events, plans))
    faults.refuse()
    return config


def _motor(
    tables: Mapping[str, Any],
    parts: Parts,
    checked: Any,
    parameters: Any,
    plate: CatalogueMotor | None,
    source: str,
) -> MotorSource | None:
    """The motor of a file, one of these `parameters` or one that it names; None where a capability chooses it."""
    if motor_is_left(tables):
        return None
    if parts.file:
        names = given_values(checked.system.motor_names)
        return ForeignMotor(beside(parts.file, source), names, checked.system.motor_parameters)
    if plate is not None:
        return NamedMotor(plate)
    return OwnMotor(parts.motor, parameters)


def _read_sections(
    sections: Mapping[str, FileSection], checked: Any, faults: Faults
) -> tuple[dict[str, dict[str, Any]], dict[str, Any]]:
    """By table, the values that the file gives, and the declared quantities completed by the quantities that it
    leaves out."""
    tables: dict[str, dict[str, Any]] = {}
    values = {}
    for name, section in sections.items():
        tables[name] = {}
        with faults.collected():
            tables[name] = section.form.values(getattr(checked, name))
        layout = Layout(section.declaration)
        quantities = {key: x for key, x in tables[name].items() if key in layout.names}
        values[name] = layout.from_names(quantities, section.default)
    return tables, values


def _choices(checked: Any, parts: Parts) -> dict[str, Any]:
    """All values of a file that are no quantities of a table."""
    choices = {name: getattr(checked, name) for name in all_choices()}
    for name, section in parts.sections.items():
        table = getattr(checked, name)
        choices |= {f"{name}.{key}": getattr(table, key) for key in section.keys}
        if section.form.instead is not None:
            others = {v.name: getattr(table, v.name) for v in variables(section.form.instead)}
            choices |= {f"{name}.{key}": x for key, x in others.items() if x is not None}
    choices |= {"system.machine": checked.system.machine, "system.motor": parts.named_motor}
    for table in ("machine_names", "motor_names"):
        names = given_values(getattr(checked.system, table))
        choices |= {f"system.{table}.{name}": x for name, x in names.items()}
    return choices


def _names(data: Mapping[str, Any], events: Mapping[str, Event]) -> frozenset[str]:
    """Names of all values that a file gives, events by the names of their runs."""
    if "event" in data:
        data = {**data, "event": dict(zip(events, data["event"], strict=True))}
    return frozenset(name for name, value in entries(data) if not isinstance(value, Mapping))


def _machine(parts: Parts, parameters: dict[str, float], of_papers: Mapping[str, float]) -> Machine:
    """The machine by its lengths, or by the papers' ratios in their place."""
    make: Any = ForeignMachine if isinstance(parts.machine, ForeignModel) else machine_of

    def machine_with(lengths: Mapping[str, float]) -> Machine:
        """The machine with its `parameters` and these lengths [m], which follow from the ratios."""
        values = {**parameters, **lengths}
        try:
            return make(parts.machine, values)
        except InputError as error:
            if of_papers and isinstance(error, GeometryError) and not {*error.names} & parameters.keys():
                # of the ratios alone
                raise
            refused: InputError = _refused_machine(error, parts.machine, values)
            raise refused from error

    if not of_papers:
        return machine_with({})
    try:
        return of_ratios(machine_with, filled(Ratios, of_papers))
    except GeometryError as error:
        raise InputError(f"ratios: {error}", error.key or "ratios") from error


def _refused_machine(error: InputError, model: MachineModel, parameters: dict[str, float]) -> InputError:
    """The refusal of a machine with these `parameters` of its file: the error, the values at fault that the file
    leaves out, and for each value that alone would do it, the allowed ones. Its key is such a value of the file."""
    names, remedies = tuple[str, ...](), dict[str, str]()
    if isinstance(error, GeometryError):
        names = error.names
        remedies = causes(admits(model), parameters, model.parameter_layout, model.Parameters())
    # first the value that spoils the machine, then one whose range that value sets
    key = next((f"machine.{name}" for name in (*remedies, *names) if name in parameters), "machine")
    declared = Layout(model.Parameters).by_name(model.Parameters())
    left_out = [name for name in names if name in declared and name not in parameters]
    text = f"machine: {error}"
    if listed := ", ".join(f"{name} = {declared[name]:g}" for name in left_out):
        text += f"; not in the file, so at the declared start value: {listed}"
    if remedies:
        text += f"; with all other values as they are, {', or '.join(remedies.values())}"
    return InputError(text, key=key)
