"""What an FMU may have in place of the values of its model: the declarations in the script of a Python FMU."""

from __future__ import annotations

from typing import ClassVar, Literal

from ..core.model import Model

Names = Literal["structured", "flat"]
"""The names of an FMU's variables: the model's names, ``left.material_mass``, or with underscores in place of dots,
``left_material_mass``."""


def name_in_fmu(name: str, names: Names) -> str:
    """The name in the FMU of the variable of the model with that name."""
    return name.replace(".", "_") if names == "flat" else name


class Script:
    """A model, and values for its FMU in place of the usual ones."""

    model: ClassVar[Model]
    start: ClassVar[dict[str, float]] = {}
    """Start values of parameters and inputs, by name, in place of the declared ones."""
    experiment: ClassVar[dict[str, float]] = {}
    """``step``, ``stop`` [s] or ``tolerance`` of the default experiment, in place of the usual ones."""
    names: ClassVar[Names] = "structured"
    """The names of the variables in the FMU; all other names here are the model's."""
    sizes: ClassVar[dict[str, float]] = {}
    """Sizes of inputs in the reference results, by name, in place of the usual ones."""


class FlatScript(Script):
    """No values of its own, and flat names."""

    names = "flat"


def script_with_names(names: Names) -> type[Script]:
    """The class without values of its own, with these names of the FMU's variables."""
    return FlatScript if names == "flat" else Script
