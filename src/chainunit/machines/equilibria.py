"""The equilibria of a machine under its loads, the torque that holds it elsewhere, and its natural frequency about a
stable equilibrium.

At rest, J(q) a = -tau_bias(q, 0): the torque at constant speed is the torque that holds the machine, and the slope of
its effective potential U(q), the integral of the holding torque over the way. An equilibrium is a zero of the holding
torque. It is stable where U has a minimum. The stiffness k there is the curvature of U, d tau_bias/dq, an exact
derivative; a small swing about a minimum has the frequency sqrt(k/J). All quantities are those at the driver, with
its inertia alone, without friction and damping, which are zero at rest.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, ClassVar, NamedTuple

import numpy as np

from ..core.brief import briefly_shown
from ..core.engines import numpy_
from ..core.quantities import Value, declaration, quantity
from ..groups.loads import GuideLosses, PinLosses
from ..mechanism.machine import MachineState
from ..mechanism.models import InverseMachine
from ..mechanism.sampled_quantities import largest
from ..mechanism.zeros import SampledCurve, Zero, sampled, zeros
from ..reading.results import part, result

STABLE, UNSTABLE, SADDLE, INDIFFERENT, STOP = "stable", "unstable", "saddle", "indifferent", "stop"
_NOTHING = 1e-11
"""Holding torque in parts of the largest torque of a single load, below which it is rounding."""
_FLAT, _LIGHT = 1e-7, 1e-12
"""Stiffness in parts of the largest torque of a load over the way, and inertia in parts of the largest inertia, below
which they are none."""
_CLOSES = 1e-6
"""Work of a turn in parts of the largest torque, below which it is none."""
_SLIDING = 1e6
"""Speed of the driver [rad/s, m/s] at which smoothed friction has its full size."""
_LEVEL = 1e-13
"""Potential in parts of the largest torque of a load over the way, below which it is rounding."""
_TURN = 2.0 * math.pi
_ODD = 0.8971
"""Angle [rad] between the places at which a load is compared with that a turn later."""
_SAME = 1e-9
"""Angle [rad] within which two places are one."""


@result
class Equilibrium:
    """An equilibrium of a machine under its loads; in units of a driver that turns."""

    AT_DRIVER: ClassVar = ("place", "end", "holding", "stiffness", "inertia", "friction")

    kind: str = part(
        "stable (the potential has a minimum), unstable (a maximum), saddle (the machine leaves it to one side and "
        "comes back from the other), indifferent (no torque over a range), stop (the driver rests on its end stop)"
    )
    place: Value = quantity("rad", "place of the driver")
    end: Value = quantity("rad", "end of the range, where it is indifferent; else the place")
    holding: Value = quantity("N.m", "holding torque there: 0, or at a stop the torque that the stop takes")
    stiffness: Value = quantity(
        "N.m/rad", "stiffness: slope of the holding torque; none at a stop, and where it jumps"
    )
    inertia: Value = quantity("kg.m2", "reflected inertia there")
    natural_frequency: Value = quantity(
        "rad/s", "natural frequency of a small swing, undamped", kind="frequency"
    )
    frequency: Value = quantity("Hz", "the same in swings per second")
    potential: Value = quantity(
        "J", "potential above its least one over the way; none where it does not close"
    )
    friction: Value = quantity("N.m", "torque that friction of the joints holds there")

    @property
    def stable(self) -> bool:
        """Whether the machine swings about it after a small push."""
        return self.kind == STABLE


@declaration
class Holding:
    """The torque that holds a machine at rest over the way of its driver."""

    AT_DRIVER: ClassVar = ("peak", "peak_at", "friction")

    peak: Value = quantity("N.m", "largest in size")
    peak_at: Value = quantity("rad", "at")
    work: Value = quantity("J", "work over the way")
    friction: Value = quantity("N.m", "largest that friction of the joints holds")


class Rest(NamedTuple):
    """A machine at rest at places of its driver, arrays of shape (n,) in units of a driver that turns: the place `q`
    [rad], the `holding` torque and that which `friction` of pins and guides holds [N m], the `inertia` [kg m2], and
    the `potential` above its least one [J], None if it does not close in a turn."""

    q: Any
    holding: Any
    friction: Any
    inertia: Any
    potential: Any


@briefly_shown
@dataclass(frozen=True)
class Equilibria:
    """All equilibria of a machine over the way of its driver, in rising order, and its holding torque."""

    places: tuple[Equilibrium, ...]
    summary: Holding
    rest: Rest
    """over the way, closer where the holding torque changes sharply"""
    driven: tuple[str, ...]
    """names of the loads without a potential of their own; theirs is the integral of their torque over the way"""
    repeats: bool
    """whether the loads of a driver that turns are the same again after a turn"""

    @property
    def stable(self) -> tuple[Equilibrium, ...]:
        """Those about which the machine swings."""
        return tuple(place for place in self.places if place.stable)

    @property
    def indifferent(self) -> bool:
        """Whether the machine stays wherever it is, as no load has a torque at the driver."""
        return len(self.places) == 1 and self.places[0].kind == INDIFFERENT and not self.summary.peak


class _AtRest:
    """A machine at rest at places of its driver."""

    def __init__(self, machine: Any, feed: Any) -> None:
        self.machine = machine
        self.feed = machine.model.feed_layout.by_name(machine.model.Feed() if feed is None else feed)

    def state(self, q: Any) -> MachineState:
        """The linkage at the places `q` [rad, m]."""
        machine = self.machine
        state: MachineState = machine.state(machine.inputs({"phi": q * machine.ratio, "w": 0.0, **self.feed}))
        return state

    def torque(self, q: Any) -> tuple[Any, Any]:
        """The holding torque [N m] and its slope [N m/rad], each of the shape of `q`."""
        state = self.state(q)
        slope, _ = state.slopes()
        return np.broadcast_to(state.bias, q.shape), np.broadcast_to(slope, q.shape)


def equilibria(machine: Any, feed: Any = None) -> Equilibria:
    """All equilibria of a machine under its weight, its springs and its loads at rest, over the way of its driver: a
    whole turn, or its range.

    The holding torque is taken at places that lie close enough for all its zeros and extremes (see
    `chainunit.mechanism.zeros`), so that no equilibrium is missed. A force that depends on the speed has its value at
    the speed 0. Where the loads of a driver that turns do not repeat themselves, the way is half a turn to either
    side of its start.

    Parameters
    ----------
    machine : a `chainunit.machines.machine.Machine` whose outputs do not depend on states
    feed : its loads, an instance of `machine.model.Feed`; by default those of normal running

    Raises
    ------
    InputError
        for a load out of its bounds.
    TypeError
        for a machine whose outputs depend on states.
    """
    resting = _AtRest(machine, feed)
    model: InverseMachine = machine.model
    q = np.linspace(*model.span, 361)
    state = resting.state(q)
    size = _size(state, q)
    nothing = _NOTHING * size
    (low, high), repeats = _way(resting, q, np.broadcast_to(state.bias, q.shape), nothing)
    around = model.turns and repeats
    curve = sampled(resting.torque, low, high)
    # a driver on its stop is pushed back by it; without any torque the whole way is one zero
    beyond = None if model.turns else (-1.0, 1.0)
    everywhere = [Zero(float(curve.x[0]), float(curve.x[-1]), 0.0, 0.0)]
    is_idle = np.all(np.abs(curve.values) <= nothing)
    crossings = everywhere if is_idle else zeros(resting.torque, curve, nothing, beyond)
    effects = resting.state(curve.x).effects
    driven = tuple(name for name, load in effects.items() if np.max(np.abs(load.dissipative)) > nothing)
    places = np.array([x for zero in crossings for x in (zero.begin, zero.end)])
    rest, work = _rest(resting, curve, places, not driven, around)
    closes = abs(work) <= _CLOSES * size * (high - low)
    if around and not closes:
        rest = rest._replace(potential=None)
    flat, level = _FLAT * size / (high - low), _LEVEL * size * (high - low)
    way = _Judged(low, high, not model.turns, nothing, flat, _LIGHT * float(np.max(state.J)), level)
    places_of_rest = [_equilibrium(resting, zero, rest, way) for zero in crossings]
    if around:
        rest = _from_start(rest, model.span[0])
        places_of_rest = [_folded(equilibrium) for equilibrium in places_of_rest]
    peak, peak_at = _peak(resting, way, around)
    work, friction = 0.0 if closes else work, float(np.max(rest.friction))
    summary = Holding(peak=peak, peak_at=peak_at, work=work, friction=friction)
    ascending = sorted(places_of_rest, key=lambda equilibrium: equilibrium.place)
    return Equilibria(tuple(ascending), summary, rest, driven, repeats)


def _way(resting: _AtRest, q: Any, holding: Any, nothing: float) -> tuple[tuple[float, float], bool]:
    """The ends of the way on which equilibria are sought, and whether the loads are the same after a turn. A turn of
    such loads begins where the `holding` torque at the places `q` is largest, so that no zero lies at its begin."""
    model = resting.machine.model
    low, high = model.span
    if not model.turns:
        return (low, high), True
    # no round angles, at which a torque may jump
    odd = low + _ODD * np.arange(1, 8)
    gap = resting.torque(odd + _TURN)[0] - resting.torque(odd)[0]
    if not np.all(np.abs(gap) <= 1e3 * nothing):
        return (low - 0.5 * _TURN, low + 0.5 * _TURN), False
    first = int(np.argmax(np.abs(holding)))
    low = float(q[first]) if abs(holding[first]) > nothing else low
    return (low, low + _TURN), True


def _peak(resting: _AtRest, way: _Judged, around: bool) -> tuple[float, float]:
    """The holding torque that is largest in size [N m], and its place [rad]."""
    q = np.linspace(way.low, way.high, 361)
    at_peak, _ = largest(lambda x: np.abs(resting.torque(x)[0])[None], q, around=around)
    peak, place = float(resting.torque(at_peak)[0][0]), float(at_peak[0])
    if abs(peak) <= way.nothing:
        peak, place = 0.0, resting.machine.model.span[0]
    return peak, place % _TURN if around else place


def _size(state: MachineState, q: Any) -> float:
    """The largest torque of a single load, or of the weight of a single body, at the places `q` [N m]."""
    sizes = [np.abs(effect.field) * body.m * np.abs(body.c.p1.y)
             for effect in state.effects.values() for body in state.m.bodies.values()]  # fmt: skip
    sizes += [np.abs(effect.conservative) + np.abs(effect.dissipative)
              for effect in state.effects.values()]  # fmt: skip
    return max((float(np.max(np.broadcast_to(size, q.shape))) for size in sizes), default=0.0)


def friction_torque(state: MachineState) -> Any:
    """The torque that friction of the joints holds at the driver [N m], of the shape of the state: each slips
    with its reaction at rest, which is without friction."""
    losses = [loss for loss in state.m.linkage.loads.values() if isinstance(loss, PinLosses | GuideLosses)]
    return sum(
        share * loss._replace(damping=0.0).effect(
            numpy_(), state.m, _SLIDING, state.steady.reactions, along
        ).dissipative
        for loss in losses for share, along in state.directions
    )  # fmt: skip


_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)


def _rest(
    resting: _AtRest, curve: SampledCurve, places: Any, conservative: bool, around: bool
) -> tuple[Rest, float]:
    """The machine at rest at the places of the curve and at further `places`, and the work of the holding torque over
    the way [J]. The potential is the energy of weights and springs with the integral of all other torque."""
    x = np.unique(np.concatenate([curve.x, places]))
    state = resting.state(x)
    bias, inertia, energy, friction = (
        np.broadcast_to(course, x.shape).copy()
        for course in (state.bias, state.J, state.potential_energy, friction_torque(state))
    )
    potential = energy
    if not conservative:
        half = 0.5 * np.diff(x)
        nodes = 0.5 * (x[1:] + x[:-1])[:, None] + half[:, None] * _NODES
        lost = np.broadcast_to(resting.state(nodes.ravel()).lost_torque, nodes.size)
        parts = (lost.reshape(nodes.shape) @ _WEIGHTS) * half
        potential = energy + np.concatenate([[0.0], np.cumsum(parts)])
    elif around:
        potential[-1] = potential[0]
    work = float(potential[-1] - potential[0])
    return Rest(x, bias, friction, inertia, potential - np.min(potential)), work


class _Judged(NamedTuple):
    """What counts as none on a way from `low` to `high`, with `stops` at both or without: a torque of `nothing`
    [N m], a `flat` stiffness [N m/rad], a `light` inertia [kg m2], a `level` potential [J]."""

    low: float
    high: float
    stops: bool
    nothing: float
    flat: float
    light: float
    level: float


def _equilibrium(resting: _AtRest, zero: Zero, rest: Rest, way: _Judged) -> Equilibrium:
    """The equilibrium at a `zero` of the holding torque: its kind by the signs of the torque before and after it, and
    by stops and jumps; its stiffness, the slope of the torque; and, if it is stable, its natural frequency. `rest`
    has inertia, energy and friction at the places, `way` the sizes below which a number counts as 0."""
    kind = {(-1.0, 1.0): STABLE, (1.0, -1.0): UNSTABLE}.get((zero.before, zero.behind), SADDLE)
    (holding,), (slope,) = resting.torque(np.array([zero.begin]))
    k = int(np.searchsorted(rest.q, zero.begin))
    stiffness: float | None = float(slope) if abs(slope) > way.flat else 0.0
    if zero.end > zero.begin:
        kind, stiffness = INDIFFERENT, 0.0
    elif way.stops and zero.begin in (way.low, way.high) and abs(holding) > way.nothing:
        kind, stiffness = STOP, None
    elif stiffness and kind in (STABLE, UNSTABLE) and (stiffness > 0.0) != (kind == STABLE):
        # the torque jumps over zero, as that of a spring whose ends meet
        stiffness = None
    inertia, w = float(rest.inertia[k]), None
    if kind == STABLE and stiffness and stiffness > 0.0 and inertia > way.light:
        w = math.sqrt(stiffness / inertia)
    potential = None if rest.potential is None else float(rest.potential[k])
    if potential is not None and potential <= way.level:
        potential = 0.0
    return Equilibrium(
        kind=kind,
        place=zero.begin,
        end=zero.end,
        holding=float(holding) if kind == STOP else 0.0,
        stiffness=stiffness,
        inertia=inertia,
        natural_frequency=w,
        frequency=None if w is None else w / _TURN,
        potential=potential,
        friction=float(rest.friction[k]),
    )


def _folded(equilibrium: Equilibrium) -> Equilibrium:
    """An equilibrium of a driver that turns, with its place from 0 to a whole turn."""
    place = equilibrium.place % _TURN
    place = 0.0 if min(place, _TURN - place) < _SAME else place
    return replace(equilibrium, place=place, end=place + (equilibrium.end - equilibrium.place))


def _from_start(rest: Rest, start: float) -> Rest:
    """A turn from the `start` on, in place of one that begins elsewhere; the last place is the first one again."""
    q = start + (rest.q[:-1] - start + _SAME) % _TURN - _SAME
    order = np.argsort(q)
    q = q[order]
    q[0] = start if abs(q[0] - start) < 2.0 * _SAME else q[0]
    columns = [
        None if column is None else np.append(column[:-1][order], column[:-1][order[0]])
        for column in rest[1:]
    ]
    return Rest(np.append(q, q[0] + _TURN), *columns)
