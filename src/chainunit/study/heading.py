"""The heading of each result.json: program, title, source and labels of the study."""

from __future__ import annotations

from collections.abc import Mapping

from .. import __version__
from ..reading.results import part, result
from .config import Config


@result
class Heading:
    """Where a result comes from."""

    chainunit: str = part("version of chainunit")
    title: str = part("title of the study")
    source: str = part("the study file")
    report: Mapping[str, str] = part("labels of the report")

    @classmethod
    def of(cls, config: Config) -> Heading:
        """The heading of a result of this study."""
        return cls(__version__, config.title, config.file.source, config.file.labels)
