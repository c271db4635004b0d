"""Whether the model holds: the rule at its limits, its words, and where it stands."""

from __future__ import annotations

import math

import numpy as np
import pytest

from chainunit.studies.verdict import CRANK_GOOD, RESIDUAL, ROCKER_GOOD, ROCKER_GOOD_EMPTY, chains, two_bars

PULLED = {"steady": (20.0, 50.0), "jam_left": (5.0, 0.0)}
KEPT = {"steady": 1e-6, "jam_left": 1e-5}
CALLED = {"steady": "steady running", "jam_left": "a lump jams"}


def bars(speed=1.0, mode=5.0, slack=4.5, pulls=PULLED, residuals=KEPT, **more):
    return two_bars(speed, mode, slack, pulls, residuals, **more)


def below(x):
    return float(np.nextafter(x, 0.0))


def test_two_bars_hold_where_nothing_speaks_against_them():
    verdict = bars()
    assert verdict.holds == "true" and verdict.reasons == () and verdict.details(CALLED) == []
    assert verdict.text == "The model of the organs holds: two bars, the crank at 1.00 rad/s."
    # without weight or organs there is no mode, no slack speed and no pull
    nothing = bars(6.0, math.inf, math.inf, {"steady": (math.inf, math.inf)}, {"steady": 0.0})
    assert nothing.holds == "true"


@pytest.mark.parametrize("rod", [0, 1])
def test_a_pull_below_zero_spoils_its_run(rod):
    """Of webs and of walls: in an overload the model holds in part, in steady running not at all."""
    for run, holds in (("jam_left", "in part"), ("steady", "false")):
        for pull in (0.0, -1e-9, -995.0):
            pulls = PULLED | {run: tuple(pull if k == rod else 50.0 for k in (0, 1))}
            verdict = bars(pulls=pulls)
            assert verdict.holds == ("true" if pull == 0.0 else holds)
            told = [(r.topic, r.quantity, r.run, r.value, r.limit) for r in verdict.reasons]
            quantity = ("web_pull", "wall_pull")[rod]
            assert told == ([] if pull == 0.0 else [("pushed", quantity, run, pull, 0.0)])


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
        assert verdict.organ == "chains" and "organ =" not in verdict.text


def test_words_and_data():
    pulls = {"steady": (20.0, 50.0), "feed_left": (-44.3, -26.2), "jam_left": (5.0, -995.0)}
    verdict = bars(3.0, 5.0, 4.5, pulls)
    assert verdict.text == (
        "The model of the organs holds in part: two bars, the crank at 3.00 rad/s; bars are pushed, where a chain "
        "would go slack and snatch, in overloads; the rocker torque may be off by more than 10 %, as a chain "
        'resonates; organ = "chain" has chains.'
    )
    # once, with all runs, webs and walls
    assert verdict.details(CALLED | {"feed_left": "feed to left"}) == [
        "Bars that are pushed, where a chain would go slack and snatch: feed to left (web -44.3 N, wall -26.2 N); "
        "a lump jams (wall -995 N).",
        "Crank speed above that up to which two bars give the rocker torque to 10 %: 3.00 rad/s, limit 2.00 rad/s.",
    ]
    data = verdict.as_dict()
    assert data["holds"] == "in part" and data["speed"] == {"value": 3.0, "unit": "rad/s"}
    assert data["reasons"][2] == {
        "topic": "pushed",
        "quantity": "wall_pull",
        "run": "jam_left",
        "value": {"value": -995.0, "unit": "N"},
        "limit": {"value": 0.0, "unit": "N"},
    }
