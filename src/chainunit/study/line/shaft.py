"""The load of a shaft line between motor and machine in a study: peaks, amplification, cycles for fatigue.

`tau2` is the torque in shaft 2, which the motor turns, `tau3` that in shaft 3, on the machine's side.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.engines import MATH
from ...core.quantities import Value, declaration, quantity, variables
from ...drives.cardan import Cardan, ShaftLine, frozen_frequency, largest_frequency
from ...drives.driveline import Parameters
from ...reading.results import part, result
from ...reading.text import number
from ..arrays import Dataset, peak
from ..drive import Drive
from ..readings import turns_made

LONGEST_STEP = 0.3
"""Largest product of communication step and natural frequency; above it the coupling excites the vibration
more than it damps it."""
RIGID = "driveline.tau2_rigid"
"""Name, in the Dataset of a run, of the torque in shaft 2 in the same run of the rigid drive."""
UNEVEN = 1e-6
"""Variation of the ratio i23 up to which the line counts as even."""
AMPLIFIED = 1.2
"""Amplification from which on a remark is made."""
ROUNDING = 1e-6
"""Range of a cycle, relative to the largest torque, up to which it is rounding and no cycle."""
CLASSES = 10
"""Number of classes of torque range in a table of cycles."""


@declaration
class ShaftAnswers:
    """The load of the shaft line in a run. The rigid drive is the same drive without elasticity and uneven
    ratio, with the same inertia. `amplification` is the peak torque over that of the rigid drive. A cycle of
    `range_equivalent` in each turn of the crank does the damage of steady running, by Woehler's line with the
    exponent `driveline.exponent`. `turns_of_steady` is the number of turns of steady running that do the
    damage of an event; None where steady running has no cycles."""

    tau2_peak: Value = quantity("N.m", "shaft 2, peak torque")
    tau3_peak: Value = quantity("N.m", "shaft 3, peak torque")
    tau2_rigid: Value = quantity("N.m", "rigid shaft 2, peak torque")
    amplification: Value = quantity("1", "amplification by the shafts")
    twist_peak: Value = quantity("rad", "twist of both, peak")
    range_largest: Value = quantity("N.m", "shaft 2, largest range")
    cycles: Value = quantity("1", "shaft 2, cycles")
    range_equivalent: Value = quantity("N.m", "range of equal damage")
    turns_of_steady: Value = quantity("1", "damage in steady turns")


@declaration
class LineModes:
    """The torsional vibration of the line with this motor and machine, by the formula of paper 002 at i23 =
    1, over the range of the machine's inertia in a turn."""

    k_least: Value = quantity("rad/s", "least natural frequency of torsion")
    k_largest: Value = quantity("rad/s", "largest natural frequency of torsion")
    antiresonance: Value = quantity(
        "rad/s", "least natural frequency of the machine on the shafts, the motor held"
    )
    step_longest: Value = quantity("s", "longest communication step")


@result
class CycleClass:
    """A class of torque cycles by their range."""

    low: float = part("least range", unit="N.m", name="from")
    high: float = part("largest range", unit="N.m", name="to")
    count: float = quantity("1", "number of cycles")


@dataclass(frozen=True)
class Cycles:
    """Rainflow cycles (ASTM E1049) of a torque: range and mean [N m], count (1, or 0.5 of an open cycle)."""

    range: Any
    mean: Any
    count: Any

    def above(self, least: float) -> Cycles:
        """The cycles with a range of more than `least` [N m]."""
        mask = self.range > least
        return Cycles(self.range[mask], self.mean[mask], self.count[mask])

    def damage(self, exponent: float) -> float:
        """Sum of count times range to the power of `exponent`."""
        return float(np.sum(self.count * self.range**exponent))

    def classes(self, largest: float) -> list[CycleClass]:
        """Number of cycles in equal classes of range up to the `largest` [N m], largest class first; empty
        classes are left out."""
        if not largest > 0.0:
            return []
        edges = np.linspace(0.0, largest, CLASSES + 1)
        counts, _ = np.histogram(self.range, edges, weights=self.count)
        rows = zip(edges[:-1], edges[1:], counts, strict=True)
        return [CycleClass(float(a), float(b), float(n)) for a, b, n in rows if n][::-1]


def rainflow(torque: Any) -> Cycles:
    """Cycles of a torque [N m], shape (time,)."""
    import rainflow as library

    rows = np.array([row[:3] for row in library.extract_cycles(np.asarray(torque, float))]).reshape(-1, 3)
    return Cycles(rows[:, 0], rows[:, 1], rows[:, 2])


def driveline_of(drive: Drive) -> Parameters:
    """The driveline of a drive that has one."""
    part = drive.line.part("driveline")
    assert part is not None
    parameters: Parameters = part.parameters
    return parameters


