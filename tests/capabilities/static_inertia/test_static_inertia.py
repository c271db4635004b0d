"""The duty with one inertia: limit cases, energy, an independent integration, and the drive that would be chosen."""

from __future__ import annotations

import dataclasses
import math
import pickle
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from chainunit import InputError
from chainunit.capabilities.static_inertia import CAPABILITY
from chainunit.capabilities.static_inertia.analysis import StaticInertiaFindings
from chainunit.capabilities.static_inertia.choice import ChosenDrive, OtherChoice
from chainunit.capabilities.static_inertia.runs import numbers_of, obstacle, run_twin, with_machine
from chainunit.capabilities.static_inertia.twin import SPEED, twin
from chainunit.capabilities.static_inertia.words import trial_words
from chainunit.core.errors import RunError
from chainunit.core.quantities import Layout
from chainunit.machines.api import ChainUnitMachine
from chainunit.machines.knife_drive import KnifeDrive
from chainunit.machines.machine import Machine
from chainunit.report.markdown import markdown
from chainunit.report.study import report
from chainunit.study.choice import drive_of
from chainunit.study.config import parse
from chainunit.study.cycle import cycle
from chainunit.study.result import as_dict
from chainunit.study.rig import Rig
from chainunit.study.run import run_study
from chainunit.study.start_up import start_up

TURN = np.linspace(0.0, 2.0 * math.pi, 256, endpoint=False)

GIVEN = """
static_inertia_runs = "always"
event = []
[system]
motor = "IE3 4-pole 1.1 kW, 90S"
[run]
crank_speed = 3
settle_turns = 3
turns = 1
step = "2 ms"
"""


# -- the twin


MACHINES = (
    (ChainUnitMachine(ratio=7.0), ChainUnitMachine().model.Feed()),
    (Machine(KnifeDrive, ratio=7.0), KnifeDrive.Feed(cut_force=2000.0)),
)


@pytest.mark.parametrize(("machine", "feed"), MACHINES)
def test_a_twin_leaves_out_the_terms_of_inertia_and_nothing_else(machine, feed):
    other, i, w = twin(machine, 12.0), 7.0, 20.0
    of = lambda m, w=w, a=0.0: m.outputs(TURN * i, w, a, feed)  # noqa: E731
    own, its = of(machine), of(other)
    # J' by the derivative of the Fourier series of J: a second route
    J = own.J * i * i
    slope = np.fft.irfft(1j * np.arange(129) * np.fft.rfft(J), 256)
    terms = 0.5 * slope * (w / i) ** 2 / i
    assert own.tau - terms == pytest.approx(its.tau, rel=1e-9, abs=1e-9 * np.ptp(own.tau))
    # over a turn these terms do no work
    assert np.mean(own.tau) == pytest.approx(np.mean(its.tau), rel=1e-10)
    assert its.J == pytest.approx(np.full(256, 12.0 / i**2), rel=1e-15)
    assert of(other, a=3.0).tau - its.tau == pytest.approx(np.full(256, 3.0 * 12.0 / i**2), rel=1e-9)
    assert its.dissipated_power == pytest.approx(own.dissipated_power, rel=1e-15)


@pytest.mark.parametrize(("machine", "feed"), MACHINES)
def test_at_the_speed_of_its_terms_a_twin_has_the_torque_of_the_machine(machine, feed):
    other, w = twin(machine, 12.0), 20.0
    loads = {"phi": TURN * 7.0, "w": w, SPEED: w / 7.0, **machine.model.feed_layout.by_name(feed)}
    assert other.evaluate(loads)["tau"] == pytest.approx(
        machine.outputs(TURN * 7.0, w, 0.0, feed).tau, rel=1e-12
    )


@pytest.mark.parametrize(("machine", "feed"), MACHINES)
def test_slowly_turned_a_twin_is_the_machine(machine, feed):
    other, differences = twin(machine, 12.0), []
    for w in (2e-2, 1e-2):
        own, its = (m.outputs(TURN * 7.0, w, 0.0, feed).tau for m in (machine, other))
        differences.append(np.max(np.abs(own - its)))
    assert differences[0] < 1e-5 * np.max(np.abs(own))
    # the difference falls with the square of the speed
    assert differences[0] / differences[1] == pytest.approx(4.0, rel=1e-3)


