"""The register of the kinds of joints that a linkage file may have."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ...mechanism.assur import REVOLUTE, JointOf
from .belt import BeltKind
from .cam import CamKind
from .gear import GearKind, RackKind
from .joint_kind import GuideKind, JointEntry, JointKind, PinKind, SingleLinkKind

KINDS: Mapping[str, JointKind] = {
    kind.name: kind for kind in (PinKind(), GuideKind(), GearKind(), BeltKind(), RackKind(), CamKind())
}
"""The kinds by their names."""
SINGLES: Mapping[str, SingleLinkKind] = {
    kind.alone: kind for kind in KINDS.values() if isinstance(kind, SingleLinkKind)
}
"""The kinds by which single links form groups, by the kinds of these."""
KEYS: Sequence[str] = ("type", "on", "by", *(key for kind in KINDS.values() for key in kind.keys))
"""The keys of all kinds of joints."""


def kind_of(table: Mapping[str, Any]) -> Any:
    """The name of the kind that the table of a joint gives, or that its keys tell; it may be wrong."""
    names = (kind.name for kind in KINDS.values() if kind.keys and kind.keys[0] in table)
    return table.get("type", next(names, REVOLUTE))


def in_decomposition(joint: JointEntry) -> JointOf:
    """A joint as the decomposition sees it."""
    kind = KINDS[joint.kind]
    return JointOf(
        joint.name, kind.name, joint.on[0], joint.by[0], joint.third, kind.equations, kind.alone, kind.seats
    )
