"""What a refused linkage is told: the gap and the lengths that close it, and names of points that look alike."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from between_links import FIVE_BAR

from chainunit.core.errors import InputError
from chainunit.machines.linkages.file import description_of
from chainunit.machines.linkages.model import machine_of
from chainunit.machines.machine import Machine
from chainunit.reading.tables import toml

FOUR_BAR = """
[parameters]
r = "50 mm"
l = "600 mm"
h = "400 mm"
[ground]
O1 = [0, 0]
O2 = ["600 mm", "400 mm"]
[driver]
link = "crank"
[links.crank]
points = { O1 = [0, 0], A = ["r", 0] }
mass = 2
[links.coupler]
points = { A = [0, 0], B = ["l", 0] }
[links.rocker]
points = { O2 = [0, 0], B = ["h", 0] }
[start]
points = { B = ["600 mm", 0] }
"""
SLIDER = FOUR_BAR.replace('h = "400 mm"', 'h = "20 mm"').replace(
    '[links.rocker]\npoints = { O2 = [0, 0], B = ["h", 0] }', "[links.ram]\npoints = { B = [0, 0] }"
).replace('O2 = ["600 mm", "400 mm"]', 'G = [0, "h"]\nG2 = [1, "h"]').replace(
    "[start]", '[joints.guide]\non = "ram.B"\nby = "ground.G"\ntoward = "G2"\n[start]'
)  # fmt: skip


def machine(text, **values):
    return Machine(machine_of(description_of(toml(text), "mine")), values)


@pytest.mark.parametrize("values", [{"l": 0.3}, {"l": 1.2}, {"h": 0.1}, {"h": 1.3}])
def test_a_dyad_that_does_not_close_is_told_with_gap_and_lengths(values):
    """The pins A and O2 are sqrt(0.52) m -+ r apart: the limits in the refusal close it, and none beyond."""
    (name, value), known = next(iter(values.items())), {"l": 0.6, "h": 0.4} | values
    with pytest.raises(
        InputError, match=r"cannot close at \S+ deg of crank: its pins A and O2 are"
    ) as caught:
        machine(FOUR_BAR, **values)
    other = known["h" if name == "l" else "l"]
    far, near = math.sqrt(0.52) + 0.05, math.sqrt(0.52) - 0.05
    link = {"l": "coupler", "h": "rocker"}[name]
    limits = re.search(rf"length of {link} between (\S+) mm and (\S+) mm", str(caught.value))
    low, high = (1e-3 * float(x) for x in limits.groups())
    assert low == pytest.approx(max(far - other, other - near), abs=1.1e-3)
    assert high == pytest.approx(near + other, abs=1.1e-3)
    for closing in (low, high):
        machine(FOUR_BAR, **{name: closing})
    for beyond in (low - 2e-3, high + 2e-3):
        with pytest.raises(InputError):
            machine(FOUR_BAR, **{name: beyond})
    told = re.search(r"are (\S+) mm apart, (\S+) mm", str(caught.value))
    apart, gap = (1e-3 * float(x) for x in told.groups())
    assert gap == pytest.approx(max(apart - value - other, abs(value - other) - apart), abs=5e-4)


def test_a_rod_that_does_not_reach_its_line_is_told_with_its_least_length():
    with pytest.raises(InputError, match=r"more than coupler is long") as caught:
        machine(SLIDER, l=0.06)
    least = 1e-3 * float(re.search(r"a length of coupler above (\S+) mm", str(caught.value))[1])
    assert least == pytest.approx(0.07, abs=1e-4)
    machine(SLIDER, l=least + 1e-4)


@pytest.mark.parametrize("name", ["Bb", "b", "B_"])
def test_names_of_points_that_look_alike_are_told(name):
    text = FOUR_BAR.replace("points = { O2 = [0, 0], B", f"points = {{ O2 = [0, 0], {name}")
    with pytest.raises(InputError, match="too many degrees of freedom") as caught:
        machine(text)
    assert f"the points coupler.B and rocker.{name} look alike: a pin joins points of one name" in str(
        caught.value
    )


def test_names_with_another_number_do_not_look_alike():
    text = FOUR_BAR.replace("points = { O2 = [0, 0], B", "points = { O2 = [0, 0], B2")
    with pytest.raises(InputError, match="too many degrees of freedom") as caught:
        machine(text)
    assert "alike" not in str(caught.value)


@pytest.mark.stages(first=3)
@pytest.mark.parametrize("seed", range(12))
def test_a_change_point_is_a_dead_position_with_its_reason(seed):
    """Parallelograms and kites close all the way round but for rounding: coupler and rocker come into line."""
    rng = np.random.default_rng(seed)
    r, g, start = rng.uniform(0.05, 0.5), rng.uniform(0.55, 1.5), rng.uniform(0.2, 2.9)
    parallel = seed % 2 == 0
    length, rocker = (g, r) if parallel else (r, g)
    # the fourth corner of the parallelogram, or its mirror image about the line A-O2
    a, o2 = r * np.exp(1j * start), complex(g)
    b = a + o2 if parallel else a + np.conj(-a / (o2 - a)) * (o2 - a)
    data = {
        "ground": {"O1": [0, 0], "O2": [g, 0]},
        "driver": {"link": "crank"},
        "links": {
            "crank": {"points": {"O1": [0, 0], "A": [r, 0]}},
            "coupler": {"points": {"A": [0, 0], "B": [length, 0]}},
            "rocker": {"points": {"O2": [0, 0], "B": [rocker, 0]}},
        },
        "start": {"phi": start, "points": {"B": [b.real, b.imag]}},
    }
    with pytest.raises(InputError, match=r"comes to a dead position at (180|0|360) deg of crank") as caught:
        machine_of(description_of(data, "change_point"))
    words = str(caught.value)
    assert "there coupler and rocker are in line, and its two ways of closing meet" in words
    assert "its margin is 0 and must be > 0.001" in words and "cannot close" not in words
    assert "around its start the linkage closes from" in words
    # a gap that is no rounding is one
    data["links"]["rocker"]["points"]["B"] = [rocker * (1.0 - 1e-6), 0]
    with pytest.raises(InputError, match="cannot close"):
        machine_of(description_of(data, "gap"))


def test_a_rod_that_just_reaches_its_line_is_square_to_it():
    with pytest.raises(InputError, match="comes to a dead position at 270 deg of crank") as caught:
        machine(SLIDER, l=0.07)
    assert "there coupler is square to the guide of ram, and its two ways of closing meet" in str(
        caught.value
    )


def test_guides_that_become_parallel_are_a_dead_position():
    """A yoke whose slot turns into its guide: the crank carries a slot, a block slides in it and along the ground."""
    data = {
        "ground": {"O1": [0, 0], "G": [0.1, 0.3], "G2": [1.0, 0.3]},
        "driver": {"link": "crank"},
        "links": {
            "crank": {"points": {"O1": [0, 0], "S": [0, 0.1], "S2": [0.5, 0.1]}},
            "block": {"points": {"C": [0, 0]}},
            "slide": {"points": {"C": [0, 0]}},
        },
        "joints": {
            "slot": {"on": "block.C", "by": "crank.S", "toward": "S2", "angle": 0},
            "guide": {"on": "slide.C", "by": "ground.G", "toward": "G2", "angle": 0},
        },
        "start": {"phi": 1.0, "points": {"C": [0.1, 0.3]}},
    }
    with pytest.raises(InputError, match="its two guides are parallel, so that its forces have no limit"):
        machine_of(description_of(data, "parallel"))


def test_an_elbow_that_does_not_close_is_told_with_gap_and_lever():
    """The arms B-C and C-D with the law of their motor are one side of the triangle B-D-E: the limits of the lever
    follow from |B-E| and from the reach of the arms."""
    law = 'phi = "0.3 * sin(phi) + 110 deg"\nby = "motor"'

    def with_lever(length):
        return machine(FIVE_BAR.format(law=law).replace("D = [0.6, 0]", f"D = [{length}, 0]"))

    with pytest.raises(
        InputError, match=r"pins B and E are 1000 mm apart, right is 100 mm long, its arms reach over 1230 mm"
    ) as caught:
        with_lever(0.1)
    q = np.linspace(0.0, 2.0 * math.pi, 721)
    # the frame of the second arm starts at D
    reach = np.abs(0.8 - 0.7 * np.exp(1j * (0.3 * np.sin(q) + math.radians(110.0))))
    apart = np.abs(1.2 - 0.2 * np.exp(1j * q))
    told = re.search(r"length of right between (\S+) mm and (\S+) mm closes it", str(caught.value)).groups()
    low, high = (1e-3 * float(x) for x in told)
    assert low == pytest.approx(np.max(np.abs(reach - apart)), abs=1e-3)
    assert high == pytest.approx(np.min(reach + apart), abs=2e-3)
    for length in (low + 0.02, high - 0.02):
        with_lever(length)


def test_a_cylinder_that_does_not_close_is_told_with_its_ways():
    """The pins of the cylinder and of its lever are 500 mm apart, the lever is 2 m long: the cylinder is between 1.5
    and 2.5 m long, of which 0.1 m are beside its way."""
    text = """
