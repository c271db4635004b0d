"""Linkages with two drivers: five machines against Newton-Euler equations of all links with Lagrange multipliers
(`multibody`, which shares no line with the package), and the load port of each driver against their differences."""

from __future__ import annotations

import math

import fmpy
import numpy as np
import pytest
from javascript_hosts import node
from live_pages import in_node
from multibody import Multibody
from scipy.interpolate import CubicSpline

from chainunit import GeometryError, InputError
from chainunit.core.engines import MATH
from chainunit.core.native.compilers import compiler
from chainunit.core.symbolic_trace import outputs_of
from chainunit.fmu.export import export as export_python
from chainunit.fmu.native.export import export
from chainunit.machines.linkages.file import description_of, linkage_from
from chainunit.machines.machine import Machine
from chainunit.reading.tables import toml
from chainunit.report.live.machine import of_linkage
from chainunit.study.linkage_turn import linkage_data, linkage_findings

FIVE_BAR = """
[ground]
A = [0, 0]
E = [1.2, 0]
[driver]
link = "left"
[drivers.other]
link = "right"
{law}
[links.left]
points = {{ A = [0, 0], B = [0.4, 0] }}
mass = 3
inertia = 0.1
centroid = [0.15, 0.02]
[links.lower]
points = {{ B = [0, 0], C = [1.0, 0], tool = [1.2, 0.1] }}
mass = 2
inertia = 0.2
centroid = [0.5, 0.0]
[links.right]
points = {{ E = [0, 0], D = [0.3, 0] }}
mass = 2.5
inertia = 0.08
centroid = [0.2, 0.01]
[links.upper]
points = {{ D = [0, 0], C = [1.1, 0] }}
mass = 1
inertia = 0.15
centroid = [0.5, 0.1]
[loads.tool]
on = "lower.tool"
force = ["-20 - drag * vx", "-100"]
[inputs]
drag = "30 N s/m"
[start]
points = {{ C = [0.8, 0.9] }}
"""
EXCAVATOR = """
[ground]
O = [0, 0]
F = [0.2, -0.3]
[driver]
joint = "boom_cylinder"
range = ["1.45 m", "1.75 m"]
[drivers.stick_cylinder]
joint = "stick"
{law}
[links.boom]
points = {{ O = [0, 0], G = [1.6, 0.4], S = [3.2, 0], H = [1.8, 0.6] }}
mass = 400
inertia = 350
centroid = [1.5, 0.2]
[links.arm]
points = {{ S = [0, 0], K = [-0.5, 0.2], B = [1.6, 0] }}
mass = 200
inertia = 60
centroid = [0.5, 0.05]
masses = {{ B = 250 }}
[links.barrel1]
points = {{ F = [0, 0], X = [1, 0] }}
mass = 30
inertia = 3
centroid = [0.5, 0]
[links.rod1]
points = {{ G = [0, 0] }}
mass = 15
inertia = 1
centroid = [-0.4, 0]
[links.barrel2]
points = {{ H = [0, 0], Y = [1, 0] }}
mass = 25
inertia = 2
centroid = [0.4, 0]
[links.rod2]
points = {{ K = [0, 0] }}
mass = 12
inertia = 0.8
centroid = [-0.3, 0.01]
[joints.boom_cylinder]
on = "rod1.G"
by = "barrel1.F"
toward = "X"
[joints.stick]
on = "rod2.K"
by = "barrel2.H"
toward = "Y"
[start]
phi = "1.6 m"
points = {{ G = [1.4, 1.0], S = [2.9, 1.4], K = [2.6, 1.9], B = [3.6, 0.2] }}
"""
RAM_AND_CRANK = """
[ground]
A = [0, 0]
R = [0.9, -0.3]
T = [0.9, 0.3]
[driver]
link = "crank"
positive = "clockwise"
zero = "90 deg"
[drivers.ram]
joint = "way"
range = [0.1, 0.5]
[links.crank]
points = {{ A = [0, 0], B = [0.2, 0] }}
mass = 4
inertia = 0.05
[links.rod]
points = {{ B = [0, 0], C = [0.8, 0] }}
mass = 2
inertia = 0.1
centroid = [0.4, 0.0]
[links.yoke]
points = {{ C = [0, 0], D = [0.5, 0.1] }}
mass = 1.5
inertia = 0.06
centroid = [0.2, 0.05]
[links.slide]
points = {{ D = [0, 0], P = [0, -0.2] }}
mass = 6
inertia = 0.2
centroid = [0.02, 0.01]
[joints.way]
on = "slide.P"
by = "ground.R"
toward = "T"
[start]
points = {{ C = [0.6, 0.6] }}
"""
THREE = """
[ground]
A = [0, 0]
E = [1.2, 0]
[driver]
link = "main"
range = ["10 deg", "70 deg"]
[drivers.bucket]
[links.main]
points = { A = [0, 0], B = [0.5, 0], H = [0.1, 0.1] }
mass = 4
inertia = 0.2
centroid = [0.2, 0.03]
[links.arm]
points = { B = [0, 0], K = [0.1, 0.2], T = [0.6, 0] }
mass = 2
inertia = 0.05
centroid = [0.25, 0.02]
[links.barrel]
points = { H = [0, 0], Y = [1, 0] }
mass = 0.5
inertia = 0.01
centroid = [0.2, 0]
[links.rod]
points = { K = [0, 0] }
mass = 0.4
inertia = 0.01
centroid = [-0.1, 0]
[links.side]
points = { E = [0, 0], D = [0.3, 0] }
mass = 1.5
inertia = 0.03
centroid = [0.1, 0.01]
[links.tie]
points = { D = [0, 0], M = [0.8, 0] }
mass = 0.8
inertia = 0.04
centroid = [0.5, 0]
[links.flap]
points = { T = [0, 0], M = [0.7, 0] }
mass = 0.6
inertia = 0.02
centroid = [0.3, 0.02]
[joints.stick_cylinder]
on = "rod.K"
by = "barrel.H"
toward = "Y"
[start]
phi = "40 deg"
points = { K = [0.27, 0.51], T = [0.7, 0.83], M = [1.35, 1.09] }
"""
MACHINES = {
    "geared five-bar": FIVE_BAR.format(law='phi = "-phi + 30 deg"'),
    "five-bar with a servo on a table": FIVE_BAR.format(
        law='phi = "0.4 * sin(phi) + swing"\nby = "motor"\n[tables.swing]\nphi = ["0 deg", "90 deg", "200 deg", '
        '"300 deg"]\nvalue = ["40 deg", "65 deg", "50 deg", "35 deg"]'
    ),
    "five-bar with two motors": FIVE_BAR.format(law='range = ["0 deg", "90 deg"]\nstart = "40 deg"'),
    "excavator": EXCAVATOR.format(law='range = ["1.2 m", "1.6 m"]'),
    "ram and crank": RAM_AND_CRANK.format(),
}
FREE = ("five-bar with two motors", "excavator", "ram and crank")
SWING = CubicSpline(np.radians([0, 90, 200, 300, 360]), np.radians([40, 65, 50, 35, 40]), bc_type="periodic")
FRICTION = "[pins]\nfriction = 0.12\ndiameter = 0.05\ndamping = 0.4\n[guides]\nfriction = 0.1\ndamping = 3\n"
LAWS = {
    "geared five-bar": lambda x: (-x + math.radians(30.0), -1.0, 0.0),
    "five-bar with a servo on a table": lambda x: (
        0.4 * math.sin(x) + SWING(x % (2.0 * math.pi)),
        0.4 * math.cos(x) + SWING(x % (2.0 * math.pi), 1),
        -0.4 * math.sin(x) + SWING(x % (2.0 * math.pi), 2),
    ),
}
"""Place of the second driver over that of the first one, with its first two derivatives, without the package."""


