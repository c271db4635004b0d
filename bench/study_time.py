# %% [markdown]
# The whole study from a cold start
#
# Wall-clock time of ``chainunit study`` in a new process with an empty bytecode cache and an empty cache of compiled
# FMUs; the limit is 60 s on two cores. Then the time of the same command with both caches full, and the time of a
# process that only imports the package.

# %%
from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time

from figures import parser, save

ALLOWED = 60.0


def run(*command: str, folder: str) -> float:
    """Seconds of a Python process with both caches in `folder`."""
    env = os.environ | {"PYTHONPYCACHEPREFIX": f"{folder}/bytecode", "CHAINUNIT_CACHE": f"{folder}/compiled"}
    began = time.perf_counter()
    subprocess.run([sys.executable, *command], check=True, capture_output=True, cwd=folder, env=env)
    return time.perf_counter() - began


def main() -> None:
    options = parser().parse_args()
    with tempfile.TemporaryDirectory() as folder:
        importing = run("-c", "import chainunit", folder=folder)
    with tempfile.TemporaryDirectory() as folder:
        study, again = (run("-m", "chainunit", "study", folder=folder) for _ in range(2))
    print(f"import chainunit, cold: {importing:.1f} s")
    print(
        f"chainunit study, cold:  {study:.1f} s of {ALLOWED:g} s allowed ({study / importing:.0f} times the import)"
    )
    print(f"chainunit study, again: {again:.1f} s")
    save(options.json, {"importing": importing, "study": study, "again": again, "allowed": ALLOWED})


if __name__ == "__main__":
    main()
