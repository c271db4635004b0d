"""What ``chainunit driveline`` leaves behind: driveline.json, driveline.md, plots, and a table on the terminal."""

from __future__ import annotations

import json
import math
from functools import partial
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter
from rich.console import Console
from rich.table import Table
from rich.text import Text

from ..drives.cardan import ORDERS, Cardan
from ..files import whole
from ..quantities import DISPLAY_UNITS, Layout
from ..studies.driveline import DrivelineStudy, as_dict, both_units, rev
from .style import LINES, draw
from .trace import markdown_text

NUMBERS, TEXT = "driveline.json", "driveline.md"
PLOTS = ("campbell.png", "stability.png", "resonance.png", "ratio.png")
NAMES = (NUMBERS, TEXT, *PLOTS)
_GREY = "#777777"
_NOTHING = 1e-9  # amplitude of an order that is roundoff [rad]
_RUNNING = {"color": _GREY, "linewidth": 1.2, "linestyle": (0, (6, 2)), "label": "running"}
_MISSING = {"color": "#c1440e", "marker": "x", "markersize": 4.0, "linestyle": ""}
_AS_GIVEN: dict[str, Any] = {**LINES[3], "color": _GREY, "label": "bend as given"}
_WHITE = {"facecolor": "white", "edgecolor": "none", "pad": 1.0, "alpha": 0.85}


def write(study: DrivelineStudy, folder: Path) -> list[Path]:
    """Write numbers, text and plots; returns the files."""
    numbers, text = folder / NUMBERS, folder / TEXT
    with whole(numbers) as part:
        part.write_text(json.dumps(as_dict(study), indent=1, allow_nan=False) + "\n", "utf-8")
    makers = (_campbell, _stability, _resonance, _ratio)
    drawn = draw({name: partial(make, study) for name, make in zip(PLOTS, makers, strict=True)}, folder)
    with whole(text) as part:
        part.write_text(markdown(study), "utf-8")
    return [numbers, text, *drawn]


def answers(study: DrivelineStudy) -> list[tuple[str, str]]:
    """What is asked of a driveline and what it comes to."""
    band, found, running = study.band, study.operating, study.config.running
    rows = [
        ("natural frequency at i23 = 1", _frequency(study.at_even)),
        ("its range over a turn, frozen angle", f"{_frequency(band.least)} to {_frequency(band.largest)}"),
        ("ratio i23", f"{np.min(study.ratio):.4f} to {np.max(study.ratio):.4f}"),
    ]
    rows += [
        (f"amplitude of shaft 3 at order {n}", f"{math.degrees(x) if x > _NOTHING else 0.0:.3g} deg")
        for n, x in study.excitation.items()
    ]
    rows.append(("damping ratio", f"{study.damping_ratio:.3g}"))
    rows += [
        (f"order {n} meets it at", both_units(*study.crossings()[n]))
        for n in ORDERS
        if study.excitation[n] > _NOTHING
    ]
    rows += [
        (f"resonance peak at {both_units(at)}", f"{peak:.0f} N m in shaft 2")
        for at, peak in study.resonances()
    ]
    at = both_units(running.speed)
    if found.found[0]:
        rows += [
            (f"shaft 2 at {at}", _torques(found.least2[0], found.largest2[0])),
            (f"shaft 3 at {at}", _torques(found.least3[0], found.largest3[0])),
            ("Floquet multiplier there, per half turn", f"{found.multiplier[0]:.4f}"),
        ]
    else:
        rows.append((f"steady motion at {at}", "not found"))
    unstable = "; ".join(both_units(*ends) for ends in study.unstable_ranges())
    unknown = "; ".join(both_units(*ends) for ends in study.missing_ranges())
    rows.append(("unstable", unstable or ("nowhere else" if unknown else "nowhere in the range")))
    if unknown:
        rows.append(("whether it is stable is not known", unknown))
    return rows


def show(study: DrivelineStudy, console: Console) -> None:
    """Print answers, warnings and notes."""
    title = study.config.title
    table = Table(title=Text(title) if title else None, title_justify="left", show_header=False)
    table.add_column("quantity")
    table.add_column("value", justify="right")
    for name, value in answers(study):
        table.add_row(name, value)
    console.print(table)
    for kind, lines in (("Warning", study.warnings), ("Note", study.notes)):
        for line in lines:
            console.print(f"{kind}: {line}", soft_wrap=True)


def markdown(study: DrivelineStudy) -> str:
    """The answers, the warnings, what was given, and the plots."""
    lines = [f"# {markdown_text(study.config.title) or 'Driveline'}", "", "| quantity | value |", "|---|---|"]
    lines += [f"| {name} | {value} |" for name, value in answers(study)]
    for title, said in (("Warnings", study.warnings), ("Notes", study.notes)):
        if said:
            lines += ["", f"## {title}", "", *(f"- {line}" for line in said)]
    lines += ["", "## Given", "", "| name | value | meaning |", "|---|---|---|"]
    for declared in (study.config.line, study.config.running):
        layout = Layout(type(declared))
        for v, x in zip(layout.variables, layout.values(declared), strict=True):
            lines.append(f"| {v.name} | {_shown(x, v.unit)} | {v.description} |")
    for name in PLOTS:
        lines += ["", f"![{name.removesuffix('.png')}]({name})"]
    return "\n".join(lines) + "\n"


