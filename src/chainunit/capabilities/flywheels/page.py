"""The section on flywheels: a row for each flywheel, a turn with each, the fluctuation of speed over the inertia."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...core.quantities import Layout
from ...reading.text import number as number_words
from ...report import blocks as b
from ...report import figure as fig
from ...report.analyses import angle_axis, last_turn
from ...report.cited import cited, exact, number
from ...report.given_numbers import motor_title, rating, ratio
from ...report.lines import capital, filled, join, line
from ...report.style import LINES
from ...study.readings import crank_motion
from ...study.record import StudyRecord, StudySetup
from .analysis import FlywheelFindings
from .wheel import FlywheelAnswers, Wheel

PATH = "findings.flywheels"
"""Place of the flywheels in the result of a study."""
PICTURE = "flywheel.png"
_HEADS = {
    "start_time": "start",
    "speed_ripple": "ripple",
    "motor_ripple": "at motor",
    "by_hand": "by hand",
    "motor_torque_peak": "torque, peak",
    "current_rms": "current, RMS",
    "current_share": "of rated",
    "stored_share_most": "lent to a cut",
}
"""The columns with their heads on a terminal; result.json has further numbers."""


def blocks(study: StudyRecord) -> Iterator[b.Block]:
    """The table and the figure of the flywheels."""
    findings = FlywheelFindings.of_study(study.findings)
    if study.setup.config.plate is not None:
        x = rating(study.setup.config.plate)
        sizes = map(number, (x.rated_power, x.rated_speed, x.rated_torque, x.rated_current))
        motor = motor_title(study.setup), join(sizes), number(ratio(study.setup), 4)
        yield b.Text(filled("Motor: {}, rated {}; ratio {}.", *motor))
    if findings.wheels:
        yield _table(study.setup, findings)
        if findings.is_retuned:
            yield b.Text(
                "The gains of the speed control are tuned to the inertia with each flywheel, except gains that the "
                "file gives: the runs compare drives as they would be commissioned.",
                "note",
            )
    running = [wheel for _, wheel, _ in findings.rows if wheel.answers.speed_ripple is not None]
    if running:
        yield _figure(study.setup, findings, running)


def _table(setup: StudySetup, findings: FlywheelFindings) -> b.Table:
    """A row for each flywheel, with the answers that any of them has."""
    x = cited(findings, PATH)
    all_answers = [wheel.answers for _, wheel, _ in findings.rows]
    columns = [
        v
        for v in Layout(FlywheelAnswers).variables
        if v.name in _HEADS and any(getattr(answers, v.name) is not None for answers in all_answers)
    ]
    rows = []
    for remark, wheel, path in findings.rows:
        answers = cited(wheel.answers, path)
        numbers = (number(getattr(answers, v.name), none="-") for v in columns)
        rows.append(b.TableRow((line(number(answers.flywheel), f" ({remark})" if remark else ""), *numbers)))
    heads = (b.Column(v.described(setup.driver_noun), _HEADS[v.name]) for v in columns)
    shaft = setup.drive.flywheel_shaft.words(setup.driver_noun)
    title = f"Flywheels on the {shaft}; permitted ripple of the speed "
    return b.Table(
        tuple(rows), (b.Column("flywheel"), *heads), title=line(title, exact(x.permitted_fluctuation))
    )


def _figure(setup: StudySetup, findings: FlywheelFindings, running: list[Wheel]) -> fig.Figure:
    """Speed, torque and current over the last turn with each flywheel, and the ripple over the inertia."""
    drive, plate = setup.drive, setup.config.plate
    # at most as many flywheels as there are distinct looks of a line, from the least to the largest
    count = min(len(running), len(LINES))
    wheels = [running[round(k)] for k in np.linspace(0, len(running) - 1, count)]
    speed = fig.Axis(f"{setup.driver_noun} speed", "rad/s", "speed")
    torque, current = fig.Axis("motor torque, air gap", "N.m"), fig.Axis("motor current", "A")
    items: dict[fig.Axis, list[fig.Item]] = {speed: [], torque: [], current: []}
    if plate is not None:
        items[torque].append(fig.Mark(plate.nameplate.torque, "rated", axis="y", look="reference"))
        items[current].append(fig.Mark(plate.nameplate.rated_current, "rated", axis="y", look="reference"))
    for look, wheel in enumerate(wheels):
        run = wheel.turns
        angle, w = crank_motion(drive, run)
        series = {
            speed: w,
            torque: run["motor.air_gap_tau"].values,
            current: run[f"motor.{drive.motor.current}"].values,
        }
        for axis, y in series.items():
            items[axis].append(fig.Curve(number_words(wheel.flywheel, "kg.m2"), *last_turn(angle, y), look))
    panels = [fig.Panel(angle_axis(setup), axis, tuple(curves)) for axis, curves in items.items()]
    return fig.Figure(
        "flywheel",
        "A turn with each flywheel, and the ripple of the speed over the inertia",
        f"{capital(setup.driver_noun)} speed, motor torque and current over a turn with each flywheel; ripple of the "
        "speed over inertia.",
        ((panels[0], panels[1]), (panels[2], _ripple(findings, running))),
        file=PICTURE,
        heights=(1.3, 1.3),
    )


def _ripple(findings: FlywheelFindings, running: list[Wheel]) -> fig.Panel | None:
    """The ripple of the speed over the inertia on the motor's shaft; None of a load that causes none."""
    inertia = np.array([wheel.answers.inertia for wheel in running])
    sizes = [wheel.answers.speed_ripple for wheel in running]
    most = 1.3 * max(inertia[-1], findings.inertia(findings.flywheel_by_hand))
    ends = np.array([min(inertia[0], findings.bare), most])
    by_hand = [findings.by_hand((J - findings.bare) * findings.ratio**2) for J in ends]
    if min(*sizes, *by_hand) <= 0.0:
        return None
    items: list[fig.Item] = [
        fig.Curve("by hand, dE/(J w2)", ends, by_hand, 1),
        fig.Curve("co-simulated", inertia, sizes, marker="o"),
        fig.Mark(findings.permitted_fluctuation, "permitted", axis="y", look=3),
    ]
    if findings.least in running:
        a = findings.least.answers
        items.append(fig.Curve("least flywheel", [a.inertia], [a.speed_ripple], marker="s", has_line=False))
    low, high = 0.7 * min(*sizes, findings.permitted_fluctuation), min(2.0, 1.5 * max(by_hand))
    y = fig.Axis("ripple of the speed", "1", "percent", low=low, high=high, log=True)
    x = fig.Axis("inertia on the motor's shaft", "kg.m2", log=True)
    return fig.Panel(x, y, tuple(items), "Ripple over inertia")
