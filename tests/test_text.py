"""Numbers as people read them: one form by unit and kind, in letters of a page and in plain ones."""

from __future__ import annotations

import math

import pytest

from chainunit.core.errors import InputError
from chainunit.reading.text import chosen_units, entry, forms, number
from chainunit.study.measures import torque_reserve


@pytest.mark.parametrize(
    ("value", "unit", "kind", "page", "terminal"),
    [
        (44.2248, "N.m", "", ("44.2", "N\u00a0m"), "44.2 N m"),
        (9876.6, "N", "", ("9877", "N"), "9877 N"),
        (12345.6, "N", "", ("12.3", "kN"), "12.3 kN"),
        (37901.0, "J", "", ("37.9", "kJ"), "37.9 kJ"),
        (5271.0, "J", "", ("5271", "J"), "5271 J"),
        (-73458.0, "N.m", "", ("−73.5", "kN\u00a0m"), "-73.5 kN m"),
        (6e6, "N/m2", "", ("6.00", "MPa"), "6.00 MPa"),
        (0.0, "W", "", ("0", "W"), "0 W"),
        (1.56e-11, "W", "", ("0", "W"), "0 W"),
        (0.256, "W", "", ("0.256", "W"), "0.256 W"),
        (25.6, "W", "", ("25.6", "W"), "25.6 W"),
        (-995.2, "N", "", ("−995", "N"), "-995 N"),
        (2.3392e-7, "kg.m2", "", ("2.34\u00a0×\u00a010⁻⁷", "kg\u00a0m²"), "2.34e-7 kg m²"),
        (math.radians(9.06), "rad", "", ("9.06", "°"), "9.06 deg"),
        (313.15, "K", "", ("40.0", "°C"), "40.0 degC"),
        (80.0, "K", "difference", ("80.0", "K"), "80.0 K"),
        (1.5707963, "rad/s", "", ("1.57", "rad/s"), "1.57 rad/s"),
        (63246.0, "N.m/rad", "assumed", ("60\u202f000", "N\u00a0m/rad"), "60000 N m/rad"),
        (6324.6, "N.m/rad", "assumed", ("6000", "N\u00a0m/rad"), "6000 N m/rad"),
        (-0.2349, "m", "millimetres", ("−235", "mm"), "-235 mm"),
        (2200.0, "W", "", ("2.20", "kW"), "2.20 kW"),
        (1.43, "1", "", ("1.43", ""), "1.43"),
        # one form of a share, whatever its size
        (0.809, "1", "percent", ("80.9", "%"), "80.9 %"),
        (1.19e-6, "1", "percent", ("0", "%"), "0 %"),
        (-0.037, "1", "percent", ("−3.70", "%"), "-3.70 %"),
        (32.9853, "1", "percent", ("over 1000", "%"), "over 1000 %"),
        (-32.9853, "1", "percent", ("below −1000", "%"), "below -1000 %"),
        # a shaft cannot lose more than its speed but by turning back
        (0.1349, "1", "dip", ("13.5", "%"), "13.5 %"),
        (1.0, "1", "dip", ("stands", ""), "stands"),
        (1.6815, "1", "dip", ("turns back", ""), "turns back"),
        (0.71, "1", "used", ("71.0", "%"), "71.0 %"),
        (10.0, "1", "used", ("1000", "%"), "1000 %"),
        (15.09, "1", "used", ("15.1", "times"), "15.1 times"),
        (2e4, "1", "used", ("over 1000", "times"), "over 1000 times"),
    ],
)
def test_one_form_by_unit_and_kind(value, unit, kind, page, terminal):
    assert forms(value, unit, kind) == [page]
    assert number(value, unit, kind) == terminal


def test_a_speed_is_shown_in_both_units():
    assert forms(1.5707963, "rad/s", "speed") == [("1.57", "rad/s"), ("15.0", "rev/min")]
    assert number(1.5707963, "rad/s", "speed") == "1.57 rad/s (15.0 rev/min)"
    # beside a number as it was given the other one is a result
    assert number(3.0, "rad/s", "speed", 6, full=False) == "3 rad/s (28.6 rev/min)"
    assert number(260.98, "rad/s", "frequency", 5) == "260.98 rad/s (41.536 Hz)"


def test_the_engineer_chooses_units():
    units = chosen_units({"speed": "rev/min", "power": "W", "torque": "kN.m"})
    assert number(1.5707963, "rad/s", "speed", units=units) == "15.0 rev/min"
    assert number(2200.0, "W", units=units) == "2200 W"
    assert number(1461.0, "N.m", units=units) == "1.46 kN m"
    # what is no speed stays, and so do shares of a unit that may be chosen
    assert (
        number(5.0, "rad/s", units=units) == "5.00 rad/s"
        and number(0.5, "1", "percent", units=units) == "50.0 %"
    )
    for values, words in (
        ({"mass": "t"}, "report.units.mass: unknown kind; must be one of speed, power, torque, force, work"),
        ({"speed": "rpm"}, 'report.units.speed = "rpm": must be "rad/s" or "rev/min"'),
    ):
        with pytest.raises(InputError) as refusal:
            chosen_units(values)
        assert str(refusal.value) == words


def test_what_is_not_there():
    assert (
        number(None, "N") == number(math.nan, "N") == "-"
        and number(None, "s", none="not reached") == "not reached"
    )
    assert number(math.inf, "rad/s") == "inf rad/s"
    assert entry(math.inf, "rad/s") == {"value": None, "unit": "rad/s"}
    assert entry(0.5, "1", "percent") == {"value": 0.5, "unit": "1", "kind": "percent"}


def test_the_reserve_is_what_the_limit_leaves():
    """At the current limit nothing is left; half the torque leaves half; a transient may pass the steady limit."""
    assert [torque_reserve(5.588, peak) for peak in (5.588, 2.794, 0.0)] == [0.0, 0.5, 1.0]
    assert torque_reserve(20.0, 22.0) == pytest.approx(-0.1)
    # the least over a run, of the limit that holds at the instant; -1 where there is none, or twice it is passed
    assert torque_reserve([20.0, 5.0, 8.0], [10.0, -4.0, 4.0]) == pytest.approx(0.2)
    assert [torque_reserve(limit, 3.0) for limit in (1.0, 0.0, -2.0)] == [-1.0, -1.0, -1.0]
