"""The pages of docs/: their commands run and print what stands there, their drawings are current, and the site builds
without a broken link and without files from other servers.

A page is a walk: its blocks run in their order in one folder. A block that is fenced as ``sh`` runs in a shell,
``python`` in one process for the whole page; one with a ``title`` is written to the file of that name. A ``text``
block behind a command is an excerpt of what it prints: each of its lines occurs there, in this order, whatever the
width of the terminal; a line of three dots stands for what is left out.
"""

from __future__ import annotations

import contextlib
import importlib.util
import io
import os
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from command import chainunit

from chainunit.study.config import load
from chainunit.study.run import run_study

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
FENCE = re.compile(r"^( *)```(\w*)(?: title=\"([^\"]+)\")?\n(.*?)^\1```$", re.DOTALL | re.MULTILINE)
INCLUDE = re.compile(r'^--8<-- "([^"]+)"\n', re.MULTILINE)
"""A line that stands for a file, as `pymdownx.snippets` has it."""
GENERATED = re.compile(r"<!-- (?:rows of paper \d+|gallery) -->\n.*?<!-- end -->", re.DOTALL)
"""A table that `docs/make_tables.py` writes."""
KEYS_OF = re.compile(r"chainunit keys ([A-Za-z_]+)`")
INSTALLS = ("pip install", "python3 -m venv")
"""Commands that `.ci/run` runs."""
README = ROOT / "README.md"
PAGES = (README, *sorted(DOCS.rglob("*.md")))
"""Whose commands run."""
QUICK = ("docs/system.md",)
"""Pages that take some seconds; the others run in `.ci/full`."""
OWN_TEST = ("docs/python.md",)
"""Of these `test_docs_python` compares every line."""


class Block(NamedTuple):
    kind: str
    file: str
    text: str


def blocks(page: Path) -> list[Block]:
    """The fenced blocks of a page, in order, with the files that it includes."""
    text = INCLUDE.sub(lambda line: (ROOT / line[1]).read_text("utf-8"), page.read_text("utf-8"))
    results = []
    for indent, kind, file, body in FENCE.findall(text):
        body = re.sub(rf"^{indent}", "", body, flags=re.MULTILINE) if indent else body
        results.append(Block(kind, file, body))
    return results


def _walks() -> list:
    """Pages that have something to run, the slow ones marked."""
    pages = [page for page in PAGES if any(b.kind in ("sh", "python") for b in blocks(page))]
    names = [page.relative_to(ROOT).as_posix() for page in pages]
    assert set(QUICK) <= set(names)
    return [
        pytest.param(name, marks=() if name in QUICK else pytest.mark.slow)
        for name in names
        if name not in OWN_TEST
    ]


def _collapsed(text: str) -> str:
    return " ".join(text.split())


def missing(excerpt: str, printed: str) -> str | None:
    """The first line of the excerpt that was not printed after the ones before it."""
    whole, at = _collapsed(printed), 0
    for line in map(_collapsed, excerpt.splitlines()):
        if line in ("", "..."):
            continue
        result = whole.find(line, at)
        if result < 0:
            return line
        at = result + len(line)
    return None


