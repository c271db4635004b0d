"""A study with a load observer: who notices an event, beside relay, coupling and current limit."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from fmpy.ssp.ssd import read_ssd
from reports import page_of, said_of

from chainunit import InputError
from chainunit.core.engines import MATH
from chainunit.core.native.compilers import compiler
from chainunit.drives.dc_motor import DcMotor
from chainunit.drives.induction_motor import InductionMotor
from chainunit.drives.induction_steady import steady
from chainunit.drives.motor import FOREIGN
from chainunit.drives.terminal_signals import terminal_signals
from chainunit.machines.load_observer import FARTHEST, Inputs, rotor_torque
from chainunit.study import config
from chainunit.study.choice import choose, with_parts_beside
from chainunit.study.cycle import cycle
from chainunit.study.drive_fmus import with_files
from chainunit.study.package import export_study, study_system
from chainunit.study.rig import Rig
from chainunit.study.run import run_study
from chainunit.study.transients import follow
from chainunit.system import CompiledSimulation, CoSimulation

pytestmark = pytest.mark.second

native = pytest.mark.skipif(compiler() is None, reason="no C compiler")
RUN = "[run]\nramp = 0.5\nsettle_turns = 1\n"
EVENTS = """
[[event]]
type = "feed"
side = "left"
turns = 1
[[event]]
type = "jam"
side = "right"
turns = 1
[[event]]
type = "blocked"
turns = 1
"""
TRIP, LIMIT = 300.0, 4.4
TEXT = f"[observer]\n[coupling]\ntrip_torque = {TRIP}\n{RUN}{EVENTS}"


def drive_of(text, folder):
    values = config.parse(text)
    drive, turn = (
        choose(values, folder, lambda *_: None).drive,
        cycle(values.machine, values.run.crank_speed, values.feed),
    )
    return with_parts_beside(drive, values.plans, values.feed, turn)


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """The packaged chain unit on its DC motor, with a torque limiter."""
    folder = tmp_path_factory.mktemp("observer")
    result = run_study(config.parse(TEXT), folder)
    result.folder = folder / "fmu"
    return result


@native
def test_normal_running_has_no_alarm_and_the_estimates_are_the_loads(study):
    steady, found = study.runs.steady, study.findings.by_analysis["observer"]
    for side in ("left", "right"):
        np.testing.assert_allclose(steady[f"observer.{side}.material_mass"], 30.0, atol=0.3)
    assert np.all(np.abs(study.runs.series["start_up"]["observer.alarm"].values) < 0.5)
    assert found.alarm_in_start is None and not found.alarms_in_steady
    assert abs(found.steady.imbalance) < 0.3 and 5.0 < found.steady.threshold < 15.0
    assert not [remark for remark in study.findings.remarks if "observer" in remark.code]


@native
def test_each_device_notices_when_its_variable_says_so(study):
    """Counted by hand from the rows of the runs."""
    notices = study.findings.by_analysis["observer"].notices
    assert list(notices) == ["feed_left", "jam_right", "blocked"]
    normal = np.max(np.abs(study.runs.steady["machine.rocker.tau"].values))
    for name, of in notices.items():
        run, begin = study.runs.series[name], study.runs.event_times[name]
        since = run["time"].values - begin
        is_noticed = {
            "torque_limiter": np.abs(run["motor.tau"].values) >= TRIP / 50.0,
            "current_limit": np.abs(run["motor.armature.i"].values) >= 0.99 * LIMIT,
            "observer": np.abs(run["observer.alarm"].values) == 1.0,
        }
        assert list(of) == list(is_noticed)
        for device, rows in is_noticed.items():
            rows = np.flatnonzero(rows & (since > 0.0))
            last = rows[0] if rows.size else len(since) - 1
            assert of[device].time == (pytest.approx(since[last]) if rows.size else None), (name, device)
            torque = np.abs(run["machine.rocker.tau"].values[: last + 1][since[: last + 1] >= 0.0])
            assert of[device].carried == pytest.approx(np.max(torque) / normal), (name, device)
    # the shift of the feed is noticed by the observer alone, and within half a turn; the stop by the coupling alone
    of = notices["feed_left"]
    assert of["observer"].time < 1.05 and of["torque_limiter"].time is of["current_limit"].time is None
    assert notices["blocked"]["torque_limiter"].time < 0.1 and notices["blocked"]["observer"].time is None


@native
def test_the_side_is_the_loaded_one(study):
    found = study.findings.by_analysis["observer"]
    assert found.named == {"feed_left": "left", "jam_right": "right", "blocked": ""}
    assert found.loaded == {"feed_left": "left", "jam_right": "right", "blocked": ""}


@native
def test_the_observer_changes_nothing_in_the_runs(study, tmp_path):
    """It only takes signals: without it the same rows come, to the last bit."""
    without = run_study(config.parse(f"{RUN}[[event]]\ntype = 'feed'\nside = 'left'\nturns = 1"), tmp_path)
    assert (
        "observer" not in without.findings.by_analysis
        and "observer.alarm" not in without.runs.series["start_up"]
    )
    for name in ("start_up", "feed_left"):
        for of in ("machine.tau", "machine.rocker.tau", "motor.w", "motor.armature.i"):
            assert np.array_equal(without.runs.series[name][of], study.runs.series[name][of]), (name, of)


@native
def test_the_compiled_system_estimates_the_same(study):
    """One ODE of the whole system, with error control, in place of the exchange of values. In co-simulation the
    signals are held over a step: the difference falls with the step."""
    drive, signals = (
        study.setup.drive,
        Rig(study.setup.config.operation, study.setup.drive, None).signals(ramp=True),
    )
    names = ("left.material_mass", "right.processing_force", "imbalance.feed", "rocker.tau")
    full = [f"observer.{name}" for name in names]
    files = {name: study.folder / f"{c.title}.fmu" for name, c in drive.graph.components.items()}
    with CompiledSimulation(drive.graph, signals) as simulation:
        whole = simulation.run(4.0, 0.004, names=full)
    errors = []
    for step in (0.004, 0.002, 0.001):
        with CoSimulation(with_files(drive, files), signals) as simulation:
            run = simulation.run(4.0, step, every=round(0.004 / step), names=full)
        late = run["time"].values > 2.5
        errors.append([np.max(np.abs(run[name].values - whole[name].values)[late]) for name in full])
    assert np.all(np.array(errors[2]) < [0.2, 1.0, 0.1, 1.0]), errors[2]
    feed, force = np.array(errors)[:, 0], np.array(errors)[:, 1]
    for error in (feed, force):
        assert np.all(error[1:] < 0.65 * error[:-1]), errors


@native
def test_a_torque_that_no_load_explains_leaves_the_estimates_within_bounds(study):
    """A stop of the rocker, without a coupling: the motor stalls at its current limit."""
    rig = Rig(replace(study.setup.config, coupling=None).operation, study.setup.drive, None)
    with rig.from_rest() as simulation:
        simulation.run(4.0, rig.step)
        begin = simulation.save()
        run = follow(rig, simulation, study.setup.config.events["blocked"], begin + 0.5, begin + 3.5).run
    assert np.max(np.abs(run["motor.armature.i"].values)) > 0.99 * LIMIT
    p = study.setup.drive.observer.parameters
    for load, of in (("material_mass", p.feed), ("processing_force", p.force)):
        for side in ("left", "right"):
            deviation = np.abs(run[f"observer.{side}.{load}"].values - of.expected)
            assert np.max(deviation) <= 1.01 * FARTHEST * of.spread
    assert abs(float(run["observer.speed"][-1]) - float(run["motor.w"][-1])) < 1.0


@native
def test_the_report_says_who_notices(study):
    text = said_of(study)
    assert "Who notices" in text and "side that the observer names" in text
    page = page_of(study)
    assert "Who notices an overload" in page and "observer-feed-left" in page


def test_the_system_of_a_package_has_the_observer(tmp_path):
    drive = drive_of("[observer]", tmp_path)
    system = study_system(drive, config.parse("[observer]").operation)
    assert set(system.connections) >= {
        ("motor.phi", "observer.phi"),
        ("motor.w", "observer.w"),
        ("motor.armature.i", "observer.current"),
    }
    both = drive_of("feed_forward = true\n[observer]", tmp_path).graph
    assert {("model.tau", "motor.tau_ff"), ("motor.w", "observer.w")} <= set(both.connections)


def test_the_package_has_its_fmu(tmp_path):
    text = f"[observer]\n{RUN}"
    export_study(config.parse(text), tmp_path / "observed.ssp", backend="python")
    elements = read_ssd(str(tmp_path / "observed.ssp")).system.elements
    assert [(e.name, e.source) for e in elements] == [
        ("machine", "resources/ChamberForces.fmu"),
        ("motor", "resources/DcMotor.fmu"),
        ("observer", "resources/LoadObserver.fmu"),
    ]


def test_what_the_observer_knows_is_that_of_the_study(tmp_path):
    text = """
