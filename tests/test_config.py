"""Study files: a refusal is one line with the field, its value and the allowed range."""

from __future__ import annotations

import math
import re
import unicodedata
from xml.etree import ElementTree
from xml.sax.saxutils import escape

import pytest

from chainunit.core.errors import InputError
from chainunit.machines.chain_unit import Parameters
from chainunit.models import MODELS
from chainunit.reading.tables import _NO_SIGNS, text_faults, to_number
from chainunit.study.config import load, of_tables, parse
from chainunit.study.event import TYPES
from chainunit.study.events import Jam
from chainunit.study.parts import example


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


def test_a_file_is_laid_over_the_example():
    assert parse("").machine.p == load().machine.p
    assert parse("").motor == load().motor and parse("").run == load().run
    mine = parse("[machine]\nz = 0.9\ncrank = { m = 10 }\n[feed]\nleft = { material_mass = 5 }")
    assert (mine.machine.p.ratio, mine.machine.p.z, mine.machine.p.crank.m, mine.machine.p.crank.I) == (
        50,
        0.9,
        10,
        0.6,
    )
    assert (mine.feed.left.material_mass, mine.feed.left.processing_force) == (5, 10)
    assert parse("[ratios]\nzeta = 0.4").machine.p.z == pytest.approx(0.8 * load().machine.p.z)


def test_the_full_example_has_every_event():
    full = parse(example("full"))
    own = {name for name, of in TYPES.items() if of.__module__ == Jam.__module__}
    assert {event.kind for event in full.events.values()} == own - {"cut", "overload"}
    assert (
        not full.file.unusual
        and full.plate
        and full.table("driveline")
        and full.coupling
        and full.table("monte_carlo").runs
    )


@pytest.mark.parametrize("name", ["ChamberForces", "DcMotor"])
def test_the_form_that_a_refusal_shows_is_taken(name):
    model = MODELS[name]
    for layout in (model.parameter_layout, model.input_layout):
        for v in layout.variables:
            start = v.quantity.start
            unit = "" if v.unit == "1" else f" {v.unit}"
            assert to_number(v, f"{start!r}{unit}") == pytest.approx(start, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "section", "name", "value"),
    [
        ('[machine]\nr = "120 mm"', "machine", "r", 0.12),
        ('[run]\ncrank_speed = "30 rev/min"', "run", "crank_speed", math.pi),
        ('[run]\ncrank_speed = "30 rpm"', "run", "crank_speed", math.pi),
        ('[machine]\njoint_damping = "1 N*m*s"', "machine", "joint_damping", 1.0),
        ('[machine]\njoint_damping = "1 N.m.s/rad"', "machine", "joint_damping", 1.0),
        ('[run]\ncrank_speed = "0.5 rev/s"', "run", "crank_speed", math.pi),
        ("[run]\nturns = 3", "run", "turns", 3.0),
    ],
)
def test_units(text, section, name, value):
    config = parse(text)
    holder = config.machine.p if section == "machine" else getattr(config, section)
    assert getattr(holder, name) == pytest.approx(value, rel=1e-12)


