"""A paper cutter's knife drive: motion, forces and work of a turn; how motor and flywheel share the cut.

The mechanics are in `machines.knife_drive`. The turn at constant speed needs no simulation; start-up and cutting are
co-simulated by the FMUs of machine and motor, once for each flywheel.
"""

from __future__ import annotations

import dataclasses
import difflib
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import xarray as xr
from pydantic import BeforeValidator, ConfigDict, Field, ValidationError, create_model

from .. import __version__
from ..drives.catalogue import CatalogueMotor, catalogue
from ..drives.induction_motor import InductionMotor
from ..engines import numpy_
from ..errors import InputError, RunError, shown
from ..fmu.backends import Backend
from ..machines.knife_drive import KnifeDrive, Parameters
from ..quantities import Layout, Value, declaration, quantity, variables
from ..reading import Title, first_line, given_values, instance, packaged, read, schema, to_number, toml
from ..system import Bond, CoSimulation, ModelComponent, System, energy_residual, export, shaft_joints
from ..text import number
from .duty import flywheel
from .result import entries

PINS = {
    "O1 crank bearing": "crank_bearing",
    "A crank pin": "crank_pin",
    "B coupler AB": "coupler_pin",
    "B leg BC": "leg_pin",
    "O2 rocker bearing": "rocker_bearing",
    "C": "c_pin",
    "D": "d_pin",
    "E": "e_pin",
    "O3 bearing": "o3_bearing",
    "O4 bearing": "o4_bearing",
}
POINTS = 3600
"""Crank angles of the turn at constant speed."""
STARTED = 0.95
"""Share of the rated speed at which a start is over."""
START_LONGEST = 30.0
"""Time after which a start is given up [s]."""
START_LONG = 10.0
"""Time of a start from which on it is worth a word [s]."""
RESIDUAL = 0.01
"""Share of energy that may be missing in a run."""
CLOSE = 0.03
"""Relative width to which the least flywheel's fluctuation is found, below the one permitted."""
FAR = 0.15
"""share by which a given gear ratio may differ from that of rated speed and crank speed"""
_TURN = 2.0 * math.pi


@declaration
class Cut:
    """The cut."""

    force: Value = quantity(
        "N", "resistance of the stack to the blade on its way down", default=2e4, above=0.0, max=1e9
    )


@declaration
class Train:
    """What is between the line and the crank."""

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
class Running:
    """How the cutter runs, and what is measured."""

    crank_speed: Value = quantity(
        "rad/s",
        "speed of the crank, a cut each turn",
        default=40.0 * _TURN / 60.0,
        min=0.01,
        max=1e3,
        kind="speed",
    )
    settle_turns: Value = quantity(
        "1", "turns with the cut before what is measured", default=4.0, min=1.0, max=1000.0
    )
    turns: Value = quantity("1", "turns that are measured", default=4.0, min=1.0, max=1000.0)
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
_Cut = schema(Cut, "cut", "cut.")
_Train = schema(
    Train,
    "drive",
    "drive.",
    motor=(str, "IE3 4-pole 2.2 kW, 100L"),
    flywheels=(
        Annotated[
            list[Annotated[float, BeforeValidator(lambda given: to_number(_FLYWHEEL, given))]],
            Field(max_length=12),
        ],
        [0.0, 0.2, 0.8, 2.0],
    ),
)
_Running = schema(Running, "run", "run.")
_File: Any = create_model(
    "Knife",
    __config__=ConfigDict(extra="forbid"),
    title=(Title, ""),
    machine=(_Machine, Field(default_factory=_Machine)),
    cut=(_Cut, Field(default_factory=_Cut)),
    drive=(_Train, Field(default_factory=_Train)),
    run=(_Running, Field(default_factory=_Running)),
)


@dataclasses.dataclass(frozen=True)
class Config:
    """A knife file, checked. `machine` has the gear ratio and what is derived from its parameters."""

    title: str
    machine: Parameters
    cut: Cut
    motor: CatalogueMotor
    train: Train
    flywheels: tuple[float, ...]
    """that are compared, with the one that is given [kg m2]"""
    run: Running

    @property
    def motor_speed(self) -> float:
        """Motor speed that belongs to the crank speed asked for [rad/s]."""
        return float(self.machine.ratio * self.run.crank_speed)


