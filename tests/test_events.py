"""Events of a study file: their declarations, their signals over time, and a new type, which is one class."""

from __future__ import annotations

import json
import math
import pickle
from pathlib import Path

import numpy as np
import pytest
from event_tables import STANDARD, event_line

from chainunit.core.errors import InputError
from chainunit.core.quantities import Layout, Value, declaration, quantity
from chainunit.drives.dc_motor import DcMotor
from chainunit.drives.induction_motor import InductionMotor
from chainunit.machines.linkages.file import read_linkage
from chainunit.machines.machine import Machine
from chainunit.reading.result_entries import ResultEntries
from chainunit.study import config
from chainunit.study.catalogue_drive import catalogue_drive
from chainunit.study.cycle import cycle
from chainunit.study.drive import Drive
from chainunit.study.event import TYPES, Event, Role, Timing, angle_of_begin, in_groups
from chainunit.study.event_table import read_events, read_random_event
from chainunit.study.events import one_sided_event
from chainunit.study.readings import crank_angle, only_whole_turns
from chainunit.study.result import as_dict
from chainunit.study.rig import Rig
from chainunit.study.run import run_study
from chainunit.study.start_up import start_up
from chainunit.study.transients import follow, lead_times, longest_lead
from chainunit.system import Profile

QUICK = "[run]\nramp = 0.3\nsettle_turns = 1\nstep = 0.004\ncrank_speed = 6\n[machine]\nratio = 25\n"


def test_events_are_named_after_type_and_side():
    assert tuple(config.load().events) == STANDARD
    text = "".join(
        f'[[event]]\ntype = "jam"\nside = "right"\n{more}\n'
        for more in ('force = "3 kN"', "force = 4000", 'name = "hard"', "")
    )
    events = config.parse(text).events
    assert list(events) == ["jam_right", "jam_right_2", "hard", "jam_right_3"]
    assert [event.p.force for event in events.values()] == [3000.0, 4000.0, 2000.0, 2000.0]
    assert [event.title for event in events.values()] == [
        "a lump jams the right side",
        "a lump jams the right side (2)",
        "a lump jams the right side (hard)",
        "a lump jams the right side (3)",
    ]
    assert events["hard"].short == "jam right hard"
    assert config.parse("event = []").events == {}


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("event = 3", "event = 3: "),
        ("event = [3]", "event 1 = 3: must be a table"),
        ('[[event]]\ntype = "jamm"', 'event 1: type = "jamm": must be one of jam, lumps'),
        ('[[event]]\ntype = "jam"', 'event 1 (jam): side: must be given, "left" or "right"'),
        ('[[event]]\ntype = "jam"\nside = "up"', 'event 1 (jam): side = "up": must be "left" or "right"'),
        ('[[event]]\ntype = "dip"\nside = "left"', "event 1 (dip): side: this event has none"),
        (
            '[[event]]\ntype = "jam"\nside = "left"\nforce = -1',
            "event.jam_left.force = -1 N: must be >= 0 N",
        ),
        (
            '[[event]]\ntype = "jam"\nside = "left"\nforc = 1',
            'event.jam_left.forc: unknown key; was "force" meant? known here: crank_angle, turns, force',
        ),
        ('[[event]]\nside = "left"', "event 1: type: must be given, one of jam, lumps, "),
        ('[[event]]\ntype = "dip"\nname = "Dip 1"', 'event 1 (dip): name = "Dip 1": must be small letters'),
        (
            '[[event]]\ntype = "dip"\nname = "steady"',
            'event 1 (dip): name = "steady": is the name of another',
        ),
        ('event = [{ type = "dip" }, { type = "blocked", name = "dip" }]', 'event 2 (blocked): name = "dip"'),
        ('[[event]]\ntype = "lumps"\nside = "left"\nnumber = 2.5', "event.lumps_left.number = 2.5: must be"),
        ("[monte_carlo]\nevent = { crank_angle = 1 }", "monte_carlo.event.crank_angle: is not of random"),
        ('[monte_carlo]\nevent = { type = "start" }', 'monte_carlo.event.type = "start": must be an event'),
        ("[monte_carlo]\nevent = { force = [1, 2, 3] }", "monte_carlo.event.force = [1, 2, 3]: must be a"),
        ('[monte_carlo]\nevent = { force = [1, "x"] }', 'monte_carlo.event.force = "x": must be a number'),
        ("[overload]\njam_force = 3", "overload: unknown key"),
        ('events = ["jam_left"]', "events: unknown key"),
    ],
)
def test_refusals(text, line):
    with pytest.raises(InputError) as caught:
        config.parse(text)
    assert str(caught.value).startswith(line) and "\n" not in str(caught.value)


