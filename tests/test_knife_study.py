"""The knife drive with motor and flywheel: energy, hand formulas, another integrator; its file, words and command."""

from __future__ import annotations

import dataclasses
import json
import math
import sys

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from chainunit import InputError, RunError, cli
from chainunit.drives.induction_motor import steady
from chainunit.engines import MATH
from chainunit.fmu.backends import export
from chainunit.machines.knife_drive import KnifeDrive
from chainunit.quantities import Layout
from chainunit.report import files as report_files
from chainunit.report import knife as page
from chainunit.study import cutting, knife, knife_answers
from chainunit.study.flywheels import Wheel, WheelAnswers
from chainunit.study.knife import KnifeStudy, example, load, parse, run_knife
from chainunit.system import CoSimulation, energy_residual, monolithic
from chainunit.text import entry, number


def statics(config):
    return cutting.statics(config.machine, config.run.crank_speed, config.cut.force)


def bare(text=""):
    config = parse(text) if text else load()
    return KnifeStudy(config, statics(config), config.motor.identify().parameters)


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("fmus")
    made = {}
    for name, part in knife.graph(bare(), 0.0).components.items():
        made[name] = folder / f"{part.model.name}.fmu"
        export(part.model, made[name])
    return made


@pytest.fixture
def exported(files, monkeypatch):
    """The study takes these FMUs: every run sets all parameters itself."""

    def copied(graph, folder, backend=None):
        folder.mkdir(parents=True, exist_ok=True)
        components = {}
        for name, part in graph.components.items():
            file = folder / files[name].name
            file.write_bytes(files[name].read_bytes())
            components[name] = dataclasses.replace(part, file=file)
        return dataclasses.replace(graph, components=components), dict.fromkeys(components, "as before")

    monkeypatch.setattr(knife, "export", copied)


# a turn at constant speed


def test_work_of_a_cut_by_three_routes():
    """The stack's force along the path; force times the path's length; the crank's mean torque over a turn."""
    turn = statics(load()).turn
    assert 2.0 * math.pi * turn.torque_mean == pytest.approx(turn.cut_work, rel=1e-6)
    # the edges and the slow end at the table take off some
    assert turn.cut_work == pytest.approx(turn.cut_work_by_path, rel=0.03)
    sharp = "[machine.stack]\nedge = 1e-5\nv_smooth = 1e-5\n"
    turn = statics(parse(sharp)).turn
    assert turn.cut_work == pytest.approx(turn.cut_work_by_path, rel=2e-3)
    assert turn.losses == 0.0
    # friction in the pins comes on top of the cut
    rubbing = statics(parse("[machine.pin]\nfriction = 0.1\n")).turn
    assert rubbing.cut_work == pytest.approx(statics(load()).turn.cut_work, rel=1e-9)
    assert 2.0 * math.pi * rubbing.torque_mean == pytest.approx(rubbing.cut_work + rubbing.losses, rel=1e-6)
    assert rubbing.losses > 20.0


def test_the_share_of_a_path_in_the_stack():
    """A circle of radius 1, of which a band is cut on the way down alone."""
    at = np.linspace(0.0, 2.0 * math.pi, 1001)[:-1]
    x, y = np.cos(at), np.sin(at)
    stack = dataclasses.replace(load().machine.stack, top=0.5, table=-0.2)
    inside = cutting.in_stack(stack, x, y)
    length = np.sum(inside * np.hypot(np.roll(x, -1) - x, np.roll(y, -1) - y))
    assert length == pytest.approx(math.asin(0.5) + math.asin(0.2), rel=1e-4)
    assert np.all(inside[x > 0.01] == 0.0)


def test_the_energy_swing_is_that_of_the_torque_above_its_mean():
    """Only one rise of the torque: the swing is what it takes above the mean."""
    s = statics(load())
    above = np.maximum(s.torque - np.mean(s.torque), 0.0)
    assert s.turn.energy_swing == pytest.approx(np.sum(above) * 2.0 * math.pi / len(above), rel=1e-9)


