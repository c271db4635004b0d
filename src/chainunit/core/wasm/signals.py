"""Signals inside a module: the function that sets the inputs at a time, from the table that
`chainunit.core.wasm.runs` describes."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager

from .encoding import Function, Module
from .memory import BYTES, Places

RECORD = 24
"""Bytes of the record of a signal."""
PROFILE = 1
"""The kind of a signal that is a profile; 0 is one of lines."""


def signals(memory: Places, module: Module) -> Function:
    """The function that sets the inputs with signals, at a time."""
    f = module.function(["f64"])
    time, record, left, points, value = 0, f.local("i32"), f.local("i32"), f.local("i32"), f.local()
    kinds = (_lines(module), _profile(module))
    with _each_record(f, memory, record, left):
        f.get(record)
        f.load("i32", 12)
        f.set(points)
        f.get(record)
        f.load("i32", 4)
        with f.when():
            f.get(time, points, record)
            f.call(kinds[1])
            f.set(value)
            f.otherwise()
            f.get(time, points, record)
            f.call(kinds[0])
            f.set(value)
        f.get(record)
        f.load("i32")
        f.get(value)
        f.store()
    return f


@contextmanager
def _each_record(f: Function, memory: Places, record: int, left: int) -> Iterator[None]:
    """A loop over the signals of the table, if there is one; the local `record` has the address of each, and `left`
    is a local for it."""
    f.at(memory["table of signals"], "i32")
    f.set(record)
    with f.block():
        f.get(record)
        f.do("i32.eqz")
        f.leave_if(0)
        f.get(record)
        f.load("i32")
        f.set(left)
        add(f, record, 8)
        with f.loop():
            f.get(left)
            f.do("i32.eqz")
            f.leave_if(1)
            yield
            add(f, record, RECORD)
            add(f, left, -1)
            f.leave(0)


def next_bend(memory: Places, module: Module) -> Function:
    """The function that gives the first time behind a time at which a change of a profile begins or ends; infinity
    where none does."""
    f = module.function(["f64"], ["f64"])
    time, record, left, at, changes = 0, f.local("i32"), f.local("i32"), f.local("i32"), f.local("i32")
    bend, candidate = f.local(), f.local()

    def earlier() -> None:
        """Take the candidate on the stack where it lies behind the time."""
        f.set(candidate)
        f.get(candidate)
        f.f64(math.inf)
        f.get(candidate, time)
        f.do("f64.gt", "select")
        f.get(bend)
        f.do("f64.min")
        f.set(bend)

    f.f64(math.inf)
    f.set(bend)
    with _each_record(f, memory, record, left):
        f.get(record)
        f.load("i32", 12)
        f.set(at)
        f.get(record)
        f.load("i32", 4)
        f.get(record)
        f.load("i32", 8)
        f.do("i32.mul")  # no changes of lines, whose kind is 0
        f.set(changes)
        with f.block(), f.loop():
            f.get(changes)
            f.do("i32.eqz")
            f.leave_if(1)
            f.get(at)
            f.load("f64", BYTES)
            earlier()
            f.get(at)
            f.load("f64", BYTES)
            f.get(at)
            f.load("f64", 2 * BYTES)
            f.do("f64.add")
            earlier()
            add(f, at, 3 * BYTES)
            add(f, changes, -1)
            f.leave(0)
    f.get(bend)
    return f


def add(f: Function, place: int, n: int) -> None:
    """Add a number to a whole local."""
    f.get(place)
    f.i32(n)
    f.do("i32.add")
    f.set(place)


def _lines(module: Module) -> Function:
    """The value on the lines between points, at a time: of the address of the points, and of the record."""
    f = module.function(["f64", "i32", "i32"], ["f64"])
    time, points, record = 0, 1, 2
    k, at, begin, before = f.local("i32"), f.local("i32"), f.local(), f.local()

    def leave_at_the_last_point() -> None:
        f.get(k)
        f.i32(1)
        f.do("i32.add")
        f.get(record)
        f.load("i32", 8)
        f.do("i32.ge_s")
        f.leave_if(0)

    f.get(record)
    f.load("i32", 16)
    f.set(k)
    f.get(points, k)
    f.i32(2 * BYTES)
    f.do("i32.mul", "i32.add")
    f.set(at)
    with f.loop(), f.block():  # back
        f.get(k)
        f.do("i32.eqz")
        f.leave_if(0)
        f.get(time, at)
        f.load()
        f.do("f64.ge")
        f.leave_if(0)
        add(f, k, -1)
        add(f, at, -2 * BYTES)
        f.leave(1)
    with f.loop(), f.block():  # on
        leave_at_the_last_point()
        f.get(time, at)
        f.load("f64", 2 * BYTES)
        f.do("f64.lt")
        f.leave_if(0)
        add(f, k, 1)
        add(f, at, 2 * BYTES)
        f.leave(1)
    f.get(record, k)
    f.store("i32", 16)
    f.get(at)
    f.load()
    f.set(begin)
    f.get(at)
    f.load("f64", BYTES)
    f.set(before)
    with f.block():
        f.get(time, begin)
        f.do("f64.lt")
        f.leave_if(0)
        leave_at_the_last_point()
        f.get(before, at)
        f.load("f64", 3 * BYTES)
        f.get(before)
        f.do("f64.sub")
        f.get(time, begin)
        f.do("f64.sub")
        f.get(at)
        f.load("f64", 2 * BYTES)
        f.get(begin)
        f.do("f64.sub", "f64.div", "f64.mul", "f64.add", "return")
    f.get(before)
    return f


def _profile(module: Module) -> Function:
    """The value of a profile, at a time: of the address of its numbers, and of the record."""
    f = module.function(["f64", "i32", "i32"], ["f64"])
    time, at, record = 0, 1, 2
    left, value, before, share = f.local("i32"), f.local(), f.local(), f.local()
    f.get(at)
    f.load()
    f.set(value)
    f.get(value)
    f.set(before)
    f.get(record)
    f.load("i32", 8)
    f.set(left)
    with f.block(), f.loop():
        f.get(left)
        f.do("i32.eqz")
        f.leave_if(1)
        # the share of the change that is past, between 0 and 1
        f.get(time, at)
        f.load("f64", BYTES)
        f.do("f64.sub")
        f.get(at)
        f.load("f64", 2 * BYTES)
        f.do("f64.div")
        f.f64(0.0)
        f.do("f64.max")
        f.f64(1.0)
        f.do("f64.min")
        f.set(share)
        f.get(value, at)
        f.load("f64", 3 * BYTES)
        f.get(before)
        f.do("f64.sub")
        f.get(share, share)
        f.do("f64.mul")
        f.get(share)
        f.do("f64.mul")
        f.f64(10.0)
        f.get(share)
        f.f64(6.0)
        f.get(share)
        f.do("f64.mul")
        f.f64(15.0)
        f.do("f64.sub", "f64.mul", "f64.add", "f64.mul", "f64.mul", "f64.add")
        f.set(value)
        f.get(at)
        f.load("f64", 3 * BYTES)
        f.set(before)
        add(f, at, 3 * BYTES)
        add(f, left, -1)
        f.leave(0)
    f.get(value)
    return f
