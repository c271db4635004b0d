"""The result of a watched recording as data: the content of result.json."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from ...core.quantities import Variable, quantity
from ...machines.load_observer import LoadObserver
from ...reading.results import InUnit, part, result
from ...reading.text import shown_in
from ...recordings.fit import FittedValue, fitted_values
from ...recordings.residuals import ResidualTest
from ...study.provenance import Heading
from .watch import GAP, OUTPUTS, Alarm, WatchedRecording, file_name

ROWS = 1500
"""Most rows of a course in the result."""
GROUNDS = {"feed": "imbalance of the feed", "force": "imbalance of the processing forces"}


@result
class WatchedFile:
    """The recording, and the time of learning."""

    file: str = part("the recording")
    understood: str = part("how the file of the recording was read")
    columns: list[str] = part("columns of the recording")
    duration: float = quantity("s", "time from the first to the last row")
    turns: float = quantity("1", "turns of the crank")
    crank_speed: float = quantity("rad/s", "speed of the crank", kind="speed")
    learning: float = quantity("s", "time from the begin in which the observer learns")


@result
class ReportedAlarm:
    """An alarm."""

    side: str = part("side that is overloaded")
    ground: str = part("the imbalance on which it rests")
    begin: float = quantity("s", "its begin")
    end: float = quantity("s", "its end")
    lasts: bool = part("whether it lasts up to the end of the recording")
    in_learning: bool = part("whether it begins in the time of learning")
    turn: float = quantity("1", "turns of the crank before its begin")
    at: float = quantity("s", "time at which its statistic is largest")
    values: Mapping[str, InUnit] = part("outputs of the observer at this time")


@result
class Thresholds:
    """The range of the thresholds over the crank angle, after the time of learning."""

    feed_threshold_least: float = quantity("kg", "imbalance of the feed, least threshold")
    feed_threshold_most: float = quantity("kg", "imbalance of the feed, largest threshold")
    force_threshold_least: float = quantity("N", "imbalance of the forces, least threshold")
    force_threshold_most: float = quantity("N", "imbalance of the forces, largest threshold")


@result
class FalseImbalance:
    """The false imbalance by errors of the machine's parameters."""

    uncertainty: float = quantity("kg", "false imbalance of the feed by errors of the machine's parameters")
    force_uncertainty: float = quantity(
        "N", "false imbalance of the forces by errors of the machine's parameters"
    )
    widening: float = quantity("1", "factor by which the thresholds of the feed are wider for it")
    force_widening: float = quantity("1", "factor by which the thresholds of the forces are wider for it")


@result
class Gap:
    """A part of the recording without rows."""

    begin: float = part("its begin", unit="s", name="from")
    end: float = part("its end", unit="s", name="to")


@result
class UsualOutput:
    """The medians of an output of the observer without an alarm."""

    value: InUnit = part("median of the output")
    deviation: InUnit = part("median of its standard deviation")
    threshold: InUnit = part("median of its threshold")


@result
class WatchSummary:
    """The alarms and their basis: the content of a watch's result.json."""

    heading: Heading = part(inline=True)
    recording: WatchedFile = part(inline=True)
    learned: Mapping[str, FittedValue] = part("numbers that were learned from the begin of the recording")
    is_described: bool = part("whether the machine of the study describes the begin of the recording")
    residuals: tuple[ResidualTest, ...] = part("tests of the residuals at the begin")
    doubts: list[str] = part("why the machine of the study does not describe the begin")
    of_feed_alone: bool = part("whether nothing but another feed speaks against the machine of the study")
    alarms: list[ReportedAlarm] = part("the alarms in order")
    thresholds: Thresholds = part(inline=True)
    false_imbalance: FalseImbalance = part(inline=True)
    noise: Mapping[str, float] = part("noise of signal and speed over the stated noise", unit="1")
    constant_parts: list[str] = part("parts in which a column keeps a value, in words")
    gaps: list[Gap] = part("parts without rows, behind which the observer starts anew")
    failed_identification: bool = part("whether the identification of this machine failed")
    identification: str | None = part("the result of the identification")
    tuning: Mapping[str, InUnit] = part("parameters of the observer")
    usual: Mapping[str, UsualOutput] = part("outputs between the time of learning and the first alarm")
    course: Mapping[str, InUnit] = part("outputs of the observer over time, at a part of the rows")


def summary_of(watched: WatchedRecording) -> WatchSummary:
    """All results of a watched recording, with texts in the units of the study."""
    with shown_in(watched.config.units):
        return _summary(watched)


