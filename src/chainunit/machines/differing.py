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
        for a pin that the machine does not have, and a name that the law of a pin does not have.
    """
    named = sorted(name.split(".") for name in names if name.startswith("pins."))
    pins = [*dict.fromkeys(pin for _, pin, *_ in named)]
    laws = f"a pin has {', '.join(SHARED)}, and in a file kind; a rolling one has friction = {ROLLING_FRICTION:g}"
    faults = [
        InputError(
            f"pins.{pin}.{key}: unknown key{near_name(key, SHARED) or ';'} {laws}", f"pins.{pin}.{key}"
        )
        for _, pin, key, *_ in (entry for entry in named if len(entry) > 2)
        if key not in SHARED
    ]
    faults += [
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


def laws_of(pins: Any, pin_names: Mapping[str, Joint]) -> dict[Joint, Any]:
    """The laws of the `pins` that differ, by joint, from their parameters; empty for None."""
    return {} if pins is None else {pin_names[pin]: law for pin, law in vars(pins).items()}


def shared_by_law(machine: MachineModel) -> dict[str, str]:
    """By parameter of a pin that differs, the parameter of all pins that stands for it if it is left out."""
    laws = [name for name in machine.parameter_layout.names if name.startswith("pins.")]
    return {name: SHARED[name.rpartition(".")[2]] for name in laws if machine.pin_names}


def friction_of(entry: Mapping[str, Any]) -> dict[str, float]:
    """The usual friction of the kind of bearing that the table of a pin names, by its name in the law of a pin; empty
    for a plain one.

    Raises
    ------
    InputError
        for another kind, and a rolling one beside a friction, without the key of the kind.
    """
    kind = entry.get("kind", PLAIN)
    if kind not in (PLAIN, ROLLING):
        raise InputError(f"is {shown(kind)}; must be {PLAIN} or {ROLLING}")
    if kind == ROLLING and "friction" in entry:
        raise InputError(f"is {ROLLING}, with the friction {ROLLING_FRICTION:g}; take kind or friction out")
    return {"friction": ROLLING_FRICTION} if kind == ROLLING else {}
