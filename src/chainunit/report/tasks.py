"""The tasks of the program that answer a study file, by the names of their commands."""

from __future__ import annotations

from typing import Any

from . import study_task
from .capability import capabilities
from .task import Task


def task_named(name: str) -> Task[Any, Any]:
    """The task of a command: that of a study, or one of a capability."""
    tasks = {"study": study_task.TASK}
    for part in capabilities():
        tasks |= part.tasks()
    return tasks[name]
