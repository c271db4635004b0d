"""The parts that a study file names: the kinds of machine and motor, the form of its tables that follows from
them, and the example that gives the values that the file leaves out."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from datetime import date
from functools import cache, lru_cache
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from ..core.errors import Faults, InputError, near_name, refusal_prefix, shown
from ..core.inputs import TOML, file_text
from ..drives.motor import FOREIGN, Motor
from ..machines.differing import friction_of
from ..machines.linkages.file import linkage_in
from ..mechanism.models import MachineModel
from ..models import MACHINES, MOTORS
from ..reading.tables import (
    Title,
    UnusualValue,
    entries,
    file_form,
    given_values,
    merged,
    named_table,
    packaged,
    read_table,
    toml,
)
from ..reading.toml_lines import lines_of
from .file_section import FileSection
from .foreign_machine import foreign_model
from .sections import SystemTable, all_choices, all_sections, choosing_tables, sections_of


def _as_text(value: Any) -> Any:
    """The text of a TOML date; any other value as it is."""
    return value.isoformat() if isinstance(value, date) else value


class ReportTable(BaseModel):
    """The table [report]: the heading of a report and the units in it."""

    model_config = ConfigDict(extra="forbid")
    units: dict[str, Any] = {}
    project: Title = Field("", description="project that the study is for")
    author: Title = Field("", description="author of the study")
    date: Annotated[Title, BeforeValidator(_as_text)] = Field("", description="date of the study")
    revision: Title = Field("", description="revision of the study")

    @property
    def labels(self) -> dict[str, str]:
        """The entries at the head of the report, by their names; only entries that are given."""
        entries = {name: getattr(self, name) for name in type(self).model_fields if name != "units"}
        return {name: text for name, text in entries.items() if text}


EXAMPLES = {
    "chain-unit": "example.toml",
    "knife": "knife.toml",
    "driveline": "driveline.toml",
    "full": "full.toml",
}
"""Packaged study files by the names of the examples."""


@dataclasses.dataclass(frozen=True)
class Parts:
    """The kinds of machine and motor that the table [system] names, and the example that goes with the machine."""

    machine: MachineModel
    motor: Motor
    """model of the motor; `FOREIGN` if the motor is a foreign FMU"""
    designation: str = ""
    """designation of a motor in the catalogue; empty for another motor"""
    file: str = ""
    """file of a motor that is a foreign FMU; empty for another motor"""
    unusual: tuple[UnusualValue, ...] = ()
    """the values of an unusual size in the linkage file of the machine"""
    faults: tuple[InputError, ...] = ()
    """the refusals of further parameters that the machine cannot have"""

    @property
    def named_motor(self) -> str:
        """The name of the motor in a study file."""
        return self.file or self.designation or self.motor.name

    @property
    def gives_motor(self) -> bool:
        """Whether the table [motor] describes the motor."""
        return not self.designation and not self.file

    @property
    def sections(self) -> dict[str, FileSection]:
        """The tables of the file."""
        motor = self.motor if self.gives_motor else MOTORS["DcMotor"]
        return sections_of(self.machine, motor)

    @property
    def form(self) -> type[BaseModel]:
        """The form of the file."""
        return _form(self.machine, self.motor if self.gives_motor else MOTORS["DcMotor"])

    @property
    def keys(self) -> frozenset[str]:
        """The keys of the `form`, which takes long to make."""
        return frozenset({"title", "report", "system", "event", *self.sections, *all_choices()})

    @property
    def example(self) -> dict[str, Any]:
        """The tables of the example, empty where there is none."""
        name = _examples_of_machines().get(self.machine.name)
        tables = toml(example(name)) if name else {}
        # the examples have tables of capabilities, too
        return {name: table for name, table in tables.items() if name in self.keys}


@lru_cache(maxsize=32)
def _form(machine: MachineModel, motor: Motor) -> type[BaseModel]:
    """The form of a file with that machine and motor. It takes longer to make than a file takes to read."""
    tables: dict[str, type[BaseModel]] = {
        name: section.form.model(section.declaration, name, f"{name}.", **section.keys)
        for name, section in sections_of(machine, motor).items()
    }
    tables |= {"report": ReportTable, "system": SystemTable}
    return file_form("Config", tables, **all_choices(), event=(list[Any], []))


LINKAGE, FMU = ".toml", ".fmu"
"""Ends of the names of a linkage file and of an FMU."""


def _is_fmu(name: str) -> bool:
    return name.lower().endswith(FMU)


def is_designation(motor: str) -> bool:
    """Whether the name of a motor is a designation of the catalogue: no model, and no FMU."""
    return bool(motor) and motor not in MOTORS and not _is_fmu(motor)


def parts_of(data: Mapping[str, Any], source: str) -> Parts:
    """Machine and motor of a file. They are checked first, as the other tables depend on them. A file that leaves the
    motor open has the one of its example; a name that is none of a model or an FMU is a designation of a catalogue.

    Raises
    ------
    InputError
        with a line for each fault.
    """
    faults = Faults()
    table = read_table(SystemTable, named_table(data, "system"), "system.")
    motor = table.motor
    machine: MachineModel = MACHINES["ChamberForces"]
    unusual: tuple[UnusualValue, ...] = ()
    with faults.collected(), refusal_prefix("system.motor = ", "system.motor"):
        if _is_fmu(motor):
            beside(motor, source)
    with faults.collected():
        machine, unusual = _machine_model(table, source)
    faults.refuse()
    # one that is no table is refused with the other tables
    parameters = data.get("machine")
    names = [name for name, _ in entries(parameters)] if isinstance(parameters, Mapping) else []
    machine, wrong = _with_further(machine, names)
    parts = Parts(machine, MOTORS["DcMotor"], unusual=unusual, faults=wrong)
    if not motor and "motor" not in data and not motor_is_left(data):
        motor = parts.example.get("system", {}).get("motor", "")
    if not motor:
        return parts
    if _is_fmu(motor):
        return dataclasses.replace(parts, motor=FOREIGN, file=motor)
    if motor in MOTORS:
        return dataclasses.replace(parts, motor=MOTORS[motor])
    return dataclasses.replace(parts, motor=MOTORS["InductionMotor"], designation=motor)


def motor_is_left(data: Mapping[str, Any]) -> bool:
    """Whether a file leaves the choice of the motor to a capability."""
    return any(table in data for table in choosing_tables())


def _with_further(machine: MachineModel, names: Sequence[str]) -> tuple[MachineModel, tuple[InputError, ...]]:
    """The machine with its further parameters among `names`, and the refusals of the others."""
    try:
        return machine.having(names), ()
    except InputError as error:
        keys = tuple(fault.key for fault in error.faults)
        unread_names = [name for name in names if not f"{name}.".startswith(tuple(f"{key}." for key in keys))]
        machine, more = _with_further(machine, unread_names)
        return machine, (
            *(InputError(f"machine.{fault}", f"machine.{fault.key}") for fault in error.faults),
            *more,
        )


def _machine_model(table: Any, source: str) -> tuple[MachineModel, tuple[UnusualValue, ...]]:
    """The machine that the table [system] names, and the unusual values of its linkage file."""
    if table.machine.lower().endswith(LINKAGE):
        with refusal_prefix("system.machine: ", "system.machine"):
            model, unusual = linkage_in(beside(table.machine, source))
            if not (model.turns or model.slides):
                low, high = (math.degrees(end) for end in model.span)
                raise InputError(
                    f"{table.machine} has a driver that swings from {low:g} deg to {high:g} deg, and a study, a "
                    "sizing and a sweep need one that turns all the way round; the report on the linkage shows its "
                    "forces there and back, and its FMU takes its motion, or, as a direct model, its torque"
                )
            if not model.turns:
                raise InputError(
                    f"{table.machine} has a driver that slides, and a motor turns; export it as an FMU, or drive it "
                    "by a crank"
                )
            return model, unusual
    if not _is_fmu(table.machine):
        if table.machine in MACHINES:
            return MACHINES[table.machine], ()
        raise InputError(
            f"system.machine = {shown(table.machine)}: must be one of {', '.join(MACHINES)}, a linkage file "
            ".toml, or a file .fmu" + near_name(table.machine, MACHINES),
            key="system.machine",
        )
    with refusal_prefix("system.machine: ", "system.machine"):
        return foreign_model(beside(table.machine, source), given_values(table.machine_names)), ()


def linkage_lines(data: Mapping[str, Any], source: str) -> tuple[str, Mapping[str, int]]:
    """The name of the linkage file that the table [system] names, and the line of each key in it; empty for another
    machine."""
    name = data.get("system", {}).get("machine", "")
    if not name.lower().endswith(LINKAGE):
        return "", {}
    file = beside(name, source)
    return file.name, lines_of(file_text(file, TOML))


def with_linkage(data: Mapping[str, Any]) -> Mapping[str, Any]:
    """The tables of a file; the machine that ``linkage`` in [machine] names stands in [system], as every machine.

    Raises
    ------
    InputError
        for a name that is none of a linkage file, or a second machine.
    """
    machine = data.get("machine")
    if not isinstance(machine, Mapping) or "linkage" not in machine:
        return data
    system, name = named_table(data, "system"), machine["linkage"]
    if not isinstance(name, str) or not name.lower().endswith(LINKAGE):
        raise InputError(
            f"machine.linkage = {shown(name)}: must be the name of a linkage file, which ends in {LINKAGE}",
            key="machine.linkage",
        )
    if "machine" in system:
        raise InputError(
            f"machine.linkage = {shown(name)}: system.machine names a machine, too; take one of both out",
            key="machine.linkage",
        )
    parameters = {key: value for key, value in machine.items() if key != "linkage"}
    return {**data, "system": {**system, "machine": name}, "machine": parameters}


def example(name: str = "chain-unit") -> str:
    """A packaged study file, by its name in `EXAMPLES`."""
    return packaged(EXAMPLES[name])


def with_frictions(data: Mapping[str, Any]) -> tuple[Mapping[str, Any], list[InputError]]:
    """The tables of a file with the usual friction of a pin that differs in place of its kind of bearing, and the
    refusals of kinds that are none."""
    machine, faults = data.get("machine"), Faults()
    if not isinstance(machine, Mapping) or "pins" not in machine:
        return data, []
    rest = {name: value for name, value in machine.items() if name != "pins"}
    if not isinstance(machine["pins"], Mapping):
        wrong = (
            f"machine.pins = {shown(machine['pins'])}: must be a table of pins, such as pins.A.friction = 0.1"
        )
        return {**data, "machine": rest}, [InputError(wrong, "machine.pins")]
    pins = dict(machine["pins"])
    for name, entry in pins.items():
        if isinstance(entry, Mapping) and "kind" in entry:
            friction: Mapping[str, float] = {}
            key = f"machine.pins.{name}.kind"
            with faults.collected(), refusal_prefix(f"{key}: ", key):
                friction = friction_of(entry)
            pins[name] = {**friction, **{key: value for key, value in entry.items() if key != "kind"}}
    return {**data, "machine": {**rest, **({"pins": pins} if pins else {})}}, faults.errors


@cache
def _examples_of_machines() -> dict[str, str]:
    """By machine, the first example with that machine; a study takes the values that its file leaves out from it."""
    tables = {name: named_table(toml(example(name)), "system") for name in reversed(EXAMPLES)}
    return {read_table(SystemTable, table, "system.").machine: name for name, table in tables.items()}


LONGEST_FILE = 1000
"""largest number of characters of a file's name"""


