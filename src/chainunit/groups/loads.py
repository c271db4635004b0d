"""Loads of a linkage: weight, resistance to the motion of a point, a stop, the losses of the pins.

Each load takes parameters and inputs as machines declare them (`chainunit.machines.parts`). Its method `effect` gives
the forces on the links, the torque at the coordinate that overcomes them (by virtual work), and the potential energy.
A force that depends on more than the place takes power; its torque is this power over w, in a form that is regular at
w = 0.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple, Protocol

from ..core.planar import ZERO, Vec2
from .body import Body
from .joints import GuideForce, Joint, LinkageInMotion

Reactions = Mapping[Joint, Vec2]
"""The force in each joint on its link [N]."""


class Moving(LinkageInMotion, Protocol):
    """A linkage in motion, as loads see it."""

    @property
    def q(self) -> Any:
        """The place of the first driver [rad, m]."""

    @property
    def rate(self) -> Any:
        """The derivative of that place by the coordinate, 1 if it is the coordinate itself."""

    @property
    def bodies(self) -> Mapping[str, Body]:
        """Bodies by the names of their links."""

    @property
    def turns(self) -> Mapping[Joint, Any]:
        """Relative rotation by the coordinate in each joint that turns."""

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
    the load [N m]. The `conservative` torque overcomes the part with the potential `energy` [J], the `dissipative`
    one the part that takes power. A weight is a `field`: it acts like an acceleration of the frame along y [m/s2]. A
    load that resists acceleration adds the `inertia` [kg m2] and the wrenches `inertial`, each per acceleration of
    the coordinate. `source` is the object from which the effect was computed."""

    wrenches: tuple[Wrench, ...] = ()
    conservative: Any = 0.0
    dissipative: Any = 0.0
    energy: Any = 0.0
    field: Any = 0.0
    inertia: Any = 0.0
    inertial: tuple[Wrench, ...] = ()
    source: Any = None


class Acting(Protocol):
    """A load."""

    @property
    def by_reactions(self) -> bool:
        """Whether the load depends on the reactions of the pins. Then it is computed after them, has no wrench, and
        gives its own slope, see `PinLosses.slope`."""

    def effect(self, xp: Any, m: Moving, w: Any, reactions: Mapping[Joint, Vec2]) -> Effect:
        """The effect of the load at the speed `w` of the coordinate [rad/s]; `reactions` are the reactions at
        constant speed [N]."""


def wrench_at(m: Moving, pin: str, force: Vec2) -> Wrench:
    """The wrench of a force at a pin or point, on the link that carries it."""
    name = m.carrier(pin)
    return Wrench(name, force, (m.pins[pin].p - m.links[name].pin.p).cross(force))


class Weight(NamedTuple):
    """The weight of all bodies; `g` [m/s2]. The energy is zero at y = 0."""

    g: Any
    by_reactions: bool = False

    def effect(self, xp: Any, m: Moving, w: Any, reactions: Any) -> Effect:
        """The moment of the weight along the coordinate, and the energy of the bodies [J]."""
        moment, energy = 0.0, 0.0
        for body in m.bodies.values():
            moment, energy = moment + body.m * body.c.p1.y, energy + body.m * body.c.p.y
        return Effect(conservative=moment * self.g, energy=energy * self.g, field=self.g)


class Push(NamedTuple):
    """A force on a point [N], independent of its motion; its power counts as loss."""

    point: str
    force: Vec2
    by_reactions: bool = False

    def effect(self, xp: Any, m: Moving, w: Any, reactions: Any) -> Effect:
        """The force on its point [N], which counts as dissipated."""
        return Effect(
            (wrench_at(m, self.point, self.force),), dissipative=-self.force.dot(m.pins[self.point].p1)
        )


