"""The tasks of the program that answer a study file, by the names of their commands."""

from __future__ import annotations

from typing import Any

from . import study_task
from .capability import capabilities
from .task import Task


def tasks() -> dict[str, Task[Any, Any]]:
    """By name, the task of a study and those of the capabilities."""
    return {"study": study_task.TASK} | {
        name: x for part in capabilities() for name, x in part.tasks().items()
    }


def task_named(name: str) -> Task[Any, Any]:
    """The task of a command: that of a study, or one of a capability."""
    return tasks()[name]
