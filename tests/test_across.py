"""Shares across the width of a chain unit, and pins that differ, against own statics in space and own losses."""

from __future__ import annotations

import math
import pickle
import tomllib
from pathlib import Path

import fmpy
import numpy as np
import pytest

from chainunit import ChainUnitMachine, InputError, SideLoads, Study
from chainunit.fmu.backends import export
from chainunit.machines.api import ChainUnitOfChains, machine_of
from chainunit.machines.chain_unit import ChamberForces, PlacedLoads
from chainunit.machines.knife_drive import KnifeDrive
from chainunit.machines.linkages.file import linkage_from
from chainunit.machines.machine import Machine
from chainunit.report.drawing import drawing
from chainunit.report.reference import keys_of
from chainunit.study.config import parse
from chainunit.study.package import model_and_start

LOADS = {
    "left": PlacedLoads(material_mass=42.0, processing_force=700.0, across=0.35, force_across=-0.9),
    "right": PlacedLoads(material_mass=25.0, processing_force=130.0, across=-0.6, force_across=0.2),
}
WIDE = {"width": 1.4, "web_share": 0.7, "left.web_mass": 30.0}
MOTION = {"phi": 0.8, "w": 3.1, "a": 0.7}


def arm(length, angle):
    """A point on a rod from its pin, by the angle from the downward vertical."""
    return length * np.array([math.sin(angle), -math.cos(angle)])


def acceleration(place, w, a):
    return np.array([-place[1], place[0]]) * a - place * w * w


def cross(r, f):
    return r[0] * f[1] - r[1] * f[0]


def strip(p, out, side, on_wall, on_web, at_b=(0.0, 0.0)):
    """The force of the rocker on the web of a strip of an organ: six equations of Newton and Euler."""
    hand = 1.0 if side == "left" else -1.0
    organ, gravity = getattr(out, side), np.array([0.0, -p.g])
    wall, web = ({n: float(x) for n, x in vars(m).items()} for m in (organ.wall, organ.web))
    psi, w, a = (float(x) for x in (out.rocker.psi, out.rocker.w, out.rocker.a))
    a1, a2 = np.array([-hand * p.z, 0.0]), arm(p.e, psi)
    b = a1 + arm(p.l1, wall["angle"])
    assert b == pytest.approx(a2 + arm(p.l2, web["angle"]), abs=1e-9)
    matrix, right = np.zeros((6, 6)), np.zeros(6)
    rods = ((0, a1, 1.0, on_wall, wall, p.l1), (3, a2, -1.0, on_web, web, p.l2))
    for row, pin, sign, mass, rod, length in rods:
        middle = arm(0.5 * length, rod["angle"])
        start = acceleration(a2, w, a) if row else np.zeros(2)
        force = mass * (start + acceleration(middle, rod["w"], rod["a"]) - gravity)
        moment = cross(middle, force) + mass * length**2 / 12.0 * rod["a"]
        if row:
            force, moment = force - np.array(at_b), moment - cross(b - pin, at_b)
        # unknowns: A1 on the wall, B on the wall, A2 on the web
        first = 4 if row else 0
        matrix[row, first] = matrix[row + 1, first + 1] = 1.0
        matrix[row, 2] = matrix[row + 1, 3] = sign
        matrix[row + 2, 2:4] = sign * np.array([-(b - pin)[1], (b - pin)[0]])
        right[row : row + 2], right[row + 2] = force, moment
    return np.linalg.solve(matrix, right)[4:]


def speed_of_b(p, out, side):
    wall = getattr(out, side).wall
    r = arm(p.l1, float(wall.angle))
    return np.array([-r[1], r[0]]) * float(wall.w)


def parts(p, out, loads):
    """Forces of the rockers on the webs, each with its place across the width."""
    for side, load in loads.items():
        masses = getattr(p, side)
        yield side, strip(p, out, side, masses.wall_mass, masses.web_mass), 0.0
        on_web = p.web_share * load.material_mass
        yield side, strip(p, out, side, load.material_mass - on_web, on_web), load.across
        v = speed_of_b(p, out, side)
        brake = -load.processing_force * v / math.sqrt(v @ v + p.processing.v_smooth**2)
        yield side, strip(p, out, side, 0.0, 0.0, brake), load.force_across


