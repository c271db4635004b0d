"""The results of chains at constant speed."""

from __future__ import annotations

from collections.abc import Mapping

from ...core.quantities import Value, declaration, percentage, quantity
from ...reading.results import derived, part, result
from ...reading.text import number
from ...study.analysis import Findings
from ...study.quantiles import CONFIDENCE, HIGH


@declaration
class SpeedNumbers:
    """Chains and two bars at one crank speed. Peaks are those of single turns, over all turns of all starts.

    The turns of a start are not independent. Where they count as too few independent ones, the interval of a
    median or a quantile is NaN."""

    speed: Value = quantity("rad/s", "crank speed", kind="speed")
    crank_torque_median: Value = quantity("N.m", "crank torque, peak of a turn, median")
    crank_torque_median_from: Value = quantity("N.m", "interval of that median, from")
    crank_torque_median_to: Value = quantity("N.m", "interval of that median, to")
    crank_torque_high: Value = quantity("N.m", f"crank torque, peak of a turn, {100 * HIGH:g} % quantile")
    crank_torque_high_from: Value = quantity("N.m", "interval of that quantile, from")
    crank_torque_high_to: Value = quantity("N.m", "interval of that quantile, to")
    crank_torque_rms: Value = quantity("N.m", "crank torque, RMS")
    rocker_torque_median: Value = quantity("N.m", "rocker torque, peak of a turn, median")
    rocker_torque_median_from: Value = quantity("N.m", "interval of that median, from")
    rocker_torque_median_to: Value = quantity("N.m", "interval of that median, to")
    rocker_torque_high: Value = quantity("N.m", f"rocker torque, peak of a turn, {100 * HIGH:g} % quantile")
    rocker_torque_high_from: Value = quantity("N.m", "interval of that quantile, from")
    rocker_torque_high_to: Value = quantity("N.m", "interval of that quantile, to")
    snatch_median: Value = quantity("1", "force at A2, peak of a turn over that at rest, median")
    snatch_median_from: Value = quantity("1", "interval of that median, from")
    snatch_median_to: Value = quantity("1", "interval of that median, to")
    snatch_high: Value = quantity(
        "1", f"force at A2, peak of a turn over that at rest, {100 * HIGH:g} % quantile"
    )
    snatch_high_from: Value = quantity("1", "interval of that quantile, from")
    snatch_high_to: Value = quantity("1", "interval of that quantile, to")
    independent_turns: Value = quantity(
        "1", "number of independent turns for which all turns count, least of the three peaks"
    )
    snatch_spread: Value = quantity("1", "largest over least of the starts' medians of it")
    slack_time: Value = percentage("share of the time in which a rod is slack")
    slack_time_from: Value = percentage("interval of that share, from")
    slack_time_to: Value = percentage("interval of that share, to")
    slack_rods: Value = percentage("share of the rods that are slack, mean over time")
    fold_largest: Value = quantity("rad", "largest angle between neighbouring rods")
    two_bar_crank_torque: Value = quantity("N.m", "crank torque of two bars, peak")
    two_bar_crank_torque_rms: Value = quantity("N.m", "crank torque of two bars, RMS")
    two_bar_rocker_torque: Value = quantity("N.m", "rocker torque of two bars, peak")
    two_bar_snatch: Value = quantity("1", "force at A2 of two bars, peak, over theirs at rest")
    two_bar_slack_time: Value = percentage(
        "share of the time in which a bar is pushed, by its mean axial pull as a rod's"
    )
    energy_residual: Value = quantity("1", "largest energy residual of an organ over the energy moved")


@result
class Band:
    """Speeds to avoid, and why."""

    low: float = part("from this crank speed", unit="rad/s", kind="speed", name="from")
    high: float = part("up to this crank speed", unit="rad/s", kind="speed", name="to")
    why: str = part("the reason")

    def __str__(self) -> str:
        """The range in words; a single speed in a study at one speed."""
        ends = [self.low, self.high] if self.high > self.low else [self.low]
        return " to ".join(number(end, "rad/s", "speed", 4, full=False, beside=False) for end in ends)


@result
class CriticalSpeed:
    """A crank speed at which a natural frequency of an organ is a multiple of it."""

    mode: int = part("mode of the organ, from the lowest frequency on", unit="1")
    order: int = part("the frequency of the mode over the crank speed", unit="1")
    speed: float = part("crank speed", unit="rad/s", kind="speed")


@result
class RodSlack:
    """The share of the time in which a rod is slack."""

    rod: str = part("name of the rod")
    share: float = part("share of the time in which it is slack", unit="1", kind="percent", inline=True)


@result
class ChainResult(Findings):
    """The study's own speed, all speeds in rising order, and its conclusions."""

    walls: int = part("number of rods of the wall", unit="1", name="rods_of_wall")
    webs: int = part("number of rods of the web", unit="1", name="rods_of_web")
    starts: int = part("starts at each speed", unit="1")
    turns: int = part("turns that are evaluated of each start", unit="1")
    own: SpeedNumbers = part("at the study's own speed", name="own_speed")
    speeds: tuple[SpeedNumbers, ...] = part("over the speeds of the sweep", name="sweep")
    avoid: tuple[Band, ...] = part("the speeds to avoid")
    critical: tuple[CriticalSpeed, ...] = part("the critical speeds", name="critical_speeds")
    slack_by_rod: Mapping[str, list[RodSlack]] = part(
        "by side, the rods from A1 on, at the study's own speed"
    )
    failures: Mapping[float, str]
    """by crank speed [rad/s], the reason why the speed is missing"""

    @derived("1", "percent")
    def quantile(self) -> float:
        """The quantile of the peaks that is given beside the median."""
        return HIGH

    @derived("1", "percent")
    def confidence(self) -> float:
        """The confidence of its interval."""
        return CONFIDENCE

    @derived("rad/s", "speed")
    def resonance(self) -> float | None:
        """Crank speed that equals the lowest natural frequency of an organ; None without weight."""
        return next((speed.speed for speed in self.critical if speed.mode == speed.order == 1), None)

    @derived("1", "percent", name="distance_to_resonance")
    def distance(self) -> float | None:
        """Distance of the study's speed from the resonance, relative to it: negative below."""
        return None if self.resonance is None else float(self.own.speed / self.resonance - 1.0)

    def within_speeds(self, apart: float = 0.0) -> list[CriticalSpeed]:
        """The critical speeds within the range that was run, low orders first. A speed is left out if its distance
        to an earlier one is less than the share `apart` of the width of the range."""
        low, high = self.speeds[0].speed, self.speeds[-1].speed
        speeds: list[CriticalSpeed] = []
        for speed in sorted(self.critical, key=lambda speed: (speed.order, speed.mode)):
            clear = all(abs(speed.speed - other.speed) >= apart * (high - low) for other in speeds)
            if low <= speed.speed <= high and clear:
                speeds.append(speed)
        return speeds
