"""Declares a parameter, input, state or output once: unit, description, bounds, start.

A model states its quantities as frozen dataclasses whose fields come from `quantity` (one
scalar) or `group` (a nested dataclass, whose fields have a prefix: ``crank.m``).
Everything else - modelDescription.xml, config validation, tables, netCDF attributes - is
generated from these declarations.

Units are written as in FMI: ``.`` multiplies, ``/`` divides, an integer after a name is its power:
``kg.m2``, ``N.m.s/rad``, ``1`` for a pure number. Several factors in the denominator stand in brackets:
``Hz/(N.m)``.
"""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Container, Iterator, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Any, Literal, TypeAlias, TypeVar, dataclass_transform

from . import bounds, messages
from .brief import briefly_shown
from .descriptions import Described
from .errors import UnknownNameError, near_name

T = TypeVar("T")

SI = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")

# exponents of the SI base units (FMI counts rad among them) of every unit name in use
_NAMED: dict[str, dict[str, int]] = {
    **{name: {name: 1} for name in SI},
    "1": {},
    "N": {"kg": 1, "m": 1, "s": -2},
    "J": {"kg": 1, "m": 2, "s": -2},
    "W": {"kg": 1, "m": 2, "s": -3},
    "V": {"kg": 1, "m": 2, "s": -3, "A": -1},
    "Ohm": {"kg": 1, "m": 2, "s": -3, "A": -2},
    "H": {"kg": 1, "m": 2, "s": -2, "A": -2},
    "Wb": {"kg": 1, "m": 2, "s": -2, "A": -1},
    "Hz": {"s": -1},
}

DISPLAY_UNITS: dict[str, tuple[str, float, float]] = {
    "rad": ("deg", 180.0 / math.pi, 0.0),
    "rad/s": ("rev/min", 30.0 / math.pi, 0.0),
    "K": ("degC", 1.0, -273.15),
}
"""unit -> (display unit, factor, offset); the displayed value is factor * value + offset."""

TYPES: dict[str, str] = {
    "1": "Ratio",
    "rad": "Angle",
    "rad/s": "AngularVelocity",
    "rad/s2": "AngularAcceleration",
    "s": "Time",
    "m": "Length",
    "m/s": "Velocity",
    "m/s2": "Acceleration",
    "kg": "Mass",
    "kg/m": "LinearDensity",
    "kg.m2": "MomentOfInertia",
    "kg.m2/rad": "MomentOfInertiaSlope",
    "N": "Force",
    "N.m": "Torque",
    "N.m/rad": "TorsionalStiffness",
    "N.m.s/rad": "TorsionalDamping",
    "N.m2.s/rad": "TorsionalDampingLength",
    "N.m/rad2": "TorsionalStiffnessSlope",
    "N.m/A": "TorqueConstant",
    "s/rad": "TorquePerPower",
    "J": "Energy",
    "J/kg": "SpecificEnergy",
    "W": "Power",
    "A": "Current",
    "V": "Voltage",
    "Ohm": "Resistance",
    "H": "Inductance",
    "K": "Temperature",
    "J/K": "HeatCapacity",
    "K/W": "ThermalResistance",
    "1/K": "TemperatureCoefficient",
    "A.s/rad": "SpeedControlGain",
    "A/rad": "SpeedControlIntegralGain",
    "Ohm/s": "CurrentControlIntegralGain",
    "Wb": "MagneticFluxLinkage",
    "1/Wb": "SaturationCoefficient",
    "Hz": "Frequency",
    "Hz/s": "FrequencyRate",
    "Hz/(N.m)": "SlipCompensation",
}
"""By unit, the name of the kind of quantity: the declared type of an FMU's variables."""


def base_units(unit: str) -> dict[str, int]:
    """Exponents of the SI base units in `unit`, e.g. ``N.m`` -> ``{kg: 1, m: 2, s: -2}``.

    Raises
    ------
    ValueError
        for an unknown unit name, or more than one stroke.
    """
    exponents = dict.fromkeys(SI, 0)
    for name, power in _powers(unit).items():
        for base, exponent in _NAMED[name].items():
            exponents[base] += exponent * power
    return {base: exponent for base, exponent in exponents.items() if exponent}


