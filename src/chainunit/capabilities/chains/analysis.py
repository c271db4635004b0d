"""The organs as chains at constant crank speed: their torques beside two bars, and the speeds to avoid.

Above a certain speed the motion is chaotic: no single peak is a prediction. At each speed the machine is
therefore started several times, with the crank at different angles, and followed over many turns. The results
are medians and quantiles of the peaks of single turns, over all turns of all starts. A rod is slack while its
mean axial pull is below zero.
"""

from __future__ import annotations

import itertools
import math
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, nullcontext
from dataclasses import dataclass
from itertools import groupby, pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from ...core.errors import InterruptedRunError, RunError
from ...core.native.compilers import COMPILERS
from ...core.quantities import Layout
from ...drives.motor import FOREIGN
from ...fmu.backends import Backend
from ...machines.api import ChainedUnit, ChainUnitMachine, ChainUnitOfChains
from ...machines.chain_unit import SIDES, Feed
from ...machines.machine import Machine
from ...study.analysis import Analysis, Work
from ...study.arrays import peak
from ...study.cycle import Cycle, cycle
from ...study.drive import Drive
from ...study.drive_fmus import export_machine
from ...study.quantiles import HIGH, independent_count, mean_share, quantile
from ...study.record import StudyRecord
from ...study.remark import note
from ...system.instance import Fmu, Instance
from ...work.interrupts import stoppable
from ...work.progress import Progress, TaskProgress
from .result import Band, ChainResult, CriticalSpeed, RodSlack, SpeedNumbers
from .table import ChainOrgans

SETTLE = 5
"""Number of turns at the begin of each start that are not evaluated."""
POINTS = 256
"""Number of points of a turn at which outputs are read."""
AVOID_RATIO = 1.25
"""A speed is to be avoided where the rocker torque of chains exceeds that of two bars by this factor, both at
this speed and at rest. The torque at rest counts, as the torque of two bars has a minimum where weight and
inertia cancel; there a larger torque of chains loads the machine no more than lower speeds do."""
AVOID_SLACK = 0.01
"""A speed is to be avoided, too, where a rod is slack for more than this share of the time."""


@dataclass(frozen=True)
class Turns:
    """Steady running of the machine with chains, sampled: arrays of shape (starts, turns, points)."""

    angle: Any
    """crank angle in a turn [rad], shape (points,); the angle of start k is ahead by k/starts of a turn"""
    values: Mapping[str, Any]
    """outputs by name"""
    pulls: Mapping[str, Any]
    """by side, mean axial pull in each rod [N], shape (starts, turns, points, rods)"""


_LEFT_OUT = note(
    "chains-left-out",
    "Chains at constant speed are left out, as they need a C compiler.",
    remedy=f"Install one ({COMPILERS}).",
)


class ChainAnalysis(Analysis):
    """The chains of a study at constant speed."""

    name = "chain"
    needs_runs, at_end = True, True
    applies = staticmethod(lambda drive, plans: isinstance(drive.machine, ChainUnitOfChains))

    @staticmethod
    def find(study: StudyRecord, work: Work) -> ChainResult | None:
        """The numbers at the speed of the study and over the speeds. None without native code, as an FMU in Python
        would take hours."""
        if study.runs.fmus["machine"].backend != "native":
            study.findings.say(_LEFT_OUT)
            return None
        assert work.rig.files is not None
        config, file = study.setup.config, work.rig.files["machine"]
        result, failure = study_chain(
            study.setup.drive, config.table("chain"), config.feed, config.run.crank_speed, file, work.progress
        )
        study.findings.failure = study.findings.failure or failure
        return result


def rods_of(drive: Drive) -> tuple[int, int]:
    """Numbers of rods in wall and web of an organ of a drive with chains."""
    machine = drive.simulated_machine
    assert isinstance(machine, ChainedUnit)
    return machine.rods


