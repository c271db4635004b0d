"""The main job: start-up, steady running and one-sided overloads of a machine with its motor.

The FMUs are exported, co-simulated, and the answers are read from what they did. Every transient branches
from the same steady state, saved once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from .. import __version__
from ..config import Config
from ..cosim import Bond, CoSimulation, Profile, System, energy_residual, monolithic, port_connections
from ..drives.dc_motor import DcMotor
from ..drives.speed_control import Tuning, tune
from ..errors import RunError
from ..fmu.backends import Backend, export
from ..machines.api import ChainUnit
from ..machines.chain_unit import ChamberForces
from ..quantities import Layout, Value, declaration, quantity
from .cycle import OverloadFactors, cycle, overload_factors

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

SCENARIOS = {
    "right_empties": "the right side empties",
    "feed_left": "all feed moves to the left",
    "jam_left": "a lump jams the left side",
}


@declaration
class Answers:
    """What a run asks of the drive; torques and speeds are the crank's unless they are called the motor's. Means
    and RMS are over whole turns of the crank."""

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
    winding_temperature: Value = quantity("K", "winding temperature")
    rocker_torque_peak: Value = quantity("N.m", "rocker torque, peak")
    speed_mean: Value = quantity("rad/s", "crank speed, mean")
    speed_least: Value = quantity("rad/s", "crank speed, least")
    speed_dip: Value = quantity("1", "speed dip")
    recovery_time: Value = quantity("s", "recovery")
    web_pull_least: Value = quantity("N", "least pull in a web")
    wall_pull_least: Value = quantity("N", "least pull in a wall")


@declaration
class Limits:
    """Where the model ends."""

    slack_speed: Value = quantity("rad/s", "crank speed at which a web first goes slack with this feed")
    slack_speed_empty: Value = quantity("rad/s", "crank speed at which a web first goes slack, empty")
    chain_resonance: Value = quantity("rad/s", "crank speed of the lowest mode of a hanging chain, estimated")
    rocker_extreme_right: Value = quantity("rad", "right extreme of the rocker")
    rocker_extreme_left: Value = quantity("rad", "left extreme of the rocker")
    margin: Value = quantity("1", "least |sin| of the transmission angles over the turn")


def entries(declared: Any) -> dict[str, Any]:
    """The declared values of an instance as ``{name: {"value": .., "unit": ..}}``; what is not finite is null."""
    layout = Layout(type(declared))
    return {
        v.name: {"value": _number(value), "unit": v.unit}
        for v, value in zip(layout.variables, layout.values(declared), strict=True)
    }


def _number(value: Any) -> float | None:
    return None if value is None or not math.isfinite(value) else float(value)


Report = Callable[[str, float, float], None]
"""Called with what is running, the time done and the time to do [s]."""


@dataclass
class Study:
    """What a study found. `runs` holds a Dataset per co-simulation, `failure` why it stopped early, if it did."""

    config: Config
    motor: Any
    tuning: Tuning | None
    cycles: Any = None
    factors: OverloadFactors | None = None
    limits: Limits | None = None
    runs: dict[str, xr.Dataset] = field(default_factory=dict)
    event: dict[str, float] = field(default_factory=dict)
    answers: dict[str, Answers] = field(default_factory=dict)
    pins: dict[str, dict[str, dict[str, float]]] = field(default_factory=dict)
    certificate: dict[str, dict[str, float]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    made: dict[str, str] = field(default_factory=dict)
    failure: RunError | None = None


def run_study(
    config: Config,
    folder: Path,
    report: Report | None = None,
    *,
    check: bool = False,
    backend: Backend | None = None,
) -> Study:
    """Run the study; FMUs are written to ``folder/fmu``, by `backend` (see `chainunit.fmu.backends`).

    With `check`, the start-up and steady running are also compared with the monolithic solution.
    A run that fails ends the study early: what was computed is in it, and `failure` says why.
    """
    motor, tuning = _tuned(config)
    study = Study(config, motor, tuning)
    _statics(study)
    files = {}
    for name, model, p in (("machine", ChamberForces, config.machine.p), ("motor", DcMotor, motor)):
        files[name] = folder / "fmu" / f"{model.name}.fmu"
        study.made[name] = export(model, files[name], model.parameter_layout.named(p), backend=backend)
    try:
        _simulate(study, files, report or (lambda what, done, todo: None), check)
    except RunError as error:
        if error.partial is not None:
            study.runs["unfinished"] = error.partial
        study.failure = error
    _note(study)
    return study


def _tuned(config: Config) -> tuple[Any, Tuning | None]:
    """The motor with controller gains tuned to this machine, where the config does not give them."""
    both = cycle(config.machine, config.run.crank_speed, config.feed.left, config.feed.right)
    inertia = config.motor.rotor.J + float(np.mean(both.outputs.J))
    tuning = tune(config.motor.armature, inertia)
    own = {name: gain for name, gain in tuning.parameters.items() if name not in config.motor_given}
    return DcMotor.parameter_layout.from_names(own, config.motor), tuning if own else None


def _statics(study: Study) -> None:
    """What needs no co-simulation: the cycle at constant speed, overload factors, limits of the model."""
    config = study.config
    machine, feed, w = config.machine, config.feed, config.run.crank_speed
    empty_right = type(feed.right)(material_mass=0.0, processing_force=0.0)
    study.cycles = {
        "both sides": cycle(machine, w, feed.left, feed.right),
        "right side empty": cycle(machine, w, feed.left, empty_right),
        "all feed on the left": cycle(machine, w, _sum(feed.left, feed.right), empty_right),
    }
    study.factors = overload_factors(machine, w, feed.left, feed.right)
    (right, _), (left, _) = machine.rocker_extremes()
    g = machine.p.g
    study.limits = Limits(
        slack_speed=machine.slack_speed(feed.left, feed.right),
        slack_speed_empty=machine.slack_speed(),
        # lowest mode of a hanging chain organ of this kind, from the chain model's prototype
        chain_resonance=1.8 * math.sqrt(g / machine.p.l1),
        rocker_extreme_right=right,
        rocker_extreme_left=left,
        margin=float(np.min(study.cycles["both sides"].outputs.margin)),
    )


def _sum(one: Any, other: Any) -> Any:
    return type(one)(
        material_mass=one.material_mass + other.material_mass,
        processing_force=one.processing_force + other.processing_force,
    )


def _loads(config: Config) -> dict[str, float]:
    return {
        f"machine.{side}.{name}": getattr(getattr(config.feed, side), name)
        for side in ("left", "right")
        for name in ("material_mass", "processing_force")
    }


def scenario_signals(config: Config, name: str, at: float) -> dict[str, Any]:
    """Loads over time in the overload `name` of `SCENARIOS` that begins at time `at` [s]."""
    normal, o = _loads(config), config.overload
    signals: dict[str, Any] = dict(normal)
    if name == "jam_left":
        force = normal["machine.left.processing_force"]
        signals["machine.left.processing_force"] = Profile(
            force,
            (
                (at, o.jam_rise, force + o.jam_force),
                (at + o.jam_rise + o.jam_duration, o.jam_rise, force),
            ),
        )
        return signals
    for load in ("material_mass", "processing_force"):
        left, right = normal[f"machine.left.{load}"], normal[f"machine.right.{load}"]
        signals[f"machine.right.{load}"] = Profile(right, ((at, o.shift, 0.0),))
        if name == "feed_left":
            signals[f"machine.left.{load}"] = Profile(left, ((at, o.shift, left + right),))
    return signals


def _simulate(study: Study, files: Mapping[str, Path], report: Report, check: bool) -> None:
    config, machine = study.config, study.config.machine
    run = config.run
    w = run.crank_speed * machine.p.ratio
    turn = 2.0 * math.pi / run.crank_speed
    settled = run.ramp + run.settle_turns * turn
    # a little more than asked, so that a dip in speed does not cost a whole turn
    stop = settled + (run.turns + 0.1) * turn
    follow = (config.overload.turns + 0.1) * turn
    total = stop + len(SCENARIOS) * (turn + follow)
    done = 0.0

    reference = Profile(0.0, ((0.0, run.ramp, w),))
    signals = {**_loads(config), "motor.w_ref": reference}
    system = System(files, port_connections("machine", "motor"))
    bond = Bond(
        "motor",
        "machine",
        {f"{side}.material_mass": partial(_energy_per_kg, machine, side) for side in ("left", "right")},
    )
    with CoSimulation(system, signals) as simulation:
        start_up = simulation.run(
            stop, run.step, partial(_progress, report, "start-up and steady running", 0.0, total)
        )
        _certify(study, "start_up", start_up, bond)
        steady = start_up.sel(time=slice(settled, None))
        study.answers["steady"] = _answers(study, steady, None, steady)
        study.pins["steady"] = _pins(study, steady)
        start = simulation.save()
        angle = float(start_up["motor.phi"].values[-1]) / machine.p.ratio
        lead = _lead(config, angle, study.answers["steady"].speed_mean)
        event = start + lead
        total = stop + len(SCENARIOS) * (lead + follow)
        done = start
        for name, title in SCENARIOS.items():
            simulation.restore()
            simulation.signals = {**scenario_signals(config, name, event), "motor.w_ref": w}
            transient = simulation.run(
                event + follow, run.step, partial(_progress, report, title, done - start, total)
            )
            done += lead + follow
            _certify(study, name, transient, bond)
            study.event[name] = event
            transient_only = transient.sel(time=slice(event, None))
            study.answers[name] = _answers(study, transient_only, event, steady)
            study.pins[name] = _pins(study, transient_only)
        if check:
            report("monolithic reference", total, total)
            _compare(study, start_up, signals)


def _lead(config: Config, angle: float, speed: float) -> float:
    """Time of steady running at `speed` until the crank next stands at the event's angle, at least an eighth of a
    turn [s]; a crank that hardly turns is not waited for."""
    ahead = (config.overload.crank_angle - angle) % (2.0 * math.pi)
    if ahead < 0.25 * math.pi:
        ahead += 2.0 * math.pi
    return ahead / max(speed, 0.5 * config.run.crank_speed)


def _energy_per_kg(machine: ChainUnit, side: str, run: xr.Dataset) -> Any:
    return machine.energy_per_kg(side, run["machine.phi0"].values, run["machine.w0"].values)


def _progress(report: Report, what: str, before: float, todo: float, time: float) -> None:
    report(what, before + time, todo)


def _certify(study: Study, name: str, run: xr.Dataset, bond: Bond) -> None:
    run["residual"], share = energy_residual(run, bond)
    study.runs[name] = run
    study.certificate[name] = {"energy_residual_share": share}


def _compare(study: Study, run: xr.Dataset, signals: Mapping[str, Any]) -> None:
    models = {"machine": (ChamberForces, study.config.machine.p), "motor": (DcMotor, study.motor)}
    times = run["time"].values[::10]
    reference = monolithic(
        models,
        port_connections("machine", "motor", slopes=False),
        signals,
        times,
        corners=signals["motor.w_ref"].corners,
    )
    for name in ("machine.tau", "motor.w"):
        difference = np.abs(run[name].values[::10] - reference[name].values)
        study.certificate["start_up"][f"{name}_difference_to_monolithic"] = float(
            np.max(difference) / np.max(np.abs(reference[name].values))
        )


def _whole_turns(study: Study, run: xr.Dataset) -> Any:
    """Which rows belong to whole turns of the crank: over anything else the mean of a cyclic torque means nothing."""
    phi = run["motor.phi"].values
    turned = (phi - phi[0]) / (2.0 * math.pi * study.config.machine.p.ratio)
    return turned <= max(1.0, math.floor(turned[-1]))


def _answers(study: Study, run: xr.Dataset, event: float | None, steady: xr.Dataset) -> Answers:
    """The numbers of one run."""
    config = study.config
    ratio, w_ref = config.machine.p.ratio, config.run.crank_speed
    whole = _whole_turns(study, run)

    def value(name: str) -> Any:
        return run[name].values

    def peak(x: Any) -> float:
        return float(np.max(np.abs(x)))

    def mean(x: Any) -> float:
        return float(np.mean(x[whole]))

    def rms(x: Any) -> float:
        return math.sqrt(mean(x * x))

    sides = config.machine.loaded_sides(config.feed.left, config.feed.right)

    def least(rod: str) -> float:
        return min((float(np.min(value(f"machine.{side}.{rod}_pull"))) for side in sides), default=math.inf)

    crank_torque, motor_torque = value("machine.tau") * ratio, value("motor.air_gap_tau")
    speed, power, current = value("motor.w") / ratio, value("machine.power"), value("motor.armature.i")
    recovery = None
    if event is not None and _settled(study.answers["steady"], w_ref):
        recovery = _recovery(value("time") - event, speed, steady["motor.w"].values / ratio, w_ref)
    return Answers(
        crank_torque_peak=peak(crank_torque),
        crank_torque_rms=rms(crank_torque),
        crank_torque_mean=mean(crank_torque),
        motor_torque_peak=peak(motor_torque),
        motor_torque_rms=rms(motor_torque),
        power_peak=float(np.max(power)),
        power_mean=mean(power),
        supply_power_mean=mean(value("motor.supply_power")),
        current_peak=peak(current),
        current_rms=rms(current),
        winding_temperature=float(value("motor.armature.T")[-1]),
        rocker_torque_peak=peak(value("machine.rocker.tau")),
        speed_mean=mean(speed),
        speed_least=float(np.min(speed)),
        speed_dip=float((w_ref - np.min(speed)) / w_ref),
        recovery_time=recovery,
        web_pull_least=least("web"),
        wall_pull_least=least("wall"),
    )


def _settled(steady: Answers, w_ref: float) -> bool:
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
    """Peak and RMS of the reaction of every pin [N]."""
    table, whole = {}, _whole_turns(study, run)
    for title, name in PINS.items():
        size = np.hypot(run[f"machine.{name}.fx"].values, run[f"machine.{name}.fy"].values)
        table[title] = {"peak": float(np.max(size)), "rms": float(np.sqrt(np.mean(size[whole] ** 2)))}
    return table


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
    # two bars against a chain of many rods, on this organ: docs/physics.md
    speed, mode = config.run.crank_speed, limits.chain_resonance
    if speed > 0.31 * mode:
        note(
            "A chain has a mode that two bars lack: the rocker torque of two bars is good to 10 % only up "
            f"to about {0.31 * mode:.1f} rad/s of the crank"
            + (", the crank torque up to about twice that." if speed > 0.65 * mode else ".")
        )
    steady = study.answers.get("steady")
    if steady is not None and not _settled(steady, speed):
        note(
            f"steady running: the crank turns at {steady.speed_mean:.3g} rad/s in place of {speed:g} rad/s; the "
            "motor's voltage or current is at its limit, or the run is too short to settle. Overloads are those "
            "of this state."
        )
    for name, answers in study.answers.items():
        title = SCENARIOS.get(name, "steady running")
        if answers.web_pull_least < 0.0:
            note(
                f"{title}: web pull down to {answers.web_pull_least:.0f} N; a chain cannot push, it would go slack "
                "and snatch."
            )
        if answers.current_peak > 0.999 * study.motor.limit.i:
            note(f"{title}: the motor runs into its current limit of {study.motor.limit.i:g} A.")
        if name in SCENARIOS and answers.recovery_time is None:
            note(f"{title}: the speed does not return to its steady band within the time followed.")
    for name, certificate in study.certificate.items():
        share = certificate["energy_residual_share"]
        if not share < 1e-3:
            note(
                f"{SCENARIOS.get(name, 'start-up and steady running')}: the energy residual is {share:.1e} of "
                "the energy moved; the step is too long for this run, lessen run.step."
            )


def as_dict(study: Study) -> dict[str, Any]:
    """Everything but the time series, ready for JSON: each number with its unit."""
    config = study.config

    return {
        "chainunit": __version__,
        "title": config.title,
        "source": config.source,
        "status": f"failed: {study.failure}" if study.failure else "complete",
        "answers": {name: entries(answers) for name, answers in study.answers.items()},
        "overload_factors": _pure(asdict(study.factors)) if study.factors else None,
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
        else "all gains given",
        "fmus": study.made,
        "notes": study.notes,
        "machine": entries(config.machine.p),
        "motor": entries(study.motor),
        "feed": entries(config.feed),
        "run": entries(config.run),
        "overload": entries(config.overload),
    }


def _pure(values: Mapping[str, float]) -> dict[str, Any]:
    return {name: {"value": _number(value), "unit": "1"} for name, value in values.items()}