def _powers(unit: str) -> dict[str, int]:
    """The powers of the names in a unit, in their order; see `base_units` for errors."""
    parts, powers = unit.split("/"), dict[str, int]()
    if len(parts) > 2:
        raise ValueError(f"unit {unit!r}: must have one stroke at most, as in 'N/(m.s)'")
    for sign, part in zip((1, -1), parts, strict=False):
        for factor in (part[1:-1] if part[:1] + part[-1:] == "()" else part).split("."):
            match = re.fullmatch(r"([A-Za-z]+|1)(-?\d+)?", factor)
            if match is None or match[1] not in _NAMED:
                raise ValueError(f"unknown unit {factor!r} in {unit!r}")
            powers[match[1]] = powers.get(match[1], 0) + sign * int(match[2] or 1)
    return powers


def quotient(unit: str, by: str) -> str:
    """The unit of a derivative: ``N.m`` by ``kg.m2`` -> ``N/(kg.m)``, an energy by the time -> ``W``."""
    if (unit, by) == ("J", "s"):
        return "W"
    powers = _powers(unit)
    for name, power in _powers(by).items():
        powers[name] = powers.get(name, 0) - power
    powers.pop("1", None)
    above = [f"{name}{p if p > 1 else ''}" for name, p in powers.items() if p > 0]
    below = [f"{name}{-p if p < -1 else ''}" for name, p in powers.items() if p < 0]
    numerator, denominator = ".".join(above) or "1", ".".join(below)
    if len(below) > 1:
        denominator = f"({denominator})"
    return f"{numerator}/{denominator}" if below else numerator


MOST: dict[str, float] = {
    "1": 1e6,
    "m": 1e4,
    "m/s": 1e4,
    "m/s2": 1e4,
    "rad/s": 1e6,
    "kg": 1e6,
    "kg.m2": 1e9,
    "N": 1e8,
    "N.m": 1e9,
    "N.m/rad": 1e12,
    "N.m.s/rad": 1e10,
    "N.m/A": 1e6,
    "W": 1e10,
    "A": 1e6,
    "V": 1e6,
    "Ohm": 1e7,
    "H": 1e4,
    "K/W": 1e6,
    "J/K": 1e12,
    "1/K": 1.0,
    "1/Wb": 1e6,
    "Hz": 1e6,
    "Hz/s": 1e9,
    "Hz/(N.m)": 1e6,
    "s": 1e6,
    "A.s/rad": 1e12,
    "A/rad": 1e15,
    "Ohm/s": 1e12,
}
"""By unit, the upper bound of a quantity that declares only a lower bound. No machine reaches it, and up to
it the equations do not overflow."""

USUAL: dict[str, tuple[float, float]] = {
    "m": (1e-4, 30.0),
    "m/s2": (0.5, 30.0),
    "kg": (1e-3, 2e4),
    "N": (1e-3, 1e6),
    "rad": (0.0, 6.3),
}
"""By unit, the range of usual sizes of a quantity whose declaration gives none; 0 is always usual."""

ROUNDING = 1e-9
"""Tolerance of a bound, relative to the nominal size of the quantity: a value beyond the bound by less is the
bound."""


Type = Literal["Real", "Integer", "Boolean"]
"""The type of a scalar. The equations compute with numbers of the type float alone: a count is a whole number among
them, a switch is 0 (false) or 1 (true). An output that is a count or a switch changes only at events."""


def written(x: float, type: Type) -> str:
    """The exact number `x` as a file has it: ``2.0``, of a count ``2``, of a switch ``true``."""
    if type == "Boolean":
        return "true" if x else "false"
    return repr(float(x)) if type == "Real" else str(round(x))


