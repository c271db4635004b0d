"""The organs of a chain unit as chains in its runs, and chains beside two bars over the crank speed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from ...machines.chain_unit import ON_DRIVE, PIN_NAMES
from ...report.capability import AnswerBlocks, Capability, Contents
from ...study.analysis import Analysis
from ...study.record import StudyRecord
from ...study.rules import OF_CHAIN_UNIT, Rule, has_sides
from .organs import CHAINS
from .table import CHAIN


class ChainsCapability(Capability):
    """The capability, with the table [chain]."""

    name = "chains"
    order = 10
    tables = {"chain": CHAIN}  # noqa: RUF012

    def rules(self) -> Iterable[Rule]:
        """Chains are organs of the chain unit."""
        yield Rule("chain", ~has_sides(), OF_CHAIN_UNIT)
        yield Rule(
            "chain",
            has_sides() & ~CHAINS.is_chosen,
            'is of organs that are chains; add organ = "chain", or leave it out',
        )
        of_organs = [f"pins.{name}" for name, joint in PIN_NAMES.items() if joint not in ON_DRIVE.values()]
        for name in ("width", *of_organs):
            refusal = "is of organs with two bars; leave it out, or the key organ"
            yield Rule(f"machine.{name}", CHAINS.is_chosen, refusal)

    def analyses(self) -> Iterable[type[Analysis]]:
        """Chains at constant speed."""
        from .analysis import ChainAnalysis

        return (ChainAnalysis,)

    def contents(self) -> Mapping[str, Contents]:
        """Tables and figure."""
        from . import page

        title = "Chains and two bars"
        return {"chains": Contents(title, page.blocks, page.PICTURES.files, "chain", "constant_speed")}

    def answer(self, study: StudyRecord) -> AnswerBlocks:
        """The speeds to avoid."""
        from .page import speeds_to_avoid

        return AnswerBlocks(warnings=speeds_to_avoid(study.findings))


CAPABILITY = ChainsCapability()
