"""The common declarations of machines: links as bodies, forces, and the laws of loads (`chainunit.groups.loads`)."""

from __future__ import annotations

from ..core.planar import Vec2
from ..core.quantities import Value, declaration, quantity


@declaration
class Rod:
    """A link of the drive as a body."""

    m: Value = quantity("kg", "mass", default=0.0, min=0.0, tunable=True)
    s: Value = quantity(
        "m",
        "distance of the centroid from the pin named first, along the link",
        default=0.0,
        min=-1e4,
        max=1e4,
        tunable=True,
    )
    I: Value = quantity("kg.m2", "moment of inertia about the centroid", default=0.0, min=0.0, tunable=True)


@declaration
class Pin:
    """The pins; all have the same parameters."""

    friction: Value = quantity(
        "1", "coefficient of friction", default=0.12, min=0.0, max=100.0, tunable=True, usual=(0.0, 1.0)
    )
    diameter: Value = quantity(
        "m", "diameter", default=0.06, min=0.0, max=100.0, tunable=True, usual=(1e-3, 0.5)
    )
    w_smooth: Value = quantity(
        "rad/s", "relative speed below which friction is smoothed", default=0.02, min=1e-9, tunable=True
    )


@declaration
class PinLaw(Pin):
    """The pins with their damping."""

    damping: Value = quantity("N.m.s/rad", "viscous damping of each", default=0.0, min=0.0, tunable=True)


@declaration
class GuideLaw:
    """The guides, all alike."""

    friction: Value = quantity(
        "1", "coefficient of friction", default=0.0, min=0.0, max=100.0, tunable=True, usual=(0.0, 1.0)
    )
    v_smooth: Value = quantity(
        "m/s", "relative speed below which friction is smoothed", default=0.02, min=1e-9, tunable=True
    )
    damping: Value = quantity("N.s/m", "viscous damping of each", default=0.0, min=0.0, tunable=True)


@declaration
class Processing:
    """The law of the processing force."""

    v_smooth: Value = quantity(
        "m/s", "speed of B below which the force is smoothed", default=0.02, min=1e-9, tunable=True
    )


@declaration
class Stop:
    """A spring and a damper between rocker and frame, which hold a blocked rocker; without effect where both are
    zero. The smoothed friction and the smoothed processing force cannot hold the rocker at rest."""

    stiffness: Value = quantity("N.m/rad", "stiffness", default=0.0, min=0.0, nominal=1e6)
    damping: Value = quantity("N.m.s/rad", "damping", default=0.0, min=0.0, nominal=1e4)
    psi: Value = quantity("rad", "rocker angle at which the spring is free", default=0.0)


@declaration
class Force:
    """A force by its components: x right, y up."""

    fx: Value = quantity("N", "force along x", nominal=1000.0)
    fy: Value = quantity("N", "force along y", nominal=1000.0)


def force(f: Vec2) -> Force:
    """The vector as an instance of `Force`."""
    return Force(fx=f.x, fy=f.y)
