"""The section on chains as organs: chains and two bars at the speed of the study, and over the speeds of the sweep.

`speeds_to_avoid` are warnings of the whole study; they stand with the others at the head of the report.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ...report import blocks as b
from ...report import figure as fig
from ...report.cited import cited, exact, number
from ...report.lines import Aside, Line, Number, filled, join, line
from ...report.pictures import Pictures
from ...report.style import WIDE
from ...study.quantiles import HIGH
from ...study.record import StudyFindings, StudyRecord
from .result import ChainResult, CriticalSpeed, SpeedNumbers

PICTURES = Pictures()
CERTAIN = 0.02
"""The tables give the interval of a number where it is wider than this share of the number."""
_ROWS = (
    ("crank torque, peak", ("crank_torque_median", "crank_torque_high", "two_bar_crank_torque")),
    ("crank torque, RMS", ("crank_torque_rms", "", "two_bar_crank_torque_rms")),
    ("rocker torque, peak", ("rocker_torque_median", "rocker_torque_high", "two_bar_rocker_torque")),
    ("snatch: force at A2 over the force there at rest", ("snatch_median", "snatch_high", "two_bar_snatch")),
    ("number of independent turns behind the quantile", ("independent_turns", "", "")),
    ("snatch: largest over least median of the starts", ("snatch_spread", "", "")),
    (
        "share of the time with a slack rod (two bars: with a bar of negative mean pull)",
        ("slack_time", "", "two_bar_slack_time"),
    ),
    ("share of the rods that are slack, mean over time", ("slack_rods", "", "")),
    ("largest angle between neighbouring rods", ("fold_largest", "", "")),
    ("energy residual of an organ, share of the energy moved", ("energy_residual", "", "")),
)
"""The rows at the speed of the study: a title, and the numbers of the median, the quantile and two bars; empty for
none."""
_ORDERS = (
    "Modes are the natural modes of an organ, counted from the lowest frequency; at order n, n times the crank speed "
    "is the natural frequency of the mode."
)


def blocks(study: StudyRecord) -> Iterator[b.Block]:
    """Text, tables and figure."""
    chain = ChainResult.of_study(study.findings)
    x = cited(chain, "findings.chain")
    lead = (
        "The organs are chains of {} rods in the wall and {} in the web. The crank turns at constant speed. {} runs "
        "start at different crank angles and last {} turns each. Where rods go slack, the motion may be chaotic, and "
        "no single peak is a prediction. Each turn of each run has one peak; the tables show the median and a "
        "quantile of these peaks."
    )
    yield b.Text(filled(lead, *map(exact, (x.walls, x.webs, x.starts, x.turns))), "lead", "long")
    if not chain.avoid and len(chain.speeds) > 1:
        ends = number(x.speeds[0].speed), number(x.speeds[-1].speed)
        yield b.Text(filled("No speed to avoid from {} to {}.", *ends), "fine")
    yield _at_study_speed(x)
    slack = {}
    for side, rods in x.slack_by_rod.items():
        slack_rods = (rod for rod in rods if (number(rod.share).value or 0.0) > 0.0)
        slack[side] = join(filled("{}: {}", rod.rod, number(rod.share)) for rod in slack_rods)
    if any(slack.values()):
        rows = tuple(b.TableRow((side, shares or "none")) for side, shares in slack.items())
        yield b.Table(rows, title="Rods that go slack, share of the time", numeric=False)
    if len(chain.speeds) > 1:
        yield _sweep(x)
    if chain.critical:
        yield from _critical(chain, x)
    yield from PICTURES.figures(study)


def speeds_to_avoid(findings: StudyFindings) -> Iterator[b.Judgement]:
    """A warning for each range of speeds that the crank should avoid; none without chains."""
    chain = ChainResult.found_in(findings)
    if chain is None:
        return
    for band, x in zip(chain.avoid, cited(chain, "findings.chain").avoid, strict=True):
        speeds = number(x.low) if band.low == band.high else filled("{} to {}", number(x.low), number(x.high))
        ends = ", where the sweep begins" if band.low == chain.speeds[0].speed else ""
        is_last = band.high == chain.speeds[-1].speed and band.high != band.low
        ends += ", where the sweep ends" if is_last else ""
        yield b.Judgement("warning", filled("Avoid {}{}: {}.", speeds, ends, x.why))


def _estimate(x: SpeedNumbers, name: str, unknown: str = "starts differ") -> Line:
    """A number and its interval, unless that is narrow; `unknown` if the starts differ too much for an interval."""
    size: Number = number(getattr(x, name))
    if not hasattr(x, f"{name}_from"):
        return size
    least, most = (number(getattr(x, f"{name}_{end}")) for end in ("from", "to"))
    if least.value is None or most.value is None:
        return unknown
    if most.value - least.value <= CERTAIN * abs(size.value or 0.0):
        return size
    return line(size, Aside(filled("{} to {}", least, most)))


def _at_study_speed(x: ChainResult) -> b.Table:
    """The table of chains beside two bars at the speed of the study, and of the distance to a resonance."""
    rows: list[tuple[b.Cell, ...]] = [
        (title, *(_estimate(x.own, name) if name else "" for name in names)) for title, names in _ROWS
    ]
    if number(x.resonance).value is not None:
        distance = "relative distance of the speed from it (negative: below)"
        rows.append(("resonance of an organ, crank speed", number(x.resonance), "", ""))
        rows.append((distance, number(x.distance), "", ""))
    title = "Chains and two bars at constant {}, {} starts of {} turns; in brackets: the interval of {} confidence"
    sizes = map(exact, (x.own.speed, x.starts, x.turns, x.confidence))
    quantile = filled("chains, {} of turns", exact(x.quantile))
    heads = b.heads("peaks of single turns", "chains, median", quantile, "two bars")
    return b.Table(tuple(map(b.TableRow, rows)), heads, title=filled(title, *sizes))


def _sweep(x: ChainResult) -> b.Table:
    """A row for each speed of the sweep: torques of chains and of two bars, snatch, slack."""
    quantile = exact(x.quantile)
    columns: dict[str, Line] = {
        "crank_torque_median": "crank torque: median",
        "crank_torque_high": filled("crank torque: {} quantile", quantile),
        "two_bar_crank_torque": "crank torque: two bars",
        "rocker_torque_median": "rocker torque: median",
        "rocker_torque_high": filled("rocker torque: {} quantile", quantile),
        "two_bar_rocker_torque": "rocker torque: two bars",
        "snatch_median": "snatch: median",
        "snatch_high": filled("snatch: {} quantile", quantile),
        "slack_time": "share of the time with a slack rod",
    }
    rows = (
        b.TableRow((number(numbers.speed), *(_estimate(numbers, name, "-") for name in columns)))
        for numbers in x.speeds
    )
    title = (
        "Chains and two bars over the crank speed; in brackets, where the starts differ: the interval of {} "
        "confidence; -: they differ too much for one"
    )
    heads = b.heads("crank speed", *columns.values())
    return b.Table(tuple(rows), heads, title=filled(title, exact(x.confidence)), form="long")


def _critical(chain: ChainResult, x: ChainResult) -> Iterator[b.Block]:
    """Critical crank speeds: all of them in a table of modes and orders, those within the sweep in a sentence."""
    modes: dict[int, dict[int, CriticalSpeed]] = {}
    for speed, shown in zip(chain.critical, x.critical, strict=True):
        modes.setdefault(speed.mode, {})[speed.order] = shown
    rows = []
    for by_order in modes.values():
        first, *_ = by_order.values()
        speeds = (number(shown.speed) for shown in by_order.values())
        rows.append(b.TableRow((filled("mode {}", exact(first.mode)), *speeds)))
    orders = (filled("order {}", exact(shown.order)) for shown in next(iter(modes.values())).values())
    title = f"Critical crank speeds. {_ORDERS}"
    yield b.Table(tuple(rows), b.heads("", *orders), title=title, form="long")
    swept = [
        line(number(modes[speed.mode][speed.order].speed), f" (mode {speed.mode}, order {speed.order})")
        for speed in sorted(chain.within_speeds(), key=lambda speed: speed.speed)
    ]
    if swept:
        yield b.Text(line("Critical speeds within the sweep: ", join(swept), f". {_ORDERS}"), form="short")


@PICTURES.declare(lambda study: len(ChainResult.of_study(study.findings).speeds) > 1, "chain_sweep.png")
def _over_speed(study: StudyRecord) -> fig.Figure:
    """Torques of chains and two bars, and the share of the time with a slack rod, over the crank speed."""
    result = ChainResult.of_study(study.findings)
    x, rows = cited(result, "findings.chain"), result.speeds
    speed = np.array([n.speed for n in rows])
    over = fig.Axis("crank speed", "rad/s", "speed", low=float(speed[0]), high=float(speed[-1]))
    # the least distance of 5 % keeps labels apart on a narrow screen, too
    labels: list[fig.Item] = []
    for critical in result.within_speeds(0.05):
        order = f", order {critical.order}" if critical.order > 1 else ""
        labels.append(
            fig.Mark(critical.speed, words=f"mode {critical.mode}{order}", look="thin", upright=True)
        )
    marks: list[fig.Item] = [
        *(fig.Shade(band.low, band.high, "to avoid") for band in result.avoid),
        *(fig.Mark(critical.speed, look="thin") for critical in result.within_speeds()),
        fig.Mark(result.own.speed, "the study's speed", look=2),
    ]

    def pair(median: Any, bars: Any) -> list[fig.Item]:
        """The curves of chains and of two bars, with the marks of all panels."""
        return [
            fig.Curve("chains, median", speed, median, 0, "o"),
            fig.Curve("two bars", speed, bars, 1, "s"),
            *marks,
        ]

    panels: list[tuple[fig.Axis, list[fig.Item]]] = []
    for part in ("rocker", "crank"):
        names = (f"{part}_torque_median", f"{part}_torque_high", f"two_bar_{part}_torque")
        median, high, bars = (np.array([getattr(n, name) for n in rows]) for name in names)
        sizes = np.concatenate([median, high, bars])
        wide = float(np.nanmax(sizes)) > WIDE * max(float(np.nanmin(sizes)), 1e-9)
        quantile = fig.Between(f"chains, up to the {100 * HIGH:g} % quantile", speed, median, high)
        y = fig.Axis(f"{part} torque, peak", "N.m", low=None if wide else 0.0, log=wide)
        panels.append((y, [quantile, *pair(median, bars), *([] if panels else labels)]))
    slack = pair([n.slack_time for n in rows], [n.two_bar_slack_time for n in rows])
    panels.append((fig.Axis("time slack", "1", "percent", low=-0.04, high=1.04), slack))
    return fig.Figure(
        "chains",
        "Chains and two bars over the crank speed",
        "Peaks of rocker torque and crank torque in a turn over the crank speed, chains and two bars, and below the "
        "share of the time in which a rod is slack; speeds to avoid are shaded, critical speeds are lines.",
        fig.stacked(over, panels),
        filled(
            "The crank turns at constant speed; {} starts of {} turns each. Shaded: speeds to avoid; dash-dotted: "
            f"the speed of normal running; thin lines: critical speeds. {_ORDERS} Two bars do not go slack: their "
            "curve shows the share of the time in which the mean pull of a bar is negative.",
            exact(x.starts),
            exact(x.turns),
        ),
        heights=(1.1, 1.1, 0.65),
    )