def load(file: Path | None = None) -> Config:
    """Read and check a knife file; without one, the packaged example.

    Raises
    ------
    InputError
        in one line: the file, the field, its value and what is allowed.
    """
    return read(file, example, parse)


def start_of(config: Config) -> dict[str, float]:
    """Start values of `KnifeDrive`'s parameters and inputs, by name, as the file has them."""
    turning = {"phi": 0.0, "w": config.motor_speed, "a": 0.0, "cut_force": config.cut.force}
    return KnifeDrive.parameter_layout.named(config.machine) | turning


def example() -> str:
    """The packaged knife file."""
    return packaged("knife.toml")


def parse(text: str, source: str = "knife") -> Config:
    """A knife drive from TOML text; what it does not name is at its start value.

    Raises
    ------
    InputError
        see `load`.
    """
    try:
        checked: Any = _File.model_validate(toml(text))
    except ValidationError as error:
        raise InputError(first_line(error, _File)) from error
    given = given_values(checked.machine)
    if "ratio" in given:
        raise InputError(
            f"machine.ratio = {given['ratio']:g}: the gear belongs to the drive; must be left out, give drive.ratio"
        )
    train = instance(
        Train, {k: v for k, v in given_values(checked.drive).items() if k in Layout(Train).names}
    )
    run = instance(Running, given_values(checked.run))
    _consistent(run)
    motor = _motor(checked.drive.motor)
    wanted = motor.nameplate.speed / run.crank_speed
    ratio = train.ratio or wanted
    if not abs(ratio / wanted - 1.0) < FAR:
        raise InputError(
            f"drive.ratio = {ratio:g}: with {motor.designation} the crank would turn at "
            f"{motor.nameplate.speed / ratio:.3g} rad/s, run.crank_speed asks for {run.crank_speed:.3g} rad/s; must "
            f"be > {wanted * (1.0 - FAR):.4g} and < {wanted * (1.0 + FAR):.4g}, or change run.crank_speed"
        )
    machine = KnifeDrive.parameter_layout.from_names({**given, "ratio": ratio})
    try:
        machine = KnifeDrive.check(machine)
    except InputError as error:
        raise InputError(f"machine: {error}") from error
    stack = machine.stack
    if not stack.top > stack.table:
        raise InputError(
            f"machine.stack.top = {stack.top:g} m: must be > {stack.table:g} m, the height of the table"
        )
    return Config(
        title=checked.title,
        machine=machine,
        cut=instance(Cut, given_values(checked.cut)),
        motor=motor,
        train=train,
        flywheels=tuple(sorted({train.flywheel, *checked.drive.flywheels})),
        run=run,
    )


def _consistent(run: Running) -> None:
    for name, count in (("settle_turns", run.settle_turns), ("turns", run.turns)):
        if count != int(count):
            raise InputError(f"run.{name} = {count:g}: must be a whole number")
    longest = _TURN / run.crank_speed / 300.0
    if run.step > longest:
        raise InputError(
            f"run.step = {run.step:g} s: must be <= {longest:.3g} s, a 300th of a turn at this crank_speed"
        )


def _motor(designation: str) -> CatalogueMotor:
    motors = {m.designation: m for m in catalogue()}
    if designation not in motors:
        near = difflib.get_close_matches(designation, motors, n=3, cutoff=0.0)
        raise InputError(
            f"drive.motor = {shown(designation)}: not in the catalogue; must be one of its designations, such as "
            + ", ".join(f'"{name}"' for name in near)
        )
    return motors[designation]