def test_pins_have_their_peaks_where_they_say():
    study = bare()
    p = study.config.machine
    for title, r in study.statics.pins.items():
        for peak, angle, force in ((r.peak, r.angle, 2e4), (r.peak_free, r.angle_free, 0.0)):
            u = KnifeDrive.input_layout.from_names(
                {"phi": angle * p.ratio, "w": study.config.motor_speed, "cut_force": force}
            )
            f = getattr(KnifeDrive.evaluate(MATH, p, u)[0], cutting.PINS[title])
            assert math.hypot(f.fx, f.fy) == pytest.approx(peak, rel=1e-9)
    # a heavier cut, not the inertia, loads the pins: in proportion, but for weight and inertia
    twice = bare("[cut]\nforce = 4e4\n")
    for title, r in study.statics.pins.items():
        assert twice.statics.pins[title].peak == pytest.approx(2.0 * r.peak, abs=2.0 * r.peak_free + 1.0)


# motor and flywheel


def test_fluctuation_by_hand_with_a_large_flywheel(files):
    """Where the flywheel is so heavy that the motor's torque hardly varies, the hand formula is right."""
    study = bare("[run]\nsettle_turns = 15\nturns = 1\n")
    wheel = knife.running(study, files, 30.0)
    # the motor, less than fully loaded, turns faster than asked for
    faster = wheel.answers.speed_mean / study.config.run.crank_speed
    assert 1.0 < faster < 1.03
    assert wheel.answers.fluctuation == pytest.approx(study.by_hand(30.0) / faster**2, rel=0.02)
    # and the flywheel lends what the swing says
    turn = study.statics.turn
    assert wheel.answers.stored_share_most == pytest.approx(turn.energy_swing / turn.cut_work, rel=0.03)


def test_cutting_against_the_static_torque_of_the_motor(files):
    """The co-simulated cut beside an ODE of one state: the circuit's steady torque, the machine's torque and inertia
    over the angle by table, by another integrator."""
    study, wheel = bare(), 0.8
    s, p = study.statics, study.config.machine
    inertia, base = s.inertia / p.ratio**2, study.motor.rotor.J + wheel
    # torque at the speed asked for; what goes with the square of the speed is small here
    torque = s.torque / p.ratio

    def table(phi, y):
        return np.interp(
            phi / p.ratio % (2.0 * math.pi), np.append(s.angle, 2.0 * math.pi), np.append(y, y[0])
        )

    def rate(_, x):
        phi, w = x
        air = steady(MATH, study.motor, w).air_gap_tau - study.motor.rotor.d * w
        return [w, (air - table(phi, torque)) / (base + table(phi, inertia))]

    start = [s.top * p.ratio, study.config.motor.nameplate.speed]
    turn = 2.0 * math.pi / study.config.run.crank_speed
    times = np.linspace(4.0 * turn, 5.0 * turn, 1001)
    w = solve_ivp(rate, (0.0, times[-1]), start, rtol=1e-6, t_eval=times, max_step=2e-3).y[1]
    found = knife.running(study, files, wheel).answers
    # the fluxes lag behind the slip: the speed dips a little deeper
    assert 1.0 < found.fluctuation / (np.ptp(w) / np.mean(w)) < 1.05
    assert found.speed_mean * p.ratio == pytest.approx(np.mean(w), rel=2e-3)


def test_energy_over_a_cut(files):
    """What flywheel and machine lose, and what comes through the air gap, is the work of the cut."""
    study, wheel = bare(), 0.8
    found = knife.running(study, files, wheel)
    run = found.turns
    power, time = cutting.cutting_power(run), run["time"].values
    rotor = run["motor.w"].values
    given = (run["motor.air_gap_tau"].values - study.motor.rotor.d * rotor) * rotor
    inside = power > 0.01 * np.max(power)
    work = np.trapezoid(np.where(inside, power, 0.0), time)
    by_motor = np.trapezoid(np.where(inside, given, 0.0), time)
    assert found.answers.stored_share + by_motor / work == pytest.approx(1.0, abs=0.01)
    assert 0.1 < found.answers.stored_share < found.answers.stored_share_most < 0.67
    assert work / study.config.run.turns == pytest.approx(study.statics.turn.cut_work, rel=0.02)
    assert found.answers.residual < 1e-4
    # what the line gives is the work of the cuts, the heat of the motor, and friction
    share = np.mean(run["motor.heat"]) + study.motor.rotor.d * np.mean(rotor**2)
    cuts = study.statics.turn.cut_work * found.answers.speed_mean / (2.0 * math.pi)
    assert found.answers.supply_power_mean == pytest.approx(cuts + float(share), rel=0.01)


