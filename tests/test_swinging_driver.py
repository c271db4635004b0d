"""A driver that swings within a range: against an independent solution, in Python and as FMUs; the range in which a
linkage closes; end stops; what is refused."""

from __future__ import annotations

import copy
import io
import json
import math
import re
import zipfile
from collections import Counter
from dataclasses import replace

import fmpy
import numpy as np
import pytest
from by_itself import moved_by_itself
from command import chainunit
from fmpy.validation import validate_fmu
from linkage_files import MACHINES, tables
from multibody import Multibody
from random_linkages import DYADS, random_linkage
from reports import packed_in
from scipy.optimize import brentq
from swinging import ALL, DOUBLE_ROCKER, STEPHENSON, WATT, with_range
from test_linear_driver import TRAMMEL
from test_linkage_random import by_the_machine, deviations

from chainunit.core.errors import InputError
from chainunit.core.native.compilers import compiler
from chainunit.fmu.export import export as export_python
from chainunit.fmu.native.export import export
from chainunit.machines.linkages.file import description_of, read_linkage
from chainunit.machines.linkages.model import machine_of
from chainunit.machines.machine import Machine
from chainunit.study import config
from chainunit.study.linkage_turn import linkage_findings

LOW, HIGH = math.radians(20.0), math.radians(75.0)
COSINE = math.sqrt(1.0 - 1e-6)
"""Cosine of the transmission angle at the least margin, 1e-3."""
RANGE = re.compile(r'write range = \["(\S+) (deg|m)", "(\S+) (deg|m)"\] in \[driver\]')


def model(data, name="mine"):
    return machine_of(description_of(data, name))


def refusal(data):
    with pytest.raises(InputError) as caught:
        model(data)
    return str(caught.value)


def closing(data):
    """The range in the refusal of a linkage, and the groups at its ends."""
    words = refusal(data)
    found, ends = RANGE.search(words), re.findall(r"\(group of ([^)]*)\)", words)
    assert found, words
    return [f"{found[1]} {found[2]}", f"{found[3]} {found[4]}"], ends


# against the independent solution


@pytest.mark.parametrize("name", ALL)
@pytest.mark.second
def test_torque_and_all_reactions_agree_with_an_independent_solution(name):
    """At 200 places, there and back, with gravity and a force of constant direction at a point of a link."""
    text = description_of(ALL[name], name)
    machine, own = Machine(machine_of(text)), Multibody(text)
    q = np.linspace(LOW, HIGH, 200)
    for w, a in ((2.5, 7.0), (-2.5, 7.0), (-2.5, -4.0)):
        outputs = machine.evaluate({"phi": q, "w": w, "a": a})
        pose = own.followed(LOW)
        rows = []
        for place in q:
            pose = own.closed(place, pose)
            rows.append(own.solution(pose, place, w, a))
        forces = [key for key in rows[0] if key == "tau" or key.endswith((".fx", ".fy"))]
        assert len(forces) == 1 + 2 * len(own.joints)
        for key in rows[0]:
            wanted = np.array([row[key] for row in rows])
            size = max(np.max(np.abs(rows[k][each])) for each in forces for k in (0, 99, 199))
            scale = size if key in forces or key == "load_power" else max(1.0, np.max(np.abs(wanted)))
            assert np.max(np.abs(outputs[key] - wanted)) < 1e-11 * scale, key


