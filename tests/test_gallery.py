"""The gallery of linkage files: each closes, keeps its energy, and has one torque by two routes; chain unit and knife
drive are the packaged machines; what the files say at their top is so.

Measured over 50 random states and parameters: torque, load port and slopes of both within 7e-15 of the packaged
machines, reactions within 2e-14, the small angle of the knife within 5e-13."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from papers import paper000
from scipy.integrate import solve_ivp

from chainunit.core.engines import MATH
from chainunit.machines.chain_unit import ChamberForces
from chainunit.machines.knife_drive import KnifeDrive
from chainunit.machines.linkages.file import read_linkage
from chainunit.machines.machine import Machine
from chainunit.reading.results import as_data
from chainunit.report import linkage
from chainunit.report.drawing import drawing
from chainunit.study.config import parse
from chainunit.study.linkage_turn import linkage_findings
from chainunit.study.run import run_study

FOLDER = Path(__file__).parents[1] / "examples" / "linkages"
FILES = sorted(FOLDER.glob("*.toml"))
KINDS = {
    "andrews_squeezer": ["RRR", "RRR", "RRR"],
    "beam_pump_api": ["RRR"],
    "blake_jaw_crusher": ["RRR", "RRR"],
    "chain_unit": ["RRR", "RRR", "RRR"],
    "chain_unit_points": ["RRR", "RRR", "RRR"],
    "coupling_rods": ["shared plate"],
    "crank_shaper": ["RPR", "RRP"],
    "cylinder_lift": ["RRR"],
    "dwell_six_bar": ["RRR", "RRR"],
    "edge_trimmer": ["triad"],
    "jaw_crusher_bearings": ["RRR", "RRR"],
    "knife_drive": ["RRR", "triad"],
    "level_luffing_crane": ["RRR"],
    "pump_jack": ["RRR"],
    "punching_press": ["RRP"],
    "rack_feeder": ["RRP", "rack and pinion"],
    "scissor_lift": ["cylinder", "RRP", "RRR", "RPR"],
    "scotch_yoke_pump": ["RPP"],
    "slider_crank_press": ["RRP"],
    "stephenson_six_bar": ["RRR", "RRR"],
    "stephenson_two_six_bar": ["tetrad"],
    "straight_line_pump": ["geared link"],
    "tipper": ["cylinder"],
    "toggle_clamp": ["RRR"],
    "valve_cam": ["cam follower"],
    "watt_six_bar": ["RRR", "RRR"],
    "whitworth_quick_return": ["RPR", "RRP"],
}
"""The groups of each machine."""
TURN = np.arange(720) * np.pi / 360.0


@cache
def machine(name: str) -> Machine:
    return Machine(read_linkage(FOLDER / f"{name}.toml"))


def way(name):
    """Places of the driver: a turn, or its range, not quite to its ends."""
    if machine(name).model.turns:
        return TURN
    low, high = machine(name).model.span
    return np.linspace(low + 1e-3, high - 1e-3, 101)


def turn(name, speed=1.0, **values):
    """The outputs over a turn in steps of half a degree."""
    return machine(name).replace(values).outputs(TURN, w=speed)


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_each_file_says_what_to_see_and_has_its_groups(file):
    first = file.read_text("utf-8").splitlines()[0]
    assert re.match(r"# See [a-z]", first)
    groups = machine(file.stem).model.described_by.structure.groups
    assert [group.kind for group in groups] == KINDS[file.stem]


@pytest.mark.parametrize("name", KINDS)
def test_both_routes_to_the_torque_agree(name):
    """Virtual work of all links, and the balance of the driver with its reactions; friction is in neither."""
    m, a = machine(name), 7.0
    state = m.state(m.inputs({"phi": way(name), "w": 4.0, "a": a}))
    friction = sum(state.effects[each].dissipative for each in ("pins", "guides") if each in state.effects)
    torque = state.torque(a) - friction
    scale = np.max(np.abs(torque))
    assert scale > 0.0
    assert np.max(np.abs(state.torque_by_reactions(a) - torque)) < 1e-9 * scale


@pytest.mark.parametrize("name", KINDS)
def test_the_power_balance_holds(name):
    """Exactly: tau w is J w a, the slope of J, and what weights, loads and friction take. And by differences of the
    energies over time."""
    m, w, a, h, q = machine(name), 3.0, 5.0, 1e-5, way(name)
    feed = m.model.feed_layout.by_name(m.model.Feed())
    inputs = {"phi": q, "w": w, "a": a, **feed}
    out, effects = m.evaluate(inputs), m.state(m.inputs(inputs)).effects
    scale = np.max(np.abs(out["power"]))
    height = sum(each.conservative for each in effects.values())
    kinetic = out["J"] * w * a + 0.5 * out["dJ_dphi"] * w**3
    balance = out["power"] - (kinetic + height * w + out["dissipated_power"])
    assert np.max(np.abs(balance)) < 1e-9 * scale

    def energy(t):
        at = m.outputs(q + w * t + 0.5 * a * t * t, w + a * t, a)
        return at.kinetic_energy + at.potential_energy

    rate = (energy(-2 * h) - 8 * energy(-h) + 8 * energy(h) - energy(2 * h)) / (12 * h)
    assert np.max(np.abs(out["power"] - out["dissipated_power"] - rate)) < 1e-6 * scale


# what the files say at their top


def said(name, pattern):
    """Numbers of the comment at the top of a file."""
    comment = (FOLDER / f"{name}.toml").read_text("utf-8").partition("title =")[0].replace("\n# ", " ")
    return [float(each) for each in re.search(pattern, comment).groups()]


def test_the_straight_line_is_as_long_as_the_file_says():
    way, most = said("straight_line_pump", r"throw of the crank, (\d+) mm; the teeth bear up to (\S+) kN")
    out = turn("straight_line_pump", 2.0 * np.pi)
    assert (
        1e3 * np.ptp(out.planet.E.x) == pytest.approx(way, rel=1e-12)
        and np.max(np.abs(out.planet.E.y)) < 1e-15
    )
    assert 1e-3 * np.max(np.hypot(out.mesh.fx, out.mesh.fy)) == pytest.approx(most, abs=0.05)


def test_the_dwell_is_where_the_file_says():
    start, end, moved, swing = said(
        "dwell_six_bar", r"from (\d+) to (\d+) degrees it moves by (\S+) .* by (\S+) degrees"
    )
    angle = np.degrees(turn("dwell_six_bar").output.angle)
    still = angle[int(2 * start) : int(2 * end) + 1]
    assert np.ptp(still) == pytest.approx(moved, abs=5e-4) and np.ptp(angle) == pytest.approx(swing, abs=0.05)
    # of no other link
    others = [turn("dwell_six_bar").coupler, turn("dwell_six_bar").rocker, turn("dwell_six_bar").connector]
    assert min(np.ptp(np.degrees(each.angle[336:537])) for each in others) > 10.0


def test_the_plate_tilts_and_the_beam_swings_as_the_file_says():
    sizes = said("stephenson_two_six_bar", r"by (\S+) degrees alone, .* by (\S+) degrees:")
    out = turn("stephenson_two_six_bar")
    swings = [np.ptp(np.degrees(link.angle)) for link in (out.plate, out.beam)]
    assert swings == pytest.approx(sizes, abs=0.05)


def test_the_coupling_rods_bear_what_the_file_says():
    (most,) = said("coupling_rods", r"up to (\S+) kN")
    out = turn("coupling_rods")
    forces = [np.hypot(pin.fx, pin.fy) for pin in (out.A, out.A9)]
    assert [np.max(force) / 1e3 for force in forces] == pytest.approx([most, most], abs=0.05)
    assert np.max(np.minimum(*forces)) > 0.7e3 * most > np.min(np.maximum(*forces)) * 0.9


@pytest.mark.parametrize(
    ("name", "pattern", "forward"),
    [
        ("whitworth_quick_return", r"over (\d+) degrees .* other (\d+)", lambda o: o.ram.C.vx > 0.0),
        ("crank_shaper", r"over (\d+) degrees .* other (\d+)", lambda o: o.ram.C.vx < 0.0),
        ("stephenson_six_bar", r"in (\d+) degrees .* in (\d+)", lambda o: o.output.w > 0.0),
        ("beam_pump_api", r"over (\d+) degrees .* other (\d+)", lambda o: o.beam.w > 0.0),
    ],
)
def test_the_ways_forth_and_back_last_as_the_file_says(name, pattern, forward):
    forth, back = said(name, pattern)
    assert 360.0 * np.mean(forward(turn(name))) == pytest.approx(forth, abs=0.6)
    assert forth + back == 360.0


def test_the_counterweight_halves_the_torque():
    most, least, balanced = said("pump_jack", r"up to (\d+) kN m .* gives (\d+) kN m .* same, (\d+) kN m")
    without = turn("pump_jack", 0.84, counterweight=0.0).tau
    assert (np.max(without), -np.min(without)) == pytest.approx((1e3 * most, 1e3 * least), rel=0.05)
    out = turn("pump_jack", 0.84)
    up, down = (np.max(out.tau[sign * out.beam.H.vy > 0.0]) for sign in (1.0, -1.0))
    assert up == pytest.approx(1e3 * balanced, rel=0.05) and down == pytest.approx(1e3 * balanced, rel=0.1)


def test_the_beam_pump_is_that_of_api_11e():
    """By the formulas of the standard, for any dimensions: place of the rod and torque factor over a turn."""
    rng, inch = np.random.default_rng(3), 0.0254
    (stroke,) = said("beam_pump_api", r"by (\S+) in over")
    sizes = {name: machine("beam_pump_api").by_name[name] / inch for name in "ACIKPR"}
    for factors in (np.ones(6), *rng.uniform(0.95, 1.05, (20, 6))):
        A, C, I, K, P, R = values = factors * list(sizes.values())
        pump = machine("beam_pump_api").replace(dict(zip(sizes, inch * values, strict=True)) | {"g": 0.0})
        theta = TURN - np.arcsin(I / K)
        J = np.sqrt(K**2 + R**2 - 2.0 * K * R * np.cos(theta))
        beta = np.arccos((C**2 + P**2 - J**2) / (2.0 * C * P))
        psi = np.arccos((C**2 + J**2 - P**2) / (2.0 * C * J)) - np.arcsin(R * np.sin(theta) / J)
        lowest, highest = (np.arccos((C**2 + K**2 - (P + s * R) ** 2) / (2.0 * C * K)) for s in (1.0, -1.0))
        torque_factor = A * R / C * np.sin(beta + psi - theta) / np.sin(beta)
        feed = {"rod_load": 1.0, "fluid_load": 0.0, "w": 0.0, "a": 0.0}
        out = pump.evaluate({"phi": TURN, **feed})
        # the rod hangs from an arc: its way is A times the angle of the beam
        assert np.ptp(out["beam.angle"] + psi) < 1e-12
        assert np.ptp(out["beam.angle"]) == pytest.approx(lowest - highest, rel=1e-4)
        assert out["tau"] / inch == pytest.approx(torque_factor, rel=1e-12, abs=1e-11)
        if np.all(factors == 1.0):
            assert A * (lowest - highest) == pytest.approx(stroke, abs=0.05)


def reactions_of_organ(psi, hand, loads, mu=0.6, zeta=0.5):
    """X, Y_A2 and Y_A1 of an organ at rest by the moments about B and A1, (24) of paper 000 with more loads; in l1.
    A load is its weight, its rod, and its share of the way from A1 or A2 to B. `hand` is 1 on the left.
    """
    z, lean = 2.0 * math.sqrt(1.0 - mu) * zeta, hand * psi
    a2 = complex(z + mu * math.sin(lean), mu * math.cos(lean))  # from A1, down
    # B is on both circles
    way, along = abs(a2), (1.0 + abs(a2) ** 2 - (1.0 - mu) ** 2) / (2.0 * abs(a2))
    b = a2 / way * complex(along, math.sqrt(1.0 - along**2))
    places = [(G, share * b if rod == "wall" else a2 + share * (b - a2), rod) for G, rod, share in loads]
    about_b = sum(G * (place - b).real for G, place, rod in places if rod == "web")
    about_a1 = sum(G * place.real for G, place, _ in places)
    # Y (x2 - xb) + X (y2 - yb) = M_B and Y x2 + X y2 = M_A1, with y down and Y up
    x, y = np.linalg.solve([[(a2 - b).imag, (a2 - b).real], [a2.imag, a2.real]], [about_b, about_a1])
    return x, y, sum(G for G, _, _ in places) - y


def test_weights_in_the_hinge_and_material_as_points_follow_paper_000():
    """By its equations of equilibrium, with a longer crank up to 12 deg of the rocker, and by its two-force rods."""
    first, second, before, after = said(
        "chain_unit_points", r"from (\S+) to (\S+) of .* from (\S+) to ([\d.]+)\."
    )
    rng, weight = np.random.default_rng(5), 54.0 * 9.81
    for in_hinge in (0.0, 0.4, 1.0):
        unit = machine("chain_unit_points").replace({"in_hinge": in_hinge, "r": 0.21})
        for filled in (0.0, 1.0):
            feed = {f"{s}_m{i}": filled * rng.uniform(0.0, 60.0) for s in SIDES for i in (1, 2, 3)}
            angles = np.linspace(0.0, 2.0 * np.pi, 25)
            out = unit.evaluate({"phi": angles, "w": 0.0, "a": 0.0, **feed})
            psi = out["rocker.angle"] + 0.5 * np.pi
            assert np.max(psi) > math.radians(12.0) and np.min(psi) < -math.radians(11.0)
            for side, hand in (("left", 1.0), ("right", -1.0)):
                m1, m2, m3 = (feed[f"{side}_m{i}"] / 54.0 for i in (1, 2, 3))
                rods = [(1.0 - in_hinge, "wall", 0.5), (0.4 * (1.0 - in_hinge), "web", 0.5)]
                hinge = [(1.4 * in_hinge, "wall", 1.0)]
                material = [(m1, "wall", 0.75), (m2, "web", 0.75), (m3, "web", 0.25)]
                loads = rods + hinge + material
                expected = np.array([reactions_of_organ(angle, hand, loads) for angle in psi]).T
                names = (f"A2_{side}_web.fx", f"A2_{side}_web.fy", f"A1_{side}.fy")
                computed = np.array([out[name] for name in names]) / weight * [[hand], [1.0], [1.0]]
                np.testing.assert_allclose(computed, expected, rtol=1e-9, atol=1e-11)
                np.testing.assert_allclose(out[f"A1_{side}.fx"], -out[f"A2_{side}_web.fx"], rtol=1e-9)
                if side == "left" and filled == 0.0 and in_hinge in (0.0, 1.0):
                    upright = np.array(reactions_of_organ(0.0, 1.0, loads)) / 1.4
                    pull, down = (first, before) if in_hinge == 0.0 else (second, after)
                    assert upright[:2] == pytest.approx([pull, down], abs=5e-4)
                if side == "left" and filled == 0.0 and in_hinge == 1.0:
                    theirs = paper000.hinge_loading(psi)
                    np.testing.assert_allclose(
                        computed / 1.4, [theirs.X, theirs.Y_A2, theirs.Y_A1], rtol=1e-9
                    )


def test_the_toggles_multiply_the_force():
    pitman, jaw, force, pin = said(
        "blake_jaw_crusher", r"by (\d+) mm, .* by (\d+) mm, and (\d+) kN .* (\d+) kN"
    )
    out = turn("blake_jaw_crusher", 0.1)
    assert np.ptp(out.pitman.T1.y) == pytest.approx(1e-3 * pitman, abs=5e-4)
    assert np.ptp(out.jaw.K.x) == pytest.approx(1e-3 * jaw, abs=5e-4)
    assert np.max(np.hypot(out.A.fx, out.A.fy)) == pytest.approx(1e3 * pin, rel=0.03)
    assert machine("blake_jaw_crusher").model.Inputs().crushing_force == 1e3 * force
    # the force resists: it acts while the jaw closes, and takes power over each part of the turn
    assert np.max(out.load_power) < 1e-9 * -np.min(out.load_power) + 1e-9


def test_the_blade_slices_and_the_plunger_follows_a_cosine():
    along, down, turned = said("edge_trimmer", r"by (\d+) mm along and (\d+) mm down, .* by (\S+) degrees")
    plate = turn("edge_trimmer").plate
    assert (np.ptp(plate.K.x), np.ptp(plate.K.y)) == pytest.approx((1e-3 * along, 1e-3 * down), abs=5e-4)
    assert np.degrees(np.ptp(plate.angle)) == pytest.approx(turned, abs=0.05)
    assert turn("scotch_yoke_pump").yoke.S.x == pytest.approx(0.06 * np.cos(TURN), abs=1e-15)


@pytest.mark.parametrize(("name", "link"), [("cylinder_lift", "lever"), ("tipper", "skip")])
def test_the_force_of_a_cylinder_is_as_the_file_says(name, link):
    *ends, angle = said(name, r"from (\S+) to (\S+) kN, while .* by (\d+) degrees")
    out = machine(name).outputs(way(name), 0.0)
    assert [np.min(out.tau), np.max(out.tau)] == pytest.approx(
        [1e3 * each for each in sorted(ends)], rel=0.02
    )
    assert np.degrees(np.ptp(getattr(out, link).angle)) == pytest.approx(angle, abs=0.5)


def test_the_hook_of_the_crane_moves_level():
    swing, along, rise = said("level_luffing_crane", r"by (\d+) degrees it goes (\S+) m, .* by (\d+) mm")
    low, high = machine("level_luffing_crane").model.span
    out = machine("level_luffing_crane").outputs(np.linspace(low, high, 2001))
    hook = out.fly_jib.P
    assert (np.ptp(hook.x), np.ptp(hook.y)) == pytest.approx((along, 1e-3 * rise), rel=0.01)
    assert np.degrees(high - low) == pytest.approx(swing)


def test_the_clamp_presses_at_its_dead_centre_and_holds_itself():
    """The lever and the link lie on one line there, so that no force of the workpiece turns the lever; on the stop it
    presses the lever against it. The largest torque is that of a slow lever."""
    dead, force, most, further = said(
        "toggle_clamp", r"at (\d+) degrees: .* (\S+) kN, .* needs (\S+) N m .* stop, (\d+) degrees"
    )
    clamp, without = (
        machine("toggle_clamp"),
        machine("toggle_clamp").replace({"pins.friction": 0.0, "g": 0.0}),
    )
    low, high = clamp.model.span
    q, at = np.linspace(low, high, 9401), math.radians(dead)
    assert np.degrees(high) == pytest.approx(dead + further)
    out = clamp.outputs(q, 0.2)
    assert np.max(out.tau) == pytest.approx(most, abs=0.05)
    assert -clamp.outputs(at, 1.0).load_power == pytest.approx(0.0, abs=1e-9)
    arm = without.outputs(at)
    # O2-T is 95 mm long across the force, O2-B 32 mm
    assert abs(arm.O2.fy) == pytest.approx(1e3 * force * (1.0 + 95.0 / 32.0), rel=1e-9)
    assert without.outputs(at).tau == pytest.approx(0.0, abs=1e-8)
    assert without.outputs(high).tau < -5.0 and without.outputs(high - math.radians(7.0)).tau > 5.0
    # by virtual work: the torque stores energy in the pad, whose force begins over 0.1 mm
    pad = without.outputs(q).arm.T.y
    pressed = np.maximum(0.002 + np.min(pad) - pad, 0.0)
    work = np.sum(0.5 * np.diff(q) * (without.outputs(q).tau[1:] + without.outputs(q).tau[:-1]))
    assert work == pytest.approx(0.5 * 0.6e6 * pressed[-1] ** 2, rel=5e-4)


def test_the_stops_of_the_crane_give_way_to_its_weight_by_a_hundredth_of_its_range():
    """Its masses stand at their radius of gyration; the hook holds the jib up with far less."""
    crane = machine("level_luffing_crane")
    low, high = crane.model.span
    feed = crane.model.feed_layout.by_name(crane.model.Feed())
    inertia = np.max(crane.evaluate({"phi": np.linspace(low, high, 2001), **feed})["J"])
    weight = 9.81 * math.sqrt(inertia * (900.0 + 260.0 + 180.0 + 2000.0))
    stops = crane.model.end_stops
    assert 0.5 * stops.stiffness * (0.01 * (high - low)) ** 2 == pytest.approx(
        weight * (high - low), rel=1e-3
    )
    assert stops.damping == pytest.approx(math.sqrt(stops.stiffness * inertia), rel=1e-3)


def test_a_machine_without_inputs_has_an_empty_feed_in_a_result():
    """Of which as_data made no table, so that a study of it ended in an error."""
    assert not machine("andrews_squeezer").model.feed_layout.names
    assert as_data(machine("andrews_squeezer").model.Feed()) == {}


def test_a_place_of_0_has_no_rounding_in_the_tables():
    """The arm of the clamp comes to 0 deg where it clamps; the left pins of the scissor lift stay at x = 0."""
    clamp, lift = (linkage_findings(machine(name), 0.1) for name in ("toggle_clamp", "scissor_lift"))
    assert clamp.swings["arm"].least == 0.0 and clamp.limits["arm.angle"][0] == 0.0
    assert [lift.limits[f"{point}.x"] for point in ("cross_arm.L", "platform.V")] == [(0.0, 0.0)] * 2
    assert lift.limits["platform.V.y"] == pytest.approx((0.4624, 2.1380), abs=1e-4)


def test_the_clamp_stays_shut_without_a_hand():
    """From beyond its dead centre it moves onto its stop and rests there; from before it, it opens."""
    direct = read_linkage(FOLDER / "toggle_clamp.toml").direct()
    u, layout, high = direct.Inputs(tau=0.0), direct.state_layout, direct.inverse.span[1]
    angles = []
    for start in (92.0, 86.0):
        p = direct.check(replace(direct.Parameters(), phi_start=math.radians(start)))

        def rates(t, x, p=p):
            return direct.derivatives(MATH, p, u, layout.instance([*x]))

        begin = layout.values(direct.start(MATH, p, u))
        angles.append(solve_ivp(rates, (0.0, 1.0), begin, method="LSODA", rtol=1e-6, atol=1e-6).y[0])
    shut, opened = angles
    assert np.min(shut) > math.radians(91.9) and shut[-1] == pytest.approx(high, abs=2e-3)
    assert np.min(opened) < math.radians(70.0)


def test_the_cylinder_carries_the_scissor_lift_by_virtual_work():
    """The arms turn by one angle: each place follows from it in closed form."""
    *ends, high, low, most = said("scissor_lift", r"from (\d+) to (\d+) kN, (\S+) to (\S+) times .* (\d+) kN")
    rise, stroke = said("scissor_lift", r"by (\S+) m with a stroke of (\S+) m")
    lift = machine("scissor_lift")
    q = way("scissor_lift")
    span = np.array(lift.model.span)
    assert np.ptp(span) == pytest.approx(stroke)
    assert lift.outputs(span).tau == pytest.approx([1e3 * each for each in ends], rel=0.01)
    assert lift.outputs(span).tau == pytest.approx([high * 1180.0 * 9.81, low * 1180.0 * 9.81], rel=0.01)
    assert np.ptp(lift.outputs(span).platform.G.y) == pytest.approx(rise, abs=0.005)
    pin = lift.outputs(span, 0.03).M
    assert np.max(np.hypot(pin.fx, pin.fy)) == pytest.approx(1e3 * most, rel=0.01)
    out = lift.replace({"pins.friction": 0.0, "guides.friction": 0.0}).outputs(q)
    # pins of the cylinder at P and at 1 m on the arm: their distance is the way of the piston and 0.42 m
    arm = np.exp(1j * np.arcsin(out.platform.V.y / 3.2))
    cylinder = arm - (0.6 - 0.2j)
    assert np.abs(cylinder) == pytest.approx(q + 0.42, rel=1e-12)
    longer = (cylinder.conj() * 1j * arm).real / np.abs(cylinder)
    slope = (cylinder.conj() * 1j * arm).imag / np.abs(cylinder) ** 2
    # each per angle of the arms: four arms, platform with payload and upper roller, barrel and rod
    arms = 1.6 * arm.real * (34.0 * 0.5 + 30.0 * (0.5 + 1.5 + 1.5) + 2.0 * (180.0 + 1000.0 + 3.0))
    barrel = 0.2 * cylinder.real / np.abs(cylinder) * slope
    force = 9.81 * (arms + 22.0 * barrel + 10.0 * (arm.real - barrel)) / longer
    assert out.tau == pytest.approx(force, rel=1e-12)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", KINDS)
def test_each_file_has_a_drawing_with_the_names_of_its_links(name):
    m = machine(name)
    traced = linkage.paths(m.state(m.inputs({"phi": way(name)})).m)
    assert all(np.all(np.isfinite(axis)) for path in traced.values() for axis in path)
    picture = drawing(m, float(way(name)[len(way(name)) // 6]))
    words = re.findall(r">([^<]+)</text>", picture)
    for link, entry in m.model.described_by.structure.links.items():
        if len(entry.points) > 1:
            assert any(
                each.startswith(link.replace("left_", "").replace("right_", "").replace("_", " "))
                for each in words
            ), link


def test_the_pump_is_the_textbook_s_scotch_yoke():
    """Without friction: the plunger's way is r cos q, so that each term of the torque is closed."""
    r, w, a, area = 0.06, 4.0, 7.0, 0.25 * np.pi * 0.08**2
    out = machine("scotch_yoke_pump").replace({"guides.friction": 0.0}).outputs(TURN, w, a)
    sine, cosine = np.sin(TURN), np.cos(TURN)
    inertia = 0.02 + 7.0 * 0.01**2 + 1.5 * r**2 + 16.0 * (r * sine) ** 2
    speed = -r * sine * w
    rise = np.clip(speed / 0.04 + 0.5, 0.0, 1.0)
    force = 1.2e6 * area * (6.0 * rise**5 - 15.0 * rise**4 + 10.0 * rise**3)
    weight = 9.81 * (7.0 * 0.01 + 1.5 * r) * cosine
    torque = inertia * a + 16.0 * r**2 * sine * cosine * w**2 + weight - force * r * sine
    assert out.J == pytest.approx(inertia, rel=1e-13)
    assert out.tau == pytest.approx(torque, rel=1e-12, abs=1e-10)


