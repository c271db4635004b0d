"""The result of a watched recording as data: the content of result.json."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ...core.quantities import quantity
from ...machines.load_observer import LoadObserver
from ...reading.results import InUnit, part, result
from ...reading.text import shown_in
from ...recordings.fit import FittedValue, fitted_values
from ...recordings.inspection import constant_parts
from ...recordings.problem import speed_column
from ...recordings.residuals import ResidualTest, describes, prior_conflicts, sensor_conflicts
from ...study.provenance import Heading
from .watch import GAP, GROUNDS, OUTPUTS, Alarm, Begin, WatchedRecording, columns_watched, declared_outputs

ROWS = 1500
"""Most rows of a course in the result."""


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

    @classmethod
    def from_recording(cls, watched: WatchedRecording) -> WatchedFile:
        """The file of a watched recording."""
        plan, recording = watched.plan, watched.recording
        duration = float(recording.time[-1]) - float(recording.time[0])
        return cls(
            file=str(plan.file),
            understood=recording.understood,
            columns=list(recording.columns),
            duration=duration,
            turns=duration / plan.turn,
            crank_speed=plan.crank_speed,
            learning=plan.table.learning,
        )


@result
class Thresholds:
    """The range of the thresholds over the crank angle, after the time of learning, and how far they are wider by the
    false imbalance that errors of the machine's parameters make."""

    feed_threshold_least: float = quantity("kg", "imbalance of the feed, least threshold")
    feed_threshold_most: float = quantity("kg", "imbalance of the feed, largest threshold")
    force_threshold_least: float = quantity("N", "imbalance of the forces, least threshold")
    force_threshold_most: float = quantity("N", "imbalance of the forces, largest threshold")
    uncertainty: float = quantity("kg", "false imbalance of the feed by errors of the machine's parameters")
    force_uncertainty: float = quantity(
        "N", "false imbalance of the forces by errors of the machine's parameters"
    )
    widening: float = quantity("1", "factor by which the thresholds of the feed are wider for it")
    force_widening: float = quantity("1", "factor by which the thresholds of the forces are wider for it")

    @classmethod
    def from_recording(cls, watched: WatchedRecording, settled: Any) -> Thresholds:
        """The thresholds at the `settled` rows, without the outermost 2 % of them at either end."""
        columns = (watched.outputs[f"imbalance.{ground}_threshold"][settled] for ground in GROUNDS)
        (feed_least, feed_most), (force_least, force_most) = (
            map(float, np.percentile(column, [2.0, 98.0])) for column in columns
        )
        return cls(feed_least, feed_most, force_least, force_most, *watched.uncertainty, *watched.widening)


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

    watched: WatchedRecording
    heading: Heading = part(inline=True)
    recording: WatchedFile = part(inline=True)
    learned: Mapping[str, FittedValue] = part("numbers that were learned from the begin of the recording")
    is_described: bool = part("whether the machine of the study describes the begin of the recording")
    residuals: tuple[ResidualTest, ...] = part("tests of the residuals at the begin")
    doubts: list[str] = part("why the machine of the study does not describe the begin")
    of_feed_alone: bool = part("whether nothing but another feed speaks against the machine of the study")
    alarms: tuple[Alarm, ...] = part("the alarms in order")
    thresholds: Thresholds = part(inline=True)
    noise: Mapping[str, float] = part("noise of signal and speed over the stated noise", unit="1")
    constant_parts: list[str] = part("parts in which a column keeps a value, in words")
    gaps: list[Gap] = part("parts without rows, behind which the observer starts anew")
    failed_identification: bool = part("whether the identification of this machine failed")
    identification: str | None = part("the result of the identification")
    tuning: Mapping[str, InUnit] = part("parameters of the observer")
    usual: Mapping[str, UsualOutput] = part("outputs between the time of learning and the first alarm")
    course: Mapping[str, InUnit] = part("outputs of the observer over time, at a part of the rows")


