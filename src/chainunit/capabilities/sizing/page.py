"""The section on sizing: the demands on the drive, the candidates, and the choice."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from ...core.descriptions import of_driver
from ...core.quantities import finite
from ...report import blocks as b
from ...report.cited import cited, exact, number, table
from ...report.given_numbers import rating, run_settings
from ...report.lines import Aside, Line, Number, Strong, Words, capital, filled, join, line, spoken
from ...study.limits import Check
from ...study.record import StudyFindings, StudyRecord, StudyRuns, StudySetup
from .candidate import Candidate, DriveNumbers, Standing
from .findings import SizingFindings
from .result import DriveProtection, MotorProtection, OrderedBelt, SizedDrive

_REASONS = 5  # of the candidates that do not fit; the table has all
_SIGN = {Standing.CHOSEN: "✓", Standing.FITS: "○", Standing.BARELY: "△"}
_SEVERITY: dict[Standing | None, b.Severity] = {
    Standing.CHOSEN: "good",
    Standing.FITS: "partly",
    Standing.BARELY: "partly",
}
_TRIP_TORQUE = "torque limiter, trip torque at the {driver}"
_EMPTY_START = (
    ", with the machine empty in each start (this order is for starts under the feed: set empty_start = true and run "
    "again)"
)


def answer(study: StudyRecord) -> Iterator[b.Block]:
    """Cards with the motor of all runs, its gear, flywheel and protection, and a table of the share that this drive
    takes of each limit."""
    findings = SizingFindings.found_in(study.findings)
    if findings is None:
        return
    drive, x = findings.sized(study), cited(findings, "findings.sizing")
    sized, best = cited(drive, "findings.sizing"), x.candidates[0]
    gear = (_gear(findings.best, best), *_belt(sized.belt), *_gear_torque(sized))
    ratio, shaft = exact(best.ratio, 4), findings.best.drive.flywheel_shaft.words(study.setup.driver_noun)
    cards = [
        b.Card(
            "Motor",
            ((best.designation, str(findings.best.verdict)),),
            (*_data(study.setup), *_starter(study.setup, drive, sized, best.numbers)),
        ),
        b.Card("Gear ratio", ((ratio, f"motor turns per {study.setup.driver_noun} turn"),), gear),
        b.Card(
            "Flywheel",
            ((number(x.flywheel.J) if findings.best.disc else "none", f"flywheel on the {shaft}"),),
            tuple(_disc(findings.best, best)),
        ),
    ]
    protection: Any = sized.protection
    if isinstance(drive.protection, MotorProtection):
        setting = number(protection.relay_current), drive.protection.relay_current.title
        cards.append(b.Card("Protection", (setting,)))
    elif isinstance(drive.protection, DriveProtection):
        torque: Line = number(protection.trip_torque) if drive.protection.trip_torque else "none"
        limiter = torque, of_driver(_TRIP_TORQUE, study.setup.driver_noun)
        cards.append(b.Card("Protection", (limiter,), tuple(_protection(drive.protection, protection))))
    yield b.Cards(tuple(cards))
    yield from _parts(drive, sized)
    one_sided = " and the feed on one side at times" if findings.duty.larger else ""
    checks = findings.best.checks
    yield from table(
        checks,
        ("check", lambda key: capital(checks[key].title)),
        ("share", lambda key: _share(checks[key], best.checks[key])),
        title=f"Share of each limit (the line in the bar) in the duty of sizing, with the worst start{one_sided}",
        numeric=False,
        form="long",
    )


def _share(check: Check, x: Check) -> b.Share:
    """The cell of a check, cited as `x`. It stands out if it is over its limit."""
    if check.reason is not None:
        return b.Share(number(x.utilisation, none="none permitted", over=True), x.reason or "")
    over = (finite(check.utilisation) or 0.0) > 1.0
    note = line(number(x.value), " of ", number(x.limit))
    return b.Share(number(x.utilisation, none="no value", over=over), note)


def _parts(drive: SizedDrive, x: SizedDrive) -> Iterator[b.Block]:
    """The parts to order from catalogues, with what these leave open."""
    if drive.parts is None or x.parts is None:
        sentence = (
            "Order numbers: none, as motor and gear are typical values of no maker. Ask for offers to them, or "
            "give catalogues of makers (catalogue = [...])."
        )
        yield b.Text(sentence, "note", "long")
        return
    rows, sources = [], {}
    for item, shown in zip(drive.parts.items, x.parts.items, strict=True):
        order_number, price = shown.order_number if item.order_number else "-", exact(shown.price, none="-")
        rows.append(b.TableRow((capital(item.kind), shown.designation, order_number, price)))
        sources[item.source] = shown.source
    if len(rows) > 1 and drive.parts.total is not None:
        rows.append(b.TableRow(("These parts together", "", "", exact(x.parts.total))))
    columns = b.heads("part", "designation", "order number", "price")
    yield b.Table(tuple(rows), columns, title="Parts to order", numeric=False, form="long")
    yield b.Text(line("Source of their values: ", *join(sources.values()), "."), "note", "long")
    yield from (b.Text(remark, form="long") for remark in x.parts.open)


def _how_to_order(drive: SizedDrive, x: SizedDrive, k: int) -> Iterator[Line]:
    """Order number and price of a part of a catalogue, as far as it has them."""
    if drive.parts is not None and x.parts is not None and k < len(drive.parts.items):
        if drive.parts.items[k].order_number:
            yield line(", order number ", x.parts.items[k].order_number)
        if drive.parts.items[k].price is not None:
            yield line(", price ", exact(x.parts.items[k].price))


def judgements(findings: StudyFindings) -> Iterator[b.Block]:
    """The alarm where no motor fits."""
    sizing = SizingFindings.found_in(findings)
    if sizing is not None and sizing.nearest is not None:
        best = cited(sizing, "findings.sizing").candidates[0]
        nearest = line(" All runs are with ", best.designation, ", which is insufficient: ", best.reason, ".")
        yield b.Judgement("alarm", line(Strong("No motor of the catalogue fits."), nearest), form="long")


def _gear(candidate: Candidate, x: Candidate) -> Line:
    """The gear unit of a candidate, and the series of its ratio."""
    return line(x.gear, *((", ", x.series) if candidate.series else ()))


def _disc(candidate: Candidate, x: Candidate) -> Iterator[Line]:
    """The steel disc of the flywheel of a candidate."""
    if candidate.disc is not None:
        wheel = x.flywheel_numbers
        yield line("steel disc ", number(wheel.mass), ", ", number(wheel.diameter), " in diameter")


def _data(setup: StudySetup) -> Iterator[Line]:
    """The data of the motor of all runs."""
    if setup.plate is not None:
        x = rating(setup.plate)
        plate = "{}, {} poles, {}, {}, {}, {}, {}"
        sizes = map(exact, (x.rated_power, x.poles, x.rated_voltage, x.rated_frequency))
        yield filled(plate, *sizes, *map(number, (x.rated_speed, x.rated_torque, x.rated_current)))


def _gear_torque(x: SizedDrive) -> Iterator[Line]:
    """The rated torque of the gear to be ordered."""
    if x.gear is not None:
        order = line("gear with a rated output torque >= ", number(x.gear.rated_torque))
        yield line(order, ", decided by ", x.gear.decided_by)


def _belt(x: OrderedBelt | None) -> Iterator[Line]:
    """The belt to be ordered."""
    if x is not None:
        yield line(
            *("V-belt with a design power of ", number(x.design_power)),
            *(" (rated power of the motor times the belt service factor ", number(x.service_factor)),
            *("), belt speed ", number(x.speed), ", standard pulleys of ", number(x.small_pulley), " and "),
            *(number(x.large_pulley), " (pitch diameters, ratio ", number(x.ratio), ")"),
        )


def _starter(setup: StudySetup, drive: SizedDrive, x: SizedDrive, numbers: DriveNumbers) -> Iterator[Line]:
    """The soft starter or inverter to be ordered, with its settings; nothing for a start direct on line."""
    start, starter = setup.config.drive.start, cited(setup.config.drive.starter, "given.starter")
    if start == "soft":
        soft = starter.soft_start
        yield filled("soft starter, {} voltage, {}", exact(soft.voltage), exact(soft.time))
    elif start == "star-delta":
        empty = _EMPTY_START if drive.needs_empty_start else ""
        yield line("star-delta starter, ", exact(starter.star_delta.time), f" in star{empty}")
        yield _winding(setup)
    elif start == "inverter":
        starts = number(numbers.inverter_current).value is not None
        current = line(" of at least ", number(x.inverter.rated_current)) if x.inverter and starts else ()
        ramp = exact(run_settings(setup).ramp)
        yield filled("inverter{}, boost {}, ramp {}", current, exact(starter.inverter.boost), ramp)
        if starts:
            yield line("in running ", number(numbers.frequency), ", ", number(numbers.speed))


def _winding(setup: StudySetup) -> str:
    """The winding that a start in star and delta needs: one for the voltage of the supply in delta."""
    supply = 0.0 if setup.plate is None else setup.plate.nameplate.voltage
    # to the tens of volts of a nameplate
    in_star = 10.0 * round(supply * math.sqrt(3.0) / 10.0)
    other = 10.0 * round(supply * (1.0 / math.sqrt(3.0)) / 10.0)
    return (
        f"motor winding {supply:g}/{in_star:g} V, in delta at the {supply:g} V of the supply (one of "
        f"{other:g}/{supply:g} V, usual up to 3 kW, stays in star there and has no star-delta start)"
    )


def _protection(protection: DriveProtection, x: Any) -> Iterator[Line]:
    """The reason where there is no coupling, or its setting at the motor's shaft; and the relay."""
    if protection.why_none:
        yield line("no torque limiter: ", x.why_none)
    else:
        yield line(number(x.trip_torque_at_motor), " at the motor's shaft")
    yield _relay(protection.relay, x.relay)


