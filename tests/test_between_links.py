"""Groups of class IV, and drivers between two links that move, against Newton-Euler equations of all links with
Lagrange multipliers (`multibody`, which shares no line with the package)."""

from __future__ import annotations

import itertools
import math

import between_links as texts
import fmpy
import numpy as np
import pytest
from drawings import DENSITY, Drawing
from javascript_hosts import node
from live_pages import in_node
from multibody import Multibody
from test_two_motions import EXCAVATOR

from chainunit import GeometryError, InputError
from chainunit.core.engines import MATH
from chainunit.core.native.compilers import compiler
from chainunit.fmu.export import export as export_python
from chainunit.fmu.native.export import export
from chainunit.machines.linkages.file import description_of, linkage_from
from chainunit.machines.linkages.imports.source import imported
from chainunit.machines.machine import Machine
from chainunit.mechanism.assur import GROUND, REVOLUTE, JointOf, decompose
from chainunit.reading.tables import toml
from chainunit.report.drawing import drawing
from chainunit.report.live.machine import of_linkage
from chainunit.study.linkage_turn import linkage_data, linkage_findings

TETRADS = {
    "Stephenson's second chain": texts.STEPHENSON,
    "tetrad on a rail, with slots": texts.SLOTS,
    "tetrad that turns": texts.TURNING,
}
TEETH = 'phi = "-60 deg + 0.5 * sin(phi)"\nzero = "5 deg"'
INPUT = 'range = ["-120 deg", "-10 deg"]\npositive = "clockwise"'
DRIVEN = {
    "arm on an arm, by a gear": texts.ROBOT.format(law=TEETH),
    "arm on an arm, with a motor": texts.ROBOT.format(law=INPUT),
    "exciter on a coupler": texts.EXCITER,
    "motor between crank and coupler": texts.FOUR_BAR,
    "motor in an elbow": texts.FIVE_BAR.format(law='range = ["80 deg", "130 deg"]'),
}
SHARP = "Stephenson's second chain, near a dead position"
"""Its coordinates have accelerations of 14 rad per rad2 of the crank: it is followed in small steps."""
MACHINES = TETRADS | DRIVEN | {SHARP: texts.STEPHENSON.replace("A = [0.1, 0]", "A = [0.36, 0]")}
LAWS = {
    "arm on an arm, by a gear": lambda x: (
        0.5 * math.sin(x) - math.pi / 3.0,
        0.5 * math.cos(x),
        -0.5 * math.sin(x),
    ),
    "exciter on a coupler": lambda x: (3.0 * x + math.pi / 6.0, 3.0, 0.0),
}
"""Place of the second driver over that of the first one, with its first two derivatives, without the package."""
FREE = ("arm on an arm, with a motor", "motor in an elbow")
FRICTION = "[pins]\nfriction = 0.12\ndiameter = 0.05\ndamping = 0.4\n"


def machine_of(name, more=""):
    data = toml(MACHINES[name] + more)
    return Machine(linkage_from(data, "machine")[0]), description_of(data, "machine")


def motion(machine, name, seed):
    """Place, speed and acceleration of each driver, within their ranges."""
    rng = np.random.default_rng(seed)
    low, high = machine.model.span
    place, w, a = low + (high - low) * rng.uniform(0.05, 0.95), rng.uniform(-3, 3), rng.uniform(-15, 15)
    further = machine.model.described_by.structure.further
    if name in LAWS:
        second, rate, bend = LAWS[name](place)
        return np.array([[place, second], [w, rate * w], [a, rate * a + bend * w * w]])
    if not further:
        return np.array([[place], [w], [a]])
    low, high = further[0].span
    return np.array(
        [
            [place, low + (high - low) * rng.uniform(0.1, 0.9)],
            [w, rng.uniform(-3, 3)],
            [a, rng.uniform(-9, 9)],
        ]
    )


