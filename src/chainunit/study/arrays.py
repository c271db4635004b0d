"""The time series of a run, and numbers of arrays, over time or over a turn."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from xarray import Dataset as Dataset
else:
    # xarray, which takes long to import, is needed where a run is made
    Dataset = Any


def peak(x: Any) -> float:
    """Largest size of an array."""
    return float(np.max(np.abs(x)))


def rms(x: Any) -> float:
    """Root of the mean square of an array."""
    return float(np.sqrt(np.mean(np.square(x))))


def above_noise(value: float, scale: float) -> float:
    """The value, or 0 where it is the rounding of numbers of the size `scale`."""
    return value if abs(value) > 1e-12 * scale else 0.0


def stretches(inside: Any) -> list[tuple[int, int]]:
    """Begin and end, as of a slice, of each stretch of true values in an array of shape (n,)."""
    edge = np.diff(np.concatenate([[False], inside, [False]]).astype(int))
    return list(zip(np.flatnonzero(edge > 0).tolist(), np.flatnonzero(edge < 0).tolist(), strict=True))
