"""Equilibria of a machine at rest: the places at which its driver needs no effort, and the effort that holds it
elsewhere.

At rest the driver needs the torque tau(q) = dW/dq, where W is the potential of the loads over the place q of the
driver: of weights and springs their energy, of all other loads the work against them. A machine with one degree of
freedom rests where tau = 0. The equilibrium is stable where W has a minimum: tau changes from minus to plus there.
With the stiffness k = dtau/dq and the reflected inertia J its natural angular frequency is sqrt(k/J) (small motion
without losses, the shaft free: J q'' = -k q). Friction is left out: it holds the machine beside an equilibrium, too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal

import numpy as np

from ..core.quantities import Value, declaration, quantity
from .machine import MachineState
from .sampled_quantities import largest, roots

Kind = Literal["stable", "unstable", "on its stop"]

PLACES = 721
"""Places at which the effort is computed first; equilibria between two of them are found by its extremes."""
NOTHING = 1e-10
"""Part of the efforts of all loads, added by their sizes, below which their sum counts as none: the loads balance."""
_NO_WORK = 1e-6
"""Part of the sizes of the efforts, over a turn, below which their work counts as none: a load may have corners."""
_MOVES = 0.1
"""Speed of the driver [rad/s, m/s] at which a load that depends on the speed is told."""
_NODES = 6
"""Points of Gauss's rule between two places."""


@declaration
class Holding:
    """The effort that holds the driver at rest, without friction."""

    torque_peak: Value = quantity("N.m", "largest in size")
    torque_peak_at: Value = quantity("rad", "place of the driver there")
    work: Value = quantity("J", "work over a whole turn at rest; 0 where all loads have an energy")


@declaration
class Equilibrium:
    """An equilibrium of the driver without effort."""

    at: Value = quantity("rad", "place of the driver")
    stiffness: Value = quantity("N.m/rad", "slope of the holding effort")
    inertia: Value = quantity("kg.m2", "reflected inertia")
    frequency: Value = quantity("Hz", "natural frequency, without losses")
    energy: Value = quantity("J", "energy above the lowest equilibrium")
    end_stop: Value = quantity("N.m", "effort of the end stop against the driver; above 0 at the upper end")


@dataclass(frozen=True)
class Rest:
    """A machine at rest over the way of its driver: `q` are places [rad, m], shape (n,), and `torque` the efforts
    that hold it there [N m, N]. `equilibria` stand in the order of their places, and `kinds` says of each whether it
    is stable. `balanced` are the ranges of places over which the loads balance: the machine rests anywhere there."""

    q: Any
    torque: Any
    holding: Holding
    equilibria: tuple[Equilibrium, ...]
    kinds: tuple[Kind, ...]
    balanced: tuple[tuple[float, float], ...]
    by_speed: tuple[str, ...]
    """the loads, besides friction, that are others as soon as the driver moves"""

    @property
    def stable(self) -> Equilibrium | None:
        """The stable equilibrium of the least energy, clear of the stops; None where there is none."""
        found = [each for each, kind in zip(self.equilibria, self.kinds, strict=True) if kind == "stable"]
        return min(found, key=lambda each: each.energy or 0.0) if found else None


class _AtRest:
    """A machine at any places of its driver, at rest."""

    def __init__(self, state: Callable[[Any, Any], MachineState]) -> None:
        self._state_at = state

    def _state(self, q: Any, w: float = 0.0) -> MachineState:
        return self._state_at(q, w + 0.0 * q)

    def torque(self, q: Any) -> Any:
        """The effort at the driver, shape (1, n)."""
        return np.broadcast_to(self._state(q).bias, (1, len(q)))

    def slope(self, q: Any) -> Any:
        """Its slope by the place, shape (1, n)."""
        return np.broadcast_to(self._state(q).slopes()[0], (1, len(q)))

    def inertia(self, q: Any) -> Any:
        """The reflected inertia, shape (n,)."""
        return np.broadcast_to(self._state(q).J, q.shape)

    def sizes(self, q: Any) -> Any:
        """The sum of the sizes of the efforts of all loads, shape (n,)."""
        effects = self._state(q).effects.values()
        return sum((abs(each.conservative) + abs(each.dissipative) for each in effects), 0.0 * q)

    def by_speed(self, q: Any) -> Iterator[str]:
        """The loads, besides friction, whose effort is another one as soon as the driver moves."""
        rest, forth, back = (self._state(q, w).effects for w in (0.0, _MOVES, -_MOVES))
        most = np.max(self.sizes(q))
        for name, there in rest.items():
            if name not in ("pins", "guides"):
                for moving in (forth[name], back[name]):
                    change = moving.conservative + moving.dissipative - there.conservative - there.dissipative
                    if np.max(np.abs(change)) > _NO_WORK * most:
                        yield name
                        break

    def work(self, begin: Any, end: Any) -> Any:
        """The work of the holding effort between pairs of places that lie close together, shape (n,)."""
        nodes, weights = np.polynomial.legendre.leggauss(_NODES)
        half = 0.5 * (end - begin)
        at = 0.5 * (begin + end)[:, None] + half[:, None] * nodes
        return (self.torque(at.ravel())[0].reshape(at.shape) @ weights) * half


