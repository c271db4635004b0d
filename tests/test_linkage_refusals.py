"""Wrong linkage files: each fault is told in one line, with file, line, key and remedy, and all faults at once."""

from __future__ import annotations

import re

import pytest
from wrong_linkages import CHANGES, FILES, PRESS, R

from chainunit.core.errors import InputError
from chainunit.machines.linkages.file import read_linkage


def changed(changes):
    text = PRESS
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new, 1)
    return text


CASES = [*((changed(changes), faults) for changes, faults in CHANGES), *FILES]


def test_the_list_is_long_enough():
    assert len(CASES) >= 100


@pytest.mark.parametrize(("text", "faults"), CASES, ids=[f"{k}-{c[1][0][1]}" for k, c in enumerate(CASES)])
def test_every_fault_has_its_line_key_and_remedy(text, faults, tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text(text, "utf-8")
    with pytest.raises(InputError) as caught:
        read_linkage(file)
    lines = str(caught.value).splitlines()
    assert len(lines) == len(faults), lines
    for line, (number, key, remedy) in zip(lines, faults, strict=True):
        place = f"{file}:{number}: " if number else f"{file}: "
        assert line.startswith(f"{place}{key}: "), line
        assert remedy in line, line
        message = line.removeprefix(f"{place}{key}: ")
        assert not message.startswith(key), line
        # no form of Python, no stop behind a question
        assert not re.search(r"\bNone\b(?!_)|\bTrue\b|\bFalse\b|<class|\?;|Error", message), line


@pytest.mark.parametrize("unit", ["kg m2", "kg*m2", "kg·m²", "kg m^2", "N*m*s^2"])
def test_a_unit_may_be_a_product(unit, tmp_path):
    """It is no expression with a unit inside."""
    file = tmp_path / "mine.toml"
    file.write_text(changed([('"0.09 kg m2"', f'"0.09 {unit}"')]), "utf-8")
    assert read_linkage(file).Parameters().crank.inertia == pytest.approx(0.09, rel=1e-15)


def test_the_file_itself_is_right(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text(PRESS, "utf-8")
    assert read_linkage(file).name == "mine"


def test_a_load_may_have_the_name_of_an_own_load(tmp_path):
    """A load that is called weight, pins or guides stands beside the machine's own."""
    from chainunit.machines.machine import Machine

    results = []
    for name in ("pressing", "weight", "pins", "guides"):
        file = tmp_path / f"{name}.toml"
        text = changed(
            [("[loads.pressing]", f"[loads.{name}]"), ("[start]", "[pins]\nfriction = 0.1\n[start]")]
        )
        file.write_text(text, "utf-8")
        out = Machine(read_linkage(file)).outputs(1.0, 2.0, 3.0)
        results.append([float(out.tau), float(out.load_power), float(out.dissipated_power)])
    assert results[0][1] != 0.0
    assert results[1:] == [pytest.approx(results[0], rel=1e-14)] * 3


def test_a_least_value_by_rounding_is_the_least(tmp_path):
    """Friction is smoothed below a speed that is never zero."""
    file = tmp_path / "mine.toml"
    file.write_text(changed([("[start]", "[guides]\nfriction = 0.1\nv_smooth = 0\n[start]")]), "utf-8")
    assert read_linkage(file).Parameters().guides.v_smooth > 0.0


def test_names_of_parameters_may_hold_units(tmp_path):
    """A parameter may have the name of a unit; a product with a number in front is an expression."""
    file = tmp_path / "mine.toml"
    file.write_text(changed([(R, R.replace("80", "40")), ('["r", 0]', '["2 * r", 0]')]), "utf-8")
    plain = tmp_path / "plain.toml"
    plain.write_text(PRESS, "utf-8")
    from chainunit.machines.machine import Machine

    one, two = (Machine(read_linkage(each)).outputs(1.0, 2.0, 3.0) for each in (file, plain))
    assert float(one.tau) == pytest.approx(float(two.tau), rel=1e-12)


def test_an_input_has_its_unit_beside_a_parameter_of_that_name(tmp_path):
    """Else ``2.5 kN`` would be an expression of the parameter kN; a true expression of it is refused."""
    file = tmp_path / "mine.toml"
    named = [('l = "360 mm"', 'kN = "360 mm"'), ('["l", 0]', '["kN", 0]')]
    file.write_text(changed(named), "utf-8")
    assert read_linkage(file).Inputs().press_force == pytest.approx(2500.0, rel=1e-15)
    file.write_text(changed([*named, ('"2.5 kN"', '"2.5 * kN"')]), "utf-8")
    with pytest.raises(InputError, match="must be a number with a unit; a parameter may be an expression"):
        read_linkage(file)
