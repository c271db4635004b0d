"""The files for others as a capability."""

from __future__ import annotations

from ...report.capability import Capability


class HandoverCapability(Capability):
    """The capability, which reads results and no study file: it has a command alone."""

    name = "handover"
    order = 170


CAPABILITY = HandoverCapability()