def inputs(machine, name, moved):
    values = dict(zip(("phi", "w", "a"), moved[:, 0], strict=True))
    if name in FREE:
        second = machine.model.described_by.structure.further[0].name
        values |= {f"{second}.{key}": x for key, x in zip(("phi", "w", "a"), moved[:, 1], strict=True)}
    return values | ({"drag": 30.0} if "drag" in machine.model.input_layout.names else {})


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("name", MACHINES)
def test_a_machine_is_that_of_all_its_equations(name, seed):
    """Torque of each driver, all reactions, and all motion, to 1e-10 of the largest of a kind."""
    machine, description = machine_of(name)
    moved = motion(machine, name, seed)
    out = machine.evaluate(inputs(machine, name, moved))
    other = Multibody(description)
    want = other.solution(other.followed(moved[0]), *moved)
    if name == "arm on an arm, by a gear":
        want["tau"] += LAWS[name](moved[0, 0])[1] * want["elbow.tau"]
    forces = [key for key in want if key.endswith((".fx", ".fy", ".normal", ".moment", "tau"))]
    assert len(forces) >= 2 * len(description["joints"]) + 1
    size = max(abs(want[key]) for key in forces)
    for key in forces:
        assert out[key] == pytest.approx(want[key], abs=1e-10 * size), key
    for key in ({*want} & {*out}) - {*forces}:
        if not key.endswith(".angle"):
            assert out[key] == pytest.approx(want[key], rel=1e-9, abs=1e-9), key


def test_a_sharp_machine_is_followed_in_small_steps():
    """A published chain of this kind was refused as too sharp; one crank a little longer is a dead position."""
    machine, description = machine_of(SHARP)
    places = np.linspace(0.0, 2.0 * math.pi, 361)
    out = machine.evaluate({"phi": places, "drag": 0.0})
    other = Multibody(description)
    x = other.closed(np.zeros(1), other.rough)
    for k, q in enumerate(places):
        for step in range(1, 6):
            x = other.closed(np.array([places[max(k - 1, 0)] * (1 - step / 5) + q * step / 5]), x, 12)
        want = other.solution(x, np.array([q]), np.zeros(1), np.zeros(1))
        for key in ("tau", "O.fx", "P.fy", "C.fx"):
            assert out[key][k] == pytest.approx(want[key], abs=1e-9 * np.max(np.abs(out[key]))), (key, q)
    with pytest.raises(
        InputError, match=r"close at its start, 0 deg of .*, or correct the places in \[start\]"
    ):
        linkage_from(toml(texts.STEPHENSON.replace("A = [0.1, 0]", "A = [0.37, 0]")), "machine")


def test_a_range_that_a_tetrad_does_not_close_over():
    """It closes up to 46 degrees: the refusal says to take a smaller range, which works."""
    text = """
[ground]
O = [0, 0]
G = [1.2, 0.1]
[driver]
link = "crank"
range = ["20 deg", "80 deg"]
[links.crank]
points = { O = [0, 0], A = [0.15, 0] }
[links.first]
points = { A = [0, 0], U = [0.2, 0.15], V = [0.3, -0.1] }
[links.second]
points = { G = [0, 0], M = [-0.3, 0.25], N = [-0.35, -0.1] }
[links.upper]
points = { U = [0, 0], M = [0.626046, 0] }
[links.lower]
points = { V = [0, 0], N = [0.435238, 0] }
[start]
phi = "40 deg"
angles = { first = "10 deg", second = 0, upper = 0, lower = 0 }
"""
    with pytest.raises(InputError, match=r"over the range of the driver, or .* take a smaller range"):
        linkage_from(toml(text), "machine")
    linkage_from(toml(text.replace("80 deg", "44 deg")), "machine")


@pytest.mark.parametrize("name", [*TETRADS, "motor between crank and coupler", "exciter on a coupler"])
def test_the_energy_over_a_turn(name):
    """With friction: the drivers give over a turn what the machine loses and what its loads take, and the kinetic
    energy comes back; the crank torque by reactions is that by virtual work."""
    machine, _ = machine_of(name, FRICTION)
    places = np.linspace(0.0, 2.0 * math.pi, 721)
    out = machine.evaluate({"phi": places, "w": np.full_like(places, 4.0)})
    power = out["power"] + (out["exciter.power"] if name in LAWS else 0.0)
    stored = out["kinetic_energy"] + out["potential_energy"]
    assert stored[-1] == pytest.approx(stored[0], rel=1e-9)
    step = places[1] / 4.0
    # of a periodic course the sum over even steps is the integral, to rounding
    given, lost = (float(np.sum(x[:-1])) * step for x in (power, out["dissipated_power"]))
    assert given == pytest.approx(lost, rel=1e-9) and given > 0.0
    assert np.ptp(stored) > 0.1


