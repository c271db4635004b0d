"""Parts of the report on a chain unit that only some studies have: what a drive was sized for, and its organs as
chains."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from ..study.sizing import Standing
from ..study.study import Study
from . import blocks as b
from .lines import Aside, Line, Strong, capital, joined, line

_NAMED = 5  # of the candidates that do not fit; the table has all
_RANK = {standing.value: i for i, standing in enumerate(Standing)}
_SIGN = {Standing.CHOSEN: "✓", Standing.FITS: "○", Standing.INSUFFICIENT: "✗", Standing.REJECTED: "✗"}
_SEVERITY: dict[str, b.Severity] = {Standing.CHOSEN: "good", Standing.FITS: "partly"}


def spoken(name: str) -> str:
    """The name of a number in words."""
    return "RMS" if name == "rms" else name.replace("_", " ")


# -- the drive


def sizing(s: b.Source, study: Study) -> Iterator[b.Block]:
    """What a drive was sized for, its candidates with how much of each limit they take, and which was chosen."""
    section = s.result["sizing"]
    choice, nearest, candidates = (section.get(name) for name in ("chosen", "nearest", "candidates"))
    best = nearest if choice is None else choice
    ranked = _ranked(candidates, best) if candidates else []
    if choice is None and candidates:
        reasons = (
            line(
                Strong(s.words(f"sizing.candidates.{i}.motor")),
                ": ",
                s.words(f"sizing.candidates.{i}.reason"),
            )
            for i in ranked[:_NAMED]
        )
        words = Strong("No candidate fits, because")
        yield b.Judgement("alarm", words, items=tuple(reasons), form="long")
    if best is not None:
        yield from _best(
            s, f"sizing.candidates.{best}", "Motor" if choice is not None else "Insufficient motor"
        )
    if "coupling" in section.get("protection", {}):
        yield b.Text(s.words("sizing.protection.coupling"))
    yield from (b.Text(each, form="long") for each in s.lines("sizing.notes"))
    if candidates:
        if "tried" in section:
            weak = "; too weak by the nameplate: {=sizing.weak}" if s.value("sizing.weak") else ""
            tried = "Tried: {=sizing.tried} of {=sizing.motors} motors of the catalogue"
            yield b.Text(s.line(f"{tried}{weak}."))
        listed = int(study.config.sizing.candidates) if study.config.sizing else len(candidates)
        yield _candidates(s, ranked, listed)
        if len(candidates) > listed:
            yield b.Text(f"{len(candidates) - listed} more were tried; report.html lists them.", form="short")
    tables = []
    for name in ("asked", "cycle", "flywheel", "protection"):
        # the sentence on the coupling stands above, and is no cell of a narrow table
        leaves = [
            leaf
            for key, below in (section.get(name) or {}).items()
            if not isinstance(below, str)
            for leaf in _leaves(below, f"sizing.{name}.{key}", spoken(key))
        ]
        rows = tuple(b.TableRow((title, _leaf(s, path))) for title, path in leaves)
        if rows:
            tables.append(b.Table(rows, title=capital(spoken(name))))
    yield b.Tables(tuple(tables))


def _best(s: b.Source, path: str, word: str) -> Iterator[b.Block]:
    """The motor that all runs are with, large and in a sentence."""
    motor, ratio = s.words(f"{path}.motor"), s.number(f"{path}.ratio", digits=4, given=True)
    cards = [
        b.Card("Motor", ((motor, str(b.at(s.result, f"{path}.verdict"))),)),
        b.Card("Gear ratio", ((ratio, "motor turns per crank turn"),)),
    ]
    sentence = line(f"{word}: ", motor, ", ratio ", ratio)
    for section in ("flywheel", "protection"):
        leading = _leading(s.result["sizing"].get(section))
        if leading:
            title = s.result["sizing"][section][leading].get("title", spoken(leading))
            size = s.number(f"sizing.{section}.{leading}", none="none")
            cards.append(b.Card(section, ((size, title),)))
            sentence += line(f"; {title} ", size)
    if "relay_current" in s.result["sizing"].get("protection", {}):
        sentence += s.line("; relay at {sizing.protection.relay_current}")
    yield b.Cards(tuple(cards))
    model = s.result["verdict"]["model"]
    doubt = s.line(" ({verdict.model.caveat})") if model is not None and model["caveat"] else ()
    why = "Chosen: " if word == "Motor" else "Insufficient: "
    yield b.Text(line(sentence, doubt, "."), form="short")
    yield b.Text(line(why, s.words(f"{path}.reason"), doubt, "."))


def _leading(section: Mapping[str, Any] | None) -> str | None:
    """The number that stands for a section: the torque at which it trips, else its first."""
    names = [name for name, entry in (section or {}).items() if isinstance(entry, dict) and "value" in entry]
    return "trip_torque" if "trip_torque" in names else next(iter(names), None)


def _leaves(node: Any, path: str, title: str = "") -> Iterator[tuple[str, str]]:
    """Title and path of everything below a node that is a number with its unit, or words."""
    if isinstance(node, Mapping) and "value" in node:
        yield node.get("title", title), path
    elif isinstance(node, Mapping | list):
        items = node.items() if isinstance(node, Mapping) else ((str(i), x) for i, x in enumerate(node))
        for name, below in items:
            yield from _leaves(below, f"{path}.{name}", f"{title}, {spoken(name)}" if title else spoken(name))
    elif isinstance(node, str):
        yield title, path


def _leaf(s: b.Source, path: str) -> Line:
    node = b.at(s.result, path)
    if isinstance(node, str):
        return s.words(path)
    if isinstance(node["value"], str):
        return s.words(f"{path}.value")
    return s.number(path, given=path.startswith("sizing.asked."), none="none")


def _ranked(candidates: list[Any], choice: int | None) -> list[int]:
    """The chosen candidate, the ones that fit, then the rest by how much it fails."""

    def utilisation(candidate: Any) -> float:
        sizes = [check["utilisation"]["value"] for check in candidate["checks"].values()]
        return max((math.inf if size is None else size for size in sizes), default=0.0)

    return sorted(
        range(len(candidates)),
        key=lambda i: (i != choice, _RANK.get(candidates[i]["verdict"], 9), utilisation(candidates[i])),
    )


def _candidates(s: b.Source, ranked: list[int], listed: int) -> b.Table:
    """The table of candidates, best first."""
    candidates = s.result["sizing"]["candidates"]
    checks: dict[str, str] = {}
    for candidate in candidates:
        for name, check in candidate["checks"].items():
            checks.setdefault(name, check.get("title", spoken(name)))
    rows = []
    for place, i in enumerate(ranked):
        candidate, path = candidates[i], f"sizing.candidates.{i}"
        verdict = candidate["verdict"]
        motor = line(s.words(f"{path}.motor"), Aside(s.line(f"ratio {{={path}.ratio:4}}")))
        cells = (_check(s, f"{path}.checks.{name}") if name in candidate["checks"] else "" for name in checks)
        rows.append(
            b.TableRow(
                (motor, s.words(f"{path}.verdict"), *cells),
                line(f"{_SIGN.get(verdict, '')} ", s.words(f"{path}.reason")),
                _SEVERITY.get(verdict, "bad"),
                "both" if place < listed else "long",
            )
        )
    title = "Candidates, best first. Cell: the share of its limit that a check takes; a line in the bar is the limit."
    columns = (*b.heads("motor", "verdict"), *(b.Column(title, form="long") for title in checks.values()))
    return b.Table(tuple(rows), columns, title=title, note_title="because", numeric=False)


def _check(s: b.Source, path: str) -> b.Share:
    check = b.at(s.result, path)
    size = check["utilisation"]["value"]
    of = s.line(f"{{{path}.value}} of {{{path}.limit}}") if "value" in check and "limit" in check else ()
    over = size is not None and size > 1.0
    return b.Share(s.number(f"{path}.utilisation", none="no value", over=over), of)


# -- organs as chains


def chains(s: b.Source, study: Study) -> Iterator[b.Block]:
    """Chains beside two bars at the study's speed, and over the speeds of the sweep."""
    chain = s.result["chain"]
    lead = (
        "The organs are chains of {=chain.rods_of_wall} rods in the wall and {=chain.rods_of_web} in the web, the "
        "crank is held at constant speed, {=chain.starts} starts at other crank angles are followed over "
        "{=chain.turns} turns each. Where rods go slack the motion may be chaotic: no single peak is a prediction. "
        "Median and quantile are of the peaks of single turns, all turns of all starts."
    )
    yield b.Text(s.line(lead), "lead", "long")
    yield from _avoid(s, chain)
    yield _own_speed(s, chain)
    slack = {
        side: joined(
            s.line(f"{{chain.slack_by_rod.{side}.{k}.rod}}: {{chain.slack_by_rod.{side}.{k}}}")
            for k, rod in enumerate(rods)
            if rod["value"] > 0.0
        )
        for side, rods in chain["slack_by_rod"].items()
    }
    if any(slack.values()):
        rows = tuple(b.TableRow((side, words or "none")) for side, words in slack.items())
        yield b.Table(rows, title="Rods that go slack, share of the time", numeric=False)
    if len(chain["sweep"]) > 1:
        yield _sweep(s, chain)
    if chain["critical_speeds"]:
        yield from _critical(s, chain, study)


