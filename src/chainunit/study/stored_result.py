"""The result of a study as it was stored: the content of its result.json."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..core.errors import InputError, printable
from ..core.inputs import JSON, file_bytes, json_of
from ..reading.result_entries import ResultEntries, as_mapping

FILE = "result.json"
_TITLES = {"steady": "steady running", "start_up": "start-up", "settling": "settling"}


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
