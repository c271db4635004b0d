"""The commands that write FMUs and SSP packages."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated, Any

import typer
import typer.core

from ..core.errors import InputError
from ..core.inputs import TOML, file_text
from ..report.console import Backend, BackendOption, study_file, terminal_console


class VariableNames(Enum):
    """The names of an FMU's variables, see `chainunit.fmu.script.Names`."""

    structured = "structured"
    flat = "flat"


class ExportCommand(typer.core.TyperCommand):
    """The command that writes a model; its help names all models."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Show the help with the names of all models."""
        # a module of `machines` adds its own machine: the names are known once all modules are imported
        from ..models import MODELS

        (name,) = (parameter for parameter in self.params if parameter.name == "name")
        name.help = f"A study file or a linkage file (.toml), or one of {', '.join(MODELS)}."  # type: ignore[attr-defined]
        super().format_help(ctx, formatter)


def export(
    name: Annotated[str, typer.Argument(help="The model, a linkage file or a study file (.toml).")],
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            help="FMU file, by default NAME.fmu, of the model's name; of a study file also an SSP package, NAME.ssp.",
        ),
    ] = None,
    config: Annotated[
        Path | None,
        typer.Option("--config", help="Study file whose machine, feed or motor gives the start values."),
    ] = None,
    backend: BackendOption = None,
    fmi: Annotated[int, typer.Option("--fmi", help="Version of FMI: 2, or 3 (native only).")] = 2,
    platforms: Annotated[
        str | None,
        typer.Option(
            "--platforms",
            help="Comma-separated, of linux64, win64, darwin64, aarch64-linux, or all; this machine's by default.",
        ),
    ] = None,
    rods: Annotated[
        int | None,
        typer.Option(
            "--rods", help="Rods of an organ of ChainUnitFlexible, 2 to 24; 8, or the study's, by default."
        ),
    ] = None,
    direct: Annotated[
        bool, typer.Option("--direct", help="Of a linkage file: torque in and motion out.")
    ] = False,
    names: Annotated[
        VariableNames,
        typer.Option(
            "--names", help="left.material_mass (structured), or left_material_mass (flat), as for Simulink."
        ),
    ] = VariableNames.structured,
    all_inputs: Annotated[
        bool,
        typer.Option(
            "--all-inputs",
            help="Of a package: connectors for inputs without connection, too; fmpy cannot run it then.",
        ),
    ] = False,
) -> None:
    """Write a model as an FMU; of a study file its whole system as one FMU, or as an SSP package of FMUs."""
    from ..fmu.backends import export as write
    from ..models import linkage_named, model_named
    from ..reading.tables import toml

    file = output
    linkage = linkage_named(name)
    whole = linkage is None and name.lower().endswith(".toml")
    if file and file.suffix == ".ssp" and whole:
        if config or direct or platforms or fmi != 2:
            raise InputError(
                f"-o {file}: a package has FMUs 2.0 for this machine; leave the options of one FMU out"
            )
        _export_package(Path(name), file, backend, all_inputs, names)
        return
    if file and file.suffix != ".fmu":
        if whole:
            toml(file_text(Path(name), TOML))  # of two faults, that of the file that is read comes first
        of_study = " or .ssp" if whole else ""
        raise InputError(f"-o {file}: must be a file name that ends in .fmu{of_study}")
    if whole and (config or direct):
        option = f"--config {config}" if config else "--direct"
        raise InputError(
            f"{option}: is not of a study file, which has its own values; leave it out for {name}"
        )
    if rods is not None and name != "ChainUnitFlexible":
        raise InputError(f"--rods {rods}: is of ChainUnitFlexible; leave it out for {name}")
    study_path = Path(name) if whole else config
    loaded = study_file(study_path) if study_path else None
    kind: Any = backend.value if backend else None
    with terminal_console(stderr=True).status("exporting") as status:
        if loaded:
            from ..study.package import model_and_start

            model, start = model_and_start(
                name, loaded, rods, direct=direct, backend=kind, progress=status.update
            )
        elif linkage:
            model, start = linkage.direct() if direct else linkage, {}
        else:
            model, start = model_named(name, direct, rods), {}
        file = file or Path(f"{model.name}.fmu")
        summary = write(
            model,
            file,
            start,
            backend=kind,
            fmi=fmi,
            platforms=_platforms(platforms, fmi),
            names=names.value,
            progress=status.update,
        )
    print(f"{file}: {model.name}, {summary}")
    if whole and loaded:
        _show_remarks(loaded)


def _export_package(
    config: Path, output: Path, backend: Backend | None, all_inputs: bool, names: VariableNames
) -> None:
    """Write motor and machine, connected, with their parameter sets, as an SSP 1.0 package of FMUs 2.0."""
    from ..study.package import export_study

    loaded = study_file(config)
    with terminal_console(stderr=True).status("exporting") as status:
        summary = export_study(
            loaded,
            output,
            all_inputs=all_inputs,
            names=names.value,
            backend=backend.value if backend else None,
            progress=status.update,
        )
    print(f"{output}: {summary}")
    _show_remarks(loaded)


def _show_remarks(loaded: Any) -> None:
    """Print the parts of a study that its FMU or package does not have, and the limits of its model."""
    from ..study.package import remarks_on_export

    for sentence in remarks_on_export(loaded):
        print(sentence)


def _platforms(choice: str | None, fmi: int) -> list[str]:
    """The platforms that --platforms names; "all" are the platforms of the version `fmi`."""

    from ..fmu.native.platforms import PLATFORMS

    if choice == "all":
        return [name for name, platform in PLATFORMS.items() if fmi in platform.folders]
    if choice is None:
        return []
    names = [name.strip() for name in choice.split(",") if name.strip()]
    if not names:
        raise InputError(f"--platforms: name at least one of {', '.join(PLATFORMS)}, or all")
    return names
