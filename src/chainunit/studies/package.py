"""The drive and machine of a study as an SSP package."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable
from pathlib import Path

from ..config import Config, start_values
from ..errors import InputError
from ..fmu.backends import Backend
from ..fmu.ssp import ModelSystem, export
from ..machines.chain_unit import ChamberForces
from ..model import Model
from .choice import choose
from .drive import Drive


def study_system(config: Config, drive: Drive) -> ModelSystem:
    """Machine and motor of a study, from rest: the speed reference is the crank speed at the motor from the start on,
    feed and processing forces are those of normal running; with feed-forward, the machine that the control asks is in
    the system, too."""
    loads = start_values(config, ChamberForces)
    speed = config.run.crank_speed * drive.ratio
    machine = {**loads, **drive.machine_parameters(), "w": speed}
    motor = {**drive.motor.parameter_layout.named(drive.parameters), "w_ref": speed}
    models: dict[str, type[Model]] = {"machine": ChamberForces, "motor": drive.motor}
    start = {"machine": machine, "motor": motor}
    if drive.feed_forward:
        models["model"], start["model"] = ChamberForces, machine
    return ModelSystem(
        "ChainUnitDrive",
        models,
        drive.connections(),
        {f"{name}.{variable}": x for name, values in start.items() for variable, x in values.items()},
        config.title,
    )


def export_study(
    config: Config,
    file: Path,
    *,
    backend: Backend | None = None,
    report: Callable[[str], None] = lambda what: None,
) -> str:
    """Write machine and motor of a study as an SSP package and say, in words, what is in it. With `sizing` the motor
    is chosen first. The default experiment is as long as the study's start-up and steady running.

    Raises
    ------
    InputError, RunError
        see `chainunit.fmu.ssp.export`; also where sizing finds no motor.
    """
    with tempfile.TemporaryDirectory(prefix="chainunit_") as scratch:
        choice = choose(config, Path(scratch), lambda what, done, todo: report(what), backend)
    if choice.sizing is not None and choice.sizing.chosen is None:
        why = "; ".join(f"{c.motor.designation}: {c.reason}" for c in choice.sizing.candidates[:3])
        raise InputError(f"[sizing]: no motor of the catalogue fits ({why})")
    run = config.run
    stop = run.ramp + (run.settle_turns + run.turns) * 2.0 * math.pi / run.crank_speed
    return export(
        study_system(config, choice.drive), file, stop=stop, step=run.step, backend=backend, report=report
    )