@dataclass(frozen=True, slots=True)
class Quantity(Described):
    """One scalar: its unit, the `template` of its description, its bounds (with `open_low` the bound `low`
    itself is not allowed), its start value (None for outputs), its `nominal` size, whether it may change in a
    run (`tunable`), the range of its `usual` sizes (a value outside it is probably a slip of the unit, and is not
    refused), its `kind`, which says how it is shown (see `chainunit.reading.text`), and its `type`."""

    unit: str
    template: str
    start: float | None = None
    low: float = -math.inf
    high: float = math.inf
    open_low: bool = False
    nominal: float | None = None
    tunable: bool = False
    usual: tuple[float, float] | None = None
    kind: str = ""
    type: Type = "Real"

    def is_usual(self, x: float) -> bool:
        """Whether the value `x` is usual for a machine of this kind."""
        low, high = self.usual or (0.0, math.inf)
        return x == 0.0 or low <= abs(x) <= high

    @property
    def allowed_range(self) -> str:
        """The allowed range in words, e.g. ``> 0 m``."""
        if self.type == "Boolean":
            return "true or false"
        unit = messages.unit_behind(self.unit)
        low = f"{'>' if self.open_low else '>='} {self.low:g}{unit}" if math.isfinite(self.low) else ""
        high = f"<= {self.high:g}{unit}" if math.isfinite(self.high) else ""
        limits = " and ".join(x for x in (low, high) if x)
        return f"a whole number {limits}".rstrip() if self.type == "Integer" else limits or "any number"

    @property
    def slack(self) -> float:
        """The distance beyond a bound up to which a value counts as the bound: the rounding of its nominal
        size."""
        return ROUNDING * (self.nominal or 1.0)

    def admits(self, x: Any) -> Any:
        """Whether the number `x`, or each of an array, is finite and inside the bounds, or beyond one by rounding
        only; of a count or a switch, whether it is a whole number, too."""
        return bounds.admits(x, self.low, self.high, self.slack, self.open_low, self.type != "Real")

    def within_bounds(self, x: float) -> float:
        """The admitted number `x`; the bound in place of a number that is beyond it by rounding."""
        return bounds.within(x, self.low, self.high)


Value: TypeAlias = Any
"""The number of a declared scalar: a float, an array, a symbol or a dual number."""


def quantity(
    unit: str,
    description: str,
    *,
    default: float | None = None,
    min: float = -math.inf,
    max: float = math.inf,
    above: float | None = None,
    nominal: float | None = None,
    tunable: bool = False,
    usual: tuple[float, float] | None = None,
    kind: str = "",
    type: Type = "Real",
) -> Any:
    """A field that declares one scalar. A `description` may have slots, see `Described`. `default` is its start value
    (outputs have none); `above` is a lower bound that is not allowed itself. Without `max`, a quantity with a lower
    bound has the upper bound of `MOST`; without `usual`, its usual sizes are those of `USUAL`. `kind` says how it is
    shown (see `chainunit.reading.text`). A `type` "Boolean" has the bounds 0 and 1."""
    base_units(unit)
    if type == "Boolean":
        min, max = 0.0, 1.0
    low = min if above is None else above
    high = MOST.get(unit, math.inf) if math.isinf(max) and math.isfinite(low) else max
    default = None if default is None else float(default)
    q = Quantity(
        unit,
        description,
        default,
        float(low),
        float(high),
        above is not None,
        nominal,
        tunable,
        usual or USUAL.get(unit),
        kind,
        type,
    )
    metadata = {"quantity": q}
    if default is None:
        return dataclasses.field(metadata=metadata)
    return dataclasses.field(default=default, metadata=metadata)


def percentage(description: str, **limits: Any) -> Any:
    """A field that declares a share, shown in per cent, as `quantity` does."""
    return quantity("1", description, kind="percent", **limits)


def whole_number(description: str, **limits: Any) -> Any:
    """A field that declares a whole number, as `quantity` does."""
    return quantity("1", description, type="Integer", **limits)


def plain_variable(name: str, unit: str, description: str, **bounds: Any) -> Variable:
    """The variable of a number that no declaration has; `bounds` are further fields of `Quantity`."""
    return Variable(name, description, Quantity(unit, description, **bounds))