def test_temperatures():
    assert pytest.approx(293.15) == parse('[motor]\nambient = { T = "20 degC" }').motor.parameters.ambient.T


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("[machine]\ncrank = { m = -3 }", "machine.crank.m = -3 kg: must be >= 0 kg and <= 1e+06 kg (mass)"),
        ("[machine]\nr = nan", "machine.r = nan m: must be finite, > 0 m and <= 10000 m (crank"),
        (
            "[feed]\nleft = { material_mass = inf }",
            "feed.left.material_mass = inf kg: must be finite, >= 0 kg",
        ),
        ('[machine]\nr = "3 kg"', 'machine.r = "3 kg": must be a number in m, or a text such as "2 mm"'),
        ('[machine]\nr = "long"', 'machine.r = "long": must be a number in m'),
        ('[machine]\nweb_share = "1 m"', 'machine.web_share = "1 m": must be a pure number'),
        ("[machine]\nweb_share = 1.5", "machine.web_share = 1.5: must be >= 0 and <= 1"),
        ("[machine]\nr = true", "machine.r = true: must be a number in m"),
        ("title = 3", "title = 3: must be a text"),
        ("feed_forward = 3", "feed_forward = 3: must be true or false"),
        ('feed_forward = "yes"', 'feed_forward = "yes": must be true or false'),
        ("empty_start = 1", "empty_start = 1: must be true or false"),
        ('organ = "belt"', 'organ = "belt": must be "two-bar" or "chain"'),
        ('[event]\ntype = "jam"', 'event = { type = "jam" }: must be a list of tables, each below [[event]]'),
        ('[report]\nunits = "imperial"', 'report.units = "imperial": must be a table'),
        ("[machine]\nradius = 1", "machine.radius: unknown key; known here: r, l, h,"),
        ("[machine]\ncrank = { q = 1 }", "machine.crank.q: unknown key; known here: m, s, I"),
        ("[machin]\nr = 1", 'machin: unknown key; was "machine" meant? known here: title, machine, ratios'),
        ("[machine]\ncrank = 3", "machine.crank = 3: must be a table"),
        ("[machine]\nr = 0.9", "machine: r = 0.9 m: the crank cannot turn"),
        ("[machine]\nz = 0.1", "machine: z = 0.1 m: the organs cannot follow the rocker over its swing"),
        ("[ratios]\nrho = 0.1\n[machine]\nr = 0.2", "machine.r: given beside [ratios]"),
        ("[ratios]\nrho = 0.6", "ratios: z = "),
        ("[ratios]\nmu = 1.0", "ratios.mu = 1: must be > 0 and <= 0.999"),
        ("[run]\nstep = 1", "run.step = 1 s: must be >= 1e-05 s and <= 0.02 s"),
        ("x =", "no valid TOML"),
        ("[machine]\nr = 1" + 5000 * "0", "no valid TOML"),
        ("[machine]\nr = 1" + 400 * "0", "machine.r: the number is too large"),
        *(
            (f'[run]\ncrank_speed = "{text}"', f'run.crank_speed = "{text}": must be a number in rad/s')
            for text in (
                "30 m",
                "rpm",
                "1/0 rpm",
                "9**9**9 rpm",
                "(3 rpm",
            )
        ),
        ('[run]\ncrank_speed = "1e400 rpm"', "run.crank_speed = inf rad/s: must be finite"),
        ('[machine]\nr = "2 rad"', 'machine.r = "2 rad": must be a number in m'),
        ("[gear]\nratio = 3", "gear: is of a motor of the catalogue; add [sizing] or system.motor"),
        ('start = "soft"', "start: is of a motor of the catalogue; add [sizing] or system.motor"),
        ("[sizing]\n[motor]\nlimit = { i = 3 }", "motor: is of the DC motor"),
        ("feed_forward = true\n[sizing]", "feed_forward: is of the DC motor"),
        ("[sizing]\n[machine]\nratio = 40", "machine.ratio: [sizing] finds it"),
        (
            "[sizing]\npoles_least = 6\npoles_most = 4",
            "sizing.poles_most = 4: must be >= sizing.poles_least, 6",
        ),
        (
            "[sizing]\ntemperature = 335\nambient = 335",
            "sizing.temperature = 335 K: must be > sizing.ambient",
        ),
        (
            "[monte_carlo]\nevent = { force = [5000, 100] }",
            "monte_carlo.event.force = [5000, 100]: the second must be >= the first",
        ),
        (
            '[monte_carlo]\nruns = 2\nevent = { force = ["3 kN", "1 kN"] }',
            'monte_carlo.event.force = ["3 kN", "1 kN"]: the second must be >= the first',
        ),
        ("[monte_carlo]\nruns = 2.7", "monte_carlo.runs = 2.7: must be a whole number"),
        (
            'event = [{ type = "lumps", side = "left", number = 1000, pause = 1e4 }]',
            "run.step = 0.001 s: the study would take",
        ),
        ("[motor]\nambient = { T = 20 }", "motor.ambient.T = 20 K: must be >= 200 K"),
        ("[motor]\nrotor = { J = -1 }", "motor.rotor.J = -1 kg m2: must be > 0 kg m2"),
        ("[motor]\narmature = { L = 1e-6 }", "motor: armature.L = 1e-06 H: the current changes faster"),
        ("[run]\ncrank_speed = 0.01\nstep = 1e-5", "run.step = 1e-05 s: the study would take"),
        ("[ratios]\nrho = 1.0", "ratios.rho = 1: must be > 0 and <= 0.999"),
        ('[machine]\nr = "a\\nb"', 'machine.r = "a\\nb"'),
        ('"x\\ny" = 1', "x\\ny: unknown key"),
        ("title = 3", "title = 3"),
    ],
)
def test_refusals(text, line):
    with pytest.raises(InputError) as caught:
        parse(text)
    assert str(caught.value).startswith(line)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("ratio", "remedy"), [("rho = 0.9", "<= 0.3069"), ("zeta = 0.001", ">= 0.1494 and <= 0.928")]
)
def test_ratios_that_make_no_machine_are_refused_with_the_range_of_the_ratio(ratio, remedy):
    with pytest.raises(InputError, match=rf"as they are, {ratio} must be {remedy}$"):
        parse(f"[ratios]\n{ratio}")
    parse(f"[ratios]\n{ratio.split()[0]} = {remedy.split()[-1]}")


def test_texts_of_a_dictionary_are_checked_as_those_of_a_file():
    """Lines and tabs are signs of a text; a character that no XML has is refused, as in a description of an FMU."""
    assert of_tables({"title": "press\tÄ €\n\U0001f600"}, "x").title
    with pytest.raises(InputError, match=r"title: .* has U\+0000, which is no sign of a text; take it out"):
        of_tables({"title": "a\0b"}, "x")


