"""Refusals of a study whose runs could not be made: loads beyond any machine, and runs without end."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from ..core.errors import InputError, near_name
from ..core.messages import unit_behind
from ..core.quantities import Layout
from ..machines.chain_unit import SideLoads
from ..mechanism.models import MachineModel
from ..models import MOTORS
from ..system.signals import Profile
from .event import Event
from .event_table import inputs_of, random_runs
from .operation import OperatingConditions

MOST_STEPS = 1e6
"""Most steps of a study."""


def loads_beyond(
    model: MachineModel,
    feed: Any,
    events: Mapping[str, Event],
    plans: Mapping[str, Any],
    *,
    known_motor: bool,
) -> Iterator[InputError]:
    """Refusals of loads that are beyond any machine together: all on one side, and at the height of each event. A
    motor that is not a `known_motor` may have any input."""
    for v in Layout(SideLoads).variables if model.sides else ():
        most = getattr(feed.left, v.name) + getattr(feed.right, v.name)
        if not v.quantity.admits(most):
            unit = unit_behind(v.unit)
            yield InputError(
                f"feed: {v.name} of both sides = {most:.9g}{unit}: must be <= {v.quantity.high:g}{unit} "
                "together, as an overload may lay all of it on one side",
                key="feed",
            )
    inputs = {v.name: v for v in model.input_layout.variables}
    normal = {name: v.quantity.start or 0.0 for name, v in inputs.items()} | Layout(model.Feed).by_name(feed)
    hardest = [(f"event.{name}", f"event.{k}", event) for k, (name, event) in enumerate(events.items(), 1)]
    randoms = random_runs(plans)
    hardest += [(runs.key, runs.key, event) for runs in randoms for event in runs.event.hardest()]
    unused = {runs.key for runs in randoms if not runs.runs}
    of_motors = {name for motor in MOTORS.values() for name in motor.input_layout.names}
    for where, key, event in hardest:
        needed = set(event.inputs(event.side))
        if not needed <= set(inputs):
            if where not in unused and known_motor and not needed <= {*inputs, *of_motors}:
                near = "".join(near_name(name, Layout(model.Feed).names) for name in needed)
                yield InputError(
                    f"{where}: the {model.name} has no input {' or '.join(sorted(needed))}{near}; "
                    f"{inputs_of(model)}",
                    key=key,
                )
            # an input of the motor: the study checks whether the motor has it
            continue
        if fault := event.fault(normal):
            yield InputError(f"{where}: {fault}", key=key)
        for name, signal in event.signals(normal, 0.0, dict.fromkeys(event.reads, 0.0)).items():
            most = (
                max([signal.start, *(x for *_, x in signal.changes)])
                if isinstance(signal, Profile)
                else signal
            )
            v = inputs[name]
            if v.quantity.type != "Real" and isinstance(signal, Profile) and signal.changes:
                kind = "whole number" if v.quantity.type == "Integer" else "switch"
                yield InputError(
                    f"{where}: {name} is a {kind}, and the event changes its input smoothly; name another input",
                    key=key,
                )
            elif not v.quantity.admits(most):
                yield InputError(
                    f"{where}: {name} comes to {most:.9g}{unit_behind(v.unit)} with the feed: must be "
                    f"{v.quantity.allowed_range}",
                    key=key,
                )


def endless(
    operation: OperatingConditions, events: Mapping[str, Event], plans: Mapping[str, Any]
) -> Iterator[InputError]:
    """The refusal of a study that would never end."""
    run, turn = operation.run, operation.turn
    seconds = operation.steady_begin + run.turns * turn
    seconds += sum(event.time_followed(turn) + 2.0 * turn for event in events.values())
    steps = max(seconds, *(runs.duration for runs in random_runs(plans) if runs.runs), 0.0) / run.step
    if not steps <= MOST_STEPS:
        yield InputError(
            f"run.step = {run.step:g} s: the study would take {steps:.2g} steps, more than {MOST_STEPS:.0e}; "
            "lengthen the step, raise the speed, or lessen the turns",
            key="run.step",
        )
