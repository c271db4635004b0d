"""One printed number beside the computed one."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class Row:
    """A number of a paper, and what it is.

    `printed` is the paper's text, with its digits, or what its formula gives as printed (None: not stated
    there); `computed` the right value in `unit`; `rebuilt` what the paper's own scheme gives once its slips
    are put back, where that explains the print.
    """

    paper: str
    item: str
    where: str
    quantity: str
    printed: str | None
    computed: float
    unit: str
    digits: int
    reason: str
    rebuilt: float | None = None
    agrees: bool | None = None
    """Set where rounding to the printed digits does not decide: an end of a range that is wrong as a whole."""

    @property
    def shown(self) -> str:
        """The computed value with as many decimals as are worth comparing."""
        return _text(self.computed, self.digits)

    @property
    def verdict(self) -> str:
        """`agrees` where the computed value rounds to the printed one, else `corrected`; `not stated`."""
        if self.printed is None:
            return "not stated"
        if self.agrees is not None:
            return "agrees" if self.agrees else "corrected"
        try:
            decimals = len(self.printed.split(".")[1]) if "." in self.printed else 0
            return (
                "agrees"
                if f"{self.computed:.{decimals}f}" == f"{float(self.printed):.{decimals}f}"
                else "corrected"
            )
        except ValueError:
            return "corrected"

    def as_dict(self) -> dict[str, Any]:
        """For reproduction.json."""
        rebuilt = None if self.rebuilt is None else _text(self.rebuilt, self.digits)
        own = asdict(self)
        del own["digits"], own["reason"], own["rebuilt"], own["agrees"]
        return own | {"shown": self.shown, "rebuilt": rebuilt, "verdict": self.verdict, "reason": self.reason}


def _text(x: float, digits: int) -> str:
    return f"{x:.{digits}f}" if digits >= 0 else f"{x:.1e}"
