"""Outputs of a model, and their derivatives, over arrays of parameters, inputs and states."""

from .evaluate import ENGINES, evaluate
from .reductions import Beyond, Histogram

__all__ = ["ENGINES", "Beyond", "Histogram", "evaluate"]
