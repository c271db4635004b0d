"""Files that appear whole or not at all."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .errors import InputError


@contextmanager
def whole(file: Path) -> Iterator[Path]:
    """A path to write to in place of `file`; it becomes `file` at the end, and vanishes on an error.

    Raises
    ------
    InputError
        where `file` is something else than a regular file.
    """
    if file.exists() and not file.is_file():
        raise InputError(f"{file}: is not a regular file; name another")
    part = file.with_name(file.name + ".part")
    try:
        yield part
        part.replace(file)
    finally:
        part.unlink(missing_ok=True)


def folder(path: Path) -> Path:
    """The folder `path`, made where it is missing, and writable.

    Raises
    ------
    InputError
        where it cannot be made or written to.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
        probe = path / ".chainunit"
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise InputError(f"{path}: cannot be written to ({error.strerror or error})") from error
    return path
