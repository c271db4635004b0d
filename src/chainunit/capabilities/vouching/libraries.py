"""Code of an FMU that runs on this machine: its own library, or in its place what its sources give here.

A library is for one operating system, processor and C library. Where it cannot be loaded, a native FMU still has its
C sources, and an FMU by pythonfmu its Python code.
"""

from __future__ import annotations

import functools
import importlib
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

from ...core.errors import RunError, printable
from ...core.native.compilers import compiler
from ...fmu.native.platforms import build_here, units_of
from .rerun import NoLibraryError, UnpackedFmu, opened

_SCRIPT = "resources/slavemodule.txt"
"""The member of an FMU by pythonfmu that names the module of its class."""


def usable(fmu: UnpackedFmu) -> tuple[UnpackedFmu, str]:
    """The FMU with code that runs here, and where this is not its own library, a sentence on it.

    Raises
    ------
    NoLibraryError
        where the FMU has no such code.
    RunError
        for a library for this machine that cannot be loaded: nobody here can use the FMU, whatever else is in it.
    """
    try:
        opened(fmu)
    except NoLibraryError as error:
        if library_of(fmu, fmu.folder).exists():
            raise RunError(str(error)) from error
        make, words = _interpreted(fmu, str(error)) or _compiled(fmu, str(error))
        own = replace(fmu, instead=make)
        opened(own)
        return own, f"{error}; {words}"
    return fmu, ""


def _compiled(fmu: UnpackedFmu, why: str) -> tuple[Callable[..., Any], str]:
    """The library that the C compiler of this machine makes from the sources of a native FMU."""
    sources = {path.name: path.read_bytes() for path in (fmu.folder / "sources").glob("*.[ch]")}
    if not set(units_of(fmu.fmi)) <= set(sources):
        raise NoLibraryError(f"{why}, and no sources of one")
    if (own := compiler()) is None:
        raise NoLibraryError(
            f"{why}; a C compiler makes one from the sources in the FMU: install cc, gcc, clang, or zig by pip "
            "install 'chainunit[cross]'"
        )
    try:
        content = build_here(own, fmu.fmi, fmu.identifier, sources)
    except (RunError, LookupError) as error:
        raise NoLibraryError(
            f"{why}; its sources cannot be compiled here: {printable(str(error), 300)}"
        ) from error
    from fmpy import fmi2, fmi3

    whole = fmu.folder / "built_here"
    of_class = fmi2.FMU2Slave if fmu.fmi == 2 else fmi3.FMU3Slave
    place = library_of(fmu, whole)
    place.parent.mkdir(parents=True, exist_ok=True)
    place.write_bytes(content)

    def make(**arguments: Any) -> Any:
        # fmpy has no other way to a library of FMI 3.0 than by the folder of the FMU, of which ours needs nothing
        return of_class(**arguments | {"unzipDirectory": str(whole)})

    return make, f"the experiments run with one that {own.name} made here from the sources in the FMU"


def library_of(fmu: UnpackedFmu, folder: Path) -> Path:
    """The place of the library for this machine in the folder of an FMU."""
    import fmpy

    system = fmpy.platform if fmu.fmi == 2 else fmpy.platform_tuple
    return folder / "binaries" / system / f"{fmu.identifier}{fmpy.sharedLibraryExtension}"


def _interpreted(fmu: UnpackedFmu, why: str) -> tuple[Callable[..., Any], str] | None:
    """The Python code of an FMU by pythonfmu, in this Python; None for a native FMU."""
    module = fmu.file(_SCRIPT)
    if module is None:
        return None
    try:
        of_class = _class_in(fmu, module.decode(errors="replace").strip())
    except Exception as error:  # the code is not ours
        words = f"{why}; its Python code does not run here: {printable(str(error), 200)}"
        raise NoLibraryError(words) from error
    make = functools.partial(PythonCode, of_class)
    return make, "the experiments run the Python code in the FMU, in this Python and without its library"


def _class_in(fmu: UnpackedFmu, module: str) -> Any:
    """The class of the FMU's script, all of whose imports are from the FMU or the standard library."""
    resources = fmu.folder / "resources"
    with _modules_apart({path.stem for path in resources.iterdir()}):
        sys.path.insert(0, str(resources))
        try:
            return getattr(importlib.import_module(module), fmu.identifier)
        finally:
            sys.path.remove(str(resources))


@contextmanager
def _modules_apart(names: set[str]) -> Iterator[None]:
    """Import packages and modules of these names anew, and take them out again; those that were there come back.
    Another FMU has modules of the same names, and what is in them may differ."""

    def taken() -> dict[str, ModuleType]:
        return {name: sys.modules.pop(name) for name in list(sys.modules) if name.partition(".")[0] in names}

    before = taken()
    try:
        yield
    finally:
        taken()
        sys.modules.update(before)


class PythonCode:
    """An instance of an FMU by pythonfmu without its library, by the names that fmpy's class of FMI 2.0 has."""

    def __init__(self, of_class: Any, *, unzipDirectory: str, instanceName: str, **others: Any) -> None:
        resources = Path(unzipDirectory) / "resources"
        self._make = functools.partial(of_class, instance_name=instanceName, resources=str(resources))
        self._slave: Any = None

    def instantiate(self, **options: Any) -> None:
        """Make the instance."""
        self._slave = self._make()

    def __getattr__(self, name: str) -> Callable[..., Any]:
        """Another function of FMI 2.0: ``setReal`` is ``set_real`` in Python."""
        method = getattr(self._slave, re.sub("[A-Z]", lambda letter: f"_{letter[0].lower()}", name))
        return lambda *values, **named: method(*values, *named.values())

    def doStep(self, time: float, size: float) -> None:
        """See FMI 2.0.

        Raises
        ------
        RunError
            where the FMU discards the step; the message cites what it logged.
        """
        if not self._slave.do_step(time, size):
            lines = [each.msg for each in self._slave.log_queue]
            raise RunError(lines[-1] if lines else "the step is discarded")

    def freeInstance(self) -> None:
        """Let the instance go."""
        self._slave = None
