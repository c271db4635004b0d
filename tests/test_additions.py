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
import xarray as xr

import chainunit

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
FIGURE = '''

@PICTURES.declare(lambda study: "machine.angle" in study.runs.get("start_up", ()), "output_angle.png")
def _output_angle(s: b.Source, study: StudyRecord) -> fig.Figure:
    """The angle of the output link over time."""
    run = study.runs["start_up"]
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


class House:
    """A copy of the package, and the files of it that are changed or new."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.touched = folder, []
        self.package = folder / "src" / "chainunit"
        shutil.copytree(Path(chainunit.__file__).parent, self.package)
        shutil.copytree(Path(__file__).parents[1] / "fmu", folder / "fmu")

    def add(self, name: str, file: Path) -> None:
        shutil.copy(file, self.package / name)
        self.touched.append(name)

    def insert(self, name: str, before: str, text: str) -> None:
        path = self.package / name
        whole = path.read_text("utf-8")
        assert whole.count(before) == 1 or not before
        path.write_text(whole.replace(before, text + before) if before else whole + text, "utf-8")
        self.touched.append(name)

    def run(self, *command: str, status: int = 0) -> str:
        env = os.environ | {"PYTHONPATH": str(self.package.parent)}
        call = [sys.executable, "-c", "from chainunit.app.cli import main; main()", *command]
        process = subprocess.run(call, cwd=self.folder, env=env, capture_output=True, text=True)
        assert process.returncode == status, process.stderr
        return process.stderr if status else process.stdout


@pytest.fixture(scope="module")
def house(tmp_path_factory):
    return House(tmp_path_factory.mktemp("house"))


def files_of(house, add):
    before = len(house.touched)
    add()
    return len(house.touched) - before


@pytest.fixture(scope="module")
def result(house):
    """The study of the six-bar by a motor of a new type, with a new event, a new measure and a new figure."""
    assert files_of(house, lambda: house.add("machines/six_bar.py", HERE / "six_bar.py")) == 1

    def motor():
        house.add("drives/servo_motor.py", HERE / "servo_motor.py")
        house.insert("drives/motors.py", "\nMOTORS:", "from .servo_motor import ServoMotor\n")
        path = house.package / "drives" / "motors.py"
        types = "(DcMotor, InductionMotor)"
        path.write_text(path.read_text("utf-8").replace(types, types[:-1] + ", ServoMotor)"), "utf-8")

    assert files_of(house, motor) == 2
    assert files_of(house, lambda: house.insert("study/events.py", "", EVENT)) == 1
    line = "    speed_mean: Value = measure("
    assert files_of(house, lambda: house.insert("study/measures.py", line, MEASURE)) == 1
    assert files_of(house, lambda: house.insert("report/figures.py", "", FIGURE)) == 1
    (house.folder / "mine.toml").write_text(STUDY, "utf-8")
    house.run("study", "mine.toml", "-o", "mine")
    return json.loads((house.folder / "mine" / "result.json").read_text("utf-8"))


def test_a_machine_is_a_file_and_has_fmu_and_study(house, result):
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


def test_a_figure_is_a_function_and_is_drawn_on_the_page_and_in_print(house, result):
    picture = (house.folder / "mine" / "output_angle.png").read_bytes()
    assert picture.startswith(b"\x89PNG") and len(picture) > 5000
    assert "Angle of the output link over time." in (house.folder / "mine" / "report.html").read_text("utf-8")
    # a later run takes the picture away where it has none
    command = ("study", "-o", "mine", "other.toml")
    (house.folder / "other.toml").write_text("event = []\n[run]\nsettle_turns = 0\nramp = 0.2\n", "utf-8")
    house.run(*command)
    assert not (house.folder / "mine" / "output_angle.png").exists()


def test_a_part_of_the_line_is_a_file_and_a_line(house):
    """A planetary gear with stiffness, damping and backlash has its table, its FMU and its place between motor and
    machine."""

    def part():
        house.add("study/line/planetary_gear.py", HERE / "planetary_gear.py")
        path = house.package / "study" / "line" / "__init__.py"
        names = 'NAMES = ("driveline",)'
        whole = path.read_text("utf-8")
        assert whole.count(names) == 1
        path.write_text(whole.replace(names, 'NAMES = ("planetary_gear", "driveline")'), "utf-8")
        house.touched.append("study/line/__init__.py")

    assert files_of(house, part) == 2
    (house.folder / "line.toml").write_text(LINE, "utf-8")
    house.run("study", "line.toml", "-o", "line")
    result = json.loads((house.folder / "line" / "result.json").read_text("utf-8"))
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
