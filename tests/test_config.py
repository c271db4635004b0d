"""Study files: one line that names the field, its value and what is allowed."""

from __future__ import annotations

import math

import pytest

from chainunit.config import example, load, parse
from chainunit.errors import InputError
from chainunit.machines.chain_unit import Parameters


def test_the_packaged_example_is_the_packaged_machine():
    config = load()
    for name in (
        "r",
        "l",
        "h",
        "c",
        "hy",
        "e",
        "l1",
        "l2",
        "crank",
        "coupler",
        "rocker",
        "left",
        "right",
        "pin",
    ):
        got, want = getattr(config.machine.p, name), getattr(Parameters(), name)
        assert got == (pytest.approx(want, rel=1e-12) if isinstance(want, float) else want), name
    assert config.machine.p.z == pytest.approx(0.853815, abs=5e-7)


def test_an_empty_file_is_the_packaged_machine():
    assert parse("").machine.p == Parameters()


@pytest.mark.parametrize(
    ("text", "section", "name", "value"),
    [
        ('[machine]\nr = "120 mm"', "machine", "r", 0.12),
        ('[run]\ncrank_speed = "30 rev/min"', "run", "crank_speed", math.pi),
        ('[run]\ncrank_speed = "30 rpm"', "run", "crank_speed", math.pi),
        ('[machine]\njoint_damping = "1 N*m*s"', "machine", "joint_damping", 1.0),
        ('[overload]\njam_force = "2 kN"', "overload", "jam_force", 2000.0),
        ("[run]\nturns = 3", "run", "turns", 3.0),
    ],
)
def test_units(text, section, name, value):
    config = parse(text)
    holder = config.machine.p if section == "machine" else getattr(config, section)
    assert getattr(holder, name) == pytest.approx(value, rel=1e-12)


def test_temperatures():
    assert pytest.approx(293.15) == parse('[motor]\nambient = { T = "20 degC" }').motor.ambient.T


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("[machine]\ncrank = { m = -3 }", "machine.crank.m = -3 kg: must be >= 0 kg (mass)"),
        ("[machine]\nr = nan", "machine.r = nan m: must be finite, > 0 m (crank O1-A)"),
        (
            "[feed]\nleft = { material_mass = inf }",
            "feed.left.material_mass = inf kg: must be finite, >= 0 kg",
        ),
        ('[machine]\nr = "3 kg"', 'machine.r = "3 kg": must be a number in m, or a text such as "2 m"'),
        ('[machine]\nr = "long"', 'machine.r = "long": must be a number in m'),
        ('[machine]\nweb_share = "1 m"', 'machine.web_share = "1 m": must be a pure number'),
        ("[machine]\nweb_share = 1.5", "machine.web_share = 1.5: must be >= 0 and <= 1"),
        ("[machine]\nr = true", "machine.r = True: must be a number in m"),
        ("[machine]\nradius = 1", "machine.radius: unknown key; known here: r, l, h,"),
        ("[machine]\ncrank = { q = 1 }", "machine.crank.q: unknown key; known here: m, s, I"),
        ("[machin]\nr = 1", "machin: unknown key; known here: title, machine, ratios"),
        ("[machine]\ncrank = 3", "machine.crank = 3: must be a table"),
        ("[machine]\nr = 0.9", "machine: r = 0.9 m: the crank cannot turn"),
        ("[machine]\nz = 0.1", "machine: z = 0.1 m: the organs cannot follow the rocker over its swing"),
        ("[ratios]\nrho = 0.1\n[machine]\nr = 0.2", "machine.r: given beside [ratios]"),
        ("[ratios]\nrho = 0.6", "machine: "),
        ("[ratios]\nmu = 1.0", "rho = 0.1, mu = 1: the papers' frame needs"),
        ("[run]\nstep = 1", "run.step = 1 s: must be >= 1e-05 s and <= 0.02 s"),
        ("x =", "no valid TOML"),
        ("title = 3", "title = 3"),
    ],
)
def test_refusals(text, line):
    with pytest.raises(InputError) as caught:
        parse(text)
    assert str(caught.value).startswith(line)
    assert "\n" not in str(caught.value)


def test_every_refusal_names_the_file(tmp_path):
    file = tmp_path / "mine.toml"
    with pytest.raises(InputError, match=r"mine\.toml: cannot be read \(No such file"):
        load(file)
    file.write_bytes(b"\xff\xfe")
    with pytest.raises(InputError, match=r"mine\.toml: is not UTF-8"):
        load(file)
    file.write_text("[run]\nstep = 1")
    with pytest.raises(InputError, match=r"mine\.toml: run\.step"):
        load(file)


def test_the_example_can_be_copied(tmp_path):
    (tmp_path / "mine.toml").write_text(example())
    assert load(tmp_path / "mine.toml").machine.p == load().machine.p
