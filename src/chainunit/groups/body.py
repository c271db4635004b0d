"""A link as data, the rigid body on it, and the inertia forces of this body.

`m` is the mass [kg], `I` the moment of inertia about the centroid [kg m2], `c` the motion of the centroid; `t1`, `t2`
are derivatives of the body's angle by the coordinate q.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

from ..core.planar import ZERO, Link, Motion, Vec2

NOTHING: Mapping[str, Any] = MappingProxyType({})


class Mass(NamedTuple):
    """A rigid body on a link: mass [kg], distance `s` of its centroid from the link's pin along the link [m], moment
    of inertia about the centroid [kg m2], and distance `t` of the centroid to the left of the link [m]."""

    m: Any
    s: Any
    I: Any
    t: Any = None


class Bar(NamedTuple):
    """A binary link as data: its name, the pin that it starts from, its length [m], the body on it (an object with
    `m`, `s`, `I` as in `Mass`), and further points by name, each by its distances along the link and to the left of
    it [m]."""

    name: str
    pin: str
    length: Any
    mass: Any = None
    points: Mapping[str, tuple[Any, Any]] = NOTHING


Load = tuple[Vec2, Any]
"""The action on a link: force [N], and moment about the link's pin [N m]."""

NO_LOAD: Load = (ZERO, 0.0)


class Body:
    """A mass `m` with inertia `I` and the centroid `c` on `link`."""

    __slots__ = ("I", "c", "link", "m")

    def __init__(self, link: Link, m: Any, c: Motion, I: Any) -> None:
        self.link = link
        self.m = m
        self.I = I
        self.c = c

    def inertia(self) -> tuple[Any, Any]:
        """Reflected inertia J [kg m2] and its derivative dJ/dq by the coordinate."""
        p1, p2, k = self.c.p1, self.c.p2, self.link
        return (
            self.m * (p1.x * p1.x + p1.y * p1.y) + self.I * (k.t1 * k.t1),
            2.0 * (self.m * (p1.x * p2.x + p1.y * p2.y) + self.I * (k.t1 * k.t2)),
        )

    # in components: this runs for each body in each force pass, and with `math` a vector costs ten times a number
    def _resists(self, ax: Any, ay: Any, spin: Any) -> Load:
        c, pin = self.c.p, self.link.pin.p
        fx, fy = -(self.m * ax), -(self.m * ay)
        return Vec2(fx, fy), (c.x - pin.x) * fy - (c.y - pin.y) * fx - self.I * spin

    def centrifugal(self, w2: Any, field: Any = 0.0) -> Load:
        """The inertia force (d'Alembert) at constant speed of the coordinate, in a frame with the acceleration
        `field` along y [m/s2]; `w2` is the squared speed. With the field g this includes the weight."""
        c2 = self.c.p2
        return self._resists(c2.x * w2, c2.y * w2 + field, self.link.t2 * w2)

    def centrifugal_slope(self, w2: Any, field: Any, third: tuple[Vec2, Any]) -> Load:
        """The derivative of `centrifugal` by q, from the third derivatives of the link's pin and angle."""
        start, t3 = third
        pin, c = self.link.pin, self.c
        arm, turning = c.p - pin.p, c.p1 - pin.p1
        force = self.link.third_derivative(arm, start, t3) * (-(self.m * w2))
        # the present force acts on an arm that turns
        by_arm = turning.x * (c.p2.y * w2 + field) - turning.y * (c.p2.x * w2)
        return force, arm.cross(force) - by_arm * self.m - self.I * (t3 * w2)

    def inertial(self) -> Load:
        """The inertia force per acceleration of the coordinate."""
        return self._resists(self.c.p1.x, self.c.p1.y, self.link.t1)


def body_on(link: Link, mass: Any) -> Body:
    """The body `mass` on `link`."""
    beside = mass.t if isinstance(mass, Mass) else None
    c = link.at(mass.s) if beside is None else link.beside(mass.s, beside)
    return Body(link, mass.m, c, mass.I)


def reflected_inertia(bodies: Iterable[Body]) -> tuple[Any, Any]:
    """Reflected inertia of several bodies J [kg m2] and its derivative dJ/dq."""
    J, dJ = 0.0, 0.0
    for body in bodies:
        inertia, slope = body.inertia()
        J, dJ = J + inertia, dJ + slope
    return J, dJ
