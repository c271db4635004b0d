"""Writes the generated tables into docs/papers.md and docs/linkages.md."""

import re
import sys
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "examples"))

from papers import PAPERS, reproduce
from papers.output import markdown

HERE = Path(__file__).parent
GALLERY = HERE.parent / "examples" / "linkages"


def write(page: Path, name: str, table: Callable[[str], str]) -> None:
    """Put the table between the marks of that name; it is made from the one that is there."""
    text = page.read_text("utf-8")
    text = re.sub(
        rf"(<!-- {name} -->\n)(.*?)(<!-- end -->)", lambda m: m[1] + table(m[2]) + m[3], text, flags=re.DOTALL
    )
    page.write_text(text, "utf-8")


def gallery(before: str) -> str:
    """A row for each file, in the order of the page, with the words at its head."""
    order = re.findall(r"^\| \*\*`(\w+)\.toml`", before, re.MULTILINE)
    stems = [*order, *(file.stem for file in sorted(GALLERY.glob("*.toml")) if file.stem not in order)]
    rows = ["| file | picture |", "|---|---|"]
    for stem in stems:
        head = (GALLERY / f"{stem}.toml").read_text("utf-8").partition("title =")[0]
        words = head.removeprefix("# ").replace("\n# ", " ").strip()
        picture = f"![{stem.replace('_', ' ')}](linkages/{stem}.svg){{ width=440 }}"
        rows.append(f"| **`{stem}.toml`** {words} | {picture} [live](live/{stem}.html) |")
    return "\n".join(rows) + "\n"


if __name__ == "__main__":
    for paper in PAPERS:
        rows = [row for row in reproduce() if row.paper == paper]
        write(HERE / "papers.md", f"rows of paper {paper}", lambda _, rows=rows: markdown(rows))
    write(HERE / "linkages.md", "gallery", gallery)
