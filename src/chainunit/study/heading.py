"""The heading of each result.json: program, title, source and labels of the study."""

from __future__ import annotations

from collections.abc import Mapping

from .. import __version__
from ..reading.results import part, result
from .config import FileContents


@result
class Heading:
    """Where a result comes from."""

    chainunit: str = part("version of chainunit")
    title: str = part("title of the study")
    source: str = part("the study file")
    report: Mapping[str, str] = part("labels of the report")

    @classmethod
    def of(cls, title: str, file: FileContents) -> Heading:
        """The heading of a result of a study with that title and file."""
        return cls(__version__, title, file.source, file.labels)
