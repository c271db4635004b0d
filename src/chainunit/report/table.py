"""The answer on the terminal."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection

from rich.console import Console
from rich.table import Table
from rich.text import Text

from ..config import OVERLOADS, by_side
from ..quantities import Layout, Variable
from ..studies.chain import HIGH, ChainResult
from ..studies.monte_carlo import QUANTILES, MonteCarloResult, Sample
from ..studies.overload import Answers, Study
from ..studies.shaft import ShaftAnswers
from ..studies.sizing import recommended

_HIDDEN = {
    "supply_power_mean",
    "winding_temperature",
    "speed_mean",
    "speed_least",
    "power_mean",
    "crank_torque_mean",
    "cycle_gap",
}
_IF_ANY = {
    "slack_time",
    "fold_largest",
    "stall_time",
    "thermal_trip_time",
    "coupling_trip_time",
    "energy_after_trip",
    "energy_behind",
    "standstill_time",
}


def _number(value: float | None, unit: str) -> str:
    if value is None or math.isnan(value):
        return "not reached"
    if unit == "1":
        return f"{100.0 * value:.2f} %"
    shown = unit.replace(".", " ")
    return f"{value:.3g} {shown}" if abs(value) < 100.0 else f"{value:.0f} {shown}"


def _cell(study: Study, run: str, v: Variable) -> str:
    value = getattr(study.answers[run], v.name)
    if value is None and v.name != "recovery_time":
        return "-"
    if v.name == "recovery_time" and run == "steady":
        return ""
    if v.unit == "rad":
        return f"{math.degrees(value):.3g} deg"
    return _number(value, v.unit)


def _short(run: str) -> str:
    """Heading of the column of a run."""
    return OVERLOADS[run].short if run in OVERLOADS else run


def _print_runs(console: Console, table: Callable[[list[str]], Table], runs: Collection[str]) -> None:
    """One table of all runs, a column each; where it is too wide, one for each side with steady running beside."""
    first, overloads = [run for run in runs if run not in OVERLOADS], by_side(runs)
    whole = table([*first, *(run for names in overloads for run in names)])
    unbounded = console.options.update(width=10_000)
    if console.measure(whole, options=unbounded).maximum <= console.width or not overloads:
        console.print(whole)
        return
    for names in overloads:
        console.print(table([*first, *names]))


def show(study: Study, console: Console) -> None:
    """Print tables and notes."""
    config = study.config
    for remark in config.remarks:
        console.print(f"Remark: {remark}.", soft_wrap=True)
    if study.sizing is not None:
        _show_sizing(study, console)
    warning = "the motor is insufficient" if study.insufficient else ""
    title = ": ".join(part for part in (config.title, warning) if part)

    def answers(runs: list[str]) -> Table:
        table = Table(title=Text(title) if title else None, title_justify="left")
        table.add_column(f"crank at {config.run.crank_speed:g} rad/s")
        for name in runs:
            table.add_column(_short(name), justify="right")
        for v in Layout(Answers).variables:
            known = any(getattr(study.answers[run], v.name) is not None for run in runs)
            if v.name not in _HIDDEN and (known or v.name not in _IF_ANY):
                table.add_row(v.description, *(_cell(study, run, v) for run in runs))
        return table

    if study.answers:
        _print_runs(console, answers, study.answers)
    if study.chain is not None:
        _show_chain(study.chain, console)
    if study.monte_carlo is not None:
        _show_monte_carlo(study.monte_carlo, console)
    if study.factors:
        f = study.factors
        table = Table(title="Overload factor, left organ alone against both", title_justify="left")
        table.add_column("way")
        table.add_column("factor", justify="right")
        table.add_row("R_left/(R_left - R_right) at the right extreme, at rest", f"{f.static_at_extreme:.3f}")
        table.add_row("rocker torque, ratio of cycle maxima", f"{f.rocker_torque:.3f}")
        table.add_row("crank torque, ratio of cycle maxima", f"{f.crank_torque:.3f}")
        console.print(table)
    if study.pins:
        heaviest = {pin: max(t[pin]["peak"] for t in study.pins.values()) for pin in study.pins["steady"]}
        table = Table(title="What the bearings carry (equivalent: ISO 281, steady)", title_justify="left")
        for column in ("pin", "equivalent", "steady peak", "largest", "in"):
            table.add_column(column, justify="left" if column in ("pin", "in") else "right")
        for pin, steady in study.pins["steady"].items():
            worst = max(study.pins, key=lambda run: study.pins[run][pin]["peak"])
            table.add_row(
                pin,
                f"{steady['equivalent']:.0f} N",
                f"{steady['peak']:.0f} N",
                f"{heaviest[pin]:.0f} N",
                _short(worst),
            )
        console.print(table)
    if study.shaft:
        _show_shaft(study, console)
    limits = study.limits
    if limits is not None:
        swing = (math.degrees(limits.rocker_extreme_left), math.degrees(limits.rocker_extreme_right))
        console.print(f"Rocker swings from {swing[0]:.3f} to {swing[1]:.3f} deg; margin {limits.margin:.2f}.")
        first = "A web" if study.drive.chain is None else "With two bars a web"
        console.print(
            f"{first} first goes slack at {limits.slack_speed:.2f} rad/s of the crank with this feed "
            f"({limits.slack_speed_empty:.2f} rad/s empty); lowest chain mode near "
            f"{limits.chain_resonance:.1f} rad/s."
        )
    for name, found in study.loops.items():
        console.print(
            f"Speed loop, {name} ({found.inertia:.3g} kg m2): phase margin {found.phase_margin:.0f} deg at "
            f"{found.crossover:.3g} rad/s; a step of 1 N m takes {found.speed_dip:.2g} rad/s off the motor speed, "
            f"settled after {found.settling:.2g} s.",
            soft_wrap=True,
        )
    if study.certificate:
        worst_share = max(
            share
            for certificate in study.certificate.values()
            for kind, share in certificate.items()
            if kind.endswith("energy_residual_share")
        )
        console.print(f"Energy residual of the shaft: at most {worst_share:.1e} of the energy moved.")
    for name, value in study.certificate.get("start_up", {}).items():
        if name.endswith("_difference_to_monolithic"):
            quantity = name.removesuffix("_difference_to_monolithic")
            console.print(f"Difference of {quantity} to the monolithic solution: {value:.1e} of its peak.")
    for note in study.notes:
        console.print(f"Note: {note}")


def _show_chain(found: ChainResult, console: Console) -> None:
    """Chains beside two bars at the study's speed, and which speeds to avoid."""
    own, high = found.own, f"{100 * HIGH:g} %"
    table = Table(
        title=f"Chains and two bars at constant {own.speed:g} rad/s, {found.starts} starts of {found.turns} turns",
        title_justify="left",
    )
    table.add_column("peaks are of single turns")
    for column in ("chains, median", f"chains, {high}", "two bars"):
        table.add_column(column, justify="right")
    for title, name in (("crank torque, peak", "crank_torque"), ("rocker torque, peak", "rocker_torque")):
        sizes = (f"{name}_median", f"{name}_high", f"two_bar_{name}")
        table.add_row(title, *(_number(getattr(own, size), "N.m") for size in sizes))
    one, two = _number(own.crank_torque_rms, "N.m"), _number(own.two_bar_crank_torque_rms, "N.m")
    table.add_row("crank torque, RMS", one, "", two)
    snatches = (own.snatch_median, own.snatch_high, own.two_bar_snatch)
    table.add_row(
        "snatch: force at A2 over that at rest", *(f"{x:.2f}" if math.isfinite(x) else "-" for x in snatches)
    )
    spread = f"{own.snatch_spread:.3f}" if math.isfinite(own.snatch_spread) else "-"
    table.add_row("snatch, largest over least median of a start", spread, "", "")
    table.add_row(
        "time with a slack rod; two bars: with one that pushes",
        _number(own.slack_time, "1"),
        "",
        _number(own.two_bar_slack_time, "1"),
    )
    table.add_row("rods that are slack, mean", _number(own.slack_rods, "1"), "", "")
    table.add_row("largest angle between two rods", f"{math.degrees(own.fold_largest):.0f} deg", "", "")
    table.add_row("energy residual over the energy moved", f"{own.energy_residual:.1e}", "", "")
    console.print(table)
    if found.distance is not None:
        console.print(
            f"The crank turns {100 * abs(found.distance):.0f} % {'above' if found.distance > 0.0 else 'below'} the "
            f"resonance of an organ, {found.resonance:.2f} rad/s.",
            soft_wrap=True,
        )
    for side, shares in found.slack_by_rod.items():
        slack = [f"{found.rod_name(k)} {100 * share:.3g} %" for k, share in enumerate(shares) if share > 0.0]
        if slack:
            console.print(f"Slack on the {side}, share of the time: {', '.join(slack)}.", soft_wrap=True)
    if len(found.sweep) > 1:
        low, high_speed = found.sweep[0].speed, found.sweep[-1].speed
        for band in found.avoid:
            ends = ", where the sweep begins" if band.low == low else ""
            ends += ", where the sweep ends" if band.high == high_speed else ""
            console.print(f"Avoid {band}{ends}: {band.why}.", soft_wrap=True)
        if not found.avoid:
            console.print(f"No speed to avoid from {low:.3g} to {high_speed:.3g} rad/s.")
    inside = [
        f"{speed:.2f} (mode {mode}, order {order})"
        for mode, order, speed in sorted(found.within_sweep(), key=lambda each: each[2])
    ]
    if inside:
        console.print(
            f"Critical speeds within the sweep [rad/s]: {', '.join(inside)}.", soft_wrap=True, markup=False
        )