class Resistance(NamedTuple):
    """A force on a point against its motion [N], smoothed below the speed `v_smooth` of its law."""

    point: str
    force: Any
    law: Any
    by_reactions: bool = False

    def per_speed(self, xp: Any, v2: Any) -> Any:
        """The force over the speed of the point [N s/m]; `v2` is the squared speed."""
        return self.force / xp.sqrt(v2 + self.law.v_smooth * self.law.v_smooth)

    def effect(self, xp: Any, m: Moving, w: Any, reactions: Any) -> Effect:
        """The force on its point against the motion [N], which dissipates."""
        p1 = m.pins[self.point].p1
        v2 = p1.squared()
        per = self.per_speed(xp, v2 * (w * w)) * w
        return Effect((wrench_at(m, self.point, p1 * (-per)),), dissipative=v2 * per)


class Brake(NamedTuple):
    """A torque on a link against its rotation relative to the frame [N m], smoothed below the speed `w_smooth` of its
    law."""

    link: str
    torque: Any
    law: Any
    by_reactions: bool = False

    def effect(self, xp: Any, m: Moving, w: Any, reactions: Any) -> Effect:
        """The torque on its link against the rotation [N m], which dissipates."""
        k, small = m.links[self.link].t1, self.law.w_smooth
        turning = k * w
        moment = self.torque * turning / xp.sqrt(turning * turning + small * small)
        return Effect((Wrench(self.link, ZERO, -moment),), dissipative=k * moment)


def _smooth_step(xp: Any, x: Any) -> Any:
    """A step from 0 to 1 about x = 0, over about two units."""
    return 0.5 * (1.0 + x / xp.sqrt(1.0 + x * x))


class Cut(NamedTuple):
    """The resistance of a stack to a point that moves down in it [N]; it acts against the motion."""

    point: str
    force: Any
    stack: Any
    by_reactions: bool = False

    def effect(self, xp: Any, m: Moving, w: Any, reactions: Any) -> Effect:
        """The force on its point inside the stack [N], which dissipates."""
        k, stack = m.pins[self.point], self.stack
        small2 = stack.v_smooth * stack.v_smooth
        inside = _smooth_step(xp, (stack.top - k.p.y) / stack.edge) * _smooth_step(
            xp, (k.p.y - stack.table) / stack.edge
        )
        down = k.p1.y * w
        falling = 0.5 * (1.0 - down / xp.sqrt(down * down + small2))
        v2 = k.p1.squared()
        per = self.force * inside * falling / xp.sqrt(v2 * (w * w) + small2) * w
        return Effect((wrench_at(m, self.point, k.p1 * (-per)),), dissipative=v2 * per)


class Block(NamedTuple):
    """A stop against the rotation of a link: a spring and a damper. The angle of the link counts from the downward
    vertical and never reaches the horizontal."""

    link: str
    stop: Any
    by_reactions: bool = False

    def effect(self, xp: Any, m: Moving, w: Any, reactions: Any) -> Effect:
        """The torque of spring and damper on its link [N m], with the energy of the spring [J]."""
        link, stop = m.links[self.link], self.stop
        k, twist = link.t1, xp.asin(link.u.x) - stop.psi
        spring, damper = stop.stiffness * twist, stop.damping * k * w
        return Effect(
            (Wrench(self.link, ZERO, -(spring + damper)),),
            conservative=spring * k,
            dissipative=damper * k,
            energy=0.5 * spring * twist,
        )


def _laws(usual: Any, damping: Any, laws: Mapping[Joint, Any]) -> list[tuple[Joint | None, Any, Any]]:
    """Joint, law and damping of the joints that differ, after those of all others, whose joint is None."""
    return [(None, usual, damping), *((joint, law, law.damping) for joint, law in laws.items())]