def test_the_coupling_converges_to_the_monolithic_solution(files):
    """A cut and what comes before, from rated speed: second order in the communication step."""
    study = bare()
    p = study.config.machine
    start = {"w_start": 150.0, "phi_start": (study.statics.top + 0.6) * p.ratio}
    signals, stop = {knife.CUT: 2e4}, 0.4
    graph = knife.graph(study, 0.15, files, **start)
    reference = monolithic(graph, signals, np.linspace(0.0, stop, 41), rtol=1e-8)
    errors = []
    for step in (2e-3, 1e-3):
        with CoSimulation(graph, signals) as simulation:
            run = simulation.run(stop, step)
        every = round(0.01 / step)
        off = run["motor.w"].values[::every] - reference["motor.w"].values
        errors.append(np.max(np.abs(off)))
        assert energy_residual(run, *graph.bonds)[1] < 1e-3
    assert errors[1] < 0.02 and errors[0] / errors[1] > 3.0


def write(study, folder):
    return [file for write in report_files.writers(page.report(study), folder, "knife") for file in write()]


NAMES = report_files.names("knife", page.PICTURES)
NUMBERS, TEXT = NAMES[:2]
SMALL = """
[drive]
flywheel = 0.4
flywheels = [0.1, 1.2]
[run]
settle_turns = 2
turns = 1
"""


@pytest.fixture
def study(exported, tmp_path):
    said: list = []
    found = run_knife(parse(SMALL), tmp_path, lambda what, done, todo: said.append((what, done, todo)))
    assert said[0][0] == "exporting FMUs" and all(0.0 <= done <= todo for _, done, todo in said)
    return found


def test_the_study_and_its_files(study, tmp_path):
    assert [wheel.flywheel for wheel in study.wheels] == [0.1, 0.4, 1.2]
    assert study.own_wheel is study.wheels[1] and study.failure is None
    by = [wheel.answers for wheel in study.wheels]
    for name, falls in (("fluctuation", True), ("current_rms", True), ("start_time", False)):
        values = [getattr(a, name) for a in by]
        assert values == sorted(values, reverse=falls), name
    # the least flywheel keeps what is permitted, and hardly more
    least = study.least.answers
    assert 0.4 < least.flywheel < 1.2 and 0.97 * 0.05 <= least.fluctuation <= 0.05
    assert least.flywheel < study.flywheel_by_hand
    assert study.by_hand(study.flywheel_by_hand) == pytest.approx(0.05, rel=1e-9)
    assert any(
        line.startswith("A fluctuation of 5.00 % takes a flywheel of") for line in knife_answers.notes(study)
    )
    # rated current is passed by the light flywheels alone
    assert any(
        f"fluctuates by {number(by[1].fluctuation, '1', 'percent')} with the flywheel of the drive" in w
        for w in knife_answers.warnings(study)
    )
    hot = [line for line in knife_answers.warnings(study) if "the RMS current is" in line]
    assert len(hot) == sum(a.current_rms > study.config.motor.nameplate.rated_current for a in by) > 0

    written = write(study, tmp_path)
    assert {file.name for file in written} == set(NAMES)
    assert all(file.stat().st_size > 1000 for file in written)
    numbers = json.loads((tmp_path / NUMBERS).read_text())
    for found, wheel in zip(numbers["flywheels"], study.wheels, strict=True):
        for v in Layout(WheelAnswers).variables:
            assert found[v.name] == entry(getattr(wheel.answers, v.name), v.unit, v.kind)
    text = (tmp_path / TEXT).read_text()
    assert "1.20 kg m2" in text and "(given)" in text and "(least)" in text and "](flywheel.png)" in text


def test_a_run_that_fails_keeps_what_was_computed(exported, tmp_path, monkeypatch):
    whole = knife.simulated

    def fails(study, files, wheel):
        if wheel > 0.1:
            raise RunError("motor: gave up")
        return whole(study, files, wheel)

    monkeypatch.setattr(knife, "simulated", fails)
    study = run_knife(parse(SMALL), tmp_path)
    assert [wheel.flywheel for wheel in study.wheels] == [0.1] and str(study.failure) == "motor: gave up"
    write(study, tmp_path)
    assert json.loads((tmp_path / NUMBERS).read_text())["failure"] == "motor: gave up"
    assert "stopped early: motor: gave up" in (tmp_path / TEXT).read_text()
    # nothing is said of what was not tried
    assert not [line for line in knife_answers.warnings(study) if line.startswith("No flywheel")]