def test_every_text_that_is_read_can_stand_in_xml():
    """So that descriptions of FMUs and drawings are well-formed; nothing that people write is refused."""
    everything = "".join(map(chr, range(0x30000)))
    signs = _NO_SIGNS.sub("", everything)
    assert not text_faults({"title": signs}) and text_faults({"title": everything})
    assert ElementTree.fromstring(f"<a>{escape(signs)}</a>").text.replace("\n", "") == re.sub(
        "[\r\n]", "", signs
    )
    assert {unicodedata.category(x) for x in set(everything) - set(signs)} == {"Cc", "Cn", "Cs"}
    assert set("\t\n\r") < set(signs)


def test_every_refusal_names_the_file(tmp_path):
    file = tmp_path / "mine.toml"
    with pytest.raises(InputError, match=r"mine\.toml: cannot be read \(No such file"):
        load(file)
    file.write_bytes(b"\xff\xfe")
    with pytest.raises(InputError, match=r"mine\.toml: is not UTF-8"):
        load(file)
    file.write_text("[run]\nstep = 1")
    with pytest.raises(InputError, match=r"mine\.toml:2: run\.step"):
        load(file)


def test_the_example_can_be_copied(tmp_path):
    (tmp_path / "mine.toml").write_text(example())
    assert load(tmp_path / "mine.toml").machine.p == load().machine.p


@pytest.mark.parametrize(("name", "value"), [("r", 2.0), ("hy", 3.0), ("l1", 0.3), ("h", 0.2)])
def test_a_refused_geometry_names_the_cause_and_the_range_in_which_all_holds(name, value):
    """Whoever obeys is not refused again, and the range is no narrower than it must be."""
    with pytest.raises(InputError) as refusal:
        parse(f"[machine]\n{name} = {value}")
    match = re.search(
        rf"; with all other values as they are, {name} = {value:g} m must be (.*)$", str(refusal.value)
    )
    limits = re.findall(r"[<>]= (\S+) m", match[1])
    assert limits
    for limit in map(float, limits):
        parse(f"[machine]\n{name} = {limit}")
    beyond = min(map(float, limits), key=lambda limit: abs(limit - value))
    with pytest.raises(InputError):
        parse(f"[machine]\n{name} = {beyond + 0.002 * (value - beyond) / abs(value - beyond) * beyond}")


def test_a_refused_crank_is_refused_at_its_own_line():
    """Not at the line of c, whose range it sets."""
    with pytest.raises(InputError) as refusal:
        parse('[machine]\nc = "1.49 m"\nr = "2 m"')
    (fault,) = refusal.value.faults
    assert fault.key == "machine.r" and "must stay left of the pivot C" in str(fault)


def test_a_sought_number_outside_its_bounds_is_refused_with_them():
    name = "[[identify.parameter]]\nname = 'machine.left.web_mass'\n"
    text = f"{name}from = '40 kg'\nto = '50 kg'\ndeviation = '3 kg'\n"
    with pytest.raises(InputError, match=r"21\.6 kg, must lie between from and to, here from 40 to 50 kg"):
        parse(text)


def test_a_wrong_unit_is_named_by_its_kind():
    with pytest.raises(InputError) as refusal:
        parse('[machine]\nr = "60 kg"\n[run]\ncrank_speed = "60 mm"\nstep = "2 parsnips"')
    mass, length, unknown = refusal.value.faults
    assert str(mass).endswith("; kg is a mass") and str(length).endswith("; mm is a length")
    assert "parsnips is" not in str(unknown)


def test_a_refused_geometry_names_the_lengths_that_are_the_examples():
    """Twice some of the lengths: c and hy, which the file does not give, are why they do not fit."""
    twice = {"r": 0.3, "l": 3.0, "h": 2.0, "l1": 2.7, "l2": 1.08, "e": 1.62, "z": 1.70763}
    text = "[machine]\n" + "\n".join(f"{name} = {value}" for name, value in twice.items())
    taken = "; not in the file, so at the declared start value: c = 1.49248, hy = 1"
    with pytest.raises(InputError) as refusal:
        parse(text)
    assert str(refusal.value).endswith(
        f"{taken}; with all other values as they are, l = 3 m must be >= 1.126 m and <= 2.34 m"
    )
    # with all given, nothing is taken over
    parse(f"{text}\nc = 2.98496\nhy = 2.0")
    with pytest.raises(InputError) as refusal:
        parse(f"{text}\nc = 1.49248\nhy = 1.0")
    assert "no value fits" in str(refusal.value) and "packaged" not in str(refusal.value)


def test_a_sweep_of_chains_ends_at_twice_the_speed_or_beyond_the_resonance():
    """A fifth beyond the lowest mode, where the crank turns below it; the file's own end counts before."""

    def ends(text):
        values = parse(f'organ = "chain"\n{text}')
        modes = values.machine.chain_modes(values.feed.left, values.feed.right)
        return values.table("chain").sweep_highest, float(modes.frequency[0])

    highest, mode = ends("[run]\ncrank_speed = 1.57\n")
    assert highest == pytest.approx(1.2 * mode) and highest > 2.0 * 1.57
    assert ends("[run]\ncrank_speed = 4\n")[0] == 8.0
    assert ends("[chain]\nsweep_highest = 15\n")[0] == 15.0
