"""`BestResult`: the result of a search for the best machine, in Python."""

from __future__ import annotations

from pathlib import Path

from ..capabilities.optimize import page as optimum
from ..capabilities.optimize.best import Best
from ..capabilities.optimize.result import best_tables
from ..capabilities.optimize.words import conflict_sentences
from ..core.errors import RunError
from ..machines.machine import Machine
from ..study import config as study_files
from ..study.config import Config
from .results import ReportedResult
from .studies import Study


class BestResult(ReportedResult[Config, optimum.OptimizedStudy]):
    """The result of a search for the best machine. Its `repr` shows the answer, the parameters and what binds."""

    _task = optimum.TASK

    @property
    def config(self) -> Config:
        """The configuration of the study."""
        return self._outcome.config

    @property
    def best(self) -> Best:
        """All that the search found."""
        return self._outcome.best

    @property
    def met(self) -> bool:
        """Whether a machine was found that meets all limits."""
        return self.best.met

    @property
    def machine(self) -> Machine | None:
        """The best machine; None where no machine meets all limits."""
        return self.best.machine

    @property
    def study(self) -> Study:
        """The study with the best machine.

        Raises
        ------
        RunError
            where no machine meets all limits.
        """
        if self.best.machine is None:
            raise RunError("no machine meets all limits: " + " ".join(conflict_sentences(self.best)))
        source = Path(self.config.source).parent / optimum.FILE
        config = study_files.of_tables(best_tables(self.best, self.config, source.parent), str(source))
        return Study.__new__(Study)._take(config, str(source))
