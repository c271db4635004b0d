"""The answer on the terminal."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping

from rich.console import Console
from rich.table import Table
from rich.text import Text

from ..quantities import Layout, Variable
from ..studies.chain import HIGH, ChainResult, SpeedNumbers
from ..studies.coupling import coupling_sentence
from ..studies.cycle import OverloadFactors, factors_for
from ..studies.events import Event, in_groups
from ..studies.judgement import motor_verdict
from ..studies.limits import Limits
from ..studies.measures import Answers, Phase, measures_of, reaches
from ..studies.monte_carlo import QUANTILES, MonteCarloResult, Sample
from ..studies.quantiles import CONFIDENCE, Estimate
from ..studies.rig import DIFFERENCE
from ..studies.shaft import ShaftAnswers
from ..studies.study import Study
from ..text import number, plain, shown

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


def _cell(study: Study, run: str, v: Variable) -> str:
    if v.name == "recovery_time" and run == "steady":
        return ""
    none = "not reached" if v.name == "recovery_time" else "-"
    return number(getattr(study.answers[run], v.name), v.unit, v.kind, none=none)


def _head(study: Study) -> str:
    """The speed that the crank reaches, and what was asked for where it is another."""
    asked = number(study.config.run.crank_speed, "rad/s", full=False)
    steady = study.answers.get("steady")
    if steady is None or reaches(steady.speed_mean, study.config.run.crank_speed):
        return f"crank at {asked}"
    return f"crank at {number(steady.speed_mean, 'rad/s')}; {asked} NOT reached"


def _short(events: Mapping[str, Event], run: str) -> str:
    """Heading of the column of a run."""
    return events[run].short if run in events else run.replace("_", "-")


def _print_runs(
    console: Console,
    table: Callable[[list[str]], Table],
    runs: Collection[str],
    events: Mapping[str, Event],
) -> None:
    """One table of all runs, a column each; where it is too wide, one for each side with steady running beside."""
    first, overloads = [run for run in runs if run not in events], in_groups(events, runs)
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
    for line in (study.verdict and study.verdict.text, (motor_verdict(study) or {}).get("text")):
        if line:
            console.print(line, soft_wrap=True)
    for slip in config.remarks:
        console.print(f"Remark: {slip.sentence}", soft_wrap=True)
    if study.sizing is not None:
        _show_sizing(study, console)
    warning = "the motor is insufficient" if study.insufficient else ""
    title = ": ".join(part for part in (config.title, warning) if part)

    def answers(runs: list[str]) -> Table:
        table = Table(title=Text(title) if title else None, title_justify="left")
        table.add_column(_head(study))
        for name in runs:
            table.add_column(_short(study.config.events, name), justify="right")
        for v in Layout(Answers).variables:
            known = any(getattr(study.answers[run], v.name) is not None for run in runs)
            if v.name not in _HIDDEN and (known or v.name not in _IF_ANY):
                table.add_row(v.description, *(_cell(study, run, v) for run in runs))
        return table

    if study.answers:
        _print_runs(console, answers, study.answers, config.events)
    if study.start is not None:
        asks = ((v, getattr(study.start, v.name)) for v in measures_of(Phase.START_UP))
        said = (f"{v.description} {number(x, v.unit, v.kind)}" for v, x in asks if x is not None)
        console.print(f"Start-up: {'; '.join(said)}.", soft_wrap=True)
    if study.chain is not None:
        _show_chain(study.chain, console)
    if study.monte_carlo is not None:
        _show_monte_carlo(study.monte_carlo, console)
    if study.statics.factors:
        asked = number(config.run.crank_speed, "rad/s", full=False)
        table = Table(title=f"Overload factor, one side against both, at {asked}", title_justify="left")
        table.add_column("way")
        for side in study.statics.factors:
            table.add_column(side, justify="right")
        table.add_column("is for")
        uses = factors_for(study.statics.factors)
        for v in Layout(OverloadFactors).variables:
            sizes = (
                number(getattr(factors, v.name), v.unit, v.kind) for factors in study.statics.factors.values()
            )
            table.add_row(v.description, *sizes, uses[v.name])
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
                number(steady["equivalent"], "N"),
                number(steady["peak"], "N"),
                number(heaviest[pin], "N"),
                _short(config.events, worst),
            )
        console.print(table)
    if study.shaft:
        _show_shaft(study, console)
    limits = study.statics.limits
    if limits is not None:
        of = {v.name: number(getattr(limits, v.name), v.unit, v.kind) for v in Layout(Limits).variables}
        console.print(
            f"Rocker swings from {of['rocker_extreme_left']} to {of['rocker_extreme_right']}; margin {of['margin']}."
        )
        web = "a web" if study.drive.chain is None else "with two bars a web"
        cases = {"with this feed": "slack_speed", "empty": "slack_speed_empty"}
        slack = "; ".join(
            f"{case}, {web} "
            + (
                f"first goes slack at {of[name]} of the crank"
                if getattr(limits, name)
                else "is slack at rest"
            )
            for case, name in cases.items()
        )
        console.print(
            f"{slack[:1].upper()}{slack[1:]}; the lowest mode of a chain lies near {of['chain_resonance']}.",
            soft_wrap=True,
        )
    for name, found in study.statics.loops.items():
        console.print(
            f"Speed loop, {name} ({number(found.inertia, 'kg.m2')}): phase margin {found.phase_margin:.0f} deg at "
            f"{number(found.crossover, 'rad/s')}; a step of 1 N m takes {number(found.speed_dip, 'rad/s')} off the "
            f"motor speed, settled after {number(found.settling, 's')}.",
            soft_wrap=True,
        )
    if study.certificate:
        worst_share = max(
            share
            for certificate in study.certificate.values()
            for kind, share in certificate.items()
            if kind.endswith("energy_residual_share")
        )
        console.print(
            f"Energy residual of the shaft: at most {number(worst_share, '1')} of the energy moved."
        )
    compared: dict[str, dict[str, float]] = {}
    for run, certificate in study.certificate.items():
        for name, value in certificate.items():
            if name.endswith(DIFFERENCE):
                compared.setdefault(name.removesuffix(DIFFERENCE), {})[run] = value
    for name, differences in compared.items():
        worst = max(differences, key=lambda run: differences[run])
        console.print(
            f"Difference of {name} to the monolithic solution, in parts of its peak: at most "
            f"{number(differences[worst], '1')} ({study.called(worst)}), {len(differences)} runs compared.",
            soft_wrap=True,
        )
    for remark in study.warnings:
        console.print(f"Warning: {remark}", soft_wrap=True)
    for remark in study.notes:
        console.print(f"Note: {remark}", soft_wrap=True)


def _show_chain(found: ChainResult, console: Console) -> None:
    """Chains beside two bars at the study's speed, and which speeds to avoid."""
    own, high = found.own, f"{100 * HIGH:g} %"
    table = Table(
        title=f"Chains and two bars at constant {own.speed:g} rad/s, {found.starts} starts of {found.turns} turns",
        title_justify="left",
    )
    table.add_column("peaks are of single turns")
    for column in (
        "chains, median",
        f"chains, {high} of turns ({100 * CONFIDENCE:g} % interval)",
        "two bars",
    ):
        table.add_column(column, justify="right")
    kinds = {v.name: v for v in Layout(SpeedNumbers).variables}

    def own_number(name: str) -> str:
        v = kinds[name]
        return number(getattr(own, name), v.unit, v.kind)

    def told(name: str) -> str:
        """The quantile with its interval, where the starts tell it."""
        if math.isnan(getattr(own, f"{name}_from")):
            return "starts differ"
        ends = (number(getattr(own, f"{name}_{end}"), "1") for end in ("from", "to"))
        return f"{own_number(name)} ({' to '.join(ends)})"

    for title, name in (
        ("crank torque, peak", "crank_torque"),
        ("rocker torque, peak", "rocker_torque"),
        ("snatch: force at A2 over its own at rest", "snatch"),
    ):
        table.add_row(
            title, own_number(f"{name}_median"), told(f"{name}_high"), own_number(f"two_bar_{name}")
        )
    for title, name, two in (
        ("crank torque, RMS", "crank_torque_rms", "two_bar_crank_torque_rms"),
        ("snatch, largest over least median of a start", "snatch_spread", ""),
        ("time with a slack rod; two bars: with one that pushes", "slack_time", "two_bar_slack_time"),
        ("rods that are slack, mean", "slack_rods", ""),
        ("largest angle between two rods", "fold_largest", ""),
        ("energy residual over the energy moved", "energy_residual", ""),
    ):
        table.add_row(title, own_number(name), "", own_number(two) if two else "")
    console.print(table)
    if found.distance is not None:
        console.print(
            f"The crank turns {number(abs(found.distance), '1', 'percent')} "
            f"{'above' if found.distance > 0.0 else 'below'} the resonance of an organ, "
            f"{number(found.resonance, 'rad/s')}.",
            soft_wrap=True,
        )
    for side, shares in found.slack_by_rod.items():
        slack = [
            f"{found.rod_name(k)} {number(share, '1', 'percent')}"
            for k, share in enumerate(shares)
            if share > 0.0
        ]
        if slack:
            console.print(f"Slack on the {side}, share of the time: {', '.join(slack)}.", soft_wrap=True)
    if len(found.sweep) > 1:
        low, high_speed = found.sweep[0].speed, found.sweep[-1].speed
        for band in found.avoid:
            ends = ", where the sweep begins" if band.low == low else ""
            ends += ", where the sweep ends" if band.high == high_speed else ""
            console.print(f"Avoid {band}{ends}: {band.why}.", soft_wrap=True)
        if not found.avoid:
            console.print(f"No speed to avoid from {number(low, 'rad/s')} to {number(high_speed, 'rad/s')}.")
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
            table.add_column(_short(study.config.events, name), justify="right")
        for v in Layout(ShaftAnswers).variables:
            values = [getattr(study.shaft[run], v.name) for run in runs]
            table.add_row(v.description, *(number(x, v.unit, v.kind) for x in values))
        return table

    _print_runs(console, shaft, study.shaft, study.config.events)
    found = study.statics.torsion
    assert found is not None
    console.print(
        f"Natural frequency of torsion: {number(found.k_least, 'rad/s')} to {number(found.k_largest, 'rad/s')}; "
        f"communication step at most {number(found.step_longest, 's')}."
    )


