"""The section on sizing: the demands on the drive, the candidates, and the choice."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from ...report import blocks as b
from ...report.lines import Aside, Line, Number, Strong, capital, join, line, spoken
from ...study.record import StudyRecord
from .candidate import Standing

_REASONS = 5  # of the candidates that do not fit; the table has all
_SIGN = {Standing.CHOSEN: "✓", Standing.FITS: "○", Standing.BARELY: "△"}
_SEVERITY: dict[str, b.Severity] = {
    Standing.CHOSEN: "good",
    Standing.FITS: "partly",
    Standing.BARELY: "partly",
}


def answer(s: b.Source) -> Iterator[b.Block]:
    """Cards with the motor of all runs, its gear, flywheel and protection, and a table of the share that this drive
    takes of each limit."""
    path = _best_path(s)
    if path is None:
        return
    motor, ratio = s.words(f"{path}.motor"), s.number(f"{path}.ratio", digits=4, as_given=True)
    also = {"flywheel": _disc, "protection": _protection}
    gear = (*_gear(s, path), *_belt(s), *_gear_torque(s))
    cards = [
        b.Card("Motor", ((motor, str(b.at(s.result, f"{path}.verdict"))),), (*_data(s), *_starter(s, path))),
        b.Card("Gear ratio", ((ratio, f"motor turns per {s.driver} turn"),), gear),
        *(
            b.Card(capital(name), ((size or "none", title),), tuple(also[name](s)))
            for name, title, size in _sizes(s)
        ),
    ]
    yield b.Cards(tuple(cards))
    yield from _parts(s)
    checks = b.at(s.result, f"{path}.checks")
    rows = tuple(
        b.TableRow((capital(check.get("title", spoken(name))), s.check(f"{path}.checks.{name}")))
        for name, check in checks.items()
    )
    if rows:
        one_sided = " and the feed on one side at times" if s.result["sizing"].get("one_sided") else ""
        title = f"Share of each limit (the line in the bar) in the duty of sizing, with the worst start{one_sided}"
        yield b.Table(rows, b.heads("check", "share"), title=title, numeric=False, form="long")


def _parts(s: b.Source) -> Iterator[b.Block]:
    """The parts to order from catalogues, with what these leave open."""
    listed = s.result["sizing"].get("parts")
    if not listed:
        words = (
            "Order numbers: none, as motor and gear are typical data that nobody sells; order by these values, or "
            "give catalogues of makers (catalogue = [...])."
        )
        yield b.Text(words, "note", "long")
        return
    rows = []
    for k, each in enumerate(listed["parts"]):
        path = f"sizing.parts.parts.{k}"
        number = s.words(f"{path}.order_number") if each["order_number"] else "-"
        price = s.number(f"{path}.price", as_given=True, none="-")
        rows.append(b.TableRow((capital(each["part"]), s.words(f"{path}.designation"), number, price)))
    if len(rows) > 1 and listed["total"]["value"] is not None:
        rows.append(
            b.TableRow(("These parts together", "", "", s.number("sizing.parts.total", as_given=True)))
        )
    columns = b.heads("part", "designation", "order number", "price")
    yield b.Table(tuple(rows), columns, title="Parts to order", numeric=False, form="long")
    sources = {each["source"]: f"sizing.parts.parts.{k}.source" for k, each in enumerate(listed["parts"])}
    named = join(s.words(path) for path in sources.values())
    yield b.Text(line("Source of their values: ", *named, "."), "note", "long")
    yield from (b.Text(each, form="long") for each in s.lines("sizing.parts.open"))


def _how_to_order(s: b.Source, k: int) -> Iterator[Line]:
    """Order number and price of a part of a catalogue, as far as it has them."""
    parts, path = s.result["sizing"].get("parts", {}).get("parts", ()), f"sizing.parts.parts.{k}"
    if k < len(parts):
        if parts[k]["order_number"]:
            yield line(", order number ", s.words(f"{path}.order_number"))
        if parts[k]["price"]["value"] is not None:
            yield line(", price ", s.number(f"{path}.price", as_given=True))


def judgements(s: b.Source) -> Iterator[b.Block]:
    """The alarm where no motor fits."""
    nearest = s.result.get("sizing", {}).get("nearest")
    if nearest is not None:
        best = f"sizing.candidates.{nearest}"
        rest = f" All runs are with {{{best}.motor}}, which is insufficient: {{{best}.reason}}."
        yield b.Judgement("alarm", line(Strong("No motor of the catalogue fits."), s.line(rest)), form="long")


def _best_path(s: b.Source) -> str | None:
    """The path of the candidate whose motor all runs use: the chosen one, else the nearest one; None without any."""
    section = s.result.get("sizing", {})
    best = section.get("nearest") if section.get("chosen") is None else section["chosen"]
    return None if best is None else f"sizing.candidates.{best}"


def _sizes(s: b.Source) -> Iterator[tuple[str, str, Number | None]]:
    """The leading numbers of the flywheel and of the protection: section, title, number; None where there is no
    flywheel or no coupling."""
    for section in ("flywheel", "protection"):
        leading = _leading(s.result["sizing"].get(section))
        if leading:
            size = s.number(f"sizing.{section}.{leading}")
            yield (
                section,
                s.result["sizing"][section][leading].get("title", spoken(leading)),
                size if size.value else None,
            )


def _gear(s: b.Source, candidate: str) -> Iterator[Line]:
    """The gear unit of a candidate, and the series of its ratio."""
    if b.at(s.result, f"{candidate}.gear"):
        series = b.at(s.result, f"{candidate}.series")
        yield line(s.words(f"{candidate}.gear"), *((", ", s.words(f"{candidate}.series")) if series else ()))


def _disc(s: b.Source, flywheel: str = "sizing.flywheel") -> Iterator[Line]:
    """The steel disc of a flywheel."""
    mass = b.at(s.result, f"{flywheel}.mass")
    if mass and mass["value"] is not None:
        yield s.line(f"steel disc {{{flywheel}.mass}}, {{{flywheel}.diameter}} in diameter")


def _data(s: b.Source) -> Iterator[Line]:
    """The data of the motor of all runs."""
    if "rated_power" in s.result.get("motor", {}):
        names = ("rated_speed", "rated_torque", "rated_current")
        parts = "{=motor.rated_power}, {=motor.poles} poles, {=motor.rated_voltage}, {=motor.rated_frequency}"
        yield join((s.line(parts), *(s.number(f"motor.{name}") for name in names)), ", ")


def _gear_torque(s: b.Source) -> Iterator[Line]:
    """The rated torque of the gear to be ordered."""
    if s.result["sizing"].get("gear"):
        order = s.line("gear with a rated output torque >= {sizing.gear.rated_torque}")
        yield line(order, ", decided by ", s.words("sizing.gear.decided_by"))


def _belt(s: b.Source) -> Iterator[Line]:
    """The belt to be ordered."""
    if "belt" in s.result["sizing"]:
        yield s.line(
            "V-belt with a design power of {sizing.belt.design_power} (rated power of the motor times the belt "
            "service factor {sizing.belt.service_factor}), belt speed {sizing.belt.speed}, "
            "ratio {sizing.belt.ratio}, pulleys of {sizing.belt.small_pulley} and {sizing.belt.large_pulley} "
            "(pitch diameters)"
        )


def _starter(s: b.Source, path: str) -> Iterator[Line]:
    """The soft starter or inverter to be ordered, with its settings; nothing for a start direct on line."""
    start = s.result["start"] if "starter" in s.result else "direct"
    if start == "soft":
        yield s.line("soft starter, {=starter.soft_start.voltage} voltage, {=starter.soft_start.time}")
    elif start == "star-delta":
        yield s.line("star-delta starter, {=starter.star_delta.time} in star")
        yield _winding(s)
    elif start == "inverter":
        is_ordered = "inverter" in s.result["sizing"] and _starts(s, path)
        current = s.line(" of at least {sizing.inverter.rated_current}") if is_ordered else ()
        yield line("inverter", current, s.line(", boost {=starter.inverter.boost}, ramp {=run.ramp}"))
        if _starts(s, path):
            yield s.line(f"in running {{{path}.numbers.frequency}}, {{{path}.numbers.speed}}")


def _winding(s: b.Source) -> str:
    """The winding that a start in star and delta needs: one for the voltage of the supply in delta."""
    supply = s.value("motor.rated_voltage") or 0.0
    in_star, other = (
        10.0 * round(supply * factor / 10.0) for factor in (math.sqrt(3.0), 1.0 / math.sqrt(3.0))
    )
    return (
        f"motor winding {supply:g}/{in_star:g} V, in delta at the {supply:g} V of the supply (one of "
        f"{other:g}/{supply:g} V, usual up to 3 kW, stays in star there and has no star-delta start)"
    )


def _starts(s: b.Source, path: str) -> bool:
    return s.value(f"{path}.numbers.inverter_current") is not None


def _protection(s: b.Source) -> Iterator[Line]:
    """The reason where there is no coupling, or its setting at the motor's shaft; and the relay."""
    protection = s.result["sizing"]["protection"]
    if protection.get("why_none"):
        yield line("no torque limiter: ", s.words("sizing.protection.why_none"))
    elif "trip_torque_at_motor" in protection:
        yield s.line("{sizing.protection.trip_torque_at_motor} at the motor's shaft")
    yield from _relay(s)


