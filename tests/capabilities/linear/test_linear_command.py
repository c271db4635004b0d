"""The command `chainunit linearize`: its files, its page, its refusals."""

from __future__ import annotations

import io
import json
import re
from pathlib import Path

import numpy as np
import pytest
from command import chainunit
from rich.console import Console

from chainunit import Study, linearize
from chainunit.report import blocks, terminal

pytestmark = pytest.mark.second

EXAMPLES = Path(__file__).parents[3] / "examples"
DRIVE = EXAMPLES / "jam_with_driveline.toml"
PAIRS = "motor.w_ref:motor.w, machine.left.material_mass:machine.tau"


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """The folder of the linear model of a drive in its start, and the words on the terminal."""
    folder = tmp_path_factory.mktemp("linear")
    run = chainunit("linearize", DRIVE, "--at", "start_up:0.4 s", "--pairs", PAIRS, "-o", "out", cwd=folder)
    assert run.returncode == 0, run.stderr
    return folder, run.stdout


def test_the_files_hold_the_linear_model(done):
    folder, _ = done
    own = linearize(Study.from_file(DRIVE), "start_up:0.4 s")
    data = json.loads((folder / "out" / "linear.json").read_text())
    stored = np.load(folder / "out" / "linear.npz", allow_pickle=False)
    for name in "ABCD":
        np.testing.assert_array_equal(stored[name], getattr(own, name))
        np.testing.assert_array_equal(data["matrices"][name], getattr(own, name))
    for letter, kind in (("x", "states"), ("u", "inputs"), ("y", "outputs")):
        signals = getattr(own, kind)
        assert stored[f"{letter}_names"].tolist() == [each["name"] for each in data[kind]]
        assert [each["name"] for each in data[kind]] == [each.name for each in signals]
        assert stored[f"{letter}_units"].tolist() == [each["value"]["unit"] for each in data[kind]]
        np.testing.assert_array_equal(stored[letter], [each.value for each in signals])
        np.testing.assert_array_equal([each["value"]["value"] for each in data[kind]], stored[letter])
    np.testing.assert_array_equal(stored["dx"], [each["rate"]["value"] for each in data["states"]])
    speed = next(each for each in data["states"] if each["name"] == "motor.w")
    assert speed["rate"]["unit"] == "rad/s2" and speed["unit"] == "rad/s"
    assert data["at"] == "start_up, t = 0.4 s" and data["source"] == str(DRIVE)


def test_the_responses_are_those_of_the_matrices(done):
    folder, _ = done
    data = json.loads((folder / "out" / "linear.json").read_text())
    stored = np.load(folder / "out" / "linear.npz")
    names = stored["u_names"].tolist(), stored["y_names"].tolist()
    first, second = data["responses"]
    assert (first["to"], first["of"], first["unit"]) == ("motor.w_ref", "motor.w", "1")
    assert (second["to"], second["gain"]["unit"]) == ("machine.left.material_mass", "N.m/kg")
    for each in (first, second):
        column, row = names[0].index(each["to"]), names[1].index(each["of"])
        for k in (0, 200, -1):
            w = each["frequency"]["value"][k]
            inside = np.linalg.solve(1j * w * np.eye(len(stored["A"])) - stored["A"], stored["B"][:, column])
            value = stored["C"][row] @ inside + stored["D"][row, column]
            assert each["gain"]["value"][k] == pytest.approx(abs(value), rel=1e-9)
            assert np.exp(1j * each["phase"]["value"][k]) == pytest.approx(value / abs(value), abs=1e-9)
    # the speed follows its reference slowly, and does not fast
    assert first["gain"]["value"][0] == pytest.approx(1.0, abs=0.02) and first["gain"]["value"][-1] < 0.01


def test_the_poles_are_printed_and_shown(done):
    folder, printed = done
    data = json.loads((folder / "out" / "linear.json").read_text())
    assert "Poles, the slowest first" in printed and "motor.armature.i" in printed
    line = next(pole for pole in data["poles"] if pole["state"] == "driveline.driven.phi")
    assert line["imaginary"]["value"] > 10.0 and line["damping_ratio"]["unit"] == "1"
    assert f"{line['natural_frequency']['value']:.2f} rad/s" in printed
    page, text = ((folder / "out" / name).read_text() for name in ("report.html", "linear.md"))
    for said in ("Frequency response of motor.w by motor.w_ref", "natural frequency"):
        assert said in page and said in text
    assert sorted(path.name for path in (folder / "out").glob("*.png")) == ["bode_1.png", "bode_2.png"]


def test_the_page_has_the_title_of_the_study(done, tmp_path):
    """Not that of the compiled system, which every study has; of a linkage the title of its file, and of a model by
    its name that name."""
    folder, _ = done
    data = json.loads((folder / "out" / "linear.json").read_text())
    title = "A lump, with a cardan shaft between gear and crank"
    assert (data["title"], data["model"]) == (title, "System")
    assert f"<h1>Linear model: {title}</h1>" in (folder / "out" / "report.html").read_text()
    own = linearize(Study.from_file(DRIVE), "start_up:0.4 s")
    assert own.title == title and own.state_space().name == "System"
    press = linearize(EXAMPLES / "linkages" / "slider_crank_press.toml")
    assert press.title == "Slider-crank press with an offset guide"
    assert linearize("DcMotor").title == "DcMotor"