def vector(f):
    return np.array([float(f.fx), float(f.fy)])


def test_the_shares_are_those_of_own_statics_in_space():
    """Six equations of the pair of rockers as one body: the unknowns are both pivots, the thrust of one, and the
    force of the coupler across the rocker."""
    machine = ChainUnitMachine(WIDE)
    p, out = machine.p, machine.forces(**MOTION, **LOADS)
    psi, w, a = (float(x) for x in (out.rocker.psi, out.rocker.w, out.rocker.a))
    bd, middle, half = arm(p.h, psi), arm(p.rocker.s, psi), 0.5 * p.width
    along, across = arm(1.0, psi), np.array([math.cos(psi), math.sin(psi)])
    forces = [*parts(p, out, LOADS)]
    loads = [(np.array([*arm(p.e, psi), half * s]), np.array([*-f, 0.0])) for _, f, s in forces]
    loads.append((np.array([*middle, 0.0]), np.array([0.0, -p.rocker.m * p.g, 0.0])))
    loads.append((np.array([*bd, 0.0]), np.array([*along * float(out.rocker.coupler_normal), 0.0])))
    unknown = [((0.0, 0.0, z), axis) for z in (half, -half) for axis in np.eye(3)[:2]]
    unknown += [((0.0, 0.0, half), np.eye(3)[2]), ((*bd, 0.0), np.array([*across, 0.0]))]
    matrix = np.array([[*axis, *np.cross(place, axis)] for place, axis in unknown]).T
    inertia = p.rocker.m * acceleration(middle, w, a)
    spin = cross(middle, inertia) + p.rocker.I * a
    right = np.array([*inertia, 0.0, 0.0, 0.0, spin])
    for place, f in loads:
        right -= [*f, *np.cross(place, f)]
    fx, fy, bx, by, thrust, coupler = np.linalg.solve(matrix, right)
    close = {"rtol": 1e-10, "atol": 1e-8}
    np.testing.assert_allclose(vector(out.front.pivot), (fx, fy), **close)
    np.testing.assert_allclose(vector(out.back.pivot), (bx, by), **close)
    np.testing.assert_allclose((thrust, coupler), (0.0, float(out.rocker.coupler_tangential)), **close)
    for row, sign in (("front", 1.0), ("back", -1.0)):
        share = getattr(out, row)
        for side in LOADS:
            pin = sum(0.5 * (1.0 + sign * s) * f for of, f, s in forces if of == side)
            np.testing.assert_allclose(vector(getattr(share, f"{side}_pin")), pin, **close)
        torque = sum(0.5 * (1.0 + sign * s) * p.e * across @ f for _, f, s in forces)
        np.testing.assert_allclose(float(share.tau), torque, **close)
    # one rocker alone: it has half of the coupler's force and of its own inertia, and the torsion of the bar
    torsion = float(out.front.tau) + 0.5 * (spin + p.rocker.m * p.g * middle[0] - p.h * coupler)
    np.testing.assert_allclose(float(out.bar.torsion), torsion, **close)
    # the corner with the lump carries much more than half
    assert np.linalg.norm((bx, by)) > 1.2 * np.linalg.norm((fx, fy))


def test_in_the_middle_all_numbers_are_as_without_width():
    middle = {side: SideLoads(material_mass=x.material_mass) for side, x in LOADS.items()}
    rest = {name: x for name, x in WIDE.items() if name != "width"}
    one, two = (ChainUnitMachine(x).forces(**MOTION, **middle) for x in (rest, WIDE))
    for name in ("tau", "margin", "kinetic_energy"):
        assert getattr(one, name) == getattr(two, name)
    assert vector(one.pivot).tolist() == vector(two.pivot).tolist()
    for row in (two.front, two.back):
        np.testing.assert_allclose(vector(row.pivot), 0.5 * vector(one.pivot), rtol=1e-14)
    assert float(two.bar.torsion) == 0.0
    assert not hasattr(one, "front")


