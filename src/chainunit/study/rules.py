"""The rules of the keys of a study file that do not go together. Each stands once: the reader evaluates it, and the
JSON Schema prints it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache, reduce
from operator import or_
from typing import Any

from ..core.errors import InputError, shown
from ..machines.paper_ratios import Ratios, lengths
from ..models import MACHINES, MOTORS
from ..reading.tables import filled
from .conditions import (
    NEVER,
    Condition,
    Schema,
    ends_with,
    given,
    has_entries,
    is_empty_table,
    is_one_of,
)
from .foreign_machine import ForeignModel
from .line.flywheel import MACHINE, MOTOR
from .parts import FMU, Parts, parts_of
from .registry import parts_of_line, registered
from .sections import choosing_tables


@dataclass(frozen=True)
class Rule:
    """A key that is refused on a condition."""

    key: str
    on: Condition
    words: str
    """the reason and the remedy; with {machine}, {motor} and the motor's {type} in place of their names"""
    refused: Condition | None = None
    """values of the key that are refused; None for any"""

    @property
    def whole(self) -> Condition:
        """The condition of a file that breaks the rule."""
        return self.on & (self.refused or given(self.key))

    def schema(self) -> Schema:
        """The JSON Schema that the files meet which keep the rule."""
        return {"not": self.whole.schema()}


def refusals(data: Mapping[str, Any], parts: Parts) -> list[InputError]:
    """A refusal for each rule that a file breaks, whose machine and motor are `parts`."""
    names = {
        "machine": "an FMU" if isinstance(parts.machine, ForeignModel) else parts.machine.name,
        "name": "machine" if isinstance(parts.machine, ForeignModel) else parts.machine.name,
        "motor": shown(parts.named_motor),
        "type": "" if parts.file else parts.motor.name,
    }
    broken = (rule for rule in all_rules() if rule.whole.holds(data))
    return [InputError(f"{rule.key}: {rule.words.format(**names)}", key=rule.key) for rule in broken]


def machine_is(name: str) -> Condition:
    """Whether the file has this packaged machine, by its name or as it names none."""
    is_named = is_one_of("system.machine", name)
    if name != _default().machine.name:
        return is_named
    names_another = given("system.machine") | given("machine.linkage")
    return is_named | ~names_another


def motor_is(*names: str) -> Condition:
    """Whether the file names one of these models of motors."""
    return is_one_of("system.motor", *names)


def _default(machine: str = "") -> Parts:
    """Machine and motor of a file that names that machine and no motor."""
    return parts_of({"system": {"machine": machine}} if machine else {}, "")


def _any(conditions: list[Condition]) -> Condition:
    return reduce(or_, conditions or [NEVER])


MACHINE_FMU, MOTOR_FMU = ends_with("system.machine", FMU), ends_with("system.motor", FMU)


@cache
def has_sides() -> Condition:
    """Whether the machine has two sides with organs."""
    return _any([machine_is(name) for name, model in MACHINES.items() if model.sides])


def names_designation() -> Condition:
    """Whether the file names a motor by its designation in a catalogue."""
    return given("system.motor") & ~(motor_is(*MOTORS) | MOTOR_FMU)


def motor_of_catalogue() -> Condition:
    """Whether the motor is one of a catalogue, by its designation or that of the machine's example."""
    by_example = _any([machine_is(name) for name in MACHINES if _default(name).designation])
    return names_designation() | (by_example & ~(given("system.motor") | given("motor") | motor_is_chosen()))


def motor_is_chosen() -> Condition:
    """Whether the file leaves the choice of the motor to a capability."""
    return _any([given(table) for table in choosing_tables()])


def all_rules() -> tuple[Rule, ...]:
    """The rules, in the order in which their refusals come."""
    return _with_motors(tuple(MOTORS))


@cache
def _with_motors(names: tuple[str, ...]) -> tuple[Rule, ...]:
    """The rules for the registered motors of these names."""
    of_registered = (rule for part in registered() for rule in part.rules())
    return (*_of_parts(), *_of_flywheel(), *_of_sides(), *_of_motors(), *of_registered)


