"""The report on a study: the answer, every run in numbers, what it rests on, what was given."""

from __future__ import annotations

import platform
from collections.abc import Iterable, Iterator, Mapping
from importlib import metadata
from typing import Any

from ..quantities import Layout, Variable
from ..study.measures import Answers
from ..study.monte_carlo import Sample
from ..study.organs import Limits, OverloadFactors
from ..study.result import as_dict
from ..study.shaft import ShaftAnswers, Torsion
from ..study.study import Study
from . import accessors as read
from . import blocks as b
from .analyses import ANALYSES
from .chain_unit_figures import PICTURES as _PICTURES
from .chain_unit_figures import figures
from .chain_unit_parts import chains, sizing, spoken
from .lines import Line, Number, Strong, capital, joined, line
from .study_motion import motion
from .terminal import plain_line

PICTURES = (*_PICTURES, *(picture for each in ANALYSES.values() for picture in each.pictures))
"""Files of all figures that a report may have."""
_KEY = ("crank_torque_peak", "motor_torque_peak", "power_peak", "current_peak", "winding_temperature")
"""The families of answers that are shown large, each by its first field."""
_HOLDS: dict[str, b.Severity] = {"true": "good", "in part": "partly", "false": "bad"}
_VERSIONS = ("numpy", "casadi", "fmpy", "plotly")


def report(study: Study, result: Mapping[str, Any] | None = None) -> b.Report:
    """The report; `result` are its numbers, by default those of `as_dict`."""
    s = b.Source(as_dict(study) if result is None else result)
    return b.Report(
        study.config.title,
        study.kind,
        s.result,
        tuple(_opening(s, study)),
        (
            b.Section("answer", "The answer", tuple(_answer(s, study))),
            b.Section("sizing", "The drive", tuple(sizing(s, study)) if "sizing" in s.result else ()),
            b.Section("runs", "Every run in numbers", tuple(_runs(s, study))),
            b.Section("chains", "Chains and two bars", tuple(chains(s, study)) if study.chain else ()),
            *(
                b.Section(name, ANALYSES[name].heading, tuple(ANALYSES[name].blocks(s, study)))
                for name in study.findings
            ),
            b.Section("plots", "Plots", tuple(figures(s, study))),
            b.Section(
                "motion",
                "The machine in motion",
                tuple(_motion(study)),
            ),
            b.Section("basis", "What this rests on", tuple(_basis(s, study))),
            b.Section("given", "All that was given", (_given(s, study),)),
        ),
        source=s.line("Study file: {source} · chainunit {chainunit}"),
        failure=s.words("failure") if study.failure is not None else (),
        units=study.config.units,
    )


def _motion(study: Study) -> Iterator[b.Block]:
    if study.runs:
        yield motion(study)


# -- what was asked


def _opening(s: b.Source, study: Study) -> Iterator[b.Block]:
    machine = "chain unit" if "limits" in s.result else "machine"
    question = s.line(
        f"Which motor, gear and flywheel does this {machine} need? Its crank turns at "
        if "sizing" in s.result
        else f"What does the drive of this {machine} have to give? A motor turns the crank through a gear of ratio "
        "{=machine.ratio}, in normal running at "
    )
    question += s.line(
        "{=run.crank_speed}. The left organ carries {=feed.left.material_mass} of material and works against "
        "{=feed.left.processing_force}, the right one {=feed.right.material_mass} and "
        "{=feed.right.processing_force}."
        if "limits" in s.result
        else "{=run.crank_speed}."
    )
    if study.answers:
        question += s.line(
            " The machine starts from rest{ramp} and is evaluated over {=run.turns} {turns} when steady.",
            ramp=s.line(" in {=run.ramp}") if study.drive.follows else "",
            turns="turn" if study.config.run.turns == 1.0 else "turns",
        )
    if names := study.overloads:
        words = "; ".join(read.title(study, name) for name in names)
        question += line(f" Then come overloads, each by itself: {words}.")
    yield b.Text(question, form="long")
    ratio = () if "sizing" in s.result else ("machine.ratio",)
    feed = (f"feed.{name}" for name in Layout(type(study.config.feed)).names)
    rows = (
        b.TableRow((_described(study, path), s.number(path, given=True)))
        for path in ("run.crank_speed", *ratio, *feed)
    )
    yield b.Table(tuple(rows), title="In short", form="long")