@pytest.mark.parametrize("name", [n for n in MACHINES if n != "exciter on a coupler"])
def test_slopes_of_the_load_port(name):
    """By differences; they take the third derivatives of the group."""
    machine, _ = machine_of(name, FRICTION)
    base, step = inputs(machine, name, motion(machine, name, 7)), 1e-6
    base["a"] = 0.0
    for prefix in ("", *(f"{d.name}." for d in machine.model.described_by.structure.further if name in FREE)):
        here = machine.evaluate(base)
        for output, key, slope in (
            ("tau_bias", "phi", "tau_bias_dphi"), ("tau_bias", "w", "tau_bias_dw"), ("J", "phi", "dJ_dphi"),
        ):  # fmt: skip
            low, high = (
                machine.evaluate(base | {prefix + key: base[prefix + key] + sign * step})[prefix + output]
                for sign in (-1.0, 1.0)
            )
            want = (high - low) / (2.0 * step)
            size = abs(here[f"{prefix}J"]) + abs(here[f"{prefix}tau_bias"])
            assert here[prefix + slope] == pytest.approx(want, rel=1e-5, abs=1e-5 * size), prefix + slope


FMUS = [
    "Stephenson's second chain",
    pytest.param("tetrad on a rail, with slots", marks=pytest.mark.slow),
    pytest.param(SHARP, marks=pytest.mark.slow),
    "arm on an arm, with a motor",
    "motor between crank and coupler",
]


@pytest.mark.second
@pytest.mark.skipif(compiler() is None, reason="no C compiler")
@pytest.mark.parametrize("make", ["native 2", "native 3", "python"])
@pytest.mark.parametrize("name", FMUS)
def test_fmus(name, make, tmp_path):
    """The efforts and all reactions through the FMU, before and after a step."""
    machine, description = machine_of(name, FRICTION if "slots" not in name else "")
    if make == "python":
        file = export_python(machine.model, tmp_path / "unit.fmu")
    else:
        file = export(machine.model, tmp_path / "unit.fmu", fmi=int(make[-1]))
    start, h = inputs(machine, name, motion(machine, name, 3)), 0.01
    end, second = dict(start), [d["name"] for d in description.get("drivers", ())]
    for prefix in ("", *(f"{other}." for other in second if name in FREE)):
        w, a = start[f"{prefix}w"], start[f"{prefix}a"]
        end |= {f"{prefix}phi": start[f"{prefix}phi"] + h * w + 0.5 * h * h * a, f"{prefix}w": w + h * a}
    names = [key for key in machine.evaluate(start) if key.endswith((".fx", ".fy", "tau", "power"))]
    names += ["J", "tau_bias", "tau_bias_dphi", "tau_bias_dw", "margin"]
    rows = fmpy.simulate_fmu(
        str(file), stop_time=h, step_size=h, output=names, fmi_type="CoSimulation", start_values=start
    )
    for row, values in ((rows[0], start), (rows[-1], end)):
        want = machine.evaluate(values)
        size = max(abs(want[key]) for key in names if key.endswith((".fx", ".fy")))
        for key in names:
            assert float(row[key]) == pytest.approx(float(want[key]), rel=1e-10, abs=1e-10 * size), key


@node
@pytest.mark.second
@pytest.mark.parametrize(
    "name", ["tetrad that turns", "exciter on a coupler", "motor between crank and coupler"]
)
def test_the_live_page(name):
    """Its turn is that of Python."""
    machine, _ = machine_of(name)
    live = of_linkage(machine, 4.0, "machine.toml")
    turn = in_node(live, "const at = model.turn(values({})); return [[...at.place], at.columns];")
    places = np.array(turn[0])
    want = machine.evaluate({"phi": places, "w": np.full_like(places, 4.0)})
    got = list(turn[1]["crank_torque"].values())
    assert np.ptp(got) > 1.0
    assert got == pytest.approx(want["tau"], rel=1e-9, abs=1e-9)


