"""Generated C has each operation once, gives the results of CasADi but for the last digits of its own functions, and
computes only requested outputs."""

from __future__ import annotations

import ctypes
import itertools
import re

import casadi
import numpy as np
import pytest

from chainunit.core.engines import casadi_
from chainunit.core.native.compilers import compile_code, compiler
from chainunit.core.printing import c_code
from chainunit.core.printing.c_elementary import header
from chainunit.core.printing.kernels import ModelFunction, kernels
from chainunit.fmu.description import Interface
from chainunit.models import MODELS

pytestmark = pytest.mark.skipif(compiler() is None, reason="no C compiler")
HEAD = f"""{header()}
#define OFTEN
static inline double sign(double x) {{ return x < 0.0 ? -1.0 : x > 0.0 ? 1.0 : x; }}
"""


@pytest.fixture
def called(tmp_path):
    """``called(program, arguments, wanted)``: the first 50 results, NaN where nothing was written."""
    numbers = itertools.count()

    def call(program, arguments, wanted):
        body = f"{{ kernel_{program.name}(a, r, w, {wanted}u); }}"
        shown = f"void shown(const double *const *a, double *r, double *w) {body}"
        files = {"a.c": f"{HEAD}{program.text}{shown}\n".encode()}
        flags = ("-std=c99", "-O2", "-fPIC", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror", "-shared")
        library = tmp_path / f"{next(numbers)}.so"
        library.write_bytes(compile_code(compiler(), (*flags, "a.c", "-o", "a.so", "-lm"), files, "a.so"))
        rows = [(ctypes.c_double * max(1, len(a)))(*a) for a in arguments]
        pointers = (ctypes.POINTER(ctypes.c_double) * len(rows))(*rows)
        results, memory = (ctypes.c_double * 50)(*[np.nan] * 50), (ctypes.c_double * (program.room + 1))()
        ctypes.CDLL(str(library)).shown(pointers, results, memory)
        return np.array(results)

    return call


def function(arguments, groups, offsets):
    return ModelFunction("some", "", arguments, groups, offsets, "OFTEN")


def expressions():
    """Two arguments, and groups that share operations, take one another's results, arguments and numbers."""
    a, b = casadi.SX.sym("a", 3), casadi.SX.sym("b", 2)
    s = casadi.sin(a[0] * b[1]) + casadi.sqrt(casadi.fabs(a[1]))
    turned = casadi.atan2(s, a[2]) ** 2
    first = casadi.vertcat(s, turned, a[1], 3.5)
    second = casadi.vertcat(casadi.fmin(s, b[0]) * 2.0, -turned / (1.0 + s * s), s)
    third = casadi.vertcat(
        casadi.if_else(a[0] < b[0], s, casadi.sign(a[2])), casadi.exp(-casadi.fabs(b[0])) ** 1.5
    )
    return [a, b], [first, second, third]


@pytest.mark.parametrize("longest", [1, 3, 2500])
def test_only_what_is_wanted_is_written_and_right(called, longest, monkeypatch):
    monkeypatch.setattr(c_code, "_LONGEST", longest)
    arguments, groups = expressions()
    offsets = [2, 10, 20]
    program = c_code.Program(function(arguments, groups, offsets))
    exact = casadi.Function("f", arguments, [casadi.vertcat(*groups)])
    rng = np.random.default_rng(1)
    for reference in (1, 2, 4, 5, 7):
        values = [rng.uniform(-2.0, 2.0, 3), rng.uniform(-2.0, 2.0, 2)]
        rows = np.split(np.array(exact(*values)).ravel(), np.cumsum([g.numel() for g in groups])[:-1])
        want = np.full(50, np.nan)
        for bit, (offset, row) in enumerate(zip(offsets, rows, strict=True)):
            if reference >> bit & 1:
                want[offset : offset + len(row)] = row
        np.testing.assert_allclose(called(program, values, reference), want, rtol=2e-15)


def test_each_operation_stands_once():
    arguments, groups = expressions()
    program = c_code.Program(function(arguments, groups, [0, 4, 7]))
    for operation in ("sine_and_cosine(", "sqrt(", "arctangent2(", "least_of(", "exponential("):
        assert program.text.count(operation) == 1, operation


@pytest.mark.parametrize("name", ["ChamberForces", "ChainUnitFlexible"])
def test_groups_of_a_model_share_their_operations(name):
    """Less than a tenth more than all outputs in one function, in parts that a compiler is fast with."""
    t = Interface(MODELS[name], {}).trace
    program = c_code.Program(next(kernels(t, [])))
    symbols, outputs = t.symbols, t.outputs
    single = casadi.Function("f", symbols, [casadi.cse(casadi.vertcat(*outputs))]).n_instructions()
    parts = re.split(r"static void values_", program.text)[1:]
    operations = sum(len(part) for part in program._parts)
    assert operations < 1.1 * single and len(parts) == len(program._parts)
    assert max(len(part) for part in program._parts) <= c_code._LONGEST


def test_every_operation_of_an_engine_is_known(called):
    xp = casadi_()
    x = casadi.SX.sym("x")
    rows = [xp.sin(x), xp.cos(x), xp.sqrt(x), xp.asin(x), xp.acos(x), xp.atan2(x, 2.0 * x), xp.abs(x)]
    rows += [xp.minimum(x, 0.3), xp.maximum(x, 0.3), x**3, 1.0 / x, -x, 2.0 - x, x * x]
    both = casadi.vertcat(*rows)
    both = casadi.vertcat(both, casadi.jtimes(both, x, casadi.SX(1.0)))
    program = c_code.Program(function([x], [both], [0]))
    for at in (0.2, 0.7):
        want = np.array(casadi.Function("f", [x], [both])(at)).ravel()
        np.testing.assert_allclose(called(program, [[at]], 1)[: len(want)], want, rtol=2e-15)


def test_numbers_of_any_kind():
    assert [c_code.number(x) for x in (1.5, -2.0, 0.0, -0.0, float("inf"), -float("inf"), float("nan"))] == [
        "1.5", "(-2.0)", "0.0", "(-0.0)", "INFINITY", "(-INFINITY)", "NAN",
    ]  # fmt: skip
