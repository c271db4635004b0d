"""The WebAssembly module of a model, and the description of its memory.

The module has the functions of the model (`chainunit.core.native.kernels`). Their arguments and results lie in
memory, at addresses that the description names.

``derive()``
    computes the derived values from the parameters; to be called after each change of a parameter
``requirements()``, ``start_limits()``
    value, lower and upper limit of each requirement on the parameters, and on the states at the start
``start()``
    the states at the start
``values(groups)``, ``derivatives()``
    the outputs of the groups that a set of bits names, and the derivatives of the states
``forward(groups)``
    the change of these outputs, and by one bit more of the derivatives, along changes of inputs and states
``run(begin, step, longest, rows, signals, chosen, into, groups)``
    a run in the time, see `chainunit.core.wasm.runs`; and ``dense(...)``, in fewer substeps, where the states have no
    constraints

The bytes follow from the equations alone. Each engine computes the same bits: the module calls no function of its
host.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from functools import lru_cache, partial
from typing import Any

from ..engines import casadi_
from ..model import Model, Requirement
from ..native.division import Division
from ..native.kernels import ModelFunction, groups_without_slopes, kernels, output_groups
from ..native.operations import ARGUMENT, NUMBER, Operations
from ..native.repeats import outlined
from ..quantities import Variable
from ..symbolic_trace import chosen_columns, outputs_of, trace
from .encoding import Function, Module
from .expressions import OwnFunctions, Writer
from .memory import ARGUMENTS, BYTES, Places, reserve
from .runs import RUN_PLACES, write_run

_BY_GROUP = ("values", "forward")
"""The kernels that compute the groups that are wanted; all others have one group."""
_RESULTS = {"guess": "unknowns", "initial": "states", "derive": "derived"}
"""The places of the results of kernels that have not the kernel's own name."""
_LONGEST = 2000
"""Largest number of operations in a function: compilers of some hosts take longer than in proportion."""


@dataclass(frozen=True)
class WasmModule:
    """A model as WebAssembly: the module, and the description of its memory, as JSON has it."""

    content: bytes
    description: Mapping[str, Any]


@lru_cache(maxsize=16)
def wasm_module(
    model: type[Model], slopes: bool = True, columns: tuple[str, ...] | None = None, derives: bool = True
) -> WasmModule:
    """The module of a model, deterministic to the byte.

    Parameters
    ----------
    slopes : whether it has ``forward``, which is the largest part of most
    columns : outputs, or quantities of `Model.further_quantities`, by name: the module has these alone, as one group,
        and no slopes; by default all outputs
    derives : whether it has ``derive``; without it the host writes the derived values

    Raises
    ------
    InputError
        for an equation with a function that the engines do not have, and a column that the model does not have.
    """
    t = trace(model)
    derived = model.derive(casadi_(), t.p) if model.derived_count else []
    outputs = outputs_of(model) if columns is None else chosen_columns(t, columns)
    groups = output_groups(model) if columns is None else [list(range(len(outputs)))]
    memory, module = reserve(model, len(outputs)), Module()
    own, written = OwnFunctions(module), {}
    for kernel in kernels(t, derived, slopes and columns is None, columns):
        if derives or kernel.name != "derive":
            written[kernel.name] = _kernel(kernel, groups, memory, module, own)
    if model.state_layout:
        _start(model, memory, module, written)
        write_run(t, memory, module, own, written)
    _fill(model, memory, module)
    return WasmModule(module.bytes_of(memory.size), _description(model, outputs, groups, memory, module))


