"""A study with a driveline: its place, its torques, and its section of the report."""

from __future__ import annotations

import json

import numpy as np
import pytest
import xarray as xr
from event_tables import event_line
from records import changed
from reports import write
from scipy.linalg import eigh
from test_page import Reader, check_traced

from chainunit import InputError
from chainunit.drives.shafts import hollow, stiffness
from chainunit.models import MODELS
from chainunit.reading.result_entries import ResultEntries
from chainunit.report.shaft import _driveline
from chainunit.report.study_motion import motion
from chainunit.study import config
from chainunit.study.choice import choose
from chainunit.study.cycle import cycle
from chainunit.study.drive_fmus import coasting_parameters
from chainunit.study.line.shaft import RIGID, Cycles, driveline_of, line_modes, rainflow, shaft_answers
from chainunit.study.line.shaft_runs import ShaftFindings, shaft_findings
from chainunit.study.package import export_study, start_of
from chainunit.study.readings import crank_torque
from chainunit.study.result import as_dict
from chainunit.study.run import run_study

pytestmark = pytest.mark.second

JAM, BLOCKED = (event_line(name, turns=1) for name in ("jam_left", "blocked"))
SHORT = f"""
{JAM}
[run]
ramp = 0.3
turns = 1
step = 0.001
crank_speed = 6
[machine]
ratio = 25
"""
LINE = """
[driveline]
alpha1 = "12 deg"
alpha2 = "8 deg"
d2 = 20
d3 = 20
"""


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    return run_study(config.parse(SHORT + LINE), tmp_path_factory.mktemp("line"), check=True)


def test_the_run_has_its_certificates(study):
    for name in ("start_up", "jam_left"):
        shares = study.runs.certificate[name]
        assert shares["energy_residual_share"] < 1e-4
        assert shares["driveline_energy_residual_share"] < 1e-4
    assert study.runs.certificate["start_up"]["machine.tau_difference_to_monolithic"] < 1e-3


def test_the_line_amplifies_a_jam(study):
    """Peaks are those of the series; the rigid drive's torque is that of a study without a line but with its
    inertia."""
    shaft = shaft_findings(study.findings).answers
    steady, jam = shaft["steady"], shaft["jam_left"]
    run = study.runs.series["jam_left"].sel(time=slice(study.runs.event_times["jam_left"], None))
    assert jam.tau2_peak == np.max(np.abs(run["driveline.tau2"])) > 2.0 * steady.tau2_peak
    assert jam.amplification == pytest.approx(jam.tau2_peak / np.max(np.abs(run[RIGID])))
    assert jam.amplification > 1.2 and 1.0 < steady.amplification < 1.3
    assert jam.turns_of_steady > 10.0 and jam.range_equivalent is None
    runs = {
        warning.runs: warning.text for warning in study.findings.warnings if warning.code == "amplification"
    }
    assert "times that of a rigid drive" in runs["jam_left",]
    before = run[RIGID].attrs
    assert before["units"] == "N.m"


def test_a_rigid_drive_carries_what_the_machine_and_the_inertia_take(study, tmp_path):
    """The same study without a driveline, the crank heavier by J4: its crank torque is the rigid shaft's."""
    J4, crank = study.setup.drive.line.inertia, study.setup.drive.machine.p.crank
    heavier = f"{SHORT}crank = {{ I = {crank.I + J4} }}"
    gains = {
        n: v
        for n, v in study.setup.drive.motor.parameter_layout.by_name(study.setup.drive.parameters).items()
        if ".k" in n and "control" in n
    }
    motor = "".join(
        f"[motor.{n.rpartition('.')[0]}]\nkp = {gains[n]}\nki = {gains[n[:-1] + 'i']}\n"
        for n in gains
        if n.endswith("kp")
    )
    plain = run_study(config.parse(f"{heavier}\n{motor}"), tmp_path)
    for name in ("start_up", "jam_left"):
        reference = crank_torque(plain.setup.drive, plain.runs.series[name])
        # the crank without the line is heavier by J4, so that this torque holds that of J4, too
        result = study.runs.series[name][RIGID].values
        if name == "start_up":
            np.testing.assert_allclose(result, reference, atol=2e-4 * np.max(np.abs(reference)))
        else:  # its event comes at the same crank angle, a little later than in the elastic drive
            assert np.max(np.abs(result)) == pytest.approx(np.max(np.abs(reference)), rel=0.02)


