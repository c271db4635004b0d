"""A line with a cardan shaft in rotation: natural frequency, resonance and stability.

The mechanics are in `drives.cardan` and `drives.torsion`. This module makes the grids of speeds and bends.
The analysis as a part of a study is in `chainunit.capabilities.torsion.analysis`.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np

from ...core.engines import numpy_
from ...core.quantities import Value, declaration, quantity
from ...drives.cardan import (
    ORDERS,
    Cardan,
    FrequencyBand,
    frequency_band,
    frozen_frequency,
    sensitivity,
    two_joints,
    with_damping_ratio,
)
from ...drives.torsion import (
    RigidPeaks,
    SimulatedPeaks,
    SteadyMotion,
    damping_ratio,
    rigid,
    settling_time,
    simulate,
    simulation_steps,
    steady,
)
from ...reading.results import derived, part, result
from ...study.arrays import stretches
from ...work.progress import Progress, TaskProgress
from .table import TorsionTable

TONGUES = (1, 2, 3, 4)
"""n of the parametric resonances 2 speed = 2 k/n."""
DENSER = (*TONGUES, 6)
"""n of the speeds k/n around which the curves have more points; order 6 appears with large bends"""
MOST_STEPS = 200_000
"""largest number of steps of a time simulation"""
LOST = 0.01
"""permitted relative deviation of the speed in a time simulation"""
LEAST_DAMPING = 0.003
"""damping ratio below which a time simulation would take too long"""
DRIFT = 0.01
"""growth of a deviation of the mean speed [1/s] from which on a remark is made"""
PEAK = 8
"""number of points between a peak of the coarse resonance curve and its neighbours"""
ROUNDOFF = 1e-9
"""amplitude of an order up to which it is roundoff [rad]"""
SIMULATED = 5
"""one of so many points of the resonance curve is simulated"""


@declaration
class Rotation:
    """Speed and load at which the line runs."""

    speed: Value = quantity("rad/s", "mean speed of the shaft in normal running", kind="speed")
    load: Value = quantity("N.m", "mean torque on the driven inertia")


BENT = {"alpha1": ("alpha1",), "alpha2": ("alpha2",), "both": ("alpha1", "alpha2")}
"""By joint of the map, the bends that it varies."""


def speeds(low: float, high: float, k: float, points: int) -> Any:
    """Speeds [rad/s] from `low` to `high`, denser around the resonances k/n, shape (points,)."""
    fine = np.linspace(low, high, 20001)
    density = np.ones_like(fine)
    for n in DENSER:
        density += 6.0 / (1.0 + ((fine * n / k - 1.0) / 0.02) ** 2)
    cumulative = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]))])
    return np.interp(np.linspace(0.0, cumulative[-1], points), cumulative, fine)


@result
class StabilityMap:
    """Growth of torsional disturbances over speed, bend and damping ratio."""

    speed: Any = quantity("rad/s", "speeds", kind="speed")
    bend: Any = quantity("rad", "bends")
    ratio: tuple[float, ...] = part("damping ratios", unit="1", name="damping_ratio")
    joint: str = part(
        'the bend that the map varies: "alpha1", "alpha2" or "both"; the other bend is that of the line'
    )
    growth: Any = quantity("1/s", "growth, by damping ratio, bend and speed; NaN without a steady motion")
    unstable: Any
    """bool, of the same shape"""


@result
class Ends:
    """Least and largest value of a ratio."""

    least: float = quantity("1", "least value")
    largest: float = quantity("1", "largest value")


@result
class NaturalFrequency:
    """The natural frequency of torsion."""

    even: float = quantity("rad/s", "natural frequency at i23 = 1", kind="frequency")
    least: float = quantity("rad/s", "least one over a turn of the shaft", kind="frequency")
    largest: float = quantity("rad/s", "largest one over a turn of the shaft", kind="frequency")
    over_both_turns: tuple[float, float] = quantity(
        "rad/s", "least and largest one over a turn of the shaft and a turn of the machine", kind="frequency"
    )
    at_ratio_zero: float = quantity("rad/s", "natural frequency at i23 = 0", kind="frequency")
    at_ratio_infinite: float = quantity("rad/s", "natural frequency at i23 = infinity", kind="frequency")


@result
class NormalRunning:
    """The steady motion in normal running."""

    static_torque2: float = quantity("N.m", "largest torque of shaft 2 from the load alone, without inertia")
    motion: SteadyMotion = part(inline=True)


@result
class Peaks:
    """The peaks of a resonance curve, in order of the speed."""

    speed: list[float] = quantity("rad/s", "speeds of the peaks", kind="speed")
    torque2: list[float] = quantity("N.m", "largest torque of shaft 2 at them")


@result
class Resonance:
    """The steady motion over the speed."""

    speed: Any = quantity("rad/s", "speeds", kind="speed")
    motion: SteadyMotion = part(inline=True)
    peaks: Peaks = part("peaks of the torque of shaft 2")
    rigid: RigidPeaks = part(inline=True)
    unstable: list[tuple[float, float]] = quantity(
        "rad/s", "ranges in which a torsional disturbance grows", kind="speed"
    )
    no_steady_motion: list[tuple[float, float]] = quantity(
        "rad/s", "ranges without a steady motion of the period of half a turn", kind="speed"
    )


@result
class LineAnalysis:
    """The behaviour of a line with a cardan shaft in rotation."""

    line: Cardan = part("the line, as two inertias with the shafts between them")
    rotation: Rotation = part("speed and load of normal running", name="running")
    ranges: TorsionTable = part(inline=True)
    damping_ratio: float = quantity("1", "damping ratio of the line")
    band: FrequencyBand
    """natural frequency over a turn of the shaft, with the inertia J4 of `line`"""
    span: tuple[float, float]
    """least and largest natural frequency [rad/s] over a turn of the shaft and a turn of the machine"""
    at_even: float
    """natural frequency at i23 = 1 [rad/s]"""
    excitation: dict[int, float]
    """amplitude of phi3 - phi2 by order [rad]"""
    angle: Any
    """angle of the shaft over a turn [rad], (points,)"""
    ratio: Any
    """i23 over `angle`"""
    frequency: Any
    """natural frequency at each fixed `angle` [rad/s]"""
    sensitivity: dict[str, float] = part(
        "relative change of the natural frequency by that of an inertia or a stiffness", unit="1"
    )
    speed: Any
    """speeds of `steady` and `rigid` [rad/s], (speeds,)"""
    steady: SteadyMotion
    rigid: RigidPeaks
    operating: SteadyMotion
    simulation: SimulatedPeaks | None = part("the time simulation, where transients die out")
    map: StabilityMap = part("stability over speed, bend and damping", name="stability")

    @property
    def slowest(self) -> float:
        """Least speed of the analysis [rad/s]."""
        return float(self.ranges.slowest * self.rotation.speed)

    @property
    def fastest(self) -> float:
        """Largest speed of the analysis [rad/s]."""
        return float(self.ranges.fastest * self.rotation.speed)

    @property
    def shaken(self) -> bool:
        """Whether the ratio i23 varies."""
        return float(np.ptp(self.ratio)) > 1e-9

    @property
    def static2(self) -> float:
        """Largest torque of shaft 2 from the load alone, without inertia [N.m]."""
        return float(np.max(self.ratio)) * self.rotation.load

    @property
    def on_speed(self) -> Any:
        """Whether each point of the time simulation kept its speed, an array of bool."""
        assert self.simulation is not None
        return np.abs(self.simulation.speed / self.simulation.asked_speed - 1.0) < LOST

    def crossings(self) -> dict[int, tuple[float, float]]:
        """By n, the range of speeds (from, to) at which order n meets the natural frequency k, or 2 speed = 2
        k/n [rad/s]."""
        low, high = self.span
        return {n: (low / n, high / n) for n in TONGUES}

    def unstable_ranges(self) -> list[tuple[float, float]]:
        """Ranges of speed in which a torsional disturbance grows [rad/s], to half the spacing of the
        resonance curve."""
        return _ranges(self.speed, self.steady.unstable)

    def drifting_ranges(self) -> list[tuple[float, float]]:
        """Ranges of speed that a motor of constant torque does not hold, though the torsion is stable
        [rad/s]."""
        return _ranges(self.speed, (self.steady.free_growth > DRIFT) & ~self.steady.unstable)

    def missing_ranges(self) -> list[tuple[float, float]]:
        """Ranges of speed without a steady motion of the period of half a turn [rad/s]."""
        return _ranges(self.speed, ~self.steady.exists)

    def resonances(self) -> list[tuple[float, float]]:
        """Speed [rad/s] and torque of shaft 2 [N.m] at each peak of the resonance curve, in order of the
        speed."""
        peak = self.steady.peak2
        return [(float(self.speed[j]), float(peak[j])) for j in _peaks(peak)]

    @derived()
    def natural_frequency(self) -> NaturalFrequency:
        """The natural frequency of torsion."""
        band = self.band
        return NaturalFrequency(
            self.at_even, band.least, band.largest, self.span, band.at_zero, band.at_infinity
        )

    @derived(name="ratio")
    def ratio_ends(self) -> Ends:
        """The ratio i23 over a turn of the shaft."""
        return Ends(np.min(self.ratio), np.max(self.ratio))

    @derived("rad", name="excitation")
    def orders(self) -> dict[str, float]:
        """Amplitude of phi3 - phi2 by order."""
        return {f"order {n}": x for n, x in self.excitation.items()}

    @derived("rad/s", "speed", name="crossings")
    def crossing_speeds(self) -> dict[str, tuple[float, float]]:
        """Range of speeds at which order n meets the natural frequency k, or 2 speed = 2 k/n."""
        return {f"speed = k/{n}": ends for n, ends in self.crossings().items()}

    @derived(name="operating")
    def operation(self) -> NormalRunning:
        """The steady motion in normal running."""
        return NormalRunning(self.static2, self.operating)

    @derived()
    def resonance(self) -> Resonance:
        """The steady motion over the speed."""
        resonances = self.resonances()
        peaks = Peaks([speed for speed, _ in resonances], [torque for _, torque in resonances])
        unstable, missing = self.unstable_ranges(), self.missing_ranges()
        return Resonance(self.speed, self.steady, peaks, self.rigid, unstable, missing)


def _peaks(curve: Any) -> Any:
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


def _refine(line: Cardan, load: float, speed: Any, curve: SteadyMotion) -> tuple[Any, SteadyMotion]:
    """The resonance curve with more points around each of its peaks, as a coarse grid misses their height."""
    near = [np.linspace(speed[j - 1], speed[j + 1], 2 * PEAK + 1)[1:-1] for j in _peaks(curve.peak2)]
    if not near:
        return speed, curve
    more = np.setdiff1d(np.concatenate(near), speed)
    addition = steady(line, more, load)
    order = np.argsort(np.concatenate([speed, more]))
    return np.concatenate([speed, more])[order], SteadyMotion.joined([curve, addition], order)


def _ranges(x: Any, inside: Any) -> list[tuple[float, float]]:
    """The ranges of `x` whose points are `inside`; each end is half-way to the next point outside."""
    middle = np.concatenate([x[:1], 0.5 * (x[1:] + x[:-1]), x[-1:]])
    return [(float(middle[a]), float(middle[b])) for a, b in stretches(inside)]


def analyse(
    line: Cardan,
    rotation: Rotation,
    table: TorsionTable,
    joint: str = "alpha1",
    damping_ratios: tuple[float, ...] = (),
    progress: TaskProgress = lambda task, done, whole: None,
    other_frequencies: tuple[float, ...] = (),
) -> LineAnalysis:
    """Make the whole analysis. `joint` names the bend that the map varies; there is a map for each of the
    `damping_ratios`, by default for that of the line. `other_frequencies` are further natural frequencies of
    the line, as the inertia of the machine varies [rad/s]. `progress` is called with the current task and the
    completed share of it."""
    xp = numpy_()
    k = float(frozen_frequency(xp, line, 1.0))
    angle = np.linspace(0.0, 2.0 * math.pi, 721)
    phi3, ratio, _ = two_joints(xp, line, angle)
    ends = table.slowest * rotation.speed, table.fastest * rotation.speed
    speed = speeds(*ends, k, int(table.points))
    curve = steady(line, speed, rotation.load, lambda done: progress("torsion: steady motion", done, 1.0))
    speed, curve = _refine(line, rotation.load, speed, curve)
    operating = steady(line, rotation.speed, rotation.load)
    simulation = _time_simulation(
        line, speed[::SIMULATED], rotation.load, lambda done: progress("torsion: time simulation", done, 1.0)
    )
    band = frequency_band(line)
    return LineAnalysis(
        line=line,
        rotation=rotation,
        ranges=table,
        damping_ratio=damping_ratio(line),
        band=band,
        span=(min(band.least, *other_frequencies, k), max(band.largest, *other_frequencies, k)),
        at_even=k,
        excitation=_excitation(phi3 - angle, angle),
        angle=angle,
        ratio=ratio,
        frequency=frozen_frequency(xp, line, ratio),
        sensitivity=sensitivity(line),
        speed=speed,
        steady=curve,
        rigid=rigid(line, speed, rotation.load),
        operating=operating,
        simulation=simulation,
        map=stability_map(
            line,
            speeds(*ends, k, int(table.speeds)),
            np.linspace(table.bend_low, table.bend_high, int(table.bends)),
            rotation.load,
            joint,
            damping_ratios or (damping_ratio(line),),
            lambda done: progress("torsion: map of stability", done, 1.0),
        ),
    )


def _excitation(lead: Any, angle: Any) -> dict[int, float]:
    """Amplitude [rad] of the lead of shaft 3 by order; the last angle of the turn equals the first."""
    amplitudes = {n: float(2.0 * abs(np.mean(lead[:-1] * np.exp(-1j * n * angle[:-1])))) for n in ORDERS}
    return {n: size if size > ROUNDOFF else 0.0 for n, size in amplitudes.items()}


def _time_simulation(line: Cardan, speed: Any, load: float, progress: Progress) -> SimulatedPeaks | None:
    """The peaks in time simulation; None where transients take too long to die out."""
    settle = settling_time(line, 0.01)
    if damping_ratio(line) < LEAST_DAMPING or simulation_steps(line, speed, settle) > MOST_STEPS:
        return None
    return simulate(line, speed, load, settle, progress=progress)


def stability_map(
    line: Cardan,
    speed: Any,
    bend: Any,
    load: float,
    joint: str,
    damping_ratios: tuple[float, ...],
    progress: Progress = lambda done: None,
) -> StabilityMap:
    """Floquet stability over speed [rad/s], bend [rad] and damping, under the mean load [N.m]."""
    ratios = np.array(damping_ratios)
    each_ratio, each_bend, each_speed = (x.ravel() for x in np.meshgrid(ratios, bend, speed, indexing="ij"))
    bends: dict[str, Any] = dict.fromkeys(BENT[joint], each_bend)
    unit = with_damping_ratio(line, 1.0)
    p = dataclasses.replace(line, d2=unit.d2 * each_ratio, d3=unit.d3 * each_ratio, **bends)
    motion = steady(p, each_speed, load, progress)
    shape = (len(ratios), len(bend), len(speed))
    growth, unstable = motion.growth.reshape(shape), motion.unstable.reshape(shape)
    return StabilityMap(speed, bend, damping_ratios, joint, growth, unstable)