[observer]
signal_noise = "2 %"
overload = "10 %"
uncertainty = "500 g"
[machine]
left = { web_mass = 25 }
[feed]
left = { material_mass = 36 }
right = { material_mass = 24 }
[flywheel]
J = 0.01
"""
    drive = drive_of(text, tmp_path)
    p = drive.observer.parameters
    assert p.left.web_mass == 25.0 and p.ratio == drive.ratio == 50.0
    assert p.rotor.J == pytest.approx(0.0135) and p.signal.current == pytest.approx(1.27)
    assert p.feed.expected == 30.0 and p.feed.spread == 15.0 and p.imbalance.uncertainty == 0.5
    assert p.imbalance.overload == pytest.approx(6.0)
    assert p.noise.w == pytest.approx(1.5)
    # the torque over a turn by the machine itself
    angle = np.linspace(0.0, 100.0 * math.pi, 720, endpoint=False)
    torque = drive.machine.outputs(angle, 150.0, 0.0, config.parse(text).feed).tau + 0.15
    assert p.noise.torque == pytest.approx(0.02 * math.sqrt(np.mean(np.square(torque))))


@pytest.mark.parametrize(
    ("more", "loss"),
    [
        ('[system]\nmotor = "IE3 4-pole 0.55 kW, 80M"\n[gear]\nefficiency = 0.7\nd = 0.002', 1.0 / 0.7 - 1.0),
        ("[motor]\ngear.loss = 0.2", 0.2),
    ],
)
def test_the_observer_knows_friction_and_gear_of_the_motor(more, loss):
    """Apart, as the motor's FMU has them; the noise is in parts of the torque before the gear."""
    drive = drive_of(f"[observer]\n{more}", None)
    p, motor = drive.observer.parameters, drive.fmu_parameters
    assert p.gear.loss == motor.gear.loss == pytest.approx(loss)
    assert (p.rotor.J, p.rotor.d) == (motor.rotor.J, motor.rotor.d)
    angle, speed = np.linspace(0.0, 2.0 * math.pi, 720, endpoint=False), 3.0 * drive.ratio
    torque = drive.machine.outputs(angle * drive.ratio, speed, 0.0, config.parse("").feed).tau
    assert np.min(torque) < 0.0
    torque = np.where(torque > 0.0, 1.0 + loss, 1.0 - loss) * torque + motor.rotor.d * speed
    share = drive_of("[observer]", None).observer.parameters
    share = share.noise.torque / share.offset.spread
    assert p.offset.spread == pytest.approx(0.15 * math.sqrt(np.mean(np.square(torque))), rel=1e-3)
    assert p.noise.torque == pytest.approx(share * p.offset.spread)


