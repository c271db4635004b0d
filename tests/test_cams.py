"""Cams of linkage files: followers with rollers and with flat faces against an independent solution, in Python and in
FMUs; energy, slopes, losses, equal linkages; what is refused.

Measured: motion, torque and every reaction within 1e-14 of the independent solution."""

from __future__ import annotations

import copy
import math
from types import SimpleNamespace

import fmpy
import numpy as np
import pytest
from command import chainunit
from javascript_hosts import node
from multibody import Multibody
from scipy.interpolate import CubicSpline
from test_linkage_random import by_the_machine, deviations
from test_live import check_turn, varied

from chainunit.capabilities.energy.running import losses_in_joints
from chainunit.core.errors import InputError
from chainunit.core.native.compilers import compiler
from chainunit.core.quantities import Layout
from chainunit.fmu.export import export as export_python
from chainunit.fmu.native.export import export
from chainunit.machines.linkages.file import description_of
from chainunit.machines.linkages.model import machine_of
from chainunit.machines.machine import Machine
from chainunit.report.drawing import drawing
from chainunit.report.live.machine import of_linkage
from chainunit.study import config
from chainunit.study.linkage_turn import linkage_findings
from chainunit.study.measures import Answers
from chainunit.study.remarks import _happenings
from chainunit.study.run import run_study


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
                "on": "tappet.F", "by": "shaft.O1", "face": "F2",
                "radius": "base + lift * sin(phi) + 0.2 * lift * cos(2 * phi)",
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


def within(case, low, high):
    """The same machine with a driver that swings."""
    make, *independent_profile = case

    def swinging():
        data = make()
        return data | {"driver": data["driver"] | {"range": [low, high]}}

    return swinging, *independent_profile


def pushed_shaft():
    """A cylinder turns the shaft of the plunger's cam by an arm."""
    data = offset_roller()
    data["ground"] |= {"Q": [-0.3, -0.1]}
    data["links"]["shaft"]["points"]["A"] = [0.0, -0.08]
    data["links"] |= {"barrel": link(1.0, Q=[0, 0], R=[0.1, 0]), "rod": link(0.5, A=[0, 0], D=[-0.1, 0])}
    data["joints"]["push"] = {"on": "rod.A", "by": "barrel.Q", "toward": "R", "angle": 0.0}
    data["driver"] = {"joint": "push", "range": [0.26, 0.36]}
    data["start"] |= {"phi": 0.3, "angles": {"shaft": 0.0}}
    return data


MACHINES |= {
    "offset_roller within a range": within(MACHINES["offset_roller"], -0.9, 2.5),
    "flat_lever within a range": within(MACHINES["flat_lever"], -0.4, 1.95),
    "pushed_shaft": (pushed_shaft, *MACHINES["offset_roller"][1:]),
}
STATES = [(0.3, 2.0, 5.0), (1.9, -3.0, 4.0), (4.4, 6.0, -20.0), (-7.7, 1.0, 0.0)]


def states_of(name):
    """The states with their places within the range of the driver, and with slower ones of a slide."""
    low, high = MACHINES[name][0]()["driver"].get("range", (-math.inf, math.inf))
    if math.isinf(high):
        return STATES
    slower = min(1.0, high - low)
    shares = zip((0.0, 0.5, 0.93, 1.0), STATES, strict=True)
    return [(low + share * (high - low), slower * w, slower * a) for share, (_, w, a) in shares]


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
    for q, w, a in states_of(name):
        found, _, _ = by_the_machine(model, q, w, a)
        wanted = body.solution(body.followed(q), q, w, a)
        assert f"{MACHINES[name][1]}.fx" in wanted
        key, worst = max(deviations(found, wanted), key=lambda pair: pair[1])
        assert worst < 1e-11, (q, key, worst)
        force = found[f"{MACHINES[name][1]}.fx"], found[f"{MACHINES[name][1]}.fy"]
        assert abs(found[f"{MACHINES[name][1]}.normal"]) == pytest.approx(math.hypot(*force), rel=1e-12)