def rig_of(text=""):
    values = config.parse(text)
    return Rig(values.operation, Drive(DcMotor, values.motor.parameters, values.machine), {})


def at(signal, t):
    return float(signal(t)) if callable(signal) else float(signal)


def test_what_lumps_and_jams_do_over_time():
    """Each lump rises to its force on top of the feed, holds, falls, and the next comes after the pause."""
    rig = rig_of("[feed]\nright = { processing_force = 50 }\n")
    lumps = TYPES["lumps"]
    p = lumps.Parameters(force=700.0, duration=0.2, rise=0.05, number=3.0, pause=0.5)
    (signal,) = rig.event_signals(lumps.on("right", p), 1.0, {}).values()
    for k in range(3):
        begin = 1.0 + 0.8 * k
        for t, force in ((-0.001, 50.0), (0.025, 400.0), (0.05, 750.0), (0.25, 750.0), (0.3001, 50.0)):
            assert at(signal, begin + t) == pytest.approx(force, abs=1e-6)
    assert at(signal, 1.0 + 2.4 + 0.1) == 50.0
    # the last lump is gone after 1.9 s; a turn more is followed
    assert lumps.on("right", p).time_followed(0.1) == pytest.approx(2.0)
    assert lumps.on("right", p).time_followed(10.0) == pytest.approx(21.0)
    jam = TYPES["jam"]
    assert set(Layout(jam.Parameters).names) < set(Layout(lumps.Parameters).names)


@pytest.mark.parametrize("kind", [name for name, of in TYPES.items() if not of.from_rest])
def test_an_event_is_followed_to_its_end_and_a_turn_more(kind):
    """However long it lasts, and however short the turns that are asked for are."""
    of, turn = TYPES[kind], 0.25
    longer = {n: 7.0 for n in Layout(of.Parameters).names if n in ("duration", "shift")}
    event = of.on(
        "left" if of.has_side else "",
        of.Parameters(turns=1.0, **longer),
        input_name="load" if of.has_input else "",
    )
    normal = dict.fromkeys(event.inputs, 50.0)
    signals = event.signals(normal, 0.0, dict.fromkeys(event.reads, 0.1)).values()
    end = event.time_followed(turn) - turn
    assert end >= (7.0 if longer else 0.0)
    for signal in signals:
        assert at(signal, end + 1e-9) == at(signal, end + 100.0)
    assert of.on(event.side, of.Parameters(turns=200.0, **longer)).time_followed(turn) == pytest.approx(
        200.1 * turn
    )


def test_an_overload_is_on_top_of_the_load():
    rig = rig_of('[system]\nmachine = "Accelerator"\n[feed]\nload = 300\n')
    overload = TYPES["overload"]
    event = overload.on("", overload.Parameters(torque=800.0, duration=0.4, rise=0.1))
    assert rig.takes(event) and not rig_of().takes(event)
    ((name, signal),) = rig.event_signals(event, 1.0, {}).items()
    assert name == "machine.load"
    for t, torque in (
        (0.99, 300.0),
        (1.05, 700.0),
        (1.1, 1100.0),
        (1.5, 1100.0),
        (1.55, 700.0),
        (1.61, 300.0),
    ):
        assert at(signal, t) == pytest.approx(torque)