@pytest.mark.slow
def test_before_or_behind_the_gear(tmp_path):
    """Straight joints on the motor's shaft, seen through the gear, are those on the crank's with stiffness, damping
    and inertia times the square of the ratio."""
    runs = []
    for place, by in (("crank", 1.0), ("motor", 1.0 / 25.0**2)):
        values = {"c2": 8e3, "c3": 6e3, "d2": 20.0, "d3": 10.0, "J4": 0.5}
        table = "".join(f"{name} = {by * x!r}\n" for name, x in values.items())
        text = f'{SHORT}[driveline]\nplace = "{place}"\nalpha1 = 0\nalpha2 = 0\n{table}'
        runs.append(run_study(config.parse(text), tmp_path / place))
    crank, motor = runs
    assert (crank.setup.drive.line.ratio, motor.setup.drive.line.ratio) == (25.0, 1.0)
    for name in ("start_up", "jam_left"):
        a, b = crank.runs.series[name], motor.runs.series[name]
        np.testing.assert_allclose(a["motor.w"], b["motor.w"], rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(a["driveline.tau2"], 25.0 * b["driveline.tau2"], rtol=1e-7, atol=1e-6)
        np.testing.assert_allclose(
            crank_torque(crank.setup.drive, a), crank_torque(motor.setup.drive, b), rtol=1e-7, atol=1e-6
        )
    assert crank.setup.statics.modes.k_largest == pytest.approx(
        motor.setup.statics.modes.k_largest, rel=1e-12
    )
    assert crank.runs.answers["jam_left"].speed_least == pytest.approx(
        motor.runs.answers["jam_left"].speed_least, rel=1e-9
    )


def test_the_frequency_is_that_of_rotor_gear_shafts_and_machine(study):
    """The eigenproblem in the angles of rotor (behind the gear) and driven shaft, the straight cardan condensed."""
    drive = study.setup.drive
    line, rotor, result = driveline_of(drive), drive.fmu_parameters.rotor.J, line_modes(drive, [2e-3, 9e-3])
    for J, expected in zip((2e-3, 9e-3), (result.k_largest, result.k_least), strict=True):
        c = 1.0 / (1.0 / line.c2 + 1.0 / line.c3)
        # twist = phi_motor/ratio - phi_driven; both inertias where they turn
        stiffness = c * np.array([[1.0 / line.ratio**2, -1.0 / line.ratio], [-1.0 / line.ratio, 1.0]])
        inertia = np.diag([rotor, line.J4 + J * line.ratio**2])
        assert np.sqrt(eigh(stiffness, inertia, eigvals_only=True)[1]) == pytest.approx(expected, rel=1e-12)


def test_rainflow_is_that_of_the_standard():
    """The example of ASTM E1049-85, 5.4.4.2: ranges and counts as the standard prints them."""
    result = rainflow([-2, 1, -3, 5, -1, 3, -4, 4, -2])
    counted = {}
    for size, count in zip(result.range, result.count, strict=True):
        counted[float(size)] = counted.get(float(size), 0.0) + float(count)
    assert counted == {3.0: 0.5, 4.0: 1.5, 6.0: 0.5, 8.0: 1.0, 9.0: 0.5}
    assert result.damage(2.0) == 0.5 * 9 + 1.5 * 16 + 0.5 * 36 + 64 + 0.5 * 81
    rows = result.classes(9.0)
    assert sum(row.count for row in rows) == 4.0 and rows[0].high == 9.0
    assert rainflow([1.0, 1.0]).damage(5.0) == 0.0


@pytest.mark.parametrize("turns", [1, 2, 20])
@pytest.mark.parametrize("phase", [0.0, 0.4, 2.0])
def test_damage_of_a_steady_swing(study, turns, phase):
    """A sine of range 2 A once a turn: the equivalent range is 2 A, whatever the window; an event of as many turns
    does that of as many, but for its open ends."""
    angle = np.linspace(0.0, turns, turns * 400 + 1)
    swing = 7.0 * np.sin(2.0 * np.pi * angle + phase)
    zero, gear = np.zeros_like(angle), study.setup.drive.driven_machine.p.ratio
    series = {
        "driveline.tau2": swing, "driveline.tau3": swing, "driveline.twist2": zero, "driveline.twist3": zero,
        "machine.phi0": 2.0 * np.pi * angle * gear, "machine.w0": zero,
        # the torque of a rigid shaft twice as small
        "machine.tau": 0.5 * swing / study.setup.drive.line.ratio, "motor.a": zero,
    }  # fmt: skip
    run = xr.Dataset({name: ("time", y) for name, y in series.items()}, {"time": angle})
    answers, cycles, damage = shaft_answers(study.setup.drive, run, run, 5.0)
    assert answers.range_equivalent == pytest.approx(14.0, rel=1e-4) and answers.cycles == pytest.approx(
        turns, abs=1
    )
    assert isinstance(cycles, Cycles) and damage == pytest.approx(14.0**5, rel=1e-3)
    assert answers.amplification == pytest.approx(2.0)
    event, _, _ = shaft_answers(study.setup.drive, run, run, 5.0, damage)
    assert event.turns_of_steady == pytest.approx(turns, abs=0.6) and event.range_equivalent is None


def test_rounding_is_no_cycle(study):
    """Equal bends: the torque of steady running is even but for rounding, and has no cycle whose damage could be the
    measure of an event."""
    angle = np.linspace(0.0, 2.0, 801)
    even = 375.0 + 8e-7 * np.sin(2.0 * np.pi * 49.0 * angle)
    zero, gear = np.zeros_like(angle), study.setup.drive.driven_machine.p.ratio
    series = {"driveline.tau2": even, "driveline.tau3": even, "machine.tau": even}
    series |= dict.fromkeys(("driveline.twist2", "driveline.twist3", "machine.w0", "motor.a"), zero)
    series["machine.phi0"] = 2.0 * np.pi * angle * gear
    run = xr.Dataset({name: ("time", y) for name, y in series.items()}, {"time": angle})
    answers, cycles, damage = shaft_answers(study.setup.drive, run, run, 5.0)
    assert (answers.cycles, answers.range_largest, answers.range_equivalent, damage) == (0.0, 0.0, 0.0, 0.0)
    assert cycles.classes(answers.range_largest) == []
    shaken = run.assign({"driveline.tau2": ("time", even + 50.0 * np.sin(2.0 * np.pi * angle))})
    event, _, _ = shaft_answers(study.setup.drive, shaken, run, 5.0, damage)
    assert event.cycles > 0.0 and event.turns_of_steady is None


def test_no_more_runs_are_drawn_beside_each_other_than_fit(study):
    names = [f"jam_{k}" for k in range(6)]
    shaft = shaft_findings(study.findings)
    more = (
        {"steady": each["steady"]} | dict.fromkeys(names, each["jam_left"])
        for each in (shaft.answers, shaft.cycles)
    )
    more = changed(
        study,
        by_analysis=study.findings.by_analysis | {"shaft": ShaftFindings(*more)},
        event_times=study.runs.event_times | dict.fromkeys(names, study.runs.event_times["jam_left"]),
        series=study.runs.series | dict.fromkeys(names, study.runs.series["jam_left"]),
    )
    drawn = _driveline(more)
    panels = list(drawn.all_panels())
    assert len(panels) == 2 * 7 and max(c for _, c, _ in panels) == 2
    # torque above cycles, each with the labels of its own axes
    assert all(drawn.sharing(r, c) == [r] for r, c, _ in panels)
    assert [panel.title for r, _, panel in panels if r % 2 == 0] == [
        more.runs.title_of(name) for name in shaft_findings(more.findings).answers
    ]


@pytest.mark.slow
def test_the_report_shows_it(study, tmp_path):
    assert (tmp_path / "driveline.png") in write(study, tmp_path)
    text = (tmp_path / "report.html").read_text("utf-8")
    reader = Reader(text)
    check_traced(reader, ResultEntries(json.loads((tmp_path / "result.json").read_text())))
    paths = {n["data-path"] for n in reader.numbers}
    assert {
        "findings.shaft.jam_left.amplification",
        "findings.driveline.k_least",
        "findings.driveline.alpha1",
        "given.driveline.exponent",
        "findings.rigid_line.natural_frequency",
        "findings.rigid_line.driver_frequency",
        "findings.rigid_line.ratio",
    } <= paths
    assert "with a rigid shaft" in text
    assert as_dict(study)["torque_cycles"]["jam_left"]
    head, first = (tmp_path / "load_cycle.csv").read_text().splitlines()[:2]
    assert head == "time [s],speed [rad/s],torque [N.m],inertia [kg.m2]"
    # at the motor: J4 and the machine's inertia through the gear
    steady = study.runs.series["start_up"].sel(time=slice(study.runs.steady_begin, None))
    inertia = (float(steady["machine.J"][0]) + study.setup.drive.line.inertia) / 25.0**2
    assert float(first.split(",")[3]) == pytest.approx(inertia, rel=1e-8)
    assert float(first.split(",")[2]) == pytest.approx(float(steady["driveline.tau"][0]), rel=1e-8)
    result = as_dict(study)["driveline"]
    assert result["place"] == "crank" and result["damping_ratio"]["value"] is None


def test_a_coupling_that_opens_lets_line_and_machine_coast(tmp_path):
    """What is behind the coupling keeps the inertia of the line; the energy certificate holds in its run, too."""
    study = run_study(config.parse(f"{SHORT}{LINE}[coupling]\ntrip_torque = 150\n"), tmp_path)
    assert study.findings.failure is None
    jam = study.runs.answers["jam_left"]
    assert 0.0 < jam.coupling_trip_time < 0.2
    coasting = study.runs.series["jam_left_coasting"]
    w = float(study.runs.series["jam_left"]["machine.w0"][-1])
    assert float(coasting["machine.w"][0]) == pytest.approx(w, rel=1e-12)
    assert coasting_parameters(study.setup.drive)["J_added"] == study.setup.drive.line.inertia
    # what stays behind is the energy of the machine before it opened, and of the line's end
    before = float(study.runs.series["jam_left"]["machine.kinetic_energy"][-1])
    assert jam.energy_behind == pytest.approx(before + 0.5 * study.setup.drive.line.inertia * w * w, rel=1e-9)
    assert study.runs.certificate["jam_left"]["driveline_energy_residual_share"] < 1e-3
    # nothing turns what is left alone
    assert not np.any(crank_torque(study.setup.drive, coasting))
    assert "jam_left_coasting" in {clip.name for clip in motion(study).runs}


def test_the_rigid_drive_has_the_same_coupling(tmp_path):
    """Where it opens, both peak near the trip torque: what comes after it is in neither."""
    events = SHORT.replace(JAM, BLOCKED)
    study = run_study(config.parse(f"{events}{LINE}[coupling]\ntrip_torque = 150\n"), tmp_path)
    blocked = shaft_findings(study.findings).answers["blocked"]
    assert study.runs.answers["blocked"].coupling_trip_time is not None
    assert 0.9 * 150.0 < blocked.tau2_rigid < 2.0 * 150.0 and 0.6 < blocked.amplification < 1.5


@pytest.mark.slow
def test_without_a_motor_that_fits_the_shaft_is_that_of_the_nearest(tmp_path):
    sizing = "[sizing]\ncandidates = 1\ninertia_ratio = 1e-6\npoles_least = 2\npoles_most = 2\n"
    text = f"event = []\n{LINE}{sizing}[run]\nstep = 0.002\n"
    study = run_study(config.parse(text), tmp_path)
    assert study.findings.by_analysis["sizing"].chosen_candidate is None and study.setup.insufficient
    assert study.setup.drive.ratio == study.findings.by_analysis["sizing"].best.drive.ratio
    assert (
        set(as_dict(study)["shaft"]) == {"start_up", *study.runs.answers}
        and "steady" in shaft_findings(study.findings).answers
    )
    write(study, tmp_path)


def test_the_speed_loop_is_tuned_and_shown_with_the_line(tmp_path):
    """A heavy J4: the gains are those of rotor, J4 and machine, and so is the loop that is shown."""
    study = run_study(config.parse(f"{SHORT}[driveline]\nJ4 = 20\n"), tmp_path)
    loop, drive = study.setup.statics.loops["mean inertia"], study.setup.drive
    assert loop.inertia > drive.fmu_parameters.rotor.J + 20.0 / 25.0**2
    assert loop.crossover == pytest.approx(study.setup.drive.tuning.crossover, rel=0.05)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("[driveline]\nalpha1 = \"90 deg\"", "driveline.alpha1 = 1.5708 rad (90 deg): a Hooke joint turns only"),
        ("[driveline]\nc2 = 0", "driveline.c2 = 0 N m/rad: must be > 0 N m/rad"),
        ("[driveline]\nc3 = -1", "driveline.c3 = -1 N m/rad: must be > 0 N m/rad"),
        ("[driveline]\nJ4 = 0", "driveline.J4 = 0 kg m2: must be > 0 kg m2"),
        ("[driveline]\nJ1 = 2", "driveline.J1: unknown key; known here: alpha1"),
        ("[driveline]\nc2 = 1\nshaft2 = { section = \"round\", outer = 0.04, length = 1 }",
         "driveline.c2: given beside driveline.shaft2"),
        ("[driveline]\nd2 = 1\ndamping_ratio = 0.1", "driveline.d2: given beside driveline.damping_ratio"),
        ("[driveline]\nshaft3 = { section = \"round\", outer = \"40 mm\" }", "driveline.shaft3.length"),
        ("[driveline]\nexponent = 0", "driveline.exponent = 0: must be >= 1"),
        ('[driveline]\nplace = "roof"', 'driveline.place = "roof": must be "crank" or "motor"'),
    ],
)  # fmt: skip
def test_bad_tables_are_refused(text, line):
    with pytest.raises(InputError) as refusal:
        config.parse(text)
    assert str(refusal.value).startswith(line) and "\n" not in str(refusal.value)