def run_turns(
    fmu: Fmu,
    drive: Drive,
    crank_speed: float,
    feed: Feed,
    outputs: Sequence[str],
    *,
    starts: int,
    turns: int,
    progress: Progress = lambda share: None,
    is_stopped: Callable[[], bool] | None = None,
) -> Turns:
    """Steady running at a prescribed constant speed of the crank, from the hanging position at several angles.

    Parameters
    ----------
    fmu : the machine with chains
    drive : the drive with this machine
    outputs : names of the outputs to read
    starts, turns : see `Turns`
    progress : a function that is called with the share of the work that is complete
    is_stopped : a function that says whether to stop, see `stoppable`; by default Ctrl-C stops the run

    Raises
    ------
    InterruptedRunError, RunError
        where the run was stopped, or a run fails.
    """
    rods = [f"{side}.pull_{k + 1}" for side in SIDES for k in range(sum(rods_of(drive)))]
    names = [*outputs, *rods]
    ratio = drive.driven_machine.p.ratio
    step = 2.0 * math.pi / crank_speed / POINTS
    parameters = drive.simulated_machine.by_name | Layout(Feed).by_name(feed)
    finished = itertools.count(1)

    def run_of(start: int, stop: Callable[[], bool]) -> Any:
        """The rows of the run from the start angle of that number; it counts from the end of its settling."""
        unit = Instance(fmu, f"start {start}")
        try:
            # the FMU extrapolates the angle by the speed: no input has to be set any more
            phi = 2.0 * math.pi * start / starts
            unit.initialize(parameters | {"phi": phi * ratio, "w": crank_speed * ratio, "a": 0.0}, 0.0)
            unit.finish_initialization()
            handle = unit.handle(names)
            rows = np.empty((turns * POINTS, len(names)))
            for k in range(SETTLE):
                unit.step(k * POINTS * step, POINTS * step)
            for k in range(turns * POINTS):
                if stop():
                    raise InterruptedRunError(f"interrupted at {crank_speed:g} rad/s")
                unit.step((SETTLE * POINTS + k) * step, step)
                rows[k] = unit.read(handle)
            return rows
        finally:
            unit.close()
            progress(next(finished) / starts)

    guard = nullcontext(is_stopped) if is_stopped else stoppable()
    with guard as stop, ThreadPoolExecutor(min(starts, os.cpu_count() or 1)) as pool:
        rows = list(pool.map(run_of, range(starts), [stop] * starts))
    series = np.array(rows).reshape(starts, turns, POINTS, len(names))
    pulls = np.split(series[..., len(outputs) :], len(SIDES), axis=-1)
    return Turns(
        angle=2.0 * math.pi * np.arange(1, POINTS + 1) / POINTS,
        values={name: series[..., k] for k, name in enumerate(outputs)},
        pulls=dict(zip(SIDES, pulls, strict=True)),
    )


def turns_of_starts(
    chain: ChainOrgans,
    machine: Machine,
    speed: float,
    feeds: Iterable[Feed],
    folder: Path,
    backend: Backend | None,
) -> list[Cycle]:
    """The machine with chains over all turns of all starts, of shape (turns, points), at that `speed` of the crank
    [rad/s] with each of the `feeds`. The FMU is written to `folder`."""
    drive, outputs = Drive(FOREIGN, None, machine), ("tau", "J")
    starts, turns = int(chain.starts), int(chain.turns)
    cycles = []
    with closing(Fmu(export_machine(drive, folder, backend))) as fmu:
        for feed in feeds:
            sample = run_turns(fmu, drive, speed, feed, outputs, starts=starts, turns=turns)
            tau, J = (sample.values[name].reshape(-1, POINTS) for name in outputs)
            cycles.append(
                Cycle(sample.angle, tau * drive.ratio, SimpleNamespace(J=J, tau=tau), speed, drive.ratio)
            )
    return cycles


