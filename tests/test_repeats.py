"""Operations that stand in a list again and again, as functions: fewer of them, and the same values to the bit."""

from __future__ import annotations

import math
import operator
import struct
from functools import partial

import numpy as np
import pytest
from wasm_hosts import NODE, in_node, numbers

from chainunit.core.engines import casadi_
from chainunit.core.native.kernels import kernels
from chainunit.core.native.operations import ARGUMENT, NUMBER, Operation, Operations
from chainunit.core.native.repeats import Outlined, outlined
from chainunit.core.symbolic_trace import trace
from chainunit.core.wasm import module as modules
from chainunit.machines.knife_drive import KnifeDrive

BASIC = {
    "ADD": operator.add,
    "SUB": operator.sub,
    "MUL": operator.mul,
    "DIV": operator.truediv,
    "NEG": operator.neg,
    "SQ": lambda x: x * x,
    "TWICE": lambda x: x + x,
    "INV": lambda x: 1.0 / x,
    "SQRT": math.sqrt,
    "FABS": abs,
    "FMIN": min,
    "FMAX": max,
    "SIN": math.sin,
    "COS": math.cos,
}


def values_of(items, called, arguments):
    """The values of all operations."""
    values = []
    for each in items:
        given = [values[k] for k in each.operands]
        if each.kind == NUMBER:
            values.append(each.value)
        elif each.kind == ARGUMENT:
            values.append(arguments[each.entry[1]])
        elif each.kind in called:
            of = called[each.kind]
            assert len(given) == of.arguments
            inside = values_of(of.function.items, called, given)
            values.append(inside[of.function.results[of.result]])
        else:
            values.append(BASIC[each.kind](*given))
    return values


def bits(values):
    return [struct.pack("<d", x) for x in values]


def count(short):
    """The number of operations in a list and its functions."""
    lists = [short.items, *({each.key: each.function.items for each in short.called.values()}).values()]
    return sum(bool(each.operands) for items in lists for each in items)


def derive_of(model):
    t = trace(model)
    (kernel,) = (k for k in kernels(t, model.derive(casadi_(), t.p), False) if k.name == "derive")
    return Operations(kernel.arguments, kernel.groups)


class Steps:
    """Steps of Newton's method for the roots of arguments, one argument after the other."""

    def __init__(self, arguments, steps):
        self.items, self.results = [], []
        for k in range(arguments):
            x = given = self.add(Operation(ARGUMENT, entry=(0, k)))
            # each argument has numbers of its own beside those of all
            own = self.add(Operation(NUMBER, value=1.0 + k))
            half = self.add(Operation(NUMBER, value=0.5))
            for _ in range(steps):
                ratio = self.add(Operation("DIV", (given, x)))
                before = x
                x = self.add(Operation("MUL", (half, self.add(Operation("ADD", (x, ratio))))))
            scaled = self.add(Operation("MUL", (own, x)))
            self.results.append([scaled] if k else [scaled, before])

    def add(self, operation):
        self.items.append(operation)
        return len(self.items) - 1


def test_steps_become_calls():
    """Of six arguments, one of whose functions gives a value more than the others."""
    steps = Steps(6, 60)
    short = outlined(steps.items, steps.results, "roots")
    arguments = [2.0, 3.0, 5.0, 7.0, 11.0, 13.0]
    want = values_of(steps.items, {}, arguments)
    got = values_of(short.items, short.called, arguments)
    assert [len(group) for group in short.results] == [2, 1, 1, 1, 1, 1]
    for before, after in zip(steps.results, short.results, strict=True):
        assert bits(want[k] for k in before) == bits(got[k] for k in after)
    assert got[short.results[0][0]] == pytest.approx(math.sqrt(2.0))
    assert short.called and 5 * count(short) < sum(bool(each.operands) for each in steps.items)


def test_operations_that_stand_once_stay():
    rng = np.random.default_rng(2)
    items = [Operation(ARGUMENT, entry=(0, 0)), Operation(ARGUMENT, entry=(0, 1))]
    for k in range(2, 500):
        kind = str(rng.choice(["ADD", "SUB", "MUL"]))
        items.append(Operation(kind, tuple(map(int, rng.integers(0, k, 2)))))
    short = outlined(items, [[499]], "once")
    assert short == Outlined(items, [[499]], {})


@pytest.mark.second
def test_the_branch_of_a_triad_is_short_and_has_the_same_bits():
    whole = derive_of(KnifeDrive)
    short = outlined(whole.items, whole.results, "derive")
    assert 4 * count(short) < sum(bool(each.operands) for each in whole.items)
    start = [v.quantity.start for v in KnifeDrive.parameter_layout.variables]
    for share in (0.0, 1e-3):
        p = [x * (1.0 + share * math.sin(k)) for k, x in enumerate(start)]
        want, got = values_of(whole.items, {}, p), values_of(short.items, short.called, p)
        (before,), (after,) = whole.results, short.results
        assert bits(want[k] for k in before) == bits(got[k] for k in after)


@pytest.mark.second
@pytest.mark.skipif(NODE is None, reason="no node, which runs the modules as a browser does")
def test_a_module_has_the_same_bits_with_functions_and_without(monkeypatch):
    start = np.array([v.quantity.start for v in KnifeDrive.parameter_layout.variables])
    written = partial(modules.wasm_module.__wrapped__, KnifeDrive, False)
    short = written()
    monkeypatch.setattr(modules, "outlined", lambda items, results, name: Outlined(items, results, {}))
    whole = written()
    assert 2 * len(short.content) < len(whole.content)
    found = []
    for each in (whole, short):
        d, steps = each.description, []
        for share in (0.0, 1e-3, -1e-3):
            p = start * (1.0 + share * np.sin(np.arange(len(start))))
            steps += [("write", d["parameters"]["address"], numbers(p)), ("call", "derive", [])]
            steps.append(("read", d["addresses"]["derived"], KnifeDrive.derived_count))
        found.append([x for x in in_node(each.content, steps) if x is not None])
    np.testing.assert_array_equal(*found)
    assert np.isfinite(found[0]).all()