@pytest.mark.parametrize(("machine", "feed"), MACHINES)
def test_the_power_of_a_twin_is_the_change_of_its_energy_and_its_losses(machine, feed):
    other, a, h = twin(machine, 12.0), 5.0, 1e-5
    loads = machine.model.feed_layout.by_name(feed)

    def at(t):
        # one motion with constant acceleration, over a turn
        w = 10.0 + a * t
        motion = {"phi": TURN * 7.0 + 10.0 * t + 0.5 * a * t * t, "w": w, "a": a, SPEED: 2.0}
        return other.evaluate({**motion, **loads})

    energy = [out["kinetic_energy"] + out["potential_energy"] for out in (at(-h), at(h))]
    rate = (energy[1] - energy[0]) / (2.0 * h)
    now = at(0.0)
    assert now["power"] == pytest.approx(
        rate + now["dissipated_power"], abs=2e-7 * np.max(np.abs(now["power"]))
    )


@pytest.mark.parametrize(("machine", "feed"), MACHINES)
def test_the_slopes_of_a_twin_are_the_derivatives_of_its_torque(machine, feed):
    other, h = twin(machine, 12.0), 1e-5
    loads = machine.model.feed_layout.by_name(feed) | {SPEED: 2.0}

    def bias(phi, w):
        return other.evaluate({"phi": TURN * 7.0 + phi, "w": 10.0 + w, **loads})["tau_bias"]

    port = other.evaluate({"phi": TURN * 7.0, "w": 10.0, **loads})
    for name, change in (("tau_bias_dphi", (h, 0.0)), ("tau_bias_dw", (0.0, h))):
        by_differences = (bias(*change) - bias(*(-x for x in change))) / (2.0 * h)
        scale = np.max(np.abs(by_differences))
        assert port[name] == pytest.approx(by_differences, abs=2e-6 * scale)
    assert np.all(port["dJ_dphi"] == 0.0)


# -- the runs


@pytest.fixture(scope="module")
def given(tmp_path_factory):
    study = run_study(parse(GIVEN), tmp_path_factory.mktemp("given"))
    assert study.failure is None
    return study


def compiled(text):
    config = parse(text)
    return Rig(config.operation, drive_of(config), None)


def steady_numbers(rig):
    with rig.from_rest() as simulation:
        started = start_up(rig, simulation, lambda time: None, {})
    return numbers_of(*started.windows)


def values(numbers):
    return Layout(type(numbers)).by_name(numbers)


def test_without_masses_that_move_unevenly_both_agree_to_rounding():
    # a rod without mass swings, and a crank that is balanced turns: J is one number
    none = "m = 0, s = 0, I = 0"
    text = GIVEN + (
        f"[machine]\ncrank = {{ m = 40, s = 0, I = 60 }}\ncoupler = {{ {none} }}\nrocker = {{ {none} }}\n"
        "left = { wall_mass = 0, web_mass = 0 }\nright = { wall_mass = 0, web_mass = 0 }\n"
        "[feed]\nleft = { material_mass = 0, processing_force = 300 }\n"
        "right = { material_mass = 0, processing_force = 300 }\n"
    )
    rig = compiled(text)
    turn = cycle(rig.drive.machine, 3.0, rig.operation.feed)
    assert np.ptp(turn.outputs.J) <= 1e-14 * np.max(turn.outputs.J)
    other = with_machine(rig, twin(rig.drive.machine, float(np.mean(turn.inertia_at(1.0)))))
    runs = run_twin(other, [], lambda time: None)
    own = values(steady_numbers(rig))
    assert own["gear_torque_rms"] > 10.0
    for name, value in values(runs.numbers).items():
        assert value == pytest.approx(own[name], rel=1e-9, abs=1e-9), name
    # later turns, which have settled further
    later = values(runs.numbers_with_terms)
    for name in ("gear_torque_rms", "motor_torque_rms", "current_rms"):
        assert later[name] == pytest.approx(own[name], rel=1e-5), name
    assert later["start_time"] is None


@pytest.mark.compiler
def test_the_energy_of_its_runs_is_kept(given):
    findings = StaticInertiaFindings.of_study(given)
    assert 0.0 < findings.residual < 1e-7


