"""A linkage in motion: one forward pass, one force pass, inertia, torque at constant speed, and its slopes.

Kinematics run forward through the groups. Forces run backward, last group first: the outer reaction of a group is a
point load on the link that carries its pin. All reactions are

    R = R0(q) + R1(q) a + R2(q) w^2 + loads,

so that one pass gives them at constant speed and one pass their derivatives by the acceleration. A third pass, with
the slopes of the loads, gives the derivatives by the speed. The derivatives by the angle need dual numbers; their
parts are known from the motion, except for the third derivatives.
"""

from __future__ import annotations

import copy
import functools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from ..core.engines import Dual, dual, slope
from ..core.planar import ZERO, Link, Motion, Vec2, growth
from ..groups.body import NO_LOAD, Body, Load, body_on, reflected_inertia
from ..groups.driver import Crank, Ram
from ..groups.group import Group, SolvedGroup
from ..groups.joints import STEADY, Joint, Slide, Third
from ..groups.loads import Effect, Moving, Wrench
from .linkage import Connections, Linkage, Topology


class Mechanism:
    """The links of a linkage with its first driver at the place `q`, a crank angle [rad] or a way [m]: `links`,
    `pins` with points, and `bodies` by name; `turns` the relative rotation in each revolute joint by q, `slides` the
    motion in each sliding one."""

    def __init__(
        self, xp: Any, linkage: Linkage, q: Any, derived: Sequence[Any] = (), topology: Topology | None = None
    ) -> None:
        """
        Parameters
        ----------
        xp : engine (see `chainunit.core.engines`)
        derived : numbers that the groups derive from the lengths, see `derived_numbers`
        topology : the topology of the linkage, if it is known
        """
        self.linkage, self.q, self.derived = linkage, q, derived
        self.topology = linkage.topology if topology is None else topology
        self.links: dict[str, Link] = {}
        self.pins = {name: Motion(place) for name, place in linkage.ground.items()}
        self.bodies: dict[str, Body] = {}
        self.turns: dict[Joint, Any] = {}
        self.slides: dict[Joint, Slide] = {}
        self._groups: list[tuple[SolvedGroup, Connections]] = []
        links, pins, first = self.links, self.pins, 0
        for group, connections in zip(self._data, self.topology.groups, strict=True):
            last = first + group.derived_count
            solved = group.solve(xp, q, self, derived[first:last])
            first = last
            self._groups.append((solved, connections))
            pins.update(zip(connections.pins, solved.pins, strict=True))
            for bar, link in zip(group.bars, solved.links, strict=True):
                links[bar.name] = link
                for point, (s, t) in bar.points.items():
                    pins[point] = link.beside(s, t)
                if bar.mass is not None:
                    self.bodies[bar.name] = body_on(link, bar.mass)
            self.slides.update(zip(connections.guides, solved.slides, strict=True))
            for joint, carrier, _ in connections.hinges:
                turn = links[joint[1]].t1
                self.turns[joint] = turn if carrier is None else turn - links[carrier].t1

    @property
    def _data(self) -> tuple[Group, ...]:
        return self.linkage.driver, *self.linkage.groups

    @property
    def _driven(self) -> list[tuple[SolvedGroup, Connections]]:
        """The drivers, in their order."""
        return [(solved, connections) for solved, connections in self._groups if solved.course is not None]

    @property
    def rate(self) -> Any:
        """See `Moving`."""
        return self.courses[0][0]

    @property
    def courses(self) -> tuple[Sequence[Any], ...]:
        """The derivatives of the place of each driver by q."""
        return tuple(solved.course for solved, _ in self._groups if solved.course is not None)

    def along(self, efforts: Sequence[Any], order: int = 0) -> Any:
        """The effort along q [N m, N] from the `efforts` of the drivers along their places, or with `order` 1 its
        derivative while they are constant."""
        total: Any = 0.0
        for effort, course in zip(efforts, self.courses, strict=True):
            if course is not STEADY:
                total = total + effort * course[order]
            elif order == 0:
                total = effort
        return total

    def with_bodies(self, linkage: Linkage) -> Mechanism:
        """The same motion with the bodies and loads of another linkage of the same lengths."""
        other = copy.copy(self)
        other.linkage = linkage
        bars = (bar for group in other._data for bar in group.bars if bar.mass is not None)
        other.bodies = {bar.name: body_on(self.links[bar.name], bar.mass) for bar in bars}
        return other

    def third_derivatives(self) -> tuple[dict[str, Third], dict[str, Vec2]]:
        """Third derivatives by q of each link and of each pin that is not in the ground."""
        pins: dict[str, Vec2] = {}
        thirds: dict[str, Third] = {}
        for group, (solved, connections) in zip(self._data, self._groups, strict=True):
            before = [joint.third_before(self, thirds, pins) for joint in group.joints]
            links, inner = solved.third_derivatives(before)
            thirds.update(zip(connections.links, links, strict=True))
            pins.update(zip(connections.pins, inner, strict=True))
            for name in connections.links:
                link = self.links[name]
                for point in self.topology.points[name]:
                    pins[point] = link.third_derivative(self.pins[point].p - link.pin.p, *thirds[name])
        return thirds, pins

    def reaction_turn(self, reactions: Mapping[Joint, Vec2], efforts: Sequence[Any]) -> Iterator[Wrench]:
        """The part of the reactions in the moments on the links as their arms turn with q, and in the forces as the
        guides turn."""
        # the force of a cylinder turns with it
        for (driver, connections), effort in zip(self._driven, efforts, strict=True):
            barrel, *rod = driver.links
            if rod and connections.guides:
                more = barrel.u.turned() * (effort * barrel.t1)
                yield Wrench(connections.links[1], more, 0.0)
                yield Wrench(connections.links[0], -more, 0.0)
        for group, (_, connections) in zip(self._data, self._groups, strict=True):
            for joint, connected in zip(group.joints, connections.joints, strict=True):
                reaction = reactions[connected.joint]
                for link, (force, moment) in joint.turning(self, connected.carrier, reaction):
                    yield Wrench(link, force, moment)

    def carrier(self, pin: str) -> str:
        """The link that carries a pin or a point."""
        return self.topology.carries[pin]

    def turns2(self) -> dict[Joint, Any]:
        """The derivatives of `turns` by q."""
        slopes = {}
        for _, connections in self._groups:
            for joint, carrier, _ in connections.hinges:
                t2 = self.links[joint[1]].t2
                slopes[joint] = t2 if carrier is None else t2 - self.links[carrier].t2
        return slopes

    def margins(self) -> list[Any]:
        """The margin of each group; 0 is a dead position."""
        alone = isinstance(self.linkage.driver, Crank | Ram)
        return [solved.margin for solved, _ in self._groups[alone:]]

    def reactions(self, acting: Mapping[str, Load]) -> tuple[tuple[Any, ...], dict[Joint, Vec2]]:
        """The torque (or force) of each driver along its place [N m, N] and the force in each joint on its link [N],
        from what acts on the links, without friction: the force pass, independent of virtual work."""
        loads, efforts = dict(acting), list[Any]()
        reactions: dict[Joint, Vec2] = {}
        for group, (solved, connections) in zip(reversed(self._data), reversed(self._groups), strict=True):
            forces, effort = solved.reactions([loads.get(name, NO_LOAD) for name in connections.links])
            for joint, connected, force in zip(group.joints, connections.joints, forces, strict=True):
                reactions[connected.joint] = force
                if connected.before is not None:
                    opposite = joint.opposite(self, connected.before, force)
                    add_wrenches(loads, [Wrench(connected.before, *opposite)])
            if solved.course is not None:
                efforts.append(effort)
        return tuple(reversed(efforts)), reactions


