"""The models that become FMUs, and those of machines, by name."""

from collections.abc import Mapping

from .drives.driveline import CardanDriveline
from .drives.motors import MOTORS
from .machines.chain_unit import ChamberForces
from .machines.flexible import ChainUnitFlexible
from .machines.knife_drive import KnifeDrive
from .mechanism.models import InverseMachine
from .model import Model

MACHINES: Mapping[str, type[InverseMachine]] = {model.name: model for model in (ChamberForces, KnifeDrive)}
"""The inverse models of linkage machines: parameters, feed, pins and the direct model of each follow from it."""

_MODELS: tuple[type[Model], ...] = (
    ChamberForces,
    ChamberForces.direct(),
    *MOTORS.values(),
    CardanDriveline,
    KnifeDrive,
    ChainUnitFlexible,
)
MODELS = {model.name: model for model in _MODELS}
"""All models."""