def _show_shaft(study: Study, console: Console) -> None:
    """What the runs ask of the driveline."""

    def shaft(runs: list[str]) -> Table:
        table = Table(title="What the driveline carries", title_justify="left")
        table.add_column("")
        for name in runs:
            table.add_column(_short(name), justify="right")
        for v in Layout(ShaftAnswers).variables:
            values = [getattr(study.shaft[run], v.name) for run in runs]
            table.add_row(v.description, *("-" if x is None else _plain(x, v.unit) for x in values))
        return table

    _print_runs(console, shaft, study.shaft)
    found = study.torsion
    assert found is not None
    console.print(
        f"Natural frequency of torsion: {found.k_least:.4g} to {found.k_largest:.4g} rad/s; communication step at "
        f"most {found.step_longest:.2g} s."
    )


def _plain(value: float, unit: str) -> str:
    return f"{value:.3g}" if unit == "1" else _number(value, unit)


def _show_sizing(study: Study, console: Console) -> None:
    """The candidates in their order, with how much of each limit they use."""
    sized = study.sizing
    assert sized is not None
    best = sized.best
    settings = recommended(study.config, best)
    wheel = f"flywheel {best.flywheel:.3g} kg m2" if best.flywheel else "no flywheel"
    console.print(f"{sized.answer[:1].upper()}{sized.answer[1:]}.", soft_wrap=True)
    console.print(
        f"{'Insufficient motor' if study.insufficient else 'Motor'}: {best.motor.designation}, ratio "
        f"{best.drive.ratio:.2f}, {wheel}; recommended: safety coupling at {settings.trip_torque:.0f} N m of the "
        f"crank, relay at {settings.relay_current:.2f} A.",
        soft_wrap=True,
    )
    table = Table(title="Candidates, best first", title_justify="left")
    table.add_column("motor", no_wrap=True)
    table.add_column("ratio", justify="right")
    table.add_column("verdict", no_wrap=True)
    table.add_column("because")
    assert study.config.sizing is not None
    listed = int(study.config.sizing.candidates)
    for c in sized.candidates[:listed]:
        table.add_row(c.motor.designation, f"{c.drive.ratio:.2f}", c.verdict, c.reason)
    console.print(table)
    if sized.candidates[listed:]:
        console.print(f"{len(sized.candidates) - listed} more were tried; report.html lists them.")


def _show_monte_carlo(found: MonteCarloResult, console: Console) -> None:
    """Quantiles of the random overloads."""
    columns = [f"q{100 * q:.0f}" for q in QUANTILES]
    table = Table(title=f"Overloads at random, {len(found.rows)} runs", title_justify="left")
    table.add_column("quantile")
    for column in columns:
        table.add_column(f"{column[1:]} %", justify="right")
    declared = {v.name: v for v in Layout(Sample).variables}
    for name, sizes in found.quantiles().items():
        v = declared[name]
        if "share" in sizes:
            console.print(
                f"{v.description.removeprefix('1 where ').capitalize()}: {100 * sizes['share']:.1f} % of runs."
            )
        else:
            table.add_row(v.description, *(_number(sizes[c], v.unit) for c in columns))
    console.print(table)
