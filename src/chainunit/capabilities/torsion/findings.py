"""The findings on the torsion of a cardan line in rotation, and the remarks that follow from them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ...core.quantities import Value, declaration, quantity
from ...drives.cardan import ORDERS, Cardan
from ...drives.torsion import RigidPeaks, SimulatedPeaks, SteadyMotion
from ...reading.results import derived, part, result
from ...reading.text import number
from ...study.analysis import Findings
from ...study.arrays import stretches
from ...study.line.shaft_runs import shaft_findings
from ...study.record import StudyRecord
from ...study.remark import Remark, fault, note, warning
from ...study.verdict import STEADY
from .table import TorsionTable

TONGUES = (1, 2, 3, 4)
"""n of the parametric resonances 2 speed = 2 k/n."""
LOST = 0.01
"""Permitted relative deviation of the speed in a time simulation."""
DRIFT = 0.01
"""Growth of a deviation of the mean speed [1/s] from which on a remark is made."""
APART = 1.1
"""Ratio of two peaks from which on a remark is made."""

_SPEED, _TORQUE, _SHARE = ("rad/s", "speed", 4), ("N.m", "", 4), ("1", "percent")
_OTHER_MOTOR = note(
    "torque-of-the-motor",
    "In steady running the torque of shaft 2 peaks at {run}, in the analysis of the line in rotation at {peak}. The "
    "analysis assumes a motor of constant torque. In the run speed control, slip and the uneven load of the machine "
    "act on the torsion, too.",
    sizes={_TORQUE: "run peak"},
)
_NO_MOTION = fault(
    "no-steady-motion",
    "No steady motion found at {speed}. Either none has the period of half a turn, or the search did not find it.",
    remedy="More damping or less bend helps in both cases.",
    sizes={_SPEED: "speed"},
)
_ORDER = warning(
    "order-near-line",
    "Running at {speed} is {near} from where order {n} of the joints ({n} times a turn) meets the natural frequency "
    "of torsion. This is {low} to {high} over the turns of shaft and machine, and permitted is {margin}. The order "
    "moves shaft 3 by {amplitude}.",
    remedy="Change the speed or the shafts.",
    sizes={_SPEED: "speed low high", _SHARE: "near margin", "rad": "amplitude"},
)
_PEAK = warning(
    "peak-of-a-shaft",
    "With a motor of constant torque shaft {shaft} carries {peak} at {speed}, {times} times the torque of the load "
    "alone. Permitted is {factor}. The runs of this study show the torque with this motor.",
    sizes={_TORQUE: "peak", _SPEED: "speed", "1": "times"},
)
_SIGN = warning(
    "torque-changes-sign",
    "With a motor of constant torque the torque of shaft 2 falls to {least} in each half turn. With play in splines "
    "and joints, which is not modelled, the shaft hammers.",
    sizes={_TORQUE: "least"},
)
_UNSTABLE = fault(
    "unstable-running",
    "Running at {speed} is unstable, as a torsional vibration grows e-fold in {time}.",
    sizes={_SPEED: "speed", "s": "time"},
)
_DRIFTING = warning(
    "drifting-speed",
    "A motor whose torque does not fall with speed would not hold {speed}, as deviations grow by {growth}. Above a "
    "resonance faster running takes less torque.",
    remedy="Its control or its slip must outweigh that.",
    sizes={_SPEED: "speed", "1/s": "growth"},
)
_UNSTABLE_RANGE = warning(
    "unstable-range",
    "Unstable from {low} to {high} at the damping ratio {damping}. Torsional vibration grows by itself (parametric "
    "resonance).",
    remedy="More damping or more even joints end it.",
    sizes={_SPEED: "low high", "1": "damping"},
)
_NO_MOTION_RANGE = warning(
    "range-without-steady-motion",
    "No steady motion found from {low} to {high}. Either none has the period of half a turn, or the search did not "
    "find it.",
    sizes={_SPEED: "low high"},
)
_DRIFTING_RANGE = note(
    "drifting-range",
    "Only a speed control or slip holds a speed from {low} to {high}, not a motor of constant torque.",
    sizes={_SPEED: "low high"},
)
_GAINS = note(
    "natural-frequency",
    "Changes that raise the natural frequency, per 1 %: {changes}.",
    sizes={_SHARE: "J1 J4 c2 c3"},
)
_UNDAMPED = note(
    "undamped-resonance",
    "Without damping no transient dies out. There is no time simulation, and only the twist bounds the resonance "
    "peaks.",
    remedy="Give driveline.damping_ratio, or d2 and d3.",
)
_NO_SIMULATION = note(
    "no-time-simulation",
    "Transients take too long for a time simulation (damping ratio {damping}). The resonance curve has only the "
    "steady motion.",
    sizes={"1": "damping"},
)
_SPEED_LOST = note(
    "speed-lost",
    "The slow control of the time simulation lost the speed at {count} of {asked} speeds, {low} to {high}. They are "
    "not drawn.",
    sizes={_SPEED: "low high"},
)
_RUN_UP = note(
    "run-up",
    "The resonance curve is for lasting running at each speed. A run-up that passes quickly stays below it.",
)


@declaration
class Rotation:
    """Speed and load at which the line runs."""

    speed: Value = quantity("rad/s", "mean speed of the shaft in normal running", kind="speed")
    load: Value = quantity("N.m", "mean torque on the driven inertia")


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
    """The steady motion over the speed. A range of speeds ends half-way to the next point outside."""

    speed: Any = quantity("rad/s", "speeds", kind="speed")
    motion: SteadyMotion = part(inline=True)
    peaks: Peaks = part("peaks of the torque of shaft 2")
    rigid: RigidPeaks = part(inline=True)

    @derived("rad/s", "speed")
    def unstable(self) -> list[tuple[float, float]]:
        """Ranges in which a torsional disturbance grows."""
        return self._ranges(self.motion.unstable)

    @derived("rad/s", "speed")
    def no_steady_motion(self) -> list[tuple[float, float]]:
        """Ranges without a steady motion of the period of half a turn."""
        return self._ranges(~self.motion.exists)

    @property
    def drifting(self) -> list[tuple[float, float]]:
        """Ranges of speed that a motor of constant torque does not hold, though the torsion is stable [rad/s]."""
        return self._ranges((self.motion.free_growth > DRIFT) & ~self.motion.unstable)

    def _ranges(self, inside: Any) -> list[tuple[float, float]]:
        """The ranges of the speed at which `inside` is true, their ends halfway to the next speeds."""
        speed = self.speed
        middle = np.concatenate([speed[:1], 0.5 * (speed[1:] + speed[:-1]), speed[-1:]])
        return [(float(middle[a]), float(middle[b])) for a, b in stretches(inside)]


@result
class TorsionFindings(Findings):
    """The behaviour of a line with a cardan shaft in rotation."""

    line: Cardan = part("the line, as two inertias with the shafts between them")
    rotation: Rotation = part("speed and load of normal running", name="running")
    ranges: TorsionTable = part(inline=True)
    damping_ratio: float = quantity("1", "damping ratio of the line")
    sensitivity: dict[str, float] = part(
        "relative change of the natural frequency by that of an inertia or a stiffness", unit="1"
    )
    simulation: SimulatedPeaks | None = part("the time simulation, where transients die out")
    map: StabilityMap = part("stability over speed, bend and damping", name="stability")
    natural_frequency: NaturalFrequency = part("the natural frequency of torsion")
    ratio_ends: Ends = part("the ratio i23 over a turn of the shaft", name="ratio")
    excitation: dict[int, float]
    """amplitude of phi3 - phi2 by order [rad]"""
    operating: NormalRunning = part("the steady motion in normal running")
    resonance: Resonance = part("the steady motion over the speed")
    angle: Any
    """angle of the shaft over a turn [rad], (points,)"""
    ratio: Any
    """i23 over `angle`"""
    frequency: Any
    """natural frequency at each fixed `angle` [rad/s]"""
    examines = "driveline"

    @derived("rad", name="excitation")
    def orders(self) -> dict[str, float]:
        """Amplitude of phi3 - phi2 by order."""
        return {f"order {n}": x for n, x in self.excitation.items()}

    @property
    def crossings(self) -> dict[int, tuple[float, float]]:
        """By n, the range of speeds (from, to) at which order n meets the natural frequency k, or 2 speed = 2
        k/n [rad/s]."""
        low, high = self.natural_frequency.over_both_turns
        return {n: (low / n, high / n) for n in TONGUES}

    @derived("rad/s", "speed", name="crossings")
    def crossing_speeds(self) -> dict[str, tuple[float, float]]:
        """Range of speeds at which order n meets the natural frequency k, or 2 speed = 2 k/n."""
        return {f"speed = k/{n}": ends for n, ends in self.crossings.items()}

    @property
    def on_speed(self) -> Any:
        """Whether each point of the time simulation kept its speed, an array of bool."""
        assert self.simulation is not None
        return np.abs(self.simulation.speed / self.simulation.asked_speed - 1.0) < LOST

    def remark(self, study: StudyRecord) -> None:
        """Add the remarks and notes on the torsion to the study."""
        study.findings.remarks += self.remarks()
        steady = shaft_findings(study.findings).answers.get(STEADY)
        peak = float(self.operating.motion.peak2[0])
        if steady is not None and not 1.0 / APART < steady.tau2_peak / peak < APART:
            study.findings.say(_OTHER_MOTOR, STEADY, run=steady.tau2_peak, peak=peak)

    def remarks(self) -> Iterator[Remark]:
        """The remarks that follow from the analysis alone."""
        yield from self._near_orders()
        if self.operating.motion.exists[0]:
            yield from self._in_normal_running()
        else:
            yield _NO_MOTION.remark(speed=self.rotation.speed)
        for low, high in self.resonance.unstable:
            yield _UNSTABLE_RANGE.remark(low=low, high=high, damping=self.damping_ratio)
        for low, high in self.resonance.no_steady_motion:
            yield _NO_MOTION_RANGE.remark(low=low, high=high)
        for low, high in self.resonance.drifting:
            yield _DRIFTING_RANGE.remark(low=low, high=high)
        yield self._gains()
        if self.damping_ratio <= 0.0:
            yield _UNDAMPED.remark()
        elif self.simulation is None:
            yield _NO_SIMULATION.remark(damping=self.damping_ratio)
        elif not np.all(self.on_speed):
            asked = self.simulation.asked_speed
            lost = asked[~self.on_speed]
            yield _SPEED_LOST.remark(
                count=f"{len(lost)}", asked=f"{len(asked)}", low=float(lost.min()), high=float(lost.max())
            )
        yield _RUN_UP.remark()

    def _near_orders(self) -> Iterator[Remark]:
        """A remark on each order of the joints near whose resonance the line runs."""
        speed, margin = self.rotation.speed, self.ranges.margin
        is_uneven = float(np.ptp(self.ratio)) > 1e-9
        for n in ORDERS if is_uneven else ():
            low, high = self.crossings[n]
            near = max(low - speed, speed - high, 0.0) / speed
            if near < margin:
                numbers = {"near": near, "low": low, "high": high, "margin": margin}
                yield _ORDER.remark(n=f"{n}", speed=speed, **numbers, amplitude=self.excitation[n])

    def _in_normal_running(self) -> Iterator[Remark]:
        """Remarks on large peaks, on a torque that changes its sign, and on instability in normal running."""
        motion, static2 = self.operating.motion, self.operating.static_torque2
        speed, load, factor = self.rotation.speed, self.rotation.load, self.ranges.factor
        for shaft, peak, static in (("2", motion.peak2[0], static2), ("3", motion.peak3[0], load)):
            if static > 0.0 and peak > factor * static:
                yield _PEAK.remark(
                    shaft=shaft, peak=float(peak), speed=speed, times=peak / static, factor=f"{factor:g}"
                )
        if load > 0.0 and motion.least2[0] < 0.0:
            yield _SIGN.remark(least=float(motion.least2[0]))
        if motion.unstable[0]:
            yield _UNSTABLE.remark(speed=speed, time=1.0 / float(motion.growth[0]))
        elif motion.free_growth[0] > DRIFT:
            yield _DRIFTING.remark(speed=speed, growth=float(motion.free_growth[0]))

    def _gains(self) -> Remark:
        """The remark on the changes that raise the natural frequency, the most effective one first."""
        titles = {"J1": "rotor J1", "J4": "driven inertia J4", "c2": "shaft 2", "c3": "shaft 3"}
        gains: dict[str, Any] = {name: 0.01 * abs(x) for name, x in self.sensitivity.items()}
        gains = dict(sorted(gains.items(), key=lambda gain: -gain[1]))
        changes = ", ".join(
            f"{'stiffer' if name[0] == 'c' else 'lighter'} {titles[name]}: {number(gain, '1', 'percent')}"
            for name, gain in gains.items()
        )
        return _GAINS.remark(changes=changes, **gains)
