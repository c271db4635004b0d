"""A rigid body on a link: its inertia as the coordinate sees it, and the wrench it exerts.

`m` mass [kg], `I` moment of inertia about the centroid [kg m2], `c` motion of the centroid,
`t1`, `t2` derivatives of the body's angle by the coordinate q.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ..planar import Link, Motion, Vec2


class Body:
    """A mass `m` with inertia `I` at distance `s` from the pin of `link`, along it, and `t` to its left."""

    __slots__ = ("I", "c", "link", "m")

    def __init__(self, link: Link, m: Any, s: Any, I: Any, t: Any = None) -> None:
        self.link = link
        self.m = m
        self.I = I
        self.c = link.at(s) if t is None else link.beside(s, t)

    def inertia(self) -> tuple[Any, Any]:
        """Reflected inertia J [kg m2] and its derivative dJ/dq by the coordinate."""
        c, k = self.c, self.link
        return (
            self.m * c.p1.squared() + self.I * (k.t1 * k.t1),
            2.0 * (self.m * c.p1.dot(c.p2) + self.I * (k.t1 * k.t2)),
        )

    def weight_slope(self, g: Any) -> Any:
        """dV/dq, the derivative of the potential energy [N m]."""
        return self.m * g * self.c.p1.y

    def potential(self, g: Any) -> Any:
        """Potential energy, zero at y = 0 [J]."""
        return self.m * g * self.c.p.y

    def applied(self, w2: Any, a: Any, g: Any) -> tuple[Vec2, Any]:
        """Gravity and inertia (d'Alembert) as force [N] and moment about the link's pin [N m].

        `w2` is the squared speed of the coordinate, `a` its acceleration.
        """
        c, k = self.c, self.link
        force = (c.p1 * a + c.p2 * w2) * (-self.m)
        force.y = force.y - self.m * g
        moment = (c.p - k.pin.p).cross(force) - self.I * (k.t1 * a + k.t2 * w2)
        return force, moment


def reflected(bodies: Iterable[Body]) -> tuple[Any, Any]:
    """Reflected inertia of several bodies J [kg m2] and its derivative dJ/dq."""
    parts = [body.inertia() for body in bodies]
    return sum(j for j, _ in parts), sum(j1 for _, j1 in parts)


def point_load(at: Motion, pin: Motion, force: Vec2) -> tuple[Vec2, Any]:
    """A force at a point of a link, as force and moment about the link's pin."""
    return force, (at.p - pin.p).cross(force)


def total(*loads: tuple[Vec2, Any]) -> tuple[Vec2, Any]:
    """The sum of loads about one pin."""
    force, moment = loads[0]
    for f, m in loads[1:]:
        force = force + f
        moment = moment + m
    return force, moment