def _shown(x: float, unit: str) -> str:
    text = f"{x:.6g}" if unit == "1" else f"{x:.6g} {unit.replace('.', ' ')}"
    if unit not in DISPLAY_UNITS:
        return text
    other, factor, offset = DISPLAY_UNITS[unit]
    return f"{text} ({factor * x + offset:.5g} {other})"


def _torques(least: float, largest: float) -> str:
    # rounded to whole numbers, as a float may leave a minus before zero
    return f"{round(least):d} to {round(largest):d} N m"


def _frequency(k: float) -> str:
    return f"{k / (2.0 * math.pi):.3f} Hz ({k:.2f} rad/s)"


def _speed_axis(axis: Any, study: DrivelineStudy, mark: bool = True) -> None:
    """Speed in rev/min below and in rad/s above; the operating speed as a line."""
    running = study.config.running
    axis.set_xlim(rev(running.speed_low), rev(running.speed_high))
    axis.set_xlabel("speed [rev/min]")
    above = axis.secondary_xaxis("top", functions=(lambda n: n * math.pi / 30.0, rev))
    above.set_xlabel("speed [rad/s]")
    if mark:
        axis.axvline(rev(running.speed), **_RUNNING)


def _campbell(study: DrivelineStudy) -> Any:
    figure, axis = plt.subplots(figsize=(8.5, 5.8))
    low, high = study.band.least / (2.0 * math.pi), study.band.largest / (2.0 * math.pi)
    running = study.config.running
    ends = np.array([0.0, running.speed_high])
    axis.axhspan(
        low,
        high,
        facecolor="#c8c8c8",
        edgecolor="#9a9a9a",
        linewidth=1.5,
        label="natural frequency over a turn, frozen angle",
    )
    found = study.steady.found & ~study.steady.unstable
    axis.plot(
        rev(study.speed[found])[::4],
        study.steady.frequency[found][::4] / (2.0 * math.pi),
        "+",
        color=LINES[2]["color"],
        markersize=5.0,
        label="damped frequency in rotation (Floquet)",
    )
    for n, line in zip(ORDERS, LINES, strict=False):
        axis.plot(rev(ends), n * ends / (2.0 * math.pi), label=f"order {n}", **line)
    axis.plot(
        rev(ends), ends / (2.0 * math.pi), label="order 1: parametric resonance at speed = k", **LINES[3]
    )
    for n, (first, last) in study.crossings().items():
        middle = rev(0.5 * (first + last))
        if running.speed_low < 0.5 * (first + last) < running.speed_high:
            axis.plot([middle], [0.5 * (low + high)], "o", color="#1b1b1b", fillstyle="none", markersize=9.0)
            shown = f"{rev(first):.0f} to {rev(last):.0f}" if rev(last - first) >= 1.0 else f"{middle:.0f}"
            place, side, base = {
                1: ((-14, 10), "right", "bottom"),
                2: ((-14, 10), "right", "bottom"),
                3: ((8, -10), "center", "top"),
                4: ((-8, -10), "center", "top"),
            }[n]
            axis.annotate(
                ("k" if n == 1 else f"k/{n}") + f"\n{shown}",
                (middle, high if base == "bottom" else low),
                place,
                textcoords="offset points",
                ha=side,
                va=base,
                fontsize=9,
                bbox=_WHITE,
            )
    _speed_axis(axis, study)
    axis.set_ylim(0.0, 1.7 * high)
    axis.set_ylabel("frequency [Hz]")
    axis.set_title("Campbell diagram: where the orders of i23 meet the natural frequency")
    figure.legend(loc="outside lower center", ncols=3, fontsize=9)
    return figure


