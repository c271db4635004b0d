"""Loads of a linkage: weight, what resists the motion of a point, a stop, the losses of the pins.

Each has declared parameters or inputs, and answers one question by `effect`: the forces on links, the torque at the
coordinate that overcomes them by virtual work, and the energy that is held. A force that does not only depend on the
place takes power; its torque is that power over w, written so that w = 0 is regular.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, Protocol

from ..planar import ZERO, Link, Motion, Vec2
from ..quantities import Value, declaration, quantity
from .body import Body, point_load

Joint = tuple[str, str]
"""A joint of a linkage by the names of its pin and of the link on which its reaction acts."""


class Moving(Protocol):
    """A linkage in motion, as loads see it."""

    @property
    def links(self) -> Mapping[str, Link]:
        """Links by name."""

    @property
    def pins(self) -> Mapping[str, Motion]:
        """Pins and points by name."""

    @property
    def bodies(self) -> Mapping[str, Body]:
        """Bodies by the names of their links."""

    @property
    def turns(self) -> Mapping[Joint, Any]:
        """Relative rotation per rotation of the coordinate in each joint."""

    def carrier(self, pin: str) -> str:
        """The link that carries a pin or a point."""


_TINY = 1e-60


class Wrench(NamedTuple):
    """What a load does to a link: force [N], and moment about the link's pin [N m]."""

    link: str
    force: Vec2
    moment: Any


class Effect(NamedTuple):
    """What a load does at one place and speed: wrenches on links, and the torques at the coordinate that overcome it
    [N m]: `held` against what has the `energy` [J], `lost` against what takes power. A load that resists acceleration
    adds the `inertia` [kg m2] and the wrenches `inertial`, each by the acceleration of the coordinate; `source` is
    what it was computed from."""

    wrenches: tuple[Wrench, ...] = ()
    held: Any = 0.0
    lost: Any = 0.0
    energy: Any = 0.0
    inertia: Any = 0.0
    inertial: tuple[Wrench, ...] = ()
    source: Any = None


class Acting(Protocol):
    """A load."""

    @property
    def by_reactions(self) -> bool:
        """Whether it follows from the reactions of the pins: then it is asked after them, and has no wrench."""

    def effect(self, xp: Any, m: Moving, w: Any, reactions: Mapping[Joint, Vec2]) -> Effect:
        """Its effect at the speed `w` of the coordinate [rad/s]; `reactions` are those at constant speed, [N]."""


def wrench_at(m: Moving, pin: str, force: Vec2) -> Wrench:
    """The wrench of a force at a pin or point, on the link that carries it."""
    name = m.carrier(pin)
    return Wrench(name, *point_load(m.pins[pin], m.links[name].pin, force))


class Weight(NamedTuple):
    """The weight of all bodies; `g` [m/s2]. The energy is zero at y = 0."""

    g: Any
    by_reactions: bool = False

    def effect(self, xp: Any, m: Moving, w: Any, reactions: Any) -> Effect:
        """See `Acting`."""
        wrenches, held, energy = [], 0.0, 0.0
        for name, body in m.bodies.items():
            weight, c = body.m * self.g, body.c
            wrenches.append(Wrench(name, Vec2(0.0, -weight), -(c.p.x - body.link.pin.p.x) * weight))
            held, energy = held + weight * c.p1.y, energy + weight * c.p.y
        return Effect(tuple(wrenches), held=held, energy=energy)


class Push(NamedTuple):
    """A force on a point [N], whatever its motion; its power counts as lost."""

    point: str
    force: Vec2
    by_reactions: bool = False

    def effect(self, xp: Any, m: Moving, w: Any, reactions: Any) -> Effect:
        """See `Acting`."""
        return Effect((wrench_at(m, self.point, self.force),), lost=-self.force.dot(m.pins[self.point].p1))


@declaration
class Processing:
    """The law of the processing force."""

    v_smooth: Value = quantity(
        "m/s", "speed of B below which the force is smoothed", default=0.02, min=1e-9, tunable=True
    )


class Resistance(NamedTuple):
    """A force on a point against its motion [N], smoothed near rest by the law (`Processing`)."""

    point: str
    force: Any
    law: Any
    by_reactions: bool = False

    def per_speed(self, xp: Any, v2: Any) -> Any:
        """The force by the speed of the point, where that is `v2` squared [N s/m]."""
        return self.force / xp.sqrt(v2 + self.law.v_smooth * self.law.v_smooth)

    def effect(self, xp: Any, m: Moving, w: Any, reactions: Any) -> Effect:
        """See `Acting`."""
        p1 = m.pins[self.point].p1
        v2 = p1.squared()
        per = self.per_speed(xp, v2 * (w * w)) * w
        return Effect((wrench_at(m, self.point, p1 * (-per)),), lost=v2 * per)


