"""Forces in a chain unit, as Python and as FMUs.

``Study`` runs a machine with its motor, as the command ``chainunit study`` does; ``ChainUnitMachine`` is the machine
alone, for scripts and sweeps; ``ChamberForces`` is its model, which becomes an FMU.
"""

from importlib import import_module
from typing import TYPE_CHECKING

__all__ = [
    "EMPTY",
    "BestResult",
    "ChainUnitMachine",
    "ChamberForces",
    "GeometryError",
    "IdentificationResult",
    "InputError",
    "RunError",
    "SideLoads",
    "Study",
    "StudyResult",
    "SweepResult",
    "WatchResult",
    "__version__",
]

if TYPE_CHECKING:
    from .app.identifications import IdentificationResult, WatchResult
    from .app.studies import BestResult, Study, StudyResult
    from .app.sweeps import SweepResult
    from .core.errors import GeometryError, InputError, RunError
    from .machines.api import EMPTY, ChainUnitMachine
    from .machines.chain_unit import ChamberForces, SideLoads

    __version__: str
else:
    # numpy and scipy take longer to import than a command takes to answer: import them when they are needed; a
    # signal during the import of anything ends with the words of Python
    _HOMES = {
        "BestResult": ".app.studies",
        "EMPTY": ".machines.api",
        "ChainUnitMachine": ".machines.api",
        "ChamberForces": ".machines.chain_unit",
        "GeometryError": ".core.errors",
        "IdentificationResult": ".app.identifications",
        "InputError": ".core.errors",
        "RunError": ".core.errors",
        "SideLoads": ".machines.chain_unit",
        "Study": ".app.studies",
        "StudyResult": ".app.studies",
        "SweepResult": ".app.sweeps",
        "WatchResult": ".app.identifications",
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
