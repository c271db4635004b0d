"""The models that become FMUs, by name."""

from .drives.driveline import CardanDriveline
from .drives.motors import MOTORS
from .machines.chain_unit import ChamberForces, DirectChainUnit
from .machines.flexible import ChainUnitFlexible
from .machines.knife_drive import KnifeDrive
from .model import Model

_MODELS: tuple[type[Model], ...] = (
    ChamberForces,
    DirectChainUnit,
    *MOTORS.values(),
    CardanDriveline,
    KnifeDrive,
    ChainUnitFlexible,
)
MODELS = {model.name: model for model in _MODELS}
