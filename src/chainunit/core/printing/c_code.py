"""C functions of symbolic expressions, in which each operation stands once.

CasADi would write a function for each group of outputs, with all its operations. Here the groups share operations: a
`Program` calls the parts of a `Division` that the requested groups need.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from .c_elementary import is_pair, own_forms
from .c_forms import forms, number
from .division import Division
from .operations import ARGUMENT, NUMBER, Operation, Operations

_LONGEST = 2500
"""Largest number of operations in a part."""
_WIDEST = 60
"""Largest number of characters of an operation that is written inline instead of on a line of its own."""


class Program:
    """Groups of results of the same arguments.

    `text` defines the function ``kernel_NAME(arg, res, w, wanted)``. Its arguments are the arguments of the program,
    the place of the results, memory for `room` numbers, and a set of bits, one for each requested group.
    """

    def __init__(
        self,
        name: str,
        arguments: Sequence[Any],
        groups: Sequence[Any],
        offsets: Sequence[int],
        frequency: str,
    ) -> None:
        """
        Parameters
        ----------
        arguments : symbols, as casadi vectors
        groups : results, as casadi vectors
        offsets : place of each group among the results
        frequency : frequency of calls, "OFTEN", "SELDOM" or "ONCE": for rare calls the time of the compiler counts
            more
        """
        self.name, self._frequency = name, frequency
        operations = Operations(arguments, groups)
        self._collect(operations)
        division = Division(operations.items, operations.results, _LONGEST)
        self._parts, self._needed_by, self._slots = division.parts, division.needed_by, division.slots
        self.room = len(self._slots)
        lines = [line for k, part in enumerate(self._parts) for line in self._part(k, part)]
        self.text = "\n".join([*lines, *self._function(offsets)]) + "\n"

    def _collect(self, operations: Operations) -> None:
        """Collect all operations: the form of each in C, and the places of its operands. A number and an argument are
        operations without operands."""
        in_c = forms() | own_forms()

        def form(operation: Operation) -> str:
            if operation.kind == NUMBER:
                return number(operation.value)
            argument, place = operation.entry
            return f"i{argument}[{place}]" if operation.kind == ARGUMENT else in_c[operation.kind]

        self._forms = [form(operation) for operation in operations.items]
        self._operands = [operation.operands for operation in operations.items]
        self._pairs = {k for k, operation in enumerate(operations.items) if is_pair(operation.kind)}
        self._arguments = {
            k: operation.entry for k, operation in enumerate(operations.items) if operation.kind == ARGUMENT
        }
        self._results = operations.results

    def _part(self, k: int, part: list[int]) -> list[str]:
        """The definition of a part."""
        lines: list[str] = []
        texts: dict[int, str] = {}
        calls: dict[str, str] = {}
        arguments = set()
        uses: dict[int, int] = {}
        for place in part:
            for n, operand in enumerate(self._operands[place]):
                uses[operand] = uses.get(operand, 0) + self._forms[place].count(f"{{{n}}}")

        def variable(place: int, text: str) -> str:
            lines.append(f"  const double a{place}={text};")
            return f"a{place}"

        def outside(place: int) -> str:
            text = f"w[{self._slots[place]}]" if self._operands[place] else self._forms[place]
            if place in self._arguments:
                arguments.add(self._arguments[place][0])
            elif not self._operands[place]:
                return text  # a number
            return variable(place, text) if uses[place] > 1 else text

        def one_of_two(place: int, text: str) -> str:
            """A result of a function with two, which is called once for both."""
            call, _, which = text.rpartition(".")
            if call not in calls:
                calls[call] = f"b{place}"
                lines.append(f"  const Two b{place}={call};")
            return f"{calls[call]}.{which}"

        for place in part:
            for operand in self._operands[place]:
                if operand not in texts:
                    texts[operand] = outside(operand)
            text = self._forms[place].format(*(texts[operand] for operand in self._operands[place]))
            inline = uses.get(place, 0) == 1 and len(text) <= _WIDEST and place not in self._slots
            if place in self._pairs:
                text, inline = one_of_two(place, text), True
            texts[place] = text if inline or place not in uses else variable(place, text)
            if place in self._slots:
                lines.append(f"  w[{self._slots[place]}]={texts[place]};")
        pointers = [f"  const double *i{n}=arg[{n}];" for n in sorted(arguments)] or ["  (void)arg;"]
        head = (
            f"{self._frequency} static void {self.name}_{k}(const double *const *arg, double *restrict w) {{"
        )
        return [head, "  ROUNDED_APART", *pointers, *lines, "}"]

    def _function(self, offsets: Sequence[int]) -> list[str]:
        """The definition of the function that calls the parts."""

        def result(place: int) -> str:
            if place in self._arguments:
                return "arg[{}][{}]".format(*self._arguments[place])
            return f"w[{self._slots[place]}]" if self._operands[place] else self._forms[place]

        lines = [
            f"static void kernel_{self.name}(const double *const *arg, double *res, double *w, unsigned wanted) {{"
        ]
        for k, groups in enumerate(self._needed_by):
            lines.append(f"  if(wanted&{groups}u) {self.name}_{k}(arg,w);")
        for bit, (places, offset) in enumerate(zip(self._results, offsets, strict=True)):
            if places:
                lines.append(f"  if(wanted&{1 << bit}u) {{")
                lines += [f"    res[{offset + n}]={result(place)};" for n, place in enumerate(places)]
                lines.append("  }")
        return [*lines, "  (void)arg,(void)w,(void)wanted;", "}"]
