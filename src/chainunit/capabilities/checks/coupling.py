"""A flexible coupling by DIN 740-2: rated, peak and alternating torque, and the passage through resonance.

The torque is that of the runs at the place of the coupling, where the shaft is rigid or as stiff as [driveline] says.
The coupling amplifies each part of it that swings: of a torque at one side of two inertias, the coupling carries the
share of the rigid shaft times V = (1 + j psi/2pi)/(1 - (f/fe)^2 + j psi/2pi).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ...core.quantities import Value, declaration, quantity
from ...drives.catalogue_flexible import CatalogueFlexible
from ...reading.results import part, result
from ...study.readings import load_inertia
from ...study.record import StudyRecord
from ...study.remark import note, warning
from ...study.torques import gear_torque
from ...study.window import mean
from .coupling_choice import CHOSEN, CouplingCandidate, tried, with_row
from .row import CheckRow, CheckRule, NotChecked
from .runs import largest
from .tables import FlexibleCouplingTable

if TYPE_CHECKING:
    import xarray as xr

_CLAUSE = "DIN 740-2:1986"
_TURN = 2.0 * math.pi
FREQUENCY = 10.0
"""Frequency [Hz] up to which the permitted alternating torque holds; above it the heat of the elastic part counts."""
START_FACTORS = ((120.0, 1.0), (240.0, 1.3))
"""Up to so many starts an hour, the start factor; beyond them the maker says it."""


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
class CouplingCheck:
    """A flexible coupling, and the torques that it has to carry, factors included."""

    place: str = part("shaft that it is on")
    run: str = part("the run with the largest torque")
    duty: CouplingDuty = part(inline=True)
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
    """The start factor by the `starts` an hour; None beyond those of the standard."""
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
    return Swinging(
        natural_frequency=natural,
        **{
            name: 0.5 * float(np.ptp(np.fft.irfft(spectrum, count)))
            for name, spectrum in (("rigid", parts), ("elastic", elastic), ("weighted", elastic * heating))
        },
        passed=2.0 / count * float(np.max(above)) if len(above) else 0.0,
    )


def coupling_check(
    duty: CouplingDuty, factors: CouplingFactors, swing: Swinging | None, place: str = "motor", run: str = ""
) -> CouplingCheck:
    """The torques that a coupling needs."""
    steady, temperature = abs(duty.mean), factors.temperature
    surge = max(0.0, duty.largest - steady) * factors.surge
    return CouplingCheck(
        place=place,
        run=run,
        duty=duty,
        factors=factors,
        swinging=swing,
        rated=duty.rms * temperature,
        peak=(steady + surge * factors.start) * temperature,
        alternating=None if swing is None else swing.weighted * temperature,
        passage=None
        if swing is None
        else (steady + swing.passed * factors.resonance * factors.start) * temperature,
    )


_IMPACT = "TL = mean; SZ = factors.start; St = factors.temperature"
_RULES = {
    "rated_torque": CheckRule(
        "rated", "rated torque", _CLAUSE, "TKN >= T St, T: RMS of steady running", "T = rms; St = factors.temperature"
    ),
    "peak_torque": CheckRule(
        "peak", "peak torque ({run})", _CLAUSE, "TKmax >= (TL + (T - TL) SA SZ) St",
        f"T = largest; SA = factors.surge; {_IMPACT}",
    ),
    "alternating_torque": CheckRule(
        "alternating", "alternating torque", _CLAUSE, "TKW >= half range of sum V(f) Sf(f) T(f), times St",
        "rigid = swinging.rigid; elastic = swinging.elastic; fe = swinging.natural_frequency; "
        "St = factors.temperature",
    ),
}  # fmt: skip
"""By the key of the limit."""
_PASSAGE = CheckRule(
    "passage", "passage through resonance", _CLAUSE, "TKmax >= (TL + Ti VR SZ) St",
    f"Ti = swinging.passed; VR = factors.resonance; {_IMPACT}",
)  # fmt: skip


def coupling_rows(
    check: CouplingCheck, table: FlexibleCouplingTable, titles: Mapping[str, str]
) -> Iterator[CheckRow | NotChecked]:
    """The rows of a coupling; `titles` are those of runs."""
    run = titles.get(check.run, check.run)
    for key, rule in (*_RULES.items(), ("peak_torque", _PASSAGE)):
        lacking = key if not (limit := getattr(table, key)) else "stiffness and damping"
        if not limit or getattr(check, rule.value) is None:
            why = f"add [flexible_coupling] with {lacking}, by its maker"
            yield NotChecked(f"coupling, {rule.title.format(run=run)}", why)
        else:
            yield rule.row("coupling", "checks.flexible_coupling", check, limit, run)


@dataclass(frozen=True)
class _Cycle:
    """The torque [N m] of steady running over time [s], both of shape (n,), at the place of a coupling; its `duty`
    with the run of the largest torque, and the start factor."""

    time: Any
    torque: Any
    duty: CouplingDuty
    place: str
    run: str
    start: float

    def check(self, table: FlexibleCouplingTable) -> CouplingCheck:
        """The coupling of that table in this cycle. Half of its inertia turns with either side."""
        swing, duty = None, self.duty
        if table.stiffness and table.damping and duty.load_inertia > 0.0:
            inertias = (x + 0.5 * table.J for x in (duty.drive_inertia, duty.load_inertia))
            natural = natural_frequency(table.stiffness, *inertias)
            swing = swinging(self.time, self.torque, natural, table.damping)
        factors = CouplingFactors(
            temperature=table.temperature_factor,
            start=self.start,
            surge=table.surge_factor,
            resonance=abs(complex(amplification(1.0, 1.0, table.damping))) if table.damping else None,
        )
        return coupling_check(duty, factors, swing, self.place, self.run)


def _cycle(study: StudyRecord, place: str, start: float) -> _Cycle:
    """The cycle of a study at that place, with that start factor."""
    drive, turns = study.drive, study.steady

    def torque_of(run: xr.Dataset) -> Any:
        return gear_torque(drive, run) if place == "crank" else run[drive.motor_torque].values

    most, run = largest(study, torque_of)
    ratio = drive.ratio if place == "crank" else 1.0
    torque = torque_of(turns)
    duty = CouplingDuty(
        mean=mean(turns, torque),
        rms=math.sqrt(mean(turns, torque**2)),
        largest=most,
        drive_inertia=float(drive.fmu_parameters.rotor.J) * ratio**2,
        load_inertia=float(np.mean(load_inertia(drive, turns))) * ratio**2,
        speed=largest(study, lambda run: run[drive.motor_speed].values)[0] / ratio,
    )
    return _Cycle(turns["time"].values, torque, duty, place, run, start)


def remark_on_coupling(study: StudyRecord, check: CouplingCheck) -> None:
    """Warn where no coupling of the catalogues keeps each limit, or the named one does not; note how it was
    checked."""
    if not check.candidates:
        return
    best = check.candidates[0]
    if best.verdict != CHOSEN:
        study.say(_TOO_WEAK, name=best.designation, reason=best.reason)
    study.say(_CHECKED)


_TOO_WEAK = warning(
    "flexible-coupling-too-weak",
    "The flexible coupling {name} of the catalogues does not keep each limit: {reason}.",
)
_CHECKED = note(
    "flexible-coupling",
    "The flexible coupling is checked by the torque of a shaft without it, part by part of the frequencies with its "
    "own amplification (DIN 740-2). Its inertia counts in its natural frequency. It is not in the runs.",
)


def speed_row(check: CouplingCheck, table: FlexibleCouplingTable) -> CheckRow | NotChecked:
    """The check of the speed of a coupling."""
    if not table.largest_speed:
        return NotChecked("coupling, speed", "add [flexible_coupling] with largest_speed, by its maker")
    formula = "largest |w| of all runs <= permitted"
    rule = CheckRule("speed", "speed", "Limit of the maker of the coupling", formula)
    return rule.row("coupling", "checks.flexible_coupling", check.duty, table.largest_speed)


def find(
    study: StudyRecord,
    table: FlexibleCouplingTable | None,
    place: str,
    name: str,
    starts: float,
    couplings: Sequence[CatalogueFlexible] = (),
) -> tuple[CouplingCheck | None, list[CheckRow | NotChecked]]:
    """The coupling of a study, which makes so many `starts` an hour, and its checks, or the reason against them.
    Beside `couplings` of a catalogue it is the one with that `name`, or the cheapest that carries the torque."""
    if table is None:
        return None, [
            NotChecked(
                "flexible coupling",
                "the file does not have one; add [flexible_coupling]",
                "flexible_coupling",
            )
        ]
    factor = table.start_factor or start_factor(starts)
    if factor is None:
        why = (
            f"{starts:g} starts an hour are more than the 240 of the standard; add start_factor, by its maker"
        )
        return None, [NotChecked("flexible coupling", why)]
    cycle = _cycle(study, place, factor)

    def all_rows(trial: FlexibleCouplingTable) -> list[CheckRow | NotChecked]:
        check = cycle.check(trial)
        return [*coupling_rows(check, trial, study.titles), speed_row(check, trial)]

    candidates: list[CouplingCandidate] = []
    if couplings:

        def rows_of(trial: FlexibleCouplingTable) -> Iterator[CheckRow]:
            return (row for row in all_rows(trial) if isinstance(row, CheckRow))

        candidates = tried(couplings, table, rows_of, name)
        (sold,) = (coupling for coupling in couplings if coupling.designation == candidates[0].designation)
        table = with_row(table, sold)
    return replace(cycle.check(table), candidates=tuple(candidates)), all_rows(table)