def group(declared: type, description: str, *, default: Any = None) -> Any:
    """A field that holds the quantities of the declaration `declared`, under this field's name.

    `default` is an instance of `declared` with the start values (outputs have none).
    """
    metadata = {"group": description, "of": declared, "default": default}
    if default is None:
        return dataclasses.field(metadata=metadata)
    return dataclasses.field(default=default, metadata=metadata)


@dataclass_transform(
    frozen_default=True, kw_only_default=True, field_specifiers=(quantity, percentage, whole_number, group)
)
def declaration(cls: type[T]) -> type[T]:
    """Make `cls` a declaration: a frozen dataclass with keyword-only fields."""
    # no slots: declarations may inherit from several others
    return briefly_shown(dataclass(frozen=True, kw_only=True)(cls))


Fields = Sequence[tuple[str, Any, Any]]
"""Name, type and field of each quantity or group, to build a declaration from."""


def declared_class(name: str, bases: tuple[type, ...], fields: Fields = ()) -> Any:
    """A declaration with these fields and the fields of `bases`."""
    return briefly_shown(dataclasses.make_dataclass(name, fields, bases=bases, frozen=True, kw_only=True))


def fields_of(declared: type, *, without: Sequence[str] = ()) -> Fields:
    """The fields of a declaration except those in `without`, to build another one from."""
    return [_copied(f) for f in dataclasses.fields(declared) if f.name not in without]


def _copied(f: dataclasses.Field[Any]) -> tuple[str, Any, Any]:
    """A field for another declaration: a dataclass changes the fields that it is made of."""
    return f.name, f.type, dataclasses.field(default=f.default, metadata=f.metadata)


def pruned(declared: type, leave_out: Container[str], prefix: str = "") -> type | None:
    """The declaration without the quantities whose full names, after `prefix`, are in `leave_out`: `declared` itself
    if it has none of them, None if it has no others."""
    left = [prefix + v.name not in leave_out for v in variables(declared)]
    if all(left) or not any(left):
        return declared if any(left) else None
    fields = []
    for f in dataclasses.fields(declared):
        name = prefix + f.name
        if "quantity" in f.metadata:
            if name not in leave_out:
                fields.append(_copied(f))
        elif (inner := pruned(f.metadata["of"], leave_out, f"{name}.")) is not None:
            default = f.metadata["default"]
            default = None if default is None else narrowed(default, inner)
            fields.append((f.name, inner, group(inner, f.metadata["group"], default=default)))
    return declared_class(declared.__name__, (), fields)


def narrowed(instance: Any, to: type) -> Any:
    """The instance of the declaration `to` with the values of an `instance` that has more."""
    layout = Layout(to)
    return layout.instance([attrgetter(name)(instance) for name in layout.names])


@dataclass(frozen=True, slots=True)
class Variable(Described):
    """A declared scalar with the full name and the `template` of the description that it has in its model."""

    name: str
    template: str
    quantity: Quantity

    @property
    def unit(self) -> str:
        """The unit, as in the declaration."""
        return self.quantity.unit

    @property
    def kind(self) -> str:
        """The kind by which it is shown, as in the declaration."""
        return self.quantity.kind

    @property
    def type(self) -> Type:
        """The type, as in the declaration."""
        return self.quantity.type


def variables(cls: type, prefix: str = "", context: str = "", default: Any = None) -> Iterator[Variable]:
    """Every scalar of the declaration `cls`, in declared order.

    `prefix` and `context` go before names and descriptions; `default` is an instance of `cls` whose
    values replace the declared start values.
    """
    for field in dataclasses.fields(cls):
        name = prefix + field.name
        if "quantity" in field.metadata:
            q = field.metadata["quantity"]
            if default is not None:
                q = dataclasses.replace(q, start=getattr(default, field.name))
            yield Variable(name, context + q.template, q)
        else:
            inner = field.metadata["default"] if default is None else getattr(default, field.name)
            heading = f"{context}{field.metadata['group']}: "
            yield from variables(field.metadata["of"], name + ".", heading, inner)


