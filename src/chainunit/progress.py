"""How a long task says how far it is."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[float], None]
"""Called with how much is done."""
Report = Callable[[str, float, float], None]
"""Called with what is running, how much is done, and all that there is to do."""
