"""Parameters in docstrings are written "name : what it is"; here numpydoc has a type behind the colon."""

from __future__ import annotations

import re
from typing import Any

import griffe

SECTION = re.compile(r"(?<=Parameters\n----------\n)(?:.+\n?)+")
ENTRY = re.compile(r"^([*\w, ]+) : (.*)$", re.MULTILINE)


class Descriptions(griffe.Extension):
    """Puts what stands behind the colon of a parameter where its description belongs."""

    def on_object(self, *, obj: griffe.Object, **_: Any) -> None:
        """Before the docstring is parsed."""
        if obj.docstring:
            obj.docstring.value = SECTION.sub(
                lambda found: ENTRY.sub(r"\1\n    \2", found[0]), obj.docstring.value
            )
