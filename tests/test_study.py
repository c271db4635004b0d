"""The main job end to end, by the command line."""

from __future__ import annotations

import json
import math
import re
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from command import chainunit
from event_tables import STANDARD, event_line
from fmpy.validation import validate_fmu
from reports import write

from chainunit import EMPTY, ChainUnitMachine, SideLoads
from chainunit.capabilities.sides.analysis import factors_for, sides_over_speed
from chainunit.capabilities.sides.factors import alone, overload_factors
from chainunit.core.files import LIST, FileList
from chainunit.machines.chain_unit import Feed
from chainunit.reading.result_entries import ResultEntries
from chainunit.reading.results import as_data
from chainunit.report import series
from chainunit.report import study as study_report
from chainunit.study.cycle import cycle
from chainunit.study.readings import only_whole_turns, turns_made

RUN = """
[run]
ramp = 0.3
settle_turns = 1
turns = 1
step = 0.004
crank_speed = 6
[machine]
ratio = 25
"""
SHORT = event_line(*STANDARD, turns=1) + RUN
ONE_JAM = event_line("jam_left", turns=1) + RUN


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    (folder / "short.toml").write_text(SHORT)
    # a picture of an earlier run
    (folder / "out dir").mkdir()
    old = folder / "out dir" / "reactions.png"
    old.write_text("old")
    FileList(old.parent).add(old, old)
    result = chainunit("study", "short.toml", "-o", "out dir", "--check", cwd=folder)
    assert result.returncode == 0, result.stderr
    return result, folder / "out dir"


def test_study_writes_numbers_series_plots_and_fmus(done):
    result, folder = done
    names = {p.name for p in folder.iterdir()}
    assert names == {
        "report.html",
        "result.json",
        "result.nc",
        "load_cycle.csv",
        "fmu",
        "result.md",
        "provenance.json",
        "study_copy.toml",
        LIST,
        *study_report.pictures(),
    } - {
        "driveline.png",
        "energy.png",
        "chain_sweep.png",
        "blade_path.png",
        "flywheel.png",
        "campbell.png",
        "stability.png",
        "resonance.png",
        "ratio.png",
        "coupling_torque.png",
        "observer.png",
        "force_over_stroke.png",
    }
    for name in ("ChamberForces", "DcMotor"):
        assert validate_fmu(str(folder / "fmu" / f"{name}.fmu")) == []
    for word in (
        "crank torque, peak",
        "Overload factor",
        "Forces in the bearings",
        "Energy residual",
        "Note:",
    ):
        assert word in result.stdout


def test_study_numbers_are_those_of_the_series(done):
    _, folder = done
    numbers = ResultEntries(json.loads((folder / "result.json").read_text()))
    assert numbers["status"] == "complete"
    with xr.open_datatree(folder / "result.nc") as tree:
        overloads = {f"{side}_empties" for side in ("left", "right")}
        overloads |= {f"{what}_{side}" for what in ("feed", "jam") for side in ("left", "right")}
        assert set(tree.children) == {"start_up"} | overloads
        for name in overloads:
            run = tree[name].to_dataset()
            event = numbers["events"][name]["begin"]["value"]
            crank = float(run["motor.phi"].interp(time=event)) / 25.0
            # the speed ripples on the way there
            assert abs((crank + math.pi) % (2 * math.pi) - math.pi) < 0.1
            after = run.sel(time=slice(event, None))
            peak = float(np.max(np.abs(after["machine.tau"]))) * 25.0
            assert numbers["answers"][name]["crank_torque_peak"] == {
                "value": pytest.approx(peak),
                "unit": "N.m",
            }
            pivot = float(np.max(np.hypot(after["machine.pivot.fx"], after["machine.pivot.fy"])))
            assert numbers["pins"][name]["C rocker pivot"]["peak"]["value"] == pytest.approx(pivot)
            assert run["machine.tau"].attrs["units"] == "N.m"
        # the start-up, to the begin of steady running
        run = tree["start_up"].to_dataset()
        steady = run["time"].values[np.searchsorted(run["time"].values, 0.3 + 2.0 * math.pi / 6.0 - 1e-9)]
        start, result = run.sel(time=slice(None, steady)), numbers["start_up"]
        assert result["crank_torque_peak"]["value"] == pytest.approx(
            25.0 * float(np.abs(start["machine.tau"]).max())
        )
        for rod in ("web", "wall"):
            least = min(float(start[f"machine.{side}.{rod}_pull"].min()) for side in ("left", "right"))
            assert result[f"{rod}_pull_least"]["value"] == pytest.approx(least)
        bearing = np.hypot(start["machine.crank_bearing.fx"], start["machine.crank_bearing.fy"])
        assert numbers["pins"]["start_up"]["O1 crank bearing"]["peak"]["value"] == pytest.approx(
            float(bearing.max())
        )
        right = tree["right_empties"]["machine.right.material_mass"].values
        assert right[0] == 30.0 and right[-1] == 0.0
        assert tree["feed_left"]["machine.left.material_mass"].values[-1] == 60.0
        assert float(tree["jam_left"]["machine.left.processing_force"].max()) == pytest.approx(2010.0)