def summary_of(watched: WatchedRecording) -> WatchSummary:
    """All results of a watched recording, with texts in the units of the study; its rows are `settled` after the time
    of learning."""
    plan, recording, begin = watched.plan, watched.recording, watched.begin
    settled = recording.time > float(recording.time[0]) + plan.table.learning
    loads = {load.name for load in begin.problem.sought}
    columns = *columns_watched(recording).values(), speed_column(recording)
    with shown_in(watched.config.units):
        return WatchSummary(
            watched=watched,
            heading=Heading.of(watched.config.title, watched.config.file),
            recording=WatchedFile.from_recording(watched),
            learned={
                _file_name(unknown.name): fitted
                for unknown, fitted in fitted_values(begin.problem, begin.fit)
                # without the orders of a motion
                if ".order." not in unknown.name
            },
            is_described=begin.is_described,
            residuals=begin.tests,
            doubts=list(_doubts(begin)),
            of_feed_alone=not begin.is_described and describes(begin.problem, begin.fit, begin.tests, loads),
            alarms=watched.alarms,
            thresholds=Thresholds.from_recording(watched, settled),
            noise=dict(zip(("signal", "speed"), begin.noises, strict=True)),
            constant_parts=list(constant_parts(recording, [name for name in columns if name])),
            gaps=[Gap(*ends) for ends in recording.gaps if ends[1] - ends[0] > GAP * plan.turn],
            failed_identification=watched.failed,
            identification=None if plan.identification is None else str(plan.identification),
            tuning={
                v.name: InUnit(watched.parameters.get(v.name, v.quantity.start), v.unit, v.kind)
                for v in LoadObserver.parameter_layout.variables
                if v.name.split(".")[0] in ("noise", "feed", "force", "offset", "imbalance", "alarm")
            },
            usual=dict(_usual(watched, settled)),
            course=_course(watched),
        )


def _course(watched: WatchedRecording) -> dict[str, InUnit]:
    """Time and outputs at evenly spaced rows, at most `ROWS`."""
    time, declared = watched.recording.time, declared_outputs()
    thinned = slice(None, None, max(1, math.ceil(len(time) / ROWS)))
    outputs = {name: InUnit(watched.outputs[name][thinned], declared[name].unit) for name in OUTPUTS}
    return {"time": InUnit(time[thinned], "s"), **outputs}


def _file_name(name: str) -> str:
    """The name in the study file of a load that is learned."""
    return name.replace("machine.", "feed.", 1)


def _doubts(begin: Begin) -> Iterator[str]:
    """Why the machine of the study does not describe the begin: an open fit, residuals that are no noise, and numbers
    of clock and sensors that are not as they are known, and feeds that are not as stated."""
    if not begin.fit.is_ended:
        yield "the fit still improved in its last round"
    for test in begin.tests:
        if not test.is_noise:
            is_order = test.reason == "orders"
            remains = f"order {test.orders[0][0]} of the crank remains" if is_order else "slow changes remain"
            yield f"{remains} in {test.column}"
    yield from map(str, sensor_conflicts(begin.problem, begin.fit))
    for conflict in prior_conflicts(begin.problem.sought, begin.fit):
        yield str(replace(conflict, name=_file_name(conflict.name)))


def _usual(watched: WatchedRecording, settled: Any) -> Iterator[tuple[str, UsualOutput]]:
    """The medians of the outputs at the `settled` rows up to the first alarm, with standard deviations and
    thresholds."""
    time, declared = watched.recording.time, declared_outputs()
    rows = settled & (time <= (watched.alarms[0].begin if watched.alarms else time[-1]))
    if not rows.any():
        return

    def median(name: str, unit: str) -> InUnit:
        x = float(np.median(watched.outputs[name][rows])) if name in watched.outputs else None
        return InUnit(x, unit)

    for name in OUTPUTS:
        if not name.endswith(("_deviation", "_threshold")):
            names = (f"{name}{kind}" for kind in ("", "_deviation", "_threshold"))
            yield name, UsualOutput(*(median(column, declared[name].unit) for column in names))