def machine_of(name, more=""):
    guides = "joint" in MACHINES[name]
    data = toml(MACHINES[name] + (more if guides else more.partition("[guides]")[0]))
    return Machine(linkage_from(data, "machine")[0]), description_of(data, "machine")


def motion(machine, name, seed):
    """Places, speeds and accelerations of both drivers, within their ranges."""
    rng = np.random.default_rng(seed)
    low, high = machine.model.span
    place = low + (high - low) * rng.uniform(0.1, 0.9)
    size = 0.4 if machine.model.slides else 3.0
    (w, w2), (a, a2) = rng.uniform(-size, size, 2), rng.uniform(-5.0 * size, 5.0 * size, 2)
    if name in LAWS:
        second, rate, bend = LAWS[name](place)
        return np.array([[place, second], [w, rate * w], [a, rate * a + bend * w * w]])
    (entry,) = machine.model.described_by.structure.further
    low, high = entry.span
    return np.array([[place, low + (high - low) * rng.uniform(0.1, 0.9)], [w, w2], [a, a2]])


def inputs(machine, name, moved):
    """The inputs of the motion of both drivers; of a law those of the first one alone."""
    second = machine.model.described_by.structure.further[0].name
    values = dict(zip(("phi", "w", "a"), moved[:, 0], strict=True))
    if name in FREE:
        values |= {f"{second}.{key}": x for key, x in zip(("phi", "w", "a"), moved[:, 1], strict=True)}
    return values | ({"drag": 30.0} if "drag" in machine.model.input_layout.names else {})


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("name", MACHINES)
def test_a_machine_is_that_of_all_its_equations(name, seed):
    """Torque or force of each driver, all reactions, and all motion, to 1e-10 of the largest of a kind."""
    machine, description = machine_of(name)
    moved = motion(machine, name, seed)
    out = machine.evaluate(inputs(machine, name, moved))
    other = Multibody(description)
    want = other.solution(other.followed(moved[0]), *moved)
    second = description["drivers"][0]["name"]
    if name == "geared five-bar":
        want["tau"] += LAWS[name](moved[0, 0])[1] * want[f"{second}.tau"]
    assert {"tau", f"{second}.tau", "kinetic_energy", "load_power"} < {*want}
    forces = [key for key in want if key.endswith((".fx", ".fy", ".normal", ".moment", "tau"))]
    assert len(forces) >= 2 * len(description["joints"]) + 2
    size = max(abs(want[key]) for key in forces)
    for key in forces:
        assert out[key] == pytest.approx(want[key], abs=1e-10 * size), key
    for key in ({*want} & {*out}) - {*forces}:
        if not key.endswith(".angle"):
            assert out[key] == pytest.approx(want[key], rel=1e-9, abs=1e-9), key


