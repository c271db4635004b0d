"""The sections of a report on the analyses of a study, by the name of the analysis."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

from ..study.record import StudyRecord
from . import blade, flywheels, notices, organs, starts, torsion, turn
from .blocks import Block, Source


@dataclass(frozen=True)
class Contents:
    """The contents of a section: its heading, its blocks (tables, text, figures), and the files of its figures."""

    heading: str
    blocks: Callable[[Source, StudyRecord], Iterator[Block]]
    pictures: tuple[str, ...] = ()


ANALYSES: Mapping[str, Contents] = {
    "organs": Contents("One side against both", organs.blocks, organs.PICTURES.files),
    "constant_speed": Contents("A turn at constant speed", turn.blocks, (turn.PICTURE,)),
    "blade": Contents("The blade", blade.blocks, (blade.PICTURE,)),
    "flywheels": Contents("Flywheels", flywheels.blocks, (flywheels.PICTURE,)),
    "observer": Contents("Who notices an overload", notices.blocks, notices.PICTURES.files),
    "starts": Contents("Starts", starts.blocks),
    "torsion": Contents("Torsion of the driveline in rotation", torsion.blocks, torsion.PICTURES),
}
