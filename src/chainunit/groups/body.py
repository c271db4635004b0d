"""A link as data, the rigid body on it, and the wrench that it exerts.

`m` mass [kg], `I` moment of inertia about the centroid [kg m2], `c` motion of the centroid,
`t1`, `t2` derivatives of the body's angle by the coordinate q.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

from ..planar import ZERO, Link, Motion, Vec2

NOTHING: Mapping[str, Any] = MappingProxyType({})


class Mass(NamedTuple):
    """A rigid body on a link: mass [kg], distance `s` of its centroid from the link's pin along the link [m], moment
    of inertia about the centroid [kg m2], and distance `t` of the centroid to the left of the link [m]."""

    m: Any
    s: Any
    I: Any
    t: Any = None


class Bar(NamedTuple):
    """A binary link as data: its name, the pin that it starts from, its length [m], the body on it - anything with
    `m`, `s`, `I` as `Mass` has them - and further points on it by name, each as distances along it and to its left
    [m]."""

    name: str
    pin: str
    length: Any
    mass: Any = None
    points: Mapping[str, tuple[Any, Any]] = NOTHING


Load = tuple[Vec2, Any]
"""What acts on a link: force [N], and moment about the link's pin [N m]."""

UNLOADED: Load = (ZERO, 0.0)


class Body:
    """A mass `m` with inertia `I` and the centroid `c` on `link`."""

    __slots__ = ("I", "c", "link", "m")

    def __init__(self, link: Link, m: Any, c: Motion, I: Any) -> None:
        self.link = link
        self.m = m
        self.I = I
        self.c = c

    @classmethod
    def on(cls, link: Link, mass: Any) -> Body:
        """The body `mass` on `link`."""
        t = mass.t if isinstance(mass, Mass) else None
        return cls(link, mass.m, link.at(mass.s) if t is None else link.beside(mass.s, t), mass.I)

    def lifted(self, link: Link) -> Body:
        """The body with its derivatives by q as dual parts, on the lifted link."""
        return Body(link, self.m, link.lifted_point(self.c), self.I)

    def inertia(self) -> tuple[Any, Any]:
        """Reflected inertia J [kg m2] and its derivative dJ/dq by the coordinate."""
        c, k = self.c, self.link
        return (
            self.m * c.p1.squared() + self.I * (k.t1 * k.t1),
            2.0 * (self.m * c.p1.dot(c.p2) + self.I * (k.t1 * k.t2)),
        )

    def _resists(self, acceleration: Vec2, spin: Any) -> Load:
        force = acceleration * (-self.m)
        return force, (self.c.p - self.link.pin.p).cross(force) - self.I * spin

    def centrifugal(self, w2: Any) -> Load:
        """The inertia force (d'Alembert) at constant speed of the coordinate, `w2` its square."""
        return self._resists(self.c.p2 * w2, self.link.t2 * w2)

    def inertial(self) -> Load:
        """The inertia force by the acceleration of the coordinate."""
        return self._resists(self.c.p1, self.link.t1)


def reflected(bodies: Iterable[Body]) -> tuple[Any, Any]:
    """Reflected inertia of several bodies J [kg m2] and its derivative dJ/dq."""
    parts = [body.inertia() for body in bodies]
    return sum(j for j, _ in parts), sum(j1 for _, j1 in parts)


def point_load(at: Motion, pin: Motion, force: Vec2) -> Load:
    """A force at a point of a link, as force and moment about the link's pin."""
    return force, (at.p - pin.p).cross(force)


def total(*loads: Load) -> Load:
    """The sum of loads about one pin."""
    force, moment = loads[0]
    for f, m in loads[1:]:
        force = force + f
        moment = moment + m
    return force, moment
