"""Forces in a chain unit, as Python and as FMUs.

``Study`` runs a machine with its motor, as the command ``chainunit study`` does; ``ChainUnitMachine`` is the machine
alone, for scripts; ``ChamberForces`` is its model, which becomes an FMU.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .app.linkages import LinkageResult as LinkageResult
    from .app.linkages import linkage as linkage
    from .app.studies import Study as Study
    from .app.studies import StudyResult as StudyResult
    from .app.study_methods import *  # noqa: F403 - the results of capabilities, by name
    from .core.errors import GeometryError as GeometryError
    from .core.errors import InputError as InputError
    from .core.errors import RunError as RunError
    from .core.errors import WriteError as WriteError
    from .machines.api import EMPTY as EMPTY
    from .machines.api import ChainUnitMachine as ChainUnitMachine
    from .machines.chain_unit import ChamberForces as ChamberForces
    from .machines.chain_unit import SideLoads as SideLoads
    from .study.linear import linearize as linearize
    from .system.linear import LinearModel as LinearModel

    __version__: str

else:
    # numpy and scipy take longer to import than a command takes to answer: import them when they are needed; a
    # signal during the import of anything ends with the words of Python
    _HOMES = {
        "EMPTY": ".machines.api",
        "ChainUnitMachine": ".machines.api",
        "ChamberForces": ".machines.chain_unit",
        "GeometryError": ".core.errors",
        "InputError": ".core.errors",
        "LinearModel": ".system.linear",
        "LinkageResult": ".app.linkages",
        "RunError": ".core.errors",
        "SideLoads": ".machines.chain_unit",
        "Study": ".app.studies",
        "StudyResult": ".app.studies",
        "WriteError": ".core.errors",
        "linearize": ".study.linear",
        "linkage": ".app.linkages",
    }

    def __getattr__(name):
        if name == "__version__":
            value = import_module("importlib.metadata").version(__name__)
        elif name == "__all__":
            value = sorted([*_HOMES, *_results_of_capabilities(), "__version__"])
        elif name in _HOMES:
            value = getattr(import_module(_HOMES[name], __name__), name)
        elif name.endswith("Result") and name in (results := _results_of_capabilities()):
            value = results[name]
        else:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        return globals().setdefault(name, value)

    def _results_of_capabilities():
        """The classes of the results of the methods of `Study` that capabilities bring, by their names."""
        modules = import_module(".study.registry", __name__).modules("study_method")
        return {module.RESULT.__name__: module.RESULT for module in modules}

    def __dir__():
        shown = {name for name in globals() if name.startswith("__")}
        return sorted({*shown, *import_module(__name__).__all__})