@pytest.mark.slow
def test_random_linkages_swing_in_the_range_that_their_refusal_names():
    """Of all kinds of dyads: the range may be pasted, and inside it the independent solution agrees to 1e-11."""
    kinds: Counter[str] = Counter()
    for seed in range(80):
        data, groups = random_linkage(seed)
        try:
            model(data, f"random_{seed}")
        except InputError as error:
            found = RANGE.search(str(error))
        else:
            continue
        if found is None:  # a triad needs a driver that turns
            assert any(kind == "triad" for kind, _ in groups), seed
            continue
        low, high = float(found[1]), float(found[3])
        model(with_range(data, [f"{low} deg", f"{high} deg"]), f"swings_{seed}")
        start, tenth = math.degrees(data["start"]["phi"]), 0.1 * (high - low)
        low, high = min(start, low + tenth), max(start, high - tenth)
        text = description_of(with_range(data, [f"{low} deg", f"{high} deg"]), f"swings_{seed}")
        own, rng = Multibody(text), np.random.default_rng(seed)
        for q in np.radians([low, 0.5 * (low + high), high]):
            w, a = rng.uniform(-5.0, 5.0), rng.uniform(-20.0, 20.0)
            wanted = own.solution(own.followed(q, 0.02), q, w, a)
            worst = max(
                deviations(by_the_machine(machine_of(text), q, w, a)[0], wanted), key=lambda pair: pair[1]
            )
            assert worst[1] < 1e-11, (seed, worst)
        kinds.update(kind for kind, _ in groups)
    assert all(kinds[kind] for kind in DYADS), kinds


@pytest.mark.parametrize("name", ALL)
def test_both_routes_to_the_torque_and_the_power_balance(name):
    """With friction, which takes power in both directions, and by differences of the energies."""
    data = {**ALL[name], "pins": {"friction": 0.1, "diameter": 0.05, "damping": 0.5}}
    machine = Machine(model(data, f"{name}_rubs"))
    q, h = np.linspace(LOW + 0.01, HIGH - 0.01, 60), 1e-5
    for w, a in ((2.0, 5.0), (-2.0, 5.0)):
        state = machine.state(machine.inputs({"phi": q, "w": w, "a": a}))
        losses = state.effects["pins"].dissipative
        torque = state.torque(a)
        assert np.max(np.abs(state.torque_by_reactions(a) + losses - torque)) < 1e-11 * np.max(np.abs(torque))
        out = machine.outputs(q, w, a)
        assert np.all(out.dissipated_power + out.load_power > 0.0)

        def energy(t, w=w, a=a):
            there = machine.outputs(q + w * t + 0.5 * a * t * t, w + a * t, a)
            return there.kinetic_energy + there.potential_energy

        rate = (energy(-2 * h) - 8 * energy(-h) + 8 * energy(h) - energy(2 * h)) / (12 * h)
        assert np.max(np.abs(out.power - out.dissipated_power - rate)) < 1e-6 * np.max(np.abs(out.power))


@pytest.mark.stages(first=1)
@pytest.mark.skipif(compiler() is None, reason="no C compiler")
@pytest.mark.parametrize("make", ["python", "native 2", "native 3"])
@pytest.mark.parametrize("name", ["double_rocker", "watt"])
def test_fmus_agree_with_the_independent_solution_and_refuse_an_angle_outside(name, make, tmp_path):
    text, file = description_of(ALL[name], name), tmp_path / f"{name}.fmu"
    own, machine = Multibody(text), machine_of(text)
    if make == "python":
        export_python(machine, file)
    else:
        export(machine, file, fmi=int(make[-1]))

    def values(phi, w, names):
        return fmpy.simulate_fmu(
            str(file), stop_time=0.01, step_size=0.01, output=names, fmi_type="CoSimulation",
            start_values={"phi": phi, "w": w, "a": 3.0},
        )  # fmt: skip

    if make != "native 3":  # there fmpy misses the aliases, see test_gallery_clients
        assert not validate_fmu(str(file))
    for phi, w in ((LOW, 2.0), (0.8, -2.0), (HIGH, -1.0)):
        wanted = own.solution(own.followed(phi), phi, w, 3.0)
        names = [key for key in wanted if key == "tau" or key.endswith((".fx", ".fy"))]
        got = values(phi, w, names)[0]
        size = max(abs(wanted[key]) for key in names)
        for key in names:
            assert got[key] == pytest.approx(wanted[key], abs=1e-11 * size), key
    for phi in (LOW - 1e-3, HIGH + 1e-3, 0.8 + 2.0 * math.pi):
        if make == "python":  # pythonfmu has no status of a value that is read: it is not a number
            assert np.isnan(values(phi, 0.0, ["tau"])["tau"]).all()
            continue
        with pytest.raises(Exception, match=r"EnterInitializationMode failed"):
            values(phi, 0.0, ["tau"])
    # inside a step the driver goes on, to the end of its range at most
    end = values(HIGH - 1e-3, 2.0, ["phi0", "w0", "tau"])[-1]
    assert (end["phi0"], end["w0"]) == (HIGH, pytest.approx(2.03)) and np.isfinite(end["tau"])
    with zipfile.ZipFile(file) as inside:  # the shaft of the reference results swings within its range
        name = next(name for name in inside.namelist() if name.endswith("_in.csv"))
        rows = np.genfromtxt(io.BytesIO(inside.read(name)), delimiter=",", names=True)
    assert np.all(rows["phi"] > LOW) and np.all(rows["phi"] < HIGH) and np.ptp(rows["phi"]) > 0.4