def _relay(s: b.Source) -> Iterator[Line]:
    """The setting and the class of the relay, where it is not the leading number of the protection."""
    protection = s.result["sizing"].get("protection", {})
    if "relay_current" in protection and _leading(protection) != "relay_current":
        setting = s.line(f"{protection.get('device', 'relay')} at {{sizing.protection.relay_current}}")
        if "line_current" in protection:
            setting = line(setting, s.line(" (in the supply line {sizing.protection.line_current})"))
        yield line(setting, _class(s))


def _class(s: b.Source) -> Line:
    """The trip class of the relay, to follow its setting; empty for the motor protection of an inverter."""
    protection = s.result["sizing"].get("protection", {})
    if "relay_class" not in protection:
        return ()
    tolerance = Aside(s.words("sizing.protection.tolerance")) if protection.get("tolerance") else ()
    return line(", ", s.words("sizing.protection.relay_class.value"), tolerance)


def blocks(s: b.Source, study: StudyRecord) -> Iterator[b.Block]:
    """The choice, the candidates with the share that each takes of the limits, and the demands on the drive."""
    section = s.result["sizing"]
    choice, candidates = section.get("chosen"), section.get("candidates")
    best = _best_path(s)
    if choice is None and candidates:
        reasons = (
            line(
                Strong(s.words(f"sizing.candidates.{i}.motor")),
                ": ",
                s.words(f"sizing.candidates.{i}.reason"),
            )
            for i in range(min(_REASONS, len(candidates)))
        )
        words = Strong("No candidate fits. The reasons:")
        yield b.Judgement("alarm", words, items=tuple(reasons), form="long")
    if best is not None:
        yield from _best(s, best, "Motor" if choice is not None else "Insufficient motor")
    if "coupling" in section.get("protection", {}):
        yield b.Text(s.words("sizing.protection.coupling"))
        ways = section["protection"]["alternatives"]
        yield from (b.Text(s.words(f"sizing.protection.alternatives.{k}.words")) for k in range(len(ways)))
        if ways:
            yield _ways(s, study)
    if candidates:
        if "tried" in section:
            weak = "; too weak by the nameplate: {=sizing.weak}" if s.value("sizing.weak") else ""
            trials = "Tried: {=sizing.tried} of {=sizing.motors} motors of the catalogue"
            yield b.Text(s.line(f"{trials}{weak}."))
        plan = study.config.plans["sizing"]
        row_count = len(candidates) if plan is None else int(plan.demands.candidates)
        yield from _trade(s)
        yield _candidates(s, row_count)
        yield from _gears(s)
        if len(candidates) > row_count:
            yield b.Text(
                f"{len(candidates) - row_count} more were tried; report.html lists them.", form="short"
            )
    if "order" in section:
        order = "; ".join(f"{i}. {words}" for i, words in enumerate(section["order"], 1))
        yield b.Text(f"Order of preference among drives that fit: {order}.", form="long")
    tables = []
    # a machine without sides has no one-sided feed
    side_keys = () if study.config.machine.model.sides else ("one_sided_share", "torque_peak_one_sided")
    if all(_sold(candidate) is None for candidate in candidates or ()):
        # it is a demand on gears of a catalogue
        side_keys = (*side_keys, "gear_torque")
    for name in ("asked", "cycle", "flywheel", "belt", "gear", "inverter", "protection"):
        # the sentences on the coupling are too long for a cell of a narrow table, and stand above with the ways to it
        leaves = [
            leaf
            for key, below in (section.get(name) or {}).items()
            if (not isinstance(below, str) or key == "section") and key not in (*side_keys, "alternatives")
            for leaf in _leaves(below, f"sizing.{name}.{key}", spoken(key))
        ]
        rows = tuple(b.TableRow((title, _leaf(s, path))) for title, path in leaves)
        if rows:
            tables.append(b.Table(rows, title=capital(spoken(name))))
    yield b.Tables(tuple(tables))


