"""The analysis of the torsion of a cardan line in rotation: natural frequency, resonance and stability.

The mechanics are in `drives.cardan` and `drives.torsion`. This module makes the grids of speeds and bends.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np

from ...core.engines import numpy_
from ...core.errors import InputError
from ...drives.cardan import (
    ORDERS,
    Cardan,
    frequency_band,
    frozen_frequency,
    sensitivity,
    two_joints,
    with_damping_ratio,
)
from ...drives.torsion import (
    SteadyMotion,
    damping_ratio,
    rigid,
    settling_time,
    simulate,
    simulation_steps,
    steady,
)
from ...study.analysis import Analysis, Work
from ...study.line.shaft import two_masses
from ...study.record import StudyRecord
from ...study.remark import note
from ...work.progress import Progress, TaskProgress, quiet
from .findings import (
    TONGUES,
    Ends,
    NaturalFrequency,
    NormalRunning,
    Peaks,
    Resonance,
    Rotation,
    StabilityMap,
    TorsionFindings,
)
from .table import TorsionPlan

SLOW = 1.0 / 6.0
"""Ratio of the shaft's speed to the natural frequency below which no order of the joints comes near a
resonance."""
SLOWEST = 1.0 / 50.0
"""Ratio of the shaft's speed to the natural frequency below which the analysis has no resolution."""
DENSER = (*TONGUES, 6)
"""n of the speeds k/n around which the curves have more points; order 6 appears with large bends."""
MOST_STEPS = 200_000
"""Largest number of steps of a time simulation."""
LEAST_DAMPING = 0.003
"""Damping ratio below which a time simulation would take too long."""
PEAK = 8
"""Number of points between a peak of the coarse resonance curve and its neighbours."""
ROUNDOFF = 1e-9
"""Amplitude of an order up to which it is roundoff [rad]."""
SIMULATED = 5
"""One of so many points of the resonance curve is simulated."""
_LEFT_OUT = note(
    "torsion-left-out",
    "The line's shaft turns at {speed}, far below its natural frequency of {k_least}. No order of the joints comes "
    "near it, and the analysis in rotation is left out.",
    remedy="A table [torsion] asks for it.",
    sizes={("rad/s", "speed"): "speed", ("rad/s", "frequency"): "k_least"},
)


class TorsionAnalysis(Analysis):
    """Natural frequency, resonance and Floquet stability of a cardan line between a motor of this package and
    the machine. The analysis is left out where the line turns too slowly for any resonance, unless the file
    has the table [torsion]."""

    name = "torsion"
    applies = staticmethod(lambda drive, plans: drive.line.part("driveline") is not None)

    @staticmethod
    def find(study: StudyRecord, work: Work) -> TorsionFindings | None:
        """The torsion of the line in rotation; None of a slow line without the table [torsion]."""
        config, drive, modes = study.setup.config, study.setup.drive, study.setup.statics.modes
        plan: TorsionPlan = config.plans["torsion"]
        assert modes is not None
        turn, ratio = study.setup.statics.normal, drive.ratio / drive.line.ratio
        speed = float(config.run.crank_speed * ratio)
        if "torsion" not in config.file.tables and speed < SLOW * modes.k_least:
            study.findings.say(_LEFT_OUT, speed=speed, k_least=modes.k_least)
            return None
        inertia = turn.inertia_at(drive.ratio)
        bands = [frequency_band(two_masses(drive, float(end(inertia)))) for end in (np.min, np.max)]
        span = min(band.least for band in bands), max(band.largest for band in bands)
        slowest = SLOWEST * span[1]
        if plan.table.slowest * speed < slowest:
            raise InputError(
                f"torsion.slowest = {plan.table.slowest:g}: the shaft turns at {speed:.4g} rad/s; must be >= "
                f"{slowest / speed:.3g}, as below a fiftieth of the natural frequency nothing resonates"
            )
        rotation = Rotation(speed=speed, load=float(np.mean(turn.crank_torque)) / ratio)
        return analyse(two_masses(drive, float(np.mean(inertia))), rotation, plan, work.progress, span)