def test_an_angle_outside_the_range_is_refused():
    machine = Machine(model(WATT))
    for phi in (LOW - 1e-6, HIGH + 1e-6, 0.8 + 2.0 * math.pi, -0.3):
        with pytest.raises(
            InputError, match=r"must be >= 0\.349066 rad and <= 1\.309 rad .* 20 deg to 75 deg"
        ):
            machine.outputs(phi)


def test_with_a_gear_the_range_counts_at_the_driver():
    geared, plain = Machine(model({**WATT, "ratio": 12.0}, "geared")), Machine(model(WATT))
    for q in (LOW, 0.9, HIGH):
        one, other = geared.outputs(12.0 * q, 24.0, 12.0), plain.outputs(q, 2.0, 1.0)
        assert 12.0 * float(one.tau) == pytest.approx(float(other.tau), rel=1e-11)
    with pytest.raises(InputError, match="phi = 1 rad"):
        geared.outputs(1.0)
    with pytest.raises(InputError, match=r"ratio = 5: must be >= 12 and <= 12 .* the file alone sets it"):
        Machine(geared.model, ratio=5.0)


def test_a_range_of_a_whole_turn_gives_the_machine_that_turns():
    """The crank-rocker, from the start on once around."""
    links = {name: copy.deepcopy(link) for name, link in DOUBLE_ROCKER["links"].items()}
    links["crank"]["points"]["A"] = [0.1, 0]
    links["coupler"]["points"]["B"] = [0.9, 0]
    start = {"phi": 0.0, "points": {"B": [0.95, 0.65]}}
    data = {**DOUBLE_ROCKER, "links": links, "start": start}
    turning = Machine(model(with_range(data, None)))
    swinging = Machine(model(with_range(data, ["0 deg", "360 deg"]), "whole"))
    q = np.linspace(0.0, 2.0 * math.pi, 50)
    one, other = (m.evaluate({"phi": q, "w": 2.0, "a": 1.0}) for m in (turning, swinging))
    for name, value in one.items():
        np.testing.assert_allclose(other[name], value, rtol=1e-11, atol=1e-9, err_msg=name)


# the range in which a linkage closes


@pytest.mark.stages(first=1)
@pytest.mark.parametrize(
    ("r", "l", "h", "d"), [(0.6, 0.5, 0.6, 1.0), (0.9, 0.4, 0.5, 1.1), (0.7, 1.2, 0.35, 0.8)]
)
def test_the_refusal_names_the_range_in_which_a_double_rocker_closes(r, l, h, d):
    """A and O2 are sqrt(d^2 + r^2 - 2 d r cos(phi)) apart, at an end nearly l + h or |l - h|."""
    data = copy.deepcopy(with_range(DOUBLE_ROCKER, None))
    data["ground"]["O2"] = [d, 0.0]
    data["links"]["crank"]["points"]["A"] = [r, 0]
    data["links"]["coupler"]["points"]["B"] = [l, 0]
    data["links"]["rocker"]["points"]["B"] = [h, 0]

    def angle(reach):
        return math.acos((d * d + r * r - reach * reach) / (2.0 * d * r))

    least, most = (math.sqrt(l * l + h * h - sense * 2.0 * l * h * COSINE) for sense in (1.0, -1.0))
    # past 180 or 0 deg the crank goes on to the mirror image of the other end
    near = angle(least) if least > abs(d - r) else -angle(most)
    far = angle(most) if most < d + r else 2.0 * math.pi - near
    start = 0.5 * (near + far)
    data["start"] = {"phi": start, "points": {"B": [0.7 * d, 0.5]}}
    wanted = [near, far]
    span, groups = closing(data)
    assert groups == ["coupler, rocker"] * 2
    for text, end, sense in zip(span, wanted, (1.0, -1.0), strict=True):
        # rounded inward to four digits
        inward = sense * (float(text.split()[0]) - math.degrees(end))
        assert -1e-8 <= inward < 1.0001e-4, (text, math.degrees(end))
    # it may be pasted
    machine = Machine(model(with_range(data, span)))
    assert machine.model.span == pytest.approx([math.radians(float(text.split()[0])) for text in span])
    assert float(machine.outputs(machine.model.span[1]).margin) > 1e-3
    wider = [span[0], f"{float(span[1].split()[0]) + 0.001:.4f} deg"]
    again, groups = closing(with_range(data, wider))
    assert again == span and groups == ["coupler, rocker"]


