"""Draws docs/machine.svg, knife.svg, accelerator.svg and docs/linkages/*.svg: the packaged machines and the gallery
of linkage files, with the names of their parts."""

from __future__ import annotations

from pathlib import Path

from chainunit.machines.linkages.file import read_linkage
from chainunit.machines.machine import Machine
from chainunit.models import MACHINES
from chainunit.report.drawing import drawing

FOLDER = Path(__file__).parent
FILES = {"ChamberForces": "machine.svg", "KnifeDrive": "knife.svg", "Accelerator": "accelerator.svg"}
"""File of each machine in the folder of this script."""
GALLERY = FOLDER.parent / "examples" / "linkages"
PLACES = {"cylinder_lift": 0.55, "scissor_lift": 0.2, "tipper": 0.6, "toggle_clamp": 1.2}
"""Place of the driver in the picture, where it is not 1 rad [rad, m]."""


def pictures() -> dict[Path, str]:
    """The text of each file."""
    machines = {FOLDER / file: drawing(Machine(MACHINES[name])) for name, file in FILES.items()}
    linkages = {
        FOLDER / "linkages" / f"{file.stem}.svg": drawing(
            Machine(read_linkage(file)), PLACES.get(file.stem, 1.0)
        )
        for file in sorted(GALLERY.glob("*.toml"))
    }
    return machines | linkages


if __name__ == "__main__":
    for file, text in pictures().items():
        file.parent.mkdir(exist_ok=True)
        file.write_text(text, "utf-8")
