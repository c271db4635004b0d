"""Configuration files: TOML, validated by pydantic models that are generated from the declarations.

A number is in the declared SI unit; a text may carry a unit ("150 mm", "30 rev/min", "20 degC") and is
converted. Every refusal is one line that names the field, its value and what is allowed.
"""

from __future__ import annotations

import dataclasses
import re
import tomllib
from collections.abc import Mapping
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, create_model

from .drives.dc_motor import DcMotor
from .errors import InputError
from .machines.api import ChainUnit, ratios
from .machines.chain_unit import ChamberForces, Inputs, SideLoads
from .model import Model
from .quantities import Layout, Value, Variable, complaint, declaration, group, quantity, variables


@declaration
class Feed:
    """The material on both organs in normal running."""

    left: SideLoads = group(SideLoads, "left organ", default=SideLoads())
    right: SideLoads = group(SideLoads, "right organ", default=SideLoads())


@declaration
class Ratios:
    """The papers' ratios, in place of lengths."""

    rho: Value = quantity("1", "r/l, crank to coupler", default=0.1, above=0.0, max=1.0)
    lam: Value = quantity("1", "h/l, rocker to coupler", default=2.0 / 3.0, above=0.0)
    mu: Value = quantity("1", "e/l1, rocker arm of the web hinge to wall", default=0.6, above=0.0, max=1.0)
    zeta: Value = quantity("1", "z/z_max, half width", default=0.5, above=0.0, max=1.0)
    l: Value = quantity("m", "coupler A-Bd", default=1.5, above=0.0)
    l1: Value = quantity("m", "wall A1-B", default=1.35, above=0.0)


@declaration
class Run:
    """How the machine is run."""

    crank_speed: Value = quantity("rad/s", "speed of the crank in normal running", default=3.0, above=0.0)
    ramp: Value = quantity("s", "time in which the speed reference rises from rest", default=1.5, above=0.0)
    settle_turns: Value = quantity(
        "1", "crank turns after the ramp, before running counts as steady", default=1.0, min=0.0
    )
    turns: Value = quantity("1", "crank turns of steady running that are evaluated", default=2.0, min=1.0)
    step: Value = quantity("s", "communication step of the co-simulation", default=0.002, min=1e-5, max=0.02)


@declaration
class Overload:
    """The one-sided overloads."""

    turns: Value = quantity("1", "crank turns that are followed after the event", default=2.0, min=1.0)
    crank_angle: Value = quantity(
        "rad", "crank angle at which the event begins; at 0 the rocker is at its fastest", default=0.0
    )
    shift: Value = quantity("s", "time in which material leaves or changes sides", default=0.3, above=0.0)
    jam_force: Value = quantity(
        "N", "processing force of a lump that jams the left organ", default=2000.0, min=0.0
    )
    jam_duration: Value = quantity("s", "time for which the lump holds", default=0.3, above=0.0)
    jam_rise: Value = quantity("s", "time in which the jam rises and falls", default=0.02, above=0.0)


@cache
def _unit_registry() -> Any:
    import pint

    registry: Any = pint.UnitRegistry(autoconvert_offset_to_baseunit=True)
    registry.define("@alias revolution = rev")
    return registry


def _pint_unit(unit: str) -> str:
    return re.sub(r"([A-Za-z])(\d)", r"\1**\2", unit.replace(".", "*")) if unit != "1" else "dimensionless"


def to_number(variable: Variable, given: Any) -> float:
    """The value of a config entry in the declared unit.

    Raises
    ------
    ValueError
        for what is no number, a unit of another kind, or a value out of bounds.
    """
    if isinstance(given, bool) or not isinstance(given, int | float | str):
        raise ValueError(
            f"{variable.name} = {given!r}: must be a number in {variable.unit} or a text with a unit"
        )
    if isinstance(given, str):
        import pint

        try:
            parsed = _unit_registry().Quantity(given)
            value = float(parsed.to(_pint_unit(variable.unit)).magnitude)
        except (pint.PintError, ValueError, TypeError, AttributeError, AssertionError) as error:
            raise ValueError(f'{variable.name} = "{given}": must be {_kind(variable)}') from error
    else:
        value = float(given)
    if not variable.quantity.admits(value):
        raise ValueError(complaint(variable, value))
    return value


def _kind(variable: Variable) -> str:
    if variable.unit == "1":
        return f"a pure number ({variable.description})"
    return f'a number in {variable.unit}, or a text such as "2 {variable.unit}" ({variable.description})'


def _schema(declared: type, title: str, prefix: str) -> type[BaseModel]:
    """The pydantic model of a declaration: the same fields, none required, none unknown."""
    scalars = {v.name: v for v in variables(declared, prefix)}
    fields: dict[str, Any] = {}
    for field in dataclasses.fields(declared):
        name = prefix + field.name
        if name in scalars:
            variable = scalars[name]
            check = BeforeValidator(lambda given, variable=variable: to_number(variable, given))
            fields[field.name] = (Annotated[float, check], Field(None, description=variable.description))
        else:
            inner = _schema(field.metadata["of"], f"{title}_{field.name}", name + ".")
            fields[field.name] = (inner, Field(default_factory=inner))
    return create_model(title, __config__=ConfigDict(extra="forbid"), **fields)