def _kernel(
    kernel: ModelFunction, groups: list[list[int]], memory: Places, module: Module, own: OwnFunctions
) -> Function:
    """Write a kernel: a function for each part of its operations, and one that calls the needed parts."""
    operations = Operations(kernel.arguments, kernel.groups)
    items, results = operations.items, operations.results
    if kernel.frequency == "ONCE":
        short = outlined(items, results, kernel.name)
        items, results = short.items, short.results
        own.add(short.called)
    division = Division(items, results, _LONGEST)
    addresses = _addresses(kernel, groups, results, memory)
    # a result is computed to its place; one that stands twice, or is an argument or a number, is copied there
    kept: dict[int, int] = {}
    copies: list[list[tuple[int, int]]] = [[] for _ in results]
    for bit, (places, to) in enumerate(zip(results, addresses, strict=True)):
        for place, address in zip(places, to, strict=True):
            if place in division.slots and place not in kept:
                kept[place] = address
            else:
                copies[bit].append((place, address))
    slots = [place for place in division.slots if place not in kept]
    first = memory.room(f"{kernel.name} slots", len(slots))
    kept |= {place: first + BYTES * k for k, place in enumerate(slots)}
    starts = [memory[ARGUMENTS[letter]] for letter in kernel.takes]

    def push(function: Function, place: int) -> None:
        each = items[place]
        if each.kind == NUMBER:
            function.f64(each.value)
        elif each.kind == ARGUMENT:
            function.at(starts[each.entry[0]] + BYTES * each.entry[1])
        else:
            function.at(kept[place])

    parts = []
    for places in division.parts:
        part = module.function()
        writer = Writer(part, own, items, partial(push, part))
        writer.write(places, kept, partial(_store, part, kept))
        parts.append(part)
    function = module.function(["i32"] if kernel.name in _BY_GROUP else [], export=kernel.name)
    for part, bits in zip(parts, division.needed_by, strict=True):
        with _wanted(function, bits):
            function.call(part)
    for bit, pairs in enumerate(copies):
        if pairs:
            with _wanted(function, 1 << bit):
                for place, address in pairs:
                    with function.into(address):
                        push(function, place)
    return function


def _addresses(
    kernel: ModelFunction, groups: list[list[int]], results: list[list[int]], memory: Places
) -> list[list[int]]:
    """The address of each result, by group."""

    def row(name: str, places: Iterable[int]) -> list[int]:
        return [memory[name] + BYTES * k for k in places]

    if kernel.name not in _BY_GROUP:
        name = _RESULTS.get(kernel.name, kernel.name)
        return [row(name, range(len(places))) for places in results]
    if kernel.name == "values":
        return [row("outputs", group) for group in groups]
    # a group without slopes has no results
    rows = [
        row("output_slopes", group if places else ()) for group, places in zip(groups, results, strict=False)
    ]
    return [*rows, row("derivative_slopes", range(len(results[-1])))]


@contextmanager
def _wanted(function: Function, bits: int) -> Iterator[None]:
    """Instructions for these groups, of a function whose parameter has the bits of the groups that are wanted."""
    if not function.parameters:
        yield
        return
    function.get(0)
    function.i32(bits)
    function.do("i32.and")
    with function.when():
        yield


def _store(function: Function, addresses: Mapping[int, int], place: int, push: Callable[[], None]) -> None:
    with function.into(addresses[place]):
        push()


def _start(model: type[Model], memory: Places, module: Module, written: Mapping[str, Function]) -> None:
    """The function that computes the states at the start."""
    function, n = module.function(export="start"), model.start_problem.unknowns
    if n:
        function.call(written["guess"])
        round_ = function.local("i32")
        with function.counting(round_, model.start_problem.rounds):
            function.call(written["improved"])
            function.copy(memory["unknowns"], memory["improved"], BYTES * n)
    function.call(written["initial"])
    with function.into(memory["pace"]):
        function.f64(0.0)


def _fill(model: type[Model], memory: Places, module: Module) -> None:
    """The start values of parameters and inputs."""
    for name, layout in (("parameters", model.parameter_layout), ("inputs", model.input_layout)):
        module.fill(memory[name], [v.quantity.start or 0.0 for v in layout.variables])


def _description(
    model: type[Model], outputs: Sequence[Variable], groups: list[list[int]], memory: Places, module: Module
) -> dict[str, Any]:
    """Names and addresses of all that a host reads and writes."""

    def table(name: str, variables: Sequence[Variable]) -> dict[str, Any]:
        return {
            "address": memory[name],
            "names": [v.name for v in variables],
            "units": [v.unit for v in variables],
        }

    def rules(name: str, required: Sequence[Requirement]) -> dict[str, Any]:
        return {"address": memory[name], "rules": [asdict(each) for each in required]}

    states = model.state_layout.variables if model.state_layout else ()
    numbers = (
        "derived",
        "input_changes",
        "state_changes",
        "derivatives",
        "output_slopes",
        "derivative_slopes",
    )
    return {
        "model": model.name,
        "memory": {"free": memory.size},
        "parameters": table("parameters", model.parameter_layout.variables),
        "inputs": table("inputs", model.input_layout.variables),
        "states": table("states", states),
        "outputs": table("outputs", outputs),
        "groups": groups,
        "without_slopes": sorted(groups_without_slopes(model)),
        "requirements": rules("requirements", model.required),
        "start_limits": rules("start_limits", model.start_problem.required),
        "addresses": {name: memory[name] for name in (*numbers, *(RUN_PLACES if states else ()))},
        "functions": list(module.exports),
    }