@declaration
class Turn:
    """A turn of the crank at constant speed."""

    blade_top: Value = quantity("m", "blade, highest y", kind="millimetres")
    blade_bottom: Value = quantity("m", "blade, lowest y", kind="millimetres")
    blade_draw: Value = quantity("m", "blade, way along x in the stack", kind="millimetres")
    tilt_least: Value = quantity("rad", "tilt of the blade, least")
    tilt_largest: Value = quantity("rad", "tilt of the blade, largest")
    speed_in_stack: Value = quantity("m/s", "speed of the blade in the stack, largest")
    torque_peak: Value = quantity("N.m", "crank torque, peak, cutting")
    torque_peak_free: Value = quantity("N.m", "crank torque, peak, without cut")
    torque_mean: Value = quantity("N.m", "crank torque, mean, cutting")
    cut_work: Value = quantity("J", "work of a cut")
    cut_path: Value = quantity("m", "path of the blade through the stack", kind="millimetres")
    cut_work_by_path: Value = quantity("J", "force times path through the stack")
    losses: Value = quantity("J", "losses of the pins in a turn, cutting")
    energy_swing: Value = quantity("J", "energy to be stored at constant torque of the drive")
    inertia_least: Value = quantity("kg.m2", "inertia reflected to the crank, least")
    inertia_largest: Value = quantity("kg.m2", "inertia reflected to the crank, largest")
    inertia_mean: Value = quantity("kg.m2", "inertia reflected to the crank, mean")
    margin: Value = quantity("1", "margin from a dead position, least")


@declaration
class Reaction:
    """The peak of a pin over a turn at constant speed, and the crank angle at which it comes."""

    peak: Value = quantity("N", "largest reaction, cutting")
    angle: Value = quantity("rad", "crank angle of it")
    peak_free: Value = quantity("N", "largest reaction, without cut")
    angle_free: Value = quantity("rad", "crank angle of it")


@dataclasses.dataclass(frozen=True)
class Statics:
    """The turn at constant speed; arrays over `angle`, shape (POINTS,)."""

    angle: Any
    """of the crank [rad]"""
    torque: Any
    """of the crank, cutting [N.m]"""
    torque_free: Any
    """without cut [N.m]"""
    inertia: Any
    """at the crank [kg.m2]"""
    x: Any
    """of the blade [m]"""
    y: Any
    tilt: Any
    """[rad]"""
    turn: Turn
    pins: dict[str, Reaction]

    @property
    def top(self) -> float:
        """Crank angle at which the blade is highest [rad]."""
        return float(self.angle[np.argmax(self.y)])


def statics(config: Config) -> Statics:
    """The turn at the crank speed asked for, with and without the cut."""
    p, w = config.machine, config.run.crank_speed
    angle = np.arange(POINTS) * (_TURN / POINTS)
    cutting, free = turning(config, angle, config.cut.force), turning(config, angle, 0.0)
    torque, torque_free = (np.broadcast_to(o.tau * p.ratio, angle.shape) for o in (cutting, free))
    blade = cutting.blade
    time = _TURN / POINTS / w
    against = -(blade.cut_fx * blade.vx + blade.cut_fy * blade.vy)
    work = float(np.sum(against)) * time
    losses = float(np.mean(cutting.dissipated_power)) * _TURN / w - work
    inside = in_stack(p.stack, blade.x, blade.y)
    path = float(np.sum(inside * _way(blade.x, blade.y)))
    inertia = np.broadcast_to(cutting.J * p.ratio**2, angle.shape)
    speed = np.hypot(blade.vx, blade.vy)
    turn = Turn(
        blade_top=float(np.max(blade.y)),
        blade_bottom=float(np.min(blade.y)),
        blade_draw=abs(float(np.sum(inside * (np.roll(blade.x, -1) - blade.x)))),
        tilt_least=float(np.min(blade.tilt)),
        tilt_largest=float(np.max(blade.tilt)),
        speed_in_stack=float(np.max(speed, where=inside > 0.0, initial=0.0)),
        torque_peak=float(np.max(np.abs(torque))),
        torque_peak_free=float(np.max(np.abs(torque_free))),
        torque_mean=float(np.mean(torque)),
        cut_work=work,
        cut_path=path,
        cut_work_by_path=config.cut.force * path,
        losses=losses if losses > 1e-9 * work else 0.0,  # of two sums that differ by roundoff alone
        energy_swing=flywheel(torque, w, 1.0) * w * w,
        inertia_least=float(np.min(inertia)),
        inertia_largest=float(np.max(inertia)),
        inertia_mean=float(np.mean(inertia)),
        margin=float(np.min(cutting.margin)),
    )
    pins = {}
    for title, name in PINS.items():
        sizes = [np.hypot(getattr(o, name).fx, getattr(o, name).fy) for o in (cutting, free)]
        at = [int(np.argmax(size)) for size in sizes]
        pins[title] = Reaction(
            peak=float(sizes[0][at[0]]),
            angle=float(angle[at[0]]),
            peak_free=float(sizes[1][at[1]]),
            angle_free=float(angle[at[1]]),
        )
    return Statics(angle, torque, torque_free, inertia, blade.x, blade.y, blade.tilt, turn, pins)