def numbers_at(
    fmu: Fmu,
    drive: Drive,
    chain: ChainOrgans,
    feed: Feed,
    crank_speed: float,
    progress: Progress = lambda share: None,
    is_stopped: Callable[[], bool] | None = None,
) -> tuple[SpeedNumbers, dict[str, Any]]:
    """The numbers at one speed with this feed, and by side the share of the time in which each rod is slack."""
    forces = [f"{side}.rocker_joint.{x}" for side in SIDES for x in ("fx", "fy")]
    others = [f"{side}.{name}" for side in SIDES for name in ("fold_largest", "energy_residual")]
    outputs = ("tau", "power", "rocker.tau", *others, *forces)
    starts, turns = int(chain.starts), int(chain.turns)
    sample = run_turns(
        fmu,
        drive,
        crank_speed,
        feed,
        outputs,
        starts=starts,
        turns=turns,
        progress=progress,
        is_stopped=is_stopped,
    )
    values, ratio = sample.values, drive.driven_machine.p.ratio
    bars = cycle(drive.machine, crank_speed, feed)
    snatches, two_bar_snatch = _snatches(drive, feed, values, bars)
    is_pushed = drive.chain_unit.mean_pulls(crank_speed, feed.left, feed.right) < 0.0
    duration = 2.0 * math.pi / crank_speed * turns
    energy = float(np.min(np.mean(np.abs(values["power"]), axis=(1, 2)))) * duration
    gap = max(float(np.max(np.ptp(values[f"{side}.energy_residual"], axis=(1, 2)))) for side in SIDES)
    slack = {side: sample.pulls[side] < 0.0 for side in SIDES}
    all_rods = np.concatenate([slack[side] for side in SIDES], axis=-1)
    crank, medians = values["tau"] * ratio, np.median(snatches, axis=1)
    peaks = {
        "crank_torque": _peaks(crank),
        "rocker_torque": _peaks(values["rocker.tau"]),
        "snatch": snatches,
    }
    slack_time = mean_share(np.mean(np.any(all_rods, axis=-1), axis=(1, 2)))
    return (
        SpeedNumbers(
            speed=crank_speed,
            crank_torque_rms=float(np.sqrt(np.mean(crank**2))),
            snatch_spread=float(np.max(medians) / np.min(medians)),
            slack_time=slack_time.value,
            slack_time_from=slack_time.low,
            slack_time_to=slack_time.high,
            slack_rods=float(np.mean(all_rods)),
            fold_largest=float(max(np.max(values[f"{side}.fold_largest"]) for side in SIDES)),
            two_bar_crank_torque=peak(bars.crank_torque),
            two_bar_crank_torque_rms=float(np.sqrt(np.mean(bars.crank_torque**2))),
            two_bar_rocker_torque=peak(bars.outputs.rocker.tau),
            two_bar_snatch=two_bar_snatch,
            two_bar_slack_time=float(np.mean(np.any(is_pushed, axis=0))),
            energy_residual=gap / max(energy, 1e-300),
            independent_turns=float(min(independent_count(sizes, HIGH) for sizes in peaks.values())),
            **_quantiles(peaks),
        ),
        {side: np.mean(slack[side], axis=(0, 1, 2)) for side in SIDES},
    )


def _peaks(x: Any) -> Any:
    """The peak of each turn, shape (starts, turns), of values of the shape (starts, turns, points)."""
    return np.max(np.abs(x), axis=2)


def _snatches(drive: Drive, feed: Feed, values: Mapping[str, Any], two_bars: Cycle) -> tuple[Any, float]:
    """The snatch in each turn, shape (starts, turns), and that of two bars: the largest force at A2 over the force
    there at rest, of the side on which it is larger."""
    of_chains, of_bars = [], []
    for side in SIDES:
        bars = getattr(two_bars.outputs, side).rocker_joint
        force = np.hypot(*(values[f"{side}.rocker_joint.{x}"] for x in ("fx", "fy")))
        force_at_rest, bar_force_at_rest = rest_forces(drive.chain_unit, side, feed, sum(rods_of(drive)))
        of_chains.append(_peaks(force) / force_at_rest)
        of_bars.append(np.max(np.hypot(bars.fx, bars.fy)) / bar_force_at_rest)
    return np.maximum(*of_chains), float(max(of_bars))


def _quantiles(peaks: Mapping[str, Any]) -> dict[str, float]:
    """Median and quantile of peaks of the shape (starts, turns), with their intervals, by the names in
    `SpeedNumbers`; NaN if the starts differ too much for an interval."""
    numbers: dict[str, float] = {}
    for name, sizes in peaks.items():
        for title, q in (("median", 0.5), ("high", HIGH)):
            estimate = quantile(sizes, q)
            numbers |= {
                f"{name}_{title}": float(np.quantile(sizes, q)),
                f"{name}_{title}_from": estimate.low if estimate else math.nan,
                f"{name}_{title}_to": estimate.high if estimate else math.nan,
            }
    return numbers


def rest_forces(machine: ChainUnitMachine, side: str, feed: Any, rods: int) -> tuple[float, float]:
    """Forces at A2 with the machine at rest and the rocker in the middle [N], of a chain and of two bars: the
    snatch of each is relative to its own force at rest. NaN without weight, as nothing is pulled at rest."""
    if machine.p.g == 0.0:
        return math.nan, math.nan
    bars = getattr(machine.chamber(0.0, left=feed.left, right=feed.right), side).rocker_joint
    chain = machine.hanging(side, 0.0, getattr(feed, side), rods).last
    return float(np.hypot(*chain)) or math.nan, float(np.hypot(bars.fx, bars.fy)) or math.nan


