"""The figures of a section. Each is declared once, at the function that draws it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias

from ..study.record import StudyRecord
from .figure import Figure

Draw: TypeAlias = "Callable[[StudyRecord], Figure | Iterable[Figure]]"


@dataclass(frozen=True)
class Pictures:
    """Figures in the order of their declaration."""

    _declarations: list[tuple[Draw, Callable[[StudyRecord], Any], str]] = field(default_factory=list)

    def declare(self, needs: Callable[[StudyRecord], Any], file: str = "") -> Callable[[Draw], Draw]:
        """A decorator that declares a function which draws one figure or several. It draws for studies of which
        `needs` is true; `file` is the name of the picture in print, empty where there is none."""

        def register(draw: Draw) -> Draw:
            self._declarations.append((draw, needs, file))
            return draw

        return register

    @property
    def files(self) -> tuple[str, ...]:
        """The names of the pictures that these figures may write."""
        return tuple(file for _, _, file in self._declarations if file)

    def figures(self, study: StudyRecord) -> Iterator[Figure]:
        """The figures of which the study has the data."""
        for draw, needs, file in self._declarations:
            if needs(study):
                figures = draw(study)
                yield from (
                    replace(figure, file=file)
                    for figure in ([figures] if isinstance(figures, Figure) else figures)
                )
