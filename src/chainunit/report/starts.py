"""The section on starts from several crank angles."""

from __future__ import annotations

from collections.abc import Iterator

from ..study.event_torques import running_words
from ..study.record import StudyRecord
from ..study.starts import transient_words
from . import blocks as b


def blocks(s: b.Source, study: StudyRecord) -> Iterator[b.Block]:
    """The worst start in a sentence, and a table of all starts."""
    if "starts" not in s.result:
        return
    place = "output of the gear" if study.drive.is_geared else study.driver_noun
    worst = (
        f"Start: load and acceleration load the {place} with up to {{starts.worst.quasi_static}}, from "
        "{a driver} angle of {starts.worst.angle}: {starts.over_running} times {running}, {starts.running}."
    )
    running = running_words(study, s.result["starts"]["running_in"])
    transient = "" if study.drive.follows else f" The {transient_words(study)}: {{starts.transient}}."
    yield b.Text(s.line(worst + transient, running=running))
    count = len(s.result["starts"]["from"])
    names = ("angle", "quasi_static", "gear_torque", "coupling_torque", "start_time")
    rows = tuple(
        b.TableRow(tuple((s.number(f"starts.from.{k}.{name}", none="not reached"),) for name in names))
        for k in range(count)
    )
    columns = b.heads(
        f"{study.driver_noun} angle",
        "torque at the gear" if study.drive.is_geared else f"torque at the {study.driver_noun}",
        "with the transient",
        "torque on a coupling",
        "start-up time",
    )
    yield b.Table(
        rows, columns, title=f"Starts from rest, from several {study.driver_noun} angles", form="long"
    )
