"""The section on starts from several crank angles."""

from __future__ import annotations

from collections.abc import Iterator

from ..core.descriptions import of_driver
from ..study.record import StudyRecord
from ..study.starts import StartFindings, transient_words
from ..study.torques import running_words
from . import blocks as b
from .cited import cited, number, table
from .lines import filled


def blocks(study: StudyRecord) -> Iterator[b.Block]:
    """The worst start in a sentence, and a table of all starts."""
    findings = StartFindings.found_in(study)
    if findings is None:
        return
    place = "output of the gear" if study.drive.is_geared else study.driver_noun
    x = cited(findings, "findings.starts")
    worst = of_driver(
        f"Start: load and acceleration load the {place} with up to {{}}, from {{a driver}} angle of {{}}: {{}} times "
        "{}, {}.",
        study.driver_noun,
    )
    running = running_words(study, findings.running_in), number(x.running)
    sizes = number(x.worst.quasi_static), number(x.worst.angle), number(x.over_running)
    text = filled(worst, *sizes, *running)
    if not study.drive.follows:
        text += filled(" The {}: {}.", transient_words(study), number(x.transient))
    yield b.Text(text)
    at_gear = "torque at the gear" if study.drive.is_geared else f"torque at the {study.driver_noun}"
    in_star = ("speed at the change to delta", lambda start: number(start.star_speed))
    yield from table(
        x.starts,
        (f"{study.driver_noun} angle", lambda start: number(start.angle)),
        (at_gear, lambda start: number(start.quasi_static, none="not reached")),
        ("with the transient", lambda start: number(start.gear_torque, none="not reached")),
        ("torque on a coupling", lambda start: number(start.coupling_torque, none="not reached")),
        ("start-up time", lambda start: number(start.start_time, none="not reached")),
        ("motor current, peak", lambda start: number(start.current)),
        *([in_star] if study.drive.star_delta is not None else []),
        title=f"Starts from rest, from several {study.driver_noun} angles",
        form="long",
    )