def _described(study: Study, path: str) -> str:
    """The declared description of a given quantity."""
    section, _, name = path.partition(".")
    declared = study.drive.machine.p if section == "machine" else getattr(study.config, section)
    return next(v.description for v in Layout(type(declared)).variables if v.name == name)


def _given(s: b.Source, study: Study) -> b.Given:
    config = study.config
    # a motor on the line follows no reference
    unused = () if study.drive.follows else ("ramp",)
    sections = (
        ("run", config.run, "Run"),
        ("feed", config.feed, "Feed in normal running"),
        *((f"event.{name}", event.p, read.title(study, name)) for name, event in config.events.items()),
        ("coupling", config.coupling, "Safety coupling"),
        ("machine", study.drive.machine.p, "Machine"),
        ("chain", config.chain, "Chains"),
        ("driveline", config.driveline, "Driveline"),
        ("motor", study.drive.parameters, "Motor"),
    )
    return b.Given(
        tuple(
            s.given(title, declared, section, unused if section == "run" else ())
            for section, declared, title in sections
            if declared is not None
        )
    )


# -- the answer


def _answer(s: b.Source, study: Study) -> Iterator[b.Block]:
    for of in ("model", "motor"):
        verdict = s.result["verdict"][of]
        if verdict is not None:
            yield b.Judgement(_HOLDS[verdict["holds"]], s.words(f"verdict.{of}.text"))
    if slips := s.result["slips"]:
        items = tuple(s.words(f"slips.{i}.said") for i in range(len(slips)))
        yield b.Judgement("remark", Strong("Is this what was meant?"), items=items)
    nearest = s.result["sizing"].get("nearest") if "sizing" in s.result else None
    if nearest is not None:
        best = f"sizing.candidates.{nearest}"
        rest = f" All runs are with {{{best}.motor}}, which is insufficient: {{{best}.reason}}."
        yield b.Judgement("alarm", line(Strong("No motor of the catalogue fits."), s.line(rest)), form="long")
    answers = s.result["answers"]
    if answers:
        reference = "steady" if "steady" in answers else next(iter(answers))
        worst = " Below: the overload that asks most." if study.overloads else ""
        speed = _speed(s, study, reference)
        lead = line(f"Large: {read.title(study, reference)}, the crank at ", speed, f".{worst}")
        yield b.Text(lead, "lead", "long")
        families = _families(answers[reference]).items()
        yield b.Cards(
            tuple(
                _card(s, study, family, members, reference)
                for family, members in families
                if members[0][1].name in _KEY
            )
        )
    else:
        yield b.Text("The study ended before any run could be evaluated.", "lead", "long")
    if "overload_factors" in s.result:
        yield _factors(s, study)
    yield from (b.Judgement("warning", each) for each in s.lines("warnings"))
    if answers and not s.result["warnings"]:
        yield b.Text("No run gives cause for a warning.", "fine", "long")


def _speed(s: b.Source, study: Study, run: str) -> Line:
    """The crank speed that a run has: the one asked for, or the one reached and marked where it is another."""
    if run != "steady" or study.reaches:
        return s.line("{=run.crank_speed}")
    reached = Strong(s.line(f"▲ {{answers.{run}.speed_mean}}"))
    return line(reached, s.line(", not the {=run.crank_speed} asked for"))


def _families(names: Iterable[str]) -> dict[str, list[tuple[str, Variable]]]:
    """Answers by what they are of: {"crank torque": [("peak", ..), ("RMS", ..)]}, as their descriptions say."""
    families: dict[str, list[tuple[str, Variable]]] = {}
    have = set(names)
    for v in Layout(Answers).variables:
        if v.name in have:
            family, _, kind = v.description.partition(", ")
            families.setdefault(family, []).append((kind, v))
    return families


