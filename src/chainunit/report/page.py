"""report.html: the study as one page that needs nothing else, neither files nor a network.

Every number in its text is an element that names its place in result.json, which the page carries whole
(``<script id="result">``). Curves and the moving machine are of the series in result.nc, thinned out.

Where the result has a key ``sizing``, the page shows what a drive was sized for, its candidates with the utilisation
of each check, and which was chosen.
"""

from __future__ import annotations

import json
import math
import platform
from collections.abc import Collection, Iterable, Iterator, Mapping
from html import escape
from importlib import metadata, resources
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from plotly.offline import get_plotlyjs  # type: ignore[import-untyped]

from .. import __version__
from ..files import whole
from ..quantities import Layout, Variable
from ..studies.cycle import OverloadFactors
from ..studies.limits import Limits
from ..studies.measures import Answers, Phase, measures_of
from ..studies.monte_carlo import Sample
from ..studies.result import as_dict
from ..studies.shaft import ShaftAnswers, Torsion
from ..studies.sizing import Verdict
from ..studies.study import Study
from ..text import shown
from .interactive import Plot, called, plots
from .motion import motion
from .trace import Traced, at

NAME = "report.html"

# the families of answers that are shown large, each by its first field
_KEY = ("crank_torque_peak", "motor_torque_peak", "power_peak", "current_peak", "winding_temperature")
_VERSIONS = ("numpy", "casadi", "fmpy", "plotly")
_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; "
    "font-src data:"
)


def write(study: Study, folder: Path) -> Path:
    """Write the page into `folder`; returns the file."""
    file = folder / NAME
    page = render(study, as_dict(study))
    with whole(file) as part:
        part.write_text(page, "utf-8")
    return file


def render(study: Study, result: Mapping[str, Any]) -> str:
    """The page of a study whose numbers are `result` (`chainunit.studies.result.as_dict`)."""
    t = Traced(result)
    drawn = list(plots(study))
    moving = motion(study) if study.runs else None
    sections = [
        ("answer", "The answer", _answer(t, study)),
        ("sizing", "The drive", _sizing(t) if "sizing" in result else ""),
        ("runs", "Every run in numbers", _runs(t)),
        ("chains", "Chains and two bars", _chains(t) if study.chain is not None else ""),
        ("plots", "Plots", _figures(t, drawn)),
        ("motion", "The machine in motion", _motion() if moving else ""),
        ("basis", "What this rests on", _basis(t, study)),
        ("given", "All that was given", _all_given(t, study)),
    ]
    sections = [section for section in sections if section[2]]
    title = study.config.title or "Study of a chain unit"
    figures = ",".join(f"{json.dumps(plot.name)}:{plot.figure.to_json()}" for plot in drawn)
    embedded = {
        "result": json.dumps(result, allow_nan=False, ensure_ascii=False),
        "figures": f"{{{figures}}}",
        "pictures": json.dumps(moving, allow_nan=False, separators=(",", ":")),
    }
    return "\n".join(
        [
            "<!DOCTYPE html>",
            '<html lang="en">',
            "<head>",
            '<meta charset="utf-8">',
            f'<meta http-equiv="Content-Security-Policy" content="{escape(_POLICY)}">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            f'<meta name="generator" content="chainunit {__version__}">',
            f"<title>{escape(title)}</title>",
            '<link rel="icon" href="data:,">',
            f"<style>\n{_resource('page.css')}</style>",
            "</head>",
            "<body>",
            _header(t, study, title, sections),
            "<main>",
            *(
                f'<section id="{name}" aria-labelledby="{name}-title">\n'
                f'<h2 id="{name}-title">{heading}</h2>\n{content}\n</section>'
                for name, heading, content in sections
            ),
            "</main>",
            # no text can end the element early
            *(
                f'<script type="application/json" id="{name}">{text.replace("<", chr(92) + "u003c")}</script>'
                for name, text in embedded.items()
            ),
            f'<script id="plotly">{get_plotlyjs()}</script>',
            f"<script>\n{_resource('page.js')}</script>",
            "</body>",
            "</html>\n",
        ]
    )


def _resource(name: str) -> str:
    return (resources.files(__package__) / name).read_text("utf-8")


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _called(t: Traced, run: str) -> str:
    """Title of a run."""
    return called({name: SimpleNamespace(**event) for name, event in t.result["events"].items()}, run)


def _in_sentences(t: Traced, run: str) -> str:
    return "start-up" if run == "start_up" else _called(t, run)


def _words(name: str) -> str:
    return name.replace("_", " ")


def _variables(declared: Any, names: Iterable[str]) -> list[Variable]:
    """The declared scalars of an instance that the result has, in declared order."""
    have = set(names)
    return [v for v in Layout(type(declared)).variables if v.name in have]


def _table(
    head: Iterable[str], rows: Iterable[Iterable[str]], *, caption: str = "", numeric: bool = True
) -> str:
    """A table whose first column names the row; the cells are HTML."""
    cells = "".join(f'<th scope="col">{cell}</th>' for cell in head)
    lines = []
    for first, *rest in rows:
        lines.append(
            f'<tr><th scope="row">{first}</th>' + "".join(f"<td>{cell}</td>" for cell in rest) + "</tr>"
        )
    return (
        f'<div class="wide"><table class="{"numbers" if numeric else "words"}">'
        + (f"<caption>{caption}</caption>" if caption else "")
        + (f"<thead><tr>{cells}</tr></thead>" if cells else "")
        + f"<tbody>{''.join(lines)}</tbody></table></div>"
    )