def bending_of(p, forces, halves, x):
    """The moment at a place of a beam on two supports, of strips of loads, each cut into 4000 point loads."""
    moment = np.zeros(2)
    for (f, s), half in zip(forces, halves, strict=True):
        for place in s + half * (np.arange(4000) + 0.5 - 2000) / 2000 if half else [s]:
            low, high = min(place, x), max(place, x)
            moment += f * (0.25 * p.width * (1.0 + low) * (1.0 - high)) / (4000 if half else 1)
    return np.linalg.norm(moment)


@pytest.mark.parametrize(
    ("load", "half"),
    [({"across": 0.4}, 0.6), ({"force_across": -0.5}, 0.0), ({"across": 1.0}, 0.0), ({}, 1.0)],
)
def test_the_bar_bends_as_a_beam_under_a_single_load(load, half):
    massless = {f"{side}.{part}_mass": 0.0 for side in LOADS for part in ("wall", "web")}
    machine = ChainUnitMachine({"width": 1.4, "bar.diameter": 0.06, "bar.bore": 0.04, **massless})
    force = "force_across" in load
    left = PlacedLoads(material_mass=0.0 if force else 50.0, processing_force=900.0 if force else 0.0, **load)
    p, out = machine.p, machine.forces(**MOTION, left=left)
    f, s = vector(out.left.rocker_joint), next(iter(load.values()), 0.0)
    places = np.linspace(-1.0, 1.0, 401)
    largest = max(bending_of(p, [(f, s)], [half], x) for x in (s * abs(s) if half else s,))
    dense = max(bending_of(p, [(f, s)], [half], x) for x in places[::20])
    assert float(out.bar.bending) == pytest.approx(largest, rel=1e-6, abs=1e-9)
    assert dense <= float(out.bar.bending) * (1.0 + 1e-6) + 1e-9
    modulus = math.pi / 32.0 * (0.06**4 - 0.04**4) / 0.06
    wanted = math.hypot(float(out.bar.bending), math.sqrt(0.75) * float(out.bar.torsion)) / modulus
    assert float(out.bar.stress) == pytest.approx(wanted, rel=1e-9)


def test_a_bar_without_width_and_a_place_without_width_are_refused():
    with pytest.raises(InputError, match="give width, too"):
        ChainUnitMachine({"bar.diameter": 0.1})
    with pytest.raises(InputError, match=r"bar\.bore"):
        ChainUnitMachine({"width": 1.0, "bar.diameter": 0.1, "bar.bore": 0.1})
    with pytest.raises(InputError, match=r"left\.across"):
        ChainUnitMachine().forces(0.3, left=PlacedLoads(across=0.5))


def test_a_machine_with_width_goes_to_another_process_and_is_shown_by_the_call_that_makes_it():
    machine = ChainUnitMachine({"width": 1.0, "bar.diameter": 0.08})
    assert pickle.loads(pickle.dumps(machine)).model is machine.model
    assert eval(repr(machine)).by_name == machine.by_name
    assert ChainUnitMachine().replace(width=1.0).model.layers == machine.model.layers


EXAMPLES = Path(__file__).parents[1] / "examples" / "linkages"
SEAT, ROLLING = {"friction": 0.15, "diameter": 0.09, "damping": 0.4}, {"friction": 0.0015}
PHI, W = np.linspace(0.1, 6.2, 25), 3.2
LAWS = {"O1": ROLLING, "Bd": SEAT, "A2_left_web": SEAT, "B_right": ROLLING, "A1_right": {"damping": 2.0}}
KNIFE_LAWS = {
    "O1": ROLLING | {"diameter": 0.08},
    "coupler_pin": SEAT,
    "leg_pin": {"friction": 0.1},
    "O3": SEAT,
}


def differing(laws):
    return {f"pins.{pin}.{name}": x for pin, law in laws.items() for name, x in law.items()}


def as_file(name, **tables):
    data = tomllib.loads((EXAMPLES / name).read_text("utf-8"))
    data |= {table: data.get(table, {}) | entries for table, entries in tables.items()}
    return Machine(linkage_from(data, "machine")[0])


