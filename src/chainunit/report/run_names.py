"""The runs of a study as a report names and orders them."""

from __future__ import annotations

from collections.abc import Collection

from ..study.event import in_groups
from ..study.record import StudyRecord

COASTING = "_coasting"
"""Ends the name of a run of the machine alone, behind the safety coupling that opened in the run named before it."""
_TITLES = {"start_up": "start-up and steady running", "unfinished": "the run that stopped early"}


def is_event(study: StudyRecord, run: str) -> bool:
    """Whether a run is an overload."""
    return run in study.config.events


def groups(study: StudyRecord, runs: Collection[str]) -> list[list[str]]:
    """The overloads among `runs` by the side that has to carry them."""
    return in_groups(study.config.events, list(runs))


def short(study: StudyRecord, run: str) -> str:
    """A run in two or three words."""
    return study.config.events[run].short if is_event(study, run) else run.replace("_", "-")


def title(study: StudyRecord, run: str) -> str:
    """What a run is called."""
    if run.endswith(COASTING):
        return f"{title(study, run.removesuffix(COASTING))}: behind the open coupling"
    return _TITLES.get(run) or study.called(run)


def driven(study: StudyRecord) -> list[str]:
    """The runs in which the motor turns the machine."""
    return [name for name in study.runs if not name.endswith(COASTING)]


def in_order(study: StudyRecord) -> list[str]:
    """The runs, each followed by that of the machine behind the open coupling, where there is one."""
    return [run for name in driven(study) for run in (name, name + COASTING) if run in study.runs]


def event_time(study: StudyRecord, run: str) -> float | None:
    """When the overload of a run begins [s]; None where it has none, or is one from the start."""
    return study.event.get(run.removesuffix(COASTING)) or None
