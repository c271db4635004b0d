"""The natural ways to draw a cylinder, a slider and a slot: each gives the machine of the first way."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from chainunit.machines.linkages.file import description_of
from chainunit.machines.linkages.model import machine_of
from chainunit.machines.machine import Machine
from chainunit.reading.tables import toml
from chainunit.report import linkage
from chainunit.report.drawing import drawing

FOLDER = Path(__file__).parents[1] / "examples" / "linkages"
BARREL = 'P = [0, 0], S = ["0.25 m", 0], S2 = ["0.9 m", 0]'
ROD = 'E = [0, 0], C = ["0.5 m", 0]'
ROD_CENTROID = 'inertia = "2 kg m2"\ncentroid = ["0.25 m", 0]'
CYLINDER = 'on = "rod.E"\nby = "barrel.S"\ntoward = "S2"'
RANGE = 'range = ["0.2 m", "1.2 m"]'
FROM_C = [(ROD, "C = [0, 0]{}"), (ROD_CENTROID, 'inertia = "2 kg m2"\ncentroid = ["-0.25 m", 0]')]
GUIDE = 'on = "ram.C"\nby = "ground.G"\ntoward = "G2"'
TOOL = 'T = ["4 mm", "-120 mm"]'
SLOT = 'on = "block.A"\nby = "yoke.S"\ntoward = "S2"'
LEVER = 'S = ["100 mm", "15 mm"], S2 = ["600 mm", "15 mm"]'
IN_LEVER = 'on = "block.A"\nby = "lever.S"\ntoward = "S2"'
STRAIGHT = [(LEVER, 'S = ["100 mm", 0], S2 = ["600 mm", 0]')]
BLOCK = "points = { A = [0, 0] }"
BLOCK_LINE = "points = { A = [0, 0], A2 = [1, 0] }"


def cylinder(changes, on, by, toward, low, sign=1.0):
    """The tipper with another cylinder: the way of the first one is `sign` times its own, plus a constant."""
    low, high = round(low, 9), round(low + 1.0, 9)
    return [
        *changes,
        (CYLINDER, f'on = "{on}"\nby = "{by}"\ntoward = "{toward}"'),
        (RANGE, f"range = [{low}, {high}]"),
        ('phi = "0.2 m"', f"phi = {low if sign > 0.0 else high}"),
    ]


def from_c(more=""):
    return [(a, b.format(more)) for a, b in FROM_C]


WAYS = {
    "rod pinned at its guide point": (
        "tipper", cylinder(from_c(), "rod.C", "barrel.S", "S2", 0.7), 0.5, 1.0
    ),
    "guide from the bearing of the barrel": ("tipper", cylinder([], "rod.E", "barrel.P", "S2", 0.45), 0.25, 1.0),
    "both at their pins": ("tipper", cylinder(from_c(), "rod.C", "barrel.P", "S2", 0.95), 0.75, 1.0),
    "guide toward the bearing": (
        "tipper", cylinder([], "rod.E", "barrel.S2", "P", -0.55, -1.0), 0.65, -1.0
    ),
    "barrel on rod": (
        "tipper", cylinder([(ROD, f"{ROD}, E2 = [0.3, 0]")], "barrel.S", "rod.E", "E2", -1.2, -1.0), 0.0, -1.0
    ),
    "barrel on rod at its pin": (
        "tipper", cylinder(from_c(", E2 = [-0.3, 0]"), "barrel.S", "rod.C", "E2", 0.7), 0.5, 1.0
    ),
    "bearing on rod": (
        "tipper", cylinder([(ROD, f"{ROD}, E2 = [0.3, 0]")], "barrel.P", "rod.E", "E2", -1.45, -1.0), -0.25, -1.0
    ),
    "bearing on rod at its pin": (
        "tipper", cylinder(from_c(", E2 = [-0.3, 0]"), "barrel.P", "rod.C", "E2", 0.95), 0.75, 1.0
    ),
    "ground slides on ram": (
        "slider_crank_press",
        [(GUIDE, 'on = "ground.G"\nby = "ram.C"\ntoward = "U"'), (TOOL, f"{TOOL}, U = [0, -1]")], 0.0, 1.0
    ),
    "line of the ram apart from its pin": (
        "slider_crank_press",
        [(GUIDE, 'on = "ground.G"\nby = "ram.V"\ntoward = "U"'),
         (TOOL, f"{TOOL}, V = [0, -0.1], U = [0, -1]")], 0.0, 1.0
    ),
    "guide point apart from the pin": (
        "slider_crank_press",
        [(GUIDE, 'on = "ram.V"\nby = "ground.G"\ntoward = "G2"'), (TOOL, f"{TOOL}, V = [0, -0.1]")], 0.0, 1.0
    ),
    "guide that goes up": ("slider_crank_press", [('"offset", "-600 mm"', '"offset", "600 mm"')], 0.0, 1.0),
    "slot in the block": (
        "scotch_yoke_pump",
        [(SLOT, 'on = "yoke.S"\nby = "block.A"\ntoward = "A2"'), (BLOCK, "points = { A = [0, 0], A2 = [0, 1] }")],
        0.0, 1.0,
    ),
    "guide from the bearing of the crank": (
        "scotch_yoke_pump", [('by = "ground.G"', 'by = "ground.O1"'), ("G = [0, 0]\n", "")], 0.0, 1.0
    ),
    "ground slides on yoke": (
        "scotch_yoke_pump",
        [('on = "yoke.S"\nby = "ground.G"\ntoward = "G2"', 'on = "ground.G"\nby = "yoke.S"\ntoward = "P"')], 0.0, 1.0
    ),
    "guide at another point of the yoke": ("scotch_yoke_pump", [('on = "yoke.S"\n', 'on = "yoke.P"\n')], 0.0, 1.0),
    "lever slides in the block": (
        "crank_shaper",
        [(IN_LEVER, 'on = "lever.S"\nby = "block.A"\ntoward = "A2"'), (BLOCK, BLOCK_LINE)],
        0.0, 1.0,
    ),
    "slot from the bearing": (
        "crank_shaper", [(LEVER, 'S2 = ["600 mm", 0]'), ('by = "lever.S"', 'by = "lever.O2"')], 0.0, 1.0
    ),
    "slot from pin to pin": (
        "crank_shaper", [(f"{LEVER}, ", ""), ('by = "lever.S"\ntoward = "S2"', 'by = "lever.B"\ntoward = "O2"')],
        0.0, 1.0
    ),
    "bearing slides in the block": (
        "crank_shaper",
        [(f"{LEVER}, ", ""), (IN_LEVER, 'on = "lever.O2"\nby = "block.A"\ntoward = "A2"'),
         (BLOCK, BLOCK_LINE)], 0.0, 1.0
    ),
    "ram on its own guide point": (
        "cylinder_lift",
        [('on = "rod.P"\nby = "ground.O1"\ntoward = "X"', 'on = "ground.O1"\nby = "rod.P"\ntoward = "R"'),
         ("points = { P = [0, 0] }", "points = { P = [0, 0], R = [0, -1] }")], 0.0, 1.0
    ),
}  # fmt: skip
"""By the name of a way: the file that it changes, the changes, and how much more its coordinate is than `sign` times
that of the file."""


def machine(text):
    # friction depends on where a block lies
    text = text.replace("friction = 0.1", "friction = 0").replace("friction = 0.05", "friction = 0")
    return Machine(machine_of(description_of(toml(text.replace("friction = 0.08", "friction = 0")), "x")))


@pytest.mark.parametrize("name", WAYS)
def test_each_way_gives_the_machine_of_the_first_way(name):
    """Force at the driver, load port and reactions of all pins, by both routes; and its picture is drawn."""
    file, changes, shift, sign = WAYS[name]
    text = (FOLDER / f"{file}.toml").read_text("utf-8")
    if file == "crank_shaper" and (LEVER in dict(changes) or f"{LEVER}, " in dict(changes)):
        first = machine(text.replace(*STRAIGHT[0]))
    else:
        first = machine(text)
    for change in changes:
        assert change[0] in text
        text = text.replace(*change)
    other = machine(text)
    low, high = first.model.span
    way = np.linspace(low, high, 13)[1:-1]
    feed = first.model.feed_layout.by_name(first.model.Feed())
    wanted = first.evaluate({"phi": way, "w": 0.7, "a": 0.4, **feed})
    found = other.evaluate({"phi": sign * way + shift, "w": sign * 0.7, "a": sign * 0.4, **feed})
    own = other.inputs({"phi": sign * way + shift, "w": sign * 0.7, **feed})
    for key in ("tau", "J", "tau_bias", "tau_bias_dphi", "tau_bias_dw", "margin", "kinetic_energy"):
        odd = sign if key in ("tau", "tau_bias") else 1.0
        scale = np.max(np.abs(wanted[key]))
        assert np.max(np.abs(found[key] - odd * wanted[key])) < 1e-9 * scale + 1e-9, key
    pins = {key for key in wanted if key.endswith(".fx") and key.split(".")[0] in first.model.joints}
    assert pins
    for key in pins:
        assert np.max(np.abs(np.abs(found[key]) - np.abs(wanted[key]))) < 1e-6 + 1e-9 * np.max(
            np.abs(wanted[key])
        )
    state = other.state(own)
    assert state.torque_by_reactions(0.4) == pytest.approx(state.torque(0.4), rel=1e-9, abs=1e-6)
    places = linkage.paths(state.m)
    assert all(np.all(np.isfinite(axis)) for path in places.values() for axis in path)
    assert "<svg" in drawing(other)