@pytest.mark.parametrize("share", [1.0, 0.25])
def test_feed_that_moves_keeps_its_mass(share):
    rig = rig_of("[feed]\nleft = { material_mass = 40 }\nright = { material_mass = 20 }\n")
    feed = TYPES["feed"]
    event = feed.on("left", feed.Parameters(share=share, shift=0.5))
    signals = rig.event_signals(event, 1.0, {})
    left, right = (signals[f"machine.{side}.material_mass"] for side in ("left", "right"))
    for t in np.linspace(0.5, 2.0, 16):
        assert at(left, t) + at(right, t) == pytest.approx(60.0)
    assert (at(left, 9.0), at(right, 9.0)) == pytest.approx((40.0 + share * 20.0, (1.0 - share) * 20.0))
    assert event.empties == (share == 1.0)
    start = TYPES["start"].on("left", TYPES["start"].Parameters(share=share))
    ends = {name: at(signal, 9.0) for name, signal in signals.items()}
    assert rig.event_signals(start, 0.0, {}) == ends


def test_what_the_system_lacks_is_left_out():
    """A DC motor has no voltage of the line; an induction motor has."""
    dip = TYPES["dip"].on()
    rig = rig_of()
    assert not rig.takes(dip)
    line = Rig(rig.operation, Drive(InductionMotor, InductionMotor.Parameters(), rig.drive.machine), {})
    assert line.takes(dip)
    (signal,) = line.event_signals(dip, 2.0, {}).values()
    assert isinstance(signal, Profile)
    assert [at(signal, t) for t in (1.9, 2.1, 2.4)] == pytest.approx([1.0, 0.5, 1.0])


def test_variants_span_a_decade():
    blocked = TYPES["blocked"].on()
    soft, stiff = blocked.variants()
    assert stiff.p.stiffness == pytest.approx(10.0 * soft.p.stiffness)
    # the damping ratio, damping over the root of the stiffness, stays
    for variant in (soft, stiff):
        ratio = variant.p.damping / math.sqrt(variant.p.stiffness)
        assert ratio == pytest.approx(blocked.p.damping / math.sqrt(blocked.p.stiffness))
    assert TYPES["jam"].on("left").variants() == ()


def test_groups_are_by_the_side_that_carries():
    text = event_line("right_empties", "blocked", "jam_right", "feed_left")
    events = config.parse(text).events
    assert in_groups(events, list(events)) == [["right_empties", "feed_left"], ["jam_right"], ["blocked"]]
    assert in_groups(events, ["blocked", "steady"]) == [["blocked"]]


def test_random_overloads_draw_what_the_event_declares():
    """Without a word of the file the force of a jam; with one, the quantities that it gives as ranges."""
    random = config.load().plans["random_overloads"].event
    assert random.of.kind == "jam" and dict(random.ranges) == dict(random.of.draws)
    text = '[monte_carlo]\nevent = { type = "lumps", side = "right", number = 2, pause = ["0.1 s", 0.2], force = 9 }'
    random = config.parse(text).plans["random_overloads"].event
    assert dict(random.ranges) == {"pause": (0.1, 0.2)} and random.p.number == 2.0
    values = [random.draw(np.random.default_rng(k))["pause"] for k in range(200)]
    assert 0.1 <= min(values) < 0.11 and 0.19 < max(values) <= 0.2
    event = random.event("right", {"pause": 0.15})
    assert (event.side, event.p.pause, event.p.force, event.p.number) == ("right", 0.15, 9.0, 2.0)


def test_random_overloads_that_the_drive_has_no_input_for_are_refused(tmp_path):
    text = QUICK + '[monte_carlo]\nruns = 3\nevent = { type = "dip", depth = [0.2, 0.9] }\n'
    with pytest.raises(
        InputError, match=r'monte_carlo\.event\.type = "dip": this motor\'s drive has no line'
    ):
        run_study(config.parse(text), tmp_path)


def test_sizing_takes_the_studys_own_one_sided_feed():
    text = event_line("feed_right", shift=0.7)
    assert one_sided_event(config.parse(text).events, "right").p.shift == 0.7
    assert one_sided_event(config.parse(text).events, "left").p.shift == 0.3
    assert one_sided_event(config.parse("").events, "left") == config.load().events["feed_left"]


