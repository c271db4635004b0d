"""A model: declarations, and equations written for any engine `xp`."""

from __future__ import annotations

import copyreg
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple

from .bounds import refusal
from .engines import MATH
from .errors import GeometryError, InputError
from .quantities import Layout, Variable, violations, within_bounds


@dataclass(frozen=True)
class Requirement:
    """A condition on the parameters beyond their own bounds: `subject` in `unit` lies strictly between two
    limits that depend on the others.

    `why` says what happens if the condition is not met; the refusal names the parameters of `context` with
    their values. `depends` are further parameters that set the limits. `remedy` says what to do where no
    value
    fits. The words are declared once; the limits come from the model's `requirements`.
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
    """Variables that are connected together. `members` maps each name that both sides know to the model's own
    name; `flows` gives the flow variables with their direction ("inflow", "outflow"); only terminals of one
    `kind` are joined. By the `rule` "plug" both sides have all members, by "bus" those are joined that both have."""

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
    """further paragraphs of the documentation, each behind an empty line: frame, signs, limits"""
    about: About | None = None
    """who made the model, where its user did; None for the models of this package"""
    experiment: Mapping[str, float] = field(default_factory=dict)
    """``step``, ``stop`` [s] or ``tolerance`` of the default experiment, in place of the usual ones"""
    sizes: Mapping[str, float] = field(default_factory=dict)
    """sizes of inputs in the reference results, by name, in place of the usual ones"""


class Making(NamedTuple):
    """The call of a function of a module that makes a class that no module names: by it another process gets the
    class."""

    function: Callable[..., Any]
    arguments: tuple[Any, ...]


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

    `equations` is called as ``equations(xp, p, u, x, shared)``, where `shared` is what the
    model's `shared` returned, and gives an instance of the declaration `declared`.
    """

    def __init__(
        self, declared: type, equations: Callable[..., Any], *, by_differences: frozenset[str] = frozenset()
    ) -> None:
        """`by_differences` names outputs that are derivatives themselves. Their own derivatives are central
        differences, as exact ones would be the largest part of the code."""
        self.layout = Layout(declared)
        self.equations = equations
        self.by_differences = by_differences


class ModelType(type):
    """The type of all models."""


def _pickled_form(model: Any) -> str | tuple[Callable[..., Any], tuple[Any, ...]]:
    """A model as pickle stores it: by its name, or, for a class that has no name in a module, by the call
    that makes it."""
    made = vars(model).get("made")
    return model.__qualname__ if made is None else tuple(made)


copyreg.pickle(ModelType, _pickled_form)


def keep(model: type[Model], *names: str) -> None:
    """Let pickle take instances of these declarations of a model that is `made`, whose classes no module names."""
    for name in names:
        declared = getattr(model, name)

        def reduced(instance: Any, declared: type = declared, name: str = name) -> str | tuple[Any, ...]:
            if type(instance) is not declared:  # of another declaration with these fields
                return copyreg.__newobj__, (type(instance),), vars(instance)  # type: ignore[attr-defined]
            return _unpickled, (
                model,
                name,
                Layout(declared).values(instance),
                getattr(instance, "derived", None),
            )

        declared.__reduce__ = reduced


def _unpickled(model: type[Model], name: str, values: Sequence[Any], derived: Any) -> Any:
    """The instance of that declaration of a model; see `keep`."""
    instance = Layout(getattr(model, name)).instance(values)
    if derived is not None:
        object.__setattr__(instance, "derived", derived)
    return instance


