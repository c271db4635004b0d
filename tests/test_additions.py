"""The reach of a change: each kind of addition is made in a copy of the package, in the number of files that
the table of docs/architecture.md says, and used there by the program."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import wheels
import xarray as xr

import chainunit
from chainunit.reading.result_entries import ResultEntries
from chainunit.reading.text import number

pytestmark = pytest.mark.second

HERE = Path(__file__).parent / "additions"
EVENT = '''

class Sticking(Event):
    """The pusher meets more resistance for a while."""

    kind, run = "sticking", "sticking"
    words, heading = "the pusher sticks", "sticking"
    role, has_side = Role.SHOCK, False
    acts_on = ("resistance",)

    @declaration
    class Parameters(Timing):
        """Of the resistance."""

        factor: Value = quantity("1", "resistance over that of normal running", default=3.0, min=1.0)

    def signals(self, normal: Values, at: float, state: Values) -> Signals:
        """More from the begin on."""
        usual = normal["resistance"]
        return {"resistance": Profile(usual, ((at, 0.01, self.p.factor * usual),))}
'''
MEASURE = """    bearing_peak: Value = measure(
        "N",
        "force in the bearing O3, peak",
        lambda w: float(
            np.max(np.hypot(w.value("machine.output_bearing.fx"), w.value("machine.output_bearing.fy")))
        ),
        during=_ALL,
    )
"""
WARNING = """

_FORCE_OF_BEARING = warning(
    "output-bearing",
    "The bearing of the output link carries {force}, more than 10 N.",
    sizes={"N": "force"},
)
"""
WARNED = """    if (found := study.runs.answers.get(STEADY)) is not None and (found.bearing_peak or 0.0) > 10.0:
        study.findings.say(_FORCE_OF_BEARING, STEADY, force=found.bearing_peak)
"""
FIGURE = '''

@PICTURES.declare(lambda study: "machine.angle" in study.runs.series.get("start_up", ()), "output_angle.png")
def _output_angle(study: StudyRecord) -> fig.Figure:
    """The angle of the output link over time."""
    run = study.runs.series["start_up"]
    curve = fig.Curve("output link", run["time"].values, run["machine.angle"].values)
    panel = fig.Panel(fig.Axis("time", "s"), fig.Axis("angle of the output link", "rad"), (curve,))
    return fig.Figure("output-angle", "The output link", "Angle of the output link over time.", ((panel,),))
'''
STUDY = """
title = "A six-bar with a motor of another type"

[system]
machine = "SixBar"
motor = "ServoMotor"

[machine]
ratio = 10

[motor]
rotor = { J = 0.05 }

[run]
crank_speed = 15.5
settle_turns = 3

[[event]]
type = "sticking"
factor = 2
"""
LINE = """
title = "A planetary gear between motor and machine"

[planetary]
backlash = "1 deg"

[run]
settle_turns = 2
step = 0.0005

[[event]]
type = "jam"
side = "left"
"""

LIFE = """
title = "A bearing at the rocker's pin"
event = []

[run]
settle_turns = 2

