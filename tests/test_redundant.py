"""Plates on more legs than needed, against Newton-Euler equations of all links with Lagrange multipliers; the legs
yield (`multibody`, which shares no line with the package)."""

from __future__ import annotations

import math
from pathlib import Path

import fmpy
import numpy as np
import pytest
import redundant as texts
from javascript_hosts import node
from live_pages import in_node
from multibody import Multibody
from test_between_links import FRICTION

from chainunit import GeometryError, InputError
from chainunit.core.native.compilers import compiler
from chainunit.fmu.export import export as export_python
from chainunit.fmu.native.export import export
from chainunit.machines.linkages.file import description_of, linkage_from
from chainunit.machines.machine import Machine
from chainunit.reading.tables import toml
from chainunit.report.drawing import drawing
from chainunit.report.live.machine import of_linkage
from chainunit.study.linkage_turn import linkage_findings

COUPLING_RODS = Path(__file__).parents[1] / "examples" / "linkages" / "coupling_rods.toml"
TURNING = ["three cranks", "ellipsograph", "sieve", "twin press"]


def machine_of(name, more=""):
    return Machine(linkage_from(toml(texts.MACHINES[name] + more), "machine")[0])


def inputs(machine, seed):
    rng = np.random.default_rng(seed)
    low, high = machine.model.span
    values = {
        "phi": low + (high - low) * rng.uniform(0.05, 0.95),
        "w": rng.uniform(-3, 3),
        "a": rng.uniform(-15, 15),
    }
    return values | ({"drag": 30.0} if "drag" in machine.model.input_layout.names else {})


def deviations(text, springs, seed):
    """Torque and all reactions by name, of the program and by the equations of all links, and their size."""
    machine = Machine(linkage_from(toml(text), "machine")[0])
    other, values = Multibody(description_of(toml(text), "machine"), springs=springs), inputs(machine, seed)
    moved = np.array([[values[key]] for key in ("phi", "w", "a")])
    if len(other.drivers) > 1:  # turned against the first one by a gear
        moved = np.hstack([moved, -moved])
    out, want = machine.evaluate(values), other.solution(other.followed(moved[0]), *moved)
    if len(other.drivers) > 1:
        want["tau"] -= want.pop("right.tau")
    forces = [key for key in want if key.endswith((".fx", ".fy", ".normal", ".moment", "tau"))]
    assert len(forces) >= 2 * len(other.joints) + 1
    size = max(abs(want[key]) for key in forces)
    return out, want, forces, size


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("name", texts.MACHINES)
def test_a_machine_is_that_of_all_its_equations(name, seed):
    """Torque, all reactions, and all motion, to 1e-10 of the largest of a kind."""
    out, want, forces, size = deviations(texts.MACHINES[name], texts.SPRINGS[name], seed)
    for key in forces:
        assert out[key] == pytest.approx(want[key], abs=1e-10 * size), key
    for key in ({*want} & {*out}) - {*forces}:
        if not key.endswith(".angle"):
            assert out[key] == pytest.approx(want[key], rel=1e-9, abs=1e-9), key


@pytest.mark.parametrize("seed", range(6))
def test_random_platforms(seed):
    """On 2 to 5 parallel cranks besides the driver, of any place and stiffness."""
    rng = np.random.default_rng(seed)
    count, head, body = int(rng.integers(2, 6)), "[ground]\nO = [0, 0]\n", ""
    r, pins, springs = rng.uniform(0.05, 0.4), "", {}
    for k in range(count):
        x, y, stiffness = *rng.uniform(-1.0, 1.0, 2), 10.0 ** rng.uniform(5, 8)
        head += f"P{k} = [{x}, {y}]\n"
        pins += f", Q{k} = [{x}, {y}]"
        body += f"[links.rod{k}]\npoints = {{ P{k} = [0, 0], Q{k} = [{r}, 0] }}\nmass = {rng.uniform(0, 5)}\n"
        body += f"centroid = [{0.4 * r}, {0.1 * r}]\nstiffness = {stiffness}\n"
        springs[f"Q{k}"] = stiffness, (f"rod{k}", f"P{k}", f"Q{k}")
    text = (
        f'{head}[driver]\nlink = "crank"\n[links.crank]\npoints = {{ O = [0, 0], A = [{r}, 0] }}\n'
        f"[links.plate]\npoints = {{ A = [0, 0], T = [0.3, -0.2]{pins} }}\nmass = 20\ninertia = 2\n"
        f'{body}[loads.push]\non = "plate.T"\nforce = [{rng.uniform(-900, 900)}, 400]\n'
        f"[start]\nangles = {{ plate = 0, {', '.join(f'rod{k} = 0' for k in range(count))} }}\n"
    )
    out, want, forces, size = deviations(text, springs, seed)
    assert max(abs(out[key] - want[key]) for key in forces) < 1e-10 * size


