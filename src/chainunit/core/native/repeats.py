"""Operations that stand in a list again and again, as those of a step of Newton's method do, made functions.

The values are the same to the bit: each operation is carried out on the operands that it has in the list.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

from .operations import ARGUMENT, NUMBER, Operation
from .recorder import Recorded

_LENGTHS = (24, 48, 96, 192, 384)
"""Numbers of operations of the stretches that are compared first; stretches that go on alike are made longer."""
_OPERATION, _PASSED, _CALL = 4.5, 2.5, 12.0
"""Usual size of an operation, of an argument or result, and of all else of a call or function [bytes]."""
_WORTH = 200.0
"""Least number of bytes for which a function is made."""


class Called(NamedTuple):
    """What an operation of a kind computes: a result, by its place among them, of a function of so many arguments.
    Operations with the same `key` and operands are one call."""

    key: str
    function: Recorded
    arguments: int
    result: int


@dataclass(frozen=True)
class Outlined:
    """The `items` and `results` of a list, and by kind the operations that are results of functions, whose operands
    are the arguments."""

    items: list[Operation]
    results: list[list[int]]
    called: dict[str, Called]


def outlined(items: Sequence[Operation], results: Sequence[Sequence[int]], name: str) -> Outlined:
    """A list with functions for the operations that stand in it again and again; the kinds of its calls begin with
    the `name`."""
    now = Outlined(list(items), [list(group) for group in results], {})
    while (found := _Stretches(now).best()) is not None:
        now = found.replaced(f"{name} {len(now.called)}")
    return now


class _Stretches:
    """The stretches of a list: so many operations, one after the other, from the `starts` on."""

    def __init__(self, whole: Outlined) -> None:
        self.whole = whole
        self.places = [place for place, each in enumerate(whole.items) if each.operands]
        self.number = {place: n for n, place in enumerate(self.places)}
        # by operation, how many operations before it each of its operands stands; 0 for numbers and arguments
        self.back = [
            tuple(n - self.number.get(k, n) for k in whole.items[place].operands)
            for n, place in enumerate(self.places)
        ]
        # the last one of the operations that take its value; behind all for a result
        self.last = [0] * len(self.places)
        for n, place in enumerate(self.places):
            self._takes(n, whole.items[place].operands)
        for group in whole.results:
            self._takes(len(self.places), group)
        letters: dict[str, str] = {}
        kinds = [whole.items[place].kind for place in self.places]
        self.text = "".join(letters.setdefault(kind, chr(256 + len(letters))) for kind in kinds)
        # results of one call stay together
        calls = [None, *map(self._call, self.places), None]
        self.inside_call = [b is not None and a == b for a, b in pairwise(calls)]

    def _call(self, place: int) -> tuple[str, tuple[int, ...]] | None:
        """The call that an operation is a result of; None for another operation."""
        each = self.whole.items[place]
        called = self.whole.called.get(each.kind)
        return None if called is None else (called.key, each.operands)

    def _takes(self, n: int, operands: Sequence[int]) -> None:
        for k in operands:
            if k in self.number:
                self.last[self.number[k]] = n

    def best(self) -> _Repeat | None:
        """The stretches that spare most as a function; None where none is worth it."""
        candidates = sorted(self._candidates(), key=lambda each: -each[0])
        best, most = None, _WORTH
        for bound, length, starts in candidates:
            if bound <= most:
                break
            for group in self._alike(starts, length):
                repeat = _Repeat(self, group, self._extended(group, length))
                if repeat.spared > most:
                    best, most = repeat, repeat.spared
        return best

    def _candidates(self) -> Iterator[tuple[float, int, list[int]]]:
        """Stretches with the same kinds of operations, which do not overlap: a bound of the bytes that they spare,
        their length and their starts."""
        for length in _LENGTHS:
            starts: dict[str, list[int]] = {}
            for start in range(len(self.text) - length + 1):
                if not (self.inside_call[start] or self.inside_call[start + length]):
                    known = starts.setdefault(self.text[start : start + length], [start])
                    if start >= known[-1] + length:
                        known.append(start)
            before = ""
            for stretch, each in starts.items():
                # of stretches that begin one operation later each, the first
                if len(each) > 1 and not (stretch[:-1] == before[1:] and len(starts[before]) == len(each)):
                    # one that is twice as long or more stands among those of the next length
                    most = min(2 * length, self._room(each))
                    yield _OPERATION * most * (len(each) - 1), length, each
                before = stretch

    def _room(self, starts: Sequence[int]) -> int:
        """The length with which stretches from these starts on do not overlap."""
        return min(end - start for start, end in pairwise([*starts, len(self.text)]))

    def within(self, start: int, offset: int) -> tuple[int, ...]:
        """How many operations before an operation of a stretch each of its operands stands; 0 for those from
        outside."""
        back = self.back[start + offset]
        return back if max(back) <= offset else tuple(n if n <= offset else 0 for n in back)

    def _alike(self, starts: Sequence[int], length: int) -> list[list[int]]:
        """The starts of stretches whose operations take each other's values in the same way."""
        groups = defaultdict(list)
        for start in starts:
            groups[tuple(self.within(start, k) for k in range(length))].append(start)
        return [group for group in groups.values() if len(group) > 1]

    def _extended(self, starts: Sequence[int], length: int) -> int:
        """The length to which stretches are alike."""
        most, room = length, self._room(starts)
        while length < room:
            letter, taken = self.text[starts[0] + length], self.within(starts[0], length)
            if any(self.text[k + length] != letter or self.within(k, length) != taken for k in starts):
                break
            length += 1
            if not any(self.inside_call[start + length] for start in starts):
                most = length
        return most