def test_two_of_a_kind_run_beside_each_other(tmp_path):
    """Harder lumps ask more, at any crank angle; each has its own quantities in the result."""
    text = "event = [{ type = 'jam', side = 'left', force = 500, turns = 1 }, " + (
        "{ type = 'jam', side = 'left', force = 1500, turns = 1, crank_angle = '90 deg' }]\n"
    )
    study = run_study(config.parse(text + QUICK), tmp_path)
    assert study.findings.failure is None and study.runs.overloads == ["jam_left", "jam_left_2"]
    assert float(study.runs.series["jam_left_2"]["machine.left.processing_force"].max()) == pytest.approx(
        1510.0
    )
    assert float(study.runs.series["jam_left"]["machine.left.processing_force"].max()) == pytest.approx(510.0)
    for name, angle in (("jam_left", 0.0), ("jam_left_2", 0.5 * math.pi)):
        phi = study.runs.series[name]["motor.phi"].interp(time=study.runs.event_times[name])
        assert math.remainder(float(phi) / 25.0 - angle, 2.0 * math.pi) == pytest.approx(0.0, abs=2e-4)
    result = as_dict(study)
    assert result["event"]["jam_left_2"]["force"] == {"value": 1500.0, "unit": "N"}
    assert result["events"]["jam_left_2"]["title"] == "a lump jams the left side (2)"
    assert (
        result["origins"]["event.jam_left.force"] == "file" and "event.jam_left.rise" not in result["origins"]
    )


UNEVEN = """
start = "direct"
[system]
motor = "IE3 6-pole 0.55 kW, 80M"
[gear]
ratio = 33
[run]
settle_turns = 1
[[event]]
type = "jam"
side = "left"
crank_angle = "180 deg"
[[event]]
type = "lumps"
side = "right"
crank_angle = "280 deg"
[[event]]
type = "blocked"
crank_angle = "140 deg"
"""


def uneven():
    """The rig of the compiled system."""
    values = config.parse(UNEVEN)
    bars = cycle(values.machine, values.run.crank_speed, values.feed)
    return Rig(values.operation, catalogue_drive(values.drive, values.machine, bars, values.plate), None)


@pytest.mark.second
def test_an_event_begins_at_its_angle_however_uneven_the_turn_is():
    """An induction motor without a flywheel: at the mean speed the crank would be elsewhere."""
    rig = uneven()
    operation, events = rig.operation, list(config.parse(UNEVEN).events.values())
    with rig.from_rest() as simulation:
        run = start_up(rig, simulation, lambda time: None, {}).run
        saved, angle = simulation.save(), float(crank_angle(rig.drive, run)[-1])
        turns = only_whole_turns(rig.drive, run.sel(time=slice(saved - 1.1 * operation.turn, None)), 1)
        speed = 2.0 * math.pi / np.ptp(turns["time"].values)
        errors, of_mean_speed = [], []
        for event, lead in zip(events, lead_times(rig, simulation, events, angle, speed), strict=True):
            branch = follow(rig, simulation, event, saved + lead, saved + lead + 0.5).run
            time, phi = branch["time"].values, crank_angle(rig.drive, branch)
            errors.append(
                math.remainder(np.interp(saved + lead, time, phi) - event.p.crank_angle, 2.0 * math.pi)
            )
            ahead = angle_of_begin(event, angle) - angle
            assert 0.25 * math.pi <= ahead < 2.25 * math.pi
            before = np.interp(saved + ahead / speed, time, phi)
            of_mean_speed.append(math.remainder(before - event.p.crank_angle, 2.0 * math.pi))
            begins = branch.sel(time=slice(saved + lead + 1e-6, None))
            if event.kind == "jam":
                # the force rises from that time on, and not before
                name = "machine.left.processing_force"
                assert float(branch[name].sel(time=slice(None, saved + lead)).max()) == 10.0
                assert float(begins[name][1]) > 10.0
    assert np.abs(errors) == pytest.approx(0.0, abs=1e-5)
    assert np.max(np.abs(of_mean_speed)) > math.radians(0.3)


