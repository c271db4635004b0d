"""The report on a driveline: natural frequency, resonance and stability in rotation."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..drives.cardan import ORDERS
from ..studies.driveline import DrivelineStudy, as_dict
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
    s, config = b.Source(as_dict(study)), study.config
    answer = (b.Table(tuple(b.TableRow(row) for row in _rows(s, study))), *s.said())
    figures = (_campbell(study), _stability(study), _resonance(study), _ratio(study))
    given = b.Given(
        (s.given("Driveline", config.line, "driveline"), s.given("Running", config.running, "running"))
    )
    sections = (
        b.Section("answer", "The answer", answer),
        b.Section("plots", "Plots", figures),
        b.Section("given", "All that was given", (given,)),
    )
    return b.Report(config.title, KIND, s.result, (), sections, source=s.line("chainunit {chainunit}"))


def _rows(s: b.Source, study: DrivelineStudy) -> Iterator[tuple[Line, Line]]:
    """What is asked of a driveline and what it comes to."""

    def ends(path: str, *item: int) -> Line:
        return joined((s.number(path, *item, end, digits=4) for end in (0, 1)), " to ")

    def ranges(path: str, count: int) -> Line:
        return joined((ends(path, i) for i in range(count)), "; ")

    yield "natural frequency at i23 = 1", s.line("{natural_frequency.even:5}")
    band = "{natural_frequency.least:5} to {natural_frequency.largest:5}"
    yield "its range over a turn, frozen angle", s.line(band)
    yield "ratio i23", s.line("{ratio.least:5} to {ratio.largest:5}")
    for n in study.excitation:
        yield f"amplitude of shaft 3 at order {n}", s.number(f"excitation.order {n}")
    yield "damping ratio", s.number("damping_ratio")
    for n in ORDERS:
        if study.excitation[n]:
            yield f"order {n} meets it at", ends(f"crossings.speed = k/{n}")
    for i in range(len(study.resonances())):
        at, peak = (s.number(f"resonance.peaks.{name}", i, digits=4) for name in ("speed", "torque2"))
        yield line("resonance peak at ", at), line(peak, " in shaft 2")
    if study.operating.found[0]:
        for shaft in (2, 3):
            torques = (
                s.number(f"operating.{end}_torque{shaft}", 0, digits=4) for end in ("least", "largest")
            )
            yield s.line(f"shaft {shaft} at {{running.speed:4}}"), joined(torques, " to ")
        multiplier = s.number("operating.largest_multiplier", 0, digits=4)
        yield "Floquet multiplier there, per half turn", multiplier
    else:
        yield s.line("steady motion at {running.speed:4}"), "not found"
    unstable, unknown = study.unstable_ranges(), study.missing_ranges()
    nowhere = "nowhere else" if unknown else "nowhere in the range"
    yield "unstable", ranges("resonance.unstable", len(unstable)) or nowhere
    if unknown:
        yield "whether it is stable is not known", ranges("resonance.no_steady_motion", len(unknown))


# -- figures


def _speed_axis(study: DrivelineStudy) -> fig.Axis:
    running = study.config.running
    return fig.Axis("speed", "rad/s", "speed", low=running.speed_low, high=running.speed_high)


def _running(study: DrivelineStudy) -> fig.Mark:
    return fig.Mark(study.config.running.speed, "running", look="reference")


def _campbell(study: DrivelineStudy) -> fig.Figure:
    band, running = study.band, study.config.running
    ends = np.array([0.0, running.speed_high])
    seen = np.flatnonzero(study.steady.found & ~study.steady.unstable)[::4]
    damped, frequency = "damped frequency in rotation (Floquet)", study.steady.frequency
    middle = 0.5 * (band.least + band.largest)
    crossed = {n: 0.5 * (low + high) for n, (low, high) in study.crossings().items()}
    items: tuple[fig.Item, ...] = (
        fig.Shade(band.least, band.largest, "natural frequency over a turn, frozen angle", "y", "band"),
        fig.Curve(damped, study.speed[seen], frequency[seen], 2, "+", joined=False),
        *(fig.Curve(f"order {n}", ends, n * ends, look) for look, n in enumerate(ORDERS)),
        fig.Curve("order 1: parametric resonance at speed = k", ends, ends, 3),
        _running(study),
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
        ((fig.Panel(_speed_axis(study), y, items),),),
        file="campbell.png",
        heights=(2.0,),
    )


def _stability(study: DrivelineStudy) -> fig.Figure:
    found, config, k = study.map, study.config, study.at_even
    levels, names = (
        (-1.0, 0.0, 0.01, 0.03, 10.0),
        ("stable", "grows below 0.01 k", "0.01 to 0.03 k", "faster"),
    )
    y = fig.Axis(_JOINTS[config.joint], "rad", low=float(found.bend[0]), high=float(found.bend[-1]))
    panels = []
    for ratio, growth, unstable in zip(found.ratio, found.growth, found.unstable, strict=True):
        # what does not count as unstable is not drawn so, however near
        z = np.where(unstable, growth / k, np.minimum(growth / k, -1e-9))
        bold = 0.0 if np.any(unstable) else None
        items: list[fig.Item] = [fig.Field(found.speed, found.bend, z, levels, names, bold), _running(study)]
        rows, columns = np.nonzero(~np.isfinite(growth))
        if rows.size:
            missing = found.speed[columns], found.bend[rows]
            items.append(fig.Curve("no steady motion found", *missing, 1, "x", joined=False))
        if config.joint != "both":
            items.append(fig.Mark(getattr(config.line, config.joint), "bend as given", axis="y", look=3))
        title = f"damping ratio {number(ratio, '1', full=False)}"
        panels.append(fig.Panel(_speed_axis(study), y, tuple(items), title))
    return fig.Figure(
        "stability",
        "Torsional stability (Floquet)",
        "Where torsional disturbances grow, over speed and bend, for each damping ratio.",
        (tuple(panels),),
        file="stability.png",
        heights=(1.6,),
        level=True,
    )


def _resonance(study: DrivelineStudy) -> fig.Figure:
    simulated, panels = study.simulated, []
    for shaft, static in ((2, study.static2), (3, study.config.running.load)):
        steady, rigid = (np.asarray(getattr(of, f"peak{shaft}")) for of in (study.steady, study.rigid))
        items: list[fig.Item] = [
            fig.Curve("steady motion", study.speed, steady),
            fig.Curve("rigid shafts", study.speed, rigid, 2),
            *(fig.Shade(low, high, "unstable") for low, high in study.unstable_ranges()),
            _running(study),
        ]
        if simulated is not None:
            points = simulated.speed[study.kept], getattr(simulated, f"peak{shaft}")[study.kept]
            items.append(fig.Curve("time simulation", *points, 1, "o", joined=False))
        if static > 0.0:
            items.append(fig.Mark(static, "load alone", axis="y", look=3))
        if shaft == 2:
            peaks = study.resonances()
            items += [fig.Label(at, peak, number(peak, "N.m", digits=4), "above") for at, peak in peaks]
        # where there is nothing to see, not even roundoff is shown
        largest = max(static, *(float(np.nanmax(y, initial=0.0)) for y in (steady, rigid)))
        low, high = (1e-3, 1.0) if largest < 1e-3 else (None, None)
        y = fig.Axis(f"peak torque of shaft {shaft}", "N.m", low=low, high=high, log=True)
        panels.append((fig.Panel(_speed_axis(study), y, tuple(items)),))
    return fig.Figure(
        "resonance",
        f"Peak torque over speed, damping ratio {number(study.damping_ratio, '1')}",
        "Peak torques of shafts 2 and 3 over the speed, elastic and rigid.",
        tuple(panels),
        file="resonance.png",
        heights=(1.3, 1.3),
    )


def _ratio(study: DrivelineStudy) -> fig.Figure:
    angle = fig.Axis(
        "angle of shaft 2 from the plane of the joint", "rad", low=0.0, high=2.0 * np.pi, step=45.0
    )
    bends = (number(bend, "rad") for bend in (study.config.line.alpha1, study.config.line.alpha2))
    axes = {
        fig.Axis("ratio i23"): study.ratio,
        fig.Axis("frozen-angle natural frequency", "rad/s", "frequency"): study.frequency,
    }
    return fig.Figure(
        "ratio",
        f"Over a turn: bends {' and '.join(bends)}",
        "Ratio i23 and frozen-angle natural frequency over a turn.",
        tuple(
            (fig.Panel(angle, y, (fig.Curve(y.label, study.angle, values, listed=False),)),)
            for y, values in axes.items()
        ),
        file="ratio.png",
    )
