"""Compiled code that is kept: the same files by the same command of the same compiler are compiled once.

It lies in the folder ``chainunit`` of the user's cache folder, under the hash of all that it was made of. Deleting
the folder empties the cache. The environment variable CHAINUNIT_CACHE names another folder to lie in, or is ``off``.
A folder that cannot be read or written costs the cache and nothing else; files that are not the cache's own stay.
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

from ...errors import WriteError
from ...files import whole

VARIABLE, OFF = "CHAINUNIT_CACHE", "off"
_MOST = 256 * 2**20
"""bytes in the folder; the code that was not used for longest goes first"""
_ABANDONED = 3600.0  # s, after which the part of a file belongs to a process that was killed


def folder() -> Path | None:
    """Where compiled code is kept; None where it is not."""
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
    """The result of `make`, or its earlier one for this `key`."""
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
    """Whether a file is an entry of the cache, or a part of one that a process is writing or left behind."""
    return re.fullmatch(r"[0-9a-f]{64}(\.[0-9a-f]+\.part)?", file.name) is not None


def _shrink(place: Path) -> None:
    """Leave the newest files, as many as there is room for."""
    files = []
    for file in filter(_is_ours, place.iterdir()):
        with contextlib.suppress(FileNotFoundError):  # another process is at it, too
            files.append((file.stat().st_mtime, file.stat().st_size, file))
    room, now = _MOST, time.time()
    for used, size, file in sorted(files, reverse=True):
        room -= size
        if room < 0 or (file.suffix and used < now - _ABANDONED):
            file.unlink(missing_ok=True)
