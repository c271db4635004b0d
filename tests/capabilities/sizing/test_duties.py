"""The duties of docs/drives.md, "Ten duties, by the program and by hand": its choices are those of the program."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from chainunit.study.config import load
from chainunit.study.result import as_dict
from chainunit.study.run import run_study

DUTIES = Path(__file__).parents[2] / "data" / "duties"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "motor", "ratio", "flywheel", "gear", "relay"),
    [
        ("d1", "IE3 4-pole 0.12 kW, 63M", 53.0, 0.0, 65.5, 0.445),
        ("d2", "IE3 4-pole 0.55 kW, 80M", 100.0, 0.057, 693.0, 1.33),
        ("d5", "IE3 4-pole 4 kW, 112M", 10.0, 0.0, 413.0, 4.64),
        ("d6", "IE3 4-pole 4 kW, 112M", 37.5, 0.0, 1630.0, 8.04),
        ("m3", "IE3 4-pole 3 kW, 100L", 20.86, 0.15, None, None),
        ("sixdrive", "Y 80 0.55", 15.6, 0.0, 60.0, 1.33),
        ("beamdrive", "IE3 4-pole 18.5 kW, 180M", 150.0, 0.0, 27600.0, 34.3),
        ("jawdrive", "X 315S 110", 5.3, 0.0, None, 110.4),
        ("convdrive", "IE3 4-pole 1.1 kW, 90S", 3.55, 0.063, None, 2.45),
    ],
)
def test_the_choices_of_the_table_are_the_programs(name, motor, ratio, flywheel, gear, relay, tmp_path):
    study = run_study(load(DUTIES / f"{name}.toml"), tmp_path)
    result = as_dict(study)
    (tmp_path / "result.json").write_text(json.dumps(result), encoding="utf-8")
    assert study.setup.plate.designation == motor and study.setup.drive.ratio == pytest.approx(
        ratio, abs=0.005
    )
    # the search ends at a tenth of the flywheel
    assert study.setup.drive.added_inertia == pytest.approx(flywheel, rel=0.02)
    sizing = result.get("sizing") or {}
    orders = (("gear", "rated_torque", gear), ("protection", "relay_current", relay))
    for part, name, value in orders:
        ordered = sizing.get(part, {}).get(name, {}).get("value")
        assert ordered == (value and pytest.approx(value, rel=0.01)), name
