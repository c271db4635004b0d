"""Pins that differ: a machine of this package has friction, diameter and damping of a pin alone if they are named."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import Any

from ..core.errors import InputError, near_name, shown
from ..core.quantities import Layout, declared_class, group
from ..groups.joints import Joint
from ..mechanism.models import InverseMachine, MachineModel
from .parts import PinLaw

SHARED = {name: f"pin.{name}" for name in ("friction", "diameter", "w_smooth")} | {"damping": "joint_damping"}
"""By name in the law of a pin, the parameter of all pins."""
PLAIN, ROLLING = "plain", "rolling"
"""Kinds of bearings in a pin."""
ROLLING_FRICTION = 0.0015
"""Usual coefficient of friction of a rolling bearing, on half of its mean diameter (makers' catalogues: 0.0010 to
0.0024)."""


def with_pins(machine: InverseMachine, names: frozenset[str]) -> InverseMachine:
    """The machine in which those pins differ from the others of which `names` has a parameter.

    Raises
    ------
    InputError
        for a pin that the machine does not have.
    """
    pins = sorted({name.split(".")[1] for name in names if name.startswith("pins.")})
    faults = [
        InputError(
            f"pins.{pin}: is no pin of this machine{near_name(pin, machine.pin_names)}; its pins are "
            f"{', '.join(machine.pin_names)}",
            f"pins.{pin}",
        )
        for pin in pins
        if pin not in machine.pin_names
    ]
    if faults:
        raise InputError.joined(faults)
    return _differing(machine, tuple(pin for pin in machine.pin_names if pin in pins)) if pins else machine


@functools.cache
def _differing(machine: InverseMachine, pins: tuple[str, ...]) -> InverseMachine:
    """The machine in which these pins differ from the others."""
    shared = Layout(machine.Parameters).by_name(machine.Parameters())
    law = PinLaw(**{name: shared[source] for name, source in SHARED.items()})
    declared = declared_class(
        "Pins", (), [(pin, PinLaw, group(PinLaw, f"pin {pin}", default=law)) for pin in pins]
    )
    field = ("pins", declared, group(declared, "pins that differ", default=declared()))
    return machine.altered(
        root=machine.root or machine,
        made=(_differing, (machine, pins)),
        Parameters=declared_class("DifferingParameters", (machine.Parameters,), [field]),
    )


def laws_of(p: Any, pin_names: Mapping[str, Joint]) -> dict[Joint, Any]:
    """The laws of the pins that differ, by joint, of a machine with the parameters `p`."""
    pins = getattr(p, "pins", None)
    return {} if pins is None else {pin_names[pin]: law for pin, law in vars(pins).items()}


def completed(machine: MachineModel, values: Mapping[str, Any]) -> dict[str, Any]:
    """The `values` of parameters of a machine by name. What they leave out of the law of a pin is as that of all
    pins."""
    layout = machine.parameter_layout
    start = layout.by_name(machine.Parameters())
    laws = [name for name in layout.names if machine.pin_names and name.startswith("pins.")]
    sources = {name: SHARED[name.rpartition(".")[2]] for name in laws}
    return {name: values.get(source, start[source]) for name, source in sources.items()} | dict(values)


def friction_of(kind: Any) -> dict[str, float]:
    """The usual friction of a kind of bearing, by its name in the law of a pin; empty for a plain one.

    Raises
    ------
    InputError
        for another kind, without its key.
    """
    if kind not in (PLAIN, ROLLING):
        raise InputError(f"is {shown(kind)}; must be {PLAIN} or {ROLLING}")
    return {"friction": ROLLING_FRICTION} if kind == ROLLING else {}