def turning(config: Config, angle: Any, force: float) -> Any:
    """The machine's outputs at crank angles [rad] and the crank speed asked for, under a cutting force [N]."""
    given = {"phi": angle * config.machine.ratio, "w": config.motor_speed, "cut_force": force}
    return KnifeDrive.evaluate(numpy_(), config.machine, KnifeDrive.input_layout.from_names(given))[0]


def _way(x: Any, y: Any) -> Any:
    """Length of each piece of a closed path [m]."""
    return np.hypot(np.roll(x, -1) - x, np.roll(y, -1) - y)


def in_stack(stack: Any, x: Any, y: Any) -> Any:
    """Share of each piece of the blade's closed path that goes down between top and table, shape (n,)."""
    after = np.roll(y, -1)
    within = np.clip(y, stack.table, stack.top) - np.clip(after, stack.table, stack.top)
    fall = y - after
    return np.where(fall > 0.0, within / np.where(fall > 0.0, fall, 1.0), 0.0)


@declaration
class Answers:
    """What the co-simulation of a flywheel gave; None where the motor does not start, or stalls under the cut. Torque
    and current of the motor are those of cutting, over whole turns."""

    flywheel: Value = quantity("kg.m2", "flywheel, on the motor shaft")
    inertia: Value = quantity("kg.m2", "rotor, flywheel and mean of the machine, on the motor shaft")
    start_time: Value = quantity("s", "start without cut, to 95 % of the rated speed")
    speed_mean: Value = quantity("rad/s", "crank speed, mean; cuts per minute", kind="speed")
    speed_least: Value = quantity("rad/s", "crank speed, least", kind="speed")
    fluctuation: Value = quantity("1", "fluctuation of the speed", kind="percent")
    fluctuation_by_hand: Value = quantity("1", "fluctuation by hand, dE/(J w2)", kind="percent")
    motor_torque_peak: Value = quantity("N.m", "motor torque (air gap), peak")
    motor_torque_rms: Value = quantity("N.m", "motor torque (air gap), RMS")
    current_peak: Value = quantity("A", "motor current, peak")
    current_rms: Value = quantity("A", "motor current, RMS")
    current_share: Value = quantity("1", "RMS current over rated current", kind="percent")
    supply_power_mean: Value = quantity("W", "electric power, mean")
    stored_share: Value = quantity(
        "1", "share of a cut's work from flywheel and moving masses, over the cut", kind="percent"
    )
    stored_share_most: Value = quantity(
        "1", "the same, from the beginning of the cut to where they have least", kind="percent"
    )
    drift: Value = quantity(
        "1", "change of speed over the measured turns, as a share of the fluctuation", kind="percent"
    )
    residual: Value = quantity("1", "energy residual, the larger of start and cutting", kind="percent")


@dataclasses.dataclass
class Wheel:
    """A flywheel with its runs. `turns` are those that were measured, or where it stalled, all that were tried."""

    answers: Answers
    start: xr.Dataset | None = None
    turns: xr.Dataset | None = None
    stalled: bool = False
    """under the cut"""

    @property
    def flywheel(self) -> float:
        """[kg m2]"""
        return float(self.answers.flywheel)

    def keeps(self, fluctuation: float) -> bool:
        """Whether it cuts and keeps the fluctuation."""
        return self.answers.fluctuation is not None and self.answers.fluctuation <= fluctuation


@dataclasses.dataclass
class KnifeStudy:
    """What a study found; `failure` says why it stopped early, if it did."""

    config: Config
    statics: Statics
    motor: Any
    """parameters of the motor, without flywheel"""
    wheels: list[Wheel] = dataclasses.field(default_factory=list)
    least: Wheel | None = None
    """the least flywheel that keeps the permitted fluctuation, where one was found"""
    made: dict[str, str] = dataclasses.field(default_factory=dict)
    warnings: list[str] = dataclasses.field(default_factory=list)
    notes: list[str] = dataclasses.field(default_factory=list)
    failure: RunError | None = None
    unfinished: xr.Dataset | None = None
    """what the run that failed had computed"""

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
        needed = self.inertia(0.0) * (self.by_hand(0.0) / self.config.run.fluctuation - 1.0)
        return max(0.0, needed)

    @property
    def given(self) -> Wheel | None:
        """The run of the flywheel that is given, if it got that far."""
        return next((x for x in self.wheels if x.flywheel == self.config.train.flywheel), None)


