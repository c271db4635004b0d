"""The figures of a section: each is declared once, with the function that draws it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias

from ..study.record import StudyRecord
from .blocks import Source
from .figure import Figure

Draw: TypeAlias = "Callable[[Source, StudyRecord], Figure | Iterable[Figure]]"


@dataclass(frozen=True)
class Pictures:
    """Figures in the order of their declaration."""

    _declared: list[tuple[Draw, Callable[[StudyRecord], Any], str]] = field(default_factory=list)

    def declare(self, needs: Callable[[StudyRecord], Any], file: str = "") -> Callable[[Draw], Draw]:
        """Declare the function below as that of a figure, or of several, of all studies that have what it `needs`;
        `file` is the name of the picture in print, empty where there is none."""

        def declared(draw: Draw) -> Draw:
            self._declared.append((draw, needs, file))
            return draw

        return declared

    @property
    def files(self) -> tuple[str, ...]:
        """The pictures that they may leave."""
        return tuple(file for _, _, file in self._declared if file)

    def figures(self, s: Source, study: StudyRecord) -> Iterator[Figure]:
        """Those that the study has the data of."""
        for draw, needs, file in self._declared:
            if needs(study):
                drawn = draw(s, study)
                yield from (
                    replace(each, file=file) for each in ([drawn] if isinstance(drawn, Figure) else drawn)
                )