@pytest.mark.parametrize("on_inverter", [False, True])
def test_the_power_of_an_induction_motor_tells_its_torque(on_inverter):
    """In steady running, at the slip of half of the rated torque."""
    p = InductionMotor.parameter_layout.from_names(
        {"inverter.on": float(on_inverter), "inverter.slip": 0.3, "ambient.T": 313.15}
    )
    share, w = 1.0, 150.0
    f = 50.0
    point = steady(MATH, p, w, share, f, 313.15)
    torque = point.air_gap_tau
    if on_inverter:
        # the frequency that the control gives at this torque has to be that of the point
        w = (f - 0.3 * torque) * 2.0 * math.pi / p.pole_pairs
    signals = terminal_signals(InductionMotor, p, w, torque)
    found = signals.per_power * (point.supply_power - signals.resistance * point.i**2)
    assert found == pytest.approx(torque, rel=1e-9)
    assert signals.outputs == {"current": "i", "power": "supply_power"}


def test_signals_are_those_of_the_observer():
    """The factors go where the observer has them."""
    drive = drive_of('[observer]\n[system]\nmotor = "IE3 4-pole 0.55 kW, 80M"', None)
    p = drive.observer.parameters
    own = terminal_signals(InductionMotor, drive.fmu_parameters, 150.0, 1.0)
    got = rotor_torque(p, Inputs(power=500.0, current=1.5))
    assert got == pytest.approx(own.per_power * (500.0 - own.resistance * 2.25))
    assert drive.observed == {"phi": "phi", "w": "w", "current": "i", "power": "supply_power"}
    k = DcMotor.Parameters().armature.k
    assert terminal_signals(DcMotor, DcMotor.Parameters(), 1.0, 1.0).per_current == k
    with pytest.raises(TypeError, match="the torque on its rotor is not known"):
        terminal_signals(FOREIGN, None, 1.0, 1.0)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            '[observer]\n[system]\nmachine = "KnifeDrive"',
            "knows the chain unit, and the machine is KnifeDrive",
        ),
        ("[observer]\n[driveline]", r"takes the shaft between motor and machine for rigid"),
        (
            "[observer]\n[feed]\nleft = { material_mass = 0 }\nright = { material_mass = 0 }",
            r"feed\.left\.material_mass and feed\.right\.material_mass are 0 kg",
        ),
        ("[observer]\nsignal_noise = 0", r"observer\.signal_noise = 0"),
        ("[observer]\nnoise = 1", r"observer\.noise"),
    ],
)
def test_refusals(text, words):
    with pytest.raises(InputError, match=words):
        config.parse(text)


