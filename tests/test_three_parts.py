"""result.json has three parts: given values, runs and findings; the names of an earlier version stay readable."""

from __future__ import annotations

import json

import pytest

from chainunit.core.errors import InputError
from chainunit.reading.result_entries import PARTS, ResultEntries
from chainunit.report import blocks as b
from chainunit.study.stored_result import read_result

PACKAGED = {
    "chainunit": "1",
    "title": "A mill",
    "given": {"run": {"turns": {"value": 2.0, "unit": "1"}}, "chain": {"eta": {"value": 1.0, "unit": "1"}}},
    "runs": {"answers": {"steady": {"speed_mean": {"value": 3.0, "unit": "rad/s"}}}, "ripple": None},
    "findings": {"chain": {"turns": {"value": 30, "unit": "1"}}, "ripple": {"value": 0.1, "unit": "1"}},
}
FLAT = {
    "chainunit": "1",
    "title": "A mill",
    "run": PACKAGED["given"]["run"],
    "answers": PACKAGED["runs"]["answers"],
    "chain": PACKAGED["given"]["chain"] | PACKAGED["findings"]["chain"],
    "ripple": PACKAGED["findings"]["ripple"],
}


def test_each_entry_keeps_its_earlier_name():
    entries = ResultEntries(PACKAGED)
    for name, entry in FLAT.items():
        assert name in entries and entries[name] == entries.get(name) == entry
    assert "sizing" not in entries and entries.get("sizing") is None and entries.get("sizing", 1) == 1
    with pytest.raises(KeyError, match="sizing"):
        entries["sizing"]
    # as a file it has three parts
    assert list(json.loads(json.dumps(entries))) == ["chainunit", "title", *PARTS]


def test_a_file_of_an_earlier_version_is_read(tmp_path):
    for name, data in (("now", PACKAGED), ("earlier", FLAT)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "result.json").write_text(json.dumps(data))
        stored = read_result(tmp_path / name)
        assert stored.data["answers"] == FLAT["answers"] and stored.data["chain"] == FLAT["chain"]
    (tmp_path / "now" / "result.json").write_text(json.dumps({"chainunit": "1", "runs": {}}))
    with pytest.raises(InputError, match="is no result of a study"):
        read_result(tmp_path / "now")


def test_a_number_names_its_part():
    """A page may leave the part out; the number has its whole place in the file."""
    s = b.Source(ResultEntries(PACKAGED))
    assert s.number("answers.steady.speed_mean").path == "runs.answers.steady.speed_mean"
    assert s.number("run.turns").path == "given.run.turns" and s.words("title").path == "title"
    assert s.number("chain.turns").path == "findings.chain.turns"
    assert s.number("chain.eta").path == "given.chain.eta"
    earlier = b.Source(ResultEntries(FLAT))
    assert earlier.number("chain.eta").path == "chain.eta"
