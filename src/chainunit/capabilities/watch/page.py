"""The report on a watched recording: loads of both sides over time, and the alarms with their grounds."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from ...reading.results import as_data
from ...reading.text import shown_in
from ...recordings.residuals import EXCESS_NOISE
from ...report import blocks as b
from ...report import figure as fig
from ...report.cited import cited, exact, number, source_line, table
from ...report.lines import Name, Number, filled, join, line
from ...report.task import Task
from ...study.config import Config
from .result import WatchSummary, summary_of
from .watch import Alarm, watch

PICTURES = ("loads.png", "imbalance.png")
_USUAL = {
    "left.material_mass": "feed, left",
    "right.material_mass": "feed, right",
    "imbalance.feed": "imbalance of the feed",
    "left.processing_force": "processing force, left",
    "right.processing_force": "processing force, right",
    "imbalance.force": "imbalance of the forces",
    "rocker.tau": "rocker torque",
    "left.web_pull": "web end pull, left",
    "right.web_pull": "web end pull, right",
}
"""The rows of the table of usual values."""


def watch_report(summary: WatchSummary) -> b.Report:
    """The report on a watched recording."""
    x, config = cited(summary), summary.watched.config
    with shown_in(config.units):
        return b.Report(
            config.title or "Watched recording",
            "Watch for one-sided overload",
            as_data(summary),
            tuple(_opening(x)),
            (
                b.Section("loads", "Loads of both sides", tuple(_loads(x, summary))),
                b.Section("alarms", "Alarms and their grounds", tuple(_alarms(x))),
                b.Section("basis", "Basis of the numbers", tuple(_basis(x))),
            ),
            source=source_line(x.heading),
            units=config.units,
            opening_title="The answer",
            status="alarm" if summary.alarms else "no alarm",
        )


TASK: Task[Config, WatchSummary] = Task(
    "watch",
    lambda config, folder, progress: summary_of(watch(config, progress)),
    watch_report,
    files=PICTURES,
    content=WatchSummary,
    shortfall=lambda summary: None if summary.is_described else "",
    alarmed=lambda summary: bool(summary.alarms),
)


def _opening(x: WatchSummary) -> Iterator[b.Block]:
    """The answer: the alarms, or that there is none, after all that makes them doubtful."""
    yield from _cautions(x)
    if not x.alarms:
        turns, duration = number(x.recording.turns, 3), number(x.recording.duration, 3)
        yield b.Judgement("good", filled("No alarm in {} turns ({}).", turns, duration))
    for alarm in x.alarms:
        if alarm.in_learning:
            yield b.Text(
                "This alarm is within the time of learning: the recording may begin in an overload, or the study's "
                "feed is not that of its begin."
            )
        overload = "Overload of the {} side from {} on, by the {}."
        yield b.Judgement("alarm", filled(overload, alarm.side, number(alarm.begin, 4), alarm.imbalance))
    yield from _limits(x)


def _cautions(x: WatchSummary) -> Iterator[b.Block]:
    """What the engineer has to know of recording and machine before the alarms."""
    if not x.is_described:
        remedy = "Identify the machine first."
        if x.of_feed_alone:
            remedy = "If the feed was another one, state it ([feed]), or widen its deviation (watch.feed_deviation)."
        doubt = (
            "The machine of this study does not describe the begin of the recording ({}): its alarms may be those of "
            "a wrong machine. {}"
        )
        yield b.Judgement("bad", filled(doubt, join(x.doubts, "; "), remedy))
    if x.failed_identification:
        failed = (
            "The identification of this machine failed: its model does not describe its recordings. The errors of "
            "the machine are not bounded by those of {}."
        )
        yield b.Judgement("warning", filled(failed, x.identification or ""))
    for name, noun in (("signal", "signal"), ("speed", "measured speed")):
        noise = exact(x.noise[name], 2)
        if (noise.value or 0.0) > EXCESS_NOISE:
            louder = f"The noise of the {noun} at the begin is {{}} times the stated one (watch.noise)"
            more = ": the thresholds follow from the measured noise."
            yield b.Judgement("warning", filled(louder + more, noise))
    for part in x.constant_parts:
        more = ": a sensor that is stuck, a stop or a limit. An alarm in this time may be false."
        yield b.Judgement("warning", line(part, more))
    yield b.Judgement("remark", filled("{} is read with {}.", x.recording.file, x.recording.understood))
    for gap in x.gaps:
        rows = "No rows from {} to {}: the observer starts anew behind this gap."
        yield b.Judgement("remark", filled(rows, number(gap.begin, 4), number(gap.end, 4)))


def _limits(x: WatchSummary) -> Iterator[b.Block]:
    """On what the thresholds rest."""
    limits, is_identified = x.thresholds, x.identification is not None
    ends = (
        limits.feed_threshold_least,
        limits.feed_threshold_most,
        limits.force_threshold_least,
        limits.force_threshold_most,
    )
    sentences = (
        "The thresholds of an alarm follow from the permitted false alarms in a million turns ({}). According to the "
        "angle of the crank, that of the imbalance of the feed is {} to {}, that of the processing forces {} to {}."
    )
    yield b.Text(filled(sentences, exact(x.tuning["alarm.rate"]), *(number(end, 3) for end in ends)))
    deviations = number(limits.uncertainty, 2), number(limits.force_uncertainty, 2)
    if not any(deviation.value for deviation in deviations):
        remedy = (
            "Name the result of an identification (identification) to have their errors in the thresholds."
        )
        if is_identified:
            remedy = "The identification sought no number of the machine that the observer knows."
        yield b.Text(f"The thresholds take the numbers of the machine for exact. {remedy}")
        return
    cause = "Errors of the machine's parameters make"
    if is_identified:
        cause = "The machine's parameters are those of an identification. Their errors make"
    effect = (
        " a false imbalance of {} and {} (standard deviations); the thresholds of feed and forces are wider by the "
        "factors {} and {}."
    )
    factors = number(limits.widening, 3), number(limits.force_widening, 3)
    yield b.Text(filled(cause + effect, *deviations, *factors))


def _loads(x: WatchSummary, summary: WatchSummary) -> Iterator[b.Block]:
    """The usual estimates, and the figures of estimates and thresholds over time."""
    usual = [(quantity, x.usual[name]) for name, quantity in _USUAL.items() if name in x.usual]
    yield from table(
        usual,
        ("quantity", lambda row: row[0]),
        ("median", lambda row: number(row[1].value, 3)),
        ("deviation of the filter", lambda row: number(row[1].deviation, 3)),
        ("threshold of an alarm", lambda row: number(row[1].threshold, 3)),
        title="Estimates after the time of learning and before the first alarm",
    )
    if usual:
        yield b.Text(
            "The deviation of the filter is that of loads that change as fast as it follows (observer.change). "
            "Normal running scatters less; the threshold follows from that smaller deviation.",
            "note",
        )
    course = {name: np.asarray(values.value, float) for name, values in summary.course.items()}
    time, marks = course["time"], tuple(_marks(summary))
    panels = []
    for name, title, unit in (("material_mass", "feed", "kg"), ("processing_force", "processing force", "N")):
        sides = {side: course[f"{side}.{name}"] for side in ("left", "right")}
        curves = (fig.Curve(side, time, load, look) for look, (side, load) in enumerate(sides.items()))
        panels.append(_panel(title, unit, time, list(sides.values()), (*marks, *curves)))
    yield fig.Figure(
        "loads",
        "Estimated loads",
        "Feed and processing force of both sides over the recording, with the alarms.",
        tuple(panels),
        file=PICTURES[0],
    )
    panels = []
    for name, title, unit in (("feed", "left less right, feed", "kg"), ("force", "force", "N")):
        imbalance, limit = course[f"imbalance.{name}"], course[f"imbalance.{name}_threshold"]
        band = fig.Between("below the threshold", time, -limit, limit, "band")
        curve = fig.Curve("imbalance", time, imbalance, 0)
        panels.append(_panel(title, unit, time, [imbalance, limit, -limit], (*marks, band, curve)))
    yield fig.Figure(
        "imbalance",
        "Imbalance and thresholds",
        "The imbalance of feed and forces, and the thresholds of an alarm.",
        tuple(panels),
        file=PICTURES[1],
    )


def _panel(
    title: str, unit: str, time: Any, courses: list[Any], items: tuple[fig.Item, ...]
) -> tuple[fig.Panel]:
    """A panel over the time, whose axis shows the courses after the first tenth, in which the observer settles."""
    settled = time > time[0] + 0.1 * (time[-1] - time[0])
    values = np.concatenate([course[settled] for course in courses])
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    wide = 0.1 * (high - low) or 1.0
    axis = fig.Axis(title, unit, low=low - wide, high=high + wide)
    return (fig.Panel(fig.Axis("time", "s"), axis, items),)


def _marks(summary: WatchSummary) -> Iterator[fig.Shade]:
    """The times of the alarms."""
    named = set[str]()
    for alarm in summary.alarms:
        name = f"alarm, {alarm.side}"
        yield fig.Shade(alarm.begin, alarm.end, "" if name in named else name, look=f"{alarm.side} alarm")
        named.add(name)


def _alarms(x: WatchSummary) -> Iterator[b.Block]:
    """A row for each alarm, with the outputs of the observer where the imbalance is largest."""
    if not x.alarms:
        yield b.Text("There is none.")

    def output(name: str) -> Callable[[Alarm], Number]:
        return lambda alarm: number(alarm.outputs[name], 3)

    yield from table(
        x.alarms,
        ("side", lambda alarm: alarm.side),
        ("from", lambda alarm: number(alarm.begin, 5)),
        ("to", lambda alarm: "the end" if alarm.lasts else number(alarm.end, 5)),
        ("ground", lambda alarm: alarm.imbalance),
        (b.Column("largest at", form="long"), lambda alarm: number(alarm.at, 5)),
        (b.Column("imbalance of the feed", "imbalance"), output("imbalance.feed")),
        ("threshold", output("imbalance.feed_threshold")),
        (b.Column("imbalance of the forces", "forces", form="long"), output("imbalance.force")),
        (b.Column("threshold", form="long"), output("imbalance.force_threshold")),
        (b.Column("rocker torque", form="long"), output("rocker.tau")),
        title="Alarms, with the values at the largest imbalance in parts of its threshold",
    )


def _basis(x: WatchSummary) -> Iterator[b.Block]:
    """The numbers that were learned at the begin, and the tuning of the observer."""
    learned = (
        "Angle, zero and loads were learned in the first {}. Alarms of one side with less than two turns between "
        "them are one."
    )
    yield b.Text(filled(learned, exact(x.recording.learning)), "note")
    yield from table(
        x.learned.items(),
        ("learned number", lambda row: Name(row[0])),
        ("value", lambda row: number(row[1].value, 4)),
        ("standard deviation by noise", lambda row: number(row[1].deviation, 2)),
        title="Learned from the begin",
        form="long",
    )
    yield from table(
        x.tuning.items(),
        ("parameter", lambda row: Name(row[0])),
        ("value", lambda row: number(row[1], 4)),
        title="Tuning of the observer",
        form="long",
    )
    yield b.Text(line("Recording: ", x.recording.file), "fine", "long")
