"""A flywheel behind a gear, on the shaft of the machine, without states and loss."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from ..core.model import Model, Part
from ..core.ports import ShaftInput, line_terminals
from ..core.quantities import Value, declaration, quantity
from .gear import GearOutputs, GearParameters, geared


@declaration
class FlywheelParameters(GearParameters):
    """Parameters of the flywheel and of the gear before it."""

    J_wheel: Value = quantity("kg.m2", "inertia of the flywheel, at its own shaft", default=1.0, min=0.0)
    turns: Value = quantity(
        "1", "turns of the flywheel per turn of the machine", default=1.0, above=0.0, max=1e3
    )


@declaration
class FlywheelOutputs(GearOutputs):
    """The port at the motor, the shaft of the machine, and the energy of the flywheel."""

    kinetic_energy: Value = quantity("J", "kinetic energy of the flywheel", nominal=1000.0)


def _outputs(xp: Any, p: Any, u: Any, x: Any, s: None) -> FlywheelOutputs:
    """The outputs of the gear whose load has the inertia of the flywheel, too; the torque that this takes does not
    reach the machine."""
    J = p.J_wheel * (p.turns * p.turns)
    outputs = geared(p.ratio, replace(u.load, J=u.load.J + J), u)
    driven = outputs.driven
    return FlywheelOutputs(
        **vars(outputs) | {"driven": replace(driven, tau=driven.tau - J * driven.a)},
        kinetic_energy=0.5 * J * (driven.w * driven.w),
    )


Flywheel = Model(
    name="Flywheel",
    text="""A flywheel on the shaft of the machine, behind a rigid gear without mass and loss: its inertia adds to
    the load of the machine.""",
    description="Flywheel behind a gear, between motor and machine: takes a load port and shows one",
    Parameters=FlywheelParameters,
    Inputs=ShaftInput,
    terminals=line_terminals(),
    parts=(Part(FlywheelOutputs, _outputs),),
)
