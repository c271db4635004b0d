"""Names and order of the runs of a study in a report."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING

from ..study.event import in_groups
from ..study.readings import has_turn
from ..study.record import StudyRecord

if TYPE_CHECKING:
    import xarray as xr

COASTING = "_coasting"
"""The end of the name of a run of the machine alone, after the torque limiter has opened; the name begins with that
of the run in which it opened."""
_TITLES = {"start_up": "start-up and steady running", "unfinished": "the run that stopped early"}


def is_event(study: StudyRecord, run: str) -> bool:
    """Whether a run is an overload."""
    return run in study.config.events


def groups(study: StudyRecord, runs: Collection[str]) -> list[list[str]]:
    """The overloads among `runs`, in groups by the side that has to carry them."""
    return in_groups(study.config.events, list(runs))


def short(study: StudyRecord, run: str) -> str:
    """The name of a run in two or three words."""
    return study.config.events[run].short if is_event(study, run) else run.replace("_", "-")


def title(study: StudyRecord, run: str) -> str:
    """The title of a run."""
    if run.endswith(COASTING):
        return f"{title(study, run.removesuffix(COASTING))}: behind the open coupling"
    return _TITLES.get(run) or study.title_of(run)


def motor_runs(study: StudyRecord) -> list[str]:
    """The runs in which the motor turns the machine."""
    return [name for name in study.runs if not name.endswith(COASTING)]


def in_order(study: StudyRecord) -> list[str]:
    """All runs; a run in which the coupling opens is followed by that of the machine behind the open coupling."""
    return [run for name in motor_runs(study) for run in (name, name + COASTING) if run in study.runs]


def has_steady_turns(study: StudyRecord) -> bool:
    """Whether the study has whole turns in steady running."""
    return "steady" in study.answers and has_turn(study.drive, study.steady)


def from_event(study: StudyRecord, run: str) -> xr.Dataset:
    """A run from its overload on; the whole run without one."""
    return study.runs[run].sel(time=slice(event_time(study, run), None))


def event_time(study: StudyRecord, run: str) -> float | None:
    """The time at which the overload of a run begins [s]; None for a run without an overload, or with one from its
    start."""
    return study.event.get(run.removesuffix(COASTING)) or None