Report = Callable[[str, float, float], None]


def run_knife(
    config: Config,
    folder: Path,
    report: Report = lambda what, done, todo: None,
    backend: Backend | None = None,
) -> KnifeStudy:
    """Compute everything; FMUs are written to ``folder/fmu``, `report` is told what is done and how much of it.

    A run that fails ends the study early: what was computed is in it, and `failure` says why.

    Raises
    ------
    InputError
        where no circuit meets the motor's nameplate.
    """
    study = KnifeStudy(config, statics(config), config.motor.identify().parameters)
    todo = float(len(config.flywheels) + 2)
    report("exporting FMUs", 0.0, todo)
    exported, study.made = export(graph(study, 0.0), folder / "fmu", backend)
    files = {name: component.file for name, component in exported.components.items() if component.file}
    try:
        for k, wheel in enumerate(config.flywheels):
            report(f"cutting with a flywheel of {wheel:g} kg m2", k + 1.0, todo)
            study.wheels.append(simulated(study, files, wheel))
        study.least = _least(
            study, files, lambda wheel: report(f"least flywheel: {_kg_m2(wheel)}", todo - 1.0, todo)
        )
    except RunError as error:
        study.failure, study.unfinished = error, error.partial
    study.warnings, study.notes = _warnings(study), _notes(study)
    return study


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
        started = STARTED * config.motor.nameplate.speed
        start = simulation.run(START_LONGEST, run.step, guards={"motor.w": started})
        share = energy_residual(start, _bond(study))[1]
        if float(start["motor.w"][-1]) < started:
            return Wheel(_unanswered(study, wheel, None, share), start)
        took = float(start["time"][-1])
        free, arrived = _until_top(study, simulation, float(start["motor.phi"][-1]), 1)
        if not arrived:
            return Wheel(_unanswered(study, wheel, took, share), start, stalled=True)
        simulation.signals = {CUT: config.cut.force}
        found = _measured(study, simulation, wheel, float(free["motor.phi"][-1]))
    found.start = start
    share = max(share, found.answers.residual)
    found.answers = dataclasses.replace(found.answers, start_time=took, residual=share)
    return found


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
    """Run on until the blade has come to its top `turns` times, from the motor angle `phi`; and whether it did."""
    ratio, turn = study.config.machine.ratio, _TURN / study.config.run.crank_speed
    # the last row of a run before lies just behind the top
    passed = math.floor((phi / ratio - study.statics.top) / _TURN + 1e-9)
    until = (study.statics.top + (passed + turns) * _TURN) * ratio
    patience = simulation.time + 2.0 * (turns + 1) * turn
    run = simulation.run(patience, study.config.run.step, guards={"motor.phi": until})
    return run, float(run["motor.phi"][-1]) >= until


def _measured(study: KnifeStudy, simulation: CoSimulation, wheel: float, phi: float) -> Wheel:
    """Cutting, from a top of the blade: first to settle, then what is measured."""
    run = study.config.run
    whole, arrived = _until_top(study, simulation, phi, int(run.settle_turns + run.turns))
    share = energy_residual(whole, _bond(study))[1]
    if not arrived:
        return Wheel(_unanswered(study, wheel, None, share), turns=whole, stalled=True)
    angle = whole["motor.phi"].values / study.config.machine.ratio
    first = int(np.searchsorted(angle, angle[-1] - run.turns * _TURN))
    turns = whole.isel(time=slice(first, None))
    return Wheel(_answers(study, wheel, turns, share), turns=turns)


def _unanswered(study: KnifeStudy, wheel: float, start_time: float | None, residual: float) -> Answers:
    known = {
        "flywheel": wheel,
        "inertia": study.inertia(wheel),
        "start_time": start_time,
        "fluctuation_by_hand": study.by_hand(wheel),
        "residual": residual,
    }
    return Answers(**{name: known.get(name) for name in Layout(Answers).names})


