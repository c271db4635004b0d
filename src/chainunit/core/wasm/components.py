"""The binary format of components: core modules behind typed interfaces, as the WebAssembly Component Model has them.

A component is written part by part; each part may use the parts before it by their indices, which the functions give
back. Types stand as text, as in WIT: ``list<f64>``, ``result<u64, status>``, ``option<f64>``, or the name of a type
that the scope has.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence

from .encoding import name_of, signed, unsigned, vector

_NUMBERS = "bool s8 u8 s16 u16 s32 u32 s64 u64 f32 f64 char string".split()
_PRIMITIVE = {name: bytes([0x7F - k]) for k, name in enumerate(_NUMBERS)}
_OF_TYPES = {"list": b"\x70", "tuple": b"\x6f", "option": b"\x6b", "result": b"\x6a"}
_HANDLES = {"own": b"\x69", "borrow": b"\x68"}

CORE_FUNCTION, CORE_MEMORY = "core function", "core memory"
FUNCTION, TYPE, INSTANCE = "function", "type", "instance"
_SORTS = {FUNCTION: b"\x01", TYPE: b"\x03", INSTANCE: b"\x05"}
_CORE_SORTS = {CORE_FUNCTION: b"\x00", CORE_MEMORY: b"\x02"}


def _external(text: str) -> bytes:
    """The name of an import or export."""
    return b"\x00" + name_of(text)


def arguments(text: str) -> list[str]:
    """The texts between the commas that stand in no bracket."""
    parts, depth = [""], 0
    for letter in text:
        depth += {"<": 1, ">": -1}.get(letter, 0)
        if letter == "," and not depth:
            parts.append("")
        else:
            parts[-1] += letter
    return [part.strip() for part in parts if part.strip()]


class Scope:
    """The types of a component, or of a type of instances, by name and by text."""

    def __init__(self) -> None:
        self.named: dict[str, int] = {}
        self._known: dict[bytes, int] = {}

    def _added(self, definition: bytes) -> int:
        """The index of a new type."""
        raise NotImplementedError

    def defined(self, definition: bytes) -> int:
        """The index of the type with that definition, which is new or known."""
        if definition not in self._known:
            self._known[definition] = self._added(definition)
        return self._known[definition]

    def type(self, text: str) -> bytes:
        """The type that a text names, as a part of another."""
        return _PRIMITIVE[text] if text in _PRIMITIVE else signed(self.index(text))

    def index(self, text: str) -> int:
        """The index of the type that a text names."""
        if text in _PRIMITIVE:
            return self.defined(_PRIMITIVE[text])
        if text in self.named:
            return self.named[text]
        outer, inner = re.fullmatch(r"(\w+)<(.+)>", text).groups()  # type: ignore[union-attr]
        parts = arguments(inner)
        if outer in _HANDLES:
            return self.defined(_HANDLES[outer] + unsigned(self.named[inner]))
        types = [self.type(part) for part in parts]
        if outer == "tuple":
            body = vector(types)
        elif outer == "result":
            body = b"".join(b"\x01" + each for each in types)
        else:
            (body,) = types
        return self.defined(_OF_TYPES[outer] + body)

    def enumeration(self, cases: Sequence[str]) -> int:
        """The type of one of these cases."""
        return self.defined(b"\x6d" + vector([name_of(each) for each in cases]))

    def record(self, fields: Mapping[str, str]) -> int:
        """The type of a record, with the types of its fields."""
        return self.defined(b"\x72" + self._labelled(fields))

    def function_type(self, parameters: Mapping[str, str], result: str) -> int:
        """The type of a function; no result where the text is empty."""
        results = b"\x00" + self.type(result) if result else b"\x01\x00"
        return self.defined(b"\x40" + self._labelled(parameters) + results)

    def _labelled(self, types: Mapping[str, str]) -> bytes:
        return vector([name_of(label) + self.type(text) for label, text in types.items()])


class InstanceType(Scope):
    """A type of instances: what an imported instance exports."""

    def __init__(self) -> None:
        super().__init__()
        self._declarations: list[bytes] = []
        self._types = 0

    def _added(self, definition: bytes) -> int:
        return self._declared(b"\x01" + definition)

    def _declared(self, declaration: bytes) -> int:
        self._declarations.append(declaration)
        self._types += 1
        return self._types - 1

    def outer(self, name: str, index: int) -> None:
        """A type of the component around, under its name."""
        at = self._declared(b"\x02\x03\x02\x01" + unsigned(index))
        self.exported(name, at)

    def exported(self, name: str, index: int) -> None:
        """Export a type."""
        self.named[name] = self._declared(b"\x04" + _external(name) + b"\x03\x00" + unsigned(index))

    def function(self, name: str, parameters: Mapping[str, str], result: str = "") -> None:
        """Export a function."""
        of_type = self.function_type(parameters, result)
        self._declarations.append(b"\x04" + _external(name) + b"\x01" + unsigned(of_type))

    @property
    def definition(self) -> bytes:
        """The type of the instances."""
        return b"\x42" + vector(self._declarations)


class Component(Scope):
    """A component, part by part."""

    def __init__(self) -> None:
        super().__init__()
        self._parts: list[bytes] = []
        self._counts: Counter[str] = Counter()

    def _part(self, section: int, content: bytes, kind: str = "") -> int:
        self._parts.append(bytes([section]) + unsigned(len(content)) + content)
        self._counts[kind] += 1
        return self._counts[kind] - 1

    def _one(self, section: int, item: bytes, kind: str = "") -> int:
        return self._part(section, b"\x01" + item, kind)

    def _added(self, definition: bytes) -> int:
        return self._one(7, definition, TYPE)

    def module(self, content: bytes) -> int:
        """A core module."""
        return self._part(1, content, "core module")

    def component(self, content: Component) -> int:
        """A component inside."""
        return self._part(4, content.content, "component")

    def core_instance(self, module: int, imports: Mapping[str, int]) -> int:
        """An instance of a core module, with the core instances for its imports, by the name of their module."""
        given = [name_of(name) + b"\x12" + unsigned(index) for name, index in imports.items()]
        return self._one(2, b"\x00" + unsigned(module) + vector(given), "core instance")

    def core_functions(self, functions: Mapping[str, int]) -> int:
        """A core instance of core functions."""
        exports = [name_of(name) + b"\x00" + unsigned(index) for name, index in functions.items()]
        return self._one(2, b"\x01" + vector(exports), "core instance")

    def core_export(self, instance: int, name: str, kind: str = CORE_FUNCTION) -> int:
        """A function or memory that a core instance exports."""
        item = b"\x00" + _CORE_SORTS[kind] + b"\x01" + unsigned(instance) + name_of(name)
        return self._one(6, item, kind)

    def export_of(self, instance: int, name: str, kind: str) -> int:
        """A type or function that an instance exports."""
        return self._one(6, _SORTS[kind] + b"\x00" + unsigned(instance) + name_of(name), kind)

    def imported(self, name: str, of_type: InstanceType) -> int:
        """An instance that the host gives."""
        index = self.defined(of_type.definition)
        return self._one(10, _external(name) + b"\x05" + unsigned(index), INSTANCE)

    def imported_type(self, name: str, bound: int | None) -> int:
        """A type that the host gives: the same as another, or, without one, any resource."""
        of = b"\x01" if bound is None else b"\x00" + unsigned(bound)
        return self._one(10, _external(name) + b"\x03" + of, TYPE)

    def imported_function(self, name: str, of_type: int) -> int:
        """A function that the host gives."""
        return self._one(10, _external(name) + b"\x01" + unsigned(of_type), FUNCTION)

    def resource(self, destructor: int) -> int:
        """A new type of resources, with the core function that ends one."""
        return self._one(7, b"\x3f\x7f\x01" + unsigned(destructor), TYPE)

    def resource_new(self, resource: int) -> int:
        """The core function that makes a handle of a resource from its number in the component."""
        return self._one(8, b"\x02" + unsigned(resource), CORE_FUNCTION)

    def lowered(self, function: int, memory: int) -> int:
        """A function as a core function; texts lie in the memory, in UTF-8."""
        options = vector([b"\x00", b"\x03" + unsigned(memory)])
        return self._one(8, b"\x01\x00" + unsigned(function) + options, CORE_FUNCTION)

    def lifted(self, function: int, of_type: int, memory: int, allocate: int, after: int) -> int:
        """A core function as a function of that type. Arguments lie in memory that `allocate` gives; `after` is
        called with its result once the host has read that."""
        options = [
            b"\x00",
            b"\x03" + unsigned(memory),
            b"\x04" + unsigned(allocate),
            b"\x05" + unsigned(after),
        ]
        item = b"\x00\x00" + unsigned(function) + vector(options) + unsigned(of_type)
        return self._one(8, item, FUNCTION)

    def instance(self, component: int, given: Mapping[str, tuple[str, int]]) -> int:
        """An instance of a component inside, with all that it imports: kind and index by name."""
        items = [name_of(name) + _SORTS[kind] + unsigned(index) for name, (kind, index) in given.items()]
        return self._one(5, b"\x00" + unsigned(component) + vector(items), INSTANCE)

    def exported(self, name: str, kind: str, index: int, of_type: int | None = None) -> int:
        """Export a part; a function as of that type. The export is a new part of that kind."""
        ascribed = b"\x00" if of_type is None else b"\x01\x01" + unsigned(of_type)
        return self._one(11, _external(name) + _SORTS[kind] + unsigned(index) + ascribed, kind)

    @property
    def content(self) -> bytes:
        """The component."""
        return b"\x00asm\x0d\x00\x01\x00" + b"".join(self._parts)