def _given(t: Traced, section: str, declared: Any, caption: str, leave_out: Collection[str] = ()) -> str:
    """The table of what was given for a declaration."""
    rows = [
        (escape(_capital(v.description)), t.number(f"{section}.{v.name}", given=True))
        for v in _variables(declared, at(t.result, section))
        if v.name not in leave_out
    ]
    return _table((), rows, caption=caption)


def _header(t: Traced, study: Study, title: str, sections: list[tuple[str, str, str]]) -> str:
    def n(path: str, kind: str | None = None, *, given: bool = True) -> str:
        return t.number(path, kind=kind, given=given)

    overloads = [study.called(name) for name in study.overloads]
    if "sizing" in t.result:
        asked = "Which motor, gear and flywheel does this chain unit need? Its crank turns at "
    else:
        asked = (
            "What does the drive of this chain unit have to give? A motor turns the crank through a gear of ratio "
            f"{n('machine.ratio')}, in normal running at "
        )
    asked += (
        f"{n('run.crank_speed')} ({n('run.crank_speed', 'rotation', given=False)}). The left organ carries "
        f"{n('feed.left.material_mass')} of material and works against {n('feed.left.processing_force')}, the right "
        f"one {n('feed.right.material_mass')} and {n('feed.right.processing_force')}."
    )
    if study.answers:
        ramp = f" in {n('run.ramp')}" if study.drive.follows else ""
        turns = "turn" if study.config.run.turns == 1.0 else "turns"
        asked += (
            f" The machine starts from rest{ramp} and is evaluated over {n('run.turns')} {turns} when steady."
        )
    if overloads:
        asked += f" Then come overloads, each by itself: {escape('; '.join(overloads))}."
    status = ""
    if t.result["status"] != "complete":
        status = (
            f'<p class="alarm"><strong>The run stopped early:</strong> {t.text("failure")}. What was computed '
            "before is shown.</p>"
        )
    links = "".join(f'<a href="#{name}">{heading}</a>' for name, heading, _ in sections)
    return (
        "<header>\n"
        f'<p class="kind">Chain unit: forces, torque and one-sided overload</p>\n<h1>{escape(title)}</h1>\n'
        f'<p class="from">Study file: {t.text("source")} · chainunit {t.text("chainunit")} · '
        f"status: {'complete' if not status else 'stopped early'}</p>\n"
        f'{status}\n<nav aria-label="Sections">{links}</nav>\n'
        f'<h2 id="asked">What was asked</h2>\n<div class="asked"><p>{asked}</p>{_key_table(t, study)}</div>\n'
        "</header>"
    )


def _all_given(t: Traced, study: Study) -> str:
    config = study.config
    # a motor on the line follows no reference
    unused = () if study.drive.follows else ("ramp",)
    tables = "".join(
        _given(t, section, declared, caption, leave_out=unused if section == "run" else ())
        for section, declared, caption in (
            ("run", config.run, "Run"),
            ("feed", config.feed, "Feed in normal running"),
            *((f"event.{name}", event.p, study.called(name)) for name, event in config.events.items()),
            ("coupling", config.coupling, "Safety coupling"),
            ("machine", study.drive.machine.p, "Machine"),
            ("chain", config.chain, "Chains"),
            ("driveline", config.driveline, "Driveline"),
            ("motor", study.drive.parameters, "Motor"),
        )
        if declared is not None
    )
    return f'<div class="given">{tables}</div>'


def _key_table(t: Traced, study: Study) -> str:
    """The few inputs that the answer turns on."""
    config = study.config
    rows = []
    for section, declared, wanted in (
        ("run", config.run, ("crank_speed",)),
        ("machine", study.drive.machine.p, () if "sizing" in t.result else ("ratio",)),
        ("feed", config.feed, Layout(type(config.feed)).names),
    ):
        rows += [
            (escape(_capital(v.description)), t.number(f"{section}.{v.name}", given=True))
            for v in _variables(declared, wanted)
        ]
    more = '<p class="also"><a href="#given">All that was given</a></p>'
    return f"<div>{_table((), rows, caption='In short')}{more}</div>"


def _families(names: Iterable[str]) -> dict[str, list[tuple[str, Variable]]]:
    """Answers by what they are of: {"crank torque": [("peak", ..), ("RMS", ..)]}, as their descriptions say."""
    families: dict[str, list[tuple[str, Variable]]] = {}
    have = set(names)
    for v in Layout(Answers).variables:
        if v.name in have:
            family, _, kind = v.description.partition(", ")
            families.setdefault(family, []).append((kind, v))
    return families