def test_study_certifies_itself(done):
    numbers = ResultEntries(json.loads((done[1] / "result.json").read_text()))
    shares = [c["energy_residual_share"] for c in numbers["certificate"].values()]
    assert len(shares) == 7 and max(s["value"] for s in shares) < 2e-3
    # --check compares every run; a start in 0.3 s at 4 ms: 6.9e-5 at 2 ms and 1.8e-5 at 1 ms; a jam that rises in
    # 20 ms: 5.3e-4 at 4 ms, 1.7e-5 at 1 ms
    for name, certificate in numbers["certificate"].items():
        assert certificate["machine.tau_difference_to_monolithic"]["value"] < 1e-2, name
        most = 5e-4 if name == "start_up" else 1e-3
        assert certificate["motor.w_difference_to_monolithic"]["value"] < most, name
    assert "runs compared: 7" in done[0].stdout


BLOCKED = """
[run]
ramp = 0.3
settle_turns = 1
turns = 1
step = 0.002
"""


@pytest.mark.second
def test_what_blocks_the_rocker_decides_the_peak(tmp_path):
    """Peaks over a decade of the stop's stiffness, as studies with these stops give them; and --check of a stop."""
    from chainunit.study import config
    from chainunit.study.result import as_dict
    from chainunit.study.run import run_study

    study = run_study(config.parse(event_line("blocked", turns=1) + BLOCKED), tmp_path, check=True)
    assert study.findings.failure is None
    result, stop = study.runs.spreads["blocked"], study.setup.config.events["blocked"].p
    soft, stiff = result.ranges["stiffness"]
    assert stiff == pytest.approx(10.0 * soft) and soft < stop.stiffness < stiff
    low, high = result.peaks["crank_torque"]
    assert low < study.runs.answers["blocked"].crank_torque_peak < high
    damping = stop.damping * (stiff / stop.stiffness) ** 0.5
    assert result.ranges["damping"][1] == pytest.approx(damping)
    line = event_line("blocked", turns=1, stiffness=stiff, damping=damping)
    other = run_study(config.parse(line + BLOCKED), tmp_path)
    for name in ("crank_torque", "motor_torque", "rocker_torque"):
        peak = getattr(other.runs.answers["blocked"], f"{name}_peak")
        assert peak == pytest.approx(result.peaks[name][1], rel=1e-6)
    (note,) = (note for note in study.findings.notes if note.code == "assumption")
    assert note.runs == ("blocked",)
    assert "are assumed and decide the peak" in note.text and "distance from the pivot C" in note.text
    peaks = as_dict(study)["block_peaks"]["blocked"]
    assert peaks["crank_torque_low"]["unit"] == "N.m" and peaks["stiffness_high"]["value"] == stiff
    certificate = study.runs.certificate["blocked"]
    assert 0.0 < certificate["motor.w_difference_to_monolithic"] < 1e-3
    assert 0.0 < certificate["machine.tau_difference_to_monolithic"] < 1e-2
    # the power that the stop takes jumps where it comes; a rule that smears that over a step loses 1e-3
    assert certificate["energy_residual_share"] < 2e-5


