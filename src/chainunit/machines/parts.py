"""The common declarations of machines: links as bodies, forces."""

from __future__ import annotations

from ..planar import Vec2
from ..quantities import Value, declaration, quantity


@declaration
class Rod:
    """A link of the drive as a body."""

    m: Value = quantity("kg", "mass", default=0.0, min=0.0, tunable=True)
    s: Value = quantity(
        "m",
        "distance of the centroid from the first pin, along the link",
        default=0.0,
        min=-1e4,
        max=1e4,
        tunable=True,
    )
    I: Value = quantity("kg.m2", "moment of inertia about the centroid", default=0.0, min=0.0, tunable=True)


@declaration
class Force:
    """A force in the frame x right, y up."""

    fx: Value = quantity("N", "force along x", nominal=1000.0)
    fy: Value = quantity("N", "force along y", nominal=1000.0)


def force(f: Vec2) -> Force:
    """The vector as declared."""
    return Force(fx=f.x, fy=f.y)