def test_stiffness_from_geometry_and_damping_from_a_ratio(tmp_path):
    """The ratio is that of the vibration of rotor, line and machine at their mean inertia."""
    table = """[driveline]
shaft2 = { section = "hollow", outer = "60 mm", inner = "40 mm", length = "1 m" }
c3 = 5e4
damping_ratio = 0.04
"""
    drive = choose(config.parse(SHORT + table), tmp_path, lambda *_: None).drive
    line = driveline_of(drive)
    assert line.c2 == pytest.approx(stiffness(hollow(0.06, 0.04), 1.0)) and line.c3 == 5e4
    feed = config.parse(SHORT).feed
    J = cycle(drive.machine, 6.0, feed).outputs.J
    c = 1.0 / (1.0 / line.c2 + 1.0 / line.c3)
    J1, J4 = drive.fmu_parameters.rotor.J * line.ratio**2, line.J4 + float(np.mean(J)) * line.ratio**2
    k = np.sqrt(c * (1.0 / J1 + 1.0 / J4))
    d = 1.0 / (1.0 / line.d2 + 1.0 / line.d3)
    # of one degree of freedom with the reduced inertia
    assert d * (1.0 / J1 + 1.0 / J4) / (2.0 * k) == pytest.approx(0.04, rel=1e-12)


