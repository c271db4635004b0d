"""Declared results: their data for a file, and their documentation."""

from __future__ import annotations

import hashlib
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from records import record_of

from chainunit import __version__, linkage
from chainunit.capabilities.blade.analysis import BladeAnalysis
from chainunit.capabilities.comparison import page as comparison
from chainunit.capabilities.handover import page as handover
from chainunit.capabilities.linear import page as linear
from chainunit.capabilities.linear.result import LinearQuestion
from chainunit.core.quantities import Value, declaration, group, quantity
from chainunit.reading.results import OWN, Estimate, InUnit, as_data, derived, documented, part, result
from chainunit.study import config as study_files
from chainunit.study import parts
from chainunit.study.analysis import Work
from chainunit.study.choice import choose
from chainunit.study.config import parse
from chainunit.study.provenance import provenance, study_text
from chainunit.study.rig import Rig
from chainunit.study.stored_result import StoredResult
from chainunit.study.turn import TurnAnalysis


@declaration
class Size:
    """A declared size."""

    length: Value = quantity("m", "length", kind="millimetres")


@declaration
class Nested:
    """A declaration with a group."""

    box: Size = group(Size, "box")


@result
class Limit:
    """A number in a unit of its own."""

    value: float = part("the limited number", unit=OWN)
    unit: str
    kind: str = ""


@result
class Base:
    """A result that others extend."""

    secret: Any
    size: Size = part(inline=True)
    course: Any = quantity("N.m", "torque over the turn")

    @derived("s", name="from")
    def start(self) -> float:
        """Time of the start."""
        return 2.0


@result
class Whole(Base):
    """A result with all kinds of parts."""

    by_name: dict[str, float] = part("masses", unit="kg")
    limits: list[Limit] = part("limits")
    nothing: float | None = part("left out where it is None", unit="1", optional=True, default=None)
    drawn: Any = part("in units of their own", default=())
    words: str = part("words", default="no")


def whole(**more: Any) -> Whole:
    course = np.array([[1.0, math.nan], [2.0, math.inf]])
    return Whole(
        object(), Size(length=0.5), course, {"a": 1.0, "b": None}, [Limit(1.0, "K", "difference")], **more
    )


def test_every_number_has_its_declared_unit():
    drawn = {"q": Estimate(1.0, 0.5, math.inf, "W", "power"), "one": InUnit([1, 2], "rad", title="both")}
    data = as_data(whole(drawn=drawn))
    assert data == {
        "length": {"value": 0.5, "unit": "m", "kind": "millimetres"},
        "course": {"value": [[1.0, None], [2.0, None]], "unit": "N.m"},
        "by_name": {"a": {"value": 1.0, "unit": "kg"}, "b": {"value": None, "unit": "kg"}},
        "limits": [{"value": {"value": 1.0, "unit": "K", "kind": "difference"}}],
        "drawn": {
            "q": {
                "value": 1.0,
                "unit": "W",
                "kind": "power",
                "low": {"value": 0.5, "unit": "W", "kind": "power"},
                "high": {"value": None, "unit": "W", "kind": "power"},
            },
            "one": {"value": [1.0, 2.0], "unit": "rad", "title": "both"},
        },
        "words": "no",
        "from": {"value": 2.0, "unit": "s"},
    }
    assert json.loads(json.dumps(data, allow_nan=False)) == data


def test_titles_are_the_descriptions():
    assert as_data(Nested(box=Size(length=1.0)), titled=True) == {
        "box.length": {"value": 1.0, "unit": "m", "kind": "millimetres", "title": "box: length"}
    }


def test_a_number_without_a_unit_is_no_data():
    with pytest.raises(TypeError, match="has no declared unit"):
        as_data(whole(drawn=[0.5]))
    assert as_data([1, True, None, "x"]) == [1, True, None, "x"]


def test_the_documentation_follows_from_the_declaration():
    assert list(documented(Whole)) == [
        ("length", "m", "length"),
        ("course", "N.m", "torque over the turn"),
        ("by_name.*", "kg", "masses"),
        ("limits.#.value", "", "the limited number"),
        ("nothing", "1", "left out where it is None"),
        ("drawn", "", "in units of their own"),
        ("words", "", "words"),
        ("from", "s", "time of the start"),
    ]


@pytest.mark.parametrize("analysis", [TurnAnalysis, BladeAnalysis])
def test_the_data_of_an_analysis_have_the_documented_names(analysis):
    config = parse(parts.example("knife"))
    drive = choose(config, Path(), lambda *_: None).drive
    found = analysis.find(
        record_of(config, drive),
        Work(Rig(config.operation, drive, {}), print),
    )
    assert set(as_data(found)) == {name.split(".")[0] for name, _, _ in documented(type(found))}


def test_the_provenance_has_the_digest_of_each_file():
    """A study with a linkage file and a catalogue of its own; it is the same each time, and reads back."""
    root = Path(__file__).parents[1] / "examples"
    for name, file in (
        ("own_catalogue.toml", "catalogue/motors.csv"),
        ("beam_pump.toml", "linkages/pump_jack.toml"),
    ):
        about = provenance(study_files.load(root / name))
        assert about == provenance(study_files.load(root / name)) and json.dumps(about)
        assert about["study"]["sha256"] == hashlib.sha256((root / name).read_bytes()).hexdigest()
        assert about["files"][file] == hashlib.sha256((root / file).read_bytes()).hexdigest()
    tables = study_files.of_tables({"machine": {"r": 0.14}}, "tables")
    assert (
        provenance(tables)["seeds"]
        and study_files.parse(study_text(tables.file)).machine.by_name["r"] == 0.14
    )


@pytest.mark.second
def test_a_result_without_a_study_has_its_provenance(tmp_path):
    """Of a linkage, a comparison, a linear model, and files for other programs: the software and the files."""
    file = Path(__file__).parents[1] / "examples" / "linkages" / "slider_crank_press.toml"
    linkage(file, folder=tmp_path / "press")
    linkage(file, folder=tmp_path / "press")  # its own file is replaced
    about = json.loads((tmp_path / "press" / "provenance.json").read_text("utf-8"))
    assert about["files"] == {str(file): hashlib.sha256(file.read_bytes()).hexdigest()}
    assert about["chainunit"] == __version__ and about["libraries"]["numpy"] and about["platform"]
    stored = StoredResult(tmp_path / "result.json", {})
    assert list(comparison.TASK.sources((stored, stored))) == [stored.file] * 2
    assert list(linear.TASK.sources(LinearQuestion("a.toml", config=file))) == [Path("a.toml"), file]
    assert list(handover.TASK.sources(tmp_path)) == [stored.file]
