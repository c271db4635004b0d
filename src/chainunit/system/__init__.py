"""Co-simulation of FMUs on fmpy, and the monolithic reference beside it.

`CoSimulation` runs a `System` with a fixed communication step; `monolithic` solves the same equations
as one ODE under an error-controlled solver; `energy_residual` is the certificate of a run.
"""

from .certificate import Bond, energy_residual
from .graph import System, port_connections
from .master import CoSimulation
from .reference import monolithic
from .signals import Profile

__all__ = [
    "Bond",
    "CoSimulation",
    "Profile",
    "System",
    "energy_residual",
    "monolithic",
    "port_connections",
]
