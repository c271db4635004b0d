"""The answers of a knife study: warnings and notes in words, and every number for a file."""

from __future__ import annotations

from typing import Any

from .. import __version__
from ..text import entries, number
from .flywheels import CLOSE
from .knife import RESIDUAL, START_LONG, START_LONGEST, STARTED, KnifeStudy
from .result import array_entry


def _kg_m2(inertia: float) -> str:
    return number(inertia, "kg.m2")


def _percent(share: float) -> str:
    return number(share, "1", "percent")


def _height(y: float) -> str:
    return number(y, "m", "millimetres", 4)


def warnings(study: KnifeStudy) -> list[str]:
    """In words and numbers, the changes that an engineer should make."""
    config, turn, stack = study.config, study.statics.turn, study.config.machine.stack
    lines = []
    if turn.blade_bottom > stack.top:
        lines.append(
            f"No cut takes place: the blade comes down to y = {_height(turn.blade_bottom)}, the stack's top is "
            f"at {_height(stack.top)}."
        )
    elif turn.blade_bottom > stack.table:
        lines.append(
            f"The blade does not reach the table: it comes down to y = {_height(turn.blade_bottom)}, the table "
            f"is at {_height(stack.table)}."
        )
    if turn.blade_top < stack.top:
        lines.append(
            f"The blade does not leave the stack: it rises to y = {_height(turn.blade_top)}, the stack's top is "
            f"at {_height(stack.top)}."
        )
    plate = config.motor.nameplate
    rated, mean = plate.rated_current, turn.torque_mean / config.machine.ratio
    if mean > plate.torque:
        lines.append(
            f"Cutting takes {number(mean, 'N.m')} of the motor on average, rated is "
            f"{number(plate.torque, 'N.m')}: a larger motor helps, no flywheel does."
        )
    for wheel in study.wheels:
        a, which = wheel.answers, f"With a flywheel of {_kg_m2(wheel.flywheel)}"
        if wheel.stalled:
            lines.append(
                f"{which} the motor stalls under the cut: a larger motor or flywheel, or less force."
            )
        elif a.start_time is None:
            lines.append(
                f"{which} the motor does not come to {_percent(STARTED)} of its rated speed in "
                f"{number(START_LONGEST, 's', full=False)}."
            )
        elif a.current_share > 1.0:
            lines.append(
                f"{which} the RMS current is {number(a.current_rms, 'A')}, rated is {number(rated, 'A')}: the motor "
                "becomes too hot."
            )
        if a.start_time is not None and a.start_time > START_LONG:
            lines.append(
                f"{which} the start takes {number(a.start_time, 's')}, more than "
                f"{number(START_LONG, 's', full=False)}."
            )
        if a.residual > RESIDUAL:
            lines.append(
                f"{which} {_percent(a.residual)} of the energy is missing: a shorter run.step is needed."
            )
        if a.drift is not None and a.drift > 0.1:
            lines.append(
                f"{which} the speed still changes over the measured turns, by {_percent(a.drift)} of its "
                "fluctuation: more run.settle_turns."
            )
    permitted = config.run.fluctuation
    own = study.own_wheel
    if own is not None and own.answers.fluctuation is not None and not own.keeps(permitted):
        lines.append(
            f"The speed fluctuates by {_percent(own.answers.fluctuation)} with the flywheel of the drive, "
            f"{_kg_m2(own.flywheel)}; permitted is {_percent(permitted)}."
        )
    # a flywheel without a run is not judged
    if study.failure is None and not any(wheel.keeps(permitted) for wheel in study.wheels):
        lines.append(
            f"No flywheel of the list keeps the speed within {_percent(permitted)}"
            + ("." if study.least is not None else ", nor does a larger one that was tried.")
        )
    return lines


def notes(study: KnifeStudy) -> list[str]:
    """In words, the remarks on the numbers."""
    turn, config, least = study.statics.turn, study.config, study.least
    permitted, by_hand = config.run.fluctuation, study.flywheel_by_hand
    lines = []
    if least is not None:
        a, hand = (
            least.answers,
            f"the hand formula asks for {_kg_m2(by_hand)}" if by_hand else "nor is it by hand",
        )
        sentence = (
            f"A fluctuation of {_percent(permitted)} takes a flywheel of {_kg_m2(least.flywheel)} at least, found "
            f"to {_percent(CLOSE)} of the fluctuation; {hand}"
            if least.flywheel
            else f"For a fluctuation of {_percent(permitted)} no flywheel is needed; {hand}"
        )
        if by_hand:
            sentence += ", as it leaves out that the motor's torque rises where the speed falls"
        if a.fluctuation is None:
            lines.append(
                f"{sentence}. But the motor does not come up to speed with it, or stalls in the first cut."
            )
        else:
            lent = a.stored_share_most
            words = (
                [] if lent is None else [f"flywheel and moving masses lend {_percent(lent)} of a cut's work"]
            )
            words += [
                f"the RMS current is {_percent(a.current_share)} of the rated",
                f"the start takes {number(a.start_time, 's')}",
            ]
            lines.append(f"{sentence}. {'With it' if least.flywheel else 'Without'} {', '.join(words)}.")
    if turn.cut_path > 0.0:
        lines.append(
            f"Work of a cut {number(turn.cut_work, 'J')}; force times path through the stack "
            f"{number(turn.cut_work_by_path, 'J')}. The resistance rises and falls over stack.edge, and fades "
            "below stack.v_smooth."
        )
    lines.append(
        "The windings begin cold and have no time to warm up in these runs; warm, the motor slips more."
    )
    return lines


def as_dict(study: KnifeStudy) -> dict[str, Any]:
    """Ready for JSON, each number with its unit; null for a number that does not exist."""

    config, s, plate = study.config, study.statics, study.config.motor.nameplate
    return {
        "chainunit": __version__,
        "title": config.title,
        "machine": entries(config.machine),
        "cut": entries(config.cut),
        "drive": {
            **entries(config.train),
            "motor": config.motor.designation,
            "rated_power": array_entry(plate.power, "W"),
            "rated_current": array_entry(plate.rated_current, "A"),
            "rated_torque": array_entry(plate.torque, "N.m"),
            "rated_speed": array_entry(plate.speed, "rad/s", "speed"),
            "rotor_inertia": array_entry(study.motor.rotor.J, "kg.m2"),
        },
        "run": entries(config.run),
        "turn": entries(s.turn),
        "pins": {title: entries(reaction) for title, reaction in s.pins.items()},
        "over_turn": {
            "angle": array_entry(s.angle[::10], "rad"),
            "torque": array_entry(s.torque[::10], "N.m"),
            "torque_free": array_entry(s.torque_free[::10], "N.m"),
            "inertia": array_entry(s.inertia[::10], "kg.m2"),
            "blade_x": array_entry(s.x[::10], "m"),
            "blade_y": array_entry(s.y[::10], "m"),
            "tilt": array_entry(s.tilt[::10], "rad"),
        },
        "flywheels": [{**entries(w.answers), "stalled": w.stalled} for w in study.wheels],
        "least_flywheel": None if study.least is None else entries(study.least.answers),
        "flywheel_by_hand": array_entry(study.flywheel_by_hand, "kg.m2"),
        "fmus": {name: str(origin) for name, origin in study.backends.items()},
        "warnings": warnings(study),
        "notes": notes(study),
        "failure": None if study.failure is None else str(study.failure),
    }