def test_bad_input_ends_with_2_in_one_line_and_writes_nothing(tmp_path):
    (tmp_path / "bad.toml").write_text("[machine]\ncrank = { m = -3 }")
    (tmp_path / "dangling").symlink_to(tmp_path / "nowhere" / "at all")
    for arguments in (
        ("study", "bad.toml", "-o", "out"),
        ("study", "missing.toml", "-o", "out"),
        ("export", "ChainMill", "-o", "out/x.fmu"),
        ("export", "ChamberForces", "--config", "bad.toml", "-o", "out/x.fmu"),
        ("study", "-o", "bad.toml"),
        ("study", "-o", "bad.toml/sub"),
        ("study", "-o", "dangling"),
        ("study", "--speed", "3"),
        ("export",),
        ("grind",),
        ("export", "ChamberForces", "-o", "folder/"),
        ("export", "ChamberForces", "-o", "folder/x.txt"),
    ):
        result = chainunit(*arguments, cwd=tmp_path)
        assert result.returncode == 2, result.stderr
        assert result.stdout == "" and len(result.stderr.strip().splitlines()) == 1
        assert "Traceback" not in result.stderr
    assert {p.name for p in tmp_path.iterdir()} == {"bad.toml", "dangling"}
    assert "machine.crank.m = -3 kg: must be >= 0 kg" in chainunit("study", "bad.toml", cwd=tmp_path).stderr


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("[chain]\nrods = 8", 'chain: is of organs that are chains; add organ = "chain"'),
        ('organ = "chain"\n[chain]\nstarts = 5', "chain.starts = 5"),
        ('organ = "chain"\n[chain]\nturns = 20', "chain.turns = 20"),
        ('organ = "chain"\n[chain]\nrods = 7.5', "chain.rods = 7.5"),
        ('organ = "chain"\n[chain]\nsweep_lowest = 5\nsweep_highest = 5', "must be > chain.sweep_lowest"),
        ('organ = "rope"', "organ"),
    ],
)
def test_what_chains_are_refused(text, told):
    from chainunit.core.errors import InputError
    from chainunit.study import config

    with pytest.raises(InputError, match=re.escape(told)):
        config.parse(text)


@pytest.mark.slow
def test_a_run_that_fails_keeps_what_it_computed(tmp_path, monkeypatch):
    from chainunit.study import config
    from chainunit.study.run import run_study
    from chainunit.system.instance import Instance

    step = Instance.step

    def fails_late(self, time, h):
        if time > 3.0 and self.name == "motor":
            from chainunit import RunError

            raise RunError("motor: step at t = 3 s ended with status 3: it broke")
        step(self, time, h)

    monkeypatch.setattr(Instance, "step", fails_late)
    study = run_study(config.parse(SHORT), tmp_path)
    assert (
        "it broke" in str(study.findings.failure)
        and "start_up" in study.runs.series
        and "unfinished" in study.runs.series
    )
    write(study, tmp_path)
    assert ResultEntries(json.loads((tmp_path / "result.json").read_text()))["status"].startswith(
        "failed: motor: step"
    )
    with xr.open_datatree(tmp_path / "result.nc") as tree:
        assert {"start_up", "unfinished"} <= set(tree.children)


# the command, which tells when it is in the middle of the start-up
TELLING = """
from pathlib import Path
from chainunit.app import cli
from chainunit.system.instance import Instance

step = Instance.step

def telling(self, time, h):
    step(self, time, h)
    if time > 0.5:
        Path("running").touch()
        Instance.step = step

Instance.step = telling
cli.main()
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_ctrl_c_keeps_what_was_computed(tmp_path):
    import signal
    import time

    (tmp_path / "long.toml").write_text("[run]\nturns = 200")
    command = [sys.executable, "-c", TELLING, "study", "long.toml", "-o", "out"]
    running = subprocess.Popen(
        command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    while not (tmp_path / "running").exists():
        assert running.poll() is None
        time.sleep(0.02)
    running.send_signal(signal.SIGINT)
    _, err = running.communicate(timeout=60)
    assert running.returncode == 130, err
    assert "interrupted at t = " in err and "Traceback" not in err
    numbers = ResultEntries(json.loads((tmp_path / "out" / "result.json").read_text()))
    assert numbers["status"].startswith("failed: interrupted")
    with xr.open_datatree(tmp_path / "out" / "result.nc") as tree:
        assert len(tree["unfinished"]["time"]) > 1


def test_an_old_result_does_not_survive_a_new_run(tmp_path, done):
    (tmp_path / "out" / "result.nc").mkdir(parents=True)
    refusal = chainunit("study", "-o", "out", cwd=tmp_path)
    assert refusal.returncode == 2 and "out/result.nc: would be lost" in refusal.stderr
    _, out = done
    assert (out / "reactions.png").read_bytes()[:4] == b"\x89PNG"


@pytest.mark.slow
def test_a_motor_that_cannot_reach_the_speed_is_told(tmp_path):
    weak = ONE_JAM + "[motor]\nlimit = { v = 60 }"
    (tmp_path / "mine.toml").write_text(weak)
    result = chainunit("study", "mine.toml", "-o", "out", cwd=tmp_path)
    assert result.returncode == 1, result.stderr
    assert "in place of 6 rad/s" in result.stdout and "does not return" not in result.stdout
    numbers = ResultEntries(json.loads((tmp_path / "out" / "result.json").read_text()))
    assert numbers["answers"]["jam_left"]["recovery_time"]["value"] is None


@pytest.mark.slow
def test_no_gravity_no_organs_and_markup_in_the_title(tmp_path):
    empty = """
