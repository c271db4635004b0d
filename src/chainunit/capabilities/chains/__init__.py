"""The organs of a chain unit as chains in its runs, and chains beside two bars over the crank speed."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from ...fmu.backends import Backend
from ...machines.api import ChainUnitMachine, ChainUnitOfChains
from ...machines.machine import Machine
from ...report.blocks import Block, Source
from ...report.capability import Capability, Contents
from ...study.analysis import Analysis
from ...study.conditions import is_one_of
from ...study.cycle import Cycle
from ...study.record import StudyRecord
from ...study.rules import OF_CHAIN_UNIT, OtherModel, Rule, has_sides
from ...study.verdict import Verdict
from .table import CHAIN, ChainOrgans

_CHAINS = is_one_of("organ", "chain")


class ChainsCapability(Capability):
    """The capability, with the key organ and the table [chain]."""

    name = "chains"
    order = 10
    choices = {  # noqa: RUF012
        "organ": (
            Literal["two-bar", "chain"],
            Field(
                "two-bar",
                description="model of the organs: two rigid bars each, or chains of rods, see [chain]",
            ),
        )
    }
    tables = {"chain": CHAIN}  # noqa: RUF012
    other_model = OtherModel(
        _CHAINS,
        "organs are chains",
        'quantities of a turn are of organs with two bars; leave out organ = "chain"',
        'take organ = "chain"',
    )

    def rules(self) -> Iterable[Rule]:
        """Chains are organs of the chain unit."""
        yield from (Rule(name, ~has_sides(), OF_CHAIN_UNIT) for name in ("chain", "organ"))
        yield Rule(
            "chain",
            has_sides() & ~_CHAINS,
            'is of organs that are chains; add organ = "chain", or leave it out',
        )

    def machine(self, machine: Machine, values: Mapping[str, Any]) -> Machine:
        """The machine with chains, if the study has them."""
        chain: ChainOrgans | None = values["chain"]
        if chain is None or not isinstance(machine, ChainUnitMachine):
            return machine
        return ChainUnitOfChains(machine.p, model=machine.model, law=chain, number=int(chain.rods))

    def turns(
        self,
        values: Mapping[str, Any],
        machine: Machine,
        crank_speed: float,
        feeds: Iterable[Any],
        folder: Path,
        backend: Backend | None,
    ) -> list[Cycle] | None:
        """Those of all starts."""
        from .analysis import turns_of_starts

        chain: ChainOrgans | None = values["chain"]
        return turns_of_starts(chain, machine, crank_speed, feeds, folder, backend) if chain else None

    def model_verdict(
        self, study: StudyRecord, speed: float, actual: float, residuals: Mapping[str, float]
    ) -> Verdict | None:
        """The verdict on chains."""
        from .judgement import verdict_on

        return verdict_on(study, speed, actual, residuals) if study.config.table("chain") else None

    def remark(self, study: StudyRecord) -> None:
        """The remarks on chains."""
        from .judgement import remark_on

        if study.config.table("chain"):
            remark_on(study)

    def analyses(self) -> Iterable[type[Analysis]]:
        """Chains at constant speed."""
        from .analysis import ChainAnalysis

        return (ChainAnalysis,)

    def contents(self) -> Mapping[str, Contents]:
        """Tables and figure."""
        from . import page

        title = "Chains and two bars"
        return {"chains": Contents(title, page.blocks, page.PICTURES.files, "chain", "constant_speed")}

    def warnings(self, s: Source) -> Iterator[Block]:
        """The speeds to avoid."""
        from .page import speeds_to_avoid

        return speeds_to_avoid(s)


CAPABILITY = ChainsCapability()
