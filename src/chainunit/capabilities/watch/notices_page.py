"""The section on the load observer: who notices which event, and the estimates over time."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

from ...machines.chain_unit import SIDES
from ...report import blocks as b
from ...report import figure as fig
from ...report import run_names
from ...report.cited import cited, number, quantity_rows
from ...report.lines import filled
from ...report.pictures import Pictures
from ...report.runs import by_side, over_runs
from ...study.record import StudyRecord, StudyRuns
from .notices import DEVICES, ObserverFindings

PICTURES = Pictures()


def blocks(study: StudyRecord) -> Iterator[b.Block]:
    """The table of the notices, the estimates in normal running, and a figure of each event."""
    x = cited(ObserverFindings.of_study(study.findings), "findings.observer")
    if x.notices:
        lead = (
            "Times count from the event. Rocker torque: the largest from the event to the notice, in parts of the {} "
            "of normal running; where a device does not notice the event, the largest in the time followed."
        )
        yield b.Text(filled(lead, number(x.steady.rocker_torque)), "lead")
        yield _who_notices(study.runs, x)
    steady = quantity_rows(x.steady, study.setup.driver_noun)
    yield b.Table(steady, title="The load observer in normal running", form="long")
    yield from PICTURES.figures(study)


def _who_notices(runs: StudyRuns, x: ObserverFindings) -> b.Table:
    """When observer, current and coupling notice each overload, and the side that the observer names."""
    names = by_side(runs, x.notices)

    def rows() -> Iterator[b.TableRow]:
        """Two rows for each device, and one with the side that the observer names."""
        for device, title in DEVICES.items():
            if device in x.notices[names[0]]:
                notices = [x.notices[run][device] for run in names]
                times = (number(notice.time, none="not") for notice in notices)
                yield b.TableRow((f"{title}, after", *times))
                yield b.TableRow(("rocker torque by then", *(number(notice.carried) for notice in notices)))
        sides = []
        for run in names:
            side, loaded = x.named[run], x.loaded[run]
            sides.append(f"{side} (wrong)" if side and loaded not in ("", side) else side or "none")
        yield b.TableRow(("side that the observer names", *sides))

    return over_runs(runs, names, rows(), "Who notices")


_MASS = fig.Axis("feed of a side", "kg")
_FORCE = fig.Axis("processing force", "N")
_SHARE = fig.Axis("imbalance over its threshold", low=-4.0, high=4.0)


@PICTURES.declare(lambda study: ObserverFindings.of_study(study.findings).notices, "observer.png")
def _print(study: StudyRecord) -> fig.Figure:
    """All events beside each other, for print: a column for each, with its title above."""
    columns = []
    for name in ObserverFindings.of_study(study.findings).notices:
        figure = _event(study, name)
        (first, *others) = (panel for (panel,) in figure.panels)
        columns.append([first and replace(first, title=figure.title), *others])
    title = "The load observer in every event"
    panels = tuple(zip(*columns, strict=True))
    return fig.Figure("observers", title, f"{title}: loads and imbalances.", panels, on_page=False)


@PICTURES.declare(lambda study: ObserverFindings.of_study(study.findings).notices)
def _events(study: StudyRecord) -> Iterator[fig.Figure]:
    return (_event(study, name) for name in ObserverFindings.of_study(study.findings).notices)


def _event(study: StudyRecord, name: str) -> fig.Figure:
    """The estimates of an event over time."""
    run, notice = study.runs.series[name], ObserverFindings.of_study(study.findings).notices[name]["observer"]
    time = run["time"].values - study.runs.event_times[name]
    low = max(float(time[0]), -0.5 * math.pi / study.setup.config.run.crank_speed)

    def loads(load: str) -> Iterator[fig.Item]:
        """The estimates of a load of both sides, and the true values."""
        for look, side in enumerate(SIDES):
            yield fig.Curve(f"{side}, estimated", time, run[f"observer.{side}.{load}"].values, look)
            yield fig.Curve("true", time, run[f"machine.{side}.{load}"].values, "path", in_legend=not look)

    def shares() -> Iterator[fig.Item]:
        """The imbalances of feed and force in parts of their thresholds."""
        for look, ground in enumerate(("feed", "force")):
            yield fig.Curve(f"of the {ground}", time, run[f"observer.grounds.{ground}"].values, look + 2)
        yield from (fig.Mark(threshold, axis="y", look="limit") for threshold in (-1.0, 1.0))

    begin = fig.Mark(0.0, "event", look="thin")
    marks = [begin] if notice.time is None else [begin, fig.Mark(notice.time, "alarm")]
    panels = {_MASS: loads("material_mass"), _FORCE: loads("processing_force"), _SHARE: shares()}
    title = run_names.title(study.runs, name)
    return fig.Figure(
        f"observer-{name.replace('_', '-')}",
        title[:1].upper() + title[1:],
        f"Estimated and true feed and processing force of both sides over time, and the imbalances in parts of their "
        f"thresholds: {title}.",
        fig.stacked(
            fig.Axis("time after the event", "s", low=low, high=float(time[-1])),
            ((axis, (*items, *marks)) for axis, items in panels.items()),
        ),
        "An alarm comes where an imbalance passes 1 (left) or -1 (right) times its threshold.",
        half=True,
    )
