"""The inverter to order: the least rated current that carries running, every start and every event."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from ..reading.text import number
from .record import StudyRecord
from .start_runs import OVERLOADED
from .starts import StartFindings
from .verdict import STEADY


@dataclass(frozen=True)
class InverterNeed:
    """The least rated current [A] of an inverter; the `case` that decides, in words; and the peaks of the current of
    the motor, by case [A]."""

    current: float
    case: str
    peaks: Mapping[str, float]


def need_of(
    rated: float, rms: float | None, lasting: Iterable[float], peaks: Mapping[str, float], overload: float
) -> InverterNeed:
    """The inverter for a motor of that `rated` current, all in A: with the `rms` current of running, the `lasting`
    ones that a start exceeds for `OVERLOADED`, and the `peaks` of running, starts and events by case.

    It carries `overload` times its rated current for up to that time: its own is at least that of the motor, the RMS,
    each lasting one, and each peak over that factor."""
    needs = {"the rated current of the motor": rated}
    if rms is not None:
        needs["the RMS current of running"] = rms
    needs[f"a start of more than {OVERLOADED:g} s"] = max(lasting, default=0.0)
    needs |= {case: peak / overload for case, peak in peaks.items()}
    case = max(needs, key=lambda case: needs[case])
    return InverterNeed(needs[case], case, peaks)


def inverter_need(study: StudyRecord) -> InverterNeed | None:
    """The inverter of a study, by its runs, or by the runs of the choice of the drive if these need more; None on the
    line. An overload that opens a recommended torque limiter counts until the limiter opens."""
    setup, runs = study.setup, study.runs
    rated, overload = setup.drive.rated_current, setup.config.drive.starter.overload
    if rated is None or setup.config.drive.start != "inverter":
        return None
    peaks: dict[str, float] = {}
    until_trip = study.currents_until_trip
    for name, answers in (("start_up", runs.start), *runs.answers.items()):
        if answers and answers.current_peak is not None:
            limiter = ", with the torque limiter" if name in until_trip else ""
            peaks[runs.title_of(name) + limiter] = until_trip.get(name, answers.current_peak)
    lasting: list[float] = []
    if starts := StartFindings.found_in(study.findings):
        worst = max(starts.starts, key=lambda start: start.current)
        peaks[f"a start from {number(worst.angle, 'rad')}"] = worst.current
        lasting = [start.long_current for start in starts.starts]
    steady = study.runs.answers.get(STEADY)
    need = need_of(rated, None if steady is None else steady.current_rms, lasting, peaks, overload)
    of_choice = None if setup.proposal is None else setup.proposal.inverter_current
    if of_choice is None or of_choice <= need.current:
        return need
    return replace(need, current=of_choice, case="the runs of the choice")