[pin_life]
pin = "C rocker pivot"
C = "2 kN"
p = 3.3333
wanted = "20000 h"
"""


class House:
    """A copy of the package, and the files of it that are changed or new."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.touched = folder, []
        self.package = folder / "src" / "chainunit"
        shutil.copytree(Path(chainunit.__file__).parent, self.package)
        shutil.copytree(Path(__file__).parents[1] / "fmu", folder / "fmu")
        self.project = wheels.PROJECT.read_text("utf-8")
        wheels.install_copy(self.package.parent, self.project)

    def declare(self, **entries: str) -> None:
        """Add entry points to pyproject.toml, each by the last word of its group, and install anew."""
        for group, entry in entries.items():
            head = f'[project.entry-points."chainunit.{group}"]'
            place = self.project.index(head)
            line = self.project.index("\n", place) + 1
            self.project = f"{self.project[:line]}{entry}\n{self.project[line:]}"
        wheels.install_copy(self.package.parent, self.project)
        self.touched.append("pyproject.toml")

    @property
    def content(self) -> dict[str, bytes]:
        files = (
            path for path in self.package.rglob("*") if path.is_file() and "__pycache__" not in path.parts
        )
        return {path.relative_to(self.package).as_posix(): path.read_bytes() for path in files}

    def add(self, name: str, file: Path) -> None:
        shutil.copy(file, self.package / name)
        self.touched.append(name)

    def add_folder(self, name: str, folder: Path) -> None:
        shutil.copytree(folder, self.package / name, ignore=shutil.ignore_patterns("__pycache__"))
        self.touched.append(name)

    def insert(self, name: str, before: str, text: str) -> None:
        path = self.package / name
        whole = path.read_text("utf-8")
        assert whole.count(before) == 1 or not before
        path.write_text(whole.replace(before, text + before) if before else whole + text, "utf-8")
        self.touched.append(name)

    def run(self, *command: str, status: int = 0) -> str:
        pictures = ("--png",) if command[0] == "study" else ()
        return self.python("from chainunit.app.cli import main; main()", *command, *pictures, status=status)

    def python(self, code: str, *arguments: str, status: int = 0) -> str:
        env = os.environ | {"PYTHONPATH": str(self.package.parent)}
        call = [sys.executable, "-c", code, *arguments]
        process = subprocess.run(call, cwd=self.folder, env=env, capture_output=True, text=True)
        assert process.returncode == status, process.stderr
        return process.stderr if status else process.stdout


@pytest.fixture(scope="module")
def house(tmp_path_factory):
    return House(tmp_path_factory.mktemp("house"))


def files_of(house, add):
    before = len(house.touched)
    add()
    return len(set(house.touched[before:]))


@pytest.fixture(scope="module")
def result(house):
    """The study of the six-bar by a motor of a new type, with a new event, a new measure, a new warning and a new
    figure."""

    def machine():
        house.add("machines/six_bar.py", HERE / "six_bar.py")
        house.declare(machines='SixBar = "chainunit.machines.six_bar:SixBar"')

    def motor():
        house.add("drives/servo_motor.py", HERE / "servo_motor.py")
        house.declare(motors='ServoMotor = "chainunit.drives.servo_motor:ServoMotor"')

    def said():
        house.insert("study/remarks.py", "", WARNING)
        house.insert("study/remarks.py", "    _on_runs(study)\n", WARNED)

    assert files_of(house, machine) == 2
    assert files_of(house, motor) == 2
    assert files_of(house, lambda: house.insert("study/events.py", "", EVENT)) == 1
    line = "    speed_mean: Value = measure("
    assert files_of(house, lambda: house.insert("study/measures.py", line, MEASURE)) == 1
    assert files_of(house, said) == 1
    assert files_of(house, lambda: house.insert("report/figures.py", "", FIGURE)) == 1
    (house.folder / "mine.toml").write_text(STUDY, "utf-8")
    house.run("study", "mine.toml", "-o", "mine")
    return ResultEntries(json.loads((house.folder / "mine" / "result.json").read_text("utf-8")))


def test_a_machine_is_a_file_and_a_line_and_has_fmu_and_study(house, result):
    output = house.run("export", "SixBar", "-o", "SixBar.fmu", "--config", "mine.toml")
    assert output.startswith("SixBar.fmu: SixBar")
    assert result["machine"]["crank_length"]["value"] == 0.1 and result["status"] == "complete"
    assert list(result["pins"]["steady"]) == ["O1 crank", "A coupler", "O3 output"]
    assert result["certificate"]["start_up"]["energy_residual_share"]["value"] < 1e-4
    # the torque of normal running, by virtual work of another route: the power that is lost over the speed
    steady = result["answers"]["steady"]
    with xr.open_dataset(house.folder / "mine" / "result.nc", group="start_up") as run:
        time, losses = run["time"].values, run["machine.dissipated_power"].values
        angle = run["machine.phi0"].values / 10.0
        turn = angle >= angle[-1] - 2.0 * np.pi
        mean = np.trapezoid(losses[turn], time[turn]) / np.ptp(time[turn])
    assert steady["crank_torque_mean"]["value"] * steady["speed_mean"]["value"] == pytest.approx(
        mean, rel=0.02
    )


