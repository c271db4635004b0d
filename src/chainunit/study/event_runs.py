"""Runs with events that branch from one steady state, by the co-simulation of FMUs."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import xarray as xr

from ..core.errors import InterruptedRunError, RunError
from .event import Event
from .rig import Rig


@dataclass(frozen=True)
class EventRun:
    """A run with an event: the rows from the steady state on, whether the limit ended it, and the error of a run that
    failed, which may have no rows."""

    series: xr.Dataset | None
    ended: bool
    error: RunError | None = None


@dataclass(frozen=True)
class Request:
    """A run that is asked for: the event with its begin [s], the end of the run [s], and the torque of the motor's
    shaft that ends it [N m]."""

    event: Event
    begin: float
    stop: float
    limit: float = math.inf


class EventSimulation:
    """The co-simulation of a `rig` from rest to its steady state at the time `steady` [s], from which runs branch.

    Raises
    ------
    RunError
        where an FMU fails before that time.
    """

    def __init__(self, rig: Rig, steady: float) -> None:
        self._rig = rig
        self._simulation = rig.from_rest()
        try:
            self._simulation.run(steady, rig.step)
            self._simulation.save()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Free the FMUs."""
        self._simulation.close()

    def runs(self, requests: Sequence[Request]) -> Iterator[EventRun]:
        """The requested runs in order."""
        shaft = self._rig.drive.motor_torque
        for each in requests:
            guards = {shaft: each.limit} if math.isfinite(each.limit) else None
            try:
                transient = self._rig.follow(
                    self._simulation, each.event, each.begin, each.stop, guards=guards
                )
            except InterruptedRunError:
                raise
            except RunError as error:
                # the next run starts from the saved state again
                yield EventRun(None, False, error)
                continue
            yield EventRun(transient.run, self._simulation.time < each.stop - 0.5 * self._rig.step)