g = 0
left = { wall_mass = 0, web_mass = 0 }
right = { wall_mass = 0, web_mass = 0 }
[feed]
left = { material_mass = 0, processing_force = 0 }
right = { material_mass = 0, processing_force = 0 }
"""
    (tmp_path / "empty.toml").write_text('title = "[/foo] mill"\n' + SHORT + empty)
    process = chainunit("study", "empty.toml", "-o", "[red]out", cwd=tmp_path)
    assert process.returncode == 0, process.stderr
    assert "[/foo] mill" in process.stdout and "[red]out/result.json" in process.stdout
    numbers = ResultEntries(json.loads((tmp_path / "[red]out" / "result.json").read_text()))
    for side in ("left", "right"):
        assert numbers["organs"]["overload_factors"][side]["rocker_torque"]["value"] is None
    assert numbers["organs"]["limits"]["slack_speed"]["value"] is None


def test_every_number_has_its_unit(done):
    def check(node, where):
        if isinstance(node, dict) and "value" in node:
            assert node["unit"], where
        elif isinstance(node, dict):
            for name, below in node.items():
                check(below, f"{where}.{name}")
        else:
            # a flag is no number
            assert isinstance(node, bool) or not isinstance(node, float | int), where

    check(ResultEntries(json.loads((done[1] / "result.json").read_text())), "result")


def test_gains_that_are_not_given_are_tuned(tmp_path):
    from chainunit.study import config
    from chainunit.study.choice import choose

    values = config.parse("[motor]\nspeed_control = { kp = 0.2 }\narmature = { L = 0.22 }")
    motor = choose(values, tmp_path, lambda *_: None).drive.parameters
    assert motor.speed_control.kp == 0.2
    assert motor.current_control.kp == pytest.approx(0.22 * 300.0)


def test_export_with_a_config_burns_the_start_values_in(tmp_path):
    import fmpy

    (tmp_path / "mine.toml").write_text('[machine]\nr = "140 mm"\n[feed]\nleft = { material_mass = 12 }')
    result = chainunit("export", "ChamberForces", "--config", "mine.toml", "-o", "a b/x.fmu", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    starts = {
        v.name: v.start for v in fmpy.read_model_description(str(tmp_path / "a b" / "x.fmu")).modelVariables
    }
    assert float(starts["r"]) == 0.14 and float(starts["left.material_mass"]) == 12.0


@pytest.mark.second
def test_export_with_a_config_has_the_motor_of_the_study(tmp_path):
    import fmpy

    (tmp_path / "mine.toml").write_text("[run]\nstep = 0.002\n[sizing]\ncandidates = 1\npoles_most = 4\n")
    for name, parameter in (("InductionMotor", "pole_pairs"), ("ChainUnit", "ratio")):
        result = chainunit("export", name, "--config", "mine.toml", "-o", f"{name}.fmu", cwd=tmp_path)
        assert result.returncode == 0, result.stderr
        description = fmpy.read_model_description(str(tmp_path / f"{name}.fmu"))
        start = {v.name: v.start for v in description.modelVariables}
        if name == "ChainUnit":
            assert 50.0 < float(start["ratio"]) < 54.0 and float(start["w_start"]) == 3.0 * float(
                start["ratio"]
            )
        else:
            assert float(start[parameter]) == 2.0
    refusal = chainunit("export", "DcMotor", "--config", "mine.toml", "-o", "x.fmu", cwd=tmp_path)
    assert refusal.returncode == 2 and "the study's motor is InductionMotor, not DcMotor" in refusal.stderr


def test_overload_factors_are_the_erratas():
    """Errata, paper 000, item 14b: left alone to both, cycle maxima; uniform rods, no drive masses."""
    bare = {f"{body}.{x}": 0.0 for body in ("crank", "coupler", "rocker") for x in ("m", "I")}
    machine = ChainUnitMachine.from_ratios(0.1, 2 / 3, 0.6, 0.5, bare | {"pin.friction": 0.0})
    rocker, crank = {}, {}
    for speed in (1e-6, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 20.0, 50.0):
        factors = overload_factors(machine, speed, NONE)
        rocker[speed], crank[speed] = factors.rocker_torque, factors.crank_torque
    reference = {
        1e-6: (1.36, 1.9),
        5.0: (3.1, 5.3),
        10.0: (0.50, 0.80),
        20.0: (0.63, 0.53),
        50.0: (0.66, 0.57),
    }
    for speed, (on_rocker, on_crank) in reference.items():
        assert rocker[speed] == pytest.approx(on_rocker, abs=0.055 if on_rocker > 2 else 0.006)
        assert crank[speed] == pytest.approx(on_crank, abs=0.055 if on_crank > 1.5 else 0.006)
    assert rocker[6.0] > 1.0 > rocker[7.0]
    assert crank[8.0] > 1.0 > crank[9.0]


def test_cycle_and_the_side_that_is_gone():
    machine = ChainUnitMachine(ratio=7.0)
    loads = SideLoads(material_mass=10.0, processing_force=0.0)
    c = cycle(machine, 3.0, Feed(left=loads, right=EMPTY))
    out = machine.forces(7.0 * c.angle[100], 21.0, 0.0, loads, EMPTY)
    assert c.crank_torque[100] == pytest.approx(7.0 * float(out.tau))
    left = cycle(alone(machine, "left"), 3.0, Feed(left=loads, right=EMPTY))
    assert np.all(left.outputs.right.tangential_load == 0.0)


FED = (
    SideLoads(material_mass=30.0, processing_force=300.0),
    SideLoads(material_mass=20.0, processing_force=100.0),
)
FEED = Feed(left=FED[0], right=FED[1])
NONE = Feed(left=EMPTY, right=EMPTY)


def peaks(machine, speed, left, right, points):
    """Largest crank and rocker torque of a turn, straight from the machine."""
    phi = np.linspace(0.0, 2.0 * np.pi, points, endpoint=False) * machine.p.ratio
    out = machine.forces(phi, speed * machine.p.ratio, 0.0, left, right)
    return {
        "crank": np.max(np.abs(out.tau)) * machine.p.ratio,
        "rocker": np.max(np.abs(out.rocker.tau)),
    }


def test_each_side_alone_has_its_overload_factors():
    """Against the machine without the masses and the load of the other side."""
    machine = ChainUnitMachine(ratio=7.0)
    both = peaks(machine, 4.0, *FED, 720)
    results = {side: overload_factors(machine, 4.0, FEED, side) for side in ("left", "right")}
    for side, gone, loads in (("left", "right", (FED[0], EMPTY)), ("right", "left", (EMPTY, FED[1]))):
        bare = machine.replace({f"{gone}.wall_mass": 0.0, f"{gone}.web_mass": 0.0})
        one = peaks(bare, 4.0, *loads, 720)
        assert results[side].crank_torque == pytest.approx(one["crank"] / both["crank"], rel=1e-12)
        assert results[side].rocker_torque == pytest.approx(one["rocker"] / both["rocker"], rel=1e-12)
    assert results["left"] == overload_factors(machine, 4.0, FEED)
    assert abs(results["left"].rocker_torque / results["right"].rocker_torque - 1.0) > 0.05


def test_what_sizes_the_drive_is_the_feed_on_one_side_with_both_organs():
    """Against a second route to the crank torque, by the reactions and the pins' friction."""
    machine, speed = ChainUnitMachine(), 4.0
    loads = {
        "both": FED,
        "left": (SideLoads(material_mass=50.0, processing_force=400.0), EMPTY),
        "right": (EMPTY, SideLoads(material_mass=50.0, processing_force=400.0)),
    }
    phi = np.linspace(0.0, 2.0 * np.pi, 720, endpoint=False) * machine.p.ratio
    rocker = {name: peaks(machine, speed, *of, 720)["rocker"] for name, of in loads.items()}
    crank = {}
    for name, of in loads.items():
        turning = (phi, speed * machine.p.ratio)
        free = machine.torque_by_reactions(*turning, 0.0, *of)
        crank[name] = np.max(np.abs(free + machine.friction_torque(*turning, *of)))
    results = {side: overload_factors(machine, speed, FEED, side) for side in ("left", "right")}
    for side, of in results.items():
        assert of.feed_crank_torque == pytest.approx(crank[side] / crank["both"], rel=1e-9)
        assert of.feed_rocker_torque == pytest.approx(rocker[side] / rocker["both"], rel=1e-12)
    larger = max(results, key=lambda side: results[side].feed_crank_torque)
    assert factors_for(results)["feed_crank_torque"].startswith(f"feed all on the {larger} sizes the drive")
    none = {side: overload_factors(machine, speed, NONE, side) for side in results}
    assert [f.feed_crank_torque for f in none.values()] == [1.0, 1.0]
    assert factors_for(none)["feed_crank_torque"].startswith("feed on both sides sizes the drive")


