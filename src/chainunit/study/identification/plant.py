"""The drive of a recording, simulated whole: control, motor and machine in one loop, with exact sensitivities."""

from __future__ import annotations

import math
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...batch.transients import Transients
from ...errors import InputError
from ...system.compiled_simulation import LONGEST, CompiledSystem
from ..drive import Drive
from .measurands import COUNTS

LEAD = 4.0
"""Time of the simulation before the first row [s], in which the start dies away: a speed loop settles in parts of a
second."""
ANGLE, TEMPERATURE = "angle", "temperature"
"""Quantities of the start of a run: the crank angle at its first row if the motor kept its speed, and the temperature
of the winding at the begin of the lead."""


@dataclass(frozen=True)
class Course:
    """How a run goes: the values of parameters and inputs of the system by full name, the crank angle at the first
    row [rad], the temperature of the winding [K], the speed of the crank with which the simulation begins [rad/s],
    the time of the first and the last row, and the time between rows [s]."""

    values: Mapping[str, float]
    angle: float
    temperature: float
    crank_speed: float
    begin: float
    end: float
    step: float


@dataclass(frozen=True)
class Response:
    """A simulated run: its `time` [s], shape (rows,), the measured quantities by name, each of shape (rows,), the
    crank angle [rad], and the derivatives of each in the directions, shape (directions, rows), by the same names."""

    time: Any
    values: Mapping[str, Any]
    slopes: Mapping[str, Any]


CRANK = "crank"
"""Name of the crank angle in a `Response`."""


def source_of(drive: Drive, name: str, outputs: Container[str]) -> tuple[str, float]:
    """The output of the system of a drive that is measured as `name`, and its factor.

    Raises
    ------
    InputError
        for a quantity that is none of these `outputs`.
    """
    sources = {
        "motor.i": (f"motor.{drive.motor.current}", 1.0),
        "motor.u": ("motor.v", 1.0),
        "motor.power": ("motor.supply_power", 1.0),
        "motor.w": ("motor.w", 1.0),
        "motor.count": ("motor.phi", COUNTS / (2.0 * math.pi)),
        "crank.tau": ("machine.tau", drive.ratio),
        "crank.w": ("motor.w", 1.0 / drive.ratio),
    }
    if name not in sources or sources[name][0] not in outputs:
        known = [key for key, (output, _) in sources.items() if output in outputs]
        raise InputError(f"{name}: is not measured at this drive; there are {', '.join(known)}")
    return sources[name]


class Plant:
    """The compiled system of a drive that is recorded.

    Parameters
    ----------
    drive : motor and machine
    measured : names of measured quantities, see `MEASURANDS`
    by : full names of the parameters and inputs of the system that are sought

    Raises
    ------
    InputError
        for a quantity that this drive does not have, a drive with a foreign FMU, and where there is no C compiler.
    """

    def __init__(self, drive: Drive, measured: Sequence[str], by: Sequence[str]) -> None:
        self.system, self.ratio = CompiledSystem(drive.graph), drive.ratio
        self._sources = {name: source_of(drive, name, self.system.outputs) for name in measured}
        self._by = tuple(by)
        outputs = ["motor.phi", *dict.fromkeys(output for output, _ in self._sources.values())]
        self._rows = {name: k for k, name in enumerate(dict.fromkeys(outputs))}
        self._loop = Transients(self.system.model, list(self._rows), by=self._by)
        layout = self.system.model.state_layout
        assert layout is not None
        self._angle = layout.names.index("motor.phi")
        self._temperature = layout.names.index(f"motor.{drive.motor.temperature}")

    def respond(
        self, course: Course, directions: Mapping[str, tuple[str, float]], workers: int = 1
    ) -> Response:
        """Simulate a run.

        Parameters
        ----------
        course : how the run goes
        directions : by any name, what changes, and by how much: a name of `by`, `ANGLE` or `TEMPERATURE`. The slopes
            are derivatives by a change of this size, which should be one that matters.

        Raises
        ------
        InputError
            for values that make no machine.
        RunError
            where the states leave all bounds.
        """
        system, count = self.system, max(1, len(directions))
        layout = system.model.parameter_layout
        own = {name: x for name, x in course.values.items() if name in layout.names}
        inputs = system.inputs | {name: x for name, x in course.values.items() if name not in own}
        speed = course.crank_speed * self.ratio
        start = {"motor.phi_start": course.angle * self.ratio - speed * LEAD, "motor.w_start": speed}
        x = system.start(inputs, own | start)
        x[self._temperature] = course.temperature
        states = np.zeros((2 * len(x), count))
        states[: len(x)] = x[:, None]
        changes = np.zeros((len(self._by), count))
        for k, (name, size) in enumerate(directions.values()):
            if name == ANGLE:
                states[len(x) + self._angle, k] = size * self.ratio
            elif name == TEMPERATURE:
                states[len(x) + self._temperature, k] = size
            else:
                changes[self._by.index(name), k] = size
        result = self._loop.run(
            system.model.check(layout.from_names(own, system.p)),
            inputs,
            states,
            begin=course.begin - LEAD,
            step=course.step,
            stop=np.full(count, course.end),
            directions=changes,
            longest=LONGEST * course.step,
            workers=workers,
        )
        failures = filter(None, map(result.failure, range(count)))
        if (failure := next(failures, None)) is not None:
            raise failure
        first = int(np.searchsorted(result.times[0], course.begin - course.step))
        return Response(
            result.times[0, first:],
            {name: f * result.rows[self._rows[o], 0, first:] for name, (o, f) in self._all()},
            {
                name: f * result.slopes[self._rows[o], : len(directions), first:]
                for name, (o, f) in self._all()
            },
        )

    def _all(self) -> list[tuple[str, tuple[str, float]]]:
        return [*self._sources.items(), (CRANK, ("motor.phi", 1.0 / self.ratio))]
