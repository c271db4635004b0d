"""Vouching as a capability."""

from __future__ import annotations

from ...report.capability import Capability


class VouchingCapability(Capability):
    """The capability, which adds nothing to a study: it has commands alone."""

    name = "vouching"
    order = 180


CAPABILITY = VouchingCapability()
