"""A motor that starts in star, and one that is cut off and reclosed, in a study: signals, runs, and measures."""

from __future__ import annotations

import json

import numpy as np
import pytest
from reports import said_of, write

from chainunit.core.errors import InputError
from chainunit.drives.contactor import CONTACTOR_EDGE
from chainunit.reading.result_entries import ResultEntries
from chainunit.study.block_runs import BlockRuns, RunPoint
from chainunit.study.choice import drive_of
from chainunit.study.config import parse
from chainunit.study.drive_fmus import export_drive
from chainunit.study.event import TYPES
from chainunit.study.measures import read_measure
from chainunit.study.rig import Rig
from chainunit.study.run import run_study
from chainunit.study.start_runs import start_from
from chainunit.study.start_up import start_up
from chainunit.study.transients import follow
from chainunit.study.window import Phase, Window
from chainunit.system import CoSimulation, ModelExchange, monolithic
from chainunit.system.compiled_simulation import CompiledSimulation

pytestmark = pytest.mark.slow

SYSTEM = """
[system]
machine = "ChamberForces"
motor = "IE3 4-pole 2.2 kW, 100L"
[run]
crank_speed = "30 rev/min"
turns = 1
settle_turns = 1
"""
EVENT = """
[[event]]
type = "interruption"
duration = "{}"
"""
STARTER = '[starter]\nstar_delta = { time = "0.5 s", pause = "40 ms" }\n'
STUDY = 'start = "star-delta"\n' + SYSTEM + STARTER + EVENT.format("120 ms")
DIRECT = SYSTEM + EVENT.format("120 ms")


def rig_of(text, files=None):
    config = parse(text)
    return Rig(config.operation, drive_of(config), files), config


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    rig, config = rig_of(STUDY)
    files, _ = export_drive(rig.drive, tmp_path_factory.mktemp("fmus"))
    return Rig(config.operation, rig.drive, files), config


# --- signals ---


def test_the_contactor_opens_and_closes():
    event = TYPES["interruption"].on(p=TYPES["interruption"].Parameters(duration=0.1))
    assert event.name == "interruption" and event.inputs == ("contactor",)
    signal = event.signals({"contactor": 1.0}, 2.0, {})["contactor"]
    edge = CONTACTOR_EDGE
    times = np.array([0.0, 2.0, 2.0 + edge, 2.1, 2.1 + edge, 3.0])
    assert signal(times).tolist() == [1.0, 1.0, 0.0, 0.0, 1.0, 1.0]
    # open for the duration, from middle to middle of the edges
    assert signal(2.0 + 0.5 * edge) == pytest.approx(0.5) == pytest.approx(signal(2.1 + 0.5 * edge))
    assert event.lasts == pytest.approx(0.1 + edge)


def test_a_start_changes_the_connection_without_current():
    rig, _ = rig_of(STUDY)
    signals = rig.signals(ramp=True)
    contactor, star = signals["motor.contactor"], signals["motor.star"]
    t = np.linspace(0.0, 1.0, 100_001)
    changing = (star(t) > 0.0) & (star(t) < 1.0)
    assert changing.any() and np.all(contactor(t)[changing] == 0.0)
    # ten time constants after the contactor opened, and before it closes
    assert t[changing][0] > 0.5 + CONTACTOR_EDGE + 10.0 * rig.drive.parameters.switching.decay
    assert star(0.0) == 1.0 and star(rig.drive.star.end) == 0.0
    assert contactor(rig.drive.star.end) == 1.0 and contactor(0.539) == 0.0
    assert rig.operation.ramp_end == pytest.approx(max(rig.operation.run.ramp, 0.54))
    assert "motor.contactor" not in rig.signals() and rig.inputs["contactor"][1] == 1.0
    direct, _ = rig_of(DIRECT)
    assert "motor.contactor" not in direct.signals(ramp=True) and direct.drive.star.end == 0.0
    assert direct.inputs["star"][1] == 0.0