def study_chain(
    drive: Drive, chain: ChainOrgans, feed: Feed, own_speed: float, file: Path, progress: TaskProgress
) -> tuple[ChainResult, RunError | None]:
    """The numbers of chains at the crank speed `own_speed` of a study [rad/s] and over the range of speeds, by the
    FMU `file` of the machine; and the error that ended the runs early, or None. A speed whose run fails is left out
    and stands in `failures`.

    Raises
    ------
    RunError
        where the study's own speed fails or is interrupted.
    """
    modes = drive.chain_unit.chain_modes(feed.left, feed.right)
    critical = []
    if modes is not None:
        for mode, frequency in enumerate(modes.frequency[:4], 1):
            critical += [CriticalSpeed(mode, order, float(frequency) / order) for order in (1, 2)]
    speeds, (low, high) = chain.speeds, chain.ends
    if speeds:
        # the resonance itself is added to the grid
        lowest = [speed.speed for speed in critical[:1]]
        speeds += [w for w in lowest if low < w < high]
    spacing = (high - low) / max(1, len(speeds) - 2)
    others = sorted({w for w in speeds if abs(w - own_speed) > 1e-9 * own_speed})
    failures: dict[float, str] = {}
    interruption: RunError | None = None
    with stoppable() as is_stopped, closing(Fmu(file)) as fmu:

        def run_at(k: int, w: float) -> tuple[SpeedNumbers, dict[str, Any]]:
            """The numbers of the chains at the crank speed `w`, the one of number `k`."""

            def report_share(share: float) -> None:
                progress(f"chains at {w:.3g} rad/s", k + share, float(len(others) + 1))

            report_share(0.0)
            return numbers_at(fmu, drive, chain, feed, w, report_share, is_stopped)

        # the study's own speed comes first, so that an early end loses only the others
        mine, by_rod = run_at(0, own_speed)
        rows = [mine]
        for k, w in enumerate(others, 1):
            try:
                rows.append(run_at(k, w)[0])
            except InterruptedRunError as error:
                interruption = error
                break
            except RunError as error:
                failures[w] = str(error)
    rows.sort(key=lambda n: float(n.speed))
    # of two bars, in a very slow turn
    at_rest = peak(cycle(drive.machine, 1e-6, feed).outputs.rocker.tau)
    walls, webs = rods_of(drive)
    names = [f"{part} {k + 1}" for part, count in (("wall", walls), ("web", webs)) for k in range(count)]
    result = ChainResult(
        own=mine,
        speeds=tuple(rows),
        avoid=tuple(bands(rows, at_rest, 0.5 * spacing)),
        critical=tuple(critical),
        slack_by_rod={
            side: [RodSlack(name, float(share)) for name, share in zip(names, shares, strict=True)]
            for side, shares in by_rod.items()
        },
        starts=int(chain.starts),
        turns=int(chain.turns),
        walls=walls,
        webs=webs,
        failures=failures,
    )
    return result, interruption


def bands(rows: Sequence[SpeedNumbers], at_rest: float, reach: float = math.inf) -> list[Band]:
    """Speeds to avoid, from rows in rising order. Neighbours with the same reason are one band, which begins and ends
    halfway to the next speeds that were run, but no farther than `reach` [rad/s] from its own. `at_rest` is the
    rocker torque of two bars at rest [N.m]."""

    def why(n: SpeedNumbers) -> str:
        """The reasons to avoid a speed, in words; empty for a good one."""
        reasons = []
        if n.slack_time > AVOID_SLACK:
            reasons.append("rods go slack and snatch")
        if n.rocker_torque_high > AVOID_RATIO * max(n.two_bar_rocker_torque, at_rest):
            reasons.append(
                f"the rocker torque is over {AVOID_RATIO:g} times that of two bars, at this speed and at rest"
            )
        return ", and ".join(reasons)

    speeds = [n.speed for n in rows]
    # the distances from each speed to the ends of a band below and above it; the outer rows are outer ends
    halfway = [min(reach, 0.5 * (above - below)) for below, above in pairwise(speeds)]
    to_low, to_high = [0.0, *halfway], [*halfway, 0.0]
    critical: list[Band] = []
    for reason, neighbours in groupby(range(len(rows)), lambda k: why(rows[k])):
        places = list(neighbours)
        low, high = places[0], places[-1]
        if reason:
            critical.append(Band(speeds[low] - to_low[low], speeds[high] + to_high[high], reason))
    return critical
