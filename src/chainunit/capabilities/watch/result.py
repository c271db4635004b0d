"""The result of a watched recording as data: the content of result.json."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ...machines.load_observer import LoadObserver
from ...reading.results import as_data
from ...reading.text import array_entry, entry, shown_in
from ...recordings.fit import fitted_entries
from ...study.heading import Heading
from .watch import GAP, OUTPUTS, Alarm, WatchedRecording, file_name

ROWS = 1500
"""Most rows of a course in the result."""
GROUNDS = {"feed": "imbalance of the feed", "force": "imbalance of the processing forces"}


def as_dict(watched: WatchedRecording) -> dict[str, Any]:
    """All results, ready for JSON, each number with its unit."""
    with shown_in(watched.config.units):
        return _as_dict(watched)


def _as_dict(watched: WatchedRecording) -> dict[str, Any]:
    config, plan, recording = watched.config, watched.plan, watched.recording
    p = watched.parameters
    return {
        **as_data(Heading.of(config.title, config.file)),
        "file": str(plan.file),
        "columns": list(recording.columns),
        "duration": entry(float(recording.time[-1] - recording.time[0]), "s"),
        "turns": entry(float(recording.time[-1] - recording.time[0]) / watched.plan.turn, "1"),
        "crank_speed": entry(plan.crank_speed, "rad/s", "speed"),
        "learning": entry(plan.learning, "s"),
        "learned": dict(_learned(watched)),
        "is_described": watched.is_described,
        "residuals": [
            {
                "column": each.column,
                "is_noise": each.is_noise,
                "reason": each.reason,
                "statistic": entry(each.statistic, "1"),
                "limit": entry(each.limit, "1"),
            }
            for each in watched.residual_tests
        ],
        "doubts": [
            *(
                f"order {each.orders[0][0]} of the crank remains in {each.column}"
                if each.reason == "orders"
                else f"slow changes remain in {each.column}"
                for each in watched.residual_tests
                if not each.is_noise
            ),
            *map(str, watched.prior_conflicts),
        ],
        "of_feed_alone": watched.only_feed_differs,
        "alarms": [_alarm(watched, each) for each in watched.alarms],
        **_thresholds(watched),
        "uncertainty": entry(watched.uncertainty[0], "kg"),
        "force_uncertainty": entry(watched.uncertainty[1], "N"),
        "widening": entry(watched.widening[0], "1"),
        "force_widening": entry(watched.widening[1], "1"),
        "noise": {name: entry(x, "1") for name, x in zip(("signal", "speed"), watched.noises, strict=True)},
        "constant_parts": watched.constant_parts,
        "gaps": [
            {"from": entry(begin, "s"), "to": entry(end, "s")}
            for begin, end in recording.gaps
            if end - begin > GAP * watched.plan.turn
        ],
        "failed_identification": watched.failed,
        "identification": None if plan.identification is None else str(plan.identification),
        "tuning": {
            v.name: entry(p.get(v.name, v.quantity.start), v.unit, v.kind)
            for v in LoadObserver.parameter_layout.variables
            if v.name.split(".")[0] in ("noise", "feed", "force", "offset", "imbalance", "alarm")
        },
        "usual": dict(_usual(watched)),
        "course": _course(watched),
    }


def _learned(watched: WatchedRecording) -> Iterator[tuple[str, dict[str, Any]]]:
    """The numbers that were learned from the begin of the recording, without the orders of a motion."""
    for unknown, each in fitted_entries(watched.problem, watched.learned):
        if ".order." not in unknown.name:
            yield file_name(unknown.name), each


def _thresholds(watched: WatchedRecording) -> dict[str, Any]:
    """The range of the thresholds over the crank angle, after the time of learning."""
    time = watched.recording.time
    rows = time > time[0] + watched.plan.learning
    ranges = dict[str, Any]()
    for name, unit in (("feed", "kg"), ("force", "N")):
        ends = np.percentile(watched.outputs[f"imbalance.{name}_threshold"][rows], [2.0, 98.0])
        ranges |= {
            f"{name}_threshold_{end}": entry(float(x), unit)
            for end, x in zip(("least", "most"), ends, strict=True)
        }
    return ranges


def _alarm(watched: WatchedRecording, each: Alarm) -> dict[str, Any]:
    units = _units()
    start = float(watched.recording.time[0])
    return {
        "side": each.side,
        "ground": GROUNDS[each.ground],
        "begin": entry(each.begin, "s"),
        "end": entry(each.end, "s"),
        "lasts": each.lasts,
        "in_learning": each.begin - start < watched.plan.learning,
        "turn": entry((each.begin - start) / watched.plan.turn, "1"),
        "at": entry(each.at, "s"),
        "values": {name: entry(x, units[name]) for name, x in each.values.items()},
    }


def _usual(watched: WatchedRecording) -> Iterator[tuple[str, dict[str, Any]]]:
    """The medians of the outputs after the time of learning and before the first alarm, with those of their standard
    deviations and thresholds."""
    time, units = watched.recording.time, _units()
    end = watched.alarms[0].begin if watched.alarms else float(time[-1])
    rows = (time > time[0] + watched.plan.learning) & (time <= end)
    if not rows.any():
        return

    def median(name: str) -> float | None:
        return float(np.median(watched.outputs[name][rows])) if name in watched.outputs else None

    for name in OUTPUTS:
        if not name.endswith(("_deviation", "_threshold")):
            yield (
                name,
                {
                    "value": entry(median(name), units[name]),
                    "deviation": entry(median(f"{name}_deviation"), units[name]),
                    "threshold": entry(median(f"{name}_threshold"), units[name]),
                },
            )


def _course(watched: WatchedRecording) -> dict[str, Any]:
    """The outputs of the observer over time, at a part of the rows."""
    every = max(1, -(-len(watched.recording.time) // ROWS))
    units = _units()
    return {"time": array_entry(watched.recording.time[::every], "s")} | {
        name: array_entry(watched.outputs[name][::every], units[name]) for name in OUTPUTS
    }


def _units() -> dict[str, str]:
    """The units of the outputs and states of the observer."""
    layouts = [*(part.layout for part in LoadObserver.parts), LoadObserver.state_layout]
    return {v.name: v.unit for layout in layouts if layout is not None for v in layout.variables}
