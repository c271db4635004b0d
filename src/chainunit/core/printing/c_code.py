"""C functions of symbolic expressions, in which each operation stands once.

CasADi would write a function for each group of outputs, with all its operations. Here the groups share operations: a
`Program` calls the parts of a `Division` that the requested groups need.
"""

from __future__ import annotations

from collections.abc import Mapping

from .c_elementary import own_forms
from .c_forms import forms, number
from .division import Division
from .elementary import is_pair
from .kernels import ModelFunction
from .operations import ARGUMENT, NUMBER, Operation, Operations

_LONGEST = 2500
"""Largest number of operations in a part."""
_WIDEST = 60
"""Largest number of characters of an operation that is written inline instead of on a line of its own."""


class Program:
    """The C code of a `function` of a model.

    `text` defines the function ``kernel_NAME(arg, res, w, wanted)``. Its arguments are the arguments of the function,
    the place of the results, memory for `room` numbers, and a set of bits, one for each requested group.
    """

    def __init__(self, function: ModelFunction) -> None:
        operations = Operations(function.arguments, function.groups)
        division = Division(operations.items, operations.results, _LONGEST)
        in_c = forms() | own_forms()
        self.name, self._frequency, self._items = function.name, function.frequency, operations.items
        self._forms = [_form(operation, in_c) for operation in operations.items]
        self._parts, self._slots = division.parts, division.slots
        self.room = len(division.slots)
        lines = [line for k, part in enumerate(division.parts) for line in self._part(k, part)]
        lines += [
            f"static void kernel_{self.name}(const double *const *arg, double *res, double *w, unsigned wanted) {{"
        ]
        lines += [
            f"  if(wanted&{bits}u) {self.name}_{k}(arg,w);" for k, bits in enumerate(division.needed_by)
        ]
        for bit, (places, offset) in enumerate(zip(operations.results, function.offsets, strict=True)):
            if places:
                lines.append(f"  if(wanted&{1 << bit}u) {{")
                lines += [f"    res[{offset + n}]={self._result(place)};" for n, place in enumerate(places)]
                lines.append("  }")
        self.text = "\n".join([*lines, "  (void)arg,(void)w,(void)wanted;", "}", ""])

    def _result(self, place: int) -> str:
        """A result: an argument, a number, or a value in the memory."""
        operation = self._items[place]
        if operation.kind == ARGUMENT:
            return "arg[{}][{}]".format(*operation.entry)
        return f"w[{self._slots[place]}]" if operation.operands else self._forms[place]

    def _part(self, k: int, part: list[int]) -> list[str]:
        """The definition of a part, line by line. A value that is long or used twice has a line and a name."""
        lines: list[str] = []
        texts: dict[int, str] = {}
        calls: dict[str, str] = {}
        arguments = set()
        uses: dict[int, int] = {}
        for place in part:
            for n, operand in enumerate(self._items[place].operands):
                uses[operand] = uses.get(operand, 0) + self._forms[place].count(f"{{{n}}}")

        def named(place: int, text: str) -> str:
            lines.append(f"  const double a{place}={text};")
            return f"a{place}"

        def outside(place: int) -> str:
            """A number, an argument, or a value of another part."""
            operation = self._items[place]
            if operation.kind == NUMBER:
                return self._forms[place]
            if operation.kind == ARGUMENT:
                arguments.add(operation.entry[0])
            text = f"w[{self._slots[place]}]" if operation.operands else self._forms[place]
            return named(place, text) if uses[place] > 1 else text

        def one_of_two(place: int, text: str) -> str:
            """A result of a function with two, which is called once for both."""
            call, _, which = text.rpartition(".")
            if call not in calls:
                calls[call] = f"b{place}"
                lines.append(f"  const Two b{place}={call};")
            return f"{calls[call]}.{which}"

        for place in part:
            operation = self._items[place]
            for operand in operation.operands:
                if operand not in texts:
                    texts[operand] = outside(operand)
            text = self._forms[place].format(*(texts[operand] for operand in operation.operands))
            inline = uses.get(place, 0) == 1 and len(text) <= _WIDEST and place not in self._slots
            if is_pair(operation.kind):
                text, inline = one_of_two(place, text), True
            texts[place] = text if inline or place not in uses else named(place, text)
            if place in self._slots:
                lines.append(f"  w[{self._slots[place]}]={texts[place]};")
        pointers = [f"  const double *i{n}=arg[{n}];" for n in sorted(arguments)] or ["  (void)arg;"]
        arguments_in_c = "const double *const *arg, double *restrict w"
        head = f"{self._frequency} static void {self.name}_{k}({arguments_in_c}) {{"
        return [head, "  ROUNDED_APART", *pointers, *lines, "}"]


def _form(operation: Operation, in_c: Mapping[str, str]) -> str:
    """An operation in C, with slots for its operands; a number and an argument have none."""
    if operation.kind == NUMBER:
        return number(operation.value)
    argument, place = operation.entry
    return f"i{argument}[{place}]" if operation.kind == ARGUMENT else in_c[operation.kind]