def _answer(t: Traced, study: Study) -> str:
    answers = t.result["answers"]
    parts, cards = [_verdict(t)], []
    if remarks := t.result.get("remarks"):
        items = "".join(f"<li>{t.text(f'remarks.{i}.said')}</li>" for i in range(len(remarks)))
        parts.append(f'<div class="alarm"><strong>Is this what was meant?</strong><ul>{items}</ul></div>')
    nearest = t.result["sizing"].get("nearest") if "sizing" in t.result else None
    if nearest is not None:
        parts.append(
            '<p class="alarm"><strong>No motor of the catalogue fits.</strong> All runs are with '
            f"{t.text(f'sizing.candidates.{nearest}.motor')}, which is insufficient: "
            f"{t.text(f'sizing.candidates.{nearest}.reason')}.</p>"
        )
    if answers:
        reference = "steady" if "steady" in answers else next(iter(answers))
        cards = [
            _card(t, family, members, reference)
            for family, members in _families(answers[reference]).items()
            if members[0][1].name in _KEY
        ]
        large = f"Large: {_called(t, reference)}, the crank at {_speed(t, reference)}."
        worst = (
            " Below: the overload that asks most."
            if any(run in t.result["events"] for run in answers)
            else ""
        )
        parts.append(f'<p class="lead">{large}{worst}</p>')
    else:
        parts.append('<p class="lead">The study ended before any run could be evaluated.</p>')
    if t.result["overload_factors"]:
        cards.append(_factor_card(t))
    parts.append(f'<div class="cards">{"".join(cards)}</div>')
    warnings = range(len(t.result["warnings"]))
    if warnings:
        parts.append(
            '<ul class="verdicts">'
            + "".join(
                f'<li><span class="sign" aria-hidden="true">!</span> {t.text(f"warnings.{i}.text")}</li>'
                for i in warnings
            )
            + "</ul>"
        )
    elif answers:
        parts.append('<p class="fine">No run gives cause for a warning.</p>')
    return "\n".join(parts)


_HOLDS = {"true": "✓", "in part": "◐", "false": "✗"}


def _verdict(t: Traced) -> str:
    """First of all: whether the model holds, and whether the motor does what is asked of it."""
    found = t.result["verdict"]
    lines = [(name, found[name]["holds"]) for name in ("model", "motor") if found[name] is not None]
    return "".join(
        f'<p class="judged {holds.replace(" ", "-")}"><span class="sign" aria-hidden="true">{_HOLDS[holds]}</span> '
        f"{t.text(f'verdict.{name}.text')}</p>"
        for name, holds in lines
    )


def _speed(t: Traced, run: str) -> str:
    """The crank speed that a run has: the one asked for, or the one reached and marked where it is another."""
    asked = t.number("run.crank_speed", given=True)
    if run != "steady" or t.result["verdict"]["motor"]["holds"] != "false":
        return asked
    return (
        f'<strong class="missed"><span aria-hidden="true">▲</span> {t.number(f"answers.{run}.speed_mean")}</strong>, '
        f"not the {asked} asked for"
    )


def _runs(t: Traced) -> str:
    """Every answer of every run, what the pins carry, and where the model ends."""
    answers, parts = t.result["answers"], []
    if answers:
        rows = []
        for v in Layout(Answers).variables:
            found = [run for run in answers if v.name in answers[run]]
            # nothing to say of a coupling that is not there, or that did not open
            if all(answers[run][v.name]["value"] is None for run in found):
                continue
            cells = [_answer_number(t, run, v) if run in found else "" for run in answers]
            rows.append((escape(_capital(v.description)), *cells))
        heads = [escape(_capital(_called(t, run))) for run in answers]
        parts.append(_table(("", *heads), rows, caption="What each run asks of the drive"))
    if t.result.get("start_up"):
        rows = [
            (escape(_capital(v.description)), t.number(f"start_up.{v.name}"))
            for v in measures_of(Phase.START_UP)
            if t.result["start_up"][v.name]["value"] is not None
        ]
        parts.append(_table((), rows, caption="What the start-up asks of the drive"))
    if t.result["pins"]:
        parts.append(_pins(t))
    if t.result.get("shaft"):
        parts.append(_shaft(t))
    if t.result.get("speed_loop"):
        loops = t.result["speed_loop"]
        names = list(dict.fromkeys(name for loop in loops.values() for name in loop))
        rows = [
            (escape(_capital(_words(loop))), *(t.number(f"speed_loop.{loop}.{name}") for name in names))
            for loop in loops
        ]
        heads = ["", *(escape(_capital(_words(name))) for name in names)]
        parts.append(_table(heads, rows, caption="The speed loop, linearised"))
    if t.result.get("monte_carlo"):
        parts.append(_random(t))
    if t.result["limits"]:
        rows = [
            (
                escape(_capital(v.description)),
                t.number(f"limits.{v.name}", none="none"),
            )
            for v in Layout(Limits).variables
            if v.name in t.result["limits"]
        ]
        parts.append(_table((), rows, caption="Where the model ends"))
    return "\n".join(parts)


