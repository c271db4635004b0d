# %% [markdown]
# The whole study from a cold start
#
# ``chainunit study`` in a new process with an empty bytecode cache and an empty cache of compiled FMUs, then the same
# command with both caches full: wall-clock time, processor time, and the shares of the second run by a profile, which
# loads Python code more than the libraries. Then a process that only imports the package. Limits: 60 s by the clock,
# 9 s of processor for the first run and 6 s for the second.

# %%
from __future__ import annotations

import pstats
import resource
import subprocess
import sys
import tempfile
import time
from os import environ
from pathlib import Path

from figures import parser, save

ALLOWED, FIRST, AGAIN = 60.0, 9.0, 6.0
PARTS = {
    "imports": ("importlib._bootstrap>", "_find_and_load"),
    "runs": ("study/run.py", "run"),
    "FMUs": ("study/drive_fmus.py", "export_drive"),
    "result.nc": ("report/series.py", "write"),
    "page": ("report/html.py", "write"),
}
"""By part of a study, file and function; a part contains imports of its own."""


def run(*command: str, folder: str) -> tuple[float, float]:
    """Seconds by the clock and of the processor, of a Python process with both caches in `folder`."""
    env = environ | {"PYTHONPYCACHEPREFIX": f"{folder}/bytecode", "CHAINUNIT_CACHE": f"{folder}/compiled"}
    env.pop("PYTHONDONTWRITEBYTECODE", None)  # else the second run has no bytecode
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run([sys.executable, *command], check=True, capture_output=True, cwd=folder, env=env)
    after, took = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter() - began
    return took, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def shares(folder: str) -> dict[str, float]:
    """The share of each part in the profile of a study."""
    run("-m", "cProfile", "-o", "profile", "-m", "chainunit", "study", folder=folder)
    stats = pstats.Stats(str(Path(folder) / "profile")).stats
    spent = {
        part: max(
            (s[3] for (file, _, name), s in stats.items() if file.endswith(end) and name == function),
            default=0.0,
        )
        for part, (end, function) in PARTS.items()
    }
    whole = max(s[3] for s in stats.values())
    return {part: seconds / whole for part, seconds in spent.items()}


def main() -> None:
    options = parser().parse_args()
    with tempfile.TemporaryDirectory() as folder:
        importing, _ = run("-c", "import chainunit", folder=folder)
    with tempfile.TemporaryDirectory() as folder:
        (study, first), (again, second) = (run("-m", "chainunit", "study", folder=folder) for _ in range(2))
        _, loop = run("-c", "for i in range(10**7): i + i", folder=folder)
        parts = shares(folder)
    print(f"import chainunit, cold: {importing:.1f} s")
    print(
        f"chainunit study, cold:  {study:.1f} s of {ALLOWED:g} s allowed ({study / importing:.0f} times the import); "
        f"processor {first:.1f} s of {FIRST:g} s"
    )
    print(f"chainunit study, again: {again:.1f} s; processor {second:.1f} s of {AGAIN:g} s")
    print(f"ten million additions in Python beside it: {loop:.2f} s of processor")
    print("shares: " + ", ".join(f"{part} {100.0 * share:.0f} %" for part, share in parts.items()))
    processor = {"first": first, "second": second, "loop": loop}
    save(
        options.json,
        {"importing": importing, "study": study, "again": again, "allowed": ALLOWED, **processor},
    )


if __name__ == "__main__":
    main()
