"""Cams of linkage files: followers with rollers and with flat faces against an independent solution, in Python and in
FMUs; energy, slopes, losses, equal linkages; what is refused.

Measured: motion, torque and every reaction within 1e-14 of the independent solution."""

from __future__ import annotations

import copy
import math

import fmpy
import numpy as np
import pytest
from multibody import Multibody
from scipy.interpolate import CubicSpline
from test_linkage_random import by_the_machine, deviations

from chainunit.core.errors import InputError
from chainunit.core.native.compilers import compiler
from chainunit.fmu.export import export as export_python
from chainunit.fmu.native.export import export
from chainunit.machines.linkages.file import description_of
from chainunit.machines.linkages.model import machine_of
from chainunit.machines.machine import Machine


def link(mass, **points):
    """A link with a mass that lies off its points."""
    return {
        "points": {name: [float(x) for x in place] for name, place in points.items()},
        "mass": mass, "inertia": 0.004 * mass, "centroid": [0.03, 0.01 * mass],
    }  # fmt: skip


def offset_roller():
    """A plunger with a roller beside the middle of a cam of two lobes, with a spring."""
    return {
        "ground": {"O1": [0, 0], "G": [0.012, 0], "G2": [0.012, 1], "S": [0.012, 0.3]},
        "driver": {"link": "shaft"},
        "links": {"shaft": link(2.0, O1=[0, 0]), "plunger": link(1.5, P=[0, 0], T=[0.01, 0.1])},
        "parameters": {"base": "40 mm", "lift": "6 mm"},
        "joints": {
            "guide": {"on": "plunger.P", "by": "ground.G", "toward": "G2"},
            "lobes": {
                "type": "cam", "on": "plunger.P", "by": "shaft.O1", "roller": "12 mm",
                "radius": "base + lift * (1 - cos(2 * phi)) + 0.5 * lift * sin(phi)",
            },
        },
        "loads": {
            "spring": {"type": "spring", "on": "plunger.T", "by": "ground.S", "stiffness": 2000, "length": 0.25},
            "push": {"on": "plunger.T", "force": [5, -60]},
        },
        "start": {"points": {"P": [0.012, 0.05]}},
    }  # fmt: skip


PLACES = np.radians([0, 30, 60, 90, 120, 150, 180, 210, 240, 270, 300, 330])
VALUES = [0.05, 0.05, 0.0502, 0.053, 0.060, 0.0655, 0.067, 0.0662, 0.0625, 0.056, 0.0512, 0.0501]


def swinging_roller():
    """A lever with a roller; the table is the pitch curve of a cam that is set on its shaft away from its bearing."""
    return {
        "ground": {"O1": [0, 0], "O2": [0.11, -0.01], "O3": [0.31, 0.02]},
        "driver": {"link": "shaft", "positive": "clockwise", "zero": 0.4},
        "links": {
            "shaft": link(2.0, O1=[0, 0], C=[0.004, -0.002]),
            "lever": link(1.2, O2=[0, 0], P=[-0.09, 0.01], A=[0.07, 0.02]),
            "rod": link(0.4, A=[0, 0], B=[0.15, 0]),
            "arm": link(0.9, O3=[0, 0], B=[0.0, 0.12]),
        },
        "tables": {"pitch_curve": {"phi": [float(x) for x in PLACES], "value": [f"{1e3 * x} mm" for x in VALUES]}},
        "joints": {
            "cam_1": {
                "on": "lever.P", "by": "shaft.C", "radius": "pitch_curve", "roller": "14 mm", "pitch": True
            }
        },
        "loads": {"lift": {"on": "arm.B", "force": [-100, -20]}},
        "start": {
            "phi": 0.2, "points": {"P": [0.02, 0.06]}, "angles": {"lever": -0.5, "rod": 0.5},
        },
    }  # fmt: skip


def flat_tappet():
    """A valve: an oblique guide, a face across it, and a cam of a circle and harmonics."""
    return {
        "ground": {"O1": [0, 0], "G": [0.0, 0.0], "G2": [0.1, 1.0]},
        "driver": {"link": "shaft"},
        "links": {
            "shaft": link(1.0, O1=[0, 0]),
            "tappet": link(0.8, F=[0, 0], F2=[0.02, 0.001], T=[0.0, 0.1]),
        },
        "joints": {
            "guide": {"on": "tappet.T", "by": "ground.G", "toward": "G2", "angle": -0.1},
            "lobe": {
                "on": "tappet.F", "by": "shaft.O1", "face": "F2", "radius": "base + lift * sin(phi) + 0.2 * lift * cos(2 * phi)"
            },
        },
        "parameters": {"base": "30 mm", "lift": "4 mm"},
        "loads": {"push": {"type": "follower", "on": "tappet.T", "force": [3, -80]}},
        "start": {"points": {"F": [0.0, 0.03]}, "angles": {"tappet": -0.1}},
    }  # fmt: skip