def _relay(relay: MotorProtection, x: MotorProtection) -> Line:
    """The setting and the class of the relay."""
    setting = line(f"{relay.device} at ", number(x.relay_current))
    if x.line_current is not None:
        setting = line(setting, " (in the supply line ", number(x.line_current), ")")
    return line(setting, relay.class_words)


def blocks(study: StudyRecord) -> Iterator[b.Block]:
    """The choice, the candidates with the share that each takes of the limits, and the demands on the drive."""
    findings = SizingFindings.of_study(study.findings)
    drive, x = findings.sized(study), cited(findings, "findings.sizing")
    sized = cited(drive, "findings.sizing")
    if findings.chosen is None:
        reasons = (
            line(Strong(candidate.designation), ": ", candidate.reason)
            for candidate in x.candidates[:_REASONS]
        )
        heading = Strong("No candidate fits. The reasons:")
        yield b.Judgement("alarm", heading, items=tuple(reasons), form="long")
    yield from _best(study.setup, drive, sized, x.candidates[0])
    if isinstance(drive.protection, DriveProtection):
        protection: Any = sized.protection
        yield b.Text(protection.coupling)
        yield from (b.Text(way.words) for way in protection.alternatives)
        yield from _ways(study.runs, drive.protection, protection)
    weak = line("; too weak by the nameplate: ", exact(x.weak)) if findings.weak else ()
    tried, motors = map(exact, (x.tried, x.motors))
    yield b.Text(line("Tried: ", tried, " of ", motors, " motors of the catalogue", weak, "."))
    row_count = int(findings.plan.demands.candidates)
    yield from _trade(findings, x)
    yield _candidates(findings, x, row_count)
    yield from _gears(findings, x)
    if len(findings.candidates) > row_count:
        yield b.Text(
            f"{len(findings.candidates) - row_count} more were tried; report.html lists them.", form="short"
        )
    order = "; ".join(f"{i}. {criterion}" for i, criterion in enumerate(findings.order, 1))
    yield b.Text(f"Order of preference among drives that fit: {order}.", form="long")
    yield b.Tables(tuple(_numbers(study, findings, drive)))