def beside(name: str, source: str) -> Path:
    """A file that a study file names, relative to the study file.

    Raises
    ------
    InputError
        for a text that is no file name on any system.
    """
    if not name.isprintable() or len(name) > LONGEST_FILE:
        raise InputError(f"{shown(name)}: must be the name of a file, of at most {LONGEST_FILE} letters")
    return Path(source).parent / name


def catalogues_of(names: Any, source: str) -> tuple[Path, ...]:
    """The catalogues that a study file names by a text or a list of texts; none for another value.

    Raises
    ------
    InputError
        see `beside`.
    """
    listed = names if isinstance(names, list) else [names]
    return tuple(beside(name, source) for name in listed if isinstance(name, str) and name)


LENGTHS = ("r", "l", "h", "c", "hy", "e", "l1", "l2", "z")


def over_example(data: Mapping[str, Any], parts: Parts) -> dict[str, Any]:
    """The tables of a study file, completed by the example of its machine: a value that the file leaves out
    is the example's. The example's ratios are dropped if the file gives lengths, its motor if the file names
    another, and so on, see `TableForm.displaced`."""
    base = parts.example
    if any(name in named_table(data, "machine") for name in LENGTHS) and "ratios" not in data:
        base.pop("ratios", None)
    if parts.motor is not parts_of(base, "").motor:
        base.pop("motor", None)
    if "motor" in named_table(data, "system") or motor_is_left(data) or "motor" in data:
        base.get("system", {}).pop("motor", None)
        for name in ("gear", "start", "starter"):
            base.pop(name, None)
    for name, section in all_sections().items():
        for key, others in section.form.displaced.items():
            if not named_table(data, name).keys().isdisjoint(others):
                base.get(name, {}).pop(key, None)
    base["title"] = ""
    return merged(base, data)
