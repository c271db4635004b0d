"""What the benches share: least times, tables, and figures as JSON for docs/evidence.md."""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple


class Least(NamedTuple):
    """The least duration of a call and the least time of processors that it took [s]."""

    wall: float
    processor: float


def least(call: Callable[[], Any], rounds: int = 7) -> Least:
    """The least times of a call over some rounds, after one round that does not count."""
    call()
    times = []
    for _ in range(rounds):
        began, spent = time.perf_counter(), time.process_time()
        call()
        times.append((time.perf_counter() - began, time.process_time() - spent))
    return Least(*map(min, zip(*times, strict=True)))


def parser() -> argparse.ArgumentParser:
    """The options that every bench has."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures to this file")
    return parser


def save(file: Path | None, figures: Any) -> None:
    """Write the figures, if there is a file for them."""
    if file is not None:
        file.write_text(json.dumps(figures, indent=1) + "\n", "utf-8")


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"