def ends_of(arm, phi):
    """The cosine of the angle between both links of the second dyad of the Watt six-bar, in size less that at the
    least margin; -1 where the first dyad does not close."""
    e = np.exp(1j * phi)
    a, o2 = 0.6 * e, 1.0 + 0.1j
    gap = o2 - a
    along = 0.5 * (1.0 + (0.5**2 - 0.6**2) / abs(gap) ** 2)
    square = 0.5**2 / abs(gap) ** 2 - along * along
    if square <= 0.0:
        return -1.0
    b = a + gap * (along + 1j * math.sqrt(square))
    p = a + (0.2 + 0.15j) * (b - a) / 0.5
    s = o2 + (0.75 + 0.1j) * (b - o2) / 0.6
    return COSINE - abs((arm**2 + 0.6**2 - abs(p - s) ** 2) / (2.0 * arm * 0.6))


@pytest.mark.parametrize("arm", [0.42, 0.76, 0.78])
def test_the_refusal_tells_which_group_ends_the_range(arm):
    data = copy.deepcopy(with_range(WATT, None))
    data["links"]["arm"]["points"]["F"] = [arm, 0.0]
    start = math.radians(60.0)
    assert ends_of(arm, start) > 0.0
    span, groups = closing(data)
    for text, sense, group in zip(span, (-1.0, 1.0), groups, strict=True):
        places = start + sense * np.linspace(0.0, math.pi, 4001)
        bad = next(k for k, q in enumerate(places) if ends_of(arm, q) <= 0.0)
        own = ends_of(arm, places[bad]) > -1.0
        assert group == ("arm, leg" if own else "coupler, rocker")
        if own:
            end = brentq(lambda q: ends_of(arm, q), *sorted(places[bad - 1 : bad + 1]), xtol=1e-15)
            inward = sense * (math.degrees(end) - float(text.split()[0]))
            assert -1e-8 <= inward < 1.0001e-4
    assert any(group == "arm, leg" for group in groups)
    model(with_range(data, span))


def test_a_driver_that_slides_is_told_its_range_too():
    """The rod of the trammel is 0.5 m long: there its block comes to a dead position."""
    data = {**TRAMMEL, "driver": {"joint": "cylinder", "range": [0.1, 0.6]}}
    span, groups = closing(data)
    assert span == ["0.1 m", "0.499999 m"] and groups == ["rod, top"]
    model({**data, "driver": {"joint": "cylinder", "range": span}})
    outside = {**data, "start": {**data["start"], "phi": "0 m"}}
    assert 'start.phi: is "0 m"; must be a way in driver.range, from 0.1 m to 0.6 m' in refusal(outside)


def test_a_parallelogram_has_the_range_between_its_change_points():
    """Coupler and rocker are at the angle of the crank: the sine of 0.0573 deg is 1e-3."""
    data = copy.deepcopy(with_range(DOUBLE_ROCKER, None))
    data["ground"]["O2"] = [1.0, 0.0]
    for link, point, length in (("crank", "A", 0.5), ("coupler", "B", 1.0), ("rocker", "B", 0.5)):
        data["links"][link]["points"][point] = [length, 0]
    data["start"] = {"phi": "60 deg", "points": {"B": [1.25, 0.43]}}
    assert "comes to a dead position at 180 deg of crank" in refusal(data)
    span, groups = closing(data)
    assert span == ["0.0573 deg", "179.9427 deg"] and groups == ["coupler, rocker"] * 2
    model(with_range(data, span))


