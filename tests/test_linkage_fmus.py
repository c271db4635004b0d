"""The FMUs of linkage files: identifiers, direct models with triads, names that say the same, who made them."""

from __future__ import annotations

import math
import pickle
import re
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from wrong_linkages import PRESS

import chainunit
from chainunit.core.engines import MATH
from chainunit.fmu.backends import export
from chainunit.fmu.description import Interface, model_description, model_description_3
from chainunit.fmu.pack import companion_files
from chainunit.fmu.pictures import drawing
from chainunit.machines.linkages.file import read_linkage
from chainunit.machines.machine import Machine
from chainunit.models import MODELS

FOLDER = Path(__file__).parents[1] / "examples" / "linkages"
FILES = sorted(FOLDER.glob("*.toml"))
KINDS = {"ModelExchange": {}, "CoSimulation": {}}


def described(model, fmi=2):
    write = model_description if fmi == 2 else model_description_3
    return write(Interface(model, {}), "{0}", KINDS, "9.9")


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_direct_parameters_stay_direct_parameters(file):
    """Those of a triad were prepared by way of pickle, which made inverse ones of them."""
    model = read_linkage(file).direct()
    p = model.with_derived(MATH, model.Parameters(J_added=0.25))
    again = pickle.loads(pickle.dumps(p))
    for each in (p, again):
        assert type(each) is model.Parameters and each.J_added == 0.25
    assert len(getattr(again, "derived", ())) == model.derived_count


@pytest.mark.parametrize(
    ("stem", "name"),
    [
        ("60 kN press", "linkage_60_kN_press"),
        ("größer", "grosser"),
        ("Žeriav-2", "Zeriav_2"),
        ("for", "linkage_for"),
        ("轧机", "linkage___"),
    ],
)
def test_a_file_of_any_name_makes_an_identifier(stem, name, tmp_path):
    file = tmp_path / f"{stem}.toml"
    file.write_text(PRESS, "utf-8")
    model = read_linkage(file)
    assert model.name == name and model.direct().name == f"{name}Direct"
    assert re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", model.name, re.ASCII)


def test_a_python_fmu_of_a_file_with_a_number_before_its_name(tmp_path):
    file = tmp_path / "60 kN press.toml"
    file.write_text(PRESS, "utf-8")
    fmu = tmp_path / "press.fmu"
    export(read_linkage(file), fmu, backend="python")
    with zipfile.ZipFile(fmu) as archive:
        root = ElementTree.fromstring(archive.read("modelDescription.xml"))
    assert root.find("CoSimulation").get("modelIdentifier").startswith("linkage_60_kN_press")


def test_the_machine_of_a_user_is_not_of_this_package(tmp_path):
    """It has the words of its file or none, its own picture, and a page with frame, signs and limits."""
    file = tmp_path / "mine.toml"
    words = {"author": "A. Bauer", "copyright": "© 2026 Bauer & Co", "license": "proprietary", "version": "B"}
    about = "[about]\n" + "".join(f'{key} = "{text}"\n' for key, text in words.items())
    file.write_text(PRESS.replace("[parameters]", f"{about}[parameters]", 1), "utf-8")
    named, unnamed = read_linkage(file), read_linkage(FOLDER / "blake_jaw_crusher.toml")
    for fmi in (2, 3):
        for model in (named, named.direct()):
            assert {key: described(model, fmi).get(key) for key in words} == words
        assert not {*words} & {*described(unnamed, fmi).keys()}
        assert described(unnamed, fmi).get("generationTool") == "chainunit 9.9"
    package = Path(chainunit.__file__).parent / "data/icons"
    icons = {file.read_bytes() for file in package.iterdir()}
    for model in (unnamed, unnamed.direct()):
        interface = Interface(model, {})
        files, sketch = companion_files(interface, "9.9", 3), model.sketch(interface.start_parameters)
        assert not {files["terminalsAndIcons/icon.png"], files["terminalsAndIcons/icon.svg"]} & icons
        ElementTree.fromstring(files["terminalsAndIcons/icon.svg"])
        page = files["documentation/index.html"].decode()
        drawn = re.search(r"<svg.*</svg>", page, re.S)[0]
        assert {*sketch.pins, *sketch.links} <= {*re.findall(r">([^<>]+)</text>", drawn)}
        assert "x points right, y up" in page and "Limits:" in page and "MIT licence" in page
    assert "A. Bauer" in companion_files(Interface(named, {}), "9.9", 2)["documentation/index.html"].decode()