@pytest.mark.parametrize("name", MACHINES)
def test_the_powers_of_both_drivers_are_the_power_of_the_machine(name):
    """With friction: what the drivers give is what the machine stores and loses."""
    machine, description = machine_of(name, FRICTION)
    x, w, a = motion(machine, name, 5)
    second, step = description["drivers"][0]["name"], 1e-4

    def moment(t):
        place = x + w * t + 0.5 * a * t * t
        moved = np.array([place, w + a * t, a])
        return machine.evaluate(inputs(machine, name, moved))

    out, before, after = moment(0.0), moment(-step), moment(step)
    energy = [row["kinetic_energy"] + row["potential_energy"] for row in (before, after)]
    power = out["power"] + (0.0 if name == "geared five-bar" else out[f"{second}.power"])
    assert power == pytest.approx(out["tau"] * w[0] + power - out["power"], rel=1e-12)
    assert out["dissipated_power"] != 0.0
    lost = (energy[1] - energy[0]) / (2.0 * step) + out["dissipated_power"]
    assert power == pytest.approx(lost, rel=1e-6, abs=1e-5 * abs(out["power"]))


@pytest.mark.parametrize("name", MACHINES)
def test_each_motion_has_its_load_port(name):
    """The effort is J a + tau_bias, and the slopes of both are those of differences."""
    machine, description = machine_of(name, FRICTION)
    moved, step = motion(machine, name, 7), 1e-6
    prefixes = ["", f"{description['drivers'][0]['name']}."] if name in FREE else [""]
    for prefix in prefixes:
        base = inputs(machine, name, moved)

        def out(key="phi", change=0.0, prefix=prefix, base=base):
            return machine.evaluate(base | {prefix + key: base[prefix + key] + change})

        here = out()
        for a in (0.0, 3.0):
            there = out("a", a - base[f"{prefix}a"])
            effort = here[f"{prefix}J"] * a + here[f"{prefix}tau_bias"]
            assert there[f"{prefix}tau"] == pytest.approx(effort, rel=1e-10)
        for output, key, slope in (
            ("tau_bias", "phi", "tau_bias_dphi"), ("tau_bias", "w", "tau_bias_dw"), ("J", "phi", "dJ_dphi"),
        ):  # fmt: skip
            low, high = (out(key, sign * step)[f"{prefix}{output}"] for sign in (-1.0, 1.0))
            want = (high - low) / (2.0 * step)
            assert here[f"{prefix}{slope}"] == pytest.approx(
                want, rel=1e-5, abs=1e-5 * abs(here[f"{prefix}J"])
            )


FMUS = ("geared five-bar", "five-bar with a servo on a table", "excavator")


