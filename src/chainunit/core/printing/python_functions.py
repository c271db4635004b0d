"""Functions in Python from statements ``aN=expression``, each after the ones that it needs. Python FMUs carry it."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence

_WIDEST = 80
"""Largest number of characters of an expression that is written inline instead of on a line of its own."""
_NAME = re.compile(r"\ba\d+\b")


def function_text(head: str, statements: Sequence[str], results: Sequence[str]) -> str:
    """The function with this `head` that gives a tuple of these results, from the statements that they need."""
    uses = Counter(_NAME.findall(" ".join(results)))
    needed = []
    for name, _, expression in (statement.partition("=") for statement in reversed(statements)):
        if uses[name]:
            uses.update(_NAME.findall(expression))
            needed.append((name, expression))
    inline: dict[str, str] = {}

    def text(expression: str) -> str:
        return _NAME.sub(lambda name: inline.get(name[0], name[0]), expression)

    lines = [head]
    for name, expression in reversed(needed):
        whole = text(expression)
        if uses[name] == 1 and len(whole) <= _WIDEST:
            inline[name] = f"({whole})"
        else:
            lines.append(f"{name}={whole}")
    lines.append(f"return ({''.join(f'{text(result)}, ' for result in results)})")
    return "\n    ".join(lines) + "\n"