def test_the_file_states_the_starter():
    config = parse(STUDY.replace("pause", "preferred = false, pause"))
    drive = drive_of(config)
    assert drive.parameters.switching.preferred == 0.0 and drive.star.pause == 0.04
    assert drive_of(parse(STUDY)).parameters.switching.preferred == 1.0
    for wrong, said in (
        (STUDY.replace("40 ms", "5 ms"), r"starter\.star_delta\.pause = 0\.005 s: must be >= 0\.02 s"),
        (STUDY.replace("120 ms", "1 ms"), r"event\.interruption\.duration = 0\.001 s: must be >= 0\.002 s"),
        (STUDY.replace('"star-delta"', '"star"'), 'start = "star"'),
    ):
        with pytest.raises(InputError, match=said):
            parse(wrong)


def test_a_dc_motor_has_no_contactor(tmp_path):
    study = run_study(
        parse('[run]\nturns = 1\nsettle_turns = 0\n[[event]]\ntype = "interruption"\n'), tmp_path
    )
    assert "interruption" not in study.runs.answers
    assert "this motor's drive has no contactor on the line" in json.dumps(said_of(study))


# --- runs ---


def test_every_simulation_switches_alike(exported):
    """A start in star, the change to delta, and an interruption: compiled, by Model Exchange, by co-simulation with
    two steps, beside the monolithic solution."""
    rig, config = exported
    names = ["motor.w", "motor.i", "motor.air_gap_tau", "machine.tau"]
    signals, step, stop = rig.signals(ramp=True), 1e-3, 1.0
    event = rig.event_signals(config.events["interruption"], 0.75, {})["motor.contactor"]
    start = signals["motor.contactor"]
    signals["motor.contactor"] = type(start)(1.0, (*start.changes, *event.changes))
    times = np.linspace(0.0, stop, 1001)
    there = monolithic(rig.graph, signals, times)
    kinds = (
        (CompiledSimulation, step, 1e-6, rig.graph),
        (ModelExchange, step, 1e-4, rig.system),
        (CoSimulation, step, 3e-2, rig.system),
        (CoSimulation, 0.25 * step, 3e-3, rig.system),
    )
    for kind, pace, share, system in kinds:
        with kind(system, signals) as simulation:
            run = simulation.run(stop, pace, every=round(step / pace))
        np.testing.assert_allclose(run["time"], times, atol=1e-12)
        for name in names:
            far = np.max(np.abs(run[name].values - there[name].values)) / np.max(np.abs(there[name].values))
            assert far < share, (kind.__name__, name, pace)
    i = there["motor.i"].values
    opened = (times > 0.515) & (times < 0.539) | (times > 0.765) & (times < 0.869)
    assert np.max(i[opened]) < 1e-4 * np.max(i)
    v = there["motor.terminal_v"].values
    assert np.all(np.diff(v[(times > 0.77) & (times < 0.869)]) < 0.0) and v[860] > 50.0


def test_blocks_of_runs_from_rest_start_in_star():
    """Runs of a block that start from rest settle to the steady state of a direct start and meet the same event."""
    found = []
    for text in (STUDY, DIRECT):
        rig, config = rig_of(text)
        event = config.events["interruption"]
        block = BlockRuns(rig, [event])
        (run,) = block.runs([RunPoint(rig, event, 0.6)])
        assert run.fault is None
        found.append(run)
    one, other = found
    for name in ("motor.i", "motor.w", "machine.tau"):
        assert float(np.max(one.steady[name])) == pytest.approx(float(np.max(other.steady[name])), rel=1e-3)
        # the phase at which it closes depends on the time until the angle of the crank
        assert float(np.max(one.series[name])) == pytest.approx(float(np.max(other.series[name])), rel=1e-2)


def test_the_change_to_delta_is_a_part_of_the_start():
    """The crank has its speed in star; the peak of the current comes later, in the change."""
    rig, _ = rig_of(STUDY)
    found = start_from(rig, 0.0, 5.0)
    assert found.start_time < 0.45 and found.followed > rig.drive.star.end
    with rig.from_rest() as simulation:
        run = simulation.run(1.0, 1e-4)
    time, current = run["time"].values, run["motor.i"].values
    assert found.current == pytest.approx(np.max(current), rel=2e-2)
    assert time[np.argmax(current)] > 0.53
    direct = start_from(rig_of(DIRECT)[0], 0.0, 5.0)
    in_star = np.max(current[time < 0.5])
    assert in_star == pytest.approx(direct.current / 3.0, rel=0.05)
    assert direct.start_time < found.start_time


