"""Code of operations over vectors of lanes: C for the processor, and CUDA for a GPU, by the same text. The header of
each language defines the vector and the operations on it.

The operations are divided by level: values that follow from uniform arguments alone are computed once, as numbers,
and are kept in ``U``; the others are computed for each vector of lanes.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

from .c_forms import c_file, forms, number
from .operations import ARGUMENT, NUMBER, Operation, Operations

_ARITHMETIC = {"ADD", "SUB", "MUL", "SQ", "TWICE", "NEG", "ASSIGN"}
"""Operations that C has for vectors, or for a vector and a number; all others are functions of vectors."""
_NAMES = {"CONSTPOW": "pow"}


def header(language: str = "c") -> str:
    """The vectors of a language, "c" or "cuda", and the operations of the code on them."""
    return c_file({"c": "lanes.h", "cuda": "cuda.h"}[language])


class VectorCode:
    """Code of `operations` in which the arguments `varying` are vectors and all others are uniform.

    `inputs` are the entries of the uniform arguments that are used, and `columns` the entries of the varying ones, in
    the order in which the code takes them.
    """

    def __init__(self, operations: Operations, varying: Sequence[tuple[int, int]]) -> None:
        operations = _uniform_divisors(operations, _varies(operations.items, varying))
        self._items, self._results = operations.items, operations.results
        self._varies = _varies(self._items, varying)
        self._forms = forms()
        entries = [operation.entry for operation in self._items if operation.kind == ARGUMENT]
        self.columns = [entry for entry in varying if entry in entries]
        self.inputs = [entry for entry in entries if entry not in self.columns]

    @cached_property
    def _slots(self) -> dict[int, int]:
        """By place of a uniform value that lanes or results need, its place in ``U``."""
        needed = {k for k, operation in enumerate(self._items) if self._varies[k] for k in operation.operands}
        needed |= {place for group in self._results for place in group}
        slots = [k for k in sorted(needed) if not self._varies[k] and self._items[k].kind != NUMBER]
        return {place: slot for slot, place in enumerate(slots)}

    @property
    def room(self) -> int:
        """Length of ``U``."""
        return max(1, len(self._slots))

    def _needed(self, places: set[int]) -> list[int]:
        """The places of all operations on which these depend, and they themselves, in order."""
        open_places, needed = list(places), set()
        while open_places:
            place = open_places.pop()
            if place not in needed:
                needed.add(place)
                open_places.extend(self._items[place].operands)
        return sorted(needed)

    def uniform(self) -> str:
        """The function ``uniform(in, U)`` from the uniform arguments, in the order of `inputs`."""
        lines = ["PER_ROW void uniform(const double *in, double *U) {"]
        places = {entry: k for k, entry in enumerate(self.inputs)}
        for k in self._needed(set(self._slots)):
            operation = self._items[k]
            if operation.kind == ARGUMENT:
                lines.append(f"  const double a{k}=in[{places[operation.entry]}];")
            elif operation.kind != NUMBER:
                lines.append(f"  const double a{k}={self._text(k, vectors=False)};")
        lines += [f"  U[{slot}]=a{k};" for k, slot in self._slots.items()]
        return "\n".join([*lines, "  (void)in,(void)U;", "}", ""])

    def body(self, name: str, groups: Sequence[int]) -> str:
        """The function ``name(U, a, y)`` from the vectors ``a`` of the varying arguments, in the order of `columns`;
        ``y`` are the results of these groups one after the other."""
        results = [place for group in groups for place in self._results[group]]
        columns = {entry: k for k, entry in enumerate(self.columns)}
        lines = [f"PER_VECTOR void {name}(const double *restrict U, const v *restrict a, v *restrict y) {{"]
        for k in self._needed({place for place in results if self._varies[place]}):
            operation = self._items[k]
            if not self._varies[k]:
                continue
            if operation.kind == ARGUMENT:
                lines.append(f"  const v a{k}=a[{columns[operation.entry]}];")
            else:
                lines.append(f"  const v a{k}={self._text(k, vectors=True)};")
        lines += [f"  y[{n}]={self._vector(place)};" for n, place in enumerate(results)]
        return "\n".join([*lines, "  (void)U,(void)a,(void)y;", "}", ""])

    def _value(self, place: int, vectors: bool) -> str:
        """The text of a value: a number, a uniform value, which lanes take from ``U``, or a variable."""
        operation = self._items[place]
        if operation.kind == NUMBER:
            return number(operation.value)
        if vectors and not self._varies[place]:
            return f"U[{self._slots[place]}]"
        return f"a{place}"

    def _vector(self, place: int) -> str:
        """The text of a value as a vector."""
        text = self._value(place, vectors=True)
        return text if self._varies[place] else f"V({text})"

    def _text(self, place: int, vectors: bool) -> str:
        operation = self._items[place]
        if not vectors or operation.kind in _ARITHMETIC:
            return self._forms[operation.kind].format(*(self._value(k, vectors) for k in operation.operands))
        name = _NAMES.get(operation.kind, operation.kind.lower())
        return f"{name}_v({','.join(self._vector(k) for k in operation.operands)})"


def _varies(items: Sequence[Operation], varying: Sequence[tuple[int, int]]) -> list[bool]:
    """Whether each operation depends on an argument that varies."""
    varies: list[bool] = []
    for operation in items:
        varies.append(
            (operation.kind == ARGUMENT and operation.entry in varying)
            or any(varies[k] for k in operation.operands)
        )
    return varies


def _uniform_divisors(operations: Operations, varies: Sequence[bool]) -> Operations:
    """The same results with products in place of divisions by a uniform number, whose inverse is computed once: a
    division takes as long as some ten products. A result changes by a unit in the last place."""
    items = list(operations.items)
    inverses: dict[int, int] = {}
    for k, operation in enumerate(operations.items):
        if operation.kind == "DIV" and varies[k] and not varies[divisor := operation.operands[1]]:
            if divisor not in inverses:
                inverses[divisor] = len(items)
                items.append(Operation("INV", (divisor,)))
            items[k] = Operation("MUL", (operation.operands[0], inverses[divisor]))
    return operations.rearranged(items)
