"""A hook of mkdocs: the live pages of the packaged machine and of the gallery, written into the site."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from chainunit.report.html import render
from chainunit.report.live.page import live_page

GALLERY = Path(__file__).parents[1] / "examples" / "linkages"
PACKAGED = "live/chain-unit.html"


def pages() -> Iterator[tuple[str, Path | None]]:
    """The place of each page in the site, and its file; None for the packaged study."""
    yield PACKAGED, None
    for file in sorted(GALLERY.glob("*.toml")):
        yield f"live/{file.stem}.html", file


def on_files(files: Any, config: Any) -> Any:
    """Add the pages to the files of the site."""
    from mkdocs.structure.files import File

    with tempfile.TemporaryDirectory() as folder:
        for place, file in pages():
            text = render(live_page(file, None, Path(folder)))
            files.append(File.generated(config, place, content=text))
    return files
