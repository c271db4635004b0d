"""The section on the torsion of a driveline in rotation: natural frequency, resonance and stability."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...drives.cardan import ORDERS
from ...reading.text import number as number_words
from ...report import blocks as b
from ...report import figure as fig
from ...report.cited import cited, number
from ...report.lines import Line, line
from ...study.record import StudyRecord
from .findings import TorsionFindings
from .table import JOINTS

PICTURES = ("campbell.png", "stability.png", "resonance.png", "ratio.png")
_OVER_BOTH = "over the turns of shaft and machine"
"""The range of natural frequencies that an order may meet: i23 varies over a turn of the shaft, the inertia over a
turn of the machine."""


def blocks(study: StudyRecord) -> Iterator[b.Block]:
    """A text on the line, the tables of its numbers, and the figures."""
    analysis = TorsionFindings.of_study(study.findings)
    lead = (
        "This section is on the line alone, between the rotor J1 and the machine J4. Shaft 2 belongs to the motor, "
        "shaft 3 to the machine, and a cardan shaft with two joints connects them. Shaft 3 turns i23 times as fast "
        "as shaft 2. Bent joints vary this ratio twice a turn (order 2); large bends vary it four times a turn, too "
        "(order 4). The motor gives a constant torque."
    )
    yield b.Text(lead, "lead", "long")
    yield b.Table(tuple(b.TableRow(row) for row in _numbers(analysis)), title="Torsion of the driveline")
    yield b.Table(
        tuple(b.TableRow(row) for row in _ranges(analysis)),
        b.heads("", "from", "to"),
        title="Torsion of the driveline: ranges",
    )
    yield from (_campbell(analysis), _stability(analysis), _resonance(analysis), _ratio(analysis))


def _numbers(analysis: TorsionFindings) -> Iterator[tuple[Line, Line]]:
    """Rows with a title and a number."""
    x = cited(analysis, "findings.torsion")
    yield "inertia J1 of the rotor, at the shaft", number(x.line.J1, 4)
    yield "inertia J4 on shaft 3, with the machine's mean", number(x.line.J4, 4)
    yield "speed of the shaft in normal running", number(x.rotation.speed, 4)
    yield "mean torque on J4", number(x.rotation.load, 4)
    yield "natural frequency at i23 = 1", number(x.natural_frequency.even, 5)
    yield "damping ratio", number(x.damping_ratio)
    for n in ORDERS:
        title = f"amplitude by which order {n} turns shaft 3, {n} times a turn"
        yield title, number(x.orders[f"order {n}"])
    if analysis.operating.motion.exists[0]:
        yield (
            "Floquet multiplier in normal running, per half turn (stable below 1)",
            number(x.operating.motion.multiplier[0], 4),
        )
    else:
        yield "steady motion in normal running", "not found"
    peaks = x.resonance.peaks
    for speed, torque in zip(peaks.speed, peaks.torque2, strict=True):
        yield line("resonance: largest torque in shaft 2 at ", number(speed, 4)), number(torque, 4)


def _ranges(analysis: TorsionFindings) -> Iterator[tuple[Line, Line, Line]]:
    """Rows with a title and the two ends of a range."""

    def ends(least: object, largest: object, digits: int = 4) -> tuple[Line, Line]:
        return number(least, digits), number(largest, digits)

    x = cited(analysis, "findings.torsion")
    frequency, motion = x.natural_frequency, x.operating.motion
    yield "ratio i23, over a turn of the shaft", *ends(x.ratio_ends.least, x.ratio_ends.largest, 5)
    yield "natural frequency, over a turn of the shaft", *ends(frequency.least, frequency.largest, 5)
    yield f"natural frequency, {_OVER_BOTH}", *ends(*frequency.over_both_turns, 5)
    for n in ORDERS:
        if analysis.excitation[n]:
            title = f"speed at which order {n} meets the natural frequency, {_OVER_BOTH}"
            yield title, *ends(*x.crossing_speeds[f"speed = k/{n}"])
    if analysis.operating.motion.exists[0]:
        yield "torque of shaft 2 in normal running", *ends(motion.least2[0], motion.largest2[0])
        yield "torque of shaft 3 in normal running", *ends(motion.least3[0], motion.largest3[0])
    for low, high in x.resonance.unstable:
        yield "speed at which the line is unstable", *ends(low, high)
    for low, high in x.resonance.no_steady_motion:
        yield "speed at which the stability is unknown", *ends(low, high)
    if not analysis.resonance.unstable:
        yield "speed at which the line is unstable", "nowhere", ""


# -- figures


def _speed_axis(analysis: TorsionFindings) -> fig.Axis:
    low, high = _speed_ends(analysis)
    return fig.Axis("speed of the shaft", "rad/s", "speed", low=low, high=high)


def _speed_ends(analysis: TorsionFindings) -> tuple[float, float]:
    speed, ranges = analysis.rotation.speed, analysis.ranges
    return float(ranges.slowest * speed), float(ranges.fastest * speed)


def _running(analysis: TorsionFindings) -> fig.Mark:
    return fig.Mark(analysis.rotation.speed, "normal running", look="reference")


def _campbell(analysis: TorsionFindings) -> fig.Figure:
    """Orders of the ratio i23 and the damped natural frequency over the speed."""
    curve, motion, axis = analysis.resonance, analysis.resonance.motion, _speed_axis(analysis)
    slowest, fastest = _speed_ends(analysis)
    low, high = analysis.natural_frequency.over_both_turns
    ends = np.array([0.0, fastest])
    places = np.flatnonzero(motion.exists & ~motion.unstable)[::4]
    damped = curve.speed[places], motion.frequency[places]
    crossings = {n: 0.5 * (first + last) for n, (first, last) in analysis.crossings.items()}
    items: tuple[fig.Item, ...] = (
        fig.Shade(low, high, f"natural frequency {_OVER_BOTH}", "y", "band"),
        fig.Curve("damped frequency in rotation (Floquet)", *damped, 2, "+", has_line=False),
        *(fig.Curve(f"order {n} of i23", ends, n * ends, look) for look, n in enumerate(ORDERS)),
        fig.Curve("order 1: parametric resonance at speed = k", ends, ends, 3),
        _running(analysis),
        *(
            fig.Label(speed, 0.5 * (low + high), "k" if n == 1 else f"k/{n}", "above")
            for n, speed in crossings.items()
            if slowest < speed < fastest
        ),
    )
    y = fig.Axis("frequency", "rad/s", "frequency", low=0.0, high=1.7 * high)
    title = "Where the orders of i23 meet the natural frequency k of torsion"
    return fig.Figure(
        "campbell",
        "Campbell diagram of the driveline",
        "Natural frequency of torsion and the orders of the ratio i23 over the speed of the shaft.",
        ((fig.Panel(axis, y, items, title),),),
        file="campbell.png",
        heights=(2.0,),
    )


def _stability(analysis: TorsionFindings) -> fig.Figure:
    """A map of the growth of a disturbance over speed and bend, for each damping ratio."""
    grid, k = analysis.map, analysis.natural_frequency.even
    levels = -1.0, 0.0, 0.01, 0.03, 10.0
    names = "stable", "grows below 0.01 k", "0.01 to 0.03 k", "faster"
    y = fig.Axis(JOINTS[grid.joint], "rad", low=float(grid.bend[0]), high=float(grid.bend[-1]))
    panels = []
    for ratio, growth, unstable in zip(grid.ratio, grid.growth, grid.unstable, strict=True):
        # a point that does not count as unstable is not drawn as unstable, however near it is
        z = np.where(unstable, growth / k, np.minimum(growth / k, -1e-9))
        bold = 0.0 if np.any(unstable) else None
        items: list[fig.Item] = [fig.Field(grid.speed, grid.bend, z, levels, names, bold), _running(analysis)]
        rows, columns = np.nonzero(~np.isfinite(growth))
        if rows.size:
            gaps = grid.speed[columns], grid.bend[rows]
            items.append(fig.Curve("no steady motion found", *gaps, 1, "x", has_line=False))
        if grid.joint != "both":
            items.append(fig.Mark(getattr(analysis.line, grid.joint), "bend as given", axis="y", look=3))
        title = f"damping ratio {number_words(ratio, '1', full=False)}"
        panels.append(fig.Panel(_speed_axis(analysis), y, tuple(items), title))
    return fig.Figure(
        "stability",
        "Torsional stability of the driveline (Floquet)",
        "Where torsional disturbances grow, over speed and bend, for each damping ratio.",
        (tuple(panels),),
        caption="Growth of a torsional disturbance per second, in parts of the natural frequency k.",
        file="stability.png",
        heights=(1.6,),
        level=True,
    )


def _resonance(analysis: TorsionFindings) -> fig.Figure:
    """The peak torque of each shaft over the speed: elastic, rigid, and by simulation in time."""
    curve, simulation, panels = analysis.resonance, analysis.simulation, []
    for shaft, static in ((2, analysis.operating.static_torque2), (3, analysis.rotation.load)):
        steady, rigid = (np.asarray(getattr(x, f"peak{shaft}")) for x in (curve.motion, curve.rigid))
        items: list[fig.Item] = [
            fig.Curve("steady motion", curve.speed, steady),
            fig.Curve("rigid shafts", curve.speed, rigid, 2),
            *(fig.Shade(low, high, "unstable") for low, high in curve.unstable),
            _running(analysis),
        ]
        if simulation is not None:
            speed, torque = simulation.speed, getattr(simulation, f"peak{shaft}")
            points = speed[analysis.on_speed], torque[analysis.on_speed]
            items.append(fig.Curve("time simulation", *points, 1, "o", has_line=False))
        if static > 0.0:
            items.append(fig.Mark(static, "load alone", axis="y", look=3))
        if shaft == 2:
            items += [
                fig.Label(speed, peak, number_words(peak, "N.m", digits=4), "above")
                for speed, peak in zip(curve.peaks.speed, curve.peaks.torque2, strict=True)
            ]
        # torques that are all zero get an axis that hides their roundoff
        largest = max(static, *(float(np.nanmax(y, initial=0.0)) for y in (steady, rigid)))
        low, high = (1e-3, 1.0) if largest < 1e-3 else (None, None)
        y = fig.Axis("peak torque", "N.m", low=low, high=high, log=True)
        panels.append((fig.Panel(_speed_axis(analysis), y, tuple(items), f"shaft {shaft}"),))
    return fig.Figure(
        "resonance",
        f"Peak torque of the driveline over speed, damping ratio {number_words(analysis.damping_ratio, '1')}",
        "Peak torques of shafts 2 and 3 over the speed, elastic and rigid.",
        tuple(panels),
        file="resonance.png",
        heights=(1.3, 1.3),
    )


def _ratio(analysis: TorsionFindings) -> fig.Figure:
    """The ratio of the joints and the natural frequency over a turn of the shaft."""
    turn = fig.Axis(
        "angle of shaft 2 from the plane of the joint", "rad", low=0.0, high=2.0 * np.pi, step=45.0
    )
    bends = (number_words(bend, "rad") for bend in (analysis.line.alpha1, analysis.line.alpha2))
    frequency = fig.Axis("natural frequency", "rad/s", "frequency")
    panels = (
        ("ratio i23 of shaft 3 to shaft 2", fig.Axis("ratio i23"), analysis.ratio),
        ("natural frequency of the line at rest at this angle", frequency, analysis.frequency),
    )
    return fig.Figure(
        "ratio",
        f"The driveline over a turn of the shaft: bends {' and '.join(bends)}",
        "Ratio i23 and frozen-angle natural frequency over a turn of the shaft, with the machine's mean inertia.",
        tuple(
            (fig.Panel(turn, y, (fig.Curve(y.label, analysis.angle, values, in_legend=False),), title),)
            for title, y, values in panels
        ),
        file="ratio.png",
    )