@pytest.mark.second
@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("Stephenson's second chain", "crank + tetrad (one, two, upper, lower)"),
        ("exciter on a coupler", "crank + RRR dyad (coupler, rocker) + driver (unbalance)"),
        ("motor between crank and coupler", "elbow (crank, coupler, rocker)"),
        ("arm on an arm, with a motor", "boom + driver (fore)"),
    ],
)
def test_the_report(name, words):
    machine, _ = machine_of(name, FRICTION)
    findings = linkage_findings(machine, 4.0)
    assert findings.sentence == words
    data = linkage_data(findings, "machine.toml", ())
    assert data.degrees_of_freedom == (2 if name in FREE else 1)
    assert findings.turn.energy_gap < 1e-12
    assert words.count("(") == len(data.groups)
    assert drawing(machine).count("<polygon") + drawing(machine).count("<polyline") >= 3
    assert drawing(machine).count('r="13.00"') == (name in DRIVEN)  # the ring of a motor in a pin


BRANCHES = {
    "first": "points = { B = [-0.1, 0.4], D = [0.3, 0.2], C = [0.8, 0.6], E = [0.9, -0.3] }",
    "second": "angles = { one = -2.0, two = -0.2, upper = 0.9, lower = 0.1 }",
}


def test_the_start_chooses_the_branch_and_it_is_followed():
    """Both modes of a tetrad, all the way round, as Newton's method on all joints follows them in small steps."""
    head, machines = texts.STEPHENSON.partition("[start]")[0], []
    for start in BRANCHES.values():
        data = toml(f"{head}[start]\n{start}\n")
        machine, body = Machine(linkage_from(data, "machine")[0]), Multibody(description_of(data, "machine"))
        places = np.linspace(0.0, 2.0 * math.pi, 73)
        out, pose = machine.evaluate({"phi": places}), body.closed(0.0, body.rough)
        for k, q in enumerate(places):
            pose = body.closed(q, pose)
            for name in ("one", "two"):
                gap = out[f"{name}.angle"][k] - pose[body.columns(name)][2]
                assert math.remainder(gap, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-12), (k, name)
        machines.append(out["one.angle"])
    assert np.min(np.abs(machines[0] - machines[1])) > 1.0


@pytest.mark.parametrize("span", [(-0.5, 2.0), (0.0, 6.2), (-0.3, 0.4)])
def test_a_tetrad_with_a_driver_that_swings(span):
    """Over its range, and a little beyond it, as Newton's method on all joints follows it."""
    text = texts.STEPHENSON.replace('link = "crank"', f'link = "crank"\nrange = [{span[0]}, {span[1]}]')
    machine, body = (
        Machine(linkage_from(toml(text), "machine")[0]),
        Multibody(description_of(toml(text), "machine")),
    )
    pose = body.followed(span[0])
    for q in np.linspace(span[0], span[1], 25):
        pose = body.closed(q, pose)
        out, want = (
            machine.evaluate({"phi": q, "w": 2.0, "a": -5.0, "drag": 30.0}),
            body.solution(pose, q, 2.0, -5.0),
        )
        size = max(abs(want[f"{joint['name']}.fx"]) for joint in body.joints)
        for key in ("tau", *(f"{joint['name']}.{axis}" for joint in body.joints for axis in ("fx", "fy"))):
            assert out[key] == pytest.approx(want[key], abs=1e-11 * size), (q, key)


def test_plates_that_turn_with_the_crank():
    machine, _ = machine_of("tetrad that turns")
    out = machine.evaluate({"phi": np.linspace(0.0, 2.0 * math.pi, 145)})
    for name in ("one", "two"):
        angle = out[f"{name}.angle"]
        assert angle[-1] - angle[0] == pytest.approx(-2.0 * math.pi, abs=1e-12)
        assert np.max(np.abs(np.diff(angle))) < 0.1 and np.ptp(np.diff(angle)) > 1e-3