def test_pins_that_differ_take_the_power_of_their_laws():
    """By the reactions, and by the relative speeds from the motion of rods and rocker: without the pins of the crank,
    whose speeds are not among the outputs."""
    laws = {pin: law for pin, law in LAWS.items() if pin not in ("O1", "Bd")}
    loads = {side: SideLoads(material_mass=40.0, processing_force=100.0) for side in ("left", "right")}
    one, two = (ChainUnitMachine(x).forces(PHI, W, **loads) for x in ({}, differing(laws)))
    speeds = {
        "A2_left_web": (one.left.rocker_joint, one.left.web.w - one.rocker.w),
        "B_right": (one.right.hinge, one.right.wall.w - one.right.web.w),
        "A1_right": (one.right.support, one.right.wall.w),
    }

    def power(pin, friction=0.12, diameter=0.06, damping=0.0):
        force, slip = speeds[pin]
        size = np.hypot(force.fx, force.fy)
        return 0.5 * friction * diameter * size * slip**2 / np.sqrt(slip**2 + 0.02**2) + damping * slip**2

    change = sum(power(pin, **law) - power(pin) for pin, law in laws.items())
    np.testing.assert_allclose((two.tau - one.tau) * W, change, rtol=1e-10, atol=1e-9)
    np.testing.assert_allclose(two.dissipated_power - one.dissipated_power, change, rtol=1e-10, atol=1e-9)
    assert vector_of(two.pivot) == vector_of(one.pivot)


def vector_of(f):
    return f.fx.tolist(), f.fy.tolist()


@pytest.mark.parametrize(
    ("file", "machine", "laws"),
    [("chain_unit.toml", ChamberForces, LAWS), ("knife_drive.toml", KnifeDrive, KNIFE_LAWS)],
)
def test_a_linkage_file_with_the_same_pins_has_the_same_torque(file, machine, laws):
    own = machine_of(machine, differing(laws) | {"pin.friction": 0.12, "pin.diameter": 0.06})
    usual = {"friction": 0.12, "diameter": 0.06}
    other = as_file(file, pins=usual | laws)
    inputs = {"phi": PHI, "w": W}
    one, two = own.evaluate(inputs), other.evaluate(inputs)
    for name in NAMES:
        size = np.max(np.abs(one[name]))
        np.testing.assert_allclose(one[name], two[name], rtol=1e-9, atol=1e-10 * size)
    plain = machine_of(machine, {"pin.friction": 0.12, "pin.diameter": 0.06}).evaluate(inputs)
    assert np.max(np.abs(plain["tau"] - one["tau"])) > 0.01


NAMES = ["tau_bias", "tau", "tau_bias_dphi", "tau_bias_dw", "dissipated_power"]


def test_what_a_pin_leaves_out_is_as_that_of_all_pins():
    machine = ChainUnitMachine({"pin.diameter": 0.05, "joint_damping": 0.3, "pins.A.friction": 0.02})
    values = {name.removeprefix("pins.A."): x for name, x in machine.by_name.items() if "pins." in name}
    assert values == {"friction": 0.02, "diameter": 0.05, "w_smooth": 0.02, "damping": 0.3}
    further = machine.replace({"pins.Bd.friction": 0.3, "pin.friction": 0.2})
    assert further.by_name["pins.A.friction"] == 0.02 and further.by_name["pins.Bd.damping"] == 0.3
    with pytest.raises(
        InputError,
        match=r"pins\.B: is no pin of this machine; was .B_left. meant\?; its pins are O1, A, Bd, C, A2",
    ):
        ChainUnitMachine({"pins.B.friction": 0.1})


def test_chains_take_the_laws_of_the_pins_of_the_drive():
    machine = ChainUnitOfChains({"pins.O1.friction": 0.3}).simulated
    loads = machine.model.linkage(np, machine.p, machine.model.Inputs()).loads
    ((joint, law),) = loads["pins"].laws.items()
    assert joint == ("O1", "crank") and (law.friction, law.diameter) == (0.3, 0.06)
    with pytest.raises(
        InputError, match=r"pins\.B_left: is no pin of this machine.*its pins are O1, A, Bd, C$"
    ):
        _ = ChainUnitOfChains({"pins.B_left.friction": 0.3}).simulated


