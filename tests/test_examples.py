"""The study files of `examples/` say what their titles promise; run by the command line, as a user does. The scripts
run without a warning, of Python or of an importer."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from command import chainunit

pytestmark = pytest.mark.second

EXAMPLES = Path(__file__).parents[1] / "examples"
RUNS = {}


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    """result.json of an example and what was printed; each runs once."""

    def run(name):
        if name not in RUNS:
            folder = tmp_path_factory.mktemp(name)
            process = chainunit("study", EXAMPLES / f"{name}.toml", "-o", "out", cwd=folder)
            # a motor that is insufficient is a run that failed
            assert process.returncode == (1 if name == "motor_rejected" else 0), process.stderr
            RUNS[name] = (
                json.loads((folder / "out" / "result.json").read_text()),
                process.stdout,
                folder / "out",
            )
        return RUNS[name]

    return run


def test_a_motor_is_picked(result):
    numbers, message, folder = result("motor_from_catalogue")
    sizing = numbers["sizing"]
    choice = sizing["candidates"][sizing["chosen"]]
    assert choice["verdict"] == "chosen" and f"Motor: {choice['motor']}" in message
    assert all(check["utilisation"]["value"] <= 1.0 for check in choice["checks"].values())
    rejected = [c for c in sizing["candidates"] if c["verdict"] == "rejected"]
    # the terminal names the first six candidates, the page all
    assert rejected and all(c["reason"] for c in rejected)
    assert all(c["motor"] in message for c in sizing["candidates"][:6])
    assert numbers["motor"]["kind"] == "InductionMotor"
    # the study goes on with it, at the speed that was asked
    steady = numbers["answers"]["steady"]
    # a ratio of the series is at most 2.5 % off, and the slip the rest of the permitted 3 %
    assert steady["speed_mean"]["value"] == pytest.approx(3.0, rel=0.03)
    assert steady["speed_ripple"]["value"] <= 0.04
    blocked = numbers["answers"]["blocked"]
    assert blocked["stall_time"]["value"] < 2.0 and 5.0 < blocked["thermal_trip_time"]["value"] < 20.0
    assert (folder / "report.html").exists()


def test_none_fits_and_the_reason_is_told(result):
    numbers, message, _ = result("motor_rejected")
    sizing = numbers["sizing"]
    assert sizing["chosen"] is None and "No motor of the catalogue fits (21 of 22 were tried" in message
    smaller = ("IE3 4-pole 0.18 kW", "IE3 4-pole 0.25 kW", "IE3 4-pole 0.37 kW")
    for i, c in enumerate(sizing["candidates"]):
        assert c["verdict"] == ("rejected" if i else "insufficient")
        # the smaller ones spare the gear, and do not start or get too hot
        too_strong = not c["motor"].startswith(smaller)
        assert ("torque of the gear" in c["reason"]) == too_strong
        assert (c["checks"]["gear_start"]["utilisation"]["value"] > 1.0) == too_strong
    # all that was asked is run with the nearest
    assert {"steady", "jam_left", "jam_right"} <= set(numbers["answers"]) and "insufficient" in message


@pytest.mark.slow
def test_the_heavy_mill_is_ordered_without_a_flywheel(result):
    """As its first lines say: the smaller motor takes a disc of 29 kg, and 8 s to start."""
    numbers, message, folder = result("heavy_mill")
    sizing = numbers["sizing"]
    small, chosen = (sizing["candidates"][i] for i in sizing["trade"])
    assert sizing["chosen"] == sizing["trade"][1] and chosen["motor"].startswith("IE3 4-pole 0.75 kW")
    assert small["motor"].startswith("IE3 4-pole 0.55 kW")
    assert small["flywheel"]["mass"]["value"] == pytest.approx(29.0, abs=1.0)
    assert small["checks"]["start"]["value"]["value"] == pytest.approx(8.0, abs=0.5)
    assert "no flywheel; " in message and "A flywheel, or a larger motor." in message
    assert "Order of preference among drives that fit: 1. " in (folder / "result.md").read_text("utf-8")


@pytest.mark.slow
def test_the_beam_pump_gets_four_poles(result):
    """As its first line says: with 2 poles the ratio would be 375, in two gears."""
    numbers, message, _ = result("beam_pump")
    sizing = numbers["sizing"]
    assert "ratio 185 (three-stage helical gear, R80)" in message
    (two,) = (c for c in sizing["candidates"] if c["motor"].startswith("IE3 2-pole 11 kW"))
    assert two["ratio"]["value"] == 375.0 and two["gear"] == "two gear units" and two["criterion"] == "gear"


def test_the_jam_trips_the_coupling(result):
    numbers, message, folder = result("jam_trips_coupling")
    jam, feed = numbers["answers"]["jam_left"], numbers["answers"]["feed_left"]
    assert 0.0 < jam["coupling_trip_time"]["value"] < 0.1 and jam["energy_after_trip"]["value"] > 0.0
    assert jam["standstill_time"]["value"] > jam["coupling_trip_time"]["value"]
    assert (
        feed["coupling_trip_time"]["value"] is None and "The torque limiter opens after the event" in message
    )
    assert jam["crank_torque_peak"]["value"] > 350.0
    random = numbers["monte_carlo"]
    assert random["runs"]["value"] == 50 and 0.0 < random["quantiles"]["trips"]["share"]["value"] < 1.0
    assert (folder / random["file"]).exists()
    assert len((folder / "load_cycle.csv").read_text().splitlines()) > 1000
    # its own step is short enough
    assert all(reason["topic"] != "energy" for reason in numbers["verdict"]["model"]["reasons"])


def test_the_observer_notices_what_the_coupling_does_not(result):
    """The table of docs/identification.md has these numbers."""
    numbers, message, folder = result("observer_beside_coupling")
    found = numbers["observer"]
    times = {
        run: [of[device]["time"]["value"] for device in ("torque_limiter", "current_limit", "observer")]
        for run, of in found["notices"].items()
    }
    assert times == {
        "feed_left": [None, None, pytest.approx(0.358, abs=5e-4)],
        "jam_right": [None, None, pytest.approx(0.245, abs=5e-4)],
        "hard_lump": [pytest.approx(0.013, abs=5e-4), None, None],
    }
    assert [sides["named"] for sides in found["sides"].values()] == ["left", "right", None]
    for run, device, carried in (
        ("feed_left", "observer", 1.64),
        ("feed_left", "torque_limiter", 1.67),
        ("jam_right", "observer", 10.13),
        ("hard_lump", "torque_limiter", 28.6),
    ):
        assert found["notices"][run][device]["carried"]["value"] == pytest.approx(carried, rel=5e-3)
    assert "Who notices" in message and (folder / "observer.png").exists()


def test_a_lump_swings_the_cardan_shaft(result):
    numbers, message, folder = result("jam_with_driveline")
    jam = numbers["shaft"]["jam_left"]
    assert jam["amplification"]["value"] == pytest.approx(1.5, abs=0.1)
    assert "the line's torque peaks at" in message and (folder / "driveline.png").exists()


def test_chains_run_near_their_resonance():
    """As its title says, and the sweep passes through it. The run itself, of a minute, is that of
    tests/test_study.py."""
    from chainunit.study import config

    loaded = config.load(EXAMPLES / "chains_near_resonance.toml")
    resonance = float(loaded.machine.chain_modes(loaded.feed.left, loaded.feed.right).frequency[0])
    assert 0.7 * resonance < loaded.run.crank_speed < 0.9 * resonance
    chain = loaded.table("chain")
    assert chain.sweep_lowest < 0.5 * resonance and chain.sweep_highest > 2.0 * resonance


FMUS = {
    "one_sided_overload": ("mine.toml", "-o", "mine.fmu"),
    "motor_beside_machine": ("ChamberForces", "-o", "ChamberForces.fmu"),
}
"""By script, what ``chainunit export`` writes before it."""


@pytest.mark.parametrize("script", sorted(EXAMPLES.glob("*.py")), ids=lambda script: script.stem)
def test_the_scripts_run_without_a_warning(script, tmp_path):
    if script.stem in FMUS:
        (tmp_path / "mine.toml").write_text(
            chainunit("study", "--example", "chain-unit", cwd=tmp_path).stdout
        )
        assert chainunit("export", *FMUS[script.stem], cwd=tmp_path).returncode == 0
    before = set(tmp_path.iterdir())
    command = [sys.executable, "-W", "error", script]
    process = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert process.returncode == 0, process.stderr
    # fmpy prints its warnings
    output = process.stdout + process.stderr
    assert process.stdout and "warning" not in output.lower()
    assert {file.name for file in set(tmp_path.iterdir()) - before} <= {"one_sided_overload.png"}
    if script.stem in FMUS:
        # both motors show little of what the rocker carries
        (crank, rocker, current), (one_crank, one_rocker, one_current) = (
            map(float, re.search(r"crank +(\S+) N m +rocker +(\S+) N m +current +(\S+) A", line).groups())
            for line in process.stdout.splitlines()
        )
        assert 1.6 < one_rocker / rocker < 1.75 and 1.0 < one_current / current < 1.05
        assert 0.9 < one_crank / crank < 1.0


def test_a_motor_that_starts_in_star_is_closed_on_its_field(result):
    numbers, message, _ = result("star_delta")
    answers = numbers["answers"]
    short, long = (answers[name]["current_peak"]["value"] for name in ("interruption_short", "interruption"))
    assert 2.0 * short < long < 25.0 and "the motor is cut off and reclosed (short)" in message
    start = numbers["start_up"]
    # the change to delta takes more current than the start in star
    assert start["current_peak"]["value"] > 2.0 * 11.1 * 0.95
    assert start["start_time"]["value"] < 0.5
