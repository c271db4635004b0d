"""The integrators of `chainunit.core.integrators` inside a module, with the same numbers and in the same order."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

from .. import integrators
from .encoding import Function, Module
from .expressions import OwnFunctions
from .memory import BYTES, Places


@dataclass(frozen=True)
class RunParts:
    """What the integrators need: the memory, the number of states, and the functions of the module."""

    memory: Places
    states: int
    module: Module
    own: OwnFunctions
    written: Mapping[str, Function]
    signals: Function

    @property
    def room(self) -> int:
        """Bytes of the states."""
        return BYTES * self.states


class StateLoop:
    """Loops over the states in a function."""

    def __init__(self, f: Function, parts: RunParts) -> None:
        self._f, self._room, self._at = f, parts.room, f.local("i32")

    @contextmanager
    def each(self) -> Iterator[None]:
        """Instructions for each state."""
        with self._f.counting(self._at, self._room, BYTES):
            yield

    @contextmanager
    def into(self, address: int) -> Iterator[None]:
        """Write the value, which the instructions inside push, to the present state's place in an array."""
        self._f.get(self._at)
        yield
        self._f.store("f64", address)

    def push(self, address: int) -> None:
        """Push the present state's number in an array."""
        self._f.get(self._at)
        self._f.load("f64", address)

    def weighted(self, weights: Sequence[float], address: int) -> None:
        """Push the sum of the numbers in the arrays from an address on, with these weights."""
        for k, weight in enumerate(weights):
            self._f.f64(weight)
            self.push(address + k * self._room)
            self._f.do("f64.mul")
            if k:
                self._f.do("f64.add")


def even(parts: RunParts, most: int) -> Function:
    """`rk4` from a time [s] over a step [s], with the longest substep [s]; 1, or 0 where it takes too many."""
    f, memory = parts.module.function(["f64", "f64", "f64"], ["i32"]), parts.memory
    begin, step, longest = 0, 1, 2
    count, h, taken, factor = f.local(), f.local(), f.local(), f.local()
    x, rates = memory["states"], memory["derivatives"]
    now, later, states = memory["now"], memory.room("later", parts.states), StateLoop(f, parts)

    def moved(to: int, of: int, share: float) -> None:
        """Go on from one array to another by a share of the step along the derivatives."""
        f.f64(share)
        f.get(h)
        f.do("f64.mul")
        f.set(factor)
        with states.each(), states.into(to):
            states.push(of)
            f.get(factor)
            states.push(rates)
            f.do("f64.mul", "f64.add")

    f.get(step, longest)
    f.do("f64.div")
    f.f64(1e-9)
    f.do("f64.sub")
    f.set(count)
    _leave_where_more(f, count, most)
    f.f64(1.0)
    f.get(count)
    f.do("f64.ceil", "f64.max")
    f.set(count)
    f.get(step, count)
    f.do("f64.div")
    f.set(h)
    with f.loop():
        f.copy(now, x, parts.room)
        f.copy(later, x, parts.room)
        for node, weight in zip(integrators.RK4_NODES, integrators.RK4_WEIGHTS, strict=True):
            if node:
                moved(x, now, node)
            f.get(begin, taken)
            f.f64(node)
            f.do("f64.add")
            f.get(h)
            f.do("f64.mul", "f64.add")
            f.call(parts.signals)
            f.call(parts.written["derivatives"])
            moved(later, later, weight)
        f.copy(x, later, parts.room)
        f.get(taken)
        f.f64(1.0)
        f.do("f64.add")
        f.set(taken)
        f.get(taken, count)
        f.do("f64.lt")
        f.leave_if(0)
    f.i32(1)
    return f


def _leave_where_more(f: Function, count: int, most: int) -> None:
    """Return 0 where the number in a local is larger than that at an address."""
    f.get(count)
    f.at(most)
    f.do("f64.gt")
    with f.when():
        f.i32(0)
        f.do("return")


