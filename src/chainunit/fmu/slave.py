"""The class from which the script of a Python FMU derives its own."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

from pythonfmu.fmi2slave import Fmi2Slave

from .export import complete
from .script import Script


class ModelSlave(Script, Fmi2Slave):  # type: ignore[misc]
    """A model as pythonfmu builds an FMU of it; a script in `fmu/` derives one class with `model` and perhaps
    `start`. The FMU carries another script in its place, with the equations as printed Python."""

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Of the class in the FMU, see `chainunit.fmu.printed_slave`."""
        raise NotImplementedError

    def to_xml(self, model_options: Any = None) -> Element:
        """The description from the declarations, for pythonfmu's build (its own description lacks units, bounds,
        dependencies and initial unknowns). Also writes the files that the FMU needs into `resources`."""
        return complete(type(self), Path(self.resources))
