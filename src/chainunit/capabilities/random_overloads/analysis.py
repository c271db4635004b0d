"""The analysis of random overloads: the runs, and their remarks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from ...study.analysis import Analysis, Work
from ...study.drive import Drive
from ...study.record import StudyRecord
from .runs import MonteCarloResult, RandomTask, run


class RandomAnalysis(Analysis):
    """The runs of the table [monte_carlo]."""

    name = "monte_carlo"
    needs_runs = True

    @staticmethod
    def applies(drive: Drive, plans: Mapping[str, Any]) -> bool:
        """Whether the study asks for runs."""
        return bool(plans["random_overloads"].runs)

    @staticmethod
    def find(study: StudyRecord, work: Work) -> MonteCarloResult:
        """Make the missing runs, and write them to their store in the folder of the study.

        Raises
        ------
        RunError
            where a batch fails; earlier ones are in the store.
        """
        assert work.folder is not None
        rig = replace(work.rig, drive=replace(study.drive, observer=None))
        task = RandomTask(study.config.plans["random_overloads"], rig, work.steady)
        return run(task, work.folder, work.progress, scheduler=work.scheduler)
