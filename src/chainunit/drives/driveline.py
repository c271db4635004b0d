"""A cardan driveline between motor and machine: the shaft line of paper 002 with the driven inertia, a model with
states.

It takes the load port of the machine and gives one to the motor. Symbols are those of `chainunit.drives.cardan`: 1 is
the motor's end of shaft 2, 4 the driven end of shaft 3. `phi w a tau` and the port belong to the motor's shaft;
`ratio` is a gear between it and shaft 2. `driven.*` is the shaft of the machine, whose angle is 0 where the untwisted
line has phi = 0.

The port has no inertia: tau depends only on angle and speed. The slope by the speed is the plain derivative. The
slope by the angle is taken along the motion: while the motor turns by w dt, the driven side turns, too, so that

    tau_bias_dphi = d tau/d phi + (rate of tau with the motor held) w^3/(w^4 + W_SMALL^4)

This is the plain derivative where the driven side is at rest, and (d tau/dt)/w where both sides turn. With the plain
derivative a driver would feel the full stiffness of the shaft even though its other end moves at the same speed.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from types import MappingProxyType
from typing import Any

from ..core.engines import Dual, dual, slope
from ..core.model import FmuData, Model, Part, Requirement
from ..core.ports import (
    LoadState,
    PortSlopes,
    PortValues,
    ShaftInput,
    Start,
    line_terminals,
    shaft_motion,
)
from ..core.quantities import Value, declaration, group, quantity
from .cardan import BENDS, RIGHT, ShaftLine, Twist, two_joints

W_SMALL = 0.1
"""Speed of the motor [rad/s] below which the slope by the angle tends to the plain derivative. There the coupling is
of first order in the step. A smaller speed would make this range shorter, but the slope along the motion, a quotient
of two small numbers, larger without bounds where a vibrating motor turns back."""


@declaration
class Mounted(ShaftLine):
    """A shaft line with the inertia on its driven side and the angle at which it is mounted."""

    J4: Value = quantity("kg.m2", "inertia on shaft 3, in addition to the machine's", default=0.5, above=0.0)
    gamma1: Value = quantity(
        "rad",
        "angle of the yoke of shaft 2 from the plane of its joint, without twist and with the motor at 0",
        default=0.0,
    )


@declaration
class Parameters(Start, Mounted):
    """Parameters of the driveline, which starts untwisted. The start values are assumptions of this package: the
    paper prints no dimensions."""

    ratio: Value = quantity(
        "1", "gear ratio, motor turns per turn of shaft 2", default=1.0, above=0.0, max=1e6
    )


@declaration
class DrivenState:
    """State of the driven shaft."""

    phi: Value = quantity("rad", "angle")
    w: Value = quantity("rad/s", "speed", nominal=10.0)


@declaration
class States(LoadState):
    """States of the driveline; each is an output, too."""

    driven: DrivenState = group(DrivenState, "driven shaft")


@declaration
class Driven:
    """Quantities that follow from the states, at the driven shaft."""

    a: Value = quantity("rad/s2", "acceleration", nominal=100.0)
    tau: Value = quantity("N.m", "torque given to the load")


@declaration
class Joint:
    """The two joints in series."""

    phi2: Value = quantity("rad", "angle of the yoke on shaft 2")
    phi3: Value = quantity("rad", "angle of the yoke on shaft 3")
    i23: Value = quantity("1", "ratio d phi3/d phi2")


@declaration
class Outputs(PortValues):
    """The port, the torques in the shafts and the energies."""

    tau: Value = quantity("N.m", "torque that the motor has to give", nominal=100.0)
    tau2: Value = quantity("N.m", "torque in shaft 2", nominal=100.0)
    tau3: Value = quantity("N.m", "torque in shaft 3", nominal=100.0)
    twist2: Value = quantity("rad", "twist of shaft 2", nominal=0.01)
    twist3: Value = quantity("rad", "twist of shaft 3", nominal=0.01)
    joint: Joint = group(Joint, "cardan")
    driven: Driven = group(Driven, "driven shaft")
    power: Value = quantity("W", "power that the motor gives", nominal=100.0)
    kinetic_energy: Value = quantity("J", "kinetic energy of the inertia on shaft 3", nominal=100.0)
    potential_energy: Value = quantity("J", "energy of both twists")
    dissipated_power: Value = quantity("W", "power that damping takes")


def _assembled(xp: Any, p: Any) -> Any:
    """Angle phi3 of the untwisted line at phi = 0, where the driven shaft has its angle 0."""
    return two_joints(xp, p, p.gamma1)[0]


class _Point:
    """The line between a motor at `phi, w` and the states."""

    __slots__ = ("a4", "ends", "tau4", "twist")

    def __init__(self, xp: Any, p: Any, u: Any, x: Any) -> None:
        self.ends = (p.gamma1 + u.phi / p.ratio, u.w / p.ratio, _assembled(xp, p) + x.driven.phi, x.driven.w)
        self.twist = Twist(xp, p, *self.ends)
        self.a4, self.tau4 = shaft_motion(u.load, x.driven.phi, x.driven.w, p.J4, self.twist.tau4)


def _outputs(xp: Any, p: Any, u: Any, x: Any, s: _Point) -> Outputs:
    """The outputs at both ends: the load port of the motor, twists and torques of the shafts, and the driven end."""
    line, tau = s.twist, s.twist.tau1 / p.ratio
    return Outputs(
        tau_bias=tau,
        J=0.0 * tau,
        dJ_dphi=0.0 * tau,
        phi0=u.phi,
        w0=u.w,
        tau=tau,
        tau2=line.tau1,
        tau3=line.tau4,
        twist2=line.twist2,
        twist3=line.twist3,
        joint=Joint(phi2=line.phi2, phi3=line.phi3, i23=line.i),
        driven=Driven(a=s.a4, tau=s.tau4),
        power=tau * u.w,
        kinetic_energy=0.5 * p.J4 * x.driven.w * x.driven.w,
        potential_energy=line.energy,
        dissipated_power=line.dissipated,
    )


def _slopes(xp: Any, p: Any, u: Any, x: Any, s: _Point) -> PortSlopes:
    """The slopes of the load port, along the motion of both ends; near rest, at `W_SMALL`, the part of the driven end
    goes to 0."""
    phi1, w1, phi4, w4 = s.ends
    engine = dual(xp)

    def tau1(phi1: Any, w1: Any, phi4: Any, w4: Any) -> Any:
        # from the known balance, one more Newton step in dual numbers gives the exact derivative
        return slope(Twist(engine, p, phi1, w1, phi4, w4, near=s.twist.phi2, steps=1).tau1)

    by_phi = tau1(Dual(phi1, 1.0), w1, phi4, w4)
    by_w = tau1(phi1, Dual(w1, 1.0), phi4, w4)
    driven = tau1(phi1, w1, Dual(phi4, w4), Dual(w4, s.a4))
    w2, small2 = w1 * w1, (W_SMALL / p.ratio) * (W_SMALL / p.ratio)
    along = by_phi + driven * w1 * w2 / (w2 * w2 + small2 * small2)
    per_motor_turn = 1.0 / (p.ratio * p.ratio)
    return PortSlopes(tau_bias_dphi=along * per_motor_turn, tau_bias_dw=by_w * per_motor_turn)


def _limits(xp: Any, p: Any) -> Iterator[tuple[Any, Any, Any]]:
    """The limits of both bends: a right angle."""
    for name in BENDS:
        yield getattr(p, name), -math.inf, RIGHT


def _internal_step(xp: Any, p: Any) -> Any:
    """Longest internal step: a tenth of the time in which the driven inertia swings on shaft 3 by one radian,
    half of the time in which its speed decays at any i23, and at most 0.25 ms."""
    slowest = xp.minimum(2.5e-4, 0.1 * xp.sqrt(p.J4 / p.c3))
    # the share (d phi2/d phi4)^2 = (i c3/(c2 + i^2 c3))^2 of d2 acts, at most c3/(4 c2)
    damping = p.d3 + p.d2 * xp.maximum(1.0, p.c3 / (4.0 * p.c2))
    return 1.0 / (1.0 / slowest + 2.0 * damping / p.J4)


def _initial_states(xp: Any, p: Any) -> Any:
    """The states without twist, with both ends in the same motion."""
    angle, i, _ = two_joints(xp, p, p.gamma1 + p.phi_start / p.ratio)
    return States(
        driven=DrivenState(phi=angle - _assembled(xp, p), w=i * p.w_start / p.ratio), load_energy=0.0
    )


def _rates(xp: Any, p: Any, u: Any, x: Any) -> list[Any]:
    """Time derivatives of the states, in declared order."""
    s = _Point(xp, p, u, x)
    return [s.tau4 * x.driven.w, x.driven.w, s.a4]


CardanDriveline = Model(
    name="CardanDriveline",
    text="""\
    A cardan shaft with two Hooke joints and two elastic shafts between a motor and a machine, with the inertia on
    the driven side.

    Connect the motor's phi, w, a to the inputs of these names, and the port tau_bias ... w0 to the motor's load.
    Connect driven.phi, driven.w, driven.a to the machine's phi, w, a, and the machine's port to load.

    The communication step must be well below the period of the torsional vibration: at most 0.3/k, with the natural
    frequency k in rad/s of the line between the inertias of both sides. No FMU checks this, as none knows the inertia
    on the other side: in longer steps the vibration grows without end, while each step returns OK. The coupling is of
    second order in the step where the motor turns. Below about 0.1 rad/s, as in a start from rest, it is of first
    order, as the port does not follow the driven side there.
    """,
    # without damping the explicit Euler method raises any swing: this step by a tenth at most until the stop
    fmu_data=FmuData(experiment={"step": 2e-5, "stop": 1.0}),
    description=(
        "Cardan shaft with two Hooke joints between motor and machine: elastic shafts, uneven ratio, damping; "
        "takes a load port and shows one"
    ),
    Parameters=Parameters,
    Inputs=ShaftInput,
    States=States,
    terminals=line_terminals(),
    input_rates=MappingProxyType({"phi": "w", "w": "a"}),
    required=tuple(
        Requirement(name, "rad", "a Hooke joint turns only with a bend below 90 deg") for name in BENDS
    ),
    parts=(Part(Outputs, _outputs), Part(PortSlopes, _slopes)),
    requirements=_limits,
    internal_step=_internal_step,
    initial_states=_initial_states,
    shared=_Point,
    derivatives=_rates,
)
