"""The FMUs of a system."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from ..fmu.backends import Backend, Origin
from ..fmu.backends import export as export_fmu
from .graph import Component, ModelComponent, System


def export(
    system: System,
    folder: Path,
    backend: Backend | None = None,
    progress: Callable[[str], None] = lambda what: None,
) -> tuple[System, dict[str, Origin]]:
    """Write an FMU for each model of the system that has none, with the component's start values, to `folder`.
    Components of one model share the file of the first. `progress` is called with texts on the work.

    Returns
    -------
    the system with these files, and by component how its file was made.
    """
    components: dict[str, Component] = {}
    origins: dict[str, Origin] = {}
    files: dict[object, Path] = {}
    for name, component in system.components.items():
        if isinstance(component, ModelComponent) and component.file is None:
            model = component.model
            if model not in files:
                file = folder / f"{model.name}.fmu"
                if file in files.values():
                    file = folder / f"{model.name}_{name}.fmu"

                def report(activity: str, model_name: str = model.name) -> None:
                    progress(f"{model_name}: {activity}")

                report("exporting")
                origins[name] = export_fmu(model, file, component.start, backend=backend, progress=report)
                files[model] = file
            component = replace(component, file=files[model])
        components[name] = component
    return replace(system, components=components), origins
