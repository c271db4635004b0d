"""A paper cutter's knife drive: motion, forces and work of a turn; how motor and flywheel share the cut.

The mechanics are in `machines.knife_drive`. The turn at constant speed needs no simulation; start-up and cutting are
co-simulated by the FMUs of machine and motor, once for each flywheel.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import xarray as xr
from pydantic import BeforeValidator, Field

from ..drives.catalogue import CatalogueMotor, motor_of_catalogue
from ..drives.induction_motor import InductionMotor
from ..errors import InputError, RunError
from ..fmu.backends import Backend, Origin
from ..machines.knife_drive import KnifeDrive, Parameters
from ..quantities import Layout, Value, declaration, quantity, variables
from ..reading import (
    file_form,
    given_values,
    instance,
    packaged,
    read,
    read_table,
    schema,
    to_number,
    toml,
)
from ..system import Bond, CoSimulation, ModelComponent, System, energy_residual, export, shaft_joints
from ..text import number
from .cutting import TurnCurves, statics, stored_shares
from .flywheels import Wheel, WheelAnswers, least_flywheel
from .measures import mean, peak

STARTED = 0.95
"""Share of the rated speed at which a start is over."""
START_LONGEST = 30.0
"""Time after which a start is given up [s]."""
START_LONG = 10.0
"""Time of a start from which on it is worth a word [s]."""
RESIDUAL = 0.01
"""Share of energy that may be missing in a run."""
FAR = 0.15
"""share by which the gear ratio of a file may differ from that of rated speed and crank speed"""
_TURN = 2.0 * math.pi


@declaration
class CuttingForce:
    """The resistance of the stack."""

    force: Value = quantity(
        "N", "resistance of the stack to the blade on its way down", default=2e4, above=0.0, max=1e9
    )


@declaration
class Train:
    """The train between motor and crank."""

    ratio: Value = quantity(
        "1",
        "gear ratio, motor turns per crank turn; 0: from rated speed and run.crank_speed",
        default=0.0,
        min=0.0,
        max=1e6,
    )
    flywheel: Value = quantity(
        "kg.m2", "inertia of the flywheel, on the motor shaft", default=0.8, min=0.0, max=1e6
    )


@declaration
class CuttingRun:
    """How the cutter runs, and its measurement."""

    crank_speed: Value = quantity(
        "rad/s",
        "speed of the crank, a cut each turn",
        default=40.0 * _TURN / 60.0,
        min=0.01,
        max=1e3,
        kind="speed",
    )
    settle_turns: Value = quantity(
        "1", "turns with the cut before the measurement", default=4.0, min=1.0, max=1000.0
    )
    turns: Value = quantity("1", "turns of the measurement", default=4.0, min=1.0, max=1000.0)
    step: Value = quantity("s", "communication step", default=1e-3, above=0.0, max=0.01)
    fluctuation: Value = quantity(
        "1",
        "permitted fluctuation of the speed, (largest - least)/mean",
        default=0.05,
        min=1e-4,
        max=1.0,
        kind="percent",
    )


_FLYWHEEL = next(
    dataclasses.replace(v, name="drive.flywheels") for v in variables(Train) if v.name == "flywheel"
)
_Machine = schema(Parameters, "machine", "machine.")
_Cut = schema(CuttingForce, "cut", "cut.")
_Train = schema(
    Train,
    "drive",
    "drive.",
    motor=(str, "IE3 4-pole 2.2 kW, 100L"),
    flywheels=(
        Annotated[
            list[Annotated[float, BeforeValidator(lambda entry: to_number(_FLYWHEEL, entry))]],
            Field(max_length=12),
        ],
        [0.0, 0.2, 0.8, 2.0],
    ),
)
_Run = schema(CuttingRun, "run", "run.")
_File = file_form("Knife", {"machine": _Machine, "cut": _Cut, "drive": _Train, "run": _Run})


@dataclasses.dataclass(frozen=True)
class KnifeConfig:
    """A knife file, checked. `machine` has the gear ratio and the values derived from its parameters."""

    title: str
    machine: Parameters
    cut: CuttingForce
    motor: CatalogueMotor
    train: Train
    flywheels: tuple[float, ...]
    """of the comparison, with that of the train [kg m2]"""
    run: CuttingRun

    @property
    def motor_speed(self) -> float:
        """Motor speed that belongs to the crank speed of the file [rad/s]."""
        return float(self.machine.ratio * self.run.crank_speed)


def load(file: Path | None = None) -> KnifeConfig:
    """Read and check a knife file; without one, the packaged example.

    Raises
    ------
    InputError
        in one line: the file, the field, its value and the allowed range.
    """
    return read(file, example, parse)


def start_of(config: KnifeConfig) -> dict[str, float]:
    """Start values of `KnifeDrive`'s parameters and inputs, by name, as the file has them."""
    turning = {"phi": 0.0, "w": config.motor_speed, "a": 0.0, "cut_force": config.cut.force}
    return KnifeDrive.parameter_layout.named(config.machine) | turning


