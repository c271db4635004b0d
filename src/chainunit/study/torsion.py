"""A line with a cardan shaft in rotation: natural frequency, resonance and stability, the analyses of a system that
contains one.

The mechanics are in `drives.cardan` and `drives.torsion`; here are the grids of speeds and bends.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.signal import find_peaks

from ..drives.cardan import (
    ORDERS,
    Cardan,
    FrequencyBand,
    frequency_band,
    frozen_frequency,
    sensitivity,
    two_joints,
)
from ..drives.torsion import (
    RigidPeaks,
    SimulatedPeaks,
    SteadyMotion,
    damping_ratio,
    rigid,
    settling_time,
    simulate,
    simulation_steps,
    steady,
    with_damping_ratio,
)
from ..engines import numpy_
from ..quantities import Value, declaration, quantity

TONGUES = (1, 2, 3, 4)
"""n of the parametric resonances 2 speed = 2 k/n."""
DENSER = (*TONGUES, 6)
"""n of the speeds k/n about which the curves have more points; order 6 comes with large bends"""
MOST_STEPS = 200_000
"""of a time simulation"""
LOST = 0.01
"""share of the speed by which a time simulation may be off"""
LEAST_DAMPING = 0.003
"""below which time simulation would take too long"""
DRIFT = 0.01
"""growth of a deviation of the mean speed [1/s] from which on it is worth a word"""
PEAK = 8
"""points between a peak of the coarse resonance curve and its neighbours"""
ROUNDOFF = 1e-9
"""amplitude of an order up to which it is none [rad]"""
SIMULATED = 5
"""every so many points of the resonance curve are simulated"""


@declaration
class Rotation:
    """How the line runs, and the range of speeds of its analysis."""

    speed: Value = quantity(
        "rad/s", "mean speed in normal running", default=150.0, above=0.0, max=1e4, kind="speed"
    )
    load: Value = quantity("N.m", "mean torque on the driven inertia", default=375.0, min=0.0, max=1e9)
    speed_low: Value = quantity(
        "rad/s", "least speed of the analysis", default=40.0, above=0.0, max=1e4, kind="speed"
    )
    speed_high: Value = quantity(
        "rad/s", "largest speed of the analysis", default=300.0, above=0.0, max=1e4, kind="speed"
    )
    points: Value = quantity(
        "1", "number of speeds of the resonance curve", default=200.0, min=10.0, max=5000.0
    )
    margin: Value = quantity(
        "1",
        "permitted nearness to a resonance, as a share of the speed",
        default=0.15,
        min=0.0,
        max=1.0,
        kind="percent",
    )
    factor: Value = quantity(
        "1", "permitted ratio of the peak torque to that of the load alone", default=1.5, min=1.0, max=100.0
    )


@declaration
class StabilityGrid:
    """The grid of the map of stability."""

    bend_low: Value = quantity("rad", "least bend of the map", default=0.0, min=0.0, max=1.5)
    bend_high: Value = quantity("rad", "largest bend of the map", default=0.7, min=0.0, max=1.5)
    speeds: Value = quantity("1", "number of speeds of the map", default=64.0, min=2.0, max=1000.0)
    bends: Value = quantity("1", "number of bends of the map", default=14.0, min=2.0, max=1000.0)


JOINTS = {"alpha1": ("alpha1",), "alpha2": ("alpha2",), "both": ("alpha1", "alpha2")}


def speeds(low: float, high: float, k: float, points: int) -> Any:
    """Speeds [rad/s] from `low` to `high`, denser around the resonances k/n, shape (points,)."""
    fine = np.linspace(low, high, 20001)
    density = np.ones_like(fine)
    for n in DENSER:
        density += 6.0 / (1.0 + ((fine * n / k - 1.0) / 0.02) ** 2)
    reached = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]))])
    return np.interp(np.linspace(0.0, reached[-1], points), reached, fine)


@dataclasses.dataclass(frozen=True)
class StabilityMap:
    """Growth of torsional disturbances over speed, bend and damping ratio."""

    speed: Any
    """[rad/s], (speeds,)"""
    bend: Any
    """[rad], (bends,)"""
    ratio: tuple[float, ...]
    """damping ratios"""
    joint: str
    """of the bend: "alpha1", "alpha2" or "both"; any other bend is that of the line"""
    growth: Any
    """[1/s], (ratios, bends, speeds); NaN without a steady motion"""
    unstable: Any
    """bool, of the same shape"""


@dataclasses.dataclass(frozen=True)
class LineAnalysis:
    """The behaviour of a line with a cardan shaft in rotation."""

    line: Cardan
    rotation: Rotation
    damping_ratio: float
    band: FrequencyBand
    at_even: float
    """natural frequency at i23 = 1 [rad/s]"""
    excitation: dict[int, float]
    """amplitude of phi3 - phi2 by order [rad]"""
    angle: Any
    """over a turn [rad], (points,)"""
    ratio: Any
    """i23 over `angle`"""
    frequency: Any
    """frozen-angle natural frequency over `angle` [rad/s]"""
    sensitivity: dict[str, float]
    speed: Any
    """[rad/s], (speeds,), of `steady` and `rigid`"""
    steady: SteadyMotion
    rigid: RigidPeaks
    operating: SteadyMotion
    simulated: SimulatedPeaks | None
    simulated_speed: Any
    """speeds at which it was to run [rad/s]"""
    map: StabilityMap

    @property
    def static2(self) -> float:
        """Largest torque of shaft 2 from the load alone, without inertia [N.m]."""
        return float(np.max(self.ratio)) * self.rotation.load

    @property
    def on_speed(self) -> Any:
        """Which points of the time simulation kept their speed, bool."""
        assert self.simulated is not None
        return np.abs(self.simulated.speed / self.simulated_speed - 1.0) < LOST

    def crossings(self) -> dict[int, tuple[float, float]]:
        """Speeds at which an order meets the band of the natural frequency, or 2 speed = 2 k/n [rad/s], by n."""
        return {n: (self.band.least / n, self.band.largest / n) for n in TONGUES}

    def unstable_ranges(self) -> list[tuple[float, float]]:
        """Ranges of speed in which a torsional disturbance grows [rad/s], between points of the resonance curve."""
        return _ranges(self.speed, self.steady.unstable)

    def drifting_ranges(self) -> list[tuple[float, float]]:
        """Ranges of speed that a constant torque does not hold, though torsion is stable [rad/s]."""
        return _ranges(self.speed, (self.steady.free_growth > DRIFT) & ~self.steady.unstable)

    def missing_ranges(self) -> list[tuple[float, float]]:
        """Ranges of speed without a steady motion that repeats itself after half a turn [rad/s]."""
        return _ranges(self.speed, ~self.steady.exists)

    def resonances(self) -> list[tuple[float, float]]:
        """Speed [rad/s] and torque of shaft 2 [N.m] of each peak of the resonance curve, by speed."""
        peak = self.steady.peak2
        return [(float(self.speed[j]), float(peak[j])) for j in _peaks(peak)]


def _peaks(curve: Any) -> Any:
    """Places of the inner maxima that stand out by 2 %, above the ripple of torques that are sampled once a step."""
    known = np.isfinite(curve)
    if not known.any():
        return []
    height = np.log(np.maximum(np.where(known, curve, 1.0), 1e-9))
    # a gap counts as higher than all: beside it no point can be told to be a peak
    places, _ = find_peaks(np.where(known, height, height[known].max() + 1.0), prominence=0.02)
    return [int(j) for j in places if known[j]]


def _refined(line: Cardan, load: float, speed: Any, curve: SteadyMotion) -> tuple[Any, SteadyMotion]:
    """The resonance curve with more points about each of its peaks, whose heights a coarse grid misses."""
    near = [np.linspace(speed[j - 1], speed[j + 1], 2 * PEAK + 1)[1:-1] for j in _peaks(curve.peak2)]
    if not near:
        return speed, curve
    more = np.setdiff1d(np.concatenate(near), speed)
    added = steady(line, more, load)
    order = np.argsort(np.concatenate([speed, more]))
    whole = (np.concatenate([a, b], axis=-1)[..., order] for a, b in zip(curve, added, strict=True))
    return np.concatenate([speed, more])[order], SteadyMotion(*whole)


def _ranges(x: Any, inside: Any) -> list[tuple[float, float]]:
    """Ends of the runs of points that are `inside`, half-way to their neighbours outside."""
    middle = np.concatenate([x[:1], 0.5 * (x[1:] + x[:-1]), x[-1:]])
    edge = np.diff(np.concatenate([[False], inside, [False]]).astype(int))
    begins, ends = np.flatnonzero(edge > 0), np.flatnonzero(edge < 0)
    return [(float(middle[a]), float(middle[b])) for a, b in zip(begins, ends, strict=True)]


Report = Callable[[str, float, float], None]


def analyse(
    line: Cardan,
    rotation: Rotation,
    grid: StabilityGrid,
    joint: str = "alpha1",
    damping_ratios: tuple[float, ...] = (0.02,),
    report: Report = lambda task, done, whole: None,
) -> LineAnalysis:
    """Compute everything. `joint` is the bend of the map, for each of the `damping_ratios`; `report` gets the present
    task, and how much of it is done."""
    xp = numpy_()
    k = float(frozen_frequency(xp, line, 1.0))
    angle = np.linspace(0.0, 2.0 * math.pi, 721)
    phi3, ratio, _ = two_joints(xp, line, angle)
    speed = speeds(rotation.speed_low, rotation.speed_high, k, int(rotation.points))
    curve = steady(line, speed, rotation.load, lambda done: report("steady motion", done, 1.0))
    speed, curve = _refined(line, rotation.load, speed, curve)
    operating = steady(line, rotation.speed, rotation.load)
    simulated = _simulated(
        line, speed[::SIMULATED], rotation.load, lambda done: report("time simulation", done, 1.0)
    )
    return LineAnalysis(
        line=line,
        rotation=rotation,
        damping_ratio=damping_ratio(line),
        band=frequency_band(line),
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
        simulated=simulated,
        simulated_speed=speed[::SIMULATED],
        map=stability_map(
            line, rotation, grid, joint, damping_ratios, lambda done: report("map of stability", done, 1.0)
        ),
    )


def _excitation(lead: Any, angle: Any) -> dict[int, float]:
    """Amplitude [rad] of the lead of shaft 3 by order; the last angle of the turn is the first."""
    amplitudes = {n: float(2.0 * abs(np.mean(lead[:-1] * np.exp(-1j * n * angle[:-1])))) for n in ORDERS}
    return {n: size if size > ROUNDOFF else 0.0 for n, size in amplitudes.items()}


def _simulated(
    line: Cardan, speed: Any, load: float, progress: Callable[[float], None]
) -> SimulatedPeaks | None:
    """The peaks in time simulation; None where transients take too long to die."""
    settle = settling_time(line, 0.01)
    if damping_ratio(line) < LEAST_DAMPING or simulation_steps(line, speed, settle) > MOST_STEPS:
        return None
    return simulate(line, speed, load, settle, progress=progress)


def stability_map(
    line: Cardan,
    rotation: Rotation,
    grid: StabilityGrid,
    joint: str,
    damping_ratios: tuple[float, ...],
    progress: Callable[[float], None] = lambda done: None,
) -> StabilityMap:
    """Floquet stability over speed, bend and damping, under the mean load."""
    k = float(frozen_frequency(numpy_(), line, 1.0))
    speed = speeds(rotation.speed_low, rotation.speed_high, k, int(grid.speeds))
    bend = np.linspace(grid.bend_low, grid.bend_high, int(grid.bends))
    ratios = np.array(damping_ratios)
    each_ratio, each_bend, each_speed = (x.ravel() for x in np.meshgrid(ratios, bend, speed, indexing="ij"))
    bends: dict[str, Any] = dict.fromkeys(JOINTS[joint], each_bend)
    unit = with_damping_ratio(line, 1.0)
    p = dataclasses.replace(line, d2=unit.d2 * each_ratio, d3=unit.d3 * each_ratio, **bends)
    motion = steady(p, each_speed, rotation.load, progress)
    shape = (len(ratios), len(bend), len(speed))
    return StabilityMap(
        speed,
        bend,
        damping_ratios,
        joint,
        motion.growth.reshape(shape),
        motion.unstable.reshape(shape),
    )