def _chains(t: Traced) -> str:
    """Chains beside two bars at the study's speed, and over the speeds of the sweep."""
    chain = t.result["chain"]
    quantile = f"{t.number('chain.quantile', given=True)} quantile"
    parts = [
        f'<p class="lead">The organs are chains of {t.number("chain.rods_of_wall", given=True)} rods in the wall and '
        f"{t.number('chain.rods_of_web', given=True)} in the web, the crank is held at constant speed, "
        f"{t.number('chain.starts', given=True)} starts at other crank angles are followed over "
        f"{t.number('chain.turns', given=True)} turns each. Where rods go slack the motion may be chaotic: no single "
        "peak is a prediction. Median and quantile are of the peaks of single turns, all turns of all starts.</p>"
    ]

    def end(i: int, band: Mapping[str, Any]) -> str:
        if band["to"] == band["from"]:
            return ""
        last = band["to"] == chain["sweep"][-1]["speed"]
        return f" to {t.number(f'chain.avoid.{i}.to')}{', where the sweep ends' if last else ''}"

    if chain["avoid"]:
        parts.append(
            '<ul class="verdicts">'
            + "".join(
                '<li><span class="sign" aria-hidden="true">!</span> <span class="inline">Avoid '
                f"{t.number(f'chain.avoid.{i}.from')}{end(i, band)}: "
                f"{t.text(f'chain.avoid.{i}.why')}.</span></li>"
                for i, band in enumerate(chain["avoid"])
            )
            + "</ul>"
        )
    elif len(chain["sweep"]) > 1:
        ends = (t.number(f"chain.sweep.{i}.speed") for i in (0, len(chain["sweep"]) - 1))
        parts.append(f'<p class="fine">No speed to avoid from {" to ".join(ends)}.</p>')

    def own(name: str) -> str:
        if not name:
            return ""
        shown, ends = t.number(f"chain.own_speed.{name}"), f"{name}_from"
        return (
            shown if ends not in chain["own_speed"] else _told(t, f"chain.own_speed.{name}", "_from", "_to")
        )

    rows = [
        (title, *(own(name) for name in names))
        for title, names in (
            (
                "Crank torque, peak",
                ("crank_torque_median", "crank_torque_high", "two_bar_crank_torque"),
            ),
            ("Crank torque, RMS", ("crank_torque_rms", "", "two_bar_crank_torque_rms")),
            (
                "Rocker torque, peak",
                ("rocker_torque_median", "rocker_torque_high", "two_bar_rocker_torque"),
            ),
            ("Snatch: force at A2 over its own at rest", ("snatch_median", "snatch_high", "two_bar_snatch")),
            ("Turns that count as independent, at the quantile", ("independent_turns", "", "")),
            ("Snatch, largest over least median of a start", ("snatch_spread", "", "")),
            (
                "Time with a slack rod; two bars: with one that pushes",
                ("slack_time", "", "two_bar_slack_time"),
            ),
            ("Rods that are slack, mean over time", ("slack_rods", "", "")),
            ("Largest angle between neighbouring rods", ("fold_largest", "", "")),
            ("Energy residual of an organ over the energy moved", ("energy_residual", "", "")),
        )
    ]
    if chain["resonance"]["value"] is not None:
        rows.append(("Resonance of an organ, crank speed", t.number("chain.resonance"), "", ""))
        distance = t.number("chain.distance_to_resonance")
        rows.append(("Distance to it, relative; negative below", distance, "", ""))
    parts.append(
        _table(
            ("", "Chains, median", f"Chains, {quantile}", "Two bars"),
            rows,
            caption=f"At {t.number('chain.own_speed.speed', given=True)} of the crank; small: interval of "
            f"{t.number('chain.confidence', given=True)} confidence",
        )
    )
    slack = [
        (
            escape(_capital(side)),
            ", ".join(
                f"{t.text(f'chain.slack_by_rod.{side}.{k}.rod')}: "
                f"{t.number(f'chain.slack_by_rod.{side}.{k}')}"
                for k, rod in enumerate(rods)
                if rod["value"] > 0.0
            )
            or "none",
        )
        for side, rods in chain["slack_by_rod"].items()
    ]
    if any(rod["value"] > 0.0 for rods in chain["slack_by_rod"].values() for rod in rods):
        parts.append(_table((), slack, caption="Rods that go slack, share of the time", numeric=False))
    if len(chain["sweep"]) > 1:
        columns = {
            "crank_torque_median": "Crank torque: median",
            "crank_torque_high": f"Crank torque: {quantile}",
            "two_bar_crank_torque": "Crank torque: two bars",
            "rocker_torque_median": "Rocker torque: median",
            "rocker_torque_high": f"Rocker torque: {quantile}",
            "two_bar_rocker_torque": "Rocker torque: two bars",
            "snatch_median": "Snatch: median",
            "snatch_high": f"Snatch: {quantile}",
            "slack_time": "Time with a slack rod",
        }
        sweep = [
            (
                t.number(f"chain.sweep.{i}.speed"),
                *(
                    "–"
                    if speed.get(f"{name}_from", {"value": 0.0})["value"] is None
                    else t.number(f"chain.sweep.{i}.{name}")
                    for name in columns
                ),
            )
            for i, speed in enumerate(chain["sweep"])
        ]
        caption = "Over the crank speed; –: the starts differ by so much that they do not tell the quantile"
        parts.append(_table(("Crank speed", *columns.values()), sweep, caption=caption))
    if chain["critical_speeds"]:
        found: dict[float, dict[float, int]] = {}
        for i, each in enumerate(chain["critical_speeds"]):
            found.setdefault(each["mode"]["value"], {})[each["order"]["value"]] = i
        orders = next(iter(found.values()))
        critical = [
            (
                f"Mode {t.number(f'chain.critical_speeds.{next(iter(at_order.values()))}.mode', given=True)}",
                *(t.number(f"chain.critical_speeds.{i}.speed") for i in at_order.values()),
            )
            for at_order in found.values()
        ]
        heads = (f"Order {t.number(f'chain.critical_speeds.{i}.order', given=True)}" for i in orders.values())
        parts.append(
            _table(
                ("", *heads),
                critical,
                caption="Critical crank speeds, at which a multiple of the speed is a natural frequency of an organ",
            )
        )
    return "\n".join(parts)


