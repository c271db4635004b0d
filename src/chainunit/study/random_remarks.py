"""Remarks on random overloads."""

from __future__ import annotations

from ..work.store import made_anew
from .limits import limit_reached
from .record import StudyRecord

_OUTCOMES = {
    "trips": "in {share} of them the safety coupling opens",
    "stalls": "in {share} of them the crank stands at the end",
}
"""By quantity of a random run, the words on the share of the runs that end so."""


def remark_on_random_overloads(study: StudyRecord) -> None:
    """Warn of runs that end badly, and note what limits the numbers."""
    random, note = study.monte_carlo, study.note
    shares = random.quantiles() if random else {}
    for name, words in _OUTCOMES.items():
        share = shares.get(name, {}).get("share")
        if share is not None and share.value > 0.0:
            study.warn(
                f"random overload {name}",
                f"overloads at random: {words}.",
                share=(share.value, "1", "percent"),
            )
    if random and random.remark:
        note("too few runs", "overloads at random: {text}", text=random.remark)
    currents = [each.value for each in shares.get("current_peak", {}).values()]
    limit = limit_reached(study.drive, currents)
    if limit is not None:
        note(
            "random overloads at current limit",
            "overloads at random: the largest currents are at their limit of {limit}; a harder overload does not "
            "raise them.",
            limit=(limit, "A"),
        )
    if random and random.damaged_batches:
        note(
            "runs made anew",
            "overloads at random: {text}.",
            text=made_anew(random.damaged_batches, "runs", random.file.name),
        )
