"""The submodel template IDTA 02021-1-0-1 "Sizing of Power Drive Trains" as a declaration: its elements, in its
spelling.

``template.csv`` has a row for each element: the path of its names, its type, the type of its value, how many there
may be, the unit that its concept names, and its semantic reference. Spellings such as ``RotraryTable`` and
``EnergyConsumtionPerCycle`` are those of the template, and readers find the elements by them.

Source: Industrial Digital Twin Association, admin-shell-io/submodel-templates, "Sizing of Power Drive Trains" 1.0.1.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from typing import NamedTuple

ROOT = "PowerDriveTrainSizing"
"""Name of the submodel."""
TEMPLATE_ID = "https://admin-shell.io/idta/SubmodelTemplate/SizingofPowerDriveTrains/1/0"
"""Identifier of the template."""


class TemplateElement(NamedTuple):
    """An element of the template."""

    path: str
    """names from the submodel to the element, separated by ``/``"""
    type: str
    """class of the metamodel, such as ``Property``"""
    value_type: str
    """XML type of its value; empty for a type of element without one"""
    cardinality: str
    """``One``, ``ZeroToOne``, ``ZeroToMany`` or ``OneToMany``"""
    unit: str
    """unit of its concept; empty for a text or a pure number"""
    reference: str
    """type of its semantic reference"""
    key: str
    """type of the key of this reference"""
    semantic_id: str

    @property
    def repeats(self) -> bool:
        """Whether there may be several."""
        return self.cardinality.endswith("Many")


@cache
def elements() -> Mapping[str, TemplateElement]:
    """The elements of the template by their paths, in its order."""
    text = files(__package__).joinpath("template.csv").read_text("utf-8")
    return {row["path"]: TemplateElement(**row) for row in csv.DictReader(text.splitlines())}


def numbered(name: str, place: int) -> str:
    """The name of the element at a `place` among several of the same kind, from 0: the first has the name of the
    template, the others have a number behind it."""
    return name if place == 0 else f"{name}{place + 1:02d}"
