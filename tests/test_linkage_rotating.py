"""Linkages whose links turn fully with the driver, against the independent solution, with angles that never jump."""

from __future__ import annotations

import math

import numpy as np
import pytest
from multibody import Multibody
from test_linkage_random import by_the_machine, deviations

from chainunit.core.errors import InputError
from chainunit.machines.linkages.file import description_of
from chainunit.machines.linkages.model import machine_of

BODY = {"mass": 2.0, "inertia": 0.05, "centroid": [0.1, 0.03]}


def link(masses=None, **points):
    return {
        "points": {name: [float(x) for x in at] for name, at in points.items()},
        "masses": masses or {},
        **BODY,
    }


def drag_link():
    """The shortest link of the four-bar is the ground; the driver counts clockwise from an angle of its own."""
    zero, phi = 0.7, 1.1
    a = 0.3 * np.array([math.cos(zero - phi), math.sin(zero - phi)])
    return {
        "ground": {"O1": [0, 0], "O2": [0.08, 0]},
        "driver": {"link": "crank", "zero": zero, "positive": "clockwise"},
        "links": {
            "crank": link(O1=[0, 0], A=[0.3, 0]),
            "coupler": link(A=[0, 0], B=[0.32, 0]),
            "output": link(O2=[0, 0], B=[0.28, 0], W=[0.1, 0.1], masses={"W": 1.5}),
        },
        "start": {"phi": phi, "points": {"B": [float(a[0]) + 0.1, float(a[1]) + 0.28]}},
    }


def whitworth(reversed_joint):
    """A slotted lever that turns fully; the line of the slide in the lever, or in the block."""
    slot = {"on": "block.A", "by": "lever.S", "toward": "S2", "angle": 0.4}
    block = link(A=[0, 0])
    if reversed_joint:
        block = link(A=[0, 0], X=[0, 0], X2=[math.cos(0.4), -math.sin(0.4)])
        slot = {"on": "lever.S", "by": "block.X", "toward": "X2", "angle": -0.4}
    return {
        "ground": {"O1": [0, 0], "O2": [0.1, 0.02]},
        "driver": {"link": "crank"},
        "links": {
            "crank": link(O1=[0, 0], A=[0.3, 0]),
            "block": block,
            "lever": link(O2=[0, 0], S=[0.05, 0.03], S2=[0.5, 0.03], B=[-0.2, 0.05]),
        },
        "joints": {"slot": slot},
        "start": {"phi": 0.2, "angles": {"lever": 0.3}},
    }


def turning_triad(offset, positive):
    """The plate hangs on the crank by two legs, and by the third one on the ground beside the crank's bearing."""

    def unit(angle):
        return np.array([math.cos(angle), math.sin(angle)])

    size, length = 0.25, 0.6
    spokes = [0.2 + 2.0 * math.pi * k / 3 for k in range(3)]
    reach = [unit(s) * size + unit(s + 0.5 * math.pi) * length for s in spokes]
    o2 = np.array([offset, 0.0])
    center = o2 - reach[2]
    pins = [unit(s) * size for s in spokes]
    at = {name: [float(x) for x in center + pin] for name, pin in zip("CDE", pins, strict=True)}
    return {
        "ground": {"O1": [0, 0], "O2": [float(x) for x in o2]},
        "driver": {"link": "crank", "positive": positive},
        "links": {
            "crank": link(O1=[0, 0], A=center + reach[0], B=center + reach[1]),
            "plate": link(C=pins[0], D=pins[1], E=pins[2]),
            "one": link(A=[0, 0], C=[length, 0]),
            "two": link(B=[0, 0], D=[length, 0]),
            "three": link(O2=[0, 0], E=[length, 0]),
        },
        "start": {"phi": 0, "points": at, "angles": {"plate": 0.0}},
    }


MACHINES = {
    "drag_link": (drag_link(), -1),
    "whitworth": (whitworth(False), 1),
    "whitworth_reversed": (whitworth(True), 1),
    "triad": (turning_triad(0.03, "counter-clockwise"), 1),
    "triad_clockwise": (turning_triad(0.08, "clockwise"), -1),
}


@pytest.mark.stages(second=2)
@pytest.mark.second
@pytest.mark.parametrize("name", MACHINES)
def test_links_that_turn_fully(name):
    data, turns = MACHINES[name]
    text = description_of(data, name)
    model, body = machine_of(text), Multibody(text)
    for q in (0.3, 1.7, 2.9, 4.4, 5.9, -3.3, 14.2):
        found, _, _ = by_the_machine(model, q, 2.0, 5.0)
        wanted = body.solution(body.followed(q), q, 2.0, 5.0)
        key, worst = max(deviations(found, wanted), key=lambda pair: pair[1])
        assert worst < 1e-11, (q, key, worst)
    # no jump of an angle over two turns, and every link has gone round as often as the crank
    course = np.linspace(-7.0, -7.0 + 4.0 * math.pi, 401)
    outputs = [by_the_machine(model, q, 1.0, 0.0)[0] for q in course]
    for each in body.names:
        angles = np.array([out[f"{each}.angle"] for out in outputs])
        assert np.max(np.abs(np.diff(angles))) < 0.3, each
        assert angles[-1] - angles[0] == pytest.approx(4.0 * math.pi * turns, abs=1e-9), each


@pytest.mark.second
def test_a_triad_that_cannot_be_followed_is_refused():
    """A pose that the series does not lead to is none: better no machine than one of another mode."""
    refused = 0
    for size in (0.2, 0.44, 0.47, 0.48, 0.55):
        data = turning_triad(0.03, "counter-clockwise")
        data["ground"]["O2"] = [0.03 + size, 0.0]
        try:
            model = machine_of(description_of(data, "triad"))
        except InputError as error:
            refused += 1
            assert "the triad of plate, one, two, three does not close at its start, 0 deg of crank" in str(
                error
            )
            continue
        body = Multibody(description_of(data, "triad"))
        for q in (1.0, 3.0, 5.0):
            wanted = body.solution(body.followed(q, 0.02), q, 2.0, 5.0)
            assert max(gap for _, gap in deviations(by_the_machine(model, q, 2.0, 5.0)[0], wanted)) < 1e-8
    assert refused == 1