def test_a_motor_type_is_a_file_and_a_line(result):
    assert result["motor"]["kind"] == "ServoMotor"
    steady = result["answers"]["steady"]
    # the torque constant is 1, and the control follows the speed that is asked for
    assert steady["current_rms"]["value"] == pytest.approx(steady["motor_torque_rms"]["value"], rel=1e-9)
    assert steady["speed_mean"]["value"] == pytest.approx(15.5, rel=1e-3)


def test_an_event_is_a_class(result):
    assert result["events"]["sticking"]["type"] == "sticking"
    peaks = {run: result["answers"][run]["crank_torque_peak"]["value"] for run in ("steady", "sticking")}
    assert peaks["sticking"] > 1.1 * peaks["steady"]


def test_a_measure_is_a_field(house, result):
    for run in ("steady", "sticking"):
        peak = result["answers"][run]["bearing_peak"]["value"]
        assert peak == pytest.approx(result["pins"][run]["O3 output"]["peak"]["value"], rel=1e-12)
    assert "force in the bearing O3, peak" in (house.folder / "mine" / "report.html").read_text("utf-8")


def test_a_warning_is_a_declaration_in_the_module_that_says_it(house, result):
    (said,) = (each for each in result["warnings"] if each["code"] == "output-bearing")
    assert said["severity"] == "warning" and said["runs"] == ["steady"]
    peak = result["answers"]["steady"]["bearing_peak"]["value"]
    assert said["quantities"]["force"] == {"value": peak, "unit": "N"}
    assert f"The bearing of the output link carries {peak:.3g} N" in (
        house.folder / "mine" / "report.html"
    ).read_text("utf-8").replace("\u202f", " ")
    declared = house.python(
        "from chainunit.study.remarks import declared_remarks; print(*(x.code for x in declared_remarks()))"
    )
    assert "output-bearing" in declared.split()


@pytest.mark.slow
def test_a_figure_is_a_function_and_is_drawn_on_the_page_and_in_print(house, result):
    picture = (house.folder / "mine" / "output_angle.png").read_bytes()
    assert picture.startswith(b"\x89PNG") and len(picture) > 5000
    assert "Angle of the output link over time." in (house.folder / "mine" / "report.html").read_text("utf-8")
    # a later run takes the picture away where it has none
    command = ("study", "-o", "mine", "other.toml")
    (house.folder / "other.toml").write_text("event = []\n[run]\nsettle_turns = 0\nramp = 0.2\n", "utf-8")
    house.run(*command)
    assert not (house.folder / "mine" / "output_angle.png").exists()