def _told(t: Traced, path: str, low: str, high: str) -> str:
    """An estimate with its interval; without one the number of runs, or starts that differ, cannot tell it."""
    if t.value(path + low) is None:
        return '<span class="none">starts differ</span>'
    ends = " to ".join(t.number(path + end) for end in (low, high))
    return f'{t.number(path)} <span class="of">{ends}</span>'


def _random(t: Traced) -> str:
    """The quantiles of overloads at random."""
    found = t.result["monte_carlo"]["quantiles"]
    named = {v.name: v.description for v in Layout(Sample).variables}
    columns = list(dict.fromkeys(k for sizes in found.values() for k in sizes))
    rows = [
        (
            escape(_capital(named.get(name, _words(name)).removeprefix("1 where "))),
            *(
                _told(t, f"monte_carlo.quantiles.{name}.{k}", ".low", ".high") if k in sizes else ""
                for k in columns
            ),
        )
        for name, sizes in found.items()
        if sizes
    ]
    heads = ("", *(f"{k[1:]} % of runs below" if k.startswith("q") else "Share of runs" for k in columns))
    runs, certain = (t.number(f"monte_carlo.{name}", given=True) for name in ("runs", "confidence"))
    sides = t.result["monte_carlo"]["sides"]
    of = ", ".join(f"{t.number(f'monte_carlo.sides.{side}', given=True)} {side}" for side in sides)
    caption = f"Overloads on a random side, at random angles and of random hardness, {runs} runs ({of})"
    return _table(heads, rows, caption=f"{caption}; small: interval of {certain} confidence")


def _pins(t: Traced) -> str:
    tables = t.result["pins"]
    reference = "steady" if "steady" in tables else next(iter(tables))
    pins = tables[reference]
    sizes = list(next(iter(pins.values())))
    rows = []
    for pin in pins:
        worst = max(tables, key=lambda run: tables[run][pin]["peak"]["value"])
        rows.append(
            (
                escape(pin),
                *(t.number(f"pins.{reference}.{pin}.{size}") for size in sizes),
                t.number(f"pins.{worst}.{pin}.peak"),
                escape(_in_sentences(t, worst)),
            )
        )
    named = (
        f"{_capital(_called(t, reference))}, {'RMS' if size == 'rms' else _words(size)}" for size in sizes
    )
    heads = ("", *map(escape, named), "Largest peak", "In")
    return _table(heads, rows, caption="What the pins carry")


def _shaft(t: Traced) -> str:
    """What each run asks of the driveline, and its natural frequencies."""
    runs = t.result["shaft"]
    rows = [
        (
            escape(_capital(v.description)),
            *(t.number(f"shaft.{run}.{v.name}") for run in runs),
        )
        for v in Layout(ShaftAnswers).variables
    ]
    heads = ("", *(escape(_capital(_called(t, run))) for run in runs))
    frequencies = [
        (escape(_capital(v.description)), t.number(f"driveline.{v.name}")) for v in Layout(Torsion).variables
    ]
    return _table(heads, rows, caption="What the driveline carries") + _table(
        (), frequencies, caption="The driveline's torsion"
    )


def _card(t: Traced, family: str, members: list[tuple[str, Variable]], run: str) -> str:
    """An answer, large: its first two numbers in the run `run`, and the worst overload."""
    large, small = members[:2], members[2:]
    figures = "".join(
        f'<div class="figure"><span class="large">{_answer_number(t, run, v)}</span>'
        f'<span class="which">{escape(kind or _called(t, run))}</span></div>'
        for kind, v in large
    )
    lines = []
    if small:
        also = ", ".join(f"{escape(kind)} {_answer_number(t, run, v)}" for kind, v in small)
        lines.append(also)
    kind, v = large[0]
    sizes = {
        name: t.value(f"answers.{name}.{v.name}")
        for name in t.result["answers"]
        if name in t.result["events"]
    }
    found = {name: size for name, size in sizes.items() if size is not None}
    if found:
        worst = max(found, key=lambda name: abs(found[name]))
        lines.append(
            f"overload: {escape(kind)} <strong>{_answer_number(t, worst, v)}</strong>, {escape(_called(t, worst))}"
        )
    return (
        f'<article class="card"><h3>{escape(_capital(family))}</h3><div class="figures">{figures}</div>'
        + "".join(f'<p class="also">{line}</p>' for line in lines)
        + "</article>"
    )


def _answer_number(t: Traced, run: str, v: Variable) -> str:
    none = "not reached" if v.name == "recovery_time" and run != "steady" else "–"
    return t.number(f"answers.{run}.{v.name}", none=none)


def _factor_card(t: Traced) -> str:
    described = {v.name: v.description for v in Layout(OverloadFactors).variables}
    sides = t.result["overload_factors"]
    rows = ""
    for name in next(iter(sides.values())):
        of = "".join(
            f'<span class="figure"><span class="large">{t.number(f"overload_factors.{side}.{name}", none="none")}'
            f'</span><span class="which">{side}</span></span>'
            for side in sides
        )
        use = t.text(f"overload_factors.{next(iter(sides))}.{name}.for")
        rows += f'<div class="factor">{of}<span class="which">{escape(described[name])}<br>{use}</span></div>'
    speed = t.number("run.crank_speed", given=True)
    return (
        '<article class="card"><h3>Overload factor</h3>'
        f'{rows}<p class="also">one side against both, at {speed}</p></article>'
    )


