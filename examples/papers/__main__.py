"""The papers, from the command line, in the folder `examples`:

``python -m papers [FOLDER]`` computes every number that the papers print, right or wrong, with the reason, and draws
their figures; ``python -m papers two-bar [FOLDER]`` computes the error of two rigid bars in place of a hanging chain,
over zeta, mu and psi.
"""

import sys
from pathlib import Path

from rich.console import Console

from chainunit.report import files
from chainunit.report.terminal import show

from . import output, reproduce, two_bar


def main(arguments: list[str]) -> None:
    """Write report.html, the numbers as JSON, a text in Markdown and the figures into a folder; print the numbers."""
    name, report = "reproduction", None
    if arguments[:1] == ["two-bar"]:
        name, report = "two_bar_error", two_bar.report(two_bar.two_bar_error())
        arguments = arguments[1:]
    folder = Path(arguments[0] if arguments else name)
    folder.mkdir(parents=True, exist_ok=True)
    report = report or output.report(reproduce())
    for write in files.writers(report, folder, name, png=True):
        write()
    show(report, Console(width=120, markup=False, highlight=False))


if __name__ == "__main__":
    main(sys.argv[1:])