def _avoid(s: b.Source, chain: Mapping[str, Any]) -> Iterator[b.Block]:
    """The speeds that the crank should not have."""
    sweep = chain["sweep"]
    for i, band in enumerate(chain["avoid"]):
        path = f"chain.avoid.{i}"
        end = f" to {{{path}.to}}" if band["to"] != band["from"] else ""
        ends = ", where the sweep begins" if band["from"] == sweep[0]["speed"] else ""
        ends += ", where the sweep ends" if end and band["to"] == sweep[-1]["speed"] else ""
        yield b.Judgement("partly", s.line(f"Avoid {{{path}.from}}{end}{ends}: {{{path}.why}}."))
    if not chain["avoid"] and len(sweep) > 1:
        ends = f"{{chain.sweep.0.speed}} to {{chain.sweep.{len(sweep) - 1}.speed}}"
        yield b.Text(s.line(f"No speed to avoid from {ends}."), "fine")


_OWN = (
    ("crank torque, peak", ("crank_torque_median", "crank_torque_high", "two_bar_crank_torque")),
    ("crank torque, RMS", ("crank_torque_rms", "", "two_bar_crank_torque_rms")),
    ("rocker torque, peak", ("rocker_torque_median", "rocker_torque_high", "two_bar_rocker_torque")),
    ("snatch: force at A2 over its own at rest", ("snatch_median", "snatch_high", "two_bar_snatch")),
    ("turns that count as independent, at the quantile", ("independent_turns", "", "")),
    ("snatch, largest over least median of a start", ("snatch_spread", "", "")),
    ("time with a slack rod; two bars: with one that pushes", ("slack_time", "", "two_bar_slack_time")),
    ("rods that are slack, mean over time", ("slack_rods", "", "")),
    ("largest angle between neighbouring rods", ("fold_largest", "", "")),
    ("energy residual of an organ over the energy moved", ("energy_residual", "", "")),
)


