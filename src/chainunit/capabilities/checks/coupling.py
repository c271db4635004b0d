"""A flexible coupling by DIN 740-2: rated, peak and alternating torque, and the passage through resonance.

The torque is that of the runs at the place of the coupling, where the shaft is rigid or as stiff as [driveline] says.
The coupling amplifies each part of it that swings: of a torque at one side of two inertias, the coupling carries the
share of the rigid shaft times V = (1 + j psi/2pi)/(1 - (f/fe)^2 + j psi/2pi).

Each coupling of a catalogue is tried in the study's own cycle, with its own stiffness, damping and inertia, and the
cheapest that carries it is chosen.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...core.quantities import Value, declaration, quantity
from ...drives.catalogue_flexible import CatalogueFlexible
from ...reading.results import OWN, derived, part, result
from ...reading.text import number
from ...study.arrays import Dataset
from ...study.drive import Drive
from ...study.readings import load_inertia, torque_before_gear
from ...study.record import StudyFindings, StudyRuns
from ...study.remark import note, warning
from ...study.torques import gear_torque
from ...study.window import mean
from .plan import CheckPlan
from .row import CheckRow, CheckRule, Checks
from .runs import largest
from .tables import OF_ROW, FlexibleCouplingTable

_TURN = 2.0 * math.pi
FREQUENCY = 10.0
"""Frequency [Hz] up to which the permitted alternating torque holds; above it the heat of the elastic part counts."""
START_FACTORS = ((120.0, 1.0), (240.0, 1.3))
"""Up to so many starts an hour, the start factor; beyond them the maker says it."""
CHOSEN, FITS, REJECTED, NEAREST = "chosen", "fits", "rejected", "nearest"
"""The verdicts on a coupling of a catalogue."""
_CLAUSE, _IMPACT = "DIN 740-2:1986", "TL = mean; SZ = factors.start; St = factors.temperature"
_RULES = (
    ("rated_torque", CheckRule(
        "rated torque", "rated", _CLAUSE, "TKN >= T St, T: RMS of steady running", "T = rms; St = factors.temperature"
    )),
    ("peak_torque", CheckRule(
        "peak torque ({run})", "peak", _CLAUSE, "TKmax >= (TL + (T - TL) SA SZ) St",
        f"T = largest; SA = factors.surge; {_IMPACT}",
    )),
    ("alternating_torque", CheckRule(
        "alternating torque", "alternating", _CLAUSE, "TKW >= half range of sum V(f) Sf(f) T(f), times St",
        "rigid = swinging.rigid; elastic = swinging.elastic; fe = swinging.natural_frequency; "
        "St = factors.temperature",
    )),
    ("peak_torque", CheckRule(
        "passage through resonance", "passage", _CLAUSE, "TKmax >= (TL + Ti VR SZ) St",
        f"Ti = swinging.passed; VR = factors.resonance; {_IMPACT}",
    )),
    ("largest_speed", CheckRule(
        "speed", "speed", "Limit of the maker of the coupling", "largest |w| of all runs <= permitted"
    )),
)  # fmt: skip
"""Each with the key of its limit."""


@declaration
class CouplingDuty:
    """The torque at the place of the coupling, and the two inertias."""

    mean: Value = quantity("N.m", "mean torque of steady running")
    rms: Value = quantity("N.m", "RMS torque of steady running")
    largest: Value = quantity("N.m", "largest torque of all runs, without the coupling's elasticity")
    drive_inertia: Value = quantity("kg.m2", "inertia on the side of the motor")
    load_inertia: Value = quantity("kg.m2", "mean inertia on the side of the machine")
    speed: Value = quantity(
        "rad/s", "largest speed of its shaft, of all runs", default=0.0, min=0.0, kind="speed"
    )


@declaration
class CouplingFactors:
    """The factors of the coupling."""

    temperature: Value = quantity("1", "temperature factor St")
    start: Value = quantity("1", "start factor SZ")
    surge: Value = quantity("1", "surge factor SA")
    resonance: Value = quantity("1", "resonance factor VR; none without damping")


@declaration
class Swinging:
    """The part of the torque that swings in steady running."""

    natural_frequency: Value = quantity("rad/s", "natural frequency of the two inertias", kind="frequency")
    rigid: Value = quantity("N.m", "half of its range with a rigid shaft")
    elastic: Value = quantity("N.m", "half of its range with the coupling")
    weighted: Value = quantity(
        "N.m", "half of its range with the coupling, each part above 10 Hz times the frequency factor"
    )
    passed: Value = quantity(
        "N.m", "largest part with a rigid shaft whose frequency passes the natural one in the start; 0: none"
    )


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


@result
class CouplingCheck(CouplingDuty):
    """A flexible coupling, and the torques that it has to carry, factors included."""

    place: str = part("shaft that it is on")
    run: str = part("the run with the largest torque")
    factors: CouplingFactors = part("factors")
    swinging: Swinging | None = part("the swinging torque; none without stiffness or damping", optional=True)
    rated: float = quantity("N.m", "rated torque that it needs")
    peak: float = quantity("N.m", "peak torque that it needs")
    alternating: float | None = quantity("N.m", "alternating torque that it needs")
    passage: float | None = quantity("N.m", "peak torque that it needs for the passage through resonance")
    candidates: tuple[CouplingCandidate, ...] = part(
        "the flexible couplings of the catalogues, first the one that is checked; none where the file has its own",
        default=(),
    )


def start_factor(starts: float) -> float | None:
    """The start factor by the `starts` an hour; None for more starts than the standard covers."""
    return next((factor for most, factor in START_FACTORS if starts <= most), None)


def amplification(frequency: Any, natural: float, damping: float) -> Any:
    """Complex ratio of the torque in the coupling to that of a rigid shaft, at a `frequency` beside the `natural` one
    (in one unit), with the relative `damping` psi."""
    loss = 1j * damping / _TURN
    return (1.0 + loss) / (1.0 - (np.asarray(frequency) / natural) ** 2 + loss)


def natural_frequency(stiffness: float, drive: float, load: float) -> float:
    """Natural frequency [rad/s] of two inertias [kg m2] on a shaft of that `stiffness` [N m/rad]."""
    return math.sqrt(stiffness * (1.0 / drive + 1.0 / load))


def swinging(time: Any, torque: Any, natural: float, damping: float) -> Swinging:
    """The swinging part of a `torque` [N m] over `time` [s], both of shape (n,), in steady running over whole turns,
    with the coupling of that `natural` frequency [rad/s] and relative `damping`."""
    span, count = float(time[-1] - time[0]), len(time)
    even = np.interp(time[0] + span * np.arange(count) / count, time, torque)
    parts = np.fft.rfft(even)
    parts[0] = 0.0
    frequency = np.arange(len(parts)) / span * _TURN
    elastic = parts * amplification(frequency, natural, damping)
    heating = np.sqrt(np.maximum(1.0, frequency / (_TURN * FREQUENCY)))
    above = np.abs(parts[frequency > natural])

    def half_range(spectrum: Any) -> float:
        return 0.5 * float(np.ptp(np.fft.irfft(spectrum, count)))

    return Swinging(
        natural_frequency=natural,
        rigid=half_range(parts),
        elastic=half_range(elastic),
        weighted=half_range(elastic * heating),
        passed=2.0 / count * float(np.max(above)) if len(above) else 0.0,
    )


def coupling_check(
    table: FlexibleCouplingTable,
    duty: CouplingDuty,
    time: Any,
    torque: Any,
    start: float,
    place: str = "motor",
    run: str = "",
) -> CouplingCheck:
    """The coupling of that `table`, half of whose inertia turns with either side, with the start factor `start`.
    `time` [s] and `torque` [N m] are those of steady running, of shape (n,); `run` has the largest torque."""
    swing, St = None, table.temperature_factor
    if table.stiffness and table.damping and duty.load_inertia > 0.0:
        inertias = (J + 0.5 * table.J for J in (duty.drive_inertia, duty.load_inertia))
        swing = swinging(time, torque, natural_frequency(table.stiffness, *inertias), table.damping)
    resonance = abs(complex(amplification(1.0, 1.0, table.damping))) if table.damping else 0.0
    steady = abs(duty.mean)
    surge = max(0.0, duty.largest - steady) * table.surge_factor
    return CouplingCheck(
        **vars(duty),
        place=place,
        run=run,
        factors=CouplingFactors(
            temperature=St, start=start, surge=table.surge_factor, resonance=resonance or None
        ),
        swinging=swing,
        rated=duty.rms * St,
        peak=(steady + surge * start) * St,
        alternating=swing.weighted * St if swing else None,
        passage=(steady + swing.passed * resonance * start) * St if swing else None,
    )


def check_coupling(checks: Checks, coupling: CouplingCheck, table: FlexibleCouplingTable, run: str) -> None:
    """Check a coupling; `run` is the title of the run with the largest torque."""
    for key, rule in _RULES:
        limit, lacking = getattr(table, key), key
        if limit and getattr(coupling, rule.value) is None:
            limit, lacking = None, "stiffness and damping"
        why = f"add [flexible_coupling] with {lacking}, by its maker"
        checks.check(rule, "coupling", "checks.flexible_coupling", coupling, limit, why, run=run)


def inertias(drive: Drive, turns: Dataset, is_on_crank: bool) -> tuple[float, float]:
    """Mean inertia before the coupling and behind it [kg m2], at its shaft. Behind a part that slips, wheels, pulleys
    and gear are before a coupling on the crank's shaft."""
    ratio, part = drive.ratio if is_on_crank else 1.0, drive.geared_line.before_gear
    before = drive.geared_line.up_to(part.name).at_motor(0.0) if is_on_crank and part else 0.0
    whole = float(np.mean(load_inertia(drive, turns)))
    return float(drive.fmu_parameters.rotor.J + before) * ratio**2, float(whole - before) * ratio**2


