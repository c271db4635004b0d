"""The duties of docs/drives.md, "Ten duties, by the program and by hand": its choices are those of the program."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from sizings import sized_by

from chainunit.study.config import load

DUTIES = Path(__file__).parents[2] / "data" / "duties"
PAGE = (Path(__file__).parents[3] / "docs" / "drives.md").read_text("utf-8")
ROW = re.compile(
    r"^\| `(\w+)`.*\| ([\d.]+) kW(?:, (\d) poles)?, (?:ratio|belt|gear) ([\d.]+)(?:, flywheel ([\d.]+))?",
    re.MULTILINE,
)
CHOICES = ROW.findall(PAGE.partition("## Ten duties")[2].partition("\n## ")[0])


def test_every_choice_of_the_table_is_read():
    assert len(CHOICES) == 9  # the tenth file gives its motor


@pytest.mark.slow
@pytest.mark.parametrize(("name", "power", "poles", "ratio", "flywheel"), CHOICES)
def test_the_choices_of_the_table_are_the_programs(name, power, poles, ratio, flywheel, tmp_path):
    best = sized_by(load(DUTIES / f"{name}.toml"), tmp_path).chosen_candidate
    assert best is not None
    assert best.motor.nameplate.power == pytest.approx(1e3 * float(power))
    assert best.motor.nameplate.poles == float(poles or 4)
    assert best.drive.ratio == pytest.approx(float(ratio))
    # the search ends at a tenth of the flywheel
    assert best.drive.added_inertia == pytest.approx(float(flywheel or 0.0), rel=0.02)