def test_the_page_shows_each_file_with_its_words():
    page = (FOLDER.parents[1] / "docs" / "linkages.md").read_text("utf-8")
    for file in FILES:
        words = (
            file.read_text("utf-8").partition("title =")[0].removeprefix("# ").replace("\n# ", " ").strip()
        )
        assert f"| **`{file.name}`** {words} | ![" in page and f"](linkages/{file.stem}.svg)" in page, (
            file.stem
        )


@pytest.mark.parametrize("name", KINDS)
def test_each_file_does_the_work_of_its_kind(name):
    """Its loads take power in the mean over a turn, or over the way of a cylinder, of some size against their
    largest; a force that is on in both directions takes none. The packaged machines begin empty. The squeezer has
    nothing but a spring, which gives back what it took."""
    processing = {"left_processing_force": 10.0}
    begun = {
        "chain_unit": processing,
        "chain_unit_points": processing,
        "knife_drive": {"cut_force": 3000.0},
    }
    m, q = machine(name), way(name)
    model = m.model
    feed = model.feed_layout.by_name(model.Feed()) | begun.get(name, {})
    out = m.evaluate({"phi": q, "w": 0.05 if model.slides else 1.0, **feed})
    # a tipper lifts a mass, which is its load
    lifted = np.gradient(out["potential_energy"], q) * out["w0"]
    taken = -out["load_power"] if np.any(out["load_power"]) else lifted
    if name == "andrews_squeezer":
        assert np.ptp(out["potential_energy"]) > 0.5 > 1e12 * abs(np.mean(out["power"]))
        return
    if name == "valve_cam":
        # the spring gives back what it takes, and friction alone is left
        assert np.ptp(out["potential_energy"]) > 2.0 > 1e5 * abs(np.mean(taken))
        assert np.mean(out["power"]) == pytest.approx(np.mean(out["dissipated_power"]), rel=1e-3)
        return
    assert np.mean(taken) > 0.02 * np.max(np.abs(taken)) > 0.0
    # the driver gives it; what is over goes into friction and the lift of the parts
    assert np.mean(out["power"]) >= np.mean(taken) * (1.0 - 1e-6)


