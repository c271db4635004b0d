"""The report on a watched recording: loads of both sides over time, and the alarms with their grounds."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ...reading.results import as_data
from ...reading.text import shown_in
from ...recordings.residuals import EXCESS_NOISE
from ...report import blocks as b
from ...report import figure as fig
from ...report.cited import cited, number, table
from ...report.lines import Name, join, line
from ...report.task import Task
from ...study.config import Config
from .result import WatchSummary, summary_of
from .watch import WatchedRecording, watch

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


def watch_report(watched: WatchedRecording) -> b.Report:
    """The report on a watched recording."""
    summary = summary_of(watched)
    result, x = as_data(summary), cited(summary)
    s = b.Source(result)
    with shown_in(watched.config.units):
        return b.Report(
            watched.config.title or "Watched recording",
            "Watch for one-sided overload",
            result,
            tuple(_opening(s, x)),
            (
                b.Section("loads", "Loads of both sides", tuple(_loads(s, x))),
                b.Section("alarms", "Alarms and their grounds", tuple(_alarms(x))),
                b.Section("basis", "Basis of the numbers", tuple(_basis(s, x))),
            ),
            source=s.line("Study file: {source} · chainunit {chainunit}"),
            units=watched.config.units,
            opening_title="The answer",
            status="alarm" if result["alarms"] else "no alarm",
        )


TASK: Task[Config, WatchedRecording] = Task(
    "watch",
    lambda config, folder, progress: watch(config, progress),
    watch_report,
    files=PICTURES,
    content=WatchSummary,
    shortfall=lambda watched: None if watched.is_described else "",
    alarmed=lambda watched: bool(watched.alarms),
)


def _opening(s: b.Source, x: WatchSummary) -> Iterator[b.Block]:
    if not s.result["is_described"]:
        yield b.Judgement(
            "bad",
            line(
                "The machine of this study does not describe the begin of the recording (",
                join(s.lines("doubts"), "; "),
                "): its alarms may be those of a wrong machine. ",
                "If the feed was another one, state it ([feed]), or widen its deviation (watch.feed_deviation)."
                if s.result["of_feed_alone"]
                else "Identify the machine first.",
            ),
        )
    if s.result["failed_identification"]:
        yield b.Judgement(
            "warning",
            s.line(
                "The identification of this machine failed: its model does not describe its recordings. The errors "
                "of the machine are not bounded by those of {identification}."
            ),
        )
    for name, noun in (("signal", "signal"), ("speed", "measured speed")):
        if (number(x.noise[name]).value or 0.0) > EXCESS_NOISE:
            louder = f"The noise of the {noun} at the begin is {{=noise.{name}:2}} times the stated one (watch.noise)"
            yield b.Judgement("warning", s.line(f"{louder}: the thresholds follow from the measured noise."))
    for part in s.lines("constant_parts"):
        more = ": a sensor that is stuck, a stop or a limit. An alarm in this time may be false."
        yield b.Judgement("warning", line(part, more))
    yield b.Judgement("remark", s.line("{file} is read with {understood}."))
    for k in range(len(s.result["gaps"])):
        sentence = f"No rows from {{gaps.{k}.from:4}} to {{gaps.{k}.to:4}}: the observer starts anew behind this gap."
        yield b.Judgement("remark", s.line(sentence))
    if not s.result["alarms"]:
        yield b.Judgement("good", s.line("No alarm in {turns:3} turns ({duration:3})."))
    for k, alarm in enumerate(s.result["alarms"]):
        path = f"alarms.{k}"
        if alarm["in_learning"]:
            yield b.Text(
                s.line(
                    "This alarm is within the time of learning: the recording may begin in an overload, or the "
                    "study's feed is not that of its begin."
                )
            )
        yield b.Judgement(
            "alarm",
            s.line(
                f"Overload of the {{{path}.side}} side from {{{path}.begin:4}} on, by the {{{path}.ground}}."
            ),
        )
    yield b.Text(
        s.line(
            "The thresholds of an alarm follow from the permitted false alarms in a million turns "
            "({=tuning.alarm.rate}). According to the angle of the crank, that of the imbalance of the feed is "
            "{feed_threshold_least:3} to {feed_threshold_most:3}, that of the processing forces "
            "{force_threshold_least:3} to {force_threshold_most:3}."
        )
    )
    named = s.result["identification"] is not None
    if not (number(x.false_imbalance.uncertainty).value or number(x.false_imbalance.force_uncertainty).value):
        remedy = (
            "The identification sought no number of the machine that the observer knows."
            if named
            else "Name the result of an identification (identification) to have their errors in the thresholds."
        )
        yield b.Text(f"The thresholds take the numbers of the machine for exact. {remedy}")
    else:
        sentence = "Errors of the machine's parameters make"
        if named:
            sentence = "The machine's parameters are those of an identification. Their errors make"
        more = (
            "a false imbalance of {uncertainty:2} and {force_uncertainty:2} (standard deviations); the thresholds of "
            "feed and forces are wider by the factors {widening:3} and {force_widening:3}."
        )
        yield b.Text(s.line(f"{sentence} {more}"))


def _series(s: b.Source, name: str) -> Any:
    return np.array([np.nan if x is None else x for x in s.result["course"][name]["value"]])


def _loads(s: b.Source, x: WatchSummary) -> Iterator[b.Block]:
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
    time, axis = _series(s, "time"), fig.Axis("time", "s")
    panels = []
    for name, title, unit in (("material_mass", "feed", "kg"), ("processing_force", "processing force", "N")):
        courses = {side: _series(s, f"{side}.{name}") for side in ("left", "right")}
        low, high = _span(time, list(courses.values()))
        items = [fig.Curve(side, time, x, look) for look, (side, x) in enumerate(courses.items())]
        y = fig.Axis(title, unit, low=low, high=high)
        panels.append((fig.Panel(axis, y, (*_marks(s), *items)),))
    yield fig.Figure(
        "loads",
        "Estimated loads",
        "Feed and processing force of both sides over the recording, with the alarms.",
        tuple(panels),
        file=PICTURES[0],
    )
    panels = []
    for name, title, unit in (("feed", "left less right, feed", "kg"), ("force", "force", "N")):
        x, limit = _series(s, f"imbalance.{name}"), _series(s, f"imbalance.{name}_threshold")
        low, high = _span(time, [x, limit, -limit])
        band = fig.Between("below the threshold", time, -limit, limit, "band")
        y = fig.Axis(title, unit, low=low, high=high)
        panels.append((fig.Panel(axis, y, (*_marks(s), band, fig.Curve("imbalance", time, x, 0))),))
    yield fig.Figure(
        "imbalance",
        "Imbalance and thresholds",
        "The imbalance of feed and forces, and the thresholds of an alarm.",
        tuple(panels),
        file=PICTURES[1],
    )


def _span(time: Any, courses: list[Any]) -> tuple[float, float]:
    """The ends of an axis: of the values after the first tenth of the time, in which the observer settles."""
    settled = time > time[0] + 0.1 * (time[-1] - time[0])
    values = np.concatenate([x[settled] for x in courses])
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    wide = 0.1 * (high - low) or 1.0
    return low - wide, high + wide


def _marks(s: b.Source) -> Iterator[fig.Shade]:
    """The times of the alarms."""
    named = set[str]()
    for alarm in s.result["alarms"]:
        name = f"alarm, {alarm['side']}"
        ends = alarm["begin"]["value"], alarm["end"]["value"]
        yield fig.Shade(*ends, "" if name in named else name, look=f"{alarm['side']} alarm")
        named.add(name)


def _alarms(x: WatchSummary) -> Iterator[b.Block]:
    if not x.alarms:
        yield b.Text("There is none.")
    yield from table(
        x.alarms,
        ("side", lambda alarm: alarm.side),
        ("from", lambda alarm: number(alarm.begin, 5)),
        ("to", lambda alarm: "the end" if alarm.lasts else number(alarm.end, 5)),
        ("ground", lambda alarm: alarm.ground),
        (b.Column("largest at", form="long"), lambda alarm: number(alarm.at, 5)),
        (
            b.Column("imbalance of the feed", "imbalance"),
            lambda alarm: number(alarm.values["imbalance.feed"], 3),
        ),
        ("threshold", lambda alarm: number(alarm.values["imbalance.feed_threshold"], 3)),
        (
            b.Column("imbalance of the forces", "forces", form="long"),
            lambda alarm: number(alarm.values["imbalance.force"], 3),
        ),
        (
            b.Column("threshold", form="long"),
            lambda alarm: number(alarm.values["imbalance.force_threshold"], 3),
        ),
        (b.Column("rocker torque", form="long"), lambda alarm: number(alarm.values["rocker.tau"], 3)),
        title="Alarms, with the values at the largest imbalance in parts of its threshold",
    )


def _basis(s: b.Source, x: WatchSummary) -> Iterator[b.Block]:
    yield b.Text(
        s.line(
            "Angle, zero and loads were learned in the first {=learning}. Alarms of one side with less than two "
            "turns between them are one."
        ),
        "note",
    )
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
    yield b.Text(line("Recording: ", s.words("file")), "fine", "long")
