"""The functions by which a long task reports its progress."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[float], None]
"""A function that a task calls with the amount of work that is complete."""
TaskProgress = Callable[[str, float, float], None]
"""A function that a task calls with its name, the amount of work that is complete, and the total amount."""


def quiet(what: str, done: float, total: float) -> None:
    """Report nothing: `what` is the task, `done` of `total` is complete."""
