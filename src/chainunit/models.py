"""The models that become FMUs, by name. A module of `machines` adds its own machine."""

from importlib import import_module
from pkgutil import iter_modules

from . import machines
from .drives.driveline import CardanDriveline
from .drives.motors import MOTORS
from .machines.flexible import ChainUnitFlexible
from .mechanism.models import MACHINES as MACHINES
from .model import Model

for _module in iter_modules(machines.__path__):
    import_module(f"{machines.__name__}.{_module.name}")

_CHAIN_UNIT = MACHINES["ChamberForces"]
_MODELS: tuple[type[Model], ...] = (
    _CHAIN_UNIT,
    _CHAIN_UNIT.direct(),
    *MOTORS.values(),
    CardanDriveline,
    *(machine for machine in MACHINES.values() if machine is not _CHAIN_UNIT),
    ChainUnitFlexible,
)
MODELS = {model.name: model for model in _MODELS}
"""All models."""
