"""The register of the kinds of joints that a linkage file may have."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ...mechanism.assur import REVOLUTE
from .gear import GearKind
from .joint_kind import GuideKind, JointKind, PinKind, SingleLinkKind

KINDS: Mapping[str, JointKind] = {kind.name: kind for kind in (PinKind(), GuideKind(), GearKind())}
"""The kinds by their names."""
SINGLES: Mapping[str, SingleLinkKind] = {
    kind.alone: kind for kind in KINDS.values() if isinstance(kind, SingleLinkKind)
}
"""The kinds by which single links form groups, by the kinds of these."""
KEYS: Sequence[str] = ("type", "on", "by", *(key for kind in KINDS.values() for key in kind.keys))
"""The keys of all kinds of joints."""


def kind_of(table: Mapping[str, Any]) -> Any:
    """The name of the kind that the table of a joint gives, or that its keys tell; it may be wrong."""
    told = (kind.name for kind in KINDS.values() if kind.keys and kind.keys[0] in table)
    return table.get("type", next(told, REVOLUTE))
