"""The models that become FMUs, by name. A module of `machines` adds its own machine, a part of the line its
own model."""

from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

from . import machines
from .core.errors import InputError, near_name
from .core.model import Model
from .drives.motors import MOTORS
from .machines.flexible import ChainUnitFlexible
from .machines.linkages.file import read_linkage
from .machines.load_observer import LoadObserver
from .mechanism.models import MACHINES as MACHINES

for _module in iter_modules(machines.__path__):
    import_module(f"{machines.__name__}.{_module.name}")

# the parts of the line stand above
_REGISTRY = import_module(f"{__package__}.study.registry")

_CHAIN_UNIT = MACHINES["ChamberForces"]
_MODELS: tuple[type[Model], ...] = (
    _CHAIN_UNIT,
    _CHAIN_UNIT.direct(),
    *MOTORS.values(),
    *(part.model for part in _REGISTRY.parts_of_line()),
    *(machine for machine in MACHINES.values() if machine is not _CHAIN_UNIT),
    ChainUnitFlexible,
    LoadObserver,
)
MODELS = {model.name: model for model in _MODELS}
"""All models."""


def model_named(name: str, direct: bool = False) -> type[Model]:
    """The model of that name, or of a linkage file (.toml), of which also the `direct` model.

    Raises
    ------
    InputError
        for another name, for a file that is wrong, and for `direct` with a model.
    """
    if name.lower().endswith(".toml"):
        machine = read_linkage(Path(name))
        return machine.direct() if direct else machine
    if name not in MODELS:
        there = f"there are {', '.join(MODELS)}, and linkage files (.toml)"
        raise InputError(f"{name}: no such model{near_name(name, MODELS) or ';'} {there}")
    if direct:
        raise InputError(
            "direct: is of linkage files; the direct model of a machine has a name, as ChainUnit"
        )
    return MODELS[name]
