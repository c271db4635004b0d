"""The models that become FMUs, and those of machines, by name."""

from collections.abc import Mapping

from .drives.driveline import CardanDriveline
from .drives.motors import MOTORS
from .machines.accelerator import Accelerator
from .machines.chain_unit import ChamberForces
from .machines.flexible import ChainUnitFlexible
from .machines.knife_drive import KnifeDrive
from .mechanism.models import InverseMachine
from .model import Model

_MACHINES: tuple[type[InverseMachine], ...] = (ChamberForces, KnifeDrive, Accelerator)
MACHINES: Mapping[str, type[InverseMachine]] = {model.name: model for model in _MACHINES}
"""The inverse models of linkage machines: parameters, feed, pins and the direct model of each follow from it."""

_MODELS: tuple[type[Model], ...] = (
    ChamberForces,
    ChamberForces.direct(),
    *MOTORS.values(),
    CardanDriveline,
    KnifeDrive,
    ChainUnitFlexible,
    Accelerator,
)
MODELS = {model.name: model for model in _MODELS}
"""All models."""
