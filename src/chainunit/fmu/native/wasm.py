"""FMUs for WebAssembly: a component of the draft FMI-LS-WASM beside the native libraries.

The draft is that of https://github.com/modelica/fmi-ls-wasm at commit `DRAFT`. A compiler makes a core module from
the C sources of the FMU and ``component.c``; this module puts it behind the interfaces of the draft. The component
imports the function for messages alone, and nothing of WASI.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator, Mapping, Sequence
from xml.etree.ElementTree import Element, register_namespace

from ...core.errors import InputError
from ...core.native.compilers import Compiler, zig_compiler
from ...core.wasm.components import (
    CORE_MEMORY,
    FUNCTION,
    INSTANCE,
    TYPE,
    Component,
    InstanceType,
    Scope,
    arguments,
)
from ...core.wasm.encoding import PAGE, Module, Type
from ..pack import xml_bytes
from .platforms import compile_with_kernels

DRAFT, VERSION = "c1aac17", "0.1.0"
NAME, FOLDER = "org.modelica.fmi-ls-wasm", "binaries/wasm32-wasip2"
_MANIFEST = "http://fmi-standard.org/fmi-ls-manifest"
_LAYER, COMPONENT = "fmi3.c", "component.c"

_STACK, _MEMORY = 16 * PAGE, 48 * PAGE
"""Bytes of the stack, and of the memory at first."""
_FLAGS = ("-target", "wasm32-wasi", "-std=c99", "-O2", "-fvisibility=hidden", "-ffp-contract=off")
_LINK = (
    "-mexec-model=reactor",
    "-nostartfiles",
    "-s",
    "-Wl,--no-entry,--import-memory",
    f"-Wl,-z,stack-size={_STACK},--initial-memory={_MEMORY}",
)

_PACKAGE = "fmi:fmi3/{}@3.0.0"
_ENUMERATIONS = {
    "status": "ok warning discard error fatal",
    "interval-qualifier": "interval-not-yet-known interval-unchanged interval-changed",
    "dependency-kind": "dependent constant fixed tunable discrete",
}
_RECORDS = {
    "interval-fraction": "counter: u64, resolution: u64",
    "variable-dependency": "dependent-value-reference: u32, element-index-of-dependent: u32, "
    "independent-value-reference: u32, element-index-of-independent: u32, kind: dependency-kind",
    "discrete-states-info": "new-discrete-states-needed: bool, terminate-simulation: bool, "
    "nominals-of-continuous-states-changed: bool, values-of-continuous-states-changed: bool, "
    "next-event-time-defined: bool, next-event-time: f64",
}
_PLAIN = {"value-reference": "u32", "fmu-state": "list<u8>"}
_USED = ("value-reference", "status", "fmu-state", "interval-qualifier", *_RECORDS)
"""The shared types that each interface of instances exports again."""
_VRS = "value-references: list<u32>"
_VALUES = (
    "float32 float64 int8 int16 int32 int64 uint8 uint16 uint32 uint64 boolean string binary clock".split()
)
_KINDS = {"boolean": "bool", "clock": "bool", "string": "string", "binary": "list<u8>"}


def _kind(name: str) -> str:
    return _KINDS.get(name) or name.replace("float", "f").replace("uint", "u").replace("int", "s")


_COMMON = {
    "set-debug-logging": "logging-on: bool, categories: list<string> -> status",
    "enter-initialization-mode": "tolerance: option<f64>, start-time: f64, stop-time: option<f64> -> status",
    "exit-initialization-mode": "-> status",
    "enter-event-mode": "-> status",
    "update-discrete-states": "-> result<discrete-states-info, status>",
    "terminate": "-> status",
    "reset": "-> status",
    "enter-configuration-mode": "-> status",
    "exit-configuration-mode": "-> status",
    **{f"get-{name}": f"{_VRS} -> result<list<{_kind(name)}>, status>" for name in _VALUES},
    **{f"set-{name}": f"{_VRS}, values: list<{_kind(name)}> -> status" for name in _VALUES},
    "get-number-of-variable-dependencies": "vr: u32 -> result<u64, status>",
    "get-variable-dependencies": "dependent: u32 -> result<list<variable-dependency>, status>",
    "get-fmu-state": "-> result<list<u8>, status>",
    "set-fmu-state": "state: list<u8> -> status",
    "get-directional-derivative": "unknowns: list<u32>, knowns: list<u32>, seed: list<f64> "
    "-> result<list<f64>, status>",
    "get-adjoint-derivative": "unknowns: list<u32>, knowns: list<u32>, seed: list<f64> "
    "-> result<list<f64>, status>",
    "get-interval-decimal": f"{_VRS} -> result<list<tuple<f64, interval-qualifier>>, status>",
    "get-interval-fraction": f"{_VRS} -> result<list<tuple<interval-fraction, interval-qualifier>>, status>",
    "get-shift-decimal": f"{_VRS} -> result<list<f64>, status>",
    "get-shift-fraction": f"{_VRS} -> result<list<interval-fraction>, status>",
    "set-interval-decimal": f"{_VRS}, intervals: list<f64> -> status",
    "set-interval-fraction": f"{_VRS}, intervals: list<interval-fraction> -> status",
    "set-shift-decimal": f"{_VRS}, shifts: list<f64> -> status",
    "set-shift-fraction": f"{_VRS}, shifts: list<interval-fraction> -> status",
    "evaluate-discrete-states": "-> status",
    "get-output-derivatives": "requests: list<tuple<u32, u32>> -> result<list<f64>, status>",
    "enter-step-mode": "-> status",
}
_NAMES = (
    "instance-name: string, instantiation-token: string, resource-path: string, visible: bool, "
    "logging-on: bool"
)
_OF_STEPS = {
    "set-input-derivatives": "requests: list<tuple<u32, u32>>, values: list<f64> -> status",
    "do-step": "current-communication-point: f64, communication-step-size: f64, "
    "no-set-fmu-state-prior-to-current-point: bool -> result<do-step-result, status>",
}
_OF_EXCHANGE = {
    "enter-continuous-time-mode": "-> status",
    "set-time": "time: f64 -> status",
    "set-continuous-states": "continuous-states: list<f64> -> status",
    "get-continuous-state-derivatives": "-> result<list<f64>, status>",
    "get-event-indicators": "-> result<list<f64>, status>",
    "get-continuous-states": "-> result<list<f64>, status>",
    "get-nominals-of-continuous-states": "-> result<list<f64>, status>",
    "get-number-of-event-indicators": "-> result<u64, status>",
    "get-number-of-continuous-states": "-> result<u64, status>",
    "completed-integrator-step": "no-set-fmu-state-prior-to-current-point: bool "
    "-> result<completed-step-result, status>",
}
_INTERFACES = {
    "co-simulation": (
        f"{_NAMES}, event-mode-used: bool, early-return-allowed: bool, "
        "required-intermediate-variables: list<u32>",
        "do-step-result",
        "last-successful-time: f64, event-handling-needed: bool, terminate-simulation: bool, early-return: bool",
        _COMMON | _OF_STEPS,
    ),
    "model-exchange": (
        _NAMES,
        "completed-step-result",
        "enter-event-mode: bool, terminate-simulation: bool",
        _COMMON | _OF_EXCHANGE,
    ),
}
"""For each interface: the parameters that make an instance, its own record, and its functions."""


def wasm_compiler(fmi: int) -> Compiler:
    """The compiler for WebAssembly, for an FMU of that version of FMI.

    Raises
    ------
    InputError
        where there is none, and for FMI 2, of which the draft says nothing.
    """
    if fmi != 3:
        raise InputError("--wasm: the draft of FMUs for WebAssembly is of FMI 3.0; export with --fmi 3")
    if (able := zig_compiler()) is None:
        raise InputError("--wasm: needs zig, a C compiler for WebAssembly: pip install 'chainunit[cross]'")
    return able


def wasm_files(
    compiler: Compiler, identifier: str, sources: Mapping[str, bytes], layer: bytes, units: Sequence[str]
) -> dict[str, bytes]:
    """The component of an FMU and its manifest, by their path inside the FMU.

    Parameters
    ----------
    compiler : see `wasm_compiler`
    identifier : model identifier, the component's name
    sources : C files of the FMU by name
    layer : ``component.c``
    units : names of the C files that a native library is compiled from

    Raises
    ------
    RunError
        where the compiler fails, with its messages.
    """
    names = [COMPONENT if name == _LAYER else name for name in units]
    core = compile_with_kernels(
        compiler, _FLAGS, _LINK, dict(sources) | {COMPONENT: layer}, names, f"{identifier}.core.wasm"
    )
    register_namespace("fmi-ls", _MANIFEST)
    root = Element("fmiLayeredStandardManifest")
    for key, value in (
        ("name", NAME), ("version", VERSION), ("description", "FMI Layered Standard for WebAssembly")
    ):  # fmt: skip
        root.set(f"{{{_MANIFEST}}}fmi-ls-{key}", value)
    # the draft names the first; FMI 3.0 the second
    manifests = {f"extra/{NAME}/{name}": xml_bytes(root) for name in ("manifest.xml", "fmi-ls-manifest.xml")}
    return {f"{FOLDER}/{identifier}.wasm": component(core)} | manifests


def component(core: bytes) -> bytes:
    """The component of the draft around a core module that ``component.c`` is part of."""
    whole = Component()
    shared = InstanceType()
    for name in _shared_types(shared):
        shared.exported(name, shared.named[name])
    types = whole.imported(_PACKAGE.format("types"), shared)
    for name in shared.named:
        whole.named[name] = whole.export_of(types, name, TYPE)
    callbacks = InstanceType()
    callbacks.outer("status", whole.named["status"])
    callbacks.function(
        "log-message", _split("instance-name: string, status: status, category: string, message: string")
    )
    host = whole.imported(_PACKAGE.format("callbacks"), callbacks)
    lowered_in = whole.core_instance(whole.module(Module().bytes_of(_MEMORY)), {})
    memory = whole.core_export(lowered_in, "memory", CORE_MEMORY)
    log = whole.lowered(whole.export_of(host, "log-message", FUNCTION), memory)
    given = {
        "env": lowered_in,
        _PACKAGE.format("callbacks"): whole.core_functions({"log-message": log}),
    }
    main = whole.core_instance(whole.module(core), given)
    of_main = functools.cache(functools.partial(whole.core_export, main))
    resources = {kind: whole.resource(of_main("drop")) for kind in _INTERFACES}
    makers = _makers(whole, resources, main, lowered_in)

    def lift(function: int, of_type: int) -> int:
        return whole.lifted(function, of_type, memory, of_main("realloc"), of_main("done"))

    version = {"get-version": (FUNCTION, lift(of_main("get-version"), whole.function_type({}, "string")))}
    whole.exported(_PACKAGE.format("common"), INSTANCE, whole.instance(whole.component(_common()), version))
    for kind, (making, record, fields, functions) in _INTERFACES.items():
        resource = f"{kind}-instance"
        whole.named |= {resource: resources[kind], record: whole.record(_split(fields))}
        every = {f"[static]{resource}.instantiate-{kind}": f"{making} -> option<own<{resource}>>"}
        every |= {
            f"[method]{resource}.{name}": f"self: borrow<{resource}>, {text}"
            for name, text in functions.items()
        }
        inside = {name: (TYPE, whole.named[name]) for name in (*shared.named, record, resource)}
        for name, text in every.items():
            plain = name.rpartition(".")[2]
            core_function = makers[kind] if plain == f"instantiate-{kind}" else of_main(plain)
            inside[plain] = (FUNCTION, lift(core_function, _function(whole, text)))
        named = whole.component(_named(resource, record, fields, every))
        whole.exported(_PACKAGE.format(kind), INSTANCE, whole.instance(named, inside))
    return whole.content


def _common() -> Component:
    """The component that names the function of the interface without instances."""
    inside = Component()
    of_type = inside.function_type({}, "string")
    inside.exported("get-version", FUNCTION, inside.imported_function("get-version", of_type), of_type)
    return inside


def _shared_types(scope: Scope) -> Iterator[str]:
    """Define the shared types one after the other; the caller may name each by another index before the next."""
    for name, text in _PLAIN.items():
        scope.named[name] = scope.index(text)
        yield name
    for name, cases in _ENUMERATIONS.items():
        scope.named[name] = scope.enumeration(cases.split())
        yield name
    for name, fields in _RECORDS.items():
        scope.named[name] = scope.record(_split(fields))
        yield name


def _named(resource: str, record: str, fields: str, functions: Mapping[str, str]) -> Component:
    """The component that gives the functions of an interface their names, and their types those of the interface: it
    imports each part and exports it."""
    inside = Component()
    for name in _shared_types(inside):
        inside.named[name] = inside.imported_type(name, inside.named[name])
    inside.named[resource] = inside.imported_type(resource, None)
    inside.named[record] = inside.imported_type(record, inside.record(_split(fields)))
    taken = {
        name: inside.imported_function(name.rpartition(".")[2], _function(inside, text))
        for name, text in functions.items()
    }
    for name in (*_USED, record, resource):
        inside.named[name] = inside.exported(name, TYPE, inside.named[name])
    for name, index in taken.items():
        inside.exported(name, FUNCTION, index, _function(inside, functions[name]))
    return inside


def _makers(whole: Component, resources: Mapping[str, int], main: int, memory: int) -> dict[str, int]:
    """For each kind of instances the core function that makes one: that of the main module gives the number of the
    instance in the component, and this one puts the handle of a resource in its place."""
    module, imported = Module(), []
    for kind, (making, *_) in _INTERFACES.items():
        parameters: list[Type] = ["i32"] * sum(
            2 if "<" in of or of == "string" else 1 for of in _split(making).values()
        )
        name = f"instantiate-{kind}"
        make = module.imported("main", name, parameters, ["i32"])
        imported.append((name, make, module.imported("handles", kind, ["i32"], ["i32"])))
    for name, make, handle in imported:
        function = module.function(make.parameters, ["i32"], name)
        result = function.local("i32")
        function.get(*range(len(make.parameters)))
        function.call(make)
        function.set(result)
        function.get(result)
        function.load("i32")
        with function.when():
            function.get(result, result)
            function.load("i32", 4)
            function.call(handle)
            function.store("i32", 4)
        function.get(result)
    handles = whole.core_functions({kind: whole.resource_new(index) for kind, index in resources.items()})
    content = whole.module(module.bytes_of(PAGE, "env"))
    made = whole.core_instance(content, {"main": main, "handles": handles, "env": memory})
    return {kind: whole.core_export(made, f"instantiate-{kind}") for kind in _INTERFACES}


def _function(scope: Scope, text: str) -> int:
    """The type of a function, from the text of its parameters and its result."""
    parameters, _, result = text.rpartition("->")
    return scope.function_type(_split(parameters), result.strip())


def _split(text: str) -> dict[str, str]:
    """Types by label."""
    return dict(part.split(": ") for part in arguments(text))
