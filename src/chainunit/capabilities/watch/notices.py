"""Who notices an event: thermal relay, torque limiter, current limit and load observer of a study, and the load that
the rocker has carried by then."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ...core.quantities import Value, declaration, quantity
from ...machines.chain_unit import SIDES
from ...reading.results import derived, part, result
from ...study.analysis import Analysis, Findings, Work
from ...study.arrays import Dataset, peak
from ...study.organ_limits import slack_and_mode
from ...study.record import StudyRecord, StudyRuns
from ...study.remark import note, warning

AT_LIMIT = 0.99
"""Share of the limit of its current from which a motor counts as at the limit."""
CHAINS_GOOD = 0.72
"""Crank speed, in parts of the lowest resonance of the chains, up to which the observer tells a fifth of the feed
from the motion of the chains (docs/identification.md)."""
DEVICES = {
    "thermal_relay": "thermal relay",
    "torque_limiter": "torque limiter",
    "current_limit": "current limit",
    "observer": "load observer",
}
"""The devices that may notice an event, with their titles."""


@declaration
class Notice:
    """How a device notices an event. Where it does not, `time` is None, and `carried` is that of the whole run."""

    time: Value = quantity("s", "time from the event to the notice")
    carried: Value = quantity(
        "1", "largest rocker torque from the event to the notice, in parts of that of normal running"
    )


@declaration
class Observed:
    """The estimates of the observer in the steady turns. An imbalance is left less right."""

    imbalance: Value = quantity("kg", "estimated imbalance of the feed, mean")
    error: Value = quantity("kg", "error of the estimated imbalance of the feed, largest")
    threshold: Value = quantity("kg", "threshold of the imbalance of the feed, median")
    force_threshold: Value = quantity("N", "threshold of the imbalance of the processing forces, median")
    rocker_torque: Value = quantity("N.m", "rocker torque, largest")


@result
class ObserverFindings(Findings):
    """The `notices` by event and device; by event the side that the observer names first, empty where it names none,
    and the loaded side; and the estimates in normal running."""

    notices: Mapping[str, Mapping[str, Notice]] = part("when each device notices an event")
    named: Mapping[str, str]
    loaded: Mapping[str, str]
    steady: Observed = part("the estimates in normal running")
    alarm_in_start: float | None = quantity("s", "time of the first alarm before running is steady")
    alarms_in_steady: bool
    resonance: float | None
    """speed in parts of the lowest resonance of the chains, where the organs are chains"""

    @derived()
    def sides(self) -> dict[str, dict[str, str | None]]:
        """By event, the side that the observer names first, and the loaded one."""
        return {
            run: {"named": self.named[run] or None, "loaded": self.loaded[run] or None}
            for run in self.notices
        }

    def remark(self, study: StudyRecord) -> None:
        """Warn of false alarms and of wrong sides, and of chains in place of the bars that the observer knows."""
        if self.alarms_in_steady:
            study.findings.say(_ALARMS, imbalance=self.steady.imbalance, threshold=self.steady.threshold)
        elif self.alarm_in_start is not None:
            study.findings.say(_IN_START, time=self.alarm_in_start)
        wrong = [run for run, side in self.named.items() if side and self.loaded[run] not in ("", side)]
        if wrong:
            study.findings.say(_WRONG_SIDE, *wrong, where="; ".join(map(study.runs.title_of, wrong)))
        if self.resonance is not None:
            study.findings.say(
                _NEAR_RESONANCE if self.resonance > CHAINS_GOOD else _TWO_BARS,
                error=self.steady.error,
                share=self.resonance,
                good=CHAINS_GOOD,
            )


_ALARMS = warning(
    "observer-alarms-in-normal-running",
    "The load observer raises an alarm in normal running, where it estimates an imbalance of the feed of "
    "{imbalance} (threshold {threshold}). Its alarms in the events tell nothing.",
    sizes={"kg": "imbalance threshold"},
)
_IN_START = note(
    "observer-in-the-start",
    "The load observer raises an alarm in the start, at t = {time}.",
    remedy="Hold its alarms back until running is steady.",
    sizes={"s": "time"},
)
_WRONG_SIDE = warning(
    "observer-names-the-wrong-side", "The load observer first names the side that is not loaded: {where}."
)
_BARS = (
    "The organs are chains, and the load observer knows two bars.",
    "In normal running its imbalance of the feed is wrong by {error} at most.",
    "The crank turns at {share} times the lowest resonance of the chains.",
    "Up to {good} times it tells a fifth of the feed from the motion of the chains.",
)
_SIZES = {"kg": "error", "1": "share good"}
_NEAR_RESONANCE = warning("observer-near-resonance", *_BARS, sizes=_SIZES)
_TWO_BARS = note("observer-of-two-bars", *_BARS, sizes=_SIZES)


class ObserverAnalysis(Analysis):
    """Who notices the events of a study with a load observer."""

    name = "observer"
    needs_runs = True
    applies = staticmethod(lambda drive, plans: drive.observer is not None)

    @staticmethod
    def find(study: StudyRecord, work: Work) -> ObserverFindings | None:
        """The notices, from the runs that the study has made; None without steady running. A start under load is left
        out: the observer learns the loads in it."""
        if "steady" not in study.runs.answers:
            return None
        steady, events = study.runs.steady, study.setup.config.events
        normal = peak(steady["machine.rocker.tau"].values)
        after = {name: run for name, run in study.runs.event_parts.items() if not events[name].from_rest}
        start, resonance = study.runs.rise, None
        if study.setup.drive.machine.in_place:
            _, mode = slack_and_mode(study.setup.drive.chain_unit, study.setup.config.feed)
            resonance = study.setup.config.run.crank_speed / mode
        return ObserverFindings(
            notices={name: dict(_notices(study.runs, name, run, normal)) for name, run in after.items()},
            named={name: _side(run) for name, run in after.items()},
            loaded={name: events[name].loaded_side for name in after},
            steady=_observed(steady, normal),
            alarm_in_start=_first(start["time"].values, _is_alarm(start)),
            alarms_in_steady=bool(np.any(_is_alarm(steady))),
            resonance=resonance,
        )


def _observed(steady: Dataset, normal: float) -> Observed:
    """The observer in steady running: its errors and thresholds; `normal` is the usual rocker torque [N m]."""
    estimate = steady["observer.imbalance.feed"].values
    left, right = (steady[f"machine.{side}.material_mass"].values for side in SIDES)
    return Observed(
        imbalance=float(np.mean(estimate)),
        error=peak(estimate - (left - right)),
        threshold=float(np.median(steady["observer.imbalance.feed_threshold"].values)),
        force_threshold=float(np.median(steady["observer.imbalance.force_threshold"].values)),
        rocker_torque=normal,
    )


def _is_alarm(run: Dataset) -> Any:
    """Whether the observer raises an alarm, at each row of a run."""
    return np.abs(run["observer.alarm"].values) > 0.5


def _first(time: Any, is_noticed: Any) -> float | None:
    """The time of the first row at which something is noticed [s]."""
    return next(map(float, time[is_noticed]), None)


def _side(run: Dataset) -> str:
    """The side of the first alarm; empty without an alarm."""
    first = run["observer.alarm"].values[_is_alarm(run)][:1]
    return "" if not first.size else "left" if first[0] > 0.0 else "right"


def _notices(runs: StudyRuns, name: str, run: Dataset, normal: float) -> Iterator[tuple[str, Notice]]:
    """The notice of each device that the drive has, by its name. `run` is that of the event from its begin on."""
    drive, motor, answers = runs.drive, runs.drive.motor, runs.answers[name]
    time, torque = run["time"].values - runs.event_times[name], np.abs(run["machine.rocker.tau"].values)
    times: dict[str, float | None] = {}
    if drive.rated_current is not None:
        times["thermal_relay"] = answers.thermal_trip_time
    if runs.operation.coupling is not None:
        times["torque_limiter"] = answers.coupling_trip_time
    limit = motor.current_limit(drive.parameters)
    if limit is not None:
        current = np.abs(run[f"motor.{motor.current}"].values)
        times["current_limit"] = _first(time, current >= AT_LIMIT * limit)
    times["observer"] = _first(time, _is_alarm(run))
    for device, noticed in times.items():
        # a row that is nearer than a millionth of a step is that of the notice
        until = time[-1] if noticed is None else noticed + 1e-6 * runs.operation.run.step
        yield device, Notice(time=noticed, carried=float(np.max(torque[time <= until])) / normal)
