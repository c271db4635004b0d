"""Declarations and what is generated from them."""

from __future__ import annotations

import dataclasses
import json
import math
import pickle
import re
from pathlib import Path

import numpy as np
import pytest

from chainunit.core.engines import MATH, numpy_
from chainunit.core.errors import InputError
from chainunit.core.model import Model
from chainunit.core.quantities import Layout, Quantity, base_units, quotient, variables, within_bounds
from chainunit.fmu.description import Interface, model_description, model_description_3
from chainunit.models import MODELS
from chainunit.reading.tables import to_number

NAMES = Path(__file__).parent / "data" / "variables.json"


def variables_of(model):
    """The variables of the model's FMU by causality, in their order, each with its unit, or its type if it is no
    Real."""
    root = model_description(Interface(model, {}), "", {"ModelExchange": {}}, "0")
    results: dict[str, list[str]] = {}
    for variable in root.iter("ScalarVariable"):
        (own,) = variable
        unit = own.get("unit") if own.tag == "Real" else own.tag
        words = variable.get("name") if unit is None else f"{variable.get('name')} [{unit}]"
        results.setdefault(variable.get("causality"), []).append(words)
    return results


def test_units_are_parsed():
    assert base_units("N.m.s/rad") == {"kg": 1, "m": 2, "s": -1, "rad": -1}
    assert base_units("1") == {}
    assert base_units("kg.m2/rad") == {"kg": 1, "m": 2, "rad": -1}
    assert base_units("V") == {"kg": 1, "m": 2, "s": -3, "A": -1}
    assert base_units("Ohm") == base_units("V/A") and base_units("H") == base_units("V.s/A")
    assert base_units("Hz/(N.m)") == {"kg": -1, "m": -2, "s": 1}
    assert base_units("kg.m2/(s3.A)") == base_units("V")
    with pytest.raises(ValueError, match="'N/m/s': must have one stroke at most"):
        base_units("N/m/s")
    for wrong in ("Nm", "(N.m", "kg m", "rpm", ""):
        with pytest.raises(ValueError, match="unknown unit"):
            base_units(wrong)


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_every_quantity_is_declared_once_and_whole(model):
    layouts = [model.parameter_layout, model.input_layout, *(p.layout for p in model.parts)]
    if model.state_layout:
        layouts.append(model.state_layout)
    names = [n for layout in layouts for n in layout.names]
    assert len(names) == len(set(names))
    for layout in layouts:
        for v in layout.variables:
            assert v.description and v.description == v.description.strip()
            base_units(v.unit)
    for layout in layouts[:2]:
        for v in layout.variables:
            assert v.quantity.start is not None and v.quantity.admits(v.quantity.start), v.name


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_the_variables_of_an_fmu_are_a_contract(model):
    """Names, units, causality and order, as others have connected them."""
    assert variables_of(model) == json.loads(NAMES.read_text("utf-8"))[model.name]


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_layout_goes_there_and_back(model):
    for layout in (model.parameter_layout, model.input_layout):
        values = [float(i) for i in range(len(layout.names))]
        assert layout.values(layout.instance(values)) == values
        starts = [v.quantity.start for v in variables(layout.cls)]
        assert layout.values(layout.cls()) == starts
        with pytest.raises(KeyError, match="no variable 'q'"):
            Layout(layout.cls).from_names({"q": 1.0})


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_start_values_make_a_model(model):
    model.check(model.Parameters())


@pytest.mark.stages(first=2)
@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_no_unit_of_an_fmu_can_be_read_in_two_ways(model):
    """`kg.m2/s4.A` is kg m2 A/s4 to one reader, kg m2/(s4 A) to another."""
    root = model_description(Interface(model, {}), "", {"ModelExchange": {}}, "0")
    units = {node.get("name") for node in root.iter("Unit")}
    assert units and not [u for u in units if "." in u.partition("/")[2] and not u.endswith(")")]


def test_a_text_takes_brackets_below_a_stroke():
    (slip,) = (v for v in MODELS["InductionMotor"].parameter_layout.variables if v.unit == "Hz/(N.m)")
    assert to_number(slip, "0.02 Hz/(N.m)") == to_number(slip, "0.02 Hz/N.m") == pytest.approx(0.02)


def test_a_count_is_a_whole_number_and_a_switch_is_on_or_off():
    of = {v.name: v for v in MODELS["InductionMotor"].parameter_layout.variables}
    pairs, on = of["pole_pairs"], of["inverter.on"]
    assert [to_number(pairs, x) for x in (1, 3.0, "24")] == [1.0, 3.0, 24.0]
    assert [to_number(on, x) for x in (True, False, 1, 0.0)] == [1.0, 0.0, 1.0, 0.0]
    for variable, wrong in ((pairs, (2.5, 0, 25, True, "2.5", "50 %")), (on, (0.5, 2, "true", "1"))):
        for x in wrong:
            with pytest.raises(ValueError, match=re.escape(f"must be {variable.quantity.allowed_range} (")):
                to_number(variable, x)
    assert pairs.quantity.allowed_range == "a whole number >= 1 and <= 24"
    assert on.quantity.allowed_range == "true or false"
    assert list(pairs.quantity.admits(np.array([2.0, 2.5, 25.0, math.nan]))) == [True, False, False, False]