def _answers(study: KnifeStudy, wheel: float, run: xr.Dataset, residual: float) -> Answers:
    """The numbers of whole turns."""
    config = study.config
    time, w, i, tau = (run[name].values for name in ("time", "motor.w", "motor.i", "motor.air_gap_tau"))

    def mean(x: Any) -> float:
        return float(np.trapezoid(x, time) / (time[-1] - time[0]))

    swing = float(np.ptp(w))
    current = math.sqrt(mean(i * i))
    net, most = stored_shares(study, run, wheel)
    return Answers(
        flywheel=wheel,
        inertia=study.inertia(wheel),
        start_time=None,
        speed_mean=mean(w) / config.machine.ratio,
        speed_least=float(np.min(w)) / config.machine.ratio,
        fluctuation=swing / mean(w),
        fluctuation_by_hand=study.by_hand(wheel),
        motor_torque_peak=float(np.max(np.abs(tau))),
        motor_torque_rms=math.sqrt(mean(tau * tau)),
        current_peak=float(np.max(i)),
        current_rms=current,
        current_share=current / config.motor.nameplate.rated_current,
        supply_power_mean=mean(run["motor.supply_power"].values),
        stored_share=net,
        stored_share_most=most,
        drift=abs(float(w[-1] - w[0])) / max(swing, 1e-12),
        residual=residual,
    )


def cutting_power(run: xr.Dataset) -> Any:
    """Power that the stack takes from the blade [W], shape (time,)."""
    vx, vy, fx, fy = (run[f"machine.blade.{name}"].values for name in ("vx", "vy", "cut_fx", "cut_fy"))
    return -(fx * vx + fy * vy)


def stored_shares(study: KnifeStudy, run: xr.Dataset, wheel: float) -> tuple[float | None, float | None]:
    """What rotor, flywheel and machine lose of their kinetic and potential energy while the blade is in the stack,
    over the work of the cuts: from the beginning of a cut to its end, and from its beginning to where they have
    least. None where nothing is cut.

    The rest comes from the motor through the air gap, less friction; towards the end of a cut, where the blade slows
    down, the motor may already give back to them.
    """
    power, time = cutting_power(run), run["time"].values
    if not study.statics.turn.cut_path > 0.0:
        return None, None
    stored = (
        0.5 * (study.motor.rotor.J + wheel) * run["motor.w"].values ** 2
        + run["machine.kinetic_energy"].values
        + run["machine.potential_energy"].values
    )
    inside = power > 0.01 * np.max(power)
    edge = np.diff(np.concatenate([[False], inside, [False]]).astype(int))
    net = most = work = 0.0
    for a, b in zip(np.flatnonzero(edge > 0), np.flatnonzero(edge < 0), strict=True):
        net += float(stored[a] - stored[b - 1])
        most += float(stored[a] - np.min(stored[a:b]))
        work += float(np.trapezoid(power[a:b], time[a:b]))
    return net / work, most / work