@pytest.mark.parametrize("form", ["linkage2", "pmks", "pyslvs"])
def test_a_drawing_with_a_group_of_class_iv(form, tmp_path):
    """Of another program: it comes over with no hand on it."""
    drawn = Drawing()
    places = {
        "O": (90, 10),
        "A": (100, 10),
        "P": (0, 0),
        "B": (-10, 40),
        "D": (30, 20),
        "C": (80, 60),
        "E": (90, -30),
    }
    for name, place in places.items():
        drawn.pin(name, place)
    drawn.links = {
        "crank": ["O", "A"], "one": ["P", "B", "D"], "two": ["A", "C", "E"], "upper": ["B", "C"], "lower": ["D", "E"]
    }  # fmt: skip
    drawn.fixed = ["O", "P"]
    drawn.masses = {name: (900.0, 800.0, places[pins[0]]) for name, pins in drawn.links.items()}
    text, scale, pins, links = getattr(drawn, form)()
    file = tmp_path / f"drawing.{form}"
    file.write_text(text, "utf-8")
    source = text if form == "pmks" else str(file)
    machine = Machine(imported(source, density=f"{DENSITY} kg/m").machine()[0])
    kinds = [group.kind for group in machine.model.described_by.structure.groups]
    assert kinds == ["tetrad"]
    body = Multibody(drawn.description(scale, form == "linkage2", form == "pmks"))
    for q in (0.0, 2.7, -1.9):
        out = machine.evaluate({"phi": q, "w": 3.0, "a": -7.0})
        want = body.solution(body.followed(q), q, 3.0, -7.0)
        assert float(out["tau"]) == pytest.approx(want["tau"], rel=1e-11, abs=1e-12), q
        for link, names in drawn.links.items():
            for pin in names:
                place = float(out[f"{links[link]}.{pins[pin]}.y"])
                assert place == pytest.approx(want[f"{link}.{pin}.y"], abs=1e-11), (q, link, pin)


def refused(text, *changes):
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    with pytest.raises((InputError, GeometryError)) as caught:
        linkage_from(toml(text), "machine")
    return str(caught.value)


def test_refusals_of_tetrads():
    text = texts.STEPHENSON
    open_tetrad = (
        "links.one: the tetrad of one, two, upper, lower does not close at its start, 0 deg of crank"
    )
    for changes, words in (
        ([("A = [0.1, 0]", "A = [0.5, 0]")], open_tetrad),
        ([("C = [0.92, 0]", "C = [2.6, 0]")], open_tetrad),
        (
            [("[links.one]", '[links.fan]\npoints = { P = [0, 0] }\n[drivers.fan]\nlink = "fan"\nrange = [0, 1]\n'
              "[links.one]")],
            "form a tetrad, and two drivers are inputs: a tetrad needs one",
        ),
    ):  # fmt: skip
        assert words in refused(text, *changes), words


def test_other_lengths_that_do_not_close_are_refused():
    text = texts.STEPHENSON.replace("C = [0.92, 0]", 'C = ["rod", 0]') + "[parameters]\nrod = 0.92\n"
    model = linkage_from(toml(text), "machine")[0]
    assert Machine(model, rod=0.9).evaluate({"phi": 1.0})["margin"] > 0.3
    with pytest.raises(GeometryError, match="tetrad of one, two, upper, lower does not close"):
        Machine(model, rod=2.6)


