"""A study file on the way to its configuration."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..machines.machine import Machine
from .event import Event
from .parts import Parts


@dataclass(frozen=True)
class FileReading:
    """A study file each of whose values is allowed, on the way to its `Config`."""

    data: Mapping[str, Any]
    """tables and keys as the file has them"""
    form: Any
    """its checked form, completed by the example"""
    parts: Parts
    values: Mapping[str, Any]
    """by table, its declared quantities, completed by their start values"""
    given: Mapping[str, Mapping[str, float]]
    """by table, the quantities that file and example give"""
    machine: Machine | None
    """None for a machine that was refused"""
    events: Mapping[str, Event]
    source: str
    """name of the file; paths in it are relative to it"""
