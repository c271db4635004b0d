"""Declarations and what is generated from them."""

from __future__ import annotations

import pytest

from chainunit.models import MODELS
from chainunit.quantities import Layout, base_units, variables


def test_units_are_parsed():
    assert base_units("N.m.s/rad") == {"kg": 1, "m": 2, "s": -1, "rad": -1}
    assert base_units("1") == {}
    assert base_units("kg.m2/rad") == {"kg": 1, "m": 2, "rad": -1}
    assert base_units("V") == {"kg": 1, "m": 2, "s": -3, "A": -1}
    assert base_units("Ohm") == base_units("V/A") and base_units("H") == base_units("V.s/A")
    for wrong in ("Nm", "kg m", "rpm", ""):
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
