"""Groups of class IV, and drivers between two links that move, against Newton-Euler equations of all links with
Lagrange multipliers (`multibody`, which shares no line with the package)."""

from __future__ import annotations

import math

import between_links as texts
import fmpy
import numpy as np
import pytest
from javascript_hosts import node
from live_pages import in_node
from multibody import Multibody

from chainunit import GeometryError, InputError
from chainunit.core.engines import MATH
from chainunit.core.native.compilers import compiler
from chainunit.fmu.export import export as export_python
from chainunit.fmu.native.export import export
from chainunit.machines.linkages.file import description_of, linkage_from
from chainunit.machines.machine import Machine
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
MACHINES = TETRADS | DRIVEN
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
        [[place, low + (high - low) * rng.uniform(0.1, 0.9)], [w, rng.uniform(-3, 3)], [a, rng.uniform(-9, 9)]]
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


FMUS = ("Stephenson's second chain", "tetrad on a rail, with slots", "arm on an arm, with a motor",
        "motor between crank and coupler")  # fmt: skip


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
@pytest.mark.parametrize("name", ["tetrad that turns", "exciter on a coupler", "motor between crank and coupler"])
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
    low, high = machine.model.span
    places = np.linspace(low, high, 2001)
    feed = machine.model.feed_layout.by_name(machine.model.Feed())
    out = machine.evaluate({"phi": places, "w": np.full_like(places, 4.0), **feed})
    if machine.model.turns:
        assert findings.turn.peak == pytest.approx(np.max(np.abs(out["tau"])), rel=1e-4)
    assert drawing(machine).count("<polygon") + drawing(machine).count("<polyline") >= 3
