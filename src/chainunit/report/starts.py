"""The section on starts from several crank angles."""

from __future__ import annotations

from collections.abc import Iterator

from ..study.event_torques import running_words
from ..study.record import StudyRecord
from . import blocks as b


def blocks(s: b.Source, study: StudyRecord) -> Iterator[b.Block]:
    """The worst start in a sentence, and a table of all starts."""
    if "starts" not in s.result:
        return
    worst = (
        "Start: the largest torque on the output of the gear is {starts.worst.gear_torque}, from {a driver} angle of "
        "{starts.worst.angle}; {running} puts {starts.running} on it ({starts.over_running} times)."
    )
    yield b.Text(s.line(worst, running=running_words(study, s.result["starts"]["running_in"])))
    count = len(s.result["starts"]["from"])
    names = ("angle", "gear_torque", "coupling_torque", "start_time")
    rows = tuple(
        b.TableRow(tuple((s.number(f"starts.from.{k}.{name}", none="not reached"),) for name in names))
        for k in range(count)
    )
    columns = b.heads(
        f"{study.driver_noun} angle", "torque at the gear", "torque on a coupling", "start-up time"
    )
    yield b.Table(
        rows, columns, title=f"Starts from rest, from several {study.driver_noun} angles", form="long"
    )