_SECTIONS = {
    "machine": ChamberForces.Parameters,
    "ratios": Ratios,
    "feed": Feed,
    "motor": DcMotor.Parameters,
    "run": Run,
    "overload": Overload,
}
_File = create_model(
    "Config",
    __config__=ConfigDict(extra="forbid"),
    title=(str, ""),
    **{
        name: (schema, Field(default_factory=schema))
        for name, schema in ((n, _schema(d, n, n + ".")) for n, d in _SECTIONS.items())
    },  # type: ignore[call-overload]
)


@dataclasses.dataclass(frozen=True)
class Config:
    """A study, checked: machine, motor, loads and runs. `motor_given` names the motor parameters that were set."""

    title: str
    machine: ChainUnit
    feed: Feed
    motor: Any
    motor_given: frozenset[str]
    run: Run
    overload: Overload
    source: str


def _given(section: BaseModel) -> dict[str, float]:
    """Names and values that were set in a section."""
    flat: dict[str, float] = {}
    for name in section.model_fields_set:
        value = getattr(section, name)
        if isinstance(value, BaseModel):
            flat.update({f"{name}.{inner}": v for inner, v in _given(value).items()})
        else:
            flat[name] = value
    return flat


def _first_line(error: ValidationError) -> str:
    first = error.errors()[0]
    where = ".".join(str(part) for part in first["loc"])
    if first["type"] == "extra_forbidden":
        section: Any = _File
        for part in first["loc"][:-1]:
            section = section.model_fields[part].annotation
        return f"{where}: unknown key; known here: {', '.join(section.model_fields)}"
    if first["type"] == "model_type":
        return f"{where} = {first['input']!r}: must be a table"
    if first["type"] == "value_error":
        return str(first["ctx"]["error"])
    return f"{where} = {first['input']!r}: {first['msg'].lower()}"


def load(file: Path | None = None) -> Config:
    """Read and check a study file; without one, the packaged example.

    Raises
    ------
    InputError
        in one line: the file, the field, its value and what is allowed.
    """
    source = str(file) if file else "packaged example"
    try:
        text = file.read_text("utf-8") if file else example()
        return parse(text, source)
    except OSError as error:
        raise InputError(f"{source}: cannot be read ({error.strerror or error})") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{source}: is not UTF-8 text") from error
    except InputError as error:
        raise InputError(f"{source}: {error}") from error


def example() -> str:
    """The packaged study file."""
    return (resources.files("chainunit") / "data" / "example.toml").read_text("utf-8")


def parse(text: str, source: str = "config") -> Config:
    """A study from TOML text.

    Raises
    ------
    InputError
        see `load`.
    """
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"no valid TOML: {error}") from error
    try:
        checked: Any = _File.model_validate(data)
    except ValidationError as error:
        raise InputError(_first_line(error)) from error
    machine_given = _given(checked.machine)
    if "ratios" in data:
        lengths = ratios(**_filled(Ratios, _given(checked.ratios)))
        twice = sorted(set(lengths) & set(machine_given))
        if twice:
            raise InputError(
                f"machine.{twice[0]}: given beside [ratios], which sets it; leave out one of the two"
            )
        machine_given |= lengths
    try:
        machine = ChainUnit(machine_given)
    except InputError as error:
        raise InputError(f"machine: {error}") from error
    motor_given = _given(checked.motor)
    return Config(
        title=checked.title,
        machine=machine,
        feed=_instance(Feed, _given(checked.feed)),
        motor=DcMotor.parameter_layout.from_names(motor_given),
        motor_given=frozenset(motor_given),
        run=_instance(Run, _given(checked.run)),
        overload=_instance(Overload, _given(checked.overload)),
        source=source,
    )


def _filled(declared: type, given: Mapping[str, float]) -> dict[str, Any]:
    return {v.name: given.get(v.name, v.quantity.start) for v in variables(declared)}


def _instance(declared: type, given: Mapping[str, float]) -> Any:
    return Layout(declared).from_names(dict(given))


def start_values(config: Config, model: type[Model]) -> dict[str, float]:
    """Start values of `model`'s parameters and inputs in this study, by name.

    Raises
    ------
    InputError
        where a study file says nothing of such a model.
    """
    layout = model.parameter_layout
    if model is ChamberForces:
        motor_speed = config.run.crank_speed * config.machine.p.ratio
        inputs = Inputs(w=motor_speed, left=config.feed.left, right=config.feed.right)
        at_start = dict(zip(model.input_layout.names, model.input_layout.values(inputs), strict=True))
        return dict(zip(layout.names, layout.values(config.machine.p), strict=True)) | at_start
    if model is DcMotor:
        return dict(zip(layout.names, layout.values(config.motor), strict=True))
    raise InputError(f"a study file gives no start values for {model.name}")
