"""The linear model as a capability."""

from __future__ import annotations

from ...report.capability import Capability


class LinearCapability(Capability):
    """The capability, which adds nothing to a study: it has a command alone."""

    name = "linear"
    order = 160


CAPABILITY = LinearCapability()
