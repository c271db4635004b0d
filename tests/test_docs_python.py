"""docs/python.md: its lines run in order, and print its outputs. The shortest call of an FMU turns the crank."""

from __future__ import annotations

import contextlib
import io
import re
from pathlib import Path

import fmpy
import numpy as np
import pytest

from chainunit import ChainUnitMachine, ChamberForces
from chainunit.fmu.backends import export

pytestmark = pytest.mark.second

PAGE = Path(__file__).parents[1] / "docs" / "python.md"
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def sessions(text):
    """Pairs of a block of Python and the text below it, which is empty where there is none."""
    blocks = BLOCK.findall(text)
    for k, (language, code) in enumerate(blocks):
        shown = blocks[k + 1] if k + 1 < len(blocks) else ("", "")
        if language == "python":
            yield code, shown[1] if shown[0] == "text" else ""


def outputs(text):
    """The output of each block of Python."""
    names: dict[str, object] = {}
    for code, _ in sessions(text):
        out = io.StringIO()
        with contextlib.redirect_stdout(out):
            exec(compile(code, PAGE.name, "exec"), names)
        yield out.getvalue()


@pytest.mark.slow
def test_the_page_shows_what_its_lines_print(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = PAGE.read_text("utf-8")
    shown = [message for _, message in sessions(text)]
    assert len(shown) >= 8 and sum(map(bool, shown)) >= 8
    assert list(outputs(text)) == shown


def test_every_way_of_showing_is_seen():
    text = "```python\nx = 1\n```\n\n```python\nprint(x)\n```\n\n```text\n1\n```\n"
    assert list(sessions(text)) == [("x = 1\n", ""), ("print(x)\n", "1\n")]
    assert list(outputs(text)) == ["", "1\n"]


def test_the_shortest_call_of_an_fmu_turns_the_crank(tmp_path, monkeypatch):
    """Its rows are those of the machine in Python over a turn of the crank."""
    monkeypatch.chdir(tmp_path)
    export(ChamberForces, tmp_path / "ChamberForces.fmu", fmi=3)
    motion = np.array(
        [(0.0, 0.0, 150.0), (2.1, 315.0, 150.0)], [("time", float), ("phi", float), ("w", float)]
    )
    rows = fmpy.simulate_fmu("ChamberForces.fmu", stop_time=2.1, start_values={"ratio": 50.0}, input=motion)
    phi = 150.0 * rows["time"] / 50.0
    assert phi[-1] >= 1.99 * np.pi and len(rows) > 100
    start = ChamberForces.Inputs()
    alone = ChainUnitMachine().forces(phi, w=3.0, left=start.left, right=start.right)
    assert np.ptp(alone.tau) > 50.0
    for name, values in (("tau", alone.tau / 50.0), ("pivot.fx", alone.pivot.fx)):
        assert rows[name] == pytest.approx(values, rel=1e-12, abs=1e-12 * np.max(np.abs(values)))
