"""Wrong files, as people write them: each fault is told in one run, with line, key and remedy."""

import re

import pytest
from command import chainunit

# the file, and for each fault its line, its key and words of the remedy
FILES = [
    ("organs = 'chain'", [(1, "organs", 'was "organ" meant?')]),
    ("[machine]\nr = '150 kg'", [(2, "machine.r", 'such as "2 mm"')]),
    ("[machine]\nr = '1,5 m'", [(2, "machine.r", 'was "1.5 m" meant?')]),
    ("[machine]\nr = -0.1", [(2, "machine.r", "must be > 0 m")]),
    ("[machine]\nr = true", [(2, "machine.r", "must be a number in m")]),
    ("[machine]\ncrank.mass = 3", [(2, "machine.crank.mass", "known here: m, s, I")]),
    ("[machine]\n\n# a comment\ncrank = { m = -3 }", [(4, "machine.crank.m", "must be >= 0 kg")]),
    ("[machine]\nwebshare = 1", [(2, "machine.webshare", 'was "web_share" meant?')]),
    ("[machine]\ncrank_speed = 3", [(2, "machine.crank_speed", "it stands in [run]")]),
    ("[machine]\nfeed_forward = true", [(2, "machine.feed_forward", "it stands before all tables")]),
    ("[machin]\nr = 1", [(1, "machin", 'was "machine" meant?')]),
    ("[machine]\nr = 0.9", [(2, "machine: r", "must be > 0 and < 0.703476 m")]),
    ("[ratios]\nmu = 1.0", [(1, "ratios: rho = 0.1, mu", "mu = e/l1 < 1")]),
    ("[ratios]\nrho = 0.1\n[machine]\nr = 0.2", [(4, "machine.r", "leave out one of the two")]),
    ("[run]\ncrank_speed = '3 1/s'", [(2, "run.crank_speed", 'such as "2 rev/min"')]),
    ("[run]\ncrank_speed = '30 RPM'", [(2, "run.crank_speed", 'was "30 rpm" meant?')]),
    ("[run]\nstep = 1", [(2, "run.step", 'was "1 ms" meant?')]),
    ("[run]\nturns = 2.5", [(2, "run.turns", "must be a whole number")]),
    ("[coupling]\ntrip = '4 kNm'", [(2, "coupling.trip", "known here: trip_torque")]),
    ("[coupling]\ntrip_torque = '4 kN'", [(2, "coupling.trip_torque", 'such as "2 N m"')]),
    ("[[event]]\ntype = 'jamm'", [(1, "event 1: type", 'was "jam" meant?')]),
    ("[[event]]\nside = 'left'", [(1, "event 1: type", "must be given, one of jam, lumps")]),
    ("[[event]]\ntype = 'jam'", [(1, "event 1 (jam): side", '"left" or "right"')]),
    (
        "[[event]]\ntype='dip'\n\n[[event]]\ntype = 'jam'\nside = 'left'\nforce = '3 m'",
        [(7, "event.jam_left.force", 'such as "2 N"')],
    ),
    ("[[event]]\ntype = 'jam'\nside = 'up'", [(1, "event 1 (jam): side", '"left" or "right"')]),
    ("[[event]]\ntype = 'lumps'\nside = 'left'\nnumber = 1.5", [(4, "event.lumps_left.number", "whole number")]),
    ("[event]\ntype = 'jam'", [(1, "event", "each below [[event]]")]),
    ("[system]\nmachine = 'KnifeDriv'", [(2, "system.machine", 'was "KnifeDrive" meant?')]),
    ("[system]\nmotor = 'DcMotr'", [(2, "system.motor", 'was "DcMotor" meant?')]),
    ("[system]\nmotor = 'IE3 4-pole 2,2 kW, 100L'", [(2, "system.motor", 'was "IE3 4-pole 2.2 kW, 100L" meant?')]),
    ("[system]\nmotor = 'pump.fmu'", [(2, "system.motor", "no such FMU")]),
    ("[run]\nturns = '500 %'", [(2, "run.turns", "must be a pure number")]),
    ("[feed]\nleft.processing_force = '1,500 N'", [(2, "feed.left.processing_force", "must be a number in N")]),
    ("[feed]\nleft.processing_force = '2*1000 N'", [(2, "feed.left.processing_force", "must be a number in N")]),
    ('catalogue = "a\\u0000b"\n[sizing]', [(1, "catalogue", "must be the name of a file")]),
    (f"[system]\nmotor = '{5000 * 'x'}.fmu'", [(2, "system.motor", "must be the name of a file")]),
    (
        "[machine]\ncrank.m = '30 mg'\n[run]\nturns = 2.5",
        [(4, "run.turns = 2.5: must be a whole number", "must be a whole number")],
    ),
    ("start = 'softly'\n[sizing]", [(1, "start", 'was "soft" meant?')]),
    ("start = 'soft'", [(1, "start", "add [sizing] or system.motor")]),
    ("organ = 'belt'", [(1, "organ", '"two-bar" or "chain"')]),
    ("[sizing]\n[motor]\nrotor = { J = 1 }", [(2, "motor", "leave out one of the two")]),
    ("[sizing]\npoles_least = 6\npoles_most = 4", [(3, "sizing.poles_most", "must be >= sizing.poles_least")]),
    ("catalogue = 'none.csv'\n[sizing]", [(1, "catalogue", "none.csv: cannot be read")]),
    ("[report]\nunits = { speed = 'rpm' }", [(2, "report.units.speed", '"rad/s" or "rev/min"')]),
    ("[report]\nunits = { sped = 'rpm' }", [(2, "report.units.sped", 'was "speed" meant?')]),
    (
        "[driveline]\nc2 = 3\nshaft2 = { section = 'round', outer = '30 mm' }",
        [(2, "driveline.c2", "leave out one of the two")],
    ),
    ("[driveline]\nalpha1 = '95 deg'", [(1, "driveline.alpha1", "must be < 1.5708 rad")]),
    ("[monte_carlo]\nevent = { force = [5000, 100] }", [(2, "monte_carlo.event.force", ">= the first")]),
    ("[torsion]\npoints = 50", [(1, "torsion", "add [driveline]")]),
    ("[[motor]]\ndesignation = 'x'", [(1, "motor", "name this file in a study file by catalogue")]),
    ("designation,power [kW],voltage,poles\nx,1,2,3", [(0, "no valid TOML", "it is a CSV table")]),
    ('{"a": 1}', [(0, "no valid TOML", "it is JSON")]),
    ("PK\x03\x04", [(0, "", "is a ZIP archive, such as an FMU")]),
    (
        "organs = 'chain'\n[machine]\nr = '3 kg'\ncrank = { m = -3 }\n[run]\nstep = 1\n[[event]]\ntype = 'jamm'",
        [
            (1, "organs", "was"),
            (3, "machine.r", "such as"),
            (4, "machine.crank.m", "must be"),
            (6, "run.step", "must be"),
            (7, "event 1: type", "must be"),
        ],
    ),
    (
        "[sizing]\npoles_least = 6\npoles_most = 4\n[ratios]\nmu = 1.0\n[run]\nturns = 1.5",
        [
            (3, "sizing.poles_most", "must be"),
            (4, "ratios: rho", "needs"),
            (7, "run.turns", "must be a whole number"),
        ],
    ),
]  # fmt: skip


def test_the_list_is_long_enough():
    assert len(FILES) >= 40


@pytest.mark.parametrize(("text", "faults"), FILES, ids=[str(k) for k in range(len(FILES))])
def test_every_fault_has_its_line_key_and_remedy(text, faults, tmp_path):
    (tmp_path / "mine.toml").write_text(text, "utf-8")
    done = chainunit("study", "mine.toml", "-o", "out", cwd=tmp_path)
    assert done.returncode == 2 and not done.stdout and not (tmp_path / "out").exists()
    said = [line for line in done.stderr.splitlines() if not line.startswith("Remark")]
    assert len(said) == len(faults), said
    for line, (number, key, remedy) in zip(said, faults, strict=True):
        place = f"mine.toml:{number}: " if number else "mine.toml: "
        assert re.match(rf"chainunit: {re.escape(place)}{re.escape(key)}", line), line
        assert remedy in line, line
        assert not (number == 4 and "crank.m" in line and key.startswith("run")), line
