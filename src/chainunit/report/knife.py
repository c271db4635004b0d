"""What ``chainunit knife`` leaves behind: knife.json, knife.md, plots, and tables on the terminal."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Rectangle
from matplotlib.ticker import FuncFormatter
from rich.console import Console
from rich.table import Table
from rich.text import Text

from ..engines import numpy_
from ..files import whole
from ..machines.knife_drive import Inputs, KnifeDrive
from ..quantities import DISPLAY_UNITS, Layout
from ..studies.knife import Answers, KnifeStudy, Turn, Wheel, as_dict
from .style import LINES, draw
from .trace import markdown_text

NUMBERS, TEXT = "knife.json", "knife.md"
PLOTS = ("blade_path.png", "torque.png", "reactions.png", "flywheel.png")
NAMES = (NUMBERS, TEXT, *PLOTS)
_GREY = "#777777"
_STACK: dict[str, Any] = {"facecolor": "#dddddd", "edgecolor": _GREY, "hatch": "--", "linewidth": 0.8}
_WHITE = {"facecolor": "white", "edgecolor": "none", "pad": 1.0, "alpha": 0.85}


def write(study: KnifeStudy, folder: Path) -> list[Path]:
    """Write numbers, text and plots; returns the files. Without any run there is no plot of the flywheels."""
    numbers, text = folder / NUMBERS, folder / TEXT
    with whole(numbers) as part:
        part.write_text(json.dumps(as_dict(study), indent=1, allow_nan=False) + "\n", "utf-8")
    makers: dict[str, Callable[[KnifeStudy], Any]] = dict(
        zip(PLOTS, (_blade_path, _torque, _reactions, _flywheel), strict=True)
    )
    if not any(wheel.answers.fluctuation is not None for wheel in study.wheels):
        del makers["flywheel.png"]
    drawn = draw({name: partial(make, study) for name, make in makers.items()}, folder)
    with whole(text) as part:
        part.write_text(markdown(study, [file.name for file in drawn]), "utf-8")
    return [numbers, text, *drawn]


def _value(x: float | None, unit: str) -> str:
    """A number in the unit that is read; "-" for none."""
    if x is None or not math.isfinite(x):
        return "-"
    if unit == "1":
        # by hand nothing fluctuates by more than the speed itself
        return f"{100.0 * x:.3g} %" if x < 2.0 else "> 200 %"
    if unit == "m":
        return f"{1e3 * x:.1f} mm"
    if unit in DISPLAY_UNITS:
        unit, factor, offset = DISPLAY_UNITS[unit]
        x = factor * x + offset
        return f"{x:.{4 if abs(x) >= 1.0 else 2}g} {unit}"
    return f"{x:.3g} {unit.replace('.', ' ')}" if abs(x) < 1e3 else f"{x:.0f} {unit.replace('.', ' ')}"


def turn_rows(study: KnifeStudy) -> list[tuple[str, str]]:
    """The turn at constant speed: quantity and value."""
    turn, layout = study.statics.turn, Layout(Turn)
    rows = [
        (v.description, f"{x:.3g}" if v.name == "margin" else _value(x, v.unit))
        for v, x in zip(layout.variables, layout.values(turn), strict=True)
    ]
    title, most = max(study.statics.pins.items(), key=lambda item: item[1].peak)
    return [*rows, (f"largest reaction, {title}", _value(most.peak, "N"))]


def columns(study: KnifeStudy) -> list[tuple[str, Wheel]]:
    """The flywheels by inertia, and what each of them is."""
    found = [("given" if wheel is study.given else "", wheel) for wheel in study.wheels]
    if study.least is not None:
        if study.least in study.wheels:
            k = study.wheels.index(study.least)
            found[k] = (", ".join(word for word in (found[k][0], "least") if word), study.least)
        else:
            found.append(("least", study.least))
    return sorted(found, key=lambda item: item[1].flywheel)


def wheel_rows(study: KnifeStudy) -> list[tuple[str, list[str]]]:
    """What each flywheel gave: quantity, and a value for each of `columns`."""
    wheels = [wheel for _, wheel in columns(study)]
    return [
        (v.description, [_value(getattr(wheel.answers, v.name), v.unit) for wheel in wheels])
        for v in Layout(Answers).variables
        if v.name != "flywheel"
    ]


def _heads(study: KnifeStudy) -> list[str]:
    return [
        _value(wheel.flywheel, "kg.m2")
        + (f" ({what})" if what else "")
        + (" stalls" if wheel.stalled else "")
        for what, wheel in columns(study)
    ]


_SHORT = tuple(
    (head, name, next(v.unit for v in Layout(Answers).variables if v.name == name))
    for head, name in (
        ("flywheel", "flywheel"),
        ("start", "start_time"),
        ("ripple", "fluctuation"),
        ("by hand", "fluctuation_by_hand"),
        ("peak torque", "motor_torque_peak"),
        ("current", "current_share"),
        ("lent", "stored_share_most"),
    )
)
"""Columns on the terminal: head, name in `Answers`, unit."""


def show(study: KnifeStudy, console: Console) -> None:
    """Print the turn, the flywheels, warnings and notes."""
    title = study.config.title
    table = Table(title=Text(title) if title else None, title_justify="left", show_header=False)
    table.add_column("quantity")
    table.add_column("value", justify="right")
    for name, value in turn_rows(study):
        table.add_row(name, value)
    console.print(table)
    if study.wheels:
        table = Table(
            title="Flywheels (ripple: fluctuation of the speed; current: RMS of rated; lent: of a cut's work)",
            title_justify="left",
        )
        for head, _, unit in _SHORT:
            table.add_column(f"{head}\n[{'%' if unit == '1' else unit.replace('.', ' ')}]", justify="right")
        table.add_column("")
        for what, wheel in columns(study):
            cells = [_value(getattr(wheel.answers, name), unit) for _, name, unit in _SHORT]
            # the unit is in the head
            bare = [cell.partition(" ")[0] if cell[:1].isdigit() else cell for cell in cells]
            table.add_row(*bare, what + (" stalls" if wheel.stalled else ""))
        console.print(table)
    for kind, lines in (("Warning", study.warnings), ("Note", study.notes)):
        for line in lines:
            console.print(f"{kind}: {line}", soft_wrap=True)


def markdown(study: KnifeStudy, plots: list[str]) -> str:
    """The turn, the pins, the flywheels, the warnings, what was given, and the plots."""
    config, plate = study.config, study.config.motor.nameplate
    lines = [f"# {markdown_text(config.title) or 'Knife drive'}", ""]
    if study.failure is not None:
        lines += [f"The run stopped early: {markdown_text(str(study.failure))}.", ""]
    lines += ["## A turn at constant speed", "", "| quantity | value |", "|---|---|"]
    lines += [f"| {name} | {value} |" for name, value in turn_rows(study)]
    lines += ["", "| pin | peak, cutting | at | peak, without cut | at |", "|---|---|---|---|---|"]
    lines += [
        f"| {title} | {_value(r.peak, 'N')} | {_value(r.angle, 'rad')} | {_value(r.peak_free, 'N')} | "
        f"{_value(r.angle_free, 'rad')} |"
        for title, r in study.statics.pins.items()
    ]
    if study.wheels:
        heads = _heads(study)
        lines += ["", "## Flywheels, co-simulated", "", f"Motor: {config.motor.designation}, rated "]
        lines[-1] += ", ".join(
            _value(x, unit)
            for x, unit in (
                (plate.power, "W"),
                (plate.speed, "rad/s"),
                (plate.torque, "N.m"),
                (plate.rated_current, "A"),
            )
        )
        lines[-1] += f"; ratio {config.machine.ratio:.4g}."
        lines += ["", f"| flywheel | {' | '.join(heads)} |", "|---" * (len(heads) + 1) + "|"]
        lines += [f"| {name} | {' | '.join(values)} |" for name, values in wheel_rows(study)]
    for title, said in (("Warnings", study.warnings), ("Notes", study.notes)):
        if said:
            lines += ["", f"## {title}", "", *(f"- {line}" for line in said)]
    lines += ["", "## Given", "", "| name | value | meaning |", "|---|---|---|"]
    for section, declared in (
        ("cut", config.cut),
        ("drive", config.train),
        ("run", config.run),
        ("machine", config.machine),
    ):
        layout = Layout(type(declared))
        for v, x in zip(layout.variables, layout.values(declared), strict=True):
            unit = "" if v.unit == "1" else " " + v.unit.replace(".", " ")
            lines.append(f"| {section}.{v.name} | {x:.6g}{unit} | {v.description} |")
    for name in plots:
        lines += ["", f"![{name.removesuffix('.png')}]({name})"]
    return "\n".join(lines) + "\n"


# -- plots


def _joints(study: KnifeStudy, q: float) -> dict[str, tuple[float, float]]:
    """Pins and the ends of the edge at crank angle `q` [m]."""
    p = study.config.machine
    m = KnifeDrive.state(numpy_(), p, Inputs(), q, 0.0).m
    knife = m.links["knife"]
    at: dict[str, Any] = {
        **{name: pin.p for name, pin in m.pins.items()},
        # the edge is drawn as long as the knife's pins lie apart
        "first": knife.beside(min(p.knife.d.x, p.knife.e.x), p.knife.blade.y).p,
        "last": knife.beside(max(p.knife.d.x, p.knife.e.x), p.knife.blade.y).p,
    }
    return {name: (float(point.x), float(point.y)) for name, point in at.items()}


_LINKS = (("O1", "A"), ("A", "B"), ("B", "O2"), ("B", "C"), ("O3", "D"), ("O4", "E"))


def _blade_path(study: KnifeStudy) -> Any:
    s, stack = study.statics, study.config.machine.stack
    figure = plt.figure(figsize=(11.0, 9.0))
    grid = figure.add_gridspec(2, 2, height_ratios=(1.25, 1.0), width_ratios=(1.5, 1.0))
    axis = figure.add_subplot(grid[0, :])
    bottom = float(s.angle[np.argmin(s.y)])
    fall = (bottom - s.top) % (2.0 * math.pi)
    for line, (name, q) in zip(
        (LINES[2], LINES[1], LINES[0]),
        (("blade at its top", s.top), ("half-way", s.top + 0.5 * fall), ("at its bottom", s.top + fall)),
        strict=True,
    ):
        at = _joints(study, q)
        marker = {"marker": "o", "markersize": 4.0, "markerfacecolor": "white", "zorder": 3}
        for k, link in enumerate(_LINKS):
            axis.plot(
                *zip(*(at[pin] for pin in link), strict=True),
                label=None if k else f"{name}, crank at {math.degrees(q) % 360.0:.0f} deg",
                **line,
                **marker,
            )
        axis.plot(*zip(*(at[pin] for pin in "CDEC"), strict=True), **line, **marker)
        axis.plot(*zip(at["first"], at["last"], strict=True), **{**line, "linewidth": 2.6}, zorder=4)
        if name == "at its bottom":
            _names(axis, at)
    left, right = sorted((at["first"][0], at["last"][0]))
    axis.add_patch(
        Rectangle(
            (left, stack.table), right - left, stack.top - stack.table, zorder=1, label="stack", **_STACK
        )
    )
    axis.plot(s.x, s.y, color="#1b1b1b", linewidth=1.0, zorder=5, label="path of the edge's middle")
    axis.set_aspect("equal")
    axis.set_xlabel("x [m]")
    axis.set_ylabel("y [m]")
    axis.legend(loc="upper left", fontsize=9)
    axis.set_title("The linkage in three positions")

    path, tilt = figure.add_subplot(grid[1, 0]), figure.add_subplot(grid[1, 1])
    x, y = 1e3 * np.append(s.x, s.x[0]), 1e3 * np.append(s.y, s.y[0])
    path.axhspan(1e3 * stack.table, 1e3 * stack.top, zorder=1, **_STACK)
    path.plot(x, y, **LINES[0])
    # on the way down alone: the way up may run along the same line
    for k in range(7):
        at_k = int((math.radians(30.0 * k) * fall / math.pi + s.top) / (2.0 * math.pi) * len(s.angle)) % len(
            s.angle
        )
        path.plot([x[at_k]], [y[at_k]], "o", color="#1b1b1b", markersize=4.0, markerfacecolor="white")
        path.annotate(
            f"{math.degrees(s.angle[at_k]):.0f} deg",
            (x[at_k], y[at_k]),
            (-8, -4) if k == 6 else (8, -9),
            textcoords="offset points",
            ha="right" if k == 6 else "left",
            fontsize=9,
            bbox=_WHITE,
        )
    path.margins(x=0.3, y=0.2)
    path.set_aspect("equal", adjustable="datalim")
    path.set_xlabel("x [mm]")
    path.set_ylabel("y [mm]")
    path.set_title("Path of the edge's middle; crank angles on its way down")
    tilt.plot(np.degrees(s.angle), np.degrees(s.tilt), **LINES[0])
    _span(tilt, study)
    _turn_axis(tilt)
    tilt.set_ylabel("tilt of the blade [deg]")
    tilt.set_title("Tilt; grey: in the stack")
    return figure


def _names(axis: Any, at: dict[str, tuple[float, float]]) -> None:
    for name in ("O1", "A", "B", "O2", "C", "D", "E", "O3", "O4"):
        if name.startswith("O"):
            axis.plot([at[name][0]], [at[name][1]], "^", color="#1b1b1b", markersize=9.0, zorder=2)
        axis.annotate(
            name,
            at[name],
            (-4, -17) if name in "CDE" else (7, 7),
            textcoords="offset points",
            fontsize=10,
            zorder=6,
            bbox=_WHITE,
        )


def _turn_axis(axis: Any, label: bool = True) -> None:
    axis.set_xlim(0.0, 360.0)
    axis.set_xticks(range(0, 361, 60))
    if label:
        axis.set_xlabel("crank angle [deg]")


def _span(axis: Any, study: KnifeStudy) -> None:
    """Shade where the blade goes down in the stack."""
    s, stack = study.statics, study.config.machine.stack
    falling = np.roll(s.y, -1) < s.y
    inside = falling & (s.y < stack.top) & (s.y > stack.table)
    edge = np.diff(np.concatenate([[False], inside, [False]]).astype(int))
    degrees = np.degrees(np.append(s.angle, 2.0 * math.pi))
    for a, b in zip(np.flatnonzero(edge > 0), np.flatnonzero(edge < 0), strict=True):
        axis.axvspan(degrees[a], degrees[b], facecolor="#ececec", edgecolor="none", zorder=0)


def _torque(study: KnifeStudy) -> Any:
    s, config = study.statics, study.config
    figure, (top, bottom) = plt.subplots(2, 1, figsize=(8.0, 6.5), sharex=True, height_ratios=(1.6, 1.0))
    degrees = np.degrees(s.angle)
    top.plot(degrees, s.torque, label=f"cutting, {1e-3 * config.cut.force:.4g} kN", **LINES[0])
    top.plot(degrees, s.torque_free, label="without cut", **LINES[1])
    top.axhline(s.turn.torque_mean, label=f"mean, cutting: {s.turn.torque_mean:.3g} N m", **LINES[2])
    top.set_ylabel("crank torque [N m]")
    top.set_title(f"A turn at constant {_value(config.run.crank_speed, 'rad/s')}; grey: in the stack")
    top.legend(loc="upper right", fontsize=9)
    bottom.plot(degrees, s.inertia, **LINES[0])
    bottom.set_ylim(bottom=0.0)
    bottom.set_ylabel("inertia reflected\nto the crank [kg m2]")
    for axis in (top, bottom):
        _span(axis, study)
        _turn_axis(axis, axis is bottom)
    return figure


def _reactions(study: KnifeStudy) -> Any:
    pins = study.statics.pins
    figure, axis = plt.subplots(figsize=(8.5, 5.2))
    rows = np.arange(len(pins))
    for shift, name, shade, hatch, angle in (
        (-0.2, "peak", "#4d4d4d", "", "angle"),
        (0.2, "peak_free", "#d4d4d4", "//", "angle_free"),
    ):
        sizes = [1e-3 * getattr(r, name) for r in pins.values()]
        axis.barh(
            rows + shift,
            sizes,
            0.38,
            label="cutting" if name == "peak" else "without cut",
            color=shade,
            hatch=hatch,
            edgecolor="#1b1b1b",
            linewidth=0.6,
        )
        for row, size, r in zip(rows, sizes, pins.values(), strict=True):
            axis.annotate(
                f"{size:.3g} kN at {math.degrees(getattr(r, angle)):.0f} deg",
                (size, row + shift),
                (4, 0),
                textcoords="offset points",
                va="center",
                fontsize=8,
            )
    axis.set_yticks(rows, list(pins))
    axis.invert_yaxis()
    axis.margins(x=0.22)
    axis.set_xlim(left=0.0)
    axis.set_xlabel("largest reaction [kN], and the crank angle at which it comes")
    axis.set_title("What the pins carry over a turn at constant speed")
    axis.grid(axis="y", visible=False)
    axis.legend(loc="lower right")
    return figure


def _flywheel(study: KnifeStudy) -> Any:
    figure, axes = plt.subplots(2, 2, figsize=(11.0, 8.0))
    (speed, torque), (current, size) = axes
    cutting = [wheel for _, wheel in columns(study) if wheel.answers.fluctuation is not None]
    # as many as there are lines to tell apart, from the least to the largest
    shown = [cutting[round(k)] for k in np.linspace(0, len(cutting) - 1, min(len(cutting), len(LINES)))]
    config = study.config
    ratio, plate = config.machine.ratio, config.motor.nameplate
    for line, wheel in zip(LINES, shown, strict=False):
        assert wheel.turns is not None
        run = wheel.turns
        # the last turn, from one top of the blade to the next
        angle = np.degrees(run["motor.phi"].values / ratio - study.statics.top)
        first = int(np.searchsorted(angle, angle[-1] - 360.0))
        after = angle[first:] - angle[-1] + 360.0
        for axis, y in (
            (speed, run["motor.w"].values / ratio * 30.0 / math.pi),
            (torque, run["motor.air_gap_tau"].values),
            (current, run["motor.i"].values),
        ):
            axis.plot(after, y[first:], label=_value(wheel.flywheel, "kg.m2"), **line)
    torque.axhline(plate.torque, color=_GREY, linewidth=1.2, linestyle=(0, (6, 2)), label="rated")
    current.axhline(plate.rated_current, color=_GREY, linewidth=1.2, linestyle=(0, (6, 2)), label="rated")
    speed.set_ylabel("crank speed [rev/min]")
    torque.set_ylabel("motor torque, air gap [N m]")
    current.set_ylabel("motor current, RMS of a phase [A]")
    for axis in (speed, torque, current):
        _turn_axis(axis)
        axis.set_xlabel("crank angle after the blade's top [deg]")
    speed.set_title("A cut with each flywheel")
    torque.legend(loc="best", fontsize=9)
    _sizes(study, size, cutting)
    return figure


def _sizes(study: KnifeStudy, axis: Any, cutting: list[Wheel]) -> None:
    """Fluctuation over the inertia on the motor shaft."""
    inertia = np.array([wheel.answers.inertia for wheel in cutting])
    ends = np.array(
        [min(inertia[0], study.inertia(0.0)), 1.3 * max(inertia[-1], study.inertia(study.flywheel_by_hand))]
    )
    by_hand = [study.by_hand(J - study.inertia(0.0)) for J in ends]
    axis.loglog(ends, by_hand, label="by hand, dE/(J w2)", **LINES[1])
    axis.loglog(
        inertia,
        [wheel.answers.fluctuation for wheel in cutting],
        marker="o",
        markersize=5.0,
        markerfacecolor="white",
        label="co-simulated",
        **LINES[0],
    )
    axis.axhline(
        study.config.run.fluctuation, color=_GREY, linewidth=1.2, linestyle=(0, (6, 2)), label="permitted"
    )
    if study.least is not None and study.least in cutting:
        a = study.least.answers
        axis.plot([a.inertia], [a.fluctuation], "s", color="#1b1b1b", markersize=7.0, label="least flywheel")
    axis.set_ylim(top=min(2.0, 1.5 * max(by_hand)))
    percent = FuncFormatter(lambda y, _: f"{100.0 * y:g} %")
    axis.yaxis.set_major_formatter(percent)
    axis.yaxis.set_minor_formatter(
        FuncFormatter(lambda y, _: f"{100 * y:g} %" if f"{y:e}"[0] in "25" else "")
    )
    axis.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
    axis.set_xlabel("inertia on the motor shaft [kg m2]")
    axis.set_ylabel("fluctuation of the speed [%]")
    axis.set_title("Fluctuation over inertia")
    axis.legend(loc="best", fontsize=9)
