"""The sections of a report on the analyses of a study, by the name of the analysis."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

from . import starts, turn
from .capability import Contents, capabilities


@cache
def analysis_sections() -> Mapping[str, Contents]:
    """All of them, in the order in which a report has them."""
    others = {name: contents for part in capabilities() for name, contents in part.contents().items()}
    return {
        **{name: contents for name, contents in others.items() if contents.before == "constant_speed"},
        "constant_speed": Contents("A turn at constant speed", turn.blocks, (turn.PICTURE,)),
        **others,
        "starts": Contents("Starts", starts.blocks),
    }
