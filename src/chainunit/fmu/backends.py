"""Which backend makes an FMU: native code where there is a C compiler, Python inside pythonfmu otherwise."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from ..errors import InputError, RunError
from ..model import Model
from . import export as python
from .native import export as native

Backend = Literal["native", "python"]


def export(
    model: type[Model],
    file: Path,
    start: dict[str, float] | None = None,
    *,
    backend: Backend | None = None,
    fmi: int = 2,
) -> str:
    """Write `model` as an FMU and say, in words, which backend made it and why.

    Parameters
    ----------
    model, file, start : see `chainunit.fmu.export.export`
    backend : "native" or "python"; by default native where a C compiler is found and works
    fmi : 2 or 3; 3 only by the native backend

    Raises
    ------
    KeyError, InputError, RunError
        see `chainunit.fmu.export.export` and `chainunit.fmu.native.export.export`.
    """
    if fmi not in (2, 3):
        raise InputError(f"fmi = {fmi}: must be 2 or 3")
    command = native.compiler()
    why = "" if backend else ", no C compiler for 64-bit Linux found"
    if backend == "native" or (backend is None and command):
        try:
            native.export(model, file, start, fmi=fmi)
        except RunError:
            if backend or fmi != 2:
                raise
            why = f", the C compiler {command} failed"
        else:
            how = f"native code by {command}" + ("" if backend else ", the C compiler found here")
            return f"FMI {fmi}.0, Co-Simulation and Model Exchange, {how}"
    if fmi != 2:
        raise InputError("--fmi 3 needs the native backend, that is a C compiler (cc, gcc or clang)")
    python.export(model, file, start)
    return f"FMI 2.0 Co-Simulation, by pythonfmu{why}; needs Python 3.11 in the importing process"
