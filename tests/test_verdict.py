"""Whether the model holds: the rule at its limits, its words, and where it stands."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from chainunit.capabilities.chains.judgement import chains
from chainunit.reading.results import as_data
from chainunit.study.organ_limits import CRANK_GOOD, ROCKER_GOOD, ROCKER_GOOD_EMPTY, LeastPull
from chainunit.study.remark import Remark
from chainunit.study.verdict import RESIDUAL, Verdict, balance_faults, two_bars


def rigid_links(speed, residuals, actual=None):
    """The verdict on a linkage without organs."""
    return Verdict("machine", "rigid links", speed, balance_faults(residuals), actual)


def foreign_machine(speed, residuals):
    """The verdict on a machine that is an FMU."""
    return Verdict("energy balance", None, speed, balance_faults(residuals))


def least(web, wall, at=("B", "A1")):
    """The least pulls of a run: at the ends half as large as in the mean, or half as small."""
    return {
        rod: LeastPull(pull - abs(pull) / 2.0, pin, pull)
        for rod, pull, pin in zip(("web", "wall"), (web, wall), at, strict=True)
    }


PULLED = {"steady": least(20.0, 50.0), "jam_left": least(5.0, 0.0)}
KEPT = {"steady": 1e-6, "jam_left": 1e-5}
CALLED = {"steady": "steady running", "jam_left": "a lump jams"}


def bars(speed=1.0, mode=5.0, slack=4.5, pulls=PULLED, residuals=KEPT, **more):
    return two_bars(speed, mode, slack, pulls, residuals, finer='take organ = "chain"', **more)


def below(x):
    return float(np.nextafter(x, 0.0))


def test_two_bars_hold_where_nothing_speaks_against_them():
    verdict = bars()
    assert verdict.holds == "true" and verdict.reasons == () and verdict.details(CALLED) == []
    assert verdict.text == "Model of the organs, two bars, crank at 1.00 rad/s: valid."
    # without weight or organs there is no mode, no slack speed and no pull
    nothing = bars(6.0, math.inf, math.inf, {}, {"steady": 0.0})
    assert nothing.holds == "true"


@pytest.mark.parametrize("rod", [0, 1])
def test_a_pull_below_zero_spoils_its_run(rod):
    """Of webs and of walls: in an overload the model holds in part, in steady running not at all."""
    for run, holds in (("jam_left", "in part"), ("steady", "false")):
        for pull in (0.0, -1e-9, -995.0):
            pulls = PULLED | {run: least(*(pull if k == rod else 50.0 for k in (0, 1)))}
            verdict = bars(pulls=pulls)
            assert verdict.holds == ("true" if pull == 0.0 else holds)
            told = [(r.topic, r.quantity, r.run, r.value, r.limit) for r in verdict.reasons]
            quantity = ("web_mean_pull", "wall_mean_pull")[rod]
            assert told == ([] if pull == 0.0 else [("pushed", quantity, run, pull, 0.0)])


def test_a_rod_of_which_only_an_end_is_pushed_is_no_slack_rod():
    """A heavy web whose lower end is pushed, with a mean pull of 1.1 kN at least: a chain stays taut there."""
    heavy = {"web": LeastPull(-341.0, "B", 1100.0), "wall": LeastPull(900.0, "B", 1500.0)}
    verdict = bars(pulls={"steady": heavy, "jam_left": heavy})
    assert verdict.holds == "in part" and verdict.caveat is None
    assert verdict.text.endswith(
        " Limits: in steady running, too, bar ends are in compression, where a chain sags."
    )
    (remark,) = verdict.details(CALLED)
    assert remark.code == "model-end-pushed" and remark.text == (
        "Bar ends in compression, where a chain sags (force in that pin, hardly the torques): steady running (web "
        "end pull at B -341 N); a lump jams (web end pull at B -341 N)."
    )
    assert [(r["topic"], r["quantity"], r["place"]) for r in as_data(verdict)["reasons"]] == [
        ("end pushed", "web_pull", "B")
    ] * 2
    # once the mean pull is lost, the end is no news
    assert [r.topic for r in bars(pulls={"steady": least(-1.0, 50.0)}).reasons] == ["pushed"]


def test_a_pull_below_zero_in_the_start_up_is_told_by_name():
    started = PULLED | {"start_up": least(-1304.0, -433.0)}
    verdict = bars(pulls=started)
    assert verdict.holds == "in part" and "Limits: in the start-up bars are in compression" in verdict.text
    words = (
        "Bars in compression, where a chain goes slack: start-up (web mean pull "
        "-1304 N, wall mean pull -433 N)."
    )
    assert verdict.details(CALLED | {"start_up": "start-up"}) == [Remark("model-pushed", "fault", words)]
    both = bars(pulls=started | {"jam_left": least(-1.0, 1.0)})
    assert "in the start-up and in overloads bars are" in both.text


def test_the_speed_is_the_one_that_the_crank_has():
    """Judged at the larger one that is asked for, which is named as such."""
    slow = bars(30.0, 50.0, 4.58, actual=1.57)
    assert "two bars, crank at 1.57 rad/s, judged at the required 30.0 rad/s: not valid. " in slow.text
    assert slow.details(CALLED)[0].text == "A web goes slack from a crank speed of 4.58 rad/s on."
    data = as_data(slow)
    assert (data["speed"]["value"], data["reached"]["value"]) == (30.0, 1.57)
    assert "required" not in bars(3.0, actual=2.999).text
    assert bars(1.57, 50.0, 0.0).details(CALLED)[0].text == "A web is slack at rest already."


def test_each_reason_has_its_own_remedy():
    stiff = bars(residuals=KEPT | {"jam_left": 2e-3})
    assert stiff.text.endswith("in overloads the energy balance is not kept. Shorten run.step.")
    # the value of the key that would do, where it is known: the residual falls with the square of the step at least
    for residual, step in ((1.55 * RESIDUAL, "0.5"), (5.0 * RESIDUAL, "0.25")):
        named = replace(rigid_links(6.0, {"surge": residual}), step=1e-3)
        assert named.text.endswith(f'is not kept. Shorten run.step: run.step = "{step} ms".')
    assert replace(rigid_links(6.0, {"surge": 1.0}), step=1e-3).text.endswith(". Shorten run.step.")
    both = bars(3.0, residuals=KEPT | {"jam_left": 2e-3})
    assert both.text.endswith('. Take organ = "chain"; shorten run.step.')
    assert of_chains(independent=71.0).text.endswith(". Raise chain.starts.")


def test_what_rests_on_a_model_that_does_not_hold_carries_a_caveat():
    spoiled = bars(pulls=PULLED | {"steady": least(-1.0, 1.0)})
    assert spoiled.caveat == as_data(spoiled)["caveat"] == "for two bars, which do not hold here"
    assert bars().caveat is None and as_data(bars())["caveat"] is None
    assert bars(pulls=PULLED | {"jam_left": least(-1.0, 1.0)}).caveat is None


def test_the_speed_against_modes_and_slack():
    mode = 5.0
    for share, topic, holds in (
        (ROCKER_GOOD, "rocker torque", "in part"),
        (CRANK_GOOD, "crank torque", "false"),
    ):
        at_limit, beyond = bars(share * mode, mode), bars(float(np.nextafter(share * mode, 9.0)), mode)
        assert topic not in [r.topic for r in at_limit.reasons]
        assert [r.topic for r in beyond.reasons] == [topic] and beyond.holds == holds
        assert beyond.reasons[0].limit == share * mode
    # an empty side resonates earlier: in all runs, or in those in which it empties
    speed = float(np.nextafter(ROCKER_GOOD_EMPTY * mode, 9.0))
    assert bars(speed, mode).holds == "true"
    for empty, runs in (({""}, [""]), ({"feed_left", "right_empties"}, ["feed_left", "right_empties"])):
        reasons = bars(speed, mode, empty=empty).reasons
        assert [(r.topic, r.run) for r in reasons] == [("rocker torque", run) for run in runs]
    assert bars(below(1.5), mode, 1.5).holds == "true" and bars(1.5, mode, 1.5).holds == "false"
    # a web that hangs slack at rest
    assert bars(0.5, mode, 0.0).reasons[0].topic == "slack speed"


def test_an_energy_balance_that_is_not_kept():
    for run, holds in (("jam_left", "in part"), ("steady", "false")):
        assert bars(residuals=KEPT | {run: below(RESIDUAL)}).holds == "true"
        for share in (RESIDUAL, math.nan):
            verdict = bars(residuals=KEPT | {run: share})
            assert verdict.holds == holds and [r.topic for r in verdict.reasons] == ["energy"]


def test_a_shorter_step_is_no_advice_for_a_crank_that_stalls():
    """It moves hardly any energy, so that the residual over the energy moved says nothing of the step."""
    turning, stalled = (rigid_links(3.0, {"steady": 0.1}, actual=speed) for speed in (2.9, 0.05))
    assert "Shorten run.step" in turning.text and "shorten run.step" not in stalled.text
    assert stalled.holds == "false" and "the energy balance is not kept" in stalled.text


def test_the_model_of_a_machine_that_stands_is_not_called_valid():
    assert ": would be valid if the crank turned." in rigid_links(3.0, {"steady": 1e-6}, actual=0.05).text
    assert "would be" not in rigid_links(3.0, {"steady": 1e-6}, actual=2.0).text


def test_of_a_machine_that_is_not_known_only_the_energy_balance_is_judged():
    kept, lost = (foreign_machine(3.0, {"steady": share}) for share in (1e-6, 1.0))
    assert (kept.holds, kept.caveat) == ("true", None) and as_data(kept)["model"] is None
    assert kept.text == ("Energy balance of a machine that is an FMU, crank at 3.00 rad/s: valid.")
    assert lost.holds == "false" and lost.caveat == "the energy balance does not hold here"
    assert "rigid links" not in kept.text and "organs" not in lost.text


def of_chains(fold=0.1, slack=0.0, independent=300.0, residuals=KEPT, run="steady"):
    return chains(3.0, residuals, {run: fold}, 2.0, {run: slack}, independent, 72)


def test_chains_at_their_limits():
    assert of_chains().holds == "true" and of_chains(fold=2.0, independent=72.0).holds == "true"
    for given, topic, holds in (
        ({"fold": 2.01}, "folded", "in part"),
        ({"fold": 3.15}, "folded through", "false"),
        ({"fold": 3.15, "run": "jam_left"}, "folded through", "in part"),
        ({"slack": 1e-4}, "slack", "in part"),
        ({"independent": 71.0}, "starts", "in part"),
        ({"residuals": {"steady": 2e-3}}, "energy", "false"),
    ):
        verdict = of_chains(**given)
        assert [r.topic for r in verdict.reasons] == [topic] and verdict.holds == holds
        assert verdict.model == "chains" and "organ =" not in verdict.text


def test_words_and_data():
    pulls = {"steady": least(20.0, 50.0), "feed_left": least(-44.3, -26.2), "jam_left": least(5.0, -995.0)}
    verdict = bars(3.0, 5.0, 4.5, pulls)
    assert verdict.text == (
        "Model of the organs, two bars, crank at 3.00 rad/s: valid in steady running for crank torque and motor "
        "(10 %). Limits: in overloads bars are in compression, where a chain goes slack: rocker torque and organ "
        "forces are no predictions; the rocker torque may be off by more than 10 %, as a chain resonates. "
        'Take organ = "chain".'
    )
    # once, with all runs, webs and walls
    remarks = verdict.details(CALLED | {"feed_left": "feed to left"})
    assert [each.code for each in remarks] == ["model-pushed", "model-rocker-torque"]
    assert tuple(each.text for each in remarks) == (
        "Bars in compression, where a chain goes slack: feed to left (web mean pull -44.3 N, "
        "wall mean pull -26.2 N); a lump jams (wall mean pull -995 N).",
        "Rocker torque of two bars: 10 % up to a crank speed of 2.00 rad/s.",
    )
    data = as_data(verdict)
    assert data["holds"] == "in part" and data["speed"] == {"value": 3.0, "unit": "rad/s", "kind": "speed"}
    assert data["reasons"][2] == {
        "topic": "pushed",
        "quantity": "wall_mean_pull",
        "run": "jam_left",
        "place": None,
        "value": {"value": -995.0, "unit": "N"},
        "limit": {"value": 0.0, "unit": "N"},
    }
