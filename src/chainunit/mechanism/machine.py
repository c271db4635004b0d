"""A linkage in motion: one forward pass, one force pass, inertia, torque at constant speed, and its slopes.

Kinematics run forward through the groups. Forces run backward, last group first: the outer reaction of a group is a
point load on the link that carries its pin. All reactions are

    R = R0(q) + R1(q) a + R2(q) w^2 + loads,

so that one pass gives them at constant speed, one by the acceleration, and one, with the slopes of what acts, by the
speed. By the angle the passes run in dual numbers whose parts are known from the motion; the third derivatives alone
are new.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

from ..engines import Dual, dual, slope
from ..groups.body import UNLOADED, Bar, Body, Load, reflected
from ..groups.group import Group, SolvedGroup
from ..groups.loads import Acting, Effect, Joint, Wrench
from ..planar import Link, Motion, Vec2, growth, lifted
from .linkage import Linkage


class _Place(NamedTuple):
    """A group at one position: names of its links, and each joint with the link before the group that it loads."""

    group: Group
    solved: SolvedGroup
    links: tuple[str, ...]
    joints: tuple[tuple[Joint, str | None], ...]


class Mechanism:
    """The links of a linkage at crank angle `q` [rad]: `links`, `pins` with points, and `bodies` by name; `turns` the
    relative rotation in each joint per rotation of the crank; `margin` of each group, 0 in a dead position."""

    __slots__ = ("_carriers", "_solved", "bodies", "linkage", "links", "pins", "turns")

    def __init__(self, xp: Any, linkage: Linkage, q: Any, derived: Sequence[Any] = ()) -> None:
        self._begin(linkage)
        first = 0
        for group in (linkage.crank, *linkage.groups):
            last = first + group.derived
            bars = self._add(group, group.solve(xp, q, self.pins, derived[first:last]))
            first = last
            for bar in bars:
                link = self.links[bar.name]
                for point, (s, t) in bar.points.items():
                    self.pins[point] = link.beside(s, t)
                if bar.mass is not None:
                    self.bodies[bar.name] = Body.on(link, bar.mass)

    def _begin(self, linkage: Linkage) -> None:
        self.linkage = linkage
        self.links: dict[str, Link] = {}
        self.pins = {name: Motion(at) for name, at in linkage.ground.items()}
        self.bodies: dict[str, Body] = {}
        self.turns: dict[Joint, Any] = {}
        self._solved: list[_Place] = []
        self._carriers: dict[str, str] = {}

    def _add(self, group: Group, solved: SolvedGroup) -> tuple[Bar, ...]:
        bars = group.bars
        links, carriers = self.links, self._carriers
        for bar, link in zip(bars, solved.links, strict=True):
            links[bar.name] = link
        inner = group.pins
        self.pins.update(zip(inner, solved.pins, strict=True))
        carriers |= inner
        joints = []
        for joint in group.joints:
            pin, name = joint
            turn, carrier = links[name].t1, carriers.get(pin)
            if carrier is not None:
                turn = turn - links[carrier].t1
            self.turns[joint] = turn
            # forces in the pins of the group itself stay inside it
            joints.append((joint, None if pin in inner else carrier))
        self._solved.append(_Place(group, solved, tuple(bar.name for bar in bars), tuple(joints)))
        for bar in bars:
            for point in bar.points:
                carriers[point] = bar.name
        return bars

    def lifted(self) -> Mechanism:
        """The same with its derivatives by q as dual parts."""
        m = Mechanism.__new__(Mechanism)
        m._begin(self.linkage)
        for group, solved, *_ in self._solved:
            outer = tuple(m.pins[bar.pin] for bar in group.bars if bar.pin)
            for bar in m._add(group, solved.lifted(outer)):
                link = m.links[bar.name]
                for point in bar.points:
                    m.pins[point] = link.lifted_point(self.pins[point])
                if bar.mass is not None:
                    m.bodies[bar.name] = self.bodies[bar.name].lifted(link)
        return m

    def carrier(self, pin: str) -> str:
        """The link that carries a pin or a point."""
        return self._carriers[pin]

    def margins(self) -> list[Any]:
        """Of each group; 0 is a dead position."""
        return [place.solved.margin for place in self._solved[1:]]

    def reactions(self, acting: Mapping[str, Load]) -> tuple[Any, dict[Joint, Vec2]]:
        """The torque along the crank angle [N m] and the force in each joint on its link [N], from what acts on the
        links, without friction: the force pass, independent of virtual work."""
        loads = dict(acting)
        reactions: dict[Joint, Vec2] = {}
        for _, solved, links, joints in reversed(self._solved):
            forces = solved.reactions(tuple(loads.get(name, UNLOADED) for name in links))
            for (joint, carrier), force in zip(joints, forces, strict=True):
                reactions[joint] = force
                if carrier is not None:
                    before, moment = loads.get(carrier, UNLOADED)
                    arm = self.pins[joint[0]].p - self.links[carrier].pin.p
                    loads[carrier] = before - force, moment - arm.cross(force)
        _, torque = loads.get(self.linkage.crank.bar.name, UNLOADED)
        return torque, reactions

    def acting(self, at: Callable[[Body], Load], wrenches: Iterable[Wrench]) -> dict[str, Load]:
        """What acts on each link: of its body by `at`, and of the loads."""
        loads = {name: at(body) for name, body in self.bodies.items()}
        for link, force, moment in wrenches:
            before, moment0 = loads.get(link, UNLOADED)
            loads[link] = before + force, moment0 + moment
        return loads


def _pins(xp: Any, linkage: Linkage, derived: Sequence[Any], q: float) -> dict[str, Motion]:
    return Mechanism(xp, linkage, q, derived).pins


def derived_numbers(xp: Any, linkage: Linkage) -> list[Any]:
    """What the groups derive from the lengths, once before a run."""
    numbers: list[Any] = []
    for k, group in enumerate(linkage.groups):
        numbers += group.derive(xp, partial(_pins, xp, linkage.before(k), tuple(numbers)))
    return numbers


class Steadiness:
    """A mechanism at constant crank speed `w`: the `effects` of the loads on links by name, the `reactions` in the
    joints [N], the `torque` at the crank from these forces [N m], and the `losses` that the reactions set."""

    __slots__ = ("effects", "losses", "reactions", "torque")

    def __init__(self, xp: Any, m: Mechanism, w: Any, loads: Mapping[str, Acting]) -> None:
        w2 = w * w
        self.effects = _effects(xp, m, w, loads)
        acting = m.acting(lambda body: body.centrifugal(w2), _wrenches(self.effects))
        self.torque, self.reactions = m.reactions(acting)
        self.losses = _effects(xp, m, w, loads, self.reactions)


def _effects(
    xp: Any,
    m: Mechanism,
    w: Any,
    loads: Mapping[str, Acting],
    reactions: dict[Joint, Vec2] | None = None,
) -> dict[str, Effect]:
    """Effects of the loads that act on links; or, with the reactions, of those that follow from them."""
    late = reactions is not None
    return {
        name: load.effect(xp, m, w, reactions or {})
        for name, load in loads.items()
        if load.by_reactions == late
    }


def _wrenches(effects: Mapping[str, Effect]) -> Iterator[Wrench]:
    for effect in effects.values():
        yield from effect.wrenches


class MachineState:
    """A linkage at one crank angle and speed: the mechanism `m`, its inertia `J` [kg m2], `dJ` the derivative of the
    bodies' part by the angle, the effect of each load by name, and the torque at constant speed `bias` [N m], by
    virtual work."""

    __slots__ = ("J", "_by_acceleration", "_loads", "_xp", "bias", "dJ", "effects", "m", "steady", "w")

    def __init__(self, xp: Any, m: Mechanism, w: Any, loads: Mapping[str, Acting] | None = None) -> None:
        """
        Parameters
        ----------
        xp : engine (see `chainunit.engines`)
        w : speed of the crank [rad/s]
        loads : others than those of the linkage
        """
        self._xp, self.m, self.w = xp, m, w
        self._loads = m.linkage.loads if loads is None else loads
        self.J, self.dJ = reflected(m.bodies.values())
        self.steady = Steadiness(xp, m, w, self._loads)
        self.effects = self.steady.effects | self.steady.losses
        bias = 0.5 * self.dJ * (w * w)
        for effect in self.effects.values():
            bias = bias + (effect.held + effect.lost)
            self.J = self.J + effect.inertia
        self.bias = bias
        self._by_acceleration: tuple[Any, dict[Joint, Vec2]] | None = None

    def torque(self, a: Any) -> Any:
        """The crank torque at crank acceleration `a` [N m], by virtual work."""
        return self.J * a + self.bias

    def _inertial(self) -> tuple[Any, dict[Joint, Vec2]]:
        if self._by_acceleration is None:
            wrenches = (k for effect in self.effects.values() for k in effect.inertial)
            self._by_acceleration = self.m.reactions(self.m.acting(Body.inertial, wrenches))
        return self._by_acceleration

    def reactions(self, a: Any) -> dict[Joint, Vec2]:
        """The force in each joint on its link at crank acceleration `a` [N], without friction."""
        _, inertial = self._inertial()
        return {joint: force + inertial[joint] * a for joint, force in self.steady.reactions.items()}

    def torque_by_reactions(self, a: Any) -> Any:
        """The crank torque from the forces, group by group, without friction [N m]: the second route."""
        return self.steady.torque + self._inertial()[0] * a

    @property
    def kinetic_energy(self) -> Any:
        """[J]"""
        return 0.5 * self.J * (self.w * self.w)

    @property
    def held_energy(self) -> Any:
        """Potential energy of all loads [J]."""
        return sum(effect.energy for effect in self.effects.values())

    @property
    def lost(self) -> Any:
        """Torque at the crank that loads take away [N m]; times `w` it is the power that is lost."""
        return sum(effect.lost for effect in self.effects.values())

    def margin(self) -> Any:
        """The least margin of all groups in size."""
        xp, (first, *others) = self._xp, self.m.margins()
        least = xp.abs(first)
        for margin in others:
            least = xp.minimum(least, xp.abs(margin))
        return least

    def slopes(self) -> tuple[Any, Any]:
        """Derivatives of `bias` by the crank angle [N m/rad] and the crank speed [N m s/rad], by the second route:
        the force pass is differentiated for the losses in any case, and its torque comes with it."""
        return self._by_angle(), self._by_speed()

    def _by_angle(self) -> Any:
        steady = Steadiness(dual(self._xp), self.m.lifted(), self.w, self._loads)
        return slope(steady.torque) + _growing(steady.losses)

    def _by_speed(self) -> Any:
        """The geometry stays: what acts is differentiated, and the force pass is linear in it."""
        xp, m, quick, loads = dual(self._xp), self.m, Dual(self.w, 1.0), self._loads
        wrenches = _wrenches(_effects(xp, m, quick, loads))
        growing = (Wrench(k.link, growth(k.force), slope(k.moment)) for k in wrenches)
        torque, more = m.reactions(m.acting(lambda body: body.centrifugal(2.0 * self.w), growing))
        reactions = {joint: lifted(force, more[joint]) for joint, force in self.steady.reactions.items()}
        return torque + _growing(_effects(xp, m, quick, loads, reactions))


def _growing(losses: Mapping[str, Effect]) -> Any:
    return sum(slope(loss.lost) for loss in losses.values())
