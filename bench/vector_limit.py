"""The limit of the native engine on this machine: what its arithmetic takes at least, and what the memory takes.

Arithmetic. The generated code of a batch has for each vector so many sums, products, divisions, roots and
functions. A sum of a product that nothing else needs is one instruction with this product. So there remain
`instructions` of sums and products, each of which takes the time of such an instruction in a loop with 12 independent
chains; the same holds for comparisons, divisions, roots and functions (sine). Loads, stores and the checks of the
results count as if they cost nothing. With AVX-512 the code makes divisions and roots of products, and the limit is

    seconds per vector >= instructions * t_sum + divisions * t_division + roots * t_root + calls * t_call.

On other processors divisions and roots have a unit of their own beside that of sums and products, and the busier of
both units counts, as if the other one cost nothing.

Memory. The results are written once, past the cache. The limit is the rate at which the same number of threads fills
arrays of the same size by the same instruction and does nothing else; with pages that the system has just given, as
those of a new result, and with pages that are in use.
"""

from __future__ import annotations

import ctypes
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import Any

from figures import least

from chainunit.batch.equations import equations
from chainunit.batch.native import aligned, load
from chainunit.core.native.compilers import compiler
from chainunit.core.printing.vector_code import VectorCode, header

CHAINS, TURNS, ROUNDS = 12, 20_000, 30
SUMS = {"ADD", "SUB", "TWICE"}
PRODUCTS = {"MUL", "SQ"}
COMPARISONS = {"FMIN", "FMAX", "LT", "LE", "EQ", "NE", "IF_ELSE_ZERO"}
DIVISIONS = {"DIV", "INV"}
FREE = {"ARGUMENT", "NUMBER", "NEG", "FABS", "ASSIGN"}
"""Kinds that cost nothing, or little in a unit of their own."""

LOOP = """
double %(name)s(long turns) {
  v a[%(chains)d]; const v b = V(%(factor)s), c = V(1e-3); (void)b, (void)c;
  for (int k = 0; k < %(chains)d; ++k) a[k] = V(0.4 + 1e-3 * k);
  const double began = now();
  for (long n = 0; n < turns; ++n) {
    for (int k = 0; k < %(chains)d; ++k) { const v x = a[k]; a[k] = %(form)s; }
  }
  const double spent = now() - began;
  for (int k = 0; k < %(chains)d; ++k) sink += a[k];
  return spent;
}
"""
HEAD = """
#include <time.h>
static double now(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}
int width(void) { return W; }
#if defined NEAR_INVERSE
int divider(void) { return 0; }
#else
int divider(void) { return 1; }
#endif
v sink;
void fill(double *to, long n) {
  double from[64];
  for (int k = 0; k < 64; ++k) from[k] = k;
  for (long i = 0; i < n; i += 64) copy(to + i, from, n - i < 64 ? n - i : 64);
}
"""
FORMS = {"sum": "x * b + c", "division": "div_v(b, x)", "root": "sqrt_v(x)"}


@cache
def library(functions: Sequence[str] = ()) -> Any:
    """The compiled loops, with those of these functions of a vector."""
    more = {"atan2": ", 1.0 + x"}
    forms = FORMS | {name: f"{name}_v(0.1 + 0.1 * x{more.get(name, '')})" for name in functions}
    loops = [
        LOOP % {"name": f"loop_{name}", "chains": CHAINS, "factor": 0.999, "form": form}
        for name, form in forms.items()
    ]
    own = compiler()
    assert own is not None
    made = load(header() + HEAD + "".join(loops), own)
    for name in forms:
        getattr(made, f"loop_{name}").restype = ctypes.c_double
    return made


@cache
def width() -> int:
    """Number of lanes of a vector."""
    return int(library().width())


@cache
def divider() -> bool:
    """Whether divisions and roots go to a unit of their own."""
    return bool(library().divider())


@cache
def time_of(kind: str) -> float:
    """Seconds of an operation on a vector: "sum" (or product, or both), "division", "root", or a function."""
    made = library((kind,) if kind not in FORMS else ())
    call, turns = getattr(made, f"loop_{kind}"), TURNS if kind in FORMS else TURNS // 10
    return min(call(ctypes.c_long(turns)) for _ in range(ROUNDS)) / (turns * CHAINS)


def operations(model: Any, outputs: Sequence[str], varying: Sequence[str], by: Sequence[str] = ()) -> Counter:
    """Numbers of instructions on a vector, by kind, in the code of these outputs over arrays of these arguments."""
    own = equations(model, tuple(outputs), tuple(by))
    entries = {variable.name: entry for entry, variable in own.entries.items()}
    code = VectorCode(own.operations, [entries[name] for name in varying])
    uses: Counter = Counter(k for each in code._items for k in each.operands)
    uses.update(place for group in code._results for place in group)
    counts: Counter = Counter()
    merged: set[int] = set()
    for each, varies in zip(code._items, code._varies, strict=True):
        if not varies or each.kind in FREE:
            continue
        if each.kind in DIVISIONS:
            counts["division"] += 1
        elif each.kind == "SQRT":
            counts["root"] += 1
        elif each.kind in SUMS | PRODUCTS | COMPARISONS:
            counts["sum"] += 1
        else:
            counts[each.kind.lower()] += 1
        if each.kind in ("ADD", "SUB"):
            for k in each.operands:
                of = code._items[k]
                # a negated product is one with the sum, too
                k = of.operands[0] if of.kind == "NEG" and uses[k] == 1 else k
                if code._items[k].kind in PRODUCTS and code._varies[k] and uses[k] == 1 and k not in merged:
                    merged.add(k)
                    counts["sum"] -= 1
                    break
    return counts


def arithmetic(counts: Counter) -> float:
    """The largest number of states a second that a processor can compute."""
    own = {kind: n * time_of(kind) for kind, n in counts.items()}
    divided = own.get("division", 0.0) + own.get("root", 0.0)
    total = sum(own.values())
    return width() / (max(total - divided, divided) if divider() else total)


def bandwidth(columns: int, states: int, threads: int) -> dict[str, float]:
    """Bytes a second that so many threads write to the arrays of so many results: "fresh", to pages that the system
    has just given, and "used", to pages in use."""
    made, pieces = library(), 4 * threads
    size = columns * states // pieces // 64 * 64

    def filled(array: Any) -> None:
        address = array.ctypes.data

        def piece(k: int) -> None:
            made.fill(ctypes.c_void_p(address + 8 * k * size), ctypes.c_long(size))

        if threads == 1:
            for k in range(pieces):
                piece(k)
        else:
            with ThreadPoolExecutor(threads) as pool:
                list(pool.map(piece, range(pieces)))

    used, number = aligned((columns, states)), 8.0 * size * pieces
    return {
        "fresh": number / least(lambda: filled(aligned((columns, states)))).wall,
        "used": number / least(lambda: filled(used)).wall,
    }
