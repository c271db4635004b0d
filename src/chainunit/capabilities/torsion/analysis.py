"""The torsion of a cardan line in rotation as an analysis of a study: the analysis of the study's line, and its
remarks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ...core.errors import InputError
from ...drives.cardan import ORDERS, frequency_band
from ...reading.results import part, result
from ...reading.text import number
from ...study.analysis import Analysis, Findings, Work
from ...study.drive import Drive
from ...study.line.shaft import two_masses
from ...study.line.shaft_runs import shaft_findings
from ...study.record import StudyRecord
from ...study.remark import Remark, fault, note, warning
from ...study.verdict import STEADY
from .line import DRIFT, LineAnalysis, Rotation, analyse
from .table import TorsionPlan

SLOW = 1.0 / 6.0
"""Ratio of the shaft's speed to the natural frequency below which no order of the joints comes near a
resonance."""
SLOWEST = 1.0 / 50.0
"""Ratio of the shaft's speed to the natural frequency below which the analysis has no resolution."""
APART = 1.1
"""Ratio of two peaks from which on a remark is made."""


class TorsionAnalysis(Analysis):
    """Natural frequency, resonance and Floquet stability of a cardan line between a motor of this package and
    the machine. The analysis is left out where the line turns too slowly for any resonance, unless the file
    has the table [torsion]."""

    name = "torsion"

    @staticmethod
    def applies(drive: Drive, plans: Mapping[str, Any]) -> bool:
        """Whether the driveline turns, so that its torsion is analysed."""
        return drive.line.part("driveline") is not None

    @staticmethod
    def find(study: StudyRecord, work: Work) -> TorsionFindings | None:
        """The torsion of the line in rotation; None of a slow line without the table [torsion]."""
        config, drive, modes = study.config, study.drive, study.statics.modes
        plan: TorsionPlan = config.plans["torsion"]
        assert modes is not None
        turn = study.statics.normal
        speed = float(config.run.crank_speed * drive.driven_machine.ratio)
        has_table = config.file.gives("torsion")
        if not has_table and speed < SLOW * modes.k_least:
            study.say(_LEFT_OUT, speed=speed, k_least=modes.k_least)
            return None
        inertia = turn.inertia_at(drive.ratio)
        line = two_masses(drive, float(np.mean(inertia)))
        ends = float(np.min(inertia)), float(np.max(inertia))
        bands = [frequency_band(two_masses(drive, J)) for J in ends]
        span = min(band.least for band in bands), max(band.largest for band in bands)
        slowest = SLOWEST * span[1]
        if plan.table.slowest * speed < slowest:
            raise InputError(
                f"torsion.slowest = {plan.table.slowest:g}: the shaft turns at {speed:.4g} rad/s; must be >= "
                f"{slowest / speed:.3g}, as below a fiftieth of the natural frequency nothing resonates"
            )
        load = float(np.mean(turn.crank_torque)) / drive.driven_machine.ratio
        rotation = Rotation(speed=speed, load=load)
        return TorsionFindings(
            analyse(line, rotation, plan.table, plan.joint, plan.damping_ratios, work.progress, span)
        )


_SPEED, _TORQUE, _SHARE = ("rad/s", "speed", 4), ("N.m", "", 4), ("1", "percent")
_LEFT_OUT = note(
    "torsion-left-out",
    "The line's shaft turns at {speed}, far below its natural frequency of {k_least}. No order of the joints comes "
    "near it, and the analysis in rotation is left out.",
    remedy="A table [torsion] asks for it.",
    sizes={("rad/s", "speed"): "speed", ("rad/s", "frequency"): "k_least"},
)
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