def add_wrenches(loads: dict[str, Load], wrenches: Iterable[Wrench]) -> dict[str, Load]:
    """Add the wrenches to the action on each link, in place; the same dictionary is returned."""
    for link, force, moment in wrenches:
        before, moment0 = loads.get(link, NO_LOAD)
        loads[link] = before + force, moment0 + moment
    return loads


class _OnDemand(dict[str, Any]):
    """Values that are computed at their first use: loads use few of them."""

    def __init__(self, make: Callable[[str], Any]) -> None:
        super().__init__()
        self._make = make

    def __missing__(self, name: str) -> Any:
        value = self[name] = self._make(name)
        return value


class LiftedMechanism:
    """A mechanism in the form that loads take (`Moving`), with its derivatives by q as dual parts."""

    __slots__ = ("_of", "bodies", "links", "pins", "q", "rate", "slides", "turns")

    def __init__(self, m: Mechanism, links: Mapping[str, Third], pins: Mapping[str, Vec2]) -> None:
        """
        Parameters
        ----------
        links, pins : third derivatives of the links and pins, see `Mechanism.third`
        """
        self._of, self.q, self.rate = m, Dual(m.q, 1.0), m.rate
        self.links: Mapping[str, Link] = _OnDemand(lambda name: m.links[name].lifted(*links[name]))
        self.pins: Mapping[str, Motion] = _OnDemand(lambda name: m.pins[name].lifted(pins.get(name, ZERO)))
        self.bodies: Mapping[str, Body] = {}
        self.turns: Mapping[Joint, Any] = {}
        self.slides: Mapping[Joint, Slide] = {}

    def carrier(self, pin: str) -> str:
        """The link that carries a pin or a point."""
        return self._of.carrier(pin)