def test_a_direct_model_has_the_words_of_its_file():
    """The title of the file, and the noun of its driver, in FMI 2 and 3; a packaged machine keeps its words."""
    model = read_linkage(FOLDER / "blake_jaw_crusher.toml").direct()
    assert model.description == (
        f"{model.inverse.noun}, moving by itself: from motor torque to angle, speed, acceleration and every reaction"
    )
    assert model.inverse.noun != model.inverse.name and model.inverse.driver_noun == "eccentric"
    for fmi in (2, 3):
        root = described(model, fmi)
        words = {v.get("name"): v.get("description") for v in root.find("ModelVariables")}
        assert root.get("description") == model.description
        assert words["phi"] == "motor angle; eccentric angle is phi/ratio" and words["w"] == "motor speed"
    state = model.States(phi=1.0, w=2.0)
    assert pickle.loads(pickle.dumps(state)) == state
    lift = read_linkage(FOLDER / "cylinder_lift.toml").direct()
    assert [v.description for v in lift.state_layout.variables] == [
        "way of the driver",
        "speed of the driver",
    ]
    assert lift.description.startswith(
        "Lever that a cylinder lifts, moving by itself: from force on the driver"
    )
    chain = MODELS["ChainUnit"]
    assert chain.state_layout.variables[0].description == "motor angle; crank angle is phi/ratio"
    knife = MODELS["KnifeDrive"].direct()
    assert knife.description.startswith("KnifeDrive that moves by itself: from motor torque to angle")


def test_the_pictures_of_an_fmu_show_its_start_values():
    """A crank of twice the length is twice as long in the drawing, as the scale of the rest tells."""
    model = read_linkage(FOLDER / "slider_crank_press.toml")
    for each in (model, model.direct()):
        interfaces = [Interface(each, start) for start in ({}, {"r": 0.16})]
        usual, longer = (companion_files(interface, "9.9", 3) for interface in interfaces)
        names = ("documentation/index.html", "terminalsAndIcons/icon.png", "terminalsAndIcons/icon.svg")
        assert all(usual[name] != longer[name] for name in names)
        sketch = each.sketch(interfaces[1].start_parameters)
        (x0, y0), (x1, y1) = sketch.pins["O1"], sketch.pins["A"]
        assert math.hypot(x1 - x0, y1 - y0) == pytest.approx(0.16)
        drawn = re.search(r"<svg.*</svg>", longer["documentation/index.html"].decode(), re.S)[0]
        assert drawn + "\n" == drawing(sketch)


