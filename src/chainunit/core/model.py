"""A model: declarations, and equations written for any engine `xp`."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property, reduce
from importlib import import_module
from types import MappingProxyType
from typing import Any, NamedTuple, Self

from .bounds import refusal
from .engines import MATH
from .errors import GeometryError, InputError
from .quantities import Layout, Variable, violations, within_bounds


@dataclass(frozen=True)
class Requirement:
    """A condition on the parameters beyond their own bounds: `subject` in `unit` lies strictly between two limits,
    which the model's `requirements` compute.

    `why` says what happens if the condition is not met; the refusal names the parameters of `context` with their
    values. `depends` are further parameters that set the limits. `remedy` says what to do if no value fits.
    """

    subject: str
    unit: str
    why: str
    context: tuple[str, ...] = ()
    remedy: str = ""
    depends: tuple[str, ...] = ()

    def refusal(self, value: float, low: float, high: float, values: Mapping[str, float]) -> str:
        """The line that refuses `value`."""
        context = {name: values[name] for name in self.context}
        return refusal(self.subject, self.unit, self.why, self.remedy, context, (value, low, high))


@dataclass(frozen=True)
class Terminal:
    """Variables that are connected together. `members` has the names of the model's variables by the names that both
    sides have in common; `flows` has the direction of flow variables ("inflow", "outflow"); only terminals of one
    `kind` are joined. By the `rule` "plug" both sides have all members; by "bus" their common members are joined."""

    name: str
    kind: str
    description: str
    members: Mapping[str, str]
    flows: Mapping[str, str] = field(default_factory=dict)
    rule: str = "plug"


@dataclass(frozen=True)
class About:
    """Who made a model and who may use it, as its FMU says it. Empty texts were not given."""

    author: str = ""
    copyright: str = ""
    license: str = ""
    version: str = ""


@dataclass(frozen=True)
class FmuData:
    """Data of a model that only its FMU needs."""

    notes: str = ""
    """further paragraphs of the documentation, each after an empty line: frame, signs, limits"""
    about: About | None = None
    """who made the model; None for the models of this package"""
    experiment: Mapping[str, float] = field(default_factory=dict)
    """``step``, ``stop`` [s] or ``tolerance`` of the default experiment, in place of the usual ones"""
    sizes: Mapping[str, float] = field(default_factory=dict)
    """sizes of inputs in the reference results, by name, in place of the usual ones"""


@dataclass(frozen=True)
class StartProblem:
    """How the states at the start are found: the number of `unknowns` of an iteration, its `rounds`, and the
    conditions on the states, see `Model.start_limits`."""

    unknowns: int = 0
    rounds: int = 0
    required: tuple[Requirement, ...] = ()


Place = tuple[float, float]


@dataclass(frozen=True)
class Sketch:
    """A machine as lines in a plane, x right and y up [m]: the places of its pins by name, its links with the names
    of their pins, the link that is driven, and the pins in the ground."""

    pins: Mapping[str, Place]
    links: Mapping[str, Sequence[str]]
    driven: str
    ground: frozenset[str]


class Extrapolation(NamedTuple):
    """How an input goes on inside a step: the `place` of the input, its `rate`, and `half` of its second derivative.
    After the time `since` it has changed by since * (rate + since * half)."""

    place: int
    rate: Any
    half: Any


class Part:
    """Outputs that are evaluated together, as soon as one of them is requested.

    `equations` is called as ``equations(xp, p, u, x, shared)`` with the common values of `Model.shared`, and gives an
    instance of the declaration `declared`.
    """

    def __init__(
        self, declared: type, equations: Callable[..., Any], *, by_differences: frozenset[str] = frozenset()
    ) -> None:
        """`by_differences` names outputs that are derivatives themselves. Their own derivatives are central
        differences, as exact ones would be the largest part of the code."""
        self.layout = Layout(declared)
        self.equations = equations
        self.by_differences = by_differences


Limits = Iterable[tuple[Any, Any, Any]]
"""Value, lower limit and upper limit of each requirement, in order."""

UNSTATED: Any = None
"""The default of a field that follows from the others unless it is stated."""


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Model:
    """A model: four declarations, and the equations between them as plain functions.

    The equations are written for any engine `xp`, parameters `p`, inputs `u` and states `x`. The FMU of the same name
    has the same inputs and outputs.
    """

    name: str
    description: str = ""
    text: str = ""
    """Paragraphs for its users, as its FMU has them."""
    Parameters: Any
    Inputs: Any
    States: Any = None
    parts: tuple[Part, ...] = UNSTATED
    required: tuple[Requirement, ...] = UNSTATED
    terminals: tuple[Terminal, ...] = UNSTATED
    derived_count: int = UNSTATED
    """Number of values that follow from the fixed parameters alone and are computed once before a run; see
    `derive`."""
    input_rates: Mapping[str, str] = UNSTATED
    """Inputs of a co-simulation FMU whose time derivative is another input (``phi`` has ``w``, ``w`` has
    ``a``). They are extrapolated inside a step, up to their bounds; else a turning shaft would stand still in each
    step."""
    start_problem: StartProblem = UNSTATED
    """Iteration for the states at the start; see `start`."""
    controlled: bool = UNSTATED
    """Whether a co-simulation FMU integrates with error control to `tolerance` and corrects the states by
    `constrained_states` after each substep; otherwise it integrates in equal steps."""
    components: Mapping[str, Model] = field(default_factory=dict)
    """By name, the models that make this one, if it is a system of models."""
    fmu_data: FmuData = FmuData()
    repeated: Mapping[str, str] = field(default_factory=dict)
    """Outputs that are another output under a further name, by their names: their FMU has one value for both."""
    constant: Mapping[str, float] = field(default_factory=dict)
    """Outputs that never change, with their values by name."""
    home: str = UNSTATED
    """The module that has it by its name; by default the module of its parameters."""
    made: tuple[Callable[..., Any], tuple[Any, ...]] | None = None
    """The function of a module that makes it, and its arguments, if no module has it by its name."""

    requirements: Callable[[Any, Any], Limits] = UNSTATED
    """The limits (xp, p) of each requirement of `required`. A later one may be undefined if an earlier one is not
    met."""
    derive: Callable[[Any, Any], list[Any]] = UNSTATED
    """Values (xp, p) computed once from the fixed parameters; the equations read them as ``p.derived``."""
    initial_states: Callable[[Any, Any], Any] = UNSTATED
    """States (xp, p) at the start, if they follow from the parameters alone (models with states)."""
    start_guess: Callable[[Any, Any, Any], list[Any]] = UNSTATED
    """First guess (xp, p, u) of the unknowns of the start."""
    improve_start: Callable[[Any, Any, Any, list[Any]], list[Any]] = UNSTATED
    """The unknowns of the start after one more round (xp, p, u, unknowns)."""
    start_states: Callable[[Any, Any, Any, list[Any]], Any] = UNSTATED
    """States at the start with the inputs u, from the unknowns (xp, p, u, unknowns)."""
    start_limits: Callable[[Any, Any, Any, Any], Limits] = UNSTATED
    """The limits (xp, p, u, x) of each requirement of the `start_problem`, for the states x."""
    derivatives: Callable[[Any, Any, Any, Any], list[Any]] = UNSTATED
    """Time derivatives (xp, p, u, x) of the states, in declared order (models with states)."""
    internal_step: Callable[[Any, Any], Any] = UNSTATED
    """Longest step (xp, p) of the internal integrator [s] (models with states)."""
    tolerance: Callable[[Any, Any], Any] = UNSTATED
    """Relative tolerance (xp, p) of the internal integrator, of states or of their nominal size (`controlled`
    models)."""
    constrained_states: Callable[[Any, Any, Any, Any], list[Any]] = UNSTATED
    """The states near x, in declared order, that meet the model's constraints (xp, p, u, x) (`controlled` models)."""
    shared: Callable[[Any, Any, Any, Any], Any] = UNSTATED
    """The common values of the parts (xp, p, u, x), computed once per point."""
    sketch: Callable[[Any], Sketch | None] = UNSTATED
    """The machine as lines, if it is a mechanism, with the parameters p, which are `with_derived`."""
    further_quantities: Callable[[Any, Any, Any, Any, Mapping[str, Any]], list[tuple[Variable, Any]]] = (
        UNSTATED
    )
    """Quantities beside the outputs (xp, p, u, x, outputs by name), each declared and with its value at one point.
    Batches and cycle quantities know them; FMUs do not have them."""
    obstacle: Callable[[Any], str] | None = None
    """A sentence on what keeps the machine from working with the parameters p, in place of the refusal of a
    requirement; empty if it has none."""

    def __post_init__(self) -> None:
        """Give the attributes that are not stated their values; a subclass gives its own before."""
        self.follow(
            home=getattr(self.Parameters, "__module__", ""),
            parts=(),
            required=(),
            terminals=(),
            derived_count=0,
            input_rates=MappingProxyType({}),
            start_problem=StartProblem(),
            controlled=False,
            requirements=lambda xp, p: (),
            derive=lambda xp, p: [],
            start_guess=lambda xp, p, u: [],
            start_states=lambda xp, p, u, z: self.initial_states(xp, p),
            start_limits=lambda xp, p, u, x: (),
            shared=lambda xp, p, u, x: None,
            sketch=lambda p: None,
            further_quantities=lambda xp, p, u, x, outputs: [],
        )
        if self.made:
            for name in ("Parameters", "Inputs", "States", "Feed"):
                _let_pickle(self, name)

    def follow(self, **values: Any) -> None:
        """Set the attributes that are not stated."""
        followed = vars(self).setdefault("_followed", set())
        for name, value in values.items():
            if getattr(self, name) is UNSTATED:
                object.__setattr__(self, name, value)
                followed.add(name)

    def altered(self, **changes: Any) -> Self:
        """The model with other attributes; attributes that were not stated follow from the new ones."""
        followed = vars(self)["_followed"]
        stated = {f.name: getattr(self, f.name) for f in fields(self) if f.init and f.name not in followed}
        return type(self)(**stated | changes)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.name}>"

    def __reduce__(self) -> tuple[Any, ...]:
        """Another process gets the model by its name in a module, or by the call that makes it."""
        if self.made is not None:
            return self.made
        if getattr(sys.modules.get(self.home), self.name, None) is not self:
            raise TypeError(f"{self.name}: the module {self.home} has no such model; state its home")
        return _model_in, (self.home, self.name)

    @property
    def identity(self) -> dict[str, Any]:
        """The name or the call that makes this model, as JSON has it: equal for equal models, also of two
        processes."""
        if self.made is None:
            return {"of": f"{self.home}:{self.name}"}
        function, arguments = self.made
        values = [x.identity if isinstance(x, Model) else str(x) for x in arguments]
        return {"of": f"{function.__module__}:{function.__qualname__}", "arguments": values}

    @cached_property
    def parameter_layout(self) -> Layout:
        """The layout of the parameters."""
        return Layout(self.Parameters)

    @cached_property
    def input_layout(self) -> Layout:
        """The layout of the inputs."""
        return Layout(self.Inputs)

    @cached_property
    def state_layout(self) -> Layout | None:
        """The layout of the states, or None."""
        return Layout(self.States) if self.States else None

    def with_derived(self, xp: Any, p: Any, derived: list[Any] | None = None) -> Any:
        """The parameters with the values of `derive`, or with the values `derived` in their place."""
        if not self.derived_count:
            return p
        # not `copy.copy`, which asks for the pickled form: that has no symbols and no values of a subclass
        ready = object.__new__(type(p))
        vars(ready).update(vars(p), derived=self.derive(xp, p) if derived is None else derived)
        return ready

    def check(self, p: Any) -> Any:
        """The parameters `with_derived`, if they are allowed.

        Raises
        ------
        InputError
            for a value outside its own bounds, in one line with the allowed range.
        GeometryError
            for a requirement that is not met, in one line with the allowed range, or by its `obstacle`.
        """
        for line in violations(self.parameter_layout, p):
            raise InputError(line)
        p = within_bounds(self.parameter_layout, p)
        try:
            p = self.with_derived(MATH, p)
        except (ArithmeticError, ValueError):
            # `math` raises an error if other engines give NaN, which no requirement admits
            p = self.with_derived(MATH, p, [math.nan] * self.derived_count)
        try:
            self._meets(p, self.required, self.requirements(MATH, p))
        except GeometryError:
            if self.obstacle is not None and (reason := self.obstacle(p)):
                raise GeometryError(reason) from None
            raise
        return p

    def _meets(self, p: Any, requirements: tuple[Requirement, ...], limits: Limits) -> None:
        """Refuse the first requirement whose value is not between its limits."""
        for requirement, (value, low, high) in zip(requirements, limits, strict=True):
            if not low < value < high:
                complaint = requirement.refusal(value, low, high, self.parameter_layout.by_name(p))
                error = GeometryError(complaint)
                error.names = (requirement.subject, *requirement.context, *requirement.depends)
                raise error

    def extrapolations(self, values: Sequence[Any]) -> list[Extrapolation]:
        """The extrapolation of each input of `input_rates`, from the `values` of all inputs."""

        by_name = dict(zip(self.input_layout.names, values, strict=True))
        rates = {name: by_name[rate] for name, rate in self.input_rates.items()}
        return [
            Extrapolation(self.input_layout.names.index(name), rates[name], 0.5 * rates.get(rate, 0.0))
            for name, rate in self.input_rates.items()
        ]

    def begin(self, p: Any, u: Any) -> Any:
        """The states at the start, checked.

        Raises
        ------
        GeometryError
            if the states do not meet a condition, in one line.
        """
        x = self.start(MATH, p, u)
        self._meets(p, self.start_problem.required, self.start_limits(MATH, p, u, x))
        return x

    def start(self, xp: Any, p: Any, u: Any, rounds: int | None = None) -> Any:
        """States at the start with the inputs `u`, by the rounds of the `start_problem` or so many `rounds`: a few
        show the dependencies."""
        z = self.start_guess(xp, p, u)
        for _ in range(self.start_problem.rounds if rounds is None else rounds):
            z = self.improve_start(xp, p, u, z)
        return self.start_states(xp, p, u, z)

    def evaluate(self, xp: Any, p: Any, u: Any, x: Any = None) -> tuple[Any, ...]:
        """The outputs of every part at one point (or array of points). Parameters that are not yet `with_derived`
        are prepared in each call."""
        if self.derived_count and not hasattr(p, "derived"):
            p = self.with_derived(MATH, p)
        shared = self.shared(xp, p, u, x)
        return tuple(part.equations(xp, p, u, x, shared) for part in self.parts)


