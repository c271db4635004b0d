"""The engine of the basic operations of which `chainunit.core.printing.elementary` makes its functions: arrays."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

ROOT_OF_HALF = 0x3FE6A09E667F3BCD
"""The bits of the root of 1/2 as a whole number."""


def bits(x):
    return np.asarray(x, float).view(np.int64)


ARRAYS = SimpleNamespace(
    sqrt=np.sqrt,
    abs=np.abs,
    copysign=np.copysign,
    choose=np.where,
    exponent=lambda x: (bits(x) - ROOT_OF_HALF >> 52).astype(float),
    mantissa=lambda x: ((bits(x) - ROOT_OF_HALF & (1 << 52) - 1) + ROOT_OF_HALF).view(float),
    power2=lambda k: (np.asarray(k + 1023.0).astype(np.int64) << 52).view(float),
)
