"""Names and order of the runs of a study in a report."""

from __future__ import annotations

from collections.abc import Collection

from ..study.arrays import Dataset
from ..study.event import in_groups
from ..study.readings import has_turn
from ..study.record import StudyRuns

COASTING = "_coasting"
"""The end of the name of a run of the machine alone, after the torque limiter has opened; the name begins with that
of the run in which it opened."""
_TITLES = {"start_up": "start-up and steady running", "unfinished": "the run that stopped early"}


def groups(runs: StudyRuns, names: Collection[str]) -> list[list[str]]:
    """The overloads among `names`, in groups by the side that has to carry them."""
    return in_groups(runs.events, list(names))


def short(runs: StudyRuns, run: str) -> str:
    """The name of a run in two or three words."""
    return runs.events[run].short if run in runs.events else run.replace("_", "-")


def title(runs: StudyRuns, run: str) -> str:
    """The title of a run."""
    if run.endswith(COASTING):
        return f"{title(runs, run.removesuffix(COASTING))}: behind the open coupling"
    return _TITLES.get(run) or runs.title_of(run)


def motor_runs(runs: StudyRuns) -> list[str]:
    """The runs in which the motor turns the machine."""
    return [name for name in runs.series if not name.endswith(COASTING)]


def in_order(runs: StudyRuns) -> list[str]:
    """All runs; a run in which the coupling opens is followed by that of the machine behind the open coupling."""
    return [run for name in motor_runs(runs) for run in (name, name + COASTING) if run in runs.series]


def has_steady_turns(runs: StudyRuns) -> bool:
    """Whether the study has whole turns in steady running."""
    return "steady" in runs.answers and has_turn(runs.drive, runs.steady)


def from_event(runs: StudyRuns, run: str) -> Dataset:
    """A run from its overload on; the whole run without one."""
    return runs.series[run].sel(time=slice(event_time(runs, run), None))


def event_time(runs: StudyRuns, run: str) -> float | None:
    """The time at which the overload of a run begins [s]; None for a run without an overload, or with one from its
    start."""
    return runs.event_times.get(run.removesuffix(COASTING)) or None