class Walk:
    """A reader who follows a page in a folder."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.names = folder, {"__name__": "__main__"}
        tools = folder / ".tools"
        tools.mkdir()
        for name, call in (("chainunit", "-m chainunit"), ("python", "")):
            (tools / name).write_text(f'#!/bin/sh\nexec "{sys.executable}" {call} "$@"\n')
            (tools / name).chmod(0o755)
        paths = [str(tools), str(Path(sys.executable).parent), os.environ["PATH"]]
        self.environment = os.environ | {"PATH": os.pathsep.join(paths), "COLUMNS": "80"}
        (folder / "examples").symlink_to(ROOT / "examples")

    def shell(self, text: str) -> str:
        """The output and the errors of the commands."""
        process = subprocess.run(
            ["bash", "-c", text], cwd=self.folder, env=self.environment, capture_output=True, text=True
        )
        # 3: an alarm
        assert process.returncode in (0, 2, 3), process.stdout[-2000:] + process.stderr[-2000:]
        assert process.returncode != 2 or process.stderr, text
        return process.stdout + process.stderr

    def python(self, text: str) -> str:
        """The output of the code; its names stay for the next block."""
        printout = io.StringIO()
        with contextlib.redirect_stdout(printout), contextlib.chdir(self.folder):
            exec(compile(text, "page", "exec"), self.names)
        return printout.getvalue()


@pytest.mark.second
@pytest.mark.parametrize("page", _walks())
def test_a_page_prints_what_stands_there(page, tmp_path):
    walk, printout = Walk(tmp_path), None
    for block in blocks(ROOT / page):
        if block.file:
            (tmp_path / block.file).write_text(block.text, "utf-8")
        elif block.kind == "sh" and not any(word in block.text for word in INSTALLS):
            printout = walk.shell(block.text.replace(". .venv/bin/activate\n", ""))
        elif block.kind == "sh" and "/chainunit study" in block.text:
            # the command behind the installation
            printout = walk.shell(block.text.rpartition("/bin/")[2])
        elif block.kind == "python":
            printout = walk.python(block.text)
        elif block.kind == "text" and printout is not None:
            assert block.text.strip(), f"{page}: an empty excerpt"
            assert missing(block.text, printout) is None, printout[-4000:]
        else:
            printout = None
    # a drawing that the page makes is the one that it shows
    for shown in re.findall(r"\]\(([^)]*[.]svg)\)", (ROOT / page).read_text("utf-8")):
        made = tmp_path / Path(shown).name
        assert not made.exists() or made.read_text() == ((ROOT / page).parent / shown).read_text(), shown


def test_the_pages_are_few_and_short():
    """Tables that a script writes are not counted; of docs/evidence.md the text counts into which it puts them."""
    pages = sorted(DOCS.rglob("*.md"))
    assert len(pages) <= 25
    texts = [(ROOT / "bench" if page.name == "evidence.md" else page.parent) / page.name for page in pages]
    words = [len(GENERATED.sub("", text.read_text("utf-8")).split()) for text in texts]
    assert sum(words) <= 45_000, dict(zip((page.stem for page in pages), words, strict=True))


def test_the_tables_of_keys_that_pages_name_are_there():
    texts = [page.read_text("utf-8") for page in PAGES]
    names = sorted({name for text in texts for name in KEYS_OF.findall(text)} - {"TABLE"})
    assert len(names) > 5
    for name in names:
        done = chainunit("keys", name, cwd=ROOT)
        assert done.returncode == 0, done.stderr


def test_an_excerpt_is_compared_line_by_line():
    printout = "a b\n c   d\ne"
    assert missing("a b\nc d", printout) is None
    assert missing("a\n...\ne\n", printout) is None
    assert missing("c d\na b", printout) == "a b"
    assert missing("a b\nx", printout) == "x"


def test_the_drawings_are_those_of_the_machines():
    """Else run docs/draw_machines.py."""
    spec = importlib.util.spec_from_file_location("draw_machines", DOCS / "draw_machines.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    for file, text in module.pictures().items():
        assert file.read_text("utf-8") == text, file.name


class _Fetched(HTMLParser):
    """What a browser fetches to show a page."""

    def __init__(self) -> None:
        super().__init__()
        self.places: list[str] = []

    def handle_starttag(self, tag, attributes):
        own = dict(attributes)
        if tag == "link" and own.get("rel") not in ("canonical", "prev", "next"):
            self.places.append(own.get("href") or "")
        elif tag in ("img", "script", "iframe", "source"):
            self.places.append(own.get("src") or "")


@pytest.mark.slow
def test_the_site_builds_without_a_broken_link_and_fetches_nothing(tmp_path):
    pytest.importorskip("mkdocs")
    pytest.importorskip("material")
    pytest.importorskip("mkdocstrings")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "-d", str(tmp_path / "site")]
    process = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert process.returncode == 0, process.stderr
    pages = list((tmp_path / "site").rglob("*.html"))
    assert len(pages) > 20
    for page in pages:
        fetched = _Fetched()
        fetched.feed(page.read_text("utf-8"))
        assert fetched.places and not [place for place in fetched.places if "//" in place], page
    for style in (tmp_path / "site").rglob("*.css"):
        assert not re.search(r"(?:@import|url\()\s*[\"']?(?:https?:)?//", style.read_text("utf-8")), style


@pytest.mark.second
def test_the_readme_is_short_and_its_overload_is_that_of_the_study(tmp_path):
    """The printed comparison, from the series of the packaged study over two turns, before the overload and after."""
    text = README.read_text("utf-8")
    assert len(text.splitlines()) <= 110
    assert (ROOT / "examples" / "one_sided_overload.py").read_text("utf-8") in text
    study = run_study(load(), tmp_path)
    turns = 4.0 * np.pi / study.setup.config.run.crank_speed
    results = []
    for run in ("start_up", "feed_left"):
        last = study.runs.series[run].isel(
            time=study.runs.series[run]["time"] > study.runs.series[run]["time"][-1] - turns
        )
        crank = np.abs(last["machine.tau"].values).max()
        current = last["motor.armature.i"].values
        rocker = np.abs(last["machine.rocker.tau"].values).max()
        results.append((crank * study.setup.config.machine.p.ratio, rocker, np.sqrt(np.mean(current**2))))
    printed = re.findall(r"crank +(\S+) N m +rocker +(\S+) N m +current +(\S+) A RMS", text)
    np.testing.assert_allclose(np.array(printed, float), results, rtol=0.02)
    more, current = (
        int(share)
        for share in re.search(r"shows (\d+) % more; the rocker carries (\d+) %", text).groups()[::-1]
    )
    assert 100.0 * (float(printed[1][1]) / float(printed[0][1]) - 1.0) == pytest.approx(more, abs=0.5)
    assert 100.0 * (float(printed[1][2]) / float(printed[0][2]) - 1.0) == pytest.approx(current, abs=0.5)
