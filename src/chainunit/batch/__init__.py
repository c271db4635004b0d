"""Outputs of a model, and their derivatives, over arrays of parameters, inputs and states."""

from .evaluate import ENGINES, evaluate

__all__ = ["ENGINES", "evaluate"]