def _sizing(t: Traced) -> str:
    sizing = t.result["sizing"]
    chosen, nearest, candidates = (sizing.get(name) for name in ("chosen", "nearest", "candidates"))
    parts = []
    if chosen is None and candidates:
        reasons = "".join(
            f"<li><strong>{t.text(f'sizing.candidates.{i}.motor')}</strong>: "
            f"{t.text(f'sizing.candidates.{i}.reason')}</li>"
            for i in _ranked(candidates, nearest)[:_NAMED]
        )
        parts.append(
            f'<div class="alarm"><strong>No candidate fits, because</strong><ul>{reasons}</ul></div>'
        )
    best_one = nearest if chosen is None else chosen
    if best_one is not None:
        best = f"sizing.candidates.{best_one}"
        cards = [
            _large("Motor", t.text(f"{best}.motor"), candidates[best_one]["verdict"], css=" name"),
            _large(
                "Gear ratio", t.number(f"{best}.ratio", digits=4, given=True), "motor turns per crank turn"
            ),
        ]
        for section in ("flywheel", "protection"):
            path = _leading(sizing.get(section), f"sizing.{section}")
            if path:
                name = path.rsplit(".", 1)[1]
                entry = sizing[section][name]
                cards.append(
                    _large(
                        _capital(section),
                        t.number(path, none="none"),
                        entry.get("title", _words(name)),
                    )
                )
        parts.append(f'<div class="cards four">{"".join(cards)}</div>')
        why = "Chosen because" if chosen is not None else "Insufficient, and shown because"
        caveat = f" ({t.text('verdict.model.caveat')})" if _caveat(t) else ""
        parts.append(f'<p class="reason">{why}: {t.text(f"{best}.reason")}{caveat}</p>')
    if "coupling" in sizing.get("protection", {}):
        parts.append(f'<p class="reason">{t.text("sizing.protection.coupling")}</p>')
    parts.extend(
        f'<p class="note">{t.text(f"sizing.notes.{i}")}</p>' for i in range(len(sizing.get("notes", [])))
    )
    if candidates:
        if "tried" in sizing:
            counts = t.number("sizing.tried", given=True), t.number("sizing.motors", given=True)
            weak = f"; too weak by the nameplate: {t.number('sizing.weak', given=True)}"
            parts.append(
                f'<p class="note">Tried: {" of ".join(counts)} motors of the catalogue'
                f"{weak if t.result['sizing']['weak']['value'] else ''}.</p>"
            )
        parts.append(_candidates(t, candidates, best_one))
    # the sentence on the coupling stands above, and is no cell of a narrow table
    groups = [
        (
            _capital(_words(name)),
            [
                found
                for key, below in sizing[name].items()
                if not isinstance(below, str)
                for found in _leaves(below, f"sizing.{name}.{key}", _words(key))
            ],
        )
        for name in ("asked", "cycle", "flywheel", "protection")
        if sizing.get(name)
    ]
    tables = "".join(
        _table((), [(escape(_capital(title)), _leaf(t, path)) for title, path in rows], caption=caption)
        for caption, rows in groups
        if rows
    )
    return "\n".join(parts) + f'\n<div class="given whole">{tables}</div>'


def _caveat(t: Traced) -> bool:
    """Whether the model that a recommendation rests on does not hold."""
    model = t.result["verdict"]["model"]
    return model is not None and model["caveat"] is not None


def _large(title: str, shown: str, which: str, css: str = "") -> str:
    return (
        f'<article class="card"><h3>{escape(title)}</h3><div class="figures"><div class="figure">'
        f'<span class="large{css}">{shown}</span><span class="which">{escape(which)}</span></div></div></article>'
    )


def _leading(section: Any, path: str) -> str | None:
    """The number that stands for a section: the torque at which it trips, else its first."""
    numbers = [
        name for name, entry in (section or {}).items() if isinstance(entry, dict) and "value" in entry
    ]
    trips = [name for name in numbers if "trip" in name and section[name]["unit"] == "N.m"]
    names = [*trips, *numbers]
    return f"{path}.{names[0]}" if names else None


def _leaves(node: Any, path: str, title: str = "") -> Iterator[tuple[str, str]]:
    """Title and path of everything below a node that is a number with its unit, or words."""
    if isinstance(node, Mapping) and "value" in node:
        yield node.get("title", title), path
    elif isinstance(node, Mapping | list):
        items = node.items() if isinstance(node, Mapping) else ((str(i), x) for i, x in enumerate(node))
        for name, below in items:
            yield from _leaves(below, f"{path}.{name}", f"{title}, {_words(name)}" if title else _words(name))
    elif isinstance(node, str):
        yield title, path


def _leaf(t: Traced, path: str) -> str:
    try:
        entry = t.value(path)
    except TypeError:
        return t.text(path)
    if isinstance(entry, str):
        return t.text(f"{path}.value")
    return t.number(path, given=path.startswith("sizing.asked"), none="none")


_NAMED = 5  # of the candidates that do not fit; the table has all
_RANK = {v.value: i for i, v in enumerate(Verdict)}
_SIGN = {Verdict.CHOSEN: "✓", Verdict.FITS: "○", Verdict.INSUFFICIENT: "✗", Verdict.REJECTED: "✗"}