def derived_numbers(xp: Any, linkage: Linkage) -> list[Any]:
    """Values that follow from the lengths, once before a run: of the groups, then of the extremes."""
    numbers: list[Any] = []
    for k, group in enumerate(linkage.groups):
        numbers += group.derive(
            xp, functools.partial(Mechanism, xp, linkage.before(k), derived=tuple(numbers))
        )
    if linkage.extremes:
        placed = functools.partial(Mechanism, xp, linkage, derived=tuple(numbers), topology=linkage.topology)
        numbers += [extreme.value(xp, placed) for extreme in linkage.extremes]
    return numbers


class Steadiness:
    """A mechanism at constant crank speed `w`: the `effects` of the loads on links by name, the `reactions` in the
    joints [N], the `efforts` of the drivers and the `torque` along q from these forces [N m], and the `losses`: the
    effects of the loads that depend on the reactions."""

    __slots__ = ("effects", "efforts", "field", "losses", "reactions", "torque")

    def __init__(self, xp: Any, m: Mechanism, w: Any, loads: Mapping[str, Any]) -> None:
        w2 = w * w
        self.effects = _effects(xp, m, w, loads)
        field = self.field = sum(effect.field for effect in self.effects.values())
        acting = {name: body.centrifugal(w2, field) for name, body in m.bodies.items()}
        self.efforts, self.reactions = m.reactions(add_wrenches(acting, _wrenches(self.effects)))
        self.torque = m.along(self.efforts)
        self.losses = _effects(xp, m, w, loads, self.reactions)


def _effects(
    xp: Any, m: Moving, w: Any, loads: Mapping[str, Any], reactions: dict[Joint, Vec2] | None = None
) -> dict[str, Effect]:
    """Effects of the loads that act on links or, if the reactions are given, of the loads that depend on them."""
    late = reactions is not None
    return {
        name: load.effect(xp, m, w, reactions or {})
        for name, load in loads.items()
        if load.by_reactions == late
    }


def _wrenches(effects: Mapping[str, Effect]) -> Iterator[Wrench]:
    for effect in effects.values():
        yield from effect.wrenches


class InMotion(NamedTuple):
    """A linkage in motion: its mechanism, the force in each joint on its link [N], the effects of its loads, and
    speed and acceleration of the coordinate of the mechanism."""

    m: Mechanism
    reactions: Mapping[Joint, Vec2]
    effects: Mapping[str, Effect]
    w: Any
    a: Any