def test_a_machine_that_starts_empty_is_fed_in_delta():
    rig, _ = rig_of("empty_start = true\n" + STUDY)
    with rig.from_rest() as simulation:
        started = start_up(rig, simulation, lambda time: None, {})
    assert started.rig.fed_from == pytest.approx(rig.drive.star.end)
    direct, _ = rig_of("empty_start = true\n" + DIRECT)
    with direct.from_rest() as simulation:
        assert start_up(direct, simulation, lambda time: None, {}).rig.fed_from < 0.4


def test_a_motor_on_an_inverter_is_not_cut_off(tmp_path):
    """The model has neither the current limit of an inverter nor its search for the speed of the motor, so that a
    reclosing behind it would be that of a line."""
    study = run_study(parse(STUDY.replace('"star-delta"', '"inverter"')), tmp_path)
    assert study.findings.failure is None and "interruption" not in study.runs.answers
    (left_out,) = [remark for remark in study.findings.remarks if remark.code == "event-left-out"]
    assert "no contactor on the line" in left_out.text


def test_a_motor_that_is_cut_off_is_asked_for_no_torque():
    """The reserve of an interruption is that of its closing, not that of the open contactor."""
    rig, config = rig_of(DIRECT)
    with rig.from_rest() as simulation:
        started = start_up(rig, simulation, lambda time: None, {})
        begin = simulation.save()
        run = follow(rig, simulation, config.events["interruption"], begin, begin + 0.5).run
    steady = started.run.sel(time=slice(started.steady_from, None))
    parts = [Window(Phase.EVENT, run, rig.drive, (), config.run.crank_speed, begin, None, None)]
    reserve = read_measure("torque_reserve", parts[0])
    contactor, limit_at = run["motor.contactor"].values, run["motor.v"].values
    assert np.min(limit_at) == 0.0 and np.min(contactor) == 0.0
    driving = np.max(run["motor.air_gap_tau"].values[contactor == 1.0])
    largest = rig.drive.motor.largest_torque(rig.drive.parameters, parts[0].warm, 400.0, 50.0)
    assert -1.0 < reserve == pytest.approx((largest - driving) / max(largest, driving - largest), rel=1e-3)
    assert float(steady["motor.v"].min()) == pytest.approx(400.0)


def test_a_study_tells_of_both(tmp_path):
    study = run_study(parse(STUDY), tmp_path)
    assert study.findings.failure is None
    write(study, tmp_path)
    result = ResultEntries(json.loads((tmp_path / "result.json").read_text()))
    assert result["start"] == "star-delta" and "interruption" in result["answers"]
    certificate = result["certificate"]["interruption"]["energy_residual_share"]["value"]
    assert certificate < 1e-4
    answer = study.runs.answers["interruption"]
    assert answer.current_peak > 3.0 * study.runs.answers["steady"].current_peak
    assert answer.speed_dip > 0.02 and answer.recovery_time < 2.0
    assert "the motor is cut off and reclosed" in (tmp_path / "result.md").read_text()
    assert study.runs.start.current_peak == pytest.approx(
        max(study.runs.start.current_peak, *(s.current for s in study.findings.by_analysis["starts"].starts)),
        rel=0.3,
    )


def test_sizing_with_a_star_delta_starter(tmp_path):
    """The motor is chosen with its start in star, whose torque is a third, and the order names the starter."""
    head = 'start = "star-delta"\n[run]\ncrank_speed = "30 rev/min"\nturns = 1\n[sizing]\ncandidates = 1\n'
    study = run_study(parse(head + STARTER), tmp_path)
    write(study, tmp_path)
    assert study.findings.failure is None
    result = ResultEntries(json.loads((tmp_path / "result.json").read_text()))
    best = result["sizing"]["candidates"][0]
    assert best["checks"]["start"]["value"]["value"] > 0.0
    assert "star-delta starter, 0.5 s in star" in " ".join((tmp_path / "result.md").read_text().split())
