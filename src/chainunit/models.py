"""The models that become FMUs, by name: machines, motors and others, of this package and of others that declare
theirs by entry points."""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .core.errors import InputError, UnknownNameError, meant, near_name, shown
from .core.register import Register

if TYPE_CHECKING:
    from .core.model import Model
    from .drives.motor import Motor
    from .mechanism.models import InverseMachine


class _Models(ChainMap[str, "Model"]):
    """Models by name, which refuses an unknown one with the similar one."""

    def __missing__(self, name: Any) -> Model:
        raise UnknownNameError(
            f"{shown(name)}: no such model{meant(str(name), self)} there are {', '.join(self)}"
        )


MACHINES: Register[InverseMachine] = Register("chainunit.machines")
"""The machines that study files may name."""
MOTORS: Register[Motor] = Register("chainunit.motors")
"""The types of motor that study files may name."""
MODELS: Mapping[str, Model] = _Models(Register("chainunit.models"), MOTORS, MACHINES)  # type: ignore[arg-type]
"""All models."""


def linkage_named(name: str) -> InverseMachine | None:
    """The machine of the linkage file of that name; None for a study file, and for a name that is no file in TOML.

    Raises
    ------
    InputError
        for a file that is wrong.
    """
    if not name.lower().endswith(".toml"):
        return None
    from .machines.linkages.file import linkage_unless_study  # a model with a name needs no reader of files

    return linkage_unless_study(Path(name))


def model_named(name: str, direct: bool = False, rods: int | None = None) -> Model:
    """The model of that name, or of a linkage file (.toml), of which also the `direct` model. An organ of
    ChainUnitFlexible has so many `rods`.

    Raises
    ------
    InputError
        for another name, for a file that is wrong, for `direct` with a model, and for another number of `rods` than
        an organ may have.
    """
    if name.lower().endswith(".toml"):
        from .machines.linkages.file import read_linkage

        machine = read_linkage(Path(name))
        return machine.direct() if direct else machine
    if name not in MODELS:
        there = f"there are {', '.join(MODELS)}, and study and linkage files (.toml)"
        file = Path(name).parent / f"{Path(name).stem}.toml"
        near = f'; was "{file}" meant?' if file.exists() else near_name(name, MODELS)
        raise InputError(f"{name}: no such model{near or ';'} {there}")
    if direct:
        raise InputError(
            "direct: is of linkage files; the direct model of a machine has a name, as ChainUnit"
        )
    if rods is not None:
        from .machines.flexible import with_rods

        return with_rods(rods, {})
    return MODELS[name]