def _ranked(candidates: list[Any], chosen: int | None) -> list[int]:
    """The chosen candidate, what fits, then the rest by how much it fails."""

    def utilisation(candidate: Any) -> float:
        sizes = [check["utilisation"]["value"] for check in candidate["checks"].values()]
        return max((math.inf if size is None else size for size in sizes), default=0.0)

    return sorted(
        range(len(candidates)),
        key=lambda i: (i != chosen, _RANK.get(candidates[i]["verdict"], 9), utilisation(candidates[i])),
    )


def _candidates(t: Traced, candidates: list[Any], chosen: int | None) -> str:
    """The table of candidates, best first."""
    order = _ranked(candidates, chosen)
    checks: dict[str, str] = {}
    for candidate in candidates:
        for name, check in candidate["checks"].items():
            checks.setdefault(name, check.get("title", _words(name)))
    rows = []
    for i in order:
        candidate, path = candidates[i], f"sizing.candidates.{i}"
        verdict = candidate["verdict"]
        cells = "".join(
            _check(t, candidate["checks"][name], f"{path}.checks.{name}")
            if name in candidate["checks"]
            else "<td></td>"
            for name in checks
        )
        rows.append(
            f'<tbody class="{escape(verdict)}"><tr><th scope="rowgroup" rowspan="2">{t.text(f"{path}.motor")}'
            f'<span class="of">ratio {t.number(f"{path}.ratio", digits=4, given=True)}</span></th>{cells}</tr>'
            f'<tr><td class="why" colspan="{len(checks)}"><strong><span aria-hidden="true">'
            f"{_SIGN.get(verdict, '')}</span> {t.text(f'{path}.verdict')}</strong>: {t.text(f'{path}.reason')}</td>"
            "</tr></tbody>"
        )
    heads = ("Motor", *(escape(_capital(title)) for title in checks.values()))
    return (
        '<div class="wide"><table class="candidates"><caption>Candidates, best first. A cell shows how much of '
        "its limit a check takes; the line in the bar is the limit, and what is above it is "
        "<strong>▲ bold</strong>.</caption><thead><tr>"
        + "".join(f'<th scope="col">{head}</th>' for head in heads)
        + f"</tr></thead>{''.join(rows)}</table></div>"
    )


def _check(t: Traced, check: Any, path: str) -> str:
    size = check["utilisation"]["value"]
    shown = t.number(f"{path}.utilisation", none="no value", prefix="▲ " if size and size > 1.0 else "")
    over = size is not None and size > 1.0
    width = 0.0 if size is None else 100.0 * min(max(size, 0.0), 1.5) / 1.5
    bar = f'<span class="bar" aria-hidden="true"><span style="width:{width:.1f}%"></span></span>'
    of = ""
    if "value" in check and "limit" in check:
        of = f'<span class="of">{t.number(f"{path}.value")} of {t.number(f"{path}.limit")}</span>'
    label = f"<strong>{shown}</strong>" if over else shown
    return f'<td class="check{" over" if over else ""}">{label}{bar}{of}</td>'


def _crossings(t: Traced) -> str:
    """Where one side alone asks as much as both, in words; empty where nothing crosses."""
    sides = t.result["sides_over_speed"]
    text = ""
    for torque, of in (sides["crossings"] if sides else {}).items():
        found = [
            f"{side} alone at "
            + " and ".join(
                t.number(f"sides_over_speed.crossings.{torque}.{side}.{k}") for k in range(len(speeds))
            )
            for side, speeds in of.items()
            if speeds
        ]
        text += f"; {torque} torque: {', '.join(found)}" if found else ""
    return text


def _figures(t: Traced, drawn: list[Plot]) -> str:
    captions = {
        "torque-speed": "Steady running is a closed loop; overloads are drawn from the event on. Grey: "
        "the most that the drive gives in steady running.",
        "turn": f"Inverse dynamics at {t.number('run.crank_speed', given=True)} of the crank, without a motor.",
        "sides": "Largest torques of a turn by inverse dynamics. Where the lines cross, one side alone asks as much "
        f"as both{_crossings(t)}.",
        "chains": "The crank held at constant speed. Shaded: speeds to avoid; dash-dotted: the speed of normal "
        "running; thin: critical speeds. Two bars do not go slack: of them, the time in which one pushes.",
        "reactions": "Peak and RMS of the force in each pin, frame x right, y up; means over whole crank turns.",
    }
    html = []
    for plot in drawn:
        caption = captions.get(plot.name, "")
        if plot.marked:
            caption = "Upright, dashed: the event. Shaded: what the machine is given changes."
            if plot.run in t.result["answers"]:
                caption += _speed_after(t, plot.run)
            if plot.run in t.result["block_peaks"]:
                peaks, stiffness = (
                    " to ".join(t.number(f"block_peaks.{plot.run}.{name}_{end}") for end in ("low", "high"))
                    for name in ("crank_torque", "stiffness")
                )
                caption += (
                    f" The stop is assumed: the crank torque peaks at {peaks} for a stiffness of {stiffness}."
                )
        height = plot.figure.layout.height
        half = " half" if plot.run else ""
        html.append(
            f'<figure class="plot-box{half}"><h3 id="{plot.name}-title">{escape(plot.title)}</h3>'
            f'<div class="plot" id="plot-{plot.name}" data-figure="{plot.name}" role="img" '
            f'aria-label="{escape(plot.seen)}" style="height:{height}px"></div>'
            f"<figcaption>{caption}</figcaption></figure>"
        )
    if not html:
        return ""
    return (
        "<noscript><p>Plots and the moving machine need JavaScript; the numbers of this page do not.</p></noscript>"
        f'<div class="plots">{"".join(html)}</div>'
        '<p class="hint">Drag to zoom, double-click to zoom out, click a name in a legend to hide its line. Every '
        "sample is in result.nc.</p>"
    )


