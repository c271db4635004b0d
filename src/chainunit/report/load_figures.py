"""Figures of the load in steady running: power over the turn of the crank, and how long each torque lasts."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from ..study.drive import Drive
from ..study.readings import crank_motion, crank_torque, shaft_power
from ..study.window import mean
from . import figure as fig
from .turn import last_turn

if TYPE_CHECKING:
    import xarray as xr

_CLASSES = 40
"""Classes of a histogram."""


def power_over_turn(drive: Drive, steady: xr.Dataset, angle: fig.Axis) -> fig.Figure:
    """The power at crank and motor over the last turn of steady running."""
    phi, speed = crank_motion(drive, steady)
    driver = drive.driver_noun
    powers = {driver: crank_torque(drive, steady) * speed, "shaft of the motor": shaft_power(drive, steady)}
    if "motor.supply_power" in steady:
        powers["supply of the motor"] = steady["motor.supply_power"].values
    curves = [
        fig.Curve(name, *last_turn(phi, power), look) for look, (name, power) in enumerate(powers.items())
    ]
    return fig.Figure(
        "power-turn",
        "Power over a turn in steady running",
        f"The power at {', '.join(powers)} over the {driver} angle in the last turn of steady running.",
        ((fig.Panel(angle, fig.Axis("power", "W"), (*curves, fig.Mark(0.0, axis="y", look="thin"))),),),
        "Below zero the machine gives power back.",
    )


def load_histogram(drive: Drive, steady: xr.Dataset) -> fig.Figure:
    """The share of the time in which the torque lies in each class: at the crank and, where it is known, in the air
    gap of the motor, which the inertia of its rotor and a flywheel make smoother."""
    driver = drive.driver_noun
    torques = {f"{driver} torque": crank_torque(drive, steady)}
    if "motor.air_gap_tau" in steady:
        torques["air-gap torque of the motor"] = steady["motor.air_gap_tau"].values
    panels = []
    for name, torque in torques.items():
        edges, shares = histogram(steady["time"].values, torque)
        values = tuple(_marks(steady, torque))
        bars = fig.Between(
            "", np.repeat(edges, 2)[1:-1], np.zeros(2 * len(shares)), np.repeat(shares, 2), "band"
        )
        y = fig.Axis("share of the time", "1", "percent", low=0.0, high=1.08 * float(np.max(shares)))
        panels.append(fig.Panel(fig.Axis(name, "N.m"), y, (bars, *values)))
    return fig.Figure(
        "load-histogram",
        "Histogram of the load in steady running",
        f"The share of the time in which the {' and the '.join(torques)} lies in each class.",
        (tuple(panels),),
        f"Classes of equal width, over whole turns of the {driver}. Between the {driver} and the air gap, rotor and "
        "flywheel store energy.",
    )


def histogram(time: np.ndarray, torque: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The edges of the classes [N m], shape (classes + 1,), and the share of the time in each; between two instants
    the torque counts as their mean."""
    middle, spans = 0.5 * (torque[1:] + torque[:-1]), np.diff(time)
    low, high = float(np.min(middle)), float(np.max(middle))
    wide = max(high - low, 1e-9 * max(abs(low), abs(high)), 1e-12)
    counts, edges = np.histogram(middle, _CLASSES, (low, low + wide), weights=spans)
    return edges, counts / np.sum(counts)


def _marks(steady: xr.Dataset, torque: np.ndarray) -> Iterator[fig.Mark]:
    yield fig.Mark(mean(steady, torque), "mean", look="mark")
    yield fig.Mark(math.sqrt(mean(steady, torque**2)), "RMS", look="reference")