def test_an_event_does_not_wait_for_a_crank_that_hardly_turns():
    rig = uneven()
    half = 0.5 * rig.operation.crank_speed
    assert (
        longest_lead(rig, math.pi, 0.0)
        == longest_lead(rig, math.pi, half)
        == pytest.approx(2.0 * math.pi / half)
    )
    with rig.from_rest() as simulation:
        # at rest, and soon after: no angle is passed in so short a time
        simulation.run(0.001, 0.001)
        simulation.save()
        (lead,) = lead_times(rig, simulation, list(config.parse(UNEVEN).events.values())[:1], 0.0, 1e4)
    assert lead == pytest.approx(longest_lead(rig, math.pi, 1e4))


@pytest.fixture
def swell():
    """A type of event that the package does not have: the material of one side swells and stays."""

    class Swell(Event):
        """More material comes to one side."""

        kind, run = "swell", "swell_{side}"
        words, heading = "more material comes to the {side}", "swell {side}"
        role = Role.DUTY
        acts_on = ("{side}.material_mass",)

        @declaration
        class Parameters(Timing):
            """Quantities of the swell."""

            added: Value = quantity("kg", "material that comes", default=20.0, min=0.0)
            time: Value = quantity("s", "time in which it comes", default=0.5, above=0.0)

        def signals(self, normal, at, state):
            """The signal of the mass: it rises and stays."""
            (name,) = self.inputs
            return {name: Profile(normal[name], ((at, self.p.time, normal[name] + self.p.added),))}

    yield Swell
    del TYPES["swell"]


@pytest.mark.slow
def test_a_new_type_of_event_is_one_class(swell, tmp_path):
    """Defined here, it runs by a study file, on the terminal and the page, and as the event of random overloads."""
    from command import chainunit

    text = '[[event]]\ntype = "swell"\nside = "right"\nadded = "45 kg"\nturns = 1\n'
    (tmp_path / "swell.toml").write_text(f"{QUICK}{text}")
    process = chainunit("study", "swell.toml", "-o", "out", cwd=tmp_path)
    assert process.returncode == 0, process.stderr
    numbers = ResultEntries(json.loads((tmp_path / "out" / "result.json").read_text()))
    assert numbers["event"]["swell_right"]["added"] == {"value": 45.0, "unit": "kg"}
    steady, swelld = (numbers["answers"][name] for name in ("steady", "swell_right"))
    assert swelld["crank_torque_peak"]["value"] > 1.02 * steady["crank_torque_peak"]["value"]
    assert numbers["certificate"]["swell_right"]["energy_residual_share"]["value"] < 2e-3
    assert "swell right" in process.stdout
    assert "more material comes to the right" in (tmp_path / "out" / "report.html").read_text().lower()
    random = (
        config.parse('[monte_carlo]\nevent = { type = "swell", added = ["1 kg", "9 kg"] }')
        .plans["random_overloads"]
        .event
    )
    event = random.event("left", random.draw(np.random.default_rng(1)))
    assert isinstance(event, swell) and 1.0 <= event.p.added <= 9.0
    with pytest.raises(InputError, match=r"event\.swell_left\.added = -1 kg: must be >= 0 kg"):
        config.parse('[[event]]\ntype = "swell"\nside = "left"\nadded = -1')


def test_events_and_parameters_are_pickled():
    events = read_events(
        [{"type": "surge", "input": "press_force"}, {"type": "surge", "input": "left.force"}]
    )
    assert list(events) == ["surge_press_force", "surge_left_force"]
    assert {type(event) for event in events.values()} == {TYPES["surge"]}
    for event in events.values():
        again = pickle.loads(pickle.dumps(event))
        assert again == event and type(again) is type(event) and again.title == event.title
    model = read_linkage(Path(__file__).parents[1] / "examples" / "linkages" / "slider_crank_press.toml")
    machine = Machine(model, {"r": 0.07})
    for instance in (machine.p, model.Feed(press_force=3.0), model.Inputs(phi=1.0)):
        assert pickle.loads(pickle.dumps(instance)) == instance
    drawn = read_random_event({"type": "surge", "input": "press_force"}, "monte_carlo.event")
    assert drawn.heading == "surge of press_force" and drawn.title == "press_force rises"
    assert read_random_event({}, "monte_carlo.event").heading == "jam left or right"
    assert drawn.ranges == {"factor": (1.5, 4.0)} and drawn.identity()["input"] == "press_force"
