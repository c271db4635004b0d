"""Loads of a linkage: weight, resistance to the motion of a point, a stop, the losses of the pins.

Each takes parameters and inputs as machines declare them (`chainunit.machines.parts`), and answers one question by
`effect`: the forces on links, the torque at the coordinate that overcomes them by virtual work, and the energy that
is held. A force that does not only depend on the place takes power; its torque is that power over w, written so that
w = 0 is regular.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, Protocol

from ..planar import ZERO, Link, Motion, Vec2
from .body import Body

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
    """The effect of a load on a link: force [N], and moment about the link's pin [N m]."""

    link: str
    force: Vec2
    moment: Any


class Effect(NamedTuple):
    """The effect of a load at one place and speed: wrenches on links, and the torques at the coordinate that overcome
    it [N m]: `held` against the part that has the `energy` [J], `lost` against the part that takes power. A weight is
    a `field`: it acts as if the frame were accelerated along y [m/s2]. A load that resists acceleration adds the
    `inertia` [kg m2] and the wrenches `inertial`, each by the acceleration of the coordinate; `source` is the object
    that they were computed from."""

    wrenches: tuple[Wrench, ...] = ()
    held: Any = 0.0
    lost: Any = 0.0
    energy: Any = 0.0
    field: Any = 0.0
    inertia: Any = 0.0
    inertial: tuple[Wrench, ...] = ()
    source: Any = None


class Acting(Protocol):
    """A load."""

    @property
    def by_reactions(self) -> bool:
        """Whether it follows from the reactions of the pins: then it is asked after them, has no wrench, and gives
        its own slope, see `PinLosses.slope`."""

    def effect(self, xp: Any, m: Moving, w: Any, reactions: Mapping[Joint, Vec2]) -> Effect:
        """Its effect at the speed `w` of the coordinate [rad/s]; `reactions` are those at constant speed, [N]."""


def wrench_at(m: Moving, pin: str, force: Vec2) -> Wrench:
    """The wrench of a force at a pin or point, on the link that carries it."""
    name = m.carrier(pin)
    return Wrench(name, force, (m.pins[pin].p - m.links[name].pin.p).cross(force))


class Weight(NamedTuple):
    """The weight of all bodies; `g` [m/s2]. The energy is zero at y = 0."""

    g: Any
    by_reactions: bool = False

    def effect(self, xp: Any, m: Moving, w: Any, reactions: Any) -> Effect:
        """See `Acting`."""
        held, energy = 0.0, 0.0
        for body in m.bodies.values():
            held, energy = held + body.m * body.c.p1.y, energy + body.m * body.c.p.y
        return Effect(held=held * self.g, energy=energy * self.g, field=self.g)


class Push(NamedTuple):
    """A force on a point [N], independent of its motion; its power counts as lost."""

    point: str
    force: Vec2
    by_reactions: bool = False

    def effect(self, xp: Any, m: Moving, w: Any, reactions: Any) -> Effect:
        """See `Acting`."""
        return Effect((wrench_at(m, self.point, self.force),), lost=-self.force.dot(m.pins[self.point].p1))


class Resistance(NamedTuple):
    """A force on a point against its motion [N], smoothed below the speed `v_smooth` of its law."""

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


class Brake(NamedTuple):
    """A torque on a link against its rotation in the frame [N m], smoothed below the speed `w_smooth` of its law."""

    link: str
    torque: Any
    law: Any
    by_reactions: bool = False

    def effect(self, xp: Any, m: Moving, w: Any, reactions: Any) -> Effect:
        """See `Acting`."""
        k, small = m.links[self.link].t1, self.law.w_smooth
        turning = k * w
        moment = self.torque * turning / xp.sqrt(turning * turning + small * small)
        return Effect((Wrench(self.link, ZERO, -moment),), lost=k * moment)


def _engaged(xp: Any, x: Any) -> Any:
    """A step from 0 to 1 about x = 0, over about two units."""
    return 0.5 * (1.0 + x / xp.sqrt(1.0 + x * x))


class Cut(NamedTuple):
    """The resistance of a stack to a point on its way down in it [N], against the motion."""

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


class Block(NamedTuple):
    """The obstacle of a link, a spring and a damper; the link's angle counts from the downward vertical and never
    reaches the horizontal."""

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


class PinLosses(NamedTuple):
    """Losses in all pins: Coulomb friction that the reaction sets, smoothed near rest, and viscous damping
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
        per_newton, smooth2, w2, lost = *self._law(), w * w, 0.0
        turns, damping = m.turns, self.damping
        for joint, force in reactions.items():
            k2, _, rubbed = _rubbed(xp, force, turns[joint], w2, smooth2)
            lost = lost + k2 * (per_newton * rubbed + damping)
        return Effect(lost=lost * w)

    def slope(
        self,
        xp: Any,
        m: Moving,
        w: Any,
        reactions: Mapping[Joint, Vec2],
        growing: Mapping[Joint, Vec2],
        turning: Mapping[Joint, Any] | None,
    ) -> Any:
        """The slope of the lost torque in the direction in which the reactions grow and the relative rotations
        change; without these by the speed."""
        per_newton, smooth2, w2, rest, slope = *self._law(), w * w, 0.0, 0.0
        for joint, force in reactions.items():
            k = m.turns[joint]
            k2, minus_per, rubbed = _rubbed(xp, force, k, w2, smooth2)
            # of rubbed^2 = |R|^2/(k^2 w^2 + smooth^2)
            wider = k2 * w if turning is None else k * turning[joint] * w2
            grows = (rubbed * rubbed * wider - force.dot(growing[joint])) * (minus_per / rubbed)
            slope = slope + k2 * (per_newton * grows)
            taken = per_newton * rubbed + self.damping
            rest = rest + (k2 * taken if turning is None else 2.0 * (k * turning[joint]) * taken)
        return slope * w + (rest if turning is None else rest * w)

    def _law(self) -> tuple[Any, Any]:
        """Moment by force, and the square of the speed that smooths."""
        pin = self.pin
        return 0.5 * pin.friction * pin.diameter, pin.w_smooth * pin.w_smooth


def _rubbed(xp: Any, force: Vec2, turn: Any, w2: Any, smooth2: Any) -> tuple[Any, Any, Any]:
    """The square of the relative rotation, -1/(k^2 w^2 + smooth^2), and |R| by the root of that, which has a slope at
    zero, too; one root of the ratio of squares is cheaper than two."""
    k2 = turn * turn
    minus_per = -1.0 / (k2 * w2 + smooth2)
    return k2, minus_per, xp.sqrt(_TINY - (force.x * force.x + force.y * force.y) * minus_per)
