"""Symbolic expressions as a list of operations, each after its operands.

CasADi traces a model's equations. Everything that computes them outside CasADi is made from this list: the C code of
FMUs and of batches, CUDA, JavaScript, Python, and the array code of numpy.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from typing import Any

NUMBER, ARGUMENT = "NUMBER", "ARGUMENT"
"""Kinds of the operations without operands."""


@dataclass(frozen=True, slots=True)
class Operation:
    """An operation: its `kind`, the name that CasADi gives it (``ADD``, ``SIN``), and the places of its operands. A
    number has its `value`; an argument has the number of the argument and the place in it, `entry`."""

    kind: str
    operands: tuple[int, ...] = ()
    value: float = 0.0
    entry: tuple[int, int] = (0, 0)


@cache
def _kinds() -> dict[int, str]:
    """CasADi's names of its operations by their numbers."""
    import casadi

    return {getattr(casadi, name): name[3:] for name in dir(casadi) if name.startswith("OP_")}


class Operations:
    """The operations of groups of results. Each operation stands once, numbers and arguments, too.

    `items` are the operations in an order in which each stands after its operands; `results` are the places of the
    results, by group.
    """

    def __init__(self, arguments: Sequence[Any], groups: Sequence[Any]) -> None:
        """
        Parameters
        ----------
        arguments : symbols, as casadi vectors
        groups : results, as casadi vectors
        """
        import casadi

        rows = casadi.densify(casadi.vertcat(*groups))
        function = casadi.Function("f", list(arguments), [casadi.cse(rows)])
        kinds = _kinds()
        self.items: list[Operation] = []
        places: dict[int, int] = {}  # by register of CasADi: place of its present value
        simple: dict[Any, int] = {}
        results = [0] * rows.numel()

        def add(operation: Operation) -> int:
            self.items.append(operation)
            return len(self.items) - 1

        def once(operation: Operation) -> int:
            # 0 and -0 are equal, but not the same
            key = repr(operation)
            if key not in simple:
                simple[key] = add(operation)
            return simple[key]

        for k in range(function.n_instructions()):
            kind = kinds[function.instruction_id(k)]
            into, inputs = function.instruction_output(k), function.instruction_input(k)
            if kind == "CONST":
                places[into[0]] = once(Operation(NUMBER, value=function.instruction_constant(k)))
            elif kind == "INPUT":
                places[into[0]] = once(Operation(ARGUMENT, entry=(inputs[0], inputs[1])))
            elif kind == "OUTPUT":
                results[into[1]] = places[inputs[0]]
            else:
                places[into[0]] = add(Operation(kind, tuple(places[i] for i in inputs)))
        ends = [0]
        for group in groups:
            ends.append(ends[-1] + group.numel())
        self.results = [results[begin:end] for begin, end in pairwise(ends)]

    def rearranged(self, items: Sequence[Operation]) -> Operations:
        """The same results from other `items`, whose order does not matter: needed operations are put in order.
        The first ones have the places of the present ones."""
        places: dict[int, int] = {}
        order: list[Operation] = []
        for result in (place for group in self.results for place in group):
            waiting = [result]
            while waiting:
                place = waiting[-1]
                missing = [k for k in items[place].operands if k not in places] if place not in places else []
                if missing:
                    waiting += reversed(missing)
                    continue
                waiting.pop()
                if place not in places:
                    operation = items[place]
                    places[place] = len(order)
                    order.append(replace(operation, operands=tuple(places[k] for k in operation.operands)))
        other = copy.copy(self)
        other.items = order
        other.results = [[places[place] for place in group] for group in self.results]
        return other