def test_the_press_works_at_lower_dead_centre_for_each_crank():
    """20 kN over the last 10 mm are 200 J in each turn, but for the last bit of the way, where the speed is less
    than that of the step; the ram is at lower dead centre where crank and rod are in one line."""
    fine = np.arange(7200) * np.pi / 3600.0
    for r in (0.06, 0.08, 0.11):
        m = machine("slider_crank_press").replace({"r": r})
        bottom = -np.sqrt((r + 0.36) ** 2 - 0.025**2) - 0.12
        out = m.outputs(fine, w=60.0)
        on = -out.load_power > 1e-6 * np.max(-out.load_power)
        height = out.ram.T.y - bottom
        assert np.max(height[on]) == pytest.approx(0.0105, abs=1e-4) and np.all(out.ram.C.vy[on] < 0.01)
        assert np.mean(-out.load_power) * 2.0 * np.pi / 60.0 == pytest.approx(200.0, rel=2e-4)


def test_the_foot_returns_higher():
    (lift,) = said("watt_six_bar", r"returns (\d+) mm higher")
    foot = turn("watt_six_bar").leg.F
    assert np.ptp(foot.y) == pytest.approx(1e-3 * lift, abs=6e-4)
    low = foot.y < np.min(foot.y) + 0.3 * np.ptp(foot.y)
    assert np.ptp(foot.x[low & (foot.vx < 0.0)]) > 0.7 * np.ptp(foot.x)


