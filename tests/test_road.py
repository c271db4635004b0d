"""A number of a file comes into the C code of an FMU through few files of the package."""

import runpy
from pathlib import Path

import pytest

ROAD = runpy.run_path(str(Path(__file__).parents[1] / "bench" / "road.py"))
MOST = {
    "machine of a study file": (25, 100),
    "system of a study file": (29, 180),
    "linkage file": (25, 180),
}
"""By road, the most files through which the number goes, and the most moves between them."""


@pytest.mark.second
@pytest.mark.parametrize("name", MOST)
def test_a_number_has_a_straight_road_to_c(name, tmp_path):
    command = ROAD["commands"](tmp_path)[name]
    trail = ROAD["road"](command)
    files, moves = MOST[name]
    # the number came to C
    assert {"fmu/native/generate.py", "core/printing/c_forms.py"} <= set(trail.files)
    assert len(trail.files) <= files, sorted(trail.files)
    assert trail.moves <= moves


@pytest.mark.second
def test_a_number_that_is_nowhere_has_no_road(tmp_path):
    assert ROAD["road"](["export", "DcMotor", "-o", str(tmp_path / "it.fmu")]).moves == 0