def _own_speed(s: b.Source, chain: Mapping[str, Any]) -> b.Table:
    rows = [
        b.TableRow((title, *(s.estimate(f"chain.own_speed.{name}") if name else "" for name in names)))
        for title, names in _OWN
    ]
    if chain["resonance"]["value"] is not None:
        rows += [
            b.TableRow(("resonance of an organ, crank speed", s.number("chain.resonance"), "", "")),
            b.TableRow(
                ("distance to it, relative; negative below", s.number("chain.distance_to_resonance"), "", "")
            ),
        ]
    title = (
        "Chains and two bars at constant {=chain.own_speed.speed}, {=chain.starts} starts of {=chain.turns} turns; "
        "in brackets: interval of {=chain.confidence} confidence"
    )
    quantile = s.line("chains, {=chain.quantile} of turns")
    heads = b.heads("peaks are of single turns", "chains, median", quantile, "two bars")
    return b.Table(tuple(rows), heads, title=s.line(title))


def _sweep(s: b.Source, chain: Mapping[str, Any]) -> b.Table:
    columns = {
        "crank_torque_median": "crank torque: median",
        "crank_torque_high": "crank torque: {=chain.quantile} quantile",
        "two_bar_crank_torque": "crank torque: two bars",
        "rocker_torque_median": "rocker torque: median",
        "rocker_torque_high": "rocker torque: {=chain.quantile} quantile",
        "two_bar_rocker_torque": "rocker torque: two bars",
        "snatch_median": "snatch: median",
        "snatch_high": "snatch: {=chain.quantile} quantile",
        "slack_time": "time with a slack rod",
    }

    def cell(i: int, name: str) -> Line:
        unknown = chain["sweep"][i].get(f"{name}_from", {"value": 0.0})["value"] is None
        return "-" if unknown else s.number(f"chain.sweep.{i}.{name}")

    rows = (
        b.TableRow((s.number(f"chain.sweep.{i}.speed"), *(cell(i, name) for name in columns)))
        for i in range(len(chain["sweep"]))
    )
    title = "Over the crank speed; -: the starts differ by so much that they do not tell the quantile"
    return b.Table(
        tuple(rows), b.heads("crank speed", *map(s.line, columns.values())), title=title, form="long"
    )


def _critical(s: b.Source, chain: Mapping[str, Any], study: Study) -> Iterator[b.Block]:
    """Critical crank speeds: all in a table, those within the sweep in a sentence."""
    path = "chain.critical_speeds"
    places: dict[float, dict[float, int]] = {}
    for i, each in enumerate(chain["critical_speeds"]):
        places.setdefault(each["mode"]["value"], {})[each["order"]["value"]] = i
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
    title = "Critical crank speeds, at which a multiple of the speed is a natural frequency of an organ"
    yield b.Table(tuple(rows), b.heads("", *orders), title=title, form="long")
    assert study.chain is not None
    inside = [
        s.line(f"{{{path}.{places[mode][order]}.speed}} (mode {mode}, order {order})")
        for mode, order, _ in sorted(study.chain.within_sweep(), key=lambda each: each[2])
    ]
    if inside:
        yield b.Text(line("Critical speeds within the sweep: ", joined(inside), "."), form="short")
