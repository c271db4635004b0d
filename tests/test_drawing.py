"""The labelled drawing of each machine: its places against the mechanics, its labels clear of each other."""

import itertools
import math
import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from chainunit.machines.machine import Machine
from chainunit.models import MACHINES
from chainunit.report.drawing import _LOOKS, HEIGHT, WIDTH, dimensions, drawing

GALLERY = Path(__file__).parents[1] / "docs" / "linkages"
SVG = "{http://www.w3.org/2000/svg}"


def _labels(picture):
    root = ElementTree.fromstring(picture)
    return [(text.text, float(text.get("x")), float(text.get("y"))) for text in root.iter(f"{SVG}text")]


def test_the_dimensions_of_the_chain_unit():
    """The parameter of each length, by hand from the definition of the machine."""
    names = {key: size.name for key, size in dimensions(Machine(MACHINES["ChamberForces"])).items()}
    assert names == {
        ("link", "crank"): "r",
        ("link", "coupler"): "l",
        ("link", "rocker"): "h",
        ("point", "rocker", "A2"): "e",
        **{("link", f"{side} wall"): "l1" for side in ("left", "right")},
        **{("link", f"{side} web"): "l2" for side in ("left", "right")},
        ("x", "O1"): "c",
        ("y", "O1"): "hy",
        ("x", "A1 left"): "z",
        ("x", "A1 right"): "z",
    }


def test_the_chain_unit_names_every_part():
    labels = [text for text, *_ in _labels(drawing(Machine(MACHINES["ChamberForces"])))]
    for name in ("O1", "A", "Bd", "C", "A2", "crank r", "coupler l", "rocker h", "φ", "ψ", "c", "hy", "e"):
        assert labels.count(name) >= 1, name
    for name in ("A1", "B", "wall l1", "web l2"):
        assert labels.count(name) == 2, name


@pytest.mark.parametrize("name", MACHINES)
@pytest.mark.parametrize("phi", [0.0, 1.0, 2.5, 4.0])
def test_links_have_their_lengths(name, phi):
    """In the scale of the picture, each link that a parameter gives the length of is as long as the parameter."""
    machine = Machine(MACHINES[name])
    root = ElementTree.fromstring(drawing(machine, phi))
    circles = [(float(c.get("cx")), float(c.get("cy"))) for c in root.iter(f"{SVG}circle")]
    orbit = next(float(c.get("r")) for c in root.iter(f"{SVG}circle"))
    sizes = dimensions(machine)
    crank = next(size for key, size in sizes.items() if key[0] == "link")
    scale = orbit / crank.value
    lines = [p.get("points").split() for p in root.iter(f"{SVG}polyline")]
    drawn = [[tuple(map(float, point.split(","))) for point in line] for line in lines]
    lengths = [math.dist(line[0], line[-1]) for line in drawn]
    for key, size in sizes.items():
        if key[0] == "link":
            assert any(length == pytest.approx(scale * size.value, rel=1e-3) for length in lengths), key
    # and each pin is drawn at an end of a link
    ends = [point for line in drawn for point in line]
    corners = [
        tuple(map(float, point.split(",")))
        for p in root.iter(f"{SVG}polygon")
        for point in p.get("points").split()
    ]
    for pin in circles[1:]:
        assert any(math.dist(pin, end) < 0.2 for end in (*ends, *corners))


@pytest.mark.parametrize("name", MACHINES)
@pytest.mark.parametrize("phi", [1.0])
def test_labels_do_not_overlap(name, phi):
    picture = drawing(Machine(MACHINES[name]), phi)
    boxes = []
    for text, x, y in _labels(picture):
        if x < WIDTH:  # the column beside has rows
            boxes.append((text, x - 3.4 * len(text), x + 3.4 * len(text), y - 10.0, y + 2.0))
    for (one, *a), (other, *b) in itertools.combinations(boxes, 2):
        assert a[0] > b[1] or b[0] > a[1] or a[2] > b[3] or b[2] > a[3], (one, other)
    for text, left, _, top, bottom in boxes:
        assert left > 0.0 and top > 0.0 and bottom < HEIGHT, text


@pytest.mark.parametrize("file", sorted(GALLERY.glob("*.svg")), ids=lambda file: file.stem)
def test_no_link_is_drawn_over_the_name_of_a_link(file):
    """In the pictures of the gallery."""
    root = ElementTree.fromstring(file.read_text("utf-8"))
    colours = {look[0] for look in _LOOKS.values()}
    edges = []
    for shape in (*root.iter(f"{SVG}polyline"), *root.iter(f"{SVG}polygon")):
        corners = [tuple(map(float, point.split(","))) for point in shape.get("points").split()]
        corners += corners[:1] if shape.tag == f"{SVG}polygon" else []
        if shape.get("stroke") in colours or shape.get("fill") == "none":
            edges += itertools.pairwise(corners) if shape.get("stroke-dasharray") is None else ()
    names = [text for text in root.iter(f"{SVG}text") if text.get("fill") in colours and text.text != "φ"]
    assert names and edges
    along = np.linspace(0.0, 1.0, 200)
    for name in names:
        x, y, half = float(name.get("x")), float(name.get("y")) - 4.5, 3.2 * len(name.text)
        for (x0, y0), (x1, y1) in edges:
            near = np.abs(x0 + along * (x1 - x0) - x) < half
            assert not np.any(near & (np.abs(y0 + along * (y1 - y0) - y) < 4.5)), name.text


def test_a_dimension_of_the_user_is_shown():
    picture = drawing(Machine(MACHINES["ChamberForces"], e=0.75, l1=1.35, l2=0.6))
    assert re.search(r">e</text>\n<text [^>]*>750 mm</text>", picture)