@pytest.mark.slow
def test_a_part_of_the_line_is_a_file_and_a_line(house):
    """A planetary gear with stiffness, damping and backlash has its table, its FMU and its place between motor and
    machine."""

    def part():
        house.add("study/line/planetary_gear.py", HERE / "planetary_gear.py")
        house.declare(
            line='planetary_gear = "chainunit.study.line.planetary_gear:PART"',
            models='PlanetaryGear = "chainunit.study.line.planetary_gear:PlanetaryGear"',
        )

    assert files_of(house, part) == 2
    (house.folder / "line.toml").write_text(LINE, "utf-8")
    house.run("study", "line.toml", "-o", "line")
    result = ResultEntries(json.loads((house.folder / "line" / "result.json").read_text("utf-8")))
    assert result["status"] == "complete" and result["planetary"]["backlash"]["value"] == pytest.approx(
        np.pi / 180
    )
    assert list(result["fmus"]) == ["machine", "planetary", "motor"]
    assert (house.folder / "line" / "fmu" / "PlanetaryGear.fmu").is_file()
    for run in ("start_up", "jam_left"):
        shares = result["certificate"][run]
        assert {"energy_residual_share", "planetary_energy_residual_share"} <= set(shares)
        assert all(share["value"] < 1e-3 for name, share in shares.items() if "residual" in name)
    with xr.open_dataset(house.folder / "line" / "result.nc", group="start_up") as run:
        # the teeth lose contact and come back where the torque changes its sign
        twist, tau = run["planetary.twist"].values, run["planetary.driven.tau"].values
        assert np.min(twist) < -0.5 * np.pi / 180 < 0.5 * np.pi / 180 < np.max(twist)
        assert np.min(tau) < 0.0 < np.max(tau)
        assert run["planetary.driven.w"].values[-1] == pytest.approx(
            run["motor.w"].values[-1] / 5.0, rel=0.05
        )
    output = house.run("export", "PlanetaryGear", "-o", "PlanetaryGear.fmu", "--config", "line.toml")
    assert output.startswith("PlanetaryGear.fmu: PlanetaryGear")
    # the keys of the table are refused by its bounds and its rules
    (house.folder / "wrong.toml").write_text("[planetary]\nratio = 1\n[sizing]\n", "utf-8")
    refusal = house.run("study", "wrong.toml", status=2)
    assert "planetary.ratio = 1: must be > 1" in refusal and "sizing does not know its stiffness" in refusal


@pytest.mark.slow
def test_a_capability_is_a_folder_and_a_line(house):
    """The rating life of a pin by a given load rating has its table, its number on the page, its warning, its command
    and its method of `Study`."""

    def capability():
        house.add_folder("capabilities/pin_life", HERE / "pin_life")
        house.declare(capabilities='pin_life = "chainunit.capabilities.pin_life"')

    before = house.content
    assert files_of(house, capability) == 2
    changed = {name for name, text in house.content.items() if before.get(name) != text}
    outside = {name for name in changed if not name.startswith("capabilities/pin_life/")}
    assert not outside and set(before) <= set(house.content)
    (house.folder / "life.toml").write_text(LIFE, "utf-8")
    keys = house.run("keys", "pin_life")
    assert all(f"│ {key} " in keys for key in ("pin", "C", "p", "wanted"))
    assert "[pin_life]" in house.run("study", "--example", "full")
    house.run("keys", "--schema")
    schema = json.loads((house.folder / "chainunit.schema.json").read_text("utf-8"))
    assert set(schema["properties"]["pin_life"]["properties"]) == {"pin", "C", "p", "wanted"}
    house.run("study", "life.toml", "-o", "life")
    result = ResultEntries(json.loads((house.folder / "life" / "result.json").read_text("utf-8")))
    assert result["status"] == "complete"

    # the rocker swings about C by its angle, which the run has
    with xr.open_dataset(house.folder / "life" / "result.nc", group="start_up") as run:
        angle = run["machine.phi0"].values / result["machine"]["ratio"]["value"]
        run = run.sel(time=angle >= angle[-1] - 2.0 * np.pi * result["run"]["turns"]["value"])
        force = np.hypot(run["machine.pivot.fx"].values, run["machine.pivot.fy"].values)
        swing, time = np.abs(np.diff(run["machine.rocker.psi"].values)), np.ptp(run["time"].values)
    p, middle = 3.3333, 0.5 * (force[1:] + force[:-1])
    load = (np.sum(middle**p * swing) / np.sum(swing)) ** (1.0 / p)
    hours = (2000.0 / load) ** p * 1e6 / (np.sum(swing) / (2.0 * np.pi) / time) / 3600.0
    found = result["pin_life"]
    assert found["load"]["value"] == pytest.approx(load, rel=1e-3)
    assert found["life"]["value"] / 3600.0 == pytest.approx(hours, rel=4e-3)
    assert found["life"]["value"] < found["wanted"]["value"] == 7.2e7
    said = next(warning for warning in result["warnings"] if warning["code"] == "pin-life")
    page, text = ((house.folder / "life" / name).read_text("utf-8") for name in ("report.html", "result.md"))
    shown = number(found["life"]["value"], "s", "hours")
    for written in (page, text):
        assert "Rating life of a pin" in written and shown in written and said["text"] in written

    # the same by the command, whose exit status says that the life is too short, and from Python
    assert "Traceback" not in house.run("pin-life", "life.toml", "-o", "alone", status=1)
    alone = json.loads((house.folder / "alone" / "pin_life.json").read_text("utf-8"))["pin_life"]
    assert alone == found
    assert shown in (house.folder / "alone" / "pin_life.md").read_text("utf-8")
    code = "from chainunit import Study; r = Study.from_file('life.toml').pin_life();"
    code += " print(r); print(r.found.numbers.life)"
    *said, life = house.python(code).splitlines()
    assert float(life) == pytest.approx(found["life"]["value"], rel=1e-9)
    assert shown in " ".join(said)
    (house.folder / "other.toml").write_text(LIFE.replace("C rocker pivot", "C rocker pivo"), "utf-8")
    assert 'pin_life.pin = "C rocker pivo": is no turning pin' in house.run("study", "other.toml", status=2)
    (house.folder / "bare.toml").write_text("event = []\n", "utf-8")
    foreign = '[system]\nmachine = "life/fmu/ChamberForces.fmu"\n[pin_life]\npin = "C"\nC = 1\n'
    (house.folder / "foreign.toml").write_text(foreign, "utf-8")
    assert "pin_life: needs the bearings of the machine" in house.run("study", "foreign.toml", status=2)
    assert "has no table [pin_life]" in house.run("pin-life", "bare.toml", status=2)