class PinLosses(NamedTuple):
    """Losses in all pins: Coulomb friction in proportion to the reaction, smoothed near rest, and viscous damping
    [N m s/rad] of each pin. Pins that differ have laws of their own, with damping, by joint.

    A pin with the relative speed Dw and the reaction R dissipates friction * diameter/2 * |R| * Dw^2/sqrt(Dw^2 +
    w_smooth^2) + damping * Dw^2. The reactions do not include the friction: it is small, and with it the torque would
    no longer be linear in the acceleration.
    """

    pin: Any
    damping: Any
    laws: Mapping[Joint, Any] = MappingProxyType({})
    by_reactions: bool = True

    def effect(self, xp: Any, m: Moving, w: Any, reactions: Reactions, along: Moving | None = None) -> Effect:
        """The torque of friction and damping in all pins along the coordinate, or `along` another motion
        of the linkage."""
        w2, loss, constants = w * w, 0.0, self._constants()
        for joint, turn in m.turns.items():
            per_newton, smooth2, damping = constants.get(joint) or constants[None]
            k2, _, ratio = _friction_terms(xp, reactions[joint].squared(), turn, w2, smooth2)
            k2 = k2 if along is None else turn * along.turns[joint]
            loss = loss + k2 * (per_newton * ratio + damping)
        return Effect(dissipative=loss * w)

    def slope(
        self,
        xp: Any,
        m: Moving,
        w: Any,
        reactions: Mapping[Joint, Vec2],
        growing: Mapping[Joint, Vec2],
        turning: Mapping[Joint, Any] | None,
    ) -> Any:
        """The slope of the dissipative torque in the direction in which the reactions change by `growing` and the
        relative rotations by `turning`; where `turning` is None, the slope by the speed."""
        w2, rest, slope, constants = w * w, 0.0, 0.0, self._constants()
        for joint, k in m.turns.items():
            per_newton, smooth2, damping = constants.get(joint) or constants[None]
            force = reactions[joint]
            k2, minus_per, ratio = _friction_terms(xp, force.squared(), k, w2, smooth2)
            # of ratio^2 = |R|^2/(k^2 w^2 + smooth^2)
            wider = k2 * w if turning is None else k * turning[joint] * w2
            grows = (ratio * ratio * wider - force.dot(growing[joint])) * (minus_per / ratio)
            slope = slope + k2 * (per_newton * grows)
            per_speed = per_newton * ratio + damping
            rest = rest + (k2 * per_speed if turning is None else 2.0 * (k * turning[joint]) * per_speed)
        return slope * w + (rest if turning is None else rest * w)

    def _constants(self) -> dict[Joint | None, tuple[Any, Any, Any]]:
        """By joint, and by None for all others, the friction moment per reaction [m], the square of the smoothing
        speed [rad2/s2], and the damping."""
        return {
            joint: (0.5 * law.friction * law.diameter, law.w_smooth * law.w_smooth, damping)
            for joint, law, damping in _laws(self.pin, self.damping, self.laws)
        }