def two_masses(drive: Drive, inertia: float) -> Cardan:
    """The drive's line between its rotor and a machine with the `inertia` at the motor [kg m2], with a flywheel
    on its side. Both inertias are reduced to the shafts of the line."""
    line, (before, behind) = driveline_of(drive), drive.whole_line.around("driveline")
    shafts = {v.name: getattr(line, v.name) for v in variables(ShaftLine)}
    rotor = drive.fmu_parameters.rotor.J + before.at_motor(0.0)
    driven = line.J4 + inertia * line.ratio**2 + behind.at_motor(0.0)
    return Cardan(**shafts, J1=rotor * line.ratio**2, J4=driven)


def line_modes(drive: Drive, inertia: Any) -> LineModes:
    """Natural frequencies of the drive's line with the machine's `inertia` at the motor [kg m2], an array over the
    turn."""
    lines = [two_masses(drive, float(J)) for J in (np.min(inertia), np.max(inertia))]
    ends = [float(frozen_frequency(MATH, line, 1.0)) for line in lines]
    longest = LONGEST_STEP / max(float(largest_frequency(MATH, line)) for line in lines)
    behind = [math.sqrt(1.0 / ((1.0 / line.c2 + 1.0 / line.c3) * line.J4)) for line in lines]
    return LineModes(k_least=min(ends), k_largest=max(ends), antiresonance=min(behind), step_longest=longest)


def remedies(line: ShaftLine) -> list[str]:
    """The changes, in words, that make the ratio i23 even."""
    changes = []
    if not math.isclose(line.alpha1, line.alpha2, abs_tol=1e-6):
        bends = (number(bend, "rad") for bend in (line.alpha1, line.alpha2))
        changes.append("make the bends equal (alpha1 = {}, alpha2 = {})".format(*bends))
    off = (line.delta_yokes - line.beta_planes + 0.5 * math.pi) % math.pi - 0.5 * math.pi
    if not math.isclose(off, 0.0, abs_tol=1e-6):
        turn = number(-off, "rad")
        changes.append(f"turn the yokes of the middle shaft by {turn} (delta_yokes = beta_planes)")
    return changes


def rigid_torque(drive: Drive, rigid: Dataset) -> Any:
    """Torque in shaft 2 [N m], shape (time,), in the run `rigid` of the rigid drive."""
    line, (_, behind) = driveline_of(drive), drive.whole_line.around("driveline")
    driven = behind.parts[0].name if behind else "machine"
    return line.ratio * rigid[f"{driven}.tau"].values + line.J4 / line.ratio * rigid["motor.a"].values


def with_rigid(drive: Drive, run: Dataset, rigid: Dataset) -> Dataset:
    """The `run`, with the torque in shaft 2 in the same run of the rigid drive added."""
    torque = rigid_torque(drive, rigid)
    # a coupling opens at different times in the two runs; after that of the rigid drive there is no value
    there = np.interp(run["time"].values, rigid["time"].values, torque, right=np.nan)
    attributes = {"units": "N.m", "long_name": "torque in shaft 2 of the same drive with a rigid shaft"}
    return run.assign({RIGID: ("time", there, attributes)})


def shaft_answers(
    drive: Drive,
    run: Dataset,
    rigid: Dataset,
    exponent: float,
    steady_damage_per_turn: float | None = None,
) -> tuple[ShaftAnswers, Cycles, float]:
    """The load of the line in a `run`, compared with the same run of the rigid drive; its cycles; and their
    damage per turn of the crank, in the unit (N m)^exponent. Without the damage of steady running the run is
    steady running itself: its cycles are then closed."""
    tau2 = run["driveline.tau2"].values
    peak2, peak_rigid = peak(tau2), peak(rigid_torque(drive, rigid))
    steady = steady_damage_per_turn is None
    # a periodic torque that begins and ends at its largest value has no open cycle
    first = int(np.argmax(tau2))
    closed = np.concatenate([tau2[first:], tau2[: first + 1]])
    cycles = rainflow(closed if steady else tau2).above(ROUNDING * peak2)
    turns = max(turns_made(drive, run), 1e-9)
    damage = cycles.damage(exponent)
    twist = run["driveline.twist2"].values + run["driveline.twist3"].values
    return (
        ShaftAnswers(
            tau2_peak=peak2,
            tau3_peak=peak(run["driveline.tau3"].values),
            tau2_rigid=peak_rigid,
            amplification=peak2 / peak_rigid if peak_rigid > 0.0 else None,
            twist_peak=peak(twist),
            range_largest=float(np.max(cycles.range, initial=0.0)),
            cycles=float(np.sum(cycles.count)),
            range_equivalent=(damage / turns) ** (1.0 / exponent) if steady else None,
            turns_of_steady=damage / steady_damage_per_turn if steady_damage_per_turn else None,
        ),
        cycles,
        damage / turns,
    )
