"""The drive and machine of a study as FMUs with its start values, and as an SSP package."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path

from ..core.errors import InputError, RunError, printable
from ..core.files import scratch
from ..core.model import About, Model
from ..core.quantities import Layout
from ..drives.motor import Motor
from ..fmu.backends import Backend
from ..fmu.script import Names
from ..machines.api import ChainedUnit
from ..machines.chain_organs import USUAL
from ..machines.flexible import ChainedModel, with_rods
from ..machines.machine import Machine
from ..mechanism.models import DirectMachine, InverseMachine
from ..models import model_named
from ..reading.text import number
from ..system import ModelComponent, System, compiled
from ..system.compiled import input_starts
from ..system.ssp import export
from .choice import choose_for, with_parts_beside
from .config import Config
from .cycle import cycle
from .drive import Drive
from .operation import OperatingConditions
from .organ_limits import limits_of_organs, passed_limits
from .registry import parts_of_line
from .remarks import lengths_of_example
from .verdict import on_limit


def study_system(drive: Drive, operation: OperatingConditions) -> System:
    """Machine, line and motor of a study, from rest. The speed reference is the crank speed at the motor
    from the start on; feed and processing forces are those of normal running. With feed-forward, the system
    has the second machine that the control uses."""
    start = drive.loads(operation.feed) if drive.foreign_machine else {}
    if "w_ref" in drive.graph.components["motor"].connectors:
        start["motor.w_ref"] = drive.reference_speed(operation.crank_speed)
    for name, machine in (("machine", drive.driven_machine), ("model", drive.machine)):
        if name in drive.graph.components and not drive.foreign_machine:
            # a connected input needs no start value, but an FMU that runs alone needs one
            values = _in_motion(operation, machine.model, machine)
            start |= {f"{name}.{variable}": x for variable, x in values.items()}
    return replace(drive.graph, start=start)


def start_of(drive: Drive, operation: OperatingConditions, model: Model) -> dict[str, float]:
    """Start values of the parameters and inputs of the `model`, by name, with the values of the drive of a study.

    Raises
    ------
    InputError
        where the study has another motor or machine, or lacks the part of the line.
    """
    for kind in parts_of_line():
        if model is kind.model:
            if (part := drive.geared_line.part(kind.name)) is None:
                raise InputError(f"the study has no [{kind.name}]; add the table, or export without config")
            return part.component.start
    if not isinstance(model, Motor):
        if not _is_of(model, drive):
            raise InputError(f"the study's machine is {drive.driven_machine.model.name}, not {model.name}")
        machine = drive.simulated_machine if isinstance(model, ChainedModel) else drive.driven_machine
        return machine.by_name | _in_motion(operation, model, machine)
    if drive.motor is not model:
        title = drive.graph.components["motor"].title
        raise InputError(f"the study's motor is {title}, not {model.name}")
    return model.parameter_layout.by_name(drive.fmu_parameters)


def model_and_start(
    name: str,
    config: Config | None,
    rods: int | None = None,
    *,
    direct: bool = False,
    backend: Backend | None = None,
    progress: Callable[[str], None] = lambda what: None,
) -> tuple[Model, dict[str, float]]:
    """The model that `chainunit export NAME` writes, and its start values by name.

    Parameters
    ----------
    name : a model, a linkage file, or a study file, which `config` then is: its whole system
    config : the study that gives the start values, or None
    rods : number of rods of an organ of ChainUnitFlexible; by default the study's, or the usual one
    direct : whether the direct model of a linkage file is meant

    Raises
    ------
    InputError
        see `start_of`, `whole_system` and `chainunit.models.model_named`.
    RunError
        where no motor is found.
    """
    if config and Path(name) == Path(config.file.source):
        drive = drive_to_export(config, backend, progress)
        return whole_system(drive, config.operation, config.title, config.file.labels)
    if config is None:
        return model_named(name, direct, rods), {}
    model, drive = model_named(name, direct), drive_to_export(config, backend, progress)
    if isinstance(driven := drive.driven_machine.model, InverseMachine):
        # a study may give the machine further parameters
        model = next((kind for kind in (driven, driven.direct()) if kind.name == model.name), model)
    start = start_of(drive, config.operation, model)
    if name == "ChainUnitFlexible":
        if rods is None:
            machine = config.machine.simulated
            rods = sum(machine.rods) if isinstance(machine, ChainedUnit) else USUAL
        model = with_rods(rods, start)
    return model, start


def whole_system(
    drive: Drive, operation: OperatingConditions, title: str, labels: Mapping[str, str]
) -> tuple[Model, dict[str, float]]:
    """The one model of the whole system of a study with that title and the `labels` of its report, and its start
    values by name: parameters, the speed reference and the loads of normal running.

    Raises
    ------
    InputError
        where motor or machine is a foreign FMU.
    """
    system = study_system(drive, operation)
    machine = system.components["machine"]
    name = machine.model.name if isinstance(machine, ModelComponent) else machine.title
    author, revision = (printable(labels.get(key, ""), 1000) for key in ("author", "revision"))
    part = compiled(
        system,
        f"{name}System",
        title,
        about=About(author=author, version=revision),
        experiment={"step": operation.run.step, "stop": _running(operation)},
    )
    return part.model, part.start | input_starts(system, part.model)


def _running(operation: OperatingConditions) -> float:
    """The time of start-up and steady running [s]."""
    return operation.steady_begin + operation.run.turns * operation.turn


def left_out(operation: OperatingConditions, events: Iterable[str]) -> str:
    """A sentence on the parts of a study that its exported system does not have, among them the `events` of its
    file by name; empty where there are none."""
    names = ["the torque limiter"] if operation.coupling is not None else []
    if listed := ", ".join(events):
        names.append(f"the events {listed}")
    if operation.empty_start:
        names.append("the feed that comes once the machine runs")
    if not names:
        return ""
    return f"Not in it: {'; '.join(names)}. Its loads are those of normal running."


def remarks_on_export(config: Config) -> list[str]:
    """Sentences on the parts of a study that its FMU or package does not have, and on the limits of its model."""
    lengths = lengths_of_example(config.file.given, bool(config.machine.model.sides))
    sentences = [left_out(config.operation, config.given_events), lengths.text if lengths else ""]
    if config.file.tables.get("organ") != "chain":
        speed = config.run.crank_speed
        turns = number(speed, "rad/s", "speed", beside=False)
        end = f'This study turns at {turns}. For chains give the study organ = "chain".'
        passed = passed_limits(limits_of_organs(config.machine, config.feed, ("N.m",)), speed)
        sentences += [f"{on_limit(limit.topic, limit.speed)} {end}" for limit in passed]
    return list(filter(None, sentences))


def _is_of(model: Model, drive: Drive) -> bool:
    """Whether the model is the machine of the drive, its direct model, or its model with chains."""
    if drive.foreign_machine:
        return False
    machine_model = drive.driven_machine.model
    chains = bool(machine_model.sides) and isinstance(model, ChainedModel)
    return model is machine_model or chains or model is machine_model.direct()


def _in_motion(operation: OperatingConditions, model: Model, machine: Machine) -> dict[str, float]:
    """Start values of the feed and of the motion of a machine, at the speed of the study."""
    speed = operation.crank_speed * machine.ratio
    direct = isinstance(model, DirectMachine)
    motion = {"w_start": speed} if direct else {"phi": 0.0, "w": speed, "a": 0.0}
    return Layout(type(operation.feed)).by_name(operation.feed) | motion


def drive_to_export(
    config: Config, backend: Backend | None = None, progress: Callable[[str], None] = lambda what: None
) -> Drive:
    """The drive of a study with the parts beside it: with tuned gains, or with the motor and the ratio that are
    chosen.

    Raises
    ------
    RunError
        where no motor is found.
    """
    with scratch() as folder:
        turn = cycle(config.machine, config.run.crank_speed, config.feed)
        choice = choose_for(turn, config, folder, lambda what, done, todo: progress(what), backend)
    if choice.proposal is not None and choice.proposal.insufficient:
        raise RunError(f"[{choice.proposal.name}]: {choice.proposal.reason}")
    return with_parts_beside(choice.drive, config.plans, config.feed, turn)


def export_study(
    config: Config,
    file: Path,
    *,
    all_inputs: bool = False,
    names: Names = "structured",
    backend: Backend | None = None,
    progress: Callable[[str], None] = lambda what: None,
) -> str:
    """Write machine and motor of a study as an SSP package; returns its contents in words. Where the
    file leaves the motor open it is chosen first. The default experiment is as long as the study's
    start-up and steady running. With `all_inputs`, inputs without connection are connectors, too; `names` are
    the names of the variables of its FMUs.

    Raises
    ------
    InputError, RunError
        see `chainunit.system.ssp.export`; also where no motor is found, or the motor is a foreign FMU.
    """
    drive = drive_to_export(config, backend, progress)
    return export(
        study_system(drive, config.operation),
        file,
        name="ChainUnitDrive",
        description=config.title,
        stop=_running(config.operation),
        step=config.run.step,
        all_inputs=all_inputs,
        names=names,
        backend=backend,
        progress=progress,
    )
