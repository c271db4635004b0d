"""A system: models or FMU files that are joined by terminals, and their simulation and export.

`System` is the graph of components and connections. From it come the FMUs (`export`), the co-simulation
(`CoSimulation`), one ODE of Model Exchange FMUs (`ModelExchange`), one model of a system of models (`compiled`), its
reference solution (`monolithic`), the certificate of a run (`energy_residual` of every power bond), the SSP package
(`chainunit.system.ssp`), and twins without one part (`without`, `rigid`, `hold_loads`). A foreign FMU can be a
component, too: `foreign_component`."""

from .certificate import certify, energy_residual, shaft_torque, through, torque_names
from .compiled import compiled, export_compiled
from .compiled_simulation import CompiledSimulation, run_together
from .fmus import export
from .foreign import NAMES, fmu_component, foreign_component
from .graph import (
    Bond,
    Component,
    Connector,
    FmuComponent,
    ModelComponent,
    System,
    hold_loads,
    in_line,
    rigid,
    shaft_joints,
    without,
)
from .master import CoSimulation
from .me import ModelExchange
from .reference import monolithic
from .signals import Jump, Profile
from .simulation import Simulation

__all__ = [
    "NAMES",
    "Bond",
    "CoSimulation",
    "CompiledSimulation",
    "Component",
    "Connector",
    "FmuComponent",
    "Jump",
    "ModelComponent",
    "ModelExchange",
    "Profile",
    "Simulation",
    "System",
    "certify",
    "compiled",
    "energy_residual",
    "export",
    "export_compiled",
    "fmu_component",
    "foreign_component",
    "hold_loads",
    "in_line",
    "monolithic",
    "rigid",
    "run_together",
    "shaft_joints",
    "shaft_torque",
    "through",
    "torque_names",
    "without",
]
