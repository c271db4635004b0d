"""The section on the organs of a chain unit: one side against both, and the limits of two bars as a model."""

from __future__ import annotations

from collections.abc import Iterator

from ...core.quantities import Layout, finite
from ...machines.chain_unit import SIDES
from ...report import blocks as b
from ...report import figure as fig
from ...report.cited import cited, number, quantity_rows
from ...report.given_numbers import asked_speed
from ...report.lines import Line, capital, filled, join, line
from ...report.pictures import Pictures
from ...study.organ_limits import CRANK_GOOD, ROCKER_GOOD_EMPTY
from ...study.record import StudyFindings, StudyRecord, StudySetup
from .analysis import OrganFindings, Sides
from .factors import OverloadFactors

PICTURES = Pictures()


def blocks(study: StudyRecord) -> Iterator[b.Block]:
    """Factors, limits and figure."""
    x = cited(OrganFindings.of_study(study.findings), "findings.organs")
    yield _factors(study.setup, x)
    yield from _limits(study.setup, x)
    yield from PICTURES.figures(study)


def _factors(setup: StudySetup, x: OrganFindings) -> b.Table:
    """A row for each overload factor, with a column for each side alone."""
    sides = x.overload_factors
    by = f", of {organs}" if (organs := setup.drive.machine.in_place) else ""
    title = line("Overload factor, one side against both, at ", asked_speed(setup), by)
    first = next(iter(sides.values()))
    rows = []
    for v in Layout(OverloadFactors).variables:
        sizes = (number(factors[v.name].value) for factors in sides.values())
        rows.append(b.TableRow((v.description, *sizes, first[v.name].use)))
    return b.Table(tuple(rows), b.heads("factor", *sides, "use"), title=title, numeric=False)


def _limits(setup: StudySetup, x: OrganFindings) -> Iterator[b.Block]:
    """Swing of the rocker, slack speeds and lowest mode in sentences, and the limits of the model in a table."""
    limits = x.limits
    swing = number(limits.rocker_extreme_left), number(limits.rocker_extreme_right), number(limits.margin)
    yield b.Text(filled("Rocker swings from {} to {}; margin {}.", *swing), form="short")
    web = "with two bars a web" if setup.drive.machine.in_place else "a web"
    slack_speeds = {"with this feed": number(limits.slack_speed), "empty": number(limits.slack_speed_empty)}
    cases, speeds = [], []
    for case, speed in slack_speeds.items():
        if speed.value:
            cases.append(f"{case}, {web} first goes slack at {{}} of the crank")
            speeds.append(speed)
        elif speed.value is not None:
            cases.append(f"{case}, {web} is slack at rest")
    mode = number(limits.chain_resonance)
    if mode.value is not None:
        cases.append("the lowest mode of a chain lies near {}")
        speeds.append(mode)
    if cases:
        yield b.Text(filled(capital("; ".join(cases)) + ".", *speeds))
    rows = quantity_rows(limits, none="none")
    yield b.Table(rows, title="Limits of the model", form="long")


def up_to_speed(findings: StudyFindings) -> Iterator[b.Block]:
    """The crank speeds up to which two bars stand for chains; nothing where no run has two bars."""
    organs, verdict = OrganFindings.found_in(findings), findings.verdict
    if organs is None or verdict is None:
        return
    if verdict.model != "two bars":
        sentence = (
            "No highest speed was computed up to which the numbers hold; the limits of two bars do not apply."
        )
        yield b.Text(sentence, "note", "long")
        return
    limits = cited(organs, "findings.organs").limits
    parts = [
        filled(template, speed)
        for template, speed in (
            ("the crank torque is good to 10 % up to {}", number(limits.crank_torque_speed)),
            ("the rocker torque up to {}", number(limits.rocker_torque_speed)),
            ("a web goes slack from {} on", number(limits.slack_speed)),
        )
        if speed.value is not None
    ]
    if parts:
        speeds = line("Speed of the crank, for two bars in place of chains: ", join(parts, "; "), ".")
        yield b.Text(speeds, "note", "long")


_GOOD = {"crank": CRANK_GOOD, "rocker": ROCKER_GOOD_EMPTY}
"""The crank speed up to which two bars give a torque to 10 %, in parts of the lowest natural frequency of a chain."""
_SHADED = (
    "Shaded: two bars may be wrong by more than a tenth; for the rocker torque this limit is that of a machine with "
    "an empty side."
)


@PICTURES.declare(lambda study: True, "sides_over_speed.png")
def _sides(study: StudyRecord) -> fig.Figure:
    """The peaks of the crank torque and of the rocker torque over the speed, in two panels."""
    findings = OrganFindings.of_study(study.findings)
    sides, mode = findings.sides, finite(findings.limits.chain_resonance)
    fastest = float(sides.speed[-1])

    def items(torque: str) -> Iterator[fig.Item]:
        """The curves of a panel; marks where they cross and at normal running, a shade where two bars err."""
        yield fig.Curve("both sides", sides.speed, sides.peaks[f"{torque}_both"], 0)
        for look, side in enumerate(SIDES, 1):
            yield fig.Curve(f"{side} side alone", sides.speed, sides.peaks[f"{torque}_{side}"], look)
        for speeds in sides.crossings[torque].values():
            yield from (fig.Mark(crossing.value, look="thin") for crossing in speeds)
        yield fig.Mark(study.setup.config.run.crank_speed, "normal running")
        if mode is not None and _GOOD[torque] * mode < fastest:
            yield fig.Shade(_GOOD[torque] * mode, fastest, "two bars may be off by more than 10 %")

    x = fig.Axis("crank speed", "rad/s", "speed", low=0.0, high=fastest)
    axes = {torque: fig.Axis(f"{torque} torque, peak", "N.m", low=0.0) for torque in ("crank", "rocker")}
    caption = (
        "Largest torques of a turn by inverse dynamics of two bars. Where lines cross, one side alone asks as much "
        "as both"
    )
    return fig.Figure(
        "sides",
        "One side alone against both, over the speed",
        "Largest crank torque and rocker torque in a turn over the crank speed, with both sides and with each side "
        "alone; the speed of normal running is marked.",
        fig.stacked(x, ((axis, items(torque)) for torque, axis in axes.items())),
        line(caption, *_crossings(cited(sides, "findings.organs.sides_over_speed")), f". {_SHADED}"),
    )


def _crossings(x: Sides) -> Iterator[Line]:
    """The speeds at which one side alone asks as much as both; nothing where no lines cross."""
    for torque, sides in x.crossings.items():
        places = [
            line(f"{side} alone at ", join(map(number, speeds), " and "))
            for side, speeds in sides.items()
            if speeds
        ]
        if places:
            yield line(f"; {torque} torque: ", join(places))
