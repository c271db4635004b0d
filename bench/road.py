# %% [markdown]
# The road of a number
#
# Counts the functions and the files of the package through which a parameter goes from a file to the C code of an
# FMU. The crank length is 0.1512345 m, as nothing else is. A profile hook sees each call with an argument that holds
# this number, and each return of it. A value holds the number if it is the number, a text with it, or a list, tuple,
# dict or instance with such an entry. A move is a call or a return in another file than the one before.
#
#     python bench/road.py

# %%
from __future__ import annotations

import contextlib
import io
import os
import sys
import tempfile
from collections import Counter
from pathlib import Path

import chainunit
from chainunit.app.cli import app

PACKAGE = str(Path(chainunit.__file__).parent)
NUMBER, TEXT = 0.1512345, "0.1512345"
STUDY = f"[machine]\nr = {TEXT}\n"
LINKAGE = Path(__file__).parents[1] / "examples" / "linkages" / "slider_crank_press.toml"
CRANK = 'r = { value = "80 mm"'
"""The crank length in the linkage file."""


def holds(value, depth=1):
    """Whether a value holds the number, down to entries of entries of this depth."""
    if isinstance(value, float):
        return value == NUMBER
    if isinstance(value, str):
        return TEXT in value
    if isinstance(value, bytes):
        return TEXT.encode() in value
    if depth == 0 or isinstance(value, type):
        return False
    if isinstance(value, list | tuple):
        return any(holds(entry, depth - 1) for entry in value)
    if isinstance(value, dict):
        return any(holds(entry, depth - 1) for entry in value.values())
    if type(value).__module__.startswith("chainunit"):
        return any(holds(entry, depth - 1) for entry in getattr(value, "__dict__", {}).values())
    return False


class Road:
    """The functions and files that hold the number, with the numbers of calls and returns, and the moves."""

    def __init__(self):
        self.functions, self.files, self.moves = Counter(), Counter(), 0
        self._last = None

    def follow(self, frame, event, result):
        """The profile hook."""
        code = frame.f_code
        if event not in ("call", "return") or not code.co_filename.startswith(PACKAGE):
            return
        if event == "call":
            names = code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]
            taken = [frame.f_locals[name] for name in names if name in frame.f_locals]
        else:
            taken = [result]
        if not any(map(holds, taken)):
            return
        file = os.path.relpath(code.co_filename, PACKAGE)
        self.functions[file, code.co_qualname] += 1
        self.files[file] += 1
        self.moves += self._last not in (None, file)
        self._last = file


def road(command):
    """The road of the number in a command."""
    found = Road()
    sys.setprofile(found.follow)
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            app(command, standalone_mode=False)
    finally:
        sys.setprofile(None)
    return found


def commands(folder):
    """By their names, the commands that export the number from files in a folder, which are written there."""
    study, linkage, output = Path(folder, "mine.toml"), Path(folder, "press.toml"), Path(folder, "it.fmu")
    study.write_text(STUDY)
    text = LINKAGE.read_text("utf-8")
    assert text.count(CRANK) == 1
    linkage.write_text(text.replace(CRANK, f'r = {{ value = "{TEXT} m"'), "utf-8")
    return {
        "machine of a study file": ["export", "ChamberForces", "--config", str(study), "-o", str(output)],
        "system of a study file": ["export", str(study), "-o", str(output)],
        "linkage file": ["export", str(linkage), "-o", str(output)],
    }


# %%
if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as made:
        for name, command in commands(made).items():
            found = road(command)
            print(f"{name}: {len(found.functions)} functions, {len(found.files)} files, {found.moves} moves")
            for file, count in found.files.most_common():
                print(f"{count:8d} {file}")