def _speed_after(t: Traced, run: str) -> str:
    """What the speed does after the event, in sentences."""
    least, dip, back = (f"answers.{run}.{name}" for name in ("speed_least", "speed_dip", "recovery_time"))
    share = t.value(dip)
    if share is None or share <= 0.0:
        text = f" The least speed is {t.number(least)}"
    elif not shown(share, "1", "dip")[1]:
        # words stand in the number's place
        text = f" The crank {t.number(dip)}"
    else:
        text = f" The speed dips by {t.number(dip)}"
    recovered = t.value(back)
    if recovered is None:
        return f"{text}; it does not return to its steady band within the time followed."
    if recovered == 0.0:
        return f"{text}; it does not leave its steady band."
    return f"{text}; it is back in its steady band after {t.number(back)}."


def _motion() -> str:
    return """<figure class="motion" id="machine" aria-labelledby="motion-title">
<div class="stage">
<svg id="stage" role="img" aria-label="The machine with the forces on its pins, in motion" data-frame="0"></svg>
</div>
<div class="readings">
<table class="numbers"><tbody>
<tr><th scope="row" id="time-name">Time</th><td id="read-time"></td></tr>
<tr><th scope="row">Crank angle</th><td id="read-angle"></td></tr>
<tr><th scope="row">Crank speed</th><td id="read-speed"></td></tr>
<tr><th scope="row">Crank torque</th><td id="read-torque"></td></tr>
<tr><th scope="row">Material left</th><td id="read-left"></td></tr>
<tr><th scope="row">Material right</th><td id="read-right"></td></tr>
</tbody></table>
<table class="numbers forces"><caption>Forces</caption><tbody id="read-forces"></tbody></table>
</div>
<div class="controls" role="group" aria-label="Playback">
<button type="button" id="play" aria-label="Play">▶ Play</button>
<label>Run <select id="run"></select></label>
<label>Speed <select id="factor"></select></label>
<label>Arrows <select id="arrows"><option value="0.5">× ½</option><option value="1" selected>× 1</option>
<option value="2">× 2</option><option value="4">× 4</option></select></label>
<div class="slide"><label for="slider" class="hidden">Time</label>
<input type="range" id="slider" min="0" max="1" step="1" value="0"><span id="tick" aria-hidden="true"></span></div>
</div>
<figcaption>Blue, full: left side; red, dashed: right side; black: crank bearing O1 and rocker pivot C. An arrow
is the force on the machine part from its support or neighbour: at A1 on the wall, at B on the wall from the web, at
A2 on the web from the rocker; P, dotted, is the processing force on the web. The brown band is the material; its
width goes with its mass. Joints are those of the simulated run.</figcaption>
</figure>"""


def _basis(t: Traced, study: Study) -> str:
    parts = []
    if t.result["notes"]:
        items = "".join(f"<li>{t.text(f'notes.{i}.text')}</li>" for i in range(len(t.result["notes"])))
        parts.append(f"<h3>Assumptions</h3><ul>{items}</ul>")
    certificate = t.result["certificate"]
    if certificate:
        names = list(dict.fromkeys(name for shares in certificate.values() for name in shares))
        rows = [
            (
                escape(_capital(_called(t, run))),
                *(t.number(f"certificate.{run}.{name}") if name in shares else "" for name in names),
            )
            for run, shares in certificate.items()
        ]
        parts.append(
            "<h3>Energy certificate</h3><p>What the motor gave to the shaft, computed in the motor, against what "
            "the machine stored and dissipated, computed in the machine: the share of the energy moved that is "
            "missing.</p>" + _table(("Run", *(escape(_capital(_words(name))) for name in names)), rows)
        )
    made = t.result["fmus"]
    control = t.result["control"]
    if isinstance(control, Mapping):
        tuned = ", ".join(f"{escape(_words(name))} {t.number(f'control.{name}')}" for name in control)
    else:
        tuned = t.text("control")
    python = platform.python_version()
    versions = [("chainunit", t.text("chainunit")), ("Python", escape(python))]
    versions += [(name, escape(_version(name))) for name in _VERSIONS]
    rows_made = [
        *((escape(_capital(name)) + " FMU", t.text(f"fmus.{name}")) for name in made),
        ("Speed control", tuned),
        ("Versions", ", ".join(f"{name}&nbsp;{version}" for name, version in versions)),
    ]
    parts.append("<h3>How it was made</h3>" + _table((), rows_made, numeric=False))
    parts.append(
        '<p class="hint">Every number in the text of this page is taken from result.json, which is embedded here '
        "whole; point at a number to see where it stands there, and with more digits.</p>"
    )
    return f'<div class="basis">{"".join(parts)}</div>'


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "not installed"
