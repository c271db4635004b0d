"""The papers, reproduced and corrected: a row for each printed number, and the curves of each figure.

The tables are in files beside this one, one for each paper; the functions that compute their values are in the module
of the paper. The errors of the papers stand only here, for comparison; the models have the corrected physics.
"""

from chainunit.work.progress import TaskProgress, quiet

from . import paper000, paper001, paper002, paper003
from .table import PaperNumber, rows

__all__ = ["PAPERS", "PaperNumber", "reproduce"]

PAPERS = {"000": paper000, "001": paper001, "002": paper002, "003": paper003}
"""The module of each paper."""


def reproduce(progress: TaskProgress = quiet) -> list[PaperNumber]:
    """All rows, by paper and item."""
    numbers: list[PaperNumber] = []
    for k, (paper, functions) in enumerate(PAPERS.items()):
        progress(f"paper {paper}", float(k), float(len(PAPERS)))
        numbers += rows(paper, functions)
    return numbers