def test_the_static_factor_of_the_right_organ_belongs_to_the_left_extreme():
    """The organs mirror each other: the right one at -psi is the left one at psi, with the loads exchanged."""
    machine = ChainUnitMachine()
    (right, _), (left, _) = machine.rocker_extremes()
    assert abs(left) < 0.95 * right
    for extreme, side, loads in ((right, "left", FED), (-left, "right", FED[::-1])):
        mirrored = machine.chamber(extreme, 0.0, 0.0, *loads)
        reference = mirrored.left.tangential_load / (
            mirrored.left.tangential_load - mirrored.right.tangential_load
        )
        result = overload_factors(machine, 1.0, FEED, side).static_at_extreme
        assert result == pytest.approx(float(reference), rel=1e-12)
        assert result > 1.0


def test_each_side_alone_over_the_speed():
    machine = ChainUnitMachine()
    sides = sides_over_speed(machine, FEED, highest=12.0, points=12)
    both, crossed = [peaks(machine, w, *FED, 360) for w in sides.speed], 0
    for side, gone, loads in (("left", "right", (FED[0], EMPTY)), ("right", "left", (EMPTY, FED[1]))):
        bare = machine.replace({f"{gone}.wall_mass": 0.0, f"{gone}.web_mass": 0.0})
        one = [peaks(bare, w, *loads, 360) for w in sides.speed]
        for torque in ("rocker", "crank"):
            reference = np.array([p[torque] for p in one])
            assert sides.peaks[f"{torque}_{side}"] == pytest.approx(reference, rel=1e-12)
            excess = reference - [p[torque] for p in both]
            before = np.flatnonzero(excess[1:] * excess[:-1] < 0.0)
            at = [each.value for each in sides.crossings[torque][side]]
            crossed += len(at)
            assert len(at) == len(before)
            assert np.all(sides.speed[before] < at) and np.all(at < sides.speed[before + 1])
            assert np.interp(at, sides.speed, excess) == pytest.approx(0.0, abs=1e-9)
            values = as_data(sides)["crossings"][torque][side]
            assert values == [{"value": speed, "unit": "rad/s", "kind": "speed"} for speed in at]
    assert crossed