def scipy_rms(study, inertia, terms):
    """RMS torques of gear and motor in steady running by an integration of its own: fluxes as complex numbers, the
    machine as splines over the angle, at two speeds for its losses. `terms` is the share of J' w^2/2, `inertia` takes
    the angle."""
    p, drive, feed = study.drive.fmu_parameters, study.drive, study.config.feed
    i, w0, T = drive.ratio, study.config.run.crank_speed, float(study.steady["motor.stator.T"].mean())
    angle = np.linspace(0.0, 2.0 * math.pi, 721)
    outs = [drive.machine.outputs(angle * i, w * i, 0.0, feed) for w in (0.97 * w0, 1.03 * w0)]
    closed = lambda y: CubicSpline(angle, np.append(y[:-1], y[0]), bc_type="periodic")  # noqa: E731
    J = closed(outs[0].J * i * i)
    slope = J.derivative()
    low, high = (
        closed(out.tau * i - 0.5 * slope(angle) * w * w)
        for out, w in zip(outs, (0.97 * w0, 1.03 * w0), strict=True)
    )

    def load(phi, w):
        share = (w / w0 - 0.97) / 0.06
        return (1.0 - share) * low(phi) + share * high(phi) + terms(slope(phi), w)

    w_s, pole_pairs = 2.0 * math.pi * p.supply.f, p.pole_pairs
    warm = 1.0 + p.stator.alpha * (T - 293.15)
    voltage = math.sqrt(2.0 / 3.0) * p.supply.V

    def motor(psi, psi_r, w):
        s = ((w_s - pole_pairs * w * i) / w_s) ** 2
        skin = 2.0 * s / (1.0 + s)
        leak, R_r = p.cage.L * (1.0 - p.cage.skin_L * skin), warm * p.cage.R * (1.0 + p.cage.skin_R * skin)
        i_r = (psi_r - psi) / leak
        i_s = psi * (1.0 + (p.main.beta * abs(psi)) ** 6) / p.main.L - i_r
        return i_s, i_r, R_r, 1.5 * pole_pairs * (psi.conjugate() * i_s).imag

    def rates(t, x):
        phi, w, psi, psi_r = x[0], x[1], complex(x[2], x[3]), complex(x[4], x[5])
        i_s, i_r, R_r, gap = motor(psi, psi_r, w)
        d = voltage - warm * p.stator.R * i_s - 1j * w_s * psi
        d_r = -R_r * i_r - 1j * (w_s - pole_pairs * w * i) * psi_r
        turned = phi % (2.0 * math.pi)
        a = (i * (gap - p.rotor.d * w * i) - load(turned, w)) / (p.rotor.J * i * i + inertia(J, turned))
        return [w, a, d.real, d.imag, d_r.real, d_r.imag]

    psi = voltage / (1j * w_s)
    period = 2.0 * math.pi / w0
    solution = solve_ivp(
        rates, (0.0, 6.0 * period), [0.0, w0, psi.real, psi.imag, psi.real, psi.imag], "LSODA",
        rtol=1e-9, atol=1e-10, max_step=0.01, dense_output=True,
    )  # fmt: skip
    times = np.linspace(4.0 * period, 6.0 * period, 4001)
    x = solution.sol(times)
    last = x[0] >= x[0, -1] - 2.0 * math.pi
    at_gear, gaps = [], []
    for column in x[:, last].T:
        phi, w = column[0] % (2.0 * math.pi), column[1]
        gaps.append(motor(complex(*column[2:4]), complex(*column[4:6]), w)[3])
        at_gear.append(inertia(J, phi) * rates(0.0, column)[1] + load(phi, w))
    span = times[last]

    def rms(y):
        return math.sqrt(np.trapezoid(np.square(y), span) / (span[-1] - span[0]))

    return rms(at_gear), rms(gaps)


@pytest.mark.compiler
@pytest.mark.slow
def test_an_integration_with_scipy_has_the_same_rms_torques(given):
    findings = StaticInertiaFindings.of_study(given)
    mean, w0 = findings.inertia.mean, findings.speed
    cases = {
        "machine": (lambda J, phi: J(phi), lambda slope, w: 0.5 * slope * w * w),
        "static": (lambda J, phi: mean, lambda slope, w: 0.0),
        "with_terms": (lambda J, phi: mean, lambda slope, w: 0.5 * slope * w0 * w0),
    }
    found = {}
    for name, (inertia, terms) in cases.items():
        numbers = getattr(findings, name).numbers
        found[name] = gear, motor = scipy_rms(given, inertia, terms)
        assert numbers.gear_torque_rms == pytest.approx(gear, rel=1e-4), name
        assert numbers.motor_torque_rms == pytest.approx(motor, rel=1e-4), name
    # the models differ by far more than that
    assert found["static"][0] > 1.05 * found["machine"][0]


