"""The analysis of random overloads: the runs, and their remarks."""

from __future__ import annotations

from dataclasses import replace

from ...study.analysis import Analysis, Work
from ...study.config import Config
from ...study.drive import Drive
from ...study.record import StudyRecord
from .runs import MonteCarloResult, RandomTask, run


class RandomAnalysis(Analysis):
    """The runs of the table [monte_carlo]."""

    name = "monte_carlo"
    needs_runs = True

    @staticmethod
    def applies(config: Config, drive: Drive) -> bool:
        """Whether the study asks for runs."""
        return bool(config.plans["random_overloads"].is_asked_for)

    @staticmethod
    def find(study: StudyRecord, work: Work) -> MonteCarloResult:
        """Make the missing runs, and write them to their store in the folder of the study.

        Raises
        ------
        RunError
            where a batch fails; earlier ones are in the store.
        """
        files = work.rig.files
        assert work.folder is not None and files is not None
        drive = replace(study.drive, observer=None)
        task = RandomTask(study.config, drive, files, work.steady, work.rig.fed_from)
        return run(task, work.folder, work.progress, scheduler=work.scheduler)
