"""Instructions of WebAssembly for lists of operations.

A value that one operation takes stays on the stack; others are kept in locals, which are used again as soon as
nothing needs their value, the first ones first: their numbers are short, and operations that stand again and again
have bytes that a packer finds again. Functions beyond the basic operations are those of
`chainunit.core.native.elementary`.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from functools import partial
from heapq import heappop, heappush

from ..errors import InputError
from ..native.elementary import OWN, ROOT_OF_HALF, recording
from ..native.operations import NUMBER, Operation
from ..native.recorder import CHOOSE, EXPONENT, MANTISSA, POWER2
from ..native.repeats import Called
from .encoding import Function, Module

Store = Callable[[int, Callable[[], None]], None]
"""Writes the value of an operation to memory, from its place and a function that pushes the value."""

_PLAIN = {
    "ADD": "add", "SUB": "sub", "MUL": "mul", "DIV": "div", "FMIN": "min", "FMAX": "max", "COPYSIGN": "copysign",
    "SQRT": "sqrt", "FABS": "abs", "NEG": "neg", "FLOOR": "floor", "CEIL": "ceil",
}  # fmt: skip
"""Operations that are one instruction."""
_COMPARISONS = {"LT": "f64.lt", "LE": "f64.le", "EQ": "f64.eq", "NE": "f64.ne"}
_CONDITIONS = {*_COMPARISONS, "NOT", "AND", "OR"}
_OFTEN = {"SQ": 2, "TWICE": 2, "SIGN": 3}
"""Operations that push their operand so many times."""
_DEEPEST = 60
"""Largest number of operations whose values stay on the stack one for the other."""
_DIGITS, _BIAS = 52, 1023
"""Binary digits of a number behind the first, and what is added to its exponent (IEEE 754)."""


class OwnFunctions:
    """The functions of a module that compute sine, arctangent and the like, and those that `add` brings, each written
    at its first use."""

    def __init__(self, module: Module) -> None:
        self._module = module
        self._added: dict[str, Called] = {}
        self._written: dict[str, Function] = {}

    def add(self, called: Mapping[str, Called]) -> None:
        """Functions for further kinds of operations."""
        self._added |= called

    def called(self, kind: str) -> Called | None:
        """The function that computes operations of this kind; None where none does."""
        if kind in self._added or kind not in OWN:
            return self._added.get(kind)
        function, arguments, result = OWN[kind]
        return Called(function.__name__, recording(kind), arguments, result)

    def of(self, kind: str) -> Function:
        """The function that computes operations of this kind.

        Raises
        ------
        InputError
            for an operation that no function computes.
        """
        called = self.called(kind)
        if called is None:
            raise InputError(
                f"{kind.lower()}: this function of an equation cannot be written as WebAssembly; a power x**y is "
                "exp(y*log(x)), the others follow from sin, cos, asin, acos, atan2, exp and log"
            )
        if called.key not in self._written:
            recorded = called.function
            own = self._module.function(["f64"] * called.arguments, ["f64"] * len(recorded.results))
            self._written[called.key] = own
            writer = Writer(own, self, recorded.items, lambda place: own.get(recorded.items[place].entry[1]))
            writer.write(range(len(recorded.items)), recorded.results)
            for place in recorded.results:
                writer.push(place)
        return self._written[called.key]


class Writer:
    """Writes operations as instructions of a function.

    Parameters
    ----------
    own : the module's functions beyond the basic operations
    items : operations, each after its operands
    outside : pushes the value of an operation that is not written here: an argument, or a value in memory
    """

    def __init__(
        self,
        function: Function,
        own: OwnFunctions,
        items: Sequence[Operation],
        outside: Callable[[int], None],
    ) -> None:
        self._function, self._own, self._items, self._outside = function, own, items, outside
        self._local: dict[int, int] = {}
        self._free: list[int] = []

    def write(self, places: Iterable[int], kept: Collection[int], store: Store | None = None) -> None:
        """Write the operations at these `places`, in order. The values of those `kept` stay in locals for `push`; or,
        with `store`, they are handed to ``store(place, push)``, which writes the value that ``push()`` pushes."""
        inside = [place for place in places if self._items[place].operands]
        self._plan(inside, kept)
        roots = [place for place in inside if place not in self._deferred]
        leaves = {root: list(dict.fromkeys(self._leaves(root))) for root in roots}
        last = {leaf: root for root in roots for leaf in leaves[root]}
        if store is None:
            last = {leaf: root for leaf, root in last.items() if leaf not in kept}
        for root in roots:
            for leaf in leaves[root]:
                if leaf not in self._local and leaf not in self._inside:
                    self._push_value(leaf)
                    self._keep(leaf)
            alone = store is not None and root in kept and root not in last
            if alone and root not in self._local and not self._twin(root):
                assert store is not None
                store(root, partial(self._push_value, root))
            elif root not in self._local:
                self._push_value(root)
                self._release(root, leaves, last)
                self._keep_results(root)
            self._release(root, leaves, last)
            if store is not None and root in kept and root in self._local:
                store(root, partial(self.push, root))
                if alone:
                    heappush(self._free, self._local.pop(root))

    def push(self, place: int) -> None:
        """Push the value of an operation."""
        if place in self._local:
            self._function.get(self._local[place])
        else:
            self._push_value(place)

    def _plan(self, inside: list[int], kept: Collection[int]) -> None:
        """Find the values that are taken once, and so need no local."""
        uses: dict[int, int] = {}
        for place in inside:
            each = self._items[place]
            for operand in each.operands:
                uses[operand] = uses.get(operand, 0) + _OFTEN.get(each.kind, 1)
        self._inside, self._uses = set(inside), uses
        self._deferred: set[int] = set()
        self._twins: dict[tuple[str, tuple[int, ...]], dict[int, int]] = {}
        sizes: dict[int, int] = {}
        for place in inside:
            each = self._items[place]
            if (called := self._twin(place)) is not None:
                self._twins.setdefault((called.key, each.operands), {})[called.result] = place
                continue
            sizes[place] = 1 + sum(sizes[k] for k in each.operands if k in self._deferred)
            if uses.get(place) == 1 and place not in kept and sizes[place] <= _DEEPEST:
                self._deferred.add(place)

    def _twin(self, place: int) -> Called | None:
        """The function that gives the value of this operation with that of another one, as sine and cosine."""
        called = self._own.called(self._items[place].kind)
        return called if called is not None and len(called.function.results) > 1 else None

    def _leaves(self, root: int) -> Iterator[int]:
        """The values in locals that an operation takes, with all that is not in a local behind it."""
        for operand in self._items[root].operands:
            if operand in self._deferred:
                yield from self._leaves(operand)
            elif operand in self._inside or self._uses[operand] > (
                2 if self._items[operand].kind == NUMBER else 1
            ):
                yield operand

    def _keep(self, place: int) -> None:
        self._local[place] = heappop(self._free) if self._free else self._function.local()
        self._function.set(self._local[place])

    def _keep_results(self, place: int) -> None:
        """Pop the value of an operation, or the values of one and its twins, into locals."""
        if (called := self._twin(place)) is None:
            self._keep(place)
            return
        places = self._twins[called.key, self._items[place].operands]
        for result in reversed(range(len(called.function.results))):
            if result in places:
                self._keep(places[result])
            else:
                self._function.do("drop")

    def _release(self, root: int, leaves: dict[int, list[int]], last: dict[int, int]) -> None:
        for leaf in leaves[root]:
            if last.get(leaf) == root and leaf in self._local:
                heappush(self._free, self._local.pop(leaf))

    def _push_value(self, place: int) -> None:
        """Push the value of an operation that is in no local, with the instructions that compute it."""
        each, f = self._items[place], self._function
        if each.kind == NUMBER:
            f.f64(each.value)
        elif place not in self._inside:
            self._outside(place)
        elif each.kind in _PLAIN:
            self._push_all(each)
            f.do(f"f64.{_PLAIN[each.kind]}")
        elif self._own.called(each.kind) is not None:
            function = self._own.of(each.kind)
            self._push_all(each)
            f.call(function)
        elif each.kind in _CONDITIONS:
            self._condition(place)
            f.do("f64.convert_i32_u")
        elif each.kind in (CHOOSE, "IF_ELSE_ZERO"):
            condition, *values = each.operands
            for value in values:
                self.push(value)
            if each.kind != CHOOSE:
                f.f64(0.0)
            self._condition(condition)
            f.do("select")
        else:
            self._push_other(each)

    def _push_all(self, each: Operation) -> None:
        for operand in each.operands:
            self.push(operand)

    def _push_other(self, each: Operation) -> None:
        """Push the value of an operation of several instructions."""
        f, a = self._function, each.operands[0]
        match each.kind:
            case "ASSIGN":
                self.push(a)
            case "SQ" | "TWICE":
                self.push(a)
                self.push(a)
                f.do("f64.mul" if each.kind == "SQ" else "f64.add")
            case "INV":
                f.f64(1.0)
                self.push(a)
                f.do("f64.div")
            case "SIGN":
                f.f64(-1.0)
                f.f64(1.0)
                self.push(a)
                self.push(a)
                f.f64(0.0)
                f.do("f64.gt", "select")
                self.push(a)
                f.f64(0.0)
                f.do("f64.lt", "select")
            case _:
                self._push_digits(each)

    def _push_digits(self, each: Operation) -> None:
        """Push the value of an operation on the digits of a number."""
        f = self._function
        if each.kind not in (EXPONENT, MANTISSA, POWER2):
            self._own.of(each.kind)
        self.push(each.operands[0])
        match each.kind:
            case "EXPONENT":
                f.do("i64.reinterpret_f64")
                f.i64(ROOT_OF_HALF)
                f.do("i64.sub")
                f.i64(_DIGITS)
                f.do("i64.shr_s", "f64.convert_i64_s")
            case "MANTISSA":
                f.do("i64.reinterpret_f64")
                f.i64(ROOT_OF_HALF)
                f.do("i64.sub")
                f.i64((1 << _DIGITS) - 1)
                f.do("i64.and")
                f.i64(ROOT_OF_HALF)
                f.do("i64.add", "f64.reinterpret_i64")
            case "POWER2":
                # the last digits of so large a number are those of a whole one
                f.f64(2.0**_DIGITS + _BIAS)
                f.do("f64.add", "i64.reinterpret_f64")
                f.i64(_DIGITS)
                f.do("i64.shl", "f64.reinterpret_i64")

    def _condition(self, place: int) -> None:
        """Push 1 where the value of an operation is not 0, else 0, as a whole number."""
        each, f = self._items[place], self._function
        if place in self._local or place not in self._inside or each.kind not in _CONDITIONS:
            self.push(place)
            f.f64(0.0)
            f.do("f64.ne")
        elif each.kind in _COMPARISONS:
            self._push_all(each)
            f.do(_COMPARISONS[each.kind])
        elif each.kind == "NOT":
            self._condition(each.operands[0])
            f.do("i32.eqz")
        else:
            for operand in each.operands:
                self._condition(operand)
            f.do("i32.and" if each.kind == "AND" else "i32.or")