def _stability(study: DrivelineStudy) -> Any:
    map_ = study.map
    figure, axes = plt.subplots(
        1, len(map_.ratio), figsize=(2.0 + 3.7 * len(map_.ratio), 5.2), sharey=True, squeeze=False
    )
    k, degrees = study.at_even, np.degrees(map_.bend)
    speed = rev(map_.speed)
    levels, shades = [-1.0, 0.0, 0.01, 0.03, 10.0], ["#ffffff", "#d4d4d4", "#9a9a9a", "#4d4d4d"]
    names = ["stable", "grows below 0.01 k", "0.01 to 0.03 k", "faster"]
    for axis, ratio, growth, unstable in zip(axes[0], map_.ratio, map_.growth, map_.unstable, strict=True):
        # what does not count as unstable is not drawn so, however near
        shown = np.ma.masked_invalid(np.where(unstable, growth / k, np.minimum(growth / k, -1e-9)))
        axis.contourf(speed, degrees, shown, levels=levels, colors=shades)
        if np.any(unstable):
            axis.contour(speed, degrees, shown, levels=[0.0], colors="#1b1b1b", linewidths=1.3)
        rows, columns = np.nonzero(~np.isfinite(growth))
        axis.plot(speed[columns], degrees[rows], label="no steady motion found", **_MISSING)
        axis.set_title(f"damping ratio {ratio:g}")
        _speed_axis(axis, study)
        if study.config.joint != "both":
            axis.axhline(math.degrees(getattr(study.config.line, study.config.joint)), **_AS_GIVEN)
    joint = {
        "alpha1": "bend of the joint on shaft 2",
        "alpha2": "bend of the joint on shaft 3",
        "both": "both bends",
    }
    axes[0][0].set_ylabel(f"{joint[study.config.joint]} [deg]")
    patches = [
        Patch(facecolor=s, edgecolor="#1b1b1b", label=name) for s, name in zip(shades, names, strict=True)
    ]
    figure.legend(
        handles=[*patches, *axes[0][0].get_legend_handles_labels()[0]],
        loc="outside lower center",
        ncols=7 if len(map_.ratio) > 2 else 2 + len(map_.ratio),
        fontsize=9,
    )
    figure.suptitle("Torsional stability (Floquet)")
    return figure


def _resonance(study: DrivelineStudy) -> Any:
    figure, axes = plt.subplots(2, 1, figsize=(8.5, 8.0), sharex=True)
    x = rev(study.speed)
    simulated, found = study.simulated, study.steady
    for axis, number, static in zip(axes, (2, 3), (study.static2, study.config.running.load), strict=True):
        axis.semilogy(x, getattr(found, f"peak{number}"), label="steady motion", **LINES[0])
        if simulated is not None:
            axis.semilogy(
                rev(simulated.speed[study.kept]),
                getattr(simulated, f"peak{number}")[study.kept],
                "o",
                color=LINES[1]["color"],
                fillstyle="none",
                markersize=5.0,
                label="time simulation",
            )
        axis.semilogy(x, getattr(study.rigid, f"peak{number}"), label="rigid shafts", **LINES[2])
        if static > 0.0:
            axis.axhline(static, label="load alone", **LINES[3])
        for i, (low, high) in enumerate(study.unstable_ranges()):
            axis.axvspan(
                rev(low), rev(high), facecolor="#eeeeee", edgecolor=_GREY, hatch="//", linewidth=0.0,
                label=None if i else "unstable",
            )  # fmt: skip
        axis.axvline(rev(study.config.running.speed), **_RUNNING)
        axis.set_ylabel(f"peak torque of shaft {number} [N m]")
        drawn = [getattr(each, f"peak{number}") for each in (found, study.rigid)]
        if max(static, *(float(np.nanmax(y, initial=0.0)) for y in drawn)) < 1e-3:
            axis.set_ylim(1e-3, 1.0)  # nothing to see, not even roundoff
        axis.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"{y:g}"))
        axis.yaxis.set_minor_formatter(FuncFormatter(_some))
    for at, peak in study.resonances():
        running = study.config.running
        left = at < 0.7 * running.speed_low + 0.3 * running.speed_high
        offset, side = (8, "left") if left else (-8, "right")
        axes[0].annotate(f"{rev(at):.0f} rev/min, {peak:.0f} N m", (rev(at), peak), (offset, 2),
                         textcoords="offset points", ha=side, fontsize=9, bbox=_WHITE)  # fmt: skip
    axes[0].margins(y=0.1)
    _speed_axis(axes[0], study, mark=False)
    axes[0].set_xlabel("")
    axes[1].set_xlabel("speed [rev/min]")
    axes[0].set_title(f"Peak torque over speed, damping ratio {study.damping_ratio:.3g}")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=6, fontsize=9)
    return figure


def _some(y: float, _: int) -> str:
    """Labels between powers of ten at 2 and 5 alone."""
    return f"{y:g}" if f"{y:e}"[0] in "25" else ""


def _ratio(study: DrivelineStudy) -> Any:
    figure, (top, bottom) = plt.subplots(2, 1, figsize=(8.0, 6.0), sharex=True)
    degrees = np.degrees(study.angle)
    top.plot(degrees, study.ratio, **LINES[0])
    top.set_ylabel("ratio i23 [1]")
    bottom.plot(degrees, study.frequency / (2.0 * math.pi), **LINES[0])
    bottom.set_ylabel("frozen-angle natural frequency [Hz]")
    bottom.set_xlabel("angle of shaft 2 from the plane of the joint [deg]")
    bottom.set_xticks(range(0, 361, 45))
    bottom.set_xlim(0, 360)
    for axis in (top, bottom):
        axis.ticklabel_format(axis="y", useOffset=False)
    line: Cardan = study.config.line
    top.set_title(
        f"Over a turn: bends {math.degrees(line.alpha1):.3g} and {math.degrees(line.alpha2):.3g} deg"
    )
    return figure