def test_a_rod_that_hardly_resists_is_none():
    """With no stiffness of one rod the forces are those without it; the torque does not depend on it at all."""
    text = texts.GUIDED
    alone = text.partition("[links.third]")[0] + "[inputs]" + text.partition("[inputs]")[2]
    alone = alone.replace('stiffness = "40 kN/mm"\n', "").replace(', third = "90 deg"', "")
    text = text.replace("mass = 5\ninertia = 0.03\n", "")  # its own weight would stay
    both, one = Machine(linkage_from(toml(text), "m")[0]), Machine(linkage_from(toml(alone), "m")[0])
    soft = Machine(both.model, k3=1e-3)
    values = {"phi": 1.1, "w": 2.0, "a": 5.0, "drag": 30.0}
    out, want, stiff = (machine.evaluate(values) for machine in (soft, one, both))
    for key in ("tau", "A.fx", "A.fy", "B.fx", "B.fy", "O1.fx", "O2.fy"):
        assert out[key] == pytest.approx(want[key], abs=1e-7), key
    assert stiff["tau"] == pytest.approx(out["tau"], rel=1e-12)
    assert abs(stiff["B.fx"] - out["B.fx"]) > 10.0
    # only the ratio of both counts
    double = linkage_from(
        toml(text.replace('"40 kN/mm"', '"80 kN/mm"').replace('"65 kN/mm"', '"130 kN/mm"')), "m"
    )[0]
    for key, value in Machine(double).evaluate(values).items():
        assert value == pytest.approx(stiff[key], rel=1e-12, abs=1e-9), key


def test_coupling_rods_of_a_locomotive():
    """Without masses, two rods at 90 deg share the moment of a wheel by the square of their levers: each has M/r
    times the sine of its angle."""
    data = toml(COUPLING_RODS.read_text("utf-8"))
    for rod in ("near_rod", "far_rod"):
        del data["links"][rod]["bar"]
    machine = Machine(linkage_from(data, "machine")[0])
    q = np.linspace(0.1, 6.2, 41)
    out = machine.evaluate({"phi": q, "rail": 9000.0})
    for pin, wave in (("B", np.sin(q)), ("B9", np.cos(q))):
        assert np.hypot(out[f"{pin}.fx"], out[f"{pin}.fy"]) == pytest.approx(np.abs(30000.0 * wave), abs=1e-6)
    assert out["tau"] == pytest.approx(np.full_like(q, 9000.0), rel=1e-12)


@pytest.mark.parametrize("name", TURNING)
def test_the_energy_over_a_turn(name):
    """With friction: the driver gives over a turn what the machine loses and what its loads take."""
    machine = machine_of(name, FRICTION)
    places = np.linspace(0.0, 2.0 * math.pi, 721)
    out = machine.evaluate({"phi": places, "w": np.full_like(places, 4.0)})
    stored = out["kinetic_energy"] + out["potential_energy"]
    assert stored[-1] == pytest.approx(stored[0], rel=1e-9)
    # of a periodic course the sum over even steps is the integral, to rounding
    given, lost = (float(np.sum(x[:-1])) for x in (out["power"], out["dissipated_power"]))
    assert given == pytest.approx(lost, rel=1e-9) and given > 0.0
    assert linkage_findings(machine, 4.0).turn.energy_gap < 1e-12


