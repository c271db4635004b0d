"""Linkage files against the reference points of an independent solution: every number, in Python and in FMUs."""

from __future__ import annotations

import dataclasses
import pickle
import re
from pathlib import Path

import fmpy
import numpy as np
import pytest
from linkage_files import MACHINES, expected, model, tables
from test_reference import deviation

from chainunit.core.engines import MATH
from chainunit.core.errors import InputError
from chainunit.core.native.compilers import compiler
from chainunit.fmu.export import export as export_python
from chainunit.fmu.native.export import export
from chainunit.machines.linkages import model as linkage_model
from chainunit.machines.linkages.file import description_of, read_linkage
from chainunit.machines.linkages.model import machine_of
from chainunit.machines.linkages.parts import LinkageParts
from chainunit.machines.machine import Machine

STATES = [(name, state) for name, each in MACHINES.items() for state in each["states"]]
KINDS = {
    "slider_crank_press": ["RRP"],
    "crank_shaper": ["RPR", "RRP"],
    "blake_crusher": ["RRR", "RRR"],
    "stephenson_iii": ["RRR", "RRR"],
    "pump_jack": ["RRR"],
    "triad_slider": ["triad"],
}


@pytest.mark.parametrize(("name", "state"), STATES, ids=[f"{name}-{s['id']}" for name, s in STATES])
def test_python(name, state):
    outputs = Machine(model(name)).evaluate({key: state[key] for key in ("phi", "w", "a")})
    worst = {key: deviation(float(outputs[key]), value) for key, value in expected(state)}
    assert len(worst) > 60
    assert max(worst.values()) < 1e-9, max(worst.items(), key=lambda pair: pair[1])


@pytest.mark.parametrize("name", MACHINES)
def test_groups_are_those_of_the_description(name):
    groups = model(name).described_by.structure.groups
    assert [group.kind for group in groups] == KINDS[name]
    told = [(g["kind"], {*g["bodies"]}) for g in MACHINES[name]["description"]["groups"]]
    assert [(group.kind, {*group.links}) for group in groups] == told


@pytest.mark.parametrize("name", ["slider_crank_press", "cylinder_lift", "straight_line_pump"])
def test_the_start_values_are_reckoned_once(name, monkeypatch):
    """One linkage of numbers from the file to the check of the start values, and what is kept of it is right."""
    engines, make = [], LinkageParts.__init__

    def counted(parts, geometry, *more):
        engines.append(geometry.xp)
        make(parts, geometry, *more)

    monkeypatch.setattr(LinkageParts, "__init__", counted)
    linkage_model._machine_of.cache_clear()
    machine = read_linkage(Path(__file__).parents[1] / "examples" / "linkages" / f"{name}.toml")

    def derived_and_limits(p):
        derived = machine.derive(MATH, p)
        object.__setattr__(p, "derived", derived)
        return [*derived, *np.ravel([*machine.requirements(MATH, p)])]

    at_start = derived_and_limits(machine.Parameters())
    assert engines.count(MATH) == 1
    # gravity has no part in them, but other values are reckoned anew
    heavier = derived_and_limits(dataclasses.replace(machine.Parameters(), g=20.0))
    assert engines.count(MATH) == 3
    np.testing.assert_allclose(at_start, heavier, rtol=1e-12)


@pytest.mark.parametrize("name", ["blake_crusher", "pump_jack"])
def test_machines_without_reference_states_keep_their_energy(name):
    """Both routes to the torque, and the power balance by differences of the energies."""
    machine = Machine(model(name))
    phi, w, a, h = np.linspace(0.0, 6.2, 40), 3.0, 5.0, 1e-5
    u = machine.inputs({"phi": phi, "w": w, "a": a})
    state = machine.state(u)
    torque = state.torque(a)
    assert np.max(np.abs(state.torque_by_reactions(a) - torque)) < 1e-11 * np.max(np.abs(torque))

    def energy(t):
        out = machine.outputs(phi + w * t + 0.5 * a * t * t, w + a * t, a)
        return out.kinetic_energy + out.potential_energy

    out = machine.outputs(phi, w, a)
    rate = (energy(-2 * h) - 8 * energy(-h) + 8 * energy(h) - energy(2 * h)) / (12 * h)
    assert np.max(np.abs(out.power - out.dissipated_power - rate)) < 1e-6 * np.max(np.abs(out.power))


@pytest.mark.stages(first=2, second=2)
@pytest.mark.skipif(compiler() is None, reason="no C compiler")
@pytest.mark.parametrize("name", [name for name, each in MACHINES.items() if each["states"]])
@pytest.mark.parametrize("make", [export, export_python], ids=["native", "python"])
def test_fmu(name, make, tmp_path):
    """The same numbers through the FMU, all outputs; and where the driver has gone at the end of a step."""
    file = make(model(name), tmp_path / f"{name}.fmu")
    machine, h = Machine(model(name)), 0.01
    for state in MACHINES[name]["states"]:
        wanted = dict(expected(state))
        rows = fmpy.simulate_fmu(
            str(file), stop_time=h, step_size=h, output=list(wanted), fmi_type="CoSimulation",
            start_values={key: state[key] for key in ("phi", "w", "a")},
        )  # fmt: skip
        phi, w, a = (state[key] for key in ("phi", "w", "a"))
        end = machine.evaluate({"phi": phi + h * w + 0.5 * h * h * a, "w": w + h * a, "a": a})
        for row, values in ((rows[0], wanted), (rows[-1], {key: float(end[key]) for key in wanted})):
            worst = {key: deviation(float(row[key]), value) for key, value in values.items()}
            assert max(worst.values()) < 1e-9, max(worst.items(), key=lambda pair: pair[1])


