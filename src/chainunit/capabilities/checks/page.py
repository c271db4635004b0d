"""The section on the checks: a row for each, with its clause and formula, and what was not checked."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from ...reading.text import number
from ...report import blocks as b
from ...report.lines import Line, join, line
from ...study.record import StudyRecord
from ...study.relay import TRIPS_AT
from .analysis import CheckFindings
from .coupling import CHOSEN, CouplingCandidate
from .row import CheckRow

_COUPLINGS = "checks.flexible_coupling.candidates"


def blocks(s: b.Source, study: StudyRecord) -> Iterator[b.Block]:
    """The tables of the checks: with all that stands behind each, with a line each, and for a sheet with a line each
    and behind them each clause and formula once, by its number in the table."""
    findings = CheckFindings.of_study(study)
    rows, coupling = findings.rows, findings.flexible_coupling
    if not rows:
        return
    if coupling is not None and coupling.candidates:
        yield _coupling_to_order(s, coupling.candidates)
    lead = (
        "Each row is a check by the clause or source {place}: the value of the run, the limit, and the share "
        "of the limit that is used. A check passes at 100 % use at most. docs/checks.md has each formula "
        "with its simplifications and an example."
    )
    if study.proposal is not None:
        lead += (
            " These values come from the simulated runs, the shares of limits in the answer from the duty of "
            f"{study.proposal.name} (worst start, margins). They may differ."
        )
    yield b.Text(lead.format(place="under it"), "lead", "long")
    yield b.Text(lead.format(place="whose number stands behind it"), "lead", "sheet")
    heads = b.heads("check", "value", "limit", "used")
    title = "Checks by clause"
    noted = tuple(b.TableRow(_cells(s, row, k), _note(s, row, k)) for k, row in enumerate(rows))
    yield b.Table(noted, heads, title=title, note_title="clause, formula, numbers", form="long")
    laws = dict.fromkeys((row.clause, row.formula) for row in rows)
    places = {law: f"[{place}]" for place, law in enumerate(laws, 1)}
    by_place = tuple(
        b.TableRow((*_cells(s, row, k), places[row.clause, row.formula])) for k, row in enumerate(rows)
    )
    used = b.Column("used", of_text=True)
    yield b.Table(by_place, (*heads[:3], used, *b.heads("by")), title=title, form="sheet")
    for (clause, formula), place in places.items():
        yield b.Text(f"{place} {clause}. {formula}", "note", "sheet")
    if coupling is not None and coupling.candidates:
        yield _tried_couplings(s, coupling.candidates)
    short = tuple(b.TableRow(_cells(s, row, k)) for k, row in enumerate(rows))
    yield b.Table(short, heads, title=title, form="short")


def _cells(s: b.Source, row: CheckRow, k: int) -> tuple[b.Cell, ...]:
    """A check in a line: its title, its value, its limit and the used share."""
    path = f"checks.rows.{k}"
    title = line(s.words(f"{path}.of"), ": ", s.words(f"{path}.title"))
    limit = line("at least " if row.at_least else "at most ", s.number(f"{path}.limit"))
    # of a check that fails, a number that the result does not have is not finite
    value, used = ("-", "-") if row.holds else ("never", number(math.inf, "1", "used"))
    share = b.Share(s.number(f"{path}.utilisation", over=not row.holds, none=used))
    return title, s.number(row.number, none=value), limit, share


def _note(s: b.Source, row: CheckRow, k: int) -> Line:
    """Clause, formula, and the numbers of the formula."""
    numbers = join([line(f"{symbol} = ", s.number(path)) for symbol, path in row.numbers.items()])
    path = f"checks.rows.{k}"
    law = (s.words(f"{path}.clause"), ". ", s.words(f"{path}.formula"))
    return line(*law, " (", *numbers, ")") if numbers else line(*law)


def _coupling_to_order(s: b.Source, candidates: Sequence[CouplingCandidate]) -> b.Text:
    """The flexible coupling of the catalogues that is checked."""
    best = candidates[0]
    phrases = {
        "{#.designation}": True,
        "order number {#.order_number}": bool(best.order_number),
        "price {=#.price:10}": best.price is not None,
        "TKN {=#.rated_torque}, CTdyn {=#.stiffness}, psi {=#.damping}": True,
    }
    begin = "Flexible coupling to order" if best.verdict == CHOSEN else "Flexible coupling that does not fit"
    count = f"{sum(x.fits for x in candidates)} of the {len(candidates)} of the catalogues fit"
    text = ", ".join(phrase for phrase, is_said in phrases.items() if is_said)
    return b.Text(s.line(f"{begin}: {text}: {{#.reason}} ({count}).".replace("#", f"{_COUPLINGS}.0")))


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
    rows = tuple(
        b.TableRow((s.words(f"checks.not_checked.{k}.what"), s.words(f"checks.not_checked.{k}.why")))
        for k in range(len(CheckFindings.of_study(study).not_checked))
    )
    if rows:
        yield b.Table(rows, b.heads("not checked", "why"), numeric=False, form="long")


def relay(s: b.Source, study: StudyRecord) -> Iterator[b.Block]:
    """The classes of the relay, beside the start and the stall of the motor; nothing where no relay is checked."""
    relay = CheckFindings.of_study(study).relay
    if relay is None:
        return
    never = "trips in running" if relay.before >= TRIPS_AT * relay.setting else "never"
    rows = []
    for name in relay.classes:
        path, suits = f"checks.relay.classes.{name}", "yes" if name in relay.suitable else "no"
        trip = s.number(f"{path}.stall_trip", none=never)
        rows.append(b.TableRow((name, s.number(f"{path}.shortest"), trip, suits)))
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