[ground]
A = [0, 0]
B = [0.4, -0.3]
[driver]
joint = "ram"
range = [{}]
[links.boom]
points = {{ A = [0, 0], C = [2, 0] }}
mass = 900
[links.barrel]
points = {{ B = [0, 0], b = [1, 0] }}
[links.rod]
points = {{ C = [0, 0], R = [-0.1, 0] }}
[joints.ram]
on = "rod.R"
by = "barrel.B"
toward = "b"
angle = 0
[start]
phi = 1.7
angles = {{ boom = "20 deg", barrel = "35 deg", rod = "35 deg" }}
"""
    words = r"pins B and A are 500 mm apart, boom is 2000 mm long: it closes at a way from 1\.4 m to 2\.4 m;"
    for span in ("1.0, 2.0", "1.6, 2.5"):
        with pytest.raises(InputError, match=words):
            machine(text.format(span))
    machine(text.format("1.45, 2.35"))


def test_a_guide_without_its_line_and_a_unit_in_an_expression_are_told_as_such():
    with pytest.raises(
        InputError, match="ram has two pins in its point B; if one of both joints is a guide, give it"
    ):
        machine(SLIDER.replace('toward = "G2"\n', ""))
    with pytest.raises(
        InputError, match="no number with a unit and no expression: no unit stands in one, take a par"
    ):
        machine(FOUR_BAR.replace('["l", 0]', '["l + 3 mm", 0]'))
