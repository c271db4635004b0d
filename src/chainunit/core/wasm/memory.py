"""The places of a model's numbers in the memory of its module."""

from __future__ import annotations

from dataclasses import dataclass, field

from ..model import Model

BYTES = 8
"""Bytes of a number."""


@dataclass
class Places:
    """Places in memory by name, each of so many numbers; `size` is the number of bytes up to the last. The first
    `BYTES` bytes are free, so that 0 is no address."""

    size: int = BYTES
    places: dict[str, int] = field(default_factory=dict)

    def room(self, name: str, numbers: int) -> int:
        """The address of a place, which is new."""
        assert name not in self.places, name
        address = self.places[name] = self.size
        self.size += BYTES * numbers
        return address

    def __getitem__(self, name: str) -> int:
        return self.places[name]


@dataclass(frozen=True)
class Sizes:
    """How many of each a model has."""

    parameters: int
    inputs: int
    states: int
    derived: int
    unknowns: int

    @classmethod
    def of(cls, model: type[Model]) -> Sizes:
        """Those of a model."""
        return cls(
            len(model.parameter_layout.names),
            len(model.input_layout.names),
            len(model.state_layout.names) if model.state_layout else 0,
            model.derived_count,
            model.start_problem.unknowns,
        )


def reserve(model: type[Model], outputs: int) -> Places:
    """The memory of a model with so many `outputs`: arguments and results of its functions."""
    n, memory = Sizes.of(model), Places()
    for name, numbers in (
        ("parameters", n.parameters),
        ("inputs", n.inputs),
        ("states", n.states),
        ("derived", n.derived),
        ("unknowns", n.unknowns),
        ("input_changes", n.inputs),
        ("state_changes", n.states),
        ("outputs", outputs),
        ("derivatives", n.states),
        ("output_slopes", outputs),
        ("derivative_slopes", n.states),
        ("improved", n.unknowns),
        ("closed", n.states),
        ("internal_step", 1),
        ("tolerance", 1),
        ("pace", 1),
        ("requirements", 3 * len(model.required)),
        ("start_limits", 3 * len(model.start_problem.required)),
    ):
        memory.room(name, numbers)
    return memory


ARGUMENTS = {
    "p": "parameters",
    "u": "inputs",
    "x": "states",
    "k": "derived",
    "z": "unknowns",
    "d": "input_changes",
    "e": "state_changes",
}
"""The places of the arguments of a kernel, by its letters (`chainunit.core.native.kernels.ModelFunction`)."""
