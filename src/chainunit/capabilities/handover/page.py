"""The report on a handover: what the files say by the names of the template, and what they leave open."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from ... import __version__
from ...core.files import atomic_file, write_file
from ...report import blocks as b
from ...report.lines import Name, Words
from ...report.task import Task, Writer
from ...study.record import LOAD_CYCLE
from ...work.progress import TaskProgress
from .candidates import CANDIDATES, candidates_csv
from .checks import CHECKS, checks_csv
from .content import CYCLE, MEDIA_TYPES, RUN, STUDY, content_of
from .cycle import as_csv
from .shell import Content, LinkedFile, TextRange, aasx_modules, environment, write_aasx
from .studied import StudiedDrive, read_study
from .template import ROOT, elements, numbered

AASX, JSON = "sizing.aasx", "sizing.json"


class HandoverQuestion(NamedTuple):
    """The folder of a study whose files are asked for, with or without the package in AASX."""

    results: Path
    aasx: bool = True


@dataclass(frozen=True)
class Handover:
    """The files for others, ready to be written."""

    study: StudiedDrive
    content: Content
    files: Mapping[str, bytes]
    """the files beside the shell, by name"""
    aasx: bool
    """whether the package is asked for"""

    @property
    def identity(self) -> str:
        """A text that is the same for the same result."""
        return self.files[STUDY].decode("utf-8")

    @property
    def title(self) -> str:
        """The title of the study."""
        return self.study.text("title")


def hand_over(question: HandoverQuestion) -> Handover:
    """The files for others of a study in its folder; no run is made.

    Raises
    ------
    InputError
        see `chainunit.capabilities.handover.studied.read_study`; without basyx-python-sdk where an AASX is asked for.
    """
    if question.aasx:
        aasx_modules()  # where they are missing, before anything is written
    study = read_study(question.results)
    texts = {CYCLE: as_csv(study.steady), RUN: as_csv(study.run)}
    files = {STUDY: study.files[study.result.file.name], LOAD_CYCLE: study.files[LOAD_CYCLE]}
    files |= {name: text.encode("utf-8") for name, text in texts.items()}
    return Handover(study, content_of(study), files, question.aasx)


def _leaves(content: Content, path: str, shown: str) -> Iterator[tuple[str, str, Any]]:
    """Path in the template, name in the file and value of each element without elements below it."""
    for name, value in content.items():
        for i, each in enumerate(value if isinstance(value, list) else [value]):
            own = f"{shown}/{numbered(name, i)}".removeprefix("/")
            if isinstance(each, Mapping):
                yield from _leaves(each, f"{path}/{name}", own)
            else:
                yield f"{path}/{name}", own, each


def data_of(found: Handover) -> dict[str, Any]:
    """The content of handover.json: ``said``, by the name in the file the value and the unit of each element;
    ``open``, the elements that the template requires and the study does not know; ``absent``, all others of the
    template."""
    said: dict[str, Any] = {}
    unknown, used = [], set()
    for path, name, value in _leaves(found.content, ROOT, ""):
        used.add(path)
        if value is None:
            # the columns of a motion file are there to be named
            unknown += [] if "/MetadataRotativeMotionFile/" in path else [name]
            continue
        said[name] = {"value": _plain(value), "unit": elements()[path].unit}
    above = {path.rsplit("/", n)[0] for path in used for n in range(path.count("/") + 1)}
    return {
        "chainunit": __version__,
        "title": found.title,
        "source": str(found.study.result.file),
        "template": "IDTA 02021-1-0-1",
        "said": said,
        "open": unknown,
        "absent": [path.removeprefix(f"{ROOT}/") for path in elements() if path not in used | above],
    }


def _plain(value: Any) -> Any:
    if isinstance(value, LinkedFile):
        return value.name
    if isinstance(value, TextRange):
        ends = (("from", value.low), ("up to", value.high))
        return " ".join(f"{word} {end}" for word, end in ends if end is not None)
    return value


def handover_report(found: Handover) -> b.Report:
    """The report on a handover."""
    result = data_of(found)
    s = b.Source(result)
    return b.Report(
        "Files for others",
        "Handover",
        result,
        tuple(_opening(s)),
        (b.Section("left-open", "What the files leave open", tuple(_left_open(s))),),
        source=s.line("{source} · chainunit {chainunit}"),
        opening_title="What the files say",
    )


def _opening(s: b.Source) -> Iterator[b.Block]:
    begin = "{title}: by" if s.result["title"] else "By"
    yield b.Text(s.line(f"{begin} the names of {{template}}, Sizing of Power Drive Trains."))
    rows = []
    for name, entry in s.result["said"].items():
        value = entry["value"]
        text = f"{value:.5g}" if isinstance(value, float) else str(value)
        shown = Words(f"{text} {entry['unit']}".strip(), f"said.{name}.value")
        rows.append(b.TableRow((Name(name), shown)))
    yield b.Text(f"{len(rows)} elements have a value.", form="short")
    heads = b.heads("element", "value")
    yield b.Table(tuple(rows), heads, numeric=False, title="Elements of the submodel", form="long")


def _left_open(s: b.Source) -> Iterator[b.Block]:
    yield b.Text("The template requires these elements, and a study does not know them; fill them in:")
    rows = tuple(b.TableRow((Name(name),)) for name in s.result["open"])
    yield b.Table(rows, b.heads("element"), numeric=False, title="Elements without a value")
    absent = len(s.result["absent"])
    yield b.Text(f"{absent} other elements of the template are not in the files; handover.json names them.")


def _write_aasx(found: Handover, folder: Path) -> list[Path]:
    with atomic_file(folder / AASX) as part:
        write_aasx(found.content, found.identity, found.title, found.files, MEDIA_TYPES, part)
    return [folder / AASX]


def _writers(found: Handover, report: b.Report, folder: Path, of_report: list[Writer]) -> list[Writer]:
    shell = environment(found.content, found.identity, found.title)
    files = {JSON: json.dumps(shell, indent=1, ensure_ascii=False).encode("utf-8")} | dict(found.files)
    if found.study.candidates:
        files[CANDIDATES] = candidates_csv(found.study.candidates).encode("utf-8")
    if found.study.checks:
        files[CHECKS] = checks_csv(found.study.checks).encode("utf-8")
    own: list[Writer] = [partial(write_file, folder / name, content) for name, content in files.items()]
    if found.aasx:
        own.insert(0, partial(_write_aasx, found, folder))
    return [*own, *of_report]


def _compute(question: HandoverQuestion, folder: Path | None, progress: TaskProgress) -> Handover:
    progress("reading the study", 0.0, 1.0)
    return hand_over(question)


TASK: Task[HandoverQuestion, Handover] = Task(
    "handover",
    _compute,
    handover_report,
    files=(AASX, JSON, CYCLE, RUN, LOAD_CYCLE, STUDY, CANDIDATES, CHECKS),
    writers=_writers,
)


def save(results: str | Path, folder: str | Path, *, aasx: bool = True) -> list[Path]:
    """Write the files for others of the study in the folder `results` to a `folder`, and return them.

    Raises
    ------
    InputError
        see `hand_over`; for a folder with another result, or with files that chainunit did not write.
    WriteError
        for a file that cannot be written; the others are written.
    """
    question, out = HandoverQuestion(Path(results), aasx), Path(folder)
    with TASK.claimed(question, out):
        found = TASK.outcome(question, out, lambda *said: None)
        written, unwritten = TASK.write(question, found, TASK.report(found), out)
    if unwritten is not None:
        raise unwritten
    return written
