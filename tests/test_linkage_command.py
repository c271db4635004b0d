"""A linkage file on the command line: shown, exported, and driven in a study."""

from __future__ import annotations

import json
import math
import shutil
from pathlib import Path

import fmpy
import numpy as np
import pytest
from command import chainunit
from linkage_files import MACHINES, pressed_both_ways
from reports import pictures, plain

from chainunit.core.errors import GeometryError, RemarkWarning
from chainunit.core.native.compilers import compiler
from chainunit.fmu.native.export import export
from chainunit.machines.linkages.file import linkage_in, read_linkage
from chainunit.machines.machine import Machine
from chainunit.report.blocks import Judgement, Table
from chainunit.report.lines import Name, line
from chainunit.report.linkage_report import linkage_report
from chainunit.report.motion import Animation
from chainunit.study import config
from chainunit.study.linkage_turn import linkage_findings

PRESS = Path(__file__).parents[1] / "examples" / "linkages" / "slider_crank_press.toml"


def run(*arguments, cwd, status=0):
    done = chainunit(*arguments, cwd=cwd)
    assert done.returncode == status, done.stderr
    return done


def test_the_example_is_the_reference_machine(tmp_path):
    """But for its force, which acts in one direction alone."""
    machine = Machine(read_linkage(pressed_both_ways(tmp_path)))
    for state in MACHINES["slider_crank_press"]["states"]:
        inputs = {key: state[key] for key in ("phi", "w", "a")}
        outputs = machine.evaluate({**inputs, "press_force": 2500.0})
        assert float(outputs["tau"]) == pytest.approx(state["tau"], rel=1e-11)
        assert float(outputs["guide.moment"]) == pytest.approx(
            state["reactions"]["guide"]["moment"], rel=1e-11
        )


@pytest.mark.second
def test_show(tmp_path):
    """What is shown is computed anew here, from the textbook's slider-crank and the reactions of the machine."""
    done = run("linkage", str(PRESS), "-o", "out", "--speed", "60 rpm", cwd=tmp_path)
    assert "crank + RRP dyad (rod, ram)" in done.stdout
    result = json.loads((tmp_path / "out" / "linkage.json").read_text("utf-8"))
    q = np.linspace(0.0, 2.0 * math.pi, 361)
    machine, w = Machine(read_linkage(PRESS)), 2.0 * math.pi

    def largest(size):
        """The peak of a size of the outputs, from finer places around the best degree, twice."""
        at = q[np.argmax(size(machine.outputs(q, w)))]
        for reach in (0.02, 2e-6):
            places = np.linspace(at - reach, at + reach, 40001)
            values = size(machine.outputs(places, w))
            at = places[np.argmax(values)]
        return float(np.max(values))

    for path, size in (
        (("turn", "torque_peak"), lambda out: np.abs(out.tau)),
        (("turn", "inertia_largest"), lambda out: out.J),
        (("joints", "C", "peak"), lambda out: np.hypot(out.C.fx, out.C.fy)),
        (("joints", "guide", "moment"), lambda out: np.abs(out.guide.moment)),
    ):
        entry = result
        for key in path:
            entry = entry[key]
        assert entry["value"] == pytest.approx(largest(size), rel=1e-11), path
    assert result["turn"]["energy_gap"]["value"] < 1e-13
    # the height of C, by r, l and the offset
    r, l, e = 0.08, 0.36, 0.025
    ends = [-math.sqrt((l + sign * r) ** 2 - e * e) for sign in (1.0, -1.0)]
    assert result["points"]["ram.C"]["y"]["value"] == pytest.approx(ends, rel=1e-12)
    transmission = math.sqrt(l * l - (e + r) ** 2) / l
    assert result["groups"]["rod, ram"]["margin"]["value"] == pytest.approx(transmission, rel=1e-12)
    stroke = result["strokes"]["guide"]
    assert stroke["range"] == {"value": pytest.approx(ends[1] - ends[0], rel=1e-11), "unit": "m"}
    # at a dead centre crank and rod lie on one line
    outer, inner = math.acos(e / (l + r)), math.pi - math.acos(-e / (l - r))
    assert stroke["least_at"]["value"] == pytest.approx(math.pi - inner, abs=1e-9)
    assert stroke["largest_at"]["value"] == pytest.approx(2.0 * math.pi - outer, abs=1e-9)
    assert "guide: ram along ground" in done.stdout and "0 deg │         0 deg" not in done.stdout
    page = (tmp_path / "out" / "report.html").read_text("utf-8")
    assert "Play" in page and "The linkage" in page and "The question" not in page
    assert {"linkage.svg", "linkage.png", "linkage_reactions.png", "linkage_stroke.png", "linkage.md"} <= {
        each.name for each in (tmp_path / "out").iterdir()
    }
    assert (tmp_path / "out" / "linkage_copy.toml").read_text("utf-8") == PRESS.read_text("utf-8")


