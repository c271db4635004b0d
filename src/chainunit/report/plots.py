"""Plots of a study."""

from __future__ import annotations

import math
from functools import partial
from itertools import cycle
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

from ..drives.dc_motor import DcMotor
from ..engines import numpy_
from ..studies.bearings import PINS
from ..studies.chain import HIGH
from ..studies.events import in_groups
from ..studies.shaft import RIGID
from ..studies.study import Study
from .style import LINES, WIDE, draw

NAMES = (
    "torque_angle.png",
    "sides_over_speed.png",
    "speed_loop.png",
    "overload_time.png",
    "torque_speed.png",
    "reactions.png",
    "start_up.png",
    "driveline.png",
    "chain_sweep.png",
)


def write(study: Study, folder: Path) -> list[Path]:
    """Write every plot that the study has data for; returns the files."""
    plots = {"torque_angle.png": _torque_angle, "sides_over_speed.png": _sides_over_speed}
    if study.statics.loops:
        plots["speed_loop.png"] = _speed_loop
    if any(name in study.runs for name in study.config.events):
        plots |= {
            "overload_time.png": _overload_time,
            "torque_speed.png": _torque_speed,
            "reactions.png": _reactions,
        }
    if "start_up" in study.runs:
        plots["start_up.png"] = _start_up
    if study.shaft:
        plots["driveline.png"] = _driveline
    if study.chain is not None and len(study.chain.sweep) > 1:
        plots["chain_sweep.png"] = _chain_sweep
    return draw({name: partial(make, study) for name, make in plots.items()}, folder)


def _torque_angle(study: Study) -> Any:
    figure, (top, bottom) = plt.subplots(2, 1, figsize=(8, 6.5), sharex=True)
    for line, (name, c) in zip(cycle(LINES), study.statics.cycles.items(), strict=False):
        degrees = np.degrees(c.angle)
        top.plot(degrees, c.crank_torque, label=name, **line)
        bottom.plot(degrees, c.outputs.rocker.tau, label=name, **line)
    top.set_ylabel("crank torque [N m]")
    bottom.set_ylabel("rocker torque from organs [N m]")
    bottom.set_xlabel("crank angle from the upward vertical [deg]")
    bottom.set_xticks(range(0, 361, 45))
    bottom.set_xlim(0, 360)
    top.set_title(f"One turn at constant {study.config.run.crank_speed:g} rad/s")
    top.legend(loc="upper center", ncols=3, bbox_to_anchor=(0.5, -0.02), fontsize=9)
    return figure


def _sides_over_speed(study: Study) -> Any:
    sides = study.statics.sides
    assert sides is not None
    figure, axes = plt.subplots(1, 2, figsize=(10, 5), sharex=True)
    for axis, (torque, crossings) in zip(axes, sides.crossings().items(), strict=True):
        axis.plot(sides.speed, getattr(sides, f"{torque}_both"), label="both organs", **LINES[0])
        for line, (side, speeds) in zip(LINES[1:], crossings.items(), strict=False):
            alike = " and ".join(f"{at:.2f}" for at in speeds)
            label = f"{side} organ alone" + (f", as both at {alike} rad/s" if alike else "")
            axis.plot(sides.speed, getattr(sides, f"{torque}_{side}"), label=label, **line)
            for at in speeds:
                axis.axvline(at, color=line["color"], linewidth=0.8)
        axis.set_xlabel("crank speed [rad/s]")
        axis.set_ylabel(f"{torque} torque, largest of the turn [N m]")
        axis.set_xlim(0.0, sides.speed[-1])
        axis.set_ylim(bottom=0.0)
        axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.13), fontsize=9)
    figure.suptitle("One side alone against both")
    return figure


def _speed_loop(study: Study) -> Any:
    figure, axes = plt.subplots(1, 2, figsize=(10, 4.6), width_ratios=(1.0, 1.0))
    gain, step = axes
    phase = gain.twinx()
    for line, (name, found) in zip(LINES, study.statics.loops.items(), strict=False):
        gain.loglog(found.frequency, found.gain, label=name, **line)
        phase.semilogx(found.frequency, found.phase, **{**line, "linewidth": 0.8})
        step.plot(found.time, found.deviation, label=name, **line)
    gain.axhline(1.0, color="#777777", linewidth=0.8)
    gain.set_xlabel("frequency [rad/s]")
    gain.set_ylabel("gain of the open speed loop [1], bold")
    phase.set_ylabel("phase [deg], thin")
    phase.set_ylim(-270.0, 0.0)
    phase.set_yticks(range(-270, 1, 45))
    phase.grid(visible=False)
    gain.set_title("Bode plot")
    step.set_xlabel("time after a step of the load torque [s]")
    step.set_ylabel("deviation of the motor speed [(rad/s)/(N m)]")
    step.set_title("Disturbance step")
    step.set_xlim(0.0, max(found.settling for found in study.statics.loops.values()) * 1.5)
    step.legend(loc="lower right")
    return figure