@pytest.mark.parametrize("name", texts.MACHINES)
def test_power_and_slopes(name):
    """By differences, with friction: the driver gives what is stored and lost; the slopes of the load port."""
    machine = machine_of(name, FRICTION)
    base, step = inputs(machine, 7) | {"a": 0.0, "w": 2.3}, 1e-5
    here = machine.evaluate(base)
    low, high = (machine.evaluate(base | {"phi": base["phi"] + sign * step}) for sign in (-1.0, 1.0))

    def slope(key):
        return (high[key] - low[key]) / (2.0 * step)

    stored = base["w"] * (slope("kinetic_energy") + slope("potential_energy"))
    size = abs(here["power"]) + abs(here["dissipated_power"]) + abs(stored)
    assert here["power"] == pytest.approx(stored + here["dissipated_power"], abs=1e-8 * size)
    size = abs(here["J"]) + abs(here["tau_bias"])
    assert here["tau_bias_dphi"] == pytest.approx(slope("tau_bias"), rel=1e-7, abs=1e-7 * size)
    assert here["dJ_dphi"] == pytest.approx(slope("J"), rel=1e-7, abs=1e-7 * size)
    less, more = (machine.evaluate(base | {"w": base["w"] + sign * step})["tau_bias"] for sign in (-1.0, 1.0))
    assert here["tau_bias_dw"] == pytest.approx((more - less) / (2.0 * step), rel=1e-7, abs=1e-7 * size)


@pytest.mark.second
@pytest.mark.skipif(compiler() is None, reason="no C compiler")
@pytest.mark.parametrize("make", ["native 2", "native 3", "python"])
@pytest.mark.parametrize("name", ["three cranks", "double Scott-Russell", "ellipsograph"])
def test_fmus(name, make, tmp_path):
    """Torque and all reactions through the FMU are those of the equations of all links, before and after a step."""
    machine = machine_of(name)
    other = Multibody(description_of(toml(texts.MACHINES[name]), "machine"), springs=texts.SPRINGS[name])
    if make == "python":
        file = export_python(machine.model, tmp_path / "unit.fmu")
    else:
        file = export(machine.model, tmp_path / "unit.fmu", fmi=int(make[-1]))
    start, h = inputs(machine, 3), 0.01
    end = {
        **start, "phi": start["phi"] + h * start["w"] + 0.5 * h * h * start["a"], "w": start["w"] + h * start["a"]
    }  # fmt: skip
    names = [key for key in machine.evaluate(start) if key.endswith((".fx", ".fy", "tau"))]
    rows = fmpy.simulate_fmu(
        str(file), stop_time=h, step_size=h, output=names, fmi_type="CoSimulation", start_values=start
    )
    for row, values in ((rows[0], start), (rows[-1], end)):
        q = values["phi"]
        want = other.solution(other.followed(q), q, values["w"], values["a"])
        size = max(abs(want[key]) for key in names)
        for key in names:
            assert float(row[key]) == pytest.approx(want[key], abs=1e-10 * size), key


@node
@pytest.mark.second
@pytest.mark.parametrize("name", ["three cranks", "double Scott-Russell"])
def test_the_live_page(name):
    """Its turn is that of Python."""
    machine = machine_of(name)
    turn = in_node(
        of_linkage(machine, 4.0, "machine.toml"),
        "const at = model.turn(values({})); return [[...at.place], at.columns];",
    )
    places = np.array(turn[0])
    drag = {"drag": 30.0} if "drag" in machine.model.input_layout.names else {}
    want = machine.evaluate({"phi": places, "w": np.full_like(places, 4.0)} | drag)
    got = list(next(iter(turn[1].values())).values())
    assert np.ptp(got) > 1.0
    assert got == pytest.approx(want["tau"], rel=1e-9, abs=1e-9)


@pytest.mark.second
def test_the_report():
    machine = machine_of("double Scott-Russell", FRICTION)
    assert (
        linkage_findings(machine, 1.0).sentence
        == "crank + RRP dyad (arm, slide) + shared plate (arm2, platform, crank2)"
    )
    assert drawing(machine).count("<polygon") + drawing(machine).count("<polyline") >= 3


def refused(text, *changes):
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    with pytest.raises((InputError, GeometryError)) as caught:
        linkage_from(toml(text), "machine")
    return str(caught.value)


DEAD = (
    "to a dead position at {} deg of crank: there the lines of third and second go through the pin A of plate"
)