def rest_of(state: Callable[[Any, Any], MachineState], span: tuple[float, float], turns: bool) -> Rest:
    """A machine at rest over the way of its driver.

    Parameters
    ----------
    state : the machine at places [rad, m] and speeds [rad/s, m/s] of its driver, both of shape (n,)
    span : the places from which to which the driver goes
    turns : whether it turns all the way round
    """
    way = _AtRest(state)
    q = np.linspace(*span, PLACES)
    torque = way.torque(q)[0].copy()
    sizes = way.sizes(q)
    nothing = NOTHING * float(np.max(sizes))
    torque[np.abs(torque) <= nothing] = 0.0
    balanced = tuple(_balanced(q, torque))
    steps = np.concatenate([[0.0], np.cumsum(way.work(q[:-1], q[1:]))])
    work = float(steps[-1]) if turns else None
    if work is not None and abs(work) <= _NO_WORK * 2.0 * math.pi * float(np.mean(sizes)):
        work = 0.0
    peak_at, peak = largest(lambda x: np.abs(way.torque(x)), q, around=turns)
    sign = float(np.sign(way.torque(peak_at)[0, 0]))
    found = (
        [] if len(balanced) == 1 and balanced[0] == (q[0], q[-1]) else list(_places(way, q, nothing, turns))
    )
    found = [each for each in found if not any(low <= each[0] <= high for low, high in balanced)]
    if not turns:
        found = [*_on_stops(q, torque), *found]
    found.sort(key=lambda each: _folded(each[0], turns))
    places = np.array([place for place, _ in found])
    energies = _energies(way, q, steps, places) if found and not work else None
    return Rest(
        q,
        torque,
        Holding(
            torque_peak=sign * float(peak[0]), torque_peak_at=_folded(float(peak_at[0]), turns), work=work
        ),
        tuple(_equilibrium(way, place, kind, energies, k, turns) for k, (place, kind) in enumerate(found)),
        tuple(kind for _, kind in found),
        balanced,
        tuple(way.by_speed(q[:: PLACES // 72])),
    )


def _balanced(q: Any, torque: Any) -> Iterator[tuple[float, float]]:
    """The ranges of three places or more over which there is no effort."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], torque == 0.0, [False]]).astype(int)))
    for low, end in zip(edges[::2], edges[1::2], strict=True):
        if end - low >= 3:
            yield float(q[low]), float(q[end - 1])


def _places(way: _AtRest, q: Any, nothing: float, turns: bool) -> Iterator[tuple[float, Kind]]:
    """The places at which the effort vanishes: where its sign changes, between two of its extremes at most once; and
    the extremes at which it only touches zero, which nothing holds on one side."""
    extremes = roots(way.slope, q, around=turns)[0]
    bounds = np.unique(np.concatenate([q, np.clip(extremes, q[0], q[-1])]))
    values = way.torque(bounds)[0].copy()
    values[np.abs(values) <= nothing] = 0.0
    there = np.flatnonzero(values)
    pairs = list(pairwise(there))
    ends = [(bounds[a], bounds[b], values[a], values[b]) for a, b in pairs]
    if turns and len(there):
        # across the end of the turn
        last, first = there[-1], there[0]
        whole = 2.0 * math.pi
        ends.append((bounds[last], bounds[first] + whole, values[last], values[first]))
    for low, high, before, after in ends:
        if before * after < 0.0:
            yield _root(way, float(low), float(high), before), "stable" if before < 0.0 else "unstable"
    touching = [
        k for k in range(1, len(values) - 1) if values[k] == 0.0 and values[k - 1] * values[k + 1] > 0.0
    ]
    for k in touching:
        yield float(bounds[k]), "unstable"


def _root(way: _AtRest, low: float, high: float, before: float) -> float:
    """The place between two at which the effort changes its sign, by halving."""
    for _ in range(60):
        middle = 0.5 * (low + high)
        if way.torque(np.array([middle]))[0, 0] * before > 0.0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def _on_stops(q: Any, torque: Any) -> Iterator[tuple[float, Kind]]:
    """The ends of a range against which the loads press the driver."""
    if torque[0] > 0.0:
        yield float(q[0]), "on its stop"
    if torque[-1] < 0.0:
        yield float(q[-1]), "on its stop"


def _energies(way: _AtRest, q: Any, steps: Any, places: Any) -> Any:
    """The potential at places, above the lowest of them [J]; `steps` is the potential at `q`."""
    inside = np.where(places > q[-1], places - (q[-1] - q[0]), places)
    k = np.clip(np.searchsorted(q, inside, side="right") - 1, 0, len(q) - 2)
    energies = steps[k] + way.work(q[k], inside)
    energies -= np.min(energies)
    return np.where(energies > NOTHING * np.ptp(steps), energies, 0.0)


def _equilibrium(way: _AtRest, place: float, kind: Kind, energies: Any, k: int, turns: bool) -> Equilibrium:
    at = np.array([place])
    inertia, energy = float(way.inertia(at)[0]), None if energies is None else float(energies[k])
    if kind == "on its stop":
        return Equilibrium(
            at=place,
            stiffness=None,
            inertia=inertia,
            frequency=None,
            energy=energy,
            end_stop=-float(way.torque(at)[0, 0]),
        )
    stiffness = float(way.slope(at)[0, 0])
    swings = kind == "stable" and stiffness > 0.0 and inertia > 0.0
    frequency = math.sqrt(stiffness / inertia) / (2.0 * math.pi) if swings else None
    return Equilibrium(
        at=_folded(place, turns),
        stiffness=stiffness,
        inertia=inertia,
        frequency=frequency,
        energy=energy,
        end_stop=None,
    )


def _folded(q: float, turns: bool) -> float:
    """A place; the angle of a driver that turns from 0 to a whole turn."""
    folded = q % (2.0 * math.pi) if turns else q
    return 0.0 if turns and 2.0 * math.pi - folded < 1e-9 else folded
