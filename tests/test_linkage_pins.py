"""Pins and guides that differ: a linkage file states friction, diameter and kind of a joint alone."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

from chainunit import InputError
from chainunit.machines.linkages.file import linkage_from
from chainunit.machines.machine import Machine

EXAMPLES = Path(__file__).parents[1] / "examples" / "linkages"
PHI, W = np.linspace(0.1, 6.2, 40), 26.0
ROLLING, SEAT = {"kind": "rolling"}, {"friction": 0.15, "diameter": "60 mm", "damping": 0.4}
SEATS = ("O3", "T1", "T2", "D")


def machine_with(file, **tables):
    data = tomllib.loads((EXAMPLES / file).read_text("utf-8"))
    data |= {table: data.get(table, {}) | entries for table, entries in tables.items()}
    return Machine(linkage_from(data, "machine")[0])


def pin_power(machine, out, name, friction, diameter, damping=0.0, w_smooth=0.02):
    """The power that a pin takes, from its reaction and the speeds of its links."""
    described = machine.model.described_by
    joint, pin = described.structure.joints[name], getattr(out, described.variable("joint", name))
    one, other = (
        0.0 if link == "ground" else getattr(out, described.variable("link", link)).w
        for link in (joint.on[0], joint.by[0])
    )
    slip, force = one - other, np.hypot(pin.fx, pin.fy)
    return 0.5 * friction * diameter * force * slip**2 / np.sqrt(slip**2 + w_smooth**2) + damping * slip**2


def test_each_pin_takes_the_power_of_its_own_law():
    """Rolling bearings at the eccentric of a crusher and dry seats of its toggles in place of one law: the torque
    changes by the power of these pins, by their reactions and speeds."""
    own = {"O1": ROLLING, "A": ROLLING} | dict.fromkeys(SEATS, SEAT)
    one, two = machine_with("blake_jaw_crusher.toml"), machine_with("blake_jaw_crusher.toml", pins=own)
    before, after = (machine.outputs(phi=PHI, w=W) for machine in (one, two))
    usual = {name: pin_power(one, before, name, 0.05, 0.09) for name in own}
    wanted = {name: pin_power(one, before, name, 0.0015, 0.09) for name in ("O1", "A")}
    wanted |= {name: pin_power(one, before, name, 0.15, 0.06, 0.4) for name in SEATS}
    change = sum(wanted.values()) - sum(usual.values())
    np.testing.assert_allclose((after.tau - before.tau) * W, change, rtol=1e-9, atol=1e-6)
    np.testing.assert_allclose(after.dissipated_power - before.dissipated_power, change, rtol=1e-9, atol=1e-6)
    # one law for all is far off
    assert np.mean(sum(usual.values())) > 1.3 * np.mean(sum(wanted.values()))


@pytest.mark.stages(first=1)
@pytest.mark.parametrize(
    ("file", "tables"),
    [
        ("blake_jaw_crusher.toml", {"pins": {"A": ROLLING, "T1": SEAT}}),
        ("slider_crank_press.toml", {"guides": {"guide": {"friction": 0.2, "damping": 30.0}}}),
    ],
)
def test_slopes_of_differing_joints_are_those_of_the_torque(file, tables):
    machine, h = machine_with(file, **tables), 1e-5
    for name, step in (("tau_bias_dphi", {"phi": h}), ("tau_bias_dw", {"w": h})):
        ahead, behind = (
            machine.outputs(phi=PHI + sign * step.get("phi", 0.0), w=W + sign * step.get("w", 0.0)).tau_bias
            for sign in (1.0, -1.0)
        )
        slope = machine.batch({"phi": PHI, "w": W}, [name], engine="numpy")[name].values
        np.testing.assert_allclose(
            slope, (ahead - behind) / (2.0 * h), rtol=1e-5, atol=1e-4 * np.max(np.abs(slope))
        )


def test_a_guide_takes_the_power_of_its_own_law():
    """As the law of all guides, where there is one alone; the parameters of all stay beside it."""
    law = {"friction": 0.2, "damping": 30.0}
    one, two = (
        machine_with("slider_crank_press.toml", guides=law),
        machine_with("slider_crank_press.toml", guides={"guide": law}),
    )
    for name in ("tau", "dissipated_power"):
        np.testing.assert_array_equal(*(getattr(m.outputs(phi=PHI, w=W), name) for m in (one, two)))
    assert two.by_name["guides.guide.friction"] == 0.2 and two.by_name["guides.friction"] == 0.0


@pytest.mark.compiler
def test_native_code_has_the_same_losses():
    machine = machine_with("blake_jaw_crusher.toml", pins={"A": ROLLING, "T1": SEAT})
    one, other = (
        machine.batch({"phi": PHI, "w": W}, ["tau", "dissipated_power"], engine=engine)
        for engine in ("numpy", "native")
    )
    for name in one:
        np.testing.assert_allclose(other[name], one[name], rtol=1e-10, atol=1e-9)


def test_start_values_follow_the_table_and_the_kind():
    values = machine_with("blake_jaw_crusher.toml", pins={"A": ROLLING, "T1": {"friction": 0.2}}).by_name
    assert values["pins.A.friction"] == 0.0015 and values["pins.A.diameter"] == 0.09
    assert values["pins.T1.friction"] == 0.2 and values["pins.T1.diameter"] == 0.09
    assert not any(name.startswith("pins.D.") for name in values)


@pytest.mark.parametrize(
    ("tables", "words"),
    [
        ({"pins": {"X": SEAT}}, "pins.X: is no pin of this linkage; its pins are O1, O3, O4, A, T1, T2, D"),
        ({"pins": {"A": {"kind": "ball"}}}, 'pins.A.kind: is "ball"; must be plain or rolling'),
        (
            {"pins": {"A": {**ROLLING, "friction": 0.1}}},
            "pins.A.kind: is rolling, with the friction 0.0015; take",
        ),
        ({"pins": {"A": {"frction": 0.1}}}, "pins.A.frction: unknown key; was .friction. meant"),
        ({"pins": {"A": {"friction": -0.1}}}, "pins.A.friction: is -0.1; must be >= 0"),
        ({"guides": {"A": {"friction": 0.1}}}, "guides.A: is no guide"),
    ],
)
def test_a_wrong_joint_or_law_is_refused_by_its_key(tables, words):
    with pytest.raises(InputError, match=words):
        machine_with("blake_jaw_crusher.toml", **tables)