@pytest.mark.parametrize("name", MACHINES)
def test_torque_inertia_and_slopes_belong_together(name):
    """Torque by the contact and by virtual work; the inertia is that of the kinetic energy; slopes against
    differences of eighth order, with friction in pins, guides and at the cam."""
    data = MACHINES[name][0]() | {"cams": {"friction": 0.12}, "pins": {"friction": 0.1, "diameter": 0.03}}
    if "guide" in data["joints"]:
        data["guides"] = {"friction": 0.05}
        data["joints"]["guide"]["length"] = 0.05
    machine = Machine(machine_of(description_of(data, name)))
    # clear of the places of the table, at which the slope of a force has corners
    low, high = data["driver"].get("range", (0.0, 2.0 * math.pi))
    q, w = np.linspace(low + 0.02 * (high - low), high - 0.02 * (high - low), 23), 3.0
    state = machine.state(machine.inputs({"phi": q, "w": w}))
    losses = state.effects["pins"].dissipative + state.effects["guides"].dissipative
    size = np.max(np.abs(state.torque(4.0)))
    assert np.max(np.abs(state.torque_by_reactions(4.0) + losses - state.torque(4.0))) < 1e-12 * size
    here = machine.evaluate({"phi": q, "w": w})
    assert here["kinetic_energy"] == pytest.approx(0.5 * here["J"] * w * w, rel=1e-14)
    weights = (4 / 5, -1 / 5, 4 / 105, -1 / 280)
    pairs, h = (
        (("phi", "tau_bias", "tau_bias_dphi"), ("w", "tau_bias", "tau_bias_dw"), ("phi", "J", "dJ_dphi")),
        3e-4 * (high - low),
    )
    for place, value, slope in pairs:

        def moved(step, place=place, value=value):
            inputs = {"phi": q, "w": np.full_like(q, w)}
            return machine.evaluate(inputs | {place: inputs[place] + step})[value]

        differences = sum(f * (moved(k * h) - moved(-k * h)) for k, f in enumerate(weights, 1)) / h
        assert here[slope] == pytest.approx(differences, abs=1e-8 * np.max(np.abs(differences)) + 1e-12), (
            slope
        )


@pytest.mark.second
@pytest.mark.skipif(compiler() is None, reason="no C compiler")
@pytest.mark.parametrize("make", ["native 2", pytest.param("native 3", marks=pytest.mark.slow), "python"])
@pytest.mark.parametrize("name", MACHINES)
def test_fmus(name, make, tmp_path):
    """The same numbers through the FMU, before and after a step."""
    model, body, h = machine_of(described(name)), independent(name), 0.01
    if make == "python":
        file = export_python(model, tmp_path / "unit.fmu")
    else:
        file = export(model, tmp_path / "unit.fmu", fmi=int(make[-1]))
    for q, w, a in states_of(name)[:2]:
        wanted = body.solution(body.followed(q), q, w, a)
        rows = fmpy.simulate_fmu(
            str(file), stop_time=h, step_size=h, output=[*wanted], fmi_type="CoSimulation",
            start_values={"phi": q, "w": w, "a": a},
        )  # fmt: skip
        end = q + h * w + 0.5 * h * h * a, w + h * a, a
        for row, values in ((rows[0], wanted), (rows[-1], body.solution(body.followed(end[0]), *end))):
            found = {key: float(row[key]) for key in values}
            key, worst = max(deviations(found, values), key=lambda pair: pair[1])
            assert worst < 1e-11, (q, key, worst)


@node
@pytest.mark.slow
@pytest.mark.parametrize("name", ["offset_roller", "flat_lever"])
def test_live_pages(name):
    """A turn in JavaScript is that of Python, also with other lengths and loads."""
    machine = Machine(machine_of(described(name)))
    live = of_linkage(machine, 5.0, f"{name}.toml")
    check_turn(live, machine, 5.0, machine.model.Feed(), varied(live, 4, 1))