def _least(study: KnifeStudy, files: Mapping[str, Path], tell: Callable[[float], None]) -> Wheel | None:
    """The least flywheel that keeps the permitted fluctuation, to `CLOSE` of the fluctuation; None where none of the
    list does, nor the one by hand or a fifth more than the largest. It need not start. `tell`
    is told each flywheel that is tried.

    The fluctuation falls with the inertia, and between two flywheels nearly as a power of it.
    """

    def tried(run: Callable[..., Wheel], wheel: float) -> Wheel:
        tell(wheel)
        return run(study, files, wheel)

    permitted = study.config.run.fluctuation
    above = next((wheel for wheel in study.wheels if wheel.keeps(permitted)), None)
    # what does not start is not too light
    started = [wheel for wheel in study.wheels if wheel.answers.start_time is not None]
    below = next((w for w in reversed(started) if above is None or w.flywheel < above.flywheel), None)
    if below is None:
        below = tried(running, 0.0)
        if above is not None and above.flywheel == 0.0:
            return above
        if below.keeps(permitted):
            return tried(simulated, 0.0)
    if above is None:
        above = tried(running, max(study.flywheel_by_hand, 1.2 * below.flywheel))
        if not above.keeps(permitted):
            return None
    for _ in range(8):
        if above.answers.fluctuation >= (1.0 - CLOSE) * permitted:
            break
        x = [math.log(wheel.answers.inertia) for wheel in (below, above)]
        share = 0.5
        if below.answers.fluctuation is not None:
            y = [math.log(wheel.answers.fluctuation) for wheel in (below, above)]
            # a little below what is permitted, so that the next one is likely to keep it
            wanted = math.log((1.0 - 0.5 * CLOSE) * permitted)
            share = min(max((y[0] - wanted) / (y[0] - y[1]), 0.05), 0.95)
        middle = tried(running, math.exp(x[0] + share * (x[1] - x[0])) - study.inertia(0.0))
        if middle.keeps(permitted):
            above = middle
        else:
            below = middle
    if above.start is not None:
        return above
    # the start warms the windings, and the motor slips a little more
    found = tried(simulated, above.flywheel)
    for _ in range(4):
        if found.answers.fluctuation is None or found.keeps(permitted):
            break
        heavier = found.answers.inertia * found.answers.fluctuation / permitted * (1.0 + CLOSE)
        found = tried(simulated, heavier - study.inertia(0.0))
    return found


def _kg_m2(inertia: float) -> str:
    return number(inertia, "kg.m2")


def _percent(share: float) -> str:
    return number(share, "1", "percent")


def _height(y: float) -> str:
    return number(y, "m", "millimetres", 4)


def _warnings(study: KnifeStudy) -> list[str]:
    """In words and numbers, what an engineer should change."""
    config, turn, stack = study.config, study.statics.turn, study.config.machine.stack
    warnings = []
    if turn.blade_bottom > stack.top:
        warnings.append(
            f"No cut takes place: the blade comes down to y = {_height(turn.blade_bottom)}, the stack's top is "
            f"at {_height(stack.top)}."
        )
    elif turn.blade_bottom > stack.table:
        warnings.append(
            f"The blade does not reach the table: it comes down to y = {_height(turn.blade_bottom)}, the table "
            f"is at {_height(stack.table)}."
        )
    if turn.blade_top < stack.top:
        warnings.append(
            f"The blade does not leave the stack: it rises to y = {_height(turn.blade_top)}, the stack's top is "
            f"at {_height(stack.top)}."
        )
    plate = config.motor.nameplate
    rated, mean = plate.rated_current, turn.torque_mean / config.machine.ratio
    if mean > plate.torque:
        warnings.append(
            f"Cutting takes {number(mean, 'N.m')} of the motor on average, rated is "
            f"{number(plate.torque, 'N.m')}: a larger motor helps, no flywheel does."
        )
    for wheel in study.wheels:
        a, which = wheel.answers, f"With a flywheel of {_kg_m2(wheel.flywheel)}"
        if wheel.stalled:
            warnings.append(
                f"{which} the motor stalls under the cut: a larger motor or flywheel, or less force."
            )
        elif a.start_time is None:
            warnings.append(
                f"{which} the motor does not come to {_percent(STARTED)} of its rated speed in "
                f"{number(START_LONGEST, 's', full=False)}."
            )
        elif a.current_share > 1.0:
            warnings.append(
                f"{which} the RMS current is {number(a.current_rms, 'A')}, rated is {number(rated, 'A')}: the motor "
                "becomes too hot."
            )
        if a.start_time is not None and a.start_time > START_LONG:
            warnings.append(
                f"{which} the start takes {number(a.start_time, 's')}, more than "
                f"{number(START_LONG, 's', full=False)}."
            )
        if a.residual > RESIDUAL:
            warnings.append(
                f"{which} {_percent(a.residual)} of the energy is missing: a shorter run.step is needed."
            )
        if a.drift is not None and a.drift > 0.1:
            warnings.append(
                f"{which} the speed still changes over the measured turns, by {_percent(a.drift)} of its "
                "fluctuation: more run.settle_turns."
            )
    permitted = config.run.fluctuation
    given = study.given
    if given is not None and given.answers.fluctuation is not None and not given.keeps(permitted):
        warnings.append(
            f"The speed fluctuates by {_percent(given.answers.fluctuation)} with the flywheel that is given, "
            f"{_kg_m2(given.flywheel)}; permitted is {_percent(permitted)}."
        )
    # what was not tried is not judged
    if study.failure is None and not any(wheel.keeps(permitted) for wheel in study.wheels):
        warnings.append(
            f"No flywheel of the list keeps the speed within {_percent(permitted)}"
            + ("." if study.least is not None else ", nor does a larger one that was tried.")
        )
    return warnings


