"""The main job: start-up, steady running and one-sided overloads of a machine with its motor.

The FMUs are exported, co-simulated, and the answers are read from what they did. Every transient branches
from the same steady state, saved once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from .. import __version__
from ..config import OVERLOADS, Chain, Config
from ..config import SCENARIOS as SCENARIOS
from ..drives.cardan import ORDERS, two_joints
from ..drives.dc_motor import DcMotor
from ..drives.speed_control import Loop, Tuning, loop
from ..engines import numpy_
from ..errors import InputError, InterruptedRunError, RunError
from ..fmu.backends import Backend
from ..machines.api import EMPTY
from ..machines.chain_unit import SIDES, DirectChainUnit, SideName
from ..quantities import Layout, Value, declaration, quantity
from ..system import CoSimulation, Jump, ModelComponent, Profile, System, certify, monolithic
from ..system.certificate import Feed
from ..text import entry, number
from . import protection, verdict
from .chain import HIGH, ChainResult, study_chain
from .choice import choose
from .cycle import OverloadFactors, Sides, all_on_one, cycle, factors_for, overload_factors, sides_over_speed
from .drive import Drive
from .monte_carlo import MonteCarloResult, Task
from .monte_carlo import run as run_monte_carlo
from .quantiles import runs_needed
from .shaft import AMPLIFIED, NEAR, Cycles, ShaftAnswers, Torsion, shaft_answers, torsion, with_rigid
from .sizing import BURNT, SizingResult
from .verdict import RESIDUAL, STEADY, Holds, Verdict

PINS = {
    "O1 crank bearing": "crank_bearing",
    "A crank pin": "crank_pin",
    "Bd coupler pin": "coupler_pin",
    "C rocker pivot": "pivot",
    "A2 left web at rocker": "left.rocker_joint",
    "B left hinge": "left.hinge",
    "A1 left support": "left.support",
    "A2 right web at rocker": "right.rocker_joint",
    "B right hinge": "right.hinge",
    "A1 right support": "right.support",
}


LOAD_CYCLE = "load_cycle.csv"
"""File with the steady turns as the motor's shaft sees them."""


@declaration
class Answers:
    """What a run asks of the drive; torques and speeds are the crank's unless they are called the motor's. Means
    and RMS are over the time of whole turns of the crank; steady running is the turns that `load_cycle.csv` holds.
    `power_peak` is the most that the motor gives, 0 where it only brakes.

    The ripple is (largest - least)/mean of the speed; `shaft_share` the peak torque on the machine's shaft over
    that of the motor (the rest is the rotor's inertia); `shaking_*` the largest deviation of the frame's load
    from its mean, the moment about C; `torque_reserve` least part that is left of the driving torque that the warm
    motor can give at an instant, at its speed, voltage and frequency: 0 at the limit, less where a transient passes
    it, None in a start;
    `winding_temperature` is where the winding comes to rest if the steady turns go on for ever;
    `cycle_gap` is the difference between the ends of the steady turns, of speed or torque, over the largest value;
    times count from the event; `energy_after_trip` passes the safety coupling while it opens, `energy_behind`
    stays in the machine."""

    crank_torque_peak: Value = quantity("N.m", "crank torque, peak")
    crank_torque_rms: Value = quantity("N.m", "crank torque, RMS")
    crank_torque_mean: Value = quantity("N.m", "crank torque, mean")
    motor_torque_peak: Value = quantity("N.m", "motor torque, peak")
    motor_torque_rms: Value = quantity("N.m", "motor torque, RMS")
    power_peak: Value = quantity("W", "shaft power, peak")
    power_mean: Value = quantity("W", "shaft power, mean")
    supply_power_mean: Value = quantity("W", "electric power, mean")
    current_peak: Value = quantity("A", "motor current, peak")
    current_rms: Value = quantity("A", "motor current, RMS")
    winding_temperature: Value = quantity("K", "winding temperature, thermal steady state")
    rocker_torque_peak: Value = quantity("N.m", "rocker torque, peak")
    speed_mean: Value = quantity("rad/s", "crank speed, mean")
    speed_least: Value = quantity("rad/s", "crank speed, least")
    speed_ripple: Value = quantity("1", "speed ripple", kind="percent")
    cycle_gap: Value = quantity("1", "gap between the ends of the steady turns", kind="percent")
    speed_dip: Value = quantity("1", "speed dip", kind="dip")
    recovery_time: Value = quantity("s", "recovery")
    web_pull_least: Value = quantity("N", "least pull in a web")
    wall_pull_least: Value = quantity("N", "least pull in a wall")
    slack_time: Value = quantity("1", "share of the time with a slack rod", kind="percent")
    fold_largest: Value = quantity("rad", "largest angle between two rods")
    shaft_share: Value = quantity("1", "shaft over motor torque", kind="percent")
    shaking_force: Value = quantity("N", "shaking force")
    shaking_moment: Value = quantity("N.m", "shaking moment")
    torque_reserve: Value = quantity("1", "reserve of torque", kind="percent")
    stall_time: Value = quantity("s", "crank stands after")
    thermal_trip_time: Value = quantity("s", "thermal relay trips after")
    coupling_trip_time: Value = quantity("s", "safety coupling trips after")
    energy_after_trip: Value = quantity("J", "energy after the trip")
    energy_behind: Value = quantity("J", "energy behind it")
    standstill_time: Value = quantity("s", "machine stands after")


@declaration
class StartUp:
    """What the start from rest asks, up to the begin of the steady turns; pulls as in `Answers`."""

    crank_torque_peak: Value = quantity("N.m", "crank torque, peak")
    motor_torque_peak: Value = quantity("N.m", "motor torque, peak")
    current_peak: Value = quantity("A", "motor current, peak")
    rocker_torque_peak: Value = quantity("N.m", "rocker torque, peak")
    web_pull_least: Value = quantity("N", "least pull in a web")
    wall_pull_least: Value = quantity("N", "least pull in a wall")
    slack_time: Value = quantity("1", "share of the time with a slack rod", kind="percent")
    fold_largest: Value = quantity("rad", "largest angle between two rods")


@declaration
class Limits:
    """Where the model ends."""

    slack_speed: Value = quantity("rad/s", "crank speed at which a web first goes slack with this feed")
    slack_speed_empty: Value = quantity("rad/s", "crank speed at which a web first goes slack, empty")
    chain_resonance: Value = quantity(
        "rad/s", "crank speed at the lowest natural frequency of an organ as a chain"
    )
    rocker_extreme_right: Value = quantity("rad", "right extreme of the rocker")
    rocker_extreme_left: Value = quantity("rad", "left extreme of the rocker")
    margin: Value = quantity("1", "least |sin| of the transmission angles over the turn")


def entries(declared: Any) -> dict[str, Any]:
    """The declared values of an instance as ``{name: {"value": .., "unit": ..}}``; what is not finite is null."""
    layout = Layout(type(declared))
    return {
        v.name: entry(value, v.unit, v.kind)
        for v, value in zip(layout.variables, layout.values(declared), strict=True)
    }


_PATIENCE = 20.0
"""Turns, at the speed that is asked, that a study runs on until the motor has settled and made its turns."""
_CLOSED = 0.01
"""Gap between the ends of the steady turns up to which they count as closed."""

_DECADE = math.sqrt(10.0)
"""From and to this part of the stop's stiffness its peaks are given: over a decade."""

_FLAT = 1.05
"""Largest over least of these peaks up to which the stop is said to matter little."""


@declaration
class BlockPeaks:
    """Peaks with the rocker blocked over a decade of stiffness about that of `overload.block_stiffness`, the damping
    with its root, as it is in a swing with the same damping ratio."""

    stiffness_low: Value = quantity("N.m/rad", "stiffness of the stop, from")
    stiffness_high: Value = quantity("N.m/rad", "stiffness of the stop, to")
    crank_torque_low: Value = quantity("N.m", "crank torque, peak, from")
    crank_torque_high: Value = quantity("N.m", "crank torque, peak, to")
    motor_torque_low: Value = quantity("N.m", "motor torque, peak, from")
    motor_torque_high: Value = quantity("N.m", "motor torque, peak, to")
    rocker_torque_low: Value = quantity("N.m", "rocker torque, peak, from")
    rocker_torque_high: Value = quantity("N.m", "rocker torque, peak, to")


Report = Callable[[str, float, float], None]
"""Called with what is running, the time done and the time to do [s]."""


