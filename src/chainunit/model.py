"""What a model is: declarations, and equations written for any engine `xp`.

Standard library only: FMUs carry this file.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

from .quantities import Layout


class Part:
    """Outputs that are evaluated together, when one of them is asked for.

    `equations` is called as ``equations(xp, p, u, x, shared)``, where `shared` is what the
    model's `shared` returned, and gives an instance of the declaration `declared`.
    """

    def __init__(self, declared: type, equations: Callable[..., Any]) -> None:
        self.layout = Layout(declared)
        self.equations = equations


class Model:
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
    internal_step: ClassVar[float] = 0.0
    """Largest step of the internal integrator [s]; 0 for a model without states."""

    parameter_layout: ClassVar[Layout]
    input_layout: ClassVar[Layout]
    state_layout: ClassVar[Layout | None]
    files: ClassVar[tuple[str, ...]]
    """Files and folders of the package, beside the common ones, that an FMU of this model needs."""

    def __init_subclass__(cls) -> None:
        cls.parameter_layout = Layout(cls.Parameters)
        cls.input_layout = Layout(cls.Inputs)
        cls.state_layout = Layout(cls.States) if cls.States else None

    @staticmethod
    def check(p: Any) -> None:
        """Refuse parameters that make no machine.

        Raises
        ------
        InputError
            in one line, with the quantity, its value and the allowed range.
        """

    @staticmethod
    def initial_states(p: Any) -> Any:
        """States at the start (models with states)."""
        raise NotImplementedError

    @staticmethod
    def derivatives(xp: Any, p: Any, u: Any, x: Any) -> list[Any]:
        """Time derivatives of the states, in declared order (models with states)."""
        raise NotImplementedError

    @staticmethod
    def shared(xp: Any, p: Any, u: Any, x: Any) -> Any:
        """What the parts have in common, computed once per point."""
        return None

    @classmethod
    def evaluate(cls, xp: Any, p: Any, u: Any, x: Any = None) -> tuple[Any, ...]:
        """Every part's outputs at one point (or array of points)."""
        shared = cls.shared(xp, p, u, x)
        return tuple(part.equations(xp, p, u, x, shared) for part in cls.parts)
