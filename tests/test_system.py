"""The graph of a system: connections by joints, the order of values, and twins with a part left out."""

from __future__ import annotations

import numpy as np
import pytest
from systems import component, pair

from chainunit import InputError
from chainunit.core.ports import LoadPort, PortSlopes
from chainunit.core.quantities import Layout
from chainunit.drives.dc_motor import DcMotor
from chainunit.drives.driveline import CardanDriveline
from chainunit.study import config
from chainunit.study.drive import Drive
from chainunit.study.line.placed import Line, PlacedPart
from chainunit.system import Jump, Profile, System, export, hold_loads, rigid, shaft_joints, without
from chainunit.system.graph import direct_inputs, order
from chainunit.system.signals import at_time, corners


def with_line():
    values = config.load()
    line = CardanDriveline.parameter_layout.from_names({"ratio": 25.0, "J4": 2.0})
    part = PlacedPart("driveline", CardanDriveline, line, line.ratio, line.J4)
    return Drive(DcMotor, values.motor.parameters, values.machine, feed_forward=True, line=Line((part,)))


def test_connections_follow_from_the_joints():
    """The motion one way, the load the other; the torque of a shaft, which both sides give, is not connected."""
    assert pair("ChamberForces", "DcMotor").connections == [
        *((f"motor.{x}", f"machine.{x}") for x in ("phi", "w", "a")),
        *((f"machine.{x}", f"motor.load.{x}") for x in Layout(LoadPort).names),
    ]


def test_bonds_follow_from_the_joints():
    graph = with_line().graph
    assert [(bond.driver, bond.machine) for bond in graph.bonds] == [
        ("motor", "driveline"),
        ("driveline", "machine"),
    ]
    assert graph.bonds[1].flanges[0].members["tau"] == "driven.tau"
    # whichever side is named first
    turned = System(graph.components, [joint[::-1] for joint in graph.joints], graph.wires)
    assert set(turned.connections) == set(graph.connections)
    assert [(bond.driver, bond.machine) for bond in turned.bonds] == [
        (bond.driver, bond.machine) for bond in graph.bonds
    ]


def test_twins_are_systems():
    drive = with_line()
    graph = drive.graph
    plain = without(graph, ("model",))
    assert set(plain.components) == set(graph.components) - {"model"} and not plain.wires
    assert plain.joints == graph.joints
    stiff = rigid(graph, "driveline")
    assert set(stiff.components) == {"machine", "motor", "model"} and stiff.wires == graph.wires
    assert [(bond.driver, bond.machine) for bond in stiff.bonds] == [("motor", "machine")]
    rotor = drive.fmu_parameters.rotor.J
    assert stiff.values["motor.rotor.J"] == pytest.approx(rotor + 2.0 / 25.0**2) and drive.rotor_inertia == (
        pytest.approx(stiff.values["motor.rotor.J"])
    )
    assert stiff.values["machine.ratio"] == drive.ratio == 25.0 * graph.values["machine.ratio"]
    slopes = Layout(PortSlopes).names
    losses = set(graph.connections) - set(hold_loads(graph).connections)
    assert len(losses) == 2 * len(slopes) and all(source.endswith(slopes) for source, _ in losses)
    with pytest.raises(InputError, match=r'gear: there is no component "gear"'):
        without(graph, ("gear",))


def test_values_are_set_where_they_belong():
    graph = pair("ChamberForces", "DcMotor", values={"machine.ratio": 40.0, "motor.w_ref": 3.0})
    assert graph.components["machine"].parameters.ratio == 40.0 and graph.start == {"motor.w_ref": 3.0}
    assert graph.values["machine.ratio"] == 40.0
    with pytest.raises(InputError, match=r"motor\.speed: no such parameter or input in the system"):
        graph.with_values({"motor.speed": 3.0})
    with pytest.raises(InputError, match=r"motor\.tau: no such parameter or input in the system"):
        graph.with_values({"motor.tau": 3.0})


def test_models_share_an_fmu_and_files_stay(tmp_path):
    values = {
        "a": component("DcMotor"),
        "b": component("DcMotor", values={"rotor.J": 0.1}),
        "c": component("ChamberForces"),
    }
    system, origin = export(System(values), tmp_path, "python")
    files = {name: part.file for name, part in system.components.items()}
    assert files["a"] == files["b"] != files["c"] and set(origin) == {"a", "c"}
    again, origin = export(system, tmp_path / "none", "python")
    assert again == system and not origin and not (tmp_path / "none").exists()


def test_values_are_known_in_the_order_of_their_true_dependencies():
    """States, then the load at them, then the acceleration under it, then the torque that it takes."""
    system = pair("ChamberForces", "DcMotor")
    direct = {
        "motor": {"phi": set(), "w": set(), "a": {"load.tau_bias", "load.J"}},
        "machine": {"tau_bias": {"phi", "w"}, "J": {"phi"}},
    }
    steps = order(system.connections, direct)
    place = {f"{name}.{output}": k for k, (name, outputs) in enumerate(steps) for output in outputs}
    assert (
        place["motor.phi"]
        == place["motor.w"]
        < place["machine.tau_bias"]
        == place["machine.J"]
        < place["motor.a"]
    )


def test_what_a_component_does_not_say_its_terminals_promise():
    motor, machine = component("DcMotor"), component("ChamberForces")
    unknown = dict.fromkeys(("phi", "w", "a"))
    inputs = {c.name for c in motor.connectors.values() if c.causality == "input"}
    assert direct_inputs(motor, unknown) == {"phi": set(), "w": set(), "a": inputs}
    assert direct_inputs(motor, {"a": {"load.J"}}) == {"a": {"load.J"}}
    known = direct_inputs(machine, {"J": None, "tau": None, "power": {"w"}})
    assert "a" in known["tau"] and known["J"] == known["tau"] - {"a"} and known["power"] == {"w"}


def test_two_neighbours_are_needed_to_be_joined():
    graph = pair("ChamberForces", "DcMotor")
    with pytest.raises(InputError, match=r"machine\.J4: is not known"):
        rigid(
            System(graph.components | {"x": component("DcMotor")}, shaft_joints("motor", "machine")),
            "machine",
        )


def test_signals_tell_their_corners():
    signals = [Profile(1.0, ((0.2, 0.1, 2.0),)), Jump(0.25, 0.0, 5.0), 3.0, np.sin]
    assert corners(signals) == [0.2, 0.25, pytest.approx(0.3)]
    assert [at_time(signal, 0.25) for signal in signals[1:3]] == [0.0, 3.0]
    np.testing.assert_array_equal(Jump(0.25, 0.0, 5.0)(np.array([0.25, 0.26])), [0.0, 5.0])