def test_a_text_that_is_no_text_is_told(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text(PRESS.replace("[parameters]", "[about]\nauthor = 3\nowner = 'x'\n[parameters]", 1))
    with pytest.raises(chainunit.InputError) as caught:
        read_linkage(file)
    first, second = sorted(str(caught.value).splitlines())
    assert "about.author: is 3; must be a text" in first and "about.owner" in second and "author" in second


@pytest.mark.stages(first=3)
@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_outputs_that_repeat_another_one_share_its_value(file):
    """The names that share a value, and those that are always 0, by the model itself at random states. Of the values
    that are left at most a quarter is a motion that repeats another one or stands still, of the scissor
    lift more."""
    machine = Machine(read_linkage(file))
    model, (low, high) = machine.model, machine.model.span
    rng = np.random.default_rng(3)
    q = rng.uniform(low + 0.01 * (high - low), high - 0.01 * (high - low), 24)
    motion = {
        "phi": (1.7 if model.turns else 1.0) * q,
        "w": rng.uniform(-3.0, 3.0, 24),
        "a": rng.uniform(-5.0, 5.0, 24),
    }
    ratio = 1.7 if model.turns else 1.0
    machine = Machine(model, model.parameter_layout.from_names({**machine.by_name, "ratio": ratio}))
    values = {
        name: np.broadcast_to(np.asarray(value, float), q.shape)
        for name, value in machine.evaluate(motion).items()
    }
    for name, of in model.repeated.items():
        size = max(np.max(np.abs(values[of])), 1e-3)
        assert np.max(np.abs(values[name] - values[of])) < 1e-9 * size, (name, of)
        assert of not in model.repeated
    for name, value in model.constant.items():
        assert np.max(np.abs(values[name] - value)) < 1e-12, name
    left = {
        name: x for name, x in values.items() if name not in model.repeated and name not in model.constant
    }
    rest, seen = [], {}
    for name, x in left.items():
        same = next((other for other, y in seen.items() if np.allclose(x, y, rtol=1e-9, atol=1e-12)), None)
        if not re.search(r"\.(x|y|vx|vy|ax|ay|angle|w|a)$", name):
            continue
        if same or np.ptp(x) < 1e-12 * (1.0 + np.max(np.abs(x))):
            rest.append(name)
        seen[name] = x
    # arms of a scissor lift stay parallel in pairs, and so do wheels and rods: points of different links move alike
    share = {"scissor_lift": 0.4, "coupling_rods": 0.45}.get(file.stem, 0.25)
    assert len(rest) <= share * len(left), rest


def test_names_of_one_value_are_aliases():
    model = read_linkage(FOLDER / "slider_crank_press.toml")
    two, three = described(model), described(model, 3)
    references = {v.get("name"): v.get("valueReference") for v in two.iter("ScalarVariable")}
    aliases = {a.get("name"): v.get("name") for v in three.iter("Float64") for a in v.iter("Alias")}
    assert aliases == model.repeated and aliases["rod.A.vx"] == "crank.A.vx"
    assert all(references[name] == references[of] for name, of in model.repeated.items())
    assert len(set(references.values())) == len(references) - len(model.repeated)
    assert {v.get("name") for v in three.iter("Float64")} == {*references} - {*model.repeated} | {"time"}
    numbers = [v.get("valueReference") for v in three.iter("Float64")]
    assert len(numbers) == len(set(numbers))
    for root, tag in ((two, "ScalarVariable"), (three, "Float64")):
        constant = {v.get("name") for v in root.iter(tag) if v.get("variability") == "constant"}
        assert constant == {*model.constant} and "crank.O1.vx" in constant
    counted = [v.get("name") for v in two.iter("ScalarVariable")]
    unknown = {counted[int(u.get("index")) - 1] for u in two.find("ModelStructure/InitialUnknowns")}
    assert not unknown & {*model.constant} and {*model.repeated} <= unknown


def test_a_linkage_has_the_parameters_that_it_needs(tmp_path):
    crusher, press, lift = (
        read_linkage(FOLDER / f"{name}.toml")
        for name in ("blake_jaw_crusher", "slider_crank_press", "cylinder_lift")
    )
    assert not [name for name in crusher.parameter_layout.names if name.startswith("guides.")]
    assert "guides.friction" in press.parameter_layout.names
    words = {v.name: v.description for v in lift.parameter_layout.variables}
    assert "motor" not in words["ratio"] and "way" in words["ratio"]
    direct = lift.direct()
    assert "motor" not in direct.description and "angle" not in direct.description
    page = companion_files(Interface(lift, {}), "9.9", 2)["documentation/index.html"].decode()
    assert "shaft stands" not in page and "driver stands" in page
    file = tmp_path / "mine.toml"
    file.write_text((FOLDER / "blake_jaw_crusher.toml").read_text() + "\n[guides]\nfriction = 0.1\n")
    with pytest.raises(
        chainunit.InputError, match="guides: no joint of the linkage slides; leave the table out"
    ):
        read_linkage(file)


def test_the_derivative_of_an_energy_is_a_power():
    units = {
        v.get("name"): v[0].get("unit")
        for v in described(chainunit.models.MODELS["DcMotor"]).iter("ScalarVariable")
    }
    assert units["der(load_energy)"] == "W" and units["der(w)"] == "rad/s2"
