"""An FMU 2.0 or 3.0 in a folder, and its runs on this machine by fmpy."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...core.errors import InputError, RunError, printable
from ...core.files import full, scratch
from ...core.native.compilers import COMPILERS, compiler
from ...core.quantities import Type
from ...fmu.loading import fmi2_callbacks, loading
from ...fmu.native.platforms import build_here, units_of

TYPES: Mapping[str, Type] = {
    "Real": "Real", "Float64": "Real", "Integer": "Integer", "Int32": "Integer", "Boolean": "Boolean",
}  # fmt: skip
"""By the name of a type in FMI 2.0 or 3.0, the type of this package."""
_SWITCH = {"true": "1", "false": "0"}


@dataclass
class UnpackedFmu:
    """An FMU in a folder: its description by fmpy, and its variables that are numbers, with `start` and `nominal` as
    numbers."""

    folder: Path
    description: Any
    variables: dict[str, Any]
    renamed: dict[str, str] = field(default_factory=dict)
    """by names in the FMU, those of its model, if they differ"""

    @property
    def name(self) -> str:
        """The name of the model."""
        return str(self.description.modelName)

    def rename(self, names: Mapping[str, str]) -> None:
        """Give the variables the names of the model; `names` has by them those in the FMU."""
        self.renamed = {name: model for model, name in names.items()}
        for variable in self.variables.values():
            variable.name = self.renamed.get(variable.name, variable.name)
        self.variables = {v.name: v for v in self.variables.values()}

    def start(self, causality: str) -> dict[str, float]:
        """Start values by name."""
        return {
            name: v.start
            for name, v in self.variables.items()
            if v.causality == causality and v.start is not None
        }

    def table(self, member: str) -> TimeTable:
        """A member that is a table in CSV of variables over the time, with the names of the model.

        Raises
        ------
        InputError
            if the member is no such table.
        """
        try:
            head, *rows = csv.reader(io.StringIO((self.folder / member).read_text("utf-8")))
            values = np.array([[float(_SWITCH.get(x, x)) for x in row] for row in rows], float)
            if values.ndim != 2 or values.shape[1] != len(head) or head[0] != "time":
                raise ValueError("the rows do not fit the head")
        except (ValueError, csv.Error) as error:
            raise InputError(f"{member}: is no table in CSV ({printable(str(error))})") from error
        names = tuple(self.renamed.get(name, name) for name in head[1:])
        if unknown := [name for name in names if name not in self.variables]:
            raise InputError(f"{member}: {printable(unknown[0])}: is no variable of the FMU")
        return TimeTable(names, values[:, 0], values[:, 1:])


@contextmanager
def unpacked(members: Mapping[str, bytes], name: str) -> Iterator[UnpackedFmu]:
    """The FMU with these members in a temporary folder; `name` is its file, for errors.

    Raises
    ------
    InputError
        for members that are no FMU.
    """
    from fmpy import read_model_description

    with scratch() as folder:
        for member, content in members.items():
            place = folder / member
            try:
                (place if member.endswith("/") else place.parent).mkdir(parents=True, exist_ok=True)
                if not member.endswith("/"):
                    place.write_bytes(content)
            except OSError as error:
                if full(error):
                    raise
                cause = f"cannot be unpacked ({error.strerror or error})"
                raise InputError(f"{name}: the member {printable(member)!r} {cause}") from error
        try:
            description = read_model_description(str(folder), validate=False)
        except Exception as error:  # fmpy has no class of its own
            raise InputError(f"{name}: is no FMU ({printable(str(error))})") from error
        if description.coSimulation is None or description.fmiVersion[:2] not in ("2.", "3."):
            version = printable(str(description.fmiVersion))
            raise InputError(f"{name}: is FMI {version}; must be FMI 2.0 or 3.0 with Co-Simulation")
        libraries = [x.modelIdentifier for x in (description.coSimulation, description.modelExchange) if x]
        if len(set(libraries)) > 1 or re.fullmatch(r"[A-Za-z_]\w*", libraries[0], re.ASCII) is None:
            names = printable(" and ".join(libraries))
            raise InputError(
                f"{name}: modelIdentifier {names}: must be one name in C, as one library is judged"
            )
        variables = [v for v in description.modelVariables if v.type in TYPES]
        for variable in variables:
            variable.start, variable.nominal = _number(variable.start), _number(variable.nominal) or 1.0
        yield UnpackedFmu(folder, description, {v.name: v for v in variables})


def _number(text: Any) -> float | None:
    """A start value of an FMU as a number; None if it is none."""
    try:
        return None if text is None else float(_SWITCH.get(text, text))
    except ValueError:
        return None


class NoLibraryError(RunError):
    """An FMU has no code that this machine can run."""


def make_runnable(fmu: UnpackedFmu) -> str:
    """Without a library for this machine, compile the sources in the FMU to one, and return a sentence on it.

    Raises
    ------
    NoLibraryError
        if that does not go, or if an FMU by pythonfmu lacks its script: its library would end the process.
    """
    import fmpy

    script = fmu.folder / "resources" / "slavemodule.txt"
    if script.is_file():
        name = f"{script.read_text('utf-8', 'replace').strip()}.py"
        if not script.with_name(name).is_file():
            raise NoLibraryError(f"resources/{printable(name, 100)} is missing")
    identifier = str(fmu.description.coSimulation.modelIdentifier)
    fmi = 2 if fmu.description.fmiVersion.startswith("2") else 3
    system = fmpy.platform if fmi == 2 else fmpy.platform_tuple
    library = fmu.folder / "binaries" / system / f"{identifier}{fmpy.sharedLibraryExtension}"
    if library.exists():
        return ""
    reason = f"the FMU has no library for this machine, {library.relative_to(fmu.folder)}"
    sources = {path.name: path.read_bytes() for path in (fmu.folder / "sources").glob("*.[ch]")}
    if not set(units_of(fmi)) <= set(sources):
        raise NoLibraryError(f"{reason}, and no sources of one")
    if (tool := compiler()) is None:
        raise NoLibraryError(
            f"{reason}; a C compiler makes one from the sources in the FMU: install {COMPILERS}"
        )
    try:
        content = build_here(tool, fmi, identifier, sources)
    except (RunError, LookupError) as error:
        cause = printable(str(error), 300)
        raise NoLibraryError(f"{reason}; its sources cannot be compiled here: {cause}") from error
    library.parent.mkdir(parents=True, exist_ok=True)
    library.write_bytes(content)
    return f"{reason}; the experiments run with one that {tool.name} made here from the sources in the FMU"


class TimeTable(NamedTuple):
    """Numbers over time: names of the columns without the time, times [s] of shape (n,), values (n, columns)."""

    names: tuple[str, ...]
    time: Any
    values: Any


def _instance(fmu: UnpackedFmu, keep: Callable[..., None]) -> Any:
    """An instance of an FMU whose messages go to `keep`. The loggers that fmpy makes for FMI 2.0 share one pointer in
    C, which outlives them: a later message of any FMU in the process would run freed memory."""
    from fmpy import fmi2, instantiate_fmu

    if fmu.description.fmiVersion != "2.0":
        return instantiate_fmu(
            str(fmu.folder), fmu.description, "CoSimulation", logger=keep, require_functions=False
        )
    instance = fmi2.FMU2Slave(
        guid=fmu.description.guid,
        unzipDirectory=str(fmu.folder),
        modelIdentifier=fmu.description.coSimulation.modelIdentifier,
        requireFunctions=False,
    )
    instance.instantiate(callbacks=fmi2_callbacks(keep))
    return instance


def simulated(
    fmu: UnpackedFmu, start: Mapping[str, float], outputs: Sequence[str], inputs: TimeTable | None = None
) -> TimeTable:
    """The outputs of an FMU from the time 0 with these start values: at the end of each step of a table of inputs,
    which are set at its begin; without inputs at the start alone.

    Raises
    ------
    RunError
        if the library cannot be loaded, or a function of it fails; the message cites what the FMU logged.
    """
    from fmpy import simulate_fmu

    log: list[str] = []

    def keep(*arguments: Any) -> None:
        if message := arguments[-1]:
            log.append(printable(message.decode(errors="replace"), 300))

    signals, end, step = None, 0.0, 1.0
    if inputs is not None:
        end, step = float(inputs.time[-1]), float(inputs.time[1])
        signals = np.rec.fromarrays(
            [inputs.time, *inputs.values.T], dtype=[(name, float) for name in ("time", *inputs.names)]
        )
    try:
        with loading():
            instance = _instance(fmu, keep)
            result = simulate_fmu(
                str(fmu.folder), validate=False, start_time=0.0, stop_time=end, output_interval=step,
                fmi_type="CoSimulation", start_values=dict(start), input=signals, output=list(outputs),
                model_description=fmu.description, set_stop_time=False, fmu_instance=instance,
            )  # fmt: skip
            instance.freeInstance()
    except Exception as error:  # fmpy has no class of its own
        cause = log[-1] if log else printable(str(error).replace(f"{fmu.folder}/", ""), 300)
        raise RunError(f"{fmu.name} does not run on this machine: {cause}") from error
    values = np.array([result[name] for name in outputs], float).reshape(len(outputs), -1).T
    return TimeTable(tuple(outputs), result["time"], values)