def test_a_flywheel_that_does_not_start_is_not_too_light(exported, tmp_path):
    study = run_knife(
        parse("[drive]\nflywheel = 9\nflywheels = []\n[run]\nsettle_turns = 2\nturns = 1\n"), tmp_path
    )
    (wheel,) = study.wheels
    assert wheel.answers.start_time is None and not wheel.stalled
    assert any(
        "does not come to 95.0 % of its rated speed in 30 s" in line for line in knife_answers.warnings(study)
    )
    assert 0.4 < study.least.flywheel < 1.2 and study.least.keeps(0.05)


def test_a_large_motor_needs_no_flywheel(exported, tmp_path):
    big = "[drive]\nmotor = 'IE3 4-pole 75 kW, 280S'\nflywheel = 0.1\nflywheels = []\n"
    study = run_knife(parse(big + "[run]\nsettle_turns = 1\nturns = 1\n"), tmp_path)
    assert study.least.flywheel == 0.0 and study.flywheel_by_hand == 0.0
    assert knife_answers.notes(study)[0].startswith(
        "For a fluctuation of 5.00 % no flywheel is needed; nor is it by hand. Without "
    )


def test_a_motor_that_stalls(exported, tmp_path):
    study = run_knife(parse(SMALL.replace("[0.1, 1.2]", "[]") + "[cut]\nforce = 1e5\n"), tmp_path)
    (wheel,) = study.wheels
    assert wheel.stalled and wheel.answers.fluctuation is None and wheel.answers.start_time is not None
    assert any("the motor stalls under the cut" in line for line in knife_answers.warnings(study))
    assert study.least is None
    assert any("of the motor on average, rated is 14.4 N m" in line for line in knife_answers.warnings(study))
    assert any("nor does a larger one that was tried" in line for line in knife_answers.warnings(study))
    written = [file.name for file in write(study, tmp_path)]
    assert "flywheel.png" not in written and "stalls" in (tmp_path / TEXT).read_text()


@pytest.mark.parametrize(
    ("stack", "beginning"),
    [
        (
            '{ top = "-240 mm", table = "-300 mm" }',
            "No cut takes place: the blade comes down to y = -235.0 mm",
        ),
        ('{ top = "-185 mm", table = "-240 mm" }', "The blade does not reach the table"),
        ('{ top = "-100 mm", table = "-234 mm" }', "The blade does not leave the stack"),
        ('{ top = "-185 mm", table = "-234 mm" }', None),
    ],
)
def test_where_the_stack_lies(stack, beginning):
    said = knife_answers.warnings(
        dataclasses.replace(bare(f"[machine]\nstack = {stack}\n"), failure=RunError("x"))
    )
    assert said == [] if beginning is None else len(said) == 1 and said[0].startswith(beginning)


def test_words_for_a_slow_start_and_a_poor_run():
    study = bare()
    sound = {v.name: 0.04 for v in Layout(WheelAnswers).variables}
    given = sound | {
        "flywheel": 5.0,
        "start_time": 12.0,
        "residual": 0.03,
        "drift": 0.4,
        "current_share": 0.9,
    }
    study.wheels = [Wheel(WheelAnswers(**given))]
    said = knife_answers.warnings(study)
    assert [line.split(" kg m2 ")[1].split(",")[0] for line in said] == [
        "the start takes 12.0 s",
        "3.00 % of the energy is missing: a shorter run.step is needed.",
        "the speed still changes over the measured turns",
    ]


# the knife file and the command