@pytest.mark.second
@pytest.mark.parametrize("direct", [False, True])
def test_export(tmp_path, direct):
    run("export", str(PRESS), "-o", "press.fmu", *(["--direct"] if direct else []), cwd=tmp_path)
    description = fmpy.read_model_description(str(tmp_path / "press.fmu"))
    assert description.modelName == "slider_crank_press" + "Direct" * direct
    names = {v.name for v in description.modelVariables}
    assert {"r", "l", "offset", "ram.mass", "press_force", "guide.moment", "ram.T.y"} <= names
    assert ("tau_bias_dphi" in names) is not direct


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("export", "nope.toml"), "nope.toml: cannot be read"),
        (("export", "ChamberForce"), 'was "ChamberForces" meant?'),
        (("export", "ChamberForces", "--direct"), "direct: is of linkage files"),
        (("linkage", "nope.toml"), "nope.toml: cannot be read"),
        (
            ("linkage", str(PRESS), "--speed", "60 mm"),
            '--speed "60 mm": mm is a length; must be a speed in rev/min, rad/s, Hz or rpm',
        ),
        (
            ("linkage", str(PRESS), "--speed", "60 furlong"),
            "furlong is no known unit; must be a speed in rev/min",
        ),
        (("linkage", str(PRESS), "--speed", "0"), "must be > 0"),
        (
            ("linkage", str(PRESS), "--speed", "60"),
            '--speed 60: has no unit; give it as "60 rev/min" or "60 rad/s"',
        ),
        (("linkage", str(PRESS.with_name("tipper.toml")), "--speed", "60"), 'as "60 m/s" or "60 mm/s"'),
    ],
)
def test_wrong_input(tmp_path, arguments, words):
    done = run(*arguments, cwd=tmp_path, status=2)
    assert words in done.stderr and not list(tmp_path.iterdir())


STUDY = """
[machine]
linkage = "slider_crank_press.toml"
ratio = 20
r = "75 mm"
[run]
crank_speed = "60 rpm"
"""


def test_a_study_takes_the_machine_both_ways(tmp_path):
    shutil.copy(PRESS, tmp_path)
    source = str(tmp_path / "mine.toml")
    one = config.parse(STUDY, source)
    other = config.parse(
        STUDY.replace('linkage = "slider_crank_press.toml"\n', "")
        + '[system]\nmachine = "slider_crank_press.toml"',
        source,
    )
    assert one.machine.model is other.machine.model
    assert one.machine.by_name == other.machine.by_name and one.machine.by_name["r"] == 0.075


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (('"slider_crank_press.toml"', '"press.txt"'), "must be the name of a linkage file"),
        (('"slider_crank_press.toml"', '"other.toml"'), "other.toml: cannot be read"),
        (('r = "75 mm"', "q = 1"), "machine.q: unknown key"),
        (('r = "75 mm"', 'r = "1 m"'), "r = 1 m: must be"),
        (("[run]", '[system]\nmachine = "KnifeDrive"\n[run]'), "take one of both out"),
    ],
)
def test_wrong_machines_of_a_study(tmp_path, change, words):
    shutil.copy(PRESS, tmp_path)
    (tmp_path / "mine.toml").write_text(STUDY.replace(*change), "utf-8")
    done = run("study", "mine.toml", cwd=tmp_path, status=2)
    assert words in done.stderr, done.stderr


