"""Kinds of results, by which a command knows a folder that has the result of another one."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from ..core.errors import InputError
from ..core.inputs import JSON, file_bytes, json_of
from ..reading.result_entries import ResultEntries


class ResultKind(NamedTuple):
    """A kind of result: its words, the file that has its numbers, and a key that only this kind has there; without a
    key the name of the file tells the kind."""

    words: str
    file: str = "result.json"
    key: str = ""

    def is_in(self, folder: Path) -> bool:
        """Whether a folder has a result of this kind."""
        if not self.key or not (folder / self.file).is_file():
            return (folder / self.file).is_file()
        try:
            result = json_of(file_bytes(folder / self.file, JSON), self.file)
        except InputError:
            return False
        return isinstance(result, dict) and self.key in ResultEntries(result)