@pytest.mark.parametrize("name", MACHINES)
def test_the_friction_of_the_contact_takes_its_slip(name):
    """Power of the friction by the forces and by the speeds of both links at the contact, taken from differences of
    their places; the driver gives all of it."""
    data, joint = MACHINES[name][0](), MACHINES[name][1]
    with_loss = Machine(
        machine_of(description_of(data | {"cams": {"friction": 0.2, "v_smooth": 1e-9}}, name))
    )
    without = Machine(machine_of(description_of(data, name)))
    low, high = data["driver"].get("range", (0.1, 6.0))
    q, w = np.linspace(low, high, 6), 3.0
    reaction = without.evaluate({"phi": q, "w": w})
    normal = np.array([reaction[f"{joint}.fx"], reaction[f"{joint}.fy"]]) / reaction[f"{joint}.normal"]
    entry = described(name)["joints"]
    entry = next(each for each in entry if each["name"] == joint)
    (follower, point), (cam, centre) = entry["on"], entry["by"]
    here = without.evaluate({"phi": q})
    place = np.array([here[f"{follower}.{point}.{axis}"] for axis in "xy"])
    middle = np.array([here[f"{cam}.{centre}.{axis}"] for axis in "xy"])
    if entry["face"]:
        # the contact at the angle of the profile that the independent solution has
        _, _, _, radius = MACHINES[name]
        contacts = []
        for k, angle in enumerate(q):
            body = independent(name)
            s, pose = body.followed(angle)[-1], body.followed(angle)
            turn = pose[body.columns(cam)][2] + s
            contacts.append(middle[:, k] + radius(s)[0] * np.array([math.cos(turn), math.sin(turn)]))
        contact = np.array(contacts).T
    else:
        contact = place - float(entry["roller"]) * normal

    def speed(link, at, origin):
        velocity = [without.evaluate({"phi": q, "w": w})[f"{link}.{origin}.v{axis}"] for axis in "xy"]
        start = np.array([here[f"{link}.{origin}.{axis}"] for axis in "xy"])
        spin = without.evaluate({"phi": q, "w": w})[f"{link}.w"]
        return np.array(velocity) + spin * np.array([-(at - start)[1], (at - start)[0]])

    slip = np.abs(
        np.sum((speed(follower, contact, point) - speed(cam, contact, centre)) * [-normal[1], normal[0]], 0)
    )
    wanted = 0.2 * np.abs(reaction[f"{joint}.normal"]) * slip
    lost = with_loss.evaluate({"phi": q, "w": w})
    assert (lost["tau"] - reaction["tau"]) * w == pytest.approx(wanted, rel=1e-6)
    assert lost["dissipated_power"] - reaction["dissipated_power"] == pytest.approx(wanted, rel=1e-6)


def test_an_eccentric_circle_is_a_linkage():
    """A circle about a point beside the bearing: a roller on a slide is a slider-crank, one on a lever a four-bar,
    and a flat face a yoke."""
    circle = {"e": "8 mm", "R": "30 mm"}
    radius = "e * cos(phi) + sqrt(R * R - e * e * sin(phi) * sin(phi))"
    start = {"phi": 0.3, "points": {"P": [0.01, 0.045]}}

    def machine(parts, joints):
        data = offset_roller() | {
            "start": start,
            "joints": joints,
            "parameters": circle if "cam" in joints else {},
        }
        data["links"] = {"shaft": link(2.0, O1=[0, 0], E=[0.008, 0])} | parts.pop("links")
        data["ground"] |= parts.pop("ground", {})
        data["loads"] = {"push": {"on": "follower.T", "force": [20, -80]}}
        return Machine(machine_of(description_of(data | parts, "circle")))

    guide = {"guide": {"on": "follower.P", "by": "ground.G", "toward": "G2"}}
    cam = {"on": "follower.P", "by": "shaft.O1", "radius": radius, "roller": "12 mm"}
    slide, lever = link(1.5, P=[0, 0], T=[0.01, 0.1]), link(1.2, O2=[0, 0], P=[-0.09, 0.03], T=[0.05, 0.0])
    rod = {"rod": {"points": {"E": [0, 0], "P": [0.042, 0]}}}
    pairs = [
        ({"links": {"follower": slide}}, {"links": {**rod, "follower": slide}}, guide),
        ({"links": {"follower": lever}, "ground": {"O2": [0.1, 0.02]}},
         {"links": {**rod, "follower": lever}, "ground": {"O2": [0.1, 0.02]}}, {}),
    ]  # fmt: skip
    q = np.linspace(0.0, 6.0, 13)
    for with_cam, with_rod, joints in pairs:
        one = machine(copy.deepcopy(with_cam), joints | {"cam": cam}).evaluate({"phi": q, "w": 3.0, "a": 5.0})
        other = machine(copy.deepcopy(with_rod), joints).evaluate({"phi": q, "w": 3.0, "a": 5.0})
        assert one["tau"] == pytest.approx(other["tau"], abs=1e-12)
        force = np.abs([one["cam.fx"], one["cam.fy"]])
        assert force == pytest.approx(np.abs([other["P.fx"], other["P.fy"]]), abs=1e-10)
        for slope in ("tau_bias_dphi", "tau_bias_dw", "dJ_dphi"):
            assert one[slope] == pytest.approx(other[slope], abs=1e-10), slope
    face = {"on": "follower.P", "by": "shaft.O1", "radius": radius, "face": "T"}
    yoke = link(1.5, P=[0, 0], T=[0.1, 0.0])
    flat = machine({"links": {"follower": yoke}}, guide | {"cam": face}).evaluate(
        {"phi": q, "w": 3.0, "a": 5.0}
    )
    assert flat["follower.P.y"] == pytest.approx(0.03 + 0.008 * np.sin(q), abs=1e-15)
    assert flat["follower.P.ay"] == pytest.approx(0.008 * (5.0 * np.cos(q) - 9.0 * np.sin(q)), abs=1e-14)