def test_a_model_survives_pickle_and_its_parameters_matter():
    model_of_press = model("slider_crank_press")
    assert pickle.loads(pickle.dumps(model_of_press)) is model_of_press
    heavy = Machine(model_of_press, {"ram.mass": 64.0})
    one, other = (m.outputs(0.7, 3.0, 1.0) for m in (Machine(model_of_press), heavy))
    assert float(other.J) > float(one.J) and float(other.tau) != pytest.approx(float(one.tau))


def test_shuffled_links_and_joints_give_the_same_machine():
    rng = np.random.default_rng(5)
    state = MACHINES["crank_shaper"]["states"][0]
    inputs = {key: state[key] for key in ("phi", "w", "a")}
    plain = Machine(model("crank_shaper")).evaluate(inputs)
    for _ in range(5):
        data = tables(MACHINES["crank_shaper"]["description"])
        for key in ("links", "joints"):
            names = [*data[key]]
            data[key] = {name: data[key][name] for name in rng.permutation(names)}
        outputs = Machine(machine_of(description_of(data, "shuffled"))).evaluate(inputs)
        for name, value in plain.items():
            assert float(outputs[name]) == pytest.approx(float(value), rel=1e-11, abs=1e-9), name


def test_a_linkage_that_does_not_close_says_where():
    data = tables(MACHINES["stephenson_iii"]["description"])
    data["links"]["link"]["points"]["Q"] = [0.1, 0.0]
    with pytest.raises(InputError, match=r"the group of link, output cannot close at .* deg of crank"):
        machine_of(description_of(data, "short"))


def test_an_expression_may_begin_with_a_number():
    """A number before an operator is no quantity with a unit; one with a unit stands alone."""
    data = tables(MACHINES["slider_crank_press"]["description"])
    data["parameters"] = {"half": "180 mm"}
    data["links"]["rod"]["points"]["C"] = ["2 * half", 0]
    machine = Machine(machine_of(description_of(data, "press")))
    wanted = Machine(model("slider_crank_press")).outputs(0.7, 3.0, 1.0)
    assert float(machine.outputs(0.7, 3.0, 1.0).tau) == float(wanted.tau)
    del data["parameters"]["half"]
    data["links"]["rod"]["points"]["C"] = ["0.72 * cos(60 * deg)", 0]  # the remedy of the refusals below
    machine = Machine(machine_of(description_of(data, "press")))
    assert float(machine.outputs(0.7, 3.0, 1.0).tau) == pytest.approx(float(wanted.tau), rel=1e-12)
    data["parameters"]["half"] = "180 mm"
    for text in ("180 mm + half", "2 mm * half", "720 mm * cos(60 deg)"):
        data["links"]["rod"]["points"]["C"] = [text, 0]
        with pytest.raises(InputError, match=r"links.rod.points.C: .* has no units inside: write"):
            description_of(data, "press")


BAR = {"from": "A", "to": "C", "area": "400 mm2", "density": "7850 kg/m3"}


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"groups": {"first": {"kind": "RRP"}}}, "must be tables [[groups]] with kind and links"),
        ({"tables": {"share": {"phi": [0, 1, 2], "value": [0, 1, 2]}}}, "tables.share: no load uses it"),
        ({"bar": {**BAR, "to": "A"}}, "links.rod.bar: goes from A to A; from and to must be two points"),
        ({"bar": {**BAR, "density": "-7850 kg/m3"}}, 'links.rod.bar.density: is "-7850 kg/m3"; must be > 0'),
        ({"bar": {**BAR, "area": 0}}, "links.rod.bar.area: is 0; must be > 0"),
    ],
)
def test_nothing_in_a_file_is_without_effect_or_without_mass(more, words):
    data = tables(MACHINES["slider_crank_press"]["description"])
    bar = more.pop("bar", BAR)
    data["links"]["rod"] = {"points": data["links"]["rod"]["points"], "bar": bar}
    with pytest.raises(InputError, match=re.escape(words)):
        description_of(data | more, "press")


def test_a_triad_that_does_not_close_with_other_lengths_is_refused():
    """By Python, and by the requirement that FMUs check."""
    data = tables(MACHINES["triad_slider"]["description"])
    data["parameters"] = {"l": 0.6}
    data["links"]["link"]["points"]["C"] = ["l", 0.0]
    model = machine_of(description_of(data, "triad_with_length"))
    Machine(model, {"l": 0.605})
    for l in (0.9, 1.2):
        with pytest.raises(InputError):
            Machine(model, {"l": l})
        p = model.parameter_layout.from_names({"l": l})
        p = model.with_derived(MATH, p, None)
        met = [low < value < high for value, low, high in model.requirements(MATH, p)]
        assert len(met) == len(model.required) == 2 and not all(met)