def _numbers(study: StudyRecord, findings: SizingFindings, drive: SizedDrive) -> Iterator[b.Table]:
    """A table of the numbers of each part of the result."""
    # a machine without sides has no one-sided feed
    left_out = () if study.setup.config.machine.model.sides else ("one_sided_share", "torque_peak_one_sided")
    if all(candidate.sold is None for candidate in findings.candidates):
        # it is a demand on gears of a catalogue
        left_out = (*left_out, "gear_torque")
    section = findings.data_with(drive, study)
    for name in ("asked", "cycle", "flywheel", "belt", "gear", "inverter", "protection"):
        # the sentences on the coupling are too long for a cell of a narrow table, and stand above with the ways to it
        rows = tuple(
            b.TableRow(leaf)
            for key, below in (section.get(name) or {}).items()
            if (not isinstance(below, str) or key == "section") and key not in (*left_out, "alternatives")
            for leaf in _leaves(below, f"findings.sizing.{name}.{key}", spoken(key))
        )
        if rows:
            yield b.Table(rows, title=capital(spoken(name)))


def _best(setup: StudySetup, drive: SizedDrive, x: SizedDrive, best: Candidate) -> Iterator[b.Block]:
    """The sentences on what is ordered, and on the reason for the choice."""
    doubt = line(" (", cited(drive.caveat, "verdict.model.caveat"), ")") if drive.caveat else ()
    parts = () if drive.parts is None else drive.parts.items
    cited_parts = () if x.parts is None else x.parts.items
    order: list[Line] = []
    # the motor is the first part
    for motor_data in _data(setup):
        order.append(line("motor ", best.designation, " of ", motor_data, *_how_to_order(drive, x, 0)))
    if not any(part.kind == "gear" for part in parts):
        order += (*_belt(x.belt), *_gear_torque(x))
    for k in range(1, len(cited_parts)):
        designation = cited_parts[k].designation
        order.append(line(f"{parts[k].kind} ", designation, *_how_to_order(drive, x, k)))
    order += _starter(setup, drive, x, best.numbers)
    # a motor that does not suffice is not ordered
    if order and not drive.insufficient:
        yield b.Text(line("Order: ", join(order, "; "), "."), form="short", central=True)
    begin = "Insufficient: " if drive.insufficient else "Chosen: "
    yield b.Text(line(begin, best.reason, doubt, "."), central=True)