class _Repeat:
    """Stretches that are alike, as calls of one function."""

    def __init__(self, of: _Stretches, starts: Sequence[int], length: int) -> None:
        self._of, self._starts, self._length = of, starts, length
        items = of.whole.items
        # by operand from outside, its places in all stretches: equal ones are one argument, equal numbers none
        self._outside: dict[tuple[int, int], tuple[int, ...]] = {}
        for offset in range(length):
            for k, back in enumerate(of.within(starts[0], offset)):
                if not back:
                    self._outside[offset, k] = tuple(
                        items[of.places[start + offset]].operands[k] for start in starts
                    )
        taken = dict.fromkeys(self._outside.values())
        self._numbers = [each for each in taken if items[each[0]].kind == NUMBER and len(set(each)) == 1]
        self._arguments = [each for each in taken if each not in set(self._numbers)]
        # the operations of each stretch whose values are taken outside it
        self._used = [
            {offset for offset in range(length) if of.last[start + offset] >= start + length}
            for start in starts
        ]
        self._given = sorted(set().union(*self._used))

    @property
    def spared(self) -> float:
        """The bytes that it spares, about."""
        calls = len(self._starts)
        passed = _PASSED * (len(self._arguments) + len(self._given)) + _CALL
        return _OPERATION * self._length * (calls - 1) - passed * (calls + 1)

    def _function(self) -> Recorded:
        of, start = self._of, self._starts[0]
        items = of.whole.items
        own = [Operation(ARGUMENT, entry=(0, k)) for k in range(len(self._arguments))]
        own += [items[each[0]] for each in self._numbers]
        place_of = {each: k for k, each in enumerate([*self._arguments, *self._numbers])}
        first = len(own)
        for offset in range(self._length):
            each = items[of.places[start + offset]]
            operands = [
                first + offset - back if back else place_of[self._outside[offset, k]]
                for k, back in enumerate(of.within(start, offset))
            ]
            own.append(replace(each, operands=tuple(operands)))
        return Recorded(own, [first + offset for offset in self._given])

    def replaced(self, key: str) -> Outlined:
        """The list with calls of the function in place of its stretches."""
        whole, function = self._of.whole, self._function()
        kinds = [f"{key}:{k}" for k in range(len(self._given))]
        called = {kind: Called(key, function, len(self._arguments), k) for k, kind in enumerate(kinds)}
        items: list[Operation] = []
        places: dict[int, int] = {}
        own = {self._of.places[s + k]: n for n, s in enumerate(self._starts) for k in range(self._length)}
        for place, each in enumerate(whole.items):
            if place not in own:
                places[place] = len(items)
                items.append(replace(each, operands=tuple(places[k] for k in each.operands)))
                continue
            n = own[place]
            stretch = self._of.places[self._starts[n] : self._starts[n] + self._length]
            if place == stretch[-1]:
                # numbers and arguments stand between the operations
                operands = tuple(places[argument[n]] for argument in self._arguments)
                for kind, offset in zip(kinds, self._given, strict=True):
                    if offset in self._used[n]:
                        places[stretch[offset]] = len(items)
                        items.append(Operation(kind, operands))
        results = [[places[place] for place in group] for group in whole.results]
        return Outlined(items, results, whole.called | called)