def test_the_picture_has_the_profile_and_the_report_the_least_force():
    machine = Machine(machine_of(described("offset_roller")))
    picture = drawing(machine)
    assert picture.count('stroke-dasharray="4 4"') == 3
    findings = linkage_findings(machine, 20.0)
    assert findings.sentence == "shaft + cam follower (plunger)"
    q = np.linspace(0.0, 2.0 * math.pi, 721)
    least = np.min(machine.evaluate({"phi": q, "w": 20.0})["lobes.normal"])
    assert findings.joints["lobes"].least == pytest.approx(least, rel=1e-4)
    assert findings.joints["guide"].least is None
    outlines = machine.drive(0.0).linkage.outlines
    assert [*outlines] == ["lobes", "lobes.roller"]
    x, y = outlines["lobes"].points().x, outlines["lobes"].points().y
    assert np.hypot(x, y)[0] == pytest.approx(0.04, rel=1e-12)


PLUNGER = """
title = "Plunger"
parameters = { base = "40 mm", lift = "6 mm" }
ground = { O1 = [0, 0], G = [0, 0], G2 = [0, 1] }
driver = { link = "shaft" }
links.shaft.points = { O1 = [0, 0] }
links.plunger = { points = { P = [0, 0] }, mass = "1 kg" }
joints.guide = { on = "plunger.P", by = "ground.G", toward = "G2" }
joints.cam = { on = "plunger.P", by = "shaft.O1", radius = "base + lift * cos(2 * phi)", roller = "10 mm" }
start.points = { P = [0, 0.05] }
"""


@pytest.mark.second
@pytest.mark.parametrize(("speed", "lifts"), [("120 rev/min", False), ("600 rev/min", True)])
def test_the_report_of_a_linkage_warns_of_a_follower_that_lifts_off(speed, lifts, tmp_path):
    (tmp_path / "plunger.toml").write_text(PLUNGER, "utf-8")
    process = chainunit("linkage", "plunger.toml", "--speed", speed, cwd=tmp_path, whole=False)
    assert process.returncode == 0
    said = "Warning: The follower would lift off at cam: the force of the contact falls to -"
    assert (said in " ".join(process.stdout.split())) == lifts


@pytest.mark.slow
def test_a_study_warns_of_a_follower_that_lifts_off(tmp_path):
    (tmp_path / "plunger.toml").write_text(PLUNGER, "utf-8")
    study = """
    [system]
    machine = "plunger.toml"
    motor = "IE3 4-pole 0.25 kW, 71M"
    [run]
    crank_speed = "%s rev/min"
    settle_turns = 1
    turns = 1
    step = 0.001
    """
    codes = {}
    for speed in (600, 120):
        text = "\n".join(line.strip() for line in (study % speed).splitlines())
        result = run_study(config.parse(text, str(tmp_path / "study.toml")), tmp_path)
        codes[speed] = {remark.code: remark for remark in result.findings.remarks}
    assert "lifts-off" in codes[600] and "lifts-off" not in codes[120]
    assert "cam with -" in codes[600]["lifts-off"].text