class Controlled:
    """Writes `controlled` from a time [s] over a step [s], with the longest substep [s]; 1, or 0 where the states
    leave all bounds or the step takes too many substeps."""

    def __init__(self, parts: RunParts) -> None:
        self._parts, self._memory = parts, parts.memory
        f = self.function = parts.module.function(["f64", "f64", "f64"], ["i32"])
        self._f, self._states = f, StateLoop(f, parts)
        self._begin, self._step, self._longest = 0, 1, 2
        self._since, self._taken, self._left, self._h = f.local(), f.local(), f.local(), f.local()
        self._pace, self._error, self._following, self._sum = f.local(), f.local(), f.local(), f.local()
        self._usable, self._last = f.local("i32"), f.local("i32")
        self._stages = parts.memory["stages"]

    def write(self, most: int) -> Function:
        """The function; the parameter for the most substeps is at an address."""
        f, memory, parts = self._f, self._memory, self._parts
        f.call(parts.written["tolerance"])
        f.copy(memory["now"], memory["states"], parts.room)
        self._known_pace()
        self._substeps(self._step, most)
        f.copy(memory["states"], memory["now"], parts.room)
        with f.into(memory["pace"]):
            f.get(self._pace)
        f.i32(1)
        return f

    def _substeps(self, until: int, most: int) -> None:
        """Substeps until the time of the last one's end is that of the local `until`; see `write` for `most`."""
        f = self._f
        with f.block(), f.loop():
            f.get(self._since, until)
            f.do("f64.ge")
            f.leave_if(1)
            self._increase(self._taken, 1.0)
            _leave_where_more(f, self._taken, most)
            self._set_limit()
            self._choose_size()
            self._trial()
            self._judge()
            self._accept()
            self._next_size()
            f.leave(0)

    def _set_limit(self) -> None:
        """Find the time that a substep may not pass, where it is not the end of the step."""

    def _known_pace(self) -> None:
        """The next substep: that of memory, or the first of all."""
        f = self._f
        f.at(self._memory["pace"])
        f.set(self._pace)
        f.f64(integrators.FIRST)
        f.get(self._longest)
        f.do("f64.mul")
        f.get(self._pace, self._pace)
        f.f64(0.0)
        f.do("f64.eq")
        # of two the first where the condition holds
        f.do("select")
        f.set(self._pace)

    def _increase(self, place: int, by: float) -> None:
        self._f.get(place)
        self._f.f64(by)
        self._f.do("f64.add")
        self._f.set(place)

    def _choose_size(self) -> None:
        """The next substep: of a rest that is hardly longer, all or half."""
        f = self._f
        f.get(self._step, self._since)
        f.do("f64.sub")
        f.set(self._left)
        f.get(self._left)
        f.get(self._left)
        f.f64(0.5)
        f.do("f64.mul")
        f.get(self._pace, self._pace, self._left)
        f.f64(0.5)
        f.do("f64.mul", "f64.gt", "select")
        f.get(self._pace, self._left)
        f.do("f64.ge", "select")
        f.set(self._h)

    def _trial(self) -> None:
        """The states after the substep, and the derivatives at its stages."""
        f, memory, states = self._f, self._memory, self._states
        self._first_stage()
        for k, (node, weights) in enumerate(zip(integrators.NODES, integrators.STAGES, strict=True)):
            if k:
                with states.each(), states.into(memory["states"]):
                    states.push(memory["now"])
                    f.get(self._h)
                    states.weighted(weights, self._stages)
                    f.do("f64.mul", "f64.add")
                self._stage(k, node)

    def _first_stage(self) -> None:
        """The derivatives at the begin of the substep."""
        self._f.copy(self._memory["states"], self._memory["now"], self._parts.room)
        self._stage(0, integrators.NODES[0])

    def _stage(self, k: int, node: float) -> None:
        """The derivatives at a stage, whose states are in memory."""
        f, memory, parts = self._f, self._memory, self._parts
        f.get(self._begin, self._since, self._h)
        f.f64(node)
        f.do("f64.mul", "f64.add", "f64.add")
        f.call(parts.signals)
        f.call(parts.written["derivatives"])
        f.copy(self._stages + k * parts.room, memory["derivatives"], parts.room)

    def _judge(self) -> None:
        """Whether states and derivatives are finite, and the error over the permitted one."""
        f, memory, parts, states = self._f, self._memory, self._parts, self._states
        for place in (self._sum, self._error):
            f.f64(0.0)
            f.set(place)
        last = self._stages + (len(integrators.NODES) - 1) * parts.room
        with states.each():
            f.get(self._sum)
            states.push(memory["states"])
            f.f64(0.0)
            f.do("f64.mul", "f64.add")
            states.push(last)
            f.f64(0.0)
            f.do("f64.mul", "f64.add")
            f.set(self._sum)
            f.get(self._error, self._h)
            states.weighted(integrators.ERRORS, self._stages)
            f.do("f64.mul", "f64.abs")
            f.at(memory["tolerance"])
            states.push(memory["now"])
            f.do("f64.abs")
            states.push(memory["states"])
            f.do("f64.abs", "f64.max")
            states.push(memory["nominal"])
            f.do("f64.max", "f64.mul", "f64.div", "f64.max")
            f.set(self._error)
        f.get(self._sum)
        f.f64(0.0)
        f.do("f64.eq")
        f.set(self._usable)
        f.get(self._h)
        self._shortest()
        f.do("f64.le")
        f.set(self._last)

    def _shortest(self) -> None:
        self._f.f64(integrators.SHORTEST)
        self._f.get(self._longest)
        self._f.do("f64.mul")

    def _accept(self) -> None:
        """Take the states over where the error permits it."""
        f = self._f
        f.get(self._usable)
        f.do("i32.eqz")
        f.get(self._last)
        f.do("i32.and")
        with f.when():
            f.i32(0)
            f.do("return")
        f.get(self._usable, self._error)
        f.f64(1.0)
        f.do("f64.le")
        f.get(self._last)
        f.do("i32.or", "i32.and")
        with f.when():
            f.get(self._step, self._since, self._h)
            f.do("f64.add")
            f.get(self._h, self._left)
            f.do("f64.ge", "select")
            f.set(self._since)
            self._take()

    def _take(self) -> None:
        """Take the states over, corrected to the model's constraints."""
        f, memory, parts = self._f, self._memory, self._parts
        f.get(self._begin, self._since)
        f.do("f64.add")
        f.call(parts.signals)
        f.call(parts.written["closed"])
        f.copy(memory["now"], memory["closed"], parts.room)

    def _next_size(self) -> None:
        """The substep that the error suggests."""
        f = self._f
        f.get(self._h)
        f.f64(integrators.MOST_GROWTH)
        f.f64(integrators.SAFETY)
        f.f64(integrators.ERROR_POWER)
        f.get(self._error)
        f.call(self._parts.own.of("LOG"))
        f.do("f64.mul")
        f.call(self._parts.own.of("EXP"))
        f.do("f64.mul")
        f.get(self._error)
        f.f64(integrators.NO_ERROR)
        f.do("f64.lt", "select")
        f.f64(integrators.LEAST_GROWTH)
        f.do("f64.max")
        f.f64(integrators.MOST_GROWTH)
        f.do("f64.min")
        f.f64(integrators.LEAST_GROWTH)
        f.get(self._usable)
        f.do("select", "f64.mul")
        f.set(self._following)
        # a substep that the end of the step shortened does not shorten the next one
        f.get(self._following, self._pace)
        f.do("f64.max")
        f.get(self._following, self._usable, self._error)
        f.f64(1.0)
        f.do("f64.le", "i32.and")
        f.get(self._h, self._pace)
        f.do("f64.lt", "i32.and", "select")
        self._shortest()
        f.do("f64.max")
        f.get(self._longest)
        f.do("f64.min")
        f.set(self._pace)