class Model(metaclass=ModelType):
    """A model: four declarations and the equations between them.

    A subclass sets the class attributes; it is never instantiated. Inputs and outputs are those of
    the FMU of the same name.
    """

    name: ClassVar[str]
    description: ClassVar[str]
    Parameters: ClassVar[type]
    Inputs: ClassVar[type]
    States: ClassVar[type | None] = None
    parts: ClassVar[tuple[Part, ...]]
    required: ClassVar[tuple[Requirement, ...]] = ()
    terminals: ClassVar[tuple[Terminal, ...]] = ()
    derived_count: ClassVar[int] = 0
    """Number of values that follow from the fixed parameters alone and are computed once before a run; see
    `derive`."""
    input_rates: ClassVar[Mapping[str, str]] = {}
    """Inputs of a co-simulation FMU whose time derivative is another input (``phi`` has ``w``, ``w`` has
    ``a``). They are extrapolated inside a step, up to their bounds; without that a turning shaft would stand
    still in each step, and outputs at its end would be those of its begin."""
    start_problem: ClassVar[StartProblem] = StartProblem()
    """Iteration for the states at the start; see `start`."""
    controlled: ClassVar[bool] = False
    """Whether a co-simulation FMU integrates with error control to `tolerance` and corrects the states by
    `constrained_states` after each substep; otherwise it integrates in equal steps."""
    made: ClassVar[Making | None] = None
    """How a function of its module makes this class; None for a class that the module names."""
    components: ClassVar[Mapping[str, type[Model]]] = {}
    """By name, the models that make this one, if it is a system of models."""
    fmu_data: ClassVar[FmuData] = FmuData()
    repeated: ClassVar[Mapping[str, str]] = {}
    """Outputs that are another output under a further name, by their names: their FMU has one value for both."""
    constant: ClassVar[Mapping[str, float]] = {}
    """Outputs that never change, with their values by name."""

    parameter_layout: ClassVar[Layout]
    input_layout: ClassVar[Layout]
    state_layout: ClassVar[Layout | None]

    def __init_subclass__(cls) -> None:
        if not hasattr(cls, "Parameters"):  # a common base of several models
            return
        cls.parameter_layout = Layout(cls.Parameters)
        cls.input_layout = Layout(cls.Inputs)
        cls.state_layout = Layout(cls.States) if cls.States else None

    @staticmethod
    def requirements(xp: Any, p: Any) -> Iterator[tuple[Any, Any, Any]]:
        """Value, lower limit and upper limit of each requirement of `required`, in order. A later one may be
        undefined where an earlier one is not met."""
        return iter(())

    @staticmethod
    def derive(xp: Any, p: Any) -> list[Any]:
        """Values computed once from the fixed parameters; the equations read them as ``p.derived``."""
        return []

    @classmethod
    def with_derived(cls, xp: Any, p: Any, derived: list[Any] | None = None) -> Any:
        """The parameters with the values of `derive`, or with the values `derived` in their place."""
        if not cls.derived_count:
            return p
        # not `copy.copy`, which asks for the pickled form: that has no symbols and no values of a subclass
        ready = object.__new__(type(p))
        vars(ready).update(vars(p), derived=cls.derive(xp, p) if derived is None else derived)
        return ready

    @classmethod
    def check(cls, p: Any) -> Any:
        """The parameters `with_derived`. Parameters that are out of bounds, or with which the machine does not work,
        are refused.

        Raises
        ------
        InputError
            for a value outside its own bounds, in one line with the allowed range.
        GeometryError
            where a requirement is not met, in one line with the allowed range.
        """
        for line in violations(cls.parameter_layout, p):
            raise InputError(line)
        p = within_bounds(cls.parameter_layout, p)
        try:
            p = cls.with_derived(MATH, p)
        except (ArithmeticError, ValueError):
            # `math` raises where other engines give NaN, which no requirement admits
            p = cls.with_derived(MATH, p, [math.nan] * cls.derived_count)
        cls._meets(p, cls.required, cls.requirements(MATH, p))
        return p

    @classmethod
    def _meets(
        cls, p: Any, requirements: tuple[Requirement, ...], limits: Iterator[tuple[Any, Any, Any]]
    ) -> None:
        for each, (value, low, high) in zip(requirements, limits, strict=True):
            if not low < value < high:
                error = GeometryError(each.refusal(value, low, high, cls.parameter_layout.by_name(p)))
                error.names = (each.subject, *each.context, *each.depends)
                raise error

    @classmethod
    def extrapolations(cls, values: Sequence[Any]) -> list[Extrapolation]:
        """The extrapolation of each input of `input_rates`, from the `values` of all inputs."""

        def rate(name: str | None) -> Any:
            other = cls.input_rates.get(name or "")
            return values[names.index(other)] if other else 0.0

        names = cls.input_layout.names
        return [
            Extrapolation(names.index(name), rate(name), 0.5 * rate(cls.input_rates[name]))
            for name in cls.input_rates
        ]

    @staticmethod
    def initial_states(xp: Any, p: Any) -> Any:
        """States at the start, where they follow from the parameters alone (models with states)."""
        raise NotImplementedError

    @staticmethod
    def start_guess(xp: Any, p: Any, u: Any) -> list[Any]:
        """First guess of the unknowns of the start."""
        return []

    @staticmethod
    def improve_start(xp: Any, p: Any, u: Any, z: list[Any]) -> list[Any]:
        """The unknowns of the start after one more round."""
        raise NotImplementedError

    @classmethod
    def start_states(cls, xp: Any, p: Any, u: Any, z: list[Any]) -> Any:
        """States at the start with the inputs `u`, from the unknowns."""
        return cls.initial_states(xp, p)

    @staticmethod
    def start_limits(xp: Any, p: Any, u: Any, x: Any) -> Iterator[tuple[Any, Any, Any]]:
        """Value, lower limit and upper limit of each requirement of the `start_problem`, in order, for the
        states `x`."""
        return iter(())

    @classmethod
    def begin(cls, p: Any, u: Any) -> Any:
        """The states at the start, checked.

        Raises
        ------
        GeometryError
            where the states do not meet a condition, in one line.
        """
        x = cls.start(MATH, p, u)
        cls._meets(p, cls.start_problem.required, cls.start_limits(MATH, p, u, x))
        return x

    @classmethod
    def start(cls, xp: Any, p: Any, u: Any, rounds: int | None = None) -> Any:
        """States at the start with the inputs `u`, by the rounds of the `start_problem` or so many `rounds`: a few
        show the dependencies."""
        z = cls.start_guess(xp, p, u)
        for _ in range(cls.start_problem.rounds if rounds is None else rounds):
            z = cls.improve_start(xp, p, u, z)
        return cls.start_states(xp, p, u, z)

    @staticmethod
    def derivatives(xp: Any, p: Any, u: Any, x: Any) -> list[Any]:
        """Time derivatives of the states, in declared order (models with states)."""
        raise NotImplementedError

    @staticmethod
    def internal_step(xp: Any, p: Any) -> Any:
        """Longest step of the internal integrator [s] (models with states)."""
        raise NotImplementedError

    @staticmethod
    def tolerance(xp: Any, p: Any) -> Any:
        """Relative tolerance of the internal integrator, of states or of their nominal size (`controlled` models)."""
        raise NotImplementedError

    @staticmethod
    def constrained_states(xp: Any, p: Any, u: Any, x: Any) -> list[Any]:
        """The states near `x`, in declared order, that meet the model's constraints (`controlled` models)."""
        raise NotImplementedError

    @staticmethod
    def shared(xp: Any, p: Any, u: Any, x: Any) -> Any:
        """The common values of the parts, computed once per point."""
        return None

    @classmethod
    def evaluate(cls, xp: Any, p: Any, u: Any, x: Any = None) -> tuple[Any, ...]:
        """The outputs of every part at one point (or array of points). Parameters that are not yet `with_derived`
        are prepared in each call."""
        if cls.derived_count and not hasattr(p, "derived"):
            p = cls.with_derived(MATH, p)
        shared = cls.shared(xp, p, u, x)
        return tuple(part.equations(xp, p, u, x, shared) for part in cls.parts)

    @classmethod
    def sketch(cls, start: Mapping[str, float] | None = None) -> Sketch | None:
        """The machine as lines, if it is a mechanism: with the parameters `start` by name, else the declared ones."""
        return None

    @classmethod
    def further_quantities(
        cls, xp: Any, p: Any, u: Any, x: Any, outputs: Mapping[str, Any]
    ) -> list[tuple[Variable, Any]]:
        """Quantities beside the `outputs`, which are given by name, each declared and with its value at one point.
        Batches and cycle quantities know them; FMUs do not have them."""
        return []