def test_the_example_says_what_is_declared():
    shown, plain = parse(example()), parse("")
    for name in ("machine", "cut", "train", "run"):
        ours, declared = getattr(shown, name), getattr(plain, name)
        layout = Layout(type(ours))
        assert layout.values(ours) == pytest.approx(layout.values(declared), rel=1e-12), name
    assert (shown.motor, shown.flywheels) == (plain.motor, plain.flywheels)
    assert "ours" in example() and load().title
    assert load().machine.ratio == pytest.approx(1456.0 / 40.0, rel=1e-3)
    assert parse("[drive]\nratio = 35\n").machine.ratio == 35.0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[machine]\nr = 0.3", "machine: r = 0.3 m: the crank cannot turn with ab = 0.37, bo2 = 0.3"),
        ("[machine.knife.e]\nx = 0.1", "machine: largest misfit of a leg over the turn of the crank"),
        ("[drive]\nratio = 100", "drive.ratio = 100: with IE3 4-pole 2.2 kW, 100L the crank would turn"),
        ("[machine]\nratio = 30", "machine.ratio = 30: the gear belongs to the drive"),
        ("[machine.stack]\ntop = -0.3", "machine.stack.top = -0.3 m: must be > -0.234 m, the height of the table"),
        ("[machine]\nmass = 3", "machine.mass: unknown key; known here: r, ab"),
        ("[cut]\nforce = 0", "cut.force = 0 N: must be > 0 N"),
        ('[cut]\nforce = "3 m"', 'cut.force = "3 m": must be a number in N'),
        ("[drive]\nmotor = 'IE3 4-pole 2 kW'", 'drive.motor = "IE3 4-pole 2 kW": not in the catalogue; must be one'),
        ("[drive]\nflywheel = -1", "drive.flywheel = -1 kg.m2: must be >= 0 kg.m2"),
        ("[drive]\nflywheels = [1, -2]", "drive.flywheels = -2 kg.m2: must be >= 0 kg.m2"),
        ("[drive]\nflywheels = 3", "drive.flywheels = 3: must be a list"),
        ("[drive]\nratio = nan", "drive.ratio = nan: must be finite"),
        ("[run]\nturns = 2.5", "run.turns = 2.5: must be a whole number"),
        ("[run]\nsettle_turns = 0", "run.settle_turns = 0: must be >= 1"),
        ('[run]\nstep = "8 ms"', "run.step = 0.008 s: must be <= 0.005 s, a 300th of a turn"),
        ("[run]\nfluctuation = 0", "run.fluctuation = 0: must be >= 0.0001"),
        ("[knife]\nm = 1", "knife: unknown key; known here: title, machine, cut, drive, run"),
        ("x =", "no valid TOML"),
    ],
)  # fmt: skip
def test_refusals(text, message):
    with pytest.raises(InputError) as refused:
        parse(text)
    assert str(refused.value).startswith(message)
    assert "\n" not in str(refused.value)


def command(monkeypatch, *arguments):
    monkeypatch.setattr(sys, "argv", ["chainunit", "knife", *map(str, arguments)])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    return ended.value.code


def test_the_command(exported, monkeypatch, tmp_path, capsys):
    file, out = tmp_path / "knife.toml", tmp_path / "out"
    file.write_text('title = "[Mine]"' + SMALL.replace("[0.1, 1.2]", "[]"))
    out.mkdir()
    (out / NUMBERS).write_text("old")
    assert command(monkeypatch, file, "-o", out) in (0, None)
    shown = capsys.readouterr()
    assert "[Mine]" in shown.out and "Written:" in shown.out and "least" in shown.out
    assert {path.name for path in out.iterdir()} == {*NAMES, "fmu"}
    file.write_text("[cut]\nforce = -2")
    assert command(monkeypatch, file, "-o", out) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"chainunit: {file}: cut.force = -2 N: must be > 0 N") and said.count("\n") == 1
    # nothing of an earlier run was taken away
    assert (out / NUMBERS).stat().st_size > 1000
    assert command(monkeypatch, "--example") in (0, None)
    assert capsys.readouterr().out == example()


def test_the_command_says_that_a_run_failed(exported, monkeypatch, tmp_path, capsys):
    def fails(study, files, wheel):
        raise RunError("motor: gave up")

    monkeypatch.setattr(knife, "simulated", fails)
    assert command(monkeypatch, "-o", tmp_path) == 1
    said = capsys.readouterr()
    assert "The run stopped early: motor: gave up. What was computed before is in" in said.err
    assert (tmp_path / NUMBERS).exists() and (tmp_path / "reactions.png").exists()