def flat_lever():
    """A rocking lever with a flat face, on a pin of another lever that swings."""
    return {
        "ground": {"O1": [0, 0], "O4": [0.2, -0.1], "O5": [-0.1, -0.12]},
        "driver": {"link": "shaft", "zero": 0.3},
        "links": {
            "shaft": link(1.0, O1=[0, 0], A=[0.015, 0]),
            "rod": link(0.5, A=[0, 0], D=[0.18, 0]),
            "swing": link(0.7, O4=[0, 0], D=[0.0, 0.1]),
            "lever": link(0.6, D=[0, 0], F=[-0.18, 0.035], F2=[-0.1, 0.035], T=[-0.25, 0.0]),
        },
        "joints": {
            "lobe": {"on": "lever.F", "by": "shaft.O1", "face": "F2", "radius": "base + lift * cos(phi)"},
        },
        "parameters": {"base": "30 mm", "lift": "3 mm"},
        "loads": {"push": {"on": "lever.T", "force": [10, -50]}},
        "start": {"points": {"D": [0.19, 0.0]}, "angles": {"lever": 0.0}},
    }  # fmt: skip


def wave(base, *terms):
    """A radius with terms of size, order and phase, and its derivatives."""

    def radius(s):
        return [
            sum((a * n**k * np.cos(n * s - p + 0.5 * math.pi * k) for a, n, p in terms), base * (k == 0))
            for k in range(3)
        ]

    return radius


def splined(s):
    """The periodic spline through the points of the table, and its derivatives; of complex angles, too."""
    spline = CubicSpline([*PLACES, 2.0 * math.pi], [*VALUES, VALUES[0]], bc_type="periodic")
    place = np.real(s) % (2.0 * math.pi)
    k = min(int(np.searchsorted(spline.x, place, "right")) - 1, 11)
    x, (c3, c2, c1, c0) = s - np.real(s) + place - spline.x[k], spline.c[:, k]
    return c0 + x * (c1 + x * (c2 + x * c3)), c1 + x * (2 * c2 + x * 3 * c3), 2 * c2 + 6 * x * c3


MACHINES = {
    "offset_roller": (offset_roller, "lobes", 1.3, wave(0.046, (-0.006, 2, 0.0), (0.003, 1, 0.5 * math.pi))),
    "swinging_roller": (swinging_roller, "cam_1", 1.1, splined),
    "flat_tappet": (flat_tappet, "lobe", 1.3, wave(0.03, (0.004, 1, 0.5 * math.pi), (0.0008, 2, 0.0))),
    "flat_lever": (flat_lever, "lobe", 1.2, wave(0.03, (0.003, 1, 0.0))),
}
STATES = [(0.3, 2.0, 5.0), (1.9, -3.0, 4.0), (4.4, 6.0, -20.0), (-7.7, 1.0, 0.0)]


def described(name):
    return description_of(MACHINES[name][0](), name)


def independent(name):
    _, joint, angle, radius = MACHINES[name]
    return Multibody(described(name), profiles={joint: (angle, radius)})


@pytest.mark.parametrize("name", MACHINES)
def test_against_an_independent_solution(name):
    """Motion of every link and point, every reaction, torque and energies."""
    model, body = machine_of(described(name)), independent(name)
    kinds = [group.kind for group in model.described_by.structure.groups]
    assert kinds.count("cam follower") == 1
    for q, w, a in STATES:
        found, _, _ = by_the_machine(model, q, w, a)
        wanted = body.solution(body.followed(q), q, w, a)
        assert f"{MACHINES[name][1]}.fx" in wanted
        key, worst = max(deviations(found, wanted), key=lambda pair: pair[1])
        assert worst < 1e-11, (q, key, worst)
        force = found[f"{MACHINES[name][1]}.fx"], found[f"{MACHINES[name][1]}.fy"]
        assert abs(found[f"{MACHINES[name][1]}.normal"]) == pytest.approx(math.hypot(*force), rel=1e-12)


@pytest.mark.parametrize("name", MACHINES)
def test_torque_inertia_and_slopes_belong_together(name):
    """Torque by the contact and by virtual work; the inertia is that of the kinetic energy; slopes against differences
    of eighth order, with friction in pins, guides and at the cam."""
    data = MACHINES[name][0]() | {"cams": {"friction": 0.12}, "pins": {"friction": 0.1, "diameter": 0.03}}
    if "guide" in data["joints"]:
        data["guides"] = {"friction": 0.05}
        data["joints"]["guide"]["length"] = 0.05
    machine = Machine(machine_of(description_of(data, name)))
    # clear of the places of the table, at which the slope of a force has corners
    q, w = np.linspace(0.06, 6.17, 23), 3.0
    state = machine.state(machine.inputs({"phi": q, "w": w}))
    losses = state.effects["pins"].dissipative + state.effects["guides"].dissipative
    size = np.max(np.abs(state.torque(4.0)))
    assert np.max(np.abs(state.torque_by_reactions(4.0) + losses - state.torque(4.0))) < 1e-12 * size
    here = machine.evaluate({"phi": q, "w": w})
    assert here["kinetic_energy"] == pytest.approx(0.5 * here["J"] * w * w, rel=1e-14)
    weights = (4 / 5, -1 / 5, 4 / 105, -1 / 280)
    pairs, h = (
        (("phi", "tau_bias", "tau_bias_dphi"), ("w", "tau_bias", "tau_bias_dw"), ("phi", "J", "dJ_dphi")),
        2e-3,
    )
    for place, value, slope in pairs:

        def moved(step, place=place, value=value):
            inputs = {"phi": q, "w": np.full_like(q, w)}
            return machine.evaluate(inputs | {place: inputs[place] + step})[value]

        differences = sum(f * (moved(k * h) - moved(-k * h)) for k, f in enumerate(weights, 1)) / h
        assert here[slope] == pytest.approx(differences, abs=1e-8 * np.max(np.abs(differences)) + 1e-12), (
            slope
        )
