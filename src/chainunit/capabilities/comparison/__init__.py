"""Two results of studies side by side."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ...report.capability import Capability
from ...report.task import Task


class ComparisonCapability(Capability):
    """The capability, which reads results and no study file."""

    name = "comparison"

    def tasks(self) -> Mapping[str, Task[Any, Any]]:
        """Its command."""
        from . import page

        return {"compare": page.TASK}


CAPABILITY = ComparisonCapability()
