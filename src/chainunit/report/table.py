"""The answer on the terminal."""

from __future__ import annotations

import math

from rich.console import Console
from rich.table import Table
from rich.text import Text

from ..quantities import Layout, Variable
from ..studies.monte_carlo import QUANTILES, MonteCarloResult, Sample
from ..studies.overload import SCENARIOS, Answers, Study
from ..studies.shaft import ShaftAnswers
from ..studies.sizing import recommended

_SHORT = {
    "steady": "steady",
    "right_empties": "right empties",
    "feed_left": "feed to left",
    "jam_left": "jam left",
    "lumps": "lumps",
    "blocked": "blocked",
    "dip": "dip",
    "start_loaded": "loaded start",
}

_HIDDEN = {
    "supply_power_mean",
    "winding_temperature",
    "speed_mean",
    "speed_least",
    "power_mean",
    "crank_torque_mean",
}
_IF_ANY = {
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
    return _number(value, v.unit)


def show(study: Study, console: Console) -> None:
    """Print tables and notes."""
    config = study.config
    if study.sizing is not None:
        _show_sizing(study, console)
    runs = [name for name in ("steady", *SCENARIOS) if name in study.answers]
    if runs:
        table = Table(title=Text(config.title) if config.title else None, title_justify="left")
        table.add_column(f"crank at {config.run.crank_speed:g} rad/s")
        for name in runs:
            table.add_column(_SHORT[name], justify="right")
        for v in Layout(Answers).variables:
            known = any(getattr(study.answers[run], v.name) is not None for run in runs)
            if v.name not in _HIDDEN and (known or v.name not in _IF_ANY):
                table.add_row(v.description, *(_cell(study, run, v) for run in runs))
        console.print(table)
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
                _SHORT[worst],
            )
        console.print(table)
    if study.shaft:
        _show_shaft(study, console)
    limits = study.limits
    if limits is not None:
        swing = (math.degrees(limits.rocker_extreme_left), math.degrees(limits.rocker_extreme_right))
        console.print(f"Rocker swings from {swing[0]:.3f} to {swing[1]:.3f} deg; margin {limits.margin:.2f}.")
        console.print(
            f"A web first goes slack at {limits.slack_speed:.2f} rad/s of the crank with this feed "
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


def _show_shaft(study: Study, console: Console) -> None:
    """What the runs ask of the driveline."""
    table = Table(title="What the driveline carries", title_justify="left")
    table.add_column("")
    for name in study.shaft:
        table.add_column(_SHORT[name], justify="right")
    for v in Layout(ShaftAnswers).variables:
        values = [getattr(answers, v.name) for answers in study.shaft.values()]
        table.add_row(v.description, *("-" if x is None else _plain(x, v.unit) for x in values))
    console.print(table)
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
    chosen = sized.chosen
    if chosen is not None:
        settings = recommended(study.config, chosen)
        wheel = f"flywheel {chosen.flywheel:.3g} kg m2" if chosen.flywheel else "no flywheel"
        console.print(
            f"Motor: {chosen.motor.designation}, ratio {chosen.drive.ratio:.2f}, {wheel}; recommended: safety "
            f"coupling at {settings.trip_torque:.0f} N m of the crank, relay at {settings.relay_current:.2f} A."
        )
    else:
        console.print("No motor of the catalogue fits.")
    table = Table(title="Candidates, best first", title_justify="left")
    table.add_column("motor", no_wrap=True)
    table.add_column("ratio", justify="right")
    table.add_column("verdict", no_wrap=True)
    table.add_column("because")
    for c in sized.candidates:
        table.add_row(c.motor.designation, f"{c.drive.ratio:.2f}", c.verdict, c.reason)
    console.print(table)


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