def find(runs: StudyRuns, plan: CheckPlan, checks: Checks) -> CouplingCheck | None:
    """The coupling of a study, and its `checks`. Of those of a catalogue it is the one that the file names, or the
    cheapest that carries the torque."""
    drive, turns, table, starts = runs.drive, runs.steady, plan.coupling, plan.starts_per_hour
    what, key = "flexible coupling", "flexible_coupling"
    if table is None:
        checks.lack(what, f"the file does not have one; add [{key}]", key)
        return None
    factor = table.start_factor or start_factor(starts)
    if factor is None:
        more = f"{starts:g} starts an hour are more than the 240 of the standard"
        checks.lack(what, f"{more}; add start_factor, by its maker")
        return None
    is_on_crank = plan.coupling_place == "crank"
    ratio = drive.ratio if is_on_crank else 1.0

    def torque_of(run: Dataset) -> Any:
        return gear_torque(drive, run) if is_on_crank else torque_before_gear(drive, run)

    before, behind = inertias(drive, turns, is_on_crank)
    torque, (most, run) = torque_of(turns), largest(runs, torque_of)
    duty = CouplingDuty(
        mean=mean(turns, torque),
        rms=math.sqrt(mean(turns, torque**2)),
        largest=most,
        drive_inertia=before,
        load_inertia=behind,
        speed=largest(runs, lambda run: run[drive.motor_speed].values)[0] / ratio,
    )

    def check(table: FlexibleCouplingTable, checks: Checks) -> CouplingCheck:
        """The coupling by its table; its rows go to the `checks`."""
        series = (turns["time"].values, torque)
        coupling = coupling_check(table, duty, *series, factor, plan.coupling_place, run)
        check_coupling(checks, coupling, table, runs.title_of(run))
        return coupling

    def rows_of(table: FlexibleCouplingTable) -> Sequence[CheckRow]:
        check(table, trial := Checks())
        return trial.rows

    candidates = tried(plan.couplings, table, rows_of, plan.coupling_name)
    for sold in plan.couplings:
        if sold.designation == candidates[0].designation:
            table = with_row(table, sold)
    return replace(check(table, checks), candidates=tuple(candidates))


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
    candidates = []
    for sold in couplings:
        rows = rows_of(with_row(table, sold))
        checks = [CandidateCheck(x.title, x.value or 0.0, x.limit, x.unit, x.kind) for x in rows]
        names = ("rated_torque", "stiffness", "damping", "J")
        data: dict[str, Any] = {name: float(getattr(sold.data, name)) for name in names}
        item = (sold.designation, sold.order_number, sold.price, sold.source)
        candidates.append(CouplingCandidate(*item, **data, checks=tuple(checks)))
    candidates.sort(key=lambda candidate: (candidate.designation != name, *_order(candidate)))
    return [_judged(candidate, candidates[0], name) for candidate in candidates]