def test_a_start_that_does_not_close_has_no_range():
    data = copy.deepcopy(with_range(DOUBLE_ROCKER, None))
    data["start"]["phi"] = "120 deg"
    words = refusal(data)
    assert "cannot close at 120 deg of crank" in words and "range" not in words


# loads over the range


def test_extremes_and_tables_of_loads_count_over_the_range():
    """The largest place of a point by a fine search; a table over the angle stays constant beyond its ends."""
    data = copy.deepcopy(WATT)
    data["tables"] = {"torque": {"phi": ["30 deg", "50 deg", "60 deg"], "value": ["2 N m", "5 N m", "8 N m"]}}
    data["loads"] = {
        "lift": {"on": "leg.T", "force": [0, "stiff * (max(y) - min(y))"]},
        "angle": {"type": "torque", "on": "crank", "torque": "unit * stroke(leg.angle) + torque"},
    }
    data["parameters"] = {"stiff": "1000 N/m", "unit": "100 N m"}
    machine = Machine(model(data, "loaded"))
    plain = Machine(model({**WATT, "loads": {}}, "plain"))
    out = plain.outputs(np.linspace(LOW, HIGH, 200001), 0.0)
    lift, swing = 1000.0 * np.ptp(out.leg.T.y), 100.0 * np.ptp(out.leg.angle)
    for q, table in ((LOW, 2.0), (HIGH, 8.0)):
        one, other = machine.outputs(q, 1.0), plain.outputs(q, 1.0)
        change = lift * float(other.leg.T.vy) + swing + table
        assert float(one.load_power) == pytest.approx(change, rel=1e-8)
        assert float(one.tau) == pytest.approx(float(other.tau) - change, rel=1e-8)


def test_a_triad_with_a_driver_that_swings():
    data = tables(MACHINES["triad_slider"]["description"])
    low, high = data["driver"]["range"] = [data["start"]["phi"] - 0.2, data["start"]["phi"] + 1.5]
    text = description_of(data, "triad")
    own = Multibody(text)
    for q in np.linspace(low, high, 7):
        wanted = own.solution(own.followed(q), q, 3.0, -8.0)
        got = by_the_machine(machine_of(text), q, 3.0, -8.0)[0]
        assert max(deviations(got, wanted), key=lambda pair: pair[1])[1] < 1e-11


# the report


@pytest.mark.second
def test_the_findings_there_and_back():
    """Peaks, means and work of both ways from fine places; friction takes power on both."""
    data = {**WATT, "pins": {"friction": 0.15, "diameter": 0.05}}
    machine = Machine(model(data, "rubbing"))
    found = linkage_findings(machine, 2.0)
    q = np.linspace(LOW, HIGH, 40001)
    work = {}
    for way, w in ((found, 2.0), (found.back, -2.0)):
        out = machine.outputs(q, w)
        assert way.speed == w
        assert np.array_equal(way.outputs["tau"], machine.outputs(way.q, w).tau)
        assert abs(way.turn.torque_peak) == pytest.approx(np.max(np.abs(out.tau)), rel=1e-8)
        mean = np.trapezoid(out.tau, q) / (HIGH - LOW)
        assert way.turn.torque_mean == pytest.approx(mean, rel=1e-7)
        assert way.turn.power_mean == pytest.approx(mean * w, rel=1e-7)
        for name, joint in way.joints.items():
            force = np.hypot(getattr(out, name).fx, getattr(out, name).fy)
            assert joint.peak == pytest.approx(np.max(force), rel=1e-8)
            assert joint.rms == pytest.approx(math.sqrt(np.trapezoid(force**2, q) / (HIGH - LOW)), rel=1e-7)
        work[w] = np.trapezoid(out.dissipated_power + out.load_power, q) / 2.0
        assert work[w] > 0.0
    # what remains after there and back is the friction
    both = (found.turn.torque_mean - found.back.turn.torque_mean) * (HIGH - LOW)
    assert both == pytest.approx(sum(work.values()), rel=1e-7)
    assert found.swings["crank"].range == pytest.approx(HIGH - LOW, rel=1e-12)
    margin = np.min(machine.outputs(q).margin)
    assert min(group.margin for group in found.groups.values()) == pytest.approx(margin, rel=1e-8)