LIGHT = "event = []\n[run]\nstep = 0.002\n"
TWICE = """
event = []
[ratios]
l = 3.0
l1 = 2.7
[machine]
ratio = 100
[feed]
left = { material_mass = 300 }
right = { material_mass = 300 }
[run]
crank_speed = "15 rev/min"
step = 0.002
"""


def ran(text, folder):
    """A study that was run in this process, with its series in `folder`."""
    from chainunit.study import config
    from chainunit.study.result import as_dict
    from chainunit.study.run import run_study

    study = run_study(config.parse(text), folder)
    series.write(study, folder)
    return study, as_dict(study)


@pytest.mark.parametrize(("text", "turns"), [(LIGHT, 1), (TWICE, 1), (LIGHT + "turns = 3\n", 3)])
@pytest.mark.second
def test_the_load_cycle_is_whole_turns_that_the_numbers_follow_from(text, turns, tmp_path):
    study, numbers = ran(text, tmp_path)
    time, speed, torque, inertia = np.loadtxt(tmp_path / "load_cycle.csv", delimiter=",", skiprows=1).T
    ratio, steady = study.setup.drive.ratio, {n: e["value"] for n, e in numbers["answers"]["steady"].items()}
    whole = time[-1]
    assert time[0] == 0.0
    assert np.trapezoid(speed, time) == pytest.approx(2.0 * math.pi * ratio * turns, rel=1e-6)
    # closed
    for x in (speed, torque, inertia):
        assert x[-1] == pytest.approx(x[0], abs=1e-3 * np.max(np.abs(x)))
    assert steady["cycle_gap"] < 1e-3
    # mean power as the work over the angle, in place of the power over the time
    angle = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(time))])
    assert np.trapezoid(torque, angle) / whole == pytest.approx(steady["power_mean"], rel=1e-4)
    assert np.trapezoid(torque, time) / whole * ratio == pytest.approx(steady["crank_torque_mean"], rel=1e-6)
    rms = math.sqrt(np.trapezoid(torque**2, time) / whole) * ratio
    assert rms == pytest.approx(steady["crank_torque_rms"], rel=1e-6)
    assert np.max(np.abs(torque)) * ratio == pytest.approx(steady["crank_torque_peak"], rel=1e-8)
    # what friction and the processing force take, by inverse dynamics at the mean speed
    ideal = study.setup.statics.cycles["both sides"].crank_torque
    assert steady["power_mean"] == pytest.approx(
        np.mean(ideal) * study.setup.config.run.crank_speed, rel=0.02
    )


@pytest.mark.second
def test_a_slow_motor_still_makes_its_turns(tmp_path):
    """At 60 V the crank turns more slowly than is asked: the run is as long as the turns take."""
    study, numbers = ran(LIGHT.replace("[run]", "[run]\ncrank_speed = 6\nturns = 2") + LOW_VOLTAGE, tmp_path)
    steady = numbers["answers"]["steady"]
    assert steady["speed_mean"]["value"] < 0.7 * 6.0
    time, speed = np.loadtxt(tmp_path / "load_cycle.csv", delimiter=",", skiprows=1).T[:2]
    assert np.trapezoid(speed, time) == pytest.approx(4.0 * math.pi * study.setup.drive.ratio, rel=1e-6)