def _caveat(study: Study) -> str:
    """What a recommendation adds where the model that it rests on does not hold."""
    found = study.verdict.caveat if study.verdict else ""
    return f" ({found})" if found else ""


def _show_sizing(study: Study, console: Console) -> None:
    """The candidates in their order, with how much of each limit they use."""
    sized = study.sizing
    assert sized is not None
    best, caveat = sized.best, _caveat(study)
    wheel = f"flywheel {best.flywheel:.3g} kg m2" if best.flywheel else "no flywheel"
    relay = f"; relay at {best.motor.nameplate.rated_current:.2f} A" if not study.insufficient else ""
    console.print(f"{sized.answer[:1].upper()}{sized.answer[1:]}.", soft_wrap=True)
    console.print(
        f"{'Insufficient motor' if study.insufficient else 'Motor'}: {best.motor.designation}, ratio "
        f"{best.drive.ratio:.2f}, {wheel}{relay}{caveat}.",
        soft_wrap=True,
    )
    if study.setting is not None:
        console.print(coupling_sentence(study), soft_wrap=True)
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
    """Quantiles of the random overloads that their number tells."""
    declared, found_of = {v.name: v for v in Layout(Sample).variables}, found.quantiles()
    columns = [f"q{100 * q:.0f}" for q in QUANTILES]
    columns = [c for c in columns if any(c in sizes for sizes in found_of.values())]
    certain = f"{100 * CONFIDENCE:g} % interval"
    sides = ", ".join(f"{runs} {side}" for side, runs in found.sides.items())
    table = Table(title=f"Overloads at random, {len(found.rows)} runs ({sides})", title_justify="left")
    table.add_column("quantile")
    for column in columns:
        table.add_column(f"{column[1:]} % ({certain})", justify="right")

    def told(each: Estimate | None, unit: str, kind: str = "") -> str:
        if each is None:
            return "-"
        ends = [shown(x, unit, kind)[0] for x in (each.low, each.high)]
        return f"{number(each.value, unit, kind)} ({plain(' to '.join(ends))})"

    for name, sizes in found_of.items():
        v = declared[name]
        if "share" in sizes:
            what = v.description.removeprefix("1 where ").capitalize()
            console.print(f"{what}: {told(sizes['share'], '1', 'percent')} of runs; {certain}.")
        elif columns:
            table.add_row(v.description, *(told(sizes.get(c), v.unit) for c in columns))
    if columns:
        console.print(table)
