"""Rows of a run between the substeps of its integrator, for models with error control and without constraints.

The substeps end where a profile begins or ends, and not at every row; the states at a row are those of the dense
output. The last stage of a substep is the first of the next one. So do the loops of `chainunit.batch.transients`.
"""

from __future__ import annotations

from .. import integrators
from .encoding import Function
from .integration import Controlled, RunParts, StateLoop
from .signals import next_bend


class Reaching(Controlled):
    """Writes the function that goes on by substeps until a time [s] is reached, at most to the end of the run [s],
    with the longest substep [s]; 1, or 0 as in `Controlled`.

    In memory, ``reached`` is the time of the last substep's end, ``size`` the last substep, ``from`` and ``now`` the
    states at its ends, and ``slope`` their derivatives at the latter.
    """

    def __init__(self, parts: RunParts) -> None:
        super().__init__(parts)
        self._time, self._end, f = 0, 1, self._f
        # times count from 0
        self._begin, self._step, self._size = f.local(), f.local(), f.local()
        self._bend = next_bend(parts.memory, parts.module)
        for name, numbers in (("reached", 1), ("size", 1), ("from", parts.states), ("slope", parts.states)):
            parts.memory.room(name, numbers)

    def write(self, most: int) -> Function:
        """The function; the parameter for the most substeps is at an address."""
        f, memory = self._f, self._memory
        kept = {"reached": self._since, "size": self._size, "pace": self._pace}
        for name in ("reached", "size"):
            f.at(memory[name])
            f.set(kept[name])
        self._known_pace()
        self._substeps(self._time, most)
        for name, place in kept.items():
            with f.into(memory[name]):
                f.get(place)
        f.i32(1)
        return f

    def _set_limit(self) -> None:
        f = self._f
        f.get(self._end, self._since)
        f.call(self._bend)
        f.do("f64.min")
        f.set(self._step)

    def _first_stage(self) -> None:
        self._f.copy(self._stages, self._memory["slope"], self._parts.room)

    def _take(self) -> None:
        f, memory, room = self._f, self._memory, self._parts.room
        f.copy(memory["from"], memory["now"], room)
        f.copy(memory["now"], memory["states"], room)
        f.copy(memory["slope"], memory["derivatives"], room)
        f.get(self._h)
        f.set(self._size)

    def begin_at(self, f: Function, time: int) -> None:
        """Begin at the states in memory, at a time that a local has."""
        memory, parts = self._memory, self._parts
        f.call(parts.written["tolerance"])
        f.copy(memory["now"], memory["states"], parts.room)
        with f.into(memory["reached"]):
            f.get(time)
        f.get(time)
        f.call(parts.signals)
        f.call(parts.written["derivatives"])
        f.copy(memory["slope"], memory["derivatives"], parts.room)

    def states_at(self, f: Function, states: StateLoop, time: int) -> None:
        """Write the states at a time, which a local has, to their place."""
        memory = self._memory
        share, weights = f.local(), [f.local() for _ in integrators.DENSE]
        f.get(time)
        f.at(memory["reached"])
        f.do("f64.ge")
        with f.when():
            f.copy(memory["states"], memory["now"], self._parts.room)
            f.otherwise()
            f.get(time)
            f.at(memory["reached"])
            f.do("f64.sub")
            f.at(memory["size"])
            f.do("f64.div")
            f.f64(1.0)
            f.do("f64.add")
            f.set(share)
            for weight, polynomial in zip(weights, integrators.DENSE, strict=True):
                f.f64(0.0)
                for coefficient in reversed(polynomial):
                    f.f64(coefficient)
                    f.do("f64.add")
                    f.get(share)
                    f.do("f64.mul")
                f.at(memory["size"])
                f.do("f64.mul")
                f.set(weight)
            with states.each(), states.into(memory["states"]):
                states.push(memory["from"])
                for k, weight in enumerate(weights):
                    states.push(self._stages + k * self._parts.room)
                    f.get(weight)
                    f.do("f64.mul", "f64.add")
