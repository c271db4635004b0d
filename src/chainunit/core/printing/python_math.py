"""The functions that printed Python calls beside those of `math` (`python_code`). Python FMUs carry this file.

`math` raises an error for a value out of its domain. The functions with a capital give NaN or an infinite number
there, as C does: a requirement on the parameters that is computed once is judged and interrupts nothing.
"""

from __future__ import annotations

import math
from collections.abc import Callable


def sign(x: float) -> float:
    """-1, 0 or 1."""
    return -1.0 if x < 0.0 else 1.0 if x > 0.0 else 0.0


def Quotient(a: float, b: float) -> float:
    """a/b, also by 0."""
    try:
        return a / b
    except ZeroDivisionError:
        return math.copysign(math.inf, a) * math.copysign(1.0, b) if a else math.nan
    except OverflowError:
        return math.inf


def _without_errors(function: Callable[..., float]) -> Callable[..., float]:
    """The function with NaN or inf in place of the errors of `math`."""

    def value(*x: float) -> float:
        """The value, NaN beyond the domain of the function and infinite beyond the largest number."""
        try:
            return function(*x)
        except ValueError:
            return math.nan
        except OverflowError:
            return math.inf

    return value


Sqrt, Exp, Log, Pow = (_without_errors(f) for f in (math.sqrt, math.exp, math.log, math.pow))
Sin, Cos, Tan, Sinh, Cosh = (_without_errors(f) for f in (math.sin, math.cos, math.tan, math.sinh, math.cosh))
Asin, Acos, Fmod = (_without_errors(f) for f in (math.asin, math.acos, math.fmod))
Floor, Ceil = (_without_errors(f) for f in (math.floor, math.ceil))
