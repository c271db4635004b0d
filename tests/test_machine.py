"""Any linkage machine for Python, from its model class alone: feed, pins, direct model, outputs."""

from __future__ import annotations

import doctest
import pickle

import numpy as np
import pytest
from test_linkage import SixBar

from chainunit import ChainUnitMachine, InputError
from chainunit.core.engines import MATH
from chainunit.core.quantities import Layout
from chainunit.machines import api, machine
from chainunit.machines.api import machine_of
from chainunit.machines.chain_unit import ChamberForces
from chainunit.machines.flexible import flexible
from chainunit.machines.knife_drive import KnifeDrive
from chainunit.machines.machine import Machine
from chainunit.models import MACHINES
from chainunit.study.config import parse

MODELS = {**MACHINES, "SixBar": SixBar}


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_a_machine_follows_from_its_model(model):
    machine = machine_of(model, ratio=3.0)
    assert machine.model is model and machine.ratio == 3.0 and machine.replace(ratio=2.0).ratio == 2.0
    assert type(machine.replace(ratio=2.0)) is type(machine) and machine.ratio == 3.0
    feed = Layout(model.Feed)
    assert set(feed.names) <= set(model.input_layout.names) - {"phi", "w", "a"}
    phi = np.linspace(0.0, 2.0 * np.pi * 3.0, 5)
    out = machine.outputs(phi, 9.0, 4.0, model.Feed())
    assert isinstance(out, model.Outputs) and out.tau.shape == phi.shape
    names = machine.evaluate({"phi": phi, "w": 9.0, "a": 4.0, **feed.by_name(model.Feed())})
    np.testing.assert_array_equal(names["tau"], out.tau)
    with pytest.raises(InputError, match="w = nan"):
        machine.outputs(0.0, float("nan"))


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_each_bearing_has_an_output_and_a_joint(model):
    names = [name for part in model.parts for name in part.layout.names]
    assert list(model.pins.values()) == list(model.joints) and len(model.pins) == len(model.joints)
    assert set(model.joints.values()) <= set(model.topology.joints)
    for output in model.pins.values():
        assert {f"{output}.fx", f"{output}.fy"} <= set(names)
    turned = Machine(model).pin_turns({"phi0": np.linspace(0.0, 1.0, 20)})
    assert set(turned) == set(model.joints) and all(angle.shape == (20,) for angle in turned.values())


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_the_direct_model_follows_from_the_inverse_one(model):
    direct = model.direct()
    assert direct is model.direct() and direct.inverse is model
    inputs, outputs = (direct.input_layout.names, direct.parts[0].layout.names)
    assert inputs == ("tau", *(n for n in model.input_layout.names if n not in ("phi", "w", "a")))
    assert outputs[-3:] == ("a", "tau_bias", "J") and set(outputs[:-3]) < set(model.parts[0].layout.names)
    p = direct.check(direct.parameter_layout.from_names({"w_start": 4.0, "J_added": 0.3, "ratio": 2.0}))
    x, u = direct.initial_states(MATH, p), direct.Inputs(tau=5.0)
    a = direct.derivatives(MATH, p, u, x)[1]
    feed = {name: value for name, value in direct.input_layout.by_name(u).items() if name != "tau"}
    need = machine_of(model, ratio=2.0).evaluate({"phi": 0.0, "w": 4.0, "a": a, **feed})
    assert float(need["tau"]) + 0.3 * a == pytest.approx(5.0, rel=1e-9)


def test_a_machine_of_that_name_is_one_class():
    """Machines with chains are not among the machines by name: there is one for each number of rods."""
    assert all(model.name == name and not model.made for name, model in MACHINES.items())
    assert {"ChamberForces", "KnifeDrive", "Accelerator"} <= set(MACHINES)


def test_names_of_direct_models():
    """The models have the names of their FMUs."""
    names = {name: model.direct().name for name, model in MODELS.items()}
    assert names.pop("ChamberForces") == "ChainUnit"
    assert names == {name: f"{name}Direct" for name in names} and len(names) > 2


