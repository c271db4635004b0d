"""Where a result comes from: its heading, version, libraries and platform, the files of the study by their digests,
and seeds."""

from __future__ import annotations

import contextlib
import json
import platform
import re
import subprocess
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from hashlib import sha256
from importlib import metadata
from pathlib import Path
from typing import Any

from .. import __version__
from ..core.errors import InputError
from ..core.files import digest, write_file
from ..reading.results import part, result
from .config import Config, FileContents
from .parts import beside
from .study_file import named_files, toml_text

FILE, COPY = "provenance.json", "study_copy.toml"
"""Names of the provenance of a result and of the copy of its study file, in the folder of the result."""


def study_text(file: FileContents) -> str:
    """The study file as it was read; tables from Python as a file has them."""
    return file.text or toml_text(file.tables)


def writers(config: Config, folder: Path) -> list[Callable[[], list[Path]]]:
    """The functions that write the provenance of the results of a study, and the copy of its file, into a folder."""
    return [
        lambda: write_file(folder / FILE, json.dumps(provenance(config), indent=1) + "\n"),
        lambda: write_file(folder / COPY, study_text(config.file)),
    ]


def writers_without_study(sources: Iterable[Path], folder: Path) -> list[Callable[[], list[Path]]]:
    """The function that writes the provenance of results without a study, from these files, into a folder."""
    files = dict(_digests_of((str(file), file) for file in sources))
    text = json.dumps({**_software(), "files": files}, indent=1) + "\n"
    return [lambda: write_file(folder / FILE, text)]


def provenance(config: Config) -> dict[str, Any]:
    """The provenance of the results of a study, ready for JSON. It is the same for the same study on one machine."""
    return {
        **_software(),
        "study": {
            "file": Path(config.file.source).name,
            "sha256": sha256(study_text(config.file).encode()).hexdigest(),
        },
        "files": dict(_digests(config.file)),
        "seeds": {
            f"{name}.seed": int(table.seed) for name, table in config.values.items() if hasattr(table, "seed")
        },
    }


def _software() -> dict[str, Any]:
    """Version, libraries and platform."""
    return {
        "chainunit": __version__,
        "commit": _commit(),
        "python": platform.python_version(),
        "platform": platform.platform(),
        "libraries": _libraries(),
    }


def _digests_of(files: Iterable[tuple[str, Path]]) -> Iterator[tuple[str, str]]:
    """The digests of the files that can be read, by their names."""
    for name, file in files:
        with contextlib.suppress(InputError, OSError):
            yield name, digest(file)


def _digests(file: FileContents) -> Iterator[tuple[str, str]]:
    """The digests of all files that the study names: linkage, catalogues, motors and machines, recordings."""
    names = dict.fromkeys(str(named.table[named.name]) for named in named_files(file.tables))
    return _digests_of((name, beside(name, file.source)) for name in names)


@cache
def _libraries() -> dict[str, str]:
    """The versions of the libraries that the package needs."""
    required = [
        re.split(r"[^\w.-]", line)[0]
        for line in metadata.requires("chainunit") or ()
        if "extra ==" not in line
    ]
    versions = {}
    for name in sorted(required, key=str.lower):
        with contextlib.suppress(metadata.PackageNotFoundError):
            versions[name] = metadata.version(name)
    return versions


@cache
def _commit() -> str | None:
    """The commit of the package, if it was installed from a repository or lies in its own."""
    installed = metadata.distribution("chainunit").read_text("direct_url.json")
    if installed and (commit := json.loads(installed).get("vcs_info", {}).get("commit_id")):
        return str(commit)
    root = Path(__file__).parents[3]
    if not (root / ".git").exists() or not (root / "src" / "chainunit").is_dir():
        return None
    with contextlib.suppress(OSError, subprocess.SubprocessError):
        process = subprocess.run(
            ["git", "-C", str(root), "rev-parse", "HEAD"],
            capture_output=True,
            text=True,
            timeout=10,
            check=True,
        )
        return process.stdout.strip() or None
    return None


@result
class Heading:
    """Where a result comes from."""

    chainunit: str = part("version of chainunit")
    title: str = part("title of the study")
    source: str = part("the study file")
    report: Mapping[str, str] = part("labels of the report")

    @classmethod
    def of(cls, title: str, file: FileContents) -> Heading:
        """The heading of a result of a study with that title and file."""
        return cls(__version__, title, file.source, file.labels)
