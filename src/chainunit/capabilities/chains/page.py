"""The section on chains as organs: chains and two bars at the speed of the study, and over the speeds of the sweep.

`speeds_to_avoid` are warnings of the whole study; they stand with the others at the head of the report.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ...report import blocks as b
from ...report import figure as fig
from ...report.cited import cited, number
from ...report.lines import Line, join, line
from ...report.pictures import Pictures
from ...report.style import WIDE
from ...study.quantiles import HIGH
from ...study.record import StudyRecord
from .result import ChainResult

PICTURES = Pictures()
CERTAIN = 0.02
"""The tables give the interval of a number where it is wider than this share of the number."""
_OWN = (
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
_ORDERS = (
    "Modes are the natural modes of an organ, counted from the lowest frequency; at order n, n times the crank speed "
    "is the natural frequency of the mode."
)


def blocks(s: b.Source, study: StudyRecord) -> Iterator[b.Block]:
    """Text, tables and figure."""
    chain = s.result["chain"]
    lead = (
        "The organs are chains of {=chain.rods_of_wall} rods in the wall and {=chain.rods_of_web} in the web. The "
        "crank turns at constant speed. {=chain.starts} runs start at different crank angles and last "
        "{=chain.turns} turns each. Where rods go slack, the motion may be chaotic, and no single peak is a "
        "prediction. Each turn of each run has one peak; the tables show the median and a quantile of these peaks."
    )
    yield b.Text(s.line(lead), "lead", "long")
    if not chain["avoid"] and len(chain["sweep"]) > 1:
        ends = f"{{chain.sweep.0.speed}} to {{chain.sweep.{len(chain['sweep']) - 1}.speed}}"
        yield b.Text(s.line(f"No speed to avoid from {ends}."), "fine")
    x = cited(ChainResult.of_study(study), "findings.chain")
    yield _own_speed(s, x)
    slack = {
        side: join(
            s.line(f"{{chain.slack_by_rod.{side}.{k}.rod}}: {{chain.slack_by_rod.{side}.{k}}}")
            for k, rod in enumerate(rods)
            if rod["value"] > 0.0
        )
        for side, rods in chain["slack_by_rod"].items()
    }
    if any(slack.values()):
        rows = tuple(b.TableRow((side, slack_rods or "none")) for side, slack_rods in slack.items())
        yield b.Table(rows, title="Rods that go slack, share of the time", numeric=False)
    if len(chain["sweep"]) > 1:
        yield _sweep(s, x)
    if chain["critical_speeds"]:
        yield from _critical(s, chain, study)
    yield from PICTURES.figures(s, study)


def speeds_to_avoid(s: b.Source) -> Iterator[b.Judgement]:
    """A warning for each range of speeds that the crank should avoid; none without chains."""
    chain = s.result.get("chain", {})
    sweep = chain.get("sweep", ())
    for i, band in enumerate(chain.get("avoid", ())):
        path = f"chain.avoid.{i}"
        end = f" to {{{path}.to}}" if band["to"] != band["from"] else ""
        ends = ", where the sweep begins" if band["from"] == sweep[0]["speed"] else ""
        ends += ", where the sweep ends" if end and band["to"] == sweep[-1]["speed"] else ""
        yield b.Judgement("warning", s.line(f"Avoid {{{path}.from}}{end}{ends}: {{{path}.why}}."))


def _own_speed(s: b.Source, x: ChainResult) -> b.Table:
    def cell(name: str) -> Line:
        return s.estimate(f"chain.own_speed.{name}", certain=CERTAIN) if name else ""

    rows = [b.TableRow((title, *map(cell, names))) for title, names in _OWN]
    if number(x.resonance).value is not None:
        rows += [
            b.TableRow(("resonance of an organ, crank speed", number(x.resonance), "", "")),
            b.TableRow(
                ("relative distance of the speed from it (negative: below)", number(x.distance), "", "")
            ),
        ]
    title = (
        "Chains and two bars at constant {=chain.own_speed.speed}, {=chain.starts} starts of {=chain.turns} turns; "
        "in brackets: the interval of {=chain.confidence} confidence"
    )
    quantile = s.line("chains, {=chain.quantile} of turns")
    heads = b.heads("peaks of single turns", "chains, median", quantile, "two bars")
    return b.Table(tuple(rows), heads, title=s.line(title))


def _sweep(s: b.Source, x: ChainResult) -> b.Table:
    columns = {
        "crank_torque_median": "crank torque: median",
        "crank_torque_high": "crank torque: {=chain.quantile} quantile",
        "two_bar_crank_torque": "crank torque: two bars",
        "rocker_torque_median": "rocker torque: median",
        "rocker_torque_high": "rocker torque: {=chain.quantile} quantile",
        "two_bar_rocker_torque": "rocker torque: two bars",
        "snatch_median": "snatch: median",
        "snatch_high": "snatch: {=chain.quantile} quantile",
        "slack_time": "share of the time with a slack rod",
    }

    def cell(i: int, name: str) -> Line:
        return s.estimate(f"chain.sweep.{i}.{name}", unknown="-", certain=CERTAIN)

    rows = (
        b.TableRow((number(numbers.speed), *(cell(i, name) for name in columns)))
        for i, numbers in enumerate(x.speeds)
    )
    title = (
        "Chains and two bars over the crank speed; in brackets, where the starts differ: the interval of "
        "{=chain.confidence} confidence; -: they differ too much for one"
    )
    return b.Table(
        tuple(rows), b.heads("crank speed", *map(s.line, columns.values())), title=s.line(title), form="long"
    )


def _critical(s: b.Source, chain: Mapping[str, Any], study: StudyRecord) -> Iterator[b.Block]:
    """Critical crank speeds: all of them in a table, those within the sweep in a sentence."""
    path = "chain.critical_speeds"
    places: dict[float, dict[float, int]] = {}
    for i, entry in enumerate(chain["critical_speeds"]):
        places.setdefault(entry["mode"]["value"], {})[entry["order"]["value"]] = i
    rows = (
        b.TableRow(
            (
                s.line(f"mode {{={path}.{next(iter(by_order.values()))}.mode}}"),
                *(s.number(f"{path}.{i}.speed") for i in by_order.values()),
            )
        )
        for by_order in places.values()
    )
    orders = (s.line(f"order {{={path}.{i}.order}}") for i in next(iter(places.values())).values())
    title = f"Critical crank speeds. {_ORDERS}"
    yield b.Table(tuple(rows), b.heads("", *orders), title=title, form="long")
    result = ChainResult.of_study(study)
    inside = [
        s.line(f"{{{path}.{places[speed.mode][speed.order]}.speed}} (mode {speed.mode}, order {speed.order})")
        for speed in sorted(result.within_speeds(), key=lambda speed: speed.speed)
    ]
    if inside:
        yield b.Text(line("Critical speeds within the sweep: ", join(inside), f". {_ORDERS}"), form="short")


@PICTURES.declare(lambda study: len(ChainResult.of_study(study).speeds) > 1, "chain_sweep.png")
def _over_speed(s: b.Source, study: StudyRecord) -> fig.Figure:
    """Torques of chains and two bars, and the share of the time with a slack rod, over the crank speed."""
    result = ChainResult.of_study(study)
    rows = result.speeds
    speed = np.array([n.speed for n in rows])
    x = fig.Axis("crank speed", "rad/s", "speed", low=float(speed[0]), high=float(speed[-1]))
    # the least distance of 5 % keeps labels apart on a narrow screen, too
    labels: list[fig.Item] = [
        fig.Mark(
            critical.speed,
            words=f"mode {critical.mode}" + (f", order {critical.order}" if critical.order > 1 else ""),
            look="thin",
            upright=True,
        )
        for critical in result.within_speeds(0.05)
    ]
    marks: list[fig.Item] = [
        *(fig.Shade(band.low, band.high, "to avoid") for band in result.avoid),
        *(fig.Mark(critical.speed, look="thin") for critical in result.within_speeds()),
        fig.Mark(result.own.speed, "the study's speed", look=2),
    ]

    def pair(median: Any, two: Any) -> list[fig.Item]:
        return [
            fig.Curve("chains, median", speed, median, 0, "o"),
            fig.Curve("two bars", speed, two, 1, "s"),
            *marks,
        ]

    panels: list[tuple[fig.Axis, list[fig.Item]]] = []
    for part in ("rocker", "crank"):
        names = (f"{part}_torque_median", f"{part}_torque_high", f"two_bar_{part}_torque")
        median, high, two = (np.array([getattr(n, name) for n in rows]) for name in names)
        sizes = np.concatenate([median, high, two])
        wide = float(np.nanmax(sizes)) > WIDE * max(float(np.nanmin(sizes)), 1e-9)
        quantile = fig.Between(f"chains, up to the {100 * HIGH:g} % quantile", speed, median, high)
        y = fig.Axis(f"{part} torque, peak", "N.m", low=None if wide else 0.0, log=wide)
        panels.append((y, [quantile, *pair(median, two), *([] if panels else labels)]))
    slack = pair([n.slack_time for n in rows], [n.two_bar_slack_time for n in rows])
    panels.append((fig.Axis("time slack", "1", "percent", low=-0.04, high=1.04), slack))
    return fig.Figure(
        "chains",
        "Chains and two bars over the crank speed",
        "Peaks of rocker torque and crank torque in a turn over the crank speed, chains and two bars, and below the "
        "share of the time in which a rod is slack; speeds to avoid are shaded, critical speeds are lines.",
        fig.stacked(x, panels),
        s.line(
            "The crank turns at constant speed; {=chain.starts} starts of {=chain.turns} turns each. Shaded: speeds "
            f"to avoid; dash-dotted: the speed of normal running; thin lines: critical speeds. {_ORDERS} Two bars do "
            "not go slack: their curve shows the share of the time in which the mean pull of a bar is negative."
        ),
        heights=(1.1, 1.1, 0.65),
    )
