"""The section on the duty with one inertia: the numbers with each model of the load, the events, the drive that would
have been chosen, and a turn."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from ...core.quantities import Layout
from ...report import blocks as b
from ...report import figure as fig
from ...report.lines import Line
from ...report.turn import angle_axis, last_turn
from ...study.drive import Drive
from ...study.readings import crank_motion
from ...study.record import StudyRecord
from ...study.torques import gear_torque
from .analysis import ALIKE, StaticInertiaFindings
from .runs import DutyNumbers, EventNumbers
from .words import trial_words

if TYPE_CHECKING:
    import xarray as xr

PICTURE = "static_inertia.png"
_MODELS = ("static", "with_terms")
_ROOT = "static_inertia"
_SHORT = (
    "gear_torque_peak",
    "gear_torque_rms",
    "motor_torque_rms",
    "current_rms",
    "winding_temperature",
    "start_time",
)
"""The rows of a terminal; the page has all."""


def answer(s: b.Source, study: StudyRecord) -> Iterator[b.Block]:
    """A line if the RMS torque is not that of the machine, and the file gives the motor, or the same one is chosen;
    another drive has a warning."""
    findings = StaticInertiaFindings.found_in(study)
    if findings is None or abs(findings.deviations["static"]["gear_torque_rms"]) <= ALIKE:
        return
    choice = findings.choice
    if choice is not None and choice.differs:
        return
    static = "{static_inertia.static.gear_torque_rms}"
    machine = "{static_inertia.machine.gear_torque_rms}"
    if choice is None:
        words = f"A constant-inertia calculation takes RMS {static} instead of {machine} at the output of the gear."
    else:
        words = (
            f"A constant-inertia calculation would have chosen {{motor}} (RMS {static} instead of {machine})."
        )
    yield b.Text(s.line(words, motor="" if choice is None else choice.static.motor))


def blocks(s: b.Source, study: StudyRecord) -> Iterator[b.Block]:
    """Lead, tables and figure; nothing where nothing differs."""
    findings = StaticInertiaFindings.of_study(study)
    if not findings.differs:
        return
    yield b.Text(
        s.line(
            "Sizing programs of drive makers know no crank: they take a torque over the turn and the inertia of the "
            "load as one number. Here this drive runs with the same weights, processing and friction and the mean "
            "inertia {static_inertia.inertia.mean}; the inertia of the machine goes from "
            "{static_inertia.inertia.least} to {static_inertia.inertia.largest} at the {driver}. The torque of the "
            "load is without terms of inertia, or has the terms at a constant speed of {static_inertia.speed:4}."
        ),
        "lead",
        "long",
    )
    yield _numbers(s, findings)
    yield b.Text(
        s.line(
            "RMS torque at the {driver} over a turn at constant speed, without a motor: "
            "{static_inertia.constant_speed.static} without the terms of inertia, "
            "{static_inertia.constant_speed.machine} with them. Energy residual of start-up and steady running "
            "with one inertia: at most {static_inertia.residual} of the energy moved."
        ),
        "note",
        "long",
    )
    if findings.events:
        yield _events(s, study, findings)
    yield from _choice(s, findings)
    yield _figure(study, findings)


def _numbers(s: b.Source, findings: StaticInertiaFindings) -> b.Table:
    rows = []
    for v in Layout(DutyNumbers).variables:
        if getattr(findings.machine.numbers, v.name) is None:
            continue
        cells: list[Line] = [v.described(s.driver), s.number(f"{_ROOT}.machine.{v.name}")]
        for model in _MODELS:
            cells.append(s.number(f"{_ROOT}.{model}.{v.name}", none="-"))
            cells.append(_deviation(s, findings, model, v.name))
        rows.append(b.TableRow(tuple(cells), form="both" if v.name in _SHORT else "long"))
    heads = (
        b.Column("steady running and start"),
        b.Column("J over the angle"),
        b.Column("one J, without terms of inertia", "one J"),
        b.Column("deviation"),
        b.Column("one J, with terms at constant speed", "with terms"),
        b.Column("deviation"),
    )
    return b.Table(
        tuple(rows), heads, title="The same duty with one inertia; gear torque: at the output of the gear"
    )


def _deviation(s: b.Source, findings: StaticInertiaFindings, model: str, name: str) -> Line:
    if name not in findings.deviations[model]:
        return "-"
    return s.number(f"{_ROOT}.deviations.{model}.{name}")


def _events(s: b.Source, study: StudyRecord, findings: StaticInertiaFindings) -> b.Table:
    columns = Layout(EventNumbers).variables
    rows = (
        b.TableRow(
            (
                study.title_of(name),
                *(
                    s.number(f"{_ROOT}.events.{name}.{of}.{v.name}")
                    for v in columns
                    for of in ("machine", "static")
                ),
            )
        )
        for name in findings.events
    )
    titles = (f"{v.description}: {words}" for v in columns for words in ("J over the angle", "one J"))
    return b.Table(tuple(rows), b.heads("event", *titles), title="Events with one inertia", form="long")


def _choice(s: b.Source, findings: StaticInertiaFindings) -> Iterator[b.Block]:
    choice = findings.choice
    if choice is None:
        return
    rows = (
        b.TableRow(
            (
                words,
                s.words(f"{_ROOT}.choice.{of}.motor"),
                s.number(f"{_ROOT}.choice.{of}.ratio"),
                s.number(f"{_ROOT}.choice.{of}.flywheel") if each.flywheel else "none",
                s.words(f"{_ROOT}.choice.{of}.answer"),
            )
        )
        for of, each, words in (
            ("own", choice.own, "J over the angle"),
            ("static", choice.static, "one J"),
        )
    )
    heads = b.heads("inertia", "motor", "ratio", "flywheel", "choice")
    title = "The drive that the same search chooses"
    yield b.Table(tuple(rows), heads, title=title, numeric=False, form="long")
    if not choice.differs:
        yield b.Text("Both choose the same drive.", "note", "long")
        return
    yield b.Text(trial_words(choice), "note", "long")
    columns = (
        ("checks", choice.checks, choice.missed),
        ("own_checks", choice.own_checks, choice.own_missed),
    )
    checks = []
    for name in {**choice.checks, **choice.own_checks}:
        of = "checks" if name in choice.checks else "own_checks"
        cells = (
            s.check(f"{_ROOT}.choice.{key}.{name}", name in missed) if name in its else "-"
            for key, its, missed in columns
        )
        checks.append(b.TableRow((s.words(f"{_ROOT}.choice.{of}.{name}.title"), *cells)))
    heads = b.heads(
        "share of each limit that is used",
        s.line("{static_inertia.choice.static.motor} in the machine"),
        s.line("{static_inertia.choice.own.motor} with one J"),
    )
    yield b.Table(tuple(checks), heads, title="Each drive by the other inertia", form="long")


def _figure(study: StudyRecord, findings: StaticInertiaFindings) -> fig.Figure:
    runs = findings.runs
    models: list[tuple[str, Drive, xr.Dataset]] = [
        ("J over the angle", study.drive, study.steady),
        ("one J, without terms of inertia", runs.drive, runs.turns),
        ("one J, with terms at constant speed", runs.drive, runs.turns_with_terms),
    ]
    torque: list[fig.Item] = []
    speed: list[fig.Item] = []
    for look, (name, drive, run) in enumerate(models):
        angle, w = crank_motion(drive, run)
        torque.append(fig.Curve(name, *last_turn(angle, gear_torque(drive, run)), look))
        speed.append(fig.Curve(name, *last_turn(angle, w), look, in_legend=False))
    x = angle_axis(study)
    return fig.Figure(
        "static-inertia",
        "A turn with the inertia over the angle, and with one inertia",
        f"Torque at the output of the gear and speed over the {study.driver_noun} angle with each model of the load.",
        (
            (fig.Panel(x, fig.Axis("torque at the output of the gear", "N.m"), tuple(torque)),),
            (fig.Panel(x, fig.Axis(f"{study.driver_noun} speed", "rad/s", "speed"), tuple(speed)),),
        ),
        file=PICTURE,
        heights=(1.3, 0.9),
    )
