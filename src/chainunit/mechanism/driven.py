"""A linkage with several drivers: the effort of each along its own place, and the load port of each.

With the places x of the drivers the efforts are F = M(x) x'' + h(x, x'). A mechanism in which one driver alone moves
gives a column of M, one that moves as the drivers do, over the time, gives h. Two drivers that depend on each other
share the effort by the speeds with which they move: a gear hands on the effort of the driver that it drives.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from ..core.engines import Dual, dual, slope
from ..groups.driver import Course
from ..groups.loads import Effect
from .linkage import Linkage
from .machine import InMotion, MachineState, Mechanism, Steadiness

Free = Mapping[int, tuple[Any, Any, Any]]
"""Place, speed and acceleration of the drivers that move by themselves, by number."""


class DriverMotion(NamedTuple):
    """The motion of a driver: its `place` and `speed`; its acceleration is `rate` times the one of the first driver,
    and a `bend` that its law gives, or the acceleration `added` of one that moves by itself."""

    place: Any
    speed: Any
    rate: Any = 0.0
    bend: Any = 0.0
    added: Any = 0.0


def motions_of(xp: Any, linkage: Linkage, q: Any, w: Any, free: Free) -> list[DriverMotion]:
    """The motion of each driver, the first of which has the place `q` and the speed `w` [rad, rad/s; m, m/s]."""
    motions = [DriverMotion(q, w, 1.0)]
    for k, driver in enumerate(linkage.drivers[1:], 1):
        if k in free:
            place, speed, acceleration = free[k]
            motions.append(DriverMotion(place, speed, added=acceleration))
        else:
            place, rates = driver.course_at(xp, q)
            motions.append(DriverMotion(place, rates[0] * w, rates[0], rates[1] * (w * w)))
    return motions


class DrivenLinkage:
    """A linkage with the `motions` of its drivers: `inertia` has the effort of each driver per acceleration of each
    [kg m2, kg m, kg], `bias` the efforts at a constant speed of the first one and of the ones that move by
    themselves [N m, N], of which `friction` is a part; `effects` are the effects of the loads."""

    __slots__ = ("_moved", "_reactions", "alone", "bias", "effects", "friction", "inertia", "motions")

    def __init__(self, xp: Any, mechanism: Mechanism, q: Any, w: Any, free: Free) -> None:
        """
        Parameters
        ----------
        xp : engine (see `chainunit.core.engines`)
        mechanism : with this linkage; `q`, `w` and `free` are the motion of its drivers, see `motions_of`
        """
        linkage, derived, topology = mechanism.linkage, mechanism.derived, mechanism.topology
        motions = self.motions = motions_of(xp, linkage, q, w, free)

        def moved(rates: Sequence[tuple[Any, Any, Any]]) -> Mechanism:
            courses = [Course(motion.place, rate) for motion, rate in zip(motions, rates, strict=True)]
            return Mechanism(xp, linkage.moved(courses), motions[0].place, derived, topology)

        numbers = range(len(motions))
        alone = self.alone = [moved([(1.0 if k == j else 0.0, 0.0, 0.0) for k in numbers]) for j in numbers]
        m = moved([(motion.speed, motion.bend, 0.0) for motion in motions])
        steady = Steadiness(xp, m, 1.0, linkage.loads)
        self.effects: dict[str, Effect] = steady.effects | steady.losses
        late = [load for load in linkage.loads.values() if load.by_reactions]
        self.friction = [
            sum(load.effect(xp, m, 1.0, steady.reactions, one).dissipative for load in late) for one in alone
        ]
        self.bias = [effort + lost for effort, lost in zip(steady.efforts, self.friction, strict=True)]
        passes = [one.reactions({name: b.inertial() for name, b in one.bodies.items()}) for one in alone]
        self.inertia = [[efforts[k] for efforts, _ in passes] for k in numbers]
        self._reactions = steady.reactions, [reactions for _, reactions in passes]
        self._moved = moved

    def accelerations(self, a: Any) -> list[Any]:
        """The acceleration of each driver at the acceleration `a` of the first one."""
        return [further + motion.bend for further, motion in zip(self._growth(a), self.motions, strict=True)]

    def _growth(self, a: Any) -> list[Any]:
        """The accelerations besides those of `bias`."""
        return [motion.rate * a + motion.added for motion in self.motions]

    def efforts(self, a: Any) -> list[Any]:
        """The effort of each driver along its place at the acceleration `a` of the first one [N m, N], with
        friction."""
        x2 = self._growth(a)
        return [
            bias + sum(m * acceleration for m, acceleration in zip(row, x2, strict=True))
            for bias, row in zip(self.bias, self.inertia, strict=True)
        ]

    def moving(self, a: Any) -> InMotion:
        """The linkage in motion over the time at the acceleration `a` of the first driver."""
        x2, courses = self._growth(a), zip(self.motions, self.accelerations(a), strict=True)
        m = self._moved([(motion.speed, acceleration, 0.0) for motion, acceleration in courses])
        steady, parts = self._reactions
        reactions = {}
        for joint, force in steady.items():
            for part, x in zip(parts, x2, strict=True):
                force = force.plus(part[joint], x)
            reactions[joint] = force
        return InMotion(m, reactions, self.effects, 1.0, 0.0)

    @property
    def kinetic_energy(self) -> Any:
        """Kinetic energy [J]."""
        speeds = [motion.speed for motion in self.motions]
        return 0.5 * sum(
            v * sum(m * w for m, w in zip(row, speeds, strict=True))
            for v, row in zip(speeds, self.inertia, strict=True)
        )

    def port(self, number: int, geared: Sequence[bool], a: Any = 0.0) -> tuple[Any, Any]:
        """The inertia that a driver feels, and its effort without its own acceleration. The first one, number 0,
        drives the `geared` ones, too; `a` is its acceleration."""
        if number:
            alone = self.inertia[number][number]
            return alone, self.efforts(a)[number] - alone * self.motions[number].added
        rates = [motion.rate for motion in self.motions]
        inertia: Any = 0.0
        bias: Any = 0.0
        for k, (row, effort) in enumerate(zip(self.inertia, self.efforts(0.0), strict=True)):
            if geared[k]:
                inertia = inertia + rates[k] * sum(m * rate for m, rate in zip(row, rates, strict=True))
                bias = bias + rates[k] * effort
        return inertia, bias


class StateOfDrivers(MachineState):
    """A linkage at one place and speed of its first driver, of which further drivers have motors of their own:
    inertia and torque are what the first one gives; energies and losses belong to the whole machine."""

    __slots__ = ("_free", "_geared", "driven")

    def __init__(self, xp: Any, m: Mechanism, w: Any, geared: Sequence[bool], free: Free) -> None:
        """
        Parameters
        ----------
        geared : whether the first driver drives each of the drivers, itself among them
        """
        super().__init__(xp, m, w)
        self._geared, self._free = geared, free
        self.driven = DrivenLinkage(xp, m, m.q, w, free)
        self.J, self.bias = self.driven.port(0, geared)

    def port_slope(self, number: int, a: Any = 0.0, by_speed: bool = False) -> tuple[Any, Any]:
        """The derivatives of inertia and bias of the load port of a driver by its place, or by its speed; `a` is the
        acceleration of the first one."""
        place, speed, *_ = self.driven.motions[number]
        seeded = (place, Dual(speed, 1.0)) if by_speed else (Dual(place, 1.0), speed)
        free, (q, w) = dict(self._free), (self.m.q, self.w)
        if number:
            free[number] = *seeded, free[number][2]
        else:
            q, w = seeded
        driven = DrivenLinkage(dual(self._xp), self.m, q, w, free)
        inertia, bias = driven.port(number, self._geared, a)
        return slope(inertia), slope(bias)

    @property
    def inertia_slope(self) -> Any:
        """See `MachineState`."""
        return self.port_slope(0)[0]

    def slopes(self) -> tuple[Any, Any]:
        """See `MachineState`."""
        return self.port_slope(0)[1], self.port_slope(0, by_speed=True)[1]

    @property
    def kinetic_energy(self) -> Any:
        """Kinetic energy of the whole machine [J]."""
        return self.driven.kinetic_energy

    @property
    def lost_power(self) -> Any:
        """See `MachineState`; of the whole machine."""
        return sum(effect.dissipative for effect in self.driven.effects.values())

    @property
    def _shares(self) -> list[Any]:
        """The speeds of the drivers that the first one drives, by its own."""
        motions = zip(self.driven.motions, self._geared, strict=True)
        return [motion.rate if geared else 0.0 for motion, geared in motions]

    @property
    def directions(self) -> list[tuple[Any, Mechanism | None]]:
        """See `MachineState`; in each one driver moves alone."""
        return list(zip(self._shares, self.driven.alone, strict=True))

    @property
    def friction(self) -> Any:
        """See `MachineState`; of the drivers that the first one drives."""
        return sum(share * lost for share, lost in zip(self._shares, self.driven.friction, strict=True))

    def torque_by_reactions(self, a: Any) -> Any:
        """See `MachineState`; without the motion of drivers that move by themselves."""
        efforts = zip(self._shares, self.steady.efforts, self.inertial()[0], strict=True)
        return sum(share * (effort + inertia * a) for share, effort, inertia in efforts)

    def moving(self, a: Any) -> InMotion:
        """See `MachineState`."""
        return self.driven.moving(a) if self._free else super().moving(a)
