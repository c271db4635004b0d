"""Forces in a chain unit, as Python and as FMUs.

``ChainUnit`` is the machine for scripts and sweeps; ``ChamberForces`` and ``DcMotor`` are the models
that become FMUs; the command ``chainunit study`` runs the main job.
"""

from importlib.metadata import version

from .errors import GeometryError, InputError, RunError
from .machines.api import EMPTY, ChainUnit
from .machines.chain_unit import ChamberForces, SideLoads

__version__ = version("chainunit")

__all__ = [
    "EMPTY",
    "ChainUnit",
    "ChamberForces",
    "GeometryError",
    "InputError",
    "RunError",
    "SideLoads",
    "__version__",
]
