"""A surge: any input of any machine rises for a while, as an event and at random."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from command import chainunit

from chainunit.core.errors import InputError
from chainunit.machines.linkages.file import read_linkage
from chainunit.machines.machine import Machine
from chainunit.reading.result_entries import ResultEntries
from chainunit.study import config

pytestmark = pytest.mark.second

PRESS = Path(__file__).parents[1] / "examples" / "linkages" / "slider_crank_press.toml"
STUDY = """
[machine]
linkage = "slider_crank_press.toml"
ratio = 15
[system]
motor = "DcMotor"
[motor]
rotor = { J = 0.1 }
[run]
crank_speed = "60 rpm"
turns = 1
settle_turns = 2
[feed]
press_force = "2.5 kN"
[[event]]
type = "surge"
input = "press_force"
factor = 3
crank_angle = "230 deg"
duration = "0.2 s"
turns = 1
[monte_carlo]
runs = 2
event = { type = "surge", input = "press_force", factor = [1.5, 4] }
"""


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    folder = tmp_path_factory.mktemp("surge")
    shutil.copy(PRESS, folder)
    (folder / "mine.toml").write_text(STUDY, "utf-8")
    done = chainunit("study", "mine.toml", "-o", "out", cwd=folder)
    assert done.returncode == 0, done.stderr
    return folder / "out"


@pytest.mark.slow
def test_the_force_rises_and_falls_and_the_torque_follows(result):
    """The torque of the crank is that of the machine alone at the motion and the force of the run."""
    run = xr.open_datatree(result / "result.nc")["surge_press_force"]
    force = run["machine.press_force"].values
    assert force.max() == pytest.approx(7500.0) and force[0] == force[-1] == pytest.approx(2500.0)
    above = run["time"].values[force > 5000.0]
    # between the middles of rise and fall
    assert np.ptp(above) == pytest.approx(0.22, abs=0.005)
    machine = Machine(read_linkage(PRESS), {"ratio": 15.0})
    out = machine.evaluate(
        {name: run[f"machine.{ours}"].values for name, ours in
         (("phi", "phi0"), ("w", "w0"), ("press_force", "press_force"))}
    )  # fmt: skip
    assert run["machine.tau_bias"].values == pytest.approx(np.asarray(out["tau_bias"]), rel=1e-6, abs=1e-6)


@pytest.mark.slow
def test_random_surges_reach_other_processes(result):
    data = ResultEntries(json.loads((result / "result.json").read_text("utf-8")))
    assert data["status"] == "complete" and data["monte_carlo"]["runs"]["value"] == 2
    drawn = xr.open_dataset(result / data["monte_carlo"]["file"])["drawn_factor"].values
    assert len(set(drawn)) == 2 and all(1.5 <= factor <= 4.0 for factor in drawn)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (('input = "press_force"\nfactor', "factor"), "event 1 (surge): input: must be given, the name of an input"),
        (('input = "press_force"\nfactor', 'input = "press_forse"\nfactor'), 'was "press_force" meant?'),
        (('input = "press_force"\nfactor', "input = 3\nfactor"), "input = 3: must be the name of an input"),
        (('press_force = "2.5 kN"', "press_force = 0"), "press_force is 0 in normal running, and so is its multiple"),
        (('type = "surge"\ninput', 'type = "dip"\ninput'), "event 1 (dip): input: this event has none"),
    ],
)  # fmt: skip
def test_wrong_surges(tmp_path, change, words):
    shutil.copy(PRESS, tmp_path)
    with pytest.raises(InputError) as caught:
        config.parse(STUDY.replace(*change), str(tmp_path / "mine.toml"))
    assert words in str(caught.value)


@pytest.mark.parametrize("side", ["", 'side = "left"\n'])
def test_an_event_of_sides_is_refused_with_the_inputs_of_the_linkage(tmp_path, side):
    """A jam needs an organ on each side: a press has one input, and a surge lets it rise."""
    shutil.copy(PRESS, tmp_path)
    with pytest.raises(InputError) as caught:
        config.parse(
            f'[[event]]\ntype = "jam"\n{side}[system]\nmachine = "{PRESS.name}"', str(tmp_path / "a.toml")
        )
    words = 'its inputs: press_force (type = "surge" with input = "press_force" lets one rise)'
    assert words in str(caught.value) and 'must be given, "left"' not in str(caught.value)


def test_an_input_that_the_machine_has_not_is_refused_with_those_that_it_has():
    with pytest.raises(InputError) as caught:
        config.parse('[[event]]\ntype = "surge"\ninput = "left.material_mas"')
    assert (
        'has no input left.material_mas; was "left.material_mass" meant?; its inputs: left.material_mass'
        in str(caught.value)
    )