def _best(s: b.Source, path: str, word: str) -> Iterator[b.Block]:
    """The sentences on what is ordered, and on the reason for the choice."""
    model = s.result["verdict"]["model"]
    doubt = s.line(" ({verdict.model.caveat})") if model is not None and model["caveat"] else ()
    begin = "Chosen: " if word == "Motor" else "Insufficient: "
    # a motor that does not suffice is not ordered
    parts = s.result["sizing"].get("parts", {}).get("parts", ())
    motor = [line("motor ", s.words(f"{path}.motor"), " of ", each) for each in _data(s)]
    order: list[Line] = [line(each, *_how_to_order(s, 0)) for each in motor]
    if not any(each["part"] == "gear" for each in parts):
        order += (*_belt(s), *_gear_torque(s))
    for k in range(1, len(parts)):
        named = s.words(f"sizing.parts.parts.{k}.designation")
        order.append(line(f"{parts[k]['part']} ", named, *_how_to_order(s, k)))
    order += _starter(s, path)
    if order and word == "Motor":
        yield b.Text(line("Order: ", join(order, "; "), "."), form="short", central=True)
    yield b.Text(line(begin, s.words(f"{path}.reason"), doubt, "."), central=True)


def _leading(section: Mapping[str, Any] | None) -> str | None:
    """The name of the leading number of a section: the trip torque, else the first number."""
    names = [name for name, entry in (section or {}).items() if isinstance(entry, dict) and "value" in entry]
    return "trip_torque" if "trip_torque" in names else next(iter(names), None)