def test_friction_of_a_cam_counts_as_a_loss_of_the_joints():
    rubbing = Machine(machine_of(description_of(swinging_roller() | {"cams": {"friction": 0.1}}, "cam")))
    smooth = rubbing.replace(dict.fromkeys(losses_in_joints(rubbing), 0.0))
    motion = {"phi": np.arange(720) * 2.0 * math.pi / 720, "w": 5.0}
    lost, left = (np.mean(m.evaluate(motion)["dissipated_power"]) for m in (rubbing, smooth))
    assert lost > 1.0 and abs(left) < 1e-6


def test_each_follower_that_lifts_off_is_named():
    run = {
        f"machine.{cam}.normal": np.array([least, 1.0])
        for cam, least in (("inlet", -500.0), ("outlet", -3.0))
    }
    model = SimpleNamespace(contacts=("inlet.normal", "outlet.normal"))
    motor = SimpleNamespace(current_limit=lambda parameters: None)
    drive = SimpleNamespace(machine=SimpleNamespace(model=model), motor=motor, parameters=None)
    answers = SimpleNamespace(**dict.fromkeys(Layout(Answers).names) | {"current_peak": 0.0})
    runs = SimpleNamespace(
        answers={"steady": answers},
        drive=drive,
        steady=run,
        events={},
        overloads=[],
        returns=False,
        title_of=str,
    )
    said = [happening for happening in _happenings(runs, "steady") if happening[0] == "lifts-off"]
    assert said == [("lifts-off", "inlet with -500 N, outlet with -3.00 N", {"least": -500.0})]


def changed(make=offset_roller, cam=None, **tables):
    data = copy.deepcopy(make()) | tables
    name = "lobes" if "lobes" in data["joints"] else "lobe"
    for key, value in (cam or {}).items():
        if value is None:
            del data["joints"][name][key]
        else:
            data["joints"][name][key] = value
    return data


def on_the_cam():
    data = changed()
    data["joints"]["lobes"] |= {"on": "shaft.O1", "by": "plunger.P"}
    return data


LARGE = {"parameters": {"base": "40 mm", "lift": "15 mm"}}
ONE_PLACE = {
    "links": {"shaft": link(1.0, O1=[0, 0]), "tappet": link(0.8, F=[0, 0], F2=[0.02, 0.001], T=[0, 0])}
}


@pytest.mark.parametrize(
    ("data", "key", "words"),
    [
        (changed(cam={"radius": None, "type": "cam"}), "joints.lobes.radius", "is missing"),
        (
            changed(cam={"radius": "(base + lift) * phi"}),
            "joints.lobes.radius",
            "is 0 m at phi = 0 deg; must be > 0",
        ),
        (changed(cam={"radius": "base * cos(phi) + lift"}), "joints.lobes.radius", "must be > 0 all around"),
        (
            changed(cam={"radius": "base + lift * phi"}),
            "joints.lobes.radius",
            "its size jumps at phi = 0 deg",
        ),
        (
            changed(cam={"radius": "base + lift * abs(sin(phi))"}),
            "joints.lobes.radius",
            "its slope jumps at phi = 180 deg",
        ),
        (
            changed(cam={"radius": "base + lift * max(0, sin(phi)) * sin(phi)"}),
            "joints.lobes.radius",
            "its second derivative jumps at phi = 0 deg; a profile is smooth up to the second derivative: take a",
        ),
        (
            changed(cam={"radius": "base + table(phi, 0, 0, 1, 1) * lift"}),
            "joints.lobes.radius",
            "jumps at phi =",
        ),
        (changed(cam={"roller": "-2 mm"}), "joints.lobes.roller", "must be >= 0"),
        (
            changed(cam={"roller": "120 mm"}, **LARGE),
            "joints.lobes.roller",
            "profile is hollow with a radius of 78.82 mm",
        ),
        (changed(cam={"roller": "120 mm"}, **LARGE), "joints.lobes.roller", "a roller of less than 78.82 mm"),
        (
            changed(cam={"roller": "42 mm", "pitch": True}),
            "joints.lobes.roller",
            "pitch curve bulges with a radius of",
        ),
        (changed(cam={"pitch": 1}), "joints.lobes.pitch", "must be true or false"),
        (changed(cam={"face": "T"}), "joints.lobes.roller", "the follower has a face; take one of both out"),
        (
            changed(cam={"face": "Q", "roller": None}),
            "joints.lobes.face",
            "another point of plunger on its face: T",
        ),
        (
            changed(flat_tappet, cam={"radius": "base + lift * cos(4 * phi)"}),
            "joints.lobe.radius",
            "a face bridges it",
        ),
        (changed(cam={"type": "gear"}), "joints.lobes.", "belongs to a cam joint, and this one is a gear"),
        (
            changed(flat_tappet, cam={"face": "T"}, **ONE_PLACE),
            "joints.lobe",
            "F and T of tappet are in one place",
        ),
        (on_the_cam(), "links.plunger", "has the profile of lobes, and its follower shaft moves before it"),
        (changed(cams={"friction": -1}), "cams.friction", "must be >= 0"),
        (
            changed(ground={"O1": [0, 0], "G": [0.09, 0], "G2": [0.09, 1], "S": [0, 1]}),
            "links.plunger",
            "pressure angle",
        ),
    ],
    ids=lambda x: x if isinstance(x, str) and " " in x else "",
)
def test_what_is_refused(data, key, words):
    with pytest.raises(InputError) as caught:
        machine_of(description_of(data, "wrong"))
    faults = [(fault.key or "", str(fault)) for fault in caught.value.faults]
    assert any(found.startswith(key) and words in text for found, text in faults), faults