def test_refusals_of_drivers_between_links():
    robot = texts.ROBOT.format(law='range = ["-120 deg", "-10 deg"]')
    first = ('[driver]\nlink = "boom"\nrange = ["10 deg", "100 deg"]\n[drivers.elbow]\njoint = "B"',
             '[driver]\njoint = "B"\nrange = ["10 deg", "100 deg"]\n[drivers.arm]\nlink = "boom"')  # fmt: skip
    assert "no [driver] but [drivers.NAME] beside that one" in refused(robot, first)
    assert 'drivers.elbow.joint: is "O", which is a pin of the ground' in refused(
        robot, ('joint = "B"', 'joint = "O"')
    )
    assert "two links that move: B" in refused(robot, ('joint = "B"', 'joint = "O"'))
    assert "drivers.elbow.link: follows from the joint" in refused(
        robot, ('joint = "B"', 'joint = "B"\nlink = "fore"')
    )
    four = refused(texts.FOUR_BAR, ('joint = "A"', 'joint = "B"'))
    assert "cannot close" in four or "dead position" in four
    slide = '[joints.pull]\non = "fore.B"\nby = "boom.O"\ntoward = "B"\n[loads.push]'
    text = refused(
        robot,
        ('joint = "B"', 'joint = "pull"'),
        ('["-120 deg", "-10 deg"]', "[0.1, 0.2]"),
        ("[loads.push]", slide),
    )
    assert "links.fore: " in text and "more than once" in text
    cam = (
        '[parameters]\nbase = "0.1 m"\n[ground]\nO = [0, 0]\nQ = [0.5, 0]\n[driver]\nlink = "shaft"\n[drivers.m]\n'
        'joint = "B"\nphi = "90 deg"\n[links.shaft]\npoints = { O = [0, 0] }\n[links.one]\npoints = { Q = [0, 0], '
        'B = [0.2, 0] }\n[links.two]\npoints = { B = [0, 0], F = [0.3, 0] }\n[joints.track]\non = "two.F"\nby = '
        '"shaft.O"\nradius = "base"\nroller = 0.01\n[start]\npoints = { B = [0.4, 0.2], F = [0.1, 0.1] }\n'
    )
    text = refused(cam)
    assert text.endswith("the cam track must be on a link that no driver moves against another one")


@pytest.mark.parametrize(
    ("text", "end", "other", "link"),
    [
        (texts.EXCITER, 'joint = "M"', "drivers.exciter", "unbalance"),
        (texts.FOUR_BAR, 'joint = "A"', "driver", "coupler"),
        (texts.FIVE_BAR.format(law='phi = "90 deg"'), 'joint = "C"', "drivers.other", "upper"),
        (texts.ROBOT.format(law='phi = "-phi"'), 'link = "boom"', "driver", "boom"),
        (
            texts.ROBOT.format(law='phi = "-phi"')
            + '[joints.rail]\non = "boom.O"\nby = "ground.O"\ntoward = "R"\n[ground]\n'.replace(
                "[ground]\n", ""
            ),
            'joint = "rail"',
            "driver",
            "boom",
        ),
    ],
)
def test_two_drivers_of_one_link_or_joint_are_refused(text, end, other, link):
    unit = "m" if "rail" in end else "rad"
    text = text.replace("O = [0, 0]\n[driver]", "O = [0, 0]\nR = [1, 0]\n[driver]")
    key, _, value = end.partition(" = ")
    assert refused(f"{text}\n[drivers.again]\n{end}\nrange = ['1 {unit}', '2 {unit}']\n") == (
        f"drivers.again.{key}: is {value}, and [{other}] moves {link} already; name another {key}, or take "
        "[drivers.again] out"
    )


@pytest.mark.parametrize(
    ("text", "joint", "name"),
    [
        (texts.EXCITER, "M", "exciter"),
        (texts.FOUR_BAR, "A", ""),
        (texts.ROBOT.format(law='phi = "-phi"\nzero = "5 deg"'), "B", "elbow"),
        (EXCAVATOR.format(law='phi = "0.3 * phi"'), "boom_cylinder", ""),
        (
            EXCAVATOR.format(law='phi = "0.5 + amp * sin(phi / span)"')
            + '[parameters]\namp = "10 mm"\nspan = "1 m"\n',
            "boom_cylinder",
            "",
        ),
    ],
)
@pytest.mark.parametrize("wrong", ["O", "none"])
def test_a_wrong_joint_of_a_driver_is_refused_once(text, joint, name, wrong):
    """Whether its driver turns or slides is not known, so that its other keys are not wrong."""
    message = refused(text, (f'joint = "{joint}"', f'joint = "{wrong}"'))
    key = f"drivers.{name}.joint" if name else "driver.joint"
    assert message.startswith(f'{key}: is "{wrong}"') and "\n" not in message, message


def test_keys_of_a_driver_that_turns_are_refused_of_one_that_slides():
    text = EXCAVATOR.format(law='range = ["0.3 m", "0.5 m"]\npositive = "clockwise"')
    assert refused(text) == (
        "drivers.stick_cylinder.positive: belongs to a driver that turns, and this one slides in stick"
    )