def _leaves(node: Any, path: str, title: str = "") -> Iterator[tuple[str, Line]]:
    """Title and piece of each number and each text below a node of the result."""
    if isinstance(node, Mapping) and "value" in node:
        value, is_asked = node["value"], path.startswith("findings.sizing.asked.")
        if isinstance(value, str):
            yield node.get("title", title), Words(value, f"{path}.value")
        else:
            size = Number(value, node["unit"], node.get("kind", ""), path, as_given=is_asked, none="none")
            yield node.get("title", title), size
    elif isinstance(node, Mapping | list):
        items = node.items() if isinstance(node, Mapping) else ((str(i), x) for i, x in enumerate(node))
        for name, below in items:
            yield from _leaves(below, f"{path}.{name}", f"{title}, {spoken(name)}" if title else spoken(name))
    elif isinstance(node, str):
        yield title, Words(node, path)


def _candidates(findings: SizingFindings, x: SizingFindings, row_count: int) -> b.Table:
    """The table of candidates, best first; the terminal shows the first `row_count` rows."""
    titles = _titles(findings.candidates)
    if any(candidate.sold is not None for candidate in findings.candidates):
        # the gears have a table of their own
        titles = {name: title for name, title in titles.items() if not name.startswith("gear")}
    rows = []
    for k, (candidate, shown) in enumerate(zip(findings.candidates, x.candidates, strict=True)):
        checks = candidate.checks
        shares = (_share(checks[name], shown.checks[name]) if name in checks else "" for name in titles)
        drive = line(shown.designation, Aside(_behind(candidate, shown)))
        mass = number(shown.numbers.mass)
        cells = (drive, shown.verdict or "", _flywheel(candidate, shown), mass, *shares)
        reason = line(f"{_SIGN.get(candidate.verdict or Standing.REJECTED, '✗')} ", shown.reason)
        severity = _SEVERITY.get(candidate.verdict, "bad")
        rows.append(b.TableRow(cells, reason, severity, "both" if k < row_count else "long"))
    long = (b.Column(title, form="long") for title in ("flywheel", "mass", *titles.values()))
    return b.Table(
        tuple(rows),
        (*b.heads("motor", "verdict"), *long),
        title="Candidates, best first. Cell: the share of its limit that a check takes.",
        note_title="because",
        numeric=False,
    )


