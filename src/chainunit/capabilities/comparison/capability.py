"""The comparison as a capability."""

from __future__ import annotations

from ...report.capability import Capability


class ComparisonCapability(Capability):
    """The capability, which reads results and no study file: it has a command alone."""

    name = "comparison"
    order = 150


CAPABILITY = ComparisonCapability()