@dataclass
class Study:
    """What a study found. `runs` holds a Dataset per co-simulation, `failure` why it stopped early, if it did."""

    config: Config
    drive: Drive
    tuning: Tuning | None = None
    sizing: SizingResult | None = None
    monte_carlo: MonteCarloResult | None = None
    loops: dict[str, Loop] = field(default_factory=dict)
    """the linearised speed loop of a controlled motor, by which inertia"""
    ripple_without: float | None = None
    """fluctuation of the speed in steady running without the feed-forward that the study has"""
    cycles: Any = None
    factors: dict[SideName, OverloadFactors] = field(default_factory=dict)
    """of the organ of that side alone"""
    sides: Sides | None = None
    limits: Limits | None = None
    runs: dict[str, xr.Dataset] = field(default_factory=dict)
    setting: protection.Setting | None = None
    """the safety coupling that a sized drive should have, where none is given: one that is given cuts off the peaks
    which would set it"""
    start_torque: float | None = None
    """peak on the coupling in a start direct on line, at the crank [N m]: judged apart"""
    steady_from: float | None = None
    """when running became steady [s], where that was later than `config.settled`"""
    event: dict[str, float] = field(default_factory=dict)
    answers: dict[str, Answers] = field(default_factory=dict)
    start: StartUp | None = None
    """what the start-up asks, once the machine ran steadily"""
    pins: dict[str, dict[str, dict[str, float]]] = field(default_factory=dict)
    """By run and pin: peak, RMS and equivalent (ISO 281) load."""
    certificate: dict[str, dict[str, float]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    """What the numbers rest on."""
    warnings: list[str] = field(default_factory=list)
    """What is wrong, or not as was asked; of several runs at once."""
    verdict: Verdict | None = None
    """whether the model of the organs holds, once there are runs"""
    made: dict[str, str] = field(default_factory=dict)
    torsion: Torsion | None = None
    shaft: dict[str, ShaftAnswers] = field(default_factory=dict)
    """what each run asks of the driveline, where there is one"""
    cycles_of: dict[str, Cycles] = field(default_factory=dict)
    """rainflow cycles of the torque in shaft 2 by run"""
    block_peaks: BlockPeaks | None = None
    """what the assumed stiffness of the stop makes of the peaks, where the rocker was blocked"""
    chain: ChainResult | None = None
    """the organs as chains at constant speed, where the study has them"""
    coasting: Path | None = None
    """the FMU of the machine behind an open coupling, where one tripped"""
    failure: RunError | None = None

    @property
    def settled(self) -> float:
        """Time from which running counts as steady [s]."""
        return self.config.settled if self.steady_from is None else self.steady_from

    @property
    def insufficient(self) -> bool:
        """Whether sizing found no motor that fits, so that all is run with the nearest."""
        return self.sizing is not None and self.sizing.chosen is None

    @property
    def advised(self) -> bool:
        """Whether sizing found a motor, for which a relay and a coupling can be advised."""
        return self.sizing is not None and not self.insufficient

    @property
    def start_apart(self) -> bool:
        """Whether the start is judged apart: switched on to the line, a motor gives more for a moment than it ever
        does in running, and a coupling has to be held shut."""
        return self.config.sizing is not None and self.config.start == "direct"

    @property
    def steady(self) -> xr.Dataset:
        """The steady turns that are evaluated, both ends included; where the crank does not make them, all that was
        run since it should be steady."""
        run = self.runs["start_up"].sel(time=slice(self.settled, None))
        return _turns(self.drive, run, self.config.run.turns)

    @property
    def warm(self) -> float:
        """Temperature at which the winding comes to rest in steady running [K]; see `sizing.BURNT`."""
        return min(BURNT, self.answers[STEADY].winding_temperature)

    @property
    def motor(self) -> Any:
        """Parameters of the motor."""
        return self.drive.parameters


def run_study(
    config: Config,
    folder: Path,
    report: Report | None = None,
    *,
    check: bool = False,
    backend: Backend | None = None,
) -> Study:
    """Run the study; FMUs are written to ``folder/fmu``, by `backend` (see `chainunit.fmu.backends`).

    With `check`, every run is also compared with the monolithic solution.
    A run that fails ends the study early: what was computed is in it, and `failure` says why.
    """
    report = report or (lambda what, done, todo: None)
    choice = choose(config, folder / "fmu", report, backend)
    study = Study(config, choice.drive, choice.tuning, choice.sizing)
    if study.drive.motor is DcMotor:
        study.loops = _loops(study)
    _statics(study)
    if study.drive.line is not None:
        study.torsion = _torsion(study)
    files, study.made = study.drive.export(folder / "fmu", backend)
    try:
        _simulate(study, files, folder, report, check, backend)
    except RunError as error:
        if error.partial is not None:
            study.runs["unfinished"] = error.partial
        study.failure = error
    except KeyboardInterrupt:
        # between two runs, or in one that is not a co-simulation
        study.failure = InterruptedRunError("interrupted")
    if study.advised and config.coupling is None and "steady" in study.answers:
        study.setting = _setting(study)
    if study.drive.chain is not None and not isinstance(study.failure, InterruptedRunError):
        _chains(study, files["machine"], report)
    _note(study)
    return study


def _chains(study: Study, file: Path, report: Report) -> None:
    """Chains at constant speed; left out where an FMU in Python would take hours for their many turns."""
    if "native" not in study.made["machine"]:
        study.notes.append(
            "chains at constant speed and the sweep are left out: they need native code, that is a C compiler."
        )
        return
    try:
        study.chain, ended = study_chain(study.config, study.drive, file, report)
    except RunError as error:
        ended = error
    except KeyboardInterrupt:
        ended = InterruptedRunError("interrupted")
    study.failure = study.failure or ended


def _loops(study: Study) -> dict[str, Loop]:
    """The speed loop with the mean, the least and the largest inertia of the turn."""
    config, motor = study.config, study.motor
    J = cycle(study.drive.machine, config.run.crank_speed, config.feed.left, config.feed.right).outputs.J
    sizes = {"mean inertia": np.mean(J), "least inertia": np.min(J), "largest inertia": np.max(J)}
    return {name: loop(motor, study.drive.rotor_inertia + float(size)) for name, size in sizes.items()}


def _torsion(study: Study) -> Torsion:
    """The line's natural frequencies.

    Raises
    ------
    InputError
        where the communication step is too long for them.
    """
    config, run = study.config, study.config.run
    J = cycle(study.drive.machine, run.crank_speed, config.feed.left, config.feed.right).outputs.J
    found = torsion(study.drive, J)
    if run.step > found.step_longest:
        raise InputError(
            f"run.step = {run.step:g} s: the driveline swings at {found.k_largest:.4g} rad/s; must be <= "
            f"{found.step_longest:.3g} s"
        )
    return found


def _statics(study: Study) -> None:
    """What needs no co-simulation: the cycle at constant speed, overload factors, limits of the model."""
    config = study.config
    machine, feed, w = study.drive.machine, config.feed, config.run.crank_speed
    study.cycles = {
        "both sides": cycle(machine, w, feed.left, feed.right),
        "right side empty": cycle(machine, w, feed.left, EMPTY),
        "left side empty": cycle(machine, w, EMPTY, feed.right),
        "all feed on the left": cycle(machine, w, *all_on_one("left", feed.left, feed.right)),
        "all feed on the right": cycle(machine, w, *all_on_one("right", feed.left, feed.right)),
    }
    study.factors = {side: overload_factors(machine, w, feed.left, feed.right, side) for side in SIDES}
    study.sides = sides_over_speed(machine, feed.left, feed.right)
    (right, _), (left, _) = machine.rocker_extremes()
    modes = machine.chain_modes(feed.left, feed.right)
    study.limits = Limits(
        slack_speed=machine.slack_speed(feed.left, feed.right),
        slack_speed_empty=machine.slack_speed(),
        chain_resonance=math.inf if modes is None else float(modes.frequency[0]),
        rocker_extreme_right=right,
        rocker_extreme_left=left,
        margin=float(np.min(study.cycles["both sides"].outputs.margin)),
    )


def scenario_signals(config: Config, drive: Drive, name: str, at: float) -> dict[str, Any]:
    """Loads over time in the overload `name` of `SCENARIOS` that begins at time `at` [s]; what blocks the rocker
    comes with its own angle, see `_block`."""
    normal, o = drive.loads(config.feed), config.overload
    signals: dict[str, Any] = dict(normal)
    scenario = OVERLOADS[name]
    side = f"machine.{scenario.side}"
    if scenario.kind in ("jam", "lumps"):
        force = normal[f"{side}.processing_force"]
        pulse = 2.0 * o.jam_rise + o.jam_duration + o.lump_pause
        changes: list[tuple[float, float, float]] = []
        for k in range(int(o.lumps) if scenario.kind == "lumps" else 1):
            begin = at + k * pulse
            changes += [
                (begin, o.jam_rise, force + o.jam_force),
                (begin + o.jam_rise + o.jam_duration, o.jam_rise, force),
            ]
        signals[f"{side}.processing_force"] = Profile(force, tuple(changes))
    elif scenario.kind == "dip":
        edge = 1e-3
        signals["motor.voltage"] = Profile(
            1.0, ((at, edge, 1.0 - o.dip_depth), (at + o.dip_duration, edge, 1.0))
        )
    elif scenario.kind in ("empties", "feed", "start"):
        other = f"machine.{'right' if scenario.side == 'left' else 'left'}"
        for load in ("material_mass", "processing_force"):
            here, there = normal[f"{side}.{load}"], normal[f"{other}.{load}"]
            if scenario.kind == "start":
                signals |= {f"{side}.{load}": here + there, f"{other}.{load}": 0.0}
                continue
            signals[f"{other}.{load}"] = Profile(there, ((at, o.shift, 0.0),))
            if scenario.kind == "feed":
                signals[f"{side}.{load}"] = Profile(here, ((at, o.shift, here + there),))
    return signals


def follow_time(config: Config, name: str) -> float:
    """Time that is followed after the event [s]: the turns asked for, and all lumps."""
    turn, o = 2.0 * math.pi / config.run.crank_speed, config.overload
    # a little more than asked, so that a dip in speed does not cost a whole turn
    follow = (o.turns + 0.1) * turn
    if OVERLOADS[name].kind == "lumps":
        follow = max(follow, o.lumps * (2.0 * o.jam_rise + o.jam_duration + o.lump_pause))
    return follow


def _block(config: Config, psi: float) -> dict[str, float]:
    """The stop that holds the rocker where it stands."""
    o = config.overload
    values = {"stiffness": o.block_stiffness, "damping": o.block_damping, "psi": psi}
    return {f"machine.stop.{name}": value for name, value in values.items()}


def _simulate(
    study: Study,
    files: Mapping[str, Path],
    folder: Path,
    report: Report,
    check: bool,
    backend: Backend | None,
) -> None:
    config, drive = study.config, study.drive
    run = config.run
    turn = 2.0 * math.pi / run.crank_speed
    settled = study.settled
    stop = settled + (run.turns + 0.1) * turn
    starts = [name for name in config.events if OVERLOADS[name].kind == "start"]
    events = [name for name in config.events if name not in starts]
    if "dip" in events and "voltage" not in drive.motor.input_layout.names:
        events.remove("dip")
        study.notes.append("the voltage dip was left out: this motor's drive has no line voltage of its own.")
    total = stop + sum(turn + follow_time(config, name) for name in events)
    total += stop * len(starts)

    signals = {**drive.loads(config.feed), **drive.reference(run.crank_speed, run.ramp)}
    feed = {f"machine.{s}.material_mass": partial(_energy_per_kg, drive, s) for s in ("left", "right")}
    guards = _guards(study)
    with CoSimulation(drive.system(files), signals) as simulation:
        progress = partial(_progress, report, "start-up and steady running", 0.0, total)
        start_up, stop = _started(study, simulation, stop, progress, {} if study.start_apart else guards)
        _certify(study, "start_up", start_up, feed)
        if simulation.time < stop - 0.5 * run.step:
            raise RunError(
                f"the safety coupling opens in the start-up, at t = {simulation.time:.3g} s; coupling.trip_torque "
                "must be above what starting takes"
            )
        steady = study.steady
        study.answers["steady"] = _answers(study, steady, None, steady)
        study.pins["steady"] = _pins(study, steady)
        study.start = _start(study, start_up.sel(time=slice(None, steady["time"].values[0])))
        if study.start_apart:
            study.start_torque = _on_coupling(drive, start_up.sel(time=slice(None, study.settled)))
        asked = _on_coupling(drive, steady)
        if config.coupling and asked > config.coupling.trip_torque:
            raise RunError(
                f"the safety coupling opens in steady running, which puts {asked:.4g} N m on it; "
                "coupling.trip_torque must be above that"
            )
        start = simulation.save()
        angle = float(drive.crank_motion(start_up)[0][-1])
        lead = _lead(config, angle, study.answers["steady"].speed_mean)
        event = start + lead
        done = start
        for name in events:
            simulation.restore()
            simulation.signals = {
                **scenario_signals(config, drive, name, event),
                **drive.reference(run.crank_speed),
            }
            follow = follow_time(config, name)
            progress = partial(_progress, report, SCENARIOS[name], done - start, total)
            transient = _event(config, simulation, name, event, event + follow, progress, guards)
            done += lead + follow
            _close(study, name, transient, event, event + follow, feed, simulation, folder, backend)
        if "blocked" in study.answers:
            report("the rocker is blocked, over a decade of stiffness", done - start, total)
            study.block_peaks = _block_peaks(study, simulation, event)
    if check:
        report("monolithic reference of the start-up", total, total)
        states = _compare(study, "start_up", signals)
        for name in events:
            report(f"monolithic reference: {SCENARIOS[name]}", total, total)
            given = {**scenario_signals(config, drive, name, event), **drive.reference(run.crank_speed)}
            _compare(study, name, given, states)
    if drive.feed_forward:
        plain = replace(drive, feed_forward=False)
        without = {**plain.loads(config.feed), **plain.reference(run.crank_speed, run.ramp)}
        with CoSimulation(plain.system(files), without) as simulation:
            again = simulation.run(stop, run.step).sel(time=slice(settled, None))
        again = _turns(drive, again, run.turns)
        study.ripple_without = _answers(study, again, None, again).speed_ripple
    for k, name in enumerate(starts):
        loaded = {
            **scenario_signals(config, drive, name, 0.0),
            **drive.reference(run.crank_speed, run.ramp),
        }
        with CoSimulation(drive.system(files), loaded) as simulation:
            before = total - (len(starts) - k) * stop
            progress = partial(_progress, report, SCENARIOS[name], before, total)
            transient = simulation.run(stop, run.step, progress, guards={} if study.start_apart else guards)
            _close(study, name, transient, 0.0, stop, feed, simulation, folder, backend)
        if check:
            report(f"monolithic reference: {SCENARIOS[name]}", total, total)
            _compare(study, name, loaded)
    if drive.line is not None:
        report("the same with a rigid shaft", total, total)
        try:
            rigid = _rigid(study, files, stop)
        except RunError as error:
            # what it has is the rigid drive's, not this one's
            error.partial = None
            raise
        _shaft(study, rigid)
    if config.monte_carlo.runs:
        study.monte_carlo = run_monte_carlo(Task(config, drive, files, stop), folder, report)


def _started(
    study: Study,
    simulation: CoSimulation,
    stop: float,
    progress: Callable[[float], None],
    guards: Mapping[str, float],
) -> tuple[xr.Dataset, float]:
    """The start-up and steady running to the time `stop`, or to a later one where a crank that turns too slowly needs
    it for the turns that are evaluated, or the motor to settle; with that time. Sets `study.steady_from`."""
    run, drive = study.config.run, study.drive
    turn = 2.0 * math.pi / run.crank_speed
    study.steady_from = study.config.settled
    longest = stop + _PATIENCE * turn
    found = simulation.run(stop, run.step, progress, guards=guards)
    while stop - 0.5 * run.step <= simulation.time < longest:
        since = found.sel(time=slice(study.steady_from, None))
        turns = drive.whole_turns(since, run.turns)
        if turns is not None and drive.turns(turns) > run.turns - 0.5:
            if study.config.chain is not None or _gap(drive, turns) <= _CLOSED:
                break
            # as if one turn more had been waited for
            study.steady_from = float(_turns(drive, since, 1)["time"][-1])
            since = found.sel(time=slice(study.steady_from, None))
        # at the speed that is asked at most; what is still missing then is seen in the next round
        missing = run.turns + 0.1 - drive.turns(since)
        stop = min(longest, stop + max(missing * turn, run.step))
        found = _joined([found, simulation.run(stop, run.step, progress, guards=guards)])
    return found, stop


def _rigid(study: Study, files: Mapping[str, Path], stop: float) -> dict[str, xr.Dataset]:
    """Every run again without the line's elasticity and unevenness, at the same times and with the same coupling."""
    config, drive, guards = study.config, study.drive.rigid(), _guards(study)
    step, reference = config.run.step, drive.reference(config.run.crank_speed, config.run.ramp)
    system = drive.system({name: file for name, file in files.items() if name != "driveline"})
    runs = {}
    with CoSimulation(system, {**drive.loads(config.feed), **reference}) as simulation:
        runs["start_up"] = simulation.run(stop, step)
        simulation.save()
        for name, event in study.event.items():
            if OVERLOADS[name].kind != "start":
                simulation.restore()
                simulation.signals = {
                    **scenario_signals(config, drive, name, event),
                    **drive.reference(config.run.crank_speed),
                }
                runs[name] = _event(
                    config, simulation, name, event, event + follow_time(config, name), guards=guards
                )
    for name in (name for name in study.event if OVERLOADS[name].kind == "start"):
        loaded = scenario_signals(config, drive, name, 0.0)
        with CoSimulation(system, {**loaded, **reference}) as simulation:
            runs[name] = simulation.run(stop, step, guards={} if study.start_apart else guards)
    return runs


def _shaft(study: Study, rigid: Mapping[str, xr.Dataset]) -> None:
    """What each run asks of the line."""
    assert study.config.driveline is not None
    per_turn = None
    for name, run in [("steady", "start_up"), *((name, name) for name in study.event)]:
        study.runs[run] = with_rigid(study.drive, study.runs[run], rigid[run])
        since = slice(study.settled if name == "steady" else study.event[name], None)
        elastic = study.steady if name == "steady" else study.runs[run].sel(time=since)
        study.shaft[name], study.cycles_of[name], damage = shaft_answers(
            study.drive, elastic, rigid[run].sel(time=since), study.config.driveline.exponent, per_turn
        )
        per_turn = damage if per_turn is None else per_turn


def _on_coupling(drive: Drive, run: xr.Dataset) -> float:
    """Peak torque on a coupling on the motor shaft in a run, at the crank [N m]."""
    return float(np.max(np.abs(run["motor.tau"].values))) * drive.ratio


def _peaks(study: Study) -> dict[str, float]:
    """Peak on the coupling in each overload, at the crank [N m]; a start direct on line is judged apart."""
    return {
        name: _on_coupling(study.drive, study.runs[name].sel(time=slice(event, None)))
        for name, event in study.event.items()
        if name in study.runs and not (study.start_apart and OVERLOADS[name].kind == "start")
    }


def _setting(study: Study) -> protection.Setting:
    """The safety coupling that the sized drive should have, tried in the overloads of the study."""
    assert study.sizing is not None
    best, drive = study.sizing.best, study.drive
    peaks = _peaks(study)
    lasting = [peak for name, peak in peaks.items() if OVERLOADS[name].kind in _EMPTYING]
    normal = [_on_coupling(drive, study.steady), best.duty_torque, *lasting]
    if not study.start_apart:
        normal.append(_on_coupling(drive, study.runs["start_up"]))
    return protection.Setting(
        normal=max(normal),
        motor=drive.pull_out(study.steady, study.warm),
        gear=study.config.gear.torque_limit,
        overloads={name: peak for name, peak in peaks.items() if OVERLOADS[name].kind in _SHOCKS},
        disturbances={name: peak for name, peak in peaks.items() if OVERLOADS[name].kind == "dip"},
    )


def _guards(study: Study) -> dict[str, float]:
    coupling = study.config.coupling
    return {"motor.tau": coupling.trip_torque / study.drive.ratio} if coupling else {}


def _block_peaks(study: Study, simulation: CoSimulation, event: float) -> BlockPeaks:
    """The peaks with the rocker blocked by softer and stiffer stops and by the one that is given, from the steady
    state that was saved; all without a safety coupling, which would cut them off."""
    config, drive = study.config, study.drive
    o, answers = config.overload, study.answers["blocked"]
    peaks: dict[str, list[float]] = {"crank_torque": [], "motor_torque": [], "rocker_torque": []}
    factors = [1.0 / _DECADE, _DECADE]
    if config.coupling is None:
        for name, sizes in peaks.items():
            sizes.append(getattr(answers, f"{name}_peak"))
    else:
        factors.append(1.0)
    for factor in factors:
        stop = replace(
            o, block_stiffness=factor * o.block_stiffness, block_damping=math.sqrt(factor) * o.block_damping
        )
        other = replace(config, overload=stop)
        simulation.restore()
        simulation.signals = {
            **scenario_signals(other, drive, "blocked", event),
            **drive.reference(config.run.crank_speed),
        }
        until = event + follow_time(other, "blocked")
        run = _event(other, simulation, "blocked", event, until)
        run = run.sel(time=slice(event, None))
        for name, torque in (
            ("crank_torque", drive.crank_torque(run)),
            ("motor_torque", run["motor.air_gap_tau"].values),
            ("rocker_torque", run["machine.rocker.tau"].values),
        ):
            peaks[name].append(float(np.max(np.abs(torque))))
    ends = {
        f"{name}_{end}": of(sizes)
        for name, sizes in peaks.items()
        for end, of in (("low", min), ("high", max))
    }
    return BlockPeaks(
        stiffness_low=o.block_stiffness / _DECADE, stiffness_high=o.block_stiffness * _DECADE, **ends
    )


def _event(
    config: Config,
    simulation: CoSimulation,
    name: str,
    event: float,
    stop: float,
    progress: Any = None,
    guards: Mapping[str, float] | None = None,
) -> xr.Dataset:
    """Run a transient to the time `stop`, or until a guard ends it."""
    step = config.run.step
    pieces = []
    if OVERLOADS[name].kind == "blocked":
        simulation.signals |= dict.fromkeys(_block(config, 0.0), 0.0)
        pieces.append(simulation.run(event, step, progress))
        simulation.signals |= _block(config, float(pieces[0]["machine.rocker.psi"][-1]))
    pieces.append(simulation.run(stop, step, progress, guards=guards))
    return _joined(pieces)


def _joined(pieces: list[xr.Dataset]) -> xr.Dataset:
    """One run from pieces that follow each other; of the instant that two share the later holds."""
    kept = [piece.isel(time=slice(None, -1)) for piece in pieces[:-1]]
    return xr.concat([*kept, pieces[-1]], "time", data_vars="all") if kept else pieces[-1]


def _close(
    study: Study,
    name: str,
    run: xr.Dataset,
    event: float,
    stop: float,
    feed: Feed,
    simulation: CoSimulation,
    folder: Path,
    backend: Backend | None,
) -> None:
    """What a transient answers; where the coupling tripped, also what passes it after and how the machine behind it
    comes to rest."""
    step, coupling = study.config.run.step, study.config.coupling
    study.event[name] = event
    tripped = {}
    if coupling and simulation.time < stop - 0.5 * step:
        trip = simulation.time
        if coupling.release_time > 0.0:
            release = simulation.run(trip + coupling.release_time, min(step, coupling.release_time))
            run = _joined([run, release])
            passed = float(np.trapezoid(release["motor.tau"] * release["motor.w"], release["time"]))
        else:
            passed = 0.0
        coasting = _coast(study, name, run, stop, folder, backend)
        study.runs[f"{name}_coasting"] = coasting
        speed = np.abs(study.drive.crank_motion(coasting)[1])
        still = np.flatnonzero(speed < 0.01 * study.config.run.crank_speed)
        tripped = {
            "coupling_trip_time": trip - event,
            # behind an open coupling no load is left that could trip it
            "thermal_trip_time": None,
            "energy_after_trip": passed,
            "energy_behind": float(coasting["machine.kinetic_energy"][0]),
            "standstill_time": float(coasting["time"][still[0]]) - event if still.size else None,
        }
    _certify(study, name, run, feed)
    after = run.sel(time=slice(event, None))
    answers = _answers(study, after, event, study.steady)
    study.answers[name] = replace(answers, **tripped)
    study.pins[name] = _pins(study, after)


def _coast(
    study: Study, name: str, run: xr.Dataset, stop: float, folder: Path, backend: Backend | None
) -> xr.Dataset:
    """The machine behind the open coupling, with the loads that it had, for as long as the motor would have been
    followed and a second more."""
    from_ = float(run["time"][-1])
    start = {f"{x}_start": float(run[f"machine.{x}0"][-1]) for x in ("phi", "w")}
    loads = {
        full: given
        for full, given in scenario_signals(study.config, study.drive, name, study.event[name]).items()
        if full.startswith("machine.")
    }
    loads |= {full: float(run[full][-1]) for full in _block(study.config, 0.0) if full in run}
    if study.coasting is None:
        study.coasting = study.drive.coasting(folder / "fmu", backend)
    p = DirectChainUnit.parameter_layout.from_names(study.drive.coasting_parameters() | start)
    alone = System({"machine": ModelComponent(DirectChainUnit, p, study.coasting)})
    with CoSimulation(alone, {**loads, "machine.tau": 0.0}, from_) as simulation:
        return simulation.run(max(stop, from_) + 1.0, study.config.run.step)


def _lead(config: Config, angle: float, speed: float) -> float:
    """Time of steady running at `speed` until the crank next stands at the event's angle, at least an eighth of a
    turn [s]; a crank that hardly turns is not waited for."""
    ahead = (config.overload.crank_angle - angle) % (2.0 * math.pi)
    if ahead < 0.25 * math.pi:
        ahead += 2.0 * math.pi
    return ahead / max(speed, 0.5 * config.run.crank_speed)


def _energy_per_kg(drive: Drive, side: str, run: xr.Dataset) -> Any:
    if drive.chain is not None:
        return run[f"machine.{side}.energy_per_kg"].values
    return drive.driven.energy_per_kg(side, run["machine.phi0"].values, run["machine.w0"].values)


def _progress(report: Report, what: str, before: float, todo: float, time: float) -> None:
    report(what, before + time, todo)


def _certify(study: Study, name: str, run: xr.Dataset, feed: Feed) -> None:
    """The energy residual of each bond, named after what it drives, where that is not the machine."""
    shares = study.certificate[name] = {}
    for driven, (residual, share) in certify(run, study.drive.graph, feed).items():
        prefix = "" if driven == "machine" else f"{driven}_"
        run[f"{prefix}residual"] = residual
        shares[f"{prefix}energy_residual_share"] = share
    study.runs[name] = run


def _compare(
    study: Study, name: str, signals: Mapping[str, Any], start: Mapping[str, float] | None = None
) -> dict[str, float]:
    """Compare the run `name` with the monolithic solution of the same `signals`, from the states `start` on; returns
    the states at its end."""
    run, drive = study.runs[name], study.drive
    rows = np.unique(np.append(np.arange(0, run.sizes["time"], 10), run.sizes["time"] - 1))
    if name in OVERLOADS and OVERLOADS[name].kind == "blocked":
        # what blocks the rocker is there from one instant on
        event, block = study.event[name], _block(study.config, 0.0)
        signals = {**signals, **{full: Jump(event, 0.0, float(run[full][-1])) for full in block}}
    reference = monolithic(drive.graph, signals, run["time"].values[rows], start=start)
    for of in ("machine.tau", "motor.w"):
        difference = np.abs(run[of].values[rows] - reference[of].values)
        study.certificate[name][of + DIFFERENCE] = float(
            np.max(difference) / np.max(np.abs(reference[of].values))
        )
    return {full: float(reference[full][-1]) for full in map(str, reference.data_vars)}


def _turns(drive: Drive, run: xr.Dataset, most: float = math.inf) -> xr.Dataset:
    """Whole turns of a run, see `Drive.whole_turns`; all of it where the crank does not make one."""
    turns = drive.whole_turns(run, most)
    return run if turns is None else turns


def _gap(drive: Drive, turns: xr.Dataset) -> float:
    """Difference between the ends of `turns`, of crank speed or torque, over the largest value."""
    _, speed = drive.crank_motion(turns)
    sizes = ((x[-1] - x[0]) / max(np.max(np.abs(x)), 1e-9) for x in (speed, drive.crank_torque(turns)))
    return max(abs(float(size)) for size in sizes)


def _mean(run: xr.Dataset, x: Any) -> float:
    """Mean over the time of a run, by the trapezoidal rule."""
    time = run["time"].values
    return float(np.trapezoid(x, time) / (time[-1] - time[0]))


def _answers(study: Study, run: xr.Dataset, event: float | None, steady: xr.Dataset) -> Answers:
    """The numbers of one run."""
    config, drive = study.config, study.drive
    w_ref = config.run.crank_speed
    turns = _turns(drive, run)

    def value(name: str) -> Any:
        return run[name].values

    def peak(x: Any) -> float:
        return float(np.max(np.abs(x)))

    def mean(read: Callable[[xr.Dataset], Any]) -> float:
        return _mean(turns, read(turns))

    def rms(read: Callable[[xr.Dataset], Any]) -> float:
        return math.sqrt(mean(lambda r: read(r) ** 2))

    def swing(*names: str) -> float:
        parts = [(value(full), mean(_series(full))) for full in (f"machine.frame.{name}" for name in names)]
        return float(np.max(np.sqrt(sum((x - middle) ** 2 for x, middle in parts))))

    sides = drive.machine.loaded_sides(config.feed.left, config.feed.right)

    def least(rod: str) -> float:
        return min((float(np.min(value(f"machine.{side}.{rod}_pull"))) for side in sides), default=math.inf)

    crank_torque, motor_torque = drive.crank_torque(run), value("motor.air_gap_tau")
    _, speed = drive.crank_motion(run)
    power, current = f"{drive.loading}.power", f"motor.{drive.motor.current}"
    speed_mean = mean(lambda r: drive.crank_motion(r)[1])
    asked = w_ref if drive.follows or event is None else study.answers["steady"].speed_mean
    since = value("time") - (event or 0.0)
    recovery = None
    if event is not None and (not drive.follows or reached(study.answers["steady"], w_ref)):
        recovery = _recovery(since, speed, drive.crank_motion(steady)[1], asked)
    settled, reserve = math.nan, None
    if event is None:
        settled = drive.motor.settled_temperature(
            drive.parameters,
            mean(_series("motor.heat")),
            mean(_series(f"motor.{drive.motor.temperature}")),
            mean(_series("motor.w")),
        )
    if event != 0.0:
        warm = min(BURNT, settled) if event is None else study.warm
        # the field that is left in a dip brakes for a moment, which is no lack of torque
        driving = np.maximum(motor_torque * np.sign(value("motor.w")), 0.0)
        reserve = torque_reserve(drive.largest_torque(run, warm), driving)
        kept = speed_mean if event is None else study.answers[STEADY].speed_mean
        if drive.follows and kept < 0.99 * w_ref:
            # a controlled motor that falls behind gives all that it can
            reserve = 0.0
    return Answers(
        crank_torque_peak=peak(crank_torque),
        crank_torque_rms=rms(drive.crank_torque),
        crank_torque_mean=mean(drive.crank_torque),
        motor_torque_peak=peak(motor_torque),
        motor_torque_rms=rms(_series("motor.air_gap_tau")),
        power_peak=max(0.0, float(np.max(value(power)))),
        power_mean=mean(_series(power)),
        supply_power_mean=mean(_series("motor.supply_power")),
        current_peak=peak(value(current)),
        current_rms=rms(_series(current)),
        winding_temperature=settled if event is None else None,
        rocker_torque_peak=peak(value("machine.rocker.tau")),
        speed_mean=speed_mean,
        speed_least=float(np.min(speed)),
        speed_ripple=float(np.ptp(speed)) / max(abs(speed_mean), 1e-9) if event is None else None,
        cycle_gap=_gap(drive, turns) if event is None else None,
        # a start begins at rest
        speed_dip=float((asked - np.min(speed)) / asked) if event != 0.0 else None,
        recovery_time=recovery,
        web_pull_least=least("web"),
        wall_pull_least=least("wall"),
        slack_time=mean(lambda r: _any_slack(r, sides)) if drive.chain is not None else None,
        fold_largest=max(
            (float(np.max(value(f"machine.{side}.fold_largest"))) for side in sides), default=0.0
        )
        if drive.chain is not None
        else None,
        shaft_share=peak(value("motor.tau")) / peak(motor_torque),
        shaking_force=swing("fx", "fy"),
        shaking_moment=swing("moment"),
        torque_reserve=reserve,
        stall_time=None if event is None else protection.stall(since, speed, asked),
        thermal_trip_time=_relay(study, since, value(current)) if event is not None else None,
        coupling_trip_time=None,
        energy_after_trip=None,
        energy_behind=None,
        standstill_time=None,
    )


def _start(study: Study, run: xr.Dataset) -> StartUp:
    """The numbers of the start-up, and what the pins carry in it."""
    answers = _answers(study, run, None, study.steady)
    study.pins[verdict.START] = _pins(study, run)
    return StartUp(**{name: getattr(answers, name) for name in Layout(StartUp).names})


def _series(name: str) -> Callable[[xr.Dataset], Any]:
    """Reads a variable of a run, shape (time,)."""
    return lambda run: run[name].values


def torque_reserve(limit: Any, torque: Any) -> float:
    """Least part of the largest torque that a motor can give which is left over in a run: (limit - |torque|)/limit at
    the instant at which that is least; both of the motor [N m], shape (time,).

    0 where the motor gives all it can, less where a transient passes that, and -1 where one is twice as large or
    more, as where it can give none at all.
    """
    limit, torque = np.asarray(limit), np.abs(torque)
    free = limit - torque
    whole = np.maximum(np.maximum(limit, -free), 1e-12)
    return float(np.min(free / whole))


def _any_slack(run: xr.Dataset, sides: list[str]) -> Any:
    """Whether some rod is slack, shape (time,)."""
    shares = [run[f"machine.{side}.slack_share"].values for side in sides]
    return (np.max(shares, axis=0) > 0.0).astype(float) if shares else np.zeros(run.sizes["time"])


def _relay(study: Study, since: Any, current: Any) -> float | None:
    """When the thermal relay, set to the motor's rated current, trips after the event."""
    setting = study.drive.rated_current
    if setting is None:
        return None
    # what flows at the end is taken to flow on
    lasts = float(np.sqrt(np.mean(current[-max(1, len(current) // 5) :] ** 2)))
    return protection.relay_trip(since, current, setting, study.answers["steady"].current_rms, lasts)


def reached(steady: Answers, w_ref: float) -> bool:
    """Whether the machine runs at the speed that is asked of it, within 1 %."""
    return bool(abs(steady.speed_mean - w_ref) <= 0.01 * w_ref)


def _recovery(since: Any, speed: Any, steady: Any, w_ref: float) -> float | None:
    """Time after the event from which the speed stays in the band of steady running, widened by 0.5 %; None if
    it does not return in the time followed, or only at its very end."""
    widening = 0.005 * w_ref
    outside = (speed < np.min(steady) - widening) | (speed > np.max(steady) + widening)
    if not outside.any():
        return 0.0
    last = int(np.flatnonzero(outside)[-1])
    return float(since[last]) if last < len(since) - len(since) // 10 else None


def _pins(study: Study, run: xr.Dataset) -> dict[str, dict[str, float]]:
    """Peak, RMS and equivalent load (mean of ISO 281 over what the pin turns) of the reaction of every pin [N]."""
    table, turns = {}, _turns(study.drive, run)
    turned = study.drive.driven.pin_turns(turns["machine.phi0"].values)
    if study.drive.chain is not None:
        turned[4:] = _chain_turns(study.drive, turns)

    def size(name: str, of: xr.Dataset) -> Any:
        return np.hypot(of[f"machine.{name}.fx"].values, of[f"machine.{name}.fy"].values)

    for (title, name), angle in zip(PINS.items(), turned, strict=True):
        evaluated = size(name, turns)
        table[title] = {
            "peak": float(np.max(size(name, run))),
            "rms": math.sqrt(_mean(turns, evaluated**2)),
            "equivalent": protection.mean_load(evaluated, angle),
        }
    return table


def _chain_turns(drive: Drive, run: xr.Dataset) -> list[Any]:
    """Relative angle in A2, B and A1 of each side [rad], shape (time,), of chains."""
    walls, webs = drive.rods
    found = []
    for side in ("left", "right"):
        first, last, other, end = (
            run[f"machine.{side}.theta_{k}"].values for k in (1, walls, walls + 1, walls + webs)
        )
        found += [end - run["machine.rocker.psi"].values, other - last, first]
    return found


def _note(study: Study) -> None:
    """What the reader has to know beside the numbers."""
    config, limits, note = study.config, study.limits, study.notes.append
    assert limits is not None
    if config.source == "packaged example":
        note("Masses, pins, feed and drive are assumed; the papers print none.")
    else:
        note(
            "What the study file does not name is the packaged example's, whose masses and drive are assumed."
        )
    note(
        "Friction is smoothed: at rest nothing sticks, so that the torque to break away from a loaded "
        "stop is not in the start-up."
    )
    speed, warn = config.run.crank_speed, study.warnings.append
    if study.answers:
        study.verdict = model_verdict(study)
        study.warnings.extend(study.verdict.details(_CALLED))
    if config.chain is not None:
        _note_chain(study, config.chain)
    steady = study.answers.get("steady")
    if steady is not None and not reached(steady, speed):
        warn(
            f"steady running: the crank turns at {number(steady.speed_mean, 'rad/s')} in place of "
            f"{number(speed, 'rad/s', full=False)}; "
            + (
                "the motor's voltage or current is at its limit, or the run is too short to settle."
                if study.drive.follows
                else "a motor on the line takes the speed that gear ratio and slip give."
            )
            + " Overloads are those of this state."
        )
    if steady is not None and study.drive.whole_turns(study.steady) is None:
        warn(
            "steady running: the crank does not make a whole turn; means are over all that was run, and there is no "
            f"{LOAD_CYCLE}."
        )
    elif steady is not None and steady.cycle_gap > _CLOSED:
        repeats = "chains do not repeat a turn" if config.chain else "the machine has not settled"
        warn(
            "steady running: the turns do not close, their ends differ by "
            f"{number(steady.cycle_gap, '1', 'percent')} in speed or torque: {repeats}; raise run.settle_turns or "
            "run.turns."
        )
    if steady is not None and not math.isfinite(steady.winding_temperature):
        warn(
            "steady running: the winding has no thermal steady state, its loss grows faster than the cooling."
        )
    if study.sizing is not None:
        study.notes.extend(study.sizing.notes)
        if study.insufficient:
            warn(f"{study.sizing.answer}. All runs are with it.")
    if config.coupling is not None and steady is not None:
        _warn_of_coupling(study, config.coupling.trip_torque)
    _warn_of_runs(study)
    if study.ripple_without is not None and steady is not None:
        note(
            "Feed-forward of the machine's torque brings the ripple of the speed from "
            f"{number(study.ripple_without, '1', 'percent')} to {number(steady.speed_ripple, '1', 'percent')}."
        )
    random = study.monte_carlo
    if random is not None and random.remark:
        note(f"overloads at random: {random.remark}")
    if random is not None and random.left_out:
        note(
            f"overloads at random: {random.left_out} lines of {random.file.name} were no rows of this study and are "
            "left out; runs that they may have stood for were computed anew."
        )
    if study.block_peaks is not None:
        b, o = study.block_peaks, config.overload
        # what is assumed is not known to more
        low, high = (
            number(float(f"{getattr(b, f'stiffness_{end}'):.1g}"), "N.m/rad") for end in ("low", "high")
        )
        ends = (number(getattr(b, f"crank_torque_{end}"), "N.m") for end in ("low", "high"))
        flat = b.crank_torque_high < _FLAT * b.crank_torque_low
        peaks = "but hardly change the peak here, {} to {}" if flat else "and decide the peak, {} to {}"
        note(
            "the rocker is blocked: the stop's stiffness and damping are assumed "
            f"{peaks.format(*ends)} of crank torque for {low} to {high}, damping with the root of it. Take the "
            "stiffness of what is jammed (N/m) times the "
            "square of its distance from the pivot C (m): overload.block_stiffness, now "
            f"{number(o.block_stiffness, 'N.m/rad')}, and block_damping, now {number(o.block_damping, 'N.m.s/rad')}."
            + (
                " These peaks are without the safety coupling, which opens at "
                f"{_torque(config.coupling.trip_torque)}."
                if config.coupling
                else ""
            )
        )
    if study.torsion is not None:
        _note_shaft(study)
    study.notes[:] = map(_sentence, study.notes)
    study.warnings[:] = map(_sentence, study.warnings)


def _sentence(text: str) -> str:
    """The text with a capital at its begin."""
    return text[:1].upper() + text[1:]


DIFFERENCE = "_difference_to_monolithic"
"""Ends the name of a variable's largest difference to the monolithic solution, over its peak."""


def called(run: str) -> str:
    """What sentences call a run."""
    return _CALLED.get(run, run.replace("_", " "))


_CALLED = {
    STEADY: "steady running",
    verdict.START: "start-up",
    "constant": "chains at constant speed",
    **SCENARIOS,
}
"""Runs by name, as sentences call them."""
_EMPTYING = ("empties", "feed", "start")
"""Kinds of overloads in which a side carries no material; they last, or are a start: duty that a safety coupling
has to carry."""
_SHOCKS = ("jam", "lumps", "blocked")
"""Kinds of overloads that a safety coupling is for."""


def _warn_of_runs(study: Study) -> None:
    """What happened in the runs, a line for each kind of event with all runs in which it did."""
    happened: dict[str, list[str]] = {}
    peaks = _peaks(study)

    def tell(what: str, run: str, size: str = "") -> None:
        happened.setdefault(what, []).append(f"{_CALLED[run]}{f' ({size})' if size else ''}")

    for name, answers in study.answers.items():
        pushed = answers.web_pull_least < 0.0 or answers.wall_pull_least < 0.0
        if answers.slack_time == 0.0 and pushed:
            tell(
                "An end of a rod is pushed, though the rod is pulled in the mean; more rods are nearer to a chain",
                name,
            )
        if study.drive.motor is DcMotor and answers.current_peak > 0.999 * study.motor.limit.i:
            tell(
                f"The motor runs into its current limit of {number(study.motor.limit.i, 'A', full=False)}",
                name,
            )
        limit = study.config.gear.torque_limit
        if "torque_limit" in study.config.gear_given and name in peaks and peaks[name] > limit:
            tell(
                f"The torque passes the gear's permitted {number(limit, 'N.m', full=False)}",
                name,
                _torque(peaks[name]),
            )
        if answers.stall_time is not None:
            late = answers.stall_time > 10.0 * study.config.run.step
            after = f"after {number(answers.stall_time, 's')}{'' if late else ', as it hardly turned before'}"
            tell("The crank stands after the event", name, after)
        if answers.coupling_trip_time is not None:
            after = number(answers.coupling_trip_time, "s")
            energies = (number(x, "J") for x in (answers.energy_after_trip, answers.energy_behind))
            size = "after {}; {} pass it while it opens, {} stay behind it".format(after, *energies)
            tell("The safety coupling opens after the event", name, size)
        elif name in SCENARIOS and answers.recovery_time is None:
            tell("The speed does not return to its steady band within the time followed", name)
    study.warnings.extend(f"{what}: {'; '.join(runs)}." for what, runs in happened.items())


def model_verdict(study: Study) -> Verdict:
    """Whether the model of the organs holds, from the numbers of the runs."""
    config, limits, answers = study.config, study.limits, study.answers
    assert limits is not None
    steady = answers.get(STEADY)
    mean = steady.speed_mean if steady else config.run.crank_speed
    speed, residuals = max(config.run.crank_speed, mean), _residuals(study)
    runs: dict[str, StartUp | Answers] = {**answers}
    if study.start is not None:
        runs[verdict.START] = study.start
    if config.chain is None:
        emptied = {name for name in answers if name in OVERLOADS and OVERLOADS[name].kind in _EMPTYING}
        always = 0.0 in (config.feed.left.material_mass, config.feed.right.material_mass)
        return verdict.two_bars(
            speed,
            limits.chain_resonance,
            limits.slack_speed,
            {name: (a.web_pull_least, a.wall_pull_least) for name, a in runs.items()},
            residuals,
            empty={""} if always else emptied,
            reached=mean,
        )
    folds = {name: a.fold_largest for name, a in runs.items()}
    slack = {name: a.slack_time for name, a in runs.items()}
    needed, turns = runs_needed(HIGH), math.inf
    if study.chain is not None:
        own = study.chain.own
        folds["constant"], slack["constant"] = own.fold_largest, own.slack_time
        residuals["constant"], turns = own.energy_residual, own.independent_turns
    return verdict.chains(
        speed, residuals, folds, config.chain.fold_limit, slack, turns, needed, reached=mean
    )


def _residuals(study: Study) -> dict[str, float]:
    """By run, the largest energy residual over the energy moved; the start-up and steady running are one."""
    return {
        STEADY if name == verdict.START else name: max(
            x for kind, x in shares.items() if kind.endswith("energy_residual_share")
        )
        for name, shares in study.certificate.items()
    }


def motor_verdict(study: Study) -> dict[str, Any] | None:
    """Whether the motor reaches the speed ("false" where not), and its least reserve of torque with the run of it
    ("in part" where none is left or known, or sizing found it insufficient), ready for JSON; None without steady
    running. Runs whose energy balance is not kept say nothing of the motor: they are left out."""
    steady, asked = study.answers.get(STEADY), study.config.run.crank_speed
    if steady is None:
        return None
    residuals, reaches = _residuals(study), reached(steady, asked)
    # NaN, too, is no balance
    left_out = [name for name in study.answers if not residuals.get(name, 0.0) < RESIDUAL]
    reserves = {
        name: a.torque_reserve
        for name, a in study.answers.items()
        if name not in left_out and a.torque_reserve is not None
    }
    run = min(reserves, key=lambda name: float(reserves[name]), default=None)
    reserve = None if run is None else reserves[run]
    speed, wanted = number(steady.speed_mean, "rad/s"), number(asked, "rad/s", full=False)
    if reaches:
        text = f"The motor keeps the crank at {speed}"
    elif steady.speed_mean > asked:
        text = f"The motor does NOT keep the speed: the crank turns at {speed}, faster than the {wanted} asked for"
    else:
        text = f"The motor does NOT reach the speed: {speed} in place of {wanted}"
    if study.insufficient:
        text += f"{', but it' if reaches else '; it'} is insufficient by the limits of the sizing"
    if run is None:
        text += "; its reserve of torque is not known"
    elif reserve is not None and reserve >= 0.0:
        text += f"; least reserve of torque {number(reserve, '1', 'percent')} ({_CALLED[run]})"
    else:
        over = number(-reserves[run], "1", "percent") + (" or more" if reserves[run] <= -1.0 else "")
        text += f"; no reserve of torque: the torque passes the largest steady one by {over} ({_CALLED[run]})"
    if left_out:
        names = ", ".join(_CALLED[name] for name in left_out)
        text += f"; runs whose energy balance is not kept are left out ({names})"
    enough = reserve is not None and reserve > 0.0 and not study.insufficient
    holds: Holds = "false" if not reaches else "true" if enough else "in part"
    return {
        "holds": holds,
        "text": f"{text}.",
        "speed": entry(steady.speed_mean, "rad/s"),
        "asked": entry(asked, "rad/s"),
        "least_reserve": entry(reserve, "1", "percent"),
        "run": run,
        "left_out": left_out,
    }


def _torque(value: float) -> str:
    return number(value, "N.m")


def coupling_sentence(study: Study) -> str:
    """Which safety coupling the sized drive should have and what it does in the overloads, or why none protects
    it."""
    found = study.setting
    assert found is not None
    caveat = f" ({study.verdict.caveat})" if study.verdict and study.verdict.caveat else ""
    above = f"{_torque(found.least)}, {protection.MARGIN:g} times the {_torque(found.normal)} of normal duty"

    def listed(names: Mapping[str, float]) -> str:
        return ", ".join(f"{SCENARIOS[name]} ({_torque(peak)})" for name, peak in names.items())

    if found.obstacle is protection.Obstacle.MOTOR:
        return (
            f"No safety coupling protects this drive: it has to open above {above}, and the motor gives at most "
            f"{_torque(found.motor)} at the crank."
        )
    if found.obstacle is protection.Obstacle.GEAR:
        return (
            f"No safety coupling protects this drive: it has to open above {above}, and the gear may carry "
            f"{_torque(found.gear)}."
        )
    if found.obstacle is protection.Obstacle.OVERLOADS:
        most = max(found.overloads.values(), default=0.0)
        return f"No safety coupling is recommended: it has to open above {above}, and " + (
            f"the jams, lumps and blocks of this study put {_torque(most)} on it at most."
            if found.overloads
            else "this study has no jam, lump or block that would open it."
        )
    shut = {name: peak for name, peak in found.overloads.items() if name not in found.opens}
    said = (
        f"Recommended safety coupling{caveat}: {above}, below the {_torque(found.motor)} that the motor gives at the "
        f"crank. It opens where {listed(found.opens)}"
    )
    said += f"; it stays shut where {listed(shut)}." if shut else "."
    if found.nuisances:
        said += f" A nuisance trip, which protects nothing: it opens, too, where {listed(found.nuisances)}."
    if study.start_torque is not None and study.start_torque > found.least:
        said += (
            f" A start direct on line puts {_torque(study.start_torque)} on it: it has to be held shut in the start, "
            "or the motor started softly."
        )
    return said


def _warn_of_coupling(study: Study, trip: float) -> None:
    """Where the coupling that is given does not do its work."""
    drive, warn = study.drive, study.warnings.append
    most = drive.pull_out(study.steady, study.warm)
    peaks = _peaks(study)
    if study.start_torque is not None and study.start_torque > trip:
        warn(
            f"A start direct on line puts {_torque(study.start_torque)} on the safety coupling, which opens at "
            f"{_torque(trip)}: it is taken to be held shut in the start."
        )
    opened = {name for name in peaks if study.answers[name].coupling_trip_time is not None}
    shocks = {name: peak for name, peak in peaks.items() if OVERLOADS[name].kind in _SHOCKS}
    if nuisances := [_CALLED[name] for name in peaks if name in opened and name not in shocks]:
        warn(
            f"The safety coupling, set to {_torque(trip)}, opens where no shock asks for it, a nuisance trip that "
            f"protects nothing: {'; '.join(nuisances)}."
        )
    if shocks and not opened.intersection(shocks):
        warn(
            f"The safety coupling opens in no jam, lump or block of this study: it is set to {_torque(trip)}, they "
            f"put {_torque(max(shocks.values()))} on it at most, steady running "
            f"{_torque(_on_coupling(drive, study.steady))}; the motor gives {_torque(most)} at most."
        )
    elif trip > most:
        warn(
            f"The safety coupling is set to {_torque(trip)} and the motor gives {_torque(most)} at most: what brakes "
            "the machine slowly stalls the motor and does not open it."
        )


def _note_chain(study: Study, chain: Chain) -> None:
    """What the reader has to know of the chains."""
    note, (walls, webs), found = study.notes.append, study.drive.rods, study.chain
    note(
        f"The organs are chains of {walls} + {webs} rods; their damping (eta {chain.eta:g} N m2 s, ends "
        f"{chain.end_damping:g} N m s), which a heavier organ wants larger, and folding are assumed."
    )
    for band in found.avoid if found else ():
        if found and band.low <= found.own.speed <= band.high:
            study.warnings.append(f"chains: the crank speed lies among those to avoid, {band}: {band.why}.")
    if walls + webs < 4:
        note(
            f"chains: {walls + webs} rods have {walls + webs - 2} natural frequencies; 8 rods show what a chain does."
        )
    if found:
        for speed, why in found.failed.items():
            study.warnings.append(f"chains: {speed:.4g} rad/s is missing in the sweep: {why}")
        residual = max(n.energy_residual for n in found.sweep)
        if not residual < RESIDUAL:
            study.warnings.append(
                f"chains: the energy residual reaches {number(residual, '1')} of the energy moved; lessen "
                "chain.fold_stiffness."
            )
    if study.coasting is not None:
        note("Behind the open coupling the machine is followed with two bars.")


def _note_shaft(study: Study) -> None:
    """What the reader has to know of the driveline."""
    note, line, found = study.notes.append, study.drive.line, study.torsion
    assert found is not None
    if study.sizing is not None:
        note("Sizing took the shafts for rigid and the driveline for massless; the runs have it.")
    if line.d2 == 0.0 and line.d3 == 0.0:
        note("The driveline has no damping: a vibration that was set off goes on; give d2 and d3.")
    fastest = max((found_loop.crossover for found_loop in study.loops.values()), default=0.0)
    if fastest > found.k_least / 3.0:
        study.warnings.append(
            f"The speed loop crosses over at {fastest:.3g} rad/s, near the line's natural frequency of "
            f"{found.k_least:.3g} rad/s: control and shaft disturb each other; lower the gains or stiffen the line."
        )
    speed = study.config.run.crank_speed * study.drive.driven.p.ratio
    _, i, _ = two_joints(numpy_(), line, np.linspace(0.0, np.pi, 361))
    unevenness = float(np.ptp(i))
    if unevenness > 1e-6:
        note(f"The joints turn unevenly: i23 varies by {100 * unevenness:.2g} % twice a turn of the shaft.")
        for order in ORDERS:
            if (1.0 - NEAR) * found.k_least < order * speed < (1.0 + NEAR) * found.k_largest:
                study.warnings.append(
                    f"The shaft turns at {speed:.3g} rad/s: order {order} of the joints, {order * speed:.3g} rad/s, "
                    f"lies near the line's natural frequency, {found.k_least:.3g} to {found.k_largest:.3g} rad/s."
                )
    for name, shaft in study.shaft.items():
        if shaft.amplification is not None and shaft.amplification > AMPLIFIED:
            study.warnings.append(
                f"{SCENARIOS.get(name, 'steady running')}: the line's torque peaks at {shaft.amplification:.2f} "
                "times that of a rigid drive."
            )


def as_dict(study: Study) -> dict[str, Any]:
    """Everything but the time series, ready for JSON: each number with its unit."""
    config = study.config
    uses = factors_for(study.factors) if study.factors else {}

    return {
        "chainunit": __version__,
        "title": config.title,
        "source": config.source,
        "status": f"failed: {study.failure}" if study.failure else "complete",
        "failure": str(study.failure) if study.failure else None,
        "answers": {name: entries(answers) for name, answers in study.answers.items()},
        "start_up": entries(study.start) if study.start else None,
        "overload_factors": {
            side: {name: factor | {"for": uses[name]} for name, factor in entries(factors).items()}
            for side, factors in study.factors.items()
        }
        or None,
        "limits": entries(study.limits) if study.limits else None,
        "events": {name: {"value": at, "unit": "s"} for name, at in study.event.items()},
        "pins": {
            run: {
                pin: {k: {"value": v, "unit": "N"} for k, v in sizes.items()} for pin, sizes in table.items()
            }
            for run, table in study.pins.items()
        },
        "certificate": {name: _pure(shares) for name, shares in study.certificate.items()},
        "control": {
            "phase_margin": {"value": study.tuning.phase_margin, "unit": "deg"},
            "crossover": {"value": study.tuning.crossover, "unit": "rad/s"},
            "current_crossover": {"value": study.tuning.current_crossover, "unit": "rad/s"},
        }
        if study.tuning
        else "all gains are given"
        if study.drive.motor is DcMotor
        else "none: the motor takes the speed that its supply and the load give",
        "speed_loop": {
            name: {
                "inertia": {"value": found.inertia, "unit": "kg.m2"},
                "phase_margin": {"value": found.phase_margin, "unit": "deg"},
                "crossover": {"value": found.crossover, "unit": "rad/s"},
                "speed_dip": {"value": found.speed_dip, "unit": "rad.s-1/N.m"},
                "settling": {"value": found.settling, "unit": "s"},
            }
            for name, found in study.loops.items()
        },
        "ripple_without_feed_forward": entry(study.ripple_without, "1", "percent"),
        "fmus": study.made,
        "remarks": [slip.as_dict() for slip in config.remarks],
        "verdict": {
            "model": study.verdict.as_dict() if study.verdict else None,
            "motor": motor_verdict(study),
        },
        "warnings": study.warnings,
        "notes": study.notes,
        "machine": entries(study.drive.machine.p),
        "motor": {"kind": study.drive.motor.name, **entries(study.motor)},
        "feed": entries(config.feed),
        "run": entries(config.run),
        "overload": entries(config.overload),
        **({"block_peaks": entries(study.block_peaks)} if study.block_peaks else {}),
        **({"sizing": study.sizing.as_dict() | {"protection": _protection(study)}} if study.sizing else {}),
        **({"monte_carlo": study.monte_carlo.as_dict()} if study.monte_carlo else {}),
        "coupling": entries(config.coupling) if config.coupling else None,
        **(_driveline(study) if study.torsion is not None else {}),
        **(
            {"chain": entries(config.chain) | (study.chain.as_dict() if study.chain else {})}
            if config.chain
            else {}
        ),
        "sides_over_speed": study.sides.as_dict() if study.sides else None,
    }


def _protection(study: Study) -> dict[str, Any]:
    """Settings of the protection of the drive that sizing chose; none for a motor that is insufficient."""
    assert study.sizing is not None
    if not study.advised:
        return {}
    relay = {
        "value": study.sizing.best.motor.nameplate.rated_current,
        "unit": "A",
        "title": "thermal relay, setting",
    }
    found = study.setting
    if found is None:
        return {"relay_current": relay}

    def torque(value: float | None, title: str) -> dict[str, Any]:
        return entry(value, "N.m") | {"title": title}

    return {
        "trip_torque": torque(found.torque, "safety coupling, trip torque at the crank"),
        "relay_current": relay,
        "coupling": coupling_sentence(study),
        "obstacle": found.obstacle,
        "normal_torque": torque(found.normal, "largest torque of normal duty on the coupling, at the crank"),
        "breakdown_torque": torque(found.motor, "most that the motor gives at the crank"),
        "start_torque": torque(study.start_torque, "torque of a start direct on line on the coupling"),
        "overloads": {
            name: torque(
                peak, f"{SCENARIOS[name]}: {'opens it' if name in found.opens else 'leaves it shut'}"
            )
            for name, peak in found.overloads.items()
        },
        "disturbances": {
            name: torque(
                peak,
                f"{SCENARIOS[name]}: {'a nuisance trip' if name in found.nuisances else 'leaves it shut'}",
            )
            for name, peak in found.disturbances.items()
        },
    }


def _driveline(study: Study) -> dict[str, Any]:
    units = {"from": "N.m", "to": "N.m", "count": "1"}
    largest = max(answers.range_largest for answers in study.shaft.values()) if study.shaft else 0.0
    return {
        "driveline": {
            "place": study.config.place,
            "damping_ratio": {"value": study.config.damping_ratio, "unit": "1"},
            **entries(study.config.driveline),
            **entries(study.drive.line),
            **entries(study.torsion),
        },
        "shaft": {name: entries(answers) for name, answers in study.shaft.items()},
        "torque_cycles": {
            name: [
                {k: {"value": x, "unit": units[k]} for k, x in row.items()} for row in cycles.classes(largest)
            ]
            for name, cycles in study.cycles_of.items()
        },
    }


def _pure(values: Mapping[str, float]) -> dict[str, Any]:
    return {name: entry(value, "1") for name, value in values.items()}