def test_a_step_that_is_too_long_for_the_shaft_is_refused(tmp_path):
    stiff = config.parse(f"{SHORT}[driveline]\nc2 = 1e7\nc3 = 1e7\n")
    with pytest.raises(
        InputError, match=r"run.step = 0.001 s: the driveline swings at \d+ rad/s; must be <= 0.000"
    ):
        run_study(stiff, tmp_path)


def test_export_of_the_studys_line(tmp_path):
    loaded = config.parse(SHORT + LINE)
    drive = choose(loaded, tmp_path).drive
    assert start_of(drive, loaded.operation, MODELS["ChamberForces"])["ratio"] == 1.0
    start = start_of(drive, loaded.operation, MODELS["CardanDriveline"])
    assert (
        start["ratio"] == 25.0 and start["d2"] == 20.0 and start["alpha2"] == pytest.approx(np.radians(8.0))
    )
    with pytest.raises(InputError, match=r"the study has no \[driveline\]"):
        start_of(choose(config.parse(SHORT), tmp_path).drive, loaded.operation, MODELS["CardanDriveline"])
    message = export_study(loaded, tmp_path / "x.ssp", backend="python")
    assert "driveline (CardanDriveline)" in message
    assert ("driveline.driven.w", "machine.w") in drive.graph.connections
    assert ("driveline.tau_bias", "motor.load.tau_bias") in drive.graph.connections
