"""The binary format of WebAssembly: functions from instructions, and a module from functions.

A module has one memory, which it exports, and needs nothing from its host, unless it is written with imports. It
uses features that every engine has since 2021: version 1 of the format, functions with several results, and copies of
memory.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Literal

Type = Literal["i32", "i64", "f64"]

TYPES: dict[str, int] = {"i32": 0x7F, "i64": 0x7E, "f64": 0x7C}
PAGE = 65536
"""Bytes of a page of memory."""

_PLAIN = {
    "return": 0x0F, "drop": 0x1A, "select": 0x1B,
    "i32.eqz": 0x45, "i32.eq": 0x46, "i32.lt_s": 0x48, "i32.gt_s": 0x4A, "i32.ge_s": 0x4E, "i32.add": 0x6A,
    "i32.sub": 0x6B, "i32.mul": 0x6C, "i32.and": 0x71, "i32.or": 0x72,
    "i64.add": 0x7C, "i64.sub": 0x7D, "i64.and": 0x83, "i64.shl": 0x86, "i64.shr_s": 0x87,
    "f64.eq": 0x61, "f64.ne": 0x62, "f64.lt": 0x63, "f64.gt": 0x64, "f64.le": 0x65, "f64.ge": 0x66,
    "f64.abs": 0x99, "f64.neg": 0x9A, "f64.ceil": 0x9B, "f64.floor": 0x9C, "f64.sqrt": 0x9F,
    "f64.add": 0xA0, "f64.sub": 0xA1, "f64.mul": 0xA2, "f64.div": 0xA3, "f64.min": 0xA4, "f64.max": 0xA5,
    "f64.copysign": 0xA6, "f64.convert_i32_u": 0xB8, "f64.convert_i64_s": 0xB9, "i64.reinterpret_f64": 0xBD,
    "f64.reinterpret_i64": 0xBF,
}  # fmt: skip
"""Instructions without operands of their own, by name."""
_LOADS = {"i32": (0x28, 0x36, 2), "f64": (0x2B, 0x39, 3)}
"""Load, store and alignment by type."""


def unsigned(n: int) -> bytes:
    """A number from 0 on, as LEB128."""
    out = bytearray()
    while n > 0x7F:
        out.append(n & 0x7F | 0x80)
        n >>= 7
    return bytes([*out, n])


def signed(n: int) -> bytes:
    """A whole number, as signed LEB128."""
    out = bytearray()
    while not -64 <= n < 64:
        out.append(n & 0x7F | 0x80)
        n >>= 7
    return bytes([*out, n & 0x7F])


def vector(items: Sequence[bytes]) -> bytes:
    """A number of items, and the items."""
    return unsigned(len(items)) + b"".join(items)


def name_of(text: str) -> bytes:
    """A name: its length and its bytes."""
    return unsigned(len(text.encode())) + text.encode()


class Function:
    """A function of a module: its place `index` there, and its instructions, which are added one after the other.

    The first locals are its parameters. An address is a number of bytes from the begin of the memory; it is either on
    the stack, or known, and then `at` and `into` take it.
    """

    def __init__(self, index: int, parameters: Sequence[Type], results: Sequence[Type]) -> None:
        self.index, self.parameters, self.results = index, tuple(parameters), tuple(results)
        self._locals: list[Type] = []
        self._code = bytearray()

    def local(self, type: Type = "f64") -> int:
        """A new local, 0 at the begin."""
        self._locals.append(type)
        return len(self.parameters) + len(self._locals) - 1

    def do(self, *names: str) -> None:
        """Plain instructions by name."""
        self._code += bytes(_PLAIN[name] for name in names)

    def f64(self, x: float) -> None:
        """Push a number."""
        self._code += b"\x44" + struct.pack("<d", x)

    def i32(self, n: int) -> None:
        """Push a whole number."""
        self._code += b"\x41" + signed(n)

    def i64(self, n: int) -> None:
        """Push a whole number of 64 bits."""
        self._code += b"\x42" + signed(n)

    def get(self, *places: int) -> None:
        """Push locals."""
        for place in places:
            self._code += b"\x20" + unsigned(place)

    def set(self, place: int) -> None:
        """Pop a value into a local."""
        self._code += b"\x21" + unsigned(place)

    def call(self, function: Function) -> None:
        """Call a function, with its arguments on the stack."""
        self._code += b"\x10" + unsigned(function.index)

    def load(self, type: Type = "f64", offset: int = 0) -> None:
        """Replace the address on the stack by the value there, so many bytes further."""
        code, _, alignment = _LOADS[type]
        self._code += bytes([code, alignment]) + unsigned(offset)

    def store(self, type: Type = "f64", offset: int = 0) -> None:
        """Pop a value and an address; write the value there, so many bytes further."""
        _, code, alignment = _LOADS[type]
        self._code += bytes([code, alignment]) + unsigned(offset)

    def at(self, address: int, type: Type = "f64") -> None:
        """Push the value at a known address."""
        self.i32(0)
        self.load(type, address)

    @contextmanager
    def into(self, address: int, type: Type = "f64") -> Iterator[None]:
        """Write the value, which the instructions inside push, to a known address."""
        self.i32(0)
        yield
        self.store(type, address)

    def copy(self, to: int, of: int, size: int) -> None:
        """Copy so many bytes between known addresses."""
        self.i32(to)
        self.i32(of)
        self.i32(size)
        self._code += b"\xfc\x0a\x00\x00"

    @contextmanager
    def block(self) -> Iterator[None]:
        """Instructions behind whose end `leave` goes."""
        yield from self._nested(0x02)

    @contextmanager
    def loop(self) -> Iterator[None]:
        """Instructions to whose begin `leave` goes."""
        yield from self._nested(0x03)

    @contextmanager
    def when(self) -> Iterator[None]:
        """Instructions for a condition on the stack that is not 0."""
        yield from self._nested(0x04)

    def otherwise(self) -> None:
        """Instructions of the `when` around for the other case."""
        self._code.append(0x05)

    def _nested(self, code: int) -> Iterator[None]:
        self._code += bytes([code, 0x40])
        yield
        self._code.append(0x0B)

    def leave(self, depth: int) -> None:
        """Leave so many nested ones, and that around them."""
        self._code += b"\x0c" + unsigned(depth)

    def leave_if(self, depth: int) -> None:
        """`leave` for a condition on the stack that is not 0."""
        self._code += b"\x0d" + unsigned(depth)

    @contextmanager
    def counting(self, place: int, end: int, step: int = 1) -> Iterator[None]:
        """Repeat for the numbers in a local from 0 on by `step` to below a known end, of which there is one at
        least."""
        self.i32(0)
        self.set(place)
        with self.loop():
            yield
            self.get(place)
            self.i32(step)
            self.do("i32.add")
            self.set(place)
            self.get(place)
            self.i32(end)
            self.do("i32.lt_s")
            self.leave_if(0)

    @property
    def type(self) -> bytes:
        """Its type: parameters and results."""
        sides = (self.parameters, self.results)
        return b"\x60" + b"".join(vector([bytes([TYPES[each]]) for each in side]) for side in sides)

    @property
    def body(self) -> bytes:
        """Its locals and instructions."""
        runs: list[tuple[int, Type]] = []
        for each in self._locals:
            count = runs.pop()[0] if runs and runs[-1][1] == each else 0
            runs.append((count + 1, each))
        code = vector([unsigned(count) + bytes([TYPES[type]]) for count, type in runs]) + self._code + b"\x0b"
        return unsigned(len(code)) + code


class Module:
    """Functions, a memory and its content at the start; `bytes_of` gives the module."""

    def __init__(self) -> None:
        self.functions: list[Function] = []
        self.exports: dict[str, Function] = {}
        self._imports: list[tuple[bytes, Function]] = []
        self._content: list[tuple[int, bytes]] = []

    def function(
        self, parameters: Sequence[Type] = (), results: Sequence[Type] = (), export: str = ""
    ) -> Function:
        """A new function without instructions, exported by a name where one is given."""
        function = Function(len(self._imports) + len(self.functions), parameters, results)
        self.functions.append(function)
        if export:
            self.exports[export] = function
        return function

    def imported(self, host: str, name: str, parameters: Sequence[Type], results: Sequence[Type]) -> Function:
        """A function of another module, which is known by the name `host`; all of them before the own functions."""
        function = Function(len(self._imports), parameters, results)
        self._imports.append((name_of(host) + name_of(name), function))
        return function

    def fill(self, address: int, numbers: Sequence[float]) -> None:
        """Numbers in memory at the start."""
        if numbers:
            self._content.append((address, struct.pack(f"<{len(numbers)}d", *numbers)))

    def bytes_of(self, memory: int, memory_host: str = "") -> bytes:
        """The module, with so many bytes of memory, filled up to pages; the memory is the module's own, or that of
        the module with the name `memory_host`."""
        pages = b"\x00" + unsigned(-(-memory // PAGE))
        types = sorted({each.type for each in (*self.functions, *(each for _, each in self._imports))})
        imports = [name + b"\x00" + unsigned(types.index(each.type)) for name, each in self._imports]
        if memory_host:
            imports.append(name_of(memory_host) + name_of("memory") + b"\x02" + pages)
        exports = [_named(name, 0x00, each.index) for name, each in self.exports.items()]
        content = [
            b"\x00\x41" + signed(address) + b"\x0b" + unsigned(len(data)) + data
            for address, data in self._content
        ]
        sections = {
            1: vector(types),
            **({2: vector(imports)} if imports else {}),
            3: vector([unsigned(types.index(each.type)) for each in self.functions]),
            5: vector([] if memory_host else [pages]),
            7: vector([*([] if memory_host else [_named("memory", 0x02, 0)]), *exports]),
            10: vector([each.body for each in self.functions]),
            11: vector(content),
        }
        parts = [bytes([k]) + unsigned(len(data)) + data for k, data in sections.items()]
        return b"\x00asm\x01\x00\x00\x00" + b"".join(parts)


def _named(name: str, kind: int, index: int) -> bytes:
    return name_of(name) + bytes([kind]) + unsigned(index)
