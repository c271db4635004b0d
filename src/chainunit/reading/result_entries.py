"""The content of a result.json by the names of its entries."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def as_mapping(node: Any) -> Mapping[str, Any]:
    """A node of a result that is a mapping; else an empty one."""
    return node if isinstance(node, Mapping) else {}


PARTS = ("given", "runs", "findings")
"""The parts of a result.json beside its heading, verdicts and remarks."""


class ResultEntries(dict[str, Any]):
    """The content of a result.json. An entry of one of its parts also has the name by which it stood beside them in
    an earlier version, in which parts of the same name were one."""

    def __missing__(self, name: str) -> Any:
        """The entries by that name of all parts, merged into one; it may be given without its part."""
        nodes = [part[name] for part in map(as_mapping, map(super().get, PARTS)) if name in part]
        if not nodes:
            raise KeyError(name)
        merged = nodes[0]
        for node in nodes[1:]:
            both = isinstance(merged, Mapping) and isinstance(node, Mapping)
            merged = {**merged, **node} if both else node
        return merged

    def __contains__(self, name: object) -> bool:
        return super().__contains__(name) or any(
            name in as_mapping(super(ResultEntries, self).get(p)) for p in PARTS
        )

    def get(self, name: str, default: Any = None) -> Any:
        """The entry of that name, or the default."""
        try:
            return self[name]
        except KeyError:
            return default
