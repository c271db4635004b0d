"""A mapping of names that shows its names, and refuses an unknown one with the similar one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TypeVar

from .errors import UnknownNameError, meant, shown

T = TypeVar("T")


class Named(Mapping[str, T]):
    """Entries by name, in order. Its `repr` shows the names."""

    def __init__(self, entries: Mapping[str, T]) -> None:
        self._entries = dict(entries)

    def __getitem__(self, name: str) -> T:
        """The entry of that name.

        Raises
        ------
        UnknownNameError
            with all names.
        """
        if not isinstance(name, str) or name not in self._entries:
            names = ", ".join(self._entries) or "none"
            raise UnknownNameError(
                f"{shown(name)}: is no name{meant(str(name), self._entries)} there are {names}"
            )
        return self._entries[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._entries)

    def __len__(self) -> int:
        return len(self._entries)

    def __repr__(self) -> str:
        return f"<{', '.join(self._entries) or 'empty'}>"
