"""What this package and others declare by entry points: machines, motors, parts of the line, capabilities."""

from __future__ import annotations

from collections.abc import Iterator, MutableMapping
from functools import cache
from importlib import metadata
from typing import TypeVar

from .errors import InputError, RunError

Thing = TypeVar("Thing")


@cache
def entries(group: str) -> dict[str, metadata.EntryPoint]:
    """The entry points of a group by name, in the order of their names.

    Raises
    ------
    InputError
        for a name that two installed packages declare.
    RunError
        if there are none, as in an installation from before this group.
    """
    points: dict[str, metadata.EntryPoint] = {}
    for entry in sorted(metadata.entry_points(group=group), key=lambda entry: entry.name):
        first = points.setdefault(entry.name, entry)
        if first.value != entry.value:
            packages = " and ".join(e.dist.name if e.dist else e.value for e in (first, entry))
            raise InputError(f"{entry.name} of {group}: is declared by {packages}; uninstall one of them")
    if not points:
        raise RunError(f"no installed package declares {group}: install chainunit anew")
    return points


class Register(MutableMapping[str, Thing]):
    """The objects of a group of entry points by name. Each is imported when it is taken, so that a command imports
    only what it uses. A script may set objects of its own."""

    def __init__(self, group: str) -> None:
        self._group = group
        self._things: dict[str, Thing] = {}
        """the objects that were taken or set"""

    def __getitem__(self, name: str) -> Thing:
        if name not in self._things:
            entry = entries(self._group)[name]
            self._things[name] = entry.load()
        return self._things[name]

    def __setitem__(self, name: str, thing: Thing) -> None:
        self._things[name] = thing

    def __delitem__(self, name: str) -> None:
        del self._things[name]

    def __contains__(self, name: object) -> bool:
        return name in self._things or name in entries(self._group)

    def __iter__(self) -> Iterator[str]:
        return iter(dict.fromkeys((*entries(self._group), *self._things)))

    def __len__(self) -> int:
        return len({*entries(self._group), *self._things})