def example() -> str:
    """The packaged knife file."""
    return packaged("knife.toml")


def parse(text: str, source: str = "knife") -> KnifeConfig:
    """A knife drive from TOML text; a value that it does not name is the start value.

    Raises
    ------
    InputError
        see `load`.
    """
    checked = read_table(_File, toml(text))
    machine_values = given_values(checked.machine)
    if "ratio" in machine_values:
        raise InputError(
            f"machine.ratio = {machine_values['ratio']:g}: the gear belongs to the drive; must be left out, give "
            "drive.ratio"
        )
    train = instance(
        Train, {k: v for k, v in given_values(checked.drive).items() if k in Layout(Train).names}
    )
    run = instance(CuttingRun, given_values(checked.run))
    _consistent(run)
    try:
        motor = motor_of_catalogue(checked.drive.motor)
    except InputError as error:
        raise InputError(f"drive.motor = {error}") from error
    nominal = motor.nameplate.speed / run.crank_speed
    ratio = train.ratio or nominal
    if not abs(ratio / nominal - 1.0) < FAR:
        raise InputError(
            f"drive.ratio = {ratio:g}: with {motor.designation} the crank would turn at "
            f"{motor.nameplate.speed / ratio:.3g} rad/s, run.crank_speed asks for {run.crank_speed:.3g} rad/s; must "
            f"be > {nominal * (1.0 - FAR):.4g} and < {nominal * (1.0 + FAR):.4g}, or change run.crank_speed"
        )
    machine = KnifeDrive.parameter_layout.from_names({**machine_values, "ratio": ratio})
    try:
        machine = KnifeDrive.check(machine)
    except InputError as error:
        raise InputError(f"machine: {error}") from error
    stack = machine.stack
    if not stack.top > stack.table:
        raise InputError(
            f"machine.stack.top = {stack.top:g} m: must be > {stack.table:g} m, the height of the table"
        )
    return KnifeConfig(
        title=checked.title,
        machine=machine,
        cut=instance(CuttingForce, given_values(checked.cut)),
        motor=motor,
        train=train,
        flywheels=tuple(sorted({train.flywheel, *checked.drive.flywheels})),
        run=run,
    )


def _consistent(run: CuttingRun) -> None:
    for name, count in (("settle_turns", run.settle_turns), ("turns", run.turns)):
        if count != int(count):
            raise InputError(f"run.{name} = {count:g}: must be a whole number")
    longest = _TURN / run.crank_speed / 300.0
    if run.step > longest:
        raise InputError(
            f"run.step = {run.step:g} s: must be <= {longest:.3g} s, a 300th of a turn at this crank_speed"
        )


@dataclasses.dataclass
class KnifeStudy:
    """The results of a study; `failure` says why it stopped early, if it did."""

    config: KnifeConfig
    statics: TurnCurves
    motor: Any
    """parameters of the motor, without flywheel"""
    wheels: list[Wheel] = dataclasses.field(default_factory=list)
    least: Wheel | None = None
    """the least flywheel that keeps the permitted fluctuation, where one was found"""
    backends: dict[str, Origin] = dataclasses.field(default_factory=dict)
    failure: RunError | None = None
    unfinished: xr.Dataset | None = None
    """the results of the run that failed, up to there"""

    def inertia(self, wheel: float) -> float:
        """On the motor shaft, with this flywheel [kg m2]."""
        return float(
            self.motor.rotor.J + wheel + self.statics.turn.inertia_mean / self.config.machine.ratio**2
        )

    def by_hand(self, wheel: float) -> float:
        """Fluctuation of the speed with this flywheel where the drive gives a constant torque."""
        swing, w = self.statics.turn.energy_swing, self.config.motor_speed
        return float(swing / (self.inertia(wheel) * w * w))

    @property
    def flywheel_by_hand(self) -> float:
        """Flywheel that keeps the permitted fluctuation by the hand formula [kg m2]; 0 where none is needed."""
        lack = self.inertia(0.0) * (self.by_hand(0.0) / self.config.run.fluctuation - 1.0)
        return max(0.0, lack)

    @property
    def own_wheel(self) -> Wheel | None:
        """The run of the drive's own flywheel, if the study got that far."""
        return next((x for x in self.wheels if x.flywheel == self.config.train.flywheel), None)