@pytest.mark.compiler
def test_the_terms_at_constant_speed_leave_an_error_of_second_order(given):
    findings = StaticInertiaFindings.of_study(given)
    static, with_terms = (findings.deviations[name]["gear_torque_rms"] for name in ("static", "with_terms"))
    assert abs(with_terms) < 0.05 * abs(static)


@pytest.mark.compiler
def test_events_have_their_peaks_with_both(tmp_path):
    text = GIVEN.replace("event = []\n", "") + '[[event]]\ntype = "jam"\nside = "left"\n'
    study = run_study(parse(text), tmp_path)
    events = StaticInertiaFindings.of_study(study).events
    assert list(events) == ["jam_left"]
    jam = events["jam_left"]
    assert jam.machine.gear_torque == pytest.approx(study.answers["jam_left"].crank_torque_peak, rel=1e-12)
    assert jam.machine.current == pytest.approx(study.answers["jam_left"].current_peak, rel=1e-12)
    # the force of the jam is the same, and it rules the peak
    assert 0.8 < jam.static.gear_torque / jam.machine.gear_torque < 1.25
    assert jam.static.gear_torque != jam.machine.gear_torque


# -- whether a study has it


def test_a_study_whose_file_gives_the_motor_has_it_on_demand():
    given = parse(GIVEN)
    assert given.plans["static_inertia"] is True
    assert parse(GIVEN.replace('static_inertia_runs = "always"', "")).plans["static_inertia"] is False
    assert parse("[sizing]\n").plans["static_inertia"] is True
    assert parse('static_inertia_runs = "never"\n[sizing]\n').plans["static_inertia"] is False


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('static_inertia_runs = "yes"\n', "static_inertia_runs"),
        (
            'static_inertia_runs = "always"\norgan = "chain"\n',
            "static_inertia_runs: needs an inertia that belongs",
        ),
    ],
)
def test_a_file_that_asks_for_what_there_is_not_is_refused(text, words):
    with pytest.raises(InputError, match=words):
        parse(text)


@pytest.mark.compiler
def test_the_page_says_what_differs(given):
    said = markdown(report(given, as_dict(given)), {})
    findings = StaticInertiaFindings.of_study(given)
    section = said[said.index("## What a static inertia gets wrong") :]
    assert f"{100.0 * findings.deviations['static']['gear_torque_rms']:.3g} %" in section[:3000]
    # without [sizing] there is no choice to repeat, and no warning
    assert findings.choice is None and not [each for each in given.warnings if each.kind == "static inertia"]
    assert (
        "A constant-inertia calculation takes RMS "
        in said[: said.index("## What a static inertia gets wrong")]
    )


@pytest.mark.compiler
def test_nothing_is_said_where_nothing_differs(given):
    """A machine whose inertia hardly changes: the numbers stand in the data, and no sentence and no section."""
    findings = StaticInertiaFindings.of_study(given)
    alike = {model: dict.fromkeys(shares, 0.019) for model, shares in findings.deviations.items()}
    others = {**alike, "static": {**alike["static"], "gear_torque_rms": -0.021}}
    for deviations, differs in ((alike, False), (others, True)):
        changed = dataclasses.replace(findings, deviations=deviations)
        study = dataclasses.replace(given, findings={**given.findings, "static_inertia": changed})
        said = markdown(report(study, as_dict(study)), {})
        assert changed.differs == differs
        assert (
            ("What a static inertia gets wrong" in said)
            == ("A constant-inertia calculation" in said)
            == differs
        )
        assert "static_inertia" in as_dict(study)


@pytest.mark.compiler
def test_the_same_drive_by_other_numbers_has_a_short_sentence(given):
    """None if the numbers agree to 2 %, too."""
    findings = StaticInertiaFindings.of_study(given)
    drive = ChosenDrive("4 kW, 112M", 19.0, 0.0, 4000.0, False, "it fits")
    choice = OtherChoice(drive, drive, differs=False)
    for share, has_line in ((0.019, False), (0.021, True)):
        static = {**findings.deviations["static"], "gear_torque_rms": share}
        changed = dataclasses.replace(
            findings, choice=choice, deviations={**findings.deviations, "static": static}
        )
        study = dataclasses.replace(given, findings={**given.findings, "static_inertia": changed})
        said = markdown(report(study, as_dict(study)), {})
        assert ("A constant-inertia calculation would have chosen 4 kW, 112M (RMS " in said) == has_line


# -- the choice