def test_no_range_with_a_cam():
    """A linkage that closes over a part of the turn: its refusal names no range, as a cam needs the whole one."""
    data = offset_roller()
    data["ground"]["O2"] = [0.3, 0]
    data["links"]["shaft"]["points"]["A"] = [0.15, 0]
    data["links"] |= {"rod": link(1.0, A=[0, 0], B=[0.18, 0]), "jaw": link(1.0, O2=[0, 0], B=[0.16, 0])}
    data["start"]["points"]["B"] = [0.3, 0.16]
    with pytest.raises(InputError, match="the group of rod, jaw cannot close") as caught:
        machine_of(description_of(data, "part"))
    assert "range" not in str(caught.value)


def test_a_table_of_losses_needs_a_cam():
    data = {name: entry for name, entry in flat_lever().items() if name != "joints"}
    data["joints"] = {"arm": {"on": "lever.F", "by": "shaft.A"}}
    with pytest.raises(InputError, match="no joint of the linkage is a cam; leave the table out"):
        machine_of(description_of(data | {"cams": {"friction": 0.1}}, "none"))


def test_a_cam_that_differs():
    """A cam may have losses of its own."""
    data = offset_roller() | {"cams": {"friction": 0.1, "lobes": {"friction": 0.3}}}
    both = [
        Machine(machine_of(description_of(offset_roller() | {"cams": {"friction": x}}, "one")))
        for x in (0.1, 0.3)
    ]
    at = {"phi": np.linspace(0.0, 6.0, 9), "w": 3.0}
    differing = Machine(machine_of(description_of(data, "differing"))).evaluate(at)["tau"]
    common, own = (machine.evaluate(at)["tau"] for machine in both)
    assert differing == pytest.approx(own, rel=1e-13) and np.max(np.abs(common - own)) > 1e-3


@pytest.mark.slow
@pytest.mark.skipif(compiler() is None, reason="no C compiler")
def test_a_coasting_cam_loses_its_energy_by_friction(tmp_path):
    """The direct model without a torque: what kinetic and potential energy lose is what friction takes."""
    data = offset_roller() | {"cams": {"friction": 0.05}}
    file = export(machine_of(description_of(data, "coasting")).direct(), tmp_path / "direct.fmu", fmi=2)
    rows = fmpy.simulate_fmu(
        str(file), stop_time=1.0, output_interval=1e-3, start_values={"w_start": 30.0, "tau": 0.0},
        output=["w", "kinetic_energy", "potential_energy", "dissipated_power"],
    )  # fmt: skip
    energy = rows["kinetic_energy"] + rows["potential_energy"]
    lost = np.trapezoid(rows["dissipated_power"], rows["time"])
    assert lost > 3.0 and energy[0] - energy[-1] == pytest.approx(lost, rel=2e-4)
