"""The choice of the backend for an FMU: native code if there is a C compiler, otherwise Python by pythonfmu."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from numbers import Integral
from pathlib import Path
from typing import Literal, get_args

from ..core.errors import InputError, RunError, WriteError, check_choice, shown
from ..core.model import Model
from ..core.native.compilers import COMPILERS
from . import export as python
from .native import export as native
from .native import platforms as targets
from .script import Names

Backend = Literal["native", "python"]


@dataclass(frozen=True)
class Origin:
    """The backend that made an FMU, and a `text` on how and why."""

    backend: Backend
    text: str

    def __str__(self) -> str:
        return self.text


def export(
    model: Model,
    file: Path,
    start: dict[str, float] | None = None,
    *,
    backend: Backend | None = None,
    fmi: int = 2,
    platforms: Sequence[str] = (),
    names: Names = "structured",
    progress: Callable[[str], None] = lambda what: None,
) -> Origin:
    """Write `model` as an FMU; the result tells which backend made it, and why.

    Parameters
    ----------
    model, file, start, names : see `chainunit.fmu.export.export`
    backend : "native" or "python"; by default native if a C compiler is found and works
    fmi : 2 or 3; 3 only by the native backend
    platforms, progress : see `chainunit.fmu.native.export.export`; platforms only by the native backend

    Raises
    ------
    KeyError, InputError, RunError
        see `chainunit.fmu.export.export` and `chainunit.fmu.native.export.export`.
    """
    if not isinstance(fmi, Integral) or fmi not in (2, 3):
        raise InputError(f"fmi = {shown(fmi)}: must be 2 or 3")
    if backend is not None:
        check_choice("backend", backend, get_args(Backend))
    check_choice("names", names, get_args(Names))
    reason = ""
    if backend is None and not platforms and not targets.compiles(fmi):
        reason = ", no C compiler for this machine found"
    elif backend != "python":
        built, compiler = targets.choose(platforms, fmi)
        text = f"FMI {fmi}.0, Co-Simulation and Model Exchange, native code by {compiler.name}"
        if platforms:
            text += " for " + ", ".join(f"{name} ({targets.PLATFORMS[name].tests})" for name in built)
        elif backend is None:
            text += ", the C compiler found here"
        try:
            native.export(model, file, start, fmi=fmi, platforms=platforms, names=names, progress=progress)
            return Origin("native", text)
        except WriteError:
            raise
        except RunError:
            if backend or fmi != 2 or platforms:
                raise
            reason = f", the C compiler {compiler.name} failed"
    if fmi != 2:
        raise InputError(f"fmi 3 needs the native backend, that is a C compiler ({COMPILERS})")
    if platforms:
        raise InputError("platforms: need the native backend; a Python FMU runs on Linux and Windows alike")
    python.export(model, file, start, names=names)
    text = f"FMI 2.0 Co-Simulation, by pythonfmu{reason}; needs Python 3.11 in the importing process"
    return Origin("python", text)