def _card(s: b.Source, study: Study, family: str, members: list[tuple[str, Variable]], run: str) -> b.Card:
    """An answer, large: its first two numbers in the run `run`, and the worst overload."""
    large, small = members[:2], members[2:]
    lines = [joined(line(f"{kind} ", _number(s, study, run, v)) for kind, v in small)] if small else []
    kind, v = large[0]
    sizes = {name: s.value(f"answers.{name}.{v.name}") for name in study.overloads}
    magnitudes = {name: abs(size) for name, size in sizes.items() if size is not None}
    if magnitudes:
        worst = max(magnitudes, key=lambda name: magnitudes[name])
        peak = Strong(_number(s, study, worst, v))
        lines.append(line(f"overload: {kind} ", peak, f", {read.title(study, worst)}"))
    numbers = ((_number(s, study, run, v), kind or read.title(study, run)) for kind, v in large)
    return b.Card(family, tuple(numbers), tuple(lines))


def _number(s: b.Source, study: Study, run: str, v: Variable) -> Number:
    """An answer of a run."""
    back = v.name == "recovery_time" and run != "steady" and study.returns
    return s.number(f"answers.{run}.{v.name}", none="not reached" if back else "-")


def _factors(s: b.Source, study: Study) -> b.Table:
    sides = s.result["overload_factors"]
    described = {v.name: v.description for v in Layout(OverloadFactors).variables}
    first = next(iter(sides))
    rows = (
        b.TableRow(
            (
                described[name],
                *(s.number(f"overload_factors.{side}.{name}") for side in sides),
                s.words(f"overload_factors.{first}.{name}.for"),
            )
        )
        for name in sides[first]
    )
    # chains have no cycle at constant speed: the factors are those of two bars in every study
    by = "" if study.drive.chain is None else ", of two bars in place of the chains"
    title = s.line("Overload factor, one side against both, at {=run.crank_speed}" + by)
    return b.Table(tuple(rows), b.heads("way", *sides, "is for"), title=title, numeric=False)


# -- every run


def _runs(s: b.Source, study: Study) -> Iterator[b.Block]:
    """Every answer of every run, what the pins carry, and where the model ends."""
    if s.result["answers"]:
        yield _table_of_runs(s, study)
    if s.result.get("start_up"):
        numbers = [(v, s.number(f"start_up.{v.name}")) for v in read.START_UP]
        start = [(v.description, size) for v, size in numbers if size.value is not None]
        sizes = joined((line(f"{title} ", size) for title, size in start), "; ")
        yield b.Text(line("Start-up: ", sizes, "."), form="short")
        yield b.Table(tuple(map(b.TableRow, start)), title="What the start-up asks of the drive", form="long")
    if s.result["pins"]:
        yield _pins(s, study)
    if s.result.get("shaft"):
        yield _shaft(s, study)
        yield b.Table(s.rows(Torsion, "driveline"), title="The driveline's torsion")
    if s.result.get("monte_carlo"):
        yield from _random(s)
    if "limits" in s.result:
        yield from _limits(s, study)
    if loops := s.result.get("speed_loop"):
        title = "The speed loop, linearised; dip and settling: after a step of the load torque"
        yield _matrix(s, "speed_loop", {loop: spoken(loop) for loop in loops}, title, first="")


def _matrix(s: b.Source, path: str, rows: Mapping[str, str], title: str, first: str, **more: Any) -> b.Table:
    """A table of all that stands below `path`: what has a title in `rows`, by what each has."""
    sections = b.at(s.result, path)
    names = list(dict.fromkeys(name for section in rows for name in sections[section]))
    cells = (
        b.TableRow(
            (words, *(s.number(f"{path}.{of}.{name}") if name in sections[of] else "" for name in names))
        )
        for of, words in rows.items()
    )
    return b.Table(tuple(cells), b.heads(first, *map(spoken, names)), title=title, **more)