Report = Callable[[str, float, float], None]


def run_knife(
    config: KnifeConfig,
    folder: Path,
    report: Report = lambda task, done, whole: None,
    backend: Backend | None = None,
) -> KnifeStudy:
    """Compute everything; FMUs are written to ``folder/fmu``, `report` gets the present task, and how
    much of all is done.

    A run that fails ends the study early: it holds all results up to there, and `failure` says why.

    Raises
    ------
    InputError
        where no circuit meets the motor's nameplate.
    """
    turn = statics(config.machine, config.run.crank_speed, config.cut.force)
    study = KnifeStudy(config, turn, config.motor.identify().parameters)
    todo = float(len(config.flywheels) + 2)
    report("exporting FMUs", 0.0, todo)
    exported, study.backends = export(graph(study, 0.0), folder / "fmu", backend)
    files = {name: component.file for name, component in exported.components.items() if component.file}
    try:
        for k, wheel in enumerate(config.flywheels):
            report(f"cutting with a flywheel of {wheel:g} kg m2", k + 1.0, todo)
            study.wheels.append(simulated(study, files, wheel))
        study.least = _least(study, files, lambda task: report(task, todo - 1.0, todo))
    except RunError as error:
        study.failure, study.unfinished = error, error.partial
    return study


def _least(study: KnifeStudy, files: Mapping[str, Path], report: Callable[[str], None]) -> Wheel | None:
    def reported(run: Callable[..., Wheel]) -> Callable[[float], Wheel]:
        def call(wheel: float) -> Wheel:
            report(f"least flywheel: {number(wheel, 'kg.m2')}")
            return run(study, files, wheel)

        return call

    return least_flywheel(
        study.wheels,
        study.config.run.fluctuation,
        study.inertia(0.0),
        study.flywheel_by_hand,
        reported(running),
        reported(simulated),
    )


def graph(study: KnifeStudy, wheel: float, files: Mapping[str, Path] | None = None, **start: float) -> System:
    """Machine and motor with this flywheel [kg m2], with the FMUs where there are `files`; `start` sets parameters of
    the motor."""
    p = study.motor
    p = dataclasses.replace(p, rotor=dataclasses.replace(p.rotor, J=p.rotor.J + wheel), **start)
    models = {"machine": (KnifeDrive, study.config.machine), "motor": (InductionMotor, p)}
    components = {name: ModelComponent(*of, (files or {}).get(name)) for name, of in models.items()}
    return System(components, shaft_joints("motor", "machine"))


CUT = "machine.cut_force"


def _bond(study: KnifeStudy) -> Bond:
    (bond,) = graph(study, 0.0).bonds
    return bond


def simulated(study: KnifeStudy, files: Mapping[str, Path], wheel: float) -> Wheel:
    """Start without cut, a turn without cut, then a cut each turn."""
    config, run = study.config, study.config.run
    with CoSimulation(graph(study, wheel, files), {CUT: 0.0}) as simulation:
        goal = STARTED * config.motor.nameplate.speed
        start = simulation.run(START_LONGEST, run.step, guards={"motor.w": goal})
        share = energy_residual(start, _bond(study))[1]
        if float(start["motor.w"][-1]) < goal:
            return Wheel(_unanswered(study, wheel, None, share), start)
        took = float(start["time"][-1])
        free, arrived = _until_top(study, simulation, float(start["motor.phi"][-1]), 1)
        if not arrived:
            return Wheel(_unanswered(study, wheel, took, share), start, stalled=True)
        simulation.signals = {CUT: config.cut.force}
        answer = _measured(study, simulation, wheel, float(free["motor.phi"][-1]))
    answer.start = start
    share = max(share, answer.answers.residual)
    answer.answers = dataclasses.replace(answer.answers, start_time=took, residual=share)
    return answer


