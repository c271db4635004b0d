"""The answers of `torsion`: warnings and notes in words, and every number for a file."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..drives.cardan import ORDERS, Cardan
from ..drives.torsion import SteadyMotion
from ..text import entries, number
from .result import array_entry
from .torsion import DRIFT, LineAnalysis

ROUNDOFF_TORQUE = 1e-6
"""torque up to which it is none [N.m]"""


def speed_text(*ends: float) -> str:
    """A speed [rad/s], or a range of speeds from one to the other, in words."""
    return " to ".join(number(float(end), "rad/s", "speed", 4) for end in ends)


def _torque(value: float) -> str:
    return number(value, "N.m", digits=4)


def _percent(value: float) -> str:
    return number(value, "1", "percent")


def _ratio(value: float) -> str:
    return number(float(value), "1", digits=5)


def _degrees(value: float) -> str:
    return number(value, "rad")


def notes(analysis: LineAnalysis) -> list[str]:
    """In words, the remarks on the numbers."""
    by = analysis.sensitivity
    names = {"J1": "rotor J1", "J4": "driven inertia J4", "c2": "shaft 2", "c3": "shaft 3"}
    strongest = sorted(by, key=lambda name: -abs(by[name]))
    gains = ", ".join(
        f"{'stiffer' if name[0] == 'c' else 'lighter'} {names[name]}: {_percent(0.01 * abs(by[name]))}"
        for name in strongest
    )
    lines = [f"What raises the natural frequency, per 1 %: {gains}."]
    if analysis.damping_ratio <= 0.0:
        lines.append(
            "Without damping no transient dies: no time simulation, and resonance peaks are bounded by the twist "
            "alone; give damping_ratio, or d2 and d3."
        )
    elif analysis.simulated is None:
        lines.append(
            f"Transients take too long for a time simulation (damping ratio {number(analysis.damping_ratio, '1')}): "
            "the resonance curve is that of the steady motion."
        )
    elif not np.all(analysis.on_speed):
        off = analysis.simulated_speed[~analysis.on_speed]
        lines.append(
            f"The slow control of the time simulation lost the speed at {len(off)} of "
            f"{len(analysis.simulated_speed)} speeds, {speed_text(off.min(), off.max())}; they are not drawn."
        )
    drifting = "; ".join(speed_text(*ends) for ends in analysis.drifting_ranges())
    if drifting:
        lines.append(f"Held by a speed control or slip only, not by a motor of constant torque: {drifting}.")
    lines.append(
        "The resonance curve is that of running at each speed for long; a run-up that passes quickly stays below it."
    )
    return lines


def warnings(analysis: LineAnalysis) -> list[str]:
    """In words and numbers, the changes that an engineer should make."""
    lines: list[str] = []
    at, margin = analysis.rotation.speed, analysis.rotation.margin
    shaken = not math.isclose(float(np.ptp(analysis.ratio)), 0.0, abs_tol=1e-9)
    if shaken:
        for n, (low, high) in analysis.crossings().items():
            near = max(low - at, at - high, 0.0) / at
            if n in ORDERS and near < margin:
                lines.append(
                    f"Running at {speed_text(at)} is {_percent(near)} from where order {n} meets the natural "
                    f"frequency, {speed_text(low, high)}; permitted is {_percent(margin)}: change "
                    f"the speed or the shafts. Amplitude of the order: {_degrees(analysis.excitation[n])}."
                )
    lines += _even_running(analysis.line, analysis.ratio)
    if not analysis.operating.exists[0]:
        lines.append(
            f"No steady motion found at {speed_text(at)}: either none repeats itself each half turn, or the search "
            "did not reach it; more damping or less bend helps both."
        )
    else:
        lines += _at_operation(analysis)
    for low, high in analysis.unstable_ranges():
        lines.append(
            f"Unstable from {speed_text(low, high)} at the damping ratio {number(analysis.damping_ratio, '1')}: "
            "torsional vibration grows by itself (parametric resonance); more damping or less uneven joints end it."
        )
    for low, high in analysis.missing_ranges():
        lines.append(
            f"No steady motion found from {speed_text(low, high)}: either none repeats itself each half turn, or the "
            "search did not reach it."
        )
    return lines


def _at_operation(analysis: LineAnalysis) -> list[str]:
    rotation, motion = analysis.rotation, analysis.operating
    at, lines = rotation.speed, []
    for shaft, peak, static in (
        (2, float(motion.peak2[0]), analysis.static2),
        (3, float(motion.peak3[0]), rotation.load),
    ):
        if static > 0.0 and peak > rotation.factor * static:
            lines.append(
                f"Shaft {shaft} carries {_torque(peak)} at {speed_text(at)}, {number(peak / static, '1')} times "
                f"the torque of the load alone; permitted is {rotation.factor:g}."
            )
    least = float(motion.least2[0])
    if rotation.load > 0.0 and least < 0.0:
        lines.append(
            f"The torque of shaft 2 falls to {_torque(least)} in each half turn: with play in splines and joints, "
            "which is not modelled, it hammers."
        )
    if motion.unstable[0]:
        lines.append(
            f"Running at {speed_text(at)} is unstable: a torsional vibration grows e-fold in "
            f"{number(1.0 / float(motion.growth[0]), 's')}."
        )
    elif motion.free_growth[0] > DRIFT:
        lines.append(
            f"A motor whose torque does not fall with speed would not hold {speed_text(at)}: deviations grow by "
            f"{number(float(motion.free_growth[0]), '1/s')}, as above a resonance faster running takes less torque; "
            "its control, or slip, must outweigh that."
        )
    return lines


def _even_running(line: Cardan, ratio: Any) -> list[str]:
    if float(np.ptp(ratio)) < 1e-6:
        return []
    remedies = []
    if not math.isclose(line.alpha1, line.alpha2, abs_tol=1e-6):
        remedies.append(
            f"make the bends equal (alpha1 = {_degrees(line.alpha1)}, alpha2 = {_degrees(line.alpha2)})"
        )
    off = (line.delta_yokes - line.beta_planes + 0.5 * math.pi) % math.pi - 0.5 * math.pi
    if not math.isclose(off, 0.0, abs_tol=1e-6):
        remedies.append(f"turn the yokes of the middle shaft by {_degrees(-off)} (delta_yokes = beta_planes)")
    return [
        f"Shaft 3 does not run evenly: i23 from {_ratio(np.min(ratio))} to {_ratio(np.max(ratio))}; "
        f"{', and '.join(remedies)}."
    ]


def _speed(x: Any) -> dict[str, Any]:
    return array_entry(x, "rad/s", "speed")


def _frequency(x: Any) -> dict[str, Any]:
    return array_entry(x, "rad/s", "frequency")


def _motion(m: SteadyMotion) -> dict[str, Any]:
    torques = {
        f"{end}_torque{shaft}": getattr(m, f"{end}{shaft}")
        for shaft in (2, 3)
        for end in ("peak", "least", "largest")
    }
    return {
        "found": m.exists.tolist(),
        **{
            name: array_entry(np.where(np.abs(x) < ROUNDOFF_TORQUE, 0.0, x), "N.m")
            for name, x in torques.items()
        },
        "drive_torque": array_entry(m.drive, "N.m"),
        "growth": array_entry(m.growth, "1/s"),
        "largest_multiplier": array_entry(m.multiplier, "1"),
        "growth_with_constant_torque": array_entry(m.free_growth, "1/s"),
        "frequency": _frequency(m.frequency),
    }


def as_dict(analysis: LineAnalysis) -> dict[str, Any]:
    """Ready for JSON, each number with its unit; null without a steady motion."""
    band, simulated = analysis.band, analysis.simulated
    return {
        "driveline": entries(analysis.line),
        "running": entries(analysis.rotation),
        "damping_ratio": array_entry(analysis.damping_ratio, "1"),
        "natural_frequency": {
            "even": _frequency(analysis.at_even),
            "least": _frequency(band.least),
            "largest": _frequency(band.largest),
            "at_ratio_zero": _frequency(band.at_zero),
            "at_ratio_infinite": _frequency(band.at_infinity),
        },
        "sensitivity": {name: array_entry(x, "1") for name, x in analysis.sensitivity.items()},
        "ratio": {
            "least": array_entry(np.min(analysis.ratio), "1"),
            "largest": array_entry(np.max(analysis.ratio), "1"),
        },
        "excitation": {f"order {n}": array_entry(x, "rad") for n, x in analysis.excitation.items()},
        "crossings": {f"speed = k/{n}": _speed(ends) for n, ends in analysis.crossings().items()},
        "operating": {"static_torque2": array_entry(analysis.static2, "N.m"), **_motion(analysis.operating)},
        "resonance": {
            "speed": _speed(analysis.speed),
            **_motion(analysis.steady),
            "peaks": {
                "speed": _speed([at for at, _ in analysis.resonances()]),
                "torque2": array_entry([peak for _, peak in analysis.resonances()], "N.m"),
            },
            "rigid_torque2": array_entry(analysis.rigid.peak2, "N.m"),
            "rigid_torque3": array_entry(analysis.rigid.peak3, "N.m"),
            "unstable": _speed(analysis.unstable_ranges()),
            "no_steady_motion": _speed(analysis.missing_ranges()),
        },
        "simulation": None
        if simulated is None
        else {
            "asked_speed": _speed(analysis.simulated_speed),
            "speed": _speed(simulated.speed),
            "peak_torque2": array_entry(simulated.peak2, "N.m"),
            "peak_torque3": array_entry(simulated.peak3, "N.m"),
        },
        "stability": {
            "joint": analysis.map.joint,
            "speed": _speed(analysis.map.speed),
            "bend": array_entry(analysis.map.bend, "rad"),
            "damping_ratio": array_entry(analysis.map.ratio, "1"),
            "growth": array_entry(analysis.map.growth, "1/s"),
        },
        "warnings": warnings(analysis),
        "notes": notes(analysis),
    }