def _ordered(study: Study, runs: Iterable[str]) -> list[str]:
    """Runs with the overloads of each side beside each other."""
    runs = list(runs)
    by_side = [run for group in read.groups(study, runs) for run in group]
    return [*(run for run in runs if run not in by_side), *by_side]


def _over_runs(
    study: Study, runs: list[str], rows: Iterable[b.TableRow], title: str, first: str = ""
) -> b.Table:
    """A table with a column for each run; those of the overloads of a side belong together."""
    columns = (b.Column(read.title(study, run), read.short(study, run)) for run in runs)
    groups = (tuple(runs.index(run) + 1 for run in group) for group in read.groups(study, runs))
    return b.Table(tuple(rows), (b.Column("", first), *columns), title=title, groups=tuple(groups))


def _table_of_runs(s: b.Source, study: Study) -> b.Table:
    answers, unknown = s.result["answers"], study.not_known
    runs = _ordered(study, answers)
    rows = (
        b.TableRow(
            (v.description, *(_number(s, study, run, v) for run in runs)),
            form="long" if read.minor(v) else "both",
        )
        for v in Layout(Answers).variables
        # nothing to say of a coupling that is not there, or that did not open; a dash for what a motor does not tell
        if v.name in unknown
        or any(answers[run][v.name]["value"] is not None for run in runs)
        or (v.name == "recovery_time" and study.returns and study.overloads)
    )
    head = "crank at {=run.crank_speed}"
    if not study.reaches:
        head = "crank at {answers.steady.speed_mean}; {=run.crank_speed} NOT reached"
    title = f"What each run asks of the drive{'; the motor is insufficient' if study.insufficient else ''}"
    return _over_runs(study, runs, rows, title, plain_line(s.line(head), study.config.units))


def _pins(s: b.Source, study: Study) -> b.Table:
    tables = s.result["pins"]
    reference = "steady" if "steady" in tables else next(iter(tables))
    sizes = list(next(iter(tables[reference].values())))

    def row(pin: str) -> b.TableRow:
        worst = max(tables, key=lambda run: tables[run][pin]["peak"]["value"])
        own = (s.number(f"pins.{reference}.{pin}.{size}") for size in sizes)
        return b.TableRow(
            (pin, *own, s.number(f"pins.{worst}.{pin}.peak"), study.called(worst), read.short(study, worst))
        )

    columns = (
        b.Column(f"{read.title(study, reference)}, {spoken(size)}", f"{reference}, {spoken(size)}")
        for size in sizes
    )
    return b.Table(
        tuple(map(row, tables[reference])),
        (
            b.Column("pin"),
            *columns,
            b.Column("largest peak", "largest"),
            b.Column("in", form="long"),
            b.Column("in", form="short"),
        ),
        title="What the bearings carry (equivalent: ISO 281)",
    )


def _shaft(s: b.Source, study: Study) -> b.Table:
    """What each run asks of the driveline."""
    runs = _ordered(study, s.result["shaft"])
    rows = (
        b.TableRow((v.description, *(s.number(f"shaft.{run}.{v.name}") for run in runs)))
        for v in Layout(ShaftAnswers).variables
    )
    return _over_runs(study, runs, rows, "What the driveline carries")


def _random(s: b.Source) -> Iterator[b.Block]:
    """The quantiles of overloads at random."""
    quantiles = {name: sizes for name, sizes in s.result["monte_carlo"]["quantiles"].items() if sizes}
    declared = {v.name: v.description.removeprefix("1 where ") for v in Layout(Sample).variables}
    columns = list(dict.fromkeys(k for sizes in quantiles.values() for k in sizes))

    def cell(name: str, k: str) -> Line:
        return (
            s.estimate(f"monte_carlo.quantiles.{name}.{k}", ".low", ".high") if k in quantiles[name] else ""
        )

    rows = tuple(b.TableRow((declared[name], *(cell(name, k) for k in columns))) for name in quantiles)
    heads = (f"{k[1:]} % of runs below" if k.startswith("q") else "share of runs" for k in columns)
    sides = joined(
        s.line(f"{{=monte_carlo.sides.{side}}} {side}") for side in s.result["monte_carlo"]["sides"]
    )
    of_sides = line(" (", sides, ")") if sides else ()
    title = s.line(
        "Overloads at random, {=monte_carlo.runs} runs{sides}; in brackets: interval of {=monte_carlo.confidence} "
        "confidence",
        sides=of_sides,
    )
    if rows:
        yield b.Table(rows, b.heads("", *heads), title=title)