def test_whole_turns_of_whole_turns_are_the_same():
    from chainunit.drives.dc_motor import DcMotor
    from chainunit.study.drive import Drive

    drive = Drive(DcMotor, DcMotor.Parameters(), ChainUnitMachine(ratio=100.0))
    for start in np.linspace(0.0, 700.0, 200):
        time = np.linspace(0.0, 5.0, 1235)
        angle = start + 1.6 * time + 0.01 * np.sin(time)
        run = xr.Dataset(
            {"machine.phi0": ("time", 100.0 * angle), "machine.w0": ("time", np.gradient(angle, time))},
            {"time": time},
        )
        turns = only_whole_turns(drive, run)
        assert turns_made(drive, turns) == pytest.approx(1.0, abs=1e-8)
        again = only_whole_turns(drive, turns)
        assert again is not None and again.sizes == turns.sizes
        assert float(again["time"][-1]) == pytest.approx(float(turns["time"][-1]), abs=1e-6)


LOW_VOLTAGE = "[motor]\nlimit = { v = 60 }\n[machine]\nratio = 25\n"


UNSETTLED = LIGHT + "settle_turns = 0\nramp = 0.01\n"


def test_the_study_waits_until_the_turns_close(tmp_path):
    """The crank still starts in the first turn; the one that is evaluated is a later one."""
    study, _ = ran(UNSETTLED, tmp_path)
    assert study.runs.steady_begin > study.setup.config.operation.steady_begin + 1.5
    assert study.runs.answers["steady"].cycle_gap < 0.01 and study.runs.answers["steady"].speed_ripple < 0.05
    assert not any(warning.code == "turns-do-not-close" for warning in study.findings.warnings)


@pytest.mark.second
@pytest.mark.parametrize(
    ("text", "told", "there"),
    [
        (UNSETTLED, "turns-do-not-close", True),
        (LIGHT + "[motor]\nlimit = { i = 0.2 }\n", "no-whole-turn", False),
    ],
)
def test_a_cycle_that_does_not_close_is_told(text, told, there, tmp_path, monkeypatch):
    from chainunit.study import start_up

    monkeypatch.setattr(start_up, "PATIENCE", 0.0)
    monkeypatch.setattr(start_up, "_SETTLES", 0.0)
    study, _ = ran(text, tmp_path)
    assert any(warning.code == told for warning in study.findings.warnings)
    assert (tmp_path / "load_cycle.csv").exists() == there


@pytest.mark.slow
def test_the_winding_temperature_is_that_of_the_duty_for_ever(tmp_path):
    """The same duty with a winding that stores little heat: it comes to rest in a run of seven time constants."""
    settings = "[motor]\narmature = {{ R = 9.5, L = 0.11, k = 1.27, R_th = 9, C = {} }}\n"
    slow, numbers = ran(LIGHT + settings.format(2000), tmp_path)
    warm = numbers["answers"]["steady"]["winding_temperature"]["value"]
    end = float(slow.runs.series["start_up"]["motor.armature.T"][-1])
    assert end < 294.0 and warm > end + 20.0
    quick, _ = ran(LIGHT + "settle_turns = 15\n" + settings.format(0.5), tmp_path)
    turns = quick.runs.steady
    mean = np.trapezoid(turns["motor.armature.T"], turns["time"]) / np.ptp(turns["time"].values)
    assert mean == pytest.approx(warm, abs=0.2)
    assert quick.runs.answers["steady"].winding_temperature == pytest.approx(mean, abs=0.2)


