"""Draws docs/machine.svg, knife.svg and accelerator.svg: each packaged machine with the names of its parts."""

from __future__ import annotations

from pathlib import Path

from chainunit.machines.machine import Machine
from chainunit.models import MACHINES
from chainunit.report.drawing import drawing

FOLDER = Path(__file__).parent
FILES = {"ChamberForces": "machine.svg", "KnifeDrive": "knife.svg", "Accelerator": "accelerator.svg"}
"""File of each machine in the folder of this script."""


def pictures() -> dict[Path, str]:
    """The text of each file."""
    return {FOLDER / file: drawing(Machine(MACHINES[name])) for name, file in FILES.items()}


if __name__ == "__main__":
    for file, text in pictures().items():
        file.write_text(text, "utf-8")
