"""A V-belt between a pulley on the motor's shaft and a driven one, with the slip and the tension of its strands.

The belt creeps under load, in proportion to it at first, and slips through where the load exceeds the grip of the
smaller wrap (Euler and Eytelwein), from which the belt speed v takes the centrifugal part; a belt that slips has the
speed of the slower pulley:

    F = F_grip s/sqrt(s^2 + c^2 (w^2 + (w_share speed)^2)),    s = w - ratio w_driven
    F_grip = 2 (pretension - mass_per_length v^2) (m - 1)/(m + 1),        m = exp(friction wrap)

c is such that the slip at the rated torque is the rated one. `friction` is that of the groove, mu/sin(half its
angle). The torque that bends the belt around the pulleys does not depend on the load, so that the efficiency falls
at part load: (1 - slip) F r/(F r + bending). Both strands together keep twice the pretension, as the distance of the
shafts is fixed; the force on either shaft is the sum of both strands as vectors. The stretch of the belt is left out.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from ..core.engines import MATH
from ..core.model import FmuData, Part, Requirement
from ..core.quantities import Value, declaration, quantity
from .slipping import Slipping, slipping

W_SHARE = 0.2
"""Share of the rated speed below which the creep, in rad/s, falls no more with the speed."""
_LEAST_GRIP = 1.02
"""Least force at which the belt slips through, over the rated one."""
_NOMINAL = math.log(5.0) / math.pi
"""Friction with which makers of belts set the tension: one strand carries five times as much as the other at half a
turn of wrap."""


@declaration
class VBeltData:
    """A V-belt drive. The start values are assumptions of this package."""

    ratio: Value = quantity(
        "1", "turns of the motor per turn of the driven pulley", default=3.0, min=0.1, max=15.0
    )
    rated_power: Value = quantity("W", "rated power at the motor's shaft", default=15e3, above=0.0)
    rated_speed: Value = quantity(
        "rad/s", "rated speed of the motor's shaft", default=152.0, above=0.0, kind="speed"
    )
    diameter: Value = quantity("m", "pitch diameter of the motor's pulley", default=0.16, above=0.0, max=5.0)
    distance: Value = quantity("m", "distance of the shafts", default=0.7, above=0.0, max=50.0)
    pretension: Value = quantity(
        "N", "tension of a strand at rest, of all belts together", default=2000.0, above=0.0
    )
    friction: Value = quantity(
        "1",
        "friction of the groove: 0.3 on the flanks of a groove of 38 deg is 0.92",
        default=0.92,
        min=0.1,
        max=5.0,
    )
    mass_per_length: Value = quantity("kg/m", "mass of all belts per length", default=0.0, min=0.0, max=100.0)
    rated_slip: Value = quantity(
        "1", "slip at the rated torque", default=0.01, min=0.001, max=0.05, kind="percent"
    )
    efficiency: Value = quantity(
        "1", "efficiency at the rated torque, with the slip", default=0.95, min=0.7, max=0.999
    )
    J_motor: Value = quantity("kg.m2", "inertia of the motor's pulley", default=0.02, min=0.0)
    J_driven: Value = quantity("kg.m2", "inertia of the driven pulley", default=0.5, above=0.0)


@declaration
class Parameters(Slipping, VBeltData):
    """Parameters of the belt, which starts without slip."""


@declaration
class BeltForces:
    """The strands at one instant."""

    force: Value = quantity("N", "difference of both strands, which drives", nominal=1000.0)
    grip: Value = quantity("1", "this force over the one at which the belt slips through", kind="percent")
    tight_strand: Value = quantity("N", "tension of the tight strand", nominal=1000.0)
    slack_strand: Value = quantity("N", "tension of the slack strand", nominal=1000.0)
    shaft_force: Value = quantity("N", "radial force on either shaft", nominal=1000.0)


def wrap(xp: Any, p: Any) -> Any:
    """Angle of the belt on the smaller pulley [rad]."""
    return math.pi - 2.0 * xp.asin(xp.abs(p.ratio - 1.0) * p.diameter / (2.0 * p.distance))


def _euler(xp: Any, friction: Any, angle: Any) -> Any:
    """Share of the sum of both tensions that drives before the belt slips, (m - 1)/(m + 1)."""
    m = xp.exp(friction * angle)
    return (m - 1.0) / (m + 1.0)


def _radius(xp: Any, p: Any) -> Any:
    return 0.5 * p.diameter


def _centrifugal(xp: Any, p: Any, w: Any, driven: Any) -> Any:
    """Tension of a strand that does not press on the pulleys [N], at their speeds [rad/s]."""
    v = _radius(xp, p) * xp.minimum(xp.abs(w), p.ratio * xp.abs(driven))
    return p.mass_per_length * v * v


def _pressing(xp: Any, p: Any, w: Any, driven: Any) -> Any:
    """Tension of a strand that presses on the pulleys [N], at their speeds [rad/s]."""
    return xp.maximum(p.pretension - _centrifugal(xp, p, w, driven), 0.0)


def grip(xp: Any, p: Any, w: Any, driven: Any) -> Any:
    """Force at which the belt slips through [N], at the speeds of the pulleys [rad/s]."""
    return 2.0 * _pressing(xp, p, w, driven) * _euler(xp, p.friction, wrap(xp, p))


def rated_grip(xp: Any, p: Any) -> Any:
    """Force at which the belt slips through at the rated speed [N]."""
    return grip(xp, p, p.rated_speed, p.rated_speed / p.ratio)


def rated_force(xp: Any, p: Any) -> Any:
    """Force of the belt at the rated torque of the motor [N], without the torque that bends it."""
    return p.efficiency / (1.0 - p.rated_slip) * p.rated_power / p.rated_speed / _radius(xp, p)


def bending(xp: Any, p: Any) -> Any:
    """Torque at the motor's shaft that bends the belt [N m]."""
    return (1.0 - p.efficiency / (1.0 - p.rated_slip)) * p.rated_power / p.rated_speed