def test_each_overload_has_its_mirror_on_the_other_side():
    """The left side with a feed behaves as the right side with the mirrored feed."""
    from chainunit.drives.dc_motor import DcMotor
    from chainunit.study import config
    from chainunit.study.drive import Drive
    from chainunit.study.event import TYPES
    from chainunit.study.rig import Rig

    lopsided = "[feed]\n%s = { material_mass = 30, processing_force = 10 }\n%s = { material_mass = 70 }\n"
    rigs = [
        Rig(c.operation, Drive(DcMotor, c.motor.parameters, c.machine), {})
        for c in (config.parse(lopsided % sides) for sides in (("left", "right"), ("right", "left")))
    ]
    assert tuple(config.parse("").events) == STANDARD
    sided = [of for of in TYPES.values() if of.has_side]
    assert {of.kind for of in sided} >= {"empties", "feed", "jam", "lumps", "start"}
    swap = {"left": "right", "right": "left"}
    for of in sided:
        left, right = of.on("left"), of.on("right")
        for text in ("name", "title", "short", "loaded_side"):
            mirror = re.sub("left|right", lambda m: swap[m[0]], getattr(left, text))
            assert getattr(right, text) == mirror and mirror != getattr(left, text)
        one, other = (
            rig.signals(rig.event_signals(event, 2.0, {}))
            for rig, event in zip(rigs, (left, right), strict=True)
        )
        assert any(callable(signal) for signal in one.values()) or of.from_rest
        for name, signal in one.items():
            mirrored = other[re.sub("left|right", lambda m: swap[m[0]], name)]
            for t in (0.0, 2.005, 2.2, 2.33, 4.0):
                assert (signal(t) if callable(signal) else signal) == (
                    mirrored(t) if callable(mirrored) else mirrored
                )


@pytest.mark.slow
def test_both_sides_are_run_and_differ(tmp_path):
    """The rocker swings 9.06 deg to the right and 8.19 deg to the left."""
    study, numbers = ran(LIGHT.replace("event = []\n", event_line(*STANDARD, turns=1)), tmp_path)
    assert set(numbers["answers"]) == {"steady", *study.setup.config.events}
    peaks = {n: a["crank_torque_peak"]["value"] for n, a in numbers["answers"].items()}
    assert peaks["jam_left"] > 1.05 * peaks["jam_right"] > 1.05 * peaks["steady"]
    assert peaks["feed_left"] != pytest.approx(peaks["feed_right"], rel=0.05)
    left, right = (study.runs.series[name] for name in ("right_empties", "left_empties"))
    assert (
        float(left["machine.right.material_mass"][-1])
        == float(right["machine.left.material_mass"][-1])
        == 0.0
    )
    assert (
        float(left["machine.left.material_mass"][-1])
        == float(right["machine.right.material_mass"][-1])
        == 30.0
    )


@pytest.mark.parametrize(("columns", "tables"), [(80, 2), (160, 1)])
def test_the_overloads_of_both_sides_are_readable(columns, tables):
    import io

    from rich.console import Console

    from chainunit.report import terminal
    from chainunit.report.blocks import Column, Table, TableRow
    from chainunit.study import config
    from chainunit.study.event import in_groups

    runs, events = ["steady", *STANDARD], config.load().events
    groups = tuple(tuple(runs.index(run) + 1 for run in group) for group in in_groups(events, runs))
    heads = (Column(events[run].short if run in events else run) for run in runs)
    row = TableRow(("", *("10.0 N m" for _ in runs)))
    stream = io.StringIO()
    table = Table((row,), (Column("crank torque, peak, here"), *heads), groups=groups)
    terminal._show_table(table, Console(file=stream, width=columns), {})
    heads = [line for line in stream.getvalue().splitlines() if "steady" in line]
    assert len(heads) == tables and all("jam left" in heads[0] for _ in heads)
    assert "jam right" in heads[-1] and all(len(line) <= columns for line in heads)


@pytest.mark.slow
def test_feed_forward_of_chains_is_told_by_chains(tmp_path, monkeypatch):
    """The control asks a machine of the same kind: the ripple that is left is a fraction of that with two bars."""
    from chainunit.study import config
    from chainunit.study.drive import Drive
    from chainunit.study.run import run_study
    from chainunit.system import ModelComponent

    monkeypatch.setattr("chainunit.capabilities.chains.analysis.ChainAnalysis.find", lambda *_: None)
    text = """
organ = "chain"
feed_forward = true
event = []
[chain]
rods = 4
[run]
crank_speed = 3
ramp = 1
settle_turns = 2
"""
    whole, ripples = Drive.graph.func, []

    def bars(drive):
        system, machine = whole(drive), drive.machine
        model = {"model": ModelComponent(machine.model, machine.p)}
        return replace(system, components={**system.components, **model})

    for name in ("chains", "bars"):
        study = run_study(config.parse(text), tmp_path / name)
        assert study.findings.failure is None
        ripples.append(study.runs.answers["steady"].speed_ripple)
        kinds = {part: c.model.name for part, c in study.setup.drive.graph.components.items()}
        model = "ChainUnitFlexible" if name == "chains" else "ChamberForces"
        assert (kinds["machine"], kinds["model"]) == ("ChainUnitFlexible", model)
        monkeypatch.setattr(Drive, "graph", property(bars))
    assert (
        ripples[0] < 0.4 * ripples[1] < 0.2 * study.findings.by_analysis["ripple_without_feed_forward"].ripple
    )