@pytest.mark.slow
def test_a_capability_comes_with_a_package_of_somebody_else(tmp_path):
    """A wheel with an entry point brings table, rules, result, command and method to the installed program, of which
    no file changes."""
    name, site = "pin_life", tmp_path / "site"
    shutil.copytree(HERE / name, site / "somebody" / name)
    (site / "somebody" / "__init__.py").write_text("")
    point = {"chainunit.capabilities": {name: f"somebody.{name}"}}
    (tmp_path / "life.toml").write_text(LIFE, "utf-8")

    def python(code: str, *arguments: str, status: int = 0) -> str:
        env = os.environ | {"PYTHONPATH": str(site)}
        call = [sys.executable, "-c", code, *arguments]
        process = subprocess.run(call, cwd=tmp_path, env=env, capture_output=True, text=True)
        assert process.returncode == status, process.stderr
        return process.stderr if status else process.stdout

    command = "from chainunit.app.cli import main; main()"
    assert "life.toml:8: pin_life: unknown key" in python(command, "study", "life.toml", status=2)
    wheels.install(site, point, "somebody")
    assert all(f"│ {key} " in python(command, "keys", name) for key in ("pin", "C", "p", "wanted"))
    wrong = LIFE.replace("C rocker pivot", "C rocker pivo")
    (tmp_path / "wrong.toml").write_text(wrong, "utf-8")
    assert 'pin_life.pin = "C rocker pivo": is no turning pin' in python(
        command, "study", "wrong.toml", status=2
    )
    assert "Traceback" not in python(command, "pin-life", "life.toml", "-o", "alone", status=1)
    alone = json.loads((tmp_path / "alone" / "pin_life.json").read_text("utf-8"))["pin_life"]
    assert 0.0 < alone["life"]["value"] < alone["wanted"]["value"] == 7.2e7
    method = "import chainunit; print(chainunit.Study.pin_life.__module__, 'PinLifeResult' in dir(chainunit))"
    assert python(method).split() == [f"somebody.{name}.study_method", "True"]
    # two packages with a capability of one name
    wheels.install(site, {"chainunit.capabilities": {name: "other"}}, "other")
    words = f"{name} of chainunit.capabilities: is declared by somebody and other; uninstall one of them"
    fault = python(command, "study", "life.toml", status=2)
    assert words in fault or words.replace("somebody and other", "other and somebody") in fault