def _titles(candidates: Iterable[Candidate]) -> dict[str, str]:
    """The title of each check of the candidates, by name."""
    titles: dict[str, str] = {}
    for candidate in candidates:
        for name, check in candidate.checks.items():
            titles.setdefault(name, check.title)
    return titles


def _gears(findings: SizingFindings, x: SizingFindings) -> Iterator[b.Table]:
    """The gears of the catalogue that were tried with the motors, with the share of each of its limits."""
    titles = {n: title for n, title in _titles(findings.candidates).items() if n.startswith("gear")}
    rows = []
    for candidate, shown in zip(findings.candidates, x.candidates, strict=True):
        if candidate.sold is None:
            continue
        gear = shown.parts[-1]
        cells = (
            _share(candidate.checks[name], shown.checks[name]) if name in candidate.checks else "not known"
            for name in titles
        )
        note = line("ruled out by the runs with ", shown.runs_with) if shown.runs_with is not None else ()
        price = exact(gear.price, none="-")
        rows.append(b.TableRow((gear.designation, shown.designation, price, *cells), note))
    if rows:
        columns = b.heads("gear", "motor", "price", *titles.values())
        yield b.Table(
            tuple(rows),
            columns,
            title="Gears of the candidates, in their order",
            numeric=False,
            note_title="because",
            form="long",
        )


def _ways(runs: StudyRuns, protection: DriveProtection, x: DriveProtection) -> Iterator[b.Table]:
    """A row for each way to a coupling that a start does not open; `x` is the cited `protection`."""
    opened = {
        way.way: "; ".join(map(runs.title_of, way.opens)) or "nothing" for way in protection.alternatives
    }
    return table(
        x.alternatives,
        ("way", lambda row: row.way),
        ("set to", lambda row: number(row.numbers.setting)),
        ("running", lambda row: number(row.numbers.running)),
        ("a start", lambda row: number(row.numbers.start)),
        ("start-up", lambda row: number(row.numbers.start_time)),
        ("opens or slips where", lambda row: opened[row.way]),
        title="Ways to a torque limiter: its setting, and the torques of running and of a start, at the "
        f"{runs.drive.driver_noun}",
        numeric=False,
        form="long",
    )


def _trade(findings: SizingFindings, x: SizingFindings) -> Iterator[b.Block]:
    """The smallest drive that fits with a flywheel, beside the next larger motor without one."""
    return table(
        ((findings.candidates[k], x.candidates[k]) for k in findings.traded or ()),
        (
            "motor",
            lambda row: line(row[1].designation, Aside(line("ratio ", exact(row[1].ratio, 4)))),
        ),
        ("flywheel", lambda row: _flywheel(*row)),
        ("start, worst angle", lambda row: number(row[1].checks["start"].value)),
        ("mass", lambda row: number(row[1].numbers.mass)),
        ("verdict", lambda row: row[1].verdict or ""),
        title="A flywheel, or a larger motor. Mass: of motor and flywheel.",
    )


def _behind(candidate: Candidate, x: Candidate) -> Line:
    """The gear of a candidate, if it is one of a catalogue, else its ratio."""
    if candidate.sold is None:
        return line("ratio ", exact(x.ratio, 4))
    return x.parts[-1].designation


def _flywheel(candidate: Candidate, x: Candidate) -> Line:
    """The inertia of the flywheel of a candidate, and its disc."""
    if not candidate.drive.added_inertia:
        return "none"
    return line(number(x.flywheel_numbers.J), *map(Aside, _disc(candidate, x)))