def _order(candidate: CouplingCandidate) -> tuple[bool, float, float, str]:
    """The cheapest that fits comes first, one without a price behind those with one; where none fits, the one that
    uses the smallest share of its limits."""
    cost = candidate.price or math.inf if candidate.fits else candidate.hardest.utilisation
    return not candidate.fits, cost, candidate.rated_torque, candidate.designation


def _judged(candidate: CouplingCandidate, best: CouplingCandidate, name: str) -> CouplingCandidate:
    """A coupling of the catalogue with its verdict and the reason for it, beside the `best` one; `name` is the one
    that the file names, or empty."""
    hardest, price = candidate.hardest, candidate.price
    value, limit = (number(x, hardest.unit, hardest.kind) for x in (hardest.value, hardest.limit))
    share = f"{hardest.title} {value}, {number(hardest.utilisation, '1', 'used')} of the permitted {limit}"
    if candidate is best and name:
        verdict, reason = CHOSEN if candidate.fits else REJECTED, f"named by the study file; {share}"
    elif candidate is best and not candidate.fits:
        verdict, reason = NEAREST, f"no coupling fits; {share}"
    elif candidate is best:
        least = "cheapest that fits" if price is not None else "smallest that fits, without a price"
        verdict, reason = CHOSEN, f"the {least}; {share}"
    elif not candidate.fits:
        verdict, reason = REJECTED, share
    elif name:
        verdict, reason = FITS, "the study file names another one"
    elif price is None:
        verdict, reason = FITS, "has no price"
    else:
        dearer, equal = f"dearer: {price:.10g}", "larger, at the same price"
        verdict, reason = FITS, equal if price == best.price else dearer
    return replace(candidate, verdict=verdict, reason=reason)


def remark_on_coupling(findings: StudyFindings, coupling: CouplingCheck) -> None:
    """Warn where no coupling of the catalogues keeps each limit, or the named one does not; note how it was
    checked."""
    if coupling.candidates:
        best = coupling.candidates[0]
        if best.verdict != CHOSEN:
            findings.say(_TOO_WEAK, name=best.designation, reason=best.reason)
        findings.say(_CHECKED)


_TOO_WEAK = warning(
    "flexible-coupling-too-weak",
    "The flexible coupling {name} of the catalogues does not keep each limit: {reason}.",
)
_CHECKED = note(
    "flexible-coupling",
    "The flexible coupling is checked by the torque of a shaft without it, part by part of the frequencies with its "
    "own amplification (DIN 740-2). Its inertia counts in its natural frequency. It is not in the runs.",
)