OVER_THE_ANGLE = 'force = ["push * cos(2 * phi) + table(phi, pull)", "-push * w / rate"]'
TABLE = """
[parameters]
push = "20 N"
rate = "4 rad/s"
[tables.pull]
phi = ["0 deg", "120 deg", "240 deg"]
value = ["0 N", "30 N", "10 N"]
"""


def test_the_place_of_a_motor_between_two_links_is_an_angle_in_loads_and_tables():
    text = texts.FOUR_BAR.replace('force = [-30, "20"]', OVER_THE_ANGLE)
    machine = Machine(linkage_from(toml(text + TABLE), "machine")[0])
    q = math.radians(120.0)
    out = machine.evaluate({"phi": q, "w": 2.0})
    constant = texts.FOUR_BAR.replace("force = [-30", f"force = [{20.0 * math.cos(2.0 * q) + 30.0}")
    other = Machine(linkage_from(toml(constant.replace('"20"]', "-10]")), "machine")[0])
    assert out["tau"] == pytest.approx(other.evaluate({"phi": q, "w": 2.0})["tau"], rel=1e-12)
    wrong = refused(text + TABLE, ('joint = "A"', 'joint = "none"'))
    assert wrong.startswith('driver.joint: is "none"') and "\n" not in wrong


ARMS_ON_ONE_EQUATION = """
[ground]
O = [0, 0]
P = [1, 0]
K = [1.8, 0]
[driver]
link = "crank"
[drivers.motor]
joint = "B"
phi = "0.1 * sin(phi)"
by = "motor"
[links.crank]
points = { O = [0, 0] }
[links.near]
points = { P = [0, 0], B = [0.3, 0] }
[links.far]
points = { B = [0, 0], C = [0.3, 0] }
[joints.last]
"""


@pytest.mark.parametrize(
    "last",
    ['on = "far.C"\nby = "ground.K"\nradius = 0.2', 'on = "far.B"\nby = "ground.P"\nteeth = [20, 20]'],
    ids=["cam", "gear"],
)
def test_a_motor_between_two_links_with_one_more_equation_is_refused(last):
    text = refused(ARMS_ON_ONE_EQUATION + last)
    assert text.startswith("links.near: the links near and far, which the driver B moves against each other")
    assert "one of them on a pin of" in text and "the other one on a pin of a lever" in text


ON_LEGS = {
    "triad": (("one", "two", "three"), [("plate", leg) for leg in ("one", "two", "three")]),
    "tetrad": (
        ("plate", "other"),
        [(plate, leg) for plate in ("plate", "other") for leg in ("upper", "lower")],
    ),
}


@pytest.mark.parametrize("kind", ON_LEGS)
def test_links_on_legs_with_a_motor_and_a_cam_are_not_covered(kind):
    """They have as many equations as with pins alone: a motor gives one more, a cam one less."""
    outer, inner = ON_LEGS[kind]
    links = [*dict.fromkeys(("crank", *outer, *(link for pair in inner for link in pair)))]
    crank = JointOf("O", REVOLUTE, "crank", GROUND)
    first, *pins = (
        JointOf(f"{on}_{by}", REVOLUTE, on, by) for on, by in [*((x, GROUND) for x in outer), *inner]
    )
    groups = decompose(links, [crank, first, *pins], {"O": "crank"})
    assert [group.kind for group in groups] == [kind]
    cam, motor = first._replace(kind="cam", equations=1, alone="cam follower"), pins[len(outer) - 1]
    with pytest.raises(
        InputError, match=f"which the driver {motor.name} moves against each other, must be two"
    ):
        decompose(links, [crank, cam, *pins], {"O": "crank", motor.name: motor.on})