def _limits(s: b.Source, study: Study) -> Iterator[b.Block]:
    swing = "Rocker swings from {limits.rocker_extreme_left} to {limits.rocker_extreme_right}; margin {limits.margin}"
    yield b.Text(s.line(f"{swing}."), form="short")
    web = "a web" if study.drive.chain is None else "with two bars a web"
    cases = [
        f"{case}, {web} "
        + (
            f"first goes slack at {{limits.{name}}} of the crank"
            if s.value(f"limits.{name}")
            else "is slack at rest"
        )
        for case, name in (("with this feed", "slack_speed"), ("empty", "slack_speed_empty"))
        if s.value(f"limits.{name}") is not None
    ]
    if s.value("limits.chain_resonance") is not None:
        cases.append("the lowest mode of a chain lies near {limits.chain_resonance}")
    if cases:
        yield b.Text(s.line(capital("; ".join(cases)) + "."))
    yield b.Table(s.rows(Limits, "limits", none="none"), title="Where the model ends", form="long")


# -- what it rests on


def _basis(s: b.Source, study: Study) -> Iterator[b.Block]:
    yield from (b.Text(each, "note") for each in s.lines("notes"))
    if s.result["certificate"]:
        yield from _certificate(s, study, s.result["certificate"])
    tuned = s.result["control"]
    control: Line = (
        joined(s.line(f"{spoken(name)} {{control.{name}}}") for name in tuned)
        if isinstance(tuned, Mapping)
        else s.words("control")
    )
    versions = {"Python": platform.python_version()} | {name: _version(name) for name in _VERSIONS}
    libraries = "".join(f", {name} {version}" for name, version in versions.items())
    rows = (
        *(b.TableRow((f"{name} FMU", s.words(f"fmus.{name}"))) for name in s.result["fmus"]),
        b.TableRow(("speed control", control)),
        b.TableRow(("versions", s.line("chainunit {chainunit}{libraries}", libraries=libraries))),
    )
    yield b.Table(rows, title="How it was made", numeric=False, form="long")
    traced = (
        "Every number in the text of this page is taken from result.json, which is embedded here whole; point at a "
        "number to see where it stands there, and with more digits."
    )
    yield b.Text(traced, "note", "long")


def _certificate(
    s: b.Source, study: Study, certificate: Mapping[str, Mapping[str, Any]]
) -> Iterator[b.Block]:
    words = (
        "What the motor gave to the shaft, computed in the motor, against what the machine stored and dissipated, "
        "computed in the machine: the share of the energy moved that is missing."
    )
    yield b.Text(words, form="long")
    rows = {run: study.called(run) for run in certificate}
    yield _matrix(s, "certificate", rows, "Energy certificate", "run", form="long")
    for name in dict.fromkeys(name for shares in certificate.values() for name in shares):
        have = [run for run, shares in certificate.items() if name in shares]
        run = max(have, key=lambda run: s.value(f"certificate.{run}.{name}") or 0.0)
        most = f"{{certificate.{run}.{name}}}"
        text = f"{spoken(name.removesuffix('_share')).capitalize()}: at most {most} of the energy moved."
        if name.endswith(read.DIFFERENCE):
            text = (
                f"Difference of {name.removesuffix(read.DIFFERENCE)} to the monolithic solution, in parts of its "
                f"peak: at most {most} ({rows[run]}), {len(have)} runs compared."
            )
        yield b.Text(s.line(text), form="short")


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "not installed"