class GuideLosses(NamedTuple):
    """Losses in all guides: Coulomb friction that the reaction sets, smoothed near rest, and viscous damping [N s/m]
    of each.

    The block of a guide of the length L bears at its two ends: on these press N/2 + M/L and N/2 - M/L, M the moment
    about its middle. Each dissipates friction |press| Dv^2/sqrt(Dv^2 + v_smooth^2) at the relative speed Dv.
    `lengths` has the lengths of guides by joint [m]; one that is not named has a point for a block, and M does not
    matter. As with pins, friction is left out of the reactions. Guides that differ have `laws` of their own by joint.
    """

    guide: Any
    damping: Any
    lengths: Mapping[Joint, Any] = MappingProxyType({})
    laws: Mapping[Joint, Any] = MappingProxyType({})
    by_reactions: bool = True

    def effect(self, xp: Any, m: Moving, w: Any, reactions: Reactions, along: Moving | None = None) -> Effect:
        """The effort of friction and damping in all guides along the coordinate; `along` as for pins."""
        w2, loss, constants = w * w, 0.0, self._constants()
        for joint, slide in m.slides.items():
            friction, smooth2, per = constants.get(joint) or constants[None]
            for press in self._presses(m, joint, reactions[joint]):
                _, _, ratio = _friction_terms(xp, press * press, slide.s1, w2, smooth2)
                per = per + friction * ratio
            loss = loss + slide.s1 * (slide if along is None else along.slides[joint]).s1 * per
        return Effect(dissipative=loss * w)

    def slope(
        self,
        xp: Any,
        m: Moving,
        w: Any,
        reactions: Mapping[Joint, Vec2],
        growing: Mapping[Joint, Vec2],
        turning: Mapping[Joint, Any] | None,
    ) -> Any:
        """See `PinLosses.slope`; where the direction is that of q, `turning` is given."""
        w2, rest, slope, constants, by_speed = w * w, 0.0, 0.0, self._constants(), turning is None
        for joint, slide in m.slides.items():
            k, (friction, smooth2, loss) = slide.s1, constants.get(joint) or constants[None]
            presses = self._presses(m, joint, reactions[joint])
            slopes = self._press_slopes(m, joint, reactions[joint], growing[joint], by_speed)
            for press, press_slope in zip(presses, slopes, strict=True):
                k2, minus_per, ratio = _friction_terms(xp, press * press, k, w2, smooth2)
                wider = k2 * w if by_speed else k * slide.s2 * w2
                grows = (ratio * ratio * wider - press * press_slope) * (minus_per / ratio)
                slope = slope + k2 * (friction * grows)
                loss = loss + friction * ratio
            rest = rest + (k * k * loss if by_speed else 2.0 * (k * slide.s2) * loss)
        return slope * w + (rest if by_speed else rest * w)

    def _constants(self) -> dict[Joint | None, tuple[Any, Any, Any]]:
        """By joint, and by None for all others, the friction, the square of the smoothing speed [m2/s2], and the
        damping."""
        return {
            joint: (law.friction, law.v_smooth * law.v_smooth, damping)
            for joint, law, damping in _laws(self.guide, self.damping, self.laws)
        }

    def _presses(self, m: Moving, joint: Joint, reaction: Vec2) -> tuple[Any, ...]:
        """The forces with which a block bears [N]: at its two ends, or the one of a point."""
        n = m.slides[joint].d.turned()
        normal = reaction.dot(n)
        if joint not in self.lengths:
            return (normal,)
        arm = m.pins[joint[0]].p - m.links[joint[1]].pin.p
        return _ends(normal, _couple(reaction) - arm.cross(reaction), self.lengths[joint])

    def _press_slopes(
        self, m: Moving, joint: Joint, reaction: Vec2, growing: Vec2, by_speed: bool
    ) -> tuple[Any, ...]:
        """The derivatives of `_presses` by q, or by the speed; `growing` is the derivative of the reaction in a guide
        that does not turn. By q the guide turns, and the reaction with it, and the arm of the reaction moves."""
        link, n = m.links[joint[1]], m.slides[joint].d.turned()
        normal_slope = growing.dot(n)
        if joint not in self.lengths:
            return (normal_slope,)
        pin = m.pins[joint[0]]
        arm, moment_slope = pin.p - link.pin.p, _couple(growing)
        moment_slope = moment_slope - arm.cross(n * normal_slope)
        if not by_speed:
            turned = reaction.turned() * link.t1
            moment_slope = moment_slope - (pin.p1 - link.pin.p1).cross(reaction) - arm.cross(turned)
        return _ends(normal_slope, moment_slope, self.lengths[joint])


def _couple(reaction: Vec2) -> Any:
    assert isinstance(reaction, GuideForce)
    return reaction.moment


def _ends(normal: Any, moment: Any, length: Any) -> tuple[Any, Any]:
    """The forces at the ends of a block, by the normal force and the moment about its middle."""
    half, couple = 0.5 * normal, moment / length
    return half + couple, half - couple


def _friction_terms(xp: Any, square: Any, slip: Any, w2: Any, smooth2: Any) -> tuple[Any, Any, Any]:
    """The square of the relative rotation or way by q, -1/(k^2 w^2 + smooth^2), and the force, given by its `square`,
    by the root of that, which has a slope at zero, too; one root of the ratio of squares is cheaper than two."""
    k2 = slip * slip
    minus_per = -1.0 / (k2 * w2 + smooth2)
    return k2, minus_per, xp.sqrt(_TINY - square * minus_per)