def _model_in(module: str, name: str) -> Any:
    """The model that a module has by its name."""
    return getattr(import_module(module), name)


def _let_pickle(model: Model, name: str) -> None:
    """Let pickle take the instances of a declaration of a `made` model whose class no module has by its name."""
    declared = getattr(model, name, None)
    if declared is None or _has_name(declared):
        return

    def reduced(instance: Any) -> tuple[Any, ...]:
        if type(instance) is not declared:  # of another declaration with these fields
            return _plain_instance, (type(instance), vars(instance))
        return _instance, (model, name, Layout(declared).values(instance), getattr(instance, "derived", None))

    declared.__reduce__ = reduced


def _has_name(declared: type) -> bool:
    """Whether the module of a class has it by its name."""
    named: Any = sys.modules.get(declared.__module__)
    try:
        return reduce(getattr, declared.__qualname__.split("."), named) is declared
    except AttributeError:
        return False


def _plain_instance(declared: type, values: dict[str, Any]) -> Any:
    instance: Any = object.__new__(declared)
    vars(instance).update(values)
    return instance


def _instance(model: Model, name: str, values: Sequence[Any], derived: Any) -> Any:
    """The instance of that declaration of a model, with these values."""
    instance = Layout(getattr(model, name)).instance(values)
    if derived is not None:
        object.__setattr__(instance, "derived", derived)
    return instance