def _leaves(node: Any, path: str, title: str = "") -> Iterator[tuple[str, str]]:
    """Title and path of each number and each text below a node."""
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
    return s.number(path, as_given=path.startswith("sizing.asked."), none="none")


def _candidates(s: b.Source, row_count: int) -> b.Table:
    """The table of candidates, best first; the terminal shows the first `row_count` rows."""
    candidates = s.result["sizing"]["candidates"]
    checks = _titles(candidates)
    if any(_sold(candidate) is not None for candidate in candidates):
        # the gears have a table of their own
        checks = {name: title for name, title in checks.items() if not name.startswith("gear")}
    rows = []
    for i, candidate in enumerate(candidates):
        path = f"sizing.candidates.{i}"
        verdict = candidate["verdict"]
        motor = line(s.words(f"{path}.motor"), Aside(_behind(s, path)))
        cells = (s.check(f"{path}.checks.{name}") if name in candidate["checks"] else "" for name in checks)
        parts = (_flywheel(s, path), _mass(s, path)) if "flywheel" in candidate else ()
        rows.append(
            b.TableRow(
                (motor, s.words(f"{path}.verdict"), *parts, *cells),
                line(f"{_SIGN.get(verdict, '✗')} ", s.words(f"{path}.reason")),
                _SEVERITY.get(verdict, "bad"),
                "both" if i < row_count else "long",
            )
        )
    title = "Candidates, best first. Cell: the share of its limit that a check takes."
    more = ("flywheel", "mass") if "flywheel" in candidates[0] else ()
    long = (b.Column(title, form="long") for title in (*more, *checks.values()))
    columns = (*b.heads("motor", "verdict"), *long)
    return b.Table(tuple(rows), columns, title=title, note_title="because", numeric=False)


