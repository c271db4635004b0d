"""The papers, reproduced and corrected: a row for each printed number, and the curves of each figure.

What a paper prints wrongly stands here and nowhere else, for comparison; the model has the corrected physics.
"""

from .paper000 import rows as rows000
from .paper001 import rows as rows001
from .paper002 import rows as rows002
from .paper003 import rows as rows003
from .row import Row

__all__ = ["PAPERS", "Row", "reproduce"]

PAPERS = ("000", "001", "002", "003")


def reproduce() -> list[Row]:
    """Every row, by paper and item."""
    return sorted([*rows000(), *rows001(), *rows002(), *rows003()], key=_order)


def _order(row: Row) -> tuple[str, int, str]:
    digits = row.item.rstrip("abc")
    return row.paper, int(digits), row.item[len(digits) :]
