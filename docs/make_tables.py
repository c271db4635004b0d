"""Writes the generated tables into docs/papers.md."""

import re
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "examples"))

from papers import PAPERS, reproduce
from papers.output import markdown

PAGE = Path(__file__).parent / "papers.md"

text = PAGE.read_text("utf-8")
for paper in PAPERS:
    table = markdown([row for row in reproduce() if row.paper == paper])
    text = re.sub(
        rf"(<!-- rows of paper {paper} -->\n).*?(<!-- end -->)",
        lambda m, table=table: m[1] + table + m[2],
        text,
        flags=re.DOTALL,
    )
PAGE.write_text(text, "utf-8")
