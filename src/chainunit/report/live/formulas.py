"""The signals of events as formulas of their quantities, which a page evaluates.

A formula is a number, a name, or a list of an operator and its operands: ``["+", "at", ["*", 2, "p.rise"]]``. Names
are ``at``, the time at which the event begins; ``p.NAME``, a quantity of the event; ``normal.NAME``, an input in
normal running; and ``state.NAME``, an output at the begin of the event.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, TypeAlias

from ...core.quantities import Layout
from ...study.event import Event

Data: TypeAlias = "float | str | list[Any]"
"""A formula as JSON has it."""


class Formula:
    """A number, a name or an operation, as its `data`."""

    __slots__ = ("data",)
    is_symbol = True
    """it stands for a number that is known later"""

    def __init__(self, data: Data) -> None:
        self.data = data

    def __neg__(self) -> Formula:
        return Formula(["-", 0.0, self.data])

    def __lt__(self, other: Any) -> bool:
        """False: a page checks the order of changes by their numbers."""
        return False

    __le__ = __lt__


def data_of(value: Any) -> Data:
    """A formula or a number as JSON has it."""
    return value.data if isinstance(value, Formula) else float(value)


def _operator(name: str, sign: str) -> None:
    """Give formulas the operator of a `sign`, with numbers on either side."""

    def forward(self: Formula, other: Any) -> Formula:
        return Formula([sign, self.data, data_of(other)])

    def reflected(self: Formula, other: Any) -> Formula:
        return Formula([sign, data_of(other), self.data])

    setattr(Formula, f"__{name}__", forward)
    setattr(Formula, f"__r{name}__", reflected)


for _name, _sign in {"add": "+", "sub": "-", "mul": "*", "truediv": "/"}.items():
    _operator(_name, _sign)


class _Names(dict[str, Any]):
    """Values by name, each the formula that is its name."""

    def __init__(self, kind: str) -> None:
        self._kind = kind

    def __missing__(self, name: str) -> Formula:
        return Formula(f"{self._kind}.{name}")


def varied_names(event: Event) -> list[str]:
    """The quantities of an event that a page may change: its real numbers."""
    return [v.name for v in Layout(type(event.p)).variables if v.type == "Real"]


def event_signals(event: Event, full: Callable[[str], str]) -> dict[str, dict[str, Any]]:
    """The signals of an event as formulas, by the full name of each input, which `full` gives: ``start`` and the
    ``changes``, as of a `chainunit.system.signals.Profile`."""
    p = replace(event.p, **{name: Formula(f"p.{name}") for name in varied_names(event)})
    signals: dict[str, Any] = replace(event, p=p).signals(_Names("normal"), Formula("at"), _Names("state"))  # type: ignore[arg-type]
    return {
        full(name): {
            "start": data_of(getattr(signal, "start", signal)),
            "changes": [[data_of(x) for x in change] for change in getattr(signal, "changes", ())],
        }
        for name, signal in signals.items()
    }