FILE = """
title = "Gripper"
[ground]
O1 = [0, 0]
O2 = ["1 m", "100 mm"]
[driver]
link = "crank"
range = ["20 deg", "75 deg"]
[links.crank]
points = { O1 = [0, 0], A = ["600 mm", 0] }
mass = 5
[links.coupler]
points = { A = [0, 0], B = ["500 mm", 0] }
mass = 4
inertia = 0.1
[links.rocker]
points = { O2 = [0, 0], B = ["600 mm", 0] }
[pins]
friction = 0.1
[start]
phi = "60 deg"
points = { B = ["800 mm", "650 mm"] }
"""


@pytest.mark.second
def test_the_command_shows_the_motion_there_and_back(tmp_path):
    (tmp_path / "gripper.toml").write_text(FILE, "utf-8")
    done = chainunit("linkage", "gripper.toml", "--speed", "20 rpm", "-o", "out", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "there and back over its range" in done.stdout
    assert "Reactions, on the way forth" in done.stdout and "Reactions, on the way back" in done.stdout
    assert "Swing" in done.stdout and "dead centres" not in done.stdout  # its ends are those of the range
    result = json.loads((tmp_path / "out" / "linkage.json").read_text("utf-8"))
    forth, back = (np.array(r["over_the_way"]["tau"]["value"]) for r in (result, result["back"]))
    q = np.array(result["over_the_way"]["driver"]["value"])
    assert (q[0], q[-1]) == pytest.approx((LOW, HIGH))
    machine, w = Machine(read_linkage(tmp_path / "gripper.toml")), 2.0 * math.pi / 3.0
    assert forth == pytest.approx(machine.outputs(q, w).tau, rel=1e-12)
    assert back == pytest.approx(machine.outputs(q, -w).tau, rel=1e-12)
    assert np.all(forth > back)
    assert result["swings"]["crank"]["least_at"]["value"] == pytest.approx(LOW)
    page = (tmp_path / "out" / "report.html").read_text("utf-8")
    assert "path of A" in packed_in(page, "pictures")


def test_a_study_names_what_serves_instead(tmp_path):
    (tmp_path / "gripper.toml").write_text(FILE, "utf-8")
    for more in ("", "[sizing]\ncandidates = 3\n", '[sweep]\nparameters = { "machine.g" = [9.0, 10.0] }\n'):
        with pytest.raises(InputError, match=r"has a driver that swings from 20 deg to 75 deg") as caught:
            config.parse(f'[machine]\nlinkage = "gripper.toml"\n{more}', str(tmp_path / "mine.toml"))
        assert "the report on the linkage shows its forces there and back" in str(caught.value)


# the direct model


def run(direct, p, tau, seconds, pieces=24):
    """States at the end, the angles on the way, the outputs at the end, and the gained energy."""
    return moved_by_itself(direct, p, direct.Inputs(tau=tau), seconds, pieces, 1e-8, 1e2)


@pytest.mark.second
@pytest.mark.parametrize("ratio", [1.0, 8.0])
def test_a_driver_that_moves_by_itself_stays_between_its_end_stops(ratio):
    data = {**DOUBLE_ROCKER, "ratio": ratio, "pins": {"friction": 0.1, "damping": 2.0}}
    machine = model(data, "falls")
    direct = machine.direct()
    assert "end_stop_torque" in direct.parts[0].layout.names
    units = {v.name: v.unit for v in direct.parameter_layout.variables}
    assert (units["end_stops.stiffness"], units["end_stops.damping"]) == ("N.m/rad", "N.m.s/rad")
    p = direct.check(direct.Parameters())
    for tau, end, sign in ((0.0, LOW, -1.0), (600.0 / ratio, HIGH, 1.0)):
        states, way, last, gained = run(direct, p, tau, 4.0)
        assert ratio * (LOW - 0.02) < min(way) and max(way) < ratio * (HIGH + 0.02)
        assert states[0] / ratio == pytest.approx(end, abs=2e-3) and abs(states[1]) < 1e-3 * ratio
        assert gained == pytest.approx(states[2], rel=1e-4)
        assert last.end_stop_torque == pytest.approx(ratio * (tau - last.tau_bias), rel=1e-2)
        assert sign * last.end_stop_torque > 0.0


def test_without_losses_it_rebounds_with_its_energy():
    """Stops without dampers: the energy at the end is that at the start with the work of the torque."""
    direct = model(DOUBLE_ROCKER, "rebounds").direct()
    p = direct.Parameters()
    p = direct.check(replace(p, end_stops=replace(p.end_stops, damping=0.0)))
    states, way, _, gained = run(direct, p, -30.0, 1.5, 60)
    assert min(way) < LOW  # it was in the stop
    assert gained == pytest.approx(states[2], rel=1e-5, abs=1e-3)


GRAVITY = 9.81


@pytest.mark.parametrize(
    ("mass", "inertia", "effort", "slides"),
    [
        (3.0, 0.2, GRAVITY * math.sqrt(3.0 * 0.2), False),  # the weight at the radius of gyration
        (0.0, 0.0, 1.0, False),
        (3.0, 0.0, GRAVITY * 3.0, True),
        (0.0, 0.0, 1.0, True),
    ],
)
def test_the_usual_end_stops(mass, inertia, effort, slides):
    """They take the energy of the effort over the range in a hundredth of it, at half of the critical damping; with
    them a driver without masses has a direct model, too, as soon as there is an inertia on its shaft."""
    link = {"points": {"O": [0, 0]}, **({"mass": mass, "inertia": inertia} if mass else {})}
    if slides:
        data = {
            "ground": {"G": [0, 0], "X": [1, 0]}, "driver": {"joint": "guide", "range": [0.0, 2.0]},
            "links": {"ram": {k: v for k, v in link.items() if k != "inertia"}},
            "joints": {"guide": {"on": "ram.O", "by": "ground.G", "toward": "X"}}, "start": {"phi": 1.0},
        }  # fmt: skip
    else:
        data = {
            "ground": {"O": [0, 0]}, "driver": {"link": "arm", "range": [0.0, 2.0]},
            "links": {"arm": {**link, "points": {"O": [0, 0], "T": [0.5, 0]}}}, "start": {"phi": 1.0},
        }  # fmt: skip
    direct = machine_of(description_of(data, "bare")).direct()
    p = direct.check(replace(direct.Parameters(), J_added=1.0))
    stiffness, moved = p.end_stops.stiffness, mass if slides else inertia
    assert 0.5 * stiffness * (0.01 * 2.0) ** 2 == pytest.approx(effort * 2.0, rel=1e-12)
    assert p.end_stops.damping == pytest.approx(math.sqrt(stiffness * moved), rel=1e-12)


@pytest.mark.skipif(compiler() is None, reason="no C compiler")
@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.second
def test_the_direct_fmu_rests_on_its_stop(fmi, tmp_path):
    data = {**STEPHENSON, "pins": {"friction": 0.1, "damping": 2.0}}
    file = export(model(data, "direct_stephenson").direct(), tmp_path / "direct.fmu", fmi=fmi)
    found = fmpy.simulate_fmu(
        str(file), stop_time=6.0, output=["phi", "end_stop_torque", "tau_bias"], output_interval=0.05,
        fmi_type="CoSimulation",
    )  # fmt: skip
    assert np.all(found["phi"] > LOW - 0.02) and np.all(found["phi"] < HIGH + 0.02)
    assert abs(found["end_stop_torque"][-1]) > 1.0
    assert found["end_stop_torque"][-1] == pytest.approx(-found["tau_bias"][-1], rel=1e-3)