def _creep(xp: Any, p: Any) -> Any:
    """The number c of the law: at the rated speed the rated torque has the rated slip."""
    pull, limit = rated_force(xp, p), rated_grip(xp, p)
    return p.rated_slip / pull * xp.sqrt((limit * limit - pull * pull) / (1.0 + W_SHARE * W_SHARE))


def slip_at(xp: Any, p: Any, pull: Any) -> Any:
    """Slip at the rated speed with the force `pull` of the belt [N], below its grip: the law solved for it."""
    limit = rated_grip(xp, p)
    return _creep(xp, p) * pull * xp.sqrt((1.0 + W_SHARE * W_SHARE) / (limit * limit - pull * pull))


def force(xp: Any, p: Any, w: Any, driven: Any) -> Any:
    """Force of the belt [N] at the speeds of both pulleys [rad/s]."""
    lag, c, least = w - p.ratio * driven, _creep(xp, p), W_SHARE * p.rated_speed
    return grip(xp, p, w, driven) * lag / xp.sqrt(lag * lag + c * c * (w * w + least * least))


def torques(xp: Any, p: Any, w: Any, driven: Any) -> tuple[Any, Any]:
    """Torque that the motor's pulley takes and that the driven one gets [N m], at their speeds [rad/s]."""
    torque, slow = force(xp, p, w, driven) * _radius(xp, p), 0.01 * p.rated_speed
    return torque + bending(xp, p) * w / xp.sqrt(w * w + slow * slow), p.ratio * torque


def forces(xp: Any, p: Any, w: Any, driven: Any) -> BeltForces:
    """The strands at the speeds of both pulleys [rad/s]."""
    pull, centrifugal = force(xp, p, w, driven), _centrifugal(xp, p, w, driven)
    pressing, half = _pressing(xp, p, w, driven), 0.5 * xp.abs(pull)
    tight, slack = pressing + half, xp.maximum(pressing - half, 0.0)
    return BeltForces(
        force=pull,
        grip=xp.abs(pull) / xp.maximum(grip(xp, p, w, driven), 1e-9),
        tight_strand=tight + centrifugal,
        slack_strand=slack + centrifugal,
        shaft_force=xp.sqrt(tight * tight + slack * slack - 2.0 * tight * slack * xp.cos(wrap(xp, p))),
    )


def usual_pretension(p: VBeltData, factor: float) -> float:
    """Tension of a strand at rest [N] by the rule of makers, for `factor` times the rated torque: F (2.5 - K)/(2 K)
    with the factor K of the wrap, 1 at half a turn, and the centrifugal part."""
    K = 1.25 * (1.0 - math.exp(-_NOMINAL * wrap(MATH, p)))
    v = 0.5 * p.diameter * p.rated_speed
    return float(factor * p.rated_power / v * (2.5 - K) / (2.0 * K) + p.mass_per_length * v * v)


def _limits(xp: Any, p: Any) -> Iterator[tuple[Any, Any, Any]]:
    """The pulleys do not touch, the belt carries its rated torque, and the slip is a part of its loss."""
    v = _radius(xp, p) * p.rated_speed
    yield p.distance, 0.5 * p.diameter * (1.0 + p.ratio), math.inf
    yield p.efficiency, 0.0, 1.0 - p.rated_slip
    carried = _LEAST_GRIP * rated_force(xp, p) / (2.0 * _euler(xp, p.friction, wrap(xp, p)))
    yield p.pretension, p.mass_per_length * v * v + carried, math.inf


def _internal_step(xp: Any, p: Any) -> Any:
    """At most 0.25 ms, and half of the time in which the driven pulley alone follows that of the motor."""
    steepest = grip(xp, p, 0.0, 0.0) * _radius(xp, p) / (_creep(xp, p) * W_SHARE * p.rated_speed)
    return xp.minimum(2.5e-4, 0.5 * p.J_driven / (p.ratio * p.ratio * steepest))


def _forces(xp: Any, p: Any, u: Any, x: Any, s: Any) -> BeltForces:
    return forces(xp, p, u.w, x.driven.w)


VBelt = slipping(
    torques,
    lambda p: p.ratio,
    Parameters,
    Part(BeltForces, _forces),
    name="VBelt",
    text="""\
    A V-belt between a motor and a machine: it creeps under load, slips through beyond the grip of its tension, and
    loads both shafts with the sum of its strands.
    """,
    description=(
        "V-belt between motor and machine: slip over load, limit by tension and wrap, force on the shafts; takes a "
        "load port and shows one"
    ),
    required=(
        Requirement("distance", "m", "the pulleys touch", ("diameter", "ratio")),
        Requirement("efficiency", "1", "the slip is a part of the loss", ("rated_slip",)),
        Requirement(
            "pretension",
            "N",
            "the belt slips through at the rated torque",
            ("rated_power", "rated_speed", "diameter", "friction"),
            depends=("ratio", "distance", "mass_per_length", "efficiency", "rated_slip"),
        ),
    ),
    requirements=_limits,
    internal_step=_internal_step,
    fmu_data=FmuData(sizes={"w": 60.0}),  # near the rated speed
)
