"""The report on a driveline: natural frequency, resonance and stability in rotation."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..drives.cardan import ORDERS
from ..study.driveline import DrivelineStudy, as_dict
from ..study.torsion import LineAnalysis
from ..text import number
from . import blocks as b
from . import figure as fig
from .lines import Line, joined, line

KIND = "Driveline: natural frequency, resonance and stability in rotation"
PICTURES = ("campbell.png", "stability.png", "resonance.png", "ratio.png")
_JOINTS = {
    "alpha1": "bend of the joint on shaft 2",
    "alpha2": "bend of the joint on shaft 3",
    "both": "both bends",
}


def report(study: DrivelineStudy) -> b.Report:
    """The report."""
    s, analysis = b.Source(as_dict(study)), study.analysis
    answer = (b.Table(tuple(b.TableRow(row) for row in _rows(s, analysis))), *s.conclusions())
    figures = (_campbell(analysis), _stability(analysis), _resonance(analysis), _ratio(analysis))
    given = b.Given(
        (s.given("Driveline", analysis.line, "driveline"), s.given("Running", analysis.rotation, "running"))
    )
    sections = (
        b.Section("answer", "The answer", answer),
        b.Section("plots", "Plots", figures),
        b.Section("given", "All that was given", (given,)),
    )
    return b.Report(study.title, KIND, s.result, (), sections, source=s.line("chainunit {chainunit}"))


def _rows(s: b.Source, analysis: LineAnalysis) -> Iterator[tuple[Line, Line]]:
    """The answers on a line, one in each row."""

    def ends(path: str, *item: int) -> Line:
        return joined((s.number(path, *item, end, digits=4) for end in (0, 1)), " to ")

    def ranges(path: str, count: int) -> Line:
        return joined((ends(path, i) for i in range(count)), "; ")

    yield "natural frequency at i23 = 1", s.line("{natural_frequency.even:5}")
    band = "{natural_frequency.least:5} to {natural_frequency.largest:5}"
    yield "its range over a turn, frozen angle", s.line(band)
    yield "ratio i23", s.line("{ratio.least:5} to {ratio.largest:5}")
    for n in analysis.excitation:
        yield f"amplitude of shaft 3 at order {n}", s.number(f"excitation.order {n}")
    yield "damping ratio", s.number("damping_ratio")
    for n in ORDERS:
        if analysis.excitation[n]:
            yield f"order {n} meets it at", ends(f"crossings.speed = k/{n}")
    for i in range(len(analysis.resonances())):
        at, peak = (s.number(f"resonance.peaks.{name}", i, digits=4) for name in ("speed", "torque2"))
        yield line("resonance peak at ", at), line(peak, " in shaft 2")
    if analysis.operating.exists[0]:
        for shaft in (2, 3):
            torques = (
                s.number(f"operating.{end}_torque{shaft}", 0, digits=4) for end in ("least", "largest")
            )
            yield s.line(f"shaft {shaft} at {{running.speed:4}}"), joined(torques, " to ")
        multiplier = s.number("operating.largest_multiplier", 0, digits=4)
        yield "Floquet multiplier there, per half turn", multiplier
    else:
        yield s.line("steady motion at {running.speed:4}"), "not found"
    unstable, unknown = analysis.unstable_ranges(), analysis.missing_ranges()
    nowhere = "nowhere else" if unknown else "nowhere in the range"
    yield "unstable", ranges("resonance.unstable", len(unstable)) or nowhere
    if unknown:
        yield "whether it is stable is not known", ranges("resonance.no_steady_motion", len(unknown))


# -- figures


def _speed_axis(analysis: LineAnalysis) -> fig.Axis:
    running = analysis.rotation
    return fig.Axis("speed", "rad/s", "speed", low=running.speed_low, high=running.speed_high)


def _running(analysis: LineAnalysis) -> fig.Mark:
    return fig.Mark(analysis.rotation.speed, "running", look="reference")


def _campbell(analysis: LineAnalysis) -> fig.Figure:
    band, running = analysis.band, analysis.rotation
    ends = np.array([0.0, running.speed_high])
    places = np.flatnonzero(analysis.steady.exists & ~analysis.steady.unstable)[::4]
    damped, frequency = "damped frequency in rotation (Floquet)", analysis.steady.frequency
    middle = 0.5 * (band.least + band.largest)
    crossed = {n: 0.5 * (low + high) for n, (low, high) in analysis.crossings().items()}
    items: tuple[fig.Item, ...] = (
        fig.Shade(band.least, band.largest, "natural frequency over a turn, frozen angle", "y", "band"),
        fig.Curve(damped, analysis.speed[places], frequency[places], 2, "+", joined=False),
        *(fig.Curve(f"order {n}", ends, n * ends, look) for look, n in enumerate(ORDERS)),
        fig.Curve("order 1: parametric resonance at speed = k", ends, ends, 3),
        _running(analysis),
        *(
            fig.Label(at, middle, "k" if n == 1 else f"k/{n}", "above")
            for n, at in crossed.items()
            if running.speed_low < at < running.speed_high
        ),
    )
    y = fig.Axis("frequency", "rad/s", "frequency", low=0.0, high=1.7 * band.largest)
    return fig.Figure(
        "campbell",
        "Campbell diagram: where the orders of i23 meet the natural frequency",
        "Natural frequency and the orders of the ratio i23 over the speed.",
        ((fig.Panel(_speed_axis(analysis), y, items),),),
        file="campbell.png",
        heights=(2.0,),
    )


def _stability(analysis: LineAnalysis) -> fig.Figure:
    grid, k = analysis.map, analysis.at_even
    levels, names = (
        (-1.0, 0.0, 0.01, 0.03, 10.0),
        ("stable", "grows below 0.01 k", "0.01 to 0.03 k", "faster"),
    )
    y = fig.Axis(_JOINTS[grid.joint], "rad", low=float(grid.bend[0]), high=float(grid.bend[-1]))
    panels = []
    for ratio, growth, unstable in zip(grid.ratio, grid.growth, grid.unstable, strict=True):
        # what does not count as unstable is not drawn so, however near
        z = np.where(unstable, growth / k, np.minimum(growth / k, -1e-9))
        bold = 0.0 if np.any(unstable) else None
        items: list[fig.Item] = [fig.Field(grid.speed, grid.bend, z, levels, names, bold), _running(analysis)]
        rows, columns = np.nonzero(~np.isfinite(growth))
        if rows.size:
            gaps = grid.speed[columns], grid.bend[rows]
            items.append(fig.Curve("no steady motion found", *gaps, 1, "x", joined=False))
        if grid.joint != "both":
            items.append(fig.Mark(getattr(analysis.line, grid.joint), "bend as given", axis="y", look=3))
        title = f"damping ratio {number(ratio, '1', full=False)}"
        panels.append(fig.Panel(_speed_axis(analysis), y, tuple(items), title))
    return fig.Figure(
        "stability",
        "Torsional stability (Floquet)",
        "Where torsional disturbances grow, over speed and bend, for each damping ratio.",
        (tuple(panels),),
        file="stability.png",
        heights=(1.6,),
        level=True,
    )


def _resonance(analysis: LineAnalysis) -> fig.Figure:
    simulated, panels = analysis.simulated, []
    for shaft, static in ((2, analysis.static2), (3, analysis.rotation.load)):
        steady, rigid = (np.asarray(getattr(of, f"peak{shaft}")) for of in (analysis.steady, analysis.rigid))
        items: list[fig.Item] = [
            fig.Curve("steady motion", analysis.speed, steady),
            fig.Curve("rigid shafts", analysis.speed, rigid, 2),
            *(fig.Shade(low, high, "unstable") for low, high in analysis.unstable_ranges()),
            _running(analysis),
        ]
        if simulated is not None:
            points = simulated.speed[analysis.on_speed], getattr(simulated, f"peak{shaft}")[analysis.on_speed]
            items.append(fig.Curve("time simulation", *points, 1, "o", joined=False))
        if static > 0.0:
            items.append(fig.Mark(static, "load alone", axis="y", look=3))
        if shaft == 2:
            peaks = analysis.resonances()
            items += [fig.Label(at, peak, number(peak, "N.m", digits=4), "above") for at, peak in peaks]
        # where there is nothing to see, not even roundoff is shown
        largest = max(static, *(float(np.nanmax(y, initial=0.0)) for y in (steady, rigid)))
        low, high = (1e-3, 1.0) if largest < 1e-3 else (None, None)
        y = fig.Axis(f"peak torque of shaft {shaft}", "N.m", low=low, high=high, log=True)
        panels.append((fig.Panel(_speed_axis(analysis), y, tuple(items)),))
    return fig.Figure(
        "resonance",
        f"Peak torque over speed, damping ratio {number(analysis.damping_ratio, '1')}",
        "Peak torques of shafts 2 and 3 over the speed, elastic and rigid.",
        tuple(panels),
        file="resonance.png",
        heights=(1.3, 1.3),
    )


def _ratio(analysis: LineAnalysis) -> fig.Figure:
    angle = fig.Axis(
        "angle of shaft 2 from the plane of the joint", "rad", low=0.0, high=2.0 * np.pi, step=45.0
    )
    bends = (number(bend, "rad") for bend in (analysis.line.alpha1, analysis.line.alpha2))
    axes = {
        fig.Axis("ratio i23"): analysis.ratio,
        fig.Axis("frozen-angle natural frequency", "rad/s", "frequency"): analysis.frequency,
    }
    return fig.Figure(
        "ratio",
        f"Over a turn: bends {' and '.join(bends)}",
        "Ratio i23 and frozen-angle natural frequency over a turn.",
        tuple(
            (fig.Panel(angle, y, (fig.Curve(y.label, analysis.angle, values, listed=False),)),)
            for y, values in axes.items()
        ),
        file="ratio.png",
    )
