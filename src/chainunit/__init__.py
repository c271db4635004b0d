"""Forces in a chain unit, as Python and as FMUs.

``Study`` runs a machine with its motor, as the command ``chainunit study`` does; ``ChainUnitMachine`` is the machine
alone, for scripts; ``ChamberForces`` is its model, which becomes an FMU.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

__all__ = [
    "EMPTY",
    "ChainUnitMachine",
    "ChamberForces",
    "GeometryError",
    "InputError",
    "RunError",
    "SideLoads",
    "Study",
    "StudyResult",
    "__version__",
]

if TYPE_CHECKING:
    from .app.studies import Study, StudyResult
    from .core.errors import GeometryError, InputError, RunError
    from .machines.api import EMPTY, ChainUnitMachine
    from .machines.chain_unit import ChamberForces, SideLoads

    __version__: str

    def __getattr__(name: str) -> Any: ...

else:
    # numpy and scipy take longer to import than a command takes to answer: import them when they are needed; a
    # signal during the import of anything ends with the words of Python
    _HOMES = {
        "EMPTY": ".machines.api",
        "ChainUnitMachine": ".machines.api",
        "ChamberForces": ".machines.chain_unit",
        "GeometryError": ".core.errors",
        "InputError": ".core.errors",
        "RunError": ".core.errors",
        "SideLoads": ".machines.chain_unit",
        "Study": ".app.studies",
        "StudyResult": ".app.studies",
    }

    def __getattr__(name):
        if name == "__version__":
            value = import_module("importlib.metadata").version(__name__)
        elif name in _HOMES:
            value = getattr(import_module(_HOMES[name], __name__), name)
        elif name.endswith("Result") and (result := _result_of_capability(name)):
            value = result
        else:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        return globals().setdefault(name, value)

    def _result_of_capability(name):
        """The class of this name of the result of a method of `Study` that a capability brings; None without one."""
        modules = import_module(".capabilities", __name__).modules("study_method")
        return next((module.RESULT for module in modules if module.RESULT.__name__ == name), None)

    def __dir__():
        return sorted({*globals(), *__all__})
