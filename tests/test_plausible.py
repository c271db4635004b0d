"""Bounds that no machine reaches, and values that look like a slip of the unit."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from machines import random_machine
from records import record_of
from reports import page_of, said_of

from chainunit.core.errors import InputError
from chainunit.core.quantities import Layout
from chainunit.drives.dc_motor import DcMotor
from chainunit.machines.chain_unit import ChamberForces, Feed
from chainunit.models import MODELS
from chainunit.reading.tables import option_value, unusual_values
from chainunit.study import config

MM = {"r": 150, "l": 1500, "h": 1000, "c": 1492.48, "hy": 1000, "e": 810, "l1": 1350, "l2": 540, "z": 853.815}


@pytest.mark.parametrize("name", MODELS)
def test_what_has_a_lower_bound_has_an_upper_one(name):
    """Angles apart, whose sines stay finite."""
    model = MODELS[name]
    for layout in (model.parameter_layout, model.input_layout):
        for v in layout.variables:
            q = v.quantity
            assert not (math.isfinite(q.low) and math.isinf(q.high)) or q.unit == "rad", v.name


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            "[feed]\nleft = { material_mass = 1e300 }",
            "feed.left.material_mass = 1e+300 kg: must be >= 0 kg and <= ",
        ),
        (
            "[feed]\nleft = { material_mass = 1e9 }",
            "feed.left.material_mass = 1e+09 kg: must be >= 0 kg and <= 1e+06",
        ),
        (
            "[feed]\nleft = { processing_force = 1e308 }",
            "feed.left.processing_force = 1e+308 N: must be >= 0 N and",
        ),
        (
            "event = [{ type = 'jam', side = 'left', force = 1e15 }]",
            "event.jam_left.force = 1e+15 N: must be >= 0 N and <= 1e+08 N",
        ),
        ("[machine]\ncrank = { m = 1e12 }", "machine.crank.m = 1e+12 kg: must be >= 0 kg and <= 1e+06 kg"),
        (
            "[machine]\ncrank = { s = 1e200 }",
            "machine.crank.s = 1e+200 m: must be >= -10000 m and <= 10000 m",
        ),
        (
            "[feed]\nleft = { material_mass = 1e6 }",
            "feed: material_mass of both sides = 1000030 kg: must be <= 1e+06",
        ),
        (
            "event = [{ type = 'jam', side = 'right', force = 1e8 }]",
            "event.jam_right: right.processing_force comes to 100000010 N with the feed: must be >= 0 N and <= ",
        ),
        (
            "[monte_carlo]\nevent = { force = ['1 kN', '1e5 kN'] }",
            "monte_carlo.event: left.processing_force comes to 100000010 N with the feed: must be",
        ),
        ("[machine]\ng = 1e30", "machine.g = 1e+30 m/s2: must be >= 0 m/s2 and <= 10000 m/s2"),
    ],
)
def test_what_no_machine_reaches_is_refused(text, told):
    with pytest.raises(InputError) as refusal:
        config.parse(text)
    assert str(refusal.value).startswith(told)


@pytest.mark.parametrize("seed", range(3))
def test_at_the_bounds_every_number_is_finite(seed):
    """A random machine with each of its masses, forces and losses at its upper bound."""
    rng = np.random.default_rng(seed)
    machine = random_machine(rng)
    for v in ChamberForces.parameter_layout.variables:
        if (v.unit == "m" and "." not in v.name) or v.name == "ratio":
            continue
        heavy = machine.replace({v.name: v.quantity.high})
        loads = {
            f"{side}.{u.name}": u.quantity.high
            for side in ("left", "right")
            for u in Layout(type(Feed().left)).variables
        }
        out = heavy.evaluate({"phi": 0.3, "w": 100.0, "a": 50.0, **loads})
        assert all(np.all(np.isfinite(x)) for x in out.values()), v.name


def test_the_example_and_random_machines_give_no_remark():
    assert config.load().file.unusual == ()
    rng = np.random.default_rng(5)
    for _ in range(20):
        names = ChamberForces.parameter_layout.by_name(random_machine(rng).p)
        table: dict = {}
        for name, x in names.items():
            *groups, last = name.split(".")
            inner = table
            for each in groups:
                inner = inner.setdefault(each, {})
            inner[last] = float(x)
        result = list(unusual_values({"machine": ChamberForces.Parameters}, {"machine": table}))
        assert result == []


@pytest.mark.parametrize(
    ("text", "name", "meant"),
    [
        ("[machine]\npin = { diameter = 60 }", "machine.pin.diameter", "60 mm"),
        ("[machine]\npin = { friction = 2 }", "machine.pin.friction", None),
        ("[machine]\ng = 9810", "machine.g", "9810 mm/s2"),
        ("[feed]\nleft = { material_mass = 30000 }", "feed.left.material_mass", "30000 g"),
        ("[machine]\ncrank = { m = 1e6 }", "machine.crank.m", "1000000 g"),
        ("[machine]\ncrank = { s = 50 }", "machine.crank.s", "50 mm"),
        ("[machine]\nrocker = { s = -120 }", "machine.rocker.s", "-120 mm"),
        ('[[event]]\ntype = "jam"\nside = "left"\nforce = 5e7', "event.jam_left.force", None),
        ('[[event]]\ntype = "jam"\nside = "right"\nduration = 300', "event.jam_right.duration", "300 ms"),
        ('[[event]]\ntype = "dip"\ncrank_angle = 90', "event.dip.crank_angle", "90 deg"),
        ("[run]\ncrank_speed = 30", "run.crank_speed", "30 rev/min"),
        ("[run]\nramp = 700", "run.ramp", "700 ms"),
    ],
)
def test_a_slip_of_the_unit_is_named_with_what_was_meant(text, name, meant):
    (slip,) = config.parse(text).file.unusual
    assert (slip.variable.name, slip.meant) == (name, meant)
    assert str(slip).startswith(f"{name} = ") and (f'was "{meant}" meant?' in str(slip)) == bool(meant)
    if meant and name.startswith("event."):
        key = name.rsplit(".", 1)[1]
        line = next(line for line in text.splitlines() if line.startswith(key))
        assert config.parse(text.replace(line, f'{key} = "{meant}"')).file.unusual == ()
    elif meant:
        section, *keys = name.split(".")
        inner = f'"{meant}"'
        for key in reversed(keys[1:]):
            inner = f"{{ {key} = {inner} }}"
        assert config.parse(f"[{section}]\n{keys[0]} = {inner}").file.unusual == ()


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ('[machine]\npin = { diameter = "60 m" }', "machine.pin.diameter"),
        ('[feed]\nleft = { material_mass = "30 t" }', "feed.left.material_mass"),
        ('[[event]]\ntype = "jam"\nside = "left"\nforce = "2000 kN"', "event.jam_left.force"),
    ],
)
def test_a_value_with_its_unit_is_doubted_once_in_a_note(text, name):
    """And nobody asks whether a number of another unit was meant."""
    from chainunit.study.drive import Drive
    from chainunit.study.remarks import conclude
    from chainunit.study.result import as_dict

    values = config.parse(text)
    assert values.file.slips == ()
    study = record_of(values, Drive(DcMotor, values.motor.parameters, values.machine))
    conclude(study)
    result = as_dict(study)
    (note,) = [each["text"] for each in result["notes"] if each["code"] == "unusual-value"]
    assert note.startswith(f"By the file, {name} = ") and "usual: " in note and "meant" not in note
    said = said_of(study)
    assert result["slips"] == [] and said.count(f"{name} = ") == 1 and "?" not in said


def test_an_angle_of_more_than_a_turn_is_told_to_be_in_radians():
    (slip,) = config.parse('[[event]]\ntype = "dip"\ncrank_angle = 90').file.unusual
    assert "; a number without a unit is in radians; was" in str(slip)
    (slip,) = config.parse('[[event]]\ntype = "dip"\ncrank_angle = "500 deg"').file.unusual
    assert "radians" not in str(slip)


def test_a_machine_in_millimetres_is_told_for_each_length():
    text = "[machine]\n" + "\n".join(f"{name} = {x}" for name, x in MM.items())
    assert {slip.variable.name: slip.meant for slip in config.parse(text).file.unusual} == {
        f"machine.{name}": f"{x:g} mm" for name, x in MM.items()
    }


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("[machine]\nr = 150", r'machine: c = 1\.49248 m: .*; was machine\.r = "150 mm" meant\?'),
        ("[run]\nramp = 1500", r'run\.step = .*; was run\.ramp = "1500 ms" meant\?'),
        ("[motor]\nambient = { T = 20 }", r'motor\.ambient\.T = 20 K: must be .*; was "20 degC" meant\?'),
        ("[machine]\nl1 = 13500", r'machine\.l1 = 13500 m: must be .*; was "13500 mm" meant\?'),
    ],
)
def test_what_is_refused_for_a_slip_says_so(text, told):
    with pytest.raises(InputError, match=told):
        config.parse(text)


def test_the_remark_stands_on_terminal_page_and_in_json():
    from chainunit.study.drive import Drive
    from chainunit.study.result import as_dict

    values = config.parse("[machine]\npin = { diameter = 60 }")
    drive = Drive(DcMotor, values.motor.parameters, values.machine)
    study = record_of(values, drive)
    result = as_dict(study)
    message = str(values.file.unusual[0])
    assert result["slips"] == [
        {
            "name": "machine.pin.diameter",
            "given": {"value": 60.0, "unit": "m"},
            "meant": "60 mm",
            "said": message,
        }
    ]
    json.dumps(result, allow_nan=False)
    text = said_of(study)
    assert text.count(f"Remark: {message}\n") == 1 and "?." not in text
    html = page_of(study, result)
    assert 'data-path="slips.0.said"' in html and "Is this what was meant?" in html


def test_a_gear_ratio_that_no_drive_has_is_remarked():
    text = '[run]\ncrank_speed = "9000 rev/min"'
    (note,) = map(str, config.parse(text).file.unusual)
    assert note.startswith("run.crank_speed = 9000 rev/min: is unusual") and note.endswith(
        " rev/min); check it"
    )
    (values,) = map(str, config.parse("[machine]\nratio = 5000").file.unusual)
    assert values.startswith("machine.ratio = 5000: is unusual") and "usual: 1 to 500" in values


def test_the_usual_speed_is_that_of_the_machine():
    fast = '[system]\nmachine = "Accelerator"\n[run]\ncrank_speed = {}'
    assert config.parse(fast.format(150)).file.unusual == ()
    (slip,) = config.parse(fast.format('"90 rev/min"')).file.unusual
    assert slip.variable.name == "run.crank_speed" and "usual: 95.49 to 9549 rev/min)" in str(slip)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            '[motor]\ntype = "induction"',
            'the kind of the motor stands in [system]: motor = "DcMotor", "Induction',
        ),
        (
            '[motor]\nkind = "DC"',
            'the kind of the motor stands in [system]: motor = "DcMotor", "InductionMotor"',
        ),
        ('[sizing]\nvoltage = "480 V"', 'a catalogue of your own, catalogue = "FILE.csv"'),
        ('[run]\ncrank_speed = "-30 rpm"', 'positive = "clockwise" in [driver] of its file'),
    ],
)
def test_a_refusal_names_the_place_of_what_was_sought(text, told):
    with pytest.raises(InputError) as refusal:
        config.parse(text)
    assert told in str(refusal.value)


def test_the_sense_of_a_linkage_is_in_its_file():
    """A speed of an option has no sign, of any command."""
    with pytest.raises(InputError, match=r'^--speed = .*: must be > 0 rad/s .*positive = "clockwise"'):
        option_value("--speed", "-120 rpm", "rad/s", "speed of the driver")


def test_a_fault_is_told_once():
    """The place of a start that two links share, or a table that several keys ask for."""
    fault = InputError("start.points.B: is wrong", "start.points.B")
    again = InputError("start.points.B: is wrong", "start.points.B")
    other = InputError("start.points.C: is wrong", "start.points.C")
    assert str(InputError.joined([fault, again])) == "start.points.B: is wrong"
    assert len(InputError.joined([fault, other, again]).faults) == 2


def test_lengths_of_the_example_beside_a_small_machine_are_named():
    """A file that gives some lengths of its machine has the others, and the centroids, of the packaged one."""
    table = '[machine]\nr = "60 mm"\nl = "420 mm"\nh = "380 mm"\nhy = "380 mm"\nc = "416 mm"\n'
    said = [str(value) for value in config.parse(table + 'coupler = { s = "900 mm" }\n').file.unusual]
    assert [line.partition(" = ")[0] for line in said] == [
        "machine.e",
        "machine.coupler.s",
        "machine.rocker.s",
    ]
    assert "; not in the file; usual: 0.0001 to 0.38 m)" in said[0]
    assert "900 mm: is unusual" in said[1] and "to 420 mm); check it" in said[1]
    rest = 'e = "310 mm"\ncoupler = { s = "210 mm" }\nrocker = { s = "190 mm" }\n'
    assert not config.parse(table + rest).file.unusual