# the packaged machines as files

SIDES = ("left", "right")
CHAIN_PARAMETERS = (
    {each: each for each in "r l h c hy e l1 l2 z g ratio web_share rod_inertia".split()}
    | {f"{rod}.m": f"{rod}.mass" for rod in ("crank", "coupler", "rocker")}
    | {f"{rod}.s": f"{rod}_centroid" for rod in ("crank", "coupler", "rocker")}
    | {f"{rod}.I": f"{rod}.inertia" for rod in ("crank", "coupler", "rocker")}
    | {f"{s}.{rod}_mass": f"{s}_{rod}_mass" for s in SIDES for rod in ("wall", "web")}
    | {f"pin.{each}": f"pins.{each}" for each in ("friction", "diameter", "w_smooth")}
    | {"joint_damping": "pins.damping", "processing.v_smooth": "v_smooth"}
)
"""The file's name of each parameter of `ChamberForces`."""
CHAIN_INPUTS = {f"{s}.{each}": f"{s}_{each}" for s in SIDES for each in ("material_mass", "processing_force")}
PORT = (
    "tau tau_bias J phi0 w0 dJ_dphi tau_bias_dphi tau_bias_dw power kinetic_energy potential_energy "
    "dissipated_power"
).split()  # fmt: skip
CHAIN_FORCES = {
    "crank_bearing": ("O1", 1.0), "crank_pin": ("A", 1.0), "coupler_pin": ("Bd", -1.0), "pivot": ("C", 1.0),
    **{f"{s}.support": (f"A1_{s}", 1.0) for s in SIDES},
    **{f"{s}.rocker_joint": (f"A2_{s}_web", 1.0) for s in SIDES},
    **{f"{s}.hinge": (f"B_{s}", -1.0) for s in SIDES},
}  # fmt: skip
"""Joint of each reaction, and its sign."""
KNIFE_PARAMETERS = (
    {each: each for each in "r ab bo2 bc o3d o4e g ratio".split()}
    | {f"{rod}.m": f"{rod}.mass" for rod in "crank coupler rocker leg_b leg_3 leg_4 knife".split()}
    | {f"{rod}.I": f"{rod}.inertia" for rod in "crank coupler rocker leg_b leg_3 leg_4 knife".split()}
    | {f"pin.{each}": f"pins.{each}" for each in ("friction", "diameter", "w_smooth")}
    | {"joint_damping": "pins.damping", "stack.v_smooth": "v_smooth", "stack.edge": "edge"}
    | {"stack.top": "stack_top", "stack.table": "stack_table"}
)
KNIFE_INPUTS = {"cut_force": "cut_force", "blade.fx": "blade_fx", "blade.fy": "blade_fy"}
KNIFE_FORCES = {
    "crank_bearing": ("O1", 1.0), "crank_pin": ("A", 1.0), "coupler_pin": ("coupler_pin", 1.0),
    "leg_pin": ("leg_pin", 1.0), "rocker_bearing": ("O2", 1.0), "c_pin": ("C", -1.0), "d_pin": ("D", -1.0),
    "e_pin": ("E", -1.0), "o3_bearing": ("O3", 1.0), "o4_bearing": ("O4", 1.0),
}  # fmt: skip


