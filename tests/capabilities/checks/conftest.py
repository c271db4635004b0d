"""One study of a catalogue motor with ratings of its gear, shaft and relay, which several files read."""

from __future__ import annotations

import pytest
from command import chainunit

STUDY = """
title = "Gear and relay"
[system]
motor = "IE3 4-pole 0.75 kW, 80M"
[run]
settle_turns = 2
[[event]]
type = "jam"
side = "left"
[relay]
trip_class = "20"
[gear_rating]
rated_torque = 200
application_factor = 1.4
thermal_power = "2 kW"
overhung_load = "3 kN"
largest_speed = "3000 rev/min"
exponent = 6.6
[motor_shaft]
overhung_load = 500
pulley_diameter = "120 mm"
tension_factor = 1.75
"""


@pytest.fixture(scope="session")
def rated(once):
    """The folder of the results of the study."""

    def fill(folder):
        (folder / "mine.toml").write_text(STUDY, "utf-8")
        assert chainunit("study", "mine.toml", "-o", "out", cwd=folder).returncode == 0

    return once("rated parts", fill) / "out"