def test_a_feed_can_be_sent_to_another_process():
    for model in MODELS.values():
        feed = model.Feed()
        assert pickle.loads(pickle.dumps(feed)) == feed


def test_a_machine_with_chains_is_simulated():
    """What a run of it shows is asked of it; outputs without states are refused."""
    machine = machine_of(flexible(2, 1), {"left.wall_mass": 50.0})
    assert machine.p.left.wall_mass == 50.0
    for ask in (lambda: machine.outputs(0.3), lambda: machine.evaluate({"phi": 0.3})):
        with pytest.raises(TypeError, match="ChainUnitFlexible: its outputs depend on its states"):
            ask()
    rods = {f"{side}.theta_{k}": np.full(5, 0.1 * k) for side in ("left", "right") for k in (1, 2, 3)}
    run = {"phi0": np.linspace(0.0, 1.0, 5), "rocker.psi": np.linspace(0.0, 0.1, 5), **rods}
    turned = machine.pin_turns(run)
    assert set(turned) == set(machine.model.joints)
    np.testing.assert_allclose(turned["left.rocker_joint"], 0.3 - run["rocker.psi"])
    np.testing.assert_allclose(turned["right.hinge"], 0.1)
    bars = machine_of(MACHINES["ChamberForces"]).pin_turns(run)
    np.testing.assert_array_equal(turned["pivot"], bars["pivot"])
    assert machine.stored_per_unit["left.material_mass"]({"left.energy_per_kg": 2.5}) == 2.5


@pytest.mark.parametrize("module", [api, machine])
def test_the_examples_of_docstrings(module):
    assert doctest.testmod(module).attempted > 0 == doctest.testmod(module).failed


def test_what_a_chain_unit_has_beside_others():
    machine, other = machine_of(MACHINES["ChamberForces"]), machine_of(MACHINES["KnifeDrive"])
    assert isinstance(machine, ChainUnitMachine) and type(other) is Machine
    assert other.loaded_sides(None) == () and other.stored_per_unit == {}
    feed = machine.model.Feed()
    assert machine.loaded_sides(feed) == ("left", "right")
    energy = machine.stored_per_unit["left.material_mass"]({"phi0": 0.4, "w0": 3.0})
    more = machine.model.Feed(left=type(feed.left)(material_mass=32.0))
    stored_energy = [
        out.kinetic_energy + out.potential_energy
        for out in (machine.outputs(0.4, 3.0, feed=f) for f in (feed, more))
    ]
    assert 2.0 * energy == pytest.approx(float(stored_energy[1] - stored_energy[0]), rel=1e-9)


def test_a_machine_derived_from_the_chain_unit_is_one(monkeypatch):
    OtherUnit = ChamberForces.altered(name="OtherUnit")
    monkeypatch.setitem(MACHINES, "OtherUnit", OtherUnit)

    machine = parse('[system]\nmachine = "OtherUnit"\n[machine]\nratio = 20').machine
    assert isinstance(machine, ChainUnitMachine) and machine.model is OtherUnit and machine.ratio == 20.0
    assert machine.loaded_sides(OtherUnit.Feed()) == OtherUnit.sides == ("left", "right")
    assert machine.slack_speed() == ChainUnitMachine(ratio=20.0).slack_speed()


def test_a_machine_shows_the_call_that_makes_it():
    assert repr(ChainUnitMachine()) == "ChainUnitMachine()"
    machine = ChainUnitMachine({"crank.m": 35.0}, r=0.16)
    assert repr(machine) == 'ChainUnitMachine({"r": 0.16, "crank.m": 35})'
    assert eval(repr(machine)).p == machine.p
    knife = Machine(KnifeDrive, {"knife.m": 90.0}, ratio=10.0)
    assert repr(knife) == 'Machine(KnifeDrive, {"knife.m": 90, "ratio": 10})'
    assert eval(repr(knife)).p == knife.p
    other = ChamberForces.altered(name="OtherUnit")
    assert repr(ChainUnitMachine(model=other)) == "ChainUnitMachine(model=OtherUnit)"
    # a length that is off by rounding is no change
    assert repr(ChainUnitMachine(r=0.15000000000000002)) == "ChainUnitMachine()"
