"""The tables of a study file: their declarations and values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, StrictBool, create_model

from ..core.quantities import Value, declaration, group, percentage, quantity, whole_number
from ..drives.contactor import StarDelta
from ..drives.gearing import KINDS, Transmission
from ..drives.induction_motor import InverterControl, SoftStart
from ..drives.motor import Motor
from ..machines.across import NO_WIDTH, PLACES
from ..machines.paper_ratios import Ratios
from ..mechanism.models import MachineModel
from ..reading.tables import file_key
from ..system import NAMES
from .file_section import FileNames, FileSection, numbers
from .line.flywheel import MACHINE, MOTOR
from .registry import organ_models, parts_of_line, registered


@declaration
class Run:
    """Speed, duration and step of the runs."""

    crank_speed: Value = quantity(
        "rad/s", "speed of the {driver} in normal running", default=3.0, min=0.01, max=1000.0, kind="speed"
    )
    ramp: Value = quantity(
        "s",
        "time in which the speed reference rises from rest",
        default=1.5,
        min=0.001,
        max=1e4,
        usual=(1e-3, 600.0),
    )
    settle_turns: Value = quantity(
        "1", "{driver} turns after the ramp, before running counts as steady", default=2.0, min=0.0, max=1e4
    )
    turns: Value = whole_number(
        "whole {driver} turns of steady running that are evaluated and that load_cycle.csv holds",
        default=1,
        min=1,
        max=10_000,
    )
    winding_temperature: Value = quantity(
        "K",
        "permitted temperature of the winding if the steady turns go on for ever; with sizing its own",
        default=393.15,
        min=330.0,
        max=1000.0,
    )
    step: Value = quantity("s", "communication step of the co-simulation", default=0.001, min=1e-5, max=0.02)


@declaration
class Coupling:
    """A torque limiter or shear pin on the motor shaft."""

    trip_torque: Value = quantity(
        "N.m", "torque of the {driver} at which it opens", default=1000.0, above=0.0
    )
    release_time: Value = quantity(
        "s",
        "time from the trip until no torque passes; near 0 for a shear pin",
        default=0.005,
        min=0.0,
        max=1.0,
    )
    scatter: Value = quantity(
        "1",
        "standard deviation of the trip torque in a Monte Carlo study, as a share",
        default=0.05,
        min=0.0,
        max=0.5,
    )


@declaration
class FlywheelTable:
    """A flywheel, and the fluctuation for which the least one is searched."""

    J: Value = quantity("kg.m2", "inertia of the flywheel, at its own shaft", default=0.0, min=0.0, max=1e6)
    turns: Value = quantity(
        "1",
        "turns of the flywheel per turn of the {driver}, if it sits on a faster shaft of the machine",
        default=1.0,
        min=0.01,
        max=100.0,
    )
    fluctuation: Value = percentage(
        "permitted fluctuation of the speed, (largest - least)/mean", default=0.05, min=1e-4, max=1.0
    )


@declaration
class Starter:
    """The starter of an induction motor, where `start` is "star-delta", "soft" or "inverter"; the key `start`
    chooses between them."""

    soft_start: SoftStart = group(SoftStart, "soft starter", default=SoftStart(voltage=0.5, time=1.0))
    star_delta: StarDelta = group(StarDelta, "star-delta starter", default=StarDelta())
    inverter: InverterControl = group(InverterControl, "inverter", default=InverterControl())
    overload: Value = quantity(
        "1",
        "largest current of an inverter, for up to 60 s, over its rated current",
        default=1.5,
        min=1.0,
        max=5.0,
    )
    droop: Value = percentage(
        "fall of the frequency of an inverter at the rated torque of the motor, so that a flywheel gives its energy",
        default=0.0,
        min=0.0,
        max=0.3,
    )


SIMULATIONS = ("cs", "me")
"""The methods of simulation: as a co-simulation, or as one ODE of Model Exchange FMUs."""

STARTS = ("direct", "star-delta", "soft", "inverter")

SOFTER: Mapping[str, str] = {
    "direct": 'start softer (start = "soft" or "inverter")',
    "star-delta": 'take more time in star (starter.star_delta.time), or start softer (start = "soft" or "inverter")',
    "soft": "lower the voltage or lengthen the ramp of the soft starter",
    "inverter": "lengthen run.ramp",
}
"""Remedies for a start that is too hard, by the start of the study."""

CHOICES: Mapping[str, Any] = {
    "feed_forward": file_key(
        StrictBool, False, "whether the control of a DC motor is given the torque of a model of the machine"
    ),
    "empty_start": file_key(StrictBool, False, "whether the feed comes once the machine runs"),
    "start": file_key(
        Literal[STARTS],
        "direct",
        "start of a motor of the catalogue: on line, in star and delta, by a soft starter, or by an inverter",
    ),
    "simulation": file_key(
        Literal[SIMULATIONS],
        "cs",
        "how the system runs: as a co-simulation, or as one ODE of Model Exchange FMUs",
    ),
    "catalogue": file_key(
        FileNames,
        "",
        "file with motors, gears or couplings of your own (CSV or TOML), or a list of such "
        "files; the motors stand beside the packaged ones",
    ),
}
"""Keys of every study file that stand before all tables, as pydantic fields."""


@cache
def all_choices() -> dict[str, Any]:
    """The keys before all tables, with the model of the organs."""
    models = organ_models()
    usual, *_ = models
    titles = ", or ".join(model.title for model in models.values())
    organ = Field(usual, description=f"model of the organs: {titles}")
    return dict(CHOICES) | {"organ": (Literal[tuple(models)], organ)}


def _names_form(title: str, names: Sequence[str]) -> type[BaseModel]:
    """The form of a table with a text for each of the `names`; dotted ones stand in tables of their own."""
    fields: dict[str, Any] = {name: (str, Field("", min_length=1)) for name in names if "." not in name}
    for table in dict.fromkeys(name.split(".")[0] for name in names if "." in name):
        inside = [name.removeprefix(f"{table}.") for name in names if name.startswith(f"{table}.")]
        inner = _names_form(f"{title}_{table}", inside)
        fields[table] = (inner, Field(default_factory=inner))
    return create_model(title, __config__=ConfigDict(extra="forbid"), **fields)


_MotorNames = _names_form("motor_names", NAMES["motor"])
_MachineNames = _names_form("machine_names", NAMES["machine"])

SystemTable = create_model(
    "system",
    __config__=ConfigDict(extra="forbid"),
    machine=file_key(str, "ChamberForces", "machine: a model, a linkage file, or an FMU", min_length=1),
    motor=file_key(str, "", "motor: a model, a designation of the catalogue, or an FMU", min_length=1),
    motor_names=(_MotorNames, Field(default_factory=_MotorNames)),
    motor_parameters=file_key(
        dict[str, Any], {}, "parameters of a motor that is an FMU, by its names of them"
    ),
    machine_names=(_MachineNames, Field(default_factory=_MachineNames)),
)
"""Machine and motor of the system: names of models, of motors in the catalogue, or of foreign FMUs, with the
variables whose names differ from ours."""


SECTIONS: Mapping[str, FileSection] = {
    "run": FileSection(Run, title="Run"),
    "coupling": FileSection(Coupling, optional=True, title="Torque limiter"),
    "gear": FileSection(
        Transmission,
        default=KINDS["gear"],
        title="Gear",
        is_used=lambda study: study.setup.config.of_catalogue,
        follows={
            "ratio": "the one that gives the crank its speed under the mean load; with [sizing] the nearest on offer",
            "efficiency": "98 % a stage of a helical gear, 70 % of a worm gear, 95 % of a V-belt; see "
            "sizing.gear_kind",
        },
    ),
    "starter": FileSection(
        Starter,
        title="Starter",
        is_used=lambda study: study.setup.config.of_catalogue and study.setup.config.drive.start != "direct",
        follows={
            "inverter.boost": "5 %, or the drop of the rated current across the stator if less; with [sizing] "
            "two or three times as much, if the machine does not start with less",
            "inverter.slip": "that of the rated slip of the motor; minus the droop, or none with a flywheel, against "
            "which it works",
        },
    ),
    "flywheel": FileSection(
        FlywheelTable,
        optional=True,
        keys={
            "compare": file_key(
                numbers(FlywheelTable, "J", "flywheel.compare", 12), [], "flywheels that are compared [kg m2]"
            )
        },
        title="Flywheel",
    ),
}
"""The tables of every study file beside those of its machine, its feed, its motor, of the parts of the line, and of
the capabilities."""


@cache
def all_sections() -> dict[str, FileSection]:
    """The tables of a study file, those of parts of the line and of capabilities included, by name; without those of
    machine and motor."""
    part_tables = {name: part_section for part in registered() for name, part_section in part.tables.items()}
    tables: dict[str, FileSection] = {}
    for table, section in SECTIONS.items():
        tables |= {
            name: part_section for name, part_section in part_tables.items() if part_section.before == table
        } | {table: section}
    flywheel = tables["flywheel"]
    tables["flywheel"] = replace(flywheel, keys={**flywheel.keys, "place": _places_of_flywheel()})
    return tables | part_tables


def _places_of_flywheel() -> tuple[Any, Any]:
    """The key `place` of the flywheel."""
    parts = (part.name for part in parts_of_line())
    text = "shaft that it is on: of the motor, behind a part of the line, or of the machine"
    return Literal[(MOTOR, *parts, MACHINE)], Field(MOTOR, description=text)


def choosing_tables() -> list[str]:
    """The tables that leave the choice of the motor to a capability."""
    return [name for name, section in all_sections().items() if section.chooses_motor]


_KIND_OF_MOTOR = (
    'the kind of the motor stands in [system]: motor = "DcMotor", "InductionMotor", or a designation of the '
    "catalogue"
)


def sections_of(machine: MachineModel, motor: Motor) -> dict[str, FileSection]:
    """The tables of a study with this machine and this kind of motor."""
    declarations = {
        "machine": machine.Parameters,
        "ratios": Ratios,
        "feed": machine.Feed,
        "motor": motor.Parameters,
    }
    places = {"motor": dict.fromkeys(("type", "kind", "model", "name"), _KIND_OF_MOTOR)}
    if not machine.layers:
        places["feed"] = {f"{side}.{place}": NO_WIDTH for side in machine.sides for place in PLACES.values()}
    sections = {
        name: FileSection(declaration, places=places.get(name, {}))
        for name, declaration in declarations.items()
    }
    if machine.layers:
        sections["feed"] = replace(sections["feed"], completed=_of_material)
    return sections | all_sections()


def _of_material(feed: Any, reading: Any) -> Any:
    """The feed whose processing force is where its material is, on each side for which the file gives no place of
    the force."""
    sides = reading.machine.model.sides if reading.machine else ()
    loads = {
        side: getattr(feed, side) for side in sides if f"{side}.force_across" not in reading.given["feed"]
    }
    return replace(feed, **{side: replace(x, force_across=x.across) for side, x in loads.items()})
