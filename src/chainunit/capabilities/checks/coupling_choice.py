"""The flexible coupling of a study among those of its catalogues: each is tried in the study's own cycle, with its
own stiffness, damping and inertia, and the cheapest that carries it is chosen."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import replace

from ...core.errors import InputError, near_name, shown
from ...core.quantities import quantity, variables
from ...drives.catalogue_flexible import CatalogueFlexible, FlexibleCouplingData, FlexibleCouplingValues
from ...reading.results import OWN, derived, part, result
from ...reading.text import number
from .row import CheckRow
from .tables import FlexibleCouplingTable

OF_ROW = tuple(v.name for v in variables(FlexibleCouplingValues))
"""The values of [flexible_coupling] that each coupling of a catalogue has."""
CHOSEN, FITS, REJECTED, NEAREST = "chosen", "fits", "rejected", "nearest"
"""The verdicts on a coupling of a catalogue."""
_TABLE = "flexible_coupling"


@result
class CandidateCheck:
    """A check of a coupling that was tried."""

    title: str = part("the checked quantity")
    value: float = part("its value", unit=OWN)
    limit: float = part("its limit", unit=OWN)
    unit: str = "1"
    kind: str = ""

    @derived("1", "used")
    def utilisation(self) -> float:
        """value/limit."""
        return self.value / self.limit

    @property
    def words(self) -> str:
        """The check in words."""
        value, limit = (number(x, self.unit, self.kind) for x in (self.value, self.limit))
        share = number(self.utilisation, "1", "used")
        return f"{self.title} {value}, {share} of the permitted {limit}"


@result
class CouplingCandidate:
    """A flexible coupling of a catalogue, tried in the cycle of the study."""

    designation: str = part("its designation")
    order_number: str = part("its order number; empty where the catalogue gives none")
    price: float | None = quantity("1", "its price; none where the catalogue gives none")
    source: str = part("the source of its values")
    rated_torque: float = quantity("N.m", "its rated torque TKN")
    stiffness: float = quantity("N.m/rad", "its dynamic torsional stiffness CTdyn")
    damping: float = quantity("1", "its relative damping psi")
    J: float = quantity("kg.m2", "its inertia; 0: unknown")
    checks: tuple[CandidateCheck, ...] = part("its checks")
    verdict: str = part(f"{CHOSEN}, {FITS}, {REJECTED}, or {NEAREST} where none fits", default="")
    reason: str = part("the reason of the verdict", default="")

    @property
    def hardest(self) -> CandidateCheck:
        """The check of whose limit it uses the largest share."""
        return max(self.checks, key=lambda check: check.utilisation)

    @property
    def fits(self) -> bool:
        """Whether it keeps each limit."""
        return self.hardest.utilisation <= 1.0


def with_row(table: FlexibleCouplingTable, sold: CatalogueFlexible) -> FlexibleCouplingTable:
    """The `table` of a study file with the values of a row of a catalogue."""
    return replace(table, **{name: getattr(sold.data, name) for name in OF_ROW})


def tried(
    couplings: Sequence[CatalogueFlexible],
    table: FlexibleCouplingTable,
    rows_of: Callable[[FlexibleCouplingTable], Iterable[CheckRow]],
    name: str = "",
) -> list[CouplingCandidate]:
    """The `couplings` of a catalogue, the one to take first.

    Parameters
    ----------
    table : the table of the study file; each coupling is tried with its factors
    rows_of : the checks of a coupling with that table
    name : designation of the coupling that the file names; empty where it leaves the choice
    """
    candidates = [_candidate(coupling, rows_of(with_row(table, coupling))) for coupling in couplings]
    candidates.sort(key=lambda candidate: (candidate.designation != name, *_order(candidate)))
    return [_judged(candidate, candidates[0], name) for candidate in candidates]


def _candidate(sold: CatalogueFlexible, rows: Iterable[CheckRow]) -> CouplingCandidate:
    data: FlexibleCouplingData = sold.data
    return CouplingCandidate(
        sold.designation,
        sold.order_number,
        sold.price,
        sold.source,
        rated_torque=float(data.rated_torque),
        stiffness=float(data.stiffness),
        damping=float(data.damping),
        J=float(data.J),
        checks=tuple(
            CandidateCheck(row.title, row.value, row.limit, row.unit, row.kind)
            for row in rows
            if row.value is not None
        ),
    )


def _order(candidate: CouplingCandidate) -> tuple[bool, float, float, str]:
    """The cheapest that fits comes first, one without a price behind those with one; where none fits, the one that
    uses the smallest share of its limits."""
    if not candidate.fits:
        return True, candidate.hardest.utilisation, candidate.rated_torque, candidate.designation
    return False, candidate.price or math.inf, candidate.rated_torque, candidate.designation


def _judged(candidate: CouplingCandidate, best: CouplingCandidate, name: str) -> CouplingCandidate:
    if candidate is best:
        if name:
            reason = f"named by the study file; {candidate.hardest.words}"
            return replace(candidate, verdict=CHOSEN if candidate.fits else REJECTED, reason=reason)
        if not candidate.fits:
            return replace(candidate, verdict=NEAREST, reason=f"no coupling fits; {candidate.hardest.words}")
        first = (
            "the cheapest that fits"
            if candidate.price is not None
            else "the smallest that fits, without a price"
        )
        return replace(candidate, verdict=CHOSEN, reason=f"{first}; {candidate.hardest.words}")
    if not candidate.fits:
        return replace(candidate, verdict=REJECTED, reason=candidate.hardest.words)
    if name:
        return replace(candidate, verdict=FITS, reason="the study file names another one")
    if candidate.price is None:
        return replace(candidate, verdict=FITS, reason="has no price")
    dearer = (
        f"dearer: {candidate.price:.10g}" if candidate.price != best.price else "larger, at the same price"
    )
    return replace(candidate, verdict=FITS, reason=dearer)


def coupling_faults(
    couplings: Sequence[CatalogueFlexible], name: str, keys: Collection[str]
) -> Iterator[InputError]:
    """Refusals of a designation that none of the `couplings` of the catalogues has, and beside them of those values
    of a row whose `keys` the file gives."""
    designations = [coupling.designation for coupling in couplings]
    key = f"{_TABLE}.designation"
    if name and name not in designations:
        reason = (
            f"must be one of {', '.join(designations[:5])}"
            if designations
            else "no catalogue has flexible couplings"
        )
        near = near_name(name, designations)
        yield InputError(f"{key} = {shown(name)}: not in the catalogue; {reason}{near}", key)
    for column in OF_ROW if designations else ():
        if (full_key := f"{_TABLE}.{column}") in keys:
            reason = "each flexible coupling of the catalogue has its own; leave it out"
            yield InputError(f"{full_key}: {reason}", full_key)