def both(name, packaged, parameters, inputs, forces, rng):
    """The outputs of the file and of the packaged machine that are the same, by the names of the latter, at random
    parameters and a random state."""
    of_packaged = Machine(packaged)
    scale = {"pins.friction": (0.0, 0.3), "pins.damping": (0.0, 2.0)}
    values = {}
    for theirs, ours in parameters.items():
        low, high = scale.get(ours, (0.97, 1.03))
        value = of_packaged.by_name[theirs]
        values[theirs] = rng.uniform(low, high) * (1.0 if ours in scale else value)
    values["ratio"] = rng.uniform(1.0, 30.0)
    if "web_share" in values:
        values["web_share"] = rng.uniform(0.0, 1.0)
    state = {"phi": rng.uniform(0.0, 200.0), "w": rng.uniform(-200.0, 200.0), "a": rng.uniform(-300.0, 300.0)}
    feed = {each: rng.uniform(0.0, 3000.0) for each in inputs}
    theirs = of_packaged.replace(values).evaluate(state | feed)
    ours = machine(name).replace({parameters[key]: value for key, value in values.items()})
    found = ours.evaluate(state | {inputs[key]: value for key, value in feed.items()})
    for each in PORT:
        yield each, found[each], theirs[each]
    for their, (our, sign) in forces.items():
        for axis in ("fx", "fy"):
            yield f"{their}.{axis}", sign * found[f"{our}.{axis}"], theirs[f"{their}.{axis}"]
    if packaged is ChamberForces:
        yield "rocker.psi", 0.5 * np.pi + found["rocker.angle"], theirs["rocker.psi"]
        for each in ("w", "a"):
            yield f"rocker.{each}", found[f"rocker.{each}"], theirs[f"rocker.{each}"]
    else:
        yield "blade.tilt", found["knife.angle"], theirs["blade.tilt"]
        for each in ("x", "y", "vx", "vy"):
            yield f"blade.{each}", found[f"knife.blade.{each}"], theirs[f"blade.{each}"]


