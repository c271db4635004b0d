"""Wrong study files, as people write them, with what a run tells of each."""

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
    ("[ratios]\nmu = 1.0", [(2, "ratios.mu", "must be > 0 and <= 0.999")]),
    ("[ratios]\nrho = 0.1\n[machine]\nr = 0.2", [(4, "machine.r", "leave out one of the two")]),
    ("[run]\ncrank_speed = '3 1/s'", [(2, "run.crank_speed", 'such as "2 rev/min"')]),
    ("[run]\ncrank_speed = '30 RPM'", [(2, "run.crank_speed", 'was "30 rpm" meant?')]),
    ("[run]\nstep = 1", [(2, "run.step", 'was "1 ms" meant?')]),
    ("[run]\nturns = 2.5", [(2, "run.turns", "must be a whole number")]),
    ("[coupling]\ntrip = '4 kNm'", [(2, "coupling.trip", "known here: trip_torque")]),
    ("[coupling]\ntrip_torque = '4 kN'", [(2, "coupling.trip_torque", 'such as "2 N m"')]),
    ("[[event]]\ntype = 'jamm'", [(2, "event 1: type", 'was "jam" meant?')]),
    ("[[event]]\nside = 'left'", [(1, "event 1: type", "must be given, one of jam, lumps")]),
    ("[[event]]\ntype = 'jam'", [(1, "event 1 (jam): side", '"left" or "right"')]),
    (
        "[[event]]\ntype='dip'\n\n[[event]]\ntype = 'jam'\nside = 'left'\nforce = '3 m'",
        [(7, "event.jam_left.force", 'such as "2 N"')],
    ),
    ("[[event]]\ntype = 'jam'\nside = 'up'", [(3, "event 1 (jam): side", '"left" or "right"')]),
    ("[[event]]\ntype = 'lumps'\nside = 'left'\nnumber = 1.5", [(4, "event.lumps_left.number", "whole number")]),
    ("[event]\ntype = 'jam'", [(1, "event", "each below [[event]]")]),
    ("[system]\nmachine = 'KnifeDriv'", [(2, "system.machine", 'was "KnifeDrive" meant?')]),
    ("[system]\nmotor = 'DcMotr'", [(2, "system.motor", 'was "DcMotor" meant?')]),
    ("[system]\nmotor = 'IE3 4-pole 2,2 kW, 100L'", [(2, "system.motor", 'was "IE3 4-pole 2.2 kW, 100L" meant?')]),
    ("[system]\nmotor = 'pump.fmu'", [(2, "system.motor", "no such FMU")]),
    ("[run]\nturns = '500 %'", [(2, "run.turns", "must be a whole number")]),
    (
        "[system]\nmotor = 'InductionMotor'\n[motor]\npole_pairs = 2.5\ninverter.on = 2",
        [
            (4, "motor.pole_pairs = 2.5", "must be a whole number >= 1 and <= 24"),
            (5, "motor.inverter.on = 2", "must be true or false"),
        ],
    ),
    ("[feed]\nleft.processing_force = '1,500 N'", [(2, "feed.left.processing_force", "must be a number in N")]),
    ("[feed]\nleft.processing_force = '2*1000 N'", [(2, "feed.left.processing_force", "must be a number in N")]),
    ('catalogue = "a\\u0000b"\n[sizing]', [(1, "catalogue", "has U+0000")]),
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
        [(2, "driveline.c2", "leave out one of the two"), (3, "driveline.shaft2.length", "missing")],
    ),
    (
        "[driveline]\nd2 = 1\nd3 = 1\ndamping_ratio = 0.1\nshaft2 = { section = 'hollow', outer = 1, wall = 1 }",
        [
            (2, "driveline.d2", "leave out one of the two"),
            (3, "driveline.d3", "leave out one of the two"),
            (5, "driveline.shaft2.inner", "missing"),
            (5, "driveline.shaft2.length", "missing"),
            (5, "driveline.shaft2.wall", 'not of section "hollow"'),
        ],
    ),
    (
        "[machine]\nr = '0.9 m'\n[run]\nturn = 3\n[sizing]\npoles_least = 6\npoles_most = 4\nambient = '20 C'",
        [
            (2, "machine: r = 0.9 m", "must be > 0 and < 0.703476 m"),
            (4, "run.turn", 'was "turns" meant?'),
            (7, "sizing.poles_most", "must be >= sizing.poles_least"),
        ],
    ),
    (
        "[driveline]\n[torsion]\nslowest = 3\nfastest = 2\npoints = 10.5\njoint = 'alpha3'",
        [
            (4, "torsion.fastest", "must be > torsion.slowest"),
            (5, "torsion.points", "must be a whole number"),
            (6, "torsion.joint", 'was "alpha2" meant?'),
        ],
    ),
    (
        "[driveline]\n[torsion]\nslowest = '3 m'\nfastest = 0.1\npoints = 10.5",
        [(3, "torsion.slowest", "must be a pure number"), (5, "torsion.points", "must be a whole number")],
    ),
    (
        "[run]\nstep = 1\n[machine]\nr = 1\n[system]\nmachine = 'knifedrive'\nmotor = 'IE3 4 pole 2.2kW'\n"
        "[coupling]\ntrip_torque = 0",
        [
            (2, "run.step", "must be"),
            (6, "system.machine", 'was "KnifeDrive" meant?'),
            (7, "system.motor", 'was "IE3 4-pole 2.2 kW, 100L" meant?'),
            (9, "coupling.trip_torque", "must be > 0 N m"),
        ],
    ),
    (
        "[ratios]\nrho = 0.1\n[machine]\nr = '15 cm'\nl = 1.5",
        [(4, "machine.r", "leave out one of the two"), (5, "machine.l", "leave out one of the two")],
    ),
    ("[sizing]\n[gear]\nratio = 0\nefficiency = '120 %'\nJ = '1 kg'", [
        (3, "gear.ratio", "must be > 0"), (4, "gear.efficiency", "<= 1"), (5, "gear.J", 'such as "2 kg m2"'),
    ]),
    ("[motor]\nrotor = { J = 0 }\nsupply = 3", [(2, "motor.rotor.J", "> 0"), (3, "motor.supply", "known here")]),
    ("[feed]\nleft.mass = 30\nright.processing_force = '1 kNm'", [
        (2, "feed.left.mass", "known here: material_mass"), (3, "feed.right.processing_force", 'such as "2 N"'),
    ]),
    ("[machine]\nr = nan\n[run]\nstep = inf\n[feed]\nleft.material_mass = -inf", [
        (2, "machine.r = nan m", "must be finite"), (4, "run.step = inf s", "must be finite"),
        (6, "feed.left.material_mass = -inf kg", "must be finite"),
    ]),
    (f"[machine]\nr = 1e300\ncrank.m = '1e308 kg'\nl = {400 * '9'}", [
        (2, "machine.r", "<= 10000 m"), (3, "machine.crank.m", "<= 1e+06 kg"), (4, "machine.l", "too large"),
    ]),
    ("[run]\ncrank_speed = '1,500 rpm'", [(2, "run.crank_speed", 'was "1500 rpm" or "1.500 rpm" meant?')]),
    ("[machine]\ng = '9,81 m/s²'", [(2, "machine.g", 'was "9.81 m/s^2" meant?')]),
    ("[driveline]\nshaft2 = { section = 'tube', outer = 3 }", [(2, "driveline.shaft2.section", '"round", "hollow"')]),
    ("title = ['a']\nproject = 'x'", [(1, "title", "a text"), (2, "project", "it stands in [report]")]),
    ("machine = 'KnifeDrive'", [(1, "machine", "must be a table")]),
    ("[[machine]]\nr = 3", [(1, "machine = [{ r = 3 }]", "must be a table, below [machine]")]),
    ("machine:\n  r: 150 mm", [(1, "no valid TOML", "it is YAML")]),
    ("designation;power [kW];voltage;poles", [(1, "no valid TOML", "it is a CSV table")]),
    ("<?xml version='1.0'?>", [(0, "", "is HTML or XML")]),
    ("[driveline]\nalpha1 = '95 deg'", [(1, "driveline.alpha1", "must be < 1.5708 rad")]),
    ("[monte_carlo]\nevent = { force = [5000, 100] }", [(2, "monte_carlo.event.force", ">= the first")]),
    ("[torsion]\npoints = 50", [(1, "torsion", "add [driveline]")]),
    ("[[motor]]\ndesignation = 'x'", [(1, "motor", "name this file in a study file by catalogue")]),
    ("designation,power [kW],voltage,poles\nx,1,2,3", [(1, "no valid TOML", "it is a CSV table")]),
    (
        "[report]\nunits = { speed = 'a', sped = 'b', power = 3 }",
        [
            (2, "report.units.speed", '"rad/s" or "rev/min"'),
            (2, "report.units.sped", 'was "speed" meant?'),
            (2, "report.units.power = 3", '"W" or "kW"'),
        ],
    ),
    (
        "[[event]]\ntype = 'jam'\nside = 'lef'\nname = 'Big one'\nforce = '3 m'\n[[event]]\ntype = 'jam'",
        [
            (3, 'event 1 (jam): side = "lef"', 'was "left" meant?'),
            (4, 'event 1 (jam): name = "Big one"', "must be small letters"),
            (5, "event.jam.force", 'such as "2 N"'),
            (6, "event 2 (jam): side", "must be given"),
        ],
    ),
    (
        "[run]\nstep = 1\n[monte_carlo]\n[monte_carlo.event]\nside = 'up'\nturns = 2\nforce = [1, 2, 3]\n"
        "duration = ['1 s', '1 m']\nfoce = 3",
        [
            (2, "run.step", "must be"),
            (5, "monte_carlo.event.side", '"left" or "right"'),
            (6, "monte_carlo.event.turns", "at any crank angle"),
            (7, "monte_carlo.event.force = [1, 2, 3]", "from where to where"),
            (8, "monte_carlo.event.duration", 'such as "2 s"'),
            (9, "monte_carlo.event.foce", 'was "force" meant?'),
        ],
    ),
    (
        "[machine]\nr = 150 mm\nl = 1,5 # m\n[run]\nturns = .5\n[report]\nauthor = Ann",
        [
            (2, "no valid TOML: r = 150 mm", 'r = "150 mm"'),
            (3, "no valid TOML: l = 1,5", "l = 1.5"),
            (5, "no valid TOML: turns = .5", "turns = 0.5"),
            (7, "no valid TOML: author = Ann", 'author = "Ann"'),
        ],
    ),
    ("feed_forward = True", [(1, "no valid TOML: feed_forward = True", "feed_forward = true")]),
    ("[run]\n[machine]\n[run]", [(3, "no valid TOML", "[run] stands twice, first in line 1")]),
    ("[run]\nturns = 1\nturns = 2", [(3, "no valid TOML", "turns stands twice")]),
    (
        'motor = "induction"\n[motor]\n',
        [(2, "no valid TOML", "[motor] is a table, and line 1 sets motor to a value; [system] has the key motor")],
    ),
    ("title = 'a", [(1, "no valid TOML", "a quotation mark is missing")]),
    ("title =\n", [(1, "no valid TOML: title =", "invalid value")]),
    ("[machine\nr = 1", [(1, "no valid TOML: [machine", "']'")]),
    (f"[machine]\nr = 1{5000 * '0'}", [(2, "no valid TOML", "more than 4300 digits")]),
    # characters that no XML has, in a text, a list, a name and a raw text
    (
        'title = "a\\u0007b"\n[report]\nauthor = "Ann\\u001b[2J"\n[[event]]\ntype = "jam"\nname = "x\\uFFFE"',
        [(1, "title", "U+0007"), (3, "report.author", "U+001B"), (6, "event.1.name", "U+FFFE")],
    ),
    ('title = "a\ufffeb"\n"na\\u0085me" = 1', [(1, "title", "U+FFFE"), (2, "na", "its name has U+0085")]),
    ('{"a": 1}', [(1, "no valid TOML", "it is JSON")]),
    ("PK\x03\x04", [(0, "", "is a ZIP archive, such as an FMU")]),
    (
        "organs = 'chain'\n[machine]\nr = '3 kg'\ncrank = { m = -3 }\n[run]\nstep = 1\n[[event]]\ntype = 'jamm'",
        [
            (1, "organs", "was"),
            (3, "machine.r", "such as"),
            (4, "machine.crank.m", "must be"),
            (6, "run.step", "must be"),
            (8, "event 1: type", "must be"),
        ],
    ),
    (
        "[sizing]\npoles_least = 6\npoles_most = 4\n[ratios]\nmu = 1.0\n[run]\nturns = 1.5",
        [
            (3, "sizing.poles_most", "must be"),
            (5, "ratios.mu", "must be > 0 and <= 0.999"),
            (7, "run.turns", "must be a whole number"),
        ],
    ),
    (
        "[sweep]\nmethod = 'gird'\npoints = 2.5\n[[sweep.parameter]]\nname = 'machine.r'\nfrom = '9 kg'\nto = 1",
        [(2, "sweep.method", '"grid", "latin_hypercube" or "sobol"'), (3, "sweep.points", "must be a whole number"),
         (6, "sweep.parameter.1.from", 'such as "2 mm"')],
    ),
    (
        "[sweep]\nquantities = ['peak(crank_torqe)']\nmeasures = ['stall']\nbest = 'rms(tau)'\n"
        "[[sweep.parameter]]\nname = 'machine.rr'\nfrom = '90 mm'\nto = 1\n"
        "[[sweep.parameter]]\nname = 'machine.l1'\ntolerance = '2 kg'\npoints = 3\n"
        "[[sweep.parameter]]\nname = 'machine.l'\nto = '2 m'\n"
        "[[sweep.parameter]]\nname = 'machine.h'\nfrom = '2 m'\nto = 1\n",
        [
            (1, "sweep.event", "must be given, one of"),
            (2, 'sweep.quantities: "peak(crank_torqe)"', 'was "crank_torque" meant?'),
            (3, 'sweep.measures: "stall"', "must be one of crank_torque_peak"),
            (4, "sweep.best", "must be one of the quantities and measures of the sweep"),
            (6, "sweep.parameter.1.name", 'was "machine.r" meant?'),
            (11, "sweep.parameter.2.tolerance", 'such as "2 mm"'),
            (12, "sweep.parameter.2.points", "is of a grid"),
            (13, "sweep.parameter.3.from", "must be given, beside the other end"),
            (19, "sweep.parameter.4.to", "must be > from, 2"),
        ],
    ),
    (
        "[feed]\nleft.material_mass = 0\nright.material_mass = 0\n[watch]\nfile = 'a.csv'\n",
        [(4, "watch", "watches for a feed that moves to one side"), (5, "watch.file", "there is no such file")],
    ),
    ("[identify]", [(1, "identify.parameter", "is missing; add"), (1, "identify.run", "is missing; add")]),
    (
        "[[identify.parameter]]\nname = 'machine.left.web_mas'\nfrom = 1\nto = 2\n"
        "[[identify.parameter]]\nname = 'machine.left.web_mass'\nfrom = '40 kg'\nto = '12 kg'\n"
        "[[identify.parameter]]\nname = 'feed.left.processing_force'\ndeviation = '-5 %'\n"
        "[[identify.parameter]]\nname = 'machine.crank.m'\nfrom = 1\n"
        "[[identify.parameter]]\nname = 'machine.ratio'\ndeviation = 1\n"
        "[[identify.run]]\nname = 'Loaded run'\nbegin = '9 s'\nend = '3 s'\n"
        "[identify.run.columns]\n'motor.current' = 'I'\n"
        "[[identify.run]]\nfile = 'b.csv'\nfeed = 'half'\nadded = { 'machine.left.web_mass' = '15 m' }\n"
        "[[identify.sensor]]\ncolumn = 'mark'\n[[identify.sensor]]\ncolumn = 'motor.i'\noffset = '1 V'\n",
        [
            (2, "identify.parameter.1.name", 'was "machine.left.web_mass" meant?'),
            (8, "identify.parameter.2.to", "must be > from, 40 kg"),
            (11, "identify.parameter.3.deviation", "must be > 0"),
            (12, "identify.parameter.4 (machine.crank.m)", "must have from and to, or the standard deviation"),
            (16, "identify.parameter.5.name", "count the teeth"),
            (18, "identify.run.1.file", "must be given"),
            (19, "identify.run.1.name", "must begin with a small letter"),
            (21, "identify.run.1.end", "must be > begin"),
            (23, "identify.run.1.columns.motor.current", "no such quantity"),
            (25, "identify.run.2.file", "there is no such file"),
            (26, "identify.run.2.feed", 'must be "same" or "none"'),
            (29, "identify.sensor.1.column", "must be one of motor.i"),
            (32, "identify.sensor.2.offset", "a number in A"),
        ],
    ),
    (
        "[[identify.parameter]]\nname = 'machine.left.web_mass'\nfrom = 1\nto = 2\n"
        "[[identify.run]]\nfile = 'a.csv'\nname = 'mark'\n"
        "[[identify.run]]\nfile = 'a.csv'\nname = 'b'\n[[identify.run]]\nfile = 'b.csv'\nname = 'b'\n",
        [
            (6, "identify.run.1.file", "there is no such file"),
            (7, "identify.run.1.name", "stands for the mark of a turn"),
            (9, "identify.run.2.file", "there is no such file"),
            (12, "identify.run.3.file", "there is no such file"),
            (13, "identify.run.3.name", "is the name of another run"),
        ],
    ),
    ("organ = 'chain'\n[identify]\n[driveline]", [
        (2, "identify", "driveline stands between"), (2, "identify", "organs are chains")]),
    ("[sweep]\n[sizing]", [(1, "sweep", "leave out one of the two")]),
    ("[sweep]\nmethod = 'grid'\npoints = 3", [(3, "sweep.points", "a grid has the points of its parameters")]),
    ("[[sweep.parameter]]\nname = 'machine.r'", [(1, "sweep.parameter.1 (machine.r)", "has no values")]),
]  # fmt: skip
