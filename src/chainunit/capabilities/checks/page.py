"""The section on the checks: a row for each, with its clause and formula, and what was not checked."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from ...reading.text import number as number_words
from ...report import blocks as b
from ...report.cited import cited, exact, number, table
from ...report.lines import Line, filled, join, line
from ...study.record import StudyRecord
from ...study.relay import TRIPS_AT
from .analysis import CheckFindings
from .coupling import CHOSEN, CouplingCandidate
from .row import CheckRow

PATH = "findings.checks"
"""Place of the checks in the result of a study."""


def blocks(study: StudyRecord) -> Iterator[b.Block]:
    """The tables of the checks: with all that stands behind each, with a line each, and for a sheet with a line each
    and behind them each clause and formula once, by its number in the table."""
    findings = CheckFindings.of_study(study.findings)
    rows, coupling = findings.rows, findings.flexible_coupling
    if not rows:
        return
    if coupling is not None and coupling.candidates:
        x = cited(coupling, f"{PATH}.flexible_coupling").candidates
        yield _coupling_to_order(coupling.candidates, x[0])
    lead = (
        "Each row is a check by the clause or source {place}: the value of the run, the limit, and the share "
        "of the limit that is used. A check passes at 100 % use at most. docs/checks.md has each formula "
        "with its simplifications and an example."
    )
    if study.setup.proposal is not None:
        lead += (
            " These values come from the simulated runs, the shares of limits in the answer from the duty of "
            f"{study.setup.proposal.name} (worst start, margins). They may differ."
        )
    yield b.Text(lead.format(place="under it"), "lead", "long")
    yield b.Text(lead.format(place="whose number stands behind it"), "lead", "sheet")
    heads = b.heads("check", "value", "limit", "used")
    title = "Checks by clause"
    pairs = list(zip(rows, cited(findings, PATH).rows, strict=True))
    noted = tuple(b.TableRow(_cells(row, x), _note(row, x)) for row, x in pairs)
    yield b.Table(noted, heads, title=title, note_title="clause, formula, numbers", form="long")
    laws = dict.fromkeys((row.clause, row.formula) for row in rows)
    places = {law: f"[{place}]" for place, law in enumerate(laws, 1)}
    by_place = tuple(b.TableRow((*_cells(row, x), places[row.clause, row.formula])) for row, x in pairs)
    used = b.Column("used", of_text=True)
    yield b.Table(by_place, (*heads[:3], used, *b.heads("by")), title=title, form="sheet")
    for (clause, formula), place in places.items():
        yield b.Text(f"{place} {clause}. {formula}", "note", "sheet")
    if coupling is not None and coupling.candidates:
        x = cited(coupling, f"{PATH}.flexible_coupling").candidates
        yield _tried_couplings(coupling.candidates, x)
    short = tuple(b.TableRow(_cells(row, x)) for row, x in pairs)
    yield b.Table(short, heads, title=title, form="short")


def _cells(row: CheckRow, x: CheckRow) -> tuple[b.Cell, ...]:
    """A check, cited as `x`, in a line: its title, its value, its limit and the used share."""
    limit = line("at least " if row.at_least else "at most ", number(x.limit))
    # of a check that fails, a number that the result does not have is not finite
    value, used = ("-", "-") if row.holds else ("never", number_words(math.inf, "1", "used"))
    share = b.Share(number(x.utilisation, over=not row.holds, none=used))
    return (
        line(x.of, ": ", x.title),
        number(cited(row.size, f"findings.{row.number}"), none=value),
        limit,
        share,
    )


def _note(row: CheckRow, x: CheckRow) -> Line:
    """Clause, formula, and the numbers of the formula."""
    numbers = join([line(f"{symbol} = ", number(cited(*size))) for symbol, size in row.letters.items()])
    law = filled("{}. {}", x.clause, x.formula)
    return line(law, " (", numbers, ")") if numbers else law


def _coupling_to_order(candidates: Sequence[CouplingCandidate], x: CouplingCandidate) -> b.Text:
    """The flexible coupling of the catalogues that is checked, cited as `x`."""
    best = candidates[0]
    data = map(exact, (x.rated_torque, x.stiffness, x.damping))
    parts = [
        line(x.designation),
        *([line("order number ", x.order_number)] if best.order_number else []),
        *([line("price ", exact(x.price, 10))] if best.price is not None else []),
        filled("TKN {}, CTdyn {}, psi {}", *data),
    ]
    begin = "Flexible coupling to order" if best.verdict == CHOSEN else "Flexible coupling that does not fit"
    count = (
        f"{sum(candidate.fits for candidate in candidates)} of the {len(candidates)} of the catalogues fit"
    )
    return b.Text(filled(f"{begin}: {{}}: {{}} ({count}).", join(parts), x.reason))


def _tried_couplings(candidates: Sequence[CouplingCandidate], x: Sequence[CouplingCandidate]) -> b.Table:
    """The flexible couplings of the catalogues, cited as `x`."""
    rows = []
    for candidate, shown in zip(candidates, x, strict=True):
        hardest = shown.checks[candidate.checks.index(candidate.hardest)]
        share, price = number(hardest.utilisation, over=not candidate.fits), exact(shown.price, none="-")
        texts = shown.order_number, shown.reason
        rows.append(b.TableRow((shown.designation, shown.verdict, share, price, *texts)))
    heads = b.heads("flexible coupling", "verdict", "largest share", "price", "order number", "reason")
    title = "Flexible couplings of the catalogues"
    return b.Table(tuple(rows), heads, numeric=False, title=title, form="long")


def missing(study: StudyRecord) -> Iterator[b.Block]:
    """What was not checked, and why."""
    return table(
        cited(CheckFindings.of_study(study.findings), PATH).not_checked,
        ("not checked", lambda row: row.what),
        ("why", lambda row: row.why),
        numeric=False,
        form="long",
    )


def relay(study: StudyRecord) -> Iterator[b.Block]:
    """The classes of the relay, beside the start and the stall of the motor; nothing where no relay is checked."""
    relay = CheckFindings.of_study(study.findings).relay
    if relay is None:
        return
    never = "trips in running" if relay.before >= TRIPS_AT * relay.setting else "never"
    x = cited(relay, f"{PATH}.relay")
    heat = (
        "The start heats a relay as much as 7.2 times its setting of {} does in {}; the rotor may be locked for {}. "
        "A cold relay surely holds up to the least trip time of its class, and the slowest relay of the class has to "
        "trip before that time. The tolerance of IEC 60034-1 permits a motor 20 % more current, with 1.44 times the "
        "heat of a start."
    )
    lead = filled(heat, number(x.setting), number(x.start_seconds), number(x.stall_time))
    yield b.Text(lead, "lead", "long")
    yield from table(
        x.classes.items(),
        ("class", lambda row: row[0]),
        ("holds up to", lambda row: number(row[1].shortest)),
        ("trips with the rotor locked", lambda row: number(row[1].stall_trip, none=never)),
        (
            "lets the start through, and protects",
            lambda row: "yes" if row[0] in relay.suitable else "no",
        ),
        form="long",
    )
