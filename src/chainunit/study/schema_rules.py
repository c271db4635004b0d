"""The conditions of the JSON Schema of a study file: the keys that follow from its machine and its motor,
and the `rules` of keys that do not go together."""

from __future__ import annotations

from collections.abc import Iterator

from ..drives.catalogue import packaged_motors
from ..models import MACHINES, MOTORS
from .conditions import Condition, Schema, ends_with, given, is_one_of
from .event import TYPES
from .parts import FMU, LINKAGE
from .rules import all_rules, machine_is, motor_is
from .sections import all_sections

OF_PARTS = ("machine", "feed", "motor")
"""Tables whose keys follow from the machine and the motor that the file names."""


def rules() -> Iterator[Schema]:
    """The conditions of a whole file."""
    yield from (rule.schema() for rule in all_rules())
    machines = is_one_of("system.machine", *MACHINES) | ends_with("system.machine", FMU)
    yield from _needs(given("system.machine"), machines | ends_with("system.machine", LINKAGE))
    yield from _needs(given("machine.linkage"), ~given("system.machine"))
    yield from _needs(given("machine.linkage"), ends_with("machine.linkage", LINKAGE))
    for name in MACHINES:
        yield _where(machine_is(name), _of_machine(name))
    packaged = [motor.designation for motor in packaged_motors()]
    motors = motor_is(*MOTORS, *packaged) | ends_with("system.motor", FMU)
    yield from _needs(given("system.motor") & ~given("catalogue"), motors)
    for name in MOTORS:
        condition = motor_is(name) | ~given("system.motor") if name == "DcMotor" else motor_is(name)
        yield _where(condition, {"properties": {"motor": {"$ref": f"#/definitions/motor.{name}"}}})
    for table, section in all_sections().items():
        for key in section.required:
            yield from _needs(given(table), given(f"{table}.{key}"))
        if section.form.conditions is not None:
            yield _where(given(table), {"properties": {table: dict(section.form.conditions())}})


def _where(condition: Condition, then: Schema) -> Schema:
    return {"if": condition.schema(), "then": then}


def _needs(condition: Condition, needed: Condition) -> Iterator[Schema]:
    yield _where(condition, needed.schema())


def _of_machine(name: str) -> Schema:
    """The tables and events of a machine."""
    model = MACHINES[name]
    inputs = {v.name for v in model.input_layout.variables}
    inputs |= {v.name for motor in MOTORS.values() for v in motor.input_layout.variables}
    events = [
        kind
        for kind, event_type in TYPES.items()
        if {*event_type.inputs("left" if event_type.has_side else "")} <= inputs
    ]
    tables: Schema = {table: {"$ref": f"#/definitions/{table}.{name}"} for table in ("machine", "feed")}
    tables["event"] = {"items": {"properties": {"type": {"enum": events}}}}
    return {"properties": tables}
