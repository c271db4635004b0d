"""The results of chains at constant speed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ...core.quantities import Value, declaration, quantity
from ...reading.text import entries, entry, number
from ...study.analysis import Findings
from ...study.quantiles import CONFIDENCE, HIGH
from ...study.record import StudyRecord


@declaration
class SpeedNumbers:
    """Chains and two bars at one crank speed. Peaks are those of single turns, over all turns of all starts.

    The turns of a start are not independent. Where they count as too few independent ones, the interval of a
    quantile is NaN."""

    speed: Value = quantity("rad/s", "crank speed", kind="speed")
    crank_torque_median: Value = quantity("N.m", "crank torque, peak of a turn, median")
    crank_torque_high: Value = quantity("N.m", f"crank torque, peak of a turn, {100 * HIGH:g} % quantile")
    crank_torque_high_from: Value = quantity("N.m", "interval of that quantile, from")
    crank_torque_high_to: Value = quantity("N.m", "interval of that quantile, to")
    crank_torque_rms: Value = quantity("N.m", "crank torque, RMS")
    rocker_torque_median: Value = quantity("N.m", "rocker torque, peak of a turn, median")
    rocker_torque_high: Value = quantity("N.m", f"rocker torque, peak of a turn, {100 * HIGH:g} % quantile")
    rocker_torque_high_from: Value = quantity("N.m", "interval of that quantile, from")
    rocker_torque_high_to: Value = quantity("N.m", "interval of that quantile, to")
    snatch_median: Value = quantity("1", "force at A2, peak of a turn over that at rest, median")
    snatch_high: Value = quantity(
        "1", f"force at A2, peak of a turn over that at rest, {100 * HIGH:g} % quantile"
    )
    snatch_high_from: Value = quantity("1", "interval of that quantile, from")
    snatch_high_to: Value = quantity("1", "interval of that quantile, to")
    independent_turns: Value = quantity(
        "1", "number of independent turns for which all turns count, least of the three peaks"
    )
    snatch_spread: Value = quantity("1", "largest over least of the starts' medians of it")
    slack_time: Value = quantity("1", "share of the time in which a rod is slack", kind="percent")
    slack_rods: Value = quantity("1", "share of the rods that are slack, mean over time", kind="percent")
    fold_largest: Value = quantity("rad", "largest angle between neighbouring rods")
    two_bar_crank_torque: Value = quantity("N.m", "crank torque of two bars, peak")
    two_bar_crank_torque_rms: Value = quantity("N.m", "crank torque of two bars, RMS")
    two_bar_rocker_torque: Value = quantity("N.m", "rocker torque of two bars, peak")
    two_bar_snatch: Value = quantity("1", "force at A2 of two bars, peak, over theirs at rest")
    two_bar_slack_time: Value = quantity(
        "1", "share of the time in which a bar is pushed, by its mean axial pull as a rod's", kind="percent"
    )
    energy_residual: Value = quantity("1", "largest energy residual of an organ over the energy moved")


@dataclass(frozen=True)
class Band:
    """Speeds to avoid [rad/s], and why."""

    low: float
    high: float
    why: str

    def __str__(self) -> str:
        """The range in words; a single speed in a study without a sweep."""
        ends = [self.low, self.high] if self.high > self.low else [self.low]
        return " to ".join(number(end, "rad/s", "speed", 4, full=False, beside=False) for end in ends)


@dataclass(frozen=True)
class ChainResult(Findings):
    """The study's own speed, the sweep in rising order, and its conclusions."""

    own: SpeedNumbers
    sweep: tuple[SpeedNumbers, ...]
    avoid: tuple[Band, ...]
    critical: tuple[tuple[int, int, float], ...]
    """(mode, order, crank speed [rad/s]): at this speed `order` times the crank speed is a natural
    frequency"""
    slack_by_rod: Mapping[str, Any]
    """by side: share of the time in which each rod is slack, from A1 on, at the study's own speed"""
    starts: int
    turns: int
    rods: tuple[int, int]
    failures: Mapping[float, str]
    """by crank speed [rad/s], the reason why the speed is missing in the sweep"""

    @property
    def resonance(self) -> float | None:
        """Crank speed that equals the lowest natural frequency of an organ [rad/s]; None without weight."""
        return next((speed for mode, order, speed in self.critical if mode == order == 1), None)

    @property
    def distance(self) -> float | None:
        """Distance of the study's speed from the resonance, relative to it: negative below."""
        return None if self.resonance is None else float(self.own.speed / self.resonance - 1.0)

    def within_sweep(self, apart: float = 0.0) -> list[tuple[int, int, float]]:
        """The critical speeds within the sweep, low orders first. A speed is left out if its distance to an
        earlier one is less than the share `apart` of the width of the sweep."""
        low, high = self.sweep[0].speed, self.sweep[-1].speed
        speeds: list[tuple[int, int, float]] = []
        for each in sorted(self.critical, key=lambda speed: (speed[1], speed[0])):
            clear = all(abs(each[2] - other[2]) >= apart * (high - low) for other in speeds)
            if low <= each[2] <= high and clear:
                speeds.append(each)
        return speeds

    def rod_name(self, k: int) -> str:
        """The name of rod `k`, counted from 0 at A1."""
        wall, _ = self.rods
        return f"wall {k + 1}" if k < wall else f"web {k - wall + 1}"

    def as_dict(self) -> dict[str, Any]:
        """Ready for JSON, each number with its unit."""

        def pure(value: float | None, kind: str = "") -> dict[str, Any]:
            return entry(value, "1", kind)

        return {
            "rods_of_wall": pure(self.rods[0]),
            "rods_of_web": pure(self.rods[1]),
            "starts": pure(self.starts),
            "turns": pure(self.turns),
            "quantile": pure(HIGH, "percent"),
            "confidence": pure(CONFIDENCE, "percent"),
            "own_speed": entries(self.own),
            "resonance": entry(self.resonance, "rad/s", "speed"),
            "distance_to_resonance": pure(self.distance, "percent"),
            "sweep": [entries(numbers) for numbers in self.sweep],
            "avoid": [
                {"from": entry(b.low, "rad/s", "speed"), "to": entry(b.high, "rad/s", "speed"), "why": b.why}
                for b in self.avoid
            ],
            "critical_speeds": [
                {"mode": pure(mode), "order": pure(order), "speed": entry(speed, "rad/s", "speed")}
                for mode, order, speed in self.critical
            ],
            "slack_by_rod": {
                side: [{"rod": self.rod_name(k), **pure(share, "percent")} for k, share in enumerate(shares)]
                for side, shares in self.slack_by_rod.items()
            },
        }

    def remark(self, study: StudyRecord) -> None:
        """No remarks: they stand with those on the model."""