@pytest.mark.parametrize(
    "case",
    [
        ("chain_unit", ChamberForces, CHAIN_PARAMETERS, CHAIN_INPUTS, CHAIN_FORCES),
        ("knife_drive", KnifeDrive, KNIFE_PARAMETERS, KNIFE_INPUTS, KNIFE_FORCES),
    ],
    ids=["chain_unit", "knife_drive"],
)
def test_a_packaged_machine_as_a_file_gives_its_numbers(case):
    rng, rows = np.random.default_rng(17), {}
    for _ in range(50):
        for name, ours, theirs in both(*case, rng):
            rows.setdefault(name, []).append((float(ours), float(theirs)))
    worst = {}
    for name, pairs in rows.items():
        ours, theirs = np.array(pairs).T
        # each number by its own size, and no nearer than the rounding of the sums that it is the difference of
        worst[name] = np.max(
            np.abs(ours - theirs) / np.maximum(np.abs(theirs), 1e-2 * np.max(np.abs(theirs)))
        )
    assert len(worst) > 30
    assert max(worst.values()) < 1e-12, max(worst.items(), key=lambda pair: pair[1])


@pytest.mark.parametrize(
    ("name", "packaged", "parameters", "inputs"),
    [
        ("chain_unit", ChamberForces, CHAIN_PARAMETERS, CHAIN_INPUTS),
        ("knife_drive", KnifeDrive, KNIFE_PARAMETERS, KNIFE_INPUTS),
    ],
)
def test_a_packaged_machine_as_a_file_has_its_start_values(name, packaged, parameters, inputs):
    theirs, ours = Machine(packaged).by_name, machine(name).by_name
    assert {each: theirs[each] for each in parameters} == pytest.approx(
        {their: ours[our] for their, our in parameters.items()}, rel=1e-15
    )
    feeds = packaged.input_layout.by_name(packaged.Inputs()), machine(name).model.input_layout
    own = feeds[1].by_name(machine(name).model.Inputs())
    assert {each: feeds[0][each] for each in inputs} == {their: own[our] for their, our in inputs.items()}


