"""A study reports its progress from the first second on."""

import pytest

from chainunit.fmu import backends
from chainunit.study.config import parse
from chainunit.study.run import run_study

pytestmark = pytest.mark.second

SHORT = "event = []\n[run]\ncrank_speed = 3\nramp = 0.3\nsettle_turns = 0\nstep = 2e-3\n"


def _said(folder, **more):
    messages = []
    study = run_study(
        parse(SHORT), folder, lambda what, done, todo: messages.append((what, done, todo)), **more
    )
    return study, messages


def test_the_export_of_each_fmu_is_told(tmp_path):
    study, message = _said(tmp_path)
    words = [what for what, *_ in message]
    for name in ("ChamberForces", "DcMotor"):
        assert f"{name}: exporting" in words
    assert words.index("DcMotor: exporting") < words.index("start-up and steady running")
    assert all(0.0 <= done <= todo for _, done, todo in message)
    assert not [note for note in study.findings.notes if note.code == "no-compiler"]


def test_without_a_compiler_it_is_told_how_to_have_one(tmp_path, monkeypatch):
    monkeypatch.setattr(backends.targets, "compiles", lambda fmi: False)
    study, _ = _said(tmp_path)
    (note,) = [note for note in study.findings.notes if note.code == "no-compiler"]
    assert "chainunit[cross]" in note.text and study.runs.fmus["machine"].backend == "python"
    # where the user asks for Python there is nothing to say
    study, _ = _said(tmp_path / "asked", backend="python")
    assert not [note for note in study.findings.notes if note.code == "no-compiler"]
