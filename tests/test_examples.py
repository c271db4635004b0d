"""The study files of `examples/` say what their titles promise; run by the command line, as a user does. The scripts
run without a warning, of Python or of an importer."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from command import chainunit

from chainunit.reading.result_entries import ResultEntries

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
                ResultEntries(json.loads((folder / "out" / "result.json").read_text())),
                process.stdout,
                folder / "out",
            )
        return RUNS[name]

    return run


@pytest.mark.slow
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


@pytest.mark.slow
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
    """As its first lines say: the smaller motor takes a disc of 15 kg, and 3.3 s to start."""
    numbers, message, folder = result("heavy_mill")
    sizing = numbers["sizing"]
    small, chosen = (sizing["candidates"][i] for i in sizing["trade"])
    assert sizing["chosen"] == sizing["trade"][1] and chosen["motor"].startswith("IE3 4-pole 0.55 kW")
    assert small["motor"].startswith("IE3 4-pole 0.37 kW")
    assert small["flywheel"]["mass"]["value"] == pytest.approx(15.0, abs=0.5)
    assert small["checks"]["start"]["value"]["value"] == pytest.approx(3.3, abs=0.1)
    assert (
        "no flywheel on the motor shaft; " in " ".join(message.split())
        and "A flywheel, or a larger motor." in message
    )
    assert "Order of preference among drives that fit: 1. " in (folder / "result.md").read_text("utf-8")


@pytest.mark.slow
def test_the_beam_pump_gets_four_poles(result):
    """As its first line says: with 2 poles the ratio would be 375, in two gears. The motor of 11 kW uses 90.4 % of
    its rated torque. The motor of 15 kW turns at 155.64 rad/s under the mean load, and needs a ratio of 185.8: the
    nearest of R20, 180, is 3.2 % off, the nearest of R40, 190, is 2.2 % off."""
    numbers, message, _ = result("beam_pump")
    sizing = numbers["sizing"]
    chosen = sizing["candidates"][sizing["chosen"]]
    assert chosen["motor"].startswith("IE3 4-pole 15 kW")
    assert "ratio 190 (three-stage helical gear, R40)" in message
    four, two = (
        next(c for c in sizing["candidates"] if c["motor"].startswith(f"IE3 {poles}-pole {power} kW"))
        for poles, power in ((4, 11), (2, 15))
    )
    assert four["criterion"] == "margin"
    assert four["checks"]["rms_torque"]["utilisation"]["value"] == pytest.approx(0.904, abs=5e-4)
    assert two["ratio"]["value"] == 375.0 and two["gear"] == "two gear units" and two["criterion"] == "gear"


@pytest.mark.slow
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


@pytest.mark.slow
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


@pytest.mark.slow
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


@pytest.mark.slow
def test_the_worst_jam_of_the_packaged_study_with_chains_and_with_bars(tmp_path):
    """As the tutorial of the overloads prints them, beside each other."""
    bars = chainunit("study", "--example", "chain-unit", cwd=tmp_path).stdout
    printed = []
    for organ in ("chain", "two-bar"):
        (tmp_path / "mine.toml").write_text(f'organ = "{organ}"\n{bars}', "utf-8")
        chainunit("study", "mine.toml", "-o", organ, cwd=tmp_path)
        answers = ResultEntries(json.loads((tmp_path / organ / "result.json").read_text("utf-8")))["answers"]
        printed += [
            f"{max(answer[name]['value'] for answer in answers.values()):{digits}} {unit}"
            for name, digits, unit in (("crank_torque_peak", ".0f", "N m"), ("current_peak", ".2f", "A"))
        ]
    torque, current, torque_of_bars, current_of_bars = printed
    tutorial = (EXAMPLES.parent / "docs" / "tutorials" / "overloads.md").read_text("utf-8")
    assert f"{torque} at the crank and {current} of\nmotor current with chains" in tutorial
    assert f"{torque_of_bars} and {current_of_bars} with bars" in tutorial


FMUS = {
    "one_sided_overload": ("mine.toml", "-o", "mine.fmu"),
    "motor_beside_machine": ("ChamberForces", "-o", "ChamberForces.fmu"),
}
"""By script, what ``chainunit export`` writes before it."""


SCRIPTS = sorted(set(EXAMPLES.glob("*.py")) - {EXAMPLES / "measured_pump.py"})
"""The measured pump needs a recording: its tests follow below."""


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.stem)
@pytest.mark.second
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


@pytest.mark.slow
def test_a_motor_that_starts_in_star_is_closed_on_its_field(result):
    numbers, message, _ = result("star_delta")
    answers = numbers["answers"]
    short, long = (answers[name]["current_peak"]["value"] for name in ("interruption_short", "interruption"))
    assert 2.0 * short < long < 25.0 and "the motor is cut off and reclosed (short)" in message
    start = numbers["start_up"]
    # the change to delta takes more current than the start in star
    assert start["current_peak"]["value"] > 2.0 * 11.1 * 0.95
    assert start["start_time"]["value"] < 0.5


STROKE = Path(__file__).parent / "data" / "pump_stroke.csv"
HARMONICS = {1: (0.008, 0.3), 2: (0.004, 1.0), 3: (0.002, 2.0), 4: (0.001, 0.5)}
"""Amplitude and phase of the harmonics of the crank angle [rad]."""
NOISE = 0.02


def rod_of_pump(phi):
    """Place of the polished rod [in] of a beam pump with A 136, C 118, I 125.63, K 188.25, P 142.63, R 50 in: two
    circles, about the crank pin and the saddle bearing."""
    pin, saddle = 1j * 50.0 * np.exp(-1j * phi), complex(125.63, np.sqrt(188.25**2 - 125.63**2))
    way = saddle - pin
    along = (142.63**2 - 118.0**2 + np.abs(way) ** 2) / (2.0 * np.abs(way))
    bearing = pin + way / np.abs(way) * (along + 1j * np.sqrt(142.63**2 - along**2))
    return 136.0 * np.angle(saddle - bearing)


def pump_stroke(sense=1):
    """Crank angle, noise-free place and load of 200 samples, and the noise of the place."""
    turn = 2.0 * np.pi * np.arange(200) / 200.0
    phi = 0.4 + sense * turn + sum(size * np.sin(k * turn + lag) for k, (size, lag) in HARMONICS.items())
    place = rod_of_pump(phi) + 57.0
    rise = np.roll(place, -1) - np.roll(place, 1)
    load = np.round(11500.0 + 2500.0 * np.tanh(rise) + 300.0 * np.sin(5.0 * turn))
    return phi, place, load, np.sqrt(2.0) * NOISE * np.sin(np.arange(200.0) ** 2)


def rows_of(place, load):
    lines = (f"{x:.4f},{force:.0f}" for x, force in zip(place, load, strict=True))
    return "\n".join(["position [in],load [lbf]", *lines]) + "\n"


def measured_pump(folder, *arguments):
    command = [sys.executable, "-W", "error", EXAMPLES / "measured_pump.py", *arguments]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True)


def numbers_of(pattern, text):
    return [float(number) for number in re.search(pattern, text).groups()]


@pytest.mark.parametrize("case", ["as stored", "forwards", "counter-clockwise"])
def test_a_measured_pump_gives_back_what_was_put_in(case, tmp_path):
    """The stored stroke runs backwards in time, as a real one does."""
    sense = -1 if case == "counter-clockwise" else 1
    phi, place, load, noise = pump_stroke(sense)
    file = STROKE
    if case == "as stored":
        stored = np.loadtxt(file, delimiter=",", skiprows=1).T
        np.testing.assert_allclose(stored, np.array([place + noise, load])[:, ::-1], rtol=0.0, atol=1.0e-4)
    else:
        file = tmp_path / "stroke.csv"
        file.write_text(rows_of(place + noise, load))
    process = measured_pump(tmp_path, file)
    assert process.returncode == 0 and not process.stderr, process.stderr
    assert ("backwards in time" in process.stdout) == (case == "as stored")
    assert f"crank {'counter-' * (sense < 0)}clockwise, " in process.stdout
    (other,) = numbers_of(r"other sense: (\S+) in", process.stdout)
    steady, share = numbers_of(r"steady crank: (\S+) in RMS, (\S+) % of", process.stdout)
    finer, _ = numbers_of(r"four harmonics: (\S+) in RMS, (\S+) % of", process.stdout)
    measured, computed = numbers_of(r"stroke (\S+) in measured, (\S+) in computed", process.stdout)
    turn = sense * 2.0 * np.pi * np.arange(200) / 200.0
    least = min(np.std(place + noise - rod_of_pump(start + turn)) for start in np.arange(0.35, 0.45, 2e-4))
    assert steady == pytest.approx(least, abs=1e-3) and share == pytest.approx(least / 1.2014, abs=0.01)
    assert other > 8.0 * steady
    # ten values are fitted to 200 samples
    assert finer == pytest.approx(NOISE * np.sqrt(0.95), rel=0.1)
    assert computed == pytest.approx(np.ptp(rod_of_pump(np.linspace(0.0, 7.0, 20001))), abs=6e-3)
    assert measured == pytest.approx(computed, abs=0.15)
    sizes = numbers_of(r"angle: \[" + r"(\S+) +" * 3 + r"(\S+)\]", process.stdout)
    assert np.radians(sizes) == pytest.approx([size for size, _ in HARMONICS.values()], abs=3e-4)
    # the torque factor is the slope of the rod's place over the crank angle
    torque = load * (rod_of_pump(phi + 1e-5) - rod_of_pump(phi - 1e-5)) / 2e-5
    least, most, gap = numbers_of(r"torque (\S+) to (\S+) lbf in; .*: (\S+) off", process.stdout)
    assert (least, most) == pytest.approx((np.min(torque), np.max(torque)), rel=3e-3) and gap < 1e-13
    assert (tmp_path / "measured_pump.png").exists()


@pytest.mark.stages(second=2)
@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, "the following arguments are required: file"),
        ("x,y\n1,2\n", "the columns are ['x', 'y']"),
        ("", "the columns are []"),
        ("position [in],load [lbf]\n1,2\n", "40 samples or more"),
        ("position [in],load [lbf]\n" + 50 * "1\n", "all of them numbers"),
        ("position [in],load [lbf]\n1,two\n", "could not convert string to float: 'two'"),
    ],
)
def test_a_measured_pump_says_what_it_needs(text, message, tmp_path):
    if text is not None:
        (tmp_path / "stroke.csv").write_text(text)
    process = measured_pump(tmp_path, *(["stroke.csv"] if text is not None else []))
    assert process.returncode == 2 and "Traceback" not in process.stderr and not process.stdout
    assert message in process.stderr
    for part in ("CSV", '"position [in]"', '"load [lbf]"', "dynamometer survey", "A, C, I, K, P and R"):
        assert part in process.stderr