@pytest.mark.second
@pytest.mark.skipif(compiler() is None, reason="no C compiler")
@pytest.mark.parametrize("make", ["native 2", "native 3", "python"])
@pytest.mark.parametrize("name", FMUS)
def test_fmus(name, make, tmp_path):
    """The numbers of both drivers and all reactions through the FMU, before and after a step."""
    machine, description = machine_of(name, FRICTION)
    if make == "python":
        file = export_python(machine.model, tmp_path / "unit.fmu")
    else:
        file = export(machine.model, tmp_path / "unit.fmu", fmi=int(make[-1]))
    second, h = description["drivers"][0]["name"], 0.01
    start = inputs(machine, name, motion(machine, name, 3))
    end = dict(start)
    for prefix in ("", f"{second}.") if name in FREE else ("",):
        w, a = start[f"{prefix}w"], start[f"{prefix}a"]
        end |= {f"{prefix}phi": start[f"{prefix}phi"] + h * w + 0.5 * h * h * a, f"{prefix}w": w + h * a}
    names = [key for key in machine.evaluate(start) if key.endswith((".fx", ".fy", "tau", "power"))]
    names += ["J", "tau_bias", "tau_bias_dphi"]
    names += [f"{second}.{key}" for key in ("J", "dJ_dphi", "tau_bias_dw")] if name in FREE else []
    rows = fmpy.simulate_fmu(
        str(file), stop_time=h, step_size=h, output=names, fmi_type="CoSimulation", start_values=start
    )
    for row, values in ((rows[0], start), (rows[-1], end)):
        want = machine.evaluate(values)
        size = max(abs(want[key]) for key in names if key.endswith((".fx", ".fy")))
        for key in names:
            assert float(row[key]) == pytest.approx(float(want[key]), rel=1e-10, abs=1e-10 * size), key


def test_a_free_driver_has_a_flange_and_a_load_port():
    model = machine_of("excavator")[0].model
    members = {terminal.name: terminal.members for terminal in model.terminals}
    assert members["flange_stick_cylinder"] == {
        key: f"stick_cylinder.{key}" for key in ("phi", "w", "a", "tau")
    }
    assert members["load_stick_cylinder"]["tau_bias_dw"] == "stick_cylinder.tau_bias_dw"
    assert model.input_rates["stick_cylinder.w"] == "stick_cylinder.a"
    outputs = [*outputs_of(model)]
    assert {f"stick_cylinder.{key}" for key in ("tau", "J", "tau_bias_dphi")} <= {v.name for v in outputs}


@node
@pytest.mark.parametrize("name", ["geared five-bar", "five-bar with two motors"])
def test_the_live_page_has_both_motions(name):
    """Its turn is that of Python; a driver that is an input has a quantity of its own, within its range."""
    machine, _ = machine_of(name)
    live, changed = of_linkage(machine, 4.0, "machine.toml"), {"feed.drag": 12.0}
    if name in FREE:
        changed["feed.other.phi"] = 1.2
        (quantity,) = [q for q in live.data["quantities"] if q["key"] == ["feed", "other", "phi"]]
        assert (quantity["low"], quantity["high"]) == pytest.approx((0.0, math.radians(90.0)))
    turn = in_node(live, f"const at = model.turn(values({changed})); return [[...at.place], at.columns];")
    feed = {key.removeprefix("feed."): value for key, value in changed.items()}
    places = np.array(turn[0])
    want = machine.evaluate({"phi": places, "w": np.full_like(places, 4.0), **feed})
    got = list(turn[1]["crank_torque"].values())
    assert np.ptp(got) > 1.0
    assert got == pytest.approx(want["tau"], rel=1e-9, abs=1e-9)


