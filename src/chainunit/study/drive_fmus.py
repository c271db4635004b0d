"""The FMUs of a drive: of all its parts, of its machine, and of the machine that turns without its motor."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

from ..fmu.backends import Backend, Origin
from ..fmu.backends import export as export_fmu
from ..mechanism.models import DirectMachine
from ..system import System, export
from .drive import Drive


def export_drive(
    drive: Drive,
    folder: Path,
    backend: Backend | None = None,
    progress: Callable[[str], None] = lambda what: None,
) -> tuple[dict[str, Path], dict[str, Origin]]:
    """Write the FMUs, with the start values of the drive. Returns the files by component, and the origin of each FMU.
    `progress` is called with a text on the current task."""
    system, origins = export(drive.graph, folder, backend, progress)
    return {name: c.file for name, c in system.components.items() if c.file}, origins


def with_files(drive: Drive, files: Mapping[str, Path]) -> System:
    """The system of the FMU `files` of the models of a drive; their start values may be different ones."""
    # the machine in the feed-forward is the same FMU as the machine
    component_files = {"model": files["machine"], **files}
    components = {name: replace(c, file=component_files[name]) for name, c in drive.graph.components.items()}
    return replace(drive.graph, components=components)


def export_machine(drive: Drive, folder: Path, backend: Backend | None = None) -> Path:
    """Write only the machine's FMU, as `export_drive` writes it."""
    machine = drive.simulated_machine
    file = folder / f"{machine.model.name}.fmu"
    export_fmu(machine.model, file, machine.by_name, backend=backend)
    return file


def coasting_model(drive: Drive) -> DirectMachine:
    """The model of the machine that turns without its motor."""
    return drive.simulated_machine.model.direct()


def coasting_parameters(drive: Drive) -> dict[str, float]:
    """Parameters of the `coasting_model` by name."""
    additions = {"J_added": drive.geared_line.inertia} if drive.line else {}
    return drive.simulated_machine.by_name | additions


def export_coasting(drive: Drive, folder: Path, backend: Backend | None = None) -> Path | None:
    """Write the FMU of the machine that turns without its motor, with the inertia on its shaft. None for a machine
    that is a foreign FMU, as there is no such model of it."""
    if drive.foreign_machine:
        return None
    model = coasting_model(drive)
    file = folder / f"{model.name}.fmu"
    export_fmu(model, file, coasting_parameters(drive), backend=backend)
    return file
