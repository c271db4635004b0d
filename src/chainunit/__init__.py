"""Forces in a chain unit, as Python and as FMUs.

``ChainUnitMachine`` is the machine for scripts and sweeps; ``ChamberForces`` and ``DcMotor`` are the models
that become FMUs; the command ``chainunit study`` runs the main job.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from .errors import GeometryError, InputError, RunError

__all__ = [
    "EMPTY",
    "ChainUnitMachine",
    "ChamberForces",
    "GeometryError",
    "InputError",
    "RunError",
    "SideLoads",
    "__version__",
]

if TYPE_CHECKING:
    from .machines.api import EMPTY, ChainUnitMachine
    from .machines.chain_unit import ChamberForces, SideLoads

    __version__: str
else:
    # numpy and scipy take longer to import than the command line to answer: not before they are needed
    _HOMES = {
        "EMPTY": ".machines.api",
        "ChainUnitMachine": ".machines.api",
        "ChamberForces": ".machines.chain_unit",
        "SideLoads": ".machines.chain_unit",
    }

    def __getattr__(name):
        if name == "__version__":
            value = import_module("importlib.metadata").version(__name__)
        elif name in _HOMES:
            value = getattr(import_module(_HOMES[name], __name__), name)
        else:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        return globals().setdefault(name, value)

    def __dir__():
        return sorted({*globals(), *__all__})