@pytest.mark.parametrize(("start", "place"), [(0, "0"), (90, "180"), (77, "180"), (200, "360")])
def test_cranks_in_line_are_refused_with_a_remedy(start, place):
    """At their dead position, wherever the start is; both remedies work: `GUIDED`, and the coupling rods."""
    angle = f'"{start} deg"'
    text = texts.LOCOMOTIVE.replace("second = 0, third = 0", f"second = {angle}, third = {angle}")
    words = refused(text, ("[start]", f"[start]\nphi = {angle}"))
    assert DEAD.format(place) in words or DEAD.format("0") in words, words
    assert (
        "couple each crank with the next one by two rods, on pins at 90 deg to each other, or let the driver"
        in words
    )
    assert DEAD.format("0") in refused(texts.GUIDED, ('"30 deg"', '"-30 deg"'))


def test_legs_that_do_not_fit_are_refused_with_their_gap():
    for text, change, words in (
        (texts.CRANKS, ("C = [0.15, 0] }", "C = [0.1499, 0] }"), "deg of crank third is 0.1 mm too short, if"),
        (texts.CRANKS, ("C = [0.15, 0] }", "C = [0.15000001, 0] }"), "third is 1e-05 mm too long"),
        (texts.SIEVE, ("S1 = [0, 0.4]", "S1 = [0, 0.401]"), "deg of crank four is 0.9991 mm too long"),
        (texts.SCOTT_RUSSELL, ("B2 = [1, 0]", "B2 = [1.002, 0]"), "at 20 deg of crank crank2 is 1.872 mm too short"),
        (texts.TRAMMEL, ("B = [-0.2, 0]", "B = [-0.2, 0.001]"), "the legs up, along do not fit bar all the way: at"),
    ):  # fmt: skip
        assert words in refused(text, change), words


def test_a_dead_position_before_the_plate_is_that_of_its_group():
    words = refused(texts.SCOTT_RUSSELL, ('["20 deg", "70 deg"]', '["20 deg", "100 deg"]'))
    assert "links.arm: the group of arm, slide comes to a dead position at 90 deg of crank" in words


def test_other_lengths_and_stiffness():
    text = texts.GUIDED.replace('k3 = "65 kN/mm"', 'k3 = "65 kN/mm"\nr = "150 mm"')
    text = text.replace("C = [0.15, 0]", 'C = ["r", 0]')
    model = linkage_from(toml(text), "machine")[0]
    assert Machine(model, k3=1e6).evaluate({"phi": 1.0, "drag": 0.0})["margin"] > 0.3
    with pytest.raises(GeometryError, match=r"deg of crank second is 0.5004 mm too short.*r = 0.151 m"):
        Machine(model, r=0.151)
    with pytest.raises(GeometryError, match="group of plate, third, second comes to a dead position"):
        Machine(model, k3=-1e6)


EXTRA = """
[links.x]
points = { P = [0, 0], Q = [0.4, 0] }
[joints.a]
on = "x.P"
by = "second.B"
[joints.b]
on = "x.Q"
by = "third.C"
"""


def test_redundant_legs_without_a_stiffness_and_other_redundant_joints():
    """The link or joint that a refusal names is tried: without it the linkage works."""
    for text, changes, words in (
        (texts.GUIDED, [('stiffness = "40 kN/mm"\n', "")], "give each of them a stiffness, such as"),
        (texts.GUIDED, [('stiffness = "40 kN/mm"\n', "")], "; without the link third the linkage closes all the way"),
        (texts.CRANKS, [('stiffness = "40 kN/mm"\n', "")], "linkage does not work without any one of its links or"),
        (texts.GUIDED, [("[start]", f"{EXTRA}[start]")], "; without the link x the linkage closes all the way"),
        (texts.CRANKS, [("[links.plate]", "[links.plate]\nstiffness = 3")],
         "links.plate: a stiffness counts only of a redundant leg, here of third, second; leave it out"),
        (texts.CRANKS, [('"65 kN/mm"', '"-65 kN/mm"')], 'third.stiffness: is "k3", which is not > 0 at the start'),
        (texts.CRANKS, [('"40 kN/mm"', "0")], "links.second.stiffness: is 0; must be > 0"),
        (texts.CRANKS, [('"40 kN/mm"', '"40 kN"')], "links.second.stiffness"),
    ):  # fmt: skip
        assert words in refused(text, *changes), words