SIZED = """
[machine]
linkage = "{name}.toml"
[run]
crank_speed = "{speed}"
[sizing]
poles_least = 4
poles_most = 4
candidates = 1
fluctuation = "10 %"
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "speed"),
    [
        ("blake_jaw_crusher", "250 rpm"),
        pytest.param("scotch_yoke_pump", "150 rpm", marks=pytest.mark.slow),
    ],
)
def test_a_study_finds_a_motor(name, speed, tmp_path):
    study = run_study(parse(SIZED.format(name=name, speed=speed), str(FOLDER / "study.toml")), tmp_path)
    assert study.findings.failure is None
    best = study.findings.by_analysis["sizing"].best
    assert study.findings.by_analysis["sizing"].chosen_candidate is best and best.fits
    # the motor carries the cycle of the linkage, and not with twice the power that it needs
    angular_speed = study.setup.config.run.crank_speed
    mean = float(np.mean(turn(name, angular_speed).power))
    assert 0.7 * mean < best.motor.nameplate.power < 3.0 * mean
    # the torque of the run is that of the linkage at its own motion
    steady = study.runs.steady
    torque = turn(name, angular_speed).tau
    crank = steady["machine.tau"].values * study.setup.drive.ratio
    assert np.max(np.abs(crank)) == pytest.approx(np.max(np.abs(torque)), rel=0.15)
