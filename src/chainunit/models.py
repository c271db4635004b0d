"""The models that become FMUs, by name."""

from .drives.dc_motor import DcMotor
from .drives.driveline import CardanDriveline
from .drives.induction_motor import InductionMotor
from .machines.chain_unit import ChamberForces, DirectChainUnit
from .machines.flexible import ChainUnitFlexible
from .machines.knife_drive import KnifeDrive
from .model import Model

MODELS: dict[str, type[Model]] = {
    model.name: model
    for model in (
        ChamberForces,
        DirectChainUnit,
        DcMotor,
        InductionMotor,
        CardanDriveline,
        KnifeDrive,
        ChainUnitFlexible,
    )
}
