"""Values of entries of a study file whose quantity another key names, such as the ends of a swept parameter."""

from __future__ import annotations

import math
from typing import Annotated, Any

from pydantic import BeforeValidator
from pydantic_core import PydanticCustomError


def _admitted(given: Any) -> Any:
    """A number or a text; its quantity, and so its unit, stand in another key."""
    is_number = isinstance(given, int | float) and not isinstance(given, bool) and math.isfinite(given)
    if is_number or isinstance(given, str):
        return given
    raise PydanticCustomError("number_or_text", "must be a number, or a text with a unit")


Entered = Annotated[Any, BeforeValidator(_admitted)]
"""A number, or a text with a unit."""
