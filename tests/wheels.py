"""What an installed wheel leaves beside its code: a folder of data about it, with its entry points."""

from __future__ import annotations

import shutil
import tomllib
from collections.abc import Mapping
from importlib import metadata
from pathlib import Path

PROJECT = Path(__file__).parents[1] / "pyproject.toml"


def declared(project: str) -> dict[str, dict[str, str]]:
    """The entry points of chainunit by group and name, in the text of a pyproject.toml."""
    return tomllib.loads(project)["project"]["entry-points"]


def install(folder: Path, entry_points: Mapping[str, Mapping[str, str]], name: str) -> None:
    """Write the data of version 1.0 of the package `name` into a folder of the path, as an installer does."""
    data = folder / f"{name}-1.0.dist-info"
    data.mkdir(exist_ok=True)
    (data / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n", "utf-8")
    _declare(data, entry_points)


def install_copy(folder: Path, project: str) -> None:
    """Install the copy of chainunit in a folder, with the entry points of this pyproject.toml."""
    (data,) = Path(str(metadata.distribution("chainunit").locate_file(""))).glob("chainunit-*.dist-info")
    shutil.copytree(data, folder / data.name, dirs_exist_ok=True)
    _declare(folder / data.name, declared(project))


def _declare(data: Path, entry_points: Mapping[str, Mapping[str, str]]) -> None:
    groups = (
        f"[{group}]\n" + "".join(f"{entry} = {value}\n" for entry, value in entries.items())
        for group, entries in entry_points.items()
    )
    (data / "entry_points.txt").write_text("\n".join(groups), "utf-8")
