"""Plants give the course of a recorded run with exact derivatives. Here are their base class, and the drive whose
motor is recorded, simulated whole: control, motor and machine in one loop.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Any, ClassVar, NamedTuple

import numpy as np

from ..core.errors import InputError
from ..core.quantities import Variable
from ..drives.free_rotor import FreeRotor
from ..machines.machine import Machine
from ..study.drive import NO_LOSS, Drive
from ..system.compiled_simulation import CompiledSystem
from .loop import DirectedLoop, Piece
from .measurands import COUNTS

LEAD = 4.0
"""Time of the simulation before the first row [s], in which the start dies away: a speed loop settles in parts of a
second."""
ANGLE, TEMPERATURE, OFF = "angle", "temperature", "off"
"""Nuisances of a run: the crank angle at its first row if the motor kept its speed, the temperature of the winding at
the begin of the lead, and the time at which the motor is switched off."""
OFF_SPREAD, GUARD = 2e-3, 1e-2
"""Standard deviation of the time at which the motor is switched off, and the time on both sides of it that is not
compared [s]."""
CRANK = "crank"
"""Name of the crank angle in a `Response`."""
MOVING = ("motor.w", "motor.count", "crank.tau", "crank.w", CRANK)
"""Quantities that are described after the motor was switched off."""


class Nuisance(NamedTuple):
    """A number that a plant needs of each run: its start value with its standard deviation, the change for which
    derivatives are integrated, and its lower bound."""

    name: str
    unit: str
    start: float
    prior_deviation: float
    change: float
    low: float = -math.inf


@dataclass(frozen=True)
class Overview:
    """What is known of a run at first sight: the angle of the crank at its first row [rad], its mean speed [rad/s],
    the temperature of the surroundings [K], the times of the first and the last row, and the time at which the motor
    is switched off [s], or None."""

    angle: float
    crank_speed: float
    ambient: float
    begin: float
    end: float
    off: float | None = None


@dataclass(frozen=True)
class Scenario:
    """How a run goes: the values of parameters and inputs of the system by full name, those of inputs also as
    `Profile`; the nuisances of the run by name; the speed of the crank with which it begins [rad/s]; the times of the
    first and the last row, the time between rows of a simulation, the times at which something was measured [s],
    shape (n,), and the time at which the motor is switched off as it is stated [s], or None."""

    values: Mapping[str, Any]
    nuisances: Mapping[str, float]
    crank_speed: float
    begin: float
    end: float
    step: float
    rows: Any
    off: float | None = None


@dataclass(frozen=True)
class Response:
    """A simulated run: its `time` [s], shape (rows,), the measured quantities by name, each of shape (rows,), the
    crank angle [rad], and the derivatives of each in the directions, shape (directions, rows), by the same names.

    `cut` is the first row after the motor was switched off; the row before it has the same time. `spans` are the
    begins and ends of the times that the quantities describe, where that is not the whole run.
    """

    time: Any
    values: Mapping[str, Any]
    slopes: Mapping[str, Any]
    cut: int | None = None
    spans: Mapping[str, Sequence[tuple[float, float]]] = field(default_factory=dict)

    @property
    def pieces(self) -> list[slice]:
        """The rows before and after the switch."""
        cuts = [0, *([] if self.cut is None else [self.cut]), len(self.time)]
        return [slice(begin, end) for begin, end in pairwise(cuts)]

    def describes(self, name: str, times: Any) -> Any:
        """Whether the quantity is described at these times, shape (n,)."""
        if name not in self.spans:
            return np.ones(len(times), bool)
        inside = np.zeros(len(times), bool)
        for begin, end in self.spans[name]:
            inside |= (times >= begin) & (times <= end)
        return inside


class AnyPlant(ABC):
    """A plant with its `machine`, whose runs a `chainunit.recordings.problem.Problem` compares with recordings."""

    may_advance: ClassVar[bool]
    """whether a simulated machine may get ahead of the recorded one"""

    def __init__(self, machine: Machine) -> None:
        self.machine = machine

    @property
    def ratio(self) -> float:
        """Turns of the motor in a turn of the crank."""
        return self.machine.ratio

    @abstractmethod
    def with_names(self, by: Sequence[str]) -> AnyPlant:
        """The same plant, of which these parameters and inputs are sought."""

    @abstractmethod
    def parameters(self) -> Iterator[tuple[Variable, float]]:
        """The parameters of the system by full name, with their known values in their declared units."""

    @abstractmethod
    def nuisances(self, run: Overview) -> Iterator[Nuisance]:
        """The numbers that it needs of a run beside the values of parameters and inputs."""

    @abstractmethod
    def respond(
        self, scenario: Scenario, directions: Mapping[str, tuple[str, float]], workers: int = 1
    ) -> Response:
        """Simulate a run.

        Parameters
        ----------
        scenario : how the run goes
        directions : by any name, what changes, and by how much: a sought quantity or a nuisance. The slopes are
            derivatives by a change of this size, which should be one that matters.

        Raises
        ------
        InputError
            for values that make no machine.
        RunError
            where the states leave all bounds.
        """


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
        measurable = [key for key, (output, _) in sources.items() if output in outputs]
        raise InputError(f"{name}: is not measured at this drive; there are {', '.join(measurable)}")
    return sources[name]


class SourcedLoop(DirectedLoop):
    """The loop of a drive with the outputs from which the `measured` quantities follow."""

    def __init__(self, drive: Drive, measured: Sequence[str], by: Sequence[str]) -> None:
        available = CompiledSystem(drive.graph).outputs
        self._sources = {name: source_of(drive, name, available) for name in measured}
        self._sources[CRANK] = "motor.phi", 1.0 / drive.ratio
        outputs = ["motor.a", *(output for output, _ in self._sources.values())]
        super().__init__(drive, list(dict.fromkeys(outputs)), by)

    def response(self, piece: Piece, first: int = 0) -> Response:
        """The measured quantities of a piece, from its row `first` on."""
        return Response(
            piece.time[first:],
            {name: f * piece.values[o][first:] for name, (o, f) in self._sources.items()},
            {name: f * piece.slopes[o][:, first:] for name, (o, f) in self._sources.items()},
        )


def free(drive: Drive) -> Drive:
    """The drive with its motor switched off."""
    rotor = FreeRotor.Parameters(rotor=drive.fmu_parameters.rotor, gear=drive.fmu_parameters.gear)
    return replace(
        drive,
        motor=FreeRotor,
        parameters=rotor,
        added_inertia=0.0,
        gear=NO_LOSS,
        feed_forward=False,
    )


class Plant(AnyPlant):
    """The compiled system of a drive whose motor is recorded.

    After the motor was switched off, its rotor turns with the machine, without torque in the air gap; electric
    quantities are not described from then on.

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

    may_advance = True

    def __init__(self, drive: Drive, measured: Sequence[str], by: Sequence[str]) -> None:
        super().__init__(drive.machine)
        self._loop = SourcedLoop(drive, measured, by)
        self._drive, self._by = drive, tuple(by)
        self._measured = tuple(measured)
        self._moving = [name for name in measured if name in MOVING]
        self._temperature = f"motor.{drive.motor.temperature}"

    def with_names(self, by: Sequence[str]) -> Plant:
        """The same plant, of which the parameters and inputs `by` are sought."""
        return Plant(self._drive, self._measured, by)

    def parameters(self) -> Iterator[tuple[Variable, float]]:
        """Those of motor, converter and machine."""
        layout, p = self._loop.system.model.parameter_layout, self._loop.system.p
        yield from zip(layout.variables, map(float, layout.values(p)), strict=True)

    @cached_property
    def _free(self) -> SourcedLoop:
        return SourcedLoop(free(self._drive), self._moving, self._by)

    def nuisances(self, run: Overview) -> Iterator[Nuisance]:
        """The angle, the temperature, and the time of switching off where there is one."""
        yield Nuisance(ANGLE, "rad", run.angle, 10.0, 0.01)
        yield Nuisance(TEMPERATURE, "K", run.ambient + 20.0, 40.0, 5.0)
        if run.off is not None:
            yield Nuisance(OFF, "s", run.off, OFF_SPREAD, OFF_SPREAD)

    def respond(
        self, scenario: Scenario, directions: Mapping[str, tuple[str, float]], workers: int = 1
    ) -> Response:
        """Simulate a run; the slopes are derivatives by changes of the size of the `directions`."""
        loop, changes = self._loop, list(directions.values())
        speed, lead = scenario.crank_speed * self.ratio, scenario.begin - LEAD
        angle = scenario.nuisances[ANGLE] * self.ratio - speed * LEAD
        start = loop.start(scenario.values, {"motor.phi_start": angle, "motor.w_start": speed}, lead)
        start[self._temperature] = scenario.nuisances[TEMPERATURE]
        turned = {"motor.phi": (ANGLE, self.ratio), self._temperature: (TEMPERATURE, 1.0)}
        states = {name: np.array([x, *(0.0 for _ in changes)]) for name, x in start.items()}
        for state, (nuisance, factor) in turned.items():
            states[state][1:] = [size * factor * (name == nuisance) for name, size in changes]
        switched = scenario.off is not None and scenario.off + GUARD < scenario.end
        off = scenario.nuisances[OFF] if switched else scenario.end
        powered = loop.run(scenario.values, states, changes, (lead, off), scenario.step, workers)
        first = int(np.searchsorted(powered.time, scenario.begin - scenario.step))
        response = loop.response(powered, first)
        if scenario.off is None or not switched:
            return response
        rolling = self._switched_off(scenario, powered, changes, (off, scenario.end), workers)
        return _joined(response, self._free.response(rolling), scenario.off)

    def _switched_off(
        self, scenario: Scenario, powered: Piece, changes: Sequence[tuple[str, float]],
        span: tuple[float, float], workers: int,
    ) -> Piece:  # fmt: skip
        """The run within `span` [s], from the time on at which the motor is switched off, with its `changes`: it
        starts from the last states of the `powered` run. A change of that time itself changes the speed at the start:
        with power, the motor goes on with another acceleration than without."""
        free = self._free
        states = {name: powered.states[name].copy() for name in free.states}
        now = {name: x[:1] for name, x in states.items()}
        then = free.run(scenario.values, now, [], (span[0], span[0]), scenario.step)
        fall = powered.values["motor.a"][-1] - then.values["motor.a"][0]
        states["motor.w"][1:] += [size * fall * (name == OFF) for name, size in changes]
        return free.run(scenario.values, states, changes, span, scenario.step, workers)


def _joined(powered: Response, rolling: Response, off: float) -> Response:
    """A run with a switch. Electric quantities are zero from then on."""
    count = len(rolling.time)

    def both(before: Mapping[str, Any], after: Mapping[str, Any]) -> dict[str, Any]:
        none = {name: np.zeros((*np.shape(x)[:-1], count)) for name, x in before.items()}
        return {name: np.concatenate([x, after.get(name, none[name])], axis=-1) for name, x in before.items()}

    before, after = (-math.inf, off - GUARD), (off + GUARD, math.inf)
    return Response(
        np.concatenate([powered.time, rolling.time]),
        both(powered.values, rolling.values),
        both(powered.slopes, rolling.slopes),
        len(powered.time),
        # a mark that is passed backwards is no mark
        {name: (before, after) if name in MOVING else (before,) for name in (*powered.values, "mark")},
    )