def test_a_study_names_pins_and_their_kinds():
    config = parse(
        '[machine.pins.O1]\nkind = "rolling"\n[machine.pins.A]\nkind = "plain"\ndiameter = "80 mm"\n'
    )
    values = config.machine.by_name
    assert values["pins.O1.friction"] == 0.0015 and values["pins.O1.diameter"] == values["pin.diameter"]
    assert values["pins.A.friction"] == values["pin.friction"] and values["pins.A.diameter"] == 0.08
    with pytest.raises(InputError, match=r'machine\.pins\.A\.kind: is "ball"; must be plain or rolling'):
        parse('[machine.pins.A]\nkind = "ball"\n')
    with pytest.raises(InputError, match=r"machine\.pins\.X: is no pin of this machine"):
        parse("[machine.pins.X]\nfriction = 0.1\n")


PLACED = """
[machine]
width = "1.2 m"
[feed]
left.across = 0.5
[[event]]
type = "jam"
side = "left"
force = "3 kN"
across = -1
[[event]]
type = "feed"
side = "right"
"""


def test_an_event_brings_the_place_of_its_load():
    """The force of the lump and that of the feed act at their common centre, and the feed that moves keeps its
    place."""
    config = parse(PLACED)
    assert config.feed.left.force_across == 0.5  # it follows the material
    normal = config.machine.model.feed_layout.by_name(config.feed)
    jam, feed = config.events.values()
    signals = jam.signals(normal, 2.0, {})
    peak = 2.0 + jam.p.rise + 0.5 * jam.p.duration
    force, place = (signals[f"left.{name}"](peak) for name in ("processing_force", "force_across"))
    usual = normal["left.processing_force"]
    assert force == usual + 3000.0 and force * place == pytest.approx(0.5 * usual - 3000.0)
    assert signals["left.force_across"](1.9) == signals["left.force_across"](9.0) == 0.5
    ends = feed.ends(normal)
    masses = normal["left.material_mass"], normal["right.material_mass"]
    assert ends["right.across"] == pytest.approx(0.5 * masses[0] / sum(masses))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            '[[event]]\ntype = "jam"\nside = "left"\nacross = 0.5\n',
            "across = 0.5: .* rockers that stand a width apart; give machine.width",
        ),
        ("[feed]\nleft.across = 0.5\n", r"feed\.left\.across: unknown key.*give machine\.width"),
        ('organ = "chain"\n[machine]\nwidth = "1 m"\n', r"machine\.width: is of organs with two bars"),
    ],
)
def test_a_place_needs_a_width_and_two_bars(text, words):
    with pytest.raises(InputError, match=words):
        parse(text)


def test_the_drawing_has_a_view_from_above():
    plain, wide = drawing(ChainUnitMachine()), drawing(ChainUnitMachine({"width": 1.2}))
    assert "from above, width 1200 mm" in wide and "front (1)" in wide
    assert "from above" not in plain


@pytest.mark.second
@pytest.mark.compiler
@pytest.mark.parametrize("backend", ["native", "python"])
def test_the_fmu_has_the_shares_and_pins_of_the_study(backend, tmp_path):
    text = PLACED.replace("[feed]", "bar.diameter = '60 mm'\npins.A.friction = 0.05\n[feed]")
    (tmp_path / "study.toml").write_text(text, "utf-8")
    config = Study.from_file(tmp_path / "study.toml").config
    model, start = model_and_start("ChamberForces", config)
    export(model, tmp_path / "wide.fmu", start, backend=backend)
    inputs = {"phi": 40.0, "w": 0.0, "left.force_across": -1.0, "left.processing_force": 500.0}
    names = ["tau", "front.pivot.fx", "back.pivot.fy", "back.left_pin.fx", "bar.stress", "bar.torsion"]
    rows = fmpy.simulate_fmu(
        tmp_path / "wide.fmu", start_values=inputs, stop_time=0.01, output_interval=0.01, output=names
    )
    machine, feed = config.machine, config.machine.model.feed_layout.by_name(config.feed)
    wanted = machine.evaluate(feed | inputs)
    for name in names:
        assert rows[name][0] == pytest.approx(float(wanted[name]), rel=1e-10, abs=1e-9)
    assert machine.by_name["pins.A.friction"] == start["pins.A.friction"] == 0.05