@declaration
class Stack:
    """The stack of paper, and how it resists."""

    top: Value = quantity("m", "height y of its top", default=-0.185, min=-1e4, max=1e4, tunable=True)
    table: Value = quantity(
        "m", "height y of the table below it", default=-0.234, min=-1e4, max=1e4, tunable=True
    )
    edge: Value = quantity(
        "m", "way over which the resistance rises and falls", default=0.002, min=1e-6, tunable=True
    )
    v_smooth: Value = quantity(
        "m/s",
        "speed of the blade below which the resistance is smoothed",
        default=0.005,
        min=1e-9,
        tunable=True,
    )


def _engaged(xp: Any, x: Any) -> Any:
    """A step from 0 to 1 about x = 0, over about two units."""
    return 0.5 * (1.0 + x / xp.sqrt(1.0 + x * x))


class Cut(NamedTuple):
    """The resistance of a stack (`Stack`) to a point on its way down in it [N], against the motion."""

    point: str
    force: Any
    stack: Any
    by_reactions: bool = False

    def effect(self, xp: Any, m: Moving, w: Any, reactions: Any) -> Effect:
        """See `Acting`."""
        k, stack = m.pins[self.point], self.stack
        small2 = stack.v_smooth * stack.v_smooth
        inside = _engaged(xp, (stack.top - k.p.y) / stack.edge) * _engaged(
            xp, (k.p.y - stack.table) / stack.edge
        )
        down = k.p1.y * w
        falling = 0.5 * (1.0 - down / xp.sqrt(down * down + small2))
        v2 = k.p1.squared()
        per = self.force * inside * falling / xp.sqrt(v2 * (w * w) + small2) * w
        return Effect((wrench_at(m, self.point, k.p1 * (-per)),), lost=v2 * per)


@declaration
class Stop:
    """A spring and damper between rocker and frame, which hold a blocked rocker; off where both are zero. The
    smoothed friction and processing force hold nothing at rest."""

    stiffness: Value = quantity("N.m/rad", "stiffness", default=0.0, min=0.0, nominal=1e6)
    damping: Value = quantity("N.m.s/rad", "damping", default=0.0, min=0.0, nominal=1e4)
    psi: Value = quantity("rad", "rocker angle at which the spring is free", default=0.0)


class Block(NamedTuple):
    """What blocks a link (`Stop`), whose angle counts from the downward vertical and never reaches the horizontal."""

    link: str
    stop: Any
    by_reactions: bool = False

    def effect(self, xp: Any, m: Moving, w: Any, reactions: Any) -> Effect:
        """See `Acting`."""
        link, stop = m.links[self.link], self.stop
        k, turned = link.t1, xp.asin(link.u.x) - stop.psi
        held, damped = stop.stiffness * turned, stop.damping * k * w
        return Effect(
            (Wrench(self.link, ZERO, -(held + damped)),),
            held=held * k,
            lost=damped * k,
            energy=0.5 * held * turned,
        )


@declaration
class Pin:
    """The pins, all alike."""

    friction: Value = quantity("1", "coefficient of friction", default=0.12, min=0.0, max=100.0, tunable=True)
    diameter: Value = quantity(
        "m", "diameter", default=0.06, min=0.0, max=100.0, tunable=True, usual=(1e-3, 1.0)
    )
    w_smooth: Value = quantity(
        "rad/s", "relative speed below which friction is smoothed", default=0.02, min=1e-9, tunable=True
    )


class PinLosses(NamedTuple):
    """Losses in all pins (`Pin`): Coulomb friction that the reaction sets, smoothed near rest, and viscous damping
    [N m s/rad] of each.

    A pin with the relative speed Dw and the reaction R dissipates friction * diameter/2 * |R| * Dw^2/sqrt(Dw^2 +
    w_smooth^2) + damping * Dw^2. Friction is left out of the reactions: it is small, and with it the torque would no
    longer be linear in the acceleration.
    """

    pin: Any
    damping: Any
    by_reactions: bool = True

    def effect(self, xp: Any, m: Moving, w: Any, reactions: Mapping[Joint, Vec2]) -> Effect:
        """See `Acting`."""
        pin = self.pin
        per_newton = 0.5 * pin.friction * pin.diameter
        smooth2, w2, lost = pin.w_smooth * pin.w_smooth, w * w, 0.0
        for joint, force in reactions.items():
            turn = m.turns[joint]
            k2 = turn * turn
            # one root of the ratio of squares, which has a slope at zero, too
            minus_per = -1.0 / (k2 * w2 + smooth2)
            rubbed = xp.sqrt(_TINY - force.squared() * minus_per)
            lost = lost + k2 * (per_newton * rubbed + self.damping)
        return Effect(lost=lost * w)