BESIDE_MOTOR = "given beside system.motor = {motor}, which is the motor; leave out one of the two"
NEEDS_MODEL = "needs a model of the machine, which is an FMU; leave it out"
OF_CHAIN_UNIT = "is of the chain unit, and the machine is {machine}; leave it out"


def _of_parts() -> Iterator[Rule]:
    """Rules of the table [system], and of keys that need models of its parts."""
    yield Rule(
        "system",
        given("system"),
        'names nothing; add motor = "file.fmu", or leave [system] out',
        is_empty_table("system"),
    )
    for part, foreign in (("motor", MOTOR_FMU), ("machine", MACHINE_FMU)):
        refusal = f'are of an FMU of somebody else; add {part} = "file.fmu", or leave them out'
        yield Rule(f"system.{part}_names", ~foreign, refusal)
    yield Rule("system.motor_parameters", ~MOTOR_FMU, "are of a motor that is an FMU; write them in [motor]")
    yield Rule("feed_forward", MACHINE_FMU, NEEDS_MODEL, is_one_of("feed_forward", True))


FLYWHEEL_BEHIND = given("flywheel.place") & ~is_one_of("flywheel.place", MOTOR)
"""Whether the flywheel is not on the motor's shaft."""


def _of_flywheel() -> Iterator[Rule]:
    """Rules of the shaft of the flywheel."""
    refusal = 'is of a shaft geared to the machine; add flywheel.place = "machine", or leave it out'
    yield Rule("flywheel.turns", ~is_one_of("flywheel.place", MACHINE), refusal)
    refusal = f'counts the machine without a flywheel; set flywheel.place = "{MOTOR}", or leave it out'
    yield Rule("feed_forward", FLYWHEEL_BEHIND, refusal, is_one_of("feed_forward", True))
    names = [part.name for part in parts_of_line()]
    for name in names:
        refusal = f"names a part of the line that is not there; add [{name}], or give {MOTOR} or {MACHINE}"
        yield Rule("flywheel.place", ~given(name), refusal, is_one_of("flywheel.place", name))
    refusal = f"sizing tries flywheels of the {MOTOR} or of the {MACHINE}; give one of the two"
    yield Rule("flywheel.place", motor_is_chosen(), refusal, is_one_of("flywheel.place", *names))


def _of_sides() -> Iterator[Rule]:
    """Rules of keys of the chain unit, which has two sides."""
    yield Rule("ratios", ~has_sides(), OF_CHAIN_UNIT)
    yield Rule("organ", ~has_sides(), OF_CHAIN_UNIT)
    for name in lengths(**filled(Ratios, {})):
        refusal = "given beside [ratios], which sets it; leave out one of the two"
        yield Rule(f"machine.{name}", has_sides() & has_entries("ratios"), refusal)


def _of_motors() -> Iterator[Rule]:
    """Rules of the motor and of the tables that choose one."""
    yield Rule("motor", names_designation() | MOTOR_FMU, BESIDE_MOTOR)
    deaf = motor_is(*(name for name, motor in MOTORS.items() if "tau_ff" not in motor.input_layout.names))
    refusal = "a motor of the type {type} has no input for the torque; leave it out"
    chosen, switched_on = motor_is_chosen(), is_one_of("feed_forward", True)
    for key in ("J", "fluctuation", "compare"):
        yield Rule(f"flywheel.{key}", chosen, "sizing finds its own; leave out one of the two")
    yield Rule("feed_forward", ~chosen & (motor_of_catalogue() | deaf), refusal, switched_on)
    refusal = 'is of an inverter; set start = "inverter" before all tables, or leave it out'
    yield Rule("starter.droop", ~is_one_of("start", "inverter"), refusal)
    refusal = "works against the droop (starter.droop); leave out one of the two"
    yield Rule("starter.inverter.slip", given("starter.droop"), refusal)
    keys = " or ".join([*(f"[{table}]" for table in choosing_tables()), "system.motor"])
    for name in ("gear", "start", "starter", "catalogue"):
        refusal = f"is of a motor of the catalogue; add {keys}, or leave it out"
        yield Rule(name, ~(chosen | motor_of_catalogue()), refusal)
    refusal = "follows from the motor's rated speed; to have another, give gear.ratio"
    yield Rule("machine.ratio", ~chosen & motor_of_catalogue(), refusal)
