"""The analyses that a study may have, in the order in which they are made: first the analyses of the base, then of
the capabilities."""

from __future__ import annotations

from functools import cache

from .analysis import Analysis
from .feed_forward import FeedForwardAnalysis
from .gear_loss import GearAnalysis
from .registry import registered
from .starts import StartAnalysis
from .turn import TurnAnalysis

ANALYSES: tuple[type[Analysis], ...] = (TurnAnalysis, GearAnalysis, FeedForwardAnalysis, StartAnalysis)


@cache
def all_analyses() -> tuple[type[Analysis], ...]:
    """The analyses of the base and of all capabilities."""
    return (*ANALYSES, *(analysis for part in registered() for analysis in part.analyses()))
