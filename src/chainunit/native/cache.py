"""The cache of compiled code: the same files are compiled once by the same command of the same compiler.

The code lies in the folder ``chainunit`` of the user's cache folder, under the hash of its sources, command and
compiler. Deleting the folder empties the cache. The environment variable CHAINUNIT_CACHE names another parent folder,
or is ``off``. If the folder cannot be read or written, there is no cache, but no error. Files of others in the folder
are not deleted.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import sys
import time
from collections.abc import Callable
from pathlib import Path

from ..errors import WriteError
from ..files import whole

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
    """The cached result for this `key`, or else the result of `make`, which is then cached."""
    place = folder()
    if place is None:
        return make()
    file = place / hashlib.sha256(key).hexdigest()
    with contextlib.suppress(OSError):
        digest, content = (text := file.read_bytes())[:32], text[32:]
        if hashlib.sha256(content).digest() == digest:
            with contextlib.suppress(OSError):
                os.utime(file)
            return content
    content = make()
    with contextlib.suppress(OSError, WriteError):
        place.mkdir(parents=True, exist_ok=True, mode=0o700)
        with whole(file) as part:
            part.write_bytes(hashlib.sha256(content).digest() + content)
        _shrink(place)
    return content


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