def test_python_takes_ints_and_bools():
    """The equations give the same numbers, alone and over arrays."""
    motor = MODELS["InductionMotor"]
    u = motor.input_layout.from_names({"w_ref": 100.0, "load.J": 0.01})
    moving = dict.fromkeys(motor.state_layout.names, 0.3) | {
        "w": 30.0,
        "supply.frequency": 20.0,
        "stator.T": 300.0,
    }
    found = []
    for given in ({"pole_pairs": 3, "inverter.on": True}, {"pole_pairs": 3.0, "inverter.on": 1.0}):
        p = motor.check(motor.parameter_layout.from_names(given))
        x = motor.state_layout.from_names(moving)
        many = motor.state_layout.from_names({name: np.full(2, value) for name, value in moving.items()})
        slips = [motor.evaluate(xp, p, u, at)[0].slip for xp, at in ((MATH, x), (numpy_(), many))]
        assert slips[0] == slips[1][0] == pytest.approx(1.0 - 30.0 * 3.0 / (2.0 * math.pi * 20.0))
        found.append(motor.derivatives(MATH, p, u, x))
    assert found[0] == found[1]
    with pytest.raises(InputError, match=r"pole_pairs = 2\.5: must be a whole number"):
        motor.check(motor.parameter_layout.from_names({"pole_pairs": 2.5}))


@pytest.mark.parametrize("version", [2, 3])
def test_types_of_an_fmu_are_those_of_the_declaration(version):
    """Counts and switches have no unit; an output of theirs is discrete."""
    names = {2: ("Integer", "Boolean"), 3: ("Int32", "Boolean")}[version]
    found = {}
    for name in ("InductionMotor", "LoadObserver"):
        interface = Interface(MODELS[name], {"pole_pairs": 3, "inverter.on": True} if name[0] == "I" else {})
        if version == 2:
            root = model_description(interface, "", {"ModelExchange": {}}, "0")
        else:
            root = model_description_3(interface, "", {"ModelExchange": {}}, "0")
        for node in root.find("ModelVariables"):
            own = node[0] if version == 2 else node
            if own.tag in names:
                found[node.get("name")] = (own.tag, {**node.attrib, **own.attrib})
    assert {name: tag for name, (tag, _) in found.items()} == {
        "solver.max_steps": names[0], "pole_pairs": names[0], "inverter.on": names[1],
        "switching.preferred": names[1], "alarm": names[0],
    }  # fmt: skip
    assert [found[name][1]["start"] for name in ("solver.max_steps", "pole_pairs", "inverter.on")] == [
        "500000", "3", "true",
    ]  # fmt: skip
    variability = {name: attributes["variability"] for name, (_, attributes) in found.items()}
    assert variability.pop("alarm") == "discrete" and set(variability.values()) == {"fixed"}
    alarm = found["alarm"][1]
    assert (alarm["causality"], alarm["initial"], alarm["min"], alarm["max"]) == (
        "output",
        "calculated",
        "-1",
        "1",
    )
    assert not any("unit" in attributes for _, attributes in found.values())


def test_what_is_off_its_bound_by_rounding_counts_as_the_bound():
    share = Quantity("1", "", low=0.0, high=1.0)
    heavy = Quantity("kg", "", low=0.0, open_low=True, nominal=1e3)
    for x in (-1e-9, 0.0, 1.0, 1.0 + 1e-9):
        assert share.admits(x) and share.within_bounds(x) == round(x)
    assert not share.admits(-1.1e-9) and not share.admits(1.0 + 1.1e-9)
    assert not heavy.admits(-1e-9) and not heavy.admits(0.0), "a bound that is itself forbidden"
    model = MODELS["ChamberForces"]
    p = model.parameter_layout.from_names({"web_share": 1.0 + 1e-12, "crank.m": -1e-12})
    assert (model.check(p).web_share, model.check(p).crank.m) == (1.0, 0.0)
    assert within_bounds(model.parameter_layout, model.Parameters()) == model.Parameters()
    with pytest.raises(InputError, match=r"web_share = 1\.1: must be >= 0 and <= 1"):
        model.check(model.parameter_layout.from_names({"web_share": 1.1}))


def test_the_unit_of_a_rate_is_that_of_an_engineer():
    """In the description of an FMU as in a linear model."""
    units = ("1", "m", "rad/s", "A", "Wb", "J")
    rates = [quotient(unit, "s") for unit in units]
    assert rates == ["1/s", "m/s", "rad/s2", "A/s", "Wb/s", "W"]
    for unit, rate in zip(units, rates, strict=True):
        powers = base_units(unit)
        assert base_units(rate) == {k: n for k, n in (powers | {"s": powers.get("s", 0) - 1}).items() if n}


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_a_model_is_a_frozen_instance_that_another_process_gets(model):
    assert isinstance(model, Model) and type(Model) is type
    with pytest.raises(dataclasses.FrozenInstanceError):
        model.name = "Other"
    assert pickle.loads(pickle.dumps(model)) is model
    for name in ("Parameters", "Inputs"):
        values = getattr(model, name)()
        assert pickle.loads(pickle.dumps(values)) == values


def test_what_follows_from_a_model_follows_anew():
    """Its parts from its outputs, and the number of derived values from its linkage; what is stated stays."""
    knife = MODELS["KnifeDrive"]
    other = knife.altered(name="Other", probes=lambda xp, p, u, s, a: knife.probes(xp, p, u, s, 2.0 * a))
    p, u = knife.check(knife.Parameters()), knife.Inputs(w=3.0, a=1.0)
    force, twice = (model.evaluate(MATH, p, u)[0].crank_bearing.fx for model in (knife, other))
    assert force != twice and other.parts is not knife.parts
    assert (other.derived_count, other.pins, other.direct_name) == (53, knife.pins, "OtherDirect")
    with pytest.raises(
        TypeError, match=r"Other: the module chainunit\.\w+\.knife_drive has no such model; state"
    ):
        pickle.dumps(other)