def test_lengths_that_do_not_close_say_where():
    with pytest.raises(GeometryError, match=r"rod, ram cannot close at .* deg of crank: .*l = 0.1 m"):
        Machine(read_linkage(PRESS), {"l": 0.1})


@pytest.mark.skipif(compiler() is None, reason="no C compiler")
def test_a_native_fmu_refuses_lengths_that_do_not_close(tmp_path, capsys):
    """Although it closes at the start angle. fmpy prints the message; a logger of this test's own would stay with
    fmpy when it is gone, and the next FMU of this process that tells something would call it."""
    file = export(read_linkage(PRESS), tmp_path / "press.fmu")
    with pytest.raises(Exception, match="InitializationMode failed"):
        fmpy.simulate_fmu(
            str(file), stop_time=0.01, start_values={"l": 0.1, "phi": 1.0}, fmi_type="CoSimulation"
        )
    assert "least margin of the group of rod, ram" in capsys.readouterr().out


GATE = """
[ground]
H = [0, 0]
G = ["-50 mm", "-350 mm"]
[driver]
link = "gate"
range = ["-80 deg", "80 deg"]
[links.gate]
points = { H = [0, 0], S = ["300 mm", 0], handle = ["1 m", 0] }
mass = 25
centroid = ["500 mm", 0]
[links.tube]
points = { G = [0, 0], G2 = [1, 0] }
[links.rod]
points = { S = [0, 0] }
[joints.gas]
on = "rod.S"
by = "tube.G"
toward = "G2"
angle = 0
[loads.up]
type = "follower"
on = "rod.S"
force = [700, 0]
[loads.down]
type = "follower"
on = "tube.G"
force = [-700, 0]
[start]
angles = { tube = "45 deg" }
"""


ABSURD = """
gravity = 9810
[parameters]
heavy = 50000
span = "600 mm"
[inputs]
pull = { value = "2000 kN", description = "load of the rocker" }
[ground]
O1 = [0, 0]
O2 = [600, "400 mm"]
[driver]
link = "crank"
[links.crank]
points = { O1 = [0, 0], A = ["50 mm", 0] }
mass = "2500 kg"
inertia = "800 kg mm2"
centroid = [20, 0]
[links.coupler]
points = { A = [0, 0], B = ["span", 0] }
bar = { from = "A", to = "B", area = 600, density = 7.85 }
[links.rocker]
points = { O2 = [0, 0], B = ["400 mm", 0] }
masses = { B = "heavy" }
[pins]
friction = 2
diameter = 60
[loads.spring]
type = "spring"
on = "rocker.B"
by = "ground.O1"
stiffness = "3 N/mm"
length = 250
[loads.pulling]
on = "rocker.B"
force = ["pull", 0]
[start]
points = { B = [600, 0] }
"""


def test_absurd_values_of_a_linkage_are_doubted(tmp_path):
    """Each once: without a unit with the size that was probably meant, with one in a note. What a study replaces is
    doubted in the study."""
    file = tmp_path / "absurd.toml"
    file.write_text(ABSURD.replace("O2 = [600", 'O2 = ["600 mm"'), "utf-8")
    _, unusual = linkage_in(file)
    assert {(value.name, value.meant) for value in unusual} == {
        ("gravity", "9810 mm/s2"),
        ("parameters.heavy", "50000 g"),
        ("inputs.pull", None),
        ("links.crank.inertia", None),
        ("links.crank.centroid", "20 mm"),
        ("links.coupler.bar.area", "600 mm2"),
        ("links.coupler.bar.density", "7.85 g/cm3"),
        ("pins.friction", None),
        ("pins.diameter", "60 mm"),
        ("loads.spring.length", "250 mm"),
        ("start.points.B", "600 mm"),
    }
    with pytest.warns(RemarkWarning) as warned:
        machine = Machine(read_linkage(file))
    assert len(warned) == len(unusual) - 2
    report = linkage_report(linkage_findings(machine, 1.0), file.name, unusual)
    shown = plain(report)
    for value in unusual:
        assert shown.count(f"{value.name} = ") == 1, value
    (question,) = [each for each in report.opening if isinstance(each, Judgement)]
    assert len(question.items) == len(unusual) - 2
    study = f'[machine]\nlinkage = "{file}"\n[feed]\npull = "3000 kN"\n[run]\ncrank_speed = 3'
    in_study = config.parse(study).file.unusual
    assert {value.name for value in in_study} == {
        "feed.pull" if value.name == "inputs.pull" else value.name for value in unusual
    }


