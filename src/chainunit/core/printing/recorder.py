"""Functions of basic operations, written down as a list of operations from which code is printed.

CasADi would simplify sums that are only there to catch what a rounding lost; here each operation is kept as it
stands.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache, partialmethod
from typing import Any

from .operations import ARGUMENT, NUMBER, Operation

CHOOSE, EXPONENT, MANTISSA, POWER2 = "CHOOSE", "EXPONENT", "MANTISSA", "POWER2"
"""Kinds of operations beside those of CasADi: the second operand if the first one is not 0, else the third; the
nearest exponent of 2 of a number, and what that power is multiplied by; and 2 to the power of a whole number."""


@dataclass(frozen=True, slots=True)
class Recorded:
    """Operations, each after its operands, and the places of the results."""

    items: list[Operation]
    results: list[int]


@dataclass(slots=True)
class Recorder:
    """An engine of basic operations, see `chainunit.core.printing.elementary`. Its values are places in the list
    `items`, in which equal operations stand once."""

    items: list[Operation] = field(default_factory=list)
    _places: dict[str, int] = field(default_factory=dict)

    def add(self, operation: Operation) -> Noted:
        """The value of an operation."""
        key = repr(operation)  # 0 and -0 are equal, but not the same
        if key not in self._places:
            self._places[key] = len(self.items)
            self.items.append(operation)
        return Noted(self, self._places[key])

    def operation(self, kind: str, *operands: Any) -> Noted:
        """The value of an operation of this `kind` on values and numbers."""
        return self.add(Operation(kind, tuple(self._noted(x).place for x in operands)))

    def _noted(self, x: Any) -> Noted:
        return x if isinstance(x, Noted) else self.add(Operation(NUMBER, value=float(x)))

    sqrt = partialmethod(operation, "SQRT")
    abs = partialmethod(operation, "FABS")
    copysign = partialmethod(operation, "COPYSIGN")
    choose = partialmethod(operation, CHOOSE)
    exponent = partialmethod(operation, EXPONENT)
    mantissa = partialmethod(operation, MANTISSA)
    power2 = partialmethod(operation, POWER2)


class Noted:
    """A value of a `Recorder`, by its place."""

    __slots__ = ("place", "recorder")

    def __init__(self, recorder: Recorder, place: int) -> None:
        self.recorder, self.place = recorder, place

    def __neg__(self) -> Noted:
        return self.recorder.operation("NEG", self)

    def __lt__(self, other: Any) -> Noted:
        return self.recorder.operation("LT", self, other)

    def __gt__(self, other: Any) -> Noted:
        return self.recorder.operation("LT", other, self)


def _operator(name: str, kind: str) -> None:
    """Give `Noted` the operator of this name, also with a number on its left."""

    def forward(self: Noted, other: Any) -> Noted:
        return self.recorder.operation(kind, self, other)

    def reflected(self: Noted, other: Any) -> Noted:
        return self.recorder.operation(kind, other, self)

    setattr(Noted, f"__{name}__", forward)
    setattr(Noted, f"__r{name}__", reflected)


for _name, _kind in {"add": "ADD", "sub": "SUB", "mul": "MUL", "truediv": "DIV"}.items():
    _operator(_name, _kind)


@cache
def recorded(function: Callable[..., Any], arguments: int) -> Recorded:
    """The operations of ``function(xp, *arguments)``, which returns a value or several; argument k is entry (0,
    k)."""
    recorder = Recorder()
    places = [recorder.add(Operation(ARGUMENT, entry=(0, k))) for k in range(arguments)]
    results = function(recorder, *places)
    values = results if isinstance(results, tuple) else (results,)
    return Recorded(recorder.items, [value.place for value in values])