def _summary(watched: WatchedRecording) -> WatchSummary:
    plan, recording, p = watched.plan, watched.recording, watched.parameters
    duration = float(recording.time[-1] - recording.time[0])
    return WatchSummary(
        heading=Heading.of(watched.config.title, watched.config.file),
        recording=WatchedFile(
            file=str(plan.file),
            understood=recording.understood,
            columns=list(recording.columns),
            duration=duration,
            turns=duration / plan.turn,
            crank_speed=plan.crank_speed,
            learning=plan.learning,
        ),
        learned={
            file_name(unknown.name): fitted
            for unknown, fitted in fitted_values(watched.problem, watched.learned)
            # without the orders of a motion
            if ".order." not in unknown.name
        },
        is_described=watched.is_described,
        residuals=watched.residual_tests,
        doubts=[
            *(() if watched.learned.is_ended else ("the fit still improved in its last round",)),
            *(
                f"order {test.orders[0][0]} of the crank remains in {test.column}"
                if test.reason == "orders"
                else f"slow changes remain in {test.column}"
                for test in watched.residual_tests
                if not test.is_noise
            ),
            *map(str, watched.prior_conflicts),
        ],
        of_feed_alone=watched.only_feed_differs,
        alarms=[_alarm(watched, alarm) for alarm in watched.alarms],
        thresholds=_thresholds(watched),
        false_imbalance=FalseImbalance(*watched.uncertainty, *watched.widening),
        noise=dict(zip(("signal", "speed"), watched.noises, strict=True)),
        constant_parts=watched.constant_parts,
        gaps=[Gap(begin, end) for begin, end in recording.gaps if end - begin > GAP * plan.turn],
        failed_identification=watched.failed,
        identification=None if plan.identification is None else str(plan.identification),
        tuning={
            v.name: InUnit(p.get(v.name, v.quantity.start), v.unit, v.kind)
            for v in LoadObserver.parameter_layout.variables
            if v.name.split(".")[0] in ("noise", "feed", "force", "offset", "imbalance", "alarm")
        },
        usual=dict(_usual(watched)),
        course=_course(watched),
    )


def _thresholds(watched: WatchedRecording) -> Thresholds:
    time = watched.recording.time
    rows = time > time[0] + watched.plan.learning
    ends = (
        np.percentile(watched.outputs[f"imbalance.{name}_threshold"][rows], [2.0, 98.0])
        for name in ("feed", "force")
    )
    return Thresholds(*(float(x) for pair in ends for x in pair))


def _alarm(watched: WatchedRecording, alarm: Alarm) -> ReportedAlarm:
    units, after = _units(), alarm.begin - float(watched.recording.time[0])
    return ReportedAlarm(
        side=alarm.side,
        ground=GROUNDS[alarm.ground],
        begin=alarm.begin,
        end=alarm.end,
        lasts=alarm.lasts,
        in_learning=after < watched.plan.learning,
        turn=after / watched.plan.turn,
        at=alarm.at,
        values={name: InUnit(x, units[name]) for name, x in alarm.values.items()},
    )


def _usual(watched: WatchedRecording) -> Iterator[tuple[str, UsualOutput]]:
    """The medians of the outputs after the time of learning and before the first alarm, with standard deviations and
    thresholds."""
    time, units = watched.recording.time, _units()
    end = watched.alarms[0].begin if watched.alarms else float(time[-1])
    rows = (time > time[0] + watched.plan.learning) & (time <= end)
    if not rows.any():
        return

    def median(name: str, unit: str) -> InUnit:
        x = float(np.median(watched.outputs[name][rows])) if name in watched.outputs else None
        return InUnit(x, unit)

    for name in OUTPUTS:
        if not name.endswith(("_deviation", "_threshold")):
            names = (f"{name}{kind}" for kind in ("", "_deviation", "_threshold"))
            yield name, UsualOutput(*(median(column, units[name]) for column in names))


def _course(watched: WatchedRecording) -> dict[str, InUnit]:
    """The outputs of the observer over time, at a part of the rows."""
    every = max(1, -(-len(watched.recording.time) // ROWS))
    units = _units()
    return {"time": InUnit(watched.recording.time[::every], "s")} | {
        name: InUnit(watched.outputs[name][::every], units[name]) for name in OUTPUTS
    }


def _units() -> dict[str, str]:
    """The units of the outputs and states of the observer."""
    return {name: v.unit for name, v in declared_outputs().items()}


def declared_outputs() -> dict[str, Variable]:
    """The declarations of the outputs and states of the observer, by name."""
    layouts = [*(block.layout for block in LoadObserver.parts), LoadObserver.state_layout]
    return {v.name: v for layout in layouts if layout is not None for v in layout.variables}
