"""Declarations and what is generated from them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from chainunit.errors import InputError
from chainunit.fmu.description import Interface, model_description
from chainunit.models import MODELS
from chainunit.quantities import Layout, Quantity, base_units, variables, within_bounds
from chainunit.reading import to_number

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


@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_no_unit_of_an_fmu_can_be_read_in_two_ways(model):
    """`kg.m2/s4.A` is kg m2 A/s4 to one reader, kg m2/(s4 A) to another."""
    root = model_description(Interface(model, {}), "", {"ModelExchange": {}}, "0")
    units = {node.get("name") for node in root.iter("Unit")}
    assert units and not [u for u in units if "." in u.partition("/")[2] and not u.endswith(")")]


def test_a_text_takes_brackets_below_a_stroke():
    (slip,) = (v for v in MODELS["InductionMotor"].parameter_layout.variables if v.unit == "Hz/(N.m)")
    assert to_number(slip, "0.02 Hz/(N.m)") == to_number(slip, "0.02 Hz/N.m") == pytest.approx(0.02)


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
