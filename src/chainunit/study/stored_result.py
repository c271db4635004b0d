"""The result of a study as it was stored: the content of its result.json."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..core.errors import InputError, printable
from ..core.inputs import JSON, file_bytes, json_of

FILE = "result.json"
_TITLES = {"steady": "steady running", "start_up": "start-up", "settling": "settling"}


PARTS = ("given", "runs", "findings")
"""The parts of a result.json beside its heading, verdicts and remarks."""


class ResultEntries(dict[str, Any]):
    """The content of a result.json. An entry of one of its parts also has the name by which it stood beside them in
    an earlier version, in which parts of the same name were one."""

    def __missing__(self, name: str) -> Any:
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


def as_mapping(node: Any) -> Mapping[str, Any]:
    """A node of a result, where it is a mapping; else an empty one."""
    return node if isinstance(node, Mapping) else {}


@dataclass(frozen=True)
class StoredResult:
    """The content of a result.json."""

    file: Path
    data: Mapping[str, Any]

    def words(self, name: str) -> str:
        """A text of the result; empty where it has none."""
        value = self.data.get(name)
        return printable(value) if isinstance(value, str) else ""

    def title_of(self, run: str) -> str:
        """The title of a run."""
        title = as_mapping(as_mapping(self.data.get("events")).get(run)).get("title")
        return printable(title if isinstance(title, str) else _TITLES.get(run, run.replace("_", " ")))


def read_result(path: Path) -> StoredResult:
    """The result in a folder of ``chainunit study``, or in a file.

    Raises
    ------
    InputError
        where there is none.
    """
    file = path / FILE if path.is_dir() else path
    if not file.exists():
        raise InputError(
            f"{path}: has no result (No such file or directory); make it by a run of the study into this folder"
        )
    return stored_result(file, json_of(file_bytes(file, JSON), str(file), "result of a study"))


def stored_result(file: Path, data: Any) -> StoredResult:
    """The result with the content `data` of its file.

    Raises
    ------
    InputError
        for the content of another file.
    """
    entries = ResultEntries(data) if isinstance(data, dict) else ResultEntries()
    if not isinstance(entries.get("answers"), dict) or "chainunit" not in entries:
        raise InputError(f"{file}: is no result of a study; a run into a folder writes {FILE}")
    return StoredResult(file, entries)