def _titles(candidates: Sequence[Mapping[str, Any]]) -> dict[str, str]:
    """The title of each check of the candidates, by name."""
    titles: dict[str, str] = {}
    for candidate in candidates:
        for name, check in candidate["checks"].items():
            titles.setdefault(name, check.get("title", spoken(name)))
    return titles


def _gears(s: b.Source) -> Iterator[b.Table]:
    """The gears of the catalogue that were tried with the motors, with the share of each of its limits."""
    candidates = s.result["sizing"]["candidates"]
    titles = {name: title for name, title in _titles(candidates).items() if name.startswith("gear")}
    rows = []
    for i, candidate in enumerate(candidates):
        path = f"sizing.candidates.{i}"
        if (k := _sold(candidate)) is None:
            continue
        price = s.number(f"{path}.parts.{k}.price", as_given=True, none="-")
        checks = candidate["checks"]
        cells = (s.check(f"{path}.checks.{name}") if name in checks else "not known" for name in titles)
        gear = s.words(f"{path}.parts.{k}.designation")
        note = (
            line("ruled out by the runs with ", s.words(f"{path}.runs_with"))
            if "runs_with" in candidate
            else ()
        )
        rows.append(b.TableRow((gear, s.words(f"{path}.motor"), price, *cells), note))
    if rows:
        title = "Gears of the candidates, in their order"
        columns = b.heads("gear", "motor", "price", *titles.values())
        yield b.Table(tuple(rows), columns, title=title, numeric=False, note_title="because", form="long")


def _ways(s: b.Source, study: StudyRecord) -> b.Table:
    """A row for each way to a coupling that a start does not open."""
    rows = []
    for k, way in enumerate(s.result["sizing"]["protection"]["alternatives"]):
        path = f"sizing.protection.alternatives.{k}"
        numbers = (
            s.number(f"{path}.{name}", none="-") for name in ("setting", "running", "start", "start_time")
        )
        opens = "; ".join(study.title_of(run) for run in way["opens"]) or "nothing"
        rows.append(b.TableRow((s.words(f"{path}.way"), *numbers, opens)))
    columns = b.heads("way", "set to", "running", "a start", "start-up", "opens or slips where")
    title = (
        f"Ways to a torque limiter: its setting, and the torques of running and of a start, at the {s.driver}"
    )
    return b.Table(tuple(rows), columns, title=title, numeric=False, form="long")


def _trade(s: b.Source) -> Iterator[b.Block]:
    """The smallest drive that fits with a flywheel, beside the next larger motor without one."""
    rows = []
    for i in s.result["sizing"].get("trade") or ():
        path = f"sizing.candidates.{i}"
        start = s.number(f"{path}.checks.start.value")
        motor = line(s.words(f"{path}.motor"), Aside(s.line(f"ratio {{={path}.ratio:4}}")))
        rows.append(
            b.TableRow((motor, _flywheel(s, path), start, _mass(s, path), s.words(f"{path}.verdict")))
        )
    if rows:
        title = "A flywheel, or a larger motor. Mass: of motor and flywheel."
        yield b.Table(
            tuple(rows), b.heads("motor", "flywheel", "start, worst angle", "mass", "verdict"), title=title
        )


def _behind(s: b.Source, candidate: str) -> Line:
    """The gear of a candidate, if it is one of a catalogue, else its ratio."""
    gear = _sold(b.at(s.result, candidate))
    if gear is None:
        return s.line(f"ratio {{={candidate}.ratio:4}}")
    return s.words(f"{candidate}.parts.{gear}.designation")


def _sold(candidate: Mapping[str, Any]) -> int | None:
    """The place of the gear among the parts of a candidate; None for a gear of no catalogue."""
    parts = candidate.get("parts", ())
    return next((k for k, each in enumerate(parts) if each["part"] == "gear"), None)


def _flywheel(s: b.Source, candidate: str) -> Line:
    path = f"{candidate}.flywheel"
    return line(s.number(f"{path}.J"), _aside(_disc(s, path))) if s.value(f"{path}.J") else "none"


def _mass(s: b.Source, candidate: str) -> Line:
    return s.number(f"{candidate}.numbers.mass")


def _aside(lines: Iterator[Line]) -> Line:
    return tuple(Aside(each) for each in lines)
