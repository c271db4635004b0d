"""The plots of the page, by plotly: the same lines as in print, to zoom into."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import plotly.graph_objects as go  # type: ignore[import-untyped]
from plotly.subplots import make_subplots  # type: ignore[import-untyped]

from ..drives.dc_motor import DcMotor
from ..engines import numpy_
from ..machines.chain_unit import SIDES, ChamberForces
from ..studies.bearings import PINS
from ..studies.chain import HIGH
from ..studies.shaft import RIGID
from ..studies.study import Study
from .style import LINES, WIDE

COASTING = "_coasting"
"""Ends the name of a run of the machine alone, behind the safety coupling that opened in the run named before it."""
_TITLES = {
    "start_up": "start-up and steady running",
    "steady": "steady running",
    "unfinished": "the run that stopped early",
}

_DASH = {
    "-": "solid",
    "--": "dash",
    "-.": "dashdot",
    ":": "dot",
    (0, (8, 3)): "longdash",
    (0, (8, 3, 2, 3)): "longdashdot",
    (0, (1, 3)): "2px 6px",
    (0, (6, 2, 1, 2, 1, 2)): "12px 3px 2px 3px 2px 3px",
}


def _as_in_print(line: dict[str, Any]) -> dict[str, Any]:
    return {"color": line["color"], "width": line["linewidth"] + 0.2, "dash": _DASH[line["linestyle"]]}


_STYLES: list[dict[str, Any]] = [_as_in_print(line) for line in LINES]
_INK = "#1b1b1b"
_LIMIT = {"color": "#777777", "width": 3.5}
_MARK = {"color": "#555555", "width": 1.2, "dash": "dash"}
_AXIS = {
    "gridcolor": "#e4e4e4",
    "zerolinecolor": "#a8a8a8",
    "zerolinewidth": 1,
    "linecolor": "#666666",
    "showline": True,
    "ticks": "outside",
    "tickcolor": "#666666",
    "title": {"standoff": 8, "font": {"size": 13}},
    "automargin": True,
    "exponentformat": "power",
    "separatethousands": True,
}
_TEMPLATE = go.layout.Template(
    layout={
        "font": {
            "family": "system-ui, 'Segoe UI', Roboto, 'Liberation Sans', Arial, sans-serif",
            "size": 13,
            "color": _INK,
        },
        "paper_bgcolor": "#ffffff",
        "plot_bgcolor": "#ffffff",
        "xaxis": _AXIS,
        "yaxis": _AXIS,
        # room for the buttons above and the legend below
        "margin": {"l": 64, "r": 16, "t": 34, "b": 52},
        "legend": {"orientation": "h", "x": 0.0, "y": 0.0, "yref": "container", "yanchor": "bottom"},
        "hoverlabel": {"bgcolor": "#ffffff", "font": {"size": 12}},
        "dragmode": "zoom",
        "separators": ".\u202f",
    }
)
_MOTION = ("phi", "w", "a")
_GIVEN = [
    *(f"machine.{name}" for name in ChamberForces.input_layout.names if name not in _MOTION),
    "motor.voltage",
]
_MOST = 6000  # samples of a line


@dataclass(frozen=True)
class Plot:
    """A plot with what a reader who does not see it is told."""

    name: str
    title: str
    seen: str
    figure: Any
    run: str = ""
    marked: bool = False
    """Whether the event of the run is marked."""


def called(events: Mapping[str, Any], run: str) -> str:
    """Title of a run: one of the `events`, each with its title, or another."""
    if run.endswith(COASTING):
        return f"{called(events, run.removesuffix(COASTING))}: behind the open coupling"
    if run in events:
        return str(events[run].title)
    return _TITLES.get(run, run.replace("_", " "))


def event_of(study: Study, run: str) -> float | None:
    """When the overload of a run begins [s]; None where it has none, or is one from the start."""
    return study.event.get(run.removesuffix(COASTING)) or None


def in_order(study: Study) -> list[str]:
    """The runs, each followed by that of the machine behind the open coupling, where there is one."""
    driven = [name for name in study.runs if not name.endswith(COASTING)]
    return [run for name in driven for run in (name, name + COASTING) if run in study.runs]


def plots(study: Study) -> Iterator[Plot]:
    """Every plot that the study has data for."""
    driven = [name for name in study.runs if not name.endswith(COASTING)]
    if driven:
        yield _torque_speed(study, driven)
    if study.statics.cycles:
        yield _turn(study)
    if study.statics.sides is not None:
        yield _sides(study)
    if study.chain is not None and len(study.chain.sweep) > 1:
        yield _chains(study)
    for name in driven:
        yield _transient(study, name)
    if study.pins:
        yield _reactions(study)


def _style(i: int) -> dict[str, Any]:
    return _STYLES[i % len(_STYLES)]


def _small(x: Any) -> Any:
    # plotly packs arrays as they are: single precision halves the page
    return np.asarray(x, np.float32)


def _thin(*signals: Any) -> Any:
    """Which samples to draw: those from which straight lines run within a thousandth of the range of each signal."""
    values = np.array([s / (np.ptp(s) or 1.0) for s in signals])
    tolerance = 1e-3
    kept = _corners(values, tolerance)
    while len(kept) > _MOST:
        tolerance *= 2.0
        kept = _corners(values, tolerance)
    return kept


def _corners(values: Any, tolerance: float) -> Any:
    """Samples of `values`, shape (signals, samples), that a polyline needs to stay within `tolerance` of all."""
    last = values.shape[1] - 1
    kept, todo = {0, last}, [(0, last)]
    while todo:
        start, stop = todo.pop()
        if stop - start < 2:
            continue
        along = np.arange(1, stop - start) / (stop - start)
        chord = values[:, [start]] + (values[:, [stop]] - values[:, [start]]) * along
        off = np.max(np.abs(values[:, start + 1 : stop] - chord), axis=0)
        furthest = int(np.argmax(off))
        if off[furthest] > tolerance:
            corner = start + 1 + furthest
            kept.add(corner)
            todo += [(start, corner), (corner, stop)]
    return np.array(sorted(kept))


def _torque_speed(study: Study, names: list[str]) -> Plot:
    figure = go.Figure()
    slowest = fastest = 0.0
    hover = "%{x:.4g} rad/s, %{y:.3g} N m"
    for i, name in enumerate(names):
        run = study.runs[name].sel(time=slice(event_of(study, name), None))
        speed, torque = run["motor.w"].values, run["motor.air_gap_tau"].values
        slowest, fastest = min(slowest, float(speed.min())), max(fastest, float(speed.max()))
        kept = _thin(speed, torque)
        figure.add_scatter(
            x=_small(speed[kept]),
            y=_small(torque[kept]),
            name=called(study.config.events, name),
            mode="lines",
            line=_style(i),
            hovertemplate=hover,
        )
    w = np.linspace(slowest, fastest + 0.1 * (fastest - slowest), 301)
    figure.add_scatter(
        x=_small(w),
        y=_small(np.broadcast_to(study.drive.motor.limit(numpy_(), study.drive.parameters, w), w.shape)),
        name="most that the drive gives, steady",
        mode="lines",
        line=_LIMIT,
        hovertemplate=hover,
    )
    figure.update_layout(
        template=_TEMPLATE,
        height=530,
        hovermode="closest",
        xaxis={"title": {"text": "motor speed [rad/s]"}, "rangemode": "tozero"},
        yaxis={"title": {"text": "air-gap torque [N m]"}},
    )
    return Plot(
        "torque-speed",
        "Torque-speed plane",
        "Air-gap torque of the motor over its speed, a line for each run, with the most that the drive gives in "
        "steady running.",
        figure,
    )


def _turn(study: Study) -> Plot:
    figure = make_subplots(rows=2, cols=1, shared_xaxes=True, vertical_spacing=0.07)
    for i, (name, c) in enumerate(study.statics.cycles.items()):
        degrees = _small(np.degrees(np.append(c.angle, 2.0 * math.pi)))
        for row, y in ((1, c.crank_torque), (2, c.outputs.rocker.tau)):
            figure.add_scatter(
                x=degrees,
                y=_small(np.append(y, y[0])),
                name=name,
                legendgroup=name,
                showlegend=row == 1,
                mode="lines",
                line=_style(i),
                hovertemplate="%{y:.3g} N m",
                row=row,
                col=1,
            )
    figure.update_layout(template=_TEMPLATE, height=590, hovermode="x unified")
    figure.update_xaxes(range=[0, 360], dtick=45)
    figure.update_xaxes(title_text="crank angle from the upward vertical [deg]", row=2)
    figure.update_yaxes(title_text="crank torque [N m]", row=1)
    figure.update_yaxes(title_text="rocker torque [N m]", row=2)
    return Plot(
        "turn",
        "Torque over a crank turn at constant speed",
        "Crank torque and, below, the torque that both organs ask of the rocker, over the crank angle: both "
        "sides loaded, one side empty, all feed on one side.",
        figure,
    )


_WHICH = {"both": "both sides"} | {str(side): f"{side} side alone" for side in SIDES}


def _sides(study: Study) -> Plot:
    assert study.statics.sides is not None
    figure = make_subplots(rows=2, cols=1, shared_xaxes=True, vertical_spacing=0.07)
    for row, what in ((1, "crank"), (2, "rocker")):
        for i, (which, words) in enumerate(_WHICH.items()):
            figure.add_scatter(
                x=_small(study.statics.sides.speed),
                y=_small(getattr(study.statics.sides, f"{what}_{which}")),
                name=words,
                legendgroup=which,
                showlegend=row == 1,
                mode="lines",
                line=_style(i),
                hovertemplate="%{y:.3g} N m",
                row=row,
                col=1,
            )
        figure.update_yaxes(title_text=f"{what} torque, peak [N m]", rangemode="tozero", row=row)
    _mark(figure, study.config.run.crank_speed, "normal running")
    figure.update_layout(template=_TEMPLATE, height=610, hovermode="x unified", margin={"t": 52})
    figure.update_xaxes(title_text="crank speed [rad/s]", row=2)
    return Plot(
        "sides",
        "One side against both, over the speed",
        "Largest crank torque and rocker torque in a turn over the crank speed, with both sides and with each "
        "side alone; the speed of normal running is marked.",
        figure,
    )


def _chains(study: Study) -> Plot:
    found = study.chain
    assert found is not None
    rows = found.sweep
    speed = _small([n.speed for n in rows])
    figure = make_subplots(
        rows=3, cols=1, shared_xaxes=True, vertical_spacing=0.05, row_heights=(0.39, 0.39, 0.22)
    )
    panels: list[tuple[str, str, list[Any]]] = [
        (
            f"{name} torque, peak [N m]",
            "%{y:.3g} N m",
            [
                [getattr(n, size) for n in rows]
                for size in (f"{name}_torque_median", f"{name}_torque_high", f"two_bar_{name}_torque")
            ],
        )
        for name in ("rocker", "crank")
    ]
    slack = [[100.0 * getattr(n, size) for n in rows] for size in ("slack_time", "two_bar_slack_time")]
    panels.append(("time slack [%]", "%{y:.3g} %", [slack[0], None, slack[1]]))
    for row, (label, hover, (median, high, two_bars)) in enumerate(panels, 1):
        for words, y, look in (
            ("chains, median", median, {"line": _style(0), "mode": "lines+markers"}),
            (
                f"chains, {100 * HIGH:g} % quantile",
                high,
                {
                    "line": {"color": _INK, "width": 0.8, "dash": "dot"},
                    "mode": "lines",
                    "fill": "tonexty",
                    "fillcolor": "rgba(90, 90, 90, 0.5)",
                },
            ),
            (
                "two bars",
                two_bars,
                {"line": _style(1), "mode": "lines+markers", "marker": {"symbol": "square"}},
            ),
        ):
            if y is not None:
                figure.add_scatter(
                    x=speed,
                    y=_small(y),
                    name=words,
                    legendgroup=words,
                    showlegend=row == 1,
                    hovertemplate=hover,
                    row=row,
                    col=1,
                    **look,
                )
        sizes = [*median, *(high or []), *two_bars]
        wide = row < 3 and max(sizes) > WIDE * max(min(sizes), 1e-9)
        figure.update_yaxes(
            title_text=label,
            **({"type": "log", "dtick": 1} if wide else {"rangemode": "tozero"}),
            row=row,
        )
    for band in found.avoid:
        figure.add_vrect(
            x0=band.low, x1=band.high, fillcolor="#000000", opacity=0.07, line_width=0, row="all", col=1
        )
    # on a narrow screen, too, no label covers another
    labelled = found.within_sweep(0.05)
    for mode, order, at in found.within_sweep():
        figure.add_vline(x=at, line={"color": "#777777", "width": 0.8}, row="all", col=1)
        if (mode, order, at) in labelled:
            figure.add_annotation(
                x=at,
                xref="x",
                y=1.0,
                yref="paper",
                yanchor="bottom",
                text=f"mode {mode}" + (f", order {order}" if order > 1 else ""),
                textangle=-90,
                showarrow=False,
                font={"size": 11},
            )
    figure.add_vline(x=found.own.speed, line=_style(2), row="all", col=1)
    figure.update_layout(template=_TEMPLATE, height=790, hovermode="x unified", margin={"t": 116})
    figure.update_xaxes(range=[float(speed[0]), float(speed[-1])])
    figure.update_xaxes(title_text="crank speed [rad/s]", row=3)
    return Plot(
        "chains",
        "Chains and two bars, over the speed",
        "Peaks of rocker torque and crank torque in a turn over the crank speed, chains and two bars, and below the "
        "share of the time in which a rod is slack; speeds to avoid are shaded, critical speeds are lines.",
        figure,
    )


def _transient(study: Study, name: str) -> Plot:
    run, drive = study.runs[name], study.drive
    event = event_of(study, name)
    current = run[f"motor.{study.drive.motor.current}"].values
    time = run["time"].values - (event or 0.0)
    series = [
        ("crank torque [N m]", "%{y:.3g} N m", drive.crank_torque(run)),
        ("crank speed [rad/s]", "%{y:.4g} rad/s", drive.crank_motion(run)[1]),
        ("motor current [A]", "%{y:.3g} A", current),
    ]
    rigid = None
    if drive.line is not None:
        series.append(("torque in shaft 2 [N m]", "%{y:.3g} N m", run["driveline.tau2"].values))
        rigid = run[RIGID].values if RIGID in run else None
    kept = _thin(*(y for _, _, y in series), *([] if rigid is None else [np.nan_to_num(rigid)]))
    figure = make_subplots(rows=len(series), cols=1, shared_xaxes=True, vertical_spacing=0.05)
    x = _small(time[kept])
    for row, (label, hover, y) in enumerate(series, 1):
        figure.add_scatter(
            x=x,
            y=_small(y[kept]),
            name=label.partition(" [")[0],
            showlegend=False,
            mode="lines",
            line=_style(0) | {"width": 1.7},
            hovertemplate=hover,
            row=row,
            col=1,
        )
        figure.update_yaxes(title_text=label, row=row)
    if rigid is not None:
        figure.add_scatter(
            x=x,
            y=_small(rigid[kept]),
            name="with a rigid shaft",
            mode="lines",
            line=_style(1),
            hovertemplate="%{y:.3g} N m",
            row=len(series),
            col=1,
        )
    if event is None and study.drive.follows:
        figure.add_scatter(
            x=x,
            y=_small(run["motor.w_ref"].values[kept] / drive.ratio),
            name="speed asked for",
            mode="lines",
            line=_style(1),
            hovertemplate="%{y:.4g} rad/s",
            row=2,
            col=1,
        )
    limit = study.drive.parameters.limit.i if study.drive.motor is DcMotor else math.inf
    if np.max(np.abs(current)) > 0.5 * limit:
        figure.add_scatter(
            x=x[[0, -1]],
            y=[limit, limit],
            name="current limit",
            mode="lines",
            line=_LIMIT | {"width": 2.5, "dash": "dot"},
            hovertemplate="%{y:.3g} A",
            row=3,
            col=1,
        )
    behind = study.runs.get(name + COASTING)
    if behind is not None:
        figure.add_scatter(
            x=_small(behind["time"].values - (event or 0.0)),
            y=_small(drive.crank_motion(behind)[1]),
            name="crank behind the open coupling",
            mode="lines",
            line=_style(1),
            hovertemplate="%{y:.4g} rad/s",
            row=2,
            col=1,
        )
    shown = time[0], time[-1] if behind is None else float(behind["time"][-1]) - (event or 0.0)
    if event is not None:
        # the last quarter turn before the event says enough of steady running
        shown = max(time[0], -0.5 * math.pi / study.config.run.crank_speed), shown[1]
        changing = _changing(run)
        if changing is not None:
            figure.add_vrect(
                x0=changing[0] - event,
                x1=changing[1] - event,
                fillcolor="#000000",
                opacity=0.07,
                line_width=0,
                row="all",
                col=1,
            )
        _mark(figure, 0.0, "event")
    elif name == "start_up" and study.answers:
        _mark(figure, study.settled, "steady from here")
    figure.update_layout(
        template=_TEMPLATE, height=190 * len(series) + 75, hovermode="x unified", margin={"t": 52}
    )
    figure.update_xaxes(range=shown)
    since = "time [s]" if event is None else "time after the event [s]"
    figure.update_xaxes(title_text=since, row=len(series))
    words = called(study.config.events, name)
    return Plot(
        f"time-{name.replace('_', '-')}",
        words[0].upper() + words[1:],
        f"Crank torque, crank speed and motor current over time: {words}."
        + ("" if event is None else " The event is marked by a dashed line; the loads change in the shade."),
        figure,
        name,
        event is not None,
    )


def _mark(figure: Any, time: float, words: str) -> None:
    figure.add_vline(x=time, line=_MARK, row="all", col=1)
    figure.add_annotation(
        x=time,
        xref="x",
        y=1.0,
        yref="paper",
        yanchor="bottom",
        text=words,
        showarrow=False,
        font={"size": 12},
    )


def _changing(run: Any) -> tuple[float, float] | None:
    """From when to when the loads differ from one sample to the next [s]."""
    changes = np.zeros(len(run["time"]) - 1, bool)
    for name in _GIVEN:
        if name in run:
            changes |= np.diff(run[name].values) != 0.0
    found = np.flatnonzero(changes)
    if not found.size:
        return None
    time = run["time"].values
    return float(time[found[0]]), float(time[found[-1] + 1])


_BARS = (
    {"color": "#ffffff", "shape": ""},
    {"color": "#d4d4d4", "shape": ""},
    {"color": "#ffffff", "shape": "/"},
    {"color": "#e9c3b2", "shape": "x"},
    {"color": "#ffffff", "shape": "|"},
    {"color": "#c9dbe6", "shape": "."},
    {"color": "#ffffff", "shape": "-"},
    {"color": "#d9e4d0", "shape": "+"},
)


def _reactions(study: Study) -> Plot:
    figure = go.Figure()
    runs, pins = list(study.pins), list(PINS)
    height = 0.84 / len(runs)
    for i, name in enumerate(runs):
        bar, top, words = _BARS[i % len(_BARS)], -0.42 + i * height, study.called(name)
        for size, width, offset in (("peak", 0.92 * height, 0.0), ("rms", 0.34 * height, 0.29 * height)):
            peak = size == "peak"
            figure.add_bar(
                y=pins,
                x=[study.pins[name][pin][size] for pin in pins],
                orientation="h",
                width=width,
                offset=top + offset,
                name=f"{words}: peak" if peak else "dark inner bar: RMS",
                showlegend=peak or i == 0,
                legendrank=100 + i if peak else 200,
                marker={
                    "color": bar["color"] if peak else _INK,
                    "line": {"color": _INK, "width": 0.8},
                    "pattern": {"shape": bar["shape"], "fgcolor": "#666666", "size": 6} if peak else {},
                },
                hovertemplate=f"%{{y}}, {words}: {'peak' if peak else 'RMS'} %{{x:.4g}} N<extra></extra>",
            )
    figure.update_layout(
        template=_TEMPLATE,
        barmode="overlay",
        height=120 + max(11, 20 - len(runs)) * len(runs) * len(pins),
        hovermode="closest",
        xaxis={"title": {"text": "reaction [N]"}},
        yaxis={"title": {"text": "pin"}, "autorange": "reversed", "showgrid": False, "ticks": ""},
    )
    return Plot(
        "reactions",
        "What the pins carry",
        "Bars of the reaction of every pin in every run: the wide bar is the peak, the dark one inside the RMS.",
        figure,
    )
