"""The section on the checks: a row for each, with its clause and formula, and what was not checked."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

from ...reading.text import number
from ...report import blocks as b
from ...report.lines import Line, join, line
from ...study.record import StudyRecord
from ...study.relay import TRIPS_AT
from .analysis import CheckFindings
from .coupling_choice import CHOSEN, CouplingCandidate
from .row import CheckRow

_COUPLINGS = "checks.flexible_coupling.candidates"


def blocks(s: b.Source, study: StudyRecord) -> Iterator[b.Block]:
    """The table of the checks."""
    findings = CheckFindings.of_study(study)
    if findings.rows:
        couplings = () if findings.flexible_coupling is None else findings.flexible_coupling.candidates
        if couplings:
            yield _coupling_to_order(s, couplings)
        lead = (
            "Each row is a check by the clause or source {place}: the value of the run, the limit, and the share "
            "of the limit that is used. A check passes at 100 % use at most. docs/checks.md has each formula "
            "with its simplifications and an example."
        )
        if study.proposal is not None:
            lead += (
                " These values are those of the simulated runs; the shares of limits in the answer are those of the "
                f"duty of {study.proposal.name} (worst start, margins). They may differ."
            )
        yield b.Text(lead.format(place="under it"), "lead", "long")
        yield b.Text(lead.format(place="whose number stands behind it"), "lead", "sheet")
        yield b.Table(
            tuple(_row(s, findings, k) for k in range(len(findings.rows))),
            b.heads("check", "value", "limit", "used"),
            title="Checks by clause",
            note_title="clause, formula, numbers",
            form="long",
        )
        yield from _on_sheet(s, findings)
        if couplings:
            yield _tried_couplings(s, couplings)
        yield b.Table(
            tuple(_row(s, findings, k, short=True) for k in range(len(findings.rows))),
            b.heads("check", "value", "limit", "used"),
            title="Checks by clause",
            form="short",
        )


def _on_sheet(s: b.Source, findings: CheckFindings) -> Iterator[b.Block]:
    """The checks with a line each, and behind them each clause and formula once, by its number in the table."""
    laws = dict.fromkeys((row.clause, row.formula) for row in findings.rows)
    places = {law: place for place, law in enumerate(laws, 1)}
    rows = []
    for k, row in enumerate(findings.rows):
        short = _row(s, findings, k, short=True)
        rows.append(replace(short, cells=(*short.cells, f"[{places[row.clause, row.formula]}]")))
    heads = (*b.heads("check", "value", "limit"), b.Column("used", of_text=True), *b.heads("by"))
    yield b.Table(tuple(rows), heads, title="Checks by clause", form="sheet")
    for (clause, formula), place in places.items():
        yield b.Text(f"[{place}] {clause}. {formula}", "note", "sheet")


def _coupling_to_order(s: b.Source, candidates: Sequence[CouplingCandidate]) -> b.Text:
    """The flexible coupling of the catalogues that is checked."""
    path, best = _COUPLINGS, candidates[0]
    phrases: list[Line] = [s.words(f"{path}.0.designation")]
    if best.order_number:
        phrases.append(s.line(f"order number {{{path}.0.order_number}}"))
    if best.price is not None:
        phrases.append(s.line(f"price {{={path}.0.price:10}}"))
    values = (
        s.number(f"{path}.0.{name}", as_given=True) for name in ("rated_torque", "stiffness", "damping")
    )
    phrases += [line(name, value) for name, value in zip(("TKN ", "CTdyn ", "psi "), values, strict=True)]
    count = (
        f"{sum(candidate.fits for candidate in candidates)} of the {len(candidates)} of the catalogues fit"
    )
    reason = s.words(f"{path}.0.reason")
    begin = (
        "Flexible coupling to order: " if best.verdict == CHOSEN else "Flexible coupling that does not fit: "
    )
    return b.Text(line(begin, *join(phrases), ": ", reason, f" ({count})."))


def _tried_couplings(s: b.Source, candidates: Sequence[CouplingCandidate]) -> b.Table:
    """The flexible couplings of the catalogues."""
    rows = []
    for k, candidate in enumerate(candidates):
        path = f"{_COUPLINGS}.{k}"
        name, verdict, order, why = (
            s.words(f"{path}.{x}") for x in ("designation", "verdict", "order_number", "reason")
        )
        price = s.number(f"{path}.price", as_given=True, none="-")
        share = s.number(
            f"{path}.checks.{candidate.checks.index(candidate.hardest)}.utilisation", over=not candidate.fits
        )
        rows.append(b.TableRow((name, verdict, share, price, order, why)))
    heads = b.heads("flexible coupling", "verdict", "largest share", "price", "order number", "reason")
    title = "Flexible couplings of the catalogues"
    return b.Table(tuple(rows), heads, numeric=False, title=title, form="long")


def missing(s: b.Source, study: StudyRecord) -> Iterator[b.Block]:
    """What was not checked, and why."""
    findings = CheckFindings.of_study(study)
    if findings.not_checked:
        cells = (
            (s.words(f"checks.not_checked.{k}.what"), s.words(f"checks.not_checked.{k}.why"))
            for k in range(len(findings.not_checked))
        )
        yield b.Table(
            tuple(map(b.TableRow, cells)), b.heads("not checked", "why"), numeric=False, form="long"
        )


def relay(s: b.Source, study: StudyRecord) -> Iterator[b.Block]:
    """The classes of the relay, beside the start and the stall of the motor; nothing where no relay is checked."""
    findings = CheckFindings.of_study(study).relay
    if findings is None:
        return
    rows = []
    never = "trips in running" if findings.numbers.before >= TRIPS_AT * findings.numbers.setting else "never"
    for name in findings.classes:
        path = f"checks.relay.classes.{name}"
        rows.append(
            b.TableRow(
                (
                    name,
                    s.number(f"{path}.shortest"),
                    s.number(f"{path}.stall_trip", none=never),
                    "yes" if name in findings.suitable else "no",
                )
            )
        )
    lead = s.line(
        "The start heats a relay as much as 7.2 times its setting of {checks.relay.setting} does in "
        "{checks.relay.start_seconds}; the rotor may be locked for {checks.relay.stall_time}. A cold relay surely "
        "holds up to the least trip time of its class, and the slowest relay of the class has to trip before that "
        "time. The tolerance of IEC 60034-1 permits a motor 20 % more current, with 1.44 times the heat of a start."
    )
    yield b.Text(lead, "lead", "long")
    heads = b.heads(
        "class", "holds up to", "trips with the rotor locked", "lets the start through, and protects"
    )
    yield b.Table(tuple(rows), heads, form="long")


def _row(s: b.Source, findings: CheckFindings, k: int, *, short: bool = False) -> b.TableRow:
    row, path = findings.rows[k], f"checks.rows.{k}"
    title = line(s.words(f"{path}.of"), ": ", s.words(f"{path}.title"))
    limit = line("at least " if row.at_least else "at most ", s.number(f"{path}.limit"))
    # of a check that fails, a number that the result does not have is not finite
    value, used = ("-", "-") if row.holds else ("never", number(math.inf, "1", "used"))
    share = b.Share(s.number(f"{path}.utilisation", over=not row.holds, none=used))
    cells = (title, s.number(row.number, none=value), limit, share)
    note = (
        () if short else line(s.words(f"{path}.clause"), ". ", s.words(f"{path}.formula"), *_numbers(s, row))
    )
    return b.TableRow(cells, note)


def _numbers(s: b.Source, row: CheckRow) -> tuple[Line, ...]:
    """The numbers of the formula, behind it."""
    if not row.numbers:
        return ()
    return (" (", *join([line(f"{symbol} = ", s.number(path)) for symbol, path in row.numbers.items()]), ")")