@result
class TorsionFindings(Findings):
    """The findings of the analysis."""

    analysis: LineAnalysis = part(inline=True)
    examines = "driveline"

    def remark(self, study: StudyRecord) -> None:
        """Add the remarks and notes on the torsion to the study."""
        study.remarks += self.remarks()
        steady = shaft_findings(study).answers.get(STEADY)
        peak = float(self.analysis.operating.peak2[0])
        if steady is not None and not 1.0 / APART < steady.tau2_peak / peak < APART:
            study.say(_OTHER_MOTOR, STEADY, run=steady.tau2_peak, peak=peak)

    def remarks(self) -> Iterator[Remark]:
        """The remarks that follow from the analysis alone."""
        yield from self._crossings()
        if not self.analysis.operating.exists[0]:
            yield _NO_MOTION.remark(speed=self.analysis.rotation.speed)
        else:
            yield from self._at_operation()
        yield from self._over_speed()
        yield self._gains()
        yield from self._simulation()

    def _crossings(self) -> Iterator[Remark]:
        """Remarks on each order near whose resonance the line runs."""
        analysis = self.analysis
        speed, margin = analysis.rotation.speed, analysis.ranges.margin
        for n, (low, high) in analysis.crossings().items() if analysis.shaken else ():
            near = max(low - speed, speed - high, 0.0) / speed
            if n in ORDERS and near < margin:
                yield _ORDER.remark(
                    n=f"{n}",
                    speed=speed,
                    near=near,
                    low=low,
                    high=high,
                    margin=margin,
                    amplitude=analysis.excitation[n],
                )

    def _at_operation(self) -> Iterator[Remark]:
        analysis = self.analysis
        rotation, motion = analysis.rotation, analysis.operating
        speed, factor = rotation.speed, analysis.ranges.factor
        for shaft, peak, static in (
            (2, float(motion.peak2[0]), analysis.static2),
            (3, float(motion.peak3[0]), rotation.load),
        ):
            if static > 0.0 and peak > factor * static:
                yield _PEAK.remark(
                    shaft=f"{shaft}", peak=peak, speed=speed, times=peak / static, factor=f"{factor:g}"
                )
        least = float(motion.least2[0])
        if rotation.load > 0.0 and least < 0.0:
            yield _SIGN.remark(least=least)
        if motion.unstable[0]:
            yield _UNSTABLE.remark(speed=speed, time=1.0 / float(motion.growth[0]))
        elif motion.free_growth[0] > DRIFT:
            yield _DRIFTING.remark(speed=speed, growth=float(motion.free_growth[0]))

    def _over_speed(self) -> Iterator[Remark]:
        """Remarks on ranges of speed in which the line does not run well."""
        analysis = self.analysis
        for low, high in analysis.unstable_ranges():
            yield _UNSTABLE_RANGE.remark(low=float(low), high=float(high), damping=analysis.damping_ratio)
        for low, high in analysis.missing_ranges():
            yield _NO_MOTION_RANGE.remark(low=float(low), high=float(high))
        for low, high in analysis.drifting_ranges():
            yield _DRIFTING_RANGE.remark(low=float(low), high=float(high))

    def _gains(self) -> Remark:
        """A remark on the changes that raise the natural frequency."""
        by = self.analysis.sensitivity
        names = {"J1": "rotor J1", "J4": "driven inertia J4", "c2": "shaft 2", "c3": "shaft 3"}
        gains: dict[str, Any] = {
            name: 0.01 * abs(by[name]) for name in sorted(by, key=lambda name: -abs(by[name]))
        }
        changes = ", ".join(
            f"{'stiffer' if name[0] == 'c' else 'lighter'} {names[name]}: {number(gain, '1', 'percent')}"
            for name, gain in gains.items()
        )
        return _GAINS.remark(changes=changes, **gains)

    def _simulation(self) -> Iterator[Remark]:
        """Remarks on the limits of the resonance curve and of its time simulation."""
        analysis = self.analysis
        if analysis.damping_ratio <= 0.0:
            yield _UNDAMPED.remark()
        elif analysis.simulation is None:
            yield _NO_SIMULATION.remark(damping=analysis.damping_ratio)
        elif not np.all(analysis.on_speed):
            asked = analysis.simulation.asked_speed
            off = asked[~analysis.on_speed]
            yield _SPEED_LOST.remark(
                count=f"{len(off)}", asked=f"{len(asked)}", low=float(off.min()), high=float(off.max())
            )
        yield _RUN_UP.remark()
