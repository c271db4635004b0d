"""Chains of rods as the model of the organs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ...fmu.backends import Backend
from ...machines.api import ChainUnitMachine, ChainUnitOfChains
from ...machines.machine import Machine
from ...study.cycle import Cycle
from ...study.organs import ConstantSpeed, OrganModel
from ...study.record import StudyRecord
from ...study.verdict import Verdict
from .table import ChainOrgans


class Chains(OrganModel):
    """Chains of rods, with the table [chain]."""

    name, title, phrase, order = "chain", "chains of rods, see [chain]", "organs are chains", 10

    def machine(self, machine: Machine, tables: Mapping[str, Any]) -> Machine:
        """The chain unit with chains."""
        chain: ChainOrgans = tables["chain"]
        # a rule refuses any other machine than a chain unit
        if not isinstance(machine, ChainUnitMachine):
            return machine
        return ChainUnitOfChains(machine.p, model=machine.model, law=chain, number=int(chain.rods))

    def turns(
        self, turns: ConstantSpeed, tables: Mapping[str, Any], folder: Path, backend: Backend | None
    ) -> Sequence[Cycle]:
        """Those of all starts."""
        from .analysis import turns_of_starts

        chain, machine = tables["chain"], turns.machine
        return turns_of_starts(chain, machine, turns.crank_speed, turns.feeds, folder, backend)

    def verdict(
        self, study: StudyRecord, speed: float, actual: float, residuals: Mapping[str, float]
    ) -> Verdict:
        """The verdict on chains."""
        from .judgement import verdict_on

        return verdict_on(study, speed, actual, residuals)

    def remark(self, study: StudyRecord) -> None:
        """The remarks on chains."""
        from .judgement import remark_on

        remark_on(study)


CHAINS = Chains()
