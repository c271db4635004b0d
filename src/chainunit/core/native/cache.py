"""The cache of compiled code: the same files are compiled once by the same command of the same compiler.

The code lies in the folder ``chainunit`` of the user's cache folder, under the hash of its sources, command and
compiler. Deleting the folder empties the cache. The environment variable CHAINUNIT_CACHE names another parent folder,
or is ``off``. If the folder cannot be read or written, there is no cache, but no error. Files of others in the folder
are not deleted.

The program runs the code, so that nobody else may be able to put it there. An own folder that others can write, as a
umask of 002 makes it, is closed to them. A folder that belongs to another user, or that stays open to others, is no
cache, and is refused if the user named it; such a file is no entry. An entry has the
hash of its content together with that of its sources: a renamed one is no entry, either. On Windows, which tells no
owners and rights in this form, the folder must be one that only the user can write.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import stat
import sys
import time
from collections.abc import Callable
from pathlib import Path

from ..errors import InputError, WriteError
from ..files import atomic_file

VARIABLE, OFF = "CHAINUNIT_CACHE", "off"
_MOST = 256 * 2**20
"""Largest number of bytes in the folder; the least recently used code is deleted first."""
_ABANDONED = 3600.0  # s, age above which an incomplete file belongs to a killed process


def folder() -> Path | None:
    """The folder of the cache; None without a cache."""
    setting = os.environ.get(VARIABLE, "")
    if setting:
        return None if setting.lower() in (OFF, "0", "no", "false") else Path(setting) / "chainunit"
    name = "LOCALAPPDATA" if sys.platform == "win32" else "XDG_CACHE_HOME"
    try:
        home = Path.home()
    except RuntimeError:  # a process without a user
        return None
    usual = {"win32": home / "AppData/Local", "darwin": home / "Library/Caches"}
    base = os.environ.get(name, "") or usual.get(sys.platform, home / ".cache")
    return Path(base) / "chainunit"


def entry(key: bytes, make: Callable[[], bytes]) -> bytes:
    """The cached result for this `key`, or else the result of `make`, which is then cached.

    Raises
    ------
    InputError
        if the folder that CHAINUNIT_CACHE names is not safe.
    """
    place = folder()
    if place is None or not _is_safe(place):
        return make()
    name = hashlib.sha256(key).hexdigest()
    if (stored := _read(place, name)) is not None:
        mark, content = stored[:32], stored[32:]
        if mark == _mark(name, content):
            return content
    content = make()
    with contextlib.suppress(OSError, WriteError, InputError):
        place.mkdir(parents=True, exist_ok=True, mode=0o700)
        with atomic_file(place / name, is_result=False) as part:
            part.touch(0o600)
            part.write_bytes(_mark(name, content) + content)
        _shrink(place)
    return content


def _mark(name: str, content: bytes) -> bytes:
    """The hash of the name of an entry, which is the hash of its sources, and of its content."""
    return hashlib.sha256(name.encode() + content).digest()


def _is_safe(place: Path) -> bool:
    """Whether nobody else can put code into the folder, which may be missing yet. An own one is closed to others."""
    try:
        if _trouble(place.stat()) == _OPEN:
            _close(place)
        trouble = _trouble(place.stat())
    except OSError:
        return True
    if trouble and os.environ.get(VARIABLE):
        raise InputError(
            f"{VARIABLE}: its folder {place} {trouble}, so that others could put code there, which this program "
            "would run; name a folder of your own, or off"
        )
    return not trouble


def _trouble(about: os.stat_result) -> str:
    """The reason why others could change a file or a folder; empty if only this user can."""
    if not hasattr(os, "geteuid"):
        return ""
    if about.st_uid != os.geteuid():
        return "belongs to another user"
    return _OPEN if about.st_mode & (stat.S_IWGRP | stat.S_IWOTH) else ""


_OPEN = "can be written by other users"


def _close(place: Path) -> None:
    """Close an own folder to others, and delete the code in it, which others may have put there. A folder to which a
    link leads stays as it is, as others may have put the link there."""
    with contextlib.suppress(OSError):
        handle = os.open(place, os.O_RDONLY | os.O_NOFOLLOW | os.O_DIRECTORY)
        try:
            os.fchmod(handle, 0o700)
            for file in filter(_is_ours, place.iterdir()):
                file.unlink(missing_ok=True)
        finally:
            os.close(handle)


def _read(place: Path, name: str) -> bytes | None:
    """The content of a file that only this user can change, in a folder of which this is true; else None."""
    flags = (
        os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
    )
    with contextlib.ExitStack() as stack:

        def opened(path: Path | str, flags: int, inside: int | None = None) -> tuple[int, os.stat_result]:
            handle = os.open(path, flags, dir_fd=inside)
            stack.callback(os.close, handle)
            return handle, os.fstat(handle)

        try:
            if os.open in os.supports_dir_fd:
                # what is read is then what was checked, also if somebody exchanges the folder
                inside, about = opened(place, os.O_RDONLY)
                if _trouble(about):
                    return None
                handle, about = opened(name, flags, inside)
            else:
                handle, about = opened(place / name, flags)
            if not stat.S_ISREG(about.st_mode) or _trouble(about):
                return None
            with contextlib.suppress(OSError):
                os.utime(place / name)
            with os.fdopen(os.dup(handle), "rb") as file:
                return file.read()
        except OSError:
            return None


def _is_ours(file: Path) -> bool:
    """Whether a file is an entry of the cache, or an incomplete entry."""
    return re.fullmatch(r"[0-9a-f]{64}(\.[0-9a-f]+\.part)?", file.name) is not None


def _shrink(place: Path) -> None:
    """Delete the least recently used files beyond the size of the cache, and abandoned incomplete ones."""
    files = []
    for file in filter(_is_ours, place.iterdir()):
        with contextlib.suppress(FileNotFoundError):  # another process may delete files at the same time
            files.append((file.stat().st_mtime, file.stat().st_size, file))
    room, now = _MOST, time.time()
    for last_use, size, file in sorted(files, reverse=True):
        room -= size
        if room < 0 or (file.suffix and last_use < now - _ABANDONED):
            file.unlink(missing_ok=True)