@pytest.mark.parametrize(
    ("law", "message"),
    [
        ('phi = "1.5 * phi"', "drivers.other.phi: moves by 1.5 turns in a turn of the first driver"),
        ('phi = "phi**2"', "give a law with the same place at 0 and 360 deg"),
        ('phi = "phi * (2 * pi - phi)"', "drivers.other.phi: its speed jumps after a turn of the first driver"),
        ('link = "left"', 'drivers.other.link: is "left", and [driver] moves left already; name another link'),
        ('range = "40 mm"\nstart = 1', "drivers.other.range: "),
        ('phi = "2 * phi"\nby = "belt"', 'drivers.other.by: is "belt"; must be "gear"'),
        ('phi = "2 * phi"\nrange = [0, 1]', "drivers.other.range: follows from the law in phi"),
        ('phi = "2 * w"', "drivers.other.phi: is \"2 * w\"; w is no parameter"),
        ('phi = "sqrt(sin(phi))"', "drivers.other.phi: has no value at a place of the driver"),
        ('phi = "max(left.B.y)"', "drivers.other.phi: "),
        ("", 'drivers.other.range: is missing; a driver that is an input of its own needs one, such as ["-20 deg"'),
        ('range = ["0 deg", "90 deg"]\nby = "gear"', "drivers.other.by: belongs to a driver with a law"),
        ('range = ["0 deg", "90 deg"]\nstart = 2', 'must be within drivers.other.range, ["0 deg"'),
        ('range = ["0 deg", "90 deg"]\nstart = "80 deg"', "this is with other at"),
        ('phi = "phi"\njoint = "E"', "drivers.other.joint: is \"E\", which is a pin of the ground: for that give"),
        ('phi = "phi"\nlaw = 3', "drivers.other.law: "),
    ],
)  # fmt: skip
def test_a_wrong_driver_is_refused(law, message):
    if law.startswith("link"):
        data = toml(FIVE_BAR.format(law='phi = "phi"').replace('link = "right"', law))
    else:
        data = toml(FIVE_BAR.format(law=law))
    if "this is with" in message:
        data["links"]["upper"]["points"]["C"] = [0.8, 0]
    if "joint" in law:
        del data["drivers"]["other"]["link"]
    with pytest.raises(InputError) as caught:
        linkage_from(data, "machine")
    assert message in str(caught.value)
    assert str(caught.value).count("drivers.other.start") <= 1 and not (
        "mm" in law and "start" in str(caught.value)
    )


def test_a_further_driver_in_the_table_of_the_first_is_told_its_place():
    data = toml(FIVE_BAR.format(law='phi = "phi"'))
    data["driver"]["right"] = data.pop("drivers")["other"]
    with pytest.raises(
        InputError, match=r"driver\.right: is a table; a driver besides the first one is \[drivers\.right\]"
    ):
        linkage_from(data, "machine")


def test_what_a_machine_with_two_inputs_cannot_do():
    """Its remedy works: a law gives it one input, a number in place of an extreme a load."""
    model = machine_of("five-bar with two motors")[0].model
    with pytest.raises(InputError, match="export without --direct, or give it a law"):
        model.direct()
    held = FIVE_BAR.format(law='phi = "40 deg"')
    assert Machine(linkage_from(toml(held), "machine")[0]).model.direct().name == "machineDirect"
    extreme = MACHINES["five-bar with two motors"].replace('"-100"', '"-drag * vy * step(y - min(y), 0.1)"')
    with pytest.raises(InputError, match="depends on two inputs"):
        linkage_from(toml(extreme), "machine")
    linkage_from(toml(extreme.replace("min(y)", "0.2")), "machine")


def test_a_driver_with_a_range_takes_any_ratio():
    data = toml(FIVE_BAR.format(law='phi = "1.5 * phi + 10 deg"'))
    data["driver"]["range"] = ["0 deg", "40 deg"]
    out = Machine(linkage_from(data, "machine")[0]).evaluate({"phi": math.radians(20.0), "w": 2.0})
    assert math.degrees(out["other.phi"]) == pytest.approx(40.0) and out["other.w"] == pytest.approx(3.0)


def test_arrays_of_both_motions():
    machine, _ = machine_of("excavator")
    rows = [inputs(machine, "excavator", motion(machine, "excavator", seed)) for seed in range(4)]
    together = machine.evaluate({key: np.array([row[key] for row in rows]) for key in rows[0]})
    for k, row in enumerate(rows):
        for key, value in machine.evaluate(row).items():
            assert together[key][k] == pytest.approx(float(value), rel=1e-12, abs=1e-9), key


@pytest.mark.second
@pytest.mark.parametrize("name", ["five-bar with a servo on a table", "five-bar with two motors"])
def test_the_report_has_both_drivers(name):
    machine, _ = machine_of(name, FRICTION)
    findings = linkage_findings(machine, 4.0)
    data = linkage_data(findings, "machine.toml", ())
    assert data.degrees_of_freedom == (2 if name in FREE else 1)
    places = np.linspace(0.0, 2.0 * math.pi, 5001)
    feed = machine.model.feed_layout.by_name(machine.model.Feed())
    out = machine.evaluate({"phi": places, "w": np.full_like(places, 4.0), **feed})
    assert data.drivers["other"]["peak"].value == pytest.approx(np.max(np.abs(out["other.tau"])), rel=1e-6)
    mean = np.trapezoid(out["other.power"], places) / (2.0 * math.pi)
    assert data.drivers["other"]["power_mean"].value == pytest.approx(mean, rel=1e-6, abs=1e-9)
    assert findings.turn.energy_gap < 1e-12
    assert "left + driver (right) + RRR dyad" in findings.sentence


