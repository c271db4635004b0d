"""The rules of the combinations of keys of a study file, as conditions of its JSON Schema. `checks` and
`parts` have the same rules for the reader."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from ..drives.catalogue import catalogue
from ..drives.line_table import SHAFTS
from ..drives.motors import MOTORS
from ..drives.shafts import SECTIONS as PROFILES
from ..machines.api import ratios
from ..models import MACHINES
from ..reading import filled
from .event import TYPES
from .parts import Parts, parts_of
from .sections import Ratios

OF_PARTS = ("machine", "feed", "motor")
"""Tables whose keys follow from the machine and the motor that the file names."""
_FMU = {"type": "string", "pattern": r"\.[fF][mM][uU]$"}
_LINKAGE = {"type": "string", "pattern": r"\.[tT][oO][mM][lL]$"}

Rule = dict[str, Any]


def rules() -> Iterator[Rule]:
    """The conditions of a whole file."""
    yield _where(
        _given("system"),
        {"properties": {"system": {"minProperties": 1, "properties": {"machine": _machine_name()}}}},
    )
    for name in MACHINES:
        yield _where(_machine(name), _of_machine(name))
    yield _where(_given("machine.linkage"), _without("system.machine"))
    yield _where(_given("machine.linkage"), _equal("machine.linkage", _LINKAGE))
    yield from _of_motors()
    yield from _of_foreign_parts()
    yield from _of_sizing()
    yield from _of_driveline()
    yield _where(_given("chain"), _equal("organ", {"const": "chain"}))
    yield _where(_equal("sweep.method", {"const": "grid"}), _without("sweep.points"))
    some = {"type": "array", "minItems": 1}
    yield _where(_equal("organ", {"const": "chain"}), _not(_equal("sweep.quantities", some)))
    yield _where(_equal("system.motor", _FMU), _not(_equal("sweep.measures", some)))
    trips = {"type": "array", "contains": {"const": "coupling_trip_time"}}
    yield _where(_equal("sweep.measures", trips), _given("coupling"))
    set_by_ratios = ratios(**filled(Ratios, {}))
    yield _where(_given("ratios"), _without(*(f"machine.{name}" for name in set_by_ratios)))


def _where(condition: Rule, then: Rule) -> Rule:
    return {"if": condition, "then": then}


def _given(path: str) -> Rule:
    """Whether a file gives a key."""
    return _equal(path, {})


def _equal(path: str, value: Rule) -> Rule:
    """Whether a file gives a key with such a value."""
    name, _, inner = path.partition(".")
    below = _equal(inner, value) if inner else value
    return {"type": "object", "required": [name]} | ({"properties": {name: below}} if below else {})


def _without(*paths: str) -> Rule:
    return _not(_any(*map(_given, paths)))


def _not(rule: Rule) -> Rule:
    return {"not": rule}


def _any(*of: Rule) -> Rule:
    return of[0] if len(of) == 1 else {"anyOf": list(of)}


def _all(*of: Rule) -> Rule:
    return {"allOf": list(of)}


def _machine_name() -> Rule:
    return {"anyOf": [{"enum": list(MACHINES)}, _FMU, _LINKAGE]}


def _machine(name: str) -> Rule:
    """Whether the file has the machine `name`."""
    names = _equal("system.machine", {"const": name})
    return (
        names
        if name != _default().machine.name
        else _any(names, _without("system.machine", "machine.linkage"))
    )


def _default(machine: str = "") -> Parts:
    """Machine and motor of a file that names that machine and no motor."""
    return parts_of({"system": {"machine": machine}} if machine else {}, "")


def _of_machine(name: str) -> Rule:
    """The tables and events of a machine."""
    model = MACHINES[name]
    inputs = {v.name for v in model.input_layout.variables}
    inputs |= {v.name for motor in MOTORS.values() for v in motor.input_layout.variables}
    events = [kind for kind, of in TYPES.items() if {*of.inputs("left" if of.has_side else "")} <= inputs]
    tables: Rule = {table: {"$ref": f"#/definitions/{table}.{name}"} for table in ("machine", "feed")}
    tables["event"] = {"items": {"properties": {"type": {"enum": events}}}}
    rule: Rule = {"properties": tables}
    if not model.sides:
        rule |= _without("ratios", "chain", "organ", "observer", "sizing.one_sided_share")
    return rule


def _of_motors() -> Iterator[Rule]:
    """The table of the motor, and keys that only some motors have."""
    for name in MOTORS:
        own = _any(
            _equal("system.motor", {"const": name}),
            *([_without("system.motor")] if name == "DcMotor" else []),
        )
        yield _where(own, {"properties": {"motor": {"$ref": f"#/definitions/motor.{name}"}}})
    yield _where(_given("system.motor"), _without("sizing"))
    model = {"enum": list(MOTORS)}
    packaged = {"enum": [motor.designation for motor in catalogue()]}
    names = {"properties": {"motor": {"anyOf": [model, packaged, _FMU]}}}
    yield _where(_without("catalogue"), {"properties": {"system": names}})
    designation = _equal("system.motor", {"type": "string", "not": {"anyOf": [model, _FMU]}})
    yield _where(_any(designation, _equal("system.motor", _FMU)), _without("motor"))
    by_example = [name for name in MACHINES if _default(name).designation]
    of_catalogue = _any(
        designation,
        *(_all(_machine(name), _without("system.motor", "motor", "sizing")) for name in by_example),
    )
    yield _where(of_catalogue, _without("machine.ratio"))
    yield _where(
        _not(_any(of_catalogue, _given("sizing"))), _without("gear", "start", "starter", "catalogue")
    )
    deaf = [name for name, motor in MOTORS.items() if "tau_ff" not in motor.input_layout.names]
    yield _where(
        _any(of_catalogue, _equal("system.motor", {"enum": deaf})),
        _not(_equal("feed_forward", {"const": True})),
    )


def _of_foreign_parts() -> Iterator[Rule]:
    """Keys of foreign FMUs, and keys that need a model of the machine."""
    for part in ("machine", "motor"):
        yield _where(_given(f"system.{part}_names"), _equal(f"system.{part}", _FMU))
    needs_model = [
        _equal("feed_forward", {"const": True}),
        _equal("monte_carlo.runs", {"type": "number", "exclusiveMinimum": 0}),
        *map(_given, ("ratios", "chain", "organ", "sweep", "optimize", "identify", "watch", "observer")),
    ]
    yield _where(_equal("system.machine", _FMU), _not(_any(*needs_model)))
    yield _where(_equal("organ", {"const": "chain"}), _without("optimize", "identify", "watch"))
    yield _where(_equal("system.motor", _FMU), _without("identify", "watch", "observer"))
    for name in ("identify", "watch"):
        yield _where(_given(name), _without("driveline", "sizing"))
    yield _where(_given("observer"), _without("driveline"))
    yield _where(_given("watch"), {"properties": {"watch": {"required": ["file"]}}})
    needed = {"required": ["parameter", "run"]}
    yield _where(_given("identify"), {"properties": {"identify": needed}})


def _of_sizing() -> Iterator[Rule]:
    """Keys whose values [sizing] finds itself."""
    own = ("motor", "run.winding_temperature", "machine.ratio")
    others = [
        _equal("feed_forward", {"const": True}),
        _equal("flywheel", {"minProperties": 1}),
        _given("sweep"),
        *map(_given, own),
    ]
    yield _where(_given("sizing"), _not(_any(*others)))


def _of_driveline() -> Iterator[Rule]:
    yield _where(_given("torsion"), _given("driveline"))
    pairs = [*SHAFTS.items(), ("damping_ratio", "d2"), ("damping_ratio", "d3")]
    twice = [{"required": list(pair)} for pair in pairs]
    shafts = {shaft: {"required": ["section"], "allOf": list(_of_shaft())} for shaft in SHAFTS}
    yield _where(
        _given("driveline"), {"properties": {"driveline": {"not": {"anyOf": twice}, "properties": shafts}}}
    )


def _of_shaft() -> Iterator[Rule]:
    """The dimensions that go with a profile."""
    for name, profile in PROFILES.items():
        needed = [*profile.takes, "length"]
        known = [*needed, *profile.also, "section", "shear_modulus"]
        yield _where(
            _equal("section", {"const": name}), {"required": needed, "propertyNames": {"enum": known}}
        )