def _series(study: Study, name: str) -> tuple[Any, Any, Any, Any]:
    run, drive = study.runs[name], study.drive
    time = run["time"].values - study.event.get(name, 0.0)
    return (
        time,
        drive.crank_torque(run),
        drive.crank_motion(run)[1],
        run[f"motor.{study.drive.motor.current}"].values,
    )


def _start_up(study: Study) -> Any:
    figure, axes = plt.subplots(3, 1, figsize=(8, 7), sharex=True)
    time, torque, speed, current = _series(study, "start_up")
    for axis, y, label in zip(
        axes,
        (speed, torque, current),
        ("crank speed [rad/s]", "crank torque [N m]", "motor current [A]"),
        strict=True,
    ):
        axis.plot(time, y, **LINES[0])
        axis.set_ylabel(label)
    if study.drive.follows:
        reference = study.runs["start_up"]["motor.w_ref"].values / study.drive.ratio
        axes[0].plot(time, reference, label="reference", **LINES[1])
        axes[0].legend(loc="lower right")
    axes[0].set_title("Start-up under load and steady running")
    axes[-1].set_xlabel("time [s]")
    axes[-1].set_xlim(time[0], time[-1])
    return figure


def _overload_time(study: Study) -> Any:
    """A band of three rows for each side, the scales alike in all."""
    groups = in_groups(study.config.events, study.runs)
    widest = max(len(names) for names in groups)
    figure, axes = plt.subplots(
        3 * len(groups), widest, figsize=(4.2 * widest, 7.5 * len(groups)), squeeze=False
    )
    labels = ("crank torque [N m]", "crank speed [rad/s]", "motor current [A]")
    for kind in range(3):
        alike = axes[kind::3].ravel()
        for axis in alike[1:]:
            axis.sharey(alike[0])
    for band, names in enumerate(groups):
        rows = axes[3 * band : 3 * band + 3]
        for column in rows.T[len(names) :]:
            for axis in column:
                axis.remove()
        for column, name in zip(rows.T, names, strict=False):
            time, torque, speed, current = _series(study, name)
            for axis, y in zip(column, (torque, speed, current), strict=True):
                axis.plot(time, y, **LINES[0])
                axis.set_xlim(time[0], time[-1])
            if study.drive.motor is DcMotor:
                column[2].axhline(study.motor.limit.i, label="current limit", **LINES[1])
            column[0].set_title(study.called(name))
            column[-1].set_xlabel("time after the event [s]")
        for axis, label in zip(rows[:, 0], labels, strict=True):
            axis.set_ylabel(label)
    if study.drive.motor is DcMotor:
        axes[2, 0].legend(loc="center right", fontsize=9)
    return figure


def _driveline(study: Study) -> Any:
    names = list(study.shaft)
    largest = max(answers.range_largest for answers in study.shaft.values())
    figure, axes = plt.subplots(
        2,
        len(names),
        figsize=(3.6 * len(names) + 1.0, 6.5),
        squeeze=False,
        sharey="row",
        height_ratios=(1.6, 1.0),
        layout="constrained",
    )
    for (top, bottom), name in zip(axes.T, names, strict=True):
        run = study.runs["start_up" if name == "steady" else name]
        since = study.settled if name == "steady" else study.event[name]
        run = run.sel(time=slice(since, None))
        time = run["time"].values - since
        top.plot(time, run["driveline.tau2"], label="with this driveline", **LINES[0])
        top.plot(time, run[RIGID], label="with a rigid shaft", **LINES[1])
        top.set_title(study.called(name), fontsize=10)
        top.set_xlabel("time [s]")
        top.set_xlim(time[0], time[-1])
        rows = study.cycles_of[name].classes(largest)
        bottom.barh(
            [0.5 * (row["from"] + row["to"]) for row in rows],
            [row["count"] for row in rows],
            [0.9 * (row["to"] - row["from"]) for row in rows],
            color="#8a8a8a",
            edgecolor="#1b1b1b",
            linewidth=0.6,
        )
        bottom.set_xlabel("cycles counted (rainflow)")
        bottom.set_xlim(left=0.0)
    axes[0, 0].set_ylabel("torque in shaft 2 [N m]")
    axes[1, 0].set_ylabel("range of torque [N m]")
    axes[0, 0].legend(loc="best", fontsize=9)
    return figure