def running(study: KnifeStudy, files: Mapping[str, Path], wheel: float) -> Wheel:
    """Cutting only; begins with the blade at its top, at the speed where the motor gives the mean torque."""
    config, plate = study.config, study.config.motor.nameplate
    ratio = config.machine.ratio
    share = study.statics.turn.torque_mean / ratio / plate.torque
    start = {
        "w_start": plate.synchronous - (plate.synchronous - plate.speed) * min(share, 1.0),
        "phi_start": study.statics.top * ratio,
    }
    with CoSimulation(graph(study, wheel, files, **start), {CUT: config.cut.force}) as simulation:
        return _measured(study, simulation, wheel, start["phi_start"])


def _until_top(
    study: KnifeStudy, simulation: CoSimulation, phi: float, turns: int
) -> tuple[xr.Dataset, bool]:
    """Run on until the blade has come to its top `turns` times, from the motor angle `phi`; and whether it came
    there."""
    ratio, turn = study.config.machine.ratio, _TURN / study.config.run.crank_speed
    # the last row of a run before lies just behind the top
    tops = math.floor((phi / ratio - study.statics.top) / _TURN + 1e-9)
    until = (study.statics.top + (tops + turns) * _TURN) * ratio
    patience = simulation.time + 2.0 * (turns + 1) * turn
    run = simulation.run(patience, study.config.run.step, guards={"motor.phi": until})
    return run, float(run["motor.phi"][-1]) >= until


def _measured(study: KnifeStudy, simulation: CoSimulation, wheel: float, phi: float) -> Wheel:
    """Cutting, from a top of the blade: first to settle, then for the measurement."""
    run = study.config.run
    whole, arrived = _until_top(study, simulation, phi, int(run.settle_turns + run.turns))
    share = energy_residual(whole, _bond(study))[1]
    if not arrived:
        return Wheel(_unanswered(study, wheel, None, share), turns=whole, stalled=True)
    angle = whole["motor.phi"].values / study.config.machine.ratio
    first = int(np.searchsorted(angle, angle[-1] - run.turns * _TURN))
    turns = whole.isel(time=slice(first, None))
    return Wheel(_answers(study, wheel, turns, share), turns=turns)


def _unanswered(study: KnifeStudy, wheel: float, start_time: float | None, residual: float) -> WheelAnswers:
    numbers = {
        "flywheel": wheel,
        "inertia": study.inertia(wheel),
        "start_time": start_time,
        "fluctuation_by_hand": study.by_hand(wheel),
        "residual": residual,
    }
    return WheelAnswers(**{name: numbers.get(name) for name in Layout(WheelAnswers).names})


def _answers(study: KnifeStudy, wheel: float, run: xr.Dataset, residual: float) -> WheelAnswers:
    """The numbers of whole turns."""
    config = study.config
    w, i, tau = (run[name].values for name in ("motor.w", "motor.i", "motor.air_gap_tau"))
    swing = float(np.ptp(w))
    current = math.sqrt(mean(run, i * i))
    net, most = stored_shares(run, study.motor.rotor.J + wheel)
    return WheelAnswers(
        flywheel=wheel,
        inertia=study.inertia(wheel),
        start_time=None,
        speed_mean=mean(run, w) / config.machine.ratio,
        speed_least=float(np.min(w)) / config.machine.ratio,
        fluctuation=swing / mean(run, w),
        fluctuation_by_hand=study.by_hand(wheel),
        motor_torque_peak=peak(tau),
        motor_torque_rms=math.sqrt(mean(run, tau * tau)),
        current_peak=float(np.max(i)),
        current_rms=current,
        current_share=current / config.motor.nameplate.rated_current,
        supply_power_mean=mean(run, run["motor.supply_power"].values),
        stored_share=net,
        stored_share_most=most,
        drift=abs(float(w[-1] - w[0])) / max(swing, 1e-12),
        residual=residual,
    )
