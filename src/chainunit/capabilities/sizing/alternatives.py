"""The ways to a torque limiter for a drive whose start puts more on it than running does: each is tried in a
simulation of its own."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from ...core.errors import InterruptedRunError, RunError
from ...drives.induction_motor import SoftStart
from ...drives.slip_clutch import SlipClutch
from ...machines.chain_unit import SIDES
from ...study.arrays import Dataset, peak
from ...study.catalogue_drive import with_inertia, with_starter
from ...study.cycle import cycle
from ...study.drive import Drive
from ...study.event import Event, Role
from ...study.events import one_sided_event
from ...study.limits import starting
from ...study.measures import STARTED
from ...study.operation import DriveTables
from ...study.readings import crank_motion
from ...study.record import StudyFindings, StudyRecord, StudyRuns, StudySetup
from ...study.relay import HEAVIEST
from ...study.rig import Rig, join
from ...study.start_runs import StartNumbers, from_angle, hardest, longest_start, start_from, starts_from_all
from ...study.start_up import start_up
from ...study.starts import StartFindings
from ...study.torques import PeakOf, all_feed_on, duty_peak, on_coupling
from ...study.transients import follow, follow_each
from ...study.verdict import STEADY
from ...system import ModelComponent, monolithic
from ...system.graph import in_line
from ...work.progress import TaskProgress
from .candidate import Candidate
from .coupling import effects
from .duty import Duty
from .inverter import boosts
from .protection import MARGIN, Alternative, Setting, Way, WayNumbers
from .table import SizingPlan
from .task import SizingTask
from .trial import try_motor

SOFT_STARTERS = ((0.5, 1.0), (0.5, 3.0), (0.4, 2.0), (0.4, 5.0), (0.3, 5.0), (0.3, 10.0))
"""Share of the voltage and ramp [s] of the soft starters that are tried, in this order."""
RAMPS = (1.0, 2.0, 5.0, 10.0, 20.0)
"""Ramps of the inverter that are tried [s], in this order."""
_FASTEST_RELEASE = 1e-4
"""Release time below which a coupling is not bought [s]."""
_ROWS = 2e-4
"""Time between the rows of the run with a slip clutch [s]."""
_SWING = 0.05
"""Time in which the first swings of a start die down [s]."""
_SMOOTH, _FASTEST, _STUCK = 2e-3, 2e4, 5.0
"""Smoothing slip of the clutch as a share of the motor's speed; largest rate at which the load may follow the motor
[1/s], for which the smoothing slip of a light load is larger; and slip, over the smoothing slip, below which the
clutch counts as stuck: there it passes 98 % of its setting."""


def alternatives(
    study: StudyRecord, setting: Setting, rig: Rig, chosen: ChosenMotor, progress: TaskProgress
) -> tuple[Alternative, ...]:
    """The ways to a coupling that saves what the least setting does not, and to one that a start does not open."""
    return *_in_time(study, setting), *_for_starts(study, setting, rig, chosen, progress)


def _in_time(study: StudyRecord, setting: Setting) -> Iterator[Alternative]:
    """A shorter release time and a stronger gear, where the gear carries more than it may though the coupling opens;
    a shorter release time that spares a part in one overload, where the declared one spares nothing."""
    late = setting.passed or ({} if setting.spares else setting.effects)
    if not late:
        return
    times = [effect.release for effect in late.values()]
    release = min(times) if setting.passed else max(times)
    basis = {"setting": setting.least, "running": setting.running, "start": setting.start}
    if release > _FASTEST_RELEASE:
        tried = effects(study, setting.least, release=release)
        numbers = WayNumbers.of(**basis, release_time=release)
        yield Alternative(Way.RELEASE, numbers, setting.opens, {name: tried[name] for name in setting.opens})
    if setting.passed:
        gear = max(effect.with_coupling for effect in setting.passed.values())
        yield Alternative(Way.GEAR, WayNumbers.of(**basis, gear=gear), setting.opens, setting.effects)


def _for_starts(
    study: StudyRecord, setting: Setting, rig: Rig, chosen: ChosenMotor, progress: TaskProgress
) -> tuple[Alternative, ...]:
    """The ways for a sized drive that starts direct on line, if the start decides its setting and an overload would
    open a coupling that running alone allows. A way whose run fails is left out."""
    if study.setup.config.drive.start != "direct" or not setting.start_decides:
        return ()
    if not setting.opened_by(setting.least_in_running) or StartFindings.found_in(study.findings) is None:
        return ()
    makers: tuple[Callable[[StudyRecord, Rig, Setting], Alternative | None], ...] = (
        partial(_soft_starter, chosen=chosen),
        partial(_inverter, chosen=chosen),
        partial(_slip_clutch, chosen=chosen),
        _higher,
        _before_flywheel,
    )
    ways = []
    for make in makers:
        progress("ways to a torque limiter", 1.0, 1.0)
        try:
            ways.append(make(study, rig, setting))
        except InterruptedRunError:
            raise
        except RunError:
            continue
    return tuple(way for way in ways if way is not None)


def _worst(findings: StudyFindings) -> StartNumbers:
    """The start from the angle at which the direct start puts most on the coupling."""
    return max(StartFindings.of_study(findings).starts, key=lambda start: start.coupling_torque)


def _loaded_starts(runs: StudyRuns) -> list[Event]:
    """The starts under load that the study has run."""
    return [event for event in runs.events.values() if event.from_rest and event.name in runs.answers]


class StarterTrial(NamedTuple):
    """A starter to be tried: the drive with it in a `rig`, the time after which its start-up counts as `failed_after`
    [s], its `numbers` by name, and its `tables`."""

    rig: Rig
    failed_after: float
    numbers: dict[str, float]
    tables: DriveTables


@dataclasses.dataclass(frozen=True)
class ChosenMotor:
    """The candidate that was chosen, with the plan and the duty of the choice."""

    plan: SizingPlan
    duty: Duty
    candidate: Candidate

    def permits(
        self, setup: StudySetup, rig: Rig, tables: DriveTables, starts: Sequence[StartNumbers]
    ) -> bool:
        """Whether a relay and the motor, by each limit of its choice with the margin, permit these `starts`."""
        config = setup.config
        task = SizingTask(self.plan, tables, config.machine, rig.operation, config.events)
        trial = try_motor(task, self.candidate.motor, rig.drive, self.duty, rig.files)
        tried = dataclasses.replace(trial, starts=starts).result()
        has_relay = tried.start_class is None or tried.start_class <= HEAVIEST
        return has_relay and dataclasses.replace(self.candidate, drive=rig.drive, trial=tried).keeps_margin


def _gentlest(
    trials: Iterator[StarterTrial], study: StudyRecord, chosen: ChosenMotor, goal: float, limit: float
) -> tuple[StarterTrial, list[StartNumbers]] | None:
    """The first of the `trials` whose starts take at most the time `limit` [s], are permitted, and put at most `goal`
    [N m] on the coupling, or else the one with the gentlest starts; with its starts from all angles. None if none is
    permitted. One start, from the hardest angle known so far, tells whether a trial is worth all of them."""
    events, angle = _loaded_starts(study.runs), _worst(study.findings).angle
    permitted: list[tuple[StarterTrial, list[StartNumbers]]] = []
    too_hard: list[tuple[float, StarterTrial]] = []

    def is_permitted(trial: StarterTrial) -> bool:
        """Whether all starts of a trial are permitted; then it is one of the `permitted`."""
        starts = starts_from_all(trial.rig, trial.failed_after, events)
        if not chosen.permits(study.setup, trial.rig, trial.tables, starts):
            return False
        permitted.append((trial, starts))
        return True

    for trial in trials:
        probe = start_from(trial.rig, angle, trial.failed_after)
        if probe.start_time is None or probe.start_time > limit:
            continue
        if probe.coupling_torque > goal:
            too_hard.append((probe.coupling_torque, trial))
        elif is_permitted(trial):
            _, starts = permitted[-1]
            if hardest(starts) <= goal:
                return permitted[-1]
            angle = max(starts, key=lambda start: start.coupling_torque).angle
    # the gentlest of the trials that are too hard, beside the permitted ones
    for _, trial in sorted(too_hard, key=lambda pair: pair[0]):
        if is_permitted(trial):
            break
    return min(permitted, key=lambda pair: hardest(pair[1]), default=None)


def _as_numbers(setting: Setting, running: float, starts: list[StartNumbers], **more: float) -> WayNumbers:
    """The numbers of a starter: the least setting of the coupling that neither `running` [N m] nor one of the
    `starts` opens, or None where the gear does not carry it, and with `more` the values of the starter."""
    start = hardest(starts)
    least_setting = MARGIN * max(running, start)
    return WayNumbers.of(
        setting=least_setting if least_setting < setting.gear else None,
        running=running,
        start=start,
        start_time=max(entry.start_time for entry in starts),
        **more,
    )


def _soft_starter(study: StudyRecord, rig: Rig, setting: Setting, chosen: ChosenMotor) -> Alternative:
    """The same motor with a soft starter; at its full voltage the drive is that of the study."""
    tables = study.setup.config.drive
    assert study.setup.plate is not None and study.runs.start is not None
    plate = study.setup.plate.nameplate
    usual = longest_start(rig.operation.ramp_end, study.runs.start.start_time)

    def trials() -> Iterator[StarterTrial]:
        """The drive with each pair of voltage and ramp of a soft starter."""
        for voltage, time in SOFT_STARTERS:
            starter = dataclasses.replace(tables.starter, soft_start=SoftStart(voltage=voltage, time=time))
            soft_tables = dataclasses.replace(tables, start="soft", starter=starter)
            p = with_starter(soft_tables, rig.drive.parameters, plate)
            soft = dataclasses.replace(
                rig,
                operation=dataclasses.replace(rig.operation, starter_time=time),
                drive=dataclasses.replace(rig.drive, parameters=p),
            )
            yield StarterTrial(soft, usual + time, {"voltage": voltage, "ramp": time}, soft_tables)

    best = _gentlest(trials(), study, chosen, setting.running, starting(None, plate).limit)
    if best is None:
        return Alternative(Way.SOFT_STARTER, WayNumbers.of(), {})
    trial, starts = best
    result = _as_numbers(setting, setting.running, starts, **trial.numbers)
    return _tried(study, Way.SOFT_STARTER, result, setting.overloads)


def _tried(
    study: StudyRecord,
    way: Way,
    numbers: WayNumbers,
    overloads: Mapping[str, float],
    runs: Mapping[str, Dataset] | None = None,
) -> Alternative:
    """A way whose coupling was tried in the `overloads`, peaks by name; for `runs` see `effects`."""
    if numbers.setting is None:
        return Alternative(way, numbers, {})
    opens, tried = _opened(overloads, numbers), effects(study, numbers.setting, runs)
    return Alternative(way, numbers, opens, {name: tried[name] for name in opens})


def _opened(overloads: Mapping[str, float], numbers: WayNumbers) -> dict[str, float]:
    """The overloads, peaks by name, that open a coupling."""
    if numbers.setting is None:
        return {}
    return {name: torque for name, torque in overloads.items() if torque > numbers.setting}


def _inverter(study: StudyRecord, rig: Rig, setting: Setting, chosen: ChosenMotor) -> Alternative:
    """The same motor and gear with an inverter, which keeps the speed better: its running and its overloads are those
    of runs of its own."""
    tables = study.setup.config.drive
    assert study.setup.plate is not None
    plate = study.setup.plate.nameplate

    inverter_tables = dataclasses.replace(tables, start="inverter")
    fed = with_starter(inverter_tables, rig.drive.parameters, plate)

    def trials(boost: float) -> Iterator[StarterTrial]:
        """The drive with an inverter of that boost, with each of the ramps, the shortest first."""
        for ramp in RAMPS:
            run = dataclasses.replace(rig.operation.run, ramp=ramp)
            operation = dataclasses.replace(rig.operation, run=run, starter_time=0.0)
            p = dataclasses.replace(fed, inverter=dataclasses.replace(fed.inverter, boost=boost))
            drive = dataclasses.replace(rig.drive, parameters=p, follows=True, observer=None, observed={})
            slower = dataclasses.replace(
                rig, operation=operation, drive=with_inertia(inverter_tables, drive, drive.added_inertia)
            )
            yield StarterTrial(slower, 1.5 * ramp + 1.0, {"ramp": ramp, "boost": boost}, inverter_tables)

    for boost in boosts(fed.inverter.boost, "starter.inverter.boost" in tables.given):
        best = _gentlest(trials(boost), study, chosen, setting.running, math.inf)
        if best is not None:
            break
    else:
        return Alternative(Way.INVERTER, WayNumbers.of(), {})
    trial, starts = best
    fed_rig = dataclasses.replace(trial.rig, fed_from=None)
    running, shocks = _runs(study.runs, fed_rig, on_coupling)
    result = _as_numbers(setting, running, starts, **trial.numbers)
    overloads = {name: on_coupling(fed_rig.drive, run) for name, run in shocks.items()}
    return _tried(study, Way.INVERTER, result, overloads, shocks)


def _runs(runs: StudyRuns, rig: Rig, peak_of: PeakOf) -> tuple[float, dict[str, Dataset]]:
    """The largest torque of normal duty of another drive by `peak_of`, at the crank [N m], and its runs with the
    overloads from their begin on, by name."""
    operation = rig.operation
    duty: list[tuple[str, Dataset]] = []
    shocks: dict[str, Dataset] = {}
    with rig.from_rest() as simulation:
        started = start_up(rig, simulation, lambda time: None, {})
        rig = started.rig
        steady = started.run.sel(time=slice(started.steady_from, None))
        begin = simulation.save()
        angle, speed = crank_motion(rig.drive, steady)
        events = [
            event for name, event in runs.events.items() if name in runs.answers and not event.from_rest
        ]
        for event, run in follow_each(rig, simulation, events, float(angle[-1]), float(np.mean(speed))):
            if event.role is Role.DUTY:
                duty.append((event.name, run))
            elif event.role is Role.SHOCK:
                shocks[event.name] = run
        for side in (side for side in SIDES if side in rig.drive.machine.model.sides):
            event = one_sided_event(runs.events, side)
            run = follow(rig, simulation, event, begin, begin + event.p.shift + 2.0 * operation.turn).run
            duty.append((all_feed_on(side), run))
    return duty_peak(rig.drive, [(STEADY, steady), *duty], peak_of).torque, shocks


def slip_run(rig: Rig, start: StartNumbers, setting: float) -> Dataset | None:
    """A start direct on line from the crank angle of `start`, the same start without a clutch, with a slip clutch of
    the `setting` [N m at the crank] behind rotor and added inertia, until the clutch sticks and the machine has its
    speed; None where it slips on for three times as long as the start takes. The variables of the clutch are
    ``clutch.*``.

    The clutch may slip again near the pull-out torque of the motor: the attribute `slip_time` [s] is the sum of all
    times in which it slips."""
    rig = from_angle(rig, start.angle)
    drive = rig.drive
    capacity, speed = drive.at_port(setting), rig.operation.crank_speed * drive.ratio
    inertia = float(np.min(cycle(drive.machine, rig.operation.crank_speed, rig.operation.feed).outputs.J))
    smooth = max(_SMOOTH * speed, capacity / (_FASTEST * inertia))
    p = SlipClutch.Parameters(phi_start=drive.parameters.phi_start, setting=capacity, w_smooth=smooth)
    parts = drive.graph.components
    behind = {
        name: parts[name] for name in ("machine", *(part.name for part in reversed(drive.whole_line.parts)))
    }
    system = in_line({**behind, "clutch": ModelComponent(SlipClutch, p), "motor": parts["motor"]})
    signals = rig.signals(ramp=True)
    assert start.start_time is not None
    pieces: list[Dataset] = []
    piece, state = 0.25 * start.start_time + _SWING, None
    full, slip_time = STARTED * rig.operation.crank_speed * drive.driven_machine.ratio, 0.0
    for k in range(12):
        times = np.linspace(k * piece, (k + 1) * piece, int(piece / _ROWS) + 2)
        run = monolithic(system, signals, times, rtol=1e-6, start=state)
        state = {str(name): float(x[-1]) for name, x in run.data_vars.items()}
        slips = np.abs(run["clutch.slip"].values) > _STUCK * smooth
        slip_time += float(np.mean(slips)) * piece
        pieces.append(run)
        if not slips[-1] and float(run["machine.w0"].values[-1]) >= full:
            break
    if slips[-1]:
        return None
    return join(pieces).assign_attrs(slip_time=slip_time)


def _slip_clutch(study: StudyRecord, rig: Rig, setting: Setting, chosen: ChosenMotor) -> Alternative | None:
    """A slip clutch with the setting that running alone allows, in a start from the angle from which the direct start
    takes longest: there the load is largest. It slips in the overloads as well."""
    capacity = setting.least_in_running
    if rig.drive.foreign_titles or capacity >= setting.gear:
        return None
    slowest = max(StartFindings.of_study(study.findings).starts, key=lambda start: start.start_time or 0.0)
    left_out = Alternative(Way.SLIP_CLUTCH, WayNumbers.of(running=setting.running), {})
    run = slip_run(rig, slowest, capacity)
    if run is None:
        return left_out
    time = run["time"].values
    heat, end = float(np.trapezoid(run["motor.heat"].values, time)), float(time[-1])
    slipping = dataclasses.replace(slowest, start_time=end, heat=heat, followed=end)
    if not chosen.permits(study.setup, rig, study.setup.config.drive, [slipping]):
        return left_out
    numbers = WayNumbers.of(
        setting=capacity,
        running=setting.running,
        start=float(rig.drive.at_crank(peak(run["clutch.tau"].values))),
        slip_time=run.attrs["slip_time"],
        slip_energy=float(np.trapezoid(run["clutch.dissipated_power"].values, run["time"].values)),
        slip_power=rig.drive.at_port(capacity) * rig.drive.ratio * study.setup.config.run.crank_speed,
    )
    return Alternative(Way.SLIP_CLUTCH, numbers, setting.opened_by(capacity))


def _higher(study: StudyRecord, rig: Rig, setting: Setting) -> Alternative:
    """The setting that no start reaches, and what it still protects."""
    numbers = WayNumbers.of(
        setting=setting.least if setting.least < setting.gear else None,
        running=setting.running,
        start=setting.start,
        rocker=_rocker_until(study.runs, setting),
    )
    return _tried(study, Way.HIGHER, numbers, setting.overloads)


def _rocker_until(runs: StudyRuns, setting: Setting) -> float | None:
    """The largest torque of the rocker in the overloads [N m], each up to the instant at which the coupling carries
    its least setting; None for a machine without a rocker."""
    peaks, parts = [], runs.event_parts
    for run in (parts[name] for name in setting.overloads):
        if "machine.rocker.tau" not in run:
            return None
        torque = runs.drive.at_crank(np.abs(run[runs.drive.motor_torque].values))
        passed = np.flatnonzero(torque > setting.least)
        end = int(passed[0]) + 1 if passed.size else None
        peaks.append(peak(run["machine.rocker.tau"].values[:end]))
    return max(peaks, default=None)


def on_motor_side(drive: Drive, run: Dataset) -> float:
    """Peak torque in a run on a coupling between rotor and flywheel on the motor's shaft, at the crank [N m]: that
    behind the inertia, and the torque that accelerates it and the gear at the rotor and overcomes the drag of this
    gear, as the gear passes it on."""
    gear = drive.gear_at_rotor
    more = (drive.inertia_on_rotor + gear.J) * run["motor.a"].values + gear.d * run["motor.w"].values
    return float(drive.at_crank(peak(run["motor.tau"].values + more / (1.0 + gear.loss))))


def _before_flywheel(study: StudyRecord, rig: Rig, setting: Setting) -> Alternative | None:
    """The coupling between motor and the flywheel on its shaft; None for a drive without one."""
    if not rig.drive.inertia_on_rotor or study.runs.start is None:
        return None
    events = _loaded_starts(study.runs)
    longest = longest_start(rig.operation.ramp_end, study.runs.start.start_time)
    before = rig.drive.inertia_on_rotor + rig.drive.gear_at_rotor.J
    starts = starts_from_all(rig, longest, events, on_motor_side, before)
    if any(start.start_time is None for start in starts):
        return None
    running, shocks = _runs(study.runs, dataclasses.replace(rig, fed_from=None), on_motor_side)
    numbers = _as_numbers(setting, running, starts)
    peaks = {name: on_motor_side(rig.drive, run) for name, run in shocks.items()}
    return Alternative(Way.BEFORE_FLYWHEEL, numbers, _opened(peaks, numbers))