def _chain_sweep(study: Study) -> Any:
    found = study.chain
    assert found is not None
    rows = found.sweep
    speed = [n.speed for n in rows]
    figure, axes = plt.subplots(3, 1, figsize=(8, 8.6), sharex=True, height_ratios=(1.0, 1.0, 0.62))
    for axis, name in zip(axes, ("rocker", "crank"), strict=False):
        median, high, two = (
            np.array([getattr(n, size) for n in rows])
            for size in (f"{name}_torque_median", f"{name}_torque_high", f"two_bar_{name}_torque")
        )
        axis.fill_between(
            speed,
            median,
            high,
            facecolor="#a9a9a9",
            edgecolor="#1b1b1b",
            linewidth=0.5,
            label=f"chains, up to the {100 * HIGH:g} % quantile",
        )
        axis.plot(speed, median, marker="o", markersize=4, label="chains, median", **LINES[0])
        axis.plot(speed, two, marker="s", markersize=3.5, label="two bars", **LINES[1])
        axis.set_ylabel(f"{name} torque, peak [N m]")
        least = min(median.min(), two.min())
        if max(high.max(), two.max()) > WIDE * max(least, 1e-9):
            axis.set_yscale("log")
        else:
            axis.set_ylim(bottom=0.0)
    axes[2].plot(
        speed, [100.0 * n.slack_time for n in rows], marker="o", markersize=4, label="chains", **LINES[0]
    )
    axes[2].plot(
        speed,
        [100.0 * n.two_bar_slack_time for n in rows],
        marker="s",
        markersize=3.5,
        label="two bars",
        **LINES[1],
    )
    axes[2].set_ylabel("time slack [%]")
    axes[2].set_ylim(-4.0, 104.0)
    axes[2].set_xlabel("crank speed [rad/s]")
    axes[2].set_xlim(speed[0], speed[-1])
    for axis in axes:
        for i, band in enumerate(found.avoid):
            axis.axvspan(
                band.low, band.high, color="#ececec", linewidth=0.0, zorder=0, label="" if i else "to avoid"
            )
        axis.axvline(found.own.speed, label="the study's speed", **LINES[2])
    labelled = found.within_sweep(0.018)
    for mode, order, at in found.within_sweep():
        for axis in axes:
            axis.axvline(at, color="#777777", linewidth=0.8)
        if (mode, order, at) in labelled:
            axes[0].annotate(
                f"mode {mode}" + (f", order {order}" if order > 1 else ""),
                (at, 1.0),
                (0.0, 3.0),
                xycoords=("data", "axes fraction"),
                textcoords="offset points",
                rotation=90,
                fontsize=8,
                ha="center",
                va="bottom",
            )
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=9)
    figure.suptitle(f"Chains and two bars over the crank speed: {found.starts} starts of {found.turns} turns")
    return figure


def _torque_speed(study: Study) -> Any:
    """The start, and beside it the overloads of each side, at a scale of their own."""
    groups = [["start_up"], *in_groups(study.config.events, study.runs)]
    figure, axes = plt.subplots(1, len(groups), figsize=(1.0 + 4.6 * len(groups), 5.5))
    for axis, names in zip(axes, groups, strict=True):
        slowest, fastest = math.inf, 0.0
        for line, name in zip(cycle(LINES), names, strict=False):
            # an overload from its event on; what was before is the steady running of the first panel
            run = study.runs[name].sel(time=slice(study.event.get(name), None))
            title = "start-up and steady" if name == "start_up" else study.called(name)
            axis.plot(run["motor.w"], run["motor.air_gap_tau"], label=title, **line)
            slowest = min(slowest, float(run["motor.w"].min()))
            fastest = max(fastest, float(run["motor.w"].max()))
        room = 0.15 * (fastest - slowest)
        w = np.linspace(slowest - room if slowest < 0.0 else max(0.0, slowest - room), fastest + room, 200)
        limit = study.drive.motor.limit(numpy_(), study.motor, w)
        axis.plot(w, limit, color="#777777", linewidth=3.0, alpha=0.6, label="limit of the drive")
        axis.set_xlim(w[0], w[-1])
        axis.set_xlabel("motor speed [rad/s]")
        axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.13), fontsize=9)
    axes[0].set_ylabel("air-gap torque [N m]")
    figure.suptitle("Torque-speed trajectories: the start, and the overloads from their event on")
    return figure


def _reactions(study: Study) -> Any:
    names = list(study.pins)
    figure, axis = plt.subplots(figsize=(8, 3.5 + 0.5 * len(names)))
    height = 0.8 / len(names)
    hatches = ("", "//", "xx", "..", "\\\\", "++", "--", "oo")
    shades = ("#1b1b1b", "#8a8a8a", "#c8c8c8", "#efefef", "#5a5a5a", "#b0b0b0", "#dcdcdc", "#ffffff")
    rows = np.arange(len(PINS))
    for i, name in enumerate(names):
        peaks = [study.pins[name][pin]["peak"] for pin in PINS]
        axis.barh(
            rows + i * height,
            peaks,
            height,
            label=study.called(name),
            color=shades[i % len(shades)],
            hatch=hatches[(i + i // len(shades)) % len(hatches)],
            edgecolor="#1b1b1b",
            linewidth=0.6,
        )
    axis.set_yticks(rows + 0.4 - height / 2, list(PINS))
    axis.invert_yaxis()
    axis.set_xlabel("largest reaction [N]")
    axis.set_title("What the bearings carry")
    axis.grid(axis="y", visible=False)
    axis.legend(loc="lower right")
    return figure