def variable_of(cls: type, name: str) -> Variable:
    """The scalar of the declaration `cls` with this name.

    Raises
    ------
    KeyError
        for a name that is not declared.
    """
    return {v.name: v for v in variables(cls)}[name]


def named_values(instance: Any, prefix: str = "") -> Iterator[tuple[Variable, float]]:
    """Every scalar of an instance of a declaration, with `prefix` before its name, and its value."""
    layout = Layout(type(instance))
    for v, value in zip(layout.variables, layout.values(instance), strict=True):
        yield dataclasses.replace(v, name=prefix + v.name), float(value)


def finite(value: Any) -> float | None:
    """A number as JSON can hold it: None in place of None or a number that is not finite."""
    return None if value is None or not math.isfinite(value) else float(value)


class Layout:
    """Converts between an instance of a declaration and the flat list of its values."""

    def __init__(self, cls: type) -> None:
        self.cls = cls
        self.variables = tuple(variables(cls))
        self.names = tuple(v.name for v in self.variables)
        self._getter: Any = attrgetter(*self.names) if self.names else lambda instance: ()
        self._plan = _plan(cls, 0)[0]

    def values(self, instance: Any) -> list[Any]:
        """The values of `instance`, in declared order."""
        if len(self.names) == 1:
            return [self._getter(instance)]
        return list(self._getter(instance))

    def by_name(self, instance: Any) -> dict[str, Any]:
        """The values of `instance` by name."""
        return dict(zip(self.names, self.values(instance), strict=True))

    def instance(self, values: Any) -> Any:
        """The instance that holds `values`, given in declared order."""
        return _build(self._plan, values)

    def from_names(self, values: dict[str, Any], default: Any = None) -> Any:
        """The instance with these `values` by name; the other values come from `default`, or are the start values.

        Raises
        ------
        UnknownNameError
            for a name that is not declared.
        """
        unknown = set(values) - set(self.names)
        if unknown:
            name = min(unknown, key=str)
            near = near_name(str(name), self.names)
            raise UnknownNameError(f"no variable {name!r} in {self.cls.__qualname__}{near}")
        if default is not None:
            base = self.values(default)
        else:
            base = [v.quantity.start for v in self.variables]
        return self.instance([values.get(n, b) for n, b in zip(self.names, base, strict=True)])


def _plan(cls: type, i: int) -> tuple[tuple[type, list[tuple[str, Any]]], int]:
    """The class of a declaration, and for each field the place of its value, from `i` on, or the plan of its group;
    and the place after the last one."""
    steps: list[tuple[str, Any]] = []
    for field in dataclasses.fields(cls):
        if "quantity" in field.metadata:
            steps.append((field.name, i))
            i += 1
        else:
            inner, i = _plan(field.metadata["of"], i)
            steps.append((field.name, inner))
    return (cls, steps), i


def _build(plan: tuple[type, list[tuple[str, Any]]], values: Any) -> Any:
    """The instance of a `_plan` with these values."""
    cls, steps = plan
    return cls(
        **{name: values[step] if isinstance(step, int) else _build(step, values) for name, step in steps}
    )


def violations(layout: Layout, instance: Any) -> Iterator[str]:
    """One line for each value of `instance` outside its bounds: name, value, allowed range."""
    for variable, x in zip(layout.variables, layout.values(instance), strict=True):
        if not variable.quantity.admits(x):
            yield complaint(variable, x)


def within_bounds(layout: Layout, instance: Any) -> Any:
    """The admitted `instance`, with each value that is beyond a bound by rounding set to that bound."""
    values = layout.values(instance)
    inside = [v.quantity.within_bounds(x) for v, x in zip(layout.variables, values, strict=True)]
    return instance if inside == values else layout.instance(inside)


def complaint(variable: Variable, x: Any) -> str:
    """The line that says what is wrong with the value `x` of `variable`."""
    q = variable.quantity
    bounded = math.isfinite(q.low) or math.isfinite(q.high)
    return bounds.complaint(variable.name, x, q.unit, q.allowed_range, bounded, variable.description)
