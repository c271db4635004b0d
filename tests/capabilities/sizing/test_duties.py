"""The duties of docs/drives.md, "Ten duties, by the program and by hand": its choices are those of the program."""

from __future__ import annotations

from pathlib import Path

import pytest
from sizings import sized_by

from chainunit.study.config import load

DUTIES = Path(__file__).parents[2] / "data" / "duties"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "motor", "ratio", "flywheel"),
    [],
)
def test_the_choices_of_the_table_are_the_programs(name, motor, ratio, flywheel, tmp_path):
    best = sized_by(load(DUTIES / f"{name}.toml"), tmp_path).chosen_candidate
    assert best is not None and (best.motor.designation, best.drive.ratio) == (motor, ratio)
    # the search ends at a tenth of the flywheel
    assert best.drive.added_inertia == pytest.approx(flywheel, rel=0.02)