def analyse(
    line: Cardan,
    rotation: Rotation,
    plan: TorsionPlan,
    progress: TaskProgress = quiet,
    other_frequencies: tuple[float, ...] = (),
) -> TorsionFindings:
    """The torsion of a line that turns with this speed and load.

    Parameters
    ----------
    progress : is called with the current task and its completed share
    other_frequencies : further natural frequencies of the line, as the inertia of the machine varies [rad/s]
    """
    xp, table, load = numpy_(), plan.table, rotation.load
    k = float(frozen_frequency(xp, line, 1.0))
    angle = np.linspace(0.0, 2.0 * math.pi, 721)
    phi3, ratio, _ = two_joints(xp, line, angle)
    ends = table.slowest * rotation.speed, table.fastest * rotation.speed

    def part(title: str) -> Progress:
        return lambda done: progress(f"torsion: {title}", done, 1.0)

    curve = _resonance(line, load, speeds(*ends, k, int(table.points)), part("steady motion"))
    operating = steady(line, rotation.speed, load)
    settle, simulated = settling_time(line, 0.01), curve.speed[::SIMULATED]
    is_simulated = (
        damping_ratio(line) >= LEAST_DAMPING and simulation_steps(line, simulated, settle) <= MOST_STEPS
    )
    band = frequency_band(line)
    frequencies = band.least, band.largest, k, *other_frequencies
    span = min(frequencies), max(frequencies)
    # the last angle of the turn equals the first
    amplitudes = {n: 2.0 * abs(np.mean(((phi3 - angle) * np.exp(-1j * n * angle))[:-1])) for n in ORDERS}
    return TorsionFindings(
        line=line,
        rotation=rotation,
        ranges=table,
        damping_ratio=damping_ratio(line),
        sensitivity=sensitivity(line),
        simulation=simulate(line, simulated, load, settle, progress=part("time simulation"))
        if is_simulated
        else None,
        map=_stability_map(line, load, plan, speeds(*ends, k, int(table.speeds)), part("map of stability")),
        natural_frequency=NaturalFrequency(k, band.least, band.largest, span, band.at_zero, band.at_infinity),
        ratio_ends=Ends(np.min(ratio), np.max(ratio)),
        excitation={n: float(x) if x > ROUNDOFF else 0.0 for n, x in amplitudes.items()},
        operating=NormalRunning(float(np.max(ratio)) * load, operating),
        resonance=curve,
        angle=angle,
        ratio=ratio,
        frequency=frozen_frequency(xp, line, ratio),
    )


def speeds(low: float, high: float, k: float, points: int) -> Any:
    """Speeds [rad/s] from `low` to `high`, shape (points,), denser around the resonances k/n: seven times at the
    middle of one, and four times 2 % beside it."""
    fine = np.linspace(low, high, 20001)
    density = np.ones_like(fine)
    for n in DENSER:
        density += 6.0 / (1.0 + ((fine * n / k - 1.0) / 0.02) ** 2)
    cumulative = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]))])
    return np.interp(np.linspace(0.0, cumulative[-1], points), cumulative, fine)


def _resonance(line: Cardan, load: float, speed: Any, progress: Progress) -> Resonance:
    """The steady motion over the `speed`, with more points around each peak, as a coarse grid misses its height."""
    motion = steady(line, speed, load, progress)
    near = [np.linspace(speed[j - 1], speed[j + 1], 2 * PEAK + 1)[1:-1] for j in _peaks(motion.peak2)]
    if near:
        more = np.setdiff1d(np.concatenate(near), speed)
        order = np.argsort(np.concatenate([speed, more]))
        motion = SteadyMotion.joined([motion, steady(line, more, load)], order)
        speed = np.concatenate([speed, more])[order]
    places = _peaks(motion.peak2)
    peaks = Peaks([float(speed[j]) for j in places], [float(motion.peak2[j]) for j in places])
    return Resonance(speed, motion, peaks, rigid(line, speed, load))


def _peaks(curve: Any) -> list[int]:
    """Indices of the inner maxima with a prominence of at least 2 %, which is above the ripple of torques
    that are sampled once a step."""
    from scipy.signal import find_peaks

    is_known = np.isfinite(curve)
    if not is_known.any():
        return []
    height = np.log(np.maximum(np.where(is_known, curve, 1.0), 1e-9))
    # a gap counts as higher than all points: beside it no point is certain to be a peak
    places, _ = find_peaks(np.where(is_known, height, height[is_known].max() + 1.0), prominence=0.02)
    return [int(j) for j in places if is_known[j]]


def _stability_map(
    line: Cardan, load: float, plan: TorsionPlan, speed: Any, progress: Progress
) -> StabilityMap:
    """Floquet stability over speed [rad/s], bend and damping ratio, under the mean load [N.m]."""
    table, ratios = plan.table, plan.damping_ratios or (damping_ratio(line),)
    bend = np.linspace(table.bend_low, table.bend_high, int(table.bends))
    points = np.meshgrid(ratios, bend, speed, indexing="ij")
    ratio_of_point, bend_of_point, speed_of_point = (x.ravel() for x in points)
    bent = ("alpha1", "alpha2") if plan.joint == "both" else (plan.joint,)
    bends: dict[str, Any] = dict.fromkeys(bent, bend_of_point)
    unit = with_damping_ratio(line, 1.0)
    p = dataclasses.replace(line, d2=unit.d2 * ratio_of_point, d3=unit.d3 * ratio_of_point, **bends)
    motion = steady(p, speed_of_point, load, progress)
    growth, unstable = (x.reshape(points[0].shape) for x in (motion.growth, motion.unstable))
    return StabilityMap(speed, bend, ratios, plan.joint, growth, unstable)