SHAPER = """
[machine]
linkage = "crank_shaper.toml"
[run]
crank_speed = "80 rev/min"
[sizing]
poles_least = 4
poles_most = 4
candidates = 1
fluctuation = "10 %"
"""


@pytest.fixture(scope="module")
def shaper(tmp_path_factory):
    source = Path(__file__).parents[3] / "examples" / "linkages" / "study.toml"
    study = run_study(parse(SHAPER, str(source)), tmp_path_factory.mktemp("shaper"))
    assert study.failure is None
    return study


@pytest.mark.compiler
@pytest.mark.slow
def test_a_motor_that_one_inertia_makes_too_small_is_told_with_what_it_misses(shaper):
    findings = StaticInertiaFindings.of_study(shaper)
    choice = findings.choice
    assert choice.differs and choice.static.power < choice.own.power
    # the terms of inertia that the program leaves out are a good part of the torque
    assert findings.constant_speed.machine > 1.2 * findings.constant_speed.static
    assert findings.deviations["static"]["motor_torque_rms"] < -0.1
    # in the machine it gets too hot; its own drive looks larger than needed
    assert {"temperature", "rms_torque"} <= set(choice.missed) and not choice.own_missed
    assert choice.checks["temperature"].utilisation > 1.2
    (warning,) = (each for each in shaper.warnings if each.kind == "static inertia")
    assert choice.static.motor in warning.text and choice.own.motor in warning.text
    assert "rise of temperature" in warning.text
    assert warning.quantities["inertia"].value == findings.inertia.mean


@pytest.mark.compiler
@pytest.mark.slow
def test_the_trial_in_the_machine_is_a_study_of_that_motor(shaper, tmp_path):
    """Another study, whose file names the other motor, finds the same temperature."""
    choice = StaticInertiaFindings.of_study(shaper).choice
    text = SHAPER[: SHAPER.index("[sizing]")]
    text += f'[system]\nmotor = "{choice.static.motor}"\n[gear]\nratio = {choice.static.ratio}\n'
    source = Path(__file__).parents[3] / "examples" / "linkages" / "study.toml"
    study = run_study(parse(text, str(source)), tmp_path)
    rise = study.answers["steady"].winding_temperature - 313.15
    assert rise > 80.0
    torque = study.answers["steady"].motor_torque_rms
    assert choice.checks["rms_torque"].value == pytest.approx(torque, rel=0.02)


@pytest.mark.compiler
@pytest.mark.slow
def test_a_search_that_fails_leaves_the_rest(shaper):
    words = trial_words(
        dataclasses.replace(
            StaticInertiaFindings.of_study(shaper).choice, checks={}, missed=[], words="it stalls"
        )
    )
    assert words.endswith("fails: it stalls.")


# -- where it has none


def test_a_twin_survives_pickle():
    other = pickle.loads(pickle.dumps(twin(ChainUnitMachine(ratio=7.0), 12.0)))
    assert other.p.fixed_inertia == 12.0
    assert other.outputs(1.0, 2.0).J == 12.0 / 49.0


@pytest.mark.compiler
def test_machines_without_an_inertia_of_their_angle_say_so():
    assert obstacle(drive_of(parse(GIVEN))) == ""
    with_chains = parse(GIVEN.replace('"always"', '"sizing"').replace("event", 'organ = "chain"\nevent'))
    chains = drive_of(with_chains)
    assert obstacle(chains) == "the inertia of the machine does not belong to its angle alone"


@pytest.mark.slow
@pytest.mark.compiler
def test_runs_that_fail_are_told_and_leave_the_study(monkeypatch, tmp_path):
    def fails(*_):
        raise RunError("it stalls")

    monkeypatch.setattr("chainunit.capabilities.static_inertia.analysis.run_twin", fails)
    study = run_study(parse(GIVEN), tmp_path)
    assert study.failure is None and "static_inertia" not in study.findings and "organs" in study.findings
    assert any("could not be run with one inertia: it stalls" in str(each) for each in study.notes)


def test_a_sheet_says_that_it_was_left_out(given):
    chosen = SimpleNamespace(
        proposal=object(),
        failure=None,
        findings={},
        drive=given.drive,
        config=SimpleNamespace(plans={"static_inertia": False}),
    )
    assert list(CAPABILITY.unchecked(chosen)) == [
        'the same duty with a static inertia: the file has static_inertia_runs = "never"'
    ]
    assert list(CAPABILITY.unchecked(given)) == []