def test_a_length_without_a_unit_is_doubted_though_the_linkage_is_refused(tmp_path):
    """[600, 400] is 600 m; the linkage cannot close."""
    (tmp_path / "absurd.toml").write_text(ABSURD, "utf-8")
    done = run("linkage", "absurd.toml", cwd=tmp_path, status=2)
    assert "absurd.toml:10: ground.O2 = 600 m: is unusual" in done.stderr
    assert 'was "600 mm" meant?' in done.stderr


def test_no_machine_of_the_gallery_is_doubted():
    files = sorted(PRESS.parent.glob("*.toml"))
    assert len(files) > 10 and all(not linkage_in(file)[1] for file in files)


def test_a_load_at_a_pin_moves_with_the_pin(tmp_path):
    """The pictures have a point of a link that lies in a pin under the name of the pin. Names of links and points
    keep their letters, in tables of the page, too."""
    (tmp_path / "gate.toml").write_text(GATE, "utf-8")
    made = linkage_report(linkage_findings(Machine(read_linkage(tmp_path / "gate.toml")), 1.0), "gate.toml")
    blocks = [each for section in made.sections for each in section.blocks]
    (animation,) = [each for each in blocks if isinstance(each, Animation)]
    (run,) = pictures(animation)["runs"]
    at = {force["title"]: force["at"] for force in run["forces"]}
    assert at["down"] == "G" and at["up"] == "rod.S" and set(at.values()) <= set(run["joints"])
    names = {row.cells[0] for each in blocks if isinstance(each, Table) for row in each.rows}
    assert {Name("gate"), Name("tube.G2"), line(Name("gas"), ": rod along tube")} <= names


def test_a_least_margin_stands_at_zero(tmp_path):
    """Of a double rocker whose least transmission angle lies at phi = 0."""
    (tmp_path / "rocker.toml").write_text(
        """
[ground]
O1 = [0, 0]
O2 = ["500 mm", 0]
[driver]
link = "left"
range = ["-70 deg", "70 deg"]
[links.left]
points = { O1 = [0, 0], A = ["300 mm", 0] }
mass = 3
[links.bar]
points = { A = [0, 0], B = ["200 mm", 0] }
[links.right]
points = { O2 = [0, 0], B = ["320 mm", 0] }
[start]
phi = "50 deg"
points = { B = ["300 mm", "250 mm"] }
""",
        "utf-8",
    )
    (group,) = linkage_findings(Machine(read_linkage(tmp_path / "rocker.toml")), 1.0).groups.values()
    assert group.margin == pytest.approx(0.6) and group.margin_at == 0.0


@pytest.mark.second
def test_a_driver_that_slides_is_shown_there_and_back(tmp_path):
    """Friction adds to the force of a lift on its way up, and carries a part of it on the way down."""
    done = run(
        "linkage", str(PRESS.with_name("scissor_lift.toml")), "-o", "out", "--speed", "0.05 m/s", cwd=tmp_path
    )
    assert "there and back over its range" in done.stdout and "Reactions, on the way back" in done.stdout
    result = json.loads((tmp_path / "out" / "linkage.json").read_text("utf-8"))
    machine = Machine(read_linkage(PRESS.with_name("scissor_lift.toml")))
    for part, w in ((result, 0.05), (result["back"], -0.05)):
        q, tau = (
            np.array(result["over_the_way"]["driver"]["value"]),
            np.array(part["over_the_way"]["tau"]["value"]),
        )
        assert tau == pytest.approx(machine.outputs(q, w).tau, rel=1e-12)
        held = np.interp(
            q, *(np.array(result["rest"]["over_the_way"][k]["value"]) for k in ("driver", "holding"))
        )
        assert np.all((tau - held) * w > 0.0)