def test_a_law_with_parameters_must_come_back():
    """With other values, too: else the FMU and the machine refuse them, with the parameter."""
    law = 'phi = "ratio_of_wheels * phi + lead"\n[parameters]\nratio_of_wheels = 2\nlead = "20 deg"'
    machine = Machine(linkage_from(toml(FIVE_BAR.format(law=law)), "machine")[0])
    assert machine.replace(lead=0.1, ratio_of_wheels=-1.0).evaluate({"w": 1.0})["other.w"] == -1.0
    with pytest.raises(GeometryError, match=r"other is not back after a turn .* ratio_of_wheels = 1.5"):
        machine.replace(ratio_of_wheels=1.5)


def test_degrees_beside_a_table():
    law = 'phi = "swing + 10 deg"\n[tables.swing]\nphi = [0, 2, 4]\nvalue = ["20 deg", "40 deg", "30 deg"]'
    out = Machine(linkage_from(toml(FIVE_BAR.format(law=law)), "machine")[0]).evaluate({"phi": 2.0})
    assert math.degrees(out["other.phi"]) == pytest.approx(50.0)


@pytest.mark.parametrize("names", [("stick", "bucket"), ("bucket", "stick")])
def test_three_drivers_in_any_order(names):
    """A crank in the ground, a second one by a law behind a cylinder on it in the file, or before it."""
    arm = THREE.partition("[drivers.bucket]")
    blocks = {
        "stick": '[drivers.stick]\njoint = "stick_cylinder"\nrange = ["0.35 m", "0.55 m"]\n',
        "bucket": '[drivers.bucket]\nlink = "side"\nphi = "0.5 * sin(phi) + 60 deg"\nby = "motor"\n',
    }
    data = toml(arm[0] + "".join(blocks[name] for name in names) + arm[2])
    machine, description = Machine(linkage_from(data, "machine")[0]), description_of(data, "machine")
    phi, w, a = 0.7, 1.5, -2.0
    bucket = (
        0.5 * math.sin(phi) + math.radians(60.0),
        0.5 * math.cos(phi) * w,
        0.5 * (math.cos(phi) * a - math.sin(phi) * w * w),
    )
    motions = {"stick": (0.45, 0.1, 0.3), "bucket": bucket}
    values = dict(zip(("phi", "w", "a"), (phi, w, a), strict=True))
    values |= {f"stick.{key}": x for key, x in zip(("phi", "w", "a"), motions["stick"], strict=True)}
    out = machine.evaluate(values)
    other = Multibody(description)
    moved = np.array([(phi, w, a), *(motions[name] for name in names)]).T
    want = other.solution(other.followed(moved[0]), *moved)
    size = max(abs(want[key]) for key in want if key.endswith((".fx", ".fy")))
    for key in want:
        if key.endswith((".fx", ".fy", "tau")):
            assert out[key] == pytest.approx(want[key], abs=1e-10 * size), key


@pytest.mark.parametrize("name", LAWS)
def test_the_direct_model_gives_back_the_motion(name):
    """The torque of the inverse model drives it with the acceleration of that one; the second driver follows."""
    machine, _ = machine_of(name, FRICTION)
    start = inputs(machine, name, motion(machine, name, 4))
    want, direct = machine.evaluate(start), machine.model.direct()
    p = direct.with_derived(MATH, direct.Parameters(phi_start=start["phi"], w_start=start["w"]))
    u = direct.input_layout.from_names({"tau": float(want["tau"]), "drag": start["drag"]})
    (part,) = direct.evaluate(MATH, p, u, direct.begin(p, u))
    out = direct.parts[0].layout.by_name(part)
    assert out["a"] == pytest.approx(start["a"], rel=1e-9)
    for key in ("other.tau", "other.phi", "other.w", "other.a", "C.fx", "kinetic_energy", "dissipated_power"):
        assert out[key] == pytest.approx(float(want[key]), rel=1e-9), key