class MachineState:
    """A linkage at one crank angle and speed: the mechanism `m`, its inertia `J` [kg m2], the derivative `dJ` of the
    bodies' part of it by the angle, the effect of each load by name, and the torque at constant speed `bias` [N m],
    by virtual work."""

    __slots__ = ("J", "_by_acceleration", "_loads", "_xp", "bias", "dJ", "effects", "m", "steady", "w")

    def __init__(self, xp: Any, m: Mechanism, w: Any, loads: Mapping[str, Any] | None = None) -> None:
        """
        Parameters
        ----------
        xp : engine (see `chainunit.core.engines`)
        w : speed of the crank [rad/s]
        loads : loads in place of the linkage's own
        """
        self._xp, self.m, self.w = xp, m, w
        self._loads = m.linkage.loads if loads is None else loads
        self.J, self.dJ = reflected_inertia(m.bodies.values())
        self.steady = Steadiness(xp, m, w, self._loads)
        self.effects = self.steady.effects | self.steady.losses
        bias = 0.5 * self.dJ * (w * w)
        for effect in self.effects.values():
            bias = bias + (effect.conservative + effect.dissipative)
            self.J = self.J + effect.inertia
        self.bias = bias
        self._by_acceleration: tuple[tuple[Any, ...], dict[Joint, Vec2]] | None = None

    def torque(self, a: Any) -> Any:
        """The crank torque at crank acceleration `a` [N m], by virtual work."""
        return self.J * a + self.bias

    def inertial(self) -> tuple[tuple[Any, ...], dict[Joint, Vec2]]:
        """The efforts of the drivers and the reactions per acceleration of q, without friction."""
        if self._by_acceleration is None:
            wrenches = (k for effect in self.effects.values() for k in effect.inertial)
            acting = {name: body.inertial() for name, body in self.m.bodies.items()}
            self._by_acceleration = self.m.reactions(add_wrenches(acting, wrenches))
        return self._by_acceleration

    def reactions(self, a: Any) -> dict[Joint, Vec2]:
        """The force in each joint on its link at crank acceleration `a` [N], without friction."""
        _, inertial = self.inertial()
        return {joint: force.plus(inertial[joint], a) for joint, force in self.steady.reactions.items()}

    def moving(self, a: Any) -> InMotion:
        """The linkage in motion at crank acceleration `a`."""
        return InMotion(self.m, self.reactions(a), self.effects, self.w, a)

    def torque_by_reactions(self, a: Any) -> Any:
        """The crank torque from the force passes, without friction [N m]: the second route."""
        return self.steady.torque + self.m.along(self.inertial()[0]) * a

    @property
    def inertia_slope(self) -> Any:
        """The derivative of `J` by the crank angle [kg m2/rad]."""
        return self.dJ

    @property
    def kinetic_energy(self) -> Any:
        """Kinetic energy [J]."""
        return 0.5 * self.J * (self.w * self.w)

    @property
    def potential_energy(self) -> Any:
        """Potential energy of all loads [J]."""
        return sum(effect.energy for effect in self.effects.values())

    @property
    def directions(self) -> list[tuple[Any, Mechanism | None]]:
        """The motions along which losses load the first driver, each with its share; None is the motion itself."""
        return [(1.0, None)]

    @property
    def friction(self) -> Any:
        """Torque at the crank against the loads that depend on reactions [N m]."""
        return sum(effect.dissipative for effect in self.steady.losses.values())

    @property
    def lost_torque(self) -> Any:
        """Torque at the crank against all dissipative loads [N m]; times `w` it is the lost power."""
        return sum(effect.dissipative for effect in self.effects.values())

    @property
    def lost_power(self) -> Any:
        """Power that all dissipative loads take [W]."""
        return self.lost_torque * self.w

    def margin(self) -> Any:
        """The least absolute margin of all groups; 1 for a crank alone, which has no dead position."""
        xp = self._xp
        sizes = [xp.abs(margin) for margin in self.m.margins()]
        return functools.reduce(xp.minimum, sizes) if sizes else 1.0

    def slopes(self) -> tuple[Any, Any]:
        """Derivatives of `bias` by the crank angle [N m/rad] and the crank speed [N m s/rad], at fixed states of
        chains.

        They come by the second route, since the losses need the slopes of all reactions anyway. The sums of forces
        and moments on each link are zero, and so are their derivatives: a force pass with the slopes of the loads
        gives the slopes of the reactions and of the torque. For the derivative by the angle the present reactions add
        moments, as their arms turn.
        """
        m = self.m
        if not any(group.shares for group in m.linkage.groups):
            return self._by_angle(), self._by_speed()
        # a force that legs share depends on how these turn, too
        xp = dual(self._xp)
        moved = Mechanism(xp, m.linkage, Dual(m.q, 1.0), m.derived, m.topology)
        return slope(MachineState(xp, moved, self.w, self._loads).bias), self._by_speed()

    def _by_angle(self) -> Any:
        """The slope over the place of the first driver, which the further ones follow."""
        m, w2, field = self.m, self.w * self.w, self.steady.field
        links, pins = m.third_derivatives()
        acting = {name: body.centrifugal_slope(w2, field, links[name]) for name, body in m.bodies.items()}
        add_wrenches(acting, m.reaction_turn(self.steady.reactions, self.steady.efforts))
        slope = self._slope(LiftedMechanism(m, links, pins), self.w, acting, m.turns2())
        return slope if len(m.courses) == 1 else slope + m.along(self.steady.efforts, 1)

    def _by_speed(self) -> Any:
        acting = {name: body.centrifugal(2.0 * self.w) for name, body in self.m.bodies.items()}
        return self._slope(self.m, Dual(self.w, 1.0), acting, None)

    def _slope(
        self, moving: Any, w: Any, acting: dict[str, Load], turning: Mapping[Joint, Any] | None
    ) -> Any:
        """The slope of `bias` in the direction of the dual parts of `moving` and `w`, with the slopes of the action
        on the bodies and of the rotations in the joints."""
        m, reactions = self.m, self.steady.reactions
        effects = _effects(dual(self._xp), moving, w, self._loads)
        growing = (Wrench(k.link, growth(k.force), slope(k.moment)) for k in _wrenches(effects))
        efforts, more = m.reactions(add_wrenches(acting, growing))
        torque = m.along(efforts)
        for load in self._loads.values():
            if load.by_reactions:
                torque = torque + load.slope(self._xp, m, self.w, reactions, more, turning)
        return torque