@pytest.mark.parametrize(
    "name", ["motor between crank and coupler", "Stephenson's second chain", "arm on an arm, by a gear"]
)
def test_the_direct_model_gives_back_the_motion(name):
    """Also its requirements hold: the inertia of the driver is no more than the machine reflects anywhere."""
    machine, _ = machine_of(name, FRICTION)
    start = inputs(machine, name, motion(machine, name, 4))
    want, direct = machine.evaluate(start), machine.model.direct()
    p = direct.with_derived(MATH, direct.Parameters(phi_start=start["phi"], w_start=start["w"]))
    more = {"drag": start["drag"]} if "drag" in start else {}
    u = direct.input_layout.from_names({"tau": float(want["tau"]), **more})
    (part,) = direct.evaluate(MATH, p, u, direct.begin(p, u))
    out = direct.parts[0].layout.by_name(part)
    assert out["a"] == pytest.approx(start["a"], rel=1e-9)
    direct.check(p)
    low, high = machine.model.span
    reflected = machine.evaluate({"phi": np.linspace(low, high, 181)})["J"]
    assert 0.0 < machine.model.described_by.at_start.driver.inertia <= np.min(reflected)


@pytest.mark.stages(second=1)
@pytest.mark.parametrize("outer", ["RR", "RP", "PR", "PP"])
def test_tetrads_with_slides(outer):
    """All kinds of legs, on plates that turn or slide: those that close are those of all their equations, and the
    others do not close by them either."""
    closing = 0
    for legs in itertools.product(("RR", "PR", "RP"), repeat=2):
        for seed in range(4):
            data = texts.tetrad_of((*outer, *legs), np.random.default_rng(seed))
            description = description_of(data, "machine")
            body = Multibody(description)
            try:
                machine = Machine(linkage_from(data, "machine")[0])
            except InputError as error:
                assert "does not close all the way round" in str(error) or "dead position" in str(error)
                course = [body.closed(0.0, body.rough)]
                for q in np.linspace(0.0, 2.0 * math.pi, 201)[1:]:
                    course.append(body.closed(q, course[-1], 12) if course[-1] is not None else None)
                stiff = max(np.linalg.cond(body.equations(x, 0.0)[1]) for x in course if x is not None)
                assert course[-1] is None or stiff > 200.0
                continue
            closing += 1
            for q in (0.3, 2.9, -3.3):
                out = machine.evaluate({"phi": q, "w": 2.0, "a": 5.0})
                want = body.solution(body.followed(q), q, 2.0, 5.0)
                forces = [key for key in want if key.endswith((".fx", ".fy", ".normal", ".moment", "tau"))]
                size = max(abs(want[key]) for key in forces)
                assert all(abs(out[key] - want[key]) < 1e-10 * size for key in forces), (legs, seed)
    assert closing >= 12


@pytest.mark.parametrize("order", [("elbow", "wrist"), ("wrist", "elbow")])
def test_three_arms_in_any_order(order):
    """A motor on an arm that stands by a motor on the first one; the file may name them in any order."""
    tables = {
        "elbow": '[drivers.elbow]\njoint = "B"\nrange = ["-120 deg", "-10 deg"]\n',
        "wrist": '[drivers.wrist]\njoint = "T"\nrange = ["-30 deg", "60 deg"]\npositive = "clockwise"\n',
    }
    hand = "[links.hand]\npoints = { T = [0, 0], H = [0.2, 0.05] }\nmass = 1.5\ninertia = 0.01\n"
    head, _, rest = texts.ROBOT.format(law="").partition('[drivers.elbow]\njoint = "B"\n')
    text = head + "".join(tables[name] for name in order) + rest.replace("[loads", f"{hand}[loads")
    data = toml(text.replace("tool = [0.6, 0.05]", "tool = [0.6, 0.05], T = [0.6, 0]"))
    machine, body = Machine(linkage_from(data, "machine")[0]), Multibody(description_of(data, "machine"))
    motions = {"": (0.7, 1.5, -2.0), "elbow": (-0.9, 0.8, 3.0), "wrist": (0.4, -1.2, 5.0)}
    values = {
        f"{name}.{key}".removeprefix("."): x
        for name, row in motions.items()
        for key, x in zip(("phi", "w", "a"), row, strict=True)
    }
    moved = np.array([motions[name] for name in ("", *order)]).T
    out, want = machine.evaluate(values), body.solution(body.followed(moved[0]), *moved)
    size = max(abs(want[key]) for key in want if key.endswith((".fx", ".fy")))
    for key in ("tau", "elbow.tau", "wrist.tau", "O.fx", "B.fy", "T.fx", "T.fy"):
        assert out[key] == pytest.approx(want[key], abs=1e-10 * size), key