def test_texts_in_a_table_of_numbers_begin_at_the_left(done):
    """The descriptions on the page; names are at the left, values at the right as before."""
    page = (done[0] / "out" / "report.html").read_text()
    (head,) = set(re.findall(r'<th scope="col"[^>]*>description</th>', page))
    assert 'class="text"' in head and '<td class="text">' in page
    css = re.search(r"table[.]numbers td[.]text[^}]*", page)[0]
    assert "text-align: left" in css
    stream = io.StringIO()
    columns = (blocks.Column("name"), blocks.Column("words", of_text=True), blocks.Column("value"))
    rows = tuple(blocks.TableRow(row) for row in (("a", "short", "1"), ("b", "a longer text", "12345.6")))
    terminal._show_table(blocks.Table(rows, columns), Console(file=stream, width=80), {})
    first = next(line for line in stream.getvalue().splitlines() if "short" in line)
    assert re.fullmatch(r"│ a    │ short         │       1 │", first), first


def test_a_later_model_replaces_all_files(tmp_path):
    for pairs in (["--pairs", "w_ref:w,load.tau_bias:w"], ["--pairs", "tau_ff:i_ref"], []):
        run = chainunit("linearize", "DcMotor", *pairs, cwd=tmp_path)
        assert run.returncode == 0, run.stderr
        count = pairs[1].count(":") if pairs else 0
        assert len(list((tmp_path / "linear").glob("bode_*.png"))) == count
    kept = {path.name for path in (tmp_path / "linear").iterdir() if path.name[0] != "."}
    assert kept == {"linear.json", "linear.npz", "linear.md", "report.html", "provenance.json"}


def test_models_without_states_and_a_pair_without_effect(tmp_path):
    file = EXAMPLES / "linkages" / "slider_crank_press.toml"
    run = chainunit(
        "linearize", file, "--inverse", "--at", "phi=30 deg, w=10 rpm", "--pairs", "a:tau", cwd=tmp_path
    )
    assert run.returncode == 0 and "no states" in run.stdout, run.stderr
    data = json.loads((tmp_path / "linear" / "linear.json").read_text())
    inertia = next(each["value"]["value"] for each in data["outputs"] if each["name"] == "J")
    assert data["responses"][0]["gain"]["value"] == pytest.approx(
        [inertia] * len(data["responses"][0]["gain"]["value"])
    )
    assert data["poles"] == [] and data["matrices"]["A"] == []
    run = chainunit("linearize", "DcMotor", "--pairs", "load.phi0:w", cwd=tmp_path)
    assert run.returncode == 0 and "w does not depend on load.phi0 at this point" in run.stdout


def test_kinks_are_told(tmp_path):
    run = chainunit("linearize", "ChamberForces", "--at", "phi=0", cwd=tmp_path)
    assert run.returncode == 0 and "the slopes by it jump at this point" in run.stdout
    (bend,) = json.loads((tmp_path / "linear" / "linear.json").read_text())["bends"]
    assert (bend["by"], bend["kink"], bend["rows"]) == ("phi", True, ["margin"])


@pytest.fixture(scope="module")
def earlier(tmp_path_factory):
    """A folder with an earlier result."""
    folder = tmp_path_factory.mktemp("earlier")
    assert chainunit("linearize", "DcMotor", "--pairs", "w_ref:w", cwd=folder).returncode == 0
    return folder


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["DcMotor", "--pairs", "w_ref"], '--pairs "w_ref": must be INPUT:OUTPUT'),
        (["DcMotor", "--pairs", "w_ref:v_ref"], '"v_ref": no such output'),
        (["DcMotor", "--pairs", "wref:w"], '"wref": no such input'),
        (["DcMotor", "--at", "w=3 kg"], "at: w"),
        (["nothing.toml"], "nothing.toml: cannot be read"),
        (["Motor"], "Motor: no such model"),
        (["DcMotor", "--inverse"], "inverse: is of linkage files"),
    ],
)
def test_a_refusal_has_status_2_and_leaves_the_files(earlier, arguments, words):
    def content():
        return {path.name: path.read_bytes() for path in (earlier / "linear").iterdir()}

    before = content()
    run = chainunit("linearize", *arguments, cwd=earlier)
    assert run.returncode == 2 and words in run.stderr, run.stderr
    assert content() == before and "linear.npz" in before
    run = chainunit("linearize", *arguments, "-o", "fresh", cwd=earlier)
    assert run.returncode == 2 and not [*earlier.glob("fresh/*")]


def test_the_folder_of_another_result_is_refused(tmp_path):
    (tmp_path / "linear").mkdir()
    (tmp_path / "linear" / "linkage.json").write_text("{}")
    run = chainunit("linearize", "DcMotor", cwd=tmp_path)
    assert run.returncode == 2 and "a linkage" in run.stderr