@pytest.mark.second
@pytest.mark.compiler
def test_a_study_shows_the_corner_that_a_lump_overloads(tmp_path):
    text = PLACED.replace("[feed]", "[machine.bar]\ndiameter = '40 mm'\nlimit = '50 MPa'\n[feed]")
    (tmp_path / "study.toml").write_text(text, "utf-8")
    study = Study.from_file(tmp_path / "study.toml").run().record
    jam, run = study.runs.answers["jam_left"], study.runs.series["jam_left"]
    assert jam.back_pivot_peak > 1.5 * jam.front_pivot_peak
    peak = float(np.max(np.hypot(run["machine.back.pivot.fx"], run["machine.back.pivot.fy"])))
    assert jam.back_pivot_peak == pytest.approx(peak)
    (remark,) = (remark for remark in study.findings.remarks if remark.code == "bar-overloaded")
    assert (
        remark.runs == ("jam_left",)
        and jam.bar_stress_peak > 5e7 > study.runs.answers["steady"].bar_stress_peak
    )


@pytest.mark.parametrize(
    ("text", "refusals"),
    [
        ("pins.A3.friction = 0.1", ["machine.pins.A3: is no pin of this machine"]),
        ("pins = 'rolling'", ['machine.pins = "rolling": must be a table of pins']),
        (
            "pins.A.frction = 0.1",
            ['machine.pins.A.frction: unknown key; was "friction" meant? a pin has friction'],
        ),
        (
            "pins.A = { kind = 'rolling', friction = 0.1 }",
            ["machine.pins.A.kind: is rolling, with the friction 0.0015"],
        ),
        (
            "pins = { A = { kind = 'soft' }, Q = {} }",
            ["machine.pins.A.kind: is", "machine.pins.Q: is no pin"],
        ),
        ("width = 1\nbar = 0.08", ["machine.bar = 0.08: must be a table"]),
        (
            "width = 1\nbar = { diameter = 0.08, bore = 0.09 }",
            ["machine: bar.bore = 0.09 m: the bar has no wall"],
        ),
        ("bar.diameter = 0.08", ["machine.bar: joins rockers that stand a width apart"]),
        (
            "width = 1\n[feed]\nleft = { across = 2 }",
            ["feed.left.across = 2: must be >= -1 and <= 1 (material"],
        ),
        ("[feed]\nleft = { across = 0.5 }", ["feed.left.across: unknown key"]),
    ],
)
def test_a_wrong_place_or_pin_is_refused_once(text, refusals):
    with pytest.raises(InputError) as refused:
        parse(f"[machine]\n{text}\n")
    lines = str(refused.value).splitlines()
    assert len(lines) == len(refusals)
    for line, refusal in zip(lines, refusals, strict=True):
        assert line.startswith(refusal) and ("give machine.width" in line) == (".across: unknown key" in line)


def test_an_empty_table_of_pins_changes_nothing():
    assert parse("[machine.pins]\n").machine.by_name == parse("").machine.by_name


def test_a_pin_has_no_kind_in_python():
    with pytest.raises(
        InputError, match=r"^pins\.O1\.kind: unknown key; .*a rolling one has friction = 0\.0015$"
    ):
        Machine(ChamberForces, {"pins.O1.kind": "rolling"})


def test_the_keys_of_one_pin_are_found():
    (table, *_) = keys_of("machine.pins.O1").opening
    assert [row.cells[0] for row in table.rows] == [
        f"pins.NAME.{key}" for key in ("friction", "diameter", "w_smooth", "damping", "kind")
    ]


def test_a_limit_of_0_has_no_digits_of_the_search():
    with pytest.raises(InputError, match=r", bar\.bore = 0\.09 m must be >= 0 m and <= 0\.07999 m$"):
        parse("[machine]\nwidth = 1\nbar = { diameter = 0.08, bore = 0.09 }\n")


def test_pins_of_organs_differ_with_two_bars_alone():
    text = "organ = 'chain'\n[machine.pins]\nA.friction = 0.1\nB_left.friction = 0.1\n"
    with pytest.raises(InputError, match=r"^machine\.pins\.B_left: is of organs with two bars"):
        parse(text)
