"""The analyses that a study may have, in the order in which they are made."""

from __future__ import annotations

from .analysis import Analysis
from .blade import BladeAnalysis
from .flywheels import FlywheelAnalysis
from .gear_loss import GearAnalysis
from .notices import ObserverAnalysis
from .organs import OrganAnalysis
from .starts import StartAnalysis
from .torsion_findings import TorsionAnalysis
from .turn import TurnAnalysis

ANALYSES: tuple[type[Analysis], ...] = (
    OrganAnalysis,
    TurnAnalysis,
    BladeAnalysis,
    FlywheelAnalysis,
    GearAnalysis,
    TorsionAnalysis,
    StartAnalysis,
    ObserverAnalysis,
)