def _notes(study: KnifeStudy) -> list[str]:
    turn, config, least = study.statics.turn, study.config, study.least
    permitted, by_hand = config.run.fluctuation, study.flywheel_by_hand
    notes = []
    if least is not None:
        a, hand = (
            least.answers,
            f"the hand formula asks for {_kg_m2(by_hand)}" if by_hand else "nor is it by hand",
        )
        said = (
            f"A fluctuation of {_percent(permitted)} takes a flywheel of {_kg_m2(least.flywheel)} at least, found "
            f"to {_percent(CLOSE)} of the fluctuation; {hand}"
            if least.flywheel
            else f"For a fluctuation of {_percent(permitted)} no flywheel is needed; {hand}"
        )
        if by_hand:
            said += ", as it leaves out that the motor's torque rises where the speed falls"
        if a.fluctuation is None:
            notes.append(
                f"{said}. But the motor does not come up to speed with it, or stalls in the first cut."
            )
        else:
            lent = a.stored_share_most
            words = (
                [] if lent is None else [f"flywheel and moving masses lend {_percent(lent)} of a cut's work"]
            )
            words += [
                f"the RMS current is {_percent(a.current_share)} of the rated",
                f"the start takes {number(a.start_time, 's')}",
            ]
            notes.append(f"{said}. {'With it' if least.flywheel else 'Without'} {', '.join(words)}.")
    if turn.cut_path > 0.0:
        notes.append(
            f"Work of a cut {number(turn.cut_work, 'J')}; force times path through the stack "
            f"{number(turn.cut_work_by_path, 'J')}. The resistance rises and falls over stack.edge, and fades "
            "below stack.v_smooth."
        )
    notes.append(
        "The windings begin cold and have no time to warm up in these runs; warm, the motor slips more."
    )
    return notes


def as_dict(study: KnifeStudy) -> dict[str, Any]:
    """Ready for JSON, each number with its unit; what there is not is null."""

    def sizes(x: Any, unit: str, kind: str = "") -> dict[str, Any]:
        return {"value": np.asarray(x, dtype=float).tolist(), "unit": unit} | ({"kind": kind} if kind else {})

    config, s, plate = study.config, study.statics, study.config.motor.nameplate
    return {
        "chainunit": __version__,
        "title": config.title,
        "machine": entries(config.machine),
        "cut": entries(config.cut),
        "drive": {
            **entries(config.train),
            "motor": config.motor.designation,
            "rated_power": sizes(plate.power, "W"),
            "rated_current": sizes(plate.rated_current, "A"),
            "rated_torque": sizes(plate.torque, "N.m"),
            "rated_speed": sizes(plate.speed, "rad/s", "speed"),
            "rotor_inertia": sizes(study.motor.rotor.J, "kg.m2"),
        },
        "run": entries(config.run),
        "turn": entries(s.turn),
        "pins": {title: entries(reaction) for title, reaction in s.pins.items()},
        "over_turn": {
            "angle": sizes(s.angle[::10], "rad"),
            "torque": sizes(s.torque[::10], "N.m"),
            "torque_free": sizes(s.torque_free[::10], "N.m"),
            "inertia": sizes(s.inertia[::10], "kg.m2"),
            "blade_x": sizes(s.x[::10], "m"),
            "blade_y": sizes(s.y[::10], "m"),
            "tilt": sizes(s.tilt[::10], "rad"),
        },
        "flywheels": [{**entries(w.answers), "stalled": w.stalled} for w in study.wheels],
        "least_flywheel": None if study.least is None else entries(study.least.answers),
        "flywheel_by_hand": sizes(study.flywheel_by_hand, "kg.m2"),
        "fmus": study.made,
        "warnings": study.warnings,
        "notes": study.notes,
        "failure": None if study.failure is None else str(study.failure),
    }