@native
@pytest.mark.slow
@pytest.mark.parametrize("start", ["direct", "inverter"])
def test_induction_motors(start, tmp_path):
    """By active power and current, on the line and on an inverter."""
    text = f'start = "{start}"\n[observer]\n[system]\nmotor = "IE3 4-pole 0.55 kW, 80M"\n{EVENTS}'
    study = run_study(config.parse(text.replace("turns = 1", "")), tmp_path)
    found = study.findings.by_analysis["observer"]
    assert study.findings.failure is None and not found.alarms_in_steady
    assert abs(found.steady.imbalance) < 2.0
    assert found.named == {"feed_left": "left", "jam_right": "right", "blocked": ""}
    assert found.notices["feed_left"]["observer"].time < 1.05
    assert found.notices["feed_left"]["thermal_relay"].time is None


@native
@pytest.mark.slow
def test_chains_are_warned_of(tmp_path):
    """Bars in the observer, chains as the plant: at 3 rad/s within the limit that was measured."""
    text = f"organ = 'chain'\n[chain]\nrods = 4\nsweep_points = 0\n[observer]\n{RUN}{EVENTS}"
    study = run_study(config.parse(text), tmp_path)
    (remark,) = (each for each in study.findings.remarks if each.code == "observer-of-two-bars")
    assert remark.severity == "note" and 0.5 < remark.quantities["share"][0] < 0.72
    assert study.findings.by_analysis["observer"].steady.error < 0.2 * 30.0
    assert study.findings.by_analysis["observer"].named["feed_left"] == "left"
