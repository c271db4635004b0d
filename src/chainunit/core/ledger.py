"""The list of the files that the program wrote into a folder, by which it tells them from the files of others.

A line has the SHA-256 of a file and its name in the folder, as ``sha256sum`` writes and checks it. A file that was
changed since it was written counts as a file of others. While a file is replaced, it has two lines: a process that is
killed leaves the old or the new one in its place, and both are its own.
"""

from __future__ import annotations

import hashlib
import re
import secrets
import stat
from pathlib import Path

from .errors import InputError
from .inputs import file_bytes

NAME = ".chainunit-files"
_LINE = re.compile(r"([0-9a-f]{64})  (\S.*)")


def digest(file: Path) -> str:
    """The SHA-256 of a file, in hexadecimal digits."""
    with file.open("rb") as content:
        return hashlib.file_digest(content, "sha256").hexdigest()


class Ledger:
    """The list of a `folder`.

    Raises
    ------
    InputError
        where the file of the list has other content.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder.absolute()
        self._file = self.folder / NAME
        self._digests: dict[str, tuple[str, ...]] = {}
        self._torn = False
        try:
            # a pipe would be waited for, and a link may lead anywhere
            if not stat.S_ISREG(self._file.lstat().st_mode):
                raise self._unreadable
            text = file_bytes(self._file).decode("utf-8")
        except FileNotFoundError:
            return
        except (OSError, UnicodeDecodeError, InputError) as error:
            raise self._unreadable from error
        # a process that was killed may have left a part of the last line
        self._torn = not text.endswith("\n")
        for line in text.split("\n")[:-1]:
            if not (match := _LINE.fullmatch(line)):
                raise self._unreadable
            self._note(match[2], match[1])

    @property
    def _unreadable(self) -> InputError:
        return InputError(f"{self._file}: is no list of files of chainunit; move it, or name another folder")

    def _name(self, file: Path) -> str:
        return file.absolute().relative_to(self.folder).as_posix()

    def has(self, file: Path) -> bool:
        """Whether `file` lies in the folder."""
        return file.absolute().is_relative_to(self.folder)

    def wrote(self, file: Path) -> bool:
        """Whether the program wrote this file as it is now."""
        known = self._digests.get(self._name(file), ())
        return bool(known) and digest(file) in known

    def _note(self, name: str, known: str) -> None:
        """Keep a digest of a file, as the latest one."""
        earlier = (each for each in self._digests.get(name, ()) if each != known)
        self._digests[name] = (*earlier, known)

    def add(self, file: Path, content: Path) -> None:
        """Note that `file` is about to get this content; as it is now, it stays known until `close`."""
        name, known = self._name(file), digest(content)
        if known not in self._digests.get(name, ()):
            if self._torn:
                self._write()
            self._note(name, known)
            with self._file.open("a", encoding="utf-8") as out:
                out.write(f"{known}  {name}\n")

    def close(self) -> None:
        """Write the list anew, with each file as it is now, and without the files that are gone."""
        there = {}
        for name, known in sorted(self._digests.items()):
            if (self.folder / name).is_file():
                now = digest(self.folder / name) if len(known) > 1 else known[0]
                there[name] = (now,) if now in known else known[-1:]
        self._digests = there
        if there:
            self._write()
        else:
            self._file.unlink(missing_ok=True)

    def _write(self) -> None:
        self._torn = False
        part = self._file.with_name(f"{NAME}.{secrets.token_hex(8)}.part")
        lines = (f"{each}  {name}\n" for name, known in self._digests.items() for each in known)
        try:
            part.write_text("".join(lines), "utf-8")
            part.replace(self._file)
        finally:
            part.unlink(missing_ok=True)
